//! Albedos of the coat and of sheen, tabulated over cosine and roughness.
//!
//! `tables.bin` (little-endian f32) is written by `cargo run --release --example lobe_tables` from
//! [`super::quadrature::tables`]; `tables_tests.rs` holds it against quadrature.

use crate::math::lanes::safe_sqrt;
use simd::{Float, Lanes, Uint};

/// Cosines of the coat's tables.
pub const COAT_COLUMNS: usize = 32;
/// Roughnesses of the coat's tables, perceptual, 0 to 1. With half as many the error is 5.6e-3 at alpha 1e-4, grazing.
pub const COAT_ROWS: usize = 64;
/// Columns of the coat are even in `mu (1 + w a) / (mu + w a)`: what happens at angles of alpha from grazing, however small
/// alpha is, has half the columns.
pub const COAT_WARP: f64 = 2.0;
/// Cosines of the tables of sheen, even in the fourth root, from the least to 1.
pub const SHEEN_COLUMNS: usize = 64;
/// The fourth root of [`super::sheen::LEAST_COSINE`].
pub const SHEEN_LEAST_ROOT: f32 = 0.1;
/// Roughnesses of the tables of sheen, perceptual, from the least to 1, even in the square root of what is above the least.
pub const SHEEN_ROWS: usize = 64;

const COAT: usize = COAT_COLUMNS * COAT_ROWS;
const SHEEN: usize = SHEEN_COLUMNS * SHEEN_ROWS;
const BYTES: &[u8; 8 * (COAT + SHEEN)] = include_bytes!("tables.bin");

static VALUES: [f32; 2 * (COAT + SHEEN)] = decoded();

const fn decoded() -> [f32; 2 * (COAT + SHEEN)] {
    let mut values = [0.0; 2 * (COAT + SHEEN)];
    let mut i = 0;
    while i < values.len() {
        values[i] = f32::from_le_bytes([BYTES[4 * i], BYTES[4 * i + 1], BYTES[4 * i + 2], BYTES[4 * i + 3]]);
        i += 1;
    }
    values
}

/// The value at `(x, y)` in [0, 1]^2 of the table that starts at `at`, bilinear.
#[inline(always)]
fn bilinear<L: Lanes>(at: usize, columns: usize, rows: usize, x: L::F, y: L::F) -> L::F {
    let (zero, one) = (L::F::zero(), L::F::one());
    let x = x.max(zero).min(one) * L::F::splat((columns - 1) as f32);
    let y = y.max(zero).min(one) * L::F::splat((rows - 1) as f32);
    let left = x.floor().min(L::F::splat((columns - 2) as f32));
    let top = y.floor().min(L::F::splat((rows - 2) as f32));
    let (x, y) = (x - left, y - top);
    let cell = left.to_uint() + top.to_uint() * L::U::splat(columns as u32) + L::U::splat(at as u32);
    let below = cell + L::U::splat(columns as u32);
    let next = L::U::splat(1);
    let (a, b) = (cell.gather(&VALUES), (cell + next).gather(&VALUES));
    let (c, d) = (below.gather(&VALUES), (below + next).gather(&VALUES));
    let (upper, lower) = ((b - a).mul_add(x, a), (d - c).mul_add(x, c));
    (lower - upper).mul_add(y, upper)
}

/// Of the coat at cosine `mu` > 0 and perceptual `roughness`: its albedo over the reflectance of a smooth one at `mu`, with
/// multiple scattering; and the albedo of GGX with reflectance 1, single scattering.
#[inline(always)]
pub fn coat<L: Lanes>(mu: L::F, roughness: L::F) -> [L::F; 2] {
    let warp = L::F::splat(COAT_WARP as f32) * roughness * roughness;
    let x = mu * (L::F::one() + warp) / (mu + warp);
    [
        bilinear::<L>(0, COAT_COLUMNS, COAT_ROWS, x, roughness),
        bilinear::<L>(COAT, COAT_COLUMNS, COAT_ROWS, x, roughness),
    ]
}

/// Albedo of white sheen at cosine `mu` > 0 and perceptual `roughness`: as its formula has it, which may exceed 1, and as
/// shaded, at most 1.
#[inline(always)]
pub fn sheen<L: Lanes>(mu: L::F, roughness: L::F) -> [L::F; 2] {
    let one = L::F::one();
    let least = L::F::splat(super::sheen::LEAST_ROUGHNESS);
    let above = (roughness - least) * L::F::splat(1.0 / (1.0 - super::sheen::LEAST_ROUGHNESS));
    let x = (mu.sqrt().sqrt() - L::F::splat(SHEEN_LEAST_ROOT)) * L::F::splat(1.0 / (1.0 - SHEEN_LEAST_ROOT));
    let y = safe_sqrt(above);
    let raw = bilinear::<L>(2 * COAT, SHEEN_COLUMNS, SHEEN_ROWS, x, y);
    // The table has the quotient, which has no kink where the formula passes 1.
    let share = bilinear::<L>(2 * COAT + SHEEN, SHEEN_COLUMNS, SHEEN_ROWS, x, y);
    [raw, (raw.min(one) * share).min(one)]
}

#[cfg(test)]
#[path = "tables_tests.rs"]
mod tests;

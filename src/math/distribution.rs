//! Discrete distributions that N lanes search: the upper ends of the entries' shares of [0, 1).

use simd::{Float, Lanes, Uint};

/// Stands for the end of everything: no number of [0, 1) reaches it.
const END: f32 = 2.0;

/// Appends the upper ends of the shares of `weights` (>= 0, any scale), summed in f64 and padded to a power of two. From
/// the last positive weight on all ends are above 1, so that rounding can neither run over nor find an entry without weight.
pub fn push_ends(weights: &[f64], ends: &mut Vec<f32>) {
    let total: f64 = weights.iter().sum();
    let last = weights.iter().rposition(|&w| w > 0.0).unwrap_or(0);
    let start = ends.len();
    let mut sum = 0.0;
    ends.extend(weights[..last].iter().map(|w| {
        sum += w;
        (sum / total) as f32
    }));
    ends.resize(start + weights.len().next_power_of_two(), END);
}

/// The index (within the table, from 0) of the entry whose share holds `u`, in the table of `count` ends (a power of
/// two) that starts at `first`. By bisection: unlike an alias table it keeps the stratification of `u`.
#[inline(always)]
pub fn find<L: Lanes>(ends: &[f32], first: L::U, count: u32, u: L::F) -> L::U {
    let mut at = L::U::splat(0);
    let mut step = count / 2;
    while step > 0 {
        let end = (first + at + L::U::splat(step - 1)).gather(ends);
        at = (at + L::U::splat(step)).or_else(u.ge(end), at);
        step /= 2;
    }
    at
}

/// [`find`] in tables of `counts` ends (powers of two, at most `most`).
#[inline(always)]
pub fn find_each<L: Lanes>(ends: &[f32], first: L::U, counts: L::U, most: u32, u: L::F) -> L::U {
    let mut at = L::U::splat(0);
    let mut step = most / 2;
    while step > 0 {
        let by = L::U::splat(step);
        let end = (first + at + L::U::splat(step - 1)).gather(ends);
        at = (at + by).or_else(by.lt(counts) & u.ge(end), at);
        step /= 2;
    }
    at
}

/// [`find`], and where in the entry's share `u` lies, in [0, 1): a number that can be used again.
#[inline(always)]
pub fn find_within<L: Lanes>(ends: &[f32], first: L::U, count: u32, u: L::F) -> (L::U, L::F) {
    let at = find::<L>(ends, first, count, u);
    let (zero, one) = (L::F::zero(), L::F::one());
    let is_first = at.eq(L::U::splat(0));
    let before = (first + at - L::U::splat(0).or_else(is_first, L::U::splat(1))).gather(ends);
    let low = zero.or_else(is_first, before);
    let high = (first + at).gather(ends).min(one);
    let within = (u - low) / (high - low).max(L::F::splat(f32::MIN_POSITIVE));
    (at, within.max(zero).min(L::F::splat(BELOW_1)))
}

/// The largest f32 below 1.
const BELOW_1: f32 = 1.0 - f32::EPSILON / 2.0;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::lanes::tests::at_all_levels;
    use simd::Kernel;

    #[test]
    fn numbers_find_the_share_they_lie_in() {
        #[derive(Clone)]
        struct Check;
        impl Kernel for Check {
            type Output = ();

            #[inline(always)]
            fn run<L: Lanes>(self) {
                let mut ends = vec![0.25];
                push_ends(&[0.0, 1.0, 0.0, 2.0, 1.0, 0.0], &mut ends);
                assert_eq!(ends.len(), 9);
                for (u, index, within) in [
                    (0.0, 1, 0.0),
                    (0.125, 1, 0.5),
                    (0.25, 3, 0.0),
                    (0.5, 3, 0.5),
                    (0.749_999_9, 3, 1.0),
                    (0.75, 4, 0.0),
                    (BELOW_1, 4, 1.0),
                ] {
                    let (at, t) = find_within::<L>(&ends, L::U::splat(1), 8, L::F::splat(u));
                    let (mut indices, mut ts) = ([0; 16], [0.0; 16]);
                    at.store(&mut indices, 0);
                    t.store(&mut ts, 0);
                    assert_eq!(indices[0], index, "{u}");
                    assert!((ts[0] - within).abs() < 1e-6 && ts[0] < 1.0, "{u}: {}", ts[0]);
                }
            }
        }
        at_all_levels(Check);
    }
}

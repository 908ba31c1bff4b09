//! Nanoseconds per element of two kernels of the path tracer's kind, at every level that this CPU has.
//!
//! `cargo run --release -p simd --example lanes`
//!
//! `points`: four Owen-scrambled Sobol coordinates (u32 lanes). `shade`: three 16-byte records by index, a visible normal
//! of GGX, evaluation, roulette, survivors packed to the front (f32 lanes). Both follow the renderer's own kernels; they
//! are copied here because this crate knows nothing of the renderer. Decision 0002 in `docs/decisions` rests on them.

use simd::{Float, Kernel, Lanes, Level, Mask, Uint, dispatch};
use std::f32::consts::{FRAC_1_PI, PI};
use std::hint::black_box;
use std::time::Instant;

/// Elements per call: the paths of one worker.
pub const COUNT: usize = 2048;
const TRIANGLES: usize = 4096;
const MATERIALS: usize = 64;
/// Bits of the sample index.
const INDEX_BITS: u32 = 20;

/// What both kernels read.
pub struct Inputs {
    /// Pixel, sample index, group of dimensions.
    pub keys: [Vec<u32>; 3],
    /// Triangle of each hit.
    pub prim: Vec<u32>,
    /// Towards the viewer, unit.
    pub wo: [Vec<f32>; 3],
    /// Random numbers in [0, 1): direction, lobe, roulette.
    pub u: [Vec<f32>; 4],
    /// Normal and, as bits, material.
    pub triangles: Vec<[f32; 4]>,
    /// Base colour and metallic, then f0 and roughness, by turns.
    pub materials: Vec<[f32; 4]>,
    /// Columns of the Sobol matrices of dimensions 1 to 3, bits reversed.
    pub columns: [[u32; INDEX_BITS as usize]; 3],
}

/// What they write: `COUNT` elements, and room for a last full vector.
#[derive(Clone, PartialEq)]
pub struct Outputs {
    /// Coordinates.
    pub points: [Vec<f32>; 4],
    /// Of the survivors: direction, weight, density.
    pub paths: [Vec<f32>; 7],
    /// Of the survivors: where they came from.
    pub slots: Vec<u32>,
    /// Survivors.
    pub survivors: usize,
}

impl Inputs {
    /// From a hash with a fixed start.
    pub fn same_every_time() -> Self {
        let mut state = 1u32;
        let mut next = || {
            state = mix1(state.wrapping_add(0x9e37_79b9));
            state
        };
        let unit = |v: u32| (v >> 8) as f32 / 16_777_216.0;
        let mut u32s = |below: u32| -> Vec<u32> { (0..COUNT).map(|_| next() % below).collect() };
        let keys = [u32s(1 << 20), u32s(1 << 12), u32s(12)];
        let prim = u32s(TRIANGLES as u32);
        let u = [0; 4].map(|_| u32s(u32::MAX).into_iter().map(unit).collect());
        let mut direction = || {
            let (z, phi) = (2.0 * unit(next()) - 1.0, 2.0 * PI * unit(next()));
            let r = (1.0 - z * z).sqrt();
            [r * phi.cos(), r * phi.sin(), z]
        };
        let wos: Vec<[f32; 3]> = (0..COUNT).map(|_| direction()).collect();
        let triangles = (0..TRIANGLES)
            .map(|i| {
                let [x, y, z] = direction();
                [x, y, z, f32::from_bits(mix1(i as u32) % MATERIALS as u32)]
            })
            .collect();
        let materials = (0..2 * MATERIALS).map(|i| {
            let [a, b, c, d] = [0, 1, 2, 3].map(|k| unit(mix1(1000 + 4 * i as u32 + k)));
            if i % 2 == 0 { [a, b, c, if d < 0.5 { 0.0 } else { d }] } else { [0.04, 0.04, 0.04, d] }
        });
        Self {
            keys,
            prim,
            wo: [0, 1, 2].map(|k| wos.iter().map(|w| w[k]).collect()),
            u,
            triangles,
            materials: materials.collect(),
            columns: [columns(1, 0, [1, 0, 0]), columns(2, 1, [1, 3, 0]), columns(3, 1, [1, 3, 1])],
        }
    }
}

impl Outputs {
    /// All zero.
    pub fn zeroed() -> Self {
        let zeroes = vec![0.0; COUNT + 16];
        Self {
            points: [0; 4].map(|_| zeroes.clone()),
            paths: [0; 7].map(|_| zeroes.clone()),
            slots: vec![0; COUNT + 16],
            survivors: 0,
        }
    }
}

/// Generator matrix for a primitive polynomial, bits reversed; after Joe and Kuo 2008.
fn columns(s: usize, a: u32, m: [u32; 3]) -> [u32; INDEX_BITS as usize] {
    let mut v = [0u32; INDEX_BITS as usize];
    for i in 0..v.len() {
        v[i] = if i < s {
            m[i] << (31 - i)
        } else {
            (1..s).fold(v[i - s] ^ (v[i - s] >> s), |x, k| x ^ (((a >> (s - 1 - k)) & 1) * v[i - k]))
        };
    }
    v.map(u32::reverse_bits)
}

fn mix1(mut x: u32) -> u32 {
    x = (x ^ (x >> 16)).wrapping_mul(0x7feb_352d);
    x = (x ^ (x >> 15)).wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

// The kernels. From here to `main` is what the decision compares line by line.

/// Four Sobol coordinates of every key.
pub struct Points<'a>(pub &'a Inputs, pub &'a mut Outputs);

/// A shading step of every hit.
pub struct Shade<'a>(pub &'a Inputs, pub &'a mut Outputs);

impl Kernel for Points<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self(input, out) = self;
        for at in (0..COUNT).step_by(L::N) {
            let [pixel, index, group] = [0, 1, 2].map(
                #[inline(always)]
                |k: usize| L::U::load(&input.keys[k], at),
            );
            let p = sobol_4d::<L>(&input.columns, pixel, index, group);
            for (p, out) in p.into_iter().zip(&mut out.points) {
                p.store(out, at);
            }
        }
    }
}

#[inline(always)]
fn mix<L: Lanes>(x: L::U) -> L::U {
    let x = (x ^ x.shr(16)) * L::U::splat(0x7feb_352d);
    let x = (x ^ x.shr(15)) * L::U::splat(0x846c_a68b);
    x ^ x.shr(16)
}

#[inline(always)]
fn owen_reversed<L: Lanes>(x: L::U, seed: L::U) -> L::U {
    let x = x ^ (x * L::U::splat(0x3d20_adea));
    let x = x + seed;
    let x = x * (seed.shr(16) | L::U::splat(1));
    let x = x ^ (x * L::U::splat(0x0552_6c56));
    x ^ (x * L::U::splat(0x53a2_2864))
}

#[inline(always)]
fn finish<L: Lanes>(reversed: L::U, seed: L::U) -> L::F {
    let bits = owen_reversed::<L>(reversed, mix::<L>(seed)).reverse_bits();
    bits.shr(8).to_float() * L::F::splat(1.0 / 16_777_216.0)
}

#[inline(always)]
fn sobol_4d<L: Lanes>(columns: &[[u32; 20]; 3], pixel: L::U, index: L::U, group: L::U) -> [L::F; 4] {
    let epoch = index.shr(INDEX_BITS);
    let seed = mix::<L>(pixel ^ ((group + epoch.shl(16)) * L::U::splat(0x9e37_79b9)));
    let low = L::U::splat((1 << INDEX_BITS) - 1);
    let key = mix::<L>(seed ^ L::U::splat(0x1157_0ab3));
    let shuffled = owen_reversed::<L>(index.reverse_bits(), key).reverse_bits() & low;
    let zero = L::U::splat(0);
    let (mut x1, mut x2, mut x3) = (zero, zero, zero);
    for bit in 0..INDEX_BITS {
        let set = shuffled.has(1 << bit);
        x1 = x1 ^ L::U::splat(columns[0][bit as usize]).or_else(set, zero);
        x2 = x2 ^ L::U::splat(columns[1][bit as usize]).or_else(set, zero);
        x3 = x3 ^ L::U::splat(columns[2][bit as usize]).or_else(set, zero);
    }
    [
        finish::<L>(shuffled, seed + L::U::splat(0x0000_0001)),
        finish::<L>(x1, seed + L::U::splat(0x5851_f42d)),
        finish::<L>(x2, seed + L::U::splat(0x4c95_7f2d)),
        finish::<L>(x3, seed + L::U::splat(0x1405_7b7e)),
    ]
}

type V3<L> = [<L as Lanes>::F; 3];

#[inline(always)]
fn dot<L: Lanes>(a: V3<L>, b: V3<L>) -> L::F {
    a[0].mul_add(b[0], a[1].mul_add(b[1], a[2] * b[2]))
}

#[inline(always)]
fn scale<L: Lanes>(a: V3<L>, s: L::F) -> V3<L> {
    [a[0] * s, a[1] * s, a[2] * s]
}

#[inline(always)]
fn add<L: Lanes>(a: V3<L>, b: V3<L>) -> V3<L> {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

#[inline(always)]
fn select<L: Lanes>(mask: L::M, a: V3<L>, b: V3<L>) -> V3<L> {
    [a[0].or_else(mask, b[0]), a[1].or_else(mask, b[1]), a[2].or_else(mask, b[2])]
}

#[inline(always)]
fn normalized<L: Lanes>(a: V3<L>) -> V3<L> {
    scale::<L>(a, L::F::one() / dot::<L>(a, a).sqrt())
}

#[inline(always)]
fn max_component<L: Lanes>(a: V3<L>) -> L::F {
    a[0].max(a[1]).max(a[2])
}

/// `f0 + (1 - f0) s5`
#[inline(always)]
fn schlick<L: Lanes>(f0: V3<L>, s5: L::F) -> V3<L> {
    let one = L::F::one();
    [f0[0] + (one - f0[0]) * s5, f0[1] + (one - f0[1]) * s5, f0[2] + (one - f0[2]) * s5]
}

#[inline(always)]
fn pow5<L: Lanes>(v: L::F) -> L::F {
    let v2 = v * v;
    v2 * v2 * v
}

#[inline(always)]
fn cos_sin_2pi<L: Lanes>(u: L::F) -> (L::F, L::F) {
    let (f, i) = (L::F::splat, L::U::splat);
    let q = (u * f(4.0) + f(0.5)).floor();
    let x = (u - q * f(0.25)) * f(2.0 * PI);
    let x2 = x * x;
    let sin = x * x2.mul_add(x2.mul_add(x2.mul_add(f(-1.0 / 5040.0), f(1.0 / 120.0)), f(-1.0 / 6.0)), f(1.0));
    let cos = x2.mul_add(x2.mul_add(f(-1.0 / 720.0), f(1.0 / 24.0)), f(-0.5)).mul_add(x2, f(1.0));
    let q = q.to_uint();
    let odd = q.has(1);
    let (c, s) = (sin.or_else(odd, cos), cos.or_else(odd, sin));
    let (c_sign, s_sign) = (((q + i(1)) & i(2)).shl(30), (q & i(2)).shl(30));
    ((c.to_bits() ^ c_sign).to_float_bits(), (s.to_bits() ^ s_sign).to_float_bits())
}

#[inline(always)]
fn masking<L: Lanes>(w: V3<L>, a2: L::F) -> L::F {
    let tan2 = (w[0] * w[0] + w[1] * w[1]) / (w[2] * w[2]);
    ((L::F::one() + a2 * tan2).sqrt() - L::F::one()) * L::F::splat(0.5)
}

impl Kernel for Shade<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self(input, out) = self;
        let f = L::F::splat;
        let (zero, one) = (f(0.0), f(1.0));
        let mut to = 0;
        for at in (0..COUNT).step_by(L::N) {
            // The records and the frame.
            let [nx, ny, nz, m] = L::U::load(&input.prim, at).records(&input.triangles);
            let m = m.to_bits().shl(1);
            let [r, g, b, metallic] = m.records(&input.materials);
            let [fr, fg, fb, roughness] = (m | L::U::splat(1)).records(&input.materials);
            let [wx, wy, wz] = &input.wo;
            let wo: V3<L> = [L::F::load(wx, at), L::F::load(wy, at), L::F::load(wz, at)];
            let n: V3<L> = scale::<L>([nx, ny, nz], one.copysign(dot::<L>([nx, ny, nz], wo)));
            let sign = one.copysign(n[2]);
            let fa = -(one / (sign + n[2]));
            let fxy = n[0] * n[1] * fa;
            let fx: V3<L> = [one + sign * n[0] * n[0] * fa, sign * fxy, -(sign * n[0])];
            let fy: V3<L> = [fxy, sign + n[1] * n[1] * fa, -n[1]];
            let wo: V3<L> = [dot::<L>(fx, wo), dot::<L>(fy, wo), dot::<L>(n, wo).max(f(1e-6))];

            // Shares of the lobes.
            let (base, f0): (V3<L>, V3<L>) = ([r, g, b], [fr, fg, fb]);
            let alpha = (roughness * roughness).max(f(1e-4));
            let a2 = alpha * alpha;
            let dielectric = one - metallic;
            let s5 = pow5::<L>(one - wo[2].min(one));
            let (metal, layer) = (schlick::<L>(base, s5), schlick::<L>(f0, s5));
            let reflected = add::<L>(scale::<L>(metal, metallic), scale::<L>(layer, dielectric));
            let diffused = scale::<L>(base, dielectric * (one - max_component::<L>(layer)));
            let (rm, dm) = (max_component::<L>(reflected), max_component::<L>(diffused));
            let pmf = (rm / (rm + dm).max(f(1e-30))).min(one);

            // A direction: cosine-weighted, or mirrored at a visible normal (bounded spherical cap).
            let u = |k: usize| L::F::load(&input.u[k], at);
            let (cos_phi, sin_phi) = cos_sin_2pi::<L>(u(1));
            let rho = u(0).sqrt();
            let diffuse: V3<L> = [rho * cos_phi, rho * sin_phi, (one - u(0)).max(zero).sqrt()];
            let flat2 = wo[0] * wo[0] + wo[1] * wo[1];
            let s = one + flat2.sqrt();
            let s2 = s * s;
            let bound = (one - a2) * s2 / (s2 + a2 * wo[2] * wo[2]);
            let stretched = normalized::<L>([wo[0] * alpha, wo[1] * alpha, wo[2]]);
            let bottom = bound * stretched[2];
            let z = (one - u(0)) * (one + bottom) - bottom;
            let rho = (one - z * z).max(zero).sqrt();
            let h: V3<L> = [rho * cos_phi + stretched[0], rho * sin_phi + stretched[1], z + stretched[2]];
            let h = normalized::<L>([h[0] * alpha, h[1] * alpha, h[2].max(f(1e-9))]);
            let cos_h = dot::<L>(wo, h);
            let k = cos_h + cos_h;
            let mirrored: V3<L> = [h[0] * k - wo[0], h[1] * k - wo[1], h[2] * k - wo[2]];
            let wi = select::<L>(u(2).lt(pmf), mirrored, diffuse);
            let above = wi[2].gt(zero);
            let wi: V3<L> = [wi[0], wi[1], wi[2].max(f(1e-12))];

            // Value and density.
            let cosine_pdf = wi[2] * f(FRAC_1_PI);
            let h = normalized::<L>(add::<L>(wo, wi));
            let s5 = pow5::<L>((one - dot::<L>(wo, h)).max(zero));
            let (metal, layer) = (schlick::<L>(base, s5), schlick::<L>(f0, s5));
            let diffuse = scale::<L>(base, dielectric * (one - max_component::<L>(layer)) * cosine_pdf);
            let e = (h[0] * h[0] + h[1] * h[1]) / a2 + h[2] * h[2];
            let d = f(FRAC_1_PI) / (a2 * e * e);
            let g2 = one / (one + masking::<L>(wo, a2) + masking::<L>(wi, a2));
            let reflectance = add::<L>(scale::<L>(metal, metallic), scale::<L>(layer, dielectric));
            let specular = scale::<L>(reflectance, d * g2 / (f(4.0) * wo[2]));
            let t = (a2 * flat2 + wo[2] * wo[2]).sqrt();
            let specular_pdf = d / (f(2.0) * (bound * wo[2] + t));
            let pdf = (one - pmf) * cosine_pdf + pmf * specular_pdf;
            let weight = scale::<L>(add::<L>(diffuse, specular), one / pdf);

            // Roulette, and the survivors packed to the front.
            let alive = above & u(3).lt(max_component::<L>(weight).min(f(0.95)));
            let world = |c: usize| fx[c] * wi[0] + fy[c] * wi[1] + n[c] * wi[2];
            let path = [world(0), world(1), world(2), weight[0], weight[1], weight[2], pdf];
            for (v, out) in path.into_iter().zip(&mut out.paths) {
                v.compress(alive, out, to);
            }
            (L::U::splat(at as u32) + L::U::lane_ids()).compress(alive, &mut out.slots, to);
            to += alive.count();
        }
        out.survivors = to;
    }
}

fn main() {
    let input = Inputs::same_every_time();
    let levels = [Level::Scalar, Level::Portable8, Level::Avx2, Level::Avx512];
    let levels: Vec<Level> = levels.into_iter().filter(|l| l.is_available()).collect();
    let mut outs: Vec<Outputs> = levels.iter().map(|_| Outputs::zeroed()).collect();
    // Levels by turns in short calls: one that was preempted is one of many.
    let mut ns = vec![[const { Vec::new() }; 2]; levels.len()];
    for _ in 0..2001 {
        for ((&level, out), ns) in levels.iter().zip(&mut outs).zip(&mut ns) {
            let start = Instant::now();
            dispatch(level, Points(black_box(&input), out));
            ns[0].push(start.elapsed().as_nanos());
            let start = Instant::now();
            dispatch(level, Shade(black_box(&input), out));
            ns[1].push(start.elapsed().as_nanos());
        }
    }
    println!("ns per element, median of 2001 calls of {COUNT} elements");
    println!("level     points  shade  survivors");
    for ((level, out), mut ns) in levels.iter().zip(&outs).zip(ns) {
        assert!(out.points == outs[0].points, "the points are the same bits at every level");
        let [points, shade] = [0, 1].map(|k| {
            ns[k].sort_unstable();
            ns[k][ns[k].len() / 2] as f64 / COUNT as f64
        });
        println!("{:8} {points:7.2} {shade:6.2} {:10}", level.name(), out.survivors);
    }
}

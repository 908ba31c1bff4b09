//! Thin-film iridescence (`KHR_materials_iridescence`): Belcour and Barla 2017, "A Practical Extension to Microfacet Theory
//! for the Modeling of Varying Iridescence", in the form of the extension's text, for RGB.
//!
//! The film replaces Fresnel's reflectance, so its albedo depends on roughness in a way of its own: it is put together
//! from the film's reflectance at some cosines and the shares of the albedo that come from there.

use super::energy::{FILM_NODES, film_cosine};
use super::surface::Extras;
use crate::math::V3;
use crate::math::lanes::{cos_sin_2pi, exp, lerp, pow5, safe_sqrt};
use simd::{Float, Lanes};

/// The film's reflectance over the metal and over the dielectric.
pub struct Film<L: Lanes> {
    factor: L::F,
    /// Of the film.
    ior: L::F,
    /// nm.
    thickness: L::F,
    metal_f0: V3<L>,
    layer_f0: V3<L>,
    /// Over the dielectric at the nodes' cosines: largest channel, and colour.
    at_nodes: [V3<L>; FILM_NODES],
    metal_at_nodes: [V3<L>; FILM_NODES],
    /// See [`Film::set_again`].
    again: V3<L>,
}

impl<L: Lanes> Film<L> {
    /// `None` where no lane has a film. `layer_f0` is the dielectric's reflectance at normal incidence, `metal_f0` the
    /// metal's; `metallic` is the share of the metal.
    #[inline(always)]
    pub fn new(extras: &Extras<L>, layer_f0: V3<L>, metal_f0: V3<L>, metallic: L::F) -> Option<Self> {
        let has = extras.iridescence.gt(L::F::zero());
        if !simd::Mask::any(has) {
            return None;
        }
        let mut film = Self {
            factor: extras.iridescence,
            ior: extras.iridescence_ior,
            thickness: extras.iridescence_thickness,
            metal_f0,
            layer_f0,
            at_nodes: [V3::zero(); FILM_NODES],
            metal_at_nodes: [V3::zero(); FILM_NODES],
            again: V3::zero(),
        };
        // Half of what a film costs: what no lane has any of is left out.
        let has_layer = simd::Mask::any(metallic.lt(L::F::one()));
        let has_metal = simd::Mask::any(metallic.gt(L::F::zero()));
        for k in 0..FILM_NODES {
            let c = L::F::splat(film_cosine(k));
            if has_layer {
                film.at_nodes[k] = film.reflectance(c, layer_f0);
            }
            if has_metal {
                film.metal_at_nodes[k] = film.reflectance(c, metal_f0);
            }
        }
        Some(film)
    }

    /// `metal` and `layer` (weighed) at cosine `c` with the film's share in them.
    #[inline(always)]
    pub fn fresnel(&self, c: L::F, metal: V3<L>, layer: V3<L>, weight: L::F) -> (V3<L>, V3<L>) {
        let over_metal = self.reflectance(c, self.metal_f0);
        let over_layer = self.reflectance(c, self.layer_f0).scale(weight);
        (metal.lerp(over_metal, self.factor), layer.lerp(over_layer, self.factor))
    }

    /// Averages as [`Film::fresnel`] over light of which the nodes' cosines have these `shares`.
    #[inline(always)]
    pub fn average(&self, shares: [L::F; FILM_NODES], metal: V3<L>, layer: V3<L>, weight: L::F) -> (V3<L>, V3<L>) {
        let (mut over_metal, mut over_layer) = (V3::zero(), V3::zero());
        for ((share, metal), layer) in shares.into_iter().zip(&self.metal_at_nodes).zip(&self.at_nodes) {
            over_metal = metal.mul_add(share, over_metal);
            over_layer = layer.mul_add(share, over_layer);
        }
        (metal.lerp(over_metal, self.factor), layer.lerp(over_layer.scale(weight), self.factor))
    }

    /// What the dielectric layer takes from what is below it, of its reflectance `mixed` with the film and `plain` without.
    /// Without a film that is the largest channel of all (the extensions' `rgb_mix`), so that the base does not get the
    /// layer's complementary colours. What a film does not reflect it lets through, colour by colour: white stays white.
    #[inline(always)]
    pub fn taken(&self, mixed: V3<L>, plain: V3<L>) -> V3<L> {
        let largest = V3::<L>::splat([1.0; 3]).scale(plain.max_component());
        mixed + (largest - plain).scale(L::F::one() - self.factor)
    }

    /// Sets the layer's reflectance of light that was reflected more than once; what is taken of it.
    #[inline(always)]
    pub fn set_again(&mut self, again: V3<L>) -> V3<L> {
        self.again = self.taken(again, again);
        self.again
    }

    /// What was set.
    #[inline(always)]
    pub fn again(&self) -> V3<L> {
        self.again
    }

    /// What the layer takes of light with these `shares`, where without the film it takes `layer`.
    #[inline(always)]
    pub fn toward(&self, shares: [L::F; FILM_NODES], layer: L::F, weight: L::F) -> V3<L> {
        let mut over_layer = V3::zero();
        for (share, layer) in shares.into_iter().zip(&self.at_nodes) {
            over_layer = layer.mul_add(share, over_layer);
        }
        V3::<L>::splat([1.0; 3]).scale(layer).lerp(over_layer.scale(weight), self.factor)
    }

    /// Of the film over a base of reflectance `base_f0` at normal incidence, seen from air at cosine `c`; in [0, 1].
    #[inline(always)]
    fn reflectance(&self, c: L::F, base_f0: V3<L>) -> V3<L> {
        let (zero, one) = (L::F::zero(), L::F::one());
        // The film's index fades to that of air where it is thinner than 0.03 nm.
        let thin = (self.thickness * L::F::splat(1.0 / 0.03)).min(one).max(zero);
        let eta = lerp(one, self.ior, thin * thin * (L::F::splat(3.0) - thin - thin));
        let cos2 = one - (one - c * c) / (eta * eta);
        let is_total = cos2.lt(zero);
        let cos_film = safe_sqrt(cos2);
        let r0 = normal_incidence::<L>(eta, one);
        let r12 = r0 + (one - r0) * pow5((one - c).max(zero));
        let t121 = one - r12;
        // Light that goes once more through the film is this much behind, nm.
        let path = (eta + eta) * self.thickness * cos_film;
        let x = Channel::<L>::new(base_f0.x, eta, cos_film, r12, t121);
        let y = Channel::<L>::new(base_f0.y, eta, cos_film, r12, t121);
        let z = Channel::<L>::new(base_f0.z, eta, cos_film, r12, t121);
        // The first interface turns the phase by half a wave on the way back out (the film is denser than air).
        let mut sum = V3::<L>::new(r12 + x.rs, r12 + y.rs, r12 + z.rs);
        let mut cm = V3::<L>::new(x.rs - t121, y.rs - t121, z.rs - t121);
        let r = V3::<L>::new(x.r, y.r, z.r);
        let turns = V3::<L>::new(x.turn, y.turn, z.turn);
        for s in sensitivities::<L>(path, turns) {
            cm = cm * r;
            sum = sum + (cm * s).scale(L::F::splat(2.0));
        }
        let all = V3::<L>::splat([1.0; 3]);
        all.or_else(is_total, sum.max(V3::zero()).min(all))
    }
}

/// `shares` with the mean of Schlick's `(1 - c)^5` brought to `schlick`, by weights that are linear in that: what a round
/// lobe's shares become in a stretched one. They still add up to what they did.
#[inline(always)]
pub fn tilted<L: Lanes>(shares: [L::F; FILM_NODES], schlick: L::F) -> [L::F; FILM_NODES] {
    let (zero, one) = (L::F::zero(), L::F::one());
    let (mut mean, mut square) = (zero, zero);
    for (k, &share) in shares.iter().enumerate() {
        let rise = L::F::splat((1.0 - film_cosine(k)).powi(5));
        mean = rise.mul_add(share, mean);
        square = (rise * rise).mul_add(share, square);
    }
    let tiny = L::F::splat(1e-12);
    let slope = (schlick - mean) / (square - mean * mean).max(tiny);
    // No share may become negative.
    let slope = slope.min(one / mean.max(tiny)).max(-one / (one - mean).max(tiny));
    let mut tilted = shares;
    for (k, share) in tilted.iter_mut().enumerate() {
        let rise = L::F::splat((1.0 - film_cosine(k)).powi(5));
        *share = *share * (rise - mean).mul_add(slope, one).max(zero);
    }
    tilted
}

/// One channel's second interface.
struct Channel<L: Lanes> {
    /// Reflected by it, all orders, without interference.
    rs: L::F,
    /// Amplitude of one round inside of the film.
    r: L::F,
    /// Phase of one round, in turns.
    turn: L::F,
}

impl<L: Lanes> Channel<L> {
    #[inline(always)]
    fn new(base_f0: L::F, eta: L::F, cos_film: L::F, r12: L::F, t121: L::F) -> Self {
        let (zero, one, half) = (L::F::zero(), L::F::one(), L::F::splat(0.5));
        let root = base_f0.max(zero).min(L::F::splat(0.9999)).sqrt();
        let base_ior = (one + root) / (one - root);
        let r1 = normal_incidence::<L>(base_ior, eta);
        let r23 = r1 + (one - r1) * pow5((one - cos_film).max(zero));
        let r123 = (r12 * r23).max(L::F::splat(1e-5)).min(L::F::splat(0.9999));
        let rs = t121 * t121 * r23 / (one - r123);
        // Out of the film into air half a turn, and half a turn more where the base is thinner than the film.
        let turn = half + half.or_else(base_ior.lt(eta), zero);
        Self { rs, r: r123.sqrt(), turn }
    }
}

/// Reflectance at normal incidence between indices `a` and `b`.
#[inline(always)]
fn normal_incidence<L: Lanes>(a: L::F, b: L::F) -> L::F {
    let r = (a - b) / (a + b);
    r * r
}

/// Responses of RGB to waves that are `path` nm and `turns` of phase behind, and twice as much, over that to one that is
/// not: the Fourier transforms of the eye's sensitivities as Gaussians.
#[inline(always)]
fn sensitivities<L: Lanes>(path: L::F, turns: V3<L>) -> [V3<L>; 2] {
    let x = lobe::<L>(path, turns.x, 5.4856e-13, 1.6810e6, 4.3278e9);
    let far_x = lobe::<L>(path, turns.x, 9.7470e-14, 2.2399e6, 4.5282e9);
    let y = lobe::<L>(path, turns.y, 4.4201e-13, 1.7953e6, 9.3046e9);
    let z = lobe::<L>(path, turns.z, 5.2481e-13, 2.2084e6, 6.6121e9);
    [rgb(x[0] + far_x[0], y[0], z[0]), rgb(x[1] + far_x[1], y[1], z[1])]
}

/// Linear Rec.709 of CIE XYZ.
#[inline(always)]
fn rgb<L: Lanes>(x: L::F, y: L::F, z: L::F) -> V3<L> {
    let f = |v: f32| L::F::splat(v);
    V3::new(
        x.mul_add(f(3.240_454_2), y.mul_add(f(-1.537_138_5), z * f(-0.498_531_4))),
        x.mul_add(f(-0.969_266), y.mul_add(f(1.876_010_8), z * f(0.041_556))),
        x.mul_add(f(0.055_643_4), y.mul_add(f(-0.204_025_9), z * f(1.057_225_2))),
    )
}

/// One Gaussian's response to a wave and to one twice as far behind: of that the phase is double and the decay the fourth
/// power, which is half of what a film costs.
#[inline(always)]
fn lobe<L: Lanes>(path: L::F, turn: L::F, value: f64, position: f64, variance: f64) -> [L::F; 2] {
    use std::f64::consts::TAU;
    let height = L::F::splat((value * (TAU * variance).sqrt() / 1.0685e-7) as f32);
    // Radians per nm are 2 pi x 1e-9 x position: in turns, 1e-9 x position.
    let at = path * L::F::splat((position * 1e-9) as f32) + turn;
    let (cos, _) = cos_sin_2pi::<L>(at - at.floor());
    let decay = exp::<L>(path * path * L::F::splat(-((TAU * 1e-9).powi(2) * variance) as f32));
    let decay2 = decay * decay;
    let double = (cos + cos).mul_add(cos, -L::F::one());
    [height * cos * decay, height * double * (decay2 * decay2)]
}

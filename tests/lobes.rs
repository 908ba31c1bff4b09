//! Coat, sheen and the Disney BRDF, each on its own: sampling against density, energy, reciprocity, edges; and that a lane
//! without a lobe has exactly nothing.

#[path = "support/published_disney.rs"]
mod published_disney;

use prt::material::lobes::coat::Coat;
use prt::material::lobes::disney::Disney;
use prt::material::lobes::sheen::Sheen;
use prt::material::surface::DisneyExtras;
use prt::math::V3;
use prt::math::random::Rng;
use prt::verify::bsdf::checks::{agreement, finiteness, furnace, reciprocity};
use prt::verify::bsdf::chi_square::{Settings, chi_square, views};
use prt::verify::bsdf::domain::Domain;
use prt::verify::bsdf::statistics::sidak;
use prt::verify::bsdf::{Evaluated, Sampled, Scatterer, direction};
use published_disney::{Parameters, brdf};
use simd::{Float, Kernel, Lanes, Level, Mask, dispatch};

/// A lobe with its parameters.
#[derive(Clone, Copy, Debug)]
enum Lobe {
    Coat { factor: f32, roughness: f32 },
    Sheen { color: [f32; 3], roughness: f32 },
    Disney(Parameters),
}

/// What a lobe says in one lane.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Answer {
    f_cos: [f32; 3],
    pdf: f32,
    /// Of what lies below.
    scale: f32,
    albedo: [f32; 3],
}

/// Evaluates at many directions, and samples by many numbers.
struct Ask<'a> {
    lobe: Lobe,
    wo: [f32; 3],
    wi: &'a [[f32; 3]],
    u: &'a [[f32; 3]],
}

/// Component `k` of `from[at..]`, a lane each; the last one repeated.
#[inline(always)]
fn lanes<L: Lanes>(from: &[[f32; 3]], at: usize, k: usize) -> L::F {
    let mut values = [0.0; 16];
    for (i, value) in values.iter_mut().enumerate() {
        *value = from[(at + i).min(from.len() - 1)][k];
    }
    L::F::load(&values, 0)
}

#[inline(always)]
fn stored<L: Lanes>(v: L::F) -> [f32; 16] {
    let mut values = [0.0; 16];
    v.store(&mut values, 0);
    values
}

/// One lobe as the lanes see it.
enum Built<L: Lanes> {
    Coat(Coat<L>),
    Sheen(Sheen<L>),
    Disney(Disney<L>),
}

#[inline(always)]
fn built<L: Lanes>(lobe: Lobe, wo: V3<L>) -> Built<L> {
    let f = L::F::splat;
    match lobe {
        Lobe::Coat { factor, roughness } => Built::Coat(Coat::new(f(factor), f(roughness), wo)),
        Lobe::Sheen { color, roughness } => Built::Sheen(Sheen::new(V3::splat(color), f(roughness), wo)),
        Lobe::Disney(p) => {
            let extras = DisneyExtras {
                subsurface: f(p.subsurface as f32),
                specular: f(p.specular as f32),
                specular_tint: f(p.specular_tint as f32),
                anisotropic: f(p.anisotropic as f32),
                sheen: f(p.sheen as f32),
                sheen_tint: f(p.sheen_tint as f32),
                clearcoat: f(p.clearcoat as f32),
                clearcoat_gloss: f(p.clearcoat_gloss as f32),
            };
            let base = V3::splat(p.base.map(|c| c as f32));
            let (metallic, roughness) = (f(p.metallic as f32), f(p.roughness as f32));
            Built::Disney(Disney::new(base, metallic, roughness, &extras, L::M::first(L::N), wo))
        }
    }
}

/// Value, density, scale, albedo; eight numbers.
#[inline(always)]
fn evaluated<L: Lanes>(lobe: &Built<L>, wi: V3<L>) -> [L::F; 8] {
    let (value, scale, albedo) = match lobe {
        Built::Coat(c) => (c.eval(wi), c.scale(), V3::new(c.albedo(), c.albedo(), c.albedo())),
        Built::Sheen(s) => (s.eval(wi), s.scale(wi), s.albedo()),
        Built::Disney(d) => (d.eval(wi), L::F::zero(), d.albedo()),
    };
    [value.f_cos.x, value.f_cos.y, value.f_cos.z, value.pdf, scale, albedo.x, albedo.y, albedo.z]
}

#[inline(always)]
fn sampled<L: Lanes>(lobe: &Built<L>, u: [L::F; 3]) -> (V3<L>, V3<L>, L::F, L::M) {
    let (wi, delta, mirror) = match lobe {
        Built::Coat(c) => (c.sample([u[0], u[1]]), c.is_delta(), c.mirror()),
        Built::Sheen(s) => (s.sample([u[0], u[1]]), L::M::from_bits(0), L::F::zero()),
        Built::Disney(d) => (d.sample([u[0], u[1]], u[2]), L::M::from_bits(0), L::F::zero()),
    };
    let [x, y, z, pdf, ..] = evaluated(lobe, wi);
    let weight = V3::new(x, y, z).scale(L::F::one() / pdf);
    let weight = V3::new(mirror, mirror, mirror).or_else(delta, weight);
    let pdf = L::F::splat(f32::INFINITY).or_else(delta, pdf);
    (wi, weight, pdf, wi.z.gt(L::F::zero()) & pdf.gt(L::F::zero()))
}

impl Kernel for Ask<'_> {
    type Output = (Vec<Answer>, Vec<Option<Sampled>>);

    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        let lobe = built::<L>(self.lobe, V3::splat(self.wo));
        let mut answers = Vec::with_capacity(self.wi.len());
        for at in (0..self.wi.len()).step_by(L::N) {
            let wi = V3::<L>::new(lanes::<L>(self.wi, at, 0), lanes::<L>(self.wi, at, 1), lanes::<L>(self.wi, at, 2));
            let mut values = [[0.0; 16]; 8];
            for (stored_value, value) in values.iter_mut().zip(evaluated(&lobe, wi)) {
                *stored_value = stored::<L>(value);
            }
            for i in 0..L::N.min(self.wi.len() - at) {
                let [x, y, z, pdf, scale, r, g, b] = values.map(|v| v[i]);
                answers.push(Answer { f_cos: [x, y, z], pdf, scale, albedo: [r, g, b] });
            }
        }
        let mut samples = Vec::with_capacity(self.u.len());
        for at in (0..self.u.len()).step_by(L::N) {
            let u = [lanes::<L>(self.u, at, 0), lanes::<L>(self.u, at, 1), lanes::<L>(self.u, at, 2)];
            let (wi, weight, pdf, valid) = sampled(&lobe, u);
            let wi = [stored::<L>(wi.x), stored::<L>(wi.y), stored::<L>(wi.z)];
            let weight = [stored::<L>(weight.x), stored::<L>(weight.y), stored::<L>(weight.z)];
            let (pdf, valid) = (stored::<L>(pdf), valid.bits());
            for i in 0..L::N.min(self.u.len() - at) {
                let sample = Sampled { wi: wi.map(|v| v[i]), weight: weight.map(|v| v[i]), pdf: pdf[i] };
                samples.push((valid >> i & 1 == 1).then_some(sample));
            }
        }
        (answers, samples)
    }
}

/// What `lobe` says at `level`.
fn ask(level: Level, lobe: Lobe, wo: [f32; 3], wi: &[[f32; 3]]) -> Vec<Answer> {
    dispatch(level, Ask { lobe, wo, wi, u: &[] }).0
}

impl Scatterer for Lobe {
    fn eval(&self, wo: [f32; 3], wi: &[[f32; 3]]) -> Vec<Evaluated> {
        let evaluated = |a: Answer| Evaluated { f_cos: a.f_cos, pdf: a.pdf };
        ask(Level::best(), *self, wo, wi).into_iter().map(evaluated).collect()
    }

    fn sample(&self, wo: [f32; 3], u: &[[f32; 3]]) -> Vec<Option<Sampled>> {
        dispatch(Level::best(), Ask { lobe: *self, wo, wi: &[], u }).1
    }
}

const ROUGHNESS: [f32; 9] = [0.0, 0.001, 0.01, 0.05, 0.1, 0.25, 0.5, 0.75, 1.0];

fn coats() -> impl Iterator<Item = Lobe> {
    ROUGHNESS.into_iter().map(|roughness| Lobe::Coat { factor: 0.7, roughness })
}

fn sheens() -> impl Iterator<Item = Lobe> {
    ROUGHNESS.into_iter().map(|roughness| Lobe::Sheen { color: [1.0, 0.5, 0.0], roughness })
}

/// Numbers of a Disney material: all at edges of their range with probability `edges`, else anywhere in it.
fn any_disney(rng: &mut Rng, edges: f32) -> Lobe {
    let mut any = || {
        let v = if rng.unit() < edges { rng.pick(&[0.0, 1.0, 0.5]) } else { rng.unit() };
        f64::from(v)
    };
    Lobe::Disney(Parameters {
        base: [any(), any(), any()],
        metallic: any(),
        subsurface: any(),
        specular: any(),
        roughness: any(),
        specular_tint: any(),
        anisotropic: any(),
        sheen: any(),
        sheen_tint: any(),
        clearcoat: any(),
        clearcoat_gloss: any(),
    })
}

/// Disney materials of every kind, none of which is too narrow for angles.
fn disneys() -> Vec<Lobe> {
    let mut rng = Rng::of_stream(7, "disneys", 0);
    let mut lobes: Vec<Lobe> = (0..12).map(|_| any_disney(&mut rng, 0.5)).collect();
    for lobe in &mut lobes {
        if let Lobe::Disney(p) = lobe {
            p.roughness = p.roughness.max(0.5);
            p.clearcoat_gloss = p.clearcoat_gloss.min(0.5);
        }
    }
    lobes
}

/// The domain in which a lobe is neither a point nor a sliver.
fn domain(lobe: Lobe) -> Domain {
    match lobe {
        Lobe::Coat { roughness, .. } if roughness * roughness < 0.05 => {
            Domain::Reflected { alpha: [f64::from((roughness * roughness).max(1e-4)); 2] }
        }
        // Where it is seen from the horizon, its clearcoat's density has a pole there: not so over slopes.
        Lobe::Disney(_) => Domain::Reflected { alpha: [0.2; 2] },
        _ => Domain::Sphere,
    }
}

/// 4e4 samples on 24 x 24 cells a test; 0.1 % for all of `lobes` together by Sidak.
fn hold_samples_against_density(lobes: &[Lobe]) {
    let tests = lobes.len() * views().len();
    for (i, &lobe) in lobes.iter().enumerate() {
        for (j, wo) in views().into_iter().enumerate() {
            let settings = Settings { samples: 40_000, cells: 24, seed: (i * 100 + j) as u64 };
            let found = chi_square(&lobe, wo, domain(lobe), settings);
            assert!(found.passes(sidak(1e-3, tests)), "{lobe:?} from {wo:?}: {found:?}");
        }
    }
}

#[test]
fn bsdf_01_02_coat_is_sampled_by_its_density() {
    // Mirrors have none.
    let coats: Vec<Lobe> = coats().filter(|l| !matches!(l, Lobe::Coat { roughness: 0.0..0.0101, .. })).collect();
    hold_samples_against_density(&coats);
}

#[test]
fn bsdf_01_02_sheen_is_sampled_by_its_density() {
    hold_samples_against_density(&sheens().collect::<Vec<_>>());
}

#[test]
fn bsdf_01_02_disney_is_sampled_by_its_density() {
    hold_samples_against_density(&disneys());
}

#[test]
fn bsdf_01_02_narrow_disney_lobes_are_sampled_by_their_density() {
    // Specular lobe and clearcoat as narrow as they get, in slopes of each.
    let plain = Parameters {
        base: [0.8, 0.4, 0.1],
        metallic: 1.0,
        subsurface: 0.0,
        specular: 0.5,
        roughness: 0.0,
        specular_tint: 0.0,
        anisotropic: 0.0,
        sheen: 0.0,
        sheen_tint: 0.0,
        clearcoat: 0.0,
        clearcoat_gloss: 1.0,
    };
    let stretched = Parameters { roughness: 0.15, anisotropic: 1.0, ..plain };
    let coated = Parameters { base: [0.0; 3], metallic: 0.0, roughness: 0.04, clearcoat: 1.0, ..plain };
    let long = 0.15 * 0.15 / 0.1f64.sqrt();
    for (p, alpha) in [(plain, [0.001; 2]), (stretched, [long, 0.0225 * 0.1f64.sqrt()]), (coated, [0.001; 2])] {
        // Closer to the horizon than 0.01 the f32 numbers of a direction are 3 % of alpha and more apart in slope.
        for (seed, wo) in views().into_iter().filter(|wo| wo[2] > 0.01).enumerate() {
            let settings = Settings { samples: 40_000, cells: 24, seed: seed as u64 };
            let found = chi_square(&Lobe::Disney(p), wo, Domain::Reflected { alpha }, settings);
            assert!(found.passes(sidak(1e-3, 15)), "{p:?} from {wo:?}: {found:?}");
        }
    }
}

#[test]
fn disney_is_the_published_brdf_within_1e_4() {
    let mut rng = Rng::of_stream(11, "published", 0);
    let (mut points, mut worst) = (0, 0.0f64);
    for set in 0..4000 {
        let lobe = any_disney(&mut rng, [0.0, 0.5, 1.0][set % 3]);
        let Lobe::Disney(p) = lobe else { unreachable!("any_disney makes no other") };
        let mut any_direction = || {
            let z = if rng.unit() < 0.3 { rng.pick(&[1.0, 0.5, 1e-2, 1e-3, 1e-5]) } else { rng.range(1e-4, 1.0) };
            direction(f64::from(z), f64::from(rng.range(0.0, std::f32::consts::TAU)))
        };
        let wo = any_direction();
        let mut wi: Vec<[f32; 3]> = (0..24).map(|_| any_direction()).collect();
        // Near the mirror's direction, where narrow lobes are.
        for spread in [0.0, 1e-4, 1e-3, 1e-2, 0.1, 0.5] {
            let near = [-wo[0] + spread * wo[2], -wo[1] + spread * 0.3, wo[2] + spread * 0.7].map(f64::from);
            let length = near.iter().map(|c| c * c).sum::<f64>().sqrt();
            wi.push(near.map(|c| (c / length) as f32));
        }
        let evaluated = lobe.eval(wo, &wi);
        for (found, wi) in evaluated.iter().zip(&wi) {
            let expected = brdf(&p, wi.map(f64::from), wo.map(f64::from));
            for k in 0..3 {
                let expected = expected[k] * f64::from(wi[2]);
                let error = (f64::from(found.f_cos[k]) - expected).abs() / expected.max(1e-12);
                worst = worst.max(error);
                assert!(error < 1e-4, "{p:?} wo {wo:?} wi {wi:?}: {}, published {expected}", found.f_cos[k]);
            }
            points += 1;
        }
    }
    assert!(points >= 100_000 && worst > 0.0, "{points} points, worst {worst}");
}

#[test]
fn bsdf_04_disney_is_reciprocal() {
    for lobe in disneys() {
        let found = reciprocity(&lobe, 1000, 4);
        assert!(found.worst < 1e-4, "{lobe:?}: {found:?}");
    }
}

#[test]
fn bsdf_05_disney_is_sampled_without_great_weights() {
    // Its albedo is not bounded by 1 (prt_disney is exempt); what the tests' materials reach is. Weights stay bounded.
    let mut greatest = 0.0f64;
    for lobe in disneys() {
        for wo in views() {
            let found = furnace(&lobe, wo, 100, 6);
            greatest = greatest.max(found.albedo[0]).max(found.albedo[1]).max(found.albedo[2]);
            assert!(found.greatest < 60.0, "{lobe:?} from {wo:?}: {found:?}");
            // The estimate leaves out masking, so rough metals and grazing angles are off.
            let estimate = ask(Level::best(), lobe, wo, &[wo])[0].albedo;
            if wo[2] >= 0.5 && matches!(lobe, Lobe::Disney(p) if p.metallic == 0.0) {
                let is_near = (0..3).all(|k| (f64::from(estimate[k]) - found.albedo[k]).abs() < 0.4);
                assert!(is_near, "{lobe:?} from {wo:?}: {found:?}, estimate {estimate:?}");
            }
        }
    }
    assert!((0.5..4.0).contains(&greatest), "greatest albedo {greatest}");
}

#[test]
fn bsdf_03_sampled_weights_are_those_of_the_value() {
    for lobe in coats().chain(sheens()).chain(disneys()) {
        for wo in views() {
            let found = agreement(&lobe, wo, 1000, 3);
            assert!(found.worst <= 1e-4, "{lobe:?}: {found:?}");
        }
    }
}

#[test]
fn bsdf_04_sheen_is_reciprocal_and_so_is_the_coat_but_for_its_boost() {
    for lobe in sheens() {
        let found = reciprocity(&lobe, 2000, 4);
        assert!(found.worst < 2e-4, "{lobe:?}: {found:?}");
    }
    // Of multiple scattering the coat adds what the viewer's side lost: at most F0 (1 - E) / E, 9 % at roughness 1.
    for lobe in coats() {
        let found = reciprocity(&lobe, 2000, 4);
        let Lobe::Coat { roughness, .. } = lobe else { continue };
        let limit = if roughness < 0.3 { 1e-2 } else { 0.1 };
        assert!(found.worst < limit, "{lobe:?}: {found:?}");
    }
}

#[test]
fn bsdf_05_lobes_reflect_what_their_tables_say_and_never_more_than_comes() {
    for lobe in coats().chain(sheens()) {
        for wo in views() {
            let white = furnace(&lobe, wo, 160, 5);
            let answer = ask(Level::best(), lobe, wo, &[[0.0, 0.0, 1.0]])[0];
            for k in 0..3 {
                let stated = f64::from(answer.albedo[k]);
                // What random numbers leave, by the variance of stratified samples at worst unstratified.
                let noise = 4.0 * white.deviation[k] / 160.0;
                let error = (white.albedo[k] - stated).abs();
                assert!(error < 2.5e-3 + noise.min(5e-3), "{lobe:?} from {wo:?}: {white:?}, table {stated}");
                assert!(white.albedo[k] <= 1.0 + 2e-3, "{lobe:?} from {wo:?}: {white:?}");
            }
        }
    }
}

#[test]
fn bsdf_10_lobes_are_finite_at_their_edges() {
    let mut rng = Rng::of_stream(13, "edges", 0);
    let disneys: Vec<Lobe> = (0..60).map(|_| any_disney(&mut rng, 0.8)).collect();
    for (i, lobe) in coats().chain(sheens()).chain(disneys).enumerate() {
        let faults = finiteness(&lobe, 100, 60, i as u64);
        assert_eq!(faults.count, 0, "{lobe:?}: {}", faults.first.unwrap_or_default());
    }
}

#[test]
fn bsdf_12_smooth_coat_takes_exactly_its_reflectance_from_what_lies_below() {
    for z in [1.0f64, 0.9, 0.5, 0.1, 0.02, 1e-3, 1e-5] {
        let sin2 = (1.0 - z) * (1.0 + z);
        let cos_t = (1.0 - sin2 / 2.25).sqrt();
        let (s, p) = ((z - 1.5 * cos_t) / (z + 1.5 * cos_t), (1.5 * z - cos_t) / (1.5 * z + cos_t));
        let reflectance = 0.5 * (s * s + p * p);
        for factor in [0.3f32, 1.0] {
            let lobe = Lobe::Coat { factor, roughness: 0.0 };
            let wo = direction(z, 1.0);
            let answer = ask(Level::best(), lobe, wo, &[[0.0, 0.0, 1.0]])[0];
            let expected = 1.0 - f64::from(factor) * reflectance;
            assert!((f64::from(answer.scale) - expected).abs() < 1e-6, "{z}: {}, not {expected}", answer.scale);
            // And that is what its mirror gives.
            let mirror = lobe.sample(wo, &[[0.3, 0.7, 0.1]])[0].expect("a mirror");
            assert!((mirror.weight[0] + answer.scale - 1.0).abs() < 1e-6 && mirror.pdf == f32::INFINITY);
            assert!((mirror.wi[0] + wo[0]).abs() < 1e-6 && (mirror.wi[2] - wo[2]).abs() < 1e-6);
        }
    }
}

#[test]
fn bsdf_12_rough_coat_reflects_its_albedo_with_multiple_scattering() {
    // Without it there would be 6 % less.
    let (lobe, wo) = (Lobe::Coat { factor: 1.0, roughness: 1.0 }, direction(0.7, 1.0));
    let stated = f64::from(ask(Level::best(), lobe, wo, &[wo])[0].albedo[0]);
    let found = furnace(&lobe, wo, 200, 8).albedo[0];
    assert!((found / stated - 1.0).abs() < 0.02, "{found}, table {stated}");
}

#[test]
fn bsdf_12_sheen_scales_by_the_lesser_of_both_ends() {
    let lobe = Lobe::Sheen { color: [0.2, 0.8, 0.4], roughness: 0.6 };
    let albedo = |wo: [f32; 3]| {
        let white = Lobe::Sheen { color: [1.0; 3], roughness: 0.6 };
        ask(Level::best(), white, wo, &[wo])[0].albedo[0]
    };
    let (a, b) = (direction(0.8, 0.0), direction(0.2, 2.0));
    let expected = 1.0 - 0.8 * albedo(a).max(albedo(b));
    for (wo, wi) in [(a, b), (b, a)] {
        let scale = ask(Level::best(), lobe, wo, &[wi])[0].scale;
        assert!((scale - expected).abs() < 1e-6, "{scale}, not {expected}");
    }
    // Light from below passes the sheen once.
    let below = [b[0], b[1], -b[2]];
    let scale = ask(Level::best(), lobe, a, &[below])[0].scale;
    assert!((scale - (1.0 - 0.8 * albedo(a))).abs() < 1e-6);
}

#[test]
fn bsdf_14_lanes_without_a_lobe_have_exactly_none() {
    let off = [Lobe::Coat { factor: 0.0, roughness: 0.3 }, Lobe::Sheen { color: [0.0; 3], roughness: 0.3 }];
    let on = [Lobe::Coat { factor: 1.0, roughness: 0.3 }, Lobe::Sheen { color: [1.0; 3], roughness: 0.3 }];
    let nothing = Answer { scale: 1.0, ..Answer::default() };
    let directions: Vec<[f32; 3]> = (0..200).map(|i| direction(f64::from(i) / 100.0 - 0.995, f64::from(i))).collect();
    for wo in views() {
        for lobe in off {
            assert!(ask(Level::best(), lobe, wo, &directions).iter().all(|a| *a == nothing), "{lobe:?} from {wo:?}");
            assert!(lobe.sample(wo, &directions).iter().all(Option::is_none));
        }
    }
    // Seen from below there is none either.
    for lobe in on {
        let answers = ask(Level::best(), lobe, direction(-0.3, 1.0), &directions);
        assert!(answers.iter().all(|a| *a == nothing), "{lobe:?}");
    }
}

/// Lanes of different lobes side by side: parameters from `lobes`, one lane each, all seen from `wo`.
struct Mixed {
    factors: [f32; 16],
    roughness: [f32; 16],
    wo: [f32; 3],
    wi: [f32; 3],
}

impl Kernel for Mixed {
    type Output = Vec<[f32; 8]>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Vec<[f32; 8]> {
        let (wo, wi) = (V3::<L>::splat(self.wo), V3::<L>::splat(self.wi));
        let mut out = Vec::new();
        for at in (0..16).step_by(L::N) {
            let (factor, roughness) = (L::F::load(&self.factors, at), L::F::load(&self.roughness, at));
            let coat = evaluated(&Built::Coat(Coat::new(factor, roughness, wo)), wi);
            let sheen = evaluated(&Built::Sheen(Sheen::new(V3::new(factor, factor, factor), roughness, wo)), wi);
            let mut values = [[0.0; 16]; 8];
            for (value, v) in
                values.iter_mut().zip([coat[0], coat[3], coat[4], coat[5], sheen[0], sheen[3], sheen[4], sheen[5]])
            {
                *value = stored::<L>(v);
            }
            out.extend((0..L::N).map(|i| values.map(|v| v[i])));
        }
        out
    }
}

#[test]
fn a_lane_does_not_depend_on_its_neighbours() {
    let factors: [f32; 16] = std::array::from_fn(|i| [0.0, 0.5, 1.0, 0.0, 0.25][i % 5]);
    let roughness: [f32; 16] = std::array::from_fn(|i| ROUGHNESS[(i * 5) % 9]);
    let (wo, wi) = (direction(0.6, 0.3), direction(0.4, 2.0));
    let level = Level::best();
    let together = dispatch(level, Mixed { factors, roughness, wo, wi });
    for i in 0..16 {
        let alone = Mixed { factors: [factors[i]; 16], roughness: [roughness[i]; 16], wo, wi };
        assert_eq!(dispatch(level, alone)[i].map(f32::to_bits), together[i].map(f32::to_bits), "lane {i}");
    }
}

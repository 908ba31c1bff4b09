//! Exact values: open it to see what a closed-form scene must show, and why.
//!
//! All in f64, linear, nits. The formulas of lights and rooms are those of `verify light`. GGX albedos: quadrature of glTF 2.0 appendix B with
//! height-correlated G (Heitz 2014, "Understanding the Masking-Shadowing Function", JCGT 3(2), section 6.3).

use glam::{DQuat, DVec3};
pub use prt::verify::light::exact::*;
use std::f64::consts::{FRAC_PI_2, PI};

/// Fresnel reflectance by Schlick's formula with f90 = 1.
fn schlick(f0: f64, cosine: f64) -> f64 {
    f0 + (1.0 - f0) * (1.0 - cosine).clamp(0.0, 1.0).powi(5)
}

/// Height-correlated visibility term `G / (4 mu_i mu_o)`.
fn visibility(alpha: f64, mu_i: f64, mu_o: f64) -> f64 {
    let a2 = alpha * alpha;
    let root = |mu: f64| (a2 + (1.0 - a2) * mu * mu).sqrt();
    0.5 / (mu_i * root(mu_o) + mu_o * root(mu_i))
}

/// Mean of `f(u, v)` over the unit square by the midpoint rule.
fn midpoint(n: usize, f: impl Fn(f64, f64) -> f64) -> f64 {
    let at = |i: usize| (i as f64 + 0.5) / n as f64;
    (0..n * n).map(|k| f(at(k / n), at(k % n))).sum::<f64>() / (n * n) as f64
}

/// Directional albedo of the single-scattering GGX lobe at cosine `mu`, with Fresnel factor `fresnel(v . h)`.
fn ggx_albedo(mu: f64, alpha: f64, fresnel: impl Fn(f64) -> f64) -> f64 {
    let wo = DVec3::new((1.0 - mu * mu).max(0.0).sqrt(), 0.0, mu);
    midpoint(800, |u, v| {
        // Half vectors with density D cos(theta_h).
        let tan2 = alpha * alpha * u / (1.0 - u);
        let cos = 1.0 / (1.0 + tan2).sqrt();
        let sin = (1.0 - cos * cos).max(0.0).sqrt();
        let (sin_phi, cos_phi) = (2.0 * PI * v).sin_cos();
        let h = DVec3::new(sin * cos_phi, sin * sin_phi, cos);
        let oh = wo.dot(h);
        let mu_i = 2.0 * oh * h.z - wo.z;
        if oh <= 0.0 || mu_i <= 0.0 {
            return 0.0;
        }
        fresnel(oh) * 4.0 * visibility(alpha, mu_i, mu) * mu_i * oh / cos
    })
}

/// Directional albedo at cosine `mu` of a white metal of `alpha` = roughness squared; good to 2e-5 for alpha >= 0.05.
pub fn white_metal_albedo(mu: f64, alpha: f64) -> f64 {
    ggx_albedo(mu, alpha, |_| 1.0)
}

/// Directional albedo at cosine `mu` of appendix B's white dielectric of normal reflectance `f0`:
/// `mix(diffuse, specular, F(v . h))`. It exceeds 1 near grazing view: the formula conserves no energy.
pub fn white_dielectric_albedo(mu: f64, alpha: f64, f0: f64) -> f64 {
    let wo = DVec3::new((1.0 - mu * mu).max(0.0).sqrt(), 0.0, mu);
    let diffuse = midpoint(800, |u, v| {
        let (r, (sin_phi, cos_phi)) = (u.sqrt(), (2.0 * PI * v).sin_cos());
        let wi = DVec3::new(r * cos_phi, r * sin_phi, (1.0 - u).sqrt());
        1.0 - schlick(f0, wo.dot((wo + wi).normalize()))
    });
    diffuse + ggx_albedo(mu, alpha, |oh| schlick(f0, oh))
}

/// A pinhole over a `size` x `size` picture.
struct View {
    eye: DVec3,
    rotation: DQuat,
    yfov: f64,
}

impl View {
    /// Direction (any length) through picture coordinates in [0, 1], v down.
    fn direction(&self, u: f64, v: f64) -> DVec3 {
        let half = (0.5 * self.yfov).tan();
        self.rotation * DVec3::new((2.0 * u - 1.0) * half, (1.0 - 2.0 * v) * half, -1.0)
    }

    /// Pixel means of a floor at y = 0 that reaches `reach` metres from the origin along x and z, by 4 x 4
    /// Gauss-Legendre points a pixel; black where the floor is missed.
    fn floor(&self, size: usize, reach: f64, radiance: impl Fn(DVec3) -> f64) -> Vec<Option<[f64; 3]>> {
        const X: [f64; 2] = [0.339_981_043_584_856_3, 0.861_136_311_594_052_6];
        const W: [f64; 2] = [0.652_145_154_862_546_1, 0.347_854_845_137_453_9];
        let nodes = [(-X[1], W[1]), (-X[0], W[0]), (X[0], W[0]), (X[1], W[1])].map(|(x, w)| (0.5 + 0.5 * x, 0.5 * w));
        let at = |u: f64, v: f64| {
            let d = self.direction(u, v);
            let p = self.eye - d * (self.eye.y / d.y);
            if d.y >= 0.0 || p.x.abs() > reach || p.z.abs() > reach { 0.0 } else { radiance(p) }
        };
        (0..size * size)
            .map(|i| {
                let (x, y) = ((i % size) as f64, (i / size) as f64);
                let mut sum = 0.0;
                for (sx, wx) in nodes {
                    for (sy, wy) in nodes {
                        sum += wx * wy * at((x + sx) / size as f64, (y + sy) / size as f64);
                    }
                }
                Some([sum; 3])
            })
            .collect()
    }
}

/// Exact pixels of a reference scene at `size` x `size` under a box filter of width 1: `None` for scenes without a
/// closed form, and inside it for pixels on an outline.
pub fn reference_pixels(scene: &str, size: usize) -> Option<Vec<Option<[f64; 3]>>> {
    let down = View { eye: DVec3::Y * 6.0, rotation: DQuat::from_rotation_x(-FRAC_PI_2), yfov: PI / 3.0 };
    match scene {
        "sun_plane" => Some(vec![Some([0.5 / PI * 10.0 * 40.0_f64.to_radians().cos(); 3]); size * size]),
        "furnace_closed" => Some(vec![Some([closed_room(0.5, 0.5, 32); 3]); size * size]),
        "point_plane" => Some(down.floor(size, 20.0, |p| {
            0.5 / PI * 100.0 * 2.0 / (4.0 + p.x * p.x + p.z * p.z).powf(1.5) // I cos / d^2
        })),
        "quad_plane" => {
            let view = View {
                eye: DVec3::new(0.0, 1.2, 4.0),
                rotation: DQuat::from_xyzw(-0.145_213_144_685_404_78, 0.0, 0.0, 0.989_400_395_497_482_9),
                yfov: 0.698_131_700_797_731_8,
            };
            let lamp = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)].map(|(x, z)| DVec3::new(x, 1.5, z));
            Some(view.floor(size, 20.0, |p| 0.5 / PI * polygon_irradiance(&lamp, p, DVec3::Y, 20.0)))
        }
        "furnace" => {
            let view = View { eye: DVec3::Z * 4.0, rotation: DQuat::IDENTITY, yfov: 0.663_225_115_757_845_3 };
            Some((0..size * size).map(|i| furnace_pixel(&view, size, i)).collect())
        }
        _ => None,
    }
}

/// The ball is a polyhedron inscribed in the unit sphere: its outline lies within 0.24..0.26 of the picture's centre
/// (tangents), widened by the half diagonal of a pixel.
fn furnace_pixel(view: &View, size: usize, i: usize) -> Option<[f64; 3]> {
    let n = size as f64;
    let d = view.direction(((i % size) as f64 + 0.5) / n, ((i / size) as f64 + 0.5) / n);
    let (tangent, pixel) = (d.x.hypot(d.y), 2.0 * (0.5 * view.yfov).tan() / n);
    if tangent + pixel < 0.24 {
        Some([0.8, 0.5, 0.2])
    } else if tangent - pixel > 0.26 {
        Some([1.0; 3])
    } else {
        None
    }
}

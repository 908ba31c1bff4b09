//! The BRDF of Burley 2012 in f64, term by term from the paper and its viewer; an evaluation of its own for tests, which
//! shares nothing with the renderer.

use std::f64::consts::PI;

/// The eleven parameters.
#[derive(Clone, Copy, Debug)]
pub struct Parameters {
    pub base: [f64; 3],
    pub metallic: f64,
    pub subsurface: f64,
    pub specular: f64,
    pub roughness: f64,
    pub specular_tint: f64,
    pub anisotropic: f64,
    pub sheen: f64,
    pub sheen_tint: f64,
    pub clearcoat: f64,
    pub clearcoat_gloss: f64,
}

fn mix(a: f64, b: f64, t: f64) -> f64 {
    a * (1.0 - t) + b * t
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The BRDF (no cosine), 1/sr per colour, for light from `l` seen from `v`: local, x along the tangent.
pub fn brdf(p: &Parameters, l: [f64; 3], v: [f64; 3]) -> [f64; 3] {
    let (nl, nv) = (l[2], v[2]);
    if nl < 0.0 || nv < 0.0 {
        return [0.0; 3];
    }
    let sum: [f64; 3] = std::array::from_fn(|k| l[k] + v[k]);
    let length = dot(sum, sum).sqrt();
    let h = sum.map(|c| c / length);
    let (nh, lh) = (h[2], dot(l, h));
    let weight = |cos: f64| (1.0 - cos).clamp(0.0, 1.0).powi(5);
    let (fl, fv, fh) = (weight(nl), weight(nv), weight(lh));

    // Hue and saturation without the luminance.
    let luminance = 0.3 * p.base[0] + 0.6 * p.base[1] + 0.1 * p.base[2];
    let tint = if luminance > 0.0 { p.base.map(|c| c / luminance) } else { [1.0; 3] };

    let fd90 = 0.5 + 2.0 * p.roughness * lh * lh;
    let fd = mix(1.0, fd90, fl) * mix(1.0, fd90, fv);
    let fss90 = p.roughness * lh * lh;
    let fss = mix(1.0, fss90, fl) * mix(1.0, fss90, fv);
    let ss = 1.25 * (fss * (1.0 / (nl + nv) - 0.5) + 0.5);
    let diffuse = mix(fd, ss, p.subsurface) / PI;

    let aspect = (1.0 - 0.9 * p.anisotropic).sqrt();
    let ax = (p.roughness.powi(2) / aspect).max(0.001);
    let ay = (p.roughness.powi(2) * aspect).max(0.001);
    let gtr2 = 1.0 / (PI * ax * ay * ((h[0] / ax).powi(2) + (h[1] / ay).powi(2) + nh * nh).powi(2));
    let smith = |w: [f64; 3]| 1.0 / (w[2] + ((w[0] * ax).powi(2) + (w[1] * ay).powi(2) + w[2].powi(2)).sqrt());
    let gs = smith(l) * smith(v);

    let a2 = mix(0.1, 0.001, p.clearcoat_gloss).powi(2);
    let gtr1 = (a2 - 1.0) / (PI * a2.ln() * (1.0 + (a2 - 1.0) * nh * nh));
    let smith_quarter = |mu: f64| 1.0 / (mu + (0.0625 + mu * mu - 0.0625 * mu * mu).sqrt());
    let clearcoat = 0.25 * p.clearcoat * smith_quarter(nl) * smith_quarter(nv) * mix(0.04, 1.0, fh) * gtr1;

    std::array::from_fn(|k| {
        let ahead = mix(p.specular * 0.08 * mix(1.0, tint[k], p.specular_tint), p.base[k], p.metallic);
        let sheen = fh * p.sheen * mix(1.0, tint[k], p.sheen_tint);
        (diffuse * p.base[k] + sheen) * (1.0 - p.metallic) + gs * gtr2 * mix(ahead, 1.0, fh) + clearcoat
    })
}

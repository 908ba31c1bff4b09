//! What pixels must show, written down. All in f64, linear, nits and lux.

use glam::DVec3;
use std::f64::consts::PI;

/// Irradiance (lux) at `point` with unit normal `normal` under a polygon of uniform radiance `radiance` (nits) that shines
/// towards the point. Corners in order, either sense; what lies below the point's horizon gives nothing. Lambert's formula.
pub fn polygon_irradiance(corners: &[DVec3], point: DVec3, normal: DVec3, radiance: f64) -> f64 {
    let above = above_horizon(corners, point, normal);
    let sum: f64 = (0..above.len())
        .map(|i| {
            let (a, b) = (above[i], above[(i + 1) % above.len()]);
            let cross = a.cross(b);
            cross.length().atan2(a.dot(b)) * normal.dot(cross.normalize_or_zero())
        })
        .sum();
    0.5 * radiance * sum.abs()
}

/// Corners relative to `point`, cut off at its horizon (Sutherland and Hodgman 1974).
fn above_horizon(corners: &[DVec3], point: DVec3, normal: DVec3) -> Vec<DVec3> {
    let mut above = Vec::with_capacity(corners.len() + 1);
    for i in 0..corners.len() {
        let (a, b) = (corners[i] - point, corners[(i + 1) % corners.len()] - point);
        let (ha, hb) = (a.dot(normal), b.dot(normal));
        if ha >= 0.0 {
            above.push(a);
        }
        if (ha < 0.0) != (hb < 0.0) {
            above.push(a + (b - a) * (ha / (ha - hb)));
        }
    }
    above
}

/// Irradiance under triangles that shine on the front only and do not hide each other, such as those of a convex solid.
pub fn triangles_irradiance(triangles: &[[DVec3; 3]], point: DVec3, normal: DVec3, radiance: f64) -> f64 {
    let faces = |[a, b, c]: &[DVec3; 3]| (*b - *a).cross(*c - *a).dot(point - *a) > 0.0;
    triangles.iter().filter(|t| faces(t)).map(|t| polygon_irradiance(t, point, normal, radiance)).sum()
}

/// Irradiance under a ball of radiance 1, the squared sine `s2` of whose angular radius is below 1, at the cosine `c`
/// between its centre and the normal; what lies below the horizon is taken off. Snyder 1996, "Area light sources for
/// real-time graphics".
pub fn ball_irradiance(s2: f64, c: f64) -> f64 {
    if c * c > s2 {
        return PI * s2 * c.max(0.0);
    }
    let sin = (1.0 - c * c).sqrt();
    let x = (1.0 / s2 - 1.0).sqrt();
    let y = -x * c / sin;
    let q = sin * (1.0 - y * y).max(0.0).sqrt();
    (c * y.acos() - x * q) * s2 + (q / x).atan()
}

/// Form factor from a point to a parallel rectangle `a` x `b` at height `h` with one corner above the point.
pub fn corner_form_factor(a: f64, b: f64, h: f64) -> f64 {
    let (x, y) = (a / h, b / h);
    let (rx, ry) = ((1.0 + x * x).sqrt(), (1.0 + y * y).sqrt());
    (x / rx * (y / rx).atan() + y / ry * (x / ry).atan()) / (2.0 * PI)
}

/// Attenuation of a glTF spot light at angle `theta` from its axis (`KHR_lights_punctual`), all in radians.
pub fn spot_attenuation(theta: f64, inner: f64, outer: f64) -> f64 {
    let scale = 1.0 / (inner.cos() - outer.cos()).max(1e-3);
    ((theta.cos() - outer.cos()) * scale).clamp(0.0, 1.0).powi(2)
}

/// Radiance inside a closed room whose walls emit `le` and have albedo `rho`, with `max_bounces` scatterings after
/// the first: what the eye sees is `max_bounces + 2` terms of the geometric series.
pub fn closed_room(le: f64, rho: f64, max_bounces: u32) -> f64 {
    le * (1.0 - rho.powi(max_bounces as i32 + 2)) / (1.0 - rho)
}

/// Fresnel's reflectance of unpolarised light at cosine `c` on a medium of relative index `eta`.
pub fn fresnel(c: f64, eta: f64) -> f64 {
    let g = (eta * eta - 1.0 + c * c).sqrt();
    let s = ((g - c) / (g + c)).powi(2);
    let p = ((eta * eta * c - g) / (eta * eta * c + g)).powi(2);
    0.5 * (s + p)
}

/// What a slab of thickness `d` (m), relative index `eta` and absorption `s` (1/m) reflects and lets through at outer
/// cosine `c`, all inner reflections summed.
pub fn slab(c: f64, eta: f64, s: f64, d: f64) -> [f64; 2] {
    let inner = (1.0 - (1.0 - c * c) / (eta * eta)).sqrt();
    let (a, f) = ((-s * d / inner).exp(), fresnel(c, eta));
    let round = 1.0 - f * f * a * a;
    [f + f * (1.0 - f).powi(2) * a * a / round, (1.0 - f).powi(2) * a / round]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn printed_values() {
        assert!((corner_form_factor(1.5, 0.7, 1.0) - 0.130_067_5).abs() < 1e-7);
        for (s2, c, value) in [
            (0.25, 0.9, 0.706_858),
            (0.25, 0.3, 0.247_292),
            (0.25, 0.0, 0.090_586),
            (0.25, -0.3, 0.011_672),
            (0.81, 0.2, 0.997_777),
            (0.81, -0.6, 0.119_428),
        ] {
            assert!((ball_irradiance(s2, c) - value).abs() < 1e-6, "{s2} {c}: {}", ball_irradiance(s2, c));
        }
        assert!((fresnel(1.0, 1.5) - 0.04).abs() < 1e-12);
        let [r, t] = slab(0.6, 1.5, 0.0, 1.0);
        let f = fresnel(0.6, 1.5);
        assert!((r - 2.0 * f / (1.0 + f)).abs() < 1e-12 && (r + t - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_rectangle_across_the_horizon_gives_what_its_upper_part_gives() {
        let at = |low: f64| [(low, -1.0), (low, 1.0), (2.0, 1.0), (2.0, -1.0)].map(|(y, z)| DVec3::new(1.0, y, z));
        let of = |low| polygon_irradiance(&at(low), DVec3::ZERO, DVec3::Y, 3.0);
        assert!((of(-0.7) - of(0.0)).abs() < 1e-12 && of(0.0) > of(0.2));
    }
}

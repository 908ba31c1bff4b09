//! The unit square laid over directions: what a histogram of directions is taken on.
//!
//! A lobe of alpha 0.001 is a point in angles, and a test that sees one full cell sees nothing. In slopes of the half
//! vector over alpha it is as wide as any other.

use std::f64::consts::{PI, TAU};

/// Which directions are where.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Domain {
    /// The whole sphere: angle from the normal, azimuth. For lobes of alpha 0.05 and above.
    Sphere,
    /// Directions by the slopes of the normal that reflects the viewer there, in units of `alpha`.
    Reflected {
        /// Along x and y.
        alpha: [f64; 2],
    },
    /// Directions by the slopes of the normal that refracts the viewer there, in units of `alpha`.
    Refracted {
        /// Along x and y.
        alpha: [f64; 2],
        /// Index of refraction beyond over that on the viewer's side; not 1.
        eta: f64,
    },
}

impl Domain {
    /// Where in [0, 1)^2 the direction `wi` is; `None` if nowhere.
    pub fn place(&self, wo: [f64; 3], wi: [f64; 3]) -> Option<[f64; 2]> {
        let (alpha, eta) = match *self {
            Self::Sphere => {
                let phi = wi[1].atan2(wi[0]) / TAU;
                return Some([wi[0].hypot(wi[1]).atan2(wi[2]) / PI, phi - phi.floor()]);
            }
            // A reflected direction is a refracted one with eta 1, on the same side.
            Self::Reflected { alpha } => (alpha, 1.0),
            Self::Refracted { alpha, eta } => (alpha, eta),
        };
        let h: [f64; 3] = std::array::from_fn(|k| wo[k] + eta * wi[k]);
        let sign = if matches!(self, Self::Reflected { .. }) { 1.0 } else { h[2].signum() };
        if h[2] * sign <= 0.0 || (matches!(self, Self::Refracted { .. }) && wi[2] * wo[2] > 0.0) {
            return None;
        }
        Some(std::array::from_fn(|k| from_slope(h[k] / (h[2] * alpha[k]))))
    }

    /// The direction at `place`, and how many steradians a unit of area is there; `None` if there is none.
    pub fn direction(&self, wo: [f64; 3], place: [f64; 2]) -> Option<([f64; 3], f64)> {
        let (alpha, eta) = match *self {
            Self::Sphere => {
                let ((sin, cos), (y, x)) = ((place[0] * PI).sin_cos(), (place[1] * TAU).sin_cos());
                return Some(([sin * x, sin * y, cos], sin * PI * TAU));
            }
            Self::Reflected { alpha } => (alpha, None),
            Self::Refracted { alpha, eta } => (alpha, Some(eta)),
        };
        let slopes = place.map(to_slope);
        let (x, y) = (slopes[0].0 * alpha[0], slopes[1].0 * alpha[1]);
        let z = 1.0 / (1.0 + x * x + y * y).sqrt();
        let h = [x * z, y * z, z];
        let normals = z * z * z * alpha[0] * alpha[1] * slopes[0].1 * slopes[1].1;
        let cos = dot(wo, h);
        let Some(eta) = eta else {
            let wi = std::array::from_fn(|k| 2.0 * cos * h[k] - wo[k]);
            return (cos > 0.0).then_some((wi, 4.0 * cos * normals));
        };
        let cos2_t = 1.0 - (1.0 - cos * cos) / (eta * eta);
        if cos <= 0.0 || cos2_t <= 0.0 {
            return None;
        }
        let cos_t = cos2_t.sqrt();
        let wi: [f64; 3] = std::array::from_fn(|k| (cos / eta - cos_t) * h[k] - wo[k] / eta);
        // Walter et al. 2007, equation 17, the other way round.
        let solid = (cos - eta * cos_t).powi(2) / (eta * eta * cos_t);
        (wi[2] * wo[2] < 0.0).then_some((wi, solid * normals))
    }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// All slopes into (0, 1), half of it for those below 1; tails that fall as s^-2 become flat.
fn from_slope(s: f64) -> f64 {
    (0.5 * (1.0 + s / (1.0 + s.abs()))).clamp(0.0, 1.0 - f64::EPSILON)
}

/// Slope, and its derivative, at a place in (0, 1).
fn to_slope(place: f64) -> (f64, f64) {
    let t = 2.0 * place - 1.0;
    let q = 1.0 / (1.0 - t.abs());
    (t * q, 2.0 * q * q)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_and_directions_are_inverse_and_areas_are_those_of_small_squares() {
        let domains = [
            Domain::Sphere,
            Domain::Reflected { alpha: [0.3, 0.1] },
            Domain::Refracted { alpha: [0.3, 0.1], eta: 1.5 },
            Domain::Refracted { alpha: [0.2, 0.4], eta: 0.7 },
        ];
        let wo = [0.48, -0.36, 0.8];
        let cross = |a: [f64; 3], b: [f64; 3]| {
            [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
        };
        for domain in domains {
            let mut found = 0;
            for place in [[0.3, 0.6], [0.52, 0.45], [0.7, 0.2], [0.11, 0.9]] {
                let Some((wi, area)) = domain.direction(wo, place) else { continue };
                assert!((dot(wi, wi) - 1.0).abs() < 1e-12, "{domain:?} {place:?}: {wi:?}");
                let again = domain.place(wo, wi).expect("a direction that was found");
                assert!((0..2).all(|k| (again[k] - place[k]).abs() < 1e-9), "{domain:?}: {place:?}, {again:?}");
                let e = 1e-6;
                let at = |p: [f64; 2]| domain.direction(wo, p).expect("next to a direction").0;
                let d = [[e, 0.0], [0.0, e]].map(|d: [f64; 2]| {
                    let (a, b) = (at([place[0] - d[0], place[1] - d[1]]), at([place[0] + d[0], place[1] + d[1]]));
                    std::array::from_fn(|k| (b[k] - a[k]) / (2.0 * e))
                });
                let (small, n) = (cross(d[0], d[1]), cross(d[0], d[1]));
                let measured = dot(small, n).sqrt();
                assert!((measured / area - 1.0).abs() < 1e-4, "{domain:?} {place:?}: {area}, not {measured}");
                found += 1;
            }
            assert!(found >= 2, "{domain:?}");
        }
    }
}

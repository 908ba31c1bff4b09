//! Cubics and what is made of two of them, by Bernstein coefficients over [0, 1]: values lie between the least and the
//! greatest coefficient, and there are at most as many roots as the coefficients change their sign, and as many but for an
//! even number (Descartes). After Farin 2002, "Curves and Surfaces for CAGD", 5th edition, chapters 4 to 6.

/// Bernstein coefficients of a cubic.
pub type Cubic = [f64; 4];

/// Halves at `s`, by de Casteljau: the last of the first half is the first of the second, to the bit.
#[inline(always)]
pub fn split(p: &Cubic, s: f64) -> [Cubic; 2] {
    let mix = |a: f64, b: f64| a + (b - a) * s;
    let (p01, p12, p23) = (mix(p[0], p[1]), mix(p[1], p[2]), mix(p[2], p[3]));
    let (p012, p123) = (mix(p01, p12), mix(p12, p23));
    let middle = mix(p012, p123);
    [[p[0], p01, p012, middle], [middle, p123, p23, p[3]]]
}

/// Value and derivative at `s`.
#[inline(always)]
pub fn at(p: &Cubic, s: f64) -> [f64; 2] {
    let mix = |a: f64, b: f64| a + (b - a) * s;
    let (p01, p12, p23) = (mix(p[0], p[1]), mix(p[1], p[2]), mix(p[2], p[3]));
    let (p012, p123) = (mix(p01, p12), mix(p12, p23));
    [mix(p012, p123), 3.0 * (p123 - p012)]
}

/// Second derivative at `s`.
pub fn second(p: &Cubic, s: f64) -> f64 {
    let (a, b) = (p[2] - 2.0 * p[1] + p[0], p[3] - 2.0 * p[2] + p[1]);
    6.0 * (a + (b - a) * s)
}

/// Coefficients of powers of s.
#[inline(always)]
pub fn powers(p: &Cubic) -> Cubic {
    let (d0, d1, d2) = (p[1] - p[0], p[2] - p[1], p[3] - p[2]);
    [p[0], 3.0 * d0, 3.0 * (d1 - d0), d2 - 2.0 * d1 + d0]
}

/// The product, of degree 6: `c[i + j] += C(3, i) C(3, j) / C(6, i + j) a[i] b[j]`.
#[inline(always)]
pub fn product(a: &Cubic, b: &Cubic) -> [f64; 7] {
    [
        a[0] * b[0],
        0.5 * (a[0] * b[1] + a[1] * b[0]),
        0.2 * (a[0] * b[2] + a[2] * b[0]) + 0.6 * (a[1] * b[1]),
        0.05 * (a[0] * b[3] + a[3] * b[0]) + 0.45 * (a[1] * b[2] + a[2] * b[1]),
        0.2 * (a[1] * b[3] + a[3] * b[1]) + 0.6 * (a[2] * b[2]),
        0.5 * (a[2] * b[3] + a[3] * b[2]),
        a[3] * b[3],
    ]
}

/// How often the coefficients change their sign. 0 counts as positive, so that of two pieces that meet at a root one has it,
/// and no sign is overlooked.
#[inline(always)]
pub fn sign_changes<const N: usize>(c: &[f64; N]) -> u32 {
    let mut signs = 0u32;
    for (i, c) in c.iter().enumerate() {
        signs |= u32::from(*c >= 0.0) << i;
    }
    ((signs ^ (signs >> 1)) & ((1 << (N - 1)) - 1)).count_ones()
}

/// Least and greatest coefficient.
#[inline(always)]
pub fn hull(p: &Cubic) -> [f64; 2] {
    [p[0].min(p[1]).min(p[2].min(p[3])), p[0].max(p[1]).max(p[2].max(p[3]))]
}

/// The root of a cubic, whose ends have different signs, in [0, 1]: Newton's steps, and bisection where they leave the
/// interval.
pub fn root(p: &Cubic) -> f64 {
    let [c0, c1, c2, c3] = powers(p);
    let at = |s: f64| (c0 + s * (c1 + s * (c2 + s * c3)), c1 + s * (2.0 * c2 + s * (3.0 * c3)));
    between(p[0], p[3], at)
}

/// A root in [0, 1] of a function (its value and derivative) that is `first` at 0 and `last`, of another sign, at 1.
#[inline(always)]
pub fn between(first: f64, last: f64, mut at: impl FnMut(f64) -> (f64, f64)) -> f64 {
    let starts_positive = first >= 0.0;
    let (mut low, mut high) = (0.0, 1.0);
    let mut s = (first / (first - last)).clamp(0.0, 1.0);
    // Bisection alone would be done after 53.
    for _ in 0..80 {
        let (value, slope) = at(s);
        if (value >= 0.0) == starts_positive {
            low = s;
        } else {
            high = s;
        }
        let mut next = s - value / slope;
        // Written so that NaN is refused.
        if !(next > low && next < high) {
            next = 0.5 * (low + high);
        }
        let step = (next - s).abs();
        s = next;
        if step <= STEP || high - low <= STEP {
            break;
        }
    }
    s
}

/// Steps of Newton this small were the last: the error behind is of the order of their square.
const STEP: f64 = 1e-13;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Rng;

    fn cubic(rng: &mut Rng) -> Cubic {
        [(); 4].map(|()| f64::from(rng.range(-1.0, 1.0)))
    }

    fn value(c: &[f64], s: f64) -> f64 {
        let mut c = c.to_vec();
        while c.len() > 1 {
            c = c.windows(2).map(|w| w[0] + (w[1] - w[0]) * s).collect();
        }
        c[0]
    }

    #[test]
    fn products_splits_and_powers_have_the_values_of_their_cubics() {
        let mut rng = Rng::new(1);
        for _ in 0..1000 {
            let (a, b, s) = (cubic(&mut rng), cubic(&mut rng), f64::from(rng.unit()));
            let [va, slope] = at(&a, s);
            let near = |x: f64, y: f64| assert!((x - y).abs() < 1e-13, "{x} {y}");
            near(value(&a, s), va);
            near(value(&product(&a, &b), s), va * at(&b, s)[0]);
            let c = powers(&a);
            near(c[0] + s * (c[1] + s * (c[2] + s * c[3])), va);
            near(c[1] + s * (2.0 * c[2] + s * 3.0 * c[3]), slope);
            near(2.0 * c[2] + 6.0 * s * c[3], second(&a, s));
            let [left, right] = split(&a, 0.3);
            near(at(&left, s)[0], at(&a, 0.3 * s)[0]);
            near(at(&right, s)[0], at(&a, 0.3 + 0.7 * s)[0]);
        }
    }

    #[test]
    fn signs_change_no_oftener_than_coefficients_do_and_a_root_at_a_seam_is_in_one_piece() {
        assert_eq!(sign_changes(&[1.0, -1.0, 2.0, 0.0]), 2);
        assert_eq!(sign_changes(&[-1.0, 0.0, 1.0, 1.0]), 1);
        assert_eq!(sign_changes(&[-1.0, 0.0, -1.0, -1.0]), 2);
        assert_eq!(sign_changes(&[-2.0, -1.0, -0.5, 0.0]) + sign_changes(&[0.0, 0.5, 1.0, 2.0]), 1);
        assert_eq!(sign_changes(&[2.0, 1.0, 0.5, 0.0]) + sign_changes(&[0.0, -0.5, -1.0, -2.0]), 1);
    }

    #[test]
    fn roots_are_found_also_where_newton_runs_away() {
        let mut rng = Rng::new(2);
        let mut found = 0;
        for _ in 0..2000 {
            let c = cubic(&mut rng);
            if (c[0] >= 0.0) != (c[3] >= 0.0) {
                let s = root(&c);
                assert!((0.0..=1.0).contains(&s) && at(&c, s)[0].abs() < 1e-12, "{c:?}: {s}");
                found += 1;
            }
        }
        assert!(found > 500);
        // After pbrt-v4's math_test.cpp: a slope that points away, and one that is infinite.
        let away = between(-1.0, 1.0, |s| ((s - 0.7).signum(), -1.0));
        assert!((away - 0.7).abs() < 1e-9);
        let steep = between(-1.0, 1.0, |s| ((s - 0.3).cbrt(), f64::INFINITY));
        assert!((steep - 0.3).abs() < 1e-9, "{steep}");
    }
}

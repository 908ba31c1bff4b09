//! A sampler of an animation: keys, and what lies between them (glTF 2.0 specification, appendix C).

/// How values between keys come about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Interpolation {
    /// The value of the key before.
    Step,
    /// Straight from key to key; rotations along the shorter arc at constant speed.
    Linear,
    /// Hermite cubics; each key has a tangent to arrive with, a value, and a tangent to leave with, per second.
    CubicSpline,
}

/// What the values of a curve are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Quantity {
    /// Numbers, each on its own.
    Numbers,
    /// A unit quaternion x y z w.
    Rotation,
}

/// A checked sampler for one property.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Curve {
    /// `[n]` seconds, increasing, at least one.
    pub times: Vec<f32>,
    /// `[n][width]`, and `[n][3][width]` for cubic splines: in-tangent, value, out-tangent.
    pub values: Vec<f32>,
    /// Numbers of one value, at least 1.
    pub width: usize,
    pub interpolation: Interpolation,
    pub quantity: Quantity,
}

/// Where a time lies among keys.
enum Place {
    /// At a key, or beyond the first or the last.
    Key(usize),
    /// Behind a key, by a share of the way to the next one in (0, 1), and the seconds between the two.
    Behind(usize, f64, f64),
}

impl Curve {
    /// The value at `time`, seconds; before the first key and behind the last the value there.
    pub fn at(&self, time: f64) -> Vec<f64> {
        let (key, share, seconds) = match self.place(time) {
            Place::Key(key) => return self.value(key),
            Place::Behind(key, share, seconds) => (key, share, seconds),
        };
        let (from, to) = (self.value(key), self.value(key + 1));
        match (self.interpolation, self.quantity) {
            (Interpolation::Step, _) => from,
            (Interpolation::Linear, Quantity::Numbers) => {
                from.iter().zip(&to).map(|(a, b)| a + (b - a) * share).collect()
            }
            (Interpolation::Linear, Quantity::Rotation) => slerp(&from, &to, share),
            (Interpolation::CubicSpline, quantity) => {
                let (leaving, arriving) = (self.part(key, 2), self.part(key + 1, 0));
                let t = share;
                let (t2, t3) = (t * t, t * t * t);
                // Appendix C.5: tangents are per second, so they count by the length of the interval.
                let weights = [
                    2.0 * t3 - 3.0 * t2 + 1.0,
                    seconds * (t3 - 2.0 * t2 + t),
                    3.0 * t2 - 2.0 * t3,
                    seconds * (t3 - t2),
                ];
                let sum = |i: usize| {
                    let parts = [from[i], leaving[i], to[i], arriving[i]];
                    weights.iter().zip(parts).map(|(w, p)| w * p).sum()
                };
                let value: Vec<f64> = (0..self.width).map(sum).collect();
                if quantity == Quantity::Rotation { normalized(value) } else { value }
            }
        }
    }

    /// Whether the value is not the same at all times of an interval.
    pub fn varies(&self, [start, end]: [f64; 2]) -> bool {
        // Without a key in between it is a cubic at most, and one with five equal values is constant.
        let first = self.at(start);
        let others = || (1..=4).map(|k| self.at(start + (end - start) * 0.25 * f64::from(k)));
        let at_keys = || self.times.iter().map(|&key| f64::from(key)).filter(|key| (start..=end).contains(key));
        others().any(|value| value != first) || at_keys().any(|key| self.at(key) != first)
    }

    /// Keys are 32-bit numbers, and a frame's time is meant to hit them: `5 / 24` in f64 lies a little beside what a file
    /// has for it. So a time is at a key when it rounds to that; without this a step would come a frame late.
    fn place(&self, time: f64) -> Place {
        let rounded = time as f32;
        let after = self.times.partition_point(|&key| key <= rounded);
        let last = self.times.len() - 1;
        if after == 0 {
            return Place::Key(0);
        }
        let key = after - 1;
        if key == last || self.times[key] == rounded {
            return Place::Key(key);
        }
        let (start, end) = (f64::from(self.times[key]), f64::from(self.times[after]));
        let seconds = end - start;
        Place::Behind(key, (time - start) / seconds, seconds)
    }

    fn value(&self, key: usize) -> Vec<f64> {
        let value = match self.interpolation {
            Interpolation::CubicSpline => self.part(key, 1),
            Interpolation::Step | Interpolation::Linear => self.numbers(key),
        };
        if self.quantity == Quantity::Rotation { normalized(value) } else { value }
    }

    /// In-tangent (0), value (1) or out-tangent (2) of a key of a cubic spline.
    fn part(&self, key: usize, part: usize) -> Vec<f64> {
        self.numbers(3 * key + part)
    }

    fn numbers(&self, i: usize) -> Vec<f64> {
        self.values[i * self.width..(i + 1) * self.width].iter().map(|&v| f64::from(v)).collect()
    }
}

/// Of length 1; the null quaternion, which no curve should pass, turns nothing.
fn normalized(mut q: Vec<f64>) -> Vec<f64> {
    let length = q.iter().map(|v| v * v).sum::<f64>().sqrt();
    if length > 0.0 && length.is_finite() {
        // As it is where it is a unit quaternion as exactly as f32 has it: a key's value is the file's own.
        if (length - 1.0).abs() > 1e-6 {
            q.iter_mut().for_each(|v| *v /= length);
        }
        return q;
    }
    vec![0.0, 0.0, 0.0, 1.0]
}

/// From `a` to `b` along the shorter arc at constant speed (appendix C.4); `share` in [0, 1].
fn slerp(a: &[f64], b: &[f64], share: f64) -> Vec<f64> {
    let dot: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
    // b and -b are the same rotation: the nearer one.
    let sign = if dot < 0.0 { -1.0 } else { 1.0 };
    let norm = |f: &dyn Fn(f64, f64) -> f64| a.iter().zip(b).map(|(&a, &b)| f(a, sign * b).powi(2)).sum::<f64>().sqrt();
    // Half the angle by the tangent, which is exact for the smallest ones too, where the cosine says nothing.
    let angle = 2.0 * norm(&|a, b| a - b).atan2(norm(&|a, b| a + b));
    let sine = angle.sin();
    let [from, to] = match sine > 1e-9 {
        true => [((1.0 - share) * angle).sin() / sine, (share * angle).sin() / sine],
        false => [1.0 - share, share],
    };
    normalized(a.iter().zip(b).map(|(a, b)| from * a + sign * to * b).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DQuat;

    fn curve(interpolation: Interpolation, times: &[f32], values: &[f32], width: usize) -> Curve {
        Curve { times: times.to_vec(), values: values.to_vec(), width, interpolation, quantity: Quantity::Numbers }
    }

    fn rotations(interpolation: Interpolation, times: &[f32], values: &[f32]) -> Curve {
        Curve { quantity: Quantity::Rotation, ..curve(interpolation, times, values, 4) }
    }

    fn near(a: &[f64], b: &[f64], slack: f64) {
        assert!(a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() <= slack), "{a:?} is not {b:?}");
    }

    #[test]
    fn mb_01_values_are_clamped_outside_the_keys_and_exact_at_them() {
        use Interpolation::{CubicSpline, Linear, Step};
        for interpolation in [Step, Linear, CubicSpline] {
            let values: &[f32] = match interpolation {
                CubicSpline => &[9.0, 1.0, 9.0, 9.0, 5.0, 9.0, 9.0, -2.0, 9.0],
                Step | Linear => &[1.0, 5.0, -2.0],
            };
            let curve = curve(interpolation, &[0.5, 1.0, 1.75], values, 1);
            for (time, value) in [(-1.0, 1.0), (0.5, 1.0), (1.0, 5.0), (1.75, -2.0), (f64::INFINITY, -2.0)] {
                assert_eq!(curve.at(time), [value], "{interpolation:?} at {time}");
            }
        }
        for interpolation in [Step, Linear, CubicSpline] {
            let single = curve(interpolation, &[2.0], &[7.0, 7.0, 7.0], 1);
            assert!([0.0, 2.0, 3.0].iter().all(|&time| single.at(time) == [7.0]));
        }
    }

    #[test]
    fn a_frame_hits_the_key_that_f32_has_for_its_time() {
        for fps in [24.0_f64, 25.0, 30.0, 23.976, 60.0] {
            let times: Vec<f32> = (0..200).map(|f| (f64::from(f) / fps) as f32).collect();
            let values: Vec<f32> = (0..200).map(|f| f as f32).collect();
            let steps = curve(Interpolation::Step, &times, &values, 1);
            for f in 0..200 {
                assert_eq!(steps.at(f64::from(f) / fps), [f64::from(f)], "frame {f} at {fps} a second");
            }
        }
    }

    #[test]
    fn steps_hold_and_lines_are_straight() {
        let values = [0.0, 10.0, 1.0, 20.0];
        assert_eq!(curve(Interpolation::Step, &[0.0, 2.0], &values, 2).at(1.999), [0.0, 10.0]);
        assert_eq!(curve(Interpolation::Linear, &[0.0, 2.0], &values, 2).at(0.5), [0.25, 12.5]);
    }

    // The cubic with p(0) = 1, p'(0) = 2, p(3) = -4, p'(3) = 5 is 1 + 2 x - 14/3 x^2 + 31/27 x^3.
    #[test]
    fn a_cubic_spline_is_the_cubic_of_its_values_and_slopes() {
        let spline = curve(Interpolation::CubicSpline, &[10.0, 13.0], &[99.0, 1.0, 2.0, 5.0, -4.0, 99.0], 1);
        for i in 0..=30 {
            let x = f64::from(i) * 0.1;
            let exact = 1.0 + 2.0 * x - 14.0 / 3.0 * x * x + 31.0 / 27.0 * x * x * x;
            near(&spline.at(10.0 + x), &[exact], 1e-5);
        }
    }

    #[test]
    fn mb_02_slerp_takes_the_shorter_arc_at_constant_speed() {
        let about_y = |degrees: f64| DQuat::from_rotation_y(degrees.to_radians()).to_array();
        // 350 degrees is 10 degrees the other way; its quaternion is on the other side.
        for (from, to, swept) in [(0.0, 90.0, 90.0), (0.0, 350.0, -10.0), (20.0, 199.0, 179.0), (10.0, 10.0, 0.0)] {
            let values: Vec<f32> = about_y(from).into_iter().chain(about_y(to)).map(|v| v as f32).collect();
            let curve = rotations(Interpolation::Linear, &[0.0, 1.0], &values);
            for i in 1..10 {
                let share = f64::from(i) / 10.0;
                let expected = DQuat::from_array(about_y(from + swept * share));
                let found = DQuat::from_array(curve.at(share).try_into().unwrap());
                assert!((found.length() - 1.0).abs() < 1e-6);
                assert!(
                    found.normalize().dot(expected).abs() > 1.0 - 1e-12,
                    "{from} to {to} at {share}: {found:?} is not {expected:?}"
                );
            }
        }
    }

    #[test]
    fn a_rotation_along_a_spline_is_of_length_one() {
        let values = [
            0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 3.0, 0.0, 0.0, // leaves with a tangent
            0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0,
        ];
        let curve = rotations(Interpolation::CubicSpline, &[0.0, 0.5], &values);
        // At the middle: w = 1/2, y = 1/2 + 0.5 x 3 / 8.
        let (y, w): (f64, f64) = (0.6875, 0.5);
        near(&curve.at(0.25), &[0.0, y / y.hypot(w), 0.0, w / y.hypot(w)], 1e-12);
        assert_eq!(rotations(Interpolation::CubicSpline, &[0.0], &values[..12]).at(3.0), [0.0, 0.0, 0.0, 1.0]);
    }

    #[test]
    fn equal_keys_do_not_move_in_the_last_digit() {
        let q: [f32; 4] = [0.1825742, 0.3651484, 0.5477226, 0.7302967];
        let values: Vec<f32> = q.into_iter().chain(q).collect();
        let still = rotations(Interpolation::Linear, &[0.0, 1.0], &values);
        let once = still.at(0.3).iter().map(|&v| v as f32).collect::<Vec<_>>();
        assert!((0..10).all(|i| still.at(f64::from(i) * 0.1).iter().map(|&v| v as f32).eq(once.iter().copied())));
    }
}

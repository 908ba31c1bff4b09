//! Random numbers of the measured rays: SplitMix64 (Steele, Lea and Flood 2014), the same on every machine.

use glam::Vec3;

/// A generator.
#[derive(Clone, Debug)]
pub struct Random(u64);

impl Random {
    /// Another sequence for every `seed` and `stream`.
    pub fn new(seed: u64, stream: u64) -> Self {
        let mut random = Self(seed ^ stream.wrapping_mul(0xd1b5_4a32_d192_ed03));
        random.bits();
        random
    }

    /// 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in [0, 1).
    pub fn unit(&mut self) -> f32 {
        (self.bits() >> 40) as f32 * (1.0 / 16_777_216.0)
    }

    /// Uniform in [0, n).
    pub fn below(&mut self, n: usize) -> usize {
        (self.bits() % n as u64) as usize
    }

    /// A unit vector, uniform over all directions.
    pub fn direction(&mut self) -> Vec3 {
        let (z, phi) = (2.0 * self.unit() - 1.0, std::f32::consts::TAU * self.unit());
        let r = (1.0 - z * z).max(0.0).sqrt();
        Vec3::new(r * phi.cos(), r * phi.sin(), z)
    }

    /// A unit vector about the unit vector `n` with a density proportional to the cosine.
    pub fn cosine_direction(&mut self, n: Vec3) -> Vec3 {
        loop {
            // A uniform point of the sphere that touches the surface at the point.
            if let Some(d) = (n + self.direction()).try_normalize() {
                return d;
            }
        }
    }

    /// Puts `items` into a random order.
    pub fn shuffle<T>(&mut self, items: &mut [T]) {
        for i in (1..items.len()).rev() {
            items.swap(i, self.below(i + 1));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Seed 1, 20,000 directions: the cosine has mean 2/3 and variance 1/18, so its mean has a standard error of
    /// 0.00167; 5 of them fail by chance once in 1.7 million runs (the seed is fixed).
    #[test]
    fn bounces_follow_the_cosine() {
        let (mut random, n) = (Random::new(1, 0), Vec3::new(0.6, 0.0, -0.8));
        let sum: f64 = (0..20_000).map(|_| f64::from(random.cosine_direction(n).dot(n))).sum();
        assert!((sum / 20_000.0 - 2.0 / 3.0).abs() < 5.0 * 0.00167, "{}", sum / 20_000.0);
    }

    #[test]
    fn a_shuffle_loses_nothing_and_depends_on_the_seed() {
        let shuffled = |seed| {
            let mut items: Vec<u32> = (0..100).collect();
            Random::new(seed, 2).shuffle(&mut items);
            items
        };
        let mut sorted = shuffled(5);
        assert!(shuffled(5) == sorted && shuffled(6) != sorted);
        sorted.sort_unstable();
        assert_eq!(sorted, (0..100).collect::<Vec<_>>());
    }
}

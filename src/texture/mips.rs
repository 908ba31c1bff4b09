//! Levels of detail of an image: each about half as wide and high as the one before, down to a single texel.
//!
//! A texel of a level is the mean over exactly the area that it covers of the level before: where a size is odd, texels
//! count by the part of them that lies inside. So every level has the image's mean, whatever its size, up to the rounding
//! of its texels; means are carried on unrounded. A level keeps its texels as the image does, in the same encoding.
//! The mean is confined to the image: what lies beyond its border is the wrap mode's, which every level has.

use super::{Few, Texels};
use crate::color::{linear_from_srgb, srgb_from_linear};
use rayon::prelude::*;

/// What texels become one by.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Average {
    /// They do not: level 0 alone is read.
    Never,
    /// Mean of the values as encoded: parameters and vectors.
    Values,
    /// Mean of what R, G and B stand for by the sRGB curve; A as encoded.
    Light,
    /// The same, weighed by A: what is not there has no colour.
    LightByOpacity,
}

/// Pixels across and down.
pub type Size = [usize; 2];

/// The sizes of the levels after `size`, down to 1 x 1.
pub fn sizes_below(mut size: Size) -> Vec<Size> {
    let mut sizes = Vec::new();
    while size != [1, 1] {
        size = size.map(|n| (n / 2).max(1));
        sizes.push(size);
    }
    sizes
}

/// Hands `take` the levels after `texels` (`size`, row 0 at the top) one by one, each kept as `texels` are.
pub fn levels(texels: &Texels, size: Size, average: Average, mut take: impl FnMut(Texels)) {
    if average == Average::Never {
        return;
    }
    let coding = Coding::of(texels, average);
    let mut done: Option<(Vec<[f32; 4]>, Size)> = None;
    for next in sizes_below(size) {
        let by_opacity = average == Average::LightByOpacity;
        let level = match &done {
            None => halved(|i| coding.decoded(texels.get(i)), size, next, by_opacity),
            Some((values, size)) => halved(|i| values[i], *size, next, by_opacity),
        };
        take(coding.encoded(texels, &level));
        done = Some((level, next));
    }
}

/// The level of size `to` below that of size `from`, whose texels are `texel`.
fn halved(texel: impl Fn(usize) -> [f32; 4] + Sync, from: Size, to: Size, by_opacity: bool) -> Vec<[f32; 4]> {
    let across: Vec<Span> = (0..to[0]).map(|i| Span::new(i, from[0], to[0])).collect();
    let mut level = vec![[0.0; 4]; to[0] * to[1]];
    level.par_chunks_mut(to[0]).enumerate().for_each(|(row, out)| {
        let down = Span::new(row, from[1], to[1]);
        for (out, across) in out.iter_mut().zip(&across) {
            *out = mean(&texel, from[0], across, &down, by_opacity);
        }
    });
    level
}

/// The texels under one of the next level, in one direction, and how much of each: 3 at most.
struct Span {
    first: usize,
    weights: [f32; 3],
}

impl Span {
    /// Of texel `i` of `to` over `from` texels; `to` is half of `from` rounded down, or both are 1.
    fn new(i: usize, from: usize, to: usize) -> Self {
        // In units of 1 / (from x to) of the image a texel covers `to` units, one of the next level `from`.
        let (start, end) = (i * from, (i + 1) * from);
        let first = start / to;
        let covered = |k: usize| end.min((first + k + 1) * to).saturating_sub(start.max((first + k) * to));
        Self { first, weights: [0, 1, 2].map(|k| covered(k) as f32 / from as f32) }
    }
}

/// Mean of the texels under `across` and `down`, of an image `width` texels wide.
fn mean(texel: impl Fn(usize) -> [f32; 4], width: usize, across: &Span, down: &Span, by_opacity: bool) -> [f32; 4] {
    // In f64, so that texels of one value have that value as their mean.
    let (mut plain, mut there) = ([0.0_f64; 4], [0.0_f64; 3]);
    for (y, &v) in down.weights.iter().enumerate().filter(|(_, v)| **v > 0.0) {
        for (x, &u) in across.weights.iter().enumerate().filter(|(_, u)| **u > 0.0) {
            let t = texel((down.first + y) * width + across.first + x).map(f64::from);
            let weight = f64::from(u) * f64::from(v);
            plain = [0, 1, 2, 3].map(|c| plain[c] + weight * t[c]);
            there = [0, 1, 2].map(|c| there[c] + weight * t[3] * t[c]);
        }
    }
    // The weights add up to 1 to 1e-7 only.
    let sum = |weights: &[f32; 3]| weights.iter().map(|&w| f64::from(w)).sum::<f64>();
    let area = sum(&across.weights) * sum(&down.weights);
    let mut mean = plain.map(|p| p / area);
    if by_opacity && plain[3] > 0.0 {
        mean = [there[0] / plain[3], there[1] / plain[3], there[2] / plain[3], mean[3]];
    }
    mean.map(|m| m as f32)
}

/// How texels become numbers that are averaged, and back.
struct Coding {
    /// R, G and B are light, and this is what each of their values stands for.
    light: Option<Vec<f32>>,
    /// The largest value of a channel.
    largest: f32,
}

impl Coding {
    fn of(texels: &Texels, average: Average) -> Self {
        let largest: u16 = match texels {
            Texels::Rgba8(_) | Texels::Few8(_) => 255,
            Texels::Rgba16(_) | Texels::Few16(_) => 65_535,
        };
        let decoded = |v: u16| linear_from_srgb(f64::from(v) / f64::from(largest)) as f32;
        let light = (average != Average::Values).then(|| (0..=largest).map(decoded).collect());
        Self { light, largest: f32::from(largest) }
    }

    /// What the texel `t` stands for, R, G, B, A as [`Texels::get`] has them.
    fn decoded(&self, t: [f32; 4]) -> [f32; 4] {
        let Some(light) = &self.light else { return t };
        let of = |v: f32| light[(v * self.largest).round() as usize];
        [of(t[0]), of(t[1]), of(t[2]), t[3]]
    }

    /// Channel `c` of `t`, as it is stored.
    fn stored(&self, t: &[f32; 4], c: usize) -> f32 {
        let v = if self.light.is_some() && c < 3 { srgb_from_linear(f64::from(t[c])) as f32 } else { t[c] };
        (v.clamp(0.0, 1.0) * self.largest).round()
    }

    /// `level` as `like` keeps its texels.
    fn encoded(&self, like: &Texels, level: &[[f32; 4]]) -> Texels {
        let byte = |t: &[f32; 4], c| self.stored(t, c) as u8;
        let word = |t: &[f32; 4], c| self.stored(t, c) as u16;
        match like {
            Texels::Rgba8(_) => Texels::Rgba8(level.par_iter().map(|t| [0, 1, 2, 3].map(|c| byte(t, c))).collect()),
            Texels::Rgba16(_) => Texels::Rgba16(level.par_iter().map(|t| [0, 1, 2, 3].map(|c| word(t, c))).collect()),
            Texels::Few8(few) => Texels::Few8(kept(few, level, byte)),
            Texels::Few16(few) => Texels::Few16(kept(few, level, word)),
        }
    }
}

/// The channels of `level` that `like` keeps. Each is that of the first of R, G, B and A that reads it.
fn kept<T>(like: &Few<T>, level: &[[f32; 4]], stored: impl Fn(&[f32; 4], usize) -> T) -> Few<T> {
    let read: Vec<usize> =
        (0..like.kept).map(|k| like.at.iter().position(|&at| usize::from(at) == k).unwrap_or(0)).collect();
    let values = level.iter().flat_map(|t| read.iter().map(|&c| stored(t, c))).collect();
    Few { values, kept: like.kept, at: like.at }
}

#[cfg(test)]
#[path = "mips_tests.rs"]
mod tests;

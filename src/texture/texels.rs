//! Pixels in memory, and how those channels that nothing reads are left out.

use std::ops::{BitOr, BitOrAssign};

/// R G B A of each pixel.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Texels {
    /// 8 bits a channel.
    Rgba8(Vec<[u8; 4]>),
    /// 16 bits a channel.
    Rgba16(Vec<[u16; 4]>),
    /// 8 bits a channel, one or two of them kept.
    Few8(Few<u8>),
    /// 16 bits a channel, one or two of them kept.
    Few16(Few<u16>),
}

/// Pixels of which only one or two channels are kept; the others read as one of those.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Few<T> {
    /// `[pixels][kept]`.
    pub values: Vec<T>,
    /// Values a pixel: 1 or 2.
    pub kept: usize,
    /// Which of the kept values R, G, B and A read; less than `kept`.
    pub at: [u8; 4],
}

/// A set of channels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Channels(u8);

impl Channels {
    /// None.
    pub const NONE: Self = Self(0);
    /// The first.
    pub const R: Self = Self(1);
    /// The second.
    pub const G: Self = Self(2);
    /// The third.
    pub const B: Self = Self(4);
    /// Colours and normals.
    pub const RGB: Self = Self(7);
    /// The fourth.
    pub const A: Self = Self(8);

    /// Whether channel `k` (0 = R, 3 = A) is one of them.
    pub fn has(self, k: usize) -> bool {
        self.0 >> k & 1 == 1
    }
}

impl BitOr for Channels {
    type Output = Self;

    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

impl BitOrAssign for Channels {
    fn bitor_assign(&mut self, other: Self) {
        self.0 |= other.0;
    }
}

impl Texels {
    /// How many.
    pub fn len(&self) -> usize {
        match self {
            Self::Rgba8(texels) => texels.len(),
            Self::Rgba16(texels) => texels.len(),
            Self::Few8(few) => few.len(),
            Self::Few16(few) => few.len(),
        }
    }

    /// None at all.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Texel `i` as encoded, each channel in [0, 1]. A channel that was left out reads as another one.
    pub fn get(&self, i: usize) -> [f32; 4] {
        let byte = |c: u8| f32::from(c) / 255.0;
        let word = |c: u16| f32::from(c) / 65535.0;
        match self {
            Self::Rgba8(texels) => texels[i].map(byte),
            Self::Rgba16(texels) => texels[i].map(word),
            Self::Few8(few) => few.get(i).map(byte),
            Self::Few16(few) => few.get(i).map(word),
        }
    }

    /// The same pixels without the channels that are not `used`, and with equal ones kept once, where that takes less
    /// memory: [`Texels::get`] gives the same values as before in the used channels.
    #[must_use]
    pub fn narrowed(self, used: Channels) -> Self {
        match self {
            Self::Rgba8(texels) => Few::new(&texels, used).map_or(Self::Rgba8(texels), Self::Few8),
            Self::Rgba16(texels) => Few::new(&texels, used).map_or(Self::Rgba16(texels), Self::Few16),
            few => few,
        }
    }
}

impl<T: Copy + PartialEq> Few<T> {
    /// `None` if three channels or more differ and are used.
    fn new(texels: &[[T; 4]], used: Channels) -> Option<Self> {
        // Channels that are kept, by their place in a texel, and what reads which of them.
        let mut kept: Vec<usize> = Vec::with_capacity(2);
        let mut at = [0; 4];
        for k in (0..4).filter(|&k| used.has(k)) {
            let same = kept.iter().position(|&other| texels.iter().all(|t| t[other] == t[k]));
            at[k] = same.unwrap_or(kept.len()) as u8;
            if same.is_none() {
                if kept.len() == 2 {
                    return None;
                }
                kept.push(k);
            }
        }
        if kept.is_empty() {
            kept.push(0);
        }
        let mut values = Vec::with_capacity(texels.len() * kept.len());
        match kept[..] {
            [a] => values.extend(texels.iter().map(|t| t[a])),
            _ => values.extend(texels.iter().flat_map(|t| [t[kept[0]], t[kept[1]]])),
        }
        Some(Self { values, kept: kept.len(), at })
    }

    /// What channel `c` (0 = R, 3 = A) reads of each pixel in turn.
    pub fn channel(&self, c: usize) -> impl Iterator<Item = T> {
        self.values.iter().skip(usize::from(self.at[c])).step_by(self.kept).copied()
    }

    fn len(&self) -> usize {
        self.values.len() / self.kept
    }

    fn get(&self, i: usize) -> [T; 4] {
        self.at.map(|k| self.values[i * self.kept + usize::from(k)])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const COLORS: [[u8; 4]; 3] = [[1, 2, 3, 255], [4, 5, 6, 255], [7, 8, 9, 255]];
    const GREYS: [[u8; 4]; 2] = [[9, 9, 9, 1], [8, 8, 8, 2]];

    fn kept(texels: &[[u8; 4]], used: Channels) -> (usize, Texels) {
        let narrow = Texels::Rgba8(texels.to_vec()).narrowed(used);
        let kept = match &narrow {
            Texels::Few8(few) => few.kept,
            _ => 4,
        };
        (kept, narrow)
    }

    #[test]
    fn used_channels_keep_their_values_and_the_others_their_memory() {
        for (texels, used, expected) in [
            (&COLORS[..], Channels::RGB, 4),
            (&COLORS[..], Channels::G | Channels::B, 2),
            (&COLORS[..], Channels::R | Channels::A, 2),
            (&COLORS[..], Channels::R, 1),
            (&COLORS[..], Channels::A, 1),
            (&COLORS[..], Channels::NONE, 1),
            (&GREYS[..], Channels::RGB, 1),
            (&GREYS[..], Channels::RGB | Channels::A, 2),
        ] {
            let whole = Texels::Rgba8(texels.to_vec());
            let (n, narrow) = kept(texels, used);
            assert_eq!((n, narrow.len()), (expected, texels.len()), "{used:?}");
            for i in 0..texels.len() {
                for k in (0..4).filter(|&k| used.has(k)) {
                    assert_eq!(narrow.get(i)[k], whole.get(i)[k], "{used:?} texel {i} channel {k}");
                }
            }
        }
    }

    #[test]
    fn sixteen_bits_stay_sixteen_bits() {
        let texels = Texels::Rgba16(vec![[1, 2, 65535, 4]]);
        let narrow = texels.narrowed(Channels::G | Channels::B);
        assert_eq!(narrow, Texels::Few16(Few { values: vec![2, 65535], kept: 2, at: [0, 0, 1, 0] }));
    }
}

//! Texture lookups over N lanes: wrap, bilinear or nearest at level 0, decoded to linear before filtering.
//!
//! All texels of a scene lie in one array, so lanes with different textures are read together. An image keeps as many
//! channels and bits as it has (see [`Texels`]): 1, 2, 4 or 8 bytes a texel, its channels found by shifts per lane. Where
//! all lanes have the common four bytes, those shifts are the same for all and cost nothing.

use super::{Few, Filter, Image, Texels, Texture, TextureRef, Wrap};
use crate::math::{UvSets, V3, lanes::lerp};
use simd::{Float, Lanes, Mask, Part, Uint};
use std::collections::BTreeMap;

/// No texture, in tables.
pub const NO_TEXTURE: u32 = u32::MAX;

/// The textures of a scene, ready to be read: each as some material reads it, which is called a binding.
#[derive(Clone, Debug, Default)]
pub struct TextureTable {
    /// Per texture of the scene: first word, width, height (as integers' bits), flags.
    textures: Vec<[f32; 4]>,
    /// The binding of each texture with its set of coordinates and the bits of its transform.
    bindings: BTreeMap<(u32, u32, Option<[u32; 6]>), u32>,
    /// Per binding: the texture's record with the set of coordinates in its flags.
    headers: Vec<[f32; 4]>,
    /// Two per binding: the rows of its transform.
    transforms: Vec<[f32; 4]>,
    /// Some binding has a transform.
    has_transforms: bool,
    /// Some image has other texels than R, G, B, A of 8 bits.
    has_packed: bool,
    /// Some image has texels of two words.
    has_wide: bool,
    /// Texels from the low byte up, rows from the top; an image starts at a word.
    words: Vec<u32>,
}

const WRAP_BITS: u32 = 2;
const CLAMP: u32 = 1;
const MIRROR: u32 = 2;
const NEAREST: u32 = 1 << (2 * WRAP_BITS);
/// Where the set of coordinates is in the flags, two bits.
const UV_SET_SHIFT: u32 = 8;
const UV_SET_MASK: u32 = 3;
/// Texels are not R, G, B, A of 8 bits each.
const PACKED: u32 = 1 << 10;
/// Channels have 16 bits.
const DEEP: u32 = 1 << 11;
/// Where the binary logarithm of the bytes a texel is in the flags, two bits.
const SIZE_SHIFT: u32 = 12;
/// Where the places of R, G, B and A in a texel are in the flags, two bits each.
const PLACES_SHIFT: u32 = 16;

/// What the R, G, B bytes mean; A is always linear.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// sRGB transfer curve.
    Srgb,
    /// v / 255.
    Linear,
}

/// N filtered texels.
#[derive(Clone, Copy)]
pub struct Texel<L: Lanes> {
    /// R, G, B, linear.
    pub rgb: V3<L>,
    /// A.
    pub a: L::F,
}

/// How the lanes' textures keep their texels.
#[derive(Clone, Copy)]
struct Packing<L: Lanes> {
    /// Binary logarithm of the bytes a texel.
    size: L::U,
    /// The first bit of R, G, B and A in a texel.
    at: [L::U; 4],
    /// The bits of a channel.
    mask: L::U,
    /// 1 / the largest value of a channel.
    scale: L::F,
}

impl<L: Lanes> Packing<L> {
    #[inline(always)]
    fn new(flags: L::U) -> Self {
        let three = L::U::splat(3);
        let deep = flags.has(DEEP);
        // Eight or sixteen bits from one place to the next.
        let bits = L::U::splat(4).or_else(deep, three);
        let places = flags.shr(PLACES_SHIFT);
        Self {
            size: flags.shr(SIZE_SHIFT) & three,
            at: [
                (places & three).shl_each(bits),
                (places.shr(2) & three).shl_each(bits),
                (places.shr(4) & three).shl_each(bits),
                (places.shr(6) & three).shl_each(bits),
            ],
            mask: L::U::splat(0xffff).or_else(deep, L::U::splat(0xff)),
            scale: L::F::splat(1.0 / 65535.0).or_else(deep, L::F::splat(1.0 / 255.0)),
        }
    }
}

impl TextureTable {
    /// Packs `images` once each, in order.
    ///
    /// # Errors
    /// More texels than a 32-bit index reaches.
    pub fn new(textures: &[Texture], images: &[Image]) -> Result<Self, crate::error::RenderError> {
        let mut table = Self::default();
        let total: usize = images.iter().map(|i| words_of(&i.texels)).sum();
        if total >= i32::MAX as usize {
            let problem = format!("{total} words of texels; at most {}", i32::MAX);
            return Err(crate::error::RenderError::TooLarge(problem));
        }
        table.words.reserve_exact(total);
        let placed: Vec<[u32; 2]> = images.iter().map(|i| table.add(&i.texels)).collect();
        let wrap = |w: Wrap| match w {
            Wrap::Repeat => 0,
            Wrap::ClampToEdge => CLAMP,
            Wrap::MirroredRepeat => MIRROR,
        };
        for t in textures {
            let (image, [first, packing]) = (&images[t.image.index()], placed[t.image.index()]);
            let nearest = if t.filter == Filter::Nearest { NEAREST } else { 0 };
            let flags = wrap(t.wrap_u) | (wrap(t.wrap_v) << WRAP_BITS) | nearest | packing;
            table.textures.push([first, image.width, image.height, flags].map(f32::from_bits));
        }
        Ok(table)
    }

    /// Appends texels; where the first one is, and the flags that tell how they are kept.
    fn add(&mut self, texels: &Texels) -> [u32; 2] {
        let first = self.words.len() as u32;
        let packing = match texels {
            Texels::Rgba8(t) => {
                self.words.extend(t.iter().map(|t| u32::from_le_bytes(*t)));
                packing(8, 4, [0, 1, 2, 3])
            }
            Texels::Rgba16(t) => {
                self.words.extend(t.iter().flat_map(|t| [word16([t[0], t[1]]), word16([t[2], t[3]])]));
                packing(16, 4, [0, 1, 2, 3])
            }
            Texels::Few8(Few { values, kept, at }) => {
                let (words, rest) = values.as_chunks::<4>();
                self.words.extend(words.iter().map(|w| u32::from_le_bytes(*w)));
                let rest: Vec<u32> = rest.iter().enumerate().map(|(i, &v)| u32::from(v) << (8 * i)).collect();
                self.words.extend((!rest.is_empty()).then(|| rest.iter().sum::<u32>()));
                packing(8, *kept, *at)
            }
            Texels::Few16(Few { values, kept, at }) => {
                let (words, rest) = values.as_chunks::<2>();
                self.words.extend(words.iter().map(|w| word16(*w)));
                self.words.extend(rest.iter().map(|&v| u32::from(v)));
                packing(16, *kept, *at)
            }
        };
        self.has_packed |= packing & PACKED != 0;
        self.has_wide |= matches!(texels, Texels::Rgba16(_));
        [first, packing]
    }

    /// The binding of `wanted`, the same for the same; [`NO_TEXTURE`] for `None`.
    pub fn bind(&mut self, wanted: Option<TextureRef>) -> u32 {
        let Some(wanted) = wanted else { return NO_TEXTURE };
        let bits = |m: [[f32; 3]; 2]| [m[0][0], m[0][1], m[0][2], m[1][0], m[1][1], m[1][2]].map(f32::to_bits);
        let key = (wanted.texture.0, wanted.uv_set, wanted.transform.map(|t| bits(t.m)));
        if let Some(&known) = self.bindings.get(&key) {
            return known;
        }
        let id = self.headers.len() as u32;
        self.bindings.insert(key, id);
        let [first, width, height, flags] = self.textures[wanted.texture.index()];
        let flags = f32::from_bits(flags.to_bits() | (wanted.uv_set & UV_SET_MASK) << UV_SET_SHIFT);
        self.headers.push([first, width, height, flags]);
        let m = wanted.transform.map_or([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], |t| t.m);
        self.transforms.extend(m.map(|[a, b, c]| [a, b, c, 0.0]));
        self.has_transforms |= wanted.transform.is_some();
        id
    }

    /// The coordinates at which binding `id` reads: its set, transformed.
    #[inline(always)]
    pub fn coordinates<L: Lanes>(&self, id: L::U, uvs: &UvSets<L>) -> [L::F; 2] {
        let flags = id.records(&self.headers)[3].to_bits();
        let [u, v] = uvs.get(flags.shr(UV_SET_SHIFT));
        let row = id.min(L::U::splat(self.headers.len() as u32 - 1)).shl(1);
        let [a, b, c, _] = row.records(&self.transforms);
        let [d, e, f, _] = (row + L::U::splat(1)).records(&self.transforms);
        [a.mul_add(u, b.mul_add(v, c)), d.mul_add(u, e.mul_add(v, f))]
    }

    /// Width and height of binding `id`, texels.
    #[inline(always)]
    pub fn size<L: Lanes>(&self, id: L::U) -> [L::F; 2] {
        let [_, width, height, _] = id.records(&self.headers);
        [width.to_bits().to_float(), height.to_bits().to_float()]
    }

    /// The binding `id` at the coordinates that it asks for; a lane whose id is [`NO_TEXTURE`] reads anything.
    #[inline(always)]
    pub fn lookup<L: Lanes>(&self, id: L::U, uvs: &UvSets<L>, encoding: Encoding) -> Texel<L> {
        L::outline(Lookup { textures: self, id, uvs, encoding })
    }

    #[inline(always)]
    fn read<L: Lanes>(&self, id: L::U, uvs: &UvSets<L>, encoding: Encoding) -> Texel<L> {
        let [first, width, height, flags] = id.records(&self.headers);
        let (first, flags) = (first.to_bits(), flags.to_bits());
        let (width, height) = (width.to_bits(), height.to_bits());
        let [mut u, mut v] = uvs.get(flags.shr(UV_SET_SHIFT) & L::U::splat(UV_SET_MASK));
        if self.has_transforms {
            let row = id.min(L::U::splat(self.headers.len() as u32 - 1)).shl(1);
            let [a, b, c, _] = row.records(&self.transforms);
            let [d, e, f, _] = (row + L::U::splat(1)).records(&self.transforms);
            (u, v) = (a.mul_add(u, b.mul_add(v, c)), d.mul_add(u, e.mul_add(v, f)));
        }
        let nearest = flags.has(NEAREST);
        let across = taps::<L>(u, width.to_float(), flags, nearest);
        let down = taps::<L>(v, height.to_float(), flags.shr(WRAP_BITS), nearest);
        // Both ways give lanes of four bytes the same bits, so a lane does not depend on its neighbours.
        if self.has_packed && flags.has(PACKED).any() {
            let packing = Packing::<L>::new(flags);
            return self.filtered::<L, true>(first, width, &across, &down, &packing, encoding);
        }
        let unused =
            Packing::<L> { size: L::U::splat(0), at: [L::U::splat(0); 4], mask: L::U::splat(0), scale: L::F::zero() };
        self.filtered::<L, false>(first, width, &across, &down, &unused, encoding)
    }

    #[inline(always)]
    fn filtered<L: Lanes, const IS_PACKED: bool>(
        &self,
        first: L::U,
        width: L::U,
        across: &Taps<L>,
        down: &Taps<L>,
        packing: &Packing<L>,
        encoding: Encoding,
    ) -> Texel<L> {
        let row0 = down.first * width;
        let row1 = down.second * width;
        let t00 = self.texel::<L, IS_PACKED>(first, row0 + across.first, packing, encoding);
        let t10 = self.texel::<L, IS_PACKED>(first, row0 + across.second, packing, encoding);
        let t01 = self.texel::<L, IS_PACKED>(first, row1 + across.first, packing, encoding);
        let t11 = self.texel::<L, IS_PACKED>(first, row1 + across.second, packing, encoding);
        let (fx, fy) = (across.weight, down.weight);
        Texel {
            rgb: t00.rgb.lerp(t10.rgb, fx).lerp(t01.rgb.lerp(t11.rgb, fx), fy),
            a: lerp(lerp(t00.a, t10.a, fx), lerp(t01.a, t11.a, fx), fy),
        }
    }

    /// Texel `i` of the images that start at words `first`.
    #[inline(always)]
    fn texel<L: Lanes, const IS_PACKED: bool>(
        &self,
        first: L::U,
        i: L::U,
        packing: &Packing<L>,
        encoding: Encoding,
    ) -> Texel<L> {
        let [r, g, b, a] = if IS_PACKED {
            let byte = i.shl_each(packing.size);
            let word = first + byte.shr(2);
            let low = word.gather_uint(&self.words).shr_each((byte & L::U::splat(3)).shl(3));
            let mut high = low;
            if self.has_wide {
                high = (word + L::U::splat(1)).gather_uint(&self.words);
            }
            let [r, g, b, a] = packing.at;
            [
                channel::<L>(low, high, r, packing),
                channel::<L>(low, high, g, packing),
                channel::<L>(low, high, b, packing),
                channel::<L>(low, high, a, packing),
            ]
        } else {
            let t = (first + i).gather_uint(&self.words);
            let byte = L::U::splat(255);
            let scale = L::F::splat(1.0 / 255.0);
            [
                (t & byte).to_float() * scale,
                (t.shr(8) & byte).to_float() * scale,
                (t.shr(16) & byte).to_float() * scale,
                t.shr(24).to_float() * scale,
            ]
        };
        let rgb = match encoding {
            Encoding::Srgb => V3::new(srgb_to_linear(r), srgb_to_linear(g), srgb_to_linear(b)),
            Encoding::Linear => V3::new(r, g, b),
        };
        Texel { rgb, a }
    }
}

/// [`TextureTable::lookup`].
struct Lookup<'a, L: Lanes> {
    textures: &'a TextureTable,
    id: L::U,
    uvs: &'a UvSets<L>,
    encoding: Encoding,
}

impl<L: Lanes> Part<L> for Lookup<'_, L> {
    type Output = Texel<L>;

    #[inline(always)]
    fn run(self) -> Texel<L> {
        self.textures.read(self.id, self.uvs, self.encoding)
    }
}

/// The channel that starts at bit `at` of a texel of one or two words.
#[inline(always)]
fn channel<L: Lanes>(low: L::U, high: L::U, at: L::U, packing: &Packing<L>) -> L::F {
    let word = high.or_else(at.has(32), low);
    (word.shr_each(at & L::U::splat(31)) & packing.mask).to_float() * packing.scale
}

fn word16(pair: [u16; 2]) -> u32 {
    u32::from(pair[0]) | u32::from(pair[1]) << 16
}

/// Words that an image takes.
fn words_of(texels: &Texels) -> usize {
    match texels {
        Texels::Rgba8(t) => t.len(),
        Texels::Rgba16(t) => 2 * t.len(),
        Texels::Few8(few) => few.values.len().div_ceil(4),
        Texels::Few16(few) => few.values.len().div_ceil(2),
    }
}

/// The flags of texels of `kept` channels (1, 2 or 4) of `bits` bits, of which R, G, B and A are number `at`.
fn packing(bits: u32, kept: usize, at: [u8; 4]) -> u32 {
    let size = (bits / 8 * kept as u32).ilog2();
    let places = at.iter().enumerate().fold(0, |p, (k, &at)| p | u32::from(at) << (2 * k));
    let deep = if bits == 16 { DEEP } else { 0 };
    let is_packed = deep != 0 || kept != 4;
    (if is_packed { PACKED } else { 0 }) | deep | size << SIZE_SHIFT | places << PLACES_SHIFT
}

/// Two neighbouring texels in one direction and the second one's weight.
struct Taps<L: Lanes> {
    first: L::U,
    second: L::U,
    weight: L::F,
}

/// Where coordinate `u` falls among `size` texels; texel centres lie at (i + 1/2) / size.
#[inline(always)]
fn taps<L: Lanes>(u: L::F, size: L::F, flags: L::U, nearest: L::M) -> Taps<L> {
    let (zero, one, half) = (L::F::zero(), L::F::one(), L::F::splat(0.5));
    let clamps = flags.has(CLAMP);
    let mirrors = flags.has(MIRROR);
    // Into one period; NaN (an infinite coordinate) becomes 0.
    let repeated = u - u.floor();
    let folded = one - (u - (u * half).floor() * L::F::splat(2.0) - one).abs();
    let u = folded.or_else(mirrors, u.or_else(clamps, repeated));
    let u = u.max(zero).min(one);
    let last = size - one;
    let x = u * size;
    let below = (x - half).floor().or_else(!nearest, x.floor().min(last));
    let weight = (x - half - below).or_else(!nearest, zero);
    // Neighbours across the border: the other side when repeating, else the border texel again.
    let repeats = !(clamps | mirrors);
    let first = below.max(zero).or_else(!repeats, last.or_else(below.lt(zero), below));
    let above = below + one;
    let second = above.min(last).or_else(!repeats, zero.or_else(above.gt(last), above));
    Taps { first: first.to_uint(), second: second.max(zero).to_uint(), weight }
}

/// sRGB to linear (IEC 61966-2-1), relative error below 6e-6: with s = sqrt((v + 0.055) / 1.055) the power 2.4 is
/// s^4 * s^0.8, and s^0.8 is a polynomial fitted on the curved part. (Twelve table gathers a lookup were the dearest part of a prototype.)
#[inline(always)]
pub fn srgb_to_linear<F: Float>(v: F) -> F {
    let s = v.mul_add(F::splat(1.0 / 1.055), F::splat(0.055 / 1.055)).sqrt();
    let mut p = F::splat(-0.101_907_5);
    p = p.mul_add(s, F::splat(0.489_490_24));
    p = p.mul_add(s, F::splat(-1.013_054_5));
    p = p.mul_add(s, F::splat(1.206_600_8));
    p = p.mul_add(s, F::splat(-0.990_352_3));
    p = p.mul_add(s, F::splat(1.376_997_3));
    p = p.mul_add(s, F::splat(0.032_225_095));
    let s2 = s * s;
    (v * F::splat(1.0 / 12.92)).or_else(v.le(F::splat(0.04045)), s2 * s2 * p)
}

#[cfg(test)]
#[path = "lookup_tests.rs"]
mod tests;

//! Texture lookups over N lanes: wrap, bilinear or nearest, decoded to linear before filtering; at level 0, or between the
//! two levels of detail that a lane's footprint asks for where the table has levels ([`TextureTable::add_levels`]).
//!
//! All texels of a scene lie in one array, so lanes with different textures are read together. An image keeps as many
//! channels and bits as it has (see [`Texels`]): 1, 2, 4 or 8 bytes a texel, its channels found by shifts per lane. Where
//! all lanes have the common four bytes, those shifts are the same for all and cost nothing.

use super::mips::{Average, Size, levels, sizes_below};
use super::{Few, Filter, Image, Texels, Texture, TextureRef, Wrap};
use crate::error::RenderError;
use crate::math::lanes::{lerp, ln};
use crate::math::{UvSets, V3};
use simd::{Float, Lanes, Mask, Part, Uint};
use std::borrow::Borrow;
use std::collections::BTreeMap;

/// No texture, in tables.
pub const NO_TEXTURE: u32 = u32::MAX;

/// A texture, its set of coordinates, the bits of its transform, and what its levels average.
type BindingKey = (u32, u32, Option<[u32; 6]>, Average);

/// The textures of a scene, ready to be read: each as some material reads it, which is called a binding.
#[derive(Clone, Debug, Default)]
pub struct TextureTable {
    /// Per texture of the scene: first word, width, height (as integers' bits), flags.
    textures: Vec<[f32; 4]>,
    /// The binding of each key.
    bindings: BTreeMap<BindingKey, u32>,
    /// Per binding: texture, what its levels average.
    bound: Vec<(u32, Average)>,
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
    /// Per binding, if there are levels of detail: its first one (as an integer's bits), its last one's number, texels of
    /// level 0 per unit area of the coordinates before the transform.
    chains: Vec<[f32; 4]>,
    /// First word, width, height (as integers' bits) of levels of detail.
    levels: Vec<[f32; 4]>,
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
    pub fn new(textures: &[Texture], images: &[impl Borrow<Image>]) -> Result<Self, RenderError> {
        let images: Vec<&Image> = images.iter().map(Borrow::borrow).collect();
        let mut table = Self::default();
        table.reserve(images.iter().map(|i| words_of(&i.texels)).sum())?;
        let placed: Vec<[u32; 2]> = images.iter().map(|i| table.add(&i.texels)).collect();
        let wrap = |w: Wrap| match w {
            Wrap::Repeat => 0,
            Wrap::ClampToEdge => CLAMP,
            Wrap::MirroredRepeat => MIRROR,
        };
        for t in textures {
            let (image, [first, packing]) = (images[t.image.index()], placed[t.image.index()]);
            let nearest = if t.filter == Filter::Nearest { NEAREST } else { 0 };
            let flags = wrap(t.wrap_u) | (wrap(t.wrap_v) << WRAP_BITS) | nearest | packing;
            table.textures.push([first, image.width, image.height, flags].map(f32::from_bits));
        }
        Ok(table)
    }

    /// Makes room for `more` words.
    fn reserve(&mut self, more: usize) -> Result<(), RenderError> {
        let total = self.words.len().saturating_add(more);
        if total >= i32::MAX as usize {
            return Err(RenderError::TooLarge(format!("{total} words of texels; at most {}", i32::MAX)));
        }
        self.words.reserve_exact(more);
        Ok(())
    }

    /// Makes the levels of detail of all textures that are bound; `textures` and `images` as given to [`Self::new`]. What is
    /// bound later has none.
    ///
    /// # Errors
    /// More texels than a 32-bit index reaches.
    pub fn add_levels(&mut self, textures: &[Texture], images: &[impl Borrow<Image>]) -> Result<(), RenderError> {
        let images: Vec<&Image> = images.iter().map(Borrow::borrow).collect();
        let image = |texture: u32| textures[texture as usize].image.index();
        let mut wanted: Vec<(usize, Average)> = self.bound.iter().map(|&(t, average)| (image(t), average)).collect();
        wanted.sort_unstable();
        wanted.dedup();
        let below = |i: &Image| sizes_below([i.width as usize, i.height as usize]);
        let more = |&(i, average): &(usize, Average)| match average {
            Average::Never => 0,
            _ => below(images[i]).iter().map(|[w, h]| words_for(&images[i].texels, w * h)).sum(),
        };
        self.reserve(wanted.iter().map(more).sum())?;
        let mut chains = BTreeMap::new();
        for (i, average) in wanted {
            let Image { width, height, texels, .. } = images[i];
            let texture = textures.iter().position(|t| t.image.index() == i).expect("bound textures have images");
            let record = |first: u32, [w, h]: Size| [first, w as u32, h as u32, 0].map(f32::from_bits);
            let (first, size) = (self.levels.len(), [*width as usize, *height as usize]);
            self.levels.push(record(self.textures[texture][0].to_bits(), size));
            let mut sizes = sizes_below(size).into_iter();
            levels(texels, size, average, |level| {
                let [at, _] = self.add(&level);
                self.levels.extend(sizes.next().map(|size| record(at, size)));
            });
            chains.insert((i, average), (first as u32, (self.levels.len() - first - 1) as f32));
        }
        for (binding, &(texture, average)) in self.bound.iter().enumerate() {
            let (first, last) = chains[&(image(texture), average)];
            let Image { width, height, .. } = images[image(texture)];
            let [[a, b, ..], [d, e, ..]] = [self.transforms[2 * binding], self.transforms[2 * binding + 1]];
            let texels = (a * e - b * d).abs() * *width as f32 * *height as f32;
            self.chains.push([f32::from_bits(first), last, texels, 0.0]);
        }
        Ok(())
    }

    /// Whether there are levels of detail.
    pub fn has_levels(&self) -> bool {
        !self.chains.is_empty()
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

    /// The binding of `wanted`, the same for the same; [`NO_TEXTURE`] for `None`. `average`: what its levels of detail are
    /// made by, if there will be any.
    pub fn bind(&mut self, wanted: Option<TextureRef>, average: Average) -> u32 {
        let Some(wanted) = wanted else { return NO_TEXTURE };
        let bits = |m: [[f32; 3]; 2]| [m[0][0], m[0][1], m[0][2], m[1][0], m[1][1], m[1][2]].map(f32::to_bits);
        let key = (wanted.texture.0, wanted.uv_set, wanted.transform.map(|t| bits(t.m)), average);
        if let Some(&known) = self.bindings.get(&key) {
            return known;
        }
        let id = self.headers.len() as u32;
        self.bindings.insert(key, id);
        self.bound.push((wanted.texture.0, average));
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
        self.place::<L>(id, id.records(&self.headers)[3].to_bits(), uvs)
    }

    /// [`TextureTable::coordinates`] of a binding whose flags are at hand.
    #[inline(always)]
    fn place<L: Lanes>(&self, id: L::U, flags: L::U, uvs: &UvSets<L>) -> [L::F; 2] {
        let [u, v] = uvs.get(uv_set::<L>(flags));
        if !self.has_transforms {
            return [u, v];
        }
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
        if self.has_levels() && uvs.footprints().is_some() {
            return L::outline(LevelLookup { textures: self, id, uvs, encoding });
        }
        L::outline(Lookup { textures: self, id, uvs, encoding })
    }

    #[inline(always)]
    fn read<L: Lanes>(&self, id: L::U, uvs: &UvSets<L>, encoding: Encoding) -> Texel<L> {
        let [first, width, height, flags] = id.records(&self.headers);
        let (first, flags) = (first.to_bits(), flags.to_bits());
        let place = self.place::<L>(id, flags, uvs);
        self.level::<L>([first, width.to_bits(), height.to_bits()], flags, place, encoding)
    }

    /// The level that starts at word `first` and has these sides, at the coordinates `u`, `v`.
    #[inline(always)]
    fn level<L: Lanes>(
        &self,
        [first, width, height]: [L::U; 3],
        flags: L::U,
        [u, v]: [L::F; 2],
        encoding: Encoding,
    ) -> Texel<L> {
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

    /// Record `number` of the levels of detail.
    #[inline(always)]
    fn level_number<L: Lanes>(&self, number: L::U, flags: L::U, place: [L::F; 2], encoding: Encoding) -> Texel<L> {
        let [first, width, height, _] = number.records(&self.levels);
        self.level::<L>([first.to_bits(), width.to_bits(), height.to_bits()], flags, place, encoding)
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

/// [`TextureTable::lookup`] between levels of detail.
struct LevelLookup<'a, L: Lanes> {
    textures: &'a TextureTable,
    id: L::U,
    uvs: &'a UvSets<L>,
    encoding: Encoding,
}

/// 1 / (2 ln 2): of the natural logarithm of an area in texels, the binary one of its width.
const HALF_LOG2_E: f32 = 0.5 * std::f32::consts::LOG2_E;

impl<L: Lanes> Part<L> for LevelLookup<'_, L> {
    type Output = Texel<L>;

    #[inline(always)]
    fn run(self) -> Texel<L> {
        let Self { textures, id, uvs, encoding } = self;
        let (zero, one) = (L::F::zero(), L::F::one());
        let flags = id.records(&textures.headers)[3].to_bits();
        let [first, last, texels, _] = id.records(&textures.chains);
        let place = textures.place::<L>(id, flags, uvs);
        let area: L::F = uvs.footprint(uv_set::<L>(flags)) * texels;
        // The level whose texels are as wide as the footprint, after Akenine-Moller et al. 2019, equation 34; 0 for NaN.
        let wanted: L::F =
            (ln::<L>(area.max(zero).min(L::F::splat(f32::MAX))) * L::F::splat(HALF_LOG2_E)).max(zero).min(last);
        let fine = wanted.floor();
        let weight = wanted - fine;
        let texel = textures.level_number::<L>(first.to_bits() + fine.to_uint(), flags, place, encoding);
        if !weight.gt(zero).any() {
            return texel;
        }
        let coarse = first.to_bits() + (fine + one).min(last).to_uint();
        let coarse = textures.level_number::<L>(coarse, flags, place, encoding);
        // Exactly the finer one where the weight is 0, so that a lane does not depend on its neighbours.
        Texel { rgb: texel.rgb.lerp(coarse.rgb, weight), a: lerp(texel.a, coarse.a, weight) }
    }
}

/// The set of coordinates in the flags of a binding.
#[inline(always)]
fn uv_set<L: Lanes>(flags: L::U) -> L::U {
    flags.shr(UV_SET_SHIFT) & L::U::splat(UV_SET_MASK)
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
    words_for(texels, texels.len())
}

/// Words that `n` texels take that are kept as `like`.
fn words_for(like: &Texels, n: usize) -> usize {
    match like {
        Texels::Rgba8(_) => n,
        Texels::Rgba16(_) => 2 * n,
        Texels::Few8(few) => (few.kept * n).div_ceil(4),
        Texels::Few16(few) => (few.kept * n).div_ceil(2),
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

//! Texture lookups over N lanes: wrap, bilinear or nearest at level 0, decoded to linear before filtering.
//!
//! All texels of a scene lie in one array, so lanes with different textures are read together.

use super::{Filter, Image, Texels, Texture, TextureRef, Wrap};
use crate::math::{UvSets, V3, lanes::lerp};
use simd::{Float, Lanes, Uint};

/// No texture, in tables.
pub const NO_TEXTURE: u32 = u32::MAX;

/// The textures of a scene, ready to be read: each as some material reads it, which is called a binding.
#[derive(Clone, Debug, Default)]
pub struct TextureTable {
    /// Per texture of the scene: first texel, width, height (as integers' bits), flags.
    textures: Vec<[f32; 4]>,
    /// What each binding stands for.
    bindings: Vec<TextureRef>,
    /// Per binding: the texture's record with the set of coordinates in its flags.
    headers: Vec<[f32; 4]>,
    /// Two per binding: the rows of its transform.
    transforms: Vec<[f32; 4]>,
    /// Some binding has a transform.
    has_transforms: bool,
    /// R, G, B, A from the low byte up, rows from the top.
    texels: Vec<u32>,
}

const WRAP_BITS: u32 = 2;
const CLAMP: u32 = 1;
const MIRROR: u32 = 2;
const NEAREST: u32 = 1 << (2 * WRAP_BITS);
/// Where the set of coordinates is in the flags.
const UV_SET_SHIFT: u32 = 8;

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

impl TextureTable {
    /// Packs `images` once each, in order.
    ///
    /// # Errors
    /// More texels than a 32-bit index reaches.
    pub fn new(textures: &[Texture], images: &[Image]) -> Result<Self, crate::error::RenderError> {
        let total: usize = images.iter().map(|i| i.texels.len()).sum();
        if total >= i32::MAX as usize {
            return Err(crate::error::RenderError::TooLarge(format!("{total} texels; at most {}", i32::MAX)));
        }
        let mut texels = Vec::with_capacity(total);
        let mut first = Vec::with_capacity(images.len());
        for image in images {
            first.push(texels.len() as u32);
            match &image.texels {
                Texels::Rgba8(t) => texels.extend(t.iter().map(|t| u32::from_le_bytes(*t))),
                Texels::Rgba16(t) => {
                    texels.extend(t.iter().map(|t| u32::from_le_bytes(t.map(|c| (u32::from(c) / 257) as u8))));
                }
            }
        }
        let wrap = |w: Wrap| match w {
            Wrap::Repeat => 0,
            Wrap::ClampToEdge => CLAMP,
            Wrap::MirroredRepeat => MIRROR,
        };
        let textures = textures
            .iter()
            .map(|t| {
                let image = &images[t.image.index()];
                let nearest = if t.filter == Filter::Nearest { NEAREST } else { 0 };
                let flags = wrap(t.wrap_u) | (wrap(t.wrap_v) << WRAP_BITS) | nearest;
                [first[t.image.index()], image.width, image.height, flags].map(f32::from_bits)
            })
            .collect();
        Ok(Self { textures, texels, ..Self::default() })
    }

    /// The binding of `wanted`, the same for the same; [`NO_TEXTURE`] for `None`.
    pub fn bind(&mut self, wanted: Option<TextureRef>) -> u32 {
        let Some(wanted) = wanted else { return NO_TEXTURE };
        if let Some(known) = self.bindings.iter().position(|b| *b == wanted) {
            return known as u32;
        }
        let [first, width, height, flags] = self.textures[wanted.texture.index()];
        let flags = f32::from_bits(flags.to_bits() | wanted.uv_set << UV_SET_SHIFT);
        self.bindings.push(wanted);
        self.headers.push([first, width, height, flags]);
        let m = wanted.transform.map_or([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], |t| t.m);
        self.transforms.extend(m.map(|[a, b, c]| [a, b, c, 0.0]));
        self.has_transforms |= wanted.transform.is_some();
        (self.bindings.len() - 1) as u32
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
        let [first, width, height, flags] = id.records(&self.headers);
        let (first, flags) = (first.to_bits(), flags.to_bits());
        let (width, height) = (width.to_bits(), height.to_bits());
        let [mut u, mut v] = uvs.get(flags.shr(UV_SET_SHIFT));
        if self.has_transforms {
            let row = id.min(L::U::splat(self.headers.len() as u32 - 1)).shl(1);
            let [a, b, c, _] = row.records(&self.transforms);
            let [d, e, f, _] = (row + L::U::splat(1)).records(&self.transforms);
            (u, v) = (a.mul_add(u, b.mul_add(v, c)), d.mul_add(u, e.mul_add(v, f)));
        }
        let nearest = flags.has(NEAREST);
        let across = taps::<L>(u, width.to_float(), flags, nearest);
        let down = taps::<L>(v, height.to_float(), flags.shr(WRAP_BITS), nearest);
        let row0 = first + down.first * width;
        let row1 = first + down.second * width;
        let t00 = self.texel::<L>(row0 + across.first, encoding);
        let t10 = self.texel::<L>(row0 + across.second, encoding);
        let t01 = self.texel::<L>(row1 + across.first, encoding);
        let t11 = self.texel::<L>(row1 + across.second, encoding);
        let (fx, fy) = (across.weight, down.weight);
        Texel {
            rgb: t00.rgb.lerp(t10.rgb, fx).lerp(t01.rgb.lerp(t11.rgb, fx), fy),
            a: lerp(lerp(t00.a, t10.a, fx), lerp(t01.a, t11.a, fx), fy),
        }
    }

    #[inline(always)]
    fn texel<L: Lanes>(&self, i: L::U, encoding: Encoding) -> Texel<L> {
        let t = i.gather_uint(&self.texels);
        let byte = L::U::splat(255);
        let scale = L::F::splat(1.0 / 255.0);
        let r = (t & byte).to_float() * scale;
        let g = (t.shr(8) & byte).to_float() * scale;
        let b = (t.shr(16) & byte).to_float() * scale;
        let rgb = match encoding {
            Encoding::Srgb => V3::new(srgb_to_linear(r), srgb_to_linear(g), srgb_to_linear(b)),
            Encoding::Linear => V3::new(r, g, b),
        };
        Texel { rgb, a: t.shr(24).to_float() * scale }
    }
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
mod tests {
    use super::*;
    use crate::id::{ImageId, TextureId};
    use simd::{Kernel, Level, dispatch};

    struct Read<'a> {
        table: &'a TextureTable,
        u: f32,
        v: f32,
        encoding: Encoding,
    }

    impl Kernel for Read<'_> {
        type Output = [f32; 4];

        #[inline(always)]
        fn run<L: Lanes>(self) -> [f32; 4] {
            let uvs = UvSets::<L>::single(L::F::splat(self.u), L::F::splat(self.v));
            let t = self.table.lookup::<L>(L::U::splat(0), &uvs, self.encoding);
            let mut out = [[0.0; 16]; 4];
            for (o, c) in out.iter_mut().zip([t.rgb.x, t.rgb.y, t.rgb.z, t.a]) {
                c.store(o, 0);
            }
            out.map(|o| o[0])
        }
    }

    fn table(wrap: Wrap, filter: Filter) -> TextureTable {
        // 3 x 2 texels: red counts across, green counts down.
        let texels = (0..6u8).map(|i| [i % 3 * 100, i / 3 * 200, 7, 255]).collect();
        let image = Image { width: 3, height: 2, texels: Texels::Rgba8(texels), name: String::new() };
        bound(
            TextureTable::new(&[Texture { image: ImageId(0), wrap_u: wrap, wrap_v: wrap, filter }], &[image]).unwrap(),
        )
    }

    fn bound(mut table: TextureTable) -> TextureTable {
        table.bind(Some(TextureRef::plain(TextureId(0))));
        table
    }

    fn read(t: &TextureTable, u: f32, v: f32) -> [f32; 4] {
        let values: Vec<[f32; 4]> = [Level::Scalar, Level::Portable8, Level::Avx2, Level::Avx512]
            .into_iter()
            .filter(|l| l.is_available())
            .map(|l| dispatch(l, Read { table: t, u, v, encoding: Encoding::Linear }))
            .collect();
        for v in &values {
            assert!(v.iter().zip(&values[0]).all(|(a, b)| (a - b).abs() < 1e-6), "levels differ");
        }
        values[0].map(|v| v * 255.0)
    }

    #[test]
    fn texel_centres_give_the_texel_and_row_0_is_at_the_top() {
        for filter in [Filter::Nearest, Filter::Bilinear] {
            let t = table(Wrap::Repeat, filter);
            for (x, y) in [(0, 0), (1, 0), (2, 0), (0, 1), (2, 1)] {
                let got = read(&t, (x as f32 + 0.5) / 3.0, (y as f32 + 0.5) / 2.0);
                assert!(
                    (got[0] - x as f32 * 100.0).abs() < 1e-3 && (got[1] - y as f32 * 200.0).abs() < 1e-3,
                    "{got:?}"
                );
            }
        }
    }

    #[test]
    fn bilinear_blends_in_both_directions_under_every_wrap_mode() {
        for wrap in [Wrap::Repeat, Wrap::ClampToEdge, Wrap::MirroredRepeat] {
            let got = read(&table(wrap, Filter::Bilinear), 1.0 / 3.0, 0.5);
            assert!((got[0] - 50.0).abs() < 1e-3 && (got[1] - 100.0).abs() < 1e-3, "{wrap:?}: {got:?}");
        }
    }

    #[test]
    fn bilinear_blends_across_the_border_as_the_wrap_mode_says() {
        let border = |wrap| read(&table(wrap, Filter::Bilinear), 0.0, 0.25)[0];
        assert!((border(Wrap::Repeat) - 100.0).abs() < 1e-3);
        assert!(border(Wrap::ClampToEdge).abs() < 1e-3);
        assert!(border(Wrap::MirroredRepeat).abs() < 1e-3);
    }

    #[test]
    fn coordinates_outside_the_unit_square_wrap() {
        for (wrap, u, same_as) in [
            (Wrap::Repeat, 1.4, 0.4),
            (Wrap::Repeat, -0.3, 0.7),
            (Wrap::MirroredRepeat, 1.4, 0.6),
            (Wrap::MirroredRepeat, -0.3, 0.3),
            (Wrap::MirroredRepeat, 2.2, 0.2),
            (Wrap::ClampToEdge, 1.4, 1.0),
            (Wrap::ClampToEdge, -9.0, 0.0),
        ] {
            let t = table(wrap, Filter::Bilinear);
            assert!((read(&t, u, 0.3)[0] - read(&t, same_as, 0.3)[0]).abs() < 1e-2, "{wrap:?} {u}");
        }
    }

    #[test]
    fn unusable_coordinates_read_some_texel() {
        for u in [f32::NAN, f32::INFINITY, -f32::INFINITY, 1e30, -1e30] {
            for wrap in [Wrap::Repeat, Wrap::MirroredRepeat, Wrap::ClampToEdge] {
                let got = read(&table(wrap, Filter::Bilinear), u, 0.3);
                assert!(got.iter().all(|v| v.is_finite()), "{u} {wrap:?}: {got:?}");
            }
        }
    }

    #[test]
    fn srgb_bytes_decode_within_the_stated_error() {
        for byte in 0..=255u8 {
            let image = Image { width: 1, height: 1, texels: Texels::Rgba8(vec![[byte; 4]]), name: String::new() };
            let sampler =
                Texture { image: ImageId(0), wrap_u: Wrap::Repeat, wrap_v: Wrap::Repeat, filter: Filter::Bilinear };
            let table = bound(TextureTable::new(&[sampler], &[image]).unwrap());
            let got = dispatch(Level::best(), Read { table: &table, u: 0.5, v: 0.5, encoding: Encoding::Srgb });
            let v = f64::from(byte) / 255.0;
            let exact = if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) };
            assert!((f64::from(got[0]) - exact).abs() <= 7e-6 * exact, "byte {byte}: {} for {exact}", got[0]);
            assert!((f64::from(got[3]) - v).abs() < 1e-6);
        }
    }
}

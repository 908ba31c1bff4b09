use super::*;
use crate::id::{ImageId, TextureId};
use crate::math::UvSets;
use crate::texture::lookup::{Encoding, TextureTable};
use crate::texture::{Channels, Filter, Image, Texture, TextureRef, UvTransform, Wrap};
use simd::{Float, Kernel, Lanes, Level, Uint, dispatch};

/// `n` numbers without order; the same every time.
fn numbers(n: usize) -> impl Iterator<Item = u16> {
    (1..=n as u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 13) as u16)
}

fn noise(n: usize) -> Vec<[u16; 4]> {
    let all: Vec<u16> = numbers(4 * n).collect();
    all.as_chunks::<4>().0.to_vec()
}

fn all_levels(texels: &Texels, size: Size, average: Average) -> Vec<Texels> {
    let mut found = Vec::new();
    levels(texels, size, average, |level| found.push(level));
    found
}

/// Mean of channel `c`, as encoded or as light.
fn mean_of(texels: &Texels, c: usize, is_light: bool) -> f64 {
    let value = |i| f64::from(texels.get(i)[c]);
    let values = (0..texels.len()).map(|i| if is_light { linear_from_srgb(value(i)) } else { value(i) });
    values.sum::<f64>() / texels.len() as f64
}

#[test]
fn levels_of_every_size_keep_the_mean() {
    for size in [[1, 1], [2, 2], [3, 2], [5, 7], [1, 17], [31, 12], [64, 9]] {
        let texels = Texels::Rgba16(noise(size[0] * size[1]));
        for (average, is_light) in [(Average::Values, false), (Average::Light, true)] {
            let levels = all_levels(&texels, size, average);
            assert_eq!(levels.iter().map(Texels::len).collect::<Vec<_>>(), {
                sizes_below(size).iter().map(|[w, h]| w * h).collect::<Vec<_>>()
            });
            assert!(levels.last().unwrap_or(&texels).len() == 1, "down to one texel");
            for level in &levels {
                for c in 0..4 {
                    let is_light = is_light && c < 3;
                    let (found, wanted) = (mean_of(level, c, is_light), mean_of(&texels, c, is_light));
                    // A texel is rounded by half a step of 16 bits; light is 2.3 times as steep as its code at most.
                    let step = if is_light { 2.3 } else { 1.0 } * 0.5 / 65_535.0;
                    assert!((found - wanted).abs() <= step + 1e-6, "{size:?} {average:?} {c}: {found} for {wanted}");
                }
            }
        }
    }
}

#[test]
fn levels_of_one_colour_have_that_colour() {
    for byte in 0..=255_u8 {
        for average in [Average::Values, Average::Light, Average::LightByOpacity] {
            let texels = Texels::Rgba8(vec![[byte, 255 - byte, 7, byte]; 15]);
            for level in all_levels(&texels, [3, 5], average) {
                assert!((0..level.len()).all(|i| level.get(i) == texels.get(0)), "{byte} {average:?}: {level:?}");
            }
        }
    }
}

#[test]
fn colours_are_averaged_as_light_and_by_what_is_there() {
    let board = Texels::Rgba8(vec![[0, 0, 0, 0], [255; 4], [255; 4], [0, 0, 0, 0]]);
    let one = |average| all_levels(&board, [2, 2], average);
    // Half of the light is byte 188.
    assert_eq!(one(Average::Values), [Texels::Rgba8(vec![[128; 4]])]);
    assert_eq!(one(Average::Light), [Texels::Rgba8(vec![[188, 188, 188, 128]])]);
    assert_eq!(one(Average::LightByOpacity), [Texels::Rgba8(vec![[255, 255, 255, 128]])]);
    assert_eq!(one(Average::Never), []);
    // Where nothing is there, any colour does.
    let nothing = Texels::Rgba8(vec![[9, 9, 9, 0]; 4]);
    assert_eq!(all_levels(&nothing, [2, 2], Average::LightByOpacity), [Texels::Rgba8(vec![[9, 9, 9, 0]])]);
}

#[test]
fn levels_keep_the_channels_that_their_image_keeps() {
    let size = [6, 5];
    let words = noise(30);
    let bytes = words.iter().map(|t| t.map(|v| (v >> 8) as u8)).collect();
    for whole in [Texels::Rgba8(bytes), Texels::Rgba16(words)] {
        for used in [Channels::G | Channels::B, Channels::R, Channels::R | Channels::A] {
            let few = whole.clone().narrowed(used);
            let pairs =
                all_levels(&whole, size, Average::Values).into_iter().zip(all_levels(&few, size, Average::Values));
            for (all, some) in pairs {
                assert!(matches!(some, Texels::Few8(_) | Texels::Few16(_)));
                for i in 0..all.len() {
                    assert!((0..4).filter(|&c| used.has(c)).all(|c| all.get(i)[c] == some.get(i)[c]), "{used:?}");
                }
            }
        }
    }
}

/// Reads bindings 0, 1, .. in turn lane by lane at one point, each with its own footprint in sets 0 and 1.
struct Read<'a> {
    table: &'a TextureTable,
    footprints: &'a [[f32; 2]],
    sharp: bool,
}

const AT: [f32; 2] = [0.3, 0.6];

impl Kernel for Read<'_> {
    type Output = Vec<[f32; 4]>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Vec<[f32; 4]> {
        let n = self.footprints.len();
        let of = |start: usize, set: usize| {
            let values: Vec<f32> = (0..L::N).map(|lane| self.footprints[(start + lane) % n][set]).collect();
            L::F::load(&values, 0)
        };
        (0..n)
            .map(|start| {
                let ids: Vec<u32> = (0..L::N).map(|lane| ((start + lane) % n) as u32).collect();
                let mut uvs = UvSets::<L>::single(L::F::splat(AT[0]), L::F::splat(AT[1]));
                uvs.set(1, L::F::splat(AT[0]), L::F::splat(AT[1]));
                let zero = L::F::zero();
                uvs = uvs.with_footprints([of(start, 0), of(start, 1), zero, zero]);
                let uvs = if self.sharp { uvs.sharp() } else { uvs };
                let t = self.table.lookup::<L>(L::U::load(&ids, 0), &uvs, Encoding::Linear);
                [t.rgb.x.first(), t.rgb.y.first(), t.rgb.z.first(), t.a.first()]
            })
            .collect()
    }
}

/// What binding i reads for footprint i, the same at every level of this CPU: lanes have other neighbours at each.
fn read(table: &TextureTable, footprints: &[[f32; 2]], sharp: bool) -> Vec<[f32; 4]> {
    let levels = [Level::Scalar, Level::Portable8, Level::Avx2, Level::Avx512];
    let read = |level| dispatch(level, Read { table, footprints, sharp });
    let mut all = levels.into_iter().filter(|l| l.is_available()).map(read);
    let first = all.next().expect("scalar");
    for other in all {
        let pairs = first.as_flattened().iter().zip(other.as_flattened());
        assert!(pairs.clone().all(|(a, b)| (a - b).abs() < 2e-6), "{first:?} {other:?}");
    }
    first
}

#[test]
fn a_footprint_is_read_at_the_level_whose_texels_are_as_wide() {
    let size = [8, 8];
    let texels = Texels::Rgba8(noise(64).iter().map(|t| t.map(|v| (v >> 8) as u8)).collect());
    let image = Image { width: 8, height: 8, texels: texels.clone(), name: String::new() };
    let sampler = Texture { image: ImageId(0), wrap_u: Wrap::Repeat, wrap_v: Wrap::Repeat, filter: Filter::Bilinear };
    // What each level alone gives, as an image of its own.
    let alone: Vec<[f32; 4]> = std::iter::once(texels.clone())
        .chain(all_levels(&texels, size, Average::Values))
        .zip(std::iter::once(size).chain(sizes_below(size)))
        .map(|(texels, [w, h])| {
            let image = Image { width: w as u32, height: h as u32, texels, name: String::new() };
            let mut table = TextureTable::new(std::slice::from_ref(&sampler), &[image]).expect("small");
            table.bind(Some(TextureRef::plain(TextureId(0))), Average::Values);
            read(&table, &[[1.0; 2]], true)[0]
        })
        .collect();

    let (samplers, images) = ([sampler], [image]);
    let mut table = TextureTable::new(&samplers, &images).expect("small");
    let plain = TextureRef::plain(TextureId(0));
    let doubled = UvTransform { m: [[2.0, 0.0, -AT[0]], [0.0, 2.0, -AT[1]]] };
    let wanted = [plain, TextureRef { uv_set: 1, ..plain }, TextureRef { transform: Some(doubled), ..plain }];
    for wanted in wanted {
        table.bind(Some(wanted), Average::Values);
    }
    table.bind(Some(plain), Average::Never);
    assert!(!table.has_levels());
    table.add_levels(&samplers, &images).expect("small");
    assert!(table.has_levels());
    let close = |found: [f32; 4], wanted: [f32; 4]| found.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-5);
    for lod in [-40.0_f32, -1.0, 0.0, 0.5, 1.0, 1.75, 2.0, 2.9, 3.0, 9.0, 60.0] {
        // Set 1 sees twice the width; the transform doubles what binding 2 sees.
        let area = (lod.exp2() / 8.0).powi(2);
        let found = read(&table, &[[area, 4.0 * area]; 4], false);
        for (i, more) in [0.0, 1.0, 1.0].into_iter().enumerate() {
            let lod = (lod + more).clamp(0.0, 3.0);
            let (low, part) = (lod.floor() as usize, lod.fract());
            let (a, b) = (alone[low], alone[(low + 1).min(3)]);
            let wanted = [0, 1, 2, 3].map(|c| a[c] + (b[c] - a[c]) * part);
            assert!(close(found[i], wanted), "binding {i} at {lod}: {:?} for {wanted:?}", found[i]);
        }
        assert!(close(found[3], alone[0]), "level 0 alone");
    }
    // What is not a number asks for nothing.
    for odd in [f32::NAN, -1.0] {
        assert!(close(read(&table, &[[odd; 2]; 4], false)[0], alone[0]), "{odd}");
    }
    assert!(close(read(&table, &[[f32::INFINITY; 2]; 4], false)[0], alone[3]));
    // Magnified, the bits are those of the lookup without levels, whatever the neighbours read.
    let sharp = read(&table, &[[1.0; 2]; 4], true);
    let near = read(&table, &[[1e-6; 2], [0.1; 2], [1e-6; 2], [1.0; 2]], false);
    assert_eq!(
        (near[0].map(f32::to_bits), near[2].map(f32::to_bits)),
        (sharp[0].map(f32::to_bits), sharp[2].map(f32::to_bits))
    );
}

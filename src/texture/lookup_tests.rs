use super::*;
use crate::id::{ImageId, TextureId};
use crate::texture::{Channels, UvTransform};
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
    bound(TextureTable::new(&[Texture { image: ImageId(0), wrap_u: wrap, wrap_v: wrap, filter }], &[image]).unwrap())
}

fn bound(mut table: TextureTable) -> TextureTable {
    table.bind(Some(TextureRef::plain(TextureId(0))), Average::Never);
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
            assert!((got[0] - x as f32 * 100.0).abs() < 1e-3 && (got[1] - y as f32 * 200.0).abs() < 1e-3, "{got:?}");
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

/// Reads binding `lane % bindings` in each lane.
struct Mixed<'a> {
    table: &'a TextureTable,
    bindings: u32,
    /// Set 0, then set 1.
    uvs: [[f32; 2]; 2],
}

impl Kernel for Mixed<'_> {
    type Output = Vec<[f32; 4]>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Vec<[f32; 4]> {
        let splat = L::F::splat;
        let mut uvs = UvSets::<L>::single(splat(self.uvs[0][0]), splat(self.uvs[0][1]));
        uvs.set(1, splat(self.uvs[1][0]), splat(self.uvs[1][1]));
        let mut found = Vec::new();
        for start in 0..self.bindings {
            let ids: Vec<u32> = (0..L::N as u32).map(|lane| (start + lane) % self.bindings).collect();
            let t = self.table.lookup::<L>(L::U::load(&ids, 0), &uvs, Encoding::Linear);
            let mut out = [[0.0; 16]; 4];
            for (o, c) in out.iter_mut().zip([t.rgb.x, t.rgb.y, t.rgb.z, t.a]) {
                c.store(o, 0);
            }
            found.extend((0..L::N).map(|lane| (ids[lane], out.map(|o| o[lane]))));
        }
        found.sort_by_key(|f| f.0);
        found.chunk_by(|a, b| a.0 == b.0).for_each(|same| {
            // The same texture next to other neighbours: the same bits.
            assert!(same.iter().all(|f| f.1.map(f32::to_bits) == same[0].1.map(f32::to_bits)), "{same:?}");
        });
        found.dedup_by_key(|f| f.0);
        found.into_iter().map(|f| f.1).collect()
    }
}

/// What each binding reads, at every level of this CPU.
fn read_mixed(table: &TextureTable, bindings: u32, uvs: [[f32; 2]; 2]) -> Vec<[f32; 4]> {
    let levels = [Level::Scalar, Level::Portable8, Level::Avx2, Level::Avx512];
    let mut all = levels.into_iter().filter(|l| l.is_available()).map(|l| dispatch(l, Mixed { table, bindings, uvs }));
    let first = all.next().unwrap();
    for other in all {
        for (a, b) in first.as_flattened().iter().zip(other.as_flattened()) {
            assert!((a - b).abs() < 1e-6, "levels differ: {a} {b}");
        }
    }
    first
}

const NEAREST_TEXEL: Texture =
    Texture { image: ImageId(0), wrap_u: Wrap::Repeat, wrap_v: Wrap::Repeat, filter: Filter::Nearest };

#[test]
fn images_of_every_width_are_read_side_by_side() {
    // 5 x 1 texels, so that narrow images end inside a word.
    let bytes: Vec<[u8; 4]> = (0..5).map(|i| [10 + i, 20 + i, 30 + i, 40 + i]).collect();
    let words: Vec<[u16; 4]> = (0..5).map(|i| [1001 + i, 20_001 + i, 30_001 + i, 65_531 + i]).collect();
    let sets =
        [Channels::RGB | Channels::A, Channels::G | Channels::B, Channels::R | Channels::A, Channels::A, Channels::G];
    let whole = [Texels::Rgba8(bytes), Texels::Rgba16(words)];
    let (mut images, mut expected, mut used) = (Vec::new(), Vec::new(), Vec::new());
    for texels in &whole {
        for set in sets {
            let narrow = texels.clone().narrowed(set);
            images.push(Image { width: 5, height: 1, texels: narrow, name: String::new() });
            expected.push(texels.clone());
            used.push(set);
        }
    }
    let textures: Vec<Texture> =
        (0..images.len()).map(|i| Texture { image: ImageId(i as u32), ..NEAREST_TEXEL }).collect();
    let mut table = TextureTable::new(&textures, &images).unwrap();
    for i in 0..textures.len() {
        assert_eq!(table.bind(Some(TextureRef::plain(TextureId(i as u32))), Average::Never), i as u32);
    }
    for x in 0..5 {
        let uv = [(x as f32 + 0.5) / 5.0, 0.5];
        for (i, got) in read_mixed(&table, textures.len() as u32, [uv; 2]).iter().enumerate() {
            let wanted = expected[i].get(x);
            for k in (0..4).filter(|&k| used[i].has(k)) {
                assert!((got[k] - wanted[k]).abs() < 1e-7, "image {i} texel {x} channel {k}: {got:?} for {wanted:?}");
            }
        }
    }
}

#[test]
fn sixteen_bits_are_finer_than_a_byte() {
    let texels = Texels::Rgba16(vec![[0, 1, 32_768, 65_535], [65_535, 3, 32_769, 65_534]]);
    let image = Image { width: 2, height: 1, texels, name: String::new() };
    let sampler = Texture { filter: Filter::Bilinear, ..NEAREST_TEXEL };
    let table = bound(TextureTable::new(&[sampler], &[image]).unwrap());
    // Half way between the two.
    let got = read(&table, 0.5, 0.5).map(|v| v / 255.0 * 65535.0);
    for (g, e) in got.iter().zip([32_767.5, 2.0, 32_768.5, 65_534.5]) {
        assert!((g - e).abs() < 0.02, "{got:?}");
    }
}

#[test]
fn each_binding_has_its_own_set_of_coordinates_and_transform() {
    // 4 x 4 texels: red counts across, green counts down.
    let texels = (0..16u8).map(|i| [i % 4 * 10, i / 4 * 10, 0, 255]).collect();
    let image = Image { width: 4, height: 4, texels: Texels::Rgba8(texels), name: String::new() };
    let mut table = TextureTable::new(&[NEAREST_TEXEL], &[image]).unwrap();
    let plain = TextureRef::plain(TextureId(0));
    let second = TextureRef { uv_set: 1, ..plain };
    let moved = UvTransform { m: [[1.0, 0.0, 0.25], [0.0, 2.0, 0.0]] };
    let swapped = UvTransform { m: [[0.0, 1.0, 0.0], [1.0, 0.0, 0.5]] };
    let wanted = [
        plain,
        second,
        TextureRef { transform: Some(moved), ..plain },
        TextureRef { transform: Some(swapped), ..second },
    ];
    for (i, w) in wanted.iter().enumerate() {
        assert_eq!(table.bind(Some(*w), Average::Never), i as u32);
    }
    assert_eq!(table.bind(Some(second), Average::Never), 1, "bound once");
    // Set 0 falls into texel (0, 1), set 1 into texel (3, 0).
    let got = read_mixed(&table, 4, [[0.1, 0.4], [0.9, 0.2]]);
    let texel = |g: [f32; 4]| [g[0], g[1]].map(|v| (v * 25.5).round());
    let got: Vec<[f32; 2]> = got.into_iter().map(texel).collect();
    // moved: (0.35, 0.8); swapped: (0.2, 1.4), which wraps to (0.2, 0.4).
    assert_eq!(got, [[0.0, 1.0], [3.0, 0.0], [1.0, 3.0], [0.0, 1.0]]);
}

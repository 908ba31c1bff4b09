//! What of OBJ and MTL is refused or doubted, and that the message names file, place, value and remedy; damaged files.

mod obj_support;

use obj_support::{Files, load_obj, png, with_mtl};
use prt::load::LoadOptions;
use std::time::Instant;

const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";

#[track_caller]
fn refused(obj: &str, place: &str, says: &[&str]) {
    let error = load_obj(obj).expect_err("refused");
    assert_eq!(error.at.place, place, "{error}");
    for part in says {
        assert!(error.to_string().contains(part), "{error}: lacks {part:?}");
    }
    assert!(error.at.file.ends_with("m.obj") && !error.fix.is_empty(), "{error}");
}

#[test]
fn geometry_that_leads_nowhere_is_refused_with_line_and_column() {
    refused(&format!("{TRIANGLE}f 1 2 0\n"), "4:7", &["vertex index is 0", "count from 1"]);
    refused(&format!("{TRIANGLE}f 1 2 4\n"), "4:7", &["index is 4", "there are 3"]);
    refused(&format!("{TRIANGLE}f -1 -2 -4\n"), "4:9", &["index is -4", "up to this line"]);
    refused(&format!("{TRIANGLE}vt 0 0\nf 1/2 2/1 3/1\n"), "5:3", &["texture coordinate index is 2", "there are 1"]);
    refused(&format!("{TRIANGLE}vn 0 0 1\nf 1//9 2//1 3//1\n"), "5:3", &["normal index is 9"]);
    refused(&format!("{TRIANGLE}f 1///1 2 3\n"), "4:3", &["two slashes"]);
    refused(&format!("{TRIANGLE}f one 2 3\n"), "4:3", &["\"one\" is not an index"]);
    refused(&format!("{TRIANGLE}f 99999999999999999999999 2 3\n"), "4:3", &["99999999999999999999999"]);
    refused("v 0 0\n", "1:1", &["v has 2 numbers", "Three"]);
    refused("v 0 zero 0\n", "1:5", &["\"zero\" is not a number"]);
    refused("<html>\n<body>\n", "1:1", &["not a Wavefront OBJ file", "<html>"]);
}

#[test]
fn vertices_that_are_not_finite_cost_their_triangles() {
    for bad in ["v nan 0 0", "v 1e999 0 0", "v inf 0 0", "v 1 1 1 0"] {
        let scene = load_obj(format!("{TRIANGLE}{bad}\nf 1 2 3\nf 1 2 4\n")).unwrap();
        assert_eq!(scene.triangle_count(), 1, "{bad}");
        assert!(scene.warnings[0].starts_with("1 triangles dropped: a vertex"), "{:?}", scene.warnings);
    }
}

#[test]
fn what_is_not_drawn_is_counted() {
    let scene =
        load_obj(format!("{TRIANGLE}p 1\nl 1 2 3\nf 1 2\nvp 0\ncurv 0 1 1 2\nf 1 2 3\nnonsense\ns soft\n")).unwrap();
    assert_eq!(scene.triangle_count(), 1);
    let says = |place: &str, part: &str| {
        let found = scene.warnings.iter().any(|w| w.contains(&format!("m.obj: {place}: ")) && w.contains(part));
        assert!(found, "{place} {part}: {:?}", scene.warnings);
    };
    says("4:1", "2 statements with points or lines");
    says("6:1", "1 faces with fewer than three corners");
    says("7:1", "2 statements of free-form");
    says("10:1", "1 lines that are no statements");
    says("11:1", "1 smoothing groups");
    let scene = load_obj(format!("{TRIANGLE}f 1/1/1 2/2/2 3/3/3\n")).unwrap();
    assert!(scene.meshes[0].normals.is_none() && scene.warnings[0].contains("4:3: 6 indices"), "{:?}", scene.warnings);
    assert!(load_obj("# nothing\n").unwrap().triangle_count() == 0);
}

#[test]
fn bad_lines_of_an_mtl_keep_its_other_materials() {
    let files = with_mtl("Kd 0.5\nKd spectral f.rfl\nillum x\nmap_Kd\nnewmtl b\nKd 0 1 0\n", &[]);
    files.write("m.obj", format!("mtllib m.mtl\n{TRIANGLE}usemtl a\nf 1 2 3\nusemtl b\nf 1 2 3\n").as_bytes());
    let scene = files.load().unwrap();
    assert_eq!(scene.materials[1].base_color.factor, [0.0, 1.0, 0.0]);
    for place in ["2:1", "3:1", "4:1", "5:1"] {
        let named = scene.warnings.iter().filter(|w| w.contains(&format!("m.mtl: {place}: "))).count();
        assert_eq!(named, 1, "{place}: {:?}", scene.warnings);
    }
}

#[test]
fn missing_files_are_warnings_and_never_lead_outside() {
    let scene = load_obj(format!("mtllib none.mtl\n{TRIANGLE}usemtl a\nf 1 2 3\n")).unwrap();
    assert!(scene.warnings[0].contains("m.obj: 1:1: mtllib \"none.mtl\""), "{:?}", scene.warnings);

    let scene = with_mtl("Kd 0.1 0.2 0.3\nmap_Kd none.png\n", &[]).load().unwrap();
    let m = &scene.materials[0];
    assert!(m.base_color.texture.is_none() && m.base_color.factor == [0.1, 0.2, 0.3]);
    assert!(scene.warnings[0].contains("m.mtl: 3:1: texture \"none.png\""), "{:?}", scene.warnings);

    let scene = with_mtl("map_Kd t.png\n", &[("t.png", b"no picture")]).load().unwrap();
    assert!(scene.images.is_empty() && scene.warnings[0].contains("t.png"), "{:?}", scene.warnings);

    // A file that exists outside is not opened; one of the same name beside the input is, with a warning.
    let texture = png(&[[1, 2, 3, 255]], 1);
    let outer = tempfile::tempdir().unwrap();
    std::fs::write(outer.path().join("t.png"), &texture).unwrap();
    let name = outer.path().file_name().unwrap().to_str().unwrap();
    for (written, beside) in [
        (format!("../{name}/t.png"), false),
        (outer.path().join("t.png").display().to_string(), false),
        (r"C:\maps\t.png".to_owned(), true),
        ("../maps/t.png".to_owned(), true),
    ] {
        let files = with_mtl(format!("map_Kd {written}\n"), &[]);
        if beside {
            files.write("t.png", &texture);
        }
        let scene = files.load().unwrap();
        assert_eq!(scene.images.len(), usize::from(beside), "{written}");
        assert_eq!(scene.warnings.len(), 1, "{written}: {:?}", scene.warnings);
        if !beside {
            let options = LoadOptions { asset_root: outer.path().parent().map(Into::into), ..LoadOptions::default() };
            let allowed = files.load_with(&options).unwrap().images.len();
            assert_eq!(allowed, usize::from(written.starts_with("..")), "{written}");
        }
    }
}

#[test]
fn an_obj_has_one_scene() {
    let files = Files::new(format!("{TRIANGLE}f 1 2 3\n"), &[]);
    let with = |scene: &str| files.load_with(&LoadOptions { scene: Some(scene.into()), ..LoadOptions::default() });
    assert!(with("0").is_ok());
    assert!(with("Main").unwrap_err().problem.contains("\"Main\""));
}

/// Numerical Recipes' LCG with a fixed seed: the same damage in every run.
struct Lcg(u64);

impl Lcg {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % n.max(1)
    }

    fn damage(&mut self, bytes: &[u8]) -> Vec<u8> {
        const PIECES: [&[u8]; 14] = [
            b"\n",
            b" ",
            b"\\\n",
            b"-",
            b"/",
            b"0",
            b"1e39",
            b"nan",
            b"99999999999",
            b"\0",
            b"\xFF",
            b"-s ",
            b"usemtl a\n",
            b"s 1\n",
        ];
        let mut out = bytes.to_vec();
        for _ in 0..=self.below(5) {
            let at = self.below(out.len());
            match self.below(5) {
                0 if !out.is_empty() => out[at] ^= 1 << self.below(8),
                1 => out.truncate(at),
                2 => drop(out.drain(at..(at + 1 + self.below(8)).min(out.len()))),
                3 => drop(out.splice(at..at, PIECES[self.below(PIECES.len())].iter().copied())),
                _ => {
                    let piece = out[at..(at + self.below(40)).min(out.len())].to_vec();
                    drop(out.splice(at..at, piece));
                }
            }
        }
        out
    }
}

const RICH: &str = "mtllib m.mtl\no a\nv 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 1 1 0 0 0 1\nv 0 1 0.5 1 1 1\nv 0.5 0.2 0 1 1 1\n\
    vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1 0\nvn 0 0 1\ng b\nusemtl a\ns 1\nf 1/1/1 2/2/1 3/3/1 4/4/1\nf -5 -4 \\\n -3\ns off\n\
    usemtl b\nf 1/1 2/2 5/3 3/3 4/4\nl 1 2\np 1\ns 2\nf 1//1 2//1 3//1\nf 4 3 2 1\n";

const RICH_MTL: &str = "newmtl a\nKa 0 0 0\nKd 0.5 0.5 0.5\nKs 0.1 0.1 0.1\nNs 20\nillum 2\nd 0.5\nmap_Kd -s 2 2 1 -o 0.5 0 0 t.png\n\
    map_d -imfchan r t.png\nmap_Ks -mm 0.1 0.8 t.png\nmap_Ns t.png\nbump -bm 0.2 t.png\n\
    newmtl b\nKe 1 2 3\nmap_Ke t.png\nPr 0.5\nPm 0.5\nmap_Pr t.png\nmap_Pm -clamp on t.png\nnorm t.png\nTr 0.2\n";

/// 1500 rounds each, seeds 1 to 3: nothing panics or takes long, and every refusal has a place.
#[test]
fn damaged_files_never_panic() {
    let texture = png(&[[10, 20, 30, 40], [50, 60, 70, 80]], 2);
    let originals: [(&str, &[u8]); 3] =
        [("m.obj", RICH.as_bytes()), ("m.mtl", RICH_MTL.as_bytes()), ("t.png", &texture)];
    for (seed, (damaged, original)) in originals.iter().enumerate() {
        let files = Files::new(RICH, &[("m.mtl", RICH_MTL.as_bytes()), ("t.png", &texture)]);
        let clean = files.load().unwrap();
        assert!(
            clean.triangle_count() == 9 && clean.images.len() > 3,
            "{} {:?}",
            clean.triangle_count(),
            clean.warnings
        );
        let mut random = Lcg(seed as u64 + 1);
        let (mut loaded, mut slowest) = (0, 0.0_f64);
        for round in 0..1500 {
            files.write(damaged, &random.damage(original));
            let options = LoadOptions { smooth_angle: (round % 3 == 0).then_some(60.0), ..LoadOptions::default() };
            let start = Instant::now();
            match files.load_with(&options) {
                Ok(_) => loaded += 1,
                Err(error) => assert!(error.at.place.contains(':'), "round {round}: {error}"),
            }
            slowest = slowest.max(start.elapsed().as_secs_f64());
        }
        println!("{damaged}: {loaded} of 1500 still load, slowest {slowest:.3} s");
        assert!(slowest < 2.0, "{slowest} s");
        assert!(*damaged == "m.obj" || loaded == 1500, "{damaged}: what is wrong in a material is a warning");
    }
}

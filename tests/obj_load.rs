//! What of OBJ and MTL is read, and how.

mod obj_support;
mod support;

use obj_support::{Files, load_obj, obj_files, png, with_mtl};
use prt::load::obj::ObjUp;
use prt::load::{LoadOptions, load};
use prt::material::{AlphaMode, Material};
use prt::scene::Scene;
use prt::texture::{TextureRef, Wrap};
use std::path::Path;
use support::pictures::{reference_stats, settings, shoot_seeds};
use support::reference::mean_verdicts;
use support::verdict::MAX_BIAS;
use support::{planted, scenes};

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

/// Corners of all triangles.
fn triangles(scene: &Scene) -> Vec<[[f32; 3]; 3]> {
    let of = |m: &prt::shape::Mesh| m.indices.iter().map(|t| t.map(|i| m.positions[i as usize])).collect::<Vec<_>>();
    scene.meshes.iter().flat_map(|mesh| of(mesh)).collect()
}

fn material(mtl: &str) -> Material {
    with_mtl(mtl, &[]).load().unwrap().materials[0].clone()
}

#[test]
fn all_ways_to_name_a_corner_give_the_same_triangle() {
    let expected = triangles(&load_obj(format!("{SQUARE}f 1 2 3\n")).unwrap());
    for face in [
        "f -4 -3 -2",
        "f 1/ 2/ 3/",
        "f 1// 2// 3//",
        "f 1 2/ 3//",
        "f +1 2 3 # a comment",
        "f 1 \\\n 2 \\\r\n 3",
        "\tf\t1  2\t3  ",
        "fo 1 2 3",
    ] {
        assert_eq!(triangles(&load_obj(format!("{SQUARE}{face}\n")).unwrap()), expected, "{face:?}");
    }
    let negative = "v 9 9 9\nv 0 0 0\nv 1 0 0\nv 1 1 0\nf -3 -2 -1\nv 7 7 7\n";
    assert_eq!(triangles(&load_obj(negative).unwrap()), expected);
    let weighted = "v 0 0 0 2\nv 2 0 0 2\nv 2 2 0 2\nf 1 2 3\n";
    assert_eq!(triangles(&load_obj(weighted).unwrap()), expected);
}

#[test]
fn mixed_faces_keep_each_its_own_normals_and_coordinates() {
    let files = with_mtl("map_Kd t.png\n", &[("t.png", &png(&[[255; 4]], 1))]);
    files.write(
        "m.obj",
        format!(
            "mtllib m.mtl\n{SQUARE}vt 0.25 0.25\nvn 0 0 1\nusemtl a\nf 1/1/1 2/1/1 3/1/1\nf 1 3 4\nf 1//1 2//1 4//1\n"
        )
        .as_bytes(),
    );
    let scene = files.load().unwrap();
    let mesh = &scene.meshes[0];
    assert_eq!(mesh.indices.len(), 3);
    let at = |triangle: usize, k: usize| mesh.indices[triangle][k] as usize;
    let (normals, uvs) = (mesh.normals.as_ref().unwrap(), &mesh.uv_sets[0]);
    assert_eq!((0..3).map(|k| uvs[at(0, k)]).collect::<Vec<_>>(), [[0.25, 0.75]; 3]);
    assert_eq!((0..3).map(|k| uvs[at(1, k)]).collect::<Vec<_>>(), [[0.0; 2]; 3]);
    assert!(normals.iter().all(|n| *n == [0.0, 0.0, 1.0]));
    assert!(scene.warnings.iter().any(|w| w.contains("have no texture coordinates")), "{:?}", scene.warnings);
}

#[test]
fn parts_are_named_by_object_and_group_and_split_by_material() {
    let scene = load_obj(format!(
        "{SQUARE}f 1 2 3\no box\nusemtl x\nf 1 2 3\ng top\nf 1 2 4\nusemtl y\nf 1 3 4\ng default\nf 2 3 4\no bé\nf 1 2 3\n"
    ))
    .unwrap();
    let names: Vec<&str> = scene.instances.iter().map(|i| i.name.as_str()).collect();
    assert_eq!(names, ["m", "box", "box/top", "box/top", "box", "bé"]);
    assert_eq!(scene.triangle_count(), 6);
    assert_eq!(scene.materials.len(), 1, "unknown materials share the default");
    assert!(scene.warnings[0].contains("has the material \"x\", \"y\""), "{:?}", scene.warnings);
}

#[test]
fn names_that_are_not_utf8_are_latin1() {
    let files = Files::new(
        b"mtllib caf\xE9.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\ng \xE9t\xE9\nusemtl bl\xE5\nf 1 2 3\n",
        &[("caf\u{e9}.mtl", b"newmtl bl\xE5\nKd 0 0 1\n")],
    );
    let scene = files.load().unwrap();
    assert_eq!(scene.instances[0].name, "été");
    assert_eq!((scene.materials[0].name.as_str(), scene.materials[0].base_color.factor), ("blå", [0.0, 0.0, 1.0]));
}

#[test]
fn smoothing_groups_average_and_off_is_flat() {
    // A roof of two squares at a right angle along the edge 1-2.
    let roof = "v 0 0 0\nv 1 0 0\nv 1 0 -1\nv 0 0 -1\nv 1 -1 0\nv 0 -1 0\n";
    let load = |faces: &str| (*load_obj(format!("{roof}{faces}")).unwrap().meshes[0]).clone();
    let smooth = load("s 1\nf 1 2 3 4\nf 6 5 2 1\n");
    assert_eq!(smooth.positions.len(), 6, "vertices on the edge are shared");
    let h = 0.5_f32.sqrt();
    let normals = smooth.normals.as_ref().unwrap();
    for (p, n) in smooth.positions.iter().zip(normals) {
        let expected = match (p[1], p[2]) {
            (0.0, 0.0) => [0.0, h, h],
            (0.0, _) => [0.0, 1.0, 0.0],
            _ => [0.0, 0.0, 1.0],
        };
        assert!(n.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6), "{p:?}: {n:?}");
    }
    assert!(load("f 1 2 3 4\nf 6 5 2 1\n").normals.is_none());
    assert!(load("s off\nf 1 2 3 4\ns 0\nf 6 5 2 1\n").normals.is_none());
    for sharp in ["s 1\nf 1 2 3 4\ns 2\nf 6 5 2 1\n", "s 1\nf 1 2 3 4\ns off\nf 6 5 2 1\n"] {
        let mesh = load(sharp);
        assert_eq!(mesh.positions.len(), 8, "{sharp}");
        assert!(mesh.normals.unwrap().iter().all(|n| *n == [0.0, 1.0, 0.0] || *n == [0.0, 0.0, 1.0]), "{sharp}");
    }
    let given = load("vn 1 0 0\ns 1\nf 1//1 2//1 3//1\nf 6 5 2 1\n");
    assert_eq!(given.normals.unwrap().iter().filter(|n| **n == [1.0, 0.0, 0.0]).count(), 3, "normals of the file stay");
}

#[test]
fn smooth_angle_joins_faces_across_blunt_edges_only() {
    let roof = "v 0 0 0\nv 1 0 0\nv 1 0 -1\nv 0 0 -1\nv 1 -1 0\nv 0 -1 0\nf 1 2 3 4\nf 6 5 2 1\n";
    let vertices = |angle: f32| {
        let options = LoadOptions { smooth_angle: Some(angle), ..LoadOptions::default() };
        Files::new(roof, &[]).load_with(&options).unwrap().meshes[0].positions.len()
    };
    assert_eq!((vertices(89.0), vertices(91.0)), (8, 6));
}

#[test]
fn concave_polygons_are_cut_inside_and_crossed_ones_are_counted() {
    let l = "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\n";
    let scene = load_obj(format!("{l}f 1 2 3 4 5 6\n")).unwrap();
    let area = |t: &[[f32; 3]; 3]| {
        let [a, b, c] = t;
        0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
    };
    let areas: Vec<f32> = triangles(&scene).iter().map(area).collect();
    assert!(areas.len() == 4 && areas.iter().all(|a| *a > 0.0) && areas.iter().sum::<f32>() == 3.0, "{areas:?}");
    let crossed = load_obj(format!("{SQUARE}f 1 3 2 4\n")).unwrap();
    assert!(crossed.warnings.iter().any(|w| w.starts_with("1 polygons that cross")), "{:?}", crossed.warnings);
}

#[test]
fn vertex_colours_are_srgb_and_all_or_none() {
    let scene = load_obj("v 0 0 0 1 0.5 0\nv 1 0 0 1 0.5 0\nv 0 1 0 1 0.5 0\nf 1 2 3\n").unwrap();
    let colors = scene.meshes[0].colors.as_ref().unwrap();
    assert!((colors[0][1] - 0.214).abs() < 1e-3 && colors[0][0] == 1.0 && colors[0][3] == 1.0, "{colors:?}");
    assert_eq!(scene.materials[0].base_color.factor, [1.0; 3], "nothing darkens them");
    let half = load_obj("v 0 0 0 1 0.5 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    assert!(half.meshes[0].colors.is_none() && half.warnings.len() == 1, "{:?}", half.warnings);
}

#[test]
fn up_axis_and_scale_place_the_model() {
    let options = LoadOptions { obj_up: ObjUp::Z, obj_scale: Some(0.5), ..LoadOptions::default() };
    let scene = Files::new(format!("{SQUARE}f 1 2 3\n"), &[]).load_with(&options).unwrap();
    let place = |p: [f64; 3]| scene.instances[0].world_from_object.transform_point3(p.into()).to_array();
    assert_eq!(place([2.0, 4.0, 6.0]), [1.0, 3.0, -2.0]);
}

#[test]
fn lambertian_where_there_is_no_gloss() {
    for mtl in ["Kd 0.5 0.4 0.3\n", "Kd 0.5 0.4 0.3\nKs 0 0 0\nNs 10\nillum 2\n", "Kd 0.5 0.4 0.3\nKs 1 1 1\nillum 1\n"]
    {
        let m = material(mtl);
        assert_eq!((m.specular.factor, m.metallic.factor, m.double_sided), (0.0, 0.0, true), "{mtl}");
        assert_eq!(m.base_color.factor, [0.5, 0.4, 0.3]);
        assert!(m.alpha_mode == AlphaMode::Opaque);
    }
}

#[test]
fn ks_is_the_reflectance_at_normal_incidence_and_ns_the_roughness() {
    let m = material("Kd 0.1 0.1 0.1\nKs 0.2 0.3 0.9\nNs 30\nNi 2.5\nillum 2\n");
    let reflectance = ((m.ior - 1.0) / (m.ior + 1.0)).powi(2);
    let f0 = m.specular_color.factor.map(|c| c * reflectance);
    assert!(f0.iter().zip([0.2, 0.3, 0.9]).all(|(a, b)| (a - b).abs() < 1e-6), "{f0:?}");
    assert!((m.roughness.factor - 0.5).abs() < 1e-6, "(2 / 32)^(1/4)");
    let pbr = material("Ks 0.2 0.3 0.9\nNs 30\nPr 0.3\nPm 0.7\nillum 1\n");
    assert_eq!((pbr.roughness.factor, pbr.metallic.factor), (0.3, 0.7));
    assert_eq!((pbr.specular.factor, pbr.specular_color.factor), (1.0, [1.0; 3]));
}

#[test]
fn d_wins_over_tr_and_emission_is_as_written() {
    let m = material("d 0.25\nTr 0.1\nKe 17 14.45 10.2\n");
    assert_eq!((m.opacity.factor, m.alpha_mode), (0.25, AlphaMode::Blend));
    assert_eq!(m.emission.factor, [17.0, 14.45, 10.2]);
    assert_eq!(material("Tr 0.25\n").opacity.factor, 0.75);
    assert_eq!(material("Ke 1 1 1\nd 1\n").alpha_mode, AlphaMode::Opaque);
}

#[test]
fn maps_are_read_with_their_options() {
    let gray = png(&[[51, 51, 51, 255]], 1);
    let mtl =
        "map_Kd -s 2 2 1 -clamp on sub\\t.png\nKs 1 1 1\nillum 2\nmap_Ks g.png\nmap_d g.png\nbump -bm 0.2 g.png\n";
    let scene = with_mtl(mtl, &[("sub/t.png", &png(&[[9, 8, 7, 6]], 1)), ("g.png", &gray)]).load().unwrap();
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    let m = &scene.materials[0];
    let texel = |t: Option<TextureRef>| {
        let texture = &scene.textures[t.unwrap().texture.index()];
        scene.images[texture.image.index()].texels.get(0)
    };
    assert_eq!(texel(m.base_color.texture), [9, 8, 7, 6].map(|c: u8| f32::from(c) / 255.0));
    let base = m.base_color.texture.unwrap();
    assert_eq!(base.transform.unwrap().m, [[2.0, 0.0, 0.0], [0.0, 2.0, -1.0]]);
    assert_eq!(scene.textures[base.texture.index()].wrap_u, Wrap::ClampToEdge);
    // 0.2 linear is 0.4845 in sRGB, which is how that slot is read.
    assert!((texel(m.specular_color.texture)[0] - 0.4845).abs() < 1e-3);
    assert!((texel(m.opacity.texture)[3] - 0.2).abs() < 1e-4);
    assert_eq!((texel(m.bump.texture)[0], m.bump.factor), (0.2, 0.2));
    assert_eq!(scene.meshes[0].uv_sets[0], [[0.0, 1.0], [1.0, 1.0], [0.0, 0.0]]);
}

#[test]
fn tga_and_bmp_textures_are_read() {
    use image::{ExtendedColorType, ImageEncoder};
    let (mut tga, mut bmp) = (Vec::new(), Vec::new());
    let color = ExtendedColorType::Rgb8;
    image::codecs::tga::TgaEncoder::new(&mut tga).write_image(&[255, 0, 0], 1, 1, color).unwrap();
    image::codecs::bmp::BmpEncoder::new(&mut bmp).write_image(&[0, 255, 0], 1, 1, color).unwrap();
    let scene = with_mtl("map_Kd t.TGA\nmap_Ke t.bmp\n", &[("t.TGA", &tga), ("t.bmp", &bmp)]).load().unwrap();
    // Opacity is read of neither, so it is not kept.
    let texels: Vec<_> = scene.images.iter().map(|i| i.texels.get(0)[..3].to_vec()).collect();
    assert_eq!(texels, [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], "{:?}", scene.warnings);
}

#[test]
fn several_mtl_files_and_names_with_blanks_are_found() {
    let square = format!("{SQUARE}usemtl b c\nf 1 2 3\n");
    for (lib, name) in
        [("m n.mtl", "m n.mtl"), ("none.mtl m.mtl", "m.mtl"), ("\"m.mtl\"", "m.mtl"), ("x\\m.mtl", "x/m.mtl")]
    {
        let files = Files::new(format!("mtllib {lib}\n{square}"), &[(name, b"newmtl b c\nKd 1 0 0\n")]);
        assert_eq!(files.load().unwrap().materials[0].base_color.factor, [1.0, 0.0, 0.0], "{lib}");
    }
}

/// The references' OBJ versions, seen by the glTF's camera, have the reference's mean: seeds 0..8 at 64 x 64, judged as in
/// `tests/render_reference.rs` (within 0.15 %, p >= 1e-4; false alarms at most 1.6e-4 a channel). Half a per cent more
/// light must fail. (Cornell's pixels are not the glTF's
/// to the bit, so pictures are judged by their means.)
#[test]
fn references_as_obj_give_the_picture_of_the_gltf() {
    for (name, spp) in [("cornell", 256), ("furnace_closed", 64)] {
        let path = scenes::reference_folder(name).join(format!("{name}.obj"));
        let mut obj = load(&path, &LoadOptions::default()).unwrap().0;
        assert!(obj.warnings.is_empty(), "{:?}", obj.warnings);
        obj.cameras = scenes::reference(name).cameras;
        let mut runs = shoot_seeds(&obj, &settings(64, spp, 0), 8);
        let stats = reference_stats(&scenes::reference_folder(name), "ref_mitsuba");
        for (channel, verdict) in mean_verdicts(name, &runs, &stats).iter().enumerate() {
            println!("{name}[{channel}]: bias {:+.5} %", 100.0 * verdict.bias);
            verdict.within(MAX_BIAS).unwrap_or_else(|e| panic!("{name}, channel {channel}: {e}"));
        }
        runs.iter_mut().for_each(|run| planted::scale(run, 1.005));
        assert!(mean_verdicts(name, &runs, &stats).iter().all(|v| v.within(MAX_BIAS).is_err()), "{name}");
    }
}

/// Prints what becomes of every OBJ among the assets; none may panic, and a refusal names its line.
#[test]
fn all_obj_assets_load_or_say_why_not() {
    let assets = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/assets");
    if !assets.is_dir() {
        println!("skipped: no {}", assets.display());
        return;
    }
    let files = obj_files(&assets);
    let mut refused = Vec::new();
    for path in &files {
        let name = path.strip_prefix(&assets).unwrap().display().to_string();
        match load(path, &LoadOptions::default()) {
            Ok((scene, _)) => println!(
                "{name:60} {:6} triangles {:3} parts {:3} materials {:2} images {:2} warnings",
                scene.triangle_count(),
                scene.instances.len(),
                scene.materials.len(),
                scene.images.len(),
                scene.warnings.len()
            ),
            Err(error) => {
                println!("{name:60} refused: {error}");
                assert!(error.at.place.contains(':'), "{error}");
                refused.push(name);
            }
        }
    }
    // They name vertices, coordinates or normals that are not there.
    let expected = [
        "Obj2GltfBoxes/box-incomplete-attributes/box-incomplete-normals.obj",
        "Obj2GltfBoxes/box-incomplete-attributes/box-incomplete-positions.obj",
        "Obj2GltfBoxes/box-incomplete-attributes/box-incomplete-uvs.obj",
        "TinyObjModels/invalid-relative-texture-index.obj",
        "TobjModels/invalid_index.obj",
    ];
    assert_eq!(refused, expected, "of {} files", files.len());
}

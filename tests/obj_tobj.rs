//! A second opinion: `tobj` sees the same geometry in the files that both read alike.

mod obj_support;

use obj_support::obj_files;
use prt::load::{LoadOptions, load};
use std::path::Path;

/// Triangles' corners in the order of the file, as tobj sees them.
fn by_tobj(path: &Path) -> Option<Vec<[[f32; 3]; 3]>> {
    let options = tobj::LoadOptions { single_index: true, ..tobj::LoadOptions::default() };
    let (models, _) = tobj::load_obj(path, &options).ok()?;
    // Polygons are cut in different ways, points and lines are skipped: not in files of triangles only.
    let at = |m: &tobj::Mesh, i: u32| [0, 1, 2].map(|k| m.positions[3 * i as usize + k]);
    let of = |m: &tobj::Model| {
        m.mesh.indices.as_chunks::<3>().0.iter().map(|t| t.map(|i| at(&m.mesh, i))).collect::<Vec<_>>()
    };
    Some(models.iter().flat_map(of).collect())
}

fn by_us(path: &Path) -> Option<Vec<[[f32; 3]; 3]>> {
    let scene = load(path, &LoadOptions::default()).ok()?.0;
    let of = |m: &prt::shape::Mesh| m.indices.iter().map(|t| t.map(|i| m.positions[i as usize])).collect::<Vec<_>>();
    Some(scene.meshes.iter().flat_map(|mesh| of(mesh)).collect())
}

/// Only triangles, none twice in different places.
fn only_triangles(path: &Path) -> bool {
    let text = String::from_utf8_lossy(&std::fs::read(path).unwrap()).into_owned();
    let mut faces = text.lines().filter(|l| l.trim_start().starts_with("f ")).peekable();
    faces.peek().is_some()
        && faces.all(|l| l.split_whitespace().count() == 4)
        && !text.lines().any(|l| l.starts_with("l ") || l.starts_with("p "))
}

fn sorted(mut triangles: Vec<[[f32; 3]; 3]>) -> Vec<[[f32; 3]; 3]> {
    // Parts come in a different order where a group or material is taken up again.
    triangles.sort_by(|a, b| a.as_flattened().partial_cmp(b.as_flattened()).expect("finite"));
    triangles
}

#[test]
fn tobj_sees_the_same_triangles() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut files = obj_files(&root.join("tests/data/reference"));
    let assets = root.join("../shared/assets");
    match assets.is_dir() {
        true => files.extend(obj_files(&assets)),
        false => println!("skipped in part: no {}", assets.display()),
    }
    let mut compared = 0;
    for path in files.iter().filter(|p| only_triangles(p)) {
        let (Some(theirs), Some(ours)) = (by_tobj(path), by_us(path)) else { continue };
        // We drop triangles without area.
        if theirs.len() == ours.len() {
            assert!(sorted(theirs) == sorted(ours), "{}", path.display());
            compared += 1;
        }
    }
    println!("{compared} files compared");
    assert!(compared >= 2);
}

//! What the tests share: the device, or the line that says that there is none.
#![allow(dead_code, reason = "not every test file uses everything")]

use std::path::Path;
use std::sync::Arc;

use embree4_rs::{BuildQuality, CommittedScene, Device, Library, Scene, SceneFlags, TriangleGeometry};

/// The library that the project would use; prints a line where there is none.
pub fn library() -> Option<Arc<Library>> {
    let project = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../.embree");
    match Library::find(&[project]) {
        Ok(library) => Some(library),
        Err(error) => {
            println!("skipped: no Embree library\n{error}");
            None
        }
    }
}

/// A device of that library; `None` where there is no library.
pub fn device(config: &str) -> Option<Arc<Device>> {
    Some(Device::new(&library()?, config).expect("the configuration is valid"))
}

/// Positions and triangles.
pub type Mesh = (Vec<[f32; 3]>, Vec<[u32; 3]>);

/// A robust scene of these meshes.
pub fn scene_of<const N: usize>(device: &Arc<Device>, meshes: [Mesh; N]) -> CommittedScene {
    let mut scene = Scene::new(device, SceneFlags::ROBUST, BuildQuality::Medium).unwrap();
    for (positions, indices) in meshes {
        scene.attach(TriangleGeometry::new(device, positions, indices).unwrap()).unwrap();
    }
    scene.commit().unwrap()
}

/// The unit square at height `z` as `2 * n * n` triangles.
pub fn square(z: f32, n: u32) -> Mesh {
    let at = |i: u32| i as f32 / n as f32;
    let positions = (0..=n).flat_map(|y| (0..=n).map(move |x| [at(x), at(y), z])).collect();
    let row = n + 1;
    let corner = |x: u32, y: u32| y * row + x;
    let indices = (0..n)
        .flat_map(|y| (0..n).map(move |x| (x, y)))
        .flat_map(|(x, y)| {
            let (a, b) = (corner(x, y), corner(x + 1, y));
            let (c, d) = (corner(x, y + 1), corner(x + 1, y + 1));
            [[a, b, d], [a, d, c]]
        })
        .collect();
    (positions, indices)
}

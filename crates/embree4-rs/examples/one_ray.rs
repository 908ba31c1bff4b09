//! Finds an Embree, builds one triangle and traces one ray at it.
//!
//! `cargo run -p embree4-rs --example one_ray [folder]`

use std::error::Error;

use embree4_rs::{BuildQuality, Device, Library, Ray, Scene, SceneFlags, TriangleGeometry};

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args().nth(1).unwrap_or_else(|| ".embree".into());
    let library = match Library::find(&[folder]) {
        Ok(library) => library,
        Err(error) => {
            println!("{error}");
            return Ok(());
        }
    };
    for refusal in library.refused() {
        println!("Embree not used: {refusal}");
    }
    let device = Device::new(&library, "threads=1")?;
    println!("Embree {} ({}), {}", device.version(), device.isa(), library.path().display());

    let mut scene = Scene::new(&device, SceneFlags::ROBUST, BuildQuality::Medium)?;
    let positions = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    scene.attach(TriangleGeometry::new(&device, positions, vec![[0, 1, 2]])?)?;
    let scene = scene.commit()?;

    let ray = Ray::new([0.25, 0.5, 1.0], [0.0, 0.0, -1.0]);
    match scene.intersect1(&ray) {
        Some(hit) => println!("triangle {} at t = {}, u = {}, v = {}", hit.primitive, hit.t, hit.u, hit.v),
        None => println!("nothing"),
    }
    Ok(())
}

//! Two instances of a leaf with holes, and a batch of rays: the example of the README.
//!
//! `cargo run -p embree4-rs --example leaves [folder with an Embree]`

use std::error::Error;
use std::sync::Arc;

use embree4_rs::{
    BuildQuality, Candidate, Device, Filter, HitsSoAMut, InstanceGeometry, Library, RaysSoA, Scene, SceneFlags,
    TriangleGeometry,
};

/// Lets rays through where u and v are both small.
struct Hole;

impl Filter for Hole {
    fn accept(&self, candidate: &Candidate) -> bool {
        candidate.u.max(candidate.v) > 0.1
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args().nth(1).unwrap_or_else(|| ".embree".into());
    match trace(&folder)? {
        Some(instances) => println!("instances that were hit: {instances:?}"),
        None => println!("This is where a program would use a ray kernel of its own."),
    }
    Ok(())
}

/// Which instance each of three rays hits; `None` where there is no Embree.
pub fn trace(folder: &str) -> Result<Option<[u32; 3]>, Box<dyn Error>> {
    let library = match Library::find(&[folder]) {
        Ok(library) => library,
        Err(why) => {
            println!("{why}");
            return Ok(None);
        }
    };
    let device = Device::new(&library, "threads=1")?;

    // One triangle with a filter, in a scene of its own.
    let positions = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let mut leaf = TriangleGeometry::new(&device, positions, vec![[0, 1, 2]])?;
    leaf.set_filter(Arc::new(Hole))?;
    let mut object = Scene::new(&device, SceneFlags::ROBUST, BuildQuality::Medium)?;
    object.attach(leaf)?;
    let object = Arc::new(object.commit()?);

    // Twice in another one: at z = 0, and from there to x = 1 during the shutter at z = -1.
    let at = |x: f32, z: f32| [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [x, 0.0, z]];
    let mut scene = Scene::new(&device, SceneFlags::ROBUST, BuildQuality::Medium)?;
    scene.attach(InstanceGeometry::new(&object, &[at(0.0, 0.0)])?)?;
    scene.attach(InstanceGeometry::new(&object, &[at(0.0, -1.0), at(1.0, -1.0)])?)?;
    let scene = scene.commit()?;

    // Three rays down: at the first leaf, through both holes, and at time 1 past the first at the second.
    let rays = RaysSoA {
        ox: &[0.2, 0.05, 1.05],
        oy: &[0.2, 0.05, 0.3],
        oz: &[1.0; 3],
        dx: &[0.0; 3],
        dy: &[0.0; 3],
        dz: &[-1.0; 3],
        t_max: &[f32::INFINITY; 3],
        time: Some(&[0.0, 0.0, 1.0]),
        id: None,
        mask: None,
        is_open: false,
    };
    let [mut t, mut u, mut v] = [[0.0; 3]; 3];
    let [mut primitive, mut geometry, mut instance] = [[0; 3]; 3];
    let hits = HitsSoAMut {
        t: &mut t,
        u: &mut u,
        v: &mut v,
        primitive: &mut primitive,
        geometry: &mut geometry,
        instance: Some(&mut instance),
        instance_primitive: None,
    };
    scene.intersect_batch(rays, false, hits);
    println!("t = {t:?}");
    Ok(Some(instance))
}

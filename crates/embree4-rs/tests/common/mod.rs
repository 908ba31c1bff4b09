//! What the tests share: the device, or the line that says that there is none.
#![allow(dead_code, reason = "not every test file uses everything")]

use std::path::Path;
use std::sync::Arc;

use embree4_rs::{
    BuildQuality, Coherence, CommittedScene, Device, Hit, HitsSoAMut, Library, Mask8, Mask16, Ray, RayHit8, RayHit16,
    RaysSoA, Scene, SceneFlags, TriangleGeometry,
};

/// What an id is for a miss.
pub const MISS: u32 = u32::MAX;

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

/// Deterministic numbers in [0, 1).
pub struct Numbers(pub u32);

impl Numbers {
    pub fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (self.0 >> 8) as f32 / 16_777_216.0
    }

    /// Three numbers in [-1, 1).
    pub fn point(&mut self) -> [f32; 3] {
        std::array::from_fn(|_| 2.0 * self.next() - 1.0)
    }

    /// `count` rays with times from 0 to 1 and ids by place, from outside of the ball of radius 4 through
    /// the box [-1, 1]^3, of random length.
    pub fn rays(&mut self, count: usize) -> Vec<Ray> {
        (0..count)
            .map(|id| {
                let (mut from, to) = (self.point(), self.point());
                let length = from.iter().map(|x| x * x).sum::<f32>().sqrt().max(0.01);
                from = from.map(|x| 4.0 * x / length);
                let direction = std::array::from_fn(|axis| to[axis] - from[axis]);
                let ray = Ray::new(from, direction);
                Ray { time: self.next(), t_max: 0.5 + 2.0 * self.next(), id: id as u32, ..ray }
            })
            .collect()
    }
}

/// Rays in the form that batches take.
pub struct Batch {
    columns: [Vec<f32>; 8],
    id: Vec<u32>,
    mask: Vec<u32>,
}

/// Hits in the form that batches give.
pub struct Hits {
    pub t: Vec<f32>,
    pub u: Vec<f32>,
    pub v: Vec<f32>,
    pub primitive: Vec<u32>,
    pub geometry: Vec<u32>,
    pub instance: Vec<u32>,
    pub instance_primitive: Vec<u32>,
}

impl Batch {
    pub fn new(rays: &[Ray]) -> Self {
        let column = |get: &dyn Fn(&Ray) -> f32| rays.iter().map(get).collect();
        Self {
            columns: [
                column(&|ray| ray.origin[0]),
                column(&|ray| ray.origin[1]),
                column(&|ray| ray.origin[2]),
                column(&|ray| ray.direction[0]),
                column(&|ray| ray.direction[1]),
                column(&|ray| ray.direction[2]),
                column(&|ray| ray.t_max),
                column(&|ray| ray.time),
            ],
            id: rays.iter().map(|ray| ray.id).collect(),
            mask: rays.iter().map(|ray| ray.mask).collect(),
        }
    }

    pub fn rays(&self) -> RaysSoA<'_> {
        let [ox, oy, oz, dx, dy, dz, t_max, time] = &self.columns;
        RaysSoA {
            ox,
            oy,
            oz,
            dx,
            dy,
            dz,
            t_max,
            time: Some(time),
            id: Some(&self.id),
            mask: Some(&self.mask),
            is_open: false,
        }
    }

    pub fn intersect(&self, scene: &CommittedScene, coherent: bool) -> Hits {
        let len = self.rays().len();
        let mut hits = Hits {
            t: vec![-7.0; len],
            u: vec![-7.0; len],
            v: vec![-7.0; len],
            primitive: vec![7; len],
            geometry: vec![7; len],
            instance: vec![7; len],
            instance_primitive: vec![7; len],
        };
        let out = HitsSoAMut {
            t: &mut hits.t,
            u: &mut hits.u,
            v: &mut hits.v,
            primitive: &mut hits.primitive,
            geometry: &mut hits.geometry,
            instance: Some(&mut hits.instance),
            instance_primitive: Some(&mut hits.instance_primitive),
        };
        scene.intersect_batch(self.rays(), coherent, out);
        hits
    }

    pub fn occluded(&self, scene: &CommittedScene) -> Vec<u8> {
        let mut out = vec![7; self.rays().len()];
        scene.occluded_batch(self.rays(), false, &mut out);
        out
    }
}

impl Hits {
    pub fn get(&self, i: usize) -> Option<Hit> {
        (self.geometry[i] != MISS).then(|| Hit {
            t: self.t[i],
            u: self.u[i],
            v: self.v[i],
            ng: [0.0; 3],
            primitive: self.primitive[i],
            geometry: self.geometry[i],
            instance: self.instance[i],
            instance_primitive: self.instance_primitive[i],
        })
    }
}

/// `x` without the last digits, in which instruction sets differ.
pub fn rounded(x: f32) -> f32 {
    (1e4 * x).round() / 1e4
}

/// Whether two hits are the same thing at the same place, up to the rounding of different kernels; `u` and
/// `v` count in edges, which are a tenth or less of what `t` counts in.
pub fn is_same(a: &Hit, b: &Hit) -> bool {
    let ids = |hit: &Hit| (hit.primitive, hit.geometry, hit.instance, hit.instance_primitive);
    let near = |a: f32, b: f32, by: f32| (a - b).abs() <= by;
    ids(a) == ids(b) && near(a.t, b.t, 2e-5) && near(a.u, b.u, 2e-4) && near(a.v, b.v, 2e-4)
}

/// The closest hits of `rays`, after asking for them in every way that there is: one by one, 8 and 16 at
/// a time, in batches, coherent and not, and for any hit.
pub fn hits_in_every_way(scene: &CommittedScene, rays: &[Ray]) -> Vec<Option<Hit>> {
    let hits: Vec<Option<Hit>> = rays.iter().map(|ray| scene.intersect1(ray)).collect();
    let check = |i: usize, found: Option<Hit>, how: &str| {
        let is_agreed = match (&hits[i], &found) {
            (Some(a), Some(b)) => is_same(a, b),
            (None, None) => true,
            _ => false,
        };
        assert!(is_agreed, "ray {i} {:?}: {:?} alone, {found:?} {how}", rays[i], hits[i]);
    };
    for (i, ray) in rays.iter().enumerate() {
        assert_eq!(scene.occluded1(ray), hits[i].is_some(), "{ray:?}");
    }
    for coherence in [Coherence::Incoherent, Coherence::Coherent] {
        macro_rules! packets {
            ($n:literal, $RayHit:ident, $Mask:ident, $intersect:ident, $occluded:ident) => {
                for (at, chunk) in rays.chunks($n).enumerate() {
                    let mut packet = $RayHit::default();
                    for (lane, ray) in chunk.iter().enumerate() {
                        packet.ray.set(lane, ray);
                    }
                    let valid = $Mask::first(chunk.len());
                    let mut rays = packet.ray;
                    scene.$intersect(&valid, &mut packet, coherence);
                    let occluded = scene.$occluded(&valid, &mut rays, coherence);
                    for lane in 0..chunk.len() {
                        let hit = (packet.hit.geometry[lane] != MISS).then(|| Hit {
                            t: packet.ray.t_max[lane],
                            u: packet.hit.u[lane],
                            v: packet.hit.v[lane],
                            ng: [0.0; 3],
                            primitive: packet.hit.primitive[lane],
                            geometry: packet.hit.geometry[lane],
                            instance: packet.hit.instance[lane],
                            instance_primitive: packet.hit.instance_primitive[lane],
                        });
                        let how = format!("in a packet of {}, {coherence:?}", $n);
                        check($n * at + lane, hit, &how);
                        assert_eq!(occluded.contains(lane), hit.is_some(), "ray {} {how}", $n * at + lane);
                    }
                }
            };
        }
        packets!(8, RayHit8, Mask8, intersect8, occluded8);
        packets!(16, RayHit16, Mask16, intersect16, occluded16);
    }
    let batch = Batch::new(rays);
    let occluded = batch.occluded(scene);
    for coherent in [false, true] {
        let found = batch.intersect(scene, coherent);
        for (i, &occluded) in occluded.iter().enumerate() {
            check(i, found.get(i), "in a batch");
            assert_eq!(occluded, u8::from(found.get(i).is_some()), "ray {i} in a batch");
        }
    }
    hits
}

/// A lumpy closed surface around the origin, within the unit ball, of `2 * n * n` triangles.
pub fn lump(n: u32) -> Mesh {
    use std::f32::consts::{PI, TAU};
    let (flat, indices) = square(0.0, n);
    let positions = flat
        .iter()
        .map(|&[x, y, _]| {
            let (theta, phi) = (PI * y, TAU * x);
            let radius = 0.8 + 0.2 * (3.0 * theta).sin() * (2.0 * phi).cos();
            [radius * theta.sin() * phi.cos(), radius * theta.sin() * phi.sin(), radius * theta.cos()]
        })
        .collect();
    (positions, indices)
}

/// `matrix`, four columns, applied to a point.
pub fn apply(matrix: &[[f32; 3]; 4], point: [f32; 3]) -> [f32; 3] {
    let [x, y, z, origin] = matrix;
    std::array::from_fn(|i| x[i] * point[0] + y[i] * point[1] + z[i] * point[2] + origin[i])
}

/// `a + (b - a) * t`, number by number.
pub fn between<const N: usize>(a: [f32; N], b: [f32; N], t: f32) -> [f32; N] {
    std::array::from_fn(|i| a[i] + (b[i] - a[i]) * t)
}

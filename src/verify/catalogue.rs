//! The built-in meshes: a table, one entry a trouble. To add one, add a line.

use super::meshes::{cuboid, grid, joined, placed, random_soup, slivers, soup, sphere};
use super::rays::Inside;
use crate::accel::Triangles;
use crate::accel::geometry::{
    Affine, Candidate, Geometry, HitFilter, Object, Part, Placement, Primitives, Shape, ShapeHit, ShapeRay,
};
use crate::math::random::Rng;
use glam::{Mat3, Quat, Vec3};
use std::sync::Arc;

/// A mesh of the table.
pub struct Entry {
    /// Its name in reports.
    pub name: &'static str,
    /// Makes it; always the same.
    pub build: fn(&mut Rng) -> Subject,
}

impl Entry {
    /// The mesh, always the same.
    pub fn subject(&self) -> Subject {
        (self.build)(&mut Rng::of_stream(0, self.name, 0))
    }
}

/// Something to shoot at.
pub struct Subject {
    /// What rays can hit.
    pub geometry: Geometry,
    /// Where rays that start inside of a closed mesh do so; `None` if it is not closed, or not known to be.
    pub inside: Option<Inside>,
    /// Backends may disagree about hit or miss of 2 in a million usual rays, here as at scenes of users. Not so where Embree catches rays that leave
    /// slivers (`slivers`, `needles`: 1 to 10 of 100), where the scene is so much larger than a triangle that the error
    /// bound is as large (`mixed-scales`: 40 of a million) and where triangles are 2 ulp of their coordinates (`sphere-far`).
    pub is_ordinary: bool,
}

/// Where Embree's own watertight test stands (Embree 4, tutorials/verify): vertices are rounded to 1/64 m there.
const FAR: Vec3 = Vec3::new(148_376.0, 1234.0, -223_423.0);

/// The table.
pub const ENTRIES: &[Entry] = &[
    Entry { name: "bumpy", build: |_| bumpy_at(1.0, Vec3::ZERO) },
    Entry { name: "bumpy-far", build: |_| bumpy_at(1.0, FAR) },
    Entry { name: "bumpy-small", build: |_| bumpy_at(1e-6, Vec3::ZERO) },
    Entry { name: "bumpy-small-far", build: |_| bumpy_at(1e-6, FAR) },
    Entry { name: "bumpy-large", build: |_| bumpy_at(1e6, Vec3::ZERO) },
    Entry { name: "bumpy-large-far", build: |_| bumpy_at(1e6, FAR) },
    Entry { name: "sphere", build: |_| closed(sphere(100, 200, || 2.0), Vec3::ZERO, 0.5) },
    Entry { name: "sphere-far", build: |_| adverse(closed(placed(&sphere(100, 200, || 2.0), 1.0, FAR), FAR, 0.5)) },
    Entry { name: "room", build: room },
    Entry { name: "grid", build: |_| open(grid(12, -3.0, |_, _| 0.0)) },
    Entry { name: "terrain", build: terrain },
    Entry { name: "soup", build: |rng| open(random_soup(500, 0.3, rng)) },
    Entry { name: "slivers", build: |rng| adverse(open(slivers(500, 1.0, rng))) },
    Entry { name: "needles", build: |rng| adverse(open(slivers(2000, 1e3, rng))) },
    Entry { name: "stadium", build: stadium },
    Entry { name: "flat", build: flat },
    Entry { name: "copies", build: copies },
    Entry { name: "mixed-scales", build: |rng| adverse(mixed_scales(rng)) },
    Entry { name: "cutout", build: cutout },
    Entry { name: "moving", build: moving },
    Entry { name: "instances", build: instances },
    Entry { name: "moving-instances", build: moving_instances },
    Entry { name: "shapes", build: shapes },
];

fn open(geometry: impl Into<Geometry>) -> Subject {
    Subject { geometry: geometry.into(), inside: None, is_ordinary: true }
}

/// A subject full of boundaries.
fn adverse(subject: Subject) -> Subject {
    Subject { is_ordinary: false, ..subject }
}

/// `radius` about `centre` is inside.
fn closed(geometry: impl Into<Geometry>, centre: Vec3, radius: f32) -> Subject {
    Subject { geometry: geometry.into(), inside: Some(Inside { centre, radius }), is_ordinary: true }
}

/// pbrt's closed mesh of bumps: 16 x 16, radii 1 to 6.
fn bumpy() -> Triangles {
    let mut rng = Rng::of_stream(12111, "bumpy", 0);
    sphere(16, 16, || 1.0 + 5.0 * rng.unit())
}

fn bumpy_at(s: f32, shift: Vec3) -> Subject {
    // Small ones stand as many of their own sizes away.
    closed(placed(&bumpy(), s, shift * s), shift * s, 0.5 * s)
}

/// A closed room with furniture: big triangles that the front takes, and small ones.
fn room(_: &mut Rng) -> Subject {
    let walls = cuboid(Vec3::new(-4.0, 0.0, -3.0), Vec3::new(4.0, 2.7, 3.0));
    let table = cuboid(Vec3::new(-1.0, 0.7, -0.5), Vec3::new(1.0, 0.75, 0.5));
    let ball = placed(&sphere(48, 96, || 1.0), 0.25, Vec3::new(0.1, 1.0, 0.05));
    closed(joined(joined(walls, &table), &ball), Vec3::new(2.5, 1.5, 1.5), 0.3)
}

fn terrain(rng: &mut Rng) -> Subject {
    let mut rough = rng.clone();
    open(grid(256, -128.0, |x, y| 6.0 * (0.11 * x).sin() * (0.07 * y).cos() + rough.range(-0.3, 0.3)))
}

/// A thing of 1e-4 m on a plane of 2e6 m.
fn stadium(_: &mut Rng) -> Subject {
    let ground = placed(&grid(2, -1.0, |_, _| 0.0), 1e6, Vec3::ZERO);
    open(joined(ground, &placed(&bumpy(), 2e-5, Vec3::new(0.0, 0.0, 1.2e-4))))
}

/// Triangles in planes x, y or z = const through points of a lattice, and boxes without thickness.
fn flat(rng: &mut Rng) -> Subject {
    let mut lattice = |_| (rng.below(5) as f32) - 2.0;
    let mut mesh = Triangles::default();
    for i in 0..300 {
        let (axis, at) = (i % 3, lattice(0));
        let mut corner = || {
            let mut p = Vec3::from([0; 3].map(&mut lattice));
            p[axis] = at;
            p
        };
        let corners = [corner(), corner(), corner()];
        if (corners[1] - corners[0]).cross(corners[2] - corners[0]) != Vec3::ZERO {
            mesh = joined(mesh, &soup([corners]));
        }
    }
    let mut thin = Vec3::new(1.5, 1.5, 1.5);
    for axis in 0..3 {
        thin[axis] = 0.0;
        let (faces, low) = (cuboid(-thin, thin), Vec3::splat(0.25));
        let area = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| Vec3::from(faces.positions[v as usize]));
            (b - a).cross(c - a) != Vec3::ZERO
        };
        let indices = faces.indices.iter().copied().filter(area).collect();
        mesh = joined(mesh, &placed(&Triangles { indices, ..faces }, 1.0, low));
        thin[axis] = 1.5;
    }
    open(mesh)
}

/// Every triangle five times, and many that share a centre.
fn copies(rng: &mut Rng) -> Subject {
    let mut mesh = random_soup(100, 0.5, rng);
    for _ in 0..4 {
        mesh.indices.extend_from_within(..100);
    }
    let concentric = soup((0..200).map(|i| {
        let r = 1.0 + i as f32 / 200.0;
        [Vec3::new(r, 0.0, 0.0), Vec3::new(-r, r, 0.0), Vec3::new(-r, -r, 0.0)]
    }));
    open(joined(mesh, &concentric))
}

/// Triangles of 1e-4 to 1e3 m, each as far away as it is large, and some as large as everything.
fn mixed_scales(rng: &mut Rng) -> Subject {
    open(soup((0..600).map(|_| {
        let s = 10f32.powf(rng.range(-4.0, 3.0));
        let centre = rng.cube() * s * rng.pick(&[1.0, 10.0]);
        [0; 3].map(|_| centre + rng.cube() * s)
    })))
}

/// Holes in the pattern of a chess board of u and v.
struct Holes;

impl HitFilter for Holes {
    fn stops(&self, c: &Candidate) -> bool {
        let cell = |w: f32| (w * 5.0).floor() as i32;
        (cell(c.u) + cell(c.v) + (c.primitive % 2) as i32) % 2 == 0
    }
}

fn cutout(rng: &mut Rng) -> Subject {
    let world = Object {
        parts: vec![
            Part { triangles: random_soup(200, 0.4, rng), filtered: true, ..Part::default() },
            Part {
                triangles: random_soup(200, 0.4, rng),
                primitives: Primitives::Each((0..200).map(|i| 200 + 2 * i).collect()),
                ..Part::default()
            },
        ],
        shapes: Vec::new(),
    };
    open(Geometry { world, filter: Some(Arc::new(Holes)), ..Geometry::default() })
}

/// A bumpy ball that turns and grows, with three keys, among triangles at rest.
fn moving_object(rng: &mut Rng) -> Object {
    let triangles = bumpy();
    let key = |angle: f32, s: f32, shift: Vec3| {
        let turn = Mat3::from_quat(Quat::from_axis_angle(Vec3::new(0.36, 0.48, 0.8), angle)) * s;
        triangles.positions.iter().map(|&p| (turn * Vec3::from(p) + shift).to_array()).collect::<Vec<_>>()
    };
    let later = vec![key(0.4, 1.1, Vec3::X * 0.1), key(0.7, 0.9, Vec3::new(0.1, 0.2, 0.0))];
    let first = triangles.indices.len() as u32;
    let rest = Part {
        triangles: placed(&random_soup(100, 0.3, rng), 8.0, Vec3::ZERO),
        primitives: Primitives::From(first),
        ..Part::default()
    };
    Object { parts: vec![Part { triangles, later, ..Part::default() }, rest], shapes: Vec::new() }
}

fn moving(rng: &mut Rng) -> Subject {
    closed(Geometry { world: moving_object(rng), ..Geometry::default() }, Vec3::ZERO, 0.2)
}

/// Rotated, stretched, sheared, mirrored, tiny and huge.
fn maps(rng: &mut Rng) -> Vec<Affine> {
    let mirrors = [Vec3::ONE, Vec3::new(-1.0, 1.0, 1.0), Vec3::new(-1.0, -1.0, 1.0), Vec3::splat(-1.0)];
    let scales = [Vec3::splat(0.57), Vec3::splat(2.7), Vec3::new(1.0, 2.0, 3.0), Vec3::new(0.05, 1.0, 20.0)];
    (0..24)
        .map(|i| {
            let turn = Mat3::from_quat(Quat::from_axis_angle(rng.direction(), rng.range(0.0, 3.0)));
            let mut shear = Mat3::IDENTITY;
            if i % 3 == 0 {
                shear.y_axis.x = rng.range(-1.0, 1.0);
            }
            let m = turn * shear * Mat3::from_diagonal(scales[i % 4] * mirrors[i / 4 % 4]);
            Affine { columns: [m.x_axis, m.y_axis, m.z_axis], translation: rng.cube() * 30.0 }
        })
        .collect()
}

/// The world's own triangles, and two objects placed two dozen times.
fn instances(rng: &mut Rng) -> Subject {
    let ball = bumpy();
    let first = ball.indices.len() as u32;
    let loose = random_soup(100, 0.5, rng);
    let numbered = |triangles, from| Object {
        parts: vec![Part { triangles, primitives: Primitives::From(from), ..Part::default() }],
        shapes: Vec::new(),
    };
    let world = numbered(placed(&random_soup(50, 0.5, rng), 30.0, Vec3::ZERO), first + 100);
    let placements = maps(rng)
        .into_iter()
        .enumerate()
        .map(|(i, map)| Placement { object: (i % 2) as u32, keys: vec![map] })
        .collect();
    let objects = vec![numbered(ball, 0), numbered(loose, first)];
    open(Geometry { world, objects, placements, filter: None })
}

fn moving_instances(rng: &mut Rng) -> Subject {
    let mut subject = instances(rng);
    subject.geometry.objects[1] = moving_object(rng);
    let shifted = 10_000;
    for part in &mut subject.geometry.objects[1].parts {
        let Primitives::From(first) = &mut part.primitives else { continue };
        *first += shifted;
    }
    for (i, placement) in subject.geometry.placements.iter_mut().enumerate().filter(|(i, _)| i % 3 > 0) {
        let start = placement.keys[0];
        let next = |k: f32| Affine {
            columns: start.columns.map(|c| c * (1.0 + 0.1 * k)),
            translation: start.translation + Vec3::new(1.0, -0.5, 0.25) * k,
        };
        placement.keys.extend((1..=1 + i % 2).map(|k| next(k as f32)));
    }
    subject
}

/// A sphere as an exact shape.
#[derive(Clone, Copy)]
struct Ball {
    centre: Vec3,
    radius: f32,
}

impl Shape for Ball {
    fn bounds(&self) -> [[f32; 3]; 2] {
        [(self.centre - self.radius).to_array(), (self.centre + self.radius).to_array()]
    }

    fn intersect(&self, ray: &ShapeRay) -> Option<ShapeHit> {
        // In f64 from the point of the line that is nearest to the centre.
        let (d, o) = (ray.direction.as_dvec3(), (ray.origin - self.centre).as_dvec3());
        let middle = -o.dot(d) / d.length_squared();
        let h2 = f64::from(self.radius).powi(2) - (o + d * middle).length_squared();
        if h2 < 0.0 {
            return None;
        }
        let half = h2.sqrt() / d.length();
        let t = [middle - half, middle + half].map(|t| t as f32).into_iter().find(|t| *t > 0.0 && *t < ray.t_max)?;
        Some(ShapeHit { t, u: 0.0, v: 0.0 })
    }
}

fn shapes(rng: &mut Rng) -> Subject {
    let triangles = random_soup(100, 0.3, rng);
    let first = triangles.indices.len() as u32;
    let ball = |rng: &mut Rng| Arc::new(Ball { centre: rng.cube(), radius: rng.range(0.02, 0.3) }) as Arc<dyn Shape>;
    let balls = (0..30).map(|i| (ball(rng), first + i)).collect();
    let world = Object { parts: vec![triangles.into()], shapes: balls };
    open(Geometry { world, ..Geometry::default() })
}

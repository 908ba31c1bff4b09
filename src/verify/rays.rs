//! The rays: such as pictures need, and such as break ray tracers.

use crate::accel::RayBatch;
use crate::accel::geometry::{Geometry, Object};
use crate::math::random::Rng;
use crate::math::robust::offset_origin;
use glam::Vec3;
use serde::Serialize;

/// A ray as backends get it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Origin, prepared space.
    pub origin: Vec3,
    /// Direction of any length.
    pub direction: Vec3,
    /// End.
    pub t_max: f32,
    /// In [0, 1].
    pub time: f32,
    /// What filters know it by.
    pub key: u32,
    /// It starts inside a closed mesh and does not end: it must hit something, whatever the oracle says about any
    /// triangle.
    pub is_inside: bool,
}

/// Kinds of rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// A camera's, in the order of pixels.
    Camera,
    /// From anywhere (inside, if the mesh is closed) to anywhere.
    Random,
    /// From a surface, as the integrator leaves it, over its hemisphere.
    Bounce,
    /// From surface to surface, off both by the error bound, as shadow rays are.
    Shadow,
    /// From surface to surface, ending just before, exactly at, or just behind the other one.
    Ends,
    /// At points of edges; from inside a closed mesh no side of the edge may let it pass.
    Edge,
    /// Exactly at corners.
    Vertex,
    /// At angles from 0.1 down to 1e-8 to a triangle.
    Grazing,
    /// In a triangle's plane, as far as f32 can say so.
    Coplanar,
    /// From 10 to 1e4 times the size of everything away.
    Far,
    /// From a hair's breadth before a triangle, and ending a hair's breadth behind it.
    Near,
    /// Direction components down to 1e-30, directions of length 1e-6 to 1e6.
    Tiny,
    /// Along axes, the other components zero of both signs, from and through corners and edges.
    Axis,
    /// No rays: NaN, infinite, without direction or length. They must miss.
    Invalid,
}

impl Kind {
    /// All of them.
    pub const ALL: [Self; 14] = [
        Self::Camera,
        Self::Random,
        Self::Bounce,
        Self::Shadow,
        Self::Ends,
        Self::Edge,
        Self::Vertex,
        Self::Grazing,
        Self::Coplanar,
        Self::Far,
        Self::Near,
        Self::Tiny,
        Self::Axis,
        Self::Invalid,
    ];

    /// Its name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Camera => "camera",
            Self::Random => "random",
            Self::Bounce => "bounce",
            Self::Shadow => "shadow",
            Self::Ends => "ends",
            Self::Edge => "edge",
            Self::Vertex => "vertex",
            Self::Grazing => "grazing",
            Self::Coplanar => "coplanar",
            Self::Far => "far",
            Self::Near => "near",
            Self::Tiny => "tiny",
            Self::Axis => "axis",
            Self::Invalid => "invalid",
        }
    }

    /// Whether pictures are made of such rays: those of BVH-01.
    pub fn is_usual(self) -> bool {
        matches!(self, Self::Camera | Self::Random | Self::Bounce | Self::Shadow)
    }
}

/// A ball that lies inside of a closed mesh.
#[derive(Clone, Copy, Debug)]
pub struct Inside {
    /// Its centre.
    pub centre: Vec3,
    /// Its radius, metres.
    pub radius: f32,
}

/// Where rays are aimed.
pub struct Aim<'g> {
    geometry: &'g Geometry,
    inside: Option<Inside>,
    /// Running number of triangles after each instance (0 = the world) that has any.
    instances: Vec<(usize, usize)>,
    centre: Vec3,
    /// Half the diagonal of everything, metres.
    size: f32,
    has_motion: bool,
}

/// A triangle in prepared space at some time.
struct Target {
    corners: [Vec3; 3],
}

impl Target {
    fn extent(&self) -> Vec3 {
        self.corners.iter().fold(Vec3::ZERO, |most, c| most.max(c.abs()))
    }

    /// Its normal; none if it has no area.
    fn normal(&self) -> Option<Vec3> {
        let [a, b, c] = self.corners.map(Vec3::as_dvec3);
        // In f64: in f32 edges below 3e-10 m have no cross product.
        (b - a).cross(c - a).try_normalize().map(|n| n.as_vec3()).filter(|n| n.is_normalized())
    }

    fn point(&self, rng: &mut Rng) -> Vec3 {
        let (mut u, mut v) = (rng.unit(), rng.unit());
        if u + v > 1.0 {
            (u, v) = (1.0 - u, 1.0 - v);
        }
        let [a, b, c] = self.corners;
        a + (b - a) * u + (c - a) * v
    }

    fn edge_point(&self, rng: &mut Rng) -> Vec3 {
        let k = rng.below(3);
        let (a, b) = (self.corners[k], self.corners[(k + 1) % 3]);
        a + (b - a) * rng.unit()
    }

    fn longest_edge(&self) -> f32 {
        let [a, b, c] = self.corners;
        (b - a).length().max((c - b).length()).max((a - c).length())
    }
}

impl<'g> Aim<'g> {
    /// At the triangles of `geometry`; `None` if there is nothing.
    pub fn new(geometry: &'g Geometry, inside: Option<Inside>) -> Option<Self> {
        let [low, high] = geometry.bounds()?;
        let count = |o: &Object| o.parts.iter().map(|p| p.triangles.indices.len()).sum::<usize>();
        let counts: Vec<usize> = geometry.objects.iter().map(count).collect();
        let all = std::iter::once(count(&geometry.world))
            .chain(geometry.placements.iter().map(|p| counts[p.object as usize]));
        let mut instances = Vec::new();
        let mut total = 0;
        for (i, count) in all.enumerate().filter(|(_, count)| *count > 0) {
            total += count;
            instances.push((total, i));
        }
        let moves = |o: &Object| o.parts.iter().any(|p| p.keys() > 1);
        let has_motion = geometry.placements.iter().any(|p| p.moves())
            || std::iter::once(&geometry.world).chain(&geometry.objects).any(moves);
        let size = 0.5 * (high - low).length();
        Some(Self { geometry, inside, instances, centre: 0.5 * (low + high), size, has_motion })
    }

    /// The triangle aimed at next; without triangles one about the middle.
    fn target(&self, time: f32, rng: &mut Rng) -> Target {
        let Some(&(total, _)) = self.instances.last() else {
            let corners = [0; 3].map(|_| self.centre + rng.cube() * self.size);
            return Target { corners };
        };
        let mut i = rng.below(total);
        let at = self.instances.partition_point(|(end, _)| *end <= i);
        let instance = self.instances[at].1;
        if at > 0 {
            i -= self.instances[at - 1].0;
        }
        let (object, place) = match instance.checked_sub(1) {
            None => (&self.geometry.world, None),
            Some(p) => {
                let placement = &self.geometry.placements[p];
                (&self.geometry.objects[placement.object as usize], Some(placement.at(time)))
            }
        };
        for part in &object.parts {
            let n = part.triangles.indices.len();
            if i < n {
                let corners = part.corners_at(i, time);
                return Target { corners: place.map_or(corners, |place| corners.map(|c| place.point(c))) };
            }
            i -= n;
        }
        unreachable!("i is below the number of triangles of the object")
    }

    /// `n` rays of a kind; `chunk` tells these from others of the kind.
    pub fn rays(&self, kind: Kind, n: usize, rng: &mut Rng) -> Vec<Ray> {
        let eye = self.centre + rng.direction() * self.size * rng.range(0.2, 3.0);
        (0..n)
            .map(|i| {
                let time = if self.has_motion { rng.pick(&[0.0, 1.0, 0.5, rng.clone().unit()]) } else { 0.0 };
                let ray = |origin: Vec3, direction: Vec3, t_max: f32| Ray {
                    origin,
                    direction,
                    t_max,
                    time,
                    key: 0,
                    is_inside: false,
                };
                let made = match kind {
                    Kind::Camera => self.camera(eye, i, n, &ray),
                    _ => self.ray(kind, time, &ray, rng),
                };
                Ray { key: rng.bits(), ..made }
            })
            .collect()
    }

    /// Pixel `i` of `n`, from `eye` towards the middle.
    fn camera(&self, eye: Vec3, i: usize, n: usize, ray: &impl Fn(Vec3, Vec3, f32) -> Ray) -> Ray {
        let side = (n as f32).sqrt().ceil() as usize;
        let forward = (self.centre - eye).normalize_or(Vec3::Z);
        let right = forward.any_orthonormal_vector();
        let up = right.cross(forward);
        let at = |k: usize| (k as f32 + 0.5) / side as f32 * 1.6 - 0.8;
        ray(eye, (forward + right * at(i % side) + up * at(i / side)).normalize(), f32::INFINITY)
    }

    /// From inside, or anywhere in and around everything.
    fn origin(&self, rng: &mut Rng) -> (Vec3, bool) {
        match self.inside {
            Some(Inside { centre, radius }) if rng.below(4) > 0 => (centre + rng.direction() * radius, true),
            _ => (self.centre + rng.cube() * self.size * rng.pick(&[0.5, 1.0, 3.0]), false),
        }
    }

    fn ray(&self, kind: Kind, time: f32, ray: &impl Fn(Vec3, Vec3, f32) -> Ray, rng: &mut Rng) -> Ray {
        let infinite = f32::INFINITY;
        let target = self.target(time, rng);
        let (origin, is_inside) = self.origin(rng);
        let normal = target.normal();
        match kind {
            Kind::Camera | Kind::Random => {
                let d = if rng.below(2) == 0 { rng.direction() } else { self.centre + rng.cube() * self.size - origin };
                let t_max = if is_inside || rng.below(4) > 0 { infinite } else { rng.unit() * self.size / d.length() };
                Ray { is_inside, ..ray(origin, d, t_max) }
            }
            Kind::Bounce => {
                let Some(ng) = normal else { return ray(origin, rng.direction(), infinite) };
                let mut d = rng.direction();
                // 30 % graze.
                if rng.below(10) < 3 {
                    d -= ng * d.dot(ng) * 0.999;
                }
                ray(offset_origin(target.point(rng), target.extent(), ng, d), d, infinite)
            }
            Kind::Shadow | Kind::Ends => {
                let other = self.target(time, rng);
                let (mut from, mut to) = (target.point(rng), other.point(rng));
                let d = to - from;
                from = normal.map_or(from, |ng| offset_origin(from, target.extent(), ng, d));
                if kind == Kind::Shadow {
                    to = other.normal().map_or(to, |ng| offset_origin(to, other.extent(), ng, -d));
                    return ray(from, to - from, 1.0);
                }
                let short = [0.0, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2];
                let t_max = 1.0 + rng.pick(&short) * rng.pick(&[-1.0, 1.0]);
                ray(from, to - from, t_max)
            }
            Kind::Edge => Ray { is_inside, ..ray(origin, target.edge_point(rng) - origin, infinite) },
            Kind::Vertex => Ray { is_inside, ..ray(origin, rng.pick(&target.corners) - origin, infinite) },
            Kind::Grazing => {
                let ng = normal.unwrap_or(Vec3::Y);
                let along = ng.any_orthonormal_vector() * rng.range(-1.0, 1.0);
                let along =
                    (along + ng.cross(along.normalize_or(Vec3::X)) * rng.range(-1.0, 1.0)).normalize_or(Vec3::X);
                let angle = 10f32.powi(-1 - rng.below(8) as i32);
                let d = along - ng * angle;
                ray(target.point(rng) - d * target.longest_edge() * rng.range(0.1, 50.0), d, infinite)
            }
            Kind::Coplanar => {
                let [a, b, c] = target.corners;
                let d = (b - a) * rng.range(-1.0, 1.0) + (c - a) * rng.range(-1.0, 1.0);
                let through = match rng.below(4) {
                    0 => a,
                    1 => b,
                    2 => target.edge_point(rng),
                    _ => target.point(rng),
                };
                ray(through - d * rng.range(0.5, 4.0), d, infinite)
            }
            Kind::Far => {
                let far = rng.direction() * self.size * 10f32.powf(rng.range(1.0, 4.0));
                let to = if rng.below(2) == 0 { target.point(rng) } else { target.edge_point(rng) };
                ray(to + far, if rng.below(2) == 0 { -far } else { -far.normalize_or(Vec3::X) }, infinite)
            }
            Kind::Near => {
                let d = rng.direction();
                let before = target.longest_edge() * 10f32.powf(rng.range(-7.0, -1.0));
                let behind = before * rng.pick(&[0.5, 0.999, 1.0, 1.001, 2.0]);
                ray(target.point(rng) - d * before, d, behind)
            }
            Kind::Tiny => {
                let mut d = rng.direction();
                for axis in 0..3 {
                    if rng.below(2) == 0 {
                        d[axis] = d[axis].signum() * 10f32.powf(rng.range(-30.0, -6.0));
                    }
                }
                let length = 10f32.powf(rng.range(-6.0, 6.0));
                let d = if d.abs().max_element() < 0.1 { Vec3::new(d.x, d.y, 1.0) } else { d } * length;
                ray(target.point(rng) - d * (self.size * rng.unit() / length), d, infinite)
            }
            Kind::Axis => {
                let axis = rng.below(3);
                let mut d = [0; 3].map(|_| rng.pick(&[0.0, -0.0]));
                d[axis] = rng.pick(&[1.0, -1.0, 0.37, -2.5]);
                let through = match rng.below(4) {
                    0 => target.corners[rng.below(3)],
                    1 => target.edge_point(rng),
                    _ => target.point(rng),
                };
                let mut from = through;
                // Every other one starts in the plane of something.
                from[axis] = if rng.below(2) == 0 { self.target(time, rng).corners[0][axis] } else { origin[axis] };
                ray(from, Vec3::from(d), infinite)
            }
            Kind::Invalid => {
                let bad = rng.pick(&[f32::NAN, f32::INFINITY, f32::NEG_INFINITY]);
                let (mut origin, mut d, mut t_max) = (origin, target.point(rng) - origin, infinite);
                match rng.below(4) {
                    0 => origin[rng.below(3)] = bad,
                    1 => d[rng.below(3)] = bad,
                    2 => d = Vec3::from([0; 3].map(|_| rng.pick(&[0.0, -0.0]))),
                    _ => t_max = rng.pick(&[f32::NAN, 0.0, -0.0, -1.0, f32::NEG_INFINITY]),
                }
                ray(origin, d, t_max)
            }
        }
    }
}

/// The rays as backends take them.
pub fn batch(rays: &[Ray]) -> RayBatch {
    let mut batch = RayBatch::new(rays.len());
    for (i, ray) in rays.iter().enumerate() {
        batch.set(i, ray.origin, ray.direction, ray.t_max);
        batch.time[i] = ray.time;
        batch.key[i] = ray.key;
    }
    batch
}

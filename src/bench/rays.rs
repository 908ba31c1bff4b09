//! The rays that are timed: what the renderer sends for a scene, and random chords.

use super::surface::SurfacePoint;
use crate::accel::geometry::Geometry;
use crate::accel::{Accel, HitBatch, RayBatch};
use crate::camera::{Camera, CameraRays, FilterShape, PixelFilter};
use crate::film::TILE;
use crate::integrator::POOL;
use crate::math::V3;
use crate::math::random::Rng;
use crate::render::Prepared;
use crate::sampler::{Key, dims, pixel_seed};
use glam::Vec3;
use serde::Serialize;
use simd::{Float, Kernel, Lanes, Level, Mask, Uint, dispatch_large};

/// The picture that camera rays are taken from, pixels.
pub const PICTURE: [u32; 2] = [1280, 720];
/// Consecutive samples of a pixel: a quarter of 64, as the renderer cuts them.
const SAMPLES: u32 = 16;
/// Passes over the surface points in search of ones that a light may reach.
const PASSES: usize = 16;

/// What rays are for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// Camera rays in the batches that the renderer sends, marked coherent.
    Primary,
    /// Directions drawn by the cosine about what the camera rays hit, in random order.
    Diffuse,
    /// From what the camera rays hit towards the scene's lights; any hit counts.
    Shadow,
    /// Through two random points of the scene's bounds.
    Incoherent,
}

impl Kind {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Primary, Self::Diffuse, Self::Shadow, Self::Incoherent];

    /// As in the JSON.
    pub fn name(self) -> &'static str {
        match self {
            Self::Primary => "primary",
            Self::Diffuse => "diffuse",
            Self::Shadow => "shadow",
            Self::Incoherent => "incoherent",
        }
    }
}

/// Rays of one kind in full batches of [`POOL`].
pub struct RaySet {
    /// What they are for.
    pub kind: Kind,
    /// Never empty.
    pub batches: Vec<RayBatch>,
}

impl RaySet {
    /// How many rays.
    pub fn len(&self) -> usize {
        self.batches.len() * POOL
    }

    /// `n` of the rays, spread evenly over all of them, in one batch.
    pub fn some(&self, n: usize) -> RayBatch {
        let n = n.min(self.len());
        let mut some = RayBatch::new(n);
        for to in 0..n {
            let from = to * self.len() / n;
            let (batch, i) = (&self.batches[from / POOL], from % POOL);
            some.set(to, origin(batch, i), direction(batch, i), batch.t_max[i]);
        }
        some
    }

    fn of(kind: Kind, rays: &[(Vec3, Vec3, f32)], batches: usize) -> Self {
        let batch = |b: usize| {
            let mut batch = RayBatch::new(POOL);
            for i in 0..POOL {
                let (origin, direction, t_max) = rays[(b * POOL + i) % rays.len()];
                batch.set(i, origin, direction, t_max);
            }
            batch
        };
        Self { kind, batches: (0..batches).map(batch).collect() }
    }
}

/// Origin of ray `i`.
pub fn origin(rays: &RayBatch, i: usize) -> Vec3 {
    Vec3::new(rays.ox[i], rays.oy[i], rays.oz[i])
}

/// Direction of ray `i`.
pub fn direction(rays: &RayBatch, i: usize) -> Vec3 {
    Vec3::new(rays.dx[i], rays.dy[i], rays.dz[i])
}

/// `batches` batches of every kind for a scene whose rays can hit `geometry`; `None` if none of the rays hits anything
/// from which others could start. Points are found with the scene's own backend.
pub fn ray_sets(
    prepared: &Prepared,
    geometry: &Geometry,
    camera: &Camera,
    batches: usize,
    seed: u64,
) -> Option<Vec<RaySet>> {
    let bounds = geometry.bounds()?;
    let primary = RaySet { kind: Kind::Primary, batches: primary(prepared, camera, batches, seed) };
    let incoherent = RaySet::of(Kind::Incoherent, &chords(bounds, batches * POOL, seed), batches);
    // A camera that looks past everything leaves the chords.
    let mut points = surface_points(geometry, &*prepared.accel, &primary);
    if points.is_empty() {
        points = surface_points(geometry, &*prepared.accel, &incoherent);
    }
    if points.is_empty() {
        return None;
    }
    let diffuse = RaySet::of(Kind::Diffuse, &bounces(&points, batches * POOL, seed), batches);
    let shadow = RaySet::of(Kind::Shadow, &towards_lights(prepared, &points, batches * POOL, seed), batches);
    Some(vec![primary, diffuse, shadow, incoherent])
}

/// Each batch is what a worker sends first of a 32x32 tile at 64 samples a pixel, from another place of its tile; the
/// tiles are spread evenly over the picture.
fn primary(prepared: &Prepared, camera: &Camera, batches: usize, seed: u64) -> Vec<RayBatch> {
    let camera = CameraRays::new(camera, &[], PICTURE[0], PICTURE[1], prepared.origin, None);
    let tiles = PICTURE.map(|side| (side / TILE) as usize);
    let (count, pixels) = (tiles[0] * tiles[1], POOL as u32 / SAMPLES);
    let batch = |b: usize| {
        let mut rays = RayBatch::new(POOL);
        let tile = if batches >= count { b % count } else { b * count / batches };
        let corner = [(tile % tiles[0]) as u32 * TILE, (tile / tiles[0]) as u32 * TILE];
        let first_pixel = b as u32 % (TILE * TILE / pixels) * pixels;
        let first_sample = (b / count) as u32 * SAMPLES;
        let (mut pixel_keys, mut samples) = (vec![0; POOL], vec![0; POOL]);
        for i in 0..POOL {
            let (pixel, sample) = (first_pixel + i as u32 / SAMPLES, i as u32 % SAMPLES);
            let (x, y) = (corner[0] + pixel % TILE, corner[1] + pixel / TILE);
            pixel_keys[i] = pixel_seed(seed, 0, x, y);
            samples[i] = first_sample + sample;
            (rays.ox[i], rays.oy[i], rays.t_max[i]) = (x as f32 + 0.5, y as f32 + 0.5, f32::INFINITY);
        }
        let level = Level::best().without_portable();
        dispatch_large(level, Generate { camera: &camera, pixels: &pixel_keys, samples: &samples, rays: &mut rays });
        rays
    };
    (0..batches).map(batch).collect()
}

/// Turns pixel centres into camera rays, as the integrator does.
struct Generate<'a> {
    camera: &'a CameraRays,
    pixels: &'a [u32],
    samples: &'a [u32],
    rays: &'a mut RayBatch,
}

impl Kernel for Generate<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { camera, pixels, samples, rays } = self;
        let filter = PixelFilter::new(FilterShape::Tent, 2.0);
        for at in (0..POOL).step_by(L::N) {
            let key = Key::<L> { pixel: L::U::load(pixels, at), sample: L::U::load(samples, at) };
            let u = key.group(L::U::splat(dims::CAMERA));
            let x = L::F::load(&rays.ox, at) + filter.offset::<L>(u[0]);
            let y = L::F::load(&rays.oy, at) + filter.offset::<L>(u[1]);
            let (origin, direction): (V3<L>, V3<L>) = camera.ray::<L>(x, y, [u[2], u[3]], L::F::zero());
            origin.x.store(&mut rays.ox, at);
            origin.y.store(&mut rays.oy, at);
            origin.z.store(&mut rays.oz, at);
            direction.x.store(&mut rays.dx, at);
            direction.y.store(&mut rays.dy, at);
            direction.z.store(&mut rays.dz, at);
        }
    }
}

/// What the rays of `set` hit, in their order.
fn surface_points(geometry: &Geometry, accel: &dyn Accel, set: &RaySet) -> Vec<SurfacePoint> {
    let mut hits = HitBatch::new(POOL);
    let mut points = Vec::new();
    for rays in &set.batches {
        accel.intersect(rays, 0..POOL, set.kind == Kind::Primary, &mut hits);
        points.extend((0..POOL).filter_map(|i| SurfacePoint::of_hit(geometry, rays, &hits, i)));
    }
    points
}

fn chords([low, high]: [Vec3; 2], n: usize, seed: u64) -> Vec<(Vec3, Vec3, f32)> {
    let mut random = Rng::of_stream(seed, "bench", 1);
    let mut point = || low + (high - low) * Vec3::new(random.unit(), random.unit(), random.unit());
    let mut rays = Vec::with_capacity(n);
    while rays.len() < n {
        let (a, b) = (point(), point());
        // Bounds that are a point have no chords; any direction will do.
        rays.push((a, (b - a).try_normalize().unwrap_or(Vec3::Y), f32::INFINITY));
    }
    rays
}

fn bounces(points: &[SurfacePoint], n: usize, seed: u64) -> Vec<(Vec3, Vec3, f32)> {
    let mut random = Rng::of_stream(seed, "bench", 2);
    let mut rays = Vec::with_capacity(n);
    while rays.len() < n {
        for point in points.iter().take(n - rays.len()) {
            let direction = random.cosine_direction(point.ng);
            rays.push((point.start(direction), direction, f32::INFINITY));
        }
    }
    random.shuffle(&mut rays);
    rays
}

/// Rays to points that the renderer would choose on the scene's lights; where no light reaches any of the points,
/// towards a dome over them.
fn towards_lights(prepared: &Prepared, points: &[SurfacePoint], n: usize, seed: u64) -> Vec<(Vec3, Vec3, f32)> {
    let mut random = Rng::of_stream(seed, "bench", 3);
    let mut rays = Vec::with_capacity(n);
    if !prepared.tables.lights.is_empty() {
        let mut samples = LightSamples::default();
        'passes: for _ in 0..PASSES {
            for points in points.chunks(POOL) {
                samples.choose(prepared, points, &mut random);
                for (i, point) in points.iter().enumerate() {
                    let (wi, end) = (samples.wi(i), samples.end(i));
                    if samples.valid[i] == 0 || wi.dot(point.ng) <= 0.0 {
                        continue;
                    }
                    let start = point.start(wi);
                    let distant = samples.distant[i] != 0;
                    rays.push(if distant { (start, wi, f32::INFINITY) } else { (start, end - start, 1.0) });
                    if rays.len() == n {
                        break 'passes;
                    }
                }
            }
        }
    }
    if rays.is_empty() {
        rays.extend((0..n).map(|i| {
            let point = points[i % points.len()];
            let direction = random.cosine_direction(point.ng);
            (point.start(direction), direction, f32::INFINITY)
        }));
    }
    rays
}

/// Points chosen on lights, one for each surface point of a chunk.
struct LightSamples {
    /// Surface points with their normals, then random numbers.
    from: [Vec<f32>; 3],
    normal: [Vec<f32>; 3],
    u: [Vec<f32>; 4],
    scratch: Vec<f32>,
    towards: [Vec<f32>; 3],
    end: [Vec<f32>; 3],
    valid: Vec<u32>,
    distant: Vec<u32>,
}

impl Default for LightSamples {
    fn default() -> Self {
        let three = || [0, 1, 2].map(|_| vec![0.0; POOL]);
        let (valid, distant) = (vec![0; POOL], vec![0; POOL]);
        let u = [0, 1, 2, 3].map(|_| vec![0.0; POOL]);
        let (from, normal, scratch) = (three(), three(), Vec::new());
        Self { from, normal, u, scratch, towards: three(), end: three(), valid, distant }
    }
}

impl LightSamples {
    fn choose(&mut self, prepared: &Prepared, points: &[SurfacePoint], random: &mut Rng) {
        for (i, point) in points.iter().enumerate() {
            for axis in 0..3 {
                self.from[axis][i] = point.p[axis];
                self.normal[axis][i] = point.ng[axis];
            }
            for u in &mut self.u {
                u[i] = random.unit();
            }
        }
        self.scratch.resize(prepared.tables.lights.scratch(), 0.0);
        dispatch_large(Level::best().without_portable(), Choose { prepared, samples: self });
    }

    fn wi(&self, i: usize) -> Vec3 {
        Vec3::new(self.towards[0][i], self.towards[1][i], self.towards[2][i])
    }

    fn end(&self, i: usize) -> Vec3 {
        Vec3::new(self.end[0][i], self.end[1][i], self.end[2][i])
    }
}

struct Choose<'a> {
    prepared: &'a Prepared,
    samples: &'a mut LightSamples,
}

impl Kernel for Choose<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let tables = &self.prepared.tables;
        let LightSamples { from, normal, u, scratch, towards, end, valid, distant } = self.samples;
        for at in (0..POOL).step_by(L::N) {
            let p = V3::<L>::new(L::F::load(&from[0], at), L::F::load(&from[1], at), L::F::load(&from[2], at));
            let n = V3::<L>::new(L::F::load(&normal[0], at), L::F::load(&normal[1], at), L::F::load(&normal[2], at));
            let u = [L::F::load(&u[0], at), L::F::load(&u[1], at), L::F::load(&u[2], at), L::F::load(&u[3], at)];
            let light =
                tables.lights.sample(&tables.lights.receiver::<L>(p, n), u, L::F::zero(), tables.sources(), scratch);
            light.wi.x.store(&mut towards[0], at);
            light.wi.y.store(&mut towards[1], at);
            light.wi.z.store(&mut towards[2], at);
            light.end.x.store(&mut end[0], at);
            light.end.y.store(&mut end[1], at);
            light.end.z.store(&mut end[2], at);
            let (is_valid, is_distant) = (light.valid.bits(), light.is_distant.bits());
            for lane in 0..L::N {
                valid[at + lane] = is_valid >> lane & 1;
                distant[at + lane] = is_distant >> lane & 1;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::linear::Linear;
    use crate::load::{LoadOptions, load};
    use crate::render::{self, AccelChoice, RenderSettings, build_accel, prepare_with};
    use std::path::Path;

    fn sets(seed: u64) -> (Geometry, Vec<RaySet>) {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell.gltf");
        let (scene, _) = load(&path, &LoadOptions::default()).unwrap();
        let settings = RenderSettings { accel: AccelChoice::Linear, ..RenderSettings::default() };
        let mut geometry = Geometry::default();
        let prepared = prepare_with(&scene, &settings, |all| {
            geometry = all.clone();
            build_accel(all, &settings)
        });
        let prepared = prepared.unwrap();
        let camera = render::camera(&scene, 0, &prepared, &settings);
        let sets = ray_sets(&prepared, &geometry, &camera, 3, seed).unwrap();
        (geometry, sets)
    }

    #[test]
    fn rays_of_all_kinds_are_what_they_are_said_to_be() {
        let (geometry, sets) = sets(1);
        assert_eq!(sets.iter().map(|set| set.kind).collect::<Vec<_>>(), Kind::ALL);
        let accel = Linear::new(geometry.clone());
        let [low, high] = geometry.bounds().unwrap();
        let mut hits = HitBatch::new(POOL);
        let mut share = |set: &RaySet| {
            let mut n = 0;
            for rays in &set.batches {
                accel.intersect(rays, 0..POOL, false, &mut hits);
                n += hits.primitive[..POOL].iter().filter(|&&p| p != crate::accel::MISS).count();
            }
            n as f64 / set.len() as f64
        };
        for set in &sets {
            assert_eq!((set.batches.len(), set.len()), (3, 3 * POOL));
        }
        let [primary, diffuse, shadow, incoherent] = &sets[..] else { panic!("four sets") };
        // Pixels of one batch are neighbours, 16 samples each; all rays start at the camera.
        let eye = origin(&primary.batches[0], 0);
        for rays in &primary.batches {
            for i in 1..POOL {
                assert_eq!(origin(rays, i), eye);
                let turned = direction(rays, i).dot(direction(rays, i - 1)).min(1.0).acos();
                let row_ends = i % (16 * TILE as usize) == 0;
                assert!(turned < 0.004 || row_ends, "{turned} rad from ray {i} to the next");
            }
        }
        // The box is open at the front: nearly all bounces hit. Lamp rays end at the lamp, so only boxes stop them.
        assert!(share(diffuse) > 0.7 && share(diffuse) < 1.0, "{}", share(diffuse));
        assert!(share(shadow) < 0.6, "{}", share(shadow));
        let endless = |rays: &RayBatch| {
            let mut rays = rays.clone();
            rays.t_max.fill(f32::INFINITY);
            rays
        };
        let on = RaySet { kind: Kind::Shadow, batches: shadow.batches.iter().map(endless).collect() };
        assert!(share(&on) > 0.999, "followed further they all hit, the lamp at last: {}", share(&on));
        assert!(shadow.batches.iter().all(|rays| rays.t_max[..POOL].iter().all(|&t| t == 1.0)));
        let inside = |p: Vec3| p.cmpge(low).all() && p.cmple(high).all();
        assert!((0..POOL).all(|i| inside(origin(&incoherent.batches[0], i))));
        // A bounce does not hit where it starts.
        accel.intersect(&diffuse.batches[0], 0..POOL, false, &mut hits);
        let near = (0..POOL).filter(|&i| hits.t[i] < 1e-5).count();
        assert!(near <= 2, "{near} bounces hit at once");
    }

    #[test]
    fn rays_depend_on_the_seed_alone() {
        let numbers = |seed: u64| -> Vec<u32> {
            let all = sets(seed).1;
            all.iter().flat_map(|set| set.batches[2].dx[..POOL].iter().map(|x| x.to_bits())).collect()
        };
        let first = numbers(1);
        assert!(first == numbers(1));
        let other = numbers(2);
        for (kind, (a, b)) in Kind::ALL.iter().zip(first.chunks(POOL).zip(other.chunks(POOL))) {
            assert!(a != b, "{}", kind.name());
        }
    }

    #[test]
    fn some_rays_are_spread_over_all_of_them() {
        let batches: Vec<_> = (0..3)
            .map(|b| {
                let mut rays = RayBatch::new(POOL);
                (0..POOL).for_each(|i| rays.set(i, Vec3::splat((b * POOL + i) as f32), Vec3::X, 1.0));
                rays
            })
            .collect();
        let some = RaySet { kind: Kind::Diffuse, batches }.some(6);
        assert_eq!(some.ox[..6], [0.0, 1024.0, 2048.0, 3072.0, 4096.0, 5120.0]);
    }
}

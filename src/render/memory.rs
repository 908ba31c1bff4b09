//! What a picture takes of memory, known before it is allocated: by part, from the scene and the settings.
//!
//! The constants are the sizes of the types they stand for, or measured where they are another library's;
//! `examples/memory.rs` holds the sum against what a process took at most.

use super::moving::most_keys;
use super::placing::Placing;
use super::tracer::window;
use super::{AccelChoice, DefaultLight, RenderSettings};
use crate::accel::front::{MOST, MOST_TWICE};
use crate::accel::geometry::{Affine, Placement};
use crate::accel::wide::{MOST_SPLITS, may_split};
use crate::film::blocks;
use crate::light::{element::LampTriangle, studio};
use crate::scene::{Instance, PlacedShape, Scene};
use crate::shape::Mesh;
use crate::shape::exact::table::PlacedShape as PlacedExact;
use crate::shape::placement::PlacementTable;
use crate::texture::Texels;
use glam::Vec3;
use serde::Serialize;
use std::sync::{Arc, OnceLock};

/// Bytes by what they are for. A part that is not known yet is 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct MemoryEstimate {
    /// The program itself with its libraries and threads.
    pub program: u64,
    /// At most while the input is read: its scene and what reading it takes.
    pub loading: u64,
    /// What the allocator keeps of that when the input has been read: many small pieces leave holes.
    pub left_over: u64,
    /// The scene as described: meshes and decoded images.
    pub scene: u64,
    /// What shading and rays read while the picture is traced: triangle records, texels, lights, the BVH.
    pub prepared: u64,
    /// Beyond that while it is built.
    pub building: u64,
    /// The block sums of every pixel, and their mean.
    pub film: u64,
    /// The finished picture and its encoded files: when the film is gone.
    pub files: u64,
}

impl MemoryEstimate {
    /// At most while the picture is made, beyond its scene.
    pub fn rendering(&self) -> u64 {
        self.prepared.saturating_add(self.building.max(self.film).max(self.files))
    }

    /// At most at any time.
    pub fn peak(&self) -> u64 {
        let rendering = self.left_over.saturating_add(self.scene).saturating_add(self.rendering());
        self.program.saturating_add(rendering.max(self.loading))
    }

    /// The parts that are there at once when most is used, by name: they add up to [`MemoryEstimate::peak`].
    pub fn at_peak(&self) -> Vec<(&'static str, u64)> {
        let [program, loading, left_over, scene, prepared, building, film, files] = self.parts();
        if program.1.saturating_add(loading.1) == self.peak() {
            return vec![program, loading];
        }
        let passing = [building, film, files].into_iter().max_by_key(|(_, bytes)| *bytes).unwrap_or(film);
        vec![program, left_over, scene, prepared, passing]
    }

    /// Every part by name.
    pub fn parts(&self) -> [(&'static str, u64); 8] {
        [
            ("program", self.program),
            ("loading", self.loading),
            ("left over", self.left_over),
            ("scene", self.scene),
            ("prepared", self.prepared),
            ("building", self.building),
            ("film", self.film),
            ("files", self.files),
        ]
    }
}

/// Which files are encoded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Encoded {
    /// The EXR.
    pub exr: bool,
    /// The PNG.
    pub png: bool,
}

/// The program with the threads that read and write beside rendering; Embree with its TBB, once opened. Measured.
const PROGRAM: u64 = 14 << 20;
const EMBREE_LIBRARY: u64 = 7 << 20;
/// A thread with its paths (`integrator::pool`, about 200 bytes a path) and its stack as far as used.
const THREAD: u64 = 1 << 20;

/// Cores this process may use; asked once, as the answer takes reading half a dozen of the system's files.
pub fn cores() -> usize {
    static CORES: OnceLock<usize> = OnceLock::new();
    *CORES.get_or_init(|| std::thread::available_parallelism().map_or(1, Into::into))
}

/// What a picture takes that depends on its size alone: everything that can be known before the input is read.
pub fn of_picture(settings: &RenderSettings, files: Encoded) -> MemoryEstimate {
    let window = window(settings);
    let pixels = u64::from(window.width).saturating_mul(u64::from(window.height));
    let threads = settings.threads.unwrap_or_else(cores) as u64;
    // Four f32 a block, and 3 f32 of the mean; a hundredth for what the allocator needs.
    let is_open = settings.stopping.is_open();
    let held = if is_open { blocks::MOST.min(settings.spp) } else { blocks::layout(settings.spp).len() as u32 };
    let layers = settings.layers.bytes();
    // How samples are spread: noise and cost of each pixel while it is decided.
    let may_spread = settings.adaptive && settings.stopping.target_error.is_some();
    let spread = if may_spread { 24 } else { 0 };
    let film = pixels.saturating_mul(16 * u64::from(held) + 12 + spread + layers);
    let film = film.saturating_add(film / 100);
    let embree =
        if settings.accel == AccelChoice::Auto || settings.accel == AccelChoice::Embree { EMBREE_LIBRARY } else { 0 };
    // 3 f32 a pixel; EXR: 4 f32 a pixel, with layers planar before that; PNG: 3 bytes a pixel and, compressed, no more
    // again.
    let planar = if layers > 0 { 16 + 2 * layers } else { 0 };
    let files = 12 + layers + if files.exr { 16 + planar } else { 0 } + if files.png { 6 } else { 0 };
    MemoryEstimate {
        program: PROGRAM + embree + threads * THREAD,
        film,
        files: pixels.saturating_mul(files),
        ..MemoryEstimate::default()
    }
}

/// What the picture of `scene` takes, all parts but `loading` and `left_over`. Nothing large is allocated to find out.
pub fn estimate(scene: &Scene, settings: &RenderSettings, files: Encoded) -> MemoryEstimate {
    let mut of_picture = of_picture(settings, files);
    if settings.accel == AccelChoice::Auto && scene.triangle_count() <= MOST && scene.shapes.is_empty() {
        of_picture.program -= EMBREE_LIBRARY;
    }
    let Machinery { held, building } = Machinery::of(scene, settings);
    MemoryEstimate { scene: scene_bytes(scene), prepared: held, building, ..of_picture }
}

/// What a scene holds, bytes.
pub fn scene_bytes(scene: &Scene) -> u64 {
    let meshes: u64 = scene.meshes.iter().map(|mesh| mesh_bytes(mesh)).sum();
    let images: u64 = scene.images.iter().map(|image| texel_bytes(&image.texels)).sum();
    let names: usize = scene.instances.iter().map(|instance| instance.name.len()).sum();
    let instances = size_of::<Instance>() * scene.instances.len() + names;
    let environment = scene.environment.as_ref().map_or(0, |e| size_of_val(&*e.radiance));
    let of_shape = |placed: &PlacedShape| size_of::<PlacedShape>() + placed.name.len() + shape_bytes(placed);
    let shapes: usize = scene.shapes.iter().map(of_shape).sum();
    meshes + images + (instances + environment + shapes) as u64
}

/// A shape that several places share is counted in part at each.
fn shape_bytes(placed: &PlacedShape) -> usize {
    placed.shape.bytes() / Arc::strong_count(&placed.shape).max(1)
}

/// What a mesh holds, bytes.
fn mesh_bytes(mesh: &Mesh) -> u64 {
    let normals = mesh.normals.as_ref().map_or(0, |n| size_of_val(&**n));
    let uvs: usize = mesh.uv_sets.iter().map(|set| size_of_val(&**set)).sum();
    let colors = mesh.colors.as_ref().map_or(0, |c| size_of_val(&**c));
    let tangents = mesh.tangents.as_ref().map_or(0, |t| size_of_val(&**t));
    (size_of_val(&*mesh.positions) + normals + uvs + colors + tangents + size_of_val(&*mesh.indices)) as u64
}

/// What decoded pixels hold, bytes.
pub fn texel_bytes(texels: &Texels) -> u64 {
    let bytes = match texels {
        Texels::Rgba8(texels) => size_of_val(&**texels),
        Texels::Rgba16(texels) => size_of_val(&**texels),
        Texels::Few8(few) => size_of_val(&*few.values),
        Texels::Few16(few) => size_of_val(&*few.values),
    };
    bytes as u64
}

/// What `render::prepare` makes of a scene, bytes.
struct Machinery {
    /// As long as the picture is traced.
    held: u64,
    /// Beyond that while it is built.
    building: u64,
}

/// A triangle's records in `shape::table`.
const TRIANGLE: u64 = 64;
/// Its attributes there: normals and coordinates; colours; each further set of coordinates; tangents.
const ATTRIBUTES: u64 = 64;
const COLORS: u64 = 48;
const MORE_UVS: u64 = 32;
const TANGENTS: u64 = 48;
/// An exact shape where it is: its maps, what backends keep of it, its boxes in two trees at most.
const SHAPE: u64 = (size_of::<PlacedExact>() + size_of::<glam::DAffine3>()) as u64 + 2 * 160;
/// A placement in `shape::placement`.
const PLACEMENT: u64 = PlacementTable::BYTES as u64;
/// As it is handed to the backend, with its list of one matrix, as the allocator rounds it.
const PLACEMENT_BUILDING: u64 = (size_of::<Placement>() + size_of::<Affine>() + 16) as u64;
/// An instance while it is decided what is placed.
const INSTANCE_CONSIDERED: u64 = 16;
/// An element in `light::table` (five records, the end of its share), and what is held of a light beside: two nodes
/// of a tree and a record. Meshes of parts that do not touch are several lights; that is not asked here.
const LIGHT: u64 = 5 * 16 + 4;
const CHOICE: u64 = 2 * 32 + 16;
/// A texel of an environment: record and the end of its share.
const ENVIRONMENT_TEXEL: u64 = 16 + 4;
/// A texel of the map that it was made from, which stays.
const MAP_TEXEL: u64 = 12;
/// A triangle whose vertices move, a key: what shading reads of it, and its share of a segment's tree.
const MOVING_TRIANGLE: u64 = 9 * 16 + 128;
/// A key of a map that moves: for shading and for rays.
const MOVING_KEY: u64 = 2 * 48;

impl Machinery {
    fn of(scene: &Scene, settings: &RenderSettings) -> Self {
        let emits: Vec<bool> =
            (scene.materials.iter()).map(|m| !m.unlit && m.emission.factor.iter().any(|&e| e > 0.0)).collect();
        let (mut vertices, mut triangles, mut lights, mut records, mut largest) = (0_u64, 0_u64, 0_u64, 0_u64, 0_u64);
        let mut choices = 0_u64;
        let placing = Placing::of_scene(scene);
        let placed = placing.things.iter().flat_map(|thing| &thing.meshes);
        for mesh in placing.held(scene).map(|instance| &instance.mesh).chain(placed) {
            let mesh = &scene.meshes[mesh.index()];
            let n = mesh.indices.len() as u64;
            vertices += mesh.positions.len() as u64;
            triangles += n;
            largest = largest.max(mesh.positions.len() as u64);
            records += n * bytes_per_triangle(mesh);
            if emits.get(mesh.material.index()) == Some(&true) {
                lights += n;
                choices += 1;
            }
        }
        let shapes = scene.shapes.len() as u64;
        records += shapes * (TRIANGLE + SHAPE);
        for shape in &scene.shapes {
            if emits.get(shape.material.index()) == Some(&true) {
                lights += 1;
                choices += 1;
            }
        }
        lights += scene.lights.len() as u64;
        choices += scene.lights.len() as u64;
        let texels: u64 = scene.images.iter().map(|image| texel_bytes(&image.texels)).sum();
        let levels = Levels::of(scene, settings);
        let environment = match &scene.environment {
            Some(own) => own.radiance.len() as u64 * (ENVIRONMENT_TEXEL + MAP_TEXEL),
            None if settings.default_light == DefaultLight::Off => 0,
            None => u64::from(studio::SIZE[0] * studio::SIZE[1]) * ENVIRONMENT_TEXEL,
        };
        let geometry = 12 * (vertices + triangles);
        let placements = placing.placements() as u64;
        let most_splits = if settings.accel == AccelChoice::Bvh && may_split(merged_triangles(scene, &placing)) {
            (triangles as f64 * MOST_SPLITS) as u64
        } else {
            0
        };
        let accel = accel(vertices, [triangles, most_splits], placements, settings.accel);
        let list = lights * (size_of::<LampTriangle>() as u64 + 72 + 8);
        Self {
            held: records
                + texels
                + levels.held
                + environment
                + lights * LIGHT
                + choices * CHOICE
                + placements * PLACEMENT
                + moving(scene, &placing)
                + accel.held,
            building: geometry
                + levels.building
                + (12 * largest).max(list)
                + scene.instances.len() as u64 * INSTANCE_CONSIDERED
                + placements * PLACEMENT_BUILDING
                + accel.building,
        }
    }
}

/// What is held of things that move, beyond what they took at rest, bytes.
fn moving(scene: &Scene, placing: &Placing) -> u64 {
    let keys = most_keys(scene, &placing.deformed) as u64;
    let deformed = placing.deformed.iter().map(|&i| {
        let mesh = &scene.meshes[scene.instances[i as usize].mesh.index()];
        let (vertices, triangles) = (mesh.positions.len() as u64, mesh.indices.len() as u64);
        keys * (12 * vertices + MOVING_TRIANGLE * triangles)
    });
    let maps = scene.motion.instances.values().map(|later| (1 + later.len() as u64) * MOVING_KEY);
    deformed.chain(maps).sum()
}

/// What levels of detail take, bytes.
struct Levels {
    held: u64,
    /// Beyond that while they are made.
    building: u64,
}

impl Levels {
    /// As if each image were read in one way only; one that is read both as colour and as numbers has its levels twice.
    fn of(scene: &Scene, settings: &RenderSettings) -> Self {
        if !settings.texture_lod {
            return Self { held: 0, building: 0 };
        }
        let bytes = texel_bytes;
        let held = scene.images.iter().map(|i| bytes(&i.texels).div_ceil(3)).sum();
        let largest = scene.images.iter().map(|i| 5 * i.texels.len() as u64 + bytes(&i.texels).div_ceil(3)).max();
        // The means of a level and of the one below it, 16 bytes each texel, and that level as it is kept.
        Self { held, building: largest.unwrap_or(0) }
    }
}

/// The corners of what is merged into the world, metres.
fn merged_triangles<'a>(scene: &'a Scene, placing: &'a Placing) -> impl Iterator<Item = [Vec3; 3]> + 'a {
    let merged = scene.instances.iter().zip(&placing.is_merged).filter(|(_, is_merged)| **is_merged);
    merged.flat_map(|(instance, _)| {
        let (mesh, place) = (&scene.meshes[instance.mesh.index()], instance.world_from_object);
        let corner =
            move |v: u32| place.transform_point3(Vec3::from_array(mesh.positions[v as usize]).as_dvec3()).as_vec3();
        mesh.indices.iter().map(move |triangle| triangle.map(corner))
    })
}

/// What the triangle table holds a triangle of `mesh`.
fn bytes_per_triangle(mesh: &Mesh) -> u64 {
    let has_attributes = mesh.normals.is_some() || !mesh.uv_sets.is_empty() || mesh.colors.is_some();
    let more = mesh.uv_sets.len().saturating_sub(1) as u64;
    TRIANGLE
        + if has_attributes { ATTRIBUTES + MORE_UVS * more } else { 0 }
        + if mesh.colors.is_some() { COLORS } else { 0 }
        + if mesh.tangents.is_some() { TANGENTS } else { 0 }
}

/// What a backend takes, bytes.
struct AccelBytes {
    held: u64,
    /// Beyond that while it is built.
    building: u64,
}

/// Of triangles, and of spatial splits of `bvh` beyond them at most.
fn accel(vertices: u64, [triangles, splits]: [u64; 2], placements: u64, choice: AccelChoice) -> AccelBytes {
    // With a front there are two trees; whether there is one shows only when the scene is prepared.
    let trees = if triangles + placements <= MOST_TWICE as u64 && choice != AccelChoice::Linear { 2 } else { 1 };
    let (vertices, triangles, placements) = (trees * vertices, trees * triangles, trees * placements);
    let references = triangles + trees * splits;
    let geometry = 12 * (vertices + triangles);
    match choice {
        // It keeps the placements as they were handed to it.
        AccelChoice::Linear => AccelBytes { held: geometry, building: 0 },
        AccelChoice::Bvh => AccelBytes {
            held: BVH.held * references + BVH_PLACEMENT.held * placements,
            building: BVH.building * references + BVH_PLACEMENT.building * placements,
        },
        AccelChoice::Auto | AccelChoice::Embree => AccelBytes {
            held: geometry + EMBREE.held * triangles + EMBREE_PLACEMENT.held * placements,
            building: EMBREE.building * triangles + EMBREE_PLACEMENT.building * placements,
        },
    }
}

/// Bytes a triangle of `accel::wide`: 40 in leaves and about 10 in nodes; while it is built a reference of 32, about one
/// binary node of 64, and 10 for the nodes once more. Measured: 50 and 90 to 112 on a terrain, a cave, a room and a soup.
/// Spatial splits count like triangles: where the triangles' boxes call for a trial of them, all that there may be are
/// counted. (Not those of placed objects, which are small, nor where `auto` falls back to `bvh`.)
const BVH: AccelBytes = AccelBytes { held: 52, building: 32 + 64 + 10 };
/// Bytes a triangle of Embree 4.4 (ROBUST, medium quality): 92 at most, measured on grids and a cave; the arrays that it
/// reads are counted beside.
const EMBREE: AccelBytes = AccelBytes { held: 80, building: 16 };
/// Bytes a placement of `accel::wide`: its inverse, its ids, and its share of the upper tree. A process with 10^6
/// placements took 571 bytes a placement at most beyond its scene, all told.
const BVH_PLACEMENT: AccelBytes = AccelBytes { held: 160, building: 200 };
/// Bytes a placement of an instance array of Embree 4.4: the matrix, and what is built over it. A process with 10^6
/// placements took 341 bytes a placement at most beyond its scene, all told.
const EMBREE_PLACEMENT: AccelBytes = AccelBytes { held: 140, building: 40 };

//! What reading a file will take of memory, by its JSON and the headers of its pictures: no mesh and no pixel is read.

use super::container;
use super::outline::{Accessor, Node, Outline, Primitive, Shape, Uri};
use super::slots::{needs_tangents, reads};
use super::uri::percent_decode;
use crate::image::decode::{MAX_PIXELS, MAX_SIDE};
use crate::image::header::{Header, header};
use crate::load::LoadOptions;
use crate::load::estimate::{LoadEstimate, Picture, pictures};
use crate::load::folders::Folders;
use crate::scene::{Instance, PlacedShape};
use crate::texture::Channels;
use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

/// JSON longer than this is not parsed for an estimate, which would take as long as loading it; its length tells enough.
const MOST_JSON: u64 = 64 << 20;
/// Bytes that a byte of JSON takes: the text, and what is parsed from it. Measured, 200,000 nodes of 70 bytes.
const JSON: u64 = 10;
/// Bytes a triangle while MikkTSpace makes tangents, and what the allocator keeps of them; measured.
const MIKKTSPACE: u64 = 450;
const MIKKTSPACE_LEFT: u64 = 80;
/// Bytes a vertex while a skin moves it: its matrix.
const SKIN: u64 = 128;
/// Bytes a vertex of each morph target: differences of three attributes.
const MORPH: u64 = 36;
/// Bytes a vertex that a skin moves: joints and weights of two sets.
const INFLUENCES: u64 = 48;

/// Bytes at most while `path` is read; `None` where the loader will refuse it, or where it cannot be told.
pub(in crate::load) fn estimate(path: &Path, options: &LoadOptions) -> Option<LoadEstimate> {
    let length = container::json_length(path)?;
    if length > MOST_JSON {
        let json = length.saturating_mul(JSON);
        return Some(LoadEstimate { bytes: json, left_over: json, unmoved: 0 });
    }
    let container = container::read(path).ok()?;
    let outline: Outline = serde_json::from_slice(&container.json).ok()?;
    let data: u64 =
        (outline.buffers.iter().filter_map(|b| b.uri.as_ref())).filter(|uri| uri.is_data()).map(|uri| uri.length).sum();
    let images: u64 =
        (outline.images.iter().filter_map(|i| i.uri.as_ref())).filter(|u| u.is_data()).map(|u| u.length).sum();
    // Text that is data is kept twice, and once decoded where it is read.
    let text = length.saturating_sub(data + images) * JSON;
    let json = text + 2 * (data + images) + data / 4 * 3;
    let folders = Folders::new(path, options.asset_root.as_deref()).ok()?;
    let bin = container.bin.map(|bin| (bin.start, bin.end - bin.start));
    let variant = options.variant.as_deref().and_then(|name| outline.variant(name));
    let mut survey = Survey { path, outline: &outline, folders, bin, variant, reached: Reached::default() };
    survey.nodes(options.scene.as_deref())?;
    let Reached { kept, passing, left_over, unmoved, images, .. } = std::mem::take(&mut survey.reached);
    let found: Vec<Picture> = images.iter().filter_map(|(&image, &used)| survey.picture(image, used)).collect();
    Some(LoadEstimate { bytes: json + kept + passing.max(pictures(&found)), left_over: text + left_over, unmoved })
}

/// Bytes of an instance's name: the smallest piece that the allocator gives out.
const NAME: u64 = 32;

/// What the scene was found to reach so far.
#[derive(Default)]
struct Reached {
    /// Bytes of meshes and instances.
    kept: u64,
    /// Most bytes at any time beyond those while one mesh is read.
    passing: u64,
    /// Bytes of vertices before anything moves them, and of what moves them.
    unmoved: u64,
    /// Bytes that the allocator keeps of those that pass.
    left_over: u64,
    /// Meshes in their poses.
    meshes: BTreeSet<(usize, Option<usize>, Vec<u32>)>,
    /// Images with the channels that are read of them.
    images: BTreeMap<usize, Channels>,
}

struct Survey<'o> {
    path: &'o Path,
    outline: &'o Outline,
    folders: Folders,
    /// First byte and length of the BIN chunk.
    bin: Option<(u64, u64)>,
    /// The place of the variant of materials that is shown.
    variant: Option<usize>,
    reached: Reached,
}

impl Survey<'_> {
    /// Looks at everything that the chosen scene reaches.
    fn nodes(&mut self, scene: Option<&str>) -> Option<()> {
        let mut stack = self.outline.roots(scene)?;
        let mut visited = vec![false; self.outline.nodes.len()];
        while let Some(index) = stack.pop() {
            let node = self.outline.nodes.get(index)?;
            if std::mem::replace(visited.get_mut(index)?, true) {
                return None;
            }
            self.node(node)?;
            stack.extend(&node.children);
        }
        Some(())
    }

    fn node(&mut self, node: &Node) -> Option<()> {
        let copies = match &node.extensions.instancing {
            None => 1,
            Some(instancing) => self.accessor(*instancing.attributes.values().next()?)?.count,
        };
        if let Some(shape) = &node.extensions.shape {
            return self.shape(shape, copies);
        }
        let Some(index) = node.mesh else { return Some(()) };
        let mesh = self.outline.meshes.get(index)?;
        let placed = copies.saturating_mul((size_of::<Instance>() as u64 + NAME) * mesh.primitives.len() as u64);
        self.reached.kept = self.reached.kept.saturating_add(placed);
        let pose = (index, node.skin, node.weights.iter().map(|w| w.to_bits()).collect());
        if self.reached.meshes.insert(pose) {
            for primitive in &mesh.primitives {
                self.primitive(primitive, node)?;
            }
        }
        Some(())
    }

    /// An exact shape in place of a mesh.
    fn shape(&mut self, shape: &Shape, copies: u64) -> Option<()> {
        let placed = copies.saturating_mul(size_of::<PlacedShape>() as u64 + NAME);
        // A segment has three points, and eight pieces with their boxes.
        let segments = shape.points.len() as u64 * 8 * 128;
        self.reached.kept = self.reached.kept.saturating_add(placed).saturating_add(segments);
        let Some(material) = shape.material else { return Some(()) };
        let material = self.outline.materials.get(material)?;
        for (read, channels) in reads(material) {
            if let Some(image) = self.outline.textures.get(read.index)?.image() {
                *self.reached.images.entry(image).or_insert(Channels::NONE) |= channels;
            }
        }
        Some(())
    }

    fn primitive(&mut self, primitive: &Primitive, node: &Node) -> Option<()> {
        let Some(&positions) = primitive.attributes.get("POSITION") else { return Some(()) };
        let n = self.accessor(positions)?.count;
        let corners = match primitive.indices {
            None => n,
            Some(indices) => self.accessor(indices)?.count,
        };
        let triangles = match primitive.mode {
            None | Some(4) => corners / 3,
            Some(5 | 6) => corners.saturating_sub(2),
            // Points and lines are not drawn.
            Some(_) => return Some(()),
        };
        let has = |name: &str| primitive.attributes.contains_key(name);
        let mut vertex = 12;
        let mut passing = 4 * corners;
        for (name, bytes) in [("NORMAL", 12), ("COLOR_0", 16)] {
            if let Some(&accessor) = primitive.attributes.get(name) {
                self.accessor(accessor)?;
                vertex += bytes;
            }
        }
        if let Some(material) = primitive.material_in(self.variant) {
            let material = self.outline.materials.get(material)?;
            let reads = reads(material);
            let sets: BTreeSet<u32> = reads.iter().map(|(read, _)| read.tex_coord).collect();
            let needs_tangents = needs_tangents(material);
            // Tangents may run along a set that no texture reads.
            vertex += 8 * (sets.len() as u64 + u64::from(needs_tangents));
            if needs_tangents && has("NORMAL") {
                vertex += 16;
            }
            // Tangents that are made part the vertices that do not share them.
            if needs_tangents && !has("TANGENT") {
                passing += triangles * MIKKTSPACE;
                self.reached.left_over = self.reached.left_over.max(triangles * MIKKTSPACE_LEFT);
            }
            for (read, channels) in reads {
                if let Some(image) = self.outline.textures.get(read.index)?.image() {
                    *self.reached.images.entry(image).or_insert(Channels::NONE) |= channels;
                }
            }
        }
        if node.skin.is_some() {
            passing += n * SKIN;
        }
        let kept = n.saturating_mul(vertex).saturating_add(triangles.saturating_mul(12));
        let targets = primitive.targets.len() as u64;
        if node.skin.is_some() || targets > 0 {
            let influences = if node.skin.is_some() { n * INFLUENCES } else { 0 };
            let unmoved = kept.saturating_add(influences).saturating_add(targets.saturating_mul(n * MORPH));
            passing = passing.saturating_add(unmoved);
            self.reached.unmoved = self.reached.unmoved.saturating_add(unmoved);
        }
        self.reached.kept = self.reached.kept.saturating_add(kept);
        self.reached.passing = self.reached.passing.max(passing);
        Some(())
    }

    /// An accessor whose elements are there; the loader refuses any other before it allocates anything for it.
    fn accessor(&self, index: usize) -> Option<&Accessor> {
        let accessor = self.outline.accessors.get(index)?;
        let Some(view) = accessor.buffer_view else {
            return (accessor.count <= super::accessor::MAX_ZEROS).then_some(accessor);
        };
        let view = self.outline.buffer_views.get(view)?;
        let needed = accessor.count.checked_mul(element_bytes(accessor)?)?;
        let there = view.byte_offset.checked_add(view.byte_length)? <= self.buffer(view.buffer)?.length;
        (needed <= view.byte_length && there).then_some(accessor)
    }

    fn buffer(&self, index: usize) -> Option<Bytes<'_>> {
        let buffer = self.outline.buffers.get(index)?;
        match (&buffer.uri, self.bin) {
            (Some(uri), _) => self.uri(uri),
            (None, Some((start, length))) => Some(Bytes { place: Place::File(self.path.to_owned(), start), length }),
            (None, None) => None,
        }
    }

    fn uri<'u>(&self, uri: &'u Uri) -> Option<Bytes<'u>> {
        if uri.is_data() {
            let payload = uri.start.find(',')? + 1;
            let length = (uri.length - payload as u64) / 4 * 3;
            return Some(Bytes { place: Place::Base64(uri.start.get(payload..)?), length });
        }
        let path = self.folders.confine(&percent_decode(&uri.start).ok()?).ok()?;
        let length = std::fs::metadata(&path).ok().filter(std::fs::Metadata::is_file)?.len();
        Some(Bytes { place: Place::File(path, 0), length })
    }

    /// An image by its header; `None` where it will be refused.
    fn picture(&self, index: usize, used: Channels) -> Option<Picture> {
        let image = self.outline.images.get(index)?;
        let (bytes, is_file) = match (image.buffer_view, &image.uri) {
            (Some(view), None) => {
                let view = self.outline.buffer_views.get(view)?;
                (self.buffer(view.buffer)?.part(view.byte_offset, view.byte_length), false)
            }
            (None, Some(uri)) => (self.uri(uri)?, !uri.is_data()),
            _ => return None,
        };
        let found = bytes.header()?;
        let pixels = u64::from(found.width) * u64::from(found.height);
        let is_allowed = found.width.max(found.height) <= MAX_SIDE && pixels <= MAX_PIXELS;
        is_allowed.then_some(Picture { header: found, encoded: bytes.length, waits: !is_file, used })
    }
}

/// Bytes of an element without padding.
fn element_bytes(accessor: &Accessor) -> Option<u64> {
    let component = match accessor.component_type {
        5120 | 5121 => 1,
        5122 | 5123 => 2,
        5125 | 5126 => 4,
        _ => return None,
    };
    let components = match accessor.shape.as_str() {
        "SCALAR" => 1,
        "VEC2" => 2,
        "VEC3" => 3,
        "VEC4" => 4,
        _ => return None,
    };
    Some(component * components)
}

/// Bytes that are somewhere.
struct Bytes<'u> {
    place: Place<'u>,
    length: u64,
}

enum Place<'u> {
    /// From a byte of a file on.
    File(PathBuf, u64),
    /// The beginning of base64.
    Base64(&'u str),
}

impl Bytes<'_> {
    /// The `length` bytes from `start` on, for a file; nothing of a data URI is a picture's.
    fn part(self, start: u64, length: u64) -> Self {
        let place = match self.place {
            Place::File(path, first) => Place::File(path, first + start),
            Place::Base64(text) => Place::Base64(text.get((start / 3 * 4) as usize..).unwrap_or_default()),
        };
        Self { place, length }
    }

    /// What they say as a picture.
    fn header(&self) -> Option<Header> {
        match &self.place {
            Place::File(path, first) => {
                let mut file = File::open(path).ok()?;
                header(&mut |at, into| {
                    file.seek(SeekFrom::Start(first + at)).ok()?;
                    file.read_exact(into).ok()
                })
            }
            Place::Base64(text) => {
                // Whole groups of four characters stand for three bytes each.
                let whole = text.len() / 4 * 4;
                let bytes = super::base64::decode(&text.as_bytes()[..whole]).ok()?;
                header(&mut |at, into| {
                    let at = usize::try_from(at).ok()?;
                    into.copy_from_slice(bytes.get(at..at.checked_add(into.len())?)?);
                    Some(())
                })
            }
        }
    }
}

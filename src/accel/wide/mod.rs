//! Our own 8-wide BVH: `bvh`, the fallback where there is no Embree.
//!
//! Triangles at rest: `build` makes a binary SAH tree of `reference`s of a `source`, divided where `bins` says, after
//! `split` has cut those that waste their boxes into parts, if that pays (`clip` is the geometry of that); `collapse`
//! merges it to nodes of up to 8 children and leaves of up to 8 triangles (`node` is the memory layout). Whatever else
//! there is - placed objects, exact shapes (`special`), `moving` triangles - is a box of a second tree; in a placed object
//! its nodes lie behind those of the first and lead to it.
//!
//! `queries` sends a batch through `packet`s, as far as its rays belong together, and the others one by one through
//! `traverse`, which `feed` gives them to: first through the world's triangles at rest, then through the rest. `ray` tests
//! boxes, `leaf` triangles.

mod bins;
mod build;
mod clip;
mod collapse;
mod feed;
mod leaf;
mod moving;
mod node;
mod packet;
mod queries;
mod ray;
mod reference;
mod sort;
mod source;
mod special;
mod split;
mod traverse;
mod validate;

use super::geometry::{Geometry, HitFilter, Object, Part, Placement, Shape};
use super::{Accel, AccelStats, HitBatch, RayBatch};
use glam::Vec3;
use moving::Moving;
use node::{Child, Leaves, Node, WIDTH};
use simd::Level;
use source::Source;
use special::{Placed, Special};
pub use split::{MOST_SPLITS, SpatialSplits, may_split};
use std::collections::VecDeque;
use std::ops::Range;
use std::sync::Arc;

/// Entries of a traversal's stack, a power of two. A node adds at most 7 more than it takes, and a ray is in at most three
/// trees: over the world's specials, the world's triangles or a placed object's specials, and its triangles.
const STACK: usize = 2048;
const _: () = assert!(3 * build::MAX_DEPTH as usize * (WIDTH - 1) < STACK && STACK.is_power_of_two());

/// Nodes near the root: 512 KB, a part of a core's cache.
const NEAR: usize = 2048;

/// Bytes of a tree up to which waiting for memory is not worth following several rays at once: 300 000 triangles or so.
const CACHED: usize = 16 << 20;

/// A tree over all triangles of one object but those of zero area, or over boxes.
#[derive(Clone, Debug)]
struct Tree {
    nodes: Vec<Node>,
    leaves: Leaves,
    /// Nodes from the root to the deepest leaf.
    depth: usize,
    /// Low and high corner of everything.
    bounds: [[f32; 3]; 2],
    /// Entries in leaves beyond one for each triangle.
    splits: usize,
}

impl Tree {
    /// The tree over `triangles`.
    fn of_triangles(triangles: &Source<'_>, splits: SpatialSplits) -> Self {
        Self::new(&build::BinaryTree::build(triangles, splits), Some(triangles))
    }

    /// The tree over `boxes` (low and high corner): each is a child of its own, [`node::Child::special`] of its index.
    /// Boxes that are `None`, empty or NaN are left out.
    fn of_boxes(boxes: &[Option<[glam::Vec3; 2]>]) -> Self {
        Self::new(&build::BinaryTree::of_boxes(boxes), None)
    }

    fn new(tree: &build::BinaryTree, triangles: Option<&Source<'_>>) -> Self {
        let bounds = tree.root.as_ref().map_or([[0.0; 3]; 2], |root| root.root().node().corners);
        let collapse::Collapsed { nodes, leaves, depth } = collapse::collapse(tree, triangles);
        assert!(depth <= build::MAX_DEPTH as usize, "the traversal's stack has room for this depth");
        let mut tree = Self { nodes, leaves, depth, bounds, splits: tree.splits };
        tree.mark_near();
        tree
    }

    /// Marks the nodes next to the root, breadth first.
    fn mark_near(&mut self) {
        let mut queue = VecDeque::from([0]);
        let mut left = NEAR;
        while let Some(at) = queue.pop_front() {
            let node: &mut Node = &mut self.nodes[at];
            for lane in 0..node.count() {
                let child = node.child(lane);
                if !child.is_inner() {
                    continue;
                }
                if left == 0 {
                    return;
                }
                left -= 1;
                node.replace(lane, child.near());
                queue.push_back(child.node());
            }
        }
    }

    /// Appends the nodes of `top`, a tree over boxes, whose special `triangles` becomes this tree's root; returns the new
    /// root.
    fn put_below(&mut self, top: Self, triangles: usize) -> Child {
        let first = self.nodes.len();
        self.nodes.extend(top.nodes);
        for node in &mut self.nodes[first..] {
            for lane in 0..node.count() {
                let child = node.child(lane);
                if child.is_special() && child.index() == triangles {
                    node.replace(lane, Child::inner(0).near());
                } else if child.is_inner() {
                    let moved = Child::inner(child.node() + first);
                    node.replace(lane, if child.is_far() { moved } else { moved.near() });
                }
            }
        }
        self.depth += top.depth;
        self.bounds = top.bounds;
        Child::inner(first).near()
    }

    /// Bytes held.
    fn bytes(&self) -> usize {
        size_of_val(&*self.nodes) + size_of_val(&*self.leaves.data)
    }
}

/// A space with all that is in it.
#[derive(Clone)]
struct Space {
    /// Over the triangles at rest; where there are specials, its nodes are followed by those of a tree over them, in which
    /// the triangles' root is an inner node.
    tree: Tree,
    /// Where rays start.
    root: Child,
    specials: Vec<Special>,
    shapes: Vec<(Arc<dyn Shape>, u32)>,
    moving: Vec<Moving>,
}

impl Space {
    /// `placed` are the boxes of what is placed in it.
    fn new(object: Object, placed: impl IntoIterator<Item = Option<[Vec3; 2]>>, splits: SpatialSplits) -> Self {
        let Object { parts, shapes } = object;
        let (still, moving): (Vec<Part>, Vec<Part>) = parts.into_iter().partition(|part| part.later.is_empty());
        let mut tree = Tree::of_triangles(&Source::new(&still), splits);
        drop(still);
        let moving: Vec<Moving> = moving.into_iter().map(Moving::new).collect();
        let (mut specials, mut boxes) = (Vec::new(), Vec::new());
        for (i, bounds) in placed.into_iter().enumerate() {
            specials.push(Special::Placed(i as u32));
            boxes.push(bounds);
        }
        for (i, (shape, _)) in shapes.iter().enumerate() {
            specials.push(Special::Shape(i as u32));
            boxes.push(Some(shape.bounds().map(Vec3::from_array)));
        }
        for (i, moving) in moving.iter().enumerate() {
            specials.push(Special::Moving(i as u32));
            boxes.push(moving.bounds());
        }
        let mut root = Child::inner(0).near();
        if !specials.is_empty() {
            let has_triangles = tree.nodes[0].count() > 0;
            boxes.push(has_triangles.then_some(tree.bounds.map(Vec3::from_array)));
            root = tree.put_below(Tree::of_boxes(&boxes), specials.len());
        }
        Self { tree, root, specials, shapes, moving }
    }

    /// Whether no ray can hit anything.
    fn is_empty(&self) -> bool {
        self.tree.nodes[self.root.node()].count() == 0
    }

    /// Low and high corner of everything.
    fn bounds(&self) -> Option<[Vec3; 2]> {
        (!self.is_empty()).then_some(self.tree.bounds.map(Vec3::from_array))
    }

    fn bytes(&self) -> usize {
        let moving: usize = self.moving.iter().map(Moving::bytes).sum();
        self.tree.bytes() + moving + size_of_val(&*self.specials)
    }
}

/// The backend.
#[derive(Clone)]
pub struct WideBvh {
    /// The world's triangles at rest.
    world: Space,
    /// What else is in the world, if anything. Rays meet it after the triangles, as far as it is nearer than their hits:
    /// in packets, 5 times as fast for camera rays as one tree over everything, and without a tree on top.
    others: Option<Space>,
    objects: Vec<Space>,
    /// The placements, in their order; one that cannot be met stands for one without an inverse.
    placed: Vec<Placed>,
    /// For single rays: 8 lanes.
    level: Level,
    /// For packets: any.
    packet_level: Level,
    /// Whether several single rays are under way at once, to wait for memory together.
    interleaves: bool,
    /// Decides about hits on filtered triangles.
    filter: Option<Arc<dyn HitFilter>>,
}

impl WideBvh {
    /// Builds with the threads of rayon's current pool; the tree does not depend on how many they are.
    pub fn build(geometry: impl Into<Geometry>) -> Self {
        Self::with_level(geometry, Level::best())
    }

    /// As [`WideBvh::build`], traced at `level`: camera rays in packets of its lanes, single rays at the nearest level
    /// that has 8 lanes. All levels find the same hits.
    ///
    /// # Panics
    /// When this CPU does not have the level.
    pub fn with_level(geometry: impl Into<Geometry>, level: Level) -> Self {
        Self::with_splits(geometry, level, SpatialSplits::Auto)
    }

    /// As [`WideBvh::with_level`], with spatial splits as wanted. They change no hit.
    ///
    /// # Panics
    /// When this CPU does not have the level.
    pub fn with_splits(geometry: impl Into<Geometry>, level: Level, splits: SpatialSplits) -> Self {
        let geometry = geometry.into();
        // AVX-512 gives single rays nothing: in Embree 4.4 AVX2 is as fast or up to 1.14 times faster.
        let packet_level = level;
        let level = match level {
            Level::Avx512 => Level::Avx2,
            Level::Scalar => Level::Portable8,
            level => level,
        };
        assert!(packet_level.is_available(), "this CPU has no {}", packet_level.name());
        let Geometry { world, objects, placements, filter } = geometry;
        let objects: Vec<Space> = objects.into_iter().map(|object| Space::new(object, [], splits)).collect();
        let bounds: Vec<_> = objects.iter().map(Space::bounds).collect();
        let placed_bounds = |p: &Placement| Some(p.bounds(bounds[p.object as usize]?));
        let boxes: Vec<_> = placements.iter().map(|p| placed_bounds(p).filter(|_| p.is_usable())).collect();
        let Object { parts, shapes } = world;
        let (still, moving): (Vec<Part>, Vec<Part>) = parts.into_iter().partition(|part| part.later.is_empty());
        let world = Space::new(Object { parts: still, shapes: Vec::new() }, [], splits);
        let others = !(placements.is_empty() && shapes.is_empty() && moving.is_empty());
        let others = others.then(|| Space::new(Object { parts: moving, shapes }, boxes, splits));
        let placed = placements.iter().map(Placed::new).collect();
        let interleaves = world.tree.bytes() > CACHED;
        Self { world, others, objects, placed, level, packet_level, interleaves, filter }
    }

    /// The same with several single rays under way at once, as in a large tree. It changes no hit.
    pub fn interleaved(self) -> Self {
        Self { interleaves: true, ..self }
    }

    /// What is wrong with the tree over `geometry`, if anything: for tests.
    pub fn validate(&self, geometry: impl Into<Geometry>) -> Result<(), String> {
        validate::validate(&self.world.tree, &Source::new(&geometry.into().world.parts))
    }

    /// Bytes held.
    fn bytes(&self) -> usize {
        let objects: usize = self.objects.iter().map(Space::bytes).sum();
        self.worlds().map(Space::bytes).sum::<usize>() + objects + size_of_val(&*self.placed)
    }

    /// Both spaces of the world.
    fn worlds(&self) -> impl Iterator<Item = &Space> {
        self.others.iter().chain([&self.world])
    }

    /// A hash of everything in the tree, for tests of determinism.
    pub fn fingerprint(&self) -> u64 {
        // FNV-1a, 32 bits at a time.
        let mix = |hash: u64, word: u32| (hash ^ u64::from(word)).wrapping_mul(0x0000_0100_0000_01b3);
        let trees = || self.objects.iter().chain(self.worlds()).map(|space| &space.tree);
        let nodes = || trees().flat_map(|tree| &tree.nodes);
        let planes = nodes().flat_map(|node| node.planes.iter().map(|plane| plane.to_bits()));
        let children = nodes().flat_map(|node| node.children.iter().copied().chain(node.order));
        let leaves = trees().flat_map(|tree| tree.leaves.data.iter().map(|word| word.to_bits()));
        planes.chain(children).chain(leaves).fold(0xcbf2_9ce4_8422_2325, mix)
    }
}

impl Accel for WideBvh {
    fn intersect(&self, rays: &RayBatch, range: Range<usize>, coherent: bool, hits: &mut HitBatch) {
        queries::intersect(self, rays, range, coherent, hits);
    }

    fn occluded(&self, rays: &RayBatch, n: usize, occluded: &mut [u8]) {
        queries::occluded(self, rays, n, occluded);
    }

    fn stats(&self) -> AccelStats {
        AccelStats {
            name: "bvh",
            version: String::new(),
            isa: self.packet_level.name().into(),
            bytes: self.bytes(),
            front: 0,
            splits: self.objects.iter().chain(self.worlds()).map(|space| space.tree.splits).sum(),
        }
    }
}

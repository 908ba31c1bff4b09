//! The memory layout: 8-wide nodes of 256 bytes and leaves of up to 8 triangles.

/// Children per node, and triangles per leaf at most.
pub const WIDTH: usize = 8;

/// Rows of a leaf: three corners of three coordinates, then the triangles' indices.
pub const LEAF_ROWS: usize = 10;

/// Where the number of lanes in use begins in the first entry of the order.
const COUNT_SHIFT: u32 = 24;

/// Set in a leaf's primitive number where the geometry's filter decides about hits.
pub const FILTERED: u32 = 1 << 31;

/// A node: the boxes of its children, as rows, and where they are. Four cache lines, nothing quantised: decoding 8-bit
/// boxes at every node halves the speed of incoherent rays on a CPU.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct Node {
    /// Six rows of 8: x low, y low, z low, x high, y high, z high. Unused lanes have low > high.
    pub planes: [f32; 6 * WIDTH],
    /// What each lane is, the bits of a [`Child`]. Lanes in use come first.
    pub children: [u32; WIDTH],
    /// In which order rays visit the lanes. Entry i, bits 3 o to 3 o + 2: the lane that is the i-th farthest for rays of
    /// octant o (bit k: downwards along axis k). Entry 0, bits 24 and up: lanes in use.
    pub order: [u32; WIDTH],
}

const _: () = assert!(size_of::<Node>() == 256);

impl Node {
    /// No children. Its lanes lead to the leaf `nothing`, should a ray with an overflowing direction enter one.
    pub const EMPTY: Self = {
        let mut planes = [f32::INFINITY; 6 * WIDTH];
        let mut i = 3 * WIDTH;
        while i < planes.len() {
            planes[i] = f32::NEG_INFINITY;
            i += 1;
        }
        Self { planes, children: [Child::leaf(0, 1).bits(); WIDTH], order: [0; WIDTH] }
    };

    /// The same where all nodes below it are `by` nodes farther on.
    pub fn moved(&self, by: usize) -> Self {
        let mut node = *self;
        for lane in 0..node.count() {
            let child = node.child(lane);
            if child.is_inner() {
                node.replace(lane, Child::inner(child.node() + by));
            }
        }
        node
    }

    /// Adds a child.
    pub fn push(&mut self, low: [f32; 3], high: [f32; 3], child: Child) {
        let lane = self.count();
        for axis in 0..3 {
            self.planes[axis * WIDTH + lane] = low[axis];
            self.planes[(axis + 3) * WIDTH + lane] = high[axis];
        }
        self.children[lane] = child.bits();
        self.order[0] += 1 << COUNT_SHIFT;
    }

    /// Puts `child` in place of what lane `i` is.
    pub fn replace(&mut self, i: usize, child: Child) {
        self.children[i] = child.bits();
    }

    /// Low and high corner of all boxes.
    pub fn bounds(&self) -> [[f32; 3]; 2] {
        let row = |row: usize| &self.planes[row * WIDTH..][..self.count()];
        [
            [0, 1, 2].map(|axis| row(axis).iter().copied().fold(f32::INFINITY, f32::min)),
            [3, 4, 5].map(|axis| row(axis).iter().copied().fold(f32::NEG_INFINITY, f32::max)),
        ]
    }

    /// Lanes in use.
    #[inline(always)]
    pub fn count(&self) -> usize {
        (self.order[0] >> COUNT_SHIFT) as usize % (WIDTH + 1)
    }

    /// What lane `i` is.
    #[inline(always)]
    pub fn child(&self, i: usize) -> Child {
        Child(self.children[i])
    }

    /// Fills in `order`, when all children are there: by the boxes' centres along the octant's diagonal.
    pub fn sort(&mut self) {
        let count = self.count();
        let mut order = [(count as u32) << COUNT_SHIFT, 0, 0, 0, 0, 0, 0, 0];
        for octant in 0..8 {
            let key = |lane: usize| {
                let along = |axis: usize| {
                    let twice = self.planes[axis * WIDTH + lane] + self.planes[(axis + 3) * WIDTH + lane];
                    if octant >> axis & 1 == 1 { -twice } else { twice }
                };
                if lane < count { along(0) + along(1) + along(2) } else { f32::INFINITY }
            };
            let mut lanes = [0, 1, 2, 3, 4, 5, 6, 7];
            lanes.sort_by(|&a, &b| key(b).total_cmp(&key(a)));
            for (word, lane) in order.iter_mut().zip(lanes) {
                *word |= (lane as u32) << (3 * octant);
            }
        }
        self.order = order;
    }
}

/// Where a child is. Inner: index of a node in bits 0 to 28, bit 29 set if it is near the root, bits 30 and 31 clear. Special: bit 31 clear, bit 30 set, index of a box in
/// bits 0 to 29. Leaf: bit 31 set, triangles - 1 in bits 28 to 30, index of
/// the first triangle in leaf order in bits 0 to 27.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(transparent)]
pub struct Child(u32);

impl Child {
    /// Nodes that can be addressed.
    pub const MAX_NODES: usize = 1 << 29;

    /// Triangles that can be addressed.
    pub const MAX_TRIANGLES: usize = 1 << 28;

    /// Boxes that can be numbered.
    pub const MAX_BOXES: usize = 1 << 30;

    /// An inner node.
    pub const fn inner(node: usize) -> Self {
        debug_assert!(node < Self::MAX_NODES);
        Self(node as u32)
    }

    /// Something else than triangles, by its number among the boxes that the tree was built from.
    pub const fn special(index: usize) -> Self {
        debug_assert!(index < 1 << 30);
        Self(1 << 30 | index as u32)
    }

    /// `count` triangles, 1 to 8, from `first` on.
    pub const fn leaf(first: usize, count: usize) -> Self {
        debug_assert!(first < Self::MAX_TRIANGLES && count >= 1 && count <= WIDTH);
        Self(1 << 31 | (count as u32 - 1) << 28 | first as u32)
    }

    /// From the word itself.
    #[inline(always)]
    pub const fn from_bits(bits: u32) -> Self {
        Self(bits)
    }

    /// The word itself.
    pub const fn bits(self) -> u32 {
        self.0
    }

    /// Whether it is a leaf.
    #[inline(always)]
    pub const fn is_leaf(self) -> bool {
        self.0 >> 31 == 1
    }

    /// Whether it is an inner node.
    #[inline(always)]
    pub const fn is_inner(self) -> bool {
        self.0 >> 30 == 0
    }

    /// Whether it is something else than triangles.
    #[inline(always)]
    pub const fn is_special(self) -> bool {
        self.0 >> 30 == 1
    }

    /// The same inner node, as one near the root, which is likely to be in a cache.
    pub const fn near(self) -> Self {
        Self(self.0 | 1 << 29)
    }

    /// Whether it is an inner node that may not be in a cache.
    #[inline(always)]
    pub const fn is_far(self) -> bool {
        self.0 >> 29 == 0
    }

    /// Number of a box.
    #[inline(always)]
    pub const fn index(self) -> usize {
        self.0 as usize & ((1 << 30) - 1)
    }

    /// Index of an inner node.
    #[inline(always)]
    pub const fn node(self) -> usize {
        self.0 as usize & (Self::MAX_NODES - 1)
    }

    /// First triangle of a leaf, in leaf order.
    #[inline(always)]
    pub const fn first(self) -> usize {
        self.0 as usize & (Self::MAX_TRIANGLES - 1)
    }

    /// Triangles of a leaf.
    #[inline(always)]
    pub const fn count(self) -> usize {
        (self.0 as usize >> 28 & 7) + 1
    }
}

/// The triangles of all leaves. A leaf of n triangles is `LEAF_ROWS` rows of exactly n numbers (indices as bits), so
/// nothing is padded: 40 bytes per triangle. 8 lanes are loaded whatever n is and the surplus, the next row's, is
/// masked; `WIDTH` numbers follow the last leaf.
#[derive(Clone, Debug, Default)]
pub struct Leaves {
    /// Rows after rows.
    pub data: Vec<f32>,
}

impl Leaves {
    /// Where a leaf's rows begin.
    #[inline(always)]
    pub const fn offset(leaf: Child) -> usize {
        leaf.first() * LEAF_ROWS
    }

    /// Primitive number of triangle `i` of `leaf`, and [`FILTERED`] where that applies.
    #[inline(always)]
    pub fn word(&self, leaf: Child, i: usize) -> u32 {
        self.data[Self::offset(leaf) + (LEAF_ROWS - 1) * leaf.count() + i].to_bits()
    }
}

//! The memory layout: 8-wide nodes of 256 bytes and leaves of up to 8 triangles.

/// Children per node, and triangles per leaf at most.
pub const WIDTH: usize = 8;

/// Rows of a leaf: three corners of three coordinates, then the triangles' indices.
pub const LEAF_ROWS: usize = 10;

/// Set in a leaf's primitive number where the geometry's filter decides about hits.
pub const FILTERED: u32 = 1 << 31;

/// A node: the boxes of its children, as rows, and where they are. Four cache lines, nothing quantised: decoding 8-bit
/// boxes at every node halves the speed of incoherent rays on a CPU.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct Node {
    /// Six rows of 8: x low, y low, z low, x high, y high, z high. Unused lanes have low > high.
    pub planes: [f32; 6 * WIDTH],
    /// What each lane is.
    pub children: [Child; WIDTH],
    /// Lanes in use; these come first.
    pub count: u32,
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
        Self { planes, children: [Child::leaf(0, 1); WIDTH], count: 0 }
    };

    /// Adds a child.
    pub fn push(&mut self, low: [f32; 3], high: [f32; 3], child: Child) {
        let lane = self.count as usize;
        for axis in 0..3 {
            self.planes[axis * WIDTH + lane] = low[axis];
            self.planes[(axis + 3) * WIDTH + lane] = high[axis];
        }
        self.children[lane] = child;
        self.count += 1;
    }
}

/// Where a child is. Inner: index of a node, bits 30 and 31 clear. Special: bit 31 clear, bit 30 set, index of a box in
/// bits 0 to 29. Leaf: bit 31 set, triangles - 1 in bits 28 to 30, index of
/// the first triangle in leaf order in bits 0 to 27.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(transparent)]
pub struct Child(u32);

impl Child {
    /// Triangles that can be addressed.
    pub const MAX_TRIANGLES: usize = 1 << 28;

    /// An inner node.
    pub const fn inner(node: usize) -> Self {
        debug_assert!(node < 1 << 30);
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

    /// Number of a box.
    #[inline(always)]
    pub const fn index(self) -> usize {
        self.0 as usize & ((1 << 30) - 1)
    }

    /// Index of an inner node.
    #[inline(always)]
    pub const fn node(self) -> usize {
        self.0 as usize
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

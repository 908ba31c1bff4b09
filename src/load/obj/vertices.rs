//! Numbers for the different vertices that corners make, in the order in which they come.

use std::collections::HashMap;

/// No vertex here.
const END: u32 = u32::MAX;

/// A table that is indexed by position may be this many times as long as the corners that use it are many.
const SPARSE: usize = 16;

/// Where the vertices at a position begin.
enum Heads {
    /// By position, from the least one.
    Table { least: u32, first: Vec<u32> },
    /// For few corners whose positions are far apart.
    Map(HashMap<u32, u32>),
}

/// Vertices as (position, two more numbers): a chain for each position, which real files keep short.
pub(super) struct Chains {
    heads: Heads,
    /// The two numbers, and the next vertex at the same position.
    vertices: Vec<([u32; 2], u32)>,
}

impl Chains {
    /// For positions `least..=most` at `corners` corners: a table if that is not much longer than they are many.
    pub fn for_corners(least: u32, most: u32, corners: usize) -> Self {
        let length = (most.saturating_sub(least)) as usize + 1;
        match length <= SPARSE * corners + 1024 {
            true => Self::new(least, length),
            false => Self { heads: Heads::Map(HashMap::new()), vertices: Vec::new() },
        }
    }

    /// For the `length` positions from `least` on.
    pub fn new(least: u32, length: usize) -> Self {
        Self { heads: Heads::Table { least, first: vec![END; length] }, vertices: Vec::new() }
    }

    /// The vertex's number, and whether it is new.
    #[inline]
    pub fn id(&mut self, position: u32, key: [u32; 2]) -> (u32, bool) {
        let head = match &mut self.heads {
            Heads::Table { least, first } => &mut first[(position - *least) as usize],
            Heads::Map(first) => first.entry(position).or_insert(END),
        };
        let mut at = *head;
        while at != END {
            let (known, next) = self.vertices[at as usize];
            if known == key {
                return (at, false);
            }
            at = next;
        }
        let id = self.vertices.len() as u32;
        self.vertices.push((key, *head));
        *head = id;
        (id, true)
    }
}

//! Must a ray hit one of several triangles, though it passes so near to their edges that no single one must be hit?
//!
//! Triangles that share edges form a chain. However their shared corners are rounded, as long as each is rounded alike for
//! all its triangles, the number of triangles over the ray stays odd or even (the degree modulo 2 of a map of the chain is
//! the same for two that can be moved into each other without carrying the chain's boundary over the ray). So if no edge
//! of the boundary (one that an odd number of the triangles have) is within its error of the ray, and the number over a
//! point close by is odd, one of them must be hit: a ray through an edge or a corner of a closed mesh may not pass.

use super::sight::Sight;
use glam::DVec3;

/// A triangle near the ray.
pub struct Link {
    /// Corners, in the ray's space: equal numbers mean the same corner.
    pub corners: [DVec3; 3],
    /// How it is seen.
    pub sight: Sight,
}

type Corner = [u64; 3];

fn name(p: DVec3) -> Corner {
    // + 0 makes one of both zeroes.
    p.to_array().map(|x| (x + 0.0).to_bits())
}

/// Distances between which one of the `links` must be hit, for every chain that must.
pub fn forced(links: &[Link]) -> Vec<[f64; 2]> {
    let named: Vec<[Corner; 3]> = links.iter().map(|link| link.corners.map(name)).collect();
    let mut edges: Vec<(Corner, Corner, usize)> = Vec::new();
    let mut known: Vec<[Corner; 3]> = Vec::new();
    let mut is_copy = vec![false; links.len()];
    for (i, link) in links.iter().enumerate() {
        let mut sorted = named[i];
        sorted.sort_unstable();
        // Copies of a triangle are hit where it is; counted, an even number of them would hide it.
        if known.contains(&sorted) || sorted[0] == sorted[1] || sorted[1] == sorted[2] {
            is_copy[i] = true;
            continue;
        }
        known.push(sorted);
        for k in 0..3 {
            let (a, b) = (named[i][(k + 1) % 3], named[i][(k + 2) % 3]);
            if link.sight.is_near(k) {
                edges.push((a.min(b), a.max(b), i));
            }
        }
    }
    edges.sort_unstable();
    let mut chain: Vec<usize> = (0..links.len()).collect();
    for shared in edges.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        for pair in shared.windows(2) {
            let (from, to) = (chain[pair[0].2], chain[pair[1].2]);
            chain.iter_mut().filter(|c| **c == from).for_each(|c| *c = to);
        }
    }
    let is_open: Vec<usize> = edges
        .chunk_by(|a, b| (a.0, a.1) == (b.0, b.1))
        .filter(|shared| shared.len() % 2 == 1)
        .map(|shared| chain[shared[0].2])
        .collect();
    let mut of_chains: Vec<usize> = (0..links.len()).filter(|&i| !is_copy[i]).map(|i| chain[i]).collect();
    of_chains.sort_unstable();
    of_chains.dedup();
    let closed = of_chains.into_iter().filter(|c| !is_open.contains(c));
    let members = |c: usize| -> Vec<&Sight> {
        (0..links.len()).filter(|&i| chain[i] == c && !is_copy[i]).map(|i| &links[i].sight).collect()
    };
    closed.map(members).filter(|sights| is_odd(sights)).map(|sights| span(&sights)).collect()
}

fn span(sights: &[&Sight]) -> [f64; 2] {
    sights.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], s| [low.min(s.t[0]), high.max(s.t[1])])
}

/// Whether an odd number of the triangles is over the points close to the ray.
fn is_odd(sights: &[&Sight]) -> bool {
    // As far from the ray as no boundary is.
    let far = |s: &Sight| (0..3).filter(|&k| !s.is_near(k)).map(|k| s.edges[k]).fold(f64::INFINITY, f64::min);
    let error = sights.iter().flat_map(|s| s.corners).map(|c| c.across).fold(0.0, f64::max);
    let reach = 0.5 * sights.iter().map(|s| far(s)).fold(error, f64::min);
    // Of several points the one that is furthest from all edges: f64 settles on which side of them it is.
    let mut best = (0.0, false);
    for k in 0..24 {
        // The golden angle spreads them.
        let (phi, r) = (2.399_963_229_728_653 * f64::from(k), reach * (0.3 + 0.7 * f64::from(k) / 24.0));
        let (mut clear, mut over) = (f64::INFINITY, 0);
        for sight in sights {
            let (inside, distance) = sight.contains(r * phi.cos(), r * phi.sin());
            clear = f64::min(clear, distance);
            over += usize::from(inside);
        }
        if clear > best.0 {
            best = (clear, over % 2 == 1);
        }
    }
    // Nothing is demanded where f64 is not sure.
    best.1 && best.0 > 1e-4 * reach
}

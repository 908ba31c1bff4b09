//! A mesh may hold lamps far apart: exporters merge what has one material. Parts that do not touch are lights of their own.

use super::element::LampTriangle;
use std::collections::HashMap;

/// The triangles in groups that share corners, in the order of their first triangles.
pub fn connected(lamps: Vec<LampTriangle>) -> Vec<Vec<LampTriangle>> {
    if lamps.len() < 2 {
        return if lamps.is_empty() { Vec::new() } else { vec![lamps] };
    }
    // Each triangle points to an earlier one of its group or to itself.
    let mut earlier: Vec<usize> = (0..lamps.len()).collect();
    let mut met: HashMap<[u32; 3], usize> = HashMap::with_capacity(lamps.len());
    for (i, lamp) in lamps.iter().enumerate() {
        for corner in lamp.corners {
            // + 0 turns -0 into 0.
            let place = (corner + glam::Vec3::ZERO).to_array().map(f32::to_bits);
            let other = *met.entry(place).or_insert(i);
            let (a, b) = (first(&mut earlier, other), first(&mut earlier, i));
            earlier[a.max(b)] = a.min(b);
        }
    }
    let mut groups: Vec<Vec<LampTriangle>> = Vec::new();
    let mut group_of = vec![0; lamps.len()];
    for (i, lamp) in lamps.into_iter().enumerate() {
        let root = first(&mut earlier, i);
        if root == i {
            group_of[i] = groups.len();
            groups.push(Vec::new());
        }
        groups[group_of[root]].push(lamp);
    }
    groups
}

/// The first triangle of the group of triangle `i`; halves the way there.
fn first(earlier: &mut [usize], mut i: usize) -> usize {
    while earlier[i] != i {
        earlier[i] = earlier[earlier[i]];
        i = earlier[i];
    }
    i
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Rng;
    use glam::Vec3;

    fn lamp(primitive: u32, corners: [Vec3; 3]) -> LampTriangle {
        LampTriangle { corners, ng: Vec3::Z, area: 1.0, primitive, attributes: u32::MAX }
    }

    #[test]
    fn triangles_that_share_corners_are_together_in_any_order() {
        // Strips of 1 to 9 triangles far apart, shuffled.
        let mut lamps = Vec::new();
        for strip in 0..9_u32 {
            let corner = |i: u32| Vec3::new(i as f32, (i % 2) as f32, 100.0 * strip as f32);
            lamps.extend((0..=strip).map(|i| lamp(strip, [corner(i), corner(i + 1), corner(i + 2)])));
        }
        Rng::new(4).shuffle(&mut lamps);
        let groups = connected(lamps);
        assert_eq!(groups.len(), 9);
        for group in groups {
            let strip = group[0].primitive;
            assert!(group.len() == strip as usize + 1 && group.iter().all(|lamp| lamp.primitive == strip));
        }
    }

    #[test]
    fn corners_at_both_zeros_are_one() {
        let a = lamp(0, [Vec3::ZERO, Vec3::X, Vec3::Y]);
        let b = lamp(1, [-Vec3::ZERO, -Vec3::X, -Vec3::Y]);
        assert_eq!(connected(vec![a, b]).len(), 1);
    }
}

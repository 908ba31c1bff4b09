//! Modes of primitives: lists, strips and fans become triangles with the specification's winding (section 3.7.2.1).

use gltf::json::mesh::Mode;

/// What the corners of a primitive make.
pub(super) enum Topology {
    /// Triangles, counter-clockwise seen from the front, and how many corners at the end were too few for one more.
    Triangles(Vec<[u32; 3]>, usize),
    /// How many of something without a surface: points, lines.
    Without(usize, &'static str),
}

/// What `corners` make in `mode`. Triangles of strips and fans that name a vertex twice are left out without a word:
/// exporters stitch strips together with them.
pub(super) fn topology(mode: Mode, corners: Vec<u32>) -> Topology {
    let n = corners.len();
    match mode {
        Mode::Points => Topology::Without(n, "points"),
        Mode::Lines => Topology::Without(n / 2, "lines"),
        Mode::LineLoop => Topology::Without(if n < 2 { 0 } else { n }, "lines"),
        Mode::LineStrip => Topology::Without(n.saturating_sub(1), "lines"),
        Mode::Triangles => {
            let (triangles, rest) = corners.as_chunks::<3>();
            Topology::Triangles(triangles.to_vec(), rest.len())
        }
        Mode::TriangleStrip => {
            // Every second triangle is turned round, so that all face the same way.
            let turned = |(i, t): (usize, &[u32; 3])| if i % 2 == 0 { *t } else { [t[0], t[2], t[1]] };
            let triangles = corners.array_windows::<3>().enumerate().map(turned).filter(|t| !repeats(t));
            Topology::Triangles(triangles.collect(), if n < 3 { n } else { 0 })
        }
        Mode::TriangleFan => {
            let Some((&hub, rim)) = corners.split_first() else { return Topology::Triangles(Vec::new(), 0) };
            let triangles = rim.array_windows::<2>().map(|&[a, b]| [a, b, hub]).filter(|t| !repeats(t));
            Topology::Triangles(triangles.collect(), if n < 3 { n } else { 0 })
        }
    }
}

fn repeats([a, b, c]: &[u32; 3]) -> bool {
    a == b || b == c || c == a
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangles(mode: Mode, corners: &[u32]) -> (Vec<[u32; 3]>, usize) {
        match topology(mode, corners.to_vec()) {
            Topology::Triangles(triangles, rest) => (triangles, rest),
            Topology::Without(..) => panic!("no triangles"),
        }
    }

    #[test]
    fn strips_turn_every_second_triangle_and_drop_the_stitches() {
        assert_eq!(triangles(Mode::TriangleStrip, &[0, 1, 2, 3]), (vec![[0, 1, 2], [1, 3, 2]], 0));
        // Two strips stitched with four degenerate triangles; the second starts on an even one again.
        let (stitched, _) = triangles(Mode::TriangleStrip, &[0, 1, 2, 3, 3, 4, 4, 5, 6, 7]);
        assert_eq!(stitched, [[0, 1, 2], [1, 3, 2], [4, 5, 6], [5, 7, 6]]);
    }

    #[test]
    fn fans_and_lists_keep_their_winding() {
        assert_eq!(triangles(Mode::TriangleFan, &[9, 1, 2, 3]), (vec![[1, 2, 9], [2, 3, 9]], 0));
        assert_eq!(triangles(Mode::Triangles, &[0, 1, 2, 3, 4]), (vec![[0, 1, 2]], 2));
        assert_eq!(triangles(Mode::TriangleFan, &[1, 2]), (vec![], 2));
    }

    #[test]
    fn points_and_lines_are_counted() {
        for (mode, n, count) in [
            (Mode::Points, 3, 3),
            (Mode::Lines, 5, 2),
            (Mode::LineLoop, 4, 4),
            (Mode::LineLoop, 1, 0),
            (Mode::LineStrip, 4, 3),
            (Mode::LineStrip, 0, 0),
        ] {
            let Topology::Without(found, _) = topology(mode, (0..n).collect()) else { panic!("no surface") };
            assert_eq!(found, count, "{mode:?}");
        }
    }
}

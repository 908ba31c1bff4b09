use super::*;

/// Coordinates of `p` in the picture: (0,0) is its centre, |x| = |y| = 1 its edges.
fn on_picture(camera: &Camera, aspect: f64, p: DVec3) -> (f64, f64) {
    let Projection::Perspective { yfov, .. } = camera.projection else { panic!("a perspective") };
    let p = camera.world_from_camera.inverse().transform_point3(p);
    assert!(p.z < 0.0, "behind the camera: {p}");
    let half = (0.5 * yfov).tan();
    (p.x / (-p.z * half * aspect), p.y / (-p.z * half))
}

fn corners(low: DVec3, high: DVec3) -> impl Iterator<Item = DVec3> {
    (0..8).map(move |i| {
        let pick = |bit: usize| if i >> bit & 1 == 0 { low[bit] } else { high[bit] };
        DVec3::new(pick(0), pick(1), pick(2))
    })
}

#[test]
fn every_corner_is_in_the_picture_and_one_is_near_its_edge() {
    let sizes = [0.0, 1e-7, 1e-3, 1.0, 40.0, 1e7];
    let sides = [-1.0, 0.0, 1.0];
    for x in sizes {
        for (y, z) in sizes.iter().flat_map(|&y| sizes.map(|z| (y, z))) {
            let extents = DVec3::new(x, y, z);
            let largest = extents.max_element();
            if largest == 0.0 {
                continue;
            }
            // As far away as f64 still has digits left to tell the corners apart.
            for centre in [DVec3::ZERO, 1e6 * largest * DVec3::new(1.0, -2.0, 0.5)] {
                let (low, high) = (centre - 0.5 * extents, centre + 0.5 * extents);
                for (aspect, side) in [0.01, 0.5625, 1.0, 1.7778, 100.0].into_iter().flat_map(|a| sides.map(|s| (a, s)))
                {
                    let vector_area = side * (x * y).max(y * z).max(z * x) * DVec3::ONE;
                    let camera = framing_camera(Some((low, high)), vector_area, aspect);
                    assert!(camera.world_from_camera.is_finite());
                    let mut most: f64 = 0.0;
                    for corner in corners(low, high) {
                        let (x, y) = on_picture(&camera, aspect, corner);
                        most = most.max(x.abs()).max(y.abs());
                    }
                    let place = format!("{extents} at {centre}, aspect {aspect}: {most}");
                    assert!(most <= 1.0 / MARGIN + 1e-6 && most > 0.3, "{place}");
                }
            }
        }
    }
}

#[test]
fn nothing_and_a_point_have_a_finite_camera() {
    for bounds in [None, Some((DVec3::ONE, DVec3::ONE)), Some((DVec3::splat(-1.8e18), DVec3::splat(1.8e18)))] {
        let camera = framing_camera(bounds, DVec3::ZERO, 1.5);
        assert!(camera.world_from_camera.is_finite(), "{bounds:?}");
        assert!((camera.world_from_camera.determinant() - 1.0).abs() < 1e-9);
    }
}

/// Cosine between the axis and the way to the camera, for bounds of these extents.
#[track_caller]
fn seen_from(extents: [f64; 3], vector_area: [f64; 3], axis: [f64; 3], least: f64) {
    let half = 0.5 * DVec3::from(extents);
    let camera = framing_camera(Some((-half, half)), vector_area.into(), 1.5);
    let cosine = camera.world_from_camera.z_axis.truncate().dot(axis.into());
    assert!(cosine > least, "{extents:?} {vector_area:?}: {cosine}");
}

#[test]
fn flat_things_are_seen_from_the_side_they_show() {
    let (x, y, z) = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
    // Solid: from the front.
    seen_from([1.0; 3], [0.0; 3], z, 0.85);
    // A picture, from its front; of a closed plate, from +z; of one that is turned round, from behind.
    seen_from([4.0, 3.0, 0.0], [0.0, 0.0, 12.0], z, 0.95);
    seen_from([4.0, 3.0, 0.2], [0.0; 3], z, 0.95);
    seen_from([4.0, 3.0, 0.0], [0.0, 0.0, -12.0], [0.0, 0.0, -1.0], 0.95);
    seen_from([0.0, 3.0, 2.0], [-6.0, 0.0, 0.0], [-1.0, 0.0, 0.0], 0.95);
    seen_from([0.0, 3.0, 2.0], [6.0, 0.0, 0.0], x, 0.95);
    // A floor, from above; a ceiling, from below.
    seen_from([9.0, 0.0, 9.0], [0.0, 81.0, 0.0], y, 0.8);
    seen_from([9.0, 0.0, 9.0], [0.0, -81.0, 0.0], [0.0, -1.0, 0.0], 0.8);
    // A little more of its back than of its front does not turn a closed plate round.
    seen_from([4.0, 3.0, 0.1], [0.0, 0.0, -0.5], z, 0.95);
}

#[test]
fn rods_are_seen_from_the_side() {
    for extents in [[0.01, 0.01, 1.0], [0.0, 0.0, 1.0]] {
        seen_from(extents, [0.0; 3], [1.0, 0.0, 0.0], 0.85);
    }
    for extents in [[1.0, 0.01, 0.01], [0.01, 1.0, 0.01], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]] {
        seen_from(extents, [0.0; 3], [0.0, 0.0, 1.0], 0.85);
    }
}

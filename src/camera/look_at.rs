//! A camera's place from where it stands and what it looks at.

use glam::{DMat4, DVec3};

/// Sine of the angle between view and up below which up says nothing: numbers typed with nine digits are parallel.
const PARALLEL: f64 = 1e-9;

/// Why there is no such place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoView {
    /// The eye is where it looks.
    NoDirection,
    /// Up is the null vector.
    NoUp,
    /// Up is along the view, to either side.
    UpAlongView,
}

/// Rigid world-from-camera transform of a camera at `eye` that looks at `target`, `up` (any length) upwards in the
/// picture; metres, world space. All must be finite.
///
/// # Errors
/// The three do not say how the camera is turned.
pub fn look_at(eye: DVec3, target: DVec3, up: DVec3) -> Result<DMat4, NoView> {
    let z = direction(eye - target).ok_or(NoView::NoDirection)?;
    let up = direction(up).ok_or(NoView::NoUp)?;
    let x = up.cross(z);
    if x.length() < PARALLEL {
        return Err(NoView::UpAlongView);
    }
    let x = x.normalize();
    Ok(DMat4::from_cols(x.extend(0.0), z.cross(x).extend(0.0), z.extend(0.0), eye.extend(1.0)))
}

/// `v` with length 1, however long or short it is; `None` for the null vector.
fn direction(v: DVec3) -> Option<DVec3> {
    let largest = v.abs().max_element();
    (largest > 0.0).then(|| (v / largest).normalize())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_target_is_straight_ahead_and_up_is_up() {
        for scale in [1e-17, 1.0, 1e17] {
            let (eye, target) = (scale * DVec3::new(1.0, 2.0, 3.0), scale * DVec3::new(-4.0, 2.5, 1.0));
            let camera = look_at(eye, target, DVec3::new(0.0, 7.0, 1.0)).unwrap();
            let seen = camera.inverse().transform_point3(target) / scale;
            assert!(seen.abs_diff_eq(DVec3::new(0.0, 0.0, -(eye - target).length() / scale), 1e-12), "{seen}");
            let up = camera.inverse().transform_vector3(DVec3::new(0.0, 7.0, 1.0));
            assert!(up.y > 0.0 && up.x.abs() < 1e-12);
            assert!((camera.determinant() - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn what_says_no_direction_is_refused() {
        let eye = DVec3::ONE;
        assert_eq!(look_at(eye, eye, DVec3::Y), Err(NoView::NoDirection));
        assert_eq!(look_at(eye, DVec3::ZERO, DVec3::ZERO), Err(NoView::NoUp));
        for up in [DVec3::ONE, -3e9 * DVec3::ONE, DVec3::splat(1e-200)] {
            assert_eq!(look_at(eye, DVec3::ZERO, up), Err(NoView::UpAlongView), "{up}");
        }
    }
}

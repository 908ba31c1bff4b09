//! Cameras from elsewhere than the inputs: another file's, or one given by numbers.

use crate::camera::{Camera, Lens, NoView, Projection, look_at};
use crate::load::load_cameras;
use crate::scene::Scene;
use glam::DVec3;
use std::path::PathBuf;

/// Where the cameras of every input come from.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum CameraSource {
    /// Each file's own; a file without cameras has one framed on its bounds.
    #[default]
    Inputs,
    /// The default scene of this glTF file, for every input.
    File(PathBuf),
    /// One camera given by numbers, for every input.
    View(View),
}

/// A perspective camera given by numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Where it stands, metres, world space.
    pub eye: DVec3,
    /// What is in the picture's centre, metres, world space; not the eye.
    pub look_at: DVec3,
    /// What points up in the picture, any length.
    pub up: DVec3,
    /// Vertical field of view, degrees, in (0, 180).
    pub yfov: f64,
}

impl View {
    /// The camera's name, which output names and reports show.
    pub const NAME: &str = "eye";
    /// Vertical field of view where none is given, degrees: that of the camera framed on a scene's bounds.
    pub const DEFAULT_YFOV: f64 = crate::render::FRAMING_YFOV;

    /// The camera.
    ///
    /// # Errors
    /// The numbers give none; the text names the option, its value and what is allowed.
    fn camera(&self) -> Result<Camera, String> {
        let Self { eye, look_at: target, up, yfov } = *self;
        let list = |v: DVec3| format!("{},{},{}", v.x, v.y, v.z);
        for (option, value) in [("--eye", eye), ("--look-at", target), ("--up", up)] {
            if !value.is_finite() {
                return Err(format!("{option} {}: is not finite\n  Allowed: three finite numbers X,Y,Z.", list(value)));
            }
        }
        if !(yfov > 0.0 && yfov < 180.0) {
            return Err(format!("--yfov {yfov}: is out of range\n  Allowed: degrees above 0 and below 180."));
        }
        let world_from_camera = look_at(eye, target, up).map_err(|why| match why {
            NoView::NoDirection => format!(
                "--look-at {}: is where --eye is, so there is no direction to look in\n  Allowed: any other point.",
                list(target)
            ),
            NoView::NoUp => format!(
                "--up {}: is no direction\n  Allowed: any vector but 0,0,0 that is not along the view.",
                list(up)
            ),
            NoView::UpAlongView => {
                let other = if direction_is_mostly(target - eye, DVec3::Y) { "0,0,-1" } else { "0,1,0" };
                format!(
                    "--up {}{}: is along the view from --eye {} to --look-at {}\n  \
                     Allowed: any vector across it, such as --up {other}.",
                    list(up),
                    if up == DVec3::Y { " (the default)" } else { "" },
                    list(eye),
                    list(target)
                )
            }
        })?;
        let projection = Projection::Perspective { yfov: yfov.to_radians(), aspect_ratio: None };
        Ok(Camera { name: Self::NAME.into(), world_from_camera, projection, lens: Lens::default() })
    }
}

/// Whether `v` is nearer to `axis` than to anything across it.
fn direction_is_mostly(v: DVec3, axis: DVec3) -> bool {
    v.dot(axis).abs() >= 0.5 * v.abs().max_element()
}

impl CameraSource {
    /// The cameras for every input, at least one; `None` if each input has its own.
    ///
    /// # Errors
    /// There are none; the text names the option.
    pub(super) fn cameras(&self) -> Result<Option<Vec<Camera>>, String> {
        match self {
            Self::Inputs => Ok(None),
            Self::View(view) => view.camera().map(|camera| Some(vec![camera])),
            Self::File(path) => {
                let cameras = load_cameras(path).map_err(|error| format!("--camera-from {error}"))?;
                if cameras.is_empty() {
                    return Err(format!(
                        "--camera-from {}: its default scene has no camera\n  \
                         Export it with cameras, or say where to stand with --eye X,Y,Z --look-at X,Y,Z.",
                        path.display()
                    ));
                }
                Ok(Some(cameras))
            }
        }
    }

    /// Gives `scene` the cameras `cameras` in place of its own, which are listed as skipped.
    pub(super) fn replace(&self, scene: &mut Scene, cameras: &[Camera]) {
        if !scene.cameras.is_empty() {
            let why = format!("{} gives the cameras", self.options());
            scene.skipped.push(crate::scene::Skipped { what: "cameras".into(), why });
        }
        scene.cameras = cameras.to_vec();
        scene.motion.cameras.clear();
    }

    /// As typed, for messages.
    pub(super) fn options(&self) -> String {
        match self {
            Self::Inputs => String::new(),
            Self::File(path) => format!("--camera-from {}", path.display()),
            Self::View(_) => "--eye".into(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const VIEW: View =
        View { eye: DVec3::new(0.0, 2.0, 5.0), look_at: DVec3::new(0.0, 1.0, 0.0), up: DVec3::Y, yfov: 40.0 };

    #[track_caller]
    fn refused(view: View, says: &[&str]) {
        let error = view.camera().unwrap_err();
        says.iter().for_each(|part| assert!(error.contains(part), "must say {part:?}, but says: {error}"));
    }

    #[test]
    fn a_view_is_a_perspective_camera_with_its_angle_in_degrees() {
        let camera = VIEW.camera().unwrap();
        assert_eq!(camera.world_from_camera.w_axis.truncate(), VIEW.eye);
        let Projection::Perspective { yfov, aspect_ratio } = camera.projection else { panic!("a perspective") };
        assert!((yfov - 0.698_131_7).abs() < 1e-7 && aspect_ratio.is_none());
    }

    #[test]
    fn views_that_are_none_name_option_value_and_what_is_allowed() {
        refused(View { look_at: VIEW.eye, ..VIEW }, &["--look-at 0,2,5", "--eye", "any other point"]);
        refused(View { up: DVec3::ZERO, ..VIEW }, &["--up 0,0,0", "not along the view"]);
        let above = View { look_at: DVec3::new(0.0, -7.0, 5.0), ..VIEW };
        refused(above, &["--up 0,1,0 (the default)", "such as --up 0,0,-1"]);
        let level = View { look_at: DVec3::new(0.0, 2.0, 0.0), up: DVec3::Z, ..VIEW };
        refused(level, &["--up 0,0,1:", "such as --up 0,1,0"]);
        for yfov in [0.0, -1.0, 180.0, f64::NAN] {
            refused(View { yfov, ..VIEW }, &[&format!("--yfov {yfov}"), "above 0 and below 180"]);
        }
        refused(View { eye: DVec3::new(0.0, f64::INFINITY, 0.0), ..VIEW }, &["--eye 0,inf,0", "finite"]);
    }
}

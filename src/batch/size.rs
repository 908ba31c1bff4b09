//! How large pictures are.

use crate::camera::Projection;
use crate::render::CropWindow;
use crate::scene::Scene;

/// Size of the pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PictureSize {
    /// This wide; the height follows from the camera's aspect ratio, else 16:9.
    Width(u32),
    /// Exactly this, whatever the camera says.
    Exact(u32, u32),
}

impl Default for PictureSize {
    fn default() -> Self {
        Self::Width(Self::DEFAULT_WIDTH)
    }
}

impl PictureSize {
    /// Pixels across when nobody says it.
    pub const DEFAULT_WIDTH: u32 = 1280;
}

/// The aspect ratio that `camera` gives, if it gives one.
fn aspect_ratio(scene: &Scene, camera: usize) -> Option<f64> {
    scene.cameras.get(camera).and_then(|camera| match camera.projection {
        Projection::Perspective { aspect_ratio, .. } => aspect_ratio,
        Projection::Orthographic { xmag, ymag } => Some(xmag / ymag),
    })
}

/// What to say where an exact size overrules the camera's own shape by more than a pixel's worth.
pub(super) fn aspect_note(size: PictureSize, scene: &Scene, camera: usize) -> Option<String> {
    let PictureSize::Exact(width, height) = size else { return None };
    let aspect = aspect_ratio(scene, camera)?;
    if (f64::from(width) - aspect * f64::from(height)).abs() <= aspect.max(1.0) {
        return None;
    }
    Some(match scene.cameras.get(camera)?.projection {
        Projection::Perspective { .. } => {
            format!("--size {width}x{height} overrules the camera's aspectRatio {aspect:.4}; its yfov is kept")
        }
        Projection::Orthographic { xmag, ymag } => {
            format!("--size {width}x{height} overrules the camera's xmag {xmag}; its ymag {ymag} is kept")
        }
    })
}

/// Width and height of the picture of `camera`.
pub(super) fn size_for(size: PictureSize, scene: &Scene, camera: usize) -> (u32, u32) {
    match size {
        PictureSize::Exact(width, height) => (width, height),
        PictureSize::Width(width) => {
            let aspect = aspect_ratio(scene, camera);
            let height = f64::from(width) / aspect.unwrap_or(16.0 / 9.0);
            (width, (height.round() as u32).clamp(1, MAX_SIDE))
        }
    }
}

/// Most pixels along one side.
pub const MAX_SIDE: u32 = 65_536;

/// Whether the crop lies inside the picture; the error names the option and both.
pub(super) fn check_crop(crop: CropWindow, width: u32, height: u32) -> Result<(), String> {
    let inside = |start: u32, size: u32, whole: u32| u64::from(start) + u64::from(size) <= u64::from(whole);
    if inside(crop.x, crop.width, width) && inside(crop.y, crop.height, height) {
        return Ok(());
    }
    let CropWindow { x, y, width: w, height: h } = crop;
    Err(format!("--crop {x},{y},{w},{h} is not inside the picture of {width} x {height} pixels"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Camera, Lens};

    #[test]
    fn size_follows_the_cameras_aspect_ratio() {
        let camera = |aspect_ratio| Camera {
            name: String::new(),
            world_from_camera: glam::DMat4::IDENTITY,
            projection: Projection::Perspective { yfov: 1.0, aspect_ratio },
            lens: Lens::default(),
        };
        let scene = Scene { cameras: vec![camera(Some(2.0)), camera(None)], ..Scene::default() };
        let size = PictureSize::Width(1280);
        assert_eq!([0, 1, 2].map(|i| size_for(size, &scene, i)), [(1280, 640), (1280, 720), (1280, 720)]);
        assert_eq!(size_for(PictureSize::Exact(3, 5), &scene, 0), (3, 5));
        let note = |w, h, camera| aspect_note(PictureSize::Exact(w, h), &scene, camera);
        assert!(note(100, 100, 0).is_some_and(|n| n.contains("--size 100x100") && n.contains("2.0000")));
        assert_eq!([note(101, 50, 0), note(100, 100, 1), aspect_note(size, &scene, 0)], [None, None, None]);
    }

    #[test]
    fn an_orthographic_cameras_shape_is_xmag_over_ymag_and_xmag_yields() {
        let camera = Camera {
            name: String::new(),
            world_from_camera: glam::DMat4::IDENTITY,
            projection: Projection::Orthographic { xmag: 6.0, ymag: 2.0 },
            lens: Lens::default(),
        };
        let scene = Scene { cameras: vec![camera], ..Scene::default() };
        assert_eq!(size_for(PictureSize::Width(300), &scene, 0), (300, 100));
        let note = |w, h| aspect_note(PictureSize::Exact(w, h), &scene, 0);
        assert_eq!(note(300, 100), None);
        let said = note(100, 100).unwrap();
        assert!(said.contains("--size 100x100") && said.contains("xmag 6;") && said.contains("ymag 2 is kept"));
    }

    #[test]
    fn a_crop_must_be_inside() {
        let crop = |x, y, width, height| check_crop(CropWindow { x, y, width, height }, 64, 32);
        assert!(crop(0, 0, 64, 32).is_ok());
        assert!(crop(60, 0, 5, 1).unwrap_err().contains("--crop 60,0,5,1 is not inside the picture of 64 x 32"));
        assert!(crop(0, u32::MAX, 1, u32::MAX).is_err());
    }
}

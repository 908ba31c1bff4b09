//! Where loaders put what they read; [`SceneBuilder::finish`] checks it once for all of them.

use super::check::Findings;
use super::{
    ImageId, Instance, MaterialId, MeshId, Motion, PlacedLight, PlacedShape, Scene, Skipped, SourceFile, TextureId,
};
use crate::camera::Camera;
use crate::light::Environment;
use crate::material::Material;
use crate::shape::Mesh;
use crate::texture::{Channels, Image, Texture};
use std::sync::Arc;

/// A scene under construction.
#[derive(Debug, Default)]
pub struct SceneBuilder {
    scene: Scene,
    /// Of each mesh what its check found, where that was done before.
    checked: Vec<Option<Findings>>,
}

/// What was noted while something was read, to be noted again where that is used again.
#[derive(Clone, Debug, Default)]
pub(crate) struct Notes {
    warnings: Vec<String>,
    losses: Vec<String>,
    skipped: Vec<Skipped>,
}

macro_rules! add {
    ($method:ident, $field:ident, $thing:ty, $id:ident) => {
        #[doc = concat!("Adds to `", stringify!($field), "`; the id is its place there.")]
        pub fn $method(&mut self, thing: $thing) -> $id {
            self.scene.$field.push(thing);
            $id((self.scene.$field.len() - 1) as u32)
        }
    };
}

impl Notes {
    /// Adds what was noted later.
    pub(crate) fn append(&mut self, mut later: Self) {
        self.warnings.append(&mut later.warnings);
        self.losses.append(&mut later.losses);
        self.skipped.append(&mut later.skipped);
    }
}

impl SceneBuilder {
    /// An empty scene with the file's scene index.
    pub fn new(index: usize) -> Self {
        Self { scene: Scene { index, ..Scene::default() }, checked: Vec::new() }
    }

    /// The index given to [`SceneBuilder::new`].
    pub fn scene_index(&self) -> usize {
        self.scene.index
    }

    add!(add_material, materials, Material, MaterialId);
    add!(add_texture, textures, Texture, TextureId);

    /// Adds to `meshes`; the id is its place there.
    pub fn add_mesh(&mut self, mesh: Mesh) -> MeshId {
        self.push_mesh(Arc::new(mesh), None)
    }

    /// Adds a mesh that [`check_mesh`](super::check_mesh) has seen, perhaps for another scene.
    pub(crate) fn add_checked_mesh(&mut self, mesh: Arc<Mesh>, findings: Findings) -> MeshId {
        self.push_mesh(mesh, Some(findings))
    }

    fn push_mesh(&mut self, mesh: Arc<Mesh>, findings: Option<Findings>) -> MeshId {
        self.scene.meshes.push(mesh);
        self.checked.push(findings);
        MeshId((self.scene.meshes.len() - 1) as u32)
    }

    /// A mesh that was added.
    ///
    /// # Panics
    /// When the id is of another builder.
    pub(crate) fn mesh(&self, id: MeshId) -> &Mesh {
        &self.scene.meshes[id.index()]
    }

    /// Adds to `images`; the id is its place there.
    pub fn add_image(&mut self, image: impl Into<Arc<Image>>) -> ImageId {
        self.scene.images.push(image.into());
        ImageId((self.scene.images.len() - 1) as u32)
    }

    /// The channels that the materials read of each image, by its id; images beyond the end are read by none.
    pub fn channels(&self) -> Vec<Channels> {
        let mut used = Vec::new();
        for (read, channels) in self.scene.materials.iter().flat_map(Material::channels) {
            let Some(texture) = self.scene.textures.get(read.texture.index()) else { continue };
            let image = texture.image.index();
            if used.len() <= image {
                used.resize(image + 1, Channels::NONE);
            }
            used[image] |= channels;
        }
        used
    }

    /// A material that was added.
    ///
    /// # Panics
    /// When the id is of another builder.
    pub fn material(&self, id: MaterialId) -> &Material {
        &self.scene.materials[id.index()]
    }

    /// Places a mesh.
    pub fn add_instance(&mut self, instance: Instance) {
        self.scene.instances.push(instance);
    }

    /// Places an exact shape.
    pub fn add_shape(&mut self, shape: PlacedShape) {
        self.scene.shapes.push(shape);
    }

    /// Places a light.
    pub fn add_light(&mut self, light: PlacedLight) {
        self.scene.lights.push(light);
    }

    /// Lights the scene from all around; the last environment counts. Texels that are not finite or negative become 0,
    /// with a warning.
    pub fn set_environment(&mut self, environment: Environment) {
        self.scene.environment = Some(environment);
    }

    /// Adds a camera.
    pub fn add_camera(&mut self, camera: Camera) {
        self.scene.cameras.push(camera);
    }

    /// What moves while the shutter is open, to be added to.
    pub fn motion(&mut self) -> &mut Motion {
        &mut self.scene.motion
    }

    /// Says where the node is on which lenses are to be focused, world space, metres.
    pub fn set_focus(&mut self, point: glam::DVec3) {
        self.scene.focus = Some(point);
    }

    /// Says which files the scene was made from.
    pub fn set_sources(&mut self, sources: Vec<SourceFile>) {
        self.scene.sources = sources;
    }

    /// What moves, by the places of things in this builder.
    pub fn set_motion(&mut self, motion: Motion) {
        self.scene.motion = motion;
    }

    /// What is there so far, for [`SceneBuilder::notes_since`].
    pub(crate) fn note_counts(&self) -> [usize; 3] {
        [self.scene.warnings.len(), self.scene.losses.len(), self.scene.skipped.len()]
    }

    /// What was noted since then.
    pub(crate) fn notes_since(&self, [warnings, losses, skipped]: [usize; 3]) -> Notes {
        Notes {
            warnings: self.scene.warnings[warnings..].to_vec(),
            losses: self.scene.losses[losses..].to_vec(),
            skipped: self.scene.skipped[skipped..].to_vec(),
        }
    }

    /// Notes it once more.
    pub(crate) fn note_again(&mut self, notes: &Notes) {
        self.scene.warnings.extend_from_slice(&notes.warnings);
        self.scene.losses.extend_from_slice(&notes.losses);
        self.scene.skipped.extend_from_slice(&notes.skipped);
    }

    /// Notes something the user should know.
    pub fn warn(&mut self, warning: impl Into<String>) {
        self.scene.warnings.push(warning.into());
    }

    /// Notes something of the file that will not be in the picture although it should.
    pub fn lose(&mut self, warning: impl Into<String>) {
        let warning = warning.into();
        self.scene.losses.push(warning.clone());
        self.scene.warnings.push(warning);
    }

    /// Notes a part of the file that was not needed.
    pub fn skip(&mut self, what: impl Into<String>, why: impl Into<String>) {
        self.scene.skipped.push(Skipped { what: what.into(), why: why.into() });
    }

    /// The finished scene: ids in range, triangles without area or with unusable vertices dropped and counted.
    ///
    /// # Panics
    /// When a loader handed out an id that does not exist: a bug in that loader, not in its input.
    pub fn finish(mut self) -> Scene {
        super::check::check(&mut self.scene, self.checked);
        self.scene
    }
}

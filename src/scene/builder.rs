//! Where loaders put what they read; [`SceneBuilder::finish`] checks it once for all of them.

use super::{
    ImageId, Instance, MaterialId, MeshId, Motion, PlacedLight, PlacedShape, Scene, Skipped, SourceFile, TextureId,
};
use crate::camera::Camera;
use crate::light::Environment;
use crate::material::Material;
use crate::shape::Mesh;
use crate::texture::{Channels, Image, Texture};

/// A scene under construction.
#[derive(Debug, Default)]
pub struct SceneBuilder {
    scene: Scene,
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

impl SceneBuilder {
    /// An empty scene with the file's scene index.
    pub fn new(index: usize) -> Self {
        Self { scene: Scene { index, ..Scene::default() } }
    }

    /// The index given to [`SceneBuilder::new`].
    pub fn scene_index(&self) -> usize {
        self.scene.index
    }

    add!(add_mesh, meshes, Mesh, MeshId);
    add!(add_material, materials, Material, MaterialId);
    add!(add_texture, textures, Texture, TextureId);
    add!(add_image, images, Image, ImageId);

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
        super::check::check(&mut self.scene);
        self.scene
    }
}

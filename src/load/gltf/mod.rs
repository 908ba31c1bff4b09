//! glTF 2.0, through the typed JSON of the `gltf` crate but with our own files, buffers, images and validation.
//!
//! A file is parsed into a `document::Document`, checked as far as every scene needs it (`check`,
//! `extensions`), and then walked from the chosen scene's root nodes: only what is reached is opened and decoded.
//! One file per kind of object; every error names the JSON pointer of what is wrong.

mod accessor;
mod base64;
mod buffer;
mod camera;
mod check;
mod container;
mod document;
mod estimate;
mod extensions;
mod image;
mod instancing;
mod lens;
mod light;
mod locate;
mod material;
mod mesh;
mod morph;
mod node;
mod outline;
mod primitive;
mod semantic;
mod shape;
mod skin;
mod slots;
mod texture;
mod texture_info;
mod topology;
mod uri;
mod variants;

pub(super) use estimate::estimate;

use super::{LoadOptions, LoadTimes};
use crate::camera::Camera;
use crate::error::LoadError;
use crate::scene::{Scene, SceneBuilder};
use document::Document;
use glam::DMat4;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::rc::Rc;
use std::time::Instant;

type Result<T> = std::result::Result<T, LoadError>;

/// Reads a `.gltf` or `.glb` file.
///
/// # Errors
/// See [`super::load`].
pub fn load(path: &Path, options: &LoadOptions) -> Result<(Scene, LoadTimes)> {
    let start = Instant::now();
    let doc = Document::open(path, options.asset_root.as_deref())?;
    check::asset(&doc)?;
    check::integers(&doc)?;
    extensions::check_required(&doc)?;
    let parents = check::tree(&doc)?;
    let chosen = node::choose_scene(&doc, options.scene.as_deref(), &parents)?;

    let mut loader = Loader::new(&doc, &parents, chosen.index);
    loader.variant = variants::choose(&doc, options.variant.as_deref())?;
    doc.warnings.iter().for_each(|w| loader.builder.warn(w));
    if let Some(warning) = &chosen.warning {
        loader.builder.warn(warning);
    }
    node::walk(&mut loader, &chosen.roots)?;
    if let Some(node) = &options.focus_on {
        lens::focus_on(&mut loader, node)?;
    }
    extensions::warn_ignored(&mut loader);

    let before = Instant::now();
    image::decode_all(&mut loader)?;
    let decode = before.elapsed().as_secs_f64();

    loader.note_skipped();
    loader.builder.set_sources(doc.sources());
    let scene = loader.builder.finish();
    let total = start.elapsed().as_secs_f64();
    Ok((scene, LoadTimes { load: total - decode, decode }))
}

/// The cameras of the default scene of a `.gltf` or `.glb` file, and nothing else: no mesh, buffer or image is opened.
///
/// # Errors
/// See [`super::load_cameras`].
pub fn load_cameras(path: &Path) -> Result<Vec<Camera>> {
    let doc = Document::open(path, None)?;
    check::asset(&doc)?;
    check::integers(&doc)?;
    extensions::check_required(&doc)?;
    let parents = check::tree(&doc)?;
    let chosen = node::choose_scene(&doc, None, &parents)?;
    let mut loader = Loader::new(&doc, &parents, chosen.index);
    node::walk_cameras(&mut loader, &chosen.roots)?;
    Ok(loader.builder.finish().cameras)
}

/// What has been read so far, so that shared things are read once.
struct Loader<'d> {
    doc: &'d Document,
    builder: SceneBuilder,
    /// The parent of each node.
    parents: &'d [Option<usize>],
    /// glTF mesh in a pose -> ours.
    meshes: BTreeMap<mesh::Key, mesh::Posed>,
    skins: BTreeMap<usize, Rc<skin::Palette>>,
    /// World transforms of the joints of skins and of the nodes above them.
    worlds: BTreeMap<usize, DMat4>,
    /// glTF material (`None` = the default one) -> ours.
    materials: BTreeMap<Option<usize>, material::Read>,
    textures: texture::Textures,
    /// Which of the file's variants of materials is shown; `None` = its own materials.
    variant: Option<usize>,
    cameras: BTreeSet<usize>,
    lights: BTreeSet<usize>,
    /// Warnings that are given once a file.
    said: BTreeSet<&'static str>,
}

impl<'d> Loader<'d> {
    fn new(doc: &'d Document, parents: &'d [Option<usize>], scene: usize) -> Self {
        Self {
            doc,
            builder: SceneBuilder::new(scene),
            parents,
            meshes: BTreeMap::new(),
            skins: BTreeMap::new(),
            worlds: BTreeMap::new(),
            materials: BTreeMap::new(),
            textures: texture::Textures::default(),
            variant: None,
            cameras: BTreeSet::new(),
            lights: BTreeSet::new(),
            said: BTreeSet::new(),
        }
    }

    /// Warns with `text` unless the same text was given before.
    fn warn_once(&mut self, text: &'static str) {
        if self.said.insert(text) {
            self.builder.warn(text);
        }
    }

    /// Notes the loss `text` unless it was noted before.
    fn lose_once(&mut self, text: &'static str) {
        if self.said.insert(text) {
            self.builder.lose(text);
        }
    }

    /// Lists the parts of the file that the scene does not reach.
    fn note_skipped(&mut self) {
        let root = &self.doc.root;
        let unused = format!("nothing in scene {} uses it", self.builder.scene_index());
        let skip = |builder: &mut SceneBuilder, list: &str, len: usize, used: &dyn Fn(usize) -> bool| {
            (0..len).filter(|&i| !used(i)).for_each(|i| builder.skip(format!("{list}/{i}"), unused.as_str()));
        };
        let meshes: BTreeSet<usize> = self.meshes.keys().map(|k| k.mesh).collect();
        skip(&mut self.builder, "meshes", root.meshes.len(), &|i| meshes.contains(&i));
        skip(&mut self.builder, "materials", root.materials.len(), &|i| self.materials.contains_key(&Some(i)));
        skip(&mut self.builder, "images", root.images.len(), &|i| self.textures.uses_image(i));
        skip(&mut self.builder, "cameras", root.cameras.len(), &|i| self.cameras.contains(&i));
        let lights = light::list(self.doc).len();
        skip(&mut self.builder, "extensions/KHR_lights_punctual/lights", lights, &|i| self.lights.contains(&i));
        for i in 0..self.doc.animations {
            self.builder.skip(format!("animations/{i}"), "animation is not built: the scene is as written");
        }
    }
}

/// Which of our things a glTF name or, without one, its place in the file stands for; for messages.
fn name_or(name: Option<&String>, list: &str, index: usize) -> String {
    match name {
        Some(name) if !name.is_empty() => name.clone(),
        _ => format!("{list}/{index}"),
    }
}

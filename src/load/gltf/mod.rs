//! glTF 2.0, through the typed JSON of the `gltf` crate but with our own files, buffers, images and validation.
//!
//! A file is parsed into a `document::Document`, checked as far as every scene needs it (`check`,
//! `extensions`), and then walked from the chosen scene's root nodes: only what is reached is opened and decoded. For a
//! moment of an animation the document is posed first (`animation`) and walked as any; what does not depend on the time is
//! `kept` from moment to moment.
//! One file per kind of object; every error names the JSON pointer of what is wrong.

mod accessor;
mod animation;
mod base;
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
mod kept;
mod lens;
mod light;
mod locate;
mod material;
mod mesh;
mod morph;
mod motion;
mod node;
mod outline;
mod primitive;
mod semantic;
mod shape;
mod shutter;
mod skin;
mod slots;
mod texture;
mod texture_info;
mod topology;
mod trace;
mod uri;
mod variants;

pub(super) use estimate::estimate;

use super::moment::{AnimationChoice, Moment};
use super::{LoadOptions, LoadTimes};
use crate::camera::Camera;
use crate::error::LoadError;
use crate::scene::{Scene, SceneBuilder};
use animation::Animation;
use document::Document;
use glam::{DMat4, DVec3};
use kept::Kept;
use motion::Shutter;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;
use trace::Trace;

type Result<T> = std::result::Result<T, LoadError>;

/// Reads a `.gltf` or `.glb` file as it is written.
///
/// # Errors
/// See [`super::load`].
pub fn load(path: &Path, options: &LoadOptions) -> Result<(Scene, LoadTimes)> {
    File::open(path, options, None)?.scene(None)
}

/// The time of the last key of the animations that `choice` names, seconds; no more of the file is read than that takes.
pub(super) fn animation_seconds(path: &Path, options: &LoadOptions, choice: &AnimationChoice) -> Result<f64> {
    let doc = Document::open(path, options.asset_root.as_deref())?;
    check::asset(&doc)?;
    check::integers(&doc)?;
    Ok(Animation::read(&doc, choice)?.seconds())
}

/// A file that was opened and checked as a whole.
pub(super) struct File {
    doc: Document,
    parents: Vec<Option<usize>>,
    chosen: node::Chosen,
    variant: Option<usize>,
    /// The node that lenses are focused on.
    focus_on: Option<String>,
    animation: Option<Animation>,
    /// What the cameras ask for, and what is to be said of it.
    shutter: (f64, Option<String>),
    kept: Kept,
    /// Seconds that opening it took, which the first scene bears.
    opening: f64,
}

impl File {
    /// Opens a file, with the animations that `animation` names.
    pub fn open(path: &Path, options: &LoadOptions, animation: Option<&AnimationChoice>) -> Result<Self> {
        let start = Instant::now();
        let doc = Document::open(path, options.asset_root.as_deref())?;
        check::asset(&doc)?;
        check::integers(&doc)?;
        extensions::check_required(&doc)?;
        let parents = check::tree(&doc)?;
        let chosen = node::choose_scene(&doc, options.scene.as_deref(), &parents)?;
        let variant = variants::choose(&doc, options.variant.as_deref())?;
        if animation.is_some() {
            doc.look_for_all();
        }
        let animation = animation.map(|choice| Animation::read(&doc, choice)).transpose()?;
        let shutter = match &animation {
            Some(_) => shutter::share(&doc, &chosen.roots)?,
            None => (0.0, None),
        };
        let kept = Kept { is_kept: animation.is_some(), ..Kept::default() };
        let opening = start.elapsed().as_secs_f64();
        let focus_on = options.focus_on.clone();
        Ok(Self { doc, parents, chosen, variant, focus_on, animation, shutter, kept, opening })
    }

    /// See [`super::SceneSource::seconds`].
    pub fn seconds(&self) -> f64 {
        self.animation.as_ref().map_or(0.0, Animation::seconds)
    }

    /// The scene as it is written, or at a moment of its animations.
    pub fn scene(&mut self, moment: Option<&Moment>) -> Result<(Scene, LoadTimes)> {
        let start = Instant::now();
        let Self { doc, parents, chosen, variant, focus_on, animation, shutter: (asked, note), kept, opening } = self;
        let animation = animation.as_ref();
        let share = moment.and_then(|moment| moment.shutter).unwrap_or(*asked);
        let interval = moment.map(|moment| moment.interval(share));
        if let (Some(animation), Some([open, _])) = (animation, interval) {
            animation.pose(doc, open)?;
        }
        let mut loader = Loader::new(doc, parents, chosen.index, kept);
        loader.variant = *variant;
        if let (Some(animation), Some(interval), true) = (animation, interval, share > 0.0) {
            loader.morphing = animation.morphing_nodes(&doc.root.nodes, interval);
        }
        doc.warnings.iter().for_each(|w| loader.builder.warn(w));
        if let Some(warning) = &chosen.warning {
            loader.builder.warn(warning);
        }
        for warning in animation.iter().flat_map(|animation| &animation.warnings) {
            loader.builder.warn(warning);
        }
        if animation.is_some_and(Animation::is_empty) {
            loader.builder.warn("nothing in the file is animated: every frame is the same");
        }
        if let (Some(note), Some(Moment { shutter: None, .. })) = (note, moment) {
            loader.builder.warn(note.as_str());
        }
        node::walk(&mut loader, &chosen.roots)?;
        if let Some(node) = focus_on {
            lens::focus_on(&mut loader, node)?;
        }
        extensions::warn_ignored(&mut loader);

        let before = Instant::now();
        image::decode_all(&mut loader)?;
        let decode = before.elapsed().as_secs_f64();

        loader.note_skipped(animation);
        loader.builder.set_sources(doc.sources());
        let Loader { mut builder, trace, skins, .. } = loader;
        if let (Some(animation), Some(interval), true) = (animation, interval, share > 0.0) {
            let skin_origins = skins.into_iter().map(|(skin, palette)| (skin, palette.origin)).collect();
            let shutter = Shutter { doc, parents, kept, animation, interval, skin_origins };
            let motion = shutter.motion(&trace, &builder)?;
            builder.set_motion(motion);
        }
        let scene = builder.finish();
        let total = start.elapsed().as_secs_f64() + std::mem::take(opening);
        Ok((scene, LoadTimes { load: total - decode, decode }))
    }
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
    let mut kept = Kept::default();
    let mut loader = Loader::new(&doc, &parents, chosen.index, &mut kept);
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
    skins: BTreeMap<usize, Arc<skin::Palette>>,
    /// Where meshes of skins are placed, if not at their first joints.
    skin_origins: BTreeMap<usize, DVec3>,
    /// Nodes whose meshes change by morph weights while the shutter is open.
    morphing: BTreeSet<usize>,
    trace: Trace,
    kept: &'d mut Kept,
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
    fn new(doc: &'d Document, parents: &'d [Option<usize>], scene: usize, kept: &'d mut Kept) -> Self {
        Self {
            doc,
            builder: SceneBuilder::new(scene),
            parents,
            meshes: BTreeMap::new(),
            skins: BTreeMap::new(),
            skin_origins: BTreeMap::new(),
            morphing: BTreeSet::new(),
            trace: Trace::default(),
            kept,
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
    fn note_skipped(&mut self, animation: Option<&Animation>) {
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
            let why = match animation {
                None => "no frames are asked for: the scene is as written",
                Some(animation) if !animation.chosen.contains(&i) => "another animation is played",
                Some(_) => continue,
            };
            self.builder.skip(format!("animations/{i}"), why);
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

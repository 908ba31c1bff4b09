//! Wavefront OBJ with its MTL files.
//!
//! Bytes become logical lines (`text`), read in parallel pieces (`statement`) that `geometry` puts in order; `normals`
//! makes those that are missing; `mesh` cuts polygons (`polygon`) and numbers vertices (`vertices`). MTL files are read
//! as written (`mtl`, `map`), their pictures found and decoded (`files`), and turned into glTF's terms (`material`,
//! `texture`). What is wrong in the geometry is an error, what is wrong in a material a warning; both name their place.

mod estimate;
mod files;
mod geometry;
mod map;
mod material;
mod mesh;
mod mtl;
mod normals;
mod polygon;
mod statement;
mod text;
mod texture;
mod vertices;

pub(super) use estimate::estimate;

use super::folders::{Folders, read_file};
use super::tangents::{self, TooManyTriangles};
use super::{LoadOptions, LoadTimes};
use crate::error::{LoadError, SourceLoc};
use crate::scene::{Instance, MaterialId, Scene, SceneBuilder, SourceFile};
use geometry::{Geometry, Part};
use glam::DMat4;
use mtl::Written;
use rayon::prelude::*;
use statement::Note;
use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};
use std::time::Instant;
use text::{Places, Text};

/// Names listed in a warning.
const NAMES_SHOWN: usize = 5;

/// Which axis of an OBJ file points up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ObjUp {
    /// As here.
    #[default]
    Y,
    /// The model is turned by -90 degrees about x.
    Z,
}

/// Reads an `.obj` file.
///
/// # Errors
/// See [`super::load`].
pub fn load(path: &Path, options: &LoadOptions) -> Result<(Scene, LoadTimes), LoadError> {
    let start = Instant::now();
    if let Some(scene) = options.scene.as_deref().filter(|scene| *scene != "0") {
        let problem = format!("there is no scene \"{scene}\"");
        return Err(LoadError::new(SourceLoc::file(path), problem, "An OBJ has one scene: leave --scene out."));
    }
    let whole = |problem: String| LoadError::new(SourceLoc::file(path), problem, "");
    let mut sources = vec![SourceFile::input(path)];
    let bytes = read_file(path).map_err(|why| whole(format!("cannot be read: {why}")))?;
    let folders = Folders::new(path, options.asset_root.as_deref())?;
    let text = Text::new(path, bytes);
    let mut geometry = Geometry::read(&text)?;
    normals::complete(&mut geometry, options.smooth_angle);

    let mut loader = Loader { text: &text, folders, builder: SceneBuilder::new(0), library: BTreeMap::new() };
    loader.notes(&geometry);
    loader.libraries(&geometry);
    let mut decode = 0.0;
    let materials = loader.materials(&geometry, options, &mut decode);
    loader.meshes(geometry, &materials, options);
    sources.extend(loader.folders.sources());
    loader.builder.set_sources(sources);
    let scene = loader.builder.finish();
    let total = start.elapsed().as_secs_f64();
    Ok((scene, LoadTimes { load: total - decode, decode }))
}

/// A material and the folder of its MTL file, relative to the input's.
struct Entry {
    written: Written,
    folder: String,
    is_used: bool,
}

struct Loader<'t> {
    text: &'t Text,
    folders: Folders,
    builder: SceneBuilder,
    /// By name.
    library: BTreeMap<String, Entry>,
}

/// What a part's material has become.
#[derive(Clone, Copy)]
struct Made {
    id: MaterialId,
    reads_textures: bool,
}

impl Loader<'_> {
    /// Warns of what was counted.
    fn notes(&mut self, geometry: &Geometry) {
        let mut say = |is_loss: bool, note: Note, what: &str| {
            let (count, first) = geometry.notes[note as usize];
            if count > 0 {
                let text = format!("{}: {count} {what} (this is the first)", self.text.at(first));
                if is_loss { self.builder.lose(text) } else { self.builder.warn(text) }
            }
        };
        say(true, Note::PointsAndLines, "statements with points or lines: not drawn");
        say(true, Note::FreeForm, "statements of free-form curves and surfaces: not drawn");
        say(true, Note::ShortFaces, "faces with fewer than three corners: not drawn");
        say(false, Note::NumberTails, "numbers with something behind them: used as far as they are numbers");
        say(false, Note::MoreNumbers, "lines with more numbers than their kind has: those are ignored");
        say(true, Note::OtherFiles, "statements that call other files: ignored");
        say(false, Note::SmoothWords, "smoothing groups that are neither a number nor off: taken as off");
        say(true, Note::AbsentLists, "indices of texture coordinates or normals in a file that has none: ignored");
        say(true, Note::Unknown, "lines that are no statements of OBJ: ignored");
    }

    /// Reads the MTL files; of two materials with one name the first counts.
    fn libraries(&mut self, geometry: &Geometry) {
        let mut read: Vec<PathBuf> = Vec::new();
        let mut places = Places::default();
        for (line, offset) in &geometry.libraries {
            let at = places.at(self.text, *offset);
            let whole = line.trim_matches('"');
            let found = match files::find(&self.folders, "", whole) {
                Ok(found) => vec![(whole.to_owned(), Ok(found))],
                // Names may have blanks in them, or blanks between them.
                Err(why) => match line.split_whitespace().collect::<Vec<_>>()[..] {
                    [] => Vec::new(),
                    [_] => vec![(whole.to_owned(), Err(why))],
                    ref names => names.iter().map(|n| ((*n).to_owned(), files::find(&self.folders, "", n))).collect(),
                },
            };
            for (name, found) in found {
                match found {
                    Err(why) => self.builder.lose(format!("{at}: mtllib {why}: its materials get the default")),
                    Ok(found) => {
                        found.warning.iter().for_each(|w| self.builder.warn(format!("{at}: mtllib {w}")));
                        if !read.contains(&found.path) {
                            self.library(&name, &found.path);
                            read.push(found.path);
                        }
                    }
                }
            }
        }
    }

    fn library(&mut self, name: &str, path: &Path) {
        let name = name.replace('\\', "/");
        let shown = self.text.file.with_file_name(&name);
        let bytes = match read_file(path) {
            Ok(bytes) => bytes,
            Err(why) => return self.builder.lose(format!("{}: {why}: its materials get the default", shown.display())),
        };
        let (materials, warnings) = mtl::read(&Text::new(&shown, bytes));
        warnings.into_iter().for_each(|w| self.builder.lose(w));
        let folder = name.rsplit_once('/').map_or("", |(folder, _)| folder);
        for mut written in materials {
            material::drop_unused_maps(&mut written);
            let entry = Entry { written, folder: folder.to_owned(), is_used: false };
            self.library.entry(entry.written.name.clone()).or_insert(entry);
        }
    }

    /// The materials that faces use, with their textures, in the order of [`Geometry::materials`]; seconds of decoding are
    /// added to `decode`. `None`: in no file.
    fn materials(&mut self, geometry: &Geometry, options: &LoadOptions, decode: &mut f64) -> Vec<Option<Made>> {
        for place in geometry.parts.iter().filter_map(|part| part.material) {
            if let Some(entry) = self.library.get_mut(&geometry.materials[place].0) {
                entry.is_used = true;
            }
        }
        let used = self.library.values().filter(|entry| entry.is_used);
        let maps = used.flat_map(|e| e.written.maps.all().map(|map| (e.folder.as_str(), map)));
        let before = Instant::now();
        let builder = &mut self.builder;
        let pictures = files::Pictures::load(&self.folders, maps, &mut |note| match note {
            files::Note::Warning(text) => builder.warn(text),
            files::Note::Loss(text) => builder.lose(text),
        });
        *decode += before.elapsed().as_secs_f64();
        let mut textures = texture::Textures::new(pictures);
        let mut made = Vec::with_capacity(geometry.materials.len());
        let mut lost = Vec::new();
        for (name, offset) in &geometry.materials {
            let entry = self.library.get(name);
            made.push(entry.filter(|entry| entry.is_used).map(|entry| {
                let mut material = material::convert(&entry.written, &entry.folder, &mut textures, &mut self.builder);
                // Heights are in the file's units, like its vertices.
                material.bump.factor *= options.obj_scale.unwrap_or(1.0) as f32;
                let reads_textures = material.textures().next().is_some();
                Made { id: self.builder.add_material(material), reads_textures }
            }));
            if entry.is_none() {
                lost.push((name, *offset));
            }
        }
        let before = Instant::now();
        textures.finish(&mut self.builder);
        *decode += before.elapsed().as_secs_f64();
        for entry in self.library.values().filter(|entry| !entry.is_used) {
            self.builder.skip(format!("materials/{}", entry.written.name), "no face uses it");
        }
        if let Some((_, first)) = lost.first() {
            let names = shown(lost.iter().map(|(name, _)| name.as_str()));
            let text =
                format!("{}: no MTL file that was found has the material {names}: the default", self.text.at(*first));
            self.builder.lose(text);
        }
        made
    }

    /// Gives meshes tangents whose material has a normal map.
    fn add_tangents(&mut self, wanted: &[(&Part, Made)], built: &mut [mesh::Built]) {
        for ((_, made), b) in wanted.iter().zip(built) {
            let Some(map) = self.builder.material(made.id).normal.texture else { continue };
            if let Err(TooManyTriangles(n)) = tangents::generate(&mut b.mesh, map.uv_set as usize, map.transform) {
                let name = &b.mesh.name;
                let text =
                    format!("{name}: {n} triangles meet in one vertex, too many for MikkTSpace: any tangents used");
                self.builder.warn(text);
            }
        }
    }

    /// Builds and places a mesh for each part.
    fn meshes(&mut self, geometry: Geometry, materials: &[Option<Made>], options: &LoadOptions) {
        let mut defaults: HashMap<bool, MaterialId> = HashMap::new();
        let is_coloured = !geometry.colors.is_empty();
        let wanted: Vec<(&Part, Made)> = (geometry.parts.iter())
            .map(|part| {
                let known = part.material.and_then(|m| materials[m]);
                let made = known.unwrap_or_else(|| Made {
                    id: *defaults
                        .entry(is_coloured)
                        .or_insert_with(|| self.builder.add_material(material::default(is_coloured))),
                    reads_textures: false,
                });
                (part, made)
            })
            .collect();
        let build = |&(part, made): &(&Part, Made)| mesh::build(&geometry, part, made.id, made.reads_textures);
        let mut built: Vec<mesh::Built> = wanted.par_iter().map(build).collect();
        self.add_tangents(&wanted, &mut built);
        let names =
            |lost: &dyn Fn(&mesh::Built) -> bool| shown(built.iter().filter(|b| lost(b)).map(|b| b.mesh.name.as_str()));
        let crossed: usize = built.iter().map(|b| b.crossed).sum();
        let bare: usize = built.iter().map(|b| b.without_uvs).sum();
        let mut warnings = Vec::new();
        if crossed > 0 {
            let names = names(&|b| b.crossed > 0);
            warnings.push(format!("{crossed} polygons that cross themselves were cut as fans (in {names})"));
        }
        if bare > 0 {
            let names = names(&|b| b.without_uvs > 0);
            warnings
                .push(format!("{bare} vertices below textures have no texture coordinates: taken as 0 (in {names})"));
        }
        if built.iter().any(|b| b.half_coloured) {
            let names = names(&|b| b.half_coloured);
            warnings.push(format!("vertex colours are ignored where only some vertices have one (in {names})"));
        }
        warnings.into_iter().for_each(|w| self.builder.lose(w));
        let world = placement(options);
        let stem = self.text.file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        for mesh::Built { mut mesh, .. } in built {
            if mesh.name.is_empty() {
                mesh.name.clone_from(&stem);
            }
            let name = mesh.name.clone();
            let mesh = self.builder.add_mesh(mesh);
            self.builder.add_instance(Instance { mesh, world_from_object: world, name });
        }
    }
}

/// World from the file's coordinates.
fn placement(options: &LoadOptions) -> DMat4 {
    let scale = options.obj_scale.map_or(DMat4::IDENTITY, |s| DMat4::from_scale(glam::DVec3::splat(s)));
    match options.obj_up {
        ObjUp::Y => scale,
        // Exact, unlike sine and cosine of a right angle: (x, y, z) becomes (x, z, -y).
        ObjUp::Z => {
            let turn = DMat4::from_cols_array(&[1., 0., 0., 0., 0., 0., -1., 0., 0., 1., 0., 0., 0., 0., 0., 1.]);
            turn * scale
        }
    }
}

/// The first few of `names`, quoted.
fn shown<'n>(names: impl Iterator<Item = &'n str>) -> String {
    let names: Vec<String> = names.map(|n| format!("\"{n}\"")).collect();
    match names.len().checked_sub(NAMES_SHOWN) {
        Some(more @ 1..) => format!("{} and {more} more", names[..NAMES_SHOWN].join(", ")),
        _ => names.join(", "),
    }
}

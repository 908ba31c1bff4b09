//! The files that an OBJ and its MTL name: where they are looked for, and pictures decoded once each.

use super::map::Map;
use crate::image::decode::{self, Pixels};
use crate::image::old;
use crate::load::folders::{Folders, read_file};
use crate::texture::Texels;
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// A decoded picture.
#[derive(Debug)]
pub(super) struct Picture {
    pub width: u32,
    pub height: u32,
    pub texels: Texels,
}

/// A file that was found, and what to tell the user about how.
pub(super) struct Found {
    /// Without links.
    pub path: PathBuf,
    pub warning: Option<String>,
}

/// Looks for `name` (`/` or `\` between folders) as it is written, below `folder` (of the file that names it, relative
/// to the input's), then below the input's folder, then by its base name beside either.
pub(super) fn find(folders: &Folders, folder: &str, name: &str) -> Result<Found, String> {
    let path = name.replace('\\', "/");
    let below = |folder: &str, path: &str| match folder {
        "" => path.to_owned(),
        _ => format!("{folder}/{path}"),
    };
    // A drive letter is no relative path either.
    let is_relative = !path.starts_with('/') && path.as_bytes().get(1) != Some(&b':');
    let mut why = match is_relative {
        true => String::new(),
        false => "is absolute; files are read below the input's own folder or --asset-root DIR".to_owned(),
    };
    if is_relative {
        for folder in [folder, ""] {
            match folders.confine(&below(folder, &path)) {
                Ok(path) if path.is_file() => return Ok(Found { path, warning: None }),
                Ok(_) => why = "is not a file".into(),
                // The first place is the one that the file means.
                Err(refused) if why.is_empty() => {
                    why = format!("{} ({})", refused.problem, refused.fix.trim_end_matches('.'))
                }
                Err(_) => {}
            }
        }
    }
    let base = path.rsplit('/').next().unwrap_or_default();
    if !base.is_empty() && base != ".." {
        for folder in [folder, ""] {
            if let Ok(path) = folders.confine(&below(folder, base))
                && path.is_file()
            {
                let warning = Some(format!("\"{name}\" {why}: \"{base}\" beside the file is used"));
                return Ok(Found { path, warning });
            }
        }
    }
    Err(format!("\"{name}\" {why}"))
}

/// The pictures of the maps that materials use.
#[derive(Default)]
pub(super) struct Pictures {
    /// (folder, name as written) to the file.
    found: BTreeMap<(String, String), Option<PathBuf>>,
    decoded: BTreeMap<PathBuf, Picture>,
}

/// What is said about pictures that were looked for.
pub(super) enum Note {
    /// It was found somewhere else.
    Warning(String),
    /// There is none.
    Loss(String),
}

impl Pictures {
    /// Finds and decodes what `maps` name, each with the folder of its MTL file; the rest of the maps lack a picture.
    pub fn load<'m>(
        folders: &Folders,
        maps: impl Iterator<Item = (&'m str, &'m Map)>,
        note: &mut dyn FnMut(Note),
    ) -> Self {
        let mut pictures = Self::default();
        let mut wanted: BTreeMap<PathBuf, &str> = BTreeMap::new();
        let mut seen = BTreeSet::new();
        for (folder, map) in maps {
            let key = (folder.to_owned(), map.file.clone());
            if !seen.insert(key.clone()) {
                continue;
            }
            let path = match find(folders, folder, &map.file) {
                Ok(found) => {
                    found.warning.into_iter().for_each(|w| note(Note::Warning(format!("{}: {w}", map.at))));
                    wanted.entry(found.path.clone()).or_insert(&map.at);
                    Some(found.path)
                }
                Err(why) => {
                    note(Note::Loss(format!("{}: texture {why}: the material goes without it", map.at)));
                    None
                }
            };
            pictures.found.insert(key, path);
        }
        let decode = |(path, at): (PathBuf, &str)| (decode(&path), path, at.to_owned());
        let decoded: Vec<_> = wanted.into_par_iter().map(decode).collect();
        for (result, path, at) in decoded {
            match result {
                Ok(picture) => _ = pictures.decoded.insert(path, picture),
                Err(why) => {
                    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
                    note(Note::Loss(format!("{at}: texture {name}: {why}: the material goes without it")));
                }
            }
        }
        pictures
    }

    /// The file of a map, if it was found and could be decoded.
    pub fn path(&self, folder: &str, map: &Map) -> Option<&Path> {
        let path = self.found.get(&(folder.to_owned(), map.file.clone()))?.as_deref()?;
        self.decoded.contains_key(path).then_some(path)
    }

    /// The decoded picture of a file.
    pub fn get(&self, path: &Path) -> Option<&Picture> {
        self.decoded.get(path)
    }

    /// The same, taken out.
    pub fn take(&mut self, path: &Path) -> Option<Picture> {
        self.decoded.remove(path)
    }
}

fn decode(path: &Path) -> Result<Picture, String> {
    let bytes = read_file(path)?;
    // TGA has no mark of its own, so the name decides.
    let extension = path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase);
    let old = match extension.as_deref() {
        Some("tga" | "icb" | "vda" | "vst") => Some(old::Format::Tga),
        _ if bytes.starts_with(b"BM") => Some(old::Format::Bmp),
        _ => None,
    };
    let decoded = match old {
        Some(format) => old::rgba(&bytes, format),
        None => decode::rgba(&bytes).map(|(pixels, _)| pixels),
    };
    let pixels = decoded.map_err(|e| format!("{}. {}", e.problem, e.fix))?;
    let texels = match pixels.pixels {
        Pixels::Rgba8(texels) => Texels::Rgba8(texels),
        Pixels::Rgba16(texels) => Texels::Rgba16(texels),
    };
    Ok(Picture { width: pixels.width, height: pixels.height, texels })
}

//! Finding an Embree 4 library, opening it and deciding whether it can be used.

use std::ffi::{CStr, OsStr, OsString};
use std::mem::ManuallyDrop;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::error::{LoadError, Reason, Refusal, Version};
use crate::probe::{self, HitLayout};
use crate::raw::{Api, VersionApi, property};

/// Names under which the system's loader is asked for a library, after all folders.
const SYSTEM_NAMES: &[&str] = if cfg!(windows) {
    &["embree4.dll"]
} else if cfg!(target_os = "macos") {
    &["libembree4.4.dylib", "libembree4.dylib"]
} else {
    &["libembree4.so.4", "libembree4.so"]
};

/// Sub-folders of a folder that are searched too: an installed tree, an unpacked `embreex` wheel.
const SUB_FOLDERS: &[&str] = &["lib", "lib64", "embreex.libs"];

/// An Embree 4 library that was opened, checked and found usable.
///
/// The library stays loaded until the process ends, also after the last `Arc` is gone and also when
/// it was opened and then refused: its TBB threads may still run code in it.
pub struct Library {
    pub(crate) version_api: VersionApi,
    pub(crate) api: Api,
    path: PathBuf,
    version: Version,
    layout: HitLayout,
    refused: Vec<Refusal>,
}

impl Library {
    /// The first usable library of `candidates`, each a file; a name without a folder is left to the
    /// system's loader.
    ///
    /// A candidate is code: opening it runs it. Pass only paths that are trusted as much as the
    /// program itself.
    pub fn load<P: AsRef<Path>>(candidates: &[P]) -> Result<Arc<Self>, LoadError> {
        let files = candidates.iter().map(|path| Ok(path.as_ref().to_path_buf()));
        Self::first_usable(files.collect())
    }

    /// The first usable library in this order:
    ///
    /// 1. the folder (or file) that the environment variable `EMBREE_DIR` names,
    /// 2. each of `folders`,
    /// 3. the system's `libembree4.so.4` and `libembree4.so`.
    ///
    /// A folder is searched for `libembree4*.so*`, then its sub-folders `lib`, `lib64` and
    /// `embreex.libs`; several matches in one folder are tried in the order of their names. The search goes
    /// on after a candidate that cannot be used; [`Library::refused`] and [`LoadError`] tell why each
    /// was not.
    pub fn find<P: AsRef<Path>>(folders: &[P]) -> Result<Arc<Self>, LoadError> {
        Self::search(std::env::var_os("EMBREE_DIR"), folders, SYSTEM_NAMES)
    }

    fn search<P: AsRef<Path>>(
        embree_dir: Option<OsString>,
        folders: &[P],
        system_names: &[&str],
    ) -> Result<Arc<Self>, LoadError> {
        let mut candidates = Vec::new();
        if let Some(dir) = embree_dir.filter(|dir| !dir.is_empty()) {
            if Path::new(&dir).is_file() {
                candidates.push(Ok(dir.into()));
            } else {
                candidates.extend(libraries_in(Path::new(&dir)));
            }
        }
        for folder in folders {
            candidates.extend(libraries_in(folder.as_ref()));
        }
        candidates.extend(system_names.iter().map(|name| Ok(PathBuf::from(name))));
        Self::first_usable(candidates)
    }

    fn first_usable(candidates: Vec<Result<PathBuf, Refusal>>) -> Result<Arc<Self>, LoadError> {
        let mut refused = Vec::new();
        for candidate in candidates {
            let opened = candidate.and_then(|path| Self::open(&path).map_err(|reason| Refusal { path, reason }));
            match opened {
                Ok(library) => return Ok(Arc::new(Self { refused, ..library })),
                Err(refusal) => refused.push(refusal),
            }
        }
        Err(LoadError { refused })
    }

    fn open(path: &Path) -> Result<Self, Reason> {
        // SAFETY: runs the initialisers of a file that the caller trusts; documented at `load`.
        let opened =
            unsafe { libloading::Library::new(path) }.map_err(|error| Reason::Open(open_error_text(&error, path)))?;
        // Never closed, see the type's documentation.
        let opened = ManuallyDrop::new(opened);

        // SAFETY: these functions have the same signatures in Embree 3 and 4; the library stays open.
        let version_api = unsafe { VersionApi::load(&opened) }.map_err(Reason::MissingSymbol)?;
        let version = ask_version(&version_api)?;
        if version.major != 4 {
            return Err(Reason::Version(version));
        }
        // SAFETY: the library says that it is Embree 4, and it stays open.
        let api = unsafe { Api::load(&opened) }.map_err(Reason::MissingSymbol)?;
        // SAFETY: both tables belong to an Embree 4.
        let layout =
            unsafe { probe::hit_layout(&version_api, &api) }.map_err(|detail| Reason::Layout { version, detail })?;
        Ok(Self { version_api, api, path: path.to_path_buf(), version, layout, refused: Vec::new() })
    }

    /// The file that was opened, or the name that the system's loader was asked for.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The library's version.
    pub fn version(&self) -> Version {
        self.version
    }

    /// What the library's hits look like in memory, as found by probe rays.
    pub fn hit_layout(&self) -> HitLayout {
        self.layout
    }

    /// The candidates that were tried before this one, and why they were not used.
    pub fn refused(&self) -> &[Refusal] {
        &self.refused
    }
}

impl std::fmt::Debug for Library {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Library")
            .field("path", &self.path)
            .field("version", &self.version)
            .field("layout", &self.layout)
            .finish_non_exhaustive()
    }
}

/// The version that the library reports, which takes a device.
fn ask_version(api: &VersionApi) -> Result<Version, Reason> {
    // SAFETY: a NUL-terminated configuration; the device is released before it is forgotten.
    unsafe {
        let device = (api.new_device)(c"threads=1".as_ptr());
        if device.is_null() {
            return Err(Reason::Device(device_creation_error(api).1));
        }
        let number = (api.get_device_property)(device, property::VERSION);
        (api.release_device)(device);
        Ok(Version::from_number(number))
    }
}

/// The code and words of a failed `rtcNewDevice` in this thread.
pub(crate) fn device_creation_error(api: &VersionApi) -> (i32, String) {
    // SAFETY: a null device asks for the thread's error.
    let code = unsafe { (api.get_device_error)(std::ptr::null_mut()) };
    let Some(last_message) = api.get_device_last_error_message else {
        return (code, format!("error {code}"));
    };
    // SAFETY: as above; Embree returns a NUL-terminated text or null.
    let message = unsafe {
        let text = last_message(std::ptr::null_mut());
        if text.is_null() { String::new() } else { CStr::from_ptr(text).to_string_lossy().into_owned() }
    };
    (code, message)
}

/// The files that look like Embree 4 in `folder` and its known sub-folders, absolute, or why there
/// are none.
fn libraries_in(folder: &Path) -> Vec<Result<PathBuf, Refusal>> {
    let refuse = |reason| vec![Err(Refusal { path: folder.to_path_buf(), reason })];
    if !folder.is_dir() {
        return refuse(Reason::NoFolder);
    }
    // A relative path without a slash would send the system's loader to its own folders.
    let absolute = std::path::absolute(folder).unwrap_or_else(|_| folder.to_path_buf());
    let mut files = libraries_directly_in(&absolute);
    for sub_folder in SUB_FOLDERS {
        files.extend(libraries_directly_in(&absolute.join(sub_folder)));
    }
    // libembree4.so -> libembree4.so.4 -> libembree4.so.4.4.0 are one candidate.
    let mut seen = Vec::new();
    files.retain(|file| {
        let target = file.canonicalize().unwrap_or_else(|_| file.clone());
        let is_new = !seen.contains(&target);
        seen.push(target);
        is_new
    });
    if files.is_empty() {
        return refuse(Reason::NothingFound);
    }
    files.into_iter().map(Ok).collect()
}

fn libraries_directly_in(folder: &Path) -> Vec<PathBuf> {
    let Ok(entries) = folder.read_dir() else {
        return Vec::new();
    };
    let mut files: Vec<PathBuf> = entries
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|path| path.file_name().is_some_and(is_library_name) && path.is_file())
        .collect();
    files.sort();
    files
}

fn is_library_name(name: &OsStr) -> bool {
    let name = name.to_string_lossy();
    if cfg!(windows) {
        name.starts_with("embree4") && name.ends_with(".dll")
    } else if cfg!(target_os = "macos") {
        name.starts_with("libembree4") && name.ends_with(".dylib")
    } else {
        name.starts_with("libembree4") && (name.ends_with(".so") || name.contains(".so."))
    }
}

/// The loader's own words, which `libloading` keeps behind its own, without the path that messages
/// begin with anyway.
fn open_error_text(error: &libloading::Error, path: &Path) -> String {
    use std::error::Error as _;
    let text = error.source().map_or_else(|| error.to_string(), |source| source.to_string());
    let prefix = format!("{}: ", path.display());
    text.strip_prefix(&prefix).unwrap_or(&text).to_owned()
}

#[cfg(test)]
#[path = "library_tests.rs"]
mod tests;

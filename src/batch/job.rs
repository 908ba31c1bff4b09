//! Which cameras of which inputs go to which output names; clashes are found before anything is rendered.

use super::input::{Input, extension_rank};
use super::names::{NameFields, NameTemplate, camera_labels};
use super::peek;
use super::settings::Task;
use std::collections::HashMap;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

/// Which cameras of a file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum CameraChoice {
    /// Every one; of a file without cameras, the one framed on its bounds.
    #[default]
    All,
    /// One by its place.
    Index(usize),
    /// One by its name.
    Name(String),
}

impl CameraChoice {
    /// The chosen of the cameras called `names`, as indices.
    ///
    /// # Errors
    /// There is no such camera; the text says which there are.
    pub fn select(&self, names: &[String]) -> Result<Vec<usize>, String> {
        // A file without cameras has one, framed on its bounds.
        let count = names.len().max(1);
        let found = match self {
            Self::All => return Ok((0..count).collect()),
            Self::Index(index) => (*index < count).then_some(*index),
            Self::Name(name) => names.iter().position(|n| n == name),
        };
        found.map(|index| vec![index]).ok_or_else(|| {
            let wanted = match self {
                Self::Index(index) => index.to_string(),
                Self::Name(name) => format!("{name:?}"),
                Self::All => unreachable!("all cameras are always found"),
            };
            let list: Vec<_> = names.iter().enumerate().map(|(i, name)| format!("{i} {name:?}")).collect();
            let there = if list.is_empty() { "0, framed on the bounds".into() } else { list.join(", ") };
            format!("--camera {wanted}: there is no such camera\n  The scene has: {there}.")
        })
    }
}

/// How the outputs of one input are named.
#[derive(Clone, Debug)]
pub struct Naming {
    folder: PathBuf,
    stem: String,
    parent: String,
    template: Option<NameTemplate>,
    /// Several frames are asked for.
    has_frames: bool,
}

impl Naming {
    /// Output path without extension, below the output folder, of the camera called `label`; `several` cameras of the
    /// file are rendered.
    pub fn output(&self, label: &str, several: bool, frame: Option<u32>) -> PathBuf {
        let number = frame.unwrap_or(0);
        let name = match &self.template {
            Some(template) => {
                let fields = NameFields { stem: &self.stem, parent: &self.parent, camera: label, frame: number };
                template.fill(&fields)
            }
            None => {
                let camera = if several { format!(".{label}") } else { String::new() };
                let frame = if self.has_frames { format!(".{number:04}") } else { String::new() };
                format!("{}{camera}{frame}", self.stem)
            }
        };
        self.folder.join(name)
    }

    /// Outputs of the cameras `chosen` out of those called `names`, in one frame.
    pub fn outputs(&self, names: &[String], chosen: &[usize], frame: Option<u32>) -> Vec<PathBuf> {
        let labels = labels_of(names);
        chosen.iter().map(|&i| self.output(&labels[i], chosen.len() > 1, frame)).collect()
    }
}

/// One label per camera; a file without cameras has one, called `0`.
fn labels_of(names: &[String]) -> Vec<String> {
    if names.is_empty() { vec!["0".into()] } else { camera_labels(names) }
}

/// Output names of every task, and the task (by index) to which each name belongs.
#[derive(Clone, Debug, Default)]
pub struct Plan {
    /// For each task.
    pub namings: Vec<Naming>,
    /// For each task, the names of its cameras as far as they are known without loading: to be checked again.
    pub cameras: Vec<Vec<String>>,
    /// For each task, its frames: one that is none where the file is rendered as written.
    pub frames: Vec<Vec<Option<u32>>>,
    /// Output path without extension to task.
    pub owners: HashMap<PathBuf, usize>,
}

/// Names for the outputs of all `tasks`; `elsewhere` has, for each of them, the names of the cameras that it is to be
/// seen by, if not by its own.
///
/// # Errors
/// Two images would write one file, or a name is reserved: says which, and the `--name` that would tell them apart.
pub fn plan(tasks: &[Task], elsewhere: &[Option<Vec<String>>]) -> Result<Plan, String> {
    let cameras: Vec<Vec<String>> = (tasks.iter().zip(elsewhere))
        .map(|(Task { input, settings }, elsewhere)| match (&input.problem, elsewhere) {
            (Some(_), _) => Vec::new(),
            (None, Some(names)) => names.clone(),
            (None, None) => peek::camera_names(&input.path, settings.load.scene.as_deref()).unwrap_or_default(),
        })
        .collect();
    let frames: Vec<Vec<Option<u32>>> = tasks.iter().map(frames_of).collect();
    let named = try_plan(tasks, None, &cameras, &frames).map_err(|clash| {
        const CANDIDATES: [&str; 10] = [
            // By camera only after by folder: names of cameras differ by luck between files.
            "{parent}-{stem}",
            "{stem}.{camera}",
            "{parent}-{stem}.{camera}",
            "{stem}-render",
            "{parent}/{stem}",
            "{parent}/{stem}.{camera}",
            "{stem}.{frame:04}",
            "{parent}-{stem}.{frame:04}",
            "{stem}.{camera}.{frame:04}",
            "{parent}/{stem}.{camera}.{frame:04}",
        ];
        let works = |candidate: &&&str| {
            let candidate = NameTemplate::parse(candidate).expect("the candidates are valid templates");
            try_plan(tasks, Some(&candidate), &cameras, &frames).is_ok()
        };
        match CANDIDATES.iter().find(works) {
            Some(name) => format!("{clash}\n  Use --name '{name}' to tell them apart."),
            None => format!("{clash}\n  Render them in separate runs with different --out."),
        }
    });
    Ok(Plan { cameras, frames, ..named? })
}

/// The frames of a task.
fn frames_of(Task { input, settings }: &Task) -> Vec<Option<u32>> {
    match (&settings.frames, &input.problem) {
        (Some(frames), None) => frames.numbers(&input.path, &settings.load).into_iter().map(Some).collect(),
        (Some(_), Some(_)) => vec![Some(0)],
        (None, _) => vec![None],
    }
}

/// With the template `instead` in place of the tasks' own, if there is one.
fn try_plan(
    tasks: &[Task],
    instead: Option<&NameTemplate>,
    names: &[Vec<String>],
    frames: &[Vec<Option<u32>>],
) -> Result<Plan, String> {
    let mut plan = Plan::default();
    // What decides about a plain stem: the first type of a stem in a folder. By hash, as a batch may have 10^5 files.
    let mut first_types: HashMap<(&Path, Option<&Path>, Option<&OsStr>), usize> = HashMap::new();
    for Task { input, .. } in tasks.iter().filter(|task| task.input.problem.is_none()) {
        if let Some(rank) = extension_rank(&input.path) {
            let first = first_types.entry(stem_key(input)).or_insert(rank);
            *first = rank.min(*first);
        }
    }
    for (index, Task { input, settings }) in tasks.iter().enumerate() {
        let is_shadowed =
            first_types.get(&stem_key(input)).is_some_and(|first| Some(*first) < extension_rank(&input.path));
        let has_frames = frames[index].len() > 1;
        let naming = Naming { has_frames, ..naming(input, is_shadowed, instead.or(settings.name.as_ref())) };
        if input.problem.is_none() {
            // A camera that is not there fails this file later; it writes under one name all the same.
            let chosen = settings.cameras.select(&names[index]).unwrap_or_else(|_| vec![0]);
            let of_frame = |frame: &Option<u32>| naming.outputs(&names[index], &chosen, *frame);
            for output in frames[index].iter().flat_map(of_frame) {
                check_reserved(&output, &input.path)?;
                if let Some(other) = plan.owners.insert(output.clone(), index) {
                    let (output, path) = (output.display(), input.path.display());
                    return Err(if other == index {
                        let what = if has_frames && chosen.len() == 1 { "frames" } else { "cameras" };
                        let what = if has_frames && chosen.len() > 1 { "cameras or frames" } else { what };
                        format!("{path}: several {what} would be written to one name, {output}")
                    } else {
                        let other = tasks[other].input.path.display();
                        format!("{other} and {path} would both be written to {output}")
                    });
                }
            }
        }
        plan.namings.push(naming);
    }
    Ok(plan)
}

/// What inputs that compete for a plain output name have in common: output folder, folder, stem.
fn stem_key(input: &Input) -> (&Path, Option<&Path>, Option<&OsStr>) {
    (&input.folder, input.path.parent(), input.path.file_stem())
}

/// `batch.json` and `index.html` at the top of the output folder belong to the run.
fn check_reserved(output: &Path, input: &Path) -> Result<(), String> {
    match output.to_str() {
        Some(name @ ("batch" | "index")) => {
            Err(format!("{}: the output name {name:?} is reserved for the run's own report", input.display()))
        }
        _ => Ok(()),
    }
}

/// `is_shadowed`: a type that comes earlier in the list has the same stem, so this one adds its extension.
fn naming(input: &Input, is_shadowed: bool, template: Option<&NameTemplate>) -> Naming {
    let text = |part: Option<&OsStr>| part.map(|p| p.to_string_lossy().into_owned()).unwrap_or_default();
    let is_shadowed = is_shadowed && template.is_none();
    let stem = text(if is_shadowed { input.path.file_name() } else { input.path.file_stem() });
    let parent = std::path::absolute(&input.path).unwrap_or_else(|_| input.path.clone());
    let parent = parent.parent().map(|p| p.canonicalize().unwrap_or_else(|_| p.to_owned())).unwrap_or_default();
    Naming {
        folder: input.folder.clone(),
        stem,
        parent: text(parent.file_name()),
        template: template.cloned(),
        has_frames: false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::batch::settings::{BatchSettings, FileSettings};

    fn tasks(paths: &[&str], template: Option<&str>) -> Vec<Task> {
        let input = |path: &&str| Input { path: path.into(), folder: PathBuf::new(), problem: None };
        let name = template.map(|t| NameTemplate::parse(t).unwrap());
        BatchSettings::tasks_for(paths.iter().map(input).collect(), FileSettings { name, ..FileSettings::default() })
    }

    fn outputs(paths: &[&str], template: Option<&str>, cameras: &[&[&str]]) -> Result<Vec<String>, String> {
        let names: Vec<Vec<String>> = cameras.iter().map(|c| c.iter().map(|n| n.to_string()).collect()).collect();
        let plan = try_plan(&tasks(paths, template), None, &names, &vec![vec![None]; paths.len()])?;
        let outputs = plan.namings.iter().zip(&names);
        let all = |names: &[String]| CameraChoice::All.select(names).unwrap();
        Ok(outputs
            .flat_map(|(n, names)| n.outputs(names, &all(names), None))
            .map(|p| p.to_str().unwrap().into())
            .collect())
    }

    #[test]
    fn one_camera_takes_the_stem_and_several_add_theirs() {
        assert_eq!(outputs(&["s/a.gltf"], None, &[&[]]).unwrap(), ["a"]);
        assert_eq!(outputs(&["s/a.gltf"], None, &[&["Main"]]).unwrap(), ["a"]);
        assert_eq!(outputs(&["s/a.b.gltf"], None, &[&["Main", ""]]).unwrap(), ["a.b.Main", "a.b.1"]);
        assert_eq!(outputs(&["s/a.gltf"], Some("{parent}-{camera}"), &[&[]]).unwrap(), ["s-0"]);
    }

    #[test]
    fn another_type_of_the_same_stem_adds_its_extension() {
        assert_eq!(outputs(&["s/a.glb", "s/a.gltf"], None, &[&[], &[]]).unwrap(), ["a.glb", "a"]);
        assert!(outputs(&["s/a.glb", "t/a.gltf"], None, &[&[], &[]]).is_err());
    }

    #[test]
    fn clashes_and_reserved_names_are_refused_with_a_name_that_works() {
        let refused = |paths: &[&str]| plan(&tasks(paths, None), &vec![None; paths.len()]).unwrap_err();
        let clash = refused(&["s/a.gltf", "t/a.gltf"]);
        assert!(clash.contains("s/a.gltf and t/a.gltf would both") && clash.contains("--name '{parent}-{stem}'"));
        let reserved = refused(&["s/batch.gltf"]);
        assert!(reserved.contains("reserved") && reserved.contains("--name '{parent}-{stem}'"), "{reserved}");
        let cameras = outputs(&["s/a.gltf"], Some("{stem}"), &[&["Main", "Side"]]).unwrap_err();
        assert!(cameras.contains("several cameras"), "{cameras}");
        assert!(outputs(&["s/a.gltf", "s/a.Main.gltf"], None, &[&["Main", "Side"], &[]]).is_err());
    }

    #[test]
    fn a_missing_camera_lists_those_that_are_there() {
        let names = ["Main".to_string(), String::new()];
        assert_eq!(CameraChoice::Name("Main".into()).select(&names).unwrap(), [0]);
        assert_eq!(CameraChoice::Index(0).select(&[]).unwrap(), [0]);
        let error = CameraChoice::Index(2).select(&names).unwrap_err();
        assert!(error.contains("--camera 2") && error.contains("0 \"Main\", 1 \"\""), "{error}");
    }
}

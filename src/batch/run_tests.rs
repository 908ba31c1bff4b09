//! Tests of the engine.

use super::*;
use crate::batch::FileSettings;
use crate::batch::input::expand;
use crate::render::RenderSettings;

/// Remembers what it was told.
#[derive(Default)]
struct Listener {
    planned: usize,
    started: Vec<ImageId>,
    finished: Vec<(ImageId, ImageReport)>,
    /// Set when that many images are finished.
    cancel_after: Option<(usize, Arc<AtomicBool>)>,
}

impl Observer for Listener {
    fn planned(&mut self, images: usize) {
        self.planned = images;
    }

    fn started(&mut self, image: &Started) {
        self.started.push(image.id);
    }

    fn finished(&mut self, id: ImageId, image: &ImageReport) {
        self.finished.push((id, image.clone()));
        if let Some((_, cancel)) = self.cancel_after.as_ref().filter(|(count, _)| *count == self.finished.len()) {
            cancel.store(true, Ordering::Relaxed);
        }
    }
}

const TRIANGLE: &str = include_str!("../../tests/data/triangle.gltf");

fn settings(out: &Path, inputs: &[PathBuf]) -> BatchSettings {
    let render = RenderSettings { spp: 1, accel: crate::render::AccelChoice::Bvh, ..RenderSettings::default() };
    let file = FileSettings { size: PictureSize::Exact(4, 2), render, ..FileSettings::default() };
    BatchSettings {
        tasks: BatchSettings::tasks_for(expand(inputs), file),
        out: out.to_owned(),
        threads: Some(2),
        ..BatchSettings::default()
    }
}

fn triangles(folder: &Path, count: usize) -> Vec<PathBuf> {
    let write = |i| {
        let path = folder.join(format!("t{i:03}.gltf"));
        std::fs::write(&path, TRIANGLE).unwrap();
        path
    };
    (0..count).map(write).collect()
}

#[test]
fn images_are_finished_in_the_order_of_the_plan_and_their_files_are_written() {
    let root = tempfile::tempdir().unwrap();
    let inputs = triangles(root.path(), 7);
    let out = root.path().join("out");
    let mut listener = Listener::default();
    let outcome = run(settings(&out, &inputs), &mut listener).unwrap();
    assert_eq!((outcome.exit_code(), listener.planned), (0, 7));
    let ids: Vec<_> = (0..7).collect();
    assert_eq!(listener.started, ids);
    assert_eq!(listener.finished.iter().map(|f| f.0).collect::<Vec<_>>(), ids);
    for (path, (_, image)) in inputs.iter().zip(&listener.finished) {
        assert_eq!((image.input.as_str(), image.status), (path.to_str().unwrap(), Status::Rendered));
        for output in [&image.outputs.exr, &image.outputs.png, &image.outputs.json] {
            assert!(Path::new(output.as_ref().unwrap()).is_file(), "{output:?}");
        }
        let text = std::fs::read_to_string(image.outputs.json.as_ref().unwrap()).unwrap();
        let json: ImageReport = serde_json::from_str(&text).unwrap();
        assert_eq!(json.outputs, image.outputs);
        assert!(json.estimated_error.is_none() && json.rays.unwrap().total >= 8);
    }
}

#[test]
fn an_output_that_cannot_be_written_stops_the_run_with_4_and_the_rest_is_reported() {
    let root = tempfile::tempdir().unwrap();
    let inputs = triangles(root.path(), 6);
    let out = root.path().join("out");
    std::fs::create_dir_all(out.join("t001.exr/inside")).unwrap();
    let outcome = run(settings(&out, &inputs), &mut Listener::default()).unwrap();
    assert_eq!(outcome.exit_code(), 4);
    assert!(outcome.unwritable.unwrap().to_string().contains("t001.exr"));
    let statuses: Vec<_> = outcome.report.images.iter().map(|image| image.status).collect();
    assert_eq!(statuses[..2], [Status::Rendered, Status::Failed]);
    assert_eq!(statuses[2..], [Status::Interrupted; 4]);
    assert!(!out.join("t001.png").exists() && !out.join("t001.json").exists());
}

#[test]
fn a_run_that_is_asked_to_end_keeps_what_is_finished_and_says_75() {
    let root = tempfile::tempdir().unwrap();
    let inputs = triangles(root.path(), 40);
    let out = root.path().join("out");
    let settings = settings(&out, &inputs);
    let mut listener = Listener { cancel_after: Some((3, Arc::clone(&settings.cancel))), ..Listener::default() };
    let outcome = run(settings, &mut listener).unwrap();
    assert_eq!((outcome.exit_code(), outcome.report.images.len()), (75, 40));
    let rendered = outcome.report.counts[&Status::Rendered];
    // What was under way between the threads may still have been finished.
    assert!((3..20).contains(&rendered) && rendered + outcome.report.counts[&Status::Interrupted] == 40);
    for (i, image) in outcome.report.images.iter().enumerate() {
        assert_eq!(image.status == Status::Rendered, i < rendered, "image {i}");
        assert_eq!(out.join(format!("t{i:03}.json")).exists(), i < rendered, "image {i}");
    }
    let left: Vec<_> = std::fs::read_dir(&out).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert!(left.iter().all(|name| !name.to_string_lossy().ends_with(".tmp")), "{left:?}");
}

#[test]
fn a_picture_that_takes_for_ever_is_dropped_within_a_second() {
    let root = tempfile::tempdir().unwrap();
    let mut settings = settings(&root.path().join("out"), &triangles(root.path(), 1));
    let file = Arc::make_mut(&mut settings.tasks[0].settings);
    (file.size, file.render.spp) = (PictureSize::Exact(2048, 2048), 1 << 20);
    let cancel = Arc::clone(&settings.cancel);
    let stopper = std::thread::spawn(move || {
        std::thread::sleep(Duration::from_millis(200));
        cancel.store(true, Ordering::Relaxed);
        Instant::now()
    });
    let outcome = run(settings, &mut Listener::default()).unwrap();
    let waited = stopper.join().unwrap().elapsed();
    assert_eq!((outcome.exit_code(), outcome.report.images[0].status), (75, Status::Interrupted));
    // Bounds a wait, not a speed: without a way out this takes a day.
    assert!(waited < Duration::from_secs(20), "{waited:?}");
    assert!(!root.path().join("out/t000.exr").exists());
}

#[test]
fn an_empty_scene_is_no_failure_unless_strict() {
    let root = tempfile::tempdir().unwrap();
    let path = root.path().join("empty.gltf");
    std::fs::write(&path, r#"{"asset": {"version": "2.0"}, "scenes": [{}]}"#).unwrap();
    let out = root.path().join("out");
    for (strict, code) in [(false, 0), (true, 1)] {
        let settings = BatchSettings { strict, ..settings(&out, std::slice::from_ref(&path)) };
        let outcome = run(settings, &mut Listener::default()).unwrap();
        assert_eq!((outcome.exit_code(), outcome.report.images[0].status), (code, Status::Empty));
    }
    assert!(out.join("empty.json").exists() && !out.join("empty.exr").exists());
}

#[test]
fn strict_fails_where_something_of_the_file_is_not_in_the_picture() {
    let root = tempfile::tempdir().unwrap();
    let path = root.path().join("a.obj");
    std::fs::write(&path, "mtllib nosuch.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    for (strict, code) in [(false, 0), (true, 1)] {
        let settings = BatchSettings { strict, ..settings(&root.path().join("out"), std::slice::from_ref(&path)) };
        let outcome = run(settings, &mut Listener::default()).unwrap();
        let image = &outcome.report.images[0];
        // What was lost then is lost now, although the picture need not be rendered again.
        let status = if strict { Status::UpToDate } else { Status::Rendered };
        assert_eq!((outcome.exit_code(), image.status), (code, status));
        assert!(image.losses[0].contains("nosuch.mtl") && image.warnings.contains(&image.losses[0]), "{image:?}");
    }
}

#[test]
fn an_input_that_vanishes_between_listing_and_loading_fails_alone() {
    let root = tempfile::tempdir().unwrap();
    let inputs = triangles(root.path(), 3);
    let settings = settings(&root.path().join("out"), &inputs);
    std::fs::remove_file(&inputs[1]).unwrap();
    let outcome = run(settings, &mut Listener::default()).unwrap();
    let statuses: Vec<_> = outcome.report.images.iter().map(|image| image.status).collect();
    assert_eq!(statuses, [Status::Rendered, Status::Failed, Status::Rendered]);
    assert!(outcome.report.images[1].error_message.as_ref().unwrap().contains("t001.gltf"));
    assert_eq!(outcome.exit_code(), 1);
}

#[test]
fn a_panic_in_one_image_stays_with_it() {
    let root = tempfile::tempdir().unwrap();
    let mut settings = settings(&root.path().join("out"), &triangles(root.path(), 3));
    // A number of lanes that no processor has: `render` panics, as its documentation says.
    Arc::make_mut(&mut settings.tasks[1].settings).render.lanes = Some(3);
    let outcome = run(settings, &mut Listener::default()).unwrap();
    let statuses: Vec<_> = outcome.report.images.iter().map(|image| image.status).collect();
    assert_eq!(statuses, [Status::Rendered, Status::Failed, Status::Rendered]);
    let message = outcome.report.images[1].error_message.as_ref().unwrap();
    assert!(message.contains("t001.gltf") && message.contains("internal error: 3 lanes"), "{message}");
    assert_eq!(outcome.exit_code(), 1);
}

#[test]
fn bad_inputs_are_reported_and_the_exit_code_is_3() {
    let root = tempfile::tempdir().unwrap();
    let path = root.path().join("broken.gltf");
    std::fs::write(&path, "{").unwrap();
    let out = root.path().join("out");
    let outcome = run(settings(&out, &[path, root.path().join("*.glb")]), &mut Listener::default()).unwrap();
    assert_eq!((outcome.exit_code(), outcome.bad_inputs), (3, 2));
    assert!(out.join("broken.json").is_file() && out.join("batch.json").is_file());
    assert!(!out.join("*.json").exists());
}

//! Tests of the engine that need no renderer.

use super::*;
use crate::render::{CropWindow, FrameCamera, RenderStats};

struct Silent;
impl Observer for Silent {}

fn settings(out: &Path, inputs: Vec<PathBuf>) -> BatchSettings {
    BatchSettings {
        inputs,
        out: out.to_owned(),
        name: None,
        size: PictureSize::Exact(4, 2),
        camera_source: CameraSource::Inputs,
        cameras: CameraChoice::All,
        load: LoadOptions::default(),
        render: RenderSettings::default(),
        files: FileOptions::default(),
        command: "prt-batch".into(),
    }
}

fn frame() -> Frame {
    Frame {
        width: 4,
        height: 2,
        window: CropWindow { x: 0, y: 0, width: 4, height: 2 },
        pixels: vec![[0.5; 3]; 8],
        spp: 4,
        camera: FrameCamera {
            world_from_camera: glam::DMat4::IDENTITY,
            projection: crate::camera::Projection::Perspective { yfov: 1.0, aspect_ratio: None },
            aspect_ratio: 2.0,
        },
        stats: RenderStats { camera_rays: 30, shadow_rays: 12, render_seconds: 2e-6, ..RenderStats::default() },
    }
}

fn under_way<'a>(settings: &'a BatchSettings, observer: &'a mut Silent) -> Run<'a> {
    Run {
        settings,
        observer,
        plan: Plan::default(),
        elsewhere: None,
        images: Vec::new(),
        bad_inputs: 0,
        unwritable: None,
    }
}

#[test]
fn a_frame_becomes_three_files_and_its_report_names_them() {
    let root = tempfile::tempdir().unwrap();
    let settings = settings(root.path(), vec![]);
    let mut observer = Silent;
    let mut run = under_way(&settings, &mut observer);
    let mut image = run.blank(Path::new("s/a.gltf"));
    describe(&frame(), &settings.render, &mut image);
    run.write_pictures(&frame(), &settings.render, Path::new("sub/a.Main"), &mut image);
    run.finish(image, Some("sub/a.Main".into()));
    let image = &run.images[0];
    assert_eq!(image.status, Status::Rendered);
    assert!((image.mrays_per_s.unwrap() - 21.0).abs() < 1e-9);
    for output in [&image.outputs.exr, &image.outputs.png, &image.outputs.json] {
        assert!(Path::new(output.as_ref().unwrap()).is_file(), "{output:?}");
    }
    let text = std::fs::read_to_string(root.path().join("sub/a.Main.json")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(json["outputs"]["json"].as_str(), image.outputs.json.as_deref());
    assert!(json["estimated_error"].is_null() && json["rays"]["total"] == 42);
}

#[test]
fn an_output_that_cannot_be_written_stops_the_run_with_4() {
    let root = tempfile::tempdir().unwrap();
    std::fs::create_dir_all(root.path().join("a.exr/inside")).unwrap();
    let settings = settings(root.path(), vec![]);
    let mut observer = Silent;
    let mut run = under_way(&settings, &mut observer);
    let mut image = run.blank(Path::new("a.gltf"));
    run.write_pictures(&frame(), &settings.render, Path::new("a"), &mut image);
    assert!(image.status == Status::Failed && image.error_message.unwrap().contains("a.exr"));
    assert!(run.unwritable.is_some());
    assert!(!root.path().join("a.png").exists());
}

#[test]
fn an_empty_scene_is_no_failure() {
    let root = tempfile::tempdir().unwrap();
    let settings = settings(root.path(), vec![]);
    let mut observer = Silent;
    let mut run = under_way(&settings, &mut observer);
    let mut image = run.blank(Path::new("a.gltf"));
    run.image(&Scene::default(), 0, Path::new("a"), &Progress::default(), &mut image);
    assert_eq!(image.status, Status::Empty);
    assert!(!root.path().join("a.exr").exists());
}

#[test]
fn a_panic_becomes_an_error_with_its_text() {
    let error = guarded::<()>(|| panic!("index {} out of range", 7)).unwrap_err();
    assert!(error.contains("internal error: index 7 out of range"), "{error}");
}

#[test]
fn bad_inputs_are_reported_and_the_exit_code_is_3() {
    let root = tempfile::tempdir().unwrap();
    let path = root.path().join("broken.gltf");
    std::fs::write(&path, "{").unwrap();
    let out = root.path().join("out");
    let outcome = run(&settings(&out, vec![path, root.path().join("*.glb")]), &mut Silent).unwrap();
    assert_eq!((outcome.exit_code(), outcome.bad_inputs), (3, 2));
    assert!(out.join("broken.json").is_file() && out.join("batch.json").is_file());
    assert!(!out.join("*.json").exists());
}

//! Which scenes get the built-in studio under `--default-light auto`. Nothing here is random but the pixels, of which
//! only "black or not" is asked.

mod support;

use glam::DVec3;
use prt::load::{LoadOptions, load};
use prt::render::{DefaultLight, Emitted, LEAST_EMITTED, RenderSettings, prepare};
use prt::scene::{Scene, SceneBuilder};
use std::path::{Path, PathBuf};
use support::pictures::{settings, shoot};
use support::scenes;

/// Whether `auto` switches the studio on, and what surfaces emit.
fn auto(scene: &Scene) -> (bool, Emitted) {
    let prepared = prepare(scene, &settings(4, 1, 0)).unwrap_or_else(|e| panic!("{e}"));
    (prepared.default_light.used, prepared.default_light.emitted)
}

#[test]
fn scenes_with_light_of_their_own_keep_it() {
    for name in scenes::REFERENCE {
        let (used, emitted) = auto(&scenes::reference(name));
        println!("{name}: {emitted:?}");
        assert!(!used, "{name} has light of its own: {emitted:?}");
    }
}

#[test]
fn example_scenes_keep_their_light() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    for path in files(&folder) {
        let (scene, _) = load(&path, &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"));
        let (used, emitted) = auto(&scene);
        // The forest is one under the studio's sky.
        assert_eq!(used, path.ends_with("forest.gltf"), "{}: {emitted:?}", path.display());
    }
}

/// A grey floor and nothing else.
fn unlit_floor() -> Scene {
    let mut builder = SceneBuilder::new(0);
    let grey = builder.add_material(scenes::lambert(0.5));
    scenes::add_floor(&mut builder, 1.0, grey);
    scenes::add_camera(&mut builder, DVec3::new(0.0, 1.0, 3.0), DVec3::ZERO, 1.0);
    builder.finish()
}

#[test]
fn the_option_decides_over_a_scene_without_light() {
    let shot = |default_light| shoot(&unlit_floor(), &RenderSettings { default_light, ..settings(8, 4, 0) });
    for choice in [DefaultLight::Auto, DefaultLight::On] {
        let frame = shot(choice);
        assert!(frame.pixels.iter().flatten().all(|&x| x > 0.0), "{choice:?}: black pixels");
        assert!(frame.stats.warnings.is_empty(), "{choice:?}: {:?}", frame.stats.warnings);
        assert!(frame.stats.default_light.used && frame.stats.features.contains(&("default_light", true)));
    }
    let dark = shot(DefaultLight::Off);
    assert!(dark.pixels.iter().flatten().all(|&x| x == 0.0));
    let warning = dark.stats.warnings.iter().find(|w| w.contains("nothing in the scene emits light"));
    assert!(warning.is_some_and(|w| w.contains("--default-light on")), "{:?}", dark.stats.warnings);
}

#[test]
fn lights_of_intensity_0_stay_and_the_warning_says_so() {
    let mut builder = SceneBuilder::new(0);
    let grey = builder.add_material(scenes::lambert(0.5));
    scenes::add_floor(&mut builder, 1.0, grey);
    let off = prt::light::Light::Point { intensity: [0.0; 3] };
    scenes::add_light(&mut builder, off, DVec3::Y, DVec3::NEG_Y);
    scenes::add_camera(&mut builder, DVec3::new(0.0, 1.0, 3.0), DVec3::ZERO, 1.0);
    let frame = shoot(&builder.finish(), &settings(4, 1, 0));
    assert!(!frame.stats.default_light.used);
    assert!(frame.stats.warnings.iter().any(|w| w.contains("intensity 0")), "{:?}", frame.stats.warnings);
}

/// glTF files below `folder`.
fn files(folder: &Path) -> Vec<PathBuf> {
    let (mut folders, mut files) = (vec![folder.to_owned()], Vec::new());
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display())).flatten() {
            let path = entry.path();
            match path.extension().and_then(|e| e.to_str()) {
                _ if path.is_dir() => folders.push(path),
                Some("gltf" | "glb") => files.push(path),
                _ => {}
            }
        }
    }
    files.sort();
    files
}

/// Assets that only glow, and are not lit by it.
const GLOWING: [&str; 5] = ["TransmissionTest", "Lamborghini", "ClearCoatTest", "MultiUVTest", "TextureEncodingTest"];

#[test]
fn assets_that_only_glow_get_the_studio() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/assets");
    if !folder.is_dir() {
        println!("skipped: {} is not there", folder.display());
        return;
    }
    for name in GLOWING {
        let paths = if folder.join(name).is_dir() { files(&folder.join(name)) } else { Vec::new() };
        if paths.is_empty() {
            println!("skipped: {name} is not there");
        }
        for path in paths {
            let scene = match load(&path, &LoadOptions::default()) {
                Ok((scene, _)) => scene,
                Err(error) => {
                    println!("skipped: {error}");
                    continue;
                }
            };
            let (used, emitted) = auto(&scene);
            println!("{}: {emitted:?}, studio {used}", path.display());
            assert!(used, "{}: {emitted:?}, threshold {LEAST_EMITTED}", path.display());
        }
    }
}

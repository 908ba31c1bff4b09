//! A render that is cancelled ends soon, however long it would take.

use prt::error::RenderError;
use prt::load::{LoadOptions, load};
use prt::render::{AccelChoice, Progress, RenderSettings, render};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// One unit of work is 2.7e8 paths here, a minute at least: whoever asked only between units would be too late.
#[test]
fn tracing_ends_within_a_wave_of_being_cancelled() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/triangle.gltf");
    let (scene, _) = load(&path, &LoadOptions::default()).expect("a scene");
    let settings = RenderSettings {
        width: 64,
        height: 32,
        spp: 1 << 20,
        accel: AccelChoice::Bvh,
        threads: Some(2),
        ..RenderSettings::default()
    };
    let cancel = Arc::new(AtomicBool::new(false));
    let progress = Progress::cancelled_by(Arc::clone(&cancel));
    let canceller = std::thread::spawn(move || {
        std::thread::sleep(Duration::from_millis(200));
        cancel.store(true, Ordering::Relaxed);
        Instant::now()
    });
    let error = render(&scene, 0, &settings, &progress).unwrap_err();
    let waited = canceller.join().unwrap().elapsed();
    assert_eq!(error, RenderError::Interrupted);
    assert!(progress.done.load(Ordering::Relaxed) > 0, "it had begun");
    // Bounds a wait, not a speed.
    assert!(waited < Duration::from_secs(10), "{waited:?}");
}

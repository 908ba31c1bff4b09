//! Many small images in one run.
#![cfg(target_os = "linux")]

use std::fs;
use std::process::Command;

const SCENE: &str = include_str!("data/triangle.gltf");

/// Memory is the process's high-water mark as each image was finished: what it grows by after the first hundred images
/// is what 400 more cost. What stays of an image is its report, for `batch.json`: about 5 KiB. Its pixels and films alone
/// would be 150 KiB.
#[test]
fn memory_stays_flat_over_500_inputs() {
    let root = tempfile::tempdir().unwrap();
    fs::create_dir(root.path().join("scenes")).unwrap();
    for i in 0..500 {
        fs::write(root.path().join(format!("scenes/s{i:03}.gltf")), SCENE).unwrap();
    }
    let args = ["scenes", "--size", "64x32", "-s", "1", "--accel", "bvh", "--json", "-q", "-t", "2"];
    let output = Command::new(env!("CARGO_BIN_EXE_prt-batch")).current_dir(root.path()).args(args).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let images = json["images"].as_array().unwrap();
    assert_eq!(images.len(), 500);
    let peak = |i: usize| images[i]["peak_rss_bytes"].as_u64().unwrap();
    let growth = (peak(499) - peak(99)) / 400;
    assert!(growth < 10 << 10, "{growth} bytes an image: {} after 100 images, {} after 500", peak(99), peak(499));
}

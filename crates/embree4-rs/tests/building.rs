//! Loading, devices and what building refuses; skipped with a line where there is no Embree.

mod common;

use std::sync::Arc;

use common::{device, library, scene_of, square};
use embree4_rs::{
    BuildQuality, CommittedScene, Device, Error, ErrorCode, HitLayout, Library, Scene, SceneFlags, TriangleGeometry,
};

fn triangle(device: &Arc<Device>, indices: [u32; 3]) -> Result<TriangleGeometry, Error> {
    let positions = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    TriangleGeometry::new(device, positions, vec![indices])
}

#[test]
fn the_library_tells_its_version_path_and_layout() {
    let Some(library) = library() else { return };
    assert_eq!(library.version().major, 4);
    assert!(library.path().to_string_lossy().contains("embree4"), "{library:?}");
    if library.version().minor < 3 {
        assert_eq!(library.hit_layout(), HitLayout::Plain);
    }
    let again = Library::load(&["/nowhere/libembree4.so".as_ref(), library.path()]).unwrap();
    assert_eq!(again.version(), library.version());
    assert_eq!(again.refused().len(), 1);
}

#[test]
fn the_device_tells_its_isa_and_width() {
    let Some(library) = library() else { return };
    for (config, width, isa) in
        [("threads=1,isa=sse4.2", 4, "sse"), ("threads=1,isa=avx2", 8, "avx2"), ("threads=1,isa=avx", 8, "avx")]
    {
        match Device::new(&library, config) {
            Ok(device) if cfg!(target_arch = "x86_64") => {
                assert_eq!((device.native_width(), device.isa()), (width, isa), "{config}");
                assert_eq!(device.config(), config);
            }
            Ok(_) => {}
            Err(Error::Embree { code: ErrorCode::UnsupportedCpu, .. }) => {
                println!("skipped: this CPU cannot run {config}");
            }
            Err(error) => panic!("{error}"),
        }
    }
}

#[test]
fn a_bad_configuration_is_an_error_with_embrees_words() {
    let Some(library) = library() else { return };
    let error = Device::new(&library, "threads=many").unwrap_err();
    let text = error.to_string();
    assert!(matches!(error, Error::Embree { call: "rtcNewDevice", .. }), "{error:?}");
    assert!(text.contains("integer expected") && text.contains("threads=many"), "{text}");

    for config in ["threads=1\0verbose=3", "float_exceptions=1"] {
        let error = Device::new(&library, config).unwrap_err();
        assert!(matches!(error, Error::Config { .. }), "{error:?}");
    }
    // A failure leaves nothing behind.
    assert!(Device::new(&library, "").is_ok());
}

#[test]
fn an_index_out_of_range_is_refused() {
    let Some(device) = device("threads=1") else { return };
    let error = triangle(&device, [0, 1, 3]).unwrap_err();
    assert_eq!(error, Error::IndexOutOfRange { triangle: 0, index: 3, vertices: 3 });
    assert!(triangle(&device, [0, 1, u32::MAX]).is_err());
    let mesh = triangle(&device, [0, 1, 2]).unwrap();
    assert_eq!((mesh.positions().len(), mesh.indices()), (3, &[[0, 1, 2]][..]));
}

#[test]
fn a_geometry_of_another_device_is_refused() {
    let Some(device) = device("threads=1") else { return };
    let other = common::device("threads=1").unwrap();
    let mut scene = Scene::new(&device, SceneFlags::NONE, BuildQuality::Medium).unwrap();
    let mesh = triangle(&other, [0, 1, 2]).unwrap();
    assert_eq!(scene.attach(mesh).unwrap_err(), Error::OtherDevice);
}

#[test]
fn a_device_outlives_its_last_name_and_serves_several_scenes() {
    let Some(device) = device("threads=1") else { return };
    let first = scene_of(&device, [square(0.0, 2)]);
    let second = scene_of(&device, [square(-1.0, 4)]);
    drop(device);
    let ray = embree4_rs::Ray::new([0.3, 0.4, 1.0], [0.0, 0.0, -1.0]);
    assert_eq!(first.intersect1(&ray).map(|hit| hit.t), Some(1.0));
    drop(first);
    assert_eq!(second.intersect1(&ray).map(|hit| hit.t), Some(2.0));
}

#[test]
fn scenes_are_built_from_several_threads_on_one_device() {
    let Some(device) = device("threads=1") else { return };
    std::thread::scope(|scope| {
        for n in 1..5 {
            let device = &device;
            scope.spawn(move || {
                for _ in 0..8 {
                    let scene = scene_of(device, [square(0.0, n)]);
                    assert_eq!(scene.bounds(), Some([[0.0; 3], [1.0, 1.0, 0.0]]));
                    // An error in one thread is not another's.
                    let bad = TriangleGeometry::new(device, Vec::new(), vec![[0; 3]]);
                    assert!(matches!(bad, Err(Error::IndexOutOfRange { .. })));
                }
            });
        }
    });
}

#[test]
fn subnormal_numbers_survive_building_and_tracing() {
    let Some(device) = device("threads=1") else { return };
    let half = |x: f32| std::hint::black_box(x) * std::hint::black_box(0.5);
    let subnormal = half(f32::MIN_POSITIVE);
    assert!(subnormal > 0.0);
    let scene = scene_of(&device, [square(0.0, 64)]);
    assert_eq!(half(f32::MIN_POSITIVE), subnormal, "flush-to-zero is on after commit");
    assert_eq!(subnormal * std::hint::black_box(2.0), f32::MIN_POSITIVE, "denormals-are-zero is on");
    let ray = embree4_rs::Ray::new([0.3, 0.4, 1.0], [0.0, 0.0, -1.0]);
    assert!(scene.occluded1(&ray));
    assert_eq!(half(f32::MIN_POSITIVE), subnormal, "flush-to-zero is on after a query");
}

#[test]
fn the_device_counts_the_bytes_of_its_scenes() {
    let Some(device) = device("threads=1") else { return };
    let before = device.memory_bytes();
    let scene = scene_of(&device, [square(0.0, 64)]);
    let bytes = device.memory_bytes() - before;
    let triangles = 2 * 64 * 64;
    assert!((20 * triangles..500 * triangles).contains(&bytes), "{bytes} bytes for {triangles} triangles");
    drop(scene);
    assert!(device.memory_bytes() < before + bytes / 2, "{} bytes are left", device.memory_bytes());
}

#[test]
fn scenes_travel_between_threads() {
    fn assert_send_sync<T: Send + Sync>() {}
    assert_send_sync::<CommittedScene>();
    assert_send_sync::<Device>();
    assert_send_sync::<Library>();
    assert_send_sync::<TriangleGeometry>();
}

//! Loading, devices and what building refuses; skipped with a line where there is no Embree.

mod common;

use std::sync::Arc;

use common::{device, library, rounded, scene_of, square};
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
    assert_eq!(first.intersect1(&ray).map(|hit| rounded(hit.t)), Some(1.0));
    drop(first);
    assert_eq!(second.intersect1(&ray).map(|hit| rounded(hit.t)), Some(2.0));
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
fn every_quality_and_flag_builds_its_own_tree() {
    let Some(device) = device("threads=1") else { return };
    let (positions, indices) = square(0.0, 128);
    let mut bytes = Vec::new();
    for (quality, flags) in [
        (BuildQuality::Low, SceneFlags::ROBUST),
        (BuildQuality::Medium, SceneFlags::ROBUST),
        (BuildQuality::Medium, SceneFlags::ROBUST | SceneFlags::COMPACT),
        (BuildQuality::Low, SceneFlags::NONE),
        (BuildQuality::Medium, SceneFlags::NONE),
        (BuildQuality::High, SceneFlags::NONE),
    ] {
        let before = device.memory_bytes();
        let mut scene = Scene::new(&device, flags, quality).unwrap();
        scene.attach(TriangleGeometry::new(&device, positions.clone(), indices.clone()).unwrap()).unwrap();
        let scene = scene.commit().unwrap();
        bytes.push((device.memory_bytes() - before) as f64);
        for i in 0..50 {
            let at = (i as f32 + 0.37) / 50.0;
            let ray = embree4_rs::Ray::new([at, 1.0 - at, 1.0], [0.0, 0.0, -1.0]);
            assert_eq!(scene.intersect1(&ray).map(|hit| rounded(hit.t)), Some(1.0), "{quality:?}, {flags:?}");
        }
    }
    assert!(bytes[0] > 1.1 * bytes[1] && bytes[3] > 1.1 * bytes[4], "Morton trees are larger: {bytes:?}");
    assert!(bytes[2] < 0.8 * bytes[1], "compact trees are smaller: {bytes:?}");
}

/// Terrain of 40,000 triangles, each twice, so that the order in the tree decides which is reported.
fn doubled_terrain(device: &Arc<Device>) -> TriangleGeometry {
    let (mut positions, mut indices) = square(0.0, 100);
    for [x, y, z] in &mut positions {
        *z = 0.1 * (9.0 * *x).sin() * (7.0 * *y).cos();
    }
    indices.extend(indices.clone());
    TriangleGeometry::new(device, positions, indices).unwrap()
}

#[test]
fn det_01_the_tree_does_not_depend_on_the_threads_that_build_it() {
    let Some(library) = library() else { return };
    let rays = common::Numbers(1).rays(20_000);
    for (quality, flags) in [
        (BuildQuality::Low, SceneFlags::ROBUST),
        (BuildQuality::Medium, SceneFlags::ROBUST),
        (BuildQuality::Medium, SceneFlags::ROBUST | SceneFlags::COMPACT),
        (BuildQuality::High, SceneFlags::NONE),
    ] {
        let mut first: Option<Vec<_>> = None;
        for (config, threads) in [
            ("threads=1", None),
            ("threads=2", None),
            ("threads=4,user_threads=4", Some(1)),
            ("threads=4,user_threads=4", Some(2)),
            ("threads=4,user_threads=4", Some(3)),
        ] {
            let device = Device::new(&library, config).unwrap();
            let mut scene = Scene::new(&device, flags, quality).unwrap();
            scene.attach(doubled_terrain(&device)).unwrap();
            let scene = match threads {
                None => scene.commit(),
                Some(threads) => scene.commit_joined(threads),
            }
            .unwrap();
            let hits: Vec<_> = rays.iter().map(|ray| scene.intersect1(ray)).collect();
            assert!(hits.iter().flatten().count() > 1000);
            let first = first.get_or_insert_with(|| hits.clone());
            assert!(*first == hits, "{quality:?}, {flags:?}: {config}, {threads:?} differs");
        }
    }
}

#[test]
fn a_build_beyond_the_memory_limit_is_an_error_and_gives_its_memory_back() {
    for (config, threads) in [("threads=1", 1), ("threads=2", 1), ("threads=2,user_threads=2", 2)] {
        let Some(device) = device(config) else { return };
        let first = scene_of(&device, [square(0.0, 8)]);
        let before = device.memory_bytes();
        let limit = before + 500_000;
        device.set_memory_limit(limit);
        for _ in 0..10 {
            let mut scene = Scene::new(&device, SceneFlags::ROBUST, BuildQuality::Medium).unwrap();
            scene.attach(doubled_terrain(&device)).unwrap();
            let result = if threads > 1 { scene.commit_joined(threads) } else { scene.commit() };
            let error = result.unwrap_err();
            assert!(matches!(error, Error::MemoryLimit { limit: found, .. } if found == limit), "{error}");
            assert!(error.to_string().contains("out of memory"), "{error}");
            assert!(device.memory_bytes() <= before, "{config}: {} > {before}", device.memory_bytes());
        }
        // What was there still works, and so does a build within the limit or without one.
        let ray = embree4_rs::Ray::new([0.3, 0.4, 1.0], [0.0, 0.0, -1.0]);
        assert!(first.occluded1(&ray));
        assert!(scene_of(&device, [square(0.0, 4)]).occluded1(&ray));
        device.set_memory_limit(usize::MAX);
        let mut scene = Scene::new(&device, SceneFlags::ROBUST, BuildQuality::Medium).unwrap();
        scene.attach(doubled_terrain(&device)).unwrap();
        assert!(scene.commit().unwrap().occluded1(&ray));
    }
}

#[test]
fn subnormal_numbers_survive_in_a_thread_that_joins() {
    let Some(device) = device("threads=2,user_threads=2") else { return };
    let half = |x: f32| std::hint::black_box(x) * std::hint::black_box(0.5);
    let mut scene = Scene::new(&device, SceneFlags::ROBUST, BuildQuality::Medium).unwrap();
    scene.attach(doubled_terrain(&device)).unwrap();
    let _scene = scene.commit_joined(2).unwrap();
    assert!(half(f32::MIN_POSITIVE) > 0.0, "flush-to-zero is on after a joined commit");
}

#[test]
fn scenes_travel_between_threads() {
    fn assert_send_sync<T: Send + Sync>() {}
    assert_send_sync::<CommittedScene>();
    assert_send_sync::<Device>();
    assert_send_sync::<Library>();
    assert_send_sync::<TriangleGeometry>();
}

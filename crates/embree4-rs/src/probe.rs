//! Finds out what a library's hits look like in memory, by tracing probe rays into oversize buffers.
//!
//! Embree's hit struct depends on the version and on how the library was built: 4.3 added
//! `instPrimID` (when built with instance arrays), and every further instance level makes two arrays
//! longer. The version number does not tell. So each query is run once on a known triangle, in a buffer full of
//! sentinel words, and every word of the buffer is compared with what a known layout leaves there.
//!
//! All of it twice, with the triangle itself and with an instance of it: what a library that was built for more
//! than one level writes behind the first instance number shows in one of the two.

use std::mem::size_of;
use std::ptr::null_mut;

use crate::raw::{
    Api, BUFFER_TYPE_INDEX, BUFFER_TYPE_VERTEX, FORMAT_FLOAT3, FORMAT_UINT3, GEOMETRY_TYPE_INSTANCE,
    GEOMETRY_TYPE_TRIANGLE, INVALID_ID, QueryArguments, RtcDevice, RtcGeometry, RtcScene, VersionApi, property,
    query_flag,
};

/// A layout of `RTCHit` that this crate knows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HitLayout {
    /// `Ng, u, v, primID, geomID, instID`: 8 words, Embree 4.0 to 4.2.
    Plain,
    /// As `Plain`, followed by `instPrimID`: 9 words, 4.3 and later with instance arrays.
    InstancePrimitive,
}

const SENTINEL: u32 = 0xA5A5_5A5A;
/// Rows of the probe buffer: 12 of the ray, up to 23 of a hit with 8 instance levels, and more.
const ROWS: usize = 64;
const RAY_ROWS: usize = 12;
const ROW_T_MAX: usize = 8;
const GEOMETRY_ID: u32 = 5;
const PRIMITIVE_ID: u32 = 2;
const INSTANCE_ID: u32 = 9;

/// Room for the widest packet, 64-byte aligned.
#[repr(C, align(64))]
struct Buffer([u32; ROWS * 16]);

#[repr(C, align(64))]
struct Lanes([i32; 16]);

/// The layout of the library's hits in `rtcIntersect1/8/16`, or which word is not as expected.
/// Also checks that `rtcOccluded1/8/16` write `tfar` and nothing else.
///
/// # Safety
/// The tables must belong to an Embree 4 library.
pub(crate) unsafe fn hit_layout(version_api: &VersionApi, api: &Api) -> Result<HitLayout, String> {
    // One vertex more than used, for the 16-byte loads of the last one.
    let vertices: [[f32; 3]; 4] = [[0.0; 3], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0], [0.0; 3]];
    // The first two triangles are points, so that the one that is hit has an index of its own.
    let indices: [[u32; 3]; 3] = [[0; 3], [0; 3], [0, 1, 2]];

    // SAFETY: the handles are checked before use and released by `Handles`, which is dropped before
    // the arrays that Embree reads.
    unsafe {
        let mut handles =
            Handles { version_api, api, device: null_mut(), scenes: [null_mut(); 2], geometries: [null_mut(); 2] };
        handles.device = (version_api.new_device)(c"threads=1".as_ptr());
        if handles.device.is_null() {
            return Err("no device for the probe rays".into());
        }
        if (version_api.get_device_property)(handles.device, property::TRIANGLE_GEOMETRY_SUPPORTED) == 0 {
            return Err("built without triangles".into());
        }
        for (at, kind) in [GEOMETRY_TYPE_TRIANGLE, GEOMETRY_TYPE_INSTANCE].into_iter().enumerate() {
            handles.geometries[at] = (api.new_geometry)(handles.device, kind);
            handles.scenes[at] = (api.new_scene)(handles.device);
            if handles.geometries[at].is_null() || handles.scenes[at].is_null() {
                return Err("no scene for the probe rays".into());
            }
        }
        let ([geometry, instance], [scene, outer]) = (handles.geometries, handles.scenes);
        let set_buffer = api.set_shared_geometry_buffer;
        set_buffer(geometry, BUFFER_TYPE_VERTEX, 0, FORMAT_FLOAT3, vertices.as_ptr().cast(), 0, 12, 3);
        set_buffer(geometry, BUFFER_TYPE_INDEX, 0, FORMAT_UINT3, indices.as_ptr().cast(), 0, 12, 3);
        (api.commit_geometry)(geometry);
        (api.attach_geometry_by_id)(scene, geometry, GEOMETRY_ID);
        (api.commit_scene)(scene);
        (api.set_geometry_instanced_scene)(instance, scene);
        (api.commit_geometry)(instance);
        (api.attach_geometry_by_id)(outer, instance, INSTANCE_ID);
        (api.commit_scene)(outer);
        let error = (version_api.get_device_error)(handles.device);
        if error != 0 {
            return Err(format!("error {error} while building the probe triangle"));
        }
        let layout = trace_probes(api, scene, None)?;
        let instanced = trace_probes(api, outer, Some(INSTANCE_ID)).map_err(|text| format!("{text} (instance)"))?;
        if instanced == layout { Ok(layout) } else { Err("hits of an instance are unlike the others".into()) }
    }
}

/// `instance` is the number of the instance that the triangle is in.
///
/// # Safety
/// `scene` must be committed and belong to `api`.
unsafe fn trace_probes(api: &Api, scene: *mut RtcScene, instance: Option<u32>) -> Result<HitLayout, String> {
    let mut layout = None;
    for width in [1, 8, 16] {
        for flags in [query_flag::INCOHERENT, query_flag::COHERENT] {
            let mut arguments = QueryArguments::new(flags);
            let mut buffer = probe_rays(width);
            let data = buffer.0.as_mut_ptr();
            let lanes = valid_lanes(width);
            let valid = lanes.0.as_ptr();
            // SAFETY: the buffer is larger and more aligned than any packet of any layout.
            unsafe {
                match width {
                    1 => (api.intersect1)(scene, data.cast(), &mut arguments),
                    8 => (api.intersect8)(valid, scene, data.cast(), &mut arguments),
                    _ => (api.intersect16)(valid, scene, data.cast(), &mut arguments),
                }
            }
            let found = check_hit(&buffer, &lanes, width, instance)?;
            if *layout.get_or_insert(found) != found {
                return Err(format!("rtcIntersect{width} writes hits unlike the others"));
            }

            let mut buffer = probe_rays(width);
            let data = buffer.0.as_mut_ptr();
            // SAFETY: as above.
            unsafe {
                match width {
                    1 => (api.occluded1)(scene, data.cast(), &mut arguments),
                    8 => (api.occluded8)(valid, scene, data.cast(), &mut arguments),
                    _ => (api.occluded16)(valid, scene, data.cast(), &mut arguments),
                }
            }
            check_occluded(&buffer, &lanes, width)?;
        }
    }
    layout.ok_or_else(|| "no probe ray was traced".into())
}

/// All lanes but the second and the last of a packet.
fn valid_lanes(width: usize) -> Lanes {
    Lanes(std::array::from_fn(|lane| {
        let is_valid = width == 1 || (lane != 1 && lane != width - 1);
        -i32::from(is_valid)
    }))
}

/// Rays towards -z that meet the probe triangle at (1, 2, 0) with t = 3, and sentinels.
fn probe_rays(width: usize) -> Buffer {
    let mut buffer = Buffer([SENTINEL; ROWS * 16]);
    let ray: [u32; RAY_ROWS] = [
        1.0f32.to_bits(),
        2.0f32.to_bits(),
        3.0f32.to_bits(),
        0.0f32.to_bits(),
        0.0f32.to_bits(),
        0.0f32.to_bits(),
        (-1.0f32).to_bits(),
        0.0f32.to_bits(),
        100.0f32.to_bits(),
        u32::MAX,
        SENTINEL,
        0,
    ];
    for (row, word) in ray.into_iter().enumerate() {
        buffer.0[row * width..][..width].fill(word);
    }
    // `geomID`, which must be invalid on entry.
    buffer.0[(RAY_ROWS + 6) * width..][..width].fill(INVALID_ID);
    buffer
}

fn check_hit(buffer: &Buffer, lanes: &Lanes, width: usize, instance: Option<u32>) -> Result<HitLayout, String> {
    // `instID` and `instPrimID`; the only place of an instance is 0.
    let ids = instance.map_or([INVALID_ID; 2], |id| [id, 0]);
    let before = probe_rays(width);
    let mut layout = HitLayout::Plain;
    let near = |word: u32, value: f32| (f32::from_bits(word) - value).abs() <= 1e-5 * value.abs();
    for (at, (&word, &untouched)) in buffer.0.iter().zip(&before.0).enumerate() {
        let (row, lane) = (at / width, at % width);
        let is_expected = if lanes.0[lane] == 0 {
            word == untouched
        } else {
            match row.checked_sub(RAY_ROWS) {
                None if row == ROW_T_MAX => near(word, 3.0),
                None => word == untouched,
                Some(0 | 1) => f32::from_bits(word) == 0.0,
                // The normal's length is not fixed.
                Some(2) => (1e-3..1e3).contains(&f32::from_bits(word)),
                Some(3) => near(word, 0.25),
                Some(4) => near(word, 0.5),
                Some(5) => word == PRIMITIVE_ID,
                Some(6) => word == GEOMETRY_ID,
                Some(7) => word == ids[0],
                Some(8) if word == ids[1] => {
                    layout = HitLayout::InstancePrimitive;
                    true
                }
                Some(_) => word == SENTINEL,
            }
        };
        if !is_expected {
            return Err(unexpected("rtcIntersect", width, row, lane, word));
        }
    }
    // `instPrimID` is written in all lanes or in none.
    let row = &buffer.0[(RAY_ROWS + 8) * width..][..width];
    let written = ids[1] == row[0];
    let is_even = (0..width).all(|lane| lanes.0[lane] == 0 || (row[lane] == ids[1]) == written);
    if is_even { Ok(layout) } else { Err(format!("rtcIntersect{width} writes instPrimID in some lanes only")) }
}

fn check_occluded(buffer: &Buffer, lanes: &Lanes, width: usize) -> Result<(), String> {
    let before = probe_rays(width);
    for (at, (&word, &untouched)) in buffer.0.iter().zip(&before.0).enumerate() {
        let (row, lane) = (at / width, at % width);
        let expected = if row == ROW_T_MAX && lanes.0[lane] != 0 { f32::NEG_INFINITY.to_bits() } else { untouched };
        if word != expected {
            return Err(unexpected("rtcOccluded", width, row, lane, word));
        }
    }
    Ok(())
}

fn unexpected(call: &str, width: usize, row: usize, lane: usize, word: u32) -> String {
    format!("{call}{width} left 0x{word:08x} in word {row} of lane {lane}")
}

/// Releases what it holds, null handles excepted.
struct Handles<'a> {
    version_api: &'a VersionApi,
    api: &'a Api,
    device: *mut RtcDevice,
    /// With the triangle, with its instance.
    scenes: [*mut RtcScene; 2],
    geometries: [*mut RtcGeometry; 2],
}

impl Drop for Handles<'_> {
    fn drop(&mut self) {
        // SAFETY: each handle is null or owned by this struct.
        unsafe {
            for scene in self.scenes.into_iter().rev().filter(|scene| !scene.is_null()) {
                (self.api.release_scene)(scene);
            }
            for geometry in self.geometries.into_iter().rev().filter(|geometry| !geometry.is_null()) {
                (self.api.release_geometry)(geometry);
            }
            if !self.device.is_null() {
                (self.version_api.release_device)(self.device);
            }
        }
    }
}

const _: () = {
    // The buffer holds every packet of this crate, and the widest hit with room to spare.
    assert!(size_of::<Buffer>() > size_of::<crate::ray::RayHit16>());
    assert!(ROWS > RAY_ROWS + 23);
};

#[cfg(test)]
mod tests {
    use super::*;

    /// What a library with `hit_rows` rows of hit would leave; `ids` are the words from `instID` on.
    fn written(width: usize, hit_rows: usize, ids: [u32; 3]) -> (Buffer, Lanes) {
        let mut buffer = probe_rays(width);
        let lanes = valid_lanes(width);
        let one = 1.0f32.to_bits();
        let hit = [0, 0, one, 0.25f32.to_bits(), 0.5f32.to_bits(), PRIMITIVE_ID, GEOMETRY_ID, ids[0], ids[1], ids[2]];
        for lane in (0..width).filter(|&lane| lanes.0[lane] != 0) {
            buffer.0[ROW_T_MAX * width + lane] = 3.0f32.to_bits();
            for (row, &word) in hit[..hit_rows].iter().enumerate() {
                buffer.0[(RAY_ROWS + row) * width + lane] = word;
            }
        }
        (buffer, lanes)
    }

    #[test]
    fn both_known_layouts_are_told_apart() {
        for width in [1, 8, 16] {
            for (instance, ids) in [(None, [INVALID_ID; 3]), (Some(INSTANCE_ID), [INSTANCE_ID, 0, INVALID_ID])] {
                let (buffer, lanes) = written(width, 8, ids);
                assert_eq!(check_hit(&buffer, &lanes, width, instance), Ok(HitLayout::Plain));
                let (buffer, lanes) = written(width, 9, ids);
                assert_eq!(check_hit(&buffer, &lanes, width, instance), Ok(HitLayout::InstancePrimitive));
            }
        }
    }

    #[test]
    fn a_library_for_two_levels_is_refused() {
        for width in [1, 8, 16] {
            // Without instance arrays it ends the list of numbers where `instPrimID` would be.
            let (buffer, lanes) = written(width, 9, [INSTANCE_ID, INVALID_ID, 0]);
            let message = check_hit(&buffer, &lanes, width, Some(INSTANCE_ID)).unwrap_err();
            assert!(message.contains("in word 20"), "{message}");
        }
    }

    #[test]
    fn a_longer_or_shifted_hit_is_refused() {
        for width in [1, 8, 16] {
            let (buffer, lanes) = written(width, 10, [INVALID_ID; 3]);
            let message = check_hit(&buffer, &lanes, width, None).unwrap_err();
            assert!(message.contains("in word 21"), "{message}");

            let (mut buffer, lanes) = written(width, 9, [INVALID_ID; 3]);
            buffer.0.copy_within(RAY_ROWS * width..(RAY_ROWS + 9) * width, (RAY_ROWS + 1) * width);
            assert!(check_hit(&buffer, &lanes, width, None).is_err());
        }
    }

    #[test]
    fn a_write_to_a_lane_that_is_not_valid_is_refused() {
        let (mut buffer, lanes) = written(16, 9, [INVALID_ID; 3]);
        buffer.0[(RAY_ROWS + 3) * 16 + 15] = 0;
        assert!(check_hit(&buffer, &lanes, 16, None).unwrap_err().contains("of lane 15"));
    }

    #[test]
    fn an_occlusion_query_that_writes_more_than_t_max_is_refused() {
        let lanes = valid_lanes(1);
        let mut buffer = probe_rays(1);
        buffer.0[ROW_T_MAX] = f32::NEG_INFINITY.to_bits();
        assert_eq!(check_occluded(&buffer, &lanes, 1), Ok(()));
        buffer.0[RAY_ROWS] = 0;
        assert!(check_occluded(&buffer, &lanes, 1).is_err());
    }
}

//! Queries for any number of rays in structure-of-arrays form, cut into the device's native packets.

use crate::query::Coherence;
use crate::raw::{INVALID_ID, QueryArguments};
use crate::ray::{Mask, RayHitPacket, RayPacket};
use crate::scene::CommittedScene;

/// Rays with `t` in [0, `t_max`], or between the two; all slices have the same length.
#[derive(Clone, Copy, Debug)]
pub struct RaysSoA<'a> {
    /// Origins, x.
    pub ox: &'a [f32],
    /// Origins, y.
    pub oy: &'a [f32],
    /// Origins, z.
    pub oz: &'a [f32],
    /// Directions, x; any length but not zero.
    pub dx: &'a [f32],
    /// Directions, y.
    pub dy: &'a [f32],
    /// Directions, z.
    pub dz: &'a [f32],
    /// Ends of the segments in lengths of the direction; infinity is allowed.
    pub t_max: &'a [f32],
    /// Times in [0, 1]; `None` is 0 for all.
    pub time: Option<&'a [f32]>,
    /// Numbers that filters see as [`Candidate::ray_id`](crate::Candidate); `None` is 0 for all.
    pub id: Option<&'a [u32]>,
    /// Ray masks; `None` is every bit for all.
    pub mask: Option<&'a [u32]>,
    /// Whether hits at exactly 0 and `t_max` do not count: Embree, which counts both, is told of the least normal number
    /// and the float before `t_max`. Filters and shapes see that end.
    pub is_open: bool,
}

impl RaysSoA<'_> {
    /// How many rays there are.
    pub fn len(&self) -> usize {
        self.ox.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.ox.is_empty()
    }

    fn check(&self) {
        let len = self.len();
        for (name, slice) in [
            ("oy", self.oy),
            ("oz", self.oz),
            ("dx", self.dx),
            ("dy", self.dy),
            ("dz", self.dz),
            ("t_max", self.t_max),
            ("time", self.time.unwrap_or(self.ox)),
        ] {
            assert_eq!(slice.len(), len, "length of RaysSoA::{name} must be that of ox");
        }
        for (name, slice) in [("id", self.id), ("mask", self.mask)] {
            assert!(slice.is_none_or(|s| s.len() == len), "length of RaysSoA::{name} must be that of ox");
        }
    }

    /// Fills the first `count` lanes of `packet` with the rays from `start` on. The other lanes keep
    /// what they hold.
    fn load<const N: usize>(&self, start: usize, count: usize, packet: &mut RayPacket<N>) {
        copy_in(&mut packet.origin_x, self.ox, start, count);
        copy_in(&mut packet.origin_y, self.oy, start, count);
        copy_in(&mut packet.origin_z, self.oz, start, count);
        copy_in(&mut packet.direction_x, self.dx, start, count);
        copy_in(&mut packet.direction_y, self.dy, start, count);
        copy_in(&mut packet.direction_z, self.dz, start, count);
        copy_in(&mut packet.t_max, self.t_max, start, count);
        if self.is_open {
            packet.t_min = [f32::MIN_POSITIVE; N];
            packet.t_max = packet.t_max.map(f32::next_down);
        }
        if let Some(time) = self.time {
            copy_in(&mut packet.time, time, start, count);
        }
        if let Some(id) = self.id {
            copy_in(&mut packet.id, id, start, count);
        }
        if let Some(mask) = self.mask {
            copy_in(&mut packet.mask, mask, start, count);
        }
    }
}

/// Where hits go; all slices have the length of the rays.
#[derive(Debug)]
pub struct HitsSoAMut<'a> {
    /// Distances in lengths of the direction. A miss leaves the ray's `t_max` here.
    pub t: &'a mut [f32],
    /// Weights of the triangles' second vertices; 0 for a miss.
    pub u: &'a mut [f32],
    /// Weights of the triangles' third vertices; 0 for a miss.
    pub v: &'a mut [f32],
    /// Triangles in their geometries; `u32::MAX` for a miss.
    pub primitive: &'a mut [u32],
    /// Geometries; `u32::MAX` for a miss.
    pub geometry: &'a mut [u32],
    /// Instances, if wanted; `u32::MAX` for none and for a miss.
    pub instance: Option<&'a mut [u32]>,
    /// Places in instance arrays, if wanted; see [`Hit::instance_primitive`](crate::Hit).
    pub instance_primitive: Option<&'a mut [u32]>,
}

impl HitsSoAMut<'_> {
    fn check(&self, len: usize) {
        let message = "length of every slice of HitsSoAMut must be that of the rays";
        assert!(self.t.len() == len && self.u.len() == len && self.v.len() == len, "{message}");
        assert!(self.primitive.len() == len && self.geometry.len() == len, "{message}");
        for slice in [&self.instance, &self.instance_primitive].into_iter().flatten() {
            assert!(slice.len() == len, "{message}");
        }
    }
}

impl CommittedScene {
    /// Writes the closest hits of all `rays` to `hits`.
    ///
    /// A ray with a NaN or infinite origin or direction, with a `t_max` that is NaN or negative, or with a
    /// time outside [0, 1] is a miss. `coherent` says that neighbours in the slices go much the same way, as camera rays
    /// in pixel order do; wrong is slow, not incorrect.
    ///
    /// Where two triangles are hit at the same distance, such as on a shared edge, which one is reported
    /// can depend on the other rays of the packet, on `coherent` and on the device's instruction set: equal
    /// batches give equal results, the same ray in another batch may not.
    ///
    /// Panics when the slices' lengths differ.
    pub fn intersect_batch(&self, rays: RaysSoA<'_>, coherent: bool, hits: HitsSoAMut<'_>) {
        rays.check();
        hits.check(rays.len());
        if self.device().native_width() == 16 {
            self.intersect_packets::<16>(rays, &mut arguments(coherent), hits);
        } else {
            self.intersect_packets::<8>(rays, &mut arguments(coherent), hits);
        }
    }

    /// Writes 1 to `out` for every one of `rays` that meets anything, 0 for the others.
    ///
    /// The rules of [`CommittedScene::intersect_batch`] hold.
    pub fn occluded_batch(&self, rays: RaysSoA<'_>, coherent: bool, out: &mut [u8]) {
        rays.check();
        assert_eq!(out.len(), rays.len(), "length of out must be that of the rays");
        if self.device().native_width() == 16 {
            self.occluded_packets::<16>(rays, &mut arguments(coherent), out);
        } else {
            self.occluded_packets::<8>(rays, &mut arguments(coherent), out);
        }
    }

    fn intersect_packets<const N: usize>(
        &self,
        rays: RaysSoA<'_>,
        arguments: &mut QueryArguments,
        hits: HitsSoAMut<'_>,
    ) {
        let mut packet = RayHitPacket::<N>::default();
        let (mut instance, mut instance_primitive) = (hits.instance, hits.instance_primitive);
        let is_open = rays.is_open;
        for (start, count, valid) in packets::<N>(rays.len()) {
            rays.load(start, count, &mut packet.ray);
            self.intersect_packet(&valid, &mut packet, arguments);
            if is_open {
                // What hit nothing keeps its own end.
                for (lane, t_max) in rays.t_max[start..start + count].iter().enumerate() {
                    let is_miss = packet.hit.primitive[lane] == INVALID_ID;
                    packet.ray.t_max[lane] = if is_miss { *t_max } else { packet.ray.t_max[lane] };
                }
            }
            copy_out(hits.t, start, count, &packet.ray.t_max);
            copy_out(hits.u, start, count, &packet.hit.u);
            copy_out(hits.v, start, count, &packet.hit.v);
            copy_out(hits.primitive, start, count, &packet.hit.primitive);
            copy_out(hits.geometry, start, count, &packet.hit.geometry);
            if let Some(instance) = &mut instance {
                copy_out(instance, start, count, &packet.hit.instance);
            }
            if let Some(instance_primitive) = &mut instance_primitive {
                copy_out(instance_primitive, start, count, &packet.hit.instance_primitive);
            }
        }
    }

    fn occluded_packets<const N: usize>(&self, rays: RaysSoA<'_>, arguments: &mut QueryArguments, out: &mut [u8]) {
        let mut packet = RayPacket::<N>::default();
        for (start, count, valid) in packets::<N>(rays.len()) {
            rays.load(start, count, &mut packet);
            let occluded = self.occluded_packet(&valid, &mut packet, arguments);
            let bytes: [u8; N] = std::array::from_fn(|lane| u8::from(occluded.contains(lane)));
            copy_out(out, start, count, &bytes);
        }
    }
}

fn arguments(coherent: bool) -> QueryArguments {
    if coherent { Coherence::Coherent } else { Coherence::Incoherent }.arguments()
}

/// Start, number of rays and valid lanes of each packet of `len` rays.
fn packets<const N: usize>(len: usize) -> impl Iterator<Item = (usize, usize, Mask<N>)> {
    (0..len).step_by(N).map(move |start| {
        let count = N.min(len - start);
        let valid = if count == N { Mask::ALL } else { Mask::first(count) };
        (start, count, valid)
    })
}

fn copy_in<const N: usize, T: Copy>(lanes: &mut [T; N], slice: &[T], start: usize, count: usize) {
    // A whole packet is a copy of known length, a few vector moves; the tail is a call to memcpy.
    if count == N {
        lanes.copy_from_slice(&slice[start..start + N]);
    } else {
        lanes[..count].copy_from_slice(&slice[start..start + count]);
    }
}

fn copy_out<const N: usize, T: Copy>(slice: &mut [T], start: usize, count: usize, lanes: &[T; N]) {
    if count == N {
        slice[start..start + N].copy_from_slice(lanes);
    } else {
        slice[start..start + count].copy_from_slice(&lanes[..count]);
    }
}

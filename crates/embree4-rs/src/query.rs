//! Ray queries on a committed scene: one ray, 8 or 16 at a time.
//!
//! No query looks at Embree's error state: with a committed scene and rays that pass
//! [`Ray::is_traceable`] there is nothing to report, and asking costs as much as an easy ray.

use crate::callback;
use crate::raw::{INVALID_ID, QueryArguments, query_flag};
use crate::ray::{Hit, Mask, Mask8, Mask16, Ray, Ray8, Ray16, RayHit, RayHit8, RayHit16};
use crate::ray::{RayHitPacket, RayPacket};
use crate::scene::CommittedScene;

/// Whether the rays of a packet go much the same way. Wrong is slow, not incorrect.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Coherence {
    /// Rays are traced one by one inside; right for all but camera rays.
    #[default]
    Incoherent,
    /// Rays share the traversal: 2-4 times as fast for camera rays in pixel order, half as fast for
    /// scattered ones.
    Coherent,
}

impl Coherence {
    pub(crate) fn arguments(self) -> QueryArguments {
        QueryArguments::new(match self {
            Self::Incoherent => query_flag::INCOHERENT,
            Self::Coherent => query_flag::COHERENT,
        })
    }
}

impl CommittedScene {
    /// The closest hit of `ray`, `None` for a miss and for a ray that is not
    /// [traceable](Ray::is_traceable).
    pub fn intersect1(&self, ray: &Ray) -> Option<Hit> {
        if !ray.is_traceable() {
            return None;
        }
        let mut rayhit = RayHit::new(*ray);
        let mut arguments = Coherence::Incoherent.arguments();
        // SAFETY: the scene is committed; the struct is aligned and at least as large as any layout
        // of `RTCRayHit`.
        unsafe {
            (self.device().api().intersect1)(self.handle.raw(), &mut rayhit, &mut arguments);
        }
        self.resume_panic();
        let RayHit { ray, hit } = rayhit;
        (hit.geometry != INVALID_ID).then_some(Hit {
            t: ray.t_max,
            u: hit.u,
            v: hit.v,
            ng: hit.ng,
            primitive: hit.primitive,
            geometry: hit.geometry,
            instance: hit.instance,
            instance_primitive: hit.instance_primitive,
        })
    }

    /// Whether anything lies on `ray`; `false` for a ray that is not [traceable](Ray::is_traceable).
    pub fn occluded1(&self, ray: &Ray) -> bool {
        if !ray.is_traceable() {
            return false;
        }
        let mut ray = *ray;
        let mut arguments = Coherence::Incoherent.arguments();
        // SAFETY: the scene is committed; the struct is `RTCRay`.
        unsafe { (self.device().api().occluded1)(self.handle.raw(), &mut ray, &mut arguments) };
        self.resume_panic();
        ray.t_max == f32::NEG_INFINITY
    }

    /// Finds the closest hits of the `valid` rays of a packet. `hit` is overwritten: lanes that are
    /// not valid, not [traceable](Ray::is_traceable) or miss have `geometry` and `primitive`
    /// `u32::MAX`; their `t_max` stays.
    pub fn intersect8(&self, valid: &Mask8, rayhit: &mut RayHit8, coherence: Coherence) {
        self.intersect_packet(valid, rayhit, &mut coherence.arguments());
    }

    /// As [`CommittedScene::intersect8`], for 16 rays.
    pub fn intersect16(&self, valid: &Mask16, rayhit: &mut RayHit16, coherence: Coherence) {
        self.intersect_packet(valid, rayhit, &mut coherence.arguments());
    }

    /// The lanes among the `valid` ones whose rays meet anything. `rays.t_max` becomes negative
    /// infinity there.
    pub fn occluded8(&self, valid: &Mask8, rays: &mut Ray8, coherence: Coherence) -> Mask8 {
        self.occluded_packet(valid, rays, &mut coherence.arguments())
    }

    /// As [`CommittedScene::occluded8`], for 16 rays.
    pub fn occluded16(&self, valid: &Mask16, rays: &mut Ray16, coherence: Coherence) -> Mask16 {
        self.occluded_packet(valid, rays, &mut coherence.arguments())
    }

    pub(crate) fn intersect_packet<const N: usize>(
        &self,
        valid: &Mask<N>,
        rayhit: &mut RayHitPacket<N>,
        arguments: &mut QueryArguments,
    ) {
        let valid = rayhit.ray.traceable(valid);
        rayhit.hit.reset();
        let (api, scene) = (self.device().api(), self.handle.raw());
        let (lanes, data) = (valid.0.as_ptr(), std::ptr::from_mut(rayhit));
        // SAFETY: the scene is committed; the packet is 64-byte aligned, like the mask, and at least
        // as large as any layout of `RTCRayHit8/16`; `N` picks the function of that width, so the
        // casts change nothing.
        unsafe {
            match N {
                8 => (api.intersect8)(lanes, scene, data.cast(), arguments),
                16 => (api.intersect16)(lanes, scene, data.cast(), arguments),
                _ => unreachable!("packets are 8 or 16 wide"),
            }
        }
        self.resume_panic();
    }

    pub(crate) fn occluded_packet<const N: usize>(
        &self,
        valid: &Mask<N>,
        rays: &mut RayPacket<N>,
        arguments: &mut QueryArguments,
    ) -> Mask<N> {
        let valid = rays.traceable(valid);
        let (api, scene) = (self.device().api(), self.handle.raw());
        let (lanes, data) = (valid.0.as_ptr(), std::ptr::from_mut(rays));
        // SAFETY: as in `intersect_packet`, for `RTCRay8/16`.
        unsafe {
            match N {
                8 => (api.occluded8)(lanes, scene, data.cast(), arguments),
                16 => (api.occluded16)(lanes, scene, data.cast(), arguments),
                _ => unreachable!("packets are 8 or 16 wide"),
            }
        }
        self.resume_panic();
        // A lane that was not traced may have come in with a `t_max` of negative infinity.
        Mask(std::array::from_fn(|lane| valid.0[lane] & -i32::from(rays.t_max[lane] == f32::NEG_INFINITY)))
    }

    /// To be called after every query, for the sake of the callbacks that it may have run.
    fn resume_panic(&self) {
        if self.has_callbacks() {
            callback::resume_panic();
        }
    }
}

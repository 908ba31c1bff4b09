//! Embree as an [`super::Accel`].

//! Our own 8-wide BVH.

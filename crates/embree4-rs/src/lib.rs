//! Embree 4 for Rust, loaded at run time.

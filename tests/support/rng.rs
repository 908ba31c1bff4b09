//! The generator of tests: the library's.
#![allow(unused_imports)]

pub use prt::math::random::Rng;

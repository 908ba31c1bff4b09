//! What the statistical tests share: open it to find a test's mathematics, its scenes, or the fault that it must find.
//!
//! [`stats`] has the distributions, [`verdict`] the test of a picture's mean, [`closed`] the exact values, [`planted`] the
//! faults, [`scenes`] the scenes, [`smooth`] meshes with normals, [`pictures`] rendering over seeds and reading stored
//! pictures, [`reference`] the verdict on our mean of a reference scene.
// Every test target compiles this module anew and uses its own part of it.
#![allow(dead_code, unused_imports)]

pub mod closed;
pub mod pictures;
pub mod planted;
pub mod reference;
pub mod scenes;
pub mod smooth;
pub mod stats;
pub mod verdict;

//! Numerical idioms shared by everything above.

pub mod robust;

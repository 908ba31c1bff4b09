//! Lobes on their own: local directions in, value and density out. `bsdf` puts them together.
//!
//! `coat` and `sheen` lie over the rest, `disney` replaces it. `ggx` and `fresnel` are the parts that several lobes share;
//! `tables` has the albedos of coat and sheen, made and tested by `quadrature`.
//!
//! All directions are local, unit, z along the normal, and point away from the surface. A lane without a lobe has value 0,
//! density 0, albedo 0, and scales what lies below by exactly 1.

pub mod coat;
pub mod disney;
pub mod fresnel;
pub mod ggx;
pub mod quadrature;
pub mod sheen;
mod tables;

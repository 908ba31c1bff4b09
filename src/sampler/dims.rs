//! THE table of sampler dimensions. A group is four dimensions that are stratified together.
//!
//! | group | 0 | 1 | 2 | 3 |
//! |---|---|---|---|---|
//! | [`CAMERA`] | film x | film y | lens u | lens v |
//! | [`TIME`] | time | wavelength | - | - |
//! | [`FIRST_LIGHT`] + 2k | choice of the light | point on it u | point on it v | spare (resampling) |
//! | [`FIRST_BSDF`] + 2k | direction u | direction v | choice of the lobe | roulette |
//!
//! k counts the surface vertices of the path from 0, thin glass that it went straight through among them. Groups stay
//! fixed per vertex whether or not they are used.

/// Film position and lens.
pub const CAMERA: u32 = 0;
/// Shutter time.
pub const TIME: u32 = 1;
/// The wavelength of a path that dispersion splits, in the group [`TIME`].
pub const WAVELENGTH: usize = 1;
/// The light group of vertex 0.
pub const FIRST_LIGHT: u32 = 2;
/// The BSDF group of vertex 0.
pub const FIRST_BSDF: u32 = 3;
/// Groups from one vertex to the next.
pub const GROUPS_PER_VERTEX: u32 = 2;
/// Groups below this are Sobol points: camera, time and five vertices. More vertices measured no better.
pub const SOBOL_GROUPS: u32 = FIRST_LIGHT + 5 * GROUPS_PER_VERTEX;

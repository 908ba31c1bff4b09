//! Colour only at the edge of files: inside, everything is linear Rec.709; here it becomes display-ready sRGB.
//!
//! [`ToneMap`] turns radiance into 8 bits by one of the curves ([`neutral`], [`agx`], [`aces`] or none); [`Luminances`]
//! meters a picture, from which comes `--exposure auto`; [`advice`] says which exposure would help where one is hopeless.

pub mod aces;
mod advice;
pub mod agx;
mod meter;
pub mod neutral;
mod tone;
mod transfer;

pub use advice::{Advice, Shades, advice};
pub use meter::{Exposure, Luminances};
pub use tone::{ToneCurve, ToneMap};
pub use transfer::{linear_from_srgb, srgb_from_linear};

//! The front before our own tree, with the instructions of a level.

use prt::accel::Accel;
use prt::accel::front::{Front, Split};
use prt::accel::geometry::Geometry;
use prt::accel::wide::WideBvh;
use simd::Level;
use std::convert::Infallible;

/// As `prepare` builds it; `None` where `geometry` has no triangles for it.
pub fn front(geometry: impl Into<Geometry>, level: Level) -> Option<Front> {
    let Split { all, front } = Split::new(geometry);
    let build = |geometry| Ok::<Box<dyn Accel>, Infallible>(Box::new(WideBvh::with_level(geometry, level)));
    let Ok(built) = Front::build(all, front?, build);
    Some(built.with_level(level))
}

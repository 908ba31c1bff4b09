//! What serves for every moment of an animation: read once, and shared by the scenes of all.

use super::base::Base;
use crate::scene::Notes;
use crate::texture::{Channels, Image};
use glam::DMat4;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Things by their places in the file.
#[derive(Debug, Default)]
pub(super) struct Kept {
    /// Whether vertices are kept: a file that is read for one moment only drops them.
    pub is_kept: bool,
    /// By mesh and primitive.
    pub bases: BTreeMap<(usize, usize), KeptBase>,
    /// Of skins.
    pub inverse_binds: BTreeMap<usize, Arc<Vec<DMat4>>>,
    /// With the channels that were kept of them, and what was said of them.
    pub images: BTreeMap<usize, (Channels, Arc<Image>, Option<String>)>,
}

/// What became of a primitive.
#[derive(Clone, Debug)]
pub(super) enum KeptBase {
    /// There is nothing to draw, and this was said about it.
    Nothing(Arc<Notes>),
    Base(Arc<Base>),
}

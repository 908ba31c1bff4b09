//! What every scene must satisfy before it is prepared.

use super::Scene;

/// Checks ids and drops unusable triangles, with a counted warning for each kind.
pub(super) fn check(_scene: &mut Scene) {}

//! Where the things of a scene are while the shutter is open.

use super::flatten::Later;
use crate::scene::{Pose, Scene};
use glam::DMat4;

/// Times at which instance `i` is known, the opening of the shutter among them; 1 for what keeps its place.
pub fn keys_of_instance(scene: &Scene, i: usize) -> usize {
    1 + scene.motion.instances.get(&(i as u32)).map_or(0, Vec::len)
}

/// Times at which the form of mesh `i` is known; 1 for what keeps its form.
pub fn keys_of_mesh(scene: &Scene, i: usize) -> usize {
    1 + scene.motion.meshes.get(&(i as u32)).map_or(0, Vec::len)
}

/// Whether instance `i` moves.
pub fn moves(scene: &Scene, i: usize) -> bool {
    keys_of_instance(scene, i) > 1 || keys_of_mesh(scene, scene.instances[i].mesh.index()) > 1
}

/// The map of instance `i` at key `k` of `keys` evenly spaced ones.
pub fn map_at(scene: &Scene, i: usize, k: usize, keys: usize) -> DMat4 {
    let first = scene.instances[i].world_from_object;
    let Some(later) = scene.motion.instances.get(&(i as u32)) else { return first };
    let at = |k: usize| if k == 0 { first } else { later[k - 1] };
    let (before, s) = position(k, keys, later.len());
    let (a, b) = (at(before), at((before + 1).min(later.len())));
    if s == 0.0 { a } else { a + (b - a) * s }
}

/// Of `last` + 1 keys the one before key `k` of `keys`, and from there to the next.
fn position(k: usize, keys: usize, last: usize) -> (usize, f64) {
    // Exact where one number of segments divides the other, as powers of two do.
    let (whole, rest) = (k * last / (keys - 1), k * last % (keys - 1));
    (whole, rest as f64 / (keys - 1) as f64)
}

/// The form of mesh `i` at key `k` > 0 of `keys`; `None` if it keeps its own.
///
/// # Panics
/// When its own keys are not as many: all meshes that change their form have equally many.
pub fn pose_at(scene: &Scene, i: usize, k: usize, keys: usize) -> Option<&Pose> {
    let poses = scene.motion.meshes.get(&(i as u32))?;
    assert_eq!(poses.len() + 1, keys, "keys of a mesh that changes its form");
    Some(&poses[k - 1])
}

/// Instance `i` at the later ones of `keys` keys.
pub fn later(scene: &Scene, i: usize, keys: usize) -> Vec<Later<'_>> {
    let mesh = scene.instances[i].mesh.index();
    let at = |k: usize| Later { world_from_object: map_at(scene, i, k, keys), pose: pose_at(scene, mesh, k, keys) };
    (1..keys).map(at).collect()
}

/// How many keys the instances `all` need, if their vertices are to be known at each.
pub fn most_keys(scene: &Scene, all: &[u32]) -> usize {
    let of = |&i: &u32| {
        keys_of_instance(scene, i as usize).max(keys_of_mesh(scene, scene.instances[i as usize].mesh.index()))
    };
    all.iter().map(of).max().unwrap_or(1)
}

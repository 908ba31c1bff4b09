//! The chosen scene, and its nodes with their transforms.

use super::check::children;
use super::locate::shorten;
use super::{Document, Loader, Result, camera, extensions, instancing, light, mesh, name_or, shape};
use crate::scene::Instance;
use glam::{DMat4, DQuat, DVec3};
use gltf::json::Index;
use gltf::json::scene::Node;
use serde_json::Value;

/// A quaternion whose length is further than this from 1 is told to the user; f32 exporters stay far below.
const QUATERNION_SLACK: f64 = 1e-3;
/// A bottom row of a matrix further than this from 0 0 0 1 is a projection, not an affine map.
const AFFINE_SLACK: f64 = 1e-6;

/// Which scene is loaded.
pub(super) struct Chosen {
    /// Its index (0 in a file without scenes).
    pub index: usize,
    /// Its root nodes, which exist and are distinct.
    pub roots: Vec<usize>,
    pub warning: Option<String>,
}

/// The scene that the user, else the file, asks for.
pub(super) fn choose_scene(doc: &Document, wanted: Option<&str>, parents: &[Option<usize>]) -> Result<Chosen> {
    let scenes = &doc.root.scenes;
    if scenes.is_empty() {
        if let Some(index) = doc.root.scene {
            doc.item(scenes, index, "/scene", "scenes")?;
        }
        if let Some(wanted) = wanted {
            let fix = "The file has no scenes: leave --scene out to see all its nodes.";
            return Err(doc.error("/scenes", format!("there is no scene \"{}\"", shorten(wanted)), fix));
        }
        let roots: Vec<usize> = (0..parents.len()).filter(|&i| parents.get(i) == Some(&None)).collect();
        let warning = (!roots.is_empty()).then(|| "the file has no scenes: all its nodes are shown".to_owned());
        return Ok(Chosen { index: 0, roots, warning });
    }
    let index = match wanted {
        Some(wanted) => find_scene(doc, wanted)?,
        None => match doc.root.scene {
            None => 0,
            Some(index) => {
                doc.item(scenes, index, "/scene", "scenes")?;
                index.value()
            }
        },
    };
    let Some(scene) = scenes.get(index) else { return Err(doc.error("/scene", "no such scene", "")) };
    let at = format!("/scenes/{index}");
    if let Some(carried) = &scene.extensions {
        extensions::note_carried(doc, carried.others.keys(), &at, &[]);
    }
    let mut roots = Vec::with_capacity(scene.nodes.len());
    let mut seen = vec![false; doc.root.nodes.len()];
    for (k, node) in scene.nodes.iter().enumerate() {
        let at = format!("{at}/nodes/{k}");
        doc.item(&doc.root.nodes, *node, &at, "nodes")?;
        let node = node.value();
        if let Some(parent) = parents.get(node).copied().flatten() {
            let fix = "A scene lists root nodes only: remove it here or from its parent's children.";
            return Err(doc.error(at, format!("node {node} is a child of node {parent}"), fix));
        }
        if let Some(flag) = seen.get_mut(node) {
            if *flag {
                return Err(doc.error(at, format!("node {node} is listed twice"), "Remove one of the two."));
            }
            *flag = true;
        }
        roots.push(node);
    }
    Ok(Chosen { index, roots, warning: None })
}

/// A scene by index, else by name.
fn find_scene(doc: &Document, wanted: &str) -> Result<usize> {
    let scenes = &doc.root.scenes;
    let by_index = wanted.parse().ok().filter(|&i: &usize| i < scenes.len());
    let by_name = || scenes.iter().position(|s| s.name.as_deref() == Some(wanted));
    by_index.or_else(by_name).ok_or_else(|| {
        let listed: Vec<String> = scenes
            .iter()
            .enumerate()
            .map(|(i, s)| s.name.as_ref().map_or_else(|| i.to_string(), |n| format!("{i} \"{}\"", shorten(n))))
            .collect();
        let problem = format!("there is no scene \"{}\"", shorten(wanted));
        doc.error("/scenes", problem, format!("Allowed: {}.", listed.join(", ")))
    })
}

/// Places what the nodes below `roots` carry, in the order of the file (parents first).
pub(super) fn walk(loader: &mut Loader, roots: &[usize]) -> Result<()> {
    visit(loader, roots, place)
}

/// Places the cameras below `roots` and nothing else.
pub(super) fn walk_cameras(loader: &mut Loader, roots: &[usize]) -> Result<()> {
    visit(loader, roots, |loader, node, i, here| place_camera(loader, node, i, here.world))
}

/// Calls `place` with every node below `roots`, its index and what it inherits with its own part.
fn visit(
    loader: &mut Loader,
    roots: &[usize],
    place: fn(&mut Loader, &Node, usize, Above) -> Result<()>,
) -> Result<()> {
    // A stack of our own: files with very deep trees exist.
    let root = Above { world: DMat4::IDENTITY, visible: true };
    let mut stack: Vec<(usize, Above)> = roots.iter().rev().map(|&i| (i, root)).collect();
    while let Some((i, above)) = stack.pop() {
        let Some(node) = loader.doc.root.nodes.get(i) else { continue };
        let world = below(loader, above.world, node, i)?;
        let here = Above { world, visible: above.visible && visible(loader.doc, node, i)? };
        place(loader, node, i, here)?;
        stack.extend(children(node).iter().rev().map(|c| (c.value(), here)));
    }
    Ok(())
}

/// What a node inherits.
#[derive(Clone, Copy)]
struct Above {
    world: DMat4,
    /// `false` below a node that KHR_node_visibility hides.
    visible: bool,
}

/// The world transform of node `i`, from the root of its tree down; remembered.
pub(super) fn world(loader: &mut Loader, i: usize) -> Result<DMat4> {
    let mut path = Vec::new();
    let mut at = Some(i);
    let mut world = DMat4::IDENTITY;
    while let Some(node) = at {
        if let Some(&known) = loader.worlds.get(&node) {
            world = known;
            break;
        }
        path.push(node);
        at = loader.parents.get(node).copied().flatten();
    }
    for i in path.into_iter().rev() {
        let Some(node) = loader.doc.root.nodes.get(i) else { continue };
        world = below(loader, world, node, i)?;
        loader.worlds.insert(i, world);
    }
    Ok(world)
}

/// The world transform of a node below something placed at `above`.
fn below(loader: &mut Loader, above: DMat4, node: &Node, i: usize) -> Result<DMat4> {
    let world = above * local(loader, node, i)?;
    if !world.is_finite() {
        let fix = "The product of the transforms above this node is too large.";
        return Err(loader.doc.error(format!("/nodes/{i}"), "the world transform is not finite", fix));
    }
    Ok(world)
}

/// What KHR_node_visibility says of the node alone.
fn visible(doc: &Document, node: &Node, i: usize) -> Result<bool> {
    const NAME: &str = "KHR_node_visibility";
    let Some(found) = node.extensions.as_ref().and_then(|e| e.others.get(NAME)) else { return Ok(true) };
    match found.get("visible") {
        None => Ok(true),
        Some(Value::Bool(visible)) => Ok(*visible),
        Some(_) => {
            let at = format!("/nodes/{i}/extensions/{NAME}/visible");
            Err(doc.bad(&at, "is neither true nor false", "Allowed: true, false; true without it."))
        }
    }
}

fn place(loader: &mut Loader, node: &Node, i: usize, Above { world, visible }: Above) -> Result<()> {
    if node.mesh.is_none() && node.camera.is_none() && node.extensions.is_none() {
        return Ok(());
    }
    let doc = loader.doc;
    let at = format!("/nodes/{i}");
    let name = || name_or(node.name.as_ref(), "nodes", i);
    if let Some(carried) = &node.extensions {
        extensions::note_carried(doc, carried.others.keys(), &at, &[]);
    }
    if let Some(found) = shape::of(node) {
        if visible {
            shape::place(loader, node, i, found, world)?;
        }
    } else if let Some(index) = node.mesh
        && visible
    {
        place_mesh(loader, node, index, i, world, name())?;
    }
    // Hidden nodes keep their cameras: the extension says that it does not affect them.
    place_camera(loader, node, i, world)?;
    if let Some(light) = node.extensions.as_ref().and_then(|e| e.khr_lights_punctual.as_ref())
        && visible
    {
        let pointer = format!("{at}/extensions/KHR_lights_punctual/light");
        light::place(loader, light.light, &pointer, world, &at, &name())?;
        loader.trace.lights.push(i);
    }
    Ok(())
}

/// Places a node's mesh: by the node, by the joints of its skin, or once per instance.
fn place_mesh(
    loader: &mut Loader,
    node: &Node,
    index: Index<gltf::json::Mesh>,
    i: usize,
    world: DMat4,
    name: String,
) -> Result<()> {
    let at = &format!("/nodes/{i}");
    let posed = mesh::read(loader, index, &format!("{at}/mesh"), node, i)?;
    let instancing = node.extensions.as_ref().and_then(|e| e.others.get(instancing::NAME));
    // Below the node; of what joints place, nothing is.
    let (world, locals) = match (instancing, posed.world) {
        (None, Some(world)) => (world, vec![DMat4::IDENTITY]),
        (Some(_), Some(world)) => {
            loader.lose_once("instances of a skinned mesh are not placed: its joints place it, once");
            (world, vec![DMat4::IDENTITY])
        }
        (None, None) => (world, vec![DMat4::IDENTITY]),
        (Some(found), None) => {
            let at = format!("{at}/extensions/{}", instancing::NAME);
            (world, instancing::read(loader, found, &at)?)
        }
    };
    let is_rigid = posed.world.is_none();
    for node_from_object in locals {
        let world_from_object = world * node_from_object;
        if !world_from_object.is_finite() {
            let fix = "The product of the transforms above it is too large.";
            return Err(loader.doc.error(at, "the world transform of an instance is not finite", fix));
        }
        for &mesh in posed.ids.iter() {
            loader.builder.add_instance(Instance { mesh, world_from_object, name: name.clone() });
            loader.trace.instances.push(is_rigid.then_some((i, node_from_object, mesh)));
        }
    }
    Ok(())
}

fn place_camera(loader: &mut Loader, node: &Node, i: usize, world: DMat4) -> Result<()> {
    let Some(index) = node.camera else { return Ok(()) };
    let at = format!("/nodes/{i}");
    let given = node.name.as_deref().unwrap_or_default();
    camera::place(loader, index, &format!("{at}/camera"), world, &at, given, &node.extras)?;
    loader.trace.cameras.push(i);
    Ok(())
}

/// The node's own transform.
fn local(loader: &mut Loader, node: &Node, i: usize) -> Result<DMat4> {
    let doc = loader.doc;
    let at = |key: &str| format!("/nodes/{i}/{key}");
    let finite = |values: &[f32], key: &str| match values.iter().all(|v| v.is_finite()) {
        true => Ok(()),
        false => Err(doc.bad(&at(key), "is not finite as a 32-bit float", "Use smaller numbers.")),
    };
    if let Some(matrix) = &node.matrix {
        finite(matrix, "matrix")?;
        if node.translation.is_some() || node.rotation.is_some() || node.scale.is_some() {
            let fix = "A node has either a matrix or translation, rotation and scale.";
            return Err(doc.error(format!("/nodes/{i}"), "has a matrix and translation, rotation or scale", fix));
        }
        let matrix = DMat4::from_cols_array(&matrix.map(f64::from));
        let bottom = matrix.row(3);
        if (bottom - glam::DVec4::W).abs().max_element() > AFFINE_SLACK {
            let fix = "Its last row (every fourth number) must be 0 0 0 1. Is it written row by row?";
            return Err(doc.bad(&at("matrix"), "is not affine", fix));
        }
        let mut matrix = matrix;
        (matrix.x_axis.w, matrix.y_axis.w, matrix.z_axis.w, matrix.w_axis.w) = (0.0, 0.0, 0.0, 1.0);
        return Ok(matrix);
    }
    let translation = node.translation.unwrap_or([0.0; 3]);
    let rotation = node.rotation.unwrap_or_default().0;
    let scale = node.scale.unwrap_or([1.0; 3]);
    finite(&translation, "translation")?;
    finite(&rotation, "rotation")?;
    finite(&scale, "scale")?;
    let rotation = DQuat::from_array(rotation.map(f64::from));
    let length = rotation.length();
    if length == 0.0 {
        let fix = "It must be a quaternion x y z w of length 1; 0 0 0 1 turns nothing.";
        return Err(doc.bad(&at("rotation"), "has length 0", fix));
    }
    if (length - 1.0).abs() > QUATERNION_SLACK {
        loader.warn_once("a rotation is not of length 1: normalised");
    }
    let vec = |v: [f32; 3]| DVec3::from_array(v.map(f64::from));
    Ok(DMat4::from_scale_rotation_translation(vec(scale), rotation / length, vec(translation)))
}

/// The rigid part of a transform.
pub(super) enum Rigid {
    /// Rotation and translation; right-handed.
    Frame(DMat4),
    /// The z axis is squashed to a point, so there is no direction to keep; translation only.
    NoDirection(DMat4),
}

/// Rotation and translation of `world`, scale and shear removed: Gram-Schmidt that keeps the z axis (cameras look
/// and lights shine along -z), then as much as possible of y. A mirrored transform loses its mirroring in x.
pub(super) fn rigid(world: &DMat4) -> Rigid {
    let axis = |v: glam::DVec4| v.truncate();
    let (x, y, translation) = (axis(world.x_axis), axis(world.y_axis), axis(world.w_axis));
    let Some(z) = direction(axis(world.z_axis)) else {
        return Rigid::NoDirection(DMat4::from_translation(translation));
    };
    let orthogonal = |v: DVec3| direction(v).and_then(|v| direction(v - z * z.dot(v)));
    let y = orthogonal(y).or_else(|| orthogonal(x).map(|x| z.cross(x))).unwrap_or_else(|| z.any_orthonormal_vector());
    let x = y.cross(z);
    Rigid::Frame(DMat4::from_cols(x.extend(0.0), y.extend(0.0), z.extend(0.0), translation.extend(1.0)))
}

/// `v` with length 1, however long; `None` for the null vector.
fn direction(v: DVec3) -> Option<DVec3> {
    // Scaled first, so that neither tiny nor huge axes leave the range of the squares.
    let largest = v.abs().max_element();
    (largest > 0.0 && largest.is_finite()).then(|| v / largest).and_then(DVec3::try_normalize)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(world: DMat4) -> DMat4 {
        match rigid(&world) {
            Rigid::Frame(frame) => frame,
            Rigid::NoDirection(_) => panic!("no direction"),
        }
    }

    #[test]
    fn rigid_part_forgets_scale_and_keeps_the_look_axis() {
        let turn = DQuat::from_rotation_y(0.7) * DQuat::from_rotation_x(0.3);
        let place = DVec3::new(1.0, 2.0, 3.0);
        let expected = DMat4::from_rotation_translation(turn, place);
        let scaled = DMat4::from_scale_rotation_translation(DVec3::new(2.0, 1e-30, 5e9), turn, place);
        assert!(frame(scaled).abs_diff_eq(expected, 1e-12));
    }

    #[test]
    fn rigid_part_of_a_mirrored_or_sheared_transform_is_a_rotation_with_the_same_z() {
        for (x, y, z) in [
            (-DVec3::X, DVec3::Y, DVec3::Z),
            (DVec3::X, DVec3::new(0.3, 1.0, 0.4), DVec3::new(0.1, 0.2, -2.0)),
            (DVec3::X, DVec3::Z, DVec3::Z),
            (DVec3::ZERO, DVec3::ZERO, DVec3::Z),
        ] {
            let world = DMat4::from_cols(x.extend(0.0), y.extend(0.0), z.extend(0.0), DVec3::ONE.extend(1.0));
            let rigid = frame(world);
            assert!((rigid.determinant() - 1.0).abs() < 1e-12);
            assert!((rigid * rigid.transpose()).x_axis.x > 0.0);
            assert!(rigid.z_axis.truncate().abs_diff_eq(z.normalize(), 1e-12));
        }
    }

    #[test]
    fn squashed_look_axis_has_no_direction() {
        assert!(matches!(rigid(&DMat4::from_scale(DVec3::new(1.0, 1.0, 0.0))), Rigid::NoDirection(_)));
    }
}

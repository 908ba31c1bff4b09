//! Channels: what an animation moves, and the curve that it follows.

use super::curve::{Curve, Interpolation, Quantity};
use super::pointer::{self, Pointer};
use crate::load::gltf::locate::shorten;
use crate::load::gltf::semantic::{KEY_TIMES, Wanted};
use crate::load::gltf::{Document, Result, accessor};
use gltf::json::Index;
use serde::Deserialize;
use serde_json::{Map, Value};
use std::cell::OnceCell;

/// A property and the curve that it follows.
#[derive(Debug)]
pub(super) struct Channel {
    pub target: Target,
    pub curve: Curve,
}

/// What is moved.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Target {
    /// Of a node.
    Translation(usize),
    /// Of a node.
    Rotation(usize),
    /// Of a node.
    Scale(usize),
    /// Of the morph targets of a node's mesh.
    Weights(usize),
    /// Of the morph targets of a mesh, where its node has none of its own.
    MeshWeights(usize),
    /// Anything else (`KHR_animation_pointer`).
    Pointer(Pointer),
}

/// A channel as the file has it.
#[derive(Deserialize)]
pub(super) struct Json {
    sampler: usize,
    target: TargetJson,
}

#[derive(Deserialize)]
struct TargetJson {
    node: Option<usize>,
    path: String,
    #[serde(default)]
    extensions: Map<String, Value>,
}

/// A sampler as the file has it.
#[derive(Deserialize)]
pub(super) struct SamplerJson {
    input: u32,
    output: u32,
    interpolation: Option<String>,
}

/// What the numbers of a target are.
struct Property {
    target: Target,
    /// Numbers of one value.
    width: usize,
    /// Whether they are as many elements of one number each.
    is_list: bool,
    quantity: Quantity,
    wanted: Wanted,
}

/// The channel at `at`, or why it is ignored; `tree` is the file's JSON, once somebody needs it.
pub(super) fn read(
    doc: &Document,
    tree: &OnceCell<Value>,
    json: &Json,
    samplers: &[SamplerJson],
    animation: usize,
    at: &str,
) -> Result<std::result::Result<Channel, String>> {
    let property = match property(doc, tree, &json.target, at)? {
        Ok(property) => property,
        Err(why) => return Ok(Err(why)),
    };
    let Some(sampler) = samplers.get(json.sampler) else {
        let fix = format!("The animation has {} samplers, counted from 0.", samplers.len());
        return Err(doc.error(format!("{at}/sampler"), format!("there is no sampler {}", json.sampler), fix));
    };
    let sampler_at = format!("/animations/{animation}/samplers/{}", json.sampler);
    let times = times(doc, sampler, &sampler_at)?;
    if times.is_empty() {
        return Ok(Err("has no keys".into()));
    }
    let interpolation = match sampler.interpolation.as_deref() {
        None | Some("LINEAR") => Interpolation::Linear,
        Some("STEP") => Interpolation::Step,
        Some("CUBICSPLINE") => Interpolation::CubicSpline,
        Some(_) => {
            let fix = "Allowed: LINEAR, STEP, CUBICSPLINE; LINEAR without it.";
            return Err(doc.bad(&format!("{sampler_at}/interpolation"), "is not an interpolation", fix));
        }
    };
    let Property { target, width, is_list, quantity, wanted } = property;
    let output = format!("{sampler_at}/output");
    let elements = accessor::open(doc, Index::new(sampler.output), &output, &wanted)?;
    let (count, each) = (elements.count, if is_list { width } else { 1 });
    let parts = if interpolation == Interpolation::CubicSpline { 3 } else { 1 };
    if count != times.len() * parts * each {
        let of = if is_list { format!(" x {width} numbers") } else { String::new() };
        let of = if parts == 3 { format!(" x 3 (tangent, value, tangent){of}") } else { of };
        let fix = format!("There must be {}: {} keys{of}.", times.len() * parts * each, times.len());
        return Err(doc.error(output, format!("{count} values"), fix));
    }
    let values = elements.numbers()?;
    if let Some(k) = values.iter().position(|v| !v.is_finite()) {
        let problem = format!("number {k} of accessor {} is {}", sampler.output, values.get(k).copied().unwrap_or(0.0));
        return Err(doc.error(output, problem, "Values of animations must be finite."));
    }
    // A tangent to something that is on or off says nothing.
    let interpolation = if target.is_switch() && parts == 1 { Interpolation::Step } else { interpolation };
    Ok(Ok(Channel { target, curve: Curve { times, values, width, interpolation, quantity } }))
}

impl Target {
    fn is_switch(&self) -> bool {
        matches!(self, Self::Pointer(pointer) if pointer.is_switch)
    }
}

/// `[n]` seconds; not negative, increasing.
fn times(doc: &Document, sampler: &SamplerJson, at: &str) -> Result<Vec<f32>> {
    let at = format!("{at}/input");
    let times = accessor::open(doc, Index::new(sampler.input), &at, &KEY_TIMES)?.numbers()?;
    let wrong = |k: usize, why: String| {
        let time = times.get(k).copied().unwrap_or(0.0);
        let fix = "Times of keys are seconds from 0 on, finite, each later than the one before.";
        doc.error(at.as_str(), format!("key {k} of accessor {} is at {time} s{why}", sampler.input), fix)
    };
    if let Some(k) = times.iter().position(|t| !(t.is_finite() && *t >= 0.0)) {
        return Err(wrong(k, String::new()));
    }
    match times.windows(2).position(|pair| matches!(pair, [a, b] if a >= b)) {
        Some(k) => Err(wrong(k + 1, format!(", the one before at {} s", times.get(k).copied().unwrap_or(0.0)))),
        None => Ok(times),
    }
}

/// What is moved, or why nothing is.
fn property(
    doc: &Document,
    tree: &OnceCell<Value>,
    json: &TargetJson,
    at: &str,
) -> Result<std::result::Result<Property, String>> {
    let at = format!("{at}/target");
    if json.path == "pointer" {
        const NAME: &str = "KHR_animation_pointer";
        let text = json.extensions.get(NAME).and_then(|e| e.get("pointer")).and_then(Value::as_str);
        let Some(text) = text else {
            let fix = "A target of the path \"pointer\" has its pointer in the extension KHR_animation_pointer.";
            return Err(doc.error(format!("{at}/extensions/{NAME}/pointer"), "is not there", fix));
        };
        let tree = tree.get_or_init(|| serde_json::from_slice(doc.json()).unwrap_or_default());
        return match pointer::parse(doc, tree, text) {
            Err(why) => Ok(Err(format!("leads to {}, {why}", shorten(text)))),
            Ok(pointer::Found::Node(node, path)) => {
                of_node(doc, node, &path, &format!("{at}/extensions/{NAME}/pointer"))
            }
            Ok(pointer::Found::MeshWeights(mesh)) => Ok(weights(doc, mesh, Target::MeshWeights(mesh))),
            Ok(pointer::Found::Other(pointer)) => Ok(Ok(Property {
                width: pointer.width,
                is_list: false,
                quantity: Quantity::Numbers,
                wanted: Wanted::animated(pointer.width, pointer.is_switch, true),
                target: Target::Pointer(pointer),
            })),
        };
    }
    match json.node {
        None => Ok(Err("names no node".into())),
        Some(node) => of_node(doc, node, &json.path, &format!("{at}/node")),
    }
}

/// A property of a node, which was named at `at`.
fn of_node(doc: &Document, node: usize, path: &str, at: &str) -> Result<std::result::Result<Property, String>> {
    let Ok(index) = u32::try_from(node) else { return Err(doc.bad(at, "is not an index into nodes", "")) };
    let found = doc.item(&doc.root.nodes, Index::<gltf::json::Node>::new(index), at, "nodes")?;
    let make = |target: Target, width: usize, quantity: Quantity| {
        if found.matrix.is_some() {
            let fix = "Only translation, rotation and scale can be animated: export the node with these.";
            return Err(doc.error(at, format!("node {node} is animated and has a matrix"), fix));
        }
        let wanted = Wanted::animated(width, false, quantity == Quantity::Rotation);
        Ok(Ok(Property { target, width, is_list: false, quantity, wanted }))
    };
    match path {
        "translation" => make(Target::Translation(node), 3, Quantity::Numbers),
        "rotation" => make(Target::Rotation(node), 4, Quantity::Rotation),
        "scale" => make(Target::Scale(node), 3, Quantity::Numbers),
        "weights" => Ok(match found.mesh {
            None => Err(format!("moves the weights of node {node}, which has no mesh")),
            Some(mesh) => weights(doc, mesh.value(), Target::Weights(node)),
        }),
        other => Ok(Err(format!("moves \"{}\", which is no property that can be animated", shorten(other)))),
    }
}

/// As many weights as the mesh has morph targets.
fn weights(doc: &Document, mesh: usize, target: Target) -> std::result::Result<Property, String> {
    let Some(found) = doc.root.meshes.get(mesh) else { return Err(format!("moves mesh {mesh}, which is not there")) };
    let targets = found.primitives.iter().map(|p| p.targets.as_ref().map_or(0, Vec::len)).max().unwrap_or(0);
    if targets == 0 {
        return Err(format!("moves the weights of mesh {mesh}, which has no morph targets"));
    }
    let wanted = Wanted::animated(1, false, true);
    Ok(Property { target, width: targets, is_list: true, quantity: Quantity::Numbers, wanted })
}

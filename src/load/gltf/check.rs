//! What is checked of the whole file before anything in it is followed.

use super::{Document, Result};
use gltf::json::Index;
use gltf::json::scene::Node;
use serde_json::Value;

/// `asset.version` must be 2.x and `asset.minVersion` at most 2.0.
pub(super) fn asset(doc: &Document) -> Result<()> {
    let asset = &doc.root.asset;
    if number(&asset.version).is_none_or(|(major, _)| major != 2) {
        let fix = "Only glTF 2.x is read. Convert the file, for example by importing and exporting it.";
        return Err(doc.bad("/asset/version", "is not glTF 2", fix));
    }
    match asset.min_version.as_deref().map(number) {
        None | Some(Some((0 | 1, _) | (2, 0))) => Ok(()),
        _ => Err(doc.bad("/asset/minVersion", "is more than is read", "Only glTF 2.0 is read.")),
    }
}

/// `major.minor`.
fn number(version: &str) -> Option<(u32, u32)> {
    let (major, minor) = version.split_once('.')?;
    Some((major.parse().ok()?, minor.parse().ok()?))
}

/// Indices and enumerations above 2^32 - 1, which the `gltf` crate would cut to 32 bits and so take for others.
pub(super) fn integers(doc: &Document) -> Result<()> {
    if !has_long_integer(doc.json()) {
        return Ok(());
    }
    let Ok(value) = serde_json::from_slice::<Value>(doc.json()) else { return Ok(()) };
    match find_large(&value, "", &mut String::new()) {
        None => Ok(()),
        Some(at) => Err(doc.bad(&at, "is not an index or a constant of glTF", "It must be less than 2^32 - 1.")),
    }
}

/// Whether ten digits or more follow each other that are not the decimals of a number: cheap, and rarely true.
fn has_long_integer(json: &[u8]) -> bool {
    let (mut run, mut before) = (0_usize, b' ');
    for &c in json {
        if !c.is_ascii_digit() {
            (run, before) = (0, c);
        } else {
            run += 1;
            if run >= 10 && before != b'.' {
                return true;
            }
        }
    }
    false
}

/// Keys whose value is an index or one of a few constants.
const SMALL: &[&str] = &[
    "buffer",
    "bufferView",
    "camera",
    "componentType",
    "index",
    "indices",
    "light",
    "magFilter",
    "material",
    "mesh",
    "minFilter",
    "mode",
    "sampler",
    "scene",
    "skin",
    "source",
    "target",
    "texCoord",
    "wrapS",
    "wrapT",
];
/// Keys whose value is a list or a table of indices.
const SMALL_LISTS: &[&str] = &["attributes", "children", "nodes"];

/// The JSON pointer of the first integer that is too large for its key. (serde_json bounds the depth of `value`.)
fn find_large(value: &Value, key: &str, path: &mut String) -> Option<String> {
    let mut inside = |name: &str, key: &str, child: &Value| {
        let length = path.len();
        path.push('/');
        path.push_str(&name.replace('~', "~0").replace('/', "~1"));
        let found = find_large(child, key, path);
        path.truncate(length);
        found
    };
    let listed = |name| if SMALL_LISTS.contains(&key) { "index" } else { name };
    match value {
        Value::Number(n) if SMALL.contains(&key) => {
            n.as_u64().is_some_and(|n| n >= u64::from(u32::MAX)).then(|| path.clone())
        }
        Value::Array(list) => list.iter().enumerate().find_map(|(i, v)| inside(&i.to_string(), listed(""), v)),
        Value::Object(map) => {
            map.iter().filter(|(k, _)| *k != "extras").find_map(|(k, v)| inside(k, listed(k.as_str()), v))
        }
        _ => None,
    }
}

/// The parent of each node, if the nodes are trees: children exist, have one parent, and no node is below itself.
pub(super) fn tree(doc: &Document) -> Result<Vec<Option<usize>>> {
    let nodes = &doc.root.nodes;
    let mut parents: Vec<Option<usize>> = vec![None; nodes.len()];
    for (i, node) in nodes.iter().enumerate() {
        for (k, child) in children(node).iter().enumerate() {
            let at = format!("/nodes/{i}/children/{k}");
            doc.item(nodes, *child, &at, "nodes")?;
            let Some(slot) = parents.get_mut(child.value()) else { continue };
            if let Some(other) = *slot {
                let problem = format!("node {} already is a child of node {other}", child.value());
                let fix = "A node has one parent: copy the node, or remove it from one of the two lists.";
                return Err(doc.error(at, problem, fix));
            }
            *slot = Some(i);
        }
    }
    // With one parent each, exactly the nodes on or below a cycle are not below a parentless node.
    let mut reached = vec![false; nodes.len()];
    let mut stack: Vec<usize> = (0..nodes.len()).filter(|&i| parents.get(i) == Some(&None)).collect();
    while let Some(i) = stack.pop() {
        if let Some(flag) = reached.get_mut(i) {
            *flag = true;
        }
        stack.extend(nodes.get(i).map_or(&[][..], children).iter().map(Index::value));
    }
    match reached.iter().position(|&r| !r) {
        None => Ok(parents),
        Some(lost) => {
            // Walking up as many steps as there are nodes ends on the cycle itself.
            let up = |i: usize| parents.get(i).copied().flatten().unwrap_or(i);
            let on = (0..nodes.len()).fold(lost, |i, _| up(i));
            let fix = "The nodes must be trees: remove the child that is also an ancestor.";
            Err(doc.error(format!("/nodes/{}/children", up(on)), format!("node {on} is its own descendant"), fix))
        }
    }
}

/// The children of a node, unchecked.
pub(super) fn children(node: &Node) -> &[Index<Node>] {
    node.children.as_deref().unwrap_or_default()
}

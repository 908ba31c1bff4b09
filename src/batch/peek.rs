//! The names of a file's cameras without loading the file: output names must be known to differ before anything is
//! rendered. Only a guess at what the loader will find; [`super::run()`] checks again when it knows.

use serde::Deserialize;
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// Of a document what the names of cameras depend on. Typed, because a tree of values takes twenty times the bytes of its
/// text: 300 MB for 200,000 nodes.
#[derive(Default, Deserialize)]
#[serde(default)]
struct Document {
    scene: Option<usize>,
    scenes: Option<Vec<SceneEntry>>,
    nodes: Vec<Node>,
    cameras: Vec<Named>,
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct SceneEntry {
    name: Option<String>,
    nodes: Vec<usize>,
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct Node {
    name: Option<String>,
    camera: Option<usize>,
    children: Vec<usize>,
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct Named {
    name: Option<String>,
}

/// Camera names (else node names, may be empty) in the chosen scene, depth first; `None` if the file cannot be read so.
pub(super) fn camera_names(path: &Path, scene: Option<&str>) -> Option<Vec<String>> {
    let document: Document = serde_json::from_slice(&json_bytes(path)?).ok()?;
    let Document { nodes, cameras, .. } = &document;
    let mut stack: Vec<usize> = roots(&document, scene)?;
    stack.reverse();
    let mut visited = vec![false; nodes.len()];
    let mut names = Vec::new();
    while let Some(index) = stack.pop() {
        let node = nodes.get(index)?;
        if std::mem::replace(&mut visited[index], true) {
            return None;
        }
        if let Some(camera) = node.camera {
            let camera = cameras.get(camera)?;
            let own = |name: &Option<String>| name.clone().filter(|name| !name.is_empty());
            names.push(own(&camera.name).or_else(|| own(&node.name)).unwrap_or_default());
        }
        stack.extend(node.children.iter().rev());
    }
    Some(names)
}

/// The JSON of a `.gltf` file or of the first chunk of a `.glb` file.
fn json_bytes(path: &Path) -> Option<Vec<u8>> {
    let mut file = File::open(path).ok()?;
    let mut bytes = Vec::new();
    if super::input::extension_rank(path)? == 0 {
        file.read_to_end(&mut bytes).ok()?;
        return Some(bytes);
    }
    let mut header = [0; 20];
    file.read_exact(&mut header).ok()?;
    if !header.starts_with(b"glTF") || &header[16..20] != b"JSON" {
        return None;
    }
    let length = u32::from_le_bytes(header[12..16].try_into().expect("four bytes"));
    file.take(u64::from(length)).read_to_end(&mut bytes).ok()?;
    Some(bytes)
}

fn roots(document: &Document, scene: Option<&str>) -> Option<Vec<usize>> {
    let Some(scenes) = &document.scenes else {
        let mut has_parent = vec![false; document.nodes.len()];
        for &child in document.nodes.iter().flat_map(|node| &node.children) {
            *has_parent.get_mut(child)? = true;
        }
        return Some((0..has_parent.len()).filter(|&i| !has_parent[i]).collect());
    };
    let index = match scene {
        None => document.scene.unwrap_or(0),
        Some(wanted) => match wanted.parse() {
            Ok(index) => index,
            Err(_) => scenes.iter().position(|s| s.name.as_deref() == Some(wanted))?,
        },
    };
    Some(scenes.get(index)?.nodes.clone())
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILE: &str = r#"{"asset": {"version": "2.0"}, "scene": 1,
        "scenes": [{"name": "empty"}, {"name": "all", "nodes": [0, 3]}],
        "nodes": [{"children": [1, 2]}, {"camera": 0}, {"camera": 1, "name": "Node"}, {"camera": 1}],
        "cameras": [{"name": "Main"}, {}]}"#;

    #[test]
    fn cameras_of_the_chosen_scene_are_named_depth_first() {
        let root = tempfile::tempdir().unwrap();
        let (gltf, glb) = (root.path().join("a.gltf"), root.path().join("a.glb"));
        std::fs::write(&gltf, FILE).unwrap();
        let mut binary = b"glTF\x02\0\0\0\0\0\0\0".to_vec();
        binary.extend_from_slice(&(FILE.len() as u32).to_le_bytes());
        binary.extend_from_slice(b"JSON");
        binary.extend_from_slice(FILE.as_bytes());
        std::fs::write(&glb, binary).unwrap();
        let names = ["Main", "Node", ""].map(String::from).to_vec();
        for path in [&gltf, &glb] {
            assert_eq!(camera_names(path, None), Some(names.clone()));
            assert_eq!(camera_names(path, Some("empty")), Some(vec![]));
            assert_eq!(camera_names(path, Some("0")), Some(vec![]));
            assert_eq!(camera_names(path, Some("7")), None);
        }
    }

    #[test]
    fn a_cycle_or_damage_gives_up() {
        let root = tempfile::tempdir().unwrap();
        let path = root.path().join("a.gltf");
        for text in [
            r#"{"scenes": [{"nodes": [0]}], "nodes": [{"children": [0]}]}"#,
            r#"{"scenes": [{"nodes": [5]}], "nodes": []}"#,
            "{",
        ] {
            std::fs::write(&path, text).unwrap();
            assert_eq!(camera_names(&path, None), None, "{text}");
        }
    }
}

//! Animations: the chosen ones as curves, and the file posed at a time, as if it had been written so.
//!
//! Nothing behind this knows of time: values go into the [`Document`] in the place of those that the file has, and the
//! scene is then walked as that of any file. Each channel sets its property at every time, so nothing needs to be undone.

mod channel;
mod curve;
mod pointer;

use super::locate::shorten;
use super::{Document, Result};
use crate::load::moment::AnimationChoice;
use channel::{Channel, Target};
use gltf::json::scene::{Node, UnitQuaternion};
use serde::Deserialize;
use serde_json::Value;
use std::cell::OnceCell;
use std::collections::BTreeSet;

/// The chosen animations of a file.
#[derive(Debug, Default)]
pub(super) struct Animation {
    channels: Vec<Channel>,
    /// By index.
    pub chosen: BTreeSet<usize>,
    /// About channels that are ignored.
    pub warnings: Vec<String>,
    /// Times of all keys, seconds, increasing.
    keys: Vec<f64>,
}

/// An animation as the file has it, as loosely as JSON can be: what is wrong with it is said with its place.
#[derive(Deserialize)]
struct Json {
    #[serde(default)]
    channels: Vec<channel::Json>,
    #[serde(default)]
    samplers: Vec<channel::SamplerJson>,
}

/// The list alone: the rest of the file is not built a second time.
#[derive(Default, Deserialize)]
struct List {
    #[serde(default)]
    animations: Vec<Value>,
}

impl Animation {
    /// Reads the animations that `choice` names. A file without any has the empty one.
    ///
    /// # Errors
    /// There is no such animation, or one of its channels is wrong.
    pub fn read(doc: &Document, choice: &AnimationChoice) -> Result<Self> {
        let List { animations } = serde_json::from_slice(doc.json()).unwrap_or_default();
        let mut all = Self::default();
        if animations.is_empty() && matches!(choice, AnimationChoice::Index(0) | AnimationChoice::All) {
            return Ok(all);
        }
        let name = |animation: &Value| animation.get("name").and_then(Value::as_str).unwrap_or_default().to_owned();
        let names: Vec<String> = animations.iter().map(name).collect();
        let found = match choice {
            AnimationChoice::All => 0..names.len(),
            AnimationChoice::Index(index) if *index < names.len() => *index..index + 1,
            AnimationChoice::Name(name) if names.contains(name) => {
                let first = names.iter().position(|n| n == name).unwrap_or(0);
                first..first + 1
            }
            AnimationChoice::Index(_) | AnimationChoice::Name(_) => {
                let list: Vec<_> = names.iter().enumerate().map(|(i, n)| format!("{i} \"{}\"", shorten(n))).collect();
                let fix = match list.is_empty() {
                    true => "The file has no animations: leave --animation out.".to_owned(),
                    false => format!("Allowed: {}, all.", list.join(", ")),
                };
                return Err(doc.error("/animations", format!("there is no animation {choice}"), fix));
            }
        };
        let tree = OnceCell::new();
        for (i, animation) in animations.into_iter().enumerate().filter(|(i, _)| found.contains(i)) {
            all.add(doc, &tree, i, animation)?;
        }
        all.keys.sort_by(f64::total_cmp);
        all.keys.dedup();
        Ok(all)
    }

    fn add(&mut self, doc: &Document, tree: &OnceCell<Value>, index: usize, animation: Value) -> Result<()> {
        let at = format!("/animations/{index}");
        let json = serde_json::from_value::<Json>(animation).map_err(|error| {
            doc.error(at.as_str(), format!("not as glTF 2.0 has it: {error}"), "Correct the file or export it again.")
        })?;
        let of_before = self.channels.len();
        for (k, found) in json.channels.iter().enumerate() {
            let at = format!("{at}/channels/{k}");
            match channel::read(doc, tree, found, &json.samplers, index, &at)? {
                Err(why) => self.warnings.push(format!("{at} {why}: ignored")),
                Ok(channel) => match self.channels.iter().position(|c| c.target == channel.target) {
                    None => {
                        self.keys.extend(channel.curve.times.iter().map(|&t| f64::from(t)));
                        self.channels.push(channel);
                    }
                    Some(other) => {
                        let whose = if other < of_before { "an animation before this one" } else { "another channel" };
                        self.warnings.push(format!("{at} moves what {whose} moves already: ignored"));
                    }
                },
            }
        }
        self.chosen.insert(index);
        Ok(())
    }

    /// Whether nothing ever moves.
    pub fn is_empty(&self) -> bool {
        self.channels.is_empty()
    }

    /// The time of the last key, seconds; 0 without keys.
    pub fn seconds(&self) -> f64 {
        self.keys.last().copied().unwrap_or(0.0)
    }

    /// How many keys lie between two times, the ends not counted.
    pub fn keys_between(&self, [start, end]: [f64; 2]) -> usize {
        let up_to = |time: f64| self.keys.partition_point(|&key| key < time);
        up_to(end).saturating_sub(self.keys.partition_point(|&key| key <= start))
    }

    /// Nodes that channels move within an interval.
    pub fn moved_nodes(&self, interval: [f64; 2]) -> BTreeSet<usize> {
        let node = |channel: &Channel| match channel.target {
            Target::Translation(node) | Target::Rotation(node) | Target::Scale(node) => Some(node),
            Target::Weights(_) | Target::MeshWeights(_) | Target::Pointer(_) => None,
        };
        self.channels.iter().filter(|channel| channel.curve.varies(interval)).filter_map(node).collect()
    }

    /// Those of `nodes` whose meshes change by morph weights within an interval.
    pub fn morphing_nodes(&self, nodes: &[Node], interval: [f64; 2]) -> BTreeSet<usize> {
        let (mut own, mut meshes) = (BTreeSet::new(), BTreeSet::new());
        for Channel { target, .. } in self.channels.iter().filter(|channel| channel.curve.varies(interval)) {
            match target {
                Target::Weights(node) => _ = own.insert(*node),
                Target::MeshWeights(mesh) => _ = meshes.insert(*mesh),
                _ => {}
            }
        }
        let of_mesh = |node: &Node| node.mesh.is_some_and(|mesh| meshes.contains(&mesh.value()));
        let morphs = |(i, node): &(usize, &Node)| own.contains(i) || of_mesh(node);
        nodes.iter().enumerate().filter(morphs).map(|(i, _)| i).collect()
    }

    /// Poses `doc` as at `time`, seconds.
    ///
    /// # Errors
    /// A value that a pointer leads to makes its object unreadable.
    pub fn pose(&self, doc: &mut Document, time: f64) -> Result<()> {
        self.point(doc, time)?;
        self.move_nodes(doc, time);
        Ok(())
    }

    /// Sets places and weights alone: what else a pointer leads to stays.
    pub fn move_nodes(&self, doc: &mut Document, time: f64) {
        for Channel { target, curve } in &self.channels {
            if let Target::Pointer(_) = target {
                continue;
            }
            let value: Vec<f32> = curve.at(time).into_iter().map(|v| v as f32).collect();
            let (nodes, meshes) = (&mut doc.root.nodes, &mut doc.root.meshes);
            match *target {
                Target::Translation(i) => {
                    nodes.get_mut(i).into_iter().for_each(|node| node.translation = value.first_chunk().copied());
                }
                Target::Scale(i) => {
                    nodes.get_mut(i).into_iter().for_each(|node| node.scale = value.first_chunk().copied());
                }
                Target::Rotation(i) => {
                    let rotation = value.first_chunk().copied().map(UnitQuaternion);
                    nodes.get_mut(i).into_iter().for_each(|node| node.rotation = rotation);
                }
                Target::Weights(i) => {
                    nodes.get_mut(i).into_iter().for_each(|node| node.weights = Some(value.clone()));
                }
                Target::MeshWeights(i) => {
                    meshes.get_mut(i).into_iter().for_each(|mesh| mesh.weights = Some(value.clone()));
                }
                Target::Pointer(_) => {}
            }
        }
    }

    /// Sets what pointers lead to, and reads the objects that hold it again.
    fn point(&self, doc: &mut Document, time: f64) -> Result<()> {
        let mut objects = BTreeSet::new();
        for Channel { target, curve } in &self.channels {
            if let Target::Pointer(pointer) = target {
                // Taken apart once; later times find it.
                let json = doc.posed.get_or_insert_with(|| serde_json::from_slice(&doc.json).unwrap_or_default());
                pointer.set(json, &curve.at(time));
                objects.insert(pointer.object);
            }
        }
        objects.into_iter().try_for_each(|object| object.read_again(doc))
    }
}

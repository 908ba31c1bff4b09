//! `KHR_animation_pointer`: properties that are animated by their JSON pointers.

use crate::load::gltf::{Document, Result};
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};

/// What a pointer leads to.
pub(super) enum Found {
    /// A property that nodes have channels for, by their name.
    Node(usize, String),
    MeshWeights(usize),
    Other(Pointer),
}

/// A property that exists, or has a default where its object exists.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Pointer {
    /// As the file has it.
    text: String,
    pub object: Object,
    /// Numbers of its value.
    pub width: usize,
    /// True or false.
    pub is_switch: bool,
}

/// What is read again when one of its properties has changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Object {
    Node(usize),
    Camera(usize),
    Light(usize),
    Material(usize),
}

/// Of each kind of object the properties that are read, below it, and their numbers.
const NODE: &[(&str, usize)] = &[("extensions/KHR_node_visibility/visible", 1)];
const CAMERA: &[(&str, usize)] = &[
    ("perspective/yfov", 1),
    ("perspective/aspectRatio", 1),
    ("perspective/znear", 1),
    ("perspective/zfar", 1),
    ("orthographic/xmag", 1),
    ("orthographic/ymag", 1),
    ("orthographic/znear", 1),
    ("orthographic/zfar", 1),
];
const LIGHT: &[(&str, usize)] =
    &[("color", 3), ("intensity", 1), ("range", 1), ("spot/innerConeAngle", 1), ("spot/outerConeAngle", 1)];
const MATERIAL: &[(&str, usize)] = &[
    ("alphaCutoff", 1),
    ("emissiveFactor", 3),
    ("normalTexture/scale", 1),
    ("occlusionTexture/strength", 1),
    ("pbrMetallicRoughness/baseColorFactor", 4),
    ("pbrMetallicRoughness/metallicFactor", 1),
    ("pbrMetallicRoughness/roughnessFactor", 1),
    ("extensions/KHR_materials_anisotropy/anisotropyStrength", 1),
    ("extensions/KHR_materials_anisotropy/anisotropyRotation", 1),
    ("extensions/KHR_materials_clearcoat/clearcoatFactor", 1),
    ("extensions/KHR_materials_clearcoat/clearcoatRoughnessFactor", 1),
    ("extensions/KHR_materials_clearcoat/clearcoatNormalTexture/scale", 1),
    ("extensions/KHR_materials_diffuse_transmission/diffuseTransmissionFactor", 1),
    ("extensions/KHR_materials_diffuse_transmission/diffuseTransmissionColorFactor", 3),
    ("extensions/KHR_materials_dispersion/dispersion", 1),
    ("extensions/KHR_materials_emissive_strength/emissiveStrength", 1),
    ("extensions/KHR_materials_ior/ior", 1),
    ("extensions/KHR_materials_iridescence/iridescenceFactor", 1),
    ("extensions/KHR_materials_iridescence/iridescenceIor", 1),
    ("extensions/KHR_materials_iridescence/iridescenceThicknessMinimum", 1),
    ("extensions/KHR_materials_iridescence/iridescenceThicknessMaximum", 1),
    ("extensions/KHR_materials_pbrSpecularGlossiness/diffuseFactor", 4),
    ("extensions/KHR_materials_pbrSpecularGlossiness/specularFactor", 3),
    ("extensions/KHR_materials_pbrSpecularGlossiness/glossinessFactor", 1),
    ("extensions/KHR_materials_sheen/sheenColorFactor", 3),
    ("extensions/KHR_materials_sheen/sheenRoughnessFactor", 1),
    ("extensions/KHR_materials_specular/specularFactor", 1),
    ("extensions/KHR_materials_specular/specularColorFactor", 3),
    ("extensions/KHR_materials_transmission/transmissionFactor", 1),
    ("extensions/KHR_materials_volume/thicknessFactor", 1),
    ("extensions/KHR_materials_volume/attenuationDistance", 1),
    ("extensions/KHR_materials_volume/attenuationColor", 3),
];
/// Below any texture of a material.
const TRANSFORM: &str = "extensions/KHR_texture_transform";
const OF_TRANSFORM: &[(&str, usize)] = &[("offset", 2), ("rotation", 1), ("scale", 2)];
/// Objects that a file may leave out, all of whose properties have defaults.
const WITH_DEFAULTS: [&str; 3] = ["pbrMetallicRoughness", "spot", "KHR_texture_transform"];

const LIGHTS: &str = "extensions/KHR_lights_punctual/lights/";

/// What the pointer `text` leads to, or why nothing can be animated there.
pub(super) fn parse(doc: &Document, json: &Value, text: &str) -> std::result::Result<Found, String> {
    let unknown = || "which is no property that can be animated here".to_owned();
    let missing = || "which is not there".to_owned();
    let path = text.strip_prefix('/').ok_or_else(unknown)?;
    let lights = path.strip_prefix(LIGHTS).map(|rest| ("lights", rest));
    let (kind, rest) = lights.or_else(|| path.split_once('/')).ok_or_else(unknown)?;
    let (index, below) = rest.split_once('/').ok_or_else(unknown)?;
    let index: usize = index.parse().map_err(|_| unknown())?;
    let root = &doc.root;
    let (known, object, count) = match kind {
        "nodes" => match below {
            "translation" | "rotation" | "scale" | "weights" if index < root.nodes.len() => {
                return Ok(Found::Node(index, below.to_owned()));
            }
            _ => (NODE, Object::Node(index), root.nodes.len()),
        },
        "meshes" if below == "weights" && index < root.meshes.len() => return Ok(Found::MeshWeights(index)),
        "meshes" => (&[][..], Object::Node(index), root.meshes.len()),
        "cameras" => (CAMERA, Object::Camera(index), root.cameras.len()),
        "lights" => (LIGHT, Object::Light(index), crate::load::gltf::light::list(doc).len()),
        "materials" => (MATERIAL, Object::Material(index), root.materials.len()),
        _ => return Err(unknown()),
    };
    if index >= count {
        return Err(missing());
    }
    let width = match known.iter().find(|(name, _)| *name == below) {
        Some((_, width)) => *width,
        None => transform(below, object).or_else(|| extra(json, text, below)).ok_or_else(unknown)?,
    };
    let is_switch = below.ends_with("/visible");
    let pointer = Pointer { text: text.to_owned(), object, width, is_switch };
    if !has_parent(json, text) {
        return Err(missing());
    }
    Ok(Found::Other(pointer))
}

/// The numbers of a property of a texture's transform.
fn transform(below: &str, object: Object) -> Option<usize> {
    let (before, name) = below.rsplit_once('/')?;
    let texture = before.strip_suffix(TRANSFORM)?.strip_suffix('/')?;
    let is_texture = texture.ends_with("Texture") && matches!(object, Object::Material(_));
    OF_TRANSFORM.iter().find(|(known, _)| *known == name && is_texture).map(|(_, width)| *width)
}

/// One number that the extras have for us.
fn extra(json: &Value, text: &str, below: &str) -> Option<usize> {
    below.strip_prefix("extras/prt_")?;
    json.pointer(text)?.is_number().then_some(1)
}

/// Whether [`parent`] would find or make it.
fn has_parent(json: &Value, text: &str) -> bool {
    let Some((path, _)) = text.rsplit_once('/') else { return false };
    let may_lack = |path: &str| {
        let (before, last) = path.rsplit_once('/').unwrap_or_default();
        let before =
            if last == WITH_DEFAULTS[2] { before.strip_suffix("/extensions").unwrap_or(before) } else { before };
        WITH_DEFAULTS.contains(&last) && json.pointer(before).is_some_and(Value::is_object)
    };
    json.pointer(path).is_some_and(Value::is_object) || json.pointer(path).is_none() && may_lack(path)
}

/// The object that holds the property, which is made where it may be left out.
fn parent<'j>(json: &'j mut Value, text: &str) -> Option<&'j mut Map<String, Value>> {
    let (path, _) = text.rsplit_once('/')?;
    let mut at = json;
    let mut parts = path.split('/').skip(1).peekable();
    while let Some(part) = parts.next() {
        let makes = WITH_DEFAULTS.contains(&part)
            || part == "extensions" && parts.peek().is_some_and(|next| WITH_DEFAULTS.contains(next));
        at = match at {
            Value::Array(list) => list.get_mut(part.parse::<usize>().ok()?)?,
            Value::Object(map) => {
                if makes && !map.contains_key(part) {
                    map.insert(part.to_owned(), Value::Object(Map::new()));
                }
                map.get_mut(part)?
            }
            _ => return None,
        };
    }
    at.as_object_mut()
}

impl Pointer {
    /// Writes a value into the file's JSON.
    pub fn set(&self, json: &mut Value, value: &[f64]) {
        // Rounded as a file that is read has it.
        let number = |v: f64| Value::from(f64::from(v as f32));
        let value = match value {
            [one] if self.is_switch => Value::Bool(*one != 0.0),
            [one] => number(*one),
            several => several.iter().map(|&v| number(v)).collect(),
        };
        let Some((_, key)) = self.text.rsplit_once('/') else { return };
        if let Some(parent) = parent(json, &self.text) {
            parent.insert(key.to_owned(), value);
        }
    }
}

impl Object {
    /// Takes the object over from the posed JSON.
    ///
    /// # Errors
    /// It is not what its kind should be any more.
    pub fn read_again(self, doc: &mut Document) -> Result<()> {
        let (at, index) = match self {
            Self::Node(i) => (format!("/nodes/{i}"), i),
            Self::Camera(i) => (format!("/cameras/{i}"), i),
            Self::Light(i) => (format!("/{LIGHTS}{i}"), i),
            Self::Material(i) => (format!("/materials/{i}"), i),
        };
        let Some(json) = doc.posed.as_ref().and_then(|json| json.pointer(&at)).map(Value::to_string) else {
            return Ok(());
        };
        let root = &mut doc.root;
        let read = match self {
            Self::Node(_) => put(&json, root.nodes.get_mut(index)),
            Self::Camera(_) => put(&json, root.cameras.get_mut(index)),
            Self::Material(_) => put(&json, root.materials.get_mut(index)),
            Self::Light(_) => {
                let lights = root.extensions.as_mut().and_then(|e| e.khr_lights_punctual.as_mut());
                put(&json, lights.and_then(|l| l.lights.get_mut(index)))
            }
        };
        read.map_err(|error| doc.error(at, format!("cannot be read as animated: {error}"), "Correct the animation."))
    }
}

/// By its text: what is kept as text in the typed JSON cannot come from a tree of values.
fn put<T: DeserializeOwned>(json: &str, into: Option<&mut T>) -> serde_json::Result<()> {
    let Some(into) = into else { return Ok(()) };
    *into = serde_json::from_str(json)?;
    Ok(())
}

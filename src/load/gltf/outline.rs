//! A file's JSON as far as sizes are told by it: counts of accessors, what places which mesh, which images are read.
//! Everything else is skipped while parsing, and nothing is checked: that is the loader's.

use serde::Deserialize;
use serde::de::{Deserializer, Visitor};
use std::collections::BTreeMap;
use std::fmt;

#[derive(Debug, Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct Outline {
    pub accessors: Vec<Accessor>,
    pub buffer_views: Vec<View>,
    pub buffers: Vec<Buffer>,
    pub images: Vec<Image>,
    pub textures: Vec<Texture>,
    pub materials: Vec<Material>,
    pub meshes: Vec<Mesh>,
    pub nodes: Vec<Node>,
    pub scenes: Option<Vec<Scene>>,
    pub scene: Option<usize>,
    pub extensions: RootExtensions,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct Accessor {
    pub buffer_view: Option<usize>,
    pub count: u64,
    pub component_type: u32,
    #[serde(rename = "type")]
    pub shape: String,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct View {
    pub buffer: usize,
    pub byte_offset: u64,
    pub byte_length: u64,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct Buffer {
    pub uri: Option<Uri>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct Image {
    pub uri: Option<Uri>,
    pub buffer_view: Option<usize>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Texture {
    source: Option<usize>,
    extensions: TextureExtensions,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
struct TextureExtensions {
    #[serde(rename = "EXT_texture_webp")]
    webp: Option<Source>,
}

#[derive(Debug, Deserialize)]
struct Source {
    source: usize,
}

impl Texture {
    /// Its image: the WebP one if it has that.
    pub fn image(&self) -> Option<usize> {
        self.extensions.webp.as_ref().map(|webp| webp.source).or(self.source)
    }
}

#[derive(Debug, Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct Material {
    pub pbr_metallic_roughness: MetallicRoughness,
    pub normal_texture: Option<Read>,
    pub emissive_texture: Option<Read>,
    pub emissive_factor: [f32; 3],
    pub alpha_mode: Option<String>,
    pub extensions: MaterialExtensions,
    pub extras: serde_json::Value,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct MetallicRoughness {
    pub base_color_texture: Option<Read>,
    pub metallic_roughness_texture: Option<Read>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct MaterialExtensions {
    #[serde(rename = "KHR_materials_unlit")]
    pub unlit: Option<serde::de::IgnoredAny>,
    #[serde(rename = "KHR_materials_specular")]
    pub specular: Specular,
    /// As they are; see `slots`.
    #[serde(flatten)]
    pub others: BTreeMap<String, serde_json::Value>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct Specular {
    pub specular_texture: Option<Read>,
    pub specular_color_texture: Option<Read>,
}

/// A `textureInfo`.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct Read {
    pub index: usize,
    pub tex_coord: u32,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Mesh {
    pub primitives: Vec<Primitive>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Primitive {
    pub attributes: BTreeMap<String, usize>,
    pub indices: Option<usize>,
    pub material: Option<usize>,
    pub mode: Option<u32>,
    pub targets: Vec<BTreeMap<String, usize>>,
    pub extensions: PrimitiveExtensions,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct PrimitiveExtensions {
    #[serde(rename = "KHR_materials_variants")]
    variants: Mappings,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
struct Mappings {
    mappings: Vec<Mapping>,
}

#[derive(Debug, Deserialize)]
struct Mapping {
    material: usize,
    variants: Vec<usize>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct RootExtensions {
    #[serde(rename = "KHR_materials_variants")]
    variants: Variants,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
struct Variants {
    variants: Vec<Variant>,
}

#[derive(Debug, Deserialize)]
struct Variant {
    name: String,
}

impl Primitive {
    /// Its material in a variant.
    pub fn material_in(&self, variant: Option<usize>) -> Option<usize> {
        let mappings = &self.extensions.variants.mappings;
        let mapped = variant.and_then(|v| mappings.iter().find(|mapping| mapping.variants.contains(&v)));
        mapped.map(|mapping| mapping.material).or(self.material)
    }
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Node {
    pub children: Vec<usize>,
    pub mesh: Option<usize>,
    pub skin: Option<usize>,
    pub weights: Vec<f32>,
    pub extensions: NodeExtensions,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct NodeExtensions {
    #[serde(rename = "EXT_mesh_gpu_instancing")]
    pub instancing: Option<Instancing>,
    #[serde(rename = "PRT_shape")]
    pub shape: Option<Shape>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Shape {
    pub material: Option<usize>,
    pub points: Vec<serde::de::IgnoredAny>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Instancing {
    pub attributes: BTreeMap<String, usize>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Scene {
    name: Option<String>,
    nodes: Vec<usize>,
}

/// A URI, of which only as much is kept as may be needed: a data URI can be as long as the file.
#[derive(Debug, Default)]
pub(super) struct Uri {
    /// All of a path; of a data URI the beginning.
    pub start: String,
    /// Bytes of the whole text.
    pub length: u64,
}

impl Uri {
    /// Of a data URI: room for the header of a picture behind its thumbnail and colour profile.
    const KEPT: usize = 1 << 17;

    /// Whether it holds the data itself.
    pub fn is_data(&self) -> bool {
        self.start.get(..5).is_some_and(|s| s.eq_ignore_ascii_case("data:"))
    }
}

impl<'de> Deserialize<'de> for Uri {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Text;
        impl Visitor<'_> for Text {
            type Value = Uri;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a string")
            }

            fn visit_str<E>(self, text: &str) -> Result<Uri, E> {
                let end = text.floor_char_boundary(Uri::KEPT);
                Ok(Uri { start: text[..end].to_owned(), length: text.len() as u64 })
            }
        }
        deserializer.deserialize_str(Text)
    }
}

impl Outline {
    /// The place of the variant of materials called `name`.
    pub fn variant(&self, name: &str) -> Option<usize> {
        self.extensions.variants.variants.iter().position(|variant| variant.name == name)
    }

    /// The root nodes of the scene that the user, else the file, asks for; `None` if there is no such scene.
    pub fn roots(&self, wanted: Option<&str>) -> Option<Vec<usize>> {
        let Some(scenes) = self.scenes.as_ref().filter(|scenes| !scenes.is_empty()) else {
            let mut has_parent = vec![false; self.nodes.len()];
            for child in self.nodes.iter().flat_map(|node| &node.children) {
                *has_parent.get_mut(*child)? = true;
            }
            return Some((0..self.nodes.len()).filter(|&i| !has_parent[i]).collect());
        };
        let by_name = |name: &str| scenes.iter().position(|scene| scene.name.as_deref() == Some(name));
        let index = match wanted {
            None => self.scene.unwrap_or(0),
            Some(wanted) => wanted.parse().ok().filter(|&i: &usize| i < scenes.len()).or_else(|| by_name(wanted))?,
        };
        Some(scenes.get(index)?.nodes.clone())
    }
}

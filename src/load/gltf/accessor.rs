//! Accessors: typed, bounded views of bytes. Component type, shape and normalisation are checked for each use
//! (the `gltf` crate reinterprets whatever it finds), and sizes before anything is allocated.

use super::Result;
use super::document::Document;
use gltf::json::Index;
use gltf::json::accessor::{Accessor, ComponentType, GenericComponentType, Type};
use gltf::json::validation::{Checked, USize64};

/// What an accessor must be to serve a purpose.
pub(super) struct Wanted {
    /// For messages: `POSITION`, ...
    pub name: &'static str,
    shape: Type,
    components: usize,
    /// Allowed component types, each with its normalisation.
    types: &'static [(ComponentType, bool)],
    /// In words, for messages.
    allowed: &'static str,
}

const FLOAT: &[(ComponentType, bool)] = &[(ComponentType::F32, false)];
/// Vertex positions.
pub(super) const POSITION: Wanted =
    Wanted { name: "POSITION", shape: Type::Vec3, components: 3, types: FLOAT, allowed: "VEC3 of float (5126)" };
/// Shading normals.
pub(super) const NORMAL: Wanted =
    Wanted { name: "NORMAL", shape: Type::Vec3, components: 3, types: FLOAT, allowed: "VEC3 of float (5126)" };
/// Tangents with handedness.
pub(super) const TANGENT: Wanted =
    Wanted { name: "TANGENT", shape: Type::Vec4, components: 4, types: FLOAT, allowed: "VEC4 of float (5126)" };
/// Texture coordinates.
pub(super) const TEXCOORD: Wanted = Wanted {
    name: "TEXCOORD_0",
    shape: Type::Vec2,
    components: 2,
    types: &[(ComponentType::F32, false), (ComponentType::U8, true), (ComponentType::U16, true)],
    allowed: "VEC2 of float (5126), or of normalized unsigned byte (5121) or short (5123)",
};
/// Vertex indices.
pub(super) const INDICES: Wanted = Wanted {
    name: "indices",
    shape: Type::Scalar,
    components: 1,
    types: &[(ComponentType::U8, false), (ComponentType::U16, false), (ComponentType::U32, false)],
    allowed: "SCALAR of unsigned byte (5121), short (5123) or int (5125), not normalized",
};

/// The elements of a checked accessor.
pub(super) struct Elements<'a> {
    /// How many.
    pub count: usize,
    bytes: &'a [u8],
    stride: usize,
    component: ComponentType,
}

/// Opens accessor `index`, which was found at `pointer`, for the purpose `wanted`.
pub(super) fn open<'d>(
    doc: &'d Document,
    index: Index<Accessor>,
    pointer: &str,
    wanted: &Wanted,
) -> Result<Elements<'d>> {
    let accessor = doc.item(&doc.root.accessors, index, pointer, "accessors")?;
    let at = format!("/accessors/{}", index.value());
    let component = check_type(doc, accessor, &at, wanted)?;
    if accessor.sparse.is_some() {
        let fix = "Export without sparse accessors.";
        return Err(doc.not_built(format!("{at}/sparse"), "sparse accessors are", fix));
    }
    let Some(view_index) = accessor.buffer_view else {
        let fix = "Compressed meshes (KHR_draco_mesh_compression) and accessors of zeros are not built yet.";
        return Err(doc.error(at, format!("{} without bufferView", wanted.name), fix));
    };
    let view_at = format!("{at}/bufferView");
    let (bytes, view) = doc.view(view_index, &view_at)?;

    let size = wanted.components * component.size();
    let stride = match view.byte_stride {
        None => size,
        Some(stride) => {
            let stride_at = format!("/bufferViews/{}/byteStride", view_index.value());
            let aligned = stride.0.is_multiple_of(component.size());
            let fixed = wanted.shape == Type::Scalar && stride.0 != size;
            if stride.0 < size || !aligned || fixed {
                let why = format!("does not fit {}, whose elements have {size} bytes", wanted.name);
                let fix = match wanted.shape {
                    Type::Scalar => "Views of indices have no byteStride.".to_owned(),
                    _ => format!("Allowed are multiples of {} from {size} on.", component.size()),
                };
                return Err(doc.bad(&stride_at, &why, fix));
            }
            stride.0
        }
    };
    let offset = accessor.byte_offset.unwrap_or(USize64(0)).0;
    let view_offset = view.byte_offset.unwrap_or(USize64(0)).0;
    // A buffer in memory is shorter than 2^63 bytes and `view` fits in it, so only `offset` can be absurd.
    if !offset.wrapping_add(view_offset).is_multiple_of(component.size() as u64) {
        let problem = format!("byteOffset {offset} + byteOffset {view_offset} of the view is misaligned");
        let fix = format!("It must be a multiple of the component size, {}.", component.size());
        return Err(doc.error(at, problem, fix));
    }
    let count = accessor.count.0;
    let needed = count
        .checked_sub(1)
        .map_or(Some(0), |last| last.checked_mul(stride as u64)?.checked_add(size as u64)?.checked_add(offset));
    let bytes = match needed {
        Some(needed) if needed <= bytes.len() as u64 => bytes.get(offset as usize..).unwrap_or_default(),
        _ => {
            let problem = format!(
                "count {count} x {stride} bytes from byteOffset {offset} is past the end of bufferView {}",
                view_index.value()
            );
            return Err(doc.error(at, problem, format!("The view has {} bytes.", bytes.len())));
        }
    };
    // The count fits usize: count <= bytes.len() (elements have a size), or it is 0.
    Ok(Elements { count: count as usize, bytes, stride, component })
}

/// The component type, if it, the shape and the normalisation are what is wanted.
fn check_type(doc: &Document, accessor: &Accessor, at: &str, wanted: &Wanted) -> Result<ComponentType> {
    let fix = format!("{} must be {}.", wanted.name, wanted.allowed);
    if accessor.type_ != Checked::Valid(wanted.shape) {
        return Err(doc.bad(&format!("{at}/type"), &format!("as {}", wanted.name), fix));
    }
    let component_at = format!("{at}/componentType");
    let Checked::Valid(GenericComponentType(component)) = accessor.component_type else {
        return Err(doc.bad(&component_at, "is not a component type", fix));
    };
    if wanted.types.contains(&(component, accessor.normalized)) {
        return Ok(component);
    }
    if wanted.types.iter().any(|&(c, _)| c == component) {
        return Err(doc.error(format!("{at}/normalized"), format!("{} as {}", accessor.normalized, wanted.name), fix));
    }
    let quantized = wanted.shape != Type::Scalar && component != ComponentType::U32;
    let hint = if quantized { " Quantized meshes (KHR_mesh_quantization) are not built yet." } else { "" };
    Err(doc.bad(&component_at, &format!("as {}", wanted.name), fix + hint))
}

impl<'a> Elements<'a> {
    /// The bytes of each element.
    fn each(&self) -> impl Iterator<Item = &'a [u8]> {
        let (bytes, stride) = (self.bytes, self.stride);
        (0..self.count).map(move |i| bytes.get(i * stride..).unwrap_or_default())
    }

    /// `[count][N]` floats.
    pub fn floats<const N: usize>(&self) -> Vec<[f32; N]> {
        self.each().map(|e| std::array::from_fn(|i| word(e, i).map_or(0.0, f32::from_le_bytes))).collect()
    }

    /// `[count][2]` floats; normalised integers become [0, 1].
    pub fn uvs(&self) -> Vec<[f32; 2]> {
        match self.component {
            ComponentType::U8 => self.each().map(|e| [0, 1].map(|i| f32::from(byte(e, i)) / 255.0)).collect(),
            ComponentType::U16 => self.each().map(|e| [0, 1].map(|i| f32::from(short(e, i)) / 65535.0)).collect(),
            _ => self.floats(),
        }
    }

    /// `[count]` unsigned integers.
    pub fn indices(&self) -> Vec<u32> {
        match self.component {
            ComponentType::U8 => self.each().map(|e| u32::from(byte(e, 0))).collect(),
            ComponentType::U16 => self.each().map(|e| u32::from(short(e, 0))).collect(),
            _ => self.each().map(|e| word(e, 0).map_or(0, u32::from_le_bytes)).collect(),
        }
    }
}

// Reads past the end cannot happen after `open`; they would give 0 rather than a panic.

fn word(element: &[u8], i: usize) -> Option<[u8; 4]> {
    element.get(4 * i..4 * i + 4)?.try_into().ok()
}

fn short(element: &[u8], i: usize) -> u16 {
    let at = |k| u16::from(byte(element, 2 * i + k));
    at(0) | at(1) << 8
}

fn byte(element: &[u8], i: usize) -> u8 {
    element.get(i).copied().unwrap_or(0)
}

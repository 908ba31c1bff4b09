//! What accessors must be to serve a purpose: shapes and component types per vertex attribute, of the core
//! specification (section 3.7.2.1) and of `KHR_mesh_quantization`.

use gltf::json::accessor::{ComponentType, Type};
use std::borrow::Cow;

/// How a component is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Kind {
    /// Its type.
    pub component: ComponentType,
    /// Whether integers mean [0, 1] or [-1, 1].
    pub normalized: bool,
}

/// What an accessor must be to serve a purpose.
pub(super) struct Wanted {
    /// For messages: `POSITION`, ...
    pub name: Cow<'static, str>,
    pub shapes: &'static [Type],
    /// Allowed by the core specification.
    pub core: &'static [Kind],
    /// Allowed besides if the file uses `KHR_mesh_quantization`.
    pub quantized: &'static [Kind],
    /// In words, for messages.
    pub allowed: Cow<'static, str>,
}

const fn kind(component: ComponentType, normalized: bool) -> Kind {
    Kind { component, normalized }
}

const F32: Kind = kind(ComponentType::F32, false);
const I8: Kind = kind(ComponentType::I8, false);
const I16: Kind = kind(ComponentType::I16, false);
const U8: Kind = kind(ComponentType::U8, false);
const U16: Kind = kind(ComponentType::U16, false);
const U32: Kind = kind(ComponentType::U32, false);
const I8N: Kind = kind(ComponentType::I8, true);
const I16N: Kind = kind(ComponentType::I16, true);
const U8N: Kind = kind(ComponentType::U8, true);
const U16N: Kind = kind(ComponentType::U16, true);

const fn wanted(
    name: &'static str,
    shapes: &'static [Type],
    core: &'static [Kind],
    quantized: &'static [Kind],
    allowed: &'static str,
) -> Wanted {
    Wanted { name: Cow::Borrowed(name), shapes, core, quantized, allowed: Cow::Borrowed(allowed) }
}

/// Vertex positions.
pub(super) const POSITION: Wanted =
    wanted("POSITION", &[Type::Vec3], &[F32], &[I8, I8N, U8, U8N, I16, I16N, U16, U16N], "VEC3 of float (5126)");
/// Shading normals.
pub(super) const NORMAL: Wanted = wanted("NORMAL", &[Type::Vec3], &[F32], &[I8N, I16N], "VEC3 of float (5126)");
/// Tangents with handedness.
pub(super) const TANGENT: Wanted = wanted("TANGENT", &[Type::Vec4], &[F32], &[I8N, I16N], "VEC4 of float (5126)");
/// Displacements of positions.
pub(super) const MORPH_POSITION: Wanted =
    wanted("POSITION", &[Type::Vec3], &[F32], &[I8, I8N, I16, I16N], "VEC3 of float (5126)");
/// Displacements of normals.
pub(super) const MORPH_NORMAL: Wanted = wanted("NORMAL", &[Type::Vec3], &[F32], &[I8N, I16N], "VEC3 of float (5126)");
/// Displacements of tangents, without handedness.
pub(super) const MORPH_TANGENT: Wanted = wanted("TANGENT", &[Type::Vec3], &[F32], &[I8N, I16N], "VEC3 of float (5126)");
/// Vertex indices.
pub(super) const INDICES: Wanted = wanted(
    "indices",
    &[Type::Scalar],
    &[U8, U16, U32],
    &[],
    "SCALAR of unsigned byte (5121), short (5123) or int (5125), not normalized",
);
/// The matrices of a skin.
pub(super) const INVERSE_BIND: Wanted =
    wanted("inverseBindMatrices", &[Type::Mat4], &[F32], &[], "MAT4 of float (5126)");
/// Places of instances.
pub(super) const TRANSLATION: Wanted = wanted("TRANSLATION", &[Type::Vec3], &[F32], &[], "VEC3 of float (5126)");
/// Sizes of instances.
pub(super) const SCALE: Wanted = wanted("SCALE", &[Type::Vec3], &[F32], &[], "VEC3 of float (5126)");
/// Quaternions of instances.
pub(super) const ROTATION: Wanted = wanted(
    "ROTATION",
    &[Type::Vec4],
    &[F32, I8N, I16N],
    &[],
    "VEC4 of float (5126), or of normalized byte (5120) or short (5122)",
);

/// Times of an animation's keys.
pub(super) const KEY_TIMES: Wanted = wanted("input", &[Type::Scalar], &[F32], &[], "SCALAR of float (5126)");

impl Wanted {
    /// Values of an animation, `width` numbers each: floats, where they may be also normalised integers; bytes for what is
    /// on or off.
    pub fn animated(width: usize, is_switch: bool, or_integers: bool) -> Self {
        let (shapes, shape): (&[Type], _) = match width {
            1 => (&[Type::Scalar], "SCALAR"),
            2 => (&[Type::Vec2], "VEC2"),
            3 => (&[Type::Vec3], "VEC3"),
            _ => (&[Type::Vec4], "VEC4"),
        };
        let (core, allowed): (&[Kind], _) = match (is_switch, or_integers) {
            (true, _) => (&[U8, F32], "SCALAR of unsigned byte (5121), 0 or 1".to_owned()),
            (_, true) => {
                (&[F32, I8N, U8N, I16N, U16N], format!("{shape} of float (5126), or of normalized bytes or shorts"))
            }
            _ => (&[F32], format!("{shape} of float (5126)")),
        };
        Self { name: "output".into(), shapes, core, quantized: &[], allowed: allowed.into() }
    }

    /// Set `set` of texture coordinates.
    pub fn tex_coord(set: u32) -> Self {
        Self {
            name: format!("TEXCOORD_{set}").into(),
            shapes: &[Type::Vec2],
            core: &[F32, U8N, U16N],
            quantized: &[I8, I8N, I16, I16N, U8, U16],
            allowed: "VEC2 of float (5126), or of normalized unsigned byte (5121) or short (5123)".into(),
        }
    }

    /// Vertex colours.
    pub fn color() -> Self {
        Self {
            name: "COLOR_0".into(),
            shapes: &[Type::Vec3, Type::Vec4],
            core: &[F32, U8N, U16N],
            quantized: &[],
            allowed: "VEC3 or VEC4 of float (5126), or of normalized unsigned byte (5121) or short (5123)".into(),
        }
    }

    /// Set `set` of the joints that move a vertex.
    pub fn joints(set: u32) -> Self {
        Self {
            name: format!("JOINTS_{set}").into(),
            shapes: &[Type::Vec4],
            core: &[U8, U16],
            quantized: &[],
            allowed: "VEC4 of unsigned byte (5121) or short (5123), not normalized".into(),
        }
    }

    /// Set `set` of the weights of joints.
    pub fn weights(set: u32) -> Self {
        Self {
            name: format!("WEIGHTS_{set}").into(),
            shapes: &[Type::Vec4],
            core: &[F32, U8N, U16N],
            quantized: &[],
            allowed: "VEC4 of float (5126), or of normalized unsigned byte (5121) or short (5123)".into(),
        }
    }
}

impl Kind {
    /// The first N components in `bytes`; 0 where there are no more.
    pub fn floats<const N: usize>(self, bytes: &[u8]) -> [f32; N] {
        let size = self.component.size();
        let mut each = bytes.chunks_exact(size).map(|c| self.float(c));
        std::array::from_fn(|_| each.next().unwrap_or(0.0))
    }

    /// One component. Normalised integers by the specification's equations (section 3.6.2.2; KHR_mesh_quantization has
    /// the same): `c / 255`, `max(c / 127, -1)`, ...
    fn float(self, c: &[u8]) -> f32 {
        let byte = c.first().copied().unwrap_or(0);
        let short = c.first_chunk().copied().unwrap_or_default();
        let (value, most) = match self.component {
            ComponentType::I8 => (f32::from(byte as i8), 127.0),
            ComponentType::U8 => (f32::from(byte), 255.0),
            ComponentType::I16 => (f32::from(i16::from_le_bytes(short)), 32767.0),
            ComponentType::U16 => (f32::from(u16::from_le_bytes(short)), 65535.0),
            ComponentType::U32 => return c.first_chunk().map_or(0, |w| u32::from_le_bytes(*w)) as f32,
            ComponentType::F32 => return c.first_chunk().map_or(0.0, |w| f32::from_le_bytes(*w)),
        };
        if self.normalized { (value / most).max(-1.0) } else { value }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normalized_integers_reach_both_ends_and_the_lowest_is_minus_one() {
        assert_eq!(I8N.floats([0x80, 0x81, 0, 0x7f].as_slice()), [-1.0, -1.0, 0.0, 1.0]);
        assert_eq!(I16N.floats([0x00, 0x80, 0x01, 0x80, 0xff, 0x7f].as_slice()), [-1.0, -1.0, 1.0]);
        assert_eq!(U8N.floats([0, 51, 255].as_slice()), [0.0, 0.2, 1.0]);
        assert_eq!(U16N.floats([0, 0, 0xff, 0xff].as_slice()), [0.0, 1.0]);
        assert_eq!(I16.floats([0x00, 0x80, 0xff, 0xff].as_slice()), [-32768.0, -1.0]);
    }
}

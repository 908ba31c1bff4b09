//! Frames of stretched highlights and normals of coats, on single triangles.

use super::super::interaction::interact;
use super::*;
use crate::accel::HitBatch;
use crate::light::table::LightTable;
use crate::material::Material;
use crate::material::media::MediumTable;
use crate::material::table::MaterialTable;
use crate::shape::exact::table::ShapeTable;
use crate::shape::placement::PlacementTable;
use crate::shape::table::{Corners, TriangleTable};
use crate::texture::lookup::TextureTable;
use crate::texture::{Filter, Image, Param, Texels, Texture, TextureRef, Wrap};
use glam::Vec3;
use simd::{Kernel, Level, dispatch};

const CORNERS: [Vec3; 3] = [Vec3::ZERO, Vec3::X, Vec3::Y];

/// A triangle in the plane z = 0 with its front towards +z, corner normals `normal`, tangent along x with its
/// handedness if it has one, and a material whose coat has a normal map of one texel if it has one.
struct Patch {
    normal: Vec3,
    tangent: Option<(Vec3, f32)>,
    coat_texel: Option<[u8; 4]>,
    /// From where the ray comes.
    eye: Vec3,
}

impl Patch {
    fn tables(&self) -> SceneTables {
        let image = Image {
            width: 1,
            height: 1,
            texels: Texels::Rgba8(vec![self.coat_texel.unwrap_or_default()]),
            name: String::new(),
        };
        let wrap = Wrap::Repeat;
        let texture = Texture { image: crate::id::ImageId(0), wrap_u: wrap, wrap_v: wrap, filter: Filter::Nearest };
        let mut textures = TextureTable::new(&[texture], &[image]).unwrap();
        let mut material = Material::default();
        material.clearcoat.factor = Param::constant(1.0);
        material.anisotropy.strength = Param::constant(1.0);
        material.clearcoat.normal.texture = self.coat_texel.map(|_| TextureRef::plain(crate::id::TextureId(0)));
        let materials = MaterialTable::new(&[material], &mut textures, crate::material::energy::Brdf::Full);
        let mut triangles = TriangleTable::default();
        let uvs = [[[0.0; 2], [1.0, 0.0], [0.0, 1.0]]];
        let corners = Corners { normals: Some([self.normal; 3]), uvs: &uvs, colors: None };
        let attributes = triangles.push_attributes(&corners);
        let tangents = match self.tangent {
            None => NONE,
            Some((t, w)) => triangles.push_tangents([[t.x, t.y, t.z, w]; 3]),
        };
        triangles.push(CORNERS, Vec3::Z, 0, attributes, tangents);
        let (placements, lights) = (PlacementTable::default(), LightTable::default());
        let (media, spectrum) = (MediumTable::new(&[]), None);
        SceneTables {
            triangles,
            placements,
            shapes: ShapeTable::default(),
            materials,
            media,
            spectrum,
            textures,
            lights,
        }
    }
}

/// x, y, z of the frame about `ns` (on the viewer's side) for `direction`, and the coat's normal.
struct Look<'a> {
    patch: &'a Patch,
    tables: &'a SceneTables,
    ns: Vec3,
    direction: [f32; 2],
}

impl Kernel for Look<'_> {
    type Output = [Vec3; 4];

    #[inline(always)]
    fn run<L: Lanes>(self) -> [Vec3; 4] {
        let mut hits = HitBatch::new(16);
        let target = Vec3::new(0.25, 0.25, 0.0);
        for i in 0..16 {
            (hits.u[i], hits.v[i]) = (0.25, 0.25);
        }
        let wo = V3::<L>::splat((self.patch.eye - target).normalize().into());
        let all = L::M::first(L::N);
        let si = interact::<L>(self.tables, &hits, 0, (wo, L::F::zero()), L::U::splat(0), all);
        let direction = [L::F::splat(self.direction[0]), L::F::splat(self.direction[1])];
        let frame = anisotropy_frame(self.tables, &si, V3::<L>::splat(self.ns.into()), direction, all);
        let coat = coat_normal(self.tables, &si, all);
        let get = |v: V3<L>| Vec3::new(v.x.first(), v.y.first(), v.z.first());
        [get(frame.x), get(frame.y), get(frame.z), get(coat)]
    }
}

fn look(patch: &Patch, ns: Vec3, direction: [f32; 2]) -> [Vec3; 4] {
    let tables = patch.tables();
    let seen = dispatch(Level::best(), Look { patch, tables: &tables, ns, direction });
    let scalar = dispatch(Level::Scalar, Look { patch, tables: &tables, ns, direction });
    assert!(seen.iter().zip(scalar).all(|(a, b)| (*a - b).length() < 1e-6), "{seen:?} {scalar:?}");
    let [x, y, z, coat] = seen;
    let parts = [x.dot(y), y.dot(z), z.dot(x), x.length() - 1.0, (x.cross(y) - z).length(), coat.length() - 1.0];
    assert!(parts.iter().all(|p| p.abs() < 1e-5), "orthonormal, right-handed: {seen:?}");
    seen
}

const ABOVE: Vec3 = Vec3::new(0.3, 0.2, 2.0);

fn flat(tangent: Option<(Vec3, f32)>) -> Patch {
    Patch { normal: Vec3::Z, tangent, coat_texel: None, eye: ABOVE }
}

#[test]
fn stretched_highlight_is_mirrored_where_the_coordinates_are() {
    // A direction of 30 degrees in the texture: on the mirrored half of a seam, u runs the other way and v as before.
    let (sin, cos) = 30_f32.to_radians().sin_cos();
    let [plain, ..] = look(&flat(Some((Vec3::X, 1.0))), Vec3::Z, [cos, sin]);
    let [mirrored, ..] = look(&flat(Some((-Vec3::X, -1.0))), Vec3::Z, [cos, sin]);
    assert!((plain - Vec3::new(cos, sin, 0.0)).length() < 1e-6, "{plain}");
    assert!((mirrored - Vec3::new(-cos, sin, 0.0)).length() < 1e-6, "{mirrored}");
    // From behind it is the same line on the surface.
    for (tangent, wanted) in [((Vec3::X, 1.0), plain), ((-Vec3::X, -1.0), mirrored)] {
        let behind = Patch { eye: -ABOVE, ..flat(Some(tangent)) };
        let [x, _, z, _] = look(&behind, -Vec3::Z, [cos, sin]);
        assert!((x - wanted).length() < 1e-6 && z == -Vec3::Z, "{x}");
    }
}

#[test]
fn stretched_highlight_lies_in_the_plane_of_the_shading_normal() {
    let ns = Vec3::new(0.6, 0.0, 0.8);
    let [x, y, z, _] = look(&flat(Some((Vec3::X, 1.0))), ns, [1.0, 0.0]);
    assert!((x - Vec3::new(0.8, 0.0, -0.6)).length() < 1e-6 && (y - Vec3::Y).length() < 1e-6, "{x} {y}");
    assert_eq!(z, ns);
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let [between, ..] = look(&flat(Some((Vec3::X, 1.0))), ns, [half, half]);
    assert!((between - (x + y) * half).length() < 1e-6, "angles are those of the plane: {between}");
}

#[test]
fn stretched_highlight_without_tangents_turns_in_a_frame_of_its_own() {
    for patch in [flat(None), flat(Some((Vec3::Z, 1.0)))] {
        let [x, y, ..] = look(&patch, Vec3::Z, [1.0, 0.0]);
        let [turned, ..] = look(&patch, Vec3::Z, [0.0, 1.0]);
        assert!((turned - y).length() < 1e-6 && x.dot(turned).abs() < 1e-6);
    }
}

#[test]
fn coat_has_the_vertex_normal_or_its_own_map_on_both_sides() {
    let leaning = Vec3::new(0.6, 0.0, 0.8);
    let plain = Patch { normal: leaning, ..flat(Some((Vec3::X, 1.0))) };
    assert!((look(&plain, Vec3::Z, [1.0, 0.0])[3] - leaning).length() < 1e-6);
    // Towards +y by 45 degrees: 0.7071 and 1.7071 of 2 in bytes.
    let mapped = |normal: Vec3, eye: Vec3| Patch {
        normal,
        coat_texel: Some([128, 218, 218, 255]),
        eye,
        tangent: Some((Vec3::X, 1.0)),
    };
    let tilted = look(&mapped(Vec3::Z, ABOVE), Vec3::Z, [1.0, 0.0])[3];
    assert!((tilted - Vec3::new(0.0, 0.5, 0.5).normalize()).length() < 0.01, "{tilted}");
    let behind = look(&mapped(Vec3::Z, -ABOVE), -Vec3::Z, [1.0, 0.0])[3];
    assert!((behind + tilted).length() < 1e-6, "the back has the opposite normal: {behind}");
    // A normal that leans beyond the horizon is raised like any other.
    let raised = look(&Patch { coat_texel: Some([255, 128, 100, 255]), ..plain }, Vec3::Z, [1.0, 0.0])[3];
    assert!(raised.z > 0.0, "{raised}");
}

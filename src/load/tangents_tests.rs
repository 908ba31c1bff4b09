//! The unit square and its degenerations.

use super::*;
use crate::scene::MaterialId;

fn square(uvs: [[f32; 2]; 4]) -> Mesh {
    Mesh {
        positions: vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]],
        normals: Some(vec![[0.0, 0.0, 1.0]; 4]),
        uv_sets: vec![uvs.to_vec()],
        colors: None,
        tangents: None,
        indices: vec![[0, 1, 2], [0, 2, 3]],
        material: MaterialId(0),
        name: "square".into(),
    }
}

/// v = 0 at the top.
const UPRIGHT: [[f32; 2]; 4] = [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]];

/// Unit, finite, across the normal, handedness +1 or -1.
#[track_caller]
fn assert_frames(mesh: &Mesh) {
    let (tangents, normals) = (mesh.tangents.as_ref().unwrap(), mesh.normals.as_ref().unwrap());
    assert_eq!(tangents.len(), mesh.positions.len());
    for (t, n) in tangents.iter().zip(normals) {
        let v = Vec3::new(t[0], t[1], t[2]);
        assert!((v.length() - 1.0).abs() < 1e-6 && t[3].abs() == 1.0, "{t:?}");
        let n = Vec3::from(*n).normalize_or_zero();
        assert!(v.dot(n).abs() < 1e-6, "{t:?} and {n}");
    }
}

#[test]
fn tangents_follow_u_and_the_bitangent_points_up_the_picture() {
    let mut mesh = square(UPRIGHT);
    generate(&mut mesh, 0, None).unwrap();
    assert_eq!(mesh.tangents.as_deref(), Some(&[[1.0, 0.0, 0.0, 1.0]; 4][..]));
    assert_eq!(mesh.indices, [[0, 1, 2], [0, 2, 3]]);
}

#[test]
fn mirrored_coordinates_have_the_other_handedness() {
    let mut mesh = square(UPRIGHT.map(|[u, v]| [1.0 - u, v]));
    generate(&mut mesh, 0, None).unwrap();
    assert_eq!(mesh.tangents.as_deref(), Some(&[[-1.0, 0.0, 0.0, -1.0]; 4][..]));
}

#[test]
fn transform_of_the_normal_map_turns_the_tangents() {
    let mut mesh = square(UPRIGHT);
    // u' = v, v' = -u: the map's u runs down the square.
    let transform = UvTransform { m: [[0.0, 1.0, 0.25], [-1.0, 0.0, 0.5]] };
    generate(&mut mesh, 0, Some(transform)).unwrap();
    assert_eq!(mesh.tangents.as_deref(), Some(&[[0.0, -1.0, 0.0, 1.0]; 4][..]));
    assert_eq!(mesh.uv_sets[0], UPRIGHT, "the coordinates themselves stay");
}

#[test]
fn vertices_are_split_only_where_handedness_changes() {
    // Two squares side by side, the second a mirror image of the first in u: they share the vertices 1 and 2.
    let mut mesh = square(UPRIGHT);
    mesh.positions.extend([[2.0, 0.0, 0.0], [2.0, 1.0, 0.0]]);
    mesh.normals.as_mut().unwrap().extend([[0.0, 0.0, 1.0]; 2]);
    mesh.uv_sets[0].extend([[0.0, 1.0], [0.0, 0.0]]);
    mesh.colors = Some((0..6).map(|i| [i as f32; 4]).collect());
    mesh.indices.extend([[1, 4, 5], [1, 5, 2]]);
    generate(&mut mesh, 0, None).unwrap();
    assert_frames(&mesh);
    assert_eq!(mesh.positions.len(), 8);
    for triangle in &mesh.indices[2..] {
        for &v in triangle {
            assert_eq!(mesh.tangents.as_ref().unwrap()[v as usize], [-1.0, 0.0, 0.0, -1.0]);
        }
    }
    let [_, v, _] = mesh.indices[0];
    assert_eq!((mesh.positions[v as usize], mesh.colors.as_ref().unwrap()[v as usize]), ([1.0, 0.0, 0.0], [1.0; 4]));
}

#[test]
fn mesh_without_normals_becomes_flat() {
    // A ridge: the two triangles lean to different sides.
    let mut mesh = square(UPRIGHT);
    mesh.normals = None;
    mesh.positions[1][2] = 1.0;
    generate(&mut mesh, 0, None).unwrap();
    assert_frames(&mesh);
    assert_eq!(mesh.positions.len(), 6);
    let normals = mesh.normals.as_ref().unwrap();
    assert_ne!(normals[mesh.indices[0][0] as usize], normals[mesh.indices[1][0] as usize]);
    // Coplanar triangles share their vertices again.
    let mut mesh = square(UPRIGHT);
    mesh.normals = None;
    generate(&mut mesh, 0, None).unwrap();
    assert_eq!(mesh.positions.len(), 4);
}

#[test]
fn coordinates_that_say_nothing_still_give_a_frame() {
    let point = [[0.5; 2]; 4];
    let line = [[0.0, 0.0], [1.0, 1.0], [2.0, 2.0], [3.0, 3.0]];
    let wild = [[0.0, f32::NAN], [f32::INFINITY, 1.0], [1.0, 0.0], [f32::MAX, 0.0]];
    for uvs in [point, line, wild] {
        let mut mesh = square(uvs);
        generate(&mut mesh, 0, None).unwrap();
        assert_frames(&mesh);
    }
    let mut none = square(UPRIGHT);
    generate(&mut none, 3, None).unwrap();
    assert_frames(&none);
}

#[test]
fn degenerate_positions_and_normals_still_give_a_frame() {
    let mut mesh = square(UPRIGHT);
    mesh.normals = Some(vec![[0.0; 3], [f32::NAN; 3], [0.0, 0.0, 5.0], [1.0, 0.0, 0.0]]);
    mesh.indices.extend([[0, 0, 1], [1, 1, 1], [0, 1, 0]]);
    mesh.positions[3] = [f32::INFINITY, 0.0, 0.0];
    generate(&mut mesh, 0, None).unwrap();
    let tangents = mesh.tangents.unwrap();
    assert!(tangents.iter().all(|t| (Vec3::new(t[0], t[1], t[2]).length() - 1.0).abs() < 1e-6), "{tangents:?}");
}

#[test]
fn tangents_of_the_file_are_repaired_only_where_they_cannot_serve() {
    let mut mesh = square(UPRIGHT);
    let kept = [0.6, 0.0, 0.1, -1.0];
    mesh.tangents = Some(vec![kept, [0.0, 0.0, 0.0, 1.0], [0.0, 0.0, 3.0, -1.0], [f32::NAN, 0.0, 0.0, f32::NAN]]);
    assert_eq!(repair(&mut mesh), 3);
    assert_eq!(mesh.tangents.as_ref().unwrap()[0], kept);
    mesh.tangents.as_mut().unwrap().remove(0);
    mesh.normals.as_mut().unwrap().remove(0);
    mesh.positions.remove(0);
    assert_frames(&mesh);
}

/// A disc of `n` triangles around vertex 0.
fn disc(n: u32) -> Mesh {
    let mut mesh = square(UPRIGHT);
    let turn = |i: u32| std::f32::consts::TAU * i as f32 / n as f32;
    mesh.positions = std::iter::once([0.0; 3]).chain((0..n).map(|i| [turn(i).cos(), turn(i).sin(), 0.0])).collect();
    mesh.uv_sets = vec![mesh.positions.iter().map(|p| [p[0], p[1]]).collect()];
    mesh.normals = Some(vec![[0.0, 0.0, 1.0]; n as usize + 1]);
    mesh.indices = (0..n).map(|i| [0, 1 + i, 1 + (i + 1) % n]).collect();
    mesh
}

#[test]
fn many_triangles_around_one_vertex_exhaust_neither_stack_nor_patience() {
    let mut mesh = disc(2_000);
    generate(&mut mesh, 0, None).unwrap();
    assert_frames(&mesh);
    assert_eq!(mesh.positions.len(), 2_001);
    let mut mesh = disc(20_000);
    assert!(matches!(generate(&mut mesh, 0, None), Err(TooManyTriangles(20_000))));
    assert_frames(&mesh);
}

//! What every scene must satisfy before it is prepared.

use super::{Scene, motion};
use crate::math::MAX_UV_SETS;
use crate::shape::Mesh;
use glam::{DMat3, DMat4, DVec3};
use rayon::prelude::*;
use std::sync::Arc;

/// Coordinates beyond this are dropped: Embree ignores such triangles without a word
/// (`rtcCommitScene`: "|value| > 1.844e18"), so both backends must.
pub(crate) const MAX_COORDINATE: f32 = 1.844e18;

/// Elements that one thread looks at before it asks for more.
const PIECE: usize = 1 << 14;

/// Names listed in a counted warning.
const NAMES_SHOWN: usize = 3;

/// What was wrong with one mesh.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Findings {
    /// Triangles with a vertex that cannot be used.
    unusable: usize,
    /// Triangles without area.
    flat: usize,
    uvs: usize,
    colors: usize,
}

impl Findings {
    /// Whether nothing had to be changed.
    pub(crate) fn is_clean(&self) -> bool {
        let Self { unusable, flat, uvs, colors } = *self;
        unusable + flat + uvs + colors == 0
    }
}

/// Checks ids, drops unusable triangles and instances, cleans attributes, with a counted warning for each kind.
///
/// # Panics
/// When an id, a vertex index or the length of an attribute is wrong: a bug of the loader.
///
/// Of the meshes that were checked before, `checked` has what was found; others have `None` there, or nothing.
pub(super) fn check(scene: &mut Scene, mut checked: Vec<Option<Findings>>) {
    checked.resize(scene.meshes.len(), None);
    check_ids(scene, &checked);
    motion::clean(scene);
    let moving: Vec<bool> = (0..scene.meshes.len()).map(|i| scene.motion.meshes.contains_key(&(i as u32))).collect();
    let check = |((mesh, checked), &moves): ((&mut Arc<Mesh>, Option<Findings>), &bool)| {
        checked.unwrap_or_else(|| check_form(Arc::make_mut(mesh), moves))
    };
    let found: Vec<Findings> = scene.meshes.par_iter_mut().zip(checked).zip(&moving).map(check).collect();
    type Count = fn(&Findings) -> usize;
    // What has no area would not be seen anyway; all else is lost.
    let kinds: [(Count, bool, &str); 4] = [
        (|f| f.unusable, true, "triangles dropped: a vertex is not finite or is beyond 1.844e18"),
        (|f| f.flat, false, "triangles dropped: without area"),
        (|f| f.uvs, true, "texture coordinates that are not finite: taken as 0"),
        (|f| f.colors, true, "vertex colours that are negative or not finite: those channels taken as 0 or 1"),
    ];
    for (count, is_loss, what) in kinds {
        let mut tally = Tally::default();
        scene.meshes.iter().zip(&found).for_each(|(mesh, f)| tally.add(count(f), &mesh.name));
        if let Some(text) = tally.text(what) {
            scene.losses.extend(is_loss.then(|| text.clone()));
            scene.warnings.push(text);
        }
    }
    drop_instances(scene);
    drop_shapes(scene);
    clean_environment(scene);
}

/// Texels that are no radiance become black, with a counted warning.
fn clean_environment(scene: &mut Scene) {
    let Some(environment) = &mut scene.environment else { return };
    let size = environment.width as usize * environment.height as usize;
    assert!(size > 0 && environment.radiance.len() == size, "an environment has width x height texels");
    let bad = |texel: &&[f32; 3]| !texel.iter().all(|c| c.is_finite() && *c >= 0.0);
    let count = environment.radiance.iter().filter(bad).count();
    if count > 0 {
        environment.radiance = environment.radiance.iter().map(|t| if bad(&t) { [0.0; 3] } else { *t }).collect();
        let text = format!("{count} texels of the environment are negative or not finite: taken as black");
        scene.losses.push(text.clone());
        scene.warnings.push(text);
    }
}

/// Drops unusable triangles and cleans attributes.
pub(crate) fn check_mesh(mesh: &mut Mesh) -> Findings {
    check_form(mesh, false)
}

/// What `moves` may have an area later.
fn check_form(mesh: &mut Mesh, moves: bool) -> Findings {
    let [unusable, flat] = drop_triangles(mesh, !moves);
    Findings { unusable, flat, uvs: clean_uvs(mesh), colors: clean_colors(mesh) }
}

/// Drops instances whose transform squashes everything to a line or a point, so that no triangle has an area: a scale
/// of 0 is how some files hide things, and their place must not count in the scene's bounds. What is squashed to a
/// plane stays: triangles in that plane can be seen, and `render::prepare` drops the others one by one.
fn drop_instances(scene: &mut Scene) {
    let mut squashed = Tally::default();
    let has_area = |world_from_object: &DMat4| {
        let m = DMat3::from_mat4(*world_from_object);
        let [x, y, z] = [m.x_axis, m.y_axis, m.z_axis];
        [x.cross(y), y.cross(z), z.cross(x)].iter().any(|c| *c != DVec3::ZERO)
    };
    let mut later = std::mem::take(&mut scene.motion.instances);
    let (mut old, mut new) = (0, 0);
    scene.instances.retain(|instance| {
        let keys = later.remove(&old);
        old += 1;
        // What is nothing now may be something before the shutter closes.
        let stays = has_area(&instance.world_from_object) || keys.iter().flatten().any(has_area);
        squashed.add(usize::from(!stays), &instance.name);
        if stays {
            scene.motion.instances.extend(keys.map(|keys| (new, keys)));
            new += 1;
        }
        stays
    });
    scene.warnings.extend(squashed.text("instances dropped: their scale squashes them to a line or a point"));
}

/// A shape squashed flatter than this, of its largest extent, has no inverse that f64 could be trusted with.
const FLATTEST: f64 = 1e-9;

/// Drops exact shapes that are squashed flat, which have no inside any more, and those that are out of every backend's
/// range. What moves is judged where it starts.
fn drop_shapes(scene: &mut Scene) {
    if scene.shapes.is_empty() {
        return;
    }
    let (mut flat, mut far) = (Tally::default(), Tally::default());
    let mut kept = Vec::with_capacity(scene.shapes.len());
    for shape in &scene.shapes {
        let map = shape.world_from_object * shape.shape.object_from_unit();
        let linear = DMat3::from_mat4(map);
        let largest = [linear.x_axis, linear.y_axis, linear.z_axis].map(|c| c.length()).into_iter().fold(0.0, f64::max);
        // Written so that NaN is refused.
        let has_inside = (linear * (1.0 / largest)).determinant().abs() > FLATTEST.powi(2);
        let (low, high) = shape.shape.bounds(&map);
        let fits = low.abs().max(high.abs()).max_element() <= f64::from(MAX_COORDINATE) && largest > LEAST_SIZE;
        flat.add(usize::from(!has_inside), &shape.name);
        far.add(usize::from(has_inside && !fits), &shape.name);
        kept.push(has_inside && fits);
    }
    if kept.iter().any(|kept| !kept) {
        let mut keeps = kept.iter();
        scene.shapes.retain(|_| *keeps.next().expect("one for each shape"));
        let mut number = 0..;
        let numbers: Vec<Option<u32>> = kept.iter().map(|kept| kept.then(|| number.next().unwrap_or(0))).collect();
        let moving = std::mem::take(&mut scene.motion.shapes);
        let renumbered = moving.into_iter().filter_map(|(i, keys)| Some((numbers[i as usize]?, keys)));
        scene.motion.shapes = renumbered.collect();
    }
    scene.warnings.extend(flat.text("exact shapes dropped: their scale squashes them flat"));
    if let Some(text) = far.text("exact shapes dropped: beyond 1.844e18 m, or smaller than 1e-30 m") {
        scene.losses.push(text.clone());
        scene.warnings.push(text);
    }
}

/// Shapes of a smaller unit are dropped, metres.
const LEAST_SIZE: f64 = 1e-30;

fn check_ids(scene: &Scene, checked: &[Option<Findings>]) {
    for shape in &scene.shapes {
        scene.materials.get(shape.material.index()).expect("a shape's material was added to the builder");
        assert!(shape.world_from_object.is_finite(), "world transforms are finite");
    }
    for instance in &scene.instances {
        scene.meshes.get(instance.mesh.index()).expect("an instance's mesh was added to the builder");
        assert!(instance.world_from_object.is_finite(), "world transforms are finite");
    }
    for (mesh, checked) in scene.meshes.iter().zip(checked) {
        scene.materials.get(mesh.material.index()).expect("a mesh's material was added to the builder");
        if checked.is_some() {
            continue;
        }
        let n = mesh.positions.len();
        assert!(mesh.normals.as_ref().is_none_or(|a| a.len() == n), "one normal per vertex");
        assert!(mesh.uv_sets.iter().all(|a| a.len() == n), "one texture coordinate per vertex");
        assert!(mesh.uv_sets.len() <= MAX_UV_SETS, "few sets of texture coordinates");
        assert!(mesh.colors.as_ref().is_none_or(|a| a.len() == n), "one colour per vertex");
        assert!(mesh.tangents.as_ref().is_none_or(|a| a.len() == n), "one tangent per vertex");
        let in_range = |piece: &[[u32; 3]]| piece.as_flattened().iter().all(|&i| (i as usize) < n);
        assert!(mesh.indices.par_chunks(PIECE).all(in_range), "vertex indices are in range");
    }
    for (mesh, poses) in &scene.motion.meshes {
        let n = scene.meshes.get(*mesh as usize).expect("what moves was added to the builder").positions.len();
        assert!(poses.iter().all(|pose| pose.positions.len() == n), "one position per vertex at each time");
    }
    for m in &scene.materials {
        for read in m.textures() {
            scene.textures.get(read.texture.index()).expect("a material's texture was added to the builder");
            assert!((read.uv_set as usize) < MAX_UV_SETS, "few sets of texture coordinates");
        }
    }
    for texture in &scene.textures {
        let image = scene.images.get(texture.image.index()).expect("a texture's image was added to the builder");
        let size = image.width as usize * image.height as usize;
        assert!(size > 0 && image.texels.len() == size, "an image has width x height texels");
    }
}

/// How many triangles of `mesh` were dropped: for an unusable vertex and, if `flat` ones go, for want of area.
fn drop_triangles(mesh: &mut Mesh, flat: bool) -> [usize; 2] {
    let positions = &mesh.positions;
    let judge = |triangle: &[u32; 3]| {
        let corners = triangle.map(|i| positions[i as usize]);
        if !corners.iter().all(usable) { [1, 0] } else { [0, usize::from(flat && is_flat(corners))] }
    };
    // First counted, in parallel: nearly always there is nothing to drop.
    let count = |piece: &[[u32; 3]]| piece.iter().map(judge).fold([0, 0], sum);
    let dropped = mesh.indices.par_chunks(PIECE).map(count).reduce(|| [0, 0], sum);
    if dropped != [0, 0] {
        mesh.indices.retain(|triangle| judge(triangle) == [0, 0]);
    }
    // Vertices that nothing uses any more must not spoil bounds: `positions` are finite from here on.
    if !mesh.positions.par_chunks(PIECE).all(|piece| piece.iter().all(usable)) {
        let stand_in = mesh.positions.iter().find(|p| usable(p)).copied().unwrap_or([0.0; 3]);
        mesh.positions.iter_mut().filter(|p| !usable(p)).for_each(|p| *p = stand_in);
    }
    dropped
}

fn usable(p: &[f32; 3]) -> bool {
    p.iter().all(|c| c.abs() <= MAX_COORDINATE)
}

fn sum(a: [usize; 2], b: [usize; 2]) -> [usize; 2] {
    [a[0] + b[0], a[1] + b[1]]
}

/// Whether the area is exactly 0. In f64, where the cross product of f32 edges neither underflows nor, for corners
/// of like exponents, rounds (f32 would lose every edge below 3.3e-10).
fn is_flat(corners: [[f32; 3]; 3]) -> bool {
    let [a, b, c] = corners.map(|p| DVec3::from_array(p.map(f64::from)));
    (b - a).cross(c - a) == DVec3::ZERO
}

/// How many texture coordinates were not finite; they become 0.
fn clean_uvs(mesh: &mut Mesh) -> usize {
    let bad = |uv: &&mut [f32; 2]| !uv.iter().all(|c| c.is_finite());
    mesh.uv_sets.iter_mut().flatten().filter(bad).map(|uv| *uv = [0.0; 2]).count()
}

/// How many vertex colours had channels that cannot be used; those above 1 can.
fn clean_colors(mesh: &mut Mesh) -> usize {
    let clean = |c: f32| if c.is_finite() { c.max(0.0) } else { 1.0 };
    let bad = |color: &&mut [f32; 4]| !color.iter().all(|c| c.is_finite() && *c >= 0.0);
    mesh.colors.iter_mut().flatten().filter(bad).map(|color| *color = color.map(clean)).count()
}

/// A count over meshes, with the names of the first few.
#[derive(Default)]
struct Tally {
    count: usize,
    names: Vec<String>,
    more: usize,
}

impl Tally {
    fn add(&mut self, count: usize, name: &str) {
        self.count += count;
        if count == 0 || self.names.iter().any(|n| n == name) {
            return;
        }
        match self.names.len() < NAMES_SHOWN {
            true => self.names.push(name.to_owned()),
            false => self.more += 1,
        }
    }

    fn text(self, what: &str) -> Option<String> {
        let more = if self.more > 0 { format!(" and {} more", self.more) } else { String::new() };
        (self.count > 0).then(|| format!("{} {what} (in {}{more})", self.count, self.names.join(", ")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::Material;
    use crate::scene::{Instance, MaterialId, MeshId};

    fn scene(positions: Vec<[f32; 3]>, indices: Vec<[u32; 3]>) -> Scene {
        let mesh = Mesh::plain("m", positions, indices, MaterialId(0));
        Scene { meshes: vec![Arc::new(mesh)], materials: vec![Material::default()], ..Scene::default() }
    }

    #[test]
    fn triangles_with_unusable_vertices_are_dropped_and_counted() {
        let bad = [f32::NAN, f32::INFINITY, -1.9e18, f32::MAX];
        let mut positions = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        positions.extend(bad.map(|b| [0.0, b, 0.0]));
        let mut scene = scene(positions, vec![[0, 1, 2], [0, 1, 3], [4, 1, 0], [0, 5, 1], [0, 1, 6]]);
        check(&mut scene, Vec::new());
        assert_eq!(scene.meshes[0].indices, [[0, 1, 2]]);
        assert!(scene.meshes[0].positions.iter().flatten().all(|c| c.abs() <= 1.0));
        assert_eq!(scene.warnings.len(), 1);
        assert!(scene.warnings[0].starts_with("4 triangles dropped: a vertex"), "{:?}", scene.warnings);
    }

    #[test]
    fn triangles_without_area_are_dropped_but_tiny_ones_stay() {
        let e = 1e-30;
        let positions = vec![[0.0; 3], [e, 0.0, 0.0], [0.0, e, 0.0], [2.0 * e, 0.0, 0.0], [0.0; 3]];
        let indices = vec![[0, 1, 2], [0, 1, 3], [0, 0, 1], [0, 4, 1], [1, 1, 1]];
        let mut scene = scene(positions, indices);
        check(&mut scene, Vec::new());
        assert_eq!(scene.meshes[0].indices, [[0, 1, 2]]);
        assert!(scene.warnings[0].starts_with("4 triangles dropped: without area"), "{:?}", scene.warnings);
    }

    #[test]
    fn non_finite_uvs_become_zero() {
        let mut scene = scene(vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], vec![[0, 1, 2]]);
        Arc::make_mut(&mut scene.meshes[0]).uv_sets = vec![vec![[0.5, f32::NAN], [1.0, 2.0], [f32::INFINITY, 0.0]]];
        check(&mut scene, Vec::new());
        assert_eq!(scene.meshes[0].uv_sets, [[[0.0, 0.0], [1.0, 2.0], [0.0, 0.0]]]);
        assert!(scene.warnings[0].starts_with("2 texture coordinates"), "{:?}", scene.warnings);
    }

    #[test]
    fn texels_that_are_no_radiance_become_black() {
        let radiance = vec![[1.0; 3], [-1.0, 2.0, 3.0], [f32::NAN; 3], [f32::INFINITY, 0.0, 0.0]];
        let environment = Some(crate::light::Environment::new(2, 2, radiance));
        let mut scene = Scene { environment, ..Scene::default() };
        check(&mut scene, Vec::new());
        assert_eq!(scene.environment.unwrap().radiance[..], [[1.0; 3], [0.0; 3], [0.0; 3], [0.0; 3]]);
        assert!(scene.warnings[0].starts_with("3 texels of the environment"), "{:?}", scene.warnings);
    }

    #[test]
    fn vertex_colors_above_one_stay_and_unusable_ones_are_cleaned() {
        let mut scene = scene(vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], vec![[0, 1, 2]]);
        Arc::make_mut(&mut scene.meshes[0]).colors =
            Some(vec![[2.0, 0.5, 0.0, 1.0], [-1.0, f32::NAN, 0.5, 1.0], [f32::INFINITY; 4]]);
        check(&mut scene, Vec::new());
        let cleaned = vec![[2.0, 0.5, 0.0, 1.0], [0.0, 1.0, 0.5, 1.0], [1.0; 4]];
        assert_eq!(scene.meshes[0].colors, Some(cleaned));
        assert!(scene.warnings[0].starts_with("2 vertex colours"), "{:?}", scene.warnings);
    }

    #[test]
    fn instances_squashed_to_a_line_go_and_those_squashed_to_a_plane_stay() {
        let mut scene = scene(vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], vec![[0, 1, 2]]);
        for scale in [[1.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [-1.0, 1.0, 1e-6]] {
            let world_from_object = DMat4::from_scale(DVec3::from_array(scale));
            scene.instances.push(Instance { mesh: MeshId(0), world_from_object, name: format!("{scale:?}") });
        }
        check(&mut scene, Vec::new());
        let kept: Vec<_> = scene.instances.iter().map(|i| i.name.as_str()).collect();
        assert_eq!(kept, ["[1.0, 1.0, 0.0]", "[-1.0, 1.0, 1e-6]"]);
        assert!(scene.warnings[0].starts_with("2 instances dropped"), "{:?}", scene.warnings);
    }

    #[test]
    fn normals_are_left_to_the_renderer() {
        let mut scene = scene(vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], vec![[0, 1, 2]]);
        Arc::make_mut(&mut scene.meshes[0]).normals = Some(vec![[0.0; 3], [f32::NAN; 3], [0.0, 0.0, 1.0]]);
        check(&mut scene, Vec::new());
        assert!(scene.warnings.is_empty());
        assert_eq!(scene.triangle_count(), 0);
        assert_eq!(scene.meshes[0].indices.len(), 1);
    }

    // No input can cause it, so it is a panic that names the invariant, not a load error.
    #[test]
    #[should_panic(expected = "material was added")]
    fn unknown_material_id_is_a_loader_bug() {
        let mut scene = scene(vec![], vec![]);
        scene.materials.clear();
        check(&mut scene, Vec::new());
    }
}

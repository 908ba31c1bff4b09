//! What shading reads of a glTF file's material, through the tables and at every level of lanes.

use prt::material::media::{LINES, MediumTable};
use prt::material::table::MaterialTable;
use prt::math::UvSets;
use prt::scene::Scene;
use prt::texture::lookup::TextureTable;
use simd::{Float, Kernel, Lanes, Level, Mask, Uint, dispatch};

/// What shading reads of a material, in lane 0.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Values {
    pub has_extras: bool,
    pub base: [f32; 3],
    pub f0: [f32; 3],
    pub metallic: f32,
    pub roughness: f32,
    pub coat: [f32; 2],
    /// Of the coat, tangent space.
    pub coat_normal: Option<[f32; 3]>,
    pub sheen: [f32; 4],
    /// Strength and direction.
    pub anisotropy: [f32; 3],
    /// Factor, index, thickness.
    pub iridescence: [f32; 3],
    /// Factor, index.
    pub transmission: [f32; 2],
    pub is_volume: bool,
    pub diffuse_transmission: [f32; 4],
    pub disney: Option<[f32; 8]>,
}

/// Reads materials, one a lane from the first on, the last one in the lanes behind.
#[derive(Clone)]
pub struct Probe<'a> {
    pub table: &'a MaterialTable,
    pub textures: &'a TextureTable,
    pub materials: &'a [u32],
}

impl Kernel for Probe<'_> {
    type Output = Vec<Values>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Vec<Values> {
        let mut ids = [self.materials[self.materials.len() - 1]; 16];
        ids[..self.materials.len()].copy_from_slice(self.materials);
        let material = L::U::load(&ids, 0);
        let all = L::M::first(L::N);
        let half = L::F::splat(0.5);
        let mut uvs = UvSets::<L>::single(L::F::splat(0.25), half);
        uvs.set(1, L::F::splat(0.75), half);
        let s = self.table.rich_surface::<L>(self.textures, material, &uvs, all);
        let (coat_normal, has_coat_normal) = self.table.clearcoat_normal_map::<L>(self.textures, material, &uvs, all);
        let mut lanes = Vec::new();
        for i in 0..L::N.min(self.materials.len()) {
            let get = |v: L::F| {
                let mut out = [0.0; 16];
                v.store(&mut out, 0);
                out[i]
            };
            let is = |m: L::M| m.bits() >> i & 1 == 1;
            let mut values = Values {
                base: [get(s.base.x), get(s.base.y), get(s.base.z)],
                f0: [get(s.f0.x), get(s.f0.y), get(s.f0.z)],
                metallic: get(s.metallic),
                roughness: get(s.roughness),
                coat_normal: is(has_coat_normal).then(|| [get(coat_normal.x), get(coat_normal.y), get(coat_normal.z)]),
                ..Values::default()
            };
            if let Some(e) = &s.extras {
                values.has_extras = true;
                values.coat = [get(e.clearcoat), get(e.clearcoat_roughness)];
                values.sheen = [get(e.sheen.x), get(e.sheen.y), get(e.sheen.z), get(e.sheen_roughness)];
                values.anisotropy = [get(e.anisotropy), get(e.anisotropy_direction[0]), get(e.anisotropy_direction[1])];
                values.iridescence = [get(e.iridescence), get(e.iridescence_ior), get(e.iridescence_thickness)];
                values.transmission = [get(e.transmission), get(s.ior)];
                values.is_volume = is(e.is_volume);
                let c = &e.diffuse_transmission_color;
                values.diffuse_transmission = [get(e.diffuse_transmission), get(c.x), get(c.y), get(c.z)];
                values.disney = e.disney.as_ref().filter(|_| is(e.is_disney)).map(|d| {
                    [
                        get(d.subsurface),
                        get(d.specular),
                        get(d.specular_tint),
                        get(d.anisotropic),
                        get(d.sheen),
                        get(d.sheen_tint),
                        get(d.clearcoat),
                        get(d.clearcoat_gloss),
                    ]
                });
            }
            lanes.push(values);
        }
        lanes
    }
}

/// What is left after a metre inside of the first material, per colour, the index there, and those of the lines F and C.
pub struct Inside<'a>(pub &'a MediumTable);

impl Kernel for Inside<'_> {
    type Output = [f32; 6];

    #[inline(always)]
    fn run<L: Lanes>(self) -> [f32; 6] {
        let inside = MediumTable::inside::<L>(L::U::splat(0));
        let left = self.0.transmittance::<L>(inside, L::F::one());
        let [f, _, c] = LINES.map(|line| self.0.ior_at::<L>(inside, L::F::splat(line as f32)));
        [left.x, left.y, left.z, self.0.ior::<L>(inside), f, c].map(|v| v.first())
    }
}

pub fn tables(scene: &Scene) -> (MaterialTable, TextureTable) {
    let mut textures = TextureTable::new(&scene.textures, &scene.images).unwrap();
    (MaterialTable::new(&scene.materials, &mut textures, prt::render::Brdf::Full), textures)
}

/// What shading reads of the square's material; the same at every level.
pub fn read(scene: &Scene) -> Values {
    let (table, textures) = tables(scene);
    let materials = [scene.meshes[0].material.0];
    let probe = Probe { table: &table, textures: &textures, materials: &materials };
    let values = dispatch(Level::Scalar, probe.clone()).remove(0);
    for level in [Level::Avx2, Level::Avx512].into_iter().filter(|level| level.is_available()) {
        assert!(dispatch(level, probe.clone()).remove(0).is_near(&values), "{level:?}");
    }
    values
}

impl Values {
    pub fn is_near(&self, other: &Self) -> bool {
        let flat = |v: &Self| {
            let mut all: Vec<f32> = [v.base, v.f0, v.anisotropy, v.iridescence].concat();
            all.extend([v.metallic, v.roughness].into_iter().chain(v.coat).chain(v.sheen).chain(v.transmission));
            all.extend(v.coat_normal.iter().flatten().chain(&v.diffuse_transmission));
            all
        };
        let (a, b) = (flat(self), flat(other));
        a.len() == b.len() && a.iter().zip(&b).all(|(a, b)| (a - b).abs() <= 1e-5 * a.abs().max(1e-2))
    }
}

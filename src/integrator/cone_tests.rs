use super::*;
use crate::accel::HitBatch;
use crate::camera::{Camera, CameraRays, Lens, Projection};
use crate::integrator::interaction::interact;
use crate::light::table::LightTable;
use crate::material::Material;
use crate::material::media::MediumTable;
use crate::material::table::MaterialTable;
use crate::math::V3;
use crate::math::lanes::tests::at_all_levels;
use crate::shape::exact::table::ShapeTable;
use crate::shape::placement::PlacementTable;
use crate::shape::table::{Corners, TriangleTable};
use crate::texture::lookup::TextureTable;
use glam::{DMat4, DVec3, Vec3};
use simd::{Buffer, Kernel};

/// A right triangle in the plane z = 0 with legs of 2 m; two sets of coordinates, with legs of 3 and 0.5, and of 1 and 4.
fn tables() -> SceneTables {
    let mut textures = TextureTable::default();
    let materials = MaterialTable::new(&[Material::default()], &mut textures, crate::material::energy::Brdf::Full);
    let mut triangles = TriangleTable::default();
    let uvs = [[[0.1, 0.1], [3.1, 0.1], [0.1, 0.6]], [[0.0, 0.0], [0.0, 1.0], [4.0, 0.0]]];
    let attributes = triangles.push_attributes(&Corners { normals: None, uvs: &uvs, colors: Some([[1.0; 4]; 3]) });
    triangles.push([Vec3::ZERO, 2.0 * Vec3::X, 2.0 * Vec3::Y], Vec3::Z, 0, attributes, NONE);
    let lights = LightTable::new(Vec::new(), None, 1.0, &mut triangles);
    SceneTables {
        triangles,
        placements: PlacementTable::with_capacity(0),
        shapes: ShapeTable::default(),
        materials,
        media: MediumTable::new(&[Material::default()]),
        spectrum: None,
        textures,
        lights,
    }
}

#[test]
fn footprints_are_those_of_a_plane_that_faces_the_cone_and_of_a_tilted_one() {
    #[derive(Clone)]
    struct Check;
    impl Kernel for Check {
        type Output = ();

        #[inline(always)]
        fn run<L: Lanes>(self) {
            let tables = tables();
            let mut hits = HitBatch::new(16);
            let mut pool = PathPool::new();
            (pool.cone_width, pool.cone_spread) = (Buffer::new(16), Buffer::new(16));
            for i in 0..16 {
                (hits.u[i], hits.v[i]) = (0.25, 0.25);
                (pool.cone_width[i], pool.cone_spread[i]) = (0.02, 0.001);
            }
            let all = L::M::first(L::N);
            for degrees in [0.0_f64, 60.0, 85.0, 120.0] {
                let (sin, cos) = degrees.to_radians().sin_cos();
                let wo = V3::<L>::splat([sin as f32, 0.0, cos as f32]);
                let si = interact::<L>(&tables, &hits, 0, (wo, L::F::zero()), L::U::splat(0), all);
                let cone = Cone::<L>::load(&pool, 0, L::F::splat(30.0));
                let found = cone.footprints(&tables, &si, all);
                // 0.02 m + 30 m x 0.001, over the cosine; areas 1.5 and 4 on 4 m^2, all of them doubled.
                let width = 0.05 / cos.abs();
                for (found, area) in found.iter().zip([1.5, 4.0]) {
                    let wanted = width * width * area / 4.0;
                    let found = f64::from(found.first());
                    assert!((found / wanted - 1.0).abs() < 1e-5, "{degrees}: {found} for {wanted}");
                }
            }
        }
    }
    at_all_levels(Check);
}

#[test]
fn mirrors_keep_the_spread_and_lobes_widen_it() {
    #[derive(Clone)]
    struct Check;
    impl Kernel for Check {
        type Output = ();

        #[inline(always)]
        fn run<L: Lanes>(self) {
            let after = |pdf: f32| scattered::<L>(L::F::splat(0.125), L::F::splat(pdf)).first();
            assert_eq!(after(f32::INFINITY), 0.125);
            // A lobe of 100 per steradian: a quarter of a tenth.
            assert!((after(100.0) - 0.15).abs() < 1e-6);
            assert!((after(std::f32::consts::FRAC_1_PI) - 0.125 - 0.443).abs() < 1e-3);
            assert_eq!((after(1e-6), after(0.0)), (0.625, 0.625));
        }
    }
    at_all_levels(Check);
}

#[test]
fn cones_go_on_with_the_paths_that_live() {
    #[derive(Clone)]
    struct Check;
    impl Kernel for Check {
        type Output = ();

        #[inline(always)]
        fn run<L: Lanes>(self) {
            let mut pool = PathPool::new();
            (pool.cone_width, pool.cone_spread) = (Buffer::new(64), Buffer::new(64));
            for i in 0..16 {
                (pool.cone_width[i], pool.cone_spread[i]) = (i as f32, 0.5);
            }
            let cone = Cone::<L>::load(&pool, 0, L::F::splat(2.0));
            let (straight, all) = (L::M::from_bits(0x5555), L::M::first(L::N));
            cone.follow(&mut pool, 20, L::F::splat(1.0), straight, all);
            for i in 0..L::N {
                assert_eq!(pool.cone_width[20 + i], i as f32 + 1.0);
                assert_eq!(pool.cone_spread[20 + i], if i % 2 == 0 { 0.5 } else { 0.75 });
            }
        }
    }
    at_all_levels(Check);
}

#[test]
fn camera_cones_have_the_solid_angle_of_their_pixel() {
    struct Cones(CameraRays, [f32; 2]);
    impl Kernel for Cones {
        type Output = [f64; 2];

        #[inline(always)]
        fn run<L: Lanes>(self) -> [f64; 2] {
            let (_, direction) =
                self.0.ray::<L>(L::F::splat(self.1[0]), L::F::splat(self.1[1]), [L::F::zero(); 2], L::F::zero());
            let (width, spread) = self.0.cone::<L>(direction);
            [width, spread].map(|v| f64::from(v.first()))
        }
    }
    let of = |projection, pixel| {
        let camera =
            Camera { name: String::new(), world_from_camera: DMat4::IDENTITY, projection, lens: Lens::default() };
        simd::dispatch(simd::Level::best(), Cones(CameraRays::new(&camera, &[], 200, 100, DVec3::ZERO, None), pixel))
    };
    let yfov = 1.2_f64;
    let perspective = Projection::Perspective { yfov, aspect_ratio: None };
    for pixel in [[100.0_f32, 50.0], [199.5, 0.5], [30.5, 80.5]] {
        // The solid angle of a small square on the plane at distance 1: area x cos / distance^2.
        let side = 2.0 * (0.5 * yfov).tan() / 100.0;
        let (x, y) = ((f64::from(pixel[0]) - 100.0) * side, (f64::from(pixel[1]) - 50.0) * side);
        let wanted = side * (1.0 + x * x + y * y).powf(-0.75);
        let [width, spread] = of(perspective, pixel);
        assert!(width == 0.0 && (spread / wanted - 1.0).abs() < 1e-5, "{pixel:?}: {spread} for {wanted}");
    }
    let [width, spread] = of(Projection::Orthographic { xmag: 9.0, ymag: 3.0 }, [10.0, 10.0]);
    assert!((width - 0.06).abs() < 1e-8 && spread == 0.0, "{width} {spread}");
}

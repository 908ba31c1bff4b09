use super::*;
use crate::camera::{Camera, CameraRays, Lens, Projection};
use crate::math::lanes::tests::at_all_levels;
use glam::{DMat4, DVec3};
use simd::Kernel;

fn thin(radius: f64, focus_distance: f64, blades: u32) -> ThinLens {
    ThinLens { radius, focus_distance, blades, f_stop: 2.0, focal_length: 4.0 * radius }
}

/// Points of the unit aperture for a grid of `side` x `side` cells.
struct Points(u32, usize);

impl Kernel for Points {
    type Output = Vec<[f64; 2]>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Vec<[f64; 2]> {
        let aperture = Aperture::new(&thin(1.0, 1.0, self.0), [1.0; 2]);
        let unit = |i: usize| L::F::splat((i as f32 + 0.5) / self.1 as f32);
        let cells = (0..self.1).flat_map(|i| (0..self.1).map(move |j| (i, j)));
        let point = |(i, j)| aperture.point::<L>([unit(i), unit(j)]).map(|c| f64::from(c.first()));
        cells.map(point).collect()
    }
}

#[test]
fn apertures_are_filled_evenly_to_their_edges() {
    for blades in [0, 3, 5, 6] {
        let points = simd::dispatch(simd::Level::best(), Points(blades, 400));
        // Where the edge is in direction `angle` from the top, clockwise.
        let edge = |angle: f64| {
            if blades == 0 {
                return 1.0;
            }
            let wedge = std::f64::consts::TAU / f64::from(blades);
            (0.5 * wedge).cos() / (angle.rem_euclid(wedge) - 0.5 * wedge).cos()
        };
        let polar = |[x, y]: [f64; 2]| (x.atan2(y), x.hypot(y));
        // The share within half of the way to the edge, and the second moments: those of the area.
        let inner = points.iter().filter(|p| polar(**p).1 < 0.5 * edge(polar(**p).0)).count();
        let share = inner as f64 / points.len() as f64;
        assert!((share - 0.25).abs() < 0.003, "{blades} blades: {share} within half of the way");
        assert!(points.iter().all(|p| polar(*p).1 <= edge(polar(*p).0) + 1e-5), "{blades} blades: beyond the edge");
        let moment = |f: fn(&[f64; 2]) -> f64| points.iter().map(f).sum::<f64>() / points.len() as f64;
        let wanted = match blades {
            0 => 0.25,
            n => {
                let c = (std::f64::consts::PI / f64::from(n)).cos();
                // Of a triangle from the middle to a side: (r^2 / 12) (1 + 2 cos^2), cos being that of half its angle.
                (1.0 + 2.0 * c * c) / 12.0
            }
        };
        let (xx, yy, xy) = (moment(|p| p[0] * p[0]), moment(|p| p[1] * p[1]), moment(|p| p[0] * p[1]));
        assert!(
            (xx - wanted).abs() < 2e-3 && (yy - wanted).abs() < 2e-3 && xy.abs() < 2e-3,
            "{blades}: {xx} {yy} {xy}"
        );
        if blades > 0 {
            let top = points.iter().map(|p| p[1]).fold(0.0, f64::max);
            assert!(top > 0.99, "{blades} blades: no corner at the top, but {top}");
        }
    }
}

#[test]
fn the_middle_of_the_square_is_the_middle_of_the_disc() {
    struct Check;
    impl Kernel for Check {
        type Output = ();

        #[inline(always)]
        fn run<L: Lanes>(self) {
            let half = L::F::splat(0.5);
            let [x, y] = in_disc::<L>([half, half]);
            assert_eq!([x.first(), y.first()], [0.0, 0.0]);
        }
    }
    impl Clone for Check {
        fn clone(&self) -> Self {
            Self
        }
    }
    at_all_levels(Check);
}

/// Origin and direction through a film point and a place on the lens.
struct Ray(CameraRays, [f32; 2], [f32; 2]);

impl Kernel for Ray {
    type Output = [[f32; 3]; 2];

    #[inline(always)]
    fn run<L: Lanes>(self) -> [[f32; 3]; 2] {
        let [x, y, u, v] = [self.1[0], self.1[1], self.2[0], self.2[1]].map(L::F::splat);
        let (o, d) = self.0.ray::<L>(x, y, [u, v], L::F::zero());
        [o, d].map(|v| [v.x.first(), v.y.first(), v.z.first()])
    }
}

fn ray(lens: Option<&ThinLens>, film: [f32; 2], u: [f32; 2]) -> [glam::DVec3; 2] {
    let world_from_camera = DMat4::from_rotation_translation(
        glam::DQuat::from_rotation_y(0.6) * glam::DQuat::from_rotation_x(-0.3),
        DVec3::new(4.0, 3.0, -2.0),
    );
    let projection = Projection::Perspective { yfov: 0.9, aspect_ratio: None };
    let camera = Camera { name: String::new(), world_from_camera, projection, lens: Lens::default() };
    let rays = CameraRays::new(&camera, &[], 60, 40, DVec3::ZERO, lens);
    simd::dispatch(simd::Level::best(), Ray(rays, film, u)).map(|v| glam::Vec3::from(v).as_dvec3())
}

const PLACES: [[f32; 2]; 5] = [[0.5, 0.5], [0.0, 0.0], [0.9, 0.3], [0.1, 0.8], [0.5, 0.999]];

/// LENS-01: distances are along the axis: all rays of a film point meet where the pinhole's ray crosses the plane.
#[test]
fn lens01_rays_of_a_film_point_meet_in_the_plane_of_focus() {
    for focus in [1e-3, 0.7, 3.0, 400.0] {
        for film in [[30.0, 20.0], [0.5, 0.5], [59.5, 39.5], [7.0, 33.0]] {
            let [eye, straight] = ray(None, film, PLACES[0]);
            let axis = ray(None, [30.0, 20.0], PLACES[0])[1];
            let target = eye + straight * (focus / straight.dot(axis));
            for blades in [0, 6] {
                for u in PLACES {
                    let lens = thin(0.2, focus, blades);
                    let [o, d] = ray(Some(&lens), film, u);
                    assert!((d.length() - 1.0).abs() < 1e-6);
                    assert!((o - eye).dot(axis).abs() < 1e-6 && (o - eye).length() < 0.2 + 1e-6, "on the lens");
                    let t = focus / d.dot(axis);
                    let off = (o + d * t - target).length();
                    assert!(off < 3e-6 * (1.0 + focus), "{focus} {film:?} {u:?}: {off} m from the focus");
                }
            }
        }
    }
}

/// LENS-01.
#[test]
fn lens01_focus_at_infinity_keeps_the_pinholes_direction_exactly() {
    let lens = thin(0.2, f64::INFINITY, 0);
    for film in [[30.0, 20.0], [0.5, 0.5], [59.5, 39.5]] {
        for u in PLACES {
            assert_eq!(ray(Some(&lens), film, u)[1], ray(None, film, u)[1]);
        }
        assert_ne!(ray(Some(&lens), film, PLACES[1])[0], ray(None, film, PLACES[1])[0]);
    }
}

#[test]
fn the_top_of_a_pentagon_is_up_in_the_picture() {
    // The corner at the top is where the first triangle begins.
    let lens = thin(0.5, 2.0, 5);
    let [top, _] = ray(Some(&lens), [30.0, 20.0], [0.199_999, 0.0]);
    let [eye, low] = ray(None, [30.0, 39.0], PLACES[0]);
    let axis = ray(None, [30.0, 20.0], PLACES[0])[1];
    let down = (low - axis * low.dot(axis)).normalize();
    assert!(((top - eye) - down * -0.5).length() < 1e-4, "{}", top - eye);
}

//! What is said of a camera's lens, and the thin lens that it makes.

use super::Projection;

/// What a file or an option says of a lens; `None` where it says nothing. Without a finite `f_stop` the camera is a
/// pinhole, whatever the rest says.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Lens {
    /// Focal length over the diameter of the aperture, in [`Lens::F_STOPS`]; infinite: a pinhole.
    pub f_stop: Option<f64>,
    /// Metres along the axis to the plane that is sharp, in [`Lens::DISTANCES`]; may be infinite.
    pub focus_distance: Option<f64>,
    /// Corners of the aperture, in [`Lens::BLADES`]; 0: round.
    pub blades: Option<u32>,
    /// The longer side of the image on the sensor, mm, in [`Lens::SENSORS`].
    pub sensor: Option<f64>,
}

/// A thin lens (Kolb, Mitchell and Hanrahan 1995, section 2): what is in the plane of focus is sharp.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThinLens {
    /// Radius of the aperture, metres, > 0; of a polygon that of the circle on which its corners lie.
    pub radius: f64,
    /// Metres along the axis to the plane of focus, > 0; may be infinite.
    pub focus_distance: f64,
    /// Corners of the aperture; 0: round.
    pub blades: u32,
    /// What the radius was made of.
    pub f_stop: f64,
    /// Metres: `(h/2) / tan(yfov/2)`, h being the height of the image on the sensor.
    pub focal_length: f64,
}

impl Lens {
    /// The longer side of a sensor of which nothing is said, mm: that of 35 mm film, and Blender's.
    pub const DEFAULT_SENSOR: f64 = 36.0;
    /// Allowed f-numbers, least and most, beside infinity.
    pub const F_STOPS: [f64; 2] = [1e-6, 1e6];
    /// Allowed distances, least and most, beside infinity: metres whose squares stay numbers in 32 bits.
    pub const DISTANCES: [f64; 2] = [1e-6, 1e18];
    /// Allowed numbers of corners, beside 0.
    pub const BLADES: [u32; 2] = [3, 64];
    /// Allowed sensors, mm.
    pub const SENSORS: [f64; 2] = [1e-3, 1e6];

    /// What `self` says, else what `other` says.
    pub fn or(self, other: Self) -> Self {
        Self {
            f_stop: self.f_stop.or(other.f_stop),
            focus_distance: self.focus_distance.or(other.focus_distance),
            blades: self.blades.or(other.blades),
            sensor: self.sensor.or(other.sensor),
        }
    }

    /// Whether it is said to have an aperture: a picture through it has depth of field.
    pub fn is_open(&self) -> bool {
        self.f_stop.is_some_and(|f_stop| f_stop != f64::INFINITY)
    }

    /// The focal length and the f-number for a picture of `aspect` (width over height); `None` for a pinhole.
    ///
    /// # Errors
    /// There is no such lens; the text says what is wrong, with the value, and what is allowed.
    fn optics(&self, projection: &Projection, aspect: f64) -> Result<Option<(f64, f64)>, String> {
        let Some(f_stop) = self.f_stop.filter(|_| self.is_open()) else { return Ok(None) };
        let Projection::Perspective { yfov, .. } = *projection else {
            return Err(format!(
                "the f-number {f_stop} is of no use to an orthographic camera, which has no lens\n  \
                 Allowed: a perspective camera, or no f-number."
            ));
        };
        let sensor = self.sensor.unwrap_or(Self::DEFAULT_SENSOR);
        for (what, value, [least, most]) in [("f-number", f_stop, Self::F_STOPS), ("sensor", sensor, Self::SENSORS)] {
            if !(least..=most).contains(&value) {
                return Err(format!("the {what} {value} is out of range\n  Allowed: from {least} to {most}."));
            }
        }
        let height = 1e-3 * sensor / aspect.max(1.0);
        Ok(Some((0.5 * height / (0.5 * yfov).tan(), f_stop)))
    }

    /// The thin lens of a camera for a picture of `aspect` (width over height); `None` for a pinhole. Where no focus
    /// distance is said, it is asked for.
    ///
    /// # Errors
    /// As `optics`.
    pub fn thin(
        &self,
        projection: &Projection,
        aspect: f64,
        focus: impl FnOnce() -> f64,
    ) -> Result<Option<ThinLens>, String> {
        let Some((focal_length, f_stop)) = self.optics(projection, aspect)? else { return Ok(None) };
        let focus_distance = self.focus_distance.unwrap_or_else(focus);
        let [least, most] = Self::DISTANCES;
        if !((least..=most).contains(&focus_distance) || focus_distance == f64::INFINITY) {
            return Err(format!(
                "the focus distance {focus_distance} is out of range\n  Allowed: metres from {least} to {most:e}, or inf."
            ));
        }
        let blades = self.blades.unwrap_or(0);
        let [fewest, many] = Self::BLADES;
        if blades != 0 && !(fewest..=many).contains(&blades) {
            return Err(format!(
                "{blades} aperture blades make no aperture\n  Allowed: from {fewest} to {many}, or 0."
            ));
        }
        let radius = focal_length / (2.0 * f_stop);
        Ok(Some(ThinLens { radius, focus_distance, blades, f_stop, focal_length }))
    }
}

impl ThinLens {
    /// Radius of the blur of a point at `distance` metres along the axis, in units of what is seen at distance 1: `radius
    /// |1/focus - 1/distance|`.
    pub fn blur(&self, distance: f64) -> f64 {
        self.radius * (1.0 / self.focus_distance - 1.0 / distance).abs()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WIDE: Projection = Projection::Perspective { yfov: 0.5, aspect_ratio: None };

    fn lens(f_stop: f64) -> Lens {
        Lens { f_stop: Some(f_stop), ..Lens::default() }
    }

    #[test]
    fn the_sensor_is_the_longer_side_of_the_image() {
        let of = |aspect: f64| lens(2.0).thin(&WIDE, aspect, || 1.0).unwrap().unwrap();
        let half = (0.25_f64).tan();
        // 36 x 18 mm, and 18 x 36 mm.
        assert!((of(2.0).focal_length - 0.009 / half).abs() < 1e-15);
        assert!((of(0.5).focal_length - 0.018 / half).abs() < 1e-15);
        assert_eq!(of(2.0).radius, of(2.0).focal_length / 4.0);
        let small = Lens { sensor: Some(4.0), ..lens(2.0) }.thin(&WIDE, 1.0, || 1.0).unwrap().unwrap();
        assert!((small.focal_length - 0.002 / half).abs() < 1e-15);
    }

    #[test]
    fn without_an_aperture_it_is_a_pinhole_and_nobody_is_asked_for_the_focus() {
        let closed = Lens { focus_distance: Some(3.0), blades: Some(5), sensor: Some(24.0), f_stop: None };
        for lens in [closed, lens(f64::INFINITY), Lens::default()] {
            assert!(!lens.is_open());
            assert_eq!(lens.thin(&WIDE, 1.0, || panic!("asked")), Ok(None));
            assert_eq!(
                lens.thin(&Projection::Orthographic { xmag: 1.0, ymag: 1.0 }, 1.0, || panic!("asked")),
                Ok(None)
            );
        }
    }

    #[test]
    fn what_is_said_first_counts() {
        let both = Lens { blades: Some(6), ..lens(2.0) }.or(Lens { sensor: Some(24.0), ..lens(8.0) });
        assert_eq!(both, Lens { f_stop: Some(2.0), focus_distance: None, blades: Some(6), sensor: Some(24.0) });
    }

    #[test]
    fn lens01_what_makes_no_lens_is_refused_with_its_value() {
        let focused = |focus_distance| Lens { focus_distance: Some(focus_distance), ..lens(2.0) };
        for (bad, says) in [
            (lens(0.0), "the f-number 0 is"),
            (lens(-2.8), "-2.8"),
            (lens(f64::NAN), "NaN"),
            (focused(0.0), "the focus distance 0 is"),
            (focused(-1.0), "-1"),
            (focused(f64::NAN), "NaN"),
            (Lens { blades: Some(2), ..focused(1.0) }, "2 aperture blades"),
            (Lens { sensor: Some(0.0), ..focused(1.0) }, "the sensor 0"),
        ] {
            let error = bad.thin(&WIDE, 1.0, || 0.0).unwrap_err();
            assert!(error.contains(says) && error.contains("Allowed"), "{bad:?}: {error}");
        }
        let flat = lens(2.8).thin(&Projection::Orthographic { xmag: 1.0, ymag: 1.0 }, 1.0, || 1.0).unwrap_err();
        assert!(flat.contains("2.8") && flat.contains("orthographic"), "{flat}");
        for fine in [1e-6, 1e18, f64::INFINITY] {
            assert_eq!(focused(fine).thin(&WIDE, 1.0, || 0.0).unwrap().unwrap().focus_distance, fine);
        }
    }
}

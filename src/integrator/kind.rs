//! What is computed of a scene.

/// What a picture shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Integrator {
    /// All light: paths of any length.
    #[default]
    Path,
    /// Emitted and direct light, also seen in perfect mirrors and through clear glass. With no scattering after the first
    /// that is what [`Self::Path`] shows with none, sample by sample.
    Direct,
    /// After Whitted 1980, "An Improved Illumination Model for Shaded Display": emitted and direct light, also in perfect
    /// mirrors and through clear glass, all branches of which are followed. The same at every sample of a point of the
    /// film.
    Whitted,
    /// The share of the hemisphere about the shading normal that is open, weighed by the cosine: grey, in [0, 1].
    Ao,
    /// The unit shading normal on the viewer's side, world axes, as the colour `0.5 + 0.5 n`.
    Normal,
    /// The base colour, with textures and vertex colours: of dielectrics and metals what they reflect, of glass what it
    /// lets through, of unlit surfaces what they show.
    Albedo,
}

impl Integrator {
    /// The options' values.
    pub const NAMES: [(&str, Self); 6] = [
        ("path", Self::Path),
        ("direct", Self::Direct),
        ("whitted", Self::Whitted),
        ("ao", Self::Ao),
        ("normal", Self::Normal),
        ("albedo", Self::Albedo),
    ];

    /// What a branch of Whitted's tracer must be worth of its path to be followed: what is left out of a picture is less
    /// than an eighth of a step of its PNG, a branch.
    pub const LEAST_BRANCH: f32 = 1.0 / 2048.0;

    /// The option's value.
    pub fn name(self) -> &'static str {
        Self::NAMES.iter().find(|(_, own)| *own == self).expect("every integrator has a name").0
    }
}

//! The Disney BRDF of 2012, asked for by `prt_disney` in a material's extras. Blender writes custom properties as extras,
//! so they are flat keys.

use super::Reader;
use super::object::Object;
use crate::load::gltf::Result;
use crate::load::gltf::locate::shorten;
use crate::material::extensions::Disney;
use serde_json::Value;

const SWITCH: &str = "prt_disney";
const KEYS: [&str; 8] = [
    "prt_subsurface",
    "prt_specular",
    "prt_specular_tint",
    "prt_anisotropic",
    "prt_sheen",
    "prt_sheen_tint",
    "prt_clearcoat",
    "prt_clearcoat_gloss",
];

impl Reader<'_, '_> {
    /// The parameters, if the extras ask for that model.
    pub(super) fn disney(&mut self, found: &gltf::json::Material) -> Result<Option<Disney>> {
        let Some(extras) = found.extras.as_ref().filter(|raw| raw.get().contains("prt_")) else { return Ok(None) };
        // Extras may be anything at all; what is no object has no keys.
        let Ok(Value::Object(members)) = serde_json::from_str(extras.get()) else { return Ok(None) };
        let object = Object::new(&members, "extras".into());
        if !self.is_asked_for(&object)? {
            for key in KEYS.into_iter().filter(|key| members.contains_key(*key)) {
                self.skip(&object.place(key), "the material has no prt_disney = 1");
            }
            return Ok(None);
        }
        for key in members.keys().filter(|key| key.starts_with("prt_") && *key != SWITCH) {
            if !KEYS.contains(&key.as_str()) {
                let place = format!("{}/extras/{}", self.at, shorten(key));
                let text = format!("{place}: no such parameter of prt_disney: ignored. Allowed: {}", KEYS.join(", "));
                self.loader.builder.warn(text);
            }
        }
        let d = Disney::default();
        let absent = [
            d.subsurface,
            d.specular,
            d.specular_tint,
            d.anisotropic,
            d.sheen,
            d.sheen_tint,
            d.clearcoat,
            d.clearcoat_gloss,
        ];
        let mut values = absent;
        for (value, key) in values.iter_mut().zip(KEYS) {
            *value = self.share(&object, key, *value)?;
        }
        let [subsurface, specular, specular_tint, anisotropic, sheen, sheen_tint, clearcoat, clearcoat_gloss] = values;
        Ok(Some(Disney {
            subsurface,
            specular,
            specular_tint,
            anisotropic,
            sheen,
            sheen_tint,
            clearcoat,
            clearcoat_gloss,
        }))
    }

    /// `prt_disney`: 1 or true, 0 or false.
    fn is_asked_for(&self, object: &Object) -> Result<bool> {
        let value = object.members.get(SWITCH);
        match value.map(|v| v.as_bool().map_or_else(|| v.as_f64(), |b| Some(f64::from(u8::from(b))))) {
            None => Ok(false),
            Some(Some(1.0)) => Ok(true),
            Some(Some(0.0)) => Ok(false),
            Some(_) => {
                Err(self.bad(&object.place(SWITCH), "is neither on nor off", "Allowed: 1, or 0 (as without it)."))
            }
        }
    }
}

//! MTL files as written: a list of materials with their numbers and maps. A line that cannot be understood is a warning
//! with its place and costs that line only.

use super::map::{self, Map};
use super::statement::show;
use super::text::{Line, Places, Text, Words, name_of, number};
use std::collections::HashSet;

/// A material as written; `None` = not said.
#[derive(Clone, Debug, Default)]
pub(super) struct Written {
    pub name: String,
    /// File and line of its `newmtl`, for messages.
    pub at: String,
    pub kd: Option<[f32; 3]>,
    pub ks: Option<[f32; 3]>,
    pub ke: Option<[f32; 3]>,
    /// Phong's exponent.
    pub ns: Option<f32>,
    /// Index of refraction.
    pub ni: Option<f32>,
    /// Opacity.
    pub d: Option<f32>,
    /// Transparency.
    pub tr: Option<f32>,
    pub illum: Option<f32>,
    /// Roughness.
    pub pr: Option<f32>,
    /// Metalness.
    pub pm: Option<f32>,
    pub maps: Maps,
    /// Statements that have no counterpart here, as written.
    pub ignored: Vec<String>,
}

/// The maps of a material.
#[derive(Clone, Debug, Default)]
pub(super) struct Maps {
    pub kd: Option<Map>,
    pub ks: Option<Map>,
    pub ke: Option<Map>,
    pub ns: Option<Map>,
    pub d: Option<Map>,
    pub pr: Option<Map>,
    pub pm: Option<Map>,
    pub bump: Option<Map>,
    pub norm: Option<Map>,
}

impl Maps {
    /// Those that are there.
    pub fn all(&self) -> impl Iterator<Item = &Map> {
        [&self.kd, &self.ks, &self.ke, &self.ns, &self.d, &self.pr, &self.pm, &self.bump, &self.norm]
            .into_iter()
            .flatten()
    }
}

/// The materials of a file, and what was wrong.
pub(super) fn read(text: &Text) -> (Vec<Written>, Vec<String>) {
    let (materials, warnings, names) = (Vec::new(), Vec::new(), HashSet::new());
    let mut reader = Reader { text, places: Places::default(), line: String::new(), materials, warnings, names };
    for line in text.lines() {
        reader.line(&line);
    }
    (reader.materials, reader.warnings)
}

/// Lines of one file that are told one by one; files that are no MTL at all would fill the log.
const MOST_WARNINGS: usize = 50;

struct Reader<'t> {
    text: &'t Text,
    places: Places,
    /// File and place of the statement's key.
    line: String,
    /// Of the materials.
    names: HashSet<String>,
    materials: Vec<Written>,
    warnings: Vec<String>,
}

impl Reader<'_> {
    /// Warns of the current statement.
    fn warn(&mut self, what: impl std::fmt::Display) {
        match self.warnings.len() {
            n if n < MOST_WARNINGS => self.warnings.push(format!("{}: {what}", self.line)),
            MOST_WARNINGS => self.warnings.push(format!("{}: more like these", self.line)),
            _ => {}
        }
    }

    fn line(&mut self, line: &Line) {
        let mut words = line.words();
        let Some(key) = words.next() else { return };
        if key.starts_with(b"#") {
            return;
        }
        let key = name_of(key);
        self.line = self.places.at(self.text, words.start).to_string();
        if key.eq_ignore_ascii_case("newmtl") {
            let name = name_of(words.rest());
            if name.is_empty() {
                self.warn("newmtl without a name");
            } else if !self.names.insert(name.clone()) {
                self.warn(format!("\"{name}\" is there twice: the first is used"));
            }
            self.materials.push(Written { name, at: self.line.clone(), ..Written::default() });
            return;
        }
        let Some(mut material) = self.materials.pop() else {
            return self.warn(format!("{key} before the first newmtl: ignored"));
        };
        self.statement(&mut material, &key, &mut words);
        self.materials.push(material);
    }

    fn statement(&mut self, m: &mut Written, key: &str, words: &mut Words) {
        // Writers do not agree on upper and lower case.
        match key.to_ascii_lowercase().as_str() {
            "kd" => set(&mut m.kd, self.color(key, words)),
            "ks" => set(&mut m.ks, self.color(key, words)),
            "ke" => set(&mut m.ke, self.color(key, words)),
            "ns" => set(&mut m.ns, self.number(key, words)),
            "ni" => set(&mut m.ni, self.number(key, words)),
            "d" => set(&mut m.d, self.dissolve(words)),
            "tr" => set(&mut m.tr, self.number(key, words)),
            "illum" => set(&mut m.illum, self.number(key, words)),
            "pr" => set(&mut m.pr, self.number(key, words)),
            "pm" => set(&mut m.pm, self.number(key, words)),
            "map_kd" => set(&mut m.maps.kd, self.map(key, words)),
            "map_ks" => set(&mut m.maps.ks, self.map(key, words)),
            "map_ke" => set(&mut m.maps.ke, self.map(key, words)),
            "map_ns" => set(&mut m.maps.ns, self.map(key, words)),
            "map_d" | "map_opacity" => set(&mut m.maps.d, self.map(key, words)),
            "map_pr" => set(&mut m.maps.pr, self.map(key, words)),
            "map_pm" => set(&mut m.maps.pm, self.map(key, words)),
            "bump" | "map_bump" => set(&mut m.maps.bump, self.map(key, words)),
            "norm" | "map_norm" | "map_kn" => set(&mut m.maps.norm, self.map(key, words)),
            // Ambient light has no meaning where light is traced; anti-aliasing and sharpness are the renderer's.
            "ka" | "map_ka" | "map_aat" | "sharpness" | "km" | "nf" => {}
            // Without effect at their defaults, which exporters like to write out.
            "ps" | "pc" | "pcr" | "aniso" | "anisor"
                if words.clone().all(|w| number(w).is_some_and(|n| n.0 == 0.0)) => {}
            "tf" if words.clone().all(|w| number(w).is_some_and(|n| n.0 == 1.0)) => {}
            "ps" | "pc" | "pcr" | "aniso" | "anisor" | "tf" | "kt" | "map_ps" | "map_pc" | "map_pcr" | "map_tr"
            | "map_tf" | "disp" | "map_disp" | "decal" | "refl" | "map_refl" => m.ignored.push(key.to_owned()),
            _ => self.warn(format!("\"{}\" is no statement of MTL: ignored", show(key.as_bytes()))),
        }
    }

    /// Three numbers; one counts for all three.
    fn color(&mut self, key: &str, words: &mut Words) -> Option<[f32; 3]> {
        let mut values = Vec::new();
        for word in words.by_ref().take_while(|w| !w.starts_with(b"#")).take(3) {
            match number(word) {
                Some((value, _)) if value.is_finite() => values.push(value),
                _ => {
                    self.warn(format!("{key} {}: not a number; this line is ignored", show(word)));
                    return None;
                }
            }
        }
        match values[..] {
            [r, g, b] => Some([r, g, b]),
            [one] => {
                self.warn(format!("{key} {one}: one number where three are usual; it counts for all three"));
                Some([one; 3])
            }
            _ => {
                self.warn(format!("{key} has {} numbers where three are needed; this line is ignored", values.len()));
                None
            }
        }
    }

    fn number(&mut self, key: &str, words: &mut Words) -> Option<f32> {
        let word = words.next().unwrap_or_default();
        let value = number(word).map(|n| n.0).filter(|n| n.is_finite());
        if value.is_none() {
            self.warn(format!("{key} \"{}\": not a number; this line is ignored", show(word)));
        }
        value
    }

    /// `d [-halo] N`.
    fn dissolve(&mut self, words: &mut Words) -> Option<f32> {
        let mut ahead = words.clone();
        if ahead.next() == Some(b"-halo") {
            self.warn("d -halo: the halo is ignored, the number is used");
            *words = ahead;
        }
        self.number("d", words)
    }

    fn map(&mut self, key: &str, words: &mut Words) -> Option<Map> {
        let (map, problems) = map::read(words, self.line.clone());
        for problem in problems {
            self.warn(format!("{key}: {problem}"));
        }
        if map.is_none() {
            self.warn(format!("{key} without a file name; this line is ignored"));
        }
        map
    }
}

/// A line that is understood replaces what was said before.
fn set<T>(place: &mut Option<T>, value: Option<T>) {
    if value.is_some() {
        *place = value;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    fn parse(text: &str) -> (Vec<Written>, Vec<String>) {
        read(&Text::new(Path::new("m.mtl"), text.as_bytes().to_vec()))
    }

    #[test]
    fn bad_lines_cost_themselves_only_and_name_their_place() {
        let (materials, warnings) = parse(
            "Kd 1 1 1\nnewmtl a\nKd spectral f.rfl\nKd 0.5\nKs 1 2\nillum x\nmap_Kd\nd -halo 0.5\nNs\nwhat 1\n\
             newmtl b\nKd 0.1 0.2 0.3 # dark\n",
        );
        assert_eq!(materials.len(), 2);
        assert_eq!((materials[0].kd, materials[0].ks, materials[0].d), (Some([0.5; 3]), None, Some(0.5)));
        assert!(materials[0].maps.kd.is_none() && materials[0].illum.is_none() && materials[0].ns.is_none());
        assert_eq!(materials[1].kd, Some([0.1, 0.2, 0.3]));
        for place in ["1:1", "3:1", "4:1", "5:1", "6:1", "7:1", "8:1", "9:1", "10:1"] {
            let found = warnings.iter().filter(|w| w.starts_with(&format!("m.mtl: {place}: "))).count();
            assert_eq!(found, 1, "{place}: {warnings:?}");
        }
        assert_eq!(warnings.len(), 9);
    }

    #[test]
    fn names_keep_their_blanks_and_bytes() {
        let text = Text::new(Path::new("m.mtl"), b"  newmtl  red wall \r\nKd 1 0 0\r\nnewmtl caf\xE9\r\n".to_vec());
        let (materials, warnings) = read(&text);
        assert_eq!((materials[0].name.as_str(), materials[1].name.as_str()), ("red wall", "caf\u{e9}"));
        assert!(warnings.is_empty(), "{warnings:?}");
    }
}

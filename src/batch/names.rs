//! Names of outputs: templates such as `{parent}-{stem}.{camera}`.

use std::path::{Component, Path};

/// A checked name template of `{stem}`, `{parent}`, `{camera}` and `{frame}`; `/` makes sub-folders.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NameTemplate(Vec<Part>);

#[derive(Clone, Debug, PartialEq, Eq)]
enum Part {
    Text(String),
    Stem,
    Parent,
    Camera,
    /// With so many digits at least.
    Frame(usize),
}

/// What a template's placeholders stand for.
#[derive(Clone, Copy, Debug)]
pub struct NameFields<'a> {
    /// The input's name without its extension.
    pub stem: &'a str,
    /// The name of the folder that holds the input.
    pub parent: &'a str,
    /// The camera, made fit for a file name.
    pub camera: &'a str,
    /// The frame's number; 0 where no frames are asked for.
    pub frame: u32,
}

impl NameTemplate {
    /// Reads a template.
    ///
    /// # Errors
    /// What is wrong with it and what is allowed.
    pub fn parse(template: &str) -> Result<Self, String> {
        const ALLOWED: &str = "allowed: text with {stem}, {parent}, {camera}, {frame} or {frame:04}";
        let mut parts = Vec::new();
        let mut rest = template;
        while let Some(open) = rest.find(['{', '}']) {
            let close = rest[open..].find('}').filter(|&at| at > 0);
            let close = close.ok_or_else(|| format!("a brace without its partner; {ALLOWED}"))? + open;
            if open > 0 {
                parts.push(Part::Text(rest[..open].into()));
            }
            parts.push(match &rest[open + 1..close] {
                "stem" => Part::Stem,
                "parent" => Part::Parent,
                "camera" => Part::Camera,
                "frame" => Part::Frame(1),
                name if name.starts_with("frame:") => {
                    let digits = name["frame:".len()..].strip_prefix('0').and_then(|n| n.parse().ok());
                    let digits = digits.filter(|n| (1..=9).contains(n));
                    Part::Frame(
                        digits.ok_or_else(|| {
                            format!("{{{name}}}: the number of digits is written 01 to 09; {ALLOWED}")
                        })?,
                    )
                }
                name => return Err(format!("there is no {{{name}}}; {ALLOWED}")),
            });
            rest = &rest[close + 1..];
        }
        if !rest.is_empty() {
            parts.push(Part::Text(rest.into()));
        }
        let template = Self(parts);
        let probe = template.fill(&NameFields { stem: "s", parent: "p", camera: "c", frame: 0 });
        let inside = Path::new(&probe).components().all(|c| matches!(c, Component::Normal(_)));
        if probe.is_empty() || probe.ends_with('/') || !inside || probe.contains('\0') {
            return Err(format!("must be a name below the output folder; {ALLOWED}"));
        }
        Ok(template)
    }

    /// The name for `fields`.
    pub fn fill(&self, fields: &NameFields<'_>) -> String {
        let text = |part: &Part| match part {
            Part::Text(text) => text.clone(),
            Part::Stem => fields.stem.into(),
            Part::Parent => fields.parent.into(),
            Part::Camera => fields.camera.into(),
            Part::Frame(digits) => format!("{:0digits$}", fields.frame),
        };
        self.0.iter().map(text).collect()
    }

    /// Whether the name depends on the camera.
    pub fn has_camera(&self) -> bool {
        self.0.contains(&Part::Camera)
    }
}

/// `name` without what file systems or shells trip over: letters, digits, `-`, `_` and inner dots stay, each run of
/// anything else becomes one `_`. Empty if nothing is left.
pub fn sanitised(name: &str) -> String {
    let mut clean = String::new();
    for c in name.chars() {
        if c.is_alphanumeric() || matches!(c, '-' | '.') {
            clean.push(c);
        } else if !clean.ends_with('_') {
            clean.push('_');
        }
    }
    clean.trim_matches(['.', '_']).chars().take(100).collect()
}

/// A name for each camera, in the order of `names`, fit for files and no two alike: the sanitised name, else the
/// index, with `-INDEX` behind it where an earlier camera has the same.
pub fn camera_labels(names: &[String]) -> Vec<String> {
    let mut labels: Vec<String> = Vec::new();
    for (index, name) in names.iter().enumerate() {
        let mut label = sanitised(name);
        if label.is_empty() {
            label = index.to_string();
        }
        while labels.contains(&label) {
            label = format!("{label}-{index}");
        }
        labels.push(label);
    }
    labels
}

#[cfg(test)]
mod tests {
    use super::*;

    const FIELDS: NameFields<'_> = NameFields { stem: "lamp", parent: "rooms", camera: "Main", frame: 7 };

    #[test]
    fn placeholders_are_filled() {
        for (template, name) in [
            ("{stem}", "lamp"),
            ("{parent}/{stem}.{camera}", "rooms/lamp.Main"),
            ("x", "x"),
            ("{stem}-final", "lamp-final"),
            ("{stem}/{frame:04}", "lamp/0007"),
            ("{frame}_{frame:01}", "7_7"),
        ] {
            assert_eq!(NameTemplate::parse(template).unwrap().fill(&FIELDS), name);
        }
    }

    #[test]
    fn bad_templates_say_what_is_allowed() {
        for (template, says) in [
            ("{steam}", "there is no {steam}"),
            ("{stem}{frame:4}", "{frame:4}: the number of digits"),
            ("{stem}{frame:}", "{frame:}: the number of digits"),
            ("{stem}{frame:012}", "{frame:012}: the number of digits"),
            ("{stem", "brace"),
            ("stem}", "brace"),
            ("", "must be a name"),
            ("../{stem}", "must be a name"),
            ("/{stem}", "must be a name"),
            ("{stem}/", "must be a name"),
        ] {
            let error = NameTemplate::parse(template).unwrap_err();
            assert!(error.contains(says) && error.contains("{camera}"), "{template}: {error}");
        }
    }

    #[test]
    fn camera_names_become_distinct_file_names() {
        let names = ["Main", "", "../Main", "Kamera Ü 1", "Main", "//", "光"].map(String::from);
        assert_eq!(camera_labels(&names), ["Main", "1", "Main-2", "Kamera_Ü_1", "Main-4", "5", "光"]);
    }
}

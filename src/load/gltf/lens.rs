//! Lenses: what extras say of them (`prt_f_stop` and its like; Blender writes custom properties as extras, so they are
//! flat keys), and the node that they are to be focused on.

use super::locate::shorten;
use super::{Document, Loader, Result, node};
use crate::camera::{Lens, Projection};
use gltf::json::Extras;
use serde_json::{Map, Value};

/// Names that a mistyped one may have meant, at most.
const MOST_NAMES: usize = 5;

/// What the extras of the object at `at` say of a lens.
pub(super) fn read(doc: &Document, extras: &Extras, at: &str) -> Result<Lens> {
    let Some(extras) = extras.as_ref().filter(|raw| raw.get().contains("prt_")) else { return Ok(Lens::default()) };
    // Extras may be anything at all; what is no object has no keys.
    let Ok(Value::Object(members)) = serde_json::from_str(extras.get()) else { return Ok(Lens::default()) };
    let found = Found { doc, members: &members, at };
    let number = |key, range: [f64; 2], unit: &str| {
        let inside = |v: &f64| (range[0]..=range[1]).contains(v);
        let fix = format!("Allowed: {unit}from {} to {}.", range[0], range[1]);
        found.value(key, |v| v.as_f64().filter(inside), &fix)
    };
    let [fewest, most] = Lens::BLADES;
    let blades = |v: &Value| {
        // Exporters write whole numbers as 6.0 too.
        let number = v.as_f64().filter(|v| v.fract() == 0.0)?;
        let allowed = number == 0.0 || (f64::from(fewest)..=f64::from(most)).contains(&number);
        allowed.then_some(number as u32)
    };
    Ok(Lens {
        f_stop: number("prt_f_stop", Lens::F_STOPS, "")?,
        focus_distance: number("prt_focus_distance", Lens::DISTANCES, "metres ")?,
        blades: found.value("prt_aperture_blades", blades, &format!("Allowed: {fewest} to {most}, or 0: round."))?,
        sensor: number("prt_sensor", Lens::SENSORS, "millimetres ")?,
    })
}

/// That an orthographic camera has no lens; `at` is where its f-number is.
pub(super) fn check(doc: &Document, lens: &Lens, projection: &Projection, at: &str) -> Result<()> {
    match projection {
        Projection::Orthographic { .. } if lens.is_open() => {
            let fix = "An orthographic camera has no lens: remove prt_f_stop, or make the camera a perspective one.";
            Err(doc.bad(&format!("{at}/extras/prt_f_stop"), "is given for an orthographic camera", fix))
        }
        _ => Ok(()),
    }
}

/// Extras of an object.
struct Found<'a> {
    doc: &'a Document,
    members: &'a Map<String, Value>,
    at: &'a str,
}

impl Found<'_> {
    /// What `key` has, if it is there; `fix` says what is allowed.
    fn value<T>(&self, key: &str, read: impl Fn(&Value) -> Option<T>, fix: &str) -> Result<Option<T>> {
        let Some(value) = self.members.get(key) else { return Ok(None) };
        let wrong = || self.doc.bad(&format!("{}/extras/{key}", self.at), "is out of range", fix);
        read(value).map(Some).ok_or_else(wrong)
    }
}

/// Notes where the node called `wanted` is.
pub(super) fn focus_on(loader: &mut Loader, wanted: &str) -> Result<()> {
    let nodes = &loader.doc.root.nodes;
    let Some(i) = nodes.iter().position(|node| node.name.as_deref() == Some(wanted)) else {
        let names: Vec<&str> = nodes.iter().filter_map(|node| node.name.as_deref()).collect();
        let near: Vec<String> = nearest(wanted, names).iter().map(|name| format!("\"{}\"", shorten(name))).collect();
        let fix = match near.is_empty() {
            true => "No node has a name: use --focus-distance, in metres.".to_owned(),
            false => format!("The names most like it: {}.", near.join(", ")),
        };
        let problem = format!("--focus-on: there is no node \"{}\"", shorten(wanted));
        return Err(loader.doc.error("/nodes", problem, fix));
    };
    let world = node::world(loader, i)?;
    loader.builder.set_focus(world.w_axis.truncate());
    Ok(())
}

/// The names most like `wanted`, best first, each once.
fn nearest<'n>(wanted: &str, mut names: Vec<&'n str>) -> Vec<&'n str> {
    let wanted = wanted.to_lowercase();
    names.sort_by_cached_key(|name| {
        let name = name.to_lowercase();
        let shares = name.contains(&wanted) || (!name.is_empty() && wanted.contains(&name));
        (!shares, distance(&wanted, &name))
    });
    names.dedup();
    names.truncate(MOST_NAMES);
    names
}

/// Letters to insert, delete or replace to make `b` of `a` (Levenshtein 1966).
fn distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, letter) in a.chars().enumerate() {
        let mut corner = std::mem::replace(&mut row[0], i + 1);
        for j in 0..b.len() {
            let best = (corner + usize::from(letter != b[j])).min(row[j] + 1).min(row[j + 1] + 1);
            corner = std::mem::replace(&mut row[j + 1], best);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_names_most_like_a_mistyped_one_come_first() {
        let names = vec!["Ground", "bottle", "Ball.001", "Wall", "Ball.001", "Table"];
        assert_eq!(nearest("ball", names.clone())[..2], ["Ball.001", "Wall"]);
        assert_eq!(nearest("botle", names)[0], "bottle");
        assert!(nearest("x", Vec::new()).is_empty());
    }

    #[test]
    fn distances_count_letters() {
        assert_eq!([distance("", "ab"), distance("kitten", "sitting"), distance("ab", "ab")], [2, 3, 0]);
    }
}

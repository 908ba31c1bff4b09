//! Options whose value is one of a few words, and what a mistyped word was meant to be.

use clap::builder::{PossibleValue, TypedValueParser};
use std::ffi::OsStr;

/// One of a few words. Help and completions list those that are built; those of the contract that are not are refused
/// by name.
#[derive(Clone, Copy)]
pub struct Words<T: 'static> {
    built: &'static [(&'static str, T)],
    unbuilt: &'static [&'static str],
}

impl<T: Copy> Words<T> {
    /// Words with their meaning, and words of the contract that are not built.
    pub const fn new(built: &'static [(&'static str, T)], unbuilt: &'static [&'static str]) -> Self {
        Self { built, unbuilt }
    }

    /// The meaning of `value`.
    ///
    /// # Errors
    /// It is none of the words; the text says which there are.
    pub fn find(&self, value: &str) -> Result<T, String> {
        if let Some(&(_, found)) = self.built.iter().find(|(name, _)| *name == value) {
            return Ok(found);
        }
        let names: Vec<_> = self.built.iter().map(|(name, _)| *name).collect();
        let list = names.join(", ");
        if self.unbuilt.contains(&value) {
            return Err(format!("{value} is not built yet; built: {list}"));
        }
        Err(match nearest(value, names.into_iter().chain(self.unbuilt.iter().copied())) {
            Some(meant) => format!("allowed: {list}; did you mean {meant}?"),
            None => format!("allowed: {list}"),
        })
    }

    /// For help and completions.
    pub fn possible_values(&self) -> Vec<PossibleValue> {
        let built = self.built.iter().map(|(name, _)| PossibleValue::new(*name));
        built.chain(self.unbuilt.iter().map(|name| PossibleValue::new(*name).hide(true))).collect()
    }
}

impl<T: Copy + Send + Sync + 'static> TypedValueParser for Words<T> {
    type Value = T;

    fn parse_ref(&self, command: &clap::Command, arg: Option<&clap::Arg>, value: &OsStr) -> Result<T, clap::Error> {
        let words = *self;
        (move |value: &str| words.find(value)).parse_ref(command, arg, value)
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        Some(Box::new(Self::possible_values(self).into_iter()))
    }
}

/// The one of `words` that `typed` was most likely meant to be: it begins with it, or is at most a third of its
/// letters away. `None` if none is near.
pub fn nearest<'a>(typed: &str, words: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let typed = typed.to_lowercase();
    let length = typed.chars().count();
    let far = |word: &str| {
        let is_abbreviated = length >= 2 && word.starts_with(&typed);
        if is_abbreviated { 1 } else { distance(&typed, &word.to_lowercase()) }
    };
    let near = words.into_iter().map(|word| (far(word), word)).min_by_key(|(far, _)| *far);
    near.filter(|(far, _)| *far <= (length / 3).max(1) && *far < length).map(|(_, word)| word)
}

/// Letters to insert, delete, replace or swap with their neighbour to make `b` of `a` (optimal string alignment).
fn distance(a: &str, b: &str) -> usize {
    let (a, b): (Vec<char>, Vec<char>) = (a.chars().collect(), b.chars().collect());
    let mut rows = vec![(0..=b.len()).collect::<Vec<_>>()];
    for i in 1..=a.len() {
        let mut row = vec![i];
        for j in 1..=b.len() {
            let replaced = rows[i - 1][j - 1] + usize::from(a[i - 1] != b[j - 1]);
            let mut best = replaced.min(rows[i - 1][j] + 1).min(row[j - 1] + 1);
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                best = best.min(rows[i - 2][j - 2] + 1);
            }
            row.push(best);
        }
        rows.push(row);
    }
    rows[a.len()][b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_word_is_found_and_a_strange_one_is_not() {
        let words = ["spp", "size", "no-png", "camera", "camera-from"];
        for (typed, meant) in [
            ("sppp", Some("spp")),
            ("psp", Some("spp")),
            ("no_png", Some("no-png")),
            ("Camera", Some("camera")),
            ("cam", Some("camera")),
            ("camrea-form", Some("camera-from")),
            ("x", None),
            ("lens", None),
        ] {
            assert_eq!(nearest(typed, words), meant, "{typed}");
        }
    }

    #[test]
    fn letters_swapped_count_once() {
        assert_eq!([distance("ab", "ba"), distance("", "ab"), distance("kitten", "sitting")], [1, 2, 3]);
    }
}

//! The same warning for 500 images must not fill the log: it is shown for the first few, and then counted.

use super::style::Level;
use super::text::count;
use std::collections::HashMap;

/// Images for which the same text is shown.
const SHOWN: usize = 3;

/// What was said about images so far.
#[derive(Debug, Default)]
pub struct Repeats {
    /// Level and text without the input's name, with its place in `order`.
    known: HashMap<(&'static str, String), usize>,
    order: Vec<Repeated>,
}

#[derive(Debug)]
struct Repeated {
    level: Level,
    text: String,
    images: usize,
}

impl Repeats {
    /// The line for `text` about `input`; `None` if the same was said about others often enough.
    pub fn line(&mut self, level: Level, input: &str, text: &str) -> Option<String> {
        // Some begin with the file's name, because a line of it follows.
        let own = text.strip_prefix(input).and_then(|rest| rest.strip_prefix(':'));
        let gist = own.unwrap_or(text).trim_start().to_owned();
        let at = *self.known.entry((level.word(), gist)).or_insert_with_key(|(_, gist)| {
            self.order.push(Repeated { level, text: gist.clone(), images: 0 });
            self.order.len() - 1
        });
        let repeated = &mut self.order[at];
        repeated.images += 1;
        let line = || if own.is_some() { text.to_owned() } else { format!("{input}: {text}") };
        (repeated.images <= SHOWN).then(line)
    }

    /// For each text that was not shown every time, how often it was not.
    pub fn rest(&self) -> Vec<(Level, String)> {
        let hidden = self.order.iter().filter(|repeated| repeated.images > SHOWN);
        let line =
            |r: &Repeated| (r.level, format!("and {}: {}", count((r.images - SHOWN) as u64, "more image"), r.text));
        hidden.map(line).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_text_of_many_images_is_shown_for_the_first_and_counted_for_the_others() {
        let mut repeats = Repeats::default();
        let shown: Vec<_> =
            (0..500).filter_map(|i| repeats.line(Level::Warning, &format!("{i}.gltf"), "no light")).collect();
        assert_eq!(shown, ["0.gltf: no light", "1.gltf: no light", "2.gltf: no light"]);
        assert!(repeats.line(Level::Note, "0.gltf", "no light").is_some(), "a note is no warning");
        assert!(repeats.line(Level::Warning, "0.gltf", "two lights").is_some());
        assert_eq!(repeats.rest(), [(Level::Warning, "and 497 more images: no light".into())]);
    }

    #[test]
    fn a_text_that_begins_with_the_input_does_not_name_it_twice() {
        let mut repeats = Repeats::default();
        let mut line = |input: &str, text: &str| repeats.line(Level::Warning, input, text);
        assert_eq!(line("a.obj", "a.obj:3:1: 2 lines").as_deref(), Some("a.obj:3:1: 2 lines"));
        assert_eq!(line("a.obj", "a.object is odd").as_deref(), Some("a.obj: a.object is odd"));
        (0..5).for_each(|i| drop(line(&format!("{i}.obj"), &format!("{i}.obj:3:1: 2 lines"))));
        assert_eq!(repeats.rest(), [(Level::Warning, "and 3 more images: 3:1: 2 lines".into())]);
    }
}

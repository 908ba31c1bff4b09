//! A texture statement of an MTL file: options, then the file's name.

use super::statement::show;
use super::text::{Words, name_of, number};
use crate::texture::UvTransform;

/// Which part of a picture a scalar map reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Channel {
    Red,
    Green,
    Blue,
    /// `m`: the matte channel.
    Alpha,
    /// `l`: luminance.
    Luminance,
}

/// A texture statement.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Map {
    /// As written.
    pub file: String,
    /// File and `line:column`, for messages.
    pub at: String,
    /// `-s`: how often the picture repeats per unit of u and v.
    pub scale: [f32; 2],
    /// `-o`: added to u and v.
    pub offset: [f32; 2],
    /// `-mm`: value = base + gain x texel.
    pub base: f32,
    /// See `base`.
    pub gain: f32,
    /// `-bm`: bump multiplier.
    pub bump: f32,
    /// `-clamp on`.
    pub clamp: bool,
    /// `-imfchan`.
    pub channel: Option<Channel>,
}

impl Map {
    /// What `-s` and `-o` do to texture coordinates whose v is 0 at the top; `None` = nothing.
    ///
    /// In the file's own coordinates u' = su u + ou and v' = sv v + ov; with v = 1 - w, w' = sv w + (1 - sv - ov).
    pub fn transform(&self) -> Option<UvTransform> {
        let ([su, sv], [ou, ov]) = (self.scale, self.offset);
        let m = [[su, 0.0, ou], [0.0, sv, 1.0 - sv - ov]];
        let plain = self.scale == [1.0; 2] && self.offset == [0.0; 2];
        (!plain && m.as_flattened().iter().all(|v| v.is_finite())).then_some(UvTransform { m })
    }
}

/// The statement behind its key, and what is wrong with it; `None` without a file name.
pub(super) fn read(words: &mut Words, at: String) -> (Option<Map>, Vec<String>) {
    let mut map = Map {
        file: String::new(),
        at,
        scale: [1.0; 2],
        offset: [0.0; 2],
        base: 0.0,
        gain: 1.0,
        bump: 1.0,
        clamp: false,
        channel: None,
    };
    let mut problems = Vec::new();
    loop {
        let mut ahead = words.clone();
        match ahead.next() {
            Some(option) if option.starts_with(b"-") && option.len() > 1 => {
                if !map.option(option, &mut ahead, &mut problems) {
                    problems.push(format!("the option {} is not known: ignored", show(option)));
                }
                *words = ahead;
            }
            _ => break,
        }
    }
    let name = name_of(words.rest());
    let quoted = name.strip_prefix('"').and_then(|n| n.strip_suffix('"'));
    map.file = quoted.unwrap_or(&name).to_owned();
    ((!map.file.is_empty()).then_some(map), problems)
}

impl Map {
    /// Takes the values of an option; whether it is known.
    fn option(&mut self, option: &[u8], words: &mut Words, problems: &mut Vec<String>) -> bool {
        match option {
            b"-s" => {
                let [u, v, _] = numbers(words, [1.0; 3]);
                self.scale = [u, v];
            }
            b"-o" => {
                let [u, v, _] = numbers(words, [0.0; 3]);
                self.offset = [u, v];
            }
            b"-t" => {
                if numbers(words, [0.0; 3]) != [0.0; 3] {
                    problems.push("-t (turbulence) is ignored".into());
                }
            }
            b"-mm" => [self.base, self.gain] = numbers(words, [0.0, 1.0]),
            b"-bm" => [self.bump] = numbers(words, [1.0]),
            b"-texres" | b"-boost" => _ = numbers(words, [0.0]),
            b"-clamp" => self.clamp = words.next().is_some_and(|w| w.eq_ignore_ascii_case(b"on")),
            b"-blendu" | b"-blendv" | b"-cc" => _ = words.next(),
            b"-type" => _ = words.next(),
            b"-imfchan" => {
                let word = words.next().unwrap_or_default();
                self.channel = match word {
                    b"r" => Some(Channel::Red),
                    b"g" => Some(Channel::Green),
                    b"b" => Some(Channel::Blue),
                    b"m" => Some(Channel::Alpha),
                    b"l" => Some(Channel::Luminance),
                    _ => {
                        problems.push(format!("-imfchan {}: allowed are r, g, b, m and l", show(word)));
                        None
                    }
                };
            }
            _ => return false,
        }
        true
    }
}

/// As many finite numbers as follow, at most `N`; those that are missing keep their default.
fn numbers<const N: usize>(words: &mut Words, mut values: [f32; N]) -> [f32; N] {
    for value in &mut values {
        let mut ahead = words.clone();
        // The last word is the file's name, whatever it looks like.
        let found = ahead.next().and_then(number).filter(|n| n.1 && n.0.is_finite());
        match found {
            Some((n, _)) if !ahead.rest().is_empty() => *value = n,
            _ => break,
        }
        *words = ahead;
    }
    values
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::load::obj::text::Text;
    use std::path::Path;

    fn parse(line: &str) -> (Option<Map>, Vec<String>) {
        let text = Text::new(Path::new("m.mtl"), line.as_bytes().to_vec());
        let line = text.lines().next().unwrap();
        read(&mut line.words(), String::new())
    }

    #[test]
    fn options_take_their_values_and_leave_the_name() {
        let (map, problems) = parse(
            r"-s 2 3 1 -o 0.25 0.5 -mm 0.1 0.8 -bm 0.2 -clamp on -blendu off -texres 512 -imfchan r a b\c 01.png",
        );
        let map = map.unwrap();
        assert_eq!(map.file, r"a b\c 01.png");
        assert_eq!((map.scale, map.offset), ([2.0, 3.0], [0.25, 0.5]));
        assert_eq!((map.base, map.gain, map.bump, map.clamp), (0.1, 0.8, 0.2, true));
        assert_eq!(map.channel, Some(Channel::Red));
        assert!(problems.is_empty(), "{problems:?}");
        let (map, _) = parse("-s 2 01.png");
        assert_eq!(map.map(|m| (m.scale, m.file)), Some(([2.0, 1.0], "01.png".into())));
        assert_eq!(parse("-bm 7").0.map(|m| m.file), Some("7".into()));
        assert_eq!(parse("\"my tex.png\"").0.map(|m| m.file), Some("my tex.png".into()));
        assert!(parse("-s 1 1 1").0.is_none_or(|m| m.file == "1"));
        assert!(parse("\n").0.is_none());
        assert_eq!(parse("-t 1 1 1 x.png").1.len(), 1);
        assert_eq!(parse("-nonsense x.png").1.len(), 1);
    }

    #[test]
    fn scale_and_offset_act_on_the_coordinates_of_the_file() {
        let map = parse("-s 2 4 1 -o 0.1 0.3 0 x.png").0.unwrap();
        let m = map.transform().unwrap().m;
        let [u, v] = [0.3, 0.6];
        let flipped = 1.0 - v;
        let at = |row: [f32; 3]| row[0] * u + row[1] * flipped + row[2];
        assert!((at(m[0]) - (2.0 * u + 0.1)).abs() < 1e-6);
        assert!((1.0 - at(m[1]) - (4.0 * v + 0.3)).abs() < 1e-6);
        assert_eq!(parse("-s 1 1 1 -o 0 0 0 x.png").0.unwrap().transform(), None);
    }
}

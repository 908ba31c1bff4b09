//! OBJ and MTL text: what the bytes mean, logical lines, words, and where an offset is.

use crate::error::SourceLoc;
use std::borrow::Cow;
use std::path::{Path, PathBuf};

/// A file's text. Bytes that are not UTF-8 stay as they are: only names may have them ([`name_of`]).
pub(super) struct Text {
    /// As the user sees it.
    pub file: PathBuf,
    bytes: Vec<u8>,
    /// Where the text begins, behind a byte order mark.
    start: usize,
}

impl Text {
    /// UTF-16 (with or without a byte order mark) becomes UTF-8; line ends of old Macs become newlines.
    pub fn new(file: &Path, bytes: Vec<u8>) -> Self {
        let mut text = Self { file: file.to_owned(), bytes, start: 0 };
        let utf16 = |big: bool, bytes: &[u8]| {
            let pairs = bytes.as_chunks::<2>().0.iter();
            let units = pairs.map(|&pair| if big { u16::from_be_bytes(pair) } else { u16::from_le_bytes(pair) });
            let decoded = char::decode_utf16(units).map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER));
            decoded.collect::<String>().into_bytes()
        };
        match *text.bytes.as_slice() {
            [0xEF, 0xBB, 0xBF, ..] => text.start = 3,
            [0xFE, 0xFF, ref rest @ ..] => text.bytes = utf16(true, rest),
            [0xFF, 0xFE, ref rest @ ..] => text.bytes = utf16(false, rest),
            // The first character of an OBJ or MTL is ASCII.
            [0, 1..=255, ..] => text.bytes = utf16(true, &text.bytes),
            [1..=255, 0, ..] => text.bytes = utf16(false, &text.bytes),
            _ => {}
        }
        // A file of one single line is rare and short; looking for its end costs nothing in the others.
        if !text.bytes.contains(&b'\n') {
            text.bytes.iter_mut().filter(|b| **b == b'\r').for_each(|b| *b = b'\n');
        }
        text
    }

    /// Everything.
    pub fn bytes(&self) -> &[u8] {
        self.bytes.get(self.start..).unwrap_or_default()
    }

    /// The logical lines.
    pub fn lines(&self) -> Lines<'_> {
        Lines { rest: self.bytes(), offset: 0 }
    }

    /// `line:column`, both from 1, of an offset into [`Text::bytes`]; the column counts bytes.
    pub fn at(&self, offset: usize) -> SourceLoc {
        let before = self.bytes().get(..offset).unwrap_or_default();
        let line = before.iter().filter(|b| **b == b'\n').count() + 1;
        let column = before.iter().rev().take_while(|b| **b != b'\n').count() + 1;
        SourceLoc::at(&self.file, format!("{line}:{column}"))
    }

    /// About `size` bytes each, cut between logical lines, with their offsets.
    pub fn pieces(&self, size: usize) -> Vec<Lines<'_>> {
        let (bytes, mut pieces, mut begin) = (self.bytes(), Vec::new(), 0);
        while begin < bytes.len() {
            let mut end = (begin + size).min(bytes.len());
            // A newline behind a backslash may continue its line: cut at the next one.
            while end < bytes.len() && (bytes[end - 1] != b'\n' || continues(&bytes[begin..end - 1])) {
                end += 1;
            }
            pieces.push(Lines { rest: &bytes[begin..end], offset: begin });
            begin = end;
        }
        pieces
    }
}

/// Finds places in the order of the text, so that a file with many of them is gone through once.
#[derive(Default)]
pub(super) struct Places {
    /// How far newlines are counted.
    offset: usize,
    lines: usize,
    /// Where the last line begins.
    begin: usize,
}

impl Places {
    /// [`Text::at`] for an offset that is not before the last one.
    pub fn at(&mut self, text: &Text, offset: usize) -> SourceLoc {
        let new = text.bytes().get(self.offset..offset).unwrap_or_default();
        self.lines += new.iter().filter(|b| **b == b'\n').count();
        if let Some(last) = new.iter().rposition(|b| *b == b'\n') {
            self.begin = self.offset + last + 1;
        }
        self.offset = self.offset.max(offset);
        SourceLoc::at(&text.file, format!("{}:{}", self.lines + 1, offset.saturating_sub(self.begin) + 1))
    }
}

/// Whether a line (without its newline) ends in a backslash.
fn continues(line: &[u8]) -> bool {
    matches!(line, [.., b'\\'] | [.., b'\\', b'\r'])
}

/// Logical lines: a backslash at the end of a line joins the next one to it.
#[derive(Clone)]
pub(super) struct Lines<'t> {
    rest: &'t [u8],
    offset: usize,
}

/// A logical line.
pub(super) struct Line<'t> {
    /// Of its first byte.
    pub offset: usize,
    text: Cow<'t, [u8]>,
}

impl<'t> Iterator for Lines<'t> {
    type Item = Line<'t>;

    fn next(&mut self) -> Option<Line<'t>> {
        if self.rest.is_empty() {
            return None;
        }
        let newline = |bytes: &[u8]| bytes.iter().position(|b| *b == b'\n').unwrap_or(bytes.len());
        let mut end = newline(self.rest);
        let mut text = Cow::Borrowed(&self.rest[..end]);
        // A comment may end in a backslash (a path) without swallowing the next line.
        if continues(&text) && text.trim_ascii_start().first() != Some(&b'#') {
            while continues(&self.rest[..end]) && end < self.rest.len() {
                end += 1 + newline(&self.rest[end + 1..]);
            }
            // As many bytes as before, so that offsets stay true.
            let mut joined = self.rest[..end].to_vec();
            for i in 0..joined.len() {
                let last = matches!(joined[i + 1..], [] | [b'\r'] | [b'\n', ..] | [b'\r', b'\n', ..]);
                if joined[i] == b'\n' || joined[i] == b'\\' && last {
                    joined[i] = b' ';
                }
            }
            text = Cow::Owned(joined);
        }
        let line = Line { offset: self.offset, text };
        let next = (end + 1).min(self.rest.len());
        self.offset += next;
        self.rest = &self.rest[next..];
        Some(line)
    }
}

impl Line<'_> {
    /// Its words.
    pub fn words(&self) -> Words<'_> {
        Words { line: &self.text, at: 0, start: self.offset, offset: self.offset }
    }
}

/// Words between blanks.
#[derive(Clone)]
pub(super) struct Words<'l> {
    line: &'l [u8],
    at: usize,
    /// Offset in the text of the word given last.
    pub start: usize,
    offset: usize,
}

#[inline(always)]
fn is_blank(byte: u8) -> bool {
    matches!(byte, b' ' | b'\t' | b'\r' | 0x0B | 0x0C | 0)
}

impl<'l> Iterator for Words<'l> {
    type Item = &'l [u8];

    #[inline]
    fn next(&mut self) -> Option<&'l [u8]> {
        let rest = self.line.get(self.at..)?;
        let begin = rest.iter().position(|b| !is_blank(*b))?;
        let rest = &rest[begin..];
        let length = rest.iter().position(|b| is_blank(*b)).unwrap_or(rest.len());
        self.start = self.offset + self.at + begin;
        self.at += begin + length;
        Some(&rest[..length])
    }
}

impl<'l> Words<'l> {
    /// What is left of the line, without blanks around it.
    pub fn rest(&self) -> &'l [u8] {
        let mut rest = self.line.get(self.at..).unwrap_or_default();
        while let [first, inner @ ..] = rest
            && is_blank(*first)
        {
            rest = inner;
        }
        while let [inner @ .., last] = rest
            && is_blank(*last)
        {
            rest = inner;
        }
        rest
    }
}

/// A name: UTF-8, else each byte a Latin-1 character.
pub(super) fn name_of(bytes: &[u8]) -> String {
    match std::str::from_utf8(bytes) {
        Ok(name) => name.to_owned(),
        Err(_) => bytes.iter().map(|&b| char::from(b)).collect(),
    }
}

/// Where a word that is not a number begins with one, it has fewer bytes than this.
const LONGEST_NUMBER: usize = 64;

/// A number and whether the whole word is one; a number followed by something else (`3.1+e2`) counts as far as it goes.
pub(super) fn number(word: &[u8]) -> Option<(f32, bool)> {
    let parse = |bytes: &[u8]| std::str::from_utf8(bytes).ok().and_then(|s| s.parse::<f32>().ok());
    if let Some(value) = parse(word) {
        return Some((value, true));
    }
    (1..word.len().min(LONGEST_NUMBER)).rev().find_map(|n| parse(&word[..n])).map(|value| (value, false))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(bytes: &[u8]) -> Vec<Vec<String>> {
        let text = Text::new(Path::new("a.obj"), bytes.to_vec());
        text.lines().map(|line| line.words().map(name_of).collect()).collect()
    }

    #[test]
    fn continuations_join_lines_and_comments_do_not() {
        assert_eq!(lines(b"f 1 2\\\n 3 \\\r\n4\nv 1"), [vec!["f", "1", "2", "3", "4"], vec!["v", "1"]]);
        assert_eq!(lines(b"# C:\\\nv 1"), [vec!["#", "C:\\"], vec!["v", "1"]]);
        assert_eq!(lines(b"map_Kd a\\b.png\nf 1\\"), [vec!["map_Kd", "a\\b.png"], vec!["f", "1"]]);
    }

    #[test]
    fn encodings_and_line_ends_mean_the_same() {
        let expected = lines(b"g a\nv 1\n");
        assert_eq!(lines(b"\xEF\xBB\xBFg a\r\nv 1\r\n"), expected);
        assert_eq!(lines(b"g a\rv 1\r"), expected);
        let utf16: Vec<u8> = "g a\nv 1\n".encode_utf16().flat_map(u16::to_be_bytes).collect();
        assert_eq!(lines(&utf16), expected);
        assert_eq!(lines(&[&[0xFE, 0xFF], &utf16[..]].concat()), expected);
        let utf16: Vec<u8> = "\u{feff}g a\nv 1\n".encode_utf16().flat_map(u16::to_le_bytes).collect();
        assert_eq!(lines(&utf16), expected);
        assert_eq!(lines(b"g \xE9t\xE9\n"), [vec!["g", "\u{e9}t\u{e9}"]]);
    }

    #[test]
    fn pieces_are_cut_between_logical_lines() {
        let source = b"v 1 2 3\nf 1 \\\n2 \\\n3\n\n# x\\\nv 4 5 6";
        let text = Text::new(Path::new("a.obj"), source.to_vec());
        let whole = lines(source);
        for size in 1..source.len() + 1 {
            let pieces = text.pieces(size).into_iter().flatten();
            let cut: Vec<Vec<String>> = pieces.map(|line| line.words().map(name_of).collect()).collect();
            assert_eq!(cut, whole, "pieces of {size}");
        }
    }

    #[test]
    fn places_count_lines_and_columns_from_one() {
        let text = Text::new(Path::new("a.obj"), b"v 1\nvn 2 x\n".to_vec());
        let line = text.lines().nth(1).unwrap();
        let mut words = line.words();
        words.nth(2);
        assert_eq!(text.at(words.start).place, "2:6");
        let mut places = Places::default();
        for offset in 0..text.bytes().len() {
            assert_eq!(places.at(&text, offset), text.at(offset), "{offset}");
        }
    }

    #[test]
    fn numbers_count_as_far_as_they_go() {
        assert_eq!(number(b"+2."), Some((2.0, true)));
        assert_eq!(number(b".5e1"), Some((5.0, true)));
        assert_eq!(number(b"3.1+e2"), Some((3.1, false)));
        assert_eq!(number(b"-0.5f"), Some((-0.5, false)));
        assert_eq!(number(b"abc"), None);
        assert!(number(b"nan").unwrap().0.is_nan());
    }
}

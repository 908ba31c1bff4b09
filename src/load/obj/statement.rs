//! The statements of one piece of an OBJ file: vertices go to their place, faces, groups and materials are listed.

use super::text::{Line, Lines, Words, number};

/// No index here.
pub(super) const NONE: u32 = u32::MAX;

/// Position, texture coordinate and normal of a face's corner, from 0 in the whole file; [`NONE`] where it has none.
pub(super) type Corner = [u32; 3];

/// How many `v`, `vt` and `vn` a piece has.
pub(super) type Counts = [usize; 3];

/// Where a piece puts its vertices: slices of the file's lists, as long as [`count`] said.
pub(super) struct Sinks<'s> {
    pub positions: &'s mut [[f32; 3]],
    /// As written: v = 0 at the bottom.
    pub uvs: &'s mut [[f32; 2]],
    pub normals: &'s mut [[f32; 3]],
}

/// What is known of the file before its pieces are read.
#[derive(Clone, Copy)]
pub(super) struct Known {
    /// `v`, `vt`, `vn` before the piece.
    pub before: Counts,
    /// In the whole file.
    pub total: Counts,
}

/// What a statement changes for the faces after it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Change {
    Object(Vec<u8>),
    Group(Vec<u8>),
    Material(Vec<u8>),
    /// Smoothing group; 0 = none.
    Smooth(u32),
    Library(Vec<u8>),
}

/// A [`Change`] and where it is.
pub(super) struct Event {
    /// It counts for this face of the piece and those after it.
    pub face: usize,
    pub change: Change,
    /// Offset in the text.
    pub offset: usize,
}

/// Things that are counted and told once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Note {
    PointsAndLines,
    FreeForm,
    ShortFaces,
    NumberTails,
    MoreNumbers,
    OtherFiles,
    SmoothWords,
    AbsentLists,
    Unknown,
}

/// How many kinds of [`Note`] there are.
pub(super) const NOTES: usize = Note::Unknown as usize + 1;

/// Count and offset of the first, for each kind of [`Note`].
pub(super) type Notes = [(usize, usize); NOTES];

/// The faces of a piece.
#[derive(Default)]
pub(super) struct Faces {
    pub corners: Vec<Corner>,
    /// For each face, the end of its corners.
    pub ends: Vec<u32>,
    pub events: Vec<Event>,
    /// Vertex colours as written, by index of the position in the file.
    pub colors: Vec<(u32, [f32; 3])>,
    /// Some corner has no normal.
    pub lacks_normals: bool,
    pub notes: Notes,
    /// Statements that are known.
    pub understood: usize,
}

impl Faces {
    /// The corners of face `i`, as a range of `corners`.
    pub fn range(&self, i: usize) -> std::ops::Range<usize> {
        let end = |i: usize| self.ends[i] as usize;
        (if i == 0 { 0 } else { end(i - 1) })..end(i)
    }

    fn note(&mut self, note: Note, offset: usize) {
        let (count, first) = &mut self.notes[note as usize];
        if *count == 0 {
            *first = offset;
        }
        *count += 1;
    }
}

/// What makes the file unreadable.
pub(super) struct Fault {
    pub offset: usize,
    pub problem: String,
    pub fix: &'static str,
}

/// Counts the vertices of a piece.
pub(super) fn count(lines: Lines) -> Counts {
    let mut counts = [0; 3];
    for line in lines {
        match line.words().next() {
            Some(b"v") => counts[0] += 1,
            Some(b"vt") => counts[1] += 1,
            Some(b"vn") => counts[2] += 1,
            _ => {}
        }
    }
    counts
}

/// Reads a piece.
pub(super) fn read(lines: Lines, known: Known, sinks: Sinks) -> Result<Faces, Fault> {
    let mut piece = Piece { known, sinks, here: [0; 3], faces: Faces::default() };
    for line in lines {
        piece.line(&line)?;
    }
    Ok(piece.faces)
}

struct Piece<'s> {
    known: Known,
    sinks: Sinks<'s>,
    /// Vertices of this piece read so far.
    here: Counts,
    faces: Faces,
}

impl Piece<'_> {
    fn line(&mut self, line: &Line) -> Result<(), Fault> {
        let mut words = line.words();
        let Some(key) = words.next() else { return Ok(()) };
        self.faces.understood += 1;
        match key {
            b"v" => self.position(&mut words),
            b"vt" => self.uv(&mut words),
            b"vn" => self.normal(&mut words),
            // `fo` is what version 2 of the format called it.
            b"f" | b"fo" => self.face(&mut words),
            _ => {
                self.other(key, &words);
                Ok(())
            }
        }
    }

    fn other(&mut self, key: &[u8], words: &Words) {
        let offset = words.start;
        let change = match key {
            b"o" => Change::Object(words.rest().to_vec()),
            b"g" => Change::Group(words.rest().to_vec()),
            b"usemtl" => Change::Material(words.rest().to_vec()),
            b"mtllib" => Change::Library(words.rest().to_vec()),
            b"s" => match (words.rest(), std::str::from_utf8(words.rest()).ok().and_then(|s| s.parse().ok())) {
                (_, Some(group)) => Change::Smooth(group),
                (b"off" | b"OFF" | b"Off" | b"null", _) => Change::Smooth(0),
                (b"on" | b"ON" | b"On", _) => Change::Smooth(1),
                _ => {
                    self.faces.note(Note::SmoothWords, offset);
                    Change::Smooth(0)
                }
            },
            b"p" | b"l" => return self.faces.note(Note::PointsAndLines, offset),
            b"vp" | b"cstype" | b"deg" | b"bmat" | b"step" | b"curv" | b"curv2" | b"surf" | b"parm" | b"trim"
            | b"hole" | b"scrv" | b"sp" | b"end" | b"con" | b"bsp" | b"bzp" | b"cdc" | b"cdp" | b"res" => {
                return self.faces.note(Note::FreeForm, offset);
            }
            b"call" | b"csh" => return self.faces.note(Note::OtherFiles, offset),
            // How other programs show or tessellate.
            b"mg" | b"bevel" | b"c_interp" | b"d_interp" | b"lod" | b"shadow_obj" | b"trace_obj" | b"ctech"
            | b"stech" | b"usemap" | b"maplib" | b"vw" => return,
            _ if key.starts_with(b"#") => {
                // A comment alone does not make an OBJ.
                self.faces.understood -= 1;
                return;
            }
            _ => {
                self.faces.understood -= 1;
                return self.faces.note(Note::Unknown, offset);
            }
        };
        self.faces.events.push(Event { face: self.faces.ends.len(), change, offset });
    }

    /// Up to `N` numbers and how many there were; a comment ends them.
    fn numbers<const N: usize>(&mut self, words: &mut Words) -> Result<([f32; N], usize), Fault> {
        let mut values = [0.0; N];
        let mut n = 0;
        while let Some(word) = words.next() {
            if word.starts_with(b"#") {
                break;
            }
            if n == N {
                self.faces.note(Note::MoreNumbers, words.start);
                break;
            }
            let Some((value, whole)) = number(word) else {
                let problem = format!("\"{}\" is not a number", show(word));
                return Err(Fault {
                    offset: words.start,
                    problem,
                    fix: "A coordinate is a number such as 1.5 or 2e-3.",
                });
            };
            if !whole {
                self.faces.note(Note::NumberTails, words.start);
            }
            values[n] = value;
            n += 1;
        }
        Ok((values, n))
    }

    fn position(&mut self, words: &mut Words) -> Result<(), Fault> {
        let start = words.start;
        let (values, n) = self.numbers::<7>(words)?;
        let [x, y, z, a, b, c, _] = values;
        let position = match n {
            0..=2 => return Err(too_few(start, "v", n, "Three are needed: v x y z.")),
            // Homogeneous; a point at infinity becomes one that is not finite, whose triangles are dropped and counted.
            4 => [x, y, z].map(|p| p / a),
            5 => {
                self.faces.note(Note::MoreNumbers, start);
                [x, y, z]
            }
            _ => [x, y, z],
        };
        if n >= 6 {
            let index = self.known.before[0] + self.here[0];
            self.faces.colors.push((index as u32, [a, b, c]));
        }
        put(self.sinks.positions, &mut self.here[0], position);
        Ok(())
    }

    fn uv(&mut self, words: &mut Words) -> Result<(), Fault> {
        let start = words.start;
        let ([u, v, _], n) = self.numbers::<3>(words)?;
        if n == 0 {
            return Err(too_few(start, "vt", n, "One to three are allowed: vt u v."));
        }
        put(self.sinks.uvs, &mut self.here[1], [u, v]);
        Ok(())
    }

    fn normal(&mut self, words: &mut Words) -> Result<(), Fault> {
        let start = words.start;
        let (normal, n) = self.numbers::<3>(words)?;
        if n < 3 {
            return Err(too_few(start, "vn", n, "Three are needed: vn x y z."));
        }
        put(self.sinks.normals, &mut self.here[2], normal);
        Ok(())
    }

    fn face(&mut self, words: &mut Words) -> Result<(), Fault> {
        let start = words.start;
        let first = self.faces.corners.len();
        while let Some(word) = words.next() {
            if word.starts_with(b"#") {
                break;
            }
            let corner =
                self.corner(word, words.start).map_err(|(problem, fix)| Fault { offset: words.start, problem, fix })?;
            self.faces.lacks_normals |= corner[2] == NONE;
            self.faces.corners.push(corner);
        }
        if self.faces.corners.len() < first + 3 {
            self.faces.corners.truncate(first);
            self.faces.note(Note::ShortFaces, start);
            return Ok(());
        }
        self.faces.ends.push(self.faces.corners.len() as u32);
        Ok(())
    }

    /// `position/texture/normal`, the last two of which may be missing.
    #[inline]
    fn corner(&mut self, word: &[u8], offset: usize) -> Result<Corner, (String, &'static str)> {
        let mut corner = [NONE; 3];
        let mut parts = word.split(|b| *b == b'/');
        for (k, index) in corner.iter_mut().enumerate() {
            match parts.next() {
                None => break,
                Some(b"") if k > 0 => {}
                // Exporters write such indices out of habit; nothing is lost that was there.
                Some(_) if k > 0 && self.known.total[k] == 0 => self.faces.note(Note::AbsentLists, offset),
                Some(part) => *index = self.index(k, part)?,
            }
        }
        match parts.next() {
            None => Ok(corner),
            Some(_) => {
                Err((format!("\"{}\" has more than two slashes", show(word)), "A corner is v, v/vt, v//vn or v/vt/vn."))
            }
        }
    }

    #[inline]
    fn index(&self, k: usize, part: &[u8]) -> Result<u32, (String, &'static str)> {
        const KINDS: [&str; 3] = ["vertex", "texture coordinate", "normal"];
        let total = self.known.total[k];
        let (negative, digits) = match part {
            [b'-', digits @ ..] => (true, digits),
            [b'+', digits @ ..] => (false, digits),
            digits => (false, digits),
        };
        let add = |n: usize, d: &u8| Some(n.saturating_mul(10).saturating_add(usize::from(*d)));
        let value =
            digits.iter().map(|b| b.wrapping_sub(b'0')).try_fold(0, |n, d| if d < 10 { add(n, &d) } else { None });
        let Some(value) = value.filter(|_| !digits.is_empty()) else {
            let problem = format!("\"{}\" is not an index", show(part));
            return Err((problem, "A corner is v, v/vt, v//vn or v/vt/vn, each a whole number."));
        };
        let so_far = self.known.before[k] + self.here[k];
        let index = if negative { so_far.checked_sub(value) } else { value.checked_sub(1) };
        match index {
            Some(index) if value > 0 && index < total => Ok(index as u32),
            _ if value == 0 => Err((
                format!("the {} index is 0", KINDS[k]),
                "Indices count from 1; negative ones count back from the line they are on.",
            )),
            _ => {
                let there = if negative { so_far } else { total };
                let (kind, shown) = (KINDS[k], show(part));
                let place = if negative { "up to this line" } else { "in the file" };
                let problem = format!("the {kind} index is {shown}, but there are {there} {place}");
                Err((problem, "Was the file cut short? Export it again."))
            }
        }
    }
}

fn put<T>(list: &mut [T], n: &mut usize, value: T) {
    // `count` found as many lines as `read` does, so the place is there.
    if let Some(place) = list.get_mut(*n) {
        *place = value;
    }
    *n += 1;
}

fn too_few(offset: usize, key: &str, n: usize, fix: &'static str) -> Fault {
    Fault { offset, problem: format!("{key} has {n} numbers"), fix }
}

/// A word for a message.
pub(super) fn show(word: &[u8]) -> String {
    const SHOWN: usize = 40;
    let cut = word.get(..SHOWN);
    format!("{}{}", cut.unwrap_or(word).escape_ascii(), if cut.is_some() { "..." } else { "" })
}

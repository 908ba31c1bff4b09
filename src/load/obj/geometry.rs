//! The whole of an OBJ file: pieces are read in parallel, then put in order.

use super::statement::{self, Change, Counts, Faces, Fault, Known, NONE, NOTES, Notes, Sinks};
use super::text::{Text, name_of};
use crate::error::LoadError;
use rayon::prelude::*;
use std::collections::HashMap;
use std::ops::Range;

/// Bytes of a piece: small enough to share the work out evenly, large enough that its lists are worth having.
const PIECE: usize = 1 << 20;

/// Faces of one part that follow each other in the file.
#[derive(Clone, Debug)]
pub(super) struct Run {
    /// Index into [`Geometry::pieces`].
    pub piece: usize,
    /// Faces of the piece.
    pub faces: Range<usize>,
    /// Smoothing group; 0 = none.
    pub smooth: u32,
}

/// The faces of one object or group that have one material.
#[derive(Debug)]
pub(super) struct Part {
    /// `object/group`, or whichever is there; empty if neither is.
    pub name: String,
    /// Index into [`Geometry::materials`].
    pub material: Option<usize>,
    pub runs: Vec<Run>,
}

/// What an OBJ file says.
#[derive(Default)]
pub(super) struct Geometry {
    pub positions: Vec<[f32; 3]>,
    /// Of each position, as written; NaN where it has none. Empty if none has.
    pub colors: Vec<[f32; 3]>,
    pub uvs: Vec<[f32; 2]>,
    /// Those of the file, then those that `normals` makes.
    pub normals: Vec<[f32; 3]>,
    pub pieces: Vec<Faces>,
    pub parts: Vec<Part>,
    /// Names that `usemtl` gives, and the offset of the first.
    pub materials: Vec<(String, usize)>,
    /// What `mtllib` says, and where.
    pub libraries: Vec<(String, usize)>,
    pub notes: Notes,
}

impl Geometry {
    /// Reads `text`.
    ///
    /// # Errors
    /// A coordinate that is no number, an index that leads nowhere, or a file that is not OBJ at all.
    pub fn read(text: &Text) -> Result<Self, LoadError> {
        let pieces = text.pieces(PIECE);
        let counts: Vec<Counts> = pieces.par_iter().map(|lines| statement::count(lines.clone())).collect();
        let total = counts.iter().fold([0; 3], |a, b| [0, 1, 2].map(|k| a[k] + b[k]));
        if total.iter().any(|&n| n >= NONE as usize) {
            let problem = format!("{} v, {} vt, {} vn", total[0], total[1], total[2]);
            return Err(LoadError::new(text.at(0), problem, "At most 2^32 - 2 of each are allowed."));
        }
        let mut geometry = Self {
            positions: vec![[0.0; 3]; total[0]],
            uvs: vec![[0.0; 2]; total[1]],
            normals: vec![[0.0; 3]; total[2]],
            ..Self::default()
        };
        let (mut positions, mut uvs, mut normals) =
            (&mut geometry.positions[..], &mut geometry.uvs[..], &mut geometry.normals[..]);
        let mut before = [0; 3];
        let mut jobs = Vec::with_capacity(pieces.len());
        for (lines, here) in pieces.into_iter().zip(&counts) {
            let sinks = Sinks {
                positions: positions.split_off_mut(..here[0]).expect("the counts add up"),
                uvs: uvs.split_off_mut(..here[1]).expect("the counts add up"),
                normals: normals.split_off_mut(..here[2]).expect("the counts add up"),
            };
            jobs.push((lines, Known { before, total }, sinks));
            before = [0, 1, 2].map(|k| before[k] + here[k]);
        }
        let read = |(lines, known, sinks)| statement::read(lines, known, sinks);
        let results: Vec<Result<Faces, Fault>> = jobs.into_par_iter().map(read).collect();
        let fault = |f: Fault| LoadError::new(text.at(f.offset), f.problem, f.fix);
        geometry.pieces = results.into_iter().collect::<Result<_, _>>().map_err(fault)?;
        geometry.collect_notes(text)?;
        geometry.collect_colors();
        geometry.collect_parts();
        Ok(geometry)
    }

    fn collect_notes(&mut self, text: &Text) -> Result<(), LoadError> {
        for piece in &self.pieces {
            for k in 0..NOTES {
                let (count, first) = &mut self.notes[k];
                if *count == 0 {
                    *first = piece.notes[k].1;
                }
                *count += piece.notes[k].0;
            }
        }
        let (unknown, first) = self.notes[statement::Note::Unknown as usize];
        if unknown > 0 && self.pieces.iter().all(|p| p.understood == 0) {
            let line = text.bytes().get(first..).unwrap_or_default();
            let word = line.split(|b| b.is_ascii_whitespace()).next().unwrap_or_default();
            let problem = format!("not a Wavefront OBJ file: \"{}\" is no statement of one", statement::show(word));
            return Err(LoadError::new(
                text.at(first),
                problem,
                "Lines begin with v, vt, vn, f, o, g, usemtl and the like.",
            ));
        }
        Ok(())
    }

    fn collect_colors(&mut self) {
        if self.pieces.iter().all(|p| p.colors.is_empty()) {
            return;
        }
        self.colors = vec![[f32::NAN; 3]; self.positions.len()];
        for &(index, color) in self.pieces.iter().flat_map(|p| &p.colors) {
            if let Some(place) = self.colors.get_mut(index as usize) {
                *place = color;
            }
        }
    }

    /// Follows `o`, `g`, `usemtl`, `s` and `mtllib` through the file.
    fn collect_parts(&mut self) {
        let mut by_key: HashMap<(String, Option<usize>), usize> = HashMap::new();
        let mut by_name: HashMap<String, usize> = HashMap::new();
        let mut now = State::default();
        for k in 0..self.pieces.len() {
            let piece = &self.pieces[k];
            let mut begin = 0;
            let mut add = |now: &State, faces: Range<usize>, parts: &mut Vec<Part>| {
                if faces.is_empty() {
                    return;
                }
                let key = (now.name(), now.material);
                let place = *by_key.entry(key).or_insert_with_key(|(name, material)| {
                    parts.push(Part { name: name.clone(), material: *material, runs: Vec::new() });
                    parts.len() - 1
                });
                parts[place].runs.push(Run { piece: k, faces, smooth: now.smooth });
            };
            for event in &piece.events {
                add(&now, begin..event.face, &mut self.parts);
                begin = event.face;
                match &event.change {
                    Change::Object(name) => (now.object, now.group) = (name_of(name), String::new()),
                    // What most exporters write for "no group".
                    Change::Group(name) if name == b"default" => now.group = String::new(),
                    Change::Group(name) => now.group = name_of(name),
                    Change::Smooth(group) => now.smooth = *group,
                    Change::Library(name) => self.libraries.push((name_of(name), event.offset)),
                    Change::Material(name) => {
                        let name = name_of(name);
                        now.material = Some(*by_name.entry(name).or_insert_with_key(|name| {
                            self.materials.push((name.clone(), event.offset));
                            self.materials.len() - 1
                        }));
                    }
                }
            }
            add(&now, begin..piece.ends.len(), &mut self.parts);
        }
    }
}

/// What the next face belongs to.
#[derive(Default)]
struct State {
    object: String,
    group: String,
    material: Option<usize>,
    smooth: u32,
}

impl State {
    fn name(&self) -> String {
        match (self.object.as_str(), self.group.as_str()) {
            (object, "") => object.to_owned(),
            ("", group) => group.to_owned(),
            (object, group) => format!("{object}/{group}"),
        }
    }
}

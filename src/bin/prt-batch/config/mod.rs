//! Config files: options of `render` for a whole run and for single files, and inputs, in TOML.
//!
//! Every option becomes the argument that one would type for it ([`layer`]), so values are checked by the definition in
//! `args` alone.

mod layer;
mod pattern;
mod value;

pub use layer::{Definition, Given, Layer};

use crate::unbuilt;
use crate::words::nearest;
use pattern::FilePattern;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// What a config file says.
#[derive(Debug)]
pub struct Config {
    /// What is to be rendered if nothing is named on the command line: files, folders and patterns.
    pub inputs: Vec<PathBuf>,
    /// Options for all files.
    pub top: Layer,
    /// Options for some; later ones win.
    pub blocks: Vec<Block>,
}

/// A `[[file]]` block.
#[derive(Debug)]
pub struct Block {
    /// `FILE:LINE:COLUMN` of its patterns, and they themselves, for messages.
    pub place: String,
    patterns: Vec<FilePattern>,
    /// Its options.
    pub options: Layer,
}

impl Block {
    /// Whether the block is about the input `path`.
    pub fn is_about(&self, path: &Path) -> bool {
        self.patterns.iter().any(|pattern| pattern.matches(path))
    }
}

impl Config {
    /// The config in `file`; paths in it are relative to its folder.
    ///
    /// # Errors
    /// It cannot be read, or says something that it may not: the text has the place and what is allowed.
    pub fn read(file: &Path, definition: &Definition) -> Result<Self, String> {
        let at = file.display();
        let bytes = std::fs::read(file).map_err(|error| match error.kind() {
            std::io::ErrorKind::NotFound => format!("--config {at}: there is no such file"),
            _ => format!("--config {at}: cannot be read: {error}"),
        })?;
        let text = std::str::from_utf8(&bytes).map_err(|error| {
            let line = 1 + bytes[..error.valid_up_to()].iter().filter(|byte| **byte == b'\n').count();
            format!("{at}:{line}: this line is not UTF-8\n  Save the file as UTF-8.")
        })?;
        Reader { file, text, definition }.config()
    }
}

/// Reads one file.
struct Reader<'a> {
    file: &'a Path,
    text: &'a str,
    definition: &'a Definition,
}

/// A key with its value, both with their places.
type Entry<'t> = (Spanned<std::borrow::Cow<'t, str>>, Spanned<DeValue<'t>>);

/// The entries of a table in the order of the file.
fn in_order(table: DeTable<'_>) -> Vec<Entry<'_>> {
    let mut entries: Vec<_> = table.into_iter().collect();
    entries.sort_by_key(|(key, _)| key.span().start);
    entries
}

impl Reader<'_> {
    fn config(&self) -> Result<Config, String> {
        let table = DeTable::parse(self.text).map_err(|error| {
            let place = self.place(error.span().map_or(0, |span| span.start));
            format!("{place}: {}", error.message().trim_end())
        })?;
        let (mut inputs, mut blocks, mut options) = (Vec::new(), Vec::new(), Vec::new());
        for (key, value) in in_order(table.into_inner()) {
            match (key.get_ref().as_ref(), value.get_ref()) {
                ("inputs", _) => inputs = self.inputs(&value)?,
                ("file", DeValue::Array(_)) => {
                    let DeValue::Array(list) = value.into_inner() else { unreachable!("matched above") };
                    for block in list {
                        blocks.push(self.block(block)?);
                    }
                }
                ("file", _) => {
                    let place = self.place(key.span().start);
                    return Err(format!("{place}: file must be a block with two brackets on either side: [[file]]"));
                }
                _ => options.push(self.option(&key, &value)?),
            }
        }
        Ok(Config { inputs, blocks, top: self.layer(options)? })
    }

    /// Files, folders and patterns, relative to the file's folder.
    fn inputs(&self, value: &Spanned<DeValue<'_>>) -> Result<Vec<PathBuf>, String> {
        let texts = self.strings(value, "inputs", "inputs = [\"scenes/*.gltf\"]")?;
        Ok(texts.into_iter().map(|(text, _)| self.folder().join(text)).collect())
    }

    /// One string or several, with their places.
    fn strings(&self, value: &Spanned<DeValue<'_>>, key: &str, example: &str) -> Result<Vec<(String, String)>, String> {
        let wrong =
            |at: usize| format!("{}: {key} must be a string or a list of strings, such as {example}", self.place(at));
        let start = value.span().start;
        let one = |value: &Spanned<DeValue<'_>>| match value.get_ref() {
            DeValue::String(text) if !text.is_empty() => Ok((text.to_string(), self.place(value.span().start))),
            _ => Err(wrong(value.span().start)),
        };
        match value.get_ref() {
            DeValue::Array(list) if !list.is_empty() => list.iter().map(one).collect(),
            DeValue::String(_) => Ok(vec![one(value)?]),
            _ => Err(wrong(start)),
        }
    }

    fn block(&self, block: Spanned<DeValue<'_>>) -> Result<Block, String> {
        const EXAMPLE: &str = "match = \"lamps/*.gltf\"";
        let start = block.span().start;
        let DeValue::Table(table) = block.into_inner() else {
            return Err(format!("{}: file must be a block: [[file]]", self.place(start)));
        };
        let (mut patterns, mut options, mut place) = (Vec::new(), Vec::new(), String::new());
        for (key, value) in in_order(table) {
            let (name, at) = (key.get_ref().as_ref(), self.place(key.span().start));
            if name == "match" {
                let texts = self.strings(&value, "match", EXAMPLE)?;
                let list: Vec<_> = texts.iter().map(|(text, _)| format!("{text:?}")).collect();
                place = format!("{at}: match = {}", list.join(", "));
                for (text, at) in texts {
                    let pattern = FilePattern::new(&text, self.folder());
                    patterns.push(pattern.map_err(|why| format!("{at}: match = {text:?}: {why}"))?);
                }
            } else if name == "inputs" || self.definition.is_for_the_run(name) {
                return Err(format!(
                    "{at}: {name} holds for the whole run and cannot differ between files\n  \
                     Put it above the first [[file]]."
                ));
            } else {
                options.push(self.option(&key, &value)?);
            }
        }
        if patterns.is_empty() {
            let place = self.place(start);
            return Err(format!("{place}: this [[file]] does not say which files it is about\n  Add {EXAMPLE}."));
        }
        Ok(Block { place, patterns, options: self.layer(options)? })
    }

    /// An option as it would be typed, its value checked.
    fn option(&self, key: &Spanned<std::borrow::Cow<'_, str>>, value: &Spanned<DeValue<'_>>) -> Result<Given, String> {
        let (name, at) = (key.get_ref().as_ref(), self.place(key.span().start));
        let Some(arg) = self.definition.option(name) else { return Err(format!("{at}: {}", self.unknown(name))) };
        if name == "config" {
            return Err(format!("{at}: a config file cannot name another"));
        }
        let shown = match value.get_ref() {
            // Its keys may stand anywhere.
            DeValue::Table(_) => format!("{at}: {name}"),
            _ => format!("{at}: {name} = {}", self.text[value.span()].lines().next().unwrap_or_default()),
        };
        let typed = value::typed(arg, value.get_ref()).map_err(|why| format!("{shown}\n  {why}"))?;
        let args = typed.map(|typed| match typed {
            None => OsString::from(format!("--{name}")),
            Some(text) => {
                let mut argument = OsString::from(format!("--{name}="));
                argument.push(if layer::is_path(arg) {
                    self.folder().join(text).into_os_string()
                } else {
                    text.into()
                });
                argument
            }
        });
        if let Some(argument) = &args {
            self.definition.check(argument).map_err(|why| format!("{shown}\n  {why}"))?;
        }
        Ok(Given { name: name.to_owned(), argument: args, place: Some(at) })
    }

    /// Why `name` is no option.
    fn unknown(&self, name: &str) -> String {
        if unbuilt::is_unbuilt(name) {
            return format!("{name} is not built yet; docs/cli.md says what is");
        }
        let short = || self.definition.long_of(name);
        let known = self.definition.names().chain(["inputs", "file"]);
        match short().or_else(|| nearest(&name.replace('_', "-"), known)) {
            Some(meant) => format!("there is no option {name}\n  Did you mean {meant}?"),
            None => {
                format!("there is no option {name}\n  Allowed are the long names in prt-batch --help, without dashes.")
            }
        }
    }

    /// `options` as one layer, in which none may contradict another.
    fn layer(&self, options: Vec<Given>) -> Result<Layer, String> {
        for (i, one) in options.iter().enumerate() {
            for other in &options[..i] {
                if self.definition.exclude_each_other(one, other) {
                    let (at, earlier) = (one.place.as_deref().unwrap_or_default(), other.place.as_deref());
                    return Err(format!(
                        "{at}: {} cannot be used with {}, which is at {}\n  Remove one of them.",
                        one.name,
                        other.name,
                        earlier.unwrap_or_default()
                    ));
                }
            }
        }
        Ok(Layer(options))
    }

    fn folder(&self) -> &Path {
        self.file.parent().unwrap_or(Path::new(""))
    }

    /// `FILE:LINE:COLUMN` of the byte `at`, both from 1, columns in characters.
    fn place(&self, at: usize) -> String {
        let before = &self.text[..at.min(self.text.len())];
        let line = 1 + before.matches('\n').count();
        let column = 1 + before[before.rfind('\n').map_or(0, |end| end + 1)..].chars().count();
        format!("{}:{line}:{column}", self.file.display())
    }
}

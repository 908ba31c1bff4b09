//! URIs to bytes or to files that may be read: relative paths below the input's own folder (or `--asset-root`).

use super::document::Document;
use super::locate::shorten;
use super::{Result, base64};
use std::borrow::Cow;
use std::path::PathBuf;

/// Where URIs may lead.
pub(super) use crate::load::folders::Folders as Resolver;

/// What a URI stands for.
pub(super) enum Source {
    /// The payload of a data URI and its media type (may be empty).
    Data(Vec<u8>, String),
    /// A file that may be read.
    File(PathBuf),
}

impl Document {
    /// What the URI at `pointer` stands for. A file is proven to lie in an allowed folder, links followed.
    pub fn resolve(&self, pointer: &str, uri: &str) -> Result<Source> {
        if uri.get(..5).is_some_and(|s| s.eq_ignore_ascii_case("data:")) {
            return self.data_uri(pointer, uri.get(5..).unwrap_or_default());
        }
        let refuse = |why: &str, fix: &str| Err(self.error(pointer, format!("\"{}\" {why}", shorten(uri)), fix));
        const RELATIVE: &str = "Only relative paths below the file's own folder are read, or below --asset-root DIR.";
        if uri.is_empty() {
            return refuse("is empty", RELATIVE);
        }
        if let Some(scheme) = scheme(uri) {
            return refuse(&format!("has the scheme \"{scheme}:\""), RELATIVE);
        }
        let path = match percent_decode(uri) {
            Ok(path) => path,
            Err(why) => return refuse(&why, "Write %25 for a percent sign."),
        };
        if path.contains('\\') {
            return refuse("has a backslash", "Separate folders with / in a URI.");
        }
        if path.contains('\0') {
            return refuse("has a zero byte", RELATIVE);
        }
        if path.starts_with('/') || scheme(&path).is_some() {
            return refuse("is absolute", RELATIVE);
        }
        let found = self.uris.confine(&path);
        found.map(Source::File).map_err(|r| self.error(pointer, format!("\"{}\" {}", shorten(uri), r.problem), r.fix))
    }

    /// `[type][;parameters][;base64],payload` (RFC 2397).
    fn data_uri(&self, pointer: &str, rest: &str) -> Result<Source> {
        let fail = |why: String| {
            let fix = "Allowed is data:[type];base64,DATA with padded base64, or data:[type],TEXT with %xx for bytes.";
            self.error(pointer, format!("data URI: {why}"), fix)
        };
        let Some((head, payload)) = rest.split_once(',') else {
            return Err(fail(format!("no comma in \"{}\"", shorten(rest))));
        };
        let mut parts = head.split(';');
        let media = parts.next().unwrap_or_default().to_owned();
        // Large payloads are base64 without escapes: those are not copied first.
        let bytes = match payload.contains('%') {
            true => Cow::Owned(percent_bytes(payload).map_err(fail)?),
            false => Cow::Borrowed(payload.as_bytes()),
        };
        let bytes = match parts.any(|p| p.eq_ignore_ascii_case("base64")) {
            true => base64::decode(&bytes).map_err(fail)?,
            false => bytes.into_owned(),
        };
        Ok(Source::Data(bytes, media))
    }
}

/// The scheme of a URI (RFC 3986, section 3.1), if it has one. A drive letter counts as one.
fn scheme(uri: &str) -> Option<&str> {
    let (scheme, _) = uri.split_once(':')?;
    let letters = scheme.starts_with(|c: char| c.is_ascii_alphabetic());
    (letters && scheme.chars().all(|c| c.is_ascii_alphanumeric() || "+-.".contains(c))).then_some(scheme)
}

/// The text with `%xx` replaced by bytes, which must be UTF-8.
pub(super) fn percent_decode(uri: &str) -> std::result::Result<String, String> {
    String::from_utf8(percent_bytes(uri)?).map_err(|_| "is not UTF-8 when its %xx are replaced".into())
}

/// The bytes of the text, with `%xx` replaced.
fn percent_bytes(uri: &str) -> std::result::Result<Vec<u8>, String> {
    let mut out = Vec::with_capacity(uri.len());
    let mut bytes = uri.bytes();
    while let Some(byte) = bytes.next() {
        if byte != b'%' {
            out.push(byte);
            continue;
        }
        let mut digit = || bytes.next().and_then(|c| char::from(c).to_digit(16));
        match (digit(), digit()) {
            (Some(high), Some(low)) => out.push((high * 16 + low) as u8),
            _ => return Err("has a % that no two hexadecimal digits follow".into()),
        }
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percent_escapes_decode_to_utf8_or_fail() {
        assert_eq!(percent_decode("a%20b%C3%A9.png").unwrap(), "a b\u{e9}.png");
        for bad in ["%", "%4", "%zz", "%ff"] {
            assert!(percent_decode(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn schemes_are_told_from_file_names() {
        assert_eq!(scheme("http://x/y"), Some("http"));
        assert_eq!(scheme("C:/x"), Some("C"));
        assert_eq!(scheme("a b:c.png"), None);
        assert_eq!(scheme("x.png"), None);
    }
}

//! The contact sheet of a run, `index.html`: every picture with what is to be said about it, failures first.
//!
//! One file that needs nothing but the pictures beside it: no script, no font, no network. Links are relative to the
//! output folder, so that the folder may be moved or zipped. Written by hand rather than by a template crate: it is one
//! page, and `Escaped` is all that such a crate would add.

use super::report::{BatchReport, ImageReport, Status, seconds};
use std::fmt::{self, Display, Write};
use std::path::{Component, Path};

/// The page about `report`, whose pictures lie below `out`: a function of the report alone.
pub fn report(report: &BatchReport, out: &Path) -> String {
    let mut page = String::new();
    page_to(&mut page, report, out).expect("a string takes whatever is written");
    page
}

fn page_to(page: &mut String, report: &BatchReport, out: &Path) -> fmt::Result {
    let counts = counts(report);
    let total = report.images.len();
    let images = if total == 1 { "1 image".to_owned() } else { format!("{total} images") };
    write!(
        page,
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta name=\"color-scheme\" content=\"light dark\">\n<title>{images}: {counts}</title>\n\
         <style>\n{STYLE}</style>\n</head>\n<body>\n<header>\n<h1>{images}: {counts}</h1>\n"
    )?;
    let accel: Vec<&str> =
        [&report.accel.used, &report.accel.version].into_iter().flatten().map(String::as_str).collect();
    let mut facts = vec![seconds(report.seconds), format!("started {}", report.started)];
    facts.push(match report.host.threads {
        1 => "1 thread".into(),
        threads => format!("{threads} threads"),
    });
    facts.extend(report.host.cpu.clone());
    facts.extend((!accel.is_empty()).then(|| format!("rays by {}", accel.join(" "))));
    facts.push(format!("prt-batch {}", report.prt));
    writeln!(page, "<p>{}</p>\n<p><code>{}</code></p>", Escaped(&facts.join(" · ")), Escaped(&report.command))?;
    writeln!(page, "<p><a href=\"batch.json\">batch.json</a></p>")?;

    // Ordered by the run, so that the page reads as its log did; what went wrong is listed on top, with links.
    let numbered = || report.images.iter().enumerate();
    let bad = || numbered().filter(|(_, image)| is_bad(image.status));
    if bad().next().is_some() {
        writeln!(page, "<section class=\"problems\">\n<h2>What went wrong</h2>\n<ul>")?;
        for (index, image) in bad() {
            let message = image.error_message.as_deref().unwrap_or(image.status.word());
            let first = message.lines().next().unwrap_or_default();
            writeln!(page, "<li><a href=\"#i{index}\">{}</a>: {}</li>", Escaped(&name(image, out)), Escaped(first))?;
        }
        writeln!(page, "</ul>\n</section>")?;
    }
    // Shown and hidden by the style sheet.
    let warned = report.images.iter().filter(|image| !image.warnings.is_empty()).count();
    for (id, label, count) in
        [("all", "all", total), ("bad", "not rendered", bad().count()), ("warned", "with warnings", warned)]
    {
        let checked = if id == "all" { " checked" } else { "" };
        writeln!(
            page,
            "<label><input type=\"radio\" name=\"show\" id=\"show-{id}\"{checked}> {label} ({count})</label>"
        )?;
    }
    writeln!(page, "</header>\n<main>")?;
    for (index, image) in numbered() {
        card_to(page, index, image, out)?;
    }
    writeln!(page, "</main>\n</body>\n</html>")
}

fn card_to(page: &mut String, index: usize, image: &ImageReport, out: &Path) -> fmt::Result {
    let status = image.status.word();
    let mut classes = status.replace(' ', "-");
    if is_bad(image.status) {
        classes += " bad";
    }
    if !image.warnings.is_empty() {
        classes += " warned";
    }
    let name = name(image, out);
    writeln!(page, "<article id=\"i{index}\" class=\"{classes}\">")?;
    let link = |path: &Option<String>| path.as_deref().and_then(|path| link(path, out));
    let (exr, png, json) = (link(&image.outputs.exr), link(&image.outputs.png), link(&image.outputs.json));
    if let Some(png) = &png {
        // Room for the picture before it is loaded. That of a window has another shape, which the style sheet lets it keep.
        let (width, height) = (image.width.unwrap_or_default(), image.height.unwrap_or_default());
        writeln!(
            page,
            "<a class=\"picture\" href=\"{png}\"><img src=\"{png}\" alt=\"{}\" width=\"{width}\" height=\"{height}\" \
             loading=\"lazy\" decoding=\"async\"></a>",
            Escaped(&name)
        )?;
    }
    writeln!(page, "<h2>{}</h2>", Escaped(&name))?;
    writeln!(page, "<p><strong class=\"status\">{status}</strong>{}</p>", Escaped(&facts(image)))?;
    if let Some(message) = &image.error_message {
        writeln!(page, "<pre>{}</pre>", Escaped(message))?;
    }
    if !image.warnings.is_empty() {
        writeln!(page, "<ul>")?;
        for warning in &image.warnings {
            writeln!(page, "<li>{}</li>", Escaped(warning))?;
        }
        writeln!(page, "</ul>")?;
    }
    let links: Vec<String> = [("EXR", exr), ("PNG", png), ("JSON", json)]
        .into_iter()
        .filter_map(|(kind, link)| Some(format!("<a href=\"{}\">{kind}</a>", link?)))
        .collect();
    if !links.is_empty() {
        writeln!(page, "<p>{}</p>", links.join(" "))?;
    }
    writeln!(page, "</article>")
}

/// ` · 1280×720 · 64 spp · 3.1 s · 82 Mray/s · camera Main`, as far as it is known.
fn facts(image: &ImageReport) -> String {
    let mut facts = Vec::new();
    if let (Some(width), Some(height)) = (image.width, image.height) {
        facts.push(format!("{width}×{height}"));
        facts.push(format!("{} spp", image.spp));
    }
    facts.push(seconds(image.seconds.total));
    if let Some(speed) = image.mrays_per_s {
        facts.push(if speed < 10.0 { format!("{speed:.2} Mray/s") } else { format!("{speed:.0} Mray/s") });
    }
    facts.extend(image.estimated_error.as_ref().map(|error| format!("error {}", error.percent())));
    facts.extend(image.camera.as_ref().map(|camera| format!("camera {camera}")));
    facts.extend(image.frame.map(|frame| format!("frame {frame}")));
    facts.iter().fold(String::new(), |line, fact| line + " · " + fact)
}

/// The stem of the image's files below `out`, else its input.
fn name(image: &ImageReport, out: &Path) -> String {
    let outputs = [&image.outputs.png, &image.outputs.exr, &image.outputs.json];
    let stem = outputs.into_iter().flatten().find_map(|path| {
        let below = Path::new(path).strip_prefix(out).ok()?.with_extension("");
        Some(below.display().to_string())
    });
    stem.unwrap_or_else(|| image.input.clone())
}

/// The relative link to `path` below `out`, percent-encoded and so free of anything HTML would read; `None` for a path
/// that lies elsewhere.
fn link(path: &str, out: &Path) -> Option<String> {
    let mut link = String::new();
    for component in Path::new(path).strip_prefix(out).ok()?.components() {
        let Component::Normal(name) = component else { return None };
        if !link.is_empty() {
            link.push('/');
        }
        for byte in name.to_str()?.bytes() {
            // What RFC 3986 leaves unreserved, section 2.3.
            if byte.is_ascii_alphanumeric() || b"-._~".contains(&byte) {
                link.push(char::from(byte));
            } else {
                write!(link, "%{byte:02X}").ok()?;
            }
        }
    }
    (!link.is_empty()).then_some(link)
}

fn is_bad(status: Status) -> bool {
    matches!(status, Status::Failed | Status::Interrupted)
}

fn counts(report: &BatchReport) -> String {
    let some = report.counts.iter().filter(|(_, count)| **count > 0);
    let list: Vec<_> = some.map(|(status, count)| format!("{count} {}", status.word())).collect();
    if list.is_empty() { "nothing to do".into() } else { list.join(", ") }
}

/// Text as HTML shows it, in elements and in quoted attributes. Control characters, which HTML has no way to write,
/// become U+FFFD; line ends and tabs stay.
struct Escaped<'a>(&'a str);

impl Display for Escaped<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for c in self.0.chars() {
            match c {
                '&' => f.write_str("&amp;")?,
                '<' => f.write_str("&lt;")?,
                '>' => f.write_str("&gt;")?,
                '"' => f.write_str("&quot;")?,
                '\'' => f.write_str("&#39;")?,
                '\n' | '\t' => f.write_char(c)?,
                c if c.is_control() => f.write_char('\u{FFFD}')?,
                c => f.write_char(c)?,
            }
        }
        Ok(())
    }
}

/// Cards off the screen are not laid out (`content-visibility`), which keeps long pages quick.
const STYLE: &str = "\
:root { color-scheme: light dark; --back: #f4f4f5; --card: #fff; --text: #18181b; --soft: #5b5b66; --line: #d4d4d8;
  --bad: #b91c1c; --warn: #92600a; --link: #1d4ed8; }
@media (prefers-color-scheme: dark) { :root { --back: #141416; --card: #1f1f23; --text: #ececf0; --soft: #a1a1aa;
  --line: #3a3a42; --bad: #f87171; --warn: #e0b050; --link: #8ab4ff; } }
* { box-sizing: border-box; }
body { margin: 0; padding: 1.5rem; background: var(--back); color: var(--text);
  font: 15px/1.45 system-ui, sans-serif; overflow-wrap: anywhere; }
a { color: var(--link); }
h1 { font-size: 1.4rem; margin: 0 0 .3rem; }
h2 { font-size: 1rem; margin: .5rem 0 .2rem; }
p, ul { margin: .2rem 0; }
header { margin-bottom: 1.2rem; }
header p { color: var(--soft); }
header label { display: inline-block; margin: .6rem 1rem 0 0; }
.problems { margin: 1rem 0; padding: .2rem 1rem .6rem; border-left: .3rem solid var(--bad); background: var(--card); }
main { display: grid; grid-template-columns: repeat(auto-fill, minmax(min(20rem, 100%), 1fr)); gap: 1rem;
  align-items: start; }
article { background: var(--card); border: 1px solid var(--line); border-radius: .4rem; padding: .8rem;
  font-size: .87rem; content-visibility: auto; contain-intrinsic-size: auto 20rem; }
article p { color: var(--soft); }
article ul { color: var(--warn); padding-left: 1.1rem; }
article:target { outline: .2rem solid var(--link); }
.bad { border: 2px solid var(--bad); }
.bad .status { color: var(--bad); }
.picture { display: block; margin: -.8rem -.8rem 0; }
img { display: block; width: 100%; height: auto; max-height: 30rem; object-fit: contain;
  border-radius: .3rem .3rem 0 0; background: #808080; }
pre { margin: .4rem 0; padding: .5rem; white-space: pre-wrap; border: 1px solid var(--line); border-radius: .3rem;
  font-size: .8rem; }
body:has(#show-bad:checked) article:not(.bad, :target),
body:has(#show-warned:checked) article:not(.warned, :target) { display: none; }
";

#[cfg(test)]
#[path = "html_tests.rs"]
mod tests;

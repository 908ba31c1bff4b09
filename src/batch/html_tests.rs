//! Tests of the contact sheet. What a browser makes of it was looked at once; here its text is.

use super::*;
use crate::batch::report::{Accel, Host, Outputs, Seconds};

fn outputs(stem: &str) -> Outputs {
    let file = |extension: &str| Some(format!("renders/{stem}.{extension}"));
    Outputs { exr: file("exr"), png: file("png"), json: file("json") }
}

fn rendered(stem: &str) -> ImageReport {
    ImageReport {
        input: format!("scenes/{stem}.gltf"),
        status: Status::Rendered,
        outputs: outputs(stem),
        width: Some(320),
        height: Some(180),
        spp: 64,
        seconds: Seconds { total: 3.12, ..Seconds::default() },
        mrays_per_s: Some(81.6),
        ..ImageReport::default()
    }
}

fn failed(input: &str, message: &str) -> ImageReport {
    ImageReport { input: input.into(), error_message: Some(message.into()), ..ImageReport::default() }
}

fn batch(images: Vec<ImageReport>) -> BatchReport {
    let count = |status| images.iter().filter(|image| image.status == status).count();
    BatchReport {
        prt: "1.2.3",
        command: "prt-batch 'a & b.gltf'".into(),
        started: "2026-01-31T23:59:59Z".into(),
        seconds: 3723.0,
        host: Host { cpu: Some("Some CPU".into()), threads: 8 },
        accel: Accel { used: Some("embree".into()), version: Some("4.4.0".into()), ..Accel::default() },
        counts: Status::ALL.iter().map(|&status| (status, count(status))).collect(),
        images,
    }
}

fn page(images: Vec<ImageReport>) -> String {
    report(&batch(images), Path::new("renders"))
}

/// The card of image `index`.
fn card(page: &str, index: usize) -> &str {
    let start = page.find(&format!("<article id=\"i{index}\"")).expect("a card for every image");
    &page[start..start + page[start..].find("</article>").expect("its end")]
}

/// Panics unless every element that is opened is closed in turn, and no attribute breaks out of its quotes.
fn assert_well_formed(page: &str) {
    const VOID: [&str; 4] = ["meta", "img", "input", "!DOCTYPE"];
    let (mut open, mut rest) = (Vec::new(), page);
    while let Some(start) = rest.find('<') {
        let tag = &rest[start + 1..];
        let end = tag.find('>').expect("a tag ends");
        let inside = &tag[..end];
        assert!(!inside.contains('<'), "{inside}");
        let name = inside.split(' ').next().unwrap();
        match name.strip_prefix('/') {
            Some(name) => assert_eq!(open.pop(), Some(name), "{inside}"),
            None if VOID.contains(&name) => {}
            None => open.push(name),
        }
        assert_eq!(inside.matches('"').count() % 2, 0, "{inside}");
        rest = &tag[end + 1..];
        if name == "style" {
            rest = &rest[rest.find("</style>").expect("the style sheet ends")..];
        }
    }
    assert_eq!(open, Vec::<&str>::new());
}

#[test]
fn heading_has_counts_time_and_command() {
    let page = page(vec![rendered("a"), rendered("b"), failed("c.gltf", "no")]);
    assert!(page.contains("<h1>3 images: 2 rendered, 1 failed</h1>"), "{page}");
    for part in ["1 h 02 min", "8 threads", "Some CPU", "rays by embree 4.4.0", "prt-batch &#39;a &amp; b.gltf&#39;"] {
        assert!(page.contains(part), "{part}: {page}");
    }
    assert_well_formed(&page);
    assert_eq!(page, report(&batch(vec![rendered("a"), rendered("b"), failed("c.gltf", "no")]), Path::new("renders")));
}

#[test]
fn a_card_shows_the_picture_and_what_is_known() {
    let mut image = rendered("sub/a");
    image.camera = Some("Main".into());
    image.warnings = vec!["first".into(), "second <b>".into()];
    let page = page(vec![image]);
    let card = card(&page, 0);
    for part in [
        "<img src=\"sub/a.png\" alt=\"sub/a\" width=\"320\" height=\"180\" loading=\"lazy\"",
        "<h2>sub/a</h2>",
        "rendered</strong> · 320×180 · 64 spp · 3.1 s · 82 Mray/s · camera Main",
        "<li>first</li>\n<li>second &lt;b&gt;</li>",
        "<a href=\"sub/a.exr\">EXR</a> <a href=\"sub/a.png\">PNG</a> <a href=\"sub/a.json\">JSON</a>",
    ] {
        assert!(card.contains(part), "{part}: {card}");
    }
    assert!(!page.contains("What went wrong"));
    assert_well_formed(&page);
}

#[test]
fn failures_come_first_and_lead_to_their_card() {
    let page = page(vec![rendered("a"), failed("in/b.gltf", "in/b.gltf: /meshes/0 = 7\n  must be below 3")]);
    let listed = page.find("<li><a href=\"#i1\">in/b.gltf</a>: in/b.gltf: /meshes/0 = 7</li>").unwrap();
    assert!(listed < page.find("<article").unwrap());
    let card = card(&page, 1);
    assert!(card.contains("class=\"failed bad\"") && card.contains("  must be below 3</pre>"), "{card}");
    assert!(!card.contains("<img"), "{card}");
    assert!(page.contains("not rendered (1)"));
    assert_well_formed(&page);
}

#[test]
fn hostile_names_stay_text_and_links_stay_links() {
    let stem = "a b/<i>&\"quotes\"'ü光#?%:\u{1}";
    let mut image = rendered(stem);
    image.camera = Some("</h2><script>alert(1)</script>".into());
    let page = page(vec![image, failed("x\"onload=\"y", "</pre><script>")]);
    assert!(!page.contains("<script") && !page.contains("<i>") && !page.contains("onload=\"y\""), "{page}");
    let link = "a%20b/%3Ci%3E%26%22quotes%22%27%C3%BC%E5%85%89%23%3F%25%3A%01.png";
    assert!(page.contains(&format!("<a class=\"picture\" href=\"{link}\"><img src=\"{link}\"")), "{page}");
    assert!(page.contains("<h2>a b/&lt;i&gt;&amp;&quot;quotes&quot;&#39;ü光#?%:\u{FFFD}</h2>"), "{page}");
    assert_well_formed(&page);
}

#[test]
fn links_are_relative_to_the_output_folder_however_it_is_written() {
    for (path, out, expected) in [
        ("renders/a.png", "renders", Some("a.png")),
        ("renders/a.png", "renders/", Some("a.png")),
        ("/srv/out/sub/a.png", "/srv/out", Some("sub/a.png")),
        ("./a.png", ".", Some("a.png")),
        ("a.png", "", Some("a.png")),
        ("/elsewhere/a.png", "renders", None),
        ("renders/../a.png", "renders", None),
        ("renders", "renders", None),
    ] {
        assert_eq!(link(path, Path::new(out)).as_deref(), expected, "{path} below {out}");
    }
    // Absolute paths of the machine are in the report's own words only.
    let mut image = rendered("a");
    image.outputs = Outputs { png: Some("/srv/secret/a.png".into()), ..Outputs::default() };
    assert!(!report(&batch(vec![image]), Path::new("renders")).contains("/srv/secret"));
}

#[test]
fn a_run_without_images_and_one_of_five_hundred_have_a_page() {
    let page = page(vec![]);
    assert!(page.contains("<h1>0 images: nothing to do</h1>"));
    assert_well_formed(&page);
    let many = report(&batch((0..500).map(|i| rendered(&format!("s{i}"))).collect()), Path::new("renders"));
    assert_eq!(many.matches("<article").count(), 500);
    assert!(many.len() < 500_000, "{}", many.len());
    assert_well_formed(&many);
}

#[test]
fn seconds_read_well_at_every_length() {
    for (value, text) in
        [(0.0123, "12 ms"), (3.12, "3.1 s"), (99.9, "99.9 s"), (119.7, "2 min 00 s"), (3599.6, "1 h 00 min")]
    {
        assert_eq!(seconds(value), text);
    }
}

//! `docs/stress-tests.md` names tests that exist.

use std::fs;
use std::path::Path;

#[test]
fn every_test_in_the_table_exists_and_every_id_has_a_row() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let table = fs::read_to_string(root.join("docs/stress-tests.md")).expect("the table");
    let mut ids = Vec::new();
    let mut names = 0;
    for row in table.lines().filter(|line| line.starts_with("| ") && !line.starts_with("| ID")) {
        let cells: Vec<&str> = row.split('|').map(str::trim).collect();
        ids.push(cells[1].to_owned());
        // `tests/file.rs`: `name`, `name`; `tests/other.rs`: `name`
        let mut file = None;
        for word in cells[2].split('`').skip(1).step_by(2) {
            if word.ends_with(".rs") {
                file = Some((word, fs::read_to_string(root.join(word)).unwrap_or_else(|e| panic!("{word}: {e}"))));
            } else {
                let (path, text) = file.as_ref().expect("a file before the names of tests");
                assert!(text.contains(&format!("fn {word}(")), "{path} has no test {word} ({row})");
                names += 1;
            }
        }
    }
    let expected = [("GEO", 8), ("BVH", 8), ("SELF", 6), ("INST", 3)];
    let expected = expected.iter().flat_map(|(group, n)| (1..=*n).map(move |i| format!("{group}-{i:02}")));
    for id in expected {
        assert!(ids.contains(&id), "docs/stress-tests.md has no row {id}");
    }
    assert!(names > 30, "{names}");
}

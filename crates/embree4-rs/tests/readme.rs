//! The README's example is the one that is compiled, and does what it says; the run is skipped with a line where
//! there is no Embree.

use std::path::Path;

#[allow(dead_code, reason = "`main` reads the arguments of a program, which the test is not")]
#[path = "../examples/leaves.rs"]
mod leaves;

#[test]
fn the_example_of_the_readme_runs_and_is_the_file_in_examples() {
    let project = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../.embree");
    match leaves::trace(&project.to_string_lossy()).expect("the example fails") {
        Some(instances) => assert_eq!(instances, [0, u32::MAX, 1]),
        None => println!("skipped: no Embree library"),
    }
    let (readme, file) = (include_str!("../README.md"), include_str!("../examples/leaves.rs"));
    let code = file.split_once("\n\n").expect("the file begins with its documentation").1;
    assert!(readme.contains(code), "README.md does not hold examples/leaves.rs without its documentation");
}

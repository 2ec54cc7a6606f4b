//! The example in the README is the one that the documentation of the library compiles and runs.

const README: &str = include_str!("../../../README.md");
const LIBRARY: &str = include_str!("../src/lib.rs");

/// The lines of `text` between its first line `open` and the next line "```".
fn block<'a>(text: impl Iterator<Item = &'a str>, open: &str) -> Vec<&'a str> {
    text.skip_while(|line| *line != open).skip(1).take_while(|line| *line != "```").collect()
}

#[test]
fn the_readme_shows_the_example_that_is_tested() {
    let comment =
        |line: &'static str| line.strip_prefix("//!").map(|l| l.strip_prefix(' ').unwrap_or(l));
    let tested = block(LIBRARY.lines().map_while(comment), "```");
    let shown = block(README.lines(), "```rust");
    assert!(tested.len() > 9, "no example found in lib.rs");
    assert_eq!(shown, tested);
}

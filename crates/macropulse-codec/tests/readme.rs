//! The example in the README of the crate is the one that runs.

const README: &str = include_str!("../README.md");
const EXAMPLE: &str = include_str!("../examples/decode.rs");

#[test]
fn the_readme_shows_the_example() {
    let shown = README.split("```rust\n").nth(1).and_then(|rest| rest.split("```").next());
    let body = EXAMPLE.split_once("\n\n").map(|(_, body)| body);
    assert!(body.is_some_and(|body| body.lines().count() > 20));
    assert_eq!(shown, body);
}

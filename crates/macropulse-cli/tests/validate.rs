//! Published and forecast numbers beside computed ones, and the page of the guide on them.

#![allow(missing_docs, clippy::unwrap_used)]

use crate::common;

use common::Desk;

/// `docs/validation.md` is the output of the command. If the output changes, copy it:
/// `macropulse validate -o validation && cp validation/validation.md docs/`.
#[test]
#[ignore = "slow: before a release"]
fn the_page_of_the_guide_is_what_the_command_writes() {
    let desk = Desk::new();
    let ran = desk.run("validate -o out --json");
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    let here = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/validation.md");
    let page = std::fs::read_to_string(here).unwrap();
    let written = std::fs::read_to_string(desk.path().join("out/validation.md")).unwrap();
    for (page, written) in page.lines().zip(written.lines()) {
        assert_eq!(page, written, "docs/validation.md");
    }
    assert_eq!(page.lines().count(), written.lines().count());
    let told: serde_json::Value = serde_json::from_str(&ran.out).unwrap();
    assert!(told["published"].as_array().unwrap().len() >= 150);
    assert!(told["forecasts"].as_array().unwrap().len() >= 20);
    let html = std::fs::read_to_string(desk.path().join("out/index.html")).unwrap();
    assert!(html.contains("Published") || html.contains("published"));
}

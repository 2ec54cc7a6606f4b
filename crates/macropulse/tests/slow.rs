//! Slow tests run before a release: CONTRIBUTING.md lists each of them, and quicker tests of the same that run always.
#![allow(clippy::unwrap_used)]

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use macropulse_testbed::sources_below;

const SLOW: &str = "#[ignore = \"slow: before a release\"]";

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// The name of the function that is defined in `line`.
fn function(line: &str) -> Option<&str> {
    let name = line.trim().strip_prefix("fn ").or_else(|| line.trim().strip_prefix("pub fn "))?;
    name.split(['(', '<']).next()
}

/// Names of tests, and whether each is slow. Pages of the guide are tests that a macro makes.
fn tests() -> BTreeMap<String, bool> {
    let mut tests = BTreeMap::new();
    for file in sources_below(&root().join("crates")) {
        let text = fs::read_to_string(file).unwrap();
        let mut is_slow = None;
        for line in text.lines() {
            match line.trim() {
                "#[test]" => is_slow = Some(false),
                SLOW if is_slow.is_some() => is_slow = Some(true),
                line => {
                    if let Some(name) = function(line)
                        && let Some(is_slow) = is_slow.take()
                    {
                        tests.insert(name.to_owned(), is_slow);
                    }
                }
            }
        }
    }
    let guide = root().join("crates/macropulse-cli/tests/guide/main.rs");
    let guide = fs::read_to_string(guide).unwrap();
    let pages = guide.split_once("pages! {\n").unwrap().1.split_once("\n}\n").unwrap().0;
    let (quick, slow) = pages.split_once("    slow {\n").unwrap();
    for (pages, is_slow) in [(quick, false), (slow, true)] {
        let names = pages.lines().filter_map(|page| Some(page.split_once(": \"")?.0.trim()));
        tests.extend(names.map(|name| (name.to_owned(), is_slow)));
    }
    tests
}

/// Names between backquotes, modules left out.
fn names(cell: &str) -> Vec<String> {
    let quoted = cell.split('`').skip(1).step_by(2);
    quoted.map(|name| name.rsplit("::").next().unwrap().to_owned()).collect()
}

#[test]
fn slow_tests_are_listed_with_quicker_ones_of_the_same() {
    let tests = tests();
    let text = fs::read_to_string(root().join("CONTRIBUTING.md")).unwrap();
    let part = text.split_once("### Before a release\n").unwrap().1.split("\n#").next().unwrap();
    let rows = part.lines().filter(|line| line.starts_with("| `"));
    let mut listed = BTreeSet::new();
    for row in rows {
        let cells: Vec<&str> = row.split('|').map(str::trim).collect();
        let [_, slow, _, quick, _] = cells[..] else { panic!("{row}") };
        let quick = names(quick);
        assert!(!quick.is_empty(), "{row}");
        for name in quick {
            assert_eq!(tests.get(&name), Some(&false), "{name} is no test that runs always");
        }
        listed.extend(names(slow));
    }
    let slow = tests.into_iter().filter(|(_, is_slow)| *is_slow).map(|(name, _)| name);
    assert_eq!(listed, slow.collect::<BTreeSet<_>>());
    assert!(listed.len() > 5, "{listed:?}");
}

//! Each target is given its corpus, and what the mutator makes of it: a short run of the fuzzers on
//! any machine. `MACROPULSE_FUZZ_CASES` sets the number of inputs made for each target, and
//! `MACROPULSE_FUZZ_SEED` others than those of every day.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

use macropulse_fuzz::mutate::Mutator;
use macropulse_fuzz::{TARGETS, Target, target};

/// Inputs made for each target.
const CASES: u64 = 150;

fn set_in(variable: &str, usual: u64) -> u64 {
    std::env::var(variable).map_or(usual, |typed| typed.parse().unwrap())
}

fn folder(target: &Target) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/corpus").join(target.name)
}

fn corpus(target: &Target) -> Vec<Vec<u8>> {
    let entries = fs::read_dir(folder(target)).unwrap();
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    paths.iter().map(|path| fs::read(path).unwrap()).collect()
}

/// Runs the target, and keeps what it does not put up with.
fn run(target: &Target, bytes: &[u8]) {
    if catch_unwind(AssertUnwindSafe(|| (target.run)(bytes))).is_err() {
        let kept = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{}.crash", target.name));
        fs::write(&kept, bytes).unwrap();
        panic!("{}: see {}", target.name, kept.display());
    }
}

#[test]
fn every_target_puts_up_with_its_corpus_and_what_is_made_of_it() {
    let cases = set_in("MACROPULSE_FUZZ_CASES", CASES);
    let seed = set_in("MACROPULSE_FUZZ_SEED", 15);
    let only = std::env::var("MACROPULSE_FUZZ_TARGET").ok();
    for target in TARGETS.iter().filter(|one| only.as_deref().is_none_or(|only| only == one.name)) {
        let corpus = corpus(target);
        assert!(!corpus.is_empty(), "{}: no corpus", target.name);
        for bytes in &corpus {
            assert!(bytes.len() <= target.longest, "{}: a long input", target.name);
            run(target, bytes);
        }
        let mut mutator = Mutator::new(seed);
        for _ in 0..cases {
            run(target, &mutator.next(&corpus, target.longest));
        }
    }
}

#[test]
fn a_fuzzer_stands_for_every_target() {
    let fuzz = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz");
    let manifest = fs::read_to_string(fuzz.join("Cargo.toml")).unwrap();
    for target in TARGETS {
        assert!(manifest.contains(&format!("name = \"{}\"", target.name)), "{}", target.name);
        let body = fs::read_to_string(fuzz.join(format!("fuzz_targets/{}.rs", target.name)));
        assert!(body.unwrap().contains(&format!("\"{}\"", target.name)), "{}", target.name);
    }
    for entry in fs::read_dir(fuzz.join("corpus")).unwrap() {
        let name = entry.unwrap().file_name();
        assert!(target(name.to_str().unwrap()).is_some(), "{name:?} is the corpus of no target");
    }
}

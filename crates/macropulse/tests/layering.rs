//! The wall between truth and receiver, and the order of the stages, read off the source text.
//!
//! Every module of the library has a list of those it may name. Comments and strings are not
//! looked at: prose may speak of what lies beyond the wall.
#![allow(clippy::unwrap_used)]

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// A module, the modules of the library it may name, and why no others.
struct Rule {
    module: &'static str,
    may_name: &'static [&'static str],
    because: &'static str,
}

const RULES: [Rule; 19] = [
    Rule {
        module: "code",
        may_name: &[],
        because: "the language of both ends knows nothing of seconds, metres or light, and can \
                  become a crate of its own",
    },
    Rule {
        module: "design",
        may_name: &["code", "decode", "detect", "digest", "names", "units"],
        because: "a design says what the parts are set to, whatever they are pointed at",
    },
    Rule {
        module: "emit",
        may_name: &["design", "units"],
        because: "shots leave before anything is met",
    },
    Rule {
        module: "scene",
        may_name: &["design", "digest", "emit", "kernels", "names"],
        because: "surfaces do not know what their echoes become",
    },
    Rule {
        module: "channel",
        may_name: &["design", "emit", "scene", "units"],
        because: "light arrives whether or not it is detected",
    },
    Rule {
        module: "detect",
        may_name: &["channel", "design", "emit", "kernels", "random", "units"],
        because: "a detector sees light, not what reflected it, and is not told the truth",
    },
    Rule {
        module: "tdc",
        may_name: &["design", "detect", "kernels"],
        because: "a converter sees edges alone",
    },
    Rule {
        module: "decode",
        may_name: &["code", "emit", "kernels", "tdc", "units"],
        because: "the receiver knows ticks and what was fired, as the hardware would; fast loops \
                  know numbers alone",
    },
    Rule {
        module: "points",
        may_name: &["channel", "decode", "design", "emit", "units"],
        because: "points are made of returns; of the channel they know the link equation, which \
                  the sensor is calibrated by",
    },
    Rule {
        module: "score",
        may_name: &["channel", "design", "emit", "points", "scene", "units"],
        because: "the one stage that sees both sides compares points with surfaces and foreign light",
    },
    Rule {
        module: "formats",
        may_name: &["names", "points"],
        because: "files hold columns, no physics",
    },
    Rule { module: "view", may_name: &["points"], because: "pictures show columns, no physics" },
    Rule {
        module: "predict",
        may_name: &["channel", "code", "design", "units"],
        because: "an oracle that ran the simulation would agree with it whatever it did",
    },
    Rule {
        module: "sweep",
        may_name: &[
            "design", "digest", "emit", "formats", "names", "points", "scene", "score", "sim",
            "view",
        ],
        because: "a sweep repeats whole scans and counts; how one is made is no affair of its",
    },
    Rule {
        module: "random",
        may_name: &["kernels"],
        because: "chance is addressed, not drawn by a stage; the numbers come in wide loops",
    },
    Rule {
        module: "units",
        may_name: &["kernels"],
        because: "constants depend on nothing; whole columns are converted in a wide loop",
    },
    Rule { module: "kernels", may_name: &[], because: "a fast loop knows numbers alone" },
    Rule { module: "digest", may_name: &[], because: "a hash of bytes asks not whose they are" },
    Rule { module: "names", may_name: &[], because: "the likeness of words depends on nothing" },
];

/// Modules that put the others together and may name any.
const WHOLE: [&str; 3] = ["paper", "record", "sim"];

/// Modules that may name the type `Truth`: it is made, filled, and written beside the points.
const KNOW_THE_TRUTH: [&str; 6] = ["formats", "paper", "points", "record", "score", "sim"];

fn source_root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src")
}

/// Path and text of every source file of `module`.
fn sources(module: &str) -> Vec<(String, String)> {
    let mut found = Vec::new();
    let mut folders = vec![source_root().join(module)];
    let alone = source_root().join(format!("{module}.rs"));
    let mut files: Vec<PathBuf> = alone.is_file().then_some(alone).into_iter().collect();
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).into_iter().flatten() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|ending| ending == "rs") {
                files.push(path);
            }
        }
    }
    for path in files {
        let name = path.strip_prefix(source_root()).unwrap().display().to_string();
        found.push((name, fs::read_to_string(&path).unwrap()));
    }
    assert!(!found.is_empty(), "{module} has no source");
    found
}

/// The modules that the library's table of contents lists.
fn modules() -> Vec<String> {
    let contents = fs::read_to_string(source_root().join("lib.rs")).unwrap();
    let lines = contents.lines().map(|line| line.trim_start_matches("pub "));
    let listed = lines.filter_map(|line| line.strip_prefix("mod "));
    listed.map(|name| name.trim_end_matches(';').to_owned()).collect()
}

/// `text` without comments and string literals.
fn bare(text: &str) -> String {
    let mut code = String::new();
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        if rest.starts_with("//") {
            rest = &rest[rest.find('\n').unwrap_or(rest.len())..];
        } else if rest.starts_with("'\"'") {
            rest = &rest[3..];
        } else if first == '"' {
            rest = after_string(&rest[1..]);
        } else {
            code.push(first);
            rest = &rest[first.len_utf8()..];
        }
    }
    code
}

/// What follows the literal whose inside begins `rest`.
fn after_string(rest: &str) -> &str {
    let mut escaped = false;
    for (at, letter) in rest.char_indices() {
        match letter {
            '"' if !escaped => return &rest[at + 1..],
            _ => escaped = letter == '\\' && !escaped,
        }
    }
    ""
}

fn is_word(letter: char) -> bool {
    letter.is_alphanumeric() || letter == '_'
}

fn words(code: &str) -> impl Iterator<Item = &str> {
    code.split(|letter| !is_word(letter)).filter(|word| !word.is_empty())
}

/// The first names of all paths that begin with `root::`, those in braces included.
fn named_after<'a>(code: &'a str, root: &str) -> Vec<&'a str> {
    let mut names = Vec::new();
    for (at, _) in code.match_indices(root) {
        let before = code[..at].chars().next_back();
        let Some(rest) = code[at + root.len()..].strip_prefix("::") else { continue };
        if before.is_some_and(is_word) {
            continue;
        }
        match rest.strip_prefix('{') {
            None => names.push(first_name(rest)),
            Some(group) => names.extend(first_names_of_group(group)),
        }
    }
    names
}

fn first_name(path: &str) -> &str {
    if path.starts_with('*') {
        return "*";
    }
    &path[..path.find(|letter| !is_word(letter)).unwrap_or(path.len())]
}

/// The first name of each path in a group whose opening brace has been read.
fn first_names_of_group(group: &str) -> Vec<&str> {
    let (mut names, mut depth, mut starts) = (Vec::new(), 0, true);
    for (at, letter) in group.char_indices() {
        match letter {
            '}' if depth == 0 => break,
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => starts = true,
            _ if letter.is_whitespace() => {}
            _ if starts => {
                names.push(first_name(&group[at..]));
                starts = false;
            }
            _ => {}
        }
    }
    names
}

/// The modules among `known` that `text`, a source of `own`, names.
fn modules_named(text: &str, own: &str, known: &[String]) -> BTreeSet<String> {
    let code = bare(text);
    let from_root = named_after(&code, "crate").into_iter();
    let from_above = named_after(&code, "super").into_iter();
    // A path that climbs may end anywhere: only what is a module of the library counts.
    let climbed = from_above.filter(|name| known.iter().any(|module| module == name));
    let all = from_root.chain(climbed).filter(|name| *name != own);
    all.map(str::to_owned).collect()
}

/// What `text`, a source of the module of `rule`, names without leave.
fn breaches(text: &str, rule: &Rule, known: &[String]) -> Vec<String> {
    let named = modules_named(text, rule.module, known);
    named.into_iter().filter(|name| !rule.may_name.contains(&name.as_str())).collect()
}

#[test]
fn every_module_names_only_those_it_may() {
    let known = modules();
    for rule in &RULES {
        for (file, text) in sources(rule.module) {
            let breaches = breaches(&text, rule, &known);
            assert!(breaches.is_empty(), "{file} names {breaches:?}, but {}", rule.because);
        }
    }
}

#[test]
fn every_module_has_a_rule() {
    let ruled = RULES.iter().map(|rule| rule.module).chain(WHOLE);
    let mut ruled: Vec<String> = ruled.map(str::to_owned).collect();
    let mut listed = modules();
    ruled.sort();
    listed.sort();
    assert_eq!(ruled, listed);
}

/// A permission that nobody uses is a hole in the wall.
#[test]
fn every_permission_is_used() {
    let known = modules();
    for rule in &RULES {
        let used: BTreeSet<String> = sources(rule.module)
            .iter()
            .flat_map(|(_, text)| modules_named(text, rule.module, &known))
            .collect();
        for name in rule.may_name {
            assert!(used.contains(*name), "{} may name {name} but does not", rule.module);
        }
    }
}

#[test]
fn only_score_and_what_writes_its_results_name_the_truth() {
    for module in modules().iter().filter(|module| !KNOW_THE_TRUTH.contains(&module.as_str())) {
        for (file, text) in sources(module) {
            let named = words(&bare(&text)).any(|word| word == "Truth");
            assert!(!named, "{file} names Truth: a sensor that knows the truth measures nothing");
        }
    }
}

/// Crates that `code` may use: it is to become a codec of its own, for small machines.
const CRATES_OF_CODE: [&str; 3] = ["std", "serde", "thiserror"];

/// Words of the physical world, and the suffixes of its units.
const PHYSICAL: [&str; 7] =
    ["metre", "metres", "second", "seconds", "SPEED_OF_LIGHT", "tof", "nanoseconds"];
const UNIT_SUFFIXES: [&str; 6] = ["_fs", "_ps", "_ns", "_s", "_m", "_mm"];

fn physical(text: &str) -> Option<String> {
    let code = bare(text);
    let mut all = words(&code);
    let is_physical = |word: &&str| {
        PHYSICAL.contains(word) || UNIT_SUFFIXES.iter().any(|suffix| word.ends_with(suffix))
    };
    all.find(is_physical).map(str::to_owned)
}

/// The crate that a line of `use` brings in from outside, beyond those allowed.
fn foreign(text: &str) -> Option<String> {
    let code = bare(text);
    let uses = code.lines().filter_map(|line| line.trim().strip_prefix("use "));
    let own = ["crate", "super", "self"];
    let mut roots = uses.map(first_name);
    let is_foreign = |root: &&str| !own.contains(root) && !CRATES_OF_CODE.contains(root);
    // Tests may use what they like.
    let tests = ["approx", "proptest"];
    roots.find(|root| is_foreign(root) && !tests.contains(root)).map(str::to_owned)
}

#[test]
fn code_knows_chips_and_marks_alone() {
    for (file, text) in sources("code") {
        assert_eq!(physical(&text), None, "{file}: chips have no length at this level");
        assert_eq!(foreign(&text), None, "{file}: a codec depends on next to nothing");
    }
}

/// The checker reports a made-up offender, by every way of writing a path, and no prose.
#[test]
fn a_breach_is_found() {
    let known = modules();
    let decode = RULES.iter().find(|rule| rule.module == "decode").unwrap();
    let found = |text: &str| breaches(text, decode, &known).join(" ");
    assert_eq!(found("use crate::scene::Hits;"), "scene");
    assert_eq!(found("use crate::{code::Codebook, channel::{Link, Echoes}, sim};"), "channel sim");
    assert_eq!(found("use crate::{\n    emit::ShotLog,\n    score,\n};"), "score");
    assert_eq!(found("fn f(e: &super::super::detect::Edges) {}"), "detect");
    assert_eq!(found("use super::{Band, paper};"), "paper");
    assert_eq!(found("use crate::*;"), "*");
    assert_eq!(found("let q = '\"'; let s = \"a \\\" b\"; use crate::scene::Hits;"), "scene");
    assert_eq!(found("//! Not `crate::scene`.\nconst A: &str = \"crate::sim\";"), "");
    assert_eq!(found("use crate::emit::ShotLog;\nuse crate::decode::Reject;"), "");
    assert_eq!(physical("// seconds\nlet chip_fs = 1;"), Some("chip_fs".to_owned()));
    assert_eq!(physical("// metres\nlet chips = 1;"), None);
    assert_eq!(foreign("use std::fmt;\nuse libm::exp;"), Some("libm".to_owned()));
    assert!(words("cloud.truth: Truth").any(|word| word == "Truth"));
}

/// Unsafe code stands in one folder.
#[test]
fn only_kernels_are_unsafe() {
    for module in modules() {
        for (file, text) in sources(&module) {
            let is_unsafe = words(&bare(&text)).any(|word| word == "unsafe");
            assert!(!is_unsafe || module == "kernels", "{file}");
        }
    }
}

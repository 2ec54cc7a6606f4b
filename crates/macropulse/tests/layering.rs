//! The wall between truth and receiver, and the order of the stages, read off the source text.
//!
//! Every module of the library has a list of those it may name. Comments and strings are not
//! looked at: prose may speak of what lies beyond the wall.
#![allow(clippy::unwrap_used)]

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use macropulse_testbed::sources_below;

/// A module, the modules of its crate it may name, and why no others.
struct Rule {
    module: &'static str,
    may_name: &'static [&'static str],
    because: &'static str,
}

/// A crate of the workspace: the other crates of it that it may name, and its modules in an order
/// in which each may name only modules above it. So no modules can form a cycle.
struct Layers {
    folder: &'static str,
    may_name: &'static [&'static str],
    modules: &'static [Rule],
}

const CODEC: Layers = Layers {
    folder: "macropulse-codec",
    may_name: &[],
    modules: &[
        Rule { module: "kernels", may_name: &[], because: "a fast loop knows numbers alone" },
        Rule {
            module: "steps",
            may_name: &["kernels"],
            because: "steps of a receiver by themselves are its loops and nothing else",
        },
        Rule { module: "statistics", may_name: &[], because: "distributions depend on nothing" },
        Rule { module: "time", may_name: &[], because: "the unit of time depends on nothing" },
        Rule {
            module: "code",
            may_name: &[],
            because: "the language of both ends counts chips; it knows no seconds, metres or light",
        },
        Rule { module: "shot_log", may_name: &[], because: "the log is columns" },
        Rule { module: "ticks", may_name: &[], because: "ticks are columns" },
        Rule { module: "samples", may_name: &[], because: "samples are columns" },
        Rule { module: "histograms", may_name: &[], because: "histograms are columns" },
        Rule { module: "taps", may_name: &[], because: "taps are columns" },
        Rule { module: "beats", may_name: &[], because: "beats are columns" },
        Rule {
            module: "record",
            may_name: &["beats", "histograms", "samples", "taps", "ticks"],
            because: "a record is one of them",
        },
        Rule {
            module: "cut",
            may_name: &["shot_log"],
            because: "shots and ticks are cut by times alone",
        },
        Rule {
            module: "files",
            may_name: &[
                "beats",
                "cut",
                "histograms",
                "record",
                "samples",
                "shot_log",
                "taps",
                "ticks",
            ],
            because: "files hold shots and what was recorded of them, whoever made them and whatever decodes them",
        },
        Rule {
            module: "decode",
            may_name: &[
                "beats",
                "code",
                "histograms",
                "kernels",
                "record",
                "samples",
                "shot_log",
                "statistics",
                "taps",
                "ticks",
                "time",
            ],
            because: "a receiver knows its record and what was fired, as the hardware would",
        },
    ],
};

const SIMULATOR: Layers = Layers {
    folder: "macropulse",
    may_name: &["macropulse_codec"],
    modules: &[
        Rule { module: "kernels", may_name: &[], because: "a fast loop knows numbers alone" },
        Rule { module: "digest", may_name: &[], because: "a hash depends on bytes alone" },
        Rule { module: "machine", may_name: &[], because: "memory is there whatever it is for" },
        Rule { module: "processor", may_name: &[], because: "time passes whatever it is for" },
        Rule {
            module: "names",
            may_name: &[],
            because: "the likeness of words depends on nothing",
        },
        Rule {
            module: "told",
            may_name: &["names"],
            because: "the words of parsers are put into ours whatever is parsed",
        },
        Rule {
            module: "opened",
            may_name: &[],
            because: "what may be read is decided before anyone knows what it holds",
        },
        Rule {
            module: "schema",
            may_name: &["names", "told"],
            because: "what a file may say follows from its types, of which it knows none",
        },
        Rule {
            module: "random",
            may_name: &["kernels"],
            because: "random numbers are a function of their counter",
        },
        Rule {
            module: "units",
            may_name: &["kernels"],
            because: "constants depend on nothing; whole columns are converted in a wide loop",
        },
        Rule {
            module: "environment",
            may_name: &["names", "schema"],
            because: "sun and air are there whatever looks at them",
        },
        Rule {
            module: "design",
            may_name: &["digest", "environment", "names", "opened", "schema", "told", "units"],
            because: "a design is checked data: it imports no stage",
        },
        Rule {
            module: "emit",
            may_name: &["design", "units"],
            because: "shots leave before anything is met",
        },
        Rule {
            module: "scene",
            may_name: &[
                "design",
                "digest",
                "emit",
                "environment",
                "kernels",
                "names",
                "opened",
                "schema",
                "told",
                "units",
            ],
            because: "surfaces do not know what their echoes become",
        },
        Rule {
            module: "channel",
            may_name: &["design", "emit", "environment", "kernels", "random", "scene", "units"],
            because: "light arrives whether or not it is detected; how bright, speckle makes random",
        },
        Rule {
            module: "detect",
            may_name: &["channel", "design", "emit", "kernels", "random", "units"],
            because: "a detector sees light, not what reflected it, and is not told the truth",
        },
        Rule {
            module: "tdc",
            may_name: &["design", "detect", "kernels"],
            because: "a converter sees detection events alone",
        },
        Rule {
            module: "points",
            may_name: &["channel", "design", "units"],
            because: "points are made of returns; of the channel they know the link equation, \
                      which the sensor is calibrated by",
        },
        Rule {
            module: "score",
            may_name: &["channel", "design", "emit", "points", "scene", "units"],
            because: "the one stage that sees both sides compares points with surfaces and \
                      interference",
        },
        Rule {
            module: "predict",
            may_name: &["channel", "design", "environment", "random", "units"],
            because: "an oracle that ran the simulation would agree with it whatever it did",
        },
        Rule {
            module: "formats",
            may_name: &["machine", "names", "opened", "points", "told", "units"],
            because: "files hold columns, no physics; of units they know the speed of light, by \
                      which some have a time in place of a range",
        },
        Rule {
            module: "sim",
            may_name: &[
                "channel",
                "design",
                "detect",
                "emit",
                "points",
                "processor",
                "random",
                "scene",
                "score",
                "tdc",
            ],
            because: "the chain calls the stages and nothing else",
        },
        Rule {
            module: "memory",
            may_name: &["channel", "design", "emit", "environment", "scene", "units"],
            because: "what a scan takes is estimated from what it is given, before it is begun",
        },
    ],
};

const STUDY: Layers = Layers {
    folder: "macropulse-study",
    may_name: &["macropulse"],
    modules: &[
        Rule { module: "text", may_name: &[], because: "lines of text ask not what they say" },
        Rule { module: "view", may_name: &["text"], because: "pictures show columns, no physics" },
        Rule { module: "codes", may_name: &[], because: "families are compared without a scan" },
        Rule { module: "sent", may_name: &[], because: "what is sent asks not what it meets" },
        Rule {
            module: "decoding",
            may_name: &[],
            because: "ticks from outside become points by the simulator's own stages alone",
        },
        Rule {
            module: "record",
            may_name: &["text", "view"],
            because: "a run leaves files and pictures",
        },
        Rule {
            module: "budget",
            may_name: &["record", "text", "view"],
            because: "a budget is a forecast; it names sensor and environment as records do",
        },
        Rule {
            module: "designs",
            may_name: &["text", "view"],
            because: "a search makes sensors and scenes of its own, and tells of them in its own words",
        },
        Rule {
            module: "sweep",
            may_name: &["record", "text", "view"],
            because: "a sweep repeats whole scans, counts, and names them as records do",
        },
        Rule {
            module: "paper",
            may_name: &["record", "view"],
            because: "the experiment is runs and a report",
        },
        Rule {
            module: "validate",
            may_name: &["paper", "view"],
            because: "figures beside each other are a report; those of the paper are worked out where \
                      it is checked",
        },
    ],
};

const CRATES: [&Layers; 3] = [&CODEC, &SIMULATOR, &STUDY];

/// Modules of the simulator that may name the type `Truth`: it is made, filled, and written beside
/// the points.
const KNOW_THE_TRUTH: [&str; 4] = ["formats", "points", "score", "sim"];

impl Layers {
    fn root(&self) -> PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(self.folder)
    }

    fn rule(&self, module: &str) -> &Rule {
        self.modules.iter().find(|rule| rule.module == module).unwrap()
    }
}

/// Path and text of every source file of `module`.
fn sources(layers: &Layers, module: &str) -> Vec<(String, String)> {
    let root = layers.root().join("src");
    let alone = root.join(format!("{module}.rs"));
    let alone = alone.is_file().then_some(alone);
    let files = alone.into_iter().chain(sources_below(&root.join(module)));
    let found: Vec<(String, String)> = files
        .map(|path| {
            let name = path.strip_prefix(&root).unwrap().display().to_string();
            (name, fs::read_to_string(&path).unwrap())
        })
        .collect();
    assert!(!found.is_empty(), "{module} has no source");
    found
}

/// The modules that the table of contents of a crate lists.
fn modules(layers: &Layers) -> Vec<String> {
    let contents = fs::read_to_string(layers.root().join("src/lib.rs")).unwrap();
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

/// Returns the text after the literal whose inside begins `rest`.
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
    // The macro of kernels stands at the root, with the level it asks for.
    let of_kernels = ["on_every_level", "level"];
    let all = from_root.chain(climbed).filter(|name| *name != own && !of_kernels.contains(name));
    // Types that a crate shows at its root stand for the module they are from.
    let home = |name: &str| match name {
        "ShotLog" => "shot_log".to_owned(),
        "Tick" | "Ticks" => "ticks".to_owned(),
        "Given" | "Record" | "RecordKind" => "record".to_owned(),
        "Samples" => "samples".to_owned(),
        "Histograms" => "histograms".to_owned(),
        "Taps" => "taps".to_owned(),
        "Beats" | "Peak" => "beats".to_owned(),
        "Cut" => "cut".to_owned(),
        _ => name.to_owned(),
    };
    all.map(home).collect()
}

/// Returns the modules that `text`, a source of the module of `rule`, names without leave.
fn breaches(text: &str, rule: &Rule, known: &[String]) -> Vec<String> {
    let named = modules_named(text, rule.module, known);
    named.into_iter().filter(|name| !rule.may_name.contains(&name.as_str())).collect()
}

/// Files beside `units` that name the speed of light, and their purpose.
const OF_LIGHT: [(&str, &str); 3] = [
    ("macropulse/src/channel/interferers.rs", "one way from an interferer"),
    ("macropulse/src/channel/speckle.rs", "wave numbers"),
    ("macropulse/src/design/budget/mod.rs", "the energy of a photon"),
];

/// Ranges follow from times of flight, and times from ranges, by the functions of `units` alone: the factor 2
/// stands nowhere else.
#[test]
fn the_speed_of_light_is_named_by_few() {
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let folders =
        ["macropulse", "macropulse-codec", "macropulse-study", "macropulse-cli", "macropulse-py"];
    let all = folders.iter().flat_map(|folder| sources_below(&crates.join(folder).join("src")));
    let names_it = |path: &PathBuf| {
        words(&bare(&fs::read_to_string(path).unwrap())).any(|word| word == "SPEED_OF_LIGHT")
    };
    let naming = all.filter(names_it);
    let name = |path: PathBuf| path.strip_prefix(&crates).unwrap().display().to_string();
    let mut naming: Vec<String> =
        naming.map(name).filter(|name| !name.ends_with("units.rs")).collect();
    naming.sort();
    assert_eq!(naming, OF_LIGHT.map(|(name, _)| name));
}

#[test]
fn every_module_names_only_those_it_may() {
    for layers in CRATES {
        let known = modules(layers);
        for rule in layers.modules {
            for (file, text) in sources(layers, rule.module) {
                let breaches = breaches(&text, rule, &known);
                assert!(breaches.is_empty(), "{file} names {breaches:?}, but {}", rule.because);
            }
        }
    }
}

/// Each module may name only modules above it in its list: there is no cycle, by construction.
#[test]
fn modules_name_only_what_stands_above_them() {
    for layers in CRATES {
        for (place, rule) in layers.modules.iter().enumerate() {
            let above: Vec<&str> = layers.modules[..place].iter().map(|rule| rule.module).collect();
            for name in rule.may_name {
                assert!(
                    above.contains(name),
                    "{} may name {name}, which is not above",
                    rule.module
                );
            }
        }
    }
}

#[test]
fn every_module_has_a_rule() {
    for layers in CRATES {
        let mut ruled: Vec<String> =
            layers.modules.iter().map(|rule| rule.module.to_owned()).collect();
        let mut listed = modules(layers);
        ruled.sort();
        listed.sort();
        assert_eq!(ruled, listed, "{}", layers.folder);
    }
}

/// A permission without a use is a hole in the wall.
#[test]
fn every_permission_is_used() {
    for layers in CRATES {
        let known = modules(layers);
        for rule in layers.modules {
            let used: BTreeSet<String> = sources(layers, rule.module)
                .iter()
                .flat_map(|(_, text)| modules_named(text, rule.module, &known))
                .collect();
            for name in rule.may_name {
                assert!(used.contains(*name), "{} may name {name} but does not", rule.module);
            }
        }
    }
}

/// The crates of the workspace depend on each other in one direction.
#[test]
fn crates_depend_only_on_those_they_may() {
    for layers in CRATES {
        let manifest = fs::read_to_string(layers.root().join("Cargo.toml")).unwrap();
        let manifest: toml::Table = manifest.parse().unwrap();
        let dependencies = manifest["dependencies"].as_table().unwrap();
        let ours: Vec<String> = dependencies
            .keys()
            .filter(|name| name.starts_with("macropulse"))
            .map(|name| name.replace('-', "_"))
            .collect();
        assert_eq!(ours, layers.may_name, "{}", layers.folder);
    }
}

#[test]
fn only_score_and_what_writes_its_results_name_the_truth() {
    for module in modules(&SIMULATOR) {
        for (file, text) in sources(&SIMULATOR, &module) {
            let named = words(&bare(&text)).any(|word| word == "Truth");
            assert!(
                !named || KNOW_THE_TRUTH.contains(&module.as_str()),
                "{file} names Truth: a sensor that knows the truth measures nothing"
            );
        }
    }
}

/// Crates that `code` may use: it is for small machines, too.
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
fn from_outside(text: &str) -> Option<String> {
    let code = bare(text);
    let uses = code.lines().filter_map(|line| line.trim().strip_prefix("use "));
    let own = ["crate", "super", "self"];
    let mut roots = uses.map(first_name);
    let is_from_outside = |root: &&str| !own.contains(root) && !CRATES_OF_CODE.contains(root);
    // Tests may use what they like.
    let tests = ["approx", "proptest"];
    roots.find(|root| is_from_outside(root) && !tests.contains(root)).map(str::to_owned)
}

#[test]
fn code_knows_chips_and_marks_alone() {
    for (file, text) in sources(&CODEC, "code") {
        assert_eq!(physical(&text), None, "{file}: chips have no length at this level");
        assert_eq!(from_outside(&text), None, "{file}: a codec depends on next to nothing");
    }
}

/// A receiver needs no files, no threads and no clock: it can stand in firmware.
#[test]
fn the_codec_needs_no_files_and_no_threads() {
    for rule in CODEC.modules {
        for (file, text) in sources(&CODEC, rule.module) {
            let code = bare(&text);
            for absent in ["std::fs", "std::thread", "std::net", "std::process", "rayon", "Instant"]
            {
                assert!(!code.contains(absent), "{file} uses {absent}");
            }
        }
    }
}

/// The checker reports a made-up offender, by every way of writing a path, and no prose.
#[test]
fn a_breach_is_found() {
    let known = modules(&SIMULATOR);
    let tdc = SIMULATOR.rule("tdc");
    let found = |text: &str| breaches(text, tdc, &known).join(" ");
    assert_eq!(found("use crate::scene::Hits;"), "scene");
    assert_eq!(found("use crate::{design::Design, channel::{Link, Echoes}, sim};"), "channel sim");
    assert_eq!(found("use crate::{\n    design::Tdc,\n    score,\n};"), "score");
    assert_eq!(found("fn f(e: &super::super::channel::Echoes) {}"), "channel");
    assert_eq!(found("use super::{Band, sim};"), "sim");
    assert_eq!(found("use crate::*;"), "*");
    assert_eq!(found("let q = '\"'; let s = \"a \\\" b\"; use crate::scene::Hits;"), "scene");
    assert_eq!(found("//! Not `crate::scene`.\nconst A: &str = \"crate::sim\";"), "");
    assert_eq!(found("use crate::design::Tdc;\nuse crate::detect::Detections;"), "");
    assert_eq!(physical("// seconds\nlet chip_fs = 1;"), Some("chip_fs".to_owned()));
    assert_eq!(physical("// metres\nlet chips = 1;"), None);
    assert_eq!(from_outside("use std::fmt;\nuse libm::exp;"), Some("libm".to_owned()));
    assert!(words("cloud.truth: Truth").any(|word| word == "Truth"));
}

/// Unsafe code stands in one folder of each crate that needs it.
#[test]
fn only_kernels_are_unsafe() {
    for layers in CRATES {
        for rule in layers.modules.iter().filter(|rule| rule.module != "kernels") {
            for (file, text) in sources(layers, rule.module) {
                assert!(!words(&bare(&text)).any(|word| word == "unsafe"), "{file}");
            }
        }
    }
}

/// A file of `tests` that neither `all.rs` nor the list of test programs names would not run.
#[test]
fn every_file_of_tests_is_run() {
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut files = 0;
    for name in ["macropulse", "macropulse-cli", "macropulse-codec", "macropulse-study"] {
        let folder = crates.join(name);
        let all = fs::read_to_string(folder.join("tests/all.rs")).unwrap();
        let programs = fs::read_to_string(folder.join("Cargo.toml")).unwrap();
        for entry in fs::read_dir(folder.join("tests")).unwrap() {
            let file = entry.unwrap().file_name().into_string().unwrap();
            let Some(module) = file.strip_suffix(".rs") else { continue };
            let is_module = all.contains(&format!("\nmod {module};\n"));
            let is_program = programs.contains(&format!("path = \"tests/{file}\""));
            assert!(is_module != is_program, "{name}/tests/{file}: name it in all.rs");
            files += 1;
        }
    }
    assert!(files > 50, "{files}");
}

//! The guide does what it says. Every command of README.md and of the pages in docs runs. It prints the
//! output that the page shows. The figures in the tables and sentences of a page are those of a command. How
//! pages say where their figures come from: "A page of the guide" in CONTRIBUTING.md.
//!
//! Python that is not saved to a file is run by the tests of the Python package.
#![allow(clippy::unwrap_used, missing_docs)]

mod desk;
mod figures;
mod page;
mod prose;

use std::fs;
use std::path::{Path, PathBuf};

use desk::Desk;
use figures::Sources;
use page::{Block, Page, Part};

/// Each page is a test, so that one alone can be asked for by its name. Slow pages, whose commands take minutes, are
/// tried before a release.
macro_rules! pages {
    (always { $($name:ident: $path:literal,)* } slow { $($slow:ident: $slow_path:literal,)* }) => {
        $(#[test] fn $name() { holds($path); })*
        $(#[test] #[ignore = "slow: before a release"] fn $slow() { holds($slow_path); })*
        const PAGES: &[&str] = &[$($path,)* $($slow_path),*];
        const SLOW: &[&str] = &[$($slow_path),*];
    };
}

pages! {
    always {
        readme: "README.md",
        introduction: "docs/README.md",
        codes: "docs/codes.md",
        decoding: "docs/decoding.md",
        formats: "docs/formats.md",
        glossary: "docs/glossary.md",
        hardening: "docs/hardening.md",
        limits: "docs/limits.md",
        paper: "docs/paper.md",
        performance: "docs/performance.md",
        physics: "docs/physics.md",
        references: "docs/references.md",
        validation: "docs/validation.md",
        budget: "docs/guide/budget.md",
        cluster: "docs/guide/cluster.md",
        explore: "docs/guide/explore.md",
        first_scan: "docs/guide/first-scan.md",
        golden_model: "docs/guide/golden-model.md",
        histograms: "docs/guide/histograms.md",
        modulated_light: "docs/guide/modulated-light.md",
        own_scanner: "docs/guide/own-scanner.md",
        python: "docs/guide/python.md",
        real_chip: "docs/guide/real-chip.md",
    }
    slow {
        bipolar_gold: "docs/guide/bipolar-gold.md",
        coded_32: "docs/guide/coded-32.md",
        coded_360: "docs/guide/coded-360.md",
        coded_practical: "docs/guide/coded-practical.md",
        interference: "docs/guide/interference.md",
        never_waiting: "docs/guide/never-waiting.md",
        own_code: "docs/guide/own-code.md",
        range_and_velocity: "docs/guide/range-and-velocity.md",
        ros: "docs/guide/ros.md",
        sweep: "docs/guide/sweep.md",
        three_methods: "docs/guide/three-methods.md",
    }
}

/// The root of the repository.
fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").canonicalize().unwrap()
}

#[test]
fn every_page_is_tried() {
    let mut there = vec!["README.md".to_owned()];
    for folder in ["docs", "docs/guide"] {
        for entry in fs::read_dir(root().join(folder)).unwrap() {
            let name = entry.unwrap().file_name().into_string().unwrap();
            if name.ends_with(".md") && name != "SUMMARY.md" {
                there.push(format!("{folder}/{name}"));
            }
        }
    }
    there.sort();
    let mut tried: Vec<_> = PAGES.to_vec();
    tried.sort_unstable();
    assert_eq!(tried, there);
}

/// Slow pages are not run every time, but each of their commands is parsed: it has the options that the page gives it.
#[test]
fn commands_of_slow_pages_exist() {
    for name in SLOW {
        let page = Page::of(name, &fs::read_to_string(root().join(name)).unwrap()).unwrap();
        let desk = Desk::new(&root());
        let commands: Vec<_> = page.blocks().filter(|block| block.language == "sh").collect();
        assert!(!commands.is_empty(), "{name}");
        for block in commands {
            desk.parse(&block.text).unwrap_or_else(|why| panic!("{name}: {why}"));
        }
    }
}

#[test]
fn pages_are_in_plain_english() {
    let mut faults = Vec::new();
    let more = ["ARCHITECTURE.md", "CHANGELOG.md", "CONTRIBUTING.md"];
    for page in PAGES.iter().chain(&more) {
        let text = fs::read_to_string(root().join(page)).unwrap();
        faults.extend(prose::faults(&text).iter().map(|fault| format!("{page}: {fault}")));
    }
    assert!(faults.is_empty(), "{faults:#?}");
}

#[test]
fn comments_are_in_plain_english() {
    let sources = macropulse_testbed::sources_below(&root().join("crates"));
    assert!(sources.len() > 500, "{}", sources.len());
    let mut faults = Vec::new();
    for source in sources {
        let name = source.strip_prefix(root()).unwrap().display().to_string();
        for comment in prose::comments(&fs::read_to_string(&source).unwrap()) {
            faults.extend(prose::faults(&comment).iter().map(|fault| format!("{name}: {fault}")));
        }
    }
    assert!(faults.is_empty(), "{faults:#?}");
}

/// The table of constants on the page about decoding has the values of the code.
#[test]
fn constants_of_the_receiver_are_those_of_the_code() {
    let page = fs::read_to_string(root().join("docs/decoding.md")).unwrap();
    let table = page.split("| constant | value | where |").nth(1).unwrap();
    let rows = table.lines().skip(2).take_while(|line| line.starts_with('|'));
    let cells = |row: &str| -> Vec<String> {
        row.split('|').map(|cell| cell.trim().trim_matches('`').to_owned()).collect()
    };
    let mut held = 0;
    for row in rows.map(cells) {
        let [_, name, value, file, ..] = &row[..] else { panic!("{row:?}") };
        let file = root().join("crates/macropulse-codec/src/decode").join(file);
        let code = fs::read_to_string(file).unwrap();
        let defined = code.lines().find_map(|line| line.split_once(&format!("const {name}: ")));
        let (_, defined) = defined.unwrap_or_else(|| panic!("there is no {name}"));
        assert!(defined.ends_with(&format!(" = {value};")), "{name} is {defined}");
        held += 1;
    }
    assert!(held > 5, "{held}");
}

/// Commands that run before a page begins. The README begins with ticks recorded of two lines of its sensor.
const BEFORE: [(&str, &str); 1] = [(
    "README.md",
    "macropulse encode kim-park-2016-fixed --set scan.raster.rows=2 --set scan.scans_per_s=14400 \\\n\
         --wall-m 30 --format ticks-csv -o recorded\n\
     for what in shots ticks; do\n\
         sed '1s/, digest=[0-9a-f]*//' recorded/$what-000000.csv > $what.csv\n\
     done\n",
)];

/// Does what `page` says, in its order, and panics with all that is not so.
fn holds(page: &str) {
    let page = Page::of(page, &fs::read_to_string(root().join(page)).unwrap()).unwrap();
    let desk = Desk::new(&root());
    for (_, commands) in BEFORE.iter().filter(|(name, _)| *name == page.name) {
        desk.run(commands).unwrap();
    }
    let mut wrong = Vec::new();
    for block in page.blocks() {
        if let Some(file) = &block.file {
            desk.put(file, &block.text);
        }
    }
    let mut sources = Sources::default();
    let mut printed = None;
    for part in &page.parts {
        let outcome = match part {
            Part::Block(block) => obey(block, &desk, &mut printed),
            Part::Figures(held) => sources.hold(held, &page, &desk),
        };
        if let Err(why) = outcome {
            wrong.push(format!("{}:{}: {why}", page.name, part.line()));
        }
    }
    for (line, row) in page.rows.iter().filter(|_| page.name.starts_with("docs/guide/")) {
        let outcome = sources.cover(row);
        wrong.extend(outcome.err().map(|why| format!("{}:{line}: {why}", page.name)));
    }
    assert!(wrong.is_empty(), "\n{}\n", wrong.join("\n\n"));
}

/// Runs a block of commands, or holds a block of output against what the last one has `printed`.
fn obey(block: &Block, desk: &Desk, printed: &mut Option<String>) -> Result<(), String> {
    match block.language.as_str() {
        _ if block.file.is_some() => Ok(()),
        "sh" | "console" if block.not_run.is_some() => {
            *printed = None;
            desk.parse(&block.text)
        }
        "sh" => {
            *printed = Some(desk.run(&block.text)?);
            Ok(())
        }
        "console" => Err("a console block is not run: give the reason behind its name".to_owned()),
        "python" => {
            *printed = None;
            Ok(())
        }
        "text" => printed.as_ref().map_or(Ok(()), |printed| figures::shown(&block.text, printed)),
        _ => Ok(()),
    }
}

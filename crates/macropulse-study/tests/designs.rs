//! From requirements to lidars: what is wrong in a file is said, and what is found does.
#![allow(clippy::unwrap_used)]

use std::fs;
use std::path::Path;

use macropulse::design::Design;
use macropulse::environment::Environment;
use macropulse::predict::verdict::Wanted;
use macropulse::sim::Watch;
use macropulse_study::budget::{Figures, usual};
use macropulse_study::designs::{Found, Requirements, Search, make_room};

/// A corner of the field of the paper, scanned so often that three beams have the shot interval of fifteen
/// beams in the whole field. A search takes 20 s.
const SMALL: &str = r#"
version = 1
name = "small"
[wanted]
rows = 30
columns = 212
horizontal_deg = 10.8
vertical_deg = 1.52
scans_per_s = 800.0
range_m = 150.0
clutter_m = 300.0
reflectance = 0.5
[parts]
detectors = ["inalas"]
marks = [1, 3]
beams = [15, 30]
facets = [24]
polygon_mm = 700.0
"#;

const UNWATCHED: Watch = Watch { done: &|_| {}, stop: &|| false };

fn required(changes: &[(&str, &str)]) -> Result<Requirements, String> {
    let text = changes.iter().fold(SMALL.to_owned(), |text, (from, to)| {
        assert!(text.contains(from), "{from}");
        text.replace(from, to)
    });
    Requirements::from_toml(&text, "mine.toml", Path::new("")).map_err(|error| error.to_string())
}

fn found(changes: &[(&str, &str)], folder: &Path, seed: u64) -> Found {
    make_room(folder).unwrap();
    let required = required(changes).unwrap();
    Search { required, folder, seed, watch: &UNWATCHED }.run().unwrap().unwrap()
}

#[test]
fn what_is_wrong_in_a_file_is_said_with_its_place() {
    for (change, told) in [
        (
            ("reflectance = 0.5", "reflectance = 1.5"),
            "mine.toml:12:1: wanted.reflectance: is 1.5, but must lie between 0.001 and 1",
        ),
        (
            ("range_m", "rnage_m"),
            "mine.toml:10:1: wanted.rnage_m: unknown key `rnage_m`; did you mean `range_m`?",
        ),
        (
            ("clutter_m = 300.0", "clutter_m = 100"),
            "mine.toml:11:1: wanted.clutter_m: is 100, nearer than wanted.range_m, 150",
        ),
        (
            ("\"inalas\"", "\"inalaas\""),
            "mine.toml:14:1: parts.detectors: unknown photodiode `inalaas`; did you mean `inalas`?",
        ),
        (
            ("[15, 30]", "[4, 30]"),
            "mine.toml:16:1: parts.beams: 4 beams do not share 30 rows evenly",
        ),
        (
            ("marks = [1, 3]", "marks = [0]"),
            "mine.toml:15:1: parts.marks: must be numbers from 1 to 8, one at least",
        ),
        (
            ("version = 1", "version = 2"),
            "mine.toml:2:1: version: is 2, but this program reads version 1",
        ),
        (
            ("[parts]", "[parts]\nsensor = \"hdl-64e\""),
            "mine.toml:14:1: parts.sensor: hdl-64e is not a raster with a code and an [adc]; coded-32 is one",
        ),
        (
            ("[parts]", "environment = \"noon\"\n[parts]"),
            "mine.toml:13:1: wanted.environment: unknown key `environment`; known are ",
        ),
    ] {
        let refused = required(&[change]).unwrap_err();
        assert!(refused.starts_with(told), "{refused}\nand not\n{told}");
    }
}

/// With thirty beams the shots of one are 2.1 µs apart, enough for light from 300 m. With fifteen they are
/// 1.06 µs apart, enough for 150 m. A lidar that does not wait needs fewer beams. Each lidar found keeps to
/// class 1 and meets the requirements, and its budget agrees. A second search reads its files and finds the
/// same, to the bit. Control: nothing is found at ten times the range.
#[test]
fn what_is_found_does_and_is_found_again() {
    let folder = tempfile::tempdir().unwrap();
    let first = found(&[], folder.path(), 1);
    let [Some(coded), Some(waiting)] = &first.best else { panic!("{}", first.text()) };
    let [coded, waiting] = [coded, waiting].map(|best| &best.trial);
    assert!(coded.candidate.beams < waiting.candidate.beams, "{}", first.text());
    let names = first.write(folder.path()).unwrap();
    assert!(names.iter().any(|name| name == "index.html"), "{names:?}");
    for (name, best) in [("coded", coded), ("waiting", waiting)] {
        let design = Design::open(folder.path().join(format!("{name}.toml")), &[]).unwrap();
        assert_eq!(design.channels(), best.candidate.beams);
        let sky = Environment::default();
        let wanted = Wanted { reflectance: 0.5, ..usual(&design) };
        let figures = Figures::of(&design, sky, wanted).unwrap();
        assert!(figures.closes(), "{}", figures.text());
        let allowed = macropulse::design::safety::strictest(design.eye_limits()).unwrap().energy;
        assert!(best.candidate.energy / allowed < 0.9 + 1e-6);
        for counts in best.counts {
            assert!(counts.pd() >= 0.9 && counts.rms() < 0.03, "{}", first.text());
        }
        assert!(best.worst.pd > 0.899, "{}", first.text());
        assert!((5.0..=150.0).contains(&best.worst.range), "{}", first.text());
    }
    let again = found(&[], folder.path(), 1);
    assert!(again.json() == first.json(), "{}", again.text());
    let far = [("range_m = 150.0", "range_m = 1500.0"), ("clutter_m = 300", "clutter_m = 3000")];
    assert_eq!(found(&far, folder.path(), 1).best, [None, None]);
}

/// At 16 by 64 pixels, 20 times a second, an echo from 40 m could come back a hundred times before the next
/// shot. One channel that waits is enough, and the report says that a code gains nothing.
#[test]
fn an_easy_task_needs_no_code() {
    let easy = [
        ("rows = 30", "rows = 16"),
        ("columns = 212", "columns = 64"),
        ("scans_per_s = 800.0", "scans_per_s = 20.0"),
        ("range_m = 150.0", "range_m = 40.0"),
        ("clutter_m = 300.0", "clutter_m = 80.0"),
        ("beams = [15, 30]", "beams = [1]"),
    ];
    let folder = tempfile::tempdir().unwrap();
    let found = found(&easy, folder.path(), 1);
    let [None, Some(waiting)] = &found.best else { panic!("{}", found.text()) };
    assert_eq!(waiting.bill.channels, 1);
    assert!(waiting.trial.counts.iter().all(|counts| counts.pd() > 0.99), "{}", found.text());
    let text = found.text();
    assert!(text.contains("none of the parts allowed: a code gains nothing: "), "{text}");
}

/// The next search into a folder first removes the results of the last one, and nothing else. A file under
/// the name of a result that no search has written, or that was changed since, is refused and stays.
#[test]
fn a_search_removes_what_a_search_has_written_and_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let of_a_user = ["coded.toml", "index.html", "coded.txt"].map(|name| folder.path().join(name));
    for file in &of_a_user {
        fs::write(file, "mine").unwrap();
    }
    fs::create_dir(folder.path().join("trials")).unwrap();
    let refused = make_room(folder.path()).unwrap_err().to_string();
    assert!(refused.contains("coded.toml: was not written by a search"), "{refused}");
    assert!(of_a_user.iter().all(|file| file.is_file()));
    fs::remove_file(&of_a_user[0]).unwrap();
    fs::remove_file(&of_a_user[1]).unwrap();
    let dark = [("reflectance = 0.5", "reflectance = 0.001"), ("[15, 30]", "[30]")];
    found(&dark, folder.path(), 1).write(folder.path()).unwrap();
    let page = &of_a_user[1];
    assert!(page.is_file());
    make_room(folder.path()).unwrap();
    assert!(!page.exists() && of_a_user[2].is_file());
    found(&dark, folder.path(), 1).write(folder.path()).unwrap();
    fs::write(page, "edited").unwrap();
    assert!(make_room(folder.path()).is_err());
    assert_eq!(fs::read_to_string(page).unwrap(), "edited");
}

/// One beam has 87 ns between its shots on average, in which no ten words of four marks fit; the search goes on with
/// the others and says so.
#[test]
fn beams_for_which_no_word_fits_are_skipped_and_listed() {
    let folder = tempfile::tempdir().unwrap();
    let dark = [
        ("reflectance = 0.5", "reflectance = 0.001"),
        ("scans_per_s = 800.0", "scans_per_s = 1800.0"),
        ("beams = [15, 30]", "beams = [1, 3, 10]"),
        ("facets = [24]", "facets = [50]"),
        ("marks = [1, 3]", "marks = [4]"),
    ];
    let found = found(&dark, folder.path(), 1);
    let skipped: Vec<u32> = found.skipped.iter().map(|one| one.beams).collect();
    assert_eq!(skipped, [1], "{}", found.text());
    assert!(found.text().contains("inalas, 4 marks, beams 1: words of"), "{}", found.text());
}

/// Sixteen rows of sixty-four pixels to 40 m. Eye safety would allow some 3 µJ a shot. The stray light of
/// such a shot outlasts the blanking of the receiver, so every shot would return its tail. With longer
/// blanking the task is easy.
#[test]
fn no_more_light_is_sent_than_the_receiver_bears() {
    let easy = "version = 1\nname = \"easy\"\n[wanted]\nrows = 16\ncolumns = 64\n\
        horizontal_deg = 43.2\nvertical_deg = 24.3\nscans_per_s = 1000.0\nrange_m = 40.0\n\
        clutter_m = 60.0\nreflectance = 0.1\n[parts]\ndetectors = [\"inalas\"]\nmarks = [1]\n\
        beams = [16]\n";
    let required = Requirements::from_toml(easy, "easy.toml", Path::new("")).unwrap();
    let folder = tempfile::tempdir().unwrap();
    make_room(folder.path()).unwrap();
    let search = Search { required, folder: folder.path(), seed: 1, watch: &UNWATCHED };
    let found = search.run().unwrap().unwrap();
    let Some(waiting) = &found.best[1] else { panic!("{}", found.text()) };
    for counts in waiting.trial.counts {
        assert!(counts.pd() > 0.9 && counts.false_share() == 0.0, "{}", found.text());
    }
}

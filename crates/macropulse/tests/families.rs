//! Every code family in a sensor, from the file to the points.
#![allow(clippy::unwrap_used)]

use std::path::Path;

use macropulse::channel::{Operating, Seen};
use macropulse::design::{Coding, Design, Emission};
use macropulse::detect::Detectors;
use macropulse::points::Outcome;
use macropulse::random::Chance;
use macropulse::scene::Scene;
use macropulse::score::Score;
use macropulse::sim;

/// A wall with a step of 7 m: two surfaces, and the edge between them.
const SCENE: &str = r#"
version = 1
[[object]]
shape = { box = { size_m = [1.0, 40.0, 40.0] } }
position_m = [30.0, 21.0, 0.0]
material = "white"
[[object]]
shape = { box = { size_m = [1.0, 40.0, 40.0] } }
position_m = [37.0, -21.0, 0.0]
material = "white"
"#;

/// A small raster that is as fast as the large one: pixels of 41 ns, 25 shots in flight.
const SENSOR: &str = r#"
version = 1
name = "family"
extends = "kim-park-2016-fixed"
[scan]
scans_per_s = 9538.0
[scan.raster]
rows = 40
columns = 64
[detector.photon-counting]
sensitivity = { range_m = 150.0, reflectance = 1.0, pd = 1.0 }
dark_counts_hz = 0.0
jitter_ps = 0.0
[tdc]
converters = 100000
"#;

/// The sensor above with other values of the table `code` and of others.
fn sensor(keys: &[(&str, &str)]) -> Design {
    let set: Vec<(String, String)> =
        keys.iter().map(|&(key, value)| (key.to_owned(), value.to_owned())).collect();
    Design::from_toml(SENSOR, "family.toml", Path::new(""), &set).unwrap()
}

fn scanned(design: &Design) -> Score {
    let scene = Scene::from_toml(SCENE, "steps.toml", Path::new("")).unwrap();
    sim::scan(design, &scene, 5, 0).unwrap().score
}

/// That nearly all echoes come back right, and hardly anything where there is none.
#[track_caller]
fn assert_right(keys: &[(&str, &str)], least: f64) {
    let score = scanned(&sensor(keys));
    assert!(score.with_echo() > 2000 && score.count(Outcome::Empty) > 100, "{score:?}");
    assert!(score.right_fraction() >= least, "{keys:?}: {score:?}");
    assert!(score.count(Outcome::False) <= 3, "{keys:?}: {score:?}");
}

const FAMILY: &str = "code.family";
const WORD: &str = "code.word";
const CHIP: &str = "code.chip_ps";
const KIND: &str = "receiver.kind";
const LABEL: &str = "code.label";
const LABEL_BITS: &str = "code.label_bits";

/// Families whose macropulses fit a pixel with a label of 14 bits, and which have words enough for
/// all shots in flight.
const LABELLED: [(&str, &str); 5] = [
    ("{ prime = 29 }", "{ first = 1, modulus = 28 }"),
    ("{ quadratic-congruence = 29 }", "{ first = 0, modulus = 28 }"),
    ("{ orthogonal = { length = 1000, weight = 5 } }", "{ first = 0, modulus = 40 }"),
    (
        "{ sparse = { length = 900, weight = 12, words = 500, seed = 3 } }",
        "{ first = 0, modulus = 500 }",
    ),
    ("{ gold = 7 }", "{ first = 0, modulus = 129 }"),
];

/// Words that do without a label.
const BARE: [(&str, &str); 4] = [
    ("{ extended-prime = 29 }", "{ first = 1, modulus = 28 }"),
    ("{ quadratic-congruence = 29 }", "{ first = 0, modulus = 28 }"),
    ("{ extended-quadratic-congruence = 29 }", "{ first = 0, modulus = 28 }"),
    (
        "{ sparse = { length = 10933, weight = 32, words = 4096, seed = 1 } }",
        "{ first = 0, modulus = 4096 }",
    ),
];

#[test]
fn words_with_a_label_are_matched() {
    for (family, word) in LABELLED {
        assert_right(&[(FAMILY, family), (WORD, word)], 0.99);
    }
}

#[test]
fn bare_words_are_matched() {
    for (family, word) in BARE {
        assert_right(&[(FAMILY, family), (WORD, word), (LABEL, "none")], 0.99);
    }
}

#[test]
fn sparse_words_are_matched_with_one_mark_in_five_missed() {
    let noisy = [
        ("detector.photon-counting.missed_marks", "0.2"),
        ("detector.photon-counting.dark_counts_hz", "1e8"),
    ];
    for &(family, word) in &LABELLED[..4] {
        assert_right(&[&[(FAMILY, family), (WORD, word)][..], &noisy].concat(), 0.98);
    }
    for (family, word) in BARE {
        let bare = [(FAMILY, family), (WORD, word), (LABEL, "none")];
        assert_right(&[&bare[..], &noisy].concat(), 0.98);
    }
}

/// One word serves where one shot is in flight.
#[test]
fn an_m_sequence_serves_a_sensor_that_waits() {
    for kind in ["matched", "balanced"] {
        let waits = [("scan.scans_per_s", "370.0"), (LABEL, "none"), (KIND, kind)];
        let word = [(FAMILY, "{ m-sequence = 9 }"), (WORD, "{ first = 0, modulus = 1 }")];
        for missed in ["0.0", "0.2"] {
            let missed = [("detector.photon-counting.missed_marks", missed)];
            assert_right(&[waits.as_slice(), &word, &missed].concat(), 0.99);
        }
    }
}

/// Nine lines of the street through the example, at its own sensitivity and jitter.
#[test]
fn the_example_of_dense_words_sees_the_street() {
    let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../sensors/bipolar-gold.toml");
    let design = Design::open(example.to_str().unwrap(), &[]).unwrap();
    let street = Scene::open("street").unwrap();
    let lines: Vec<_> = macropulse::emit::bands(&design, 0)
        .filter(|band| (240..249).contains(&(band.first / 848)))
        .collect();
    let score = sim::scan_part(&design, &street, 1, &lines).unwrap().score;
    assert!(score.with_echo() > 5000 && score.right_fraction() > 0.97, "{score:?}");
    let [wrong, stray] = [Outcome::Wrong, Outcome::False].map(|outcome| score.count(outcome));
    assert_eq!(wrong + stray, 0, "{score:?}");
}

#[test]
fn what_does_not_fit_together_is_refused() {
    let refused = |keys: &[(&str, &str)], words: &[&str]| {
        let set: Vec<(String, String)> =
            keys.iter().map(|&(key, value)| (key.to_owned(), value.to_owned())).collect();
        let error = Design::from_toml(SENSOR, "family.toml", Path::new(""), &set).unwrap_err();
        for word in words {
            assert!(error.to_string().contains(word), "{error}");
        }
    };
    refused(&[(LABEL, "none"), (KIND, "blind")], &["receiver.kind", "code.label = \"none\""]);
    refused(&[("code.keying", "inversion")], &["receiver.kind", "only `balanced`"]);
    refused(&[("code.keying", "inversion"), (LABEL, "none")], &["code.keying", "on-off"]);
    refused(&[(FAMILY, "{ quadratic-congruence = 30 }")], &["code.family", "29 and 31"]);
    refused(&[(FAMILY, "{ gold = 8 }")], &["degree 8"]);
    refused(
        &[(FAMILY, "{ orthogonal = { length = 1000, weight = 5, words = 50 } }")],
        &["50 words", "49 at most"],
    );
    refused(
        &[(FAMILY, "{ sparse = { length = 1000000000, weight = 5, words = 1, seed = 1 } }")],
        &["1000000000 chips", "1 to 65535"],
    );
    refused(&[(FAMILY, "{ golf = 7 }")], &["golf", "did you mean `gold`"]);
    refused(&[(FAMILY, "{ prime = 29, gold = 7 }")], &["code.family", "exactly one"]);
    refused(
        &[(FAMILY, "{ quadratic-congruence = 29 }"), (WORD, "{ first = 0, modulus = 29 }")],
        &["code.word.modulus", "between 1 and 28"],
    );
    let threshold = ("receiver.bit_threshold", "6");
    refused(
        &[
            (FAMILY, "{ prime = 5 }"),
            (WORD, "{ first = 1, modulus = 4 }"),
            (KIND, "blind"),
            threshold,
        ],
        &["receiver.bit_threshold", "between 1 and 5"],
    );
}

#[test]
fn words_with_a_label_are_read_bit_by_bit() {
    for (family, threshold) in
        [("{ quadratic-congruence = 29 }", "20"), ("{ extended-prime = 19 }", "12")]
    {
        for kind in ["literal", "blind"] {
            let word = (WORD, "{ first = 1, modulus = 17 }");
            let keys =
                [(FAMILY, family), word, (KIND, kind), ("receiver.bit_threshold", threshold)];
            assert_right(&keys, 0.97);
        }
    }
}

#[test]
fn dense_words_are_heard_in_balance() {
    let gold =
        [(FAMILY, "{ gold = 7 }"), (WORD, "{ first = 0, modulus = 129 }"), (KIND, "balanced")];
    let bare = [(LABEL, "none"), (CHIP, "320.0")];
    assert_right(&[gold.as_slice(), &bare].concat(), 0.99);
    let inverted = [("code.keying", "inversion"), (LABEL_BITS, "6"), (CHIP, "20.0")];
    assert_right(&[gold.as_slice(), &inverted].concat(), 0.99);
}

/// A receiver that expects other words than were sent finds nothing: what is right above is not
/// the doing of the scene.
#[test]
fn other_words_are_not_found() {
    let gold = |first: &str| {
        let word = format!("{{ first = {first}, modulus = 100 }}");
        sensor(&[
            (FAMILY, "{ gold = 7 }"),
            (WORD, &word),
            (KIND, "balanced"),
            (LABEL, "none"),
            (CHIP, "320.0"),
        ])
    };
    let (mut design, other) = (gold("0"), gold("29"));
    assert!(scanned(&design).right_fraction() > 0.99);
    let codebook = other.emission.coding().codebook.clone();
    design.emission = Emission::Marks(Coding { codebook, ..design.emission.coding().clone() });
    let scene = Scene::from_toml(SCENE, "steps.toml", Path::new("")).unwrap();
    let log = macropulse::emit::bands(&design, 0).next().unwrap().shot_log(&design);
    let operating = Operating::of(&design, &scene.environment).unwrap();
    let seen = Seen {
        design: &design,
        scene: &scene,
        operating: &operating,
        chance: macropulse::random::Chance::new(0),
    };
    let light = macropulse::channel::light(&seen, &log, &scene.trace(&design, &log));
    let detectors = Detectors::new(&design, &operating, Chance::new(1));
    let detections = detectors.detections(&log, &light, &mut Default::default());
    let ticks = macropulse::tdc::ticks(&design, detections, macropulse::tdc::Wanted::ALL).ticks;
    let found = |log| {
        design.receiver.decode(&design.emission.coding().codebook, log, &ticks).unwrap().len()
    };
    let mut wrong = log.clone();
    wrong.word.iter_mut().for_each(|word| *word = (*word + 50) % 100);
    assert!(found(&log) > log.owned.len() * 9 / 10);
    assert!(found(&wrong) < log.owned.len() / 50, "{}", found(&wrong));
}

/// Light that is always there: one place in five is lit, 78 GHz at 2.5 ps. The balance stands it.
/// The control is the same level over a tenth of the light.
#[test]
fn a_constant_level_does_not_deafen_the_balance() {
    let level = |rate: &str, missed: &str| {
        let keys = [
            (FAMILY, "{ gold = 9 }"),
            (WORD, "{ first = 0, modulus = 500 }"),
            (KIND, "balanced"),
            (LABEL, "none"),
            (CHIP, "80.0"),
            ("tdc.resolution_ps", "20.0"),
            ("receiver.right_within_m", "0.01"),
            ("detector.photon-counting.dark_counts_hz", rate),
            ("detector.photon-counting.missed_marks", missed),
        ];
        scanned(&sensor(&keys))
    };
    let bright = level("1e10", "0.3");
    assert!(bright.right_fraction() > 0.99, "{bright:?}");
    assert!(bright.count(Outcome::False) + bright.count(Outcome::Wrong) < 3, "{bright:?}");
    let dim = level("1e10", "0.93");
    assert!(dim.right_fraction() < 0.5, "{dim:?}");
}

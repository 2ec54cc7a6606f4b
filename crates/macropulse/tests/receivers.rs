//! The receivers against ticks of known origin: what they find, what they miss and what they must
//! not find.
//!
//! Every percentage is over the N shots named in its test, of one fixed seed
//! (`street::Sensor::ticks`), so that a test either always passes or never does.

#![allow(clippy::unwrap_used)]

#[path = "receivers/street.rs"]
mod street;

use macropulse::codec::code::Codebook;
use macropulse::codec::decode::ReceiverKind::{Blind, Literal, Matched};
use macropulse::codec::decode::{Effort, Reject};
use street::{CLEAR, Scene, Score, Sensor, Weather, car, random, sky, slope};

const SCENES: [(&str, Scene); 3] = [("car", car), ("slope", slope), ("random", random)];

/// N = 13 568 (car), 6784 (slope), 2544 (random): rows enough to cross the horizon.
fn rows(name: &str) -> std::ops::Range<u32> {
    match name {
        "car" => 2..18,
        "slope" => 0..8,
        _ => 3..6,
    }
}

#[track_caller]
fn assert_right(score: &Score, least: f64, what: &str) {
    assert!(score.echoes > 1000, "{what}: {score:?}");
    assert!(score.percent_right() >= least, "{what}: {:.3} %, {score:?}", score.percent_right());
}

#[test]
fn the_matched_receiver_finds_everything_in_clear_weather_and_nothing_in_the_sky() {
    for (name, scene) in SCENES {
        let score = Sensor::printed(Matched).score(rows(name), scene, CLEAR);
        assert_right(&score, 99.9, name);
        assert_eq!(score.false_returns, 0, "{name}");
        // Without jitter a lag is exact, and half a tick makes up for rounding down.
        assert!(score.bias.abs() < 1e-6 && score.rms < 1e-6, "{name}: {score:?}");
    }
}

#[test]
fn the_blind_receiver_finds_everything_in_clear_weather_but_where_much_overlaps() {
    for (name, scene) in SCENES {
        let score = Sensor::printed(Blind).score(rows(name), scene, CLEAR);
        assert_right(&score, if name == "random" { 98.5 } else { 99.9 }, name);
        assert_eq!(score.false_returns, 0, "{name}");
    }
}

#[test]
fn the_literal_receiver_loses_the_labels_that_begin_with_a_dark_bit() {
    // N = 6784: all 848 columns; 336 of them begin with a lit bit.
    let right = Sensor::printed(Literal).score(0..8, slope, CLEAR).percent_right();
    assert!((right - 39.5).abs() <= 0.5, "{right:.3} %");
    // Labels drawn evenly from all 1024: half of them do.
    let sensor = Sensor { labels: 1024, ..Sensor::printed(Literal) };
    let right = sensor.score(0..8, slope, CLEAR).percent_right();
    assert!((right - 50.0).abs() < 2.0, "{right:.3} %");
    // In front of the car none does, and overlap costs little of the rest.
    let score = Sensor::printed(Literal).score(rows("car"), car, CLEAR);
    let behind =
        |row: u32, column: u32| car(row, column).filter(|_| !(300..=500).contains(&column));
    let lit = |column: u32| column >= 512;
    let expected = (2..18)
        .flat_map(|row| (0..848).map(move |column| (row, column)))
        .filter(|&(row, column)| lit(column) && behind(row, column).is_some())
        .count();
    assert!(score.right as usize >= expected - 10 && score.right as usize <= expected, "{score:?}");
    assert_eq!((score.wrong, score.false_returns), (0, 0));
}

#[test]
fn a_sync_bit_cures_the_literal_receiver() {
    for (name, scene) in [("car", car as Scene), ("slope", slope)] {
        let score = Sensor::with_sync(Literal).score(rows(name), scene, CLEAR);
        assert_right(&score, 99.9, name);
        assert_eq!(score.false_returns, 0, "{name}");
    }
}

#[test]
fn the_matched_receiver_endures_missed_marks_and_false_edges() {
    let weathers = [
        (Weather { seen: 0.8, ..CLEAR }, 99.9),
        (Weather { seen: 0.8, false_edges: 1e9, ..CLEAR }, 99.9),
        (Weather { seen: 0.6, ..CLEAR }, 99.0),
    ];
    for (weather, least) in weathers {
        let score = Sensor::printed(Matched).score(4..12, car, weather);
        assert_right(&score, least, &format!("{weather:?}"));
        assert_eq!(score.false_returns, 0, "{weather:?}");
    }
}

#[test]
fn the_matched_receiver_finds_ground_of_which_one_mark_in_seven_is_seen() {
    let score = Sensor::printed(Matched).score(0..2, slope, Weather { seen: 0.15, ..CLEAR });
    let found = f64::from(score.right + score.wrong) / f64::from(score.echoes);
    assert!(found > 0.98, "{score:?}");
    // The wrong ones are on a sidelobe of the own code word, which chance made the higher one.
    assert_right(&score, 85.0, "faint");
}

#[test]
fn jitter_is_averaged_over_the_marks() {
    for jitter in [0.4, 1.0, 2.0] {
        let mut sensor = Sensor::printed(Matched);
        sensor.matched().0.jitter_ticks = jitter;
        let score = sensor.score(0..2, slope, Weather { jitter, ..CLEAR });
        assert_right(&score, 99.9, &format!("jitter {jitter}"));
        // 58 marks or more, each rounded down: σ/√58, and as much again for cut off tails.
        let expected = 2.0 * (jitter * jitter + 1.0 / 12.0).sqrt() / 58_f64.sqrt();
        assert!(score.rms < expected, "jitter {jitter}: {score:?}");
        assert!(score.bias.abs() < 0.05, "jitter {jitter}: {score:?}");
    }
}

#[test]
fn bright_shots_on_top_of_each_other_are_no_return_of_an_empty_pixel() {
    // N = 1696, one in four empty. At a jitter of a tick a mark has five places.
    let mut sensor = Sensor::printed(Matched);
    sensor.matched().0.jitter_ticks = 1.0;
    let score = sensor.score(0..2, random, Weather { jitter: 1.0, ..CLEAR });
    assert_right(&score, 99.9, "random");
    assert_eq!(score.false_returns, 0, "{score:?}");
}

#[test]
fn false_edges_alone_are_no_return() {
    // N = 848, one false answer in a million accepted per shot.
    let weather = Weather { false_edges: 3e9, ..CLEAR };
    for kind in [Matched, Blind, Literal] {
        let score = Sensor::printed(kind).score(0..1, sky, weather);
        assert_eq!((score.empty, score.false_returns), (848, 0), "{kind:?}");
    }
    // The same with a threshold that promises nothing must find something, or the test is blind.
    let mut careless = Sensor::printed(Matched);
    careless.matched().0.false_alarm = 1e3;
    let log = careless.log(0..1);
    let ticks = careless.ticks(&log, sky, weather);
    let returns = careless.receiver.decode(&careless.codebook, &log, &ticks).unwrap();
    // With ticks this dense, one shot in sixteen is searched for faint light.
    assert!(returns.rejected(Reject::NoPeak) < 848 - 848 / 16, "{:?}", returns.rejects);
}

/// Decodes with the labels of a sensor that has been fired with other ones.
fn decoded_with_other_labels(kind: macropulse::codec::decode::ReceiverKind) -> (u32, u64, u64) {
    let sensor = Sensor::printed(kind);
    let mut log = sensor.log(0..4);
    let ticks = sensor.ticks(&log, slope, CLEAR);
    for label in &mut log.label {
        *label = (*label + 341) % 848;
    }
    let returns = sensor.receiver.decode(&sensor.codebook, &log, &ticks).unwrap();
    let score = Score::new(&sensor.codebook, (&log, slope), &returns);
    let rejected = |reject| returns.rejected(reject);
    (score.right + score.wrong, rejected(Reject::LabelMismatch), rejected(Reject::UnknownShot))
}

#[test]
fn light_with_other_labels_is_rejected() {
    // N = 3392. Few lit bits, all at one end, can fit one end of another payload: the bits beyond
    // belong to no shot.
    let (answers, mismatches, _) = decoded_with_other_labels(Matched);
    assert!(answers < 170 && mismatches > 3200, "{answers} answers, {mismatches} rejects");
    let (answers, _, unknown) = decoded_with_other_labels(Blind);
    assert!(answers < 170 && unknown > 3000, "{answers} answers, {unknown} rejects");
}

#[test]
fn every_home_shot_of_the_matched_receiver_is_accounted_for() {
    let sensor = Sensor::printed(Matched);
    let log = sensor.log(10..13);
    let ticks = sensor.ticks(&log, car, Weather { seen: 0.7, ..CLEAR });
    let returns = sensor.receiver.decode(&sensor.codebook, &log, &ticks).unwrap();
    let rejects: u64 = returns.rejects.iter().sum();
    assert_eq!(returns.len() as u64 + rejects, 3 * 848);
    assert!(returns.shot.is_sorted());
    for column in [returns.tof.len(), returns.peak.len(), returns.marks.len()] {
        assert_eq!(column, returns.len());
    }
    assert!(returns.peak.iter().zip(&returns.marks).all(|(peak, marks)| peak <= marks));
    assert!(returns.margin.iter().zip(&returns.peak).all(|(margin, peak)| margin <= peak));
    // 70 % seen: μ = −ln 0.3 = 1.204.
    let mean = returns.photons.iter().sum::<f32>() / returns.len() as f32;
    assert!((mean - 1.204).abs() < 0.05, "{mean}");
}

#[test]
fn bands_find_what_the_whole_finds() {
    let sensor = Sensor::printed(Matched);
    let decoded = |rows| {
        let log = sensor.log(rows);
        let ticks = sensor.ticks(&log, slope, CLEAR);
        let returns = sensor.receiver.decode(&sensor.codebook, &log, &ticks).unwrap();
        let shots = returns.shot.iter().map(|&shot| log.first + u64::from(shot));
        shots.zip(returns.tof).collect::<Vec<_>>()
    };
    let pieces = [decoded(0..1), decoded(1..3), decoded(3..4)].concat();
    assert_eq!(decoded(0..4), pieces);
}

#[test]
fn a_log_without_shots_and_ticks_without_ticks_give_nothing() {
    for kind in [Matched, Blind, Literal] {
        let sensor = Sensor::printed(kind);
        let nothing = sensor
            .receiver
            .decode(&sensor.codebook, &Default::default(), &macropulse::codec::Ticks::default())
            .unwrap();
        assert_eq!(nothing, Default::default());
        let log = sensor.log(0..1);
        assert!(
            sensor
                .receiver
                .decode(&sensor.codebook, &log, &macropulse::codec::Ticks::default())
                .unwrap()
                .is_empty()
        );
        let ticks = sensor.ticks(&log, slope, CLEAR);
        let nothing =
            sensor.receiver.decode(&Codebook::single(), &Default::default(), &ticks).unwrap();
        assert!(nothing.is_empty());
    }
}

/// A wall at 105 m.
fn wall(_: u32, _: u32) -> Option<i64> {
    Some(280_000)
}

/// H0: where all light is faint, the quick receiver finds most of what the thorough one does. N = 2544 shots
/// of each of two walls: one mark in 30 of the first is seen, so that two thirds are found, and one in 40 of
/// the second.
#[test]
fn faint_walls_are_found_without_looking_everywhere() {
    for (seen, share) in [(0.033, 0.8), (0.025, 0.7)] {
        let weather = Weather { seen, ..CLEAR };
        let found = [Effort::Quick, Effort::Thorough].map(|effort| {
            let mut sensor = Sensor::printed(Matched);
            *sensor.matched().1 = effort;
            sensor.score(rows("random"), wall, weather)
        });
        let [quick, thorough] = found.map(|score| score.percent_right());
        assert!((5.0..80.0).contains(&thorough), "{seen}: {thorough:.2} %");
        assert!(quick > share * thorough, "{seen}: {quick:.2} % of {thorough:.2} %");
    }
}

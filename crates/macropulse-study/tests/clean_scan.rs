//! Results of each receiver on the clean car scene, and the number of samples that fall on the car.
//!
//! The detector sees every mark and nothing else, unless a test says otherwise; one seed.
#![allow(clippy::unwrap_used)]

use macropulse::channel::Operating;
use macropulse::codec::decode::Returns;
use macropulse::design::Design;
use macropulse::emit::{Band, bands, short_bands};
use macropulse::points::{Outcome, Piece, Scale};
use macropulse::scene::Scene;
use macropulse::score::{self, Score};
use macropulse::sim;
use macropulse_study::paper::{DISTANCES, PERFECT, SENSORS, predict};

const MISSED: &str = "detector.photon-counting.missed_marks";

fn open(sensor: &str, keys: &[(&str, &str)]) -> Design {
    let owned = |&(key, value): &(&str, &str)| (key.to_owned(), value.to_owned());
    Design::open(sensor, &keys.iter().map(owned).collect::<Vec<_>>()).unwrap()
}

/// The score of `sensor` under `receiver` on 46 lines, 39 008 shots, that hold the whole car at
/// 50 m and the road beside it.
fn clean(sensor: &str, receiver: &str, missed: &str) -> Score {
    let kind = [("receiver.kind", receiver), (MISSED, missed)];
    let design = open(sensor, &[PERFECT, &kind].concat());
    let scene = Scene::open("car-50m").unwrap();
    let car: Vec<Band> =
        short_bands(&design, 0).filter(|band| (252..297).contains(&(band.first / 848))).collect();
    let score = sim::scan_part(&design, &scene, 3, &car).unwrap().score;
    assert!(score.with_echo() > 10_000 && score.samples_on_target > 500, "{score:?}");
    score
}

#[track_caller]
fn assert_right(score: &Score, least: f64) {
    let right = score.right_fraction();
    assert!(right >= least, "{:.3} % right, {score:?}", 100.0 * right);
    assert_eq!(score.count(Outcome::False), 0, "{score:?}");
}

#[test]
fn matched_finds_all() {
    assert_right(&clean("kim-park-2016", "matched", "0.0"), 0.999);
}

#[test]
fn matched_finds_all_with_one_mark_in_five_missed() {
    assert_right(&clean("kim-park-2016", "matched", "0.2"), 0.999);
}

#[test]
fn blind_finds_all() {
    assert_right(&clean("kim-park-2016", "blind", "0.0"), 0.999);
}

/// 336 of the 847 columns with light begin with a lit bit: 39.7 % of pixels that see the road all
/// along; the car stands in columns that do not.
#[test]
fn literal_loses_the_columns_that_begin_in_the_dark() {
    let right = 100.0 * clean("kim-park-2016", "literal", "0.0").right_fraction();
    assert!((right - 39.5).abs() <= 0.5, "{right:.2} % right");
}

#[test]
fn literal_finds_all_of_the_repaired_payload() {
    assert_right(&clean("kim-park-2016-fixed", "literal", "0.0"), 0.999);
}

/// Without marks there is nothing to find: what passes above is not the scene's own doing.
#[test]
fn nothing_is_found_when_nearly_all_marks_are_missed() {
    let score = clean("kim-park-2016", "matched", "0.99");
    assert!(score.right_fraction() < 0.01, "{score:?}");
}

/// Samples on the car, without any light being sent.
fn samples_on_car(design: &Design, scene: &Scene) -> u64 {
    let scale = Scale::of(design, &Operating::of(design, &scene.environment).unwrap());
    let judged = bands(design, 0).map(|band| {
        let log = band.shot_log(design);
        let traced = scene.trace(design, &log);
        let mut nothing = Piece::of(design, &scale, &log, &Returns::default());
        score::judge(&mut nothing, design, scene, &log, &traced).samples_on_target
    });
    judged.sum()
}

#[test]
fn samples_on_the_car_are_those_that_its_silhouette_predicts() {
    for distance in DISTANCES {
        let scene = Scene::open(format!("car-{distance}m")).unwrap();
        for sensor in SENSORS {
            let design = open(sensor, &[]);
            let (samples, predicted) = (samples_on_car(&design, &scene), predict(&design, &scene));
            let band = predicted.low..=predicted.high;
            assert!(
                band.contains(&(samples as f64)),
                "{sensor} at {distance} m: {samples}, predicted {predicted:?}"
            );
            // Beyond the rated range of a sensor there is nothing to sample.
            assert_eq!(samples == 0, sensor == "peregrine" && distance == 120, "{sensor}");
        }
    }
}

#[test]
fn ten_and_twenty_times_as_many_samples_fall_on_the_car() {
    for distance in [30, 50, 70] {
        let scene = Scene::open(format!("car-{distance}m")).unwrap();
        let [ours, hdl, peregrine] =
            SENSORS.map(|sensor| samples_on_car(&open(sensor, &[]), &scene) as f64);
        assert!((8.5..12.5).contains(&(ours / hdl)), "{distance} m: {}", ours / hdl);
        assert!((18.0..25.0).contains(&(ours / peregrine)), "{distance} m: {}", ours / peregrine);
    }
}

#[test]
fn peregrine_has_no_point_at_120_m() {
    let scene = Scene::open("car-120m").unwrap();
    let score = sim::scan(&open("peregrine", &[]), &scene, 3, 0).unwrap().score;
    assert_eq!((score.samples_on_target, score.points_on_target), (0, 0));
    let near = sim::scan(&open("peregrine", &[]), &Scene::open("car-30m").unwrap(), 3, 0).unwrap();
    assert!(near.score.points_on_target > 100, "{:?}", near.score);
}

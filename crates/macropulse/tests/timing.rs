//! Ranges of ready sensors have no bias: from the shot to the point, against a target at a known range.
#![allow(clippy::unwrap_used)]

use std::collections::HashMap;
use std::path::Path;
use std::sync::OnceLock;

use macropulse::design::Design;
use macropulse::emit::{Band, bands, short_bands};
use macropulse::environment::Environment;
use macropulse::predict::Forecaster;
use macropulse::scene::Scene;
use macropulse::sim;
use macropulse::units::SPEED_OF_LIGHT;

/// Ranges, m: of no common phase of a tick.
const RANGES: [f64; 10] =
    [7.013, 12.347, 19.111, 25.5551, 33.3777, 41.0013, 48.7, 53.9191, 60.01, 66.6061];

/// A hollow sphere about the sensor: every shot meets it square on, at its radius.
fn room(range: f64, material: &str, environment: &str) -> Scene {
    let text = format!(
        "version = 1\nenvironment = \"{environment}\"\n[[object]]\nshape.sphere.radius_m = {range}\n\
         material = \"{material}\"\n"
    );
    Scene::from_toml(&text, "room", Path::new("")).unwrap()
}

/// Number, sum and sum of squares.
#[derive(Default, Clone, Copy)]
struct Sums(f64, f64, f64);

impl Sums {
    fn add(&mut self, error: f64) {
        (self.0, self.1, self.2) = (self.0 + 1.0, self.1 + error, self.2 + error * error);
    }

    fn add_all(&mut self, other: &Self) {
        (self.0, self.1, self.2) = (self.0 + other.0, self.1 + other.1, self.2 + other.2);
    }

    fn mean(&self) -> f64 {
        self.1 / self.0
    }

    /// The sum of squares, if every error were `shift` ticks more.
    fn squares_if_moved(&self, shift: f64) -> f64 {
        self.2 + shift * (2.0 * self.1 + shift * self.0)
    }

    /// By how many of its standard errors the mean is beyond a tenth of a tick.
    fn excess(&self) -> f64 {
        self.excess_if_moved(0.0)
    }

    /// The same, if every error were `shift` ticks more.
    fn excess_if_moved(&self, shift: f64) -> f64 {
        let mean = self.mean();
        let error = ((self.2 / self.0 - mean * mean).max(1e-6) / self.0).sqrt();
        ((mean + shift).abs() - 0.1) / error
    }
}

/// Errors of range in ticks: of all points at each range, and of those of each word.
type Errors = (Vec<Sums>, HashMap<u16, Sums>);

/// Ready sensors with a code, and the sun they work in.
const CODED: [(&str, &str); 6] = [
    ("kim-park-2016", "clear-day"),
    ("kim-park-2016-fixed", "clear-day"),
    ("kim-park-2016-physical", "vacuum-dark"),
    ("coded-practical", "clear-day"),
    ("coded-360", "clear-day"),
    ("bipolar-gold", "clear-day"),
];

/// The errors of one of [`CODED`], measured once for all tests.
fn errors_of(sensor: usize) -> &'static Errors {
    static MEASURED: [OnceLock<Errors>; CODED.len()] = [const { OnceLock::new() }; CODED.len()];
    let (name, environment) = CODED[sensor];
    MEASURED[sensor].get_or_init(|| errors(&Design::open(name, &[]).unwrap(), environment))
}

/// Measures one band at each range.
fn errors(design: &Design, environment: &str) -> Errors {
    let all: Vec<Band> = short_bands(design, 0).collect();
    let (mut of_range, mut of_word) = (Vec::new(), HashMap::<u16, Sums>::new());
    let metres = design.clock.tick_fs as f64 * 1e-15 * SPEED_OF_LIGHT / 2.0;
    for (number, range) in RANGES.into_iter().enumerate() {
        let part = [all[number % all.len()]];
        let mut words = HashMap::new();
        for log in part.iter().map(|band| band.shot_log(design)) {
            for shot in log.owned.clone() {
                words.insert((log.row[shot], log.column[shot]), log.word[shot]);
            }
        }
        let room = room(range, "white", environment);
        let cloud = sim::scan_part(design, &room, 1, &part).unwrap().cloud();
        let mut sums = Sums::default();
        for at in 0..cloud.range.len() {
            let error = (f64::from(cloud.range[at]) - range) / metres;
            // False returns are no measurement of this target.
            if error.abs() * metres > design.right_within {
                continue;
            }
            sums.add(error);
            let word = words[&(cloud.row[at], cloud.column[at])];
            of_word.entry(word).or_default().add(error);
        }
        of_range.push(sums);
    }
    (of_range, of_word)
}

/// H0: at every range, and of every code word, the mean error is no more than a tenth of a tick. One band at
/// each of ten ranges, N = 16 960 shots or more a sensor, seed 1. Rejected at 4.5 standard errors beyond, α =
/// 7e-6 for each of the 400 means. Nearer than 10 m white light is so strong for kim-park-2016-physical that
/// it lights every tick that a micropulse reaches into. Then nothing undoes the rounding, and this range is
/// left out. Control: the same ranges half a tick farther away are rejected.
#[test]
fn coded_sensors_measure_ranges_without_bias() {
    let mut biased = Vec::new();
    for (sensor, (name, _)) in CODED.into_iter().enumerate() {
        let (of_range, of_word) = errors_of(sensor);
        let blinding = if name == "kim-park-2016-physical" { 10.0 } else { 0.0 };
        let told = |(range, sums): &(&f64, &Sums)| **range > blinding && sums.0 > 50.0;
        for (range, sums) in RANGES.iter().zip(of_range).filter(told) {
            let mean = sums.1 / sums.0;
            if sums.excess() > 4.5 {
                biased.push(format!("{name} at {range} m: {mean:+.3} ticks"));
            }
        }
        for (word, sums) in of_word.iter().filter(|(_, sums)| sums.0 > 50.0) {
            let mean = sums.1 / sums.0;
            if sums.excess() > 4.5 {
                biased.push(format!("{name}, word {word}: {mean:+.3} ticks"));
            }
        }
    }
    assert!(biased.is_empty(), "{biased:?}");
    let control = |sums: &Sums| sums.excess_if_moved(0.5) > 4.5;
    assert!(errors_of(0).0.iter().all(control), "the control was not rejected");
}

/// Errors of range in ticks at each of the ranges, in whole scans, each range with a seed of its own.
fn errors_of_scans(design: &Design, material: &str, scans: u64) -> [Sums; 10] {
    let all: Vec<Band> = (0..scans).flat_map(|scan| bands(design, scan)).collect();
    let metres = design.clock.tick_fs as f64 * 1e-15 * SPEED_OF_LIGHT / 2.0;
    let mut seed = 0;
    RANGES.map(|range| {
        seed += 1;
        let room = room(range, material, "clear-day");
        let cloud = sim::scan_part(design, &room, seed, &all).unwrap().cloud();
        let mut sums = Sums::default();
        let errors = cloud.range.iter().map(|found| f64::from(*found) - range);
        // A detector that fires by itself does not measure this target.
        errors.filter(|error| error.abs() < 1.0).for_each(|error| sums.add(error / metres));
        sums
    })
}

/// H0: over ten ranges the rms error is no more than 1.2 times the forecast, of white by day, or by night
/// where the sun leaves nothing. N = 16 960 points or more a sensor and range of those with a code, 28 928 of
/// vlp-16, 12 288 of peregrine. The root of the mean square over the ranges has a standard error below 0.3 %.
/// Ranges are taken together, as how precise a point is depends on where in a tick it comes, over which the
/// forecast is a mean. Sidelobes are no part of it: what is farther off than a right point may be is left
/// out. Control: with every range half a tick farther away it is rejected.
#[test]
fn points_are_as_precise_as_forecast() {
    let mut worse = Vec::new();
    for (sensor, (name, environment)) in CODED.into_iter().enumerate() {
        // Its light near by is more than it can time.
        if name == "kim-park-2016-physical" {
            continue;
        }
        let design = Design::open(name, &[]).unwrap();
        let ratio = against_forecast(&design, environment, (&errors_of(sensor).0, 0.0));
        worse.extend((ratio > 1.2).then(|| format!("{name}: {ratio:.3} of the forecast")));
    }
    for (name, scans) in [("vlp-16", 1), ("hdl-64e", 1), ("peregrine", 3)] {
        let design = Design::open(name, &[]).unwrap();
        let ratio = against_forecast(
            &design,
            "clear-day",
            (&errors_of_scans(&design, "white", scans), 0.0),
        );
        worse.extend((ratio > 1.2).then(|| format!("{name}: {ratio:.3} of the forecast")));
    }
    assert!(worse.is_empty(), "{worse:?}");
    let sensor = CODED.iter().position(|(name, _)| *name == "coded-practical").unwrap();
    let design = Design::open("coded-practical", &[]).unwrap();
    let control = against_forecast(&design, "clear-day", (&errors_of(sensor).0, 0.5));
    assert!(control > 1.2, "the control was not rejected");
}

/// The rms error over all ranges, of white, if every error were `shift` ticks more, over the forecast of it.
fn against_forecast(design: &Design, environment: &str, (of_range, shift): (&[Sums], f64)) -> f64 {
    let around = Environment::named(environment).unwrap();
    let forecaster = Forecaster::new(design, &around).unwrap();
    let metres = design.clock.tick_fs as f64 * 1e-15 * SPEED_OF_LIGHT / 2.0;
    let told = RANGES.iter().zip(of_range).filter(|(_, sums)| sums.0 > 1000.0);
    let pairs: Vec<[f64; 2]> = told
        .map(|(range, sums)| {
            let forecast = forecaster.forecast(1.0, *range).precision.unwrap() / metres;
            [sums.squares_if_moved(shift) / sums.0, forecast * forecast]
        })
        .collect();
    assert!(pairs.len() >= 8, "{}: points at {} ranges", design.name, pairs.len());
    let [found, forecast] = [0, 1].map(|at| pairs.iter().map(|pair| pair[at]).sum::<f64>());
    (found / forecast).sqrt()
}

/// Coded sensors, and the probabilities of detection at which the mean error of their ranges is measured.
///
/// FIXME: of coded-360 what is seen once in three shots is 0.11 to 0.12 ticks too near.
const FAINT: [(&str, &[f64]); 5] = [
    ("coded-32", &[0.3, 0.7, 0.95]),
    ("coded-practical", &[0.3, 0.7, 0.95]),
    ("coded-16", &[0.3, 0.7]),
    ("coded-360", &[0.7, 0.95]),
    ("bipolar-gold", &[0.3, 0.7, 0.95]),
];

/// H0: where one shot in three to nineteen in twenty are seen, the mean error of range is no more than a tenth of a
/// tick. N = 8000 to 12 000 shots at 45 and at 101 m, seed 1; rejected at 4.5 standard errors beyond. Control: with a
/// fifth of a tick more or less they are rejected.
fn is_without_bias(sensors: &[(&str, &[f64])]) {
    for (name, all_wanted) in sensors {
        let design = Design::open(name, &[]).unwrap();
        let forecaster = Forecaster::new(&design, &Environment::default()).unwrap();
        let part: Vec<Band> = short_bands(&design, 0).step_by(36).collect();
        for (range, wanted) in [44.5155, 100.9695]
            .iter()
            .flat_map(|range| all_wanted.iter().map(move |pd| (*range, *pd)))
        {
            let paint = reflectance(&forecaster, wanted, range);
            let sums = errors_of_paint(&design, &part, (paint, range));
            let at = format!("{name}, Pd {wanted} at {range} m: {:+.3} ticks", sums.mean());
            assert!(sums.0 > 1300.0, "{at}, {} points", sums.0);
            assert!(sums.excess() <= 4.5, "{at}");
            let control = [-0.2, 0.2].map(|shift| sums.excess_if_moved(shift));
            assert!(control.iter().any(|excess| *excess > 4.5), "{at}: no power");
        }
    }
}

#[test]
fn what_is_just_seen_is_neither_nearer_nor_farther() {
    is_without_bias(&FAINT[..2]);
}

#[test]
#[ignore = "slow: before a release"]
fn what_other_sensors_just_see_is_neither_nearer_nor_farther() {
    is_without_bias(&FAINT[2..]);
}

/// Errors of range in ticks, of right points, in a room of such a reflectance and range.
fn errors_of_paint(design: &Design, part: &[Band], (paint, range): (f64, f64)) -> Sums {
    let text = format!(
        "version = 1\nenvironment = \"clear-day\"\n[[material]]\nname = \"paint\"\n\
         diffuse = {paint}\n[[object]]\nshape.sphere.radius_m = {range}\nmaterial = \"paint\"\n"
    );
    let scene = Scene::from_toml(&text, "room", Path::new("")).unwrap();
    let cloud = sim::scan_part(design, &scene, 1, part).unwrap().cloud();
    let metres = design.clock.tick_fs as f64 * 1e-15 * SPEED_OF_LIGHT / 2.0;
    let mut sums = Sums::default();
    let errors = cloud.range.iter().map(|found| f64::from(*found) - range);
    let right = errors.filter(|error| error.abs() <= design.right_within);
    right.for_each(|error| sums.add(error / metres));
    sums
}

/// The reflectance that is seen with probability `wanted` at `range`.
fn reflectance(forecaster: &Forecaster, wanted: f64, range: f64) -> f64 {
    let (mut low, mut high) = (1e-4_f64, 1.0);
    for _ in 0..30 {
        let middle = (low * high).sqrt();
        if forecaster.forecast(middle, range).pd < wanted { low = middle } else { high = middle }
    }
    high
}

/// H0: at every range, and over all of them, the mean error is no more than a tenth of a tick. It is so in
/// strong light, where the walk is largest, and in faint light, where few more photons come than fire the
/// detector. N = 288 000 shots a range of hdl-64e, 163 840 of peregrine, seeds 1 to 10. Rejected at 4.5
/// standard errors beyond, α = 7e-6 for each of at most 66 means. Control: with 0.2 ticks less, the errors
/// over all white targets are rejected. Peregrine would have this bias if it were calibrated for the walk at
/// the mean of what is drawn.
#[test]
fn classical_sensors_measure_ranges_without_bias() {
    let mut biased = Vec::new();
    for (name, scans) in [("hdl-64e", 1), ("hdl-64e-equal-spacing", 1), ("peregrine", 40)] {
        let design = Design::open(name, &[]).unwrap();
        for material in ["white", "grey10"] {
            let of_range = errors_of_scans(&design, material, scans);
            let mut over_all = Sums::default();
            for (range, sums) in RANGES.iter().zip(&of_range) {
                if sums.0 > 1000.0 {
                    over_all.add_all(sums);
                    if sums.excess() > 4.5 {
                        biased
                            .push(format!("{name}, {material} at {range} m: {:+.3}", sums.mean()));
                    }
                }
            }
            if over_all.excess() > 4.5 {
                biased.push(format!("{name}, {material}: {:+.3} ticks", over_all.mean()));
            }
            let control = over_all.excess_if_moved(-0.2);
            assert!(material != "white" || control > 4.5, "{name}: the control was not rejected");
        }
    }
    assert!(biased.is_empty(), "{biased:?}");
}

//! Theory beside simulation: what `predict` says of a target, and what a scan of it gives.
//!
//! The sensor stands at the centre of a hollow sphere, so that every shot meets the same surface
//! square on at the same range.
#![allow(clippy::unwrap_used)]

use std::path::Path;

use macropulse::channel::{Echo, Light, Operating, light_of_echoes};
use macropulse::codec::ShotLog;
use macropulse::design::Design;
use macropulse::design::detector::Lit;
use macropulse::detect::{Detectors, Memory};
use macropulse::emit::{Band, short_bands};
use macropulse::environment::Environment;
use macropulse::points::Outcome;
use macropulse::predict::Forecaster;
use macropulse::predict::converters::bank_loss;
use macropulse::random::Chance;
use macropulse::scene::Scene;
use macropulse::sim::{self, Scan};
use macropulse::tdc::{self, Wanted};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Chance of a false alarm in each comparison of this file.
const ALPHA: f64 = 1e-4;

fn sensor(name: &str, set: &[(&str, &str)]) -> Design {
    let owned = |&(key, value): &(&str, &str)| (key.to_owned(), value.to_owned());
    Design::open(name, &set.iter().map(owned).collect::<Vec<_>>()).unwrap()
}

/// Returns the operating state of a sensor with neither air nor sunlight around it.
fn in_the_dark(design: &Design) -> Operating {
    Operating::of(design, &Environment::vacuum_dark()).unwrap()
}

/// Returns the probability that a mark of this number of photons makes an event, if nothing else falls on the
/// detector.
fn mark_pd(design: &Design, photons: f64) -> f64 {
    let background = in_the_dark(design).background;
    design.detector.model().mark_pd(&Lit { photons, background, falling: 0.0 })
}

/// A hollow sphere of a matt material about the sensor.
fn room(range: f64, reflectance: f64, environment: &str) -> Scene {
    let text = format!(
        "version = 1\nenvironment = \"{environment}\"\n[[material]]\nname = \"paint\"\ndiffuse = {reflectance}\n\
         [[object]]\nshape.sphere.radius_m = {range}\nmaterial = \"paint\"\n"
    );
    Scene::from_toml(&text, "room", Path::new("")).unwrap()
}

/// Some `count` bands of one scan, spread over it.
fn measure(design: &Design, scene: &Scene, seed: u64, count: usize) -> Scan {
    let all: Vec<Band> = short_bands(design, 0).collect();
    let part: Vec<Band> = all.iter().step_by(all.len().div_ceil(count)).copied().collect();
    sim::scan_part(design, scene, seed, &part).unwrap()
}

/// Returns true if `count` of `trials` may well have come with probability `share`: neither tail of the
/// binomial distribution beyond it is below half of [`ALPHA`].
fn agrees(count: u64, trials: u64, share: f64) -> bool {
    if share <= 0.0 || share >= 1.0 {
        return count as f64 == trials as f64 * share.clamp(0.0, 1.0);
    }
    let (k, n) = (count as f64, trials as f64);
    let log_choose = libm::lgamma(n + 1.0) - libm::lgamma(k + 1.0) - libm::lgamma(n - k + 1.0);
    let at = (log_choose + k * share.ln() + (n - k) * (-share).ln_1p()).exp();
    // Away from the mean terms only fall.
    let tail = |step: f64| {
        let (mut term, mut sum, mut j) = (at, 0.0, k);
        while term > sum * 1e-12 && (0.0..=n).contains(&j) {
            sum += term;
            term *= match step > 0.0 {
                true => share / (1.0 - share) * (n - j) / (j + 1.0),
                false => (1.0 - share) / share * j / (n - j + 1.0),
            };
            j += step;
        }
        sum
    };
    let outwards = if k > n * share { 1.0 } else { -1.0 };
    tail(outwards) > ALPHA / 2.0
}

#[test]
fn the_comparison_knows_the_binomial() {
    assert!(agrees(50, 100, 0.5) && agrees(0, 100, 1e-9) && agrees(35, 100, 0.5));
    assert!(!agrees(75, 100, 0.5) && !agrees(25, 100, 0.5) && !agrees(3, 1000, 1e-6));
}

/// Pixels whose shot gave a return of its own target, and those with an echo.
fn detected(scan: &Scan) -> (u64, u64) {
    let score = &scan.score;
    (score.count(Outcome::Right) + score.count(Outcome::Near), score.with_echo())
}

/// Places, range and reflectance, in an environment: N = 1694 lit shots in each case, seed 1. Control: the forecast
/// for twice the light is rejected wherever detection is neither certain nor hopeless. Returns in how many cases.
fn paper_fails_as_predicted(environment: &str, places: &[(f64, f64)]) -> usize {
    // If the light is faint, a sidelobe may win, up to 0.3 m farther: not beyond the gate.
    let keys = [("receiver.effort", "\"thorough\""), ("scan.gate_beyond_m", "1.0")];
    let design = sensor("kim-park-2016-physical", &keys);
    let sky = Environment::named(environment).unwrap();
    let mut graded = 0;
    for &(range, white) in places {
        let forecaster = Forecaster::new(&design, &sky).unwrap();
        let predicted = forecaster.forecast(white, range).pd;
        let room = room(range * 0.9999, white, environment);
        let (found, shots) = detected(&measure(&design, &room, 1, 1));
        assert!(
            agrees(found, shots, predicted),
            "{environment}, {range} m: {found} of {shots}, predicted {predicted}"
        );
        if environment == "clear-day" {
            assert_eq!(found, 0, "{range} m: sunlight in every chip");
        }
        if (0.001..0.999).contains(&predicted) {
            let brighter = forecaster.with_light(2.0).forecast(white, range).pd;
            assert!(!agrees(found, shots, brighter), "{environment}, {range} m: {brighter}");
            graded += 1;
        }
    }
    graded
}

#[test]
fn the_sensor_of_the_paper_fails_as_predicted_with_honest_light() {
    let graded = paper_fails_as_predicted("night", &[(10.0, 1.0), (150.0, 0.8), (150.0, 0.6)]);
    assert!(graded >= 2, "{graded} cases can tell right from wrong");
}

/// By day it sees nothing, which takes long to find out.
#[test]
#[ignore = "slow: before a release"]
fn the_sensor_of_the_paper_fails_by_day_as_predicted() {
    paper_fails_as_predicted("clear-day", &[(10.0, 1.0), (150.0, 1.0)]);
    paper_fails_as_predicted("night", &[(20.0, 1.0), (50.0, 1.0), (150.0, 1.0)]);
}

/// N = 1694 lit shots, seed 1: where every fifth place is lit by the sun the forecast is right to a tenth, 0.282 where
/// 0.270 is found. Control: without its sunlight it is far off.
#[test]
#[ignore = "slow: before a release"]
fn in_dense_light_the_forecast_is_right_to_a_tenth() {
    let set = [("optics.field", "\"in-flight\""), ("receiver.effort", "\"thorough\"")];
    let design = sensor("kim-park-2016-physical", &set);
    let (found, shots) = detected(&measure(&design, &room(90.49, 1.0, "clear-day"), 1, 1));
    let forecaster = Forecaster::new(&design, &Environment::default()).unwrap();
    let share = found as f64 / shots as f64;
    let predicted = forecaster.forecast(1.0, 90.5).pd;
    assert!((0.9..1.1).contains(&(share / predicted)), "{share}, predicted {predicted}");
    assert!(forecaster.with_background(0.0).forecast(1.0, 90.5).pd > 0.99);
}

/// N > 5000 shots of each of three sensors on a wall all around by night, seed 5. At reflectances with a
/// forecast of 0.1, 0.4, 0.7 and 0.95, the thorough receiver finds that share. It does so to 0.02 and 4 % of
/// the light, on which the share depends steeply. Control: it does not find the forecast for a tenth more
/// light, in half of the cases.
#[test]
fn a_thorough_receiver_finds_what_is_forecast() {
    let night = Environment::named("night").unwrap();
    let (mut off, mut brighter_off) = (Vec::new(), 0);
    for (name, range, bands) in
        [("kim-park-2016", 120.0, 3), ("coded-360", 120.0, 6), ("coded-practical", 85.0, 3)]
    {
        let design = sensor(name, &[("receiver.effort", "\"thorough\"")]);
        let forecast = Forecaster::new(&design, &night).unwrap();
        for wanted in [0.1, 0.4, 0.7, 0.95] {
            let reflectance = 0.01 * forecast.light_needed(wanted, 0.01, range).unwrap();
            let room = room(range, reflectance, "night");
            let (found, shots) = detected(&measure(&design, &room, 5, bands));
            let share = found as f64 / shots as f64;
            let is_far = |forecaster: &Forecaster| {
                let [less, more] = [0.96, 1.04]
                    .map(|light| forecaster.with_light(light).forecast(reflectance, range).pd);
                share < less - 0.02 || share > more + 0.02
            };
            assert!(shots > 5000, "{shots}");
            if is_far(&forecast) {
                off.push((name, wanted, share));
            }
            brighter_off += usize::from(is_far(&forecast.with_light(1.1)));
        }
    }
    assert!(off.is_empty(), "{off:?}");
    assert!(brighter_off >= 6, "{brighter_off}");
}

/// The first band of a sensor, an echo of `photons` detected per mark from 20 m for every shot.
fn lit(design: &Design, photons: f64) -> (ShotLog, Light<'_>) {
    let log = short_bands(design, 0).next().unwrap().shot_log(design);
    let echo = |shot| Echo { shot, delay_fs: 133_426_000, photons };
    let light = light_of_echoes(design, &log, (0..log.len()).map(echo));
    (log, light)
}

/// A sensor with the detector written in `lines`, without any dark count worth the name.
fn with_detector(lines: &str) -> Design {
    let text = format!(
        "version = 1\nextends = \"kim-park-2016-physical\"\nname = \"mine\"\n\
         idealised = [\"detector-bandwidth\", \"footprint\", \"inter-chip\", \
         \"mirror-motion\"]\n{lines}"
    );
    Design::from_toml(&text, "mine", Path::new(""), &[]).unwrap()
}

/// N = 310 000 marks for each of nine signals from 10⁻³ to 10 photons, seed 2. Control: the
/// prediction for a tenth more light is rejected in most cases.
#[test]
fn marks_are_seen_as_predicted_over_four_decades_of_light() {
    let detectors = [
        "[detector.photon-counting]\nefficiency = 0.25\nmissed_marks = 0.1\njitter_ps = 0.0",
        "[detector.geiger]\nefficiency = 0.25\ncells = 1000000\ndead_time_ns = 5.0",
        "[comparator]\nfalse_alarm_hz = 1.0\n[detector.photodiode]\nefficiency = 0.8\ngain = 100.0\n\
         ionisation_ratio = 0.02\nbandwidth_mhz = 124800.0\namplifier_pa_rthz = 23.0",
    ];
    for lines in detectors {
        let design = with_detector(lines);
        // A linear detector takes photons in proportion to its threshold.
        let noise = design.detector.model().noise(0.0);
        let unit = noise.map_or(1.0, |noise| noise.threshold / 3.0);
        let (mut told_apart, mut some) = (0, 0);
        for step in 0..9 {
            let photons = unit * 10_f64.powf(-3.0 + 0.5 * f64::from(step));
            let (log, light) = lit(&design, photons);
            let marks: u64 = log
                .label
                .iter()
                .zip(&log.word)
                .map(|(&label, &word)| {
                    design.emission.coding().codebook.marks(label, word).len() as u64
                })
                .sum();
            let detectors = Detectors::new(&design, &in_the_dark(&design), Chance::new(2));
            let found = detectors.detections(&log, &light, &mut Memory::default());
            // Several photons of one mark are one tick.
            let events = tdc::ticks(&design, found, Wanted::ALL).ticks.tick.len() as u64;
            let predicted = mark_pd(&design, photons);
            assert!(
                agrees(events, marks, predicted),
                "{lines}: {photons} photons, {events} of {marks}, predicted {predicted}"
            );
            let brighter = mark_pd(&design, 1.1 * photons);
            some += u32::from((1e-4..0.9999).contains(&predicted));
            told_apart += u32::from(!agrees(events, marks, brighter));
        }
        assert!(some >= 3 && told_apart + 1 >= some.min(5), "{lines}: {told_apart} of {some}");
    }
}

/// Dark counts alone, N some 10⁵, seed 3. Control: the rate without dead time is rejected.
#[test]
fn blind_cells_lose_what_is_predicted() {
    for (cells, rate) in [(1, 1e8), (4, 1e9), (64, 1e10)] {
        let design = with_detector(&format!(
            "[detector.geiger]\nefficiency = 0.25\ncells = {cells}\ndead_time_ns = 10.0\n\
             dark_counts_hz = {rate}"
        ));
        let mut events = 0;
        let mut seconds = 0.0;
        for band in short_bands(&design, 0).take(8) {
            let log = band.shot_log(&design);
            let detectors = Detectors::new(&design, &in_the_dark(&design), Chance::new(3));
            let found = detectors.detections(&log, &Light::default(), &mut Memory::default());
            events += found.time.len();
            let lasts = log.fired_at_fs[log.len() - 1] - log.fired_at_fs[0] + design.listening_fs();
            seconds += lasts as f64 * 1e-15;
        }
        let predicted = rate * design.detector.model().ready_share(rate) * seconds;
        // A renewal process with a dead time is no more irregular than Poisson.
        let deviations = (events as f64 - predicted).abs() / predicted.sqrt();
        assert!(deviations < 3.9, "{cells} cells: {events}, predicted {predicted}");
        let blindless = rate * seconds;
        assert!((events as f64 - blindless).abs() / blindless.sqrt() > 10.0);
    }
}

/// N = 150 000 events, seed 4. Control: one converter more is rejected.
#[test]
fn a_small_bank_loses_what_erlang_says() {
    for converters in [1, 3, 6] {
        let count = converters.to_string();
        let design = sensor(
            "kim-park-2016",
            &[
                ("tdc.converters", count.as_str()),
                ("detector.photon-counting.dark_counts_hz", "1e9"),
            ],
        );
        let (mut events, mut lost) = (0, 0);
        for band in short_bands(&design, 0).take(4) {
            let log = band.shot_log(&design);
            let detectors = Detectors::new(&design, &in_the_dark(&design), Chance::new(4));
            let found = detectors.detections(&log, &Light::default(), &mut Memory::default());
            let ticks = tdc::ticks(&design, found, Wanted::ALL);
            events += ticks.ticks.tick.len() as u64 + ticks.lost;
            lost += ticks.lost;
        }
        let mut bank = design.bank().unwrap();
        // Losses come in runs: a tenth of the count is independent.
        let independent = events / 10;
        assert!(
            agrees(lost / 10, independent, bank_loss(&bank, 1e9)),
            "{converters}: {lost} of {events}, predicted {}",
            bank_loss(&bank, 1e9)
        );
        bank.converters += 1;
        assert!(!agrees(lost / 10, independent, bank_loss(&bank, 1e9)), "{converters}");
    }
}

/// N = 5000 pixels on a wall, which meet all phases of a tick; seed 1. A standard deviation from 5000 is
/// known to 1 %. Control: rounding alone, and jitter alone, are rejected.
#[test]
fn range_is_as_precise_as_predicted() {
    let wall = Scene::open("wall").unwrap();
    let spread = |jitter: &str| {
        let set = [
            ("detector.photon-counting.jitter_ps", jitter),
            ("detector.photon-counting.dark_counts_hz", "0.0"),
        ];
        let design = sensor("kim-park-2016-fixed", &set);
        let cloud = measure(&design, &wall, 1, 3).cloud();
        let truth = &cloud.truth.returns;
        let right = (0..truth.range.len()).filter(|&i| truth.outcome[i] == Outcome::Right);
        let error = |i| f64::from(cloud.range[i]) - f64::from(truth.range[i]);
        let errors: Vec<f64> = right.map(error).collect();
        let mean = errors.iter().sum::<f64>() / errors.len() as f64;
        let square = errors.iter().map(|error| (error - mean).powi(2)).sum::<f64>();
        let forecaster = Forecaster::new(&design, &wall.environment).unwrap();
        let forecast = forecaster.forecast(1.0, 50.0);
        let precision = forecast.precision.unwrap();
        assert!(forecast.bound < precision);
        ((square / errors.len() as f64).sqrt(), precision)
    };
    let (rounding, _) = spread("0.0");
    for jitter in ["0.0", "0.3", "0.5"] {
        let (measured, predicted) = spread(jitter);
        // The receiver sees 58 to 319 marks, and rounding is undone the better the more they are; the
        // forecast has their mean.
        assert!((measured / predicted - 1.0).abs() < 0.15, "{jitter} ps: {measured}, {predicted}");
        let differs = (measured / rounding - 1.0).abs() > 0.04;
        assert_eq!(differs, jitter != "0.0", "{jitter} ps");
    }
    for (name, range) in [("hdl-64e", 50.0), ("peregrine", 40.0)] {
        let design = sensor(name, &[]);
        let cloud = measure(&design, &room(range, 0.5, "vacuum-dark"), 6, usize::MAX).cloud();
        let errors = cloud.range.iter().map(|seen| f64::from(*seen) - range);
        // Firings of noise are no measurement of this target.
        let errors: Vec<f64> = errors.filter(|error| error.abs() < 0.35).collect();
        let square = errors.iter().map(|error| error * error).sum::<f64>();
        let measured = (square / errors.len() as f64).sqrt();
        let forecaster = Forecaster::new(&design, &Environment::vacuum_dark()).unwrap();
        let predicted = forecaster.forecast(0.5, range).precision.unwrap();
        assert!((measured / predicted - 1.0).abs() < 0.05, "{name}: {measured}, {predicted}");
    }
    // If jitter is wide, the receiver's choice of a window costs it some of what is predicted.
    let (measured, predicted) = spread("2.5");
    assert!((0.95..1.3).contains(&(measured / predicted)), "{measured}, {predicted}");
}

/// N = 1696 shots into the open, seed 1: what is accepted is a bound, far from what chance gives. Control: a receiver that
/// accepts one false return in two shots breaks the bound of one that accepts one in 100 000.
#[test]
fn false_returns_stay_below_what_is_predicted() {
    let sky = "version = 1\n[[object]]\nshape.sphere.radius_m = 1\nposition_m = [-50, 0, 0]\n";
    let sky = Scene::from_toml(sky, "sky", Path::new("")).unwrap();
    let run = |alarm: &str| {
        let set = [
            ("detector.photon-counting.jitter_ps", "0.0"),
            ("detector.photon-counting.dark_counts_hz", "1e10"),
            ("receiver.false_alarm", alarm),
            ("receiver.effort", "\"thorough\""),
            ("scan.max_range_m", "60"),
        ];
        let design = sensor("kim-park-2016-fixed", &set);
        let forecaster = Forecaster::new(&design, &sky.environment).unwrap();
        let forecast = forecaster.forecast(1e-9, 50.0);
        let scan = measure(&design, &sky, 1, 1);
        let found = scan.score.count(Outcome::False);
        (found, scan.tally.shots, forecast.false_per_shot)
    };
    let (found, shots, strict) = run("1e-5");
    assert!(found as f64 <= shots as f64 * strict || agrees(found, shots, strict));
    let (found, shots, lax) = run("0.5");
    assert!(found as f64 <= shots as f64 * lax || agrees(found, shots, lax));
    assert!(found as f64 > shots as f64 * strict && !agrees(found, shots, strict));
}

/// N = 133 000 and 4096 shots, seed 5: a detector that fires once is blind after a false firing.
/// Control: without the false firings before the target the prediction is rejected.
#[test]
fn noise_before_the_target_costs_a_single_firing() {
    for (name, range, rate) in [("hdl-64e", 60.0, "2e5"), ("peregrine", 40.0, "1e6")] {
        let set = [("detector.single-stop.false_firing_hz", rate)];
        let design = sensor(name, &set);
        let room = room(range, 0.5, "vacuum-dark");
        let forecaster = Forecaster::new(&design, &room.environment).unwrap();
        let forecast = forecaster.forecast(0.5, range);
        let (found, shots) = detected(&measure(&design, &room, 5, usize::MAX));
        assert!(
            agrees(found, shots, forecast.pd),
            "{name}: {found} of {shots}, predicted {}",
            forecast.pd
        );
        assert!(!agrees(found, shots, forecast.mark_pd), "{name}");
    }
}

/// The share of shots whose echo is the first event in its gate, of one cell that works all the time, event by
/// event: `rate` counts a second, an echo 0.4 us after each shot seen with `pd`, shots 1 us apart.
fn chain(shots: u32, dead: f64, rate: f64, pd: f64) -> f64 {
    let mut chance = ChaCha8Rng::seed_from_u64(12);
    let mut wait = || -> f64 { -(1.0 - chance.random::<f64>()).ln() / rate };
    let (mut noise, mut armed, mut hits) = (wait(), 0.0, 0_u32);
    let mut echoes = ChaCha8Rng::seed_from_u64(13);
    for shot in 0..shots {
        let [opens, echo, closes] = [0.003, 0.4, 0.6].map(|us| (f64::from(shot) + us) * 1e-6);
        let mut has_fired = false;
        while noise < echo {
            if noise >= armed {
                armed = noise + dead;
                has_fired |= noise > opens;
            }
            noise += wait();
        }
        if echoes.random::<f64>() < pd && echo >= armed {
            armed = echo + dead;
            hits += u32::from(!has_fired);
        }
        while noise < closes {
            armed = if noise >= armed { noise + dead } else { armed };
            noise += wait();
        }
    }
    f64::from(hits) / f64::from(shots)
}

/// N = 100 000 shots each, seed 8, beside the forecast and beside a chain of events. Control: a cell that is
/// armed at each gate as often as counts alone leave it. It would see more echoes where counts are rare and
/// it is dead over the pause.
#[test]
fn a_cell_remembers_what_it_saw_before_the_gate_opened() {
    for (dead_ns, rate) in [(300.0, 1e5), (1500.0, 1e5), (3200.0, 1e5), (1500.0, 1e6)] {
        let text = format!(
            "version = 1\nname = \"mine\"\nidealised = [\"footprint\", \"mirror-motion\", \
             \"link-budget\", \"eye-safety\"]\nscan.scans_per_s = 10.0\nscan.max_range_m = 90.0\n\
             scan.raster = {{ rows = 100, columns = 1000, horizontal_deg = 20.0, vertical_deg = 10.0 }}\n\
             light = {{ wavelength_nm = 905.0, pulse_ps = 100.0 }}\n[detector.geiger]\n\
             sensitivity = {{ range_m = 60.0, reflectance = 0.1, pd = 0.15 }}\ncells = 1\n\
             dead_time_ns = {dead_ns}\ndark_counts_hz = {rate}\njitter_ps = 0.0\n\
             [tdc]\nresolution_ps = 100.0\nclock_ps = 1000.0\nbits = 10\n\
             [receiver]\nkind = \"direct\"\n"
        );
        let design = Design::from_toml(&text, "mine", Path::new(""), &[]).unwrap();
        let room = room(60.0, 0.1, "vacuum-dark");
        let (found, shots) = detected(&measure(&design, &room, 8, usize::MAX));
        let forecast = Forecaster::new(&design, &room.environment).unwrap().forecast(0.1, 60.0).pd;
        assert!(agrees(found, shots, forecast), "{dead_ns}: {found}, forecast {forecast}");
        let chain = chain(4_000_000, dead_ns * 1e-9, rate, 0.15);
        assert!(agrees(found, shots, chain), "{dead_ns}: {found}, chain {chain}");
        let blind = rate * dead_ns * 1e-9;
        let forgets = 0.15 * (1.0 - rate * 4e-7 / (1.0 + blind)).min(1.0 / (1.0 + blind));
        let is_told = dead_ns > 1000.0 && blind < 1.0;
        assert!(!is_told || !agrees(found, shots, forgets), "{dead_ns}: {forgets}");
    }
}

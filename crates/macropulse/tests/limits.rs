//! A sensor that is accepted works: whatever keys are at their limits, it is simulated and forecast, and
//! nothing that comes of it is not finite.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::path::Path;

use macropulse::design::{Design, Detector, schema};
use macropulse::emit::{Band, bands};
use macropulse::environment::Environment;
use macropulse::predict::{Error, Forecaster};
use macropulse::scene::Scene;
use macropulse::sim;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::Value;

/// Sensors with every kind of detector, pattern and receiver.
const SENSORS: [(&str, &str); 9] = [
    ("kim-park-2016", ""),
    ("kim-park-2016", GEIGER),
    ("kim-park-2016-physical", "optics.field = \"descanned\"\nlight.energy = { shot_nj = 1.0 }"),
    ("bipolar-gold", ""),
    ("coded-practical", "light.energy = { shot_nj = 100.0 }"),
    ("coded-32", "scan.raster.rows = 60\nscan.raster.beams = 4"),
    ("hdl-64e", ""),
    ("rosette-mid-40", ""),
    ("rosette-mid-40", LISSAJOUS),
];

const LISSAJOUS: &str = "scan.lissajous = { shots_per_s = 1e5, horizontal = { field_deg = 40.0, hz = 97.0 }, \
    vertical = { field_deg = 20.0, hz = 71.3 } }";

const GEIGER: &str = "detector.geiger = { cells = 4, dead_time_ns = 20.0, dark_counts_hz = 1e5, \
    sensitivity = { range_m = 150.0, reflectance = 1.0, pd = 0.99 } }";

/// A numeric key of a sensor: its dotted name, least and greatest value, and whether it is whole.
#[derive(Debug, Clone)]
struct Key {
    path: String,
    ends: [f64; 2],
    is_whole: bool,
}

impl Key {
    fn typed(&self, value: f64) -> String {
        if self.is_whole { format!("{}", value.round()) } else { format!("{value:e}") }
    }
}

/// The sensor that extends one of [`SENSORS`], with keys set; any energy is allowed, since it takes long to
/// work out what class 1 allows.
fn opened((parent, more): (&str, &str), set: &[(String, String)]) -> Result<Design, String> {
    let text = format!("version = 1\nextends = \"{parent}\"\nname = \"mine\"\n{more}\n");
    let set = [set, &[("without".to_owned(), "eye-safety".to_owned())]].concat();
    let design = Design::from_toml(&text, "mine.toml", Path::new(""), &set);
    design.map_err(|error| error.to_string())
}

/// All numeric keys of the tables that a sensor has, by the schema of sensor files.
fn keys(design: &Design) -> Vec<Key> {
    let whole = schema();
    let mut found = Vec::new();
    add_keys(&whole, &whole, &design.text.parse().unwrap(), "", &mut found);
    found
}

fn add_keys(whole: &Value, node: &Value, table: &toml::Table, path: &str, found: &mut Vec<Key>) {
    let node = match node["$ref"].as_str() {
        Some(name) => &whole["$defs"][name.rsplit('/').next().unwrap()],
        None => node,
    };
    for kind in ["oneOf", "anyOf"] {
        let each = node[kind].as_array().into_iter().flatten();
        each.for_each(|one| add_keys(whole, one, table, path, found));
    }
    for (key, below) in node["properties"].as_object().into_iter().flatten() {
        let path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
        if let (Some(least), Some(most)) = (below["minimum"].as_f64(), below["maximum"].as_f64()) {
            let is_whole = below["type"].to_string().contains("integer");
            found.push(Key { path, ends: [least, most], is_whole });
        } else if let Some(inner) = table.get(key).and_then(toml::Value::as_table) {
            add_keys(whole, below, inner, &path, found);
        }
    }
}

fn room() -> Scene {
    let text = "version = 1\nenvironment = \"clear-day\"\n[[object]]\nshape.sphere.radius_m = 10\n\
                material = \"white\"\n";
    Scene::from_toml(text, "room", Path::new("")).unwrap()
}

/// About how many steps a few shots take.
fn steps(design: &Design) -> f64 {
    let cut = design.cut();
    let around = (cut.history_fs + 2 * cut.listening_fs + 2 * cut.lead_fs) as f64;
    let shots = around * 1e-15 / design.scan_period() * design.shots_per_scan() as f64;
    let channels = f64::from(design.channels());
    let of_ticks = match &design.detector {
        Detector::Sampled(sampled) => (around * 1e-15 + sampled.recovery) / sampled.sample,
        detector => {
            let rate = detector.model().false_rate(1e9).min(1e15 / design.clock.tick_fs as f64);
            around * 1e-15 * rate
        }
    };
    let cells = match &design.detector {
        Detector::Geiger(geiger) => f64::from(geiger.cells),
        _ => 1.0,
    };
    of_ticks * channels + shots * design.emission.coding().codebook.mean_weight() * 5.0 * cells
}

/// Simulates a few shots of the second scan in a white room; says what is wrong with what comes of it.
fn simulated(design: &Design, scene: &Scene) -> Result<(), String> {
    let whole = bands(design, 1).next().unwrap();
    let shots = if design.scan.is_one_flash() { whole.shots } else { whole.shots.min(3) };
    for first in [0, design.shots_per_scan() - shots] {
        let band = Band { scan: 1, first, shots };
        let scan = match sim::scan_part(design, scene, 1, &[band]) {
            Ok(scan) => scan,
            Err(sim::Error::Operating(_)) => return Ok(()),
            Err(error) => return Err(error.to_string()),
        };
        let points = &scan.pieces[0].points;
        for (name, column) in [
            ("x", &points.x),
            ("y", &points.y),
            ("z", &points.z),
            ("range", &points.range),
            ("intensity", &points.intensity),
        ] {
            if let Some(value) = column.iter().find(|value| !value.is_finite()) {
                return Err(format!("{name} is {value}"));
            }
        }
    }
    Ok(())
}

/// Says what of the figures of a sensor is not finite.
fn figures(design: &Design, skies: &[Environment]) -> Result<(), String> {
    let derived = design.derived();
    let never_misses = derived.reference_photons.is_infinite();
    for (name, value) in [
        ("pixel_period", derived.pixel_period),
        ("shortest_dwell", derived.shortest_dwell),
        ("shots_in_flight", derived.shots_in_flight),
        ("macropulse", derived.macropulse),
        ("mean_overlap", derived.mean_overlap),
        ("unambiguous_range", derived.unambiguous_range.unwrap_or(0.0)),
        ("tick_range", derived.tick_range),
        ("idle_listening_rate", derived.idle_listening_rate),
        ("reference_photons", if never_misses { 0.0 } else { derived.reference_photons }),
        ("right_within", design.right_within),
    ] {
        if !value.is_finite() {
            return Err(format!("{name} is {value}"));
        }
    }
    for sky in skies {
        let forecaster = match Forecaster::new(design, sky) {
            Ok(forecaster) => forecaster,
            Err(Error::Operating(_) | Error::NotModelled { .. }) => continue,
        };
        let scan = &design.scan;
        for (reflectance, range) in [(0.1, scan.rated_range), (1.0, 20.0 * scan.max_range)] {
            let found = forecaster.forecast(reflectance, range);
            let counted = |value: f64| if never_misses && value > 0.0 { 1.0 } else { value };
            for (name, value) in [
                ("photons", counted(found.photons_per_shot)),
                ("detected", counted(found.detected_per_mark)),
                ("snr", counted(found.snr)),
                ("mark_pd", found.mark_pd),
                ("bank_loss", found.bank_loss),
                ("density", found.density),
                ("pd", found.pd),
                ("false_per_shot", found.false_per_shot),
                ("precision", found.precision.unwrap_or(0.0)),
                ("bound", found.bound),
                ("aside", found.aside.map_or(0.0, |aside| aside.share + aside.rms)),
            ] {
                if !value.is_finite() {
                    return Err(format!("{name} is {value} at {range} m in {}", sky.name));
                }
            }
            if !(0.0..=1.0).contains(&found.pd) {
                return Err(format!("pd is {} at {range} m in {}", found.pd, sky.name));
            }
        }
    }
    Ok(())
}

/// Steps of a simulation that a test may take.
const FEW: f64 = 3e5;

fn skies() -> [Environment; 2] {
    ["clear-day", "fog-50m"].map(|name| Environment::named(name).unwrap())
}

/// Every key alone at both of its limits.
#[test]
fn a_key_at_its_limit_is_refused_or_works() {
    let (scene, skies) = (room(), skies());
    let (mut tried, mut worked, mut wrong) = (0, 0, Vec::new());
    for sensor in SENSORS {
        for key in keys(&opened(sensor, &[]).unwrap()) {
            for value in key.ends.map(|end| key.typed(end)) {
                tried += 1;
                let Ok(design) = opened(sensor, &[(key.path.clone(), value.clone())]) else {
                    continue;
                };
                let told = figures(&design, &skies).and_then(|()| match steps(&design) < FEW {
                    true => {
                        worked += 1;
                        simulated(&design, &scene)
                    }
                    false => Ok(()),
                });
                if let Err(told) = told {
                    wrong.push(format!("{} {}={value}: {told}", sensor.0, key.path));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(tried > 300 && worked > tried / 5, "{worked} of {tried}");
}

/// Two to four keys at once, at a limit or anywhere between. Seed 1, 300 sensors.
#[test]
fn keys_drawn_together_are_refused_or_work() {
    let scene = room();
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let known: Vec<Vec<Key>> = SENSORS.map(|sensor| keys(&opened(sensor, &[]).unwrap())).into();
    let (mut worked, mut wrong) = (0, Vec::new());
    for _ in 0..300 {
        let which = random.random_range(0..SENSORS.len());
        let set: Vec<(String, String)> = (0..random.random_range(2..5))
            .map(|_| {
                let key = &known[which][random.random_range(0..known[which].len())];
                let [least, most] = key.ends;
                let low = least.max(most * 1e-18);
                let value = match random.random_range(0..5) {
                    0 => least,
                    1 => most,
                    _ => low * (most / low).powf(random.random::<f64>()),
                };
                (key.path.clone(), key.typed(value))
            })
            .collect();
        let Ok(design) = opened(SENSORS[which], &set) else { continue };
        if steps(&design) > FEW {
            continue;
        }
        worked += 1;
        if let Err(told) = simulated(&design, &scene) {
            wrong.push(format!("{} {set:?}: {told}", SENSORS[which].0));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(worked > 30, "{worked}");
}

/// Values that were accepted once and then called a fault of the program.
#[test]
fn what_a_receiver_refuses_is_refused_with_its_key() {
    let told = |sensor: &str, set: &[(&str, &str)]| {
        let set: Vec<_> = set.iter().map(|(key, value)| ((*key).into(), (*value).into())).collect();
        opened((sensor, ""), &set).err().unwrap_or_default()
    };
    let long = [
        ("light.pulse_ps", "1e5"),
        ("detector.photodiode.bandwidth_mhz", "1"),
        ("adc.sample_ps", "1"),
        ("adc.step_photons", "1e9"),
        ("code.chip_ps", "400"),
        ("detector.photodiode.low_cutoff_khz", "0"),
    ];
    let said = told("coded-32", &long);
    assert!(said.contains("adc.sample_ps: is 1 ps, too short for a mark"), "{said}");
    assert_eq!(said.lines().count(), 1, "{said}");
    let said = told("kim-park-2016", &[("scan.raster.columns", "1")]);
    assert!(said.contains("code.allow_dark: no label of this sensor sends any light"), "{said}");
    let said = told("coded-32", &[("adc.step_photons", "1e12")]);
    assert!(said.contains("adc.step_photons: is 1000000000000, but must"), "{said}");
    let said =
        told("coded-32", &[("detector.photodiode.recovery_ns", "1e6"), ("adc.sample_ps", "25")]);
    assert!(said.contains("detector.photodiode.recovery_ns: is 1000000 ns, more than"), "{said}");
}

/// A line of two shots lasts longer than the clock of a band counts, and so does the time from its end to the
/// next line.
#[test]
fn long_fly_backs_are_no_fault() {
    let slow = [
        ("scan.scans_per_s", "10"),
        ("scan.raster.rows", "3"),
        ("scan.raster.columns", "5"),
        ("scan.raster.duty", "0.01"),
    ];
    let slow = slow.map(|(key, value)| (key.to_owned(), value.to_owned()));
    let design = opened(("kim-park-2016", ""), &slow).unwrap();
    let all: Vec<Band> = bands(&design, 0).collect();
    assert_eq!(all.iter().map(|band| band.shots).sum::<u64>(), 15);
    for pair in all.windows(2) {
        assert_eq!(pair[0].next(&design), pair[1]);
        assert_eq!(Band::of_shot(&design, pair[1].first), pair[1]);
    }
    let scan = sim::scan(&design, &room(), 1, 0).unwrap();
    // The label of the first column is dark.
    assert_eq!(scan.cloud().returns(), 12);
}

/// A detector that is declared to see every mark does so in its forecast: Pd 1 but for what false firings and
/// the counts before an echo leave.
#[test]
fn what_never_misses_has_a_forecast() {
    let [day, fog] = skies();
    for (name, detector) in [
        ("hdl-64e", "single-stop"),
        ("peregrine", "single-stop"),
        ("rosette-mid-40", "single-stop"),
        ("kim-park-2016", "photon-counting"),
    ] {
        let set = [(format!("detector.{detector}.sensitivity.pd"), "1".to_owned())];
        let design = Design::open(name, &set).unwrap();
        for sky in [&day, &fog] {
            let forecaster = Forecaster::new(&design, sky).unwrap();
            let found = forecaster.forecast(0.1, design.scan.rated_range);
            assert!(found.pd > 0.999 && found.pd <= 1.0, "{name}: {found:?}");
            assert!(found.precision.is_some_and(f64::is_finite), "{name}: {found:?}");
            assert_eq!(forecaster.light_needed(0.9, 0.1, 10.0), Some(1e-9), "{name}");
        }
        let design = Design::open(name, &[]).unwrap();
        let fog = Forecaster::new(&design, &fog).unwrap();
        assert!(fog.forecast(0.1, design.scan.rated_range).pd < 0.5, "{name}: control");
    }
}

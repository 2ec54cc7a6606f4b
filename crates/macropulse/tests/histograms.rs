//! Sensors that count bursts of pulses in histograms.
#![allow(clippy::unwrap_used)]

use std::path::Path;

use macropulse::codec::Given;
use macropulse::design::Design;
use macropulse::emit::bands;
use macropulse::environment::Environment;
use macropulse::points::{Outcome, PointCloud};
use macropulse::predict::Forecaster;
use macropulse::scene::Scene;
use macropulse::sim::{self, Scans};

/// A flash of SPAD pixels; what is left open are the tables of its burst, and keys of its detector.
fn flash(more: &str) -> Result<Design, String> {
    let text = format!(
        "version = 1\nname = \"flash\"\nidealised = [\"footprint\", \"mirror-motion\"]\n\
         [scan]\nscans_per_s = 10.0\nmax_range_m = 8.0\nlight_range_m = 30.0\n\
         [scan.flash]\nrows = 8\ncolumns = 8\nhorizontal_deg = 8.0\nvertical_deg = 8.0\n\
         [light]\nwavelength_nm = 905.0\nbeam_diameter_mm = 3.0\npulse_ps = 1000.0\nenergy = {{ shot_nj = 140.0 }}\n\
         [optics]\naperture_mm = 3.0\ntransmission = 0.7\nfilter_nm = 20.0\nfield = \"descanned\"\n\
         [detector.geiger]\nefficiency = 0.15\njitter_ps = 100.0\n{more}\n\
         [receiver]\nkind = \"histogram\"\nright_within_m = 0.05\n"
    );
    Design::from_toml(&text, "flash.toml", Path::new(""), &[]).map_err(|why| why.to_string())
}

/// A burst of 1000 pulses, 60 ns apart, which is 8.994 m, and its bins of 250 ps.
const BURST: &str =
    "[burst]\npulses = 1000\ninterval_ns = 60.0\n[histogram]\nbin_ps = 250.0\nbins = 240";

/// A sphere of 50 % about the sensor, with `more` in the scene.
fn sphere(radius: f64, more: &str) -> Scene {
    let text = format!(
        "version = 1\nenvironment = \"night\"\n{more}\n[[material]]\nname = \"paint\"\ndiffuse = 0.5\n\
         [[object]]\nshape.sphere.radius_m = {radius:?}\nmaterial = \"paint\"\n"
    );
    Scene::from_toml(&text, "sphere.toml", Path::new("")).unwrap()
}

fn scanned(design: &Design, scene: &Scene) -> PointCloud {
    sim::scan(design, scene, 5, 0).unwrap().cloud()
}

/// Mean range and mean intensity of a cloud.
fn means(cloud: &PointCloud) -> [f64; 2] {
    [&cloud.range, &cloud.intensity].map(|column| {
        column.iter().map(|value| f64::from(*value)).sum::<f64>() / column.len() as f64
    })
}

/// N = 64 pixels of some thousand photons, whose mean range is known to 0.3 mm; seed 5, α = 10⁻⁶ (4.9 deviations). Cells
/// that count every photon and cells that count once a pulse see the same wall. Cells that are blind for a dead time see
/// it some millimetres nearer: the receiver knows Coates' correction alone. Control: without it strong light comes too
/// near from cells that count once a pulse.
#[test]
fn a_wall_is_found_where_it_is() {
    let scene = sphere(5.0, "");
    let arming = "cells = 4\narming = \"once-per-pulse\"";
    let blind = "cells = 16\ndead_time_ns = 10.0";
    for (more, name, within) in
        [("", "counting", 0.002), (arming, "once a pulse", 0.002), (blind, "blind", 0.01)]
    {
        let design = flash(&format!("{more}\n{BURST}")).unwrap();
        let cloud = scanned(&design, &scene);
        let [range, intensity] = means(&cloud);
        assert_eq!(cloud.returns(), 64, "{name}");
        assert!((range - 5.0).abs() < within, "{name}: {range}");
        assert!((intensity - 0.5).abs() < 0.1, "{name}: {intensity}");
        let outcomes = &cloud.truth.returns.outcome;
        assert!(outcomes.iter().all(|outcome| *outcome == Outcome::Right), "{name}");
    }
    let near = sphere(2.0, "");
    let range = |pile_up: &str| {
        let keys = format!("cells = 1\narming = \"once-per-pulse\"\n{BURST}");
        let set = [("receiver.pile_up".to_owned(), pile_up.to_owned())];
        let design = flash(&keys).unwrap();
        let design = Design::from_toml(&design.text, "flash.toml", Path::new(""), &set).unwrap();
        means(&scanned(&design, &near))[0]
    };
    assert!((range("coates") - 2.0).abs() < 0.01 && range("none") < 1.95);
}

/// Returns the share of the pixels of `design` that see a sphere, within half a metre of it, and the standard
/// deviation of their ranges. The sphere of `reflectance` and of `radius`, m, stands in the environment
/// `around`.
fn seen(design: &Design, around: &str, (reflectance, radius): (f64, f64)) -> (f64, f64) {
    let text = format!(
        "version = 1\nenvironment = \"{around}\"\n[[material]]\nname = \"paint\"\ndiffuse = {reflectance:?}\n\
         [[object]]\nshape.sphere.radius_m = {radius:?}\nmaterial = \"paint\"\n"
    );
    let scene = Scene::from_toml(&text, "sphere.toml", Path::new("")).unwrap();
    let cloud = scanned(design, &scene);
    let near = |range: &&f32| (f64::from(**range) - radius).abs() < 0.5;
    let ranges: Vec<f64> = cloud.range.iter().filter(near).map(|range| f64::from(*range)).collect();
    let count = ranges.len() as f64;
    let mean = ranges.iter().sum::<f64>() / count;
    let square: f64 = ranges.iter().map(|range| (range - mean).powi(2)).sum();
    (count / f64::from(design.shots_per_scan() as u32), (square / count).sqrt())
}

/// N = 1024 pixels for each kind of cells and environment, seed 5, α = 5·10⁻⁴ (3.5 deviations) or 0.02 of the
/// probability, and a fifth of the precision. Control: with two fifths more light half of the pixels would not be seen.
#[test]
fn what_is_found_is_what_was_forecast() {
    let once = "cells = 4\narming = \"once-per-pulse\"";
    let blind = "cells = 4\ndead_time_ns = 20.0\nafterpulsing = 0.03";
    for (keys, around, radius) in [
        ("", "night", 5.3),
        ("", "clear-day", 3.2),
        (once, "night", 7.1),
        (once, "clear-day", 4.6),
        (blind, "clear-day", 4.1),
    ] {
        let keys = format!("dark_counts_hz = 20000.0\n{keys}\n{BURST}");
        let text = flash(&keys).unwrap().text;
        let set =
            [("scan.flash.rows", "32"), ("scan.flash.columns", "32"), ("without", "eye-safety")]
                .map(|(key, value)| (key.to_owned(), value.to_owned()));
        let design = Design::from_toml(&text, "flash.toml", Path::new(""), &set).unwrap();
        let environment = Environment::named(around).unwrap();
        let forecaster = Forecaster::new(&design, &environment).unwrap();
        let pd = |reflectance: f64| forecaster.forecast(reflectance, radius).pd;
        let factor = forecaster.light_needed(0.6, 1.0, radius).unwrap();
        let forecast = forecaster.forecast(factor, radius);
        let (found, spread) = seen(&design, around, (factor, radius));
        let deviation = (forecast.pd * (1.0 - forecast.pd) / 1024.0).sqrt();
        let within = (3.5 * deviation).max(0.02);
        assert!((found - forecast.pd).abs() < within, "{keys} {around}: {found} {}", forecast.pd);
        assert!((pd(1.4 * factor) - found).abs() > 2.0 * within, "{keys} {around}");
        let precision = forecast.precision.unwrap();
        assert!((spread / precision - 1.0).abs() < 0.2, "{keys} {around}: {spread} {precision}");
    }
}

/// An echo after the last bin is not found with any light. A detector without a forecast says so.
#[test]
fn a_forecast_ends_with_the_histogram() {
    let design = flash(BURST).unwrap();
    let night = Environment::named("night").unwrap();
    let forecaster = Forecaster::new(&design, &night).unwrap();
    assert_eq!(forecaster.forecast(1.0, 9.1).pd, 0.0);
    assert!(forecaster.light_needed(0.9, 1.0, 9.1).is_none());
    assert!(forecaster.forecast(1.0, 5.0).pd > 0.99);
    let keys = format!("cells = 4\ndead_time_ns = 20.0\ncrosstalk = 0.02\n{BURST}");
    let told = Forecaster::new(&flash(&keys).unwrap(), &night).unwrap_err().to_string();
    assert!(told.contains("no forecast of optical crosstalk between cells"), "{told}");
}

/// A range beyond c·T/2 is folded by it: a wall at 12 m is seen at 3.006 m.
#[test]
fn a_wall_beyond_the_interval_is_folded() {
    let cloud = scanned(&flash(BURST).unwrap(), &sphere(12.0, ""));
    let [range, _] = means(&cloud);
    assert!((range - (12.0 - 299_792_458.0 * 30e-9)).abs() < 0.01, "{range}");
    assert!(cloud.truth.returns.outcome.iter().all(|outcome| *outcome != Outcome::Right));
}

/// A lidar of single pulses that shines at the sensor adds counts, and no return of its own.
#[test]
fn light_of_another_lidar_is_counted() {
    let design = flash(&BURST.replace("= 1000", "= 100000")).unwrap();
    let other = "[[interferers]]\nsensor = \"hdl-64e\"\nposition_m = [4, 0, 0]\nyaw_deg = 180\n\
                 set = { scan.scans_per_s = 900, scan.raster = { rows = 1, columns = 25, \
                 horizontal_deg = 1, vertical_deg = 1 } }\n";
    let counts = |more: &str| {
        let scene = sphere(5.0, more);
        let scans = Scans::new(&design, &scene, 5).unwrap();
        let band = bands(&design, 0).next().unwrap();
        let Given::Histograms(histograms) = scans.record(&band).1 else { panic!("no histograms") };
        histograms.counts.iter().map(|count| u64::from(*count)).sum::<u64>()
    };
    let (alone, beside) = (counts(""), counts(other));
    assert!(beside > alone + 100_000, "{alone} {beside}");
}

/// Shots of a head that turns come out the same on any number of threads, in several bands.
#[test]
fn histograms_are_the_same_on_any_number_of_threads() {
    let text = flash(BURST).unwrap().text;
    let head = "{ spinning = { cycle_us = 100.0, firing = \"together\", blocks = [{ lasers = 8, \
                first_deg = 4.0, step_deg = -1.0 }] }, scans_per_s = 10.0, max_range_m = 8.0, \
                min_range_m = 0.5, light_range_m = 30.0, gate_beyond_m = 0.0 }";
    let set = [("scan", head), ("burst.pulses", "100"), ("light.energy", "{ shot_nj = 50 }")]
        .map(|(k, v)| (k.to_owned(), v.to_owned()));
    let table: toml::Table = text.parse().unwrap();
    let mut table = table;
    table.remove("scan");
    let design = Design::from_toml(&table.to_string(), "head.toml", Path::new(""), &set).unwrap();
    let scene = sphere(5.0, "");
    assert!(bands(&design, 0).count() > 1);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| scanned(&design, &scene).range)
    };
    let one = on(1);
    assert_eq!(one.len(), 8000);
    assert!(one.iter().zip(&on(3)).all(|(a, b)| a.to_bits() == b.to_bits()));
}

#[test]
fn what_does_not_go_together_is_refused() {
    let bins = |bins: &str| BURST.replace("bins = 240", bins);
    for (more, words) in [
        ("[burst]\npulses = 10\ninterval_ns = 60.0\n[tdc]\nresolution_ps = 100.0\n", "[histogram]"),
        ("[histogram]\nbin_ps = 250.0\nbins = 240", "[burst], which is missing"),
        (&bins("bins = 241"), "between two pulses lie 240 bins"),
        (&bins("bins = 100"), "the range gate ends in bin 213"),
        (&BURST.replace("60.0", "60.1"), "whole number of ticks"),
        (&BURST.replace("1000", "9000000"), "longer than the"),
        (&format!("afterpulse_ns = 10.0\n{BURST}"), "no effect without `afterpulsing`"),
        (&format!("crosstalk = 0.1\n{BURST}"), "write dead_time_ns"),
        (
            &format!(
                "dark_counts_hz = 1e12\ndead_time_ns = 1.0\n{}",
                BURST.replace("= 1000", "= 1000000")
            ),
            "are followed",
        ),
        (&format!("{BURST}\n[tdc]\nconverters = 64\n"), "has no effect because of `histogram`"),
    ] {
        let told = flash(more).err().unwrap_or_default();
        assert!(told.contains(words), "{more}: {told}");
    }
    let set = |key: &str, value: &str| {
        let text = flash(BURST).unwrap().text;
        let set = [(key.to_owned(), value.to_owned())];
        Design::from_toml(&text, "flash.toml", Path::new(""), &set).unwrap_err().to_string()
    };
    for (key, value, words) in [
        ("receiver.kind", "direct", "`histogram` for a [histogram]"),
        ("receiver.pile_up", "coates", "once a pulse"),
        ("receiver.effort", "thorough", "only `matched` searches"),
    ] {
        let told = set(key, value);
        assert!(told.contains(words), "{key}: {told}");
    }
    let kim =
        Design::open("kim-park-2016", &[("receiver.least_share".to_owned(), "0.1".to_owned())]);
    assert!(kim.unwrap_err().to_string().contains("only `histogram` and `beat` compare returns"));
}

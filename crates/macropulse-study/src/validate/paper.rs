//! Figures that follow from the numbers of the paper: most are printed there, the rest are computed apart.

use std::f64::consts::FRAC_PI_4;
use std::path::Path;

use macropulse::codec::code::Family;
use macropulse::codec::code::correlation::{
    CrossCorrelation, aperiodic_sidelobe, periodic_sidelobe,
};
use macropulse::design::{Derived, Design};
use macropulse::environment::Environment;
use macropulse::predict::link::{diffraction, spot_depth};
use macropulse::predict::multiple_access::word_reuse_range;
use macropulse::scene::Scene;

use super::Error;
use super::published::{Figure, Figures, Within};
use crate::paper::{SENSORS, predict};

/// Everything of this file.
///
/// # Errors
/// None of the ready sensors is refused, unless the program is broken.
pub(super) fn paper() -> Result<Vec<Figure>, Error> {
    let design = Design::open("kim-park-2016", &[])?;
    let derived = design.derived();
    let mut all = words()?;
    all.extend(macropulses(&design, &derived));
    all.extend(scan(&design, &derived)?);
    all.extend(light(&derived)?);
    all.extend(samples()?);
    Ok(all)
}

const APART: &str = "computed apart";

/// Codes beside the ones that others have published of.
fn words() -> Result<Vec<Figure>, Error> {
    let mut figures = Figures::of("codes", APART);
    let words = Family::prime(29)?.words();
    let without = CrossCorrelation::of(&words[1..]).periodic.variance();
    figures.add(
        "prime code over GF(29) without C0: variance of the cross-correlation",
        0.34483,
        without,
        Within::Absolute(1e-5),
    );
    if let Some(lobe) = words.get(1).and_then(aperiodic_sidelobe) {
        figures.add(
            "greatest sidelobe of C1, no period",
            28.0,
            lobe.height.into(),
            Within::Exactly,
        );
        figures.add("so many chips off", 30.0, lobe.lag.into(), Within::Exactly);
    }
    let extended = Family::extended_prime(29)?;
    figures.add(
        "extended prime code over GF(29): chips",
        1653.0,
        extended.length().into(),
        Within::Exactly,
    );
    let words = extended.words();
    let cross = CrossCorrelation::of(&words).periodic_max;
    figures.add("greatest cross-correlation", 1.0, cross.into(), Within::Exactly);
    let lobe = words.iter().skip(1).filter_map(periodic_sidelobe).map(|lobe| lobe.height).max();
    figures.add(
        "greatest sidelobe of the words but C0",
        28.0,
        lobe.unwrap_or(0).into(),
        Within::AtMost,
    );
    Ok(figures.done())
}

/// Payloads and macropulses.
fn macropulses(design: &Design, derived: &Derived) -> Vec<Figure> {
    let mut figures = Figures::of("macropulses", APART);
    let weight = design.emission.coding().codebook.family().weight() as f64;
    let (least, mean, most) = derived.marks;
    figures.add(
        "kim-park-2016: chips of 13 bits, ns",
        27.3325,
        derived.macropulse * 1e9,
        Within::Absolute(1e-9),
    );
    figures.add("marks of a macropulse, the fewest", 58.0, least as f64, Within::Exactly);
    figures.add("the most", 319.0, most as f64, Within::Exactly);
    figures.add("lit bits, the mean", 6.198, mean / weight, Within::Absolute(1e-3));
    if let Some(payload) = design.emission.coding().codebook.payload() {
        let dark = (0..848).filter(|label| payload.text(*label).starts_with('0')).count();
        figures.add(
            "labels of 848 that begin with a dark bit",
            512.0,
            dark as f64,
            Within::Exactly,
        );
        let legal = 100.0 * payload.legal_fraction(848);
        figures.add("words of 13 bits that are a label, %", 10.4, legal, Within::Absolute(0.05));
    }
    figures.add(
        "macropulses under way at once, the mean",
        0.667,
        derived.mean_overlap,
        Within::Absolute(1e-3),
    );
    figures.add(
        "micropulses of a scan, millions",
        73.16,
        derived.marks_per_scan as f64 * 1e-6,
        Within::Absolute(0.01),
    );
    figures.done()
}

/// The scan, and its mirror.
fn scan(design: &Design, derived: &Derived) -> Result<Vec<Figure>, Error> {
    let mut figures = Figures::of("scanners", "KP16");
    figures.add(
        "kim-park-2016: time to a pixel, ns",
        40.95,
        derived.pixel_period * 1e9,
        Within::Absolute(5e-3),
    );
    figures.add("gate of 150 m, \u{b5}s", 1.0, derived.gate * 1e6, Within::Absolute(5e-3));
    figures.add(
        "shots in flight, rounded up",
        25.0,
        derived.shots_in_flight.ceil(),
        Within::Exactly,
    );
    figures.add("chips of 13 bits", 10_933.0, derived.chips.into(), Within::Exactly);
    figures.add(
        "converters",
        1150.0,
        design.bank().map_or(f64::NAN, |bank| bank.converters.into()),
        Within::Exactly,
    );
    let mut all = figures.done();
    let mut figures = Figures::of("scanners", APART);
    figures.add("shots in flight", 24.44, derived.shots_in_flight, Within::Absolute(5e-3));
    let again = word_reuse_range(29, derived.pixel_period);
    figures.add("range at which 29 words come again, m", 178.0, again, Within::Absolute(0.5));
    let resonant = [("scan.raster.mirror", "sinusoidal"), ("scan.raster.duty", "1.0")]
        .map(|(key, value)| (key.to_owned(), value.to_owned()));
    let dwell = Design::open("kim-park-2016", &resonant)?.derived().shortest_dwell;
    figures.add(
        "time to a pixel in the middle of a resonant mirror's line, ns",
        26.07,
        dwell * 1e9,
        Within::Absolute(5e-3),
    );
    all.extend(figures.done());
    Ok(all)
}

/// The light that it would have.
fn light(derived: &Derived) -> Result<Vec<Figure>, Error> {
    let mut figures = Figures::of("light", APART);
    let spread = diffraction(905e-9, 1e-3);
    figures.add(
        "spot of a beam of 1 mm after 30 m, mm",
        35.0,
        30.0 * spread * 1e3,
        Within::Absolute(0.5),
    );
    figures.add("after 150 m", 173.0, 150.0 * spread * 1e3, Within::Absolute(0.5));
    let smeared = spot_depth(150.0 * spread, FRAC_PI_4) / derived.tick_range;
    figures.add(
        "chips over which a surface at 45\u{b0} smears it",
        461.0,
        smeared,
        Within::Absolute(1.0),
    );
    let physical = Design::open("kim-park-2016-physical", &[])?;
    let day = Environment::named("clear-day")?;
    if let (Some(budget), Some(irradiance)) = (&physical.budget, day.irradiance(905e-9)) {
        figures.add(
            "energy of a shot in class 1, nJ",
            0.829,
            budget.energy * 1e9,
            Within::Share(0.01),
        );
        let through_air = (-2.0 * 150.0 * day.extinction(905e-9)).exp();
        let photons = budget.photons(1e-9, 1.0, 150.0) * through_air;
        figures.add("photons of 1 nJ from white at 150 m", 21.7, photons, Within::Share(0.01));
        let field = budget.field.solid_angle;
        figures.add(
            "field of 43.2\u{b0} of azimuth by 24.3\u{b0} of elevation, sr",
            0.3174,
            field,
            Within::Absolute(5e-5),
        );
        let sun = budget.background(irradiance, day.albedo) * 2.5e-12;
        figures.add("photons of the sun from it in a chip", 969.0, sun, Within::Share(2e-3));
    }
    Ok(figures.done())
}

/// Samples on a board as large as the front of a car, from angles.
const SAMPLES: [[f64; 4]; 3] =
    [[3658.0, 1317.0, 672.0, 229.0], [353.0, 127.0, 65.0, 22.0], [172.0, 62.0, 32.0, 0.0]];

fn samples() -> Result<Vec<Figure>, Error> {
    let mut figures = Figures::of("samples", APART);
    for (sensor, row) in SENSORS.into_iter().zip(SAMPLES) {
        let design = Design::open(sensor, &[])?;
        for (distance, published) in [30.0, 50.0, 70.0, 120.0].into_iter().zip(row) {
            let text = format!(
                "version = 1\n[sensor]\nposition_m = [0, 0, 2]\n[[object]]\ntarget = true\n\
                 material = \"white\"\nposition_m = [{}, 0, 2]\nshape.box.size_m = [0.2, 1.82, 1.42]\n",
                distance + 0.1
            );
            let found = predict(&design, &Scene::from_toml(&text, "board", Path::new(""))?).samples;
            let what = format!("{sensor}: on a board of 1.82 \u{d7} 1.42 m at {distance} m");
            // To whole samples, and the board to a 300th of its side.
            figures.add(what, published, found, Within::Absolute(0.5 + 0.01 * published));
        }
    }
    Ok(figures.done())
}

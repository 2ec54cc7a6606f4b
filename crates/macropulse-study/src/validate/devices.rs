//! Published figures of light, eyes, detectors, converters and scanners.

use std::collections::HashSet;
use std::path::Path;

use macropulse::codec::statistics::erlang_b;
use macropulse::design::Design;
use macropulse::design::detector::threshold_over_noise;
use macropulse::design::safety::Class1;
use macropulse::emit::{Band, bands, short_bands};
use macropulse::environment::Environment;
use macropulse::predict::Forecaster;
use macropulse::predict::link::diffraction;
use macropulse::scene::{Scene, library};
use macropulse::sim;

use super::Error;
use super::published::{Figure, Figures, Within};

/// Sun, air and the limits of class 1.
///
/// # Errors
/// None of the ready environments is refused, unless the program is broken.
pub(super) fn light() -> Result<Vec<Figure>, Error> {
    let mut all = sun_and_air()?;
    let mut beam = Figures::of("light", "KP16");
    let spread = diffraction(905e-9, 1e-3) * 1e3;
    beam.add("divergence of a beam of 1 mm at 905 nm, mrad", 1.15, spread, Within::Absolute(5e-3));
    all.extend(beam.done());
    all.extend(eyes());
    Ok(all)
}

fn sun_and_air() -> Result<Vec<Figure>, Error> {
    let mut sun = Figures::of("light", "G173");
    let day = Environment::named("clear-day")?;
    let published =
        [(850.0, 0.894), (905.0, 0.817), (940.0, 0.472), (1064.0, 0.632), (1550.0, 0.270)];
    for (nm, published) in published {
        let found = day.irradiance(nm * 1e-9).unwrap_or(f64::NAN) * 1e-9;
        // Between entries 5 nm apart it is interpolated.
        let what = format!("sunlight at {nm} nm, W/m\u{b2}/nm");
        sun.add(what, published, found, Within::Absolute(6e-3));
    }
    let mut all = sun.done();
    let mut air = Figures::of("light", "Kim01");
    for (nm, published) in [(550.0, 0.1701), (905.0, 0.0890)] {
        let clear = Environment::named("clear-day")?;
        let found = clear.extinction(nm * 1e-9) * 1e3;
        let what = format!("extinction at {nm} nm and 23 km of visibility, 1/km");
        air.add(what, published, found, Within::Share(2e-3));
    }
    all.extend(air.done());
    all.extend(surfaces());
    all.extend(intensities()?);
    Ok(all)
}

/// Diffuse reflectance of materials, by wavelength, nm, in per cent.
fn surfaces() -> Vec<Figure> {
    let road = [(850.0, 10.8), (905.0, 10.9), (940.0, 11.0), (1064.0, 11.4), (1550.0, 13.9)];
    let sidewalk = [(905.0, 31.4), (1550.0, 38.9)];
    let mut all = reflectances("SB", &[("asphalt", &road), ("concrete", &sidewalk)]);
    let grass = [(905.0, 50.9), (1550.0, 24.3)];
    let leaves = [(905.0, 55.4), (1550.0, 25.3)];
    let (pine, aluminium) = ([(905.0, 91.8), (1550.0, 56.5)], [(905.0, 59.6), (1550.0, 81.3)]);
    all.extend(reflectances(
        "ASTER",
        &[("grass", &grass), ("vegetation", &leaves), ("wood", &pine), ("aluminium", &aluminium)],
    ));
    all.extend(reflectances("KZ04", &[("snow", &[(905.0, 78.0), (1064.0, 62.0)])]));
    all
}

/// Intensities that ready sensors report of a wall of known reflectance that they see square on: the median
/// of some thousand.
fn intensities() -> Result<Vec<Figure>, Error> {
    let mut figures = Figures::of("intensity", "by definition");
    let walls = [
        ("kim-park-2016", 0.5, 140.0),
        ("bipolar-gold", 0.5, 140.0),
        ("vlp-16", 0.1, 30.0),
        ("hdl-64e", 0.1, 50.0),
        ("peregrine", 0.5, 50.0),
    ];
    for (sensor, reflectance, range) in walls {
        let design = Design::open(sensor, &[])?;
        let text = format!(
            "version = 1\nenvironment = \"clear-day\"\n[[material]]\nname = \"paint\"\n\
             diffuse = {reflectance}\n[[object]]\nshape.sphere.radius_m = {range}\n\
             material = \"paint\"\n"
        );
        let scene = Scene::from_toml(&text, sensor, Path::new(""))?;
        let some: Vec<Band> = short_bands(&design, 0).take(4).collect();
        let cloud = sim::scan_part(&design, &scene, 1, &some)?.cloud();
        let mut told = cloud.intensity;
        told.sort_by(f32::total_cmp);
        let median = told.get(told.len() / 2).copied().unwrap_or(f32::NAN);
        let what = format!("{sensor}: a wall of {reflectance} at {range} m");
        figures.add(what, reflectance, median.into(), Within::Share(0.05));
    }
    Ok(figures.done())
}

/// Reflectance in per cent at wavelengths in nm.
type Spectrum<'a> = &'a [(f64, f64)];

fn reflectances(source: &'static str, published: &[(&str, Spectrum)]) -> Vec<Figure> {
    let mut figures = Figures::of("materials", source);
    for (name, spectrum) in published {
        let material = library().find(|material| material.name == *name);
        for (nm, percent) in *spectrum {
            let found = material.as_ref().map(|one| one.at(nm * 1e-9).diffuse * 100.0);
            let what = format!("{name} at {nm} nm, %");
            figures.add(what, *percent, found.unwrap_or(f64::NAN), Within::Absolute(0.05));
        }
    }
    figures.done()
}

/// The limits of class 1, by wavelength, nm.
fn eyes() -> Vec<Figure> {
    let mut figures = Figures::of("eye safety", "IEC60825");
    let mut add = |nm: f64, what: &str, published: f64, ours: &dyn Fn(&Class1) -> f64| {
        if let Some(class) = Class1::at(nm * 1e-9) {
            figures.add(format!("{nm} nm: {what}"), published, ours(&class), Within::Share(1e-3));
        }
    };
    for (nm, pulse, power) in [(850.0, 153.6, 0.778), (905.0, 197.9, 1.002), (940.0, 232.5, 1.178)]
    {
        add(nm, "a pulse of 1 ns, nJ", pulse, &|class| class.single_exposure(1e-9) * 1e9);
        add(nm, "without end, mW", power, &|class| class.continuous() * 1e3);
    }
    add(1450.0, "a pulse of 1 \u{b5}s, J", 8e-4, &|class| class.single_exposure(1e-6));
    add(1450.0, "0.1 s, J", 4.4e-3 * 0.1_f64.powf(0.25), &|class| class.single_exposure(0.1));
    add(1450.0, "1 s, J", 1e-2, &|class| class.single_exposure(1.0));
    add(1450.0, "pulses so close count as one, s", 1e-3, &Class1::counted_as_one);
    add(1550.0, "a pulse of 0.1 ns, W", 8e6, &|class| class.single_exposure(1e-10) / 1e-10);
    add(1550.0, "a pulse of 1 \u{b5}s, J", 8e-3, &|class| class.single_exposure(1e-6));
    add(1550.0, "4 s, J", 1.8e-2 * 4_f64.powf(0.75), &|class| class.single_exposure(4.0));
    add(1550.0, "without end, W", 1e-2, &Class1::continuous);
    add(1550.0, "pulses so close count as one, s", 10.0, &Class1::counted_as_one);
    add(1550.0, "aperture for 0.1 s, mm", 1.0, &|class| class.aperture(0.1) * 1e3);
    add(1550.0, "aperture for 4 s, mm", 1.5 * 4_f64.powf(0.375), &|class| {
        class.aperture(4.0) * 1e3
    });
    add(1550.0, "aperture for 10 s, mm", 3.5, &|class| class.aperture(10.0) * 1e3);
    figures.done()
}

/// Detectors and converters.
pub(super) fn detectors() -> Vec<Figure> {
    let mut noise = Figures::of("detectors", "KP18");
    // White noise in a band of 1/(2·pulse), as the source has it, crosses its mean 1/(2√3·pulse) times a second.
    let memory = 3_f64.sqrt() / std::f64::consts::PI * 5e-9;
    let ratio = threshold_over_noise(memory, 5e5).unwrap_or(f64::NAN);
    let what = "threshold to noise of 5\u{b7}10\u{2075} false alarms a second, 5 ns pulses, dB";
    noise.add(what, 9.776, 20.0 * ratio.log10(), Within::Absolute(2e-3));
    let mut all = noise.done();
    let mut erlang = Figures::of("converters", "Erl17");
    // Tables of telephone traffic: lines, offered load, share lost.
    for (lines, offered, published) in [(10, 4.461, 0.01), (20, 12.03, 0.01), (5, 2.219, 0.05)] {
        let what = format!("lost of {offered} erlang by {lines} lines");
        erlang.add(what, published, erlang_b(offered, lines), Within::Share(5e-3));
    }
    all.extend(erlang.done());
    all
}

/// Scanners.
///
/// # Errors
/// None of the ready sensors is refused, unless the program is broken.
pub(super) fn scanners() -> Result<Vec<Figure>, Error> {
    let mut all = vlp_16()?;
    all.extend(hdl_64e()?);
    let mut rosette = Figures::of("scanners", "Mid40");
    let design = Design::open("rosette-mid-40", &[])?;
    for (seconds, published) in
        [(0.1, 0.144), (0.2, 0.269), (0.5, 0.562), (1.0, 0.839), (2.0, 0.992), (4.0, 1.0)]
    {
        let found = covered(&design, (seconds * 10.0_f64).round() as u64);
        let what = format!("share of 0.2\u{b0} cells that rosette-mid-40 meets in {seconds} s");
        rosette.add(what, published, found, Within::Absolute(5e-3));
    }
    all.extend(rosette.done());
    Ok(all)
}

fn vlp_16() -> Result<Vec<Figure>, Error> {
    let mut figures = Figures::of("scanners", "VLP16");
    let design = Design::open("vlp-16", &[])?;
    let Some(band) = bands(&design, 0).next() else { return Ok(Vec::new()) };
    let log = band.shot_log(&design);
    let first = log.owned.start;
    let after = |shot: usize| {
        log.fired_at_fs
            .get(first + shot)
            .map_or(f64::NAN, |fired| (fired - log.fired_at_fs[first]) as f64 * 1e-9)
    };
    // Shots wait for the chip clock, 13 ps.
    for (shot, published) in [(1, 2.304), (15, 34.56), (16, 55.296), (16 * 5 + 3, 283.392)] {
        let what = format!("vlp-16: shot {shot} after the first one, \u{b5}s");
        figures.add(what, published, after(shot), Within::Absolute(2e-5));
    }
    // The rest are those of the other sign.
    const CORRECTIONS: [(f64, f64); 9] = [
        (15.0, -11.2),
        (13.0, -9.7),
        (11.0, -8.1),
        (9.0, -6.6),
        (7.0, -5.1),
        (-1.0, 0.7),
        (-3.0, 2.2),
        (-5.0, 3.7),
        (-7.0, 5.1),
    ];
    for (elevation, published) in CORRECTIONS {
        let row = ((15.0_f64 - elevation) / 2.0) as u16;
        let found = design.directions().origin(row, 0)[2] * 1e3;
        let what = format!("vertical correction of the laser at {elevation}\u{b0}, mm");
        figures.add(what, published, found, Within::Absolute(1e-9));
    }
    let per_second = design.shots_per_scan() as f64 / design.scan_period();
    figures.add("shots a second, some 300 000", 3e5, per_second, Within::Share(0.05));
    let day = Environment::named("clear-day")?;
    let forecaster = Forecaster::new(&design, &day)?;
    for (reflectance, range) in [(0.8, 25.0), (0.1, 25.0), (0.8, 98.0)] {
        let what = format!("\u{3c3} of its range at {reflectance} and {range} m, mm");
        let found = forecaster.forecast(reflectance, range).precision.unwrap_or(f64::NAN) * 1e3;
        figures.add(what, 30.0, found, Within::AtMost);
    }
    let seen = forecaster.forecast(0.8, 100.0).pd;
    figures.add("echoes seen of 0.8 at 100 m", 0.99, seen, Within::AtLeast);
    Ok(figures.done())
}

/// The data sheet's head on the roof of a car, 1.73 m above the pavement that it sees aslant.
fn hdl_64e() -> Result<Vec<Figure>, Error> {
    let mut figures = Figures::of("scanners", "HDL64");
    let design = Design::open("hdl-64e", &[])?;
    let forecaster = Forecaster::new(&design, &Environment::named("clear-day")?)?;
    let precision = forecaster.forecast(0.1, 50.0).precision.unwrap_or(f64::NAN) * 1e3;
    figures.add(
        "hdl-64e: \u{3c3} of its range at 0.1 and 50 m, mm",
        20.0,
        precision,
        Within::AtMost,
    );
    let seen = forecaster.forecast(0.8, 119.0).pd;
    figures.add("echoes seen of 0.8 at 119 m", 0.99, seen, Within::AtLeast);
    // Downwards from where nearly all is seen: the first range at which half of it is.
    let pavement = |range: f64| forecaster.forecast(0.1 * 1.73 / range, range).pd;
    let ranges = (200..=1190).map(|tenth| f64::from(tenth) / 10.0);
    let half = ranges.into_iter().find(|range| pavement(*range) < 0.5).unwrap_or(f64::NAN);
    figures.add("range at which it loses the pavement, m", 50.0, half, Within::Share(0.05));
    let per_second = design.shots_per_scan() as f64 / design.scan_period();
    figures.add("shots a second, above", 1.333e6, per_second, Within::AtLeast);
    Ok(figures.done())
}

/// The share of a disc of 19.2°, in cells of 0.2°, that `design` meets in the first `scans`.
fn covered(design: &Design, scans: u64) -> f64 {
    const CELL: f64 = 0.2;
    const RADIUS: f64 = 19.2;
    let cells = (RADIUS / CELL).ceil() as i32;
    let mut met = HashSet::new();
    for scan in 0..scans {
        for band in bands(design, scan) {
            let log = band.shot_log(design);
            for shot in log.owned.clone() {
                let [x, y, z] = design.directions().of_shot(&log, shot);
                let off = x.acos().to_degrees() / y.hypot(z).max(1e-12);
                met.insert([y, z].map(|part| (part * off / CELL).floor() as i32));
            }
        }
    }
    let middle = |cell: i32| (f64::from(cell) + 0.5) * CELL;
    let is_within = |[y, z]: [i32; 2]| middle(y).hypot(middle(z)) <= RADIUS;
    let all = (-cells..cells).flat_map(|y| (-cells..cells).map(move |z| [y, z]));
    let met = met.into_iter().filter(|cell| is_within(*cell));
    met.count() as f64 / all.filter(|cell| is_within(*cell)).count() as f64
}

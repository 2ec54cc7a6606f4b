//! Published figures of sensors that count in histograms, and closed forms of their counts.

use macropulse::codec::decode::histogram::coates;
use macropulse::design::Design;
use macropulse::environment::Environment;
use macropulse::predict::Forecaster;
use macropulse::units::{range_from_tof, s_from_fs};

use super::Error;
use super::published::{Figure, Figures, Within};

/// Everything of this file.
///
/// # Errors
/// None of its sensors is refused, unless the program is broken.
pub(super) fn histograms() -> Result<Vec<Figure>, Error> {
    let mut all = head()?;
    all.extend(efficiencies()?);
    all.extend(chips()?);
    all.extend(counts());
    Ok(all)
}

/// The farthest range at which nine of ten are seen of a `reflectance`, m.
fn farthest(design: &Design, around: &Environment, reflectance: f64) -> Result<f64, Error> {
    let forecaster = Forecaster::new(design, around)?;
    Ok(forecaster.farthest(0.9, reflectance).unwrap_or(f64::NAN))
}

/// The data sheet of a turning head, and the beams in its metadata.
fn head() -> Result<Vec<Figure>, Error> {
    let design = Design::open("spad-spinning", &[])?;
    let day = Environment::named("clear-day")?;
    let mut figures = Figures::of("histograms", "OS1");
    for (reflectance, range) in [(0.8, 120.0), (0.1, 40.0)] {
        let what = format!("spad-spinning: farthest range of {reflectance} by day, m");
        figures.add(what, range, farthest(&design, &day, reflectance)?, Within::AtLeast);
    }
    let forecaster = Forecaster::new(&design, &day)?;
    let near = forecaster.forecast(0.8, 20.0);
    let precision = near.precision.unwrap_or(f64::NAN) * 1e3;
    figures.add("\u{3c3} of its range at 0.8 and 20 m, mm", 15.0, precision, Within::AtMost);
    let faint = forecaster.forecast(0.1, 40.0).precision.unwrap_or(f64::NAN) * 1e3;
    figures.add("\u{3c3} of its range at 0.1 and 40 m, mm", 100.0, faint, Within::AtMost);
    figures.add("false points a shot", 1e-4, near.false_per_shot, Within::AtMost);
    let per_second = design.shots_per_scan() as f64 / design.scan_period();
    figures.add("shots a second", 1_310_720.0, per_second, Within::Share(1e-9));
    let mut all = figures.done();
    let mut figures = Figures::of("histograms", "OusSdk");
    let elevation = |row: u16| design.directions().of(row, 0)[2].asin().to_degrees();
    let (top, bottom) = (elevation(0), elevation(127));
    figures.add("spad-spinning: highest beam, \u{b0}", 20.95, top, Within::Absolute(1e-4));
    figures.add("lowest beam, \u{b0}", -21.82, bottom, Within::Absolute(1e-4));
    let [x, y, _] = design.directions().origin(0, 0);
    let before = x.hypot(y) * 1e3;
    figures.add("its beams begin off the axis by, mm", 15.806, before, Within::Absolute(1e-3));
    all.extend(figures.done());
    Ok(all)
}

/// Twice the efficiency: the fourth root of it in range where sunlight limits it, the root at night.
fn efficiencies() -> Result<Vec<Figure>, Error> {
    let mut figures = Figures::of("histograms", "IMX459");
    for (name, reflectance, published) in [("clear-day", 0.1, 1.189), ("night", 0.01, 1.414)] {
        let around = Environment::named(name)?;
        let range = |efficiency: &str| {
            let set = [
                ("detector.geiger.efficiency", efficiency),
                ("detector.geiger.dark_counts_hz", "0.0"),
            ];
            let set = set.map(|(key, value)| (key.to_owned(), value.to_owned()));
            farthest(&Design::open("spad-spinning", &set)?, &around, reflectance)
        };
        let ratio = range("0.24")? / range("0.12")?;
        let what = format!("range with an efficiency of 24 %, over that with 12 %, {name}");
        figures.add(what, published, ratio, Within::Share(0.03));
    }
    Ok(figures.done())
}

/// A chip for short ranges, given the light with which white is seen as far as its data sheet says.
fn chips() -> Result<Vec<Figure>, Error> {
    let mut figures = Figures::of("histograms", "VL53L1X");
    let design = Design::open("spad-flash", &[])?;
    let night = Environment::named("night")?;
    let forecaster = Forecaster::new(&design, &night)?;
    let light = forecaster.light_needed(0.9, 0.88, 3.6).unwrap_or(f64::NAN);
    let grey = forecaster.with_light(light).farthest(0.9, 0.17).unwrap_or(f64::NAN);
    figures.add(
        "range of 17 % in the dark where 88 % is seen to 3.6 m, m",
        1.7,
        grey,
        Within::Share(0.1),
    );
    let mut all = figures.done();
    let mut figures = Figures::of("histograms", "IMX459");
    let step = range_from_tof(s_from_fs(1_000_000)) * 1e2;
    figures.add("a step of distance of a bin of 1 ns, cm", 15.0, step, Within::Absolute(0.05));
    all.extend(figures.done());
    Ok(all)
}

/// Mean counts of a detector that stops at its first photon.
fn counts() -> Vec<Figure> {
    let mut figures = Figures::of("histograms", "computed apart");
    // 0.055 photons in a bin behind 0.7375.
    let cycles = 100_000_000_u32;
    let counted = |photons: &[f64]| -> Vec<u32> {
        let mut waiting = f64::from(cycles);
        let count = |rate: &f64| {
            let count = -waiting * libm::expm1(-rate);
            waiting -= count;
            count.round() as u32
        };
        photons.iter().map(count).collect()
    };
    let histogram = counted(&[0.7375, 0.055]);
    let share = f64::from(histogram[1]) / f64::from(cycles);
    figures.add(
        "counts a cycle of 0.055 photons behind 0.7375",
        0.0256,
        share,
        Within::Absolute(5e-5),
    );
    let corrected = coates(&histogram, cycles)[1];
    figures.add("the same corrected", 0.055, corrected, Within::Absolute(5e-5));
    for (photons, published) in [(1.0, -12.29), (5.0, -45.99)] {
        let bins = 1000;
        let histogram = counted(&vec![photons / f64::from(bins); bins as usize]);
        let places = histogram
            .iter()
            .zip(0..bins)
            .map(|(count, bin)| f64::from(*count) * (f64::from(bin) + 0.5 - f64::from(bins) / 2.0));
        let all: f64 = histogram.iter().map(|count| f64::from(*count)).sum();
        // A pulse of 1 ns.
        let shift = range_from_tof(places.sum::<f64>() / all / f64::from(bins) * 1e-9) * 1e3;
        let what = format!("shift by pile-up of a pulse of 1 ns and {photons} photons, mm");
        figures.add(what, published, shift, Within::Absolute(0.01));
    }
    figures.done()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Control: twice the efficiency is twice the range nowhere.
    #[test]
    fn figures_of_histograms_are_as_published() {
        let all = histograms().unwrap();
        assert!(all.len() > 15, "{}", all.len());
        let wrong: Vec<&Figure> = all.iter().filter(|figure| !figure.holds()).collect();
        assert!(wrong.is_empty(), "{wrong:#?}");
        let fourth = all.iter().find(|figure| figure.published == 1.189).unwrap();
        assert!((fourth.ours - 2.0).abs() > 0.3);
    }
}

//! Published figures of light without pulses, modulated in power or in frequency.

use std::f64::consts::{LN_10, TAU};

use macropulse::channel::Operating;
use macropulse::codec::decode::PhaseMethod;
use macropulse::codec::decode::phase::{Tone, measured};
use macropulse::codec::statistics::power_tail;
use macropulse::design::detector::Coherent;
use macropulse::design::{Design, Detector, Wave};
use macropulse::environment::Environment;
use macropulse::units::{range_from_tof, s_from_fs, tof_from_range};

use super::Error;
use super::published::{Figure, Figures, Within};

/// Both kinds.
///
/// # Errors
/// None, unless a ready sensor is refused.
pub(super) fn continuous() -> Result<Vec<Figure>, Error> {
    let mut all = intervals()?;
    all.extend(phases());
    all.extend(beats()?);
    all.extend(detection());
    Ok(all)
}

const MODULATED: &str = "modulated light";
const CHIRPED: &str = "chirped light";

/// A ready sensor with changes.
fn ready(name: &str, changes: &[(&str, &str)]) -> Result<Design, Error> {
    let set = changes.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned()));
    Ok(Design::open(name, &set.collect::<Vec<_>>())?)
}

/// Modulation frequencies, MHz, and the range after which their phases repeat, m.
type Interval<'a> = (&'a [f64], f64);

/// Ranges after which the phases of all modulation frequencies, MHz, repeat.
fn intervals() -> Result<Vec<Figure>, Error> {
    let published: [(_, &[Interval]); 3] = [
        (
            "Helios2",
            &[
                (&[120.0], 1.25),
                (&[50.0], 3.0),
                (&[37.0], 4.0),
                (&[25.0], 6.0),
                (&[120.0, 90.0], 5.0),
                (&[90.0, 72.0], 8.3),
            ],
        ),
        ("Luxonis", &[(&[80.0], 1.87), (&[100.0], 1.5), (&[100.0, 80.0], 7.5)]),
        ("Freenect2", &[(&[80.0], 1.874), (&[16.0], 9.369), (&[120.0], 1.249)]),
    ];
    let mut all = Vec::new();
    for (source, sensors) in published {
        let mut figures = Figures::of(MODULATED, source);
        for (mhz, published) in sensors {
            let contrast = vec![0.7; mhz.len()];
            let design = ready(
                "itof-camera",
                &[
                    ("modulation.frequencies_mhz", &format!("{mhz:?}")),
                    ("detector.lock-in.contrast", &format!("{contrast:?}")),
                ],
            )?;
            let found = design.derived().unambiguous_range.unwrap_or(f64::NAN);
            let list: Vec<String> = mhz.iter().map(f64::to_string).collect();
            let what = format!("ranges repeat after, {} MHz, m", list.join(" and "));
            figures.add(what, *published, found, Within::Share(0.013));
        }
        all.extend(figures.done());
    }
    let kinect = ready("kinect-v2", &[])?;
    let mut figures = Figures::of(MODULATED, "Freenect2");
    let found = kinect.derived().unambiguous_range.unwrap_or(f64::NAN);
    let what = "kinect-v2: all three frequencies, m";
    figures.add(what, 18.737, found, Within::Share(1e-4));
    all.extend(figures.done());
    let mut figures = Figures::of(MODULATED, "K4A");
    let lasts = s_from_fs(kinect.emission.length_fs()) * 1e3;
    let what = "nine exposures of 125 \u{b5}s with eight pauses of 1450 \u{b5}s, ms";
    figures.add(what, 12.8, lasts, Within::Share(0.01));
    all.extend(figures.done());
    let mut figures = Figures::of(MODULATED, "FARO");
    let scanner = ready("amcw-scanner", &[])?;
    let each = scanner.emission.modulation().map(|it| it.hz.clone()).unwrap_or_default();
    for (hz, published) in each.iter().zip([1.2, 9.6, 76.0]) {
        let what = format!("amcw-scanner: an interval, {:.4} MHz, m", hz * 1e-6);
        figures.add(what, published, range_from_tof(1.0 / hz), Within::Share(0.011));
    }
    all.extend(figures.done());
    Ok(all)
}

/// The phase that a receiver finds from the `electrons` of its taps, and its standard deviation, rad.
fn received(method: &PhaseMethod, electrons: impl Fn(f64) -> f64) -> (f64, f64) {
    let phases = method.tones[0].phases;
    let taps = (0..phases).map(|tap| TAU * f64::from(tap) / f64::from(phases));
    let codes: Vec<u16> = taps.map(|phase| electrons(phase).round() as u16).collect();
    let found = measured(method, &codes).ok().and_then(|all| all.into_iter().next().flatten());
    found.map_or((f64::NAN, f64::NAN), |found| (found.phase, found.sigma))
}

/// Errors of phases.
fn phases() -> Vec<Figure> {
    let mut figures = Figures::of(MODULATED, "computed apart");
    let of =
        |hz: f64, phases: u32| PhaseMethod::new(vec![Tone { hz, phases, contrasts: vec![0.5] }]);
    for (taps, published) in [(3, 19.50), (4, 71.11), (8, 8.02)] {
        let method = of(100e6, taps);
        let error = |step: u32| {
            let truth = TAU * f64::from(step) / 5000.0;
            let light = |tap: f64| 30_000.0 * Wave::Square.share(0.8, truth - tap);
            let apart = received(&method, light).0 - truth;
            (apart - TAU * (apart / TAU).round()).abs()
        };
        let most = (0..5000).map(error).fold(0.0, f64::max) * 1e3;
        let what = format!("square waves, {taps} taps: largest error of a phase, mrad");
        figures.add(what, published, most, Within::Share(5e-3));
    }
    for (hz, published) in [(20e6, 27.06), (100e6, 21.95)] {
        let behind = TAU * hz * tof_from_range(0.3);
        let light =
            |tap: f64| 20_000.0 + 15_000.0 * (libm::cos(tap) + 0.1 * libm::cos(behind - tap));
        let bias = range_from_tof(received(&of(hz, 4), light).0 / (TAU * hz)) * 1e3;
        let what = format!("{} MHz: a tenth of the light 0.3 m behind, mm", hz * 1e-6);
        figures.add(what, published, bias, Within::Share(1e-3));
    }
    let light = |tap: f64| 1e4 + 5e3 * libm::cos(1.0 - tap);
    let sigma = range_from_tof(received(&of(100e6, 4), light).1 / (TAU * 100e6)) * 1e3;
    let what = "100 MHz, four taps of 10 000 electrons, amplitude 5000: precision, mm";
    figures.add(what, 3.374, sigma, Within::Share(1e-3));
    figures.done()
}

/// Beats, and how precise they are.
fn beats() -> Result<Vec<Figure>, Error> {
    let mut figures = Figures::of(CHIRPED, "computed apart");
    // The detector of this sensor is a coherent one; rows that are missing would be noticed.
    let with = |ghz: f64, us: f64, khz: f64| -> Result<Option<(Design, Coherent)>, Error> {
        let design = ready(
            "fmcw-1550",
            &[
                ("chirp.bandwidth_ghz", &format!("{ghz:?}")),
                ("chirp.up_us", &format!("{us:?}")),
                ("chirp.down_us", &format!("{us:?}")),
                ("chirp.linewidth_khz", &format!("{khz:?}")),
                ("spectrum.window", "\"none\""),
                ("spectrum.sample_msps", "1000.0"),
                ("scan.scans_per_s", "1.0"),
                ("scan.max_range_m", "100.0"),
                ("scan.light_range_m", "100.0"),
                ("optics.transmission", "1.0"),
            ],
        )?;
        match design.detector.clone() {
            Detector::Coherent(coherent) => Ok(Some((design, coherent))),
            _ => Ok(None),
        }
    };
    let Some((design, coherent)) = with(1.0, 10.0, 0.0)? else { return Ok(figures.done()) };
    let method = coherent.method(0.0, 60.0, 1e-6);
    let ramp = method.ramps[0];
    let share = Within::Share(1e-3);
    figures.add(
        "Doppler shift of 1 m/s at 1550 nm, MHz",
        1.2903,
        method.doppler(1.0) * 1e-6,
        share,
    );
    let shifted = range_from_tof(-ramp.bins(0.0, method.doppler(10.0)) / ramp.bandwidth);
    figures.add("10 m/s in one ramp of 1 GHz in 10 \u{b5}s, m", 19.34, shifted, share);
    let bin = range_from_tof(1.0 / ramp.bandwidth);
    figures.add("a bin of 1 GHz, m", 0.1499, bin, share);
    let Some((_, slow)) = with(0.2, 10.0, 0.0)? else { return Ok(figures.done()) };
    let slope = slow.chirp.ramps()[0].slope();
    let range = range_from_tof(10e6 / slope);
    figures.add("a beat of 10 MHz at 20 MHz/\u{b5}s, m", 75.0, range, share);
    for (khz, range, published) in
        [(100.0, 150.0, 0.5738), (100.0, 200.0, 0.4950), (1000.0, 150.0, 0.0328)]
    {
        let Some((_, coherent)) = with(1.0, 10.0, khz)? else { return Ok(figures.done()) };
        let left = coherent.chirp.coherence(tof_from_range(range), 10e-6);
        let what = format!("a line of {khz} kHz at {range} m: share of a peak of 10 \u{b5}s");
        figures.add(what, published, left, Within::Absolute(1e-4));
    }
    // √6/(2π)·(c/2B)/√S, and λ/2·√6/(2πT)/√S.
    let Some((_, coherent)) = with(0.653, 5.0, 0.0)? else { return Ok(figures.done()) };
    let precision = range_from_tof(coherent.spread(20.0)) * 1e2;
    figures.add("0.653 GHz, 20 photons: precision, cm", 2.0, precision, share);
    let Some((_, coherent)) = with(1.0, 2.25, 0.0)? else { return Ok(figures.done()) };
    let slope = coherent.chirp.ramps()[0].slope();
    let speed = coherent.spread(20.0) * slope * coherent.wavelength / 2.0 * 1e2;
    figures.add(
        "2.25 \u{b5}s, 20 photons: precision of a velocity, cm/s",
        3.0,
        speed,
        Within::Share(0.01),
    );
    let noon = [("irradiance_w_m2_nm", "0.27"), ("albedo", "1.0")];
    let noon = noon.map(|(key, value)| (key.to_owned(), value.to_owned()));
    let sunlit = Operating::of(&design, &Environment::changed("clear-day", &noon)?)?;
    let photons = sunlit.sunlight / coherent.spectrum.sample_hz * 1e6;
    figures.add(
        "photons of a sunlit white wall in a mode, 10\u{207b}\u{2076}",
        6.5,
        photons,
        Within::Share(0.02),
    );
    Ok(figures.done())
}

/// Photons that it takes, one false alarm in a million bins accepted.
fn detection() -> Vec<Figure> {
    let threshold = 6.0 * LN_10;
    let steady = |signal: f64| power_tail(1, signal, threshold);
    // The mean over an exponential variable, by 4000 of its quantiles.
    let speckled = |mean: f64| {
        let quantile = |step: u32| -mean * libm::log(1.0 - (f64::from(step) + 0.5) / 4000.0);
        (0..4000).map(|step| steady(quantile(step))).sum::<f64>() / 4000.0
    };
    let needed = |found: &dyn Fn(f64) -> f64| {
        let (mut low, mut high) = (1.0, 1000.0);
        for _ in 0..40 {
            let middle = (low + high) / 2.0;
            match found(middle) < 0.9 {
                true => low = middle,
                false => high = middle,
            }
        }
        high
    };
    let mut figures = Figures::of(CHIRPED, "computed apart");
    figures.add("Pd of 9 photons, steady", 0.182, steady(9.0), Within::Absolute(5e-4));
    figures.add("Pd of 9 photons, one speckle", 0.251, speckled(9.0), Within::Absolute(1e-3));
    figures.add("photons for Pd 0.9, steady", 20.81, needed(&steady), Within::Share(1e-3));
    let mean = needed(&speckled);
    figures.add("photons for Pd 0.9, one speckle", 130.1, mean, Within::Share(2e-3));
    figures.done()
}

//! What the paper says of time, converters, light and eyes, checked by arithmetic.

use std::f64::consts::PI;

use super::claim::{Claim, Verdict, holds};
use macropulse::channel::Link;
use macropulse::design::safety::Class1;
use macropulse::design::{Design, Pattern};
use macropulse::environment::Environment;
use macropulse::predict::link::{diffraction, spot_depth};
use macropulse::units::{range_from_tof, s_from_fs};

/// Claims on timing and converters.
pub(super) fn timing(design: &Design) -> Vec<Claim> {
    let derived = design.derived();
    let tick = s_from_fs(design.tdc.tick_fs);
    let clock = s_from_fs(design.tdc.clock_fs);
    let rollover = 2_f64.powi(32) * clock;
    let density = design.coding.codebook.family().weight() as f64
        / f64::from(design.coding.codebook.family().length());
    let rate = 25.0 * density / tick;
    let codes = design.tdc.clock_fs / design.tdc.tick_fs;
    vec![
        Claim {
            id: "refresh",
            section: "title, 2",
            claim: "Without idle listening the refresh rate does not depend on the range",
            paper: "60 Hz at 150 m, range irrelevant".into(),
            measured: format!(
                "one beam that waits for each echo reaches {:.2} Hz with these directions, a \
                 coded one 60 Hz; but its words return after {:.0} m, so range is limited after \
                 all, at a multiple",
                derived.idle_listening_rate,
                derived.unambiguous_range.unwrap_or(f64::INFINITY)
            ),
            verdict: Verdict::Partly,
        },
        Claim {
            id: "shots-in-flight",
            section: "2.2",
            claim: "Up to 25 pixels may arrive in 1 \u{b5}s from 150 m",
            paper: "25".into(),
            measured: format!(
                "{:.2} shots in {:.4} \u{b5}s; pixel period {:.3} ns = {:.2} chips",
                derived.shots_in_flight,
                derived.gate * 1e6,
                derived.pixel_period * 1e9,
                derived.pixel_period / tick
            ),
            verdict: holds(derived.shots_in_flight.ceil() == 25.0),
        },
        Claim {
            id: "overlap",
            section: "2",
            claim: "Reflections of several pixels are received at the same time",
            paper: "up to 25 deep".into(),
            measured: format!(
                "{:.3} macropulses at any instant on average, whatever the scene; 25 deep needs \
                 the range to fall by {:.1} m per pixel",
                derived.mean_overlap,
                range_from_tof(derived.pixel_period)
            ),
            verdict: Verdict::Partly,
        },
        Claim {
            id: "micropulses",
            section: "2.2",
            claim: "Micropulses of one scan",
            paper: "153 M (377 each)".into(),
            measured: format!("{:.2} M", derived.marks_per_scan as f64 * 1e-6),
            verdict: Verdict::Fails,
        },
        Claim {
            id: "converters",
            section: "2.3",
            claim: "1150 converters take 345 Gcps, 1149 pulses within a dead time",
            paper: "345 Gcps, 1149".into(),
            measured: format!(
                "25 words \u{d7} 29/841 at 400 GHz = {:.1} Gcps; \u{d7} 3.333 ns = {:.0}; it \
                 assumes 25 macropulses of nothing but 1 bits",
                rate * 1e-9,
                rate * 1e-8 / 3.0
            ),
            verdict: holds((rate * 1e-9 - 345.0).abs() < 0.5),
        },
        Claim {
            id: "rollover",
            section: "2",
            claim: "A 32-bit count of 100 ps rolls over every 430 ms",
            paper: "\u{2248} 430 ms".into(),
            measured: format!(
                "{:.1} ms; 2.5 ps ticks in 32 bits would wrap in {:.1} ms, within a scan",
                rollover * 1e3,
                2_f64.powi(32) * tick * 1e3
            ),
            verdict: holds((rollover * 1e3 - 430.0).abs() < 1.0),
        },
        Claim {
            id: "converter-range",
            section: "2.3",
            claim: "10 bits of 2.5 ps give a conversion range of 2.56 ns",
            paper: "2.56 ns".into(),
            measured: format!(
                "{:.2} ns, of which a START every 100 ps uses {codes} codes of 1024",
                1024.0 * tick * 1e9
            ),
            verdict: holds((1024.0 * tick * 1e9 - 2.56).abs() < 1e-9),
        },
        mirror(design),
        Claim {
            id: "eq1-fmcw",
            section: "1, Eq. 1",
            claim: "FMCW range is cBT/(4\u{394}f) with \u{394}f the difference of frequencies",
            paper: "d = cBT/(4\u{394}f)".into(),
            measured: "right for a triangular sweep if B is the beat frequency, T the period and \
                       \u{394}f the excursion; the text defines \u{394}f as what B is"
                .into(),
            verdict: Verdict::Partly,
        },
    ]
}

/// The claim on the elevations of the HDL-64E, whose `design` this is.
pub(super) fn elevations(design: &Design) -> Option<Claim> {
    let Pattern::Spinning(head) = &design.scan.pattern else { return None };
    let degrees: Vec<f64> =
        head.elevations.iter().map(|elevation| elevation.to_degrees()).collect();
    let (top, bottom) = (degrees.first()?, degrees.last()?);
    let step = |at: &[f64]| at.windows(2).next().map(|pair| pair[0] - pair[1]);
    let (upper, lower) = degrees.split_at(degrees.len() / 2);
    Some(Claim {
        id: "elevations",
        section: "Table 3",
        claim: "How the 64 lasers of the HDL-64E share its 26.8\u{b0}",
        paper: "unsaid in our copy; often taken as equal steps".into(),
        measured: format!(
            "no unit has equal steps: {} steps of {:.2}\u{b0} from {top:+.1}\u{b0} down, then {} of \
             {:.2}\u{b0} to {bottom:+.1}\u{b0} (preset hdl-64e-equal-spacing has equal steps)",
            upper.len() - 1,
            step(upper)?,
            lower.len() - 1,
            step(lower)?,
        ),
        verdict: Verdict::Unsaid,
    })
}

fn mirror(design: &Design) -> Claim {
    let derived = design.derived();
    let resonant = derived.pixel_period * 2.0 / PI;
    let moved = derived.macropulse / derived.pixel_period;
    Claim {
        id: "mirror",
        section: "2.2",
        claim: "The mirror stays on each pixel for about 40 ns, long enough for a macropulse",
        paper: "\u{2248} 40 ns, sufficient".into(),
        measured: format!(
            "{:.2} ns on average; a resonant mirror spends {:.2} ns at the centre of a line, \
             less than the {:.2} ns of a macropulse, and moves {moved:.2} pixel meanwhile",
            derived.pixel_period * 1e9,
            resonant * 1e9,
            derived.macropulse * 1e9
        ),
        verdict: Verdict::Partly,
    }
}

/// Claims on light, eyes and parts: what the `strict` reading of class 1 leaves, and the `lax` one
/// without the factor for repeated exposures, in the air and under the sun of a `day`.
pub(super) fn light(
    design: &Design,
    lax: &Design,
    strict: &Design,
    day: &Environment,
) -> Vec<Claim> {
    let (Some(lax), Some(budget)) = (&lax.budget, &strict.budget) else { return Vec::new() };
    let derived = design.derived();
    let Pattern::Raster(raster) = &design.scan.pattern else { return Vec::new() };
    let pitch = raster.grid.horizontal / f64::from(raster.grid.columns);
    let pitch_down = raster.grid.vertical / f64::from(raster.grid.rows);
    let wavelength = design.light.wavelength;
    let spread = diffraction(wavelength, design.light.beam_diameter);
    let spot = spread * design.scan.max_range;
    let chip_range = derived.tick_range;
    let tilt = libm::atan(chip_range / spot).to_degrees();
    let smear = spot_depth(spot, PI / 4.0) / chip_range;
    let (lax, energy) = (lax.energy, budget.energy);
    let through_air = Link::of(strict, day).transmission(design.scan.max_range).powi(2);
    let photons = budget.photons(energy, 1.0, design.scan.max_range) * through_air;
    let per_mark = photons / derived.marks.1;
    let irradiance = day.irradiance(wavelength).unwrap_or(f64::NAN);
    let background = budget.background(irradiance, day.albedo) * s_from_fs(design.coding.chip_fs);
    let limits = Class1::at(wavelength);
    vec![
        Claim {
            id: "pitch",
            section: "2.2",
            claim: "43.2\u{b0} in 848 and 24.3\u{b0} in 480 steps",
            paper: "0.0509\u{b0}, 0.0506\u{b0}".into(),
            measured: format!(
                "{:.4}\u{b0}, {:.4}\u{b0}",
                pitch.to_degrees(),
                pitch_down.to_degrees()
            ),
            verdict: holds(
                (pitch.to_degrees() - 0.0509).abs() < 1e-4
                    && (pitch_down.to_degrees() - 0.0506).abs() < 1e-4,
            ),
        },
        Claim {
            id: "wavelength",
            section: "2.2",
            claim: "The wavelength is 905 mm",
            paper: "905 mm".into(),
            measured: format!("{:.0} nm meant", wavelength * 1e9),
            verdict: Verdict::Fails,
        },
        Claim {
            id: "beam",
            section: "2.2",
            claim: "A collimated beam of 1 mm resolves 0.0509\u{b0}",
            paper: "1 mm".into(),
            measured: format!(
                "diffraction spreads it by {:.2} mrad = {:.3}\u{b0}: spots of {:.0} mm at 30 m \
                 and {:.0} mm at 150 m, wider than a pixel",
                spread * 1e3,
                spread.to_degrees(),
                spread * 30e3,
                spot * 1e3
            ),
            verdict: Verdict::Fails,
        },
        Claim {
            id: "chips-survive",
            section: "2.2",
            claim: "2.5 ps chips come back from real surfaces",
            paper: "0.375 mm chips".into(),
            measured: format!(
                "only from surfaces square-on within {tilt:.2}\u{b0} at 150 m; at 45\u{b0} a \
                 chip is smeared over {smear:.0} (footprint idealised away)"
            ),
            verdict: Verdict::Assumed,
        },
        Claim {
            id: "eye-safety",
            section: "2.2",
            claim: "The power is that of a class 1 laser",
            paper: "same or similar to the MPE".into(),
            measured: format!(
                "class 1 leaves {:.2} nJ a macropulse, {:.2} nJ without the multiple-pulse \
                 factor; one pulse alone could have {:.1} nJ, the mean {:.2} mW standing still",
                energy * 1e9,
                lax * 1e9,
                limits.map_or(0.0, |l| l.single_exposure(derived.macropulse)) * 1e9,
                limits.map_or(0.0, |l| l.continuous()) * 1e3,
            ),
            verdict: Verdict::Assumed,
        },
        Claim {
            id: "rated-range",
            section: "2.3",
            claim: "The receiver sees a white surface at 150 m",
            paper: "150 m at 100 % remission".into(),
            measured: format!(
                "at {:.2} nJ, 25 mm aperture and 0.7 optics: {photons:.1} photons a macropulse, \
                 {per_mark:.2} a micropulse against {background:.0} of sunlight in every chip of \
                 a staring receiver; it would need {:.1} a micropulse. Declared by sensitivity \
                 instead",
                energy * 1e9,
                derived.reference_photons
            ),
            verdict: Verdict::Fails,
        },
        Claim {
            id: "parts",
            section: "2.2, 2.3",
            claim: "Photoconductive antennas send and receive 905 nm, a lock-in amplifier follows \
                    single chips",
            paper: "LTG InGaAs antenna, lock-in".into(),
            measured: "such antennas make and sample THz fields, a lock-in needs repetitions: \
                       assumed as an ideal 400 GHz detector"
                .into(),
            verdict: Verdict::Assumed,
        },
    ]
}

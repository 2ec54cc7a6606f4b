//! Claims of the paper on beam, mirror, eyes and reach.

use crate::paper::claim::{Claim, Verdict, said};
use crate::paper::measured::{Light, Timing};

pub(super) fn claims(found: &Light, timing: &Timing) -> Vec<Claim> {
    let mut claims = beam(found);
    claims.extend(energy(found));
    claims.push(parts(found, timing));
    claims
}

fn beam(found: &Light) -> Vec<Claim> {
    let [across, down] = found.pitch.map(f64::to_degrees);
    let fits = |side: f64, turn: f64| side * libm::cos(turn) >= found.beam;
    let [wide, high] = found.mirror;
    let [to_side, up] = found.mirror_turns;
    let wider = match found.spread > found.pitch[0] {
        true => "wider than",
        false => "within",
    };
    let half = match found.spread_half > found.pitch[0] {
        true => "wider than",
        false => "within",
    };
    vec![
        said(
            "pitch",
            "2.2",
            "43.2\u{b0} in 848 and 24.3\u{b0} in 480 steps",
            "0.0509\u{b0}, 0.0506\u{b0}",
        )
        .holds_if(
            (across - 0.0509).abs() < 1e-4 && (down - 0.0506).abs() < 1e-4,
            format!("{across:.4}\u{b0}, {down:.4}\u{b0}"),
        ),
        said("wavelength", "2.2", "The wavelength is 905 mm", "905 mm").holds_if(
            (found.wavelength - 0.905).abs() < 1e-3,
            format!("{:.0} nm", found.wavelength * 1e9),
        ),
        said(
            "beam",
            "2.2",
            "A collimated beam of 1 mm resolves steps of 0.0509\u{b0}",
            "1 mm, collimated",
        )
        .holds_or_partly(
            found.spread <= found.pitch[0],
            found.spread_half <= found.pitch[0],
            format!(
                "it stays collimated for {:.2} m, then diffraction spreads it by {:.2} mrad = \
                 {:.3}\u{b0} at 1/e\u{b2}, {wider} a pixel, and {:.3}\u{b0} at half of the middle, \
                 {half} one: spots of {:.0} mm (half: {:.0} mm) at 30 m and {:.0} mm ({:.0} mm) at \
                 {:.0} m",
                found.collimated,
                found.spread * 1e3,
                found.spread.to_degrees(),
                found.spread_half.to_degrees(),
                found.spread * 30e3,
                found.spread_half * 30e3,
                found.spread * found.range * 1e3,
                found.spread_half * found.range * 1e3,
                found.range
            ),
        ),
        said(
            "mirror-size",
            "2.2",
            "A mirror of 1.1 mm x 1.2 mm reflects a beam of 1 mm",
            "1.1 mm \u{d7} 1.2 mm",
        )
        .holds_or_partly(
            fits(wide, to_side) && fits(high, up),
            wide >= found.beam && high >= found.beam,
            format!(
                "{:.1} % of the light of a beam of 1 mm at 1/e\u{b2}; it still fits turned by the \
                 {:.1}\u{b0} of the scan, but not if it meets the mirror at more than {:.0}\u{b0}",
                100.0 * found.mirror_takes,
                to_side.to_degrees(),
                libm::acos((found.beam / wide).min(1.0)).to_degrees()
            ),
        ),
        said("chips-survive", "2.2", "2.5 ps chips come back from real surfaces", "0.375 mm chips").is(
            match (found.smear <= 1.0, found.is_line) {
                (true, _) => Verdict::Holds,
                (false, true) => Verdict::Assumed,
                (false, false) => Verdict::Fails,
            },
            format!(
                "only from surfaces square-on within {:.2}\u{b0} at {:.0} m; at 45\u{b0} a chip is \
                 smeared over {:.0} (footprint idealised away)",
                found.tilt.to_degrees(),
                found.range,
                found.smear
            ),
        ),
    ]
}

fn energy(found: &Light) -> Vec<Claim> {
    let factor = found.energy_needed / found.energy;
    vec![
        said(
            "eye-safety",
            "2.2",
            "The power is that of a class 1 laser",
            "same or similar to the MPE",
        )
        .is(
            match (factor <= 1.0, found.is_unlimited) {
                (true, _) => Verdict::Holds,
                (false, true) => Verdict::Assumed,
                (false, false) => Verdict::Fails,
            },
            format!(
                "class 1 leaves {:.2} nJ a macropulse, {:.2} nJ without the multiple-pulse factor; \
                 what the sensor declares to see would take {:.0} nJ, {factor:.0} times as much. \
                 One pulse alone could have {:.1} nJ, the mean {:.2} mW standing still",
                found.energy * 1e9,
                found.energy_lax * 1e9,
                found.energy_needed * 1e9,
                found.energy_alone * 1e9,
                found.power * 1e3
            ),
        ),
        said(
            "rated-range",
            "2.3",
            "The receiver sees a white surface at 150 m",
            "150 m at 100 % remission",
        )
        .holds_or_partly(
            found.pd_by_day >= 0.9,
            found.pd_by_night >= 0.5,
            format!(
                "at {:.2} nJ, 25 mm aperture and 0.7 optics: {:.1} photons a macropulse, {:.2} a \
                 micropulse. A receiver that matches whole macropulses has by night, simulated, Pd {:.3} at \
                 {:.0} m, by day, staring, with {:.0} photons of sunlight in \
                 every chip, Pd {:.3}. Mark by mark it would need {:.1} a \
                 micropulse. Declared by sensitivity instead",
                found.energy * 1e9,
                found.photons,
                found.photons_per_mark,
                found.pd_by_night,
                found.range,
                found.sunlight,
                found.pd_by_day,
                found.photons_declared
            ),
        ),
    ]
}

fn parts(found: &Light, timing: &Timing) -> Claim {
    said(
        "parts",
        "2.2, 2.3",
        "Photoconductive antennas send and receive 905 nm, a lock-in amplifier follows single chips",
        "LTG InGaAs antenna, lock-in",
    )
    .is(
        if found.is_unbounded { Verdict::Assumed } else { Verdict::Fails },
        format!(
            "such antennas make and sample THz fields, a lock-in needs repetitions: assumed as an \
             ideal {:.0} GHz detector",
            timing.chip_rate * 1e-9
        ),
    )
}

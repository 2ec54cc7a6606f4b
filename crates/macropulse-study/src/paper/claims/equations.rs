//! Results of Eqs. 1, 3 and 4 when they are tried.

use crate::paper::claim::{Claim, said};
use crate::paper::measured::{Equations, Ranging};

/// Share of a range by which a measurement may be off and still give it.
const WITHIN: f64 = 1e-3;

fn is_at(range: f64, wall: f64) -> bool {
    (range / wall - 1.0).abs() < WITHIN
}

/// Tells if Eq. 1 and the lidar's own receiver find a wall.
pub(super) fn gives(found: &Ranging) -> bool {
    is_at(found.equation, found.wall) && is_at(found.points, found.wall)
}

/// A wall in words.
pub(super) fn told(found: &Ranging) -> String {
    format!(
        "{:.4} m \u{b1} {:.1} mm, simulated, of a wall at {:.0} m",
        found.equation,
        found.error * 1e3,
        found.wall
    )
}

pub(super) fn claims(found: &Equations) -> Vec<Claim> {
    let (phase, beyond) = (&found.amplitude, &found.amplitude_beyond);
    let [near, far] = &found.frequency;
    let printed = [near, far].iter().all(|wall| is_at(wall.printed, wall.found.wall));
    vec![
        said(
            "eq1-amcw",
            "1, Eq. 1",
            "The range of a wave of modulated amplitude follows from its phase",
            "d = \u{3d5}c/(4\u{3c0}f)",
        )
        .holds_or_partly(
            gives(phase) && gives(beyond),
            gives(phase),
            format!(
                "{} from the phase of its taps, {:.3} m by the lidar's own receiver. The same phase \
                 comes again every c/2f, here {:.1} m, which the equation does not say: a wall at \
                 {:.1} m is found at {:.3} m",
                told(phase),
                phase.points,
                found.phase_wraps,
                beyond.wall,
                beyond.equation
            ),
        ),
        said(
            "eq1-fmcw",
            "1, Eq. 1",
            "FMCW range is cBT/(4\u{394}f) with \u{394}f the difference of frequencies",
            "d = cBT/(4\u{394}f)",
        )
        .holds_or_partly(
            printed,
            gives(&near.found) && gives(&far.found),
            format!(
                "{} from the beats of a triangular sweep, {:.3} m by the lidar's own receiver, if B is \
                 the beat frequency, T the period and \u{394}f the excursion; a wall at {:.0} m is \
                 found at {:.3} m. With \u{394}f the difference between what is sent and received, as \
                 the text has it, {:.0} m whatever the range; with B a bandwidth then, {:.0} m and for \
                 the farther wall {:.0} m",
                told(&near.found),
                near.found.points,
                far.found.wall,
                far.found.equation,
                near.printed,
                near.swapped,
                far.swapped
            ),
        ),
        said(
            "eq3-support",
            "2.3, Eq. 3",
            "Words vanish for n < 0 and n \u{2264} 841, and \u{398}(0) = C(0) = 29",
            "n \u{2264} 841",
        )
        .holds_or_partly(
            found.peak_printed == 29,
            found.peak == 29,
            format!(
                "a word that vanishes for n \u{2264} 841 has a peak of {}; {} with n \u{2265} 841",
                found.peak_printed, found.peak
            ),
        ),
        said(
            "eq4-sign",
            "2.3, Eq. 4",
            "\u{398}(l) = C(l) + C(l \u{2212} 841): the minus is lost in our copy",
            "C(l mod 841) + C((l mod 841) 841)",
        )
        .holds_if(
            found.wrong_with_minus == 0 && found.wrong_with_plus > 0,
            format!(
                "with a minus {} of {} pairs and lags are wrong, with a plus {}",
                found.wrong_with_minus, found.tried, found.wrong_with_plus
            ),
        ),
    ]
}

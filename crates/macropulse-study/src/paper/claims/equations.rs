//! Results of Eqs. 1, 3 and 4 when they are tried.

use crate::paper::claim::{Claim, said};
use crate::paper::measured::Equations;

pub(super) fn claims(found: &Equations) -> Vec<Claim> {
    let gives = |range: f64| (range / found.range - 1.0).abs() < 1e-9;
    vec![
        said(
            "eq1-amcw",
            "1, Eq. 1",
            "The range of a wave of modulated amplitude follows from its phase",
            "d = \u{3d5}c/(4\u{3c0}f)",
        )
        .holds_or_partly(
            gives(found.amplitude) && found.phase_wraps.is_infinite(),
            gives(found.amplitude),
            format!(
                "{:.6} m from the phase of 64 samples of a wave from {:.0} m; the same phase comes \
                 again every c/2f, here {:.0} m, which the equation does not say",
                found.amplitude, found.range, found.phase_wraps
            ),
        ),
        said(
            "eq1-fmcw",
            "1, Eq. 1",
            "FMCW range is cBT/(4\u{394}f) with \u{394}f the difference of frequencies",
            "d = cBT/(4\u{394}f)",
        )
        .holds_or_partly(
            gives(found.frequency_printed),
            gives(found.frequency),
            format!(
                "{:.6} m of {:.0} m for a triangular sweep if B is the beat frequency, T the period \
                 and \u{394}f the excursion; with \u{394}f the difference between what is sent and \
                 received, as the text has it, {:.0} m whatever the range",
                found.frequency, found.range, found.frequency_printed
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

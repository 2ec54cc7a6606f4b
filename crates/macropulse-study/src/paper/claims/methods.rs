//! Claims of the paper on the three methods of its first equation.

use super::experiment::{NO_GROWTH, falling};
use crate::paper::claim::{Claim, said};
use crate::paper::lidars::{AMCW, FMCW, PULSED};
use crate::paper::measured::{Methods, Place, Reach};

/// Ranges at which the precision of all three is compared, m.
pub const COMPARED_M: [f64; 3] = [10.0, 35.0, 70.0];

pub(super) fn claims(found: &Methods) -> Vec<Claim> {
    vec![distances(found), accuracy(found)]
}

/// Range at which Pd falls below a half, in words.
fn half(reach: &Reach) -> String {
    let [half, low, high] = reach.half();
    format!("{half:.0} m ({low:.0} to {high:.0})")
}

/// A width of a line in words.
pub(in crate::paper) fn line(hz: f64) -> String {
    if hz < 1e6 { format!("{:.0} kHz", hz * 1e-3) } else { format!("{:.0} MHz", hz * 1e-6) }
}

/// One lidar reaches farther than another if the intervals of 95 % of their ranges do not meet.
fn distances(found: &Methods) -> Claim {
    let farther = |one: &Reach, other: &Reach| one.half()[1] > other.half()[2];
    let (pulsed, amcw) = (found.of(PULSED), found.of(AMCW));
    let is_as_said = |chirped: &Reach| match (pulsed, amcw) {
        (Some(pulsed), Some(amcw)) => farther(pulsed, amcw) && farther(amcw, chirped),
        _ => false,
    };
    let as_said: Vec<&(f64, Reach)> =
        found.lines.iter().filter(|(_, chirped)| is_as_said(chirped)).collect();
    let list = |lines: &mut dyn Iterator<Item = &(f64, Reach)>| {
        lines.map(|(hz, _)| line(*hz)).collect::<Vec<_>>().join(", ")
    };
    let each = found.lines.iter().map(|(hz, reach)| format!("{} at {}", half(reach), line(*hz)));
    let words = |reach: Option<&Reach>| reach.map(half).unwrap_or_default();
    said(
        "method-distance",
        "1",
        "Pulses are for long distances, modulated amplitude for middle and modulated frequency for short ones",
        "long, middle, and short",
    )
    .holds_or_partly(
        !as_said.is_empty() && as_said.len() == found.lines.len(),
        !as_said.is_empty(),
        format!(
            "range at which Pd falls below a half, with the light of class 1: pulsed {}, AMCW {}, FMCW by \
             the line of its laser {}; the order is that of the paper with lines of {}",
            words(pulsed),
            words(amcw),
            each.collect::<Vec<_>>().join(", "),
            match as_said.is_empty() {
                true => "no width".to_owned(),
                false => list(&mut as_said.into_iter()),
            }
        ),
    )
}

/// The error of a lidar grows if it does so from each range to the next, by more than two standard errors.
fn accuracy(found: &Methods) -> Claim {
    // A standard deviation of n values scatters by its 1/√(2n).
    let variance = |place: &Place| place.precision.powi(2) / (2.0 * place.points as f64);
    let scatter = |one: &Place, next: &Place| (variance(one) + variance(next)).sqrt();
    let (mut growing, mut constant, mut words) = (0, 0, Vec::new());
    for lidar in [PULSED, AMCW, FMCW] {
        let reach = found.of(lidar);
        let places = COMPARED_M.map(|range| reach.and_then(|reach| reach.at(range)));
        let [Some(near), Some(middle), Some(far)] = places else { continue };
        let grows =
            |one: &Place, next: &Place| next.precision - one.precision > 2.0 * scatter(one, next);
        let growth = far.precision - near.precision;
        growing += usize::from(grows(near, middle) && grows(middle, far));
        constant += usize::from(growth + 2.0 * scatter(near, far) < NO_GROWTH * near.precision);
        let each = [near, middle, far].map(|place| format!("{:.1}", place.precision * 1e3));
        words.push(format!("{lidar} {} mm", each.join(", ")));
    }
    said(
        "accuracy-methods",
        "1",
        "Accuracy decreases with distance for pulses, modulated amplitude and modulated frequency alike",
        "regardless of the measurement method",
    )
    .is(
        falling(growing, constant, 3),
        format!(
            "standard deviation of the range of a wall of 10 % at {:.0}, {:.0} and {:.0} m: {}; it grows \
             from each to the next for {growing} of 3",
            COMPARED_M[0],
            COMPARED_M[1],
            COMPARED_M[2],
            words.join("; ")
        ),
    )
}

//! Decoding time of a scan as declared: which bands are the most expensive, and what is found in them.

use std::slice;

use macropulse::codec::decode::{self, Returns};

use crate::Fallible;
use crate::page::{self, three};
use crate::sample::{Condition, Given, Sample};

/// Interval of the decoded bands. It is short enough for each scene to show far ground, which is only a few
/// rows.
const EVERY: usize = 3;

/// How often each is timed.
const ROUNDS: usize = 4;

/// Shares of the bands, the dearest first, by name.
const SHARES: [(&str, f64); 3] =
    [("dearest tenth", 0.1), ("next four tenths", 0.5), ("other half", 1.0)];

/// A band.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Decoded {
    seconds: f64,
    shots: f64,
    /// Shots with a return: the sensor gives one of each. Their marks, and how many of these are seen.
    found: f64,
    marks: f64,
    seen: f64,
}

impl Decoded {
    /// Both together.
    fn with(self, other: &Self) -> Self {
        Self {
            seconds: self.seconds + other.seconds,
            shots: self.shots + other.shots,
            found: self.found + other.found,
            marks: self.marks + other.marks,
            seen: self.seen + other.seen,
        }
    }
}

/// The table.
pub fn text() -> Fallible<String> {
    let mut rows = Vec::new();
    for scene in ["car-50m", "street"] {
        let mut bands = decoded(&Sample::of(Condition::Declared.design()?, scene, EVERY)?)?;
        bands.sort_by(|one, other| other.seconds.total_cmp(&one.seconds));
        let parts = parts(&bands);
        let all = parts.iter().fold(Decoded::default(), Decoded::with);
        rows.extend(SHARES.iter().zip(parts).map(|((name, _), part)| {
            vec![
                format!("`{scene}`, {name}"),
                three(1e9 * part.seconds / part.shots),
                format!("{:.0} %", 100.0 * part.seconds / all.seconds),
                format!("{:.1} %", 100.0 * part.found / part.shots),
                format!("{:.1} %", 100.0 * part.seen / part.marks.max(1.0)),
            ]
        }));
    }
    let head = ["bands", "ns a shot", "of all time", "shots with a return", "marks seen of these"];
    Ok(page::table(&head, &rows))
}

/// The bands of a `sample`, each decoded as soon as its ticks are there.
fn decoded(sample: &Sample) -> Result<Vec<Decoded>, decode::Error> {
    let detectors = sample.detectors();
    let mut least: Vec<Decoded> = Vec::new();
    let mut failed = None;
    for _ in 0..ROUNDS {
        let mut number = 0;
        sample.ticks(&detectors, |memory, given| {
            match timed(sample, &given) {
                Ok(band) => match least.get_mut(number) {
                    Some(known) => known.seconds = known.seconds.min(band.seconds),
                    None => least.push(band),
                },
                Err(why) => failed = Some(why),
            }
            number += 1;
            memory.take_back(given.1.tick);
        });
    }
    failed.map_or(Ok(least), Err)
}

/// A band, decoded once.
fn timed(sample: &Sample, given: &Given) -> Result<Decoded, decode::Error> {
    let (returns, seconds) = sample.decode_timed(slice::from_ref(given))?;
    let sum = |column: fn(&Returns) -> &[u16]| {
        returns.iter().flat_map(column).map(|count| f64::from(*count)).sum()
    };
    Ok(Decoded {
        seconds,
        shots: given.0.owned.len() as f64,
        found: returns.iter().map(Returns::len).sum::<usize>() as f64,
        marks: sum(|returns| &returns.marks),
        seen: sum(|returns| &returns.peak),
    })
}

/// Returns the sum of each of the [`SHARES`] of sorted `bands`.
fn parts(bands: &[Decoded]) -> [Decoded; SHARES.len()] {
    let mut first = 0;
    SHARES.map(|(_, share)| {
        let end = (share * bands.len() as f64).round() as usize;
        let part = bands[first..end].iter().fold(Decoded::default(), Decoded::with);
        first = end;
        part
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_band_is_in_one_part() {
        let bands: Vec<Decoded> = (0..40)
            .map(|band| Decoded { seconds: f64::from(band), ..Decoded::default() })
            .collect();
        let seconds = parts(&bands).map(|part| part.seconds);
        assert_eq!(seconds, [6.0, 184.0, 590.0]);
    }
}

//! The odds of a shot by the rule of belief.

use macropulse::codec::decode;
use macropulse::codec::decode::belief::Prior;
use serde::{Deserialize, Serialize};

use super::curve::{Curve, Scale, Words};
use super::{Shot, finite};
use crate::text::{Columns, short};
use crate::view::Chart;

const WORDS: Words = Words {
    title: "Evidence for light",
    axis: "Evidence, nats",
    all: "evidence",
    left: "what is needed",
    is_left_lowest: true,
};

/// The odds of the best lag.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Odds {
    lag_ticks: i64,
    range_m: f64,
    /// Marks that no fuller return claims, and how many of them are lit.
    unclaimed_marks: u32,
    lit_marks: u32,
    /// Null where there is one mark, or no more than chance gives.
    evidence_nats: Option<f32>,
    prior_nats: f64,
    threshold_nats: f64,
    /// Null of a shot without a label.
    label_contradiction_nats: Option<f32>,
    /// First and last lag that have a prior probability.
    reach_ticks: [i64; 2],
    /// The places at which neighbours predict light.
    expected: Vec<Expected>,
}

/// A lag at which a neighbour leads to expect light.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Expected {
    lag_ticks: i64,
    range_m: f64,
}

impl Odds {
    /// The `odds` of a shot.
    pub fn new(odds: &decode::Odds, shot: &Shot) -> Self {
        let best = &odds.best;
        let expected = |lag: &i64| Expected { lag_ticks: *lag, range_m: shot.range(*lag) };
        Self {
            lag_ticks: best.lag,
            range_m: shot.range(best.lag),
            unclaimed_marks: best.marks.of,
            lit_marks: best.marks.lit,
            evidence_nats: finite(best.evidence as f32),
            prior_nats: best.prior,
            threshold_nats: best.threshold,
            label_contradiction_nats: best.contradiction.and_then(|nats| finite(nats as f32)),
            reach_ticks: [odds.reach.start, odds.reach.end - 1],
            expected: odds.expected.iter().map(expected).collect(),
        }
    }

    /// Adds its lines to the text about a macropulse of `marks` marks.
    pub fn push(&self, marks: usize, columns: &mut Columns) {
        let (at, threshold) = (short(self.range_m), nats(self.threshold_nats));
        columns.push(
            "odds",
            match (self.evidence_nats, self.odds()) {
                (Some(evidence), Some(odds)) => format!(
                    "{} nats at {at} m: evidence {} and ln prior {}; {threshold} are needed",
                    nats(odds),
                    nats(evidence.into()),
                    nats(self.prior_nats)
                ),
                _ => {
                    format!("none at {at} m: evidence takes two marks, and more than chance gives")
                }
            },
        );
        let mut ranges: Vec<f64> = self.expected.iter().map(|expected| expected.range_m).collect();
        ranges.sort_by(f64::total_cmp);
        let mut expected: Vec<String> = ranges.into_iter().map(short).collect();
        expected.dedup();
        columns.push(
            "prior",
            match expected.is_empty() {
                true => "the same at every lag: no shot beside it was found".to_owned(),
                false => format!("neighbours lead to expect light at {} m", expected.join(", ")),
            },
        );
        let claimed = marks - self.unclaimed_marks as usize;
        columns.push(
            "claims",
            format!(
                "{claimed} of {marks} marks are claimed by fuller returns; {} of the other {} are lit",
                self.lit_marks, self.unclaimed_marks
            ),
        );
        if let Some(against) = self.label_contradiction_nats {
            let by = nats(against.abs().into());
            columns.push(
                "label",
                match against > 0.0 {
                    true => {
                        format!("contradicted: another one explains the light better by {by} nats")
                    }
                    false => format!("fits, better than any other one by {by} nats"),
                },
            );
        }
    }

    /// The logarithm of the posterior odds.
    fn odds(&self) -> Option<f64> {
        self.evidence_nats.map(|evidence| f64::from(evidence) + self.prior_nats)
    }

    /// Why no lag was believed, behind a semicolon.
    pub fn refusal(&self) -> String {
        let (at, threshold) = (short(self.range_m), self.threshold_nats);
        match self.odds() {
            None => "evidence takes two marks, and more than chance gives".to_owned(),
            Some(odds) if odds < threshold => format!(
                "the best odds, at {at} m, are {} nats, and {} are needed",
                nats(odds),
                nats(threshold)
            ),
            Some(odds) => format!(
                "the odds at {at} m, {} nats, would be enough, but the receiver did not look there, or \
                 did not believe it in the light that it knew: a thorough one counts every lag",
                nats(odds)
            ),
        }
    }

    /// The `evidence` at each lag of `scale`, and how much is needed there.
    pub fn charts(&self, scale: &Scale, evidence: &[f32]) -> Vec<Chart> {
        let [first, last] = self.reach_ticks;
        let neighbours: Vec<i64> = self.expected.iter().map(|one| one.lag_ticks).collect();
        let prior = Prior::new(first..last + 1, &neighbours);
        let needed = |place: usize| self.threshold_nats - prior.at(scale.lag(place));
        let left: Vec<f64> = (0..evidence.len()).map(needed).collect();
        let found: Vec<f64> = evidence.iter().copied().map(f64::from).collect();
        let most = found.iter().chain(&left).copied().fold(1.0, f64::max);
        let said =
            format!("{} at {:.3} m", nats(self.evidence_nats.unwrap_or(0.0).into()), self.range_m);
        let peak = Some((self.lag_ticks, said));
        Curve { words: &WORDS, scale, found, left, most, threshold: None, peak }.charts()
    }
}

/// A number of nats, to a tenth.
fn nats(number: f64) -> String {
    short((number * 10.0).round() / 10.0).replace('-', "\u{2212}")
}

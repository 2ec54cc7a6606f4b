//! The odds of one shot at every lag, by the rule of belief.

use std::ops::Range;

use super::neighbours::Neighbours;
use super::reference::residual::Residual;
use super::reference::search::Peak;
use super::sent::{Sent, Words};
use crate::code::Codebook;
use crate::decode::belief::{self, Hypothesis, Marks, Prior};
use crate::decode::field::{self, Field};
use crate::decode::{Correlation, Receiver};
use crate::{ShotLog, Ticks};

/// The odds of one shot at many lags, by the [rule of belief](belief), in nats.
///
/// The returns of all other shots are known. Those that are fuller than the shot claim the places of their marks.
#[derive(Debug, Clone, PartialEq)]
pub struct Odds {
    /// Evidence for light at each lag, ascending as asked for; 0 where there is none.
    pub evidence: Vec<f32>,
    /// The lags that have a prior probability: those of the gate, and beyond it all from which light may come.
    pub reach: Range<i64>,
    /// The lags at which neighbours lead to expect light. With `reach` they make the [prior](belief::Prior).
    pub expected: Vec<i64>,
    /// The best lag.
    pub best: Weighed,
}

/// Evidence, prior and label of a shot at one lag.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Weighed {
    /// Ticks from firing to its light.
    pub lag: i64,
    /// Its marks that no fuller return claims, and how many of them are lit.
    pub marks: Marks,
    /// Evidence of these marks; −∞ for a single mark, and for no more marks than chance gives.
    pub evidence: f64,
    /// ln π.
    pub prior: f64,
    /// ln(1/α), which evidence and prior must reach together.
    pub threshold: f64,
    /// By how much another label explains the light better than that of the shot. Above 0 it is refused. `None` of a shot
    /// that carries no label.
    pub contradiction: Option<f64>,
}

/// A shot, and the light that competes with its own.
pub(in crate::decode) struct Question {
    /// The light of the shot, at the lag that was accepted or else has most marks.
    pub own: Hypothesis,
    /// Returns of other shots.
    pub others: Vec<Hypothesis>,
    /// The lags to weigh, ascending.
    pub lags: Vec<i64>,
    /// `own` was accepted, so its lag is the best one.
    pub is_accepted: bool,
}

/// The odds of a shot, by all `ticks` of its channel. `None` if it has no mark, or there is no lag.
pub(in crate::decode) fn odds(
    receiver: &Receiver,
    correlation: &Correlation,
    (codebook, log): (&Codebook, &ShotLog),
    ticks: &Ticks,
    question: &Question,
) -> Option<Odds> {
    let sent = &Sent::new(receiver, correlation, (codebook, log), (ticks.epoch, Words::default()));
    let (shot, own) = (question.own.shot, question.own);
    let width = i64::from(sent.width) - 1;
    if sent.weight(shot) == 0 {
        return None;
    }
    // Light that overlaps with that of the shot is at hand as a whole.
    let (arrival, beside) = (sent.arrival(shot), 2 * sent.takes_up());
    let span = arrival.start - beside..arrival.end + beside;
    let extent = (span.start, span.end - span.start);
    let mut field =
        Field::new(&ticks.tick, sent.width, extent, sent.length(), field::Memory::default());
    field.cover(span.clone());
    let mut residual = Residual::new(sent);
    residual.restore(&field);
    for other in question.others.iter().filter(|other| **other < own) {
        let touched = residual.touched(other.shot, other.lag);
        if touched.start >= span.start && touched.end <= span.end {
            residual.explain(other.shot, other.lag);
        }
    }
    let lag_of = |shot: usize| {
        let of_shot = question.others.iter().filter(|other| other.shot == shot);
        Some(of_shot.min()?.lag)
    };
    let expected = Neighbours::of(log).expected_lags(shot, lag_of);
    let prior = Prior::new(sent.reach(), &expected);
    let (gate, threshold) = (residual.gate(shot), belief::threshold(correlation.false_alarm));
    let peak = |lag: i64| residual.peak(&gate, lag, &prior);
    let peaks: Vec<Peak> = question.lags.iter().copied().map(peak).collect();
    let evidence = peaks.iter().map(|peak| peak.evidence.max(0.0) as f32).collect();
    let best = match question.is_accepted {
        // Its time is known to some ticks.
        true => Peak::best((own.lag - width..=own.lag + width).map(peak)),
        false => Peak::best(peaks.into_iter()),
    }?;
    // If no lag has evidence, the best one is that with most marks.
    let best = if best.odds.is_finite() { best } else { peak(own.lag) };
    let has_label = sent.bits_of_payload() > 1;
    let contradiction = has_label.then(|| residual.contradiction(&gate, best.lag, &prior));
    Some(Odds {
        evidence,
        reach: sent.reach(),
        expected,
        best: Weighed {
            lag: best.lag,
            marks: best.marks,
            evidence: best.evidence,
            prior: prior.at(best.lag),
            threshold,
            contradiction,
        },
    })
}

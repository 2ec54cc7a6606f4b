//! The thorough receiver: every lag of every shot is a hypothesis, and belief alone decides.
//!
//! The quick receiver looks where light is likely. This one counts all lags, and shows the light that the quick one
//! skips. It decides by [`belief`](crate::decode::belief) and nothing else:
//!
//! 1. The detections of the quick receiver are the first hypotheses. They save time: light that they explain
//!    is not searched through.
//! 2. All hypotheses are judged, the fullest first. Each sees the ticks and the places that fuller returns leave
//!    ([`residual`]), and a prior made from fuller returns of the shots beside it.
//! 3. A hypothesis stands for its sidelobes, too: it is judged at the best lag of those whose light overlaps with its
//!    own. If that is another one, the hypothesis is judged again in what is left. It is refused if its label is
//!    contradicted.
//! 4. Each shot proposes its best lag, if it is believed in light that neither returns nor earlier proposals of the shot
//!    explain. [`search`] finds it: near the lags that neighbours lead to expect, and if no shot has one there, of all
//!    lags. A shot has done with its light after some proposals, and a part of refused light is no return.
//! 5. Steps 2 to 4 are repeated until no shot proposes anything. A shot is searched again if returns have changed where
//!    its light may be.
//!
//! As soon as the returns about a shot are known, its lag is the best one by the prior of all of them, if it has a single
//! return.
//!
//! The shots of a band are decoded in blocks. A block has the shots of some gates and all that were in flight
//! before. A shot is searched and settled when no later light overlaps with its own. Settled returns stay,
//! and claim light of the next block first. The end of a block can change a verdict only if light of a shot
//! behind it overlaps that of a settled shot, and the quick receiver missed it.

pub(super) mod residual;
pub(super) mod search;
#[cfg(test)]
mod tests;

use std::collections::BTreeSet;
use std::ops::Range;

use super::Detection;
use super::measure::{Meter, Photons};
use super::neighbours::Neighbours;
use super::sent::Sent;
use super::track::{BLOCK, below};
use crate::decode::belief::{self, Hypothesis, Light, Marks, Prior};
use crate::decode::field::{self, Field};
use crate::decode::{Reject, Returns, Strength};
use crate::kernels::{Counts, NARROW, or};
use residual::{Residual, Saved};
use search::{Peak, Question, Search};

/// Hypotheses of a shot at most. It bounds the time that a hostile band takes.
const MOST_HYPOTHESES: usize = 16;

/// Returns that one hypothesis may lead to: its own, and those that take its place.
const MOST_OF_HYPOTHESIS: usize = 4;

/// Gates of a block, if they have no more ticks than [`BLOCK_TICKS`]; two at least. The shots of the last one are judged
/// again in the next block, and searched there.
const GATES: i64 = 8;
const BLOCK_TICKS: i64 = 1 << 25;

/// Lags to both sides of an expected one in which light is looked for first: together they are counted at once.
const EXPECTED: i64 = search::BLOCK / 2;

/// A band, and what is known of it.
pub(super) struct Reference<'a> {
    sent: &'a Sent<'a>,
    field: Field<'a>,
    residual: Residual<'a>,
    search: Search,
    /// The logarithm of the posterior odds from which on a hypothesis is believed.
    threshold: f64,
    neighbours: Neighbours,
    /// Shots that are judged; those before are settled.
    open: Range<usize>,
    /// Shots before this one are searched: all light that may overlap with theirs is at hand.
    closed: usize,
    /// The returns of each shot, the fullest first.
    found: Vec<Vec<Echo>>,
    /// The lags that each shot proposed.
    proposed: Vec<Vec<i64>>,
    /// The verdicts, in the order in which they were given.
    verdicts: Vec<Verdict>,
    /// True for the shots that are to be searched: near expected lags, and in all of the gate. A shot is due again if it
    /// proposes something, and if returns change about its light.
    is_due: [Vec<bool>; 2],
    /// The lags at which neighbours lead to expect light of each shot.
    expected: Vec<Vec<i64>>,
    /// Returns when shots were searched last.
    known: BTreeSet<(usize, i64)>,
    counts: Counts<NARROW>,
    meter: Meter<'a>,
}

/// The verdict on a hypothesis.
#[derive(Debug, Clone)]
struct Verdict {
    shot: usize,
    /// The returns that it led to.
    echoes: Vec<Echo>,
    /// How their labels were judged, the worst of them.
    label: Label,
}

/// How the label of a hypothesis was judged.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Label {
    /// It fits, whatever else was proposed.
    Fits,
    /// It fits together with further light of the shot.
    FitsWithFurther,
    /// It is contradicted.
    Contradicted,
}

/// A return that is believed.
#[derive(Debug, Clone, PartialEq)]
struct Echo {
    lag: i64,
    /// The lags among which it may still move, its own included; none once it is settled.
    peaks: Vec<Peak>,
}

/// The returns of the owned shots among those `sent`, out of sorted `ticks`. Light is expected at the `likely` shots and
/// lags.
pub(super) fn decode(sent: &Sent, ticks: &[u32], likely: &[(usize, i64)]) -> Returns {
    let mut returns = Returns::with_capacity(sent.log.owned.len());
    let mut reference = Reference::new(sent, ticks);
    let mut hypotheses: Vec<Hypothesis> = Vec::new();
    let (shots, mut first) = (sent.fired.len(), 0);
    while first < shots {
        let block = first..sent.end_of_block(first, gates(sent));
        first = block.end;
        let settled = reference.open.start;
        let closed = settled..if first == shots { shots } else { sent.in_flight_before(first) };
        reference.begin(settled..block.end, closed.end);
        hypotheses.retain(|hypothesis| hypothesis.shot >= settled);
        let likely = likely.iter().filter(|(shot, _)| block.contains(shot));
        hypotheses.extend(likely.map(|(shot, lag)| reference.hypothesis(*shot, *lag)));
        belief::settle(&mut reference, &mut hypotheses);
        reference.measure(closed.clone(), &mut returns);
        reference.found[closed.clone()].iter_mut().flatten().for_each(|echo| echo.peaks.clear());
        reference.open.start = closed.end.max(settled);
    }
    returns
}

impl<'a> Reference<'a> {
    fn new(sent: &'a Sent<'a>, ticks: &'a [u32]) -> Self {
        let shots = sent.fired.len();
        let arrival = sent.arrival(0);
        let length = (gates(sent) + 2) * (arrival.end - arrival.start) + 3 * sent.length();
        let begin = arrival.start - sent.length();
        let memory = field::Memory::default();
        Self {
            sent,
            field: Field::new(ticks, sent.width, (begin, length), sent.length(), memory),
            residual: Residual::new(sent),
            search: Search::default(),
            threshold: belief::threshold(sent.correlation.false_alarm),
            neighbours: Neighbours::of(sent.log),
            open: 0..0,
            closed: 0,
            found: vec![Vec::new(); shots],
            proposed: vec![Vec::new(); shots],
            verdicts: Vec::new(),
            is_due: [vec![true; shots], vec![true; shots]],
            expected: vec![Vec::new(); shots],
            known: BTreeSet::new(),
            counts: Counts::default(),
            meter: Meter::new(sent, Photons::default()),
        }
    }

    /// Begins with `shots`: forgets what was found of them, and brings all their light to hand.
    fn begin(&mut self, shots: Range<usize>, closed: usize) {
        let (sent, Range { start, end }) = (self.sent, shots.clone());
        self.field.cover(sent.arrival(start).start - sent.length()..sent.arrival(end - 1).end);
        self.is_due.iter_mut().for_each(|due| due[shots.clone()].fill(true));
        self.verdicts.clear();
        self.known.clear();
        (self.open, self.closed) = (shots, closed);
    }

    /// The prior of `shot`, by the returns taken so far.
    fn prior(&self, shot: usize) -> Prior {
        let lag = |other: usize| Some(self.found[other].first()?.lag);
        Prior::new(self.sent.reach(), &self.neighbours.expected_lags(shot, lag))
    }

    /// The lags near `lag` that could be the best one of `shot` for some set of neighbours. It looks as far as light
    /// of the shot overlaps with that at `lag`, which is as far as sidelobes reach.
    fn peaks_about(&mut self, shot: usize, lag: i64) -> Vec<Peak> {
        let (far, prior) = (self.sent.takes_up(), Prior::new(self.sent.reach(), &[]));
        let (lags, sway) = (lag - far..lag + far, prior.sway());
        let question = Question { shot, lags, prior: &prior, least: self.threshold - sway };
        self.search.near_best(&self.residual, &question, (lag, sway))
    }

    /// The best of `peaks` by the prior. If lags side by side have the same marks, as a mark is looked for in several
    /// ticks, it is the first of them.
    fn best_of(&self, peaks: &[Peak], prior: &Prior) -> Option<Peak> {
        let best = Peak::best(peaks.iter().map(|peak| peak.with(prior)))?;
        let at = |lag: i64| peaks.iter().find(|peak| peak.lag == lag);
        let is_alike = |lag: &i64| {
            self.sent.width > 1 && at(*lag).is_some_and(|peak| peak.marks == best.marks)
        };
        let alike = (1..).take_while(|before| is_alike(&(best.lag - before))).count() as i64;
        Some(Peak { lag: best.lag - alike, ..best })
    }

    /// The best lag of `shot` near `lag`, if it is believed, with all the lags that it was chosen from.
    fn believed(&mut self, shot: usize, lag: i64, prior: &Prior) -> Option<(Peak, Vec<Peak>)> {
        let peaks = self.peaks_about(shot, lag);
        let best = self.best_of(&peaks, prior).filter(|best| best.odds >= self.threshold);
        Some((best?, peaks))
    }

    /// How the label of `shot` at `lag` is judged.
    ///
    /// A second surface may light bits that the first one leaves dark, and the other way round. So neither
    /// can be told from light of another label before both are known. The label is contradicted if it still
    /// does not fit without the light of further surfaces that the shot proposed. Light whole bits away does
    /// not count, as it lights the bits that another label would.
    fn label(&mut self, shot: usize, lag: i64, prior: &Prior) -> Label {
        if self.sent.bits_of_payload() == 1 || self.against(shot, lag, prior) <= 0.0 {
            return Label::Fits;
        }
        let mut saved = vec![self.try_out(shot, lag)];
        let mut further = Vec::new();
        for other in self.proposed[shot].clone() {
            if let Some((peak, _)) = self.believed(shot, other, prior)
                && !self.sent.is_whole_bits(peak.lag - lag)
            {
                further.push(peak.lag);
                saved.push(self.try_out(shot, peak.lag));
            }
        }
        self.put_back(saved);
        let saved = further.iter().map(|lag| self.try_out(shot, *lag)).collect();
        let against = self.against(shot, lag, prior);
        self.put_back(saved);
        if against > 0.0 { Label::Contradicted } else { Label::FitsWithFurther }
    }

    /// The contradiction of the label of `shot` at `lag`.
    fn against(&self, shot: usize, lag: i64, prior: &Prior) -> f64 {
        let gate = self.residual.gate(shot);
        self.residual.contradiction(&gate, lag, prior)
    }

    /// Takes light of `shot` at `lag` for a return on trial. The result restores the state before.
    fn try_out(&mut self, shot: usize, lag: i64) -> Saved {
        let saved = self.residual.save(&self.residual.touched(shot, lag));
        self.residual.explain(shot, lag);
        saved
    }

    /// Puts back what was tried out, the last first.
    fn put_back(&mut self, saved: Vec<Saved>) {
        saved.iter().rev().for_each(|saved| self.residual.put_back(saved));
    }

    /// Turns what was found of `shots` into returns.
    fn measure(&mut self, shots: Range<usize>, returns: &mut Returns) {
        let (gate, owned) = (self.sent.gate(), self.sent.log.owned.clone());
        let refused = self.verdicts.iter().filter(|verdict| verdict.label == Label::Contradicted);
        let is_mislabelled: BTreeSet<usize> = refused.map(|verdict| verdict.shot).collect();
        for shot in shots.start.max(owned.start)..shots.end.min(owned.end) {
            let prior = self.prior(shot);
            // A return of two may not move: it could take the lag of the other surface.
            let is_alone = self.found[shot].len() == 1;
            let best = |echo: &Echo| match is_alone {
                true => self.best_of(&echo.peaks, &prior).map(|peak| peak.lag),
                false => Some(echo.lag),
            };
            let mut lags: Vec<i64> = self.found[shot].iter().filter_map(best).collect();
            let is_empty = lags.is_empty();
            lags.retain(|lag| gate.contains(lag));
            if lags.is_empty() {
                returns.reject(match (is_empty, is_mislabelled.contains(&shot)) {
                    (false, _) => Reject::OutsideGate,
                    (true, true) => Reject::LabelMismatch,
                    (true, false) => Reject::NoPeak,
                });
                continue;
            }
            lags.sort_unstable();
            lags.dedup();
            let mut surfaces: Vec<_> = lags.iter().map(|lag| self.detection(shot, *lag)).collect();
            let strength =
                |surface: &Detection| Strength { peak: surface.count as u16, light: f32::NAN };
            let receiver = self.sent.receiver;
            receiver.pick.keep(receiver.returns.into(), &mut surfaces, strength);
            for surface in surfaces {
                returns.push(self.meter.measured(&self.field, shot, surface));
            }
        }
    }

    /// The marks of `shot` at `lag` in all light, and how many fewer any other lag about it has.
    fn detection(&mut self, shot: usize, lag: i64) -> Detection {
        let (sent, width) = (self.sent, i64::from(self.sent.width));
        let (words, first) = self.field.lit().at(sent.fired[shot] + lag - BLOCK / 2);
        self.counts.count(words, first as u32, sent.word(shot), sent.lit_bits(shot));
        let [before, behind] = [(-width, true), (width + 1, false)]
            .map(|(away, wanted)| below(BLOCK / 2 + away, [u64::MAX; NARROW], wanted));
        let next = self.counts.highest(or(before, behind)).map_or(0, |(_, count)| count);
        let count = self.marks(shot, lag).lit;
        Detection { margin: count.saturating_sub(next), ..Detection::at(lag, count) }
    }

    /// Light of `shot` at `lag`, as a hypothesis.
    fn hypothesis(&self, shot: usize, lag: i64) -> Hypothesis {
        Hypothesis { shot, lag, marks: self.marks(shot, lag) }
    }

    /// The marks of `shot` at `lag` in all light.
    fn marks(&self, shot: usize, lag: i64) -> Marks {
        let (sent, start) = (self.sent, self.sent.fired[shot] + lag);
        let pattern = &sent.bits(shot).pattern;
        let lit = self.field.lit().lit_in_all(start, sent.lit_bits(shot), pattern);
        Marks { lit, of: sent.weight(shot) }
    }

    /// The returns of the shots that are judged.
    fn returns(&self) -> impl Iterator<Item = (usize, i64)> {
        self.open.clone().flat_map(|shot| self.found[shot].iter().map(move |echo| (shot, echo.lag)))
    }

    /// The best of some `lags` of `shot`, if it is believed in light that neither returns nor its own proposals explain.
    fn propose_of(
        &mut self,
        shot: usize,
        lags: &[Range<i64>],
        prior: &Prior,
    ) -> Option<Hypothesis> {
        let known = self.proposed[shot].clone();
        if known.len() == MOST_HYPOTHESES || self.sent.weight(shot) == 0 {
            return None;
        }
        let saved = known.iter().map(|lag| self.try_out(shot, *lag)).collect();
        let (search, residual, least) = (&mut self.search, &self.residual, self.threshold);
        let best = Peak::best(lags.iter().filter_map(|lags| {
            let question = Question { shot, lags: lags.clone(), prior, least };
            search.best(residual, &question)
        }));
        self.put_back(saved);
        let Peak { lag, .. } = best?;
        self.proposed[shot].push(lag);
        Some(self.hypothesis(shot, lag))
    }

    /// Notes which shots are due: returns have changed about their light, or light of theirs is expected elsewhere.
    fn note_changes(&mut self) {
        let now: BTreeSet<(usize, i64)> = self.returns().collect();
        let changed = self.known.symmetric_difference(&now);
        let changed: Vec<Range<i64>> =
            changed.map(|(shot, lag)| self.residual.touched(*shot, *lag)).collect();
        self.known = now;
        for shot in self.open.start..self.closed {
            let arrival = self.sent.arrival(shot);
            let is_near = |span: &Range<i64>| span.start < arrival.end && arrival.start < span.end;
            if changed.iter().any(is_near) {
                self.is_due.iter_mut().for_each(|due| due[shot] = true);
            }
            let expected = self.prior(shot).expected_lags();
            self.is_due[0][shot] |= expected != self.expected[shot];
            self.expected[shot] = expected;
        }
    }

    /// The stretches of lags about the `expected` ones.
    fn stretches(expected: &[i64]) -> Vec<Range<i64>> {
        let mut stretches: Vec<Range<i64>> = Vec::new();
        for lag in expected {
            let stretch = lag - EXPECTED..lag + EXPECTED;
            match stretches.last_mut() {
                Some(last) if stretch.start <= last.end => last.end = stretch.end,
                _ => stretches.push(stretch),
            }
        }
        stretches
    }
}

impl Light for Reference<'_> {
    fn restore(&mut self, kept: usize) -> usize {
        // A verdict on a label may depend on what its shot proposed since.
        let stands =
            |verdict: &&Verdict| verdict.label == Label::Fits || !self.is_due[0][verdict.shot];
        let kept = self.verdicts.iter().take(kept).take_while(stands).count();
        self.verdicts.truncate(kept);
        self.residual.restore(&self.field);
        let Range { start, end } = self.open;
        self.found[start..end].iter_mut().for_each(Vec::clear);
        for shot in self.sent.in_flight_before(start)..start {
            for echo in &self.found[shot] {
                self.residual.explain(shot, echo.lag);
            }
        }
        for Verdict { shot, echoes, .. } in &self.verdicts {
            for echo in echoes {
                self.residual.explain(*shot, echo.lag);
                self.found[*shot].push(echo.clone());
            }
        }
        kept
    }

    fn judge(&mut self, hypothesis: &Hypothesis) {
        let shot = hypothesis.shot;
        let prior = self.prior(shot);
        let mut verdict = Verdict { shot, echoes: Vec::new(), label: Label::Fits };
        while verdict.echoes.len() < MOST_OF_HYPOTHESIS
            && let Some((Peak { lag, .. }, peaks)) = self.believed(shot, hypothesis.lag, &prior)
        {
            let label = self.label(shot, lag, &prior);
            verdict.label = verdict.label.max(label);
            if label == Label::Contradicted {
                break;
            }
            let echo = Echo { lag, peaks };
            self.residual.explain(shot, lag);
            self.found[shot].push(echo.clone());
            verdict.echoes.push(echo);
            if lag == hypothesis.lag {
                break;
            }
        }
        self.verdicts.push(verdict);
    }

    /// Light where neighbours lead to expect it comes first, as what it explains need not be searched through.
    fn propose(&mut self) -> Vec<Hypothesis> {
        self.note_changes();
        let reach = self.sent.reach();
        let mut proposals = Vec::new();
        for everywhere in [false, true] {
            for shot in self.open.start..self.closed {
                if !std::mem::take(&mut self.is_due[usize::from(everywhere)][shot]) {
                    continue;
                }
                let lags = match everywhere {
                    true => vec![reach.clone()],
                    false => Self::stretches(&self.expected[shot]),
                };
                let prior = self.prior(shot);
                if let Some(proposal) = self.propose_of(shot, &lags, &prior) {
                    self.is_due.iter_mut().for_each(|due| due[shot] = true);
                    proposals.push(proposal);
                }
            }
            if !proposals.is_empty() {
                break;
            }
        }
        proposals
    }
}

/// Gates of a block.
fn gates(sent: &Sent) -> i64 {
    let arrival = sent.arrival(0);
    (BLOCK_TICKS / (arrival.end - arrival.start)).clamp(2, GATES)
}

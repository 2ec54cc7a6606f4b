//! The exhaustive receiver: every lag of every shot is a hypothesis, and belief alone decides.
//!
//! The quick receiver looks where light is likely. This one counts all lags. It shows what the quick one passes by. It
//! decides by [`belief`](crate::decode::belief) and nothing else:
//!
//! 1. Each shot proposes all lags that are believed in the light that returns do not explain: first the one with the
//!    highest posterior odds, then the best one of what that leaves, and so on. [`search`] finds them.
//! 2. All hypotheses are judged, the fullest first. Each sees the ticks and the places that fuller returns leave
//!    ([`residual`]), and a prior made from fuller returns of the shots beside it.
//! 3. A hypothesis stands for its sidelobes, too: it is judged at the best lag of those whose light overlaps with its
//!    own. It is refused if its label is contradicted.
//! 4. Steps 1 and 2 are repeated until no shot proposes anything new. A shot proposes light that its earlier hypotheses
//!    do not explain, so that it ends, and so that a part of refused light is no return.
//!
//! As soon as the returns about a shot are known, its lag is the best one by the prior of all of them, if it has a single
//! return.
//!
//! The shots of a band are decoded in blocks. A block has the shots of two gates and all that were in flight before.
//! A shot is settled when no later light overlaps with its own. What is settled stays, and claims light of the next
//! block first. The end of a block can change a verdict only where a shot that overlaps with the settled one takes
//! light of a shot behind the block, which is not known yet.

mod residual;
mod search;
#[cfg(test)]
mod tests;

use std::collections::BTreeSet;
use std::ops::Range;

use super::measure::{Meter, Photons};
use super::sent::Sent;
use super::track::{BLOCK, below};
use super::{Detection, last_beside};
use crate::decode::belief::{self, Hypothesis, Light, Marks, Prior};
use crate::decode::field::{self, Field};
use crate::decode::{GATES_PER_BLOCK, Reject, Returns, Strength};
use crate::kernels::{Counts, NARROW, or};
use residual::Residual;
use search::{Peak, Question, Search};

/// Hypotheses of a shot at most. It bounds the time that a hostile band takes.
const MOST_HYPOTHESES: usize = 16;

/// Shots between one and its neighbour in a direction at most.
const FARTHEST: usize = 64;

/// Directions in which a shot has neighbours.
const DIRECTIONS: usize = 4;

/// A band, and what is known of it.
pub(super) struct Reference<'a> {
    sent: &'a Sent<'a>,
    field: Field<'a>,
    residual: Residual<'a>,
    search: Search,
    /// The logarithm of the posterior odds from which on a hypothesis is believed.
    threshold: f64,
    /// The next shot in each direction: to both sides of its row and its column.
    beside: [Vec<Option<u32>>; DIRECTIONS],
    /// Shots that are judged; those before are settled.
    open: Range<usize>,
    /// The returns of each shot, the fullest first.
    found: Vec<Vec<Echo>>,
    /// The lags of the hypotheses of each shot.
    proposed: Vec<Vec<i64>>,
    /// The shots of which a hypothesis was refused for its label.
    is_mislabelled: Vec<bool>,
    /// Shots that are to be searched although no return has changed.
    is_due: Vec<bool>,
    /// Returns when shots were searched last.
    known: BTreeSet<(usize, i64)>,
    counts: Counts<NARROW>,
    meter: Meter<'a>,
}

/// A return that is believed.
#[derive(Debug, Clone, PartialEq)]
struct Echo {
    lag: i64,
    /// The lags among which it may still move, its own included; none once it is settled.
    peaks: Vec<Peak>,
}

/// The returns of the owned shots among those `sent`, out of sorted `ticks`.
pub(super) fn decode(sent: &Sent, ticks: &[u32]) -> Returns {
    let mut returns = Returns::with_capacity(sent.log.owned.len());
    let mut reference = Reference::new(sent, ticks);
    let (shots, mut first) = (sent.fired.len(), 0);
    while first < shots {
        let block = first..sent.end_of_block(first);
        first = block.end;
        let settled = reference.open.start;
        let closed = settled..if first == shots { shots } else { sent.in_flight_before(first) };
        reference.begin(settled..block.end);
        belief::settle(&mut reference, &mut Vec::new());
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
        let length = (GATES_PER_BLOCK + 2) * (arrival.end - arrival.start) + 3 * sent.length();
        let begin = arrival.start - sent.length();
        let memory = field::Memory::default();
        let (rows, columns) = (&sent.log.row, &sent.log.column);
        let [left, above] = [last_beside(rows, columns), last_beside(columns, rows)];
        let [right, below] = [&left, &above].map(|before| reversed(before));
        Self {
            sent,
            field: Field::new(ticks, sent.width, (begin, length), sent.length(), memory),
            residual: Residual::new(sent),
            search: Search::default(),
            threshold: belief::threshold(sent.correlation.false_alarm),
            beside: [left, right, above, below],
            open: 0..0,
            found: vec![Vec::new(); shots],
            proposed: vec![Vec::new(); shots],
            is_mislabelled: vec![false; shots],
            is_due: vec![true; shots],
            known: BTreeSet::new(),
            counts: Counts::default(),
            meter: Meter::new(sent, Photons::default()),
        }
    }

    /// Begins with `shots`: forgets what was found of them, and brings all their light to hand.
    fn begin(&mut self, shots: Range<usize>) {
        let (sent, Range { start, end }) = (self.sent, shots.clone());
        self.field.cover(sent.arrival(start).start - sent.length()..sent.arrival(end - 1).end);
        self.proposed[shots.clone()].iter_mut().for_each(Vec::clear);
        self.is_due[shots.clone()].fill(true);
        self.known.clear();
        self.open = shots;
    }

    /// The prior of `shot`, by the returns taken so far: in each direction the lag of the nearest one and the line
    /// through the nearest two lead to expect one of its own.
    fn prior(&self, shot: usize) -> Prior {
        let mut lags = Vec::with_capacity(2 * DIRECTIONS);
        for beside in &self.beside {
            let next = |at: &usize| beside[*at].map(|next| next as usize);
            let way = std::iter::successors(Some(shot), next).enumerate().skip(1).take(FARTHEST);
            let found =
                way.filter_map(|(away, at)| Some((away as i64, self.found[at].first()?.lag)));
            let two: Vec<(i64, i64)> = found.take(2).collect();
            lags.extend(two.first().map(|(_, lag)| lag));
            if let [(near, lag), (far, other)] = two[..] {
                lags.push(lag + (lag - other) * near / (far - near));
            }
        }
        Prior::new(self.sent.reach(), &lags)
    }

    /// The lags near `lag` that could be the best one of `shot` for some set of neighbours. It looks as far as light
    /// of the shot overlaps with that at `lag`, which is as far as sidelobes reach.
    fn peaks_about(&mut self, shot: usize, lag: i64) -> Vec<Peak> {
        let (far, prior) = (self.sent.takes_up(), Prior::new(self.sent.reach(), &[]));
        let (lags, sway) = (lag - far..lag + far, prior.sway());
        let least = self.threshold - sway;
        let mut question = Question { shot, lags, prior: &prior, least };
        let Some(top) = self.search.best(&self.residual, &question) else { return Vec::new() };
        question.least = least.max(top.odds - sway);
        self.search.all(&self.residual, &question)
    }

    /// The best of `peaks` by the prior. Where lags side by side have the same marks, as a mark is looked for in several
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

    /// True if light of `shot` at `lag` has another label, also where its further hypotheses are taken for returns.
    ///
    /// A second surface may light bits that the first one leaves dark, and the other way round. So neither can be told
    /// from light of another label before both are known: the label is contradicted if it is without the light of
    /// the further ones, too. Light whole bits away does not count, as it lights the bits that another label would.
    fn is_mislabelled(&mut self, shot: usize, lag: i64, prior: &Prior) -> bool {
        if self.sent.bits_of_payload() == 1 || self.against(shot, lag, prior) <= 0.0 {
            return false;
        }
        let saved = self.residual.save(&self.touched_by(shot));
        self.residual.explain(shot, lag);
        let mut further = Vec::new();
        for other in self.proposed[shot].clone() {
            if let Some((peak, _)) = self.believed(shot, other, prior)
                && !self.is_whole_bits(peak.lag - lag)
            {
                further.push(peak.lag);
                self.residual.explain(shot, peak.lag);
            }
        }
        self.residual.put_back(&saved);
        further.iter().for_each(|lag| self.residual.explain(shot, *lag));
        let against = self.against(shot, lag, prior);
        self.residual.put_back(&saved);
        against > 0.0
    }

    /// The contradiction of the label of `shot` at `lag`.
    fn against(&self, shot: usize, lag: i64, prior: &Prior) -> f64 {
        let (sent, residual) = (self.sent, &self.residual);
        let in_bits = |bits: &[u32]| residual.in_bits(shot, lag, bits);
        let (lit, dark) = (in_bits(sent.lit_bits(shot)), in_bits(sent.dark_bits(shot)));
        let gate = residual.gate(shot);
        let (_, around) = residual.look(&gate, lag, self.search.places());
        belief::contradiction(&lit, &dark, &around, prior.expected(lag))
    }

    /// True if two lags lie whole bits `apart`: light then falls on the same marks of other bits.
    fn is_whole_bits(&self, apart: i64) -> bool {
        let (bit, width) = (self.sent.bit_length(), i64::from(self.sent.width));
        !(width..=bit - width).contains(&apart.rem_euclid(bit))
    }

    /// All that light of `shot` can change.
    fn touched_by(&self, shot: usize) -> Range<i64> {
        let reach = self.sent.reach();
        let [first, last] =
            [reach.start, reach.end - 1].map(|lag| self.residual.touched(shot, lag));
        first.start..last.end
    }

    /// Turns what was found of `shots` into returns.
    fn measure(&mut self, shots: Range<usize>, returns: &mut Returns) {
        let (gate, owned) = (self.sent.gate(), self.sent.log.owned.clone());
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
                returns.reject(match (is_empty, self.is_mislabelled[shot]) {
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

    /// Lags of `shot` that are believed in light that neither returns nor its own hypotheses explain: the best one,
    /// the best one of what that leaves, and so on.
    fn propose_of(&mut self, shot: usize) -> Vec<Hypothesis> {
        let (prior, reach) = (self.prior(shot), self.sent.reach());
        let saved = self.residual.save(&self.touched_by(shot));
        for lag in &self.proposed[shot] {
            self.residual.explain(shot, *lag);
        }
        let question = Question { shot, lags: reach, prior: &prior, least: self.threshold };
        let mut peaks = self.search.all(&self.residual, &question);
        let mut proposals = Vec::new();
        while let Some(Peak { lag, .. }) = Peak::best(peaks.iter().copied())
            && self.proposed[shot].len() < MOST_HYPOTHESES
        {
            self.residual.explain(shot, lag);
            self.proposed[shot].push(lag);
            proposals.push(Hypothesis { shot, lag, marks: self.marks(shot, lag) });
            let (residual, places) = (&self.residual, self.search.places());
            let gate = residual.gate(shot);
            for peak in peaks.iter_mut().filter(|peak| self.sent.overlap(peak.lag - lag)) {
                *peak = residual.peak(&gate, peak.lag, places, &prior);
            }
            peaks.retain(|peak| peak.odds >= self.threshold);
        }
        self.residual.put_back(&saved);
        proposals
    }
}

impl Light for Reference<'_> {
    fn restore(&mut self) {
        self.residual.restore(&self.field);
        let Range { start, end } = self.open;
        self.found[start..end].iter_mut().for_each(Vec::clear);
        self.is_mislabelled[start..end].fill(false);
        for shot in self.sent.in_flight_before(start)..start {
            for echo in &self.found[shot] {
                self.residual.explain(shot, echo.lag);
            }
        }
    }

    fn judge(&mut self, hypothesis: &Hypothesis) {
        let Hypothesis { shot, lag, .. } = *hypothesis;
        let prior = self.prior(shot);
        let Some((Peak { lag, .. }, peaks)) = self.believed(shot, lag, &prior) else { return };
        if self.is_mislabelled(shot, lag, &prior) {
            self.is_mislabelled[shot] = true;
            return;
        }
        self.residual.explain(shot, lag);
        self.found[shot].push(Echo { lag, peaks });
    }

    fn propose(&mut self) -> Vec<Hypothesis> {
        let now: BTreeSet<(usize, i64)> = self.returns().collect();
        let changed = self.known.symmetric_difference(&now);
        let changed: Vec<Range<i64>> =
            changed.map(|(shot, lag)| self.residual.touched(*shot, *lag)).collect();
        self.known = now;
        let mut proposals = Vec::new();
        for shot in self.open.clone() {
            let arrival = self.sent.arrival(shot);
            let is_near = |span: &Range<i64>| span.start < arrival.end && arrival.start < span.end;
            let is_due = self.is_due[shot] || changed.iter().any(is_near);
            self.is_due[shot] = false;
            if is_due && self.sent.weight(shot) > 0 {
                let some = self.propose_of(shot);
                self.is_due[shot] = !some.is_empty();
                proposals.extend(some);
            }
        }
        proposals
    }
}

/// The next shot behind each one, by those `before`.
fn reversed(before: &[Option<u32>]) -> Vec<Option<u32>> {
    let mut behind = vec![None; before.len()];
    for (shot, before) in (0..).zip(before) {
        if let Some(before) = before {
            behind[*before as usize] = Some(shot);
        }
    }
    behind
}

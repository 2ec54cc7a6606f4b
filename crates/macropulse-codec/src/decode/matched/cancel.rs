//! Cancellation of complete macropulses: those without a missing mark are taken off the ticks one after another, as
//! they come.
//!
//! 1. In a row: the earliest tick that is not cancelled is taken for the first mark of a macropulse whose
//!    marks all follow with nothing between them. The shot after the last one found is asked first: in smooth
//!    scenes it is the one. Otherwise the distance to the next tick tells which word it may be.
//! 2. Woven: where macropulses overlap, the ticks are laid down as bits. Each shot in flight whose second
//!    mark is there, too, is asked for all of its marks; found, they are put out. The first marks may lie
//!    under those of one that was cancelled before. So any of the first three is tried at once as the first
//!    that is left, and any other if several ticks in a row found no macropulse.
//!
//! If no mark is missing no lag can have more, and none earlier is left: this is the maximum. Light from
//! beyond the gate is cancelled, too, from as far as it may come: it gives no return, but would pass for
//! noise. A tick at which no macropulse without a gap can begin is left for the receivers that follow. If
//! marks are missed everywhere, nothing can be cancelled this way; that is soon noticed.
//!
//! Light of guard shots is cancelled only if it may overlap with light of owned ones. Older or younger light tells
//! nothing of these. Some of it is that of shots that the log does not know, or ends behind the ticks.

use std::ops::Range;

use super::Detection;
use super::sent::{FIRST, Sent};
use crate::decode::Error;
use crate::decode::check::in_order;
use crate::decode::timeline::Timeline;
use crate::kernels::{begin_with, lit_after};

/// Ticks without a complete macropulse after which cancellation ends, and how many more for each macropulse
/// that was found. With four more, cancellation bears four dark counts to a macropulse for ever, and each of
/// these asks all shots in flight. A street with 10⁸ of them a second then takes 165 times the sensor's time,
/// instead of 46 if the steps that follow do the rest. With 256 and one more it takes as long.
const PATIENCE: (usize, usize) = (16, 2);

/// Ticks whose order is checked at once where some are laid down: they are in the cache when they are read one after
/// another. With four times this number a clean `street`, where few are laid down, takes 1.5 % longer, and with half of
/// it equally long. With a quarter clean random ranges take 2 % longer.
const AT_ONCE: usize = 1024;

/// The lag of a shot that was not found.
pub(super) const NOWHERE: i64 = i64::MIN;

/// The macropulses found without a gap, and the residual.
#[derive(Debug, Default)]
pub(super) struct Cancelled {
    /// The lag at which each shot was found, or [`NOWHERE`].
    pub lags: Vec<i64>,
    /// Shots that were found once more, behind their first lag, and where.
    pub again: Vec<(usize, i64)>,
    /// Ticks that are not cancelled, in order.
    pub residual: Vec<u32>,
}

impl Cancelled {
    /// True if that is all light, with one surface for each shot at most.
    pub fn is_clear(&self) -> bool {
        self.again.is_empty() && self.residual.is_empty()
    }

    /// The same of each shot, and of those that were found once more, as the steps that follow have it.
    pub fn detections(&self, sent: &Sent) -> (Vec<Option<Detection>>, Vec<(usize, Detection)>) {
        let at = |shot: usize, lag: i64| {
            let (count, margin) = (sent.weight(shot), sent.complete_margin(shot));
            Detection { lag, count, margin, stands_out: true }
        };
        let lags = self.lags.iter().enumerate();
        (
            lags.map(|(shot, lag)| (*lag != NOWHERE).then(|| at(shot, *lag))).collect(),
            self.again.iter().map(|(shot, lag)| (*shot, at(*shot, *lag))).collect(),
        )
    }
}

/// Cancels the complete macropulses of the shots `sent` in `ticks`; `None` if that was given up. Only the
/// memory of the timelines is used.
///
/// Ticks found in a row ascend. Other ticks are compared with those before them, so that in the end the order of all is
/// checked.
///
/// # Errors
/// If the ticks do not ascend.
pub(super) fn cancel(
    sent: &Sent,
    ticks: &[u32],
    [seen, residual]: &mut [Timeline; 2],
) -> Result<Option<Cancelled>, Error> {
    let owned = owned_light(sent);
    let mut place = begin(ticks, owned.start, sent.length())?;
    let mut canceller = Canceller {
        sent,
        ticks,
        least: fewest_without_a_gap(sent, ticks),
        lags: vec![NOWHERE; sent.fired.len()],
        again: Vec::new(),
        left: Vec::new(),
        // Marks that jitter are not where they should be.
        patience: if sent.width > 1 { 0 } else { PATIENCE.0 },
        oldest: 0,
        end: 0,
        // None: where all shots have one word, light of any would pass for that of the first.
        next: sent.fired.len(),
        owned,
        gaps_of: 0..0,
        gaps: Default::default(),
        seen,
        residual,
        in_order_to: 0,
    };
    let end = ticks.partition_point(|tick| i64::from(*tick) < canceller.owned.end);
    while place < end && canceller.patience > 0 {
        if place > 0 && ticks[place] <= ticks[place - 1] {
            in_order(ticks, place - 1..place + 1)?;
        }
        place += match canceller.in_a_row(place) {
            0 => canceller.woven(place)?,
            count => count,
        };
    }
    in_order(ticks, place.saturating_sub(1)..ticks.len())?;
    if place < end {
        // The few that were found are soon found again; to tell their ticks from all others is not soon
        // done.
        return Ok(None);
    }
    let Canceller { lags, again, left, .. } = canceller;
    Ok(Some(Cancelled { lags, again, residual: left }))
}

/// Marks that chance does not put there all together, at none of the lags of a gate: the least N
/// with L · dᴺ ≤ α, d the share of lit ticks. Two at least, as the second mark is asked for.
fn fewest_without_a_gap(sent: &Sent, ticks: &[u32]) -> u32 {
    let time = ticks.last().zip(ticks.first());
    let time = time.map_or(0, |(last, first)| last.saturating_sub(*first));
    let density = ticks.len() as f64 / f64::from(time.max(1));
    let lags = (sent.gate().end - sent.gate().start) as f64;
    let rarity = libm::log(sent.correlation.false_alarm / lags);
    (rarity / libm::log(density.clamp(1e-9, 0.999))).ceil().max(2.0) as u32
}

/// The tick to begin with: long enough before `owned` that macropulses which began even earlier end before
/// it, and behind the longest gap there, as few lie over that. All until there ascend.
fn begin(ticks: &[u32], owned: i64, length: i64) -> Result<usize, Error> {
    let before = |end: i64| ticks.partition_point(|tick| i64::from(*tick) < end);
    let (first, last) = (before(owned - 3 * length), before(owned - length));
    in_order(ticks, 0..ticks.len().min(last + 1))?;
    let gap = |place: &usize| match (place.checked_sub(1), ticks.get(*place)) {
        (Some(before), Some(tick)) => tick - ticks[before],
        _ => 0,
    };
    Ok((first..=last).max_by_key(gap).unwrap_or(first))
}

/// The ticks at which light of an owned shot may come.
fn owned_light(sent: &Sent) -> Range<i64> {
    let owned = &sent.log.owned;
    match owned.is_empty() {
        true => 0..0,
        false => sent.arrival(owned.start).start..sent.arrival(owned.end - 1).end,
    }
}

struct Canceller<'a> {
    sent: &'a Sent<'a>,
    ticks: &'a [u32],
    /// Fewest marks with which a shot can be told from chance.
    least: u32,
    /// As [`Cancelled`] has them.
    lags: Vec<i64>,
    again: Vec<(usize, i64)>,
    /// Ticks at which no macropulse without a gap can begin, in order.
    left: Vec<u32>,
    patience: usize,
    /// The ticks at which light of an owned shot may come. Leftover ticks before that belong to macropulses that began
    /// even earlier, and those behind it to macropulses that end even later.
    owned: Range<i64>,
    /// Light of no shot before this one can come any more.
    oldest: usize,
    /// This one, and those after it, are not fired yet.
    end: usize,
    /// The shot after the last one found.
    next: usize,
    /// For each of these shots, the ticks from each of its first marks to the next one, or 64 if they are more.
    gaps_of: Range<usize>,
    gaps: [Vec<u8>; FIRST],
    /// The ticks where macropulses overlap, and those of them that are not cancelled.
    seen: &'a mut Timeline,
    residual: &'a mut Timeline,
    /// The ticks before this place ascend, from those on that are laid down.
    in_order_to: usize,
}

impl Canceller<'_> {
    /// Finds the shot whose marks are the ticks from `place` on. Returns their number, or 0 if there is none.
    fn in_a_row(&mut self, place: usize) -> usize {
        let count = self.fits_in_a_row(self.next, place);
        let Some(next) = self.ticks.get(place + 1).filter(|_| count == 0) else { return count };
        let (tick, sent) = (i64::from(self.ticks[place]), self.sent);
        let gap = next.wrapping_sub(self.ticks[place]);
        let in_flight = self.in_flight(tick);
        let shot = self.nearest_first().into_iter().find_map(|lags| {
            in_flight.clone().find(|&shot| {
                sent.first_marks(shot)[0].gap == gap && self.start(shot, tick, (0, &lags)).is_some()
            })
        });
        shot.map_or(0, |shot| self.fits_in_a_row(shot, place))
    }

    /// The lags of the gate, and those beyond: light from there is rare, and thought of last.
    fn nearest_first(&self) -> [Range<i64>; 2] {
        let (gate, reach) = (self.sent.gate(), self.sent.reach());
        [gate.clone(), gate.end..reach.end]
    }

    /// How many marks `shot` has, if they are the ticks from `place` on with nothing between them.
    fn fits_in_a_row(&mut self, shot: usize, place: usize) -> usize {
        let lags = self.sent.gate().start..self.sent.reach().end;
        let tick = i64::from(self.ticks[place]);
        let Some(start) = self.start(shot, tick, (0, &lags)) else { return 0 };
        let (word, bits) = (self.sent.word(shot), self.sent.lit_bits(shot));
        // One that reaches beyond what is counted has marks that seem to come first.
        if start + self.sent.length() > i64::from(u32::MAX) {
            return 0;
        }
        if !begin_with(&self.ticks[place..], word, bits, start as u32) {
            return 0;
        }
        self.keep(shot, start);
        bits.len() * word.ticks().len()
    }

    /// Returns the tick in which the macropulse of `shot` begins if `tick` is its first mark behind the
    /// `hidden` ones. `None` unless it comes after one of the `lags` and can be told from chance.
    #[inline(always)]
    fn start(&self, shot: usize, tick: i64, (hidden, lags): (usize, &Range<i64>)) -> Option<i64> {
        let sent = self.sent;
        let fired = sent.fired.get(shot)?;
        let start = tick - sent.first_mark(shot, hidden)?;
        let possible = lags.contains(&(start - fired)) && sent.weight(shot) >= self.least;
        possible.then_some(start)
    }

    /// The shots whose light may come at `tick`, none earlier than those asked for last.
    fn in_flight(&mut self, tick: i64) -> Range<usize> {
        let fired = &self.sent.fired;
        let farthest = self.sent.reach().end + self.sent.length();
        while fired.get(self.oldest).is_some_and(|fired| fired + farthest < tick) {
            self.oldest += 1;
        }
        while fired.get(self.end).is_some_and(|fired| *fired <= tick) {
            self.end += 1;
        }
        self.oldest..self.end.max(self.oldest)
    }

    /// Finds all shots from `place` on that overlap with others, and tells how many ticks they are,
    /// cancelled or left; one at least.
    ///
    /// # Errors
    /// If they do not ascend.
    fn woven(&mut self, place: usize) -> Result<usize, Error> {
        let (sent, ticks) = (self.sent, self.ticks);
        let first = i64::from(ticks[place]);
        // Macropulses may have begun under one that was cancelled.
        let begin = (first - sent.bit_length()).div_euclid(64) * 64;
        let before = ticks[..place].iter().rev().take_while(|tick| i64::from(**tick) >= begin);
        let mut laid = place - before.count();
        let room = ROOM * sent.length().max(64) + 128;
        for timeline in [&mut *self.seen, &mut *self.residual] {
            timeline.begin(begin, room);
        }
        let (mut end, mut last, mut tick) = (begin, first, first);
        while self.patience > 0 {
            // All that a macropulse may reach that begins here.
            let reach = tick + sent.length() + 128;
            if reach > end {
                if reach > self.seen.end() {
                    let origin = (tick - sent.length()).div_euclid(64) * 64;
                    self.seen.slide(origin);
                    self.residual.slide(origin);
                }
                let to = (reach + sent.length() / MORE + 63).div_euclid(64) * 64;
                let to = to.min(self.seen.end());
                self.in_order(laid, to)?;
                let known = &ticks[laid..self.in_order_to];
                let count = self.seen.lay_anew(known, end..to);
                let words = self.seen.words(&(end..to));
                self.residual.words_mut(&(end..to)).copy_from_slice(words);
                (laid, end) = (laid + count, to);
            }
            match self.residual.next_lit(tick..end) {
                Some(next) => tick = next,
                None if laid == ticks.len() => return Ok(laid - place),
                None => tick = end,
            }
            if tick > last {
                // All before it are laid.
                let before = |other: &u32| i64::from(*other) < tick;
                return Ok(ticks[place..laid].partition_point(before));
            }
            if tick + sent.length() + 128 > end {
                continue;
            }
            match self.shot_at(tick) {
                Some(ends) => last = last.max(ends),
                None => {
                    self.residual.clear(tick);
                    if self.owned.contains(&tick) {
                        self.patience -= 1;
                        self.left.push(tick as u32);
                        last = self.hidden(tick).map_or(last, |ends| last.max(ends));
                    } else {
                        // The next one is rarely more.
                        last = last.max(tick + sent.bit_length());
                    }
                }
            }
        }
        while let Some(left) = self.residual.next_lit(tick..end) {
            self.left.push(left as u32);
            tick = left + 1;
        }
        Ok(laid - place)
    }

    /// Sees to it that the ticks from `place` on ascend until one is at `to` or later; all before it do.
    fn in_order(&mut self, place: usize, to: i64) -> Result<(), Error> {
        let ticks = self.ticks;
        self.in_order_to = self.in_order_to.max(place);
        while self.in_order_to < ticks.len()
            && (self.in_order_to == place || i64::from(ticks[self.in_order_to - 1]) < to)
        {
            let next = ticks.len().min(self.in_order_to + AT_ONCE);
            in_order(ticks, self.in_order_to.saturating_sub(1)..next)?;
            self.in_order_to = next;
        }
        Ok(())
    }

    /// Makes the gaps of the `shots` available. No shot may be before those asked for last.
    fn know_gaps(&mut self, shots: &Range<usize>) {
        if shots.start >= self.gaps_of.end {
            self.gaps_of = shots.start..shots.start;
            self.gaps.iter_mut().for_each(Vec::clear);
        }
        let (sent, more) = (self.sent, self.gaps_of.end..shots.end);
        for (hidden, gaps) in self.gaps.iter_mut().enumerate() {
            let gap = |shot: usize| sent.first_marks(shot)[hidden].gap.min(64) as u8;
            gaps.extend(more.clone().map(gap));
        }
        self.gaps_of.end = self.gaps_of.end.max(shots.end);
    }

    /// Finds the shot whose first mark that is not cancelled is at `tick`, and cancels its marks. Returns the end of
    /// its light.
    fn shot_at(&mut self, tick: i64) -> Option<i64> {
        let (in_flight, ahead) = (self.in_flight(tick), self.seen.from(tick));
        self.know_gaps(&in_flight);
        // Ticks that may belong to no known shot are only tried with likely ones.
        let (parts, most_hidden) = if self.owned.contains(&tick) { (2, FIRST) } else { (1, 1) };
        for lags in self.nearest_first().into_iter().take(parts) {
            for hidden in 0..most_hidden {
                let wanted = (hidden, &lags);
                let found = self
                    .found_at(self.next, tick, wanted)
                    .or_else(|| self.first_of(in_flight.clone(), (tick, ahead), wanted));
                if found.is_some() {
                    return found;
                }
            }
        }
        None
    }

    /// Finds the first of the `shots` as [`Self::shot_at`] does, with `hidden` marks hidden and after one of the
    /// `lags`. `ahead` are the ticks from `tick` on.
    fn first_of(
        &mut self,
        shots: Range<usize>,
        (tick, ahead): (i64, u64),
        (hidden, lags): (usize, &Range<i64>),
    ) -> Option<i64> {
        for from in shots.clone().step_by(64) {
            // Nearly every shot is refused here: its second mark is not there.
            let known = self.gaps_of.start;
            let gaps = from - known..shots.end.min(from + 64) - known;
            let mut may_be = lit_after(&self.gaps[hidden][gaps], ahead);
            while may_be != 0 {
                let shot = from + may_be.trailing_zeros() as usize;
                may_be &= may_be - 1;
                let found = self.found_at(shot, tick, (hidden, lags));
                if found.is_some() {
                    return found;
                }
            }
        }
        None
    }

    /// Finds a shot with any of its marks at `tick`, the last one left, as all of its first marks may lie under others.
    /// It is tried whenever [`CLUE`] more were left in the time of a macropulse. Cancels its marks, and returns the end
    /// of its light.
    fn hidden(&mut self, tick: i64) -> Option<i64> {
        let sent = self.sent;
        let (clues, more) = self.left.as_chunks::<CLUE>();
        let clue = clues.last().filter(|_| more.is_empty())?;
        if tick - i64::from(clue[0]) >= sent.length() {
            return None;
        }
        let mut in_flight = self.in_flight(tick).filter(|shot| sent.weight(*shot) >= self.least);
        let (shot, start) =
            in_flight.find_map(|shot| Some((shot, self.start_of_any(shot, tick)?)))?;
        let (marks, lit_bits) = (sent.word(shot).ticks(), sent.lit_bits(shot));
        self.residual.put_out(start, lit_bits, &sent.bits(shot).pattern);
        let is_mark = |after: i64| {
            let in_bit = lit_bits.iter().map(|bit| after - i64::from(*bit));
            in_bit.filter_map(|after| u32::try_from(after).ok()).any(|after| marks.contains(&after))
        };
        self.left.retain(|left| !is_mark(i64::from(*left) - start));
        self.keep(shot, start);
        Some(start + sent.length())
    }

    /// The earliest start of the macropulse of `shot`, if all its marks are there and `tick` is any of them.
    fn start_of_any(&self, shot: usize, tick: i64) -> Option<i64> {
        let (sent, lit_bits) = (self.sent, self.sent.lit_bits(shot));
        let (marks, pattern) = (sent.word(shot).ticks(), &sent.bits(shot).pattern);
        let lags = sent.gate().start..sent.reach().end;
        let next = marks.iter().skip(1).chain(marks.last());
        // Nearly every mark is refused here: the next one is not there.
        let is_next_there =
            |(mark, next): &(&u32, &u32)| self.seen.has(tick + i64::from(*next - *mark));
        let may_be = marks.iter().zip(next).filter(is_next_there);
        let starts = may_be
            .flat_map(|(mark, _)| lit_bits.iter().map(move |bit| tick - i64::from(bit + mark)));
        starts
            .filter(|start| lags.contains(&(start - sent.fired[shot])))
            .filter(|start| self.seen.are_lit(*start, lit_bits, pattern))
            .min()
    }

    /// Finds `shot` as [`Self::shot_at`] does, with `hidden` marks hidden and after one of the `lags`.
    fn found_at(
        &mut self,
        shot: usize,
        tick: i64,
        (hidden, lags): (usize, &Range<i64>),
    ) -> Option<i64> {
        let (sent, start) = (self.sent, self.start(shot, tick, (hidden, lags))?);
        if !self.seen.has(tick + i64::from(sent.first_marks(shot)[hidden].gap)) {
            return None;
        }
        let (lit_bits, pattern) = (sent.lit_bits(shot), &sent.bits(shot).pattern);
        if !self.seen.are_lit(start, lit_bits, pattern) {
            return None;
        }
        self.residual.put_out(start, lit_bits, pattern);
        self.keep(shot, start);
        Some(start + sent.length())
    }

    /// Keeps `shot`, which begins at `start`: of several surfaces the first one counts, the others are
    /// found again.
    #[inline]
    fn keep(&mut self, shot: usize, start: i64) {
        let (first, lag) = (&mut self.lags[shot], start - self.sent.fired[shot]);
        if *first == NOWHERE {
            *first = lag;
        } else if *first != lag {
            self.again.push((shot, lag));
        }
        self.next = shot + 1;
        self.patience += PATIENCE.1;
    }
}

/// Ticks that are left in the time of a macropulse before any mark of any shot is looked for there. With 4 to
/// 64 a `street` takes equally long, clean and with 10⁷ dark counts a second. With 2 the latter takes a sixth
/// longer, with 1 twice as long. Without this search a clean one takes a third longer, as some macropulses of
/// each pane begin under others.
pub(super) const CLUE: usize = 8;

/// Ticks of overlapping macropulses are laid down for the length of one macropulse, and this part of it more. A whole
/// length more costs a clean `street` 1 % of its time: many macropulses overlap with one other alone. A tenth makes
/// no difference.
const MORE: i64 = 4;

/// Macropulses that fit into the stretch of time that is laid down where they overlap. It is moved on as
/// often as light comes, and 16 of the longest word take 32 MB.
const ROOM: i64 = 16;

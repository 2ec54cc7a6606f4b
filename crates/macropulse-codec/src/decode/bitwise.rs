//! The literal and the blind receiver: one bit after the other, without knowing what was sent.
//!
//! 1. The earliest tick that belongs to no macropulse yet opens one.
//! 2. A tick at the place of mark 1, 2 or 3 of a code word proposes that word. The proposed word with the
//!    greatest share of its marks there is taken, if they are enough for a 1 bit.
//! 3. Each further stretch of one word's length is a 1 bit if enough marks of the word are there.
//! 4. The checksum must fit, and a shot with that label and that word must be in flight.
//! 5. The ticks of the macropulse are taken off the queue, accepted or not.
//!
//! The *literal* receiver takes the opening tick for the first bit, "the first signal is always
//! 1" \[KP16 §2.3\]. That is true of a code word but not of a payload: a macropulse that begins
//! with a dark bit is read shifted, and lost. The *blind* receiver tries how many dark bits went
//! before.

use std::array;

use super::field::{Field, Memory};
use super::{Energy, MARGIN, MIDDLE, MOST_JITTER, Receiver, Reject, Return, Returns, Window};
use crate::ShotLog;
use crate::Ticks;
use crate::code::Codebook;
use crate::kernels::Pattern;

/// Settings of the receivers that read bit by bit.
#[derive(Debug, Clone, PartialEq)]
pub struct Bitwise {
    /// Which bit the opening tick may belong to.
    pub opening: Opening,
    /// Marks of a code word that make a 1 bit.
    pub bit_threshold: u16,
    /// TDC ticks per chip.
    pub ticks_per_chip: u32,
    /// Standard deviation of the timing of one detection event, in ticks: how far from its place a
    /// mark is looked for.
    pub jitter_ticks: f64,
}

/// Which bit the opening tick may belong to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Opening {
    /// The first one: the literal receiver.
    FirstBit,
    /// Whichever makes a legal payload: the blind receiver.
    AnyBit,
}

/// Decodes one band.
pub(super) fn decode(
    receiver: &Receiver,
    settings: &Bitwise,
    sent: (&Codebook, &ShotLog),
    ticks: &Ticks,
) -> Returns {
    let mut band = Band::new(receiver, settings, sent, ticks);
    let mut at_hand = i64::MIN;
    for tick in band.ticks.iter().map(|&tick| i64::from(tick)) {
        if tick >= at_hand {
            at_hand = tick + STRETCH;
            band.field.cover(tick - band.before()..at_hand + band.behind());
        }
        if band.field.is_left(tick)
            && let Some(macropulse) = band.recognise(tick)
        {
            band.settle(&macropulse);
        }
    }
    band.returns()
}

/// Opening ticks for which all that may be of their macropulses is at hand together, in ticks.
const STRETCH: i64 = 1 << 16;

/// A macropulse as it is read from an opening tick on.
struct Macropulse {
    /// First tick of the first lit bit.
    start: i64,
    word: u16,
    /// Marks found in each bit from there on.
    found: Vec<u16>,
}

/// A shot, as one opening tick has it.
#[derive(Debug, Clone, Copy)]
struct Claim {
    lag: i64,
    count: u16,
}

/// Number of marks behind the first one that are looked for first; the others are looked for only if one of
/// these is found.
const PROPOSALS: usize = 3;

/// Machine words of ticks in which they are looked for at once.
const NEAR: usize = 3;

/// Which ticks from the first one of `marks` on are the next [`PROPOSALS`].
fn nearest(marks: &[i64]) -> Option<[u64; NEAR]> {
    let mut bits = [0; NEAR];
    for mark in marks.iter().skip(1).take(PROPOSALS) {
        let behind = (mark - marks[0]) as usize;
        *bits.get_mut(behind / 64)? |= 1 << (behind % 64);
    }
    Some(bits)
}

struct Band<'a> {
    receiver: &'a Receiver,
    settings: &'a Bitwise,
    codebook: &'a Codebook,
    log: &'a ShotLog,
    /// Absolute time of tick 0, in ticks.
    epoch: i64,
    /// Those that may be light of the shots.
    ticks: &'a [u32],
    /// Tick in which each shot was fired, from the epoch on.
    fired: Vec<i64>,
    /// The marks of each word, in ticks.
    words: Vec<Vec<i64>>,
    /// The same as bits.
    patterns: Vec<Pattern>,
    /// The places of each word at which its ticks may be, from `slack` ticks before its start on.
    around: Vec<Pattern>,
    /// For each word, which of the ticks from its first mark on are its next three marks; `None`
    /// where these are farther.
    nearest: Vec<Option<[u64; NEAR]>>,
    bits: u32,
    /// Ticks from one bit to the next.
    bit_length: i64,
    /// How far from its place a mark may lie, to both sides.
    slack: u32,
    /// The ticks at hand; its residual are those that belong to no macropulse yet.
    field: Field<'a>,
    claims: Vec<Option<Claim>>,
    /// Count of the best claim on each shot that was not the best of all.
    runner_up: Vec<u16>,
    returns: Returns,
}

impl<'a> Band<'a> {
    fn new(
        receiver: &'a Receiver,
        settings: &'a Bitwise,
        sent: (&'a Codebook, &'a ShotLog),
        ticks: &'a Ticks,
    ) -> Self {
        let (codebook, log) = sent;
        let epoch = ticks.epoch;
        let fired = receiver.fired_since(log, epoch);
        let scale = i64::from(settings.ticks_per_chip);
        let in_ticks = |word: usize| -> Vec<i64> {
            codebook.word(word as u16).marks.iter().map(|&mark| scale * i64::from(mark)).collect()
        };
        let words: Vec<Vec<i64>> = (0..codebook.words()).map(in_ticks).collect();
        let bits = codebook.payload().map_or(1, |payload| payload.bits());
        // Both the opening tick and the mark jitter: by √2 σ against each other. Twice that is allowed.
        let jitter = settings.jitter_ticks.min(MOST_JITTER);
        let slack = if jitter > 0.05 { (8_f64.sqrt() * jitter).ceil() as u32 } else { 0 };
        let width = 2 * slack + 1;
        let patterns = |width: u32| {
            let bits = |word: &Vec<i64>| word.iter().map(|&mark| mark as usize).collect::<Vec<_>>();
            let pattern = |word| Pattern::new(bits(word).into_iter(), width as usize);
            words.iter().map(pattern).collect()
        };
        let (length, bit_length) = length_of(settings, codebook);
        let ticks = in_time(receiver.gate_ticks, length, (&fired, &ticks.tick));
        let begin = ticks.first().map_or(0, |&tick| i64::from(tick)) - bit_length;
        let extent = (begin, STRETCH + 2 * length + 2 * i64::from(width));
        Self {
            receiver,
            settings,
            codebook,
            log,
            epoch,
            patterns: patterns(1),
            around: patterns(width),
            nearest: words.iter().map(|word| nearest(word)).collect(),
            words,
            bits,
            bit_length,
            slack,
            field: Field::new(ticks, width, extent, bit_length, Memory::default()),
            ticks,
            claims: vec![None; fired.len()],
            runner_up: vec![0; fired.len()],
            fired,
            returns: Returns::default(),
        }
    }

    /// Ticks before the one that opens a macropulse at which some of it may lie.
    fn before(&self) -> i64 {
        self.bit_length + i64::from(self.slack)
    }

    /// Ticks from the beginning of a macropulse to its end, and to what may be its last tick.
    fn behind(&self) -> i64 {
        self.bit_length * i64::from(self.bits) + 2 * i64::from(self.slack) + 1
    }

    /// Marks of `word` found if it starts at `start`.
    fn found(&self, word: usize, start: i64) -> u16 {
        self.field.lit().lit_in(start - i64::from(self.slack), &self.patterns[word]) as u16
    }

    /// The macropulse that `tick` opens, its ticks taken off the queue. `None` where no word has
    /// enough marks.
    fn recognise(&mut self, tick: i64) -> Option<Macropulse> {
        let mut best = (0, 0, tick);
        // A place counts for ticks up to twice the slack later.
        let (lit, earlier) = (self.field.lit(), i64::from(self.slack));
        let near: [u64; NEAR] = array::from_fn(|part| lit.from(tick - earlier + 64 * part as i64));
        for (index, word) in self.words.iter().enumerate() {
            let Some((first, others)) = word.split_first() else { continue };
            let start = tick - first;
            let is_proposed = match &self.nearest[index] {
                Some(nearest) => nearest.iter().zip(&near).any(|(marks, seen)| marks & seen != 0),
                None => others.iter().take(PROPOSALS).any(|mark| lit.has(start + mark - earlier)),
            };
            if !others.is_empty() && !is_proposed {
                continue;
            }
            // The greatest share of its marks: words need not have equally many.
            let found = self.found(index, start);
            let marks = |word: usize| self.words[word].len();
            if usize::from(found) * marks(best.1) > usize::from(best.0) * marks(index) {
                best = (found, index, start);
            }
        }
        let (found, word, start) = best;
        if found < self.settings.bit_threshold.max(1) {
            return None;
        }
        let bit = |bit: u32| self.found(word, start + i64::from(bit) * self.bit_length);
        Some(Macropulse { start, word: word as u16, found: (0..self.bits).map(bit).collect() })
    }

    /// Gives the macropulse to its shot, or counts why it has none.
    fn settle(&mut self, macropulse: &Macropulse) {
        let most = if self.settings.opening == Opening::FirstBit { 1 } else { self.bits };
        let mut best: Option<(usize, Claim, u32)> = None;
        let mut reject = Reject::Crc;
        for dark in 0..most {
            match self.read(macropulse, dark) {
                Ok((shot, claim)) => {
                    if best.is_none_or(|(_, other, _)| claim.count > other.count) {
                        best = Some((shot, claim, dark));
                    }
                }
                // The reason that got furthest tells most.
                Err(why) if rank(why) > rank(reject) => reject = why,
                Err(_) => {}
            }
        }
        self.dequeue(macropulse, best.map_or(0, |(_, _, dark)| dark));
        match best {
            Some((shot, claim, _)) => self.claim(shot, claim),
            None if self.is_owned(macropulse.start) => self.returns.reject(reject),
            None => {}
        }
    }

    /// The shot of a macropulse before which `dark` bits were dark.
    fn read(&self, macropulse: &Macropulse, dark: u32) -> Result<(usize, Claim), Reject> {
        let found = &macropulse.found[..(self.bits - dark) as usize];
        let is_lit = |found: u16| found >= self.settings.bit_threshold;
        let payload = found.iter().fold(0, |bits, &found| bits << 1 | u32::from(is_lit(found)));
        let label = match self.codebook.payload() {
            Some(payload_format) => Some(payload_format.check(payload).map_err(|_| Reject::Crc)?),
            None => None,
        };
        let start = macropulse.start - i64::from(dark) * self.bit_length;
        let shot = self.in_flight(start, (label, macropulse.word))?;
        let count = found.iter().filter(|&&found| is_lit(found)).sum();
        Ok((shot, Claim { lag: start - self.fired[shot], count }))
    }

    /// The shot with this label, if there is any, and word whose light may begin at `start`; the
    /// last one fired, if there are several.
    fn in_flight(&self, start: i64, code: (Option<u16>, u16)) -> Result<usize, Reject> {
        let (nearest, farthest) = self.receiver.gate_ticks;
        let (nearest, farthest) = (i64::from(nearest), i64::from(farthest));
        let (label, word) = code;
        let has_label = |shot: usize| label.is_none_or(|label| self.log.label[shot] == label);
        // Somewhat longer than the gate, to tell what came too late from what never was.
        let first = self.fired.partition_point(|&fired| fired < start - 2 * farthest);
        let last = self.fired.partition_point(|&fired| fired <= start);
        let mut reject = Reject::UnknownShot;
        for shot in (first..last).rev().filter(|&shot| has_label(shot)) {
            let inside = (nearest..=farthest).contains(&(start - self.fired[shot]));
            match (inside, self.log.word[shot] == word) {
                (true, true) => return Ok(shot),
                (true, false) => reject = Reject::LabelMismatch,
                (false, true) if reject == Reject::UnknownShot => reject = Reject::OutsideGate,
                (false, _) => {}
            }
        }
        Err(reject)
    }

    /// Takes the ticks of the lit bits off the queue, `dark` bits having gone before.
    fn dequeue(&mut self, macropulse: &Macropulse, dark: u32) {
        let own = macropulse.found.iter().take((self.bits - dark) as usize);
        let is_lit = |found: u16| found >= self.settings.bit_threshold;
        let lit = own.enumerate().filter(|&(_, &found)| is_lit(found));
        let first = macropulse.start - i64::from(self.slack);
        let after = Vec::from_iter(lit.map(|(bit, _)| bit as u32 * self.bit_length as u32));
        self.field.cancel(first, &after, &self.around[usize::from(macropulse.word)]);
    }

    /// Keeps the claim with most marks on each shot; of equals, the first one.
    fn claim(&mut self, shot: usize, claim: Claim) {
        let runner_up = match self.claims[shot] {
            Some(earlier) if earlier.count >= claim.count => claim.count,
            earlier => {
                self.claims[shot] = Some(claim);
                earlier.map_or(0, |earlier| earlier.count)
            }
        };
        self.runner_up[shot] = self.runner_up[shot].max(runner_up);
    }

    /// Returns true if a macropulse that belongs to no shot is counted here. Each one is counted in one band
    /// only: the one whose owned shots are fired while it comes.
    fn is_owned(&self, start: i64) -> bool {
        let nearest = i64::from(self.receiver.gate_ticks.0);
        let fired = |shot: usize| self.fired.get(shot).map(|fired| fired + nearest);
        let owned = &self.log.owned;
        (owned.start == 0 || fired(owned.start).is_some_and(|first| start >= first))
            && fired(owned.end).is_none_or(|end| start < end)
    }

    fn returns(mut self) -> Returns {
        for shot in self.log.owned.clone() {
            let Some(claim) = self.claims[shot] else { continue };
            let start = self.fired[shot] + claim.lag;
            let marks = self.codebook.marks(self.log.label[shot], self.log.word[shot]).len() as u16;
            let Energy { photons, saturated } =
                Energy::of((claim.count.into(), marks.into()), 0.0, Window::WHOLE);
            self.returns.push(Return {
                shot,
                tof: self.receiver.tof(MIDDLE)(self.log.fired_at_fs[shot], start + self.epoch),
                peak: claim.count,
                marks,
                margin: claim.count - self.runner_up[shot],
                photons,
                saturated,
            });
        }
        self.returns
    }
}

/// Those of the `ticks` at which light of the shots `fired` can arrive, and some more.
fn in_time<'a>(
    (nearest, farthest): (u32, u32),
    length: i64,
    (fired, ticks): (&[i64], &'a [u32]),
) -> &'a [u32] {
    let (Some(first), Some(last)) = (fired.first(), fired.last()) else { return &[] };
    let opens = first + i64::from(nearest) - MARGIN;
    let closes = last + i64::from(farthest) + length + 1 + MARGIN;
    let before = |end: i64| ticks.partition_point(|&tick| i64::from(tick) < end);
    &ticks[before(opens)..before(closes)]
}

/// Length of a macropulse and of a bit of it, in ticks.
fn length_of(settings: &Bitwise, codebook: &Codebook) -> (i64, i64) {
    let length = i64::from(codebook.chips()) * i64::from(settings.ticks_per_chip);
    let bits = codebook.payload().map_or(1, |payload| payload.bits());
    (length, length / i64::from(bits))
}

/// How far a macropulse got that was rejected.
fn rank(reject: Reject) -> u8 {
    match reject {
        Reject::NoPeak => 0,
        Reject::Crc => 1,
        Reject::UnknownShot => 2,
        Reject::OutsideGate => 3,
        Reject::LabelMismatch => 4,
    }
}

#[cfg(test)]
mod tests {
    use super::super::Method;
    use super::*;
    use crate::code::{Crc, Family, Keying, Payload};

    fn codebook() -> Codebook {
        let payload = Payload::new(4, Crc::default(), false).unwrap();
        Codebook::new(Family::prime(11).unwrap(), Some(payload), 16, Keying::OnOff).unwrap()
    }

    /// Eight shots with the labels 8 to 15, which begin with a lit bit, or 0 to 7, which do not.
    fn log(first_label: u16) -> ShotLog {
        ShotLog {
            first: 0,
            fired_at_fs: (0..8).map(|shot| shot * 1100 * 2500).collect(),
            row: vec![0; 8],
            column: (0..8).collect(),
            label: (first_label..first_label + 8).collect(),
            word: (1..9).collect(),
            channel: vec![0; 8],
            owned: 0..8,
        }
    }

    /// All shots of `log` as they come back after `lag` ticks.
    fn ticks(log: &ShotLog, lag: u32) -> Ticks {
        let book = codebook();
        let marks = |shot: usize| book.marks(log.label[shot], log.word[shot]).to_vec();
        let at = |shot: usize| {
            marks(shot).into_iter().map(move |mark| shot as u32 * 1100 + lag + u32::from(mark))
        };
        let mut tick: Vec<u32> = (0..log.len()).flat_map(at).collect();
        tick.sort_unstable();
        Ticks { tick, ..Ticks::default() }
    }

    fn decode(opening: Opening, log: &ShotLog, ticks: &Ticks) -> Returns {
        let settings = Bitwise { opening, bit_threshold: 6, ticks_per_chip: 1, jitter_ticks: 0.0 };
        let method = Method::Bitwise(settings);
        let receiver = Receiver { gate_ticks: (0, 3000), method, ..Receiver::matched(2500) };
        receiver.decode(&codebook(), log, ticks).unwrap()
    }

    #[test]
    fn a_lit_first_bit_is_read_by_both() {
        let log = log(8);
        for opening in [Opening::FirstBit, Opening::AnyBit] {
            let returns = decode(opening, &log, &ticks(&log, 700));
            assert_eq!(returns.shot, [0, 1, 2, 3, 4, 5, 6, 7], "{opening:?}");
            assert!(returns.tof.iter().all(|tof| (tof - 700.5 * 2.5e-12).abs() < 1e-18));
            assert_eq!(returns.peak, returns.marks);
        }
    }

    #[test]
    fn a_dark_first_bit_is_read_by_the_blind_receiver_only() {
        let log = log(0);
        let ticks = ticks(&log, 700);
        let literal = decode(Opening::FirstBit, &log, &ticks);
        assert!(literal.is_empty());
        // Label 0 makes no light; each of the others is read shifted to the front.
        assert_eq!(literal.rejects.iter().sum::<u64>(), 7);
        let blind = decode(Opening::AnyBit, &log, &ticks);
        assert_eq!(blind.shot, [1, 2, 3, 4, 5, 6, 7]);
        assert!(blind.tof.iter().all(|tof| (tof - 700.5 * 2.5e-12).abs() < 1e-18));
    }

    #[test]
    fn what_comes_too_late_or_from_elsewhere_is_counted() {
        let log = log(8);
        let late = decode(Opening::FirstBit, &log, &ticks(&log, 3001));
        assert!(late.is_empty());
        assert_eq!(late.rejected(Reject::OutsideGate), 8);
        let mut other = log.clone();
        other.word.rotate_left(1);
        let mismatched = decode(Opening::FirstBit, &other, &ticks(&log, 700));
        assert!(mismatched.is_empty());
        assert_eq!(mismatched.rejected(Reject::LabelMismatch), 8);
        other.label = vec![0; 8];
        let unknown = decode(Opening::FirstBit, &other, &ticks(&log, 700));
        assert_eq!(unknown.rejected(Reject::UnknownShot), 8);
    }

    #[test]
    fn a_macropulse_of_a_guard_shot_is_not_counted() {
        let mut log = log(0);
        let ticks = ticks(&log, 5);
        log.owned = 3..6;
        assert_eq!(decode(Opening::FirstBit, &log, &ticks).rejects.iter().sum::<u64>(), 3);
        assert_eq!(decode(Opening::AnyBit, &log, &ticks).shot, [3, 4, 5]);
    }
}

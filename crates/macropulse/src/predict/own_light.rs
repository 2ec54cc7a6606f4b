//! When a channel that is sampled is blind with what it sends itself, and which marks of echoes that hides.

use std::ops::{Range, RangeInclusive};

use macropulse_codec::code::CodeWord;
use macropulse_codec::decode::Sampling;

use crate::design::{Design, Detector};
use crate::units::{FS_PER_S, range_from_tof, s_from_fs, tof_from_range};

/// Number of shots of a channel whose hidden marks are counted: six times the words of the example.
pub const SHOTS: usize = 60;

/// Ticks around a mark of a channel in which the channel is blind: the number before the mark leaves, and the
/// number after it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Blind {
    before: i64,
    behind: i64,
}

impl Blind {
    /// The blind time for stray light of any brightness; `None` if the receiver is never blind.
    pub fn at_most(sampling: &Sampling) -> Option<Self> {
        Self::of(sampling, f64::INFINITY)
    }

    /// The blind time for stray light that shows from `shows` ticks before its mark on.
    ///
    /// The receiver takes samples for dark ones from the one before the first that is lit, of those that its
    /// filter reaches, to the last of `blank_ticks`. No mark is told within [`Sampling::core`] of these.
    pub(super) fn of(sampling: &Sampling, shows: f64) -> Option<Self> {
        if sampling.blank_ticks == 0 {
            return None;
        }
        let (core, reach) = (i64::from(sampling.core()), sampling.filter().len() as i64 / 2);
        let lit = shows.min((core + reach) as f64).floor() as i64;
        let rises = if lit > core { lit + 1 } else { core };
        let behind = i64::from(sampling.blank_ticks) - 1 + core;
        Some(Self { before: rises + core, behind })
    }

    /// The same for an echo that comes between two ticks, and is found at either.
    pub fn between_ticks(self) -> Self {
        Self { behind: self.behind + 1, ..self }
    }

    /// From the first tick to the last.
    pub fn ticks(self) -> u32 {
        (self.before + 1 + self.behind).max(0) as u32
    }
}

/// Factor by which the stray light of the sensor's own marks may be stronger and still be over when the
/// channel listens again. Below 1 the receiver takes the end of that light for an echo, in every shot. `None`
/// for a receiver that takes no samples, or never stops listening.
///
/// A channel listens again when its marks are no longer blanked. If each shot is alone, its gate may open
/// later.
pub fn stray_room(design: &Design) -> Option<f64> {
    let Detector::Sampled(detector) = &design.detector else { return None };
    let sampling = design.receiver.method.sampling().filter(|it| it.blank_ticks > 0)?;
    let scan = &design.scan;
    let is_alone = scan.shortest_period() >= tof_from_range(scan.light_range);
    let opens = if is_alone { design.receiver.gate_ticks.0 } else { 0 };
    // A mark leaves between two ticks.
    let ticks = sampling.blank_ticks.max(opens).saturating_sub(1);
    (detector.stray > 0.0)
        .then(|| detector.most_stray(f64::from(ticks) * detector.sample) / detector.stray)
}

/// Shots that a channel sends along a line, word after word, and when it is blind with them.
#[derive(Debug, Clone)]
pub struct OwnLight {
    /// When the marks leave of the shots whose echoes are looked at, in ticks since the line began.
    shots: Vec<Vec<i64>>,
    /// Blind times of the channel, in ticks since the line began: in order, without overlap.
    blind: Vec<Range<i64>>,
    /// First tick behind a mark in which it is told again.
    over: i64,
    ticks_per_s: f64,
}

impl OwnLight {
    /// The own light of `design` in the way of echoes that come up to `tof` seconds later.
    pub(super) fn of(design: &Design, blind: Option<Blind>, tof: f64) -> Self {
        Self::new(design, blind, tof, |shot| own_marks(design, shot).collect())
    }

    /// As if the shots of `design` were these `words` in turn, to echoes that come up to `tof` seconds later.
    pub fn of_words(design: &Design, words: &[CodeWord], blind: Blind, tof: f64) -> Self {
        let marks = |shot: usize| match words.get(shot % words.len().max(1)) {
            Some(word) => leave(design, shot, &word.marks).collect(),
            None => Vec::new(),
        };
        Self::new(design, Some(blind), tof, marks)
    }

    fn new(
        design: &Design,
        blind: Option<Blind>,
        tof: f64,
        marks: impl Fn(usize) -> Vec<i64>,
    ) -> Self {
        let period = design.scan.shortest_period();
        let lasts = |marks: &Vec<i64>| {
            marks.last().zip(marks.first()).map_or(0, |(last, first)| last - first)
        };
        let mut shots: Vec<Vec<i64>> = (0..SHOTS).map(&marks).collect();
        let longest = shots.iter().map(lasts).max().unwrap_or(0);
        let macropulse = s_from_fs(longest * design.clock.tick_fs);
        let around = (((tof + macropulse) / period).ceil() as usize + 1).min(SHOTS);
        shots.extend((SHOTS..SHOTS + 2 * around).map(marks));
        let over = blind.map_or(1, |blind| blind.behind + 1);
        let mut marks: Vec<i64> = shots.iter().flatten().copied().collect();
        marks.sort_unstable();
        let mut times: Vec<Range<i64>> = Vec::new();
        if let Some(blind) = blind {
            for mark in marks {
                let (start, end) = (mark - blind.before, mark + over);
                match times.last_mut() {
                    Some(last) if start <= last.end => last.end = end,
                    _ => times.push(start..end),
                }
            }
        }
        shots.truncate(around + SHOTS);
        shots.drain(..around);
        Self { shots, blind: times, over, ticks_per_s: ticks_per_s(design) }
    }

    /// How many marks of each shot are told of an echo from `range` metres.
    pub fn told_at(&self, range: f64) -> Vec<usize> {
        self.told((tof_from_range(range) * self.ticks_per_s).round() as i64)
    }

    /// The same for every tick at which an echo from `nearest` to `farthest` metres may come, with its range,
    /// m, the farthest first. Ticks in which a channel is still blind from the mark itself are left out.
    pub fn each_told(
        &self,
        nearest: f64,
        farthest: f64,
    ) -> impl Iterator<Item = (f64, Vec<usize>)> {
        let lags = self.lags(nearest, farthest);
        lags.rev().map(move |late| (self.range(late), self.told(late)))
    }

    /// The same without ticks that equal the next one: the numbers change only at a mark's entry into or exit
    /// from a blind time.
    pub(super) fn each_change(
        &self,
        nearest: f64,
        farthest: f64,
    ) -> impl Iterator<Item = (f64, Vec<usize>)> {
        let lags = self.lags(nearest, farthest);
        let marks = || self.shots.iter().flatten();
        let (first, last) = (*lags.start(), *lags.end());
        let mut changes: Vec<i64> = match (marks().count() * self.blind.len()) as i64 > last - first
        {
            true => (first..last).collect(),
            false => marks()
                .flat_map(|mark| {
                    self.blind
                        .iter()
                        .flat_map(move |it| [it.start, it.end].map(|end| end - mark - 1))
                })
                .filter(|late| (first..last).contains(late))
                .collect(),
        };
        changes.extend((first <= last).then_some(last));
        changes.sort_unstable();
        changes.dedup();
        changes.into_iter().rev().map(move |late| (self.range(late), self.told(late)))
    }

    /// Ticks at which an echo from `nearest` to `farthest` metres may come.
    fn lags(&self, nearest: f64, farthest: f64) -> RangeInclusive<i64> {
        let ticks = |range: f64| tof_from_range(range) * self.ticks_per_s;
        (ticks(nearest).ceil() as i64).max(self.over)..=ticks(farthest) as i64
    }

    /// The range, m, of an echo that comes `late` ticks later.
    fn range(&self, late: i64) -> f64 {
        range_from_tof(late as f64 / self.ticks_per_s)
    }

    /// The number of visible marks of each shot, if its echo comes `late` ticks later.
    fn told(&self, late: i64) -> Vec<usize> {
        let is_told = |mark: &&i64| {
            let place = **mark + late;
            let next = self.blind.partition_point(|time| time.end <= place);
            !self.blind.get(next).is_some_and(|time| time.contains(&place))
        };
        self.shots.iter().map(|marks| marks.iter().filter(is_told).count()).collect()
    }
}

/// When the marks of `shot`, counted along a line, leave, in ticks since the line began.
pub(super) fn own_marks(design: &Design, shot: usize) -> impl Iterator<Item = i64> {
    let coding = design.emission.coding();
    let column = shot as u32 % design.scan.columns;
    let word = coding.first_word + shot as u32 % coding.word_modulus;
    leave(design, shot, coding.codebook.marks(coding.label_of(column as u16), word as u16))
}

/// When `marks`, in chips, of such a shot leave.
fn leave<'a>(
    design: &Design,
    shot: usize,
    marks: &'a [u16],
) -> impl Iterator<Item = i64> + use<'a> {
    let fired = in_ticks(design, shot as f64 * design.scan.shortest_period());
    let chip = design.emission.coding().chip_fs / design.clock.tick_fs;
    marks.iter().map(move |mark| fired + chip * i64::from(*mark))
}

/// `time` seconds in whole ticks.
fn in_ticks(design: &Design, time: f64) -> i64 {
    (time * ticks_per_s(design)).round() as i64
}

fn ticks_per_s(design: &Design) -> f64 {
    FS_PER_S as f64 / design.clock.tick_fs as f64
}

#[cfg(test)]
mod tests {
    use macropulse_codec::code::{Family, Separated};

    use super::*;

    /// Shots with less than two marks told: at the worst tick from `nearest` metres to 150, and at all of
    /// them together.
    fn lost(design: &Design, nearest: f64) -> [usize; 2] {
        let sampling = design.receiver.method.sampling().unwrap();
        let blind = Blind::at_most(sampling).map(Blind::between_ticks);
        let own = OwnLight::of(design, blind, tof_from_range(150.0));
        own.each_told(nearest, 150.0).fold([0, 0], |[most, all], (_, told)| {
            let here = told.iter().filter(|told| **told < 2).count();
            [most.max(here), all + here]
        })
    }

    /// Simulated walls in steps of half a tick of 400 ps show 6 ticks before a mark to 16 behind it, echoes
    /// between two ticks included. A shorter mark has fewer behind it, and a sensor without stray light has
    /// none.
    #[test]
    fn a_channel_is_blind_from_where_its_own_light_shows() {
        let of = |changes: &[(&str, &str)]| {
            let owned = |(key, value): &(&str, &str)| ((*key).to_owned(), (*value).to_owned());
            let changes: Vec<_> = changes.iter().map(owned).collect();
            let design = Design::open("coded-32", &changes).unwrap();
            Blind::at_most(design.receiver.method.sampling().unwrap())
        };
        assert_eq!(of(&[]), Some(Blind { before: 6, behind: 15 }));
        assert_eq!(of(&[]).unwrap().between_ticks().ticks(), 23);
        let shorter =
            of(&[("light.pulse_ps", "510"), ("detector.photodiode.bandwidth_mhz", "519")]);
        assert_eq!(shorter, Some(Blind { before: 5, behind: 15 }));
        assert_eq!(of(&[("receiver.blank_ns", "0")]), None);
    }

    /// Simulated walls, with an amplifier of 129 MHz, an isolation of 51 dB and marks of 1420 nJ. The end of
    /// the stray light was found at 1.05 m in each of 1024 shots with 6 ns of blanking, and in none with 20
    /// ns.
    #[test]
    fn stray_light_must_be_over_when_the_channel_listens_again() {
        let room = |changes: &[(&str, &str)]| {
            let owned = |(key, value): &(&str, &str)| ((*key).to_owned(), (*value).to_owned());
            let changes: Vec<_> = changes.iter().map(owned).collect();
            stray_room(&Design::open("coded-32", &changes).unwrap())
        };
        let slow = ("detector.photodiode.bandwidth_mhz", "129");
        let bright = ("light.energy", "{ shot_nj = 4260.0 }");
        assert!(room(&[]).unwrap() > 10.0);
        let eyes = ("idealised", "['eye-safety']");
        assert!(room(&[slow, bright, eyes]).unwrap() < 0.1);
        assert!(room(&[slow, bright, eyes, ("receiver.blank_ns", "20")]).unwrap() > 10.0);
        assert_eq!(room(&[("receiver.blank_ns", "0")]), None);
        assert_eq!(stray_room(&Design::open("hdl-64e", &[]).unwrap()), None);
    }

    /// As counted from the marks that are sent by `tests/designs/words.py`. Words in turn are those of the sensor.
    #[test]
    fn echoes_lose_to_own_light_what_the_marks_sent_say() {
        let wide = Design::open("coded-32", &[]).unwrap();
        assert_eq!(lost(&wide, 5.0), [0, 0]);
        let narrow = Design::open("coded-16", &[]).unwrap();
        let [most, all] = lost(&narrow, 5.0);
        assert_eq!(most, SHOTS / 5);
        approx::assert_relative_eq!(all as f64 / (2418 * SHOTS) as f64, 0.01204, epsilon = 5e-6);
        let blind = Blind::at_most(narrow.receiver.method.sampling().unwrap()).unwrap();
        let family =
            Separated { length: 300, weight: 3, words: 10, gap: 20, apart: 5, later: 4, seed: 39 };
        let words = Family::separated(family).unwrap().words();
        let own = OwnLight::of_words(&narrow, &words, blind, tof_from_range(150.0));
        let same = OwnLight::of(&narrow, Some(blind), tof_from_range(150.0));
        assert!(own.each_told(1.0, 150.0).eq(same.each_told(1.0, 150.0)));
        // Each change lists the visible marks of all shots. Its range is the farthest of those with the same
        // marks.
        let mut all: Vec<_> = own.each_told(1.0, 150.0).collect();
        all.dedup_by(|next, before| next.1 == before.1);
        let mut changes: Vec<_> = own.each_change(1.0, 150.0).collect();
        changes.dedup_by(|next, before| next.1 == before.1);
        assert!(all.len() > 10 && all == changes);
    }
}

//! What is left of the signal when the light that was found is taken away from it.

use super::filter::Filtered;
use super::pulse::Pulse;
use super::search::Candidate;
use super::time::{clipped, in_time};
use super::{Band, Mark, Rule, Sampling, Sum};

/// Share of a pulse that is uncertain beside the number of its photons: its shape, and when it came.
const SHAPE: f32 = 0.04;

/// What is uncertain by less than this share of the noise is as good as certain.
const CERTAIN: f32 = 0.25;

/// A mark that is uncertain counts if it is so many standard deviations above what may be left of others.
const TOLD: f32 = 4.0;

/// Marks are equal if they differ by no more than so many standard deviations of their difference …
const EQUAL: f32 = 3.0;

/// … and this share of their mean.
const SPREAD: f32 = 0.08;

/// Light that was found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Found {
    pub shot: usize,
    /// Whole ticks after firing.
    pub lag: i64,
    /// How much later, in ticks.
    pub late: f64,
    /// Detected photons per mark.
    pub photons: f32,
    /// Marks that it was told by.
    pub marks: u16,
    /// Standard deviations above the threshold.
    pub margin: u16,
    pub is_clipped: bool,
}

impl Found {
    /// Ticks after firing.
    pub(super) fn at(&self) -> f64 {
        self.lag as f64 + self.late
    }
}

/// Why a candidate is taken for no light of its shot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Refusal {
    /// Of what is left too few marks tell anything.
    TooFewMarks,
    /// A mark is missing, and the others are not equally strong.
    MarksDiffer,
    /// The sum of the marks does not reach the threshold.
    BelowThreshold,
    /// Clipped marks that are not of one light.
    ClippedApart,
}

impl Refusal {
    /// A word for it, as files have it.
    pub fn name(self) -> &'static str {
        match self {
            Self::TooFewMarks => "too_few_marks",
            Self::MarksDiffer => "marks_differ",
            Self::BelowThreshold => "below_threshold",
            Self::ClippedApart => "clipped_apart",
        }
    }
}

/// The signal, less the light that was found.
pub(super) struct Residual<'a> {
    codes: &'a [i16],
    sampling: &'a Sampling,
    pulse: &'a Pulse,
    filtered: Filtered,
    /// The marks that count: room for one candidate.
    counted: Vec<Mark>,
    /// The score of the last candidate, and what it had to reach, as far as it came to that.
    asked: (Option<f32>, Option<f32>),
}

impl<'a> Residual<'a> {
    pub(super) fn new(
        (codes, sampling): (&'a [i16], &'a Sampling),
        pulse: &'a Pulse,
        filtered: Filtered,
    ) -> Self {
        Self { codes, sampling, pulse, filtered, counted: Vec::new(), asked: (None, None) }
    }

    /// What is left of the signal.
    pub(super) fn signal(&self) -> &[f32] {
        &self.filtered.signal
    }

    /// What is left at a place, and how uncertain it is; not numbers beyond the record.
    pub(super) fn at(&self, place: i64) -> (f32, f32) {
        let Filtered { signal, doubt, .. } = &self.filtered;
        let at =
            usize::try_from(place).ok().and_then(|at| Some((*signal.get(at)?, *doubt.get(at)?)));
        at.unwrap_or((f32::NAN, f32::NAN))
    }

    /// Whether a mark at this place counted for the last candidate.
    pub(super) fn counts(&self, place: i64) -> bool {
        self.counted.iter().any(|mark| mark.place as i64 == place)
    }

    /// The score of the last candidate and what it had to reach, as far as it came to that.
    pub(super) fn asked(&self) -> (Option<f32>, Option<f32>) {
        self.asked
    }

    /// Whether the `candidate` is still there; if so, its light is taken away.
    pub(super) fn test(
        &mut self,
        candidate: &Candidate,
        (band, rule): (&Band, &Rule),
    ) -> Result<Found, Refusal> {
        let shot = candidate.shot;
        let marks: Vec<i64> = band.marks(shot).map(|mark| band.fired[shot] + mark).collect();
        let lag = self.summit(&marks, candidate.lag);
        self.asked = (None, None);
        let sum = self.sum(&marks, lag, rule).ok_or(Refusal::TooFewMarks)?;
        self.asked.0 = Some(sum.score);
        let threshold = self.threshold((&sum, marks.len()), rule).ok_or(Refusal::MarksDiffer)?;
        self.asked.1 = Some(threshold);
        if sum.score < threshold {
            return Err(Refusal::BelowThreshold);
        }
        let codes = (self.codes, &self.filtered.doubt[..]);
        let clipped = clipped(codes, self.sampling, self.pulse, &self.counted);
        if clipped.is_some_and(|clipped| !clipped.is_one) {
            return Err(Refusal::ClippedApart);
        }
        let late = match &clipped {
            Some(clipped) => clipped.late,
            None => in_time(&self.filtered, &self.counted, self.pulse),
        };
        // A pulse is higher between two ticks than it is at either.
        let photons = match &clipped {
            Some(_) => sum.mean,
            None => sum.mean / self.pulse.answer(-late).clamp(0.5, 1.0),
        };
        let found = Found {
            shot,
            lag,
            late,
            photons,
            marks: self.counted.len() as u16,
            margin: (sum.score - threshold) as u16,
            is_clipped: clipped.is_some(),
        };
        let places = marks.iter().map(|mark| mark + lag);
        match clipped {
            Some(clipped) => self.close(places, late, clipped.photons.max(photons)),
            None => self.take_away(places, late, (photons, rule.excess)),
        }
        Ok(found)
    }

    /// The lag, of the one that was found and those beside it, at which the marks are highest together:
    /// what was taken away since may have moved it.
    pub(super) fn summit(&mut self, marks: &[i64], lag: i64) -> i64 {
        self.sort(marks, lag);
        let signal = &self.filtered.signal;
        let height = |late: i64| -> f32 {
            let at = |mark: &Mark| signal.get((mark.place as i64 + late) as usize).copied();
            self.counted.iter().map(|mark| at(mark).unwrap_or(0.0)).sum()
        };
        let here = height(0);
        [-1, 1]
            .into_iter()
            .find(|late| height(*late) > here)
            .map_or(lag, |late| (lag + late).max(0))
    }

    /// Finds the marks that count: those where nothing was taken away, and those where what is left is much
    /// more than what may be left of other light.
    fn sort(&mut self, marks: &[i64], lag: i64) {
        self.counted.clear();
        let Filtered { signal, doubt, sigma, .. } = &self.filtered;
        for mark in marks {
            let Ok(place) = usize::try_from(mark + lag) else { continue };
            let (Some(&height), Some(&doubt)) = (signal.get(place), doubt.get(place)) else {
                continue;
            };
            if doubt == 0.0 || height > TOLD * deviation(doubt, *sigma) {
                self.counted.push(Mark { place, height, doubt });
            }
        }
    }

    /// Leaves out marks in whose filtered pulse a clipped sample counts, beside one that is far from being
    /// clipped: those are of other light, or beside it.
    fn leave_out_clipped(&mut self) {
        let (codes, reach, filtered) = (self.codes, self.pulse.reach, &self.filtered);
        let full_scale = self.sampling.full_scale;
        let far = 0.5 * f32::from(full_scale) / self.pulse.highest();
        if self.counted.iter().any(|mark| mark.height < far) {
            let is_clipped = |mark: &Mark| {
                let within =
                    mark.place.saturating_sub(reach)..codes.len().min(mark.place + reach + 1);
                within.into_iter().any(|at| codes[at] >= full_scale && !filtered.is_dark(at))
            };
            self.counted.retain(|mark| !is_clipped(mark));
        }
    }

    /// The sum of the marks at `lag`; `None` where too few tell anything.
    pub(super) fn sum(&mut self, marks: &[i64], lag: i64, rule: &Rule) -> Option<Sum> {
        self.sort(marks, lag);
        self.leave_out_clipped();
        let is_enough = self.counted.len() >= rule.fewest(marks.len());
        is_enough.then(|| rule.sum(&self.counted, marks.len())).flatten()
    }

    /// What the score must reach; `None` where marks are missing and the others not equal.
    fn threshold(&self, (sum, marks): (&Sum, usize), rule: &Rule) -> Option<f32> {
        if self.counted.len() == marks {
            return Some(rule.threshold);
        }
        // Of marks that are clipped, or nearly so, it is not known how strong they are.
        let is_told = sum.most * self.pulse.highest() < 0.5 * f32::from(self.sampling.full_scale);
        let doubt = self.counted.iter().map(|mark| mark.doubt).fold(0.0, f32::max);
        let both = std::f32::consts::SQRT_2 * rule.deviation(sum.mean);
        let differ = EQUAL * deviation(doubt, both) + SPREAD * sum.mean;
        (!is_told || sum.spread <= differ).then_some(rule.threshold + super::MISSING)
    }

    /// Takes pulses of so many `photons` away, that came `late` behind the `places`.
    fn take_away(
        &mut self,
        places: impl Iterator<Item = i64>,
        late: f64,
        (photons, excess): (f32, f32),
    ) {
        let span = self.pulse.span() as i64;
        let answers: Vec<f32> =
            (-span - 1..=span + 1).map(|tick| self.pulse.answer(tick as f64 - late)).collect();
        let least = CERTAIN * CERTAIN * self.filtered.sigma * self.filtered.sigma;
        for place in places {
            for (tick, about) in (-span..=span).zip(answers.windows(3)) {
                let Ok(at) = usize::try_from(place + tick) else { continue };
                let Some(signal) = self.filtered.signal.get_mut(at) else { continue };
                let answer = about[1];
                *signal -= photons * answer;
                let about = about.iter().map(|answer| answer.abs());
                let nearly = SHAPE * photons * about.fold(0.0, f32::max);
                let counted = excess * photons * answer * answer;
                let doubt = counted + nearly * nearly;
                if doubt > least {
                    let before = self.filtered.doubt[at];
                    self.filtered.doubt[at] = (before * before + doubt).sqrt();
                }
            }
        }
    }

    /// Leaves out what stands about clipped pulses of so many `photons`, and all of the run of clipped samples
    /// that each is in, for which the amplifier holds: how they look is not known.
    fn close(&mut self, places: impl Iterator<Item = i64>, late: f64, photons: f32) {
        let span = self.pulse.span() as i64;
        let sigma = self.filtered.sigma;
        let is_lit = |tick: &i64| {
            let answer = self.pulse.answer(*tick as f64 - late).abs();
            answer * photons > CERTAIN * sigma
        };
        let first = (-span..=span).find(is_lit).unwrap_or(-span);
        let last = (-span..=span).rev().find(is_lit).unwrap_or(span);
        let length = self.filtered.doubt.len() as i64;
        for place in places {
            let mut from = (place + first).clamp(0, length) as usize;
            let mut to = (place + last + 1).clamp(0, length) as usize;
            let is_clipped = |at: usize| self.codes[at] >= self.sampling.full_scale;
            while from > 0 && is_clipped(from - 1) {
                from -= 1;
            }
            while to < self.codes.len() && is_clipped(to) {
                to += 1;
            }
            self.filtered.doubt[from..to].fill(f32::INFINITY);
        }
    }
}

/// Standard deviation of what varies by two independent ones.
fn deviation(one: f32, other: f32) -> f32 {
    (one * one + other * other).sqrt()
}

#[cfg(test)]
mod tests {
    use super::super::STEPS_OF_TICK;
    use super::*;
    use crate::code::{Codebook, Family, Keying, Separated};
    use crate::decode::Receiver;
    use crate::{ShotLog, decode::ReceiverKind};

    /// Noise, in photons, none of which is in the signal.
    const SIGMA: f32 = 36.0;

    fn sampling() -> Sampling {
        let steps = 4 * STEPS_OF_TICK as i32;
        let at = |step: i32| {
            let ticks = step as f32 / STEPS_OF_TICK as f32;
            libm::expf(-ticks * ticks / 2.0) / 10.0
        };
        Sampling {
            pulse: (-steps..=steps).map(at).collect(),
            excess: 5.56,
            full_scale: 1000,
            blank_ticks: 0,
            held_ticks: 0,
            recovery_ticks: 0,
            least_marks: 2,
            coupling: None,
        }
    }

    /// What becomes of a shot whose three marks are so strong at a lag of 100, of which those that are
    /// `blind` tell nothing; and what is left at the first, with how uncertain that is.
    fn tested(heights: [f32; 3], blind: [bool; 3]) -> (Option<Found>, (f32, f32)) {
        tested_beside([0.0; 3], heights, blind)
    }

    /// The same where other light, so strong, comes four ticks behind the first mark and the second, and
    /// four before the last.
    fn tested_beside(
        others: [f32; 3],
        heights: [f32; 3],
        blind: [bool; 3],
    ) -> (Option<Found>, (f32, f32)) {
        let words =
            Separated { length: 60, weight: 3, words: 1, gap: 15, apart: 4, later: 0, seed: 1 };
        let family = Family::separated(words).unwrap();
        let codebook = Codebook::new(family, None, 1, Keying::OnOff).unwrap();
        let (sampling, log) = (sampling(), ShotLog::of_one_channel(&[0], &[0]));
        let pulse = Pulse::new(&sampling);
        let kind = ReceiverKind::Sampled;
        let receiver = Receiver { kind, false_alarm: 1e-5, ..Receiver::matched(1) };
        let (fired, lags) = (vec![0], 200);
        let band = Band { receiver: &receiver, codebook: &codebook, log: &log, fired, lags };
        let (mut signal, mut doubt, mut codes) = (vec![0.0; 300], vec![0.0; 300], vec![0; 300]);
        for (at, late) in [4, 4, -4].into_iter().enumerate() {
            let mark = 100 + band.marks(0).nth(at).unwrap();
            for (height, late) in [(heights[at], 0), (others[at], late)] {
                for tick in -8..=8 {
                    let at = (mark + late + tick) as usize;
                    signal[at] += height * pulse.answer(tick as f64);
                    let code = height * libm::expf(-(tick * tick) as f32 / 2.0) / 10.0;
                    codes[at] = codes[at].max(code.min(1000.0) as i16);
                }
            }
            if blind[at] {
                doubt[mark as usize] = f32::INFINITY;
            }
        }
        let rule = Rule::new(&band, &sampling, SIGMA);
        let filtered = Filtered { signal, doubt, dark: Vec::new(), sigma: SIGMA };
        let mut residual = Residual::new((&codes, &sampling), &pulse, filtered);
        let candidate = Candidate { shot: 0, lag: 100, rank: 1.0 };
        let found = residual.test(&candidate, (&band, &rule)).ok();
        let first = 100 + band.marks(0).next().unwrap() as usize;
        (found, (residual.filtered.signal[first], residual.filtered.doubt[first]))
    }

    /// How strong a mark of `count` equal ones is whose sum is so many standard deviations.
    fn height(score: f32, count: f32) -> f32 {
        score * SIGMA / count.sqrt()
    }

    /// 10⁻⁵ false returns in 100 001 lags: 10⁻¹⁰ each, of which the normal bound is 6.36 σ.
    #[test]
    fn more_is_asked_of_words_of_which_a_mark_is_missing() {
        let all = [false; 3];
        let one = [true, false, false];
        let with = |score, count, blind| tested([height(score, count); 3], blind).0;
        assert!(with(6.33, 3.0, all).is_none() && with(6.39, 3.0, all).is_some());
        assert!(with(6.83, 2.0, one).is_none() && with(6.89, 2.0, one).is_some());
        assert!(with(100.0, 1.0, [true, true, false]).is_none());
        let margin = with(9.4, 3.0, all).unwrap().margin;
        assert_eq!((margin, with(9.4, 2.0, one).unwrap().margin), (3, 2));
    }

    #[test]
    fn two_marks_must_be_equal() {
        let one = [true, false, false];
        assert!(tested([0.0, 900.0, 1000.0], one).0.is_some());
        assert!(tested([0.0, 600.0, 1400.0], one).0.is_none());
        // Three need not: a bright one has light of others.
        let found = tested([600.0, 600.0, 9000.0], [false; 3]).0.unwrap();
        assert!((600.0..700.0).contains(&found.photons), "{}", found.photons);
    }

    /// Bright light of others in one mark, and in the two others what noise alone may be. Control: light that is not so
    /// far above them counts, and two that are as strong as is asked of two are found beside any.
    #[test]
    fn a_bright_mark_of_others_does_not_carry_two_faint_ones() {
        let found = |faint, bright| tested([faint, bright, faint], [false; 3]).0.is_some();
        let deviation = (SIGMA * SIGMA + 5.56 * 100.0).sqrt();
        assert!(found(100.0, 100.0 + 4.9 * deviation) && !found(100.0, 100.0 + 5.1 * deviation));
        assert!(!found(100.0, 1000.0) && !found(170.0, 1000.0) && found(180.0, 1000.0));
    }

    /// Two marks at the rims of clipped light, none of them clipped itself, and noise at the third.
    #[test]
    fn rims_of_clipped_light_are_no_marks() {
        let all = [false; 3];
        assert!(tested_beside([0.0, 1e5, 1e5], [110.0, 0.0, 0.0], all).0.is_none());
        // A true one is told by the marks that are left.
        let found = tested_beside([0.0, 0.0, 1e5], [600.0; 3], all).0.unwrap();
        assert_eq!((found.marks, found.is_clipped), (2, false));
    }

    #[test]
    fn what_is_found_is_taken_away() {
        let (found, (left, doubt)) = tested([1000.0; 3], [false; 3]);
        let found = found.unwrap();
        assert_eq!((found.lag, found.marks, found.is_clipped), (100, 3, false));
        assert!(found.late.abs() < 1e-3 && (found.photons - 1000.0).abs() < 1.0, "{found:?}");
        // √(F·1000 + (4 %·1000)²).
        assert!(left.abs() < 1.0 && (doubt - 84.6).abs() < 0.1, "{left} ± {doubt}");
        let (found, (left, doubt)) = tested([100.0; 3], [false; 3]);
        assert!(found.is_none() && (left - 100.0).abs() < 1e-3 && doubt == 0.0, "{left} ± {doubt}");
        // What is left of clipped pulses tells nothing.
        let (found, (_, doubt)) = tested([1e5; 3], [false; 3]);
        assert!(found.unwrap().is_clipped && doubt == f32::INFINITY);
    }
}

//! The residual: the signal without the light of the returns that were found.

use super::filter::Filtered;
use super::pulse::Pulse;
use super::search::Candidate;
use super::time::{clipped, in_time};
use super::{Band, Mark, Rule, Sampling, Sum};

/// Share of a pulse that is uncertain beside the number of its photons: its shape, and when it came.
const SHAPE: f32 = 0.04;

/// A value with less doubt than this share of the noise is as good as certain.
const CERTAIN: f32 = 0.25;

/// Standard deviations by which an uncertain mark must stand out from the remains of others to count.
const TOLD: f32 = 4.0;

/// Marks are equal if they differ by no more than this number of standard deviations of their difference …
const EQUAL: f32 = 3.0;

/// … and this share of their mean.
const SPREAD: f32 = 0.08;

/// Factor by which marks without other light may differ. The spot moves on during a word; across an edge, one
/// mark has more of it on the surface than another. The spot of `coded-32` moves by 0.3 pixels. Eleven of 302
/// pixels of `car-70m`, all at its outline, had a mark hidden and the others apart by factors of 1.3 to 1.9.
/// With this factor none is lost, and `coded-16` has no more false points on tiles without neighbours: 33 of
/// 196 012 as before.
const SPLIT: f32 = 2.0;

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
    /// Too few marks of the residual tell anything.
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
    /// Set when all candidates were tested once.
    is_again: bool,
}

impl<'a> Residual<'a> {
    pub(super) fn new(
        (codes, sampling): (&'a [i16], &'a Sampling),
        pulse: &'a Pulse,
        filtered: Filtered,
    ) -> Self {
        Self {
            codes,
            sampling,
            pulse,
            filtered,
            counted: Vec::new(),
            asked: (None, None),
            is_again: false,
        }
    }

    /// From here on marks may differ on which no other light was found: all that can be explained otherwise is.
    pub(super) fn look_again(&mut self) {
        self.is_again = true;
    }

    /// The residual signal.
    pub(super) fn signal(&self) -> &[f32] {
        &self.filtered.signal
    }

    /// The residual at a place, and its doubt; not numbers beyond the record.
    pub(super) fn at(&self, place: i64) -> (f32, f32) {
        let Filtered { signal, doubt, .. } = &self.filtered;
        let at =
            usize::try_from(place).ok().and_then(|at| Some((*signal.get(at)?, *doubt.get(at)?)));
        at.unwrap_or((f32::NAN, f32::NAN))
    }

    /// Tells if a mark at this place counted for the last candidate.
    pub(super) fn counts(&self, place: i64) -> bool {
        self.counted.iter().any(|mark| mark.place as i64 == place)
    }

    /// The score of the last candidate and what it had to reach, as far as it came to that.
    pub(super) fn asked(&self) -> (Option<f32>, Option<f32>) {
        self.asked
    }

    /// Tells if the `candidate` is still there; if so, takes its light away.
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

    /// The lag with the highest sum of marks, among the one that was found and those beside it: light that
    /// was taken away since may have moved it.
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

    /// The score to reach; `None` if marks are missing and the others not equal.
    fn threshold(&self, (sum, marks): (&Sum, usize), rule: &Rule) -> Option<f32> {
        if self.counted.len() == marks {
            return Some(rule.threshold);
        }
        // The strength of marks that are all clipped, or nearly so, is not known.
        let lowest = sum.most - sum.spread;
        let is_told = lowest * self.pulse.highest() < 0.5 * f32::from(self.sampling.full_scale);
        let doubt = self.counted.iter().map(|mark| mark.doubt).fold(0.0, f32::max);
        let both = std::f32::consts::SQRT_2 * rule.deviation(sum.mean);
        let differ = EQUAL * deviation(doubt, both) + SPREAD * sum.mean;
        let is_split = self.is_again && doubt == 0.0 && sum.most <= SPLIT * sum.least;
        (!is_told || sum.spread <= differ || is_split).then_some(rule.threshold + super::MISSING)
    }

    /// Takes away pulses of `photons` each that came `late` behind the `places`.
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

    /// Leaves out the surroundings of clipped pulses of `photons` each, and the whole run of clipped samples
    /// around each for which the amplifier holds: their shape is not known.
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
mod tests;

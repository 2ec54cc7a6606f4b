//! What becomes of a shot that was found: the check of its bits, its time of flight, its energy.

use std::collections::VecDeque;

use super::{Band, Detection};
use crate::decode::{Reject, Return, Returns, photons_per_mark};
use crate::statistics::binomial_tail;
use crate::time;

impl Band<'_> {
    /// What was found of the owned shots.
    pub(super) fn returns(&mut self) -> Returns {
        let owned = self.sent.log.owned.clone();
        let mut returns = Returns::with_capacity(owned.len());
        // Where all marks are found nothing is to be learnt from the light around; and in clear
        // weather a logarithm for each shot would take longer than the rest.
        let most = self.sent.codebook.max_weight() as u16;
        let known = self.all_found.len() as u16;
        self.all_found.extend((known..=most).map(|marks| photons_per_mark(marks, marks, 0.0)));
        for shot in owned {
            let Some(mut detection) = self.detections[shot] else {
                returns.reject(Reject::NoPeak);
                continue;
            };
            if !self.carries_its_label(shot, detection) {
                // A bit that should be dark may be lit by another surface of the same shot.
                self.test_multipath_of(shot);
                detection = self.detections[shot].unwrap_or(detection);
                if !self.carries_its_label(shot, detection) {
                    returns.reject(Reject::LabelMismatch);
                    continue;
                }
            }
            let has_secondary =
                self.secondary.get(shot).is_some_and(|secondary| secondary[0].is_some());
            if has_secondary && self.sent.wants_further() {
                for detection in self.kept(shot, detection) {
                    returns.push(self.measured(shot, detection));
                }
            } else {
                returns.push(self.measured(shot, detection));
            }
        }
        returns
    }

    /// What is measured of `shot` at `detection`.
    pub(super) fn measured(&mut self, shot: usize, detection: Detection) -> Return {
        let marks = self.sent.weight(shot);
        let photons = match detection.count == marks {
            true => self.all_found[usize::from(marks)],
            false => photons_per_mark(detection.count, marks, self.density_around(shot, detection)),
        };
        let (peak, margin) = (detection.count, detection.margin);
        Return { shot, tof: self.tof(shot, detection), peak, marks, margin, photons }
    }

    /// Whether no bit of `shot` is lit that should be dark, nor dark that should be lit.
    ///
    /// A dark bit is lit if it has half the marks of a lit one and more than chance gives it; only
    /// the residual counts, as other shots may well shine there. A lit bit is dark if it has
    /// less than half the marks of the others and chance would not take away so many.
    pub(super) fn carries_its_label(&mut self, shot: usize, detection: Detection) -> bool {
        let all_found = detection.count == self.sent.weight(shot);
        if all_found && self.is_dark() {
            return true;
        }
        let lit = self.sent.lit_bits(shot).len() as u32;
        let mean = f64::from(detection.count) / f64::from(lit);
        (all_found || self.lit_bits_are_lit(shot, detection))
            && self.dark_bits_are_dark(shot, detection, mean)
    }

    /// Whether no lit bit of `shot` is darker than chance makes it.
    fn lit_bits_are_lit(&mut self, shot: usize, detection: Detection) -> bool {
        let in_word = self.in_word(shot);
        let mean = f64::from(detection.count) / self.sent.lit_bits(shot).len() as f64;
        // Not so many marks are missing altogether.
        if f64::from(self.sent.weight(shot) - detection.count) < f64::from(in_word) - mean / 2.0 {
            return true;
        }
        let seen_share = mean / f64::from(in_word);
        self.sent.bits(shot, true).all(|bit| {
            let found = self.found_in_bit(shot, detection.lag + bit);
            2.0 * f64::from(found) >= mean
                || binomial_tail(in_word.into(), 1.0 - seen_share, (in_word - found).into())
                    > self.sent.receiver.false_alarm
        })
    }

    fn dark_bits_are_dark(&mut self, shot: usize, detection: Detection, mean: f64) -> bool {
        let start = self.sent.fired[shot] + detection.lag;
        let (word, scale) = (self.sent.codebook.word(self.sent.log.word[shot]), self.sent.scale());
        let (length, width) = (i64::from(word.length) * scale, i64::from(self.sent.width));
        // Half of a lit bit must come from somewhere.
        let needed = (mean / 2.0).ceil() as u32;
        let per_tick = self.marks_per_tick(shot).unwrap_or(1);
        let whole = start..start + self.sent.length() + width;
        if self.field.residual_counts().at_most(whole) * per_tick < needed {
            return true;
        }
        let mut dark = self.sent.bits(shot, false);
        dark.all(|bit| {
            let span = start + bit..start + bit + length + width;
            if self.field.residual_counts().at_most(span.clone()) * per_tick < needed {
                return true;
            }
            let places = word.marks.iter().map(|&mark| start + bit + scale * i64::from(mark));
            let found = self.field.residual(span).count(places, self.sent.width);
            let density = self.density_around(shot, detection);
            let by_chance = self.bit_thresholds.least(self.in_word(shot), density);
            2.0 * f64::from(found) < mean || found < by_chance
        })
    }

    /// Marks of the code word of `shot`.
    fn in_word(&self, shot: usize) -> u16 {
        self.sent.codebook.word(self.sent.log.word[shot]).marks.len() as u16
    }

    /// Two-way time of flight, s. Where ticks jitter, the mean over all marks that were found.
    fn tof(&mut self, shot: usize, detection: Detection) -> f64 {
        let (sent, start) = (self.sent, self.sent.fired[shot] + detection.lag);
        let tof = sent.receiver.tof(sent.log.fired_at_fs[shot], start + sent.epoch);
        tof + self.mean_offset(shot, start) * time::s_from_fs(sent.receiver.tick_fs)
    }

    /// By how many ticks the marks of `shot` are late on average if it begins at `start`. A
    /// window that is not centred on them would cut one side off, so it is centred again.
    fn mean_offset(&mut self, shot: usize, start: i64) -> f64 {
        const ROUNDS: usize = 3;
        let width = i64::from(self.sent.width);
        let reach = width / 2;
        if reach == 0 {
            return 0.0;
        }
        let pattern = self.sent.pattern(shot);
        let (bits, scale) = (self.sent.lit_bits(shot), self.sent.scale());
        let mut late = |by: i64| -> u32 {
            let starts = bits.iter().map(|&bit| start + scale * i64::from(bit) + by);
            starts.map(|start| self.field.ticks_in(start, pattern)).sum()
        };
        // How many are late by how much, from the first one that was asked for on.
        let (mut first, mut counts) = (0, VecDeque::new());
        let mut mean = (width - 1) as f64 / 2.0;
        for _ in 0..ROUNDS {
            let middle = mean.round() as i64;
            let within = middle - reach..=middle + reach;
            if counts.is_empty() {
                first = *within.start();
            }
            while first > *within.start() {
                first -= 1;
                counts.push_front(late(first));
            }
            while first + counts.len() as i64 <= *within.end() {
                counts.push_back(late(first + counts.len() as i64));
            }
            let (mut sum, mut count) = (0, 0);
            for by in within {
                let found = i64::from(counts[(by - first) as usize]);
                (sum, count) = (sum + by * found, count + found);
            }
            mean = sum as f64 / count.max(1) as f64;
            if mean.round() as i64 == middle {
                break;
            }
        }
        mean
    }
}

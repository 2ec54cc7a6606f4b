//! What becomes of a shot that was found: the check of its bits, its time of flight, its energy.

use super::{Band, Lock};
use crate::decode::threshold::binomial_tail;
use crate::decode::timeline::Timeline;
use crate::decode::{Reject, Return, Returns, photons_per_mark};
use crate::units;

impl Band<'_> {
    /// What was found of the home shots.
    pub(super) fn returns(mut self) -> Returns {
        let left_over = self.unexplained.timeline().dilated(0, self.width - 1);
        let mut returns = Returns::default();
        for shot in self.log.home.clone() {
            let Some(lock) = self.locks[shot] else {
                returns.reject(Reject::NoPeak);
                continue;
            };
            let density = self.density_around(shot, lock);
            if !self.carries_its_label(shot, lock, (&left_over, density)) {
                returns.reject(Reject::LabelMismatch);
                continue;
            }
            let marks = self.weight(shot);
            returns.push(Return {
                shot,
                tof: self.tof(shot, lock),
                peak: lock.count,
                marks,
                margin: lock.margin,
                photons: photons_per_mark(lock.count, marks, density),
            });
        }
        returns
    }

    /// Whether no bit of `shot` is lit that should be dark, nor dark that should be lit.
    ///
    /// A dark bit is lit if it has half the marks of a lit one and more than chance gives it;
    /// unexplained light only, as other shots may well shine there. A lit bit is dark if it has
    /// less than half the marks of the others and chance would not take away so many.
    fn carries_its_label(&mut self, shot: usize, lock: Lock, around: (&Timeline, f64)) -> bool {
        let (left_over, density) = around;
        let bits = self.bits(shot);
        let lit = bits.clone().filter(|(lit, _)| *lit).count() as u32;
        let mean = f64::from(lock.count) / f64::from(lit);
        let in_word = self.codebook.word(self.log.word[shot]).marks.len() as u16;
        let by_chance = self.bit_thresholds.least(in_word, density);
        let seen_share = mean / f64::from(in_word);
        for (lit, bit) in bits {
            if lit && lock.count == self.weight(shot) {
                continue;
            }
            let timeline = if lit { self.seen() } else { left_over };
            let found = self.found_in_bit(shot, lock.lag + bit, timeline);
            let half = 2.0 * f64::from(found) >= mean;
            let wrong = if lit {
                let missing = binomial_tail(in_word, 1.0 - seen_share, in_word - found);
                !half && missing <= self.receiver.false_alarm
            } else {
                half && found >= by_chance
            };
            if wrong {
                return false;
            }
        }
        true
    }

    /// Two-way time of flight, s. Where edges jitter, the mean over all marks that were found.
    fn tof(&self, shot: usize, lock: Lock) -> f64 {
        let start = self.fired[shot] + lock.lag;
        let tof = self.receiver.tof(self.log.fired_at_fs[shot], start);
        tof + self.mean_offset(shot, start) * units::s_from_fs(self.receiver.tick_fs)
    }

    /// By how many ticks the marks of `shot` are late on average if it begins at `start`. A
    /// window that is not centred on them would cut one side off, so it is centred again.
    fn mean_offset(&self, shot: usize, start: i64) -> f64 {
        const ROUNDS: usize = 3;
        let reach = i64::from(self.width / 2);
        if reach == 0 {
            return 0.0;
        }
        let mut mean = f64::from(self.width - 1) / 2.0;
        for _ in 0..ROUNDS {
            let middle = mean.round() as i64;
            let (mut sum, mut count) = (0, 0);
            for mark in self.marks(shot) {
                let late = (middle - reach..=middle + reach)
                    .filter(|late| self.ticks.has(start + mark + late));
                for late in late {
                    sum += late;
                    count += 1;
                }
            }
            mean = f64::from(sum as i32) / f64::from(count.max(1));
        }
        mean
    }
}

//! Exclusion and verification: what becomes of a shot that was found.

use std::ops::Range;

use super::track::{BLOCK, NEAREST_SIDE, lit};
use super::{Band, Detection, SURFACES};
use crate::decode::belief::{Marks, Prior, evidence};
use crate::decode::{Reject, Returns, Strength};

impl Band<'_> {
    /// Turns the detections of `shots` into returns. Shots found without a gap are turned together, a run of them at a
    /// time.
    pub(super) fn settle(&mut self, shots: Range<usize>, returns: &mut Returns) {
        let owned = self.sent.log.owned.clone();
        let (mut clear, mut surfaces) = (Vec::new(), Vec::new());
        self.further.sort_by_key(|(shot, _)| *shot);
        let mut further = 0;
        for shot in shots.start.max(owned.start)..shots.end.min(owned.end) {
            let before = |other: &&(usize, Detection)| other.0 < shot;
            further += self.further[further..].iter().take_while(before).count();
            let is_alone = self.further.get(further).is_none_or(|(other, _)| *other > shot);
            if let Some(found) = self.found[shot].filter(|_| is_alone)
                && self.is_clear(shot, found)
            {
                clear.push((shot as u32, found.lag));
                continue;
            }
            if let Err(why) = self.verify(shot, further, &mut surfaces) {
                returns.reject(why);
                continue;
            }
            self.sent.measure_clear(&mut clear, &mut self.meter.photons, returns);
            for surface in surfaces.drain(..) {
                returns.push(self.meter.measured(&self.field, shot, surface));
            }
        }
        self.sent.measure_clear(&mut clear, &mut self.meter.photons, returns);
        if self.further.is_empty() {
            return;
        }
        // Older light overlaps with nothing that is still to come.
        let oldest = self.sent.in_flight_before(shots.end);
        self.further.retain(|(shot, _)| *shot >= oldest);
    }

    /// Puts those surfaces of `shot` that give returns into `surfaces`, by their lag; its further ones are those
    /// from number `further` on.
    ///
    /// # Errors
    /// If there are none, why.
    fn verify(
        &mut self,
        shot: usize,
        further: usize,
        surfaces: &mut Vec<Detection>,
    ) -> Result<(), Reject> {
        self.choose_of_equals(shot);
        surfaces.push(self.found[shot].ok_or(Reject::NoPeak)?);
        let further = self.further[further..].iter().take_while(|(other, _)| *other == shot);
        surfaces.extend(further.map(|(_, surface)| surface));
        if surfaces.len() > 1 {
            surfaces.sort_by_key(|surface| (u32::MAX - surface.count, surface.lag));
        }
        let mut why = None;
        surfaces.retain(|surface| {
            let wrong = self.what_is_wrong(shot, *surface);
            why = why.or(wrong);
            wrong.is_none()
        });
        if surfaces.is_empty() {
            // Light of others claims nothing.
            self.found[shot] = self.found[shot].filter(|_| why != Some(Reject::NoPeak));
            return Err(why.unwrap_or(Reject::NoPeak));
        }
        if surfaces.len() > 1 {
            surfaces.sort_by_key(|surface| surface.lag);
            let receiver = self.sent.receiver;
            // Within one shot, equal numbers of marks are equal light.
            let strength =
                |surface: &Detection| Strength { peak: surface.count as u16, light: f32::NAN };
            receiver.pick.keep(receiver.returns.into(), surfaces, strength);
        }
        Ok(())
    }

    /// Moves `shot` to the likeliest lag: among those with the same number of marks, or one fewer, the one with the
    /// highest posterior odds.
    ///
    /// Several lags may have the same number of marks. The marks of a word may be a comb, as those of the
    /// first prime sequence are. Shifted by a tooth, a comb falls upon itself but for the last marks in every
    /// run of lit bits. If the detector missed these, both lags have the same number of marks, and only the
    /// neighbours of the shot tell them apart. A tick that may be one of two marks would favour the wrong
    /// lag, so it counts for one.
    fn choose_of_equals(&mut self, shot: usize) {
        let weight = self.sent.weight(shot);
        let Some(found) = self.found[shot].filter(|found| found.count < weight) else { return };
        let twice = self.sent.bits(shot).shared * self.sent.lit_bits(shot).len() as u32;
        let expected = self.expected_lags(shot);
        let is_near = |lag: i64, other: i64| lag.abs_diff(other) < NEAREST_SIDE as u64;
        let is_alone = found.margin > 1 + twice;
        let enough = found.count.saturating_sub(1 + twice).max(1);
        let mut middles: Vec<i64> = Vec::new();
        for lag in &expected {
            if !is_near(*lag, found.lag) && !middles.iter().any(|middle| is_near(*middle, *lag)) {
                middles.push(*lag);
            }
        }
        self.leave_out_fewer(shot, &mut middles, enough);
        if is_alone && middles.is_empty() {
            return;
        }
        middles.push(found.lag);
        let prior = Prior::new(self.sent.reach(), &expected);
        let marks = |lit: u32| Marks { lit, of: weight };
        let around = self.light_about(shot, found.lag, found.count);
        let mut best = (f64::NEG_INFINITY, found.lag, found.count);
        for middle in middles {
            if !self.may_have(shot, middle, enough) || self.best_in_block(shot, middle).is_none() {
                continue;
            }
            for at in lit(self.counts.at_least(enough)) {
                let lag = middle - BLOCK / 2 + at;
                let is_further = |(other, surface): &(usize, Detection)| {
                    *other == shot && surface.lag == lag && lag != found.lag
                };
                if !prior.lags().contains(&lag) || self.further.iter().any(is_further) {
                    continue;
                }
                let count = self.marks_with_ticks(shot, lag);
                let odds = evidence(marks(count), &around) + prior.at(lag);
                if odds > best.0 || odds == best.0 && lag < best.1 {
                    best = (odds, lag, count);
                }
            }
        }
        let (_, mut lag, count) = best;
        // The first of several side by side.
        while self.sent.width > 1
            && prior.lags().contains(&(lag - 1))
            && self.marks_with_ticks(shot, lag - 1) == count
        {
            lag -= 1;
        }
        if lag != found.lag {
            self.cancel(shot, lag);
            self.found[shot] = Some(Detection { lag, count, ..found });
        }
    }

    /// True if the block around `middle` has the ticks that `marks` marks of `shot` need.
    fn may_have(&self, shot: usize, middle: i64, marks: u32) -> bool {
        let first = self.sent.fired[shot] + middle - BLOCK / 2;
        let (ticks, _) = self.field.ticks_about(&(first..first + BLOCK + self.sent.takes_up()));
        ticks >= self.sent.ticks_of(shot, marks)
    }

    /// Marks of `shot` found at `lag`, where each tick counts for one of them: the earliest that it may be.
    pub(super) fn marks_with_ticks(&self, shot: usize, lag: i64) -> u32 {
        let (sent, seen, lit) = (self.sent, self.field.seen(), self.field.lit());
        sent.marks_with_ticks(lit, seen, shot, sent.fired[shot] + lag)
    }

    /// Why a `surface` of `shot` gives no return, if it does not.
    fn what_is_wrong(&mut self, shot: usize, surface: Detection) -> Option<Reject> {
        if !self.sent.gate().contains(&surface.lag) {
            return Some(Reject::OutsideGate);
        }
        if self.is_clear(shot, surface) {
            return None;
        }
        if !self.is_its_own(shot, surface) {
            return Some(Reject::NoPeak);
        }
        (!self.carries_its_label(shot, surface)).then_some(Reject::LabelMismatch)
    }

    /// True if all light of `shot` was cancelled, and the `surface` within the gate with it: then it was a macropulse
    /// without a gap.
    fn is_clear(&self, shot: usize, surface: Detection) -> bool {
        let sent = self.sent;
        surface.count == sent.weight(shot)
            && sent.gate().contains(&surface.lag)
            && !self.is_open(shot)
    }

    /// True if the marks found are spread over the code word. Light of another word meets the same one or two
    /// of its marks in every bit, and makes many marks of few.
    ///
    /// If a share q is found in each of B bits, a mark of the word is found in none of them with probability (1 − q)ᴮ.
    /// The marks are not spread if chance leaves out this number of the W marks with a probability of `BY_CHANCE` or
    /// less.
    pub(super) fn is_spread(&mut self, shot: usize, detection: Detection) -> bool {
        let sent = self.sent;
        let bits = sent.lit_bits(shot).len();
        if bits < 2 {
            return true;
        }
        let (start, lit_bits) = (sent.fired[shot] + detection.lag, sent.lit_bits(shot));
        let found = self.field.lit().lit_in_any(start, lit_bits, &sent.bits(shot).pattern);
        let share = f64::from(detection.count) / f64::from(sent.weight(shot));
        let (word, left_out) = (sent.in_word(shot), (1.0 - share).powi(bits as i32));
        word - found < self.chance.once.least(word, left_out)
    }

    /// The returns found so far whose light overlaps with `light`.
    pub(super) fn overlapping(
        &self,
        light: &Range<i64>,
    ) -> impl Iterator<Item = (usize, Detection)> + use<'_> {
        let sent = self.sent;
        let reach = sent.reach();
        let range = sent.that_begin_in(&(light.start - sent.length()..light.end), &reach);
        let (from, end) = (light.start - sent.takes_up() + 1, light.end);
        let others = range.clone().zip(&sent.fired[range.clone()]).zip(&self.found[range]);
        let primary = others.filter_map(move |((shot, fired), found)| {
            let found = found.as_ref()?;
            (from..end).contains(&(fired + found.lag)).then_some((shot, *found))
        });
        let further = self
            .further
            .iter()
            .filter(move |(shot, found)| (from..end).contains(&(sent.fired[*shot] + found.lag)));
        primary.chain(further.copied())
    }

    /// True if the label of `shot` fits. If it is contradicted, further surfaces of the shot are searched for, as their
    /// light may cause the contradiction.
    fn carries_its_label(&mut self, shot: usize, detection: Detection) -> bool {
        for _ in 0..SURFACES {
            if !self.is_mislabelled(shot, detection) {
                return true;
            }
            if !self.finds_another_surface(shot, detection.lag) {
                return false;
            }
        }
        !self.is_mislabelled(shot, detection)
    }
}

//! Posterior odds: whether a detection is believed, and whether its label fits.
//!
//! [`belief`] decides. This module counts what it asks for: the marks of a detection that no fuller return
//! claims, the marks in each bit, and the unexplained light about them. Shortcuts come first, where they can
//! tell.

use std::f64::consts::LN_2;
use std::ops::Range;

use libm::log;

use super::track::WIDEST_GAP;
use super::{Band, Detection, NEIGHBOURS};
use crate::decode::belief::{self, Hypothesis, Marks, Prior, Surroundings, evidence};

impl Band<'_> {
    /// `detection`, if it is believed where no other return claims any of its marks.
    pub(super) fn told_from_chance(
        &mut self,
        shot: usize,
        detection: Detection,
    ) -> Option<Detection> {
        let weight = self.sent.weight(shot);
        let marks = self.marks_at(shot, detection);
        if !self.is_believed(shot, detection, marks) {
            return None;
        }
        let least = self.chance.in_gate.least(weight, self.density_in_gate(shot, detection.count));
        let stands_out = 2 * detection.count >= weight.max(4 * least);
        Some(Detection { stands_out, ..detection })
    }

    /// True if `detection` is believed by the marks that no fuller return claims.
    ///
    /// Its marks must be spread over the word, unless the usual number is there and stands out. Light of another word
    /// is not spread: it meets the same few marks in every bit, and a part of it may make up a whole return of few
    /// bits.
    pub(super) fn is_its_own(&mut self, shot: usize, detection: Detection) -> bool {
        let is_bright = detection.stands_out && self.is_usual(shot, detection);
        if !is_bright && !self.is_spread(shot, detection) {
            return false;
        }
        let marks = self.unclaimed(shot, detection);
        self.is_believed(shot, detection, marks)
    }

    /// True if the posterior odds of `shot` at `detection` reach the threshold, with `marks` of it for evidence.
    fn is_believed(&mut self, shot: usize, detection: Detection, marks: Marks) -> bool {
        // No prior is less than half of a uniform one, and no evidence less than where all ticks are chance.
        let reach = self.sent.reach();
        let enough = self.threshold + log(2.0 * (reach.end - reach.start) as f64);
        if evidence(marks, &self.light_about(shot, detection.lag, detection.count)) >= enough {
            return true;
        }
        let evidence = evidence(marks, &self.unexplained_about(shot, detection.lag));
        evidence >= enough
            || evidence >= self.threshold
                && evidence + self.prior(shot).at(detection.lag) >= self.threshold
    }

    /// The marks of `shot` at `detection`, claimed or not. A tick that may be one of two marks counts for one.
    fn marks_at(&mut self, shot: usize, detection: Detection) -> Marks {
        let of = self.sent.weight(shot);
        if self.sent.bits(shot).shared == 0 {
            return Marks { lit: detection.count, of };
        }
        Marks { lit: self.marks_with_ticks(shot, detection.lag), of }
    }

    /// The marks of `shot` at `detection` that no fuller return claims.
    fn unclaimed(&mut self, shot: usize, detection: Detection) -> Marks {
        let all = self.marks_at(shot, detection);
        let own = self.hypothesis(shot, detection);
        if !self.claim(shot, detection, |band, other, theirs| band.hypothesis(other, theirs) < own)
        {
            return all;
        }
        let (start, sent) = (self.sent.fired[shot] + detection.lag, self.sent);
        let (lit_bits, pattern) = (sent.lit_bits(shot), &sent.bits(shot).pattern);
        let taken = self.claimed.lit_in_all(start, lit_bits, pattern);
        let light = sent.light(shot, detection.lag);
        self.claimed.keep_lit_in(self.field.lit(), &whole_words(&light));
        let explained = self.claimed.lit_in_all(start, lit_bits, pattern);
        Marks { lit: all.lit.saturating_sub(explained), of: all.of - taken }
    }

    /// Has at hand the places that returns about `detection` claim, if there are any: all but its own and those that a
    /// `filter` leaves out.
    fn claim(
        &mut self,
        shot: usize,
        detection: Detection,
        filter: impl Fn(&Self, usize, Detection) -> bool,
    ) -> bool {
        let (sent, light) = (self.sent, self.sent.light(shot, detection.lag));
        let is_own =
            |(other, found): &(usize, Detection)| (*other, found.lag) == (shot, detection.lag);
        let others = self.overlapping(&light).filter(|found| !is_own(found));
        let claims: Vec<_> = others.filter(|found| filter(self, found.0, found.1)).collect();
        if claims.is_empty() {
            return false;
        }
        let stretch = whole_words(&light);
        // Words of others may begin before it.
        let before = (sent.bit_length() + 4 * i64::from(sent.width)).div_euclid(64) * 64 + 64;
        self.claimed.clear_all(stretch.start - before, stretch.end - stretch.start + before);
        for (other, theirs) in claims {
            let before = sent.farther() + i64::from(sent.width - 1);
            let start = sent.fired[other] + theirs.lag - before;
            self.claimed.light_up(start, sent.lit_bits(other), &sent.bits(other).claimed);
        }
        true
    }

    /// Light of `shot` at `detection`, as a hypothesis.
    fn hypothesis(&self, shot: usize, detection: Detection) -> Hypothesis {
        let marks = Marks { lit: detection.count, of: self.sent.weight(shot) };
        Hypothesis { shot, lag: detection.lag, marks }
    }

    /// The light about `shot` at `lag` that no return explains, its own apart. An explained tick takes a place.
    fn unexplained_about(&mut self, shot: usize, lag: i64) -> Surroundings {
        let sent = self.sent;
        let (light, gate) = (sent.light(shot, lag), sent.gate());
        let width = f64::from(sent.width);
        let own = self.left_of(shot, lag);
        let (all, length) = self.field.ticks_about(&light);
        let left: u32 = self.field.residual_cells(&light).0.iter().sum();
        let about_marks = f64::from(sent.weight(shot) * sent.cancelled());
        let places = ((length as f64 - about_marks) / width - f64::from(all - left)).max(1.0);
        let in_gate = (gate.end - gate.start + sent.length()) as f64;
        let density =
            self.leftover().density(shot, &gate) + width * (1.0 - f64::from(own)) / in_gate;
        Surroundings {
            lit: f64::from(left.saturating_sub(own)).min(places),
            places,
            density: density.clamp(width / in_gate, 0.5),
        }
    }

    /// Ticks of `shot` at `lag` that are not cancelled.
    ///
    /// If each photon makes an event of its own, a mark makes several ticks, and several lags have the same number of
    /// marks. `lag` is the earliest of them: light may begin later by the width in which a mark is looked for.
    fn left_of(&self, shot: usize, lag: i64) -> u32 {
        let sent = self.sent;
        let start = sent.fired[shot] + lag - sent.farther();
        let (lit_bits, pattern) = (sent.lit_bits(shot), &sent.bits(shot).cancelled);
        let later = if sent.correlation.photons_apart { i64::from(sent.width) } else { 1 };
        let left = |later| self.field.left_in_all(start + later, lit_bits, pattern);
        (0..later).map(left).max().unwrap_or(0)
    }

    /// Returns the lags that neighbours predict for `shot`. They lie on the lines through neighbours, midway
    /// between the nearest two, at the lags of the shots before, and at that of the next one. If few shots
    /// before were found, more behind count.
    pub(super) fn expected_lags(&self, shot: usize) -> Vec<i64> {
        let lag = |shot: usize| Some(self.found.get(shot)?.as_ref()?.lag);
        let before = (0..shot).rev().take(WIDEST_GAP).filter_map(lag);
        let before: Vec<i64> = before.take(NEIGHBOURS).collect();
        let most = if before.len() < NEIGHBOURS { NEIGHBOURS } else { 1 };
        let behind = (shot + 1..).take(WIDEST_GAP).filter_map(lag);
        let behind: Vec<i64> = behind.take(most).collect();
        let sides = before.first().zip(behind.first());
        let middle = sides.map(|(before, behind)| i64::midpoint(*before, *behind));
        let lines = [0, 2, 3].into_iter().filter_map(|way| self.expected(shot, 1, way));
        lines.chain(middle).chain(before).chain(behind).collect()
    }

    /// The prior of the lags of `shot`.
    pub(super) fn prior(&self, shot: usize) -> Prior {
        Prior::new(self.sent.reach(), &self.expected_lags(shot))
    }

    /// True if `detection` lies outside the gate, and its light is that of a later shot from within.
    ///
    /// It is if a later shot has the same macropulse, as near light is likelier than far light; or if the label of `shot` is
    /// contradicted.
    pub(super) fn is_of_a_later_shot(&mut self, shot: usize, detection: Detection) -> bool {
        let (sent, gate) = (self.sent, self.sent.gate());
        if gate.contains(&detection.lag) {
            return false;
        }
        let (start, log) = (sent.fired[shot] + detection.lag, sent.log);
        let macropulse = |shot: usize| (log.word[shot], log.label[shot]);
        let mut others = sent.that_begin_in(&(start..start + 1), &gate);
        let is_alike = others.any(|other| {
            let from_within = gate.contains(&(start - sent.fired[other]));
            other > shot && from_within && macropulse(other) == macropulse(shot)
        });
        is_alike || self.is_mislabelled(shot, detection)
    }

    /// True if another label explains the light of `shot` at `detection` better than its own.
    ///
    /// Marks of lit bits are counted in all light, as other returns may explain some of them. Marks of dark bits are
    /// counted in the light that no return explains. But a return in the same word that is less full explains none: it may
    /// be made of that very light.
    pub(super) fn is_mislabelled(&mut self, shot: usize, detection: Detection) -> bool {
        let sent = self.sent;
        if sent.bits_of_payload() == 1 {
            return false;
        }
        let start = sent.fired[shot] + detection.lag;
        let around = self.light_about(shot, detection.lag, detection.count);
        let (pattern, in_word) = (&sent.bits(shot).pattern, sent.in_word(shot));
        let [mut lit, mut dark] = std::mem::take(&mut self.found_in_bits);
        self.field.lit().lit_in_each(start, sent.lit_bits(shot), pattern, &mut lit);
        self.field.lit().lit_in_each(start, sent.dark_bits(shot), pattern, &mut dark);
        let own = Marks { lit: lit.iter().sum(), of: sent.weight(shot) };
        let mut all = [&*lit, &*dark].concat();
        // No prior is less than half of a uniform one, and no dark bit shows more marks than in all light.
        let most = belief::contradiction_at_most(&mut all, in_word, own, &around, -LN_2);
        let mut is_contradicted = most > 0.0;
        if is_contradicted {
            self.leave_out_explained(shot, detection, &mut dark);
            let expected = self.prior(shot).expected(detection.lag);
            let [lit, dark] = [&lit, &dark].map(|bits| {
                bits.iter().map(|lit| Marks { lit: *lit, of: in_word }).collect::<Vec<_>>()
            });
            is_contradicted = belief::contradiction(&lit, &dark, &around, expected) > 0.0;
        }
        self.found_in_bits = [lit, dark];
        is_contradicted
    }

    /// Takes from the marks `found` in each dark bit of `shot` at `detection` those that returns explain.
    fn leave_out_explained(&mut self, shot: usize, detection: Detection, found: &mut [u32]) {
        let (sent, own) = (self.sent, self.hypothesis(shot, detection));
        let (start, word) = (sent.fired[shot] + detection.lag, &sent.log.word);
        let explains = |band: &Self, other: usize, theirs: Detection| {
            let apart = sent.fired[other] + theirs.lag - start;
            let is_same = word[other] == word[shot] && sent.is_whole_bits(apart);
            !is_same || band.hypothesis(other, theirs) < own
        };
        if self.claim(shot, detection, explains) {
            let (light, mut claimed) = (sent.light(shot, detection.lag), Vec::new());
            let (dark_bits, pattern) = (sent.dark_bits(shot), &sent.bits(shot).pattern);
            self.claimed.keep_lit_in(self.field.lit(), &whole_words(&light));
            self.claimed.lit_in_each(light.start, dark_bits, pattern, &mut claimed);
            found.iter_mut().zip(claimed).for_each(|(found, claimed)| *found -= claimed);
        }
    }
}

/// Whole machine words that hold `span`.
fn whole_words(span: &Range<i64>) -> Range<i64> {
    span.start.div_euclid(64) * 64..span.end.div_euclid(64) * 64 + 64
}

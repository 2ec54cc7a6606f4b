//! Exclusion and verification: what becomes of a shot that was found.

use std::cmp::Reverse;
use std::ops::Range;

use super::pace::usual;
use super::track::{BLOCK, NEAREST_SIDE, WAYS, WIDEST_GAP, lit};
use super::{Band, Detection, NEIGHBOURS, SURFACES};
use crate::decode::field::Source;
use crate::decode::{Reject, Returns, Strength};
use crate::kernels::parted;

impl Band<'_> {
    /// Turns what was found of `shots` into returns: of those found without a gap, as many in a row together.
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
            // Of one shot, as many marks are as much light.
            let strength =
                |surface: &Detection| Strength { peak: surface.count as u16, light: f32::NAN };
            receiver.pick.keep(receiver.returns.into(), surfaces, strength);
        }
        Ok(())
    }

    /// Takes for the lag of `shot`, of several with as many marks, the one nearest to where its neighbours
    /// let it be expected, and keeps the earliest where there are none.
    ///
    /// The marks of a word may be a comb, as those of the first prime sequence are. Shifted by a tooth,
    /// only the last marks in every run of lit bits have nothing to fall upon; where these are missed
    /// as many marks are found there, and nothing in the light of the shot tells which it is. Where a
    /// tick may be one of two marks even more may be found, so here it counts for one. A neighbour may
    /// be mistaken, too: the two that agree best count.
    fn choose_of_equals(&mut self, shot: usize) {
        let weight = self.sent.weight(shot);
        let Some(found) = self.found[shot].filter(|found| found.count < weight) else { return };
        let is_near = |lag: i64, other: i64| lag.abs_diff(other) < NEAREST_SIDE as u64;
        let twice = self.sent.bits(shot).shared * self.sent.lit_bits(shot).len() as u32;
        let lines = [0, 2, 1, 3].into_iter().find_map(|way| self.expected(shot, 1, way));
        let likely = lines.or_else(|| self.expected(shot, WIDEST_GAP, 1));
        let is_alone = found.margin > twice;
        if is_alone && likely.is_none_or(|likely| is_near(likely, found.lag)) {
            return;
        }
        let expected = self.expected_lags(shot);
        let mut middles = vec![found.lag];
        for lag in &expected {
            if !middles.iter().any(|middle| is_near(*middle, *lag)) {
                middles.push(*lag);
            }
        }
        self.lay_out(shot);
        // None with fewer has as many that each have a tick.
        let least = match self.sent.width {
            1 => found.count,
            _ => self.marks_with_ticks(shot, found.lag),
        };
        let (reach, mut most) = (self.sent.reach(), found.count);
        let mut lags = Vec::from_iter(is_alone.then_some(found.lag));
        for middle in middles.into_iter().skip(lags.len()) {
            let enough = least.max(most.saturating_sub(twice));
            if !self.may_have(shot, middle, enough) {
                continue;
            }
            let Some(best) = self.best_in_block(shot, middle) else { continue };
            most = most.max(best.count);
            let as_many = self.counts.at_least(enough.max(most.saturating_sub(twice)));
            lags.extend(lit(as_many).map(|at| middle - BLOCK / 2 + at));
        }
        if lags == [found.lag] {
            return;
        }
        let away = |lag: i64| {
            let mut away: Vec<u64> = expected.iter().map(|other| lag.abs_diff(*other)).collect();
            away.sort_unstable();
            away.iter().take(2).sum::<u64>()
        };
        let ranked = lags.into_iter().filter(|lag| reach.contains(lag));
        let ranked =
            ranked.map(|lag| (self.marks_with_ticks(shot, lag), Reverse((away(lag), lag))));
        let Some((count, Reverse((_, mut lag)))) = ranked.max() else { return };
        // Of those side by side, the first one.
        while reach.contains(&(lag - 1)) && self.marks_with_ticks(shot, lag - 1) == count {
            lag -= 1;
        }
        if lag != found.lag {
            self.cancel(shot, lag);
            self.found[shot] = Some(Detection { lag, count, is_sure: false, ..found });
        }
    }

    /// Whether there are as many ticks as so many `marks` of `shot` have where it may be in the block around `middle`.
    fn may_have(&self, shot: usize, middle: i64, marks: u32) -> bool {
        let first = self.sent.fired[shot] + middle - BLOCK / 2;
        let (ticks, _) = self.field.ticks_about(&(first..first + BLOCK + self.sent.takes_up()));
        ticks >= self.sent.ticks_of(shot, marks)
    }

    /// The lags at which a doubtful `shot` is to be expected after those that are settled, and after one
    /// behind it that is not as doubtful; after any where few are settled.
    fn expected_lags(&self, shot: usize) -> Vec<i64> {
        let found = |shot: usize| *self.found.get(shot)?;
        let before = (0..shot).rev().take(WIDEST_GAP).filter_map(found);
        let before: Vec<i64> = before.map(|found| found.lag).take(NEIGHBOURS).collect();
        let most = if before.len() < NEIGHBOURS { NEIGHBOURS } else { 1 };
        let behind = (shot + 1..).take(WIDEST_GAP).filter_map(found);
        let behind = behind.filter(|found| found.margin > 0 || most > 1);
        let behind: Vec<i64> = behind.map(|found| found.lag).take(most).collect();
        let sides = before.first().zip(behind.first());
        let middle = sides.map(|(before, behind)| i64::midpoint(*before, *behind));
        let lines = [0, 2, 3].into_iter().filter_map(|way| self.expected(shot, 1, way));
        lines.chain(middle).chain(before).chain(behind).collect()
    }

    /// Marks of `shot`, which are at hand, found at `lag`, where each tick counts for one of them: the
    /// earliest that it may be.
    fn marks_with_ticks(&self, shot: usize, lag: i64) -> u32 {
        let (sent, seen, lit) = (self.sent, self.field.seen(), self.field.lit());
        sent.marks_with_ticks(lit, seen, sent.fired[shot] + lag, &self.marks)
    }

    /// Why a `surface` of `shot` gives no return, if it does not.
    fn what_is_wrong(&mut self, shot: usize, surface: Detection) -> Option<Reject> {
        if !self.sent.gate().contains(&surface.lag) {
            return Some(Reject::OutsideGate);
        }
        if self.is_clear(shot, surface) {
            return None;
        }
        if !surface.is_sure && !self.is_its_own(shot, surface) {
            return Some(Reject::NoPeak);
        }
        (!self.carries_its_label(shot, surface)).then_some(Reject::LabelMismatch)
    }

    /// Whether all light of `shot` was cancelled, and the `surface` from within the gate with it: then it was a
    /// macropulse without a gap.
    fn is_clear(&self, shot: usize, surface: Detection) -> bool {
        let sent = self.sent;
        surface.count == sent.weight(shot)
            && sent.gate().contains(&surface.lag)
            && !self.is_open(shot)
    }

    /// Whether light of other returns, of other shots or another surface of this one, does not account
    /// for `detection`.
    ///
    /// Returns that are as full or fuller claim places; where two claim each other's, the one stays that
    /// is where its neighbours let it be expected, else the later shot, which is settled when the earlier
    /// one is gone: light is rather near than far. Of the places that are claimed about the macropulse a
    /// share c is lit, of the others a share d. If n of its N marks are claimed, chance finds each with
    /// the mean probability (n·c + (N − n)·d) / N; it must not find as many at any lag of the gate. Of a
    /// shot that stands out, with as many marks as usual, this is not asked.
    ///
    /// c is that of the places beside its own marks, or of all if that is more: of few marks of another
    /// return, all that are found may be among its own.
    pub(super) fn is_its_own(&mut self, shot: usize, detection: Detection) -> bool {
        self.is_its_own_beside(shot, detection, None)
    }

    /// As [`Self::is_its_own`], if there were a `supposed` return of another shot as well.
    pub(super) fn is_its_own_beside(
        &mut self,
        shot: usize,
        detection: Detection,
        supposed: Option<(usize, Detection)>,
    ) -> bool {
        let sent = self.sent;
        let weight = sent.weight(shot);
        let is_other = |found: &Detection| found.lag != detection.lag;
        let of_shot = self.found[shot].is_some_and(|found| is_other(&found))
            || self.further.iter().any(|(other, found)| *other == shot && is_other(found));
        let is_asked = of_shot || supposed.is_some();
        if !is_asked && detection.stands_out && self.is_usual(shot, detection) {
            return true;
        }
        if !self.is_spread(shot, detection) {
            return false;
        }
        let light = sent.light(shot, detection.lag);
        let mut claiming = Vec::from_iter(supposed);
        claiming.extend(self.overlapping(&light).filter(|found| {
            let is_itself = found.0 == shot && found.1.lag == detection.lag;
            !is_itself && self.claims(*found, (shot, detection))
        }));
        if claiming.is_empty() {
            return true;
        }
        let stretch = light.start.div_euclid(64) * 64..light.end.div_euclid(64) * 64 + 64;
        // Words of others may begin before it.
        let before = (sent.bit_length() + 4 * i64::from(sent.width)).div_euclid(64) * 64 + 64;
        let [claimed, own] = &mut self.places;
        claimed.clear_all(stretch.start - before, stretch.end - stretch.start + before);
        for (other, theirs) in claiming {
            let bits = sent.bits(other);
            let before = 2 * sent.farther() + i64::from(sent.width - 1);
            let start = sent.fired[other] + theirs.lag - before;
            claimed.light_up(start, sent.lit_bits(other), &bits.claimed);
        }
        // Where its own marks are found tells nothing of the free places.
        own.clear_all(claimed.origin(), stretch.end - claimed.origin());
        let pattern = &sent.bits(shot).cancelled;
        let start = light.start - sent.farther();
        own.light_up(start, sent.lit_bits(shot), pattern);
        let lit = self.field.lit();
        // Free places, claimed ones, and claimed ones of its own: all of them, and those lit.
        let places = parted(claimed.words(&stretch), own.words(&stretch), lit.words(&stretch));
        let lit_bits = sent.lit_bits(shot);
        let taken = claimed.lit_in_all(light.start, lit_bits, &sent.bits(shot).pattern);
        let free = weight - taken;
        let share = |lit: u32, all: u32| f64::from(lit) / f64::from(all.max(1));
        let [[all, lit], [all_claimed, lit_claimed], [all_shared, lit_shared]] = places;
        let beside = share(lit_claimed, all_claimed);
        let claimed = beside.max(share(lit_claimed + lit_shared, all_claimed + all_shared));
        let by_chance = f64::from(free) * share(lit, all) + f64::from(taken) * claimed;
        let gate = self.density_in_gate(shot, detection.count);
        let density = gate.max(by_chance / f64::from(weight)).min(1.0);
        detection.count >= self.chance.in_gate.least(weight, density)
    }

    /// Whether `theirs`, a return of another shot, may claim places of `ours`: one that is fuller, or as
    /// full and not where it is less expected than ours.
    fn claims(&self, theirs: (usize, Detection), ours: (usize, Detection)) -> bool {
        let is_fuller = self.sent.is_as_full(theirs, ours);
        let is_as_full = is_fuller && self.sent.is_as_full(ours, theirs);
        is_fuller
            && !(is_as_full
                && self.is_expected(ours.0, ours.1.lag)
                && !self.is_expected(theirs.0, theirs.1.lag))
    }

    /// Whether `shot` is to be expected about `lag` after any of its neighbours.
    fn is_expected(&self, shot: usize, lag: i64) -> bool {
        let is_near = |expected: i64| expected.abs_diff(lag) < NEAREST_SIDE as u64;
        (0..WAYS).any(|way| self.expected(shot, WIDEST_GAP, way).is_some_and(is_near))
    }

    /// Whether the marks found are spread over the code word. Light of another word meets the same one
    /// or two of its marks in every bit, and makes many marks of few.
    ///
    /// Where a share q is found in each of B bits, a mark of the word is found in none of them with
    /// probability (1 − q)ᴮ. It is not spread if chance leaves out as many of the W marks no more often than
    /// `BY_CHANCE`.
    fn is_spread(&mut self, shot: usize, detection: Detection) -> bool {
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

    /// Whether light of `shot` that seems to come from beyond the gate is rather that of a later shot
    /// from within: one in the same word with as many marks there, or whole bits beside it, where a part of
    /// its lit bits falls upon lit bits, and as large a share of all its marks but for chance.
    pub(super) fn is_of_a_later_shot(&mut self, shot: usize, detection: Detection) -> bool {
        let (sent, gate) = (self.sent, self.sent.gate());
        if detection.lag < gate.end + sent.length() {
            return false;
        }
        let share = f64::from(detection.count) / f64::from(sent.weight(shot));
        let start = sent.fired[shot] + detection.lag;
        let (bits, length) = (sent.bits_of_payload(), sent.bit_length());
        let about = start - bits * length..start + bits * length + 1;
        let is_alike =
            |other: &usize| *other > shot && sent.log.word[*other] == sent.log.word[shot];
        let mut later = sent.that_begin_in(&about, &gate).filter(is_alike).peekable();
        if later.peek().is_none() {
            return false;
        }
        let mut words = std::mem::take(&mut self.words);
        self.words_about(shot, start, &mut words.found);
        let is_another = later.any(|other| {
            let least = usual(share, sent.weight(other)).max(detection.count);
            sent.in_bits(other, &words.found, &mut words.sums);
            (-bits..).zip(&words.sums).any(|(away, count)| {
                let lag = start + away * length - sent.fired[other];
                away.abs() < bits && gate.contains(&lag) && *count >= least
            })
        });
        self.words = words;
        is_another
    }

    /// The marks of the word of `shot` that are `found` where each bit would be from as many bits before
    /// tick `start` on as a payload has, to twice as many behind it.
    pub(super) fn words_about(&self, shot: usize, start: i64, found: &mut Vec<u32>) {
        let (bits, length) = (self.sent.bits_of_payload(), self.sent.bit_length());
        let (after, pattern) = (self.sent.bits_about(), &self.sent.bits(shot).pattern);
        self.field.lit().lit_in_each(start - bits * length, after, pattern, found);
    }

    /// The returns found so far of which light overlaps with `light`.
    fn overlapping(
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

    /// Whether no bit of `shot` is lit that should be dark, nor dark that should be lit.
    ///
    /// Only the residual counts, as other shots may well shine there; and so may another surface of this one,
    /// which is looked for then.
    fn carries_its_label(&mut self, shot: usize, detection: Detection) -> bool {
        if self.sent.bits_of_payload() == 1 {
            return true;
        }
        if !detection.is_sure && !self.is_even(shot, detection) {
            return false;
        }
        for _ in 0..SURFACES {
            if !self.is_lit_where_dark(shot, detection) {
                return true;
            }
            if !self.finds_another_surface(shot, detection.lag) {
                return false;
            }
        }
        !self.is_lit_where_dark(shot, detection)
    }

    /// Whether a bit of `shot` that should be dark has half the marks of a lit one in the residual, and more
    /// than chance gives it.
    pub(super) fn is_lit_where_dark(&mut self, shot: usize, detection: Detection) -> bool {
        let sent = self.sent;
        let light = sent.light(shot, detection.lag);
        let half = detection.count.div_ceil(2 * sent.lit_bits(shot).len() as u32);
        if sent.width > 1 {
            // To widen the residual takes longer than to see that too few ticks are left for any bit.
            let together = self.field.stretch(sent.bit_length() + i64::from(sent.width));
            if self.field.most_left(&light, together) < sent.ticks_in_bit(shot, half) {
                return false;
            }
        }
        let residual = self.field.lit_in(Source::Residual, &light, &mut self.residual);
        let (pattern, found) = (&sent.bits(shot).pattern, &mut self.found_in_bits);
        residual.lit_in_each(light.start, sent.dark_bits(shot), pattern, found);
        let most = found.iter().copied().max().unwrap_or(0);
        most >= half && {
            let density = self.density_beside(shot, detection);
            most >= self.chance.in_bits.least(sent.in_word(shot), density)
        }
    }

    /// Whether as many marks are found in each lit bit of `shot` as in the others.
    ///
    /// Of W marks a share q is found in each of B lit bits; χ² = Σ(n − W·q)²/(W·q·(1 − q)) over the
    /// counts n has B − 1 degrees of freedom, and chance does not exceed it: light of another label
    /// lights some of the bits and leaves others dark.
    pub(super) fn is_even(&mut self, shot: usize, detection: Detection) -> bool {
        let sent = self.sent;
        if detection.count == sent.weight(shot) {
            return true;
        }
        let start = sent.fired[shot] + detection.lag;
        let (in_word, lit) = (f64::from(sent.in_word(shot)), sent.lit_bits(shot).len() as f64);
        let mean = f64::from(detection.count) / lit;
        let (pattern, found) = (&sent.bits(shot).pattern, &mut self.found_in_bits);
        self.field.lit().lit_in_each(start, sent.lit_bits(shot), pattern, found);
        let square = |found: &u32| (f64::from(*found) - mean) * (f64::from(*found) - mean);
        let squares: f64 = found.iter().map(square).sum();
        squares <= chi_square(lit - 1.0, self.chance.rare) * mean * (1.0 - mean / in_word)
    }
}

/// What χ² of so many `degrees` of freedom exceeds as rarely as a normal variable exceeds z, after
/// Wilson and Hilferty: k·(1 − 2/(9k) + z·√(2/(9k)))³ \[WH31\].
fn chi_square(degrees: f64, z: f64) -> f64 {
    let part = 2.0 / (9.0 * degrees.max(1.0));
    degrees.max(1.0) * (1.0 - part + z * part.sqrt()).powi(3)
}

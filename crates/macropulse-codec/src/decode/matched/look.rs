//! In which order the shots are looked for, and what is believed.

use std::ops::Range;

use super::acquire::{Leftover, Source};
use super::track::BLOCK;
use super::{Band, Detection, SURFACES};

/// So many shots are passed by at most, where nothing was found, before the next one is searched for.
const LONGEST_PAUSE: usize = 16;

/// The same where light does not stand out among what is spread evenly.
const LONGEST_EVEN: usize = 64;

/// The share of their marks that was found of the shots before: a running mean.
#[derive(Debug, Clone, Copy)]
pub(super) struct Usual {
    share: f64,
    shots: f64,
}

impl Usual {
    /// Nothing is known: half of them.
    pub(super) fn new() -> Self {
        Self { share: 0.5, shots: 0.0 }
    }

    /// Shots that the mean runs over.
    const RUNS_OVER: f64 = 8.0;

    pub(super) fn learn(&mut self, count: u32, weight: u32) {
        self.shots = (self.shots + 1.0).min(Self::RUNS_OVER);
        self.share += (f64::from(count) / f64::from(weight) - self.share) / self.shots;
    }

    /// Fewest of `weight` marks that are usual.
    pub(super) fn least(&self, weight: u32) -> u32 {
        usual(self.share, weight)
    }
}

/// Fewest of `weight` marks that are usual where a `share` of them is found: three standard deviations
/// below the mean, of the binomial and of a mark.
pub(super) fn usual(share: f64, weight: u32) -> u32 {
    let mean = share * f64::from(weight);
    (mean - 3.0 * (mean * (1.0 - share) + 1.0).sqrt()).max(0.0).ceil() as u32
}

impl Band<'_> {
    /// Finds what can be found of a block of shots.
    pub(super) fn look_for(&mut self, block: Range<usize>) {
        match self.sent.is_thorough() {
            true => self.look_everywhere(block),
            false => self.look_where_expected(block),
        }
    }

    /// Tracks the shots of a block, and acquires those that are no fainter than the others but were not
    /// expected where they are.
    fn look_where_expected(&mut self, block: Range<usize>) {
        let (mut next, mut pause) = (block.start, 1);
        for shot in block.clone() {
            if self.found[shot].is_some() || !self.is_open(shot) {
                continue;
            }
            let weight = self.sent.weight(shot);
            let tracked = self.tracked(shot, false);
            let is_bright = |found: &Detection| {
                found.count >= self.usual.least(weight) || self.is_overwhelming(shot, *found)
            };
            if let Some(tracked) = tracked.filter(is_bright) {
                self.keep(shot, tracked);
                (next, pause) = (shot + 1, 1);
                continue;
            }
            if shot < next {
                continue;
            }
            let half = self.usual.least(weight).min(weight.div_ceil(2));
            let least = self.least_in_gate(shot).max(half);
            let least = tracked.map_or(least, |tracked| least.max(tracked.count + 1));
            let gate = self.sent.arrival(shot);
            let leftover = Leftover::new(self.sent, &self.field, &gate);
            let lags = leftover.lags((self.sent, shot), self.sent.reach(), least, true);
            let acquired = self.nearest_first(shot, lags, least);
            let acquired = acquired.filter(|found| self.stands_alone(shot, *found));
            match acquired.or(tracked).filter(|found| self.is_believed(shot, *found)) {
                Some(found) => {
                    self.searched[shot] = true;
                    self.keep(shot, found);
                    (next, pause) = (shot + 1, 1);
                }
                None => {
                    (next, pause) = (shot + pause, (2 * pause).min(LONGEST_PAUSE));
                }
            }
        }
        for shot in block.clone().rev() {
            if self.found[shot].is_none()
                && self.is_open(shot)
                && let Some(found) = self.tracked(shot, false)
                && found.count >= self.usual.least(self.sent.weight(shot))
            {
                self.keep(shot, found);
            }
        }
        self.look_for_passed_by(block);
    }

    /// Searches for the shots of a block that were passed by: of those in flight together, all bright
    /// ones must be known, as some that overlap would pass for a faint one.
    fn look_for_passed_by(&mut self, block: Range<usize>) {
        let span = self.sent.arrival(block.start).start..self.sent.arrival(block.end - 1).end;
        let leftover = Leftover::new(self.sent, &self.field, &span);
        for shot in block {
            if self.found[shot].is_some() || !self.is_open(shot) {
                continue;
            }
            let around = shot.saturating_sub(2)..(shot + 3).min(self.found.len());
            let is_even = self.found[around].iter().any(Option::is_some);
            let least = self.least_in_gate(shot).max(self.sent.weight(shot).div_ceil(2));
            let lags = leftover.lags((self.sent, shot), self.sent.reach(), least, is_even);
            let found = self.nearest_first(shot, lags, least);
            let found = found.filter(|found| self.stands_alone(shot, *found));
            if let Some(found) = found.filter(|found| self.is_believed(shot, *found)) {
                self.keep(shot, found);
            }
        }
    }

    /// The peak that most marks of `shot` in the residual lead to, of the `lags` within its gate or, if
    /// there are not `least`, beyond: light of a later shot, from near by, may pass for light of this
    /// one from far away.
    fn nearest_first(&mut self, shot: usize, lags: Range<i64>, least: u32) -> Option<Detection> {
        let closes = self.sent.gate().end + self.sent.length();
        let [near, far] = [lags.start..lags.end.min(closes), lags.start.max(closes)..lags.end];
        let found = self.acquired(shot, Source::Residual, near, least);
        found.or_else(|| self.acquired(shot, Source::Residual, far, least))
    }

    /// Takes the maximum over the gate for each shot of a block, and cancels the light of those that no
    /// fuller one accounts for.
    fn look_everywhere(&mut self, block: Range<usize>) {
        for shot in block.clone() {
            if self.found[shot].is_some() || !self.is_open(shot) {
                continue;
            }
            let least = self.least_in_gate(shot);
            if let Some((lag, _)) = self.maximum(shot, Source::Seen, self.sent.gate(), least) {
                let found = self.best_in_block(shot, lag).filter(|found| found.lag == lag);
                self.found[shot] =
                    found.filter(|found| found.count >= self.by_chance(shot, *found));
            }
        }
        for shot in block {
            let Some(found) = self.found[shot] else { continue };
            match self.is_its_own(shot, found) {
                true => self.keep(shot, found),
                false => self.found[shot] = None,
            }
        }
    }

    /// Looks for what is left over where all light is known that overlaps with that of `shots`: faint
    /// shots, and further surfaces.
    pub(super) fn look_for_leftovers(&mut self, shots: Range<usize>) {
        if shots.is_empty() {
            return;
        }
        let span = self.sent.arrival(shots.start).start..self.sent.arrival(shots.end - 1).end;
        let leftover = Leftover::new(self.sent, &self.field, &span);
        for shot in shots.clone() {
            if self.is_open(shot) {
                // Where macropulses overlap everywhere, more of them stand out when some are cancelled.
                (0..=SURFACES).find(|_| !self.look_for_leftover(shot, &leftover));
            }
        }
        for shot in shots.rev() {
            if self.found[shot].is_none() && self.is_open(shot) {
                self.track_leftover(shot);
            }
        }
    }

    /// Looks for light of `shot` that is left over; whether there is some.
    fn look_for_leftover(&mut self, shot: usize, leftover: &Leftover) -> bool {
        if self.found[shot].is_none() && self.track_leftover(shot) {
            return true;
        }
        if self.sent.wants_further() && self.track_further(shot) {
            return true;
        }
        let (known, gate) = (self.found[shot], self.sent.gate());
        let weight = self.sent.weight(shot);
        let least = match known {
            Some(known) if !self.sent.wants_further() && gate.contains(&known.lag) => {
                if self.searched[shot] {
                    return false;
                }
                known.count
            }
            // Of light from beyond the gate no more is wanted.
            _ => self.least_in_gate(shot),
        };
        let is_even = self.sent.is_thorough() || shot >= self.next_even;
        if is_even {
            (self.next_even, self.pause) = (shot + self.pause, (2 * self.pause).min(LONGEST_EVEN));
        }
        // Marks under ticks that are cancelled already are missing: half are taken to be visible, or
        // three in four of what must replace another return.
        let visible = match known {
            Some(_) if !self.sent.wants_further() => least - least / 4,
            _ => least.div_ceil(2),
        };
        let lags = leftover.lags((self.sent, shot), gate, visible, is_even);
        if lags.is_empty() {
            return false;
        }
        let left = leftover.density(self.sent, &self.sent.arrival(shot));
        let visible = self.thresholds.least(weight, left).max(visible);
        let lags = leftover.lags((self.sent, shot), lags, visible, is_even);
        let Some((lag, _)) = self.maximum(shot, Source::Residual, lags, visible) else {
            return false;
        };
        // What was found already may be higher, and near enough to be climbed to.
        let found = match known {
            None => self.climb(shot, lag, least),
            Some(_) => self.found_at(shot, lag),
        };
        let Some(found) = found else {
            self.cancel(shot, lag);
            return true;
        };
        let is_new =
            !self.is_known(shot, found.lag) && (known.is_some() || self.stands_alone(shot, found));
        if !is_new || !self.is_believed(shot, found) {
            self.cancel(shot, lag);
            return true;
        }
        self.cancel(shot, found.lag);
        if known.is_none() {
            (self.next_even, self.pause) = (shot, 1);
        }
        self.add_surface(shot, found);
        true
    }

    /// Adds a surface of `shot`: the one with most marks, the nearest of several, stands for it.
    fn add_surface(&mut self, shot: usize, found: Detection) {
        let Some(known) = self.found[shot] else {
            self.found[shot] = Some(found);
            return;
        };
        let is_beyond = !self.sent.gate().contains(&known.lag);
        let is_earlier = found.count == known.count && found.lag < known.lag;
        let is_better = found.count > known.count || is_earlier || is_beyond;
        self.found[shot] = Some(if is_better { found } else { known });
        self.further.push((shot, if is_better { known } else { found }));
    }

    /// Looks for further surfaces of `shot` where its neighbours have any, in what is left over;
    /// whether there is one.
    fn track_further(&mut self, shot: usize) -> bool {
        if self.found[shot].is_none() {
            return false;
        }
        let beside = |other: usize| other.abs_diff(shot) == 1;
        let mut lags: Vec<i64> = self
            .further
            .iter()
            .filter(|(other, _)| beside(*other))
            .flat_map(|(other, found)| [Some(found.lag), self.found[*other].map(|found| found.lag)])
            .flatten()
            .collect();
        lags.sort_unstable();
        lags.dedup();
        let least = self.least_in_gate(shot);
        for lag in lags {
            let about = (lag - BLOCK / 2, &self.sent.gate());
            let found = self.exactly(shot, Source::Residual, about);
            let Some((lag, _)) = found.filter(|(_, count)| *count >= least.div_ceil(2)) else {
                continue;
            };
            let Some(found) = self.found_at(shot, lag) else { continue };
            if !self.is_known(shot, found.lag) && self.is_believed(shot, found) {
                self.cancel(shot, found.lag);
                self.add_surface(shot, found);
                return true;
            }
        }
        false
    }

    /// Looks for `shot` about its neighbours, also farther ones, where light is left over.
    fn track_leftover(&mut self, shot: usize) -> bool {
        let tracked = self.tracked(shot, true).filter(|found| self.is_believed(shot, *found));
        if let Some(found) = tracked {
            self.cancel(shot, found.lag);
            self.found[shot] = Some(found);
        }
        tracked.is_some()
    }

    /// Whether a surface of `shot` was found at `lag`.
    fn is_known(&self, shot: usize, lag: i64) -> bool {
        let is_here = |found: Detection| found.lag.abs_diff(lag) < self.sent.width.into();
        self.found[shot].is_some_and(is_here)
            || self.further.iter().any(|(other, found)| *other == shot && is_here(*found))
    }

    /// Whether `detection` needs no other shot to be known to be believed: light of no other can arrive
    /// then, or all its marks are there, or so many that chance does not give them where all light
    /// around it is another shot's, its own marks too.
    fn stands_alone(&mut self, shot: usize, detection: Detection) -> bool {
        let weight = self.sent.weight(shot);
        let light = self.sent.light(shot, detection.lag);
        let arrives = |other: usize| {
            let arrival = self.sent.arrival(other);
            arrival.start < light.end && light.start < arrival.end
        };
        let beside = [shot.checked_sub(1), Some(shot + 1).filter(|&next| next < self.found.len())];
        if !beside.into_iter().flatten().any(arrives) || detection.count == weight {
            return true;
        }
        let around = self.field.density(&light);
        detection.count >= self.thresholds.least(weight, around)
    }

    /// Whether neither chance nor light of other returns gives `detection`.
    fn is_believed(&mut self, shot: usize, detection: Detection) -> bool {
        detection.count >= self.by_chance(shot, detection)
            && !self.is_of_a_later_shot(shot, detection)
            && self.is_its_own(shot, detection)
    }
}

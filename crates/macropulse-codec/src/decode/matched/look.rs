//! In which order the shots are looked for, and what is believed.

use std::iter;
use std::ops::Range;

use super::pace::usual;
use super::track::{WAYS, WIDEST_GAP};
use super::{Band, Detection, SURFACES};

/// Factor on the shots that are skipped, in light so dense that half of the gate must be counted lag by lag.
/// A search then takes 290 µs, and otherwise 6 µs. With 10¹⁰ dark counts a second this loses none of 37 268
/// shots of `car-50m` and none of 74 519 of `street`. Decoding then takes two thirds of the time.
const DENSE: f64 = 4.0;

/// Which shots of a block are acquired.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Pass {
    /// Those that are tracked no more, some passed by, as long as others may lie over them.
    First,
    /// Those that were passed by, where all that is bright is known but them.
    Second,
}

/// The fewest of a surface's `marks` that must be left over. A quarter may lie under ticks that are cancelled already.
fn left_over(marks: u32) -> u32 {
    marks - marks / 4
}

impl Band<'_> {
    /// Notes that none of a block of shots can be found.
    pub(super) fn pass_by(&mut self, block: Range<usize>) {
        self.look_along(block, |_, _, _| false);
    }

    /// Does for each shot of a block that is sought what `finds` it, and notes whether it did where the shot was
    /// due to be searched for.
    fn look_along(
        &mut self,
        block: Range<usize>,
        finds: impl Fn(&mut Self, usize, Option<Pass>) -> bool,
    ) {
        for shot in block {
            let pass = self.searched.is_due(shot).then_some(Pass::First);
            let is_found = !self.is_sought(shot) || finds(self, shot, pass);
            if is_found || pass.is_some() {
                self.searched.note(shot, is_found, 1.0);
            }
        }
    }

    /// Tracks the shots of a block from both sides, and acquires those that are no fainter than the
    /// others but were not expected where they are.
    pub(super) fn look_for(&mut self, block: Range<usize>) {
        self.look_along(block.clone(), Self::track_or_acquire);
        for shot in block.clone().rev() {
            if self.is_sought(shot) {
                self.track_or_acquire(shot, None);
            }
        }
        // All bright shots that are in flight together must be known, as some that overlap would pass for a faint one.
        // Now come those that were skipped.
        for shot in block {
            if self.is_sought(shot) {
                self.track_or_acquire(shot, Some(Pass::Second));
            }
        }
    }

    /// Keeps `shot` where it is tracked and bright, or else, in a `pass` that searches, where it is
    /// acquired; whether it is kept.
    fn track_or_acquire(&mut self, shot: usize, pass: Option<Pass>) -> bool {
        let tracked = self.tracked(shot, 1);
        let bright = tracked.filter(|found| self.is_bright(shot, *found));
        let found = bright.or_else(|| self.acquire(shot, tracked, pass?));
        if let Some(found) = found {
            self.keep(shot, found);
        }
        found.is_some()
    }

    /// The peak with most marks of `shot` in the residual, at a lag within its gate or else beyond. It has the usual
    /// number or half of all marks, and more than were `tracked`. Lags beyond count, as light of a later shot, from
    /// near by, may pass for light of this one from far away.
    fn acquire(
        &mut self,
        shot: usize,
        tracked: Option<Detection>,
        pass: Pass,
    ) -> Option<Detection> {
        let sent = self.sent;
        let weight = sent.weight(shot);
        // The first pass asks for the usual number. This bound excludes most of the gate, so little is counted.
        let bright = match pass {
            Pass::First => self.usual.least(weight).min(weight.div_ceil(2)),
            Pass::Second => weight.div_ceil(2),
        };
        let more = tracked.map_or(0, |tracked| tracked.count + 1);
        let least = self.least_in_gate(shot).max(bright).max(more);
        let around = shot.saturating_sub(2)..(shot + 3).min(self.found.len());
        let is_even = pass == Pass::First || self.found[around].iter().any(Option::is_some);
        let (reach, closes) = (sent.reach(), sent.gate().end + sent.length());
        let within = (reach.start..reach.end.min(closes), is_even);
        // Light from beyond must stand out, and is bright at first. A search for it in the second pass, too, finds
        // nothing more in the standard scenes, and takes a twentieth of the time.
        let beyond = (pass == Pass::First).then(|| (closes.max(reach.start)..reach.end, false));
        // Few lags may have the usual number of marks. If one has it, no other need be looked at.
        let usual = Some(self.usual.least(weight)).filter(|usual| *usual > least);
        let found = iter::once(within).chain(beyond).find_map(|(part, is_even)| {
            let (lag, _) = usual.into_iter().chain([least]).find_map(|least| {
                let lags = self.leftover().lags(shot, part.clone(), least, is_even);
                self.maximum(shot, &lags, least)
            })?;
            self.climb(shot, lag, 1)
        });
        found.or(tracked).and_then(|found| self.believed(shot, found))
    }

    /// Looks for what is left over where all light is known that overlaps with that of `shots`: faint
    /// shots, and further surfaces.
    pub(super) fn look_for_leftovers(&mut self, shots: Range<usize>, at_hand: usize) {
        if shots.is_empty() {
            return;
        }
        let first = shots.start.saturating_sub(WIDEST_GAP);
        let around = first..(shots.end + WIDEST_GAP).min(self.found.len());
        // Rows above count, too.
        let is_expected = |shot| (0..WAYS).any(|way| self.expected(shot, 1, way).is_some());
        self.is_dark_around =
            self.found[around].iter().all(Option::is_none) && !shots.clone().any(is_expected);
        self.look_beside(shots.clone(), at_hand);
        for shot in shots.clone() {
            if self.is_open(shot) && self.bright(shot).is_none() {
                // If macropulses overlap everywhere, more of them stand out when some are cancelled.
                for _ in 0..=SURFACES {
                    let Some(found) = self.look_for_leftover(shot) else { break };
                    self.follow((shot, found), shot + 1..at_hand);
                }
            }
        }
        for shot in shots.rev() {
            if self.is_sought(shot) {
                self.track_leftover(shot);
            }
        }
    }

    /// Looks for further surfaces that stand out, of the shots up to `at_hand`. All light that overlaps with that of
    /// the `closed` ones is known.
    ///
    /// The last shots come first. Most light is near, and until that of a later shot is found, it is searched for in
    /// vain in the gates of all shots in flight before it.
    fn look_beside(&mut self, closed: Range<usize>, at_hand: usize) {
        let gate = self.sent.gate();
        let next = self.sent.fired.get(at_hand).map_or(i64::MAX, |fired| fired + gate.start);
        let known_to = next.saturating_sub(self.leftover().stretch_length());
        for shot in (closed.start..at_hand).rev() {
            let is_closed = closed.contains(&shot);
            let known = known_to.saturating_sub(self.sent.fired[shot]);
            let lags = gate.start..if is_closed { gate.end } else { gate.end.min(known) };
            if !is_closed && !self.leftover().must_stand_out(shot, &lags) {
                continue;
            }
            for _ in 0..=SURFACES {
                let Some(found) = self.find_beside(shot, &lags) else { break };
                self.follow((shot, found), (closed.start..shot).rev());
                self.follow((shot, found), shot + 1..at_hand);
            }
        }
    }

    /// The detection of `shot` that stands out, if only a stronger surface is wanted beside it.
    fn bright(&self, shot: usize) -> Option<Detection> {
        let (sent, gate) = (self.sent, self.sent.gate());
        let is_bright = |known: &Detection| known.stands_out && gate.contains(&known.lag);
        self.found[shot].filter(is_bright).filter(|_| !sent.wants_further() && self.is_open(shot))
    }

    /// Finds one more surface of a bright `shot`, of light that stands out and comes after the `lags`.
    fn find_beside(&mut self, shot: usize, lags: &Range<i64>) -> Option<Detection> {
        let known = self.bright(shot)?;
        if self.leftover().is_even(shot, lags) {
            return None;
        }
        let visible = left_over(known.count);
        let lags = self.leftover().lags(shot, lags.clone(), visible, false);
        let most = self.most_left(shot, &lags, visible)?;
        let found = self.found_at(shot, most.0);
        let found = found.and_then(|found| self.another_surface(shot, found));
        Some(self.take_or_cancel(shot, found, most))
    }

    /// The lag among `lags` with most marks of `shot` that are left over: at least `least` of them, and more than
    /// chance leaves.
    fn most_left(&mut self, shot: usize, lags: &[Range<i64>], least: u32) -> Option<(i64, u32)> {
        if lags.is_empty() {
            return None;
        }
        let reach = self.sent.reach();
        let left = self.leftover().density(shot, &reach);
        let least = self.chance.in_gate.least(self.sent.weight(shot), left).max(least);
        self.maximum(shot, lags, least)
    }

    /// Looks for light of `shot` that is left over, and tells after which lag there is some.
    fn look_for_leftover(&mut self, shot: usize) -> Option<Detection> {
        if self.found[shot].is_none() && self.track_leftover(shot) {
            return self.found[shot];
        }
        let (known, gate) = (self.found[shot], self.sent.gate());
        let least = match known {
            Some(known) if !self.sent.wants_further() && gate.contains(&known.lag) => {
                if !known.stands_out {
                    if self.is_first_that_is_faint(shot) {
                        self.again.restart(shot);
                    }
                    if !self.again.is_due(shot) {
                        return None;
                    }
                }
                known.count
            }
            // No further light from beyond the gate is wanted.
            _ => self.least_in_gate(shot),
        };
        let visible = left_over(least);
        let ticks = self.sent.ticks_of(shot, visible);
        if !self.leftover().may_hold(shot, &gate, ticks) {
            return None;
        }
        let may_be_even = known.is_none() && self.even.is_due(shot);
        let is_even = self.sent.wants_further();
        let mut lags = self.leftover().lags(shot, gate.clone(), visible, is_even);
        if lags.is_empty() && may_be_even {
            // Little is cancelled where no light stands out: all of it is to be seen.
            lags = self.leftover().lags(shot, gate.clone(), least, true);
        }
        let searched: i64 = lags.iter().map(|lags| lags.end - lags.start).sum();
        let share = searched as f64 / (gate.end - gate.start) as f64;
        let most = self.most_left(shot, &lags, visible);
        let is_dense = 2 * self.search.counted() > gate.end - gate.start;
        self.note_search(shot, may_be_even, share, if is_dense { DENSE } else { 1.0 });
        let (lag, count) = most?;
        // A known detection may be higher, and near enough to be climbed to.
        let found = match known {
            None => self.climb(shot, lag, least),
            Some(_) => self.found_at(shot, lag),
        };
        let found = found.and_then(|found| self.another_surface(shot, found));
        Some(self.take_or_cancel(shot, found, (lag, count)))
    }

    /// True if light of the shot to the left of `shot` stood out or was not found. Then the cause of its faintness, as
    /// a pane before a wall, begins here.
    fn is_first_that_is_faint(&self, shot: usize) -> bool {
        let left = self.left[shot].and_then(|left| self.found[left as usize]);
        left.is_none_or(|left| left.stands_out)
    }

    /// Takes the surface of `shot` that was `found`, or else cancels the marks that led to it, so that they are
    /// not looked at again; tells where that was.
    fn take_or_cancel(
        &mut self,
        shot: usize,
        found: Option<Detection>,
        (lag, count): (i64, u32),
    ) -> Detection {
        let Some(found) = found else {
            self.cancel(shot, lag);
            return Detection::at(lag, count);
        };
        self.take_surface(shot, found);
        found
    }

    /// Notes that a search of this `share` of the gate of `shot`, `times` harder than usual, found nothing new.
    fn note_search(&mut self, shot: usize, may_be_even: bool, share: f64, times: f64) {
        match self.found[shot] {
            // Faint ones are looked at again now and then. If none is, 28 of 74 519 shots of `street` as
            // declared are found at a fainter surface; a quarter of the pause finds what all of it does.
            Some(known) if !known.stands_out => self.again.note(shot, false, times * share),
            None if may_be_even => self.even.note(shot, false, times * share * share),
            _ => {}
        }
    }

    /// The detection `found` of `shot`, if it is new and believed.
    fn another_surface(&mut self, shot: usize, found: Detection) -> Option<Detection> {
        if self.is_known(shot, found.lag) {
            return None;
        }
        self.believed(shot, found)
    }

    /// Takes what was `found` of `shot` for one of its surfaces, and cancels it.
    fn take_surface(&mut self, shot: usize, found: Detection) {
        self.cancel(shot, found.lag);
        match self.found[shot] {
            Some(_) => self.again.note(shot, true, 0.0),
            None => self.even.note(shot, true, 0.0),
        }
        self.add_surface(shot, found);
    }

    /// Finds one more surface of `shot`, found at `lag`, that neither chance nor light of other shots gives,
    /// and cancels it.
    pub(super) fn finds_another_surface(&mut self, shot: usize, lag: i64) -> bool {
        let gate = self.sent.gate();
        let left = self.leftover().density(shot, &gate);
        let least = left_over(self.least_in_gate(shot));
        let least = self.chance.in_gate.least(self.sent.weight(shot), left).max(least);
        let lags = self.leftover().lags(shot, gate, least, true);
        let most = self.maximum(shot, &lags, least);
        let found = most.and_then(|(lag, _)| self.found_at(shot, lag));
        let found = found.and_then(|found| self.told_from_chance(shot, found));
        // Light of another label is whole bits away, and not as much in each bit. That it stands out is not asked:
        // light of a wall close behind a pane does not, where both are faint.
        let is_own = |found: &Detection| {
            !self.sent.is_whole_bits(found.lag - lag)
                && !self.is_known(shot, found.lag)
                && !self.is_mislabelled(shot, *found)
        };
        let Some(found) = found.filter(is_own) else { return false };
        self.cancel(shot, found.lag);
        self.further.push((shot, found));
        true
    }

    /// Follows a `surface` that stands beside others, as behind a pane of glass, from its shot along the
    /// `shots` next to it, as long as it is no fainter. To search for each of them alone takes long.
    fn follow(&mut self, (shot, surface): (usize, Detection), shots: impl Iterator<Item = usize>) {
        let (mut lag, mut step) = (surface.lag, None);
        let mut share = f64::from(surface.count) / f64::from(self.sent.weight(shot));
        for shot in shots {
            if self.found[shot].is_none() || !self.is_open(shot) {
                return;
            }
            let weight = self.sent.weight(shot);
            let usual = self.usual.least(weight).min(usual(share, weight));
            let expected = lag + step.unwrap_or(0);
            let mut found = self.climb(shot, expected, usual);
            if found.is_none() && step.is_none() {
                // The slope is not known yet.
                found = self.beside(shot, expected, Detection::at(lag, usual.saturating_sub(1)));
            }
            let Some(found) = found.and_then(|found| self.another_surface(shot, found)) else {
                return;
            };
            self.take_surface(shot, found);
            share = f64::from(found.count) / f64::from(weight);
            step = Some(found.lag - lag);
            lag = found.lag;
        }
    }

    /// Adds a surface of `shot`: the one with most marks, the nearest of several, stands for it.
    fn add_surface(&mut self, shot: usize, found: Detection) {
        let Some(known) = self.found[shot] else {
            self.found[shot] = Some(found);
            self.is_dark_around = false;
            return;
        };
        let is_beyond = !self.sent.gate().contains(&known.lag);
        let is_earlier = found.count == known.count && found.lag < known.lag;
        let is_better = found.count > known.count || is_earlier || is_beyond;
        self.found[shot] = Some(if is_better { found } else { known });
        self.further.push((shot, if is_better { known } else { found }));
    }

    /// Looks for `shot` about its neighbours, also farther ones, where light is left over.
    fn track_leftover(&mut self, shot: usize) -> bool {
        if self.is_dark_around {
            return false;
        }
        let tracked = self.tracked(shot, WIDEST_GAP);
        let tracked = tracked.and_then(|found| self.believed(shot, found));
        if let Some(found) = tracked {
            self.cancel(shot, found.lag);
            self.found[shot] = Some(found);
        }
        tracked.is_some()
    }

    /// True if `shot` was not found yet, and may be.
    fn is_sought(&self, shot: usize) -> bool {
        self.found[shot].is_none() && self.is_open(shot)
    }

    /// True if a surface of `shot` was found at `lag`.
    fn is_known(&self, shot: usize, lag: i64) -> bool {
        let is_here = |found: Detection| found.lag.abs_diff(lag) < self.sent.width.into();
        self.found[shot].is_some_and(is_here)
            || self.further.iter().any(|(other, found)| *other == shot && is_here(*found))
    }

    /// True if the share of marks is that of the shots before.
    pub(super) fn is_usual(&self, shot: usize, detection: Detection) -> bool {
        detection.count >= self.usual.least(self.sent.weight(shot))
    }

    /// True if the usual number of marks was found, or more than other light gives.
    fn is_bright(&self, shot: usize, detection: Detection) -> bool {
        detection.stands_out || self.is_usual(shot, detection)
    }

    /// `detection`, if neither chance nor light of other returns gives it.
    fn believed(&mut self, shot: usize, detection: Detection) -> Option<Detection> {
        let found = self.told_from_chance(shot, detection)?;
        let is_own = !self.is_of_a_later_shot(shot, found) && self.is_its_own(shot, found);
        is_own.then_some(found)
    }
}

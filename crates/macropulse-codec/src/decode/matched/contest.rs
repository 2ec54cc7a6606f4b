//! Light that a shot which was found could have sent as well: another surface in its footprint, as
//! behind glass, or the one that was meant if it was found in the wrong place.

use super::leftover::Evidence;
use super::{Band, Lock, SOUNDINGS, SURFACES};
use crate::decode::correlator::BLOCK;

impl Band<'_> {
    /// Gives each shot that was found the lag for which most speaks, and explains its light at the
    /// other ones. The surfaces behind a pane are tracked as those before it are.
    pub(super) fn contest(&mut self) {
        self.contest_each(SOUNDINGS);
        for shot in (0..self.locks.len()).rev() {
            self.look_behind(shot);
        }
        self.contest_each(1);
    }

    fn contest_each(&mut self, every: u32) {
        for shot in 0..self.locks.len() {
            self.look_behind(shot);
            if self.is_among(shot, every) && (every > 1 || !self.is_alone(shot)) {
                self.contest_one(shot);
            }
        }
    }

    /// Searches for other surfaces of `shot`, wherever they are.
    pub(super) fn contest_one(&mut self, shot: usize) {
        if self.is_dark() {
            return;
        }
        for _ in 0..=SURFACES {
            let Some(lock) = self.locks[shot] else { return };
            if !self.may_be_elsewhere(shot, lock) {
                return;
            }
            let Some(lag) = self.unexplained_lag(shot, lock.count / 2) else { return };
            // Another peak may be so near that the higher one is climbed to, known or not.
            match self.best_near(shot, lag, lock.count / 2) {
                Some(rival) if !self.is_known(shot, rival.lag) => {
                    if !self.is_certain(shot, rival, Evidence::Bright) {
                        return;
                    }
                    self.settle(shot, lock, rival);
                }
                _ => self.explain(shot, lag),
            }
        }
    }

    /// Whether nothing else than the lag of `shot` can be meant, or hardly: so many marks were
    /// found, and no neighbour has further surfaces.
    fn is_alone(&self, shot: usize) -> bool {
        let all_but_few = |lock: Lock| 8 * lock.count >= 7 * self.sent.weight(shot);
        let is_behind = |shot: usize| self.behind.get(shot).is_some_and(|lags| lags[0].is_some());
        let around = [shot.checked_sub(1), Some(shot), Some(shot + 1)];
        self.locks[shot].is_some_and(all_but_few) && !around.into_iter().flatten().any(is_behind)
    }

    /// Whether a surface of `shot` was found at `lag`.
    pub(super) fn is_known(&self, shot: usize, lag: i64) -> bool {
        self.locks[shot].is_some_and(|lock| lock.lag == lag)
            || self.behind[shot].iter().flatten().any(|lock| lock.lag == lag)
    }

    /// Looks for further surfaces where the neighbours have one.
    fn look_behind(&mut self, shot: usize) {
        let above = self.above[shot].map(|shot| shot as usize);
        let neighbours = [shot.checked_sub(1), Some(shot + 1), above];
        for neighbour in neighbours.into_iter().flatten() {
            let Some(surfaces) = self.behind.get(neighbour) else { continue };
            if surfaces.iter().all(Option::is_none) {
                continue;
            }
            let seen_there = surfaces.map(|found| found.or(self.locks[neighbour]));
            for lag in seen_there.into_iter().flatten().map(|lock| lock.lag) {
                let Some(lock) = self.locks[shot] else { return };
                let own = self.behind[shot].iter().flatten().chain([&lock]);
                if own.into_iter().any(|own| own.lag.abs_diff(lag) < BLOCK as u64 / 4) {
                    continue;
                }
                if !self.may_be_elsewhere(shot, lock) {
                    return;
                }
                if let Some(rival) = self.best_near(shot, lag, lock.count / 2)
                    && !self.is_known(shot, rival.lag)
                    && self.is_certain(shot, rival, Evidence::Bright)
                    && self.is_unexplained(shot, rival)
                {
                    self.settle(shot, lock, rival);
                }
            }
        }
    }

    /// Whether there is light left over that could be more than `lock` of `shot`.
    fn may_be_elsewhere(&mut self, shot: usize, lock: Lock) -> bool {
        if self.left_in_gate[shot] < u32::from(lock.count / 2) {
            return false;
        }
        let density = self.density_in_gate(shot);
        let by_chance = self.thresholds.least(self.sent.weight(shot), density);
        self.is_crowded(shot, lock.count.saturating_sub(by_chance).max(lock.count / 2))
    }

    /// Explains the light of `shot` at `rival`, and gives it that lag if it fits better than
    /// `lock` does.
    fn settle(&mut self, shot: usize, lock: Lock, rival: Lock) {
        self.explain(shot, rival.lag);
        let is_better =
            rival.count > lock.count || (rival.count == lock.count && rival.lag < lock.lag);
        if let Some(free) = self.behind[shot].iter_mut().find(|lag| lag.is_none()) {
            *free = Some(if is_better { lock } else { rival });
        }
        self.locks[shot] = Some(if is_better { rival } else { lock });
    }
}

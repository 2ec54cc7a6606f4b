//! The multipath test: a second place at which the light of a shot that was found may be. It is a
//! secondary return, as of a surface behind glass, or a competing one, which is the right one if
//! the shot was found in the wrong place.

use super::acquisition::Evidence;
use super::{ACQUISITION_GRID, Band, Detection, SURFACES};
use crate::decode::correlator::BLOCK;

impl Band<'_> {
    /// Gives each shot that was found the lag with the most marks, and cancels its light at the
    /// other ones. The surfaces behind a pane are tracked as those before it are.
    pub(super) fn test_multipath(&mut self) {
        self.test_multipath_each(ACQUISITION_GRID);
        for shot in (0..self.detections.len()).rev() {
            self.track_secondary(shot);
        }
        self.test_multipath_each(1);
    }

    fn test_multipath_each(&mut self, every: u32) {
        for shot in 0..self.detections.len() {
            self.track_secondary(shot);
            if self.is_among(shot, every) && (every > 1 || !self.is_alone(shot)) {
                self.test_multipath_of(shot);
            }
        }
    }

    /// Searches the whole gate for competing and secondary returns of `shot`.
    pub(super) fn test_multipath_of(&mut self, shot: usize) {
        if self.is_dark() {
            return;
        }
        for _ in 0..=SURFACES {
            let Some(detection) = self.detections[shot] else { return };
            if !self.may_be_elsewhere(shot, detection) {
                return;
            }
            let Some(lag) = self.residual_lag(shot, detection.count / 2) else { return };
            // Another peak may be so near that the higher one is climbed to, known or not.
            match self.best_near(shot, lag, detection.count / 2) {
                Some(competing) if !self.is_known(shot, competing.lag) => {
                    if !self.is_certain(shot, competing, Evidence::Bright) {
                        return;
                    }
                    self.settle(shot, detection, competing);
                }
                _ => self.cancel(shot, lag),
            }
        }
    }

    /// Whether nothing else than the lag of `shot` can be meant, or hardly: so many marks were
    /// found, and no neighbour has further surfaces.
    fn is_alone(&self, shot: usize) -> bool {
        let all_but_few = |detection: Detection| 8 * detection.count >= 7 * self.sent.weight(shot);
        let has_secondary =
            |shot: usize| self.secondary.get(shot).is_some_and(|lags| lags[0].is_some());
        let around = [shot.checked_sub(1), Some(shot), Some(shot + 1)];
        self.detections[shot].is_some_and(all_but_few)
            && !around.into_iter().flatten().any(has_secondary)
    }

    /// Whether a surface of `shot` was found at `lag`.
    pub(super) fn is_known(&self, shot: usize, lag: i64) -> bool {
        self.detections[shot].is_some_and(|detection| detection.lag == lag)
            || self.secondary[shot].iter().flatten().any(|detection| detection.lag == lag)
    }

    /// Looks for secondary returns where the neighbours have one.
    fn track_secondary(&mut self, shot: usize) {
        let above = self.above[shot].map(|shot| shot as usize);
        let neighbours = [shot.checked_sub(1), Some(shot + 1), above];
        for neighbour in neighbours.into_iter().flatten() {
            let Some(surfaces) = self.secondary.get(neighbour) else { continue };
            if surfaces.iter().all(Option::is_none) {
                continue;
            }
            let seen_there = surfaces.map(|found| found.or(self.detections[neighbour]));
            for lag in seen_there.into_iter().flatten().map(|detection| detection.lag) {
                let Some(detection) = self.detections[shot] else { return };
                let own = self.secondary[shot].iter().flatten().chain([&detection]);
                if own.into_iter().any(|own| own.lag.abs_diff(lag) < BLOCK as u64 / 4) {
                    continue;
                }
                if !self.may_be_elsewhere(shot, detection) {
                    return;
                }
                if let Some(competing) = self.best_near(shot, lag, detection.count / 2)
                    && !self.is_known(shot, competing.lag)
                    && self.is_certain(shot, competing, Evidence::Bright)
                    && self.is_mostly_residual(shot, competing)
                {
                    self.settle(shot, detection, competing);
                }
            }
        }
    }

    /// Whether there is light in the residual that could be more than `detection` of `shot`.
    fn may_be_elsewhere(&mut self, shot: usize, detection: Detection) -> bool {
        if self.residual_in_gate[shot] < u32::from(detection.count / 2) {
            return false;
        }
        let density = self.density_in_gate(shot);
        let by_chance = self.thresholds.least(self.sent.weight(shot), density);
        self.is_crowded(shot, detection.count.saturating_sub(by_chance).max(detection.count / 2))
    }

    /// Cancels the light of `shot` at `competing`, and gives it that lag if it fits better than
    /// `detection` does.
    fn settle(&mut self, shot: usize, detection: Detection, competing: Detection) {
        self.cancel(shot, competing.lag);
        let is_better = competing.count > detection.count
            || (competing.count == detection.count && competing.lag < detection.lag);
        if let Some(free) = self.secondary[shot].iter_mut().find(|lag| lag.is_none()) {
            *free = Some(if is_better { detection } else { competing });
        }
        self.detections[shot] = Some(if is_better { competing } else { detection });
    }
}

//! A candidate, simulated: what it finds of a scene, beside what is wanted.

use std::path::{Path, PathBuf};

use macropulse::codec::decode::MOST_RETURNS;
use macropulse::digest::Digest;
use macropulse::emit::{Band, short_bands};
use macropulse::formats::write_atomically;
use macropulse::opened;
use macropulse::points::PointCloud;
use macropulse::predict::verdict::missed;
use macropulse::score::Estimate;
use macropulse::sim::{Scans, Watch};
use serde::{Deserialize, Serialize};

use super::candidate::{Built, Candidate};
use super::closed::{Worst, worst};
use super::requirements::Requirements;
use super::scenery::{Scenery, Set};
use super::{Error, Limit};

/// Pixels of a trial, about: of 1e-4 false points accepted two are then seen, of 1e-3 wrong ones twenty.
pub(super) const PIXELS: u64 = 40_000;

/// Counts of a scene. The same on every machine.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Counts {
    /// Pixels measured.
    pub pixels: u64,
    /// Those with a surface within the range wanted.
    pub echoes: u64,
    /// Those of them that have a return of it, or of the surface of a pixel beside it, on which a part of
    /// the beam may fall.
    pub found: u64,
    /// Returns of pixels with an echo that come from nothing there.
    pub wrong: u64,
    /// Returns of pixels without an echo.
    pub false_points: u64,
    /// Returns that are right.
    pub right: u64,
    /// Sum of their errors, m, and of the squares of these.
    pub errors: [f64; 2],
}

impl Counts {
    /// Share of the echoes that were found; NaN without echoes.
    pub fn pd(&self) -> f64 {
        self.found as f64 / self.echoes as f64
    }

    /// Wrong returns per pixel with an echo; 0 without echoes.
    pub fn wrong_share(&self) -> f64 {
        self.wrong as f64 / self.echoes.max(1) as f64
    }

    /// False returns per pixel without an echo; 0 where all have one.
    pub fn false_share(&self) -> f64 {
        let [found, of] = self.of_empty();
        found as f64 / of.max(1) as f64
    }

    /// False returns, and pixels without an echo.
    fn of_empty(&self) -> [u64; 2] {
        [self.false_points, self.pixels - self.echoes]
    }

    /// Tells if they can be those of one scene: a file of them may have been damaged, or written by hand.
    fn add_up(&self) -> bool {
        let most = self.pixels.saturating_mul(MOST_RETURNS.into());
        let returns = [self.wrong, self.false_points, self.right];
        let [sum, squares] = self.errors;
        let most_squares = self.right as f64 * squares * (1.0 + 1e-9);
        self.pixels > 0
            && self.found <= self.echoes
            && self.echoes <= self.pixels
            && returns.iter().all(|returns| *returns <= most)
            && squares.is_finite()
            && sum.powi(2) <= most_squares
    }

    /// Root of the mean square of the errors of right returns, m; NaN without any.
    pub fn rms(&self) -> f64 {
        (self.errors[1] / self.right as f64).sqrt()
    }
}

/// The simulation of a candidate in every scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Trial {
    /// The candidate.
    pub candidate: Candidate,
    /// Its counts, in the order of [`Scenery::ALL`].
    pub counts: [Counts; 2],
    /// The place at which it is forecast to find least, up to the range wanted.
    pub worst: Worst,
    /// The limit by which it fails, and the factor; `None` if it does all that is wanted.
    pub limit: Option<(Limit, f64)>,
}

/// The equipment of trials.
pub(super) struct Bench<'a> {
    pub required: &'a Requirements,
    /// Folder of the files that keep what was counted.
    pub folder: &'a Path,
    pub seed: u64,
    pub watch: &'a Watch<'a>,
}

impl Bench<'_> {
    /// Simulates `candidate`; `None` if the watch said stop.
    pub fn trial(&self, candidate: &Candidate) -> Result<Option<Trial>, Error> {
        let Some(counts) = self.of_each(candidate, &[])? else { return Ok(None) };
        let worst = worst(self.required, candidate)?;
        let limit = limit(self.required, &counts).or_else(|| missed_at_worst(self.required, worst));
        Ok(Some(Trial { candidate: candidate.clone(), counts, worst, limit }))
    }

    /// Simulates `candidate`, with some keys of its sensor changed, in each scene, in the order of
    /// [`Scenery::ALL`]; `None` if the watch said stop.
    pub fn of_each(
        &self,
        candidate: &Candidate,
        changes: &[(String, toml::Value)],
    ) -> Result<Option<[Counts; 2]>, Error> {
        let mut counts = [Counts::default(); 2];
        for (counts, scenery) in counts.iter_mut().zip(Scenery::ALL) {
            let Some(found) = self.counts(candidate, scenery, changes)? else { return Ok(None) };
            *counts = found;
        }
        Ok(Some(counts))
    }

    /// The counts of `candidate`, with some keys of its sensor changed, in a scene; from its file if it was
    /// counted before. `None` if the watch said stop.
    fn counts(
        &self,
        candidate: &Candidate,
        scenery: Scenery,
        changes: &[(String, toml::Value)],
    ) -> Result<Option<Counts>, Error> {
        let required = self.required;
        let wanted = &required.wanted;
        let of_beam = u64::from(wanted.rows / candidate.beams) * u64::from(wanted.columns);
        let beams = (PIXELS.div_ceil(of_beam) as u32).min(candidate.beams);
        let design = candidate.built(required, Built::Beams(beams), changes)?;
        let rows = wanted.rows / candidate.beams * beams;
        let mut hash = Digest::new();
        for text in [env!("CARGO_PKG_VERSION"), &design.text, scenery.name(), &required.text] {
            hash.bytes(text.as_bytes());
            hash.bytes(&[0]);
        }
        hash.bytes(&self.seed.to_le_bytes());
        let path = folder_of_trials(self.folder).join(format!("{}.json", hash.text()));
        if let Ok(text) = opened::text(&path)
            && let Ok(known) = serde_json::from_str::<Counts>(&text)
            && known.add_up()
        {
            (self.watch.done)(known.pixels);
            return Ok(Some(known));
        }
        let set = scenery.set(required, rows, self.seed)?;
        let all: Vec<Band> = short_bands(&design, 0).collect();
        let every = (u64::from(rows) * u64::from(wanted.columns) / PIXELS).max(1) as usize;
        let bands: Vec<Band> = all.into_iter().step_by(every).collect();
        let mut scans = Scans::new(&design, &set.scene, self.seed)?;
        let Some(scan) = scans.part(&bands, self.watch)? else { return Ok(None) };
        let counts = counted(&scan.cloud(), &set, (wanted.range_m, design.right_within));
        let text = serde_json::to_string_pretty(&counts).unwrap_or_default() + "\n";
        write_atomically(&path, |out| out.write_all(text.as_bytes()))?;
        // As it will be read: numbers as text may lose their last bit.
        Ok(Some(serde_json::from_str(&text).unwrap_or(counts)))
    }
}

/// The counts of `cloud` in the scene `set`, inside the `gate`, m; a return is right with an error of
/// `within` at most, m.
fn counted(cloud: &PointCloud, set: &Set, (gate, within): (f64, f64)) -> Counts {
    let mut counts = Counts::default();
    let mut found = vec![false; cloud.fired_ns.len()];
    for ((row, column), range) in cloud.row.iter().zip(&cloud.column).zip(&cloud.range) {
        let (line, across) = (i64::from(*row), i64::from(*column));
        let range = f64::from(*range);
        let own = set.range(line, across);
        let is_there = (-1..=1).any(|down| {
            (-1..=1).any(|on| (set.range(line + down, across + on) - range).abs() <= within)
        });
        let error = range - own;
        if error.abs() <= within {
            counts.right += 1;
            counts.errors[0] += error;
            counts.errors[1] += error * error;
        }
        match (is_there, own <= gate) {
            (true, _) => found[usize::from(*row) * cloud.columns + usize::from(*column)] = true,
            (false, true) => counts.wrong += 1,
            (false, false) => counts.false_points += 1,
        }
    }
    let measured = cloud.fired_ns.iter().zip(found).enumerate();
    for (pixel, (_, found)) in measured.filter(|(_, (fired, _))| fired.is_finite()) {
        let (row, column) = (pixel / cloud.columns, pixel % cloud.columns);
        let has_echo = set.range(row as i64, column as i64) <= gate;
        counts.pixels += 1;
        counts.echoes += u64::from(has_echo);
        counts.found += u64::from(has_echo && found);
    }
    counts
}

/// The place of the files of trials in a folder of results.
pub(super) fn folder_of_trials(folder: &Path) -> PathBuf {
    folder.join("trials")
}

/// The first of what is wanted that was not found in one of the scenes, and by what factor it was missed.
/// A share is missed where its interval of 95 % lies beyond what is wanted.
fn limit(required: &Requirements, counts: &[Counts; 2]) -> Option<(Limit, f64)> {
    let wanted = &required.wanted;
    let over = |limit: Limit, found: &dyn Fn(&Counts) -> [u64; 2], accepted: f64| {
        let of_scene = |counts: &Counts| {
            let share = Estimate::of_rate(&[found(counts)]);
            (share.low > accepted).then_some(share.value / accepted)
        };
        let worst = counts.iter().filter_map(of_scene).fold(0.0, f64::max);
        (worst > 0.0).then_some((limit, worst))
    };
    let missed = |counts: &Counts| [counts.echoes - counts.found, counts.echoes];
    let rms = counts.iter().map(Counts::rms).fold(0.0, f64::max) / wanted.precision_m;
    over(Limit::Missed, &missed, 1.0 - wanted.pd)
        .or_else(|| over(Limit::False, &|counts| counts.of_empty(), wanted.false_points))
        .or_else(|| {
            over(Limit::Wrong, &|counts| [counts.wrong, counts.echoes], wanted.wrong_points)
        })
        .or_else(|| (rms > 1.0).then_some((Limit::Precision, rms)))
}

/// By what factor more is forecast to be missed at the `worst` range than may be, if it is.
fn missed_at_worst(required: &Requirements, worst: Worst) -> Option<(Limit, f64)> {
    let over = missed(worst.pd, required.wanted.pd);
    (over > 1.0).then_some((Limit::Worst, over))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_that_no_scene_has_do_not_add_up() {
        let sound = Counts {
            pixels: 10,
            echoes: 8,
            found: 7,
            wrong: 1,
            false_points: 2,
            right: 6,
            errors: [0.06, 0.0012],
        };
        assert!(sound.add_up());
        let wrong = [
            Counts { pixels: 0, echoes: 0, found: 0, ..sound },
            Counts { echoes: 11, ..sound },
            Counts { found: 9, ..sound },
            Counts { right: u64::MAX, ..sound },
            Counts { errors: [0.06, -1.0], ..sound },
            Counts { errors: [1.0, 0.0012], ..sound },
            Counts { errors: [f64::NAN, 0.0012], ..sound },
            Counts { errors: [0.0, f64::INFINITY], ..sound },
        ];
        assert_eq!(wrong.map(|counts| counts.add_up()), [false; 8]);
    }
}

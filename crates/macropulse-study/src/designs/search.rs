//! From requirements to lidars: every combination of parts in closed form, then the best of them simulated.

use std::path::Path;

use macropulse::design::Design;
use macropulse::sim::Watch;
use macropulse::units::tof_from_range;
use rayon::prelude::*;

use super::ablation::{ABLATIONS, Ablation, ablations};
use super::candidate::Candidate;
use super::closed::{Assessed, DIM, assess, brightest, shaped};
use super::frontier::Frontier;
use super::parts::Part;
use super::requirements::Requirements;
use super::scenery::Scenery;
use super::trial::{Bench, PIXELS, Trial};
use super::{Error, Limit};

/// Shots of a channel may follow each other as soon as that, s: three marks 8 ns apart fill less.
const SOONEST: f64 = 60e-9;

/// Pulse and bandwidth of coded shots are chosen for shots of a channel that are so far apart, s: sooner, too
/// many meet, as an independent study of such lidars and the trials here show; later, the mirror moves less in
/// a word, and marks are smeared less.
const APART: f64 = 150e-9;

/// Between the least aperture of closed forms, which know of no other light than its own, and the largest that
/// is allowed, the one that does is looked for by so many halves: to a fifteenth where they are 25 and 50 mm.
const HALVINGS: u32 = 3;

/// Apertures are rounded up to so much, m.
const ROUND: f64 = 0.5e-3;

/// All that was found.
#[derive(Debug)]
pub struct Found {
    /// What was required.
    pub required: Requirements,
    /// Every combination of parts that closed forms were asked about.
    pub assessed: Vec<Assessed>,
    /// What was simulated, in the order of marks and beams.
    pub trials: Vec<Trial>,
    /// The best coded lidar, and the best that waits: with the fewest beams, and of those the smallest
    /// aperture. `None` where nothing does.
    pub best: [Option<Trial>; 2],
    /// Up to where each of them goes; `None` if one is missing.
    pub frontier: Option<Frontier>,
    /// What the best coded lidar hangs on.
    pub ablations: Vec<Ablation>,
}

/// How a search is made.
pub struct Search<'a> {
    /// What is required.
    pub required: Requirements,
    /// Folder of the files that keep what was counted.
    pub folder: &'a Path,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Told of every shot that is simulated.
    pub watch: &'a Watch<'a>,
}

impl Search<'_> {
    /// Makes it; `None` if the watch said stop.
    ///
    /// # Errors
    /// If the sensor of the requirements cannot be changed as they ask, or a file cannot be written.
    pub fn run(self) -> Result<Option<Found>, Error> {
        let Self { required, folder, seed, watch } = self;
        let Some(assessed) = assess_all(&required, watch)? else { return Ok(None) };
        let bench = Bench { required: &required, folder, seed, watch };
        let mut trials = Vec::new();
        for &marks in &required.parts.marks {
            let Some(more) = fewest_beams(&bench, &assessed, marks)? else { return Ok(None) };
            trials.extend(more);
        }
        let best = [false, true].map(|waits| best(&trials, waits).cloned());
        let frontier = match &best {
            [Some(coded), Some(waiting)] => {
                Some(Frontier::of(&required, &coded.candidate, &waiting.candidate)?)
            }
            _ => None,
        };
        let ablations = match &best[0] {
            Some(coded) => match ablations(&bench, coded)? {
                Some(ablations) => ablations,
                None => return Ok(None),
            },
            None => Vec::new(),
        };
        Ok(Some(Found { required, assessed, trials, best, frontier, ablations }))
    }
}

impl Requirements {
    /// About how many shots a search simulates, for those who wait for it: of each number of marks as many
    /// trials as halves take, and the ablations.
    pub fn most_shots(&self) -> u64 {
        let halves = u64::from((self.parts.beams.len() + 1).ilog2() + 1 + HALVINGS);
        let trials = halves * self.parts.marks.len() as u64 + ABLATIONS as u64;
        trials * Scenery::ALL.len() as u64 * PIXELS
    }
}

/// Every combination of photodiode, marks and beams that has time enough, in closed form.
fn assess_all(required: &Requirements, watch: &Watch) -> Result<Option<Vec<Assessed>>, Error> {
    let mut combinations: Vec<(&Part, u32)> = Vec::new();
    for part in &required.detectors {
        combinations.extend(required.parts.marks.iter().map(|marks| (part, *marks)));
    }
    let of = |(part, marks): &(&Part, u32)| -> Result<Option<Vec<Assessed>>, Error> {
        if (watch.stop)() { Ok(None) } else { assess_beams(required, part, *marks).map(Some) }
    };
    let all: Vec<Option<Vec<Assessed>>> =
        combinations.par_iter().map(of).collect::<Result<_, _>>()?;
    Ok(all.into_iter().collect::<Option<Vec<_>>>().map(|all| all.concat()))
}

fn assess_beams(required: &Requirements, part: &Part, marks: u32) -> Result<Vec<Assessed>, Error> {
    let beams = &required.parts.beams;
    let Some(&most) = beams.last() else { return Ok(Vec::new()) };
    let pulse =
        USUAL_PULSE.clamp(required.parts.pulse_ps[0] * 1e-12, required.parts.pulse_ps[1] * 1e-12);
    let bandwidth = (part.most_bandwidth_mhz * 1e6).min(0.44 / pulse);
    // When shots are fired does not depend on what they are.
    let aperture = required.parts.aperture_mm[1] * 1e-3;
    let (energy, part) = (DIM, part.clone());
    let words = None;
    let dim = Candidate { part, marks, beams: most, pulse, bandwidth, energy, aperture, words };
    let dim = required.with_shortest_words(dim)?;
    let sample = sample(&dim.unlimited(required)?);
    let time = |beams: u32| required.shortest_period(beams);
    let listens = tof_from_range(required.wanted.range_m);
    // How long the shortest words of such marks last does not depend on the beams.
    let possible = |of: &Candidate| -> Vec<u32> {
        let has_time = |beams: &u32| match marks {
            1 => time(*beams) >= listens,
            _ => {
                (SOONEST..=2.0 * listens).contains(&time(*beams))
                    && required.macropulse(of) <= required.mean_period(*beams)
            }
        };
        beams.iter().copied().filter(has_time).collect()
    };
    let roughly = possible(&dim);
    let apart = if marks == 1 { listens } else { APART };
    let usual = roughly.iter().copied().find(|beams| time(*beams) >= apart);
    let Some(usual) = usual.or(roughly.last().copied()) else {
        // With all beams there are there is not time enough.
        let lacks = if marks == 1 { listens } else { SOONEST } / time(most);
        let (period, limit) = (time(most), Some((Limit::Time, lacks)));
        return Ok(vec![Assessed { candidate: dim, period, pd: 0.0, precision: None, limit }]);
    };
    let dim = shaped(required, &Candidate { beams: usual, ..dim }, sample)?;
    let each = |beams: &u32| {
        assess(required, brightest(required, Candidate { beams: *beams, ..dim.clone() })?)
    };
    possible(&dim).iter().map(each).collect()
}

/// Pulse, s, with which it is looked which beams there is time for.
const USUAL_PULSE: f64 = 0.8e-9;

/// From sample to sample, s.
fn sample(design: &Design) -> f64 {
    design.tdc.tick_fs as f64 * 1e-15
}

/// Simulates candidates of so many marks, with the largest aperture, until it is known with how few beams they
/// do; and those with ever less aperture. By halves: with more beams there is more time between shots, with
/// more aperture more light, and all is easier. `None` if the watch said stop.
fn fewest_beams(
    bench: &Bench,
    assessed: &[Assessed],
    marks: u32,
) -> Result<Option<Vec<Trial>>, Error> {
    let most = |of: &Candidate| bench.required.most_aperture(of.beams).max(of.aperture);
    let candidates = smallest(assessed, marks);
    let with = |candidate: &Candidate, aperture| Candidate { aperture, ..candidate.clone() };
    let mut trials = Vec::new();
    let mut best = None;
    let (mut from, mut to) = (0, candidates.len());
    while from < to {
        let middle = (from + to) / 2;
        let candidate = bench.required.with_best_words(candidates[middle])?;
        let Some(trial) = bench.trial(&with(&candidate, most(&candidate)))? else {
            return Ok(None);
        };
        match trial.limit {
            None => (to, best) = (middle, Some(candidate)),
            Some(_) => from = middle + 1,
        }
        trials.push(trial);
    }
    if let Some(best) = best {
        let (mut least, mut does) = (best.aperture, most(&best));
        for _ in 0..HALVINGS {
            let aperture = ((least * does).sqrt() / ROUND).ceil() * ROUND;
            if aperture >= does {
                break;
            }
            let Some(trial) = bench.trial(&with(&best, aperture))? else { return Ok(None) };
            *(if trial.limit.is_none() { &mut does } else { &mut least }) = aperture;
            trials.push(trial);
        }
    }
    trials.sort_by(|one, other| {
        let apertures = one.candidate.aperture.total_cmp(&other.candidate.aperture);
        one.candidate.beams.cmp(&other.candidate.beams).then(apertures)
    });
    Ok(Some(trials))
}

/// Of each number of beams with so many `marks` the candidate with the smallest aperture that does in closed
/// form; ascending.
fn smallest(assessed: &[Assessed], marks: u32) -> Vec<&Candidate> {
    let does = |one: &&Assessed| one.candidate.marks == marks && one.limit.is_none();
    let mut all: Vec<&Candidate> = assessed.iter().filter(does).map(|one| &one.candidate).collect();
    all.sort_by(|one, other| {
        let apertures = one.aperture.total_cmp(&other.aperture);
        one.beams.cmp(&other.beams).then(apertures)
    });
    all.dedup_by_key(|one| one.beams);
    all
}

/// Of what was simulated and does, the one with the fewest beams, and of those the smallest aperture.
fn best(trials: &[Trial], waits: bool) -> Option<&Trial> {
    let does = |trial: &&Trial| trial.candidate.waits() == waits && trial.limit.is_none();
    trials.iter().filter(does).min_by(|one, other| {
        let apertures = one.candidate.aperture.total_cmp(&other.candidate.aperture);
        one.candidate.beams.cmp(&other.candidate.beams).then(apertures)
    })
}

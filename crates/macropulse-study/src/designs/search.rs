//! From requirements to lidars: every combination of parts in closed form, each with a mirror of its own, then the
//! best of them simulated.

use std::path::Path;

use macropulse::design::Design;
use macropulse::sim::Watch;
use macropulse::units::tof_from_range;
use rayon::prelude::*;

use super::Error;
use super::ablation::{ABLATIONS, Ablation, ablations};
use super::bill::Bill;
use super::candidate::Candidate;
use super::closed::{Assessed, DIM, assess, brightest, shaped, within_scale};
use super::frontier::Frontier;
use super::in_flight::InFlight;
use super::mirrors::{Mirror, mirrors};
use super::parts::Part;
use super::requirements::Requirements;
use super::scenery::Scenery;
use super::trial::{Bench, PIXELS, Trial};

/// Shots of a channel may follow each other as soon as that, s: three marks 8 ns apart fill less.
const SOONEST: f64 = 60e-9;

/// Time between shots of a channel, s, for which pulse and bandwidth of coded shots are chosen. At shorter
/// times too many meet, as an independent study of such lidars and the trials here show. At longer times the
/// mirror moves less in a word, and marks are smeared less.
const APART: f64 = 150e-9;

/// Halvings between the least aperture of closed forms, which ignore the light of others, and the largest
/// that is allowed: to a fifteenth for 25 and 50 mm.
const HALVINGS: u32 = 3;

/// Apertures are rounded up to a multiple of this, m.
const ROUND: f64 = 0.5e-3;

/// Factor by which a mirror must hold more than the aperture of closed forms, as simulations ask for more.
/// Otherwise one with fewer facets is taken, which holds more.
const SPARE: f64 = 1.2;

/// All that was found.
#[derive(Debug)]
pub struct Found {
    /// The requirements.
    pub required: Requirements,
    /// Every combination of parts that closed forms were asked about.
    pub assessed: Vec<Assessed>,
    /// Combinations that are no lidar.
    pub skipped: Vec<Skipped>,
    /// The simulated candidates, in the order of marks and beams.
    pub trials: Vec<Trial>,
    /// The best coded lidar, and the best that waits: with the fewest beams, and of those the smallest
    /// aperture. `None` where nothing does.
    pub best: [Option<Best>; 2],
    /// With how few channels single pulses could do, in closed form; `None` where none waits that does.
    pub in_flight: Option<InFlight>,
    /// Needs of each of them behind every polygon; empty without a polygon.
    pub mirrors: Vec<Mirror>,
    /// Up to where each of them goes; `None` if one is missing.
    pub frontier: Option<Frontier>,
    /// Changes that show what the best coded lidar depends on.
    pub ablations: Vec<Ablation>,
}

/// The best lidar of its kind.
#[derive(Debug, Clone, PartialEq)]
pub struct Best {
    /// Its simulation.
    pub trial: Trial,
    /// Its parts.
    pub bill: Bill,
}

/// A combination of parts that is no lidar, so that nothing is known of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Skipped {
    /// Its photodiode.
    pub part: String,
    /// Marks of a shot.
    pub marks: u32,
    /// Beams.
    pub beams: u32,
    /// Why.
    pub why: String,
}

/// How a search is made.
pub struct Search<'a> {
    /// The requirements.
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
        let Some(Closed { assessed, skipped }) = assess_all(&required, watch)? else {
            return Ok(None);
        };
        let bench = Bench { required: &required, folder, seed, watch };
        let mut trials = Vec::new();
        for &marks in &required.parts.marks {
            let Some(more) = fewest_beams(&bench, &assessed, marks)? else { return Ok(None) };
            trials.extend(more);
        }
        let [coded, waiting] = [false, true].map(|waits| best(&trials, waits));
        let in_flight = match waiting {
            Some(waiting) => InFlight::of(&required, &waiting.candidate)?,
            None => None,
        };
        let mirrors = mirrors(&required, [coded, waiting], in_flight.as_ref());
        let frontier = match (coded, waiting) {
            (Some(coded), Some(waiting)) => {
                Some(Frontier::of(&required, &coded.candidate, &waiting.candidate)?)
            }
            _ => None,
        };
        let ablations = match coded {
            Some(coded) => match ablations(&bench, coded)? {
                Some(ablations) => ablations,
                None => return Ok(None),
            },
            None => Vec::new(),
        };
        let counted = |trial: Option<&Trial>| -> Result<Option<Best>, Error> {
            let Some(trial) = trial else { return Ok(None) };
            let bill = Bill::of(&required, &trial.candidate)?;
            Ok(Some(Best { trial: trial.clone(), bill }))
        };
        let best = [counted(coded)?, counted(waiting)?];
        Ok(Some(Found {
            assessed,
            skipped,
            trials,
            best,
            in_flight,
            mirrors,
            frontier,
            ablations,
            required,
        }))
    }
}

impl Requirements {
    /// Approximate number of shots that a search simulates, for those who wait for it: the trials of all
    /// halvings for each number of marks, and the ablations.
    pub fn most_shots(&self) -> u64 {
        let halves = u64::from((self.parts.beams.len() + 1).ilog2() + 1 + HALVINGS);
        let trials = halves * self.parts.marks.len() as u64 + ABLATIONS as u64;
        trials * Scenery::ALL.len() as u64 * PIXELS
    }
}

/// Assessments of all combinations by closed forms.
#[derive(Debug, Default)]
struct Closed {
    assessed: Vec<Assessed>,
    skipped: Vec<Skipped>,
}

/// Every combination of photodiode, marks and beams, in closed form; `None` if the watch said stop.
fn assess_all(required: &Requirements, watch: &Watch) -> Result<Option<Closed>, Error> {
    let mut combinations: Vec<Combination> = Vec::new();
    for part in &required.detectors {
        let of = |marks: &u32| Combination { required, part, marks: *marks };
        combinations.extend(required.parts.marks.iter().map(of));
    }
    let each: Vec<Closed> = combinations
        .par_iter()
        .map(|combination| match (watch.stop)() {
            true => Closed::default(),
            false => combination.assess(),
        })
        .collect();
    if (watch.stop)() {
        return Ok(None);
    }
    let mut all = Closed::default();
    for one in each {
        all.assessed.extend(one.assessed);
        all.skipped.extend(one.skipped);
    }
    // If no combination is a lidar, the reason is hardly that of one.
    match (all.assessed.is_empty(), all.skipped.first()) {
        (true, Some(Skipped { part, marks, beams, why })) => Err(Error::Asked(format!(
            "{part} with {marks} marks and {beams} beams, as all others, is no lidar: {why}"
        ))),
        _ => Ok(Some(all)),
    }
}

/// A photodiode and a number of marks.
struct Combination<'a> {
    required: &'a Requirements,
    part: &'a Part,
    marks: u32,
}

/// A number of beams, and the mirrors that leave them time enough, those with the most time first.
struct Timed {
    beams: u32,
    mirrors: Vec<Option<u32>>,
}

impl Combination<'_> {
    /// All numbers of beams, in closed form. Combinations that are no lidar are skipped.
    fn assess(&self) -> Closed {
        let mut closed = Closed::default();
        let beams = &self.required.parts.beams;
        let (dim, timed) = match self.timed(&mut closed) {
            Ok(Some(found)) => found,
            Ok(None) => return closed,
            Err(error) => {
                closed.skipped = beams.iter().map(|beams| self.skipped(*beams, &error)).collect();
                return closed;
            }
        };
        for Timed { beams, mirrors } in timed {
            match self.with_best_mirror(&Candidate { beams, ..dim.clone() }, &mirrors) {
                Ok(one) => closed.assessed.push(one),
                Err(error) => closed.skipped.push(self.skipped(beams, &error)),
            }
        }
        closed
    }

    fn skipped(&self, beams: u32, why: &dyn ToString) -> Skipped {
        Skipped { part: self.part.name.clone(), marks: self.marks, beams, why: why.to_string() }
    }

    /// The lidar with the best pulse, and the beams for which there is time; those without go to `closed`. `None` where
    /// there is time with none.
    fn timed(&self, closed: &mut Closed) -> Result<Option<(Candidate, Vec<Timed>)>, Error> {
        let Self { required, part, marks } = *self;
        let [least, most] = required.parts.pulse_ps.map(|ps| ps * 1e-12);
        let pulse = USUAL_PULSE.clamp(least, most);
        let bandwidth = (part.most_bandwidth_mhz * 1e6).min(0.44 / pulse);
        // When shots are fired does not depend on what they are.
        let dim = Candidate {
            part: part.clone(),
            marks,
            beams: required.parts.beams.last().copied().unwrap_or(1),
            facets: required.usual_facets(),
            pulse,
            bandwidth,
            energy: DIM,
            aperture: required.parts.aperture_mm[1] * 1e-3,
            words: None,
            is_late: false,
        };
        let dim = required.with_shortest_words(dim)?;
        let rough = self.possible(&dim, &mut Vec::new());
        let listens = tof_from_range(required.wanted.range_m);
        let apart = if marks == 1 { listens } else { APART };
        let usual = |timed: &Timed| {
            let usual = required.usual_facets();
            let facets = match timed.mirrors.contains(&usual) {
                true => usual,
                false => timed.mirrors.first().copied().flatten(),
            };
            (timed.beams, facets, required.shortest_period(timed.beams, facets))
        };
        let longest = rough.last().map(usual);
        let Some((beams, facets, _)) =
            rough.iter().map(usual).find(|(.., period)| *period >= apart).or(longest)
        else {
            self.possible(&dim, &mut closed.skipped);
            return Ok(None);
        };
        let sample = sample(&dim.unlimited(required)?);
        let dim = shaped(required, &Candidate { beams, facets, ..dim }, sample)?;
        // Longer marks take longer words.
        let timed = self.possible(&dim, &mut closed.skipped);
        Ok(Some((dim, timed)))
    }

    /// The beams for which there is time if they are otherwise as `of`, and why the others are `skipped`.
    fn possible(&self, of: &Candidate, skipped: &mut Vec<Skipped>) -> Vec<Timed> {
        let required = self.required;
        let word = required.macropulse(of);
        let mut all = Vec::new();
        for &beams in &required.parts.beams {
            let period = |facets: &Option<u32>| required.shortest_period(beams, *facets);
            let mean = required.mean_period(beams);
            let mut mirrors = required.mirrors(beams);
            let longest = mirrors.iter().map(period).fold(0.0, f64::max);
            let is_there = !mirrors.is_empty();
            let listens = tof_from_range(required.wanted.range_m);
            let times =
                if self.marks == 1 { listens..=f64::INFINITY } else { SOONEST..=2.0 * listens };
            mirrors.retain(|facets| times.contains(&period(facets)));
            let nanoseconds = |time: f64| format!("{:.0} ns", time * 1e9);
            let why = match mirrors.is_empty() {
                true if !is_there => {
                    "no polygon of the size and speed allowed holds the least aperture".to_owned()
                }
                true if longest > *times.end() => format!(
                    "a code gains nothing: {} between shots, an echo takes {}",
                    nanoseconds(longest),
                    nanoseconds(listens)
                ),
                true => format!(
                    "{} between shots at most, {} needed",
                    nanoseconds(longest),
                    nanoseconds(*times.start())
                ),
                false if word > mean => format!(
                    "words of {} do not fit into {} between shots",
                    nanoseconds(word),
                    nanoseconds(mean)
                ),
                false => {
                    all.push(Timed { beams, mirrors });
                    continue;
                }
            };
            skipped.push(self.skipped(beams, &why));
        }
        all
    }

    /// `dim` behind the mirror that leaves it the most time and still holds the aperture it needs, with some to spare; or
    /// else behind the one that holds most.
    fn with_best_mirror(
        &self,
        dim: &Candidate,
        mirrors: &[Option<u32>],
    ) -> Result<Assessed, Error> {
        let required = self.required;
        let with = |facets: Option<u32>| {
            assess(required, brightest(required, Candidate { facets, ..dim.clone() })?)
        };
        let first = mirrors.first().copied().flatten();
        let one = with(first)?;
        let holds = |facets: &Option<u32>| required.most_aperture(dim.beams, *facets);
        let enough = |facets: &&Option<u32>| holds(facets) >= SPARE * one.candidate.aperture;
        let largest = mirrors.iter().max_by(|one, other| holds(one).total_cmp(&holds(other)));
        match mirrors.iter().find(enough).or(largest) {
            Some(facets) if *facets != first => with(*facets),
            _ => Ok(one),
        }
    }
}

/// Pulse, s, with which it is looked which beams there is time for.
const USUAL_PULSE: f64 = 0.8e-9;

/// From sample to sample, s.
fn sample(design: &Design) -> f64 {
    design.clock.tick_fs as f64 * 1e-15
}

/// Simulates candidates with `marks` marks: with the largest aperture, until the fewest beams that do are
/// known; then those with ever less aperture. By halves: more beams leave more time between shots, more
/// aperture gives more light, and both make it easier. `None` if the watch said stop.
fn fewest_beams(
    bench: &Bench,
    assessed: &[Assessed],
    marks: u32,
) -> Result<Option<Vec<Trial>>, Error> {
    let most = |of: &Candidate| bench.required.most_aperture(of.beams, of.facets).max(of.aperture);
    let candidates = smallest(assessed, marks);
    let with = |candidate: &Candidate, aperture| {
        within_scale(bench.required, Candidate { aperture, ..candidate.clone() })
    };
    let mut trials = Vec::new();
    let mut best = None;
    let (mut from, mut to) = (0, candidates.len());
    while from < to {
        let middle = (from + to) / 2;
        let candidate = bench.required.with_best_words(candidates[middle])?;
        let Some(trial) = bench.trial(&with(&candidate, most(&candidate))?)? else {
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
            let Some(trial) = bench.trial(&with(&best, aperture)?)? else { return Ok(None) };
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

/// The candidate with the smallest aperture that does in closed form, for each number of beams with `marks`
/// marks; ascending.
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

/// The simulated candidate that does with the fewest beams, and among those with the smallest aperture.
fn best(trials: &[Trial], waits: bool) -> Option<&Trial> {
    let does = |trial: &&Trial| trial.candidate.waits() == waits && trial.limit.is_none();
    trials.iter().filter(does).min_by(|one, other| {
        let apertures = one.candidate.aperture.total_cmp(&other.candidate.aperture);
        one.candidate.beams.cmp(&other.candidate.beams).then(apertures)
    })
}

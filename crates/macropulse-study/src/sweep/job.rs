//! One point with one seed, and what is counted of it: a small file that any machine can make.

use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::plan::folder_of_jobs;
use super::{Error, Plan, Point};
use macropulse::digest::Digest;
use macropulse::formats::{self, clear_unfinished, write_atomically};
use macropulse::memory::Estimate;
use macropulse::opened;
use macropulse::points::Outcome;
use macropulse::scene::Scene;
use macropulse::score::{RangeError, Score};
use macropulse::sim::{self as simulated, Scans, Watch};
use macropulse::told;

/// The file that says which sweep a folder holds.
const DESCRIPTION: &str = "sweep.json";

/// One point with one seed.
#[derive(Debug, Clone, Copy)]
pub struct Job<'a> {
    /// The combination of values that is measured.
    pub point: &'a Point,
    /// The seed of its random numbers.
    pub seed: u64,
    pub(super) scene: &'a Scene,
}

/// Counts of a job. All of them are the same on every machine.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Counted {
    /// Name of the job.
    pub job: String,
    /// Its seed.
    pub seed: u64,
    /// How the pixels came out.
    pub score: Score,
    /// Detection events, those of the guard shots included.
    pub detections: u64,
    /// Detection events that found every converter busy.
    pub lost: u64,
    /// Most converters busy at once.
    pub peak_busy: u32,
    /// Range errors of the right points, and of more if they are spread wider.
    pub right: RangeError,
    /// The stage at which the last light was lost, if there is not a single return.
    pub empty: Option<String>,
}

impl Job<'_> {
    /// A hash of all that decides its counts: the program's version, the sensor, the scene, the
    /// part of the scan, the seed. It names the job's file.
    pub fn name(&self) -> String {
        let mut hash = Digest::new();
        for text in [env!("CARGO_PKG_VERSION"), &self.point.text, &self.point.scene.digest] {
            hash.bytes(text.as_bytes());
            hash.bytes(&[0]);
        }
        for band in &self.point.bands {
            hash.bytes(&band.first.to_le_bytes());
            hash.bytes(&band.shots.to_le_bytes());
        }
        hash.bytes(&self.seed.to_le_bytes());
        hash.text()
    }

    /// The memory that it takes to measure.
    ///
    /// # Errors
    /// None for the jobs of a [`Plan`], whose points have been checked.
    pub fn memory(&self) -> Result<Estimate, Error> {
        let estimate = Estimate::in_scene(&self.point.design()?, self.scene);
        Ok(estimate.map_err(simulated::Error::from)?.unwritten())
    }

    /// Measures; `None` if the `watch` said stop before the end.
    ///
    /// # Errors
    /// None for the jobs of a [`Plan`], whose points have been checked.
    pub fn measure(&self, watch: &Watch) -> Result<Option<Counted>, Error> {
        let design = self.point.design()?;
        let mut scans = Scans::new(&design, self.scene, self.seed)?;
        let Some(scan) = scans.part(&self.point.bands, watch)? else { return Ok(None) };
        Ok(Some(Counted {
            job: self.name(),
            seed: self.seed,
            score: scan.score,
            detections: scan.tally.detections,
            lost: scan.tally.lost,
            peak_busy: scan.tally.peak_busy,
            right: RangeError::of_spread(&scan.cloud(), design.right_within),
            empty: scan.tally.where_all_was_lost(&design).map(str::to_owned),
        }))
    }

    fn path(&self, folder: &Path) -> PathBuf {
        folder_of_jobs(folder).join(format!("{}.json", self.name()))
    }

    /// Reads the counts from the file of the job.
    pub(super) fn read(&self, folder: &Path) -> Result<Counted, Error> {
        let path = self.path(folder);
        let refused = |why: &str| {
            let path = path.display();
            Error::Asked(format!("{path}: {why}; delete it, and it is measured again"))
        };
        let text = opened::text(&path).map_err(|error| refused(&error.to_string()))?;
        let counted: Counted = serde_json::from_str(&text)
            .map_err(|error| refused(&format!("is not what was counted of a scan ({error})")))?;
        match counted.job == self.name() && counted.is_possible(self.point.shots) {
            true => Ok(counted),
            false => Err(refused("does not hold what its name says")),
        }
    }
}

impl Counted {
    /// True if the counts agree with each other and with the number of `pixels` measured.
    fn is_possible(&self, pixels: u64) -> bool {
        let Self { score, detections, lost, .. } = self;
        let sum = score.pixels.iter().try_fold(0_u64, |sum, count| sum.checked_add(*count));
        sum == Some(pixels)
            && score.dark <= score.count(Outcome::Missed)
            && score.points_on_target <= score.samples_on_target
            && score.samples_on_target <= pixels
            && lost <= detections
    }
}

impl Plan {
    /// Checks that `folder` is free for this sweep, or holds it already.
    ///
    /// # Errors
    /// If it holds another sweep, or the results of another command.
    pub fn check_folder(&self, folder: &Path) -> Result<(), Error> {
        let place = folder.display();
        let remedy = "choose another folder";
        match opened::text(&folder.join(DESCRIPTION)) {
            Ok(text) if text == self.text() => Ok(()),
            Ok(text) => {
                let other = serde_json::from_str(&text).unwrap_or(Value::Null);
                let varied = other["vary"].as_array().into_iter().flatten();
                let varied: Vec<&str> = varied.filter_map(Value::as_str).collect();
                let of = match varied.is_empty() {
                    true => String::new(),
                    false => format!(" (of {})", varied.join(" and ")),
                };
                Error::asked(format!("{place} holds another sweep{of}; {remedy}"))
            }
            Err(error) if error.kind() == ErrorKind::NotADirectory => {
                Error::asked(format!("{place}: a file is in the way; {remedy}"))
            }
            Err(error) if error.kind() != ErrorKind::NotFound => Error::asked(format!(
                "{place}/{DESCRIPTION} cannot be read: {}; {remedy}",
                told::unreadable(&error)
            )),
            Err(_) if folder.join("manifest.json").exists() => {
                Error::asked(format!("{place} holds the results of another run; {remedy}"))
            }
            Err(_) => Ok(()),
        }
    }

    /// Makes `folder`, if need be, and marks it as that of this sweep. It is not taken away again
    /// if something goes wrong: others may be at work in it.
    ///
    /// # Errors
    /// If it cannot be made or written into.
    pub fn claim_folder(&self, folder: &Path) -> Result<(), Error> {
        let jobs = folder_of_jobs(folder);
        fs::create_dir_all(&jobs).map_err(|cause| {
            Error::Formats(formats::Error::Write { path: folder.to_owned(), cause })
        })?;
        clear_unfinished(folder);
        clear_unfinished(&jobs);
        write_atomically(&folder.join(DESCRIPTION), |out| out.write_all(self.text().as_bytes()))?;
        Ok(())
    }

    fn text(&self) -> String {
        format!("{:#}\n", self.description())
    }

    /// The jobs that are not in `folder` yet, each with its number, from 0.
    pub fn missing(&self, folder: &Path) -> Vec<(usize, Job<'_>)> {
        self.jobs().enumerate().filter(|(_, job)| !job.path(folder).exists()).collect()
    }

    /// Does `jobs` and puts their files into `folder`; `false` if the `watch` said stop before the
    /// end.
    ///
    /// # Errors
    /// If a file cannot be written; those written before it stay.
    pub fn work(&self, folder: &Path, jobs: &[Job], watch: &Watch) -> Result<bool, Error> {
        let work = |job: &Job| -> Result<bool, Error> {
            let Some(counted) = job.measure(watch)? else { return Ok(false) };
            let text = serde_json::to_string_pretty(&counted).unwrap_or_default() + "\n";
            write_atomically(&job.path(folder), |out| out.write_all(text.as_bytes()))?;
            Ok(true)
        };
        // Each job under way holds a design and a cloud: no more of them than threads.
        for some in jobs.chunks(rayon::current_num_threads()) {
            let done = some.par_iter().map(work).collect::<Result<Vec<bool>, _>>()?;
            if done.contains(&false) {
                return Ok(false);
            }
        }
        Ok(true)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sweep::Request;
    use macropulse::design::Design;
    use macropulse::sim;

    #[test]
    fn a_job_counts_what_a_scan_of_that_sensor_counts() {
        let scene = Scene::open("wall").unwrap();
        let plan = Plan::of(&Request {
            sensors: vec!["peregrine".to_owned()],
            scene: "wall".to_owned(),
            set: vec![("scan.flash.rows".to_owned(), "8".to_owned())],
            vary: vec!["scan.max_range_m=20,60".parse().unwrap()],
            seeds: 1..3,
            shots: None,
        })
        .unwrap();
        let unwatched = Watch { done: &|_| {}, stop: &|| false };
        let counted: Vec<Counted> =
            plan.jobs().map(|job| job.measure(&unwatched).unwrap().unwrap()).collect();
        let set = [("scan.flash.rows", "8"), ("scan.max_range_m", "60")];
        let set = set.map(|(key, value)| (key.to_owned(), value.to_owned()));
        let scan = sim::scan(&Design::open("peregrine", &set).unwrap(), &scene, 2, 0).unwrap();
        let wanted = &counted[3];
        assert_eq!(
            (wanted.seed, wanted.score, wanted.detections),
            (2, scan.score, scan.tally.detections)
        );
        assert_eq!(wanted.right, RangeError::of(&scan.cloud()));
        assert!(wanted.right.count > 1000 && wanted.right != counted[2].right);
        // The wall is 50 m away.
        assert!(counted[0].empty.as_ref().unwrap().contains("range gate"));
        assert_eq!(wanted.empty, None);
        assert!(counted.iter().all(|counted| counted.is_possible(8 * 128)));
        let stopped = Watch { done: &|_| {}, stop: &|| true };
        assert_eq!(plan.jobs().next().unwrap().measure(&stopped).unwrap(), None);
    }
}

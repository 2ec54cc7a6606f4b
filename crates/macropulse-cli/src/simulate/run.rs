//! One sensor's run through its scans.

use std::time::Instant;

use macropulse::design::Design;
use macropulse::emit::{Band, bands};
use macropulse::formats::{Format, Manifest, State};
use macropulse::points::Truth;
use macropulse::scene::Scene;
use macropulse::score::Score;
use macropulse::sim::{Record, Scans, Stretch, Tally, Watch};
use macropulse_study::record::{self, COLOUR, PAGE, Page, Pixel, PixelExplanation};
use serde_json::Value;

use super::recorded::{RecordFiles, Recorded};
use super::scenario::Scenario;
use crate::explain;
use crate::fault::Fault;
use crate::folder::Folder;
use crate::interrupt::Interrupt;
use crate::options::Common;
use crate::progress::Progress;
use crate::text::warn;

/// A run that is over, with all that was counted.
pub struct Run<'a> {
    pub design: &'a Design,
    pub scene: &'a Scene,
    pub seed: u64,
    pub state: State,
    /// Scans done; fewer than wanted after Ctrl-C.
    pub scans: u64,
    pub score: Score,
    pub tally: Tally,
    /// Wall-clock time, s.
    pub elapsed: f64,
    /// Wall-clock time of that for writing files, s.
    pub writing: f64,
    /// Folder and names of the files; empty if none were wanted.
    pub folder: String,
    pub files: Vec<String>,
    /// Explanations of pixels, for people and for programs.
    pub explained: Vec<(String, Value)>,
    /// Warnings to the user.
    pub warnings: Vec<String>,
    /// True once the manifest of this run is on the disk.
    is_announced: bool,
}

impl<'a> Run<'a> {
    /// Simulates and writes scan after scan, and the manifest at the end. If that fails, a manifest that is
    /// there already says so.
    pub fn of(
        design: &'a Design,
        scenario: &'a Scenario,
        mut folder: Option<Folder>,
        about: (&Common, &Interrupt),
    ) -> Result<Self, Fault> {
        let mut run = Self::new(design, scenario);
        match run.work(scenario, &mut folder, about) {
            Ok(()) => Ok(run),
            Err(fault) => {
                run.state = State::Failed;
                if let Some(folder) = folder.as_ref().filter(|_| run.is_announced) {
                    // The first failure is the one to be told.
                    let _ = run.manifest().write(folder.path());
                }
                Err(fault)
            }
        }
    }

    fn work(
        &mut self,
        scenario: &'a Scenario,
        folder: &mut Option<Folder>,
        (common, interrupt): (&Common, &Interrupt),
    ) -> Result<(), Fault> {
        let design = self.design;
        let shots = scenario.scans * design.shots_per_scan();
        let progress = Progress::of(common, &design.name, shots);
        let began = Instant::now();
        let mut page = scenario.has_page.then(|| Page::new(design, Some(&scenario.scene)));
        let mut scans = Scans::new(design, &scenario.scene, scenario.seed)?;
        let stage = (design, Some(&scenario.scene));
        let kept = scenario.records.of(design).map_err(Fault::Wrong)?;
        let mut recorded = folder
            .as_ref()
            .map(|folder| record::Files::new(folder.path(), &scenario.formats, stage));
        while self.scans < scenario.scans && !interrupt.is_raised() {
            let watch =
                Watch { done: &|shots| progress.add(shots), stop: &|| interrupt.is_raised() };
            let record = match (&mut *folder, kept) {
                (Some(folder), Some(kept)) => {
                    if self.scans == 0 {
                        folder.make()?;
                    }
                    let recorded = Recorded { design, number: self.scans, kept };
                    Some(RecordFiles::begin(folder.path(), recorded, (&scans, &scenario.scene))?)
                }
                _ => None,
            };
            let keep = |given: &Record| {
                record.iter().for_each(|files| files.take(given));
            };
            let Some(scan) = scans.scan_kept(self.scans, &watch, &keep)? else { break };
            self.score.add(&scan.score);
            self.tally.add(&scan.tally);
            if let (Some(folder), Some(recorded)) = (&mut *folder, &mut recorded) {
                let writing = Instant::now();
                let mut cloud = scan.cloud();
                if let Some(page) = &mut page {
                    page.add(&cloud);
                }
                if !scenario.truth {
                    cloud.truth = Truth::default();
                }
                let files = interrupt.undisturbed(|| {
                    if self.scans == 0 {
                        if kept.is_none() {
                            folder.make()?;
                        }
                        self.announce(folder)?;
                    }
                    let record = record.map(RecordFiles::finish).transpose()?.unwrap_or_default();
                    let files = recorded.add(&cloud)?;
                    folder.keep();
                    Ok::<_, Fault>((files, record))
                })?;
                self.files.extend(files.0);
                self.files.extend(files.1);
                self.writing += writing.elapsed().as_secs_f64();
            }
            self.scans += 1;
        }
        if let Some(recorded) = recorded {
            interrupt.undisturbed(|| recorded.finish())?;
        }
        self.elapsed = began.elapsed().as_secs_f64();
        if self.scans > 0 {
            self.explain(&scans, &scenario.explain, folder.as_ref())?;
        }
        progress.finish();
        self.state = match self.scans < scenario.scans {
            true => State::Stopped,
            false => State::Finished,
        };
        self.find_warnings(scenario, folder.as_ref(), common);
        if let (Some(folder), 1..) = (&*folder, self.scans) {
            self.folder = folder.path().display().to_string();
            self.files.extend(page.as_ref().map(|_| PAGE.to_owned()));
            interrupt.undisturbed(|| {
                let mut manifest = self.manifest();
                if let Some(page) = page {
                    // It tells nothing of each scan, and a hundred thousand as JSON values are 200 MB.
                    let scans = std::mem::take(&mut manifest.scans);
                    page.write(folder.path(), &manifest.value())?;
                    manifest.scans = scans;
                }
                manifest.write(folder.path())
            })?;
        }
        Ok(())
    }

    /// Explains the shots of the first scan to `pixels`.
    fn explain(
        &mut self,
        scans: &Scans,
        pixels: &[Pixel],
        folder: Option<&Folder>,
    ) -> Result<(), Fault> {
        for pixel in pixels {
            let is_there =
                |band: &Band| explain::shot_of(&band.shot_log(self.design), *pixel).is_some();
            let band = bands(self.design, 0).find(is_there);
            let record = band.map(|band| (scans.record(&band), band));
            let shot = record.as_ref().and_then(|((log, _), _)| explain::shot_of(log, *pixel));
            let (Some(((log, given), band)), Some(shot)) = (record, shot) else {
                self.warnings.push("a pixel of --explain has no shot".to_owned());
                continue;
            };
            let arrivals = |stretch: &Stretch| Some(scans.arrivals(&band, stretch));
            let explained = PixelExplanation::new(self.design, (&log, &given), shot, arrivals)?;
            if let Some(folder) = folder {
                self.files.extend(explained.write(folder.path(), self.design)?);
            }
            self.explained.push((explained.text(), explained.summary()));
        }
        Ok(())
    }

    /// Writes the manifest of a run that has no file yet. It replaces the manifest of an older run, whose
    /// files this one is about to replace, and names the files that stay.
    fn announce(&mut self, folder: &Folder) -> Result<(), Fault> {
        let mut manifest = self.manifest();
        manifest.warnings.extend(folder.warning_of_older(&[]));
        manifest.write(folder.path())?;
        self.is_announced = true;
        Ok(())
    }

    fn new(design: &'a Design, scenario: &'a Scenario) -> Self {
        Self {
            design,
            scene: &scenario.scene,
            seed: scenario.seed,
            state: State::Running,
            scans: 0,
            score: Score::default(),
            tally: Tally::default(),
            elapsed: 0.0,
            writing: 0.0,
            folder: String::new(),
            files: Vec::new(),
            explained: Vec::new(),
            is_announced: false,
            warnings: record::warnings(design, &scenario.scene),
        }
    }

    /// Adds what came to light during the run, and says it at once: it must not go under.
    fn find_warnings(&mut self, scenario: &Scenario, folder: Option<&Folder>, common: &Common) {
        let wanted = scenario.scans;
        let mut wrong = Vec::new();
        if self.scans < wanted {
            wrong.push(format!("stopped by Ctrl-C after {} of {wanted} scans", self.scans));
        }
        if self.scans > 0
            && let Some(reason) = self.tally.where_all_was_lost(self.design)
        {
            wrong.push(format!("not a single point: {reason}"));
        }
        let mut found = Vec::new();
        for format in scenario.formats.iter().filter(|_| scenario.truth) {
            let left_out = format.leaves_out_of_truth(self.design.emission.model().sees_motion());
            if !left_out.is_empty() {
                let (name, left_out) = (format.name(), left_out.join(", "));
                found.push(format!("{name} cannot hold {left_out}: left out in spite of --truth"));
            }
        }
        let painted = self.files.iter().any(|file| file.ends_with(COLOUR));
        if scenario.formats.contains(&Format::Png) && !self.files.is_empty() && !painted {
            found.push(
                "too many pixels for a picture in colour; there is the 16-bit one".to_owned(),
            );
        }
        if !self.design.scan.has_image()
            && scenario.formats.iter().any(|format| format.is_range_image())
            && !self.files.is_empty()
        {
            found.push(
                "its directions are no rows and columns of an image: a range image of it is a strip, \
                 shot after shot; index.html shows the cloud in space"
                    .to_owned(),
            );
        }
        found.extend(folder.and_then(|folder| folder.warning_of_older(&self.files)));
        let named = |warning: &String| format!("{}: {warning}", self.design.name);
        wrong.iter().for_each(|warning| warn(&named(warning)));
        found.iter().for_each(|warning| common.note(&named(warning)));
        self.warnings.extend(wrong.into_iter().chain(found));
    }

    /// Returns the manifest: the data to repeat the run and to judge it.
    pub fn manifest(&self) -> Manifest {
        record::manifest(&record::Run {
            state: self.state,
            design: self.design,
            scene: self.scene,
            seed: self.seed,
            scans: self.scans,
            tally: &self.tally,
            score: &self.score,
            files: &self.files,
            warnings: &self.warnings,
            writing: self.writing,
            elapsed: self.elapsed,
        })
    }

    /// Stages with the seconds of processor time they took, summed over threads; writing in wall
    /// time.
    pub fn stages(&self) -> impl Iterator<Item = (&'static str, f64)> {
        Tally::STAGES.into_iter().zip(self.tally.seconds).chain([("write", self.writing)])
    }

    /// The time of the sensor over ours.
    pub fn speed(&self) -> f64 {
        let shots = self.scans * self.design.shots_per_scan();
        self.design.speed(shots as f64, self.elapsed.max(1e-9))
    }
}

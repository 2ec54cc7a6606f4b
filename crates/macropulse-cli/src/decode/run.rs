//! Band after band, from ticks to files.

use std::ops::ControlFlow;
use std::time::Instant;

use macropulse::channel::Operating;
use macropulse::codec::decode::Reject;
use macropulse::design::Design;
use macropulse::environment::Environment;
use macropulse::formats::{Format, State, write_csv_lines, write_manifest};
use macropulse::points::{PointCloud, Scale};
use macropulse_study::decoding::{Band, Decoding};
use macropulse_study::record::{self, Decoded, PAGE, Page, Pixel, PixelExplanation};
use serde_json::Value;

use crate::explain;
use crate::fault::Fault;
use crate::folder::Folder;
use crate::interrupt::Interrupt;
use crate::options::Common;
use crate::progress::Progress;
use crate::text::{pour, warn};

/// Destination of the points.
pub enum Sink {
    /// They are only counted.
    Nothing,
    /// Lines of CSV on stdout, as they are decided.
    Lines,
    /// Files of each scan in these formats, and a page if that is wanted.
    Folder(Folder, Vec<Format>, bool),
}

/// Sensor and environment of a run.
#[derive(Clone, Copy)]
pub struct Setting<'a> {
    pub design: &'a Design,
    pub environment: &'a Environment,
    pub operating: &'a Operating,
}

/// A run that decodes, with all that is counted.
pub struct Run<'a> {
    pub setting: Setting<'a>,
    pub inputs: [String; 2],
    pub state: State,
    pub scans: u64,
    pub shots: u64,
    /// Ticks, or samples of all channels.
    pub recorded: u64,
    pub returns: u64,
    pub rejects: [u64; Reject::ALL.len()],
    pub elapsed: f64,
    pub folder: String,
    pub files: Vec<String>,
    pub warnings: Vec<String>,
    /// True once the manifest of this run is on the disk.
    is_announced: bool,
    /// True once the reader of stdout has closed its end.
    has_lost_reader: bool,
    /// True if stdout has the points.
    pub is_streamed: bool,
    /// Pixels to be explained.
    asked: Vec<Pixel>,
    /// Explanations of pixels, for people and for programs.
    pub explained: Vec<(String, Value)>,
    has_header: bool,
}

impl<'a> Run<'a> {
    pub fn new(setting: Setting<'a>, inputs: [String; 2], asked: Vec<Pixel>) -> Self {
        Self {
            setting,
            inputs,
            state: State::Running,
            scans: 0,
            shots: 0,
            recorded: 0,
            returns: 0,
            rejects: Default::default(),
            elapsed: 0.0,
            folder: String::new(),
            files: Vec::new(),
            warnings: Vec::new(),
            is_announced: false,
            has_lost_reader: false,
            is_streamed: false,
            asked,
            explained: Vec::new(),
            has_header: false,
        }
    }

    /// Decodes all that comes, and puts it where it belongs. If that fails, a manifest that is there already
    /// says so.
    pub fn through(
        mut self,
        decoding: Decoding,
        mut sink: Sink,
        about: (&Common, &Interrupt),
    ) -> Result<Self, Fault> {
        match self.work(decoding, &mut sink, about) {
            Ok(()) => Ok(self),
            Err(fault) => {
                self.state = State::Failed;
                if let Sink::Folder(folder, ..) = &sink
                    && self.is_announced
                {
                    // The first failure is the one to report.
                    let _ = write_manifest(&format!("{:#}\n", self.manifest()), folder.path());
                }
                Err(fault)
            }
        }
    }

    fn work(
        &mut self,
        mut decoding: Decoding,
        sink: &mut Sink,
        (common, interrupt): (&Common, &Interrupt),
    ) -> Result<(), Fault> {
        let began = Instant::now();
        let Setting { design, operating, .. } = self.setting;
        self.is_streamed = matches!(sink, Sink::Lines);
        let progress = Progress::of(common, &design.name, design.shots_per_scan());
        let mut recorded = match sink {
            Sink::Folder(folder, formats, _) => {
                Some(record::Files::new(folder.path(), formats, (design, None)))
            }
            _ => None,
        };
        let mut page = matches!(sink, Sink::Folder(.., true)).then(|| Page::new(design, None));
        let scale = Scale::of(design, operating);
        while let Some(cloud) = decoding.next_scan((design, &scale), |band| {
            progress.add(band.log.owned.len() as u64);
            self.take(band, sink)?;
            Ok::<_, Fault>(match interrupt.is_raised() || self.has_lost_reader {
                true => ControlFlow::Break(()),
                false => ControlFlow::Continue(()),
            })
        })? {
            self.scans += 1;
            if let (Sink::Folder(folder, ..), Some(recorded)) = (&mut *sink, &mut recorded) {
                if let Some(page) = &mut page {
                    page.add(&cloud);
                }
                let files = interrupt.undisturbed(|| {
                    folder.make_once()?;
                    if self.scans == 1 {
                        self.announce(folder)?;
                    }
                    let files = recorded.add(&cloud)?;
                    folder.keep();
                    Ok::<_, Fault>(files)
                })?;
                self.files.extend(files);
            }
        }
        if let Some(recorded) = recorded {
            interrupt.undisturbed(|| recorded.finish())?;
        }
        progress.finish();
        self.elapsed = began.elapsed().as_secs_f64();
        self.state = match interrupt.is_raised() {
            true => State::Stopped,
            false => State::Finished,
        };
        if self.has_lost_reader {
            return Ok(());
        }
        self.find_warnings(sink, common);
        if let (Sink::Folder(folder, ..), 1..) = (&*sink, self.scans) {
            self.folder = folder.path().display().to_string();
            self.files.extend(page.as_ref().map(|_| PAGE.to_owned()));
            interrupt.undisturbed(|| {
                let manifest = self.manifest();
                if let Some(page) = page {
                    page.write(folder.path(), &manifest)?;
                }
                write_manifest(&format!("{manifest:#}\n"), folder.path())
            })?;
        }
        Ok(())
    }

    /// Writes the manifest of a run that has no file yet, in place of that of an older one.
    fn announce(&mut self, folder: &Folder) -> Result<(), Fault> {
        let mut manifest = self.manifest();
        if let (Some(older), Some(said)) =
            (folder.warning_of_older(&[]), manifest["warnings"].as_array_mut())
        {
            said.push(older.into());
        }
        write_manifest(&format!("{manifest:#}\n"), folder.path())?;
        self.is_announced = true;
        Ok(())
    }

    /// Counts a band, explains what is asked for of it, and prints its points where they are to be.
    fn take(&mut self, band: &Band, sink: &mut Sink) -> Result<(), Fault> {
        self.shots += band.log.owned.len() as u64;
        self.recorded += band.given.len() as u64;
        self.returns += band.returns.len() as u64;
        let rejects = self.rejects.iter_mut().zip(band.returns.rejects);
        rejects.for_each(|(sum, more)| *sum += more);
        for pixel in &self.asked {
            let shot = explain::shot_of(&band.log, *pixel);
            let Some(shot) = shot else { continue };
            let given = (&band.log, &band.given);
            let design = self.setting.design;
            let explained = PixelExplanation::new(design, given, shot, |_| None)?;
            if let Sink::Folder(folder, ..) = sink {
                folder.make_once()?;
                self.files.extend(explained.write(folder.path(), design)?);
                folder.keep();
            }
            self.explained.push((explained.text(), explained.summary()));
        }
        match sink {
            Sink::Lines => self.print(&band.piece.points),
            Sink::Nothing | Sink::Folder(..) => Ok(()),
        }
    }

    /// Writes the points of a band to stdout.
    fn print(&mut self, points: &PointCloud) -> Result<(), Fault> {
        let mut lines = Vec::new();
        write_csv_lines(points, !self.has_header, &mut lines)
            .map_err(|error| Fault::unprinted(&error))?;
        self.has_header = true;
        self.has_lost_reader = !pour(&lines)?;
        Ok(())
    }

    /// Finds the warnings, and prints them at once.
    fn find_warnings(&mut self, sink: &Sink, common: &Common) {
        if self.returns == 0 && self.shots > 0 {
            let reason = match self.recorded {
                0 => {
                    "nothing was recorded in the time in which light of the shots may come: are both of one recording?"
                }
                _ => "the receiver found none of the macropulses; --explain ROW,COLUMN says why",
            };
            self.warnings.push(format!("not a single point: {reason}"));
        }
        let found = self.explained.len();
        if self.asked.len() > found {
            self.warnings.push("a pixel of --explain has no shot in the log".to_owned());
        }
        self.warnings.iter().for_each(|warning| warn(warning));
        if let Sink::Folder(folder, ..) = sink
            && let Some(older) = folder.warning_of_older(&self.files)
        {
            common.note(&older);
            self.warnings.push(older);
        }
    }

    /// Returns the manifest: the data to repeat the run, and its counts.
    pub fn manifest(&self) -> Value {
        let [shots, record] = &self.inputs;
        let decoded = Decoded {
            design: self.setting.design,
            environment: self.setting.environment,
            inputs: [shots, record],
            state: self.state,
            scans: self.scans,
            shots: self.shots,
            recorded: self.recorded,
            returns: self.returns,
            rejects: self.rejects,
            warnings: &self.warnings,
            files: &self.files,
            elapsed: self.elapsed,
        };
        decoded.manifest()
    }
}

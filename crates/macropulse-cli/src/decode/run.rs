//! Band after band, from ticks to files.

use std::io::{ErrorKind, Write};
use std::time::Instant;

use macropulse::channel::{Link, Operating};
use macropulse::codec::decode::{Reject, Returns};
use macropulse::codec::{ShotLog, Ticks};
use macropulse::design::Design;
use macropulse::emit::Band;
use macropulse::formats::write_csv_lines;
use macropulse::points::{Piece, PointCloud, Truth, Viewpoint};
use macropulse_study::record;
use rayon::prelude::*;
use serde_json::Value;

use super::input::Input;
use crate::explain::{self, Pixel};
use crate::fault::{Fault, warn};
use crate::folder::Folder;
use crate::interrupt::Interrupt;
use crate::options::Common;
use crate::progress::Progress;
use crate::simulate::formats::Formats;

/// Where the points go.
pub enum Sink {
    /// They are only counted.
    Nothing,
    /// Lines of CSV on stdout, as they are decided.
    Lines,
    /// Files of each scan.
    Folder(Folder, Formats),
}

/// A run that decodes, with all that is counted.
pub struct Run<'a> {
    pub design: &'a Design,
    operating: &'a Operating,
    pub scans: u64,
    pub shots: u64,
    pub ticks: u64,
    pub returns: u64,
    pub rejects: [u64; Reject::ALL.len()],
    pub elapsed: f64,
    pub folder: String,
    pub files: Vec<String>,
    pub warnings: Vec<String>,
    /// Whether stdout has the points.
    pub is_streamed: bool,
    /// Pixels to be explained.
    asked: Vec<Pixel>,
    /// What was explained, for people and for programs.
    pub explained: Vec<(String, Value)>,
    viewpoint: Viewpoint,
    /// The scan under way, and its points so far.
    number: u64,
    pieces: Vec<Piece>,
    /// Its files, from the first one on.
    recorded: Option<record::Files<'a>>,
    has_header: bool,
}

/// A band that is decoded.
struct Decoded {
    log: ShotLog,
    ticks: Ticks,
    returns: Returns,
    piece: Piece,
}

impl Decoded {
    fn of(
        (log, ticks): (ShotLog, Ticks),
        (design, link): (&Design, &Link),
    ) -> Result<Self, String> {
        let returns = design.receiver.decode(&design.coding.codebook, &log, &ticks);
        let returns = returns.map_err(|error| error.to_string())?;
        let piece = Piece::of(design, link, &log, &returns);
        Ok(Self { log, ticks, returns, piece })
    }
}

impl<'a> Run<'a> {
    pub fn new(design: &'a Design, operating: &'a Operating, asked: Vec<Pixel>) -> Self {
        Self {
            design,
            operating,
            scans: 0,
            shots: 0,
            ticks: 0,
            returns: 0,
            rejects: Default::default(),
            elapsed: 0.0,
            folder: String::new(),
            files: Vec::new(),
            warnings: Vec::new(),
            is_streamed: false,
            asked,
            explained: Vec::new(),
            viewpoint: Viewpoint::default(),
            number: 0,
            pieces: Vec::new(),
            recorded: None,
            has_header: false,
        }
    }

    /// Decodes all that comes, and puts it where it belongs.
    pub fn through(
        mut self,
        mut input: Input,
        mut sink: Sink,
        (common, interrupt): (&Common, &Interrupt),
    ) -> Result<Self, Fault> {
        let began = Instant::now();
        let design = self.design;
        (self.viewpoint.position, self.viewpoint.turn) = input.pose;
        self.is_streamed = matches!(sink, Sink::Lines);
        let progress = Progress::of(common, &design.name, design.shots_per_scan());
        // What comes as it is made is decoded as it comes.
        let together = if input.is_live { 1 } else { 2 * rayon::current_num_threads() };
        let mut is_over = false;
        while !is_over && !interrupt.is_raised() {
            let mut bands = Vec::new();
            while bands.len() < together && !is_over {
                let until = |shot: u64| Band::of_shot(design, shot).end(design);
                match input.stream.next_band(until).map_err(|error| input.fault(&error))? {
                    Some(band) => bands.push(band),
                    None => is_over = true,
                }
            }
            let link = &self.operating.link;
            let decoded: Vec<Result<Decoded, _>> =
                bands.into_par_iter().map(|band| Decoded::of(band, (design, link))).collect();
            for band in decoded {
                let band = band.map_err(|error| input.wrong(&error))?;
                progress.add(band.log.owned.len() as u64);
                self.take(band, &mut sink, interrupt)?;
            }
        }
        if !interrupt.is_raised() {
            self.end_scan(&mut sink, interrupt)?;
        }
        if let Some(recorded) = self.recorded.take() {
            interrupt.undisturbed(|| recorded.finish())?;
        }
        progress.finish();
        self.elapsed = began.elapsed().as_secs_f64();
        if self.shots == 0 && !interrupt.is_raised() {
            return Err(input.wrong("there is not a single shot whose returns are wanted"));
        }
        self.find_warnings();
        Ok(self)
    }

    /// Counts a band and keeps its points.
    fn take(&mut self, band: Decoded, sink: &mut Sink, interrupt: &Interrupt) -> Result<(), Fault> {
        let scan = band.piece.points.scan;
        if scan != self.number {
            self.end_scan(sink, interrupt)?;
            self.number = scan;
        }
        self.shots += band.log.owned.len() as u64;
        self.ticks += band.ticks.len() as u64;
        self.returns += band.returns.len() as u64;
        let rejects = self.rejects.iter_mut().zip(band.returns.rejects);
        rejects.for_each(|(sum, more)| *sum += more);
        for pixel in &self.asked {
            let shot = explain::shot_of(&band.log, *pixel);
            let Some(shot) = shot else { continue };
            let explained = explain::Explained::of(self.design, (&band.log, &band.ticks), shot)?;
            self.explained.push((explained.text(), explained.json()));
            if let Sink::Folder(folder, _) = sink {
                folder.make_once()?;
                self.files.extend(explained.write(folder.path())?);
                folder.keep();
            }
        }
        match sink {
            Sink::Nothing => {}
            Sink::Lines => self.print(&band.piece.points)?,
            Sink::Folder(..) => self.pieces.push(band.piece),
        }
        Ok(())
    }

    /// Writes the points of a band to stdout.
    fn print(&mut self, points: &PointCloud) -> Result<(), Fault> {
        let mut out = std::io::stdout().lock();
        let written = write_csv_lines(points, !self.has_header, &mut out);
        self.has_header = true;
        match written.and_then(|()| out.flush()) {
            // A reader who has seen enough is no fault.
            Err(error) if error.kind() == ErrorKind::BrokenPipe => Err(Fault::Told),
            Err(error) => Err(Fault::Ours(format!("cannot write to stdout: {error}"))),
            Ok(()) => Ok(()),
        }
    }

    /// Writes the files of the scan under way.
    fn end_scan(&mut self, sink: &mut Sink, interrupt: &Interrupt) -> Result<(), Fault> {
        if self.shots > 0 {
            self.scans += 1;
        }
        let pieces = std::mem::take(&mut self.pieces);
        let Sink::Folder(folder, formats) = sink else { return Ok(()) };
        if pieces.is_empty() {
            return Ok(());
        }
        let frame =
            PointCloud { viewpoint: self.viewpoint, ..PointCloud::empty(self.design, self.number) };
        let mut cloud = PointCloud::joined(&frame, &pieces);
        // Nothing is known of a scene.
        cloud.truth = Truth::default();
        let stage = (self.design, None);
        let recorded = || record::Files::new(folder.path(), &formats.0, stage);
        let recorded = self.recorded.get_or_insert_with(recorded);
        let files = interrupt.undisturbed(|| {
            folder.make_once()?;
            let files = recorded.add(&cloud)?;
            folder.keep();
            Ok::<_, Fault>(files)
        })?;
        self.folder = folder.path().display().to_string();
        self.files.extend(files);
        Ok(())
    }

    /// What its user should know, said at once.
    fn find_warnings(&mut self) {
        if self.returns == 0 && self.shots > 0 {
            let reason = match self.ticks {
                0 => {
                    "no tick lies in the time in which light of the shots may come: are both of one recording?"
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
    }
}

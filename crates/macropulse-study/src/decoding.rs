//! Points out of recorded shots and ticks, samples or histograms, without a scene: from files, streams, or hardware.

use std::collections::VecDeque;
use std::fmt;
use std::io::{self, Read};
use std::ops::ControlFlow;
use std::path::Path;

use macropulse::codec::decode::{self, Returns};
use macropulse::codec::files::{
    self, Digest, RecordReader, SampleReader, ShotHeader, ShotReader, Stream, TickReader, What,
};
use macropulse::codec::{Given, RecordKind, ShotLog};
use macropulse::design::Design;
use macropulse::emit;
use macropulse::opened;
use macropulse::points::{Piece, PointCloud, Scale, Truth, Viewpoint};
use rayon::prelude::*;

/// Why recorded shots and ticks, samples or histograms cannot be decoded.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The world would not give a file.
    #[error("{name}: cannot be read: {cause}")]
    Unreadable {
        /// The file as it was named.
        name: String,
        /// Error of the operating system.
        cause: io::Error,
    },
    /// A file says something that cannot be.
    #[error("{name}: {cause}")]
    Invalid {
        /// The file as it was named.
        name: String,
        /// Where, and what.
        cause: files::Error,
    },
    /// A file is of another sensor.
    #[error(
        "{name}: is of another sensor: its code, timing or pixels have the digest {found}, those of \
         {sensor} {wanted}; name the sensor it was recorded with, and the same --set"
    )]
    OfAnother {
        /// The file as it was named.
        name: String,
        /// The digest in it.
        found: Digest,
        /// Name of the sensor that was to decode it.
        sensor: String,
        /// The digest of that one.
        wanted: Digest,
    },
    /// The receiver refuses them.
    #[error("{names}: {cause}")]
    Refused {
        /// Both files as they were named.
        names: Names,
        /// Why.
        cause: decode::Error,
    },
    /// There is nothing to decode.
    #[error("{names}: there is not a single shot whose returns are wanted")]
    NoShot {
        /// Both files as they were named.
        names: Names,
    },
}

/// Names of the shots and of their record (ticks, samples or histograms) in messages.
#[derive(Debug, Clone)]
pub struct Names([String; 2]);

impl fmt::Display for Names {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [shots, record] = &self.0;
        write!(f, "{shots} and {record}")
    }
}

/// Source of shots or of their record.
pub struct Input {
    /// Name in messages.
    pub name: String,
    /// Bytes to read.
    pub bytes: Box<dyn Read + Send>,
    /// True if the input comes while it is recorded; each band is then decoded as it comes.
    pub is_live: bool,
}

impl Input {
    /// The file at `path`.
    ///
    /// # Errors
    /// [`Error::Unreadable`] if it is no file that can be opened.
    pub fn open(path: &Path) -> Result<Self, Error> {
        let name = path.display().to_string();
        match opened::stream(path) {
            Ok(stream) => Ok(Self { name, bytes: Box::new(stream), is_live: false }),
            Err(cause) => Err(Error::Unreadable { name, cause }),
        }
    }
}

/// A band that is decoded.
#[derive(Debug)]
pub struct Band {
    /// Its shots.
    pub log: ShotLog,
    /// Record of the converters.
    pub given: Given,
    /// Returns that the receiver decoded from both.
    pub returns: Returns,
    /// Points of the returns.
    pub piece: Piece,
}

impl Band {
    fn of(
        (log, given): (ShotLog, Given),
        (design, scale): (&Design, &Scale),
    ) -> Result<Self, decode::Error> {
        let returns = design.receive(&log, &given)?;
        let piece = Piece::of(design, scale, &log, &returns);
        Ok(Self { log, given, returns, piece })
    }
}

/// Shots and their record that are decoded, scan after scan, in the memory of one.
pub struct Decoding {
    stream: Stream<Box<dyn Read + Send>, Box<dyn Read + Send>>,
    names: Names,
    viewpoint: Viewpoint,
    /// Bands that are decoded together.
    together: usize,
    /// Those decoded that belong to a scan to come.
    waiting: VecDeque<Band>,
    shots: u64,
    is_over: bool,
}

impl Decoding {
    /// Starts to decode `shots` and their `record`, both of the sensor `design`.
    ///
    /// # Errors
    /// [`Error::Invalid`] if one is no such file, [`Error::OfAnother`] if it is of another sensor.
    pub fn open(design: &Design, shots: Input, record: Input) -> Result<Self, Error> {
        let is_live = shots.is_live || record.is_live;
        let names = Names([shots.name, record.name]);
        let invalid = |cause| invalid(&names, cause);
        let shots = ShotReader::new(shots.bytes, design.limits()).map_err(invalid)?;
        let ShotHeader { position, turn, digest: of_shots, .. } = *shots.header();
        let (cut, channels) = (design.cut(), design.channels());
        let (stream, of_record) = if let Some(wanted) = design.sample_header() {
            let samples = SampleReader::new(record.bytes, &wanted).map_err(invalid)?;
            let digest = samples.header().digest;
            (Stream::of_samples(cut, shots, samples), digest)
        } else if let Some(wanted) = design.blank_record().as_ref().and_then(Given::of_shots) {
            let records = RecordReader::new(record.bytes, wanted).map_err(invalid)?;
            let digest = records.header().digest;
            (Stream::of_records(cut, shots, records), digest)
        } else {
            let tick_fs = design.clock.tick_fs;
            let ticks = TickReader::new(record.bytes, tick_fs, channels).map_err(invalid)?;
            let digest = ticks.header().digest;
            (Stream::new(cut, shots, ticks, channels > 1), digest)
        };
        let wanted = design.recorded_digest();
        for (digest, name) in [of_shots, of_record].iter().zip(&names.0) {
            // Recorded hardware may leave it out.
            if let Some(found) = digest.filter(|digest| *digest != wanted) {
                let (name, sensor) = (name.clone(), design.name.clone());
                return Err(Error::OfAnother { name, found, sensor, wanted });
            }
        }
        // Samples of a band are many: each thread holds those of one.
        let bands_per_thread = if design.records() == RecordKind::Samples { 1 } else { 2 };
        let together = if is_live { 1 } else { bands_per_thread * rayon::current_num_threads() };
        Ok(Self {
            stream,
            names,
            viewpoint: Viewpoint { position, turn },
            together,
            waiting: VecDeque::new(),
            shots: 0,
            is_over: false,
        })
    }

    /// The points of the next scan, without truth; `None` behind the last one. `watch` sees each band
    /// as soon as it is decoded, and breaks the decoding off where it says so: from then on there is
    /// none.
    ///
    /// # Errors
    /// The error of `watch`; and [`Error::Invalid`], [`Error::Refused`], or [`Error::NoShot`] at the end.
    pub fn next_scan<E: From<Error>>(
        &mut self,
        stage: (&Design, &Scale),
        mut watch: impl FnMut(&Band) -> Result<ControlFlow<()>, E>,
    ) -> Result<Option<PointCloud>, E> {
        let mut pieces: Vec<Piece> = Vec::new();
        loop {
            if self.waiting.is_empty() {
                self.decode(stage)?;
            }
            let scan = pieces.first().map(|piece| piece.points.scan);
            let is_of_it = |band: &Band| scan.is_none_or(|scan| scan == band.piece.points.scan);
            if !self.waiting.front().is_some_and(is_of_it) {
                break;
            }
            let Some(band) = self.waiting.pop_front() else { break };
            if watch(&band)?.is_break() {
                // The next bands would be the rest of this scan.
                (self.waiting, self.is_over) = (VecDeque::new(), true);
                return Ok(None);
            }
            pieces.push(band.piece);
        }
        let Some(first) = pieces.first() else { return Ok(None) };
        let empty = PointCloud::empty(stage.0, first.points.scan);
        let frame = PointCloud { viewpoint: self.viewpoint, ..empty };
        let cloud = PointCloud::joined(&frame, &pieces);
        // Nothing is known of a scene.
        Ok(Some(PointCloud { truth: Truth::default(), ..cloud }))
    }

    /// Decodes some bands more.
    fn decode(&mut self, stage: (&Design, &Scale)) -> Result<(), Error> {
        let mut bands = Vec::new();
        while bands.len() < self.together && !self.is_over {
            let until = |shot: u64| emit::Band::of_shot(stage.0, shot).end(stage.0);
            let next = self.stream.next_band(until);
            match next.map_err(|cause| invalid(&self.names, cause))? {
                Some(band) => bands.push(band),
                None => self.is_over = true,
            }
        }
        let decoded: Result<Vec<Band>, _> =
            bands.into_par_iter().map(|band| Band::of(band, stage)).collect();
        let refused = |cause| Error::Refused { names: self.names.clone(), cause };
        self.waiting.extend(decoded.map_err(refused)?);
        self.shots += self.waiting.iter().map(|band| band.log.owned.len() as u64).sum::<u64>();
        match self.is_over && self.shots == 0 {
            true => Err(Error::NoShot { names: self.names.clone() }),
            false => Ok(()),
        }
    }
}

fn invalid(names: &Names, cause: files::Error) -> Error {
    let [shots, record] = &names.0;
    let name = if cause.what() == What::Shots { shots } else { record }.clone();
    match cause {
        files::Error::Read { cause, .. } => Error::Unreadable { name, cause },
        cause @ files::Error::Content { .. } => Error::Invalid { name, cause },
    }
}

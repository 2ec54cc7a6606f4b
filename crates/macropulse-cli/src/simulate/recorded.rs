//! Shots and their record beside the points, as `decode` needs them to find the points again.

use std::collections::BTreeMap;
use std::io::{self, Seek, SeekFrom, Write};
use std::path::Path;
use std::sync::{Mutex, PoisonError};

use macropulse::codec::files::{
    Form, RecordHeader, RecordWriter, SampleHeader, SampleWriter, Shot, ShotHeader, ShotWriter,
    TickHeader, TickWriter,
};
use macropulse::codec::{self, Given, RecordKind};
use macropulse::design::Design;
use macropulse::emit::{logs, scan_begins_fs, shots_of_scan};
use macropulse::formats::{self, WholeFile};
use macropulse::scene::Scene;
use macropulse::sim::{Record, Scans};

use crate::fault::Fault;

/// Record of a sensor that is written beside its shots.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Kept {
    /// Its kind.
    pub kind: RecordKind,
    /// The form of the shots, and of ticks.
    pub form: Form,
}

impl Kept {
    /// The names of the files of a scan: shots, and their record.
    pub fn names(self, scan: u64) -> [String; 2] {
        let endings = match self.form {
            Form::Binary => ["mps", self.kind.ending()],
            Form::Text => ["csv", "csv"],
        };
        [("shots", endings[0]), (self.kind.name(), endings[1])]
            .map(|(name, ending)| format!("{name}-{scan:06}.{ending}"))
    }
}

/// A scan of a sensor that is written so.
#[derive(Clone, Copy)]
pub struct Recorded<'a> {
    pub design: &'a Design,
    pub number: u64,
    pub kept: Kept,
}

impl Recorded<'_> {
    /// The names of its files of shots, and of their record.
    pub fn names(&self) -> [String; 2] {
        self.kept.names(self.number)
    }

    /// Writes the shot log of the scan, guard shots included, of a sensor that stands at `position`
    /// and is turned by `turn` when it begins.
    pub fn write_shots(
        &self,
        out: &mut impl Write,
        (position, turn): ([f64; 3], [f64; 4]),
    ) -> io::Result<()> {
        let Self { design, number, kept } = *self;
        let shots = shots_of_scan(design, number);
        let owned = number * design.shots_per_scan();
        let header = ShotHeader {
            first: shots.start,
            owned: Some(owned..owned + design.shots_per_scan()),
            digest: Some(design.recorded_digest()),
            position,
            turn,
            count: Some(shots.end - shots.start),
        };
        let mut writer = ShotWriter::new(out, kept.form, &header)?;
        for log in logs(design, shots) {
            for at in 0..log.len() {
                writer.write(&Shot {
                    fired_fs: log.fired_at_fs[at],
                    row: log.row[at],
                    column: log.column[at],
                    label: log.label[at],
                    word: log.word[at],
                    channel: log.channel[at],
                })?;
            }
        }
        Ok(())
    }

    /// Returns the header of its ticks, with the `count` of those that are known.
    pub fn header(&self, measured: bool, count: u64) -> TickHeader {
        TickHeader {
            tick_fs: self.design.clock.tick_fs,
            several: self.design.channels() > 1,
            measured,
            digest: Some(self.design.recorded_digest()),
            count: Some(count),
        }
    }
}

/// Header of a record.
enum Header {
    Ticks(TickHeader, Form),
    Samples(SampleHeader),
    Records(Given, RecordHeader),
}

impl Header {
    /// Writes it, with `count` ticks, blocks of samples, or shots to come.
    fn write(&mut self, out: &mut WholeFile, count: u64) -> io::Result<()> {
        match self {
            Self::Ticks(header, form) => {
                header.count = Some(count);
                TickWriter::new(out, *form, header).map(|_| ())
            }
            Self::Samples(header) => {
                header.count = Some(count);
                SampleWriter::new(out, header).map(|_| ())
            }
            Self::Records(blank, header) => {
                header.count = Some(count);
                let Some(blank) = blank.of_shots() else { return Ok(()) };
                RecordWriter::new(out, blank, header).map(|_| ())
            }
        }
    }

    /// Appends what was recorded before the absolute tick `end` to `bytes`, and gives the number of ticks,
    /// blocks of samples, or shots.
    fn append(&self, record: &Record, end: i64, bytes: &mut Vec<u8>) -> io::Result<u64> {
        match (self, record.given) {
            (Self::Ticks(header, form), codec::Record::Ticks(ticks)) => {
                let mut stream = ticks.stream();
                stream.truncate(stream.partition_point(|tick| tick.tick < end));
                let mut writer = TickWriter::behind(bytes, *form, header);
                stream.iter().try_for_each(|tick| writer.write(tick))?;
                Ok(stream.len() as u64)
            }
            (Self::Samples(_), codec::Record::Samples(samples)) => {
                SampleWriter::behind(bytes).write(samples, end)
            }
            (_, given) => {
                // A sensor gives what it is asked for, or it is not asked.
                let Some(of_shots) = given.of_shots() else { return Ok(0) };
                let first = record.log.first + record.log.owned.start as u64;
                RecordWriter::behind(bytes).write(of_shots, first)?;
                Ok(of_shots.shots() as u64)
            }
        }
    }
}

/// The files of a scan under way: its shots, and their record.
pub struct RecordFiles<'a> {
    recorded: Recorded<'a>,
    header: Header,
    shots: WholeFile,
    record: Mutex<Waiting>,
}

/// A record that is written in the order of the bands, whichever are done first.
struct Waiting {
    file: WholeFile,
    /// The shot in its scan that the next band begins with.
    next: u64,
    /// Bands that are done before earlier ones, by their first shot: the number of their shots, and their
    /// record as bytes.
    early: BTreeMap<u64, (u64, Vec<u8>)>,
    count: u64,
    failed: Option<io::Error>,
}

impl<'a> RecordFiles<'a> {
    /// Begins the files of a scan in `folder`, and writes its shots.
    pub fn begin(
        folder: &Path,
        recorded: Recorded<'a>,
        (scans, scene): (&Scans, &Scene),
    ) -> Result<Self, Fault> {
        let [shots, file] = recorded.names().map(|name| WholeFile::create(&folder.join(name)));
        let (mut shots, mut file) = (shots?, file?);
        let pose = scene.sensor.at(scan_begins_fs(recorded.design, recorded.number));
        let written = recorded.write_shots(&mut shots, (pose.position, pose.rotation.quaternion()));
        written.map_err(|cause| shots.failed(cause))?;
        let design = recorded.design;
        let digest = Some(design.recorded_digest());
        let records = |blank| Header::Records(blank, RecordHeader { digest, count: None });
        let samples = design.sample_header().map(Header::Samples);
        let of_shots = || design.blank_record().map(records);
        let mut header = samples.or_else(of_shots).unwrap_or_else(|| {
            Header::Ticks(recorded.header(scans.measure(), 0), recorded.kept.form)
        });
        header.write(&mut file, 0).map_err(|cause| file.failed(cause))?;
        let waiting = Waiting { file, next: 0, early: BTreeMap::new(), count: 0, failed: None };
        Ok(Self { recorded, header, shots, record: Mutex::new(waiting) })
    }

    /// Takes what the receiver was given of a band, and writes what is the band's own.
    pub fn take(&self, record: &Record) {
        let design = self.recorded.design;
        let (seen, own) = record.band.ticks(design);
        // Behind the last band there is nothing that could have them.
        let is_last = record.band.first + record.band.shots == design.shots_per_scan();
        let end = if is_last { seen.end } else { own.end };
        let mut bytes = Vec::new();
        // Memory takes all that is written to it.
        let appended = self.header.append(record, end, &mut bytes);
        let mut waiting = self.record.lock().unwrap_or_else(PoisonError::into_inner);
        match appended {
            Ok(count) => waiting.count += count,
            Err(cause) => waiting.failed = waiting.failed.take().or(Some(cause)),
        }
        waiting.early.insert(record.band.first, (record.band.shots, bytes));
        let Waiting { file, next, early, failed, .. } = &mut *waiting;
        while let Some((shots, bytes)) = early.remove(next) {
            *next += shots;
            if failed.is_none() {
                *failed = file.write_all(&bytes).err();
            }
        }
    }

    /// Ends the files, and gives their names.
    pub fn finish(self) -> Result<Vec<String>, formats::Error> {
        let Self { recorded, mut header, shots, record } = self;
        let Waiting { mut file, count, failed, .. } =
            record.into_inner().unwrap_or_else(PoisonError::into_inner);
        if let Some(cause) = failed {
            return Err(file.failed(cause));
        }
        let again = file.seek(SeekFrom::Start(0)).and_then(|_| header.write(&mut file, count));
        again.map_err(|cause| file.failed(cause))?;
        shots.keep()?;
        file.keep()?;
        Ok(recorded.names().into())
    }
}

//! Shots and ticks beside the points: what `decode` needs to find them again.

use std::collections::BTreeMap;
use std::io::{self, Seek, SeekFrom, Write};
use std::path::Path;
use std::sync::{Mutex, PoisonError};

use macropulse::codec::files::{Form, Shot, ShotHeader, ShotWriter, TickHeader, TickWriter};
use macropulse::design::Design;
use macropulse::emit::{logs, scan_begins_fs, shots_of_scan};
use macropulse::formats::{self, WholeFile};
use macropulse::scene::Scene;
use macropulse::sim::{Record, Scans};

use crate::fault::Fault;

/// A scan of a sensor that is written in this form.
#[derive(Clone, Copy)]
pub struct Recorded<'a> {
    pub design: &'a Design,
    pub number: u64,
    pub form: Form,
}

impl Recorded<'_> {
    /// The names of its files of shots and of ticks.
    pub fn names(&self) -> [String; 2] {
        let number = self.number;
        match self.form {
            Form::Binary => [format!("shots-{number:06}.mps"), format!("ticks-{number:06}.mpt")],
            Form::Text => [format!("shots-{number:06}.csv"), format!("ticks-{number:06}.csv")],
        }
    }

    /// Writes the shot log of the scan, guard shots included, of a sensor that stands at `position`
    /// and is turned by `turn` when it begins.
    pub fn write_shots(
        &self,
        out: &mut impl Write,
        (position, turn): ([f64; 3], [f64; 4]),
    ) -> io::Result<()> {
        let Self { design, number, form } = *self;
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
        let mut writer = ShotWriter::new(out, form, &header)?;
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

    /// What is said of its ticks, as many as are known.
    pub fn header(&self, measured: bool, count: u64) -> TickHeader {
        TickHeader {
            tick_fs: self.design.tdc.tick_fs,
            several: self.design.channels() > 1,
            measured,
            digest: Some(self.design.recorded_digest()),
            count: Some(count),
        }
    }
}

/// The files of shots and ticks of a scan under way.
pub struct TickFiles<'a> {
    recorded: Recorded<'a>,
    header: TickHeader,
    shots: WholeFile,
    ticks: Mutex<Waiting>,
}

/// Ticks that are written in the order of the bands, whichever are done first.
struct Waiting {
    file: WholeFile,
    /// The shot in its scan that the next band begins with.
    next: u64,
    /// Of bands that are done before others that come first, by their first shot: their shots, and
    /// their ticks as bytes.
    early: BTreeMap<u64, (u64, Vec<u8>)>,
    count: u64,
    failed: Option<io::Error>,
}

impl<'a> TickFiles<'a> {
    /// Begins the files of a scan in `folder`, and writes its shots.
    pub fn begin(
        folder: &Path,
        recorded: Recorded<'a>,
        (scans, scene): (&Scans, &Scene),
    ) -> Result<Self, Fault> {
        let [shots, ticks] = recorded.names().map(|name| WholeFile::create(&folder.join(name)));
        let (mut shots, mut ticks) = (shots?, ticks?);
        let pose = scene.sensor.at(scan_begins_fs(recorded.design, recorded.number));
        let written = recorded.write_shots(&mut shots, (pose.position, pose.quaternion()));
        written.map_err(|cause| shots.failed(cause))?;
        let header = recorded.header(scans.measure(), 0);
        let written = TickWriter::new(&mut ticks, recorded.form, &header);
        written.map(|_| ()).map_err(|cause| ticks.failed(cause))?;
        let waiting =
            Waiting { file: ticks, next: 0, early: BTreeMap::new(), count: 0, failed: None };
        Ok(Self { recorded, header, shots, ticks: Mutex::new(waiting) })
    }

    /// Takes what the receiver was given of a band, and writes the ticks that are the band's own.
    pub fn take(&self, record: &Record) {
        let Recorded { design, form, .. } = self.recorded;
        let (seen, own) = record.band.ticks(design);
        // Behind the last band there is nothing that could have them.
        let is_last = record.band.first + record.band.shots == design.shots_per_scan();
        let end = if is_last { seen.end } else { own.end };
        let macropulse::codec::Record::Ticks(ticks) = record.given else { return };
        let mut stream = ticks.stream();
        stream.truncate(stream.partition_point(|tick| tick.tick < end));
        let mut bytes = Vec::new();
        let mut writer = TickWriter::behind(&mut bytes, form, &self.header);
        // Memory takes all that is written to it.
        let written: io::Result<()> = stream.iter().try_for_each(|tick| writer.write(tick));
        let mut waiting = self.ticks.lock().unwrap_or_else(PoisonError::into_inner);
        waiting.count += stream.len() as u64;
        waiting.failed = waiting.failed.take().or(written.err());
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
        let Self { recorded, mut header, shots, ticks } = self;
        let Waiting { mut file, count, failed, .. } =
            ticks.into_inner().unwrap_or_else(PoisonError::into_inner);
        if let Some(cause) = failed {
            return Err(file.failed(cause));
        }
        header.count = Some(count);
        let again = file.seek(SeekFrom::Start(0));
        let again = again.and_then(|_| TickWriter::new(&mut file, recorded.form, &header));
        again.map(|_| ()).map_err(|cause| file.failed(cause))?;
        shots.keep()?;
        file.keep()?;
        Ok(recorded.names().into())
    }
}

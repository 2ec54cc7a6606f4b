//! The shot log of a scan, and the ticks of an ideal echo of it.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::io::{self, Seek, SeekFrom};
use std::path::Path;

use macropulse::codec::Tick;
use macropulse::codec::files::{Form, TickWriter};
use macropulse::design::Design;
use macropulse::emit::{logs, most_scans, shots_of_scan};
use macropulse::formats::{WholeFile, versioned};
use macropulse::units::{fs_from_s, tof_from_range};
use serde_json::json;

use crate::fault::Fault;
use crate::folder::{Folder, Outputs};
use crate::simulate::formats;
use crate::simulate::recorded::Recorded;
use crate::text::{grouped, print_bytes};

/// A form as typed.
pub fn form(typed: &str) -> Result<Form, String> {
    formats::form(typed).ok_or_else(|| "known are ticks (binary) and ticks-csv (text)".to_owned())
}

/// Writes the shot log to standard output.
pub fn stream(recorded: Recorded) -> Result<(), Fault> {
    check(recorded)?;
    let mut log = Vec::new();
    recorded.write_shots(&mut log, LEVEL).map_err(|error| Fault::unprinted(&error))?;
    print_bytes(&log)
}

/// Pose of a sensor if nothing else is known of it.
const LEVEL: ([f64; 3], [f64; 4]) = ([0.0; 3], [1.0, 0.0, 0.0, 0.0]);

/// Refuses a scan that the clock of the sensor does not count to.
fn check(recorded: Recorded) -> Result<(), Fault> {
    let Recorded { design, number, .. } = recorded;
    let last = most_scans(design).saturating_sub(1);
    match number > last {
        true => Err(Fault::Wrong(format!(
            "--scan {number}: scans of {} are numbered 0 to {last}",
            design.name
        ))),
        false => Ok(()),
    }
}

/// Writes the shot log, and the ticks of a wall if there is one; gives what is told of it.
pub fn write(
    recorded: Recorded,
    output: &Path,
    (wall, as_json): (Option<f64>, bool),
) -> Result<String, Fault> {
    check(recorded)?;
    let Recorded { design, number, .. } = recorded;
    if let Some(range) = wall.filter(|range| !(0.0..=design.scan.light_range).contains(range)) {
        return Err(Fault::Wrong(format!(
            "--wall-m {range}: light of {} is followed from 0 to {} m",
            design.name, design.scan.light_range
        )));
    }
    if wall.is_some() && design.bank().is_none() {
        let record = design.records().name();
        return Err(Fault::Wrong(format!(
            "--wall-m: {} records {record} and no ticks; leave it out, and simulate {record} with `macropulse \
             simulate --format {record}`",
            design.name
        )));
    }
    let [shots, ticks] = recorded.names();
    let written = std::iter::once(&shots).chain(wall.map(|_| &ticks));
    let mut folder = Folder::claim(output, Outputs::named(written))?;
    folder.make()?;
    let path = |name: &str| folder.path().join(name);
    let mut log = WholeFile::create(&path(&shots))?;
    recorded.write_shots(&mut log, LEVEL).map_err(|cause| log.failed(cause))?;
    let mut files = vec![shots];
    let mut count = None;
    if let Some(range) = wall {
        let mut file = WholeFile::create(&path(&ticks))?;
        let written = write_wall(recorded, range, &mut file);
        count = Some(written.map_err(|cause| file.failed(cause))?);
        file.keep()?;
        files.push(ticks);
    }
    log.keep()?;
    folder.keep();
    let fired = shots_of_scan(design, number);
    let fired = fired.end - fired.start;
    if as_json {
        let told = versioned(json!({
            "sensor": design.name,
            "scan": number,
            "shots": fired,
            "ticks": count,
            "digest": design.recorded_digest().to_string(),
            "folder": folder.path().display().to_string(),
            "files": files,
        }));
        return Ok(format!("{told:#}\n"));
    }
    let ticks = count.map_or(String::new(), |count| format!(", {} ticks", grouped(count)));
    let (fired, files) = (grouped(fired), files.join(" and "));
    Ok(format!("{files}: {fired} shots, guard shots included{ticks}\n"))
}

/// Writes the ticks of an echo of every shot from `range`; gives how many.
fn write_wall(recorded: Recorded, range: f64, file: &mut WholeFile) -> io::Result<u64> {
    let Recorded { design, number, kept } = recorded;
    let form = kept.form;
    let mut header = recorded.header(false, 0);
    let mut writer = TickWriter::new(&mut *file, form, &header)?;
    let mut count = 0;
    let mut write = |tick: Tick| {
        count += 1;
        writer.write(&tick)
    };
    wall(design, number, range, &mut write)?;
    header.count = Some(count);
    file.seek(SeekFrom::Start(0))?;
    TickWriter::new(file, form, &header)?;
    Ok(count)
}

/// Hands over the ticks of the wall in their order, each once. Those wait that later shots may still
/// come before.
fn wall(
    design: &Design,
    number: u64,
    range: f64,
    write: &mut dyn FnMut(Tick) -> io::Result<()>,
) -> io::Result<()> {
    let (coding, tick_fs) = (design.emission.coding(), design.clock.tick_fs);
    let delay_fs = fs_from_s(tof_from_range(range));
    let mut waiting: BinaryHeap<Reverse<(i64, u16)>> = BinaryHeap::new();
    let mut last = None;
    let mut release = |waiting: &mut BinaryHeap<Reverse<(i64, u16)>>, before: i64| {
        while waiting.peek().is_some_and(|Reverse((tick, _))| *tick < before) {
            let Some(Reverse(next)) = waiting.pop() else { break };
            if last.replace(next) != Some(next) {
                write(Tick { tick: next.0, channel: next.1, amplitude: 0.0 })?;
            }
        }
        Ok::<(), io::Error>(())
    };
    for log in logs(design, shots_of_scan(design, number)) {
        for shot in 0..log.len() {
            let arrives_fs = log.fired_at_fs[shot] + delay_fs;
            release(&mut waiting, arrives_fs.div_euclid(tick_fs))?;
            for mark in coding.codebook.marks(log.label[shot], log.word[shot]) {
                let fs = arrives_fs + i64::from(*mark) * coding.chip_fs;
                waiting.push(Reverse((fs.div_euclid(tick_fs), log.channel[shot])));
            }
        }
    }
    release(&mut waiting, i64::MAX)
}

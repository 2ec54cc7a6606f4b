//! Directions from a file, one after the other: scan patterns that are no lattice.
//!
//! The list goes on from scan to scan and begins anew at its end. With several lines these take
//! turns: entry k is a shot of line k mod `lines`, each with a detector of its own.

use std::path::Path;
use std::sync::Arc;

use schemars::JsonSchema;
use serde::Deserialize;

use super::directions::{self, Directions, Way};
use super::model::{Extent, Model, Moment};
use super::{Pattern, Typed};
use crate::design::Error;
use crate::design::limits::Check;
use crate::design::safety::Beams;
use crate::digest::Digest;
use crate::{opened, told};

/// Bytes of the largest table: 2²² entries of some 40.
const MOST_BYTES: u64 = 1 << 28;

/// Entries of the largest table: 100 MB of directions.
const MOST_ENTRIES: usize = 1 << 22;

/// Shots of a line in a scan: they are counted in 16 bits.
const MOST_SHOTS: f64 = 65_535.0;

/// A list of directions, scan after scan.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// Unit vectors in the sensor frame.
    pub directions: Arc<[[f64; 3]]>,
    /// Beams, each with a detector of its own, that take turns in the list.
    pub lines: u32,
    /// Shots of each line in a scan.
    pub shots: u32,
    /// True if the lines fire together.
    pub together: bool,
    digest: String,
    notes: Vec<String>,
}

/// `[scan.table]` as typed.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct File {
    /// CSV file with azimuth and elevation (or zenith), and the time if there is one; beside this
    /// file.
    file: String,
    /// Beams that take turns in the table, each with a detector of its own.
    #[schemars(range(min = 1, max = 1024))]
    lines: u32,
    /// Directions per second, all lines together, of a table without times.
    #[schemars(range(min = 1, max = 1e9))]
    firings_per_s: Option<f64>,
}

/// The entries of a table: directions, and times if it has them, s.
struct Entries {
    directions: Vec<[f64; 3]>,
    times: Vec<f64>,
}

impl Typed for File {
    fn check(&self, check: &Check, period: f64) -> Result<Pattern, Error> {
        let path = check.chain.beside("scan.table.file", &self.file);
        let refuse = |message: String| check.refuse("scan.table.file", message);
        let lines = check.count("scan.table.lines", self.lines, 1, 1024)?;
        let read = bytes(&path, MOST_BYTES).and_then(|bytes| {
            let mut digest = Digest::new();
            digest.bytes(&bytes);
            Ok((entries(&bytes, &path.display().to_string())?, digest.text()))
        });
        let (Entries { directions, times }, digest) = match read {
            Ok(read) => read,
            Err(message) => return refuse(message),
        };
        let origin = path.display();
        if directions.len() < 2 || !directions.len().is_multiple_of(lines as usize) {
            let (count, of_lines) = match lines {
                1 => (directions.len(), String::new()),
                _ => (directions.len(), format!(", a multiple of the {lines} of scan.table.lines")),
            };
            return refuse(format!(
                "{origin}: {count} directions; there must be two at least{of_lines}"
            ));
        }
        let has_times = !times.is_empty() && !only_count(&times, lines as usize);
        let rate = match (has_times, self.firings_per_s) {
            (true, None) => match rate(&times, lines as usize, &origin.to_string()) {
                Ok(rate) => rate,
                Err(message) => return refuse(message),
            },
            (false, Some(typed)) => check.within("scan.table.firings_per_s", typed, 1.0, 1e9)?,
            (true, Some(_)) => {
                let message = "has no effect because of `scan.table.file`, which has times";
                return check.refuse("scan.table.firings_per_s", message);
            }
            (false, None) => {
                let times = match times.is_empty() {
                    true => "has no times",
                    false => "its times only count the entries",
                };
                return refuse(format!("{origin}: {times}: give scan.table.firings_per_s"));
            }
        };
        let shots = (rate * period / f64::from(lines)).round();
        if !(1.0..=MOST_SHOTS).contains(&shots) {
            return refuse(format!(
                "{origin}: {rate:.6} shots a second are {shots} of each line in a scan, but 1 to \
                 {MOST_SHOTS} are possible: change scan.scans_per_s or scan.table.lines"
            ));
        }
        let of_lines = |times: &[f64]| times.windows(2).all(|pair| pair[0] == pair[1]);
        let together = lines > 1 && !times.is_empty() && times.chunks(lines as usize).all(of_lines);
        let lasts = directions.len() as f64 / rate;
        let notes = vec![format!(
            "{origin}: {} directions in {lasts:.3} s, then anew; {shots} of each line in a scan",
            directions.len()
        )];
        let (directions, shots) = (directions.into(), shots as u32);
        Ok(Pattern::Table(Table { directions, lines, shots, together, digest, notes }))
    }
}

/// Reads the bytes of the file at `path`, `most` of them at most.
pub(super) fn bytes(path: &Path, most: u64) -> Result<Vec<u8>, String> {
    let unread = |error: std::io::Error| {
        format!("{}: cannot be read: {}", path.display(), told::unreadable(&error))
    };
    opened::bytes(path, most).map_err(unread)
}

/// Columns of a table.
#[derive(Clone, Copy, PartialEq)]
enum Column {
    /// And how many of its unit are a second.
    Time(f64),
    /// To the left, and how many radians its unit is.
    Azimuth(f64),
    Elevation(f64),
    /// From the vertical.
    Zenith(f64),
    Other,
}

/// Reads the header of a column: a name, and behind `/`, `_`, a space or a bracket its unit.
fn column(header: &str) -> Result<Column, String> {
    let lower = header.trim().trim_start_matches('\u{feff}').to_ascii_lowercase();
    let mut words = lower.split(|letter: char| !letter.is_alphanumeric()).filter(|w| !w.is_empty());
    let (name, unit) = (words.next().unwrap_or_default(), words.next());
    // In quotes it may have lines.
    let shown = header.escape_debug();
    let angle = || match unit {
        None | Some("deg" | "degree" | "degrees") => Ok(1_f64.to_radians()),
        Some("rad" | "radian" | "radians") => Ok(1.0),
        Some(other) => Err(format!("`{shown}`: {other} is no unit of angles: write deg or rad")),
    };
    Ok(match name {
        "time" | "t" | "timestamp" => Column::Time(match unit {
            None | Some("s" | "sec" | "seconds") => 1.0,
            Some("ms") => 1e-3,
            Some("us") => 1e-6,
            Some("ns") => 1e-9,
            Some(other) => {
                return Err(format!(
                    "`{shown}`: {other} is no unit of time: write s, ms, us or ns"
                ));
            }
        }),
        "azimuth" => Column::Azimuth(angle()?),
        "elevation" => Column::Elevation(angle()?),
        "zenith" => Column::Zenith(angle()?),
        _ => Column::Other,
    })
}

/// The entries of a table of comma-separated values with a line of headers.
fn entries(bytes: &[u8], origin: &str) -> Result<Entries, String> {
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(bytes);
    let fault = |line: u64, message: String| format!("{origin}:{line}: {message}");
    let unread = |error: csv::Error| {
        let line = error.position().map_or(1, csv::Position::line);
        fault(line, "is no line of as many comma-separated values as there are headers".to_owned())
    };
    let headers = reader.headers().map_err(unread)?.clone();
    let columns: Vec<Column> =
        headers.iter().map(column).collect::<Result<_, String>>().map_err(|said| fault(1, said))?;
    let place = |is: fn(&Column) -> bool| columns.iter().position(is);
    let time = place(|column| matches!(column, Column::Time(_)));
    let azimuth = place(|column| matches!(column, Column::Azimuth(_)));
    let up = place(|column| matches!(column, Column::Elevation(_) | Column::Zenith(_)));
    let both = |is: fn(&Column) -> bool| columns.iter().filter(|column| is(column)).count() > 1;
    let (Some(azimuth), Some(up)) = (azimuth, up) else {
        let message = "needs a header with `azimuth` and `elevation` or `zenith`, as \
                       `Time/s,Azimuth/deg,Zenith/deg`";
        return Err(fault(1, message.to_owned()));
    };
    if both(|column| matches!(column, Column::Elevation(_) | Column::Zenith(_))) {
        return Err(fault(1, "has both elevation and zenith: keep one".to_owned()));
    }
    let mut found = Entries { directions: Vec::new(), times: Vec::new() };
    let mut record = csv::StringRecord::new();
    while reader.read_record(&mut record).map_err(unread)? {
        let line = record.position().map_or(0, csv::Position::line);
        if found.directions.len() == MOST_ENTRIES {
            return Err(fault(line, format!("is beyond the {MOST_ENTRIES} that are read")));
        }
        let number = |place: usize| {
            let typed = record.get(place).unwrap_or_default();
            match typed.parse::<f64>() {
                Ok(number) if number.is_finite() => Ok(number),
                _ => Err(fault(line, format!("`{typed}` is no number"))),
            }
        };
        if let (Some(place), Some(Column::Time(unit))) = (time, time.map(|at| columns[at])) {
            let now = number(place)? * unit;
            if found.times.last().is_some_and(|before| now < *before) {
                return Err(fault(line, "is earlier than the line before it".to_owned()));
            }
            found.times.push(now);
        }
        let unit = |column: Column| match column {
            Column::Azimuth(unit) | Column::Elevation(unit) | Column::Zenith(unit) => unit,
            Column::Time(_) | Column::Other => 1.0,
        };
        let azimuth = number(azimuth)? * unit(columns[azimuth]);
        let typed = number(up)? * unit(columns[up]);
        let elevation = match columns[up] {
            Column::Zenith(_) => std::f64::consts::FRAC_PI_2 - typed,
            _ => typed,
        };
        // To the rounding of a file.
        if elevation.abs() > std::f64::consts::FRAC_PI_2 + 1e-6 {
            let degrees = elevation.to_degrees();
            return Err(fault(
                line,
                format!("points {degrees:.3} degrees up, beyond the vertical"),
            ));
        }
        let (sin_a, cos_a) = libm::sincos(azimuth);
        let (sin_e, cos_e) = libm::sincos(elevation);
        found.directions.push([cos_e * cos_a, cos_e * sin_a, sin_e]);
    }
    Ok(found)
}

/// Returns true if the times are whole seconds that only count the entries, or the groups of lines.
fn only_count(times: &[f64], lines: usize) -> bool {
    let counts = |group: usize| {
        let expected = |at: usize| times[0] + (at / group) as f64;
        times.iter().enumerate().all(|(at, time)| *time == expected(at))
    };
    times[0].fract() == 0.0 && (counts(1) || counts(lines))
}

/// Shots a second, which must follow each other evenly, but for lines that fire together.
fn rate(times: &[f64], lines: usize, origin: &str) -> Result<f64, String> {
    let (first, last) = (times[0], times[times.len() - lines.min(times.len())]);
    let steps = times.len() as f64 / lines as f64 - 1.0;
    if steps < 1.0 || last <= first {
        return Err(format!("{origin}: its times do not grow"));
    }
    let step = (last - first) / steps;
    for (entry, time) in times.iter().enumerate() {
        let expected = first + (entry / lines) as f64 * step;
        // Times are often written with few digits.
        if (time - expected).abs() > 2.0 * step {
            return Err(format!(
                "{origin}: entry {} is {:.3} us off the even pace of its {} entries: only even \
                 times are simulated",
                entry + 1,
                (time - expected) * 1e6,
                times.len()
            ));
        }
    }
    Ok(lines as f64 / step)
}

impl Table {
    fn path(&self) -> directions::Path {
        let (lines, shots) = (u64::from(self.lines), u64::from(self.shots));
        let way = Way::List(Arc::clone(&self.directions));
        directions::Path { per_scan: lines * shots, rows: lines, way }
    }

    /// The directions of the first scan, in their order.
    fn first_scan(&self) -> Vec<[f64; 3]> {
        let shots = self.lines as usize * self.shots as usize;
        self.directions.iter().copied().cycle().take(shots).collect()
    }
}

impl Model for Table {
    fn summary(&self) -> String {
        match self.lines {
            1 => "one beam, directions from a table".to_owned(),
            lines => format!("{lines} beams, directions from a table"),
        }
    }

    fn size(&self) -> [u32; 2] {
        [self.lines, self.shots]
    }

    fn channels(&self) -> u32 {
        self.lines
    }

    fn channel_of(&self, _order: u64, row: u16) -> u16 {
        row
    }

    fn pixel(&self, order: u64) -> (u16, u16) {
        let lines = u64::from(self.lines);
        ((order % lines) as u16, (order / lines) as u16)
    }

    fn order_of(&self, row: u16, column: u16) -> u64 {
        u64::from(column) * u64::from(self.lines) + u64::from(row)
    }

    fn moment(&self, order: u64, _period: f64) -> Moment {
        let before = if self.together { order % u64::from(self.lines) } else { 0 };
        Moment { shots: order - before, then: 0.0 }
    }

    fn equal_steps(&self) -> bool {
        !self.together
    }

    fn line(&self) -> u64 {
        self.lines.into()
    }

    fn draws_from_the_left(&self) -> bool {
        false
    }

    fn shortest_dwell(&self, pixel_period: f64) -> f64 {
        pixel_period * f64::from(self.lines)
    }

    fn moves_by(&self) -> Option<f64> {
        None
    }

    fn directions(&self) -> Directions {
        Directions::along(self.path())
    }

    fn pixel_at(&self, _azimuth: f64, _elevation: f64) -> Option<(u16, u16)> {
        None
    }

    fn cell(&self) -> [f64; 2] {
        cell(&self.first_scan(), self.lines as usize)
    }

    fn extent(&self) -> Extent {
        extent(&self.directions)
    }

    fn shared_field(&self) -> Option<[f64; 2]> {
        None
    }

    fn follows(&self) -> bool {
        true
    }

    fn beams(&self) -> Beams {
        Beams::Scattered(self.first_scan())
    }

    fn is_lattice(&self) -> bool {
        false
    }

    fn file_digest(&self) -> Option<&str> {
        Some(&self.digest)
    }

    fn notes(&self) -> &[String] {
        &self.notes
    }
}

/// Returns the cell of a shot among `shots` of `lines` lines. It is as wide and as high as the median step
/// from one shot of a line to the next.
pub(super) fn cell(shots: &[[f64; 3]], lines: usize) -> [f64; 2] {
    let step = |pair: &[[f64; 3]]| {
        let [one, next] = [pair[0], pair[lines]];
        let chord = (0..3).map(|axis| (one[axis] - next[axis]).powi(2)).sum::<f64>().sqrt();
        2.0 * libm::asin((chord / 2.0).min(1.0))
    };
    let mut steps: Vec<f64> = shots.windows(lines + 1).map(step).collect();
    steps.sort_by(f64::total_cmp);
    let median = steps.get(steps.len() / 2).copied().unwrap_or(0.0);
    [median.max(1e-6); 2]
}

/// The least rectangle of azimuth and elevation that holds all `directions`.
pub(super) fn extent(directions: &[[f64; 3]]) -> Extent {
    let all = |angle: fn(&[f64; 3]) -> f64| {
        let ends = [f64::INFINITY, f64::NEG_INFINITY];
        directions.iter().map(angle).fold(ends, |[least, most], a| [least.min(a), most.max(a)])
    };
    Extent {
        azimuth: all(|[x, y, _]| libm::atan2(*y, *x)),
        elevation: all(|[.., z]| libm::asin(z.clamp(-1.0, 1.0))),
    }
}

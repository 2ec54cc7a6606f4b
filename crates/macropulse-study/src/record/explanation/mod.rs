//! The explanation of a shot: one structure, from which text, JSON and pictures are printed.
//!
//! A kind of record is a variant of [`Record`] with a file of its own.

mod beats;
mod curve;
mod histograms;
mod light;
mod odds;
mod samples;
mod taps;
mod ticks;

use std::ops::Range;
use std::path::Path;

use macropulse::codec::decode::{self, Accepted, Reject, Verdict};
use macropulse::codec::files::ShotRecord;
use macropulse::codec::{self, Given, RecordKind, ShotLog};
use macropulse::design::Design;
use macropulse::formats::{versioned, write_atomically};
use macropulse::sim::{Arrivals, Stretch};
use macropulse::units::{range_from_tof, s_from_fs};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use self::beats::Spectra;
use self::curve::Scale;
use self::histograms::Counts;
use self::light::Light;
use self::samples::Samples;
use self::taps::Phasors;
use self::ticks::Ticks;
use super::Error;
use crate::text::{Columns, counted, grouped, short};
use crate::view::{Chart, Figure, Section, Stack};

/// A pixel, by its row and its column.
pub type Pixel = (u16, u16);

/// Other shots that are listed in text; of further ones only the number is printed.
const MOST_OTHERS: usize = 8;

/// Why the shot to a pixel was decided as it was. Ticks and lags count from its firing.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct PixelExplanation {
    row: u16,
    column: u16,
    /// Number of the shot, counted from the first one of the first scan.
    shot: u64,
    fired_at_fs: i64,
    label: u16,
    code_word: u16,
    /// `accepted`, the first reason to reject it, or `not_found`.
    decided: String,
    /// The reasons, in sentences.
    why: String,
    returns: Vec<Return>,
    rejects: Vec<String>,
    /// When the marks of the macropulse leave.
    marks_ticks: Vec<u32>,
    /// First and last lag of the gate.
    gate_ticks: [i64; 2],
    /// Light at the detector, where it is known.
    light: Option<Light>,
    #[serde(flatten)]
    record: Record,
}

/// A return that was accepted.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Return {
    range_m: f64,
    /// Marks found.
    peak: u16,
    /// Marks of the macropulse.
    marks: u16,
    margin: u16,
    photons: Option<f32>,
}

/// The record of the shot's time, by its kind, and what the receiver made of it.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(untagged)]
enum Record {
    Ticks(Ticks),
    Samples(Samples),
    Histograms(Counts),
    Taps(Phasors),
    Beats(Spectra),
}

/// The explanation of a record, of whatever kind.
trait RecordExplanation {
    /// The kind of the record.
    fn kind(&self) -> RecordKind;

    /// The lags of its correlation.
    fn scale(&self) -> Option<&Scale>;

    /// Drops every list that has an entry for each tick or lag.
    fn shorten(&mut self) {}

    /// Adds its lines to the text about a macropulse of `marks` marks.
    fn push(&self, marks: usize, columns: &mut Columns);

    /// The charts, each with its caption; `None` of a summary.
    fn charts(&self, sent: &Sent) -> Option<Vec<(Chart, &'static str)>>;
}

/// The content of charts beside the record.
struct Sent<'a> {
    /// When the marks of the macropulse leave, in ticks.
    marks: &'a [u32],
    light: Option<&'a Light>,
    returns: &'a [Return],
}

/// The explanation of a record that is made shot by shot.
trait OfShot: Sized {
    type Record: ShotRecord;

    /// Explains the record of shot number `at`, which is `shot`.
    fn of(
        design: &Design,
        record: &Self::Record,
        at: usize,
        shot: &Shot,
    ) -> Result<Self, decode::Error>;

    /// The reasons of the verdict, in sentences.
    fn why(&self, verdict: &Verdict) -> String;
}

/// Explains shot number `at` of a band out of its `record`.
fn of_shot<'a, E: OfShot>(
    design: &Design,
    (log, record): (&'a ShotLog, &E::Record),
    at: usize,
    kept: fn(E) -> Record,
) -> Result<Decision<'a>, decode::Error> {
    let verdict = alone(design, log, at, &record.one(at))?;
    let tick_fs = design.clock.tick_fs;
    let fired_tick = log.fired_at_fs[at].div_euclid(tick_fs);
    let shot = Shot { log, at, fired_tick, tick_fs, within_tick_fs: 0 };
    let (nearest, farthest) = design.receiver.gate_ticks;
    let explained = E::of(design, record, at, &shot)?;
    Ok(Decision {
        why: explained.why(&verdict),
        shot,
        marks: vec![0],
        gate: i64::from(nearest)..i64::from(farthest) + 1,
        width: 1,
        verdict,
        record: kept(explained),
    })
}

impl Record {
    fn explanation(&self) -> &dyn RecordExplanation {
        match self {
            Self::Ticks(ticks) => ticks,
            Self::Samples(samples) => samples,
            Self::Histograms(counts) => counts,
            Self::Taps(phasors) => phasors,
            Self::Beats(spectra) => spectra,
        }
    }

    fn explanation_mut(&mut self) -> &mut dyn RecordExplanation {
        match self {
            Self::Ticks(ticks) => ticks,
            Self::Samples(samples) => samples,
            Self::Histograms(counts) => counts,
            Self::Taps(phasors) => phasors,
            Self::Beats(spectra) => spectra,
        }
    }
}

/// The shot that is explained, in the log of its band.
#[derive(Clone, Copy)]
struct Shot<'a> {
    log: &'a ShotLog,
    at: usize,
    /// The absolute tick in which it was fired.
    fired_tick: i64,
    tick_fs: i64,
    /// From the beginning of a tick to the time that it stands for.
    within_tick_fs: i64,
}

impl Shot<'_> {
    fn id(&self) -> u64 {
        self.log.first + self.at as u64
    }

    /// The pixel of shot number `at` of the log.
    fn pixel(&self, at: usize) -> Pixel {
        (self.log.row[at], self.log.column[at])
    }

    /// The range, m, of light that comes `lag` ticks after the shot.
    fn range(&self, lag: i64) -> f64 {
        let since_fs = (self.fired_tick + lag) * self.tick_fs - self.log.fired_at_fs[self.at];
        range_from_tof(s_from_fs(since_fs + self.within_tick_fs))
    }
}

/// The part of an explanation that follows from the record alone.
struct Decision<'a> {
    shot: Shot<'a>,
    marks: Vec<u32>,
    gate: Range<i64>,
    /// For how many ticks a mark is looked for.
    width: u32,
    verdict: Verdict,
    why: String,
    record: Record,
}

/// The result of the receiver of `design` for the `record` of shot number `at` of `log` alone.
fn alone<'a>(
    design: &Design,
    log: &ShotLog,
    at: usize,
    record: impl Into<codec::Record<'a>>,
) -> Result<Verdict, decode::Error> {
    let mut log = log.part(at..at + 1);
    log.owned = 0..1;
    let found = design.receive(&log, record)?;
    let returns = (0..found.shot.len()).map(|place| Accepted {
        tof: found.tof[place],
        peak: found.peak[place],
        marks: found.marks[place],
        margin: found.margin[place],
        photons: found.photons[place],
    });
    let rejects = Reject::ALL.into_iter().zip(found.rejects).filter(|(_, count)| *count > 0);
    Ok(Verdict { returns: returns.collect(), rejects: rejects.collect() })
}

impl PixelExplanation {
    /// Explains shot number `shot` of a band out of its record. `arrivals` gives the light of a stretch of time,
    /// or `None` if the light is not known. The stretch begins with the shot or its gate, and lasts to the end
    /// of the last macropulse within the gate.
    ///
    /// # Errors
    /// As the receiver's.
    pub fn new(
        design: &Design,
        (log, given): (&ShotLog, &Given),
        shot: usize,
        arrivals: impl FnOnce(&Stretch) -> Option<Arrivals>,
    ) -> Result<Self, decode::Error> {
        let Decision { shot, marks, gate, width, verdict, why, record } = match given {
            Given::Ticks(ticks) => ticks::decision(design, (log, ticks), shot)?,
            Given::Samples(samples) => samples::decision(design, (log, samples), shot)?,
            Given::Histograms(record) => of_shot(design, (log, record), shot, Record::Histograms)?,
            Given::Taps(record) => of_shot(design, (log, record), shot, Record::Taps)?,
            Given::Beats(record) => of_shot(design, (log, record), shot, Record::Beats)?,
        };
        let lasts = marks.last().map_or(0, |last| last + width);
        let light = arrivals(&Stretch {
            channel: log.channel[shot.at],
            from: shot.fired_tick,
            ticks: gate.start.min(0)..gate.end + i64::from(lasts),
        });
        let decided = match (verdict.returns.is_empty(), verdict.rejects.first()) {
            (false, _) => "accepted",
            (true, Some((kind, _))) => kind.name(),
            (true, None) => "not_found",
        };
        let returns = verdict.returns.iter().map(|one| Return {
            range_m: range_from_tof(one.tof),
            peak: one.peak,
            marks: one.marks,
            margin: one.margin,
            photons: finite(one.photons),
        });
        let (row, column) = shot.pixel(shot.at);
        Ok(Self {
            row,
            column,
            shot: shot.id(),
            fired_at_fs: log.fired_at_fs[shot.at],
            label: log.label[shot.at],
            code_word: log.word[shot.at],
            decided: decided.to_owned(),
            why,
            returns: returns.collect(),
            rejects: verdict.rejects.iter().map(|(kind, _)| kind.name().to_owned()).collect(),
            light: light.map(|arrivals| Light::new(&arrivals, &shot, &marks)),
            marks_ticks: marks,
            gate_ticks: [gate.start, gate.end - 1],
            record,
        })
    }

    /// All of it for people.
    pub fn text(&self) -> String {
        let mut columns = Columns::default();
        columns.push("decided", self.headline());
        columns.push("why", &self.why);
        columns.push(
            "sent",
            format!(
                "label {}, word {}: {} at {} fs",
                self.label,
                self.code_word,
                counted(self.marks_ticks.len() as u64, "mark"),
                grouped(self.fired_at_fs.unsigned_abs())
            ),
        );
        let explained = self.record.explanation();
        if let Some(scale) = explained.scale() {
            let [first, last] = self.gate_ticks;
            let [nearest, farthest] = [first, last].map(|lag| short(scale.range(lag)));
            let lags = grouped((last - first + 1) as u64);
            columns.push("gate", format!("{nearest} to {farthest} m, {lags} lags"));
        }
        columns.push(
            "light",
            match &self.light {
                Some(light) => light.text(explained.kind() == RecordKind::Ticks),
                None => {
                    let recorded = explained.kind().name();
                    format!("not known: what is decoded is {recorded} alone")
                }
            },
        );
        explained.push(self.marks_ticks.len(), &mut columns);
        let Self { row, column, shot, .. } = self;
        format!("row {row}, column {column}, shot {shot}\n\n{}", columns.text())
    }

    /// The JSON object for programs, without the lists that have an entry for each tick or lag.
    pub fn summary(mut self) -> Value {
        self.record.explanation_mut().shorten();
        self.light.iter_mut().for_each(|light| light.times = None);
        self.value()
    }

    fn value(&self) -> Value {
        serde_json::to_value(self).unwrap_or_default()
    }

    fn headline(&self) -> String {
        self.decided.replace('_', " ")
    }

    /// The charts, each with what is said of it; `None` of a summary.
    fn charts(&self) -> Option<Vec<(Chart, &'static str)>> {
        let (marks, light, returns) = (&self.marks_ticks, self.light.as_ref(), &self.returns);
        self.record.explanation().charts(&Sent { marks, light, returns })
    }

    /// Its section of a page: the decision, what was sent, what came to the detector and what it
    /// made of that, and the correlation.
    fn section(&self) -> Option<Section> {
        let section = Section::new(&format!("Pixel {},{}", self.row, self.column))
            .paragraph(&format!("Shot {}: **{}**. {}", self.shot, self.headline(), self.why));
        let figures = self.charts()?.into_iter();
        let figures = figures.map(|(chart, said)| Figure::svg(&chart.svg(), said));
        Some(figures.fold(section, Section::figure))
    }

    fn picture(&self) -> Stack {
        let charts = self.charts().unwrap_or_default().into_iter();
        Stack {
            title: format!("Row {}, column {}: {}", self.row, self.column, self.headline()),
            charts: charts.map(|(chart, _)| chart).collect(),
        }
    }

    /// Writes text, JSON and pictures of a shot of `design` into `folder`, and gives the names of
    /// the files.
    ///
    /// # Errors
    /// If a picture cannot be drawn or a file not be written.
    pub fn write(&self, folder: &Path, design: &Design) -> Result<Vec<String>, Error> {
        let picture = self.picture();
        let contents = [
            self.text().into_bytes(),
            versioned(self.value()).to_string().into_bytes(),
            picture.svg().into_bytes(),
            picture.png()?,
        ];
        let scan = self.shot / design.shots_per_scan();
        let files = explanation_files(scan, (self.row, self.column));
        for (file, bytes) in files.iter().zip(contents) {
            write_atomically(&folder.join(file), |out| out.write_all(&bytes))?;
        }
        Ok(files.into())
    }
}

/// Names of the files that explain a pixel of a scan.
pub fn explanation_files(scan: u64, (row, column): Pixel) -> [String; 4] {
    ["txt", "json", "svg", "png"].map(|ending| format!("explain-{scan:06}-{row}-{column}.{ending}"))
}

/// True if a file of a run is an explanation, by its name.
pub(super) fn is_explanation(file: &str) -> bool {
    file.starts_with("explain-") && file.ends_with(".json")
}

/// The section of the pixel that the file at `path` explains; `None` if it holds no explanation.
pub(super) fn section(path: &Path) -> Option<Section> {
    let text = macropulse::opened::text(path).ok()?;
    serde_json::from_str::<PixelExplanation>(&text).ok()?.section()
}

/// A number as JSON has it, which knows finite ones alone.
fn finite(number: f32) -> Option<f32> {
    number.is_finite().then_some(number)
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::view::Explorer;

    /// The file of a pixel whose record is `record` and whose light is `light`.
    pub(super) fn explanation(record: Value, light: Value) -> PixelExplanation {
        let mut file = json!({
            "schema_version": 1, "row": 3, "column": 10, "shot": 7, "fired_at_fs": 5_000_000_000_i64,
            "label": 2, "code_word": 1, "decided": "no_peak", "why": "Four of four.", "returns": [],
            "rejects": ["no_peak"], "marks_ticks": [0, 5, 9, 20], "gate_ticks": [40, 42],
            "light": light,
        });
        for (key, value) in record.as_object().unwrap() {
            file[key] = value.clone();
        }
        serde_json::from_value(file).unwrap()
    }

    pub(super) fn html(told: &PixelExplanation) -> String {
        let mut page = Explorer::new("t");
        page.section(told.section().unwrap());
        page.html()
    }

    #[test]
    fn a_file_reads_back_as_it_was_written() {
        let told = explanation(ticks::tests::record(), light::tests::light());
        let again: PixelExplanation = serde_json::from_value(told.value()).unwrap();
        assert_eq!(again.value(), told.value());
        assert!(matches!(again.record, Record::Ticks(_)));
        assert_eq!(again.text(), told.text());
    }

    #[test]
    fn a_summary_has_no_list_of_ticks_or_lags() {
        let told = explanation(ticks::tests::record(), light::tests::light());
        let whole = told.value();
        let summary = told.summary();
        let left_out = ["ticks", "is_of_others", "correlation"];
        for (key, value) in whole.as_object().unwrap() {
            match key.as_str() {
                "light" => {
                    assert!(value["trains"].is_array() && summary["light"]["trains"].is_null());
                }
                key if left_out.contains(&key) => assert!(summary.get(key).is_none(), "{key}"),
                key => assert_eq!(summary[key], *value, "{key}"),
            }
        }
    }

    #[test]
    fn a_file_is_known_by_its_name() {
        let [_, json, ..] = explanation_files(0, (3, 10));
        assert!(is_explanation(&json) && !is_explanation("manifest.json"));
        assert!(serde_json::from_value::<PixelExplanation>(json!({ "row": 3 })).is_err());
    }
}

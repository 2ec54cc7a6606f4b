//! Why a shot was decided as it was: for people, for programs, and as a picture.

mod light;
mod samples;
mod text;
mod ticks;

use std::ops::Range;
use std::path::Path;

use macropulse::codec::decode::{Explanation, SampledExplanation, Verdict};
use macropulse::codec::{Given, ShotLog};
use macropulse::design::Design;
use macropulse::formats::{versioned, write_atomically};
use macropulse::sim::{Arrivals, Stretch};
use macropulse::units::{range_from_tof, s_from_fs};
use macropulse_study::record::pixel_picture;
use serde_json::{Value, json};

use crate::fault::Fault;

/// A pixel, by its row and its column.
pub type Pixel = (u16, u16);

/// A pixel as typed.
pub fn pixel(typed: &str) -> Result<Pixel, String> {
    let parts = typed.split_once(',');
    parts
        .and_then(|(row, column)| Some((row.trim().parse().ok()?, column.trim().parse().ok()?)))
        .ok_or_else(|| "write it as row,column, both from 0, as in --explain 240,424".to_owned())
}

/// Refuses pixels that the sensor does not have.
pub fn check(design: &Design, pixels: &[Pixel]) -> Result<(), Fault> {
    let (rows, columns) = (design.scan.rows, design.scan.columns);
    let is_outside =
        |(row, column): &&Pixel| u32::from(*row) >= rows || u32::from(*column) >= columns;
    match pixels.iter().find(is_outside) {
        None => Ok(()),
        Some((row, column)) => Err(Fault::Wrong(format!(
            "--explain {row},{column}: {} has rows 0 to {} and columns 0 to {}",
            design.name,
            rows - 1,
            columns - 1
        ))),
    }
}

/// The owned shot of `log` to `pixel`, if there is one.
pub fn shot_of(log: &ShotLog, (row, column): Pixel) -> Option<usize> {
    log.owned.clone().find(|&shot| (log.row[shot], log.column[shot]) == (row, column))
}

/// What a receiver tells of its decision.
enum Told {
    Ticks(Explanation),
    Samples(SampledExplanation),
}

impl Told {
    /// When the marks of the macropulse leave, in ticks after it was fired.
    fn marks(&self) -> &[u32] {
        match self {
            Self::Ticks(told) => &told.marks,
            Self::Samples(told) => &told.marks,
        }
    }

    /// The absolute tick in which the shot was fired.
    fn fired_tick(&self) -> i64 {
        match self {
            Self::Ticks(told) => told.fired_tick,
            Self::Samples(told) => told.fired_tick,
        }
    }

    /// Lags that are accepted.
    fn gate(&self) -> &Range<i64> {
        match self {
            Self::Ticks(told) => &told.gate,
            Self::Samples(told) => &told.gate,
        }
    }

    /// For how many ticks a mark is looked for.
    fn width(&self) -> u32 {
        match self {
            Self::Ticks(told) => told.width,
            Self::Samples(_) => 1,
        }
    }

    fn verdict(&self) -> &Verdict {
        match self {
            Self::Ticks(told) => &told.verdict,
            Self::Samples(told) => &told.verdict,
        }
    }
}

/// A shot explained, with what is needed to speak of it.
pub struct Explained<'a> {
    design: &'a Design,
    pixel: Pixel,
    /// Id of the shot, counted from the first one of the first scan.
    id: u64,
    fired_fs: i64,
    label: u16,
    word: u16,
    /// Pixels of the other shots whose light is there.
    others: Vec<Pixel>,
    told: Told,
    /// Channel of its detector.
    channel: u16,
    /// What came to the detector, where that is known.
    arrivals: Option<Arrivals>,
}

impl<'a> Explained<'a> {
    /// The shot number `shot` of a band, explained out of its ticks or samples.
    pub fn of(
        design: &'a Design,
        (log, given): (&ShotLog, &Given),
        shot: usize,
    ) -> Result<Self, Fault> {
        let (receiver, codebook) = (&design.receiver, &design.coding.codebook);
        let told = match given {
            Given::Ticks(ticks) => receiver.explain(codebook, (log, ticks), shot).map(Told::Ticks),
            Given::Samples(samples) => {
                receiver.explain_samples(codebook, (log, samples), shot).map(Told::Samples)
            }
        };
        let told = told.map_err(|error| Fault::Wrong(error.to_string()))?;
        let others: Vec<usize> = match &told {
            Told::Ticks(told) => told.others.iter().map(|other| other.shot).collect(),
            Told::Samples(told) => told.cancelled.iter().map(|other| other.shot).collect(),
        };
        let pixel = |shot: usize| (log.row[shot], log.column[shot]);
        Ok(Self {
            design,
            pixel: pixel(shot),
            id: log.first + shot as u64,
            fired_fs: log.fired_at_fs[shot],
            label: log.label[shot],
            word: log.word[shot],
            others: others.into_iter().map(pixel).collect(),
            told,
            channel: log.channel[shot],
            arrivals: None,
        })
    }

    /// The time that is explained: from the shot, or where its gate opens, to the end of the last
    /// macropulse within the gate.
    pub fn stretch(&self) -> Stretch {
        let gate = self.told.gate();
        let lasts = self.told.marks().last().map_or(0, |last| last + self.told.width());
        let ticks = gate.start.min(0)..gate.end + i64::from(lasts);
        Stretch { channel: self.channel, from: self.told.fired_tick(), ticks }
    }

    /// The same with what came to the detector in [`Self::stretch`]: of a simulation it is known.
    pub fn with(self, arrivals: Arrivals) -> Self {
        Self { arrivals: Some(arrivals), ..self }
    }

    /// The range, m, of light that comes `lag` ticks after the shot.
    fn range(&self, lag: i64) -> f64 {
        let tick_fs = self.design.tdc.tick_fs;
        // A tick is taken for its middle, a sample for its beginning.
        let half = if self.design.is_sampled() { 0 } else { tick_fs / 2 };
        let since_fs = (self.told.fired_tick() + lag) * tick_fs - self.fired_fs + half;
        range_from_tof(s_from_fs(since_fs))
    }

    /// What is told to programs, the correlation apart.
    pub fn json(&self) -> Value {
        let verdict = self.told.verdict();
        let returns = verdict.returns.iter().map(|one| {
            json!({
                "range_m": range_from_tof(one.tof),
                "peak": one.peak,
                "marks": one.marks,
                "margin": one.margin,
                "photons": one.photons,
            })
        });
        let gate = self.told.gate();
        let mut json = json!({
            "row": self.pixel.0,
            "column": self.pixel.1,
            "shot": self.id,
            "fired_at_fs": self.fired_fs,
            "label": self.label,
            "code_word": self.word,
            "decided": self.decided(),
            "why": self.why(),
            "returns": returns.collect::<Vec<_>>(),
            "rejects": verdict.rejects.iter().map(|(kind, _)| kind.name()).collect::<Vec<_>>(),
            "marks_ticks": self.told.marks(),
            "gate_ticks": [gate.start, gate.end - 1],
            "light": self.light_json(),
        });
        match &self.told {
            Told::Ticks(told) => self.add_ticks(told, &mut json),
            Told::Samples(told) => self.add_samples(told, &mut json),
        }
        json
    }

    /// The same with every tick, or the signal, and every lag.
    fn whole_json(&self) -> Value {
        let mut json = self.json();
        self.add_arrivals(&mut json["light"]);
        match &self.told {
            Told::Ticks(told) => self.add_all_ticks(told, &mut json),
            Told::Samples(told) => self.add_signal(told, &mut json),
        }
        json
    }

    /// Writes what is said of it, and its picture, into `folder`, and gives the names of the files.
    pub fn write(&self, folder: &Path) -> Result<Vec<String>, Fault> {
        let (row, column) = self.pixel;
        let scan = self.id / self.design.shots_per_scan();
        let whole = self.whole_json();
        let picture = pixel_picture(&whole);
        let png = picture.png().map_err(|error| Fault::Ours(error.to_string()))?;
        let contents = [
            self.text().into_bytes(),
            versioned(whole).to_string().into_bytes(),
            picture.svg().into_bytes(),
            png,
        ];
        let files = names(scan, (row, column));
        for (file, bytes) in files.iter().zip(contents) {
            write_atomically(&folder.join(file), |out| out.write_all(&bytes))?;
        }
        Ok(files.into())
    }
}

/// Names of the files that explain a pixel of a scan.
pub fn names(scan: u64, (row, column): Pixel) -> [String; 4] {
    ["txt", "json", "svg", "png"].map(|ending| format!("explain-{scan:06}-{row}-{column}.{ending}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pixel_is_two_numbers() {
        assert_eq!(pixel("3, 4"), Ok((3, 4)));
        assert!(pixel("3").is_err() && pixel("-1,2").is_err() && pixel("1,2,3").is_err());
    }
}

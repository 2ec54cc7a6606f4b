//! Why a shot was decided as it was: for people, for programs, and as a picture.

mod light;
mod text;

use std::path::Path;

use macropulse::codec::decode::Error;
use macropulse::codec::decode::Explanation;
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
    if !pixels.is_empty() && design.receiver.sampling.is_some() {
        return Err(Fault::Wrong(format!(
            "--explain: {} is sampled, and explained are decisions by ticks alone: leave it out",
            design.name
        )));
    }
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
    explanation: Explanation,
    /// Channel of its detector.
    channel: u16,
    /// What came to the detector, where that is known.
    arrivals: Option<Arrivals>,
}

impl<'a> Explained<'a> {
    /// The shot number `shot` of a band, explained out of its ticks.
    pub fn of(
        design: &'a Design,
        (log, given): (&ShotLog, &Given),
        shot: usize,
    ) -> Result<Self, Fault> {
        let codebook = &design.coding.codebook;
        let explanation = match given {
            Given::Ticks(ticks) => design.receiver.explain(codebook, (log, ticks), shot),
            Given::Samples(_) => Err(Error::SamplesAreNotExplained),
        };
        let explanation = explanation.map_err(|error| Fault::Wrong(error.to_string()))?;
        let pixel = |shot: usize| (log.row[shot], log.column[shot]);
        Ok(Self {
            design,
            pixel: pixel(shot),
            id: log.first + shot as u64,
            fired_fs: log.fired_at_fs[shot],
            label: log.label[shot],
            word: log.word[shot],
            others: explanation.others.iter().map(|other| pixel(other.shot)).collect(),
            explanation,
            channel: log.channel[shot],
            arrivals: None,
        })
    }

    /// The time that is explained: from the shot, or where its gate opens, to the end of the last
    /// macropulse within the gate.
    pub fn stretch(&self) -> Stretch {
        let Explanation { fired_tick, gate, marks, width, .. } = &self.explanation;
        let lasts = i64::from(marks.last().map_or(0, |last| last + width));
        let ticks = gate.start.min(0)..gate.end + lasts;
        Stretch { channel: self.channel, from: *fired_tick, ticks }
    }

    /// The same with what came to the detector in [`Self::stretch`]: of a simulation it is known.
    pub fn with(self, arrivals: Arrivals) -> Self {
        Self { arrivals: Some(arrivals), ..self }
    }

    /// The range, m, of light that comes `lag` ticks after the shot.
    fn range(&self, lag: i64) -> f64 {
        let tick_fs = self.design.tdc.tick_fs;
        let since_fs = (self.explanation.fired_tick + lag) * tick_fs - self.fired_fs + tick_fs / 2;
        range_from_tof(s_from_fs(since_fs))
    }

    /// What is told to programs, the correlation apart.
    pub fn json(&self) -> Value {
        let Explanation { verdict, .. } = &self.explanation;
        let at = |place: Option<(i64, u16)>| {
            place.map(|(lag, marks)| {
                json!({ "lag_ticks": lag, "range_m": self.range(lag), "marks": marks })
            })
        };
        let returns: Vec<Value> = verdict
            .returns
            .iter()
            .map(|one| {
                json!({
                    "range_m": range_from_tof(one.tof),
                    "peak": one.peak,
                    "marks": one.marks,
                    "margin": one.margin,
                    "photons": one.photons,
                })
            })
            .collect();
        let others = self.explanation.others.iter().zip(&self.others);
        let others: Vec<Value> = others
            .map(|(other, (row, column))| {
                json!({
                    "row": row,
                    "column": column,
                    "begins_ticks": other.begins,
                    "marks": other.marks,
                    "shared": other.shared,
                })
            })
            .collect();
        json!({
            "row": self.pixel.0,
            "column": self.pixel.1,
            "shot": self.id,
            "fired_at_fs": self.fired_fs,
            "label": self.label,
            "code_word": self.word,
            "decided": self.decided(),
            "why": self.why(),
            "returns": returns,
            "rejects": verdict.rejects.iter().map(|(kind, _)| kind.name()).collect::<Vec<_>>(),
            "marks_ticks": self.explanation.marks,
            "gate_ticks": [self.explanation.gate.start, self.explanation.gate.end - 1],
            "window_ticks": self.explanation.width,
            "ticks_in_time": self.explanation.ticks.len(),
            "ticks_of_others": self.claimed(),
            "density": self.explanation.density,
            "threshold_marks": self.explanation.threshold,
            "light": self.light_json(),
            "peak": at(self.explanation.peak),
            "sidelobe": at(self.explanation.sidelobe),
            "others": others,
        })
    }

    /// The same with every tick and every lag.
    fn whole_json(&self) -> Value {
        let mut json = self.json();
        let Explanation { ticks, gate, step, found, left, .. } = &self.explanation;
        json["ticks"] = ticks.iter().map(|(tick, _)| *tick).collect();
        json["is_of_others"] = ticks.iter().map(|(_, claimed)| *claimed).collect();
        self.add_arrivals(&mut json["light"]);
        json["correlation"] = json!({
            "first_lag_ticks": gate.start,
            "step_ticks": step,
            "first_range_m": self.range(gate.start),
            "step_m": self.range(gate.start + step) - self.range(gate.start),
            "marks": found,
            "marks_without_others": left,
        });
        json
    }

    /// Writes what is said of it, and its picture, into `folder`, and gives the names of the files.
    pub fn write(&self, folder: &Path) -> Result<Vec<String>, Fault> {
        let (row, column) = self.pixel;
        let scan = self.id / self.design.shots_per_scan();
        let name = format!("explain-{scan:06}-{row}-{column}");
        let whole = self.whole_json();
        let picture = pixel_picture(&whole);
        let png = picture.png().map_err(|error| Fault::Ours(error.to_string()))?;
        let files = [
            (format!("{name}.txt"), self.text().into_bytes()),
            (format!("{name}.json"), versioned(whole).to_string().into_bytes()),
            (format!("{name}.svg"), picture.svg().into_bytes()),
            (format!("{name}.png"), png),
        ];
        for (file, bytes) in &files {
            write_atomically(&folder.join(file), |out| out.write_all(bytes))?;
        }
        Ok(files.into_iter().map(|(file, _)| file).collect())
    }

    /// How many ticks other shots account for.
    fn claimed(&self) -> usize {
        self.explanation.ticks.iter().filter(|(_, claimed)| *claimed).count()
    }
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

//! Light at the detector in the time of a shot: known where it was simulated.

use macropulse::sim::{Arrival, Arrivals};
use serde::{Deserialize, Serialize};

use super::Shot;
use crate::text::{counted, grouped, short};

/// Pulse trains of a shot that text lists one by one.
const MOST_TRAINS: usize = 3;

/// Light and detection events in the time of a shot.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Light {
    /// Light of this shot, in the order in which it comes.
    of_this_shot: Vec<Train>,
    trains_of_others: usize,
    detections: usize,
    background_hz: f64,
    /// All of them; nothing in a summary.
    #[serde(flatten)]
    pub times: Option<Times>,
}

/// Light of this shot along one way.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Train {
    /// The range that it comes from; `None` for a part of a macropulse.
    range_m: Option<f64>,
    /// Photons per mark; `None` for more than the detector can miss.
    photons: Option<f64>,
    marks: usize,
}

/// When light and detection events come.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Times {
    trains: Vec<TrainTimes>,
    detections_ticks: Vec<f64>,
}

#[derive(Debug, Clone, Serialize, Deserialize)]
struct TrainTimes {
    of: Sender,
    shot: u64,
    photons: Option<f64>,
    marks_ticks: Vec<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Sender {
    ThisShot,
    AnotherShot,
    AnotherLidar,
}

impl Light {
    /// The light of `arrivals` in the time of `shot`, whose marks leave at the ticks `sent`.
    pub fn new(arrivals: &Arrivals, shot: &Shot, sent: &[u32]) -> Self {
        let sender = |train: &Arrival| match train.transmitter {
            0 if train.shot == shot.id() => Sender::ThisShot,
            0 => Sender::AnotherShot,
            _ => Sender::AnotherLidar,
        };
        let photons = |train: &Arrival| train.photons.is_finite().then_some(train.photons);
        let comes_from = |train: &Arrival| {
            let (first, arrives) = (sent.first()?, train.marks.first()?);
            let lag = arrives.floor() as i64 - i64::from(*first);
            (train.marks.len() == sent.len()).then(|| shot.range(lag))
        };
        let round = |ticks: &f64| (ticks * 64.0).round() / 64.0;
        let trains = arrivals.trains.iter();
        let ours = trains.clone().filter(|train| sender(train) == Sender::ThisShot);
        let of_this_shot: Vec<Train> = ours
            .map(|train| Train {
                range_m: comes_from(train),
                photons: photons(train),
                marks: train.marks.len(),
            })
            .collect();
        let trains = trains.map(|train| TrainTimes {
            of: sender(train),
            shot: train.shot,
            photons: photons(train),
            marks_ticks: train.marks.iter().map(round).collect(),
        });
        Self {
            trains_of_others: arrivals.trains.len() - of_this_shot.len(),
            of_this_shot,
            detections: arrivals.events.len(),
            background_hz: arrivals.background,
            times: Some(Times {
                trains: trains.collect(),
                detections_ticks: arrivals.events.iter().map(round).collect(),
            }),
        }
    }

    /// All of it for people, in one line; with the number of detection events if it `has_events`.
    pub fn text(&self, has_events: bool) -> String {
        let ours = &self.of_this_shot;
        let mut said: Vec<String> = match ours.len() {
            0 => vec!["none of this shot".to_owned()],
            1..=MOST_TRAINS => ours.iter().map(Train::text).collect(),
            // A footprint of many rays has a train of each.
            all => {
                let photons = |train: &Train| train.photons.unwrap_or(f64::INFINITY);
                let photons: f64 =
                    ours.iter().map(|train| photons(train) * train.marks as f64).sum();
                vec![format!(
                    "{all} pulse trains of this shot, {} photons in all",
                    short(round(photons))
                )]
            }
        };
        said.push(format!(
            "{} of other shots",
            counted(self.trains_of_others as u64, "pulse train")
        ));
        if has_events {
            said.push(counted(self.detections as u64, "detection event"));
        }
        said.push(format!("background {} /s", grouped(self.background_hz.round() as u64)));
        said.join("; ")
    }

    /// When marks of this shot and of others arrive and when the detector fires, ticks since the
    /// shot.
    pub fn lanes(&self) -> [Vec<f64>; 3] {
        let [mut ours, mut others] = [Vec::new(), Vec::new()];
        let trains = self.times.iter().flat_map(|times| &times.trains);
        for TrainTimes { of, marks_ticks, .. } in trains {
            let lane = if *of == Sender::ThisShot { &mut ours } else { &mut others };
            lane.extend(marks_ticks);
        }
        let events = self.times.iter().flat_map(|times| times.detections_ticks.clone());
        [ours, others, events.collect()]
    }
}

impl Train {
    fn text(&self) -> String {
        let photons = match self.photons {
            Some(photons) => format!("{} photons a mark", short(round(photons))),
            None => "more than the detector can miss".to_owned(),
        };
        let marks = counted(self.marks as u64, "mark");
        let from = self.range_m.map(|m| format!(" from {} m", short(m)));
        format!("{marks} of this shot{}, {photons}", from.unwrap_or_default())
    }
}

/// Three digits behind the point.
fn round(value: f64) -> f64 {
    (value * 1e3).round() / 1e3
}

#[cfg(test)]
pub(super) mod tests {
    use serde_json::{Value, json};

    pub fn light() -> Value {
        let train = |of: &str, marks: &[f64]| json!({ "of": of, "shot": 7, "photons": 3.5, "marks_ticks": marks });
        json!({
            "of_this_shot": [{ "range_m": 30.5, "photons": null, "marks": 4 }],
            "trains_of_others": 2, "detections": 4, "background_hz": 1e6,
            "trains": [
                train("this_shot", &[41.5, 46.5, 50.5, 61.5]),
                train("another_shot", &[47.25, 300.0]),
                train("another_lidar", &[44.0]),
            ],
            "detections_ticks": [41.75, 46.5, 47.25, 500.0],
        })
    }
}

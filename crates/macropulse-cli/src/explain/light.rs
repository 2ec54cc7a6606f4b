//! What came to the detector in the time of a shot: known where it was simulated.

use macropulse::sim::Arrival;
use serde_json::{Value, json};

use super::Explained;
use crate::text::{counted, grouped, short};

impl Explained<'_> {
    /// Light of this shot, in the order in which it comes.
    fn ours(&self) -> impl Iterator<Item = &Arrival> {
        let trains = self.arrivals.iter().flat_map(|arrivals| &arrivals.trains);
        trains.filter(|train| self.is_ours(train))
    }

    fn is_ours(&self, train: &Arrival) -> bool {
        (train.transmitter, train.shot) == (0, self.id)
    }

    /// The range, m, from which a macropulse comes; of part of one it is not told.
    fn comes_from(&self, train: &Arrival) -> Option<f64> {
        let sent = self.told.marks();
        let (first, arrives) = (sent.first()?, train.marks.first()?);
        let lag = arrives.floor() as i64 - i64::from(*first);
        (train.marks.len() == sent.len()).then(|| self.range(lag))
    }

    /// Light and detection events in short, for programs; null where it is not known.
    pub(super) fn light_json(&self) -> Value {
        let Some(arrivals) = &self.arrivals else { return Value::Null };
        let ours = self.ours().map(|train| {
            json!({
                "range_m": self.comes_from(train),
                "photons": train.photons,
                "marks": train.marks.len(),
            })
        });
        json!({
            "of_this_shot": ours.collect::<Vec<_>>(),
            "trains_of_others": arrivals.trains.len() - self.ours().count(),
            "detections": arrivals.events.len(),
            "background_hz": arrivals.background,
        })
    }

    /// Adds all of them to the same.
    pub(super) fn add_arrivals(&self, light: &mut Value) {
        let Some(arrivals) = &self.arrivals else { return };
        let round = |ticks: f64| (ticks * 64.0).round() / 64.0;
        let trains = arrivals.trains.iter().map(|train| {
            let of = match train.transmitter {
                0 if train.shot == self.id => "this_shot",
                0 => "another_shot",
                _ => "another_lidar",
            };
            let marks: Vec<f64> = train.marks.iter().copied().map(round).collect();
            json!({
                "of": of,
                "shot": train.shot,
                "photons": train.photons,
                "marks_ticks": marks,
            })
        });
        light["trains"] = trains.collect();
        light["detections_ticks"] = arrivals.events.iter().copied().map(round).collect();
    }

    /// The same for people.
    pub(super) fn light_text(&self) -> String {
        let Some(arrivals) = &self.arrivals else {
            let recorded = if self.design.is_sampled() { "samples" } else { "ticks" };
            return format!("not known: what is decoded is {recorded} alone");
        };
        let ours: Vec<&Arrival> = self.ours().collect();
        let mut said: Vec<String> = match ours.len() {
            0..=MOST_TRAINS => ours.iter().map(|train| self.train_text(train)).collect(),
            // Of a footprint every ray has some.
            all => {
                let photons: f64 =
                    ours.iter().map(|train| train.photons * train.marks.len() as f64).sum();
                vec![format!(
                    "{all} pulse trains of this shot, {} photons in all",
                    short(round(photons))
                )]
            }
        };
        if said.is_empty() {
            said.push("none of this shot".to_owned());
        }
        let others = (arrivals.trains.len() - ours.len()) as u64;
        said.push(format!("{} of other shots", counted(others, "pulse train")));
        if !self.design.is_sampled() {
            said.push(counted(arrivals.events.len() as u64, "detection event"));
        }
        said.push(format!("background {} /s", grouped(arrivals.background.round() as u64)));
        said.join("; ")
    }

    /// A pulse train of this shot.
    fn train_text(&self, train: &Arrival) -> String {
        let photons = match train.photons.is_finite() {
            true => format!("{} photons a mark", short(round(train.photons))),
            false => "more than the detector can miss".to_owned(),
        };
        let marks = counted(train.marks.len() as u64, "mark");
        let from = self.comes_from(train).map(|m| format!(" from {} m", short(m)));
        format!("{marks} of this shot{}, {photons}", from.unwrap_or_default())
    }
}

/// So many pulse trains of a shot are told one by one.
const MOST_TRAINS: usize = 3;

/// Three digits behind the point.
fn round(value: f64) -> f64 {
    (value * 1e3).round() / 1e3
}

//! Results of the experiment, as plain numbers.

use crate::paper::experiment::Trial;
use crate::paper::receivers::Comparison;
use crate::paper::walls::Wall;
use macropulse::points::Outcome;

/// Results of the experiment.
#[derive(Debug, Clone, Default)]
pub struct Experiment {
    /// Every sensor at every distance.
    pub seen: Vec<Seen>,
    /// Receivers compared.
    pub shares: Vec<Share>,
    /// A wall near by and one far away, by sensor.
    pub walls: Vec<[Wall; 2]>,
}

/// The car, as one sensor sees it at one distance.
#[derive(Debug, Clone)]
pub struct Seen {
    /// The sensor.
    pub sensor: &'static str,
    /// Distance of the car's front.
    pub distance: u32,
    /// Rays that meet the car.
    pub samples: u64,
    /// Points on it.
    pub points: u64,
    /// Samples that its silhouette predicts.
    pub predicted: f64,
    /// With one row and one column less, and with one more.
    pub band: (f64, f64),
    /// Rows with a point on the car.
    pub rows: usize,
    /// How far the car goes on below the field.
    pub cut_off: f64,
    /// How far apart the lowest rows are there.
    pub row_apart: f64,
    /// Height of the lowest sample above the ground; NaN without one.
    pub lowest_sample: f64,
    /// Height of the sensor above the ground.
    pub stands: f64,
    /// Height of the lower edge of the field below the sensor, at the car.
    pub edge: f64,
    /// Median range error of the points on the car; NaN without one.
    pub bias: f64,
    /// Root of their mean squared range error; NaN without one.
    pub error: f64,
    /// Converters busy at a time, at most.
    pub busy: u32,
    /// Detection events lost because all converters were busy.
    pub lost: u64,
}

/// Result of one receiver under one condition.
#[derive(Debug, Clone)]
pub struct Share {
    /// The sensor.
    pub sensor: &'static str,
    /// The detector, named by its losses.
    pub detector: &'static str,
    /// The receiver.
    pub receiver: &'static str,
    /// Share of the pixels with an echo that come out right.
    pub right: f64,
}

impl Experiment {
    pub(in crate::paper) fn of(trials: &[Trial], comparisons: &[Comparison]) -> Self {
        let seen = |trial: &Trial| Seen {
            sensor: trial.sensor,
            distance: trial.distance,
            samples: trial.score.samples_on_target,
            points: trial.score.points_on_target,
            predicted: trial.predicted.samples,
            band: (trial.predicted.low, trial.predicted.high),
            rows: trial.rows_on_car,
            cut_off: trial.predicted.cut_off * f64::from(trial.distance),
            row_apart: trial.row_apart,
            lowest_sample: trial.lowest_sample,
            stands: trial.stands,
            edge: trial.edge,
            bias: trial.bias,
            error: trial.error,
            busy: trial.tally.peak_busy,
            lost: trial.tally.lost,
        };
        let share = |c: &Comparison| Share {
            sensor: c.sensor,
            detector: c.detector,
            receiver: c.receiver,
            right: c.share(Outcome::Right),
        };
        Self {
            seen: trials.iter().map(seen).collect(),
            shares: comparisons.iter().map(share).collect(),
            walls: Vec::new(),
        }
    }

    /// Returns the car as `sensor` saw it at `distance` metres.
    pub fn at(&self, sensor: &str, distance: u32) -> Option<&Seen> {
        self.seen.iter().find(|seen| seen.sensor == sensor && seen.distance == distance)
    }

    /// Returns the share of pixels that `receiver` gets right for `sensor` with `detector`; NaN if that was
    /// not tried.
    pub fn right(&self, sensor: &str, detector: &str, receiver: &str) -> f64 {
        let is = |s: &&Share| (s.sensor, s.detector, s.receiver) == (sensor, detector, receiver);
        self.shares.iter().find(is).map_or(f64::NAN, |share| share.right)
    }
}

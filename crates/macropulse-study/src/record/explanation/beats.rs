//! The explanation of a shot whose frequency is modulated: the peaks of its spectra, and what they say together.

use macropulse::codec::decode::beat::{BeatReceiver, Candidate, Refused, candidates};
use macropulse::codec::decode::{self, Method, Verdict};
use macropulse::codec::{Beats, Peak, RecordKind};
use macropulse::design::Design;
use macropulse::units::range_from_tof;
use serde::{Deserialize, Serialize};

use super::curve::Scale;
use super::{OfShot, RecordExplanation, Sent, Shot};
use crate::text::{Columns, short};
use crate::view::{Axis, Chart, Hue, Series, Style};

/// The peaks of a shot.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Spectra {
    ramps: Vec<RampPeaks>,
    /// Power from which on the peaks of a return are accepted together, in units of the mean of noise.
    threshold: f64,
    /// The measurements that peaks of all ramps make together, the strongest first.
    candidates: Vec<Pair>,
    scale: Scale,
}

/// The peaks of a ramp.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct RampPeaks {
    /// Change of the frequency per second, MHz/µs; negative where it falls.
    slope_mhz_us: f64,
    /// Power from which on a peak is recorded.
    least_power: f64,
    peaks: Vec<Beat>,
}

/// A peak.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Beat {
    frequency_mhz: f64,
    /// In units of the mean of noise.
    power: f64,
    /// Range of a surface that stands still.
    range_m: f64,
}

/// A candidate.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Pair {
    range_m: f64,
    radial_velocity_m_s: Option<f64>,
    power: f64,
    decided: String,
}

impl OfShot for Spectra {
    type Record = Beats;

    fn of(design: &Design, beats: &Beats, at: usize, shot: &Shot) -> Result<Self, decode::Error> {
        let (peaks, scale) = (beats.of(at), Scale::new(0, 1, shot));
        let none = Self { ramps: Vec::new(), threshold: 0.0, candidates: Vec::new(), scale };
        let Method::Beat(method) = &design.receiver.method else { return Ok(none) };
        let receiver = BeatReceiver::of(&design.receiver, method);
        let threshold = method.threshold(receiver.gate_fs);
        let each = peaks.len() / method.ramps.len().max(1);
        let ramps = method.ramps.iter().zip(peaks.chunks(each.max(1))).map(|(ramp, peaks)| {
            let beat = |peak: &Peak| Beat {
                frequency_mhz: peak.bins() / ramp.seconds * 1e-6,
                power: peak.power(),
                range_m: range_from_tof(peak.bins() / ramp.bandwidth.abs()),
            };
            RampPeaks {
                slope_mhz_us: ramp.bandwidth / ramp.seconds * 1e-12,
                least_power: method.least_power,
                peaks: peaks.iter().filter(|peak| peak.power > 0).map(beat).collect(),
            }
        });
        let pair = |one: Candidate| Pair {
            range_m: range_from_tof(one.tof),
            radial_velocity_m_s: one.radial_velocity,
            power: one.power,
            decided: match one.refused {
                None => ACCEPTED,
                Some(Refused::Faint) => "no more than noise makes",
                Some(Refused::Range) => "outside the range gate",
                Some(Refused::Speed) => "faster than receiver.max_speed_m_s",
                Some(Refused::Taken) => "has a peak of a stronger one",
            }
            .to_owned(),
        };
        let candidates = candidates(&receiver, threshold, peaks).into_iter().map(pair).collect();
        Ok(Self { ramps: ramps.collect(), threshold, candidates, ..none })
    }

    fn why(&self, verdict: &Verdict) -> String {
        match (verdict.returns.first(), self.candidates.first()) {
            (Some(_), Some(best)) => format!(
                "The peaks of all ramps together have {} times the mean power of noise, and {} are asked for.",
                short(best.power),
                short(self.threshold)
            ),
            (None, Some(best)) => format!(
                "The strongest peaks of all ramps, {} times the mean power of noise together, are {}.",
                short(best.power),
                best.decided
            ),
            (_, None) => "A ramp has no peak that noise would not have.".to_owned(),
        }
    }
}

impl RecordExplanation for Spectra {
    fn kind(&self) -> RecordKind {
        RecordKind::Beats
    }

    fn scale(&self) -> Option<&Scale> {
        Some(&self.scale)
    }

    /// Adds a line for each ramp, and one for each candidate of the first few.
    fn push(&self, _: usize, columns: &mut Columns) {
        for ramp in &self.ramps {
            let told = |beat: &Beat| {
                format!(
                    "{} MHz ({} m) {}",
                    short(beat.frequency_mhz),
                    short(beat.range_m),
                    short(beat.power)
                )
            };
            let peaks: Vec<String> = ramp.peaks.iter().map(told).collect();
            let peaks = if peaks.is_empty() { "none".to_owned() } else { peaks.join(", ") };
            let name = format!("{} MHz/us", short(ramp.slope_mhz_us));
            columns.push(&name, format!("peaks with their powers: {peaks}"));
        }
        for (number, pair) in self.candidates.iter().take(MOST_TOLD).enumerate() {
            let velocity = match pair.radial_velocity_m_s {
                Some(velocity) => format!(", {} m/s", short(velocity)),
                None => String::new(),
            };
            let told = format!(
                "{} m{velocity}: power {}, {}",
                short(pair.range_m),
                short(pair.power),
                pair.decided
            );
            columns.push(if number == 0 { "pairs" } else { "" }, told);
        }
    }

    /// The powers of the peaks over the ranges of surfaces that would stand still.
    fn charts(&self, _: &Sent) -> Option<Vec<(Chart, &'static str)>> {
        let peaks = self.ramps.iter().flat_map(|ramp| &ramp.peaks);
        let pairs = self.candidates.iter().map(|pair| pair.power);
        let most = pairs.chain(peaks.clone().map(|peak| peak.power)).fold(self.threshold, f64::max);
        let farthest = peaks.map(|peak| peak.range_m).fold(1.0, f64::max) * 1.05;
        let least = self.ramps.iter().map(|ramp| ramp.least_power).fold(most, f64::min);
        let x = Axis::linear("Range of a surface that stands still, m").limits(0.0, farthest);
        let y = Axis::log("Power over noise").limits(least / 2.0, most * 2.0);
        let mut chart = Chart::new("Peaks of the spectra", x, y);
        chart.size = [904.0, 320.0];
        for (ramp, hue) in self.ramps.iter().zip([Hue::Blue, Hue::Orange]) {
            chart.series.push(Series {
                label: format!("{} MHz/us", short(ramp.slope_mhz_us)),
                points: ramp.peaks.iter().map(|peak| [peak.range_m, peak.power]).collect(),
                style: Style::Points,
                hue,
            });
        }
        let accepted = self.candidates.iter().filter(|pair| pair.decided == ACCEPTED);
        chart.series.push(Series {
            label: "return".to_owned(),
            points: accepted.map(|pair| [pair.range_m, pair.power]).collect(),
            style: Style::Points,
            hue: Hue::Green,
        });
        Some(vec![(
            chart,
            "A surface that approaches has its peak nearer in the rising ramp, and farther in the falling one, by the \
             same distance: its range is in the middle, and half their distance is its speed.",
        )])
    }
}

/// Said of a candidate that is a return.
const ACCEPTED: &str = "accepted";

/// Candidates that the text tells.
const MOST_TOLD: usize = 4;

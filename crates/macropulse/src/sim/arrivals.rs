//! Light and detection events at a detector in the time of one shot, for people who ask why the shot was
//! decided as it was. Truth: no receiver is given it.

use std::ops::Range;

use super::Setup;
use crate::channel;
use crate::design::PARTS_OF_TICK;
use crate::detect::Memory;
use crate::emit::Band;

/// A detector and a stretch of time to look at.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Stretch {
    /// Channel of the detector.
    pub channel: u16,
    /// Absolute tick that times are counted from.
    pub from: i64,
    /// Ticks after that.
    pub ticks: Range<i64>,
}

/// Light and detection events in a [`Stretch`] of time, in ticks after its `from`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Arrivals {
    /// The pulse trains, in the order in which they begin.
    pub trains: Vec<Arrival>,
    /// When the detector fires, ascending.
    pub events: Vec<f64>,
    /// Detections per second of light without pulses and of darkness, the mean over the time.
    pub background: f64,
}

/// Light of one shot along one way.
#[derive(Debug, Clone, PartialEq)]
pub struct Arrival {
    /// Whose light it is: 0 the sensor itself, then the interferers.
    pub transmitter: u16,
    /// Number of the shot by its transmitter's own count.
    pub shot: u64,
    /// Mean number of photons detected per mark; infinite for a detector that never misses.
    pub photons: f64,
    /// When its marks arrive.
    pub marks: Vec<f64>,
}

/// Returns light and detection events in `stretch` of the time of `band`, whose log has the shots of all that
/// light.
pub(super) fn arrivals(setup: &Setup, band: &Band, stretch: &Stretch) -> Arrivals {
    let Setup { seen, detectors } = setup;
    let design = seen.design;
    let log = band.shot_log(design);
    let traced = seen.scene.trace(design, &log);
    let light = channel::light(seen, &log, &traced);
    let found = detectors.detections(&log, &light, &mut Memory::default());
    let tick_fs = design.clock.tick_fs;
    let after = |fs: i64| (fs - stretch.from * tick_fs) as f64 / tick_fs as f64;
    let (opens, closes) = (stretch.ticks.start as f64, stretch.ticks.end as f64);
    let is_within = |tick: &f64| (opens..closes).contains(tick);
    let ours = (0..light.trains.len()).filter(|at| light.trains.channel[*at] == stretch.channel);
    let mut trains: Vec<Arrival> = ours
        .map(|at| Arrival {
            transmitter: light.trains.transmitter[at],
            shot: light.trains.shot[at],
            photons: light.trains.photons[at] * design.efficiency(),
            marks: light.arrivals_fs(at).map(after).filter(is_within).collect(),
        })
        .filter(|train| !train.marks.is_empty())
        .collect();
    trains.sort_by(|one, other| one.marks[0].total_cmp(&other.marks[0]));
    let parts = f64::from(PARTS_OF_TICK);
    let events = (0..found.time.len())
        .filter(|at| found.channel.get(*at).is_none_or(|channel| *channel == stretch.channel))
        .map(|at| (found.epoch - stretch.from) as f64 + f64::from(found.time[at]) / parts);
    let sky = &light.background;
    let bright = (0..sky.channel.len()).filter(|at| sky.channel[*at] == stretch.channel);
    let share = |at: usize| {
        let lasts = after(sky.until_fs[at]).min(closes) - after(sky.from_fs[at]).max(opens);
        lasts.max(0.0) / (closes - opens).max(1.0)
    };
    Arrivals {
        trains,
        events: events.filter(is_within).collect(),
        background: design.efficiency()
            * (sky.steady + bright.map(|at| sky.per_s[at] * share(at)).sum::<f64>()),
    }
}

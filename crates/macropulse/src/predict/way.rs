//! The ways to measure whose findings have a closed form of their own.

use std::fmt::Debug;
use std::sync::Arc;

use macropulse_codec::decode::Method;

use super::unmodelled::Unmodelled;
use super::{beat, histogram, phase};
use crate::design::Design;

/// A way to measure other than by marks, as forecasts see it.
pub(super) struct Way {
    /// The first property of a sensor without a closed form, and a way to get an answer all the same.
    pub not_modelled: fn(&Design) -> Option<(String, String)>,
    /// The closed form of a sensor.
    pub closed_form: fn(&Design) -> Option<Arc<dyn ClosedForm>>,
    /// The reason why more light may not find a target: a clause for people.
    pub limit_of_light: &'static str,
    /// Sizes, as clauses for people, of effects that are not modelled; `None` of those that do not occur or are
    /// simulated. Other effects are as large as with marks.
    pub effects: &'static [(Unmodelled, Option<&'static str>)],
}

/// The way of `design`; `None` of receivers that decide by marks or their samples.
pub(super) fn of(design: &Design) -> Option<&'static Way> {
    match design.receiver.method {
        Method::Histogram(_) => Some(&histogram::WAY),
        Method::Phase(_) => Some(&phase::WAY),
        Method::Beat(_) => Some(&beat::WAY),
        Method::Bitwise(_)
        | Method::Matched(..)
        | Method::Balanced(_)
        | Method::Direct
        | Method::Sampled(_) => None,
    }
}

/// The closed form of a sensor.
pub(super) trait ClosedForm: Debug + Send + Sync {
    /// The findings for this light of a target.
    fn chances(&self, incident: &Incident) -> Chances;

    /// False returns of a shot that meets nothing, at most.
    fn false_alarm(&self) -> f64;

    /// True if too much light hides a target.
    fn can_be_blinded(&self) -> bool {
        false
    }
}

/// The light of a target, and the light and the dark counts beside it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Incident {
    /// Range of the target, m.
    pub range: f64,
    /// Photons detected of each pulse; of the whole shot where light has no pulses.
    pub photons: f64,
    /// Photons of sunlight detected per second.
    pub background: f64,
    /// Detections per second that come evenly: sunlight and dark counts.
    pub falling: f64,
}

/// Expected findings.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Chances {
    /// Probability of a return at the range of the target.
    pub pd: f64,
    /// As [`Forecast::snr`](super::Forecast::snr).
    pub snr: f64,
    /// Standard deviation of the range of such returns, m.
    pub precision: f64,
    /// The least standard deviation that any estimate could have from these photons, m.
    pub bound: f64,
}

//! Events that are marks and nothing else.
//!
//! If no mark is missed or moved and nothing else makes events, the output of a detector follows from the
//! code words. It need not be written down mark by mark, sorted and rounded, to be made ticks.

use super::Detections;
use crate::design::Design;
use crate::kernels::{Macropulse, Words};

/// The response of the detectors of a sensor to the light of a band.
#[derive(Debug)]
pub enum Response<'a> {
    /// Detection events, one by one.
    Events(Detections),
    /// Macropulses; every mark makes one event at its arrival.
    Marks(Marks<'a>),
}

impl From<Detections> for Response<'_> {
    fn from(events: Detections) -> Self {
        Self::Events(events)
    }
}

/// Macropulses at a sensor with a single channel. Every mark makes an event in the tick in which it arrives.
#[derive(Debug)]
pub struct Marks<'a> {
    /// As [`Detections::epoch`].
    pub(crate) epoch: i64,
    pub(crate) words: &'a ExactWords,
    /// In the order in which their first chips arrive; times in ticks since the epoch.
    pub(crate) macropulses: Vec<Macropulse>,
    /// Memory for the ticks.
    pub(crate) ticks: Vec<u32>,
}

/// Code words in ticks.
#[derive(Debug)]
pub(crate) struct ExactWords {
    pub(crate) words: Words,
    /// The most marks of one macropulse within the dead time of a converter.
    pub(crate) busiest: usize,
}

impl ExactWords {
    /// The `words` of `design`.
    pub(super) fn of(words: Words, design: &Design) -> Self {
        let bits = design.emission.coding().codebook.payload().map_or(1, |payload| payload.bits());
        let dead = design.readout.tdc().map_or(0, |tdc| tdc.dead_ticks(design.clock));
        Self { busiest: words.most_within(dead, bits), words }
    }
}

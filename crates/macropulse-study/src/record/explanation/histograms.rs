//! The explanation of a shot whose counts are a histogram.

use macropulse::codec::decode::{self, Verdict};
use macropulse::codec::{Histograms, RecordKind};
use macropulse::design::Design;
use macropulse::units::range_from_tof;
use serde::{Deserialize, Serialize};

use super::curve::Scale;
use super::{OfShot, RecordExplanation, Sent, Shot};
use crate::text::{Columns, counted, grouped, short};
use crate::view::{Axis, Chart, Hue, Note, Series, Style};

/// The histogram of a shot.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Counts {
    /// Pulses that were added up.
    cycles: u32,
    /// All counts.
    total: u64,
    /// Median of the counts of a bin: about the background.
    median_of_bins: u32,
    scale: Scale,
    /// Counts of each bin; nothing in a summary.
    counts: Option<Vec<u32>>,
}

fn median(counts: &[u32]) -> u32 {
    let mut sorted = counts.to_vec();
    sorted.sort_unstable();
    sorted.get(sorted.len() / 2).copied().unwrap_or(0)
}

impl OfShot for Counts {
    type Record = Histograms;

    fn of(
        design: &Design,
        histograms: &Histograms,
        at: usize,
        shot: &Shot,
    ) -> Result<Self, decode::Error> {
        let counts = histograms.of(at).to_vec();
        // A bin stands for its middle.
        let middle = Shot { within_tick_fs: design.clock.tick_fs / 2, ..*shot };
        Ok(Self {
            cycles: histograms.cycles.get(at).copied().unwrap_or(0),
            total: counts.iter().map(|count| u64::from(*count)).sum(),
            median_of_bins: median(&counts),
            scale: Scale::new(0, 1, &middle),
            counts: Some(counts),
        })
    }

    fn why(&self, verdict: &Verdict) -> String {
        let Self { cycles, median_of_bins, .. } = self;
        let cycles = counted(u64::from(*cycles), "pulse");
        if verdict.returns.is_empty() {
            return format!(
                "Nothing in the counts of {cycles} is rarer than the receiver allows of the background, \
                 about {median_of_bins} in a bin."
            );
        }
        let each = verdict.returns.iter().map(|one| {
            format!(
                "A return was accepted at {} m: {} photons a pulse on average, {} standard deviations beyond \
                 the threshold, on a background of about {median_of_bins} counts in a bin after {cycles}.",
                short(range_from_tof(one.tof)),
                short((f64::from(one.photons) * 1e6).round() * 1e-6),
                one.margin
            )
        });
        each.collect::<Vec<_>>().join(" ")
    }
}

impl RecordExplanation for Counts {
    fn kind(&self) -> RecordKind {
        RecordKind::Histograms
    }

    fn scale(&self) -> Option<&Scale> {
        Some(&self.scale)
    }

    fn shorten(&mut self) {
        self.counts = None;
    }

    /// Adds the lines about the histogram.
    fn push(&self, _: usize, columns: &mut Columns) {
        let total = grouped(self.total);
        let pulses = counted(u64::from(self.cycles), "pulse");
        columns
            .push("counts", format!("{total} of {pulses}; median {} a bin", self.median_of_bins));
    }

    /// The histogram, with what is said of it.
    fn charts(&self, sent: &Sent) -> Option<Vec<(Chart, &'static str)>> {
        let counts = self.counts.as_ref()?;
        let points: Vec<[f64; 2]> = (0..)
            .zip(counts)
            .map(|(bin, count)| [self.scale.range(bin), f64::from(*count)])
            .collect();
        let most = counts.iter().copied().max().unwrap_or(1).max(1);
        let last = points.last().map_or(1.0, |point| point[0]);
        let x = Axis::linear("Range, m").limits(0.0, last.max(1e-3));
        let y = Axis::linear("Counts in a bin").limits(0.0, f64::from(most) * 1.08);
        let mut chart = Chart::new("Counts of all pulses, over the histogram", x, y);
        chart.size = [904.0, 320.0];
        chart.series.push(Series {
            label: "counts".to_owned(),
            points,
            style: Style::Line,
            hue: Hue::Blue,
        });
        for one in sent.returns {
            let at = [one.range_m, f64::from(self.at(one.range_m, counts))];
            chart.notes.push(Note { at, text: format!("{:.3} m", one.range_m) });
        }
        Some(vec![(
            chart,
            "The counts that all pulses of the burst added up to; marked are the returns.",
        )])
    }
}

impl Counts {
    /// The counts of the bin at `range` metres.
    fn at(&self, range: f64, counts: &[u32]) -> u32 {
        let bins = counts.iter().enumerate();
        let nearest = bins.min_by(|(one, _), (other, _)| {
            let off = |bin: usize| (self.scale.range(bin as i64) - range).abs();
            off(*one).total_cmp(&off(*other))
        });
        nearest.map_or(0, |(_, count)| *count)
    }
}

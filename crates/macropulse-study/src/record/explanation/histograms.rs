//! The explanation of a shot whose counts are a histogram.

use macropulse::codec::decode::{self, Verdict};
use macropulse::codec::{Histograms, ShotLog};
use macropulse::design::Design;
use macropulse::units::range_from_tof;
use serde::{Deserialize, Serialize};

use super::curve::Scale;
use super::{Decision, Record, Return, Shot};
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
    pub scale: Scale,
    /// Counts of each bin; nothing in a summary.
    pub counts: Option<Vec<u32>>,
}

/// Explains shot number `at` of a band out of its `histograms`.
pub(super) fn decision<'a>(
    design: &Design,
    (log, histograms): (&'a ShotLog, &Histograms),
    at: usize,
) -> Result<Decision<'a>, decode::Error> {
    let counts = histograms.of(at).to_vec();
    let cycles = histograms.cycles.get(at).copied().unwrap_or(0);
    let alone = Histograms { cycles: vec![cycles], counts: counts.clone(), ..*histograms };
    let verdict = super::alone(design, log, at, &alone)?;
    let tick_fs = design.clock.tick_fs;
    let fired_tick = log.fired_at_fs[at].div_euclid(tick_fs);
    let shot = Shot { log, at, fired_tick, tick_fs, within_tick_fs: 0 };
    // A bin stands for its middle.
    let middle = Shot { log, at, fired_tick, tick_fs, within_tick_fs: tick_fs / 2 };
    let (nearest, farthest) = design.receiver.gate_ticks;
    let record = Counts {
        cycles,
        total: counts.iter().map(|count| u64::from(*count)).sum(),
        median_of_bins: median(&counts),
        scale: Scale::new(0, 1, &middle),
        counts: Some(counts),
    };
    Ok(Decision {
        why: record.why(&verdict),
        shot,
        marks: vec![0],
        gate: i64::from(nearest)..i64::from(farthest) + 1,
        width: 1,
        verdict,
        record: Record::Histograms(record),
    })
}

fn median(counts: &[u32]) -> u32 {
    let mut sorted = counts.to_vec();
    sorted.sort_unstable();
    sorted.get(sorted.len() / 2).copied().unwrap_or(0)
}

impl Counts {
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

    /// Adds the lines about the histogram.
    pub fn push(&self, columns: &mut Columns) {
        let total = grouped(self.total);
        let pulses = counted(u64::from(self.cycles), "pulse");
        columns
            .push("counts", format!("{total} of {pulses}; median {} a bin", self.median_of_bins));
    }

    /// The histogram, with what is said of it.
    pub fn charts(&self, returns: &[Return]) -> Option<Vec<(Chart, &'static str)>> {
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
        for one in returns {
            let at = [one.range_m, f64::from(self.at(one.range_m, counts))];
            chart.notes.push(Note { at, text: format!("{:.3} m", one.range_m) });
        }
        Some(vec![(
            chart,
            "The counts that all pulses of the burst added up to; marked are the returns.",
        )])
    }

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

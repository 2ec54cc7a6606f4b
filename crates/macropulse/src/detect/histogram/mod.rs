//! Photon counts of bursts, in histograms: SPAD cells behind a readout that adds up the cycles of a burst.
//!
//! 1. Each pulse of a burst begins a cycle. A count goes into the bin of the time since that pulse.
//! 2. The light of a cycle is a rate: pulses of all paths, and what shines without pulses. A path of the
//!    burst itself comes in every cycle but the first ⌊delay/interval⌋; light of other shots and of other
//!    lidars comes in those cycles that it meets.
//! 3. Cycles with the same light are drawn together ([`draw`]).
//!
//! The length of a pulse and the timing jitter spread the light over bins. So the order of two photons is
//! that of their times behind the jitter; the light between two bins of a cycle is even over the bin.

mod draw;
mod shining;

use macropulse_codec::decode::histogram::{Kernel, STEPS};
use macropulse_codec::statistics::normal_tail;
use macropulse_codec::{Given, Histograms, ShotLog};

use self::draw::Cells;
use self::shining::Shining;
use super::ShotRecorder;
use crate::channel::{Light, Stretch};
use crate::design::detector::{Geiger, PLENTY};
use crate::design::{Burst, Design, Histogram};
use crate::random::{Chance, Stage};
use crate::units::{FS_PER_S, RMS_OF_FWHM, s_from_fs};

/// A pulse is followed to this many of its rms lengths: 2·10⁻⁹ of it lies beyond.
const REACH: f64 = 6.0;

/// SPAD cells and the histogram behind them, at work.
#[derive(Debug)]
pub(super) struct Accumulator {
    geiger: Geiger,
    cells: Cells,
    burst: Burst,
    bins: u32,
    /// The pulse of the sensor where it is measured.
    measured: Option<Kernel>,
    bin_fs: i64,
    /// Detections per photon.
    efficiency: f64,
}

/// Pulses that come at the same time in each of some cycles.
#[derive(Debug, Clone, Copy)]
struct Pulses<'a> {
    /// First cycle and the one behind the last.
    cycles: [i64; 2],
    /// Middle of the pulse, fs since the beginning of the cycle.
    middle_fs: f64,
    shape: Shape<'a>,
    /// Detected photons of each.
    photons: f64,
}

/// The shape of a pulse.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Shape<'a> {
    /// A Gaussian of this rms length, light and timing together, fs.
    Gaussian(f64),
    /// As it was measured.
    Measured(&'a Kernel),
}

impl ShotRecorder for Accumulator {
    fn record(&self, chance: &Chance, log: &ShotLog, light: &Light) -> Given {
        Given::Histograms(self.histograms(chance, log, light))
    }
}

impl Accumulator {
    pub fn new(geiger: &Geiger, (burst, histogram): (&Burst, &Histogram), design: &Design) -> Self {
        let bin_fs = design.clock.tick_fs;
        let cells = Cells::new(geiger, burst.interval_fs, bin_fs, histogram.bins);
        let measured =
            histogram.pulse.as_ref().and_then(|_| Kernel::new(&histogram.pulse(0.0), bin_fs));
        let (bins, efficiency) = (histogram.bins, design.efficiency());
        Self { geiger: *geiger, cells, burst: burst.clone(), bins, measured, bin_fs, efficiency }
    }

    fn histograms(&self, chance: &Chance, log: &ShotLog, light: &Light) -> Histograms {
        let mut counts = Vec::with_capacity(log.owned.len() * self.bins as usize);
        let order = by_channel(light);
        let stretches = light.background.by_channel();
        let steady = self.geiger.dark + light.background.steady * self.efficiency;
        let in_bin = steady * s_from_fs(self.bin_fs);
        let unpulsed = self.unpulsed(light, in_bin);
        for shot in log.owned.clone() {
            let pulses = self.pulses(&order, light, (log.channel[shot], log.fired_at_fs[shot]));
            let mut stream = chance.at(Stage::Histogram, log.first + shot as u64);
            let shining = self.shining(&stretches, (log.channel[shot], log.fired_at_fs[shot]));
            let segments = segments((&pulses, &shining), self.burst.pulses);
            let lit = segments.map(|(cycles, pulses, shining)| {
                let mut rates = unpulsed.clone();
                shining.iter().for_each(|it| it.add(&mut rates, self.bin_fs, self.efficiency));
                (cycles, self.rates(&pulses, rates))
            });
            self.cells.count(lit, in_bin, &mut stream, &mut counts);
        }
        Histograms {
            bin_fs: self.bin_fs,
            offset_fs: 0,
            bins: self.bins,
            cycles: vec![self.burst.pulses; log.owned.len()],
            counts,
        }
    }

    /// The pulses of all light that meets the cycles of a shot fired at `fired_fs`, as its `channel` sees it.
    fn pulses(
        &self,
        order: &[(u16, i64, usize)],
        light: &Light,
        (channel, fired_fs): (u16, i64),
    ) -> Vec<Pulses<'_>> {
        let mut found = Vec::new();
        let interval = self.burst.interval_fs;
        let lasts = interval * i64::from(self.burst.pulses);
        let from = order.partition_point(|(of, arrives, _)| {
            (*of, *arrives) < (channel, fired_fs.saturating_sub(lasts))
        });
        let seen = order[from..].iter().take_while(|(of, arrives, _)| {
            *of == channel && *arrives < fired_fs.saturating_add(lasts)
        });
        for &(_, _, train) in seen {
            let trains = &light.trains;
            let transmitter = trains.transmitter[train];
            let pulse = light.transmitters[usize::from(transmitter)].pulse * RMS_OF_FWHM;
            let repeats = if transmitter == 0 { i64::from(self.burst.pulses) } else { 1 };
            for arrives_fs in light.arrivals_fs(train) {
                let since = arrives_fs - fired_fs;
                let first = since.div_euclid(interval);
                found.push(Pulses {
                    cycles: [first, first + repeats],
                    middle_fs: since.rem_euclid(interval) as f64,
                    shape: match &self.measured {
                        Some(kernel) if transmitter == 0 => Shape::Measured(kernel),
                        _ => Shape::Gaussian(
                            libm::hypot(pulse, self.geiger.jitter) * FS_PER_S as f64,
                        ),
                    },
                    photons: (trains.photons[train] * self.efficiency).min(PLENTY),
                });
            }
        }
        let all = i64::from(self.burst.pulses);
        let spilled = found.clone();
        for pulse in spilled {
            // A pulse that reaches over the end of a cycle lies in the next one, too, and one that reaches
            // over its beginning in the one before.
            let (middle, [before, behind]) = (pulse.middle_fs, self.reach(pulse.shape));
            for (cycles_on, over) in [(1, middle + behind > interval as f64), (-1, middle < before)]
            {
                if over {
                    found.push(Pulses {
                        cycles: pulse.cycles.map(|cycle| cycle + cycles_on),
                        middle_fs: middle - (cycles_on * interval) as f64,
                        ..pulse
                    });
                }
            }
        }
        found.iter_mut().for_each(|pulse| pulse.cycles = pulse.cycles.map(|at| at.clamp(0, all)));
        found.retain(|pulse| pulse.cycles[0] < pulse.cycles[1]);
        found
    }

    /// The light without pulses of other lidars in the cycles of a shot fired at `fired_fs`, as its `channel` sees it.
    fn shining(&self, stretches: &[Stretch], (channel, fired_fs): (u16, i64)) -> Vec<Shining> {
        let burst = (self.burst.interval_fs, self.burst.pulses);
        let from = stretches.partition_point(|it| (it.channel, it.until_fs) <= (channel, fired_fs));
        let seen = stretches[from..].iter().take_while(|it| it.channel == channel);
        seen.flat_map(|stretch| Shining::of(stretch, fired_fs, burst)).collect()
    }

    /// Mean detections in each bin of a cycle without pulses: `steady` ones, and those of the responses of `light`,
    /// as if the burst had begun long before.
    fn unpulsed(&self, light: &Light, steady: f64) -> Vec<f64> {
        let mut photons = vec![0.0; self.cells.bins_of_cycle()];
        for response in light.responses.iter().filter(|response| response.step_fs > 0) {
            response.add_to_cycle(&mut photons, (self.bin_fs, self.burst.interval_fs));
        }
        photons.iter().map(|photons| steady + photons * self.efficiency).collect()
    }

    /// How far a pulse reaches before and behind its middle, fs.
    fn reach(&self, shape: Shape) -> [f64; 2] {
        let bin = self.bin_fs as f64;
        match shape {
            Shape::Gaussian(rms_fs) => [REACH * rms_fs; 2],
            Shape::Measured(kernel) => {
                [kernel.origin * bin, (kernel.length as f64 - kernel.origin) * bin]
            }
        }
    }

    /// Adds these `pulses` to the `rates`, the mean detections in each bin of a cycle.
    fn rates(&self, pulses: &[Pulses], mut rates: Vec<f64>) -> Vec<f64> {
        for pulse in pulses {
            match pulse.shape {
                Shape::Gaussian(rms_fs) => self.add_gaussian(pulse, rms_fs, &mut rates),
                Shape::Measured(kernel) => {
                    let begins = pulse.middle_fs / self.bin_fs as f64 - kernel.origin;
                    let step = (begins * STEPS as f64).round() as i64;
                    let (first, shares) = kernel.within(step, rates.len());
                    for (rate, share) in rates.iter_mut().skip(first).zip(shares) {
                        *rate += pulse.photons * share;
                    }
                }
            }
        }
        rates
    }

    /// Adds the detections of a Gaussian `pulse`.
    fn add_gaussian(&self, pulse: &Pulses, rms_fs: f64, rates: &mut [f64]) {
        let bin = self.bin_fs as f64;
        let sigma = rms_fs.max(f64::MIN_POSITIVE);
        let first = ((pulse.middle_fs - REACH * sigma) / bin).floor().max(0.0) as usize;
        let last = ((pulse.middle_fs + REACH * sigma) / bin).floor().max(-1.0) as i64;
        let end = usize::try_from(last + 1).unwrap_or(0).min(rates.len());
        let above = |edge: usize| normal_tail((edge as f64 * bin - pulse.middle_fs) / sigma);
        let mut beyond = above(first);
        for (rate, edge) in rates.iter_mut().take(end).skip(first).zip(first + 1..) {
            let next = above(edge);
            *rate += pulse.photons * (beyond - next);
            beyond = next;
        }
    }
}

/// Channel, arrival and place of each pulse train, in this order.
fn by_channel(light: &Light) -> Vec<(u16, i64, usize)> {
    let trains = &light.trains;
    let mut order: Vec<_> =
        (0..trains.len()).map(|at| (trains.channel[at], trains.arrives_fs[at], at)).collect();
    order.sort_unstable();
    order
}

/// A run of cycles with the same light: how many they are, the pulses that come in each, and what shines without pulses.
type Segment<'a> = (u32, Vec<Pulses<'a>>, Vec<Shining>);

/// Runs of cycles in which the same light comes, out of `pulses` and what is `shining`.
fn segments<'a>(
    (pulses, shining): (&[Pulses<'a>], &[Shining]),
    cycles: u32,
) -> impl Iterator<Item = Segment<'a>> {
    let mut edges: Vec<i64> = pulses.iter().flat_map(|pulse| pulse.cycles).collect();
    edges.extend(shining.iter().flat_map(|light| light.cycles));
    edges.extend([0, i64::from(cycles)]);
    edges.sort_unstable();
    edges.dedup();
    let runs: Vec<[i64; 2]> = edges.windows(2).map(|pair| [pair[0], pair[1]]).collect();
    runs.into_iter().map(move |[from, until]| {
        let meets = |of: [i64; 2]| of[0] <= from && until <= of[1];
        (
            (until - from) as u32,
            pulses.iter().filter(|pulse| meets(pulse.cycles)).copied().collect(),
            shining.iter().filter(|light| meets(light.cycles)).copied().collect(),
        )
    })
}

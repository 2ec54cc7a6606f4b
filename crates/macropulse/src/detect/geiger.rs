//! Cells in Geiger mode (a SPAD array): each photon detected falls on one of them, which fires if
//! it is armed, and is blind for its dead time.
//!
//! 1. A mark of mean n detected photons brings k of them, Poisson; each falls on a cell drawn
//!    evenly. So does every dark and background count.
//! 2. In order of time, a photon that meets an armed cell makes it fire; the cell is armed again
//!    after the dead time, whatever falls on it meanwhile.
//! 3. Each firing makes an event with Gaussian jitter. All cells of a channel share one output.
//! 4. A cell works whether or not the detector is listened to: what fires it between two gates, or in
//!    the gate before, blinds it in the next one. So cells are followed from several dead times before
//!    each gate on, through all gates that follow sooner, and the firings while a gate is open are events.
//! 5. When a cell begins to be followed, it is blind with probability ρ = r·τ/(1 + r·τ). Here r is the steady
//!    rate of counts per cell, and τ the dead time. A blind cell stays blind for a time that is even between
//!    0 and τ. This is the stationary state of a cell in steady light. The guard shots of a band reach
//!    equally far back ([`Design::cut`](crate::design::Design::cut)).
//!
//! A single cell with a dead time as long as the range gate is the detector that fires once per
//! arm time.

use rand::RngExt;
use rand_distr::{Distribution, Poisson, StandardNormal};

use super::channel::Channel;
use super::noise::{PART_BITS, counts_in};
use super::{Detections, Kind, Memory};
use crate::design::detector::{Geiger, Model};
use crate::random::{Address, Chance, Stage, Stream};
use crate::units::{FS_PER_S, fs_from_s, s_from_fs};

/// This number of photons for each cell fires all that are armed.
const FLOOD: f64 = 64.0;

/// Stands for all cells.
const ALL: u32 = u32::MAX;

/// Cells in Geiger mode.
#[derive(Debug)]
pub(super) struct Cells {
    geiger: Geiger,
}

impl Cells {
    pub fn new(geiger: &Geiger) -> Self {
        Self { geiger: *geiger }
    }

    /// Counts per second of steady light and of the dark, on all cells of a channel.
    fn steady(&self, channel: &Channel) -> f64 {
        self.geiger.dark + channel.steady()
    }
}

impl Kind for Cells {
    fn add(&self, channel: &Channel, chance: &Chance, found: &mut Detections, memory: &mut Memory) {
        let mut photons = self.photons(channel, chance);
        let followed = channel.followed(channel.clock.parts(self.geiger.memory_fs()));
        counts_in(&followed, self.steady(channel), (channel, chance), &mut memory.noise);
        for &time in &memory.noise {
            let mut stream = chance.stream(self.address(Stage::Cell, channel, time.into()));
            let cell = stream.random_range(0..self.geiger.cells);
            photons.push(u64::from(time) << 32 | u64::from(cell));
        }
        photons.sort_unstable();
        let from = found.time.len();
        let mut rest = photons.as_slice();
        let mut gates = channel.spans.iter().peekable();
        for span in &followed {
            let before = rest.partition_point(|photon| ((photon >> 32) as i64) < *span.start());
            let end = rest.partition_point(|photon| (photon >> 32) as i64 <= *span.end());
            let armed_at = self.armed_at(*span.start(), channel, chance);
            self.fire(&rest[before..end], armed_at, channel, |fired| {
                while gates.next_if(|gate| *gate.end() < i64::from(fired)).is_some() {}
                if gates.peek().is_some_and(|gate| gate.contains(&i64::from(fired))) {
                    found.time.push(self.answer(fired, channel, chance));
                }
            });
            rest = &rest[end..];
        }
        found.time[from..].sort_unstable();
    }
}

impl Cells {
    /// Returns the address of the random numbers of a moment, given in parts of a tick from the epoch on.
    fn address(&self, stage: Stage, channel: &Channel, time: i64) -> Address {
        let index = (channel.clock.epoch_parts() + time) as u64;
        Address { stage, index, part: u32::from(channel.number) << PART_BITS }
    }

    /// The photons of all marks: the time in the upper half, the cell in the lower half.
    fn photons(&self, channel: &Channel, chance: &Chance) -> Vec<u64> {
        let (mut photons, mut arrivals) = (Vec::new(), Vec::new());
        let trains = &channel.light.trains;
        for arrival in channel.order.iter() {
            let index = *arrival as u32 as usize;
            let mut stream = chance.at(Stage::Photons, trains.address(index));
            let times = channel.arrivals(index, &mut arrivals).iter().copied();
            self.fall(times, channel.detected(index), &mut stream, &mut photons);
        }
        photons
    }

    /// Adds the photons of marks that come at `times` and have `mean` of them each.
    fn fall(
        &self,
        times: impl Iterator<Item = i64>,
        mean: f64,
        stream: &mut Stream,
        photons: &mut Vec<u64>,
    ) {
        let cells = self.geiger.cells;
        let flood = mean > FLOOD * f64::from(cells);
        let poisson = Poisson::new(mean).ok();
        for time in times.map(|time| (time as u64) << 32) {
            if flood {
                photons.push(time | u64::from(ALL));
                continue;
            }
            let count = poisson.map_or(0.0, |poisson| poisson.sample(stream));
            for _ in 0..count as u64 {
                photons.push(time | u64::from(stream.random_range(0..cells)));
            }
        }
    }

    /// When each cell is armed, in parts of a tick, where the detector begins to look at `start`.
    fn armed_at(&self, start: i64, channel: &Channel, chance: &Chance) -> Vec<i64> {
        let Geiger { cells, dead_fs, .. } = self.geiger;
        let each = self.steady(channel) / f64::from(cells) * s_from_fs(dead_fs);
        let blind = each / (1.0 + each);
        let mut stream = chance.stream(self.address(Stage::Blind, channel, start));
        let dead = channel.clock.parts(dead_fs) as f64;
        let mut state = |_| {
            let draw: f64 = stream.random();
            // Even among those that are blind.
            if draw < blind { start + (draw / blind * dead) as i64 } else { start }
        };
        (0..cells).map(&mut state).collect()
    }

    /// Calls `fired` with the time of every firing, in parts of a tick, ascending.
    fn fire(
        &self,
        photons: &[u64],
        mut armed_at: Vec<i64>,
        channel: &Channel,
        mut fired: impl FnMut(u32),
    ) {
        let dead = channel.clock.parts(self.geiger.dead_fs);
        for &photon in photons {
            let (time, cell) = ((photon >> 32) as u32, photon as u32);
            let now = i64::from(time);
            let met = match cell {
                ALL => &mut armed_at[..],
                cell => std::slice::from_mut(&mut armed_at[cell as usize]),
            };
            let mut any = false;
            for armed in met.iter_mut().filter(|armed| **armed <= now) {
                *armed = now + dead;
                any = true;
            }
            if any {
                fired(time);
            }
        }
    }

    /// When the output answers a firing.
    fn answer(&self, fired: u32, channel: &Channel, chance: &Chance) -> u32 {
        if self.geiger.jitter == 0.0 {
            return fired;
        }
        let mut stream = chance.stream(self.address(Stage::Answer, channel, fired.into()));
        let late: f64 = StandardNormal.sample(&mut stream);
        let most = self.geiger.jitter * crate::design::MOST_SIGMA;
        let late = (late * self.geiger.jitter).clamp(-most, most);
        debug_assert!(late.abs() < FS_PER_S as f64);
        fired.wrapping_add_signed(channel.clock.parts(fs_from_s(late)) as i32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::channel::Light;
    use crate::design::Design;
    use crate::detect::Detectors;

    fn cells(cells: &str, dead_ns: &str, rate: &str) -> Design {
        let text = format!(
            "version = 1\nextends = \"kim-park-2016\"\nname = \"mine\"\n[detector.geiger]\n\
             sensitivity = {{ range_m = 150.0, reflectance = 1.0, pd = 0.99 }}\n\
             cells = {cells}\ndead_time_ns = {dead_ns}\ndark_counts_hz = {rate}\n"
        );
        Design::from_toml(&text, "mine", std::path::Path::new(""), &[]).unwrap()
    }

    /// The events of steady light, in seconds from the first owned shot on, of several bands that
    /// each begin anew.
    fn events(design: &Design, bands: u64) -> Vec<Vec<f64>> {
        let detectors = Detectors::in_the_dark(design, Chance::new(7));
        let of_band = |n: u64| {
            let band = crate::emit::Band { scan: 1, first: 848 * n, shots: 20 };
            let log = band.shot_log(design);
            let found = detectors.detections(&log, &Light::default(), &mut Memory::default());
            let part = s_from_fs(design.clock.tick_fs) / f64::from(crate::design::PARTS_OF_TICK);
            let epoch = found.epoch as f64 * s_from_fs(design.clock.tick_fs);
            let owned = s_from_fs(log.fired_at_fs[log.owned.start]);
            let times = found.time.iter().map(|time| epoch + f64::from(*time) * part - owned);
            times.filter(|time| *time >= 0.0).collect()
        };
        (0..bands).map(of_band).collect()
    }

    /// H0: from the first owned shot on, one cell with dead time τ in light of rate r fires r/(1 + r·τ) times
    /// a second. That it is started anew with every band does not matter. N = 400 bands, the first half of a
    /// dead time of each, seed 7, α = 1e-4 (|z| < 3.9). Control: were it armed when the first owned shot is
    /// fired, r·τ/2 = 1 event would come in that time, and half of them are missing.
    #[test]
    fn a_cell_is_as_blind_at_the_seam_of_bands_as_anywhere() {
        // τ = 200 ns, r = 1e7: ρ = 2/3.
        let design = cells("1", "200.0", "1e7");
        let bands = 400;
        let early: f64 = events(&design, bands)
            .iter()
            .map(|times| times.iter().filter(|time| **time < 100e-9).count() as f64)
            .sum();
        let expected = bands as f64 * 1e7 / 3.0 * 100e-9;
        let z = |expected: f64| (early - expected) / expected.sqrt();
        assert!(z(expected).abs() < 3.9, "{early} events, {expected} expected");
        // An armed cell fires within the time with 1 − exp(−1).
        assert!(z(bands as f64 * (1.0 - (-1.0_f64).exp())).abs() > 3.9);
    }

    /// Returns a sensor with one cell, dead for `dead_ns`, in the dark but for `rate` counts a second.
    fn gated(dead_ns: f64, rate: f64) -> Design {
        let text = format!(
            "version = 1\nname = \"mine\"\nidealised = [\"footprint\", \"mirror-motion\", \
             \"link-budget\", \"eye-safety\"]\nscan.scans_per_s = 10.0\nscan.max_range_m = 90.0\n\
             scan.raster = {{ rows = 100, columns = 1000, horizontal_deg = 20.0, vertical_deg = 10.0 }}\n\
             light = {{ wavelength_nm = 905.0, pulse_ps = 100.0 }}\n[detector.geiger]\n\
             sensitivity = {{ range_m = 60.0, reflectance = 0.1, pd = 0.15 }}\ncells = 1\n\
             dead_time_ns = {dead_ns}\ndark_counts_hz = {rate}\njitter_ps = 0.0\n\
             [tdc]\nresolution_ps = 100.0\nclock_ps = 1000.0\nbits = 10\n\
             [receiver]\nkind = \"direct\"\n"
        );
        Design::from_toml(&text, "mine", std::path::Path::new(""), &[]).unwrap()
    }

    /// Shots 1 us apart have gates of 0.6 us, and a cell is dead for 1.5 us: over two pauses. Control: in the
    /// pauses alone it would be armed again after 0.3 us.
    #[test]
    fn a_cell_that_fires_in_one_gate_is_blind_in_the_next() {
        let nearest = |dead_ns: f64| {
            let found = events(&gated(dead_ns, 1e7), 3);
            assert!(found.iter().all(|times| times.len() > 4));
            let apart = |times: &Vec<f64>| -> Vec<f64> {
                times.windows(2).map(|pair| pair[1] - pair[0]).collect()
            };
            found.iter().flat_map(apart).fold(f64::MAX, f64::min)
        };
        assert!(nearest(1500.0) > 1499e-9, "{}", nearest(1500.0));
        assert!(nearest(300.0) < 600e-9);
    }

    /// A cell fires once in its dead time, however much light there is.
    #[test]
    fn no_two_firings_of_a_cell_are_nearer_than_its_dead_time() {
        let found = events(&cells("1", "50.0", "1e9"), 3);
        for times in &found {
            assert!(times.len() > 10);
            assert!(times.windows(2).all(|pair| pair[1] - pair[0] > 49.9e-9));
        }
        // Control: with a hundred cells they are.
        let found = events(&cells("100", "50.0", "1e9"), 1);
        assert!(found[0].windows(2).any(|pair| pair[1] - pair[0] < 10e-9));
    }
}

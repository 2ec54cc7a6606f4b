//! Cells in Geiger mode: each photon detected falls on one of them, which fires if it is armed, and
//! is blind for its dead time.
//!
//! 1. A mark of mean n detected photons brings k of them, Poisson; each falls on a cell drawn
//!    evenly. So does every dark and background count.
//! 2. In order of time, a photon that meets an armed cell makes it fire; the cell is armed again
//!    after the dead time, whatever falls on it meanwhile.
//! 3. Each firing makes an edge with Gaussian jitter. All cells share one output.
//!
//! A single cell with a dead time as long as the range gate is the detector that fires once per
//! arm time. All cells are armed when a band begins, a range gate before its first owned shot.

use rand::RngExt;
use rand_distr::{Distribution, Poisson, StandardNormal};

use super::noise::Noise;
use super::{Band, Edges, Memory};
use crate::design::{Design, Geiger};
use crate::random::{Chance, Stage, Stream};
use crate::units::{FS_PER_S, fs_from_s};

/// So many photons for each cell fire all that are armed.
const FLOOD: f64 = 64.0;

/// Stands for all cells.
const ALL: u32 = u32::MAX;

/// Cells in Geiger mode, and the false counts that fall on them.
#[derive(Debug)]
pub(super) struct Cells {
    geiger: Geiger,
    noise: Option<Noise>,
}

impl Cells {
    pub fn new(geiger: &Geiger, false_rate: f64, design: &Design) -> Self {
        Self { geiger: *geiger, noise: Noise::new(false_rate, design) }
    }

    pub fn edges(&self, band: &Band, chance: &Chance, memory: &mut Memory) -> Edges {
        let mut photons = self.photons(band, chance);
        if let Some(noise) = &self.noise {
            noise.edges(&band.clock, band.span(), chance, &mut memory.false_edges);
            for &time in &memory.false_edges {
                let moment = (band.clock.epoch_parts() + i64::from(time)) as u64;
                let cell = chance.at(Stage::Cell, moment).random_range(0..self.geiger.cells);
                photons.push(u64::from(time) << 32 | u64::from(cell));
            }
        }
        photons.sort_unstable();
        let mut time = std::mem::take(&mut memory.edges);
        time.clear();
        self.fire(&photons, band, |fired| {
            time.push(self.answer(fired, band, chance));
        });
        time.sort_unstable();
        Edges { epoch: band.clock.epoch, time, ..Edges::default() }
    }

    /// The photons of all marks: the time in the upper half, the cell in the lower half.
    fn photons(&self, band: &Band, chance: &Chance) -> Vec<u64> {
        let mut photons = Vec::new();
        band.each_shot_with_echoes(|shot, echoes| {
            let mut stream = chance.at(Stage::Photons, band.log.first + shot as u64);
            for echo in echoes {
                let times = band.marks(echo).map(|mark| band.clock.time(mark));
                self.fall(times, band.echoes.photons[echo], &mut stream, &mut photons);
            }
        });
        band.each_foreign(chance, |mut stream, mean, marks| {
            let times = marks.iter().map(|mark| band.clock.time(*mark));
            self.fall(times, mean, &mut stream, &mut photons);
        });
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

    /// Calls `fired` with the time of every firing, in parts of a tick, ascending.
    fn fire(&self, photons: &[u64], band: &Band, mut fired: impl FnMut(u32)) {
        let dead = band.clock.parts(self.geiger.dead_fs);
        let mut armed_at = vec![0; self.geiger.cells as usize];
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
    fn answer(&self, fired: u32, band: &Band, chance: &Chance) -> u32 {
        if self.geiger.jitter == 0.0 {
            return fired;
        }
        let moment = (band.clock.epoch_parts() + i64::from(fired)) as u64;
        let late: f64 = StandardNormal.sample(&mut chance.at(Stage::Answer, moment));
        let most = self.geiger.jitter * crate::design::MOST_SIGMA;
        let late = (late * self.geiger.jitter).clamp(-most, most);
        debug_assert!(late.abs() < FS_PER_S as f64);
        fired.wrapping_add_signed(band.clock.parts(fs_from_s(late)) as i32)
    }
}

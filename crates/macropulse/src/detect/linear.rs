//! A linear detector: a photodiode, an amplifier, and a threshold.
//!
//! 1. A mark of mean n detected photons brings k of them, Poisson.
//! 2. Multiplication spreads their number: a = k + √(k·(F − 1))·g, F the excess noise factor.
//! 3. Shot noise of steady currents and the amplifier add their own: a + noise·g'.
//! 4. An amplitude above the threshold makes an edge at the arrival of the mark, displaced by what
//!    the noise does to the slope.
//! 5. Between marks, noise crosses the threshold at the rate the threshold was set for.
//!
//! Every mark is judged alone: marks of several echoes that overlap do not add up, and the walk of
//! the crossing with the amplitude is taken to be calibrated out (docs/physics.md#linear).

use rand_distr::{Distribution, Poisson, StandardNormal};

use super::noise::Noise;
use super::{Band, Edges, Memory};
use crate::design::{Design, Linear};
use crate::random::{Chance, Stage};
use crate::units::fs_from_s;

/// A mark of more photons than this is never below a threshold.
const PLENTY: f64 = 1e12;

/// A linear detector and the false edges of its noise.
#[derive(Debug)]
pub(super) struct Thresholding {
    linear: Linear,
    noise: Option<Noise>,
}

impl Thresholding {
    pub fn new(linear: &Linear, design: &Design) -> Self {
        Self { linear: *linear, noise: Noise::new(linear.false_rate, design) }
    }

    pub fn edges(&self, band: &Band, chance: &Chance, memory: &mut Memory) -> Edges {
        let mut time = std::mem::take(&mut memory.edges);
        time.clear();
        band.each_shot_with_echoes(|shot, echoes| {
            let mut stream = chance.at(Stage::Photons, band.log.first + shot as u64);
            for echo in echoes {
                let photons = Poisson::new(band.echoes.photons[echo].min(PLENTY)).ok();
                for mark in band.marks(echo) {
                    let count = photons.map_or(0.0, |photons| photons.sample(&mut stream));
                    if let Some(late) = self.crossing(count, &mut stream) {
                        time.push(band.clock.time(mark + late) as u32);
                    }
                }
            }
        });
        band.each_foreign(chance, |mut stream, photons, marks| {
            let photons = Poisson::new(photons.min(PLENTY)).ok();
            for mark in marks {
                let count = photons.map_or(0.0, |photons| photons.sample(&mut stream));
                if let Some(late) = self.crossing(count, &mut stream) {
                    time.push(band.clock.time(mark + late) as u32);
                }
            }
        });
        if let Some(noise) = &self.noise {
            noise.edges(&band.clock, band.span(), chance, &mut memory.false_edges);
            time.extend_from_slice(&memory.false_edges);
        }
        time.sort_unstable();
        Edges { epoch: band.clock.epoch, time, ..Edges::default() }
    }

    /// How late, fs, a mark of `count` detected photons crosses the threshold; `None` if it does
    /// not.
    fn crossing(&self, count: f64, stream: &mut crate::random::Stream) -> Option<i64> {
        let Linear { threshold, noise, excess, .. } = self.linear;
        let spread = (count * (excess - 1.0) + noise * noise).sqrt();
        let draw = |stream: &mut _| -> f64 { StandardNormal.sample(stream) };
        let amplitude = count + spread * draw(stream);
        let late = draw(stream);
        (count > 0.0 && amplitude > threshold)
            .then(|| fs_from_s(late * self.linear.timing(amplitude)))
    }
}

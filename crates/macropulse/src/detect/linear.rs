//! A linear detector: a photodiode, an amplifier, and a threshold.
//!
//! 1. A mark of mean n detected photons brings k of them, Poisson.
//! 2. Multiplication spreads their number: a = k + √(k·(F − 1))·g, F the excess noise factor.
//! 3. Shot noise of steady currents and the amplifier add their own: a + noise·g'.
//! 4. An amplitude above the threshold makes an edge at the arrival of the mark, displaced by what
//!    the noise does to the slope.
//! 5. Between marks, noise crosses the threshold at the rate the threshold was set for.
//!
//! The light of one shot that comes within the response of the amplifier adds up. Light of several
//! shots does not, and the walk of the crossing with the amplitude is taken to be calibrated out
//! (docs/physics.md#linear).

use std::ops::Range;

use rand_distr::{Distribution, Poisson, StandardNormal};

use super::noise::Noise;
use super::{Band, Edges, Memory};
use crate::channel::LinearSetting;
use crate::design::Design;
use crate::random::{Chance, Stage};
use crate::units::fs_from_s;

/// A mark of more photons than this is never below a threshold.
const PLENTY: f64 = 1e12;

/// A linear detector and the false edges of its noise.
#[derive(Debug)]
pub(super) struct Thresholding {
    linear: LinearSetting,
    noise: Option<Noise>,
}

impl Thresholding {
    pub fn new(linear: LinearSetting, design: &Design) -> Self {
        Self { linear, noise: Noise::new(linear.false_rate, design) }
    }

    pub fn edges(&self, band: &Band, chance: &Chance, memory: &mut Memory) -> Edges {
        let mut time = std::mem::take(&mut memory.edges);
        time.clear();
        let mut together = Vec::new();
        band.each_shot_with_echoes(|shot, echoes| {
            let mut stream = chance.at(Stage::Photons, band.log.first + shot as u64);
            self.gather(band, echoes, &mut together);
            for (echo, later_fs, photons) in together.drain(..) {
                let photons = Poisson::new(photons.min(PLENTY)).ok();
                for mark in band.marks(echo) {
                    let count = photons.map_or(0.0, |photons| photons.sample(&mut stream));
                    if let Some(late) = self.crossing(count, &mut stream) {
                        time.push(band.clock.time(mark + later_fs + late) as u32);
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

    /// The `echoes` of a shot that the amplifier cannot tell apart, as one each: the first of them,
    /// how much later, fs, the mean of their light comes, and the photons of all.
    fn gather(&self, band: &Band, echoes: Range<usize>, together: &mut Vec<(usize, i64, f64)>) {
        let of = |echo: usize| (band.echoes.part.get(echo), band.echoes.delay_fs[echo]);
        let mut order: Vec<usize> = echoes.collect();
        order.sort_by_key(|&echo| of(echo));
        let response_fs = fs_from_s(self.linear.response);
        let mut rest = order.as_slice();
        while let Some(&first) = rest.first() {
            let (part, begins) = of(first);
            let is_with = |echo: &usize| of(*echo).0 == part && of(*echo).1 <= begins + response_fs;
            let count = rest.iter().take_while(|echo| is_with(echo)).count();
            let (one, others) = rest.split_at(count);
            let photons: f64 = one.iter().map(|&echo| band.echoes.photons[echo]).sum();
            let later = |&echo: &usize| {
                (of(echo).1 - begins) as f64 * (band.echoes.photons[echo] / photons)
            };
            // A detector that never misses has no end of photons.
            let later: f64 = one.iter().map(later).sum();
            together.push((first, if later.is_finite() { later as i64 } else { 0 }, photons));
            rest = others;
        }
    }

    /// How late, fs, a mark of `count` detected photons crosses the threshold; `None` if it does
    /// not.
    fn crossing(&self, count: f64, stream: &mut crate::random::Stream) -> Option<i64> {
        let LinearSetting { threshold, noise, excess, .. } = self.linear;
        let spread = (count * (excess - 1.0) + noise * noise).sqrt();
        let draw = |stream: &mut _| -> f64 { StandardNormal.sample(stream) };
        let amplitude = count + spread * draw(stream);
        let late = draw(stream);
        (count > 0.0 && amplitude > threshold)
            .then(|| fs_from_s(late * self.linear.timing(amplitude)))
    }
}

#[cfg(test)]
mod tests {
    use crate::channel::Echoes;
    use crate::design::Design;
    use crate::detect::{Detectors, Memory};
    use crate::random::Chance;

    /// Seven rays of a footprint with a seventh of the light each are one mark; 30 cm apart they
    /// are seven. N = 8 marks of one shot, seed 1.
    #[test]
    fn light_that_comes_together_adds_up() {
        let quiet = [("detector.linear.false_alarm_hz".to_owned(), "1.0".to_owned())];
        let design = Design::open("coded-practical", &quiet).unwrap();
        let log = crate::emit::Band { scan: 0, first: 0, shots: 1 }.shot_log(&design);
        let shot = log.owned.start;
        let edges = |apart_fs: i64, photons: f64| {
            let echoes = Echoes {
                shot: vec![shot as u32; 7],
                delay_fs: (0..7).map(|ray| 500_000_000 + ray * apart_fs).collect(),
                photons: vec![photons; 7],
                ..Echoes::default()
            };
            let detectors = Detectors::in_the_dark(&design, Chance::new(1));
            detectors.edges(&log, &echoes, &mut Memory::default()).time.len()
        };
        // The threshold is at some 300 photons.
        assert_eq!(edges(10_000, 90.0), 8);
        assert_eq!(edges(2_000_000, 90.0), 0);
        assert_eq!(edges(2_000_000, 900.0), 56);
    }
}

//! The shape of a micropulse: its light reaches into the ticks, and the chips, around its own.

use macropulse_codec::statistics::normal_tail;

use crate::channel::{Light, PulseTrain, PulseTrains};
use crate::design::Design;
use crate::units::fs_from_s;

/// How far the light of a micropulse is followed, in rms lengths.
const FARTHEST: f64 = 3.0;

/// Slices of a micropulse are this fraction of its rms length: a Gaussian in steps of σ/2 is as smooth
/// as one without to 10⁻³⁰. As coarse as ticks, all light would come at one phase of a tick.
const FINEST: f64 = 0.5;

/// A Gaussian micropulse in slices.
#[derive(Debug)]
pub(super) struct Shape {
    /// Delay, fs, and share of the light of each slice.
    slices: Vec<(i64, f64)>,
}

impl Shape {
    /// The micropulse of a sensor whose light is followed beyond its chip: its detector sees every photon by
    /// itself. `None` for the others. A linear detector among them follows the pulse behind its amplifier.
    pub fn of(design: &Design) -> Option<Self> {
        let rms = design.detector.spread_of(&design.light)?;
        let width = FINEST * rms;
        let reach = (FARTHEST * rms / width).ceil() as i64;
        let below = |place: f64| normal_tail(-place * width / rms);
        let share = |slice: i64| below(slice as f64 + 0.5) - below(slice as f64 - 0.5);
        let total: f64 = (-reach..=reach).map(share).sum();
        let slice = |slice: i64| (fs_from_s(slice as f64 * width), share(slice) / total);
        Some(Self { slices: (-reach..=reach).map(slice).collect() })
    }

    /// Light with every pulse train of the sensor's own as those of its slices, which are detected
    /// independently of each other: photons are.
    pub fn spread<'a>(&self, light: &Light<'a>) -> Light<'a> {
        let slices = self.slices.len() as u16;
        let mut spread = Light { trains: PulseTrains::default(), ..light.clone() };
        for index in 0..light.trains.len() {
            let train = light.trains.at(index);
            if train.transmitter != 0 {
                spread.trains.push(train);
                continue;
            }
            for (slice, &(late_fs, share)) in (0..).zip(&self.slices) {
                spread.trains.push(PulseTrain {
                    arrives_fs: train.arrives_fs + late_fs,
                    photons: train.photons * share,
                    // Numbers of ways in a scene stay below 2000; a study may have more.
                    way: train.way.wrapping_mul(slices).wrapping_add(slice),
                    ..train
                });
            }
        }
        spread
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn physical(pulse: &str) -> Design {
        let set = [
            ("idealised".to_owned(), "['detector-bandwidth', 'mirror-motion']".to_owned()),
            ("light.pulse_ps".to_owned(), pulse.to_owned()),
        ];
        Design::open("kim-park-2016-physical", &set).unwrap()
    }

    #[test]
    fn light_is_spread_as_a_gaussian_and_none_is_lost() {
        for pulse in ["0.5", "2.5", "25.0", "1000.0"] {
            let slices = Shape::of(&physical(pulse)).unwrap().slices;
            assert!((3..=13).contains(&slices.len()), "{pulse} ps: {}", slices.len());
            let total: f64 = slices.iter().map(|(_, share)| share).sum();
            approx::assert_relative_eq!(total, 1.0, max_relative = 1e-12);
            let square = |(late, share): &(i64, f64)| share * (*late as f64).powi(2);
            let rms = slices.iter().map(square).sum::<f64>().sqrt() * 1e-3;
            let expected: f64 = pulse.parse::<f64>().unwrap() * 0.42466;
            // Light beyond three deviations is missing, and slices have a width.
            assert!(expected < 2.0 || (rms / expected - 1.0).abs() < 0.03, "{pulse} ps: {rms} ps");
        }
    }

    /// A micropulse as long as its chip sends an eighth of its light into each neighbour.
    #[test]
    fn a_chip_keeps_three_quarters_of_its_light() {
        let slices = Shape::of(&physical("2.5")).unwrap().slices;
        // The part of a slice that lies within the chip.
        let width = (slices[1].0 - slices[0].0) as f64;
        let within = |chip: f64| -> f64 {
            let inside = |late: i64| 0.5 + (1250.0 - (late as f64 - chip * 2500.0).abs()) / width;
            slices.iter().map(|(late, share)| share * inside(*late).clamp(0.0, 1.0)).sum()
        };
        approx::assert_relative_eq!(within(0.0), 0.761, max_relative = 2e-2);
        approx::assert_relative_eq!(within(1.0), 0.119, max_relative = 5e-2);
    }

    #[test]
    fn an_ideal_micropulse_stays_in_its_chip() {
        assert!(Shape::of(&Design::open("kim-park-2016-physical", &[]).unwrap()).is_some());
        assert!(Shape::of(&Design::open("kim-park-2016", &[]).unwrap()).is_none());
    }
}

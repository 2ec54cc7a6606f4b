//! The receiver of taps against closed forms.

use std::f64::consts::{PI, TAU};

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal, Poisson};

use super::*;
use crate::time::fs_from_s;

/// Half the speed of light, m/s.
const HALF_C: f64 = 149_896_229.0;

/// A log of `shots` shots, all of them owned.
fn log(shots: usize) -> ShotLog {
    ShotLog {
        fired_at_fs: (0..shots as i64).map(|shot| shot * 1_000_000_000_000).collect(),
        row: vec![0; shots],
        column: vec![0; shots],
        label: vec![0; shots],
        word: vec![0; shots],
        channel: vec![0; shots],
        owned: 0..shots,
        first: 0,
    }
}

/// A receiver of targets up to `range` metres.
fn receiver(tones: Vec<Tone>, range: f64) -> PhaseReceiver {
    PhaseReceiver { gate_fs: (0, fs_from_s(range / HALF_C)), method: PhaseMethod::new(tones) }
}

/// Mean charges of the taps of a target at `range`, `charge` being that of a tap without modulation and `dark` what
/// steady light adds.
fn charges(tones: &[Tone], range: f64, (charge, dark): (f64, f64)) -> Vec<f64> {
    let of = |tone: &Tone| {
        let phase = TAU * tone.hz * range / HALF_C;
        tone.shares(phase).map(move |share| charge * share + dark).collect::<Vec<_>>()
    };
    tones.iter().flat_map(of).collect()
}

/// Poisson variables with the means `charges`, shot after shot.
fn drawn(charges: &[f64], shots: usize, seed: u64) -> Taps {
    let mut chance = ChaCha8Rng::seed_from_u64(seed);
    let laws: Vec<_> = charges.iter().map(|mean| Poisson::new(*mean).unwrap()).collect();
    let codes = (0..shots)
        .flat_map(|_| laws.iter().map(|law| law.sample(&mut chance) as u16).collect::<Vec<_>>());
    Taps { taps: charges.len() as u32, codes: codes.collect() }
}

/// The range of each return, m.
fn ranges(returns: &Returns) -> Vec<f64> {
    returns.tof.iter().map(|tof| tof * HALF_C).collect()
}

/// The square root of the mean squared distance from `middle`.
fn rms(values: &[f64], middle: f64) -> f64 {
    (values.iter().map(|value| (value - middle).powi(2)).sum::<f64>() / values.len() as f64).sqrt()
}

/// Largest error of the phase, rad, of a receiver of square waves that takes them for pure ones.
fn wiggle(phases: u32) -> f64 {
    let tone = Tone { hz: 1e8, phases, contrasts: Tone::squares(63) };
    let aliased = Demodulator::new(&tone);
    let measured = |at: u32| {
        let phase = TAU * f64::from(at) / 20_000.0 - PI;
        let tap = |(k, share): (usize, f64)| {
            let angle = TAU * k as f64 / f64::from(phases);
            [share * libm::cos(angle), share * libm::sin(angle)]
        };
        let parts = tone.shares(phase).enumerate().map(tap);
        let [re, im] = parts.fold([0.0, 0.0], |sum, part| [sum[0] + part[0], sum[1] + part[1]]);
        let angle = libm::atan2(im, re);
        // The same error is undone.
        assert!(tone::wrapped(aliased.freed(angle).0 - phase).abs() < 1e-9, "{phases}: {phase}");
        tone::wrapped(angle - phase).abs()
    };
    (0..20_000).map(measured).fold(0.0, f64::max)
}

/// A triangle that is sampled at four places has the error atan(φ/(π/2 − φ)) − φ, at most 71.11 mrad; at three places
/// 19.50, at eight 8.02.
#[test]
fn square_waves_make_the_cyclic_errors_of_the_closed_form_and_they_are_undone() {
    for (phases, published) in [(3, 19.50), (4, 71.11), (8, 8.02)] {
        let found = wiggle(phases) * 1e3;
        // 63 harmonics leave 0.2 mrad of a triangle's.
        assert!((found - published).abs() < 0.2, "{phases} phases: {found} mrad");
    }
}

/// H0: the standard deviation of the range is c·√b/(4·√2·π·f·a) for four taps of b + a·cos: 3.374 mm for a = 5000,
/// b = 10⁴, 100 MHz. N = 20 000, seed 5, α = 1e-6 (|z| < 4.9, z = √(2N)·ln of the ratio). Control: half the contrast.
#[test]
fn four_taps_have_the_precision_of_the_closed_form() {
    let tones = vec![Tone::pure(1e8, 4, 0.5)];
    let shots = 20_000;
    let taps = drawn(&charges(&tones, 0.9, (1e4, 0.0)), shots, 5);
    let returns = decode(&receiver(tones, 1.4), &log(shots), &taps).unwrap();
    assert_eq!(returns.len(), shots);
    let found = rms(&ranges(&returns), 0.9);
    let z = |expected: f64| (2.0 * shots as f64).sqrt() * libm::log(found / expected);
    assert!(z(3.374e-3).abs() < 4.9, "{found}");
    assert!(z(2.0 * 3.374e-3).abs() > 4.9);
    let light: f64 =
        returns.photons.iter().map(|light| f64::from(*light)).sum::<f64>() / shots as f64;
    approx::assert_relative_eq!(light, 4e4, max_relative = 1e-3);
}

/// Frequencies f with the greatest common divisor g tell ranges apart to c/2g. Published are 4.997 m for 120
/// and 90 MHz, 8.328 m for 90 and 72 MHz, and 18.737 m for 80, 16 and 120 MHz.
#[test]
fn several_frequencies_tell_ranges_apart_to_their_common_interval() {
    for (mhz, interval) in
        [(&[120.0, 90.0][..], 4.997), (&[90.0, 72.0], 8.328), (&[80.0, 16.0, 120.0], 18.737)]
    {
        let tones: Vec<Tone> = mhz.iter().map(|mhz| Tone::pure(mhz * 1e6, 4, 0.8)).collect();
        let receiver = receiver(tones.clone(), interval);
        let shots = 500;
        let places: Vec<f64> =
            (0..shots).map(|shot| 0.05 + (interval - 0.1) * f64::from(shot) / 500.0).collect();
        let code = |place: &f64| charges(&tones, *place, (2e4, 500.0));
        let codes = places.iter().flat_map(code).map(|charge| charge.round() as u16).collect();
        let taps = Taps { taps: tones.len() as u32 * 4, codes };
        let returns = decode(&receiver, &log(500), &taps).unwrap();
        assert_eq!(returns.len(), 500, "{mhz:?}");
        for (found, place) in ranges(&returns).iter().zip(&places) {
            assert!((found - place).abs() < 1e-3, "{mhz:?} {place}: {found}");
        }
        assert!(returns.margin.iter().all(|margin| *margin > 5));
        // Control: of twice the interval all is told as if it were in the first half.
        let far = super::decode(
            &PhaseReceiver { gate_fs: (0, 2 * receiver.gate_fs.1), ..receiver },
            &log(500),
            &taps,
        );
        assert!(far.unwrap().margin.iter().all(|margin| *margin == 0));
    }
}

/// H0: the range is off by whole intervals c/2f of the finer frequency f with the probability 2·Q(c/(4fσ)),
/// if no third interval is near. Here σ is the standard deviation of the difference of the two ranges.
/// N = 40 000, seed 8, α = 1e-6 (|z| < 4.9). Control: twice that probability.
#[test]
fn a_wrong_interval_is_as_likely_as_the_noise_of_the_coarse_phase_says() {
    let tones = vec![Tone::pure(1e7, 4, 0.4), Tone::pure(1e8, 4, 0.4)];
    let (charge, range, shots) = (250.0, 7.0, 40_000);
    let taps = drawn(&charges(&tones, range, (charge, 0.0)), shots, 8);
    let returns = decode(&receiver(tones, 14.9), &log(shots), &taps).unwrap();
    let wrong = ranges(&returns).iter().filter(|found| (*found - range).abs() > 0.5).count() as f64;
    // The phase of four taps of b + a·cos has the variance b/(2·a²).
    let phase = (charge / (2.0 * (0.4 * charge).powi(2))).sqrt();
    let sigma = |hz: f64| HALF_C * phase / (TAU * hz);
    // The finer range is held; the coarser one decides in which interval.
    let spread = libm::hypot(sigma(1e7), sigma(1e8));
    let expected = 2.0 * crate::statistics::normal_tail(HALF_C / 1e8 / 2.0 / spread);
    let mean = expected * shots as f64;
    let z = |mean: f64| (wrong - mean) / mean.sqrt();
    assert!(mean > 100.0 && z(mean).abs() < 4.9, "{wrong} of {mean}");
    assert!(z(2.0 * mean).abs() > 4.9);
}

/// H0: shots without modulated light have returns at the accepted rate. N = 200 000, seed 3, α = 1e-6 (|z| < 4.9).
/// Control: half the rate is noticed.
#[test]
fn noise_makes_returns_at_the_accepted_rate() {
    let tones = vec![Tone::pure(5e7, 4, 0.5), Tone::pure(4e7, 3, 0.5)];
    let shots = 200_000;
    let mut receiver = receiver(tones, 14.0);
    receiver.method = PhaseMethod {
        electrons_per_code: 2.5,
        dark_code: 100.0,
        read_noise: 30.0,
        false_alarm: 2e-3,
        ..receiver.method
    };
    let mut chance = ChaCha8Rng::seed_from_u64(3);
    let (steady, reading) = (Poisson::new(4000.0).unwrap(), Normal::new(0.0, 30.0).unwrap());
    let codes = (0..7 * shots).map(|_| {
        let electrons: f64 = steady.sample(&mut chance) + reading.sample(&mut chance);
        (100.0 + electrons / 2.5).round() as u16
    });
    let taps = Taps { taps: 7, codes: codes.collect() };
    let returns = decode(&receiver, &log(shots), &taps).unwrap();
    let found = (returns.len() as u64 + returns.rejected(Reject::OutsideGate)) as f64;
    let mean = 2e-3 * shots as f64;
    let z = |mean: f64| (found - mean) / mean.sqrt();
    assert!(z(mean).abs() < 4.9, "{found} of {mean}");
    assert!(z(0.5 * mean).abs() > 4.9);
    assert_eq!(returns.rejected(Reject::NoPeak), shots as u64 - found as u64);
}

/// Known answer: the sum of two exponential powers exceeds x with the probability (1 + x)·e^{−x}.
#[test]
fn thresholds_are_those_of_sums_of_exponential_powers() {
    approx::assert_relative_eq!(threshold(1, 1e-6), -libm::log(1e-6), max_relative = 1e-12);
    let two = threshold(2, 1e-4);
    approx::assert_relative_eq!((1.0 + two) * libm::exp(-two), 1e-4, max_relative = 1e-9);
}

/// Two paths: the phase moves by atan2(γ·sin Δ, 1 + γ·cos Δ), Δ = 4πfδ/c: 27.06 mm at 20 MHz and 21.95 mm at 100 MHz
/// for γ = 0.1 and δ = 0.3 m.
#[test]
fn a_second_path_moves_the_range_by_the_closed_form() {
    for (hz, published) in [(2e7, 27.06), (1e8, 21.95)] {
        let tones = vec![Tone::pure(hz, 4, 1.0)];
        let [near, far] = [(0.5, 28_000.0), (0.8, 2_800.0)]
            .map(|(range, charge)| charges(&tones, range, (charge, 0.0)));
        let codes = near.iter().zip(&far).map(|(one, other)| (one + other).round() as u16);
        let taps = Taps { taps: 4, codes: codes.collect() };
        let returns = decode(&receiver(tones, 1.4), &log(1), &taps).unwrap();
        let found = 1e3 * (ranges(&returns)[0] - 0.5);
        assert!((found - published).abs() < 0.02 * 2e7 / hz + 0.02, "{hz}: {found} mm");
    }
}

#[test]
fn a_full_tap_takes_its_frequency_out() {
    let tones = vec![Tone::pure(1e8, 4, 0.5), Tone::pure(2e7, 4, 0.5)];
    let mut codes: Vec<u16> =
        charges(&tones, 1.0, (1e4, 0.0)).iter().map(|charge| charge.round() as u16).collect();
    codes[1] = u16::MAX;
    let mut taps = Taps { taps: 8, codes };
    let receiver = receiver(tones, 7.0);
    let returns = decode(&receiver, &log(1), &taps).unwrap();
    assert_eq!((returns.peak[0], returns.marks[0], returns.saturated[0]), (1, 2, true));
    approx::assert_relative_eq!(ranges(&returns)[0], 1.0, max_relative = 1e-2);
    taps.codes[6] = u16::MAX;
    let returns = decode(&receiver, &log(1), &taps).unwrap();
    assert_eq!((returns.len(), returns.rejected(Reject::NoPeak)), (0, 1));
}

#[test]
fn impossible_settings_and_records_are_refused() {
    let tones = || vec![Tone::pure(1e8, 4, 0.5)];
    let given = Taps { taps: 4, codes: vec![9; 4] };
    assert!(decode(&receiver(tones(), 1.0), &log(1), &given).is_ok());
    let refused = |change: &dyn Fn(&mut PhaseReceiver)| {
        let mut changed = receiver(tones(), 1.0);
        change(&mut changed);
        decode(&changed, &log(1), &given).unwrap_err().to_string()
    };
    for (change, told) in [
        (
            &(|it: &mut PhaseReceiver| it.gate_fs = (5, 4)) as &dyn Fn(&mut PhaseReceiver),
            "`gate_fs`",
        ),
        (&|it| it.gate_fs.1 = i64::MAX, "a gate of 65536 periods or fewer"),
        (&|it| it.method.tones.clear(), "`tones` of the receiver is 0"),
        (&|it| it.method.tones[0].hz = f64::NAN, "`tones.hz`"),
        (&|it| it.method.tones[0].phases = 2, "`tones.phases` of the receiver is 2; use 3 to 64"),
        (&|it| it.method.tones[0].contrasts[0] = 0.0, "`tones.contrasts`"),
        (&|it| it.method.tones[0].contrasts.clear(), "`tones.contrasts`"),
        (&|it| it.method.electrons_per_code = 0.0, "`electrons_per_code`"),
        (&|it| it.method.read_noise = f64::INFINITY, "`read_noise`"),
        (&|it| it.method.false_alarm = 0.0, "`false_alarm`"),
        (&|it| it.method.tones[0].phases = 5, "`taps` of the receiver is 4"),
    ] {
        let message = refused(change);
        assert!(message.contains(told), "{message}");
    }
    let short = Taps { taps: 4, codes: vec![9; 3] };
    let message = decode(&receiver(tones(), 1.0), &log(1), &short).unwrap_err().to_string();
    assert!(message.contains("`codes` has 3 entries for 4"), "{message}");
}

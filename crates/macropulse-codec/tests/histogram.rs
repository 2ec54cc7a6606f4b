//! The receiver of histograms against closed forms: pile-up, precision, false returns, the reach in
//! sunlight, two surfaces. Each test that draws names N, its seed and α, and has a control that fails.

#![allow(clippy::unwrap_used)]

use macropulse_codec::decode::histogram::{
    HistogramMethod, HistogramReceiver, PileUp, Pulse, coates, decode,
};
use macropulse_codec::decode::{Error, Pick, Reject, Returns};
use macropulse_codec::files::{RecordHeader, RecordReader, RecordWriter};
use macropulse_codec::{Given, Histograms, ShotLog};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Binomial, Distribution, Poisson, Uniform};
use statrs::distribution::{ContinuousCDF, Normal};

/// 100 ps.
const BIN_FS: i64 = 100_000;

/// Range per time of flight, mm per bin of 100 ps.
const MM_PER_BIN: f64 = 14.989_622_9;

/// A surface: where the middle of its echo is, in bins, and its photons.
type Echo = (f64, f64);

fn gaussian(bins: f64) -> Pulse {
    Pulse::Gaussian { rms_fs: bins * BIN_FS as f64 }
}

/// Share of a Gaussian pulse in each of the first `bins` bins.
fn shares(bins: usize, middle: f64, rms: f64) -> Vec<f64> {
    let normal = Normal::new(middle, rms).unwrap();
    (0..bins).map(|bin| normal.cdf(bin as f64 + 1.0) - normal.cdf(bin as f64)).collect()
}

/// Mean counts of an even background and Gaussian echoes.
fn expected(bins: usize, background: f64, rms: f64, echoes: &[Echo]) -> Vec<f64> {
    let mut mean = vec![background; bins];
    for (middle, photons) in echoes {
        for (mean, share) in mean.iter_mut().zip(shares(bins, *middle, rms)) {
            *mean += photons * share;
        }
    }
    mean
}

fn drawn(mean: &[f64], rng: &mut ChaCha8Rng) -> Vec<u32> {
    let draw = |mean: &f64| match *mean > 1e-9 {
        true => Poisson::new(*mean).unwrap().sample(rng) as u32,
        false => 0,
    };
    mean.iter().map(draw).collect()
}

/// Counts of a detector that stops at the first photon of each of `cycles` laser pulses. A pulse brings
/// `photons[bin]` photons in a bin on average.
fn stopped(photons: &[f64], cycles: u32, rng: &mut ChaCha8Rng) -> Vec<u32> {
    let mut left = u64::from(cycles);
    let mut draw = |mean: &f64| {
        let count = Binomial::new(left, 1.0 - (-mean).exp()).unwrap().sample(rng);
        left -= count;
        count as u32
    };
    photons.iter().map(&mut draw).collect()
}

fn histograms(cycles: u32, counts: &[Vec<u32>]) -> Histograms {
    Histograms {
        bin_fs: BIN_FS,
        offset_fs: 0,
        bins: counts.first().map_or(1, Vec::len) as u32,
        cycles: vec![cycles; counts.len()],
        counts: counts.concat(),
    }
}

fn decoded(receiver: &HistogramReceiver, cycles: u32, counts: &[Vec<u32>]) -> Returns {
    let log = ShotLog::of_one_channel(&vec![0; counts.len()], &vec![0; counts.len()]);
    decode(receiver, &log, &histograms(cycles, counts)).unwrap()
}

/// Time of flight of each return, in bins.
fn lags(returns: &Returns) -> Vec<f64> {
    returns.tof.iter().map(|tof| tof * 1e15 / BIN_FS as f64).collect()
}

fn mean(of: &[f64]) -> f64 {
    of.iter().sum::<f64>() / of.len() as f64
}

fn deviation(of: &[f64]) -> f64 {
    let middle = mean(of);
    (of.iter().map(|one| (one - middle).powi(2)).sum::<f64>() / of.len() as f64).sqrt()
}

/// N = 300 histograms, seed 1: behind 0.7375 photons a cycle, 0.055 photons are counted as 0.0256 and
/// corrected to 0.055, within 5 standard errors of the mean (α = 6·10⁻⁷).
#[test]
fn coates_gives_the_photons_of_each_bin() {
    const CYCLES: u32 = 100_000;
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut photons = vec![0.014_75; 50];
    photons.push(0.055);
    let counts: Vec<Vec<u32>> = (0..300).map(|_| stopped(&photons, CYCLES, &mut rng)).collect();
    let raw: Vec<f64> =
        counts.iter().map(|counts| f64::from(counts[50]) / f64::from(CYCLES)).collect();
    let corrected: Vec<f64> = counts.iter().map(|counts| coates(counts, CYCLES)[50]).collect();
    let error = |of: &[f64]| 5.0 * deviation(of) / 300_f64.sqrt();
    assert!((mean(&raw) - 0.0256).abs() < error(&raw) + 5e-5, "{}", mean(&raw));
    assert!((mean(&corrected) - 0.055).abs() < error(&corrected), "{}", mean(&corrected));
    // Control: what is counted is not what came.
    assert!((mean(&raw) - 0.055).abs() > 100.0 * error(&raw));
    // After the bin that stops the last cycle, nothing is known.
    assert_eq!(
        coates(&[1, 1, 0, 5], 2),
        [std::f64::consts::LN_2, std::f64::consts::LN_2, 0.0, 0.0]
    );
}

/// Mean photons n of a rectangular pulse of length τ that stop a detector: ⟨t⟩/τ = 1/n − 1/(eⁿ − 1),
/// −12.29 mm at 1 ns and n = 1. N = 200 histograms of 20 000 cycles, seed 2, within 5 standard errors
/// (α = 6·10⁻⁷). The control is what was counted.
#[test]
fn pile_up_brings_a_surface_nearer_and_coates_takes_it_back() {
    const CYCLES: u32 = 20_000;
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    // 1 ns is ten bins; its middle is at bin 85.
    let photons: Vec<f64> =
        (0..160).map(|bin| if (80..90).contains(&bin) { 0.1 } else { 0.0 }).collect();
    let counts: Vec<Vec<u32>> = (0..200).map(|_| stopped(&photons, CYCLES, &mut rng)).collect();
    let shift = |lags: &[f64]| -> (f64, f64) {
        let mm: Vec<f64> = lags.iter().map(|lag| (lag - 85.0) * MM_PER_BIN).collect();
        (mean(&mm), 5.0 * deviation(&mm) / 200_f64.sqrt())
    };
    let centroid = |light: &[f64]| {
        let places = light.iter().enumerate().map(|(bin, light)| light * (bin as f64 + 0.5));
        places.sum::<f64>() / light.iter().sum::<f64>()
    };
    let raw = |counts: &Vec<u32>| counts.iter().map(|n| f64::from(*n)).collect::<Vec<f64>>();
    let (counted, error) =
        shift(&counts.iter().map(|one| centroid(&raw(one))).collect::<Vec<f64>>());
    assert!((counted + 12.29).abs() < error, "{counted} ± {error}");
    let corrected: Vec<f64> = counts.iter().map(|one| centroid(&coates(one, CYCLES))).collect();
    let (corrected, error) = shift(&corrected);
    assert!(corrected.abs() < error, "{corrected} ± {error}");
    // Without a background, the likeliest place of a Gaussian pulse is the centroid. That it is not the
    // shape of this one leaves less than a tenth of a bin.
    let receiver = HistogramReceiver::new(gaussian(10.0 / 12_f64.sqrt()));
    let (found, error) = shift(&lags(&decoded(&receiver, CYCLES, &counts)));
    assert!((found + 12.29).abs() < error + 0.1, "{found} ± {error}");
    let receiver = HistogramReceiver {
        method: HistogramMethod { pile_up: PileUp::Coates, ..receiver.method.clone() },
        ..receiver
    };
    let returns = decoded(&receiver, CYCLES, &counts);
    let (found, _) = shift(&lags(&returns));
    assert!(found.abs() < 0.1 * MM_PER_BIN, "{found}");
    let photons: Vec<f64> = returns.photons.iter().map(|photons| f64::from(*photons)).collect();
    assert!((mean(&photons) / f64::from(CYCLES) - 1.0).abs() < 0.01, "{}", mean(&photons));
}

/// σ_t = σ_irf/√N times 1.00, 1.08, 1.42 and 2.93 for 0, 0.01, 0.1 and 1 background counts per σ_irf and
/// signal photon, the bound of Cramér and Rao. 1500 histograms each, seed 3, N = 400 photons: within
/// 6 % (3.3 standard errors, α = 10⁻³).
#[test]
fn precision_is_that_of_the_bound() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let place = Uniform::new(120.0, 136.0).unwrap();
    for (ratio, factor) in [(0.0, 1.00), (0.01, 1.08), (0.1, 1.42), (1.0, 2.93)] {
        let truth: Vec<f64> = (0..1500).map(|_| place.sample(&mut rng)).collect();
        let counts: Vec<Vec<u32>> = truth
            .iter()
            .map(|at| drawn(&expected(256, 100.0 * ratio, 4.0, &[(*at, 400.0)]), &mut rng))
            .collect();
        let spread = |rms: f64| {
            let returns = decoded(&HistogramReceiver::new(gaussian(rms)), 0, &counts);
            assert!(returns.len() >= 1490, "{ratio}: {}", returns.len());
            let shots = returns.shot.iter().map(|shot| truth[*shot as usize]);
            let off: Vec<f64> =
                lags(&returns).iter().zip(shots).map(|(lag, at)| lag - at).collect();
            assert!(mean(&off).abs() < 0.1, "{ratio}: biased by {}", mean(&off));
            deviation(&off) / (4.0 / 20.0)
        };
        let reached = spread(4.0);
        assert!((reached / factor - 1.0).abs() < 0.06, "{ratio}: {reached} of {factor}");
        // Control: a pulse that is not as emitted.
        assert!(ratio < 1.0 || spread(12.0) > 1.15 * factor);
    }
}

/// The mean error is below a tenth of a bin wherever in its bin a surface is: N = 300 histograms of 300
/// photons for each of ten places, seed 4; σ/√N is at most 0.01 bins, and 6 of them are allowed
/// (α = 10⁻⁹). The control takes the middle of the fullest bin.
#[test]
fn bias_is_below_a_tenth_of_a_bin() {
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    for rms in [0.5, 1.0, 3.0] {
        let measured = Pulse::Measured { counts: shares(40, 20.0, rms), origin: 20.0 };
        let mut worst_control: f64 = 0.0;
        for tenth in 0..10 {
            let at = 60.0 + f64::from(tenth) / 10.0;
            let mean_counts = expected(128, 0.5, rms, &[(at, 300.0)]);
            let counts: Vec<Vec<u32>> = (0..300).map(|_| drawn(&mean_counts, &mut rng)).collect();
            for pulse in [gaussian(rms), measured.clone()] {
                let returns = decoded(&HistogramReceiver::new(pulse), 0, &counts);
                let bias = mean(&lags(&returns)) - at;
                assert!(bias.abs() < 0.1, "rms {rms} at {at}: {bias}");
            }
            let fullest = |counts: &Vec<u32>| {
                let most = counts.iter().max().unwrap();
                counts.iter().position(|count| count == most).unwrap() as f64 + 0.5
            };
            let control = mean(&counts.iter().map(fullest).collect::<Vec<f64>>()) - at;
            worst_control = worst_control.max(control.abs());
        }
        assert!(rms > 1.0 || worst_control > 0.15, "the control is right: {worst_control}");
    }
}

/// Returns from background alone: no more than 2 % of N = 6000 histograms, seed 5, have one (α = 10⁻³: 120
/// expected, 155 at most), and no fewer than a tenth of that. At 0.01 counts a bin they are rarer: a return
/// needs three counts at once, as two coincide too often. The control assumes that noise behind the matched
/// filter is normal. It finds several times more in histograms with few counts.
#[test]
fn false_returns_are_as_rare_as_stated() {
    const ALL: usize = 6000;
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    for (background, least) in [(0.01, 1), (0.1, 12), (1.0, 12), (30.0, 12)] {
        let counts: Vec<Vec<u32>> =
            (0..ALL).map(|_| drawn(&vec![background; 256], &mut rng)).collect();
        let receiver = HistogramReceiver {
            method: HistogramMethod {
                false_alarm: 0.02,
                ..HistogramReceiver::new(gaussian(2.0)).method
            },
            ..HistogramReceiver::new(gaussian(2.0))
        };
        let returns = decoded(&receiver, 0, &counts);
        let found = returns.len();
        assert!((least..155).contains(&found), "{background}: {found}");
        assert_eq!(returns.rejected(Reject::NoPeak) as usize, ALL - found);
        // exp(−τ²/4σ²) leaves about 0.35·σ⁻¹·√(2π)⁻¹·x rises a bin.
        let filter = shares(21, 10.5, 2.0);
        let energy: f64 = filter.iter().map(|share| share * share).sum();
        let exceeds = |counts: &&Vec<u32>| {
            let score = |bins: &[u32]| -> f64 {
                let sum: f64 =
                    bins.iter().zip(&filter).map(|(n, p)| (f64::from(*n) - background) * p).sum();
                sum / (background * energy).sqrt()
            };
            counts.windows(21).any(|bins| score(bins) > 3.9)
        };
        let control = counts.iter().filter(exceeds).count();
        assert!(background > 0.1 || control > 5 * 120, "{background}: {control}");
    }
}

/// The photons that half of N = 150 histograms need, seed 6.
fn needed(background: f64, rng: &mut ChaCha8Rng) -> f64 {
    let receiver = HistogramReceiver::new(gaussian(4.0));
    let (mut few, mut many) = (1.0_f64, 1e5_f64);
    while many / few > 1.02 {
        let photons = (few * many).sqrt();
        let mean = expected(256, background, 4.0, &[(128.3, photons)]);
        let counts: Vec<Vec<u32>> = (0..150).map(|_| drawn(&mean, rng)).collect();
        let returns = decoded(&receiver, 0, &counts);
        let right = lags(&returns).iter().filter(|lag| (*lag - 128.3).abs() < 6.0).count();
        if right > 75 { many = photons } else { few = photons }
    }
    (few * many).sqrt()
}

/// Photons fall with the square of the range. They rise with the laser pulses, as the background does. With
/// 16 times the pulses a surface is found 2 times as far if background limits it, and 4 times as far if none
/// does. Within 5 %: N = 150 leaves 2.5 % of the photons in each of two, and half of that of the range
/// (α = 10⁻³).
#[test]
fn reach_in_sunlight_goes_with_the_fourth_root_of_the_laser_pulses() {
    let mut rng = ChaCha8Rng::seed_from_u64(6);
    let farther = |from: f64, to: f64, rng: &mut ChaCha8Rng| {
        (16.0 * needed(from, rng) / needed(to, rng)).sqrt()
    };
    for (from, to) in [(100.0, 1600.0), (1600.0, 25_600.0)] {
        let times = farther(from, to, &mut rng);
        assert!((times / 2.0 - 1.0).abs() < 0.05, "{times}");
    }
    let in_the_dark = farther(1e-5, 1.6e-4, &mut rng);
    assert!(in_the_dark > 3.0, "the control is as in sunlight: {in_the_dark}");
}

/// A pulse with a tail: a Gaussian rise and an exponential fall of four bins, as measured.
fn tailed() -> Vec<f64> {
    let mut counts = vec![0.0; 48];
    for (bin, share) in shares(48, 5.0, 1.0).iter().enumerate() {
        for (late, count) in counts[bin..].iter_mut().enumerate() {
            *count += share * (-(late as f64) / 4.0).exp();
        }
    }
    counts
}

/// Counts of surfaces that send such pulses back, beginning at whole bins.
fn with_tails(surfaces: &[(usize, f64)], all: usize, seed: u64) -> Vec<Vec<u32>> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let sum: f64 = tailed().iter().sum();
    let mut mean = vec![1.0; 256];
    for (first, photons) in surfaces {
        for (mean, count) in mean[*first..].iter_mut().zip(tailed()) {
            *mean += photons * count / sum;
        }
    }
    (0..all).map(|_| drawn(&mean, &mut rng)).collect()
}

/// A faint surface on the tail of a bright one, and two that overlap: N = 300 histograms each, seeds 7 and
/// 8. At least 297 have both (α = 10⁻³ of a thousandth missed), with a mean error below a tenth of a bin.
#[test]
fn two_surfaces_are_resolved() {
    let pulse = Pulse::Measured { counts: tailed(), origin: 0.0 };
    let receiver = HistogramReceiver {
        method: HistogramMethod { false_alarm: 1e-4, ..HistogramMethod::new(pulse.clone()) },
        returns: 8,
        ..HistogramReceiver::new(pulse)
    };
    let cases = [(7, [(60, 20_000.0), (72, 1500.0)]), (8, [(60, 2000.0), (65, 2000.0)])];
    for (seed, surfaces) in cases {
        let counts = with_tails(&surfaces, 300, seed);
        let returns = decoded(&receiver, 0, &counts);
        let lags = lags(&returns);
        let places: Vec<usize> = (0..returns.len()).collect();
        let of_shots = places.chunk_by(|one, next| returns.shot[*one] == returns.shot[*next]);
        let both: Vec<&[usize]> = of_shots.filter(|of| of.len() == 2).collect();
        assert!(both.len() >= 297, "{surfaces:?}: {}", both.len());
        for (number, (first, photons)) in surfaces.iter().enumerate() {
            let off: Vec<f64> = both.iter().map(|of| lags[of[number]] - *first as f64).collect();
            assert!(mean(&off).abs() < 0.1, "{first}: {}", mean(&off));
            let light: Vec<f64> =
                both.iter().map(|of| f64::from(returns.photons[of[number]])).collect();
            assert!((mean(&light) / photons - 1.0).abs() < 0.05, "{first}: {}", mean(&light));
        }
    }
    // One surface is one return; to a receiver that does not know of the tail it is several.
    let one = with_tails(&[(60, 20_000.0)], 300, 9);
    assert_eq!(decoded(&receiver, 0, &one).len(), 300);
    let unaware = HistogramReceiver {
        method: HistogramMethod { pulse: gaussian(2.0), ..receiver.method.clone() },
        ..receiver
    };
    assert!(decoded(&unaware, 0, &one).len() > 600);
}

/// A pulse that the surface stretches by a tenth is one return where the error of the shape is allowed
/// for, and several where it is not. N = 50, seed 10.
#[test]
fn an_error_of_the_shape_makes_no_further_returns() {
    let mut rng = ChaCha8Rng::seed_from_u64(10);
    let mean = expected(256, 5.0, 2.2, &[(128.4, 1e5)]);
    let counts: Vec<Vec<u32>> = (0..50).map(|_| drawn(&mean, &mut rng)).collect();
    let strict = HistogramReceiver { returns: 8, ..HistogramReceiver::new(gaussian(2.0)) };
    let lenient = HistogramReceiver {
        method: HistogramMethod { shape_error: 0.2, least_share: 0.01, ..strict.method.clone() },
        ..strict
    };
    assert_eq!(decoded(&lenient, 0, &counts).len(), 50);
    assert!(decoded(&strict, 0, &counts).len() > 100);
}

/// A sensor of 128 bins whose pulse has a tail looks at a table, and at an object on it in every other
/// pixel. Its histograms go through a file. N = 200 pixels, seed 11: each surface is within 6 standard
/// deviations of 0.02 bins, σ/√N of the fainter one (α = 10⁻⁶).
#[test]
fn a_file_of_histograms_becomes_distances() {
    const CYCLES: u32 = 4_000_000;
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let sum: f64 = tailed().iter().sum();
    let table = |pixel: usize| 55 + pixel % 7;
    let counts: Vec<Vec<u32>> = (0..200)
        .map(|pixel| {
            let mut photons = vec![50.0 / f64::from(CYCLES); 128];
            let object = (pixel % 2 == 1).then_some((30, 400_000.0));
            for (first, light) in [Some((table(pixel), 100_000.0)), object].into_iter().flatten() {
                for (photons, count) in photons[first..].iter_mut().zip(tailed()) {
                    *photons += light / f64::from(CYCLES) * count / sum;
                }
            }
            stopped(&photons, CYCLES, &mut rng)
        })
        .collect();
    let record = histograms(CYCLES, &counts);
    let header = RecordHeader { digest: None, count: Some(200) };
    let mut file = Vec::new();
    RecordWriter::new(&mut file, &record, &header).unwrap().write(&record, 0).unwrap();
    let mut reader = RecordReader::new(&file[..], &record).unwrap();
    let mut read = Histograms { cycles: Vec::new(), counts: Vec::new(), ..record };
    while let Some((_, Given::Histograms(one))) = reader.next_shot().unwrap() {
        read.cycles.extend(one.cycles);
        read.counts.extend(one.counts);
    }
    let pulse = Pulse::Measured { counts: tailed(), origin: 0.0 };
    let receiver = HistogramReceiver {
        method: HistogramMethod { pile_up: PileUp::Coates, ..HistogramMethod::new(pulse.clone()) },
        returns: 2,
        ..HistogramReceiver::new(pulse)
    };
    let log = ShotLog::of_one_channel(&[0; 200], &[0; 200]);
    let returns = decode(&receiver, &log, &read).unwrap();
    let truth: Vec<f64> = (0..200)
        .flat_map(|pixel| {
            let object = (pixel % 2 == 1).then_some(30.0);
            object.into_iter().chain([table(pixel) as f64])
        })
        .collect();
    assert_eq!(returns.len(), truth.len());
    for (lag, at) in lags(&returns).iter().zip(truth) {
        assert!((lag - at).abs() < 0.12, "{lag} for {at}");
    }
}

#[test]
fn a_return_is_picked_within_the_gate() {
    let means = expected(256, 0.2, 2.0, &[(50.0, 100.0), (90.0, 900.0), (200.0, 300.0)]);
    let counts = [means.iter().map(|mean| mean.round() as u32).collect::<Vec<u32>>()];
    let base = HistogramReceiver::new(gaussian(2.0));
    let found = |receiver: HistogramReceiver| -> Vec<f64> {
        lags(&decoded(&receiver, 0, &counts)).iter().map(|lag| lag.round()).collect()
    };
    for (pick, at) in [(Pick::First, 50.0), (Pick::Strongest, 90.0), (Pick::Last, 200.0)] {
        assert_eq!(found(HistogramReceiver { pick, ..base.clone() }), [at]);
    }
    assert_eq!(found(HistogramReceiver { returns: 8, ..base.clone() }), [50.0, 90.0, 200.0]);
    let faint = HistogramReceiver {
        method: HistogramMethod { least_share: 0.2, ..base.method.clone() },
        returns: 8,
        ..base
    };
    assert_eq!(found(faint), [90.0, 200.0]);
    let gate_fs = (100 * BIN_FS, 195 * BIN_FS);
    assert_eq!(found(HistogramReceiver { gate_fs, ..base }), [0.0; 0]);
}

#[test]
fn what_cannot_be_decoded_is_refused() {
    let base = HistogramReceiver::new(gaussian(2.0));
    let record = histograms(10, &[vec![4, 3, 3], vec![0, 0, 11]]);
    let log = ShotLog::of_one_channel(&[0, 0], &[0, 0]);
    let refused = |receiver: &HistogramReceiver, record: &Histograms| {
        decode(receiver, &log, record).unwrap_err()
    };
    let coates = HistogramReceiver {
        method: HistogramMethod { pile_up: PileUp::Coates, ..base.method.clone() },
        ..base
    };
    assert_eq!(
        refused(&coates, &record),
        Error::MoreThanCycles { shot: 1, counted: 11, cycles: 10 }
    );
    assert!(decode(&base, &log, &record).is_ok());
    let short = Histograms { counts: vec![0; 5], ..record.clone() };
    assert!(refused(&base, &short).to_string().contains("`counts` has 5 entries for 6"));
    for (receiver, setting) in [
        (HistogramReceiver { returns: 9, ..base.clone() }, "returns"),
        (HistogramReceiver { gate_fs: (2, 1), ..base.clone() }, "gate_fs"),
        (
            HistogramReceiver {
                method: HistogramMethod { false_alarm: f64::NAN, ..base.method.clone() },
                ..base
            },
            "false_alarm",
        ),
        (
            HistogramReceiver {
                method: HistogramMethod { shape_error: -0.1, ..base.method.clone() },
                ..base
            },
            "shape_error",
        ),
        (
            HistogramReceiver {
                method: HistogramMethod { least_share: 2.0, ..base.method.clone() },
                ..base
            },
            "least_share",
        ),
        (HistogramReceiver::new(Pulse::Gaussian { rms_fs: 0.0 }), "pulse.rms_fs"),
        (HistogramReceiver::new(Pulse::Gaussian { rms_fs: 1e12 }), "pulse.rms_fs"),
        (HistogramReceiver::new(Pulse::Measured { counts: vec![], origin: 0.0 }), "pulse.counts"),
        (
            HistogramReceiver::new(Pulse::Measured { counts: vec![-1.0], origin: 0.0 }),
            "pulse.counts",
        ),
        (
            HistogramReceiver::new(Pulse::Measured { counts: vec![1.0], origin: f64::NAN }),
            "pulse.origin",
        ),
    ] {
        let said = refused(&receiver, &record).to_string();
        assert!(said.starts_with(&format!("`{setting}` of the receiver is ")), "{said}");
    }
}

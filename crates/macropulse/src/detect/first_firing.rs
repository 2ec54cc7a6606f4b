//! A detector that fires once per shot: the simulation steps of \[KP16 Fig. 7\], after \[OF05\].
//!
//! 1. Each echo of mean energy n (photons) gets white noise: n' = n + a·g, g standard normal.
//! 2. Its light is spread over a Gaussian pulse of rms length σ, so that Λ(t) = n'·Φ((t − t₀)/σ)
//!    photons are expected up to t. With m photons needed, the detector has fired by t with
//!    probability F(t) = P(Γ_m ≤ Λ(t)), Γ_m the sum of m unit exponentials. For m = 1 this is the
//!    1 − exp(−Λ(t)) of a Geiger detector.
//! 3. Monte Carlo: draw Γ_m; no firing if Γ_m > n', else t = t₀ + σ·Φ⁻¹(Γ_m / n').
//! 4. False firings are Poisson in time. The earliest firing in the range gate wins, whether its
//!    light is ours or of another lidar.
//! 5. A Gaussian sample of the temporal response is added. The converter quantises.
//!
//! \[KP16\] mixes two kinds of detector here: additive Gaussian noise belongs to a linear-mode
//! receiver, the cumulative firing probability to a Geiger-mode one. With m ≫ 1 the threshold of
//! a linear receiver is meant, with m = 1 the Geiger detector. The firing time runs ahead of the
//! echo the more the stronger it is; as real sensors do, the mean of that walk is calibrated out
//! with the amplitude measured.

use macropulse_codec::statistics::normal_quantile;
use rand_distr::{Distribution, Exp1, Gamma, StandardNormal};

use super::others::{Flash, flashes};
use super::{Band, Edges};
use crate::design::FirstFiring;
use crate::random::{Chance, Stage, Stream};
use crate::units::{FS_PER_S, RMS_OF_FWHM, fs_from_s, tof_from_range};

/// The walk is calibrated up to this fraction of the pulse: an echo that only just fires does so
/// on the falling flank.
const LATEST: f64 = 0.99;

/// A detector that never misses is given this much light.
pub(super) const PLENTY: f64 = 1e9;

pub(super) fn edges(firing: &FirstFiring, band: &Band, chance: &Chance) -> Edges {
    let &Band { clock, design, log, echoes } = band;
    let gate = (
        fs_from_s(tof_from_range(design.scan.min_range)),
        fs_from_s(tof_from_range(design.scan.max_range)),
    );
    let rms_fs = design.light.pulse * RMS_OF_FWHM * FS_PER_S as f64;
    let needed = f64::from(firing.firing_photons);
    let Ok(gamma) = Gamma::new(needed, 1.0) else { return Edges::default() };
    let fire = |delay_fs: i64, photons: f64, stream: &mut Stream| {
        let noise: f64 = StandardNormal.sample(stream);
        let photons = (photons.min(PLENTY) + firing.noise_photons * noise).max(0.0);
        let draw: f64 = gamma.sample(stream);
        (draw < photons).then(|| {
            let early =
                normal_quantile(draw / photons) - normal_quantile((needed / photons).min(LATEST));
            (delay_fs as f64 + rms_fs * early, photons)
        })
    };
    let earlier = |one: Option<(f64, f64)>, other: Option<(f64, f64)>| match (one, other) {
        (Some(one), Some(other)) => Some(if other.0 < one.0 { other } else { one }),
        (one, other) => one.or(other),
    };
    let mut found: Vec<(u16, u32, f32)> = Vec::with_capacity(log.len());
    let mut flashes = flashes(band).into_iter().peekable();
    let mut i = 0;
    for shot in 0..log.len() {
        let mut stream = chance.at(Stage::Firing, log.first + shot as u64);
        let mut earliest: Option<(f64, f64)> = None;
        if firing.false_rate > 0.0 {
            let wait: f64 = Exp1.sample(&mut stream);
            let delay = gate.0 as f64 + wait / firing.false_rate * FS_PER_S as f64;
            earliest = Some((delay, needed));
        }
        while i < echoes.shot.len() && echoes.shot[i] as usize == shot {
            earliest = earlier(earliest, fire(echoes.delay_fs[i], echoes.photons[i], &mut stream));
            i += 1;
        }
        let mut others = None;
        while let Some(Flash { delay_fs, photons, .. }) = flashes.next_if(|f| f.shot == shot) {
            let stream = others
                .get_or_insert_with(|| chance.at(Stage::OtherFiring, log.first + shot as u64));
            earliest = earlier(earliest, fire(delay_fs, photons, stream));
        }
        if let Some((delay, photons)) = earliest {
            let response: f64 = StandardNormal.sample(&mut stream);
            let delay = (delay + response * firing.jitter * FS_PER_S as f64).round() as i64;
            if (gate.0..=gate.1).contains(&delay) {
                let time = clock.time(log.fired_at_fs[shot] + delay) as u32;
                found.push((log.channel[shot], time, photons as f32));
            }
        }
    }
    found.sort_by_key(|&(channel, time, _)| (channel, time));
    Edges {
        epoch: clock.epoch,
        time: found.iter().map(|f| f.1).collect(),
        channel: found.iter().map(|f| f.0).collect(),
        amplitude: found.iter().map(|f| f.2).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::channel::Echoes;
    use crate::design::Design;
    use macropulse_codec::ShotLog;

    /// The edges of shots that all have an echo of so many photons, in the first nine bands or
    /// what the sensor has of them.
    fn run(design: &Design, photons: f64, seed: u64) -> Vec<(ShotLog, Edges)> {
        let detectors = super::super::Detectors::in_the_dark(design, Chance::new(seed));
        let bands = crate::emit::bands(design, 0).take(9);
        bands
            .map(|band| {
                let log = band.shot_log(design);
                let shots = log.len();
                let echoes = Echoes {
                    shot: (0..shots as u32).collect(),
                    delay_fs: vec![400_000_000; shots],
                    photons: vec![photons; shots],
                    ..Echoes::default()
                };
                let edges = detectors.edges(&log, &echoes, &mut super::super::Memory::default());
                (log, edges)
            })
            .collect()
    }

    fn set(name: &str, keys: &[(&str, &str)]) -> Design {
        let keys: Vec<(String, String)> = keys
            .iter()
            .map(|(key, value)| (format!("detector.first-firing.{key}"), (*value).to_owned()))
            .collect();
        Design::open(name, &keys).unwrap()
    }

    /// H0: the reference target is detected with the Pd declared. N = 4096 + 8640 shots, seed 5,
    /// α = 1e-5 (|z| < 4.4); the Gaussian approximation of Γ_m is granted 0.004.
    #[test]
    fn the_reference_target_is_seen_with_its_pd() {
        for (name, keys) in [
            ("hdl-64e", &[("sensitivity.pd", "0.9"), ("false_firing_hz", "0")][..]),
            ("peregrine", &[("sensitivity.pd", "0.9"), ("false_firing_hz", "0")][..]),
        ] {
            let design = set(name, keys);
            let z = |scale: f64| {
                let photons = design.derived().reference_photons * scale;
                let bands = run(&design, photons, 5);
                let n = bands.iter().map(|(log, _)| log.len()).sum::<usize>() as f64;
                let seen = bands.iter().map(|(_, edges)| edges.time.len()).sum::<usize>() as f64;
                let off = (seen / n - 0.9).abs() - 0.004;
                off / (0.09 / n).sqrt()
            };
            assert!(z(1.0) < 4.4, "{name}: {}", z(1.0));
            assert!(z(1.06) > 4.4, "{name}: the control was not rejected");
        }
    }

    #[test]
    fn the_velodyne_is_good_to_two_centimetres_on_a_strong_echo() {
        let design = set("hdl-64e", &[("false_firing_hz", "0")]);
        let bands = run(&design, 3000.0, 9);
        let errors: Vec<f64> = bands
            .iter()
            .flat_map(|(log, edges)| -> Vec<i64> {
                let fs =
                    |time: &u32| (64 * edges.epoch + i64::from(*time)) * design.tdc.tick_fs / 64;
                let times = edges.time.iter().map(fs).zip(&edges.channel);
                times
                    .filter_map(|(time, channel)| {
                        let shots = (0..log.len()).filter(|&s| log.channel[s] == *channel);
                        shots
                            .map(|s| time - log.fired_at_fs[s] - 400_000_000)
                            .min_by_key(|e| e.abs())
                    })
                    .collect()
            })
            .map(|fs| crate::units::range_from_tof(fs as f64 * 1e-15))
            .collect();
        let n = errors.len() as f64;
        let mean = errors.iter().sum::<f64>() / n;
        let sigma = (errors.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / n).sqrt();
        assert!(mean.abs() < 0.005, "bias {mean}");
        assert!(sigma < 0.02 && sigma > 0.001, "σ {sigma}");
    }

    #[test]
    fn nothing_comes_from_nothing() {
        let design = set("peregrine", &[("false_firing_hz", "0")]);
        assert!(run(&design, 0.0, 1).iter().all(|(_, edges)| edges.time.is_empty()));
    }
}

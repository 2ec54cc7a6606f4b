//! The matched filter, where nothing can be told, and how strong the noise is.

use std::ops::Range;

use super::pulse::Pulse;
use super::{Band, Sampling};
use crate::kernels::filter;

/// Filtered samples that the noise is estimated from, at most.
const PICKED: usize = 1 << 16;

/// From so many standard deviations above the level on, what stands there is light.
const LIGHT: f32 = 4.0;

/// The samples of a channel, filtered: the signal in detected photons per mark.
pub(super) struct Filtered {
    /// The signal at each tick, 0 being its level without light.
    pub signal: Vec<f32>,
    /// Standard deviation of what was taken away from it there; 0 where nothing was, infinite where the
    /// signal tells nothing.
    pub doubt: Vec<f32>,
    /// Standard deviation of the noise.
    pub sigma: f32,
}

impl Filtered {
    /// Filters `codes`, the samples of the `band`.
    ///
    /// Samples are blind from where a mark of the channel's own begins to rise until it is over, and
    /// behind clipped ones; they are taken for dark ones. A tick tells nothing if the middle of the pulse
    /// that would come there is blind.
    pub(super) fn of(codes: &[i16], pulse: &Pulse, band: &Band, sampling: &Sampling) -> Self {
        let reach = pulse.reach;
        let mut samples = vec![0.0; codes.len() + 2 * reach];
        for (sample, code) in samples[reach..].iter_mut().zip(codes) {
            *sample = f32::from(*code);
        }
        let mut doubt = vec![0.0; codes.len()];
        let core = pulse.core() as i64;
        let within = |at: i64| at.clamp(0, codes.len() as i64) as usize;
        let mut blind = |doubt: &mut [f32], blind: Range<i64>| {
            samples[reach + within(blind.start)..reach + within(blind.end)].fill(0.0);
            doubt[within(blind.start - core)..within(blind.end + core)].fill(f32::INFINITY);
        };
        if sampling.blank_ticks > 0 {
            for shot in 0..band.fired.len() {
                for mark in band.marks(shot) {
                    let fired = band.fired[shot] + mark;
                    blind(&mut doubt, fired - core..fired + i64::from(sampling.blank_ticks));
                }
            }
        }
        if sampling.recovery_ticks > 0 {
            // What stray light clips is over when the channel is blind no more.
            let is_light = |clipped: &Range<usize>| doubt[clipped.end - 1] == 0.0;
            let clipped: Vec<Range<usize>> =
                runs(codes, sampling.full_scale).filter(is_light).collect();
            for clipped in clipped {
                // The sample behind still tells when the pulse fell.
                let end = clipped.end as i64;
                blind(&mut doubt, end + 1 + core..end + i64::from(sampling.recovery_ticks));
            }
        }
        let mut signal = vec![0.0; codes.len()];
        filter(&samples, &pulse.taps, &mut signal);
        let rounding = pulse.taps.iter().map(|tap| tap * tap).sum::<f32>() / 12.0;
        let (level, sigma) = noise(&signal, &doubt, reach);
        signal.iter_mut().for_each(|signal| *signal -= level);
        Self { signal, doubt, sigma: sigma.max(rounding.sqrt()) }
    }
}

/// Runs of clipped samples, ascending.
fn runs(codes: &[i16], full_scale: i16) -> impl Iterator<Item = Range<usize>> {
    let mut at = 0;
    std::iter::from_fn(move || {
        let start = at + codes[at..].iter().position(|code| *code >= full_scale)?;
        let length = codes[start..].iter().position(|code| *code < full_scale);
        at = length.map_or(codes.len(), |length| start + length);
        Some(start..at)
    })
}

/// Level and standard deviation of the noise of a filtered `signal`: its median, and how far the
/// 15.87 % quantile is below it. Echoes can only add, and so would draw the median up, by 1.25 σ times the
/// share of time that they take, and the deviation by half of that: what stands out at a first look is
/// left out of a second one, together with the ticks `beside` it.
///
/// From N independent values the level is right to 1.25 σ/√N, and the deviation to 1.49 σ/√N: to 0.5 and
/// 0.6 % of σ from as many as are picked.
fn noise(signal: &[f32], doubt: &[f32], beside: usize) -> (f32, f32) {
    let step = signal.len().div_ceil(PICKED).max(1);
    let open = (0..signal.len()).step_by(step).filter(|at| doubt[*at] == 0.0);
    let places: Vec<usize> = open.collect();
    let estimate = |places: &[usize]| {
        let mut values: Vec<f32> = places.iter().map(|at| signal[*at]).collect();
        if values.is_empty() {
            return (0.0, 0.0);
        }
        let middle = values.len() / 2;
        let (below, median, _) = values.select_nth_unstable_by(middle, f32::total_cmp);
        let median = *median;
        if below.is_empty() {
            return (median, 0.0);
        }
        let place = (ONE_BELOW * places.len() as f64) as usize;
        let (_, low, _) = below.select_nth_unstable_by(place.min(middle - 1), f32::total_cmp);
        (median, median - *low)
    };
    let (level, sigma) = estimate(&places);
    let is_dark = |at: &usize| {
        let about = &signal[at.saturating_sub(beside)..(at + beside + 1).min(signal.len())];
        about.iter().all(|value| *value <= level + LIGHT * sigma)
    };
    let dark: Vec<usize> = places.iter().copied().filter(is_dark).collect();
    // Where there is hardly a dark tick, the first look has to do.
    if dark.len() * 4 < places.len() { (level, sigma) } else { estimate(&dark) }
}

/// The share of a normal variable that is more than a standard deviation below its mean.
const ONE_BELOW: f64 = 0.158_655_253_931_457_05;

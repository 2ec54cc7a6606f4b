//! The matched filter, where nothing can be told, and how strong the noise is.

use std::ops::Range;

use super::Band;
use super::pulse::Pulse;
use crate::kernels::filter;

/// Filtered samples that the noise is estimated from, at most.
const PICKED: usize = 1 << 17;

/// Standard deviations above the level from which on the signal is light.
pub(super) const LIGHT: f32 = 4.0;

/// The samples of a channel, filtered: the signal in detected photons per mark.
pub(super) struct Filtered {
    /// The signal at each tick, 0 being its level without light.
    pub signal: Vec<f32>,
    /// Standard deviation of what was taken away from it there; 0 where nothing was, infinite where the
    /// signal tells nothing.
    pub doubt: Vec<f32>,
    /// Samples that were taken for dark ones, ascending.
    pub dark: Vec<Range<usize>>,
    /// Standard deviation of the noise.
    pub sigma: f32,
}

impl Filtered {
    /// Filters `codes`, the samples of the `band`, with the `rest` that they leave out, if any.
    ///
    /// Samples are blind from where a mark of the channel's own rises until it is over, and behind clipped
    /// ones; they are taken for dark ones. A tick tells nothing if the middle of the pulse
    /// that would come there is blind.
    pub(super) fn of((codes, rest): (&[i16], &[f32]), pulse: &Pulse, band: &Band) -> Self {
        let mut doubt = vec![0.0; codes.len()];
        let core = pulse.core() as i64;
        let sampling = &band.settings.sampling;
        let leaves = own_marks(codes, (pulse, core), band, sampling.blank_ticks);
        let within = |range: &Range<i64>, more: i64| {
            let within = |at: i64| at.clamp(0, codes.len() as i64) as usize;
            within(range.start - more)..within(range.end + more)
        };
        // Clipping by stray light is over when the channel is blind no more.
        let is_stray = |clipped: &Range<i64>| {
            let after = leaves.partition_point(|blind| blind.start < clipped.end);
            after > 0 && leaves[after - 1].end >= clipped.end
        };
        let light = runs(codes, sampling.full_scale).filter(|clipped| !is_stray(clipped));
        // The sample behind still tells when the pulse fell.
        let recovery = i64::from(sampling.recovery_ticks);
        let recovers = merged(light.map(|clipped| clipped.end + 1 + core..clipped.end + recovery));
        let mut blind = [leaves, recovers].concat();
        blind.sort_unstable_by_key(|blind| blind.start);
        let blind = merged(blind.into_iter());
        blind.iter().for_each(|blind| doubt[within(blind, core)].fill(f32::INFINITY));
        let dark: Vec<Range<usize>> = blind.iter().map(|blind| within(blind, 0)).collect();
        let mut signal = vec![0.0; codes.len()];
        filter((codes, rest), &pulse.taps, &dark, &mut signal);
        let rounding = pulse.taps.iter().map(|tap| tap * tap).sum::<f32>() / 12.0;
        let (level, sigma) = noise(&signal, &doubt, pulse.reach);
        signal.iter_mut().for_each(|signal| *signal -= level);
        Self { signal, doubt, dark, sigma: sigma.max(rounding.sqrt()) }
    }

    /// True if the sample at this place was taken for a dark one.
    pub(super) fn is_dark(&self, place: usize) -> bool {
        let after = self.dark.partition_point(|dark| dark.start <= place);
        after > 0 && place < self.dark[after - 1].end
    }
}

/// When the channel is blind with its own marks: from `core` ticks before they leave, or earlier where
/// their light already shows, for `blank` ticks; ascending.
pub(super) fn own_marks(
    codes: &[i16],
    (pulse, core): (&Pulse, i64),
    band: &Band,
    blank: u32,
) -> Vec<Range<i64>> {
    if blank == 0 {
        return Vec::new();
    }
    let bound = above_noise(codes);
    let is_lit = |at: i64| {
        let code = usize::try_from(at).ok().and_then(|at| codes.get(at));
        code.is_some_and(|code| f32::from(*code) > bound)
    };
    let rises = |mark: i64| {
        let middle = mark - core;
        let earliest = middle - pulse.reach as i64;
        match (earliest..middle).rev().take_while(|at| is_lit(*at)).last() {
            // The light left before the sample ahead of the first that stands out is less than noise.
            Some(first) => first - 1,
            None => middle,
        }
    };
    let all = 0..band.fired.len();
    let leave = |shot| band.marks(shot).map(move |mark| band.fired[shot] + mark);
    let mut marks: Vec<i64> = all.flat_map(leave).collect();
    marks.sort_unstable();
    let mut blind: Vec<Range<i64>> =
        marks.iter().map(|mark| rises(*mark)..mark + i64::from(blank)).collect();
    blind.sort_unstable_by_key(|blind| blind.start);
    merged(blind.into_iter())
}

/// A code that noise hardly exceeds.
fn above_noise(codes: &[i16]) -> f32 {
    let (level, sigma) = usual(codes);
    level + LIGHT * sigma.max(1.0)
}

/// The median of `codes`, and how far the 15.87 % quantile is below it; 0 of none.
pub(super) fn usual(codes: &[i16]) -> (f32, f32) {
    let step = codes.len().div_ceil(PICKED).max(1);
    quantiles(&mut codes.iter().step_by(step).map(|code| f32::from(*code)).collect::<Vec<f32>>())
}

/// The `ranges`, which begin one after the other, those that overlap as one, and no empty ones.
pub(super) fn merged(ranges: impl Iterator<Item = Range<i64>>) -> Vec<Range<i64>> {
    let mut merged: Vec<Range<i64>> = Vec::new();
    for range in ranges.filter(|range| !range.is_empty()) {
        match merged.last_mut() {
            Some(last) if range.start <= last.end => last.end = last.end.max(range.end),
            _ => merged.push(range),
        }
    }
    merged
}

/// Runs of clipped samples, ascending.
fn runs(codes: &[i16], full_scale: i16) -> impl Iterator<Item = Range<i64>> {
    let mut at = 0;
    std::iter::from_fn(move || {
        let start = at + codes[at..].iter().position(|code| *code >= full_scale)?;
        let length = codes[start..].iter().position(|code| *code < full_scale);
        at = length.map_or(codes.len(), |length| start + length);
        Some(start as i64..at as i64)
    })
}

/// Returns the level and the standard deviation of the noise of a filtered `signal`: its median, and how far
/// the 15.87 % quantile is below it. Echoes can only add. They would draw the median up by 1.25 σ times the
/// share of time that they take, and the deviation by half of that. So light that stands out at a first look
/// is left out of a second one, together with the ticks `beside` it.
///
/// From N independent values the level is right to 1.25 σ/√N, and the deviation to 1.49 σ/√N. With the number
/// that is picked, these are 0.35 and 0.41 % of σ. At a threshold of 5 σ false returns then are rarer or more
/// frequent than accepted by 11 %.
fn noise(signal: &[f32], doubt: &[f32], beside: usize) -> (f32, f32) {
    let step = signal.len().div_ceil(PICKED).max(1);
    let open = (0..signal.len()).step_by(step).filter(|at| doubt[*at] == 0.0);
    let places: Vec<usize> = open.collect();
    let estimate = |places: &[usize]| {
        quantiles(&mut places.iter().map(|at| signal[*at]).collect::<Vec<f32>>())
    };
    let (level, sigma) = estimate(&places);
    let is_dark = |at: &usize| {
        let about = &signal[at.saturating_sub(beside)..(at + beside + 1).min(signal.len())];
        about.iter().all(|value| *value <= level + LIGHT * sigma)
    };
    let dark: Vec<usize> = places.iter().copied().filter(is_dark).collect();
    // If there is hardly a dark tick, the first look has to do.
    if dark.len() * 4 < places.len() { (level, sigma) } else { estimate(&dark) }
}

/// The median of `values`, and how far the 15.87 % quantile is below it; 0 of none.
fn quantiles(values: &mut [f32]) -> (f32, f32) {
    if values.is_empty() {
        return (0.0, 0.0);
    }
    let (middle, place) = (values.len() / 2, (ONE_BELOW * values.len() as f64) as usize);
    let (below, median, _) = values.select_nth_unstable_by(middle, f32::total_cmp);
    let median = *median;
    if below.is_empty() {
        return (median, 0.0);
    }
    let (_, low, _) = below.select_nth_unstable_by(place.min(middle - 1), f32::total_cmp);
    (median, median - *low)
}

/// The share of a normal variable that is more than a standard deviation below its mean.
const ONE_BELOW: f64 = 0.158_655_253_931_457_05;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::decode::{Sampled, Sampling};
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    /// Returns noise of level 3 and deviation 36; `lit` of 100 stretches of ten ticks have light on them.
    fn noisy(lit: usize) -> Vec<f32> {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let mut noise = || -> f32 { StandardNormal.sample(&mut rng) };
        let light = |at: usize| if at % 1000 < 10 * lit { 900.0 } else { 0.0 };
        (0..200_000).map(|at| 3.0 + 36.0 * noise() + light(at)).collect()
    }

    /// From N = 100 000 ticks, every other: 1.25/√N and 1.49/√N of σ, four times each. If a tenth is lit, the
    /// ticks beside the light are left out, too.
    #[test]
    fn light_does_not_raise_the_noise() {
        for lit in [0, 2, 10] {
            let signal = noisy(lit);
            let (level, sigma) = noise(&signal, &vec![0.0; signal.len()], 3);
            assert!((level - 3.0).abs() < 36.0 * 0.016, "{lit} %: level {level}");
            assert!((sigma / 36.0 - 1.0).abs() < 0.02, "{lit} %: deviation {sigma}");
        }
        // Negative control: without the second look, level and deviation of the last are too high.
        let mut all = noisy(10);
        all.sort_by(f32::total_cmp);
        let (median, low) = (all[100_000], all[31_731]);
        assert!(median > 3.0 + 36.0 * 0.1 && median - low > 36.0 * 1.05);
    }

    #[test]
    fn of_no_samples_or_equal_ones_there_is_no_noise() {
        assert_eq!(noise(&[], &[], 3), (0.0, 0.0));
        assert_eq!(noise(&[4.0], &[0.0], 3), (4.0, 0.0));
        assert_eq!(noise(&[4.0; 9], &[f32::INFINITY; 9], 3), (0.0, 0.0));
        assert_eq!(noise(&[4.0; 9], &[0.0; 9], 3), (4.0, 0.0));
    }

    #[test]
    fn clipped_samples_are_told_as_runs() {
        let told: Vec<Range<i64>> = runs(&[9, 0, 9, 10, 0, 0, 9], 9).collect();
        assert_eq!(told, [0..1, 2..4, 6..7]);
        assert_eq!(runs(&[1, 2], 3).count(), 0);
    }

    /// One mark at tick 50, whose light shows from tick 47 on, and one at tick 80, before which it is dark.
    #[test]
    fn the_channel_is_blind_from_where_its_own_light_shows() {
        let mut codes: Vec<i16> = (0..100).map(|at| at * 3 % 5 - 2).collect();
        (codes[47], codes[48], codes[49]) = (40, 900, 2000);
        let sampling = Sampling {
            pulse: (-160..=160)
                .map(|step| libm::expf(-(step as f32 / 16.0) * (step as f32 / 16.0) / 2.0))
                .collect(),
            excess: 1.0,
            full_scale: 2000,
            blank_ticks: 15,
            held_ticks: 0,
            recovery_ticks: 0,
            least_marks: 1,
            coupling: None,
        };
        let pulse = Pulse::new(&sampling);
        let settings =
            Sampled { ticks_per_chip: 1, light_ticks: 100_000, false_alarm: 1e-6, sampling };
        let log = crate::ShotLog::of_one_channel(&[50, 80], &[0, 0]);
        let receiver = crate::decode::Receiver::matched(1);
        let codebook = crate::code::Codebook::single();
        let band = Band::new(&receiver, &settings, (&codebook, &log), 0);
        assert_eq!(own_marks(&codes, (&pulse, 1), &band, 15), [46..65, 79..95]);
        assert!(own_marks(&codes, (&pulse, 1), &band, 0).is_empty());
        // A tick tells nothing if the sample beside it is blind.
        let filtered = Filtered::of((&codes, &[]), &pulse, &band);
        let open: Vec<usize> = (0..100).filter(|at| filtered.doubt[*at] == 0.0).collect();
        let expected: Vec<usize> = (0..45).chain(66..78).chain(96..100).collect();
        assert_eq!(open, expected);
    }

    #[test]
    fn ranges_that_touch_become_one() {
        let ranges = [0..2, 1..3, 3..4, 9..9, 6..8, 6..7];
        assert_eq!(merged(ranges.into_iter()), [0..4, 6..8]);
    }
}

//! The baseline of an amplifier that is coupled by a capacitor, and how the receiver restores it.
//!
//! The baseline b follows the signal x from tick to tick by bₙ₊₁ = bₙ + f·(xₙ − bₙ), f = 1 − exp(−ω·T), and
//! the samples are y = x − b. The receiver knows ω. It takes the sum of the samples and its own baseline for
//! the signal. That baseline follows the signal wherever there is light, which noise does not reach. If
//! samples are clipped, the amplifier is at its limit, and the baseline follows that. Noise is left out: its
//! baseline is small, and adding it up again would have no end.

use super::Sampling;
use super::filter::usual;

/// How an amplifier is coupled to its converter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coupling {
    /// Angular frequency below which nothing passes, per tick.
    pub low_cutoff: f64,
    /// Output of the amplifier at its limit, in codes: the highest code, or more.
    pub limit: f64,
}

/// Standard deviations from which on a sample is light.
const LIGHT: f64 = 4.0;

/// Samples that tell the baseline at the beginning. Most of them are dark, and the median of this number is
/// right to a fiftieth of the noise.
const FIRST: usize = 4096;

/// Samples with their baseline at 0.
#[derive(Debug, Default)]
pub(super) struct Restored {
    /// Whole codes; those that were clipped have the highest one, and no others.
    pub codes: Vec<i16>,
    /// The excess of each sample over its whole code.
    pub rest: Vec<f32>,
}

impl Restored {
    /// Restores `codes` as they came; `None` if no coupling took anything from them.
    pub(super) fn of(codes: &[i16], sampling: &Sampling) -> Option<Self> {
        let coupling = sampling.coupling?;
        let (highest, full_scale) = (f64::from(sampling.full_scale), sampling.full_scale);
        let follows = -libm::expm1(-coupling.low_cutoff);
        let (_, sigma) = usual(codes);
        let is_light = LIGHT * f64::from(sigma).max(1.0);
        let (begins, _) = usual(&codes[..codes.len().min(FIRST)]);
        let mut baseline = -f64::from(begins);
        let mut restored = Self::default();
        restored.codes.reserve(codes.len());
        restored.rest.reserve(codes.len());
        for code in codes {
            let is_clipped = *code >= full_scale;
            let light = match is_clipped {
                true => coupling.limit,
                false => f64::from(*code) + baseline,
            };
            let whole = match is_clipped {
                true => highest,
                false => libm::rint(light).clamp(f64::from(i16::MIN), highest - 1.0),
            };
            restored.codes.push(whole as i16);
            restored.rest.push(if is_clipped { 0.0 } else { (light - whole) as f32 });
            let counts = if light > is_light { light } else { 0.0 };
            baseline += follows * (counts - baseline);
        }
        Some(restored)
    }

    /// Returns the samples to decode: whole codes with their baseline at 0, and the excess of each over its
    /// code. If nothing was `restored`, these are the `codes` as they came, without an excess.
    pub(super) fn parts<'a>(
        restored: &'a Option<Self>,
        codes: &'a [i16],
    ) -> (&'a [i16], &'a [f32]) {
        restored.as_ref().map_or((codes, &[]), |restored| (&restored.codes, &restored.rest))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sampling(coupling: Coupling) -> Sampling {
        Sampling {
            pulse: vec![1.0],
            excess: 1.0,
            full_scale: 1000,
            blank_ticks: 0,
            held_ticks: 0,
            recovery_ticks: 0,
            least_marks: 1,
            coupling: Some(coupling),
        }
    }

    /// Pulses of five ticks every 300, clipped and faint ones in turn, and the codes that a converter makes
    /// of them. They are behind a coupling that forgets by e in 200 ticks.
    fn coupled(coupling: &Coupling) -> (Vec<f64>, Vec<i16>) {
        let follows = -libm::expm1(-coupling.low_cutoff);
        let light = |at: usize| match (at % 300, at / 300 % 2) {
            (100..105, 0) => coupling.limit,
            (100..105, _) => 60.0,
            _ => 0.0,
        };
        let signal: Vec<f64> = (0..30_000).map(light).collect();
        let mut baseline = 0.0;
        let codes = signal.iter().map(|light| {
            let code = libm::rint(light - baseline).min(1000.0) as i16;
            baseline += follows * (light - baseline);
            code
        });
        let codes = codes.collect();
        (signal, codes)
    }

    /// The signal is restored to a code, once the estimate of the first baseline is forgotten. Control: some
    /// samples are more than twenty codes below.
    #[test]
    fn what_the_coupling_takes_is_added_again() {
        let coupling = Coupling { low_cutoff: 1.0 / 200.0, limit: 1100.0 };
        let (signal, codes) = coupled(&coupling);
        let restored = Restored::of(&codes, &sampling(coupling)).unwrap();
        assert!(codes.iter().any(|code| *code < -20));
        for (at, light) in signal.iter().enumerate().skip(2000) {
            let found = f64::from(restored.codes[at]) + f64::from(restored.rest[at]);
            assert!((found - light.min(1000.0)).abs() < 1.0, "{at}: {found}, not {light}");
            assert_eq!(restored.codes[at] == 1000, *light > 1000.0);
        }
    }

    #[test]
    fn of_no_samples_or_wild_ones_there_is_no_panic() {
        let coupling = Coupling { low_cutoff: 1.0, limit: 1e9 };
        let restored =
            |codes: &[i16]| Restored::of(codes, &sampling(coupling)).unwrap().codes.len();
        assert_eq!(restored(&[]), 0);
        let wild = [i16::MIN, i16::MAX, 0, 999, i16::MIN];
        assert_eq!(restored(&wild), 5);
        assert!(Restored::of(&wild, &Sampling { coupling: None, ..sampling(coupling) }).is_none());
    }
}

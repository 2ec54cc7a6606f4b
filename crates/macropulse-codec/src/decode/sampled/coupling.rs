//! What an amplifier that is coupled by a capacitor does to its baseline, and how the receiver undoes it.
//!
//! The baseline b follows the signal x from tick to tick by bₙ₊₁ = bₙ + f·(xₙ − bₙ), f = 1 − exp(−ω·T), and
//! the samples are y = x − b. The receiver knows ω: it takes what the samples and its own baseline add up to
//! for the signal, and lets that baseline follow it wherever there is light, which noise does not reach, and
//! where the amplifier is at its limit, at which the samples are clipped. Noise is left out: its baseline is
//! small, and adding it up again would have no end.

use super::Sampling;
use super::filter::usual;

/// How an amplifier is coupled to its converter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coupling {
    /// Angular frequency below which nothing passes, per tick.
    pub low_cutoff: f64,
    /// What the amplifier puts out while it is at its limit, in codes: the highest one, or more.
    pub limit: f64,
}

/// From so many standard deviations on a sample is light.
const LIGHT: f64 = 4.0;

/// What the baseline is at the beginning is told by so many samples: most of them are dark, and of as many
/// as these the median is right to a fiftieth of the noise.
const FIRST: usize = 4096;

/// Samples with their baseline at 0.
#[derive(Debug, Default)]
pub(super) struct Restored {
    /// Whole codes; those that were clipped have the highest one, and no others.
    pub codes: Vec<i16>,
    /// What each is more than that.
    pub rest: Vec<f32>,
}

impl Restored {
    /// Of `codes` as they came; `None` where nothing was taken from them.
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

    /// What is decoded, of `codes` as they came: those with their baseline at 0, and what each is more than
    /// that, nothing where nothing was `restored`.
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

    /// Pulses of five ticks every 300, clipped and faint ones in turn, behind a coupling that forgets by e in
    /// 200 ticks, with the codes that a converter makes of them.
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

    /// What was there is there again, to a code, when what was taken for the beginning is forgotten. Control:
    /// without it the samples are up to twenty codes below.
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

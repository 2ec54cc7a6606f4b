//! The taps of one modulation frequency become a phasor.

use std::f64::consts::{PI, TAU};

use super::PhaseMethod;

/// A modulation frequency, and the taps by which it is measured.
///
/// Light that comes back with the phase φ and brings the mean charge Q to a tap gives tap k of K the charge
///
/// Q·(1 + Σₙ cₙ·cos(n·(φ − 2πk/K)))
///
/// where c₁ is the contrast and the other cₙ are those of the harmonics.
#[derive(Debug, Clone, PartialEq)]
pub struct Tone {
    /// Frequency, Hz.
    pub hz: f64,
    /// Taps K, at equal distances of a period, 3 to [`Tone::MOST_PHASES`].
    pub phases: u32,
    /// Contrasts c₁, c₂ … as the receiver knows them, 1 to [`Tone::MOST_HARMONICS`] of them.
    pub contrasts: Vec<f64>,
}

impl Tone {
    /// Taps of a modulation frequency at most.
    pub const MOST_PHASES: u32 = 64;

    /// Contrasts that are listed at most.
    pub const MOST_HARMONICS: usize = 64;

    /// A tone of this frequency without harmonics.
    pub fn pure(hz: f64, phases: u32, contrast: f64) -> Self {
        Self { hz, phases, contrasts: vec![contrast] }
    }

    /// Harmonics of the correlation of a square wave with a square one, a triangle: the odd ones have the contrast
    /// 8/(πn)² of it.
    pub fn squares(harmonics: usize) -> Vec<f64> {
        let contrast = |n: usize| match n % 2 {
            0 => 0.0,
            _ => 8.0 / (PI * n as f64).powi(2),
        };
        (1..=harmonics).map(contrast).collect()
    }

    /// The mean charge of each tap over Q for light of the phase `phase`.
    pub fn shares(&self, phase: f64) -> impl Iterator<Item = f64> + '_ {
        (0..self.phases).map(move |tap| {
            let behind = phase - TAU * f64::from(tap) / f64::from(self.phases);
            let harmonics = (1..).zip(&self.contrasts);
            1.0 + harmonics.map(|(n, c)| c * libm::cos(f64::from(n) * behind)).sum::<f64>()
        })
    }
}

/// The phasor of one modulation frequency: phase and amplitude of its light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Phasor<'a> {
    pub tone: &'a Tone,
    /// Phase of the light, rad, −π to π.
    pub phase: f64,
    /// Variance of the phase, rad².
    pub variance: f64,
    /// All charge of modulated light, in steps of the code.
    pub light: f64,
}

impl Phasor<'_> {
    /// Squared length in units of its mean under noise alone: half the inverse of the variance of the phase.
    pub fn power(&self) -> f64 {
        0.5 / self.variance
    }
}

/// Makes phasors of the taps of a tone.
#[derive(Debug)]
pub(super) struct Demodulator<'a> {
    tone: &'a Tone,
    /// Cosine and sine of the phase of each tap.
    turns: Vec<[f64; 2]>,
    /// The harmonics that taps of this number cannot tell from the fundamental: how they turn with the phase, and
    /// their contrast over that of the fundamental.
    aliases: Vec<(f64, f64)>,
}

impl<'a> Demodulator<'a> {
    pub fn new(tone: &'a Tone) -> Self {
        let turn = |tap: u32| {
            let angle = TAU * f64::from(tap) / f64::from(tone.phases);
            [libm::cos(angle), libm::sin(angle)]
        };
        let fundamental = tone.contrasts[0];
        let harmonics =
            (1..).zip(&tone.contrasts).skip(1).filter(|(_, contrast)| **contrast != 0.0);
        let alias = |(n, contrast): (u32, &f64)| {
            let turns = match n % tone.phases {
                1 => f64::from(n),
                rest if rest == tone.phases - 1 => -f64::from(n),
                _ => return None,
            };
            Some((turns, contrast / fundamental))
        };
        Self {
            tone,
            turns: (0..tone.phases).map(turn).collect(),
            aliases: harmonics.filter_map(alias).collect(),
        }
    }

    /// How many taps it takes.
    pub fn taps(&self) -> usize {
        self.turns.len()
    }

    /// The phasor z = Σₖ codeₖ·e^{j2πk/K} freed of harmonics; `None` if a tap is full.
    pub fn phasor(&self, method: &PhaseMethod, codes: &[u16]) -> Option<Phasor<'a>> {
        if codes.iter().any(|code| *code >= method.full_scale) {
            return None;
        }
        let (mut re, mut im, mut sum) = (0.0, 0.0, 0.0);
        for (code, [cosine, sine]) in codes.iter().zip(&self.turns) {
            let code = f64::from(*code);
            re += code * cosine;
            im += code * sine;
            sum += code;
        }
        let taps = self.turns.len() as f64;
        let measured = libm::atan2(im, re);
        let (phase, gain) = self.freed(measured);
        // z is K/2·Q·c₁·gain long; each of its parts has the variance K/2 of that of a tap.
        let length = libm::hypot(re, im);
        let variance = method.variance(sum / taps) * taps / 2.0;
        Some(Phasor {
            tone: self.tone,
            phase,
            variance: variance / (length * length).max(f64::MIN_POSITIVE),
            light: 2.0 * length / (gain * self.tone.contrasts[0]),
        })
    }

    /// The phase of light whose phasor has the angle `measured`, and the length of that phasor over that of the
    /// fundamental.
    pub fn freed(&self, measured: f64) -> (f64, f64) {
        if self.aliases.is_empty() {
            return (measured, 1.0);
        }
        let mut phase = measured;
        let mut gain = 1.0;
        for _ in 0..NEWTON {
            let Aliased { re, im, slope } = self.aliased(phase);
            gain = libm::hypot(re, im);
            let error = wrapped(libm::atan2(im, re) - measured);
            phase -= error / slope.max(LEAST_SLOPE);
        }
        (wrapped(phase), gain)
    }

    /// The phasor of light of this phase, the fundamental alone being 1 long.
    fn aliased(&self, phase: f64) -> Aliased {
        let (mut re, mut im) = (libm::cos(phase), libm::sin(phase));
        // d/dφ of z = Σ a·e^{jnφ} is Σ jn·a·e^{jnφ}.
        let (mut re_slope, mut im_slope) = (-im, re);
        for (turns, contrast) in &self.aliases {
            let (cosine, sine) = (libm::cos(turns * phase), libm::sin(turns * phase));
            re += contrast * cosine;
            im += contrast * sine;
            re_slope -= turns * contrast * sine;
            im_slope += turns * contrast * cosine;
        }
        let slope = (re * im_slope - im * re_slope) / (re * re + im * im).max(f64::MIN_POSITIVE);
        Aliased { re, im, slope }
    }
}

/// A phasor with harmonics, and how fast its angle turns with the phase of the light.
struct Aliased {
    re: f64,
    im: f64,
    slope: f64,
}

/// Steps of Newton's method: the error of a square wave and four taps, 0.07 rad, is below 1e-12 after five.
const NEWTON: usize = 6;

/// The angle of a phasor turns with that of the light by more than this, or Newton's method would go astray.
const LEAST_SLOPE: f64 = 0.1;

/// An angle less whole turns, −π to π.
pub(super) fn wrapped(angle: f64) -> f64 {
    angle - TAU * (angle / TAU).round()
}

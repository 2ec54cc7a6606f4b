//! Single-stop timing: one event per shot, when enough photons have come \[KP16 Fig. 7\].

use macropulse_codec::statistics::{normal_order, normal_quantile, normal_tail};
use schemars::JsonSchema;
use serde::Deserialize;

use super::{
    Detector, Follows, Idle, Lit, Model, NEVER_MISSES, Noise, SLICES, Sensitivity, SensitivityFile,
    Table, Typed, slices_above,
};
use crate::design::{Error, Light};
use crate::units::RMS_OF_FWHM;

/// `[detector.single-stop]` as typed.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct File {
    /// Declared sensitivity; if the list `idealised` names `link-budget`.
    sensitivity: Option<SensitivityFile>,
    /// Detections per photon; with a link budget.
    #[schemars(range(min = 1e-6, max = 1))]
    efficiency: Option<f64>,
    /// Photons needed for an event; 1 is a Geiger detector, which measures no amplitude.
    #[schemars(range(min = 1, max = 1048576))]
    firing_photons: u32,
    /// White noise over a pulse, photons rms.
    #[schemars(range(min = 0, max = 1e6))]
    noise_photons: f64,
    /// Rate of events by noise, per second.
    #[schemars(range(min = 0, max = 1e9))]
    false_firing_hz: f64,
    /// Timing jitter, ps rms.
    #[schemars(range(min = 0, max = 1e6))]
    jitter_ps: f64,
}

/// Number of photons that replaces the infinite light of a detector that never misses, if a number is needed.
pub const PLENTY: f64 = 1e9;

/// A detector that fires once, when enough photons of one shot have come.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SingleStop {
    /// Mean photons detected per shot at the reference target.
    pub sensitivity: Sensitivity,
    /// Photons needed to fire; 1 is a Geiger detector.
    pub firing_photons: u32,
    /// White noise integrated over one pulse, photons rms.
    pub noise_photons: f64,
    /// Firings without a target, 1/s.
    pub false_rate: f64,
    /// Standard deviation of the timing, s.
    pub jitter: f64,
    /// Length of the micropulse over which it adds light up, full width at half maximum, s.
    pub pulse: f64,
}

/// Setting of a detector that fires once per shot, for the light it sees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SingleStopSetting {
    /// Photons needed to fire; 1 is a Geiger detector.
    pub needed: u32,
    /// White noise integrated over one pulse, photons rms.
    pub noise: f64,
    /// Firings without a target, 1/s.
    pub false_rate: f64,
    /// Standard deviation of the timing, s.
    pub jitter: f64,
}

impl Typed for File {
    fn efficiency(&self) -> Option<f64> {
        self.efficiency
    }

    fn idle(&self) -> Idle {
        Idle::EITHER
    }

    fn follows(&self) -> Follows {
        Follows { bandwidth: false, neighbouring_chips: false }
    }

    fn is_single_stop(&self) -> bool {
        true
    }

    fn check(&self, table: &Table) -> Result<Detector, Error> {
        if table.before.emission.coding().codebook.max_weight() > 1 {
            return table.refuse(
                "fires once per shot, but a coded shot has several marks: use \
                 [detector.geiger], [detector.photodiode] or [detector.photon-counting], or leave \
                 [code] out",
            );
        }
        let needed = table.count("firing_photons", self.firing_photons, 1, 1 << 20)?;
        let noise = table.within("noise_photons", self.noise_photons, 0.0, 1e6)?;
        let photons = |pd| photons_for(pd, needed, noise);
        Ok(Detector::SingleStop(SingleStop {
            sensitivity: table.sensitivity(self.sensitivity.as_ref(), photons)?,
            firing_photons: needed,
            noise_photons: noise,
            false_rate: table.within("false_firing_hz", self.false_firing_hz, 0.0, 1e9)?,
            jitter: table.jitter(self.jitter_ps)?,
            pulse: table.before.light.pulse,
        }))
    }
}

/// Mean photons for which a detector that needs `needed` photons fires with probability `pd`,
/// when white noise of `noise` photons rms is added.
///
/// One photon: n = −ln(1 − pd). More: the sum of Poisson and Gaussian fluctuation reaches the
/// threshold, n − z·√(n + a²) = m with z = Φ⁻¹(pd).
fn photons_for(pd: f64, needed: u32, noise: f64) -> f64 {
    if pd >= 1.0 {
        return f64::INFINITY;
    }
    if needed == 1 && noise == 0.0 {
        return -libm::log1p(-pd);
    }
    let (m, z) = (f64::from(needed), normal_quantile(pd));
    // n² − (2m + z²)·n + m² − z²a² = 0
    let half = m + z * z / 2.0;
    let root = (half * half - (m * m - z * z * noise * noise)).max(0.0).sqrt();
    (half + z.signum() * root).max(0.0)
}

impl SingleStop {
    /// The setting of a detector that sees `background` detections of steady light per second.
    ///
    /// If one photon is enough, every photon of that light fires it. If more are needed, their mean is taken
    /// off (the amplifier passes no steady current) and their fluctuation is shot noise: √(a² + b·τ), a the
    /// noise rms without light, b the background, τ the pulse.
    pub fn setting(&self, background: f64) -> SingleStopSetting {
        let &Self { firing_photons, noise_photons, false_rate, jitter, pulse, .. } = self;
        let (noise, false_rate) = match firing_photons {
            1 => (noise_photons, false_rate + background),
            _ => ((noise_photons.powi(2) + background * pulse).sqrt(), false_rate),
        };
        SingleStopSetting { needed: firing_photons, noise, false_rate, jitter }
    }
}

impl SingleStopSetting {
    /// True if it measures the photons of a pulse. It does not if the first of them fires it, as in a Geiger
    /// cell.
    pub fn measures(&self) -> bool {
        self.needed > 1
    }

    /// Probability that a detector fires at a mark with n = `photons` detected on average. The detector needs
    /// m photons and has a photons rms of noise: 1 − exp(−n) for m = 1 without noise, else
    /// Q((m − n)/√(n + a²)).
    fn firing(&self, photons: f64) -> f64 {
        let (needed, noise, photons) = (f64::from(self.needed), self.noise, photons.min(PLENTY));
        if self.needed == 1 && noise == 0.0 {
            return -libm::expm1(-photons);
        }
        normal_tail((needed - photons) / (photons + noise * noise).sqrt())
    }
}

impl Model for SingleStop {
    fn sensitivity(&self) -> Sensitivity {
        self.sensitivity
    }

    fn jitter(&self) -> f64 {
        self.jitter
    }

    /// The length of a micropulse counts by the root of the photons that it takes.
    fn resolution(&self, light: &Light) -> f64 {
        let flank = light.pulse * RMS_OF_FWHM / f64::from(self.firing_photons).sqrt();
        libm::hypot(self.jitter, flank)
    }

    /// The first event in a gate excludes all others.
    fn has_state(&self) -> bool {
        true
    }

    fn unpulsed(&self) -> Option<&'static str> {
        let told = "a detector that more photons than one fire is not simulated in it: set \
                    detector.single-stop.firing_photons to 1";
        (self.firing_photons > 1).then_some(told)
    }

    fn false_rate(&self, background: f64) -> f64 {
        self.setting(background).false_rate
    }

    fn noise(&self, background: f64) -> Option<Noise> {
        let SingleStopSetting { needed, noise, .. } = self.setting(background);
        (noise > 0.0).then(|| Noise { rms: noise, threshold: needed.into(), excess: 1.0 })
    }

    fn mark_pd(&self, lit: &Lit) -> f64 {
        self.setting(lit.background).firing(lit.photons)
    }

    fn mark_jitter(&self, _: &Lit) -> f64 {
        self.jitter
    }

    /// Standard deviation of the moment at which the m-th of k photons comes. It is that of the m-th smallest
    /// of k normal variables ([`normal_order`]), in rms lengths of a Gaussian pulse. Its square is averaged
    /// over pulses of m photons or more, whose numbers k are normal about the mean.
    fn mark_displacement(&self, lit: &Lit, light: &Light) -> f64 {
        let SingleStopSetting { needed, noise, .. } = self.setting(lit.background);
        let (needed, mean) = (f64::from(needed), lit.photons.min(PLENTY));
        let spread = (mean + noise * noise).sqrt();
        let squares = slices_above(needed, mean, spread)
            .map(|photons| normal_order(needed, photons).1.powi(2));
        light.pulse * RMS_OF_FWHM * (squares.sum::<f64>() / f64::from(SLICES)).sqrt()
    }

    fn summary(&self) -> String {
        let Sensitivity { photons, range, reflectance } = self.sensitivity;
        let seen = match photons.is_finite() {
            true => format!("{photons:.0} from reflectance {reflectance} at {range} m"),
            false => NEVER_MISSES.to_owned(),
        };
        format!(
            "fires at {} photons, {seen}; noise {} photons; jitter {} ps",
            self.firing_photons,
            self.noise_photons,
            self.jitter * 1e12
        )
    }

    fn in_sunlight(&self) -> &'static str {
        match self.firing_photons {
            1 => "each of which fires it",
            _ => "which are noise to it",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_photon_without_noise_is_the_geiger_law() {
        approx::assert_relative_eq!(photons_for(0.99, 1, 0.0), 4.605_170_186, max_relative = 1e-9);
        assert_eq!(photons_for(1.0, 400, 20.0), f64::INFINITY);
    }
}

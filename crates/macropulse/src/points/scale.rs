//! The scale of reflectance: from a receiver's measurement of a return to the reflectance of its surface.
//!
//! Intensity is the photons that a mark brought over those that a white surface seen square on would have
//! brought from the same range. A receiver knows its range by its own estimate, its link budget or its
//! declared sensitivity, the air, and the law of its own detector. It knows nothing of the scene.
//!
//! 1. An amplitude is a number of photons, and so is the result of a receiver of samples.
//! 2. A count of marks tells the share of them that made an event, as μ = −ln(1 − share). If every photon
//!    fires the detector, μ is the photons. Any other detector gives that share for n photons,
//!    p(n) = 1 − exp(−μ): its law is inverted.
//! 3. If no mark was missed the count tells a lower bound, and the return is flagged.

use crate::channel::{Link, Operating};
use crate::design::Design;
use crate::design::detector::Lit;
use macropulse_codec::decode::Method;

/// Number of photon counts at which the law of a detector is tabulated, evenly spaced in their logarithm …
const PLACES: i32 = 640;

/// … from 10⁻³ …
const LEAST: f64 = 1e-3;

/// … on, with this many to a factor of e.
const PER_E: f64 = 40.0;

/// The scale of intensity ends here. No material of a scene is brighter than 1.2·10⁵: a return of 10⁶ is
/// light that no surface at its range sent back. An example is a dark count at a range at which a field of
/// view that follows the beam has moved on, and white would bring nothing.
const BRIGHTEST: f64 = 1e6;

/// A receiver's knowledge for reflectance.
#[derive(Debug, Clone, PartialEq)]
pub struct Scale {
    link: Link,
    /// ln μ and ln n of a detector that does not count photon by photon, ascending; else empty.
    law: Vec<(f64, f64)>,
}

impl Scale {
    /// That of `design` where it is `operating`.
    pub fn of(design: &Design, operating: &Operating) -> Self {
        let measures = matches!(design.receiver.method, Method::Direct | Method::Sampled(_));
        let law = if measures { Vec::new() } else { law(design, operating) };
        Self { link: operating.link, law }
    }

    /// Photons per mark from which the detector makes the same number of events as one that fires for each of
    /// `photons`.
    #[inline]
    pub(super) fn detected(&self, photons: f32) -> f32 {
        match self.law.len().checked_sub(1) {
            Some(last) => self.turned_round(photons, last),
            None => photons,
        }
    }

    /// The same by the law, whose last entry has the number `last`.
    fn turned_round(&self, photons: f32, last: usize) -> f32 {
        if photons <= 0.0 {
            return 0.0;
        }
        let mu = f64::from(photons).ln();
        let behind = self.law.partition_point(|(known, _)| *known < mu).clamp(1, last.max(1));
        let (Some(&(low, from)), Some(&(high, to))) =
            (self.law.get(behind - 1), self.law.get(behind))
        else {
            return photons;
        };
        // Beyond the ends of the table nothing is told of the law.
        let part = ((mu - low) / (high - low)).clamp(0.0, 1.0);
        libm::exp(from + part * (to - from)) as f32
    }

    /// Reflectance of a surface square on at `range` metres that brings `photons` per mark, up to
    /// [`BRIGHTEST`]. It is 1 for a detector that never misses and so has no photon scale. It is 0 if the
    /// return lies at the sensor, as any surface there would be brighter.
    #[inline]
    pub(super) fn reflectance(&self, photons: f32, range: f64) -> f32 {
        let white = self.link.detected(1.0, range);
        if white.is_infinite() {
            return 1.0;
        }
        if photons <= 0.0 || range <= 0.0 {
            return 0.0;
        }
        (f64::from(photons) / white).min(BRIGHTEST) as f32
    }
}

/// Pairs of ln μ and ln n: with n photons a mark makes an event with probability 1 − exp(−μ). Photons are
/// left out if the event is certain, or if noise alone makes it nearly as likely. The list is empty if μ is
/// n.
fn law(design: &Design, operating: &Operating) -> Vec<(f64, f64)> {
    let detector = design.detector.model();
    let (background, falling) = (operating.background, operating.false_rate);
    let mut law: Vec<(f64, f64)> = Vec::new();
    for place in 0..PLACES {
        let ln_photons = LEAST.ln() + f64::from(place) / PER_E;
        let photons = libm::exp(ln_photons);
        let share = detector.mark_pd(&Lit { photons, background, falling });
        let mu = -libm::log1p(-share);
        if !mu.is_finite() || mu > MOST {
            break;
        }
        let ln_mu = mu.ln();
        if ln_mu.is_finite() && law.last().is_none_or(|(last, _)| *last < ln_mu) {
            law.push((ln_mu, ln_photons));
        }
    }
    let counts = law.iter().all(|(mu, n)| (mu - n).abs() < 1e-9);
    if counts { Vec::new() } else { law }
}

/// μ up to which a count of marks tells anything: half of 2¹⁶ marks missed in none.
const MOST: f64 = 12.0;

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn scale(name: &str, set: &[(&str, &str)]) -> (Design, Scale) {
        let owned = |&(key, value): &(&str, &str)| (key.to_owned(), value.to_owned());
        let design = Design::open(name, &set.iter().map(owned).collect::<Vec<_>>()).unwrap();
        let scale = Scale::of(&design, &Operating::in_the_dark(&design));
        (design, scale)
    }

    #[test]
    fn a_counter_of_photons_counts_photons() {
        let (_, scale) = scale("kim-park-2016", &[]);
        assert!(scale.law.is_empty());
        assert_eq!([0.0, 1.7].map(|photons| scale.detected(photons)), [0.0, 1.7]);
        // 4.605 photons from white at 150 m, and four times that number from half the range.
        assert_relative_eq!(scale.reflectance(4.605_17, 150.0), 1.0, max_relative = 1e-6);
        assert_relative_eq!(scale.reflectance(4.605_17, 75.0), 0.25, max_relative = 1e-6);
    }

    /// If a tenth of the marks is lost whatever the light, 0.9·(1 − e⁻²) of them are seen with two photons.
    #[test]
    fn marks_that_are_lost_otherwise_are_not_taken_for_darkness() {
        let key = "detector.photon-counting.missed_marks";
        let (_, scale) = scale("kim-park-2016", &[(key, "0.1")]);
        let share = 0.9 * -(-2.0_f64).exp_m1();
        assert_relative_eq!(scale.detected(-(-share).ln_1p() as f32), 2.0, max_relative = 1e-3);
    }

    #[test]
    fn a_threshold_is_turned_round() {
        let (design, scale) = scale("coded-practical", &[]);
        let noise = design.detector.model().noise(0.0).unwrap();
        for photons in [0.9 * noise.threshold, noise.threshold, 1.1 * noise.threshold] {
            let lit = Lit { photons, background: 0.0, falling: 1e5 };
            let share = design.detector.model().mark_pd(&lit);
            let found = f64::from(scale.detected(-(-share).ln_1p() as f32));
            assert_relative_eq!(found, photons, max_relative = 2e-3);
        }
        // A detector that measures is taken at its word.
        let (_, direct) = self::scale("vlp-16", &[]);
        assert_eq!(direct.detected(1234.5), 1234.5);
    }

    /// A field of one pixel has moved on from 6.2 m. Control: what white brings nearer is told as 1.
    #[test]
    fn intensity_is_finite_where_white_would_bring_nothing() {
        let (_, blind) = scale("kim-park-2016-physical", &[("optics.field", "descanned")]);
        assert_eq!(blind.link.detected(1.0, 7.0), 0.0);
        assert_eq!([0.0, 1.5].map(|photons| blind.reflectance(photons, 7.0)), [0.0, 1e6]);
        let near = blind.link.detected(1.0, 3.0) as f32;
        assert_relative_eq!(blind.reflectance(near, 3.0), 1.0, max_relative = 1e-6);
        assert_eq!([-0.1, 0.0].map(|range| blind.reflectance(1.5, range)), [0.0; 2]);
    }

    #[test]
    fn what_never_misses_has_no_scale() {
        let (_, scale) =
            scale("kim-park-2016", &[("detector.photon-counting.sensitivity.pd", "1.0")]);
        assert_eq!(scale.reflectance(5.0, 30.0), 1.0);
    }
}

//! The link budget, the origin of the photons: energy, aperture and optics.

mod check;

use std::f64::consts::{FRAC_PI_4, PI};
use std::sync::{Mutex, OnceLock, PoisonError};

pub(in crate::design) use check::{BudgetFile, OpticsFile, Parts, SafetyFile};

use super::safety::{
    Class1, Condition, Limit, Sender, exposure, limits, strictest, strictest_of_each,
};
use super::{Emission, Light, Scan};
use crate::units::{PLANCK, SPEED_OF_LIGHT};

/// The parts of an honest link. SI units.
#[derive(Debug, Clone)]
pub struct Budget {
    /// Wavelength, m.
    pub wavelength: f64,
    /// Energy of a shot, J, the mean over its labels: every mark has the same.
    pub energy: f64,
    /// Place of the eye, and the rules that count there.
    eye: Eye,
    /// Limits of class 1 for a shot, worked out when first asked for.
    limits: OnceLock<Vec<Limit>>,
    /// Diameter of the receiving aperture, m.
    pub aperture: f64,
    /// Transmission of the optics, both ways together.
    pub transmission: f64,
    /// Width of the optical filter, m.
    pub filter: f64,
    /// Field of the detector.
    pub field: Field,
    /// Detections per photon.
    pub efficiency: f64,
}

/// Place of an eye that looks into the beams, and the rules that count there.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Eye {
    /// How far away it is, m.
    distance: f64,
    /// Set if groups of shots that cross it count as repeated exposures.
    count_groups: bool,
    /// Width of the source that it sees, m; 0 for a point.
    source: f64,
}

/// Field of a detector.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Field {
    /// Solid angle, sr.
    pub solid_angle: f64,
    /// Set if the field follows the beam.
    pub co_scanned: Option<CoScanned>,
}

/// A field that follows the beam along its line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CoScanned {
    /// Its length in pixels: from the one the beam is on back to those it has left.
    pub pixels: f64,
    /// Time between shots, s.
    pub pixel_period: f64,
}

impl Budget {
    /// Limits of class 1 for a shot; empty if no rule fits the wavelength or the scan.
    pub(super) fn limits(&self, scan: &Scan, light: &Light, emission: &Emission) -> &[Limit] {
        self.limits.get_or_init(|| self.eye.limits(scan, light, emission))
    }

    /// Area of the aperture, m².
    pub fn area(&self) -> f64 {
        PI * self.aperture.powi(2) / 4.0
    }

    /// Effective area of the optics for light at the aperture: area times transmission, m².
    pub fn receiver(&self) -> f64 {
        self.area() * self.transmission
    }

    /// Energy of one photon, J: h·c/λ.
    pub fn photon_energy(&self) -> f64 {
        PLANCK * SPEED_OF_LIGHT / self.wavelength
    }

    /// Photons that reach the detector of `energy` joules sent, through clear air, at an extended
    /// Lambertian target of `reflectance` at `range` metres, square on:
    /// E·ρ·A·η/(π·R²) over h·c/λ (docs/physics.md#link-equation).
    pub fn photons(&self, energy: f64, reflectance: f64, range: f64) -> f64 {
        let received =
            energy * reflectance * self.area() * self.transmission / (PI * range.powi(2));
        received / self.photon_energy()
    }

    /// Photons of sunlight per second that reach the detector where the scene has the spectral
    /// `irradiance` E_λ in W/m² per metre and the mean reflectance `albedo` ρ_b:
    /// E_λ·Δλ·ρ_b/π·A·Ω·η over h·c/λ (docs/physics.md#background).
    pub fn background(&self, irradiance: f64, albedo: f64) -> f64 {
        let power = irradiance * self.filter * albedo / PI
            * self.area()
            * self.field.solid_angle
            * self.transmission;
        power / self.photon_energy()
    }
}

/// Filter, m, and field of a coherent receiver: light within its bandwidth, in one mode of an aperture of
/// this diameter. The mode has half of unpolarised light; the field is smaller by that factor.
fn mode(wavelength: f64, aperture: f64, bandwidth: f64) -> (f64, Field) {
    let filter = wavelength * wavelength * bandwidth / SPEED_OF_LIGHT;
    let solid_angle = wavelength * wavelength / (FRAC_PI_4 * aperture * aperture) / 2.0;
    (filter, Field { solid_angle, co_scanned: None })
}

/// Class 1 limits of the sensors that were opened last, the newest at the end.
///
/// A sweep opens a sensor once for each of its values, and most of these do not change the limits. The search for the
/// worst place of an eye takes longer than all other checks.
static KNOWN: Mutex<Vec<Known>> = Mutex::new(Vec::new());

/// Sensors in [`KNOWN`] at most.
const MOST_KNOWN: usize = 16;

/// A sensor and its class 1 limits.
struct Known {
    sensor: (Eye, Scan, Light, Emission),
    limits: Vec<Limit>,
}

impl Eye {
    /// Limits of class 1 for a shot in front of the bare eye, and in front of one behind a telescope.
    fn limits(self, scan: &Scan, light: &Light, emission: &Emission) -> Vec<Limit> {
        let all = || KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
        let is_same = |known: &&Known| {
            let (eye, its_scan, its_light, its_emission) = &known.sensor;
            (*eye, its_scan, its_light, its_emission) == (self, scan, light, emission)
        };
        if let Some(known) = all().iter().find(is_same) {
            return known.limits.clone();
        }
        let limits = self.limits_anew(scan, light, emission);
        let mut all = all();
        if all.len() == MOST_KNOWN {
            all.remove(0);
        }
        let sensor = (self, scan.clone(), light.clone(), emission.clone());
        all.push(Known { sensor, limits: limits.clone() });
        limits
    }

    fn limits_anew(self, scan: &Scan, light: &Light, emission: &Emission) -> Vec<Limit> {
        let Some(class) = Class1::at(light.wavelength) else { return Vec::new() };
        let Self { distance, count_groups, source } = self;
        let all = [Condition::bare_eye(distance), class.telescope()].map(|condition| {
            let sender = Sender { scan, light, emission, condition, count_groups };
            let under = |class: Class1| limits(&class, &exposure(&class, &sender));
            let point = under(class);
            if source == 0.0 {
                return point;
            }
            // Any source may be judged as a point: the reading that allows more counts.
            let extended = under(class.of_source(source, &condition));
            let least =
                |limits: &[Limit]| strictest(limits).map_or(f64::INFINITY, |one| one.energy);
            if least(&extended) > least(&point) { extended } else { point }
        });
        strictest_of_each(&all.concat())
    }
}

impl Field {
    /// The share of a shot's light that the field still holds when it arrives, `tof` seconds
    /// after the shot was fired: 1 where the detector stares. A field of W pixels that follows
    /// the beam holds a spot L pixels behind it with the share W − L, between 0 and 1.
    pub fn share(&self, tof: f64) -> f64 {
        match self.co_scanned {
            None => 1.0,
            Some(CoScanned { pixels, pixel_period }) => {
                (pixels - tof / pixel_period).clamp(0.0, 1.0)
            }
        }
    }
}

/// Solid angle, sr, of a field of `horizontal` radians of azimuth and `vertical` radians of elevation
/// about the horizon: h·2·sin(v/2). Directions of rasters and flashes are azimuths and elevations;
/// a pyramid as wide and as high in its middle planes is narrower above and below.
pub fn solid_angle(horizontal: f64, vertical: f64) -> f64 {
    horizontal * 2.0 * libm::sin(vertical / 2.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::design::Design;
    use approx::assert_relative_eq;

    fn physical(overrides: &[(&str, &str)]) -> Budget {
        let owned = |&(key, value): &(&str, &str)| (key.to_owned(), value.to_owned());
        let overrides: Vec<_> = overrides.iter().map(owned).collect();
        Design::open("kim-park-2016-physical", &overrides).unwrap().budget.unwrap()
    }

    #[test]
    fn what_class_1_allows_brings_18_photons_from_150_metres() {
        let budget = physical(&[]);
        assert_relative_eq!(budget.energy, 0.823e-9, max_relative = 5e-3);
        let transmission = libm::exp(-0.0890e-3 * 150.0);
        let photons = budget.photons(budget.energy, 1.0, 150.0) * transmission.powi(2);
        assert_relative_eq!(photons, 17.76, max_relative = 5e-3);
        assert_eq!(budget.photons(0.0, 1.0, 150.0), 0.0);
    }

    #[test]
    fn a_staring_receiver_drowns_in_sunlight() {
        let budget = physical(&[]);
        assert_relative_eq!(budget.field.solid_angle, 0.3174, max_relative = 1e-4);
        let photons = budget.background(0.817e9, 0.3);
        assert_relative_eq!(photons * 2.5e-12, 969.0, max_relative = 2e-3);
        assert_eq!(budget.background(0.0, 0.3), 0.0);
    }

    #[test]
    fn a_field_of_one_pixel_loses_what_lies_beyond_six_metres() {
        let one = physical(&[("optics.field", "descanned")]).field;
        let wide = physical(&[("optics.field", "in-flight")]).field;
        let tof = crate::units::tof_from_range;
        assert_eq!(one.share(0.0), 1.0);
        assert_relative_eq!(one.share(tof(3.07)), 0.5, max_relative = 1e-3);
        assert_eq!(one.share(tof(6.2)), 0.0);
        assert_eq!(wide.share(tof(150.0)), 1.0);
        assert_eq!(physical(&[]).field.share(tof(150.0)), 1.0);
        let pitch = (43.2_f64 / 848.0).to_radians() * (24.3_f64 / 480.0).to_radians();
        assert_relative_eq!(one.solid_angle, pitch, max_relative = 1e-6);
        assert_relative_eq!(wide.solid_angle / one.solid_angle, 25.44, max_relative = 1e-3);
    }

    #[test]
    fn solid_angles_of_known_fields() {
        assert_relative_eq!(solid_angle(2.0 * PI, PI), 4.0 * PI, max_relative = 1e-12);
        // Half of a sphere lies within 30 degrees of its equator.
        assert_relative_eq!(solid_angle(2.0 * PI, PI / 3.0), 2.0 * PI, max_relative = 1e-12);
        assert_relative_eq!(solid_angle(1e-4, 2e-4), 2e-8, max_relative = 1e-8);
    }
}

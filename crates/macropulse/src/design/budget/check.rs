//! Energy, optics and eyes.

use std::f64::consts::FRAC_PI_4;
use std::sync::OnceLock;

use schemars::JsonSchema;
use serde::Deserialize;

use super::{Budget, CoScanned, Eye, Field, mode, solid_angle};
use crate::design::detector::Efficiency;
use crate::design::light::EnergyFile;
use crate::design::limits::Check;
use crate::design::safety::{Beams, Limit, strictest};
use crate::design::{Effect, Emission, Error, Light, Readout, Scan};
use crate::units::tof_from_range;

/// `[optics]` as typed.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(in crate::design) struct OpticsFile {
    /// Diameter of the receiving aperture, mm.
    #[schemars(range(min = 0.01, max = 1e4))]
    aperture_mm: f64,
    /// Transmission of the optics, both ways together.
    #[schemars(range(min = 1e-6, max = 1))]
    transmission: f64,
    /// Width of the optical filter, nm; left out with a [chirp], whose laser selects the light.
    #[schemars(range(min = 0.001, max = 1000))]
    filter_nm: Option<f64>,
    /// Field of view of a detector; left out with a [chirp].
    field: Option<FieldFile>,
}

/// Field of view of a detector, as typed.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
enum FieldFile {
    /// The whole field of a raster.
    #[serde(rename = "staring")]
    Staring,
    /// The cell of its pixel, with the beam; of a flash it stays there.
    #[serde(rename = "descanned")]
    Descanned,
    /// All pixels of a raster whose light may still be under way.
    #[serde(rename = "in-flight")]
    InFlight,
    /// This number of pixels of a raster, from that of the beam back.
    #[serde(rename = "co_scanned_pixels")]
    CoScannedPixels(#[schemars(range(min = 1))] f64),
    /// A round field about the cell of its pixel, mrad, full angle.
    #[serde(rename = "cone_mrad")]
    ConeMrad(#[schemars(range(min = 0.001, max = 1000))] f64),
}

/// `[safety]` as typed.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(in crate::design) struct SafetyFile {
    /// Distance of the eye, mm.
    #[schemars(range(min = 1, max = 1e5))]
    distance_mm: f64,
    /// True if the groups of shots that cross an eye, as the lines of a raster, count as repeated exposures.
    count_lines: bool,
    /// True if the light of a flash comes from a source as wide as its beam, as a diffuser is, and not from a point.
    extended_source: bool,
}

/// The keys of a file that declare a budget.
pub(in crate::design) struct BudgetFile<'a> {
    pub optics: Option<&'a OpticsFile>,
    pub safety: Option<&'a SafetyFile>,
    pub energy: Option<EnergyFile>,
}

/// The other parts of a sensor that its budget depends on.
pub(in crate::design) struct Parts<'a> {
    pub scan: &'a Scan,
    pub light: &'a Light,
    pub emission: &'a Emission,
    pub readout: &'a Readout,
    pub idealised: &'a [Effect],
}

impl Check<'_> {
    /// The link budget; `None` where it is idealised away.
    pub(in crate::design) fn budget(
        &self,
        file: &BudgetFile,
        parts: &Parts,
        efficiency: &Efficiency,
    ) -> Result<Option<Budget>, Error> {
        let off = |effect| parts.idealised.contains(&effect);
        if off(Effect::LinkBudget) {
            if !off(Effect::EyeSafety) {
                return self.refuse(
                    "idealised",
                    "eye safety limits an energy: without \"link-budget\" in this list, or with \
                     \"eye-safety\" in it as well",
                );
            }
            return Ok(None);
        }
        let (Some(optics), Some(safety)) = (file.optics, file.safety) else {
            return self.refuse(
                "optics",
                "the link budget is not idealised: it needs [optics], or \"link-budget\" in the \
                 list `idealised`",
            );
        };
        let path = &efficiency.path;
        let Some(efficiency) = efficiency.value else {
            return self.refuse(path, "is needed where the link budget is not idealised");
        };
        let wavelength = parts.light.wavelength;
        let distance = self.within("safety.distance_mm", safety.distance_mm, 1.0, 1e5)? * 1e-3;
        let source = self.source(safety, parts)?;
        let eye = Eye { distance, count_groups: safety.count_lines, source };
        let limits = OnceLock::new();
        let allowed = || {
            let Parts { scan, light, emission, .. } = parts;
            limits.get_or_init(|| eye.limits(scan, light, emission)).as_slice()
        };
        let energy = self.energy(file.energy, allowed, off(Effect::EyeSafety))?;
        let aperture = self.within("optics.aperture_mm", optics.aperture_mm, 0.01, 1e4)? * 1e-3;
        let (filter, field) = match parts.readout.model().bandwidth_of_mode() {
            Some(bandwidth) => mode(wavelength, aperture, bandwidth),
            None => (self.filter(optics)?, self.field(optics, parts.scan)?),
        };
        Ok(Some(Budget {
            wavelength,
            energy,
            eye,
            limits,
            aperture,
            transmission: self.within("optics.transmission", optics.transmission, 1e-6, 1.0)?,
            filter,
            field,
            efficiency: self.within(path, efficiency, 1e-6, 1.0)?,
        }))
    }

    /// Width of the source that an eye sees, m; 0 for a point.
    fn source(&self, safety: &SafetyFile, parts: &Parts) -> Result<f64, Error> {
        if !safety.extended_source {
            return Ok(0.0);
        }
        match parts.scan.model().beams() {
            Beams::Flood(_) => Ok(parts.light.beam_diameter),
            Beams::Lines(_) | Beams::Scattered(_) => self.refuse(
                "safety.extended_source",
                "must be false, as only [scan.flash] spreads its light from its source on: a beam looks like a point",
            ),
        }
    }

    /// The energy of a shot, J: as typed, or the most that class 1 allows.
    fn energy<'l>(
        &self,
        typed: Option<EnergyFile>,
        limits: impl FnOnce() -> &'l [Limit],
        any_energy: bool,
    ) -> Result<f64, Error> {
        let path = "light.energy";
        let typed = match typed {
            None => {
                return self.refuse(
                    path,
                    "is needed where the link budget is not idealised: \"class-1\", or \
                     { shot_nj = … }",
                );
            }
            Some(EnergyFile::ShotNj(shot)) => {
                Some(self.within("light.energy.shot_nj", shot, 1e-9, 1e12)? * 1e-9)
            }
            Some(EnergyFile::Class1) if any_energy => {
                return self.refuse(
                    path,
                    "comes from class 1, so eye safety is not idealised: take \"eye-safety\" off \
                     the list",
                );
            }
            Some(EnergyFile::Class1) => None,
        };
        if let Some(energy) = typed.filter(|_| any_energy) {
            return Ok(energy);
        }
        let Some(limit) = strictest(limits()) else { return self.refuse(path, NO_LIMIT) };
        let energy = typed.unwrap_or(limit.energy);
        if energy <= limit.energy {
            return Ok(energy);
        }
        let message = format!(
            "is {:.4} nJ a shot, but class 1 allows {:.4} nJ ({}); \"eye-safety\" in the \
             list `idealised` lets it pass",
            energy * 1e9,
            limit.energy * 1e9,
            limit.rule.name()
        );
        self.refuse(path, message)
    }

    /// Width of the optical filter, m.
    fn filter(&self, optics: &OpticsFile) -> Result<f64, Error> {
        let path = "optics.filter_nm";
        let Some(typed) = optics.filter_nm else {
            return Err(self.chain.lacks(path, "missing field `filter_nm`"));
        };
        Ok(self.within(path, typed, 1e-3, 1e3)? * 1e-9)
    }

    /// Returns the field of view of each detector. A raster has that of the file. With several detectors it
    /// is the cell of the pixel, or a cone about it.
    fn field(&self, optics: &OpticsFile, scan: &Scan) -> Result<Field, Error> {
        let Some(typed) = optics.field else {
            return Err(self.chain.lacks("optics.field", "missing field `field`"));
        };
        let (rows, columns) = (f64::from(scan.rows), f64::from(scan.columns));
        let [across, down] = scan.model().cell();
        let pixel = solid_angle(across, down);
        let pixel_period = scan.shortest_period();
        let follows = scan.model().follows();
        let co_scanned = |pixels: f64, solid_angle: f64| Field {
            solid_angle,
            co_scanned: follows.then_some(CoScanned { pixels, pixel_period }),
        };
        if let FieldFile::ConeMrad(angle) = typed {
            let angle = self.within("optics.field.cone_mrad", angle, 1e-3, 1e3)? * 1e-3;
            return Ok(co_scanned(cone_pixels(angle / across), FRAC_PI_4 * angle * angle));
        }
        if let Some([horizontal, vertical]) = scan.model().shared_field() {
            let strip = |pixels: f64| co_scanned(pixels, pixels * pixel);
            return Ok(match typed {
                FieldFile::Staring => {
                    Field { solid_angle: solid_angle(horizontal, vertical), co_scanned: None }
                }
                FieldFile::InFlight => strip(1.0 + tof_from_range(scan.max_range) / pixel_period),
                FieldFile::CoScannedPixels(pixels) => strip(self.within(
                    "optics.field.co_scanned_pixels",
                    pixels,
                    1.0,
                    rows * columns,
                )?),
                FieldFile::Descanned | FieldFile::ConeMrad(_) => strip(1.0),
            });
        }
        match typed {
            FieldFile::Descanned => Ok(co_scanned(1.0, pixel)),
            _ => self.refuse(
                "optics.field",
                "each detector of a spinning or flash sensor looks at its own cell: use \
                 \"descanned\", or { cone_mrad = … }",
            ),
        }
    }
}

/// Returns the number of pixels that a round field about the beam reaches back, with a diameter of `width`
/// pixels. It is half the diameter and half the pixel that the beam is on, but at least that pixel.
fn cone_pixels(width: f64) -> f64 {
    ((width + 1.0) / 2.0).max(1.0)
}

const NO_LIMIT: &str = "no limit of class 1 is known here, only for 700 to 1050 and 1400 to 1800 nm: \
                        declare \"eye-safety\" as idealised and give shot_nj";

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_4;
    use std::path::Path;

    use approx::assert_relative_eq;

    use crate::design::{Design, Error, solid_angle};

    fn sensor(scan: &str, field: &str) -> Result<Design, Error> {
        let text = format!(
            "version = 1\nname = \"mine\"\nidealised = [\"footprint\", \"eye-safety\", \
             \"mirror-motion\"]\nscan.scans_per_s = 10.0\nscan.max_range_m = 30.0\n{scan}\n\
             light = {{ wavelength_nm = 1550.0, pulse_ps = 100.0, energy = {{ shot_nj = 1.0 }} }}\n\
             [optics]\naperture_mm = 3.0\ntransmission = 0.7\nfilter_nm = 1.0\nfield = {field}\n\
             [detector.geiger]\nefficiency = 0.1\n[tdc]\nconverters = 64\nresolution_ps = 100.0\n\
             [receiver]\nkind = \"direct\"\n"
        );
        Design::from_toml(&text, "mine.toml", Path::new(""), &[])
    }

    fn head(blocks: &str) -> String {
        format!("scan.spinning = {{ azimuth_step_deg = 0.5, blocks = [{blocks}] }}")
    }

    const UNEVEN: &str = "{ lasers = 3, first_deg = 9.0, step_deg = -1.0 }, \
                          { lasers = 2, first_deg = 3.0, step_deg = -2.0 }";
    const FLASH: &str =
        "scan.flash = { rows = 4, columns = 8, horizontal_deg = 16.0, vertical_deg = 4.0 }";

    #[test]
    fn every_laser_sees_its_own_cell_and_follows_the_head() {
        let field =
            |blocks: &str, field: &str| sensor(&head(blocks), field).unwrap().budget.unwrap().field;
        let [across, down] = [0.5_f64, 1.5].map(f64::to_radians);
        let cell = field(UNEVEN, "\"descanned\"");
        // Steps of 1, 1, 4 and 2 degrees.
        assert_relative_eq!(cell.solid_angle, solid_angle(across, down), max_relative = 1e-12);
        let co_scanned = cell.co_scanned.unwrap();
        // 720 columns ten times a second.
        assert_eq!(co_scanned.pixels, 1.0);
        assert_relative_eq!(co_scanned.pixel_period, 1.0 / 7200.0, max_relative = 1e-12);
        let alone = field("{ lasers = 1, first_deg = 0.0, step_deg = -1.0 }", "\"descanned\"");
        assert_relative_eq!(alone.solid_angle, solid_angle(across, across), max_relative = 1e-12);
    }

    #[test]
    fn a_cone_is_round_and_belongs_to_any_pattern() {
        let cone = |scan: &str| sensor(scan, "{ cone_mrad = 20.0 }").unwrap().budget.unwrap().field;
        let raster =
            "scan.raster = { rows = 4, columns = 8, horizontal_deg = 8.0, vertical_deg = 4.0 }";
        for scan in [&head(UNEVEN), FLASH, raster] {
            let solid_angle = cone(scan).solid_angle;
            assert_relative_eq!(solid_angle, FRAC_PI_4 * 4e-4, max_relative = 1e-12);
        }
        assert!(cone(FLASH).co_scanned.is_none());
        // 20 mrad are 1.15 pixels of a degree.
        let pixels = cone(raster).co_scanned.unwrap().pixels;
        assert_relative_eq!(pixels, (1.1459 + 1.0) / 2.0, max_relative = 1e-4);
    }

    #[test]
    fn fields_behind_a_single_beam_are_for_rasters_alone() {
        for scan in [&head(UNEVEN), FLASH] {
            for field in ["\"staring\"", "\"in-flight\"", "{ co_scanned_pixels = 2.0 }"] {
                let told = sensor(scan, field).unwrap_err().to_string();
                assert!(
                    told.contains("optics.field: each detector of a spinning or flash"),
                    "{told}"
                );
                assert_eq!(told.lines().count(), 1);
            }
        }
    }

    /// 13 chips of 10 µs fit between two shots of one laser, 139 µs apart, of 11 µs they do not.
    #[test]
    fn a_macropulse_fits_between_two_shots_of_the_same_detector() {
        let coded = |chip_us: &str| {
            let text = sensor(&head(UNEVEN), "\"descanned\"").unwrap().text;
            let text = text.replace("\"direct\"", "\"matched\"");
            let code = format!(
                "[code]\nchip_ps = {chip_us}e6\nlabel = \"none\"\n\
                 family = {{ sparse = {{ length = 13, weight = 3, words = 4, seed = 1 }} }}\n\
                 word = {{ first = 0, modulus = 4 }}\n"
            );
            Design::from_toml(&format!("{text}\n{code}"), "mine.toml", Path::new(""), &[])
        };
        let design = coded("10.0").unwrap();
        let derived = design.derived();
        assert!(derived.macropulse > derived.pixel_period);
        assert_relative_eq!(
            derived.channel_period,
            5.0 * derived.pixel_period,
            max_relative = 1e-9
        );
        let told = coded("11.0").unwrap_err().to_string();
        assert!(told.contains("between two shots of a detector"), "{told}");
    }
}

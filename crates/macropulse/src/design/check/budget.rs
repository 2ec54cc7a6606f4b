//! Energy, optics and eyes.

use super::Check;
use crate::design::budget::{Budget, Field, Trailing, solid_angle};
use crate::design::file::{EnergyFile, FieldFile, OpticsFile, SafetyFile, SensorFile};
use crate::design::safety::{Class1, Limit, Sender, exposure, limits, strictest};
use crate::design::{Coding, Effect, Error, Light, Pattern, Scan};
use crate::units::tof_from_range;

/// What a budget is made of beside the file.
pub(super) struct Parts<'a> {
    pub scan: &'a Scan,
    pub light: &'a Light,
    pub coding: &'a Coding,
    pub idealised: &'a [Effect],
}

impl Check<'_> {
    /// The link budget; `None` where it is idealised away.
    pub(super) fn budget(
        &self,
        file: &SensorFile,
        parts: &Parts,
        efficiency: (&str, Option<f64>),
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
        let (Some(optics), Some(safety)) = (&file.optics, &file.safety) else {
            return self.refuse(
                "optics",
                "the link budget is not idealised: it needs [optics], or \"link-budget\" in the \
                 list `idealised`",
            );
        };
        let (path, efficiency) = efficiency;
        let Some(efficiency) = efficiency else {
            return self.refuse(path, "is needed where the link budget is not idealised");
        };
        let wavelength = parts.light.wavelength;
        let limits = self.limits(safety, parts)?;
        let energy = self.energy(file, &limits, off(Effect::EyeSafety))?;
        Ok(Some(Budget {
            wavelength,
            energy,
            limits,
            aperture: self.within("optics.aperture_mm", optics.aperture_mm, 0.01, 1e4)? * 1e-3,
            transmission: self.within("optics.transmission", optics.transmission, 1e-6, 1.0)?,
            filter: self.within("optics.filter_nm", optics.filter_nm, 1e-3, 1e3)? * 1e-9,
            field: self.field(optics, parts.scan)?,
            efficiency: self.within(path, efficiency, 1e-6, 1.0)?,
        }))
    }

    fn energy(&self, file: &SensorFile, limits: &[Limit], any_energy: bool) -> Result<f64, Error> {
        let path = "light.energy";
        let strictest = strictest(limits);
        let energy = match &file.light.energy {
            None => {
                return self.refuse(
                    path,
                    "is needed where the link budget is not idealised: \"class-1\", or \
                     { shot_nj = … }",
                );
            }
            Some(EnergyFile::ShotNj(shot)) => {
                self.within("light.energy.shot_nj", *shot, 1e-9, 1e12)? * 1e-9
            }
            Some(EnergyFile::Class1) if any_energy => {
                return self.refuse(
                    path,
                    "comes from class 1, so eye safety is not idealised: take \"eye-safety\" off \
                     the list",
                );
            }
            Some(EnergyFile::Class1) => match strictest {
                Some(limit) => limit.energy,
                None => return self.refuse(path, NO_LIMIT),
            },
        };
        match strictest {
            _ if any_energy => Ok(energy),
            None => self.refuse(path, NO_LIMIT),
            Some(limit) if energy > limit.energy => {
                let message = format!(
                    "is {:.4} nJ a shot, but class 1 allows {:.4} nJ ({}); \"eye-safety\" in the \
                     list `idealised` lets it pass",
                    energy * 1e9,
                    limit.energy * 1e9,
                    limit.rule.name()
                );
                self.refuse(path, message)
            }
            Some(_) => Ok(energy),
        }
    }

    /// What class 1 allows; empty where we know no rule.
    fn limits(&self, safety: &SafetyFile, parts: &Parts) -> Result<Vec<Limit>, Error> {
        let distance = self.within("safety.distance_mm", safety.distance_mm, 1.0, 1e5)? * 1e-3;
        let Some(class) = Class1::at(parts.light.wavelength) else { return Ok(Vec::new()) };
        let Parts { scan, light, coding, .. } = parts;
        let count_groups = safety.count_lines;
        let sender = Sender { scan, light, coding, distance, count_groups };
        Ok(limits(&class, &exposure(&class, &sender)))
    }

    fn field(&self, optics: &OpticsFile, scan: &Scan) -> Result<Field, Error> {
        let (rows, columns) = (f64::from(scan.rows), f64::from(scan.columns));
        let (horizontal, vertical) = match &scan.pattern {
            Pattern::Raster { horizontal, vertical, .. }
            | Pattern::Flash { horizontal, vertical } => (*horizontal, *vertical),
            Pattern::Spinning { .. } => {
                return self.refuse(
                    "idealised",
                    "the link budget of a spinning sensor is not modelled: \"link-budget\" must \
                     be in this list",
                );
            }
        };
        let pixel = solid_angle(horizontal / columns, vertical / rows);
        let pixel_period = 1e3 / (scan.rate_millihertz as f64 * rows * columns);
        let trailing = |pixels: f64| Field {
            solid_angle: pixels * pixel,
            trailing: Some(Trailing { pixels, pixel_period }),
        };
        if matches!(scan.pattern, Pattern::Flash { .. }) {
            // Every pixel has a detector of its own.
            return Ok(Field { solid_angle: pixel, trailing: None });
        }
        Ok(match optics.field {
            FieldFile::Staring => {
                Field { solid_angle: solid_angle(horizontal, vertical), trailing: None }
            }
            FieldFile::Descanned => trailing(1.0),
            FieldFile::InFlight => trailing(1.0 + tof_from_range(scan.max_range) / pixel_period),
            FieldFile::TrailingPixels(pixels) => trailing(self.within(
                "optics.field.trailing_pixels",
                pixels,
                1.0,
                rows * columns,
            )?),
        })
    }
}

const NO_LIMIT: &str = "no limit of class 1 is known here, only for 700 to 1050 and 1400 to 1800 nm: \
                        declare \"eye-safety\" as idealised and give shot_nj";

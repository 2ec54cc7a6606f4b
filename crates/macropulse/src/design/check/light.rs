//! The light a sensor sends.

use super::Check;
use crate::design::file::SensorFile;
use crate::design::{Effect, Error, Light};
use crate::units::RMS_OF_FWHM;

impl Check<'_> {
    pub(super) fn light(
        &self,
        file: &SensorFile,
        off: impl Fn(Effect) -> bool,
    ) -> Result<Light, Error> {
        let light = &file.light;
        let footprint_off = off(Effect::Footprint);
        let rays = light.footprint_rays;
        if ![1, 7, 19].contains(&rays) {
            return self
                .refuse("light.footprint_rays", format!("is {rays}, but can be 1, 7 or 19"));
        }
        let divergence = self.within("light.divergence_mrad", light.divergence_mrad, 0.0, 500.0)?;
        if !footprint_off && (rays == 1 || divergence == 0.0) {
            return self.refuse(
                "light.footprint_rays",
                "the footprint is not idealised: it needs 7 or 19 rays and a divergence, \
                 or \"footprint\" in the list `idealised`",
            );
        }
        let pulse = self.within("light.pulse_ps", light.pulse_ps, 1e-3, 1e9)? * 1e-12;
        Ok(Light {
            wavelength: self.within("light.wavelength_nm", light.wavelength_nm, 200.0, 20e3)?
                * 1e-9,
            beam_diameter: self.within(
                "light.beam_diameter_mm",
                light.beam_diameter_mm,
                0.0,
                1e3,
            )? * 1e-3,
            divergence: if footprint_off { 0.0 } else { divergence * 1e-3 },
            footprint_rays: if footprint_off { 1 } else { rays },
            pulse,
            spread: (!off(Effect::InterChip)).then_some(pulse * RMS_OF_FWHM),
        })
    }
}

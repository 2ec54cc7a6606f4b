//! The light a sensor sends: `[light]`.

use std::f64::consts::PI;

use schemars::JsonSchema;
use serde::Deserialize;

use super::limits::Check;
use super::{Effect, Error, Scan};
use crate::units::RMS_OF_FWHM;

/// `[light]` as typed.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct LightFile {
    /// Wavelength, nm.
    #[schemars(range(min = 200, max = 20000))]
    wavelength_nm: f64,
    /// Diameter of the beam at the sensor, mm, at 1/e².
    #[schemars(range(min = 0, max = 1000))]
    beam_diameter_mm: f64,
    /// Divergence, mrad, full angle at 1/e²; of beams, not of a flash.
    #[schemars(range(min = 0, max = 500))]
    divergence_mrad: f64,
    /// Rays that stand for the footprint: 7 or 19 of a beam, 9 or 25 of the cell of a pixel of a flash; 1 if
    /// the list `idealised` names `footprint`.
    #[schemars(extend("enum" = [1, 7, 9, 19, 25]))]
    footprint_rays: u32,
    /// Length of a micropulse, ps, full width at half maximum; left out of light without pulses.
    #[schemars(range(min = 0.001, max = 1e9))]
    pulse_ps: Option<f64>,
    /// Spectral width of the laser's line, GHz, full width at half maximum: with it echoes have speckle; left
    /// out, each brings its mean.
    #[schemars(range(min = 0, max = 1e6))]
    linewidth_ghz: Option<f64>,
    /// Energy of a shot, the mean over its labels (of a flash, of a pixel); with a link budget.
    pub energy: Option<EnergyFile>,
}

/// The energy of a shot as typed.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) enum EnergyFile {
    /// The energy that laser class 1 allows.
    #[serde(rename = "class-1")]
    Class1,
    /// Energy, nJ.
    #[serde(rename = "shot_nj")]
    ShotNj(#[schemars(range(min = 1e-9, max = 1e12))] f64),
}

/// The light a sensor sends.
#[derive(Debug, Clone, PartialEq)]
pub struct Light {
    /// Wavelength, m.
    pub wavelength: f64,
    /// Beam diameter at the sensor (1/e²), m.
    pub beam_diameter: f64,
    /// Full divergence (1/e²), rad; of a flash, the diameter of a circle with the area of the cell of a
    /// pixel. Zero where the footprint is idealised away.
    pub divergence: f64,
    /// Rays that sample the footprint: 1, 7, 9, 19 or 25.
    pub footprint_rays: u32,
    /// Length of one micropulse (full width at half maximum), s; 0 of light without pulses.
    pub pulse: f64,
    /// Spectral width of the laser's line (full width at half maximum), Hz, where speckle is simulated.
    pub linewidth: Option<f64>,
    /// Its rms length, s, where its light is followed into neighbouring chips; `None` where it is
    /// taken to stay in its own.
    pub spread: Option<f64>,
}

impl Check<'_> {
    /// Checks the light. Its footprint is left out if nothing is known of the `scan`.
    pub(in crate::design) fn light(
        &self,
        light: &LightFile,
        is_pulsed: bool,
        scan: Option<&Scan>,
        off: impl Fn(Effect) -> bool,
    ) -> Result<Light, Error> {
        let footprint_off = off(Effect::Footprint);
        let (footprint_rays, divergence) = match scan {
            Some(scan) => self.footprint(light, scan, footprint_off)?,
            None => (1, 0.0),
        };
        let pulse = match light.pulse_ps {
            _ if !is_pulsed => 0.0,
            Some(typed) => self.within("light.pulse_ps", typed, 1e-3, 1e9)? * 1e-12,
            None => return Err(self.chain.lacks("light.pulse_ps", "missing field `pulse_ps`")),
        };
        let without = footprint_off || off(Effect::LinkBudget);
        let linewidth = light.linewidth_ghz.filter(|_| !without);
        let linewidth = linewidth
            .map(|width| self.within("light.linewidth_ghz", width, 0.0, 1e6))
            .transpose()?;
        Ok(Light {
            linewidth: linewidth.map(|width| width * 1e9),
            wavelength: self.within("light.wavelength_nm", light.wavelength_nm, 200.0, 20e3)?
                * 1e-9,
            beam_diameter: self.within(
                "light.beam_diameter_mm",
                light.beam_diameter_mm,
                0.0,
                1e3,
            )? * 1e-3,
            divergence,
            footprint_rays,
            pulse,
            spread: (!off(Effect::InterChip)).then_some(pulse * RMS_OF_FWHM),
        })
    }

    /// Returns the rays of a footprint and its divergence, rad.
    fn footprint(
        &self,
        light: &LightFile,
        scan: &Scan,
        is_idealised: bool,
    ) -> Result<(u32, f64), Error> {
        let (rays, divergence) = (light.footprint_rays, light.divergence_mrad);
        let mut divergence = self.within("light.divergence_mrad", divergence, 0.0, 500.0)? * 1e-3;
        let (few, many, of, needs) = match scan.model().flooded_cell() {
            Some([width, height]) => {
                divergence = 2.0 * (width * height / PI).sqrt();
                (9, 25, "a flash", "")
            }
            None => (7, 19, "a beam", " and a divergence"),
        };
        if ![1, few, many].contains(&rays) {
            let message = format!("is {rays}, but can be 1, {few} or {many} of {of}");
            return self.refuse("light.footprint_rays", message);
        }
        if !is_idealised && (rays == 1 || divergence == 0.0) {
            let message = format!(
                "the footprint is not idealised: it needs {few} or {many} rays{needs}, or \"footprint\" in \
                 the list `idealised`"
            );
            return self.refuse("light.footprint_rays", message);
        }
        Ok(if is_idealised { (1, 0.0) } else { (rays, divergence) })
    }
}

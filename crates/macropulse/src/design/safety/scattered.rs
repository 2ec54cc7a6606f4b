//! Beams in no lines that cross an aperture: of a table of directions, or a rosette.

use super::crossing::Energies;
use super::exposure::Crossing;
use super::share::Share;
use crate::design::Scan;

/// Beams at which the middle of an aperture is tried, evenly spread over a scan.
const TRIED: usize = 2048;

/// The beams of a scan, in the order in which they are sent.
pub(super) struct Scattered<'a> {
    pub scan: &'a Scan,
    /// Unit vectors.
    pub beams: &'a [[f64; 3]],
    pub energies: &'a Energies,
}

impl Scattered<'_> {
    /// The shots of the first scan that cross an aperture `distance` metres away whose middle is
    /// where, of all beams that are tried, most light crosses it.
    pub fn crossing(&self, share: &Share, distance: f64) -> Vec<Crossing> {
        let light = |aim: [f64; 3]| {
            let mut light = 0.0;
            self.for_each(share, (aim, distance), |shot, share| {
                light += share * self.energies.at(self.column(shot));
            });
            light
        };
        let tried = self.beams.iter().step_by(self.beams.len().div_ceil(TRIED).max(1));
        let brightest = tried.map(|aim| (light(*aim), *aim)).max_by(|a, b| a.0.total_cmp(&b.0));
        let mut shots = Vec::new();
        let Some((_, aim)) = brightest else { return shots };
        self.for_each(share, (aim, distance), |shot, share| {
            let energy = share * self.energies.at(self.column(shot));
            shots.push(Crossing { time: self.scan.moment(shot as u64), share, energy });
        });
        shots
    }

    fn column(&self, shot: usize) -> u32 {
        self.scan.model().pixel(shot as u64).1.into()
    }

    /// Calls `visit` with each shot of which light passes an aperture about `aim`, and its share.
    fn for_each(
        &self,
        share: &Share,
        (aim, distance): ([f64; 3], f64),
        mut visit: impl FnMut(usize, f64),
    ) {
        let reach = share.reach() / distance;
        // The cosine of the angle within which a beam meets the aperture.
        let least = 1.0 / (1.0 + reach * reach).sqrt();
        for (shot, beam) in self.beams.iter().enumerate() {
            let cosine: f64 = (0..3).map(|axis| aim[axis] * beam[axis]).sum();
            if cosine < least * (1.0 - 1e-12) {
                continue;
            }
            let off = distance * (1.0 - cosine * cosine).max(0.0).sqrt() / cosine;
            let passed = share.at(off);
            if passed > 0.0 {
                visit(shot, passed);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::design::Design;

    /// Known answer: where beams are sharp and the aperture holds all directions, a class 1 sensor
    /// of scattered beams may send in a shot what one of a raster with as many shots may.
    #[test]
    fn scattered_beams_that_all_cross_the_eye_count_as_those_of_a_raster() {
        let energy = |scan: &str| {
            let text = format!(
                "version = 1\nname = \"mine\"\nidealised = [\"footprint\", \"mirror-motion\"]\n\
                 scan.scans_per_s = 10.0\nscan.max_range_m = 30.0\n{scan}\n\
                 light = {{ wavelength_nm = 905.0, pulse_ps = 100.0, energy = \"class-1\" }}\n\
                 [optics]\naperture_mm = 3.0\ntransmission = 0.7\nfilter_nm = 1.0\n\
                 field = {{ cone_mrad = 1.0 }}\n[detector.geiger]\nefficiency = 0.1\n\
                 [tdc]\nresolution_ps = 100.0\n[receiver]\nkind = \"direct\"\n"
            );
            let folder = std::path::Path::new("");
            let design = Design::from_toml(&text, "mine.toml", folder, &[]).unwrap();
            design.budget.unwrap().energy
        };
        let raster = energy(
            "scan.raster = { rows = 100, columns = 200, horizontal_deg = 0.7, vertical_deg = 0.7 }",
        );
        let rosette = |deflection: f64| {
            energy(&format!(
                "scan.rosette = {{ shots_per_s = 200000.0, prisms = [{{ deflection_deg = \
                 {deflection}, turns_per_s = 70.0 }}, {{ deflection_deg = {deflection}, \
                 turns_per_s = -31.0 }}] }}"
            ))
        };
        approx::assert_relative_eq!(rosette(0.25), raster, max_relative = 1e-9);
        // Control: spread over 40 degrees fewer cross it.
        assert!(rosette(10.0) > 2.0 * raster);
    }
}

//! Beams in no lines that cross an aperture: of a table of directions, or a rosette.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::f64::consts::PI;

use super::energies::Energies;
use super::exposure::Crossing;
use super::share::Share;
use super::worst::{Aim, Field, coarse_first};
use crate::design::Scan;

/// Shots that a search may look at.
const EFFORT: usize = 600_000;

/// The beams of a scan, in the order in which they are sent.
pub(super) struct Scattered<'a> {
    scan: &'a Scan,
    /// Unit vectors.
    beams: &'a [[f64; 3]],
    energies: &'a Energies,
    share: &'a Share,
    distance: f64,
    /// Width of the cells into which the beams are sorted: what meets an aperture is in its cell or beside it.
    side: f64,
    cells: HashMap<[i32; 3], Vec<u32>>,
}

impl<'a> Scattered<'a> {
    /// The `beams` of `scan`, unit vectors, before an aperture `distance` metres away.
    pub fn new(
        scan: &'a Scan,
        (beams, energies): (&'a [[f64; 3]], &'a Energies),
        (share, distance): (&'a Share, f64),
    ) -> Self {
        let side = share.reach() / distance;
        let mut cells: HashMap<[i32; 3], Vec<u32>> = HashMap::new();
        for (beam, shot) in beams.iter().zip(0..) {
            cells.entry(cell(*beam, side)).or_default().push(shot);
        }
        Self { scan, beams, energies, share, distance, side, cells }
    }
}

/// The cell of a point.
fn cell(point: [f64; 3], side: f64) -> [i32; 3] {
    point.map(|along| (along / side).floor() as i32)
}

impl Field for Scattered<'_> {
    fn crossing(&self, aim: Aim) -> Vec<Crossing> {
        let [up, aside] = [aim.elevation, aim.azimuth];
        let cosine = libm::cos(up);
        let aim = [cosine * libm::cos(aside), cosine * libm::sin(aside), libm::sin(up)];
        let middle = cell(aim, self.side);
        let mut shots = Vec::new();
        for near in 0..27 {
            let beside = [near % 3 - 1, near / 3 % 3 - 1, near / 9 - 1];
            let at = [0, 1, 2].map(|axis| middle[axis] + beside[axis]);
            for &shot in self.cells.get(&at).into_iter().flatten() {
                let beam = self.beams[shot as usize];
                let cosine: f64 = (0..3).map(|axis| aim[axis] * beam[axis]).sum();
                if cosine <= 0.0 {
                    continue;
                }
                let off = self.distance * (1.0 - cosine * cosine).max(0.0).sqrt() / cosine;
                let share = self.share.at(off);
                if share > 0.0 {
                    let order = u64::from(shot);
                    let column = self.scan.model().pixel(order).1;
                    let energy = share * self.energies.at(column.into());
                    shots.push(Crossing { time: self.scan.moment(order), share, energy });
                }
            }
        }
        shots.sort_unstable_by(|a, b| a.time.total_cmp(&b.time));
        shots
    }

    /// All places within the width of an aperture of a beam.
    fn starts(&self, gap: f64, _: f64) -> Vec<Aim> {
        // As far apart as it takes to look at half the shots that may be.
        let crossed = PI * self.beams.len() as f64 / (EFFORT / 2) as f64;
        let gap = (2.0 * gap).max(self.side * crossed.sqrt());
        // Azimuths of a row of places are as far apart as they are at its elevation.
        let across = |row: i32| gap / libm::cos(f64::from(row) * gap).max(gap);
        let place = |[x, y, z]: &[f64; 3]| {
            let row = (libm::asin(z.clamp(-1.0, 1.0)) / gap).round() as i32;
            [row, (libm::atan2(*y, *x) / across(row)).round() as i32]
        };
        // A place that a beam goes to is tried at that beam.
        let mut lit: BTreeMap<[i32; 2], &[f64; 3]> = BTreeMap::new();
        for beam in self.beams {
            lit.entry(place(beam)).or_insert(beam);
        }
        let reach = (self.share.width() / self.distance / gap).ceil() as i32;
        let mut places = BTreeSet::new();
        for &[row, column] in lit.keys() {
            for near in row - reach..=row + reach {
                let middle = (f64::from(column) * across(row) / across(near)).round() as i32;
                places.extend((middle - reach..=middle + reach).map(|column| [near, column]));
            }
        }
        let aim = |place: &[i32; 2]| match lit.get(place) {
            Some([x, y, z]) => {
                Aim { elevation: libm::asin(z.clamp(-1.0, 1.0)), azimuth: libm::atan2(*y, *x) }
            }
            None => Aim {
                elevation: f64::from(place[0]) * gap,
                azimuth: f64::from(place[1]) * across(place[0]),
            },
        };
        coarse_first(&places.iter().map(aim).collect::<Vec<_>>())
    }

    /// None: places are tried at the beams already.
    fn shared(&self) -> Vec<Aim> {
        Vec::new()
    }

    /// None: places are tried close to each other.
    fn grazed(&self, _: Aim, _: f64) -> Vec<Aim> {
        Vec::new()
    }

    fn across(&self, _: f64) -> Vec<f64> {
        Vec::new()
    }

    fn pitch(&self, gap: f64) -> [f64; 2] {
        [gap; 2]
    }

    fn effort(&self) -> usize {
        EFFORT
    }
}

#[cfg(test)]
mod tests {
    use crate::design::Design;

    /// Known answer: if beams are sharp and the aperture holds all directions, class 1 allows a shot of
    /// scattered beams the energy of a shot of a raster. Both have the same number of shots.
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

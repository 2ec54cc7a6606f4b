//! Which shots of a scan cross an eye, and where it sees most light.

use std::f64::consts::FRAC_PI_4;

use super::beams::{LineBeams, Lines};
use super::class1::{Class1, Condition, Opening};
use super::energies::Energies;
use super::exposure::{Crossing, Crossings, Exposure, allowed};
use super::scattered::Scattered;
use super::share::Share;
use super::worst::worst;
use crate::design::budget::solid_angle;
use crate::design::{Emission, Light, Scan};
use crate::units::s_from_fs;

/// The beams of a scan, as eye safety counts them.
pub(crate) enum Beams {
    /// A beam for each pixel, line by line.
    Lines(Lines),
    /// All pixels at once: light spread evenly over a field of this width and height, rad.
    Flood([f64; 2]),
    /// One beam after the other in these directions, unit vectors, in no lines.
    Scattered(Vec<[f64; 3]>),
}

/// Who sends, and from how far away.
#[derive(Clone, Copy)]
pub(in crate::design) struct Sender<'a> {
    pub scan: &'a Scan,
    pub light: &'a Light,
    pub emission: &'a Emission,
    /// The place of the eye, and the width of the opening before it.
    pub condition: Condition,
    /// True if groups of shots that cross the eye count as repeated exposures.
    pub count_groups: bool,
}

/// Returns the exposure of an eye to `sender`, at the places where it sees most light.
pub(in crate::design) fn exposure(class: &Class1, sender: &Sender) -> Exposure {
    let Sender { scan, light, emission, .. } = sender;
    let energies = Energies::of(scan, emission.coding());
    let Condition { distance, widened } = sender.condition;
    let wide = |one: Opening| Opening { diameter: widened * one.diameter, ..one };
    let openings: Vec<Opening> = class.openings().into_iter().map(wide).collect();
    let shares: Vec<Share> = openings.iter().map(|opening| sender.share(opening)).collect();
    // One shot alone is judged in the middle of the first aperture.
    let passed = shares.first().map_or(1.0, |share| share.at(0.0));
    let mut exposure = Exposure {
        distance,
        scan_period: scan.period(),
        shot: light.pulse.max(s_from_fs(emission.length_fs())),
        mark: emission.part_fs().map_or(light.pulse, s_from_fs),
        brightest_shot: passed * energies.most(),
        brightest_mark: passed / emission.mean_parts(),
        count_groups: sender.count_groups,
        counted_as_one: emission.model().share_within(class.counted_as_one()),
        places: Vec::new(),
    };
    let beams = scan.model().beams();
    for (opening, share) in openings.iter().zip(&shares) {
        let durations = opening.durations;
        let judge = |shots: &[Crossing]| allowed(class, &exposure, durations, shots);
        let how = (libm::atan(share.width() / distance), class.counted_as_one());
        let places = match &beams {
            Beams::Flood(sides) => {
                let flash = sender.flood(opening, *sides, &energies);
                // A flash has no shot alone.
                if exposure.places.is_empty() {
                    exposure.brightest_shot = flash.energy;
                    exposure.brightest_mark = flash.share / emission.mean_parts();
                }
                vec![vec![flash]]
            }
            Beams::Scattered(beams) => {
                worst(&Scattered::new(scan, (beams, &energies), (share, distance)), how, &judge)
            }
            Beams::Lines(lines) => {
                let energies = &energies;
                worst(&LineBeams { scan, lines, energies, share, distance }, how, &judge)
            }
        };
        let crossings = places.into_iter().map(|shots| Crossings { durations, shots });
        exposure.places.extend(crossings);
    }
    exposure
}

impl Sender<'_> {
    /// The radius of the beam at 1/e² at the eye, m.
    fn spot(&self) -> f64 {
        (self.light.beam_diameter + self.light.divergence * self.condition.distance) / 2.0
    }

    fn share(&self, opening: &Opening) -> Share {
        Share::new(opening.diameter / 2.0, self.spot())
    }

    /// All pixels at once, their light spread evenly over a field of these `sides`, rad, at the
    /// distance of the eye; a source as wide as the beam widens it.
    fn flood(&self, opening: &Opening, sides: [f64; 2], energies: &Energies) -> Crossing {
        let field = solid_angle(sides[0], sides[1]);
        let wide = self.light.beam_diameter;
        let distance = self.condition.distance;
        let [across, down] = sides.map(|side| distance * side);
        let lit = field * distance * distance + (across + down) * wide + wide * wide;
        let seen = opening.diameter.min(across + wide) * opening.diameter.min(down + wide);
        let area = (FRAC_PI_4 * opening.diameter * opening.diameter).min(seen);
        let share = (area / lit).min(1.0);
        let pixels = f64::from(self.scan.rows) * f64::from(self.scan.columns);
        let energy = share * f64::from(self.scan.rows) * energies.sum();
        Crossing { time: 0.0, share: share * pixels, energy }
    }
}

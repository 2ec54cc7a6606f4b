//! The bill of a lidar: quantities by which one is compared with another.

use macropulse::design::Design;

use super::Error;
use super::candidate::Candidate;
use super::closed::energy;
use super::requirements::Requirements;

/// Highest power of a Gaussian pulse times its full width at half maximum, over its energy: √(4·ln 2/π).
const PEAK: f64 = 0.939_437_278_699_651_3;

/// Converter from the light of a channel to times.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Converter {
    /// An ADC, and logic that finds words and cancels what it has explained.
    AdcAndCanceller,
    /// A comparator and a TDC would do, although samples are simulated.
    ComparatorAndTdc,
}

impl Converter {
    /// Returns its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::AdcAndCanceller => "ADC and canceller",
            Self::ComparatorAndTdc => "comparator and TDC",
        }
    }
}

/// Quantities of a candidate, over all its channels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bill {
    /// Photodiodes, each with an amplifier and a converter of its own.
    pub channels: u32,
    /// Converter behind the amplifier of each channel.
    pub converter: Converter,
    /// Samples a second of all channels together; 0 where no ADC is needed.
    pub samples_per_s: f64,
    /// Area of all photodiodes, m², behind a lens whose focal length is its aperture: each sees a strip of its line as
    /// long as light may be under way.
    pub photodiodes: f64,
    /// Diameter of the lens, m.
    pub aperture: f64,
    /// Share of the time in which shots are fired.
    pub duty: f64,
    /// Diameter of the polygon, m, and speed of its corners, m/s.
    pub polygon: Option<(f64, f64)>,
    /// Energy of a shot, J.
    pub energy: f64,
    /// That over the energy which laser class 1 allows.
    pub of_class_1: f64,
    /// Highest power of all beams at once, W.
    pub peak: f64,
    /// Mean power of all beams, W.
    pub mean: f64,
}

impl Bill {
    pub(super) fn of(required: &Requirements, it: &Candidate) -> Result<Self, Error> {
        let design = it.unlimited(required)?;
        let wanted = &required.wanted;
        let pixels = f64::from(wanted.rows) * f64::from(wanted.columns);
        let channels = f64::from(it.beams);
        let converter = match it.waits() {
            true => Converter::ComparatorAndTdc,
            false => Converter::AdcAndCanceller,
        };
        let allowed = energy(&design, required).map(|energy| energy / required.parts.energy_share);
        Ok(Self {
            channels: it.beams,
            converter,
            samples_per_s: match converter {
                Converter::AdcAndCanceller => channels * 1e15 / design.clock.tick_fs as f64,
                Converter::ComparatorAndTdc => 0.0,
            },
            photodiodes: channels * it.aperture.powi(2) * field(&design),
            aperture: it.aperture,
            duty: it.facets.map_or(1.0 / required.burst, |facets| required.duty(facets)),
            polygon: it
                .facets
                .zip(it.tip_speed(required))
                .map(|(facets, speed)| (required.polygon(it.aperture, facets).diameter, speed)),
            energy: it.energy,
            of_class_1: allowed.map_or(f64::NAN, |allowed| it.energy / allowed),
            peak: channels * PEAK * it.energy / (f64::from(it.marks) * it.pulse),
            mean: it.energy * pixels * wanted.scans_per_s,
        })
    }
}

/// Solid angle, sr, that a channel of `design` looks at.
fn field(design: &Design) -> f64 {
    design.budget.as_ref().map_or(0.0, |budget| budget.field.solid_angle)
}

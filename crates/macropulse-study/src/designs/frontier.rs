//! Range and rate that each scheme reaches: the limits by light and by time.

use macropulse::predict::Forecaster;
use macropulse::units::{range_from_tof, tof_from_range};
use rayon::prelude::*;

use super::Error;
use super::candidate::Candidate;
use super::closed::{DIM, energy};
use super::requirements::{Requirements, Wanted};

/// Rates, over the one wanted.
const RATES: [f64; 6] = [0.125, 0.25, 0.5, 1.0, 2.0, 4.0];

/// Numbers of channels that are compared.
pub const CHANNELS: [u32; 7] = [1, 2, 4, 8, 16, 32, 64];

/// How bright targets are, over the one wanted; white at most.
const BRIGHTNESS: [f64; 3] = [1.0, 3.0, 8.0];

/// Relative tolerance of ranges.
const TOLERANCE: f64 = 0.01;

/// No nearer and no farther range is looked for, m.
const RANGES: (f64, f64) = (10.0, 3000.0);

/// Limits of a coded and a waiting lidar, with the parts of the best of each and the aperture of the coded
/// one.
#[derive(Debug, Clone, PartialEq)]
pub struct Frontier {
    /// Reflectances of the targets.
    pub reflectances: [f64; 3],
    /// From the slowest rate to the fastest.
    pub rows: Vec<Row>,
    /// Shortest time, s, between shots of a channel with which the coded one did, simulated.
    pub coded_period: f64,
    /// The same of the one that waits.
    pub waiting_period: f64,
    /// How far the one that waits sees, over how far light goes and comes in that time.
    pub waiting_share: f64,
    /// Share of the time in which the coded one fires shots, behind its mirror.
    pub coded_duty: f64,
    /// The same of the one that waits.
    pub waiting_duty: f64,
}

/// A rate.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Scans per second.
    pub scans_per_s: f64,
    /// Pixels per second.
    pub pixels_per_s: f64,
    /// How far light goes of the coded one, m, of each reflectance.
    pub coded: [f64; 3],
    /// How far light goes of the one that waits, m.
    pub waiting: [f64; 3],
    /// Channels that the coded one needs.
    pub coded_channels: f64,
    /// How far the one that waits has time to see with each of [`CHANNELS`], m.
    pub time: [f64; 7],
}

impl Frontier {
    pub(super) fn of(
        required: &Requirements,
        coded: &Candidate,
        waiting: &Candidate,
    ) -> Result<Self, Error> {
        let waiting = &Candidate { aperture: coded.aperture, ..waiting.clone() };
        let reflectances =
            BRIGHTNESS.map(|brightness| (brightness * required.wanted.reflectance).min(1.0));
        let designs = [coded.design(required)?, waiting.design(required)?];
        let [coded_period, waiting_period] =
            [&designs[0], &designs[1]].map(|design| design.scan.shortest_period());
        let pixels = f64::from(required.wanted.rows) * f64::from(required.wanted.columns);
        let mean_rate = pixels * required.wanted.scans_per_s;
        let duty = |period: f64, of: &Candidate| period * mean_rate / f64::from(of.beams);
        let (coded_duty, waiting_duty) = (duty(coded_period, coded), duty(waiting_period, waiting));
        let waiting_share = required.wanted.range_m / range_from_tof(waiting_period);
        let mut rows = Vec::new();
        for rate in RATES {
            let scans_per_s = rate * required.wanted.scans_per_s;
            let pixels_per_s = pixels * scans_per_s;
            let light =
                |candidate, period| reach(required, candidate, (scans_per_s, period), reflectances);
            let time = CHANNELS.map(|channels| {
                waiting_share * range_from_tof(f64::from(channels) * waiting_duty / pixels_per_s)
            });
            rows.push(Row {
                scans_per_s,
                pixels_per_s,
                coded: light(coded, coded_period)?,
                waiting: light(waiting, waiting_period)?,
                coded_channels: pixels_per_s * coded_period / coded_duty,
                time,
            });
        }
        Ok(Self {
            reflectances,
            rows,
            coded_period,
            waiting_period,
            waiting_share,
            coded_duty,
            waiting_duty,
        })
    }
}

/// Returns how far the light of `candidate` goes, m, for each reflectance, at another rate. The number of
/// channels is in proportion to the rate, and each shot is as bright as eyes allow at that rate. Only light
/// counts: no other shot is in flight, and gate and field of view are those of the range.
fn reach(
    required: &Requirements,
    candidate: &Candidate,
    (scans_per_s, period): (f64, f64),
    reflectances: [f64; 3],
) -> Result<[f64; 3], Error> {
    let with = |wanted| Requirements { wanted, ..required.clone() };
    let faster = with(Wanted { scans_per_s, ..required.wanted });
    // As dim as can be: at a faster rate eyes would not allow what it has.
    let dim = Candidate { energy: DIM, ..candidate.clone() };
    // Words that have no room at that rate with so few channels are asked about as single pulses of the same energy.
    let asked = dim.unlimited(&faster).or_else(|_| {
        let single = Candidate { words: None, ..dim.clone() };
        single.unlimited(&faster)
    })?;
    let allowed = energy(&asked, required).unwrap_or(candidate.energy);
    let beyond = required.wanted.clutter_m / required.wanted.range_m;
    let does = |reflectance: f64, range_m: f64| -> Result<bool, Error> {
        let clutter_m = beyond * range_m;
        let slower = (period / (2.0 * tof_from_range(clutter_m))).min(1.0);
        let scans_per_s = slower * required.wanted.scans_per_s;
        let alone = with(Wanted { range_m, clutter_m, scans_per_s, ..required.wanted });
        let design = candidate.unlimited(&alone)?;
        let forecaster = Forecaster::new(&design, &required.environment)?;
        let brighter = forecaster.with_light(allowed / candidate.energy);
        Ok(brighter.forecast(reflectance, range_m).pd >= required.wanted.pd)
    };
    let farthest = |reflectance: &f64| -> Result<f64, Error> {
        let (mut near, mut far) = RANGES;
        while far > (1.0 + TOLERANCE) * near {
            let middle = f64::sqrt(near * far);
            *(if does(*reflectance, middle)? { &mut near } else { &mut far }) = middle;
        }
        Ok(near)
    };
    let found: Vec<f64> = reflectances.par_iter().map(farthest).collect::<Result<_, _>>()?;
    Ok([found[0], found[1], found[2]])
}

//! Time, converters, light and the HDL-64E, by arithmetic on the sensors.

use std::f64::consts::{LN_2, PI};

use super::Error;
use crate::paper::walls::Wall;
use macropulse::channel::Link;
use macropulse::codec::statistics::binomial_tail;
use macropulse::design::safety::Class1;
use macropulse::design::{Design, Effect, Pattern};
use macropulse::emit::bands;
use macropulse::environment::Environment;
use macropulse::predict::Forecaster;
use macropulse::predict::link::{diffraction, spot_depth};
use macropulse::predict::multiple_access::word_reuse_range;
use macropulse::units::{range_from_tof, s_from_fs};

/// Shots in flight, as the paper counts them.
const IN_FLIGHT: usize = 25;

/// Conversions per second of one converter, as printed.
const CONVERSIONS_PER_S: f64 = 300e6;

/// Bits of one converter, as printed.
const CONVERTER_BITS: u32 = 10;

/// Shots, pixels and clocks.
#[derive(Debug, Clone)]
pub struct Timing {
    /// Mean time between shots.
    pub pixel_period: f64,
    /// Range gate.
    pub gate: f64,
    /// Rated range.
    pub rated_range: f64,
    /// Length of a macropulse.
    pub macropulse: f64,
    /// Scans per second of all its directions, without waiting.
    pub rate: f64,
    /// The same of one beam that waits for each echo.
    pub waiting_rate: f64,
    /// Shots in flight at the rated range.
    pub shots_in_flight: f64,
    /// Macropulses that arrive at any instant, on average.
    pub mean_overlap: f64,
    /// Range at which a word returns.
    pub word_range: f64,
    /// Range at which 25 words would return.
    pub range_of_25: f64,
    /// Range at which a column number returns.
    pub column_range: f64,
    /// A tick.
    pub tick: f64,
    /// A clock period.
    pub clock: f64,
    /// Range of a converter of 10 bits.
    pub conversion_range: f64,
    /// Duration of a scan.
    pub scan: f64,
    /// Time a resonant mirror spends on the middle pixel of a line.
    pub resonant_dwell: f64,
    /// Chips per second.
    pub chip_rate: f64,
    /// False detections per second with which a receiver that takes the first one still finds nine
    /// echoes of ten at the rated range.
    pub noise_first: f64,
    /// The same of one that takes the first mark for the beginning of a macropulse: none may come
    /// within a macropulse before the echo.
    pub noise_printed: f64,
    /// The same of one that matches whole macropulses, of those with the fewest marks.
    pub noise_matched: f64,
}

impl Timing {
    pub(super) fn of(design: &Design) -> Self {
        let derived = design.derived();
        let tick = s_from_fs(design.clock.tick_fs);
        let columns = f64::from(design.scan.columns);
        Self {
            pixel_period: derived.pixel_period,
            gate: derived.gate,
            rated_range: design.scan.rated_range,
            macropulse: derived.macropulse,
            rate: 1.0 / design.scan_period(),
            waiting_rate: derived.idle_listening_rate,
            shots_in_flight: derived.shots_in_flight,
            mean_overlap: derived.mean_overlap,
            word_range: derived.unambiguous_range.unwrap_or(f64::INFINITY),
            range_of_25: word_reuse_range(IN_FLIGHT as u32, derived.pixel_period),
            column_range: range_from_tof(columns * derived.pixel_period),
            tick,
            clock: s_from_fs(design.clock.period_fs),
            conversion_range: f64::from(1 << CONVERTER_BITS) * tick,
            scan: design.scan_period(),
            resonant_dwell: derived.pixel_period * 2.0 / PI,
            chip_rate: 1.0 / s_from_fs(design.emission.coding().chip_fs),
            noise_first: -libm::log(0.9) / derived.gate,
            noise_printed: -libm::log(0.9) / derived.macropulse,
            noise_matched: -libm::log1p(-bearable(derived.marks.0, derived.gate / tick)) / tick,
        }
    }
}

/// Returns the greatest share of places that chance may light. An answer needs all but a tenth of `marks` at
/// one of `places`; one false answer in 10⁴ shots is accepted.
fn bearable(marks: usize, places: f64) -> f64 {
    let least = marks - marks / 10;
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..50 {
        let middle = (low + high) / 2.0;
        let false_answers = places * binomial_tail(marks, middle, least);
        if false_answers <= 1e-4 { low = middle } else { high = middle }
    }
    low
}

/// The bank of converters.
#[derive(Debug, Clone)]
pub struct Converters {
    /// Converters.
    pub number: u32,
    /// Dead time of one.
    pub dead_time: f64,
    /// Time of one conversion at the rate printed.
    pub conversion: f64,
    /// Marks per second of 25 macropulses of nothing but 1 bits, on average.
    pub load: f64,
    /// Most marks that 25 successive shots can bring within a dead time, if their echoes come at
    /// the worst times.
    pub most_marks: u32,
    /// Ticks in a dead time: marks in the same one are one detection event.
    pub ticks: u32,
}

impl Converters {
    pub(super) fn of(design: &Design) -> Result<Self, Error> {
        let family = design.emission.coding().codebook.family();
        let density = family.weight() as f64 / f64::from(family.length());
        let tick = s_from_fs(design.clock.tick_fs);
        let tdc = design.readout.tdc().ok_or(Error::Sensor)?;
        let dead_time = s_from_fs(tdc.dead_fs);
        let ticks = tdc.dead_ticks(design.clock);
        Ok(Self {
            number: tdc.converters,
            dead_time,
            conversion: 1.0 / CONVERSIONS_PER_S,
            load: IN_FLIGHT as f64 * density / tick,
            most_marks: most_marks(design, ticks),
            ticks,
        })
    }
}

/// Returns the most marks of [`IN_FLIGHT`] successive shots, counted in the densest `chips` chips of each.
fn most_marks(design: &Design, chips: u32) -> u32 {
    let coding = design.emission.coding();
    let (columns, modulus) = (u64::from(design.scan.columns), u64::from(coding.word_modulus));
    // The sequence repeats once a row begins with the word that began an earlier row: after `modulus` rows at
    // most.
    let shots = columns * modulus + IN_FLIGHT as u64;
    let densest = |shot: u64| {
        let label = (shot % columns) as u16;
        let word = coding.first_word as u16 + (shot % modulus) as u16;
        let marks = coding.codebook.marks(label, word);
        let mut last = 0;
        let until = |(first, &mark): (usize, &u16)| {
            let end = u32::from(mark) + chips;
            while marks.get(last).is_some_and(|&next| u32::from(next) < end) {
                last += 1;
            }
            (last - first) as u32
        };
        marks.iter().enumerate().map(until).max().unwrap_or(0)
    };
    let most: Vec<u32> = (0..shots).map(densest).collect();
    most.windows(IN_FLIGHT).map(|window| window.iter().sum()).max().unwrap_or(0)
}

/// Beam, mirror, energy and what comes back.
#[derive(Debug, Clone)]
pub struct Light {
    /// Wavelength of the sensor.
    pub wavelength: f64,
    /// Angles between pixels, across and down.
    pub pitch: [f64; 2],
    /// Diameter of the beam where it leaves.
    pub beam: f64,
    /// Full angle to 1/e² by which diffraction spreads it.
    pub spread: f64,
    /// The same to half of the middle.
    pub spread_half: f64,
    /// How far it stays as wide as it leaves, to a factor of √2.
    pub collimated: f64,
    /// Sides of the mirror, as printed.
    pub mirror: [f64; 2],
    /// Angles by which the mirror turns to either side, across and down.
    pub mirror_turns: [f64; 2],
    /// Share of the beam that the mirror takes square on.
    pub mirror_takes: f64,
    /// The rated range.
    pub range: f64,
    /// Greatest tilt of a surface there that returns a chip whole.
    pub tilt: f64,
    /// Chips over which one is smeared there by a surface at 45°.
    pub smear: f64,
    /// True if the sensor leaves out the width of the beam.
    pub is_line: bool,
    /// True if it leaves out the limits of eye safety.
    pub is_unlimited: bool,
    /// True if it leaves out the bandwidth of the detector.
    pub is_unbounded: bool,
    /// Energy that class 1 leaves a macropulse.
    pub energy: f64,
    /// The same without the factor of repeated exposures.
    pub energy_lax: f64,
    /// Energy that class 1 allows one macropulse alone.
    pub energy_alone: f64,
    /// Mean power of class 1, in watts.
    pub power: f64,
    /// Energy of a macropulse that the sensitivity of the sensor stands for.
    pub energy_needed: f64,
    /// Photons of a macropulse from white at the rated range.
    pub photons: f64,
    /// The same of a mark.
    pub photons_per_mark: f64,
    /// The same as the sensor is declared.
    pub photons_declared: f64,
    /// Photons of sunlight in a chip.
    pub sunlight: f64,
    /// Probability that white at the rated range is seen by day.
    pub pd_by_day: f64,
    /// The same by night.
    pub pd_by_night: f64,
}

impl Light {
    pub(super) fn of(design: &Design) -> Result<Self, Error> {
        let Pattern::Raster(raster) = &design.scan.pattern else { return Err(Error::Sensor) };
        let grid = &raster.grid;
        let open = |counted: bool| {
            let set = [("safety.count_lines".to_owned(), counted.to_string())];
            Design::open("kim-park-2016-physical", &set)
        };
        let (honest, lax) = (open(true)?, open(false)?);
        let (Some(budget), Some(lax)) = (&honest.budget, &lax.budget) else {
            return Err(Error::Sensor);
        };
        let derived = design.derived();
        let day = Environment::default();
        let wavelength = design.light.wavelength;
        let beam = design.light.beam_diameter;
        let spread = diffraction(wavelength, beam);
        let range = design.scan.rated_range;
        let spot = spread * range;
        let through_air = Link::of(&honest, &day).transmission(range).powi(2);
        let photons = budget.photons(budget.energy, 1.0, range) * through_air;
        let per_mark = photons / derived.marks.1;
        // A declared sensitivity is that without air.
        let in_vacuum = budget.photons(budget.energy, 1.0, range) / derived.marks.1;
        let irradiance = day.irradiance(wavelength).unwrap_or(f64::NAN);
        let limits = Class1::at(wavelength);
        let by_day = Forecaster::new(&honest, &day)?;
        let sensor = ("kim-park-2016-physical", &honest);
        let by_night = Wall::of(sensor, (range, 1.0), "night", (SHOTS, SEED))?;
        let mirror = [1.1e-3, 1.2e-3];
        let takes = |side: f64| libm::erf(std::f64::consts::SQRT_2 * side / beam);
        Ok(Self {
            wavelength,
            pitch: [
                grid.horizontal / f64::from(grid.columns),
                grid.vertical / f64::from(grid.rows),
            ],
            beam,
            spread,
            spread_half: spread * (LN_2 / 2.0).sqrt(),
            collimated: PI * (beam / 2.0).powi(2) / wavelength,
            mirror,
            mirror_turns: [grid.horizontal / 4.0, grid.vertical / 4.0],
            mirror_takes: takes(mirror[0]) * takes(mirror[1]),
            range,
            tilt: libm::atan(derived.tick_range / spot),
            smear: spot_depth(spot, PI / 4.0) / derived.tick_range,
            is_line: design.idealised.contains(&Effect::Footprint),
            is_unlimited: design.idealised.contains(&Effect::EyeSafety),
            is_unbounded: design.idealised.contains(&Effect::DetectorBandwidth),
            energy: budget.energy,
            energy_lax: lax.energy,
            energy_alone: limits.map_or(f64::NAN, |l| l.single_exposure(derived.macropulse)),
            power: limits.map_or(f64::NAN, |l| l.continuous()),
            energy_needed: budget.energy * derived.reference_photons / in_vacuum,
            photons,
            photons_per_mark: per_mark,
            photons_declared: derived.reference_photons,
            sunlight: budget.background(irradiance, day.albedo)
                * s_from_fs(design.emission.coding().chip_fs),
            pd_by_day: by_day.forecast(1.0, range).pd,
            pd_by_night: by_night.seen,
        })
    }
}

/// Seed of the simulations for numbers on paper.
const SEED: u64 = 1;

/// Shots at the wall by night, about: nine of ten are then known to 0.7 %.
const SHOTS: u64 = 2_000;

/// The HDL-64E, as it is here and as its makers count.
#[derive(Debug, Clone)]
pub struct Head {
    /// Elevations of its lasers, in degrees, from the top.
    pub elevations: Vec<f64>,
    /// Shots that are fired at the same time, at most.
    pub at_once: usize,
    /// Time from the first to the last laser of an azimuth step.
    pub in_turn: f64,
    /// Azimuth step, in degrees.
    pub step: f64,
    /// Turns per second.
    pub turns: f64,
    /// Azimuth step, in degrees, of a unit that fires each laser 20 833 times a second and turns
    /// as fast.
    pub step_of_unit: f64,
}

/// Firings per second of each laser of an S2 unit, by its manual.
const FIRINGS_PER_S: f64 = 20_833.0;

impl Head {
    pub(super) fn of(design: &Design) -> Self {
        let elevations = match &design.scan.pattern {
            Pattern::Spinning(head) => head.elevations.iter().map(|e| e.to_degrees()).collect(),
            _ => Vec::new(),
        };
        let turns = 1.0 / design.scan_period();
        let log = bands(design, 0).next().map(|band| band.shot_log(design));
        let fired = log.map_or_else(Vec::new, |log| log.fired_at_fs[log.owned].to_vec());
        let at_once = fired.chunk_by(|a, b| a == b).map(<[i64]>::len).max().unwrap_or(0);
        let step = fired.get(..elevations.len()).unwrap_or(&[]);
        let in_turn = step.last().zip(step.first()).map_or(0, |(last, first)| last - first);
        Self {
            at_once,
            in_turn: s_from_fs(in_turn),
            step: 360.0 / f64::from(design.scan.columns),
            turns,
            step_of_unit: 360.0 * turns / FIRINGS_PER_S,
            elevations,
        }
    }
}

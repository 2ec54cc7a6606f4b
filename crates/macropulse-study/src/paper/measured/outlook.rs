//! Hopes of the paper's conclusion, tried on the ready sensors.

use super::Error;
use macropulse::codec::code::CodeWord;
use macropulse::design::Design;
use macropulse::environment::Environment;
use macropulse::predict::Forecaster;
use macropulse::predict::verdict::{Wanted, checks};
use macropulse::units::tof_from_range;

/// Hopes of the conclusion, in numbers.
#[derive(Debug, Clone)]
pub struct Outlook {
    /// Width of the field of the paper's sensor.
    pub field: f64,
    /// Directions and scans per second that it is to have.
    pub directions: (u32, u32, f64),
    /// Checks that the honest version of that sensor fails, each with the missing factor; empty if it closes.
    pub lacks: Vec<(&'static str, f64)>,
    /// Width of the field of `coded-360`.
    pub field_360: f64,
    /// Probability that `coded-practical` sees 10 % at the same range by day.
    pub practical_pd: f64,
    /// Part of a pixel period that one of its macropulses lasts.
    pub practical_macropulse: f64,
    /// Range at which its words return.
    pub practical_words: f64,
    /// Chips of `bipolar-gold`, in those of the paper.
    pub slower: f64,
    /// The greatest correlation of two different bipolar words of its family at any delay, over
    /// the peak.
    pub gold: f64,
    /// The same of Walsh words, which must be synchronous, without a delay.
    pub walsh_in_step: f64,
    /// And at any delay.
    pub walsh: f64,
    /// The ready sensors that never wait and close, at the paper's field, rate and range.
    pub closing: Vec<Closing>,
}

/// A lidar that never waits and closes by day at class 1.
#[derive(Debug, Clone)]
pub struct Closing {
    /// Name of the ready sensor.
    pub sensor: String,
    /// Its channels: beams with a detector and a converter each.
    pub channels: u32,
    /// Diameter of its aperture, m.
    pub aperture: f64,
    /// Probability that it sees 10 % at the range of the paper, by day, forecast.
    pub pd: f64,
    /// Checks of the budget that it fails, each with the missing factor; empty if it closes.
    pub lacks: Vec<(&'static str, f64)>,
    /// Channels that a lidar with the same mirror needs if it waits for echoes: from the range of the paper,
    /// and from as far as its light is followed.
    pub waiting: [u32; 2],
}

impl Closing {
    fn of(sensor: &str, range: f64, sky: &Environment) -> Result<Self, Error> {
        let design = Design::open(sensor, &[])?;
        let forecaster = Forecaster::new(&design, sky)?;
        let by_night = Forecaster::new(&design, &sky.at_night())?;
        let wanted = Wanted { reflectance: 0.1, range, pd: 0.9, false_points: 1e-4 };
        let found = checks(&forecaster, &by_night, &wanted);
        let lacks = found.iter().filter(|check| !check.holds());
        // The time between shots of one channel grows in proportion to the number of channels.
        let of_channel = design.scan.shortest_period() / f64::from(design.channels());
        let waits = |range: f64| (tof_from_range(range) / of_channel).ceil() as u32;
        Ok(Self {
            sensor: sensor.to_owned(),
            channels: design.channels(),
            aperture: design.budget.as_ref().map_or(f64::NAN, |budget| budget.aperture),
            pd: forecaster.forecast(0.1, range).pd,
            lacks: lacks.map(|check| (check.name, check.shortfall)).collect(),
            waiting: [range, design.scan.light_range].map(waits),
        })
    }
}

impl Outlook {
    pub(super) fn of(design: &Design) -> Result<Self, Error> {
        let range = design.scan.rated_range;
        let day = Environment::default();
        let honest = Design::open("kim-park-2016-physical", &[])?;
        let by_day = Forecaster::new(&honest, &day)?;
        let by_night = Forecaster::new(&honest, &day.at_night())?;
        let white = Wanted { reflectance: 1.0, range, pd: 0.9, false_points: 1e-4 };
        let found = checks(&by_day, &by_night, &white);
        let lacks = found.iter().filter(|check| !check.holds());
        let practical = Design::open("coded-practical", &[])?;
        let derived = practical.derived();
        let around = Design::open("coded-360", &[])?;
        let slow = Design::open("bipolar-gold", &[])?;
        let width = |design: &Design| {
            let [right, left] = design.scan.extent().azimuth;
            left - right
        };
        let (walsh_in_step, walsh) = greatest(&walsh_words(), 64);
        let gold: Vec<Signs> =
            slow.emission.coding().codebook.family().words().iter().map(signs).collect();
        Ok(Self {
            field: width(design),
            directions: (design.scan.columns, design.scan.rows, 1.0 / design.scan_period()),
            lacks: lacks.map(|check| (check.name, check.shortfall)).collect(),
            field_360: width(&around),
            practical_pd: Forecaster::new(&practical, &day)?.forecast(0.1, range).pd,
            practical_macropulse: derived.macropulse / derived.pixel_period,
            practical_words: derived.unambiguous_range.unwrap_or(f64::INFINITY),
            slower: slow.emission.coding().chip_fs as f64 / design.emission.coding().chip_fs as f64,
            gold: greatest(&gold, slow.emission.coding().codebook.family().length()).1,
            walsh_in_step,
            walsh,
            closing: ["coded-32", "coded-16"]
                .into_iter()
                .map(|sensor| Closing::of(sensor, range, &day))
                .collect::<Result<_, _>>()?,
        })
    }
}

/// A word of some length as bits: its lit chips are −1, the others +1.
type Signs = u128;

/// The greatest correlation of two different words of `length` chips over that length: without a
/// delay, and at any.
fn greatest(words: &[Signs], length: u32) -> (f64, f64) {
    let whole = (1 << length) - 1;
    let met = |own: Signs, other: Signs| length.abs_diff(2 * (own ^ other).count_ones());
    let (mut in_step, mut at_any) = (0, 0);
    for (i, &own) in words.iter().enumerate() {
        for &other in &words[..i] {
            in_step = in_step.max(met(own, other));
            let mut shifted = own;
            for _ in 0..length {
                at_any = at_any.max(met(shifted, other));
                shifted = (shifted << 1 | shifted >> (length - 1)) & whole;
            }
        }
    }
    (f64::from(in_step) / f64::from(length), f64::from(at_any) / f64::from(length))
}

fn signs(word: &CodeWord) -> Signs {
    word.marks.iter().fold(0, |signs, mark| signs | 1 << mark)
}

/// The 64 Walsh words of 64 chips: chip n of word k is −1 if k and n share an odd number of bits.
fn walsh_words() -> Vec<Signs> {
    let sign = |k: u32, n: u32| Signs::from((k & n).count_ones() % 2);
    (0..64).map(|k| (0..64).fold(0, |signs, n| signs | sign(k, n) << n)).collect()
}

//! The directions and the times at which the sensor looks: `[scan]`, and a scan pattern in it.
//!
//! Each pattern is one file: its keys and their limits (`Typed`), and its answers to what the
//! workbench asks of every pattern (`Model`). A new one is such a file and an entry in the list of
//! this page. No other module of this crate names one.

mod calibration;
mod directions;
mod flash;
mod grid;
mod hesai;
mod laser;
mod lissajous;
mod model;
mod ouster;
mod polygon;
mod raster;
mod rosette;
mod spinning;
mod steered;
mod table;

use std::ops::RangeInclusive;

use schemars::JsonSchema;
use serde::Deserialize;

pub use directions::Directions;
pub use flash::Flash;
pub use grid::Grid;
pub use laser::Laser;
pub use model::Extent;
pub(crate) use model::Model;
pub use polygon::Polygon;
pub use raster::{Mirror, Raster};
pub use spinning::{Firing, Spinning};
pub use steered::Steered;
pub use table::Table;

use super::Error;
use super::limits::{Check, Idle};

/// The list of all patterns: variant and its type, file in this folder, and name in a sensor file. Every other
/// list of them follows from this one.
macro_rules! patterns {
    ($($(#[$doc:meta])* $Kind:ident($Model:ident), $file:ident, $name:literal;)+) => {
        /// How directions follow each other.
        #[derive(Debug, Clone, PartialEq)]
        pub enum Pattern {
            $($(#[$doc])* $Kind($Model),)+
        }

        impl Pattern {
            /// Names of all patterns: each is a table `[scan.NAME]` of a sensor file.
            pub const NAMES: &[&str] = &[$($name),+];

            /// Returns the model of the pattern.
            pub(crate) fn model(&self) -> &dyn Model {
                match self {
                    $(Self::$Kind(pattern) => pattern,)+
                }
            }
        }

        /// `[scan]` as typed: its own keys, and a table for each pattern. A file has one of these tables.
        #[derive(Debug, Deserialize, JsonSchema)]
        #[serde(deny_unknown_fields)]
        pub(super) struct ScanFile {
            /// Scans per second, to a thousandth.
            #[schemars(range(min = 0.001, max = 1e5))]
            scans_per_s: f64,
            /// Nearest range accepted, m: at most where the range gate ends.
            #[schemars(range(min = 0))]
            min_range_m: f64,
            /// Rated range, m: what the sensor is declared to reach.
            #[schemars(range(min = 0.01, max = 1e5))]
            max_range_m: f64,
            /// How far the range gate goes on behind `max_range_m`, m.
            #[schemars(range(min = 0, max = 1e5))]
            gate_beyond_m: f64,
            /// Range to which the light of a shot is followed, m; twice the end of the range gate unless it
            /// is given. Light from beyond the gate falls into that of a later shot.
            #[schemars(range(max = 1e5))]
            light_range_m: Option<f64>,
            $($(#[$doc])* #[serde(rename = $name)] $file: Option<$file::File>,)+
        }

        impl ScanFile {
            /// The tables of patterns that the file has.
            fn patterns(&self) -> impl Iterator<Item = &dyn Typed> {
                let all = [$(self.$file.as_ref().map(|file| file as &dyn Typed),)+];
                all.into_iter().flatten()
            }

            /// The keys of patterns that mean nothing.
            pub(super) fn idle(&self) -> impl Iterator<Item = Idle> {
                self.patterns().filter_map(|pattern| pattern.idle())
            }
        }
    };
}

patterns! {
    /// A beam that a mirror leads over the field line by line, or several side by side.
    Raster(Raster), raster, "raster";
    /// Fixed elevations on a turning head.
    Spinning(Spinning), spinning, "spinning";
    /// Every direction at once.
    Flash(Flash), flash, "flash";
    /// A list of directions, scan after scan.
    Table(Table), table, "table";
    /// One beam through two prisms that turn.
    Rosette(Steered), rosette, "rosette";
    /// One beam from a mirror that swings about two axes.
    Lissajous(Steered), lissajous, "lissajous";
}

/// The table of a pattern in a sensor file.
trait Typed {
    /// The pattern in SI units, of a scan that lasts `period` seconds.
    ///
    /// # Errors
    /// If a value lies outside its limits.
    fn check(&self, check: &Check, period: f64) -> Result<Pattern, Error>;

    /// The key that means nothing, typed or not, because of another one.
    fn idle(&self) -> Option<Idle> {
        None
    }
}

/// The directions and the times at which the sensor looks.
#[derive(Debug, Clone, PartialEq)]
pub struct Scan {
    /// Rows of the range image.
    pub rows: u32,
    /// Columns of the range image.
    pub columns: u32,
    /// Scans in 1000 s: an integer, so that shot times are exact fractions.
    pub rate_millihertz: u64,
    /// Nearest range accepted, m.
    pub min_range: f64,
    /// Rated range: the range that the sensor is declared for, m.
    pub rated_range: f64,
    /// Farthest range accepted, m: the end of the range gate, at or beyond the rated range.
    pub max_range: f64,
    /// Range to which the light of a shot is followed, m: beyond the gate, because what returns
    /// from there arrives in the gates of later shots.
    pub light_range: f64,
    /// True if the mirror moves on during a macropulse.
    pub moves: bool,
    /// How directions follow each other.
    pub pattern: Pattern,
}

impl Scan {
    /// Returns a description of its pattern in a few words, for people.
    pub fn summary(&self) -> String {
        self.model().summary()
    }

    /// The polygon that leads the beams of a raster, if one does.
    pub fn polygon(&self) -> Option<(&Raster, &Polygon)> {
        match &self.pattern {
            Pattern::Raster(raster @ Raster { mirror: Mirror::Polygon(polygon), .. }) => {
                Some((raster, polygon))
            }
            _ => None,
        }
    }

    /// Returns the model of its pattern.
    pub(crate) fn model(&self) -> &dyn Model {
        self.pattern.model()
    }

    /// Shots in a scan.
    pub fn shots(&self) -> u64 {
        u64::from(self.rows) * u64::from(self.columns)
    }

    /// Number of separate detectors: one behind a single beam, one for each laser of a turning
    /// head, one for each pixel of a flash.
    pub fn channels(&self) -> u32 {
        self.model().channels()
    }

    /// Duration of one scan, s.
    pub fn period(&self) -> f64 {
        1000.0 / self.rate_millihertz as f64
    }

    /// Mean time between shots of the same detector, s.
    pub fn channel_period(&self) -> f64 {
        self.period() / self.shots() as f64 * f64::from(self.channels())
    }

    /// Shortest time between shots of the same detector, s: less than the mean where a mirror turns back
    /// between lines, or is fastest in the middle of them.
    pub fn shortest_period(&self) -> f64 {
        self.model().shortest_dwell(self.period() / self.shots() as f64)
    }

    /// Returns true if all shots of a scan are fired at one moment.
    pub fn is_one_flash(&self) -> bool {
        let moment = |order| self.model().moment(order, self.period());
        moment(0) == moment(self.shots() - 1)
    }

    /// Returns true if rows and columns are an image of the field, the same in every scan. Otherwise a row is
    /// a laser and the column counts its shots.
    pub fn has_image(&self) -> bool {
        self.model().is_lattice()
    }

    /// The pixel, row and column, in whose cell the unit vector `direction` of the sensor frame
    /// lies; `None` outside the field of view, and where the pattern is no lattice. A cell reaches half
    /// of the way to its neighbours.
    pub fn pixel_at(&self, direction: [f64; 3]) -> Option<(u16, u16)> {
        let [x, y, z] = direction;
        self.model().pixel_at(libm::atan2(y, x), libm::asin(z.clamp(-1.0, 1.0)))
    }

    /// The range gates of its shots.
    pub fn gates(&self) -> Gates<'_> {
        Gates { ranges: (self.min_range, self.max_range), offsets: self.model().range_offsets() }
    }

    /// The ranges at which a surface is within the gate of a shot to `row`, m.
    pub fn gate(&self, row: u16) -> RangeInclusive<f64> {
        self.gates().of(row)
    }

    /// Everything it looks at.
    pub fn extent(&self) -> Extent {
        self.model().extent()
    }

    /// Seconds from the beginning of a scan until the shot `order` is fired. The chip clock, for
    /// which a shot waits, is left out.
    pub(super) fn moment(&self, order: u64) -> f64 {
        let moment = self.model().moment(order, self.period());
        moment.shots as f64 / self.shots() as f64 * self.period() + moment.then
    }
}

/// The range gates of the shots of a scan: each is one of its clock, which starts too late for a laser with a
/// range offset.
#[derive(Debug, Clone, Copy)]
pub struct Gates<'a> {
    /// The nearest and the farthest range, m, of a laser without an offset.
    ranges: (f64, f64),
    /// By row, m; empty where there are none.
    offsets: &'a [f64],
}

impl Gates<'_> {
    /// How much is added to what a shot to `row` measures, m.
    #[inline]
    pub fn offset(&self, row: u16) -> f64 {
        self.offsets.get(usize::from(row)).copied().unwrap_or(0.0)
    }

    /// The ranges at which a surface is within the gate of a shot to `row`, m.
    #[inline]
    pub fn of(&self, row: u16) -> RangeInclusive<f64> {
        let (nearest, farthest) = self.ranges;
        nearest + self.offset(row)..=farthest + self.offset(row)
    }

    /// The same where it is that of all rows.
    pub fn of_all(&self) -> Option<RangeInclusive<f64>> {
        let (nearest, farthest) = self.ranges;
        self.offsets.is_empty().then_some(nearest..=farthest)
    }
}

/// Pixels of the largest range image: a scan of it takes some 4 GB.
const MOST_PIXELS: u64 = 1 << 25;

/// Light is followed to this multiple of the end of the range gate, unless the file says how far. This covers
/// all second-time-around returns that fall into the gate of the shot fired one gate later. From twice the
/// range a surface brings a quarter of the light at most.
const LIGHT_BEYOND_GATE: f64 = 2.0;

impl Check<'_> {
    pub(super) fn scan(&self, file: &ScanFile, moves: bool) -> Result<Scan, Error> {
        let rate = self.within("scan.scans_per_s", file.scans_per_s, 1e-3, 1e5)?;
        let rated_range = self.within("scan.max_range_m", file.max_range_m, 0.01, 1e5)?;
        let beyond = self.within("scan.gate_beyond_m", file.gate_beyond_m, 0.0, 1e5)?;
        let max_range = rated_range + beyond;
        let light_range = match file.light_range_m {
            Some(typed) => self.within("scan.light_range_m", typed, max_range, 1e5)?,
            None => LIGHT_BEYOND_GATE * max_range,
        };
        let min_range = self.within("scan.min_range_m", file.min_range_m, 0.0, max_range)?;
        let mut typed = file.patterns();
        let (Some(pattern), None) = (typed.next(), typed.next()) else {
            let all: Vec<String> =
                Pattern::NAMES.iter().map(|name| format!("[scan.{name}]")).collect();
            return self.refuse("scan", format!("needs exactly one of {}", all.join(", ")));
        };
        let rate_millihertz = (rate * 1e3).round() as u64;
        let pattern = pattern.check(self, 1000.0 / rate_millihertz as f64)?;
        if moves && pattern.model().moves_by().is_none() {
            return self.refuse(
                "idealised",
                "the motion of the beam is modelled for a raster alone: add \"mirror-motion\" to \
                 this list",
            );
        }
        let [rows, columns] = pattern.model().size();
        if u64::from(rows) * u64::from(columns) > MOST_PIXELS {
            let message = format!("{rows} x {columns} pixels are more than {MOST_PIXELS}");
            return self.refuse("scan", message);
        }
        Ok(Scan {
            rows,
            columns,
            rate_millihertz,
            min_range,
            rated_range,
            max_range,
            light_range,
            moves,
            pattern,
        })
    }
}

//! Returns to points: the cloud of one scan.
//!
//! A cloud is a list of returns. Each is named by its pixel and its number among the returns of that pixel's
//! shot. An organised image is a view of it, [`Image`]: one return of each pixel, the first, the strongest or
//! the last one ([`Pick`]).

mod columns;
mod image;
mod piece;
mod scale;

pub use columns::{Attribute, Entries};
pub(crate) use columns::{Extent, Field, Storage, angle};
pub use image::Image;
pub use macropulse_codec::decode::Pick;
pub use piece::Piece;
pub use scale::Scale;

use crate::design::Design;
use macropulse_codec::decode::Strength;
use std::borrow::Cow;

/// How a return or a pixel came out, measured against truth.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[repr(u8)]
pub enum Outcome {
    /// Nothing there, nothing answered; of pixels only.
    Empty = 0,
    /// Range right within the timing resolution.
    Right = 1,
    /// Off by more than the timing resolution, by 0.35 m at most: a code sidelobe.
    Near = 2,
    /// Off by more than that.
    Wrong = 3,
    /// A surface within the range gate gave no return; of pixels only.
    Missed = 4,
    /// An answer where no surface is.
    False = 5,
    /// An answer from a surface beside the pixel, which a part of the macropulse met while the
    /// mirror moved on.
    Edge = 6,
}

impl Outcome {
    /// All outcomes, in the order of their numbers.
    pub const ALL: [Self; 7] =
        [Self::Empty, Self::Right, Self::Near, Self::Wrong, Self::Missed, Self::False, Self::Edge];

    /// Name used in files and reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Empty => "empty",
            Self::Right => "right",
            Self::Near => "near",
            Self::Wrong => "wrong",
            Self::Missed => "missed",
            Self::False => "false",
            Self::Edge => "edge",
        }
    }
}

/// One scan as a list of returns, in the order in which their shots were fired; returns of one shot stand
/// nearest first. They are decoded in this order, so nothing is sorted on the way.
///
/// All columns have one entry per return, except those of pixels, which have `rows` × `columns`
/// entries, row-major, row 0 at the top and column 0 at the left. A simulated cloud has all columns.
/// A cloud that was read has those of its file: x, y and z, and of the others each may be absent,
/// which is an empty column beside points.
///
/// Sensor frame (REP-103): x forward, y left, z up, metres. Each point of a sensor that moves is in
/// its frame at the time of that point: raw, not deskewed.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PointCloud {
    /// Number of the scan, from 0.
    pub scan: u64,
    /// When the scan was taken, ns of Unix time, of a cloud whose file tells it; its times then count
    /// from there.
    pub stamp_ns: Option<u64>,
    /// Place and attitude of the sensor at the start of the scan.
    pub viewpoint: Viewpoint,
    /// Rows of pixels; 0 where the list has no image.
    pub rows: usize,
    /// Columns of pixels; 0 where the list has no image.
    pub columns: usize,
    /// Returns that a shot may have at most.
    pub returns_per_shot: u8,
    /// Which return of a pixel its image shows.
    pub pick: Pick,
    /// Set if the sensor measures radial velocities: it tells if a cloud without returns has their column.
    pub has_speeds: bool,
    /// Row of the pixel.
    pub row: Vec<u16>,
    /// Column of the pixel.
    pub column: Vec<u16>,
    /// Number among the returns of the shot, from 1, the nearest first.
    pub return_number: Vec<u8>,
    /// Returns of the shot.
    pub number_of_returns: Vec<u8>,
    /// Forward, m; rounded where [`PointCloud::exact`] has more digits.
    pub x: Vec<f32>,
    /// Left, m; rounded like x.
    pub y: Vec<f32>,
    /// Up, m; rounded like x.
    pub z: Vec<f32>,
    /// Coordinates and ranges with all digits, of a cloud whose file has more than 32-bit floats hold.
    pub exact: Exact,
    /// Apparent reflectance, 1 = white Lambertian facing the sensor, by range, link and its own
    /// energy estimate ([`Scale`]), 10⁶ at most; a lower bound where it is `saturated`.
    pub intensity: Vec<f32>,
    /// Set if the detector cannot tell the amount of light: no mark was missed, and no amplitude is measured.
    pub saturated: Vec<bool>,
    /// One-way range, m; rounded where [`PointCloud::exact`] has more digits.
    pub range: Vec<f32>,
    /// Time at which the shot was fired, ns from the beginning of the first scan, or from the stamp of a
    /// cloud that has one.
    pub time_ns: Vec<f64>,
    /// Marks found at their place.
    pub peak: Vec<u16>,
    /// Marks the macropulse has.
    pub marks: Vec<u16>,
    /// Peak minus the best other lag.
    pub margin: Vec<u16>,
    /// Radial velocity, m/s, positive towards the sensor; empty of a sensor that measures none.
    pub radial_velocity: Vec<f32>,
    /// Energy as the receiver can tell it, in detected photons per mark. Not written to files, so
    /// absent in a cloud read from one.
    pub photons: Vec<f32>,
    /// For every pixel, whether it answered or not, the time at which its shot was fired, ns from
    /// the start of the scan; NaN where none was.
    pub fired_ns: Vec<f64>,
    /// Values known from the scene; filled by the score stage, empty without it.
    pub truth: Truth,
}

/// Coordinates and ranges as 64-bit floats, m. A column is empty where 32-bit floats hold all digits;
/// x, y and z are there together.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Exact {
    /// Forward, m.
    pub x: Vec<f64>,
    /// Left, m.
    pub y: Vec<f64>,
    /// Up, m.
    pub z: Vec<f64>,
    /// One-way range, m.
    pub range: Vec<f64>,
}

/// Place and attitude of the sensor in the world at the start of a scan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Viewpoint {
    /// Position, m.
    pub position: [f64; 3],
    /// The turn that carries directions of the sensor frame into the world, as a unit quaternion
    /// w, x, y, z.
    pub turn: [f64; 4],
}

impl Default for Viewpoint {
    /// At the origin, not turned.
    fn default() -> Self {
        Self { position: [0.0; 3], turn: [1.0, 0.0, 0.0, 0.0] }
    }
}

/// The truth beside a point cloud.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Truth {
    /// For every return, the surface it came from, or else the first one along the beam within the range
    /// gate; and its outcome.
    pub returns: Surfaces,
    /// How every pixel came out, by the return that its image shows; and of those without a return the
    /// first surface along the beam within the range gate.
    pub pixels: Surfaces,
    /// For every return, the radial velocity of the surface beside it, m/s, positive towards the sensor; NaN
    /// if there is none. Empty for a sensor whose light does not show it.
    pub radial_velocity: Vec<f32>,
}

/// Surfaces that were seen or could have been, as columns.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Surfaces {
    /// Range, m; NaN where there is none.
    pub range: Vec<f32>,
    /// Index into the scene's objects; `NO_OBJECT` where there is none.
    pub object: Vec<u16>,
    /// Index into the scene's materials; `NO_OBJECT` where there is none.
    pub material: Vec<u16>,
    /// Cosine of the incidence angle; NaN where there is none.
    pub cosine: Vec<f32>,
    /// How the return or the pixel came out.
    pub outcome: Vec<Outcome>,
}

/// A surface that was seen or could have been: a line of [`Surfaces`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Surface {
    /// Range, m; NaN where there is none.
    pub range: f32,
    /// Index into the scene's objects; `NO_OBJECT` where there is none.
    pub object: u16,
    /// Index into the scene's materials; `NO_OBJECT` where there is none.
    pub material: u16,
    /// Cosine of the incidence angle; NaN where there is none.
    pub cosine: f32,
    /// How the return or the pixel came out.
    pub outcome: Outcome,
}

impl Surface {
    /// No surface, and no answer.
    pub const NONE: Self = Self {
        range: f32::NAN,
        object: NO_OBJECT,
        material: NO_OBJECT,
        cosine: f32::NAN,
        outcome: Outcome::Empty,
    };
}

impl Surfaces {
    /// Adds a line.
    pub fn push(&mut self, surface: Surface) {
        self.range.push(surface.range);
        self.object.push(surface.object);
        self.material.push(surface.material);
        self.cosine.push(surface.cosine);
        self.outcome.push(surface.outcome);
    }

    /// Line `at`.
    pub fn at(&self, at: usize) -> Surface {
        Surface {
            range: self.range[at],
            object: self.object[at],
            material: self.material[at],
            cosine: self.cosine[at],
            outcome: self.outcome[at],
        }
    }

    /// Replaces line `at`.
    #[inline]
    pub(crate) fn set(&mut self, at: usize, surface: Surface) {
        self.range[at] = surface.range;
        self.object[at] = surface.object;
        self.material[at] = surface.material;
        self.cosine[at] = surface.cosine;
        self.outcome[at] = surface.outcome;
    }

    /// Makes it `lines` lines of [`Surface::NONE`], in the memory of the old ones.
    pub(crate) fn blank(&mut self, lines: usize) {
        self.clear();
        let Surface { range, object, material, cosine, outcome } = Surface::NONE;
        self.range.resize(lines, range);
        self.object.resize(lines, object);
        self.material.resize(lines, material);
        self.cosine.resize(lines, cosine);
        self.outcome.resize(lines, outcome);
    }

    /// Forgets all lines, and keeps their memory.
    fn clear(&mut self) {
        self.range.clear();
        self.object.clear();
        self.material.clear();
        self.cosine.clear();
        self.outcome.clear();
    }
}

/// Flag of a return with fewer than half of its marks.
pub const FAINT: u8 = 1;

/// Flag of a return with a rival: another lag had the same number of marks.
pub const AMBIGUOUS: u8 = 2;

/// Flag of a return with all marks found: its intensity is a lower bound.
pub const SATURATED: u8 = 4;

/// Object and material index of a pixel that met nothing.
pub const NO_OBJECT: u16 = u16::MAX;

impl PointCloud {
    /// A cloud of scan number `scan` without any return or pixel yet, nor the truth.
    pub fn empty(design: &Design, scan: u64) -> Self {
        let (rows, columns) = (design.scan.rows as usize, design.scan.columns as usize);
        Self {
            scan,
            rows,
            columns,
            returns_per_shot: design.receiver.returns,
            pick: design.receiver.pick,
            has_speeds: design.measures_speed(),
            ..Self::default()
        }
    }

    /// Number of returns.
    pub fn returns(&self) -> usize {
        self.x.len()
    }

    /// Tells if a column of returns with this many entries is there. All columns of a cloud without returns
    /// are.
    pub fn has(&self, entries: usize) -> bool {
        entries > 0 || self.returns() == 0
    }

    /// Tells if the truth stands beside the measurement.
    pub fn has_truth(&self) -> bool {
        !(self.truth.pixels.outcome.is_empty() && self.truth.returns.outcome.is_empty())
    }

    /// Coordinates x, y, z of return `at`, m, with all digits that are known.
    pub fn position(&self, at: usize) -> [f64; 3] {
        let Exact { x, y, z, .. } = &self.exact;
        match (x.get(at), y.get(at), z.get(at)) {
            (Some(&x), Some(&y), Some(&z)) => [x, y, z],
            _ => [self.x[at], self.y[at], self.z[at]].map(f64::from),
        }
    }

    /// Range of return `at`, m: the measured one or, where the cloud has none, the distance of the
    /// point from the origin.
    pub fn distance(&self, at: usize) -> f64 {
        let measured = self.range.get(at).map(|&range| f64::from(range));
        self.exact.range.get(at).copied().or(measured).unwrap_or_else(|| {
            let [x, y, z] = self.position(at);
            libm::hypot(libm::hypot(x, y), z)
        })
    }

    /// Ranges of all returns, m, as [`PointCloud::distance`] has them.
    pub fn distances(&self) -> Cow<'_, [f32]> {
        if self.has(self.range.len()) {
            return Cow::Borrowed(&self.range);
        }
        Cow::Owned((0..self.returns()).map(|at| self.distance(at) as f32).collect())
    }

    /// Marks of return `at` as bits: [`FAINT`], [`AMBIGUOUS`], [`SATURATED`]; 0 for a sound return that
    /// tells how bright it is. A bit whose columns the cloud lacks is not set: nobody judged the point.
    pub fn flags(&self, at: usize) -> u8 {
        let faint = match (self.peak.get(at), self.marks.get(at)) {
            (Some(&peak), Some(&marks)) => 2 * u32::from(peak) < u32::from(marks),
            _ => false,
        };
        let ambiguous = self.margin.get(at) == Some(&0);
        let saturated = self.saturated.get(at) == Some(&true);
        let bits = [(faint, FAINT), (ambiguous, AMBIGUOUS), (saturated, SATURATED)];
        bits.into_iter().map(|(is_set, bit)| u8::from(is_set) * bit).sum()
    }

    /// One return of each pixel, by `pick`.
    pub fn image(&self, pick: Pick) -> Image {
        Image::of(self, pick)
    }

    /// The quantities that decide if return `at` is the strongest of its shot.
    pub(crate) fn strength(&self, at: usize) -> Strength {
        let peak = self.peak.get(at).copied().unwrap_or_default();
        // A file keeps no photons, but what follows from them.
        let photons = self.photons.get(at).filter(|photons| !photons.is_nan());
        let light = photons.or(self.intensity.get(at)).copied();
        Strength { peak, light: light.unwrap_or_default() }
    }
}

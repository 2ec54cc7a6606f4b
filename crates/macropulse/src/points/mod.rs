//! Returns to points: the organised cloud of one scan.

use crate::channel::Link;
use crate::design::Design;
use crate::units::range_from_tof;
use macropulse_codec::ShotLog;
use macropulse_codec::decode::Returns;

/// How a pixel came out, measured against truth.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[repr(u8)]
pub enum Outcome {
    /// Nothing there, nothing answered.
    Empty = 0,
    /// Range right within the timing resolution.
    Right = 1,
    /// Off by more than the timing resolution, by 0.35 m at most: a code sidelobe.
    Near = 2,
    /// Off by more than that.
    Wrong = 3,
    /// A surface within the range gate gave no return.
    Missed = 4,
    /// An answer where no surface is.
    False = 5,
}

impl Outcome {
    /// All outcomes, in the order of their numbers.
    pub const ALL: [Self; 6] =
        [Self::Empty, Self::Right, Self::Near, Self::Wrong, Self::Missed, Self::False];

    /// Name used in files and reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Empty => "empty",
            Self::Right => "right",
            Self::Near => "near",
            Self::Wrong => "wrong",
            Self::Missed => "missed",
            Self::False => "false",
        }
    }
}

/// One scan as an organised cloud: `rows` × `columns` entries, row-major, row 0 at the top and
/// column 0 at the left. A pixel without a return is NaN in x, y, z, range and intensity.
///
/// Sensor frame (REP-103): x forward, y left, z up, metres. Each point of a sensor that moves is in
/// its frame at the time of that point: raw, not deskewed.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PointCloud {
    /// Number of the scan, from 0.
    pub scan: u64,
    /// Rows of the organised cloud.
    pub rows: usize,
    /// Columns of the organised cloud.
    pub columns: usize,
    /// Where the sensor was when the scan began.
    pub viewpoint: Viewpoint,
    /// Forward, m.
    pub x: Vec<f32>,
    /// Left, m.
    pub y: Vec<f32>,
    /// Up, m.
    pub z: Vec<f32>,
    /// Apparent reflectance, 1 = white Lambertian facing the sensor, range and its own energy
    /// estimate taken into account; NaN where there is no return.
    pub intensity: Vec<f32>,
    /// One-way range, m.
    pub range: Vec<f32>,
    /// Time at which the shot was fired, ns from the beginning of the first scan; set for every pixel.
    pub time_ns: Vec<f64>,
    /// Marks found at their place.
    pub peak: Vec<u16>,
    /// Marks the macropulse has.
    pub marks: Vec<u16>,
    /// Peak minus the best other lag.
    pub margin: Vec<u16>,
    /// What is known from the scene; filled by the score stage, empty without it.
    pub truth: Truth,
}

/// Where the sensor was in the world when a scan began.
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

/// The truth beside a point cloud, one entry per pixel.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Truth {
    /// Range of the surface the return came from, or else of the first one within the range gate,
    /// m; NaN where there is none.
    pub range: Vec<f32>,
    /// Index into the scene's objects; `NO_OBJECT` where there is none.
    pub object: Vec<u16>,
    /// Index into the scene's materials; `NO_OBJECT` where there is none.
    pub material: Vec<u16>,
    /// Cosine of the incidence angle; NaN where there is none.
    pub cosine: Vec<f32>,
    /// How the pixel came out.
    pub outcome: Vec<Outcome>,
}

/// Flag of a return with fewer than half of its marks.
pub const FAINT: u8 = 1;

/// Flag of a return for which another lag had as many marks.
pub const AMBIGUOUS: u8 = 2;

/// Object and material index of a pixel that met nothing.
pub const NO_OBJECT: u16 = u16::MAX;

impl PointCloud {
    /// A cloud of scan number `scan` without any return yet.
    pub fn empty(design: &Design, scan: u64) -> Self {
        let (rows, columns) = (design.scan.rows as usize, design.scan.columns as usize);
        let none = vec![f32::NAN; rows * columns];
        let zero = vec![0; rows * columns];
        Self {
            scan,
            rows,
            columns,
            viewpoint: Viewpoint::default(),
            x: none.clone(),
            y: none.clone(),
            z: none.clone(),
            intensity: none.clone(),
            range: none,
            time_ns: vec![f64::NAN; rows * columns],
            peak: zero.clone(),
            marks: zero.clone(),
            margin: zero,
            truth: Truth::default(),
        }
    }

    /// Makes it the cloud of scan number `scan`, without any return, in the same memory.
    pub fn clear(&mut self, scan: u64) {
        self.scan = scan;
        let columns = [&mut self.x, &mut self.y, &mut self.z, &mut self.intensity, &mut self.range];
        columns.into_iter().for_each(|column| column.fill(f32::NAN));
        self.time_ns.fill(f64::NAN);
        let columns = [&mut self.peak, &mut self.marks, &mut self.margin];
        columns.into_iter().for_each(|column| column.fill(0));
        let truth = &mut self.truth;
        [&mut truth.range, &mut truth.cosine].into_iter().for_each(|column| column.fill(f32::NAN));
        let columns = [&mut truth.object, &mut truth.material];
        columns.into_iter().for_each(|column| column.fill(NO_OBJECT));
        truth.outcome.fill(Outcome::Empty);
    }

    /// Index of the pixel of shot `shot`.
    pub fn pixel(&self, log: &ShotLog, shot: usize) -> usize {
        usize::from(log.row[shot]) * self.columns + usize::from(log.column[shot])
    }

    /// Writes the returns of one band, and the firing times of its owned shots, into the cloud.
    ///
    /// Intensity, by the `link` of the sensor through its air, is the photons a mark brought over the photons a white surface seen square on
    /// would have brought from the same range; 1 for a detector without a photon scale.
    pub fn add(&mut self, design: &Design, link: &Link, log: &ShotLog, returns: &Returns) {
        for shot in log.owned.clone() {
            let pixel = self.pixel(log, shot);
            self.time_ns[pixel] = log.fired_at_fs[shot] as f64 * 1e-6;
        }
        let directions = design.directions();
        for (i, &shot) in returns.shot.iter().enumerate() {
            let shot = shot as usize;
            let pixel = self.pixel(log, shot);
            let range = range_from_tof(returns.tof[i]);
            let [x, y, z] = directions.of(log.row[shot], log.column[shot]);
            self.x[pixel] = (x * range) as f32;
            self.y[pixel] = (y * range) as f32;
            self.z[pixel] = (z * range) as f32;
            self.range[pixel] = range as f32;
            let white = link.photons(1.0, range);
            self.intensity[pixel] = if white.is_finite() {
                (f64::from(returns.photons[i]) / white) as f32
            } else {
                1.0
            };
            self.peak[pixel] = returns.peak[i];
            self.marks[pixel] = returns.marks[i];
            self.margin[pixel] = returns.margin[i];
        }
    }

    /// What is to be known of the return of a pixel, as bits: [`FAINT`], [`AMBIGUOUS`]; 0 for a
    /// sound return, and for a pixel without one.
    pub fn flags(&self, pixel: usize) -> u8 {
        if self.range[pixel].is_nan() {
            return 0;
        }
        let faint = 2 * self.peak[pixel] < self.marks[pixel];
        let ambiguous = self.margin[pixel] == 0;
        (u8::from(faint) * FAINT) | (u8::from(ambiguous) * AMBIGUOUS)
    }

    /// Number of pixels that have a return.
    pub fn returns(&self) -> usize {
        self.range.iter().filter(|range| !range.is_nan()).count()
    }
}

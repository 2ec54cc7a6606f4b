//! Returns to points.

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

/// One scan as an organised cloud: `rows` × `columns` entries, row-major, row 0 at the top and
/// column 0 at the left. A pixel without a return is NaN in x, y, z, range and intensity.
///
/// Sensor frame (REP-103): x forward, y left, z up, metres.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PointCloud {
    /// Number of the scan, from 0.
    pub scan: u64,
    /// Rows of the organised cloud.
    pub rows: usize,
    /// Columns of the organised cloud.
    pub columns: usize,
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
    /// Time at which the shot was fired, ns from the start of the scan; set for every pixel.
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

/// The truth beside a point cloud, one entry per pixel.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Truth {
    /// Range of the first surface within the range gate, m; NaN where there is none.
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

/// Object and material index of a pixel that met nothing.
pub const NO_OBJECT: u16 = u16::MAX;

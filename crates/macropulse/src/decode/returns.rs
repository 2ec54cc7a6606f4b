//! What decoding gives: the seam between the receiver and the points.

/// Why a shot or a found macropulse gave no return. Counted, never an error.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Reject {
    /// No lag in the range gate reached the threshold.
    NoPeak,
    /// The checksum did not fit the label bits.
    Crc,
    /// The label is legal but no such shot was in flight.
    UnknownShot,
    /// The macropulse carries other bits than the shot it would belong to.
    LabelMismatch,
    /// The return lies outside the range gate.
    OutsideGate,
}

impl Reject {
    /// All kinds, in the order in which they are counted.
    pub const ALL: [Self; 5] =
        [Self::NoPeak, Self::Crc, Self::UnknownShot, Self::LabelMismatch, Self::OutsideGate];

    /// Name used in manifests and reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::NoPeak => "no_peak",
            Self::Crc => "crc",
            Self::UnknownShot => "unknown_shot",
            Self::LabelMismatch => "label_mismatch",
            Self::OutsideGate => "outside_gate",
        }
    }
}

/// Decoded measurements of the home shots of a band, as columns, at most one per shot, ordered by
/// shot; and the count of what was rejected.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Returns {
    /// Index of the shot in the band's log.
    pub shot: Vec<u32>,
    /// Two-way time of flight, s.
    pub tof: Vec<f64>,
    /// Marks found at their place (correlation peak).
    pub peak: Vec<u16>,
    /// Marks the macropulse has.
    pub marks: Vec<u16>,
    /// Peak minus the best other lag the receiver looked at.
    pub margin: Vec<u16>,
    /// Energy as the receiver can tell it, in detected photons per mark.
    pub photons: Vec<f32>,
    /// Rejects by kind, in the order of [`Reject::ALL`].
    pub rejects: [u64; Reject::ALL.len()],
}

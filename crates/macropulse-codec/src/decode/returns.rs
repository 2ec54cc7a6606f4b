//! The results of decoding: the seam between the receiver and the points.

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

/// Decoded measurements of the owned shots of a band, as columns, ordered by shot, then by time of flight;
/// and the count of what was rejected. A shot has [`super::Receiver::returns`] measurements at most.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Returns {
    /// Index of the shot in the band's log.
    pub shot: Vec<u32>,
    /// Number of the return among those of its shot, from 1, the nearest first.
    pub number: Vec<u8>,
    /// Two-way time of flight, s.
    pub tof: Vec<f64>,
    /// Marks found at their place (correlation peak).
    pub peak: Vec<u16>,
    /// Marks the macropulse has.
    pub marks: Vec<u16>,
    /// Peak minus the best other lag the receiver looked at; of samples, how many standard deviations of
    /// the noise the sum of the marks is above the threshold.
    pub margin: Vec<u16>,
    /// Energy as the receiver can tell it, in detected photons per mark: measured, or by the count of
    /// the marks found as of a detector that every photon fires.
    pub photons: Vec<f32>,
    /// True if `photons` is a lower bound: no mark was missed, and no amplitude measured, or samples were
    /// clipped.
    pub saturated: Vec<bool>,
    /// Radial velocity, m/s, positive of a surface that approaches; empty of a receiver that measures none.
    pub radial_velocity: Vec<f32>,
    /// Rejects by kind, in the order of [`Reject::ALL`].
    pub rejects: [u64; Reject::ALL.len()],
}

/// One decoded measurement: a line of [`Returns`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Return {
    pub shot: usize,
    pub tof: f64,
    pub peak: u16,
    pub marks: u16,
    pub margin: u16,
    pub photons: f32,
    pub saturated: bool,
}

impl Returns {
    /// Number of returns.
    pub fn len(&self) -> usize {
        self.shot.len()
    }

    /// True if there is no return at all.
    pub fn is_empty(&self) -> bool {
        self.shot.is_empty()
    }

    /// How often `reject` happened.
    pub fn rejected(&self, reject: Reject) -> u64 {
        self.rejects[reject as usize]
    }

    /// None yet, with room for `returns`.
    pub(super) fn with_capacity(returns: usize) -> Self {
        Self {
            shot: Vec::with_capacity(returns),
            number: Vec::with_capacity(returns),
            tof: Vec::with_capacity(returns),
            peak: Vec::with_capacity(returns),
            marks: Vec::with_capacity(returns),
            margin: Vec::with_capacity(returns),
            photons: Vec::with_capacity(returns),
            saturated: Vec::with_capacity(returns),
            radial_velocity: Vec::new(),
            rejects: Default::default(),
        }
    }

    /// The returns, one after another.
    pub(super) fn each(&self) -> impl Iterator<Item = Return> {
        (0..self.len()).map(|at| Return {
            shot: self.shot[at] as usize,
            tof: self.tof[at],
            peak: self.peak[at],
            marks: self.marks[at],
            margin: self.margin[at],
            photons: self.photons[at],
            saturated: self.saturated[at],
        })
    }

    /// Counts the rejects of `other` as well.
    pub(super) fn add_rejects(&mut self, other: &Self) {
        self.rejects.iter_mut().zip(other.rejects).for_each(|(sum, more)| *sum += more);
    }

    /// Adds the next return: of a shot behind the last one, or of the same shot and not nearer.
    pub(super) fn push(&mut self, found: Return) {
        let shot = found.shot as u32;
        let before = match self.shot.last() {
            Some(&last) if last == shot => self.number.last().copied().unwrap_or(0),
            _ => 0,
        };
        self.number.push(before.saturating_add(1));
        self.shot.push(shot);
        self.tof.push(found.tof);
        self.peak.push(found.peak);
        self.marks.push(found.marks);
        self.margin.push(found.margin);
        self.photons.push(found.photons);
        self.saturated.push(found.saturated);
    }

    /// Takes out those whose light came `closes` seconds after firing or later.
    pub(super) fn refuse_beyond(&mut self, closes: f64) {
        if self.tof.iter().all(|tof| *tof < closes) {
            return;
        }
        let mut within = Self { rejects: self.rejects, ..Self::with_capacity(self.len()) };
        for one in self.each() {
            match one.tof < closes {
                true => within.push(one),
                false => within.reject(Reject::OutsideGate),
            }
        }
        *self = within;
    }

    pub(super) fn reject(&mut self, reject: Reject) {
        self.rejects[reject as usize] += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn returns_of_a_shot_are_numbered_from_one() {
        let mut returns = Returns::default();
        for (shot, tof) in [(3, 1e-7), (3, 2e-7), (4, 1e-7), (9, 5e-8), (9, 6e-8), (9, 7e-8)] {
            let (photons, saturated) = (1.0, true);
            returns.push(Return { shot, tof, peak: 1, marks: 1, margin: 1, photons, saturated });
        }
        assert_eq!(returns.number, [1, 2, 1, 1, 2, 3]);
        assert_eq!(returns.shot, [3, 3, 4, 9, 9, 9]);
    }

    #[test]
    fn rejects_are_counted_in_the_order_of_their_list() {
        for (place, kind) in Reject::ALL.into_iter().enumerate() {
            let mut returns = Returns::default();
            returns.reject(kind);
            assert_eq!(returns.rejects[place], 1, "{}", kind.name());
            assert_eq!(returns.rejected(kind), 1);
            assert!(returns.is_empty());
        }
    }
}

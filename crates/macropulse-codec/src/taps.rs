//! Taps: what a lock-in detector of amplitude-modulated light hands to a receiver.

/// Codes of a lock-in detector, the same number of each shot. A tap is what the detector collects while its gain
/// follows the modulation at one phase: those of the first modulation frequency come first, in the order of their
/// phases. Codes carry no trace of what made them.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Taps {
    /// Taps of a shot, all its modulation frequencies together.
    pub taps: u32,
    /// Codes of the converter, `taps` entries of each shot, one shot behind the other.
    pub codes: Vec<u16>,
}

impl Taps {
    /// The codes of shot number `shot`; none where it is not there.
    pub fn of(&self, shot: usize) -> &[u16] {
        let taps = self.taps as usize;
        let first = shot.saturating_mul(taps);
        self.codes.get(first..first.saturating_add(taps)).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_shot_has_its_codes() {
        let taps = Taps { taps: 3, codes: vec![1, 2, 3, 4, 5, 6] };
        assert_eq!((taps.of(0), taps.of(1)), (&[1, 2, 3][..], &[4, 5, 6][..]));
        assert!(taps.of(2).is_empty() && taps.of(usize::MAX).is_empty());
    }
}

//! Lessons of the shots before: the usual number of marks, and the shots in which a search is worth while.

use super::NEIGHBOURS;
use super::chance::HARDLY_EVER;

/// Most shots that are passed by, in light of usual density, after a search of a whole gate found nothing.
/// After a search of a part of the gate it is that share of them. With 256 a whole scan of
/// `kim-park-2016-fixed` in `car-50m` has 400 of 190 000 points fewer; it takes half as long in the dark with
/// 10¹⁰ dark counts a second.
///
/// If no light stands out it is the square of the share. So light that can be in a few places only is
/// searched for in nearly every shot. By the share itself whole rows of far ground are missed.
pub(super) const LONGEST_PAUSE: f64 = 64.0;

/// Pacing: one in a number of shots is searched for, and the number grows as long as none is found.
#[derive(Debug, Clone, Copy)]
pub(super) struct Paced {
    next: usize,
    pause: f64,
}

impl Default for Paced {
    fn default() -> Self {
        Self { next: 0, pause: LONGEST_PAUSE }
    }
}

impl Paced {
    pub(super) fn is_due(&self, shot: usize) -> bool {
        shot >= self.next
    }

    /// The next one is due at once, and then fewer and fewer.
    pub(super) fn restart(&mut self, shot: usize) {
        *self = Self { next: shot, pause: 1.0 };
    }

    /// `shot` was found, or else searched for in such a `share` of its gate.
    pub(super) fn note(&mut self, shot: usize, is_found: bool, share: f64) {
        self.next = shot + 1 + if is_found { 0 } else { (self.pause * share) as usize };
        self.pause = if is_found { 1.0 } else { (2.0 * self.pause).min(LONGEST_PAUSE) };
    }
}

/// The share of their marks that was found of the shots before: a running mean.
#[derive(Debug, Clone, Copy)]
pub(super) struct Usual {
    share: f64,
    shots: f64,
}

impl Usual {
    /// Nothing is known: half of them.
    pub(super) fn new() -> Self {
        Self { share: 0.5, shots: 0.0 }
    }

    pub(super) fn learn(&mut self, count: u32, weight: u32) {
        self.shots = (self.shots + 1.0).min(NEIGHBOURS as f64);
        self.share += (f64::from(count) / f64::from(weight) - self.share) / self.shots;
    }

    /// Fewest of `weight` marks that are usual.
    pub(super) fn least(&self, weight: u32) -> u32 {
        usual(self.share, weight)
    }
}

/// Fewest of `weight` marks that are usual where a `share` of them is found: fewer are found hardly ever, by the
/// standard deviation of the binomial and of a mark.
pub(super) fn usual(share: f64, weight: u32) -> u32 {
    let mean = share * f64::from(weight);
    let least = (mean - HARDLY_EVER * (mean * (1.0 - share) + 1.0).sqrt()).max(0.0);
    // Rounded up: `ceil` is a call where a processor may lack the instruction, and this is asked some times a shot.
    let whole = least as u32;
    whole + u32::from(f64::from(whole) < least)
}

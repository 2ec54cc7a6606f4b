//! Which of several returns of a shot are kept, and which one stands for it.

use serde::Deserialize;

/// Returns of a shot that a receiver can give at most.
pub const MOST_RETURNS: u8 = 8;

/// Which of several returns of a shot comes first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Pick {
    /// The nearest.
    First,
    /// The one with most marks; among equals the one with most light, then the nearest.
    #[default]
    Strongest,
    /// The farthest.
    Last,
}

/// The strength of a return, which decides among those of one shot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Strength {
    /// Marks found.
    pub peak: u16,
    /// Energy, in detected photons per mark or any other measure of it; NaN if it was not measured.
    pub light: f32,
}

impl Strength {
    /// True if it is stronger than `other`.
    pub fn exceeds(self, other: Self) -> bool {
        self.peak > other.peak || (self.peak == other.peak && self.light > other.light)
    }
}

impl Pick {
    /// Name in sensor files.
    pub fn name(self) -> &'static str {
        match self {
            Self::First => "first",
            Self::Strongest => "strongest",
            Self::Last => "last",
        }
    }

    /// True if a return that is `next` is picked before one that is not farther, `before`.
    pub fn prefers(self, next: Strength, before: Strength) -> bool {
        match self {
            Self::First => false,
            Self::Strongest => next.exceeds(before),
            Self::Last => true,
        }
    }

    /// Keeps `most` of `found`, which are ordered by range, in their order.
    pub(super) fn keep<T>(
        self,
        most: usize,
        found: &mut Vec<T>,
        strength: impl Fn(&T) -> Strength,
    ) {
        let excess = found.len().saturating_sub(most);
        match self {
            Self::First => found.truncate(most),
            Self::Last => drop(found.drain(..excess)),
            Self::Strongest => {
                for _ in 0..excess {
                    // The farthest of equally weak ones goes.
                    let weaker = |worst: usize, next: usize| match strength(&found[next])
                        .exceeds(strength(&found[worst]))
                    {
                        true => worst,
                        false => next,
                    };
                    let Some(worst) = (0..found.len()).reduce(weaker) else { return };
                    found.remove(worst);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn strengths(of: &[(u16, f32)]) -> Vec<Strength> {
        of.iter().map(|&(peak, light)| Strength { peak, light }).collect()
    }

    #[test]
    fn one_of_several_is_picked() {
        let [faint, bright] = [1.0, 2.0].map(|light| Strength { peak: 5, light });
        let whole = Strength { peak: 9, light: 1.0 };
        let unknown = Strength { peak: 5, light: f32::NAN };
        for other in [faint, bright, whole, unknown] {
            assert!(!Pick::First.prefers(other, faint) && Pick::Last.prefers(faint, other));
            assert!(!Pick::Strongest.prefers(other, other));
        }
        assert!(Pick::Strongest.prefers(bright, faint) && Pick::Strongest.prefers(whole, bright));
        assert!(!Pick::Strongest.prefers(faint, whole));
        // Light that was not measured decides nothing.
        assert!(!Pick::Strongest.prefers(bright, unknown));
    }

    #[test]
    fn as_many_as_wanted_are_kept_in_order() {
        let found = strengths(&[(5, 1.0), (9, 1.0), (3, 2.0), (5, 1.0)]);
        let kept = |pick: Pick, most| {
            let mut kept = (0..found.len()).collect();
            pick.keep(most, &mut kept, |&place: &usize| found[place]);
            kept
        };
        assert_eq!(kept(Pick::First, 3), [0, 1, 2]);
        assert_eq!(kept(Pick::Last, 3), [1, 2, 3]);
        assert_eq!(kept(Pick::Strongest, 3), [0, 1, 3]);
        assert_eq!(kept(Pick::Strongest, 2), [0, 1]);
        assert_eq!(kept(Pick::Strongest, 1), [1]);
        assert_eq!(kept(Pick::Strongest, 8), [0, 1, 2, 3]);
    }
}

//! The energy of a return, from the marks that were found of it.

/// The energy of a return as a count of marks tells it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Energy {
    /// Mean number of photons detected per mark.
    pub photons: f32,
    /// The true number may be larger, because no mark was missed.
    pub saturated: bool,
}

impl Energy {
    /// The energy of a return with `peak` of its `marks` found, where a share `density` of all places is
    /// lit by chance.
    ///
    /// A share p = (k/N − d)/(1 − d) of the marks shows a photon at least in the `window` they are looked for
    /// in. The window holds a share c of what they make. If each mark makes one event, p/c of them do, and on
    /// average μ = −ln(1 − p/c) photons were detected (Poisson). If each photon makes one, μ = −ln(1 − p)/c.
    /// From N − ½ marks on the count tells no more: μ is a lower bound.
    pub fn of((peak, marks): (u32, u32), density: f64, window: Window) -> Self {
        let all = f64::from(marks);
        let most = (all - 0.5) / all;
        let (of_marks, of_photons) = match window.photons_apart {
            true => (1.0, window.coverage),
            false => (window.coverage, 1.0),
        };
        let lit = (f64::from(peak) / all - density) / (1.0 - density) / of_marks;
        let saturated = peak >= marks || lit >= most;
        let share = if saturated { most } else { lit.max(0.0) };
        Self { photons: (-libm::log1p(-share) / of_photons) as f32, saturated }
    }
}

/// The window in which the events of a mark are looked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Window {
    /// Share of them that come there.
    pub coverage: f64,
    /// As [`Correlation::photons_apart`](super::Correlation::photons_apart).
    pub photons_apart: bool,
}

impl Window {
    /// Holds all of them.
    pub const WHOLE: Self = Self { coverage: 1.0, photons_apart: false };
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn photons_follow_from_the_share_of_marks_seen() {
        let photons = |found, density| Energy::of((found, 100), density, Window::WHOLE).photons;
        approx::assert_relative_eq!(photons(63, 0.0), 0.994, max_relative = 1e-3);
        // Half of the places are lit anyway: 75 of 100 lit are 50 of 100 seen.
        let ln_2 = std::f32::consts::LN_2;
        approx::assert_relative_eq!(photons(75, 0.5), ln_2, max_relative = 1e-3);
        // Half of the marks fall within the window: 25 of 100 found are 50 of 100 seen.
        let half = |photons_apart| Window { coverage: 0.5, photons_apart };
        let half_covered = Energy::of((25, 100), 0.0, half(false));
        approx::assert_relative_eq!(half_covered.photons, ln_2, max_relative = 1e-3);
        assert!(!half_covered.saturated);
        // Half of the photons do: where half of the marks show one there, there were 2·ln 2 of each.
        let thinned = Energy::of((50, 100), 0.0, half(true));
        approx::assert_relative_eq!(thinned.photons, 2.0 * ln_2, max_relative = 1e-3);
        assert_eq!(photons(1, 0.2), 0.0);
    }

    #[test]
    fn where_no_mark_is_missed_the_count_tells_a_lower_bound() {
        let whole = Energy::of((100, 100), 0.0, Window::WHOLE);
        assert!(whole.saturated);
        approx::assert_relative_eq!(whole.photons, 200_f32.ln(), max_relative = 1e-6);
        let most = Window { coverage: 0.95, photons_apart: false };
        // 94 of the 95 that the window holds are not all of them; the 95th would be.
        assert_eq!(
            [94, 95].map(|found| Energy::of((found, 100), 0.0, most).saturated),
            [false, true]
        );
        assert_eq!(
            Energy::of((1, 1), 0.0, Window::WHOLE),
            Energy { photons: ln_2(), saturated: true }
        );
    }

    fn ln_2() -> f32 {
        std::f32::consts::LN_2
    }
}

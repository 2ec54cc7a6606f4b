//! How far lidars of different methods see, and how precisely, as plain numbers.

/// The five lidars, and one of them with other lasers.
#[derive(Debug, Clone, Default)]
pub struct Methods {
    /// The five, in the order of the page.
    pub lidars: Vec<Reach>,
    /// The FMCW lidar with broader and broader lines: their widths, Hz.
    pub lines: Vec<(f64, Reach)>,
}

/// A lidar before walls at growing distance.
#[derive(Debug, Clone)]
pub struct Reach {
    /// Its name.
    pub lidar: &'static str,
    /// What it saw of each wall, nearest first.
    pub places: Vec<Place>,
}

/// What a lidar saw of one wall.
#[derive(Debug, Clone)]
pub struct Place {
    /// Distance of the wall.
    pub range: f64,
    /// Shots with an echo.
    pub shots: u64,
    /// Those that gave a right or near point.
    pub seen: u64,
    /// Their share, and the ends of its interval of 95 %.
    pub pd: [f64; 3],
    /// Standard deviation of the range error; NaN of fewer than two points.
    pub precision: f64,
    /// Points that it was taken of.
    pub points: u64,
    /// Pd and precision as forecast, if there is a forecast.
    pub forecast: Option<(f64, f64)>,
}

impl Methods {
    /// The lidar with this name.
    pub fn of(&self, lidar: &str) -> Option<&Reach> {
        self.lidars.iter().find(|reach| reach.lidar == lidar)
    }
}

impl Reach {
    /// Range at which Pd falls below a half, and the ends of its interval of 95 %: where Pd and the ends of its interval do.
    pub fn half(&self) -> [f64; 3] {
        [0, 1, 2].map(|end| self.falls_below(0.5, |place| place.pd[end]))
    }

    /// Range at which `value` falls below `level`, linear in the logarithm of range between two walls; 0 if it is below at
    /// the nearest wall, infinite if at none.
    fn falls_below(&self, level: f64, value: impl Fn(&Place) -> f64) -> f64 {
        let Some(at) = self.places.iter().position(|place| value(place) < level) else {
            return f64::INFINITY;
        };
        let Some(before) = at.checked_sub(1).map(|before| &self.places[before]) else { return 0.0 };
        let after = &self.places[at];
        let part = (value(before) - level) / (value(before) - value(after));
        before.range * libm::pow(after.range / before.range, part)
    }

    /// What it saw of the wall at this range.
    pub fn at(&self, range: f64) -> Option<&Place> {
        self.places.iter().find(|place| place.range == range)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reach(pds: &[(f64, f64)]) -> Reach {
        let place = |&(range, pd): &(f64, f64)| Place {
            range,
            shots: 100,
            seen: (100.0 * pd) as u64,
            pd: [pd, pd - 0.1, pd + 0.1],
            precision: 0.01,
            points: 100,
            forecast: None,
        };
        Reach { lidar: "", places: pds.iter().map(place).collect() }
    }

    #[test]
    fn the_range_of_a_half_lies_between_the_walls_around_it() {
        let [half, low, high] = reach(&[(10.0, 1.0), (40.0, 0.75), (90.0, 0.25)]).half();
        approx::assert_relative_eq!(half, 60.0, max_relative = 1e-12);
        assert!(40.0 < low && low < half && half < high && high < 90.0);
    }

    #[test]
    fn what_never_crosses_a_half_is_infinite_or_nothing() {
        assert_eq!(reach(&[(10.0, 1.0), (40.0, 0.9)]).half(), [f64::INFINITY; 3]);
        assert_eq!(reach(&[(10.0, 0.3), (40.0, 0.9)]).half(), [0.0; 3]);
        assert_eq!(reach(&[]).half(), [f64::INFINITY; 3]);
    }
}

//! How far lidars of different methods see, and how precisely, as plain numbers.

use macropulse::codec::statistics::normal_quantile;

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
    /// Its results at each wall, nearest first.
    pub places: Vec<Place>,
    /// Range, Pd and precision as forecast, at the walls and between them; empty without a forecast.
    pub curve: Vec<[f64; 3]>,
}

/// A lidar before one wall.
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
        [0, 1, 2].map(|end| falls_below_half(self.places.iter().map(|it| [it.range, it.pd[end]])))
    }

    /// The same range as forecast, if there is a forecast.
    pub fn half_forecast(&self) -> Option<f64> {
        let curve = self.curve.iter().map(|[range, pd, _]| [*range, *pd]);
        (!self.curve.is_empty()).then(|| falls_below_half(curve))
    }

    /// Pd and precision of the wall at this range as forecast.
    pub fn forecast(&self, range: f64) -> Option<[f64; 2]> {
        let near = |it: &&[f64; 3]| (it[0] / range - 1.0).abs() < 1e-9;
        self.curve.iter().find(near).map(|[_, pd, precision]| [*pd, *precision])
    }

    /// Its result at the wall of this range.
    pub fn at(&self, range: f64) -> Option<&Place> {
        self.places.iter().find(|place| place.range == range)
    }
}

/// Pd nearer to 0 or 1 than this is held there: half a shot of 500.
const HELD: f64 = 1e-3;

/// Range at which Pd falls below a half, out of pairs of range and Pd. Between two pairs the normal quantile of Pd is
/// linear in the logarithm of range. The result is 0 if Pd is below at the nearest range, and infinite if at none.
fn falls_below_half(values: impl Iterator<Item = [f64; 2]>) -> f64 {
    let mut before: Option<[f64; 2]> = None;
    for [range, pd] in values {
        let quantile = normal_quantile(pd.clamp(HELD, 1.0 - HELD));
        if quantile < 0.0 {
            return before.map_or(0.0, |[near, high]| {
                near * libm::pow(range / near, high / (high - quantile))
            });
        }
        before = Some([range, quantile]);
    }
    f64::INFINITY
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
        };
        let curve = pds.iter().map(|&(range, pd)| [range, pd, 0.02]).collect();
        Reach { lidar: "", places: pds.iter().map(place).collect(), curve }
    }

    #[test]
    fn the_range_of_a_half_lies_between_the_walls_around_it() {
        let [half, low, high] = reach(&[(10.0, 1.0), (40.0, 0.75), (90.0, 0.25)]).half();
        approx::assert_relative_eq!(half, 60.0, max_relative = 1e-12);
        assert!(40.0 < low && low < half && half < high && high < 90.0);
        let reach = reach(&[(10.0, 1.0), (40.0, 0.75), (90.0, 0.25)]);
        approx::assert_relative_eq!(reach.half_forecast().unwrap_or(0.0), half);
        assert_eq!((reach.forecast(40.0), reach.forecast(41.0)), (Some([0.75, 0.02]), None));
    }

    #[test]
    fn what_never_crosses_a_half_is_infinite_or_nothing() {
        assert_eq!(reach(&[(10.0, 1.0), (40.0, 0.9)]).half(), [f64::INFINITY; 3]);
        assert_eq!(reach(&[(10.0, 0.3), (40.0, 0.9)]).half(), [0.0; 3]);
        assert_eq!(reach(&[]).half(), [f64::INFINITY; 3]);
    }
}

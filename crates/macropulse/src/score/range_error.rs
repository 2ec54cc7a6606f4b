//! How far points are off.

use crate::points::{Outcome, PointCloud};

/// The range errors of points of a cloud, one of each pixel: measured less true range.
#[derive(Debug, Clone, Copy, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct RangeError {
    /// Points.
    pub count: u64,
    /// Mean error, m; `None` without a point.
    #[serde(rename = "mean_m")]
    pub mean: Option<f64>,
    /// Standard deviation of the errors, `√(Σ(e − ē)²/(N − 1))`, m; `None` of fewer than two.
    #[serde(rename = "deviation_m")]
    pub deviation: Option<f64>,
}

/// Deviations of a normal error within which 99.99 % of it lie, and 99.9 % of its variance.
const WITHIN: f64 = 4.0;

/// Points that are wrong by chance are spread over the whole gate: a limit that is doubled so often
/// without an end has only met those.
const DOUBLINGS: usize = 8;

impl RangeError {
    /// Returns the error of the right points that the image of `cloud` shows. They are summed pixel by pixel,
    /// so that rounding is the same whatever order they came in. Ranges are `f32`: at 150 m they are kept to
    /// 8 µm.
    pub fn of(cloud: &PointCloud) -> Self {
        Self::of_errors(&errors(cloud, |outcome| outcome == Outcome::Right))
    }

    /// As [`RangeError::of`], but for the whole spread if `limit`, the error up to which a point is right,
    /// cuts it off. The limit is then doubled until it holds four deviations of what it lets in. The
    /// deviation is then the one that a link budget forecasts.
    pub fn of_spread(cloud: &PointCloud, limit: f64) -> Self {
        let right = Self::of(cloud);
        let met = [Outcome::Right, Outcome::Near, Outcome::Wrong];
        let all = errors(cloud, |outcome| met.contains(&outcome));
        let wider = (1..=DOUBLINGS).map(|doubled| limit * f64::from(1 << doubled));
        let mut wider = wider.map(|limit| {
            let within: Vec<f64> = all.iter().copied().filter(|e| e.abs() <= limit).collect();
            (Self::of_errors(&within), limit)
        });
        match right.is_held_by(limit) {
            true => right,
            false => wider.find(|(e, limit)| e.is_held_by(*limit)).map_or(right, |(e, _)| e),
        }
    }

    fn of_errors(errors: &[f64]) -> Self {
        let count = errors.len() as f64;
        let mean = errors.iter().sum::<f64>() / count;
        let squares = errors.iter().map(|error| (error - mean).powi(2)).sum::<f64>();
        Self {
            count: errors.len() as u64,
            mean: (!errors.is_empty()).then_some(mean),
            deviation: (errors.len() > 1).then(|| (squares / (count - 1.0)).sqrt()),
        }
    }

    /// Returns true if errors up to a `limit` leave out next to nothing of a spread like this.
    fn is_held_by(&self, limit: f64) -> bool {
        self.deviation.is_none_or(|deviation| WITHIN * deviation <= limit)
    }
}

/// Range errors of the points shown, pixel by pixel, with such an outcome.
fn errors(cloud: &PointCloud, is_counted: impl Fn(Outcome) -> bool) -> Vec<f64> {
    let truth = &cloud.truth.returns;
    let image = cloud.image(cloud.pick);
    let counted = image.iter().flatten().filter(|&at| is_counted(truth.outcome[at]));
    counted.map(|at| f64::from(cloud.range[at]) - f64::from(truth.range[at])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::points::{Surfaces, Truth};
    use macropulse_codec::statistics;

    /// A row of pixels, those that have a range with a return.
    fn cloud(pixels: &[(f32, f32, Outcome)]) -> PointCloud {
        let answered = pixels.iter().enumerate().filter(|(_, pixel)| !pixel.0.is_nan());
        let returns = answered.clone().count();
        PointCloud {
            rows: 1,
            columns: pixels.len(),
            row: vec![0; returns],
            column: answered.clone().map(|(column, _)| column as u16).collect(),
            range: answered.clone().map(|(_, pixel)| pixel.0).collect(),
            truth: Truth {
                returns: Surfaces {
                    range: answered.clone().map(|(_, pixel)| pixel.1).collect(),
                    outcome: answered.map(|(_, pixel)| pixel.2).collect(),
                    ..Surfaces::default()
                },
                ..Truth::default()
            },
            ..PointCloud::default()
        }
    }

    #[test]
    fn only_right_points_count() {
        let (nan, right) = (f32::NAN, Outcome::Right);
        let error = RangeError::of(&cloud(&[
            (10.5, 10.0, right),
            (30.0, 10.0, Outcome::Wrong),
            (nan, 10.0, Outcome::Missed),
            (9.75, 10.0, right),
            (10.0, 10.0, right),
            (nan, nan, Outcome::Empty),
        ]));
        let mean = 0.25 / 3.0;
        let squares = [0.5, -0.25, 0.0].map(|e: f64| (e - mean).powi(2)).iter().sum::<f64>();
        assert_eq!(error.count, 3);
        approx::assert_relative_eq!(error.mean.unwrap(), mean, max_relative = 1e-12);
        let deviation = (squares / 2.0).sqrt();
        approx::assert_relative_eq!(error.deviation.unwrap(), deviation, max_relative = 1e-12);
    }

    /// Errors of 152 mm, every one up to 50 mm right: their own deviation is told, as a link budget
    /// has it. Control: with no points but the right ones it is that of the cut.
    #[test]
    fn a_spread_wider_than_what_is_right_is_told_whole() {
        let sigma = 0.152;
        let pixels = |worst: f64| -> Vec<(f32, f32, Outcome)> {
            let quantile = |k: u32| (f64::from(k) + 0.5) / 4000.0;
            let errors = (0..4000).map(|k| sigma * statistics::normal_quantile(quantile(k)));
            let outcome = |error: f64| match error.abs() {
                ..=0.05 => Outcome::Right,
                ..=0.35 => Outcome::Near,
                _ => Outcome::Wrong,
            };
            let kept = errors.filter(|error| error.abs() <= worst);
            kept.map(|error| ((50.0 + error) as f32, 50.0, outcome(error))).collect()
        };
        let deviation =
            |worst: f64| RangeError::of_spread(&cloud(&pixels(worst)), 0.05).deviation.unwrap();
        approx::assert_relative_eq!(deviation(f64::INFINITY), sigma, max_relative = 2e-3);
        assert!(deviation(0.05) < 0.03);
    }

    /// Wrong points all over the gate do not count: they never end.
    #[test]
    fn points_all_over_the_gate_are_not_taken_for_a_spread() {
        let outcome = |error: i32| match error.abs() {
            ..=5 => Outcome::Right,
            _ => Outcome::Wrong,
        };
        let all = (-9000..9000).map(|e| (100.0 + 0.01 * e as f32, 100.0, outcome(e)));
        let right: Vec<_> = all.clone().filter(|pixel| pixel.2 == Outcome::Right).collect();
        let all: Vec<_> = all.collect();
        assert_eq!(RangeError::of_spread(&cloud(&all), 0.05), RangeError::of(&cloud(&right)));
    }

    #[test]
    fn one_point_has_no_deviation_and_none_no_mean() {
        let one = RangeError::of(&cloud(&[(10.5, 10.0, Outcome::Right)]));
        assert_eq!((one.count, one.mean, one.deviation), (1, Some(0.5), None));
        assert_eq!(RangeError::of(&cloud(&[])), RangeError::default());
    }
}

//! How far right points are off.

use crate::points::{Outcome, PointCloud};

/// The range errors of the right points of a cloud, one of each pixel: measured less true range.
#[derive(Debug, Clone, Copy, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct RangeError {
    /// Right points.
    pub count: u64,
    /// Mean error, m; `None` without a point.
    #[serde(rename = "mean_m")]
    pub mean: Option<f64>,
    /// Standard deviation of the errors, `√(Σ(e − ē)²/(N − 1))`, m; `None` of fewer than two.
    #[serde(rename = "deviation_m")]
    pub deviation: Option<f64>,
}

impl RangeError {
    /// Of the right points that the image of `cloud` shows, pixel by pixel, so that rounding is the same whatever order
    /// they came in. Ranges are `f32`: at 150 m they are kept to 8 µm.
    pub fn of(cloud: &PointCloud) -> Self {
        let truth = &cloud.truth.returns;
        let image = cloud.image(cloud.pick);
        let right = image.iter().flatten().filter(|&at| truth.outcome[at] == Outcome::Right);
        let errors: Vec<f64> =
            right.map(|at| f64::from(cloud.range[at]) - f64::from(truth.range[at])).collect();
        let count = errors.len() as f64;
        let mean = errors.iter().sum::<f64>() / count;
        let squares = errors.iter().map(|error| (error - mean).powi(2)).sum::<f64>();
        Self {
            count: errors.len() as u64,
            mean: (!errors.is_empty()).then_some(mean),
            deviation: (errors.len() > 1).then(|| (squares / (count - 1.0)).sqrt()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::points::{Surfaces, Truth};

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

    #[test]
    fn one_point_has_no_deviation_and_none_no_mean() {
        let one = RangeError::of(&cloud(&[(10.5, 10.0, Outcome::Right)]));
        assert_eq!((one.count, one.mean, one.deviation), (1, Some(0.5), None));
        assert_eq!(RangeError::of(&cloud(&[])), RangeError::default());
    }
}

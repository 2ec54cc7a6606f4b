//! The scores of a sweep, in one place.

use super::{Counted, Error};
use macropulse::names::nearest;
use macropulse::points::Outcome;
use macropulse::score::Estimate;

/// A score that can be drawn against what is varied.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Metric {
    /// Right or near returns per echo.
    Pd,
    /// Right returns per echo.
    Right,
    /// Near returns per echo.
    Near,
    /// Wrong returns per echo.
    Wrong,
    /// Echoes without a return.
    Missed,
    /// Returns where nothing is, per pixel.
    False,
    /// Returns from a surface beside the pixel, per pixel.
    Edge,
    /// Samples of the target with a point.
    Target,
    /// Returns of a scan.
    Points,
    /// Standard deviation of the range error.
    Precision,
    /// Mean range error.
    Bias,
    /// Detection events lost by the converters.
    Lost,
    /// Most converters busy.
    Busy,
}

impl Metric {
    /// All of them, in the order in which they are listed to people.
    pub const ALL: [Self; 13] = [
        Self::Pd,
        Self::Right,
        Self::Near,
        Self::Wrong,
        Self::Missed,
        Self::False,
        Self::Edge,
        Self::Target,
        Self::Points,
        Self::Precision,
        Self::Bias,
        Self::Lost,
        Self::Busy,
    ];

    /// Name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Pd => "pd",
            Self::Right => "right",
            Self::Near => "near",
            Self::Wrong => "wrong",
            Self::Missed => "missed",
            Self::False => "false",
            Self::Edge => "edge",
            Self::Target => "target",
            Self::Points => "points",
            Self::Precision => "precision",
            Self::Bias => "bias",
            Self::Lost => "lost",
            Self::Busy => "busy",
        }
    }

    /// Its meaning, in a line. An echo is a pixel with a surface within the range gate whose shot carried
    /// light.
    pub fn meaning(self) -> &'static str {
        match self {
            Self::Pd => "share of the echoes that gave a return, right or near (within 0.35 m)",
            Self::Right => "share of the echoes that came out right",
            Self::Near => "share of the echoes that came out near: a code sidelobe",
            Self::Wrong => "share of the echoes that came out wrong, farther off than near",
            Self::Missed => "share of the echoes that gave no return",
            Self::False => "share of all pixels with a return where nothing is",
            Self::Edge => "share of all pixels with a return from a surface beside the pixel",
            Self::Target => "share of the rays that meet the target which gave a point on it",
            Self::Points => "returns per scan, or per measured part of it",
            Self::Precision => {
                "standard deviation of the range error, sidelobes and wrong points apart, m"
            }
            Self::Bias => "mean of the same, m",
            Self::Lost => "share of the detection events that found every converter busy",
            Self::Busy => "most converters busy at once, mean over the seeds",
        }
    }

    /// Name in tables, with the unit.
    pub fn column(self) -> String {
        match self {
            Self::Precision | Self::Bias => format!("{}_m", self.name()),
            _ => self.name().to_owned(),
        }
    }

    /// The scores named in `typed`, with commas between them, each once.
    ///
    /// # Errors
    /// Names the nearest score to one that is not known.
    pub fn parse(typed: &str) -> Result<Vec<Self>, Error> {
        let mut list = Vec::new();
        for name in typed.split(',').map(str::trim) {
            let names = || Self::ALL.map(Self::name);
            let Some(metric) = Self::ALL.into_iter().find(|metric| metric.name() == name) else {
                let hint = nearest(name, names())
                    .map(|near| format!("did you mean `{near}`? "))
                    .unwrap_or_default();
                let known = names().join(", ");
                return Error::asked(format!("unknown score `{name}`; {hint}known: {known}"));
            };
            if !list.contains(&metric) {
                list.push(metric);
            }
        }
        Ok(list)
    }

    /// Its value and interval from what was `counted` with each seed.
    pub fn estimate(self, counted: &[Counted]) -> Estimate {
        let rate = |of: &dyn Fn(&Counted) -> [u64; 2]| {
            Estimate::of_rate(&counted.iter().map(of).collect::<Vec<_>>())
        };
        let per_echo = |outcome: Outcome| {
            rate(&|counted| [counted.score.count(outcome), counted.score.with_echo()])
        };
        let per_pixel = |outcome: Outcome| {
            rate(&|counted| [counted.score.count(outcome), counted.score.pixels.iter().sum()])
        };
        let mean = |of: &dyn Fn(&Counted) -> f64| {
            Estimate::of_mean(&counted.iter().map(of).collect::<Vec<_>>())
        };
        match self {
            Self::Pd => rate(&|counted| {
                let returned = [Outcome::Right, Outcome::Near].map(|o| counted.score.count(o));
                [returned.iter().sum(), counted.score.with_echo()]
            }),
            Self::Right => per_echo(Outcome::Right),
            Self::Near => per_echo(Outcome::Near),
            Self::Wrong => per_echo(Outcome::Wrong),
            Self::Missed => rate(&|counted| {
                let score = &counted.score;
                [score.count(Outcome::Missed) - score.dark, score.with_echo()]
            }),
            Self::False => per_pixel(Outcome::False),
            Self::Edge => per_pixel(Outcome::Edge),
            Self::Target => {
                rate(&|counted| [counted.score.points_on_target, counted.score.samples_on_target])
            }
            Self::Points => mean(&|counted| {
                let silent = [Outcome::Empty, Outcome::Missed].map(|one| counted.score.count(one));
                (counted.score.pixels.iter().sum::<u64>() - silent.iter().sum::<u64>()) as f64
            })
            .at_least(0.0),
            Self::Precision => {
                mean(&|counted| counted.right.deviation.unwrap_or(f64::NAN)).at_least(0.0)
            }
            Self::Bias => mean(&|counted| counted.right.mean.unwrap_or(f64::NAN)),
            Self::Lost => rate(&|counted| [counted.lost, counted.detections]),
            Self::Busy => mean(&|counted| f64::from(counted.peak_busy)).at_least(0.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use macropulse::score::{RangeError, Score};

    /// 100 pixels: 7 empty, 60 right, 5 near, 4 wrong, 20 missed (2 of them dark), 1 false, 3 edges.
    fn counted() -> Counted {
        let score = Score {
            pixels: [7, 60, 5, 4, 20, 1, 3],
            dark: 2,
            samples_on_target: 8,
            points_on_target: 6,
            ghosts: 2,
            further: [0; 7],
        };
        let right = RangeError { count: 60, mean: Some(1e-4), deviation: Some(2e-4) };
        Counted { score, detections: 1000, lost: 5, peak_busy: 7, right, ..Counted::default() }
    }

    #[test]
    fn every_score_is_what_its_line_says() {
        let wanted = [
            65.0 / 87.0,
            60.0 / 87.0,
            5.0 / 87.0,
            4.0 / 87.0,
            18.0 / 87.0,
            0.01,
            0.03,
            0.75,
            73.0,
            2e-4,
            1e-4,
            0.005,
            7.0,
        ];
        for (metric, wanted) in Metric::ALL.into_iter().zip(wanted) {
            assert_eq!(metric.estimate(&[counted()]).value, wanted, "{}", metric.name());
        }
    }

    #[test]
    fn shares_of_the_echoes_add_up() {
        let parts = [Metric::Right, Metric::Near, Metric::Wrong, Metric::Missed];
        let sum: f64 = parts.map(|metric| metric.estimate(&[counted()]).value).iter().sum();
        approx::assert_relative_eq!(sum, 1.0, max_relative = 1e-12);
    }

    #[test]
    fn a_seed_without_right_points_does_not_count_for_their_error() {
        let without = Counted { right: RangeError::default(), ..counted() };
        let estimate = Metric::Precision.estimate(&[counted(), without]);
        assert_eq!(estimate.value, 2e-4);
        assert!(estimate.low.is_nan());
    }

    #[test]
    fn scores_are_found_by_name() {
        for metric in Metric::ALL {
            assert_eq!(Metric::parse(metric.name()).unwrap(), [metric]);
        }
        assert_eq!(Metric::parse("pd, bias,pd").unwrap(), [Metric::Pd, Metric::Bias]);
        let told = Metric::parse("pd,precsion").unwrap_err().to_string();
        assert!(told.contains("unknown score `precsion`; did you mean `precision`? known: pd,"));
        assert!(Metric::parse("").is_err());
    }
}

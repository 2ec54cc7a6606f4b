//! The best of the lags about the light of a shot.
//!
//! A mark is looked for in W ticks in a row, so light is seen at several lags, and a receiver takes the one
//! that shows most. With the probability p_i a mark is seen at lag i, with p_ij at both i and j. A of N marks
//! are seen at i alone, and B at j alone, nearly by Poisson's law with the means N·(p_i − p_ij) and N·(p_j −
//! p_ij). So lag j adds E\[(B − A)⁺\] marks to those of lag i. Lag by lag the greatest count so far takes the
//! place of i. Its mean, its variance and its covariances with the other lags are kept. They give the mean
//! and the variance of B − A, and so the means of both, as Clark did with normal variables \[Cla61\].

use macropulse_codec::statistics::{normal_tail, poisson_from};

use super::matched::{Timing, seen_of_share};
use crate::design::Design;
use crate::design::detector::Lit;

/// Lags at which a mark of a shot is seen.
pub(super) struct Sight {
    /// When its light comes, in ticks from the beginning of a tick, 0 to 1.
    pub late: f64,
    /// Probability that a place of W ticks is lit by other light.
    pub density: f64,
    /// Share of the events that find a free converter.
    pub converted: f64,
}

/// Probabilities that a mark is seen at the lags about the light, those where it is seen most first.
pub(super) struct BestLag {
    /// The lags, in ticks from the one in which the light begins.
    lags: Vec<i64>,
    seen: Vec<f64>,
    /// The same for two lags.
    both: Vec<Vec<f64>>,
}

impl BestLag {
    /// Those of a `mark` of a sensor.
    pub fn of(design: &Design, mark: &Lit, sight: &Sight) -> Self {
        let width = i64::from(design.receiver.window_ticks());
        let sigma = Timing::of(design, mark).sigma;
        let after = |tick: i64| match (tick as f64 - sight.late, sigma > 0.0) {
            (away, true) => normal_tail(away / sigma),
            (away, false) => f64::from(u8::from(away <= 0.0)),
        };
        let seen = seen_of_share(design, mark);
        let light = |from: i64, to: i64| {
            // A receiver that looks at a single tick takes events for exact.
            let share = if width == 1 { 1.0 } else { after(from) - after(to) };
            seen(share) * sight.converted
        };
        Self::seen_by(width, light, libm::log1p(-sight.density.min(0.999_999)) / width as f64)
    }

    /// Lags of light that is seen from one tick to another with the probability `light`, in places of `width`
    /// ticks. Other light leaves a tick dark with a probability whose logarithm is `log_dark`.
    fn seen_by(width: i64, light: impl Fn(i64, i64) -> f64, log_dark: f64) -> Self {
        let within = |from: i64, to: i64| {
            1.0 - (1.0 - light(from, to)) * libm::exp(log_dark * (to - from) as f64)
        };
        let lags = if width == 1 { 0..1 } else { 1 - 2 * width..width };
        let step = (lags.end - lags.start + MOST_LAGS - 1) / MOST_LAGS;
        let lags = lags.step_by(step as usize);
        let mut each: Vec<(f64, i64)> = lags.map(|lag| (within(lag, lag + width), lag)).collect();
        each.sort_by(|one, other| other.0.total_cmp(&one.0));
        let both = |&(one, first): &(f64, i64), &(other, second): &(f64, i64)| {
            let is_shared = (first - second).abs() < width;
            match is_shared {
                true => one + other - within(first.min(second), first.max(second) + width),
                false => one * other,
            }
        };
        let both = each.iter().map(|one| each.iter().map(|other| both(one, other)).collect());
        let both = both.collect();
        let (seen, lags) = each.into_iter().unzip();
        Self { lags, seen, both }
    }

    /// The mean share of `marks` that are seen at the best lag.
    pub fn share(&self, marks: f64) -> f64 {
        self.best_of(marks).0
    }

    /// Returns how likely the likeliest lag l is after those of neighbours, relative to neighbours that all
    /// have the same lag. It is the mean of 1/(1 + |l − m|). Half of the times m is the best lag of a
    /// neighbour, and half of the times it is on the line through those of two.
    pub fn agreement(&self, marks: f64) -> f64 {
        let is_best = self.best_of(marks).1;
        let each = self.lags.iter().zip(&is_best).filter(|(_, chance)| **chance > SELDOM);
        let each: Vec<(i64, f64)> = each.map(|(lag, chance)| (*lag, *chance)).collect();
        let agrees = |own: i64| -> f64 {
            let beside = |lag: i64| 1.0 / (1 + own.abs_diff(lag)) as f64;
            let of_near = |&(near, of_near): &(i64, f64)| {
                let on_lines = each.iter().map(|(far, of_far)| of_far * beside(2 * near - far));
                of_near * 0.5 * (beside(near) + on_lines.sum::<f64>())
            };
            each.iter().map(of_near).sum()
        };
        each.iter().map(|(own, _)| agrees(*own)).fold(0.0, f64::max)
    }

    /// The mean share of `marks` at the best lag, and the probability of each lag to be that one. The first
    /// wins if several have the same number.
    fn best_of(&self, marks: f64) -> (f64, Vec<f64>) {
        let covariance = |one: usize, other: usize| {
            marks * (self.both[one][other] - self.seen[one] * self.seen[other])
        };
        let mean = |lag: usize| marks * self.seen[lag];
        // The greatest so far, and its covariance with each lag.
        let (mut greatest, mut variance) = (mean(0), covariance(0, 0));
        let mut with: Vec<f64> = (0..self.seen.len()).map(|lag| covariance(0, lag)).collect();
        let mut is_best = vec![0.0; self.seen.len()];
        is_best[0] = 1.0;
        for lag in 1..self.seen.len() {
            let (next, of_next) = (mean(lag), covariance(lag, lag));
            let square = (variance + of_next - 2.0 * with[lag]).max(0.0);
            let [alone, other] = [greatest - next, next - greatest].map(|by| 0.5 * (square + by));
            let Gain { marks, more, as_many } = gain(alone.max(0.0), other.max(0.0));
            let before: f64 =
                (0..lag).filter(|at| self.lags[*at] > self.lags[lag]).map(|at| is_best[at]).sum();
            let taken = more + as_many * before;
            is_best[..lag].iter_mut().for_each(|chance| *chance *= 1.0 - taken);
            is_best[lag] = taken;
            greatest += marks;
            variance += (of_next - variance) * more;
            for (other, with) in with.iter_mut().enumerate() {
                *with += (covariance(lag, other) - *with) * more;
            }
        }
        ((greatest / marks).min(1.0), is_best)
    }
}

/// Lags at most. Beyond that number, lags side by side show nearly the same marks, and one stands for
/// several.
const MOST_LAGS: i64 = 64;

/// Lags that are more seldom the best do not count.
const SELDOM: f64 = 1e-3;

/// For more marks the sums are those of normal variables.
const MANY: f64 = 100.0;

/// Marks that another lag adds.
struct Gain {
    /// E\[(B − A)⁺\].
    marks: f64,
    /// P(B > A) and P(B = A).
    more: f64,
    as_many: f64,
}

/// That of A and B that follow Poisson's law with the means `alone` and `other`.
fn gain(alone: f64, other: f64) -> Gain {
    let apart = (alone + other).sqrt();
    if alone + other > MANY {
        let away = (other - alone) / apart;
        let density = libm::exp(-0.5 * away * away) / std::f64::consts::TAU.sqrt();
        let marks = (other - alone) * normal_tail(-away) + apart * density;
        let as_many = density / apart;
        return Gain { marks, more: normal_tail(-away) - 0.5 * as_many, as_many };
    }
    let most = (alone.max(other) + 8.0 * apart + 8.0) as u32;
    let [alone, other] = [alone, other].map(|mean| poisson_from(mean, 0, most));
    let mut sum = Gain { marks: 0.0, more: 0.0, as_many: 0.0 };
    for (b, of_b) in other.iter().enumerate() {
        sum.as_many += of_b * alone[b];
        for (a, of_a) in alone[..b].iter().enumerate() {
            sum.marks += (b - a) as f64 * of_a * of_b;
            sum.more += of_a * of_b;
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// Drawn with another program, 20 000 times or 4000, at these phases of a tick: jitter of 0.2 to 12 ticks, places of
    /// 2 to 50, noise or none. The best single lag shows up to 5 % less.
    #[test]
    fn the_best_lag_shows_what_was_drawn() {
        for (marks, pd, sigma, width, density, late, drawn) in [
            (16.0, 0.3652, 0.6385, 4, 1e-4, 0.861, 0.36507),
            (180.0, 0.0289, 0.2, 2, 3e-4, 0.531, 0.029801),
            (180.0, 0.1, 1.0, 5, 0.04, 0.3, 0.27758),
            (180.0, 0.1, 1.0, 5, 0.004, 0.3, 0.11901),
            (30.0, 0.5, 1.0, 5, 0.004, 0.3, 0.50777),
            (180.0, 0.3, 1.0, 5, 0.0, 0.8, 0.29603),
            (30.0, 0.5, 12.0, 50, 4.0397e-4, 0.3, 0.50655),
            (180.0, 0.1, 12.0, 50, 4.0397e-4, 0.3, 0.11993),
        ] {
            let after = |tick: i64| normal_tail((tick as f64 - late) / sigma);
            let light = |from: i64, to: i64| pd * (after(from) - after(to));
            let log_dark = libm::log1p(-density);
            let best = BestLag::seen_by(width, light, log_dark);
            assert_relative_eq!(best.share(marks), drawn, max_relative = 0.01);
        }
    }

    #[test]
    fn few_marks_and_many_are_alike() {
        let [few, many] = [45.0, 45.2].map(|alone| gain(alone, 54.9).marks);
        assert_relative_eq!(few, many, max_relative = 0.03);
        // Nothing is alone at the first lag: all that is seen at the other one is more.
        assert_relative_eq!(gain(0.0, 0.3).marks, 0.3, max_relative = 1e-9);
        assert_relative_eq!(gain(0.0, 0.3).more, 1.0 - libm::exp(-0.3), max_relative = 1e-9);
    }
}

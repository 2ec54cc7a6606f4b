//! A plane with two axes: from values to places in a drawing.

use super::chart::{Axis, Scale};
use super::svg::{Anchor, Svg, text_width};
use super::ticks::{label, linear_ticks, log_ticks, power_label};

/// Values along one axis and where they lie.
#[derive(Debug, Clone)]
pub(super) struct Ruler {
    scale: Scale,
    pub low: f64,
    pub high: f64,
    /// Places of `low` and `high`.
    pub ends: [f64; 2],
    pub ticks: Vec<(f64, String)>,
}

impl Ruler {
    /// A ruler for `axis` that holds all of `values`, unless the axis says where it ends.
    pub fn new(axis: &Axis, values: impl Iterator<Item = f64>, ends: [f64; 2]) -> Self {
        let usable =
            |value: &f64| value.is_finite() && (axis.scale == Scale::Linear || *value > 0.0);
        let [low, high] = axis.limits.unwrap_or_else(|| {
            let fold = |[low, high]: [f64; 2], value: f64| [low.min(value), high.max(value)];
            values.filter(usable).fold([f64::INFINITY, f64::NEG_INFINITY], fold)
        });
        let wanted = ((ends[1] - ends[0]).abs() / if axis.upright { 46.0 } else { 84.0 }).max(3.0);
        let mut ruler = Self { scale: axis.scale, low, high, ends, ticks: Vec::new() };
        ruler.mend(axis, wanted as usize);
        if !axis.categories.is_empty() {
            let names = axis.categories.iter().enumerate();
            ruler.ticks = names.map(|(at, name)| (at as f64, name.clone())).collect();
        }
        ruler
    }

    /// Gives a span to what has none, rounds free ends outwards to a tick, and sets the ticks.
    fn mend(&mut self, axis: &Axis, wanted: usize) {
        if !(self.low.is_finite() && self.high.is_finite() && self.low <= self.high) {
            [self.low, self.high] = [if self.scale == Scale::Log { 0.1 } else { 0.0 }, 1.0];
        }
        if self.low == self.high {
            let pad = if self.low == 0.0 { 1.0 } else { self.low.abs() / 2.0 };
            [self.low, self.high] = [self.low - pad, self.high + pad];
        }
        match self.scale {
            Scale::Linear => {
                let free = axis.limits.is_none() && axis.upright;
                if let [a, b, ..] = linear_ticks(self.low, self.high, wanted)[..]
                    && free
                {
                    let step = b - a;
                    self.low = (self.low / step + 1e-9).floor() * step;
                    self.high = (self.high / step - 1e-9).ceil() * step;
                }
                let ticks = linear_ticks(self.low, self.high, wanted);
                let step = if let [a, b, ..] = ticks[..] { b - a } else { 1.0 };
                self.ticks = ticks.into_iter().map(|tick| (tick, label(tick, step))).collect();
            }
            Scale::Log => {
                // Powers of ten may stand closer than numbers.
                let ticks = log_ticks(self.low, self.high, wanted * 3 / 2);
                self.ticks = if ticks.len() >= 2 {
                    ticks.into_iter().map(|tick| (tick, power_label(tick))).collect()
                } else {
                    // Less than two decades: a few round values serve better than one power.
                    let ticks = linear_ticks(self.low, self.high, wanted);
                    let step = if let [a, b, ..] = ticks[..] { b - a } else { 1.0 };
                    let positive = ticks.into_iter().filter(|tick| *tick > 0.0);
                    positive.map(|tick| (tick, label(tick, step))).collect()
                };
            }
        }
    }

    /// The place of `value`; `None` if it has none on this scale.
    pub fn place(&self, value: f64) -> Option<f64> {
        let share = match self.scale {
            Scale::Linear => (value - self.low) / (self.high - self.low),
            Scale::Log if value > 0.0 => (value / self.low).ln() / (self.high / self.low).ln(),
            Scale::Log => return None,
        };
        share.is_finite().then(|| self.ends[0] + share * (self.ends[1] - self.ends[0]))
    }

    /// The place at which bars begin: 0, or the end of the axis next to it.
    pub fn base(&self) -> f64 {
        let zero =
            if self.scale == Scale::Linear { 0.0_f64.clamp(self.low, self.high) } else { self.low };
        self.place(zero).unwrap_or(self.ends[0])
    }
}

/// The area of a chart between its axes.
#[derive(Debug, Clone)]
pub(super) struct Plane {
    pub x: Ruler,
    pub y: Ruler,
}

impl Plane {
    pub fn place(&self, [x, y]: [f64; 2]) -> Option<[f64; 2]> {
        Some([self.x.place(x)?, self.y.place(y)?])
    }

    pub fn left(&self) -> f64 {
        self.x.ends[0]
    }

    pub fn right(&self) -> f64 {
        self.x.ends[1]
    }

    pub fn top(&self) -> f64 {
        self.y.ends[1]
    }

    pub fn bottom(&self) -> f64 {
        self.y.ends[0]
    }

    /// Draws grid lines, tick labels and the titles of both axes.
    pub fn draw_axes(&self, svg: &mut Svg, titles: [&str; 2]) {
        for (value, label) in &self.y.ticks {
            let Some(y) = self.y.place(*value) else { continue };
            svg.line([self.left(), y], [self.right(), y], "grid");
            svg.text([self.left() - 8.0, y + 4.0], Anchor::End, "soft", label);
        }
        for (value, label) in &self.x.ticks {
            let Some(x) = self.x.place(*value) else { continue };
            svg.line([x, self.bottom()], [x, self.bottom() + 5.0], "axis");
            svg.text([x, self.bottom() + 19.0], Anchor::Middle, "soft", label);
        }
        svg.line([self.left(), self.bottom()], [self.right(), self.bottom()], "axis");
        let middle = (self.left() + self.right()) / 2.0;
        svg.text([middle, self.bottom() + 39.0], Anchor::Middle, "", titles[0]);
        // Written across the top, where it needs no turned head.
        svg.text([0.0, self.top() - 14.0], Anchor::Start, "", titles[1]);
    }
}

/// Room the tick labels of an upright axis need, for values as in `axis`.
pub(super) fn room_for_ticks(ruler: &Ruler) -> f64 {
    ruler.ticks.iter().map(|(_, label)| text_width(label)).fold(20.0, f64::max) + 14.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ruler(axis: &Axis, values: &[f64]) -> Ruler {
        Ruler::new(axis, values.iter().copied(), [0.0, 100.0])
    }

    #[test]
    fn a_decade_is_as_long_as_the_next() {
        let ruler = ruler(&Axis::log("x"), &[1.0, 100.0]);
        approx::assert_relative_eq!(ruler.place(10.0).unwrap(), 50.0, epsilon = 1e-9);
        assert_eq!(ruler.place(0.0), None);
    }

    #[test]
    fn limits_win_over_values() {
        let ruler = ruler(&Axis::linear("x").limits(0.0, 10.0), &[3.0, 70.0]);
        assert_eq!(ruler.place(5.0), Some(50.0));
        assert_eq!(ruler.place(20.0), Some(200.0));
    }

    #[test]
    fn no_values_and_one_value_still_give_an_axis() {
        for values in [&[][..], &[5.0], &[f64::NAN], &[-1.0]] {
            for axis in [Axis::linear("x"), Axis::log("x")] {
                let ruler = ruler(&axis, values);
                assert!(ruler.high > ruler.low && ruler.ticks.len() > 1, "{values:?}");
            }
        }
    }
}

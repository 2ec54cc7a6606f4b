//! The light, the background and the range at which a target is seen with a wanted probability.

use super::Forecaster;
use crate::units::{range_from_tof, s_from_fs};

/// Ranges that are tried for the farthest one at which a target is seen that is not seen at the nearest.
const PLACES: i32 = 64;

impl Forecaster<'_> {
    /// The factor on the light that gives probability `pd` to a target of `reflectance` at `range`
    /// metres; `None` where 10⁹ times the light would not.
    pub fn light_needed(&self, pd: f64, reflectance: f64, range: f64) -> Option<f64> {
        let enough = |factor: f64| self.with_light(factor).forecast(reflectance, range).pd >= pd;
        // Cells that count once a pulse are blinded by far too much of it, and taps are full.
        let most = match self.closed_form.as_ref().is_some_and(|form| form.can_be_blinded()) {
            false => 1e9,
            true => (-9..=9).map(|power| 10_f64.powi(power)).find(|factor| enough(*factor))?,
        };
        bisect(1e-9, most, enough)
    }

    /// The factor on the background that still leaves probability `pd` to a target of
    /// `reflectance` at `range` metres; `None` where not even 10⁻¹² of it does.
    pub fn background_bearable(&self, pd: f64, reflectance: f64, range: f64) -> Option<f64> {
        let bears = |divisor: f64| {
            self.with_background(1.0 / divisor).forecast(reflectance, range).pd >= pd
        };
        bisect(1e-6, 1e12, bears).map(|divisor| 1.0 / divisor)
    }

    /// The farthest range, m, at which a target of `reflectance` is seen with probability `pd`; `None` where it is
    /// seen at none. Near the sensor a target may be too bright for cells that count once.
    pub fn farthest(&self, pd: f64, reflectance: f64) -> Option<f64> {
        let scan = &self.design.scan;
        // Nearer, a sampled channel is blind with the mark it has just sent.
        let sampling = self.design.receiver.method.sampling();
        let blank = sampling.map_or(0, |known| i64::from(known.blank_ticks) + 2);
        let blind = range_from_tof(s_from_fs(blank * self.design.clock.tick_fs));
        let (nearest, farthest) = (scan.min_range.max(0.1).max(blind), 20.0 * scan.max_range);
        let lost = |range: f64| self.forecast(reflectance, range).pd < pd;
        match bisect(nearest, farthest, lost) {
            Some(range) if range <= nearest => {
                let place = |place: i32| {
                    nearest * libm::pow(farthest / nearest, f64::from(place) / f64::from(PLACES))
                };
                let last = (0..PLACES).rev().find(|at| !lost(place(*at)))?;
                bisect(place(last), place(last + 1), lost)
            }
            found => Some(found.unwrap_or(farthest)),
        }
    }
}

/// The least number from `low` to `high` for which `holds` is true, to a part in a million, if it is false
/// below and true above. `None` if it is false even for `high`.
fn bisect(low: f64, high: f64, holds: impl Fn(f64) -> bool) -> Option<f64> {
    if holds(low) {
        return Some(low);
    }
    if !holds(high) {
        return None;
    }
    let (mut low, mut high) = (low, high);
    while high / low > 1.0 + 1e-6 {
        let middle = (low * high).sqrt();
        if holds(middle) { high = middle } else { low = middle }
    }
    Some(high)
}

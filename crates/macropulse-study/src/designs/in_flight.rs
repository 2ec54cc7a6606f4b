//! Single pulses with several in flight: the usual way of laser scanners to fire on without a code.
//!
//! The times between pulses are staggered. It is unknown which of the pulses an echo belongs to, but the
//! ranges of neighbours agree only with the right one \[Rie14\]. No receiver here tells pulses apart like
//! that, so this is a bound in closed form and no design that was simulated.

use macropulse::predict::Blind;
use macropulse::units::{range_from_tof, tof_from_range};

use super::Error;
use super::bill::Bill;
use super::candidate::Candidate;
use super::requirements::Requirements;

/// Times between pulses are spread evenly over this share of their mean, from 3/4 to 5/4 of it.
const STAGGER: f64 = 0.5;

/// Most standard deviations of a difference by which ranges that agree may differ.
const AGREE: f64 = 3.0;

/// With how few channels single pulses could do if several of them may be in flight.
#[derive(Debug, Clone, PartialEq)]
pub struct InFlight {
    /// The lidar that waits, with fewer channels.
    pub candidate: Candidate,
    /// Its bill.
    pub bill: Bill,
    /// Time between its pulses, s.
    pub period: f64,
    /// The least time between pulses, s: the channel is blind about each for the share of misses that is accepted.
    pub least_period: f64,
    /// Share of the echoes that come while the channel is blind with a later pulse.
    pub hidden: f64,
    /// Pulses in flight to the farthest thing that answers.
    pub pulses: u32,
    /// Neighbours that must agree, so that no more than the false and wrong points wanted are found by chance.
    pub neighbours: u32,
}

impl InFlight {
    /// That of the lidar that is `waiting`, behind the best mirror for each number of beams. `None` where none of the
    /// numbers allowed leaves enough time.
    pub(super) fn of(required: &Requirements, waiting: &Candidate) -> Result<Option<Self>, Error> {
        let wanted = &required.wanted;
        // Blanked no longer than a coded one: what leaves later is in flight with the echoes.
        let waiting = &Candidate { is_late: false, ..waiting.clone() };
        let design = waiting.unlimited(required)?;
        let Some(blind) = design.receiver.method.sampling().and_then(Blind::at_most) else {
            return Ok(None);
        };
        let blind = f64::from(blind.between_ticks().ticks()) * design.clock.tick_fs as f64 * 1e-15;
        let least_period = blind / (1.0 - wanted.pd);
        let with = |beams: u32| {
            let holds =
                |facets: &Option<u32>| required.most_aperture(beams, *facets) >= waiting.aperture;
            let facets = required.mirrors(beams).into_iter().find(holds)?;
            let period = required.shortest_period(beams, facets);
            (period >= least_period).then_some((beams, facets, period))
        };
        let Some((beams, facets, period)) = required.parts.beams.iter().copied().find_map(with)
        else {
            return Ok(None);
        };
        let candidate = Candidate { beams, facets, ..waiting.clone() };
        let pulses = (tof_from_range(wanted.clutter_m) / period).ceil().max(1.0);
        let accepted = wanted.false_points.min(wanted.wrong_points);
        Ok(Some(Self {
            bill: Bill::of(required, &candidate)?,
            candidate,
            period,
            least_period,
            hidden: blind / period,
            pulses: pulses as u32,
            neighbours: neighbours(pulses, by_chance(wanted.precision_m, period), accepted),
        }))
    }
}

/// Probability that the range of a neighbour agrees by chance with a wrong pulse: the window of ranges that agree, over
/// the ranges between which staggering spreads them.
fn by_chance(precision: f64, period: f64) -> f64 {
    let window = 2.0 * AGREE * std::f64::consts::SQRT_2 * precision;
    (window / range_from_tof(STAGGER * period)).min(1.0)
}

/// Returns the number of neighbours that must agree, if each agrees `by_chance`. All of them then agree with
/// one of the `pulses` no more often than is `accepted`. `u32::MAX` if any number is too few.
fn neighbours(pulses: f64, by_chance: f64, accepted: f64) -> u32 {
    match by_chance < 1.0 {
        true => ((accepted / pulses).ln() / by_chance.ln()).ceil().max(0.0) as u32,
        false => u32::MAX,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 150 ns between pulses and 14 of them in flight: a window of 0.2546 m of 11.24 m agrees once in 44. For
    /// 10⁻⁴, 14·0.02265⁴ = 3.7·10⁻⁶ is rare enough, 14·0.02265³ = 1.6·10⁻⁴ is not.
    #[test]
    fn wrong_pulses_need_more_neighbours_to_agree_by_chance() {
        let chance = by_chance(0.03, 150e-9);
        approx::assert_relative_eq!(chance, 0.022646, max_relative = 1e-3);
        assert_eq!(neighbours(14.0, chance, 1e-4), 4);
        assert_eq!(neighbours(14.0, chance, 2e-4), 3);
        assert_eq!(neighbours(14.0, 1.0, 1e-4), u32::MAX);
    }
}

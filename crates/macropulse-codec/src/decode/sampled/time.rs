//! When light came, to a fraction of a tick.

use super::filter::Filtered;
use super::pulse::{Crossing, Pulse};
use super::{Mark, Sampling};

/// How far from where a mark is found a clipped sample is of it, in ticks.
const NEAR: usize = 3;

/// Share of full scale from which on a sample beside clipped ones tells where the edge of the pulse is.
const TOLD: f32 = 0.02;

/// How late the marks that count are, in ticks, as their sum tells, each weighed by how certain it is.
pub(super) fn in_time(filtered: &Filtered, counted: &[Mark], pulse: &Pulse) -> f64 {
    let mut about = [0.0; 3];
    for mark in counted {
        for (tick, sum) in about.iter_mut().enumerate() {
            let at = (mark.place + tick).checked_sub(1);
            let signal = at.and_then(|at| filtered.signal.get(at)).copied();
            *sum += mark.weight(filtered.sigma) * signal.unwrap_or(0.0);
        }
    }
    pulse.late(about)
}

/// What is known of pulses of which samples are clipped.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Clipped {
    /// How late they came, in ticks.
    pub late: f64,
    /// Photons of one of them, about.
    pub photons: f32,
}

/// The time of the marks that count if samples there are clipped, from their edges; the
/// median of the marks. `None` where none is clipped.
///
/// What is clipped where the samples tell nothing, by `doubt`, is stray light of own marks or was found
/// before: a mark just behind it is not timed by that.
pub(super) fn clipped(
    (codes, doubt): (&[i16], &[f32]),
    sampling: &Sampling,
    pulse: &Pulse,
    counted: &[Mark],
) -> Option<Clipped> {
    let is_clipped = |at: &usize| codes[*at] >= sampling.full_scale;
    let tells = |at: &usize| doubt.get(*at).is_some_and(|doubt| *doubt < f32::INFINITY);
    let mut told: Vec<(f64, f64)> = Vec::new();
    for &Mark { place, .. } in counted {
        let about = (0..=NEAR).flat_map(|apart| [place.saturating_sub(apart), place + apart]);
        let mut about = about.filter(|at| *at < codes.len() && tells(at));
        let Some(at) = about.find(is_clipped) else { continue };
        let before = (0..at).rev().find(|at| !is_clipped(at));
        let behind = (at..codes.len()).find(|at| !is_clipped(at));
        let (Some(before), Some(behind)) = (before, behind) else { continue };
        // Light that comes while stray light is still clipped has no edge of its own.
        if !tells(&(before + 1)) {
            continue;
        }
        let rises = crossing(codes, sampling, (before, 0.5));
        let falls = match sampling.held_ticks {
            0 => crossing(codes, sampling, (behind, -0.5)),
            // What follows is no edge: the pulse fell below full scale so much earlier.
            held => Crossing {
                code: f32::from(sampling.full_scale),
                tick: behind as f64 - f64::from(held) - 0.5,
            },
        };
        let (tick, photons) = pulse.between(rises, falls);
        told.push((tick - place as f64, photons));
    }
    told.sort_by(|one, other| one.0.total_cmp(&other.0));
    let middle = told.len().checked_sub(1)? / 2;
    let (late, photons) = match told.len() % 2 {
        1 => told[middle],
        _ => {
            let (one, other) = (told[middle], told[middle + 1]);
            ((one.0 + other.0) / 2.0, (one.1 + other.1) / 2.0)
        }
    };
    Some(Clipped { late, photons: photons as f32 })
}

/// Where a pulse is at a code, from the sample `at` beside clipped ones: where that sample is, or, if it is
/// too dark to tell, at full scale, by half a tick `inwards`.
fn crossing(codes: &[i16], sampling: &Sampling, (at, inwards): (usize, f64)) -> Crossing {
    let (code, full) = (f32::from(codes[at]), f32::from(sampling.full_scale));
    match code >= TOLD * full {
        true => Crossing { code, tick: at as f64 },
        false => Crossing { code: full, tick: at as f64 + inwards },
    }
}

#[cfg(test)]
mod tests {
    use super::super::STEPS_OF_TICK;
    use super::*;

    /// A pulse of a tenth of a code a photon, of deviation 1 tick, clipped at 1000 codes.
    fn sampling() -> Sampling {
        let steps = 8 * STEPS_OF_TICK as i32;
        let pulse = (-steps..=steps).map(|step| shape(step as f32 / STEPS_OF_TICK as f32));
        Sampling {
            pulse: pulse.collect(),
            excess: 1.0,
            full_scale: 1000,
            blank_ticks: 0,
            held_ticks: 0,
            recovery_ticks: 0,
            least_marks: 1,
        }
    }

    fn shape(ticks: f32) -> f32 {
        libm::expf(-ticks * ticks / 2.0) / 10.0
    }

    /// The time told of pulses of 10⁶ photons at tick 20 and so much, after which the signal swings through.
    fn told(phase: f32, swings_to: Option<i16>) -> Option<Clipped> {
        let sampling = sampling();
        let code = |tick: usize| (1e6 * shape(tick as f32 - 20.0 - phase)).min(1000.0) as i16;
        let mut codes: Vec<i16> = (0..40).map(code).collect();
        let behind = codes.iter().rposition(|code| *code == 1000).unwrap() + 1;
        codes[behind] = swings_to.unwrap_or(codes[behind]);
        let mark = Mark { place: 20, height: 1e5, doubt: 0.0 };
        clipped((&codes, &[0.0; 40]), &sampling, &Pulse::new(&sampling), &[mark])
    }

    /// Three ticks behind clipped samples of own stray light a mark comes that is not clipped. Control: where
    /// they tell something, it is taken for theirs.
    #[test]
    fn a_mark_behind_stray_light_is_not_timed_by_it() {
        let (sampling, mark) = (sampling(), Mark { place: 13, height: 1e3, doubt: 0.0 });
        let pulse = Pulse::new(&sampling);
        let mut codes = [0; 20];
        codes[5..11].fill(1000);
        codes[13] = 100;
        let mut doubt = [0.0; 20];
        assert!(clipped((&codes, &doubt), &sampling, &pulse, &[mark]).unwrap().late < -3.0);
        doubt[4..12].fill(f32::INFINITY);
        assert!(clipped((&codes, &doubt), &sampling, &pulse, &[mark]).is_none());
        // Light that is clipped, too, from where the stray light still is: only the other mark has an edge.
        codes[5..15].fill(1000);
        let other = Mark { place: 16, ..mark };
        codes[16] = 1000;
        let late = clipped((&codes, &doubt), &sampling, &pulse, &[mark, other]).unwrap().late;
        assert!(late.abs() < 0.5, "{late}");
    }

    /// At sixteen phases: to a hundredth of a tick by both edges, to a third by one and the last clipped
    /// sample.
    #[test]
    fn clipped_pulses_are_timed_though_the_signal_swings_through() {
        for step in 0..16 {
            let phase = step as f32 / 16.0;
            for (swings_to, within) in [(None, 0.01), (Some(-200), 0.3), (Some(0), 0.3)] {
                let late = told(phase, swings_to).unwrap().late;
                assert!((late - f64::from(phase)).abs() < within, "{late} for {phase}");
            }
        }
    }

    #[test]
    fn what_is_not_clipped_or_never_ends_is_not_timed_by_edges() {
        let (sampling, mark) = (sampling(), Mark { place: 2, height: 1e5, doubt: 0.0 });
        let pulse = Pulse::new(&sampling);
        assert!(clipped((&[9, 99, 999, 99, 9], &[0.0; 5]), &sampling, &pulse, &[mark]).is_none());
        assert!(clipped((&[1000; 5], &[0.0; 5]), &sampling, &pulse, &[mark]).is_none());
        assert!(clipped((&[], &[]), &sampling, &pulse, &[]).is_none());
    }
}

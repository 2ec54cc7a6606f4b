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

/// Measurements of pulses with clipped samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Clipped {
    /// How late they came, in ticks.
    pub late: f64,
    /// Photons of one of them, about.
    pub photons: f32,
    /// True if they are of one light.
    pub is_one: bool,
}

/// Returns the time of the marks that count if samples there are clipped, from their edges; the median of the
/// marks. `None` if none is clipped.
///
/// A clipped pulse lasts for many ticks, so that marks of several lights may lie in those of one word. But
/// the marks of one light rise together. If another pulse ends in one of them, that one seems to rise
/// earlier, and tells no time; none rises later.
///
/// Clipped samples at which the signal tells nothing, its `doubt` being infinite, are those of stray light or
/// of light that was found before.
pub(super) fn clipped(
    (codes, doubt): (&[i16], &[f32]),
    sampling: &Sampling,
    pulse: &Pulse,
    counted: &[Mark],
) -> Option<Clipped> {
    let is_clipped = |at: &usize| codes[*at] >= sampling.full_scale;
    let is_its_own = |at: &usize| is_clipped(at) && doubt[*at] < f32::INFINITY;
    let mut told: Vec<Told> = Vec::new();
    for &Mark { place, .. } in counted {
        let about = (0..=NEAR).flat_map(|apart| [place.saturating_sub(apart), place + apart]);
        let Some(at) = about.filter(|at| *at < codes.len()).find(is_its_own) else { continue };
        let before = (0..at).rev().find(|at| !is_clipped(at));
        let behind = (at..codes.len()).find(|at| !is_clipped(at));
        let (Some(before), Some(behind)) = (before, behind) else { continue };
        // Light that comes while stray light is still clipped has no edge of its own.
        if doubt[before + 1] == f32::INFINITY {
            continue;
        }
        let rises = crossing(codes, sampling, (before, 0.5));
        let falls = match sampling.held_ticks {
            0 => crossing(codes, sampling, (behind, -0.5)),
            // This sample is no edge: the pulse fell below full scale earlier, by the ticks held.
            held => Crossing {
                code: f32::from(sampling.full_scale),
                tick: behind as f64 - f64::from(held) - 0.5,
            },
        };
        let (tick, photons) = pulse.between(rises, falls);
        let rises = before as i64 - place as i64;
        told.push(Told { rises, late: tick - place as f64, photons });
    }
    let all = told.len();
    let latest = told.iter().map(|one| one.rises).max()?;
    told.retain(|one| one.rises + TOGETHER >= latest);
    told.sort_by(|one, other| one.late.total_cmp(&other.late));
    let (one, other) = (told[(told.len() - 1) / 2], told[told.len() / 2]);
    Some(Clipped {
        late: (one.late + other.late) / 2.0,
        photons: ((one.photons + other.photons) / 2.0) as f32,
        is_one: all == 1 || told.len() > 1,
    })
}

/// Measurements of a clipped mark, in ticks from where it is found.
#[derive(Debug, Clone, Copy)]
struct Told {
    /// The last sample before it is clipped.
    rises: i64,
    late: f64,
    photons: f64,
}

/// Marks of one light are first clipped at the same tick, or noise makes it the next one.
const TOGETHER: i64 = 1;

/// Returns the code that a pulse has at the sample `at` beside clipped ones, and the tick there. If that
/// sample is too dark to tell, it is full scale, half a tick `inwards`.
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
            coupling: None,
        }
    }

    fn shape(ticks: f32) -> f32 {
        libm::expf(-ticks * ticks / 2.0) / 10.0
    }

    /// Returns the time found for a pulse of 10⁶ photons at tick 20 + `phase`, after which the signal swings
    /// through.
    fn told(phase: f32, swings_to: Option<i16>) -> Option<Clipped> {
        let sampling = sampling();
        let code = |tick: usize| (1e6 * shape(tick as f32 - 20.0 - phase)).min(1000.0) as i16;
        let mut codes: Vec<i16> = (0..40).map(code).collect();
        let behind = codes.iter().rposition(|code| *code == 1000).unwrap() + 1;
        codes[behind] = swings_to.unwrap_or(codes[behind]);
        let mark = Mark { place: 20, height: 1e5, doubt: 0.0 };
        clipped((&codes, &[0.0; 40]), &sampling, &Pulse::new(&sampling), &[mark])
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
        let told = |codes: &[i16], doubt: &[f32], marks: &[Mark]| {
            clipped((codes, doubt), &sampling, &pulse, marks)
        };
        assert!(told(&[9, 99, 999, 99, 9], &[0.0; 5], &[mark]).is_none());
        assert!(told(&[1000; 5], &[0.0; 5], &[mark]).is_none());
        assert!(told(&[], &[], &[]).is_none());
    }

    /// Two pulses; the other one comes `later` ticks behind its place in the word. If it ends in earlier
    /// light, which is clipped for longer, the one that rises later tells the time.
    #[test]
    fn clipped_marks_of_one_light_rise_together() {
        let (sampling, pulse) = (sampling(), Pulse::new(&sampling()));
        let told = |later: f32, third: Option<f32>| {
            let light = [Some(20.0), Some(60.0 + later), third].into_iter().flatten();
            let level = |tick: f32| light.clone().map(|at| 1e6 * shape(tick - at)).sum::<f32>();
            let codes: Vec<i16> =
                (0..120).map(|tick| level(tick as f32).min(1000.0) as i16).collect();
            let places = [Some(20), Some(60), third.map(|_| 100)].into_iter().flatten();
            let marks: Vec<Mark> =
                places.map(|place| Mark { place, height: 1e4, doubt: 0.0 }).collect();
            clipped((&codes, &[0.0; 120]), &sampling, &pulse, &marks).unwrap()
        };
        assert!(told(0.0, None).is_one && told(0.4, None).is_one);
        assert!(!told(3.0, None).is_one && !told(-3.0, None).is_one);
        let merged = told(-2.0, Some(100.0));
        assert!(merged.is_one && merged.late.abs() < 0.1, "{merged:?}");
    }

    /// Light beside samples that stray light clips, or light that was found before, is not timed by those.
    #[test]
    fn clipped_samples_that_tell_nothing_are_of_other_light() {
        let (sampling, mark) = (sampling(), Mark { place: 6, height: 1e4, doubt: 0.0 });
        let (codes, pulse) = ([0, 400, 1000, 1000, 400, 200, 150, 0], Pulse::new(&sampling));
        let told = |doubt: &[f32; 8]| clipped((&codes, doubt), &sampling, &pulse, &[mark]);
        assert!(told(&[0.0; 8]).is_some());
        let blind = f32::INFINITY;
        assert!(told(&[0.0, blind, blind, blind, blind, blind, 0.0, 0.0]).is_none());
    }
}

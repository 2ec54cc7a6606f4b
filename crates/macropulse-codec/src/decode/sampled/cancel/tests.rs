//! Light that is there, and what looks like it: single shots whose marks are as strong as the test says.

use super::super::STEPS_OF_TICK;
use super::*;
use crate::code::{Codebook, Family, Keying, Separated};
use crate::decode::Receiver;
use crate::{ShotLog, decode::Sampled};

/// Noise, in photons; the signal has none of it.
const SIGMA: f32 = 36.0;

fn sampling() -> Sampling {
    let steps = 4 * STEPS_OF_TICK as i32;
    let at = |step: i32| {
        let ticks = step as f32 / STEPS_OF_TICK as f32;
        libm::expf(-ticks * ticks / 2.0) / 10.0
    };
    Sampling {
        pulse: (-steps..=steps).map(at).collect(),
        excess: 5.56,
        full_scale: 1000,
        blank_ticks: 0,
        held_ticks: 0,
        recovery_ticks: 0,
        least_marks: 2,
        coupling: None,
    }
}

/// Tests a shot whose three marks have these `heights` at a lag of 100, the `blind` ones telling nothing.
/// Returns the light found, and the signal left at the first mark with its doubt.
fn tested(heights: [f32; 3], blind: [bool; 3]) -> (Option<Found>, (f32, f32)) {
    tested_beside([0.0; 3], heights, blind)
}

/// The same when all candidates were tested once.
fn tested_again(heights: [f32; 3], blind: [bool; 3], doubt: f32) -> Option<Found> {
    tested_in(true, doubt, ([0.0; 3], heights, blind)).0
}

/// The same with `others`, the heights of other light, four ticks behind the first mark and the second, and
/// four before the last.
fn tested_beside(
    others: [f32; 3],
    heights: [f32; 3],
    blind: [bool; 3],
) -> (Option<Found>, (f32, f32)) {
    tested_in(false, 0.0, (others, heights, blind))
}

/// The same, at the first look or again, with a doubt about what was taken away from the last mark.
fn tested_in(
    is_again: bool,
    doubt_of_last: f32,
    (others, heights, blind): ([f32; 3], [f32; 3], [bool; 3]),
) -> (Option<Found>, (f32, f32)) {
    let words = Separated { length: 60, weight: 3, words: 1, gap: 15, apart: 4, later: 0, seed: 1 };
    let family = Family::separated(words).unwrap();
    let codebook = Codebook::new(family, None, 1, Keying::OnOff).unwrap();
    let (sampling, log) = (sampling(), ShotLog::of_one_channel(&[0], &[0]));
    let pulse = Pulse::new(&sampling);
    let settings = Sampled { ticks_per_chip: 1, light_ticks: 200, false_alarm: 1e-5, sampling };
    let receiver = Receiver::matched(1);
    let band = Band::new(&receiver, &settings, (&codebook, &log), 0);
    let (mut signal, mut doubt, mut codes) = (vec![0.0; 300], vec![0.0; 300], vec![0; 300]);
    for (at, late) in [4, 4, -4].into_iter().enumerate() {
        let mark = 100 + band.marks(0).nth(at).unwrap();
        for (height, late) in [(heights[at], 0), (others[at], late)] {
            for tick in -8..=8 {
                let at = (mark + late + tick) as usize;
                signal[at] += height * pulse.answer(tick as f64);
                let code = height * libm::expf(-(tick * tick) as f32 / 2.0) / 10.0;
                codes[at] = codes[at].max(code.min(1000.0) as i16);
            }
        }
        doubt[mark as usize] = match (blind[at], at) {
            (true, _) => f32::INFINITY,
            (false, 2) => doubt_of_last,
            (false, _) => 0.0,
        };
    }
    let rule = Rule::new(&band, SIGMA);
    let filtered = Filtered { signal, doubt, dark: Vec::new(), sigma: SIGMA };
    let mut residual = Residual::new((&codes, &settings.sampling), &pulse, filtered);
    if is_again {
        residual.look_again();
    }
    let candidate = Candidate { shot: 0, lag: 100, rank: 1.0 };
    let found = residual.test(&candidate, (&band, &rule)).ok();
    let first = 100 + band.marks(0).next().unwrap() as usize;
    (found, (residual.filtered.signal[first], residual.filtered.doubt[first]))
}

/// Returns the height of each of `count` equal marks whose sum is `score` standard deviations.
fn height(score: f32, count: f32) -> f32 {
    score * SIGMA / count.sqrt()
}

/// 10⁻⁵ false returns in 100 001 lags are 10⁻¹⁰ each; the normal bound of that is 6.36 σ.
#[test]
fn more_is_asked_of_words_of_which_a_mark_is_missing() {
    let all = [false; 3];
    let one = [true, false, false];
    let with = |score, count, blind| tested([height(score, count); 3], blind).0;
    assert!(with(6.33, 3.0, all).is_none() && with(6.39, 3.0, all).is_some());
    assert!(with(6.83, 2.0, one).is_none() && with(6.89, 2.0, one).is_some());
    assert!(with(100.0, 1.0, [true, true, false]).is_none());
    let margin = with(9.4, 3.0, all).unwrap().margin;
    assert_eq!((margin, with(9.4, 2.0, one).unwrap().margin), (3, 2));
}

#[test]
fn two_marks_must_be_equal() {
    let one = [true, false, false];
    assert!(tested([0.0, 900.0, 1000.0], one).0.is_some());
    assert!(tested([0.0, 600.0, 1400.0], one).0.is_none());
    // Three need not: a bright one has light of others.
    let found = tested([600.0, 600.0, 9000.0], [false; 3]).0.unwrap();
    assert!((600.0..700.0).contains(&found.photons), "{}", found.photons);
}

/// At an edge that the spot moves across, by a factor of two, when all else was taken away. Control: not at the
/// first look, nor by more, nor beside light that was taken away.
#[test]
fn two_marks_may_differ_where_nothing_else_explains_them() {
    let (one, heights) = ([true, false, false], [0.0, 600.0, 1100.0]);
    assert!(tested_again(heights, one, 0.0).is_some());
    assert!(tested(heights, one).0.is_none());
    assert!(tested_again([0.0, 600.0, 1250.0], one, 0.0).is_none());
    assert!(tested_again(heights, one, 10.0).is_none());
}

/// A mark of more than half of full scale, 5000 photons, and one of next to nothing. Control: two whose
/// strength is not known.
#[test]
fn a_mark_that_is_nearly_clipped_is_not_equal_to_a_faint_one() {
    let one = [true, false, false];
    assert!(tested([0.0, 200.0, 7000.0], one).0.is_none());
    assert!(tested([0.0, 5500.0, 9500.0], one).0.is_some());
}

/// Two marks that count, one with light of others. Noise in the other must be 4.0 deviations, with 6.36 + 0.5
/// deviations of the sum and a cap of 1.36 above that noise. Control: by the cap of three marks, 2.5, 3.4
/// would do.
#[test]
fn noise_beside_light_of_others_is_no_word_of_which_a_mark_is_missing() {
    let found = |faint| tested([0.0, SIGMA * faint, 300.0], [true, false, false]).0.is_some();
    assert!(!found(3.5) && !found(3.85) && found(4.15));
}

/// Bright light of others in one mark, and in the two others what noise alone may be. Control: light that is not so
/// far above them counts, and two that are as strong as is asked of two are found beside any.
#[test]
fn a_bright_mark_of_others_does_not_carry_two_faint_ones() {
    let found = |faint, bright| tested([faint, bright, faint], [false; 3]).0.is_some();
    let deviation = (SIGMA * SIGMA + 5.56 * 100.0).sqrt();
    assert!(found(100.0, 100.0 + 4.9 * deviation) && !found(100.0, 100.0 + 5.1 * deviation));
    assert!(!found(100.0, 1000.0) && !found(170.0, 1000.0) && found(180.0, 1000.0));
}

/// Two marks at the rims of clipped light, none of them clipped itself, and noise at the third.
#[test]
fn rims_of_clipped_light_are_no_marks() {
    let all = [false; 3];
    assert!(tested_beside([0.0, 1e5, 1e5], [110.0, 0.0, 0.0], all).0.is_none());
    // A true one is told by the marks that are left.
    let found = tested_beside([0.0, 0.0, 1e5], [600.0; 3], all).0.unwrap();
    assert_eq!((found.marks, found.is_clipped), (2, false));
}

#[test]
fn what_is_found_is_taken_away() {
    let (found, (left, doubt)) = tested([1000.0; 3], [false; 3]);
    let found = found.unwrap();
    assert_eq!((found.lag, found.marks, found.is_clipped), (100, 3, false));
    assert!(found.late.abs() < 1e-3 && (found.photons - 1000.0).abs() < 1.0, "{found:?}");
    // √(F·1000 + (4 %·1000)²).
    assert!(left.abs() < 1.0 && (doubt - 84.6).abs() < 0.1, "{left} ± {doubt}");
    let (found, (left, doubt)) = tested([100.0; 3], [false; 3]);
    assert!(found.is_none() && (left - 100.0).abs() < 1e-3 && doubt == 0.0, "{left} ± {doubt}");
    // The remains of clipped pulses tell nothing.
    let (found, (_, doubt)) = tested([1e5; 3], [false; 3]);
    assert!(found.unwrap().is_clipped && doubt == f32::INFINITY);
}

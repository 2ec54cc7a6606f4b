//! All light of macropulses without a gap is cancelled.

use super::*;
use crate::decode::Error;
use crate::decode::matched::cancel::{CLUE, NOWHERE, cancel};

/// Ticks of a band begin while light of shots is under way that its log does not know.
#[test]
fn clear_light_is_cancelled_whatever_was_sent_before() {
    let sensor = Sensor::crowded(codebook());
    let all = sensor.log(60);
    let (ticks, _) = sensor.ticks(&all, CLEAR, 3);
    let log = ShotLog { owned: 12..32, ..all.part(8..60) };
    let receiver = sensor.receiver(0.0);
    let sent = sensor.sent(&receiver, &log);
    let left = |ticks: &[u32]| {
        cancel(&sent, ticks, &mut Default::default()).unwrap().map(|cancelled| cancelled.residual)
    };
    assert_eq!(left(&ticks.tick), Some(vec![]));
    // A tick more is left where owned light may be, and passed by before.
    let (before, among) = (ticks.tick[0] + 1, sent.fired[15] as u32 + 17);
    for (more, expected) in [(before, vec![]), (among, vec![among])] {
        let mut ticks = ticks.tick.clone();
        let place = ticks.binary_search(&more).expect_err("lit already");
        ticks.insert(place, more);
        assert_eq!(left(&ticks), Some(expected));
    }
}

/// If a shot lies in the word of another one, whole bits behind it, all marks of its first bit may be those
/// of the other. N = 98 woven pairs of labels; each label of a pair fits at one lag alone.
#[test]
fn a_macropulse_that_begins_under_another_one_is_cancelled() {
    let sensor = Sensor { period: 10, ..Sensor::crowded(codebook()) };
    let (receiver, mut log) = (sensor.receiver(0.0), sensor.log(2));
    log.word = vec![1, 1];
    let mut cases = 0;
    for case in 0..15 * 15 * 4 {
        log.label = vec![1 + case / 60, 1 + case / 4 % 15];
        let sent = sensor.sent(&receiver, &log);
        let lags = [900, 890 + u32::from(case % 4) * sent.bit_length() as u32];
        let mut chance = ChaCha8Rng::seed_from_u64(1);
        let ticks = sensor.ticks_of(&log, &lags.map(|lag| vec![lag]), CLEAR, &mut chance).tick;
        let places = |shot: usize| {
            let start = sent.fired[shot] as u32 + lags[shot];
            marks_of(&sent, shot).iter().map(move |mark| start + u32::from(*mark))
        };
        let theirs: Vec<u32> = places(0).collect();
        let is_hidden = |tick: &u32| theirs.contains(tick);
        let is_first_bit_hidden =
            places(1).take(sent.in_word(1) as usize).all(|tick| is_hidden(&tick));
        let free: Vec<u32> = places(1).filter(|tick| !is_hidden(tick)).collect();
        let is_woven = free.first() < theirs.last();
        let fits_once = |shot: usize| {
            let count = counter(&sent, &ticks, shot);
            sent.reach().filter(|lag| count(*lag) == sent.weight(shot)).count() == 1
        };
        if free.len() < CLUE || !is_first_bit_hidden || !is_woven || !fits_once(0) || !fits_once(1)
        {
            continue;
        }
        cases += 1;
        let cancelled = cancel(&sent, &ticks, &mut Default::default()).unwrap().unwrap();
        assert_eq!(cancelled.residual, [0; 0], "{case}");
        assert_eq!(cancelled.lags, lags.map(i64::from), "{case}");
    }
    assert_eq!(cases, 98);
}

/// Two pairs of shots, all others dark. In each pair the later shot comes first, and the earlier one before
/// it ends: neither is the shot after the last one found. N = 35 distances between the pairs, from within the
/// light in flight to many times as far.
#[test]
fn overlapping_light_is_cancelled_however_far_from_other_light_it_is() {
    let sensor = Sensor::crowded(codebook());
    let (receiver, log) = (sensor.receiver(0.0), sensor.log(120));
    let sent = sensor.sent(&receiver, &log);
    for away in (4..109).step_by(3) {
        let mut surfaces = vec![vec![]; 120];
        for first in [3, 3 + away] {
            surfaces[first] = vec![3500];
            surfaces[first + 2] = vec![900];
        }
        let mut chance = ChaCha8Rng::seed_from_u64(1);
        let ticks = sensor.ticks_of(&log, &surfaces, CLEAR, &mut chance).tick;
        let cancelled = cancel(&sent, &ticks, &mut Default::default()).unwrap().unwrap();
        assert_eq!(cancelled.residual, [0; 0], "{away}");
        let expected =
            surfaces.iter().map(|lags| lags.first().map_or(NOWHERE, |lag| i64::from(*lag)));
        assert!(cancelled.lags.iter().copied().eq(expected), "{away}");
    }
}

/// Three bands of 40 shots: on a wall, scattered, and with false ticks. One tick in five is as early as the
/// one before it, earlier, first of all, or last. Ticks found in a row are not asked for their order, and
/// must not hide such a tick.
#[test]
fn a_tick_out_of_order_is_refused_wherever_it_is() {
    let sensor = Sensor::crowded(codebook());
    let (receiver, log) = (sensor.receiver(0.0), ShotLog { owned: 8..32, ..sensor.log(40) });
    let fall = |ticks: &Ticks| match receiver.decode(&sensor.book, &log, ticks) {
        Err(Error::TicksDoNotAscend { place, .. }) => Some(place),
        other => other.map(|_| None).unwrap(),
    };
    for (roughness, false_ticks) in [(2, 0), (300, 0), (300, 1)] {
        let weather = Weather { roughness, false_ticks, ..CLEAR };
        let (ticks, _) = sensor.ticks(&log, weather, 5);
        assert_eq!(fall(&ticks), None);
        for place in (1..ticks.tick.len() - 1).step_by(5) {
            let before = ticks.tick[place - 1];
            for wrong in [before, before - 1, 0, u32::MAX] {
                let mut ticks = ticks.clone();
                ticks.tick[place] = wrong;
                assert_eq!(fall(&ticks), Some(place + usize::from(wrong > before)));
            }
        }
    }
}

/// Bands in which counting begins anew within the light of the last shots, wherever that is: farther from the first
/// tick shots are refused.
#[test]
fn ticks_that_are_counted_beyond_the_end_are_out_of_order() {
    let sensor = Sensor::crowded(codebook());
    let (receiver, log) = (sensor.receiver(0.0), ShotLog { owned: 8..40, ..sensor.log(40) });
    let (ticks, _) = sensor.ticks(&log, CLEAR, 5);
    let fired = 39 * sensor.period;
    let first = ticks.tick.partition_point(|tick| *tick < fired) + 1;
    assert!(first + 40 < ticks.tick.len());
    for place in first..ticks.tick.len() {
        let later = u32::MAX - ticks.tick[place - 1];
        let late = |tick: &u32| tick.wrapping_add(later);
        let anew = Ticks {
            epoch: -i64::from(later),
            tick: ticks.tick.iter().map(late).collect(),
            ..Ticks::default()
        };
        let refused = receiver.decode(&sensor.book, &log, &anew).unwrap_err();
        let is_there = matches!(refused, Error::TicksDoNotAscend { place: at, .. } if at == place);
        assert!(is_there, "{place}: {refused}");
    }
}

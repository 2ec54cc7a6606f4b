//! The receiver of a sensor that is not coded: each detector listens for the ticks of its shot.

use super::{Energy, MIDDLE, Receiver, Reject, Return, Returns, Strength, Window};
use crate::ShotLog;
use crate::Ticks;

/// For each owned shot the ticks of its channel in its range gate; of more than
/// [`Receiver::returns`] those that are picked, by amplitude where it is measured.
pub(super) fn decode(receiver: &Receiver, log: &ShotLog, ticks: &Ticks) -> Returns {
    let mut returns = Returns::default();
    // Places in the list of ticks.
    let mut found: Vec<usize> = Vec::new();
    let energy = |place: usize| match ticks.amplitude.get(place) {
        Some(&photons) => Energy { photons, saturated: false },
        None => Energy::of((1, 1), 0.0, Window::WHOLE),
    };
    for shot in log.owned.clone() {
        let fired = receiver.fired(log, shot);
        let listening = match ticks.channel.is_empty() {
            true => 0..ticks.tick.len(),
            false => {
                let channel = log.channel[shot];
                ticks.channel.partition_point(|&other| other < channel)
                    ..ticks.channel.partition_point(|&other| other <= channel)
            }
        };
        let (nearest, farthest) = receiver.gate_ticks;
        let lag = |place: usize| ticks.epoch + i64::from(ticks.tick[place]) - fired;
        let channel = &ticks.tick[listening.clone()];
        let opened = fired + i64::from(nearest) - ticks.epoch;
        let first = listening.start + channel.partition_point(|&tick| i64::from(tick) < opened);
        found.clear();
        found.extend((first..listening.end).take_while(|&place| lag(place) <= i64::from(farthest)));
        if found.is_empty() {
            returns.reject(Reject::NoPeak);
        }
        let strength = |&place: &usize| Strength { peak: 1, light: energy(place).photons };
        receiver.pick.keep(receiver.returns.into(), &mut found, strength);
        for &place in &found {
            let Energy { photons, saturated } = energy(place);
            returns.push(Return {
                shot,
                tof: receiver.tof(MIDDLE)(log.fired_at_fs[shot], fired + lag(place)),
                peak: 1,
                marks: 1,
                margin: 1,
                photons,
                saturated,
            });
        }
    }
    returns
}

#[cfg(test)]
mod tests {
    use super::super::{Method, Pick};
    use super::*;
    use crate::code::Codebook;

    fn decode(log: &ShotLog, ticks: &Ticks) -> Returns {
        keep((1, Pick::First), log, ticks)
    }

    /// Decodes with `returns` returns at most, chosen by `pick`.
    fn keep((returns, pick): (u8, Pick), log: &ShotLog, ticks: &Ticks) -> Returns {
        let receiver = Receiver {
            tick_fs: 1_000_000,
            gate_ticks: (10, 500),
            returns,
            pick,
            method: Method::Direct,
        };
        receiver.decode(&Codebook::single(), log, ticks).unwrap()
    }

    /// Three shots, a microsecond apart, on detectors 0, 1 and 1.
    fn log() -> ShotLog {
        ShotLog {
            fired_at_fs: vec![0, 1_000_300_000, 2_000_000_000],
            row: vec![0; 3],
            column: vec![0, 1, 2],
            label: vec![0; 3],
            word: vec![0; 3],
            channel: vec![0, 1, 1],
            owned: 0..3,
            first: 0,
        }
    }

    #[test]
    fn the_first_tick_of_the_own_detector_counts() {
        let ticks = Ticks {
            epoch: 100,
            tick: vec![0, 50, 60, 905, 1200, 2300],
            channel: vec![0, 0, 0, 1, 1, 1],
            amplitude: vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0],
        };
        let returns = decode(&log(), &ticks);
        // Ticks of 1 ns: 100.5 ns; 1300.5 ns − 1000.3 ns, 1005 being nearer than the gate;
        // 2400.5 ns − 2000 ns.
        assert_eq!(returns.shot, [0, 1, 2]);
        for (tof, expected) in returns.tof.iter().zip([100.5e-9, 300.2e-9, 400.5e-9]) {
            approx::assert_relative_eq!(*tof, expected, max_relative = 1e-12);
        }
        assert_eq!(returns.photons, [1.0, 5.0, 6.0]);
    }

    #[test]
    fn nothing_in_the_gate_is_no_return_and_a_guard_shot_is_none_either() {
        let mut log = log();
        log.owned = 1..2;
        let ticks = Ticks { tick: vec![5, 501, 1009, 1501], ..Ticks::default() };
        let returns = decode(&log, &ticks);
        assert!(returns.is_empty());
        assert_eq!(returns.rejected(Reject::NoPeak), 1);
    }

    #[test]
    fn the_gate_includes_both_its_ends() {
        let mut log = log();
        log.owned = 0..1;
        for (tick, found) in [(9, 0), (10, 1), (500, 1), (501, 0)] {
            let ticks = Ticks { tick: vec![tick], ..Ticks::default() };
            assert_eq!(decode(&log, &ticks).len(), found, "tick {tick}");
        }
    }

    #[test]
    fn several_ticks_are_several_returns() {
        let mut log = log();
        log.owned = 0..1;
        let ticks = Ticks {
            tick: vec![5, 20, 30, 40, 50, 501],
            amplitude: vec![9.0, 3.0, 1.0, 4.0, 2.0, 9.0],
            ..Ticks::default()
        };
        let kept = |returns, pick| keep((returns, pick), &log, &ticks).photons;
        assert_eq!(kept(8, Pick::First), [3.0, 1.0, 4.0, 2.0]);
        assert_eq!(kept(2, Pick::First), [3.0, 1.0]);
        assert_eq!(kept(2, Pick::Last), [4.0, 2.0]);
        assert_eq!(kept(2, Pick::Strongest), [3.0, 4.0]);
        assert_eq!(kept(1, Pick::Strongest), [4.0]);
        assert_eq!(keep((3, Pick::Last), &log, &ticks).number, [1, 2, 3]);
        // Without amplitudes all are as strong: the nearest are kept.
        let unmeasured = Ticks { amplitude: vec![], ..ticks.clone() };
        let nearest = keep((2, Pick::Strongest), &log, &unmeasured);
        assert_eq!(nearest.tof, keep((2, Pick::First), &log, &ticks).tof);
    }
}

//! The receiver of a sensor that is not coded: each detector waits for the first tick.

use super::{Receiver, Reject, Return, Returns};
use crate::ShotLog;
use crate::Ticks;

/// For each owned shot the first tick of its channel in its range gate.
pub(super) fn decode(receiver: &Receiver, log: &ShotLog, ticks: &Ticks) -> Returns {
    let mut returns = Returns::default();
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
        let lag = |index: usize| ticks.epoch + i64::from(ticks.tick[index]) - fired;
        let channel = &ticks.tick[listening.clone()];
        let opened = fired + i64::from(nearest) - ticks.epoch;
        let first = listening.start + channel.partition_point(|&tick| i64::from(tick) < opened);
        if first == listening.end || lag(first) > i64::from(farthest) {
            returns.reject(Reject::NoPeak);
            continue;
        }
        returns.push(Return {
            shot,
            tof: receiver.tof(log.fired_at_fs[shot], fired + lag(first)),
            peak: 1,
            marks: 1,
            margin: 1,
            photons: match ticks.amplitude.get(first) {
                Some(&amplitude) => amplitude,
                None => super::photons_per_mark(1, 1, 0.0),
            },
        });
    }
    returns
}

#[cfg(test)]
mod tests {
    use super::super::ReceiverKind;
    use super::*;
    use crate::code::Codebook;

    fn decode(log: &ShotLog, ticks: &Ticks) -> Returns {
        let receiver = Receiver {
            kind: ReceiverKind::Direct,
            effort: crate::decode::Effort::Quick,
            gate_ticks: (10, 500),
            light_ticks: 500,
            ticks_per_chip: 1,
            tick_fs: 1_000_000,
            jitter_ticks: 0.0,
            false_alarm: 1e-3,
            bit_threshold: 1,
        };
        receiver.decode(&Codebook::single(), log, ticks)
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
    fn nothing_in_the_gate_is_no_return_and_a_halo_shot_is_none_either() {
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
}

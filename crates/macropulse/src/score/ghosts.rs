//! Ghosts: returns that interferers have made.
//!
//! A **ghost** is a wrong or false return that marks of interferers can have made. They arrive at places of
//! its code word: at least half the number of marks that the return was found with. A place and a mark are
//! the same if they lie within one tick, three standard deviations of the jitter and the longer micropulse of
//! both.

use std::ops::Range;

use macropulse_codec::ShotLog;

use crate::channel::Light;
use crate::design::Design;
use crate::points::{Outcome, Piece};
use crate::units::{FS_PER_S, fs_from_s, tof_from_range};

/// Counts the ghosts among the returns of a band, which are judged already, in `light`.
pub fn ghosts(piece: &Piece, design: &Design, log: &ShotLog, light: &Light) -> u64 {
    let interference = Interference::of(design, light);
    if interference.order.is_empty() {
        return 0;
    }
    let points = &piece.points;
    let is_ghost = |at: &usize| {
        let (at, shot) = (*at, piece.shot[*at] as usize);
        let outcome = points.truth.returns.outcome[at];
        if !matches!(outcome, Outcome::Wrong | Outcome::False) {
            return false;
        }
        // As the clock of the laser has it.
        let measured = f64::from(points.range[at]) - design.scan.gates().offset(log.row[shot]);
        let tof_fs = fs_from_s(tof_from_range(measured));
        let begins_fs = log.fired_at_fs[shot] + tof_fs;
        let own = design.emission.coding().codebook.marks(log.label[shot], log.word[shot]);
        let own =
            own.iter().map(|mark| begins_fs + i64::from(*mark) * design.emission.coding().chip_fs);
        2 * interference.met(own, log.channel[shot]) >= u64::from(points.peak[at]).max(1)
    };
    (0..piece.shot.len()).filter(is_ghost).count() as u64
}

/// Pulse trains of interferers, in the order in which they arrive.
struct Interference<'a> {
    light: &'a Light<'a>,
    /// Indices of the pulse trains, by time.
    order: Vec<usize>,
    /// From the first chip to the last mark, at most, fs.
    longest_fs: i64,
    tolerance_fs: i64,
}

impl<'a> Interference<'a> {
    fn of(design: &Design, light: &'a Light) -> Self {
        let trains = &light.trains;
        let is_interference = |train: &usize| trains.transmitter[*train] > 0;
        let mut order: Vec<usize> = (0..trains.len()).filter(is_interference).collect();
        order.sort_by_key(|train| trains.arrives_fs[*train]);
        let transmitters = light.transmitters.iter();
        let pulse = transmitters.fold(design.light.pulse, |most, from| most.max(from.pulse));
        let jitter_fs = 3.0 * design.detector.model().jitter() * FS_PER_S as f64;
        let lasts = |train: &usize| {
            light.arrivals_fs(*train).last().map_or(0, |last| last - trains.arrives_fs[*train])
        };
        let longest_fs = order.iter().map(lasts).max().unwrap_or(0);
        let tolerance_fs = design.clock.tick_fs + jitter_fs as i64 + fs_from_s(pulse);
        Self { light, order, longest_fs, tolerance_fs }
    }

    /// How many of the places `own`, ascending, a mark meets that the detector of `channel` sees.
    fn met(&self, own: impl Iterator<Item = i64> + Clone, channel: u16) -> u64 {
        let (Some(first), Some(last)) = (own.clone().next(), own.clone().last()) else { return 0 };
        let near = first - self.longest_fs - self.tolerance_fs..last + self.tolerance_fs + 1;
        let mut marks = Vec::new();
        for &train in &self.order[self.within(near)] {
            if self.light.trains.channel[train] == channel {
                marks.extend(self.light.arrivals_fs(train));
            }
        }
        marks.sort_unstable();
        let is_met = |place: &i64| {
            let next = marks.partition_point(|mark| *mark < place - self.tolerance_fs);
            marks.get(next).is_some_and(|mark| *mark <= place + self.tolerance_fs)
        };
        own.filter(is_met).count() as u64
    }

    /// The pulse trains, by order, whose first chips arrive in `span`.
    fn within(&self, span: Range<i64>) -> Range<usize> {
        let arrives_fs = &self.light.trains.arrives_fs;
        let before = |time: i64| self.order.partition_point(|train| arrives_fs[*train] < time);
        before(span.start)..before(span.end)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::channel::{Operating, PulseTrain, Transmitter};
    use crate::points::{Scale, Surface};
    use macropulse_codec::decode::Returns;

    /// One shot of the coded sensor that was answered from 30 m, with `outcome`; light of an interferer
    /// has the same marks, `late_fs` behind them.
    fn count(outcome: Outcome, late_fs: i64, kept: usize) -> u64 {
        let design = Design::open("kim-park-2016-fixed", &[]).unwrap();
        let log = crate::emit::Band { scan: 0, first: 0, shots: 1 }.shot_log(&design);
        let answered = Returns {
            shot: vec![0],
            number: vec![1],
            tof: vec![tof_from_range(30.0)],
            peak: vec![40],
            marks: vec![40],
            margin: vec![40],
            photons: vec![1.0],
            saturated: vec![false],
            ..Returns::default()
        };
        let scale = Scale::of(&design, &Operating::in_the_dark(&design));
        let mut piece = Piece::of(&design, &scale, &log, &answered);
        piece.points.truth.returns.push(Surface { outcome, ..Surface::NONE });
        let tof_fs = fs_from_s(tof_from_range(30.0));
        // The interferer sends what we send, without its last marks.
        let transmitters = vec![Transmitter::of(&design, 1.0); 2];
        let mut light = Light { transmitters, ..Light::default() };
        light.trains.push(PulseTrain {
            transmitter: 1,
            channel: 0,
            arrives_fs: tof_fs + late_fs,
            photons: 5.0,
            label: log.label[0],
            word: log.word[0],
            marks: [0, kept as u16],
            shot: 0,
            way: 0,
        });
        ghosts(&piece, &design, &log, &light)
    }

    #[test]
    fn a_wrong_return_in_the_marks_of_another_lidar_is_a_ghost() {
        assert_eq!(count(Outcome::Wrong, 0, 58), 1);
        assert_eq!(count(Outcome::False, 3000, 58), 1);
        // Half of the forty marks found, and fewer.
        assert_eq!(count(Outcome::Wrong, 0, 20), 1);
        assert_eq!(count(Outcome::Wrong, 0, 19), 0);
    }

    #[test]
    fn a_right_return_is_none_nor_is_one_beside_the_light() {
        for outcome in [Outcome::Right, Outcome::Near] {
            assert_eq!(count(outcome, 0, 58), 0, "{outcome:?}");
        }
        assert_eq!(count(Outcome::Wrong, 10 * 2500, 58), 0);
        assert_eq!(count(Outcome::Wrong, 1_000_000_000, 58), 0);
    }
}

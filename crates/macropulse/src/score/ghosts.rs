//! Ghosts: returns that light of other lidars has made.
//!
//! A **ghost** is a return that came out wrong or false, and of whose marks, as many as were found
//! at their place, at least half are places where a mark of another lidar arrives. A place and a
//! mark are the same if they lie within one tick, three standard deviations of the jitter and the
//! longer micropulse of both.

use std::ops::Range;

use crate::channel::Foreign;
use crate::design::Design;
use crate::points::{Outcome, Piece};
use crate::units::{FS_PER_S, fs_from_s, tof_from_range};
use macropulse_codec::ShotLog;

/// Counts the ghosts among the returns of a band, which are judged already, in the light of others
/// that is `foreign`.
pub fn ghosts(piece: &Piece, design: &Design, log: &ShotLog, foreign: &Foreign) -> u64 {
    let (light, points) = (Light::of(design, foreign), &piece.points);
    let is_ghost = |at: &usize| {
        let (at, shot) = (*at, piece.shot[*at] as usize);
        let outcome = points.truth.returns.outcome[at];
        if !matches!(outcome, Outcome::Wrong | Outcome::False) {
            return false;
        }
        let tof_fs = fs_from_s(tof_from_range(f64::from(points.range[at])));
        let begins_fs = log.fired_at_fs[shot] + tof_fs;
        let own = design.coding.codebook.marks(log.label[shot], log.word[shot]);
        let own = own.iter().map(|mark| begins_fs + i64::from(*mark) * design.coding.chip_fs);
        let met = light.met(own, (log.row[shot], log.column[shot]));
        2 * met >= u64::from(points.peak[at]).max(1)
    };
    (0..piece.shot.len()).filter(is_ghost).count() as u64
}

/// Foreign light, in the order in which it arrives.
struct Light<'a> {
    design: &'a Design,
    foreign: &'a Foreign,
    /// Entries by time.
    order: Vec<usize>,
    /// From the first chip to the last mark, at most, fs.
    longest_fs: i64,
    tolerance_fs: i64,
}

impl<'a> Light<'a> {
    fn of(design: &'a Design, foreign: &'a Foreign) -> Self {
        let mut order: Vec<usize> = (0..foreign.len()).collect();
        order.sort_by_key(|entry| foreign.arrives_fs[*entry]);
        let pulse = foreign.pulse.iter().fold(design.light.pulse, |most, pulse| most.max(*pulse));
        let jitter_fs = 3.0 * design.detector.jitter() * FS_PER_S as f64;
        Self {
            design,
            foreign,
            order,
            longest_fs: foreign.mark_fs.iter().copied().max().unwrap_or(0),
            tolerance_fs: design.tdc.tick_fs + jitter_fs as i64 + fs_from_s(pulse),
        }
    }

    /// How many of the places `own`, ascending, a foreign mark meets that the detector of `pixel`
    /// sees.
    fn met(&self, own: impl Iterator<Item = i64> + Clone, pixel: (u16, u16)) -> u64 {
        let (Some(first), Some(last)) = (own.clone().next(), own.clone().last()) else { return 0 };
        let near = first - self.longest_fs - self.tolerance_fs..last + self.tolerance_fs + 1;
        let mut marks = Vec::new();
        for &entry in &self.order[self.within(near)] {
            if self.design.channels() == 1 || self.foreign.pixel[entry] == pixel {
                let arrives_fs = self.foreign.arrives_fs[entry];
                let offsets = self.foreign.marks_of(entry).iter();
                marks.extend(offsets.map(|offset_fs| arrives_fs + offset_fs));
            }
        }
        marks.sort_unstable();
        let is_met = |place: &i64| {
            let next = marks.partition_point(|mark| *mark < place - self.tolerance_fs);
            marks.get(next).is_some_and(|mark| *mark <= place + self.tolerance_fs)
        };
        own.filter(is_met).count() as u64
    }

    /// The entries, by order, whose first chips arrive in `span`.
    fn within(&self, span: Range<i64>) -> Range<usize> {
        let before =
            |time: i64| self.order.partition_point(|entry| self.foreign.arrives_fs[*entry] < time);
        before(span.start)..before(span.end)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::points::Surface;
    use macropulse_codec::decode::Returns;

    /// One shot of the coded sensor that was answered from 30 m, with `outcome`; foreign light has
    /// the same marks, `late_fs` behind them.
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
            ..Returns::default()
        };
        let mut piece = Piece::of(&design, &log, &answered, 0);
        piece.points.truth.returns.push(Surface { outcome, ..Surface::NONE });
        let chip_fs = design.coding.chip_fs;
        let marks = design.coding.codebook.marks(log.label[0], log.word[0]);
        let mark_fs: Vec<i64> =
            marks[..kept].iter().map(|mark| i64::from(*mark) * chip_fs).collect();
        let tof_fs = fs_from_s(tof_from_range(30.0));
        let foreign = Foreign {
            arrives_fs: vec![tof_fs + late_fs],
            photons: vec![5.0],
            pulse: vec![2.5e-12],
            pixel: vec![(7, 7)],
            marks: std::iter::once(0..mark_fs.len()).collect(),
            mark_fs,
            shot: vec![0],
            way: vec![0],
        };
        ghosts(&piece, &design, &log, &foreign)
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

//! The points of one band, and how they become those of a scan.
//!
//! Bands are computed side by side. Each has a piece of its own to write to, so none waits for
//! another. The pieces in the order of the bands are the cloud; who wants it as one list has them
//! joined.

use super::{Attribute, PointCloud, Scale};
use crate::design::Design;
use crate::units::range_from_tof;
use macropulse_codec::ShotLog;
use macropulse_codec::decode::Returns;
use rayon::prelude::*;

/// The points of one band.
#[derive(Debug, Clone, Default)]
pub struct Piece {
    /// The returns. Its columns of pixels have an entry for each owned shot instead, in their order.
    pub points: PointCloud,
    /// For each return, the index of its shot in the band's log.
    pub shot: Vec<u32>,
    /// For each owned shot, the index of its pixel.
    pixel: Vec<u32>,
    /// True if these are one after the other.
    in_a_row: bool,
}

impl Piece {
    /// The returns of one band of a scan, their light told by `scale`, and the firing times of its
    /// owned shots.
    pub fn of(design: &Design, scale: &Scale, log: &ShotLog, returns: &Returns) -> Self {
        let mut piece = Self::default();
        piece.fill(design, scale, log, returns);
        piece
    }

    /// As [`Piece::of`], in the memory of what was in it before.
    pub(crate) fn fill(
        &mut self,
        design: &Design,
        scale: &Scale,
        log: &ShotLog,
        returns: &Returns,
    ) {
        self.clear();
        let scan = (log.first + log.owned.start as u64) / design.shots_per_scan();
        let points = &mut self.points;
        points.scan = scan;
        (points.rows, points.columns) = (design.scan.rows as usize, design.scan.columns as usize);
        (points.returns_per_shot, points.pick) = (design.receiver.returns, design.receiver.pick);
        points.has_speeds = design.measures_speed();
        let time_ns = |fired_at_fs: i64| fired_at_fs as f64 * 1e-6;
        let (owned, columns) = (log.owned.clone(), points.columns as u32);
        let pixels = log.row[owned.clone()].iter().zip(&log.column[owned.clone()]);
        self.pixel
            .extend(pixels.map(|(row, column)| u32::from(*row) * columns + u32::from(*column)));
        // No early end: a loop that may stop anywhere takes several times as long.
        let next = self.pixel.iter().zip(self.pixel.iter().skip(1));
        self.in_a_row = next.fold(true, |all, (before, after)| all & (*after == before + 1));
        points.fired_ns.extend(log.fired_at_fs[owned].iter().map(|fired| time_ns(*fired)));
        self.shot.extend(&returns.shot);
        points.return_number.extend(&returns.number);
        points.peak.extend(&returns.peak);
        points.marks.extend(&returns.marks);
        points.margin.extend(&returns.margin);
        points.photons.extend(returns.photons.iter().map(|&photons| scale.detected(photons)));
        points.saturated.extend(&returns.saturated);
        points.radial_velocity.extend(&returns.radial_velocity);
        // The last number among those of a shot is how many they are.
        points.number_of_returns.extend(&returns.number);
        if returns.number.iter().any(|number| *number > 1) {
            for at in (1..returns.len()).rev().filter(|&at| returns.number[at] > 1) {
                points.number_of_returns[at - 1] = points.number_of_returns[at];
            }
        }
        let fired = returns.shot.iter().map(|&shot| shot as usize);
        points.row.extend(fired.clone().map(|shot| log.row[shot]));
        points.column.extend(fired.clone().map(|shot| log.column[shot]));
        points.time_ns.extend(fired.map(|shot| time_ns(log.fired_at_fs[shot])));
        // Written in place: columns that grow one by one take longer than what they hold.
        let reals = [&mut points.x, &mut points.y, &mut points.z];
        for column in reals.into_iter().chain([&mut points.range, &mut points.intensity]) {
            column.resize(returns.len(), 0.0);
        }
        let (directions, gates) = (design.directions(), design.scan.gates());
        let beside = directions.have_origins();
        let count = returns.len();
        let (rows, columns, photons) =
            (&points.row[..count], &points.column[..count], &points.photons[..count]);
        let (x, y, z) = (&mut points.x[..count], &mut points.y[..count], &mut points.z[..count]);
        let (ranges, intensity) = (&mut points.range[..count], &mut points.intensity[..count]);
        let (tof, shots) = (&returns.tof[..count], &returns.shot[..count]);
        for at in 0..count {
            let range = range_from_tof(tof[at]) + gates.offset(rows[at]);
            let [to_x, to_y, to_z] = directions.of_shot(log, shots[at] as usize);
            let [from_x, from_y, from_z] = match beside {
                true => directions.origin(rows[at], columns[at]),
                false => [0.0; 3],
            };
            x[at] = (from_x + to_x * range) as f32;
            y[at] = (from_y + to_y * range) as f32;
            z[at] = (from_z + to_z * range) as f32;
            ranges[at] = range as f32;
            intensity[at] = scale.reflectance(photons[at], range);
        }
    }

    /// Puts `values`, an entry for each owned shot, at their pixels in `column`.
    pub(super) fn scatter<T: Copy>(&self, values: &[T], column: &mut [T]) {
        let Some(&first) = self.pixel.first() else { return };
        let row = first as usize..first as usize + values.len();
        match column.get_mut(row).filter(|_| self.in_a_row) {
            Some(places) => places.copy_from_slice(values),
            None => self.pixel.iter().zip(values).for_each(|(&pixel, &value)| {
                if let Some(place) = column.get_mut(pixel as usize) {
                    *place = value;
                }
            }),
        }
    }

    /// Forgets everything, and keeps the memory.
    fn clear(&mut self) {
        [&mut self.shot, &mut self.pixel].into_iter().for_each(Vec::clear);
        self.points.clear();
    }
}

impl PointCloud {
    /// The cloud of a scan: the properties of the whole scan from `frame`, the returns of `pieces` behind
    /// each other, and their pixels at their places. Pixels that are in none of them are empty.
    pub fn joined(frame: &Self, pieces: &[Piece]) -> Self {
        let pixels = frame.rows * frame.columns;
        let fields: Vec<_> = Attribute::fields().collect();
        // Each field by itself: which thread takes which makes no difference.
        let joined: Vec<_> = fields
            .into_par_iter()
            .with_max_len(1)
            .map(|field| field.joined(pieces, pixels))
            .collect();
        let mut cloud = frame.clone();
        joined.into_iter().for_each(|columns| columns(&mut cloud));
        cloud
    }

    /// Empties all columns, and keeps their memory.
    fn clear(&mut self) {
        Attribute::fields().for_each(|field| field.clear(self));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dark(design: &Design) -> Scale {
        Scale::of(design, &crate::channel::Operating::in_the_dark(design))
    }

    #[test]
    fn a_heavy_word_of_which_most_is_found_is_not_faint() {
        let of = |peak: u16| PointCloud {
            peak: vec![peak],
            marks: vec![60_000],
            margin: vec![1],
            saturated: vec![false],
            ..PointCloud::default()
        };
        assert_eq!(of(33_000).flags(0), 0);
        assert_eq!(of(29_999).flags(0), crate::points::FAINT);
    }

    /// One return of every owned shot, two of every second one.
    fn returns(log: &ShotLog) -> Returns {
        let mut returns = Returns::default();
        for shot in log.owned.clone() {
            let several = if shot.is_multiple_of(2) { 2 } else { 1 };
            for number in 1..=several {
                returns.shot.push(shot as u32);
                returns.number.push(number);
                returns.tof.push(1e-7 * f64::from(number));
                returns.photons.push(1.0);
                returns.saturated.push(number == 2);
                for column in [&mut returns.peak, &mut returns.marks, &mut returns.margin] {
                    column.push(u16::from(number));
                }
            }
        }
        returns
    }

    /// Six shots of one row of a scan, the rightmost first; the middle four are owned.
    fn log(row: u16, first: u16) -> ShotLog {
        let order = i64::from(row) * 1000 + i64::from(first);
        ShotLog {
            fired_at_fs: (0..6).map(|shot| (order + shot) * 40_000_000).collect(),
            row: vec![row; 6],
            column: (first..first + 6).rev().collect(),
            label: vec![1; 6],
            word: vec![1; 6],
            channel: vec![0; 6],
            owned: 1..5,
            first: 0,
        }
    }

    #[test]
    fn pieces_are_joined_in_their_order_and_pixels_find_their_place() {
        let design = Design::open("kim-park-2016-fixed", &[]).unwrap();
        let logs = [log(2, 0), log(2, 4), log(5, 100)];
        let pieces =
            logs.each_ref().map(|log| Piece::of(&design, &dark(&design), log, &returns(log)));
        let cloud = PointCloud::joined(&PointCloud::empty(&design, 8), &pieces);
        let expected = logs.iter().map(|log| returns(log).len()).sum::<usize>();
        assert_eq!((cloud.scan, cloud.returns()), (8, expected));
        assert!(cloud.time_ns.is_sorted());
        assert_eq!(cloud.fired_ns.iter().filter(|time| !time.is_nan()).count(), 12);
        for at in 0..cloud.returns() {
            let is_saturated = cloud.flags(at) & super::super::SATURATED != 0;
            assert_eq!(is_saturated, cloud.return_number[at] == 2);
            let pixel = usize::from(cloud.row[at]) * cloud.columns + usize::from(cloud.column[at]);
            assert_eq!(cloud.time_ns[at], cloud.fired_ns[pixel]);
            let next_is_further = cloud.return_number.get(at + 1) == Some(&2);
            let is_last = cloud.return_number[at] == cloud.number_of_returns[at];
            assert_eq!(is_last, !next_is_further, "{at}");
        }
    }
}

//! The points of one band, and how they become those of a scan.
//!
//! Bands are computed side by side. Each has a piece of its own to write to, so none waits for
//! another; the pieces are joined in the order of the bands.

use std::iter::repeat_n;

use super::{NO_OBJECT, Outcome, PointCloud};
use crate::channel::Link;
use crate::design::Design;
use crate::units::range_from_tof;
use macropulse_codec::ShotLog;
use macropulse_codec::decode::Returns;

/// The points of one band.
#[derive(Debug, Clone, Default)]
pub struct Piece {
    /// The returns. Its columns of pixels have an entry for each owned shot instead, in their order.
    pub points: PointCloud,
    /// For each return, the index of its shot in the band's log.
    pub shot: Vec<u32>,
    /// For each owned shot, the index of its pixel.
    pixel: Vec<u32>,
}

impl Piece {
    /// The returns of one band of a scan, and the firing times of its owned shots.
    pub fn of(design: &Design, log: &ShotLog, returns: &Returns, scan: u64) -> Self {
        let mut piece = Self::default();
        piece.fill(design, log, returns, scan);
        piece
    }

    /// As [`Piece::of`], in the memory of what was in it before.
    ///
    /// Intensity is the photons a mark brought over the photons a white surface seen square on
    /// would have brought from the same range; 1 for a detector without a photon scale.
    pub(crate) fn fill(&mut self, design: &Design, log: &ShotLog, returns: &Returns, scan: u64) {
        self.clear();
        let points = &mut self.points;
        points.scan = scan;
        (points.rows, points.columns) = (design.scan.rows as usize, design.scan.columns as usize);
        (points.returns_per_shot, points.pick) = (design.receiver.returns, design.receiver.pick);
        let scan_start = scan as f64 * design.scan_period() * 1e9;
        let time_ns = |shot: usize| log.fired_at_fs[shot] as f64 * 1e-6 - scan_start;
        let pixel = |shot: usize| {
            usize::from(log.row[shot]) * points.columns + usize::from(log.column[shot])
        };
        self.pixel.extend(log.owned.clone().map(|shot| pixel(shot) as u32));
        points.fired_ns.extend(log.owned.clone().map(time_ns));
        self.shot.extend(&returns.shot);
        points.return_number.extend(&returns.number);
        points.peak.extend(&returns.peak);
        points.marks.extend(&returns.marks);
        points.margin.extend(&returns.margin);
        points.photons.extend(&returns.photons);
        let mut first = 0;
        while let Some((_, rest)) = returns.number[first..].split_first() {
            let further = rest.iter().take_while(|&&number| number > 1).count();
            points.number_of_returns.extend(repeat_n(further as u8 + 1, further + 1));
            first += further + 1;
        }
        let link = Link::of(design);
        let directions = design.directions();
        for (&shot, (&tof, &photons)) in
            returns.shot.iter().zip(returns.tof.iter().zip(&returns.photons))
        {
            let shot = shot as usize;
            let (row, column) = (log.row[shot], log.column[shot]);
            let range = range_from_tof(tof);
            let [x, y, z] = directions.of(row, column);
            let white = link.photons(1.0, range);
            let intensity =
                if white.is_finite() { (f64::from(photons) / white) as f32 } else { 1.0 };
            points.row.push(row);
            points.column.push(column);
            points.x.push((x * range) as f32);
            points.y.push((y * range) as f32);
            points.z.push((z * range) as f32);
            points.range.push(range as f32);
            points.intensity.push(intensity);
            points.time_ns.push(time_ns(shot));
        }
    }

    /// Forgets everything, and keeps the memory.
    fn clear(&mut self) {
        let points = &mut self.points;
        [&mut self.shot, &mut self.pixel].into_iter().for_each(Vec::clear);
        [&mut points.row, &mut points.column, &mut points.peak].into_iter().for_each(Vec::clear);
        [&mut points.marks, &mut points.margin].into_iter().for_each(Vec::clear);
        [&mut points.return_number, &mut points.number_of_returns].into_iter().for_each(Vec::clear);
        [&mut points.x, &mut points.y, &mut points.z].into_iter().for_each(Vec::clear);
        [&mut points.intensity, &mut points.range, &mut points.photons]
            .into_iter()
            .for_each(Vec::clear);
        [&mut points.time_ns, &mut points.fired_ns].into_iter().for_each(Vec::clear);
        points.truth.returns.clear();
        points.truth.pixels.clear();
    }
}

impl PointCloud {
    /// Makes it the cloud of scan number `scan` that has the `pieces`, in their order, in the memory
    /// of what was in it before. Pixels of no piece are empty.
    pub fn join(&mut self, scan: u64, pieces: &[Piece]) {
        self.scan = scan;
        let target = Target {
            pieces,
            pixels: self.rows * self.columns,
            covered: pieces.iter().map(|piece| piece.pixel.len()).sum(),
        };
        let truth = &mut self.truth;
        let (seen, first) = (&mut truth.returns, &mut truth.pixels);
        let bytes: [(_, Column<u8>); 2] = [
            (&mut self.return_number, |points| &points.return_number),
            (&mut self.number_of_returns, |points| &points.number_of_returns),
        ];
        let counts: [(_, Column<u16>); 7] = [
            (&mut self.row, |points| &points.row),
            (&mut self.column, |points| &points.column),
            (&mut self.peak, |points| &points.peak),
            (&mut self.marks, |points| &points.marks),
            (&mut self.margin, |points| &points.margin),
            (&mut seen.object, |points| &points.truth.returns.object),
            (&mut seen.material, |points| &points.truth.returns.material),
        ];
        let reals: [(_, Column<f32>); 8] = [
            (&mut self.x, |points| &points.x),
            (&mut self.y, |points| &points.y),
            (&mut self.z, |points| &points.z),
            (&mut self.intensity, |points| &points.intensity),
            (&mut self.range, |points| &points.range),
            (&mut self.photons, |points| &points.photons),
            (&mut seen.range, |points| &points.truth.returns.range),
            (&mut seen.cosine, |points| &points.truth.returns.cosine),
        ];
        let real_pixels: [(_, Column<f32>); 2] = [
            (&mut first.range, |points| &points.truth.pixels.range),
            (&mut first.cosine, |points| &points.truth.pixels.cosine),
        ];
        let named_pixels: [(_, Column<u16>); 2] = [
            (&mut first.object, |points| &points.truth.pixels.object),
            (&mut first.material, |points| &points.truth.pixels.material),
        ];
        let target = &target;
        // Each column by itself: which thread takes which makes no difference.
        rayon::scope(|scope| {
            for (column, of) in bytes {
                scope.spawn(move |_| target.append(column, of));
            }
            for (column, of) in counts {
                scope.spawn(move |_| target.append(column, of));
            }
            for (column, of) in reals {
                scope.spawn(move |_| target.append(column, of));
            }
            for (column, of) in real_pixels {
                scope.spawn(move |_| target.scatter(column, of, f32::NAN));
            }
            for (column, of) in named_pixels {
                scope.spawn(move |_| target.scatter(column, of, NO_OBJECT));
            }
            let (time_ns, fired_ns) = (&mut self.time_ns, &mut self.fired_ns);
            let (of_returns, of_pixels) = (&mut seen.outcome, &mut first.outcome);
            scope.spawn(|_| target.append(time_ns, |points| &points.time_ns));
            scope.spawn(|_| target.scatter(fired_ns, |points| &points.fired_ns, f64::NAN));
            scope.spawn(|_| target.append(of_returns, |points| &points.truth.returns.outcome));
            let empty = Outcome::Empty;
            scope.spawn(move |_| {
                target.scatter(of_pixels, |points| &points.truth.pixels.outcome, empty);
            });
        });
    }
}

/// A column of a cloud.
type Column<T> = fn(&PointCloud) -> &Vec<T>;

/// What is joined, and where it goes.
struct Target<'a> {
    pieces: &'a [Piece],
    pixels: usize,
    /// Pixels that the pieces have.
    covered: usize,
}

impl Target<'_> {
    /// Makes `column` that of all pieces, one after the other.
    fn append<T: Copy>(&self, column: &mut Vec<T>, of: Column<T>) {
        column.clear();
        column.reserve(self.pieces.iter().map(|piece| of(&piece.points).len()).sum());
        self.pieces.iter().for_each(|piece| column.extend_from_slice(of(&piece.points)));
    }

    /// Puts the entries of all pieces at their pixels, `none` elsewhere; and nothing if the pieces
    /// have no such column.
    fn scatter<T: Copy>(&self, column: &mut Vec<T>, of: Column<T>, none: T) {
        let is_known = |piece: &Piece| of(&piece.points).len() == piece.pixel.len();
        if column.len() != self.pixels || self.covered < self.pixels {
            column.clear();
            column.resize(self.pixels, none);
        }
        if !self.pieces.iter().all(is_known) {
            return column.clear();
        }
        for piece in self.pieces {
            for (&pixel, &value) in piece.pixel.iter().zip(of(&piece.points)) {
                if let Some(place) = column.get_mut(pixel as usize) {
                    *place = value;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
        let mut cloud = PointCloud::empty(&design, 0);
        // Of a scan before, something is left over.
        cloud.range = vec![1.0; 9];
        let logs = [log(2, 0), log(2, 4), log(5, 100)];
        let pieces = logs.each_ref().map(|log| Piece::of(&design, log, &returns(log), 0));
        cloud.join(0, &pieces);
        let expected = logs.iter().map(|log| returns(log).len()).sum::<usize>();
        assert_eq!((cloud.scan, cloud.returns()), (0, expected));
        assert!(cloud.time_ns.is_sorted());
        assert_eq!(cloud.fired_ns.iter().filter(|time| !time.is_nan()).count(), 12);
        for at in 0..cloud.returns() {
            let pixel = usize::from(cloud.row[at]) * cloud.columns + usize::from(cloud.column[at]);
            assert_eq!(cloud.time_ns[at], cloud.fired_ns[pixel]);
            let next_is_further = cloud.return_number.get(at + 1) == Some(&2);
            let is_last = cloud.return_number[at] == cloud.number_of_returns[at];
            assert_eq!(is_last, !next_is_further, "{at}");
        }
        assert!(cloud.truth.pixels.outcome.is_empty());
        cloud.join(8, &[]);
        assert_eq!((cloud.scan, cloud.returns()), (8, 0));
        assert!(cloud.fired_ns.iter().all(|time| time.is_nan()));
    }
}

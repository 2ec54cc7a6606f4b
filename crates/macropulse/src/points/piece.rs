//! The points of one band, and how they become those of a scan.
//!
//! Bands are computed side by side. Each has a piece of its own to write to, so none waits for
//! another; the pieces are joined in the order of the bands.

use std::iter::repeat_n;

use super::PointCloud;
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
    /// Whether these are one after the other.
    in_a_row: bool,
}

impl Piece {
    /// The returns of one band of a scan, by the `link` of the sensor through its air, and the firing
    /// times of its owned shots.
    pub fn of(design: &Design, link: &Link, log: &ShotLog, returns: &Returns) -> Self {
        let mut piece = Self::default();
        piece.fill(design, link, log, returns);
        piece
    }

    /// As [`Piece::of`], in the memory of what was in it before.
    ///
    /// Intensity is the photons a mark brought over the photons a white surface seen square on
    /// would have brought from the same range; 1 for a detector without a photon scale.
    pub(crate) fn fill(&mut self, design: &Design, link: &Link, log: &ShotLog, returns: &Returns) {
        self.clear();
        let scan = (log.first + log.owned.start as u64) / design.shots_per_scan();
        let points = &mut self.points;
        points.scan = scan;
        (points.rows, points.columns) = (design.scan.rows as usize, design.scan.columns as usize);
        (points.returns_per_shot, points.pick) = (design.receiver.returns, design.receiver.pick);
        let time_ns = |shot: usize| log.fired_at_fs[shot] as f64 * 1e-6;
        let pixel = |shot: usize| {
            usize::from(log.row[shot]) * points.columns + usize::from(log.column[shot])
        };
        self.pixel.extend(log.owned.clone().map(|shot| pixel(shot) as u32));
        self.in_a_row = self.pixel.windows(2).all(|pair| pair[1] == pair[0] + 1);
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
        let fired = returns.shot.iter().map(|&shot| shot as usize);
        points.row.extend(fired.clone().map(|shot| log.row[shot]));
        points.column.extend(fired.clone().map(|shot| log.column[shot]));
        points.time_ns.extend(fired.map(time_ns));
        points.range.extend(returns.tof.iter().map(|&tof| range_from_tof(tof) as f32));
        points.intensity.extend(returns.tof.iter().zip(&returns.photons).map(
            |(&tof, &photons)| {
                let white = link.photons(1.0, range_from_tof(tof));
                if white.is_finite() { (f64::from(photons) / white) as f32 } else { 1.0 }
            },
        ));
        let directions = design.directions();
        // Written in place: three columns that grow one by one take longer than what they hold.
        for column in [&mut points.x, &mut points.y, &mut points.z] {
            column.resize(returns.len(), 0.0);
        }
        let pixels = points.row.iter().zip(&points.column);
        let places = points.x.iter_mut().zip(points.y.iter_mut().zip(&mut points.z));
        for (((&row, &column), &tof), (x, (y, z))) in pixels.zip(&returns.tof).zip(places) {
            let range = range_from_tof(tof);
            let point = directions.of(row, column).map(|part| (part * range) as f32);
            [*x, *y, *z] = point;
        }
    }

    /// Forgets everything, and keeps the memory.
    fn clear(&mut self) {
        [&mut self.shot, &mut self.pixel].into_iter().for_each(Vec::clear);
        self.points.clear();
    }
}

impl PointCloud {
    /// Makes it the cloud of scan number `scan`, with no return yet and all pixels empty, in the memory
    /// of what was in it before. Of a `whole` scan every pixel is written in any case.
    pub fn start(&mut self, scan: u64, whole: bool) {
        self.scan = scan;
        self.clear_returns();
        let pixels = self.rows * self.columns;
        if !whole || self.fired_ns.len() != pixels || self.truth.pixels.outcome.len() != pixels {
            self.fired_ns.clear();
            self.fired_ns.resize(pixels, f64::NAN);
            self.truth.pixels.blank(pixels);
        }
    }

    /// Empties all columns, and keeps their memory.
    fn clear(&mut self) {
        self.clear_returns();
        self.fired_ns.clear();
        self.truth.pixels.clear();
    }

    /// Empties the columns of returns.
    fn clear_returns(&mut self) {
        let bytes = [&mut self.return_number, &mut self.number_of_returns];
        let counts = [&mut self.row, &mut self.column, &mut self.peak];
        let counts = counts.into_iter().chain([&mut self.marks, &mut self.margin]);
        let reals = [&mut self.x, &mut self.y, &mut self.z, &mut self.intensity];
        let reals = reals.into_iter().chain([&mut self.range, &mut self.photons]);
        bytes.into_iter().for_each(Vec::clear);
        counts.for_each(Vec::clear);
        reals.for_each(Vec::clear);
        self.time_ns.clear();
        self.truth.returns.clear();
    }

    /// Adds the next `pieces`, in their order.
    pub fn append(&mut self, pieces: &[Piece]) {
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
        // Each column by itself: which thread takes which makes no difference.
        rayon::scope(|scope| {
            for (column, of) in bytes {
                scope.spawn(move |_| append(pieces, column, of));
            }
            for (column, of) in counts {
                scope.spawn(move |_| append(pieces, column, of));
            }
            for (column, of) in reals {
                scope.spawn(move |_| append(pieces, column, of));
            }
            for (column, of) in real_pixels {
                scope.spawn(move |_| scatter(pieces, column, of));
            }
            for (column, of) in named_pixels {
                scope.spawn(move |_| scatter(pieces, column, of));
            }
            let (time_ns, fired_ns) = (&mut self.time_ns, &mut self.fired_ns);
            let (of_returns, of_pixels) = (&mut seen.outcome, &mut first.outcome);
            scope.spawn(|_| append(pieces, time_ns, |points| &points.time_ns));
            scope.spawn(|_| scatter(pieces, fired_ns, |points| &points.fired_ns));
            scope.spawn(|_| append(pieces, of_returns, |points| &points.truth.returns.outcome));
            scope.spawn(|_| scatter(pieces, of_pixels, |points| &points.truth.pixels.outcome));
        });
    }
}

/// A column of a cloud.
type Column<T> = fn(&PointCloud) -> &Vec<T>;

/// Adds the column of all `pieces` to `column`, one after the other.
fn append<T: Copy>(pieces: &[Piece], column: &mut Vec<T>, of: Column<T>) {
    pieces.iter().for_each(|piece| column.extend_from_slice(of(&piece.points)));
}

/// Puts the entries of all `pieces` at their pixels.
fn scatter<T: Copy>(pieces: &[Piece], column: &mut [T], of: Column<T>) {
    for piece in pieces {
        let (values, Some(&first)) = (of(&piece.points), piece.pixel.first()) else { continue };
        let row = first as usize..first as usize + values.len();
        match column.get_mut(row).filter(|_| piece.in_a_row) {
            Some(places) => places.copy_from_slice(values),
            None => piece.pixel.iter().zip(values).for_each(|(&pixel, &value)| {
                if let Some(place) = column.get_mut(pixel as usize) {
                    *place = value;
                }
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dark(design: &Design) -> Link {
        crate::channel::Operating::in_the_dark(design).link
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
        let pieces =
            logs.each_ref().map(|log| Piece::of(&design, &dark(&design), log, &returns(log)));
        cloud.start(0, false);
        cloud.append(&pieces[..2]);
        cloud.append(&pieces[2..]);
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
        cloud.start(8, false);
        assert_eq!((cloud.scan, cloud.returns()), (8, 0));
        assert!(cloud.fired_ns.iter().all(|time| time.is_nan()));
    }
}

//! Reads PTX, the text in which Leica Cyclone exchanges scans: every scan is a cloud \[PTX\].
//!
//! A scan begins with a header of ten lines: its columns, its rows, the position and the axes of the scanner,
//! and a matrix of four lines M. A point follows on each line, columns × rows of them: x, y, z in the frame of
//! the scanner, an intensity, and a colour if there is one. (x y z 1)·M is where it lies in the world. A point
//! at (0, 0, 0) is none.

use glam::{DMat3, DQuat};

use super::CloudRoom;
use super::about::About;
use super::attributes::Attribute;
use super::cloud_file::{CloudFile, Scans};
use super::table::{Digits, Gathered, Record, cut_short};
use crate::points::{PointCloud, Viewpoint};

/// Lines between the numbers of columns and rows and the points: the place of the scanner, and the matrix.
const PLACES: usize = 4;
const MATRIX: usize = 4;

/// How far the axes of a matrix of text may be from those of a turn.
const SKEW: f64 = 1e-3;

/// The clouds of a PTX file, one for each of its scans, in the frame of the scanner.
pub(super) struct PtxScans {
    lines: Lines,
    count: usize,
    next: usize,
    is_over: bool,
    about: About,
}

impl PtxScans {
    /// Finds the scans of the file.
    pub fn open(file: CloudFile, room: CloudRoom) -> Result<Self, String> {
        let mut lines = Lines { file, number: 0 };
        let count = count(&mut lines)?;
        lines.file.go_to(0)?;
        lines.number = 0;
        let about = About { is_of_driver: true, ..About::within(room) };
        Ok(Self { lines, count, next: 0, is_over: false, about })
    }

    /// The cloud of the scan that begins here.
    fn read(&mut self) -> Result<PointCloud, String> {
        let lines = &mut self.lines;
        let Header { columns, rows, viewpoint } = Header::of(lines)?;
        let points = columns.checked_mul(rows).ok_or("columns × rows is beyond all bounds")?;
        let About { left_out, room, .. } = std::mem::take(&mut self.about);
        let about = About { is_of_driver: true, left_out, viewpoint, ..About::within(room) };
        self.about = about;
        let mut gathered: Option<Gathered> = None;
        for at in 0..points {
            let number = lines.number + 1;
            let Some(line) = lines.next()? else {
                return Err(cut_short(at as u64, points as u64));
            };
            let place = |fault: &str| format!("line {number}: {fault}");
            let numbers = line.split_ascii_whitespace().map(str::parse::<f64>);
            let numbers: Vec<f64> = numbers.collect::<Result<_, _>>().map_err(|_| {
                place("a point is x y z, an intensity, and a colour if there is one: numbers alone")
            })?;
            let &[x, y, z, ref more @ ..] = &numbers[..] else {
                return Err(place("it has fewer than three numbers"));
            };
            let gathered = match &mut gathered {
                Some(gathered) => gathered,
                None => gathered.insert(self.about.begin(more.len(), points as u64)?),
            };
            let mut record = Record::default();
            for (attribute, number) in PLACED.into_iter().zip([x, y, z].iter().chain(more)) {
                record.set(at, attribute, *number)?;
            }
            gathered.add(record);
        }
        match gathered {
            Some(gathered) => gathered.cloud(&mut self.about),
            None => self.about.begin(0, 0)?.cloud(&mut self.about),
        }
    }
}

/// Attributes of the first numbers of a point.
const PLACED: [Attribute; 4] = [Attribute::X, Attribute::Y, Attribute::Z, Attribute::Intensity];

impl About {
    /// A cloud of `points` points, each with `more` numbers behind its coordinates.
    fn begin(&mut self, more: usize, points: u64) -> Result<Gathered, String> {
        // Behind x, y and z alone stands a colour.
        let has_intensity = matches!(more, 1 | 4);
        let attributes = if has_intensity { &PLACED[..] } else { &PLACED[..3] };
        let colours = ["red", "green", "blue"];
        let is_colour = more >= 3;
        colours.iter().filter(|_| is_colour).for_each(|name| self.left_out.field(name));
        let gathered = Gathered::new(self, attributes, Digits::AsWritten)?;
        gathered.expect(points)?;
        Ok(gathered)
    }
}

impl Scans for PtxScans {
    fn count(&self) -> usize {
        self.count
    }

    fn about(&self) -> &About {
        &self.about
    }

    fn advance(&mut self) -> Option<Result<PointCloud, String>> {
        let is_first = self.next == 0;
        if self.is_over || !is_first && self.lines.file.is_blank().unwrap_or(false) {
            return None;
        }
        self.next += 1;
        let read = self.read().map_err(|fault| match self.count {
            0 | 1 => fault,
            all => format!("scan {} of {all}: {fault}", self.next),
        });
        // Behind a fault nobody knows where the next one begins.
        self.is_over = read.is_err();
        Some(read)
    }
}

/// Counts the scans that begin in a file; the last one may be cut short.
fn count(lines: &mut Lines) -> Result<usize, String> {
    let mut scans = 0;
    while !lines.file.is_blank()? {
        let mut size = || {
            let line = lines.next()?;
            Ok::<_, String>(line.and_then(|line| line.trim().parse::<usize>().ok()))
        };
        let (Some(columns), Some(rows)) = (size()?, size()?) else { break };
        scans += 1;
        let points = columns.saturating_mul(rows);
        for _ in 0..points.saturating_add(PLACES + MATRIX) {
            if lines.next()?.is_none() {
                return Ok(scans);
            }
        }
    }
    Ok(scans)
}

/// The lines of a file.
struct Lines {
    file: CloudFile,
    /// Lines that were read.
    number: usize,
}

impl Lines {
    /// The next line; `None` at the end of the file.
    fn next(&mut self) -> Result<Option<&str>, String> {
        let line = self.file.line()?;
        self.number += usize::from(line.is_some());
        let text =
            line.map(|line| std::str::from_utf8(line).map_err(|_| "it is not text in UTF-8"));
        Ok(text.transpose()?)
    }
}

/// The lines before the points of a scan.
struct Header {
    columns: usize,
    rows: usize,
    viewpoint: Viewpoint,
}

impl Header {
    fn of(lines: &mut Lines) -> Result<Self, String> {
        let [columns, rows] = [size(lines, "columns")?, size(lines, "rows")?];
        for _ in 0..PLACES {
            numbers::<3>(lines, "the position or an axis of the scanner")?;
        }
        let mut matrix = [[0.0; 4]; MATRIX];
        for line in &mut matrix {
            *line = numbers(lines, "a line of the matrix")?;
        }
        let viewpoint =
            viewpoint(matrix).map_err(|fault| format!("line {}: {fault}", lines.number))?;
        Ok(Self { columns, rows, viewpoint })
    }
}

/// The number on the next line.
fn size(lines: &mut Lines, what: &str) -> Result<usize, String> {
    let number = lines.number + 1;
    let text = lines.next()?.unwrap_or_default().trim();
    text.parse().map_err(|_| format!("line {number}: `{}` is no number of {what}", shortened(text)))
}

/// The numbers on the next line.
fn numbers<const N: usize>(lines: &mut Lines, what: &str) -> Result<[f64; N], String> {
    let line = lines.next()?.unwrap_or_default();
    let numbers = line.split_ascii_whitespace().map(str::parse::<f64>);
    let numbers: Option<Vec<f64>> = numbers.collect::<Result<_, _>>().ok();
    numbers
        .and_then(|numbers| <[f64; N]>::try_from(numbers).ok())
        .ok_or_else(|| format!("line {}: {what} are {N} numbers", lines.number))
}

/// The beginning of a text that may be long.
fn shortened(text: &str) -> String {
    text.chars().take(40).collect()
}

/// The pose that a matrix gives to the scanner: the last line is its position, and the others are its axes in
/// the world.
fn viewpoint(matrix: [[f64; 4]; MATRIX]) -> Result<Viewpoint, String> {
    let [x, y, z, [east, north, up, one]] = matrix;
    let axes = [x, y, z].map(|[x, y, z, _]| [x, y, z]);
    let turn = DMat3::from_cols_array_2d(&axes);
    let product = turn.transpose() * turn - DMat3::IDENTITY;
    let is_turn = turn.determinant() > 0.0
        && product.to_cols_array().iter().all(|entry| entry.abs() <= SKEW)
        && (one - 1.0).abs() <= SKEW
        && [east, north, up].iter().all(|number| number.is_finite());
    if !is_turn {
        return Err(
            "the matrix is no turn and shift: scans that are scaled or mirrored are not read"
                .to_owned(),
        );
    }
    let DQuat { x, y, z, w } = DQuat::from_mat3(&turn).normalize();
    Ok(Viewpoint { position: [east, north, up], turn: [w, x, y, z] })
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// The example of a maker of other readers, who says where its points lie in the world.
    const SAMPLE: &str = "3\n3\n0.000000 0.000000 0.000000\n1.000000 0.000000 0.000000\n\
        0.000000 1.000000 0.000000\n0.000000 0.000000 1.000000\n\
        -0.955179 0.296021 -0.002106 0.000000\n-0.296023 -0.955180 0.001152 0.000000\n\
        -0.001670 0.001724 0.999997 0.000000\n3.847211 12.235314 -0.425777 1.000000\n\
        1.111111 2.111111 3.111 0.111\n1.222222 2.222222 3.222 0.212\n0 0 0 0\n0 0 0 0 \n\
        1.333333 2.333333 3.333 0.312\n1.444444 2.444444 3.444 0.423\n0 0 0 0\n\
        1.555555 2.555555 3.555 0.534\n1.666666 2.666666 3.666 0.678\n";

    /// Positions of the points of the example \[PTX\] according to LAStools.
    const WORLD: [[f64; 3]; 6] = [
        [2.156, 10.553, 2.685],
        [2.017, 10.480, 2.796],
        [1.877, 10.407, 2.907],
        [1.738, 10.334, 3.018],
        [1.599, 10.261, 3.129],
        [1.460, 10.188, 3.240],
    ];

    fn all(text: &str) -> Vec<Result<PointCloud, String>> {
        let mut scans =
            PtxScans::open(CloudFile::of_bytes(text.as_ref()), CloudRoom::default()).unwrap();
        std::iter::from_fn(|| scans.advance()).collect()
    }

    fn in_the_world(cloud: &PointCloud, at: usize) -> [f64; 3] {
        let [w, x, y, z] = cloud.viewpoint.turn;
        let turned = DQuat::from_xyzw(x, y, z, w) * glam::DVec3::from(cloud.position(at));
        (turned + glam::DVec3::from(cloud.viewpoint.position)).to_array()
    }

    #[test]
    fn points_lie_where_another_reader_puts_them() {
        let cloud = all(SAMPLE).remove(0).unwrap();
        assert_eq!((cloud.returns(), &cloud.intensity[..2]), (6, &[0.111, 0.212][..]));
        for (at, world) in WORLD.into_iter().enumerate() {
            for (found, right) in in_the_world(&cloud, at).into_iter().zip(world) {
                assert_relative_eq!(found, right, epsilon = 1e-3);
            }
        }
    }

    #[test]
    fn every_scan_is_a_cloud_with_its_own_pose() {
        let coloured = SAMPLE.replace("0.111\n", "0.111 1 2 3\n").replace("12.235314", "20.5");
        let coloured = coloured.replace("3\n3\n", "1\n1\n");
        let coloured: String = coloured.split_inclusive('\n').take(11).collect();
        let text = format!("{SAMPLE}{coloured}\n\n");
        let mut scans =
            PtxScans::open(CloudFile::of_bytes(text.as_ref()), CloudRoom::default()).unwrap();
        assert_eq!(scans.count(), 2);
        let clouds: Vec<_> = std::iter::from_fn(|| scans.advance()).map(Result::unwrap).collect();
        assert_eq!(clouds.iter().map(PointCloud::returns).collect::<Vec<_>>(), [6, 1]);
        assert_eq!(clouds[1].viewpoint.position, [3.847211, 20.5, -0.425777]);
        let told = scans.about().left_out.to_string();
        assert_eq!(told, "fields red, green, blue; 3 points at (0, 0, 0)");
    }

    #[test]
    fn what_is_wrong_is_told_with_its_line() {
        for (wrong, right, said) in [
            ("three", "3", "line 1: `three` is no number of columns"),
            ("1.000000 0.000000\n", "1.000000 0.000000 0.000000\n", "line 4: the position or an"),
            ("2.956023", "-0.296023", "line 10: the matrix is no turn and shift"),
            ("far", "3.111", "line 11: a point is x y z"),
            (
                "1.1\n",
                "1.111111 2.111111 3.111 0.111\n",
                "line 11: it has fewer than three numbers",
            ),
            ("4", "3", "it ends after 9 of 12 points; the file was cut short"),
        ] {
            assert!(SAMPLE.contains(right), "{right}");
            let told = all(&SAMPLE.replacen(right, wrong, 1)).remove(0).unwrap_err();
            assert!(told.starts_with(said) && !told.contains('\n'), "{wrong}: {told}");
        }
        assert!(all("")[0].as_ref().unwrap_err().starts_with("line 1: `` is no number of columns"));
        // A second scan that is cut short.
        let told = all(&format!("{SAMPLE}{}", &SAMPLE[..40])).remove(1).unwrap_err();
        assert!(told.starts_with("scan 2 of 2: line 23: "), "{told}");
    }
}

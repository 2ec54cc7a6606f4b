//! The lines of text that a file has about a cloud as a whole: for the comments of PLY and PCD, and for other
//! formats that take text.

use super::{CloudRoom, LeftOut, Names};
use crate::points::{NO_OBJECT, Pick, PointCloud, Viewpoint};

/// Begins the line with the number of the scan.
const SCAN: &str = "macropulse scan ";

/// Begins the line with rows, columns, most returns of a shot and the return picked.
const LIST: &str = "macropulse list ";

/// Begins the line with the pose of the sensor.
const VIEWPOINT: &str = "macropulse viewpoint ";

/// Begins the line with the stamp of the scan, ns of Unix time.
const STAMP: &str = "macropulse stamp ";

/// The facts that a file tells of its cloud beside the points.
#[derive(Debug, Default)]
pub(super) struct About {
    pub scan: u64,
    pub stamp_ns: Option<u64>,
    pub viewpoint: Viewpoint,
    /// The image of a list, if the file tells it.
    pub list: Option<List>,
    pub objects: Vec<String>,
    pub materials: Vec<String>,
    /// The parts of the file that are not in its clouds.
    pub left_out: LeftOut,
    /// The memory that a cloud may take.
    pub room: CloudRoom,
    /// True if the file is a driver's, which writes (0, 0, 0) where nothing returned.
    pub is_of_driver: bool,
}

/// The image of a list: rows, columns, returns of a shot at most, and which of them is shown.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct List {
    pub rows: usize,
    pub columns: usize,
    pub most: u8,
    pub pick: Pick,
}

/// The line with the number of the scan.
pub(super) fn scan_line(cloud: &PointCloud) -> String {
    format!("{SCAN}{}", cloud.scan)
}

/// The line with the image of a list.
pub(super) fn list_line(cloud: &PointCloud) -> String {
    let PointCloud { rows, columns, returns_per_shot, pick, .. } = cloud;
    format!("{LIST}{rows} {columns} {returns_per_shot} {}", pick.name())
}

/// The line with the pose of the sensor: x y z, then the quaternion w i j k.
pub(super) fn viewpoint_line(cloud: &PointCloud) -> String {
    format!("{VIEWPOINT}{}", viewpoint_text(&cloud.viewpoint))
}

/// The line with the stamp of the scan, if it has one.
pub(super) fn stamp_line(cloud: &PointCloud) -> Option<String> {
    cloud.stamp_ns.map(|stamp| format!("{STAMP}{stamp}"))
}

/// A pose as PCD has it: x y z, then w i j k.
pub(super) fn viewpoint_text(viewpoint: &Viewpoint) -> String {
    let Viewpoint { position: [x, y, z], turn: [w, i, j, k] } = viewpoint;
    format!("{x} {y} {z} {w} {i} {j} {k}")
}

/// One line per name.
pub(super) fn name_lines(names: &Names) -> impl Iterator<Item = String> {
    let lines = |what: &'static str, list: &[String]| -> Vec<String> {
        let clean = |name: &str| name.replace(char::is_control, " ");
        list.iter().enumerate().map(|(at, name)| format!("{what} {at} {}", clean(name))).collect()
    };
    lines("object", names.objects).into_iter().chain(lines("material", names.materials))
}

/// All of it, for a format that has no other place for any of it.
pub(super) fn all_lines<'a>(
    cloud: &PointCloud,
    names: &'a Names,
) -> impl Iterator<Item = String> + use<'a> {
    let own = [scan_line(cloud), list_line(cloud), viewpoint_line(cloud)];
    own.into_iter().chain(stamp_line(cloud)).chain(name_lines(names))
}

impl About {
    /// Creates the facts of a file whose cloud may take the memory of `room`.
    pub fn within(room: CloudRoom) -> Self {
        Self { room, ..Self::default() }
    }

    /// Takes in a line of text. Lines that say nothing of this kind are passed over.
    ///
    /// # Errors
    /// The fault of a line that begins like one of ours.
    pub fn take(&mut self, line: &str) -> Result<(), String> {
        if let Some(scan) = line.strip_prefix(SCAN) {
            self.scan = scan.trim().parse().unwrap_or(0);
        } else if let Some(stamp) = line.strip_prefix(STAMP) {
            self.stamp_ns = stamp.trim().parse().ok();
        } else if let Some(list) = line.strip_prefix(LIST) {
            self.list = Some(list_of(list)?);
        } else if let Some(text) = line.strip_prefix(VIEWPOINT) {
            self.viewpoint = viewpoint(text)?;
        } else if let Some(name) = line.strip_prefix("object ") {
            add_name(&mut self.objects, name);
        } else if let Some(name) = line.strip_prefix("material ") {
            add_name(&mut self.materials, name);
        }
        Ok(())
    }
}

/// Puts a name that is written as `NUMBER NAME` to its place. The numbers of ours run without a gap.
fn add_name(names: &mut Vec<String>, text: &str) {
    let Some((number, name)) = text.split_once(' ') else { return };
    if number.parse() == Ok(names.len()) && names.len() < usize::from(NO_OBJECT) {
        names.push(name.to_owned());
    }
}

/// Rows, columns, most returns of a shot and the return picked.
fn list_of(text: &str) -> Result<List, String> {
    let list = |words: Vec<&str>| -> Option<List> {
        let [rows, columns, most, pick] = words.try_into().ok()?;
        let picks = [Pick::First, Pick::Strongest, Pick::Last];
        Some(List {
            rows: rows.parse().ok()?,
            columns: columns.parse().ok()?,
            most: most.parse().ok()?,
            pick: picks.into_iter().find(|known| known.name() == pick)?,
        })
    };
    let fault = || format!("its list is `{text}`, not rows, columns, returns and the one shown");
    list(text.split_whitespace().collect()).ok_or_else(fault)
}

/// Position and quaternion, as PCD has them: x y z, then w i j k.
pub(super) fn viewpoint(text: &str) -> Result<Viewpoint, String> {
    let numbers: Result<Vec<f64>, _> = text.split_whitespace().map(str::parse).collect();
    let numbers = numbers.unwrap_or_default();
    match *numbers.as_slice() {
        [x, y, z, w, i, j, k] if numbers.iter().all(|number| number.is_finite()) => {
            Ok(Viewpoint { position: [x, y, z], turn: [w, i, j, k] })
        }
        _ => Err(format!("VIEWPOINT is `{text}`, not seven finite numbers")),
    }
}

#[cfg(test)]
mod tests {
    use super::super::sample_cloud;
    use super::*;

    #[test]
    fn what_is_written_is_taken_in_again() {
        let cloud = PointCloud { stamp_ns: Some(1_700_000_000_123_456_789), ..sample_cloud() };
        let objects = ["car, red".to_owned(), "the road".to_owned()];
        let names = Names { objects: &objects, materials: &[] };
        let mut about = About::default();
        all_lines(&cloud, &names).for_each(|line| about.take(&line).unwrap());
        assert_eq!((about.scan, about.viewpoint), (cloud.scan, cloud.viewpoint));
        assert_eq!(about.stamp_ns, cloud.stamp_ns);
        let list = List { rows: 2, columns: 3, most: 1, pick: Pick::Strongest };
        assert_eq!(about.list, Some(list));
        assert_eq!((about.objects.as_slice(), about.materials.len()), (&objects[..], 0));
    }

    #[test]
    fn other_text_says_nothing_and_a_broken_line_is_refused() {
        let mut about = About::default();
        for line in ["made by hand", "object 7 far too high", "material", ""] {
            about.take(line).unwrap();
        }
        assert!(about.objects.is_empty());
        assert!(about.take("macropulse list 2 3 first").unwrap_err().contains("not rows, columns"));
        assert!(about.take("macropulse viewpoint 1 2 NaN").is_err());
    }
}

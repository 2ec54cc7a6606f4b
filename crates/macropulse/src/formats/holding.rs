//! Contents that a format leaves out of a cloud, for the notes to people and for the table of the documentation.

use super::attributes::Attribute;
use super::{Format, Names};
use crate::points::{PointCloud, Viewpoint};

/// How a format holds something.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Holding {
    /// As it is.
    Whole,
    /// In another unit or with fewer digits.
    Partly(&'static str),
    /// Not at all.
    Not,
}

impl Holding {
    /// How a format that has these `attributes` alone holds one of them, or another.
    pub fn among(attributes: &[Attribute], attribute: Attribute) -> Self {
        if attributes.contains(&attribute) { Self::Whole } else { Self::Not }
    }

    /// How an image whose pixels hold a range in this way holds an `attribute`.
    pub fn in_image(range: Self, attribute: Attribute) -> Self {
        match attribute {
            Attribute::Range => range,
            Attribute::Row | Attribute::Column | Attribute::Ring => Self::Partly("by the place"),
            _ => Self::Not,
        }
    }
}

/// Contents of a file beside the attributes of its points.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Further {
    /// Pixels without a return.
    EmptyPixels,
    /// The pose of the sensor when the scan began.
    Pose,
    /// The names of objects and materials.
    Names,
    /// The stamp of a scan whose file told it.
    Stamp,
    /// Digits of coordinates beyond those of 32-bit floats.
    Digits,
}

impl Further {
    const ALL: [Self; 5] = [Self::EmptyPixels, Self::Pose, Self::Names, Self::Stamp, Self::Digits];

    /// True if an image of ranges holds it. Such an image has no coordinates, and so loses no digits of theirs.
    pub fn is_in_image(self) -> bool {
        matches!(self, Self::EmptyPixels | Self::Digits)
    }

    fn name(self) -> &'static str {
        match self {
            Self::EmptyPixels => "pixels without a return",
            Self::Pose => "pose of the sensor",
            Self::Names => "names of objects and materials",
            Self::Stamp => "stamp of the scan",
            Self::Digits => "digits of coordinates beyond 32-bit floats",
        }
    }

    /// Those that a cloud has.
    fn of(cloud: &PointCloud, names: &Names) -> impl Iterator<Item = Self> {
        let has = |further: &Self| match further {
            Self::EmptyPixels => cloud.image(cloud.pick).iter().any(|at| at.is_none()),
            Self::Pose => cloud.viewpoint != Viewpoint::default(),
            Self::Names => !names.objects.is_empty() || !names.materials.is_empty(),
            Self::Stamp => cloud.stamp_ns.is_some(),
            Self::Digits => !cloud.exact.x.is_empty(),
        };
        Self::ALL.into_iter().filter(has)
    }
}

impl Format {
    /// Lists, in words, the parts of `cloud` and its `names` that this format leaves out.
    pub fn leaves_out(self, cloud: &PointCloud, names: &Names) -> Vec<&'static str> {
        let writer = self.writer();
        let left_out = |attribute: &Attribute| writer.holds(*attribute) == Holding::Not;
        let attributes = Attribute::of(cloud).into_iter().filter(left_out);
        let further = Further::of(cloud, names).filter(|further| !writer.holds_further(*further));
        attributes.map(|attribute| attribute.name()).chain(further.map(Further::name)).collect()
    }

    /// Which attributes of the truth cannot be written in this format of clouds, with velocities where the sensor `shows`
    /// them; of an image of ranges none is expected.
    pub fn leaves_out_of_truth(self, shows: bool) -> Vec<&'static str> {
        if self.is_range_image() {
            return Vec::new();
        }
        let is_there =
            |attribute: &Attribute| attribute.is_true() && (shows || attribute.comes_with_truth());
        let truth = Attribute::in_files().filter(is_there);
        let left_out = truth.filter(|attribute| self.writer().holds(*attribute) == Holding::Not);
        left_out.map(Attribute::name).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::super::sample_cloud;
    use super::*;
    use crate::points::Truth;

    /// Formats of points that hold the same, side by side in [`Format::ALL`], share a column of the documentation.
    fn columns() -> Vec<(String, Format)> {
        let mut columns: Vec<(String, Format)> = Vec::new();
        for format in Format::ALL.iter().copied().filter(|format| !format.is_range_image()) {
            let name = format.name().strip_prefix("mcap").filter(|rest| !rest.is_empty());
            let name = name.unwrap_or(format.name());
            match columns.last_mut() {
                Some((names, last)) if holds_same(*last, format) => *names += &format!(", {name}"),
                _ => columns.push((name.to_owned(), format)),
            }
        }
        columns
    }

    fn holds_same(one: Format, other: Format) -> bool {
        let (one, other) = (one.writer(), other.writer());
        let same = |attribute| one.holds(attribute) == other.holds(attribute);
        Attribute::in_files().all(same)
            && Further::ALL
                .iter()
                .all(|further| one.holds_further(*further) == other.holds_further(*further))
    }

    /// The table of docs/formats.md: a row for each attribute and for what else there is, a column
    /// for each group of formats.
    fn table() -> String {
        let columns = columns();
        let mut text = "|".to_owned();
        columns.iter().for_each(|(name, _)| text += &format!(" | {name}"));
        text += &format!(" |\n|---{}|\n", "|---".repeat(columns.len()));
        let mut remarks: Vec<&str> = Vec::new();
        for attribute in Attribute::in_files() {
            text += &format!("| `{}`", attribute.name());
            for (_, format) in &columns {
                text += &match format.writer().holds(attribute) {
                    Holding::Whole => " | ●".to_owned(),
                    Holding::Not => " | –".to_owned(),
                    Holding::Partly(how) => {
                        let known = remarks.iter().position(|known| *known == how);
                        let at = known.unwrap_or(remarks.len());
                        if at == remarks.len() {
                            remarks.push(how);
                        }
                        format!(" | {}", at + 1)
                    }
                };
            }
            text += " |\n";
        }
        for further in Further::ALL {
            text += &format!("| {}", further.name());
            for (_, format) in &columns {
                text += if format.writer().holds_further(further) { " | ●" } else { " | –" };
            }
            text += " |\n";
        }
        text += "\n● as it is, – cannot be held, and:\n";
        for (at, how) in remarks.iter().enumerate() {
            text += &format!("{}. {how}\n", at + 1);
        }
        text
    }

    #[test]
    #[cfg(feature = "parquet")]
    fn the_documentation_has_the_table() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/formats.md");
        let documented = std::fs::read_to_string(path).unwrap();
        let table = table();
        assert!(documented.contains(&table), "docs/formats.md should have this table:\n{table}");
    }

    #[test]
    fn what_is_left_out_is_named() {
        let mut cloud = sample_cloud();
        fn left_out(format: Format, cloud: &PointCloud) -> Vec<&'static str> {
            format.leaves_out(cloud, &Names::default())
        }
        let truth = ["true_range", "object", "material", "incidence", "outcome"];
        assert_eq!(Format::Kitti.leaves_out_of_truth(false), truth);
        assert!(Format::Kitti.leaves_out_of_truth(true).contains(&"true_radial_velocity"));
        let told = left_out(Format::Kitti, &cloud);
        let expected = ["outcome", "pixels without a return", "pose of the sensor"];
        assert_eq!(told[told.len() - 3..], expected);
        cloud.truth = Truth::default();
        assert!(!left_out(Format::Kitti, &cloud).contains(&"outcome"));
        assert!(left_out(Format::Pcd, &cloud).is_empty());
        assert!(Format::Pcd.leaves_out_of_truth(true).is_empty());
        assert!(Format::Png.leaves_out_of_truth(true).is_empty());
    }
}

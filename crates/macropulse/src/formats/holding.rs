//! Which format holds which attribute: one table, for the notes to people and for the documentation.

use super::attributes::Attribute;
use super::kitti;
use super::mcap::{Message, Profile, profile_holding};
use super::{Format, Names, las};
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
        let left_out = |attribute: &Attribute| self.holds(*attribute) == Holding::Not;
        let attributes = Attribute::of(cloud).into_iter().filter(left_out);
        let further = Further::of(cloud, names).filter(|further| !self.holds_further(*further));
        attributes.map(|attribute| attribute.name()).chain(further.map(Further::name)).collect()
    }

    /// Which attributes of the truth cannot be written in this format of clouds, with velocities where the sensor `shows`
    /// them; of an image of ranges none is expected.
    pub fn leaves_out_of_truth(self, shows: bool) -> Vec<&'static str> {
        if matches!(self, Self::Png | Self::RangeNpy) {
            return Vec::new();
        }
        let is_there =
            |attribute: &Attribute| attribute.is_true() && (shows || attribute.comes_with_truth());
        let truth = Attribute::in_files().filter(is_there);
        let left_out = truth.filter(|attribute| self.holds(*attribute) == Holding::Not);
        left_out.map(Attribute::name).collect()
    }

    pub(super) fn holds(self, attribute: Attribute) -> Holding {
        use Holding::{Not, Partly, Whole};
        match self {
            Self::Pcd | Self::Ply | Self::PlyCloudCompare | Self::Npy | Self::Csv => Whole,
            #[cfg(feature = "parquet")]
            Self::Parquet => Whole,
            Self::Las | Self::Laz => match attribute {
                Attribute::X | Attribute::Y | Attribute::Z => {
                    Partly("steps of 1 µm, or those of the file read")
                }
                Attribute::TimeNs => Partly("`gps_time`, s"),
                Attribute::ReturnNumber | Attribute::NumberOfReturns => Partly("up to 15"),
                other if las::extra_name(other) != Some(other.name()) => {
                    Partly("extra bytes `reflectance`; `intensity` is 10 000 × it")
                }
                _ => Whole,
            },
            Self::E57 => match attribute {
                Attribute::TimeNs => Partly("`timeStamp`, s"),
                Attribute::ReturnNumber => Partly("`returnIndex`, from 0"),
                _ => Whole,
            },
            Self::Kitti if kitti::ATTRIBUTES.contains(&attribute) => Whole,
            Self::Kitti => Not,
            Self::Mcap(Message::Ros2(profile)) => profile_holding(profile, attribute),
            Self::Mcap(Message::Foxglove) => Whole,
            Self::Mcap(Message::Osi) => osi(attribute),
            Self::Png => match attribute {
                Attribute::Range => Partly("steps of 1/256 m, up to 255.99 m"),
                Attribute::Row | Attribute::Column | Attribute::Ring => Partly("by the place"),
                _ => Not,
            },
            Self::RangeNpy => match attribute {
                Attribute::Range => Whole,
                Attribute::Row | Attribute::Column | Attribute::Ring => Partly("by the place"),
                _ => Not,
            },
        }
    }

    /// Returns true if this format holds `further`, which is no attribute of a point.
    pub(super) fn holds_further(self, further: Further) -> bool {
        use Further::{Digits, EmptyPixels, Names, Pose, Stamp};
        match self {
            Self::Pcd => true,
            Self::Ply | Self::PlyCloudCompare | Self::Las | Self::Laz | Self::E57 => {
                further != EmptyPixels
            }
            #[cfg(feature = "parquet")]
            Self::Parquet => further != EmptyPixels,
            Self::Npy => further == Digits,
            Self::Kitti => false,
            Self::Csv => matches!(further, Names | Digits),
            Self::Mcap(Message::Ros2(profile)) => match further {
                EmptyPixels => profile.is_organised(),
                Pose | Names | Stamp => true,
                Digits => profile == Profile::Extended,
            },
            Self::Mcap(Message::Foxglove) => further != EmptyPixels,
            Self::Mcap(Message::Osi) => matches!(further, Names | Stamp | Digits),
            // Images have no coordinates.
            Self::Png | Self::RangeNpy => matches!(further, EmptyPixels | Digits),
        }
    }
}

fn osi(attribute: Attribute) -> Holding {
    use Holding::{Not, Partly, Whole};
    match attribute {
        Attribute::X | Attribute::Y | Attribute::Z => Partly("as distance, azimuth, elevation"),
        Attribute::Intensity => Partly("`reflectivity`; `intensity` in percent"),
        Attribute::Range | Attribute::RadialVelocity => Whole,
        Attribute::Row | Attribute::Ring => Partly("`beam_id`"),
        Attribute::TimeNs => Partly("of the scan alone"),
        Attribute::TrueRange => Partly("`time_of_flight` of a reflection"),
        Attribute::Object => Partly("`object_id`"),
        Attribute::Outcome => Partly("`classification`: right, near and edge, wrong, false"),
        _ => Not,
    }
}

#[cfg(test)]
mod tests {
    use super::super::sample_cloud;
    use super::*;
    use crate::points::Truth;

    /// The table of docs/formats.md: a row for each attribute and for what else there is, a column
    /// for each group of formats.
    fn table() -> String {
        let columns = [
            ("pcd", Format::Pcd),
            ("ply (both)", Format::Ply),
            ("las, laz", Format::Las),
            ("e57", Format::E57),
            ("npy", Format::Npy),
            ("csv", Format::Csv),
            ("kitti", Format::Kitti),
            #[cfg(feature = "parquet")]
            ("parquet", Format::Parquet),
            ("mcap", Format::Mcap(Message::Ros2(Profile::Extended))),
            ("-velodyne", Format::Mcap(Message::Ros2(Profile::Velodyne))),
            ("-ouster", Format::Mcap(Message::Ros2(Profile::Ouster))),
            ("-livox", Format::Mcap(Message::Ros2(Profile::Livox))),
            ("-autoware", Format::Mcap(Message::Ros2(Profile::Autoware))),
            ("-foxglove", Format::Mcap(Message::Foxglove)),
            ("-osi", Format::Mcap(Message::Osi)),
        ];
        let mut text = "|".to_owned();
        columns.iter().for_each(|(name, _)| text += &format!(" | {name}"));
        text += &format!(" |\n|---{}|\n", "|---".repeat(columns.len()));
        let mut remarks: Vec<&str> = Vec::new();
        for attribute in Attribute::in_files() {
            text += &format!("| `{}`", attribute.name());
            for (_, format) in columns {
                text += &match format.holds(attribute) {
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
            for (_, format) in columns {
                text += if format.holds_further(further) { " | ●" } else { " | –" };
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

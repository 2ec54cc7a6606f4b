//! The fields of `PointCloud2` that programs for known sensors expect.

use super::super::attributes::{Attribute, Point, Value};
use super::super::holding::Holding;
use super::super::number::Kind;
use super::{Profile, times_from_ns};
use crate::points::{Image, Pick, PointCloud};
use std::f64::consts::TAU;

/// A field of a point.
pub(super) struct Field {
    pub name: &'static str,
    pub offset: usize,
    pub quantity: Quantity,
}

/// Content of a field.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Quantity {
    /// An attribute as it is.
    Of(Attribute),
    /// A length as a 32-bit float.
    Float(Attribute),
    /// Apparent reflectance in percent, as a float.
    Percent,
    /// The same, 255 at most.
    PercentTo255,
    /// The same, whole, 255 at most, in one byte or two.
    PercentU1,
    PercentU2,
    /// Apparent reflectance, white 150, whole, 255 at most, as a float.
    Livox150,
    /// Time since the stamp, s.
    SecondsF4,
    /// Time since the stamp, whole ns.
    NanosU4,
    /// Time since the epoch of the file, ns.
    NanosF8,
    /// Range, whole mm.
    MillimetresU4,
    /// The row, 255 at most.
    LineU1,
    /// The laser, counted from the lowest one.
    RingFromBelow,
    /// Bits 5 and 4 are the number of the return. The nearest surface has 1: return 0 is the light that
    /// the optics of the sensor itself send back.
    LivoxTag,
    /// Autoware's number for the kind of return.
    ReturnType,
    /// atan2(−y, x), from 0 to 2π: to the right, as heads turn, rad.
    Azimuth,
    /// Angle above the x-y plane, rad.
    Elevation,
    /// Nothing that is simulated: 0.
    ZeroU2,
}

/// Name, offset and content of a field.
type Row = (&'static str, usize, Quantity);

const X: Row = ("x", 0, Quantity::Float(Attribute::X));
const Y: Row = ("y", 4, Quantity::Float(Attribute::Y));
const Z: Row = ("z", 8, Quantity::Float(Attribute::Z));

const VELODYNE: &[Row] = &[
    X,
    Y,
    Z,
    ("intensity", 12, Quantity::PercentTo255),
    ("ring", 16, Quantity::RingFromBelow),
    ("time", 18, Quantity::SecondsF4),
];

const OUSTER: &[Row] = &[
    X,
    Y,
    Z,
    ("intensity", 16, Quantity::Percent),
    ("t", 20, Quantity::NanosU4),
    ("reflectivity", 24, Quantity::PercentU2),
    ("ring", 26, Quantity::Of(Attribute::Ring)),
    ("ambient", 28, Quantity::ZeroU2),
    ("range", 32, Quantity::MillimetresU4),
];

const LIVOX: &[Row] = &[
    X,
    Y,
    Z,
    ("intensity", 12, Quantity::Livox150),
    ("tag", 16, Quantity::LivoxTag),
    ("line", 17, Quantity::LineU1),
    ("timestamp", 18, Quantity::NanosF8),
];

const AUTOWARE: &[Row] = &[
    X,
    Y,
    Z,
    ("intensity", 12, Quantity::PercentU1),
    ("return_type", 13, Quantity::ReturnType),
    ("channel", 14, Quantity::Of(Attribute::Ring)),
    ("azimuth", 16, Quantity::Azimuth),
    ("elevation", 20, Quantity::Elevation),
    ("distance", 24, Quantity::Float(Attribute::Range)),
    ("time_stamp", 28, Quantity::NanosU4),
];

/// Bytes of a point, and its fields; of the extended profile those that the cloud has.
pub(super) fn fields(profile: Profile, cloud: &PointCloud) -> (usize, Vec<Field>) {
    let (step, rows) = match profile {
        Profile::Velodyne => (22, VELODYNE),
        Profile::Ouster => (48, OUSTER),
        Profile::Livox => (26, LIVOX),
        Profile::Autoware => (32, AUTOWARE),
        Profile::Extended => {
            let mut step = 0;
            let place = |attribute: &Attribute| {
                let offset = step;
                step += attribute.kind(cloud).size();
                Field { name: attribute.name(), offset, quantity: Quantity::Of(*attribute) }
            };
            let fields = Attribute::of(cloud).iter().map(place).collect();
            return (step, fields);
        }
    };
    let has = Attribute::of(cloud);
    let is_there = |(_, _, quantity): &&Row| quantity.needs().iter().all(|need| has.contains(need));
    let field = |&(name, offset, quantity): &Row| Field { name, offset, quantity };
    (step, rows.iter().filter(is_there).map(field).collect())
}

impl Profile {
    /// Says how this profile holds an attribute: as it is, in words how else, or not at all.
    pub(super) fn holds(self, attribute: Attribute) -> Holding {
        let rows = match self {
            Self::Extended => return Holding::Whole,
            Self::Velodyne => VELODYNE,
            Self::Ouster => OUSTER,
            Self::Livox => LIVOX,
            Self::Autoware => AUTOWARE,
        };
        // The ring is the row.
        let asked = if attribute == Attribute::Row { Attribute::Ring } else { attribute };
        let found = rows.iter().find_map(|(_, _, quantity)| {
            let (held, how) = quantity.holds()?;
            (held == asked).then_some(how)
        });
        found.unwrap_or(Holding::Not)
    }

    /// Returns true if the image of its driver has a line for each column, with the lasers from the lowest
    /// one up.
    pub(super) fn is_by_column(self) -> bool {
        self == Self::Velodyne
    }

    /// Returns true if its driver writes images, with a point for each pixel.
    pub(super) fn is_organised(self) -> bool {
        !matches!(self, Self::Livox | Self::Autoware)
    }
}

impl Quantity {
    /// The attributes that it follows from.
    fn needs(self) -> Vec<Attribute> {
        match (self, self.holds()) {
            (Self::PercentU2, _) => vec![Attribute::Intensity],
            (Self::ReturnType, _) => vec![Attribute::ReturnNumber, Attribute::NumberOfReturns],
            (_, held) => held.map(|(attribute, _)| attribute).into_iter().collect(),
        }
    }

    /// The kind of its numbers in messages of `cloud`.
    pub fn kind(self, cloud: &PointCloud) -> Kind {
        match self {
            Self::Of(attribute) => attribute.kind(cloud),
            Self::Float(_) => Kind::F4,
            Self::PercentU1 | Self::LineU1 | Self::LivoxTag | Self::ReturnType => Kind::U1,
            Self::PercentU2 | Self::RingFromBelow | Self::ZeroU2 => Kind::U2,
            Self::NanosU4 | Self::MillimetresU4 => Kind::U4,
            Self::Percent | Self::PercentTo255 | Self::Livox150 => Kind::F4,
            Self::SecondsF4 | Self::Azimuth | Self::Elevation => Kind::F4,
            Self::NanosF8 => Kind::F8,
        }
    }

    /// The attribute it tells, and how.
    fn holds(self) -> Option<(Attribute, Holding)> {
        use Holding::{Partly, Whole};
        Some(match self {
            Self::Of(attribute) | Self::Float(attribute) => (attribute, Whole),
            Self::Percent => (Attribute::Intensity, Partly("in percent")),
            Self::PercentTo255 => (Attribute::Intensity, Partly("in percent, 255 at most")),
            Self::PercentU1 => (Attribute::Intensity, Partly("whole percent, 255 at most")),
            Self::Livox150 => (Attribute::Intensity, Partly("whole, white is 150, 255 at most")),
            Self::SecondsF4 => (Attribute::TimeNs, Partly("s from the stamp, float")),
            Self::NanosU4 => (Attribute::TimeNs, Partly("whole ns from the stamp")),
            Self::NanosF8 => (Attribute::TimeNs, Partly("ns from the epoch")),
            Self::MillimetresU4 => (Attribute::Range, Partly("whole mm")),
            Self::LineU1 => (Attribute::Ring, Partly("255 at most")),
            Self::RingFromBelow => (Attribute::Ring, Partly("from the lowest one up")),
            Self::LivoxTag => (Attribute::ReturnNumber, Partly("up to 3")),
            Self::PercentU2 | Self::ReturnType => return None,
            Self::Azimuth | Self::Elevation | Self::ZeroU2 => return None,
        })
    }
}

/// The numbers of a scan's points as a profile has them.
pub(super) struct Source<'a> {
    cloud: &'a PointCloud,
    stamp_ns: f64,
    /// The strongest return of each pixel, where a shot may have several.
    strongest: Option<Image>,
    /// The lowest row.
    lowest: u16,
}

impl<'a> Source<'a> {
    /// The points of a scan whose time is `stamp_ns` from the beginning of the first one.
    pub fn new(cloud: &'a PointCloud, stamp_ns: f64) -> Self {
        let several = cloud.returns_per_shot > 1;
        let strongest = several.then(|| cloud.image(Pick::Strongest));
        let highest = cloud.row.iter().copied().max().unwrap_or(0);
        let lowest = cloud.rows.checked_sub(1).map_or(highest, |last| last as u16);
        Self { cloud, stamp_ns, strongest, lowest }
    }

    /// A quantity of a point; coordinates, intensity and range of one without a return are NaN.
    pub fn value(&self, quantity: Quantity, point: Point) -> Value {
        let number = |attribute: Attribute| attribute.value(self.cloud, point).number();
        let whole = |value: f64, most: f64| value.round().clamp(0.0, most);
        let percent = || number(Attribute::Intensity) * 100.0;
        let since = || (number(Attribute::TimeNs) - self.stamp_ns).max(0.0);
        match quantity {
            Quantity::Of(attribute) => attribute.value(self.cloud, point),
            Quantity::Float(attribute) => attribute.value(self.cloud, point).narrowed(),
            Quantity::Percent => Value::F4(percent() as f32),
            Quantity::PercentTo255 => Value::F4(percent().clamp(0.0, 255.0) as f32),
            Quantity::PercentU1 => Value::U1(whole(percent(), 255.0) as u8),
            Quantity::PercentU2 => Value::U2(whole(percent(), 255.0) as u16),
            Quantity::Livox150 => {
                Value::F4(whole(number(Attribute::Intensity) * 150.0, 255.0) as f32)
            }
            Quantity::SecondsF4 => Value::F4((since() * 1e-9) as f32),
            Quantity::NanosU4 => Value::U4(whole(since(), f64::from(u32::MAX)) as u32),
            Quantity::NanosF8 => {
                Value::F8(number(Attribute::TimeNs) + times_from_ns(self.cloud) as f64)
            }
            Quantity::MillimetresU4 => {
                let millimetres = number(Attribute::Range) * 1e3;
                Value::U4(whole(millimetres, f64::from(u32::MAX)) as u32)
            }
            Quantity::LineU1 => Value::U1(whole(number(Attribute::Ring), 255.0) as u8),
            Quantity::RingFromBelow => {
                Value::U2(self.lowest.saturating_sub(number(Attribute::Ring) as u16))
            }
            Quantity::LivoxTag => {
                Value::U1((whole(number(Attribute::ReturnNumber), 3.0) as u8) << 4)
            }
            Quantity::ReturnType => Value::U1(self.return_type(point)),
            Quantity::Azimuth => {
                let to_the_right = libm::atan2(-number(Attribute::Y), number(Attribute::X));
                let turned = if to_the_right < 0.0 { to_the_right + TAU } else { to_the_right };
                // Rounded to a 32-bit float, an angle just below a whole turn is one.
                Value::F4(if turned as f32 >= TAU as f32 { 0.0 } else { turned as f32 })
            }
            Quantity::Elevation => {
                let level = libm::hypot(number(Attribute::X), number(Attribute::Y));
                Value::F4(libm::atan2(number(Attribute::Z), level) as f32)
            }
            Quantity::ZeroU2 => Value::U2(0),
        }
    }

    /// Autoware's number of the type of a return. 0: invalid. If shots have one return at most, 2 for a
    /// sensor that picks the last return, else 1. If a shot may have several, 7 for the only one of its shot.
    /// The strongest is 3 if it is the first one, else 4. Another one is 5 if it is the first one, else 6.
    fn return_type(&self, point: Point) -> u8 {
        let Point::Return(at) = point else { return 0 };
        let Some(strongest) = &self.strongest else {
            return if self.cloud.pick == Pick::Last { 2 } else { 1 };
        };
        let cloud = self.cloud;
        let pixel = cloud
            .row
            .get(at)
            .zip(cloud.column.get(at))
            .map(|(&row, &column)| usize::from(row) * cloud.columns + usize::from(column));
        let is_strongest = pixel.and_then(|pixel| strongest.get(pixel)) == Some(at);
        match (cloud.number_of_returns[at], cloud.return_number[at], is_strongest) {
            (0 | 1, _, _) => 7,
            (_, 1, true) => 3,
            (_, 1, false) => 5,
            (_, _, true) => 4,
            (_, _, false) => 6,
        }
    }
}

impl Kind {
    /// Its number in a `PointField` of ROS.
    pub(super) fn ros(self) -> Option<u8> {
        let all = [Self::I1, Self::U1, Self::I2, Self::U2, Self::I4, Self::U4, Self::F4, Self::F8];
        all.iter().position(|kind| *kind == self).map(|at| at as u8 + 1)
    }

    /// The kind with this number in a `PointField` of ROS.
    pub(super) fn from_ros(number: u8) -> Option<Self> {
        let all = [Self::I1, Self::U1, Self::I2, Self::U2, Self::I4, Self::U4, Self::F4, Self::F8];
        all.get(usize::from(number).checked_sub(1)?).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::sample_cloud;
    use super::*;

    #[test]
    fn fields_neither_overlap_nor_reach_beyond_the_point() {
        let cloud = sample_cloud();
        let source = Source::new(&cloud, 0.0);
        for profile in [
            Profile::Extended,
            Profile::Velodyne,
            Profile::Ouster,
            Profile::Livox,
            Profile::Autoware,
        ] {
            let (step, fields) = fields(profile, &cloud);
            let mut end = 0;
            for field in fields {
                assert!(field.offset >= end, "{profile:?} {}", field.name);
                let kind = field.quantity.kind(&cloud);
                assert_eq!(source.value(field.quantity, Point::Return(0)).kind(), kind);
                end = field.offset + kind.size();
            }
            assert!(end <= step, "{profile:?}");
        }
    }

    #[test]
    fn quantities_are_in_the_units_that_are_expected() {
        let cloud = sample_cloud();
        let source = Source::new(&cloud, 40.0);
        let value = |quantity| source.value(quantity, Point::Return(1));
        assert_eq!(value(Quantity::PercentU1), Value::U1(10));
        assert_eq!(value(Quantity::PercentTo255), value(Quantity::Percent));
        assert_eq!(value(Quantity::MillimetresU4), Value::U4(30_500));
        assert_eq!(value(Quantity::NanosU4), Value::U4(1));
        assert_eq!(value(Quantity::NanosF8), Value::F8(1_000_000_040.946_5));
        assert_eq!(value(Quantity::ReturnType), Value::U1(1));
        let Value::F4(elevation) = value(Quantity::Elevation) else { panic!() };
        assert!((elevation - (0.5_f32 / 30.5).atan()).abs() < 1e-7);
        assert_eq!(source.value(Quantity::PercentU1, Point::Unanswered(2)), Value::U1(0));
    }

    /// A sign is 255 to a Velodyne, as its driver has it.
    #[test]
    fn a_retroreflector_does_not_leave_the_scale() {
        let mut cloud = sample_cloud();
        cloud.intensity[1] = 255.55;
        let source = Source::new(&cloud, 40.0);
        let value = |quantity| source.value(quantity, Point::Return(1));
        assert_eq!(value(Quantity::PercentTo255), Value::F4(255.0));
        assert_eq!(value(Quantity::Percent), Value::F4(25_555.0));
        let Value::F4(none) = source.value(Quantity::PercentTo255, Point::Unanswered(2)) else {
            panic!()
        };
        assert!(none.is_nan());
    }

    #[test]
    fn returns_of_a_shot_are_told_apart() {
        let mut cloud = sample_cloud();
        cloud.returns_per_shot = 2;
        (cloud.row[1], cloud.column[1]) = (0, 0);
        (cloud.number_of_returns[0], cloud.number_of_returns[1]) = (2, 2);
        cloud.return_number[1] = 2;
        let source = Source::new(&cloud, 0.0);
        let value = |quantity, at| source.value(quantity, Point::Return(at));
        let kinds = [0, 1, 2].map(|at| value(Quantity::ReturnType, at));
        assert_eq!(kinds, [Value::U1(3), Value::U1(6), Value::U1(7)]);
    }

    /// The first surface is return 1 to Livox, and programs that keep the nearest return keep 0 and 1.
    #[test]
    fn livox_counts_returns_from_the_light_of_its_own_optics() {
        let mut cloud = sample_cloud();
        cloud.return_number = vec![1, 2, 3, 4, 1];
        let source = Source::new(&cloud, 0.0);
        let tag = |at| source.value(Quantity::LivoxTag, Point::Return(at));
        assert_eq!([0, 1, 2, 3].map(tag), [0x10, 0x20, 0x30, 0x30].map(Value::U1));
    }

    /// White is 150 to Livox, brighter is a retroreflector, and all are whole numbers.
    #[test]
    fn livox_has_whole_intensities() {
        let mut cloud = sample_cloud();
        cloud.intensity = vec![0.1, 1.0, 1.02, 255.55, 0.103];
        let source = Source::new(&cloud, 0.0);
        let value = |at| source.value(Quantity::Livox150, Point::Return(at));
        let all = [0, 1, 2, 3, 4].map(value);
        assert_eq!(all, [15.0, 150.0, 153.0, 255.0, 15.0].map(Value::F4));
        let Value::F4(none) = source.value(Quantity::Livox150, Point::Unanswered(2)) else {
            panic!()
        };
        assert!(none.is_nan());
    }

    /// The filters of Autoware join neighbours of a ring whose azimuths grow by less than a degree.
    #[test]
    fn azimuths_of_autoware_grow_to_the_right() {
        let mut cloud = sample_cloud();
        (cloud.x, cloud.y) = (vec![1.0, 1.0, -1.0, 1.0, 1.0], vec![0.0, -1.0, 0.0, 1.0, 1e-9]);
        let source = Source::new(&cloud, 0.0);
        let azimuth = |at| match source.value(Quantity::Azimuth, Point::Return(at)) {
            Value::F4(azimuth) => f64::from(azimuth).to_degrees(),
            other => panic!("{other:?}"),
        };
        let all: [f64; 5] = [0, 1, 2, 3, 4].map(azimuth);
        for (found, right) in all.into_iter().zip([0.0, 45.0, 180.0, 315.0, 0.0]) {
            assert!((found - right).abs() < 1e-4, "{all:?}");
        }
    }

    #[test]
    fn velodyne_counts_rings_from_the_lowest_laser() {
        let cloud = sample_cloud();
        let source = Source::new(&cloud, 0.0);
        let ring = |point| source.value(Quantity::RingFromBelow, point);
        // Rows 0 and 1 of two, 0 at the top.
        let rings = [Point::Return(0), Point::Return(4), Point::Unanswered(2)].map(ring);
        assert_eq!(rings, [Value::U2(1), Value::U2(0), Value::U2(1)]);
    }

    #[test]
    fn the_last_return_alone_is_told_from_the_only_one() {
        let last = PointCloud { pick: Pick::Last, ..sample_cloud() };
        let kind = |cloud: &PointCloud| {
            Source::new(cloud, 0.0).value(Quantity::ReturnType, Point::Return(0))
        };
        assert_eq!((kind(&sample_cloud()), kind(&last)), (Value::U1(1), Value::U1(2)));
    }

    #[test]
    fn kinds_have_the_numbers_of_ros() {
        assert_eq!((Kind::U2.ros(), Kind::F4.ros(), Kind::U8.ros()), (Some(4), Some(7), None));
        assert_eq!((Kind::from_ros(8), Kind::from_ros(0)), (Some(Kind::F8), None));
    }
}

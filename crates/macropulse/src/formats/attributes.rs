//! The attributes that are written of each point, by the table of attributes.

use super::Error;
use super::number::Kind;
pub(super) use crate::points::Attribute;
use crate::points::{Extent, Field, Outcome, PointCloud, Storage, angle};

/// Rows or columns that 16 bits can number.
const MOST_ROWS: usize = 1 << 16;

/// An entry of a cloud that is written as a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Point {
    /// The return at this place of the list.
    Return(usize),
    /// This pixel, which has no return.
    Unanswered(usize),
}

/// A value with the width it has in binary files.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Value {
    F4(f32),
    F8(f64),
    U1(u8),
    U2(u16),
    U4(u32),
}

impl Attribute {
    /// Returns the attributes that are written of `cloud`: those that it has, the truth at the end.
    pub(super) fn of(cloud: &PointCloud) -> Vec<Self> {
        Self::in_files().filter(|attribute| attribute.is_in(cloud)).collect()
    }

    /// Name in text files: with its unit.
    pub(super) fn name_with_unit(self) -> String {
        let (name, unit) = (self.name(), self.unit().replace('/', "_"));
        let is_told = unit.is_empty() || name.ends_with(&format!("_{unit}"));
        if is_told { name.to_owned() } else { format!("{name}_{unit}") }
    }

    /// Returns the type in which its values in `cloud` are stored.
    pub(super) fn kind(self, cloud: &PointCloud) -> Kind {
        match self.storage() {
            Storage::Length(_, exact) if !exact.of(cloud).is_empty() => Kind::F8,
            Storage::Length(..) | Storage::Real(_) | Storage::Cosine(_) => Kind::F4,
            Storage::Time(_) => Kind::F8,
            Storage::Byte(_) | Storage::Bit(_) | Storage::Code(_) => Kind::U1,
            Storage::Count(_) => Kind::U2,
        }
    }

    /// The attribute, one of [`Attribute::of`], of `point` in a cloud that passed [`check_even`].
    ///
    /// Object and material of a point without a surface are `NO_OBJECT`. A pixel without a return has
    /// the first surface along its beam.
    pub(super) fn value(self, cloud: &PointCloud, point: Point) -> Value {
        match (self, point) {
            (Self::Row | Self::Ring, Point::Unanswered(pixel)) => {
                return Value::U2((pixel / cloud.columns) as u16);
            }
            (Self::Column, Point::Unanswered(pixel)) => {
                return Value::U2((pixel % cloud.columns) as u16);
            }
            _ => {}
        }
        match self.storage() {
            Storage::Length(single, exact) => match exact.of(cloud).is_empty() {
                true => Value::F4(entry(single, cloud, point)),
                false => Value::F8(entry(exact, cloud, point)),
            },
            Storage::Real(field) => Value::F4(entry(field, cloud, point)),
            Storage::Time(field) => Value::F8(entry(field, cloud, point)),
            Storage::Byte(field) => Value::U1(entry(field, cloud, point)),
            Storage::Count(field) => Value::U2(entry(field, cloud, point)),
            Storage::Bit(_) => Value::U1(match point {
                Point::Return(at) => cloud.flags(at),
                Point::Unanswered(_) => 0,
            }),
            Storage::Cosine(field) => Value::F4(angle(entry(field, cloud, point))),
            Storage::Code(field) => Value::U1(entry(field, cloud, point) as u8),
        }
    }
}

/// The entry of `point` in the columns of `field`.
fn entry<T: Copy>(field: &Field<T>, cloud: &PointCloud, point: Point) -> T {
    let entry = match point {
        Point::Return(at) => field.of(cloud).get(at),
        Point::Unanswered(pixel) => field.pixels(cloud).get(pixel),
    };
    entry.copied().unwrap_or(field.none)
}

impl Value {
    /// Returns the type in which it is stored.
    #[cfg(test)]
    pub fn kind(self) -> Kind {
        match self {
            Self::U1(_) => Kind::U1,
            Self::U2(_) => Kind::U2,
            Self::U4(_) => Kind::U4,
            Self::F4(_) => Kind::F4,
            Self::F8(_) => Kind::F8,
        }
    }

    /// The same as a number.
    pub fn number(self) -> f64 {
        match self {
            Self::U1(value) => f64::from(value),
            Self::U2(value) => f64::from(value),
            Self::U4(value) => f64::from(value),
            Self::F4(value) => f64::from(value),
            Self::F8(value) => value,
        }
    }

    /// The same with coordinates in 32 bits, for formats that have room for no more.
    pub fn narrowed(self) -> Self {
        if let Self::F8(value) = self { Self::F4(value as f32) } else { self }
    }

    /// Appends the value, little endian.
    pub fn append_to(self, bytes: &mut Vec<u8>) {
        match self {
            Self::U1(value) => bytes.push(value),
            Self::U2(value) => bytes.extend(value.to_le_bytes()),
            Self::U4(value) => bytes.extend(value.to_le_bytes()),
            Self::F4(value) => bytes.extend(value.to_le_bytes()),
            Self::F8(value) => bytes.extend(value.to_le_bytes()),
        }
    }
}

/// All returns, in the order of the list.
pub(super) fn returns(cloud: &PointCloud) -> impl Iterator<Item = Point> + '_ {
    (0..cloud.returns()).map(Point::Return)
}

/// Every pixel, with the return that the image of the cloud shows.
pub(super) fn pixels(cloud: &PointCloud) -> Vec<Point> {
    let image = cloud.image(cloud.pick);
    let point =
        |(pixel, at): (usize, Option<usize>)| at.map_or(Point::Unanswered(pixel), Point::Return);
    image.iter().enumerate().map(point).collect()
}

/// The outcome with the number `code` in binary files.
pub(super) fn outcome_from_code(code: u8) -> Option<Outcome> {
    Outcome::ALL.get(usize::from(code)).copied()
}

/// Refuses a cloud with a column that is not empty and has not one entry per return or pixel, or with too
/// many pixels to number. After this, indexing the columns that the cloud has is safe.
pub(super) fn check_even(cloud: &PointCloud) -> Result<(), Error> {
    let (rows, columns) = (cloud.rows, cloud.columns);
    if rows.max(columns) > MOST_ROWS {
        return Err(Error::TooLarge { rows, columns });
    }
    let extents: Vec<Extent> =
        Attribute::stored().flat_map(|attribute| attribute.extents(cloud)).collect();
    let is_there = |group| extents.iter().any(|column| column.group == group && column.found > 0);
    let is_uneven = |column: &&Extent| {
        let is_wanted = column.found > 0 || column.group.is_some() && is_there(column.group);
        is_wanted && column.found != column.needed
    };
    match extents.iter().find(is_uneven) {
        Some(&Extent { name, found, needed, of, .. }) => {
            Err(Error::Uneven { column: name, found, needed, of })
        }
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::super::sample_cloud;
    use super::*;
    use crate::points::Truth;

    #[test]
    fn every_value_is_of_the_kind_of_its_attribute() {
        let cloud = sample_cloud();
        for attribute in Attribute::of(&cloud) {
            for point in [Point::Return(0), Point::Unanswered(2)] {
                assert_eq!(attribute.value(&cloud, point).kind(), attribute.kind(&cloud));
            }
        }
    }

    /// The table of fields in docs/formats.md has each attribute with its type and unit, the truth
    /// behind the line that begins it.
    #[test]
    fn the_documentation_has_every_attribute() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/formats.md");
        let documented = std::fs::read_to_string(path).unwrap();
        let (_, table) = documented.split_once("| field | type | unit | meaning |\n").unwrap();
        let (table, _) = table.split_once("\n\n").unwrap();
        let (measured, truth) = table.split_once("| with `--truth`: |").unwrap();
        let rows = |part: &str| {
            let mut rows = Vec::new();
            for line in part.lines() {
                let cells: Vec<&str> = line.split('|').map(str::trim).collect();
                let names =
                    cells[1..].first().map_or(Vec::new(), |names| names.split(", ").collect());
                let named = names.into_iter().filter(|name| name.starts_with('`'));
                rows.extend(named.map(|name| [name, cells[2], cells[3]].map(str::to_owned)));
            }
            rows
        };
        let declared = |is_true: bool| {
            let attributes = Attribute::in_files().filter(|one| one.is_true() == is_true);
            let declared = attributes.map(|attribute| {
                let kind = match attribute.kind(&PointCloud::default()) {
                    Kind::F4 => "float 4",
                    Kind::F8 => "float 8",
                    Kind::U1 => "unsigned 1",
                    _ => "unsigned 2",
                };
                [&format!("`{}`", attribute.name()), kind, attribute.unit()].map(str::to_owned)
            });
            declared.collect::<Vec<_>>()
        };
        assert_eq!(rows(measured), declared(false));
        assert_eq!(rows(truth), declared(true));
    }

    #[test]
    fn flags_tell_faint_and_ambiguous_returns() {
        let mut cloud = sample_cloud();
        let flags = |cloud: &PointCloud, point| Attribute::Flags.value(cloud, point);
        assert_eq!(flags(&cloud, Point::Return(0)), Value::U1(0));
        // 60 of 174 marks.
        assert_eq!(flags(&cloud, Point::Return(2)), Value::U1(1));
        cloud.margin[2] = 0;
        assert_eq!(flags(&cloud, Point::Return(2)), Value::U1(3));
        cloud.saturated[0] = true;
        assert_eq!(flags(&cloud, Point::Return(0)), Value::U1(4));
        // No return: no flag, no number.
        assert_eq!(flags(&cloud, Point::Unanswered(2)), Value::U1(0));
        assert_eq!(Attribute::ReturnNumber.value(&cloud, Point::Unanswered(2)), Value::U1(0));
    }

    #[test]
    fn every_pixel_has_its_return_or_stands_for_itself() {
        let points = pixels(&sample_cloud());
        assert_eq!(points[1..4], [Point::Return(1), Point::Unanswered(2), Point::Return(2)]);
    }

    #[test]
    fn without_truth_there_are_no_truth_attributes() {
        let mut cloud = sample_cloud();
        assert_eq!(Attribute::of(&cloud).len(), 20);
        cloud.truth = Truth::default();
        check_even(&cloud).unwrap();
        assert_eq!(Attribute::of(&cloud).len(), 15);
    }

    #[test]
    fn half_a_truth_is_refused() {
        let mut cloud = sample_cloud();
        cloud.truth.pixels.outcome.clear();
        let error = check_even(&cloud).unwrap_err();
        assert!(matches!(error, Error::Uneven { column: "truth.pixels.outcome", found: 0, .. }));
        let mut cloud = sample_cloud();
        cloud.truth.returns = Default::default();
        let error = check_even(&cloud).unwrap_err();
        assert!(matches!(error, Error::Uneven { column: "truth.returns.range", needed: 5, .. }));
    }

    #[test]
    fn rows_beyond_16_bits_are_refused() {
        let wide = PointCloud { rows: 0, columns: MOST_ROWS + 1, ..PointCloud::default() };
        assert!(matches!(check_even(&wide), Err(Error::TooLarge { .. })));
    }

    #[test]
    fn outcome_codes_go_there_and_back() {
        for outcome in Outcome::ALL {
            assert_eq!(outcome_from_code(outcome as u8), Some(outcome));
        }
        assert_eq!(outcome_from_code(7), None);
    }
}

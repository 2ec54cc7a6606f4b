//! What is written of each point: one table for all point formats.

use super::Error;
use super::number::Kind;
use crate::points::{Outcome, PointCloud, Surface};

/// Rows or columns that 16 bits can number.
const MOST_ROWS: usize = 1 << 16;

/// What is written as a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Point {
    /// The return at this place of the list.
    Return(usize),
    /// This pixel, which has no return.
    Unanswered(usize),
}

/// One attribute of a point, in the order of the files.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(super) enum Attribute {
    X,
    Y,
    Z,
    Intensity,
    Range,
    TimeNs,
    Row,
    Column,
    Ring,
    Peak,
    Marks,
    Margin,
    ReturnNumber,
    NumberOfReturns,
    Flags,
    TrueRange,
    Object,
    Material,
    Incidence,
    Outcome,
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

/// Attributes of the measurement; the others are truth.
const MEASURED: usize = 15;

impl Attribute {
    /// All attributes, the truth at the end.
    pub const ALL: [Self; 20] = [
        Self::X,
        Self::Y,
        Self::Z,
        Self::Intensity,
        Self::Range,
        Self::TimeNs,
        Self::Row,
        Self::Column,
        Self::Ring,
        Self::Peak,
        Self::Marks,
        Self::Margin,
        Self::ReturnNumber,
        Self::NumberOfReturns,
        Self::Flags,
        Self::TrueRange,
        Self::Object,
        Self::Material,
        Self::Incidence,
        Self::Outcome,
    ];

    /// What is written of `cloud`: the attributes that it has, the truth at the end.
    pub fn of(cloud: &PointCloud) -> Vec<Self> {
        Self::ALL.into_iter().filter(|attribute| attribute.is_in(cloud)).collect()
    }

    /// Whether `cloud` has it.
    fn is_in(self, cloud: &PointCloud) -> bool {
        let has = |entries: usize| cloud.has(entries);
        match self {
            Self::X | Self::Y | Self::Z => true,
            Self::Intensity => has(cloud.intensity.len()),
            Self::Range => has(cloud.range.len()),
            Self::TimeNs => has(cloud.time_ns.len()),
            // A row without a column is the ring of a driver.
            Self::Row => has(cloud.row.len()) && has(cloud.column.len()),
            Self::Column => has(cloud.column.len()),
            Self::Ring => has(cloud.row.len()),
            Self::Peak => has(cloud.peak.len()),
            Self::Marks => has(cloud.marks.len()),
            Self::Margin => has(cloud.margin.len()),
            Self::ReturnNumber => has(cloud.return_number.len()),
            Self::NumberOfReturns => has(cloud.number_of_returns.len()),
            Self::Flags => has(cloud.marks.len()) || has(cloud.saturated.len()),
            Self::TrueRange | Self::Object | Self::Material | Self::Incidence | Self::Outcome => {
                has_truth(cloud)
            }
        }
    }

    /// Whether it is known from the scene alone.
    pub fn is_true(self) -> bool {
        !Self::ALL[..MEASURED].contains(&self)
    }

    /// The attribute of this name in binary or text files.
    pub fn named(name: &str) -> Option<Self> {
        let is_named =
            |known: &Self| known.name() == name || known.name_with_unit().as_str() == name;
        Self::ALL.into_iter().find(is_named)
    }

    /// Name in binary files.
    pub fn name(self) -> &'static str {
        match self {
            Self::X => "x",
            Self::Y => "y",
            Self::Z => "z",
            Self::Intensity => "intensity",
            Self::Range => "range",
            Self::TimeNs => "time_ns",
            Self::Row => "row",
            Self::Column => "column",
            Self::Ring => "ring",
            Self::Peak => "peak",
            Self::Marks => "marks",
            Self::Margin => "margin",
            Self::ReturnNumber => "return_number",
            Self::NumberOfReturns => "number_of_returns",
            Self::Flags => "flags",
            Self::TrueRange => "true_range",
            Self::Object => "object",
            Self::Material => "material",
            Self::Incidence => "incidence",
            Self::Outcome => "outcome",
        }
    }

    /// Name in text files: with its unit.
    pub fn name_with_unit(self) -> String {
        let unit = match self {
            Self::X | Self::Y | Self::Z | Self::Range | Self::TrueRange => "_m",
            Self::Incidence => "_rad",
            _ => "",
        };
        format!("{}{unit}", self.name())
    }

    /// A value of the attribute's type in `cloud`, to ask its width of, and what stands for no return.
    pub fn blank(self, cloud: &PointCloud) -> Value {
        match self {
            Self::X | Self::Y | Self::Z if !cloud.exact.x.is_empty() => Value::F8(f64::NAN),
            Self::Range if !cloud.exact.range.is_empty() => Value::F8(f64::NAN),
            Self::TimeNs => Value::F8(f64::NAN),
            Self::Outcome | Self::Flags => Value::U1(0),
            Self::ReturnNumber | Self::NumberOfReturns => Value::U1(0),
            Self::X | Self::Y | Self::Z | Self::Intensity | Self::Range => Value::F4(f32::NAN),
            Self::TrueRange | Self::Incidence => Value::F4(f32::NAN),
            _ => Value::U2(0),
        }
    }

    /// The attribute, one of [`Attribute::of`], of `point` in a cloud that passed [`check_even`].
    ///
    /// Object and material of a point without a surface are `NO_OBJECT`; the incidence angle is
    /// acos of the cosine, in radians. A pixel without a return has the first surface along its beam.
    pub fn value(self, cloud: &PointCloud, point: Point) -> Value {
        match point {
            Point::Return(at) => self.of_return(cloud, at),
            Point::Unanswered(pixel) => self.of_unanswered(cloud, pixel),
        }
    }

    fn of_return(self, cloud: &PointCloud, at: usize) -> Value {
        let length = |single: &[f32], exact: &[f64]| {
            exact.get(at).map_or_else(|| Value::F4(single[at]), |&exact| Value::F8(exact))
        };
        match self {
            Self::X => length(&cloud.x, &cloud.exact.x),
            Self::Y => length(&cloud.y, &cloud.exact.y),
            Self::Z => length(&cloud.z, &cloud.exact.z),
            Self::Intensity => Value::F4(cloud.intensity[at]),
            Self::Range => length(&cloud.range, &cloud.exact.range),
            Self::TimeNs => Value::F8(cloud.time_ns[at]),
            Self::Row | Self::Ring => Value::U2(cloud.row[at]),
            Self::Column => Value::U2(cloud.column[at]),
            Self::Peak => Value::U2(cloud.peak[at]),
            Self::Marks => Value::U2(cloud.marks[at]),
            Self::Margin => Value::U2(cloud.margin[at]),
            Self::ReturnNumber => Value::U1(cloud.return_number[at]),
            Self::NumberOfReturns => Value::U1(cloud.number_of_returns[at]),
            Self::Flags => Value::U1(cloud.flags(at)),
            Self::TrueRange | Self::Object | Self::Material | Self::Incidence | Self::Outcome => {
                self.of_surface(&cloud.truth.returns.at(at))
            }
        }
    }

    fn of_unanswered(self, cloud: &PointCloud, pixel: usize) -> Value {
        match self {
            Self::TimeNs => Value::F8(cloud.fired_ns.get(pixel).copied().unwrap_or(f64::NAN)),
            Self::Row | Self::Ring => Value::U2((pixel / cloud.columns) as u16),
            Self::Column => Value::U2((pixel % cloud.columns) as u16),
            Self::TrueRange | Self::Object | Self::Material | Self::Incidence | Self::Outcome => {
                self.of_surface(&cloud.truth.pixels.at(pixel))
            }
            _ => self.blank(cloud),
        }
    }

    /// An attribute of the truth.
    fn of_surface(self, surface: &Surface) -> Value {
        match self {
            Self::TrueRange => Value::F4(surface.range),
            Self::Object => Value::U2(surface.object),
            Self::Material => Value::U2(surface.material),
            Self::Incidence => {
                let cosine = f64::from(surface.cosine).clamp(0.0, 1.0);
                Value::F4(libm::acos(cosine) as f32)
            }
            _ => Value::U1(surface.outcome as u8),
        }
    }
}

impl Value {
    /// What it is stored as.
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

/// Whether the truth stands beside the measurement.
pub(super) fn has_truth(cloud: &PointCloud) -> bool {
    !(cloud.truth.pixels.outcome.is_empty() && cloud.truth.returns.outcome.is_empty())
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
/// many pixels to number: after this, indexing the columns that the cloud has is safe.
pub(super) fn check_even(cloud: &PointCloud) -> Result<(), Error> {
    let coordinates = [("y", cloud.y.len()), ("z", cloud.z.len())];
    let exact = [
        ("exact.x", cloud.exact.x.len()),
        ("exact.y", cloud.exact.y.len()),
        ("exact.z", cloud.exact.z.len()),
    ];
    let of_returns = [
        ("range", cloud.range.len()),
        ("exact.range", cloud.exact.range.len()),
        ("intensity", cloud.intensity.len()),
        ("time_ns", cloud.time_ns.len()),
        ("row", cloud.row.len()),
        ("column", cloud.column.len()),
        ("return_number", cloud.return_number.len()),
        ("number_of_returns", cloud.number_of_returns.len()),
        ("peak", cloud.peak.len()),
        ("marks", cloud.marks.len()),
        ("margin", cloud.margin.len()),
        ("photons", cloud.photons.len()),
        ("saturated", cloud.saturated.len()),
    ];
    let (seen, first) = (&cloud.truth.returns, &cloud.truth.pixels);
    let true_returns = [
        ("truth.returns.range", seen.range.len()),
        ("truth.returns.object", seen.object.len()),
        ("truth.returns.material", seen.material.len()),
        ("truth.returns.cosine", seen.cosine.len()),
        ("truth.returns.outcome", seen.outcome.len()),
    ];
    let true_pixels = [
        ("truth.pixels.range", first.range.len()),
        ("truth.pixels.object", first.object.len()),
        ("truth.pixels.material", first.material.len()),
        ("truth.pixels.cosine", first.cosine.len()),
        ("truth.pixels.outcome", first.outcome.len()),
    ];
    let (rows, columns) = (cloud.rows, cloud.columns);
    if rows.max(columns) > MOST_ROWS {
        return Err(Error::TooLarge { rows, columns });
    }
    let is_there = |(_, entries): &(&str, usize)| *entries > 0;
    let with_truth = true_returns.iter().chain(&true_pixels).any(is_there);
    let with_exact = exact.iter().any(is_there);
    let (returns, pixels) = (cloud.returns(), rows.saturating_mul(columns));
    let per_return = coordinates.into_iter().chain(of_returns.into_iter().filter(is_there));
    let per_return = per_return.chain(exact.into_iter().filter(|_| with_exact));
    let per_return = per_return.chain(true_returns.into_iter().filter(|_| with_truth));
    let per_pixel = true_pixels.into_iter().filter(|_| with_truth);
    let per_pixel = per_pixel.chain(Some(("fired_ns", cloud.fired_ns.len())).filter(is_there));
    let wanted = per_return.map(|column| (column, returns, "returns"));
    let mut wanted = wanted.chain(per_pixel.map(|column| (column, pixels, "pixels")));
    match wanted.find(|((_, found), needed, _)| found != needed) {
        Some(((column, found), needed, of)) => Err(Error::Uneven { column, found, needed, of }),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::super::sample_cloud;
    use super::*;
    use crate::points::Truth;

    #[test]
    fn blank_has_the_type_of_every_value() {
        let cloud = sample_cloud();
        for attribute in Attribute::of(&cloud) {
            for point in [Point::Return(0), Point::Unanswered(2)] {
                let [blank, value] = [attribute.blank(&cloud), attribute.value(&cloud, point)];
                assert_eq!(std::mem::discriminant(&blank), std::mem::discriminant(&value));
            }
        }
    }

    #[test]
    fn an_attribute_is_found_by_its_name_with_or_without_a_unit() {
        for attribute in Attribute::ALL {
            assert_eq!(Attribute::named(attribute.name()), Some(attribute));
            assert_eq!(Attribute::named(&attribute.name_with_unit()), Some(attribute));
        }
        assert_eq!(Attribute::named("nir"), None);
        let truth = Attribute::ALL.into_iter().filter(|attribute| attribute.is_true());
        assert_eq!(truth.count(), 5);
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

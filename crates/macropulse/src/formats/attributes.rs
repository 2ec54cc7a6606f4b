//! What is written of each pixel: one table for all point formats.

use super::Error;
use crate::points::{Outcome, PointCloud};

/// Rows or columns that 16 bits can number.
const MOST_ROWS: usize = 1 << 16;

/// One attribute of a point, in the order of the files.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
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
}

const MEASURED: [Attribute; 15] = [
    Attribute::X,
    Attribute::Y,
    Attribute::Z,
    Attribute::Intensity,
    Attribute::Range,
    Attribute::TimeNs,
    Attribute::Row,
    Attribute::Column,
    Attribute::Ring,
    Attribute::Peak,
    Attribute::Marks,
    Attribute::Margin,
    Attribute::ReturnNumber,
    Attribute::NumberOfReturns,
    Attribute::Flags,
];

const TRUE: [Attribute; 5] = [
    Attribute::TrueRange,
    Attribute::Object,
    Attribute::Material,
    Attribute::Incidence,
    Attribute::Outcome,
];

impl Attribute {
    /// What is written of `cloud`: the measurement and, if it is there, the truth.
    pub fn of(cloud: &PointCloud) -> Vec<Self> {
        let mut attributes = MEASURED.to_vec();
        if has_truth(cloud) {
            attributes.extend(TRUE);
        }
        attributes
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

    /// A value of the attribute's type, to ask its width of.
    pub fn blank(self) -> Value {
        match self {
            Self::TimeNs => Value::F8(0.0),
            Self::Outcome | Self::Flags => Value::U1(0),
            Self::ReturnNumber | Self::NumberOfReturns => Value::U1(0),
            Self::X | Self::Y | Self::Z | Self::Intensity | Self::Range => Value::F4(f32::NAN),
            Self::TrueRange | Self::Incidence => Value::F4(f32::NAN),
            _ => Value::U2(0),
        }
    }

    /// The attribute at pixel `at` of a cloud that passed [`check_even`].
    ///
    /// Object and material of a pixel without a surface are `NO_OBJECT`; the incidence angle is
    /// acos of the cosine, in radians.
    pub fn value(self, cloud: &PointCloud, at: usize) -> Value {
        let truth = &cloud.truth;
        match self {
            Self::X => Value::F4(cloud.x[at]),
            Self::Y => Value::F4(cloud.y[at]),
            Self::Z => Value::F4(cloud.z[at]),
            Self::Intensity => Value::F4(cloud.intensity[at]),
            Self::Range => Value::F4(cloud.range[at]),
            Self::TimeNs => Value::F8(cloud.time_ns[at]),
            Self::Row | Self::Ring => Value::U2((at / cloud.columns) as u16),
            Self::Column => Value::U2((at % cloud.columns) as u16),
            Self::Peak => Value::U2(cloud.peak[at]),
            Self::Marks => Value::U2(cloud.marks[at]),
            Self::Margin => Value::U2(cloud.margin[at]),
            // A shot has one return or none.
            Self::ReturnNumber | Self::NumberOfReturns => {
                Value::U1(u8::from(!cloud.range[at].is_nan()))
            }
            Self::Flags => Value::U1(cloud.flags(at)),
            Self::TrueRange => Value::F4(truth.range[at]),
            Self::Object => Value::U2(truth.object[at]),
            Self::Material => Value::U2(truth.material[at]),
            Self::Incidence => {
                let cosine = f64::from(truth.cosine[at]).clamp(0.0, 1.0);
                Value::F4(libm::acos(cosine) as f32)
            }
            Self::Outcome => Value::U1(truth.outcome[at] as u8),
        }
    }
}

impl Value {
    /// Bytes in binary files.
    pub fn size(self) -> usize {
        match self {
            Self::U1(_) => 1,
            Self::U2(_) => 2,
            Self::F4(_) => 4,
            Self::F8(_) => 8,
        }
    }

    /// Appends the value, little endian.
    pub fn append_to(self, bytes: &mut Vec<u8>) {
        match self {
            Self::U1(value) => bytes.push(value),
            Self::U2(value) => bytes.extend(value.to_le_bytes()),
            Self::F4(value) => bytes.extend(value.to_le_bytes()),
            Self::F8(value) => bytes.extend(value.to_le_bytes()),
        }
    }
}

/// Whether the truth stands beside the measurement.
pub(super) fn has_truth(cloud: &PointCloud) -> bool {
    !cloud.truth.outcome.is_empty()
}

/// Pixels that hold a return.
pub(super) fn valid_pixels(cloud: &PointCloud) -> impl Iterator<Item = usize> + '_ {
    (0..cloud.range.len()).filter(|&at| cloud.range[at].is_finite())
}

/// The outcome with the number `code` in binary files.
pub(super) fn outcome_from_code(code: u8) -> Option<Outcome> {
    Outcome::ALL.get(usize::from(code)).copied()
}

/// One comment line per name, for the headers of files that hold numbers only.
pub(super) fn comment_lines(what: &str, names: &[String]) -> Vec<String> {
    let clean = |name: &str| name.replace(char::is_control, " ");
    names.iter().enumerate().map(|(at, name)| format!("{what} {at} {}", clean(name))).collect()
}

/// Refuses a cloud whose columns have not one entry per pixel each, or too many pixels to number:
/// after this, indexing is safe.
pub(super) fn check_even(cloud: &PointCloud) -> Result<(), Error> {
    let measured = [
        ("x", cloud.x.len()),
        ("y", cloud.y.len()),
        ("z", cloud.z.len()),
        ("intensity", cloud.intensity.len()),
        ("range", cloud.range.len()),
        ("time_ns", cloud.time_ns.len()),
        ("peak", cloud.peak.len()),
        ("marks", cloud.marks.len()),
        ("margin", cloud.margin.len()),
    ];
    let truth = [
        ("truth.range", cloud.truth.range.len()),
        ("truth.object", cloud.truth.object.len()),
        ("truth.material", cloud.truth.material.len()),
        ("truth.cosine", cloud.truth.cosine.len()),
        ("truth.outcome", cloud.truth.outcome.len()),
    ];
    let with_truth = truth.iter().any(|(_, entries)| *entries > 0);
    let (rows, columns) = (cloud.rows, cloud.columns);
    if rows.max(columns) > MOST_ROWS {
        return Err(Error::TooLarge { rows, columns });
    }
    let pixels = rows.saturating_mul(columns);
    measured
        .into_iter()
        .chain(truth.into_iter().filter(|_| with_truth))
        .find(|(_, entries)| *entries != pixels)
        .map_or(Ok(()), |(column, found)| Err(Error::Uneven { column, found, rows, columns }))
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
            let [blank, value] = [attribute.blank(), attribute.value(&cloud, 0)];
            assert_eq!(std::mem::discriminant(&blank), std::mem::discriminant(&value));
        }
    }

    #[test]
    fn flags_tell_faint_and_ambiguous_returns() {
        let mut cloud = sample_cloud();
        let flags = |cloud: &PointCloud, at| Attribute::Flags.value(cloud, at);
        assert_eq!(flags(&cloud, 0), Value::U1(0));
        // 60 of 174 marks.
        assert_eq!(flags(&cloud, 3), Value::U1(1));
        cloud.margin[3] = 0;
        assert_eq!(flags(&cloud, 3), Value::U1(3));
        // No return: no flag, no number.
        cloud.margin[2] = 0;
        assert_eq!(flags(&cloud, 2), Value::U1(0));
        assert_eq!(Attribute::ReturnNumber.value(&cloud, 2), Value::U1(0));
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
        cloud.truth.outcome.clear();
        let error = check_even(&cloud).unwrap_err();
        assert!(matches!(error, Error::Uneven { column: "truth.outcome", found: 0, .. }));
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
        assert_eq!(outcome_from_code(6), None);
    }
}

//! The names that programs give to the attributes of a point: one table for all readers.

use super::attributes::Attribute;
use super::number::Kind;
use super::ply;

/// Attributes, and what other programs call them: in lower case, with `_` between words.
const ALIASES: &[(Attribute, &[&str])] = &[
    (Attribute::X, &["points:0", "points_m_xyz:0", "points_0", "cartesian_x", "pos_x"]),
    (Attribute::Y, &["points:1", "points_m_xyz:1", "points_1", "cartesian_y", "pos_y"]),
    (Attribute::Z, &["points:2", "points_m_xyz:2", "points_2", "cartesian_z", "pos_z"]),
    (
        Attribute::Intensity,
        &["i", "intensities", "reflectance", "reflectivity", "remission", "remissions"],
    ),
    (Attribute::Range, &["distance", "dist"]),
    (
        Attribute::TimeNs,
        &["time", "t", "timestamp", "time_stamp", "timestamps", "gps_time", "gpstime"],
    ),
    (Attribute::Column, &["col"]),
    (
        Attribute::Ring,
        &["channel", "line", "laser_id", "laserid", "laser", "laser_number", "beam", "beam_id"],
    ),
    (Attribute::ReturnNumber, &["returnnumber", "return_num"]),
    (Attribute::NumberOfReturns, &["numberofreturns", "num_returns", "return_count"]),
];

/// Names of times that have a unit of their own, and the ns of that unit.
const TIMES: [(&str, f64); 3] = [("offset_time", 1.0), ("t_ns", 1.0), ("adjustedtime", 1e3)];

/// The meaning of a column.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Meaning {
    pub attribute: Attribute,
    unit: Unit,
}

/// The unit of a stored number.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Unit {
    /// The number times this is in our unit.
    Times(f64),
    /// Seconds; a time too large for seconds since 1970 is in ms, µs or ns.
    Clock,
}

impl Meaning {
    /// An attribute that is stored in our unit.
    pub fn of(attribute: Attribute) -> Self {
        Self::scaled(attribute, 1.0)
    }

    /// An attribute whose number is in our unit once it is multiplied by `factor`.
    pub fn scaled(attribute: Attribute, factor: f64) -> Self {
        Self { attribute, unit: Unit::Times(factor) }
    }

    /// Returns true if the stored number is in our unit.
    pub fn is_as_stored(self) -> bool {
        self.unit == Unit::Times(1.0)
    }

    /// The number in our unit.
    pub fn number(self, stored: f64) -> f64 {
        match self.unit {
            Unit::Times(factor) => stored * factor,
            Unit::Clock => stored * clock(stored),
        }
    }

    /// Returns the meaning of the column with this heading. Its numbers are of this `kind`, if that is known.
    ///
    /// Case does not count. A unit may follow in brackets, behind a slash or behind `_`.
    pub fn of_heading(heading: &str, kind: Option<Kind>) -> Option<Self> {
        let lower = heading.trim().to_lowercase();
        let (name, unit) = match lower.split_once(['[', '(', '/']) {
            Some((name, unit)) => (name, Some(unit.trim_end_matches([']', ')']).trim())),
            None => (lower.as_str(), None),
        };
        let name = name.trim().replace([' ', '-'], "_");
        let name = name.strip_prefix(ply::SCALAR).unwrap_or(&name);
        Self::named(name, unit, kind).or_else(|| {
            let (name, unit) = name.rsplit_once('_').filter(|_| unit.is_none())?;
            Self::named(name, Some(unit), kind)
        })
    }

    fn named(name: &str, unit: Option<&str>, kind: Option<Kind>) -> Option<Self> {
        if let (Some((_, ns)), None) = (TIMES.iter().find(|(known, _)| *known == name), unit) {
            return Some(Self::scaled(Attribute::TimeNs, *ns));
        }
        let mut attributes = Attribute::in_files();
        let own = attributes.find(|own| own.name() == name || own.name_with_unit() == name);
        let alias = || ALIASES.iter().find(|(_, names)| names.contains(&name)).map(|known| known.0);
        let attribute = own.or_else(alias)?;
        let is_whole = kind.is_some_and(Kind::is_whole);
        let unit = match (attribute.unit(), unit) {
            ("m", Some(unit)) => Unit::Times(metres(unit)?),
            ("ns", Some(unit)) => Unit::Times(nanoseconds(unit)?),
            (own, Some(unit)) if own == unit => Unit::Times(1.0),
            (_, Some(_)) => return None,
            // Drivers store whole millimetres, and whole nanoseconds or seconds as floats.
            _ if attribute == Attribute::Range && is_whole && !name.ends_with("_m") => {
                Unit::Times(1e-3)
            }
            ("ns", None) if own.is_none() && !is_whole => Unit::Clock,
            (_, None) => Unit::Times(1.0),
        };
        Some(Self { attribute, unit })
    }
}

/// Returns the nanoseconds of the unit of a time of this size. Seconds since 1970 stay below 10¹¹ for 3000
/// years. A time since 1970 in ms, µs or ns is above 10¹¹, 10¹⁴ or 10¹⁷.
fn clock(stored: f64) -> f64 {
    match stored.abs() {
        size if size >= 1e17 => 1.0,
        size if size >= 1e14 => 1e3,
        size if size >= 1e11 => 1e6,
        _ => 1e9,
    }
}

fn metres(unit: &str) -> Option<f64> {
    Some(match unit {
        "m" | "metre" | "metres" | "meter" | "meters" => 1.0,
        "cm" => 1e-2,
        "mm" => 1e-3,
        _ => return None,
    })
}

fn nanoseconds(unit: &str) -> Option<f64> {
    Some(match unit {
        "s" | "sec" | "second" | "seconds" => 1e9,
        "ms" => 1e6,
        "us" | "µs" => 1e3,
        "ns" => 1.0,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::points::PointCloud;

    #[test]
    fn a_heading_is_understood_in_any_usual_spelling() {
        let attribute = |heading: &str| Meaning::of_heading(heading, None).map(|m| m.attribute);
        for heading in ["x", "X", " x [m]", "X(m)", "x/m", "x_m", "Points:0", "Points_m_XYZ:0"] {
            assert_eq!(attribute(heading), Some(Attribute::X), "{heading}");
        }
        for heading in ["I", "Intensity", "intensity", "scalar_Intensity", "Reflectivity"] {
            assert_eq!(attribute(heading), Some(Attribute::Intensity), "{heading}");
        }
        assert_eq!(attribute("Number of Returns"), Some(Attribute::NumberOfReturns));
        assert_eq!(attribute("Distance_m"), Some(Attribute::Range));
        assert_eq!(attribute("laser_id"), Some(Attribute::Ring));
        for unknown in ["r", "red", "nx", "classification", "x [ft]", "intensity [m]", "", "_"] {
            assert_eq!(attribute(unknown), None, "{unknown}");
        }
    }

    #[test]
    fn every_own_name_is_understood_in_its_own_unit() {
        for attribute in Attribute::in_files() {
            let kind = Some(attribute.kind(&PointCloud::default()));
            for name in [attribute.name().to_owned(), attribute.name_with_unit()] {
                let meaning = Meaning::of_heading(&name, kind).unwrap();
                assert_eq!((meaning.attribute, meaning.number(3.0)), (attribute, 3.0), "{name}");
            }
        }
    }

    #[test]
    fn units_follow_from_the_heading_or_the_kind() {
        let number = |heading: &str, kind, stored: f64| {
            Meaning::of_heading(heading, kind).unwrap().number(stored)
        };
        assert_eq!(number("z [mm]", None, 1500.0), 1.5);
        assert_eq!(number("range", Some(Kind::U4), 1500.0), 1.5);
        assert_eq!(number("timestamp", Some(Kind::F8), 2.5), 2.5e9);
        assert_eq!(number("t", Some(Kind::U4), 2500.0), 2500.0);
        assert_eq!(number("Timestamp [us]", None, 2.0), 2000.0);
        // The same moment of 2024 in s, ms, µs and ns.
        for factor in [1.0, 1e3, 1e6, 1e9] {
            let ns = number("gps_time", Some(Kind::F8), 1.7e9 * factor);
            assert!((ns / 1.7e18 - 1.0).abs() < 1e-12, "{factor}: {ns}");
        }
    }
}

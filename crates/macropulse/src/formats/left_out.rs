//! Contents of a file that its reader leaves out: a list, so that nothing is lost without a word.

use std::collections::BTreeMap;
use std::fmt;

/// Names of fields that a sentence lists at most.
const MOST_NAMES: usize = 24;

/// Contents of a file that are not in its clouds. `Display` lists them in words.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct LeftOut {
    /// Fields of points that a cloud has no column for, by their names in the file: colours and
    /// classes, too.
    pub fields: Vec<String>,
    /// The coordinate reference system, as the file names it.
    pub reference_system: Option<String>,
    /// Number of points that were dropped, by reason.
    pub points: BTreeMap<NoPoint, u64>,
}

/// Why a point of a file is no point of the cloud.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum NoPoint {
    /// The file marks it as invalid.
    Invalid,
    /// The file marks it as withheld.
    Withheld,
    /// It lies at (0, 0, 0), which drivers write where nothing returned.
    AtOrigin,
    /// A coordinate or its range is not a finite number.
    NotFinite,
}

impl NoPoint {
    fn name(self) -> &'static str {
        match self {
            Self::Invalid => "marked as invalid",
            Self::Withheld => "marked as withheld",
            Self::AtOrigin => "at (0, 0, 0)",
            Self::NotFinite => "without finite coordinates",
        }
    }
}

impl LeftOut {
    /// Returns true if nothing is left out.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// Returns true if `other` leaves out the same, but for the number of points.
    pub fn is_alike(&self, other: &Self) -> bool {
        self.fields == other.fields
            && self.reference_system == other.reference_system
            && self.points.keys().eq(other.points.keys())
    }

    /// Adds a field, unless it is known.
    pub(super) fn field(&mut self, name: &str) {
        let name = name.replace(char::is_control, " ");
        if !self.fields.contains(&name) {
            self.fields.push(name);
        }
    }

    /// Adds points that were dropped.
    pub(super) fn drop_points(&mut self, why: NoPoint, count: u64) {
        if count > 0 {
            *self.points.entry(why).or_default() += count;
        }
    }
}

impl fmt::Display for LeftOut {
    fn fmt(&self, out: &mut fmt::Formatter) -> fmt::Result {
        let mut parts = Vec::new();
        if !self.fields.is_empty() {
            let listed = &self.fields[..self.fields.len().min(MOST_NAMES)];
            let more = match self.fields.len() - listed.len() {
                0 => String::new(),
                more => format!(" and {more} more"),
            };
            let noun = if self.fields.len() == 1 { "field" } else { "fields" };
            parts.push(format!("{noun} {}{more}", listed.join(", ")));
        }
        if let Some(system) = &self.reference_system {
            parts.push(format!("coordinate reference system {system}"));
        }
        for (why, count) in &self.points {
            let noun = if *count == 1 { "point" } else { "points" };
            parts.push(format!("{count} {noun} {}", why.name()));
        }
        out.write_str(&parts.join("; "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sentence_names_all_that_is_left_out() {
        let mut left_out = LeftOut::default();
        assert!(left_out.is_empty());
        for name in ["red", "green", "red", "two\nlines"] {
            left_out.field(name);
        }
        left_out.reference_system = Some("EPSG:25832".to_owned());
        left_out.drop_points(NoPoint::AtOrigin, 2);
        left_out.drop_points(NoPoint::Withheld, 1);
        left_out.drop_points(NoPoint::Invalid, 0);
        assert_eq!(
            left_out.to_string(),
            "fields red, green, two lines; coordinate reference system EPSG:25832; \
             1 point marked as withheld; 2 points at (0, 0, 0)"
        );
        (0..40).for_each(|at| left_out.field(&format!("f{at}")));
        assert!(left_out.to_string().contains("f20 and 19 more;"), "{left_out}");
    }
}

//! Which files are asked for.

use std::str::FromStr;

use macropulse::codec::RecordKind;
use macropulse::codec::files::Form;
use macropulse::design::Design;
use macropulse::formats::{self, Format};

use super::recorded::Kept;

/// The name of ticks as text.
const TICKS_CSV: &str = "ticks-csv";

/// The formats asked for, each once; and what is wanted beside them of what was recorded.
#[derive(Debug, Clone, PartialEq)]
pub struct Formats(pub Vec<Format>, pub Records);

/// Records that are asked for, with the shots; of ticks the form that was named last, as both hold the same.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Records(Vec<Kept>);

impl Records {
    /// True if none is asked for.
    pub fn is_none(&self) -> bool {
        self.0.is_empty()
    }

    /// Takes the record that is called `name`; `false` if none is.
    pub fn add(&mut self, name: &str) -> bool {
        let Some(kept) = record(name) else { return false };
        self.0.retain(|other| other.kind != kept.kind);
        self.0.push(kept);
        true
    }

    /// Which of them `design` has, if any is asked for; or the sentence that says why none.
    pub fn of(&self, design: &Design) -> Result<Option<Kept>, String> {
        let kind = design.records();
        let kept = self.0.iter().find(|kept| kept.kind == kind).copied();
        if kept.is_none() && !self.is_none() {
            let (name, record) = (&design.name, kind.name());
            return Err(format!("{name} records {record} and nothing else; ask for `{record}`"));
        }
        Ok(kept)
    }
}

/// The record that is called `name`, if it is one.
fn record(name: &str) -> Option<Kept> {
    let name = name.trim().to_lowercase();
    if name == TICKS_CSV {
        return Some(Kept { kind: RecordKind::Ticks, form: Form::Text });
    }
    let kind = RecordKind::ALL.iter().find(|kind| kind.name() == name)?;
    Some(Kept { kind: *kind, form: Form::Binary })
}

/// The form of shots and ticks that is called `name`, if it is one.
pub fn form(name: &str) -> Option<Form> {
    record(name).filter(|kept| kept.kind == RecordKind::Ticks).map(|kept| kept.form)
}

impl Default for Formats {
    fn default() -> Self {
        Self(vec![Format::Pcd, Format::Png], Records::default())
    }
}

impl Formats {
    /// Returns the text on formats in `--help`.
    pub fn help() -> String {
        let names =
            |formats: &[Format]| formats.iter().map(|format| format.name()).collect::<Vec<_>>();
        let (known, default) = (names(Format::ALL), names(&Self::default().0));
        let records: Vec<&str> = RecordKind::ALL.iter().map(|kind| kind.name()).collect();
        format!(
            "Formats to write: {}, {TICKS_CSV}, {} (shots, and what the receiver is given of them, for `decode`), \
             with commas between them, or none [default: {}]",
            known.join(", "),
            records.join(", "),
            default.join(",")
        )
    }
}

impl FromStr for Formats {
    type Err = formats::Error;

    /// Names with commas between them; `none` alone is no format at all.
    fn from_str(typed: &str) -> Result<Self, Self::Err> {
        let (mut list, mut records) = (Vec::new(), Records::default());
        if typed.trim() != "none" {
            for name in typed.split(',') {
                if records.add(name) {
                    continue;
                }
                let format = Format::parse(name)?;
                if !list.contains(&format) {
                    list.push(format);
                }
            }
        }
        Ok(Self(list, records))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formats_are_listed_with_commas() {
        assert_eq!(Formats::from_str("pcd,PLY,pcd").unwrap().0, [Format::Pcd, Format::Ply]);
        assert!(Formats::from_str("none").unwrap().0.is_empty());
        let with_ticks = Formats::from_str("ticks-csv,pcd").unwrap();
        let ticks = Kept { kind: RecordKind::Ticks, form: Form::Text };
        assert_eq!(with_ticks, Formats(vec![Format::Pcd], Records(vec![ticks])));
        assert!(Formats::from_str("").is_err());
        assert!(Formats::from_str("pcd,none").is_err());
    }

    #[test]
    fn a_sensor_has_ticks_or_samples() {
        let [sampled, ticks] =
            ["coded-32", "peregrine"].map(|name| Design::open(name, &[]).unwrap());
        let kept = |kind| Kept { kind, form: Form::Binary };
        let of = |typed: &str, design: &Design| Formats::from_str(typed).unwrap().1.of(design);
        assert_eq!(of("pcd", &sampled), Ok(None));
        assert_eq!(of("ticks,samples", &sampled), Ok(Some(kept(RecordKind::Samples))));
        assert_eq!(of("ticks,samples", &ticks), Ok(Some(kept(RecordKind::Ticks))));
        assert!(of("ticks", &sampled).unwrap_err().contains("ask for `samples`"));
        assert!(of("Samples", &ticks).unwrap_err().contains("ask for `ticks`"));
    }
}

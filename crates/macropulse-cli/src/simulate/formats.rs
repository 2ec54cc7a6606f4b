//! Which files are asked for.

use std::str::FromStr;

use macropulse::codec::RecordKind;
use macropulse::codec::files::Form;
use macropulse::design::Design;
use macropulse::formats::{self, Format};

use super::recorded::Kept;

/// The formats asked for, each once; and what is wanted beside them of what was recorded.
#[derive(Debug, Clone, PartialEq)]
pub struct Formats(pub Vec<Format>, pub Records);

/// Which records are asked for, with the shots.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Records {
    /// Ticks, and in which form.
    pub ticks: Option<Form>,
    pub samples: bool,
    pub histograms: bool,
    pub taps: bool,
    pub beats: bool,
}

impl Records {
    /// Returns true if none is asked for.
    pub fn is_none(self) -> bool {
        self == Self::default()
    }

    /// Takes the record that is called `name`; `false` if none is.
    pub fn add(&mut self, name: &str) -> bool {
        let form = form(name);
        let is = |kind: RecordKind| name.trim().eq_ignore_ascii_case(kind.name());
        let [samples, histograms, taps, beats] =
            [RecordKind::Samples, RecordKind::Histograms, RecordKind::Taps, RecordKind::Beats]
                .map(is);
        // Both forms hold the same: the last one named counts.
        self.ticks = form.or(self.ticks);
        self.samples |= samples;
        self.histograms |= histograms;
        self.taps |= taps;
        self.beats |= beats;
        samples || histograms || taps || beats || form.is_some()
    }

    /// Which of them `design` has, if any is asked for; or the sentence that says why none.
    pub fn of(self, design: &Design) -> Result<Option<Kept>, String> {
        let name = &design.name;
        match (design.records(), self.ticks) {
            (RecordKind::Samples, _) if self.samples => Ok(Some(Kept::Samples)),
            (RecordKind::Histograms, _) if self.histograms => Ok(Some(Kept::Histograms)),
            (RecordKind::Taps, _) if self.taps => Ok(Some(Kept::Taps)),
            (RecordKind::Beats, _) if self.beats => Ok(Some(Kept::Beats)),
            (RecordKind::Ticks, Some(form)) => Ok(Some(Kept::Ticks(form))),
            _ if self.is_none() => Ok(None),
            (record, _) => {
                let record = record.name();
                Err(format!("{name} records {record} and nothing else; ask for `{record}`"))
            }
        }
    }
}

/// The form of shots and ticks that is called `name`, if it is one.
pub fn form(name: &str) -> Option<Form> {
    match name.trim().to_lowercase().as_str() {
        "ticks" => Some(Form::Binary),
        "ticks-csv" => Some(Form::Text),
        _ => None,
    }
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
        format!(
            "Formats to write: {}, ticks, ticks-csv, samples, histograms, taps, beats (shots, and what the \
             receiver is given of them, for `decode`), with commas between them, or none [default: {}]",
            known.join(", "),
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
        let ticks = Records { ticks: Some(Form::Text), ..Records::default() };
        assert_eq!(with_ticks, Formats(vec![Format::Pcd], ticks));
        assert!(Formats::from_str("").is_err());
        assert!(Formats::from_str("pcd,none").is_err());
    }

    #[test]
    fn a_sensor_has_ticks_or_samples() {
        let [sampled, ticks] =
            ["coded-32", "peregrine"].map(|name| Design::open(name, &[]).unwrap());
        let of = |typed: &str, design: &Design| Formats::from_str(typed).unwrap().1.of(design);
        assert_eq!(of("pcd", &sampled), Ok(None));
        assert_eq!(of("ticks,samples", &sampled), Ok(Some(Kept::Samples)));
        assert_eq!(of("ticks,samples", &ticks), Ok(Some(Kept::Ticks(Form::Binary))));
        assert!(of("ticks", &sampled).unwrap_err().contains("ask for `samples`"));
        assert!(of("Samples", &ticks).unwrap_err().contains("ask for `ticks`"));
    }
}

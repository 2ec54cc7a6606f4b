//! Which files are asked for.

use std::str::FromStr;

use macropulse::codec::files::Form;
use macropulse::formats::{self, Format};

/// The formats asked for, each once; and in which form shots and ticks are wanted, if they are.
#[derive(Debug, Clone, PartialEq)]
pub struct Formats(pub Vec<Format>, pub Option<Form>);

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
        Self(vec![Format::Pcd, Format::Png], None)
    }
}

impl Formats {
    /// What `--help` says of them.
    pub fn help() -> String {
        let names =
            |formats: &[Format]| formats.iter().map(|format| format.name()).collect::<Vec<_>>();
        let (known, default) = (names(Format::ALL), names(&Self::default().0));
        format!(
            "Formats to write: {}, ticks, ticks-csv (shots and ticks, for `decode`), with commas \
             between them, or none [default: {}]",
            known.join(", "),
            default.join(",")
        )
    }
}

impl FromStr for Formats {
    type Err = formats::Error;

    /// Names with commas between them; `none` alone is no format at all.
    fn from_str(typed: &str) -> Result<Self, Self::Err> {
        let (mut list, mut ticks) = (Vec::new(), None);
        if typed.trim() != "none" {
            for name in typed.split(',') {
                if let Some(form) = form(name) {
                    // Both hold the same: the last one named counts.
                    ticks = Some(form);
                    continue;
                }
                let format = Format::parse(name)?;
                if !list.contains(&format) {
                    list.push(format);
                }
            }
        }
        Ok(Self(list, ticks))
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
        assert_eq!(with_ticks, Formats(vec![Format::Pcd], Some(Form::Text)));
        assert!(Formats::from_str("").is_err());
        assert!(Formats::from_str("pcd,none").is_err());
    }
}

//! Which files are asked for.

use std::str::FromStr;

use macropulse::formats::{self, Format};

/// The formats asked for, each once.
#[derive(Debug, Clone, PartialEq)]
pub struct Formats(pub Vec<Format>);

impl Default for Formats {
    fn default() -> Self {
        Self(vec![Format::Pcd, Format::Png])
    }
}

impl Formats {
    /// What `--help` says of them.
    pub fn help() -> String {
        let names =
            |formats: &[Format]| formats.iter().map(|format| format.name()).collect::<Vec<_>>();
        let (known, default) = (names(Format::ALL), names(&Self::default().0));
        format!(
            "Formats to write: {}, with commas between them, or none [default: {}]",
            known.join(", "),
            default.join(",")
        )
    }
}

impl FromStr for Formats {
    type Err = formats::Error;

    /// Names with commas between them; `none` alone is no format at all.
    fn from_str(typed: &str) -> Result<Self, Self::Err> {
        let mut list = Vec::new();
        if typed.trim() != "none" {
            for name in typed.split(',') {
                let format = Format::parse(name)?;
                if !list.contains(&format) {
                    list.push(format);
                }
            }
        }
        Ok(Self(list))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formats_are_listed_with_commas() {
        assert_eq!(Formats::from_str("pcd,PLY,pcd").unwrap().0, [Format::Pcd, Format::Ply]);
        assert!(Formats::from_str("none").unwrap().0.is_empty());
        assert!(Formats::from_str("").is_err());
        assert!(Formats::from_str("pcd,none").is_err());
    }
}

//! Rules for the values of every section of a sensor file.

use super::Error;
use super::document::Chain;

/// A key without effect, the key of the setting that makes it so, and how.
pub(super) struct Idle {
    pub key: String,
    pub by: &'static str,
    pub why: &'static str,
}

impl Idle {
    /// All of `keys`, for the same reason.
    pub(super) fn all(keys: &[&str], by: &'static str, why: &'static str) -> Vec<Self> {
        keys.iter().map(|key| Self { key: (*key).to_owned(), by, why }).collect()
    }
}

/// Tests values, and tells where those that are wrong stand.
pub(super) struct Check<'a> {
    pub chain: &'a Chain,
}

impl Check<'_> {
    pub(super) fn refuse<T>(&self, path: &str, message: impl Into<String>) -> Result<T, Error> {
        Err(self.chain.error(path, message))
    }

    /// A number in [least, most]; NaN and infinities are refused by the same comparison.
    pub(super) fn within(
        &self,
        path: &str,
        value: f64,
        least: f64,
        most: f64,
    ) -> Result<f64, Error> {
        if value >= least && value <= most {
            return Ok(value);
        }
        self.refuse(path, format!("is {value}, but must lie between {least} and {most}"))
    }

    pub(super) fn count(
        &self,
        path: &str,
        value: u32,
        least: u32,
        most: u32,
    ) -> Result<u32, Error> {
        if (least..=most).contains(&value) {
            return Ok(value);
        }
        self.refuse(path, format!("is {value}, but must lie between {least} and {most}"))
    }

    /// A duration that must be a whole, positive number of femtoseconds.
    pub(super) fn whole_fs(&self, path: &str, picoseconds: f64) -> Result<i64, Error> {
        let ps = self.within(path, picoseconds, 1e-3, 1e9)?;
        let fs = (ps * 1e3).round();
        if (ps * 1e3 - fs).abs() > 1e-6 * fs {
            return self
                .refuse(path, format!("is {ps} ps, but must be a whole number of femtoseconds"));
        }
        Ok(fs as i64)
    }
}

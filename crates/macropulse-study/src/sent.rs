//! The macropulse that is sent to a pixel, mark by mark.

use macropulse::design::Design;
use macropulse::emit::{Shot, most_scans, shot_of_pixel};
use serde_json::{Value, json};

/// Why nothing is sent.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Error {
    /// The sensor has no such pixel.
    #[error(
        "pixel {row},{column}: {sensor} has rows 0 to {last_row} and columns 0 to {last_column}"
    )]
    Pixel {
        /// The row asked for.
        row: i64,
        /// The column asked for.
        column: i64,
        /// Name of the sensor.
        sensor: String,
        /// Its last row.
        last_row: u32,
        /// Its last column.
        last_column: u32,
    },
    /// The clock of the sensor does not count to such a scan.
    #[error("scan {scan}: scans of {sensor} are numbered 0 to {last}")]
    Scan {
        /// The scan asked for.
        scan: u64,
        /// Name of the sensor.
        sensor: String,
        /// Its last scan.
        last: u64,
    },
}

/// One shot with its pixel, written out.
#[derive(Debug, Clone)]
pub struct Macropulse<'a> {
    /// Row of the pixel, 0 at the top.
    pub row: u32,
    /// Column of the pixel, 0 at the left.
    pub column: u32,
    /// When it is sent, and which.
    pub shot: Shot,
    /// Bits in the order in which they are sent; `None` where a shot carries no label.
    pub payload: Option<String>,
    /// Lit chips, counted from 0.
    pub marks: &'a [u16],
    /// Chips in all.
    pub chips: u32,
}

impl<'a> Macropulse<'a> {
    /// Returns the macropulse that `design` sends to the pixel of this row and column in a scan.
    ///
    /// # Errors
    /// If it has no such pixel or scan.
    pub fn to(design: &'a Design, scan: u64, (row, column): (i64, i64)) -> Result<Self, Error> {
        let (last_row, last_column) = (design.scan.rows - 1, design.scan.columns - 1);
        let sensor = || design.name.clone();
        let within = |at: i64, last: u32| u32::try_from(at).ok().filter(|at| *at <= last);
        let (Some(row), Some(column)) = (within(row, last_row), within(column, last_column)) else {
            return Err(Error::Pixel { row, column, sensor: sensor(), last_row, last_column });
        };
        let shot = shot_of_pixel(design, scan, row, column).ok_or_else(|| {
            let last = most_scans(design).saturating_sub(1);
            Error::Scan { scan, sensor: sensor(), last }
        })?;
        let codebook = &design.emission.coding().codebook;
        Ok(Self {
            row,
            column,
            shot,
            payload: codebook.payload().map(|payload| payload.text(shot.label)),
            marks: codebook.marks(shot.label, shot.word),
            chips: codebook.chips(),
        })
    }

    /// The same for programs.
    pub fn json(&self) -> Value {
        json!({
            "row": self.row,
            "column": self.column,
            "label": self.shot.label,
            "payload": self.payload,
            "code_word": self.shot.word,
            "marks": self.marks,
            "chips": self.chips,
            "fired_at_fs": self.shot.fired_at_fs,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_macropulse_has_its_marks_and_a_pixel_that_is_not_there_none() {
        let design = Design::open("kim-park-2016", &[]).unwrap();
        let sent = Macropulse::to(&design, 2, (0, 1)).unwrap();
        let told = sent.json();
        assert_eq!(told["marks"].as_array().unwrap().len(), sent.marks.len());
        assert!(sent.marks.iter().all(|mark| u32::from(*mark) < sent.chips));
        assert_eq!(told["payload"].as_str().map(str::len), sent.payload.map(|bits| bits.len()));
        let told = |scan, pixel| Macropulse::to(&design, scan, pixel).unwrap_err().to_string();
        assert_eq!(
            told(0, (480, 3)),
            "pixel 480,3: kim-park-2016 has rows 0 to 479 and columns 0 to 847"
        );
        assert!(told(u64::MAX, (0, 0)).starts_with(&format!("scan {}: scans of", u64::MAX)));
    }
}

//! `macropulse encode`: what is sent to a pixel, chip by chip.

use clap::Args;
use clap_complete::engine::ArgValueCompleter;
use macropulse::design::Design;
use macropulse::emit::{Shot, most_scans, shot_of_pixel};
use serde_json::{Value, json};

use crate::fault::Fault;
use crate::options::Changes;
use crate::text::{Columns, grouped, print, print_json};
use crate::{completions, input};

/// Print the macropulse that is sent to a pixel, mark by mark
#[derive(Args)]
#[command(after_help = "Example:
  macropulse encode kim-park-2016 --pixel 0,1")]
pub struct Encode {
    /// Ready sensor or TOML file, - for standard input
    #[arg(value_name = "SENSOR", conflicts_with = "named", required_unless_present = "named")]
    #[arg(add = ArgValueCompleter::new(completions::sensors))]
    sensor: Option<String>,

    /// Another way to name the sensor
    #[arg(long = "sensor", value_name = "NAME-or-FILE")]
    named: Option<String>,

    #[command(flatten)]
    changes: Changes,

    /// Pixel, both counted from 0, row 0 at the top and column 0 at the left; repeatable
    #[arg(long = "pixel", value_name = "ROW,COLUMN", required = true, value_parser = pixel)]
    pixels: Vec<(u32, u32)>,

    /// Number of the scan, from 0
    #[arg(long, value_name = "N", default_value_t = 0)]
    scan: u64,

    /// Print as JSON: an object, or an array of them for several pixels
    #[arg(long)]
    json: bool,
}

fn pixel(typed: &str) -> Result<(u32, u32), String> {
    typed
        .split_once(',')
        .and_then(|(row, column)| Some((row.trim().parse().ok()?, column.trim().parse().ok()?)))
        .ok_or_else(|| "write it as row,column with both from 0, as in --pixel 0,1".to_owned())
}

pub fn run(options: &Encode) -> Result<(), Fault> {
    let sensor = options.sensor.as_ref().or(options.named.as_ref()).map_or("", String::as_str);
    let design = input::design(sensor, &options.changes.of_sensor()?)?;
    let macropulses: Vec<Macropulse> = options
        .pixels
        .iter()
        .map(|&pixel| Macropulse::to(&design, options.scan, pixel))
        .collect::<Result<_, _>>()?;
    if options.json {
        return print_json(macropulses.iter().map(Macropulse::json).collect());
    }
    let texts: Vec<String> = macropulses.iter().map(Macropulse::text).collect();
    print(&texts.join("\n"))
}

/// One shot with its pixel, written out.
struct Macropulse<'a> {
    row: u32,
    column: u32,
    shot: Shot,
    /// Bits in the order in which they are sent; `None` where a shot carries no label.
    payload: Option<String>,
    marks: &'a [u16],
    chips: u32,
    design: &'a Design,
}

impl<'a> Macropulse<'a> {
    fn to(design: &'a Design, scan: u64, (row, column): (u32, u32)) -> Result<Self, Fault> {
        let Some(shot) = shot_of_pixel(design, scan, row, column) else {
            let (rows, columns) = (design.scan.rows, design.scan.columns);
            return Err(Fault::Wrong(if row < rows && column < columns {
                let last = most_scans(design).saturating_sub(1);
                format!("--scan {scan}: scans of {} are numbered 0 to {last}", design.name)
            } else {
                format!(
                    "--pixel {row},{column}: {} has rows 0 to {} and columns 0 to {}",
                    design.name,
                    rows - 1,
                    columns - 1
                )
            }));
        };
        let codebook = &design.coding.codebook;
        Ok(Self {
            row,
            column,
            shot,
            payload: codebook.payload().map(|payload| payload.text(shot.label)),
            marks: codebook.marks(shot.label, shot.word),
            chips: codebook.chips(),
            design,
        })
    }

    fn json(&self) -> Value {
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

    fn text(&self) -> String {
        let mut columns = Columns::default();
        columns.push("pixel", format!("row {}, column {}", self.row, self.column));
        columns.push("fired at", format!("{} fs", grouped(self.shot.fired_at_fs.unsigned_abs())));
        match &self.payload {
            Some(payload) => {
                columns.push("label", self.shot.label.to_string());
                columns.push("payload", format!("{payload} ({} bits)", payload.len()));
                columns.push("code word", self.shot.word.to_string());
            }
            None => columns.push("payload", "none: this sensor sends one mark per shot"),
        }
        let chip_ps = self.design.coding.chip_fs as f64 * 1e-3;
        columns.push("chips", format!("{} of {chip_ps} ps", self.chips));
        let list: Vec<String> = self.marks.iter().map(u16::to_string).collect();
        columns.push("marks", format!("{} lit chips, counted from 0:", self.marks.len()));
        columns
            .push("", if list.is_empty() { "none: no light".to_owned() } else { list.join(" ") });
        columns.text()
    }
}

#[cfg(test)]
mod tests {
    use super::pixel;

    #[test]
    fn a_pixel_is_two_numbers() {
        assert_eq!(pixel("3, 4"), Ok((3, 4)));
        for wrong in ["3", "3,", "3;4", "-1,2", "1,2,3", "a,b"] {
            assert!(pixel(wrong).is_err(), "{wrong}");
        }
    }
}

//! `macropulse encode`: what is sent to a pixel, chip by chip; and the shot log of a whole scan, with
//! the ticks of an ideal echo.

mod scan;

use std::ffi::{OsStr, OsString};
use std::path::{Path, PathBuf};

use clap::Args;
use clap_complete::engine::ArgValueCompleter;
use macropulse::codec::RecordKind;
use macropulse::codec::files::Form;
use macropulse::design::Design;
use macropulse_study::sent::Macropulse;

use crate::fault::Fault;
use crate::input::STREAM;
use crate::options::{Changes, Common};
use crate::simulate::recorded::{Kept, Recorded};
use crate::text::{Columns, grouped, print, print_json};
use crate::{completions, input};

/// Print the macropulse that is sent to a pixel, mark by mark, or write the shot log of a scan
///
/// Without --pixel the shot log of the scan is written, as `decode` reads it. With --wall-m the ticks of a
/// white wall at that range from every pixel are written too. They are those of an ideal detector and
/// unlimited converters: a test vector for a decoder in hardware.
#[derive(Args)]
#[command(after_help = "Examples:
  macropulse encode kim-park-2016 --pixel 0,1
  macropulse encode kim-park-2016 --scan 3 -o out
  macropulse encode kim-park-2016-fixed --wall-m 30 --format ticks-csv -o out")]
pub struct Encode {
    /// Ready sensor or TOML file, - for standard input
    #[arg(value_name = "SENSOR", conflicts_with = "named", required_unless_present = "named")]
    #[arg(add = ArgValueCompleter::new(completions::sensors))]
    sensor: Option<OsString>,

    /// Another way to name the sensor
    #[arg(long = "sensor", value_name = "NAME-or-FILE")]
    named: Option<OsString>,

    #[command(flatten)]
    changes: Changes,

    /// Pixel, both counted from 0, row 0 at the top and column 0 at the left; repeatable
    #[arg(long = "pixel", value_name = "ROW,COLUMN", value_parser = pixel)]
    #[arg(allow_hyphen_values = true)]
    pixels: Vec<(u32, u32)>,

    /// Number of the scan, from 0
    #[arg(long, value_name = "N", default_value_t = 0)]
    scan: u64,

    /// Folder for the shot log of the scan, made if need be; - writes the log to stdout
    #[arg(short, long, value_name = "DIR", conflicts_with = "pixels")]
    #[arg(required_unless_present = "pixels")]
    output: Option<PathBuf>,

    /// Form of the shot log: ticks for binary, ticks-csv for text [default: ticks]
    #[arg(long, value_name = "FORM", requires = "output", value_parser = scan::form)]
    format: Option<Form>,

    /// Write also the ticks of an echo of every shot from this range, m, as of an ideal detector
    #[arg(long, value_name = "M", requires = "output")]
    wall_m: Option<f64>,

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

pub fn run(options: &Encode, common: &Common) -> Result<(), Fault> {
    let sensor = options
        .sensor
        .as_ref()
        .or(options.named.as_ref())
        .map_or(OsStr::new(""), OsString::as_os_str);
    let design = input::design(sensor, &options.changes.of_sensor()?)?;
    if let Some(output) = &options.output {
        let form = options.format.unwrap_or(Form::Binary);
        let recorded = Recorded {
            design: &design,
            number: options.scan,
            kept: Kept { kind: RecordKind::Ticks, form },
        };
        let is_told = !common.quiet || options.json;
        if output == Path::new(STREAM) {
            return match options.wall_m.is_some() || options.json {
                true => Err(Fault::Wrong(
                    "-o - writes the shot log to standard output: --wall-m and --json have no place \
                     there; write to a folder with -o DIR"
                        .to_owned(),
                )),
                false => scan::stream(recorded),
            };
        }
        let told = scan::write(recorded, output, (options.wall_m, options.json))?;
        return if is_told { print(&told) } else { Ok(()) };
    }
    let macropulses: Vec<Macropulse> = options
        .pixels
        .iter()
        .map(|&(row, column)| Macropulse::to(&design, options.scan, (row.into(), column.into())))
        .collect::<Result<_, _>>()
        // The error begins with the name of what was typed: that of its option.
        .map_err(|error| Fault::Wrong(format!("--{error}")))?;
    if options.json {
        return print_json(macropulses.iter().map(Macropulse::json).collect());
    }
    let texts: Vec<String> = macropulses.iter().map(|one| text(one, &design)).collect();
    print(&texts.join("\n"))
}

/// A macropulse for people.
fn text(macropulse: &Macropulse, design: &Design) -> String {
    let mut columns = Columns::default();
    columns.push("pixel", format!("row {}, column {}", macropulse.row, macropulse.column));
    columns.push("fired at", format!("{} fs", grouped(macropulse.shot.fired_at_fs.unsigned_abs())));
    match &macropulse.payload {
        Some(payload) => {
            columns.push("label", macropulse.shot.label.to_string());
            columns.push("payload", format!("{payload} ({} bits)", payload.len()));
            columns.push("code word", macropulse.shot.word.to_string());
        }
        None if design.is_coded() => {
            columns.push("payload", "none: a macropulse is a bare code word");
            columns.push("code word", macropulse.shot.word.to_string());
        }
        None => columns.push("payload", "none: this sensor sends one mark per shot"),
    }
    let chip_ps = design.emission.coding().chip_fs as f64 * 1e-3;
    columns.push("chips", format!("{} of {chip_ps} ps", macropulse.chips));
    let list: Vec<String> = macropulse.marks.iter().map(u16::to_string).collect();
    columns.push("marks", format!("{} lit chips, counted from 0:", macropulse.marks.len()));
    columns.push("", if list.is_empty() { "none: no light".to_owned() } else { list.join(" ") });
    columns.text()
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

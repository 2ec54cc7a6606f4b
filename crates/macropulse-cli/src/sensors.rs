//! `macropulse sensors`: the sensors that come with the program.

use clap::Args;
use clap_complete::engine::ArgValueCompleter;
use macropulse::design::{Design, preset_names, preset_text};
use serde_json::json;

use crate::completions;
use crate::fault::Fault;
use crate::input;
use crate::text::{Columns, print, print_json, to_start_from, values};

/// List the ready sensors, or print one as TOML to start from
#[derive(Args)]
#[command(after_help = "Example:
  macropulse sensors kim-park-2016 > mine.toml")]
pub struct Sensors {
    /// Sensor to print; of a file, everything it leaves unsaid is printed too
    #[arg(value_name = "NAME", add = ArgValueCompleter::new(completions::sensors))]
    name: Option<String>,

    /// Print as JSON
    #[arg(long)]
    json: bool,
}

pub fn run(options: &Sensors) -> Result<(), Fault> {
    match &options.name {
        Some(name) => one(name, options.json),
        None => all(options.json),
    }
}

fn one(name: &str, as_json: bool) -> Result<(), Fault> {
    let design = input::design(name.as_ref(), &[])?;
    let toml = preset_text(name).map_or(design.text.as_str(), to_start_from);
    if as_json {
        let (name, summary) = (&design.name, &design.summary);
        let sensor =
            json!({ "name": name, "summary": summary, "toml": toml, "values": values(toml) });
        return print_json(vec![sensor]);
    }
    print(toml)
}

fn all(as_json: bool) -> Result<(), Fault> {
    let mut columns = Columns::default();
    let mut list = Vec::new();
    for name in preset_names() {
        let summary = Design::open(name, &[])?.summary;
        list.push(json!({ "name": name, "summary": summary }));
        columns.push(name, summary);
    }
    if as_json {
        return print_json(vec![json!({ "sensors": list })]);
    }
    print(&columns.text())
}

//! `macropulse schema`: what editors complete and check typed files by.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use macropulse::{design, environment, scene};
use macropulse_study::designs;

use crate::fault::Fault;
use crate::input::STREAM;
use crate::text::print;

/// Print the JSON Schema of a kind of file, by which editors complete and check what is typed
///
/// An editor that knows TOML with schemas, as Even Better TOML in VS Code or any other with Taplo
/// does, reads it from the first line of a file: `#:schema sensor.json`.
#[derive(Args)]
#[command(after_help = "Example:
  macropulse schema sensor -o sensor.json")]
pub struct Schema {
    /// Kind of file
    kind: Kind,

    /// File to write; without it the schema is printed
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
}

/// Kind of a schema, as people type it.
#[derive(Clone, Copy, ValueEnum)]
enum Kind {
    /// A sensor
    Sensor,
    /// A scene
    Scene,
    /// Sun and air, a table of a scene
    Environment,
    /// Requirements of a lidar, for `design`
    Requirements,
}

pub fn run(options: &Schema) -> Result<(), Fault> {
    let schema = match options.kind {
        Kind::Sensor => design::schema(),
        Kind::Scene => scene::schema(),
        Kind::Environment => environment::schema(),
        Kind::Requirements => designs::schema(),
    };
    let text = format!("{schema:#}\n");
    match &options.output {
        None => print(&text),
        Some(path) if path == Path::new(STREAM) => print(&text),
        Some(path) => {
            Ok(macropulse::formats::write_named(path, |out| out.write_all(text.as_bytes()))?)
        }
    }
}

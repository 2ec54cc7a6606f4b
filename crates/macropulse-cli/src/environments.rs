//! `macropulse environments`: sun and air that come with the program.

use clap::Args;
use clap_complete::engine::ArgValueCompleter;
use macropulse::environment::{self, Environment};
use serde_json::json;

use crate::completions;
use crate::fault::Fault;
use crate::scenes::summary;
use crate::text::{Columns, print, print_json, to_start_from, values};

/// List the ready environments, sun and air of a scene, or print one as TOML to start from
#[derive(Args)]
#[command(after_help = "A scene names one, or writes a table of its own over one:
  environment = \"night\"

  [environment]
  base = \"clear-day\"
  visibility_km = 2.0

Example:
  macropulse environments fog-50m")]
pub struct Environments {
    /// Environment to print
    #[arg(value_name = "NAME", add = ArgValueCompleter::new(completions::environments))]
    name: Option<String>,

    /// Print as JSON
    #[arg(long)]
    json: bool,
}

pub fn run(options: &Environments) -> Result<(), Fault> {
    match &options.name {
        Some(name) => one(name, options.json),
        None => all(options.json),
    }
}

fn one(name: &str, as_json: bool) -> Result<(), Fault> {
    let environment = Environment::named(name)?;
    let toml = to_start_from(environment::text(name).unwrap_or_default());
    if as_json {
        let environment = json!({
            "name": name,
            "summary": summary(toml),
            "conditions": environment.conditions(),
            "toml": toml,
            "values": values(toml),
        });
        return print_json(vec![environment]);
    }
    print(toml)
}

fn all(as_json: bool) -> Result<(), Fault> {
    let mut columns = Columns::default();
    let mut list = Vec::new();
    for name in environment::names() {
        let summary = summary(environment::text(name).unwrap_or_default());
        let conditions = Environment::named(name)?.conditions();
        list.push(json!({ "name": name, "summary": summary, "conditions": conditions }));
        columns.push(name, format!("{summary}: {conditions}"));
    }
    if as_json {
        return print_json(vec![json!({ "environments": list })]);
    }
    print(&columns.text())
}

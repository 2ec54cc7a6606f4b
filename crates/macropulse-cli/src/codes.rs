//! `macropulse codes`: code families beside each other.

mod pictures;

use std::path::PathBuf;

use clap::Args;
use macropulse::design::family_from_toml;
use macropulse::predict::comparison::Comparison;
use macropulse::predict::multiple_access::{bit_error_hard, bit_error_soft};
use macropulse_study::codes::{USERS, told};
use serde_json::json;

use crate::fault::Fault;
use crate::folder::{Folder, Outputs};
use crate::options::Common;
use crate::text::{print, print_json};

/// Compare code families: how alike their words are, and what that costs when many send at once
#[derive(Args)]
#[command(after_help = "Examples:
  macropulse codes
  macropulse codes prime=29 gold=7 'sparse={length=10933, weight=32, words=4096, seed=1}' -o codes")]
pub struct Codes {
    /// Families as behind code.family in a sensor file; a list to start with if none is named
    #[arg(value_name = "FAMILY")]
    families: Vec<String>,

    /// Folder for pictures: the correlation of every pair of words, and error against users
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,

    /// Print as JSON
    #[arg(long)]
    json: bool,
}

/// Families compared if none is named: words of about the length of the paper's, and dense ones.
const DEFAULTS: [&str; 8] = [
    "prime=29",
    "extended-prime=29",
    "quadratic-congruence=29",
    "extended-quadratic-congruence=29",
    "orthogonal={length=841, weight=5}",
    "sparse={length=841, weight=29, words=64, seed=1}",
    "m-sequence=7",
    "gold=7",
];

pub fn run(options: &Codes, common: &Common) -> Result<(), Fault> {
    let texts: Vec<&str> = match options.families.is_empty() {
        true => DEFAULTS.to_vec(),
        false => options.families.iter().map(String::as_str).collect(),
    };
    // All of them are read before the first is compared.
    let families = texts.iter().map(|text| family_from_toml(text));
    let families = families.collect::<Result<Vec<_>, _>>()?;
    let names: Vec<String> = families.iter().map(|family| family.to_string()).collect();
    let outputs = || Outputs::named(pictures::files(names.iter().map(String::as_str)));
    let folder = options.output.as_deref().map(|path| Folder::claim(path, outputs()));
    let mut folder = folder.transpose()?;
    let compared: Vec<Comparison> = families.into_iter().map(Comparison::of).collect();
    if let Some(folder) = &mut folder {
        folder.make()?;
        pictures::write(&compared, &table(&compared), folder.path())?;
        folder.keep();
    }
    if options.json {
        return print_json(vec![
            json!({ "families": compared.iter().map(told).collect::<Vec<_>>() }),
        ]);
    }
    if !common.quiet {
        print(&table(&compared))?;
        if let Some(folder) = &folder {
            print(&format!("\nopen {}\n", folder.path().join("index.html").display()))?;
        }
    }
    Ok(())
}

fn table(compared: &[Comparison]) -> String {
    let mut header: Vec<String> =
        ["family", "chips", "marks", "words", "sidelobe", "cross", "variance", "harmless"]
            .map(str::to_owned)
            .to_vec();
    header.extend(USERS.iter().map(|users| format!("error at {users}")));
    let rows: Vec<Vec<String>> = compared.iter().map(row).collect();
    let widths: Vec<usize> = (0..header.len())
        .map(|at| {
            let cells = rows.iter().chain([&header]).map(|row| row[at].chars().count());
            cells.max().unwrap_or(0)
        })
        .collect();
    let mut text = String::new();
    for row in [header].iter().chain(&rows) {
        let cells = row.iter().zip(&widths).enumerate().map(|(at, (cell, &width))| match at {
            0 => format!("{cell:<width$}"),
            _ => format!("{cell:>width$}"),
        });
        text += cells.collect::<Vec<_>>().join("  ").trim_end();
        text.push('\n');
    }
    let few = compared.iter().filter(|of| of.compared < of.family.count());
    for of in few {
        text += &format!("\n{}: the first {} words compared\n", of.family, of.compared);
    }
    text + "
sidelobe  highest autocorrelation off the peak, of a word repeated / on its own
cross     highest cross-correlation of two words, repeated / on their own
variance  of the cross-correlation, over all pairs and shifts
harmless  other users who can cause no error, whatever they send
error     per bit among so many users, each counted mark by mark / limited to one mark per chip
"
}

/// A probability with two digits.
fn error(probability: f64) -> String {
    if probability == 0.0 { "0".to_owned() } else { format!("{probability:.1e}") }
}

fn row(of: &Comparison) -> Vec<String> {
    let (fewest, most) = of.marks;
    let alone = of.compared < 2;
    let none = || "-".to_owned();
    let mut cells = vec![
        of.family.to_string(),
        of.family.length().to_string(),
        if fewest == most { most.to_string() } else { format!("{fewest} to {most}") },
        of.family.count().to_string(),
        format!("{} / {}", of.sidelobes.0, of.sidelobes.1),
        if alone { none() } else { format!("{} / {}", of.crosses.0, of.crosses.1) },
        if alone { none() } else { format!("{:.3}", of.spread.1) },
        of.harmless_interferers().map_or_else(none, |others| others.to_string()),
    ];
    cells.extend(USERS.iter().map(|&users| match of.users(users) {
        Some(access) => {
            let [soft, hard] = [bit_error_soft(&access), bit_error_hard(&access)].map(error);
            format!("{soft} / {hard}")
        }
        None => none(),
    }));
    cells
}

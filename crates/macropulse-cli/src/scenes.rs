//! `macropulse scenes`: the scenes that come with the program.

use clap::Args;
use clap_complete::engine::ArgValueCompleter;
use macropulse::design::preset_text;
use macropulse::names::nearest;
use macropulse::scene::{Material, Scene, library};
use serde_json::json;

use crate::completions;
use crate::fault::Fault;
use crate::text::{Columns, first_sentence, print, print_json, to_start_from, values};

/// List the ready scenes, or print one as TOML to start from
#[derive(Args)]
#[command(after_help = "Example:
  macropulse scenes street > mine.toml
  macropulse scenes --materials=905,1550")]
pub struct Scenes {
    /// Scene to print
    #[arg(value_name = "NAME", add = ArgValueCompleter::new(completions::scenes))]
    name: Option<String>,

    /// Print the diffuse reflectance of all materials at these wavelengths instead, in nm
    #[arg(
        long,
        value_name = "NM,…",
        value_delimiter = ',',
        num_args = 0..=1,
        default_missing_value = "850,905,940,1064,1550",
        require_equals = true,
        conflicts_with = "name",
        value_parser = wavelength
    )]
    materials: Option<Vec<f64>>,

    /// Print as JSON
    #[arg(long)]
    json: bool,
}

pub fn run(options: &Scenes) -> Result<(), Fault> {
    match (&options.name, &options.materials) {
        (Some(name), _) => one(name, options.json),
        (None, Some(wavelengths)) => materials(wavelengths, options.json),
        (None, None) => all(options.json),
    }
}

fn one(name: &str, as_json: bool) -> Result<(), Fault> {
    let Some(toml) = Scene::builtin(name).map(to_start_from) else {
        if preset_text(name).is_some() {
            let remedy = format!("`macropulse sensors {name}` prints it");
            return Err(Fault::Wrong(format!("{name}: is a sensor, not a scene; {remedy}")));
        }
        let hint = nearest(name, Scene::builtin_names())
            .map(|near| format!("did you mean `{near}`? "))
            .unwrap_or_default();
        let known: Vec<&str> = Scene::builtin_names().collect();
        return Err(Fault::Wrong(format!(
            "{name}: no such ready scene; {hint}ready ones: {}",
            known.join(", ")
        )));
    };
    if as_json {
        let scene =
            json!({ "name": name, "summary": summary(toml), "toml": toml, "values": values(toml) });
        return print_json(vec![scene]);
    }
    print(toml)
}

fn all(as_json: bool) -> Result<(), Fault> {
    let scenes = || {
        Scene::builtin_names().map(|name| (name, summary(Scene::builtin(name).unwrap_or_default())))
    };
    if as_json {
        let list: Vec<_> =
            scenes().map(|(name, summary)| json!({ "name": name, "summary": summary })).collect();
        return print_json(vec![json!({ "scenes": list })]);
    }
    let mut columns = Columns::default();
    scenes().for_each(|(name, summary)| columns.push(name, summary));
    print(&columns.text())
}

/// A wavelength of light, nm.
fn wavelength(typed: &str) -> Result<f64, String> {
    match typed.parse() {
        Ok(nm) if (100.0..=20_000.0).contains(&nm) => Ok(nm),
        _ => Err("a wavelength is a number of nanometres, from 100 to 20000".to_owned()),
    }
}

/// The library, a line for each material.
fn materials(wavelengths: &[f64], as_json: bool) -> Result<(), Fault> {
    let diffuse = |material: &Material| -> Vec<f64> {
        wavelengths.iter().map(|nm| material.diffuse.at(nm * 1e-9)).collect()
    };
    if as_json {
        let list: Vec<_> = library()
            .map(|material| {
                json!({
                    "name": material.name,
                    "diffuse": diffuse(&material),
                    "specular": material.specular,
                    "gloss": material.gloss,
                    "retro": material.retro,
                    "transmission": material.transmission,
                })
            })
            .collect();
        return print_json(vec![json!({ "wavelengths_nm": wavelengths, "materials": list })]);
    }
    let columns = |values: &mut dyn Iterator<Item = String>| -> String {
        values.map(|value| format!("{value:>9}")).collect()
    };
    let mut text = Columns::default();
    text.push("", columns(&mut wavelengths.iter().map(|nm| format!("{nm} nm"))));
    for material in library() {
        let mut values = columns(&mut diffuse(&material).iter().map(|value| format!("{value:.3}")));
        if material.retro > 0.0 {
            values += &format!("  and {:.0} × white, back to the source", material.retro);
        }
        text.push(&material.name, values);
    }
    print(&text.text())
}

/// The file of a scene or an environment begins with a comment; its first sentence says what it is.
pub fn summary(toml: &str) -> String {
    let comment: Vec<&str> = to_start_from(toml)
        .lines()
        .map_while(|line| line.strip_prefix('#'))
        .map(str::trim)
        .collect();
    first_sentence(&comment.join(" ")).to_owned()
}

#[cfg(test)]
mod tests {
    use super::summary;

    #[test]
    fn the_summary_is_the_first_sentence_of_the_comment() {
        assert_eq!(
            summary("# A wall,\n# 50 m ahead. White.\n#\n# More.\na = 1\n"),
            "A wall, 50 m ahead"
        );
        assert_eq!(summary("version = 1\n"), "");
    }
}

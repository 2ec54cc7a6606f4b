//! Sensors and scenes by their names: ready ones, files, and `-` for what stands on standard input.

use std::ffi::OsStr;
use std::io::Read;
use std::path::Path;
use std::sync::OnceLock;

use macropulse::design::{Design, preset_text};
use macropulse::opened::{self, LONGEST_TEXT};
use macropulse::scene::{Room, Scene};

use crate::fault::Fault;

/// Name of standard input and output on the command line.
pub const STREAM: &str = "-";

/// Name of standard input in messages.
const ORIGIN: &str = "standard input";

/// The sensor called `name`, with single values changed.
///
/// # Errors
/// If something is wrong with the name, the text or a change.
pub fn design(name: &OsStr, changes: &[(String, String)]) -> Result<Design, Fault> {
    match name.to_str() {
        Some(STREAM) => Ok(Design::from_toml(stdin()?, ORIGIN, Path::new(""), changes)?),
        Some(scene) if Scene::builtin(scene).is_some() => Err(Fault::Wrong(format!(
            "{scene}: is a scene, where a sensor is wanted; `macropulse sensors` lists the ready ones"
        ))),
        _ => Ok(Design::open(name, changes)?),
    }
}

/// The scene called `name`, with single values changed, if there is `room` for its meshes.
///
/// # Errors
/// If something is wrong with the name, the text or a change.
pub fn scene(name: &OsStr, changes: &[(String, String)], room: Room) -> Result<Scene, Fault> {
    match name.to_str() {
        Some(STREAM) => {
            Ok(Scene::from_toml_within(stdin()?, ORIGIN, Path::new(""), changes, room)?)
        }
        Some(sensor) if preset_text(sensor).is_some() => Err(Fault::Wrong(format!(
            "{sensor}: is a sensor, where a scene is wanted; `macropulse scenes` lists the ready ones"
        ))),
        _ => Ok(Scene::open_within(name, changes, room)?),
    }
}

/// The text called `name`, and what it is called in messages.
///
/// # Errors
/// If it cannot be read.
pub fn text(name: &OsStr) -> Result<(String, String), Fault> {
    if name == STREAM {
        return Ok((stdin()?.to_owned(), ORIGIN.to_owned()));
    }
    let called = name.display().to_string();
    match opened::text(Path::new(name)) {
        Ok(text) => Ok((text, called)),
        Err(error) => Err(Fault::unreadable(&called, &error)),
    }
}

/// Returns the text of standard input: read once, for all that ask for it.
fn stdin() -> Result<&'static str, Fault> {
    static TEXT: OnceLock<Result<String, String>> = OnceLock::new();
    let read = TEXT.get_or_init(|| {
        let mut bytes = Vec::new();
        let mut input = std::io::stdin().lock().take(LONGEST_TEXT + 1);
        input.read_to_end(&mut bytes).map_err(|error| format!("cannot be read: {error}"))?;
        if bytes.len() as u64 > LONGEST_TEXT {
            return Err(format!("is longer than the {} MiB of a text", LONGEST_TEXT >> 20));
        }
        let text = String::from_utf8(bytes).map_err(|_| "is not text".to_owned())?;
        opened::check_values(&text)?;
        Ok(text)
    });
    read.as_deref().map_err(|why| Fault::Wrong(format!("{ORIGIN}: {why}")))
}

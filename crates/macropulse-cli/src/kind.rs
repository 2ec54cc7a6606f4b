//! Kinds of files, told by their content and not by their name.

use std::ffi::OsStr;
use std::path::Path;

use macropulse::design::{preset_names, preset_text};
use macropulse::names::nearest;
use macropulse::scene::Scene;
use macropulse::told;
use toml::{Table, Value};

use crate::fault::Fault;
use crate::input::{self, STREAM};

/// Kind of a file that can be checked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    Sensor,
    Scene,
    Scenario,
}

/// Keys only a sensor file has.
const OF_SENSORS: [&str; 8] =
    ["extends", "scan", "light", "code", "detector", "tdc", "receiver", "idealised"];

/// Keys only a scene file has.
const OF_SCENES: [&str; 5] = ["object", "ground", "material", "interferers", "environment"];

/// Keys only a scenario has.
const OF_SCENARIOS: [&str; 4] = ["scene", "scans", "seed", "formats"];

impl Kind {
    /// Returns the kind of the ready sensor or scene, or of the file, called `name`.
    pub fn of(name: &OsStr) -> Result<Self, Fault> {
        if name.to_str().and_then(preset_text).is_some() {
            return Ok(Self::Sensor);
        }
        if name.to_str().and_then(Scene::builtin).is_some() {
            return Ok(Self::Scene);
        }
        let path = Path::new(name);
        if name != STREAM
            && !path.exists()
            && path.extension().is_none()
            && path.components().count() == 1
        {
            return Err(Fault::Wrong(unknown(&name.to_string_lossy())));
        }
        let (text, name) = input::text(name)?;
        match text.parse::<Table>() {
            Ok(table) => Self::of_table(&table).ok_or_else(|| {
                Fault::Wrong(format!(
                    "{name}: is neither a sensor ([scan], extends …), nor a scene ([[object]], \
                     ground …), nor a scenario (sensor = \"…\", scene = \"…\"); start from \
                     `macropulse sensors NAME` or `macropulse scenes NAME`"
                ))
            }),
            Err(error) => Err(Fault::Wrong(not_toml(&name, &text, &error))),
        }
    }

    fn of_table(table: &Table) -> Option<Self> {
        let has = |keys: &[&str]| keys.iter().any(|key| table.contains_key(*key));
        let is_like =
            |keys: &[&str]| table.keys().any(|key| nearest(key, keys.iter().copied()).is_some());
        match table.get("sensor") {
            // A scenario has none of these; a scene says where the sensor stands.
            _ if has(&["object", "ground", "material"]) => Some(Self::Scene),
            // A scenario names its sensor.
            Some(Value::String(_)) => Some(Self::Scenario),
            _ if table.contains_key("sensors") => Some(Self::Scenario),
            _ if has(&OF_SENSORS) => Some(Self::Sensor),
            _ if has(&OF_SCENES) => Some(Self::Scene),
            _ if has(&OF_SCENARIOS) => Some(Self::Scenario),
            Some(Value::Table(_)) => Some(Self::Scene),
            // A slip of the pen is told as one.
            _ if is_like(&OF_SENSORS) => Some(Self::Sensor),
            _ if is_like(&OF_SCENES) => Some(Self::Scene),
            _ => None,
        }
    }
}

/// Refuses a scene and a sensor that are named the wrong way round for `command`.
pub fn in_order(command: &str, sensor: &OsStr, scene: &OsStr) -> Result<(), Fault> {
    let is = |name: &OsStr, kind: Kind| Kind::of(name).is_ok_and(|found| found == kind);
    if !(is(scene, Kind::Sensor) && is(sensor, Kind::Scene)) {
        return Ok(());
    }
    let (sensor, scene) = (sensor.display(), scene.display());
    Err(Fault::Wrong(format!(
        "{sensor}: is a scene, and {scene} a sensor; the sensor comes first, as in \
         `macropulse {command} {scene} {sensor}`"
    )))
}

fn unknown(name: &str) -> String {
    let known = || preset_names().chain(Scene::builtin_names());
    let hint =
        nearest(name, known()).map(|near| format!("did you mean `{near}`? ")).unwrap_or_default();
    let known: Vec<&str> = known().collect();
    format!("{name}: no such sensor, scene or file; {hint}ready ones: {}", known.join(", "))
}

fn not_toml(name: &str, text: &str, error: &toml::de::Error) -> String {
    let before = error.span().and_then(|span| text.get(..span.start)).unwrap_or_default();
    let line = before.matches('\n').count() + 1;
    let column = before.chars().rev().take_while(|c| *c != '\n').count() + 1;
    format!("{name}:{line}:{column}: {}", told::syntax(text, error))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kind(text: &str) -> Option<Kind> {
        Kind::of_table(&text.parse().unwrap())
    }

    #[test]
    fn the_content_tells_what_it_is() {
        for name in preset_names() {
            assert_eq!(kind(preset_text(name).unwrap()), Some(Kind::Sensor), "{name}");
        }
        for name in Scene::builtin_names() {
            assert_eq!(kind(Scene::builtin(name).unwrap()), Some(Kind::Scene), "{name}");
        }
        assert_eq!(kind("sensor = \"a\"\nscene = \"b\""), Some(Kind::Scenario));
        // A slip of the pen makes no sensor of it.
        assert_eq!(kind("sensors = []\nscan = 3"), Some(Kind::Scenario));
        assert_eq!(kind("[sensor]\nyaw_deg = 3"), Some(Kind::Scene));
        assert_eq!(kind("sensor = \"a\"\n[[object]]"), Some(Kind::Scene));
        assert_eq!(kind("[[objects]]"), Some(Kind::Scene));
        assert_eq!(kind("version = 1"), None);
    }

    #[test]
    fn a_name_is_looked_for_among_sensors_and_scenes() {
        assert!(unknown("car-3m").contains("did you mean `car-30m`?"));
        assert!(unknown("hdl64e").contains("did you mean `hdl-64e`?"));
    }
}

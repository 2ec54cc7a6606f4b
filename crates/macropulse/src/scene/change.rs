//! A scene with some of its values changed.

use std::path::Path;

use toml::{Table, Value};

use super::file::object_names;
use super::{Error, Room, Scene, text_of};
use crate::environment;
use crate::names::{nearest, toml_value};

/// Names of the three numbers of a position or size.
const COORDINATES: [&str; 3] = ["x", "y", "z"];

impl Scene {
    /// As [`Scene::open`], with `changes` of single values: dotted keys, each with its new value
    /// as TOML. An object is called by its name, a coordinate x, y or z: the wall of the ready
    /// scene of that name is moved by `object.wall.position_m.x`.
    ///
    /// # Errors
    /// As [`Scene::open`]; and if a key leads nowhere, or the scene refuses the value.
    pub fn open_changed(
        name_or_file: impl AsRef<Path>,
        changes: &[(String, String)],
    ) -> Result<Self, Error> {
        Self::open_within(name_or_file, changes, Room::default())
    }

    /// As [`Scene::open_changed`], if there is `room` for its meshes.
    ///
    /// # Errors
    /// As [`Scene::open_changed`], and if there is not.
    pub fn open_within(
        name_or_file: impl AsRef<Path>,
        changes: &[(String, String)],
        room: Room,
    ) -> Result<Self, Error> {
        let path = name_or_file.as_ref();
        if changes.is_empty() {
            return Self::open_in(path, room);
        }
        let builtin = path.to_str().and_then(Self::builtin);
        // A name that is no scene at all gets the same error as without changes. A pipe cannot be looked at
        // twice.
        if builtin.is_none() && (!path.exists() || path.is_dir()) {
            return Self::open(path);
        }
        let (text, base) = match builtin {
            Some(text) => (text.to_owned(), Path::new("")),
            None => text_of(path)?,
        };
        Self::from_toml_within(&text, &path.display().to_string(), base, changes, room)
    }

    /// As [`Scene::from_toml`], with `changes` of single values as [`Scene::open_changed`] takes them,
    /// if there is `room` for its meshes.
    ///
    /// # Errors
    /// As [`Scene::open_within`].
    pub fn from_toml_within(
        text: &str,
        origin: &str,
        base: &Path,
        changes: &[(String, String)],
        room: Room,
    ) -> Result<Self, Error> {
        // A fault without the changes is reported with its place in the file.
        match Self::from_toml_in(text, origin, base, room) {
            Ok(scene) if changes.is_empty() => return Ok(scene),
            // A change may allow it.
            Err(Error::Outside { .. }) if !changes.is_empty() => {}
            Ok(_) => {}
            Err(error) => return Err(error),
        }
        let keys = || changes.iter().map(|(key, _)| key.as_str()).collect::<Vec<_>>().join(", ");
        let refused = |message: String| {
            let told = |key: &str| message.strip_prefix(key)?.strip_prefix(": ");
            let named = changes.iter().find_map(|(key, _)| Some((key, told(key)?)));
            match named {
                Some((key, rest)) => Error::Changed { key: key.clone(), message: rest.to_owned() },
                None => Error::Changed { key: keys(), message },
            }
        };
        let mut table: Table =
            text.parse().map_err(|error: toml::de::Error| refused(error.message().to_owned()))?;
        for (key, value) in changes {
            change(&mut table, key, value).map_err(|message| {
                let rest = message.strip_prefix(&format!("{key}: ")).map(str::to_owned);
                Error::Changed { key: key.clone(), message: rest.unwrap_or(message) }
            })?;
        }
        let text = toml::to_string(&table).map_err(|error| refused(error.to_string()))?;
        Self::from_toml_in(&text, origin, base, room).map_err(|error| match error {
            // Its place would be in a text that is not that of the file.
            Error::Typed { message, .. } => refused(message),
            error => error,
        })
    }
}

/// Keys of the scene stand behind this among those of a sensor.
pub const OF_SCENE: &str = "scene:";

/// The table of sun and air.
const ENVIRONMENT: &str = "environment";

/// Splits `changes` into those of a scene and those of a sensor. Keys behind `scene:` and keys of the
/// environment belong to the scene.
pub fn apart(changes: &[(String, String)]) -> Changes {
    let mut apart = Changes::default();
    for (key, value) in changes {
        let of_scene = key.strip_prefix(OF_SCENE).or_else(|| key_of(key).map(|_| key.as_str()));
        match of_scene {
            Some(key) => apart.of_scene.push((key.to_owned(), value.clone())),
            None => apart.of_sensor.push((key.clone(), value.clone())),
        }
    }
    apart
}

/// Changes of a scene apart from those of a sensor: dotted keys and values.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Changes {
    /// For [`Scene::open_changed`].
    pub of_scene: Vec<(String, String)>,
    /// For [`Design::open`](crate::design::Design::open).
    pub of_sensor: Vec<(String, String)>,
}

/// The key within the environment, empty for the whole of it; `None` for other keys.
fn key_of(key: &str) -> Option<&str> {
    let rest = key.strip_prefix(ENVIRONMENT)?;
    if rest.is_empty() { Some(rest) } else { rest.strip_prefix('.') }
}

fn change(table: &mut Table, key: &str, typed: &str) -> Result<(), String> {
    let value = toml_value(typed);
    if let Some(key) = key_of(key) {
        let now = environment::change(table.remove(ENVIRONMENT), key, value);
        let now = now.map_err(|error| error.to_string())?;
        table.insert(ENVIRONMENT.to_owned(), now);
        return Ok(());
    }
    let (above, last) = key.rsplit_once('.').unwrap_or(("", key));
    let mut at = None;
    for step in above.split('.').filter(|step| !step.is_empty()) {
        at = Some(match at {
            None => entry(table, step)?,
            Some(value) => below(value, step)?,
        });
    }
    match at {
        None => drop(table.insert(last.to_owned(), value)),
        Some(Value::Table(inner)) => drop(inner.insert(last.to_owned(), value)),
        Some(list) => *below(list, last)? = value,
    }
    Ok(())
}

/// Returns the value that `step` leads to from `value`.
fn below<'a>(value: &'a mut Value, step: &str) -> Result<&'a mut Value, String> {
    match value {
        Value::Table(inner) => entry(inner, step),
        Value::Array(list) => {
            let names: Vec<String> = match list.first().is_some_and(Value::is_table) {
                true => object_names(&list.iter().map(name).collect::<Vec<_>>()),
                false => COORDINATES.map(str::to_owned).to_vec(),
            };
            let place = names.iter().position(|name| name == step);
            place.and_then(|place| list.get_mut(place)).ok_or_else(|| {
                let hint = nearest(step, names.iter().map(String::as_str))
                    .map(|near| format!("did you mean `{near}`? "))
                    .unwrap_or_default();
                format!("nothing in it is called `{step}`; {hint}there are {}", names.join(", "))
            })
        }
        _ => Err(format!("is a single value, so it has no `{step}`")),
    }
}

/// The name that is typed for an object.
fn name(object: &Value) -> Option<&str> {
    object.get("name").and_then(Value::as_str)
}

/// Returns the value that the scene has under the key `step` of a table.
fn entry<'a>(table: &'a mut Table, step: &str) -> Result<&'a mut Value, String> {
    let hint = nearest(step, table.keys().map(String::as_str));
    let remedy = match hint {
        Some(near) => format!("did you mean `{near}`?"),
        None => "write it there first".to_owned(),
    };
    let absent = || format!("the scene does not have `{step}`; {remedy}");
    table.get_mut(step).ok_or_else(absent)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Ray;

    fn changed(key: &str, value: &str) -> Result<Scene, String> {
        let changes = [(key.to_owned(), value.to_owned())];
        Scene::open_changed("wall", &changes).map_err(|error| error.to_string())
    }

    #[test]
    fn the_wall_moves() {
        let ray = Ray { origin: [0.0; 3], direction: [1.0, 0.0, 0.0] };
        let range = |scene: Scene| scene.cast(&ray, 0.0, 1e3).unwrap().range;
        assert_eq!(range(changed("object.wall.position_m.x", "80.5").unwrap()), 80.5);
        assert_eq!(range(Scene::open_changed("wall", &[]).unwrap()), 50.0);
        // A key that the file leaves open, and a whole list.
        let turned = changed("sensor.yaw_deg", "60").unwrap();
        assert_ne!(turned.sensor, Scene::open("wall").unwrap().sensor);
        assert_eq!(range(changed("object.wall.position_m", "[7, 0, 0]").unwrap()), 7.0);
    }

    #[test]
    fn a_key_that_leads_nowhere_says_so() {
        let told = |key: &str, value: &str| changed(key, value).unwrap_err();
        assert!(told("object.wal.position_m.x", "1").contains("did you mean `wall`?"));
        assert!(told("object.wall.position_m.w", "1").contains("there are x, y, z"));
        assert!(told("object.wall.positoin_m", "1").contains("did you mean `position_m`?"));
        assert!(told("ground.z_m", "1").contains("does not have `ground`"));
        assert!(told("object.wall.position_m.x", "nan").starts_with("object.wall.position_m.x: "));
        assert!(told("version.x", "1").contains("single value"));
    }
}

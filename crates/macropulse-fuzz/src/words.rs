//! Values typed behind `--set` and `--vary`.

use std::path::Path;
use std::str::FromStr;

use macropulse::design::Design;
use macropulse::scene::{Room, Scene, apart};
use macropulse_study::sweep::{Axis, Metric, Shard};

use crate::assert_says;

/// Changes a ready sensor, or a ready scene, by a `KEY=VALUE` with a value in TOML.
pub fn set(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    let Some((key, value)) = text.split_once('=') else { return };
    let changes = apart(&[(key.trim().to_owned(), value.trim().to_owned())]);
    if !changes.of_sensor.is_empty()
        && let Err(error) = Design::open("kim-park-2016-fixed", &changes.of_sensor)
    {
        assert_says(&error);
    }
    if !changes.of_scene.is_empty() {
        let scene = Scene::builtin("wall").unwrap_or_default();
        let base = Path::new("/nothing/there");
        if let Err(error) =
            Scene::from_toml_within(scene, "wall", base, &changes.of_scene, Room::default())
        {
            assert_says(&error);
        }
    }
}

/// Reads `bytes` as what is varied, and as scores and a shard.
pub fn vary(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    match Axis::from_str(text) {
        Ok(axis) => {
            for (at, value) in axis.values.iter().enumerate() {
                assert!(!value.is_empty(), "an empty value");
                let _ = axis.place(at);
            }
        }
        Err(error) => assert_says(&error),
    }
    let _ = (Shard::from_str(text).is_ok(), Metric::parse(text).is_ok());
}

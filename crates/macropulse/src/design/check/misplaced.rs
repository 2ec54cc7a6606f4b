//! Keys that do not belong where they stand: those of scenes, of other tables and of earlier versions.

use crate::design::Error;
use crate::design::document::Chain;
use crate::names::nearest;
use crate::schema::{self, Fault, Misfit};

/// Tables of the sensor file that held sun and air before these belonged to the scene.
const MOVED: [&str; 3] = ["sun", "atmosphere", "environment"];

/// Detectors that are described by parts now: their former names, and what to write.
const FORMER: [(&str, &str); 2] = [
    (
        "linear",
        "is a [detector.photodiode] with a [comparator] now: false_alarm_hz, timing and hysteresis belong in \
         [comparator], the other keys in [detector.photodiode], where bandwidth_mhz is the electrical one, \
         0.709 times what stood here",
    ),
    (
        "sampled",
        "is a [detector.photodiode] with an [adc] now: sample_ps, bits and step_photons belong in [adc], the \
         other keys in [detector.photodiode]",
    ),
];

/// Keys of a scene file that no sensor has.
const OF_SCENES: [&str; 4] = ["object", "ground", "material", "interferers"];

/// Refuses keys of sun and air, and says where they live.
pub(super) fn refuse_moved(chain: &Chain) -> Result<(), Error> {
    for table in MOVED {
        let Some(typed) = chain.merged.get(table) else { continue };
        let key = typed.as_table().and_then(|keys| keys.keys().next());
        let (path, key) = match key {
            Some(key) => (format!("{table}.{key}"), key.as_str()),
            None => (table.to_owned(), "sky"),
        };
        let message = format!(
            "sun and air belong to the scene: write `{key}` under [environment] in the scene file, \
             or --set environment.{key}=… where a command has a scene or an --environment"
        );
        return Err(chain.error(&path, message));
    }
    Ok(())
}

/// Refuses detectors by their former names.
pub(super) fn refuse_former(chain: &Chain) -> Result<(), Error> {
    let detector = chain.merged.get("detector").and_then(toml::Value::as_table);
    let former = FORMER.iter().find(|(name, _)| detector.is_some_and(|it| it.contains_key(*name)));
    former.map_or(Ok(()), |(name, now)| Err(chain.error(&format!("detector.{name}"), *now)))
}

/// The error of a file that does not fit, with the tables in which an unknown key may stand.
pub(super) fn typed_wrongly(chain: &Chain, misfit: &Misfit) -> Error {
    let (path, message, key) = (misfit.path(), misfit.message(), misfit.key());
    let known = match &misfit.fault {
        Fault::MissingKey(_) => return chain.lacks(&path, &message),
        Fault::UnknownKey { known } => known.iter().map(String::as_str),
        Fault::Value(_) => return chain.error(&path, message),
    };
    if nearest(key, known).is_some() {
        return chain.error(&path, message);
    }
    // A key that stands in another table is no misspelt one.
    let homes = schema::homes(&super::super::schema(), key);
    let elsewhere: Vec<String> = homes.iter().take(3).map(|home| format!("[{home}]")).collect();
    let message = match &elsewhere[..] {
        [_, ..] => format!("unknown key `{key}` here; it belongs in {}", elsewhere.join(" or ")),
        [] if OF_SCENES.contains(&key) => {
            format!("unknown key `{key}` of a sensor; it is one of a scene, as --set scene:{key}…")
        }
        [] => message,
    };
    chain.error(&path, message)
}

#[cfg(test)]
mod tests {
    use crate::design::Design;

    #[test]
    fn detectors_by_their_former_names_are_told_the_new_ones() {
        for (name, now) in [("linear", "[comparator]"), ("sampled", "[adc]")] {
            let set = [(format!("detector.{name}.gain"), "2".to_owned())];
            let told = Design::open("coded-practical", &set).unwrap_err().to_string();
            let begins = format!("--set: detector.{name}: is a [detector.photodiode] with ");
            assert!(told.starts_with(&begins) && told.contains(now), "{told}");
        }
    }
}

//! The program checks all that the schema of scenes says of a key. The schema gives limits, the number of
//! entries of a list, the possible words and the required keys, and allows no other keys.

use std::fs;
use std::path::Path;

use macropulse::environment;
use macropulse::scene::{Scene, schema};
use serde_json::{Map, Value, json};

/// Keys of scenes without a fault, so that each key of the schema is in one of them. Keys that cannot stand
/// together are in several scenes.
fn scenes() -> Vec<Value> {
    let at = json!([9, 0, 0]);
    let path = || {
        let pose =
            json!({ "time_s": 0, "position_m": at, "yaw_deg": 1, "pitch_deg": 1, "roll_deg": 1 });
        json!([pose, { "time_s": 9000, "position_m": at }])
    };
    let shape = |shape: Value| json!({ "version": 1, "object": [{ "shape": shape }] });
    let environment = |keys: Value| json!({ "version": 1, "environment": keys });
    vec![
        json!({
            "version": 1,
            "name": "moving",
            "sensor": {
                "position_m": at, "yaw_deg": 1, "pitch_deg": 1, "roll_deg": 1,
                "velocity_m_s": [1, 0, 0], "turn_rate_deg_s": 1
            },
            "ground": { "material": "grass", "z_m": 0 },
            "material": [{
                "name": "mine", "diffuse": 0.5, "specular": 1, "gloss": 1, "retro": 1,
                "transmission": 0.5
            }],
            "object": [
                {
                    "name": "a", "mesh": "a.obj", "unit": "cm", "scale": 2, "up": "z",
                    "forward": "x", "material": "mine", "target": true, "rest_on_ground": true,
                    "position_m": at, "yaw_deg": 1, "pitch_deg": 1, "roll_deg": 1,
                    "velocity_m_s": [1, 0, 0], "turn_rate_deg_s": 1,
                    "copies": [{
                        "position_m": [5, 5, 0], "yaw_deg": 1, "pitch_deg": 1, "roll_deg": 1,
                        "velocity_m_s": [1, 0, 0], "turn_rate_deg_s": 1
                    }]
                },
                { "name": "turned", "mesh": "a.obj", "up": "x", "forward": "y", "material": "mine" },
                {
                    "name": "c", "car": {}, "path": path(),
                    "copies": [{ "path": path() }]
                },
                { "name": "b", "car": {}, "materials": { "plastic-black": "rubber" } }
            ]
        }),
        json!({ "version": 1, "sensor": { "path": path() } }),
        json!({
            "version": 1,
            "environment": "night",
            "interferers": [{
                "sensor": "peregrine", "name": "c", "set": { "scan.max_range_m": 9 },
                "position_m": at, "yaw_deg": 1, "pitch_deg": 1, "roll_deg": 1,
                "velocity_m_s": [1, 0, 0], "turn_rate_deg_s": 1, "phase_ns": 1, "drift_ppm": 1
            }, { "sensor": "vlp-16", "path": path() }]
        }),
        environment(json!({
            "base": "clear-day", "sky": "day", "sun_elevation_deg": 30, "albedo": 0.2,
            "visibility_km": 10, "rain_mm_h": 1
        })),
        environment(json!({ "irradiance_w_m2_nm": 0.4 })),
        environment(json!({ "base": "night" })),
        environment(json!({ "sky": "night" })),
        environment(json!({ "idealised": ["background"] })),
        shape(json!({ "plane": { "normal": [0, 0, 1] } })),
        shape(json!({ "sphere": { "radius_m": 1 } })),
        shape(json!({ "box": { "size_m": [1, 1, 1] } })),
        shape(json!({ "cylinder": { "radius_m": 1, "height_m": 1 } })),
        shape(json!({ "cone": { "radius_m": 1, "height_m": 1, "top_radius_m": 0.1 } })),
        shape(json!({ "capsule": { "radius_m": 1e-3, "height_m": 1 } })),
        shape(json!({ "ellipsoid": { "size_m": [1, 1, 1] } })),
        shape(json!({ "person": { "height_m": 1 } })),
    ]
}

/// A rule of the schema for what stands at a JSON pointer, `*` being each entry of a list.
#[derive(Debug)]
enum Rule {
    /// Numbers: least and most, and whether the least is one too few.
    Between(Option<f64>, Option<f64>, bool),
    /// Entries of a list: least and most.
    Entries(usize, usize),
    Words(Vec<String>),
    /// Keys that must be there; no others may be but those of the schema.
    Table(Vec<String>),
}

fn rules(node: &Value, path: &str, found: &mut Vec<(String, Rule)>) {
    let limit = |key: &str| node.get(key).and_then(Value::as_f64);
    let texts = |key: &str| -> Option<Vec<String>> {
        let list = node.get(key)?.as_array()?;
        Some(list.iter().filter_map(Value::as_str).map(str::to_owned).collect())
    };
    let mut rule = |rule| found.push((path.to_owned(), rule));
    match node.get("type").and_then(Value::as_str) {
        Some("number" | "integer") => {
            let above = limit("exclusiveMinimum");
            rule(Rule::Between(above.or(limit("minimum")), limit("maximum"), above.is_some()));
        }
        Some("array") => {
            let entries = |key: &str| node.get(key).and_then(Value::as_u64).map(|n| n as usize);
            if let Some(most) = entries("maxItems") {
                rule(Rule::Entries(entries("minItems").unwrap_or(0), most));
            }
        }
        Some("object") if node.get("additionalProperties") == Some(&false.into()) => {
            rule(Rule::Table(texts("required").unwrap_or_default()));
        }
        _ => {}
    }
    if let Some(words) = texts("enum") {
        rule(Rule::Words(words));
    }
    let variants = |key: &str| node.get(key).and_then(Value::as_array);
    let choices = variants("oneOf").or(variants("anyOf"));
    let of_words = choices.filter(|all| all.iter().all(|one| one.get("const").is_some()));
    match (of_words, choices.map(Vec::as_slice)) {
        (Some(words), _) => {
            let word = |one: &Value| one.get("const")?.as_str().map(str::to_owned);
            rule(Rule::Words(words.iter().filter_map(word).collect()));
        }
        // A word of the library, or any other.
        (None, Some([_, any])) if *any == json!({ "type": "string" }) => {}
        (None, Some(choices)) => choices.iter().for_each(|one| rules(one, path, found)),
        (None, None) => {}
    }
    if let Some(Value::Object(keys)) = node.get("properties") {
        keys.iter().for_each(|(key, below)| rules(below, &format!("{path}/{key}"), found));
    }
    if let Some(each) = node.get("items") {
        rules(each, &format!("{path}/*"), found);
    }
}

/// The pointers that `path` stands for in `scene`.
fn places(scene: &Value, path: &str) -> Vec<String> {
    let mut places = vec![String::new()];
    for key in path.split('/').skip(1) {
        let below = |place: &String| match scene.pointer(place) {
            Some(Value::Array(list)) if key == "*" => {
                (0..list.len()).map(|at| format!("{place}/{at}")).collect()
            }
            Some(Value::Object(_)) => vec![format!("{place}/{key}")],
            _ => vec![],
        };
        places = places.iter().flat_map(below).collect();
        places.retain(|place| scene.pointer(place).is_some());
    }
    places
}

/// Returns the error of `scene`, if it is refused.
fn said(scene: &Value, folder: &Path) -> Option<String> {
    let text = toml::to_string(scene).unwrap();
    Scene::from_toml(&text, "mine.toml", folder).err().map(|error| error.to_string())
}

/// A scene with another value somewhere, and the words that its refusal must have; none where it must
/// be taken.
struct Trial {
    value: Value,
    told: Option<Vec<String>>,
}

impl Trial {
    fn taken(value: Value) -> Self {
        Self { value, told: None }
    }

    fn refused<const N: usize>(value: Value, told: [&str; N]) -> Self {
        Self { value, told: Some(told.map(str::to_owned).to_vec()) }
    }
}

/// Returns the trials of a `rule` in place of `old`, at a place called `key`.
fn trials(rule: &Rule, key: &str, old: &Value) -> Vec<Trial> {
    let mut trials = Vec::new();
    match rule {
        Rule::Between(least, most, is_above) => {
            let [low, high] =
                [least, most].map(|limit| limit.map_or(String::new(), |l| l.to_string()));
            // The message on a velocity tells the length of the arrow.
            let low = if key == "velocity_m_s" { "" } else { &low };
            let told = [key, if *is_above { "above zero" } else { low }, &high];
            let number = |value: f64| match old.is_i64() && value.fract() == 0.0 {
                true => json!(value as i64),
                false => json!(value),
            };
            if let Some(least) = least {
                trials.push(Trial::refused(number(least - 1.0), told));
                trials.push(match is_above {
                    true => Trial::refused(number(*least), told),
                    false => Trial::taken(number(*least)),
                });
            }
            if let Some(most) = most {
                trials.push(Trial::taken(number(*most)));
                trials.push(Trial::refused(number(most + most.abs().max(1.0) * 1e-3), told));
            }
            // Without a limit in the schema there is none in the program.
            if least.is_none() {
                trials.push(Trial::taken(json!(-1e6)));
            }
            if most.is_none() && key != "top_radius_m" {
                trials.push(Trial::taken(json!(if key == "radius_m" { 0.4 } else { 1e6 })));
            }
            if key != "version" {
                trials.push(Trial::refused(json!("far"), [key, "number"]));
            }
        }
        Rule::Entries(least, most) => {
            let old = old.as_array().map_or(&[][..], Vec::as_slice);
            let list = |n: usize| Value::from_iter(old.iter().cycle().take(n).cloned());
            if let Some(fewer) = least.checked_sub(1) {
                trials.push(Trial::refused(list(fewer), [key, &least.to_string()]));
            }
            trials.push(Trial::taken(list(*most)));
            trials.push(Trial::refused(list(most + 1), [&most.to_string()]));
        }
        Rule::Words(words) => {
            trials.extend(words.iter().map(|word| Trial::taken(json!(word))));
            trials.push(Trial::refused(json!("no-such-word"), ["no-such-word"]));
        }
        Rule::Table(required) => {
            let with = |change: &dyn Fn(&mut Map<String, Value>)| {
                let mut table = old.clone();
                table.as_object_mut().map(change);
                table
            };
            for needed in required {
                let without = with(&|table| drop(table.remove(needed)));
                trials.push(Trial::refused(without, [needed.as_str()]));
            }
            let more = with(&|table| drop(table.insert("no_such_key".into(), json!(1))));
            // Beside one of several kinds it is the second one.
            let told = if key == "shape" { "must have exactly one" } else { "no_such_key" };
            trials.push(Trial::refused(more, [told]));
        }
    }
    trials
}

#[test]
fn the_schema_of_scenes_says_what_is_checked() {
    let desk = tempfile::tempdir().unwrap();
    fs::write(desk.path().join("a.obj"), "v 0 -2 -2\nv 0 2 -2\nv 0 0 2\nf 1 2 3\n").unwrap();
    let scenes = scenes();
    for scene in &scenes {
        assert_eq!(said(scene, desk.path()), None, "{scene}");
    }
    let mut found = Vec::new();
    rules(&schema(), "", &mut found);
    assert!(found.len() > 90, "{} rules", found.len());
    let mut wrong = Vec::new();
    for (path, rule) in found {
        let key = path.rsplit('/').find(|key| *key != "*").unwrap_or_default();
        let mut tried = 0;
        let mut taken: Vec<Value> = Vec::new();
        let mut not_taken: Vec<(Value, String)> = Vec::new();
        for scene in &scenes {
            for place in places(scene, &path) {
                // One of several shapes, not this one.
                let old = scene.pointer(&place).unwrap();
                if matches!((&rule, old), (Rule::Table(_), Value::String(_)))
                    || matches!((&rule, old), (Rule::Words(_), Value::Object(_)))
                    || matches!(&rule, Rule::Table(keys) if keys.iter().any(|key| old.get(key).is_none()))
                {
                    continue;
                }
                for trial in trials(&rule, key, old) {
                    tried += 1;
                    let mut changed = scene.clone();
                    *changed.pointer_mut(&place).unwrap() = trial.value.clone();
                    let said = said(&changed, desk.path());
                    let fits = |words: &Vec<String>, said: &str| {
                        words.iter().all(|w| said.contains(w.as_str()))
                    };
                    match (said, trial.told) {
                        (None, None) => taken.push(trial.value),
                        (Some(said), None) => not_taken.push((trial.value, said)),
                        (Some(said), Some(words)) if fits(&words, &said) => {}
                        (said, Some(words)) => wrong.push(format!(
                            "{path}: {rule:?}: {} wants {words:?}, but: {said:?}",
                            trial.value
                        )),
                    }
                }
            }
        }
        // A word may not fit what else is in one of the scenes.
        let not_taken = not_taken.iter().filter(|(value, _)| !taken.contains(value));
        wrong.extend(not_taken.map(|(value, said)| format!("{path}: {rule:?}: {value}: {said}")));
        if tried == 0 {
            wrong.push(format!("{path}: {rule:?} is in none of the scenes"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// An environment in a file and one in a scene have the same keys.
#[test]
fn the_schema_of_environments_is_that_in_scenes() {
    let (alone, scene) = (environment::schema(), schema());
    let inside = scene.pointer("/properties/environment/anyOf/1").unwrap();
    for key in ["type", "properties", "additionalProperties"] {
        assert_eq!(alone.get(key), inside.get(key), "{key}");
        assert!(alone.get(key).is_some(), "{key}");
    }
}

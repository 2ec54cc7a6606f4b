//! Sun and air from the command line: chosen, changed, and switched off.

#![allow(missing_docs, clippy::unwrap_used)]

use crate::common;

use common::Desk;
use serde_json::Value;

const WALL: &str = "simulate --sensor peregrine --scene wall --format none --json";

fn list(value: &Value) -> Vec<&str> {
    value.as_array().unwrap().iter().map(|name| name.as_str().unwrap()).collect()
}

#[test]
fn fog_takes_the_wall_away() {
    let desk = Desk::new();
    let clear = desk.json(WALL);
    assert_eq!(clear["environment"]["name"], "clear-day");
    let right = |run: &Value| run["outcomes"]["right"].as_u64().unwrap();
    assert!(right(&clear) > 3000, "{clear}");
    for fog in ["--environment fog-50m", "--set environment.visibility_km=0.05"] {
        let run = desk.json(&format!("{WALL} {fog}"));
        assert_eq!(right(&run), 0, "{fog}: {run}");
    }
    // And back: without air it is as if there were none.
    let vacuum = desk.json(&format!("{WALL} --without atmosphere"));
    assert!(list(&vacuum["idealised"]).contains(&"atmosphere"));
    assert!(right(&vacuum) >= right(&clear));
    let name = vacuum["environment"]["name"].as_str().unwrap();
    assert!(name.starts_with("clear-day with idealised"), "{name}");
}

#[test]
fn a_scene_says_what_its_weather_is() {
    let desk = Desk::new();
    let ground = "ground = { material = \"white\" }\n";
    desk.put("a.toml", &format!("version = 1\n{ground}"));
    let report = desk.json("check a.toml --json");
    assert_eq!(report["environment"]["name"], "clear-day");
    assert!(report["assumed"].to_string().contains("none given, clear-day is assumed"));
    let table = "[environment]\nbase = \"overcast\"\nvisibility_km = 2.0\n";
    desk.put("a.toml", &format!("version = 1\n{ground}{table}"));
    let report = desk.json("check a.toml --json");
    assert_eq!(report["environment"]["name"], "overcast with visibility_km = 2.0");
    assert_eq!(report["environment"]["conditions"], "closed clouds, albedo 0.3, visibility 2 km");
    let report = desk.json("check a.toml --set environment.visibility_km=3 --json");
    assert_eq!(report["environment"]["conditions"], "closed clouds, albedo 0.3, visibility 3 km");
    let report = desk.json("check car-30m --json");
    assert_eq!(report["assumptions"]["atmosphere"], "the air is perfectly clear");
    for name in ["clear-day", "night"] {
        assert!(desk.run("environments").out.contains(name));
        assert!(desk.run(&format!("environments {name}")).out.contains("visibility_km = 23.0"));
    }
    desk.refused("environments nihgt", &["nihgt", "did you mean `night`?"]);
}

#[test]
fn a_key_without_effect_is_refused_with_what_makes_it_so() {
    let desk = Desk::new();
    desk.put("a.toml", "version = 1\n[environment]\nsky = \"night\"\nalbedo = 0.2\n");
    desk.refused("check a.toml", &["a.toml:4:1: environment.albedo: has no effect", "night"]);
    desk.put("a.toml", "version = 1\nenvironment = \"clear-dya\"\n");
    desk.refused("check a.toml", &["a.toml:2:", "did you mean `clear-day`?"]);
    let car = "simulate --sensor peregrine --scene car-30m --format none";
    let words = ["environment.visibility_km: has no effect", "`atmosphere`", "--with atmosphere"];
    desk.refused(&format!("{car} --set environment.visibility_km=1"), &words);
    let with = format!("{car} --with atmosphere --set environment.visibility_km=1 --json");
    assert_eq!(list(&desk.json(&with)["idealised"]).last(), Some(&"background"));
    desk.refused(&format!("{car} --environment nihgt"), &["environment", "`night`"]);
    desk.refused(&format!("{car} --set environment.visiblity_km=1"), &["`visibility_km`"]);
}

#[test]
fn old_keys_of_the_sensor_say_where_they_live_now() {
    let desk = Desk::new();
    let start = "version = 1\nname = \"mine\"\nextends = \"peregrine\"\n";
    for (key, words) in [
        ("[sun]\nsky = \"night\"", ["mine.toml:5:1: sun.sky", "under [environment] in the scene"]),
        ("[atmosphere]\nvisibility_km = 3", ["atmosphere.visibility_km", "--set environment.vis"]),
        ("idealised = [\"background\"]", ["idealised", "belong to the scene"]),
    ] {
        desk.put("mine.toml", &format!("{start}{key}\n"));
        desk.refused("check mine.toml", &words);
    }
    desk.refused("check peregrine --set sun.sky=night", &["--set: sun.sky", "environment.sky"]);
    let words = ["environment.sky", "this command has none"];
    desk.refused("encode --sensor kim-park-2016 --pixel 0,1 --set environment.sky=night", &words);
}

#[test]
fn effects_are_switched_one_by_one() {
    let desk = Desk::new();
    let check = |options: &str| desk.json(&format!("check kim-park-2016 {options} --json"));
    let names = |report: &Value| {
        report["assumptions"].as_object().unwrap().keys().cloned().collect::<Vec<_>>()
    };
    let as_it_is = names(&check(""));
    assert!(as_it_is.contains(&"mirror-motion".to_owned()) && as_it_is.len() == 6);
    let moving = names(&check("--with mirror-motion"));
    assert_eq!(moving.len(), 5);
    assert!(!moving.contains(&"mirror-motion".to_owned()));
    assert_eq!(check("--without footprint")["assumptions"], check("")["assumptions"]);
    // The keys that an effect needs are asked for as if the list had been typed.
    desk.refused("check kim-park-2016 --with footprint", &["light.footprint_rays"]);
    desk.refused("check kim-park-2016 --with mirror-moton", &["did you mean `mirror-motion`?"]);
    let both = "check kim-park-2016 --with footprint --without footprint";
    desk.refused(both, &["--with footprint", "contradict"]);
}

#[test]
fn a_budget_compares_its_environment_with_the_same_at_night() {
    let desk = Desk::new();
    let budget = |options: &str| {
        desk.json(&format!("budget coded-practical --reflectance 0.1 {options} --json"))
    };
    let range = |report: &Value, key: &str| report["by_reflectance"][1][key].as_f64().unwrap();
    let (day, clouds) = (budget(""), budget("--environment overcast"));
    assert_eq!(day["environment"]["name"], "clear-day");
    let at_night = |report: &Value| range(report, "range_of_pd_at_night_m");
    assert_eq!(at_night(&day), at_night(&clouds));
    let seen = |report: &Value| range(report, "range_of_pd_m");
    assert!(seen(&day) < seen(&clouds) && seen(&clouds) < at_night(&day));
    let hazy = budget("--set environment.visibility_km=1");
    assert!(seen(&hazy) < seen(&day));
    let far = "budget coded-practical --set light.wavelength_nm=1760";
    desk.refused(far, &["coded-practical in clear-day", "1760 nm", "irradiance_w_m2_nm"]);
    let scan = far.replace("budget coded-practical", "simulate --sensor coded-practical");
    desk.refused(&format!("{scan} --scene wall -o out"), &["1760 nm"]);
    desk.refused(&format!("{scan} --sensor peregrine --scene wall -o out"), &["1760 nm"]);
    let wall = "--set scene:object.wall.material=brick";
    desk.refused(&format!("budget coded-practical {wall}"), &["this command has none"]);
}

#[test]
fn the_scene_is_changed_as_in_a_sweep() {
    let desk = Desk::new();
    let near = desk.json(&format!("{WALL} --set scene:object.wall.position_m.x=20"));
    let far = desk.json(&format!("{WALL} --set scene:object.wall.position_m.x=500"));
    assert!(near["counts"]["returns"].as_u64() > Some(3000), "{near}");
    assert_eq!(far["counts"]["surfaces"], 0);
    let words = ["object.wal.material", "did you mean `wall`?"];
    desk.refused(&format!("{WALL} --set scene:object.wal.material=brick"), &words);
}

#[test]
fn fog_is_swept_over() {
    let desk = Desk::new();
    let line = "sweep peregrine --scene wall --seeds 2 --score pd -o out --json \
                --vary environment.visibility_km=0.05,5";
    let table = desk.json(line);
    let pd = |row: usize| table["rows"][row]["pd"]["value"].as_f64();
    assert!(table["rows"].as_array().unwrap().len() == 2, "{table}");
    assert!(pd(0) < pd(1), "{table}");
    let manifest = std::fs::read(desk.path().join("out/manifest.json")).unwrap();
    let manifest: Value = serde_json::from_slice(&manifest).unwrap();
    let foggy = &manifest["environments"][0];
    assert_eq!(foggy["name"], "clear-day with visibility_km = 0.05");
    assert!(foggy["conditions"].as_str().unwrap().starts_with("day"), "{foggy}");
    desk.refused(
        "sweep peregrine --scene car-30m -o b --vary environment.visibility_km=1,2",
        &["with environment.visibility_km = 1", "`atmosphere`"],
    );
}

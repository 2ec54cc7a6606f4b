//! Messages on meshes: on parts that are left out, and on files outside the folder of a scene.

#![allow(missing_docs, clippy::unwrap_used)]

use crate::common;

use std::fs;

use common::Desk;

/// A triangle across the x axis that names its materials in a file above the folder of the scene.
const OBJ: &str =
    "mtllib ../paint.mtl\nv 0 -2 -2\nv 0 2 -2\nv 0 0 2\nusemtl paint\nf 1 2 3\nl 1 2\n";

const SCENE: &str = "version = 1
[[object]]
name = \"thing\"
mesh = \"a.obj\"
position_m = [10.0, 0.0, 0.0]
";

fn desk(colour: &str) -> Desk {
    let desk = Desk::new();
    fs::create_dir(desk.path().join("yard")).unwrap();
    desk.put("yard/a.obj", OBJ).put("yard/s.toml", SCENE);
    desk.put("paint.mtl", &format!("newmtl paint\n{colour}\n"));
    desk.put("s.toml", "version = 1\nsensor = \"peregrine\"\nscene = \"yard/s.toml\"\n");
    desk
}

#[test]
fn files_outside_the_folder_of_a_scene_need_an_option() {
    let desk = desk("Kd 0.25");
    let vary = "--vary scene:object.thing.position_m.x=8,12 --seeds 1 --shots 500";
    for line in [
        "check yard/s.toml",
        "check s.toml",
        "simulate peregrine yard/s.toml -o out",
        "simulate s.toml -o out",
        &format!("sweep peregrine yard/s.toml {vary} -o out"),
    ] {
        desk.refused(line, &["a.obj: names ../paint.mtl", "outside the folder", "--outside-files"]);
        let ran = desk.run(&format!("{line} --outside-files"));
        assert_eq!(ran.code, Some(0), "{line}: {}", ran.err);
        let _ = fs::remove_dir_all(desk.path().join("out"));
    }
    // It is the same as the key of the scene, and a sensor beside it is checked all the same.
    let line = "check peregrine yard/s.toml --outside-files --json";
    assert_eq!(desk.json(line)[1]["materials"][0], "thing/paint");
    let line = "check yard/s.toml --set scene:outside_files=true --json";
    assert_eq!(desk.json(line)["materials"][0], "thing/paint");
}

#[test]
fn what_is_left_out_of_a_mesh_is_said_wherever_it_is_read() {
    let desk = desk("Kd 0.25");
    let said = "thing: 1 line is no surface, and is left out";
    for line in ["check yard/s.toml", "check s.toml", "simulate peregrine yard/s.toml -o out"] {
        let ran = desk.run(&format!("{line} --outside-files"));
        let words: Vec<&str> = ran.out.split_whitespace().collect();
        assert!(words.join(" ").contains(said), "{line}: {}", ran.out);
    }
    let manifest = fs::read_to_string(desk.path().join("out/manifest.json")).unwrap();
    let manifest: serde_json::Value = serde_json::from_str(&manifest).unwrap();
    assert_eq!(manifest["warnings"], serde_json::json!([said]));
}

/// It used to take the program down.
#[test]
fn a_colour_of_two_numbers_is_refused() {
    let line = "check yard/s.toml --outside-files";
    desk("Kd 0.5 0.5").refused(line, &["paint.mtl: line 2 has 2 numbers", "material = "]);
    assert_eq!(desk("Kd 0.5").run(line).code, Some(0));
}

//! The report on a scene.

use macropulse::scene::Scene;
use serde_json::json;

use super::Report;
use crate::text::{Columns, grouped, short};

/// What a scene is made of, and what was assumed in reading it.
pub fn report(scene: &Scene) -> Report {
    let objects: Vec<&str> = scene.objects.iter().map(|object| object.name.as_str()).collect();
    let materials: Vec<&str> = scene.materials.iter().map(|m| m.name.as_str()).collect();
    let targets: Vec<&str> =
        scene.objects.iter().filter(|o| o.is_target).map(|o| o.name.as_str()).collect();
    let stand = &scene.sensor;
    let [yaw, pitch, roll] = [stand.yaw, stand.pitch, stand.roll].map(f64::to_degrees);
    let [x, y, z] = stand.position;
    let mut columns = Columns::default();
    columns.push("triangles", grouped(scene.triangles() as u64));
    columns.push("objects", objects.join(", "));
    columns
        .push("targets", if targets.is_empty() { "none".to_owned() } else { targets.join(", ") });
    columns.push("materials", materials.join(", "));
    columns.push(
        "sensor",
        format!(
            "at x {}, y {}, z {} m; yaw {}, pitch {}, roll {} deg",
            short(x),
            short(y),
            short(z),
            short(yaw),
            short(pitch),
            short(roll)
        ),
    );
    columns.push("digest", scene.digest());
    let notes = scene.notes.iter().cloned();
    columns.push_list(
        "assumed",
        if scene.notes.is_empty() { vec!["nothing".into()] } else { notes.collect() },
    );
    Report {
        text: format!("{}: a scene\n\n{}", scene.name, columns.text()),
        json: json!({
            "kind": "scene",
            "name": scene.name,
            "triangles": scene.triangles(),
            "objects": objects,
            "targets": targets,
            "materials": materials,
            "sensor_position_m": stand.position,
            "sensor_yaw_deg": yaw,
            "sensor_pitch_deg": pitch,
            "sensor_roll_deg": roll,
            "digest": scene.digest(),
            "assumed": scene.notes,
        }),
    }
}

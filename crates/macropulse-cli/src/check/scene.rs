//! The report on a scene.

use macropulse::memory::{Estimate, of_scene};
use macropulse::scene::{Interferer, Motion, Moving, Pose, Scene};
use macropulse::units::s_from_fs;
use macropulse_study::record::surroundings;
use serde_json::{Map, Value, json};

use super::Report;
use crate::fault::Fault;
use crate::memory::{self, MemoryLimit, told as told_memory};
use crate::text::{Columns, grouped, short};

/// Reports the contents of a scene, and the assumptions made in reading it.
pub fn report(scene: &Scene, memory: &MemoryLimit) -> Result<Report, Fault> {
    let estimate = Estimate { scene: of_scene(scene), ..Estimate::default() };
    memory.allow_alone(&scene.name, &estimate)?;
    let objects: Vec<&str> = scene.objects.iter().map(|object| object.name.as_str()).collect();
    let materials: Vec<&str> = scene.materials.iter().map(|m| m.name.as_str()).collect();
    let targets: Vec<&str> =
        scene.objects.iter().filter(|o| o.is_target).map(|o| o.name.as_str()).collect();
    let [yaw, pitch, roll] = scene.sensor.at_start().rotation.angles_deg();
    let mut columns = Columns::default();
    columns.push("triangles", grouped(scene.triangles() as u64));
    columns.push("memory", format!("about {}", told_memory(estimate.scene)));
    columns.push("objects", objects.join(", "));
    columns
        .push("targets", if targets.is_empty() { "none".to_owned() } else { targets.join(", ") });
    columns.push("materials", materials.join(", "));
    columns.push("sensor", stands(&scene.sensor.at_start()));
    let moving = scene.moving.iter();
    columns.push_list("moving", moving.map(|one| format!("{}: {}", one.name, one.motion.told())));
    let environment = &scene.environment;
    let conditions = environment.conditions();
    columns.push("environment", format!("{}: {conditions}", environment.name));
    let left_out = environment.idealised.iter();
    columns.push_list("idealised", left_out.map(|e| format!("{}: {}", e.name(), e.assumption())));
    columns.push_list("interferers", scene.interferers.iter().map(told));
    columns.push("digest", scene.digest());
    let notes = scene.notes.iter().cloned();
    columns.push_list(
        "assumed",
        if scene.notes.is_empty() { vec!["nothing".into()] } else { notes.collect() },
    );
    columns.push_list("warnings", scene.warnings.iter().cloned());
    Ok(Report {
        text: format!("{}: a scene\n\n{}", scene.name, columns.text()),
        json: json!({
            "kind": "scene",
            "name": scene.name,
            "triangles": scene.triangles(),
            "objects": objects,
            "targets": targets,
            "materials": materials,
            "sensor_position_m": scene.sensor.at_start().position,
            "sensor_yaw_deg": yaw,
            "sensor_pitch_deg": pitch,
            "sensor_roll_deg": roll,
            "moving": scene.moving.iter().map(moves).collect::<Vec<_>>(),
            "environment": surroundings(environment),
            "idealised": environment.idealised.iter().map(|e| e.name()).collect::<Vec<_>>(),
            "assumptions": environment
                .idealised
                .iter()
                .map(|e| (e.name().to_owned(), e.assumption().into()))
                .collect::<Map<_, _>>(),
            "interferers": scene.interferers.iter().map(json).collect::<Vec<_>>(),
            "digest": scene.digest(),
            "assumed": scene.notes,
            "warnings": scene.warnings,
            "memory": memory::json(&estimate),
        }),
    })
}

fn stands(pose: &Pose) -> String {
    let [x, y, z] = pose.position.map(short);
    let [yaw, pitch, roll] = pose.rotation.angles_deg().map(short);
    format!("at x {x}, y {y}, z {z} m; yaw {yaw}, pitch {pitch}, roll {roll} deg")
}

/// Something that moves: what, and how.
fn moves(moving: &Moving) -> Value {
    let name = &moving.name;
    match &moving.motion {
        Motion::Still(_) => json!({ "name": name }),
        Motion::Steady { velocity, turn_rate, .. } => json!({
            "name": name, "velocity_m_s": velocity, "turn_rate_deg_s": turn_rate.to_degrees(),
        }),
        Motion::Path(path) => json!({
            "name": name, "path": path.poses().map(waypoint).collect::<Vec<_>>(),
        }),
    }
}

/// A pose of a path and its time.
fn waypoint((time_fs, pose): (i64, Pose)) -> Value {
    let [yaw, pitch, roll] = pose.rotation.angles_deg();
    json!({
        "time_s": s_from_fs(time_fs),
        "position_m": pose.position,
        "yaw_deg": yaw,
        "pitch_deg": pitch,
        "roll_deg": roll,
    })
}

/// One of the other lidars: what, where, when.
fn told(other: &Interferer) -> String {
    let (phase, drift) = (phase_ns(other), short(drift_ppm(other)));
    let (name, sensor) = (&other.name, &other.design.name);
    let stands = stands(&other.motion.at_start());
    format!("{name}: {sensor}, {stands}; reads 0 at {phase} ns of ours, {drift} ppm fast")
}

fn json(other: &Interferer) -> Value {
    let pose = other.motion.at_start();
    let [yaw, pitch, roll] = pose.rotation.angles_deg();
    json!({
        "name": other.name,
        "sensor": other.design.name,
        "position_m": pose.position,
        "yaw_deg": yaw,
        "pitch_deg": pitch,
        "roll_deg": roll,
        "phase_ns": phase_ns(other),
        "drift_ppm": drift_ppm(other),
    })
}

fn phase_ns(other: &Interferer) -> f64 {
    other.clock.phase_fs as f64 / 1e6
}

fn drift_ppm(other: &Interferer) -> f64 {
    other.clock.drift as f64 / 1e6
}

//! Finds objects that the sensor stands inside, where it would see little else.

use glam::DVec3;

use super::closed_form::Solid;
use super::hits::{CastRays, Ray};

/// Directions in which an enclosing mesh must be met.
const DIRECTIONS: u32 = 64;

/// Most surfaces that a ray is followed through.
const MOST_SURFACES: usize = 1000;

impl Solid {
    /// Returns true if `point`, in the world, lies inside. Nothing lies inside a plane.
    fn holds(&self, point: [f64; 3]) -> bool {
        self.shape().holds(DVec3::from(self.pose().sensor_from_world().point(point)))
    }
}

/// The objects of the shapes that `point`, in the world, lies inside, each once.
pub(super) fn shapes_around(solids: &[Solid], point: [f64; 3]) -> Vec<u16> {
    let around = solids.iter().filter(|solid| solid.holds(point));
    let mut objects: Vec<u16> = around.map(Solid::object).collect();
    objects.dedup();
    objects
}

/// The objects among `meshes` that are met from `point`, in the world, in every one of 64 directions spread
/// evenly over the sphere. A mesh need not be free of gaps for that, nor its triangles turned the same way. A
/// car is made of many sheets, so counting how often a ray crosses it says nothing.
pub(super) fn meshes_around(world: &impl CastRays, meshes: &[u16], point: [f64; 3]) -> Vec<u16> {
    let mut around: Option<Vec<u16>> = None;
    // The first points up, where most sensors see the sky.
    for index in 0..DIRECTIONS {
        let ray = Ray { origin: point, direction: direction(index) };
        let met = along(world, &ray);
        let around = around
            .get_or_insert_with(|| met.iter().copied().filter(|o| meshes.contains(o)).collect());
        around.retain(|object| met.contains(object));
        if around.is_empty() {
            break;
        }
    }
    around.unwrap_or_default()
}

/// The objects that `ray` meets, each once.
fn along(world: &impl CastRays, ray: &Ray) -> Vec<u16> {
    let (mut met, mut nearest) = (Vec::new(), 0.0);
    for _ in 0..MOST_SURFACES {
        let Some(hit) = world.cast(ray, nearest, f64::INFINITY) else { break };
        nearest = hit.range;
        if !met.contains(&hit.object) {
            met.push(hit.object);
        }
    }
    met
}

/// One of [`DIRECTIONS`] unit vectors on a spiral from top to bottom, at the golden angle from
/// each other.
fn direction(index: u32) -> [f64; 3] {
    let golden = std::f64::consts::PI * (3.0 - 5_f64.sqrt());
    let up = 1.0 - (2.0 * f64::from(index) + 1.0) / f64::from(DIRECTIONS);
    let (sin, cos) = libm::sincos(golden * f64::from(index));
    let across = (1.0 - up * up).sqrt();
    [across * cos, across * sin, up]
}

#[cfg(test)]
mod tests {
    use super::super::Scene;
    use std::path::Path;

    /// Returns the note of a scene on its sensor, which stands at `position`.
    fn told_in(folder: &Path, position: &str, more: &str) -> Option<String> {
        let text = format!("version = 1\n{more}\n[sensor]\nposition_m = {position}\n");
        let scene = Scene::from_toml(&text, "a.toml", folder).unwrap();
        scene.notes.into_iter().find(|note| note.starts_with("sensor: it stands"))
    }

    fn told(position: &str, object: &str) -> Option<String> {
        told_in(Path::new(""), position, &format!("[[object]]\nname = \"thing\"\n{object}"))
    }

    #[test]
    fn a_sensor_inside_a_shape_is_told() {
        let sphere =
            "shape = { sphere = { radius_m = 2 } }\nposition_m = [9, 0, 0]\nmaterial = \"white\"";
        assert!(told("[10.9, 0, 0]", sphere).unwrap().contains("inside thing"));
        assert_eq!(told("[11.1, 0, 0]", sphere), None);
        // Within the corner of the box, which has turned away from under the other place.
        let turned = "shape = { box = { size_m = [4, 4, 4] } }\nyaw_deg = 45\nmaterial = \"white\"";
        assert!(told("[2.7, 0, 0]", turned).is_some());
        assert_eq!(told("[1.9, 1.9, 0]", turned), None);
        let plane = "shape = { plane = { normal = [0, 0, 1] } }\nmaterial = \"white\"";
        assert_eq!(told("[0, 0, -1]", plane), None);
    }

    #[test]
    fn a_sensor_inside_a_car_is_told() {
        let car = "car = {}\nposition_m = [20, 5, 0]\nyaw_deg = 30";
        let copies = "car = {}\nposition_m = [-50, 0, 0]\ncopies = [{ position_m = [20, 5, 0] }]";
        for car in [car, copies] {
            // In the cabin; above the roof, below the floor, beside the door.
            assert!(told("[20, 5, 1.1]", car).is_some(), "{car}");
            assert_eq!(told("[20, 5, 1.6]", car), None);
            assert_eq!(told("[20, 5, 0.1]", car), None);
            assert_eq!(told("[20, 7.5, 0.7]", car), None);
        }
    }

    #[test]
    fn a_mesh_that_is_open_encloses_nothing() {
        let vertices: String = (0..8)
            .map(|corner| format!("v {} {} {}\n", corner & 1, corner >> 1 & 1, corner >> 2))
            .collect();
        let faces = ["1 3 4 2", "1 2 6 5", "3 7 8 4", "1 5 7 3", "2 4 8 6", "5 6 8 7"];
        let object = |faces: &[&str]| {
            let folder = tempfile::tempdir().unwrap();
            let faces: String = faces.iter().map(|face| format!("f {face}\n")).collect();
            std::fs::write(folder.path().join("a.obj"), format!("{vertices}{faces}")).unwrap();
            let more = "[[object]]\nmesh = \"a.obj\"\nmaterial = \"white\"";
            told_in(folder.path(), "[0.5, 0.5, 0.5]", more)
        };
        assert!(object(&faces).unwrap().contains("inside object-1"));
        assert_eq!(object(&faces[..5]), None);
    }

    #[test]
    fn a_sensor_below_the_ground_is_told() {
        let ground = "ground = { material = \"asphalt\", z_m = 0.5 }";
        let told = |position| told_in(Path::new(""), position, ground);
        assert!(told("[0, 0, 0.25]").unwrap().contains("0.25 m below the ground"));
        assert_eq!(told("[0, 0, 0.5]"), None);
        assert_eq!(told("[0, 0, 2]"), None);
    }
}

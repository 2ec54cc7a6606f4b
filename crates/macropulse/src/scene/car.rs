//! The car of the ready scenes: a mid-size saloon, 4.70 m long, 1.82 m wide, 1.42 m high.
//!
//! It is a mesh like any other, built into the program; `cargo run -p macropulse --example
//! make-car` draws it.

use std::path::Path;

use super::error::Error;
use super::mesh::Mesh;
use super::readers;

/// Length, width and height of the car, m. The mesh has exactly this bounding box.
pub const SIZE: [f64; 3] = [4.70, 1.82, 1.42];

const FILE: &[u8] = include_bytes!("../../../../scenes/meshes/car.ply");

/// The mesh of the car, m: it stands on z = 0, centred in x and y, and looks along +x.
///
/// # Errors
/// Never, as long as the file is the one that belongs to the program.
pub(super) fn mesh() -> Result<Mesh, Error> {
    readers::read_ply(FILE, Path::new("scenes/meshes/car.ply"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Ray, Scene};
    use std::path::Path;

    const PAINT: &str = "paint-white";
    const GLASS: &str = "glass";
    const TRIM: &str = "plastic-black";

    #[test]
    fn the_car_has_exactly_its_size_and_stands_on_the_ground() {
        let mesh = mesh().unwrap();
        let (low, high) = mesh.bounds().unwrap();
        for axis in 0..3 {
            assert!((high[axis] - low[axis] - SIZE[axis]).abs() < 1e-6);
        }
        assert!((high[0] + low[0]).abs() < 1e-6 && (high[1] + low[1]).abs() < 1e-6);
        assert!(low[2].abs() < 1e-6);
        assert!((5_000..20_000).contains(&mesh.triangles.len()), "{}", mesh.triangles.len());
    }

    #[test]
    fn every_part_is_there() {
        let mesh = mesh().unwrap();
        let parts = [
            PAINT,
            GLASS,
            TRIM,
            "rubber",
            "metal",
            "fabric",
            "number-plate",
            "headlamp",
            "tail-lamp",
            "chrome",
        ];
        for part in parts {
            let material = mesh.material_names.iter().position(|name| name == part).unwrap();
            assert!(mesh.material_of_triangle.contains(&(material as u16)), "{part}");
        }
        // Two lamps each, of 18 × 5 cells.
        for lamp in ["headlamp", "tail-lamp"] {
            let material = mesh.material_names.iter().position(|name| name == lamp).unwrap() as u16;
            let count = mesh.material_of_triangle.iter().filter(|own| **own == material).count();
            assert_eq!(count, 2 * 18 * 5 * 2, "{lamp}");
        }
    }

    /// The material that a ray along x, towards the face that looks at the sensor, meets first.
    fn met(scene: &Scene, y: f64, z: f64) -> Option<&str> {
        let ray = Ray { origin: [0.0, y, z], direction: [1.0, 0.0, 0.0] };
        let hit = scene.cast(&ray, 0.0, 100.0)?;
        Some(scene.materials[hit.material as usize].name.as_str())
    }

    fn ahead(yaw: f64) -> Scene {
        let text = format!(
            "version = 1\n[[object]]\ncar = {{}}\nposition_m = [32.35, 0, 0]\nyaw_deg = {yaw}\n"
        );
        Scene::from_toml(&text, "ahead", Path::new("")).unwrap()
    }

    #[test]
    fn the_front_fills_its_box_as_a_car_does() {
        let scene = ahead(180.0);
        let (columns, rows) = (364, 284);
        let cells = (0..columns * rows).filter(|cell| {
            let y = -0.91 + 1.82 * (f64::from(cell % columns) + 0.5) / f64::from(columns);
            let z = 1.42 * (f64::from(cell / columns) + 0.5) / f64::from(rows);
            met(&scene, y, z).is_some()
        });
        let fill = cells.count() as f64 / f64::from(columns * rows);
        assert!((0.80..0.92).contains(&fill), "{fill}");
    }

    #[test]
    fn lamps_plate_and_screen_are_where_they_belong() {
        let front = ahead(180.0);
        assert_eq!(met(&front, 0.0, 0.43), Some("number-plate"));
        assert_eq!(met(&front, 0.62, 0.63), Some("headlamp"));
        assert_eq!(met(&front, -0.62, 0.63), Some("headlamp"));
        assert_eq!(met(&front, 0.0, 1.15), Some(GLASS));
        assert_eq!(met(&front, 0.0, 0.80), Some(PAINT));
        assert_eq!(met(&front, 0.8, 0.05), Some("rubber"));
        assert_eq!(met(&front, 0.0, 0.05), None);
        let back = ahead(0.0);
        assert_eq!(met(&back, 0.62, 0.86), Some("tail-lamp"));
        assert_eq!(met(&back, 0.0, 0.72), Some("number-plate"));
    }

    #[test]
    fn light_through_the_windscreen_meets_the_cabin() {
        let scene = ahead(180.0);
        let ray = Ray { origin: [0.0, 0.36, 1.15], direction: [1.0, 0.0, 0.0] };
        let glass = scene.cast(&ray, 0.0, 100.0).unwrap();
        let behind = scene.cast(&ray, glass.range, 100.0).unwrap();
        assert_eq!(scene.materials[behind.material as usize].name, "fabric");
    }
}

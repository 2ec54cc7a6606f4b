//! How many samples fall on the car, and which part of it a field cuts off, from angles alone.
#![allow(clippy::unwrap_used)]

use std::path::Path;

use approx::assert_relative_eq;
use macropulse::design::Design;
use macropulse::points::NO_OBJECT;
use macropulse::scene::Scene;
use macropulse::sim;
use macropulse_study::paper::{DISTANCES, SENSORS, predict};

/// A board as large as the front of a car, 1.82 m × 1.42 m, at the height of the sensor.
fn board(distance: u32) -> Scene {
    let middle = f64::from(distance) + 0.1;
    let text = format!(
        "version = 1\n[sensor]\nposition_m = [0, 0, 2]\n[[object]]\ntarget = true\n\
         material = \"white\"\nposition_m = [{middle}, 0, 2]\n\
         shape.box.size_m = [0.2, 1.82, 1.42]\n"
    );
    Scene::from_toml(&text, "board", Path::new("")).unwrap()
}

/// Table 4 as derived from angles alone, for [`SENSORS`] × [`DISTANCES`].
const TABLE_4: [[f64; 4]; 3] =
    [[3658.0, 1317.0, 672.0, 229.0], [353.0, 127.0, 65.0, 22.0], [172.0, 62.0, 32.0, 0.0]];

#[test]
fn table_4_follows_from_angles() {
    for (sensor, row) in SENSORS.into_iter().zip(TABLE_4) {
        let design = Design::open(sensor, &[]).unwrap();
        for (distance, expected) in DISTANCES.into_iter().zip(row) {
            let predicted = predict(&design, &board(distance)).samples;
            // The table is rounded to whole samples, the silhouette to a 300th of its side.
            assert!(
                (predicted - expected).abs() <= 0.5 + 0.01 * expected,
                "{sensor} at {distance} m: {predicted}, not {expected}"
            );
        }
    }
}

#[test]
fn ten_and_twenty_times_as_many_points_follow_from_the_pitches() {
    let samples = |sensor: &str, distance| {
        predict(&Design::open(sensor, &[]).unwrap(), &board(distance)).samples
    };
    for distance in [30, 50, 70] {
        let ours = samples("kim-park-2016", distance);
        let ratio = ours / samples("hdl-64e", distance);
        assert_relative_eq!(ratio, 10.35, max_relative = 0.01);
        let ratio = ours / samples("peregrine", distance);
        assert_relative_eq!(ratio, 21.3, max_relative = 0.01);
    }
}

/// The lowest sample on the car, in metres above the ground.
fn lowest_on_car(distance: u32) -> f64 {
    let design = Design::open("peregrine", &[]).unwrap();
    let scene = Scene::open(format!("car-{distance}m")).unwrap();
    let cloud = sim::scan(&design, &scene, 1, 0).unwrap().cloud();
    let image = cloud.image(cloud.pick);
    let heights = (0..image.len()).filter_map(|pixel| {
        let seen = image.surface(&cloud, pixel);
        let object = seen.object;
        let (row, column) = (pixel / cloud.columns, pixel % cloud.columns);
        let [_, _, up] = design.directions().of(row as u16, column as u16);
        let height = scene.sensor.at_start().position[2] + up * f64::from(seen.range);
        (object != NO_OBJECT && scene.objects[usize::from(object)].is_target).then_some(height)
    });
    heights.fold(f64::INFINITY, f64::min)
}

/// Peregrine sees tyres partly at 30 m and wholly at 50 m. It thus stands higher than the lower edge of its
/// field drops over 30 m, and the difference is less than a tyre of 0.6 m.
#[test]
fn tyres_are_cut_off_for_a_sensor_between_1_97_and_2_57_m() {
    let edge = 30.0 * (7.5_f64 / 2.0).to_radians().tan();
    assert_relative_eq!(edge, 1.97, max_relative = 3e-3);
    assert_relative_eq!(edge + 0.6, 2.57, max_relative = 3e-3);
    let stands = Scene::open("car-30m").unwrap().sensor.at_start().position[2];
    assert!((edge..edge + 0.6).contains(&stands), "{stands}");
    let (near, far) = (lowest_on_car(30), lowest_on_car(50));
    assert!((stands - edge..0.6).contains(&near), "{near}");
    let row_apart = 50.0 * (7.5_f64 / 32.0).to_radians();
    assert!(far < row_apart, "{far}");
}

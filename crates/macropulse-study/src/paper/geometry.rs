//! How many samples should fall on the car, from angles alone.
//!
//! 1. The silhouette of the target is drawn on a fine grid of directions that has nothing to do
//!    with the sensor's own, inside the sensor's field and range gate.
//! 2. Its solid angle over that of one sample is the count predicted; the box around it gives the
//!    number of rows and columns it spans.
//! 3. A grid may fall on it with one row or column more or less.

use rayon::prelude::*;

use macropulse::design::{Design, Extent};
use macropulse::scene::{Ray, Scene};

/// Steps of the silhouette's grid, each way.
const GRID: usize = 600;

/// Samples on the target, predicted.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Prediction {
    /// Expected number.
    pub samples: f64,
    /// With one row and one column less.
    pub low: f64,
    /// With one row and one column more.
    pub high: f64,
    /// Rows the target spans.
    pub rows: f64,
    /// Columns the target spans.
    pub columns: f64,
    /// How far the target goes on below the field, rad.
    pub cut_off: f64,
}

/// Directions in which a target is looked for, rad.
const AHEAD: Extent = Extent { azimuth: [-0.3, 0.3], elevation: [-0.3, 0.3] };

/// The prediction for the target objects of `scene`.
pub fn predict(design: &Design, scene: &Scene) -> Prediction {
    let field = design.scan.extent();
    let Some((whole, _)) = silhouette(design, scene, AHEAD) else { return Prediction::default() };
    let within = |[from, to]: [f64; 2], [least, most]: [f64; 2]| [from.max(least), to.min(most)];
    let coarse = Extent {
        azimuth: within(AHEAD.azimuth, field.azimuth),
        elevation: within(AHEAD.elevation, field.elevation),
    };
    let rough = Extent {
        azimuth: within(whole.azimuth, field.azimuth),
        elevation: within(whole.elevation, field.elevation),
    };
    let step = |[from, to]: [f64; 2]| (to - from) / GRID as f64;
    let wider = |[from, to]: [f64; 2], by: f64, [least, most]: [f64; 2]| {
        [(from - by).max(least), (to + by).min(most)]
    };
    let fine = Extent {
        azimuth: wider(rough.azimuth, step(coarse.azimuth), coarse.azimuth),
        elevation: wider(rough.elevation, step(coarse.elevation), coarse.elevation),
    };
    let Some((around, filled)) = silhouette(design, scene, fine) else {
        return Prediction::default();
    };
    let cell = step(fine.azimuth) * step(fine.elevation);
    let [across, down] = pitch(design, (around.elevation[0] + around.elevation[1]) / 2.0);
    let columns = (around.azimuth[1] - around.azimuth[0]) / across;
    let rows = (around.elevation[1] - around.elevation[0]) / down;
    let samples = filled as f64 * cell / (across * down);
    let off_by = |by: f64| samples * (1.0 + by / rows).max(0.0) * (1.0 + by / columns).max(0.0);
    let cut_off = (field.elevation[0] - whole.elevation[0]).max(0.0);
    Prediction { samples, low: off_by(-1.0), high: off_by(1.0), rows, columns, cut_off }
}

/// The smallest window around the target, and the number of grid directions that meet it first.
fn silhouette(design: &Design, scene: &Scene, window: Extent) -> Option<(Extent, usize)> {
    let at = |[from, to]: [f64; 2], i: usize| from + (to - from) * (i as f64 + 0.5) / GRID as f64;
    let half = |[from, to]: [f64; 2]| (to - from) / GRID as f64 / 2.0;
    let world_from_sensor = scene.sensor.at_start().world_from_sensor();
    let meets_target = |elevation: f64, azimuth: f64| {
        let (sin_a, cos_a) = libm::sincos(azimuth);
        let (sin_e, cos_e) = libm::sincos(elevation);
        let direction = world_from_sensor.direction([cos_e * cos_a, cos_e * sin_a, sin_e]);
        let ray = Ray { origin: scene.sensor.at_start().position, direction };
        let hit = scene.cast(&ray, design.scan.min_range, design.scan.max_range);
        hit.is_some_and(|hit| scene.objects[usize::from(hit.object)].is_target)
    };
    let (tall, wide) = (half(window.elevation), half(window.azimuth));
    let row = |row: usize| {
        let elevation = at(window.elevation, row);
        let azimuths = (0..GRID).map(|column| at(window.azimuth, column));
        let met: Vec<f64> = azimuths.filter(|&azimuth| meets_target(elevation, azimuth)).collect();
        let around = Extent {
            azimuth: [met.first()? - wide, met.last()? + wide],
            elevation: [elevation - tall, elevation + tall],
        };
        Some((around, met.len()))
    };
    (0..GRID).into_par_iter().filter_map(row).reduce_with(|(a, filled), (b, more)| {
        let both = |a: [f64; 2], b: [f64; 2]| [a[0].min(b[0]), a[1].max(b[1])];
        let around = Extent {
            azimuth: both(a.azimuth, b.azimuth),
            elevation: both(a.elevation, b.elevation),
        };
        (around, filled + more)
    })
}

/// Elevations of the rows of the image, rad, from the top, in the middle column.
pub(super) fn elevations(design: &Design) -> Vec<f64> {
    let column = (design.scan.columns / 2) as u16;
    let elevation = |row| libm::asin(design.directions().of(row, column)[2]);
    (0..design.scan.rows as u16).map(elevation).collect()
}

/// Angles between neighbouring samples, rad, at `elevation`: across and down.
pub(super) fn pitch(design: &Design, elevation: f64) -> [f64; 2] {
    let [right, left] = design.scan.extent().azimuth;
    let elevations = elevations(design);
    let below = elevations.partition_point(|e| *e > elevation).clamp(1, elevations.len() - 1);
    [(left - right) / f64::from(design.scan.columns), elevations[below - 1] - elevations[below]]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A white board of 1.82 × 1.42 m facing the sensor: the numbers of the design tables.
    fn board(distance: f64) -> Scene {
        let text = format!(
            "version = 1\nname = \"board\"\n[sensor]\nposition_m = [0.0, 0.0, 2.0]\n\
             [[object]]\nname = \"board\"\ntarget = true\nmaterial = \"white\"\n\
             position_m = [{}, 0.0, 2.0]\nshape = {{ box = {{ size_m = [0.2, 1.82, 1.42] }} }}\n",
            distance + 0.1
        );
        Scene::from_toml(&text, "board", std::path::Path::new("")).unwrap()
    }

    #[test]
    fn a_board_as_large_as_the_cars_front_gives_the_derived_table() {
        for (sensor, distance, expected) in [
            ("kim-park-2016", 30.0, 3658.0),
            ("kim-park-2016", 120.0, 229.0),
            ("hdl-64e", 50.0, 127.0),
            ("peregrine", 70.0, 31.5),
        ] {
            let design = Design::open(sensor, &[]).unwrap();
            let predicted = predict(&design, &board(distance));
            approx::assert_relative_eq!(predicted.samples, expected, max_relative = 0.015);
            assert!(predicted.low < expected && expected < predicted.high);
        }
    }

    #[test]
    fn beyond_the_range_gate_nothing_is_predicted() {
        let design = Design::open("peregrine", &[]).unwrap();
        assert_eq!(predict(&design, &board(120.0)), Prediction::default());
    }
}

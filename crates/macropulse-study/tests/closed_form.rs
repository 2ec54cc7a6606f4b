//! The whole chain against formulas: walls, spheres and boxes whose ranges are known.
#![allow(clippy::unwrap_used)]

use std::path::Path;

use macropulse::design::Design;
use macropulse::emit::{Band, short_bands};
use macropulse::points::PointCloud;
use macropulse::scene::Scene;
use macropulse::sim;
use macropulse::units::range_from_tof;
use macropulse_study::paper::{PERFECT, SENSORS};

/// Height of the sensor in every scene, m.
const HEIGHT: f64 = 2.0;

/// The sensor called `name` as its file declares it.
fn declared(name: &str) -> Design {
    Design::open(name, &[]).unwrap()
}

/// The same; a coded one with a detector that sees every mark.
fn clear(name: &str) -> Design {
    if !declared(name).is_coded() {
        return declared(name);
    }
    let owned = |&(key, value): &(&str, &str)| (key.to_owned(), value.to_owned());
    Design::open(name, &PERFECT.iter().map(owned).collect::<Vec<_>>()).unwrap()
}

/// Coded sensors are measured in a few lines around the horizon, the others as a whole.
fn measure(design: &Design, scene: &Scene) -> PointCloud {
    let all = short_bands(design, 0);
    let around = |band: &Band| {
        let row = band.first / u64::from(design.scan.columns);
        (234..243).contains(&row) || (270..279).contains(&row)
    };
    let part: Vec<Band> = all.filter(|band| !design.is_coded() || around(band)).collect();
    sim::scan_part(design, scene, 7, &part).unwrap().cloud()
}

fn written(text: &str) -> Scene {
    let text = format!("version = 1\n[sensor]\nposition_m = [0, 0, {HEIGHT}]\n{text}");
    Scene::from_toml(&text, "closed form", Path::new("")).unwrap()
}

/// One pixel that was measured: where it looks, what it should see, and its place in the cloud.
struct Pixel {
    at: usize,
    aim: [f64; 3],
    expected: f64,
}

/// The pixels measured whose shot has light and, by `formula`, meets something at a range from the
/// sensor's nearest to `farthest` metres.
fn pixels(
    design: &Design,
    cloud: &PointCloud,
    farthest: f64,
    formula: impl Fn([f64; 3]) -> Option<f64>,
) -> Vec<Pixel> {
    let measured = (0..cloud.fired_ns.len()).filter(|&at| !cloud.fired_ns[at].is_nan());
    let with_light = measured.filter(|at| {
        let label = if design.is_coded() { at % cloud.columns } else { 0 };
        !design.emission.coding().codebook.marks(label as u16, 0).is_empty()
    });
    let seen = with_light.filter_map(|at| {
        let aim = design.directions().of((at / cloud.columns) as u16, (at % cloud.columns) as u16);
        let expected = formula(aim)?;
        (design.scan.min_range..farthest).contains(&expected).then_some(Pixel { at, aim, expected })
    });
    let pixels: Vec<Pixel> = seen.collect();
    assert!(pixels.len() > 300, "{}: {} pixels", design.name, pixels.len());
    pixels
}

/// Mean and standard deviation.
fn moments(values: &[f64]) -> (f64, f64) {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let square = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>();
    (mean, (square / values.len() as f64).sqrt())
}

/// The range that each pixel shows, NaN without any.
fn ranges(cloud: &PointCloud) -> Vec<f32> {
    cloud.image(cloud.pick).spread(&cloud.range, f32::NAN)
}

/// Range errors of `pixels` that have a return within the sensor's tolerance, and the fraction
/// that do.
fn errors(design: &Design, cloud: &PointCloud, pixels: &[Pixel]) -> (Vec<f64>, f64) {
    let ranges = ranges(cloud);
    let all = pixels.iter().map(|pixel| f64::from(ranges[pixel.at]) - pixel.expected);
    let right: Vec<f64> = all.filter(|error| error.abs() <= design.right_within).collect();
    let fraction = right.len() as f64 / pixels.len() as f64;
    (right, fraction)
}

#[track_caller]
fn assert_measures(design: &Design, cloud: &PointCloud, pixels: &[Pixel]) {
    let (errors, right) = errors(design, cloud, pixels);
    let name = &design.name;
    assert!(right >= 0.999, "{name}: {:.3} % right of {}", 100.0 * right, pixels.len());
    let (mean, sigma) = moments(&errors);
    if design.is_coded() {
        let worst = errors.iter().fold(0.0_f64, |worst, error| worst.max(error.abs()));
        assert!(worst <= 1.5e-3, "{name}: {worst} m");
        assert!(mean.abs() < 0.05e-3, "{name}: mean {mean} m");
    } else {
        assert!(mean.abs() < 0.01, "{name}: mean {mean} m");
        // A return is right within three deviations of what the sensor promises.
        assert!(sigma < design.right_within / 3.0, "{name}: sigma {sigma} m");
    }
}

/// The detector's own jitter, m: no measurement can be better.
fn jitter(design: &Design) -> f64 {
    range_from_tof(design.detector.model().jitter())
}

/// The built-in wall is 50 m ahead.
fn wall(aim: [f64; 3]) -> Option<f64> {
    (aim[0] > 0.0).then(|| 50.0 / aim[0])
}

#[test]
fn a_wall_has_the_range_of_its_formula() {
    let scene = Scene::open("wall").unwrap();
    for name in SENSORS {
        let design = clear(name);
        let cloud = measure(&design, &scene);
        let pixels = pixels(&design, &cloud, 70.0, wall);
        assert_measures(&design, &cloud, &pixels);
        if !design.is_coded() {
            let (errors, _) = errors(&design, &cloud, &pixels);
            let (_, sigma) = moments(&errors);
            assert!(sigma > 0.95 * jitter(&design), "{name}: {sigma} m is too good to be true");
        }
    }
}

#[test]
fn points_lie_on_the_wall_in_the_direction_of_their_pixel() {
    let scene = Scene::open("wall").unwrap();
    for name in SENSORS {
        let design = clear(name);
        let cloud = measure(&design, &scene);
        let mut before = 0;
        let image = cloud.image(cloud.pick);
        for Pixel { at, aim, .. } in pixels(&design, &cloud, 60.0, wall) {
            let Some(at) = image.get(at) else { continue };
            let range = f64::from(cloud.range[at]);
            let point = [cloud.x[at], cloud.y[at], cloud.z[at]].map(f64::from);
            for (value, part) in point.iter().zip(aim) {
                assert!((value - part * range).abs() < 1e-5, "{name}: {point:?}, {aim:?}");
            }
            let off = (point[0] - 50.0).abs();
            if design.is_coded() {
                assert!(off <= 1.5e-3, "{name}: {point:?}");
            }
            before += u32::from(off > design.right_within);
        }
        // A false firing comes before the wall.
        assert!(before < 60, "{name}: {before} points are not on the wall");
    }
}

/// A white sphere, a box square on, and behind them a wall that leans to the left.
const SHAPES: [(&str, [f64; 3]); 3] = [
    ("sphere = { radius_m = 1.5 }", [30.0, 2.0, HEIGHT]),
    ("box = { size_m = [2.0, 3.0, 4.0] }", [41.0, -4.0, HEIGHT]),
    ("plane = { normal = [-0.8, 0.6, 0.0] }", [50.0, 0.0, 0.0]),
];

/// [`SHAPES`] and the sensor, all carried along by a turn to the left and then a shift.
fn shapes(yaw_deg: f64, shift: [f64; 3]) -> Scene {
    let (sin, cos) = yaw_deg.to_radians().sin_cos();
    let carried = |[x, y, z]: [f64; 3]| {
        [cos * x - sin * y + shift[0], sin * x + cos * y + shift[1], z + shift[2]]
    };
    let stand = |place| format!("position_m = {:?}\nyaw_deg = {yaw_deg}\n", carried(place));
    let mut text = format!("version = 1\n[sensor]\n{}", stand([0.0, 0.0, HEIGHT]));
    for (shape, place) in SHAPES {
        text += &format!("[[object]]\nshape = {{ {shape} }}\nmaterial = \"white\"\n");
        text += &stand(place);
    }
    Scene::from_toml(&text, "shapes", Path::new("")).unwrap()
}

/// Returns the distance at which a ray from the sensor meets the nearest of [`SHAPES`].
fn nearest_shape([x, y, z]: [f64; 3]) -> Option<f64> {
    let along = 30.0 * x + 2.0 * y;
    let square = along * along - (30.0_f64.powi(2) + 2.0_f64.powi(2) - 1.5 * 1.5);
    let sphere = (square >= 0.0 && along > 0.0).then(|| along - square.max(0.0).sqrt());
    // The box stands to the right, so the sensor sees its front and its left side.
    let front =
        (x > 0.0).then(|| 40.0 / x).filter(|t| (t * y + 4.0).abs() <= 1.5 && (t * z).abs() <= 2.0);
    let side =
        (y < 0.0).then(|| -2.5 / y).filter(|t| (t * x - 41.0).abs() <= 1.0 && (t * z).abs() <= 2.0);
    let facing = 0.8 * x - 0.6 * y;
    let plane = (facing > 0.0).then(|| 40.0 / facing);
    [sphere, front, side, plane].into_iter().flatten().min_by(f64::total_cmp)
}

#[test]
fn a_sphere_a_box_and_a_leaning_wall_have_the_ranges_of_their_formulas() {
    let scene = shapes(0.0, [0.0; 3]);
    for name in SENSORS {
        let design = clear(name);
        let cloud = measure(&design, &scene);
        let pixels = pixels(&design, &cloud, 60.0, nearest_shape);
        let near = pixels.iter().filter(|pixel| pixel.expected < 42.0).count();
        assert!(near > 100, "{name}: {near} pixels on sphere and box");
        assert_measures(&design, &cloud, &pixels);
    }
}

/// Moving the world and the sensor together changes nothing that the sensor could notice.
#[test]
fn the_place_in_the_world_does_not_matter() {
    let here = shapes(0.0, [0.0; 3]);
    let there = shapes(40.0, [1000.0, -500.0, 20.0]);
    for name in SENSORS {
        let design = declared(name);
        let (a, b) = (measure(&design, &here), measure(&design, &there));
        let farthest = |a: &[f32], b: &[f32]| {
            a.iter().zip(b).fold(0.0_f32, |most, (a, b)| {
                assert_eq!(a.is_nan(), b.is_nan(), "{name}");
                most.max((a - b).abs())
            })
        };
        assert!(a.returns() > 300, "{name}");
        let truth = |cloud: &PointCloud| -> Vec<f32> {
            let image = cloud.image(cloud.pick);
            (0..image.len()).map(|pixel| image.surface(cloud, pixel).range).collect()
        };
        assert!(farthest(&truth(&a), &truth(&b)) < 1e-5, "{name}: truth");
        assert!(farthest(&ranges(&a), &ranges(&b)) < 1e-4, "{name}: range");
        // The world alone must not move, or the comparison is blind.
        let apart = written("[[object]]\nshape.sphere.radius_m = 1.5\nposition_m = [30, 2.1, 2]");
        assert_ne!(measure(&design, &apart).returns(), a.returns(), "{name}");
    }
}

/// Intensity over reflectance is the cosine of the incidence, which for a wall square to the view
/// is the forward part of the direction.
#[test]
fn a_matt_wall_is_as_bright_as_the_cosine_law_says() {
    // The wall of the coded sensor is far and grey: with all marks seen, light cannot be told.
    for (name, distance, material, reflectance) in [
        ("kim-park-2016", 140.0, "grey50", 0.5),
        ("hdl-64e", 30.0, "white", 1.0),
        ("peregrine", 30.0, "white", 1.0),
    ] {
        let design = declared(name);
        let scene = written(&format!(
            "[[object]]\nmaterial = {material:?}\nposition_m = [{distance}, 0, 0]\n\
             shape.plane.normal = [-1, 0, 0]"
        ));
        let cloud = measure(&design, &scene);
        let farthest = distance / 0.9;
        let ahead = |aim: [f64; 3]| (aim[0] > 0.0).then(|| distance / aim[0]);
        let mut by_cosine = [(0.0, 0.0, 0); 5];
        let image = cloud.image(cloud.pick);
        for Pixel { at, aim, expected } in pixels(&design, &cloud, farthest, ahead) {
            let Some(at) = image.get(at) else { continue };
            if (f64::from(cloud.range[at]) - expected).abs() <= design.right_within {
                let bin = &mut by_cosine[((aim[0] - 0.9) * 50.0) as usize];
                *bin = (bin.0 + aim[0], bin.1 + f64::from(cloud.intensity[at]), bin.2 + 1);
            }
        }
        for (cosines, intensities, count) in by_cosine.into_iter().filter(|bin| bin.2 > 100) {
            let ratio = intensities / reflectance / cosines;
            let cosine = cosines / f64::from(count);
            assert!((ratio - 1.0).abs() < 0.03, "{name}: {ratio} at cosine {cosine}, {count}");
        }
        let counted: i32 = by_cosine.iter().map(|bin| bin.2).sum();
        assert!(counted > 1000, "{name}: {counted}");
    }
}

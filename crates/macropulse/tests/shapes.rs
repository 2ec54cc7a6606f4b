//! Shapes of scenes: where rays meet them, worked out a second way.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::path::Path;

use macropulse::scene::{CastRays, Hit, Pose, Ray, Scene, Shape, Solid};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const SHAPES: [Shape; 6] = [
    Shape::Frustum { radii: [0.7, 0.7], half: 1.3 },
    Shape::Frustum { radii: [1.1, 0.0], half: 0.8 },
    Shape::Frustum { radii: [0.4, 1.2], half: 0.9 },
    Shape::Capsule { radius: 0.5, half: 1.1 },
    Shape::Capsule { radius: 0.8, half: 0.0 },
    Shape::Ellipsoid { half: [1.5, 0.6, 0.9] },
];

/// How far a point in the frame of a shape is outside, in no unit: above zero outside, below inside.
fn outside(shape: Shape, [x, y, z]: [f64; 3]) -> f64 {
    match shape {
        Shape::Frustum { radii: [low, high], half } => {
            let wide = low + (high - low) * (z + half) / (2.0 * half);
            (z.abs() - half).max((x * x + y * y).sqrt() - wide)
        }
        Shape::Capsule { radius, half } => {
            let beyond = (z.abs() - half).max(0.0);
            (x * x + y * y + beyond * beyond).sqrt() - radius
        }
        Shape::Ellipsoid { half: [a, b, c] } => {
            (x / a).powi(2) + (y / b).powi(2) + (z / c).powi(2) - 1.0
        }
        other => panic!("{other:?}"),
    }
}

/// Returns the range at which a ray first changes sides between `from` and 12 m on, found by steps of 2 mm
/// and halving.
fn first_change(shape: Shape, pose: &Pose, ray: &Ray, from: f64) -> Option<f64> {
    let local = pose.sensor_from_world();
    let side = |range: f64| {
        let place = [0, 1, 2].map(|axis| ray.origin[axis] + ray.direction[axis] * range);
        outside(shape, local.point(place))
    };
    let steps = (0..6000).map(|step| from + f64::from(step) * 2e-3);
    let at_first = side(from) > 0.0;
    let mut near = steps.into_iter().find(|range| (side(*range + 2e-3) > 0.0) != at_first)?;
    let mut far = near + 2e-3;
    for _ in 0..50 {
        let middle = (near + far) / 2.0;
        match (side(middle) > 0.0) == at_first {
            true => near = middle,
            false => far = middle,
        }
    }
    Some(near)
}

fn unit(chance: &mut ChaCha8Rng) -> [f64; 3] {
    loop {
        let v: [f64; 3] = [0; 3].map(|_| chance.random_range(-1.0..1.0));
        let length = v.iter().map(|part| part * part).sum::<f64>().sqrt();
        if (0.1..1.0).contains(&length) {
            return v.map(|part| part / length);
        }
    }
}

/// Rays at turned shapes, from outside and from inside, meet them where steps find the way from outside to
/// inside. If they meet nothing, there is no such place.
#[test]
fn rays_meet_shapes_where_the_inside_begins() {
    let mut chance = ChaCha8Rng::seed_from_u64(7);
    let (mut met, mut missed) = (0, 0);
    for round in 0..6000 {
        let shape = SHAPES[round % SHAPES.len()];
        let angles = [0; 3].map(|_| chance.random_range(-1.5..1.5));
        let position = [0; 3].map(|_| chance.random_range(-20.0..20.0));
        let pose = Pose::turned(position, angles);
        let solid = Solid::new(shape, pose, 3, 5);
        let direction = unit(&mut chance);
        // From 6 m before the middle or from within, aimed up to 2 m beside it.
        let back = if round % 5 == 0 { chance.random_range(0.0..0.5) } else { 6.0 };
        let beside = unit(&mut chance).map(|part| part * 2.0 * chance.random_range(0.0..1.0));
        let beside = if round % 5 == 0 { [0.0; 3] } else { beside };
        let origin = [0, 1, 2].map(|i| position[i] + beside[i] - back * direction[i]);
        let ray = Ray { origin, direction };
        let expected = first_change(shape, &pose, &ray, 0.0);
        let found = solid.cast(&ray, 0.0, 1e3);
        let (Some(range), Some(Hit { range: found, normal, .. })) = (expected, found) else {
            // A chord shorter than a step may be stepped over.
            let again =
                found.and_then(|hit| solid.cast(&ray, hit.range, 1e3).map(|out| (hit, out)));
            if let Some((enter, leave)) = again {
                assert!(leave.range - enter.range < 4e-3, "{shape:?} {expected:?}");
            } else {
                assert_eq!((expected, found), (None, None), "{shape:?}");
            }
            missed += 1;
            continue;
        };
        met += 1;
        assert!((range - found).abs() < 1e-9, "{shape:?}: {found}, not {range}");
        // The normal points to where it is outside, and has length 1.
        let place = [0, 1, 2].map(|axis| ray.origin[axis] + ray.direction[axis] * found);
        let local = pose.sensor_from_world();
        let [out, within] = [1e-6, -1e-6].map(|step| {
            outside(shape, local.point([0, 1, 2].map(|axis| place[axis] + step * normal[axis])))
        });
        assert!(out > 0.0 && within < 0.0, "{shape:?}: {out} {within}");
        let length = normal.iter().map(|part| part * part).sum::<f64>();
        assert!((length - 1.0).abs() < 1e-12);
    }
    assert!(met > 2500 && missed > 500, "{met} {missed}");
}

/// From a kilometre away a cone is met as exactly as from nearby.
#[test]
fn nothing_cancels_far_away() {
    for shape in SHAPES {
        let solid = Solid::new(shape, Pose::at([0.0; 3]), 0, 0);
        for lift in [-0.7, -0.2, 0.1, 0.4] {
            let direction = [1.0, 0.0, 0.0];
            let [near, far] = [3.0, 3000.0].map(|back| {
                let ray = Ray { origin: [-back, 0.05, lift], direction };
                solid.cast(&ray, 0.0, 1e4).map(|hit| hit.range - back)
            });
            let (Some(near), Some(far)) = (near, far) else {
                assert_eq!(near, far);
                continue;
            };
            assert!((near - far).abs() < 1e-9, "{shape:?} {lift}: {near} {far}");
        }
    }
}

fn scene(object: &str) -> Scene {
    let text = format!("version = 1\n[[object]]\nname = \"thing\"\n{object}\n");
    Scene::from_toml(&text, "test.toml", Path::new("")).unwrap()
}

fn range(scene: &Scene, origin: [f64; 3], direction: [f64; 3]) -> Option<f64> {
    scene.cast(&Ray { origin, direction }, 0.0, 1e3).map(|hit| hit.range)
}

#[test]
fn shapes_of_a_scene_have_their_known_answers() {
    let (ahead, down) = ([1.0, 0.0, 0.0], [0.0, 0.0, -1.0]);
    for (shape, origin, direction, expected) in [
        ("cylinder = { radius_m = 0.5, height_m = 2 }", [0.0; 3], ahead, 9.5),
        ("cylinder = { radius_m = 0.5, height_m = 2 }", [10.3, 0.0, 5.0], down, 4.0),
        // Halfway up, where it is half as wide; at the foot; from above beside the tip.
        ("cone = { radius_m = 1, height_m = 2 }", [0.0; 3], ahead, 9.5),
        ("cone = { radius_m = 1, height_m = 2 }", [0.0, 0.0, -0.99], ahead, 9.005),
        ("cone = { radius_m = 1, height_m = 2 }", [10.5, 0.0, 5.0], down, 5.0),
        ("cone = { radius_m = 1, top_radius_m = 0.5, height_m = 2 }", [0.0; 3], ahead, 9.25),
        ("capsule = { radius_m = 0.5, height_m = 3 }", [0.0; 3], ahead, 9.5),
        ("capsule = { radius_m = 0.5, height_m = 3 }", [10.0, 0.0, 5.0], down, 3.5),
        // 0.3 above the middle of the upper ball.
        ("capsule = { radius_m = 0.5, height_m = 3 }", [0.0, 0.0, 1.3], ahead, 9.6),
        ("ellipsoid = { size_m = [2, 4, 6] }", [0.0; 3], ahead, 9.0),
        ("ellipsoid = { size_m = [2, 4, 6] }", [10.0, 0.0, 5.0], down, 2.0),
    ] {
        let keys = format!("shape = {{ {shape} }}\nposition_m = [10, 0, 0]\nmaterial = \"white\"");
        let found = range(&scene(&keys), origin, direction).unwrap();
        assert!((found - expected).abs() < 1e-12, "{shape}: {found}, not {expected}");
        let resting = scene(&format!("{keys}\nrest_on_ground = true"));
        let lowest = range(&resting, [10.0, 0.0, -5.0], [0.0, 0.0, 1.0]).unwrap();
        assert!((lowest - 5.0).abs() < 1e-12, "{shape}: {lowest}");
    }
}

/// Lying cones and cylinders rest on the lowest point of their rim.
#[test]
fn what_lies_rests_on_the_ground_too() {
    for (shape, pitch) in [
        ("cylinder = { radius_m = 0.5, height_m = 2 }", 90.0),
        ("cone = { radius_m = 0.5, height_m = 2 }", 60.0),
        ("cone = { radius_m = 0.5, height_m = 2 }", 180.0),
        ("capsule = { radius_m = 0.4, height_m = 2 }", 35.0),
        ("ellipsoid = { size_m = [2, 1, 0.5] }", 35.0),
    ] {
        let resting = scene(&format!(
            "shape = {{ {shape} }}\npitch_deg = {pitch}\nrest_on_ground = true\nmaterial = \"white\""
        ));
        let from_below = |step: i32| {
            let x = f64::from(step) * 1e-3;
            range(&resting, [x, 0.0, -5.0], [0.0, 0.0, 1.0])
        };
        let lowest = (-1500..1500).filter_map(from_below).fold(f64::INFINITY, f64::min);
        assert!((5.0..5.0005).contains(&lowest), "{shape}: {lowest}");
    }
}

/// A person of 1.75 m is so tall, looks along x, and is taken along as a whole where it walks.
#[test]
fn a_person_stands_and_walks() {
    let keys = "shape = { person = { height_m = 1.75 } }\nposition_m = [10, 0, 0]";
    let still = scene(keys);
    let names: Vec<&str> = still.materials.iter().map(|known| known.name.as_str()).collect();
    assert_eq!(names, ["fabric", "skin"]);
    let crown = range(&still, [10.0, 0.0, 5.0], [0.0, 0.0, -1.0]).unwrap();
    assert!((crown - 3.25).abs() < 1e-12);
    let at = |scene: &Scene, y: f64, z: f64| range(scene, [0.0, y, z], [1.0, 0.0, 0.0]);
    // Head, trunk, a leg; between the legs; beside the head, beside an arm.
    for (y, z) in [(0.0, 1.65), (0.0, 1.2), (0.09, 0.5)] {
        let found = at(&still, y, z).unwrap();
        assert!((9.8..10.0).contains(&found), "{y} {z}: {found}");
    }
    for (y, z) in [(0.0, 0.3), (0.15, 1.65), (0.32, 1.2)] {
        assert_eq!(at(&still, y, z), None, "{y} {z}");
    }
    // Seen from the side it is narrower.
    let turned = scene(&format!("{keys}\nyaw_deg = 90"));
    assert!(at(&still, 0.2, 1.2).is_some() && at(&turned, 0.2, 1.2).is_none());
    let white = scene(&format!("{keys}\nmaterial = \"white\""));
    assert_eq!(white.materials.len(), 1);
    // It walks: at the beginning it is where it stands.
    let walking = scene(&format!("{keys}\nvelocity_m_s = [0, 1.4, 0]\nyaw_deg = 90"));
    for z in [0.3, 0.5, 1.2, 1.65, 1.749] {
        for y in [-0.2, -0.05, 0.0, 0.05, 0.2] {
            let [moving, standing] = [&walking, &turned].map(|scene| at(scene, y, z));
            match (moving, standing) {
                (Some(moving), Some(standing)) => assert!((moving - standing).abs() < 1e-9),
                (moving, standing) => assert_eq!(moving, standing, "{y} {z}"),
            }
        }
    }
}

#[test]
fn wrong_shapes_are_refused_at_their_place() {
    for (shape, said) in [
        ("cylinder = { radius_m = 0, height_m = 2 }", "`radius_m` must be finite and above zero"),
        ("cylinder = { radius_m = 1, height_m = inf }", "`height_m` must be finite and above zero"),
        (
            "cone = { radius_m = 1, height_m = 1, top_radius_m = 2 }",
            "`top_radius_m` must be from 0",
        ),
        ("capsule = { radius_m = 1, height_m = 1.5 }", "twice its `radius_m` at least"),
        ("ellipsoid = { size_m = [1, 1, -1] }", "each of `size_m` must be finite"),
        ("person = { height_m = 17.5 }", "`height_m` must be from 0.4 to 2.6"),
        ("persn = { height_m = 1.75 }", "did you mean `person`?"),
        ("cone = { radius_m = 1 }", "height_m"),
    ] {
        let text = format!("version = 1\n[[object]]\nshape = {{ {shape} }}\n");
        let told = Scene::from_toml(&text, "test.toml", Path::new("")).err().unwrap().to_string();
        assert!(told.starts_with("test.toml:3:") && told.contains(said), "{shape}: {told}");
    }
}

/// The ready scene of shapes has them all, each met by some shots.
#[test]
fn every_object_of_the_crossing_is_seen() {
    let scene = Scene::open("crossing").unwrap();
    let set = [("scan.raster.rows".to_owned(), "240".to_owned())];
    let design = macropulse::design::Design::open("kim-park-2016-fixed", &set).unwrap();
    let scan = macropulse::sim::scan(&design, &scene, 1, 0).unwrap();
    let cloud = scan.cloud();
    for (index, object) in scene.objects.iter().enumerate() {
        let seen = cloud.truth.returns.object.iter().filter(|o| usize::from(**o) == index).count();
        assert!(seen > 20, "{}: {seen}", object.name);
    }
    assert!(scan.score.right_fraction() > 0.99);
}

//! Scenes from files: where things stand, and what each wrong file leads to.
#![allow(clippy::unwrap_used)]

use crate::tetra;

use std::path::Path;

use macropulse::scene::{Ray, Scene, builtin_names};
use tetra::{MTL, OBJ, folder, object, range_along_x, refusal};

#[test]
fn units_axes_poses_and_copies_put_a_mesh_where_they_say() {
    let files = folder(&[("a.obj", OBJ.as_bytes()), ("tetra.mtl", MTL.as_bytes())]);
    let lowest = |keys: &str| {
        let scene = object(files.path(), &format!("mesh = \"a.obj\"\n{keys}")).unwrap();
        range_along_x(&scene)
    };
    approx::assert_relative_eq!(lowest("position_m = [4, 0, 0]").unwrap(), 13.0);
    approx::assert_relative_eq!(lowest("unit = \"ft\"\nposition_m = [4, 0, 0]").unwrap(), 13.0);
    assert_eq!(lowest("unit = \"mm\""), None);
    // Turned about, the slanting face looks at the ray.
    let turned = lowest("yaw_deg = 180\nposition_m = [0, 0.3, 0]").unwrap();
    approx::assert_relative_eq!(turned, 9.0 - (1.0 - 0.2 - 0.2), max_relative = 1e-12);
    // Its y axis forward, its z axis up: what was left is now forward.
    approx::assert_relative_eq!(lowest("forward = \"y\"\nposition_m = [0, 0.5, 0]").unwrap(), 9.0);
    // Hanging one below its origin, and put back on the ground.
    let resting =
        lowest("up = \"-z\"\nforward = \"x\"\nposition_m = [0, 0.2, 0]\nrest_on_ground = true");
    approx::assert_relative_eq!(resting.unwrap(), 9.0);
    let nearer = lowest("position_m = [4, 0, 0]\ncopies = [{ position_m = [-2, 0, 0] }]");
    approx::assert_relative_eq!(nearer.unwrap(), 7.0);
}

#[test]
fn geometry_far_from_the_origin_keeps_its_millimetres() {
    let vertices = "v 500000.001 0 0\nv 500000.001 2 0\nv 500000.001 0 2\nf 1 2 3\n";
    let files = folder(&[("far.obj", vertices.as_bytes())]);
    let text =
        "version = 1\n[sensor]\nposition_m = [499900, 0, 0]\n[[object]]\nmesh = \"far.obj\"\n";
    let scene = Scene::from_toml(text, "far.toml", files.path()).unwrap();
    let ray = Ray { origin: [499_900.0, 0.5, 0.5], direction: [1.0, 0.0, 0.0] };
    approx::assert_abs_diff_eq!(scene.cast(&ray, 0.0, 1e3).unwrap().range, 100.001, epsilon = 1e-9);
}

#[test]
fn wrong_scene_files_are_refused_at_their_place() {
    let nowhere = Path::new("");
    for (keys, wanted) in [
        ("shape = { sphere = { radius_m = 0 } }", "test.toml:3:9: `radius_m` must be finite"),
        (
            "shape = { sphere = { radius_m = 1 } }\nmaterial = \"asphlat\"",
            "did you mean \"asphalt\"?",
        ),
        ("shape = { spher = { radius_m = 1 } }", "did you mean `sphere`?"),
        (
            "car = {}\nyaw_deg = nan",
            "test.toml:4:11: yaw_deg must be a number from -36000 to 36000",
        ),
        ("car = {}\nposition_m = [inf, 0, 0]", "position_m must be three finite numbers"),
        ("mesh = \"a.obj\"\nmaterial = \"white\"", "cannot be read"),
        ("car = {}\nscale = 2", "`scale` belongs to objects with a `mesh`"),
        (
            "car = {}\nshape = { sphere = { radius_m = 1 } }",
            "exactly one of `mesh`, `car` and `shape`",
        ),
        ("name = \"nothing\"", "exactly one of `mesh`, `car` and `shape`"),
        ("car = {}\nyaw_degrees = 3", "did you mean `yaw_deg`?"),
        ("car = {}\n[[material]]\nname = \"velvet\"", "needs at least `diffuse`"),
        ("car = {}\n[[material]]\nname = \"velvet\"\ndiffuse = 1.5", "it must be from 0 to 1"),
    ] {
        let told = refusal(nowhere, keys);
        assert!(told.contains(wanted), "{keys}: {told}");
    }
    let files = folder(&[("a.obj", OBJ.as_bytes()), ("tetra.mtl", MTL.as_bytes())]);
    let told = refusal(files.path(), "mesh = \"a.obj\"\nscale = 0");
    assert!(told.contains("test.toml:4:9: scale is 0; it must be above zero"), "{told}");
    let told = refusal(files.path(), "mesh = \"a.obj\"\nup = \"x\"\nforward = \"-x\"");
    assert!(told.contains("same axis"), "{told}");
    let told = Scene::from_toml("version = 2\n", "test.toml", nowhere).unwrap_err().to_string();
    assert!(told.contains("write version = 1"), "{told}");
}

#[test]
fn two_objects_of_one_name_are_refused_with_both_places() {
    let named = |names: [&str; 2]| {
        let ball = |name| format!("[[object]]\nname = {name:?}\nshape.sphere.radius_m = 1\n");
        let text = format!(
            "version = 1\nground = {{ material = \"asphalt\" }}\n{}",
            names.map(ball).concat()
        );
        Scene::from_toml(&text, "test.toml", Path::new("")).map_err(|fault| fault.to_string())
    };
    assert_eq!(
        named(["ball", "ball"]).unwrap_err(),
        "test.toml:7:8: another object is called \"ball\" at line 4, column 8; give one of them \
         another name"
    );
    let told = named(["ball", "ground"]).unwrap_err();
    assert!(told.contains("called \"ground\" at line 2, column 23"), "{told}");
    assert!(named(["ball", "Ball"]).is_ok());
}

#[test]
fn built_in_scenes_give_their_known_answers() {
    let ahead = |scene: &Scene, y: f64, z: f64| {
        let ray = Ray { origin: [0.0, y, z], direction: [1.0, 0.0, 0.0] };
        scene.cast(&ray, 0.0, 1e3)
    };
    for (name, distance) in
        [("car-30m", 30.0), ("car-50m", 50.0), ("car-70m", 70.0), ("car-120m", 120.0)]
    {
        let scene = Scene::open(name).unwrap();
        // Nothing of the car is nearer than its front, and its plate lies there.
        let nearest = (0..4000).filter_map(|step| {
            let (y, z) = (f64::from(step % 80) / 40.0 - 1.0, f64::from(step / 80) / 33.0 + 0.01);
            ahead(&scene, y, z).map(|hit| hit.range)
        });
        let nearest = nearest.fold(f64::INFINITY, f64::min);
        approx::assert_abs_diff_eq!(nearest, distance, epsilon = 1e-9);
        assert_eq!(scene.sensor.at_start().position, [0.0, 0.0, 2.05]);
        assert_eq!(scene.objects.iter().filter(|object| object.is_target).count(), 1);
    }
    let wall = Scene::open("wall").unwrap();
    let (azimuth, elevation) = (0.3f64, -0.2f64);
    let direction =
        [azimuth.cos() * elevation.cos(), azimuth.sin() * elevation.cos(), elevation.sin()];
    let hit = wall.cast(&Ray { origin: [0.0, 0.0, 2.0], direction }, 0.0, 1e3).unwrap();
    approx::assert_relative_eq!(hit.range, 50.0 / direction[0], max_relative = 1e-12);
    let street = Scene::open("street").unwrap();
    assert_eq!(ahead(&street, 0.0, 3.0).unwrap().range, 120.0);
    let left = Ray { origin: [20.0, 0.0, 5.0], direction: [0.0, 1.0, 0.0] };
    assert_eq!(street.cast(&left, 0.0, 1e3).unwrap().range, 9.0);
    approx::assert_abs_diff_eq!(ahead(&street, 2.0, 0.43).unwrap().range, 25.0, epsilon = 1e-9);
}

#[test]
fn every_built_in_scene_opens_and_has_a_digest_of_its_own() {
    let digests: Vec<String> =
        builtin_names().map(|name| Scene::open(name).unwrap().digest()).collect();
    let again: Vec<String> =
        builtin_names().map(|name| Scene::open(name).unwrap().digest()).collect();
    assert_eq!(digests, again);
    for (index, digest) in digests.iter().enumerate() {
        assert!(!digests[..index].contains(digest));
    }
}

#[test]
fn an_unknown_scene_is_told_with_the_nearest_name() {
    let told = Scene::open("car30m").map(|scene| scene.name).unwrap_err().to_string();
    assert!(told.contains("did you mean \"car-30m\"?") && told.contains("street"), "{told}");
    let told = Scene::open("gone/scene.toml").map(|scene| scene.name).unwrap_err().to_string();
    assert!(told.contains("gone/scene.toml: cannot be read"), "{told}");
}

/// A box of 2 × 3 × 1 m, as quadrilaterals, about its middle.
fn box_obj() -> String {
    let corner = |index: u32| {
        let side = |bit: u32, half: f64| if index >> bit & 1 == 1 { half } else { -half };
        format!("v {} {} {}\n", side(0, 1.0), side(1, 1.5), side(2, 0.5))
    };
    let faces = "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
    (0..8).map(corner).collect::<String>() + faces
}

/// A sphere of radius 2 m, finely tessellated.
fn sphere_obj(rows: u32) -> String {
    use std::f64::consts::PI;
    let mut text = String::new();
    for index in 0..(rows + 1) * 2 * rows {
        let (row, column) = (f64::from(index / (2 * rows)), f64::from(index % (2 * rows)));
        let (polar, around) = (PI * row / f64::from(rows), PI * column / f64::from(rows));
        let (x, y) = (polar.sin() * around.cos(), polar.sin() * around.sin());
        text += &format!("v {} {} {}\n", 2.0 * x, 2.0 * y, 2.0 * polar.cos());
    }
    for index in 0..rows * 2 * rows {
        let (row, column) = (index / (2 * rows), index % (2 * rows));
        let at = |row: u32, column: u32| row * 2 * rows + column % (2 * rows) + 1;
        let [a, b] = [at(row, column), at(row + 1, column)];
        let [c, d] = [at(row + 1, column + 1), at(row, column + 1)];
        text += &format!("f {a} {b} {c} {d}\n");
    }
    text
}

/// 20 000 rays of seed 5 from all sides, at a body about (10, 0, 0) with a reach of 3 m.
fn rays_from_all_sides() -> impl Iterator<Item = Ray> {
    use rand::{RngExt, SeedableRng};
    let mut chance = rand_chacha::ChaCha8Rng::seed_from_u64(5);
    (0..20_000).map(move |_| {
        let mut around = |reach: f64| [0; 3].map(|_| chance.random_range(-reach..reach));
        let (from, aim) = (around(40.0), around(2.5));
        let way = [aim[0] + 10.0 - from[0], aim[1] - from[1], aim[2] - from[2]];
        let length = way.iter().map(|part| part * part).sum::<f64>().sqrt();
        Ray { origin: from, direction: way.map(|part| part / length) }
    })
}

#[test]
fn meshes_and_formulas_agree() {
    let files =
        folder(&[("box.obj", box_obj().as_bytes()), ("ball.obj", sphere_obj(200).as_bytes())]);
    let pose = "position_m = [10, 0, 0]\nyaw_deg = 30\npitch_deg = 20\nroll_deg = -50\nmaterial = \"white\"";
    let pair = |mesh: &str, shape: &str| {
        [mesh, shape].map(|kind| object(files.path(), &format!("{kind}\n{pose}")).unwrap())
    };
    // The chord of a step of π/200 lies at most this far within the sphere, along its normal.
    let sagitta = 2.0 * (1.0 - (std::f64::consts::PI / 400.0).cos()) * 2.0;
    for (mesh, shape, tolerance, grazing) in [
        ("mesh = \"box.obj\"", "shape = { box = { size_m = [2, 3, 1] } }", 1e-6, 0),
        ("mesh = \"ball.obj\"", "shape = { sphere = { radius_m = 2 } }", sagitta, 10),
    ] {
        let [meshed, exact] = pair(mesh, shape);
        let (mut hits, mut disagreements) = (0, 0);
        for ray in rays_from_all_sides() {
            match (meshed.cast(&ray, 0.0, 1e3), exact.cast(&ray, 0.0, 1e3)) {
                (Some(meshed), Some(exact)) => {
                    hits += 1;
                    let along = |normal: [f64; 3]| {
                        (0..3).map(|axis| normal[axis] * ray.direction[axis]).sum::<f64>()
                    };
                    // Along the normal, not along the ray: a grazing ray stretches any gap.
                    let gap = (meshed.range - exact.range) * along(exact.normal);
                    assert!(gap.abs() < tolerance, "{ray:?} {meshed:?} {exact:?}");
                }
                (None, None) => {}
                _ => disagreements += 1,
            }
        }
        assert!(hits > 3000, "{hits}");
        assert!(disagreements <= grazing, "{mesh}: {disagreements} of {hits}");
    }
}

/// Copies in a row along y, each seen from above; and objects of one mesh are as cheap as copies.
#[test]
fn twenty_thousand_copies_are_met_where_they_stand() {
    let copies: String =
        (1..20_000).map(|i| format!("{{ position_m = [0, {}, 0] }},\n", 4 * i)).collect();
    let scene = object(
        Path::new(""),
        &format!("car = {{}}\nposition_m = [0, 0, 0]\nrest_on_ground = true\ncopies = [{copies}]"),
    )
    .unwrap();
    let one = object(Path::new(""), "car = {}\nposition_m = [0, 0, 0]").unwrap();
    assert_eq!(scene.triangles(), 20_000 * one.triangles());
    let down = |y: f64| Ray { origin: [0.3, y + 0.2, 5.0], direction: [0.0, 0.0, -1.0] };
    let roof = one.cast(&down(0.0), 0.0, 10.0).unwrap().range;
    for copy in [0, 1, 777, 19_999] {
        let range = scene.cast(&down(f64::from(4 * copy)), 0.0, 10.0).unwrap().range;
        assert!((range - roof).abs() < 1e-6, "{copy}: {range}, not {roof}");
    }
    assert_eq!(scene.cast(&down(2.0), 0.0, 10.0), None);
}

#[test]
fn objects_share_a_mesh_only_if_it_is_read_the_same_way() {
    let folder = folder(&[("tetra.obj", OBJ.as_bytes()), ("tetra.mtl", MTL.as_bytes())]);
    let of = |more: [&str; 2]| {
        let object = |more: &str| {
            format!(
                "[[object]]\nmesh = \"tetra.obj\"\nmaterial = \"brick\"\nunit = \"m\"\n{more}\n"
            )
        };
        let text = format!("version = 1\n{}{}", object(more[0]), object(more[1]));
        Scene::from_toml(&text, "test.toml", folder.path()).unwrap()
    };
    let down = |x: f64| Ray { origin: [x + 0.1, 0.1, 9.0], direction: [0.0, 0.0, -1.0] };
    let ranges = |scene: &Scene| {
        [0.0, 20.0].map(|x| scene.cast(&down(x), 0.0, 20.0).map_or(0.0, |hit| hit.range))
    };
    let same = of(["", "position_m = [20, 0, 0]"]);
    let [near, far] = ranges(&same);
    assert!((near - 8.2).abs() < 1e-6 && (far - near).abs() < 1e-6, "{near} {far}");
    let larger = of(["", "position_m = [20, 0, 0]\nscale = 2.0"]);
    let [near, far] = ranges(&larger);
    assert!((near - 8.2).abs() < 1e-6 && (far - 7.2).abs() < 1e-6, "{near} {far}");
    assert_ne!(same.digest(), larger.digest());
    assert_ne!(same.digest(), of(["position_m = [20, 0, 0]", ""]).digest());
}

#[test]
fn rays_in_any_order_have_the_ranges_they_have_alone() {
    let scene = Scene::open("car-50m").unwrap();
    let origin = [0.0, 0.0, 2.0];
    let toward = |azimuth: f64, elevation: f64| {
        let level = elevation.cos();
        [level * azimuth.cos(), level * azimuth.sin(), elevation.sin()]
    };
    let scattered = |index: usize| {
        let [left, up] = [index * 7919 % 2003, index * 104_729 % 1999];
        toward(left as f64 / 2003.0 - 0.5, (up as f64 / 1999.0 - 0.5) * 0.3)
    };
    let in_rows = |index: usize| {
        toward((index % 100) as f64 * 2e-3 - 0.1, (index / 100) as f64 * 2e-3 - 0.06)
    };
    // Lasers in turn, of a head that turns; the last turn is not complete.
    let in_turn = |index: usize| {
        toward((index / 11) as f64 * 5e-4 - 0.1, 0.1 * (index % 11) as f64 / 11.0 - 0.08)
    };
    let alone = |direction: &[f64; 3]| {
        let ray = Ray { origin, direction: *direction };
        scene.cast(&ray, 0.0, 300.0).map_or(f64::INFINITY, |hit| hit.range)
    };
    let orders: [&dyn Fn(usize) -> [f64; 3]; 3] = [&scattered, &in_rows, &in_turn];
    for order in orders {
        let directions: Vec<[f64; 3]> = (0..5003).map(order).collect();
        let ranges = scene.cast_all(origin, &directions, 300.0);
        assert!(directions.iter().map(alone).eq(ranges.iter().copied()));
        let hits = ranges.iter().filter(|range| range.is_finite()).count();
        assert!((500..5000).contains(&hits), "{hits}");
    }
}

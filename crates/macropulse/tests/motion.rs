//! Objects that move, seen by sensors that stand still, and the other way round.
#![allow(clippy::unwrap_used)]

use macropulse::codec::ShotLog;
use macropulse::design::Design;
use macropulse::emit::{Band, scan_begins_fs, short_bands};
use macropulse::formats::{Format, Names, write_cloud};
use macropulse::points::PointCloud;
use macropulse::scene::{Hits, Ray, Scene};
use macropulse::sim;
use macropulse::units::FS_PER_S;
use std::path::Path;

/// Keys of a detector that sees every mark of every echo, and nothing else.
const PERFECT: [(&str, &str); 4] = [
    ("detector.photon-counting.sensitivity.pd", "1.0"),
    ("detector.photon-counting.dark_counts_hz", "0.0"),
    ("detector.photon-counting.jitter_ps", "0.0"),
    ("scan.light_range_m", "150.0"),
];

/// The raster of the paper: 480 rows of 848 columns over 43.2°.
fn raster() -> Design {
    let changes = PERFECT.map(|(key, value)| (key.to_owned(), value.to_owned()));
    Design::open("kim-park-2016-fixed", &changes).unwrap()
}

fn read(text: &str) -> Result<Scene, String> {
    let text = format!("version = 1\nenvironment = \"vacuum-dark\"\n{text}");
    Scene::from_toml(&text, "a.toml", Path::new("")).map_err(|error| error.to_string())
}

fn scene(text: &str) -> Scene {
    read(text).unwrap()
}

/// A plate 20 m ahead whose left edge is 0.2 m to the left when the first scan begins.
fn plate(velocity: f64) -> Scene {
    scene(&format!(
        "[[object]]\nname = \"plate\"\nshape = {{ box = {{ size_m = [0.1, 6, 60] }} }}\n\
         material = \"white\"\nposition_m = [20.05, -2.8, 0]\n\
         velocity_m_s = [0, {velocity:?}, 0]\n"
    ))
}

/// Every `step`-th band of a scan.
fn some_bands(design: &Design, scan: u64, step: usize) -> Vec<Band> {
    short_bands(design, scan).step_by(step).collect()
}

/// For each measured row, the time of its leftmost return, s, and how far to the left it lies, m.
fn left_edge(cloud: &PointCloud) -> Vec<(f64, f64)> {
    let row = |row: usize| {
        let of_row = (0..cloud.returns()).filter(|at| usize::from(cloud.row[*at]) == row);
        let leftmost = of_row.min_by_key(|at| cloud.column[*at])?;
        Some((cloud.time_ns[leftmost] * 1e-9, f64::from(cloud.y[leftmost])))
    };
    (0..cloud.rows).filter_map(row).collect()
}

/// The slope of the line through `points` with the least squares.
fn slope(points: &[(f64, f64)]) -> f64 {
    let count = points.len() as f64;
    let mean = |of: &dyn Fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / count;
    let (x, y) = (mean(&|point| point.0), mean(&|point| point.1));
    mean(&|point| (point.0 - x) * (point.1 - y)) / mean(&|point| (point.0 - x).powi(2))
}

/// Known answer: from row to row the edge moves by v times the time of a row. Over a whole scan
/// the fitted line is as far off as one pixel at most.
#[test]
fn a_plate_that_crosses_is_sheared() {
    let design = raster();
    let pitch = 20.0 * 43.2_f64.to_radians() / 848.0;
    let period = design.scan_period();
    for velocity in [30.0, 0.0, -30.0] {
        let chosen = some_bands(&design, 0, 10);
        let scan = sim::scan_part(&design, &plate(velocity), 7, &chosen).unwrap();
        let edge = left_edge(&scan.cloud());
        assert!(edge.len() >= 40, "{}", edge.len());
        let sheared = slope(&edge) * period;
        assert!((sheared - velocity * period).abs() < pitch, "{velocity} m/s: {sheared} m");
        // The bound tells 30 m/s from none.
        assert!(30.0 * period > 10.0 * pitch);
    }
}

#[test]
fn time_and_motion_run_on_from_scan_to_scan() {
    let (design, scene) = (raster(), plate(30.0));
    let period = design.scan_period();
    let pitch = 20.0 * 43.2_f64.to_radians() / 848.0;
    let scans = [0, 1].map(|number| {
        let chosen = some_bands(&design, number, 24);
        sim::scan_part(&design, &scene, 7, &chosen).unwrap().cloud()
    });
    let [first, second] = scans.each_ref().map(left_edge);
    assert_eq!(first.len(), second.len());
    for (one, other) in first.iter().zip(&second) {
        assert!((other.0 - one.0 - period).abs() < 0.001 * period);
        assert!((other.1 - one.1 - 30.0 * period).abs() < 1.1 * pitch);
    }
    assert_eq!(scan_begins_fs(&design, 0), 0);
    assert!((scan_begins_fs(&design, 3) as f64 - 3e15 * period).abs() < 2.0);
    assert!(scans[1].time_ns[0] >= scan_begins_fs(&design, 1) as f64 * 1e-6 - 0.01);
}

/// Known answer: a point is at x = 50 m less the way made by the time of that point.
#[test]
fn a_sensor_on_its_way_to_a_wall_measures_from_where_it_is() {
    let wall = "[[object]]\nshape = { plane = { normal = [-1, 0, 0] } }\nposition_m = [50, 0, 0]\n\
                material = \"white\"\n[sensor]\nposition_m = [0, 0, 2]\nvelocity_m_s = ";
    let design = raster();
    for velocity in [20.0, 0.0] {
        let scene = scene(&format!("{wall}[{velocity:?}, 0, 0]\n"));
        let chosen = some_bands(&design, 1, 24);
        let cloud = sim::scan_part(&design, &scene, 7, &chosen).unwrap().cloud();
        let returns: Vec<usize> =
            (0..cloud.range.len()).filter(|pixel| !cloud.range[*pixel].is_nan()).collect();
        assert!(returns.len() > 10_000, "{}", returns.len());
        let mut points = Vec::new();
        for pixel in returns {
            let (time, x) = (cloud.time_ns[pixel] * 1e-9, f64::from(cloud.x[pixel]));
            let expected = 50.0 - velocity * time;
            assert!((x - expected).abs() < design.right_within + 1e-5, "{x} {expected}");
            points.push((time, x));
        }
        assert!((slope(&points) + velocity).abs() < 0.05, "{}", slope(&points));
        let way = velocity * design.scan_period();
        assert!((cloud.viewpoint.position[0] - way).abs() < 1e-9);
        assert_eq!(cloud.viewpoint.position[2], 2.0);
        assert_eq!(cloud.viewpoint.turn, [1.0, 0.0, 0.0, 0.0]);
    }
}

#[test]
fn a_sensor_that_turns_sees_the_world_turn_the_other_way() {
    let scene = scene(
        "[[object]]\nshape = { sphere = { radius_m = 0.2 } }\nposition_m = [0, 10, 0]\n\
         material = \"white\"\n[sensor]\nturn_rate_deg_s = 90\n",
    );
    let pose = scene.sensor.at(FS_PER_S);
    let [w, _, _, z] = pose.rotation.quaternion();
    assert!((w - 0.5_f64.sqrt()).abs() < 1e-12 && (z - 0.5_f64.sqrt()).abs() < 1e-12);
    // Straight ahead after one second; to the left before.
    let ahead = pose.world_from_sensor().direction([1.0, 0.0, 0.0]);
    let ray = Ray { origin: [0.0; 3], direction: ahead };
    assert!((scene.cast_at(&ray, FS_PER_S, (0.0, 99.0)).unwrap().range - 9.8).abs() < 1e-9);
}

/// A beam 4 m long and thin, 10 m ahead: first it points at us, then it has turned its side.
#[test]
fn a_thing_that_turns_shows_its_other_side() {
    let scene = scene(
        "[[object]]\nshape = { box = { size_m = [4, 0.2, 2] } }\nposition_m = [10, 0, 0]\n\
         material = \"white\"\nturn_rate_deg_s = -45\n",
    );
    let ahead = Ray { origin: [0.0; 3], direction: [1.0, 0.0, 0.0] };
    let at = |second: i64| scene.cast_at(&ahead, second * FS_PER_S, (0.0, 99.0)).unwrap();
    assert!((at(0).range - 8.0).abs() < 1e-12);
    assert!((at(2).range - 9.9).abs() < 1e-12);
    assert!((at(4).range - 8.0).abs() < 1e-12);
    // A quarter of a turn on: the long side leans by 45°.
    let leaning = at(1);
    assert!((leaning.range - (10.0 - 0.1 * 2_f64.sqrt())).abs() < 1e-12);
    assert!((leaning.normal[0].abs() - 0.5_f64.sqrt()).abs() < 1e-12);
    // To the right seen from above: its near end has gone to the left.
    let beside = Ray { origin: [0.0, 1.0, 0.0], ..ahead };
    assert!(scene.cast_at(&beside, FS_PER_S, (0.0, 99.0)).unwrap().range < 9.0 + 0.2);
}

/// Returns the hits of a log of one shot, fired straight ahead at this time.
fn ahead_at(scene: &Scene, time_fs: i64) -> Hits {
    let design = Design::open("peregrine", &[]).unwrap();
    let log =
        ShotLog { row: vec![16], column: vec![64], ..ShotLog::of_one_channel(&[time_fs], &[0]) };
    scene.trace(&design, &log).middle
}

#[test]
fn light_goes_through_glass_that_moves_and_on_to_what_moves_behind_it() {
    let pane = |keys: &str| {
        scene(&format!(
            "[[object]]\nname = \"pane\"\nshape = {{ box = {{ size_m = [0.01, 2, 2] }} }}\n\
             position_m = [10, 0, 0]\nmaterial = \"glass\"\n{keys}\
             [[object]]\nname = \"wall\"\nshape = {{ box = {{ size_m = [1, 9, 9] }} }}\n\
             position_m = [20.5, 0, 0]\nmaterial = \"white\"\n{keys}"
        ))
    };
    let still = ahead_at(&pane(""), FS_PER_S);
    let moving = pane("velocity_m_s = [5, 0, 0]\n");
    let [first, later] = [0, FS_PER_S].map(|time_fs| ahead_at(&moving, time_fs));
    assert_eq!(still.object, [0, 0, 1], "both faces of the pane and the wall");
    for met in [&first, &later] {
        assert_eq!((&met.object, &met.material), (&still.object, &still.material));
        assert_eq!(met.weight, still.weight);
    }
    assert!(later.weight[2] < 1.0);
    let towards = still.cosine[0];
    for (one, other) in first.range.iter().zip(&later.range) {
        assert!((other - one - 5.0 / f64::from(towards)).abs() < 1e-5);
    }
}

#[test]
fn a_car_that_stands_in_a_fleet_moves_alone() {
    let scene = scene(
        "ground = { material = \"asphalt\" }\n[[object]]\nname = \"cars\"\ncar = {}\n\
         position_m = [20, 0, 0]\nrest_on_ground = true\n\
         copies = [{ position_m = [20, 10, 0] }, \
         { position_m = [20, -10, 0], velocity_m_s = [0, 10, 0], turn_rate_deg_s = 3 }]\n",
    );
    let still = Scene::from_toml(
        "version = 1\n[[object]]\ncar = {}\ncopies = [{}, {}]\n",
        "b.toml",
        Path::new(""),
    );
    assert_eq!(scene.triangles(), still.unwrap().triangles());
    let [moving] = scene.moving.as_slice() else { panic!("{:?}", scene.moving) };
    assert_eq!(moving.name, "cars, copy 2");
    assert!(scene.notes.iter().any(|note| {
        note == "cars, copy 2: moves by (0, 10, 0) m and turns by 3 deg in each second"
    }));
    let met = |y: f64, second: i64| {
        let ray = Ray { origin: [20.0, y, 5.0], direction: [0.0, 0.0, -1.0] };
        let hit = scene.cast_at(&ray, second * FS_PER_S, (0.0, 99.0)).unwrap();
        scene.objects[usize::from(hit.object)].name.as_str()
    };
    let seen = |second: i64| [-10.0, -5.0, 0.0, 5.0, 10.0].map(|y| met(y, second));
    assert_eq!(seen(0), ["cars", "ground", "cars", "ground", "cars"]);
    assert_eq!(seen(3), ["ground", "ground", "cars", "ground", "cars"]);
    assert_eq!(met(20.0, 3), "cars");
}

/// Known answer: a car goes from 10 to 30 m ahead in 2 s, and back faster, where it ends pitched and rolled.
/// Its roof is met where it is at each time. Each pose of it rests on the ground.
#[test]
fn a_car_on_a_path_is_met_where_it_is() {
    let scene = scene(
        "[[object]]\ncar = {}\nrest_on_ground = true\npath = [\
         { time_s = 0, position_m = [10, 0, 0] }, \
         { time_s = 2, position_m = [30, 0, 0] }, \
         { time_s = 3, position_m = [10, 0, 0], yaw_deg = 90, pitch_deg = 5, roll_deg = -3 }]\n",
    );
    let [moving] = scene.moving.as_slice() else { panic!("{:?}", scene.moving) };
    let roof_at = |x: f64, tenths: i64| {
        let ray = Ray { origin: [x, 0.0, 9.0], direction: [0.0, 0.0, -1.0] };
        scene.cast_at(&ray, tenths * FS_PER_S / 10, (0.0, 99.0)).map(|hit| 9.0 - hit.range)
    };
    for (tenths, x) in [(-50, 10.0), (0, 10.0), (5, 15.0), (13, 23.0), (20, 30.0), (25, 20.0)] {
        assert!(roof_at(x, tenths).unwrap() > 1.0 && roof_at(x + 5.0, tenths).is_none(), "{x}");
    }
    // Pitched by 5° and rolled, it stands on one wheel and its middle is lifted.
    assert!(roof_at(10.0, 30).unwrap() > roof_at(10.0, 0).unwrap() + 0.1);
    let turned = moving.motion.at(3 * FS_PER_S).rotation.angles_deg();
    assert!(turned.iter().zip([90.0, 5.0, -3.0]).all(|(one, other)| (one - other).abs() < 1e-9));
}

#[test]
fn a_sensor_on_a_path_looks_where_the_path_turns_it() {
    let scene = scene(
        "[[object]]\nshape = { sphere = { radius_m = 0.2 } }\nposition_m = [0, 10, 0]\n\
         material = \"white\"\n[sensor]\npath = [{ time_s = 0, position_m = [0, 0, 0] }, \
         { time_s = 2, position_m = [0, 4, 0], yaw_deg = 180 }]\n",
    );
    // A quarter of a turn on and 2 m nearer.
    let hits = ahead_at(&scene, FS_PER_S);
    assert!((hits.range[0] - 7.8).abs() < 5e-3, "{:?}", hits.range);
    assert!(ahead_at(&scene, 0).range.is_empty());
}

#[test]
fn the_digest_knows_what_moves() {
    let object = "[[object]]\ncar = {}\nposition_m = [20, 0, 0]\n";
    let digest = |keys: &str, sensor: &str| {
        scene(&format!("{object}{keys}[sensor]\nposition_m = [0, 0, 2]\n{sensor}")).digest()
    };
    let still = digest("", "");
    // A thing whose keys give it no motion stands still.
    assert_eq!(still, digest("velocity_m_s = [0, 0, 0]\nturn_rate_deg_s = 0\n", ""));
    let moving = [
        digest("velocity_m_s = [1, 0, 0]\n", ""),
        digest("velocity_m_s = [0, 1, 0]\n", ""),
        digest("turn_rate_deg_s = 1\n", ""),
        digest("", "velocity_m_s = [1, 0, 0]\n"),
        digest("", "turn_rate_deg_s = 1\n"),
        digest(
            "copies = [{ path = [{ time_s = 0, position_m = [0, 0, 0] }, { time_s = 1, position_m = [0, 0, 0] }] }]\n",
            "",
        ),
        digest(
            "copies = [{ path = [{ time_s = 0, position_m = [0, 0, 0] }, { time_s = 2, position_m = [0, 0, 0] }] }]\n",
            "",
        ),
    ];
    for (index, one) in moving.iter().enumerate() {
        assert_ne!(*one, still);
        assert!(!moving[..index].contains(one));
    }
}

#[test]
fn a_wrong_motion_is_refused_at_its_place() {
    let told = |text: &str| read(text).err().unwrap();
    let message = told("[sensor]\nvelocity_m_s = [1, 2, nan]\n");
    assert!(message.starts_with("a.toml:4:16: velocity_m_s must be three finite"), "{message}");
    let message = told("[sensor]\nvelocity_m_s = [9000, 9000, 0]\n");
    assert!(message.ends_with("10000 m/s together at most"), "{message}");
    let message = told("[[object]]\ncar = {}\nturn_rate_deg_s = 2e5\n");
    assert!(message.starts_with("a.toml:5:19: turn_rate_deg_s is 200000; it must be from -100000"));
    let message = told("[[object]]\ncar = {}\ncopies = [{ turn_rate_deg_s = inf }]\n");
    assert!(message.contains("turn_rate_deg_s is inf"), "{message}");
    let path = |poses: &str| told(&format!("[sensor]\npath = [{poses}]\n"));
    let [first, later] = [0, 1].map(|x| format!("{{ time_s = {x}, position_m = [{x}, 0, 0] }}"));
    assert!(path(&first).ends_with("4:8: `path` needs two poses at least"), "{}", path(&first));
    let message = path(&format!("{later}, {first}"));
    assert!(message.contains("time_s must be later than that of the pose before it"), "{message}");
    let message = path(&format!("{first}, {{ time_s = 1e-5, position_m = [1, 0, 0] }}"));
    assert!(message.contains("it goes 1 m and turns 0 deg in 0.00001 s: 10000 m/s"), "{message}");
    let message = path(&format!("{first}, {{ time_s = 9001, position_m = [1, 0, 0] }}"));
    assert!(message.contains("time_s is 9001; it must be from -100 to 9000"), "{message}");
    let message = told(&format!("[sensor]\nyaw_deg = 3\npath = [{first}, {later}]\n"));
    assert!(message.starts_with("a.toml:4:11: `path` says where it is at every time"), "{message}");
    assert!(message.ends_with("remove `yaw_deg`"), "{message}");
    let message = told("[ground]\nmaterial = \"asphalt\"\nvelocity_m_s = [1, 0, 0]\n");
    assert!(message.starts_with("a.toml:5:16: the ground cannot move"), "{message}");
    let message = told("[[interferers]]\nsensor = \"hdl-64e\"\nvelocity_m_s = [9000, 9000, 0]\n");
    assert!(message.starts_with("a.toml:5:16: velocity_m_s must be three finite"), "{message}");
}

/// Returns the bytes of a scan of the spinning sensor on a pool of `threads` threads.
fn bytes(scene: &Scene, threads: usize) -> Vec<u8> {
    let design = Design::open("hdl-64e", &[]).unwrap();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let scan = pool.install(|| sim::scan(&design, scene, 3, 1).unwrap());
    assert!(scan.cloud().returns() > 1000);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scan.pcd");
    write_cloud(Format::Pcd, &scan.cloud(), &Names::default(), &path).unwrap();
    std::fs::read(path).unwrap()
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let traffic = |sensor: &str| {
        scene(&format!(
            "ground = {{ material = \"asphalt\" }}\n[[object]]\ncar = {{}}\n\
             position_m = [15, 3, 0]\nvelocity_m_s = [-30, 0, 0]\nturn_rate_deg_s = 20\n\
             [[object]]\ncar = {{}}\nposition_m = [12, -4, 0]\n\
             [sensor]\nposition_m = [0, 0, 2]\n{sensor}"
        ))
    };
    let scenes = [traffic(""), traffic("velocity_m_s = [20, 1, 0]\nturn_rate_deg_s = -10\n")];
    let [one, other] = scenes.each_ref().map(|scene| {
        let alone = bytes(scene, 1);
        assert!(bytes(scene, 2) == alone && bytes(scene, 8) == alone);
        alone
    });
    assert!(one != other);
}

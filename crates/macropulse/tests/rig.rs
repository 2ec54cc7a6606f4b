//! Lidars that look at each other, at rest and on the move: energy, rates of hits and times against closed
//! forms, with the optics of their own files.
#![allow(clippy::unwrap_used)]

use std::path::Path;

use glam::{DMat3, DVec3};
use macropulse::channel::{self, Operating, PulseTrains, Seen};
use macropulse::codec::ShotLog;
use macropulse::design::Design;
use macropulse::emit::short_bands;
use macropulse::random::Chance;
use macropulse::scene::{Scene, Traced};
use macropulse::sim;
use macropulse::units::{FS_PER_S, SPEED_OF_LIGHT};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Between the lidars, m.
const DISTANCE: f64 = 50.0;

/// Pixels of the other lidar are this far apart, degrees: 21.8 mm at [`DISTANCE`].
const PITCH_DEG: f64 = 0.025;

/// Side of the image of the other lidar, pixels; an odd number, so that one of them looks straight ahead.
const SIDE: u32 = 81;

/// Scans of the other lidar per second.
const RATE: u32 = 1000;

/// Energy of a shot of every lidar here, nJ. No class is asked for.
const SHOT_NJ: f64 = 0.5;

fn sensor(aperture_mm: f64) -> Design {
    let keys = [
        ("optics.aperture_mm", aperture_mm.to_string()),
        ("light.energy", format!("{{ shot_nj = {SHOT_NJ} }}")),
        ("idealised", "[\"detector-bandwidth\", \"eye-safety\"]".to_owned()),
    ];
    let keys: Vec<_> = keys.map(|(key, value)| (key.to_owned(), value)).into();
    Design::open("kim-park-2016-physical", &keys).unwrap()
}

/// A lidar with an aperture of its own, with `more` keys.
fn other(stand: &str, more: &str) -> String {
    let degrees = PITCH_DEG * f64::from(SIDE);
    format!(
        "[[interferers]]\nsensor = \"kim-park-2016-physical\"\n{stand}\n\
         set = {{ optics.aperture_mm = 90, light.energy = {{ shot_nj = {SHOT_NJ} }}, \
         idealised = [\"detector-bandwidth\", \"eye-safety\"], \
         scan.scans_per_s = {RATE}, scan.raster = {{ rows = {SIDE}, columns = {SIDE}, \
         horizontal_deg = {degrees}, vertical_deg = {degrees}, mirror = \"uniform\" }}, {more} }}\n"
    )
}

fn scene(text: &str) -> Scene {
    let text = format!("version = 1\nenvironment = \"vacuum-dark\"\n{text}");
    Scene::from_toml(&text, "rig", Path::new("")).unwrap()
}

/// The light of interferers that reaches `design` while it listens to shots at these times.
fn arrivals(design: &Design, scene: &Scene, fired_at_fs: &[i64]) -> PulseTrains {
    let log = ShotLog::of_one_channel(fired_at_fs, &vec![0; fired_at_fs.len()]);
    let operating = Operating::of(design, &scene.environment).unwrap();
    let seen = Seen { design, scene, operating: &operating, chance: Chance::new(0) };
    channel::light(&seen, &log, &Traced::default()).trains
}

/// Times so close together that a gate is open throughout `from` … `to`, s.
fn throughout(from: f64, to: f64) -> Vec<i64> {
    let steps = ((to - from) * 1e6) as i64;
    (0..=steps).map(|step| ((from + 1e-6 * step as f64) * FS_PER_S as f64) as i64).collect()
}

/// Photons that a mark of the other lidar of `scene` would make in the detector of `ours` if all of it entered
/// the aperture: E·η/(h·c/λ), from the keys of both files.
fn whole_mark(ours: &Design, scene: &Scene) -> f64 {
    let theirs = &scene.interferers[0].design;
    let coding = theirs.emission.coding();
    let columns = 0..SIDE as u16;
    let marks: usize =
        columns.map(|column| coding.codebook.marks(coding.label_of(column), 1).len()).sum();
    let of_mark = SHOT_NJ * 1e-9 * f64::from(SIDE) / marks as f64;
    let photon = 6.626_070_15e-34 * SPEED_OF_LIGHT / 905e-9;
    assert_eq!(ours.budget.as_ref().unwrap().transmission, 0.7);
    of_mark / photon * 0.7
}

/// Energy is conserved: of all light that the other sends into the solid angle Ω of each pixel, the part on
/// the area A of our aperture enters it. Per scan Σn = n₀·A/(D²·Ω), however wide its beams are.
#[test]
fn the_light_of_a_scan_enters_an_aperture_by_its_area() {
    let stand = format!("position_m = [{DISTANCE}, 0, 0]\nyaw_deg = 180");
    for (aperture_mm, divergence_mrad) in [(25.0, 1.15), (60.0, 1.15), (60.0, 2.5)] {
        let ours = sensor(aperture_mm);
        let scene = scene(&other(&stand, &format!("light.divergence_mrad = {divergence_mrad}")));
        let trains = arrivals(&ours, &scene, &throughout(0.0, 1.0 / f64::from(RATE)));
        let pixel = PITCH_DEG.to_radians() * DISTANCE;
        let area = std::f64::consts::PI * (aperture_mm * 1e-3 / 2.0).powi(2);
        let expected = whole_mark(&ours, &scene) * area / (pixel * pixel);
        let photons: f64 = trains.photons.iter().sum();
        assert!((photons / expected - 1.0).abs() < 1e-3, "{photons} against {expected}");
        // The brightest of them is centred: a²/(a² + b²/2) of a beam of 1/e² radius b enters.
        let brightest = trains.photons.iter().copied().fold(0.0, f64::max);
        let (a, b) = (aperture_mm * 5e-4, 0.5e-3 + DISTANCE * divergence_mrad * 5e-4);
        let share = a * a / (a * a + b * b / 2.0);
        let centred = whole_mark(&ours, &scene) * share;
        assert!((brightest / centred - 1.0).abs() < 1e-3, "{brightest} against {centred}");
    }
}

/// H0: a scan of the other, which stands anywhere within a pixel, hits us with the chance π·s²·ln 2/Δ². A hit
/// is more than half of what a centred one brings, s² = a² + b²/2. N = 300 scans, seed 5, α = 1e-5 (|z| <
/// 4.4). Controls: the aperture of 25 mm of every sensor without a link budget, and that of the other's file.
#[test]
fn an_aperture_is_hit_as_often_as_its_area_says() {
    let (aperture_mm, scans) = (17.0, 300);
    let ours = sensor(aperture_mm);
    let (mut chance, period) = (ChaCha8Rng::seed_from_u64(5), 1.0 / f64::from(RATE));
    let pixel = PITCH_DEG.to_radians() * DISTANCE;
    let mut aside = || pixel * chance.random_range(-0.5..0.5);
    let poses: Vec<String> = (0..scans)
        .flat_map(|scan| {
            let (y, z) = (aside(), aside());
            [0.0, 0.9].map(|part| {
                let time = (f64::from(scan) + part) * period;
                format!("{{ time_s = {time}, position_m = [{DISTANCE}, {y}, {z}], yaw_deg = 180 }}")
            })
        })
        .collect();
    let scene =
        scene(&other(&format!("path = [{}]", poses.join(", ")), "light.divergence_mrad = 0.01"));
    // All shots that can hit fall into the middle of a scan.
    let times: Vec<i64> = (0..scans)
        .flat_map(|scan| {
            let begins = f64::from(scan) * period;
            throughout(begins + 0.47 * period, begins + 0.53 * period)
        })
        .collect();
    let trains = arrivals(&ours, &scene, &times);
    let (a, b) = (aperture_mm * 5e-4, 0.5e-3 + DISTANCE * 0.01 * 5e-4);
    let centred = whole_mark(&ours, &scene) * a * a / (a * a + b * b / 2.0);
    let hits = trains.photons.iter().filter(|photons| **photons > centred / 2.0).count() as f64;
    let z = |radius: f64| {
        let squared = radius * radius + b * b / 2.0;
        let p = std::f64::consts::PI * squared * std::f64::consts::LN_2 / (pixel * pixel);
        let expected = f64::from(scans) * p;
        (hits - expected) / (expected * (1.0 - p).max(0.1)).sqrt()
    };
    assert!(z(a).abs() < 4.4, "{hits} hits, z {}", z(a));
    assert!(z(channel::APERTURE_RADIUS).abs() > 4.4 && z(45e-3).abs() > 4.4);
}

/// A lidar on the move, as this test has it.
struct Mover {
    position: [f64; 3],
    velocity: [f64; 3],
    angles_deg: [f64; 3],
    turn_rate_deg_s: f64,
}

impl Mover {
    fn keys(&self) -> String {
        let [yaw, pitch, roll] = self.angles_deg;
        format!(
            "position_m = {:?}\nvelocity_m_s = {:?}\nyaw_deg = {yaw}\npitch_deg = {pitch}\n\
             roll_deg = {roll}\nturn_rate_deg_s = {}\n",
            self.position, self.velocity, self.turn_rate_deg_s
        )
    }

    /// Its position, and the map of directions from its frame into the world: by angles, not by quaternions.
    fn at(&self, time: f64) -> (DVec3, DMat3) {
        let [yaw, pitch, roll] = self.angles_deg.map(f64::to_radians);
        let yaw = yaw + self.turn_rate_deg_s.to_radians() * time;
        let turned = DMat3::from_rotation_z(yaw)
            * DMat3::from_rotation_y(pitch)
            * DMat3::from_rotation_x(roll);
        (DVec3::from(self.position) + time * DVec3::from(self.velocity), turned)
    }
}

const US: Mover = Mover {
    position: [0.0, 0.0, 1.0],
    velocity: [15.0, 1.0, 0.2],
    angles_deg: [2.0, -3.0, 10.0],
    turn_rate_deg_s: 20.0,
};

/// Three lidars that come towards us, pass us and overtake us.
const OTHERS: [Mover; 3] = [
    Mover {
        position: [50.0, 0.3, 1.2],
        velocity: [-30.0, 2.0, 0.5],
        angles_deg: [180.3, 0.2, 4.0],
        turn_rate_deg_s: -35.0,
    },
    Mover {
        position: [20.0, 2.0, 1.5],
        velocity: [0.0, -25.0, 0.0],
        angles_deg: [185.5, 1.4, -70.0],
        turn_rate_deg_s: 12.0,
    },
    Mover {
        position: [35.0, -1.0, 0.7],
        velocity: [40.0, 0.0, 0.0],
        angles_deg: [178.4, -0.5, 180.0],
        turn_rate_deg_s: 90.0,
    },
];

/// The scene of these of the [`OTHERS`].
fn meeting(others: &[usize]) -> Scene {
    let each = others.iter().map(|which| {
        let phase = *which as f64 * 123_456.7;
        let keys = format!("{}phase_ns = {phase}", OTHERS[*which].keys());
        other(&keys, "light.divergence_mrad = 2.0")
    });
    scene(&format!("[sensor]\n{}{}", US.keys(), each.collect::<String>()))
}

/// Known answer: each shot of each lidar on the move arrives at the time and with the brightness that both
/// poses give at the time of the shot. No other shot arrives.
#[test]
fn light_of_lidars_on_the_move_follows_the_exact_geometry() {
    let ours = sensor(40.0);
    let times = throughout(0.0, 3.0 / f64::from(RATE));
    for (which, mover) in OTHERS.iter().enumerate() {
        let scene = meeting(&[which]);
        let trains = arrivals(&ours, &scene, &times);
        let whole = whole_mark(&ours, &scene);
        let theirs = scene.interferers[0].clone();
        let mut expected = Vec::new();
        for log in theirs.clock.shots(&theirs.design, 0..3 * FS_PER_S / i64::from(RATE)) {
            for shot in 0..log.len() {
                let time = log.fired_at_fs[shot] as f64 / FS_PER_S as f64;
                let ((from, turned), (to, our_frame)) = (mover.at(time), US.at(time));
                let aim = turned
                    * DVec3::from(theirs.design.directions().of(log.row[shot], log.column[shot]));
                let way = to - from;
                let distance = way.length();
                let beside = aim.cross(way).length();
                let (a, b) = (20e-3, 0.5e-3 + distance * 1e-3);
                let squared = a * a + b * b / 2.0;
                let photons = whole * a * a / squared * (-beside * beside / squared).exp();
                let [x, y, z] = (our_frame.transpose() * (-way / distance)).to_array();
                let (azimuth, elevation) = (y.atan2(x), z.asin());
                let in_field = azimuth.abs() < 21.6_f64.to_radians()
                    && elevation.abs() < 12.15_f64.to_radians();
                if aim.dot(way) > 0.0 && beside < 4.0 * squared.sqrt() && in_field {
                    let arrives = log.fired_at_fs[shot] as f64 + distance / SPEED_OF_LIGHT * 1e15;
                    expected.push((log.first.wrapping_add(shot as u64), arrives, photons));
                }
            }
        }
        expected.retain(|(_, _, photons)| *photons > 1e-5);
        let found: Vec<usize> =
            (0..trains.len()).filter(|train| trains.photons[*train] > 1e-5).collect();
        assert!(expected.len() > 50, "{which}: {}", expected.len());
        assert_eq!(found.len(), expected.len(), "{which}");
        for (train, (shot, arrives, photons)) in found.into_iter().zip(expected) {
            assert_eq!(trains.shot[train], shot);
            assert!((trains.arrives_fs[train] as f64 - arrives).abs() < 10.0);
            assert!((trains.photons[train] / photons - 1.0).abs() < 1e-6, "{which}: shot {shot}");
        }
    }
}

/// Three lidars bring the light that each of them brings alone.
#[test]
fn lidars_do_not_change_the_light_of_each_other() {
    let ours = sensor(40.0);
    let times = throughout(0.0, 2.0 / f64::from(RATE));
    let together = arrivals(&ours, &meeting(&[0, 1, 2]), &times);
    for which in 0..3 {
        let alone = arrivals(&ours, &meeting(&[which]), &times);
        assert!(alone.len() > 50, "{which}");
        let of = |trains: &PulseTrains, transmitter: u16| -> Vec<(u64, i64, u64)> {
            let of_it = (0..trains.len()).filter(|at| trains.transmitter[*at] == transmitter);
            of_it
                .map(|at| (trains.shot[at], trains.arrives_fs[at], trains.photons[at].to_bits()))
                .collect()
        };
        assert_eq!(of(&together, which as u16 + 1), of(&alone, 1));
    }
}

/// A rosette goes on from scan to scan, also through the time at which its clock reads 0. It comes by where
/// its prisms turn it, θ_y + i·θ_z = Σ δ·exp(i·(2π·f·t + φ)).
#[test]
fn a_rosette_shines_where_its_prisms_turn_it() {
    let rosette = Design::open("rosette-mid-40", &[]).unwrap();
    let clock = macropulse::emit::Clock { phase_fs: FS_PER_S / 100, drift: 0 };
    let directions = rosette.directions();
    let mut before: Option<([f64; 3], f64)> = None;
    let mut shots = 0;
    for log in clock.shots(&rosette, 0..FS_PER_S / 50) {
        for shot in 0..log.len() {
            let [x, y, z] = directions.of_shot(&log, shot);
            if let Some((last, gap)) = before {
                let step = DVec3::from([x, y, z]).distance(DVec3::from(last));
                assert!(gap == 0.0 || (step - gap).abs() < 0.2 * gap, "{shots}: {step} {gap}");
                before = Some(([x, y, z], step));
            } else {
                before = Some(([x, y, z], 0.0));
            }
            shots += 1;
        }
    }
    assert!(shots > 1000, "{shots}");
    // A raster sees its light on a wall: that of each shot whose point lies in its field.
    let wall = scene(
        "[[object]]\nshape = { plane = { normal = [-1, 0, 0] } }\nposition_m = [30, 0, 0]\n\
         material = \"white\"\n[[interferers]]\nsensor = \"rosette-mid-40\"\n\
         position_m = [0, 2, 0]\nphase_ns = 4e5\n",
    );
    let trains = arrivals(&sensor(25.0), &wall, &throughout(0.0, 1e-3));
    let clock = wall.interferers[0].clock;
    let mut counts = [0; 2];
    for log in clock.shots(&rosette, FS_PER_S / 1_000_000..FS_PER_S / 1001) {
        for shot in 0..log.len() {
            let [x, y, z] = directions.of_shot(&log, shot);
            let (left, up) = (2.0 + 30.0 * y / x, 30.0 * z / x);
            let (azimuth, elevation) = (left.atan2(30.0), up.atan2(left.hypot(30.0)));
            let inside =
                (azimuth.to_degrees().abs() - 21.6).max(elevation.to_degrees().abs() - 12.15);
            let number = log.first.wrapping_add(shot as u64);
            let found = trains.shot.iter().filter(|shot| **shot == number).count();
            if inside.abs() > 0.05 {
                assert_eq!(found, usize::from(inside < 0.0), "{azimuth} {elevation}");
                counts[found] += 1;
            }
        }
    }
    assert!(counts[0] > 5 && counts[1] > 5, "{counts:?}");
}

/// A run among lidars on the move is the same on one thread and on two.
#[test]
fn threads_change_nothing_among_lidars_on_the_move() {
    let design = Design::open("kim-park-2016-fixed", &[]).unwrap();
    let text = "ground = { material = \"asphalt\" }\n[[object]]\ncar = {}\nposition_m = [12, 2, 0]\n\
         velocity_m_s = [-20, 0, 0]\n[sensor]\nposition_m = [0, 0, 2]\nvelocity_m_s = [10, 0, 0]\n\
         [[interferers]]\nsensor = \"kim-park-2016-fixed\"\nposition_m = [10, 1, 2]\n\
         velocity_m_s = [-15, 0.5, 0]\n[[interferers]]\nsensor = \"vlp-16\"\n\
         path = [{ time_s = 0, position_m = [8, 8, 2] }, \
         { time_s = 0.2, position_m = [8, -8, 2], yaw_deg = 90, roll_deg = 5 }]\n";
    let scene = scene(text);
    let part: Vec<_> = short_bands(&design, 0).skip(180).take(4).collect();
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let scan = pool.install(|| sim::scan_part(&design, &scene, 3, &part).unwrap());
        let ranges: Vec<u32> = scan.cloud().range.iter().map(|range| range.to_bits()).collect();
        (ranges, scan.score, scan.tally.interferer_shots, scan.tally.detections)
    };
    let (one, two) = (on(1), on(2));
    assert!(one.2 > 0, "no light of the others was seen");
    assert_eq!(one, two);
}

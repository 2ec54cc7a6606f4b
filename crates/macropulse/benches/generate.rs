//! How long the ticks of a whole scan of `kim-park-2016` take: shot log, echoes, edges, ticks, on
//! one thread. One element is one scan, so that 60 elements a second keep up with the sensor.
//!
//! What the scene makes of the shots is traced beforehand.

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use macropulse::channel;
use macropulse::design::Design;
use macropulse::detect::{Detectors, Memory};
use macropulse::emit::{Band, ShotLog, bands};
use macropulse::random::{Chance, Stage};
use macropulse::scene::{Hits, Material, Scene};
use macropulse::tdc;
use rand::RngExt;

const SEED: u64 = 20_160_913;

/// Conditions: fraction of the marks missed, false edges per second.
const CONDITIONS: [(f64, f64); 9] = [
    (0.0, 0.0),
    (0.05, 0.0),
    (0.2, 0.0),
    (0.4, 0.0),
    (0.0, 1e8),
    (0.0, 1e9),
    (0.2, 1e9),
    (0.0, 1e10),
    (0.2, 1e10),
];

/// What every band of a scan meets.
struct Met {
    materials: Vec<Material>,
    bands: Vec<(Band, Hits)>,
}

impl Met {
    fn by(design: &Design, materials: Vec<Material>, hits: impl Fn(&ShotLog) -> Hits) -> Self {
        // The second scan: its first band has a halo before it.
        let bands = bands(design, 1).map(|band| (band, hits(&band.shot_log(design)))).collect();
        Self { materials, bands }
    }

    fn in_scene(design: &Design, name: &str) -> Option<Self> {
        let scene = Scene::open(name).ok()?;
        Some(Self::by(design, scene.materials.clone(), |log| scene.trace(design, log)))
    }

    /// One white target for every shot, anywhere in the gate: as much overlap as there can be.
    fn anywhere(design: &Design) -> Self {
        Self::by(design, vec![Material::matt("white", 1.0)], |log| {
            let range = |shot: u32| {
                let mut chance = Chance::new(SEED).at(Stage::Firing, log.first + u64::from(shot));
                chance.random_range(design.scan.min_range..design.scan.max_range)
            };
            let shots = log.len();
            Hits {
                shot: (0..shots as u32).collect(),
                weight: vec![1.0; shots],
                range: (0..shots as u32).map(range).collect(),
                cosine: vec![1.0; shots],
                material: vec![0; shots],
                object: vec![0; shots],
            }
        })
    }

    /// The ticks of all bands, counted.
    fn generate(&self, design: &Design, detectors: &Detectors, memory: &mut Memory) -> usize {
        let mut ticks = 0;
        for (band, hits) in &self.bands {
            let log = band.shot_log(design);
            let echoes = channel::echoes(design, &self.materials, hits);
            let found = tdc::ticks(design, detectors.edges(&log, &echoes, memory));
            ticks += black_box(&found).tick.len();
            memory.take_back(found.tick);
        }
        ticks
    }
}

fn design(set: &[(&str, String)]) -> Option<Design> {
    let key =
        |(key, value): &(&str, String)| (format!("detector.photon-counting.{key}"), value.clone());
    Design::open("kim-park-2016", &set.iter().map(key).collect::<Vec<_>>()).ok()
}

fn generate(criterion: &mut Criterion) {
    let Some(declared) = design(&[]) else { return };
    let met = [
        ("car-50m", Met::in_scene(&declared, "car-50m")),
        ("street", Met::in_scene(&declared, "street")),
        ("anywhere", Some(Met::anywhere(&declared))),
    ];
    for (name, met) in &met {
        let Some(met) = met else { continue };
        let mut group = criterion.benchmark_group(format!("generate/{name}"));
        group.throughput(Throughput::Elements(1)).sample_size(10);
        let mut run = |condition: String, design: &Design| {
            let detectors = Detectors::new(design, Chance::new(SEED));
            let mut memory = Memory::default();
            group.bench_function(condition, |bencher| {
                bencher.iter(|| met.generate(design, &detectors, &mut memory));
            });
        };
        run("as declared".to_owned(), &declared);
        for (missed, rate) in CONDITIONS {
            let set = [
                ("sensitivity.pd", "1.0".to_owned()),
                ("jitter_ps", "0.0".to_owned()),
                ("missed_marks", format!("{missed:?}")),
                ("dark_counts_hz", format!("{rate:?}")),
            ];
            if let Some(design) = design(&set) {
                run(format!("{:.0} % missed, {rate:.0e} false per s", 100.0 * missed), &design);
            }
        }
        group.finish();
    }
}

criterion_group!(benches, generate);
criterion_main!(benches);

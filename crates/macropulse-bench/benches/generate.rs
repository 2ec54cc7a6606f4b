//! How long the ticks of a whole scan of `kim-park-2016` take: shot log, echoes, detection events, ticks, on
//! one thread. One element is one scan, so that 60 elements a second keep up with the sensor.
//!
//! What the scene makes of the shots is traced beforehand.

mod common;

use std::hint::black_box;
use std::time::Duration;

use common::{Met, conditions, spread};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use macropulse::design::Design;
use macropulse::detect::{Detectors, Memory};

/// The ticks of all bands, counted.
fn ticks(met: &Met, design: &Design, detectors: &Detectors, memory: &mut Memory) -> usize {
    let mut ticks = 0;
    for band in &met.bands {
        let (_, found) = met.ticks(design, band, (detectors, memory));
        ticks += black_box(&found).tick.len();
        memory.take_back(found.tick);
    }
    ticks
}

fn generate(criterion: &mut Criterion) {
    let Ok(declared) = Design::open("kim-park-2016", &[]) else { return };
    let all = spread(&declared, usize::MAX);
    let met = [
        ("car-50m", Met::in_scene(&declared, &all, "car-50m")),
        ("street", Met::in_scene(&declared, &all, "street")),
        ("anywhere", Some(Met::anywhere(&declared, &all))),
    ];
    for (name, met) in &met {
        let Some(met) = met else { continue };
        let mut group = criterion.benchmark_group(format!("generate/{name}"));
        group.throughput(Throughput::Elements(1)).sample_size(10);
        group.warm_up_time(Duration::from_millis(200)).measurement_time(Duration::from_secs(1));
        for (condition, keys) in conditions() {
            let Ok(design) = Design::open("kim-park-2016", &keys) else { continue };
            let detectors = common::detectors(&design);
            let mut memory = Memory::default();
            group.bench_function(condition, |bencher| {
                bencher.iter(|| ticks(met, &design, &detectors, &mut memory));
            });
        }
        group.finish();
    }
}

criterion_group!(benches, generate);
criterion_main!(benches);

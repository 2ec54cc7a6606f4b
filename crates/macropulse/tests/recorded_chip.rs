//! A real chip and its simulation: histograms of a TMF8820 \[LCSPC\], beside those of `tmf8820` that sees the same
//! objects from the same poses. Runs where the recordings are; says that it was not tested elsewhere.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::fmt::Write as _;
use std::path::Path;

use macropulse::codec::Given;
use macropulse::codec::decode::histogram::coates;
use macropulse::design::Design;
use macropulse::emit::{Band, bands};
use macropulse::scene::Scene;
use macropulse::sim::Scans;
use serde_json::Value;

const BINS: usize = 128;
const ZONES: usize = 9;

/// The histograms of the chip begin this number of bins before the pulse: the one figure that is fitted, to the
/// zones of the pyramid with a single surface.
const BEGINS: f64 = 12.5;

/// Laser pulses of a capture.
const CYCLES: u32 = 4096 * 1024;

/// A zone of a capture.
struct Zone {
    /// Counts of the chip.
    counted: Vec<f64>,
    simulated: Vec<f64>,
    /// Distance of the surfaces in the zone, m, and cosine of incidence, as light weighs them.
    surface: [f64; 2],
    /// True if the chip reports a single surface, and the object or its table fills the zone.
    has_one_surface: bool,
}

/// The corners of the triangles of a binary STL file.
fn corners(file: &Path) -> Vec<[f64; 3]> {
    let bytes = std::fs::read(file).unwrap();
    let number = |at: usize| f64::from(f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()));
    let triangles = u32::from_le_bytes(bytes[80..84].try_into().unwrap()) as usize;
    let corner = |at: usize| [number(at), number(at + 4), number(at + 8)];
    (0..triangles)
        .flat_map(|one| (0..3).map(move |of| 84 + 50 * one + 12 + 12 * of))
        .map(corner)
        .collect()
}

fn floats(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|number| number.as_f64().unwrap()).collect()
}

/// An object as a sensor with this pose sees it, that looks along its z axis: forward is z, left is −y, up is x.
fn seen(corners: &[[f64; 3]], pose: &Value, folder: &Path) -> Scene {
    let rows: Vec<Vec<f64>> = pose.as_array().unwrap().iter().map(floats).collect();
    let mut mesh = String::new();
    for corner in corners {
        let along = |axis: usize| -> f64 {
            (0..3).map(|row| rows[row][axis] * (corner[row] - rows[row][3])).sum()
        };
        writeln!(mesh, "v {} {} {}", along(2), -along(1), along(0)).unwrap();
    }
    for first in (1..=corners.len()).step_by(3) {
        writeln!(mesh, "f {first} {} {}", first + 1, first + 2).unwrap();
    }
    std::fs::write(folder.join("object.obj"), mesh).unwrap();
    let text = "version = 1\nenvironment = \"night\"\n[[material]]\nname = \"paint\"\ndiffuse = 0.5\n\
                [[object]]\nmesh = \"object.obj\"\nmaterial = \"paint\"\n";
    Scene::from_toml(text, "object.toml", folder).unwrap()
}

/// Distance and cosine of what each pixel sees, as light weighs them, and the share of the pixel that is filled.
fn surfaces(scene: &Scene, design: &Design, band: &Band) -> Vec<([f64; 2], f64)> {
    let hits = scene.trace(design, &band.shot_log(design)).middle;
    let mut sums = vec![[0.0; 3]; ZONES];
    for at in 0..hits.shot.len() {
        let weight = f64::from(hits.weight[at]);
        let light = weight / hits.range[at].powi(2);
        let sum = &mut sums[hits.shot[at] as usize];
        *sum = [sum[0] + weight, sum[1] + light, sum[2] + light * f64::from(hits.cosine[at])];
    }
    let surface = |[share, light, lit]: [f64; 3]| ([(share / light).sqrt(), lit / light], share);
    sums.into_iter().map(surface).collect()
}

/// All zones of the captures of a recording, with what the ready sensor counts there.
fn zones(name: &str, object: &str) -> Option<Vec<Zone>> {
    let folder = macropulse_testbed::data_of_others("recorded/tmf8820")?;
    let design = Design::open("tmf8820", &[]).unwrap();
    let band = bands(&design, 0).next().unwrap();
    let text = std::fs::read_to_string(folder.join(name)).unwrap();
    let captures: Vec<Value> = serde_json::from_str(&text).unwrap();
    let corners = corners(&folder.join(object));
    let desk = tempfile::tempdir().unwrap();
    let mut zones = Vec::new();
    for (seed, capture) in (0..).zip(&captures) {
        let scene = seen(&corners, &capture["pose"], desk.path());
        let scans = Scans::new(&design, &scene, seed).unwrap();
        let surfaces = surfaces(&scene, &design, &band);
        let Given::Histograms(histograms) = scans.record(&band).1 else { panic!("no histograms") };
        for zone in 0..ZONES {
            // The chip counts its zones from the left.
            let pixel = zone / 3 * 3 + 2 - zone % 3;
            let (surface, share) = surfaces[pixel];
            let has_one_surface = share > 0.999
                && capture["distances"][0]["depths_2"][zone] == 0
                && capture["distances"][0]["confs_1"][zone].as_u64().unwrap() >= 250;
            zones.push(Zone {
                counted: floats(&capture["hists"][zone]),
                simulated: histograms.of(pixel).iter().map(|count| f64::from(*count)).collect(),
                surface,
                has_one_surface,
            });
        }
    }
    Some(zones)
}

fn highest(counts: &[f64]) -> usize {
    (1..BINS - 1).fold(1, |peak, at| if counts[at] > counts[peak] { at } else { peak })
}

/// The place of the peak of the parabola through the highest bin and its neighbours.
fn peak(counts: &[f64]) -> f64 {
    let highest = highest(counts);
    let [before, top, behind] = [highest - 1, highest, highest + 1].map(|at| counts[at]);
    highest as f64 + 0.5 * (before - behind) / (before - 2.0 * top + behind)
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Counts without those of the background, which the last bins have.
fn signal(counts: &[f64]) -> f64 {
    let background = median(counts[BINS - 20..].iter().copied());
    (counts.iter().sum::<f64>() - BINS as f64 * background).max(1.0)
}

/// Slope and correlation of a straight line through points.
fn line(points: &[(f64, f64)]) -> (f64, f64) {
    let count = points.len() as f64;
    let mean = |of: &dyn Fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / count;
    let (x, y) = (mean(&|point| point.0), mean(&|point| point.1));
    let xx = mean(&|point| (point.0 - x).powi(2));
    let yy = mean(&|point| (point.1 - y).powi(2));
    let xy = mean(&|point| (point.0 - x) * (point.1 - y));
    (xy / xx, xy / (xx * yy).sqrt())
}

/// N = 128 captures of each object, nine zones each. In four of five zones and more, the simulated peak lies
/// within a bin of the recorded one; in nine of ten of those with a single surface. The counts of zones rise and fall
/// together. Control: with the zones of the capture 40 places on, a pose that differs, fewer agree.
#[test]
fn the_simulated_chip_counts_as_the_real_one_does() {
    for (name, object) in [("pyramid.json", "pyramid2.stl"), ("tall_block.json", "tall_block.stl")]
    {
        let Some(zones) = zones(name, object) else { return };
        let share = |on: usize, of: fn(&Zone) -> bool| {
            let agrees = |at: &&usize| {
                let simulated = &zones[(**at + on * ZONES) % zones.len()].simulated;
                let counted = &zones[**at].counted;
                let highest = highest(counted) as f64;
                ((peak(simulated) + BEGINS).round() - highest).abs() <= 1.0
            };
            let all: Vec<usize> = (0..zones.len()).filter(|at| of(&zones[*at])).collect();
            all.iter().filter(agrees).count() as f64 / all.len() as f64
        };
        let both: Vec<(f64, f64)> = zones
            .iter()
            .map(|zone| (signal(&zone.simulated).ln(), signal(&zone.counted).ln()))
            .collect();
        let (slope, correlation) = line(&both);
        let (agree, control) = (share(0, |_| true), share(40, |_| true));
        let single = share(0, |zone| zone.has_one_surface);
        let ratio = both.iter().map(|(simulated, counted)| counted - simulated).sum::<f64>();
        let ratio = (ratio / both.len() as f64).exp();
        let late = |at: usize| {
            let of_zone = zones.iter().skip(at).step_by(ZONES).filter(|zone| zone.has_one_surface);
            median(of_zone.map(|zone| peak(&zone.counted) - peak(&zone.simulated) - BEGINS))
        };
        eprintln!("{name}: zones are late by {:.1?} bins", [0, 1, 2, 3, 4, 5, 6, 7, 8].map(late));
        eprintln!(
            "{name}: {} zones, peaks within a bin {agree:.3}, of single surfaces {single:.3}, of another pose {control:.3}; counts: slope \
             {slope:.2}, correlation {correlation:.2}, {ratio:.2} times as many",
            zones.len()
        );
        assert!(agree > 0.8 && single > 0.9, "{name}: {agree} {single}");
        assert!(control < agree - 0.3, "{name}: {control}");
        assert!(correlation > 0.75 && (0.6..1.2).contains(&slope), "{name}: {correlation} {slope}");
        assert!((0.3..3.0).contains(&ratio), "{name}: {ratio}");
    }
}

/// Slopes of `y` over two variables, each zone of the chip having a level of its own.
fn slopes(points: &[(usize, [f64; 2], f64)]) -> [f64; 2] {
    let mut means = [[0.0; 4]; ZONES];
    for &(zone, [a, b], y) in points {
        for (sum, value) in means[zone].iter_mut().zip([a, b, y, 1.0]) {
            *sum += value;
        }
    }
    let [mut aa, mut ab, mut bb, mut ay, mut by] = [0.0; 5];
    for &(zone, [a, b], y) in points {
        let [sum_a, sum_b, sum_y, count] = means[zone];
        let [a, b, y] = [a - sum_a / count, b - sum_b / count, y - sum_y / count];
        (aa, ab, bb) = (aa + a * a, ab + a * b, bb + b * b);
        (ay, by) = (ay + a * y, by + b * y);
    }
    let determinant = aa * bb - ab * ab;
    [(ay * bb - by * ab) / determinant, (by * aa - ay * ab) / determinant]
}

/// In zones that a single surface of the pyramid fills, simulated counts are as the inverse square of the distance and
/// as the cosine of incidence. The zones of the chip differ in sensitivity by a factor of three. If each has a level of
/// its own, counts of the chip are nearly as the cosine, and fall more slowly with distance. A reason may be that a
/// lens beside the laser does not see all of its light from so near. All counts are corrected for pile-up.
#[test]
fn counts_follow_distance_and_incidence() {
    let Some(zones) = zones("pyramid.json", "pyramid2.stl") else { return };
    let slopes_of = |counts: fn(&Zone) -> &Vec<f64>| {
        let of = |(at, zone): (usize, &Zone)| {
            let [distance, cosine] = zone.surface;
            let counts: Vec<u32> = counts(zone).iter().map(|count| *count as u32).collect();
            let cycles = f64::from(CYCLES);
            let photons: Vec<f64> =
                coates(&counts, CYCLES).iter().map(|of_pulse| of_pulse * cycles).collect();
            (at % ZONES, [distance.ln(), cosine.ln()], signal(&photons).ln())
        };
        let single = zones.iter().enumerate().filter(|(_, zone)| zone.has_one_surface);
        let points: Vec<_> = single.map(of).collect();
        (points.len(), slopes(&points))
    };
    let (count, real) = slopes_of(|zone| &zone.counted);
    let (_, simulated) = slopes_of(|zone| &zone.simulated);
    let [by_distance, by_cosine] = real;
    eprintln!(
        "{count} zones: the chip's counts as R^{by_distance:.2} cos^{by_cosine:.2}, simulated {simulated:.3?}"
    );
    assert!(count > 500);
    assert!(
        (simulated[0] + 2.0).abs() < 0.05 && (simulated[1] - 1.0).abs() < 0.05,
        "{simulated:?}"
    );
    assert!((-2.0..-1.2).contains(&by_distance) && (0.7..1.1).contains(&by_cosine), "{real:?}");
}

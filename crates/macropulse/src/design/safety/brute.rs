//! The search for the worst place against every place of a grid, with beams, shares and runs worked out by
//! other means.

use std::f64::consts::PI;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::*;
use crate::design::Design;

/// The energy that the search allows is at most this share above that of the worst place of a grid.
const TOLERANCE: f64 = 0.02;
/// Places of a grid at most, and shots that are looked at there.
const PLACES: f64 = 1200.0;
const SHOTS: f64 = 1.5e6;

/// A shot: where it goes, when, and how bright it is beside the mean one.
struct Shot {
    beam: [f64; 3],
    time: f64,
    energy: f64,
}

fn shots(design: &Design) -> Vec<Shot> {
    let (scan, coding) = (&design.scan, design.emission.coding());
    let book = &coding.codebook;
    let words = coding.first_word..coding.first_word + coding.word_modulus;
    let marks = |label: u16| words.clone().map(|word| book.marks(label, word as u16).len()).max();
    let by_label: Vec<f64> = (0..book.labels())
        .map(|label| marks(label as u16).unwrap() as f64 / book.mean_weight())
        .collect();
    let shot = |order: u64| {
        let (row, column) = scan.model().pixel(order);
        let energy = by_label[usize::from(coding.label_of(column))];
        Shot { beam: design.directions().of(row, column), time: scan.moment(order), energy }
    };
    (0..design.shots_per_scan()).map(shot).collect()
}

/// Returns a step, and the share of a beam of radius `beam` that falls into a circle of `radius`, by the
/// steps that the beam is off. A step is a 128th of the way to the place beyond which there is no light.
///
/// The share follows from 4096 places. In a beam smaller than the circle they have the same light each, and
/// those within the circle count. Else they are places of the circle with the same area each, and the light
/// there counts.
fn shares(radius: f64, beam: f64) -> (f64, Vec<f64>) {
    let step = (radius + 2.0 * beam) / 128.0;
    let mean = |of_ring: &dyn Fn(f64) -> f64, at: &dyn Fn(f64) -> f64, off: f64| {
        let ring = |ring: u32| {
            let r = of_ring((f64::from(ring) + 0.5) / 64.0);
            let angles = (0..64).map(|sector| (f64::from(sector) + 0.5) / 64.0 * 2.0 * PI);
            angles.map(|angle| at((off + r * angle.cos()).hypot(r * angle.sin()))).sum::<f64>()
        };
        (0..64).map(ring).sum::<f64>() / 4096.0
    };
    let share = |place: u32| {
        let off = f64::from(place) * step;
        match beam {
            // A beam without width passes at the rim, too, and not at once beyond.
            0.0 => 1.0,
            beam if beam < radius => {
                let ring = |part: f64| beam * (-(1.0 - part).ln() / 2.0).sqrt();
                mean(&ring, &|r| f64::from(u8::from(r <= radius)), off)
            }
            beam => {
                let light =
                    |r: f64| 2.0 * (-2.0 * (r / beam).powi(2)).exp() * (radius / beam).powi(2);
                mean(&|part: f64| radius * part.sqrt(), &light, off)
            }
        }
    };
    (step, (0..=128).map(share).collect())
}

/// Returns the energy that each rule about several shots allows if `all` of them cross, each with its time
/// and energy.
fn allowed(
    class: &Class1,
    durations: [f64; 2],
    lasts: f64,
    period: f64,
    all: &[[f64; 2]],
) -> [f64; 4] {
    let judged = |t: f64| t > durations[0] && t <= durations[1];
    let count = all.len();
    let mut least = [f64::INFINITY; 4];
    let together = class.counted_as_one();
    let twice: Vec<[f64; 2]> =
        all.iter().copied().chain(all.iter().map(|[t, e]| [t + period, *e])).collect();
    let once: f64 = all.iter().map(|[_, energy]| energy).sum();
    let groups = together <= period && judged(together);
    let (mut number, mut until) = (0, f64::MIN);
    for [time, _] in all {
        if *time >= until {
            (number, until) = (number + 1, time + together);
        }
    }
    let repeated = (f64::from(number) * 10.0 / period).ceil();
    let c5 = match class {
        Class1::Retina { .. } if repeated > 600.0 => (5.0 * repeated.powf(-0.25)).max(0.4),
        _ => 1.0,
    };
    // Every run, or where these are too many those of a few hundred lengths.
    let stride = (count / 16).max(1);
    for first in 0..count {
        let mut sum = 0.0;
        for last in first..first + count {
            sum += twice[last][1];
            let t = twice[last][0] + lasts - twice[first][0];
            if groups && t <= together {
                least[0] = least[0].min(c5 * class.single_exposure(together) / sum);
            } else if (last - first) % stride == 0 && judged(t) && t <= period {
                least[1] = least[1].min(class.single_exposure(t) / sum);
            } else if t > period {
                break;
            }
            if stride > 1 && first % stride > 0 && !(groups && t <= together) {
                break;
            }
        }
    }
    if let [Some(first), Some(last)] = [all.first(), all.last()] {
        let pass = last[0] - first[0] + lasts;
        // The energy allowed to a scan falls with the number of scans up to 10 s. Beyond, it is tried for one
        // scan more, and for the longest time.
        for end in [10.0, durations[1].min(100.0)] {
            let most = ((end - pass) / period) as u32 + 1;
            for scans in [2, most, most + 1] {
                let t = f64::from(scans - 1) * period + pass;
                if scans > 1 && judged(t) && t <= 100.0 {
                    least[2] = least[2].min(class.single_exposure(t) / (once * f64::from(scans)));
                }
            }
        }
        if durations[1].is_infinite() {
            least[3] = class.single_exposure(100.0) / (once * 100.0 / period);
        }
    }
    least
}

/// Returns the energy that each rule allows at the worst place of a grid, or at the elevations of `only`.
fn brute(design: &Design, condition: Condition, only: Option<&[f64]>) -> [f64; 4] {
    let Design { scan, light, .. } = design;
    let class = Class1::at(light.wavelength).unwrap();
    let all = shots(design);
    let lasts = light.pulse.max(design.emission.length_fs() as f64 * 1e-15);
    let distance = condition.distance;
    let beam = (light.beam_diameter + light.divergence * distance) / 2.0;
    let mut least = [f64::INFINITY; 4];
    for opening in class.openings() {
        let radius = condition.widened * opening.diameter / 2.0;
        let (step, table) = shares(radius, beam);
        let reach = (radius + 2.0 * beam) / distance;
        let angles = |shot: &Shot| {
            let [x, y, z] = shot.beam;
            [y.atan2(x), z.asin()]
        };
        let ends = |axis: usize| {
            let values = all.iter().map(|shot| angles(shot)[axis]);
            values.fold([f64::MAX, f64::MIN], |[a, b], v| [a.min(v), b.max(v)])
        };
        let [mut across, up] = [ends(0), ends(1)];
        // A turning head is alike all around.
        if across[1] - across[0] > 6.0 {
            let step = 2.0 * PI / f64::from(scan.columns);
            across = [0.0, 2.0 * step];
        }
        let area = (across[1] - across[0]) * (up[1] - up[0]);
        let finest = (radius + beam / 2.0) / distance / 10.0;
        let field = 4.0 * (up[1] - up[0]).sin().max(0.01);
        let crossed = all.len() as f64 * (PI * reach * reach / field.min(area.max(1e-9))).min(1.0);
        let places = PLACES.min(SHOTS / crossed.max(1.0));
        let gap = finest.max((area / places).sqrt());
        let line = |[from, to]: [f64; 2]| {
            let steps = ((to - from) / gap).ceil().max(1.0);
            (0..=steps as u32).map(move |step| from + (to - from) * f64::from(step) / steps)
        };
        let elevations: Vec<f64> = only.map_or_else(|| line(up).collect(), <[f64]>::to_vec);
        let smallest = (1.0 + reach * reach).sqrt().recip();
        let mut crossing: Vec<[f64; 2]> = Vec::new();
        for elevation in elevations {
            // Beams of this height, for speed.
            let level = [(elevation - reach).max(-PI / 2.0), (elevation + reach).min(PI / 2.0)];
            let level = level.map(f64::sin);
            let near: Vec<&Shot> =
                all.iter().filter(|shot| (level[0]..=level[1]).contains(&shot.beam[2])).collect();
            for azimuth in line(across) {
                let (up, aside) = (elevation, azimuth);
                let aim = [up.cos() * aside.cos(), up.cos() * aside.sin(), up.sin()];
                crossing.clear();
                for shot in &near {
                    let cosine: f64 = (0..3).map(|axis| aim[axis] * shot.beam[axis]).sum();
                    if cosine >= smallest {
                        let off = distance * (1.0 - cosine * cosine).max(0.0).sqrt() / cosine;
                        let place = off / step;
                        let before = (place as usize).min(127);
                        let part = (place - before as f64).min(1.0);
                        let share = table[before] + part * (table[before + 1] - table[before]);
                        crossing.push([shot.time, share * shot.energy]);
                    }
                }
                crossing.sort_by(|a, b| a[0].total_cmp(&b[0]));
                let here = allowed(&class, opening.durations, lasts, scan.period(), &crossing);
                least = [0, 1, 2, 3].map(|rule| least[rule].min(here[rule]));
            }
        }
    }
    least
}

/// Returns the energy that the search allows: by each rule about several shots, and to one shot alone.
fn found(design: &Design, condition: Condition) -> ([f64; 4], f64) {
    let Design { scan, light, emission, .. } = design;
    let class = Class1::at(light.wavelength).unwrap();
    let sender = Sender { scan, light, emission, condition, count_groups: true };
    let limits = limits(&class, &exposure(&class, &sender));
    let of = |rule: Rule| {
        let limit = limits.iter().find(|limit| limit.rule == rule);
        limit.map_or(f64::INFINITY, |limit| limit.energy)
    };
    let rules = [Rule::Group, Rule::Scan, Rule::Repeated, Rule::Average].map(of);
    (rules, of(Rule::SingleShot))
}

/// By how much more than the grid the search allows, at most; the largest of the rules.
///
/// Each rule counts up to the energy of one shot alone, as that decides then: if a thousandth of two shots
/// crosses at the rim, they may have any energy.
fn excess(design: &Design, conditions: &[Condition]) -> f64 {
    let mut most = f64::MIN;
    for &condition in conditions {
        let ((ours, alone), grid) = (found(design, condition), brute(design, condition, None));
        for (ours, grid) in ours.iter().zip(&grid) {
            most = most.max(ours.min(alone) / grid.min(alone) - 1.0);
        }
    }
    most
}

fn conditions(design: &Design) -> [Condition; 2] {
    [Condition::bare_eye(0.1), Class1::at(design.light.wavelength).unwrap().telescope()]
}

/// A sensor with the scan and the light drawn.
fn drawn(number: u64) -> Design {
    let mut draw = ChaCha8Rng::seed_from_u64(number);
    let mut between = |from: f64, to: f64| draw.random_range(from..to);
    let nm = if number.is_multiple_of(5) { 1550.0 } else { 905.0 };
    let (beam, divergence) = (between(0.8, 12.0), between(0.1, 3.0));
    let (rate, pulse) = (between(5.0, 40.0).round(), between(1.0, 10.0));
    let scan = match number % 4 {
        0 | 1 => {
            let step = between(0.5, 4.0);
            let cycle = 1e6 / rate / (360.0 / step).round();
            let lasers = between(2.0, 12.0) as u32;
            let firing = (cycle / f64::from(lasers)).min(between(0.3, 4.0));
            let aside = if number % 4 == 1 { 4.0 } else { 0.0 };
            let mut elevations: Vec<f64> = (0..lasers).map(|_| between(-8.0, 8.0)).collect();
            elevations.dedup();
            let laser = |elevation: f64| {
                let azimuth = if aside > 0.0 { between(-aside, aside) } else { 0.0 };
                format!("{{ elevation_deg = {elevation}, azimuth_deg = {azimuth} }}")
            };
            let lasers: Vec<String> = elevations.into_iter().map(laser).collect();
            format!(
                "scan.spinning = {{ cycle_us = {cycle}, firing_us = {firing}, lasers = [{}] }}",
                lasers.join(", ")
            )
        }
        2 => {
            let beams = between(1.0, 4.0) as u32;
            let lines = between(2.0, 16.0) as u32;
            let mirror = if between(0.0, 1.0) < 0.5 { "uniform" } else { "sinusoidal" };
            format!(
                "scan.raster = {{ rows = {}, columns = {}, horizontal_deg = {}, vertical_deg = {}, \
                 beams = {beams}, mirror = \"{mirror}\", duty = {} }}",
                beams * lines,
                between(5.0, 80.0) as u32,
                between(1.0, 20.0),
                between(1.0, 20.0),
                between(0.4, 1.0),
            )
        }
        _ => format!(
            "scan.rosette = {{ shots_per_s = {}, prisms = [{{ deflection_deg = {}, turns_per_s = {} }}, \
             {{ deflection_deg = {}, turns_per_s = {} }}] }}",
            (rate * between(100.0, 500.0)).round(),
            between(0.3, 4.0),
            between(20.0, 150.0),
            between(0.3, 4.0),
            -between(20.0, 150.0),
        ),
    };
    let text = format!(
        "version = 1\nname = \"drawn\"\nidealised = [\"mirror-motion\", \"link-budget\", \"eye-safety\", \"detector-bandwidth\", \"inter-chip\"]\nscan.scans_per_s = {rate}\n\
         scan.max_range_m = 30.0\n{scan}\n[light]\nwavelength_nm = {nm}\npulse_ps = {}\n\
         beam_diameter_mm = {beam}\ndivergence_mrad = {divergence}\nfootprint_rays = 7\n[detector.single-stop]\n\
         sensitivity = {{ range_m = 30.0, reflectance = 1.0, pd = 0.9 }}\n[tdc]\nconverters = 64\n\
         resolution_ps = 100.0\nclock_ps = 1000.0\nbits = 10\n[receiver]\nkind = \"direct\"\n",
        pulse * 1000.0
    );
    let design = Design::from_toml(&text, "drawn.toml", std::path::Path::new(""), &[]);
    design.unwrap_or_else(|error| panic!("{error}\n{text}"))
}

/// Sensors of all patterns with such seeds for which more than [`TOLERANCE`] too much is allowed, and by how much.
fn over(seeds: impl Iterator<Item = u64>) -> Vec<(u64, f64)> {
    let excess = seeds.map(|number| {
        let design = drawn(number);
        // Every other one behind a telescope.
        let conditions = conditions(&design);
        let condition = match number {
            2000.. => &conditions[(number / 4 % 2) as usize..][..1],
            _ => &conditions[..],
        };
        (number, excess(&design, condition))
    });
    excess.filter(|(_, over)| *over > TOLERANCE).collect()
}

/// N = 32 sensors, seeds 2000 to 2031, and five that simpler searches allowed too much. From the places of a
/// grid alone these were 1.06, 1.02 and 1.03 times as much. Without places that one more beam grazes it was
/// 1.05, and 1.03 with three places of each rule refined.
#[test]
fn no_place_of_a_grid_allows_less_than_the_search() {
    assert_eq!(over((2000..2032).chain([1, 498, 504, 237, 1667])), []);
}

/// N = 200 sensors, seeds 2000 to 2199.
#[test]
#[ignore = "slow: before a release"]
fn no_place_of_a_grid_allows_less_for_200_sensors() {
    assert_eq!(over(2000..2200), []);
}

#[test]
fn no_place_of_a_grid_allows_less_for_ready_sensors() {
    let ready = [
        "bipolar-gold",
        "coded-16",
        "coded-32",
        "coded-360",
        "coded-practical",
        "hdl-64e",
        "hdl-64e-equal-spacing",
        "kim-park-2016",
        "kim-park-2016-fixed",
        "kim-park-2016-physical",
        "rosette-mid-40",
        "vlp-16",
    ];
    for name in ready {
        let design = Design::open(name, &[]).unwrap();
        let over = excess(&design, &conditions(&design));
        assert!(over <= TOLERANCE, "{name}: {over}");
    }
}

/// Two of six lasers fire 2.3 us apart and look 3.4 degrees apart: between them both cross the eye. Control:
/// at the elevations of lasers alone more than half as much again is allowed.
#[test]
fn the_worst_place_lies_between_two_lasers() {
    let lasers = [15.0, 1.7, -1.7, -12.0, 11.6, -20.0];
    let typed: Vec<String> =
        lasers.iter().map(|elevation| format!("{{ elevation_deg = {elevation:.1} }}")).collect();
    let set = [
        ("scan.spinning.lasers", format!("[{}]", typed.join(", "))),
        ("light.beam_diameter_mm", "2.0".to_owned()),
        ("light.divergence_mrad", "0.5".to_owned()),
    ];
    let set = set.map(|(key, value)| (key.to_owned(), value));
    let design = Design::open("vlp-16", &set).unwrap();
    let eye = Condition::bare_eye(0.1);
    let group = found(&design, eye).0[0];
    assert!((80e-9..87e-9).contains(&group), "{group}");
    let at_lasers = brute(&design, eye, Some(&lasers.map(f64::to_radians)))[0];
    assert!(at_lasers > 1.5 * group, "{at_lasers}");
    let real = Design::open("vlp-16", &[]).unwrap();
    let group = found(&real, eye).0[0];
    assert!(group < 85e-9 && group > 80e-9, "{group}");
}

//! The receiver of histograms against a sensor that exists: histograms of a TMF8820, with its emitted
//! pulse and the distances that the chip works out of them. Runs where the recordings are; says that it was not
//! tested elsewhere.
#![allow(clippy::unwrap_used)]

use macropulse_codec::decode::Returns;
use macropulse_codec::decode::histogram::{
    HistogramMethod, HistogramReceiver, PileUp, Pulse, coates, decode,
};
use macropulse_codec::{Histograms, ShotLog};
use serde_json::Value;

/// Bins of a histogram of this chip.
const BINS: usize = 128;

/// Laser pulses of a measurement: the chip is set to 4096 times 1024.
const CYCLES: u32 = 4096 * 1024;

/// A bin is as long as this times of flight. The chip does not tell it: this is what its distances of
/// zones with one surface ask for, and the one figure that is fitted.
const MM_PER_BIN: f64 = 14.3;

/// A recording: what the chip counted in nine zones of each capture, and what it made of that.
struct Recording {
    counts: Vec<u32>,
    /// Counts of the emitted pulse, mean of all captures.
    emitted: Vec<u32>,
    /// Distances, mm, and confidences of two surfaces in each zone; 0 of one that is not there.
    nearer: Vec<(f64, u64)>,
    farther: Vec<(f64, u64)>,
}

fn numbers(value: &Value) -> Vec<u64> {
    value.as_array().unwrap().iter().map(|number| number.as_u64().unwrap()).collect()
}

impl Recording {
    fn open(name: &str) -> Option<Self> {
        let folder = macropulse_testbed::data_of_others("recorded/tmf8820")?;
        let text = std::fs::read_to_string(folder.join(name)).unwrap();
        let captures: Vec<Value> = serde_json::from_str(&text).unwrap();
        let mut emitted = vec![0; BINS];
        let (mut counts, mut nearer, mut farther) = (Vec::new(), Vec::new(), Vec::new());
        for capture in &captures {
            for (sum, count) in emitted.iter_mut().zip(numbers(&capture["reference_hist"])) {
                *sum += count;
            }
            let zones = capture["hists"].as_array().unwrap();
            counts.extend(zones.iter().flat_map(numbers).map(|count| count as u32));
            let told = &capture["distances"][0];
            for (surfaces, distances, confidences) in
                [(&mut nearer, "depths_1", "confs_1"), (&mut farther, "depths_2", "confs_2")]
            {
                let distances = numbers(&told[distances]).into_iter().map(|mm| mm as f64);
                surfaces.extend(distances.zip(numbers(&told[confidences])));
            }
        }
        let emitted = emitted.iter().map(|sum| (sum / captures.len() as u64) as u32).collect();
        Some(Self { counts, emitted, nearer, farther })
    }

    fn zones(&self) -> usize {
        self.nearer.len()
    }

    fn of(&self, zone: usize) -> &[u32] {
        &self.counts[zone * BINS..(zone + 1) * BINS]
    }

    /// The emitted pulse, without light that wanders in the optics of its reference path: this falls
    /// slowly, and is the exponential that the bins from 50 to 95 lie on. No zone has it.
    fn pulse(&self) -> Pulse {
        let emitted = coates(&self.emitted, CYCLES);
        let points: Vec<(f64, f64)> = (50..95).map(|bin| (bin as f64, emitted[bin].ln())).collect();
        let mean = |of: fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / 45.0;
        let (at, height) = (mean(|point| point.0), mean(|point| point.1));
        let slope = points.iter().map(|(x, y)| (x - at) * (y - height)).sum::<f64>()
            / points.iter().map(|(x, _)| (x - at).powi(2)).sum::<f64>();
        let peak = (0..BINS).max_by(|one, next| emitted[*one].total_cmp(&emitted[*next])).unwrap();
        let slow =
            |bin: usize| if bin < peak { 0.0 } else { (height + slope * (bin as f64 - at)).exp() };
        let counts = (10..45).map(|bin| (emitted[bin] - slow(bin)).max(0.0)).collect();
        // The emitted pulse itself has no way to go.
        Pulse::Measured { counts, origin: -10.0 }
    }

    /// The returns of each zone: distance, mm, and photons.
    fn decoded(&self) -> Vec<Vec<(f64, f64)>> {
        let bin_fs = 95_400;
        let receiver = HistogramReceiver {
            method: HistogramMethod {
                pile_up: PileUp::Coates,
                shape_error: 0.05,
                least_share: 0.005,
                ..HistogramReceiver::new(self.pulse()).method
            },
            gate_fs: (-2 * bin_fs, 45 * bin_fs),
            returns: 8,
            ..HistogramReceiver::new(self.pulse())
        };
        let zones = self.zones();
        let (bins, cycles, counts) = (BINS as u32, vec![CYCLES; zones], self.counts.clone());
        let histograms = Histograms { bin_fs, offset_fs: 0, bins, cycles, counts };
        let log = ShotLog::of_one_channel(&vec![0; zones], &vec![0; zones]);
        let returns: Returns = decode(&receiver, &log, &histograms).unwrap();
        let mut decoded = vec![Vec::new(); zones];
        for at in 0..returns.len() {
            let mm = returns.tof[at] * 1e15 / bin_fs as f64 * MM_PER_BIN;
            decoded[returns.shot[at] as usize].push((mm, f64::from(returns.photons[at])));
        }
        decoded
    }
}

fn median(mut of: Vec<f64>) -> f64 {
    of.sort_by(f64::total_cmp);
    of[of.len() / 2]
}

/// A detector that stops at its first photon counts less background behind a bright echo than before it.
/// In the brightest fifth of the zones of a recording a quarter is missing; Coates gives it back, with
/// the cycles that the chip was set to.
#[test]
fn coates_restores_the_background_of_a_real_sensor() {
    let Some(recording) = Recording::open("tall_block.json") else { return };
    let mut zones: Vec<usize> = (0..recording.zones()).collect();
    zones.sort_by_key(|zone| recording.of(*zone).iter().sum::<u32>());
    let bright = &zones[zones.len() * 4 / 5..];
    let ratio = |of: &[f64]| {
        let mean =
            |bins: std::ops::Range<usize>| of[bins.clone()].iter().sum::<f64>() / bins.len() as f64;
        mean(105..125) / mean(2..11)
    };
    let raw = |counts: &[u32]| counts.iter().map(|count| f64::from(*count)).collect::<Vec<f64>>();
    let counted = median(bright.iter().map(|zone| ratio(&raw(recording.of(*zone)))).collect());
    let corrected =
        median(bright.iter().map(|zone| ratio(&coates(recording.of(*zone), CYCLES))).collect());
    assert!((0.7..0.85).contains(&counted), "{counted}");
    assert!((corrected - 1.0).abs() < 0.03, "{corrected}");
}

/// In zones in which the chip sees one surface, our strongest return is at its distance, from 6 to 18 cm.
#[test]
fn one_surface_is_where_the_chip_says() {
    let Some(recording) = Recording::open("pyramid.json") else { return };
    let decoded = recording.decoded();
    let one = |zone: &usize| recording.nearer[*zone].1 >= 250 && recording.farther[*zone].0 == 0.0;
    let off: Vec<f64> = (0..recording.zones())
        .filter(one)
        .map(|zone| {
            let brighter = |one: &&(f64, f64), next: &&(f64, f64)| one.1.total_cmp(&next.1);
            let strongest = decoded[zone].iter().max_by(brighter).unwrap();
            strongest.0 - recording.nearer[zone].0
        })
        .collect();
    let middle = median(off.clone());
    let spread = 1.4826 * median(off.iter().map(|off| (off - middle).abs()).collect());
    let near = off.iter().filter(|off| off.abs() <= 3.0 * spread).count();
    eprintln!("{} zones: {middle:.2} mm, robust σ {spread:.2} mm, {near} within 3 σ", off.len());
    assert!(off.len() > 500 && middle.abs() < 1.0 && spread < 3.0, "{middle} ± {spread}");
    assert!(near * 100 >= off.len() * 90, "{near} of {}", off.len());
}

/// In most zones in which the chip sees two surfaces within 40 cm, two of our returns are within 20 mm of
/// them. The control takes our returns of another zone.
#[test]
fn two_surfaces_are_where_the_chip_says() {
    for name in ["tall_block.json", "pyramid.json"] {
        let Some(recording) = Recording::open(name) else { return };
        let decoded = recording.decoded();
        let zones = recording.zones();
        let sure =
            |zone: &usize| recording.nearer[*zone].1 >= 250 && recording.farther[*zone].1 >= 250;
        let two: Vec<usize> =
            (0..zones).filter(sure).filter(|zone| recording.farther[*zone].0 < 400.0).collect();
        let share = |on: usize| {
            let agrees = |zone: &&usize| {
                let own = &decoded[(**zone + on) % zones];
                let is_there = |mm: f64| own.iter().any(|(own, _)| (own - mm).abs() < 20.0);
                is_there(recording.nearer[**zone].0) && is_there(recording.farther[**zone].0)
            };
            two.iter().filter(agrees).count() as f64 / two.len() as f64
        };
        let (agree, control) = (share(0), share(3 + 9 * 40));
        eprintln!("{name}: {} zones, {agree:.3} agree, {control:.3} of others", two.len());
        assert!(two.len() > 400 && agree > 0.65, "{name}: {agree}");
        assert!(control < 0.6 * agree, "{name}: {control}");
    }
}

//! A detector that counts photons chip by chip.
//!
//! 1. Every mark of every pulse train is seen with probability (1 − m)·(1 − exp(−n)), n the mean photons
//!    detected per mark and m the fraction lost for other reasons (docs/physics.md#photon-counting).
//! 2. A mark that is seen makes one event at its arrival, displaced by Gaussian jitter.
//! 3. Dark and background counts are Poisson in time.
//!
//! Marks that arrive within one tick make one event in the end: the converters merge them, which is
//! the hard limiter of the coding literature.
//!
//! Echoes are taken in the order in which they begin to arrive. So the events of one follow those of all
//! before it, or are merged with the last few of them.

use super::channel::Channel;
use super::first_photon::FirstPhoton;
use super::jitter::Jitter;
use super::marks::ExactWords;
use super::noise::counts;
use super::{Detections, Kind, Memory};
use crate::channel::{ALL_MARKS, Light, PulseTrains};
use crate::design::detector::PhotonCounting;
use crate::design::{Design, PARTS_OF_TICK};
use crate::kernels::{Macropulse, PAD, Words, append_train, keep_below, merge};
use crate::random::{Address, Chance, Stage};
use crate::units::FS_PER_S;

/// If there is less than one count in this number of events, the counts are put in place one by one, rather
/// than merging all.
const FEW: usize = 64;

/// The detector, and the language of the light it sees.
#[derive(Debug)]
pub(super) struct Counting {
    /// The code words, in parts of a tick.
    words: Words,
    /// The same in ticks, where nothing moves a mark and nothing but marks makes events.
    exact: Option<ExactWords>,
    /// Lit bits of each label, the one sent first the lowest.
    lit: Vec<u32>,
    /// Fraction of the marks that are not missed for another reason than lack of light.
    kept: f64,
    jitter: Option<Jitter>,
    /// Dark counts per second.
    dark: f64,
    /// Detections per photon.
    efficiency: f64,
    /// Length of a micropulse, s.
    pulse: f64,
}

impl Counting {
    pub fn new(counting: &PhotonCounting, design: &Design) -> Self {
        let codebook = &design.emission.coding().codebook;
        let chip = (design.emission.coding().chip_fs / design.clock.tick_fs) as u32;
        let words = |chip: u32| {
            let family = codebook.family();
            let marks = (0..codebook.words()).map(|word| &codebook.word(word as u16).marks[..]);
            Words::new(marks, family.weight(), (chip, family.length()))
        };
        let lit = |label: u32| match codebook.payload() {
            Some(payload) => payload.encode(label as u16).reverse_bits() >> (32 - payload.bits()),
            None => 1,
        };
        let parts = FS_PER_S as f64 / design.clock.tick_fs as f64 * f64::from(PARTS_OF_TICK);
        let is_exact = counting.jitter <= 0.0 && counting.missed_marks <= 0.0;
        let is_exact = is_exact && counting.dark <= 0.0 && !codebook.zeros_are_lit();
        let exact = || ExactWords::of(words(chip), design);
        Self {
            exact: is_exact.then(exact),
            words: words(chip * PARTS_OF_TICK),
            lit: (0..codebook.labels()).map(lit).collect(),
            kept: 1.0 - counting.missed_marks,
            jitter: Jitter::new(counting.jitter * parts),
            dark: counting.dark,
            efficiency: design.efficiency(),
            pulse: design.light.pulse,
        }
    }
}

impl Kind for Counting {
    fn add(&self, channel: &Channel, chance: &Chance, found: &mut Detections, memory: &mut Memory) {
        // The times of the channel alone, so that what is merged is no other channel's.
        let mut before = std::mem::take(&mut found.time);
        let alone = before.is_empty();
        let mut time = if alone { std::mem::take(&mut before) } else { Vec::new() };
        for arrival in channel.order.iter() {
            self.add_train(Seen { channel, chance }, *arrival, &mut time, memory);
        }
        let steady = self.dark + channel.steady();
        counts(steady, channel, chance, &mut memory.noise);
        if memory.noise.len() < time.len() / FEW {
            insert(&mut time, &memory.noise);
        } else if !memory.noise.is_empty() {
            time.extend(PAD);
            memory.noise.extend(PAD);
            merge(&time, &memory.noise, &mut memory.merged, 0);
            std::mem::swap(&mut time, &mut memory.merged);
        }
        if alone {
            found.time = time;
        } else {
            before.extend_from_slice(&time);
            found.time = before;
        }
    }

    fn marks(&self, order: &[u64], light: &Light) -> Option<(&ExactWords, Vec<Macropulse>)> {
        let exact = self.exact.as_ref()?;
        let (trains, background) = (&light.trains, &light.background);
        let is_certain = |photons: &f64| photons * self.efficiency >= PLAIN;
        let is_exact = background.steady <= 0.0
            && background.per_s.iter().all(|rate| *rate <= 0.0)
            && trains.transmitter.iter().all(|transmitter| *transmitter == 0)
            && trains.marks.iter().all(|marks| *marks == ALL_MARKS)
            && trains.photons.iter().all(is_certain);
        let parts = PARTS_OF_TICK.trailing_zeros();
        let macropulse = |arrival: &u64| {
            self.macropulse(trains, *arrival as u32 as usize, (arrival >> 32) as u32 >> parts)
        };
        is_exact.then(|| (exact, order.iter().map(macropulse).collect()))
    }
}

/// A mark of this number of detected photons is always seen: the probability that it is not is far below
/// 2⁻³², the resolution of the draws.
const PLAIN: f64 = 40.0;

/// The part of a band that the detector of a channel is given, and its chance.
#[derive(Clone, Copy)]
struct Seen<'a> {
    channel: &'a Channel<'a>,
    chance: &'a Chance,
}

impl Counting {
    /// Returns pulse train `index`, a whole macropulse of the sensor's own, as one that begins at `start`.
    #[inline]
    fn macropulse(&self, trains: &PulseTrains, index: usize, start: u32) -> Macropulse {
        let lit = self.lit[usize::from(trains.label[index])];
        Macropulse { start, word: trains.word[index], lit }
    }

    /// Adds the events of one pulse train to `time`.
    fn add_train(
        &self,
        Seen { channel, chance }: Seen,
        arrival: u64,
        time: &mut Vec<u32>,
        memory: &mut Memory,
    ) {
        let (start, index) = ((arrival >> 32) as u32, arrival as u32 as usize);
        let (light, trains) = (channel.light, &channel.light.trains);
        let photons = channel.detected(index);
        // The rounding of this difference is far below 2⁻³², the resolution of the draws.
        let detected = if photons.is_infinite() { 1.0 } else { 1.0 - libm::exp(-photons) };
        let seen = Bernoulli::new(self.kept * detected);
        if seen.is_never() {
            return;
        }
        let from = time.len();
        let transmitter = usize::from(trains.transmitter[index]);
        let is_own = transmitter == 0;
        let is_whole = trains.marks[index] == ALL_MARKS;
        if is_own && is_whole && !channel.design.emission.coding().codebook.zeros_are_lit() {
            append_train(&self.words.train(&self.macropulse(trains, index, start)), time);
        } else {
            let counted = channel.arrivals(index, &mut memory.arrivals);
            time.extend(counted.iter().map(|time| *time as u32));
        }
        let first = FirstPhoton::of(photons, light.transmitters[transmitter].pulse, self.pulse);
        if seen.is_certain() && self.jitter.is_none() && first.is_none() {
            return join(time, from, memory);
        }
        let index = trains.address(index);
        let address = |stage| Address { stage, index, part: 0 };
        let numbers = &mut memory.numbers;
        if let Some(first) = first {
            let numbers = chance.draw(address(Stage::Marks), time.len() - from, numbers);
            let mut kept = from;
            for place in from..time.len() {
                let number = numbers[place - from];
                if u64::from(number) < seen.threshold {
                    let late = channel.clock.parts(first.late_fs(number, seen.threshold));
                    time[kept] = (i64::from(time[place]) + late).max(0) as u32;
                    kept += 1;
                }
            }
            time.truncate(kept);
            time[from..].sort_unstable();
        } else if !seen.is_certain() {
            let numbers = chance.draw(address(Stage::Marks), time.len() - from, numbers);
            keep_below(time, from, numbers, seen.threshold as u32);
        }
        if let Some(jitter) = &self.jitter {
            let numbers = chance.draw(address(Stage::Jitter), time.len() - from, numbers);
            jitter.delay(&mut time[from..], numbers);
        }
        join(time, from, memory);
    }
}

/// Puts each of `few` in its place among `time`; both ascend.
fn insert(time: &mut Vec<u32>, few: &[u32]) {
    let mut end = time.len();
    time.resize(end + few.len(), 0);
    for (before, &event) in few.iter().enumerate().rev() {
        let place = time[..end].partition_point(|other| *other <= event);
        time.copy_within(place..end, place + before + 1);
        time[place + before] = event;
        end = place;
    }
}

/// Makes one ascending row of the two that meet at `from`.
fn join(time: &mut Vec<u32>, from: usize, memory: &mut Memory) {
    let (Some(last), Some(&first)) = (time[..from].last(), time.get(from)) else { return };
    if *last <= first {
        return;
    }
    let mut reach = 64;
    while reach < from && time[from - reach] > first {
        reach *= 2;
    }
    let near = from.saturating_sub(reach);
    let meet = near + time[near..from].partition_point(|time| *time <= first);
    for (row, times) in
        [(&mut memory.earlier, &time[meet..from]), (&mut memory.later, &time[from..])]
    {
        row.clear();
        row.extend_from_slice(times);
        row.extend(PAD);
    }
    merge(&memory.earlier, &memory.later, time, meet);
}

/// A yes/no question of fixed probability, asked with 32 random bits each time.
#[derive(Clone, Copy)]
struct Bernoulli {
    threshold: u64,
}

impl Bernoulli {
    fn new(probability: f64) -> Self {
        let all = 4_294_967_296.0;
        Self {
            threshold: if probability < 1.0 { (probability * all + 0.5) as u64 } else { 1 << 32 },
        }
    }

    fn is_certain(self) -> bool {
        self.threshold >= 1 << 32
    }

    fn is_never(self) -> bool {
        self.threshold == 0
    }
}

#[cfg(test)]
mod tests {
    use super::super::Detectors;
    use super::*;
    use crate::channel::{Echo, Light, light_of_echoes};
    use macropulse_codec::ShotLog;

    fn sensor(set: &[(&str, &str)]) -> Design {
        let set: Vec<(String, String)> = set
            .iter()
            .map(|(key, value)| (format!("detector.photon-counting.{key}"), (*value).to_owned()))
            .collect();
        Design::open("kim-park-2016", &set).unwrap()
    }

    /// The log of the first four lines, the most that have room in a band.
    fn four_lines(design: &Design) -> ShotLog {
        crate::emit::Band { scan: 0, first: 0, shots: 4 * 848 }.shot_log(design)
    }

    fn detect(design: &Design, log: &ShotLog, light: &Light, seed: u64) -> Detections {
        Detectors::in_the_dark(design, Chance::new(seed)).detections(
            log,
            light,
            &mut Memory::default(),
        )
    }

    /// An echo of each shot of `log`.
    fn all<'a>(design: &'a Design, log: &ShotLog, delay_fs: i64, photons: f64) -> Light<'a> {
        let echo = |shot| Echo { shot, delay_fs, photons };
        light_of_echoes(design, log, (0..log.len()).map(echo))
    }

    fn run(design: &Design, photons: f64, seed: u64) -> Detections {
        let log = four_lines(design);
        detect(design, &log, &all(design, &log, 200_000_000, photons), seed)
    }

    fn marks(design: &Design) -> usize {
        let log = four_lines(design);
        (0..log.len())
            .map(|i| design.emission.coding().codebook.marks(log.label[i], log.word[i]).len())
            .sum()
    }

    fn absolute(found: &Detections) -> Vec<i64> {
        found.time.iter().map(|time| found.epoch * 64 + i64::from(*time)).collect()
    }

    const CLEAN: [(&str, &str); 3] =
        [("sensitivity.pd", "1.0"), ("dark_counts_hz", "0"), ("jitter_ps", "0")];

    #[test]
    fn a_perfect_detector_sees_every_mark_at_its_place() {
        let design = sensor(&CLEAN);
        let found = run(&design, f64::INFINITY, 1);
        assert_eq!(found.time.len(), marks(&design));
        // Column 0 is dark; column 1 is 0000000001 011 on word C1, its first mark in bit 9.
        let first = 16_378 * 64 + 200_000_000 * 64 / 2500 + 9 * 841 * 64;
        assert_eq!(absolute(&found)[0], first);
    }

    /// Every event where the codebook has a mark, whatever the order and overlap of the echoes.
    #[test]
    fn echoes_in_any_order_and_overlap_make_the_events_of_their_marks() {
        let design = sensor(&CLEAN);
        let log = four_lines(&design);
        let delay_fs = |i: u64| (i.wrapping_mul(0x9E37_79B9) % 1_000_000) as i64 * 1000;
        let echoes: Vec<Echo> = (0..2 * 500)
            .map(|i| Echo { shot: i as usize / 2, delay_fs: delay_fs(i), photons: f64::INFINITY })
            .collect();
        let mut expected: Vec<i64> = (0..1000)
            .flat_map(|i| {
                let Echo { shot, delay_fs, .. } = echoes[i];
                let arrival = (log.fired_at_fs[shot] + delay_fs) * 64 / 2500;
                let marks =
                    design.emission.coding().codebook.marks(log.label[shot], log.word[shot]);
                marks.iter().map(move |mark| arrival + i64::from(*mark) * 64)
            })
            .collect();
        expected.sort_unstable();
        let light = light_of_echoes(&design, &log, echoes.iter().copied());
        assert_eq!(absolute(&detect(&design, &log, &light, 1)), expected);
    }

    #[test]
    fn a_few_events_find_their_places() {
        let mut time = vec![3, 5, 5, 8, 9];
        insert(&mut time, &[1, 5, 6, 7, 11]);
        assert_eq!(time, [1, 3, 5, 5, 5, 6, 7, 8, 9, 11]);
        insert(&mut time, &[]);
        assert_eq!(time.len(), 10);
    }

    /// H0: marks are seen with 1 − exp(−n). N ≈ 0.6 M marks, seed 11, α = 1e-6 (|z| < 4.9).
    #[test]
    fn the_fraction_seen_follows_the_photons() {
        let design = sensor(&[CLEAN[1], CLEAN[2]]);
        let total = marks(&design) as f64;
        let z = |photons: f64, claimed: f64| {
            let seen = run(&design, photons, 11).time.len() as f64;
            let p: f64 = 1.0 - (-claimed).exp();
            (seen - total * p) / (total * p * (1.0 - p)).sqrt()
        };
        for photons in [0.05, 0.7, 3.0] {
            assert!(z(photons, photons).abs() < 4.9, "n = {photons}: z = {}", z(photons, photons));
            // Negative control: one per cent more light than there is must be noticed.
            assert!(z(photons, photons * 1.01 + 0.01).abs() > 4.9);
        }
    }

    /// H0: dark counts are Poisson with the rate given, both in how many there are and in how
    /// far apart they are. Mean 4e3 to 1.4e6, seed 3, α = 1e-6.
    #[test]
    fn dark_counts_come_at_their_rate() {
        for rate in ["3e7", "1e9", "1e10"] {
            let design = sensor(&[CLEAN[0], CLEAN[2], ("dark_counts_hz", rate)]);
            let shots = (1e9 / rate.parse::<f64>().unwrap() * 3392.0) as u64;
            let log = crate::emit::Band { scan: 0, first: 848, shots: shots.min(4 * 848) }
                .shot_log(&design);
            let found = detect(&design, &log, &Light::default(), 3);
            let span = (log.fired_at_fs[log.len() - 1] + design.listening_fs() - log.fired_at_fs[0])
                as f64;
            let expected = span * 1e-15 * rate.parse::<f64>().unwrap();
            let z = |mean: f64| (found.time.len() as f64 - mean) / mean.sqrt();
            assert!(z(expected).abs() < 4.9, "{} against {expected}", found.time.len());
            assert!(z(expected * (1.0 + 10.0 / expected.sqrt())).abs() > 4.9);
            // A share 1 − 1/e of exponential waits is shorter than the mean.
            let mean_wait = 64.0 * 1e15 / 2500.0 / rate.parse::<f64>().unwrap();
            let waits = found.time.windows(2).map(|pair| f64::from(pair[1] - pair[0]));
            let n = found.time.len() as f64 - 1.0;
            let short = waits.filter(|wait| *wait < mean_wait.round()).count() as f64;
            let z = |p: f64| (short - n * p) / (n * p * (1.0 - p)).sqrt();
            assert!(z(1.0 - (-1.0_f64).exp()).abs() < 4.9, "{rate}: {}", short / n);
            assert!(z(1.0 - (-1.0_f64).exp() + 5.0 / n.sqrt()).abs() > 4.9);
        }
    }

    #[test]
    fn neighbouring_bands_agree_where_they_overlap() {
        for rate in ["3e7", "1e9", "1e10"] {
            let design = sensor(&[("dark_counts_hz", rate)]);
            let logs: Vec<ShotLog> =
                crate::emit::bands(&design, 0).take(2).map(|b| b.shot_log(&design)).collect();
            let times: Vec<Vec<i64>> = logs
                .iter()
                .map(|log| absolute(&detect(&design, log, &Light::default(), 3)))
                .collect();
            let last = logs[0].fired_at_fs[logs[0].len() - 1] + design.listening_fs();
            let (from, to) = (logs[1].fired_at_fs[0] * 64 / 2500, last * 64 / 2500);
            let within = |times: &[i64]| -> Vec<i64> {
                times.iter().copied().filter(|t| (from..=to).contains(t)).collect()
            };
            assert!(!within(&times[0]).is_empty());
            assert_eq!(within(&times[0]), within(&times[1]));
        }
    }

    /// Light and jitter too: what guard shots of one band get, owned shots of the other do.
    #[test]
    fn neighbouring_bands_see_the_same_marks() {
        let design = sensor(&[("missed_marks", "0.3"), ("dark_counts_hz", "1e8")]);
        let times: Vec<Vec<i64>> = crate::emit::short_bands(&design, 0)
            .take(2)
            .map(|band| {
                let log = band.shot_log(&design);
                absolute(&detect(&design, &log, &all(&design, &log, 1000, 1.0), 3))
            })
            .collect();
        let seam = 2 * 848 * 16_378 * 64;
        let near = seam - 20 * 16_378 * 64..seam + 20 * 16_378 * 64;
        let within = |times: &[i64]| -> Vec<i64> {
            times.iter().copied().filter(|t| near.contains(t)).collect()
        };
        assert!(within(&times[0]).len() > 1000);
        assert_eq!(within(&times[0]), within(&times[1]));
    }
}

//! Light of other lidars in our detectors (docs/physics.md#other-lidars).
//!
//! A detector that counts photons sees each mark as it sees those of its own echoes, with one edge.
//! If the micropulse is longer than its own, the edge comes with the first photon: of n photons
//! spread over a Gaussian of rms length σ the first comes at σ·Φ⁻¹(Λ/n), where Λ is drawn from the
//! unit exponential below n.
//!
//! A detector that fires once adds up light over its own micropulse. So the marks of a macropulse
//! that arrive within that time are one flash, in the middle of them, and a flash is to it what an
//! echo is. It meets every shot whose detector listens and looks there.

use std::ops::RangeInclusive;

use macropulse_codec::statistics::normal_quantile;

use super::clock::Clock;
use super::first_firing::PLENTY;
use super::jitter::Jitter;
use super::{Band, Memory};
use crate::channel::Foreign;
use crate::design::Design;
use crate::emit::shot_at;
use crate::random::{Address, Chance, Stage};
use crate::units::{FS_PER_S, RMS_OF_FWHM, fs_from_s, tof_from_range};
use macropulse_codec::ShotLog;

/// A detector that counts photons, as light of others meets it.
#[derive(Debug)]
pub(super) struct Counted<'a> {
    /// Fraction of the marks that are not missed for another reason than lack of light.
    pub kept: f64,
    pub jitter: Option<&'a Jitter>,
    /// Length of its own micropulses, s.
    pub pulse: f64,
}

impl Counted<'_> {
    /// The edges that `foreign` makes within `span`, ascending; in `memory.foreign`, in place of
    /// what was there. Both are in parts of a tick from the epoch of `clock` on.
    pub fn edges(
        &self,
        (clock, foreign): (&Clock, &Foreign),
        span: &RangeInclusive<i64>,
        chance: &Chance,
        memory: &mut Memory,
    ) {
        let mut times = std::mem::take(&mut memory.foreign);
        times.clear();
        for entry in 0..foreign.len() {
            let mark = |offset: &i64| clock.time(foreign.arrives_fs[entry] + offset);
            let marks = foreign.marks_of(entry);
            let address = |stage| {
                let (index, part) = (foreign.shot[entry], foreign.way[entry]);
                Address { stage, index, part }
            };
            let mut see = |time: i64| {
                if span.contains(&time) {
                    times.push(time as u32);
                }
            };
            let detected = 1.0 - libm::exp(-foreign.photons[entry]);
            let bound = (self.kept * detected * 4_294_967_296.0) as u64;
            let seen = chance.draw(address(Stage::OtherMarks), marks.len(), &mut memory.numbers);
            let first = FirstPhoton::of(self, (foreign.photons[entry], foreign.pulse[entry]));
            let seen = marks.iter().zip(seen).filter(|(_, number)| u64::from(**number) < bound);
            let mut offsets = std::mem::take(&mut memory.offsets);
            offsets.clear();
            offsets.extend(seen.map(|(offset, number)| {
                offset + first.as_ref().map_or(0, |first| first.late_fs(*number, bound))
            }));
            if let Some(jitter) = self.jitter {
                let address = address(Stage::OtherJitter);
                let late = chance.draw(address, offsets.len(), &mut memory.numbers);
                offsets.iter().zip(late).for_each(|(offset, number)| {
                    see(mark(offset) + i64::from(jitter.drawn(*number)));
                });
            } else {
                offsets.iter().for_each(|offset| see(mark(offset)));
            }
            memory.offsets = offsets;
        }
        times.sort_unstable();
        memory.foreign = times;
    }
}

/// When the first photon of a long micropulse is seen.
struct FirstPhoton {
    photons: f64,
    rms_fs: f64,
}

impl FirstPhoton {
    fn of(detector: &Counted, (photons, pulse): (f64, f64)) -> Option<Self> {
        let rms_fs = pulse * RMS_OF_FWHM * FS_PER_S as f64;
        (pulse > detector.pulse).then_some(Self { photons: photons.min(PLENTY), rms_fs })
    }

    /// After the middle, fs, where a number below `bound` has said that there is one.
    fn late_fs(&self, number: u32, bound: u64) -> i64 {
        // Evenly drawn among those below the bound: seen with 1 − exp(−Λ) of all.
        let share = (f64::from(number) + 0.5) / bound as f64;
        let until = -libm::log1p(share * libm::expm1(-self.photons));
        (self.rms_fs * normal_quantile(until / self.photons)).round() as i64
    }
}

/// One flash of foreign light at one of our shots.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Flash {
    /// Index of the shot in the band's log.
    pub shot: usize,
    /// From its firing to the flash, fs.
    pub delay_fs: i64,
    pub photons: f64,
}

/// The flashes that the light in `band` makes, ordered by shot, then by time.
pub(super) fn flashes(band: &Band) -> Vec<Flash> {
    let (design, log, foreign) = (band.design, band.log, &band.echoes.foreign);
    let pulse_fs = fs_from_s(design.light.pulse);
    let mut flashes = Vec::new();
    for entry in 0..foreign.len() {
        for marks in
            foreign.marks_of(entry).chunk_by(|first, mark| first / pulse_fs == mark / pulse_fs)
        {
            let middle_fs = (marks[0] + marks[marks.len() - 1]) / 2;
            let arrives_fs = foreign.arrives_fs[entry] + middle_fs;
            let photons = foreign.photons[entry] * marks.len() as f64;
            flashes.extend(
                listening(design, log, arrives_fs, foreign.pixel[entry]).map(|shot| Flash {
                    shot,
                    delay_fs: arrives_fs - log.fired_at_fs[shot],
                    photons,
                }),
            );
        }
    }
    flashes.sort_by_key(|flash| (flash.shot, flash.delay_fs));
    flashes
}

/// The shots whose gates are open at `arrives_fs`, of detectors that see the cell of `pixel`.
fn listening(
    design: &Design,
    log: &ShotLog,
    arrives_fs: i64,
    pixel: (u16, u16),
) -> std::ops::Range<usize> {
    let gate = [design.scan.max_range, design.scan.min_range];
    let [opened, closed] = gate.map(|range| arrives_fs - fs_from_s(tof_from_range(range)));
    let fired = &log.fired_at_fs;
    let open =
        fired.partition_point(|time| *time < opened)..fired.partition_point(|time| *time <= closed);
    if design.channels() == 1 {
        return open;
    }
    match shot_at(design, log, pixel) {
        Some(shot) if open.contains(&shot) => shot..shot + 1,
        _ => 0..0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// H0: of n photons spread over a Gaussian the first one, if there is one, comes before the
    /// middle with probability (1 − e^(−n/2)) / (1 − e^(−n)). N = 65 536 numbers evenly spread, so
    /// that the share is exact to a few of them.
    #[test]
    fn the_first_photon_comes_early_in_strong_light() {
        let detector = Counted { kept: 1.0, jitter: None, pulse: 2.5e-12 };
        for photons in [0.01, 1.0, 30.0] {
            let first = FirstPhoton::of(&detector, (photons, 5e-9)).unwrap();
            let bound = (-libm::expm1(-photons) * 4_294_967_296.0) as u64;
            let number = |i: u64| (bound * i / 65_536) as u32;
            let early = (0..65_536).filter(|i| first.late_fs(number(*i), bound) < 0).count();
            let share = early as f64 / 65_536.0;
            let expected = libm::expm1(-photons / 2.0) / libm::expm1(-photons);
            assert!((share - expected).abs() < 1e-4, "{photons}: {share}, not {expected}");
        }
        // A micropulse as short as its own has no length to it.
        assert!(FirstPhoton::of(&detector, (1.0, 2.5e-12)).is_none());
        let blinding = FirstPhoton::of(&detector, (f64::INFINITY, 5e-9)).unwrap();
        assert!((-20_000_000..-10_000_000).contains(&blinding.late_fs(1 << 31, 1 << 32)));
    }

    /// Control: marks with a hundred-thousandth of a photon are seen by none.
    #[test]
    fn every_detector_of_a_coded_lidar_sees_the_marks_of_others() {
        let detectors = [
            "[detector.photon-counting]\nefficiency = 1.0",
            "[detector.geiger]\nefficiency = 1.0\ncells = 100",
            "[detector.linear]\nefficiency = 1.0\nbandwidth_mhz = 1e5\namplifier_pa_rthz = 1.0\n\
             false_alarm_hz = 1.0",
        ];
        for detector in detectors {
            let text = format!(
                "version = 1\nextends = \"kim-park-2016-physical\"\nname = \"mine\"\n\
                 idealised = [\"detector-bandwidth\", \"inter-chip\", \"mirror-motion\"]\n\
                 {detector}\njitter_ps = 0.0\n"
            );
            let design = Design::from_toml(&text, "mine", std::path::Path::new(""), &[]).unwrap();
            let log = crate::emit::Band { scan: 0, first: 0, shots: 100 }.shot_log(&design);
            let edges = |photons: f64| {
                let foreign = Foreign {
                    arrives_fs: vec![log.fired_at_fs[50]],
                    photons: vec![photons],
                    pulse: vec![2.5e-12],
                    pixel: vec![(0, 0)],
                    marks: std::iter::once(0..180).collect(),
                    mark_fs: (0..180).map(|mark| mark * 150_000).collect(),
                    shot: vec![7],
                    way: vec![1],
                };
                let echoes = crate::channel::Echoes { foreign, ..Default::default() };
                let detectors = crate::detect::Detectors::in_the_dark(&design, Chance::new(1));
                let mut time = detectors.edges(&log, &echoes, &mut Memory::default()).time;
                // Photons of one mark come together.
                time.dedup();
                time.len()
            };
            assert_eq!((edges(1e9), edges(1e-5)), (180, 0), "{detector}");
        }
    }

    /// A macropulse of 27 ns falls on a detector that adds up over 5 ns: six flashes at most, with
    /// all its photons.
    #[test]
    fn marks_within_a_micropulse_are_one_flash() {
        let design = Design::open("hdl-64e", &[]).unwrap();
        let log = crate::emit::Band { scan: 0, first: 0, shots: 64 }.shot_log(&design);
        let mark_fs: Vec<i64> = (0..180).map(|mark| mark * 150_000).collect();
        let shot = 5;
        let foreign = Foreign {
            arrives_fs: vec![log.fired_at_fs[shot] + 300_000_000],
            photons: vec![2.0],
            pulse: vec![2.5e-12],
            pixel: vec![(log.row[shot], log.column[shot])],
            marks: std::iter::once(0..180).collect(),
            mark_fs,
            shot: vec![0],
            way: vec![0],
        };
        let echoes = crate::channel::Echoes { foreign, ..Default::default() };
        let clock = Clock::new(&design, 0);
        let band = Band { clock, design: &design, log: &log, echoes: &echoes };
        let flashes = flashes(&band);
        assert_eq!(flashes.len(), 6);
        assert!(flashes.iter().all(|flash| flash.shot == shot));
        assert_eq!(flashes.iter().map(|flash| flash.photons).sum::<f64>(), 360.0);
        assert!(flashes.is_sorted_by_key(|flash| flash.delay_fs));
        assert!((300_000_000..305_000_000).contains(&flashes[0].delay_fs));
    }
}

//! Light whose power is modulated while it shines: `[modulation]`.

use std::f64::consts::PI;

use macropulse_codec::decode::phase::Tone;
use macropulse_codec::{self as codec, Given, RecordKind};
use schemars::JsonSchema;
use serde::Deserialize;

use super::check::{Continuous, OptionalTable, SensorFile};
use super::emission::{Exposures, Model, Occupancy};
use super::limits::{Check, Idle};
use super::{Clock, Coding, Emission, Error, Readout, readout};
use crate::units::{fs_from_s, s_from_fs, tof_from_range};

/// Modulation frequencies of a sensor at most.
pub const MOST_TONES: usize = 4;

/// Harmonics of square waves that a receiver knows: up to this one.
const HARMONICS: usize = 63;

/// The highest harmonic of the power of a square wave that is followed.
const HIGHEST_OF_POWER: u32 = 255;

/// Phases that differ by less than this, rad, are the same.
const SAME_PHASE: f64 = 1e-6;

/// An exposure is longer than the flight of light that is followed by this factor at least: light of the exposure
/// before it is neglected.
const LONGER: f64 = 20.0;

/// Bytes of a tap in the memory of a run: its code, and the same once more while it is written.
const PER_TAP: f64 = 4.0;

/// Modulated light: exposure after exposure, each for a tap of one modulation frequency.
#[derive(Debug, Clone, PartialEq)]
pub struct Modulation {
    /// The shot as a code word of one mark, at which its light begins.
    pub shot: Coding,
    /// Modulation frequencies, Hz, in the order in which they are sent.
    pub hz: Vec<f64>,
    /// Taps of each frequency, at equal distances of a period.
    pub phases: u32,
    /// Time for which light is sent and collected for a tap, fs.
    pub exposure_fs: i64,
    /// Time between two exposures, fs.
    pub gap_fs: i64,
    /// Shape of the modulation, of light and detector alike.
    pub wave: Wave,
}

/// The shape of a modulation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Wave {
    /// Light and gain follow a sine.
    Sine,
    /// Both are switched on and off, for half a period each: their correlation is a triangle.
    Square,
}

/// A phase in turns, without whole ones: from −½ to ½.
fn part_of_turn(phase: f64) -> f64 {
    let turns = phase / (2.0 * PI);
    turns - turns.round()
}

/// The mean of what is `at` a phase over the phases between two, rad. The integral of what it adds to 1 is `up_to` a
/// phase.
fn mean(from: f64, until: f64, at: impl Fn(f64) -> f64, up_to: impl Fn(f64) -> f64) -> f64 {
    if (until - from).abs() < SAME_PHASE {
        return at((from + until) / 2.0);
    }
    1.0 + (up_to(until) - up_to(from)) / (until - from)
}

impl Wave {
    /// The charge of a tap over its mean for light whose phase is this far, rad, behind that of the tap, with such a
    /// `contrast` of the fundamental.
    pub fn share(self, contrast: f64, behind: f64) -> f64 {
        match self {
            Self::Sine => 1.0 + contrast * libm::cos(behind),
            Self::Square => {
                // 1 at 0 and −1 at half a turn, with a fundamental of 8/π².
                let triangle = 1.0 - 4.0 * part_of_turn(behind).abs();
                1.0 + contrast * PI * PI / 8.0 * triangle
            }
        }
    }

    /// The mean of [`Wave::share`] over phases that go evenly from one to another one, rad.
    pub fn mean_share(self, contrast: f64, from: f64, until: f64) -> f64 {
        let up_to = |phase: f64| match self {
            Self::Sine => contrast * libm::sin(phase),
            Self::Square => {
                let turns = part_of_turn(phase);
                contrast * PI.powi(3) / 4.0 * turns * (1.0 - 2.0 * turns.abs())
            }
        };
        mean(from, until, |behind| self.share(contrast, behind), up_to)
    }

    /// The power of fully modulated light over its mean, this far behind its peak, rad.
    pub fn power(self, behind: f64) -> f64 {
        match self {
            Self::Sine => 1.0 + libm::cos(behind),
            Self::Square if part_of_turn(behind).abs() <= 0.25 => 2.0,
            Self::Square => 0.0,
        }
    }

    /// The mean of [`Wave::power`] over phases that go evenly from one to another one, rad.
    pub fn mean_power(self, from: f64, until: f64) -> f64 {
        let up_to = |phase: f64| match self {
            Self::Sine => libm::sin(phase),
            Self::Square => {
                // It rises for a quarter of a turn to both sides of the peak, and falls beyond.
                let turns = part_of_turn(phase);
                2.0 * PI * (if turns.abs() <= 0.25 { turns } else { turns.signum() * 0.5 - turns })
            }
        };
        mean(from, until, |behind| self.power(behind), up_to)
    }

    /// Harmonics of the power of fully modulated light up to this number: the number of each, and its amplitude over the
    /// mean.
    pub fn harmonics_of_power(self, highest: f64) -> impl Iterator<Item = (u32, f64)> {
        let last = match self {
            Self::Sine => 1,
            Self::Square => (highest as u32).clamp(1, HIGHEST_OF_POWER),
        };
        (1..=last).step_by(2).map(move |number| match self {
            Self::Sine => (number, 1.0),
            Self::Square => {
                let sign = if number % 4 == 1 { 1.0 } else { -1.0 };
                (number, sign * 4.0 / (PI * f64::from(number)))
            }
        })
    }

    /// The most contrast: more would take charge away.
    pub fn most_contrast(self) -> f64 {
        match self {
            Self::Sine => 1.0,
            Self::Square => 8.0 / (PI * PI),
        }
    }

    /// The contrasts of fundamental and harmonics.
    pub fn contrasts(self, contrast: f64) -> Vec<f64> {
        match self {
            Self::Sine => vec![contrast],
            Self::Square => {
                let squares = Tone::squares(HARMONICS);
                squares.iter().map(|harmonic| contrast * harmonic / squares[0]).collect()
            }
        }
    }
}

impl Modulation {
    /// Taps of a shot.
    pub fn taps(&self) -> u32 {
        self.hz.len() as u32 * self.phases
    }

    /// When the exposure of tap number `tap` begins, fs after the shot.
    pub fn begins_fs(&self, tap: u32) -> i64 {
        i64::from(tap) * (self.exposure_fs + self.gap_fs)
    }

    /// Time, s, from the shot to the middle of the exposure of tap number `tap`.
    pub fn middle(&self, tap: u32) -> f64 {
        s_from_fs(self.begins_fs(tap)) + 0.5 * s_from_fs(self.exposure_fs)
    }

    /// The highest modulation frequency, Hz.
    pub fn highest(&self) -> f64 {
        self.hz.iter().fold(0.0, |most: f64, hz| most.max(*hz))
    }
}

impl Model for Modulation {
    fn coding(&self) -> &Coding {
        &self.shot
    }

    /// From the beginning of the first exposure to the end of the last one.
    fn length_fs(&self) -> i64 {
        self.begins_fs(self.taps() - 1) + self.exposure_fs
    }

    fn exposures(&self) -> Option<Exposures> {
        Some(Exposures { count: self.taps(), each_fs: self.exposure_fs })
    }

    fn recorded_parts(&self) -> u32 {
        self.taps()
    }

    fn share_within(&self, seconds: f64) -> f64 {
        let (exposure, gap) = (s_from_fs(self.exposure_fs), s_from_fs(self.gap_fs));
        let whole = libm::floor(seconds / (exposure + gap));
        let rest = (seconds - whole * (exposure + gap)).min(exposure);
        ((whole * exposure + rest) / (f64::from(self.taps()) * exposure)).min(1.0)
    }

    /// Its exposures follow one another, and a surface moves on between them.
    fn sees_motion(&self) -> bool {
        true
    }

    fn occupancy(&self) -> Option<Occupancy> {
        Some(Occupancy {
            fs: self.length_fs(),
            table: "modulation",
            with: "",
            remedy: "fewer taps, shorter exposures",
        })
    }

    /// The phases of all frequencies, taken to whole hertz, repeat after 1 over their greatest common divisor.
    fn repeats_after(&self) -> Option<f64> {
        let divisor = self.hz.iter().fold(0, |all: u64, hz| {
            let (mut one, mut other) = (all, hz.round().max(1.0) as u64);
            while other > 0 {
                (one, other) = (other, one % other);
            }
            one
        });
        Some(1.0 / divisor.max(1) as f64)
    }

    fn ambiguity(&self) -> &'static str {
        "the phases of all modulation frequencies repeat"
    }

    fn numbers(&self, add: &mut dyn FnMut(&[u64])) {
        add(&[self.phases.into(), self.exposure_fs as u64]);
        add(&[self.gap_fs as u64, self.wave as u64]);
        self.hz.iter().for_each(|hz| add(&[hz.to_bits()]));
    }

    fn description(&self, number: fn(f64) -> String) -> Vec<String> {
        let mhz: Vec<String> = self.hz.iter().map(|hz| number(hz * 1e-6)).collect();
        let (ms, us) = (s_from_fs(self.length_fs()) * 1e3, s_from_fs(self.exposure_fs) * 1e6);
        vec![
            format!("modulated with {} MHz, in {} ms", mhz.join(", "), number(ms)),
            format!("{} taps of each frequency, {} us long", self.phases, number(us)),
        ]
    }
}

/// `[modulation]` as typed.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct ModulationFile {
    /// Modulation frequencies, MHz, in the order in which they are sent: 1 to 4.
    #[schemars(length(min = 1, max = 4), inner(range(min = 0.001, max = 100_000)))]
    frequencies_mhz: Vec<f64>,
    /// Taps of each frequency, at equal distances of a period.
    #[schemars(range(min = 3, max = 64))]
    phases: u32,
    /// Time for which light is sent and collected for a tap, µs.
    #[schemars(range(min = 0.001, max = 1e6))]
    exposure_us: f64,
    /// Time between two exposures, µs. Left out: 0.
    #[schemars(range(min = 0, max = 1e6))]
    gap_us: Option<f64>,
    /// Shape of the modulation, of light and detector alike. Left out: `sine`.
    wave: Option<Wave>,
}

impl OptionalTable for ModulationFile {
    fn idle(&self, _: &SensorFile) -> Vec<Idle> {
        let why = "modulated light has no pulses, and no event of it is timed";
        let mut idle = Idle::all(&["tdc", "light.pulse_ps"], "modulation", why);
        if self.wave.unwrap_or(Wave::Sine) == Wave::Sine {
            let harmonics = ["receiver.correct_harmonics"];
            idle.extend(Idle::all(&harmonics, "modulation.wave", "a sine has no harmonics"));
        }
        idle
    }

    fn continuous(&self) -> Option<&dyn Continuous> {
        Some(self)
    }
}

impl Continuous for ModulationFile {
    fn table(&self) -> &'static str {
        "modulation"
    }

    fn varies(&self) -> &'static str {
        "a power"
    }

    fn detector(&self) -> &'static str {
        "lock-in"
    }

    fn readout(&self, _: &Check, _: &SensorFile) -> Result<(Clock, Readout), Error> {
        Ok((Clock::UNTIMED, Readout::Taps))
    }

    fn emission(&self, check: &Check, shot: Coding, farthest: f64) -> Result<Emission, Error> {
        Ok(Emission::Modulated(check.modulation(self, shot, farthest)?))
    }
}

/// A converter for each detector that reads its taps.
pub(super) struct Taps;

impl readout::Model for Taps {
    fn records(&self) -> RecordKind {
        RecordKind::Taps
    }

    fn tick_key(&self) -> &'static str {
        "modulation"
    }

    fn why_nothing_is_found(&self) -> &'static str {
        "the receiver found none of the echoes in the taps: too little light for the noise, or so much \
         that the taps are full"
    }

    fn blank(&self, emission: &Emission, _: Clock) -> Option<Given> {
        let taps = emission.model().recorded_parts();
        Some(Given::Taps(codec::Taps { taps, codes: vec![0; taps as usize] }))
    }

    fn bytes_of_part(&self) -> Option<f64> {
        Some(PER_TAP)
    }

    fn unshared(&self) -> &'static str {
        "every pixel has taps of its own, which are never busy"
    }
}

impl Check<'_> {
    /// The modulation, whose shots are `shot`; light is followed to `farthest` metres.
    fn modulation(
        &self,
        file: &ModulationFile,
        shot: Coding,
        farthest: f64,
    ) -> Result<Modulation, Error> {
        let key = "modulation.frequencies_mhz";
        let many = file.frequencies_mhz.len();
        if !(1..=MOST_TONES).contains(&many) {
            let message = format!("has {many} frequencies, but can have 1 to {MOST_TONES}");
            return self.refuse(key, message);
        }
        let hz = |mhz: &f64| Ok(self.within(key, *mhz, 1e-3, 1e5)? * 1e6);
        let hz = file.frequencies_mhz.iter().map(hz).collect::<Result<Vec<f64>, Error>>()?;
        let phases = self.count("modulation.phases", file.phases, 3, Tone::MOST_PHASES)?;
        let path = "modulation.exposure_us";
        let exposure = self.within(path, file.exposure_us, 1e-3, 1e6)? * 1e-6;
        let least = LONGER * tof_from_range(farthest);
        if exposure < least {
            let message = format!(
                "is {}, but must be {LONGER} times as long as light is on its way from {farthest:.1} m, the end of \
                 light_range_m: {:.2} or more",
                file.exposure_us,
                least * 1e6
            );
            return self.refuse(path, message);
        }
        let gap = self.within("modulation.gap_us", file.gap_us.unwrap_or(0.0), 0.0, 1e6)? * 1e-6;
        let wave = file.wave.unwrap_or(Wave::Sine);
        let (exposure_fs, gap_fs) = (fs_from_s(exposure), fs_from_s(gap));
        Ok(Modulation { shot, hz, phases, exposure_fs, gap_fs, wave })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::design::Design;
    use approx::assert_relative_eq;

    /// Published: 4.997 m for 120 and 90 MHz, 8.328 m for 90 and 72, 18.737 m for 80, 16 and 120.
    #[test]
    fn phases_repeat_after_the_published_intervals() {
        for (name, interval) in [("itof-camera", 4.997), ("kinect-v2", 18.737)] {
            let design = Design::open(name, &[]).unwrap();
            let found = design.derived().unambiguous_range.unwrap();
            assert_relative_eq!(found, interval, max_relative = 1e-4);
        }
        let set = [("modulation.frequencies_mhz".to_owned(), "[90.0, 72.0]".to_owned())];
        let design = Design::open("itof-camera", &set).unwrap();
        assert_relative_eq!(
            design.derived().unambiguous_range.unwrap(),
            8.328,
            max_relative = 1e-4
        );
        let set = [("modulation.frequencies_mhz".to_owned(), "[120.0]".to_owned())];
        let set = [set, [("detector.lock-in.contrast".to_owned(), "[0.7]".to_owned())]].concat();
        let design = Design::open("itof-camera", &set).unwrap();
        let told = design.warnings.concat();
        assert!(told.contains("repeat after 1.2 m, within the range gate of 4.9 m"), "{told}");
    }

    /// Nine exposures and eight pauses of the Kinect v2 are 12.73 ms.
    #[test]
    fn a_shot_lasts_as_long_as_its_exposures_and_pauses() {
        let design = Design::open("kinect-v2", &[]).unwrap();
        let modulation = design.emission.modulation().unwrap();
        assert_eq!((modulation.taps(), modulation.length_fs()), (9, 12_725_000_000_000));
        assert_eq!(design.emission.length_fs(), modulation.length_fs());
        // An exposure, one and a half, and all.
        for (us, share) in [(125.0, 1.0 / 9.0), (1575.0 + 62.5, 1.5 / 9.0), (1e6, 1.0)] {
            assert_relative_eq!(modulation.share_within(us * 1e-6), share, max_relative = 1e-9);
        }
    }

    /// Each fault gives one sentence with its key.
    #[test]
    fn impossible_modulations_are_refused() {
        for (key, value, told) in [
            ("modulation.frequencies_mhz", "[]", "has 0 frequencies"),
            ("modulation.frequencies_mhz", "[1, 2, 3, 4, 5]", "has 5 frequencies"),
            ("modulation.phases", "2", "modulation.phases"),
            ("modulation.exposure_us", "0.5", "must be 20 times as long as light"),
            ("modulation.gap_us", "1e5", "longer than the 33333.333 µs between"),
            ("detector.lock-in.contrast", "[0.7]", "give one for each"),
            ("detector.lock-in.contrast", "[0.7, 1.5]", "contrast"),
            ("detector.lock-in.adc_bits", "17", "adc_bits"),
            ("burst", "{ pulses = 2, interval_ns = 100.0 }", "leave one of them out"),
            ("code.chip_ps", "100", "code"),
            ("light.pulse_ps", "100", "has no effect because of `modulation`"),
            ("tdc.resolution_ps", "100", "has no effect because of `modulation`"),
            ("receiver.correct_harmonics", "true", "has no effect because of `modulation.wave`"),
            ("receiver.kind", "histogram", "`phase` for a [modulation]"),
            (
                "idealised",
                "[\"link-budget\", \"eye-safety\", \"mirror-motion\"]",
                "counts its noise in electrons",
            ),
        ] {
            let set = [(key.to_owned(), value.to_owned())];
            let error = Design::open("itof-camera", &set).unwrap_err().to_string();
            assert!(error.contains(told), "{key}: {error}");
        }
        let set = [("receiver.kind".to_owned(), "phase".to_owned())];
        let error = Design::open("peregrine", &set).unwrap_err().to_string();
        assert!(error.contains("`phase` for a [modulation]"), "{error}");
    }

    /// The triangle is the sum of its harmonics, and has the contrast that is asked for.
    #[test]
    fn a_square_wave_is_the_sum_of_the_harmonics_that_a_receiver_knows() {
        let contrast = 0.6;
        let harmonics = Wave::Square.contrasts(contrast);
        assert_eq!(harmonics[0], contrast);
        for at in 0..200 {
            let behind = f64::from(at) * 0.07 - 7.0;
            let sum: f64 = (1..)
                .zip(&harmonics)
                .map(|(n, harmonic)| harmonic * libm::cos(f64::from(n) * behind))
                .sum();
            assert_relative_eq!(Wave::Square.share(contrast, behind), 1.0 + sum, epsilon = 5e-3);
        }
        assert_relative_eq!(
            Wave::Square.share(Wave::Square.most_contrast(), PI),
            0.0,
            epsilon = 1e-12
        );
        assert_eq!(Wave::Sine.share(1.0, 0.0), 2.0);
    }
}

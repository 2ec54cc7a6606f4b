//! The kinds of detector: their keys and their limits, and the law by which each makes detection events of
//! light, in closed form.
//!
//! How events are drawn stands in [`detect`](crate::detect) and shares nothing with the closed
//! forms but a detector's settings, so that the one can be held against the other.
//!
//! A new kind is a file here with the keys (`Typed`) and the answers ([`Model`]), an entry in each
//! list of this page, and a file in [`detect`](crate::detect).

mod check;
mod coherent;
mod comparator;
mod front_end;
mod geiger;
mod linear;
mod lock_in;
mod photodiode;
mod photon_counting;
mod sampled;
mod single_stop;
mod table;

use macropulse_codec::statistics::{normal_quantile, normal_tail};
use schemars::JsonSchema;
use serde::Deserialize;

pub(in crate::design) use check::Efficiency;
pub use coherent::Coherent;
pub(in crate::design) use comparator::ComparatorFile;
pub use comparator::{
    Comparator, DELAY as COMPARATOR_DELAY, FRACTION as COMPARATOR_FRACTION, LinearSetting, Timing,
    threshold_over_noise,
};
pub use front_end::FrontEnd;
pub use geiger::{Arming, Geiger};
pub use linear::Linear;
pub use lock_in::LockIn;
pub(in crate::design) use photodiode::OF_SAMPLES;
pub use photon_counting::PhotonCounting;
pub use sampled::{BASELINE_BLOCK, Sampled};
pub use single_stop::{PLENTY, SingleStop, SingleStopSetting};
pub(in crate::design) use table::{Before, SensitivityFile, Table};

use super::{Error, Light};

/// The list of all kinds, and that of the tables `[detector.NAME]` in which a sensor file describes one: file in
/// this folder, and name. Every other list of them follows from these.
macro_rules! kinds {
    (kinds { $($(#[$doc:meta])* $Kind:ident;)+ } tables { $($(#[$of:meta])* $file:ident, $name:literal;)+ }) => {
        /// Light to detection events, to samples, to taps or to beats.
        #[derive(Debug, Clone, PartialEq)]
        pub enum Detector {
            $($(#[$doc])* $Kind($Kind),)+
        }

        impl Detector {
            /// Names of all tables `[detector.NAME]`.
            pub const NAMES: &[&str] = &[$($name),+];

            /// The model of its kind.
            pub fn model(&self) -> &dyn Model {
                match self {
                    $(Self::$Kind(detector) => detector,)+
                }
            }
        }

        /// `[detector]` as typed: a table for each kind. A sensor has one of them.
        #[derive(Debug, Deserialize, JsonSchema)]
        #[serde(deny_unknown_fields)]
        pub(in crate::design) struct DetectorFile {
            $($(#[$of])* #[serde(rename = $name)] $file: Option<$file::File>,)+
        }

        impl DetectorFile {
            /// The tables that the file has.
            pub(in crate::design) fn given(&self) -> impl Iterator<Item = Given<'_>> {
                let all = [
                    $(self.$file.as_ref().map(|file| Given { name: $name, file: file as &dyn Typed }),)+
                ];
                all.into_iter().flatten()
            }
        }
    };
}

impl DetectorFile {
    /// The table of the file, if it has exactly one.
    pub(in crate::design) fn only(&self) -> Option<Given<'_>> {
        let mut given = self.given();
        given.next().filter(|_| given.next().is_none())
    }
}

kinds! {
    kinds {
        /// Every mark is a Bernoulli trial of its own.
        PhotonCounting;
        /// Cells that are blind for a while after each count.
        Geiger;
        /// An amplified current that crosses a threshold.
        Linear;
        /// An amplified current that is sampled.
        Sampled;
        /// One event per shot \[KP16 Fig. 7\].
        SingleStop;
        /// Taps that collect light in step with its modulation.
        LockIn;
        /// Light is mixed with that of the laser, and the beats of both are recorded.
        Coherent;
    }
    tables {
        /// Every mark is a Bernoulli trial of its own.
        photon_counting, "photon-counting";
        /// Cells that are blind for a while after each count.
        geiger, "geiger";
        /// A photodiode and its amplifier, behind which a [comparator] or an [adc] stands.
        photodiode, "photodiode";
        /// One event per shot \[KP16 Fig. 7\].
        single_stop, "single-stop";
        /// Taps that collect light in step with its modulation; with [modulation].
        lock_in, "lock-in";
        /// Light is mixed with that of the laser, and the beats of both are recorded; with [chirp] and [spectrum].
        coherent, "coherent";
    }
}

impl Detector {
    /// The rms length, s, over which the photons of a micropulse of `light` are spread if it sees each by
    /// itself. `None` if they are taken to come at once, and for a photodiode, which sees the pulse as a whole.
    pub fn spread_of(&self, light: &Light) -> Option<f64> {
        light.spread.filter(|_| !matches!(self, Self::Linear(_) | Self::Sampled(_)))
    }
}

/// The table of one kind in a sensor file.
#[derive(Clone, Copy)]
pub(in crate::design) struct Given<'a> {
    /// Name of the kind.
    pub name: &'static str,
    /// Its keys.
    pub file: &'a dyn Typed,
}

/// The keys of a kind before they are checked.
pub(in crate::design) trait Typed {
    /// Detections per photon, if the file says it, under the key `efficiency`.
    fn efficiency(&self) -> Option<f64>;

    /// Its keys without effect: none, unless a kind says otherwise.
    fn idle(&self) -> Idle {
        Idle::NONE
    }

    /// The properties of light that it follows: all, unless a kind says otherwise. A sensor must declare those that it
    /// leaves out.
    fn follows(&self) -> Follows {
        Follows { bandwidth: true, neighbouring_chips: true }
    }

    /// True if it puts out no more than one event per shot.
    fn is_single_stop(&self) -> bool {
        false
    }

    /// True if it puts out a signal, for a comparator or an ADC.
    fn has_signal(&self) -> bool {
        false
    }

    /// The detector in SI units.
    ///
    /// # Errors
    /// If a value lies outside its limits, or the sensor is one that this kind does not go with.
    fn check(&self, table: &Table) -> Result<Detector, Error>;
}

/// Keys in the table of a kind that another setting makes meaningless.
pub(in crate::design) struct Idle {
    /// Without a link budget, where the receiver is declared by its sensitivity.
    pub declared: &'static [&'static str],
    /// With a link budget, where photons are counted.
    pub counted: &'static [&'static str],
}

impl Idle {
    /// For a kind with an efficiency for a link budget and a sensitivity without one.
    const EITHER: Self = Self { declared: &["efficiency"], counted: &["sensitivity"] };

    /// For a kind that needs all of its keys.
    const NONE: Self = Self { declared: &[], counted: &[] };
}

/// The effects on the way from light to events that a kind of detector follows.
pub(in crate::design) struct Follows {
    /// How fast it is: it has a response or a dead time of its own.
    pub bandwidth: bool,
    /// Light of a micropulse that reaches into neighbouring chips, every photon by itself.
    pub neighbouring_chips: bool,
}

/// Model of a detector of any kind, SI units throughout. Counts and photons are detected ones; `background`
/// is the sunlight that it sees, in detections per second.
pub trait Model {
    /// How much light it gets.
    fn sensitivity(&self) -> Sensitivity;

    /// Counts of sunlight per second that the file declares; 0 where they follow from optics and
    /// environment.
    fn declared_background(&self) -> f64 {
        0.0
    }

    /// Standard deviation of its timing, s, where it is largest.
    fn jitter(&self) -> f64 {
        0.0
    }

    /// Standard deviation, s, of the time of a mark that is only just detected, the length of a
    /// micropulse of `light` included.
    fn resolution(&self, light: &Light) -> f64;

    /// Full width, s, of what it makes of the shortest mark: marks that follow each other sooner
    /// are one. 0 where it tells all apart.
    fn response(&self) -> f64 {
        0.0
    }

    /// For how long, fs, its state depends on the light that it has seen; 0 without memory.
    fn memory_fs(&self) -> i64 {
        0
    }

    /// Time, fs, after which its output no longer depends on earlier light. 0 if each moment stands for
    /// itself.
    fn settles_fs(&self) -> i64 {
        0
    }

    /// True if an event may depend on other light than its own: on earlier light, or on any other light while
    /// a gate is open.
    fn has_state(&self) -> bool {
        self.memory_fs() > 0
    }

    /// The reason why it cannot be simulated in this sunlight, and a remedy; `None` if it can.
    fn refusal(&self, _background: f64) -> Option<String> {
        None
    }

    /// The reason why the light of lidars without pulses cannot be followed to it, and a remedy: two clauses;
    /// `None` if it can.
    fn unpulsed(&self) -> Option<&'static str> {
        None
    }

    /// Events per second that it would make without the light of any lidar, were it always ready.
    fn false_rate(&self, background: f64) -> f64;

    /// Noise of the amplitude and the threshold; `None` where there is none.
    fn noise(&self, _background: f64) -> Option<Noise> {
        None
    }

    /// Probability that a mark makes an event.
    fn mark_pd(&self, lit: &Lit) -> f64;

    /// Standard deviation, s, of its timing of a mark.
    fn mark_jitter(&self, lit: &Lit) -> f64;

    /// Standard deviation, s, that the length of a micropulse of `light` adds to the time of a mark.
    fn mark_displacement(&self, _lit: &Lit, _light: &Light) -> f64 {
        0.0
    }

    /// Share of what falls on it that its dead time leaves, `falling` detections per second in all.
    fn ready_share(&self, _falling: f64) -> f64 {
        1.0
    }

    /// The result of a receiver that takes the first event in its gate.
    fn first_event(&self, awaited: &Awaited) -> FirstEvent {
        FirstEvent::without_memory(awaited)
    }

    /// True if it draws the speckle of each echo itself.
    fn follows_speckle(&self) -> bool {
        false
    }

    /// Description in half a line, for people.
    fn summary(&self) -> String;

    /// The role of the counts of sunlight: the end of a sentence about them, for people.
    fn in_sunlight(&self) -> &'static str;
}

/// How much light a detector gets, declared by what it can see.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sensitivity {
    /// Mean photons detected per mark from a target of `reflectance` at `range`, square on.
    /// Infinite for a detector that never misses.
    pub photons: f64,
    /// Range of the reference target, m.
    pub range: f64,
    /// Reflectance of the reference target.
    pub reflectance: f64,
}

/// Said of a sensitivity that is declared with the probability 1.
const NEVER_MISSES: &str = "never misses";

impl Sensitivity {
    /// How much light it is, in a few words for people.
    fn summary(&self) -> String {
        self.summary_of("mark")
    }

    /// The same where the light of a shot comes in a `part` that is no mark.
    fn summary_of(&self, part: &str) -> String {
        let Self { photons, range, reflectance } = self;
        match photons.is_finite() {
            true => {
                format!("{photons:.2} photons a {part} from reflectance {reflectance} at {range} m")
            }
            false => NEVER_MISSES.to_owned(),
        }
    }
}

/// Noise of an amplitude, in detected photons.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// Without a mark, rms.
    pub rms: f64,
    /// Amplitude that makes an event.
    pub threshold: f64,
    /// Excess noise factor of the multiplication; 1 where there is none.
    pub excess: f64,
}

impl Noise {
    /// Noise of the amplitude of a mark of `photons`, rms.
    pub fn of_mark(&self, photons: f64) -> f64 {
        (photons * self.excess + self.rms.powi(2)).sqrt()
    }
}

/// A mark, and the light beside it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lit {
    /// Photons of the mark, on average.
    pub photons: f64,
    /// Sunlight, 1/s.
    pub background: f64,
    /// All that falls on the detector, 1/s: dark counts, sunlight, and the marks of all shots on
    /// average.
    pub falling: f64,
}

/// An echo that a receiver of single pulses waits for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Awaited {
    /// Time since the range gate opened, s.
    pub since: f64,
    /// Photons of the echo, on average.
    pub photons: f64,
    /// Dark and background counts, 1/s, were the detector always ready.
    pub false_rate: f64,
    /// All that falls on it, 1/s.
    pub falling: f64,
    /// Time between the echoes of two shots, s.
    pub period: f64,
    /// Probability that the echo makes a tick, whatever came before it.
    pub mark_pd: f64,
    /// Share of events that find a converter free.
    pub converted: f64,
}

/// The first event in a range gate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FirstEvent {
    /// Probability that a dark or background count comes before the echo.
    pub is_false: f64,
    /// Probability that none does, and that the echo makes a tick.
    pub is_echo: f64,
}

impl FirstEvent {
    /// For a detector without memory: nothing comes before the echo with the probability exp(−K), K the dark
    /// and background counts until the echo.
    fn without_memory(awaited: &Awaited) -> Self {
        let counts = awaited.false_rate * awaited.since;
        Self { is_false: -libm::expm1(-counts), is_echo: awaited.mark_pd * libm::exp(-counts) }
    }
}

/// Length of a micropulse of `light`, rms, s, as far as it is followed. One photon of it is displaced by this
/// length.
fn length_followed(light: &Light) -> f64 {
    light.spread.unwrap_or(0.0)
}

/// Slices of equal probability over which an error is averaged: of 512 the averages differ by less
/// than 0.2 %.
const SLICES: u32 = 32;

/// Middles of [`SLICES`] slices of equal probability, the highest first, of a normal variable above
/// `threshold`. The variable has this `mean` and `spread`.
fn slices_above(threshold: f64, mean: f64, spread: f64) -> impl Iterator<Item = f64> {
    let spread = spread.max(f64::MIN_POSITIVE);
    let above = normal_tail((threshold - mean) / spread).max(f64::MIN_POSITIVE);
    (0..SLICES).map(move |slice| {
        let beyond = above * (f64::from(slice) + 0.5) / f64::from(SLICES);
        (mean - spread * normal_quantile(beyond)).max(threshold)
    })
}

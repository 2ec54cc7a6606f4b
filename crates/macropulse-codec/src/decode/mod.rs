//! Ticks, samples, histograms, taps or beats to returns: the receiver. It sees these and the shot log, never the scene.

pub mod beat;
pub mod belief;
pub mod histogram;
pub mod phase;

mod balanced;
mod beyond;
mod bitwise;
mod check;
mod direct;
mod energy;
mod error;
mod explain;
mod field;
mod matched;
mod pick;
mod returns;
mod sampled;
mod threshold;
mod timeline;
mod timing;

pub use beat::BeatMethod;
pub use bitwise::{Bitwise, Opening};
pub use error::Error;
pub use explain::{Accepted, Explanation, OtherLight, Verdict};
pub use histogram::HistogramMethod;
pub use matched::{Effort, Odds, Weighed, neighbours};
pub use phase::PhaseMethod;
pub use pick::{MOST_RETURNS, Pick, Strength};
pub use returns::{Reject, Returns};
pub use sampled::{
    CancelledEcho, Coupling, Light, MarkSeen, MarkState, Refusal, STEPS_OF_TICK, Sampled,
    SampledExplanation, Sampling, Tested,
};

use std::ops::Range;

use serde::Deserialize;

use crate::code::Codebook;
use crate::{Record, RecordKind, ShotLog, Ticks, time};
use energy::{Energy, Window};
use returns::Return;

/// A receiver, as it is set.
#[derive(Debug, Clone, PartialEq)]
pub struct Receiver {
    /// Length of a tick, fs.
    pub tick_fs: i64,
    /// Nearest and farthest round trip accepted, in ticks.
    pub gate_ticks: (u32, u32),
    /// Returns of a shot at most, 1 to [`MOST_RETURNS`]. The bitwise and the balanced method give
    /// one whatever this says.
    pub returns: u8,
    /// Which surfaces are kept if a shot has met more of them.
    pub pick: Pick,
    /// How it decodes.
    pub method: Method,
}

/// How a receiver decodes, with the settings of that method alone.
#[derive(Debug, Clone, PartialEq)]
pub enum Method {
    /// One mark per shot, a detector of its own: takes the ticks in the range gate.
    Direct,
    /// Reads bit by bit, without knowing what was sent.
    Bitwise(Bitwise),
    /// Correlates the whole known macropulse of every shot in flight.
    Matched(Correlation, Effort),
    /// Correlates, and counts light on dark chips against the macropulse; for words with about half of their chips lit.
    Balanced(Correlation),
    /// Correlates samples: adds up the marks of a word, and takes away what was explained.
    Sampled(Sampled),
    /// Finds pulses in histograms of counts.
    Histogram(HistogramMethod),
    /// Measures the phase of modulated light.
    Phase(PhaseMethod),
    /// Measures the beat frequencies of light whose frequency is modulated.
    Beat(BeatMethod),
}

/// Settings of a receiver that correlates ticks with known macropulses.
#[derive(Debug, Clone, PartialEq)]
pub struct Correlation {
    /// TDC ticks per chip.
    pub ticks_per_chip: u32,
    /// Farthest round trip from which light of the shots may come although it is not accepted, in
    /// ticks.
    pub light_ticks: u32,
    /// Standard deviation of the timing of one detection event, in ticks: how far from its place a
    /// mark is looked for.
    pub jitter_ticks: f64,
    /// True if each photon of a mark makes an event at a time of its own, instead of the mark making one.
    /// Then one of many comes nearly always where the mark is looked for.
    pub photons_apart: bool,
    /// False returns accepted per shot; the threshold follows from it.
    pub false_alarm: f64,
}

impl Correlation {
    /// The jitter that is decoded, in ticks.
    fn jitter(&self) -> f64 {
        self.jitter_ticks.min(MOST_JITTER)
    }
}

impl Default for Correlation {
    /// A chip to a tick, exact timing, light from up to 100 000 ticks, and one false return in a
    /// million shots.
    fn default() -> Self {
        Self {
            ticks_per_chip: 1,
            light_ticks: 100_000,
            jitter_ticks: 0.0,
            photons_apart: false,
            false_alarm: 1e-6,
        }
    }
}

/// The list of all kinds of receivers: variant, method, name, the record that it decodes, and returns of a shot at
/// most. Sensor files and their schema, the command line and the Python package take the names from here.
macro_rules! kinds {
    ($($(#[doc = $doc:literal])+ $Kind:ident, $method:pat => $name:literal, $Record:ident, $returns:expr;)+) => {
        /// The name of a receiver.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
        #[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
        pub enum ReceiverKind {
            $($(#[doc = $doc])+ #[serde(rename = $name)] $Kind,)+
        }

        impl ReceiverKind {
            /// All kinds.
            pub const ALL: &[Self] = &[$(Self::$Kind),+];

            /// Its name in sensor files and commands.
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$Kind => $name,)+
                }
            }

            /// A sentence that says what it does.
            pub fn summary(self) -> &'static str {
                match self {
                    $(Self::$Kind => concat!($($doc),+).trim_ascii_start(),)+
                }
            }

            /// The kind of record that it decodes.
            pub fn record(self) -> RecordKind {
                match self {
                    $(Self::$Kind => RecordKind::$Record,)+
                }
            }

            /// Returns of a shot that it can give at most.
            pub fn most_returns(self) -> u8 {
                match self {
                    $(Self::$Kind => $returns,)+
                }
            }
        }

        impl Method {
            /// The kind of receiver that has this method.
            pub fn kind(&self) -> ReceiverKind {
                match self {
                    $($method => ReceiverKind::$Kind,)+
                }
            }
        }
    };
}

kinds! {
    /// As the paper prints it: bit by bit from the first light on.
    Literal, Self::Bitwise(Bitwise { opening: Opening::FirstBit, .. }) => "literal", Ticks, 1;
    /// Bit by bit, but tries how many leading zero bits were dark.
    Blind, Self::Bitwise(Bitwise { opening: Opening::AnyBit, .. }) => "blind", Ticks, 1;
    /// Correlates the whole known macropulse of every shot in flight.
    Matched, Self::Matched(..) => "matched", Ticks, matched::MOST_RETURNS;
    /// As `matched`, but light on dark chips counts against it; for words with about half of their chips lit.
    Balanced, Self::Balanced(_) => "balanced", Ticks, 1;
    /// For shots without a code: the ticks in the range gate.
    Direct, Self::Direct => "direct", Ticks, MOST_RETURNS;
    /// As `matched`, of a sampled detector: adds up the samples of the marks of every shot in flight.
    Sampled, Self::Sampled(_) => "sampled", Samples, MOST_RETURNS;
    /// For bursts of pulses that are counted in a histogram: the pulses that stand out of its background.
    Histogram, Self::Histogram(_) => "histogram", Histograms, MOST_RETURNS;
    /// For modulated light: the phase of each modulation frequency, and the range that has all of them.
    Phase, Self::Phase(_) => "phase", Taps, 1;
    /// For light whose frequency is modulated: the range and the radial velocity that the beats of both ramps have.
    Beat, Self::Beat(_) => "beat", Beats, MOST_RETURNS;
}

impl Method {
    /// The kind of record that it decodes.
    fn record(&self) -> RecordKind {
        self.kind().record()
    }

    /// Settings of its correlation, if it correlates ticks.
    pub fn correlation(&self) -> Option<&Correlation> {
        match self {
            Self::Matched(correlation, _) | Self::Balanced(correlation) => Some(correlation),
            _ => None,
        }
    }

    /// The signal as it knows it, if it is given samples.
    pub fn sampling(&self) -> Option<&Sampling> {
        match self {
            Self::Sampled(Sampled { sampling, .. }) => Some(sampling),
            _ => None,
        }
    }

    /// Ticks per chip of the code words; `None` without a code.
    pub fn ticks_per_chip(&self) -> Option<u32> {
        match self {
            Self::Bitwise(settings) => Some(settings.ticks_per_chip),
            Self::Sampled(settings) => Some(settings.ticks_per_chip),
            _ => self.correlation().map(|correlation| correlation.ticks_per_chip),
        }
    }

    /// Farthest round trip, in ticks, from which it looks for light beyond the gate; 0 if it does not.
    fn light_ticks(&self) -> u32 {
        match self {
            Self::Sampled(settings) => settings.light_ticks,
            _ => self.correlation().map_or(0, |correlation| correlation.light_ticks),
        }
    }

    /// Standard deviation of the timing of an event, in ticks; 0 if it looks for a mark in its place
    /// alone.
    fn jitter_ticks(&self) -> f64 {
        match self {
            Self::Bitwise(settings) => settings.jitter_ticks,
            _ => self.correlation().map_or(0.0, |correlation| correlation.jitter_ticks),
        }
    }

    /// False returns accepted per shot, if its threshold follows from them.
    fn false_alarm(&self) -> Option<f64> {
        match self {
            Self::Sampled(settings) => Some(settings.false_alarm),
            Self::Histogram(settings) => Some(settings.false_alarm),
            Self::Phase(settings) => Some(settings.false_alarm),
            Self::Beat(settings) => Some(settings.false_alarm),
            _ => self.correlation().map(|correlation| correlation.false_alarm),
        }
    }
}

/// The refusal of a record that `method` does not decode.
fn wrong(method: &Method, given: RecordKind) -> Error {
    Error::Record { wants: method.record().name(), given: given.name() }
}

/// Gates in a block: the shots fired in that time are decoded together. They are enough more than those in flight that
/// the overlap of blocks, which is looked at twice, costs little.
const GATES_PER_BLOCK: i64 = 2;

/// Ticks before the first light and behind the last that are looked at, so that a mark may jitter.
const MARGIN: i64 = 2048;

/// Place in its tick at which light comes that only one tick shows.
const MIDDLE: f64 = 0.5;

/// The most jitter that is decoded as such, in ticks. A mark is looked for 2 σ to both sides of its place, so
/// this limits the ticks that are looked at.
const MOST_JITTER: f64 = 255.0;

impl Receiver {
    /// Returns a matched receiver of ticks of `tick_fs` femtoseconds. It has a chip to a tick, timing exact
    /// to the tick, a gate from 0 to 100 000 ticks, and accepts one false return in a million shots.
    pub fn matched(tick_fs: i64) -> Self {
        Self {
            tick_fs,
            gate_ticks: (0, 100_000),
            returns: 1,
            pick: Pick::Strongest,
            method: Method::Matched(Correlation::default(), Effort::Quick),
        }
    }

    /// Checks that it can decode shots sent with `codebook`. [`Receiver::decode`] checks it first. A caller can check
    /// it before there is anything to decode.
    ///
    /// # Errors
    /// If a setting is outside its limits, or the code words are not understood or too long.
    pub fn check(&self, codebook: &Codebook) -> Result<(), Error> {
        check::settings(self, codebook)
    }

    /// Returns the lags at which a receiver that correlates ticks looks for light of macropulses of `length`
    /// ticks. These are the lags of the gate, and all beyond it from which light may come, a macropulse
    /// farther at least.
    pub fn lags_of_light(&self, correlation: &Correlation, length: i64) -> Range<i64> {
        let (nearest, farthest) = self.gate_ticks;
        let end = i64::from(correlation.light_ticks).max(i64::from(farthest) + length) + 1;
        (i64::from(nearest) - length).max(0)..end
    }

    /// For how many ticks from its earliest place on a mark is looked for.
    pub fn window_ticks(&self) -> u32 {
        window(self.method.jitter_ticks())
    }

    /// Decodes the owned shots of `log` out of the `record` of its band: all its ticks, samples, histograms,
    /// taps or beats. The returns are ordered by shot, those of one shot by range.
    ///
    /// The record must cover the whole time in which light of an owned shot can arrive. Guard shots are
    /// decoded too, as their light overlaps, and dropped. Each channel is decoded by itself; labels and words
    /// must be in the `codebook`.
    ///
    /// A tick t of length τ is taken for the time (t + ½)·τ, so that rounding down to whole ticks does not
    /// bring everything nearer. A sample is of the time t·τ.
    ///
    /// # Errors
    /// If the record cannot be decoded by any receiver: it is of another kind, columns differ in length, or
    /// ticks or shots are out of order. Also if shots are not in the codebook, times are not counted, or
    /// settings are out of their limits. Light in which nothing is found is no error.
    pub fn decode<'a>(
        &self,
        codebook: &Codebook,
        log: &ShotLog,
        record: impl Into<Record<'a>>,
    ) -> Result<Returns, Error> {
        let record = record.into();
        check::check(self, (codebook, log), record)?;
        match (record, &self.method) {
            (Record::Ticks(ticks), method) if method.record() == RecordKind::Ticks => {
                self.decode_ticks(codebook, log, ticks)
            }
            (Record::Samples(samples), Method::Sampled(_)) if samples.is_empty() => {
                Ok(self.nothing_of(log.owned.len()))
            }
            (Record::Samples(samples), Method::Sampled(settings)) => {
                Ok(sampled::decode(self, settings, (codebook, log), samples))
            }
            (Record::Histograms(histograms), Method::Histogram(settings)) => {
                histogram::decode_band(self, settings, log, histograms)
            }
            (Record::Taps(taps), Method::Phase(settings)) => {
                phase::decode_band(self, settings, log, taps)
            }
            (Record::Beats(beats), Method::Beat(settings)) => {
                beat::decode_band(self, settings, log, beats)
            }
            (record, method) => Err(wrong(method, record.kind())),
        }
    }

    /// The returns of ticks that were checked, but for their order where the method sees to it.
    fn decode_ticks(
        &self,
        codebook: &Codebook,
        log: &ShotLog,
        ticks: &Ticks,
    ) -> Result<Returns, Error> {
        let sent = (codebook, log);
        Ok(match &self.method {
            _ if ticks.tick.is_empty() || log.is_empty() => {
                check::in_order(&ticks.tick, 0..ticks.tick.len())?;
                self.nothing_of(log.owned.len())
            }
            Method::Direct => direct::decode(self, log, ticks),
            _ if !ticks.channel.is_empty() => self.decode_each_channel(codebook, log, ticks)?,
            Method::Bitwise(settings) => bitwise::decode(self, settings, sent, ticks),
            Method::Matched(settings, effort) => {
                matched::decode(self, settings, *effort, sent, ticks)?
            }
            Method::Balanced(settings) => balanced::decode(self, settings, sent, ticks),
            method => return Err(wrong(method, RecordKind::Ticks)),
        })
    }

    /// The result for `shots` owned shots in the dark. A receiver that goes from tick to tick counts none of them.
    fn nothing_of(&self, shots: usize) -> Returns {
        let mut returns = Returns::default();
        if !matches!(self.method, Method::Bitwise(_)) {
            returns.rejects[Reject::NoPeak as usize] = shots as u64;
        }
        returns
    }

    /// The returns of a sensor whose shots do not all have the same detector.
    fn decode_each_channel(
        &self,
        codebook: &Codebook,
        log: &ShotLog,
        ticks: &Ticks,
    ) -> Result<Returns, Error> {
        let mut found: Vec<Return> = Vec::new();
        let mut returns = Returns::default();
        for (shots, log) in log.each_channel() {
            let of_channel =
                self.decode_ticks(codebook, &log, &of_channel(ticks, log.channel[0]))?;
            found.extend(of_channel.each().map(|one| Return { shot: shots[one.shot], ..one }));
            returns.add_rejects(&of_channel);
        }
        // Stable: the returns of a shot stay in their order.
        found.sort_by_key(|one| one.shot);
        found.into_iter().for_each(|one| returns.push(one));
        Ok(returns)
    }

    /// The range gate, fs: from the beginning of its first tick to the end of its last one.
    pub fn gate_fs(&self) -> (i64, i64) {
        let (nearest, farthest) = self.gate_ticks;
        let fs = |ticks: u32| i64::from(ticks).saturating_mul(self.tick_fs);
        (fs(nearest), fs(farthest.saturating_add(1)))
    }

    /// The absolute tick in which `shot` was fired.
    fn fired(&self, log: &ShotLog, shot: usize) -> i64 {
        log.fired_at_fs[shot].div_euclid(self.tick_fs)
    }

    /// The ticks in which the shots were fired, from tick `epoch` on.
    fn fired_since(&self, log: &ShotLog, epoch: i64) -> Vec<i64> {
        // Whole numbers up to here are exact as floating-point ones, and a quotient of two is wrong by one at
        // most. A division of whole numbers takes several times as long.
        const EXACT: i64 = 1 << 52;
        let Some(&first) = log.fired_at_fs.first() else { return Vec::new() };
        let (start, rest) = (first.div_euclid(self.tick_fs), first.rem_euclid(self.tick_fs));
        let ticks = |fired: &i64| {
            let since = fired - first + rest;
            if since.abs() >= EXACT {
                return fired.div_euclid(self.tick_fs) - epoch;
            }
            let about = (since as f64 / self.tick_fs as f64) as i64;
            let over = since - about * self.tick_fs;
            start - epoch + about + i64::from(over >= self.tick_fs) - i64::from(over < 0)
        };
        log.fired_at_fs.iter().map(ticks).collect()
    }

    /// Returns a function that gives the two-way time of flight, s, by the time at which light left, fs, and
    /// the tick in which it came. It came `late` ticks after that tick began: half a tick, if no more is
    /// known.
    fn tof(&self, late: f64) -> impl Fn(i64, i64) -> f64 + use<> {
        let (tick_fs, late) = (self.tick_fs, late * time::s_from_fs(self.tick_fs));
        move |fired_at_fs, tick| time::s_from_fs(tick * tick_fs - fired_at_fs) + late
    }
}

/// The ticks of one `channel`; all where no tick has a channel.
fn of_channel(ticks: &Ticks, channel: u16) -> Ticks {
    if ticks.channel.is_empty() {
        return ticks.clone();
    }
    let from = ticks.channel.partition_point(|other| *other < channel);
    let to = ticks.channel.partition_point(|other| *other <= channel);
    Ticks {
        epoch: ticks.epoch,
        tick: ticks.tick[from..to].to_vec(),
        channel: Vec::new(),
        amplitude: ticks.amplitude.get(from..to).map(<[f32]>::to_vec).unwrap_or_default(),
    }
}

/// For how many ticks from its earliest place on a mark is looked for: ±2 σ of the jitter and the
/// tick itself, which holds 19 of 20 marks. Below σ = 1/20 tick hardly any mark leaves its tick.
fn window(jitter: f64) -> u32 {
    let jitter = jitter.min(MOST_JITTER);
    if jitter > 0.05 { 1 + (4.0 * jitter).ceil() as u32 } else { 1 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shots_are_fired_in_the_tick_that_holds_their_time() {
        let receiver = Receiver::matched(2497);
        for first in [0, 7, -2498, 10_i64.pow(17) + 1] {
            let times = [0, 1, 2489, 2490, 2496, 2497, -1, -2497, 2497 * 2497, 1 << 51, 1 << 53];
            let fired_at_fs: Vec<i64> = times.iter().map(|time| first + time).collect();
            let expected: Vec<i64> = fired_at_fs.iter().map(|time| time.div_euclid(2497)).collect();
            let log = ShotLog { fired_at_fs, ..ShotLog::default() };
            assert_eq!(receiver.fired_since(&log, 0), expected);
        }
    }

    #[test]
    fn the_window_grows_with_the_jitter() {
        assert_eq!([0.0, 0.05, 0.1, 0.4, 1.0, 2.0].map(window), [1, 1, 2, 3, 5, 9]);
    }
}

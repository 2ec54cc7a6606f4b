//! Ticks, samples or histograms to returns: the receiver. It sees these and the shot log, never the scene.

pub mod histogram;

mod balanced;
mod beyond;
mod bitwise;
mod check;
mod direct;
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

pub use error::Error;
pub use explain::{Accepted, Explanation, OtherLight, Verdict};
pub use pick::{MOST_RETURNS, Pick, Strength};
pub use returns::{Reject, Returns};
pub use sampled::{
    CancelledEcho, Coupling, Light, MarkSeen, MarkState, Refusal, STEPS_OF_TICK,
    SampledExplanation, Sampling, Tested,
};

use serde::Deserialize;

use crate::code::Codebook;
use crate::{Record, ShotLog, Ticks, time};
use returns::Return;

/// Which receiver decodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ReceiverKind {
    /// As printed in \[KP16\]: the first mark opens a macropulse, bit by bit, checksum, look-up.
    Literal,
    /// Bit by bit, but tries how many leading zero bits were dark.
    Blind,
    /// Correlates the whole known macropulse of every shot in flight.
    Matched,
    /// As `Matched`, but what falls on dark chips counts against it; for words of which about half
    /// the chips are lit.
    Balanced,
    /// One mark per shot, a detector of its own: the ticks in the range gate.
    Direct,
    /// As `Matched`, of samples: the marks of a word are added up, and what was explained is taken
    /// away.
    Sampled,
}

/// How much the matched receiver does for faint light.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Effort {
    /// Searches for one shot in so many where light is faint, finds the others from there, and
    /// passes by what lies evenly over everything: a target that is barely seen may be lost where
    /// it stands alone or fills the whole field.
    Quick,
    /// Searches for every shot that is not found otherwise; takes many times as long in noise.
    Thorough,
}

/// What the receiver is set to.
#[derive(Debug, Clone, PartialEq)]
pub struct Receiver {
    /// Which receiver decodes.
    pub kind: ReceiverKind,
    /// How much the matched receiver does for faint light.
    pub effort: Effort,
    /// Nearest and farthest round trip accepted, in ticks.
    pub gate_ticks: (u32, u32),
    /// Farthest round trip from which light of the shots may come although it is not accepted, in
    /// ticks: the matched and the sampled receiver find and cancel light up to there.
    pub light_ticks: u32,
    /// TDC ticks per chip.
    pub ticks_per_chip: u32,
    /// Length of a tick, fs.
    pub tick_fs: i64,
    /// Standard deviation of the timing of one detection event, in ticks: how far from its place a
    /// mark is looked for.
    pub jitter_ticks: f64,
    /// Whether each photon of a mark makes an event at a time of its own, and not the mark one: then
    /// one of many comes nearly always where the mark is looked for.
    pub photons_apart: bool,
    /// False returns accepted per shot; the matched, the balanced and the sampled receiver derive
    /// their threshold from it.
    pub false_alarm: f64,
    /// Marks of a code word that make a 1 bit, for the literal and the blind receiver.
    pub bit_threshold: u16,
    /// Returns of a shot at most, 1 to [`MOST_RETURNS`]. The literal, the blind and the balanced
    /// receiver give one whatever this says.
    pub returns: u8,
    /// Which surfaces are kept if a shot has met more of them.
    pub pick: Pick,
    /// What it knows of the signal that is sampled; of the sampled receiver, and of no other.
    pub sampling: Option<Sampling>,
}

/// The shots that are fired while light passes the gate so many times are decoded together: so many
/// more than are in flight that what is looked at twice, at both ends of a block, costs little.
const GATES_PER_BLOCK: i64 = 2;

/// Ticks before the first light and behind the last that are looked at, so that a mark may jitter.
const MARGIN: i64 = 2048;

/// Where in its tick light comes that only one tick tells of.
const MIDDLE: f64 = 0.5;

/// The most jitter that is decoded as such, in ticks: a mark is looked for 2 σ to both sides of its place,
/// and the ticks that are looked at are limited thereby.
const MOST_JITTER: f64 = 255.0;

impl ReceiverKind {
    /// Returns of a shot that this receiver can give at most.
    pub fn most_returns(self) -> u8 {
        match self {
            Self::Literal | Self::Blind | Self::Balanced => 1,
            Self::Matched => matched::MOST_RETURNS,
            Self::Direct | Self::Sampled => MOST_RETURNS,
        }
    }
}

impl Receiver {
    /// A matched receiver of ticks of `tick_fs` femtoseconds, a chip to a tick, timed exact to the
    /// tick, a gate from 0 to 100 000 ticks, and one false return in a million shots accepted.
    pub fn matched(tick_fs: i64) -> Self {
        Self {
            kind: ReceiverKind::Matched,
            effort: Effort::Quick,
            gate_ticks: (0, 100_000),
            light_ticks: 100_000,
            ticks_per_chip: 1,
            tick_fs,
            jitter_ticks: 0.0,
            photons_apart: false,
            false_alarm: 1e-6,
            bit_threshold: 1,
            returns: 1,
            pick: Pick::Strongest,
            sampling: None,
        }
    }

    /// Whether it can decode what is sent with `codebook`. [`Receiver::decode`] asks it first; who makes a
    /// receiver can ask it before there is anything to decode.
    ///
    /// # Errors
    /// If a setting is outside its limits, or the code words are not understood or too long.
    pub fn check(&self, codebook: &Codebook) -> Result<(), Error> {
        check::settings(self, codebook)
    }

    /// For how many ticks from its earliest place on a mark is looked for.
    pub fn window_ticks(&self) -> u32 {
        window(self.jitter())
    }

    /// The returns of the owned shots of `log`, out of all the ticks or samples of its band, the
    /// `record`, ordered by shot, those of one shot by range.
    ///
    /// The record must cover the whole time in which light of an owned shot can arrive. Guard shots
    /// are decoded too, as their light overlaps, and dropped. Each channel is decoded by itself;
    /// labels and words must be in the `codebook`.
    ///
    /// A tick t of length τ is taken for the time (t + ½)·τ, so that rounding down to whole ticks
    /// does not bring everything nearer; a sample is of the time t·τ.
    ///
    /// # Errors
    /// If what is given cannot be decoded by any receiver: a record of another kind,
    /// columns of unequal length, ticks or shots out of order, shots that are not in the codebook, times that are not counted, settings out of
    /// their limits. Light in which nothing is found is no error.
    pub fn decode<'a>(
        &self,
        codebook: &Codebook,
        log: &ShotLog,
        record: impl Into<Record<'a>>,
    ) -> Result<Returns, Error> {
        let record = record.into();
        check::check(self, (codebook, log), record)?;
        match (record, &self.sampling) {
            (Record::Ticks(ticks), _) => self.decode_checked(codebook, log, ticks),
            (Record::Samples(samples), Some(sampling)) if !samples.is_empty() => {
                Ok(sampled::decode(self, codebook, (log, samples), sampling))
            }
            (Record::Samples(_), _) => Ok(self.nothing_of(log.owned.len())),
        }
    }

    /// The returns, of what was checked but for the order of what the matched receiver is given.
    fn decode_checked(
        &self,
        codebook: &Codebook,
        log: &ShotLog,
        ticks: &Ticks,
    ) -> Result<Returns, Error> {
        if ticks.tick.is_empty() || log.is_empty() {
            check::in_order(&ticks.tick, 0..ticks.tick.len())?;
            return Ok(self.nothing_of(log.owned.len()));
        }
        if self.kind != ReceiverKind::Direct && !ticks.channel.is_empty() {
            return self.decode_each_channel(codebook, log, ticks);
        }
        Ok(match self.kind {
            ReceiverKind::Direct => direct::decode(self, log, ticks),
            ReceiverKind::Sampled => self.nothing_of(log.owned.len()),
            ReceiverKind::Matched => matched::decode(self, (codebook, log), ticks)?,
            ReceiverKind::Balanced => self.balance(codebook, log, ticks),
            ReceiverKind::Literal => {
                bitwise::decode(self, (codebook, log), (ticks, bitwise::Opening::FirstBit))
            }
            ReceiverKind::Blind => {
                bitwise::decode(self, (codebook, log), (ticks, bitwise::Opening::AnyBit))
            }
        })
    }

    /// What comes of so many owned shots where it is dark. A receiver that goes from tick to tick
    /// counts none of them.
    fn nothing_of(&self, shots: usize) -> Returns {
        let mut returns = Returns::default();
        if !matches!(self.kind, ReceiverKind::Literal | ReceiverKind::Blind) {
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
            let channel = log.channel[0];
            let from = ticks.channel.partition_point(|other| *other < channel);
            let to = ticks.channel.partition_point(|other| *other <= channel);
            let seen = Ticks {
                epoch: ticks.epoch,
                tick: ticks.tick[from..to].to_vec(),
                channel: Vec::new(),
                amplitude: ticks.amplitude.get(from..to).map(<[f32]>::to_vec).unwrap_or_default(),
            };
            let of_channel = self.decode_checked(codebook, &log, &seen)?;
            found.extend(of_channel.each().map(|one| Return { shot: shots[one.shot], ..one }));
            returns.add_rejects(&of_channel);
        }
        // Stable: the returns of a shot stay in their order.
        found.sort_by_key(|one| one.shot);
        found.into_iter().for_each(|one| returns.push(one));
        Ok(returns)
    }

    /// The returns of the balanced receiver.
    ///
    /// It looks beyond the end of the gate by the length of a macropulse: what stands there has
    /// sidelobes within the gate, and is told from them by being higher. Only then is it refused.
    fn balance(&self, codebook: &Codebook, log: &ShotLog, ticks: &Ticks) -> Returns {
        let (nearest, farthest) = self.gate_ticks;
        let length = codebook.chips() * self.ticks_per_chip;
        let gate_ticks = (nearest, farthest.saturating_add(length));
        let wide = Self { gate_ticks, ..self.clone() };
        let mut returns = balanced::decode(&wide, (codebook, log), ticks);
        let closes = time::s_from_fs((i64::from(farthest) + 1) * self.tick_fs);
        returns.refuse_beyond(closes);
        beyond::exclude(self, (codebook, log), ticks, &mut returns);
        returns
    }

    /// The jitter that is decoded, in ticks.
    fn jitter(&self) -> f64 {
        self.jitter_ticks.min(MOST_JITTER)
    }

    /// The absolute tick in which `shot` was fired.
    fn fired(&self, log: &ShotLog, shot: usize) -> i64 {
        log.fired_at_fs[shot].div_euclid(self.tick_fs)
    }

    /// The ticks in which the shots were fired, from tick `epoch` on.
    fn fired_since(&self, log: &ShotLog, epoch: i64) -> Vec<i64> {
        // Whole numbers up to here are exact as floating-point ones, and a quotient of two is
        // wrong by one at most; a division of whole numbers takes several times as long.
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

    /// Two-way time of flight, s, of light that left at `fired_at_fs` and came `late` ticks after
    /// `tick` began: half a tick, where no more is known.
    fn tof(&self, fired_at_fs: i64, tick: i64, late: f64) -> f64 {
        self.tofs(late)(fired_at_fs, tick)
    }

    /// The same for many that come as `late`: what they have in common is worked out once.
    fn tofs(&self, late: f64) -> impl Fn(i64, i64) -> f64 + use<> {
        let (tick_fs, late) = (self.tick_fs, late * time::s_from_fs(self.tick_fs));
        move |fired_at_fs, tick| time::s_from_fs(tick * tick_fs - fired_at_fs) + late
    }
}

/// For how many ticks from its earliest place on a mark is looked for: ±2 σ of the jitter and the
/// tick itself, which holds 19 of 20 marks. Below σ = 1/20 tick hardly any mark leaves its tick.
fn window(jitter: f64) -> u32 {
    if jitter > 0.05 { 1 + (4.0 * jitter).ceil() as u32 } else { 1 }
}

/// The energy of a return as a count of marks tells it.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Energy {
    /// Mean number of photons detected per mark.
    photons: f32,
    /// Whether it may be more: no mark was missed.
    saturated: bool,
}

impl Energy {
    /// Of `peak` of `marks` found where a share `density` of all places is lit anyway.
    ///
    /// A share p = (k/N − d)/(1 − d) of the marks shows a photon at least in the `window` they are
    /// looked for in, which holds a share c of what they make. Where each makes one event, p/c of them
    /// do, and μ = −ln(1 − p/c) photons were detected on average (Poisson); where each photon makes one,
    /// μ = −ln(1 − p)/c. From N − ½ marks on the count tells no more: μ is a lower bound.
    fn of((peak, marks): (u32, u32), density: f64, window: Window) -> Self {
        let all = f64::from(marks);
        let most = (all - 0.5) / all;
        let (of_marks, of_photons) = match window.photons_apart {
            true => (1.0, window.coverage),
            false => (window.coverage, 1.0),
        };
        let lit = (f64::from(peak) / all - density) / (1.0 - density) / of_marks;
        let saturated = peak >= marks || lit >= most;
        let share = if saturated { most } else { lit.max(0.0) };
        Self { photons: (-libm::log1p(-share) / of_photons) as f32, saturated }
    }
}

/// Where the events of a mark are looked for.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Window {
    /// Share of them that come there.
    coverage: f64,
    /// As [`Receiver::photons_apart`].
    photons_apart: bool,
}

impl Window {
    /// Holds all of them.
    const WHOLE: Self = Self { coverage: 1.0, photons_apart: false };
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shots_are_fired_in_the_tick_that_holds_their_time() {
        let receiver = Receiver {
            kind: ReceiverKind::Matched,
            effort: Effort::Quick,
            gate_ticks: (0, 1),
            light_ticks: 1,
            ticks_per_chip: 1,
            tick_fs: 2497,
            jitter_ticks: 0.0,
            photons_apart: false,
            false_alarm: 0.1,
            bit_threshold: 1,
            returns: 1,
            pick: Pick::Strongest,
            sampling: None,
        };
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

    #[test]
    fn photons_follow_from_the_share_of_marks_seen() {
        let photons = |found, density| Energy::of((found, 100), density, Window::WHOLE).photons;
        approx::assert_relative_eq!(photons(63, 0.0), 0.994, max_relative = 1e-3);
        // Half of the places are lit anyway: 75 of 100 lit are 50 of 100 seen.
        let ln_2 = std::f32::consts::LN_2;
        approx::assert_relative_eq!(photons(75, 0.5), ln_2, max_relative = 1e-3);
        // Half of the marks fall within the window: 25 of 100 found are 50 of 100 seen.
        let half = |photons_apart| Window { coverage: 0.5, photons_apart };
        let half_covered = Energy::of((25, 100), 0.0, half(false));
        approx::assert_relative_eq!(half_covered.photons, ln_2, max_relative = 1e-3);
        assert!(!half_covered.saturated);
        // Half of the photons do: where half of the marks show one there, there were 2·ln 2 of each.
        let thinned = Energy::of((50, 100), 0.0, half(true));
        approx::assert_relative_eq!(thinned.photons, 2.0 * ln_2, max_relative = 1e-3);
        assert_eq!(photons(1, 0.2), 0.0);
    }

    #[test]
    fn where_no_mark_is_missed_the_count_tells_a_lower_bound() {
        let whole = Energy::of((100, 100), 0.0, Window::WHOLE);
        assert!(whole.saturated);
        approx::assert_relative_eq!(whole.photons, 200_f32.ln(), max_relative = 1e-6);
        let most = Window { coverage: 0.95, photons_apart: false };
        // 94 of the 95 that the window holds are not all of them; the 95th would be.
        assert_eq!(
            [94, 95].map(|found| Energy::of((found, 100), 0.0, most).saturated),
            [false, true]
        );
        assert_eq!(
            Energy::of((1, 1), 0.0, Window::WHOLE),
            Energy { photons: ln_2(), saturated: true }
        );
    }

    fn ln_2() -> f32 {
        std::f32::consts::LN_2
    }
}

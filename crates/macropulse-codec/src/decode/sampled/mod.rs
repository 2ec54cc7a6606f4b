//! The receiver of samples: it adds up the heights at the marks of a word.
//!
//! 0. For an amplifier coupled by a capacitor, the baseline that light has left behind is added to the
//!    samples again ([`coupling`]).
//! 1. A filter matched to the pulse of a mark makes each mark a number of detected photons at one tick
//!    ([`filter`]). The filtered samples also give the strength of the noise. Ticks at which the sensor's own
//!    marks are fired, or that follow clipped samples, tell nothing.
//! 2. For each shot and lag, the marks that tell something are averaged. None counts much more than the
//!    least one, so a bright mark of another shot cannot carry a word alone. A mean above the threshold and
//!    above both lags beside it is a candidate ([`search`]).
//! 3. The strongest candidate is tested again. If it holds, its pulses are taken away from the signal; then
//!    the next one follows. Light that was taken away leaves a doubt, and marks there count only if they stand
//!    out from it, too ([`cancel`]). If a mark is missing, the others must be equally strong. Those that are
//!    not are looked at again at the end, as an edge in a moving spot makes them differ.
//! 4. The range of a return comes from all its marks together, or from the edges of clipped pulses
//!    ([`time`]).
//!
//! An explanation of one shot comes from the same steps ([`explain`]).
//!
//! Channels are decoded one after the other, in twelve bytes of memory for each sample.

mod cancel;
mod coupling;
mod explain;
mod filter;
mod pulse;
mod search;
mod time;

use super::{Receiver, Reject, Return, Returns, Strength};
use crate::code::Codebook;
use crate::statistics::{normal_order, normal_quantile};
use crate::{Samples, ShotLog};
pub use cancel::Refusal;
use cancel::{Found, Residual};
use coupling::Restored;
pub use explain::{CancelledEcho, Light, MarkSeen, MarkState, SampledExplanation, Tested};
use filter::Filtered;
use pulse::Pulse;
use search::Candidate;

pub use coupling::Coupling;

/// Steps of a tick in which [`Sampling::pulse`] is given.
pub const STEPS_OF_TICK: usize = 16;

/// Settings of the receiver of samples.
#[derive(Debug, Clone, PartialEq)]
pub struct Sampled {
    /// Samples per chip.
    pub ticks_per_chip: u32,
    /// Farthest round trip from which light of the shots may come although it is not accepted, in
    /// ticks.
    pub light_ticks: u32,
    /// False returns accepted per shot; the threshold follows from it.
    pub false_alarm: f64,
    /// The signal as it knows it.
    pub sampling: Sampling,
}

/// A receiver's knowledge of the signal that is sampled.
#[derive(Debug, Clone, PartialEq)]
pub struct Sampling {
    /// Shape of a mark of one detected photon in the codes, in steps of 1/[`STEPS_OF_TICK`] tick. The number
    /// of entries is odd, and the middle one is at the time of the mark.
    pub pulse: Vec<f32>,
    /// Excess noise factor F of the multiplication: n photons vary by F·n.
    pub excess: f64,
    /// The highest code: a sample that has it is clipped.
    pub full_scale: i16,
    /// For how many ticks from a mark of its own that is fired on the channel is blind with stray light; 0
    /// where there is none. When that begins to rise, the samples tell.
    pub blank_ticks: u32,
    /// For how many ticks behind a clipped pulse the amplifier stays at its limit.
    pub held_ticks: u32,
    /// For how many ticks behind a clipped sample the signal is not that of the light.
    pub recovery_ticks: u32,
    /// Marks of a word that must tell something, neither blanked nor hidden by brighter light, to decide by
    /// them; of a word of fewer marks all.
    pub least_marks: u16,
    /// Set for an amplifier coupled by a capacitor: the baseline is taken out of the samples first.
    pub coupling: Option<Coupling>,
}

impl Sampling {
    /// Entries of [`Sampling::pulse`] at most: 1024 ticks.
    pub const MOST_ENTRIES: usize = 1024 * STEPS_OF_TICK - 1;

    /// Surplus that a word with a missing mark must reach, in standard deviations of the sum.
    pub const MORE_IF_MISSING: f64 = MISSING as f64;

    /// The matched filter of whole ticks: how much each sample counts, the middle one at the time of the
    /// mark. It makes 1 of a mark of one photon.
    pub fn filter(&self) -> Vec<f32> {
        Pulse::new(self).taps
    }

    /// Ticks by which a mark may be apart from what is blind and still be told: where no more than a tenth of the
    /// energy of the filter is missing.
    pub fn core(&self) -> u32 {
        Pulse::new(self).core() as u32
    }

    /// Standard deviations above its level from which on the signal is light, and no longer counts for the
    /// estimate of the noise.
    pub const STANDS_OUT: f64 = filter::LIGHT as f64;

    /// A mark has light of others if it is this number of standard deviations above the least mark that
    /// counts, in deviations of that one. Such a mark counts for nothing if enough others are left.
    pub const FAR_ABOVE_LEAST: f64 = FAR as f64;

    /// The most that one mark counts, in its own standard deviations above the least of the `counted` marks,
    /// for a word of `marks`.
    pub fn most_above_least(counted: usize, marks: usize) -> f64 {
        let above = f64::from(if counted < marks { ABOVE_IF_MISSING } else { ABOVE });
        match counted {
            0 => above,
            _ => above - normal_order(1.0, counted as f64).0,
        }
    }
}

/// The returns of the owned shots of `log`, of what was checked.
pub(super) fn decode(
    receiver: &Receiver,
    settings: &Sampled,
    (codebook, log): (&Codebook, &ShotLog),
    samples: &Samples,
) -> Returns {
    let mut all: Vec<Return> = Vec::new();
    let mut returns = Returns::default();
    let pulse = Pulse::new(&settings.sampling);
    for (shots, log) in log.each_channel() {
        let codes = log.channel.first().map_or(&[][..], |channel| samples.of(*channel));
        let band = Band::new(receiver, settings, (codebook, &log), samples.epoch);
        let mut found = find(&band, codes, &pulse);
        found.sort_by(|one, other| one.shot.cmp(&other.shot).then(one.at().total_cmp(&other.at())));
        for shot in log.owned.clone() {
            let from = found.partition_point(|one| one.shot < shot);
            let to = found.partition_point(|one| one.shot <= shot);
            let mut within: Vec<Found> =
                found[from..to].iter().filter(|one| is_in_gate(receiver, one)).copied().collect();
            if within.is_empty() {
                returns.reject(if from < to { Reject::OutsideGate } else { Reject::NoPeak });
            }
            // Light with a hidden mark is no weaker for that.
            let strength = |one: &Found| Strength { peak: 0, light: one.photons };
            receiver.pick.keep(receiver.returns.into(), &mut within, strength);
            let tick = samples.epoch + band.fired[shot];
            all.extend(within.iter().map(|one| Return {
                shot: shots[shot],
                tof: receiver.tof(one.late)(log.fired_at_fs[shot], tick + one.lag),
                peak: one.marks,
                marks: band.marks(shot).count() as u16,
                margin: one.margin,
                photons: one.photons,
                saturated: one.is_clipped,
            }));
        }
    }
    // Stable: the returns of a shot stay in their order.
    all.sort_by_key(|one| one.shot);
    all.into_iter().for_each(|one| returns.push(one));
    returns
}

/// Tells if the whole tick nearest to the light is in the gate.
fn is_in_gate(receiver: &Receiver, found: &Found) -> bool {
    let (nearest, farthest) = receiver.gate_ticks;
    (i64::from(nearest)..=i64::from(farthest)).contains(&(found.at().round() as i64))
}

/// All light of the shots of a `band` that is told from noise.
fn find(band: &Band, codes: &[i16], pulse: &Pulse) -> Vec<Found> {
    let sampling = &band.settings.sampling;
    let restored = Restored::of(codes, sampling);
    let (codes, rest) = Restored::parts(&restored, codes);
    let filtered = Filtered::of((codes, rest), pulse, band);
    let rule = Rule::new(band, filtered.sigma);
    let candidates = search::candidates((band, &rule), &filtered);
    let mut residual = Residual::new((codes, sampling), pulse, filtered);
    let mut found = Vec::new();
    look_at(&candidates, &mut residual, |residual, candidate| {
        residual.test(candidate, (band, &rule)).map(|light| found.push(light)).err()
    });
    found
}

/// Tests all `candidates`, one after the other, and those whose marks differ again when all else has been taken
/// away; `test` tells why one is refused.
fn look_at(
    candidates: &[Candidate],
    residual: &mut Residual,
    mut test: impl FnMut(&mut Residual, &Candidate) -> Option<Refusal>,
) {
    let mut put_off = Vec::new();
    for candidate in candidates {
        if test(residual, candidate) == Some(Refusal::MarksDiffer) {
            put_off.push(*candidate);
        }
    }
    residual.look_again();
    for candidate in &put_off {
        test(residual, candidate);
    }
}

/// The shots that one channel listens to.
struct Band<'a> {
    receiver: &'a Receiver,
    settings: &'a Sampled,
    codebook: &'a Codebook,
    log: &'a ShotLog,
    /// When each shot was fired, in ticks from the first sample on.
    fired: Vec<i64>,
    /// Lags that are looked at, from 0 on.
    lags: i64,
}

impl<'a> Band<'a> {
    /// The shots of `log`, of samples from the absolute tick `epoch` on.
    ///
    /// One lag behind the last is needed to tell whether that is a peak. Light from beyond the gate is looked
    /// for where a word tells whose it is. Shots of a single mark are all alike: what comes is taken for an echo
    /// in the gate, as every lidar takes it that waits for its echoes.
    fn new(
        receiver: &'a Receiver,
        settings: &'a Sampled,
        (codebook, log): (&'a Codebook, &'a ShotLog),
        epoch: i64,
    ) -> Self {
        let tells = codebook.words() > 1 || codebook.max_weight() > 1;
        let beyond = if tells { settings.light_ticks } else { 0 };
        let lags = i64::from(receiver.gate_ticks.1.max(beyond)) + 2;
        Self { receiver, settings, codebook, log, fired: receiver.fired_since(log, epoch), lags }
    }

    /// When the marks of `shot` leave, in ticks after it was fired.
    fn marks(&self, shot: usize) -> impl Iterator<Item = i64> + Clone {
        let chip = i64::from(self.settings.ticks_per_chip);
        let marks = self.codebook.marks(self.log.label[shot], self.log.word[shot]);
        marks.iter().map(move |mark| i64::from(*mark) * chip)
    }
}

/// How marks are told from noise.
struct Rule {
    /// Standard deviation of the noise, in detected photons.
    sigma: f32,
    /// Excess noise factor.
    excess: f32,
    /// How many standard deviations the sum of the marks must reach.
    threshold: f32,
    /// Marks that must count.
    fewest: u16,
    /// Mean of the least of n standard normal variables, for each weight of a word.
    least_of: Vec<f32>,
}

/// A mark that counts.
#[derive(Debug, Clone, Copy)]
struct Mark {
    /// In the samples.
    place: usize,
    /// The signal there.
    height: f32,
    /// Standard deviation of what was taken away there.
    doubt: f32,
}

impl Mark {
    /// By how much it is weighed beside one that is certain: by the inverse of its variance.
    fn weight(&self, sigma: f32) -> f32 {
        let share = self.doubt / sigma;
        1.0 / (1.0 + share * share)
    }
}

/// The marks of a word at one lag, together.
#[derive(Debug, Clone, Copy)]
struct Sum {
    /// Their mean, none being more than the cap.
    mean: f32,
    /// The least of those that are certain.
    least: f32,
    most: f32,
    /// How far the marks are apart.
    spread: f32,
    /// Standard deviations of noise alone that the sum is above 0; without a mark far above the least, which is
    /// of others.
    score: f32,
}

/// Standard deviations above the least mark beyond which a mark counts no more. To these comes the distance
/// of the least mark below the mean: 2.5 in all for three marks. Noise alone cuts a mark in nearly one of
/// five words of three marks, which costs 0.04 deviations of their mean.
const ABOVE: f32 = 1.65;

/// The same for a word with a missing mark: 1.36 for two marks. Light of others in one mark then carries
/// noise in the other as rarely as it carries noise in two marks of a word of three. For 3 marks, false
/// points of 3·10⁻⁵ a shot, F 5.6 and σ 36, both happen once in some 3000 lags at which one has such light
/// (2.8 and 3.2·10⁻⁴). With [`ABOVE`] it was eight times as often.
const ABOVE_IF_MISSING: f32 = 0.8;

/// A mark that is this number of standard deviations above the least one has light of others. Noise alone
/// makes two of three marks of one light differ by that once in 200 words.
const FAR: f32 = 5.0;

/// How often the least strength of a mark is bounded by halves, and by what share of the noise that bound is
/// lowered so that no rounding matters.
const HALVINGS: usize = 16;
const TOO_LOW: f32 = 1e-3;

/// Surplus that a word with a missing mark must reach, in standard deviations of the sum.
const MISSING: f32 = 0.5;

impl Rule {
    /// The threshold t is that of noise alone: Q(t) = false returns accepted per shot over the lags of the
    /// gate.
    ///
    /// Sums at neighbouring lags have noise in common. But above a high threshold they hardly exceed it
    /// together without one being the peak, so their number bounds that of independent ones closely. Capped
    /// marks make false returns rarer. In noise alone, words of three marks gave 0.5 to 0.8 of the false
    /// returns accepted, and half of that if a sixth of the marks was blanked.
    fn new(band: &Band, sigma: f32) -> Self {
        let Sampled { false_alarm, sampling, .. } = band.settings;
        let (nearest, farthest) = band.receiver.gate_ticks;
        let lags = f64::from(farthest - nearest) + 1.0;
        let false_alarm = (false_alarm / lags).min(MOST_FALSE);
        let least_of = |weight: usize| match weight {
            0 => 0.0,
            _ => normal_order(1.0, weight as f64).0 as f32,
        };
        Self {
            sigma,
            excess: sampling.excess as f32,
            threshold: -normal_quantile(false_alarm) as f32,
            fewest: sampling.least_marks.max(1),
            least_of: (0..=band.codebook.max_weight()).map(least_of).collect(),
        }
    }

    /// The least number of marks that must count, for a word of `marks`.
    fn fewest(&self, marks: usize) -> usize {
        usize::from(self.fewest).min(marks)
    }

    /// The most that one of the `counted` marks, out of `marks`, counts beside the `least`.
    fn cap(&self, least: f32, (counted, marks): (usize, usize)) -> f32 {
        let above = if counted < marks { ABOVE_IF_MISSING } else { ABOVE };
        least + (above - self.least_of[counted]) * self.deviation(least)
    }

    /// The sum of the marks that count, for a word of `marks`; `None` if no mark counts.
    ///
    /// Each is weighed by the inverse of its variance. The most that one counts follows from the least of
    /// those that are certain, if any is. A mark far above that has light of others, with which a trace of
    /// noise in the rest would do. If enough marks are left without it, the score is theirs, less the surplus
    /// that is asked of fewer marks.
    fn sum(&self, counted: &[Mark], marks: usize) -> Option<Sum> {
        let heights = counted.iter().map(|mark| mark.height);
        let (lowest, most) = (heights.clone().reduce(f32::min)?, heights.reduce(f32::max)?);
        let certain = counted.iter().filter(|mark| mark.doubt == 0.0).map(|mark| mark.height);
        let least = certain.reduce(f32::min).unwrap_or(lowest);
        let cap = self.cap(least, (counted.len(), marks));
        let (mut sum, mut weights) = (0.0, 0.0);
        let mut of_most = 0.0;
        for mark in counted {
            let weight = mark.weight(self.sigma);
            sum += weight * mark.height.min(cap);
            weights += weight;
            if mark.height == most {
                of_most = weight;
            }
        }
        let score = |sum: f32, weights: f32| sum / (weights.sqrt() * self.sigma);
        let is_of_others = most > least + FAR * self.deviation(least)
            && counted.len() > self.fewest(marks)
            && weights > of_most;
        let score = match is_of_others {
            true => score(sum - of_most * cap.min(most), weights - of_most) - MISSING,
            false => score(sum, weights),
        };
        Some(Sum { mean: sum / weights, least, spread: most - lowest, most, score })
    }

    /// The strength of the least of `marks`, in detected photons, at which the others, each up to the cap,
    /// reach the threshold together with it: m + (n − 1)/n·(cap(m) − m) = t·σ/√n. With fewer marks it must be
    /// stronger. Found by halving, and a little too low.
    fn least(&self, marks: usize) -> f32 {
        let count = marks as f32;
        let mean = self.threshold * self.sigma / count.sqrt();
        let reached = |least: f32| {
            least + (count - 1.0) / count * (self.cap(least, (marks, marks)) - least) >= mean
        };
        let widest = (ABOVE - self.least_of[marks]) * self.deviation(mean);
        let (mut low, mut high) = (mean - widest, mean);
        for _ in 0..HALVINGS {
            let middle = (low + high) / 2.0;
            if reached(middle) { high = middle } else { low = middle }
        }
        low - TOO_LOW * self.sigma
    }

    /// Standard deviation of a mark of this number of `photons`.
    fn deviation(&self, photons: f32) -> f32 {
        (self.sigma * self.sigma + self.excess * photons.max(0.0)).sqrt()
    }
}

/// Share of lags at which noise exceeds the threshold at most, whatever is accepted.
const MOST_FALSE: f64 = 0.01;

//! Why a shot was decided as it was, out of samples: the receiver's own search and cancellation, step by
//! step, and what it saw at each mark.

use std::ops::Range;

use super::cancel::{Found, Refusal, Residual};
use super::coupling::Restored;
use super::filter::{Filtered, merged, own_marks};
use super::pulse::Pulse;
use super::search::{Candidate, Search, candidates};
use super::{Band, Rule, look_at};
use crate::code::Codebook;
use crate::decode::explain::{MOST_LAGS, Verdict};
use crate::decode::{Error, Method, Receiver, Returns, check};
use crate::{Samples, ShotLog};

/// Ticks of the signal that are told before the first mark and behind the last one.
const BESIDE: i64 = 32;

/// One shot of a sampled sensor and what became of it. Lags and ticks count from its firing, photons are
/// those that are detected of a mark.
#[derive(Debug, Clone, PartialEq)]
pub struct SampledExplanation {
    /// Index of the shot in the band's log.
    pub shot: usize,
    /// Absolute tick in which it was fired.
    pub fired_tick: i64,
    /// When the marks of its macropulse leave; ascending.
    pub marks: Vec<u32>,
    /// Lags of the gate.
    pub gate: Range<i64>,
    /// Lag of each entry of `score`: this many ticks apart, the first one where the gate begins.
    pub step: i64,
    /// Standard deviation of the noise behind the matched filter, photons.
    pub sigma: f32,
    /// How many standard deviations the sum of all marks must reach.
    pub threshold: f32,
    /// Marks that must tell something.
    pub fewest: u16,
    /// Standard deviations that the sum of the marks is above 0 at each lag, before anything is cancelled;
    /// not a number where too few marks tell anything.
    pub score: Vec<f32>,
    /// The same when its first candidate was tested, or of none at the end: without the light that was found
    /// by then.
    pub left: Vec<f32>,
    /// The signal behind the matched filter about the marks at the first lag of `tested`. First comes the
    /// tick that it begins with, then the signal at first, and then the signal left when that lag was tested.
    pub signal: (i64, Vec<f32>, Vec<f32>),
    /// Lags in the order of their tests: first those whose light is there for certain. If there is none, the
    /// lag with the highest score, as it would have been tested at the end.
    pub tested: Vec<Tested>,
    /// Set if any of them was a candidate.
    pub is_candidate: bool,
    /// Decision of the receiver.
    pub verdict: Verdict,
    /// Echoes of other shots that were cancelled before the first candidate was tested and that have a mark
    /// where this one has one there.
    pub cancelled: Vec<CancelledEcho>,
}

/// A lag at which light of the shot was tested for.
#[derive(Debug, Clone, PartialEq)]
pub struct Tested {
    /// The lag.
    pub lag: i64,
    /// Its marks at that time, one by one.
    pub marks: Vec<MarkSeen>,
    /// Standard deviations that their sum was above 0; `None` where too few counted.
    pub score: Option<f32>,
    /// The score that it had to reach: more if marks were missing. `None` if the test ended earlier.
    pub threshold: Option<f32>,
    /// Result of the test.
    pub outcome: Result<Light, Refusal>,
}

/// Light that was found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Light {
    /// How much later than the lag it came, ticks.
    pub late: f64,
    /// Detected photons per mark.
    pub photons: f32,
    /// Set if its time is that of edges of clipped pulses.
    pub is_clipped: bool,
}

/// A mark as the receiver saw it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MarkSeen {
    /// When it would come.
    pub tick: i64,
    /// The signal behind the matched filter, photons, of what was left.
    pub photons: f32,
    /// Standard deviation of what was cancelled there; infinite where nothing can be told.
    pub doubt: f32,
    /// Its part in the sum.
    pub state: MarkState,
}

/// The part of a mark in the sum, and why it has none.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MarkState {
    /// It counted.
    Counted,
    /// A mark of the sensor's own is leaving: the channel is blind with stray light.
    OwnLight,
    /// Behind clipped light, or where clipped light was found: the signal tells nothing.
    Blind,
    /// Light of others was cancelled there, and what is left may be of that.
    Hidden,
    /// A clipped sample is in its filtered pulse, and another mark is far from being clipped: it is of other
    /// light, or at the rim of it.
    Clipped,
    /// Not in the record.
    Outside,
}

impl MarkState {
    /// A word for it, as files have it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Counted => "counted",
            Self::OwnLight => "own_light",
            Self::Blind => "blind",
            Self::Hidden => "hidden",
            Self::Clipped => "clipped",
            Self::Outside => "outside",
        }
    }
}

/// Light of another shot that was cancelled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CancelledEcho {
    /// Index of the shot in the band's log.
    pub shot: usize,
    /// When its macropulse begins to arrive, in ticks after the explained shot was fired.
    pub begins: i64,
    /// Detected photons per mark.
    pub photons: f32,
    /// Marks of it within the filtered pulse of a mark of the explained shot.
    pub shared: u32,
}

impl Receiver {
    /// Why `shot` of `log` was decided as it was, out of all `samples` of its band. Its channel is decoded
    /// again by the same code, and looked at on the way.
    ///
    /// # Errors
    /// As [`Receiver::decode`], and if there is no such shot.
    pub fn explain_samples(
        &self,
        codebook: &Codebook,
        (log, samples): (&ShotLog, &Samples),
        shot: usize,
    ) -> Result<SampledExplanation, Error> {
        let Method::Sampled(settings) = &self.method else {
            return Err(Error::Record { wants: "ticks", given: "samples" });
        };
        let owned = ShotLog { owned: shot..shot.saturating_add(1), ..log.clone() };
        check::check(self, (codebook, &owned), samples.into())?;
        check::check_lags(self)?;
        let channels = owned.each_channel();
        let of_channel = channels.iter().find(|(shots, _)| shots.contains(&shot));
        let Some((shots, log)) = of_channel else { return Err(Error::NoSuchShot { shot }) };
        // Without samples only the shot matters, and its own tick is the epoch. The epoch of the samples and
        // the times of other shots may be too far away to be counted.
        let alone;
        let (log, epoch, decoded) = if samples.is_empty() {
            alone = log.part(log.owned.clone());
            (&alone, self.fired(&alone, 0), self.nothing_of(1))
        } else {
            let decoded = super::decode(self, settings, (codebook, log), samples);
            (log, samples.epoch, decoded)
        };
        let place = log.owned.start;
        let band = Band::new(self, settings, (codebook, log), epoch);
        let codes = samples.of(log.channel[place]);
        let restored = Restored::of(codes, &settings.sampling);
        let parts = Restored::parts(&restored, codes);
        let explained = Bench::new(&band, parts, place).explained(epoch);
        let told = |echo: &CancelledEcho| CancelledEcho { shot: shots[echo.shot], ..*echo };
        Ok(SampledExplanation {
            shot,
            verdict: Verdict::of(place, &Returns::default(), &decoded),
            cancelled: explained.cancelled.iter().map(told).collect(),
            ..explained
        })
    }
}

/// The channel of one shot, looked at while it is decoded.
struct Bench<'a> {
    band: &'a Band<'a>,
    /// Codes, and what each is more than that: see [`Restored::parts`].
    parts: (&'a [i16], &'a [f32]),
    pulse: Pulse,
    shot: usize,
    /// The marks of the shot at a lag of 0, in the samples.
    marks: Vec<i64>,
    /// When the channel is blind with its own marks.
    own: Vec<Range<i64>>,
}

impl<'a> Bench<'a> {
    fn new(band: &'a Band<'a>, parts: (&'a [i16], &'a [f32]), shot: usize) -> Self {
        let sampling = &band.settings.sampling;
        let pulse = Pulse::new(sampling);
        let marks = band.marks(shot).map(|mark| band.fired[shot] + mark).collect();
        let core = pulse.core() as i64;
        let own = own_marks(parts.0, (&pulse, core), band, sampling.blank_ticks);
        let own = own.into_iter().map(|blind| blind.start - core..blind.end + core);
        Self { band, parts, shot, marks, own: merged(own), pulse }
    }

    /// All but the verdict, of samples from the absolute tick `epoch` on.
    fn explained(&self, epoch: i64) -> SampledExplanation {
        let Self { band, pulse, shot, .. } = self;
        let sampling = &band.settings.sampling;
        let filtered = Filtered::of(self.parts, pulse, band);
        let (sigma, whole) = (filtered.sigma, filtered.signal.clone());
        let rule = Rule::new(band, sigma);
        let candidates = candidates((band, &rule), &filtered);
        let gate = self.gate();
        let step = ((gate.end - gate.start) as u64).div_ceil(MOST_LAGS).max(1) as i64;
        let lags = || gate.clone().step_by(step as usize);
        let mut search = Search::new((band, &rule), &filtered);
        search.look_for(*shot);
        let score: Vec<f32> =
            lags().map(|lag| search.sum(lag).map_or(f32::NAN, |sum| sum.score)).collect();
        let best = (0..score.len()).filter(|at| score[*at].is_finite());
        let best = best.max_by(|one, other| score[*one].total_cmp(&score[*other]));
        let best = best.map(|at| gate.start + at as i64 * step);
        let mut residual = Residual::new((self.parts.0, sampling), pulse, filtered);
        let mut tested = Vec::new();
        let mut cancelled: Vec<Found> = Vec::new();
        let mut seen: Option<(Vec<f32>, i64, Vec<f32>)> = None;
        let look = |residual: &mut Residual, lag: i64| {
            let left = lags()
                .map(|lag| residual.sum(&self.marks, lag, &rule).map_or(f32::NAN, |sum| sum.score));
            (left.collect(), lag, residual.signal().to_vec())
        };
        look_at(&candidates, &mut residual, |residual, candidate| {
            if candidate.shot == *shot {
                seen.get_or_insert_with(|| look(residual, candidate.lag));
                let told = self.test(residual, candidate, &rule);
                let refusal = told.outcome.err();
                tested.push(told);
                return refusal;
            }
            let found = residual.test(candidate, (band, &rule));
            if let (Ok(found), true) = (found, seen.is_none()) {
                cancelled.push(found);
            }
            found.err()
        });
        let is_candidate = !tested.is_empty();
        if let (false, Some(lag)) = (is_candidate, best) {
            seen = Some(look(&mut residual, lag));
            let candidate = Candidate { shot: *shot, lag, rank: 0.0 };
            tested.push(self.test(&mut residual, &candidate, &rule));
        }
        let (left, lag, after) = seen.unwrap_or_default();
        let lag = tested.first().map_or(lag, |tested| tested.lag);
        SampledExplanation {
            shot: *shot,
            fired_tick: epoch + band.fired[*shot],
            marks: band.marks(*shot).map(|mark| mark as u32).collect(),
            step,
            sigma,
            threshold: rule.threshold,
            fewest: rule.fewest(self.marks.len()) as u16,
            score,
            left,
            signal: self.about(lag, [&whole, &after]),
            tested,
            is_candidate,
            verdict: Verdict::default(),
            cancelled: cancelled.iter().filter_map(|found| self.shared(found, lag)).collect(),
            gate,
        }
    }

    fn gate(&self) -> Range<i64> {
        let (nearest, farthest) = self.band.receiver.gate_ticks;
        i64::from(nearest)..i64::from(farthest) + 1
    }

    /// Tests a candidate as the receiver does, and tells what each mark looked like.
    fn test(&self, residual: &mut Residual, candidate: &Candidate, rule: &Rule) -> Tested {
        let lag = residual.summit(&self.marks, candidate.lag);
        let before: Vec<(f32, f32)> =
            self.marks.iter().map(|mark| residual.at(mark + lag)).collect();
        let found = residual.test(candidate, (self.band, rule));
        let is_counted = |place: i64| residual.counts(place);
        let marks = self.marks.iter().zip(before).map(|(mark, (photons, doubt))| {
            let (place, tick) = (mark + lag, mark + lag - self.band.fired[self.shot]);
            let state = match doubt {
                _ if is_counted(place) => MarkState::Counted,
                doubt if doubt.is_nan() => MarkState::Outside,
                _ if self.own.iter().any(|blind| blind.contains(&place)) => MarkState::OwnLight,
                doubt if doubt.is_infinite() => MarkState::Blind,
                0.0 => MarkState::Clipped,
                _ => MarkState::Hidden,
            };
            MarkSeen { tick, photons, doubt, state }
        });
        let marks = marks.collect();
        let (score, threshold) = residual.asked();
        let outcome = found.map(|found| Light {
            late: found.late,
            photons: found.photons,
            is_clipped: found.is_clipped,
        });
        Tested { lag, marks, score, threshold, outcome }
    }

    /// The first tick and the signals about the marks at `lag`.
    fn about(&self, lag: i64, signals: [&[f32]; 2]) -> (i64, Vec<f32>, Vec<f32>) {
        let (Some(first), Some(last)) = (self.marks.first(), self.marks.last()) else {
            return (0, Vec::new(), Vec::new());
        };
        let length = signals[0].len() as i64;
        let from = (first + lag - BESIDE).clamp(0, length);
        let to = (last + lag + BESIDE + 1).clamp(0, length);
        let [whole, left] = signals
            .map(|signal| signal.get(from as usize..to as usize).unwrap_or_default().to_vec());
        (from - self.band.fired[self.shot], whole, left)
    }

    /// An echo of another shot, if a mark of it lies in one of this shot's at `lag`.
    fn shared(&self, found: &Found, lag: i64) -> Option<CancelledEcho> {
        let begins = self.band.fired[found.shot] + found.lag;
        let span = self.pulse.span() as i64;
        let is_shared =
            |mark: &i64| self.marks.iter().any(|own| (own + lag - begins - mark).abs() <= span);
        let shared = self.band.marks(found.shot).filter(is_shared).count() as u32;
        (shared > 0).then_some(CancelledEcho {
            shot: found.shot,
            begins: begins - self.band.fired[self.shot],
            photons: found.photons,
            shared,
        })
    }
}

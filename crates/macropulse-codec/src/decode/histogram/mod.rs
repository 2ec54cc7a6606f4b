//! Histograms of photons to returns: the receiver of a direct time-of-flight sensor that accumulates
//! many laser pulses of a shot.
//!
//! Each histogram is decoded by itself. `pile_up` corrects the counts for a detector that stops at its
//! first photon. `model` describes them by an even background and the pulses found so far, fitted by
//! maximum likelihood. `search` finds the lag at which another pulse would explain most of the rest, and
//! `chance` says how rarely the background alone would do as well. The pulse joins the model if that is
//! rare enough, and the search begins anew.

mod chance;
mod check;
mod decision;
mod model;
mod pile_up;
mod pulse;
mod search;

pub use decision::{Decision, Stretch};
pub use pile_up::{Exposed, PileUp, coates};
pub use pulse::{Kernel, Pulse, STEPS};

use super::{Error, MOST_RETURNS, Pick, Receiver, Reject, Return, Returns, Strength};
use crate::{Histograms, ShotLog, time};
use chance::Chance;
use model::{Light, Model};
use search::{Search, strongest};

/// Settings of a receiver of histograms.
#[derive(Debug, Clone, PartialEq)]
pub struct HistogramMethod {
    /// How photons that the detector missed behind others are made up for.
    pub pile_up: PileUp,
    /// Number of cells of the detector. Coates' correction takes each to count one photon per laser pulse at
    /// most.
    pub cells: u32,
    /// The emitted pulse as the detector responds to it.
    pub pulse: Pulse,
    /// False returns accepted per histogram.
    pub false_alarm: f64,
    /// Standard deviation of the shape of the pulse in each bin, as a share of its height there or in a
    /// bin beside it, whichever is higher. 0 if light has exactly this shape. A surface that is tilted or
    /// moves stretches a pulse.
    pub shape_error: f64,
    /// A return with less than this share of the photons of the strongest one of its histogram is not
    /// given. Reflections within the optics look like faint returns.
    pub least_share: f64,
}

impl HistogramMethod {
    /// Takes counts of `pulse` as they are and knows its shape exactly, with one false return in a
    /// thousand histograms.
    pub fn new(pulse: Pulse) -> Self {
        Self {
            pile_up: PileUp::None,
            cells: 1,
            pulse,
            false_alarm: 1e-3,
            shape_error: 0.0,
            least_share: 0.0,
        }
    }
}

/// A receiver of histograms whose gate may begin before the laser pulse.
#[derive(Debug, Clone, PartialEq)]
pub struct HistogramReceiver {
    /// Nearest and farthest two-way time of flight accepted, fs.
    pub gate_fs: (i64, i64),
    /// Returns of a histogram at most, 1 to [`MOST_RETURNS`].
    pub returns: u8,
    /// Which returns are kept if there are more.
    pub pick: Pick,
    /// How it decodes.
    pub method: HistogramMethod,
}

impl HistogramReceiver {
    /// A receiver of `pulse` as [`HistogramMethod::new`] has it: a gate of 10 µs, and the strongest
    /// return.
    pub fn new(pulse: Pulse) -> Self {
        Self {
            gate_fs: (0, 10_000_000_000),
            returns: 1,
            pick: Pick::Strongest,
            method: HistogramMethod::new(pulse),
        }
    }
}

/// The returns of the owned shots of `log`, histogram `i` being that of shot `i`; ordered by shot, those
/// of one shot by range.
///
/// `photons` of a return are all the signal photons of its pulse, freed of pile-up if that is corrected.
/// `margin` is the significance beyond the threshold, in standard deviations of a normal variable.
/// `saturated` says that every laser pulse had been counted before the histogram ended.
///
/// # Errors
/// If a setting is outside its limits, columns differ in length, or the log is out of order. Also if a
/// detector that stops at its first photon counted more photons than laser pulses. A histogram in which
/// nothing is found is no error: it is counted as [`Reject::NoPeak`].
pub fn decode(
    receiver: &HistogramReceiver,
    log: &ShotLog,
    histograms: &Histograms,
) -> Result<Returns, Error> {
    check::settings(receiver)?;
    check::record(receiver, log, histograms)?;
    let Some(kernel) = Kernel::new(&receiver.method.pulse, histograms.bin_fs) else {
        return Err(check::unusable(&receiver.method.pulse));
    };
    check::work(&kernel, histograms)?;
    let search = Search::new(&kernel, histograms, receiver.gate_fs);
    let mut returns = Returns::default();
    for shot in log.owned.clone() {
        let counts = histograms.of(shot);
        let exposed =
            Exposed::of(counts, trials(receiver, histograms.cycles[shot]), receiver.method.pile_up);
        let mut found = lights(receiver, &search, &exposed);
        if found.is_empty() {
            returns.reject(Reject::NoPeak);
        }
        found.sort_by(|one, next| one.lag.total_cmp(&next.lag));
        let strength = |light: &Light| Strength { peak: 1, light: light.photons as f32 };
        receiver.pick.keep(receiver.returns.into(), &mut found, strength);
        for light in found {
            returns.push(Return {
                shot,
                tof: tof(&kernel, histograms, light.lag),
                peak: 1,
                marks: 1,
                margin: light.margin,
                photons: light.photons as f32,
                saturated: exposed.is_exhausted,
            });
        }
    }
    Ok(returns)
}

/// The same with the gate and the returns of `receiver`; the photons of a return are those of a laser pulse
/// on average, where the number of pulses is known.
pub(super) fn decode_band(
    receiver: &Receiver,
    method: &HistogramMethod,
    log: &ShotLog,
    histograms: &Histograms,
) -> Result<Returns, Error> {
    let receiver = HistogramReceiver {
        gate_fs: receiver.gate_fs(),
        returns: receiver.returns,
        pick: receiver.pick,
        method: method.clone(),
    };
    let mut returns = decode(&receiver, log, histograms)?;
    for (photons, shot) in returns.photons.iter_mut().zip(&returns.shot) {
        *photons /= histograms.cycles[*shot as usize].max(1) as f32;
    }
    Ok(returns)
}

/// The most photons that a detector can count in `cycles` laser pulses if each cell stops at its first one.
fn trials(receiver: &HistogramReceiver, cycles: u32) -> u32 {
    cycles.saturating_mul(receiver.method.cells)
}

/// Two-way time of flight, s, of light whose kernel begins `lag` bins after the first bin.
fn tof(kernel: &Kernel, histograms: &Histograms, lag: f64) -> f64 {
    let bins = lag + kernel.origin;
    time::s_from_fs(histograms.offset_fs) + bins * time::s_from_fs(histograms.bin_fs)
}

/// The pulses in one histogram, in the order in which they were found.
fn lights(receiver: &HistogramReceiver, search: &Search, exposed: &Exposed) -> Vec<Light> {
    let Some(mut model) = Model::new(search.kernel, exposed, receiver.method.shape_error) else {
        return Vec::new();
    };
    for _ in 0..MOST_RETURNS {
        let Some(step) = strongest(search.kernel, &model, search.steps()) else { break };
        let chance = Chance::of(&model, step);
        let Some(margin) =
            chance.margin(search.kernel, search.places(), receiver.method.false_alarm)
        else {
            break;
        };
        let lag = step as f64 / STEPS as f64;
        model.add(Light { step, lag, photons: chance.photons, margin });
    }
    model.locate();
    let mut lights = model.lights;
    let strongest = lights.iter().fold(0.0, |most: f64, light| most.max(light.photons));
    lights.retain(|light| {
        light.photons >= receiver.method.least_share * strongest && search.is_in_gate(light.lag)
    });
    lights
}

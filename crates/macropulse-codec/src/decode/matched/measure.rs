//! Measurement: the time of a return, and its energy.

use super::Detection;
use super::cancel::NOWHERE;
use super::sent::Sent;
use crate::decode::field::Field;
use crate::decode::timing::{self, Histogram, Known};
use crate::decode::{Energy, MIDDLE, Reject, Return, Returns, Window};

/// A meter of returns: it tells their time of flight and their energy.
pub(super) struct Meter<'a> {
    sent: &'a Sent<'a>,
    pub photons: Photons,
    histogram: Histogram,
}

impl<'a> Meter<'a> {
    /// A meter for the shots `sent`, which begins with the energies that are known.
    pub fn new(sent: &'a Sent<'a>, photons: Photons) -> Self {
        Self { sent, photons, histogram: Histogram::default() }
    }

    /// Measures the return of `shot` at `detection`, in the light of `field`.
    pub fn measured(&mut self, field: &Field, shot: usize, detection: Detection) -> Return {
        let sent = self.sent;
        let marks = sent.weight(shot);
        let light = sent.light(shot, detection.lag);
        let (peak, margin) = (detection.count as u16, detection.margin as u16);
        let start = light.start + sent.epoch;
        let late = self.late(field, shot, detection);
        let Energy { photons, saturated } = match detection.count == marks {
            true => self.photons.of_all(marks),
            false => {
                let window = timing::window(sent.correlation, sent.width, late);
                let density = field.density_without(&light, detection.count, marks * sent.width);
                Energy::of((detection.count, marks), density, window)
            }
        };
        let tof = sent.receiver.tof(late)(sent.log.fired_at_fs[shot], start);
        Return { shot, tof, peak, marks: marks as u16, margin, photons, saturated }
    }

    /// How late the marks of `shot` are, in ticks, if it is found at `detection`.
    fn late(&mut self, field: &Field, shot: usize, detection: Detection) -> f64 {
        let sent = self.sent;
        if sent.width == 1 {
            return MIDDLE;
        }
        let (light, bits) = (sent.light(shot, detection.lag), sent.bits(shot));
        let lit_bits = sent.lit_bits(shot);
        let count = |place: i64, counts: &mut [u32]| {
            let start = light.start + place;
            field.seen().lit_in_row(start, lit_bits, &bits.pattern, counts);
        };
        self.histogram.count(sent.width, sent.correlation.jitter(), count);
        let beside = field.density_without(&light, detection.count, 0);
        let known = Known {
            sigma: sent.correlation.jitter(),
            marks: f64::from(sent.weight(shot)),
            others: beside / f64::from(sent.width),
            neighbours: &bits.neighbours,
        };
        self.histogram.late_by(&known)
    }
}

impl Sent<'_> {
    /// Settles all shots of a band if all light was cancelled, with one surface for each at most, found at these
    /// `lags`. The only question left is which of them lie in the gate.
    pub(super) fn settle_clear(&self, lags: &[i64], photons: &mut Photons, returns: &mut Returns) {
        let (gate, owned) = (self.gate(), self.log.owned.clone());
        let mut clear = Vec::with_capacity(owned.len());
        for (shot, lag) in owned.clone().zip(&lags[owned]) {
            match *lag {
                NOWHERE => returns.reject(Reject::NoPeak),
                lag if gate.contains(&lag) => clear.push((shot as u32, lag)),
                _ => returns.reject(Reject::OutsideGate),
            }
        }
        self.measure_clear(&mut clear, photons, returns);
    }

    /// Drains shots found without a gap, and their lags, into returns behind those there are.
    pub(super) fn measure_clear(
        &self,
        clear: &mut Vec<(u32, i64)>,
        photons: &mut Photons,
        returns: &mut Returns,
    ) {
        let (first, all) = (returns.len(), returns.len() + clear.len());
        // Column by column: entry by entry takes twice as long.
        returns.shot.extend(clear.iter().map(|(shot, _)| *shot));
        let tof = self.receiver.tof(MIDDLE);
        returns.tof.extend(clear.drain(..).map(|(shot, lag)| {
            let start = self.fired[shot as usize] + lag + self.epoch;
            tof(self.log.fired_at_fs[shot as usize], start)
        }));
        let shots = returns.shot[first..].iter().map(|shot| *shot as usize);
        returns.margin.extend(shots.clone().map(|shot| self.complete_margin(shot) as u16));
        returns.peak.extend(shots.map(|shot| self.weight(shot) as u16));
        returns.marks.extend_from_slice(&returns.peak[first..]);
        let known = photons.up_to(returns.peak[first..].iter().copied().max().unwrap_or(0).into());
        let energy = |marks: &u16| known[usize::from(*marks)].photons;
        returns.photons.extend(returns.peak[first..].iter().map(energy));
        returns.saturated.resize(all, true);
        returns.number.resize(all, 1);
    }
}

/// The energy of returns without a missing mark, by the number of marks. In clear weather a logarithm for each shot
/// would take longer than the rest.
#[derive(Debug, Default)]
pub(super) struct Photons {
    all_found: Vec<Energy>,
}

impl Photons {
    /// The energy for all of `marks` marks.
    fn of_all(&mut self, marks: u32) -> Energy {
        self.up_to(marks)[marks as usize]
    }

    /// The energies for no mark, one, and so on, up to `marks`.
    fn up_to(&mut self, marks: u32) -> &[Energy] {
        let known = self.all_found.len() as u32;
        self.all_found
            .extend((known..=marks).map(|marks| Energy::of((marks, marks), 0.0, Window::WHOLE)));
        &self.all_found
    }
}

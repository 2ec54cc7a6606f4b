//! Measurement: the time of a return, and its energy.

use super::{Band, Detection};
use crate::decode::timing::{self, Known};
use crate::decode::{Energy, MIDDLE, Return, Window};

impl Band<'_> {
    /// What is measured of `shot` at `detection`.
    pub(super) fn measured(&mut self, shot: usize, detection: Detection) -> Return {
        let marks = self.sent.weight(shot);
        let light = self.sent.light(shot, detection.lag);
        let (peak, margin) = (detection.count as u16, detection.margin as u16);
        let sent = self.sent;
        let start = light.start + sent.epoch;
        let late = self.late(shot, detection);
        let Energy { photons, saturated } = match detection.count == marks {
            true => self.photons.of_all(marks),
            false => {
                let density = self.density_beside(shot, detection);
                Energy::of(
                    (detection.count, marks),
                    density,
                    timing::window(self.sent.receiver, self.sent.width, late),
                )
            }
        };
        let tof = sent.receiver.tof(sent.log.fired_at_fs[shot], start, late);
        Return { shot, tof, peak, marks: marks as u16, margin, photons, saturated }
    }

    /// Share of lit places around a shot found at `detection`, its own marks apart.
    pub(super) fn density_beside(&self, shot: usize, detection: Detection) -> f64 {
        let places = self.sent.weight(shot) * self.sent.width;
        self.field.density_without(&self.sent.light(shot, detection.lag), detection.count, places)
    }

    /// How late the marks of `shot` are, in ticks, if it is found at `detection`.
    fn late(&mut self, shot: usize, detection: Detection) -> f64 {
        let sent = self.sent;
        if sent.width == 1 {
            return MIDDLE;
        }
        let (light, bits) = (sent.light(shot, detection.lag), sent.bits(shot));
        let lit_bits = sent.bits_that_are(true, shot);
        let count =
            |place: i64| self.field.seen().lit_in_all(light.start + place, lit_bits, &bits.pattern);
        self.histogram.count(sent.width, sent.receiver.jitter(), count);
        let beside = self.field.density_without(&light, detection.count, 0);
        let known = Known {
            sigma: sent.receiver.jitter(),
            marks: f64::from(sent.weight(shot)),
            others: beside / f64::from(sent.width),
            neighbours: &bits.neighbours,
        };
        self.histogram.late_by(&known)
    }
}

/// The energy of returns of which all marks were found, by their number: in clear weather a logarithm
/// for each shot would take longer than the rest.
#[derive(Debug, Default)]
pub(super) struct Photons {
    all_found: Vec<Energy>,
}

impl Photons {
    pub(super) fn of_all(&mut self, marks: u32) -> Energy {
        let known = self.all_found.len() as u32;
        self.all_found
            .extend((known..=marks).map(|marks| Energy::of((marks, marks), 0.0, Window::WHOLE)));
        self.all_found[marks as usize]
    }
}

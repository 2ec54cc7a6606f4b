//! The explanation of a shot whose light is modulated: the taps of a lock-in pixel, and their phasors.

use macropulse::codec::decode::phase::measured;
use macropulse::codec::decode::{self, Method, Verdict};
use macropulse::codec::{RecordKind, Taps};
use macropulse::design::Design;
use macropulse::units::range_from_tof;
use serde::{Deserialize, Serialize};

use super::curve::Scale;
use super::{OfShot, RecordExplanation, Sent, Shot};
use crate::text::{Columns, short};
use crate::view::{Axis, Chart, Hue, Series, Style};

/// The taps of a shot.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Phasors {
    tones: Vec<Tone>,
    scale: Scale,
}

/// A modulation frequency, and what its taps tell.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Tone {
    frequency_mhz: f64,
    codes: Vec<u16>,
    /// `None` of a frequency with a full tap.
    phasor: Option<Phasor>,
}

/// The phasor of a modulation frequency.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Phasor {
    phase_rad: f64,
    sigma_rad: f64,
    /// Electrons of modulated light.
    electrons: f64,
    /// Range that the phase stands for in the first interval, and the length of an interval.
    range_m: f64,
    interval_m: f64,
}

/// The phasors that the `codes` of a shot give, frequency by frequency.
fn tones(design: &Design, codes: &[u16]) -> Result<Vec<Tone>, decode::Error> {
    let Method::Phase(method) = &design.receiver.method else { return Ok(Vec::new()) };
    let mut left = codes;
    let mut tones = Vec::new();
    for (tone, found) in method.tones.iter().zip(measured(method, codes)?) {
        let (own, others) = left.split_at((tone.phases as usize).min(left.len()));
        left = others;
        let interval_m = range_from_tof(1.0 / tone.hz);
        tones.push(Tone {
            frequency_mhz: tone.hz * 1e-6,
            codes: own.to_vec(),
            phasor: found.map(|found| Phasor {
                phase_rad: found.phase,
                sigma_rad: found.sigma,
                electrons: found.electrons,
                range_m: (found.phase / std::f64::consts::TAU).rem_euclid(1.0) * interval_m,
                interval_m,
            }),
        });
    }
    Ok(tones)
}

impl OfShot for Phasors {
    type Record = Taps;

    fn of(design: &Design, taps: &Taps, at: usize, shot: &Shot) -> Result<Self, decode::Error> {
        Ok(Self { tones: tones(design, taps.of(at))?, scale: Scale::new(0, 1, shot) })
    }

    fn why(&self, verdict: &Verdict) -> String {
        let Some(found) = verdict.returns.first() else {
            return match self.tones.iter().all(|tone| tone.phasor.is_none()) {
                true => "Every modulation frequency has a full tap.".to_owned(),
                false => "The phasors are not longer than the receiver allows of noise, or no range in the gate \
                          has their phases."
                    .to_owned(),
            };
        };
        format!(
            "{} m explains the phases of {} of {} modulation frequencies best. The next best interval, and noise, \
             are {} standard deviations away or more.",
            short(range_from_tof(found.tof)),
            found.peak,
            found.marks,
            found.margin
        )
    }
}

impl RecordExplanation for Phasors {
    fn kind(&self) -> RecordKind {
        RecordKind::Taps
    }

    fn scale(&self) -> Option<&Scale> {
        Some(&self.scale)
    }

    /// Adds a line for each modulation frequency.
    fn push(&self, _: usize, columns: &mut Columns) {
        for tone in &self.tones {
            let codes: Vec<String> = tone.codes.iter().map(u16::to_string).collect();
            let phasor = match &tone.phasor {
                None => "a tap is full".to_owned(),
                Some(phasor) => format!(
                    "phase {:.4} ± {:.4} rad, {} electrons: {} m, or more by whole intervals of {} m",
                    phasor.phase_rad,
                    phasor.sigma_rad,
                    short(phasor.electrons.round()),
                    short(phasor.range_m),
                    short(phasor.interval_m)
                ),
            };
            let name = format!("{} MHz", short(tone.frequency_mhz));
            columns.push(&name, format!("{phasor}; codes {}", codes.join(" ")));
        }
    }

    /// The codes over the phases of their taps.
    fn charts(&self, _: &Sent) -> Option<Vec<(Chart, &'static str)>> {
        let codes = self.tones.iter().flat_map(|tone| &tone.codes);
        let most = codes.copied().max().unwrap_or(1).max(1);
        let x = Axis::linear("Phase of the tap, degrees").limits(0.0, 360.0);
        let y = Axis::linear("Code").limits(0.0, f64::from(most) * 1.08);
        let mut chart = Chart::new("Codes of the taps over their phases", x, y);
        chart.size = [904.0, 320.0];
        let hues = [Hue::Blue, Hue::Orange, Hue::Green, Hue::Purple];
        for (tone, hue) in self.tones.iter().zip(hues.into_iter().cycle()) {
            let step = 360.0 / tone.codes.len().max(1) as f64;
            let point = |(tap, code): (u32, &u16)| [f64::from(tap) * step, f64::from(*code)];
            chart.series.push(Series {
                label: format!("{} MHz", short(tone.frequency_mhz)),
                points: (0..).zip(&tone.codes).map(point).collect(),
                style: Style::Joined,
                hue,
            });
        }
        Some(vec![(
            chart,
            "A cosine of the phase: where it is highest is the phase of the light, and its height above its \
             mean is the amplitude.",
        )])
    }
}

//! Quantities that follow from a sensor file, for people to read.

use super::Design;
use crate::units::{range_from_tof, s_from_fs, tof_from_range};

/// Figures that follow from a design. SI units.
#[derive(Debug, Clone, PartialEq)]
pub struct Derived {
    /// Mean time between shots, s.
    pub pixel_period: f64,
    /// Mean time between shots of the same detector, s: a macropulse must fit into it.
    pub channel_period: f64,
    /// Shortest time the beam spends on a pixel, s (\[KP16\] §2.2 gives the mean only).
    pub shortest_dwell: f64,
    /// Range gate, s.
    pub gate: f64,
    /// Shots fired during one range gate: \[KP16\] says 25.
    pub shots_in_flight: f64,
    /// Chips of a macropulse.
    pub chips: u32,
    /// Length of a macropulse, s.
    pub macropulse: f64,
    /// Fewest, mean and most marks of a label that can be sent.
    pub marks: (usize, f64, usize),
    /// Marks sent in one scan.
    pub marks_per_scan: u64,
    /// Macropulses in the air on average at a point of a detector's time line, if all return.
    pub mean_overlap: f64,
    /// Range at which another shot of the same detector has the same code word, or all phases of modulated light
    /// repeat, m; `None` for single pulses.
    pub unambiguous_range: Option<f64>,
    /// Range covered by one tick, m.
    pub tick_range: f64,
    /// Highest refresh rate, 1/s, of a sensor with the same number of directions and beams that waits for
    /// every echo before the next shot.
    pub idle_listening_rate: f64,
    /// Mean photons per mark from the reference target.
    pub reference_photons: f64,
}

impl Derived {
    pub(super) fn of(design: &Design) -> Self {
        let shots = design.shots_per_scan();
        let pixel_period = design.scan_period() / shots as f64;
        let gate = tof_from_range(design.scan.max_range);
        let codebook = &design.emission.coding().codebook;
        let mean = codebook.mean_weight();
        let macropulse = s_from_fs(design.emission.length_fs());
        let at_once = f64::from(design.channels());
        let channel_period = design.scan.channel_period();
        Self {
            pixel_period,
            channel_period,
            shortest_dwell: design.scan.shortest_period(),
            gate,
            shots_in_flight: gate / pixel_period,
            chips: codebook.chips(),
            macropulse,
            marks: (
                codebook.weights().map(|(fewest, _)| fewest).filter(|&w| w > 0).min().unwrap_or(0),
                mean,
                codebook.max_weight(),
            ),
            marks_per_scan: (mean * shots as f64).round() as u64,
            mean_overlap: macropulse / channel_period,
            unambiguous_range: design
                .emission
                .model()
                .repeats_after()
                .or_else(|| design.is_coded().then(|| word_period(design, channel_period)))
                .map(range_from_tof),
            tick_range: range_from_tof(s_from_fs(design.clock.tick_fs)),
            idle_listening_rate: at_once / (gate * shots as f64),
            reference_photons: design.detector.model().sensitivity().photons,
        }
    }
}

/// Time, s, until a detector is sent the same code word again. A laser of a turning head goes from
/// column to column and so from word to word; a pixel of a flash has one word.
fn word_period(design: &Design, channel_period: f64) -> f64 {
    if u64::from(design.channels()) == design.shots_per_scan() {
        return channel_period;
    }
    f64::from(design.emission.coding().word_modulus) * channel_period
}

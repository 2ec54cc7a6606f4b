//! The three ways of measuring range that \[KP16 eq. 1\] names.
//!
//! The report of the paper holds them against the records of simulated walls.

use crate::units::range_from_tof;

/// Pulsed: R = c·Δt/2, Δt in s.
pub use crate::units::range_from_tof as pulsed;

/// Amplitude-modulated: R = φ·c/(4π·f), `phase` φ in rad, `modulation` f in Hz.
pub fn amplitude_modulated(phase: f64, modulation: f64) -> f64 {
    range_from_tof(phase / (std::f64::consts::TAU * modulation))
}

/// Frequency-modulated with a triangular sweep: R = c·f_b·T/(4·Δf), `beat` f_b in Hz, `period` T
/// of the whole triangle in s, frequency `excursion` Δf in Hz.
///
/// \[KP16\] calls B the beat frequency and Δf the difference of frequencies, which would be the
/// beat frequency again; the equation is right with Δf the excursion.
pub fn frequency_modulated(beat: f64, period: f64, excursion: f64) -> f64 {
    range_from_tof(beat * period / (2.0 * excursion))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A chirp that sweeps Δf up in T/2 shifts by 2R/c · 2Δf/T during the flight.
    #[test]
    fn the_three_methods_agree_on_a_wall_at_30_metres() {
        let tof = crate::units::tof_from_range(30.0);
        approx::assert_relative_eq!(pulsed(tof), 30.0, max_relative = 1e-12);
        let modulation = 1e6;
        let phase = 2.0 * std::f64::consts::PI * modulation * tof;
        approx::assert_relative_eq!(
            amplitude_modulated(phase, modulation),
            30.0,
            max_relative = 1e-12
        );
        let (period, excursion) = (1e-3, 1e9);
        let beat = tof * 2.0 * excursion / period;
        approx::assert_relative_eq!(
            frequency_modulated(beat, period, excursion),
            30.0,
            max_relative = 1e-12
        );
    }
}

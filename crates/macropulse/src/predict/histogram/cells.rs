//! Mean counts of SPAD cells that may be blind, over a cycle.

use crate::design::detector::{Arming, Geiger};

/// Cells are taken to have forgotten how they began after `SETTLED` cycles and `DELAYS` dead times and delays
/// of an afterpulse; no more cycles than `MOST` in all.
const SETTLED: usize = 4;
const DELAYS: usize = 8;
const MOST: usize = 4096;

/// Counts of a bin that change by less than this share from one cycle to the next are settled.
const EXACT: f64 = 1e-9;

/// Mean counts in each bin of a cycle, of all cells together, for the mean detections `rates` of cells that are always
/// armed.
///
/// A share 1 − e^(−λᵢ/N) of the armed cells counts in bin i. It is armed again after the dead time, rounded
/// to whole bins, on average in the middle of a bin, or with the next cycle. A share `afterpulsing` of the
/// counts comes again, delayed exponentially, as far as its cell is armed by then. The burst is taken for
/// long: the first cycles, which begin with all cells armed, do not count.
pub(super) fn counts(geiger: &Geiger, rates: &[f64], bin_fs: i64) -> Vec<f64> {
    let is_free = geiger.arming == Arming::FreeRunning;
    if is_free && geiger.dead_fs == 0 {
        return rates.to_vec();
    }
    let cells = f64::from(geiger.cells);
    let bins = rates.len();
    let dead = ((geiger.dead_fs + bin_fs / 2) / bin_fs).max(i64::from(geiger.dead_fs > 0)) as usize;
    let later = bins.max(dead) + 2;
    let fire: Vec<f64> = rates.iter().map(|rate| -libm::expm1(-rate / cells)).collect();
    let per_bin = bin_fs as f64 / geiger.afterpulse_fs.max(1) as f64;
    let kept = libm::exp(-per_bin);
    // Cells that are armed and what they still owe of afterpulses; the same of those that will be armed, by bin.
    let (mut armed, mut owed) = (1.0, 0.0);
    let mut due = vec![(0.0, 0.0); later];
    let mut counts = vec![0.0; bins];
    let mut time = 0;
    let remembered = match geiger.afterpulsing > 0.0 {
        true => dead + (1.0 / per_bin) as usize,
        false => dead,
    };
    for _ in 0..(SETTLED + DELAYS * remembered.div_ceil(bins)).min(MOST) {
        let mut change: f64 = 0.0;
        for (bin, (count, fire)) in counts.iter_mut().zip(&fire).enumerate() {
            let (again, owing) = std::mem::take(&mut due[time % later]);
            armed += again;
            owed += owing;
            let counted: f64 = armed * fire + owed * (1.0 - kept);
            owed *= kept;
            let counted = counted.min(armed);
            armed -= counted;
            // Half of those that counted in a bin are armed from the beginning of another on, half from its end on.
            let waits = match is_free {
                true => [dead, dead + 1],
                false => [dead.max(bins - bin); 2],
            };
            for wait in waits {
                let (half, then) = (counted / 2.0, &mut due[(time + wait) % later]);
                then.0 += half;
                then.1 += half * geiger.afterpulsing * libm::exp(-per_bin * wait as f64);
            }
            change = change.max((counted - *count).abs() / counted.max(f64::MIN_POSITIVE));
            *count = counted;
            time += 1;
        }
        if change < EXACT {
            break;
        }
    }
    counts.iter().map(|count| count * cells).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::design::Design;
    use crate::design::detector::Detector;
    use approx::assert_relative_eq;
    use std::path::Path;

    /// Four cells with `more` keys.
    fn geiger(more: &str) -> Geiger {
        let text = format!(
            "version = 1\nname = \"flash\"\nidealised = [\"footprint\", \"mirror-motion\"]\n\
             scan.scans_per_s = 10.0\nscan.max_range_m = 8.0\n\
             scan.flash = {{ rows = 2, columns = 2, horizontal_deg = 8.0, vertical_deg = 8.0 }}\n\
             light = {{ wavelength_nm = 905.0, beam_diameter_mm = 3.0, pulse_ps = 1000.0, energy = \"class-1\" }}\n\
             optics = {{ aperture_mm = 3.0, transmission = 0.7, filter_nm = 20.0, field = \"descanned\" }}\n\
             burst = {{ pulses = 1000, interval_ns = 60.0 }}\n\
             histogram = {{ bin_ps = 1000.0, bins = 60 }}\nreceiver.kind = \"histogram\"\n\
             [detector.geiger]\nefficiency = 0.15\ncells = 4\n{more}\n"
        );
        let design = Design::from_toml(&text, "flash.toml", Path::new(""), &[]).unwrap();
        let Detector::Geiger(geiger) = design.detector else { panic!("no cells") };
        geiger
    }

    /// Even light of rate r a cell makes r/(1 + r·τ) counts, a closed form; once a pulse it is what a pulse leaves,
    /// e^(−Σ)·(1 − e^(−λ)). An afterpulse after each tenth count, long delayed, adds a ninth to what is
    /// faint. Control: the dead time is needed.
    #[test]
    fn even_light_and_single_stops_have_closed_forms() {
        let (bin_fs, rates) = (1_000_000, vec![0.08; 60]);
        let dead = counts(&geiger("dead_time_ns = 20.0"), &rates, bin_fs);
        let share: f64 = -(-0.02_f64).exp_m1();
        for count in &dead {
            assert_relative_eq!(*count, 4.0 * 0.02 / (1.0 + 0.02 * 20.0), max_relative = 1e-4);
        }
        let once = counts(&geiger("arming = \"once-per-pulse\""), &rates, bin_fs);
        for (bin, count) in once.iter().enumerate() {
            let waits = (-0.02 * bin as f64).exp();
            assert_relative_eq!(*count, 4.0 * waits * share, max_relative = 1e-12);
        }
        let faint = vec![1e-6; 60];
        let keys = "dead_time_ns = 1.0\nafterpulsing = 0.1\nafterpulse_ns = 500.0";
        let again = counts(&geiger(keys), &faint, bin_fs);
        // The tenth that is due while its cell is blind does not come.
        let left = 0.1 * (-1.0_f64 / 500.0).exp();
        assert_relative_eq!(again[30], 1e-6 / (1.0 - left), max_relative = 1e-2);
        assert!(dead[0] < 0.8 * 4.0 * share);
    }
}

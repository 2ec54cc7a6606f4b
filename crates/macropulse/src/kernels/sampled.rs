//! The loops of sampled detectors: coloured noise, and codes.

use macropulse_codec::on_every_level;

/// Samples that are smoothed side by side.
const LANES: usize = 64;

on_every_level! {
    /// Puts a·g + c·(g² − 1), of which a and c are the `mixture`, into `mixed` for the normal number g of each two
    /// words of random bits.
    pub(crate) fn mixed(low: &[u32], high: &[u32], mixture: (f32, f32), mixed: &mut [f32]) {
        let (linear, quadratic) = mixture;
        for ((mixed, low), high) in mixed.iter_mut().zip(low).zip(high) {
            let set = low.count_ones() + high.count_ones();
            let normal = (set as f32 - 32.0) / 4.0;
            *mixed = linear * normal + quadratic * (normal * normal - 1.0);
        }
    }
}

on_every_level! {
    /// Adds to each of `level` the sum of the values of `white` from its place on, each times its weight.
    pub(crate) fn smoothed(white: &[f32], weights: &[f32], level: &mut [f32]) {
        for (level, first) in level.chunks_mut(LANES).zip((0..).step_by(LANES)) {
            let here = level.len();
            let mut sums = [0.0; LANES];
            sums[..here].copy_from_slice(level);
            let white = &white[first..];
            for (at, weight) in weights.iter().enumerate() {
                match white[at..].first_chunk::<LANES>() {
                    Some(white) => {
                        for lane in 0..LANES {
                            sums[lane] += weight * white[lane];
                        }
                    }
                    None => {
                        for (sum, white) in sums.iter_mut().zip(&white[at..]) {
                            *sum += weight * white;
                        }
                    }
                }
            }
            level.copy_from_slice(&sums[..here]);
        }
    }
}

on_every_level! {
    /// The nearest codes to signals of so many photons, `steps` to each.
    pub(crate) fn rounded(level: &[f32], steps: f32, between: [f32; 2], codes: &mut [i16]) {
        let [low, high] = between;
        for (code, level) in codes.iter_mut().zip(level) {
            *code = (level * steps).clamp(low, high).round_ties_even() as i16;
        }
    }
}

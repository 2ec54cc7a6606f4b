//! The loops of sampled detectors: coloured noise, and codes.

use macropulse_codec::on_every_level;

/// Weights that are applied together, so that a level is stored once for all of them.
const TOGETHER: usize = 4;

on_every_level! {
    /// Puts a·g + c·(g² − 1) into `mixed` for the normal number g of each two words of random bits. The
    /// `mixture` is a and c.
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
        let (together, rest) = weights.as_chunks::<TOGETHER>();
        let count = level.len();
        for (weights, first) in together.iter().zip((0..).step_by(TOGETHER)) {
            let [a, b, c, d] = weights;
            let [at_a, at_b, at_c, at_d] = [0, 1, 2, 3].map(|at| &white[first + at..][..count]);
            for at in 0..count {
                level[at] = level[at] + a * at_a[at] + b * at_b[at] + c * at_c[at] + d * at_d[at];
            }
        }
        for (weight, first) in rest.iter().zip(together.len() * TOGETHER..) {
            for (level, white) in level.iter_mut().zip(&white[first..]) {
                *level += weight * white;
            }
        }
    }
}

/// 3·2²²: a far smaller number, added to it, is rounded to a whole one, halves to the even one. The whole
/// number is then in the lowest bits of the sum.
const WHOLE: f32 = 12_582_912.0;

on_every_level! {
    /// Puts the nearest codes to the signals in `level`, in photons, into `codes`. A photon is `steps` codes,
    /// and codes end at the limits `between`.
    pub(crate) fn rounded(level: &[f32], steps: f32, between: [f32; 2], codes: &mut [i16]) {
        let [low, high] = between;
        for (code, level) in codes.iter_mut().zip(level) {
            *code = ((level * steps).clamp(low, high) + WHOLE).to_bits() as i16;
        }
    }
}

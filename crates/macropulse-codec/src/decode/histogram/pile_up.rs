//! Pile-up: a detector that counts one photon per laser pulse misses those behind it.

use libm::log1p;

/// How photons that the detector missed behind others are made up for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum PileUp {
    /// Counts are taken as they are: the detector counts every photon, or light is so faint that it
    /// hardly misses any.
    #[default]
    None,
    /// As of a detector that stops at the first photon of each laser pulse \[Coa68\].
    Coates,
}

/// Returns the mean number of photons per laser pulse in each bin, from the `counts` of `cycles` laser
/// pulses. Each of these stops the detector at its first photon \[Coa68\]:
///
/// > λ_i = −ln(1 − h_i/(M − Σ_{k<i} h_k)),
///
/// h_i being the count of bin i and M the cycles. In the bin in which the last cycle is counted half a cycle
/// is taken as left, as the rate would be infinite otherwise. All bins behind it are 0.
pub fn coates(counts: &[u32], cycles: u32) -> Vec<f64> {
    let exposed = Exposed::of(counts, cycles, PileUp::Coates);
    let rate = |(count, exposure): (&f64, &f64)| match *exposure > 0.0 {
        true => count / exposure / f64::from(cycles),
        false => 0.0,
    };
    exposed.count.iter().zip(&exposed.exposure).map(rate).collect()
}

/// Counts that are Poisson variables of mean λ·e. All cycles together would count λ photons if none hid
/// another. A share e of the cycles was still waiting for its photon.
#[derive(Debug, Clone, PartialEq)]
pub struct Exposed {
    /// Count of each bin.
    pub count: Vec<f64>,
    /// Share e of each bin.
    pub exposure: Vec<f64>,
    /// True if every cycle had its count before the last bin.
    pub is_exhausted: bool,
}

impl Exposed {
    /// Takes the `counts` of `cycles` laser pulses. If each count stops the detector, the cycles counted in
    /// one bin are missing in the next.
    ///
    /// Given what came before, the count h of a bin is binomial: each of the S cycles left has a photon with
    /// probability 1 − e^(−λ/M). So −S·ln(1 − h/S) has the mean λ·S/M, and nearly its variance. If h = S,
    /// half a cycle is taken as left: a pulse that all cycles count at once is the brightest of all.
    pub(super) fn of(counts: &[u32], cycles: u32, pile_up: PileUp) -> Self {
        if pile_up == PileUp::None {
            let count = counts.iter().map(|count| f64::from(*count)).collect();
            return Self { count, exposure: vec![1.0; counts.len()], is_exhausted: false };
        }
        let mut exposed = Self {
            count: Vec::with_capacity(counts.len()),
            exposure: Vec::with_capacity(counts.len()),
            is_exhausted: false,
        };
        let mut left = cycles;
        for &count in counts {
            let all = f64::from(left);
            let counted = f64::from(count).min(all - 0.5).max(0.0);
            exposed.count.push(if left > 0 { -all * log1p(-counted / all) } else { 0.0 });
            exposed.exposure.push(all / f64::from(cycles));
            exposed.is_exhausted |= count >= left;
            left = left.saturating_sub(count);
        }
        exposed
    }
}

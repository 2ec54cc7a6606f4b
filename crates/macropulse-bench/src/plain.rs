//! The receiver beside the plain ways to find a lag, on the same ticks.

use std::hint::black_box;

use macropulse::codec::decode::Returns;
use macropulse::design::Design;
use macropulse::processor::thread_seconds;
use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

use crate::Fallible;
use crate::machine::least_seconds;
use crate::page::{self, three};
use crate::sample::{Condition, Given, Sample};

/// One shot whose lag is sought, and the ticks in which its light may be.
struct Sought<'a> {
    /// The ticks from the beginning of its gate on, counted from there.
    lit: Vec<usize>,
    lags: usize,
    /// Ticks from the start of the macropulse to each mark.
    marks: Vec<usize>,
    /// The lag at which the receiver found it, counted from the beginning of its gate.
    found: usize,
    design: &'a Design,
}

impl<'a> Sought<'a> {
    /// The return in the middle of a band.
    fn new(design: &'a Design, (log, ticks): &Given, returns: &Returns) -> Self {
        let receiver = &design.receiver;
        let at = returns.len() / 2;
        let shot = returns.shot[at] as usize;
        let (nearest, farthest) = receiver.gate_ticks;
        let fired = log.fired_at_fs[shot].div_euclid(receiver.tick_fs);
        let opens = fired + i64::from(nearest);
        let scale = receiver.method.ticks_per_chip().unwrap_or(1);
        let length = i64::from(design.emission.coding().codebook.chips() * scale);
        let closes = fired + i64::from(farthest) + length;
        let absolute = ticks.tick.iter().map(|&tick| ticks.epoch + i64::from(tick));
        let lit = absolute.filter(|tick| (opens..closes).contains(tick));
        // A tick is taken for its middle.
        let came = returns.tof[at] * 1e15 + log.fired_at_fs[shot] as f64;
        let came = (came / receiver.tick_fs as f64).floor() as i64;
        let marks = design.emission.coding().codebook.marks(log.label[shot], log.word[shot]);
        Self {
            lit: lit.map(|tick| (tick - opens) as usize).collect(),
            lags: (farthest - nearest) as usize + 1,
            marks: marks.iter().map(|&mark| scale as usize * usize::from(mark)).collect(),
            found: (came - opens) as usize,
            design,
        }
    }

    /// Sixty-four lags at once: their counts are numbers whose binary digits lie in one machine
    /// word each, and every mark adds one to those lags at which it is lit.
    fn exhaustively(&self) -> usize {
        let end = self.lags + self.marks.last().unwrap_or(&0);
        let mut words = vec![0_u64; end / 64 + 3];
        for &tick in &self.lit {
            words[tick / 64] |= 1 << (tick % 64);
        }
        let (mut best, mut most) = (0, 0);
        for first in (0..self.lags).step_by(64) {
            let mut digits = [0_u64; 10];
            for mark in &self.marks {
                let (word, shift) = ((first + mark) / 64, (first + mark) % 64);
                let mut carry = words[word] >> shift | words[word + 1] << 1 << (63 - shift);
                for digit in &mut digits {
                    (*digit, carry) = (*digit ^ carry, *digit & carry);
                }
            }
            let mut lags = u64::MAX >> 64_usize.saturating_sub(self.lags - first);
            let mut count = 0;
            for digit in digits.iter().rev() {
                let lit = lags & digit;
                count = 2 * count + usize::from(lit != 0);
                lags = if lit == 0 { lags } else { lit };
            }
            if count > most {
                (best, most) = (first + lags.trailing_zeros() as usize, count);
            }
        }
        best
    }

    /// The peak of the correlation: the product of the one spectrum with the other's conjugate,
    /// transformed back.
    fn by_fourier(&self, planner: &mut FftPlanner<f32>) -> usize {
        let points = (self.lags + self.marks.last().unwrap_or(&0)).next_power_of_two();
        let forward = planner.plan_fft_forward(points);
        let back = planner.plan_fft_inverse(points);
        let mut scratch = vec![Complex::default(); forward.get_inplace_scratch_len()];
        let mut spectrum = |lit: &[usize]| {
            let mut values = vec![Complex::<f32>::default(); points];
            lit.iter().filter(|&&at| at < points).for_each(|&at| values[at].re = 1.0);
            forward.process_with_scratch(&mut values, &mut scratch);
            values
        };
        let (mut values, template) = (spectrum(&self.lit), spectrum(&self.marks));
        values.iter_mut().zip(&template).for_each(|(value, other)| *value *= other.conj());
        back.process(&mut values);
        let counts = values[..self.lags].iter().map(|value| value.re).enumerate();
        counts.max_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(lag, _)| lag)
    }

    /// Seconds for a scan in which every shot takes as long as this one.
    fn whole_scan(&self, mut search: impl FnMut(&Self) -> usize) -> Fallible<f64> {
        if search(self) != self.found {
            return Err("a plain way finds another lag than the receiver".into());
        }
        let seconds = (0..3).map(|_| {
            let began = thread_seconds();
            black_box(search(self));
            thread_seconds() - began
        });
        let least = seconds.fold(f64::INFINITY, f64::min);
        Ok(least * self.design.shots_per_scan() as f64)
    }
}

/// Measures them on the clean street.
pub fn text() -> Fallible<String> {
    let sample = Sample::of(Condition::CLEAN.design()?, "street", 12)?;
    let given = sample.given();
    let mut returns = Ok(Vec::new());
    let seconds = least_seconds(|| returns = black_box(sample.decode(&given)));
    let returns = returns?;
    let receiver = sample.design.scan_period() / sample.speed(seconds);
    let sought: Vec<Sought> = given
        .iter()
        .zip(&returns)
        .filter(|(_, returns)| !returns.is_empty())
        .map(|(given, returns)| Sought::new(&sample.design, given, returns))
        .collect();
    let mean = |seconds: Vec<f64>| seconds.iter().sum::<f64>() / seconds.len() as f64;
    let exhaustive = sought.iter().take(6).map(|shot| shot.whole_scan(Sought::exhaustively));
    let exhaustive = mean(exhaustive.collect::<Fallible<_>>()?);
    let mut planner = FftPlanner::new();
    let fourier = sought.iter().step_by(3).take(2);
    let fourier = fourier.map(|shot| shot.whole_scan(|shot| shot.by_fourier(&mut planner)));
    let fourier = mean(fourier.collect::<Fallible<_>>()?);
    let ways = [
        ("receiver", receiver),
        ("every lag and every mark, 64 lags in a machine word", exhaustive),
        ("three Fourier transforms of 2¹⁹ points per shot", fourier),
    ];
    let rows = ways.map(|(way, seconds)| {
        let speed = sample.design.scan_period() / seconds;
        vec![way.to_owned(), page::speed(speed), three(seconds / receiver)]
    });
    Ok(page::table(&["way", "speed", "time, receiver = 1"], &rows))
}

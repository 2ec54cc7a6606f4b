//! The columns of a cloud as text that a page can hold: whole numbers of a step, their differences,
//! byte by byte, deflated, in base64.
//!
//! Neighbours of a scan are alike, so the differences are small and their upper bytes mostly 0: a
//! point takes a quarter of what it takes in a binary file.

use std::io::Write;

use base64::Engine;
use base64::engine::general_purpose::STANDARD as BASE64;
use flate2::Compression;
use flate2::write::ZlibEncoder;
use serde::Serialize;

/// Codes stay below this, so that the difference of any two fits 32 bits with its sign.
const MOST_CODES: f64 = (1_u32 << 30) as f64;

/// Name and unit of a column, and the step to which its values are kept.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Kept {
    pub name: &'static str,
    pub unit: &'static str,
    pub step: f64,
}

/// A packed column. Its codes are 0 where there is no value, else 1 + (value − `low`) / `step`, rounded. The
/// column keeps the differences of successive codes, from 0 on. A difference below 0 is kept as
/// 2·|difference| − 1, any other as 2·difference. The lowest byte of all of them comes first, then the next,
/// `bytes` in all.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Column {
    name: &'static str,
    unit: &'static str,
    low: f64,
    step: f64,
    bytes: usize,
    deflated: String,
}

impl Column {
    /// Packs `values`; nothing where no value is a number. A step too fine for the span of the values
    /// is made coarser by tens.
    pub fn of(kept: Kept, values: &[f64]) -> Option<Self> {
        let finite = || values.iter().copied().filter(|value| value.is_finite());
        let (low, high) = finite()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
        if low > high {
            return None;
        }
        let mut step = kept.step;
        while (high - low) / step >= MOST_CODES {
            step *= 10.0;
        }
        // Values kept are multiples of the step, so that they are told without a second rounding.
        let low = (low / step).floor() * step;
        let code = |value: f64| match value.is_finite() {
            true => 1 + ((value - low) / step).round() as i64,
            false => 0,
        };
        let mut before = 0;
        let differences: Vec<u32> = values
            .iter()
            .map(|&value| {
                let difference = code(value) - before;
                before += difference;
                (if difference < 0 { -2 * difference - 1 } else { 2 * difference }) as u32
            })
            .collect();
        let widest = differences.iter().copied().max().unwrap_or(0);
        let bytes = (32 - widest.leading_zeros()).div_ceil(8) as usize;
        let planes = (0..bytes).flat_map(|byte| {
            differences.iter().map(move |difference| (difference >> (8 * byte)) as u8)
        });
        let deflated = deflated(&planes.collect::<Vec<u8>>());
        Some(Self { name: kept.name, unit: kept.unit, low, step, bytes, deflated })
    }

    /// Characters it takes in the page.
    pub fn size(&self) -> usize {
        self.deflated.len()
    }
}

/// Deflated bytes in base64.
pub(super) fn deflated(bytes: &[u8]) -> String {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::fast());
    // Writing into memory does not fail.
    let whole = encoder.write_all(bytes).and_then(|()| encoder.finish());
    BASE64.encode(whole.unwrap_or_default())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read;

    const METRES: Kept = Kept { name: "x", unit: "m", step: 1e-4 };

    /// The values of a column, read in another way than the page does.
    fn unpacked(column: &Column, count: usize) -> Vec<f64> {
        let deflated = BASE64.decode(&column.deflated).unwrap();
        let mut planes = Vec::new();
        flate2::read::ZlibDecoder::new(&deflated[..]).read_to_end(&mut planes).unwrap();
        let mut code = 0_i64;
        let mut next = |at: usize| {
            let each =
                (0..column.bytes).map(|byte| i64::from(planes[byte * count + at]) << (8 * byte));
            let sum: i64 = each.sum();
            code += if sum % 2 == 1 { -(sum + 1) / 2 } else { sum / 2 };
            if code == 0 { f64::NAN } else { column.low + (code - 1) as f64 * column.step }
        };
        (0..count).map(&mut next).collect()
    }

    #[test]
    fn values_come_back_to_half_a_step() {
        let values: Vec<f64> = (0..500).map(|at| 40.0 * (f64::from(at) * 0.7).sin()).collect();
        let column = Column::of(METRES, &values).unwrap();
        for (value, back) in values.iter().zip(unpacked(&column, values.len())) {
            assert!((value - back).abs() <= 0.5001e-4, "{value} {back}");
        }
    }

    #[test]
    fn what_is_no_number_stays_none() {
        let values = [f64::NAN, 2.0, f64::INFINITY, 1.0];
        let back = unpacked(&Column::of(METRES, &values).unwrap(), 4);
        assert!(back[0].is_nan() && back[2].is_nan());
        assert!((back[1] - 2.0).abs() < 1e-9 && (back[3] - 1.0).abs() < 1e-9);
        assert_eq!(Column::of(METRES, &[f64::NAN]), None);
        assert_eq!(Column::of(METRES, &[]), None);
    }

    #[test]
    fn a_wide_span_is_kept_to_a_coarser_step() {
        let values = [-4e9, 4e9, 5.0];
        let column = Column::of(METRES, &values).unwrap();
        assert!((column.step - 10.0).abs() < 1e-9, "{}", column.step);
        let back = unpacked(&column, 3);
        assert!(values.iter().zip(back).all(|(value, back)| (value - back).abs() <= 5.0));
    }

    #[test]
    fn what_is_everywhere_the_same_takes_next_to_nothing() {
        let column = Column::of(METRES, &vec![7.25; 400_000]).unwrap();
        assert!(column.size() < 4096, "{}", column.size());
    }
}

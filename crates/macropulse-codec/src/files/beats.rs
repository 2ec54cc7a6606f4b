//! Beats as records of shots: the peaks of the spectra of each shot.

use super::head::HEADER;
use super::records::{RecordColumn, RecordValues, ShotRecord};
use super::source::number;
use crate::record::{Given, RecordKind};
use crate::{Beats, Peak};

/// Ramps of a shot at most.
const MOST_RAMPS: u32 = 2;

/// Places for peaks of a ramp at most.
const MOST_PEAKS: u32 = 256;

/// Bytes of a peak: its frequency and its power.
const PEAK: usize = 8;

impl ShotRecord for Beats {
    fn kind(&self) -> RecordKind {
        RecordKind::Beats
    }

    fn number(&self) -> &'static str {
        "peak"
    }

    fn numbers(&self) -> usize {
        self.ramps as usize * self.peaks as usize
    }

    fn shots(&self) -> usize {
        self.found.len() / self.numbers().max(1)
    }

    fn blank(&self, shots: usize) -> Box<dyn ShotRecord> {
        let found = vec![Peak::EMPTY; shots * self.numbers()];
        Box::new(Self { found, ..*self })
    }

    fn given(self: Box<Self>) -> Given {
        Given::Beats(*self)
    }

    fn write_header(&self, header: &mut [u8; HEADER]) {
        header[24..28].copy_from_slice(&self.ramps.to_le_bytes());
        header[28..32].copy_from_slice(&self.peaks.to_le_bytes());
    }

    fn check_header(&self, header: &[u8; HEADER]) -> Result<(), String> {
        let (ramps, peaks) = (number!(header, 24, u32), number!(header, 28, u32));
        let told = format!("{ramps} ramps of a shot with {peaks} peaks each");
        if !(1..=MOST_RAMPS).contains(&ramps) || !(1..=MOST_PEAKS).contains(&peaks) {
            return Err(format!("{told}, where it has 1 to {MOST_RAMPS} with 1 to {MOST_PEAKS}"));
        }
        match (ramps, peaks) == (self.ramps, self.peaks) {
            true => Ok(()),
            false => {
                Err(format!("{told}, where the sensor has {} with {}", self.ramps, self.peaks))
            }
        }
    }

    fn length(&self) -> usize {
        PEAK * self.numbers()
    }

    fn write_shot(&self, at: usize, bytes: &mut Vec<u8>) {
        for peak in self.of(at) {
            bytes.extend(peak.frequency.to_le_bytes());
            bytes.extend(peak.power.to_le_bytes());
        }
    }

    fn read_shot(&mut self, at: usize, bytes: &[u8]) {
        let each = self.numbers();
        let places = self.found.iter_mut().skip(at * each).take(each);
        for (place, bytes) in places.zip(bytes.chunks_exact(PEAK)) {
            *place = Peak { frequency: number!(bytes, 0, i32), power: number!(bytes, 4, u32) };
        }
    }

    fn counted(&self) -> u64 {
        self.found.iter().filter(|peak| peak.power > 0).count() as u64
    }

    fn columns(self: Box<Self>) -> Vec<RecordColumn> {
        let column = |name, number: fn(Peak) -> f64| RecordColumn {
            name,
            is_table: true,
            values: RecordValues::F64(self.found.iter().map(|peak| number(*peak)).collect()),
        };
        vec![column("frequency", Peak::bins), column("power", Peak::power)]
    }

    fn of_columns(&self, shots: usize, columns: Vec<RecordValues>) -> Box<dyn ShotRecord> {
        let mut columns = columns.into_iter();
        match (columns.next(), columns.next()) {
            (Some(RecordValues::F64(bins)), Some(RecordValues::F64(power)))
                if [bins.len(), power.len()] == [shots * self.numbers(); 2] =>
            {
                let found = bins.into_iter().zip(power).map(|(bins, power)| Peak::of(bins, power));
                Box::new(Self { found: found.collect(), ..*self })
            }
            _ => self.blank(shots),
        }
    }
}

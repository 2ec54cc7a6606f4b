//! Taps as records of shots: the codes of each shot.

use super::head::HEADER;
use super::records::{RecordColumn, RecordValues, ShotRecord};
use super::source::number;
use crate::Taps;
use crate::record::{Given, RecordKind};

/// Taps of a shot at most.
const MOST_TAPS: u32 = 1024;

/// Bytes of a code.
const CODE: usize = size_of::<u16>();

impl ShotRecord for Taps {
    fn kind(&self) -> RecordKind {
        RecordKind::Taps
    }

    fn number(&self) -> &'static str {
        "tap"
    }

    fn numbers(&self) -> usize {
        self.taps as usize
    }

    fn shots(&self) -> usize {
        self.codes.len() / self.numbers().max(1)
    }

    fn blank(&self, shots: usize) -> Box<dyn ShotRecord> {
        Box::new(Self { codes: vec![0; shots * self.numbers()], ..*self })
    }

    fn given(self: Box<Self>) -> Given {
        Given::Taps(*self)
    }

    fn write_header(&self, header: &mut [u8; HEADER]) {
        header[24..28].copy_from_slice(&self.taps.to_le_bytes());
    }

    fn check_header(&self, header: &[u8; HEADER]) -> Result<(), String> {
        let (taps, own) = (number!(header, 24, u32), self.taps);
        if !(1..=MOST_TAPS).contains(&taps) {
            return Err(format!("{taps} taps of a shot, where it has 1 to {MOST_TAPS}"));
        }
        match taps == own {
            true => Ok(()),
            false => Err(format!("{taps} taps of a shot, where the sensor has {own}")),
        }
    }

    fn length(&self) -> usize {
        CODE * self.numbers()
    }

    fn write_shot(&self, at: usize, bytes: &mut Vec<u8>) {
        bytes.extend(self.of(at).iter().flat_map(|code| code.to_le_bytes()));
    }

    fn read_shot(&mut self, at: usize, bytes: &[u8]) {
        let each = self.numbers();
        let places = self.codes.iter_mut().skip(at * each).take(each);
        for (place, bytes) in places.zip(bytes.chunks_exact(CODE)) {
            *place = number!(bytes, 0, u16);
        }
    }

    fn counted(&self) -> u64 {
        self.codes.len() as u64
    }

    fn columns(self: Box<Self>) -> Vec<RecordColumn> {
        let values = RecordValues::U16(self.codes);
        vec![RecordColumn { name: "codes", is_table: true, values }]
    }

    fn of_columns(&self, shots: usize, columns: Vec<RecordValues>) -> Box<dyn ShotRecord> {
        match columns.into_iter().next() {
            Some(RecordValues::U16(codes)) if codes.len() == shots * self.numbers() => {
                Box::new(Self { codes, ..*self })
            }
            _ => self.blank(shots),
        }
    }
}

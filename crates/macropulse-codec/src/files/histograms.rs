//! Histograms as records of shots: the pulses of each shot, and its counts.

use super::LONGEST_FS;
use super::head::HEADER;
use super::records::{RecordColumn, RecordValues, ShotRecord};
use super::source::number;
use crate::Histograms;
use crate::record::{Given, RecordKind};

/// Bins of a histogram at most: 256 KiB.
const MOST_BINS: u32 = 1 << 16;

/// Bytes before the counts of a shot: its cycles, and four bytes of 0.
const CYCLES: usize = 8;

/// Bytes of a count.
const COUNT: usize = size_of::<u32>();

impl ShotRecord for Histograms {
    fn kind(&self) -> RecordKind {
        RecordKind::Histograms
    }

    fn number(&self) -> &'static str {
        "bin"
    }

    fn numbers(&self) -> usize {
        self.bins as usize
    }

    fn shots(&self) -> usize {
        self.len()
    }

    fn blank(&self, shots: usize) -> Box<dyn ShotRecord> {
        let counts = vec![0; shots * self.numbers()];
        Box::new(Self { cycles: vec![0; shots], counts, ..*self })
    }

    fn given(self: Box<Self>) -> Given {
        Given::Histograms(*self)
    }

    fn write_header(&self, header: &mut [u8; HEADER]) {
        header[24..32].copy_from_slice(&self.bin_fs.to_le_bytes());
        header[48..56].copy_from_slice(&self.offset_fs.to_le_bytes());
        header[56..60].copy_from_slice(&self.bins.to_le_bytes());
    }

    fn check_header(&self, header: &[u8; HEADER]) -> Result<(), String> {
        let (bin_fs, offset_fs) = (number!(header, 24, i64), number!(header, 48, i64));
        let bins = number!(header, 56, u32);
        if !(1..=MOST_BINS).contains(&bins) {
            return Err(format!("histograms of {bins} bins, where they have 1 to {MOST_BINS}"));
        }
        if !(1..=LONGEST_FS / i64::from(MOST_BINS)).contains(&bin_fs) {
            return Err(format!("bins of {bin_fs} fs, where they are 1 fs to 137 s wide"));
        }
        let begins = format!("the first bin begins {offset_fs} fs after firing");
        if offset_fs.unsigned_abs() > LONGEST_FS.unsigned_abs() {
            return Err(format!("{begins}, more than 9000 s"));
        }
        if bin_fs != self.bin_fs {
            let own = self.bin_fs;
            return Err(format!("bins of {bin_fs} fs, where those of the sensor are of {own} fs"));
        }
        if offset_fs != self.offset_fs {
            let own = self.offset_fs;
            return Err(format!("{begins}, where that of the sensor does after {own} fs"));
        }
        match bins == self.bins {
            true => Ok(()),
            false => Err(format!(
                "histograms of {bins} bins, where those of the sensor have {}",
                self.bins
            )),
        }
    }

    fn length(&self) -> usize {
        CYCLES + COUNT * self.numbers()
    }

    fn write_shot(&self, at: usize, bytes: &mut Vec<u8>) {
        bytes.extend(self.cycles.get(at).copied().unwrap_or_default().to_le_bytes());
        bytes.extend([0; 4]);
        bytes.extend(self.of(at).iter().flat_map(|count| count.to_le_bytes()));
    }

    fn read_shot(&mut self, at: usize, bytes: &[u8]) {
        let each = self.numbers();
        if let Some(cycles) = self.cycles.get_mut(at) {
            *cycles = number!(bytes, 0, u32);
        }
        let places = self.counts.iter_mut().skip(at * each).take(each);
        let counts = bytes.get(CYCLES..).unwrap_or_default().chunks_exact(COUNT);
        for (place, bytes) in places.zip(counts) {
            *place = number!(bytes, 0, u32);
        }
    }

    fn check_shot(&self, bytes: &[u8]) -> Result<(), String> {
        match number!(bytes, 4, u32) {
            0 => Ok(()),
            _ => {
                Err("a histogram has four bytes of 0 behind its cycles: is the file damaged?"
                    .into())
            }
        }
    }

    fn counted(&self) -> u64 {
        self.counts.iter().map(|count| u64::from(*count)).sum()
    }

    fn columns(self: Box<Self>) -> Vec<RecordColumn> {
        let column = |name, is_table, values| RecordColumn { name, is_table, values };
        vec![
            column("bin_fs", false, RecordValues::Shared(self.bin_fs)),
            column("offset_fs", false, RecordValues::Shared(self.offset_fs)),
            column("cycles", false, RecordValues::U32(self.cycles)),
            column("counts", true, RecordValues::U32(self.counts)),
        ]
    }

    fn of_columns(&self, shots: usize, columns: Vec<RecordValues>) -> Box<dyn ShotRecord> {
        let mut columns = columns.into_iter().skip(2);
        match (columns.next(), columns.next()) {
            (Some(RecordValues::U32(cycles)), Some(RecordValues::U32(counts)))
                if cycles.len() == shots && counts.len() == shots * self.numbers() =>
            {
                Box::new(Self { cycles, counts, ..*self })
            }
            _ => self.blank(shots),
        }
    }
}

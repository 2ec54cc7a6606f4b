//! The shot log: what the sensor itself knows of what it sent.

use std::ops::Range;

/// A run of consecutive shots, as columns. Shot `i` of the log has the absolute id `first + i`.
///
/// This is everything the receiver may know of the transmitter: where and when each shot was
/// fired and with which code. It holds nothing of the scene.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ShotLog {
    /// Absolute id of the first shot here, counted from the first shot of the first scan.
    pub first: u64,
    /// Absolute time at which the first chip leaves, fs; never decreasing.
    pub fired_at_fs: Vec<i64>,
    /// Row of the pixel, 0 at the top.
    pub row: Vec<u16>,
    /// Column of the pixel, 0 at the left.
    pub column: Vec<u16>,
    /// The number the macropulse carries; 0 where shots carry none.
    pub label: Vec<u16>,
    /// Index of the code word in its family; 0 where shots are not coded.
    pub word: Vec<u16>,
    /// The detector that listens to this shot.
    pub channel: Vec<u16>,
    /// The owned shots, whose returns are wanted. The others are guard shots: they are decoded
    /// too, because their light overlaps, and their results dropped.
    pub owned: Range<usize>,
}

impl ShotLog {
    /// The log of shots that a single detector listens to, without labels: when each was fired, fs,
    /// ascending, and in which code word. Shot `n` goes to column `n` of row 0, and all are owned.
    pub fn of_one_channel(fired_at_fs: &[i64], words: &[u16]) -> Self {
        let shots = fired_at_fs.len().min(words.len());
        Self {
            first: 0,
            fired_at_fs: fired_at_fs[..shots].to_vec(),
            row: vec![0; shots],
            column: (0..shots).map(|shot| shot as u16).collect(),
            label: vec![0; shots],
            word: words[..shots].to_vec(),
            channel: vec![0; shots],
            owned: 0..shots,
        }
    }

    /// Number of shots, guard shots included.
    pub fn len(&self) -> usize {
        self.fired_at_fs.len()
    }

    /// The `shots` of the log, counted in it, as a log of their own; as far as they are there. Owned are
    /// those of them that were. Columns that are too short stay so.
    pub fn part(&self, shots: Range<usize>) -> Self {
        let end = shots.end.min(self.len());
        let shots = shots.start.min(end)..end;
        let column = |column: &[u16]| {
            let end = shots.end.min(column.len());
            column[shots.start.min(end)..end].to_vec()
        };
        let place = |shot: usize| shot.clamp(shots.start, shots.end) - shots.start;
        Self {
            first: self.first.saturating_add(shots.start as u64),
            fired_at_fs: self.fired_at_fs[shots.clone()].to_vec(),
            row: column(&self.row),
            column: column(&self.column),
            label: column(&self.label),
            word: column(&self.word),
            channel: column(&self.channel),
            owned: place(self.owned.start)..place(self.owned.end),
        }
    }

    /// The log of each channel by itself, and which of the shots here are in it, ascending. A log whose
    /// columns differ in length is not parted.
    pub fn each_channel(&self) -> Vec<(Vec<usize>, Self)> {
        let mut shots: Vec<usize> = (0..self.len()).collect();
        let columns = [&self.row, &self.column, &self.label, &self.word, &self.channel];
        if columns.iter().any(|column| column.len() != self.len()) {
            return vec![(shots, self.clone())];
        }
        shots.sort_by_key(|shot| self.channel[*shot]);
        let of_channel = |shots: &[usize]| {
            let column = |column: &[u16]| shots.iter().map(|shot| column[*shot]).collect();
            let before = |shot: usize| shots.partition_point(|other| *other < shot);
            Self {
                first: self.first.saturating_add(shots[0] as u64),
                fired_at_fs: shots.iter().map(|shot| self.fired_at_fs[*shot]).collect(),
                row: column(&self.row),
                column: column(&self.column),
                label: column(&self.label),
                word: column(&self.word),
                channel: column(&self.channel),
                owned: before(self.owned.start)..before(self.owned.end),
            }
        };
        let channels = shots.chunk_by(|one, next| self.channel[*one] == self.channel[*next]);
        channels.map(|shots| (shots.to_vec(), of_channel(shots))).collect()
    }

    /// True if there is no shot.
    pub fn is_empty(&self) -> bool {
        self.fired_at_fs.is_empty()
    }
}

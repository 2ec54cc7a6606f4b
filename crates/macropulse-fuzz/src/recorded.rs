//! Shots and ticks as text and as bytes.

use macropulse::codec::Cut;
use macropulse::codec::files::{Error, Limits, ShotReader, Stream, TickReader};

use crate::assert_told;

const TICK_FS: i64 = 1000;

const LIMITS: Limits = Limits { rows: 8, columns: 64, labels: 16, words: 5, channels: 4 };

const CUT: Cut = Cut {
    tick_fs: TICK_FS,
    clock_fs: 10 * TICK_FS,
    jitter_fs: 0,
    listening_fs: 2_200_000,
    lead_fs: 200_000,
    history_fs: 3_600_000,
};

/// What parts the shots from the ticks of a stream.
const PART: &[u8] = b"\n----\n";

fn told<T>(read: Result<T, Error>) -> Option<T> {
    read.map_err(|error| assert_told(&error)).ok()
}

/// Reads `bytes` as a shot log.
pub fn shots(bytes: &[u8]) {
    if let Some(mut reader) = told(ShotReader::new(bytes, LIMITS)) {
        while let Some(shot) = told(reader.next_shot()).flatten() {
            assert!(u32::from(shot.label) < LIMITS.labels && u32::from(shot.row) < LIMITS.rows);
        }
    }
}

/// Reads `bytes` as ticks.
pub fn ticks(bytes: &[u8]) {
    if let Some(mut reader) = told(TickReader::new(bytes, TICK_FS, LIMITS.channels)) {
        while let Some(tick) = told(reader.next_tick()).flatten() {
            assert!(u32::from(tick.channel) < LIMITS.channels);
        }
    }
}

/// Reads `bytes` as shots and, behind a line of four dashes, ticks, and cuts them into bands.
pub fn stream(bytes: &[u8]) {
    let parted = bytes.windows(PART.len()).position(|window| window == PART);
    let (shots, ticks) =
        parted.map_or((bytes, bytes), |at| (&bytes[..=at], &bytes[at + PART.len()..]));
    let Some(shots) = told(ShotReader::new(shots, LIMITS)) else { return };
    let Some(ticks) = told(TickReader::new(ticks, TICK_FS, LIMITS.channels)) else { return };
    let mut stream = Stream::new(CUT, shots, ticks, true);
    for _ in 0..100 {
        let Some((log, ticks)) = told(stream.next_band(|first| first + 4)).flatten() else { break };
        assert!(log.owned.end <= log.len() && ticks.tick.len() == ticks.channel.len());
    }
}

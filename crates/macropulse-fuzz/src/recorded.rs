//! Shots and their records as text and as bytes.

use macropulse::codec::files::{
    Error, Limits, RecordReader, SampleHeader, SampleReader, ShotReader, Stream, TickReader,
};
use macropulse::codec::{Beats, Cut, Given, Histograms, Peak, Taps};

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

/// Separator of the shots from the ticks of a stream.
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
        let Some((log, given)) = told(stream.next_band(|first| first + 4)).flatten() else { break };
        let Given::Ticks(ticks) = given else { break };
        assert!(log.owned.end <= log.len() && ticks.tick.len() == ticks.channel.len());
    }
}

/// Header of the sensor's samples.
const SAMPLES: SampleHeader = SampleHeader {
    tick_fs: TICK_FS,
    channels: LIMITS.channels,
    codes: (-102, 921),
    step_photons: Some(15.0),
    digest: None,
    count: None,
};

/// The shots that samples are cut for: a microsecond apart.
const SHOTS: &[u8] = b"# macropulse shots 1\nfired_ps,row,column\n0,0,0\n1000,0,1\n2000,0,2\n";

/// Reads `bytes` as samples, and cuts those of three shots out of them.
pub fn samples(bytes: &[u8]) {
    let Some(shots) = told(ShotReader::new(SHOTS, LIMITS)) else { return };
    let Some(samples) = told(SampleReader::new(bytes, &SAMPLES)) else { return };
    let mut stream = Stream::of_samples(CUT, shots, samples);
    while let Some((log, given)) = told(stream.next_band(|first| first + 2)).flatten() {
        let Given::Samples(samples) = given else { break };
        assert!(log.owned.end <= log.len());
        assert_eq!(samples.per_channel() * samples.channel.len(), samples.code.len());
        let (lowest, highest) = SAMPLES.codes;
        assert!(samples.code.iter().all(|code| (lowest..=highest).contains(code)));
    }
}

/// A record of each kind that is made shot by shot, as a sensor has it.
fn blanks() -> [Given; 3] {
    let (cycles, counts) = (vec![0], vec![0; 32]);
    let histograms = Histograms { bin_fs: TICK_FS, offset_fs: 0, bins: 32, cycles, counts };
    let beats = Beats { ramps: 2, peaks: 2, found: vec![Peak::EMPTY; 4] };
    [
        Given::Histograms(histograms),
        Given::Taps(Taps { taps: 8, codes: vec![0; 8] }),
        Given::Beats(beats),
    ]
}

/// Reads `bytes` as a record of each kind that is made shot by shot, and cuts that of three shots out of them.
pub fn records(bytes: &[u8]) {
    for blank in blanks() {
        let Some(wanted) = blank.of_shots() else { continue };
        let Some(shots) = told(ShotReader::new(SHOTS, LIMITS)) else { return };
        let Some(records) = told(RecordReader::new(bytes, wanted)) else { continue };
        let mut stream = Stream::of_records(CUT, shots, records);
        while let Some((log, given)) = told(stream.next_band(|first| first + 2)).flatten() {
            assert_eq!(given.len(), log.len() * blank.len());
        }
    }
}

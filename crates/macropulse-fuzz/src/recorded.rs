//! Shots, ticks, samples, histograms, taps and beats as text and as bytes.

use macropulse::codec::files::{
    BeatHeader, BeatReader, Error, HistogramHeader, HistogramReader, Limits, SampleHeader,
    SampleReader, ShotReader, Stream, TapHeader, TapReader, TickReader,
};
use macropulse::codec::{Cut, Given};

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

/// Header of the sensor's histograms.
const HISTOGRAMS: HistogramHeader =
    HistogramHeader { bin_fs: TICK_FS, offset_fs: 0, bins: 32, digest: None, count: None };

/// Reads `bytes` as histograms.
pub fn histograms(bytes: &[u8]) {
    if let Some(mut reader) = told(HistogramReader::new(bytes, &HISTOGRAMS)) {
        while let Some(histogram) = told(reader.next_histogram()).flatten() {
            assert_eq!(histogram.counts.len(), HISTOGRAMS.bins as usize);
        }
    }
}

/// Header of the sensor's beats.
const BEATS: BeatHeader = BeatHeader { ramps: 2, peaks: 2, digest: None, count: None };

/// Reads `bytes` as beats, and cuts those of three shots out of them.
pub fn beats(bytes: &[u8]) {
    let Some(shots) = told(ShotReader::new(SHOTS, LIMITS)) else { return };
    let Some(beats) = told(BeatReader::new(bytes, &BEATS)) else { return };
    let mut stream = Stream::of_beats(CUT, shots, beats);
    while let Some((log, given)) = told(stream.next_band(|first| first + 2)).flatten() {
        let Given::Beats(beats) = given else { break };
        assert_eq!(beats.found.len(), 4 * log.len());
    }
}

/// Header of the sensor's taps.
const TAPS: TapHeader = TapHeader { taps: 8, digest: None, count: None };

/// Reads `bytes` as taps, and cuts those of three shots out of them.
pub fn taps(bytes: &[u8]) {
    let Some(shots) = told(ShotReader::new(SHOTS, LIMITS)) else { return };
    let Some(taps) = told(TapReader::new(bytes, &TAPS)) else { return };
    let mut stream = Stream::of_taps(CUT, shots, taps);
    while let Some((log, given)) = told(stream.next_band(|first| first + 2)).flatten() {
        let Given::Taps(taps) = given else { break };
        assert_eq!(taps.codes.len(), TAPS.taps as usize * log.len());
    }
}

//! Samples as files. Reading gives what was written, and an error names its place. Bands are cut out of a
//! stream as they were put into it, and no bytes make a reader panic.

#![allow(clippy::unwrap_used, clippy::panic)]

use macropulse_codec::files::{
    Digest, Error, Form, Limits, SampleBlock, SampleHeader, SampleReader, SampleWriter, Shot,
    ShotHeader, ShotReader, ShotWriter, Stream,
};
use macropulse_codec::{Cut, Given, Samples, ShotLog};
use proptest::prelude::*;

const TICK_FS: i64 = 1000;

const LIMITS: Limits = Limits { rows: 8, columns: 64, labels: 16, words: 5, channels: 3 };

const CUT: Cut = Cut {
    tick_fs: TICK_FS,
    clock_fs: TICK_FS,
    jitter_fs: 0,
    listening_fs: 2_200_000,
    lead_fs: 200_000,
    history_fs: 3_600_000,
};

fn header() -> SampleHeader {
    SampleHeader {
        tick_fs: TICK_FS,
        channels: 3,
        codes: (-102, 921),
        step_photons: Some(15.0),
        digest: None,
        count: None,
    }
}

/// The code of a channel at an absolute tick.
fn code(channel: u16, tick: i64) -> i16 {
    ((tick * 31 + i64::from(channel) * 77).rem_euclid(1024) - 102) as i16
}

/// All channels from tick `from` to `until`.
fn samples(from: i64, until: i64) -> Samples {
    let codes = |channel: u16| (from..until).map(move |tick| code(channel, tick));
    Samples { epoch: from, channel: vec![0, 1, 2], code: (0..3).flat_map(codes).collect() }
}

/// A file of these, one behind the other.
fn written(header: &SampleHeader, parts: &[Samples]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut writer = SampleWriter::new(&mut bytes, header).unwrap();
    for part in parts {
        let end = part.epoch + part.per_channel() as i64;
        writer.write(part, end).unwrap();
    }
    bytes
}

fn read(bytes: &[u8]) -> Result<(SampleHeader, Vec<SampleBlock>), Error> {
    let mut reader = SampleReader::new(bytes, &header())?;
    let mut blocks = Vec::new();
    while let Some(block) = reader.next_block()? {
        blocks.push(block);
    }
    Ok((*reader.header(), blocks))
}

#[test]
fn samples_are_read_as_they_were_written() {
    for (count, digest) in [(None, None), (Some(6), Digest::parse(&"7f".repeat(16)))] {
        let header = SampleHeader { count, digest, ..header() };
        let bytes = written(&header, &[samples(-7, 100), samples(250, 252)]);
        let (is, blocks) = read(&bytes).unwrap();
        assert_eq!((is, blocks.len()), (header, 6));
        for (at, block) in blocks.iter().enumerate() {
            let (first, end) = if at < 3 { (-7, 100) } else { (250, 252) };
            assert_eq!((block.first, block.end(), block.channel), (first, end, at as u16 % 3));
            let wanted: Vec<i16> = (first..end).map(|tick| code(block.channel, tick)).collect();
            assert_eq!(block.code, wanted);
        }
    }
}

/// The bytes of the documentation, one by one.
#[test]
fn a_file_is_as_it_is_documented() {
    let of_two = Samples { epoch: -2, channel: vec![2], code: vec![-1, 258] };
    let header = SampleHeader { count: Some(1), digest: Some(Digest([9; 16])), ..header() };
    let bytes = written(&header, &[of_two]);
    assert_eq!(bytes.len(), 128 + 16 + 4);
    assert_eq!(bytes[..24], *b"MPSAMPL\0\x01\0\0\0\x80\0\0\0\x01\0\0\0\0\0\0\0");
    assert_eq!(bytes[24..32], TICK_FS.to_le_bytes());
    assert_eq!((&bytes[32..48], &bytes[48..56]), (&[9; 16][..], &[0; 8][..]));
    assert_eq!(bytes[56..64], [3, 0, 0, 0, 0x9a, 0xff, 0x99, 0x03]);
    assert_eq!((&bytes[64..72], &bytes[72..128]), (&15.0_f64.to_le_bytes()[..], &[0; 56][..]));
    assert_eq!(bytes[128..136], (-2_i64).to_le_bytes());
    assert_eq!(bytes[136..], [2, 0, 0, 0, 2, 0, 0, 0, 0xff, 0xff, 2, 1]);
}

/// A long run is cut at the same ticks in all channels, so that blocks stay in order.
#[test]
fn a_long_run_becomes_several_blocks() {
    let count = (1 << 20) + 5;
    let long = Samples { epoch: 3, channel: vec![0, 2], code: vec![7; 2 * count] };
    let bytes = written(&header(), &[long]);
    let (_, blocks) = read(&bytes).unwrap();
    let told: Vec<(i64, u16, usize)> =
        blocks.iter().map(|block| (block.first, block.channel, block.code.len())).collect();
    let cut = 1 << 20;
    assert_eq!(told, [(3, 0, cut), (3, 2, cut), (3 + cut as i64, 0, 5), (3 + cut as i64, 2, 5)]);
}

/// `bytes` with others from place `at` on.
fn with(bytes: &[u8], at: usize, others: &[u8]) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    bytes[at..at + others.len()].copy_from_slice(others);
    bytes
}

#[test]
fn what_is_wrong_is_one_sentence_with_its_place() {
    let good = written(&SampleHeader { count: Some(3), ..header() }, &[samples(0, 50)]);
    let second = 128 + 16 + 100;
    let wrong = |bytes: &[u8]| read(bytes).unwrap_err().to_string();
    for (bytes, words) in [
        (good[..good.len() - 3].to_vec(), &["byte ", "truncated"][..]),
        (good[..second].to_vec(), &["after 1 of 3 blocks", "truncated"]),
        (good[..second + 16].to_vec(), &["after 0 of 50 codes", "truncated"]),
        (good[..second + 9].to_vec(), &["byte 244", "9 bytes into a record of 16"]),
        (good[..100].to_vec(), &["100 bytes into a record of 128"]),
        (Vec::new(), &["is empty"]),
        (b"# macropulse samples 1".to_vec(), &["is text", "binary form alone"]),
        (b"RIFF".to_vec(), &["this is no file of Macropulse's samples"]),
        (with(&good, 0, b"MPTICKS\0"), &["these are ticks, where the sensor records samples"]),
        (with(&good, 0, b"MPSHOTS\0"), &["the shot log comes first, then the samples"]),
        (with(&good, 8, &[2]), &["version `2` of samples", "reads 1"]),
        (with(&good, 16, &[2]), &["byte 360", "there are 2 blocks only"]),
        (with(&good, 16, &[255; 8]), &[]),
        (with(&good, 24, &500_i64.to_le_bytes()), &["500 fs apart", "1000 fs apart"]),
        (with(&good, 24, &0_i64.to_le_bytes()), &["0 fs apart"]),
        (with(&good, 56, &[4]), &["4 channels, where the sensor has 3"]),
        (with(&good, 60, &[0, 0]), &["codes from 0 to 921", "-102 to 921"]),
        (with(&good, 64, &f64::NAN.to_le_bytes()), &["a step of NaN photons"]),
        (with(&good, 64, &(-1.0_f64).to_le_bytes()), &["a step of -1 photons"]),
        (with(&good, 64, &f64::INFINITY.to_le_bytes()), &["a step of inf photons"]),
        (with(&good, 64, &15.1_f64.to_le_bytes()), &["steps of 15.1 photons", "are of 15"]),
        (with(&good, 64, &0.0_f64.to_le_bytes()), &[]),
        (with(&good, 128, &i64::MIN.to_le_bytes()), &["byte 128", "more than 9000 s"]),
        (with(&good, 136, &u32::MAX.to_le_bytes()), &["a block of 4294967295 codes"]),
        (with(&good, 136, &0_u32.to_le_bytes()), &["a block of 0 codes"]),
        (with(&good, 140, &[3]), &["channel 3 is not among the 3 of the sensor"]),
        (with(&good, 142, &[1]), &["two bytes of 0"]),
        (with(&good, 144, &922_i16.to_le_bytes()), &["byte 144: code 922 at tick 0 of channel 0"]),
        (with(&good, 150, &[0, 0x80]), &["byte 150: code -32768 at tick 3 of channel 0"]),
        (with(&good, second, &(-1_i64).to_le_bytes()), &["byte 244", "sort them by tick"]),
        (with(&good, second + 12, &[0]), &["begins before tick 50"]),
    ] {
        if words.is_empty() {
            assert!(read(&bytes).is_ok(), "{}", wrong(&bytes));
            continue;
        }
        let said = wrong(&bytes);
        assert!(words.iter().all(|word| said.contains(word)), "{said}: not {words:?}");
        assert_eq!(said.lines().count(), 1, "{said}");
    }
}

/// Shots half a microsecond apart.
fn shots(count: u16) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut writer = ShotWriter::new(&mut bytes, Form::Binary, &ShotHeader::default()).unwrap();
    for n in 0..count {
        let fired_fs = i64::from(n) * 500_000;
        let shot =
            Shot { fired_fs, row: n / 64, column: n % 64, channel: n % 3, ..Shot::default() };
        writer.write(&shot).unwrap();
    }
    bytes
}

fn bands(shots: &[u8], samples: &[u8]) -> Result<Vec<(ShotLog, Samples)>, Error> {
    let shots = ShotReader::new(shots, LIMITS)?;
    let samples = SampleReader::new(samples, &header())?;
    let mut stream = Stream::of_samples(CUT, shots, samples);
    let mut bands = Vec::new();
    while let Some((log, given)) = stream.next_band(|first| first + 10)? {
        let Given::Samples(samples) = given else { panic!("ticks out of samples") };
        bands.push((log, samples));
    }
    Ok(bands)
}

/// However the stream is cut into blocks, a band has all samples of its time, and none else.
#[test]
fn bands_have_the_samples_of_their_time() {
    let shots = shots(60);
    for step in [37, 400, 5000, 100_000] {
        let parts: Vec<Samples> =
            (-300..33_000).step_by(step).map(|at| samples(at, at + step as i64)).collect();
        let bands = bands(&shots, &written(&header(), &parts)).unwrap();
        assert_eq!(bands.len(), 6);
        for (log, given) in bands {
            let fired = |shot: usize| log.fired_at_fs[shot];
            let span = CUT.ticks(fired(log.owned.start), fired(log.owned.end - 1));
            assert_eq!(given, samples(span.start, span.end), "blocks of {step}");
        }
    }
}

/// A recording may begin late and end early, but has no hole where light is looked for.
#[test]
fn what_is_missing_at_the_ends_is_left_out_and_a_hole_is_told() {
    let shots = shots(60);
    let whole = bands(&shots, &written(&header(), &[samples(100, 31_000)])).unwrap();
    assert_eq!((whole[0].1.epoch, whole[0].1.per_channel()), (100, 6801));
    let last = &whole[5].1;
    assert_eq!(last.epoch + last.per_channel() as i64, 31_000);
    let nothing = bands(&shots, &written(&header(), &[])).unwrap();
    assert!(nothing.len() == 6 && nothing.iter().all(|(_, given)| given.is_empty()));
    let hole = [samples(-300, 2000), samples(2001, 33_000)];
    let refused = |parts: &[Samples]| match bands(&shots, &written(&header(), parts)) {
        Ok(_) => panic!("accepted"),
        Err(error) => error.to_string(),
    };
    let said = refused(&hole);
    assert!(said.contains("channel 0 from tick 2000 to 2000 are missing"), "{said}");
    let mut uneven = samples(-300, 33_000);
    uneven.channel.truncate(2);
    uneven.code.truncate(2 * 33_300);
    let short = Samples { epoch: -150, channel: vec![2], code: vec![0; 33_150] };
    let said = refused(&[uneven, short]);
    assert!(said.contains("record all channels for the same time"), "{said}");
    // A hole does not matter at a time when no light is looked for.
    let few = [samples(-300, 33_000), samples(90_000, 90_010)];
    assert_eq!(bands(&shots, &written(&header(), &few)).unwrap().len(), 6);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, ..ProptestConfig::default() })]

    /// Whatever happens to the bytes: an error of one line, or bands whose channels are as long as each
    /// other.
    #[test]
    fn damaged_files_are_refused_or_cut(
        spoils in proptest::collection::vec((0..2000_usize, any::<u8>()), 0..6),
        keep in 0..4000_usize,
    ) {
        let parts = [samples(-300, 100), samples(100, 400), samples(400, 600)];
        let mut file = written(&SampleHeader { count: Some(9), ..header() }, &parts);
        for (at, byte) in spoils {
            let length = file.len();
            file[at * 7 % length] = byte;
        }
        file.truncate(file.len() - keep.min(300) * usize::from(keep < 300));
        match bands(&shots(20), &file) {
            Err(error) => prop_assert_eq!(error.to_string().lines().count(), 1),
            Ok(bands) => for (_, given) in bands {
                prop_assert_eq!(given.per_channel() * given.channel.len(), given.code.len());
            },
        }
    }

    #[test]
    fn any_bytes_are_refused_or_read(bytes in proptest::collection::vec(any::<u8>(), 0..300)) {
        let start = written(&header(), &[]);
        for magic in [&b""[..], b"M", &start[..64], &start] {
            let _ = read(&[magic, &bytes].concat());
        }
    }
}

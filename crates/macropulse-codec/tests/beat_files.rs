//! Beats as files: what is written is read, what is wrong has a place, and nothing that is given makes a reader panic.

#![allow(clippy::unwrap_used, clippy::panic)]

use macropulse_codec::files::{Digest, Error, RecordHeader, RecordReader, RecordWriter};
use macropulse_codec::{Beats, Given, Peak};
use proptest::prelude::*;

fn header() -> RecordHeader {
    RecordHeader { digest: Digest::parse(&"7f".repeat(16)), count: Some(2) }
}

fn beats() -> Beats {
    let peak = |frequency, power| Peak { frequency, power };
    let found = vec![peak(258, 7), peak(-1, 9), Peak::EMPTY, peak(i32::MIN, u32::MAX)];
    Beats { ramps: 2, peaks: 1, found }
}

fn written(header: &RecordHeader, beats: &Beats, first: u64) -> Vec<u8> {
    let mut bytes = Vec::new();
    RecordWriter::new(&mut bytes, beats, header).unwrap().write(beats, first).unwrap();
    bytes
}

type Read = (RecordHeader, Vec<(u64, Vec<Peak>)>);

fn read(bytes: &[u8]) -> Result<Read, Error> {
    let mut reader = RecordReader::new(bytes, &beats())?;
    let mut read = Vec::new();
    while let Some((shot, record)) = reader.next_shot()? {
        let Given::Beats(beats) = record else { panic!("{record:?}") };
        read.push((shot, beats.found));
    }
    Ok((*reader.header(), read))
}

/// The bytes of the documentation, one by one.
#[test]
fn a_file_has_the_documented_bytes_and_is_read_as_it_was_written() {
    let bytes = written(&header(), &beats(), 300);
    assert_eq!(bytes[..24], *b"MPBEATS\0\x01\0\0\0\x80\0\0\0\x02\0\0\0\0\0\0\0");
    assert_eq!((&bytes[24..32], &bytes[32..48]), (&b"\x02\0\0\0\x01\0\0\0"[..], &[0x7f; 16][..]));
    assert_eq!(bytes[48..128], [0; 80]);
    assert_eq!(
        bytes[128..152],
        *b"\x2c\x01\0\0\0\0\0\0\x02\x01\0\0\x07\0\0\0\xff\xff\xff\xff\x09\0\0\0"
    );
    let (is, found) = read(&bytes).unwrap();
    assert_eq!(is, header());
    let all: Vec<Peak> = found.iter().flat_map(|(_, peaks)| peaks.clone()).collect();
    assert_eq!((found[0].0, found[1].0, all), (300, 301, beats().found));
}

/// `bytes` with others from place `at` on.
fn with(bytes: &[u8], at: usize, others: &[u8]) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    bytes[at..at + others.len()].copy_from_slice(others);
    bytes
}

#[test]
fn what_is_wrong_is_one_sentence_with_its_place() {
    let good = written(&header(), &beats(), 5);
    let second = 128 + 24;
    for (bytes, words) in [
        (good[..good.len() - 3].to_vec(), &["byte 152", "21 bytes into a record of 24"][..]),
        (good[..second].to_vec(), &["after 1 of 2 shots", "truncated"]),
        (b"# macropulse beats 1".to_vec(), &["is text", "binary form alone"]),
        (b"RIFF".to_vec(), &["this is no file of Macropulse's beats"]),
        (with(&good, 0, b"MPTAPS\0\0"), &["these are taps, where the sensor records beats"]),
        (
            with(&good, 24, &[1]),
            &["1 ramps of a shot with 1 peaks each", "the sensor has 2 with 1"],
        ),
        (with(&good, 24, &[3]), &["3 ramps of a shot", "1 to 2 with 1 to 256"]),
        (with(&good, 28, &[255; 4]), &["4294967295 peaks each", "1 to 256"]),
        (with(&good, second, &[5]), &["the record of shot 5 comes after that of shot 5"]),
    ] {
        let said = read(&bytes).unwrap_err().to_string();
        assert!(words.iter().all(|word| said.contains(word)), "{said}: not {words:?}");
        assert_eq!(said.lines().count(), 1, "{said}");
    }
    assert!(read(&good).is_ok() && read(&with(&good, 16, &[255; 8])).is_ok());
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, ..ProptestConfig::default() })]

    /// Whatever happens to the bytes: an error of one line, or shots with all their peaks.
    #[test]
    fn damaged_files_are_refused_or_read(
        spoils in proptest::collection::vec((0..176_usize, any::<u8>()), 0..6),
        keep in 0..220_usize,
    ) {
        let mut file = written(&header(), &beats(), 1);
        for (at, byte) in spoils {
            file[at] = byte;
        }
        file.truncate(keep);
        match read(&file) {
            Ok((_, found)) => prop_assert!(found.iter().all(|(_, peaks)| peaks.len() == 2)),
            Err(error) => prop_assert_eq!(error.to_string().lines().count(), 1),
        }
    }
}

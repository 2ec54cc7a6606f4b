//! Taps as files: what is written is read, what is wrong has a place, and nothing that is given makes a reader panic.

#![allow(clippy::unwrap_used, clippy::panic)]

use macropulse_codec::files::{Digest, Error, RecordHeader, RecordReader, RecordWriter};
use macropulse_codec::{Given, Taps};
use proptest::prelude::*;

fn header() -> RecordHeader {
    RecordHeader { digest: Digest::parse(&"7f".repeat(16)), count: Some(2) }
}

fn taps() -> Taps {
    Taps { taps: 3, codes: vec![0, 258, 1, 7, u16::MAX, 9] }
}

fn written(header: &RecordHeader, taps: &Taps, first: u64) -> Vec<u8> {
    let mut bytes = Vec::new();
    RecordWriter::new(&mut bytes, taps, header).unwrap().write(taps, first).unwrap();
    bytes
}

type Read = (RecordHeader, Vec<(u64, Vec<u16>)>);

fn read(bytes: &[u8]) -> Result<Read, Error> {
    let mut reader = RecordReader::new(bytes, &taps())?;
    let mut read = Vec::new();
    while let Some((shot, record)) = reader.next_shot()? {
        let Given::Taps(taps) = record else { panic!("{record:?}") };
        read.push((shot, taps.codes));
    }
    Ok((*reader.header(), read))
}

/// The bytes of the documentation, one by one.
#[test]
fn a_file_has_the_documented_bytes_and_is_read_as_it_was_written() {
    let bytes = written(&header(), &taps(), 300);
    assert_eq!(bytes[..24], *b"MPTAPS\0\0\x01\0\0\0\x80\0\0\0\x02\0\0\0\0\0\0\0");
    assert_eq!((&bytes[24..32], &bytes[32..48]), (&b"\x03\0\0\0\0\0\0\0"[..], &[0x7f; 16][..]));
    assert_eq!(bytes[48..128], [0; 80]);
    assert_eq!(bytes[128..142], *b"\x2c\x01\0\0\0\0\0\0\0\0\x02\x01\x01\0");
    let (is, found) = read(&bytes).unwrap();
    assert_eq!(is, header());
    assert_eq!(found, [(300, vec![0, 258, 1]), (301, vec![7, u16::MAX, 9])]);
}

/// `bytes` with others from place `at` on.
fn with(bytes: &[u8], at: usize, others: &[u8]) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    bytes[at..at + others.len()].copy_from_slice(others);
    bytes
}

#[test]
fn what_is_wrong_is_one_sentence_with_its_place() {
    let good = written(&header(), &taps(), 5);
    let second = 128 + 14;
    for (bytes, words) in [
        (good[..good.len() - 3].to_vec(), &["byte 142", "11 bytes into a record of 14"][..]),
        (good[..second].to_vec(), &["after 1 of 2 shots", "truncated"]),
        (b"# macropulse taps 1".to_vec(), &["is text", "binary form alone"]),
        (b"RIFF".to_vec(), &["this is no file of Macropulse's taps"]),
        (with(&good, 0, b"MPTICKS\0"), &["these are ticks, where the sensor records taps"]),
        (with(&good, 16, &[1]), &["byte 142", "there are 1 shots only"]),
        (with(&good, 24, &[4]), &["4 taps of a shot, where the sensor has 3"]),
        (with(&good, 24, &[0]), &["0 taps of a shot, where it has 1 to 1024"]),
        (with(&good, 24, &[255; 4]), &["4294967295 taps of a shot", "1 to 1024"]),
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

    /// Whatever happens to the bytes: an error of one line, or shots with all their taps.
    #[test]
    fn damaged_files_are_refused_or_read(
        spoils in proptest::collection::vec((0..156_usize, any::<u8>()), 0..6),
        keep in 0..200_usize,
    ) {
        let mut file = written(&header(), &taps(), 1);
        for (at, byte) in spoils {
            file[at] = byte;
        }
        file.truncate(keep);
        match read(&file) {
            Ok((_, found)) => prop_assert!(found.iter().all(|(_, codes)| codes.len() == 3)),
            Err(error) => prop_assert_eq!(error.to_string().lines().count(), 1),
        }
    }
}

//! Histograms as files and as columns: what is written is read, what is wrong has a place, and nothing
//! that is given makes a reader or a receiver panic.

#![allow(clippy::unwrap_used, clippy::panic)]

use macropulse_codec::decode::histogram::{
    HistogramMethod, HistogramReceiver, PileUp, Pulse, decode,
};
use macropulse_codec::files::{Digest, Error, RecordHeader, RecordReader, RecordWriter};
use macropulse_codec::{Given, Histograms, ShotLog};
use proptest::prelude::*;

/// The header of two histograms.
const TWO: RecordHeader = RecordHeader { digest: None, count: Some(2) };

fn histograms() -> Histograms {
    Histograms {
        bin_fs: 95_000,
        offset_fs: -1000,
        bins: 3,
        cycles: vec![4096, 0],
        counts: vec![0, 258, 1, 7, u32::MAX, 9],
    }
}

fn written(header: &RecordHeader, record: &Histograms, first: u64) -> Vec<u8> {
    let mut bytes = Vec::new();
    RecordWriter::new(&mut bytes, record, header).unwrap().write(record, first).unwrap();
    bytes
}

type Read = (RecordHeader, Vec<(u64, Histograms)>);

fn read(bytes: &[u8], wanted: &Histograms) -> Result<Read, Error> {
    let mut reader = RecordReader::new(bytes, wanted)?;
    let mut read = Vec::new();
    while let Some((shot, record)) = reader.next_shot()? {
        let Given::Histograms(histogram) = record else { panic!("{record:?}") };
        read.push((shot, histogram));
    }
    Ok((*reader.header(), read))
}

/// The bytes of the documentation, one by one.
#[test]
fn a_file_is_as_it_is_documented() {
    let header = RecordHeader { digest: Some(Digest([9; 16])), ..TWO };
    let bytes = written(&header, &histograms(), 300);
    assert_eq!(bytes.len(), 128 + 2 * (16 + 12));
    assert_eq!(bytes[..24], *b"MPHISTO\0\x01\0\0\0\x80\0\0\0\x02\0\0\0\0\0\0\0");
    assert_eq!(bytes[24..32], 95_000_i64.to_le_bytes());
    assert_eq!((&bytes[32..48], &bytes[48..56]), (&[9; 16][..], &(-1000_i64).to_le_bytes()[..]));
    assert_eq!((&bytes[56..60], &bytes[60..128]), (&[3, 0, 0, 0][..], &[0; 68][..]));
    assert_eq!(bytes[128..144], *b"\x2c\x01\0\0\0\0\0\0\0\x10\0\0\0\0\0\0");
    assert_eq!(bytes[144..156], *b"\0\0\0\0\x02\x01\0\0\x01\0\0\0");
    assert_eq!(bytes[156..164], 301_u64.to_le_bytes());
}

/// `bytes` with others from place `at` on.
fn with(bytes: &[u8], at: usize, others: &[u8]) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    bytes[at..at + others.len()].copy_from_slice(others);
    bytes
}

#[test]
fn what_is_wrong_is_one_sentence_with_its_place() {
    let good = written(&TWO, &histograms(), 5);
    let second = 128 + 28;
    let refused = |bytes: &[u8]| read(bytes, &histograms()).map_err(|error| error.to_string());
    for (bytes, words) in [
        (
            good[..good.len() - 3].to_vec(),
            &["byte 156", "25 bytes into a record of 28", "truncated"][..],
        ),
        (good[..second].to_vec(), &["after 1 of 2 shots", "truncated"]),
        (good[..second + 16].to_vec(), &["16 bytes into a record of 28", "truncated"]),
        (good[..100].to_vec(), &["100 bytes into a record of 128"]),
        (Vec::new(), &["is empty"]),
        (b"# macropulse histograms 1".to_vec(), &["is text", "binary form alone"]),
        (b"RIFF".to_vec(), &["this is no file of Macropulse's histograms"]),
        (with(&good, 0, b"MPTICKS\0"), &["these are ticks, where the sensor records histograms"]),
        (with(&good, 0, b"MPSHOTS\0"), &["the shot log comes first, then the histograms"]),
        (with(&good, 8, &[2]), &["version `2` of histograms", "reads 1"]),
        (with(&good, 16, &[1]), &["byte 156", "there are 1 shots only"]),
        (with(&good, 24, &0_i64.to_le_bytes()), &["bins of 0 fs", "1 fs to 137 s"]),
        (
            with(&good, 24, &i64::MAX.to_le_bytes()),
            &["bins of 9223372036854775807 fs", "1 fs to 137 s"],
        ),
        (with(&good, 24, &95_001_i64.to_le_bytes()), &["bins of 95001 fs", "of 95000 fs"]),
        (with(&good, 48, &i64::MIN.to_le_bytes()), &["more than 9000 s"]),
        (with(&good, 48, &0_i64.to_le_bytes()), &["begins 0 fs after", "after -1000 fs"]),
        (with(&good, 56, &u32::MAX.to_le_bytes()), &["4294967295 bins", "1 to 65536"]),
        (with(&good, 56, &0_u32.to_le_bytes()), &["0 bins", "1 to 65536"]),
        (with(&good, 56, &2_u32.to_le_bytes()), &["2 bins", "have 3"]),
        (with(&good, 140, &[1]), &["byte 128", "four bytes of 0"]),
        (with(&good, second, &[5]), &["byte 156", "shot 5 comes after that of shot 5"]),
    ] {
        let said = refused(&bytes).unwrap_err();
        assert!(words.iter().all(|word| said.contains(word)), "{said}: not {words:?}");
        assert_eq!(said.lines().count(), 1, "{said}");
    }
    assert!(refused(&good).is_ok() && refused(&with(&good, 16, &[255; 8])).is_ok());
}

prop_compose! {
    fn any_histograms()(
        bins in 1..40_u32,
        shots in 0..6_usize,
        times in (1..1_000_000_i64, -1_000_000..1_000_000_i64),
    )(
        cycles in proptest::collection::vec(any::<u32>(), shots),
        counts in proptest::collection::vec(any::<u32>(), shots * bins as usize),
        bins in Just(bins),
        (bin_fs, offset_fs) in Just(times),
    ) -> Histograms {
        Histograms { bin_fs, offset_fs, bins, cycles, counts }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, ..ProptestConfig::default() })]

    #[test]
    fn histograms_are_read_as_they_were_written(
        histograms in any_histograms(),
        first in 0..u64::from(u32::MAX),
        knows_count in any::<bool>(),
    ) {
        let count = knows_count.then_some(histograms.len() as u64);
        let header = RecordHeader { digest: Digest::parse(&"7f".repeat(16)), count };
        let (is, found) = read(&written(&header, &histograms, first), &histograms).unwrap();
        prop_assert_eq!(is, header);
        prop_assert_eq!(found.len(), histograms.len());
        for (at, (shot, one)) in found.into_iter().enumerate() {
            prop_assert_eq!((shot, one.cycles), (first + at as u64, vec![histograms.cycles[at]]));
            prop_assert_eq!(&one.counts[..], histograms.of(at));
        }
    }

    /// Whatever happens to the bytes: an error of one line, or histograms with all their bins.
    #[test]
    fn damaged_files_are_refused_or_read(
        spoils in proptest::collection::vec((0..184_usize, any::<u8>()), 0..6),
        keep in 0..400_usize,
    ) {
        let mut file = written(&TWO, &histograms(), 1);
        for (at, byte) in spoils {
            file[at] = byte;
        }
        file.truncate(keep);
        match read(&file, &histograms()) {
            Err(error) => prop_assert_eq!(error.to_string().lines().count(), 1),
            Ok((_, read)) => prop_assert!(read.iter().all(|(_, one)| one.counts.len() == 3)),
        }
    }
}

fn any_f64() -> impl Strategy<Value = f64> {
    prop_oneof![Just(0.0), Just(1.0), 0.0..1.0_f64, 0.0..1e7_f64, any::<f64>()]
}

fn any_i64() -> impl Strategy<Value = i64> {
    prop_oneof![-3..3_i64, Just(i64::MIN), Just(i64::MAX), -1_000_000..1_000_000_i64, any::<i64>()]
}

fn any_u32() -> impl Strategy<Value = u32> {
    prop_oneof![0..4_u32, 0..100_u32, Just(u32::MAX), any::<u32>()]
}

prop_compose! {
    fn any_receiver()(
        gate_fs in (any_i64(), any_i64()),
        is_sane in any::<bool>(),
        is_gaussian in any::<bool>(),
        stops in any::<bool>(),
        counts in proptest::collection::vec(any_f64(), 0..9),
        numbers in [any_f64(), any_f64(), any_f64(), any_f64()],
        returns in 0..10_u8,
    ) -> HistogramReceiver {
        let sane = numbers.map(|number| 1e-6 + (number.abs() % 1.0).min(0.9));
        let (gate_fs, numbers, returns) = match is_sane {
            true => ((-100, 9000), [1.0 + 1000.0 * sane[0], sane[1], sane[2], sane[3]], 1 + returns % 8),
            false => (gate_fs, numbers, returns),
        };
        let [of_pulse, false_alarm, shape_error, least_share] = numbers;
        let pulse = match is_gaussian {
            true => Pulse::Gaussian { rms_fs: of_pulse },
            false => Pulse::Measured { counts, origin: of_pulse },
        };
        let pile_up = if stops { PileUp::Coates } else { PileUp::None };
        let base = HistogramReceiver::new(pulse);
        let method =
            HistogramMethod { pile_up, false_alarm, shape_error, least_share, ..base.method };
        HistogramReceiver { gate_fs, returns, pick: base.pick, method }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1500, ..ProptestConfig::default() })]

    /// Whatever is given: an error of one line, or returns in order that are numbers.
    #[test]
    fn anything_is_refused_or_decoded(
        receiver in any_receiver(),
        times in prop_oneof![(1..1000_i64, -500..500_i64), (any_i64(), any_i64())],
        bins in prop_oneof![4 => 1..9_u32, 1 => any_u32()],
        cycles in proptest::collection::vec(any_u32(), 2),
        counts in proptest::collection::vec(any_u32(), 18),
    ) {
        let log = ShotLog::of_one_channel(&[0, 0], &[0, 0]);
        let counts = counts[..(2 * bins as usize).min(18)].to_vec();
        let record = Histograms { bin_fs: times.0, offset_fs: times.1, bins, cycles, counts };
        match decode(&receiver, &log, &record) {
            Err(error) => prop_assert_eq!(error.to_string().lines().count(), 1),
            Ok(returns) => {
                let is_number = |tof: &f64| tof.is_finite();
                prop_assert!(returns.tof.iter().all(is_number));
                prop_assert!(returns.photons.iter().all(|photons| *photons >= 0.0));
                prop_assert!(returns.shot.is_sorted() && returns.len() <= 16);
            }
        }
    }
}

//! Shot logs and ticks as files: what is written is read, what is wrong has a place, and no bytes make
//! a reader panic. And what is explained of a shot is what is decoded of it.

#![allow(clippy::unwrap_used, clippy::panic)]

use macropulse_codec::code::{Codebook, Crc, Family, Keying, Payload};
use macropulse_codec::decode::{
    Bitwise, Correlation, Effort, Method, Opening, Receiver, ReceiverKind,
};
use macropulse_codec::files::{
    Digest, Error, Form, Limits, Place, Shot, ShotHeader, ShotReader, ShotWriter, Stream,
    TickHeader, TickReader, TickWriter, What,
};
use macropulse_codec::{Cut, Given, RecordKind, ShotLog, Tick, Ticks};
use proptest::prelude::*;

const TICK_FS: i64 = 1000;

const FORMS: [Form; 2] = [Form::Binary, Form::Text];

const LIMITS: Limits = Limits { rows: 8, columns: 64, labels: 16, words: 5, channels: 4 };

const CUT: Cut = Cut {
    tick_fs: TICK_FS,
    clock_fs: 10 * TICK_FS,
    jitter_fs: 0,
    listening_fs: 2_200_000,
    lead_fs: 200_000,
    history_fs: 3_600_000,
};

fn shots(count: u16) -> Vec<Shot> {
    let shot = |n: u16| Shot {
        fired_fs: i64::from(n) * 500_000 - 250,
        row: n / 64,
        column: n % 64,
        label: 1 + n % 15,
        word: n % 5,
        channel: 0,
    };
    (0..count).map(shot).collect()
}

fn shot_header() -> ShotHeader {
    ShotHeader {
        first: 128,
        owned: Some(130..170),
        digest: Digest::parse("00112233445566778899aabbccddeeff"),
        position: [0.1, -2.0, 1.0 / 3.0],
        turn: [0.6, 0.0, -0.8, 0.0],
        count: Some(50),
    }
}

fn tick_header(several: bool, measured: bool, count: Option<u64>) -> TickHeader {
    TickHeader { tick_fs: TICK_FS, several, measured, digest: None, count }
}

fn written_shots(form: Form, header: &ShotHeader, shots: &[Shot]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut writer = ShotWriter::new(&mut bytes, form, header).unwrap();
    shots.iter().for_each(|shot| writer.write(shot).unwrap());
    bytes
}

fn written_ticks(form: Form, header: &TickHeader, ticks: &[Tick]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut writer = TickWriter::new(&mut bytes, form, header).unwrap();
    ticks.iter().for_each(|tick| writer.write(tick).unwrap());
    bytes
}

fn read_shots(bytes: &[u8]) -> Result<(ShotHeader, Vec<Shot>), Error> {
    let mut reader = ShotReader::new(bytes, LIMITS)?;
    let mut shots = Vec::new();
    while let Some(shot) = reader.next_shot()? {
        shots.push(shot);
    }
    Ok((reader.header().clone(), shots))
}

fn read_ticks(bytes: &[u8], channels: u32) -> Result<(TickHeader, Vec<Tick>), Error> {
    let mut reader = TickReader::new(bytes, TICK_FS, channels)?;
    let mut ticks = Vec::new();
    while let Some(tick) = reader.next_tick()? {
        ticks.push(tick);
    }
    Ok((*reader.header(), ticks))
}

#[test]
fn shots_are_read_as_they_were_written() {
    for form in FORMS {
        for header in [shot_header(), ShotHeader { count: None, ..ShotHeader::default() }] {
            let bytes = written_shots(form, &header, &shots(50));
            assert_eq!(read_shots(&bytes).unwrap(), (header, shots(50)), "{form:?}");
        }
    }
}

#[test]
fn ticks_are_read_as_they_were_written() {
    for (form, (several, measured)) in FORMS.into_iter().flat_map(|form| {
        [(false, false), (true, false), (false, true), (true, true)].map(|kind| (form, kind))
    }) {
        let ticks: Vec<Tick> = (-5..100)
            .map(|n: i64| Tick {
                tick: n * n * n,
                channel: if several { n.rem_euclid(4) as u16 } else { 0 },
                amplitude: if measured { n as f32 / 3.0 } else { 0.0 },
            })
            .collect();
        for count in [None, Some(105)] {
            let header = tick_header(several, measured, count);
            let bytes = written_ticks(form, &header, &ticks);
            assert_eq!(read_ticks(&bytes, 4).ok(), (several).then_some((header, ticks.clone())));
            assert_eq!(read_ticks(&bytes, 1).is_ok(), !several);
        }
    }
}

/// The bytes of the documentation, one by one.
#[test]
fn a_binary_file_is_as_it_is_documented() {
    let shot = Shot { fired_fs: -2, row: 1, column: 2, label: 3, word: 4, channel: 0x0102 };
    let bytes = written_shots(Form::Binary, &shot_header(), &[shot]);
    assert_eq!(bytes.len(), 128 + 18);
    assert_eq!(bytes[..16], *b"MPSHOTS\0\x01\0\0\0\x80\0\0\0");
    let long = |at: usize| u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap());
    assert_eq!([16, 24, 32, 40, 120].map(long), [50, 128, 130, 170, 0]);
    assert_eq!(bytes[48..51], [0x00, 0x11, 0x22]);
    let real = |at: usize| f64::from_bits(long(at));
    assert_eq!([64, 88, 104].map(real), [0.1, 0.6, -0.8]);
    assert_eq!(long(128) as i64, -2);
    assert_eq!(bytes[136..], [1, 0, 2, 0, 3, 0, 4, 0, 2, 1]);

    let tick = Tick { tick: 258, channel: 7, amplitude: 1.0 };
    let header = TickHeader { digest: Some(Digest([9; 16])), ..tick_header(true, true, None) };
    let bytes = written_ticks(Form::Binary, &header, &[tick]);
    assert_eq!(bytes.len(), 128 + 14);
    assert_eq!(bytes[..24], *b"MPTICKS\0\x01\0\0\0\x80\0\0\0\xff\xff\xff\xff\xff\xff\xff\xff");
    assert_eq!(bytes[24..32], TICK_FS.to_le_bytes());
    assert_eq!(bytes[32..48], [9; 16]);
    assert_eq!(bytes[48..56], [3, 0, 0, 0, 14, 0, 0, 0]);
    assert_eq!(bytes[128..], [2, 1, 0, 0, 0, 0, 0, 0, 7, 0, 0, 0, 0x80, 0x3f]);
}

#[test]
fn text_needs_no_more_than_its_columns_and_takes_them_in_any_order() {
    let text = "# macropulse shots 1\r\ncolumn,row,fired_ps\r\n3,0,-1\r\n\r\n4, 0, 2";
    let (header, shots) = read_shots(text.as_bytes()).unwrap();
    assert_eq!(header, ShotHeader::default());
    assert_eq!(shots[0], Shot { fired_fs: -1000, column: 3, ..Shot::default() });
    assert_eq!(shots[1].fired_fs, 2000);
    let text = "# macropulse ticks 1, tick_fs=1000\nchannel,tick\n2,5\n3,5\n";
    let (_, ticks) = read_ticks(text.as_bytes(), 4).unwrap();
    assert_eq!(ticks[1], Tick { tick: 5, channel: 3, amplitude: 0.0 });
}

fn told(error: &Error) -> (What, Option<Place>, String) {
    match error {
        Error::Content { what, place, .. } => (*what, Some(*place), error.to_string()),
        Error::Read { what, .. } => (*what, None, error.to_string()),
    }
}

#[test]
fn what_is_wrong_in_text_has_its_line() {
    const START: &str = "# macropulse shots 1, first=7\nshot,fired_fs,row,column,label,word\n";
    for (rest, line, words) in [
        ("7,5,0,0,0,0\n8,4,0,1,0,0\n", 4, "shot 8: is fired at 4 fs, before"),
        ("8,5,0,0,0,0\n", 3, "shot 8 stands where shot 7 should"),
        ("7,5,8,0,0,0\n", 3, "row 8 is not among the 8 rows"),
        ("7,5,0,0,16,0\n", 3, "label 16 is not among the 16 labels of the codebook"),
        ("7,5,0,0,0,5\n", 3, "word 5 is not among the 5 words of the codebook"),
        ("7,5.5,0,0,0,0\n", 3, "fired_fs: `5.5` is no whole number"),
        ("7,5,0,0,0\n", 3, "5 values, where the line of names has 6"),
        ("7,9100000000000000000,0,0,0,0\n", 3, "more than 9000 s"),
        ("7,5,0,0,-1,0\n", 3, "label: `-1`"),
    ] {
        let (what, place, sentence) =
            told(&read_shots(format!("{START}{rest}").as_bytes()).unwrap_err());
        assert_eq!((what, place), (What::Shots, Some(Place::Line(line))), "{sentence}");
        assert!(sentence.contains(words), "{sentence}");
    }
    for (text, line, words) in [
        ("# macropulse shots 2\n", 1, "version `2` of shots, of which this program reads 1"),
        ("# macropulse ticks 1\n", 1, "these are ticks, where shots are wanted"),
        ("# macropulse shots 1, frist=3\n", 1, "unknown key `frist`; known are first,"),
        ("# macropulse shots 1, digest=12\n", 1, "not 32 hexadecimal digits"),
        ("# macropulse shots 1\n", 1, "names of columns are missing"),
        ("# macropulse shots 1\nrow,column\n", 2, "`fired_fs`, or else `fired_ps`, is missing"),
        ("# macropulse shots 1\nfired_fs,row\n", 2, "column `column` is missing"),
        ("# macropulse shots 1\nfired_fs,row,colunm\n", 2, "unknown column `colunm`"),
        ("# macropulse shots 1, count=2\nfired_fs,row,column\n0,0,0\n", 3, "after 1 of 2 shots"),
        ("# macropulse shots 1, count=0\nfired_fs,row,column\n0,0,0\n", 3, "0 shots only"),
    ] {
        let (_, place, sentence) = told(&read_shots(text.as_bytes()).unwrap_err());
        assert_eq!(place, Some(Place::Line(line)), "{sentence}");
        assert!(sentence.contains(words), "{sentence}");
    }
    const TICKS: &str = "# macropulse ticks 1, tick_fs=1000\ntick,channel\n";
    for (rest, line, words) in [
        ("5,0\n4,0\n", 4, "tick 4 of channel 0 comes after tick 5 of channel 0: sort them"),
        ("5,1\n5,0\n", 4, "sort them by tick, and those of one tick by channel"),
        ("5,0\n5,0\n", 4, "tick 5 is there twice"),
        ("5,4\n", 3, "channel 4 is not among the 4"),
        ("9000000000000001,0\n", 3, "more than 9000 s"),
    ] {
        let (what, place, sentence) =
            told(&read_ticks(format!("{TICKS}{rest}").as_bytes(), 4).unwrap_err());
        assert_eq!(
            (what, place),
            (What::Record(RecordKind::Ticks), Some(Place::Line(line))),
            "{sentence}"
        );
        assert!(sentence.contains(words), "{sentence}");
    }
    let sentence = |text: &str| told(&read_ticks(text.as_bytes(), 1).unwrap_err()).2;
    assert!(sentence("# macropulse ticks 1\ntick\n").contains("write tick_fs=1000"));
    assert!(sentence("# macropulse ticks 1, tick_fs=10\ntick\n").contains("last 1000 fs"));
    assert!(sentence("PK\x03\x04").contains("neither text"));
}

#[test]
fn a_binary_file_that_is_cut_off_says_where() {
    let header = ShotHeader { count: Some(3), ..ShotHeader::default() };
    let bytes = written_shots(Form::Binary, &header, &shots(3));
    for (length, place, words) in [
        (0, 0, "the file is empty"),
        (100, 0, "100 bytes into a record of 128"),
        (128 + 18, 146, "after 1 of 3 shots"),
        (128 + 20, 146, "2 bytes into a record of 18"),
    ] {
        let (_, found, sentence) = told(&read_shots(&bytes[..length]).unwrap_err());
        assert_eq!(found, Some(Place::Byte(place)), "{sentence}");
        assert!(sentence.contains(words), "{sentence}");
    }
    let mut longer = bytes.clone();
    longer.extend(&bytes[128 + 36..]);
    assert!(read_shots(&longer).unwrap_err().to_string().contains("3 shots only"));
    // The end of a stream is not known.
    let endless = written_shots(Form::Binary, &ShotHeader::default(), &shots(3));
    assert_eq!(read_shots(&endless[..128 + 18]).unwrap().1.len(), 1);
}

fn codebook() -> Codebook {
    let payload = Payload::new(4, Crc::default(), false).unwrap();
    Codebook::new(Family::prime(5).unwrap(), Some(payload), 16, Keying::OnOff).unwrap()
}

fn receiver(method: Method) -> Receiver {
    Receiver { gate_ticks: (0, 2000), method, ..Receiver::matched(TICK_FS) }
}

fn correlation() -> Correlation {
    Correlation { light_ticks: 3000, ..Correlation::default() }
}

fn matched() -> Method {
    Method::Matched(correlation(), Effort::Quick)
}

/// Echoes of `shots` after 700 ticks and a bit more from shot to shot, and some noise.
fn echoes(shots: &[Shot], noise: u32) -> Vec<Tick> {
    let book = codebook();
    let mut ticks: Vec<i64> = (0..i64::from(noise)).map(|n| n * 7919 % 60_000).collect();
    for (at, shot) in shots.iter().enumerate() {
        let begins = shot.fired_fs.div_euclid(TICK_FS) + 700 + at as i64 % 9;
        ticks.extend(book.marks(shot.label, shot.word).iter().map(|m| begins + i64::from(*m)));
    }
    ticks.sort_unstable();
    ticks.dedup();
    ticks.into_iter().map(|tick| Tick { tick, ..Tick::default() }).collect()
}

type Band = (ShotLog, Ticks);

/// The bands of eight shots that a stream is cut into.
fn bands(shots: &[u8], ticks: &[u8]) -> Result<Vec<Band>, Error> {
    let shots = ShotReader::new(shots, LIMITS)?;
    let ticks = TickReader::new(ticks, TICK_FS, LIMITS.channels.min(1))?;
    let mut stream = Stream::new(CUT, shots, ticks, false);
    let mut bands = Vec::new();
    while let Some((log, given)) = stream.next_band(|shot| (shot / 8 + 1) * 8)? {
        let Given::Ticks(ticks) = given else { panic!("samples out of ticks") };
        bands.push((log, ticks));
    }
    Ok(bands)
}

/// Every shot is owned once, with all shots and ticks that the rule of cutting says.
#[test]
fn a_stream_is_cut_into_bands_with_all_that_belongs_to_them() {
    let shots = shots(100);
    let ticks = echoes(&shots, 300);
    let files = |form| {
        let header = ShotHeader { owned: Some(3..97), ..ShotHeader::default() };
        let ticks = written_ticks(form, &tick_header(false, false, None), &ticks);
        (written_shots(form, &header, &shots), ticks)
    };
    let [binary, text] = FORMS.map(files);
    let found = bands(&binary.0, &binary.1).unwrap();
    assert_eq!(found, bands(&text.0, &text.1).unwrap());
    assert_eq!(found.len(), 13);
    let mut next = 3;
    for (log, seen) in &found {
        assert_eq!(log.first + log.owned.start as u64, next);
        next += log.owned.len() as u64;
        let fired = |at: usize| log.fired_at_fs[at];
        let (first, last) = (fired(log.owned.start), fired(log.owned.end - 1));
        // Shots fired before the ticks begin have only part of their light there, and are left out.
        let wanted = CUT.opens(first) * TICK_FS..=*CUT.shots(first, last).end();
        let all = shots.iter().filter(|shot| wanted.contains(&shot.fired_fs)).count();
        assert_eq!(log.len(), all);
        let span = CUT.ticks(first, last);
        let all: Vec<i64> =
            ticks.iter().map(|one| one.tick).filter(|tick| span.contains(tick)).collect();
        let seen: Vec<i64> = seen.tick.iter().map(|t| seen.epoch + i64::from(*t)).collect();
        assert_eq!(seen, all);
    }
    assert_eq!(next, 97);
}

/// Whatever the kind of receiver, the verdict of an explanation is what the band decodes to.
#[test]
fn what_is_explained_is_what_was_decided() {
    let shots = shots(100);
    let book = codebook();
    let (opening, bit_threshold, ticks_per_chip, jitter_ticks) = (Opening::AnyBit, 1, 1, 0.0);
    let blind = Bitwise { opening, bit_threshold, ticks_per_chip, jitter_ticks };
    for (method, noise) in [
        (matched(), 0),
        (matched(), 4000),
        (matched(), 20_000),
        (Method::Balanced(correlation()), 300),
        (Method::Bitwise(blind), 0),
        (Method::Direct, 300),
    ] {
        let kind = method.kind();
        let receiver = receiver(method);
        let header = ShotHeader::default();
        let files = (
            written_shots(Form::Binary, &header, &shots),
            written_ticks(Form::Binary, &tick_header(false, false, None), &echoes(&shots, noise)),
        );
        let (mut accepted, mut refused) = (0, 0);
        for (log, ticks) in bands(&files.0, &files.1).unwrap() {
            let decoded = receiver.decode(&book, &log, &ticks).unwrap();
            for shot in log.owned.clone() {
                let explained = receiver.explain(&book, (&log, &ticks), shot).unwrap();
                let of_shot: Vec<usize> =
                    (0..decoded.len()).filter(|at| decoded.shot[*at] as usize == shot).collect();
                let told = &explained.verdict.returns;
                assert_eq!(told.len(), of_shot.len(), "{kind:?}: shot {shot}");
                for (one, at) in told.iter().zip(of_shot) {
                    assert_eq!((one.tof, one.peak), (decoded.tof[at], decoded.peak[at]));
                    assert_eq!((one.marks, one.margin), (decoded.marks[at], decoded.margin[at]));
                }
                let is_correlated = kind == ReceiverKind::Matched;
                if is_correlated && let Some(one) = told.first() {
                    // Counting mark by mark gives the same number.
                    let lag = (one.tof * 1e15 + log.fired_at_fs[shot] as f64) / TICK_FS as f64;
                    let lag = lag as i64 - explained.fired_tick;
                    let found = explained.found[(lag - explained.gate.start) as usize];
                    assert_eq!(found, one.peak, "shot {shot} at {lag}");
                    assert!(explained.peak.unwrap().1 >= one.peak);
                }
                accepted += usize::from(!told.is_empty());
                refused += usize::from(told.is_empty());
            }
        }
        assert!(accepted > 20 || noise == 20_000, "{kind:?} {noise}: {accepted}");
        assert!(refused > 20 || noise < 20_000, "{kind:?} {noise}: {refused}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, ..ProptestConfig::default() })]

    /// Whatever happens to the bytes of both files: an error or bands that can be decoded, no panic.
    #[test]
    fn damaged_files_are_refused_or_decoded(
        form in 0..2_usize,
        spoils in proptest::collection::vec((any::<bool>(), 0..4000_usize, any::<u8>()), 0..6),
        cuts in (0..8000_usize, 0..8000_usize),
    ) {
        let shots = shots(60);
        let header = ShotHeader { count: Some(60), ..ShotHeader::default() };
        let mut files = [
            written_shots(FORMS[form], &header, &shots),
            written_ticks(FORMS[form], &tick_header(false, false, None), &echoes(&shots, 50)),
        ];
        for (which, at, byte) in spoils {
            let file = &mut files[usize::from(which)];
            let at = at % file.len();
            file[at] = byte;
        }
        files[0].truncate(cuts.0);
        files[1].truncate(cuts.1);
        if let Ok(bands) = bands(&files[0], &files[1]) {
            for (log, ticks) in bands {
                let _ = receiver(matched()).decode(&codebook(), &log, &ticks);
            }
        }
    }

    #[test]
    fn any_bytes_are_refused_or_read(bytes in proptest::collection::vec(any::<u8>(), 0..300)) {
        for magic in [&b""[..], b"MPSHOTS\0\x01\0\0\0\x80\0\0\0", b"MPTICKS\0\x01\0\0\0\x80\0\0\0", b"# macropulse shots 1"] {
            let file = [magic, &bytes].concat();
            let _ = (read_shots(&file), read_ticks(&file, 1));
        }
    }
}

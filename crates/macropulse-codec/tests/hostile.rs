//! Public structs filled with anything, as a program may hand them over by mistake. They are refused or put
//! up with, without a panic and without much memory.

#![allow(clippy::unwrap_used)]

use macropulse_codec::code::correlation::{
    CrossCorrelation, aperiodic, balanced, bipolar, periodic,
};
use macropulse_codec::code::{CodeWord, Codebook, Crc, Family, Keying, Payload, Sparse};
use macropulse_codec::decode::{
    Bitwise, Correlation, Coupling, Effort, Method, Opening, Receiver, ReceiverKind, Sampled,
    Sampling,
};
use macropulse_codec::files::{
    Form, Limits, ShotHeader, ShotReader, ShotWriter, Stream, TickHeader, TickReader, TickWriter,
};
use macropulse_codec::{Cut, Samples, ShotLog, Tick, Ticks};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use std::sync::atomic::{AtomicUsize, Ordering};

const KINDS: [ReceiverKind; 5] = [
    ReceiverKind::Literal,
    ReceiverKind::Blind,
    ReceiverKind::Matched,
    ReceiverKind::Balanced,
    ReceiverKind::Direct,
];

/// The method of a receiver of ticks of this kind.
fn method(kind: ReceiverKind, bit_threshold: u16, correlation: Correlation) -> Method {
    let Correlation { ticks_per_chip, jitter_ticks, .. } = correlation;
    let bitwise =
        |opening| Method::Bitwise(Bitwise { opening, bit_threshold, ticks_per_chip, jitter_ticks });
    match kind {
        ReceiverKind::Literal => bitwise(Opening::FirstBit),
        ReceiverKind::Blind => bitwise(Opening::AnyBit),
        ReceiverKind::Balanced => Method::Balanced(correlation),
        ReceiverKind::Direct => Method::Direct,
        _ => Method::Matched(correlation, Effort::Quick),
    }
}

/// Address space that this program may have, bytes: what asks for more ends it.
#[cfg(target_os = "linux")]
fn in_little_memory() {
    use rustix::process::{Resource, Rlimit, setrlimit};
    let most = Some(3 << 30);
    setrlimit(Resource::As, Rlimit { current: most, maximum: most }).unwrap();
}

#[cfg(not(target_os = "linux"))]
fn in_little_memory() {}

fn config(cases: u32) -> ProptestConfig {
    in_little_memory();
    ProptestConfig { rng_seed: RngSeed::Fixed(15), ..ProptestConfig::with_cases(cases) }
}

fn any_i64() -> impl Strategy<Value = i64> {
    let ends = prop_oneof![Just(i64::MIN), Just(i64::MAX), Just(1_000_000_000_000_000_000)];
    prop_oneof![-3..3_i64, -100_000..100_000_i64, ends, any::<i64>()]
}

fn any_u32() -> impl Strategy<Value = u32> {
    prop_oneof![0..20_u32, 0..70_000_u32, Just(u32::MAX), any::<u32>()]
}

fn any_u64() -> impl Strategy<Value = u64> {
    prop_oneof![0..20_u64, Just(u64::MAX), any::<u64>()]
}

fn column() -> impl Strategy<Value = Vec<u16>> {
    proptest::collection::vec(any::<u16>(), 0..6)
}

prop_compose! {
    /// A log of columns that know nothing of each other.
    fn any_log()(
        first in any_u64(),
        fired_at_fs in proptest::collection::vec(any_i64(), 0..6),
        columns in [column(), column(), column(), column(), column()],
        owned in (any_u64(), any_u64()),
    ) -> ShotLog {
        let [row, column, label, word, channel] = columns;
        let owned = owned.0 as usize..owned.1 as usize;
        ShotLog { first, fired_at_fs, row, column, label, word, channel, owned }
    }
}

prop_compose! {
    fn any_ticks()(
        epoch in any_i64(),
        tick in proptest::collection::vec(any_u32(), 0..9),
        channel in column(),
        amplitude in proptest::collection::vec(any::<f32>(), 0..9),
    ) -> Ticks {
        Ticks { epoch, tick, channel, amplitude }
    }
}

fn any_f32() -> impl Strategy<Value = f32> {
    prop_oneof![Just(0.0), Just(1.0), -3.0..3.0_f32, Just(f32::INFINITY), any::<f32>()]
}

prop_compose! {
    fn any_sampling()(
        pulse in proptest::collection::vec(any_f32(), 0..40),
        sane in proptest::collection::vec(0.5..3.0_f32, 1..40),
        is_sane in 0..4_u8,
        excess in prop_oneof![Just(1.0), 0.0..9.0_f64, any::<f64>()],
        full_scale in any::<i16>(),
        numbers in [any_u32(), any_u32()],
        least_marks in any::<u16>(),
        coupling in proptest::option::of((any::<f64>(), any::<f64>())),
    ) -> Sampling {
        let pulse = if is_sane > 0 { sane } else { pulse };
        let [blank_ticks, recovery_ticks] = numbers;
        let coupling = coupling.map(|(low_cutoff, limit)| Coupling { low_cutoff, limit });
        Sampling { pulse, excess, full_scale, blank_ticks, held_ticks: 0, recovery_ticks, least_marks, coupling }
    }
}

prop_compose! {
    fn any_samples()(
        epoch in any_i64(),
        channel in proptest::collection::vec(any::<u16>(), 0..3),
        code in proptest::collection::vec(any::<i16>(), 0..90),
        care in 0..4_u8,
    ) -> Samples {
        let channel = if care > 0 { vec![channel.first().copied().unwrap_or(0)] } else { channel };
        Samples { epoch, channel, code }
    }
}

prop_compose! {
    fn any_cut()(numbers in [any_i64(), any_i64(), any_i64(), any_i64(), any_i64(), any_i64()]) -> Cut {
        let [tick_fs, clock_fs, jitter_fs, listening_fs, lead_fs, history_fs] = numbers;
        Cut { tick_fs, clock_fs, jitter_fs, listening_fs, lead_fs, history_fs }
    }
}

fn codebook() -> Codebook {
    let payload = Payload::new(4, Crc::default(), false).unwrap();
    Codebook::new(Family::prime(5).unwrap(), Some(payload), 16, Keying::OnOff).unwrap()
}

fn receiver(kind: ReceiverKind) -> Receiver {
    let correlation = Correlation { light_ticks: 3000, ..Correlation::default() };
    let method = method(kind, 1, correlation);
    Receiver { gate_ticks: (0, 2000), method, ..Receiver::matched(1000) }
}

/// Three shots with light, and a receiver that finds them.
fn sound() -> (Receiver, ShotLog, Ticks) {
    let receiver = receiver(ReceiverKind::Matched);
    let mut log = ShotLog::of_one_channel(&[0, 500_000, 1_000_000], &[0, 1, 2]);
    log.label = vec![5, 9, 12];
    let book = codebook();
    let of_shot = |shot: usize| {
        let marks = book.marks(log.label[shot], log.word[shot]).to_vec();
        marks.into_iter().map(move |mark| 500 * shot as u32 + 700 + u32::from(mark))
    };
    let mut tick: Vec<u32> = (0..3).flat_map(of_shot).collect();
    tick.sort_unstable();
    tick.dedup();
    (receiver, log, Ticks { tick, ..Ticks::default() })
}

proptest! {
    #![proptest_config(config(2000))]

    #[test]
    fn columns_that_know_nothing_of_each_other(
        log in any_log(),
        ticks in any_ticks(),
        span in (any_i64(), any_i64()),
        places in (any_u64(), any_u64()),
        cut in any_cut(),
    ) {
        prop_assert!(log.part(places.0 as usize..places.1 as usize).len() <= log.len());
        prop_assert!(log.each_channel().iter().all(|(shots, _)| shots.len() <= log.len()));
        let stream = ticks.stream();
        prop_assert_eq!(stream.len(), ticks.len());
        for kind in [(false, false), (true, true)] {
            prop_assert!(Ticks::of(&stream, span.0, kind).len() <= stream.len());
        }
        let mut kept = ticks.clone();
        kept.keep(&(span.0..span.1));
        prop_assert!(kept.len() <= ticks.len());
        prop_assert!(cut.known(&log).len() <= log.len());
        let (opens, closes) = (cut.opens(span.0), cut.ticks(span.0, span.1));
        prop_assert_eq!(opens, closes.start);
        let _ = (cut.epoch(span.0), cut.shots(span.0, span.1));
        for kind in KINDS {
            let decoded = receiver(kind).decode(&codebook(), &log, &ticks);
            let even = [&log.row, &log.column, &log.label, &log.word, &log.channel]
                .iter()
                .all(|column| column.len() == log.len());
            prop_assert!(even || decoded.is_err());
        }
    }

    #[test]
    fn a_shot_is_explained_or_refused(
        shot in any_u64(),
        kind in 0..KINDS.len(),
        gate in (any_u32(), any_u32()),
        spoilt in 0..4_u8,
        numbers in (any_u32(), any_i64(), any::<f64>(), any::<f64>()),
    ) {
        let (mut receiver, log, ticks) = sound();
        let mut set_to = Correlation { light_ticks: 3000, ..Correlation::default() };
        match spoilt {
            0 => receiver.gate_ticks = gate,
            1 => (set_to.light_ticks, receiver.tick_fs) = (numbers.0, numbers.1),
            2 => (set_to.jitter_ticks, set_to.false_alarm) = (numbers.2, numbers.3),
            _ => set_to.ticks_per_chip = numbers.0,
        }
        receiver.method = method(KINDS[kind], 1, set_to);
        let explained = receiver.explain(&codebook(), (&log, &ticks), shot as usize);
        prop_assert!(shot < 3 || explained.is_err());
    }

    #[test]
    fn a_stream_that_is_cut_anyhow_ends(
        cut in any_cut(),
        owned in proptest::option::of((any_u64(), any_u64())),
        first in any_u64(),
        times in proptest::collection::vec((any_i64(), any_i64()), 0..6),
        until in any_u64(),
        tick_fs in any_i64(),
    ) {
        let mut shots = Vec::new();
        let owned = owned.map(|(from, until)| from..until);
        let header = ShotHeader { first, owned, ..ShotHeader::default() };
        let mut writer = ShotWriter::new(&mut shots, Form::Text, &header).unwrap();
        for (fired_fs, _) in &times {
            let shot = macropulse_codec::files::Shot { fired_fs: *fired_fs, ..Default::default() };
            writer.write(&shot).unwrap();
        }
        let mut ticks = Vec::new();
        let header =
            TickHeader { tick_fs, several: false, measured: false, digest: None, count: None };
        let mut writer = TickWriter::new(&mut ticks, Form::Text, &header).unwrap();
        for (_, tick) in &times {
            writer.write(&Tick { tick: *tick, ..Tick::default() }).unwrap();
        }
        let limits = Limits { rows: 1, columns: 1, labels: 1, words: 1, channels: 1 };
        let shots = ShotReader::new(&shots[..], limits);
        let ticks = TickReader::new(&ticks[..], tick_fs, 1);
        if let (Ok(shots), Ok(ticks)) = (shots, ticks) {
            let mut stream = Stream::new(cut, shots, ticks, false);
            for _ in 0..10 {
                match stream.next_band(|first| first.saturating_add(until)) {
                    Ok(Some((log, given))) => prop_assert!(log.len() + given.len() <= 12),
                    Ok(None) | Err(_) => break,
                }
            }
        }
    }
}

/// Samples of dim noise with stretches of any code, and of channel 0.
fn lit_samples() -> impl Strategy<Value = Samples> {
    let stretch = (0..2600_usize, 1..40_usize, prop_oneof![-300..3000_i16, any::<i16>()]);
    (proptest::collection::vec(stretch, 0..20), -300..100_i64).prop_map(|(stretches, epoch)| {
        let mut code: Vec<i16> = (0..2600).map(|at| at * 3 % 5 - 2).collect();
        for (first, length, value) in stretches {
            let end = (first + length).min(code.len());
            code[first..end].fill(value);
        }
        Samples { epoch, channel: vec![0], code }
    })
}

/// A signal that may be.
fn sane_sampling() -> impl Strategy<Value = Sampling> {
    let pulse = proptest::collection::vec(0.1..3.0_f32, 1..40);
    let numbers = (0..40_u32, 0..60_u32, 1..4_u16);
    let coupling = proptest::option::of((0.0..0.1_f64, 1.0..1.3_f64));
    let all = (pulse, 1.0..9.0_f64, 1..i16::MAX, numbers, coupling);
    all.prop_map(|(half, excess, full_scale, numbers, coupling)| {
        let mirrored = half.iter().rev().chain(&half[1..]).copied();
        let (blank_ticks, recovery_ticks, least_marks) = numbers;
        let pulse = mirrored.collect();
        Sampling {
            pulse,
            excess,
            full_scale,
            blank_ticks,
            held_ticks: 0,
            recovery_ticks,
            least_marks,
            coupling: coupling.map(|(low_cutoff, limit)| Coupling {
                low_cutoff,
                limit: limit * f64::from(full_scale),
            }),
        }
    })
}

static FOUND: AtomicUsize = AtomicUsize::new(0);

proptest! {
    #![proptest_config(config(2000))]

    fn samples_are_decoded_or_refused(
        (sane, lit) in (sane_sampling(), lit_samples()),
        (log, samples, sampling) in (any_log(), any_samples(), any_sampling()),
        wrong in 0..10_u8,
        (gate, light, alarm) in ((any_u32(), any_u32()), any_u32(), any::<f64>()),
        (returns, chip) in (0..10_u8, any_u32()),
    ) {
        let (sound_receiver, sound, ticks) = sound();
        let mut receiver = Receiver { returns: 2, ..sound_receiver.clone() };
        let (ticks_per_chip, light_ticks, false_alarm) = (1, 3000, 1e-6);
        let mut set_to = Sampled { ticks_per_chip, light_ticks, false_alarm, sampling: sane };
        let (mut log_here, mut record) = (sound, lit);
        match wrong {
            0 => log_here = log,
            1 => record = samples,
            2 => set_to.sampling = sampling,
            3 => receiver.gate_ticks = gate,
            4 => set_to.light_ticks = light,
            5 => set_to.false_alarm = alarm,
            6 => record.epoch = samples.epoch,
            7 => (receiver.returns, set_to.ticks_per_chip) = (returns, chip),
            _ => {}
        }
        receiver.method = Method::Sampled(set_to);
        if let Ok(returns) = receiver.decode(&codebook(), &log_here, &record) {
            FOUND.fetch_add(returns.len().min(1), Ordering::Relaxed);
            prop_assert!(returns.tof.iter().all(|tof| tof.is_finite()));
            prop_assert!(returns.photons.iter().all(|photons| photons.is_finite()));
            let is_owned = |shot: &u32| log_here.owned.contains(&(*shot as usize));
            prop_assert!(returns.shot.is_sorted() && returns.shot.iter().all(is_owned));
            prop_assert!(returns.peak.iter().zip(&returns.marks).all(|(peak, marks)| peak <= marks));
        }
        let shot = usize::from(wrong) % 5;
        if let Ok(told) = receiver.explain_samples(&codebook(), (&log_here, &record), shot) {
            prop_assert!(told.shot == shot && told.score.len() >= told.left.len());
            prop_assert!(told.verdict.returns.len() <= usize::from(receiver.returns));
            prop_assert!(told.verdict.returns.is_empty() != told.verdict.rejects.is_empty());
        }
        prop_assert!(receiver.decode(&codebook(), &log_here, &ticks).is_err());
        prop_assert!(receiver.explain(&codebook(), (&log_here, &ticks), 0).is_err());
        receiver.method = sound_receiver.method;
        prop_assert!(receiver.decode(&codebook(), &log_here, &record).is_err());
    }
}

#[test]
fn no_samples_make_a_receiver_panic() {
    samples_are_decoded_or_refused();
    let found = FOUND.load(Ordering::Relaxed);
    assert!((200..2000).contains(&found), "in {found} of 2000 something was found: a blind test");
}

proptest! {
    #![proptest_config(config(300))]

    #[test]
    fn a_code_is_made_or_refused(
        numbers in [any_u32(), any_u32(), any_u32(), any_u32()],
        payload in (any_u32(), any::<u8>(), any::<u8>(), any::<u8>(), any::<bool>()),
        labels in any_u32(),
        kind in 0..7_u8,
    ) {
        let [length, weight, words, gap] = numbers;
        let family = match kind {
            0 => Family::prime(length),
            1 => Family::extended_prime(length),
            2 => Family::quadratic_congruence(length),
            3 => Family::sparse(Sparse { length, weight, words, gap, seed: 1 }),
            4 => Family::m_sequence(length),
            5 => Family::gold(length),
            // The search of long orthogonal codes takes its time.
            _ => Family::orthogonal(length % 500, weight, Some(words)),
        };
        let (bits, width, polynomial, init, sync) = payload;
        let payload = Payload::new(bits, Crc { width, polynomial, init }, sync);
        if let Ok(family) = family {
            let made = Codebook::new(family, payload.ok(), labels % 70, Keying::OnOff);
            prop_assert!(made.is_err() || made.unwrap().chips() <= 65_535);
        }
    }

    #[test]
    fn words_with_marks_beyond_their_end(
        lengths in (0..40_u32, any_u32()),
        marks in (column(), column()),
    ) {
        let word = |length: u32, marks: Vec<u16>| {
            let mut word: CodeWord = Family::prime(3).unwrap().words().remove(1);
            (word.length, word.marks) = (length % 100_000, marks);
            word
        };
        let (a, b) = (word(lengths.0, marks.0), word(lengths.1, marks.1));
        let length = a.length.max(b.length) as usize;
        for found in [balanced(&a, &b).len(), bipolar(&a, &b).len(), periodic(&a, &b).len()] {
            prop_assert_eq!(found, length);
        }
        prop_assert!(aperiodic(&a, &b).max() <= 36);
        prop_assert!(a.complement().marks.len() <= a.length as usize);
        prop_assert!(a.period() <= a.length.max(1));
        let _ = CrossCorrelation::of(&[a, b]);
    }
}

/// The heaviest words there are, each found whole, and what is counted of it as it is.
#[test]
fn counts_are_wide_enough_for_the_heaviest_code() {
    in_little_memory();
    for weight in [8192, 33_000, 60_000] {
        let sparse = Sparse { length: 65_535, weight, words: 2, gap: 1, seed: 7 };
        let book = Codebook::new(Family::sparse(sparse).unwrap(), None, 1, Keying::OnOff).unwrap();
        let log = ShotLog::of_one_channel(&[0, 200_000_000], &[0, 1]);
        for kind in [ReceiverKind::Literal, ReceiverKind::Matched, ReceiverKind::Balanced] {
            for jitter_ticks in [0.0, 2.0] {
                let light_ticks = 4000;
                let correlation =
                    Correlation { light_ticks, jitter_ticks, ..Correlation::default() };
                let method = method(kind, (weight / 2) as u16, correlation);
                let receiver =
                    Receiver { gate_ticks: (0, 2000), method, ..Receiver::matched(1000) };
                let of_shot = |shot: usize| {
                    let marks = book.marks(0, shot as u16).iter();
                    marks.map(move |mark| 200_000 * shot as u32 + 700 + u32::from(*mark))
                };
                let tick: Vec<u32> = (0..2).flat_map(of_shot).collect();
                let ticks = Ticks { tick, ..Ticks::default() };
                let returns = receiver.decode(&book, &log, &ticks).unwrap();
                let what = format!("{kind:?} of {weight} marks, jitter {jitter_ticks}");
                if kind == ReceiverKind::Balanced && jitter_ticks > 0.0 {
                    // Ticks that may be early or late light the dark chips of so dense a word, too.
                    continue;
                }
                // So may another place of it look like its beginning, to who knows no shots.
                if kind == ReceiverKind::Matched || jitter_ticks == 0.0 {
                    assert_eq!(returns.shot, [0, 1], "{what}");
                }
                for at in 0..returns.len() {
                    assert_eq!(u32::from(returns.marks[at]), weight, "{what}");
                    assert!(
                        u32::from(returns.peak[at]) * 10 >= 9 * weight,
                        "{what}: {}",
                        returns.peak[at]
                    );
                }
            }
        }
    }
}

#[test]
fn a_family_of_more_marks_than_are_kept_is_refused_before_they_are_drawn() {
    in_little_memory();
    let sparse = Sparse { length: 65_535, weight: 60_000, words: 65_535, gap: 1, seed: 7 };
    let told = Family::sparse(sparse).unwrap_err().to_string();
    assert!(told.contains("65535 words is not possible; use 1 to 4473"), "{told}");
}

//! Receivers refuse wrong input, and no input makes them panic.

#![allow(clippy::unwrap_used)]

use macropulse_codec::code::{Codebook, Crc, Family, Keying, Payload};
use macropulse_codec::decode::{
    Bitwise, Correlation, Effort, Error, Method, Opening, Pick, Receiver, ReceiverKind, Reject,
    Sampled, Sampling,
};
use macropulse_codec::{Samples, ShotLog, Ticks};
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

fn codebook() -> Codebook {
    let payload = Payload::new(4, Crc::default(), false).unwrap();
    Codebook::new(Family::prime(5).unwrap(), Some(payload), 16, Keying::OnOff).unwrap()
}

fn correlation() -> Correlation {
    Correlation { light_ticks: 3000, ..Correlation::default() }
}

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

fn receiver_of(kind: ReceiverKind) -> Receiver {
    let method = method(kind, 3, correlation());
    Receiver { gate_ticks: (0, 2000), method, ..Receiver::matched(1000) }
}

fn receiver() -> Receiver {
    receiver_of(ReceiverKind::Matched)
}

/// Three shots, 500 ticks apart.
fn log() -> ShotLog {
    let mut log = ShotLog::of_one_channel(&[0, 500_000, 1_000_000], &[0, 1, 2]);
    log.label = vec![5, 9, 12];
    log
}

/// Light of all of them after 700 ticks.
fn ticks() -> Ticks {
    let (book, log) = (codebook(), log());
    let of_shot = |shot: usize| {
        let marks = book.marks(log.label[shot], log.word[shot]).to_vec();
        marks.into_iter().map(move |mark| 500 * shot as u32 + 700 + u32::from(mark))
    };
    let mut tick: Vec<u32> = (0..3).flat_map(of_shot).collect();
    tick.sort_unstable();
    tick.dedup();
    Ticks { tick, ..Ticks::default() }
}

/// Returns the error of the receiver after `spoil` made one thing wrong. Without it, three shots are found.
fn refused(spoil: impl Fn(&mut Receiver, &mut ShotLog, &mut Ticks)) -> Error {
    let (mut receiver, mut log, mut ticks) = (receiver(), log(), ticks());
    assert_eq!(receiver.decode(&codebook(), &log, &ticks).unwrap().len(), 3);
    spoil(&mut receiver, &mut log, &mut ticks);
    receiver.decode(&codebook(), &log, &ticks).unwrap_err()
}

/// One readable sentence that says what to do.
fn assert_says(error: &Error, parts: &[&str]) {
    let sentence = error.to_string();
    for part in parts {
        assert!(sentence.contains(part), "no {part:?} in: {sentence}");
    }
    assert!(!sentence.ends_with('.') && !sentence.contains('\n') && sentence.len() < 200);
}

#[test]
fn ticks_out_of_order_are_refused() {
    let error = refused(|_, _, ticks| ticks.tick.swap(3, 4));
    assert!(matches!(error, Error::TicksDoNotAscend { place: 4, .. }), "{error:?}");
    assert_says(&error, &["tick number 4", "sort"]);
    // A slot of the converters' time is lit or not, never twice.
    let error = refused(|_, _, ticks| ticks.tick[8] = ticks.tick[7]);
    assert!(matches!(error, Error::TicksDoNotAscend { place: 8, .. }), "{error:?}");
    let error = refused(|_, _, ticks| {
        ticks.channel = vec![1; ticks.tick.len()];
        ticks.channel[0] = 2;
    });
    assert_eq!(error, Error::ChannelsDoNotAscend { place: 1, channel: 1, before: 2 });
    assert_says(&error, &["tick number 1", "sort ticks by channel"]);
}

#[test]
fn ticks_begin_again_with_each_channel() {
    let (mut log, mut ticks) = (log(), ticks());
    let whole = receiver().decode(&codebook(), &log, &ticks).unwrap();
    log.channel = vec![0, 1, 1];
    ticks.channel = vec![0; ticks.tick.len()];
    ticks.channel.extend(vec![1; ticks.tick.len()]);
    ticks.tick.extend(ticks.tick.clone());
    assert_eq!(receiver().decode(&codebook(), &log, &ticks).unwrap().shot, whole.shot);
}

#[test]
fn columns_of_unequal_length_are_refused() {
    type Spoil = fn(&mut ShotLog, &mut Ticks);
    let spoils: [(&str, Spoil); 7] = [
        ("row", |log, _| log.row.truncate(2)),
        ("column", |log, _| log.column.push(0)),
        ("label", |log, _| log.label.clear()),
        ("word", |log, _| log.word.truncate(2)),
        ("channel", |log, _| log.channel.truncate(2)),
        ("channel", |_, ticks| ticks.channel = vec![0]),
        ("amplitude", |_, ticks| ticks.amplitude = vec![1.0; 2]),
    ];
    for (name, spoil) in spoils {
        let error = refused(|_, log, ticks| spoil(log, ticks));
        assert!(matches!(error, Error::Column { column, .. } if column == name), "{error:?}");
        assert_says(&error, &[name, "give one for each"]);
    }
}

#[test]
fn what_was_not_sent_is_refused() {
    let error = refused(|_, log, _| log.label[1] = 16);
    assert_eq!(error, Error::NotInCodebook { shot: 1, what: "label", number: 16, last: 15 });
    assert_says(&error, &["shot 1 has the label 16", "ends with 15"]);
    let error = refused(|_, log, _| log.word[2] = 5);
    assert_eq!(error, Error::NotInCodebook { shot: 2, what: "word", number: 5, last: 4 });
    let error = refused(|_, log, _| log.owned = 1..4);
    assert_eq!(error, Error::Owned { start: 1, end: 4, shots: 3 });
    assert_says(&error, &["`owned`"]);
    #[allow(clippy::reversed_empty_ranges)]
    let error = refused(|_, log, _| log.owned = 2..1);
    assert_eq!(error, Error::Owned { start: 2, end: 1, shots: 3 });
    let error = refused(|_, log, _| log.fired_at_fs.swap(0, 1));
    assert_eq!(error, Error::ShotsDoNotAscend { shot: 1 });
    assert_says(&error, &["shot 1", "sort the log"]);
}

#[test]
fn shots_at_the_same_time_are_fired_in_order() {
    let mut log = log();
    log.fired_at_fs = vec![0; 3];
    assert!(receiver().decode(&codebook(), &log, &ticks()).is_ok());
}

#[test]
fn times_that_are_not_counted_are_refused() {
    let error = refused(|_, log, _| log.fired_at_fs[2] = i64::MAX - 1_000_000);
    assert!(matches!(error, Error::Time { shot: 2, .. }), "{error:?}");
    assert_says(&error, &["shot 2", "count time from a later moment"]);
    let error = refused(|_, log, _| log.fired_at_fs[0] = i64::MIN);
    assert!(matches!(error, Error::Time { shot: 0, .. }), "{error:?}");
    // A quarter of an hour apart, in ticks of a picosecond.
    let error = refused(|_, log, _| log.fired_at_fs[2] = 1_000_000_000_000_000_000);
    assert_eq!(error, Error::FarFromTicks { shot: 2, ticks: 1_000_000_000_000_000 });
    assert_says(&error, &["shot 2", "one stretch of time after another"]);
    let error = refused(|_, _, ticks| ticks.epoch = i64::MIN);
    assert!(matches!(error, Error::FarFromTicks { shot: 0, .. }), "{error:?}");
    // At the limit it is decoded, in no more memory than elsewhere.
    for kind in KINDS.into_iter().filter(|kind| *kind != ReceiverKind::Direct) {
        let (mut log, mut ticks) = (log(), ticks());
        let receiver = receiver_of(kind);
        let near = receiver.decode(&codebook(), &log, &ticks).unwrap();
        let last = u32::MAX - 1000;
        log.fired_at_fs[2] = i64::from(last) * 1000;
        ticks.tick.retain(|tick| *tick < 1700);
        let marks = codebook();
        let marks = marks.marks(log.label[2], log.word[2]).iter();
        ticks.tick.extend(marks.map(|mark| last + 700 + u32::from(*mark)));
        let far = receiver.decode(&codebook(), &log, &ticks).unwrap();
        assert_eq!(far.shot, near.shot, "{kind:?}");
        assert_eq!(far.tof, near.tof, "{kind:?}");
    }
}

#[test]
fn settings_outside_their_limits_are_refused() {
    let error = refused(|receiver, _, _| receiver.gate_ticks = (20, 19));
    assert_eq!(error, Error::Gate { nearest: 20, farthest: 19 });
    assert_says(&error, &["swap", "`gate_ticks`"]);
    type Spoil = fn(&mut Receiver);
    fn of(receiver: &mut Receiver) -> &mut Correlation {
        match &mut receiver.method {
            Method::Matched(correlation, _) => correlation,
            other => panic!("{other:?}"),
        }
    }
    let spoils: [(&str, Spoil); 8] = [
        ("tick_fs", |receiver| receiver.tick_fs = 0),
        ("tick_fs", |receiver| receiver.tick_fs = -2500),
        ("ticks_per_chip", |receiver| of(receiver).ticks_per_chip = 0),
        ("jitter_ticks", |receiver| of(receiver).jitter_ticks = -0.1),
        ("jitter_ticks", |receiver| of(receiver).jitter_ticks = f64::NAN),
        ("false_alarm", |receiver| of(receiver).false_alarm = 0.0),
        ("false_alarm", |receiver| of(receiver).false_alarm = f64::INFINITY),
        ("returns", |receiver| receiver.returns = 9),
    ];
    for (name, spoil) in spoils {
        let error = refused(|receiver, _, _| spoil(receiver));
        assert!(matches!(error, Error::Setting { setting, .. } if setting == name), "{error:?}");
        assert_says(&error, &[name, "use "]);
    }
    for spoil in [
        (|receiver: &mut Receiver| of(receiver).light_ticks = u32::MAX) as Spoil,
        |receiver| receiver.gate_ticks.1 = u32::MAX,
        |receiver| of(receiver).ticks_per_chip = u32::MAX,
    ] {
        let error = refused(|receiver, _, _| spoil(receiver));
        assert!(matches!(error, Error::TooLong { .. }), "{error:?}");
        assert_says(&error, &["use longer ticks"]);
    }
}

/// A receiver of samples, and samples of the three shots: a mark is one tick of 100 codes.
fn sampled() -> (Receiver, Samples) {
    let sampling = Sampling {
        pulse: vec![10.0; 17],
        excess: 1.0,
        full_scale: 2000,
        blank_ticks: 0,
        held_ticks: 0,
        recovery_ticks: 0,
        least_marks: 2,
        coupling: None,
    };
    let mut code: Vec<i16> = (0..5000).map(|at| at * 3 % 5 - 2).collect();
    ticks().tick.iter().for_each(|tick| code[*tick as usize] += 100);
    let samples = Samples { epoch: 0, channel: vec![0], code };
    let (ticks_per_chip, light_ticks, false_alarm) = (1, 3000, 1e-6);
    let method = Method::Sampled(Sampled { ticks_per_chip, light_ticks, false_alarm, sampling });
    (Receiver { method, ..receiver() }, samples)
}

/// Returns the error of the receiver of samples after `spoil` made one thing wrong.
fn refused_sampled(spoil: impl Fn(&mut Receiver, &mut ShotLog, &mut Samples)) -> Error {
    let ((mut receiver, mut samples), mut log) = (sampled(), log());
    assert_eq!(receiver.decode(&codebook(), &log, &samples).unwrap().shot, [0, 1, 2]);
    spoil(&mut receiver, &mut log, &mut samples);
    receiver.decode(&codebook(), &log, &samples).unwrap_err()
}

#[test]
fn a_record_of_another_kind_is_refused() {
    let error = refused_sampled(|given, _, _| given.method = receiver().method);
    assert_eq!(error, Error::Record { wants: "ticks", given: "samples" });
    assert_says(&error, &["decodes ticks", "use a receiver of samples"]);
    let receiver = sampled().0;
    let error = receiver.decode(&codebook(), &log(), &ticks()).unwrap_err();
    assert_eq!(error, Error::Record { wants: "samples", given: "ticks" });
    let error = receiver.explain(&codebook(), (&log(), &ticks()), 0).unwrap_err();
    assert_says(&error, &["decodes samples", "use a receiver of ticks"]);
}

#[test]
fn samples_that_fit_no_channel_are_refused() {
    let error = refused_sampled(|_, _, samples| samples.channel = vec![0, 1, 2]);
    assert_eq!(error, Error::UnevenSamples { codes: 5000, channels: 3 });
    assert_says(&error, &["5000 samples", "3 channels"]);
    let error = refused_sampled(|_, _, samples| samples.channel.clear());
    assert_eq!(error, Error::UnevenSamples { codes: 5000, channels: 0 });
    let error = refused_sampled(|_, _, samples| samples.channel = vec![4, 4]);
    assert_eq!(error, Error::SampledChannelsDoNotAscend { place: 1, channel: 4, before: 4 });
    assert_says(&error, &["sort them by channel"]);
    let error = refused_sampled(|_, log, _| log.fired_at_fs[2] = 1_000_000_000_000_000_000);
    assert_eq!(error, Error::FarFromSamples { shot: 2, ticks: 1_000_000_000_000_000 });
    assert_says(&error, &["shot 2", "one stretch of time after another"]);
    let error = refused_sampled(|_, _, samples| samples.epoch = i64::MAX);
    assert!(matches!(error, Error::FarFromSamples { shot: 0, .. }), "{error:?}");
}

#[test]
fn signals_that_cannot_be_are_refused() {
    type Spoil = fn(&mut Sampling);
    let spoils: [(&str, Spoil); 12] = [
        ("sampling.pulse", |sampling| sampling.pulse.clear()),
        ("sampling.pulse", |sampling| sampling.pulse.push(1.0)),
        ("sampling.pulse", |sampling| sampling.pulse = vec![1.0; (1 << 14) + 1]),
        ("sampling.pulse", |sampling| sampling.pulse[3] = f32::NAN),
        ("sampling.pulse", |sampling| sampling.pulse[8] = 0.0),
        ("sampling.pulse", |sampling| sampling.pulse[8] = -1.0),
        ("sampling.excess", |sampling| sampling.excess = 0.9),
        ("sampling.excess", |sampling| sampling.excess = f64::NAN),
        ("sampling.excess", |sampling| sampling.excess = f64::INFINITY),
        ("sampling.full_scale", |sampling| sampling.full_scale = 0),
        ("sampling.full_scale", |sampling| sampling.full_scale = -7),
        ("sampling.least_marks", |sampling| sampling.least_marks = 0),
    ];
    for (name, spoil) in spoils {
        let error = refused_sampled(|receiver, _, _| {
            let Method::Sampled(settings) = &mut receiver.method else { panic!() };
            spoil(&mut settings.sampling);
        });
        assert!(matches!(error, Error::Setting { setting, .. } if setting == name), "{error:?}");
        assert_says(&error, &[name, "use "]);
    }
}

#[test]
fn without_samples_it_is_dark() {
    let ((receiver, mut samples), log) = (sampled(), log());
    samples.channel = vec![1];
    let elsewhere = receiver.decode(&codebook(), &log, &samples).unwrap();
    let none = receiver.decode(&codebook(), &log, &Samples::default()).unwrap();
    for returns in [elsewhere, none] {
        assert!(returns.is_empty());
        assert_eq!(returns.rejected(Reject::NoPeak), 3);
    }
}

#[test]
fn lit_zeros_are_for_the_balanced_receiver() {
    let payload = Payload::new(2, Crc::default(), true).unwrap();
    let family = Family::gold(5).unwrap();
    let book = Codebook::new(family, Some(payload), 4, Keying::Inversion).unwrap();
    let log = ShotLog::of_one_channel(&[0], &[1]);
    for kind in KINDS {
        let receiver = receiver_of(kind);
        let decoded = receiver.decode(&book, &log, &Ticks { tick: vec![5], ..Ticks::default() });
        let understands = matches!(kind, ReceiverKind::Balanced | ReceiverKind::Direct);
        assert_eq!(decoded.is_ok(), understands, "{kind:?}");
    }
    let error = Receiver::matched(1000).decode(&book, &log, &Ticks::default()).unwrap_err();
    assert_says(&error, &["balanced"]);
}

#[test]
fn darkness_is_no_error_and_counts_every_shot() {
    for kind in KINDS {
        let receiver = receiver_of(kind);
        let mut log = log();
        // However far apart: where there is no tick there is nothing to be far from.
        log.fired_at_fs[2] = 1_000_000_000_000_000_000;
        let returns = receiver.decode(&codebook(), &log, &Ticks::default()).unwrap();
        assert!(returns.is_empty());
        let counted = matches!(kind, ReceiverKind::Literal | ReceiverKind::Blind);
        assert_eq!(returns.rejects.iter().sum::<u64>(), if counted { 0 } else { 3 }, "{kind:?}");
    }
}

/// Integers of every size, the ends of what is counted among them.
fn any_i64() -> impl Strategy<Value = i64> {
    prop_oneof![
        -100_i64..100,
        -3_000_000_i64..3_000_000,
        Just(i64::MIN),
        Just(i64::MAX),
        any::<i64>()
    ]
}

fn any_u32() -> impl Strategy<Value = u32> {
    prop_oneof![0_u32..20, 0_u32..5000, Just(u32::MAX), any::<u32>()]
}

fn any_f64() -> impl Strategy<Value = f64> {
    prop_oneof![Just(0.0), 0.0..3.0, Just(1e-6), Just(f64::NAN), any::<f64>()]
}

prop_compose! {
    fn any_correlation()(
        light_ticks in any_u32(),
        ticks_per_chip in any_u32(),
        jitter_ticks in any_f64(),
        false_alarm in any_f64(),
        photons_apart in any::<bool>(),
    ) -> Correlation {
        Correlation { ticks_per_chip, light_ticks, jitter_ticks, photons_apart, false_alarm }
    }
}

prop_compose! {
    fn any_receiver()(
        gate_ticks in (any_u32(), any_u32()),
        tick_fs in any_i64(),
        returns in 0..10_u8,
        pick in prop_oneof![Just(Pick::First), Just(Pick::Strongest), Just(Pick::Last)],
    ) -> Receiver {
        Receiver { gate_ticks, returns, pick, ..Receiver::matched(tick_fs) }
    }
}

prop_compose! {
    /// A receiver with at most one setting out of the ordinary, or with all of them (`wrong` = 7).
    fn nearly_sane()(
        (any, odd, odd_threshold) in (any_receiver(), any_correlation(), any::<u16>()),
        kind in 0..KINDS.len(),
        effort in prop_oneof![Just(Effort::Quick), Just(Effort::Thorough)],
        wrong in 0..12_usize,
        ticks_per_chip in 1..4_u32,
        jitter_ticks in prop_oneof![Just(0.0), 0.1..20.0_f64],
    ) -> Receiver {
        let mut receiver = Receiver { pick: any.pick, returns: 3, ..receiver() };
        let false_alarm = 1e-3;
        let mut set_to =
            Correlation { ticks_per_chip, jitter_ticks, false_alarm, ..correlation() };
        let mut bit_threshold = 3;
        match wrong {
            0 => receiver.gate_ticks = any.gate_ticks,
            1 => set_to.light_ticks = odd.light_ticks,
            2 => set_to.ticks_per_chip = odd.ticks_per_chip,
            3 => receiver.tick_fs = any.tick_fs,
            4 => set_to.jitter_ticks = odd.jitter_ticks,
            5 => set_to.false_alarm = odd.false_alarm,
            6 => bit_threshold = odd_threshold,
            7 => (receiver, set_to, bit_threshold) = (any, odd, odd_threshold),
            _ => {}
        }
        receiver.method = method(KINDS[kind], bit_threshold, set_to);
        if let Method::Matched(_, set_to) = &mut receiver.method {
            *set_to = effort;
        }
        receiver
    }
}

/// A log that is in order more often than not.
fn any_log() -> impl Strategy<Value = ShotLog> {
    let fired_from = |times: BoxedStrategy<i64>| {
        let shot = (times, 0..18_u16, 0..6_u16, 0..3_u16, any::<u16>());
        proptest::collection::vec(shot, 0..12)
    };
    let near = (-100_i64..4_000_000).boxed();
    let shots = prop_oneof![4 => fired_from(near), 1 => fired_from(any_i64().boxed())];
    (shots, 0..8_u8, (0..14_usize, 0..14_usize)).prop_map(|(mut shots, care, (start, end))| {
        if care > 0 {
            shots.sort_unstable();
        }
        if care > 1 {
            shots.iter_mut().for_each(|shot| (shot.1, shot.2) = (shot.1 % 16, shot.2 % 5));
        }
        let count = shots.len();
        let mut log = ShotLog {
            first: u64::from(care),
            fired_at_fs: shots.iter().map(|shot| shot.0).collect(),
            row: shots.iter().map(|shot| shot.4).collect(),
            column: shots.iter().map(|shot| shot.4 % 7).collect(),
            label: shots.iter().map(|shot| shot.1).collect(),
            word: shots.iter().map(|shot| shot.2).collect(),
            channel: shots.iter().map(|shot| if care > 5 { shot.3 } else { 0 }).collect(),
            owned: start..end,
        };
        if care > 2 {
            log.owned = start.min(count)..end.clamp(start.min(count), count);
        }
        if care == 2 {
            log.word.pop();
        }
        log
    })
}

/// Ticks that are in order more often than not.
fn any_ticks() -> impl Strategy<Value = Ticks> {
    let near = (0..6000_u32, 0..3_u16);
    let far = (any_u32(), 0..3_u16);
    let ticks = prop_oneof![
        proptest::collection::vec(near, 0..900),
        proptest::collection::vec(far, 0..60),
    ];
    let epoch = prop_oneof![3 => Just(0), 3 => -2000_i64..2000, 1 => any_i64()];
    (ticks, epoch, 0..8_u8).prop_map(|(mut ticks, epoch, care)| {
        let has_channels = care % 2 == 1;
        if care > 0 {
            let key = |tick: &(u32, u16)| (if has_channels { tick.1 } else { 0 }, tick.0);
            ticks.sort_unstable_by_key(key);
            ticks.dedup_by_key(|tick| key(tick));
        }
        Ticks {
            epoch,
            tick: ticks.iter().map(|tick| tick.0).collect(),
            channel: if has_channels { ticks.iter().map(|tick| tick.1).collect() } else { vec![] },
            amplitude: if care > 6 { vec![f32::NAN; ticks.len()] } else { vec![] },
        }
    })
}

static DECODED: AtomicUsize = AtomicUsize::new(0);

proptest! {
    #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(3), ..ProptestConfig::with_cases(3000) })]

    /// All returns belong to owned shots, in order.
    fn whatever_is_given_is_decoded_or_refused(
        receiver in nearly_sane(),
        log in any_log(),
        ticks in any_ticks(),
        is_single in 0..8_u8,
    ) {
        let book = if is_single == 0 { Codebook::single() } else { codebook() };
        if let Ok(returns) = receiver.decode(&book, &log, &ticks) {
            DECODED.fetch_add(1, Ordering::Relaxed);
            prop_assert!(returns.shot.is_sorted());
            let is_owned = |shot: &u32| log.owned.contains(&(*shot as usize));
            prop_assert!(returns.shot.iter().all(is_owned));
            prop_assert!(returns.tof.iter().all(|tof| tof.is_finite()));
        }
    }
}

#[test]
fn nothing_makes_a_receiver_panic() {
    whatever_is_given_is_decoded_or_refused();
    let decoded = DECODED.load(Ordering::Relaxed);
    assert!((500..2900).contains(&decoded), "{decoded} of 3000 were decoded: the test is blind");
}

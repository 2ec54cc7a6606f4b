//! Receivers, logs and ticks of any numbers.

use std::sync::LazyLock;

use macropulse::codec::code::{Codebook, Crc, Family, Keying, Payload};
use macropulse::codec::decode::{Bitwise, Correlation, Effort, Method, Opening, Pick, Receiver};
use macropulse::codec::{ShotLog, Ticks};

static BOOKS: LazyLock<Vec<Codebook>> = LazyLock::new(|| {
    let payload = Payload::new(4, Crc::default(), false).ok();
    let prime = Family::prime(5).ok();
    let coded = prime.and_then(|prime| Codebook::new(prime, payload, 16, Keying::OnOff).ok());
    let payload = Payload::new(2, Crc::default(), true).ok();
    let gold = Family::gold(5).ok();
    let bipolar = gold.and_then(|gold| Codebook::new(gold, payload, 4, Keying::Inversion).ok());
    [Some(Codebook::single()), coded, bipolar].into_iter().flatten().collect()
});

/// Numbers out of bytes; zeros behind their end.
struct Numbers<'a>(&'a [u8]);

impl Numbers<'_> {
    fn bytes<const N: usize>(&mut self) -> [u8; N] {
        let mut taken = [0; N];
        let count = N.min(self.0.len());
        taken[..count].copy_from_slice(&self.0[..count]);
        self.0 = &self.0[count..];
        taken
    }

    fn byte(&mut self) -> u8 {
        self.bytes::<1>()[0]
    }

    /// A small number, or one of any size.
    fn count(&mut self) -> u32 {
        match self.byte() {
            255 => u32::from_le_bytes(self.bytes()),
            kind @ 200..255 => u32::from(self.byte()) << (kind % 24),
            small => u32::from(small),
        }
    }

    fn time(&mut self) -> i64 {
        match self.byte() {
            255 => i64::from_le_bytes(self.bytes()),
            kind @ 200..255 => i64::from(self.byte()) << (kind % 55),
            small => i64::from(small) * 1000,
        }
    }

    fn real(&mut self) -> f64 {
        match self.byte() {
            255 => f64::from_le_bytes(self.bytes()),
            small => f64::from(small) / 16.0,
        }
    }
}

fn receiver(numbers: &mut Numbers) -> Receiver {
    let kind = numbers.byte() % 5;
    let mut receiver = Receiver { gate_ticks: (0, 2000), ..Receiver::matched(1000) };
    let mut correlation = Correlation {
        light_ticks: 3000,
        ticks_per_chip: u32::from(numbers.byte() % 4),
        ..Correlation::default()
    };
    let mut bit_threshold = 3;
    let wrong = numbers.byte();
    if wrong & 1 > 0 {
        receiver.gate_ticks = (numbers.count(), numbers.count());
    }
    if wrong & 2 > 0 {
        correlation.light_ticks = numbers.count();
    }
    if wrong & 4 > 0 {
        receiver.tick_fs = numbers.time();
    }
    if wrong & 8 > 0 {
        correlation.jitter_ticks = numbers.real();
    }
    if wrong & 16 > 0 {
        correlation.false_alarm = numbers.real();
    }
    if wrong & 32 > 0 {
        bit_threshold = numbers.byte().into();
        correlation.ticks_per_chip = numbers.count();
    }
    correlation.photons_apart = wrong & 64 > 0;
    let effort = if wrong & 128 > 0 { Effort::Thorough } else { Effort::Quick };
    let Correlation { ticks_per_chip, jitter_ticks, .. } = correlation;
    let bitwise =
        |opening| Method::Bitwise(Bitwise { opening, bit_threshold, ticks_per_chip, jitter_ticks });
    receiver.method = match kind {
        0 => bitwise(Opening::FirstBit),
        1 => bitwise(Opening::AnyBit),
        2 => Method::Matched(correlation, effort),
        3 => Method::Balanced(correlation),
        _ => Method::Direct,
    };
    receiver.returns = numbers.byte() % 10;
    receiver.pick = [Pick::First, Pick::Strongest, Pick::Last][usize::from(numbers.byte() % 3)];
    receiver
}

fn log(numbers: &mut Numbers) -> ShotLog {
    let mut log = ShotLog::default();
    let mut at = numbers.time();
    for _ in 0..numbers.byte() % 12 {
        at = at.saturating_add(numbers.time().saturating_mul(10));
        log.fired_at_fs.push(at);
        log.label.push(u16::from(numbers.byte() % 20));
        log.word.push(u16::from(numbers.byte() % 6));
        log.channel.push(u16::from(numbers.byte() % 3));
        log.row.push(0);
        log.column.push(log.column.len() as u16);
    }
    let (start, end) = (usize::from(numbers.byte() % 4), usize::from(numbers.byte() % 4));
    log.owned = start..log.len().saturating_sub(end);
    log
}

fn ticks(numbers: &mut Numbers) -> Ticks {
    let kind = numbers.byte();
    let mut ticks = Ticks::default();
    if kind & 1 > 0 {
        ticks.epoch = numbers.time();
    }
    let mut at = numbers.count();
    while !numbers.0.is_empty() {
        at = at.saturating_add(numbers.count());
        ticks.tick.push(at);
        if kind & 2 > 0 {
            let before = ticks.channel.last().copied().unwrap_or(0);
            let next = u16::from(numbers.byte() > 250);
            ticks.channel.push(before.saturating_add(next));
            at = if next > 0 { 0 } else { at };
        }
        if kind & 4 > 0 {
            ticks.amplitude.push(numbers.real() as f32);
        }
    }
    ticks
}

/// Reads `bytes` as a receiver, a log and ticks, decodes them and explains a shot.
pub fn decode(bytes: &[u8]) {
    let mut numbers = Numbers(bytes);
    let book = &BOOKS[usize::from(numbers.byte()) % BOOKS.len()];
    let shot = usize::from(numbers.byte() % 16);
    let receiver = receiver(&mut numbers);
    let log = log(&mut numbers);
    let ticks = ticks(&mut numbers);
    match receiver.decode(book, &log, &ticks) {
        Ok(returns) => {
            assert!(returns.shot.is_sorted(), "returns are in order");
            assert!(returns.shot.iter().all(|shot| log.owned.contains(&(*shot as usize))));
            assert!(returns.tof.iter().all(|tof| tof.is_finite()), "returns have a time");
        }
        Err(error) => crate::assert_told(&error),
    }
    if let Err(error) = receiver.explain(book, (&log, &ticks), shot) {
        crate::assert_told(&error);
    }
}

//! Least cost of decoding: an experiment beside the receiver, with the true source of all light.
//!
//! In noise every tick is laid down as a bit, twice, to keep what is explained apart from what was seen. The
//! marks of each echo are counted at 256 lags about its range, and put out. The range is taken from the
//! scene. Without noise every tick is compared with the one before it and with the expected one. Nothing is
//! searched for, doubted or written down.
//!
//! A second floor adds the measurements that a return must have. The marks that were seen in each lit bit,
//! and those that are left over in each dark one, tell its label. With jitter the ticks of each lateness tell
//! its time.
//!
//! The loops of the receiver lay down the ticks and count the marks. The receiver takes longer by the time of
//! all its other work.

use std::hint::black_box;

use macropulse::codec::on_every_level;
use macropulse::codec::steps::{LAGS, WordMarks, ascends, lay, widen};

use crate::Fallible;
use crate::goals;
use crate::machine::least_seconds;
use crate::page::{self, speed, three};
use crate::sample::{Condition, Echo, Given, Sample};

/// Ticks that are laid down together: 2 × 128 kB, which a second cache holds.
const STRETCH: usize = 1 << 20;

/// How often each is timed.
const ROUNDS: usize = 4;

/// Half of the lags are before the one that is told.
const BEFORE: usize = LAGS / 2;

/// The table.
pub fn text() -> Fallible<String> {
    let mut rows = Vec::new();
    for goals::Decode { name, scene, condition, least } in goals::decoding() {
        let sample = Sample::of(condition.design()?, scene, 12)?;
        let given = sample.given();
        let ticks: usize = given.iter().map(|(_, ticks)| ticks.tick.len()).sum();
        let labels = Labels::of(&sample);
        let mut took = [f64::INFINITY; 3];
        // By turns, so that what else the machine does slows all of them down.
        for _ in 0..ROUNDS {
            let floors = match condition {
                Condition::CLEAN => [read(&given); 2],
                _ => [false, true].map(|told| laid_and_counted(&sample, &given, &labels, told)),
            };
            let receiver = least_seconds(|| {
                black_box(sample.decode(&given).ok());
            });
            let round = [floors[0], floors[1], receiver];
            took = std::array::from_fn(|way| round[way].min(took[way]));
        }
        let [seconds, told, receiver] = took;
        rows.push(vec![
            format!("`{scene}`, {name}"),
            three(ticks as f64 / sample.shots()),
            format!("≥ {}", speed(least)),
            speed(sample.speed(seconds)),
            speed(sample.speed(told)),
            speed(sample.speed(receiver)),
            three(1e9 * told / sample.shots()),
            three(1e9 * receiver / sample.shots()),
            format!("{} ×", three(receiver / told)),
        ]);
    }
    let head = [
        "decoding",
        "ticks a shot",
        "goal",
        "floor",
        "with label and time",
        "receiver",
        "with label and time, ns a shot",
        "receiver, ns a shot",
        "receiver beside that",
    ];
    Ok(page::table(&head, &rows))
}

/// Seconds to hold each tick against the one before it and against what is expected.
fn read(given: &[Given]) -> f64 {
    let expected: Vec<Vec<u32>> = given.iter().map(|(_, ticks)| ticks.tick.clone()).collect();
    least_seconds(|| {
        for ((_, ticks), expected) in given.iter().zip(&expected) {
            black_box((ascends(&ticks.tick), differs(&ticks.tick, expected)));
        }
    })
}

on_every_level! {
    fn differs(ticks: &[u32], expected: &[u32]) -> u32 {
        ticks.iter().zip(expected).fold(0, |differs, (tick, expected)| differs | tick ^ expected)
    }
}

/// Tables to tell a label: the marks of each word, and the ticks from the beginning of a macropulse to each
/// dark bit and to each lit one, by label.
struct Labels {
    words: Vec<WordMarks>,
    bits: Vec<[Vec<u32>; 2]>,
}

impl Labels {
    fn of(sample: &Sample) -> Self {
        let book = &sample.design.emission.coding().codebook;
        let scale = sample.design.receiver.method.ticks_per_chip().unwrap_or(1);
        let word = |word: usize| WordMarks::new(&book.word(word as u16).marks, scale);
        let bits = book.payload().map_or(1, |payload| payload.bits());
        let chips = book.chips() / bits;
        let bits_of = |label: u32| {
            let lit = book.lit_bits(label as u16);
            let (lit, dark): (Vec<u32>, Vec<u32>) =
                (0..bits).map(|bit| bit * chips).partition(|bit| lit.contains(bit));
            [dark, lit].map(|bits| bits.into_iter().map(|bit| scale * bit).collect())
        };
        Self {
            words: (0..book.words()).map(word).collect(),
            bits: (0..book.labels()).map(bits_of).collect(),
        }
    }
}

/// Returns the seconds to lay all ticks down, and to count and put out the marks of all echoes. If they are
/// `told` by their `labels`, marks are also counted bit by bit, and with jitter by their lateness.
fn laid_and_counted(sample: &Sample, given: &[Given], labels: &Labels, told: bool) -> f64 {
    let echoes = sample.echoes();
    let width = sample.design.receiver.window_ticks();
    let longest = echoes.iter().flatten().filter_map(|echo| echo.marks.last());
    let room = (STRETCH + *longest.max().unwrap_or(&0) as usize).div_ceil(64) + 8;
    let [mut seen, mut lit, mut left] = [(); 3].map(|()| vec![0; room]);
    let mut found_in_bits = Vec::new();
    least_seconds(|| {
        for ((_, ticks), echoes) in given.iter().zip(&echoes) {
            let (mut ticks, mut echoes) = (&ticks.tick[..], &echoes[..]);
            let mut begin = 0;
            while !echoes.is_empty() {
                ticks = &ticks[ticks.partition_point(|tick| (*tick as usize) < begin)..];
                seen.fill(0);
                lay(&mut seen, begin as i64, ticks);
                left.copy_from_slice(&seen);
                let found = match width {
                    1 => &seen,
                    _ => {
                        widen(&seen, &mut lit, width);
                        &lit
                    }
                };
                let here = echoes.partition_point(|echo| echo.start < begin + STRETCH);
                for Echo { start, marks, word, label } in &echoes[..here] {
                    // The first lag must not come before the stretch.
                    let first = start.saturating_sub(begin + BEFORE);
                    let word = &labels.words[usize::from(*word)];
                    let [dark, bright] = &labels.bits[usize::from(*label)];
                    black_box(word.most(found, first as u32, bright));
                    let start = start.saturating_sub(begin);
                    put_out(&mut left, start, marks);
                    if !told {
                        continue;
                    }
                    let mut count = |words: &[u64], start: usize, bits: &[u32]| {
                        word.found_in_each(words, start as u32, bits, &mut found_in_bits);
                        black_box(&found_in_bits);
                    };
                    count(found, start, bright);
                    count(&left, start, dark);
                    // A window that holds the marks is as wide as the jitter lets them be late.
                    let late = if width == 1 { 0 } else { width as usize };
                    (0..late).for_each(|late| count(&seen, start + late, bright));
                }
                echoes = &echoes[here..];
                begin += STRETCH;
            }
            black_box(&left);
        }
    })
}

/// Puts the `marks` of a macropulse that begins at bit `start` out.
fn put_out(words: &mut [u64], start: usize, marks: &[u32]) {
    for mark in marks {
        let bit = start + *mark as usize;
        if let Some(word) = words.get_mut(bit / 64) {
            *word &= !(1 << (bit % 64));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_told_is_there() {
        let sample = Sample::of(Condition::CLEAN.design().unwrap(), "street", 240).unwrap();
        let (given, echoes) = (sample.given(), sample.echoes());
        let labels = Labels::of(&sample);
        let (mut found, mut found_in_bits, mut marks_of_all) = (0, 0, 0);
        let mut in_bits = Vec::new();
        for ((_, ticks), echoes) in given.iter().zip(&echoes) {
            let end = *ticks.tick.last().unwrap() as usize;
            let mut seen = vec![0; end / 64 + 1];
            assert_eq!(lay(&mut seen, 0, &ticks.tick), ticks.tick.len());
            let first = ticks.tick[0] as usize;
            let is_whole = |echo: &&Echo| {
                let last = echo.marks.last().map_or(0, |mark| *mark as usize);
                echo.start > first && echo.start + last < end
            };
            for Echo { start, marks, word, label } in echoes.iter().filter(is_whole) {
                let word = &labels.words[usize::from(*word)];
                let bright = &labels.bits[usize::from(*label)][1];
                found += word.most(&seen, (start - BEFORE) as u32, bright);
                word.found_in_each(&seen, *start as u32, bright, &mut in_bits);
                found_in_bits += in_bits.iter().sum::<u32>();
                marks_of_all += marks.len() as u32;
                put_out(&mut seen, *start, marks);
            }
        }
        // Every mark is there, but for those that lie under a macropulse that was put out before.
        for found in [found, found_in_bits] {
            assert!(100 * found > 95 * marks_of_all, "{found} of {marks_of_all}");
        }
    }
}

//! Converters served first-free.

use std::ops::Range;

use crate::design::PARTS_OF_TICK;
use crate::kernels::{all_apart, distinct};

/// Detection events looked at together.
const BLOCK: usize = 512;

/// Converters served first-free, each busy for the same time. An event finds one free unless each of them
/// took an event within the last dead time.
#[derive(Debug)]
pub(super) struct Bank {
    pub converters: usize,
    /// Time for which a converter is busy, ticks.
    pub dead: u32,
    /// Most converters that were busy at once, as far as is known.
    pub peak: usize,
}

impl Bank {
    /// Makes ticks of `times` and leaves those that find a converter free. Gives how many fell
    /// into the tick of another one.
    pub fn take_all(&mut self, times: &mut Vec<u32>) -> usize {
        let (mut taken, mut merged, mut last) = (0, 0, u32::MAX);
        for read in (0..times.len()).step_by(BLOCK) {
            let from = read..times.len().min(read + BLOCK);
            let found = from.len();
            let end = distinct(times, from, taken, PARTS_OF_TICK.trailing_zeros(), &mut last);
            let block = taken..end;
            merged += found - block.len();
            taken = self.take_block(times, block);
        }
        times.truncate(taken);
        merged
    }

    /// Takes the events of `block`, which are apart; all before it were taken. Gives where those taken
    /// end.
    ///
    /// If each of them is a dead time later than the one `peak` places before it, no more than `peak`
    /// converters are busy at any of them. Then all are taken, and there is no new peak. Few blocks are
    /// different.
    fn take_block(&mut self, ticks: &mut [u32], block: Range<usize>) -> usize {
        let is_free = self.peak > 0
            && block.start.checked_sub(self.peak).is_some_and(|back| {
                all_apart(&ticks[back..][..block.len()], &ticks[block.clone()], self.dead)
            });
        if is_free { block.end } else { self.take_one_by_one(ticks, block) }
    }

    /// Takes the events from place `from` on, which are apart, if they find a converter free; all
    /// before were taken.
    pub fn take_from(&mut self, ticks: &mut Vec<u32>, from: usize) {
        let mut taken = from;
        for read in (from..ticks.len()).step_by(BLOCK) {
            let block = read..ticks.len().min(read + BLOCK);
            let moved = taken..taken + block.len();
            ticks.copy_within(block, taken);
            taken = self.take_block(ticks, moved);
        }
        ticks.truncate(taken);
    }

    /// Takes the events of `block` one by one; all before it were taken. Gives where those taken
    /// end.
    fn take_one_by_one(&mut self, ticks: &mut [u32], block: Range<usize>) -> usize {
        // Converters that took events before that are free again.
        let mut busy = block.start.saturating_sub(self.peak)..block.start;
        for read in block {
            let now = ticks[read];
            if self.takes(now, ticks, &mut busy) {
                ticks[busy.end] = now;
                busy.end += 1;
            }
        }
        busy.end
    }

    /// Returns true if an event at `now` finds a converter free. Those events of `taken` in the range `busy`
    /// may still keep one busy.
    fn takes(&mut self, now: u32, taken: &[u32], busy: &mut Range<usize>) -> bool {
        while busy.start < busy.end && now - taken[busy.start] >= self.dead {
            busy.start += 1;
        }
        if busy.len() == self.converters {
            return false;
        }
        self.peak = self.peak.max(busy.len() + 1);
        true
    }

    /// Makes ticks of `times` and leaves those that find one of the converters of their channel
    /// free, and what belongs to them. Gives how many fell into the tick of another one.
    pub fn take_by_channel(
        &mut self,
        times: &mut Vec<u32>,
        channels: &mut Vec<u16>,
        amplitudes: &mut Vec<f32>,
    ) -> usize {
        let (mut merged, mut busy, mut before) = (0, 0..0, None);
        for read in 0..times.len() {
            let channel = channels.get(read).copied().unwrap_or(0);
            let now = times[read] / PARTS_OF_TICK;
            if before == Some((channel, now)) {
                merged += 1;
                continue;
            }
            if before.is_some_and(|(other, _)| other != channel) {
                busy.start = busy.end;
            }
            before = Some((channel, now));
            if self.takes(now, times, &mut busy) {
                times[busy.end] = now;
                if let Some(place) = channels.get_mut(busy.end) {
                    *place = channel;
                }
                if read < amplitudes.len() {
                    amplitudes[busy.end] = amplitudes[read];
                }
                busy.end += 1;
            }
        }
        times.truncate(busy.end);
        channels.truncate(busy.end);
        amplitudes.truncate(busy.end);
        merged
    }
}

//! Random numbers that are a function of a counter, Philox4x32-10 \[SMDS11\].
//!
//! Ten rounds of two multiplications turn a counter of 128 bits and a key of 64 bits into 128
//! random bits. There is no state, so that any number of counters is worked on at once.
//!
//! Loops count indices: what iterators call is not always inlined, and then is not widened.
#![allow(clippy::needless_range_loop)]

use macropulse_codec::on_every_level;

/// Counters worked on together.
const BLOCKS: usize = 16;

/// Numbers in a group: four of each block.
pub(crate) const GROUP: usize = 4 * BLOCKS;

const ROUNDS: usize = 10;
const MULTIPLIERS: [u64; 2] = [0xD251_1F53, 0xCD9E_8D57];
/// Steps of the key from round to round: the golden ratio and √3 − 1.
const STEPS: [u32; 2] = [0x9E37_79B9, 0xBB67_AE85];
const LOW: u64 = 0xFFFF_FFFF;

on_every_level! {
    /// Fills `groups`. Group g has the blocks of the counters (16·g + i, `address`), i < 16; the
    /// number at 16·w + i is word w of block i.
    pub(crate) fn philox(key: [u32; 2], address: [u32; 3], groups: &mut [[u32; GROUP]]) {
        for (g, group) in groups.iter_mut().enumerate() {
            // One number in 64 bits each, as the multiplication has it. Only the lower 32 count:
            // what stands above them never comes down again.
            let first = (g as u32).wrapping_mul(BLOCKS as u32);
            let mut a = [0; BLOCKS];
            for i in 0..BLOCKS {
                a[i] = u64::from(first.wrapping_add(i as u32));
            }
            let mut b = [u64::from(address[0]); BLOCKS];
            let mut c = [u64::from(address[1]); BLOCKS];
            let mut d = [u64::from(address[2]); BLOCKS];
            let mut key = key;
            for _ in 0..ROUNDS {
                for i in 0..BLOCKS {
                    let from_a = (a[i] & LOW) * MULTIPLIERS[0];
                    let from_c = (c[i] & LOW) * MULTIPLIERS[1];
                    a[i] = (from_c >> 32) ^ b[i] ^ u64::from(key[0]);
                    b[i] = from_c;
                    c[i] = (from_a >> 32) ^ d[i] ^ u64::from(key[1]);
                    d[i] = from_a;
                }
                key = [key[0].wrapping_add(STEPS[0]), key[1].wrapping_add(STEPS[1])];
            }
            for i in 0..BLOCKS {
                group[i] = a[i] as u32;
                group[BLOCKS + i] = b[i] as u32;
                group[2 * BLOCKS + i] = c[i] as u32;
                group[3 * BLOCKS + i] = d[i] as u32;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use macropulse_codec::level::forced::at_each_level;
    use proptest::prelude::*;

    /// One block, as the authors write it.
    fn block(mut counter: [u32; 4], mut key: [u32; 2]) -> [u32; 4] {
        let product = |which: usize, by: u32| {
            let product = u64::from(by) * MULTIPLIERS[which];
            ((product >> 32) as u32, product as u32)
        };
        for _ in 0..ROUNDS {
            let (a, c) = (product(0, counter[0]), product(1, counter[2]));
            counter = [c.0 ^ counter[1] ^ key[0], c.1, a.0 ^ counter[3] ^ key[1], a.1];
            key = [key[0].wrapping_add(STEPS[0]), key[1].wrapping_add(STEPS[1])];
        }
        counter
    }

    /// The known answers that come with Random123 \[SMDS11\].
    #[test]
    fn the_published_numbers_come_out() {
        let known = [
            ([0; 4], [0; 2], [0x6627_e8d5, 0xe169_c58d, 0xbc57_ac4c, 0x9b00_dbd8]),
            ([!0; 4], [!0; 2], [0x408f_276d, 0x41c8_3b0e, 0xa20b_c7c6, 0x6d54_51fd]),
            (
                [0x243f_6a88, 0x85a3_08d3, 0x1319_8a2e, 0x0370_7344],
                [0xa409_3822, 0x299f_31d0],
                [0xd16c_fe09, 0x94fd_cceb, 0x5001_e420, 0x2412_6ea1],
            ),
        ];
        for (counter, key, numbers) in known {
            assert_eq!(block(counter, key), numbers);
        }
    }

    proptest! {
        #[test]
        fn groups_hold_the_blocks_of_their_counters_at_every_level(
            key: [u32; 2], address: [u32; 3], count in 0..4_usize,
        ) {
            for (level, groups) in at_each_level(|| {
                let mut groups = vec![[0; GROUP]; count];
                philox(key, address, &mut groups);
                groups
            }) {
                for (at, number) in groups.as_flattened().iter().enumerate() {
                    let (group, word, i) = (at / GROUP, at % GROUP / BLOCKS, at % BLOCKS);
                    let [a, b, c] = address;
                    let expected = block([(group * BLOCKS + i) as u32, a, b, c], key)[word];
                    prop_assert_eq!(*number, expected, "{:?} {}", level, at);
                }
            }
        }
    }
}

//! LZF, by which the points of compressed PCD files are packed.
//!
//! A stream is a list of runs of bytes as they are and of copies of what was unpacked before. The first
//! byte of a run below 32 is its length less 1. Else its upper three bits are the length of a copy less
//! 2, where 7 adds a byte to the length; the other five bits and the next byte are how far back the
//! copy begins, less 1.

/// Bytes that one packed byte unpacks to at most: 3 bytes make a copy of 264.
pub(super) const MOST_EXPANSION: usize = 88;

/// The `size` bytes that were packed to `packed`; `None` if these are damaged.
pub(super) fn unpack(packed: &[u8], size: usize) -> Option<Vec<u8>> {
    if size > packed.len().saturating_mul(MOST_EXPANSION) {
        return None;
    }
    let mut bytes = Vec::with_capacity(size);
    let mut packed = packed.iter();
    let mut next = || packed.next().map(|byte| usize::from(*byte));
    while bytes.len() < size {
        let control = next()?;
        if control < 32 {
            for _ in 0..=control {
                bytes.push(next()? as u8);
            }
        } else {
            let longer = if control >> 5 == 7 { next()? } else { 0 };
            let back = ((control & 31) << 8) + next()? + 1;
            let from = bytes.len().checked_sub(back)?;
            for at in from..from + (control >> 5) + 2 + longer {
                // A copy may reach into itself.
                bytes.push(*bytes.get(at)?);
            }
        }
    }
    (bytes.len() == size).then_some(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_and_copies_are_unpacked() {
        // Three bytes as they are, then 3 from 3 back, then 9 + 1 from 1 back.
        let packed = [2, b'a', b'b', b'c', 1 << 5, 2, 7 << 5, 1, 0];
        assert_eq!(unpack(&packed, 16).unwrap(), b"abcabccccccccccc");
        assert_eq!(unpack(&[], 0).unwrap(), b"");
    }

    #[test]
    fn damaged_streams_are_refused() {
        let packed = [2, b'a', b'b', b'c', 1 << 5, 2];
        for (packed, size) in [
            (&packed[..], 5), // a copy ends behind the size
            (&packed[..], 7), // too few bytes
            (&packed[..3], 3),
            (&packed[..5], 6),
            (&[1 << 5, 0][..], 3),  // a copy from before the beginning
            (&packed[..], 1 << 40), // more than any stream unpacks to
        ] {
            assert_eq!(unpack(packed, size), None, "{packed:?} {size}");
        }
    }
}

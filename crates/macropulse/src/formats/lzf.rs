//! LZF, the compression of points in compressed PCD files.
//!
//! A stream is a list of runs of literal bytes and of copies of bytes that were unpacked before. A first byte
//! below 32 begins a run: it is the length of the run less 1. Any other first byte begins a copy. Its upper
//! three bits are the length of the copy less 2; if they are 7, the next byte is added to the length. Its
//! lower five bits and the byte behind are the distance back to the start of the copy, less 1.

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

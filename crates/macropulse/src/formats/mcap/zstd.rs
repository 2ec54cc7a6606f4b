//! Chunks that are compressed by Zstandard, as rosbag2 writes them.

use ::mcap::sans_io::decompressor::{DecompressResult, Decompressor};
use ::mcap::{McapError, McapResult};
use ruzstd::decoding::FrameDecoder;
use std::io::Read;

/// Most bytes that a frame may refer back to: what the levels of common writers end at.
const WIDEST_WINDOW: u64 = 1 << 27;

/// Bytes of the head of a block.
const BLOCK_HEAD: usize = 3;

/// Unpacks the chunks of a file, block by block, so that a small chunk which says that it is huge
/// takes no more memory than its window.
pub(super) struct Zstd {
    decoder: FrameDecoder,
    /// Bytes that are still to be decoded, from `at` on.
    pending: Vec<u8>,
    at: usize,
    /// The frame that is under way, if any.
    frame: Option<Frame>,
}

#[derive(Clone, Copy)]
struct Frame {
    has_checksum: bool,
}

impl Zstd {
    pub fn new() -> Self {
        let mut decoder = FrameDecoder::new();
        decoder.set_max_window_size(WIDEST_WINDOW);
        Self { decoder, pending: Vec::new(), at: 0, frame: None }
    }

    /// Decodes the head of a frame, or a block. Returns false if more bytes are needed for it.
    fn advance(&mut self) -> McapResult<bool> {
        let rest = self.pending.get(self.at..).unwrap_or_default();
        let length = match self.frame {
            None => {
                let Some((length, has_checksum)) = frame_head(rest) else { return Ok(false) };
                let Some(head) = rest.get(..length) else { return Ok(false) };
                self.decoder.reset(head).map_err(fault)?;
                self.frame = Some(Frame { has_checksum });
                length
            }
            Some(frame) => {
                let Some(length) = block_length(rest, frame) else { return Ok(false) };
                let Some(block) = rest.get(..length) else { return Ok(false) };
                self.decoder.decode_from_to(block, &mut []).map_err(fault)?;
                length
            }
        };
        self.at += length;
        Ok(true)
    }
}

impl Decompressor for Zstd {
    fn next_read_size(&self) -> usize {
        0
    }

    fn decompress(&mut self, src: &[u8], dst: &mut [u8]) -> McapResult<DecompressResult> {
        self.pending.drain(..self.at);
        self.at = 0;
        self.pending.extend_from_slice(src);
        let consumed = src.len();
        loop {
            let wrote = match self.frame {
                Some(_) => self.decoder.read(dst).map_err(fault)?,
                None => 0,
            };
            if wrote > 0 {
                return Ok(DecompressResult { consumed, wrote });
            }
            if self.frame.is_some() && self.decoder.is_finished() {
                self.frame = None;
            }
            if !self.advance()? {
                return Ok(DecompressResult { consumed, wrote: 0 });
            }
        }
    }

    fn reset(&mut self) -> McapResult<()> {
        self.pending.clear();
        (self.at, self.frame) = (0, None);
        Ok(())
    }

    fn name(&self) -> &'static str {
        "zstd"
    }
}

fn fault(error: impl std::fmt::Display) -> McapError {
    McapError::DecompressionError(error.to_string())
}

/// Bytes of the head of a frame, and whether a checksum ends the frame \[RFC 8878, 3.1.1.1\]; `None`
/// where `bytes` are too few to tell.
fn frame_head(bytes: &[u8]) -> Option<(usize, bool)> {
    let descriptor = *bytes.get(4)?;
    let is_single = descriptor & 0x20 != 0;
    let size = match descriptor >> 6 {
        0 => usize::from(is_single),
        flag => 1 << flag,
    };
    let dictionary = [0, 1, 2, 4][usize::from(descriptor & 3)];
    let length = 5 + usize::from(!is_single) + dictionary + size;
    Some((length, descriptor & 4 != 0))
}

/// Bytes of a block with its head and, behind the last one, the checksum of the frame \[RFC 8878,
/// 3.1.1.2\]; `None` where `bytes` are too few to tell.
fn block_length(bytes: &[u8], frame: Frame) -> Option<usize> {
    let [a, b, c] = *bytes.first_chunk::<BLOCK_HEAD>()?;
    let head = u32::from_le_bytes([a, b, c, 0]);
    // A block of one byte that is repeated has that byte alone.
    let content = if (head >> 1) & 3 == 1 { 1 } else { (head >> 3) as usize };
    let checksum = if head & 1 == 1 && frame.has_checksum { 4 } else { 0 };
    Some(BLOCK_HEAD + content + checksum)
}

#[cfg(test)]
mod tests {
    use super::*;
    use ruzstd::encoding::{CompressionLevel, compress_to_vec};

    /// Unpacks `packed`, with input and output in pieces.
    fn unpacked(packed: &[u8], piece: usize, room: usize) -> McapResult<Vec<u8>> {
        let (mut zstd, mut out) = (Zstd::new(), Vec::new());
        let mut pieces = packed.chunks(piece);
        let mut buffer = vec![0; room];
        loop {
            let source = pieces.next();
            let result = zstd.decompress(source.unwrap_or_default(), &mut buffer)?;
            out.extend_from_slice(&buffer[..result.wrote]);
            if source.is_none() && result.wrote == 0 {
                return Ok(out);
            }
        }
    }

    #[test]
    fn frames_unpack_whatever_the_pieces() {
        let bytes: Vec<u8> = (0..400_000_u32).map(|at| (at.wrapping_mul(at) >> 7) as u8).collect();
        let zeros = vec![0; 300_000];
        let mut packed = compress_to_vec(&bytes[..], CompressionLevel::Fastest);
        packed.extend(compress_to_vec(&zeros[..], CompressionLevel::Fastest));
        let expected = [bytes, zeros].concat();
        for (piece, room) in [(1 << 20, 1 << 20), (7, 1 << 16), (100_000, 333)] {
            assert!(unpacked(&packed, piece, room).unwrap() == expected, "{piece} {room}");
        }
        assert!(unpacked(&packed[4..], 1 << 20, 1 << 16).is_err());
    }
}

//! The bytes that a glTF document names: its own, in its text, or in files beside it.

use std::io::Read;
use std::path::Path;

use ::gltf::Document;
use ::gltf::buffer::{Buffer, Source};
use base64::Engine;
use base64::alphabet::STANDARD;
use base64::engine::DecodePaddingMode;
use base64::engine::general_purpose::{GeneralPurpose, GeneralPurposeConfig};

use super::super::lines::text;
use super::super::{DAMAGED, Reach, open};
use super::{Bytes, MOST_BYTES, TOO_LARGE};
use crate::scene::error::Error;

/// Returns the bytes of each buffer of `document`, the file at `path`, in files within `reach`; `binary` are
/// those that the file itself brings. Files beside it are read up to the declared length. No buffer is read
/// before the declared lengths have been added up.
///
/// # Errors
/// If a buffer is shorter than declared, or its file cannot be read or lies where it may not, or all
/// are too large.
pub(super) fn buffers<'a>(
    (path, reach): (&Path, Reach<'_>),
    document: &Document,
    binary: Bytes<'a>,
) -> Result<Vec<Bytes<'a>>, Error> {
    let lengths = document.buffers().map(|buffer| buffer.length() as u64);
    let incomplete =
        |index: usize| Error::mesh(path, format!("its buffer {index} is incomplete"), DAMAGED);
    if lengths.fold(0, u64::saturating_add) > MOST_BYTES {
        return Err(Error::mesh(path, "has buffers of more than 1 GiB together", TOO_LARGE));
    }
    let mut binary = Some(binary);
    let mut buffers = Vec::new();
    for buffer in document.buffers() {
        let bytes = match buffer.source() {
            // Only one buffer can be that of the file; another would be a copy of it.
            Source::Bin => binary.take().unwrap_or_default(),
            Source::Uri(uri) => named((path, reach), &buffer, uri)?.into(),
        };
        if bytes.len() < buffer.length() {
            return Err(incomplete(buffer.index()));
        }
        buffers.push(bytes);
    }
    Ok(buffers)
}

/// Returns the bytes of a `data:` URI, or of a file beside the document up to the declared length.
fn named((path, reach): (&Path, Reach<'_>), buffer: &Buffer, uri: &str) -> Result<Vec<u8>, Error> {
    if let Some(inline) = uri.strip_prefix("data:") {
        let text = inline.split_once(";base64,").map(|(_, text)| unescaped(text));
        let bytes = text.and_then(|text| BASE_64.decode(text.trim_ascii()).ok());
        return Ok(bytes.unwrap_or_default());
    }
    // Some programs escape no letter, so that a name may be meant as it stands.
    let (meant, literal) = (unescaped(uri), reach.beside(path, uri));
    let beside = match (reach.beside(path, &text(&meant)), literal) {
        (meant, Ok(literal)) if literal.is_file() && !meant.as_ref().is_ok_and(|m| m.is_file()) => {
            literal
        }
        (meant, _) => meant?,
    };
    let mut bytes = Vec::new();
    open(&beside)?
        .take(buffer.length() as u64)
        .read_to_end(&mut bytes)
        .map_err(|source| Error::Unreadable { path: beside, source })?;
    Ok(bytes)
}

/// Base64, with or without the signs that fill it up.
const BASE_64: GeneralPurpose = GeneralPurpose::new(
    &STANDARD,
    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
);

/// A URI with `%` and two hexadecimal digits in place of bytes as those bytes are.
fn unescaped(uri: &str) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.as_bytes();
    while let [first, behind @ ..] = rest {
        let digits = behind.first_chunk::<2>().filter(|_| *first == b'%');
        let digits = digits.filter(|two| two.iter().all(u8::is_ascii_hexdigit));
        let escaped = digits.and_then(|two| std::str::from_utf8(two).ok());
        match escaped.and_then(|two| u8::from_str_radix(two, 16).ok()) {
            Some(byte) => {
                bytes.push(byte);
                rest = &behind[2..];
            }
            None => {
                bytes.push(*first);
                rest = behind;
            }
        }
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_are_escaped_by_two_digits() {
        for (uri, wanted) in
            [("a%20b", "a b"), ("%C3%a9%%2", "\u{e9}%%2"), ("100%", "100%"), ("%+1", "%+1")]
        {
            assert_eq!(unescaped(uri), wanted.as_bytes(), "{uri}");
        }
    }
}

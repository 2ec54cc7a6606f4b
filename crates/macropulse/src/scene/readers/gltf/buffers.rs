//! The bytes that a glTF document names: its own, in its text, or in files beside it.

use std::io::Read;
use std::path::Path;

use ::gltf::Document;
use ::gltf::buffer::{Buffer, Source};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use super::super::{DAMAGED, open};
use super::{Bytes, MOST_BYTES, TOO_LARGE};
use crate::scene::error::Error;

/// The bytes of each buffer of `document`, the file at `path`; `binary` are those that the file
/// itself brings. Never more than it declares, and nothing before the declared lengths have been
/// added up.
///
/// # Errors
/// If a buffer is shorter than declared, or its file cannot be read, or all are too large.
pub(super) fn buffers<'a>(
    path: &Path,
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
            Source::Uri(uri) => named(path, &buffer, uri)?.into(),
        };
        if bytes.len() < buffer.length() {
            return Err(incomplete(buffer.index()));
        }
        buffers.push(bytes);
    }
    Ok(buffers)
}

/// The bytes of a `data:` URI or of a file beside the document, as many as are declared.
fn named(path: &Path, buffer: &Buffer, uri: &str) -> Result<Vec<u8>, Error> {
    if let Some(inline) = uri.strip_prefix("data:") {
        let text = inline.split_once(";base64,").map(|(_, text)| text);
        return Ok(text.and_then(|text| STANDARD.decode(text).ok()).unwrap_or_default());
    }
    let folder = path.parent().unwrap_or(Path::new(""));
    let beside = folder.join(uri.replace("%20", " "));
    let mut bytes = Vec::new();
    open(&beside)?
        .take(buffer.length() as u64)
        .read_to_end(&mut bytes)
        .map_err(|source| Error::Unreadable { path: beside, source })?;
    Ok(bytes)
}

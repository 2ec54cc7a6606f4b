//! Records of one length, each of one shot, in the order of the shots: a file is read in the memory of one of them.

use std::io::Read;

use super::Error;
use super::source::{Source, number};

/// Reads such records one by one. Each begins with the absolute id of its shot.
#[derive(Debug)]
pub(super) struct ByShot<R> {
    source: Source<R>,
    /// Records in the file, if the header says it.
    count: Option<u64>,
    read: u64,
    last: Option<u64>,
    bytes: Vec<u8>,
    /// The name of a record, with its article, and the plural of what is counted.
    names: [&'static str; 2],
}

impl<R: Read> ByShot<R> {
    /// The records of this `length` behind the header of `source`.
    pub fn new(
        source: Source<R>,
        count: Option<u64>,
        length: usize,
        names: [&'static str; 2],
    ) -> Self {
        Self { source, count, read: 0, last: None, bytes: vec![0; length], names }
    }

    /// An error about what was read last.
    pub fn refuse<T>(&self, message: impl Into<String>) -> Result<T, Error> {
        self.source.refuse(message)
    }

    /// The shot of the next record, and its bytes; `None` behind the last one.
    ///
    /// # Errors
    /// If it cannot be read, does not come after those before it, or if the file ends too early.
    pub fn next(&mut self) -> Result<Option<(u64, &[u8])>, Error> {
        let Self { source, count, read, last, bytes, names: [one, all] } = self;
        if !source.record(bytes)? {
            return match *count {
                Some(count) if *read < count => source.refuse(format!(
                    "the file ends after {read} of {count} {all}: it is truncated"
                )),
                _ => Ok(None),
            };
        }
        if let Some(count) = count.filter(|count| *read >= *count) {
            return source.refuse(format!("the header says that there are {count} {all} only"));
        }
        let shot = number!(bytes, 0, u64);
        if let Some(last) = last.filter(|last| shot <= *last) {
            return source.refuse(format!(
                "{one} of shot {shot} comes after that of shot {last}: sort them by shot, and give each shot \
                 once"
            ));
        }
        *last = Some(shot);
        *read += 1;
        Ok(Some((shot, bytes)))
    }
}

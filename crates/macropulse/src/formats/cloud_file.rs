//! Files of points, read a part at a time.

use super::about::About;
use crate::opened;
use crate::points::PointCloud;
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom};
use std::path::Path;

/// Bytes of the longest line that is read.
pub(super) const LONGEST_LINE: u64 = 1 << 20;

/// Bytes of the longest header that is read.
pub(super) const LONGEST_HEADER: u64 = 1 << 24;

/// A file of points that is read a part at a time.
pub(super) struct CloudFile {
    bytes: BufReader<Box<dyn Inner>>,
    length: u64,
    /// Bytes before the next one.
    at: u64,
    line: Vec<u8>,
}

/// The source of the bytes: a file, in tests also memory.
trait Inner: Read + Seek + Send + Sync {}

impl<T: Read + Seek + Send + Sync> Inner for T {}

/// The scans of a file. Each scan is a cloud.
pub(super) trait Scans {
    /// How many scans there are.
    fn count(&self) -> usize;

    /// The metadata of the file, as far as it was read.
    fn about(&self) -> &About;

    /// The cloud of the next scan.
    fn advance(&mut self) -> Option<Result<PointCloud, String>>;
}

impl CloudFile {
    /// The file at `path`.
    ///
    /// # Errors
    /// As [`opened::file`].
    pub fn open(path: &Path) -> io::Result<Self> {
        let file = opened::file(path, u64::MAX)?;
        let length = file.metadata()?.len();
        Ok(Self::new(file, length))
    }

    fn new(inner: impl Inner + 'static, length: u64) -> Self {
        Self { bytes: BufReader::new(Box::new(inner)), length, at: 0, line: Vec::new() }
    }

    /// Bytes of the file.
    pub fn length(&self) -> u64 {
        self.length
    }

    /// Bytes before the next one.
    pub fn at(&self) -> u64 {
        self.at
    }

    /// Bytes that are still to be read.
    pub fn rest(&self) -> u64 {
        self.length.saturating_sub(self.at)
    }

    /// The next line without its end; `None` at the end of the file.
    ///
    /// # Errors
    /// If it is longer than [`LONGEST_LINE`], or cannot be read.
    pub fn line(&mut self) -> Result<Option<&[u8]>, String> {
        Ok(self.read_line()?.then_some(&self.line))
    }

    /// The next line that is not blank, as [`CloudFile::line`].
    ///
    /// # Errors
    /// As that.
    pub fn line_of_words(&mut self) -> Result<Option<&[u8]>, String> {
        while self.read_line()? {
            if !self.line.iter().all(u8::is_ascii_whitespace) {
                return Ok(Some(&self.line));
            }
        }
        Ok(None)
    }

    /// Reads a line, and tells whether there was one.
    fn read_line(&mut self) -> Result<bool, String> {
        let mut line = std::mem::take(&mut self.line);
        line.clear();
        let read = self.take(LONGEST_LINE + 1).read_until(b'\n', &mut line).map_err(unreadable)?;
        if read as u64 > LONGEST_LINE {
            return Err(format!("it has a line of more than {LONGEST_LINE} bytes"));
        }
        for end in [b'\n', b'\r'] {
            if line.last() == Some(&end) {
                line.pop();
            }
        }
        self.line = line;
        Ok(read > 0)
    }

    /// The next line of a header, as [`CloudFile::line`].
    ///
    /// # Errors
    /// As that; and if the header is longer than [`LONGEST_HEADER`].
    pub fn header_line(&mut self) -> Result<Option<&[u8]>, String> {
        match self.at > LONGEST_HEADER {
            true => Err(format!("its header is longer than {LONGEST_HEADER} bytes")),
            false => self.line(),
        }
    }

    /// Fills `bytes` from the file; `false` if the file ends before.
    ///
    /// # Errors
    /// If they cannot be read.
    pub fn fill(&mut self, bytes: &mut [u8]) -> Result<bool, String> {
        match self.read_exact(bytes) {
            Ok(()) => Ok(true),
            Err(cause) if cause.kind() == io::ErrorKind::UnexpectedEof => Ok(false),
            Err(cause) => Err(unreadable(cause)),
        }
    }

    /// Goes to byte `at` of the file.
    ///
    /// # Errors
    /// If there is no such place.
    pub fn go_to(&mut self, at: u64) -> Result<(), String> {
        self.seek(SeekFrom::Start(at)).map(|_| ()).map_err(unreadable)
    }

    /// As [`CloudFile::fill`], from byte `at` of the file on.
    ///
    /// # Errors
    /// As that.
    pub fn fill_from(&mut self, at: u64, bytes: &mut [u8]) -> Result<bool, String> {
        self.go_to(at)?;
        self.fill(bytes)
    }

    /// The next `length` bytes; `None` if the file ends before.
    ///
    /// # Errors
    /// If they cannot be read.
    pub fn bytes(&mut self, length: u64) -> Result<Option<Vec<u8>>, String> {
        if length > self.rest() {
            return Ok(None);
        }
        let mut bytes = vec![0; length as usize];
        Ok(self.fill(&mut bytes)?.then_some(bytes))
    }

    /// Skips bytes; `false` if the file ends before.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn skip(&mut self, bytes: u64) -> Result<bool, String> {
        if bytes > self.rest() {
            return Ok(false);
        }
        self.go_to(self.at + bytes)?;
        Ok(true)
    }

    /// Returns true if nothing but white space follows. The file then stands where it stood before.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn is_blank(&mut self) -> Result<bool, String> {
        let at = self.at;
        let is_blank = loop {
            let bytes = self.fill_buf().map_err(unreadable)?;
            if bytes.is_empty() || !bytes.iter().all(u8::is_ascii_whitespace) {
                break bytes.is_empty();
            }
            let length = bytes.len();
            self.consume(length);
        };
        self.go_to(at)?;
        Ok(is_blank)
    }
}

fn unreadable(cause: io::Error) -> String {
    format!("it cannot be read: {cause}")
}

impl Read for CloudFile {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        let read = self.bytes.read(bytes)?;
        self.at += read as u64;
        Ok(read)
    }
}

impl BufRead for CloudFile {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        self.bytes.fill_buf()
    }

    fn consume(&mut self, amount: usize) {
        self.bytes.consume(amount);
        self.at += amount as u64;
    }
}

impl Seek for CloudFile {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        // A place within what is buffered costs no reading.
        let near = match to {
            SeekFrom::Start(to) => i64::try_from(i128::from(to) - i128::from(self.at)).ok(),
            _ => None,
        };
        self.at = match near {
            Some(by) => {
                self.bytes.seek_relative(by)?;
                self.at.wrapping_add_signed(by)
            }
            None => self.bytes.seek(to)?,
        };
        Ok(self.at)
    }
}

#[cfg(test)]
impl CloudFile {
    /// A file of these bytes.
    pub fn of_bytes(bytes: &[u8]) -> Self {
        Self::new(io::Cursor::new(bytes.to_vec()), bytes.len() as u64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_end_as_text_of_any_system_does() {
        let mut file = CloudFile::of_bytes(b"one\r\n\ntwo");
        for line in [&b"one"[..], b"", b"two"] {
            assert_eq!(file.line().unwrap(), Some(line));
        }
        assert_eq!(file.line().unwrap(), None);
        assert_eq!((file.at(), file.rest()), (9, 0));
        let mut endless = CloudFile::of_bytes(&vec![b'0'; LONGEST_LINE as usize + 1]);
        assert_eq!(endless.line().unwrap_err(), "it has a line of more than 1048576 bytes");
    }

    #[test]
    fn a_header_without_an_end_is_refused() {
        let mut file = CloudFile::of_bytes(&b"a comment of a header\n".repeat(1 << 20));
        let told = std::iter::repeat_with(|| file.header_line().err()).find_map(|told| told);
        assert_eq!(told.unwrap(), "its header is longer than 16777216 bytes");
        assert!(file.at() < LONGEST_HEADER + LONGEST_LINE);
    }

    #[test]
    fn a_place_is_kept_over_buffers() {
        let bytes: Vec<u8> = (0..100_000_u32).map(|at| (at % 251) as u8).collect();
        let mut file = CloudFile::of_bytes(&bytes);
        let mut four = [0; 4];
        for at in [0_u64, 70_000, 99_996, 5, 8190, 8192, 3] {
            assert!(file.fill_from(at, &mut four).unwrap());
            assert_eq!(four, bytes[at as usize..][..4]);
            assert_eq!(file.at(), at + 4);
        }
        assert!(file.skip(80_000).unwrap() && file.fill(&mut four).unwrap());
        assert_eq!(four, bytes[80_007..][..4]);
        assert!(!file.skip(20_000).unwrap());
        assert!(!file.fill_from(99_998, &mut four).unwrap());
        assert!(!file.fill_from(u64::MAX, &mut four).unwrap_or(false));
    }

    #[test]
    fn white_space_at_the_end_is_blank_and_read_again() {
        let mut bytes = vec![b'\n'; 20_000];
        assert!(CloudFile::of_bytes(&bytes).is_blank().unwrap());
        bytes.push(b'7');
        let mut file = CloudFile::of_bytes(&bytes);
        assert!(!file.is_blank().unwrap());
        assert_eq!(file.line().unwrap(), Some(&b""[..]));
        assert!(CloudFile::of_bytes(b"").is_blank().unwrap());
    }
}

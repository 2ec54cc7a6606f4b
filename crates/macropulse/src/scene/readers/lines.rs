//! The lines of a text that some program wrote: in UTF-8 or Latin-1, with or without a byte-order
//! mark, ended as on Unix, Windows or old Macs.

use std::borrow::Cow;
use std::io::{self, BufRead};
use std::path::Path;

use crate::scene::error::Error;

/// Longer lines are no text, bytes.
const LONGEST: usize = 1 << 24;

const UTF_8: &[u8] = b"\xef\xbb\xbf";
const UTF_16: [&[u8]; 2] = [b"\xff\xfe", b"\xfe\xff"];

/// A problem with a line, in words that follow its number, or with the whole file.
pub(super) enum Fault {
    Line(String),
    File(Error),
}

impl From<String> for Fault {
    fn from(problem: String) -> Self {
        Self::Line(problem)
    }
}

impl From<Error> for Fault {
    fn from(error: Error) -> Self {
        Self::File(error)
    }
}

/// The lines of a file, one after the other.
pub(super) struct Lines<'a, R> {
    file: &'a mut R,
    path: &'a Path,
    is_joined: bool,
    line: Vec<u8>,
    /// Number of the line that was read last, from 1; of several that are joined, the number of the first.
    number: usize,
    /// Lines that were read.
    read: usize,
}

impl<'a, R: BufRead> Lines<'a, R> {
    /// The lines of `file`, whose name in messages is `path`.
    ///
    /// # Errors
    /// If it cannot be read, or is in UTF-16.
    pub(super) fn of(file: &'a mut R, path: &'a Path) -> Result<Self, Error> {
        let begins = file.fill_buf().map_err(|source| unreadable(path, source))?;
        if UTF_16.iter().any(|mark| begins.starts_with(mark)) {
            return Err(Error::mesh(path, "is text in UTF-16", "save it as UTF-8"));
        }
        if begins.starts_with(UTF_8) {
            file.consume(UTF_8.len());
        }
        Ok(Self { file, path, is_joined: false, line: Vec::new(), number: 0, read: 0 })
    }

    /// The same, where `\` at the end of a line leads on to the next, but for remarks.
    pub(super) fn joined(self) -> Self {
        Self { is_joined: true, ..self }
    }

    /// The next line without its end, and its number, from 1: the first of several that are joined.
    /// `None` behind the last.
    ///
    /// # Errors
    /// If the file cannot be read, or a line is longer than any of a text.
    pub(super) fn next(&mut self) -> Result<Option<(usize, Cow<'_, str>)>, Error> {
        self.line.clear();
        self.number = self.read + 1;
        if !self.extend()? {
            return Ok(None);
        }
        let is_remark = self.line.trim_ascii_start().starts_with(b"#");
        while self.is_joined && !is_remark && self.line.ends_with(b"\\") {
            self.line.pop();
            self.line.push(b' ');
            if !self.extend()? {
                break;
            }
        }
        Ok(Some((self.number, text(&self.line))))
    }

    /// Lets `take` have the number of each line and the line; what that says is wrong with it, and
    /// then what to do. Or it says what is wrong with the whole file.
    ///
    /// # Errors
    /// As [`Lines::next`], and what `take` says.
    pub(super) fn each<F: Into<Fault>>(
        &mut self,
        remedy: &str,
        mut take: impl FnMut(usize, &str) -> Result<(), F>,
    ) -> Result<(), Error> {
        while let Some((number, line)) = self.next()? {
            if let Err(fault) = take(number, &line) {
                drop(line);
                return Err(match fault.into() {
                    Fault::Line(problem) => self.fault(problem, remedy),
                    Fault::File(error) => error,
                });
            }
        }
        Ok(())
    }

    /// Returns the error for a `problem` in the line that was read last.
    fn fault(&self, problem: impl AsRef<str>, remedy: &str) -> Error {
        let number = self.number;
        Error::mesh(self.path, format!("line {number} {}", problem.as_ref()), remedy)
    }

    /// Adds a line of the file to `line`: whether there was one.
    fn extend(&mut self) -> Result<bool, Error> {
        let unreadable = |source| unreadable(self.path, source);
        let mut is_there = false;
        loop {
            let some = self.file.fill_buf().map_err(unreadable)?;
            if some.is_empty() {
                break;
            }
            if !is_there {
                is_there = true;
                self.read += 1;
            }
            let Some(end) = some.iter().position(|byte| matches!(byte, b'\n' | b'\r')) else {
                let length = some.len();
                self.line.extend(some);
                self.file.consume(length);
                if self.line.len() > LONGEST {
                    let problem = format!("is longer than {} MiB", LONGEST >> 20);
                    return Err(self.fault(problem, "export it with a line for each element"));
                }
                continue;
            };
            let is_return = some[end] == b'\r';
            self.line.extend(&some[..end]);
            self.file.consume(end + 1);
            if is_return && self.file.fill_buf().map_err(unreadable)?.first() == Some(&b'\n') {
                self.file.consume(1);
            }
            break;
        }
        Ok(is_there)
    }
}

/// The bytes of a text whose lines end as on any system, ended as on Unix.
pub(super) struct UnixLines<R> {
    file: R,
    some: Vec<u8>,
    /// Number of bytes of `some` that have been given out.
    given: usize,
    /// True if a carriage return came last; a line feed after it does not end another line.
    is_returned: bool,
}

impl<R: BufRead> UnixLines<R> {
    pub(super) fn of(file: R) -> Self {
        Self { file, some: Vec::new(), given: 0, is_returned: false }
    }
}

impl<R: BufRead> BufRead for UnixLines<R> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        while self.given == self.some.len() {
            self.given = 0;
            self.some.clear();
            let bytes = self.file.fill_buf()?;
            if bytes.is_empty() {
                break;
            }
            for byte in bytes {
                if !(self.is_returned && *byte == b'\n') {
                    self.some.push(if *byte == b'\r' { b'\n' } else { *byte });
                }
                self.is_returned = *byte == b'\r';
            }
            let length = bytes.len();
            self.file.consume(length);
        }
        Ok(&self.some[self.given..])
    }

    fn consume(&mut self, count: usize) {
        self.given = self.some.len().min(self.given + count);
    }
}

impl<R: BufRead> io::Read for UnixLines<R> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let count = io::Read::read(&mut self.fill_buf()?, into)?;
        self.consume(count);
        Ok(count)
    }
}

fn unreadable(path: &Path, source: io::Error) -> Error {
    Error::Unreadable { path: path.to_owned(), source }
}

/// The letters of `bytes`: in UTF-8, and in Latin-1 where they are none.
pub(super) fn text(bytes: &[u8]) -> Cow<'_, str> {
    match std::str::from_utf8(bytes) {
        Ok(text) => text.into(),
        Err(_) => bytes.iter().map(|byte| char::from(*byte)).collect::<String>().into(),
    }
}

/// Returns the next `N` numbers of `words`, each finite.
///
/// # Errors
/// The word that is no finite number, or `None` if there are too few words.
pub(super) fn numbers<'a, const N: usize>(
    words: &mut impl Iterator<Item = &'a str>,
) -> Result<[f64; N], Option<&'a str>> {
    let mut numbers = [0.0; N];
    for number in &mut numbers {
        let word = words.next().ok_or(None)?;
        *number = word.parse().ok().filter(|value: &f64| value.is_finite()).ok_or(Some(word))?;
    }
    Ok(numbers)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(mut bytes: &[u8]) -> Vec<(usize, String)> {
        let mut lines = Lines::of(&mut bytes, Path::new("a.obj")).unwrap().joined();
        let mut found = Vec::new();
        while let Some((number, line)) = lines.next().unwrap() {
            found.push((number, line.into_owned()));
        }
        found
    }

    fn numbered(wanted: &[(usize, &str)]) -> Vec<(usize, String)> {
        wanted.iter().map(|(number, line)| (*number, (*line).to_owned())).collect()
    }

    #[test]
    fn lines_end_as_on_any_system() {
        let wanted = numbered(&[(1, "a"), (2, ""), (3, "b c")]);
        for text in ["a\n\nb c", "a\r\n\r\nb c\r\n", "a\r\rb c\r", "\u{feff}a\n\nb c\n"] {
            assert_eq!(lines(text.as_bytes()), wanted, "{text:?}");
        }
        assert_eq!(lines(b""), []);
    }

    #[test]
    fn ends_of_lines_become_those_of_unix_wherever_a_buffer_ends() {
        for size in 1..6 {
            let file = io::BufReader::with_capacity(size, b"a\r\n\r\nb\rc\n\nd\r".as_slice());
            let mut text = String::new();
            io::Read::read_to_string(&mut UnixLines::of(file), &mut text).unwrap();
            assert_eq!(text, "a\n\nb\nc\n\nd\n");
        }
    }

    #[test]
    fn a_backslash_leads_on_but_not_out_of_a_remark() {
        assert_eq!(lines(b"a\\\r\nb\\\nc\nd\\"), numbered(&[(1, "a b c"), (4, "d ")]));
        assert_eq!(lines(b" # C:\\\nv"), numbered(&[(1, " # C:\\"), (2, "v")]));
    }

    #[test]
    fn letters_are_of_utf_8_or_of_latin_1() {
        assert_eq!(text("b\u{e9}ton".as_bytes()), "b\u{e9}ton");
        assert_eq!(text(b"b\xe9ton"), "b\u{e9}ton");
    }

    #[test]
    fn a_line_without_end_is_refused() {
        let endless = vec![b' '; LONGEST + 2];
        let mut bytes = endless.as_slice();
        let told = Lines::of(&mut bytes, Path::new("a.obj")).unwrap().next().unwrap_err();
        assert!(told.to_string().starts_with("a.obj: line 1 is longer than 16 MiB; "), "{told}");
    }

    #[test]
    fn numbers_are_finite_and_all_there() {
        let read = |text: &'static str| numbers::<2>(&mut text.split_whitespace());
        assert_eq!(read("1 -2e3 x"), Ok([1.0, -2000.0]));
        assert_eq!(read("1"), Err(None));
        assert_eq!(read("1 1,5"), Err(Some("1,5")));
        assert_eq!((read("nan 1"), read("1 1e999")), (Err(Some("nan")), Err(Some("1e999"))));
    }
}

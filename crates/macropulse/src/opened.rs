//! Files opened to be read: what may be opened, and how large it may be.
//!
//! A name that is typed may lead to anything. A device gives bytes without an end, and a pipe to
//! which nothing writes gives none for ever; both are refused in words, before anything is read.

use std::fs::{File, Metadata, OpenOptions};
use std::io::{self, Chain, Cursor, Read};
use std::path::Path;

/// Most bytes of a text that a person types: a sensor, a scene, a scenario.
pub const LONGEST_TEXT: u64 = 16 << 20;

/// Most lines, commas and opening brackets of such a text: of what stands between them a parser makes
/// some hundred bytes each, however short it is.
const MOST_VALUES: usize = 1 << 21;

/// The bytes of a file, or of a pipe.
pub type Stream = Chain<Cursor<Vec<u8>>, File>;

/// The file at `path`, which must be one and have `most` bytes at most.
///
/// # Errors
/// That of the system; or a sentence, if it is something else or too large.
pub fn file(path: &Path, most: u64) -> io::Result<File> {
    let (file, about) = opened(path)?;
    if !about.is_file() {
        return Err(io::Error::other("it is a pipe, and this is read from files alone"));
    }
    if about.len() > most {
        return Err(too_large(most));
    }
    Ok(file)
}

/// All bytes of the file at `path`, `most` of them at most.
///
/// # Errors
/// As [`file()`].
pub fn bytes(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    let file = file(path, most)?;
    let mut bytes = Vec::with_capacity(file.metadata()?.len() as usize);
    read_to_end(file, most, &mut bytes)?;
    Ok(bytes)
}

/// The text in the file or pipe at `path`, of [`LONGEST_TEXT`] at most.
///
/// # Errors
/// As [`stream`]; or that it is too long, or no text.
pub fn text(path: &Path) -> io::Result<String> {
    let mut bytes = Vec::new();
    read_to_end(stream(path)?, LONGEST_TEXT, &mut bytes)?;
    let text = String::from_utf8(bytes).map_err(|_| io::ErrorKind::InvalidData)?;
    check_values(&text).map_err(io::Error::other)?;
    Ok(text)
}

/// Refuses a text of more values than are read.
///
/// # Errors
/// The sentence that says so.
pub fn check_values(text: &str) -> Result<(), String> {
    let values = text.bytes().filter(|byte| matches!(byte, b'\n' | b',' | b'[' | b'{')).count();
    match values > MOST_VALUES {
        true => Err(format!("it has more than {MOST_VALUES} values, the most that are read here")),
        false => Ok(()),
    }
}

/// Opens the file at `path`, or the pipe there if a program writes to it.
///
/// # Errors
/// The error of the system; or, in a sentence, that it is a device, or a pipe to which nothing writes.
pub fn stream(path: &Path) -> io::Result<Stream> {
    let (file, about) = opened(path)?;
    let first = if about.is_file() { Vec::new() } else { pipe::awaited(&file)? };
    Ok(Cursor::new(first).chain(file))
}

/// Returns true if both paths lead to one file, through whatever links.
pub fn is_same(one: &Path, other: &Path) -> bool {
    pipe::is_same(one, other)
}

/// Returns true if bytes written to `path` go through it: to a device that takes them one by one, into a
/// pipe, or to a standard stream.
pub fn is_written_through(path: &Path) -> bool {
    stream_number(path).is_some()
        || std::fs::metadata(path).is_ok_and(|about| pipe::takes_bytes(&about))
}

/// Opens the device, pipe or standard stream at `path`, if bytes written to it go through.
///
/// # Errors
/// The error of the system; or, in a sentence, that nothing reads from the pipe.
pub(crate) fn written_through(path: &Path) -> io::Result<Option<File>> {
    match stream_number(path) {
        Some(number) => pipe::standard_stream(number),
        None if is_written_through(path) => pipe::read_by_others(path).map(Some),
        None => Ok(None),
    }
}

/// Returns true if `path` names standard output.
pub fn is_standard_output(path: &Path) -> bool {
    stream_number(path) == Some(1)
}

/// The number of the standard output or error that `path` names, as `/dev/stdout` does.
fn stream_number(path: &Path) -> Option<u8> {
    let names = ["/dev/stdout", "/dev/fd/1", "/proc/self/fd/1"];
    let of_errors = ["/dev/stderr", "/dev/fd/2", "/proc/self/fd/2"];
    match path.to_str()? {
        name if names.contains(&name) => Some(1),
        name if of_errors.contains(&name) => Some(2),
        _ => None,
    }
}

fn too_large(most: u64) -> io::Error {
    let most = match most {
        1..1_048_576 => format!("{most} bytes"),
        _ if most.is_multiple_of(1 << 30) => format!("{} GiB", most >> 30),
        _ => format!("{} MiB", most >> 20),
    };
    io::Error::other(format!("it is larger than {most}, the most that is read here"))
}

fn read_to_end(from: impl Read, most: u64, bytes: &mut Vec<u8>) -> io::Result<()> {
    // One byte more than allowed tells that there are more.
    from.take(most + 1).read_to_end(bytes)?;
    if bytes.len() as u64 > most { Err(too_large(most)) } else { Ok(()) }
}

/// A file or a pipe, opened without waiting for what writes to it.
fn opened(path: &Path) -> io::Result<(File, Metadata)> {
    // A device is not even opened: that alone may set something going.
    check(&std::fs::metadata(path)?)?;
    let mut options = OpenOptions::new();
    options.read(true);
    pipe::without_waiting(&mut options);
    let file = options.open(path)?;
    let about = file.metadata()?;
    check(&about)?;
    Ok((file, about))
}

fn check(about: &Metadata) -> io::Result<()> {
    if about.is_dir() {
        return Err(io::ErrorKind::IsADirectory.into());
    }
    if !about.is_file() && !pipe::is(about) {
        return Err(io::Error::other("it is a device or a socket, and not a file"));
    }
    Ok(())
}

#[cfg(unix)]
mod pipe {
    use std::fs::{File, Metadata, OpenOptions};
    use std::io::{self, Read};
    use std::os::fd::AsFd;
    use std::os::unix::fs::{FileTypeExt, MetadataExt, OpenOptionsExt};
    use std::path::Path;
    use std::time::{Duration, Instant};

    use rustix::fs::{OFlags, fcntl_getfl, fcntl_setfl};

    /// How long a program may take to begin writing to a pipe.
    const PATIENCE: Duration = Duration::from_millis(600);

    pub(super) fn is(about: &Metadata) -> bool {
        about.file_type().is_fifo()
    }

    pub(super) fn takes_bytes(about: &Metadata) -> bool {
        let kind = about.file_type();
        kind.is_fifo() || kind.is_char_device()
    }

    pub(super) fn is_same(one: &Path, other: &Path) -> bool {
        let inode = |path: &Path| std::fs::metadata(path).map(|about| (about.dev(), about.ino()));
        matches!((inode(one), inode(other)), (Ok(one), Ok(other)) if one == other)
    }

    /// The stream itself and not what opens it anew, so that bytes go behind those of others.
    pub(super) fn standard_stream(number: u8) -> io::Result<Option<File>> {
        let stream = match number {
            1 => io::stdout().as_fd().try_clone_to_owned(),
            _ => io::stderr().as_fd().try_clone_to_owned(),
        };
        stream.map(File::from).map(Some)
    }

    /// A device, or a pipe once a program reads from it.
    pub(super) fn read_by_others(path: &Path) -> io::Result<File> {
        let began = Instant::now();
        let mut options = OpenOptions::new();
        options.write(true);
        without_waiting(&mut options);
        let unread = rustix::io::Errno::NXIO.raw_os_error();
        loop {
            match options.open(path) {
                Ok(file) => {
                    fcntl_setfl(&file, fcntl_getfl(&file)? - OFlags::NONBLOCK)?;
                    return Ok(file);
                }
                Err(error) if error.raw_os_error() != Some(unread) => return Err(error),
                Err(_) if began.elapsed() < PATIENCE => {
                    std::thread::sleep(Duration::from_millis(5));
                }
                Err(_) => {
                    return Err(io::Error::new(
                        io::ErrorKind::InvalidInput,
                        "it is a pipe, and nothing reads from it: first start what does, or name a file",
                    ));
                }
            }
        }
    }

    pub(super) fn without_waiting(options: &mut OpenOptions) {
        options.custom_flags(OFlags::NONBLOCK.bits().cast_signed());
    }

    /// Waits until a program has the pipe open to write, and gives what was read of it to see that.
    /// From then on reading waits for what it writes, however long.
    pub(super) fn awaited(mut pipe: &File) -> io::Result<Vec<u8>> {
        let began = Instant::now();
        let mut first = [0];
        let first = loop {
            match pipe.read(&mut first) {
                // No program has it open: not yet, or no longer.
                Ok(0) if began.elapsed() < PATIENCE => {
                    std::thread::sleep(Duration::from_millis(5));
                }
                Ok(0) => {
                    return Err(io::Error::other(
                        "it is a pipe, and nothing writes to it: first start what does, or name a file",
                    ));
                }
                Ok(_) => break first.to_vec(),
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => break Vec::new(),
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        };
        fcntl_setfl(pipe, fcntl_getfl(pipe)? - OFlags::NONBLOCK)?;
        Ok(first)
    }
}

#[cfg(not(unix))]
mod pipe {
    use std::fs::{File, Metadata, OpenOptions};
    use std::io;
    use std::path::Path;

    pub(super) fn is(_: &Metadata) -> bool {
        false
    }

    pub(super) fn takes_bytes(_: &Metadata) -> bool {
        false
    }

    pub(super) fn is_same(one: &Path, other: &Path) -> bool {
        matches!((one.canonicalize(), other.canonicalize()), (Ok(one), Ok(other)) if one == other)
    }

    pub(super) fn standard_stream(_: u8) -> io::Result<Option<File>> {
        Ok(None)
    }

    pub(super) fn read_by_others(path: &Path) -> io::Result<File> {
        OpenOptions::new().write(true).open(path)
    }

    pub(super) fn without_waiting(_: &mut OpenOptions) {}

    pub(super) fn awaited(_: &File) -> io::Result<Vec<u8>> {
        Ok(Vec::new())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_read_up_to_the_most_that_it_may_have() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        std::fs::write(&path, "twelve bytes").unwrap();
        assert_eq!(bytes(&path, 12).unwrap(), b"twelve bytes");
        assert_eq!(text(&path).unwrap(), "twelve bytes");
        let told = bytes(&path, 11).unwrap_err().to_string();
        assert_eq!(told, "it is larger than 11 bytes, the most that is read here");
        let told = file(folder.path(), 100).unwrap_err().kind();
        assert_eq!(told, io::ErrorKind::IsADirectory);
    }

    #[test]
    fn a_limit_is_told_as_people_say_it() {
        assert!(too_large(1 << 31).to_string().contains("2 GiB"));
        assert!(too_large(LONGEST_TEXT).to_string().contains("16 MiB"));
    }

    #[cfg(unix)]
    #[test]
    fn a_device_is_refused_before_it_is_opened() {
        for name in ["/dev/zero", "/dev/null"] {
            for refused in [text(Path::new(name)).err(), file(Path::new(name), 9).err()] {
                assert!(refused.unwrap().to_string().contains("a device"));
            }
        }
    }

    #[cfg(unix)]
    #[test]
    fn a_pipe_is_read_once_a_program_writes_to_it() {
        use std::io::Write;
        use std::time::{Duration, Instant};
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("pipe");
        let mode = rustix::fs::Mode::from_raw_mode(0o600);
        rustix::fs::mkfifoat(rustix::fs::CWD, &path, mode).unwrap();
        let began = Instant::now();
        assert!(text(&path).unwrap_err().to_string().contains("nothing writes to it"));
        assert!(began.elapsed() < Duration::from_secs(2));
        let to = path.clone();
        let writer = std::thread::spawn(move || {
            std::thread::sleep(Duration::from_millis(100));
            let mut pipe = OpenOptions::new().write(true).open(to).unwrap();
            // It may take its time once it has begun.
            std::thread::sleep(Duration::from_millis(1500));
            pipe.write_all(b"late, ").unwrap();
            std::thread::sleep(Duration::from_millis(50));
            pipe.write_all(b"and whole").unwrap();
        });
        assert_eq!(text(&path).unwrap(), "late, and whole");
        writer.join().unwrap();
        assert!(file(&path, 100).unwrap_err().to_string().contains("a pipe"));
    }
}

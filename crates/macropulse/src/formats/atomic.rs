//! Whole files or none.
//!
//! A name that a program derives, as `out/scan-000000.pcd`, and a name that a user types, as
//! `-o /dev/stdout`, are written differently. [`write_atomically`] replaces what stands under a derived
//! name and follows no link. [`write_named`] follows links, and writes into a device or a pipe.

use super::Error;
use crate::opened;
use std::fs::{self, File};
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

/// Unfinished files are named by this, random letters, and that.
const UNFINISHED: [&str; 2] = [".macropulse-", ".part"];

/// Most links from a name to its file, as of Linux.
const MOST_LINKS: usize = 40;

/// A file that is not there before it is kept, for one that is written bit by bit; see
/// [`write_atomically`].
#[derive(Debug)]
pub struct WholeFile {
    path: PathBuf,
    out: BufWriter<Sink>,
}

/// The place for the bytes of a file until it is whole.
#[derive(Debug)]
enum Sink {
    Temporary(NamedTempFile),
    /// A device or a pipe.
    Through(File),
}

impl WholeFile {
    /// Begins a file under a derived name.
    ///
    /// # Errors
    /// [`Error::Write`] if its folder cannot be written to, or a folder, a device, a pipe or a socket has
    /// its name.
    pub fn create(path: &Path) -> Result<Self, Error> {
        let begun = replaceable(path).and_then(|()| locked(named(parent(path))));
        let temporary = begun.map_err(|cause| Error::write(path, cause))?;
        Ok(Self::of(path, Sink::Temporary(temporary)))
    }

    /// Begins a file under a name that a user typed: links are followed, and into a device or a pipe
    /// the bytes are written as they come.
    ///
    /// # Errors
    /// As [`WholeFile::create`].
    pub fn create_named(path: &Path) -> Result<Self, Error> {
        let failed = |cause| Error::write(path, cause);
        match opened::written_through(path).map_err(failed)? {
            Some(file) => Ok(Self::of(path, Sink::Through(file))),
            None => Self::create(&followed(path).map_err(failed)?),
        }
    }

    fn of(path: &Path, sink: Sink) -> Self {
        Self { path: path.to_owned(), out: BufWriter::with_capacity(1 << 16, sink) }
    }

    /// Gives the file, which is whole now, its name. One that replaces another is on the disk before, so
    /// that a power loss takes no older result away. One that is new is left to the system: to wait for the
    /// disk would double the time of a small scan.
    ///
    /// # Errors
    /// [`Error::Write`] with its path and the cause; the temporary file is gone then.
    pub fn keep(self) -> Result<(), Error> {
        let Self { path, out } = self;
        let sink = out.into_inner().map_err(io::IntoInnerError::into_error);
        let kept = sink.and_then(|sink| match sink {
            Sink::Through(_) => Ok(()),
            Sink::Temporary(temporary) => {
                if path.symlink_metadata().is_ok() {
                    synced(temporary.as_file())?;
                }
                temporary.persist(&path).map(|_| ()).map_err(|error| error.error)
            }
        });
        kept.map_err(|cause| Error::write(&path, cause))
    }

    /// The error of a write to this file, with its path.
    pub fn failed(&self, cause: io::Error) -> Error {
        Error::write(&self.path, cause)
    }
}

impl Write for Sink {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match self {
            Self::Temporary(file) => file.write(bytes),
            Self::Through(file) => file.write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match self {
            Self::Temporary(file) => file.flush(),
            Self::Through(file) => file.flush(),
        }
    }
}

impl Seek for Sink {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        match self {
            Self::Temporary(file) => file.seek(to),
            Self::Through(file) => file.seek(to),
        }
    }
}

impl Write for WholeFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.out.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}

impl Seek for WholeFile {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.out.seek(to)
    }
}

/// Writes a file under a temporary name in the same folder and renames it when it is whole. Who
/// looks at `path` sees the old file or the new one, never half of it, also after Ctrl-C. A link that
/// has the name is replaced, not followed.
///
/// # Errors
/// [`Error::Write`] with `path` and the cause; the temporary file is gone then.
pub fn write_atomically(
    path: &Path,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), Error> {
    filled(WholeFile::create(path)?, write)
}

/// As [`write_atomically`], under a name that a user typed: a link is followed, and a device or a pipe
/// is written into.
///
/// # Errors
/// As [`write_atomically`].
pub fn write_named(
    path: &Path,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), Error> {
    filled(WholeFile::create_named(path)?, write)
}

fn filled(
    mut file: WholeFile,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), Error> {
    write(&mut file.out).map_err(|cause| file.failed(cause))?;
    file.keep()
}

/// A file that grows under its own name, in place of an older one.
pub(super) fn growing(path: &Path) -> io::Result<File> {
    replaceable(path)?;
    // A link is not followed, and a name that comes back meanwhile is not ours.
    match fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => File::create_new(path),
    }
}

/// As [`growing`], under a name that a user typed.
pub(super) fn growing_named(path: &Path) -> io::Result<File> {
    match opened::written_through(path)? {
        Some(file) => Ok(file),
        None => growing(&followed(path)?),
    }
}

/// Proves that a file can be made in `folder`, and leaves none.
///
/// # Errors
/// That of the system.
pub fn prove_writable(folder: &Path) -> io::Result<()> {
    locked(named(folder)).map(drop)
}

/// The name at the end of the links that begin at `path`. Nothing need stand there.
fn followed(path: &Path) -> io::Result<PathBuf> {
    let mut path = path.to_owned();
    for _ in 0..MOST_LINKS {
        match fs::read_link(&path) {
            // An absolute target stands for itself.
            Ok(target) => path = parent(&path).join(target),
            Err(_) => return Ok(path),
        }
    }
    Err(io::Error::new(io::ErrorKind::InvalidInput, "its links lead to each other"))
}

/// Refuses what a whole file cannot take the place of.
fn replaceable(path: &Path) -> io::Result<()> {
    match fs::symlink_metadata(path) {
        Ok(about) if about.is_dir() => Err(io::ErrorKind::IsADirectory.into()),
        Ok(about) if !about.is_file() && !about.is_symlink() => {
            let told = "it is a device, a pipe or a socket, and not a file";
            Err(io::Error::new(io::ErrorKind::InvalidInput, told))
        }
        _ => Ok(()),
    }
}

/// Waits until a file is on the disk, where its file system knows how to tell.
fn synced(file: &File) -> io::Result<()> {
    match file.sync_data() {
        Err(error)
            if matches!(error.kind(), io::ErrorKind::InvalidInput | io::ErrorKind::Unsupported) =>
        {
            Ok(())
        }
        done => done,
    }
}

fn parent(path: &Path) -> &Path {
    path.parent().unwrap_or(Path::new(""))
}

/// Removes from `folder` what runs have left there that were killed while they wrote: unfinished
/// files that nobody holds. Those of living runs stay, and so does whatever cannot be removed; where
/// the system knows no locks on files, all of them.
pub fn clear_unfinished(folder: &Path) {
    for entry in fs::read_dir(named(folder)).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let name = name.to_str().unwrap_or_default();
        let is_ours = name.starts_with(UNFINISHED[0]) && name.ends_with(UNFINISHED[1]);
        if is_ours && File::open(entry.path()).is_ok_and(|file| file.try_lock().is_ok()) {
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// The folder of a bare file name is empty, which is the current one.
fn named(folder: &Path) -> &Path {
    if folder.as_os_str().is_empty() { Path::new(".") } else { folder }
}

/// A temporary file, held until it is closed so that [`clear_unfinished`] passes it over.
fn locked(folder: &Path) -> io::Result<NamedTempFile> {
    loop {
        let temporary = builder().tempfile_in(folder)?;
        // Who cleared the folder may have been quicker than the lock.
        if temporary.as_file().lock().is_err() || temporary.path().exists() {
            return Ok(temporary);
        }
    }
}

/// Temporary files are private by default; ours become results to be kept, so they take the
/// permissions any new file gets.
fn builder() -> tempfile::Builder<'static, 'static> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(UNFINISHED[0]).suffix(UNFINISHED[1]);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    builder
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entries(folder: &Path) -> usize {
        fs::read_dir(folder).unwrap().count()
    }

    #[test]
    fn a_file_appears_whole_and_alone() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        write_atomically(&path, |out| out.write_all(b"whole")).unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"whole");
        assert_eq!(entries(folder.path()), 1);
    }

    #[test]
    fn a_failed_write_leaves_the_old_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        fs::write(&path, "old").unwrap();
        let error = write_atomically(&path, |out| {
            out.write_all(b"half")?;
            Err(io::Error::other("no more paper"))
        })
        .unwrap_err();
        assert!(error.to_string().ends_with("a.txt: no more paper"), "{error}");
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(entries(folder.path()), 1);
    }

    #[test]
    fn what_the_dead_have_left_goes_and_what_the_living_write_stays() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        let of_others = ["notes.part", ".macropulse-notes", "scan-000000.pcd"];
        for name in of_others.iter().chain(&[".macropulse-a1B2c3.part"]) {
            fs::write(path(name), "half").unwrap();
        }
        let mut living = WholeFile::create(&path("whole.txt")).unwrap();
        clear_unfinished(folder.path());
        assert!(!path(".macropulse-a1B2c3.part").exists());
        assert!(of_others.iter().all(|name| path(name).exists()));
        assert_eq!(entries(folder.path()), of_others.len() + 1);
        living.write_all(b"whole").unwrap();
        living.keep().unwrap();
        assert_eq!(fs::read(path("whole.txt")).unwrap(), b"whole");
        clear_unfinished(&path("no-such-folder"));
    }

    #[cfg(unix)]
    #[test]
    fn typed_name_follows_links_and_derived_name_replaces_them() {
        use std::os::unix::fs::symlink;
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        fs::write(path("kept"), "old").unwrap();
        for link in ["typed", "derived", "grows"] {
            symlink("kept", path(link)).unwrap();
        }
        symlink("new", path("dangling")).unwrap();
        symlink("circle", path("circle")).unwrap();
        write_named(&path("typed"), |out| out.write_all(b"typed")).unwrap();
        write_named(&path("dangling"), |out| out.write_all(b"made")).unwrap();
        assert!(path("typed").is_symlink() && path("dangling").is_symlink());
        assert_eq!(fs::read(path("kept")).unwrap(), b"typed");
        assert_eq!(fs::read(path("new")).unwrap(), b"made");
        write_atomically(&path("derived"), |out| out.write_all(b"derived")).unwrap();
        growing(&path("grows")).unwrap().write_all(b"grown").unwrap();
        assert!(!path("derived").is_symlink() && !path("grows").is_symlink());
        assert_eq!(fs::read(path("kept")).unwrap(), b"typed");
        let told = write_named(&path("circle"), |_| Ok(())).unwrap_err().to_string();
        assert!(told.ends_with("its links lead to each other"), "{told}");
    }

    #[cfg(unix)]
    #[test]
    fn device_is_written_into_by_its_typed_name_alone() {
        let folder = tempfile::tempdir().unwrap();
        let link = folder.path().join("null");
        std::os::unix::fs::symlink("/dev/null", &link).unwrap();
        for path in [Path::new("/dev/null"), &link] {
            write_named(path, |out| out.write_all(b"lost")).unwrap();
        }
        assert!(link.is_symlink() && !Path::new("/dev/null").is_file());
        let told = write_atomically(Path::new("/dev/null"), |_| Ok(())).unwrap_err().to_string();
        assert!(told.contains("a device"), "{told}");
        let full = write_named(Path::new("/dev/full"), |out| out.write_all(b"x")).unwrap_err();
        assert!(full.to_string().contains("the disk is full"), "{full}");
    }

    #[test]
    fn a_folder_that_is_not_there_is_one_sentence() {
        let path = Path::new("no-such-folder/a.txt");
        let error = write_atomically(path, |_| Ok(())).unwrap_err();
        assert_eq!(
            error.to_string(),
            "cannot write no-such-folder/a.txt: there is no such file or folder"
        );
    }

    #[cfg(unix)]
    #[test]
    fn results_are_as_readable_as_any_new_file() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let [ours, plain] = ["ours", "plain"].map(|name| folder.path().join(name));
        write_atomically(&ours, |_| Ok(())).unwrap();
        fs::write(&plain, "").unwrap();
        let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode();
        assert_eq!(mode(&ours), mode(&plain));
    }
}

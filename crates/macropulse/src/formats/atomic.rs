//! Whole files or none.

use super::Error;
use std::fs::{self, File};
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

/// How files are called that are not whole yet: this, then letters drawn at random, then that.
const UNFINISHED: [&str; 2] = [".macropulse-", ".part"];

/// A file that is not there before it is kept, for one that is written bit by bit; see
/// [`write_atomically`].
#[derive(Debug)]
pub struct WholeFile {
    path: PathBuf,
    out: BufWriter<NamedTempFile>,
}

impl WholeFile {
    /// Begins a file.
    ///
    /// # Errors
    /// [`Error::Write`] if its folder cannot be written to.
    pub fn create(path: &Path) -> Result<Self, Error> {
        let temporary = locked(named(path.parent().unwrap_or(Path::new(""))));
        let temporary = temporary.map_err(|cause| Error::write(path, cause))?;
        Ok(Self { path: path.to_owned(), out: BufWriter::with_capacity(1 << 16, temporary) })
    }

    /// Gives the file, which is whole now, its name.
    ///
    /// # Errors
    /// [`Error::Write`] with its path and the cause; the temporary file is gone then.
    pub fn keep(self) -> Result<(), Error> {
        let Self { path, out } = self;
        let temporary = out.into_inner().map_err(io::IntoInnerError::into_error);
        let kept = temporary.and_then(|temporary| temporary.persist(&path).map_err(|e| e.error));
        kept.map(|_| ()).map_err(|cause| Error::write(&path, cause))
    }

    /// What went wrong while it was written, with its path.
    pub fn failed(&self, cause: io::Error) -> Error {
        Error::write(&self.path, cause)
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
/// looks at `path` sees the old file or the new one, never half of it, also after Ctrl-C.
///
/// # Errors
/// [`Error::Write`] with `path` and the cause; the temporary file is gone then.
pub fn write_atomically(
    path: &Path,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), Error> {
    let mut file = WholeFile::create(path)?;
    write(&mut file.out).map_err(|cause| file.failed(cause))?;
    file.keep()
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

//! Whole files or none.

use super::Error;
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

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
        // A bare file name has an empty parent, which is the current folder.
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
        let temporary = builder().tempfile_in(folder.unwrap_or(Path::new(".")));
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

/// Temporary files are private by default; ours become results to be kept, so they take the
/// permissions any new file gets.
fn builder() -> tempfile::Builder<'static, 'static> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".macropulse-").suffix(".part");
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
    use std::fs;

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

//! A folder that is not left half filled.

use std::ffi::OsStr;
use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};
use std::{fs, io};

use macropulse::formats::{Format, clear_unfinished};
use macropulse::told;

use crate::fault::Fault;
use crate::input::STREAM;

/// Endings of files, beside those of point clouds.
const OF_FILES: [&str; 7] = ["html", "json", "toml", "svg", "txt", "mps", "mpt"];

/// A folder for results. Until it is kept, what we made of it goes away again.
pub struct Folder {
    path: PathBuf,
    /// The folders that were not there before, the topmost first; it may be the last of them.
    made: Vec<PathBuf>,
    kept: bool,
    /// Whether no other run may write into it meanwhile, and what holds that.
    is_of_one: bool,
    lock: Option<File>,
}

impl Folder {
    /// A folder that is proven to be writable. Nothing of it is there yet that was not before, and no
    /// longer what runs have left that were killed while they wrote.
    pub fn claim(path: &Path) -> Result<Self, Fault> {
        refuse_no_folder(path)?;
        let path = path.to_owned();
        let folder = Self { path, made: vec![], kept: false, is_of_one: false, lock: None };
        let ancestors = folder.path.ancestors();
        let there = ancestors.map(or_here).find(|folder| folder.exists());
        let proof = format!(".macropulse-proof-{}", std::process::id());
        let proof = there.unwrap_or(Path::new(".")).join(proof);
        fs::write(&proof, "")
            .and_then(|()| fs::remove_file(&proof))
            .and_then(|()| match fs::metadata(&folder.path) {
                Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
                _ => Ok(()),
            })
            .map_err(|error| folder.not_writable(&error))?;
        clear_unfinished(&folder.path);
        Ok(folder)
    }

    /// As [`Folder::claim`], of a run whose files no other one may write meanwhile.
    pub fn claim_alone(path: &Path) -> Result<Self, Fault> {
        let mut folder = Self::claim(path)?;
        folder.is_of_one = true;
        folder.lock()?;
        Ok(folder)
    }

    /// Makes the folder.
    pub fn make(&mut self) -> Result<(), Fault> {
        let ancestors = self.path.ancestors().filter(|folder| !folder.as_os_str().is_empty());
        let missing: Vec<PathBuf> =
            ancestors.take_while(|folder| !folder.exists()).map(Path::to_path_buf).collect();
        for folder in missing.into_iter().rev() {
            match fs::create_dir(&folder) {
                Ok(()) => self.made.push(folder),
                // Another run was faster, and it is that one's.
                Err(_) if folder.is_dir() => {}
                Err(error) => return Err(self.not_writable(&error)),
            }
        }
        fs::create_dir_all(&self.path).map_err(|error| self.not_writable(&error))?;
        self.lock()
    }

    /// Keeps other runs out of a folder that is for one, if it is there already. Where the system
    /// knows no locks on folders none is kept out.
    fn lock(&mut self) -> Result<(), Fault> {
        if !self.is_of_one || self.lock.is_some() {
            return Ok(());
        }
        let Ok(opened) = File::open(&self.path) else { return Ok(()) };
        match opened.try_lock() {
            Err(TryLockError::WouldBlock) => {
                // It is the other one's, whoever made it.
                self.made.clear();
                Err(Fault::Wrong(format!(
                    "another run is writing into the folder {}; give this one a folder of its own \
                     with -o",
                    self.path.display()
                )))
            }
            Err(TryLockError::Error(_)) => Ok(()),
            Ok(()) => {
                self.lock = Some(opened);
                Ok(())
            }
        }
    }

    /// Makes the folder, if that was not done before.
    pub fn make_once(&mut self) -> Result<(), Fault> {
        if self.kept || !self.made.is_empty() { Ok(()) } else { self.make() }
    }

    /// From now on the folder stays, whatever happens.
    pub fn keep(&mut self) {
        self.kept = true;
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Names of what lies in the folder from an older run: files named like those of scans and not
    /// among `files`.
    fn older(&self, files: &[String]) -> Vec<String> {
        let entries = fs::read_dir(&self.path).into_iter().flatten().flatten();
        let names = entries.filter_map(|entry| entry.file_name().into_string().ok());
        let mut older: Vec<String> =
            names.filter(|name| is_of_scan(name) && !files.contains(name)).collect();
        older.sort();
        older
    }

    /// What is to be said of an older run in the folder, if there is one, by the `files` of this one.
    pub fn warning_of_older(&self, files: &[String]) -> Option<String> {
        let older = self.older(files);
        let (folder, count) = (self.path.display(), older.len());
        let others = if count == 1 { "is" } else { "and others like it are" };
        older.first().map(|first| {
            format!(
                "{folder}/{first} {others} of an older run ({count} in all), and not in the \
                 manifest: remove what is older, or write into a folder of its own"
            )
        })
    }

    /// Takes away what was not there before: what is in the folder only where it is for one run and
    /// so no other's, and of the folders those that are empty.
    fn clear(&mut self) {
        // If something cannot go, it stays.
        if self.lock.is_some() && self.made.last() == Some(&self.path) {
            let _ = fs::remove_dir_all(&self.path);
        }
        for folder in self.made.drain(..).rev() {
            let _ = fs::remove_dir(folder);
        }
    }

    fn not_writable(&self, error: &io::Error) -> Fault {
        let (path, reason) = (self.path.display(), told::unwritable(error));
        let sentence =
            format!("cannot write into the folder {path}: {reason}; choose another one with -o");
        Fault::unwritten(sentence, error)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        if !self.kept {
            self.clear();
        }
    }
}

/// The folder that a path names, of which an empty one is where we are.
fn or_here(path: &Path) -> &Path {
    if path.as_os_str().is_empty() { Path::new(".") } else { path }
}

/// Refuses what is no place of a folder: standard output, and the name of a file that is not there.
pub fn refuse_no_folder(path: &Path) -> Result<(), Fault> {
    if path == Path::new(STREAM) {
        return Err(Fault::Wrong(
            "-o -: standard output takes one stream, and these are files: name a folder for them"
                .to_owned(),
        ));
    }
    let ending = path.extension().and_then(OsStr::to_str).unwrap_or_default();
    let is_of_file = Format::of_extension(ending).is_some() || OF_FILES.contains(&ending);
    if path.exists() || !is_of_file {
        return Ok(());
    }
    let (path, folder) = (path.display(), path.with_extension(""));
    Err(Fault::Wrong(format!(
        "-o {path}: ends as a file does, and these are several, in a folder: say -o {}",
        folder.display()
    )))
}

/// Whether a file is named as that of a scan: a word, a hyphen, a number of at least six digits.
fn is_of_scan(name: &str) -> bool {
    let word = ["scan-", "range-", "shots-", "ticks-"].iter().find_map(|w| name.strip_prefix(w));
    word.is_some_and(|rest| rest.bytes().take_while(u8::is_ascii_digit).count() >= 6)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_goes_away_with_those_made_for_it_unless_it_is_kept() {
        let there = tempfile::tempdir().unwrap();
        let wanted = there.path().join("a/b");
        let mut folder = Folder::claim(&wanted).unwrap();
        assert!(!there.path().join("a").exists());
        folder.make().unwrap();
        assert!(wanted.is_dir());
        drop(folder);
        assert!(!there.path().join("a").exists());
        let mut folder = Folder::claim(&wanted).unwrap();
        folder.make().unwrap();
        folder.keep();
        drop(folder);
        assert!(wanted.is_dir());
    }

    #[test]
    fn what_another_run_puts_beside_it_stays() {
        let there = tempfile::tempdir().unwrap();
        let mut alone = Folder::claim_alone(&there.path().join("a/b")).unwrap();
        alone.make().unwrap();
        fs::write(there.path().join("a/b/half"), "").unwrap();
        fs::write(there.path().join("a/others"), "").unwrap();
        drop(alone);
        assert!(there.path().join("a/others").exists());
        assert!(!there.path().join("a/b").exists());
        // Files of several conversions may go into one folder at once.
        let mut shared = Folder::claim(&there.path().join("c/d")).unwrap();
        shared.make().unwrap();
        fs::write(there.path().join("c/d/others"), "").unwrap();
        drop(shared);
        assert!(there.path().join("c/d/others").exists());
    }

    #[test]
    fn scans_of_an_older_run_are_told_from_what_belongs_to_others() {
        let there = tempfile::tempdir().unwrap();
        let names = ["scan-000000.pcd", "scan-000007.pcd", "range-000007-colour.png", "scan-1.pcd"];
        for name in names.iter().chain(&["notes.txt", "scan.pcd"]) {
            fs::write(there.path().join(name), "").unwrap();
        }
        let folder = Folder::claim(there.path()).unwrap();
        let older = folder.older(&["scan-000000.pcd".to_owned()]);
        assert_eq!(older, ["range-000007-colour.png", "scan-000007.pcd"]);
    }

    #[test]
    fn what_was_there_before_stays() {
        let there = tempfile::tempdir().unwrap();
        let mut folder = Folder::claim(there.path()).unwrap();
        folder.make().unwrap();
        drop(folder);
        assert!(there.path().is_dir());
    }

    #[test]
    fn a_file_in_the_way_is_one_sentence() {
        let there = tempfile::tempdir().unwrap();
        let file = there.path().join("file");
        fs::write(&file, "").unwrap();
        let Err(Fault::Wrong(sentence)) = Folder::claim(&file.join("below")) else {
            panic!("accepted");
        };
        assert!(sentence.contains("a file is in the way; choose another one"), "{sentence}");
    }
}

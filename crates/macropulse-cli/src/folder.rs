//! Folders for results: they are not left half filled, and files that are already there are checked first.

use std::ffi::OsStr;
use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};
use std::{fs, io};

use macropulse::formats::{Format, Own, clear_unfinished, is_of_scan, prove_writable};
use macropulse::{opened, told};

use crate::fault::Fault;
use crate::input::STREAM;

/// Endings of files, beside those of point clouds.
const OF_FILES: [&str; 7] = ["html", "json", "toml", "svg", "txt", "mps", "mpt"];

/// Remedy to name where a file is in the way.
const ELSEWHERE: &str = "choose another folder with -o";

/// The files that a command writes into its folder, under names that it derives.
///
/// Such a name replaces only a file that Macropulse is known to have written, or with `--replace` any other
/// one. It never replaces an input of the same run, a link, a folder or a device.
pub struct Outputs {
    /// True for the path, within the folder, of a file that the run writes.
    is_written: Box<dyn Fn(&Path) -> bool>,
    /// Paths of folders in the folder.
    folders: Vec<PathBuf>,
    inputs: Vec<PathBuf>,
    /// True if `--replace` was given; `None` if a command has no such option.
    replace: Option<bool>,
    /// How to write elsewhere.
    remedy: &'static str,
}

impl Outputs {
    /// Those whose path in the folder `is_written`.
    pub fn of(is_written: impl Fn(&Path) -> bool + 'static) -> Self {
        let is_written = Box::new(is_written);
        let (folders, inputs) = (Vec::new(), Vec::new());
        Self { is_written, folders, inputs, replace: None, remedy: ELSEWHERE }
    }

    /// Those of these names.
    pub fn named(names: impl IntoIterator<Item = impl Into<PathBuf>>) -> Self {
        let names: Vec<PathBuf> = names.into_iter().map(Into::into).collect();
        Self::of(move |path| names.iter().any(|name| name == path))
    }

    /// Those of these names, and those that `of_scan` gives for the number of a scan.
    pub fn of_scans(
        fixed: impl IntoIterator<Item = &'static str>,
        of_scan: impl Fn(u64) -> Vec<String> + 'static,
    ) -> Self {
        let fixed: Vec<&str> = fixed.into_iter().collect();
        Self::of(move |path| {
            let name = path.to_str().unwrap_or_default();
            let digits: String = name
                .chars()
                .skip_while(|sign| !sign.is_ascii_digit())
                .take_while(char::is_ascii_digit)
                .collect();
            let is_of_scan = || of_scan(digits.parse().unwrap_or(0)).iter().any(|one| one == name);
            fixed.contains(&name) || is_of_scan()
        })
    }

    /// The same, some of them in these folders of the folder.
    pub fn within(self, folders: impl IntoIterator<Item = impl Into<PathBuf>>) -> Self {
        Self { folders: folders.into_iter().map(Into::into).collect(), ..self }
    }

    /// The same of a command that reads `inputs`.
    pub fn beside(self, inputs: &[impl AsRef<Path>]) -> Self {
        let inputs = inputs.iter().map(|input| input.as_ref().to_owned()).collect();
        Self { inputs, ..self }
    }

    /// The same of a command that has an option `--replace`, by which files that are not known as ours are
    /// replaced, too.
    pub fn replacing(self, replace: bool) -> Self {
        Self { replace: Some(replace), ..self }
    }

    /// The same of a command that writes elsewhere by another `remedy`.
    pub fn or(self, remedy: &'static str) -> Self {
        Self { remedy, ..self }
    }

    /// Paths in `folder` that are there and are to be written; a folder before what it holds.
    fn found(&self, folder: &Path) -> Vec<PathBuf> {
        let mut found = Vec::new();
        let mut folders = vec![PathBuf::new()];
        while let Some(inner) = folders.pop() {
            let entries = fs::read_dir(or_here(&folder.join(&inner))).into_iter().flatten();
            let paths = entries.flatten().map(|entry| inner.join(entry.file_name()));
            for path in paths {
                let is_within = self.folders.contains(&path);
                if is_within && is_folder(&folder.join(&path)) {
                    folders.push(path.clone());
                }
                if is_within || (self.is_written)(&path) {
                    found.push(path);
                }
            }
        }
        found.sort();
        found
    }

    /// Refuses what stands in `folder` and is not to be replaced.
    pub fn check(&self, folder: &Path) -> Result<(), Fault> {
        let mut own: Option<(PathBuf, Own)> = None;
        for path in self.found(folder) {
            let is_within = self.folders.contains(&path);
            let path = folder.join(path);
            if is_within && is_folder(&path) {
                continue;
            }
            let within = path.parent().unwrap_or(Path::new(""));
            if own.as_ref().is_none_or(|(known, _)| known != within) {
                own = Some((within.to_owned(), Own::of(or_here(within))));
            }
            let is_own = own.as_ref().is_some_and(|(_, own)| own.has(&path));
            if let Some(reason) = self.reason(&path, is_own) {
                return Err(Fault::Wrong(format!("{}: {reason}", path.display())));
            }
        }
        Ok(())
    }

    /// Why what stands at `path` is not to be replaced, and what to do.
    fn reason(&self, path: &Path, is_own: bool) -> Option<String> {
        let about = fs::symlink_metadata(path).ok()?;
        let remedy = self.remedy;
        let wanted = "and a file of this name is to be written";
        if self.inputs.iter().any(|input| opened::is_same(input, path)) {
            return Some(format!("is to be read and written; {remedy}"));
        }
        if about.is_symlink() {
            return Some(format!("is a link, {wanted}; remove it, or {remedy}"));
        }
        if !about.is_file() {
            let kind = if about.is_dir() { "folder" } else { "device, a pipe or a socket" };
            return Some(format!("is a {kind}, {wanted}; {remedy}"));
        }
        if is_own || self.replace == Some(true) {
            return None;
        }
        let option = self.replace.map_or("", |_| ", or say --replace");
        Some(format!(
            "is there already, and not known to be written by macropulse; move it away, or {remedy}{option}"
        ))
    }
}

fn is_folder(path: &Path) -> bool {
    path.symlink_metadata().is_ok_and(|about| about.is_dir())
}

/// Refuses a file named by a user that is one of the `inputs`, or that nothing can be written to. Any other
/// file is replaced, and a device or a pipe is written into.
pub fn check_file(path: &Path, inputs: &[impl AsRef<Path>]) -> Result<(), Fault> {
    let refused = |reason: &str| Err(Fault::Wrong(format!("{}: {reason}", path.display())));
    if inputs.iter().any(|input| opened::is_same(input.as_ref(), path)) {
        return refused("is to be read and written; choose another name");
    }
    match path.is_dir() {
        true => refused("is a folder, where the name of a file is wanted"),
        false => Ok(()),
    }
}

/// A folder for results. Until it is kept, what we made of it goes away again.
pub struct Folder {
    path: PathBuf,
    outputs: Outputs,
    /// The folders that were not there before, the topmost first; it may be the last of them.
    made: Vec<PathBuf>,
    kept: bool,
    /// True if no other run may write into it meanwhile, and the lock for that.
    is_of_one: bool,
    lock: Option<File>,
}

impl Folder {
    /// A folder that is proven to be writable, and free for `outputs`. Nothing of it is there yet that was
    /// not before, and no longer what runs have left that were killed while they wrote.
    pub fn claim(path: &Path, outputs: Outputs) -> Result<Self, Fault> {
        refuse_no_folder(path)?;
        let path = path.to_owned();
        let folder =
            Self { path, outputs, made: vec![], kept: false, is_of_one: false, lock: None };
        let mut ancestors = folder.path.ancestors().map(or_here);
        let there = ancestors.find(|folder| folder.exists()).unwrap_or(Path::new("."));
        // A run may be killed while it proves that its folder can be made.
        clear_unfinished(there);
        prove_writable(there)
            .and_then(|()| match fs::metadata(&folder.path) {
                Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
                _ => Ok(()),
            })
            .map_err(|error| folder.not_writable(&error))?;
        folder.outputs.check(&folder.path)?;
        Ok(folder)
    }

    /// As [`Folder::claim`], of a run whose files no other one may write meanwhile.
    pub fn claim_alone(path: &Path, outputs: Outputs) -> Result<Self, Fault> {
        let mut folder = Self::claim(path, outputs)?;
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

    /// Keeps other runs out of a folder that is for one, if it is there already. If the system knows no locks
    /// on folders, none is kept out.
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

    /// Returns a warning of files of an older run in the folder, if there are any beside the `files` of this
    /// one.
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

    /// Takes away what was not there before: of a folder that is for one run its files, and every folder
    /// that is empty then. Files that somebody else put there meanwhile stay.
    fn clear(&mut self) {
        // If something cannot go, it stays.
        if self.lock.is_some() && self.made.last() == Some(&self.path) {
            for path in self.outputs.found(&self.path).into_iter().rev() {
                let path = self.path.join(path);
                let _ = if is_folder(&path) { fs::remove_dir(path) } else { fs::remove_file(path) };
            }
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

/// Returns the folder that a path names: the current one for an empty path.
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

#[cfg(test)]
mod tests {
    use super::*;

    fn outputs() -> Outputs {
        Outputs::named(["half", "trial/half"]).within(["trial"])
    }

    #[test]
    fn a_folder_goes_away_with_those_made_for_it_unless_it_is_kept() {
        let there = tempfile::tempdir().unwrap();
        let wanted = there.path().join("a/b");
        let mut folder = Folder::claim(&wanted, outputs()).unwrap();
        assert!(!there.path().join("a").exists());
        folder.make().unwrap();
        assert!(wanted.is_dir());
        drop(folder);
        assert!(!there.path().join("a").exists());
        let mut folder = Folder::claim(&wanted, outputs()).unwrap();
        folder.make().unwrap();
        folder.keep();
        drop(folder);
        assert!(wanted.is_dir());
    }

    #[test]
    fn what_another_run_puts_beside_it_stays() {
        let there = tempfile::tempdir().unwrap();
        let mut alone = Folder::claim_alone(&there.path().join("a/b"), outputs()).unwrap();
        alone.make().unwrap();
        fs::write(there.path().join("a/b/half"), "").unwrap();
        fs::write(there.path().join("a/others"), "").unwrap();
        drop(alone);
        assert!(there.path().join("a/others").exists());
        assert!(!there.path().join("a/b").exists());
        // Files of several conversions may go into one folder at once.
        let mut shared = Folder::claim(&there.path().join("c/d"), outputs()).unwrap();
        shared.make().unwrap();
        fs::write(there.path().join("c/d/others"), "").unwrap();
        drop(shared);
        assert!(there.path().join("c/d/others").exists());
    }

    #[test]
    fn what_a_user_puts_into_a_new_folder_outlives_the_run() {
        let there = tempfile::tempdir().unwrap();
        let path = there.path().join("a");
        let mut alone = Folder::claim_alone(&path, outputs()).unwrap();
        alone.make().unwrap();
        fs::create_dir(path.join("trial")).unwrap();
        for name in ["half", "trial/half", "notes.txt"] {
            fs::write(path.join(name), "").unwrap();
        }
        drop(alone);
        let left: Vec<_> =
            fs::read_dir(&path).unwrap().map(|one| one.unwrap().file_name()).collect();
        assert_eq!(left, ["notes.txt"]);
    }

    #[test]
    fn derived_name_replaces_nothing_of_others() {
        let there = tempfile::tempdir().unwrap();
        let path = there.path().join("half");
        let refused = |outputs: Outputs| match Folder::claim(there.path(), outputs) {
            Err(Fault::Wrong(sentence)) => sentence,
            _ => String::new(),
        };
        assert_eq!(refused(outputs()), "");
        fs::write(&path, "mine").unwrap();
        assert!(refused(outputs()).contains("not known to be written by macropulse"));
        assert_eq!(refused(outputs().replacing(true)), "");
        let told = refused(outputs().beside(&[&path]).replacing(true));
        assert!(told.contains("is to be read and written"), "{told}");
        fs::remove_file(&path).unwrap();
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink("/dev/null", &path).unwrap();
            assert!(refused(outputs().replacing(true)).contains("is a link"));
        }
    }

    #[test]
    fn scans_of_an_older_run_are_told_from_what_belongs_to_others() {
        let there = tempfile::tempdir().unwrap();
        let names = ["scan-000000.pcd", "scan-000007.pcd", "range-000007-colour.png", "scan-1.pcd"];
        for name in names.iter().chain(&["notes.txt", "scan.pcd"]) {
            fs::write(there.path().join(name), "").unwrap();
        }
        let folder = Folder::claim(there.path(), outputs()).unwrap();
        let older = folder.older(&["scan-000000.pcd".to_owned()]);
        assert_eq!(older, ["range-000007-colour.png", "scan-000007.pcd"]);
    }

    #[test]
    fn what_was_there_before_stays() {
        let there = tempfile::tempdir().unwrap();
        let mut folder = Folder::claim(there.path(), outputs()).unwrap();
        folder.make().unwrap();
        drop(folder);
        assert!(there.path().is_dir());
    }

    #[test]
    fn a_file_in_the_way_is_one_sentence() {
        let there = tempfile::tempdir().unwrap();
        let file = there.path().join("file");
        fs::write(&file, "").unwrap();
        let Err(Fault::Wrong(sentence)) = Folder::claim(&file.join("below"), outputs()) else {
            panic!("accepted");
        };
        assert!(sentence.contains("a file is in the way; choose another one"), "{sentence}");
    }
}

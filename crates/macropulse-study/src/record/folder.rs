//! The files that a run has left in a folder, and which of them hold the clouds.

use std::fs;
use std::path::{Component, Path, PathBuf};

use macropulse::formats::{Clouds, LeftOut, Names, Reading};
use macropulse::opened;
use macropulse::points::PointCloud;
use serde_json::Value;

use super::{Error, MANIFEST};

/// Endings of the files in a folder that hold clouds, the one that keeps most first. Files with one of the
/// last endings may hold anything, so their names must begin like that of a scan.
const ENDINGS: [&str; 9] = ["pcd", "ply", "las", "laz", "e57", "mcap", "npy", "csv", "bin"];

/// Number of the endings that belong to clouds alone.
const OF_CLOUDS: usize = 6;

/// A folder that a run has left, or any other with clouds.
#[derive(Debug, Clone)]
pub struct Left {
    /// Its manifest, if it has one and the run came to its end.
    pub manifest: Option<Value>,
    /// True if its manifest says that a run is still under way, or was killed.
    pub is_unfinished: bool,
    /// Names of its files: those of the manifest, or else all that may hold clouds.
    pub files: Vec<String>,
    /// Names that lead out of the folder, by their path or by a link; they are not followed.
    pub outside: Vec<String>,
}

impl Left {
    /// Reads the contents of `folder`.
    ///
    /// # Errors
    /// [`Error::Unreadable`] if it cannot be listed, [`Error::Manifest`] if its manifest is none.
    pub fn of(folder: &Path) -> Result<Self, Error> {
        let is_running = |manifest: &Value| manifest["state"] == "running";
        let manifest = manifest(folder)?;
        let is_unfinished = manifest.as_ref().is_some_and(is_running);
        let manifest = manifest.filter(|manifest| !is_running(manifest));
        let files = match &manifest {
            Some(manifest) => named(&manifest["files"]),
            None => listed(folder)?,
        };
        let (files, outside) = files.into_iter().partition(|file| is_inside(folder, file));
        Ok(Self { manifest, is_unfinished, files, outside })
    }

    /// Returns the names of the files with its clouds. If several files with different endings hold one
    /// cloud, the one that keeps most is taken. Files with all scans of a run are taken only if no other file
    /// holds clouds.
    pub fn clouds(&self) -> Vec<&String> {
        let mut chosen: Vec<(usize, &String)> = Vec::new();
        for file in &self.files {
            let Some(rank) = rank(file) else { continue };
            let cloud = cloud_of(file);
            match chosen.iter_mut().find(|(_, other)| cloud_of(other) == cloud) {
                Some(other) if rank < other.0 => *other = (rank, file),
                Some(_) => {}
                None => chosen.push((rank, file)),
            }
        }
        let is_of_run = |file: &String| file.to_lowercase().ends_with(".mcap");
        let has_others = chosen.iter().any(|(_, file)| !is_of_run(file));
        chosen.retain(|(_, file)| !has_others || !is_of_run(file));
        // If a run is stored in several kinds of messages, keep the first file: the kind that we read sorts
        // before the rest.
        chosen.dedup_by(|(_, one), (_, other)| is_of_run(one) && is_of_run(other));
        chosen.into_iter().map(|(_, file)| file).collect()
    }
}

/// Returns the part of the name that the files of one cloud share: without the ending, and without the suffix
/// that tells two files of the same ending apart.
fn cloud_of(file: &str) -> String {
    let stem = Path::new(file).with_extension("");
    let stem = stem.to_string_lossy();
    stem.strip_suffix("-cloudcompare").unwrap_or(&stem).to_owned()
}

/// The place of a file of a folder among [`ENDINGS`], if it may hold a cloud.
fn rank(name: &str) -> Option<usize> {
    let ending = Path::new(name).extension()?.to_str()?.to_lowercase();
    let rank = ENDINGS.iter().position(|known| *known == ending)?;
    (rank < OF_CLOUDS || name.starts_with("scan-")).then_some(rank)
}

fn manifest(folder: &Path) -> Result<Option<Value>, Error> {
    let path = folder.join(MANIFEST);
    if !path.exists() || !is_inside(folder, MANIFEST) {
        return Ok(None);
    }
    let text = opened::text(&path).map_err(|cause| unreadable(&path, cause))?;
    let manifest = serde_json::from_str(&text);
    manifest.map(Some).map_err(|cause| Error::Manifest { path, cause })
}

/// Returns true if the path `name` in `folder` does not lead out of it. A name without a file leads nowhere
/// else.
fn is_inside(folder: &Path, name: &str) -> bool {
    let is_below = Path::new(name).components().all(|part| matches!(part, Component::Normal(_)));
    let leads_out = || match (folder.canonicalize(), folder.join(name).canonicalize()) {
        (Ok(folder), Ok(file)) => !file.starts_with(folder),
        _ => false,
    };
    is_below && !leads_out()
}

fn named(list: &Value) -> Vec<String> {
    let names = list.as_array().into_iter().flatten();
    names.filter_map(Value::as_str).map(str::to_owned).collect()
}

/// Names of the clouds in a folder without a manifest.
fn listed(folder: &Path) -> Result<Vec<String>, Error> {
    let unreadable = |cause| unreadable(folder, cause);
    let mut names = Vec::new();
    for entry in fs::read_dir(folder).map_err(unreadable)? {
        let name = entry.map_err(unreadable)?.file_name().to_string_lossy().into_owned();
        if rank(&name).is_some() {
            names.push(name);
        }
    }
    names.sort();
    Ok(names)
}

fn unreadable(path: &Path, cause: std::io::Error) -> Error {
    Error::Unreadable { path: path.to_owned(), cause }
}

/// The clouds of a file, or of all files of a folder, one after the other. One of them is in memory at a
/// time.
pub struct CloudsAt {
    /// Files that are still to be opened, the next one last.
    left: Vec<PathBuf>,
    open: Option<Clouds>,
    reading: Reading,
}

impl CloudsAt {
    /// The clouds at `path`, a file or a folder, each file read as `reading` says.
    ///
    /// # Errors
    /// If it cannot be read, or is a folder that holds none.
    pub fn open(path: &Path, reading: Reading) -> Result<Self, Error> {
        if !path.is_dir() {
            let open = Some(Clouds::open_with(path, &reading)?);
            return Ok(Self { left: Vec::new(), open, reading });
        }
        let left = Left::of(path)?;
        let mut files: Vec<PathBuf> = left.clouds().iter().map(|file| path.join(file)).collect();
        if files.is_empty() {
            return Err(Error::NoCloud { folder: path.to_owned() });
        }
        files.reverse();
        Ok(Self { left: files, open: None, reading })
    }

    /// Returns the contents of the file read last that are not in its clouds.
    pub fn left_out(&self) -> Option<&LeftOut> {
        self.open.as_ref().map(Clouds::left_out)
    }

    /// Returns the next cloud, with the names that belong to its numbers.
    ///
    /// # Errors
    /// If its file cannot be read.
    pub fn next_cloud(&mut self) -> Result<Option<(PointCloud, Names<'_>)>, Error> {
        let mut next = self.open.as_mut().and_then(Iterator::next);
        while next.is_none() {
            let Some(path) = self.left.pop() else { return Ok(None) };
            let clouds = Clouds::open_with(&path, &self.reading)?;
            next = self.open.insert(clouds).next();
        }
        let cloud = next.transpose()?;
        Ok(cloud.zip(self.open.as_ref().map(Clouds::names)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use macropulse::formats::{Format, write_cloud};

    fn clouds(files: &[&str]) -> Vec<String> {
        let files = files.iter().map(|file| (*file).to_owned()).collect();
        let left = Left { manifest: None, is_unfinished: false, files, outside: Vec::new() };
        left.clouds().into_iter().cloned().collect()
    }

    #[test]
    fn each_cloud_is_taken_once() {
        let files = ["scan-0.pcd", "range-0.png", "scan-1.PCD", "scan-0.csv"];
        assert_eq!(clouds(&files), ["scan-0.pcd", "scan-1.PCD"]);
        let files = ["range-0.npy", "scan-0.npy", "scans.mcap", "shots-0.csv"];
        assert_eq!(clouds(&files), ["scan-0.npy"]);
        assert_eq!(clouds(&files[2..]), ["scans.mcap"]);
        let files = ["scan-0.ply", "scan-0-cloudcompare.ply", "scan-1-cloudcompare.ply"];
        assert_eq!(clouds(&files), ["scan-0.ply", "scan-1-cloudcompare.ply"]);
    }

    #[cfg(unix)]
    #[test]
    fn nothing_outside_the_folder_is_followed() {
        let desk = tempfile::tempdir().unwrap();
        let folder = desk.path().join("out");
        fs::create_dir(&folder).unwrap();
        let link = |to: &str, name: &str| {
            std::os::unix::fs::symlink(to, folder.join(name)).unwrap();
        };
        fs::write(desk.path().join("secret.pcd"), "").unwrap();
        fs::write(folder.join("scan-000000.pcd"), "").unwrap();
        link("../secret.pcd", "scan-000001.pcd");
        link("scan-000000.pcd", "scan-000002.pcd");
        let left = Left::of(&folder).unwrap();
        assert_eq!(left.files, ["scan-000000.pcd", "scan-000002.pcd"]);
        assert_eq!(left.outside, ["scan-000001.pcd"]);
        let names = r#"{"files": ["scan-000001.pcd", "../secret.pcd", "/etc/passwd", "a.pcd"]}"#;
        fs::write(folder.join("manifest.json"), names).unwrap();
        let left = Left::of(&folder).unwrap();
        assert_eq!(left.files, ["a.pcd"]);
        assert_eq!(left.outside, ["scan-000001.pcd", "../secret.pcd", "/etc/passwd"]);
        fs::rename(folder.join("manifest.json"), desk.path().join("manifest.json")).unwrap();
        link("../manifest.json", "manifest.json");
        assert!(Left::of(&folder).unwrap().manifest.is_none());
    }

    #[test]
    fn the_clouds_of_a_folder_come_one_after_the_other() {
        let folder = tempfile::tempdir().unwrap();
        let named = |scan: u64| folder.path().join(format!("scan-{scan:06}.ply"));
        for scan in [0, 1, 2] {
            let cloud = PointCloud { scan, ..PointCloud::default() };
            write_cloud(Format::Ply, &cloud, &Names::default(), &named(scan)).unwrap();
        }
        let numbers = |path: &Path| -> Result<Vec<u64>, Error> {
            let mut clouds = CloudsAt::open(path, Reading::default())?;
            let mut numbers = Vec::new();
            while let Some((cloud, _)) = clouds.next_cloud()? {
                numbers.push(cloud.scan);
            }
            Ok(numbers)
        };
        assert_eq!(numbers(folder.path()).unwrap(), [0, 1, 2]);
        assert_eq!(numbers(&named(1)).unwrap(), [1]);
        fs::write(folder.path().join("manifest.json"), r#"{"files": ["scan-000002.ply"]}"#)
            .unwrap();
        assert_eq!(numbers(folder.path()).unwrap(), [2]);
        fs::write(folder.path().join("manifest.json"), "[").unwrap();
        let told = numbers(folder.path()).unwrap_err().to_string();
        assert!(told.contains("is not the manifest of a run"), "{told}");
        let told = numbers(tempfile::tempdir().unwrap().path()).unwrap_err().to_string();
        assert!(told.contains("holds no point cloud that can be read"), "{told}");
    }
}

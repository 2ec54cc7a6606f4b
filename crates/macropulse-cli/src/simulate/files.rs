//! What a run leaves on the disk.

use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::{fs, io};

use macropulse::design::Design;
use macropulse::formats::{self, Format, Names, write_atomically, write_cloud};
use macropulse::points::PointCloud;
use macropulse::scene::Scene;
use macropulse::view::{self, Layout, RangePicture};

use crate::fault::Fault;

/// How the names of pictures for people end.
pub const COLOUR: &str = "-colour.png";

/// The formats asked for, each once.
#[derive(Debug, Clone, PartialEq)]
pub struct Formats(pub Vec<Format>);

impl Default for Formats {
    fn default() -> Self {
        Self(vec![Format::Pcd, Format::Png])
    }
}

impl FromStr for Formats {
    type Err = formats::Error;

    /// Names with commas between them; `none` alone is no format at all.
    fn from_str(typed: &str) -> Result<Self, Self::Err> {
        let mut list = Vec::new();
        if typed.trim() != "none" {
            for name in typed.split(',') {
                let format = Format::parse(name)?;
                if !list.contains(&format) {
                    list.push(format);
                }
            }
        }
        Ok(Self(list))
    }
}

/// A folder for results. Until it is kept, what we made of it goes away again.
pub struct Folder {
    path: PathBuf,
    /// The topmost folder that was not there before.
    made: Option<PathBuf>,
    kept: bool,
}

impl Folder {
    /// A folder that is proven to be writable. Nothing of it is there yet that was not before.
    pub fn claim(path: &Path) -> Result<Self, Fault> {
        let mut folder = Self { path: path.to_owned(), made: None, kept: false };
        folder.make()?;
        let proof = path.join(".macropulse-proof");
        fs::write(&proof, "")
            .and_then(|()| fs::remove_file(&proof))
            .map_err(|error| folder.not_writable(&error))?;
        folder.clear();
        Ok(folder)
    }

    /// Makes the folder.
    pub fn make(&mut self) -> Result<(), Fault> {
        let ancestors = self.path.ancestors().filter(|folder| !folder.as_os_str().is_empty());
        let missing = ancestors.take_while(|folder| !folder.exists()).last();
        self.made = missing.map(Path::to_path_buf);
        fs::create_dir_all(&self.path).map_err(|error| self.not_writable(&error))
    }

    /// From now on the folder stays, whatever happens.
    pub fn keep(&mut self) {
        self.kept = true;
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    fn clear(&mut self) {
        if let Some(made) = self.made.take() {
            // It was not there before us. If it cannot go, it stays.
            let _ = fs::remove_dir_all(made);
        }
    }

    fn not_writable(&self, error: &io::Error) -> Fault {
        let (path, reason) = (self.path.display(), reason(error));
        Fault::Wrong(format!(
            "cannot write into the folder {path}: {reason}; choose another one with -o"
        ))
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        if !self.kept {
            self.clear();
        }
    }
}

fn reason(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::NotADirectory | io::ErrorKind::AlreadyExists => {
            "a file is in the way".to_owned()
        }
        io::ErrorKind::PermissionDenied => "permission denied".to_owned(),
        _ => error.to_string(),
    }
}

/// Writes the files of scan number `cloud.scan` into `folder` and gives their names.
pub fn write_scan(
    folder: &Path,
    formats: &[Format],
    cloud: &PointCloud,
    (design, scene): (&Design, &Scene),
) -> Result<Vec<String>, Fault> {
    let objects: Vec<String> = scene.objects.iter().map(|object| object.name.clone()).collect();
    let materials: Vec<String> = scene.materials.iter().map(|m| m.name.clone()).collect();
    let names = Names { objects: &objects, materials: &materials };
    let mut files = Vec::new();
    for &format in formats {
        let kind = if format == Format::Png { "range" } else { "scan" };
        let file = format!("{kind}-{:06}.{}", cloud.scan, format.name());
        write_cloud(format, cloud, &names, &folder.join(&file))?;
        files.push(file);
        // Some grids are too large for a picture; the run says so at its end.
        if format == Format::Png
            && let Ok(picture) = colour_picture(cloud, design)
        {
            let file = format!("{kind}-{:06}{COLOUR}", cloud.scan);
            write_atomically(&folder.join(&file), |out| out.write_all(&picture))?;
            files.push(file);
        }
    }
    Ok(files)
}

/// The range image for people, large enough to see something in.
fn colour_picture(cloud: &PointCloud, design: &Design) -> Result<Vec<u8>, view::Error> {
    let zoom = |pixels: usize, wanted: usize| (wanted / pixels.max(1)).clamp(1, 8);
    let even = zoom(cloud.columns, 1024);
    let mut layout = Layout::new(cloud.rows, cloud.columns);
    layout.zoom = [even, even.max(zoom(cloud.rows, 256))];
    let picture = RangePicture {
        layout,
        range: &cloud.range,
        near: design.scan.min_range as f32,
        far: design.scan.max_range as f32,
    };
    picture.png()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formats_are_listed_with_commas() {
        assert_eq!(Formats::from_str("pcd,PLY,pcd").unwrap().0, [Format::Pcd, Format::Ply]);
        assert!(Formats::from_str("none").unwrap().0.is_empty());
        assert!(Formats::from_str("").is_err());
        assert!(Formats::from_str("pcd,none").is_err());
    }

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

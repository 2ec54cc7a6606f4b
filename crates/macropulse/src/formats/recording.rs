//! The files of a run, written scan by scan.

use super::mcap::Recording as Messages;
use super::{Error, Format, Names, attributes, write_atomically, write_named};
use crate::points::PointCloud;
use std::io::Write;
use std::path::{Path, PathBuf};

/// The files of a run in one folder: those with a scan each, which appear as a whole, and those with
/// all scans, which fill up.
pub struct Recording {
    folder: PathBuf,
    formats: Vec<Format>,
    open: Vec<(Format, Messages)>,
    /// True if a user typed the names of the files.
    is_named: bool,
}

impl Recording {
    /// A run that is to be written to `folder` in `formats`. Nothing is written yet.
    pub fn new(folder: &Path, formats: &[Format]) -> Self {
        Self {
            folder: folder.to_owned(),
            formats: formats.to_vec(),
            open: Vec::new(),
            is_named: false,
        }
    }

    /// The same, with names that a user typed: links are followed, and devices and pipes are written
    /// into, as by [`write_named`].
    pub fn named(self) -> Self {
        Self { is_named: true, ..self }
    }

    /// Writes a scan in all formats, and gives the formats and names of the files that are new.
    ///
    /// # Errors
    /// As [`write_cloud`](super::write_cloud); files written before stay.
    pub fn add(
        &mut self,
        cloud: &PointCloud,
        names: &Names,
    ) -> Result<Vec<(Format, String)>, Error> {
        self.add_as(cloud, names, |format| format.file_name(cloud.scan))
    }

    /// As [`Recording::add`], with another name for the file of a format. If all scans of a run go into one
    /// file, the first name counts.
    ///
    /// # Errors
    /// As [`write_cloud`](super::write_cloud); files written before stay.
    pub fn add_as<N: AsRef<Path>>(
        &mut self,
        cloud: &PointCloud,
        names: &Names,
        name: impl Fn(Format) -> N,
    ) -> Result<Vec<(Format, N)>, Error> {
        attributes::check_even(cloud)?;
        let mut files = Vec::new();
        for &format in &self.formats {
            let file = name(format);
            let path = self.folder.join(&file);
            let Format::Mcap(message) = format else {
                let write = |out: &mut dyn Write| format.writer().write(cloud, names, out);
                match self.is_named {
                    true => write_named(&path, write),
                    false => write_atomically(&path, write),
                }?;
                files.push((format, file));
                continue;
            };
            let at = self.open.iter().position(|(open, _)| *open == format);
            let at = at.unwrap_or(self.open.len());
            if at == self.open.len() {
                self.open.push((format, Messages::begin(message, &path, self.is_named)?));
                files.push((format, file));
            }
            self.open[at].1.add(cloud, names)?;
        }
        Ok(files)
    }

    /// How many scans of a file that holds all scans were moved behind the one before, as they do not
    /// begin after it: most of any format.
    pub fn moved(&self) -> u64 {
        self.open.iter().map(|(_, messages)| messages.moved()).max().unwrap_or(0)
    }

    /// Finishes the files that hold all scans.
    ///
    /// # Errors
    /// [`Error::Write`]; the scans are readable then, too.
    pub fn finish(self) -> Result<(), Error> {
        self.open.into_iter().try_for_each(|(_, messages)| messages.finish())
    }
}

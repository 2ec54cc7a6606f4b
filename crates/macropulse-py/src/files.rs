//! Scans to files, and back.

use std::path::{Path, PathBuf};

use macropulse::formats::{Format, Names, read_cloud, write_cloud};
use macropulse::points::{PointCloud, Truth};
use pyo3::prelude::*;

use crate::error::{OrRaise, wrong};
use crate::scan::{About, Scan};
use crate::work;

/// Writes `scan` in the format that is named, or that its ending says, with the truth if wanted.
///
/// # Errors
/// If there is no such format, or the file cannot be written.
pub fn save(
    scan: &Bound<'_, Scan>,
    path: PathBuf,
    (format, truth): (Option<&str>, bool),
) -> PyResult<()> {
    let format = format_of(&path, format)?;
    let this = scan.clone().unbind();
    // Files are whole or absent: a signal waits for the end of one.
    scan.py()
        .detach(move || {
            let this = this.get();
            let names = Names { objects: &this.objects, materials: &this.materials };
            if truth {
                return write_cloud(format, &this.cloud, &names, &path);
            }
            let cloud = PointCloud { truth: Truth::default(), ..this.cloud.clone() };
            // Names of what the file does not tell say nothing.
            write_cloud(format, &cloud, &Names::default(), &path)
        })
        .or_raise()
}

/// The format that is named, or else the one that files of this ending have.
fn format_of(path: &Path, named: Option<&str>) -> PyResult<Format> {
    if let Some(name) = named {
        return Format::parse(name).or_raise();
    }
    let ending = path.extension().map(|end| end.to_string_lossy().to_lowercase());
    let Some(ending) = ending else {
        let mut known: Vec<&str> = Format::ALL.iter().map(|format| format.extension()).collect();
        known.dedup();
        let (path, known) = (path.display(), known.join(", ."));
        return Err(wrong(format!("{path}: has no ending that says a format; known are .{known}")));
    };
    Format::of_extension(&ending).map_or_else(|| Format::parse(&ending).or_raise(), Ok)
}

/// Reads a scan from a file.
///
/// Args:
///     path: A file that `Scan.save` or the program has written; its ending says the format. Of a
///         file with several scans the first is read.
///
/// Raises:
///     Error: If the file is none of a format that can be read.
///     OSError: If it cannot be read.
#[pyfunction]
pub fn load(py: Python<'_>, path: PathBuf) -> PyResult<Scan> {
    let cloud = work::done(py, 0, move |_| read_cloud(&path))?;
    Ok(Scan::new(cloud.or_raise()?, About::default()))
}

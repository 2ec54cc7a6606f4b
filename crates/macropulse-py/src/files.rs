//! Scans to files, and back; and scan after scan, out of files of points or of shots and ticks, samples or histograms.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use macropulse::channel::Operating;
use macropulse::design::Design;
use macropulse::formats::{CloudRoom, Format, LeftOut, Names, Reading, write_cloud};
use macropulse::points::{PointCloud, Scale, Truth};
use macropulse_study::decoding::{self, Decoding};
use macropulse_study::record::{self, CloudsAt};
use pyo3::prelude::*;

use crate::error::{OrRaise, Raise, warned, wrong};
use crate::scan::{About, Scan};
use crate::work::{self, Stop};

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
    let Some(ending) = ending.filter(|ending| !ending.is_empty()) else {
        let mut known: Vec<&str> = Format::ALL.iter().map(|format| format.extension()).collect();
        known.sort_unstable();
        known.dedup();
        let (path, known) = (path.display(), known.join(", ."));
        return Err(wrong(format!("{path}: has no ending that says a format; known are .{known}")));
    };
    Format::of_extension(&ending).map_or_else(|| Format::parse(&ending).or_raise(), Ok)
}

/// Files from which scans are read.
enum Source {
    /// Points.
    Clouds(CloudsAt),
    /// Shots and ticks, samples or histograms, which the receiver of a sensor decodes.
    Recorded(Box<Decoding>, Arc<Design>, Box<Scale>),
}

/// An error of a [`Source`].
enum Failed {
    Record(record::Error),
    Decoding(decoding::Error),
}

impl From<record::Error> for Failed {
    fn from(error: record::Error) -> Self {
        Self::Record(error)
    }
}

impl From<decoding::Error> for Failed {
    fn from(error: decoding::Error) -> Self {
        Self::Decoding(error)
    }
}

impl Raise for Failed {
    fn raise(self) -> PyErr {
        match self {
            Self::Record(error) => error.raise(),
            Self::Decoding(error) => error.raise(),
        }
    }
}

impl Source {
    /// Content of the last file read that is not in its scans.
    fn left_out(&self) -> LeftOut {
        match self {
            Self::Clouds(clouds) => clouds.left_out().cloned().unwrap_or_default(),
            Self::Recorded(..) => LeftOut::default(),
        }
    }

    /// The next scan; `None` behind the last one, or once it is told to stop.
    fn next(&mut self, stop: &Stop) -> Result<Option<Scan>, Failed> {
        match self {
            Self::Clouds(clouds) => {
                let next = clouds.next_cloud()?;
                Ok(next.map(|(cloud, names)| {
                    let (objects, materials) = (names.objects.to_vec(), names.materials.to_vec());
                    Scan::new(cloud, About { objects, materials, ..About::default() })
                }))
            }
            Self::Recorded(decoding, design, scale) => {
                let stage = (&**design, &**scale);
                let next = decoding.next_scan(stage, |_| Ok::<_, decoding::Error>(stop.flow()))?;
                let about = || About { sensor: Some(Arc::clone(design)), ..About::default() };
                Ok(next.map(|cloud| Scan::new(cloud, about())))
            }
        }
    }
}

/// Scans out of files, each read, or decoded, when it is asked for: `for scan in load_scans(...)`.
#[pyclass(frozen, module = "macropulse")]
pub struct StoredScans {
    /// Gone behind the last scan, and after anything that went wrong.
    source: Arc<Mutex<Option<Source>>>,
    /// Names of the files.
    name: String,
    /// Content left out, by the last warning of it.
    told: Mutex<Option<LeftOut>>,
}

impl StoredScans {
    fn new(source: Source, name: String) -> Self {
        Self { source: Arc::new(Mutex::new(Some(source))), name, told: Mutex::new(None) }
    }

    /// Warns of what of the file is not in its scans, once for each kind of it.
    fn warn(&self, py: Python<'_>, left_out: LeftOut) -> PyResult<()> {
        let mut told = self.told.lock().unwrap_or_else(PoisonError::into_inner);
        if left_out.is_empty() || told.as_ref().is_some_and(|told| told.is_alike(&left_out)) {
            return Ok(());
        }
        let sentence = format!("{}: left out: {left_out}", self.name);
        *told = Some(left_out);
        drop(told);
        warned(py, sentence)
    }

    /// The scan that is the only one.
    ///
    /// # Errors
    /// If there is none or several; then `several` says what to call instead.
    pub fn only(&self, py: Python<'_>, several: &str) -> PyResult<Scan> {
        let name = &self.name;
        let Some(scan) = self.__next__(py)? else {
            return Err(wrong(format!("{name}: holds no scan")));
        };
        match self.__next__(py)? {
            None => Ok(scan),
            Some(_) => Err(wrong(format!("{name}: holds several scans; {several}"))),
        }
    }
}

#[pymethods]
impl StoredScans {
    fn __iter__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    fn __next__(&self, py: Python<'_>) -> PyResult<Option<Scan>> {
        let source = Arc::clone(&self.source);
        let next = work::done(py, 0, move |stop| {
            let mut source = source.lock().unwrap_or_else(PoisonError::into_inner);
            let Some(mut open) = source.take() else { return Ok(None) };
            let next = open.next(stop)?.map(|scan| (scan, open.left_out()));
            if next.is_some() {
                *source = Some(open);
            }
            Ok::<_, Failed>(next)
        })?;
        let Some((scan, left_out)) = next.or_raise()? else { return Ok(None) };
        self.warn(py, left_out)?;
        Ok(Some(scan))
    }

    fn __repr__(&self) -> String {
        format!("<macropulse.StoredScans of {}>", self.name)
    }
}

fn clouds_at(
    py: Python<'_>,
    path: PathBuf,
    topic: Option<String>,
    limit: Option<u64>,
) -> PyResult<StoredScans> {
    let name = path.display().to_string();
    let room = limit.map_or_else(CloudRoom::default, CloudRoom::of_bytes);
    let open = move |_: &Stop| CloudsAt::open(&path, Reading { room, topic });
    let clouds = work::done(py, 0, open)?.or_raise()?;
    Ok(StoredScans::new(Source::Clouds(clouds), name))
}

/// Reads a scan from a file.
///
/// Args:
///     path: A file that `Scan.save` or the program has written, its ending says the format; or the
///         folder of a run. It holds a single scan; of several, `load_scans` gives one after the other.
///     topic: The one topic of an MCAP file whose clouds are read; all topics if left out.
///     memory_limit: Bytes that the program may take; four fifths of what the machine has unless it is
///         given. A file with more points than fit into them is refused.
///
/// Warns of what of the file is not in the scan: fields, points that are none, the coordinate reference
/// system.
///
/// Raises:
///     Error: If the file is none of a format that can be read, holds several scans, or takes too much
///         memory.
///     OSError: If it cannot be read.
///
/// Example:
///     >>> scan = macropulse.load("out/scan-000000.pcd")
#[pyfunction]
#[pyo3(signature = (path, *, topic=None, memory_limit=None))]
pub fn load(
    py: Python<'_>,
    path: PathBuf,
    topic: Option<String>,
    memory_limit: Option<u64>,
) -> PyResult<Scan> {
    clouds_at(py, path, topic, memory_limit)?
        .only(py, "iterate over them: `for scan in macropulse.load_scans(path)`")
}

/// Reads scan after scan, in the memory of one.
///
/// Args:
///     path: A file with several scans, as `scans.mcap`; or a folder with files of one scan each, as the
///         program leaves it behind `-o`. Each scan of a folder is read once, from the file that keeps most.
///     topic: The one topic of an MCAP file whose clouds are read; all topics if left out.
///     memory_limit: Bytes that the program may take, as of `load`.
///
/// Warns as `load` does.
///
/// Returns:
///     An iterator of `Scan`.
///
/// Raises:
///     Error: If a file is none of a format that can be read, or a folder holds none.
///     OSError: If one cannot be read.
///
/// Example:
///     >>> for scan in macropulse.load_scans("out"):
///     ...     print(scan.number, len(scan))
#[pyfunction]
#[pyo3(signature = (path, *, topic=None, memory_limit=None))]
pub fn load_scans(
    py: Python<'_>,
    path: PathBuf,
    topic: Option<String>,
    memory_limit: Option<u64>,
) -> PyResult<StoredScans> {
    clouds_at(py, path, topic, memory_limit)
}

/// The decoding of the files at these paths.
///
/// # Errors
/// If they cannot be read, are none, or are of another sensor.
pub fn recorded_at(
    py: Python<'_>,
    (design, operating): (Arc<Design>, Operating),
    [shots, record]: [PathBuf; 2],
) -> PyResult<StoredScans> {
    let name = format!("{} and {}", shots.display(), record.display());
    let receiver = Arc::clone(&design);
    let decoding = work::done(py, 0, move |_| {
        let (shots, record) = (decoding::Input::open(&shots)?, decoding::Input::open(&record)?);
        Decoding::open(&receiver, shots, record)
    })?;
    let scale = Box::new(Scale::of(&design, &operating));
    let source = Source::Recorded(Box::new(decoding.or_raise()?), design, scale);
    Ok(StoredScans::new(source, name))
}

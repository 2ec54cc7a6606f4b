//! `macropulse convert`: point clouds from one format to another.

use std::collections::BTreeSet;
use std::ffi::{OsStr, OsString};
use std::path::{Path, PathBuf};

use clap::Args;
use macropulse::formats::{Clouds, Format, Reading, Recording};
use macropulse::opened::{is_standard_output, is_written_through};
use macropulse::points::PointCloud;

use crate::fault::Fault;
use crate::folder::{Folder, Outputs, check_file};
use crate::interrupt::Interrupt;
use crate::memory::MemoryLimit;
use crate::options::Common;
use crate::simulate::Formats;
use crate::text::{counted, print, warn};

/// Convert point clouds to another format
///
/// Reads files that end in .pcd, .ply, .las, .laz, .e57 and .ptx (every scan), .npy, .csv, .xyz, .txt, .pts,
/// .bin (KITTI, nuScenes) and .mcap (every cloud of ROS 2). Says what is left out on the way in, and what an
/// output cannot hold.
#[derive(Args)]
#[command(after_help = "Examples:
  macropulse convert out/scan-000000.pcd -o car.laz
  macropulse convert out/scan-*.pcd -o drive.mcap
  macropulse convert out/scans.mcap --format ply,csv -o clouds")]
pub struct Convert {
    /// Files with point clouds
    #[arg(value_name = "IN", required = true)]
    inputs: Vec<PathBuf>,

    /// File, whose ending says its format, or with --format also a folder
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,

    #[arg(
        long,
        value_name = "LIST",
        help = "Formats to write, as of simulate; OUT is a folder \
                                             unless it ends as the files of the only one do"
    )]
    format: Option<Formats>,

    #[command(flatten)]
    memory: MemoryLimit,

    /// Read only the clouds of this topic of MCAP files [default: those of all topics]
    #[arg(long, value_name = "TOPIC")]
    topic: Option<String>,

    /// Replace files in the folder OUT that are not known to be written by macropulse
    #[arg(long)]
    replace: bool,
}

/// Destination of the clouds.
struct Target {
    formats: Vec<Format>,
    folder: PathBuf,
    /// The name of the one file; without it each input has files of its own name.
    file: Option<OsString>,
}

impl Convert {
    fn target(&self) -> Result<Target, Fault> {
        let output = &self.output;
        let ending = output.extension().and_then(OsStr::to_str);
        let by_ending = ending.and_then(Format::of_extension);
        let is_named = |format: &Format| ending.is_some_and(|ending| format.has_extension(ending));
        let formats = match (&self.format, by_ending) {
            (Some(formats), _) if formats.0.is_empty() => {
                let remedy = "--format: nothing is to be written; name a format, as `ply`";
                return Err(Fault::Wrong(remedy.to_owned()));
            }
            (Some(Formats(formats, _)), Some(_))
                if !output.is_dir() && !matches!(formats[..], [one] if is_named(&one)) =>
            {
                let output = output.display();
                return Err(Fault::Wrong(format!(
                    "{output}: ends as a {} file does, where --format wants a folder or another \
                     ending; leave --format out, or give OUT another name",
                    ending.unwrap_or_default()
                )));
            }
            (Some(formats), _) => formats.0.clone(),
            (None, None) if is_written_through(output) => {
                return Err(Fault::Wrong(format!(
                    "{}: says no format; say it, as --format ply",
                    output.display()
                )));
            }
            (None, Some(format)) => vec![format],
            (None, None)
                if output.is_dir() || output.as_os_str().to_string_lossy().ends_with('/') =>
            {
                return Err(Fault::Wrong(format!(
                    "{}: is a folder; say what to write into it, as --format ply",
                    output.display()
                )));
            }
            (None, None) => {
                let output = output.display();
                return Err(Fault::Wrong(format!(
                    "{output}: says no format; give it an ending, as {output}.ply, or say \
                     --format ply to write into a folder of this name"
                )));
            }
        };
        let is_file = match formats.as_slice() {
            [format] => is_named(format) && !output.is_dir() || is_written_through(output),
            _ => false,
        };
        let name = output.file_name().filter(|_| is_file);
        let file = name.map(OsStr::to_owned);
        let parent = output.parent().filter(|parent| !parent.as_os_str().is_empty());
        let folder = if is_file { parent.unwrap_or(Path::new(".")) } else { output };
        Ok(Target { formats, folder: folder.to_owned(), file })
    }
}

impl Target {
    /// Refuses inputs that are folders, and those whose files would take each other's place, or that of an input.
    fn check(&self, inputs: &[PathBuf]) -> Result<(), Fault> {
        if let Some(folder) = inputs.iter().find(|input| input.is_dir()) {
            let folder = folder.display();
            return Err(Fault::Wrong(format!(
                "{folder}: is a folder; name the files in it, as {folder}/scan-000000.pcd"
            )));
        }
        if let Some(file) = &self.file {
            check_file(&self.folder.join(file), inputs)?;
        } else {
            for (at, input) in inputs.iter().enumerate() {
                let is_same = |other: &&PathBuf| other.file_stem() == input.file_stem();
                if let Some(other) = inputs[..at].iter().find(is_same) {
                    let (one, other) = (other.display(), input.display());
                    return Err(Fault::Wrong(format!(
                        "{one} and {other} would be written under one name; convert them to \
                         folders of their own"
                    )));
                }
            }
        }
        Ok(())
    }

    /// The files whose names are derived from those of the `inputs`.
    fn outputs(&self, inputs: &[PathBuf]) -> Outputs {
        let (mut plain, mut numbered) = (Vec::new(), Vec::new());
        for input in inputs.iter().filter(|_| self.file.is_none()) {
            for format in &self.formats {
                plain.push(self.name(*format, input, None));
                if may_have_several(input) {
                    numbered.push(self.name(*format, input, Some(0)));
                }
            }
        }
        let is_written = move |path: &Path| {
            let name = path.as_os_str();
            plain.iter().any(|one| one == name) || numbered.contains(&of_first_scan(name))
        };
        Outputs::of(is_written).beside(inputs)
    }

    /// Returns true if it takes several scans.
    fn takes_several(&self) -> bool {
        self.file.is_none() || self.formats.iter().all(|format| format.is_of_run())
    }

    /// The name of a file.
    fn name(&self, format: Format, input: &Path, scan: Option<u64>) -> OsString {
        if let Some(file) = &self.file {
            return file.clone();
        }
        if format.is_of_run() {
            return format.file_name(0).into();
        }
        let mut name = input.file_stem().unwrap_or_default().to_owned();
        let scan = scan.map(|scan| format!("-{scan:06}")).unwrap_or_default();
        let kind = if format == Format::RangeNpy { "-range" } else { "" };
        name.push(format!("{scan}{kind}.{}", format.extension()));
        name
    }
}

/// True for containers of several clouds. The files of their clouds have numbers in their names.
fn may_have_several(input: &Path) -> bool {
    input
        .extension()
        .is_some_and(|ending| ["mcap", "e57", "ptx"].iter().any(|of_several| ending == *of_several))
}

/// The name of a file with the number of its scan, if it has one, as that of the first.
fn of_first_scan(name: &OsStr) -> OsString {
    let is_digits = |text: &str| text.len() >= 6 && text.bytes().all(|byte| byte.is_ascii_digit());
    let Some(text) = name.to_str() else { return name.to_owned() };
    let mut parts: Vec<&str> = text.split_inclusive(['-', '.']).collect();
    if let Some(number) =
        parts.iter_mut().rev().find(|part| is_digits(part.trim_end_matches(['-', '.'])))
    {
        *number = if number.ends_with('-') { "000000-" } else { "000000." };
    }
    parts.concat().into()
}

/// A conversion under way.
struct Conversion<'a> {
    target: &'a Target,
    common: &'a Common,
    /// None where the one file is a device, a pipe or a standard stream.
    folder: Option<Folder>,
    recording: Recording,
    reading: Reading,
    /// Number of the scan that comes next at least, where they go into one file.
    next: u64,
    /// Files with one scan each that are written, and what was said of formats.
    written: BTreeSet<OsString>,
    said: BTreeSet<String>,
    scans: u64,
    points: u64,
    files: u64,
}

pub fn run(options: &Convert, common: &Common) -> Result<(), Fault> {
    let target = options.target()?;
    target.check(&options.inputs)?;
    let interrupt = Interrupt::listen()?;
    let is_stream = target.file.is_some() && is_written_through(&options.output);
    let outputs = target.outputs(&options.inputs).replacing(options.replace);
    let recording = Recording::new(&target.folder, &target.formats);
    let mut conversion = Conversion {
        target: &target,
        common,
        folder: if is_stream { None } else { Some(Folder::claim(&target.folder, outputs)?) },
        recording: if target.file.is_some() { recording.named() } else { recording },
        reading: Reading { room: options.memory.cloud_room(), topic: options.topic.clone() },
        next: 0,
        written: BTreeSet::new(),
        said: BTreeSet::new(),
        scans: 0,
        points: 0,
        files: 0,
    };
    let mut converted = Ok(());
    for input in &options.inputs {
        converted = conversion.convert(input, options.inputs.len(), &interrupt);
        if converted.is_err() || interrupt.is_raised() {
            break;
        }
    }
    let Conversion { recording, scans, points, files, .. } = conversion;
    let moved = recording.moved();
    interrupt.undisturbed(|| recording.finish())?;
    converted?;
    if moved > 0 {
        let (begin, moved) =
            if moved == 1 { ("begins", "1 scan") } else { ("begin", &*format!("{moved} scans")) };
        let told = format!(
            "{moved} {begin} no later than the one before: written with a stamp 0.1 s after it"
        );
        common.note(&told);
    }
    if points == 0 {
        warn("not a single point: there is none in what was read");
    }
    if !common.quiet && !is_standard_output(&options.output) {
        let (scans, points) = (counted(scans, "scan"), counted(points, "point"));
        let files = counted(files, "file");
        let output = options.output.display();
        print(&format!("{scans}, {points}, {files}: {output}\n"))?;
    }
    if interrupt.is_raised() { Err(Fault::Interrupted) } else { Ok(()) }
}

impl Conversion<'_> {
    fn convert(&mut self, input: &Path, inputs: usize, interrupt: &Interrupt) -> Result<(), Fault> {
        let mut clouds = Clouds::open_with(input, &self.reading)?;
        let has_several = clouds.has_several();
        let mut next = clouds.next();
        while let Some(cloud) = next.take() {
            if interrupt.is_raised() {
                return Ok(());
            }
            let cloud = cloud?;
            if !self.target.takes_several() {
                next = clouds.next();
                if inputs > 1 || matches!(next, Some(Ok(_))) {
                    return Err(self.several());
                }
            }
            interrupt.undisturbed(|| self.write(cloud, (input, has_several), &clouds))?;
            next = next.or_else(|| clouds.next());
        }
        say_left_out(input, &clouds, &self.reading, self.common);
        Ok(())
    }

    fn several(&self) -> Fault {
        let format = self.target.formats.first().map_or("", |format| format.name());
        Fault::Wrong(format!(
            "several scans do not fit into one {format} file; say --format {format} and give a \
             folder with -o"
        ))
    }

    fn write(
        &mut self,
        mut cloud: PointCloud,
        (input, has_several): (&Path, bool),
        clouds: &Clouds,
    ) -> Result<(), Fault> {
        let names = clouds.names();
        if self.scans == 0 {
            self.folder.as_mut().map_or(Ok(()), Folder::make)?;
        }
        for format in &self.target.formats {
            let left_out = format.leaves_out(&cloud, &names);
            let (name, left_out) = (format.name(), left_out.join(", "));
            let told = format!("{name} cannot hold {left_out}: left out");
            if !left_out.is_empty() && self.said.insert(told.clone()) {
                self.common.note(&told);
            }
        }
        let scan = cloud.scan;
        cloud.scan = scan.max(self.next);
        self.next = cloud.scan + 1;
        let scan = has_several.then_some(scan);
        let name = |format: Format| self.target.name(format, input, scan);
        for &format in self.target.formats.iter().filter(|format| !format.is_of_run()) {
            let file = name(format);
            if !self.written.insert(file.clone()) {
                let (file, input) = (Path::new(&file).display(), input.display());
                return Err(Fault::Wrong(format!(
                    "{input}: another cloud is in {file} already; convert it to a folder of its own"
                )));
            }
        }
        self.files += self.recording.add_as(&cloud, &names, name)?.len() as u64;
        self.folder.iter_mut().for_each(Folder::keep);
        self.scans += 1;
        self.points += cloud.returns() as u64;
        Ok(())
    }
}

/// Says what of a file that was read is not in its clouds, and which topics there are to choose.
pub fn say_left_out(input: &Path, clouds: &Clouds, reading: &Reading, common: &Common) {
    let (input, left_out) = (input.display(), clouds.left_out());
    if !left_out.is_empty() {
        common.note(&format!("{input}: left out: {left_out}"));
    }
    let topics = clouds.topics();
    if topics.len() > 1 && reading.topic.is_none() {
        let topics = topics.join(", ");
        common.note(&format!("{input}: has clouds on {topics}; --topic chooses one"));
    }
}

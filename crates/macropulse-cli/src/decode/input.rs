//! The files that are decoded, and whether they belong to the sensor.

use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use macropulse::codec::files::{Digest, Error, ShotReader, Stream, TickReader, What};
use macropulse::design::Design;

use crate::fault::Fault;

/// Shots and ticks under way.
pub struct Input {
    pub stream: Stream<Box<dyn Read>, Box<dyn Read>>,
    /// Where the sensor was, as the shot log says.
    pub pose: ([f64; 3], [f64; 4]),
    names: [String; 2],
    /// Whether one of them comes as it is made.
    pub is_live: bool,
}

/// The shots and ticks at these paths, `-` for stdin, of the sensor `design`.
pub fn open(shots: &Path, ticks: &Path, design: &Design) -> Result<Input, Fault> {
    let paths = [shots, ticks];
    let is_stdin = |path: &Path| path == Path::new("-");
    if paths.iter().all(|path| is_stdin(path)) {
        return Err(Fault::Wrong(
            "only one of SHOTS and TICKS can come from stdin; name a file for the other".to_owned(),
        ));
    }
    let names = paths.map(|path| match is_stdin(path) {
        true => "stdin".to_owned(),
        false => path.display().to_string(),
    });
    let faulty = |error: Error| fault(&names, &error);
    let shots = ShotReader::new(reader(shots)?, design.limits()).map_err(faulty)?;
    let (tick_fs, channels) = (design.tdc.tick_fs, design.channels());
    let ticks = TickReader::new(reader(ticks)?, tick_fs, channels).map_err(faulty)?;
    for (digest, name) in [shots.header().digest, ticks.header().digest].into_iter().zip(&names) {
        check_digest(design, digest, name)?;
    }
    let pose = (shots.header().position, shots.header().turn);
    let stream = Stream::new(design.cut(), shots, ticks, channels > 1);
    Ok(Input { stream, pose, names, is_live: paths.iter().any(|path| is_stdin(path)) })
}

impl Input {
    /// An error of one of the files, as a sentence with its name.
    pub fn fault(&self, error: &Error) -> Fault {
        fault(&self.names, error)
    }

    /// What is wrong with both of them.
    pub fn wrong(&self, sentence: &str) -> Fault {
        let [shots, ticks] = &self.names;
        Fault::Wrong(format!("{shots} and {ticks}: {sentence}"))
    }
}

fn fault(names: &[String; 2], error: &Error) -> Fault {
    let [shots, ticks] = names;
    let name = if error.what() == What::Shots { shots } else { ticks };
    Fault::Wrong(format!("{name}: {error}"))
}

fn reader(path: &Path) -> Result<Box<dyn Read>, Fault> {
    if path == Path::new("-") {
        return Ok(Box::new(io::stdin()));
    }
    let unreadable = |error: &io::Error| Fault::unreadable(&path.display().to_string(), error);
    let file = File::open(PathBuf::from(path)).map_err(|error| unreadable(&error))?;
    if file.metadata().is_ok_and(|about| about.is_dir()) {
        return Err(unreadable(&io::ErrorKind::IsADirectory.into()));
    }
    Ok(Box::new(file))
}

/// Recorded hardware may leave the digest out.
fn check_digest(design: &Design, digest: Option<Digest>, name: &str) -> Result<(), Fault> {
    let ours = design.recorded_digest();
    match digest {
        Some(digest) if digest != ours => Err(Fault::Wrong(format!(
            "{name}: is of another sensor: its code, timing or pixels have the digest {digest}, those of {} \
             {ours}; name the sensor it was recorded with, and the same --set",
            design.name
        ))),
        _ => Ok(()),
    }
}

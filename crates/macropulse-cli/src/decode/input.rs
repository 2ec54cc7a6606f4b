//! The files that are decoded, as they are named on the command line.

use std::io;
use std::path::Path;

use macropulse::design::Design;
use macropulse_study::decoding::{Decoding, Input};

use crate::fault::Fault;
use crate::input::STREAM;

/// The decoding of the shots and of their record, the `record`, at these paths, `-` for stdin, of
/// the sensor `design`; and what they are called.
pub fn open(
    shots: &Path,
    record: &Path,
    design: &Design,
) -> Result<(Decoding, [String; 2]), Fault> {
    if [shots, record].iter().all(|path| is_stdin(path)) {
        return Err(Fault::Wrong(
            "only one of SHOTS and RECORD can come from stdin; name a file for the other"
                .to_owned(),
        ));
    }
    let (shots, record) = (input(shots)?, input(record)?);
    let names = [shots.name.clone(), record.name.clone()];
    Ok((Decoding::open(design, shots, record)?, names))
}

fn is_stdin(path: &Path) -> bool {
    path == Path::new(STREAM)
}

fn input(path: &Path) -> Result<Input, Fault> {
    match is_stdin(path) {
        true => Ok(Input { name: "stdin".to_owned(), bytes: Box::new(io::stdin()), is_live: true }),
        false => Ok(Input::open(path)?),
    }
}

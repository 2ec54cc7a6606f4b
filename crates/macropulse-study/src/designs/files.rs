//! What a search leaves in its folder.

use std::path::Path;
use std::{fs, io};

use macropulse::formats::{self, clear_unfinished, write_atomically};

use super::candidate::SCHEMES;
use super::trial::folder_of_trials;
use super::{Error, Found};

/// The page of a search.
pub const PAGE: &str = "index.html";

/// Everything that was found, as numbers.
const NUMBERS: &str = "design.json";

/// What stands beside the page, but for the sensors.
const PICTURES: [&str; 3] = ["frontier.svg", "frontier.png", "frontier.csv"];

/// Makes the folders in which a search keeps what it counted. Results of a search that was here before go:
/// however this one ends, no file tells of other requirements. Of a folder without trials, which is not a
/// search's, all stays.
///
/// # Errors
/// If they cannot be made, or something cannot go.
pub fn make_room(folder: &Path) -> Result<(), Error> {
    let refused = |path: &Path| {
        let path = path.to_owned();
        |cause| Error::Formats(formats::Error::Write { path, cause })
    };
    let trials = folder_of_trials(folder);
    if trials.is_dir() {
        let sensors = SCHEMES.map(file_of_sensor);
        let names = sensors.iter().map(String::as_str).chain(PICTURES).chain([NUMBERS, PAGE]);
        for path in names.map(|name| folder.join(name)) {
            match fs::remove_file(&path) {
                Err(error) if error.kind() != io::ErrorKind::NotFound => {
                    return Err(refused(&path)(error));
                }
                _ => {}
            }
        }
    }
    fs::create_dir_all(&trials).map_err(refused(&trials))?;
    clear_unfinished(&trials);
    Ok(())
}

/// The file of the sensor that was found of a scheme.
fn file_of_sensor(scheme: &str) -> String {
    format!("{scheme}.toml")
}

impl Found {
    /// Writes the page, the numbers, the picture of the frontier and the sensors that do into `folder`. Gives
    /// the names.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn write(&self, folder: &Path) -> Result<Vec<String>, Error> {
        let mut names = Vec::new();
        let mut write = |name: &str, bytes: &[u8]| -> Result<(), Error> {
            write_atomically(&folder.join(name), |out| out.write_all(bytes))?;
            names.push(name.to_owned());
            Ok(())
        };
        for best in self.best.iter().flatten() {
            let design = best.candidate.design(&self.required)?;
            write(&file_of_sensor(best.candidate.scheme()), design.text.as_bytes())?;
        }
        write(NUMBERS, format!("{:#}\n", self.json()).as_bytes())?;
        if let Some(((svg, png), csv)) = self.drawn()?.zip(self.csv()) {
            let contents = [svg.as_bytes(), &png, csv.as_bytes()];
            for (name, bytes) in PICTURES.into_iter().zip(contents) {
                write(name, bytes)?;
            }
        }
        let page = self.page(&names).html();
        write_atomically(&folder.join(PAGE), |out| out.write_all(page.as_bytes()))?;
        names.push(PAGE.to_owned());
        Ok(names)
    }
}

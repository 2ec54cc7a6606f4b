//! What a search leaves in its folder.

use std::fs;
use std::path::Path;

use macropulse::formats::{self, clear_unfinished, write_atomically};

use super::trial::folder_of_trials;
use super::{Error, Found};

/// The page of a search.
pub const PAGE: &str = "index.html";

/// What stands beside the page, but for the sensors.
const PICTURES: [&str; 3] = ["frontier.svg", "frontier.png", "frontier.csv"];

/// Makes the folders in which a search keeps what it counted.
///
/// # Errors
/// If they cannot be made.
pub fn make_room(folder: &Path) -> Result<(), Error> {
    let trials = folder_of_trials(folder);
    fs::create_dir_all(&trials)
        .map_err(|cause| Error::Formats(formats::Error::Write { path: trials.clone(), cause }))?;
    clear_unfinished(&trials);
    Ok(())
}

impl Found {
    /// Writes the page, the numbers, the picture of the frontier and the sensors that do into `folder`; takes
    /// away pictures that an earlier search has left there and this one has not. Gives the names.
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
            write(&format!("{}.toml", best.candidate.scheme()), design.text.as_bytes())?;
        }
        write("design.json", format!("{:#}\n", self.json()).as_bytes())?;
        match self.drawn()?.zip(self.csv()) {
            Some(((svg, png), csv)) => {
                let contents = [svg.as_bytes(), &png, csv.as_bytes()];
                for (name, bytes) in PICTURES.into_iter().zip(contents) {
                    write(name, bytes)?;
                }
            }
            None => PICTURES.iter().for_each(|name| {
                // It may never have been there.
                let _ = fs::remove_file(folder.join(name));
            }),
        }
        let page = self.page(&names).html();
        write_atomically(&folder.join(PAGE), |out| out.write_all(page.as_bytes()))?;
        names.push(PAGE.to_owned());
        Ok(names)
    }
}

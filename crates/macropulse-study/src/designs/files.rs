//! Files that a search leaves in its folder.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use macropulse::digest::Digest;
use macropulse::formats::{self, clear_unfinished, write_atomically};
use macropulse::opened;

use super::candidate::SCHEMES;
use super::trial::folder_of_trials;
use super::{Error, Found};

/// The page of a search.
pub const PAGE: &str = "index.html";

/// Everything that was found, as numbers.
const NUMBERS: &str = "design.json";

/// Pictures and table of the frontier, which stand beside the page.
const PICTURES: [&str; 3] = ["frontier.svg", "frontier.png", "frontier.csv"];

/// In the folder of trials: which results a search has written, with the digests of their contents.
const RECORD: &str = "results.json";

/// Makes the folders in which a search keeps its counts. Results of an earlier search are removed: however
/// this one ends, no file tells of other requirements. Files that no search has written stay.
///
/// # Errors
/// If a file stands under the name of a result that no search has written or that was changed since; if they cannot
/// be made, or something cannot go.
pub fn make_room(folder: &Path) -> Result<(), Error> {
    let refused = |path: &Path| {
        let path = path.to_owned();
        |cause| Error::Formats(formats::Error::Write { path, cause })
    };
    let trials = folder_of_trials(folder);
    let sensors = SCHEMES.map(file_of_sensor);
    let names = sensors.iter().map(String::as_str).chain(PICTURES).chain([NUMBERS, PAGE]);
    let record = record(&trials);
    let mut of_a_search = Vec::new();
    for name in names {
        let path = folder.join(name);
        if fs::symlink_metadata(&path).is_err() {
            continue;
        }
        let is_ours = fs::read(&path).is_ok_and(|bytes| record.get(name) == Some(&digest(&bytes)));
        if !is_ours {
            return Err(Error::Asked(format!(
                "{}: was not written by a search, or changed since; move it away, or give another folder \
                 with -o",
                path.display()
            )));
        }
        of_a_search.push(path);
    }
    for path in of_a_search {
        fs::remove_file(&path).map_err(refused(&path))?;
    }
    fs::create_dir_all(&trials).map_err(refused(&trials))?;
    clear_unfinished(&trials);
    Ok(())
}

/// Returns the record in a folder of `trials`; empty if there is none.
fn record(trials: &Path) -> BTreeMap<String, String> {
    let text = opened::text(&trials.join(RECORD)).unwrap_or_default();
    serde_json::from_str(&text).unwrap_or_default()
}

fn digest(bytes: &[u8]) -> String {
    let mut digest = Digest::new();
    digest.bytes(bytes);
    digest.text()
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
        let mut files: Vec<(String, Vec<u8>)> = Vec::new();
        for best in self.best.iter().flatten() {
            let candidate = &best.trial.candidate;
            let design = candidate.design(&self.required)?;
            files.push((file_of_sensor(candidate.scheme()), design.text.clone().into_bytes()));
        }
        files.push((NUMBERS.to_owned(), format!("{:#}\n", self.json()).into_bytes()));
        if let Some(((svg, png), csv)) = self.drawn()?.zip(self.csv()) {
            let contents = [svg.into_bytes(), png, csv.into_bytes()];
            files.extend(PICTURES.map(str::to_owned).into_iter().zip(contents));
        }
        let names: Vec<String> = files.iter().map(|(name, _)| name.clone()).collect();
        files.push((PAGE.to_owned(), self.page(&names).html().into_bytes()));
        // The record comes first: if a search ends here, the next one still knows what is its own.
        let record: BTreeMap<&str, String> =
            files.iter().map(|(name, bytes)| (name.as_str(), digest(bytes))).collect();
        let record = serde_json::to_string_pretty(&record).unwrap_or_default() + "\n";
        let write = |path: &Path, bytes: &[u8]| write_atomically(path, |out| out.write_all(bytes));
        write(&folder_of_trials(folder).join(RECORD), record.as_bytes())?;
        for (name, bytes) in &files {
            write(&folder.join(name), bytes)?;
        }
        Ok(files.into_iter().map(|(name, _)| name).collect())
    }
}

//! Requirements on a lidar and the parts it may be made of: a TOML file.

use std::path::{Path, PathBuf};

use macropulse::environment::Environment;
use macropulse::schema::read_file;
use macropulse::{opened, told};
use schemars::JsonSchema;
use serde::Deserialize;
use serde_json::Value;
use toml::Table;

use super::Error;
use super::parts::{self, Part};

/// A file of requirements, checked.
#[derive(Debug, Clone)]
pub struct Requirements {
    /// Short name.
    pub name: String,
    /// Requirements on the lidar.
    pub wanted: Wanted,
    /// Sun and air.
    pub environment: Environment,
    /// Parts the lidar may be made of.
    pub parts: Parts,
    /// The photodiodes to choose from.
    pub detectors: Vec<Part>,
    /// The sensor whose keys are taken where nothing is searched, as it was written.
    pub(super) template: Table,
    /// The shortest over the mean time between shots of its channels, where no polygon decides that.
    pub(super) burst: f64,
    /// Folder of the files that the template names.
    pub(super) folder: PathBuf,
    /// The text of the file: what decides all that is found.
    pub text: String,
}

/// `[wanted]`: what the lidar must do.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Wanted {
    /// Rows of pixels.
    pub rows: u32,
    /// Columns of pixels.
    pub columns: u32,
    /// Field from left to right, degrees.
    pub horizontal_deg: f64,
    /// Field from top to bottom, degrees.
    pub vertical_deg: f64,
    /// Scans per second.
    pub scans_per_s: f64,
    /// Range up to which targets must be found, m.
    pub range_m: f64,
    /// Farthest thing that may answer, m: what stands behind the range must not be taken for something
    /// nearer.
    pub clutter_m: f64,
    /// Reflectance of the target; 1 is white.
    pub reflectance: f64,
    /// Least probability of a return.
    #[serde(default = "usual::pd")]
    pub pd: f64,
    /// False points accepted, per pixel that meets nothing.
    #[serde(default = "usual::false_points")]
    pub false_points: f64,
    /// Wrong points accepted, per pixel that meets something.
    #[serde(default = "usual::wrong_points")]
    pub wrong_points: f64,
    /// Largest standard deviation of the range, m.
    #[serde(default = "usual::precision_m")]
    pub precision_m: f64,
}

/// `[parts]`: what the lidar may be made of.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Parts {
    /// Ready sensor or file: a raster with a code and a sampled detector. It gives all values that are not
    /// searched.
    #[serde(default = "usual::sensor")]
    pub sensor: String,
    /// Names of photodiodes: of the table that comes with the program, or of `[[detector]]`.
    #[serde(default)]
    pub detectors: Vec<String>,
    /// Numbers of beams, each with a detector of its own; all divisors of the rows unless they are given.
    #[serde(default)]
    pub beams: Vec<u32>,
    /// Marks of a shot: 1 waits for its echo, more are a code word.
    #[serde(default = "usual::marks")]
    pub marks: Vec<u32>,
    /// Least and largest aperture, mm.
    #[serde(default = "usual::aperture_mm")]
    pub aperture_mm: [f64; 2],
    /// Shortest and longest pulse, ps.
    #[serde(default = "usual::pulse_ps")]
    pub pulse_ps: [f64; 2],
    /// Share of the energy that laser class 1 allows.
    #[serde(default = "usual::energy_share")]
    pub energy_share: f64,
    /// Fastest corners of a polygon, m/s; as fast as they must be unless it is given.
    #[serde(default)]
    pub tip_m_per_s: Option<f64>,
    /// Largest polygon, mm across its corners.
    #[serde(default = "usual::polygon_mm")]
    pub polygon_mm: f64,
    /// Numbers of facets to try for each lidar; all that sweep the field unless they are given.
    #[serde(default)]
    pub facets: Vec<u32>,
}

/// Defaults of keys that a file leaves out.
mod usual {
    pub(super) fn pd() -> f64 {
        0.9
    }

    pub(super) fn false_points() -> f64 {
        1e-4
    }

    pub(super) fn wrong_points() -> f64 {
        1e-3
    }

    pub(super) fn precision_m() -> f64 {
        0.03
    }

    pub(super) fn sensor() -> String {
        "coded-32".to_owned()
    }

    pub(super) fn marks() -> Vec<u32> {
        vec![1, 2, 3, 4]
    }

    pub(super) fn aperture_mm() -> [f64; 2] {
        [5.0, 50.0]
    }

    pub(super) fn pulse_ps() -> [f64; 2] {
        [500.0, 5000.0]
    }

    pub(super) fn energy_share() -> f64 {
        0.9
    }

    pub(super) fn polygon_mm() -> f64 {
        400.0
    }
}

/// The file as typed.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct File {
    /// Format of this file: 1.
    #[schemars(range(min = 1, max = 1))]
    version: u32,
    /// Short name.
    name: String,
    /// Sun and air: the name of a ready environment; `clear-day` unless it is given.
    #[serde(default)]
    environment: Option<String>,
    /// Requirements on the lidar.
    wanted: Wanted,
    /// Parts the lidar may be made of.
    parts: Parts,
    /// Photodiodes beside those that come with the program.
    #[serde(default, rename = "detector")]
    detectors: Vec<Part>,
}

/// JSON Schema of files of requirements, for editors that complete and check them.
pub fn schema() -> Value {
    macropulse::schema::of::<File>("Macropulse requirements").to_value()
}

/// The format this program reads.
const VERSION: u32 = 1;

/// Numbers of marks at most: more words than ten of eight fit into no time between own marks.
const MOST_MARKS: u32 = 8;

impl Requirements {
    /// Reads the requirements in the file at `path`.
    ///
    /// # Errors
    /// Says in one sentence what is wrong, and where.
    pub fn open(path: &Path) -> Result<Self, Error> {
        let name = path.display().to_string();
        let text = opened::text(path).map_err(|error| {
            Error::Asked(format!("{name}: cannot be read: {}", told::unreadable(&error)))
        })?;
        Self::from_toml(&text, &name, path.parent().unwrap_or(Path::new("")))
    }

    /// Reads the requirements in `text`. `origin` stands in messages for the file. A sensor that it names is
    /// looked for in `folder`.
    ///
    /// # Errors
    /// As [`Requirements::open`].
    pub fn from_toml(text: &str, origin: &str, folder: &Path) -> Result<Self, Error> {
        let file: File = read_file(text, origin).map_err(Error::Asked)?;
        let refused =
            |path: &str, message: &str| Error::Asked(told::at(text, origin, path, message));
        let refuse = |path: &str, message: &str| Err(refused(path, message));
        if file.version != VERSION {
            let message = format!("is {}, but this program reads version {VERSION}", file.version);
            return refuse("version", &message);
        }
        for (path, value, least, most) in limits(&file) {
            if !(value >= least && value <= most) {
                let message = format!("is {value}, but must lie between {least} and {most}");
                return refuse(path, &message);
            }
        }
        let Wanted { rows, range_m, clutter_m, .. } = file.wanted;
        if clutter_m < range_m {
            let message = format!("is {clutter_m}, nearer than wanted.range_m, {range_m}");
            return refuse("wanted.clutter_m", &message);
        }
        let mut parts = file.parts;
        for (path, [least, most]) in
            [("parts.aperture_mm", parts.aperture_mm), ("parts.pulse_ps", parts.pulse_ps)]
        {
            if least > most {
                let message = format!("is [{least}, {most}]; write the least first, then the most");
                return refuse(path, &message);
            }
        }
        if parts.beams.is_empty() {
            parts.beams = (1..=rows.min(MOST_BEAMS)).filter(|beams| rows % beams == 0).collect();
        }
        if let Some(beams) = parts.beams.iter().find(|beams| **beams == 0 || rows % **beams != 0) {
            let message = format!("{beams} beams do not share {rows} rows evenly");
            return refuse("parts.beams", &message);
        }
        if parts.marks.is_empty() || parts.marks.iter().any(|n| !(1..=MOST_MARKS).contains(n)) {
            let message = format!("must be numbers from 1 to {MOST_MARKS}, one at least");
            return refuse("parts.marks", &message);
        }
        for list in [&mut parts.beams, &mut parts.marks, &mut parts.facets] {
            list.sort_unstable();
            list.dedup();
        }
        let detectors = parts::chosen(&parts.detectors, file.detectors)
            .map_err(|(path, message)| refused(path, &message))?;
        let environment = file.environment.as_deref().unwrap_or("clear-day");
        let environment = Environment::named(environment)
            .map_err(|error| refused("environment", &error.to_string()))?;
        let (template, folder, burst) = super::keys::template(&parts.sensor, folder)
            .map_err(|message| refused("parts.sensor", &message))?;
        let required = Self {
            name: file.name,
            wanted: file.wanted,
            environment,
            parts,
            detectors,
            template,
            burst,
            folder,
            text: text.to_owned(),
        };
        if !required.has_polygon() {
            let given = [
                ("parts.tip_m_per_s", required.parts.tip_m_per_s.is_some()),
                ("parts.facets", !required.parts.facets.is_empty()),
            ];
            if let Some((key, _)) = given.iter().find(|(_, is_given)| *is_given) {
                let message = format!("has no effect: {} has no polygon", required.parts.sensor);
                return refuse(key, &message);
            }
        }
        let sweeps = |facets: u32| facets >= 2 && required.duty(facets) < 1.0;
        if let Some(facets) = required.parts.facets.iter().find(|facets| !sweeps(**facets)) {
            let message = format!(
                "a polygon of {facets} facets does not sweep {} degrees: it takes at least 2 facets, and \
                 fewer than {:.2}",
                required.wanted.horizontal_deg,
                1.0 / required.duty(1)
            );
            return refuse("parts.facets", &message);
        }
        Ok(required)
    }

    /// Width and height of a pixel, degrees.
    pub(super) fn pitch(&self) -> [f64; 2] {
        let Wanted { rows, columns, horizontal_deg, vertical_deg, .. } = self.wanted;
        [horizontal_deg / f64::from(columns), vertical_deg / f64::from(rows)]
    }
}

/// More beams than a raster may have are not tried.
const MOST_BEAMS: u32 = 1024;

/// Every number of a file with its limits: those that sensors have, too.
fn limits(file: &File) -> Vec<(&'static str, f64, f64, f64)> {
    let Wanted { rows, columns, horizontal_deg, vertical_deg, scans_per_s, .. } = file.wanted;
    let Wanted { range_m, clutter_m, reflectance, pd, precision_m, .. } = file.wanted;
    let Parts { aperture_mm, pulse_ps, energy_share, .. } = file.parts;
    let mut limits = vec![
        ("wanted.rows", f64::from(rows), 1.0, 4096.0),
        ("wanted.columns", f64::from(columns), 1.0, 8192.0),
        ("wanted.horizontal_deg", horizontal_deg, 0.1, 360.0),
        ("wanted.vertical_deg", vertical_deg, 0.1, 170.0),
        ("wanted.scans_per_s", scans_per_s, 0.1, 1e4),
        ("wanted.range_m", range_m, 1.0, 5000.0),
        ("wanted.clutter_m", clutter_m, 1.0, 1e4),
        ("wanted.reflectance", reflectance, 1e-3, 1.0),
        ("wanted.pd", pd, 0.01, 0.9999),
        ("wanted.false_points", file.wanted.false_points, 1e-8, 0.1),
        ("wanted.wrong_points", file.wanted.wrong_points, 1e-8, 0.1),
        ("wanted.precision_m", precision_m, 1e-4, 10.0),
        ("parts.energy_share", energy_share, 1e-6, 1.0),
    ];
    limits.extend(aperture_mm.map(|value| ("parts.aperture_mm", value, 0.1, 1e3)));
    limits.extend(file.parts.tip_m_per_s.map(|value| ("parts.tip_m_per_s", value, 0.1, 1e4)));
    limits.push(("parts.polygon_mm", file.parts.polygon_mm, 1.0, 1e4));
    limits.extend(pulse_ps.map(|value| ("parts.pulse_ps", value, 10.0, 1e5)));
    limits
}

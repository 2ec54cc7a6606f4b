//! The lasers of a turning head from a calibration file. It is one of three kinds:
//!
//! - The metadata of an Ouster sensor (`.json`, see [`ouster`]).
//! - The angle corrections of a Hesai sensor (`.csv`, see [`hesai`]).
//! - The list `lasers:` of the YAML files that drivers of Velodyne sensors read \[VelRos\].
//!
//! In the YAML files, angles are in radians and lengths in metres. R is the distance that a laser measures, φ
//! the azimuth of the head, clockwise, and d the `dist_correction` of the laser. Its `rot_correction`,
//! `vert_correction`, `horiz_offset_correction` and `vert_offset_correction` are α, ε, h and v. The driver
//! has
//!
//! x = ((R + d)·cos ε − v·sin ε)·cos(φ − α) + h·sin(φ − α)
//! y = −((R + d)·cos ε − v·sin ε)·sin(φ − α) + h·cos(φ − α)
//! z = (R + d)·sin ε + v·cos ε
//!
//! This is a beam along azimuth α − φ and elevation ε, whose clock starts 2d/c too late. It begins h to the
//! left of the axis and v above it, square to the beam. Lasers fire in the order of `laser_id`. Two things
//! are left out, and said so where they would matter: the second distance corrections for near targets, and
//! the corrections of intensities.

use std::path::Path;

use serde::Deserialize;
use serde_saphyr::{Error as Yaml, Location, Spanned};

use super::laser::{AZIMUTH, ELEVATION, Laser, Limit, MOST_LASERS, ORIGIN, RANGE_OFFSET};
use super::{hesai, ouster};
use crate::digest::Digest;
use crate::told;

/// Bytes of the largest calibration: those of 64 lasers have some 20 000.
const MOST_BYTES: u64 = 1 << 20;

/// The lasers of a calibration, in the order in which they fire, and what it says beside.
pub(super) struct Calibration {
    pub lasers: Vec<Laser>,
    /// Remarks on the parts of it that are left out.
    pub notes: Vec<String>,
    /// Digest of the file.
    pub digest: String,
}

/// The file as typed.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    lasers: Vec<LaserFile>,
    num_lasers: Option<Spanned<u32>>,
    #[expect(dead_code, reason = "the unit of raw distances, which a simulator has none of")]
    distance_resolution: Option<f64>,
}

/// A laser as typed.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LaserFile {
    laser_id: Spanned<u32>,
    rot_correction: Spanned<f64>,
    vert_correction: Spanned<f64>,
    dist_correction: Option<Spanned<f64>>,
    vert_offset_correction: Option<Spanned<f64>>,
    horiz_offset_correction: Option<Spanned<f64>>,
    #[serde(default)]
    two_pt_correction_available: bool,
    dist_correction_x: Option<f64>,
    dist_correction_y: Option<f64>,
    focal_distance: Option<f64>,
    focal_slope: Option<f64>,
    min_intensity: Option<f64>,
    max_intensity: Option<f64>,
}

/// The calibration in the file at `path`.
///
/// # Errors
/// Says in one sentence, with line and column, what is wrong with it.
pub(super) fn read(path: &Path) -> Result<Calibration, String> {
    let origin = path.display().to_string();
    let bytes = super::table::bytes(path, MOST_BYTES)?;
    let text = std::str::from_utf8(&bytes).map_err(|_| format!("{origin}: is no UTF-8 text"))?;
    let ends_in =
        |ending: &str| path.extension().is_some_and(|own| own.eq_ignore_ascii_case(ending));
    let bare = |lasers| Calibration { lasers, notes: Vec::new(), digest: String::new() };
    let mut calibration = match () {
        () if ends_in("json") => bare(ouster::lasers(text, &origin)?),
        () if ends_in("csv") => bare(hesai::lasers(text, &origin)?),
        () => parse(text, &origin)?,
    };
    let mut digest = Digest::new();
    digest.bytes(&bytes);
    calibration.digest = digest.text();
    Ok(calibration)
}

/// Returns the fault in the YAML of a calibration, in our words.
fn in_words(error: &Yaml) -> String {
    match error {
        Yaml::AliasError { error, .. } => in_words(error),
        Yaml::SerdeUnknownField { field, expected, .. } => told::unknown("key", field, expected),
        Yaml::SerdeMissingField { field, .. } => format!("the key `{field}` is missing"),
        Yaml::DuplicateMappingKey { key: Some(key), .. } => {
            format!("the key `{key}` stands twice: leave one of them out")
        }
        Yaml::SerdeInvalidType { .. } | Yaml::SerdeInvalidValue { .. } => {
            "must be a number: an angle in rad, a length in m, or the number of a laser".to_owned()
        }
        Yaml::InvalidScalar { ty: "boolean", .. } | Yaml::InvalidBooleanStrict { .. } => {
            "must be true or false".to_owned()
        }
        Yaml::InvalidScalar { ty, .. } if ty.starts_with(['u', 'i']) => {
            "must be a whole number, 0 or more".to_owned()
        }
        Yaml::InvalidScalar { .. } | Yaml::NonFiniteFloat { .. } => "must be a number".to_owned(),
        Yaml::Unexpected { expected: "sequence start", .. } => {
            "a list is wanted here, as `- laser_id: 0`".to_owned()
        }
        Yaml::Unexpected { expected: "mapping start", .. } => {
            "keys and their values are wanted here: a calibration is the YAML of a Velodyne driver, \
             which begins with `lasers:`; a table of a Hesai sensor ends in .csv, and angles of other sensors \
             are listed under scan.spinning.lasers"
                .to_owned()
        }
        Yaml::Unexpected { .. } => "a single value is wanted here".to_owned(),
        Yaml::MultipleDocuments { .. } => {
            "a second document begins here: a calibration is one".to_owned()
        }
        Yaml::Budget { .. }
        | Yaml::AliasReplayCounterOverflow { .. }
        | Yaml::AliasReplayLimitExceeded { .. }
        | Yaml::AliasExpansionLimitExceeded { .. }
        | Yaml::AliasReplayStackDepthExceeded { .. } => {
            "repeats or nests more than a calibration of 1024 lasers does".to_owned()
        }
        Yaml::Eof { .. } => "the file ends here, before the calibration does".to_owned(),
        _ => "is no YAML of a calibration: a line says `key: value`, and a list has a line that begins \
              with `- ` for each entry"
            .to_owned(),
    }
}

/// As [`read`], of a `text`.
fn parse(text: &str, origin: &str) -> Result<Calibration, String> {
    let file: File = serde_saphyr::from_str(text).map_err(|error| {
        let said = in_words(error.without_snippet());
        match error.location() {
            Some(at) => fault(origin, at, &said),
            None => format!("{origin}: {said}"),
        }
    })?;
    let count = file.lasers.len();
    if count == 0 || count > MOST_LASERS {
        return Err(format!("{origin}: lists {count} lasers, but 1 to {MOST_LASERS} are read"));
    }
    if let Some(told) = file.num_lasers.filter(|told| told.value as usize != count) {
        let message = format!("num_lasers is {}, but {count} are listed", told.value);
        return Err(fault(origin, told.defined, &message));
    }
    let mut by_id: Vec<Option<Laser>> = vec![None; count];
    for typed in &file.lasers {
        let id = &typed.laser_id;
        let place = by_id.get_mut(id.value as usize).filter(|place| place.is_none());
        let Some(place) = place else {
            let last = count - 1;
            let message = format!("laser_id {} must be one of 0 to {last}, each once", id.value);
            return Err(fault(origin, id.defined, &message));
        };
        *place = Some(typed.laser(origin)?);
    }
    let notes = left_out(&file.lasers, origin).into_iter().collect();
    Ok(Calibration { lasers: by_id.into_iter().flatten().collect(), notes, digest: String::new() })
}

impl LaserFile {
    /// The laser, checked.
    fn laser(&self, origin: &str) -> Result<Laser, String> {
        let within = |typed: &Spanned<f64>, key: &str, limit: &Limit| {
            let radians = matches!(limit.what, "elevation" | "azimuth");
            let most = if radians { limit.most.to_radians() } else { limit.most };
            if typed.value.abs() <= most {
                return Ok(typed.value);
            }
            let unit = if radians { "rad" } else { "m" };
            let message = format!(
                "{key} is {}, but must lie between -{most:.4} and {most:.4} {unit}",
                typed.value
            );
            Err(fault(origin, typed.defined, &message))
        };
        let or_none = |typed: &Option<Spanned<f64>>, key: &str, limit: &Limit| {
            typed.as_ref().map_or(Ok(0.0), |typed| within(typed, key, limit))
        };
        let elevation = within(&self.vert_correction, "vert_correction", &ELEVATION)?;
        let up = or_none(&self.vert_offset_correction, "vert_offset_correction", &ORIGIN)?;
        let left = or_none(&self.horiz_offset_correction, "horiz_offset_correction", &ORIGIN)?;
        let (sine, cosine) = libm::sincos(elevation);
        // Nothing but zeros where nothing is typed: no −0.
        let forward = if up == 0.0 { 0.0 } else { -up * sine };
        Ok(Laser {
            elevation,
            azimuth: within(&self.rot_correction, "rot_correction", &AZIMUTH)?,
            range_offset: or_none(&self.dist_correction, "dist_correction", &RANGE_OFFSET)?,
            origin: [forward, left, up * cosine],
        })
    }
}

/// Returns the parts of the calibration that are not simulated, as a sentence.
fn left_out(lasers: &[LaserFile], origin: &str) -> Option<String> {
    let set = |value: Option<f64>| value.is_some_and(|value| value != 0.0);
    let near = |laser: &LaserFile| {
        let second = |value: Option<f64>| {
            let whole = laser.dist_correction.as_ref().map(|typed| typed.value);
            set(value) && value != whole
        };
        laser.two_pt_correction_available
            || second(laser.dist_correction_x)
            || second(laser.dist_correction_y)
    };
    let focal = |laser: &LaserFile| set(laser.focal_distance) || set(laser.focal_slope);
    let intensity = |laser: &LaserFile| {
        set(laser.min_intensity) || laser.max_intensity.is_some_and(|most| most != 255.0)
    };
    let keys = [
        (lasers.iter().any(near), "dist_correction_x and dist_correction_y, for near targets"),
        (lasers.iter().any(focal), "focal_distance and focal_slope, of intensities"),
        (lasers.iter().any(intensity), "min_intensity and max_intensity"),
    ];
    let found: Vec<&str> = keys.iter().filter(|key| key.0).map(|key| key.1).collect();
    let said = format!("{origin}: left out are {}", found.join("; "));
    (!found.is_empty()).then_some(said)
}

fn fault(origin: &str, at: Location, message: &str) -> String {
    format!("{origin}:{}:{}: {message}", at.line(), at.column())
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    const TWO: &str = "lasers:\n\
        - {laser_id: 1, rot_correction: -0.05, vert_correction: 0.1, dist_correction: 1.2,\n  \
          vert_offset_correction: 0.2, horiz_offset_correction: -0.026, focal_slope: 1.5}\n\
        - laser_id: 0\n  rot_correction: 0\n  vert_correction: -0.25\n\
        num_lasers: 2\n";

    fn told(text: &str) -> String {
        parse(text, "a.yaml").err().unwrap()
    }

    /// A point of the second laser by the driver's formulae is one on the beam.
    #[test]
    fn a_beam_goes_through_the_points_that_the_driver_has() {
        let read = parse(TWO, "a.yaml").unwrap();
        let [first, laser] = read.lasers[..] else { panic!("two") };
        assert_eq!((first.elevation, first.origin, first.range_offset), (-0.25, [0.0; 3], 0.0));
        assert_eq!((laser.range_offset, laser.azimuth), (1.2, -0.05));
        let (head, measured) = (0.7_f64, 20.0);
        let (turned, range) = (head - -0.05, measured + 1.2);
        let level = range * 0.1_f64.cos() - 0.2 * 0.1_f64.sin();
        let driver = [
            level * turned.cos() + -0.026 * turned.sin(),
            -level * turned.sin() + -0.026 * turned.cos(),
            range * 0.1_f64.sin() + 0.2 * 0.1_f64.cos(),
        ];
        let azimuth = laser.azimuth - head;
        let (sin_a, cos_a) = azimuth.sin_cos();
        let (sin_e, cos_e) = laser.elevation.sin_cos();
        let [x, y, z] = laser.origin;
        let found = [
            x * cos_a - y * sin_a + range * cos_e * cos_a,
            x * sin_a + y * cos_a + range * cos_e * sin_a,
            z + range * sin_e,
        ];
        for (found, driver) in found.into_iter().zip(driver) {
            assert_relative_eq!(found, driver, epsilon = 1e-12);
        }
        assert!(read.notes[0].contains("focal_slope"), "{:?}", read.notes);
    }

    #[test]
    fn what_is_wrong_is_told_with_its_place() {
        for (wrong, right, said) in [
            ("vert_correction: -15.0", "vert_correction: -0.25", "a.yaml:6:20: vert_correction is"),
            ("laser_id: 2", "laser_id: 0", "a.yaml:4:13: laser_id 2 must be one of 0 to 1"),
            ("num_lasers: 3", "num_lasers: 2", "a.yaml:7:13: num_lasers is 3, but 2 are listed"),
            ("rotation: 0", "rot_correction: 0", "rotation"),
            ("rot_correction: left", "rot_correction: 0", "a.yaml"),
        ] {
            assert!(TWO.contains(right), "{right}");
            let message = told(&TWO.replace(right, wrong));
            assert!(message.contains(said), "{wrong}: {message}");
            assert!(!message.contains('\n'), "{message}");
        }
        let twice =
            TWO.replace("vert_correction: 0.1,", "vert_correction: 0.1, vert_correction: 0.1,");
        assert!(
            told(&twice).contains("the key `vert_correction` stands twice"),
            "{}",
            told(&twice)
        );
        let table = told("Laser id,Elevation,Azimuth\n1,14.4,3.3\n");
        assert!(table.contains("a.yaml:1:1: keys and their values are wanted here"), "{table}");
        assert!(told("lasers: []\n").contains("lists 0 lasers"));
        assert!(told("lasers: [").starts_with("a.yaml"));
        assert!(told("").starts_with("a.yaml"));
    }
}

//! Sensor files, and what they name; scans of the sensors that come of them.

use std::path::Path;

use macropulse::design::{Design, family_from_toml};
use macropulse::memory::Estimate;
use macropulse::scene::Scene;
use macropulse::sim;
use macropulse_study::designs::Requirements;

use crate::{assert_says, with_files};

/// Pixels of the largest sensor that is scanned.
const MOST_PIXELS: u64 = 64;

/// Most memory of such a scan, bytes.
const MOST_MEMORY: u64 = 60_000_000;

const OF_A_TABLE: &str = "version = 1\nextends = \"peregrine\"\ntdc.converters = 64\n\
    [scan.table]\nfile = \"any.csv\"\n";

const OF_A_CALIBRATION: &str = "version = 1\nextends = \"vlp-16\"\n\
    [scan.spinning]\nblocks = \"none\"\ncalibration = \"any.yaml\"\n";

fn looked_at(text: &str, folder: &Path) -> Option<Design> {
    match Design::from_toml(text, "any.toml", folder, &[]) {
        Ok(design) => {
            let _ = (design.digest(), design.derived());
            Some(design)
        }
        Err(error) => {
            assert_says(&error);
            None
        }
    }
}

/// Reads `bytes` as what is required of a sensor.
pub fn requirements(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    with_files(&[], |folder| {
        if let Err(error) = Requirements::from_toml(text, "any.toml", folder) {
            assert_says(&error);
        }
    });
}

/// Reads `bytes` as a sensor file.
pub fn sensor(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    with_files(&[], |folder| looked_at(text, folder));
}

/// Reads `bytes` as a sensor file, and if it is one with a few pixels, makes a scan of it.
pub fn scan(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    let Some(design) = with_files(&[], |folder| looked_at(text, folder)) else { return };
    let Ok(scene) = Scene::open("wall") else { return };
    let is_small = |taken: Estimate| taken.total(1) < MOST_MEMORY;
    if design.shots_per_scan() <= MOST_PIXELS
        && Estimate::in_scene(&design, &scene).is_ok_and(is_small)
    {
        match sim::scan(&design, &scene, 1, 0) {
            Ok(scan) => assert!(scan.cloud().x.len() == scan.cloud().returns()),
            Err(error) => assert_says(&error),
        }
    }
}

/// Reads `bytes` as a table of directions.
pub fn directions(bytes: &[u8]) {
    with_files(&[("any.csv", bytes)], |folder| looked_at(OF_A_TABLE, folder));
}

/// Reads `bytes` as the calibration of a turning head.
pub fn calibration(bytes: &[u8]) {
    with_files(&[("any.yaml", bytes)], |folder| looked_at(OF_A_CALIBRATION, folder));
}

/// Reads `bytes` as a code.
pub fn code(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    if let Err(error) = family_from_toml(text) {
        assert_says(&error);
    }
}

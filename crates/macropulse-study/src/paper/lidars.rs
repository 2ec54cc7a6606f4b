//! Five lidars that differ in how they measure range, and share field, rate, optics and eye safety.

use super::Error;
use macropulse::design::Design;

/// A lidar made of a ready sensor by changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Lidar {
    /// Its name on the page: how it measures range.
    pub name: &'static str,
    /// The ready sensor that it is made of.
    pub sensor: &'static str,
    /// Its changes beside those that all share.
    changes: &'static [&'static [(&'static str, &'static str)]],
}

/// The lidars side by side.
pub const LIDARS: [Lidar; 5] = [
    Lidar { name: "coded", sensor: "coded-practical", changes: &[FIELD] },
    Lidar { name: PULSED, sensor: "vlp-16", changes: &[FIELD] },
    Lidar { name: "histogram", sensor: "spad-spinning", changes: &[FIELD, &[BURST, BINS]] },
    Lidar { name: AMCW, sensor: "amcw-scanner", changes: &[FIELD, &[SAFE, EXPOSURE, TONES]] },
    Lidar { name: FMCW, sensor: "fmcw-1550", changes: &[&[SPEED, ("receiver.returns", "1")]] },
];

/// Name of the lidar that times single pulses.
pub const PULSED: &str = "pulsed";

/// Name of the lidar of modulated amplitude.
pub const AMCW: &str = "AMCW";

/// Name of the lidar of modulated frequency.
pub const FMCW: &str = "FMCW";

/// Range gate of all five, m.
pub(super) const GATE: f64 = 220.0;

/// The changes that all share: field, rate, gate, wavelength, beam, optics, eye safety, and when a point is right.
const SHARED: &[(&str, &str)] = &[
    (
        "scan.raster",
        "{ rows = 16, columns = 64, beams = 1, horizontal_deg = 24.0, vertical_deg = 6.0 }",
    ),
    ("scan.scans_per_s", "2.5"),
    ("scan.min_range_m", "1.0"),
    ("scan.max_range_m", "220.0"),
    ("scan.light_range_m", "220.0"),
    ("light.wavelength_nm", "905.0"),
    ("light.energy", "\"class-1\""),
    ("light.beam_diameter_mm", "8.0"),
    ("light.divergence_mrad", "0.3"),
    ("light.footprint_rays", "7"),
    ("optics.aperture_mm", "15.0"),
    ("optics.transmission", "0.7"),
    ("receiver.right_within_m", "0.3"),
];

/// Filter and field of view of detectors that are not coherent.
const FIELD: &[(&str, &str)] =
    &[("optics.filter_nm", "10.0"), ("optics.field", "{ cone_mrad = 1.0 }")];

/// Pulses wait until the echoes of the one before are back.
const BURST: (&str, &str) = ("burst.interval_ns", "1500.0");
const BINS: (&str, &str) = ("histogram.bins", "750");

/// The ready scanner has more light than class 1 allows.
const SAFE: (&str, &str) = ("idealised", "[\"mirror-motion\"]");

/// Taps last 20 times as long as light is on its way.
const EXPOSURE: (&str, &str) = ("modulation.exposure_us", "30.0");

/// The lowest frequency repeats after 240 m, beyond the gate.
const TONES: (&str, &str) = ("modulation.frequencies_mhz", "[40.0, 5.0, 0.625]");

/// Nothing moves. The converter takes the beats of the farthest surface.
const SPEED: (&str, &str) = ("receiver.max_speed_m_s", "20.0");

/// The lidar with this name.
pub(super) fn named(name: &str) -> &'static Lidar {
    LIDARS.iter().find(|lidar| lidar.name == name).unwrap_or(&LIDARS[0])
}

impl Lidar {
    /// The sensor with its changes, and with `further` ones.
    pub(super) fn design(&self, further: &[(&str, &str)]) -> Result<Design, Error> {
        let own = self.changes.iter().copied().flatten();
        let all = SHARED.iter().chain(own).chain(further);
        let set: Vec<_> =
            all.map(|(key, value)| ((*key).to_owned(), (*value).to_owned())).collect();
        Ok(Design::open(self.sensor, &set)?)
    }
}

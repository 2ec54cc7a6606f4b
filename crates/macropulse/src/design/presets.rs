//! The sensors that come with the program.

/// The keys that a sensor file may leave out, with their values.
pub(super) const DEFAULTS: &str = include_str!("../../../../sensors/defaults.toml");

const PRESETS: [(&str, &str); 20] = [
    ("kim-park-2016", include_str!("../../../../sensors/kim-park-2016.toml")),
    ("kim-park-2016-fixed", include_str!("../../../../sensors/kim-park-2016-fixed.toml")),
    ("kim-park-2016-physical", include_str!("../../../../sensors/kim-park-2016-physical.toml")),
    ("coded-32", include_str!("../../../../sensors/coded-32.toml")),
    ("coded-16", include_str!("../../../../sensors/coded-16.toml")),
    ("coded-practical", include_str!("../../../../sensors/coded-practical.toml")),
    ("coded-360", include_str!("../../../../sensors/coded-360.toml")),
    ("bipolar-gold", include_str!("../../../../sensors/bipolar-gold.toml")),
    ("hdl-64e", include_str!("../../../../sensors/hdl-64e.toml")),
    ("hdl-64e-equal-spacing", include_str!("../../../../sensors/hdl-64e-equal-spacing.toml")),
    ("vlp-16", include_str!("../../../../sensors/vlp-16.toml")),
    ("rosette-mid-40", include_str!("../../../../sensors/rosette-mid-40.toml")),
    ("peregrine", include_str!("../../../../sensors/peregrine.toml")),
    ("spad-flash", include_str!("../../../../sensors/spad-flash.toml")),
    ("spad-spinning", include_str!("../../../../sensors/spad-spinning.toml")),
    ("tmf8820", include_str!("../../../../sensors/tmf8820.toml")),
    ("itof-camera", include_str!("../../../../sensors/itof-camera.toml")),
    ("kinect-v2", include_str!("../../../../sensors/kinect-v2.toml")),
    ("amcw-scanner", include_str!("../../../../sensors/amcw-scanner.toml")),
    ("fmcw-1550", include_str!("../../../../sensors/fmcw-1550.toml")),
];

/// Names of the ready sensors.
pub fn names() -> impl Iterator<Item = &'static str> {
    PRESETS.iter().map(|(name, _)| *name)
}

/// The TOML of a ready sensor, to start from.
pub fn text(name: &str) -> Option<&'static str> {
    PRESETS.iter().find(|(known, _)| *known == name).map(|(_, text)| *text)
}

/// The sentence for a name that is neither a ready sensor nor a file.
pub(super) fn unknown(name: &str) -> String {
    let known: Vec<&str> = names().collect();
    let hint = crate::names::nearest(name, known.iter().copied())
        .map(|near| format!("did you mean `{near}`? "))
        .unwrap_or_default();
    format!("no such sensor; {hint}ready ones: {}; or give a .toml file", known.join(", "))
}

//! The environments that need no file.

/// Name and text of each, in the order in which they are listed.
const ENVIRONMENTS: &[(&str, &str)] = &[
    ("vacuum-dark", include_str!("../../../../environments/vacuum-dark.toml")),
    ("clear-day", include_str!("../../../../environments/clear-day.toml")),
    ("overcast", include_str!("../../../../environments/overcast.toml")),
    ("night", include_str!("../../../../environments/night.toml")),
    ("fog-50m", include_str!("../../../../environments/fog-50m.toml")),
    ("rain-25mm", include_str!("../../../../environments/rain-25mm.toml")),
];

/// The TOML text of the ready environment called `name`.
pub fn text(name: &str) -> Option<&'static str> {
    ENVIRONMENTS.iter().find(|(known, _)| *known == name).map(|(_, text)| *text)
}

/// The names of the ready environments.
pub fn names() -> impl Iterator<Item = &'static str> {
    ENVIRONMENTS.iter().map(|(name, _)| *name)
}

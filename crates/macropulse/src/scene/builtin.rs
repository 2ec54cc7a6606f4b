//! The scenes that need no file.

/// Name and text of each, in the order in which they are listed.
const SCENES: &[(&str, &str)] = &[
    ("car-30m", include_str!("../../../../scenes/car-30m.toml")),
    ("car-50m", include_str!("../../../../scenes/car-50m.toml")),
    ("car-70m", include_str!("../../../../scenes/car-70m.toml")),
    ("car-120m", include_str!("../../../../scenes/car-120m.toml")),
    ("wall", include_str!("../../../../scenes/wall.toml")),
    ("crossing", include_str!("../../../../scenes/crossing.toml")),
    ("street", include_str!("../../../../scenes/street.toml")),
];

/// The TOML text of the built-in scene called `name`.
pub(super) fn text(name: &str) -> Option<&'static str> {
    SCENES.iter().find(|scene| scene.0 == name).map(|scene| scene.1)
}

/// The names of the built-in scenes.
pub fn builtin_names() -> impl Iterator<Item = &'static str> {
    SCENES.iter().map(|scene| scene.0)
}

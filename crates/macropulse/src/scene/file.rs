//! The scene file as it is typed: TOML with unit-suffixed keys.
//!
//! This file knows the words and their places; [`super::assemble`] knows what they mean.

use std::collections::{BTreeMap, HashSet};
use std::ops::Range;

use serde::Deserialize;
use toml::{Spanned, Table};

use super::error::Error;
use crate::names::{key_at, line_column, nearest, offset_of_key};

/// A whole scene file.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SceneFile {
    pub version: Spanned<i64>,
    pub name: Option<String>,
    #[serde(default)]
    pub sensor: Stand,
    pub environment: Option<Spanned<toml::Value>>,
    pub ground: Option<Ground>,
    #[serde(default, rename = "material")]
    pub materials: Vec<Spanned<Defined>>,
    #[serde(default, rename = "object")]
    pub objects: Vec<Spanned<ObjectTyped>>,
    #[serde(default)]
    pub interferers: Vec<Spanned<InterfererTyped>>,
}

/// `[[interferers]]`
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct InterfererTyped {
    pub name: Option<String>,
    pub sensor: Spanned<String>,
    #[serde(default)]
    pub set: Table,
    pub position_m: Option<Spanned<[f64; 3]>>,
    pub yaw_deg: Option<Spanned<f64>>,
    pub pitch_deg: Option<Spanned<f64>>,
    pub roll_deg: Option<Spanned<f64>>,
    pub phase_ns: Option<Spanned<f64>>,
    pub drift_ppm: Option<Spanned<f64>>,
}

impl InterfererTyped {
    /// Where the lidar stands.
    pub(super) fn stand(&self) -> Stand {
        Stand {
            position_m: self.position_m.clone(),
            yaw_deg: self.yaw_deg.clone(),
            pitch_deg: self.pitch_deg.clone(),
            roll_deg: self.roll_deg.clone(),
            ..Stand::default()
        }
    }
}

/// `[sensor]`, and each entry of `copies`.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Stand {
    pub position_m: Option<Spanned<[f64; 3]>>,
    pub yaw_deg: Option<Spanned<f64>>,
    pub pitch_deg: Option<Spanned<f64>>,
    pub roll_deg: Option<Spanned<f64>>,
    pub velocity_m_s: Option<Spanned<[f64; 3]>>,
    pub turn_rate_deg_s: Option<Spanned<f64>>,
}

/// `ground = { … }`
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Ground {
    pub material: Spanned<String>,
    pub z_m: Option<Spanned<f64>>,
    /// Known only to be refused.
    pub velocity_m_s: Option<Spanned<toml::Value>>,
    pub turn_rate_deg_s: Option<Spanned<toml::Value>>,
}

/// `[[material]]`
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Defined {
    pub name: String,
    pub diffuse: Option<Spanned<f64>>,
    pub specular: Option<Spanned<f64>>,
    pub gloss: Option<Spanned<f64>>,
    pub retro: Option<Spanned<f64>>,
    pub transmission: Option<Spanned<f64>>,
}

/// `[[object]]`
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ObjectTyped {
    pub name: Option<Spanned<String>>,
    pub mesh: Option<Spanned<String>>,
    pub car: Option<Car>,
    pub shape: Option<Spanned<ShapeTyped>>,
    pub unit: Option<Unit>,
    pub scale: Option<Spanned<f64>>,
    pub up: Option<Spanned<Axis>>,
    pub forward: Option<Spanned<Axis>>,
    pub position_m: Option<Spanned<[f64; 3]>>,
    pub yaw_deg: Option<Spanned<f64>>,
    pub pitch_deg: Option<Spanned<f64>>,
    pub roll_deg: Option<Spanned<f64>>,
    pub velocity_m_s: Option<Spanned<[f64; 3]>>,
    pub turn_rate_deg_s: Option<Spanned<f64>>,
    #[serde(default)]
    pub rest_on_ground: bool,
    pub material: Option<Spanned<String>>,
    #[serde(default)]
    pub materials: BTreeMap<String, Spanned<String>>,
    #[serde(default)]
    pub target: bool,
    #[serde(default)]
    pub copies: Vec<Stand>,
}

impl ObjectTyped {
    /// Where the object itself stands, and how it moves.
    pub(super) fn stand(&self) -> Stand {
        Stand {
            position_m: self.position_m.clone(),
            yaw_deg: self.yaw_deg.clone(),
            pitch_deg: self.pitch_deg.clone(),
            roll_deg: self.roll_deg.clone(),
            velocity_m_s: self.velocity_m_s.clone(),
            turn_rate_deg_s: self.turn_rate_deg_s.clone(),
        }
    }
}

/// `car = {}`: it has no options yet.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Car {}

/// `shape = { … }`
#[derive(Debug, Clone, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub(super) enum ShapeTyped {
    /// `normal` is a direction in the frame of the object.
    Plane { normal: [f64; 3] },
    /// About the object's position.
    Sphere { radius_m: f64 },
    /// About the object's position; length, width, height.
    Box { size_m: [f64; 3] },
    /// Upright, about the object's position.
    Cylinder { radius_m: f64, height_m: f64 },
    /// Upright, about the object's position, the tip up.
    Cone {
        radius_m: f64,
        height_m: f64,
        #[serde(default)]
        top_radius_m: f64,
    },
    /// Upright, about the object's position; its height with both half balls.
    Capsule { radius_m: f64, height_m: f64 },
    /// About the object's position; length, width, height.
    Ellipsoid { size_m: [f64; 3] },
    /// Stands on the object's position and looks along x.
    Person { height_m: f64 },
}

/// The unit of length of a mesh.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Unit {
    M,
    Cm,
    Mm,
    In,
    Ft,
}

impl Unit {
    /// Length of the unit, m.
    pub(super) fn metres(self) -> f64 {
        match self {
            Self::M => 1.0,
            Self::Cm => 0.01,
            Self::Mm => 0.001,
            Self::In => 0.0254,
            Self::Ft => 0.3048,
        }
    }
}

/// A signed axis of a mesh.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub(super) enum Axis {
    #[serde(rename = "x", alias = "+x")]
    X,
    #[serde(rename = "y", alias = "+y")]
    Y,
    #[serde(rename = "z", alias = "+z")]
    Z,
    #[serde(rename = "-x")]
    MinusX,
    #[serde(rename = "-y")]
    MinusY,
    #[serde(rename = "-z")]
    MinusZ,
}

impl Axis {
    /// The axis as a unit vector.
    pub(super) fn vector(self) -> [f64; 3] {
        match self {
            Self::X => [1.0, 0.0, 0.0],
            Self::Y => [0.0, 1.0, 0.0],
            Self::Z => [0.0, 0.0, 1.0],
            Self::MinusX => [-1.0, 0.0, 0.0],
            Self::MinusY => [0.0, -1.0, 0.0],
            Self::MinusZ => [0.0, 0.0, -1.0],
        }
    }

    /// The axis as it is typed.
    pub(super) fn word(self) -> &'static str {
        match self {
            Self::X => "x",
            Self::Y => "y",
            Self::Z => "z",
            Self::MinusX => "-x",
            Self::MinusY => "-y",
            Self::MinusZ => "-z",
        }
    }
}

/// What objects are called, in their order, of which these names are typed. One without a name is
/// called by its number, from 1; where another has that name, by as many more as it takes.
pub(super) fn object_names(typed: &[Option<&str>]) -> Vec<String> {
    let taken: HashSet<&str> = typed.iter().copied().flatten().collect();
    let automatic = |index: usize| {
        let further = (2..).map(|more| format!("object-{}-{more}", index + 1));
        let mut names = std::iter::once(format!("object-{}", index + 1)).chain(further);
        names.find(|name| !taken.contains(name.as_str())).unwrap_or_default()
    };
    let name = |(index, typed): (usize, &Option<&str>)| match typed {
        Some(name) => (*name).to_owned(),
        None => automatic(index),
    };
    typed.iter().enumerate().map(name).collect()
}

/// The text of a scene and its name: finds the place of what is wrong.
#[derive(Clone, Copy)]
pub(super) struct Source<'a> {
    pub text: &'a str,
    pub origin: &'a str,
    pub place: Place,
}

/// What is told as the place of what is wrong.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Place {
    /// Line and column, of a text that people have typed.
    Line,
    /// The key, where a program has made the text of a table.
    Key,
}

impl<'a> Source<'a> {
    /// A text as it was typed.
    pub(super) fn typed(text: &'a str, origin: &'a str) -> Self {
        Self { text, origin, place: Place::Line }
    }

    /// Reads the file.
    pub(super) fn parse(&self) -> Result<SceneFile, Error> {
        toml::from_str(self.text)
            .map_err(|fault| self.fault(fault.span().unwrap_or(0..0), with_advice(fault.message())))
    }

    /// An error at the dotted `key`, or else at `span`.
    pub(super) fn fault_at_key(
        &self,
        key: &str,
        span: Range<usize>,
        message: impl Into<String>,
    ) -> Error {
        let span = offset_of_key(self.text, key).map_or(span, |at| at..at);
        self.fault(span, message)
    }

    /// An error at a place in the text.
    pub(super) fn fault(&self, span: Range<usize>, message: impl Into<String>) -> Error {
        let (origin, message) = (self.origin.to_owned(), message.into());
        if self.place == Place::Key {
            // What is missing has the whole text as its place, or none.
            let is_whole = span == (0..0) || span == (0..self.text.len());
            let key = key_at(self.text, span.start).filter(|_| !is_whole).unwrap_or_default();
            return Error::Keyed { origin, key, message };
        }
        let (line, column) = line_column(self.text, span.start);
        Error::Typed { origin, line, column, message }
    }
}

/// Adds the nearest known word to a complaint about an unknown one. The parser quotes words in
/// backticks: first the unknown one, then those it knows.
fn with_advice(message: &str) -> String {
    let mut quoted = message.split('`').skip(1).step_by(2);
    let unknown = message.starts_with("unknown");
    match quoted.next().filter(|_| unknown).and_then(|word| nearest(word, quoted)) {
        Some(known) => format!("{message}; did you mean `{known}`?"),
        None => message.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(text: &str) -> String {
        Source::typed(text, "a.toml").parse().unwrap_err().to_string()
    }

    #[test]
    fn a_small_scene_is_read() {
        let text = "version = 1\n[[object]]\nshape.sphere.radius_m = 2\nposition_m = [10, 0, 0]\n";
        let scene = Source::typed(text, "a.toml").parse().unwrap();
        assert_eq!(scene.objects[0].get_ref().position_m.as_ref().unwrap().get_ref()[0], 10.0);
    }

    #[test]
    fn an_unknown_key_is_named_with_its_place_and_the_nearest_known_one() {
        let message = told("version = 1\n[[object]]\n  positon_m = [1, 0, 0]\n");
        assert!(message.starts_with("a.toml:3:3: unknown field `positon_m`"), "{message}");
        assert!(message.ends_with("did you mean `position_m`?"), "{message}");
    }

    #[test]
    fn objects_without_a_name_get_one_of_their_own() {
        let names = object_names(&[None, Some("object-1"), Some("wall"), None, Some("object-1-2")]);
        assert_eq!(names, ["object-1-3", "object-1", "wall", "object-4", "object-1-2"]);
    }

    #[test]
    fn wrong_types_and_missing_keys_are_refused() {
        assert!(told("version = 1\nname = 3\n").starts_with("a.toml:2:8: invalid type"));
        assert!(told("name = \"a\"\n").contains("missing field `version`"));
        assert!(told("version = 1\n[[object]]\nunit = \"km\"\n").contains("unknown variant `km`"));
    }
}

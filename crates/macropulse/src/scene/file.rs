//! The scene file as it is typed: TOML with unit-suffixed keys.
//!
//! This file knows the words and their places; [`super::assemble`] knows what they mean.

use std::collections::{BTreeMap, HashSet};
use std::ops::Range;

use schemars::JsonSchema;
use serde::Deserialize;
use toml::Table;

use super::error::Error;
use super::schema;
use super::spanned::{Spanned, Triple};
use super::stand::{Stand, WaypointTyped};
use crate::names::{key_at, line_column, offset_of_key};
use crate::schema::{Refusal, read_text};

/// Keys whose tables are many, each with a header in two brackets.
const LISTS: [&str; 3] = ["material", "object", "interferers"];

/// A whole scene file.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct SceneFile {
    /// Format of this file: 1.
    #[schemars(range(min = 1, max = 1))]
    pub version: Spanned<i64>,
    /// Short name; that of the file unless it is given.
    pub name: Option<String>,
    /// Position, angles and motion of the sensor.
    #[serde(default)]
    pub sensor: Stand,
    /// Sun and air: the name of a ready environment, or a table of its keys. Without it
    /// `clear-day`.
    #[serde(default)]
    #[schemars(schema_with = "schema::environment")]
    pub environment: Option<Spanned<toml::Value>>,
    /// True if meshes may name files outside the folder of the scene: their materials, their buffers.
    #[serde(default)]
    pub outside_files: bool,
    /// An endless plane.
    pub ground: Option<Ground>,
    /// Materials of the scene's own, or in place of those of the library.
    #[serde(default, rename = "material")]
    pub materials: Vec<Spanned<Defined>>,
    /// Objects of the scene.
    #[serde(default, rename = "object")]
    pub objects: Vec<Spanned<ObjectTyped>>,
    /// Other lidars that shine into the scene.
    #[serde(default)]
    #[schemars(length(max = 255))]
    pub interferers: Vec<Spanned<InterfererTyped>>,
}

/// `[[interferers]]`
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct InterfererTyped {
    /// Name; that of its sensor with a number unless it is given.
    pub name: Option<String>,
    /// Ready sensor, or a file, from the folder of the scene.
    #[schemars(schema_with = "schema::sensor")]
    pub sensor: Spanned<String>,
    /// Values of it that are changed, as { "code.word.first" = 15 }.
    #[serde(default)]
    #[schemars(with = "serde_json::Map<String, serde_json::Value>")]
    pub set: Table,
    /// Position, m: x forward, y left, z up.
    pub position_m: Option<Spanned<Triple>>,
    /// Turn to the left, degrees.
    #[schemars(range(min = -36000, max = 36000))]
    pub yaw_deg: Option<Spanned<f64>>,
    /// Tilt, degrees: positive looks down.
    #[schemars(range(min = -36000, max = 36000))]
    pub pitch_deg: Option<Spanned<f64>>,
    /// Roll, degrees: positive lifts the left side.
    #[schemars(range(min = -36000, max = 36000))]
    pub roll_deg: Option<Spanned<f64>>,
    /// Motion in the world, m/s; the position is where it is when the first scan begins.
    #[serde(default)]
    #[schemars(schema_with = "schema::velocity")]
    pub velocity_m_s: Option<Spanned<Triple>>,
    /// Turn about the vertical axis through the position, degrees per second, positive to the left.
    #[schemars(range(min = -1e5, max = 1e5))]
    pub turn_rate_deg_s: Option<Spanned<f64>>,
    /// Poses at ascending times, in place of position, angles and motion: straight on and evenly turning in between.
    #[schemars(length(min = 2))]
    pub path: Option<Spanned<Vec<Spanned<WaypointTyped>>>>,
    /// Time of ours at which its clock reads 0, ns.
    #[schemars(range(min = -1e12, max = 1e12))]
    pub phase_ns: Option<Spanned<f64>>,
    /// Millionths by which its clock runs fast.
    #[schemars(range(min = -1000, max = 1000))]
    pub drift_ppm: Option<Spanned<f64>>,
}

impl InterfererTyped {
    /// Position, angles and motion of the lidar.
    pub(super) fn stand(&self) -> Stand {
        Stand {
            position_m: self.position_m.clone(),
            yaw_deg: self.yaw_deg.clone(),
            pitch_deg: self.pitch_deg.clone(),
            roll_deg: self.roll_deg.clone(),
            velocity_m_s: self.velocity_m_s.clone(),
            turn_rate_deg_s: self.turn_rate_deg_s.clone(),
            path: self.path.clone(),
        }
    }
}

/// `ground = { … }`
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct Ground {
    /// Its material: one of the library, or one of the scene.
    #[schemars(schema_with = "schema::material")]
    pub material: Spanned<String>,
    /// Its height, m.
    pub z_m: Option<Spanned<f64>>,
    // Known only to be refused.
    #[schemars(skip)]
    pub velocity_m_s: Option<Spanned<toml::Value>>,
    #[schemars(skip)]
    pub turn_rate_deg_s: Option<Spanned<toml::Value>>,
    #[schemars(skip)]
    pub path: Option<Spanned<toml::Value>>,
}

/// `[[material]]`
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct Defined {
    /// Name; case, spaces and underscores do not matter.
    pub name: String,
    /// Lambertian reflectance, 0 to 1; may be left out for a material of the library.
    #[schemars(range(min = 0, max = 1))]
    pub diffuse: Option<Spanned<f64>>,
    /// Height of the specular lobe over a white surface.
    #[schemars(range(min = 0, max = 1e4))]
    pub specular: Option<Spanned<f64>>,
    /// Exponent of the lobe: the larger, the narrower it is.
    #[schemars(range(min = 0, max = 1e6))]
    pub gloss: Option<Spanned<f64>>,
    /// Retroreflective gain over a white surface.
    #[schemars(range(min = 0, max = 1e5))]
    pub retro: Option<Spanned<f64>>,
    /// Transmission, one way, 0 to 1.
    #[schemars(range(min = 0, max = 1))]
    pub transmission: Option<Spanned<f64>>,
}

/// `[[object]]`
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(extend("oneOf" = [
    { "required": ["mesh"] }, { "required": ["car"] }, { "required": ["shape"] }
]))]
pub(super) struct ObjectTyped {
    /// Name, which no other object has; `object-N` unless it is given.
    pub name: Option<Spanned<String>>,
    /// OBJ, STL, PLY, glTF or GLB file, from the folder of the scene; or `car`, or `shape`.
    pub mesh: Option<Spanned<String>>,
    /// A saloon of 4.70 × 1.82 × 1.42 m that looks along x and stands on z = 0; or `mesh`, or
    /// `shape`.
    pub car: Option<Car>,
    /// A shape about the position, upright; or `mesh`, or `car`.
    pub shape: Option<Spanned<ShapeTyped>>,
    /// Unit of length of the mesh; metres unless it is given.
    pub unit: Option<Spanned<Unit>>,
    /// Number by which the mesh is multiplied.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub scale: Option<Spanned<f64>>,
    /// Axis of the mesh that points up; `z` unless it is given, `y` of glTF.
    pub up: Option<Spanned<Axis>>,
    /// Axis of the mesh that points forward; `x` unless it is given, `z` of glTF.
    pub forward: Option<Spanned<Axis>>,
    /// Position, m: x forward, y left, z up.
    pub position_m: Option<Spanned<Triple>>,
    /// Turn to the left, degrees.
    #[schemars(range(min = -36000, max = 36000))]
    pub yaw_deg: Option<Spanned<f64>>,
    /// Tilt, degrees: positive looks down.
    #[schemars(range(min = -36000, max = 36000))]
    pub pitch_deg: Option<Spanned<f64>>,
    /// Roll, degrees: positive lifts the left side.
    #[schemars(range(min = -36000, max = 36000))]
    pub roll_deg: Option<Spanned<f64>>,
    /// Motion in the world, m/s; the position is where it is when the first scan begins.
    #[serde(default)]
    #[schemars(schema_with = "schema::velocity")]
    pub velocity_m_s: Option<Spanned<Triple>>,
    /// Turn about the vertical axis through the position, degrees per second, positive to the left.
    #[schemars(range(min = -1e5, max = 1e5))]
    pub turn_rate_deg_s: Option<Spanned<f64>>,
    /// Poses at ascending times, in place of position, angles and motion: straight on and evenly turning in between.
    #[schemars(length(min = 2))]
    pub path: Option<Spanned<Vec<Spanned<WaypointTyped>>>>,
    /// True if the object is lifted so that its lowest point is at its z.
    #[serde(default)]
    pub rest_on_ground: bool,
    /// Material of the whole object: one of the library, or of the scene.
    #[serde(default)]
    #[schemars(schema_with = "schema::material")]
    pub material: Option<Spanned<String>>,
    /// Materials by their names in the mesh, as { "name in the mesh" = "material" }; they win over
    /// `material`.
    #[serde(default)]
    #[schemars(schema_with = "schema::materials")]
    pub materials: BTreeMap<String, Spanned<String>>,
    /// True if the points on it are counted.
    #[serde(default)]
    pub target: bool,
    /// Further positions and angles, each with a motion of its own or none.
    #[serde(default)]
    pub copies: Vec<Stand>,
}

impl ObjectTyped {
    /// Position, angles and motion of the object itself.
    pub(super) fn stand(&self) -> Stand {
        Stand {
            position_m: self.position_m.clone(),
            yaw_deg: self.yaw_deg.clone(),
            pitch_deg: self.pitch_deg.clone(),
            roll_deg: self.roll_deg.clone(),
            velocity_m_s: self.velocity_m_s.clone(),
            turn_rate_deg_s: self.turn_rate_deg_s.clone(),
            path: self.path.clone(),
        }
    }
}

/// `car = {}`: it has no options yet.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct Car {}

/// `shape = { … }`
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub(super) enum ShapeTyped {
    /// Without end, through the object's position; `normal` is a direction in its frame.
    Plane { normal: Triple },
    /// About the object's position; radius in metres.
    Sphere {
        #[schemars(extend("exclusiveMinimum" = 0))]
        radius_m: f64,
    },
    /// About the object's position; length, width, height in metres.
    Box {
        #[schemars(schema_with = "schema::size")]
        size_m: Triple,
    },
    /// Upright, about the object's position; radius and height in metres.
    Cylinder {
        #[schemars(extend("exclusiveMinimum" = 0))]
        radius_m: f64,
        #[schemars(extend("exclusiveMinimum" = 0))]
        height_m: f64,
    },
    /// Upright, about the object's position, the tip up; in metres.
    Cone {
        #[schemars(extend("exclusiveMinimum" = 0))]
        radius_m: f64,
        #[schemars(extend("exclusiveMinimum" = 0))]
        height_m: f64,
        #[serde(default)]
        #[schemars(range(min = 0))]
        top_radius_m: f64,
    },
    /// Upright, about the object's position; in metres, its height with both half balls.
    Capsule {
        #[schemars(extend("exclusiveMinimum" = 0))]
        radius_m: f64,
        #[schemars(extend("exclusiveMinimum" = 0))]
        height_m: f64,
    },
    /// About the object's position; length, width, height in metres.
    Ellipsoid {
        #[schemars(schema_with = "schema::size")]
        size_m: Triple,
    },
    /// Stands on the object's position and looks along x; from 0.4 to 2.6 m high.
    Person {
        #[schemars(range(min = 0.4, max = 2.6))]
        height_m: f64,
    },
}

/// The unit of length of a mesh.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
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
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[schemars(extend("enum" = ["x", "+x", "y", "+y", "z", "+z", "-x", "-y", "-z"]))]
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

/// Returns the names of objects, in their order; `typed` has the names that are typed. An object without a
/// name is called by its number, from 1. If another has that name, a further number follows, from 2: the
/// first that is free.
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

/// Form in which a message names the place of a fault.
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
        read_text(self.text).map_err(|refusal| {
            let message = self.sentence(&refusal);
            self.fault(refusal.span, message)
        })
    }

    /// The sentence about a fault at its place.
    fn sentence(&self, Refusal { path, message, .. }: &Refusal) -> String {
        match (LISTS.contains(&path.as_str()), self.place) {
            (true, Place::Line) => {
                return format!("write [[{path}]], in two brackets: there may be several");
            }
            (true, Place::Key) => return "must be a list: there may be several".to_owned(),
            (false, _) => {}
        }
        // The place is the key itself where the text is not of a file.
        let key = path.rsplit('.').next().unwrap_or_default();
        let is_of_a_key = ["is ", "has ", "must "].iter().any(|begin| message.starts_with(begin));
        match is_of_a_key && !key.is_empty() && self.place == Place::Line {
            true => format!("`{key}` {message}"),
            false => message.clone(),
        }
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
            // A missing key has the whole text as its place, or none.
            let is_whole = span == (0..0) || span == (0..self.text.len());
            let key = key_at(self.text, span.start).filter(|_| !is_whole).unwrap_or_default();
            return Error::Keyed { origin, key, message };
        }
        let (line, column) = line_column(self.text, span.start);
        Error::Typed { origin, line, column, message }
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
        assert_eq!(scene.objects[0].get_ref().position_m.as_ref().unwrap().get_ref().0[0], 10.0);
    }

    #[test]
    fn an_unknown_key_is_named_with_its_place_and_the_nearest_known_one() {
        let message = told("version = 1\n[[object]]\n  positon_m = [1, 0, 0]\n");
        assert!(message.starts_with("a.toml:3:3: unknown key `positon_m`"), "{message}");
        assert!(message.ends_with("did you mean `position_m`?"), "{message}");
    }

    #[test]
    fn objects_without_a_name_get_one_of_their_own() {
        let names = object_names(&[None, Some("object-1"), Some("wall"), None, Some("object-1-2")]);
        assert_eq!(names, ["object-1-3", "object-1", "wall", "object-4", "object-1-2"]);
    }

    #[test]
    fn wrong_types_and_missing_keys_are_refused() {
        let told = |text: &str| told(&format!("version = 1\n{text}"));
        let wrong = told("name = 3\n");
        assert_eq!(wrong, "a.toml:2:8: `name` is 3, but must be text in quotes");
        let wrong = told("[[object]]\nshape = { box = { size_m = [1, 2] } }\n");
        assert!(
            wrong.ends_with(
                "`size_m` has 2 entries, but must be a list of 3 numbers, as [1.0, 2.0, 3.0]"
            ),
            "{wrong}"
        );
        assert!(told("[object]\n").contains("write [[object]], in two brackets"));
        assert!(
            told("[[object]]\nunit = \"km\"\n")
                .contains("unknown value `km`; known are m, cm, mm, in, ft")
        );
        assert!(told("name = a\n").contains("is not TOML: text stands in quotes"));
        let missing = Source::typed("name = \"a\"\n", "a.toml").parse().unwrap_err().to_string();
        assert!(missing.contains("the key `version` is missing"), "{missing}");
    }
}

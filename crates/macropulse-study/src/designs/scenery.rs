//! Scenes on which candidates are tried: a target at the range wanted all around, and a field of tiles. Each
//! tile covers some pixels, and the ranges of tiles are independent of each other.

use std::collections::BTreeMap;
use std::path::Path;

use macropulse::random::{Chance, Stage};
use macropulse::scene::{Mesh, Scene};
use serde::{Deserialize, Serialize};

use super::Error;
use super::requirements::Requirements;

/// A scene on which candidates are tried.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Scenery {
    /// A target of the reflectance wanted just within the range wanted, in every direction.
    Wall,
    /// Tiles of one to twenty-three pixels of a row. A quarter of them are open sky; the others stand
    /// anywhere from 4 m to the farthest thing that may answer. They are as bright as the target, three or
    /// eight times as bright. This is like a street, without any order that could help.
    Tiles,
}

/// Nearest tile, m.
const NEAREST: f64 = 4.0;

/// Share of the tiles that are sky.
const SKY: f64 = 0.25;

/// Longest tile, pixels.
const LONGEST: f64 = 23.0;

/// How bright tiles are, in targets; none more than [`BRIGHTEST`].
const BRIGHTNESS: [f64; 3] = [1.0, 3.0, 8.0];

/// Reflectance of the brightest tile at most.
const BRIGHTEST: f64 = 0.9;

/// Range of the wall, over the range wanted. It lies within the gate by more than any error.
const WITHIN: f64 = 0.993;

/// A scene, and what is known of each pixel without casting a ray.
#[derive(Debug)]
pub(super) struct Set {
    pub scene: Scene,
    columns: usize,
    /// Range of each pixel, m, row by row; NaN where there is only sky.
    ranges: Vec<f32>,
}

impl Set {
    /// Range of a pixel, m; NaN where there is nothing, and outside the field.
    pub fn range(&self, row: i64, column: i64) -> f64 {
        let columns = self.columns as i64;
        let rows = (self.ranges.len() as i64) / columns;
        match (0..rows).contains(&row) && (0..columns).contains(&column) {
            true => f64::from(self.ranges[(row * columns + column) as usize]),
            false => f64::NAN,
        }
    }
}

impl Scenery {
    /// All of them.
    pub const ALL: [Self; 2] = [Self::Wall, Self::Tiles];

    /// Returns its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Wall => "wall",
            Self::Tiles => "tiles",
        }
    }

    /// Makes the scene for `rows` rows of pixels.
    pub(super) fn set(self, required: &Requirements, rows: u32, seed: u64) -> Result<Set, Error> {
        match self {
            Self::Wall => wall(required, rows),
            Self::Tiles => tiles(required, rows, seed),
        }
    }
}

fn material(name: &str, reflectance: f64) -> String {
    format!("[[material]]\nname = \"{name}\"\ndiffuse = {reflectance:?}\n")
}

fn head(required: &Requirements) -> String {
    let environment = &required.environment.name;
    format!("version = 1\nenvironment = \"{environment}\"\nsensor.position_m = [0.0, 0.0, 0.0]\n")
}

fn made(text: &str, meshes: &BTreeMap<String, Mesh>) -> Result<Scene, Error> {
    let table = text.parse().map_err(|error: toml::de::Error| Error::Asked(error.to_string()))?;
    Ok(Scene::from_table(&table, "scenery", Path::new(""), meshes)?)
}

fn wall(required: &Requirements, rows: u32) -> Result<Set, Error> {
    let range = WITHIN * required.wanted.range_m;
    let paint = material("paint", required.wanted.reflectance);
    let object = format!("[[object]]\nshape.sphere.radius_m = {range:?}\nmaterial = \"paint\"\n");
    let scene = made(&format!("{}{paint}{object}", head(required)), &BTreeMap::new())?;
    let columns = required.wanted.columns as usize;
    Ok(Set { scene, columns, ranges: vec![range as f32; columns * rows as usize] })
}

fn tiles(required: &Requirements, rows: u32, seed: u64) -> Result<Set, Error> {
    let wanted = &required.wanted;
    let [width, height] = required.pitch().map(f64::to_radians);
    let columns = wanted.columns as usize;
    let mut ranges = vec![f32::NAN; columns * rows as usize];
    let mut faces = BRIGHTNESS.map(|_| (Vec::new(), Vec::new()));
    for row in 0..rows {
        let mut chance = Chance::new(seed).at(Stage::Scenery, u64::from(row));
        let mut begins = 0;
        while begins < columns {
            let pixels = (chance.fraction() * LONGEST).ceil() as usize;
            let ends = (begins + pixels.max(1)).min(columns);
            let is_sky = chance.fraction() < SKY;
            let range = NEAREST + chance.fraction() * (wanted.clutter_m - NEAREST);
            let brightness = (chance.fraction() * BRIGHTNESS.len() as f64) as usize;
            if !is_sky {
                let at = row as usize * columns;
                ranges[at + begins..at + ends].fill(range as f32);
                let (vertices, triangles): &mut (Vec<[f64; 3]>, Vec<[u32; 3]>) =
                    &mut faces[brightness];
                // Facets no wider than a few pixels lie on the sphere of their range.
                for from in (begins..ends).step_by(FACET) {
                    let sides = [from, (from + FACET).min(ends)];
                    let first = vertices.len() as u32;
                    for (line, column) in
                        [(0, sides[0]), (0, sides[1]), (1, sides[1]), (1, sides[0])]
                    {
                        let azimuth = (columns as f64 / 2.0 - column as f64) * width;
                        let middle = f64::from(rows) / 2.0;
                        let elevation = (middle - f64::from(row + line)) * height;
                        vertices.push(place(range, azimuth, elevation));
                    }
                    triangles.push([first, first + 1, first + 2]);
                    triangles.push([first, first + 2, first + 3]);
                }
            }
            begins = ends;
        }
    }
    let mut text = head(required);
    let mut objects = String::new();
    let mut meshes = BTreeMap::new();
    for (brightness, (vertices, triangles)) in BRIGHTNESS.iter().zip(faces) {
        let reflectance = (brightness * wanted.reflectance).min(BRIGHTEST.max(wanted.reflectance));
        let name = format!("tiles-{brightness}");
        if !triangles.is_empty() {
            text += &material(&name, reflectance);
            objects += &format!("[[object]]\nmesh = \"{name}\"\nmaterial = \"{name}\"\n");
            meshes.insert(name, Mesh::new(vertices, triangles));
        }
    }
    Ok(Set { scene: made(&format!("{text}{objects}"), &meshes)?, columns, ranges })
}

/// Pixels of a facet. At 300 m, a facet of four pixels of a milliradian lies less than a millimetre within
/// the sphere.
const FACET: usize = 4;

fn place(range: f64, azimuth: f64, elevation: f64) -> [f64; 3] {
    let level = range * elevation.cos();
    [level * azimuth.cos(), level * azimuth.sin(), range * elevation.sin()]
}

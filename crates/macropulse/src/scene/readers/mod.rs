//! Meshes from files: the format follows from the extension.

mod beside;
mod gltf;
mod lines;
mod obj;
mod ply;
mod stl;

use std::fs::File;
use std::io::{BufReader, Cursor};
use std::path::Path;

use super::error::Error;
use super::mesh::Mesh;
use super::room::Room;
use crate::opened;
pub(super) use beside::Reach;

/// Verdict on a material file that is named but not there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum WithoutMaterials {
    /// The object brings a material of its own.
    Fine,
    /// The surface would be guesswork.
    Refused,
}

/// Most bytes of a file with a mesh.
const MOST_BYTES: u64 = 2 << 30;

const DAMAGED: &str = "the file is damaged or cut short: export it again";

/// The mesh of a file, and a note of what else it holds.
#[derive(Debug, Default)]
pub(super) struct Read {
    pub mesh: Mesh,
    /// Sentences on what the file holds beside the mesh; they follow the name of an object.
    pub left_out: Vec<String>,
}

impl From<Mesh> for Read {
    fn from(mesh: Mesh) -> Self {
        Self { mesh, left_out: Vec::new() }
    }
}

/// Reads the mesh at `path`, and the files it names within `reach`, if there is `room` for it.
pub(super) fn read(
    path: &Path,
    without: WithoutMaterials,
    (reach, room): (Reach<'_>, Room),
) -> Result<Read, Error> {
    let Read { mesh, left_out } = match extension(path).as_str() {
        "obj" => obj::read(path, without, (reach, room))?,
        "stl" => stl::read(path, room)?.into(),
        "ply" => ply::read(path, room)?.into(),
        "glb" | "gltf" => gltf::read(path, (reach, room))?,
        _ => {
            return Err(Error::mesh(
                path,
                "is of no known mesh format",
                "use .obj, .stl, .ply, .glb or .gltf",
            ));
        }
    };
    let mut mesh = mesh.checked(path)?;
    mesh.drop_loose_vertices();
    Ok(Read { mesh, left_out })
}

/// Reads the PLY file that `bytes` are; `path` is its name in messages.
pub(super) fn read_ply(bytes: &[u8], path: &Path) -> Result<Mesh, Error> {
    ply::read_from(&mut Cursor::new(bytes), path, Room::default())?.checked(path)
}

/// Returns true if `path` is a glTF file, whose axes and unit are fixed by its specification.
pub(super) fn is_gltf(path: &Path) -> bool {
    matches!(extension(path).as_str(), "glb" | "gltf")
}

fn extension(path: &Path) -> String {
    path.extension().map(|end| end.to_string_lossy().to_lowercase()).unwrap_or_default()
}

fn open(path: &Path) -> Result<BufReader<File>, Error> {
    match opened::file(path, MOST_BYTES) {
        Ok(file) => Ok(BufReader::new(file)),
        Err(source) => Err(Error::Unreadable { path: path.to_owned(), source }),
    }
}

/// That light which goes through the material of this `name` is not followed.
fn transparency(name: &str) -> String {
    let name = name.escape_debug();
    format!("its material `{name}` is transparent, which is left out: it is solid")
}

/// Refuses a file with more materials than can be counted.
fn too_many_materials(path: &Path) -> Error {
    Error::mesh(path, "has more than 65536 materials", "export it in parts, or with fewer")
}

/// Returns a number of things in words, with an `s` for all but one.
fn counted(count: usize, what: &str) -> String {
    format!("{count} {what}{}", if count == 1 { "" } else { "s" })
}

/// Returns the sentence on the lines and points of a file; `None` if there are none.
fn no_surfaces(lines: usize, points: usize) -> Option<String> {
    let said: Vec<String> = [(lines, "line"), (points, "point")]
        .into_iter()
        .filter(|(count, _)| *count > 0)
        .map(|(count, what)| counted(count, what))
        .collect();
    let verb = if lines.saturating_add(points) == 1 {
        "is no surface, and is"
    } else {
        "are no surfaces, and are"
    };
    (!said.is_empty()).then(|| format!("{} {verb} left out", said.join(" and ")))
}

/// Returns the relative luminance of a linear colour \[BT.709\]: the guess for the diffuse reflectance of a
/// surface if only its looks are known.
fn luminance([red, green, blue]: [f64; 3]) -> f64 {
    (0.2126 * red + 0.7152 * green + 0.0722 * blue).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_extension_decides_whatever_its_case() {
        assert_eq!(extension(Path::new("a/Car.OBJ")), "obj");
        assert!(is_gltf(Path::new("a.GLB")) && !is_gltf(Path::new("glb")));
    }

    #[test]
    fn white_is_one_and_colours_are_kept_in_range() {
        approx::assert_relative_eq!(luminance([1.0; 3]), 1.0, max_relative = 1e-12);
        assert_eq!(luminance([9.0; 3]), 1.0);
    }

    #[test]
    fn unknown_formats_and_missing_files_are_refused() {
        let reach = (Reach { scene: Path::new(""), outside: false }, Room::default());
        let told =
            |name| read(Path::new(name), WithoutMaterials::Fine, reach).unwrap_err().to_string();
        assert!(told("a.blend").contains("use .obj, .stl, .ply, .glb or .gltf"));
        assert!(told("nowhere.stl").starts_with("nowhere.stl: cannot be read"));
    }

    #[test]
    fn lines_and_points_are_told_by_their_numbers() {
        let said = |lines, points| no_surfaces(lines, points).unwrap_or_default();
        assert_eq!(said(0, 0), "");
        assert_eq!(said(1, 0), "1 line is no surface, and is left out");
        assert_eq!(said(1, 2), "1 line and 2 points are no surfaces, and are left out");
    }
}

//! Meshes from files: the format follows from the extension.

mod gltf;
mod obj;
mod ply;
mod stl;

use std::fs::File;
use std::io::{BufReader, Cursor};
use std::path::Path;

use super::error::Error;
use super::mesh::Mesh;
use crate::opened;

/// What to do about a material file that is named but not there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum WithoutMaterials {
    /// The object brings a material of its own.
    Fine,
    /// The surface would be guesswork.
    Refused,
}

/// Most bytes of a file with a mesh.
const MOST_BYTES: u64 = 2 << 30;

/// Most vertices and faces of one together, where it says beforehand how many it has.
const MOST_ELEMENTS: u64 = 1 << 26;

const DAMAGED: &str = "the file is damaged or cut short: export it again";

/// Reads the mesh at `path`.
pub(super) fn read(path: &Path, without: WithoutMaterials) -> Result<Mesh, Error> {
    let mesh = match extension(path).as_str() {
        "obj" => obj::read(path, without)?,
        "stl" => stl::read(path)?,
        "ply" => ply::read(path)?,
        "glb" | "gltf" => gltf::read(path)?,
        _ => {
            return Err(Error::mesh(
                path,
                "is of no known mesh format",
                "use .obj, .stl, .ply, .glb or .gltf",
            ));
        }
    };
    mesh.checked(path)
}

/// Reads the PLY file that `bytes` are; `path` is its name in messages.
pub(super) fn read_ply(bytes: &[u8], path: &Path) -> Result<Mesh, Error> {
    ply::read_from(&mut Cursor::new(bytes), path)?.checked(path)
}

/// Whether `path` is a glTF file, whose axes and unit are fixed by its specification.
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

/// Relative luminance of a linear colour, the guess for the diffuse reflectance of a surface of
/// which only its looks are known \[BT.709\].
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
        let told = |name| read(Path::new(name), WithoutMaterials::Fine).unwrap_err().to_string();
        assert!(told("a.blend").contains("use .obj, .stl, .ply, .glb or .gltf"));
        assert!(told("nowhere.stl").starts_with("nowhere.stl: cannot be read"));
    }
}

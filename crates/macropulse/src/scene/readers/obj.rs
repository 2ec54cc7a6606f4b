//! Wavefront OBJ with its MTL.
//!
//! Only the parts of the format that make a surface are read: vertices, faces, and the materials of faces.
//! Normals, texture and the names of parts do not change what light meets.

mod mtl;

use std::collections::{HashMap, HashSet};
use std::path::Path;

use super::lines::{Fault, Lines, numbers};
use super::{DAMAGED, Reach, Read, WithoutMaterials, no_surfaces, open, transparency};
use crate::scene::error::Error;
use crate::scene::mesh::Mesh;
use crate::scene::polygon::{Cutter, Early};
use crate::scene::room::Room;
use mtl::{Library, Looks};

pub(super) fn read(
    path: &Path,
    without: WithoutMaterials,
    (reach, room): (Reach<'_>, Room),
) -> Result<Read, Error> {
    let mut file = open(path)?;
    let mut obj = Obj::default();
    let mut lines = Lines::of(&mut file, path)?.joined();
    lines.each(DAMAGED, |number, line| -> Result<(), Fault> {
        obj.line(number, line)?;
        Ok(room.check(obj.size(), path)?)
    })?;
    obj.cut_early().map_err(|(number, problem)| {
        Error::mesh(path, format!("line {number} {problem}"), DAMAGED)
    })?;
    room.check(obj.size(), path)?;
    let mut left_out = obj.left_out();
    let mut mesh = obj.mesh;
    // Colours are guesses for objects without a material of their own.
    if without == WithoutMaterials::Refused {
        let (mut library, mut known) = (Library::new(), HashSet::new());
        for named in &obj.libraries {
            for file in mtl::files(path, named, reach)? {
                if !known.contains(&file) {
                    mtl::read(&file, &mut library)?;
                    known.insert(file);
                }
            }
        }
        for (name, guess) in mesh.material_names.iter().zip(&mut mesh.diffuse_guesses) {
            let Looks { brightness, is_transparent } =
                library.get(name).copied().unwrap_or_default();
            *guess = brightness;
            left_out.extend(is_transparent.then(|| transparency(name)));
        }
    }
    Ok(Read { mesh, left_out })
}

const TOO_MANY: &str = "has one material more than the 65536 that can be told apart";

/// Most material files; each one is looked for.
const MOST_LIBRARIES: usize = 4096;

/// The part of a file that has been read so far.
#[derive(Default)]
struct Obj {
    mesh: Mesh,
    cutter: Cutter,
    /// Materials by name, of those that have a face.
    materials: HashMap<String, u16>,
    /// Material of the faces that follow: its name, and its index once it has a face.
    material: (String, Option<u16>),
    /// Texts of the lines `mtllib`, each once: as a list, as a set, and the number of words in all of them.
    libraries: Vec<String>,
    known_libraries: HashSet<String>,
    named: usize,
    /// Those of a face.
    corners: Vec<u32>,
    /// Faces whose vertices are told behind them.
    early: Early,
    lines: usize,
    points: usize,
    has_free_form: bool,
}

impl Obj {
    fn line(&mut self, number: usize, line: &str) -> Result<(), String> {
        let line = line.trim();
        let (word, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let rest = rest.trim();
        // A name may have a hash in it; among numbers a remark begins there.
        let words = || rest.split_whitespace().take_while(|word| !word.starts_with('#'));
        match word {
            "v" => self.vertex(&mut words())?,
            "f" => self.face(number, words())?,
            "l" => self.lines += 1,
            "p" => self.points += words().count(),
            "curv" | "curv2" | "surf" => self.has_free_form = true,
            "usemtl" => self.material = (rest.to_owned(), None),
            "mtllib" if !rest.is_empty() => self.library(rest)?,
            _ => {}
        }
        Ok(())
    }

    /// How many vertices and triangles there are, and will be.
    fn size(&self) -> (usize, usize) {
        (self.mesh.vertices.len(), self.mesh.triangles.len() + self.early.triangles())
    }

    fn library(&mut self, named: &str) -> Result<(), String> {
        // Some programs name it again before every part.
        if self.known_libraries.contains(named) {
            return Ok(());
        }
        self.named += named.split_whitespace().count();
        if self.named > MOST_LIBRARIES {
            return Err(format!(
                "names more material files than the {MOST_LIBRARIES} that are read"
            ));
        }
        self.known_libraries.insert(named.to_owned());
        self.libraries.push(named.to_owned());
        Ok(())
    }

    fn vertex<'a>(&mut self, words: &mut impl Iterator<Item = &'a str>) -> Result<(), String> {
        let place = numbers(words).map_err(|word| match word {
            Some(word) => format!("has {word:?} where a number of a vertex is due"),
            None => "has a vertex of fewer than three numbers".to_owned(),
        })?;
        if self.mesh.vertices.len() >= u32::MAX as usize {
            return Err("is one vertex more than can be counted".to_owned());
        }
        self.mesh.vertices.push(place);
        Ok(())
    }

    fn face<'a>(
        &mut self,
        number: usize,
        words: impl Iterator<Item = &'a str>,
    ) -> Result<(), String> {
        self.corners.clear();
        let count = self.mesh.vertices.len();
        for word in words {
            self.corners.push(corner(word, count)?);
        }
        if self.corners.len() < 3 {
            return Ok(());
        }
        let material = self.material()?;
        if self.corners.iter().any(|corner| *corner as usize >= count) {
            self.early.push(number, &self.corners, material);
        } else {
            self.cutter.add(&mut self.mesh, &self.corners, material)?;
        }
        Ok(())
    }

    /// The index of what the face is made of.
    fn material(&mut self) -> Result<u16, String> {
        let (name, index) = &mut self.material;
        if let Some(index) = index {
            return Ok(*index);
        }
        let found = match self.materials.get(name) {
            Some(known) => *known,
            None => {
                let new = self.mesh.add_material(name, None).ok_or(TOO_MANY)?;
                self.materials.insert(name.clone(), new);
                new
            }
        };
        *index = Some(found);
        Ok(found)
    }

    /// Adds the faces that were told before their vertices; or says which has none, by line.
    fn cut_early(&mut self) -> Result<(), (usize, String)> {
        let count = self.mesh.vertices.len();
        for (number, corners, material) in std::mem::take(&mut self.early).all() {
            if let Some(corner) = corners.iter().find(|corner| **corner as usize >= count) {
                let named = u64::from(*corner) + 1;
                return Err((number, format!("names vertex {named}, but there are only {count}")));
            }
            let cut = self.cutter.add(&mut self.mesh, corners, material);
            cut.map_err(|problem| (number, problem))?;
        }
        Ok(())
    }

    /// Returns sentences on what the file holds beside the mesh.
    fn left_out(&self) -> Vec<String> {
        let free_form =
            "its curves and free-form surfaces are left out: only its polygons are read";
        let mut said: Vec<String> = no_surfaces(self.lines, self.points).into_iter().collect();
        said.extend(self.has_free_form.then(|| free_form.to_owned()));
        said
    }
}

/// Returns the index of the vertex that a corner of a face names; texture and normal may follow it. Vertices
/// are numbered from 1, or back from the last of the `count` so far.
fn corner(word: &str, count: usize) -> Result<u32, String> {
    let typed = word.split('/').next().unwrap_or(word);
    let refused = || format!("has {word:?} where a corner of a face is due");
    let number: i64 = typed.parse().map_err(|_| refused())?;
    let index = match number {
        0 => return Err("names vertex 0, but they are counted from 1".to_owned()),
        1.. => number - 1,
        _ => number + count as i64,
    };
    match u32::try_from(index) {
        Ok(index) if index < u32::MAX => Ok(index),
        _ => Err(format!("names vertex {number}, but there are only {count}")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_corner_is_counted_from_1_or_back_from_the_last() {
        assert_eq!(corner("1", 4), Ok(0));
        assert_eq!(corner("-1/2/3", 4), Ok(3));
        assert_eq!(corner("9//1", 4), Ok(8), "one that may follow");
        for wrong in ["0", "-5", "x", "", "/1", "1.5", "4294967296", "99999999999999999999"] {
            assert!(corner(wrong, 4).is_err(), "{wrong}");
        }
    }

    #[test]
    fn faces_may_stand_before_their_vertices() {
        let mut obj = Obj::default();
        for (number, line) in ["f 1 2 3", "v 0 0 0", "v 1 0 0", "f 1 2 4"].iter().enumerate() {
            assert!(obj.line(number + 1, line).is_ok());
        }
        assert_eq!(
            obj.cut_early().unwrap_err(),
            (1, "names vertex 3, but there are only 2".into())
        );
    }
}

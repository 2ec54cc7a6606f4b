//! PLY, as text and as bytes; faces of any number of corners, and strips of triangles.
//!
//! The format has no materials. A file that says `comment material NAME` for each, counted from 0,
//! and has a property `material_index` of its faces names them all the same.

use std::io::{BufRead, Cursor};
use std::path::Path;

use ply_rs_bw::parser::{ParseError, Parser, Reader};
use ply_rs_bw::ply::{
    DefaultElement, ElementDef, Header, Property, PropertyAccess, PropertyAccessResult,
    PropertyType,
};

use super::lines::Lines;
use super::{DAMAGED, open, too_many_materials};
use crate::scene::error::Error;
use crate::scene::mesh::Mesh;
use crate::scene::polygon::Cutter;

/// Longer headers are none, bytes.
const LONGEST_HEADER: usize = 1 << 20;

/// Most vertices, faces and other elements together.
const MOST_ELEMENTS: usize = 1 << 26;

/// So many elements are read at once, before they are laid into the mesh.
const AT_ONCE: usize = 1 << 14;

/// What a list of corners is called.
const CORNERS: [&str; 2] = ["vertex_indices", "vertex_index"];

pub(super) fn read(path: &Path) -> Result<Mesh, Error> {
    read_from(&mut open(path)?, path)
}

/// Reads the mesh from `file`, whose name in messages is `path`.
pub(super) fn read_from(file: &mut impl BufRead, path: &Path) -> Result<Mesh, Error> {
    let (header, lines) = header(file, path)?;
    let mut body = Body { reader: Reader::new(file), header: &header, path, lines };
    let mut mesh = Mesh::default();
    let mut materials = Vec::new();
    for name in header.comments.iter().filter_map(|comment| comment.strip_prefix("material ")) {
        materials.push(mesh.material(name.trim()).ok_or_else(|| too_many_materials(path))?);
    }
    let mut faces = Faces { materials, ..Faces::default() };
    for (name, element) in &header.elements {
        match name.as_str() {
            "vertex" => {
                body.each(element, |vertices: &[Vertex]| {
                    mesh.vertices.extend(vertices.iter().map(|vertex| vertex.0));
                    Ok(())
                })?;
            }
            "face" => body.each(element, |read| faces.add(read, &mut mesh))?,
            "tristrips" => body.each(element, |read| faces.add_strips(read, &mut mesh))?,
            _ => body.each(element, |_: &[Other]| Ok(()))?,
        }
    }
    faces.cut_early(&mut mesh).map_err(|problem| Error::mesh(path, problem, DAMAGED))?;
    Ok(mesh)
}

/// The header, and how many lines it has. It may be in Latin-1.
fn header(file: &mut impl BufRead, path: &Path) -> Result<(Header, usize), Error> {
    let damaged = |problem: &str| Error::mesh(path, problem, DAMAGED);
    let mut lines = Lines::of(file, path)?;
    let mut text = String::new();
    let count = loop {
        let Some((number, line)) = lines.next()? else {
            return Err(damaged("is no PLY, or ends before its line end_header"));
        };
        let line = line.trim_end();
        if number == 1 && line != "ply" {
            return Err(damaged("is no PLY: it does not begin with ply"));
        }
        text += line;
        text.push('\n');
        if line == "end_header" {
            break number;
        }
        if text.len() > LONGEST_HEADER {
            return Err(damaged("has no line end_header in its first MiB"));
        }
    };
    let mut reader = Reader::new(Cursor::new(text));
    let header = Parser::<DefaultElement>::new().read_header(&mut reader);
    let header = header.map_err(|fault| damaged(&told(&fault, 0)))?;
    let mut elements = 0_usize;
    for (name, element) in &header.elements {
        if let Some(problem) = lacks(name, element) {
            return Err(damaged(&problem));
        }
        elements = elements.saturating_add(element.count);
    }
    if elements > MOST_ELEMENTS {
        let problem = format!("says that it has {elements} elements, more than {MOST_ELEMENTS}");
        return Err(Error::mesh(path, problem, "export it in parts"));
    }
    Ok((header, count))
}

/// What an element would need to be read.
fn lacks(name: &str, element: &ElementDef) -> Option<String> {
    let is_list = |name: &&str| {
        let property = element.properties.get(*name);
        property.map(|property| matches!(property.data_type, PropertyType::List(..)))
    };
    let count = element.count;
    match name {
        _ if count == 0 => None,
        "vertex" if ["x", "y", "z"].iter().any(|axis| is_list(axis) != Some(false)) => {
            Some("has vertices without x, y or z".to_owned())
        }
        "face" | "tristrips" if CORNERS.iter().all(|list| is_list(list) != Some(true)) => {
            Some(format!("has a {name} without a list vertex_indices"))
        }
        _ if element.properties.is_empty() => {
            Some(format!("says that it has {count} elements {name}, which have no properties"))
        }
        _ => None,
    }
}

/// What is behind the header.
struct Body<'a, R: BufRead> {
    reader: Reader<R>,
    header: &'a Header,
    path: &'a Path,
    /// Of the header.
    lines: usize,
}

impl<R: BufRead> Body<'_, R> {
    /// Reads the elements of a kind, and lets `take` have some at a time; what that says is wrong.
    fn each<E: PropertyAccess>(
        &mut self,
        element: &ElementDef,
        mut take: impl FnMut(&[E]) -> Result<(), String>,
    ) -> Result<(), Error> {
        let damaged = |problem: String| Error::mesh(self.path, problem, DAMAGED);
        let parser = Parser::<E>::new();
        let mut some = element.clone();
        for done in (0..element.count).step_by(AT_ONCE) {
            some.count = AT_ONCE.min(element.count - done);
            let read = parser.read_payload_for_element(&mut self.reader, &some, self.header);
            let read = read.map_err(|fault| match fault.kind() {
                std::io::ErrorKind::UnexpectedEof => {
                    let (name, count) = (&element.name, element.count);
                    damaged(format!("ends within its {count} elements {name}"))
                }
                _ => damaged(told(&fault, self.lines)),
            })?;
            take(&read).map_err(damaged)?;
        }
        Ok(())
    }
}

/// What is wrong with a line, behind so many others; the parser says it in several.
fn told(fault: &ParseError, lines: usize) -> String {
    let said = fault.to_string();
    let line = said.split_once("String: '").and_then(|(_, rest)| rest.split(['\n', '\'']).next());
    match (fault.line(), line) {
        (Some(number), Some(line)) => {
            format!("line {} reads {line:?}, which is not what is due there", lines + number)
        }
        _ => format!("is no readable PLY ({})", said.lines().next().unwrap_or_default()),
    }
}

/// A vertex.
struct Vertex([f64; 3]);

impl PropertyAccess for Vertex {
    fn new() -> Self {
        Self([f64::NAN; 3])
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        let axis = match name {
            "x" => 0,
            "y" => 1,
            "z" => 2,
            _ => return PropertyAccessResult::Ignored,
        };
        match number(&property) {
            Some(value) => self.0[axis] = value,
            None => return PropertyAccessResult::UnsupportedType,
        }
        PropertyAccessResult::Set
    }
}

/// Corners, of a face or of strips, and the material.
#[derive(Default)]
struct Face {
    corners: Vec<i64>,
    material: Option<usize>,
}

impl PropertyAccess for Face {
    fn new() -> Self {
        Self::default()
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        if CORNERS.contains(&name) {
            let Some(corners) = whole_numbers(&property) else {
                return PropertyAccessResult::UnsupportedType;
            };
            self.corners = corners;
        } else if name == "material_index" {
            self.material = number(&property).map(|index| index as usize);
        } else {
            return PropertyAccessResult::Ignored;
        }
        PropertyAccessResult::Set
    }
}

/// Anything else.
struct Other;

impl PropertyAccess for Other {
    fn new() -> Self {
        Self
    }
}

/// Makes triangles of faces.
#[derive(Default)]
struct Faces {
    cutter: Cutter,
    materials: Vec<u16>,
    corners: Vec<u32>,
    /// Faces that were told before the vertices: corners, material.
    early: Vec<(Vec<u32>, u16)>,
}

impl Faces {
    fn add(&mut self, faces: &[Face], mesh: &mut Mesh) -> Result<(), String> {
        for face in faces {
            self.corners.clear();
            for corner in &face.corners {
                self.corners.push(index(*corner)?);
            }
            let material = self.material(face, mesh)?;
            if mesh.vertices.is_empty() {
                self.early.push((self.corners.clone(), material));
            } else {
                self.cutter.add(mesh, &self.corners, material)?;
            }
        }
        Ok(())
    }

    /// Adds strips of triangles, of which each ends at a negative number.
    fn add_strips(&mut self, strips: &[Face], mesh: &mut Mesh) -> Result<(), String> {
        for strip in strips {
            let material = self.material(strip, mesh)?;
            for strip in strip.corners.split(|corner| *corner < 0) {
                for three in strip.windows(3) {
                    mesh.fan(&[index(three[0])?, index(three[1])?, index(three[2])?], material);
                }
            }
        }
        Ok(())
    }

    fn material(&self, face: &Face, mesh: &mut Mesh) -> Result<u16, String> {
        match face.material.and_then(|index| self.materials.get(index)) {
            Some(material) => Ok(*material),
            None => mesh.material("").ok_or_else(|| "has more than 65535 materials".to_owned()),
        }
    }

    /// Adds the faces that were told before the vertices.
    fn cut_early(&mut self, mesh: &mut Mesh) -> Result<(), String> {
        for (corners, material) in std::mem::take(&mut self.early) {
            self.cutter.add(mesh, &corners, material)?;
        }
        Ok(())
    }
}

fn index(corner: i64) -> Result<u32, String> {
    u32::try_from(corner).map_err(|_| format!("has a face with the corner {corner}"))
}

/// A coordinate, whatever type the header gave it.
fn number(property: &Property) -> Option<f64> {
    match *property {
        Property::Double(value) => Some(value),
        Property::Float(value) => Some(f64::from(value)),
        Property::Int(value) => Some(f64::from(value)),
        Property::UInt(value) => Some(f64::from(value)),
        Property::Short(value) => Some(f64::from(value)),
        Property::UShort(value) => Some(f64::from(value)),
        Property::Char(value) => Some(f64::from(value)),
        Property::UChar(value) => Some(f64::from(value)),
        _ => None,
    }
}

/// A list of whole numbers, whatever type the header gave them.
fn whole_numbers(property: &Property) -> Option<Vec<i64>> {
    fn wide<T: Copy + Into<i64>>(list: &[T]) -> Option<Vec<i64>> {
        Some(list.iter().map(|value| (*value).into()).collect())
    }
    match property {
        Property::ListChar(list) => wide(list),
        Property::ListUChar(list) => wide(list),
        Property::ListShort(list) => wide(list),
        Property::ListUShort(list) => wide(list),
        Property::ListInt(list) => wide(list),
        Property::ListUInt(list) => wide(list),
        _ => None,
    }
}

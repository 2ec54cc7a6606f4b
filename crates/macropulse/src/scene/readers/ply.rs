//! PLY, as text and as bytes; faces of any number of corners, and strips of triangles.
//!
//! The format has no materials. A file that says `comment material NAME` for each, counted from 0,
//! and has a property `material_index` of its faces names them all the same.

use std::collections::HashMap;
use std::io::{BufRead, Cursor};
use std::path::Path;

use ply_rs_bw::parser::{ParseError, Parser, Reader};
use ply_rs_bw::ply::{
    DefaultElement, ElementDef, Encoding, Header, Property, PropertyAccess, PropertyAccessResult,
    PropertyType,
};

use super::lines::{Lines, UnixLines};
use super::{DAMAGED, open, too_many_materials};
use crate::scene::error::Error;
use crate::scene::mesh::Mesh;
use crate::scene::polygon::{Cutter, Early};
use crate::scene::room::Room;

/// Longer headers are none, bytes.
const LONGEST_HEADER: usize = 1 << 20;

/// Most vertices, faces and other elements together.
const MOST_ELEMENTS: usize = 1 << 26;

/// Elements that are read at once, before they are laid into the mesh.
const AT_ONCE: usize = 1 << 14;

/// Names of a list of corners.
const CORNERS: [&str; 2] = ["vertex_indices", "vertex_index"];

pub(super) fn read(path: &Path, room: Room) -> Result<Mesh, Error> {
    read_from(&mut open(path)?, path, room)
}

/// Reads the mesh from `file`, whose name in messages is `path`, if there is `room` for it.
pub(super) fn read_from(file: &mut impl BufRead, path: &Path, room: Room) -> Result<Mesh, Error> {
    let (header, lines) = header(file, path)?;
    let header = &header;
    match header.encoding {
        Encoding::Ascii => {
            let reader = Reader::new(UnixLines::of(file));
            body(Body { reader, header, path, lines, room })
        }
        _ => body(Body { reader: Reader::new(file), header, path, lines, room }),
    }
}

/// Reads what is behind the header.
fn body(mut body: Body<'_, impl BufRead>) -> Result<Mesh, Error> {
    let (header, path) = (body.header, body.path);
    let mut mesh = Mesh::default();
    let mut faces = Faces::default();
    for name in header.comments.iter().filter_map(|comment| comment.strip_prefix("material ")) {
        let material = faces.material_called(name.trim(), &mut mesh);
        faces.materials.push(material.ok_or_else(|| too_many_materials(path))?);
    }
    for (name, element) in &header.elements {
        match name.as_str() {
            "vertex" => body.each(element, |vertices: &[Vertex]| {
                mesh.vertices.extend(vertices.iter().map(|vertex| vertex.0));
                Ok(faces.size(&mesh))
            })?,
            "face" => body.each(element, |read| faces.add(read, &mut mesh))?,
            "tristrips" => body.each(element, |read| faces.add_strips(read, &mut mesh))?,
            _ => body.each(element, |_: &[Other]| Ok((0, 0)))?,
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

/// Returns the reason why an element cannot be read, if there is one.
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

/// The part of a file behind the header.
struct Body<'a, R: BufRead> {
    reader: Reader<R>,
    header: &'a Header,
    path: &'a Path,
    /// Number of lines of the header.
    lines: usize,
    room: Room,
}

impl<R: BufRead> Body<'_, R> {
    /// Reads the elements of a kind, and lets `take` have some at a time; how many vertices and
    /// triangles there are by then, or what is wrong.
    fn each<E: PropertyAccess>(
        &mut self,
        element: &ElementDef,
        mut take: impl FnMut(&[E]) -> Result<(usize, usize), String>,
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
            self.room.check(take(&read).map_err(damaged)?, self.path)?;
        }
        Ok(())
    }
}

/// Returns the message of the parser, which has several lines, in one line. The parser counts lines from
/// behind the first `lines` of the file.
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
            // Below 0 it says that there is none.
            let index = number(&property).filter(|index| *index >= 0.0);
            self.material = index.map(|index| index as usize);
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
    /// Those that the header names, and all by name.
    materials: Vec<u16>,
    known: HashMap<String, u16>,
    corners: Vec<u32>,
    /// Faces that were told before the vertices.
    early: Early,
}

impl Faces {
    fn add(&mut self, faces: &[Face], mesh: &mut Mesh) -> Result<(usize, usize), String> {
        for face in faces {
            self.corners.clear();
            for corner in &face.corners {
                self.corners.push(index(*corner)?);
            }
            if self.corners.len() < 3 {
                continue;
            }
            let material = self.material(face, mesh)?;
            if mesh.vertices.is_empty() {
                self.early.push(0, &self.corners, material);
            } else {
                self.cutter.add(mesh, &self.corners, material)?;
            }
        }
        Ok(self.size(mesh))
    }

    /// How many vertices and triangles there are, and will be.
    fn size(&self, mesh: &Mesh) -> (usize, usize) {
        (mesh.vertices.len(), mesh.triangles.len() + self.early.triangles())
    }

    /// Adds strips of triangles; each ends at a negative number.
    fn add_strips(&mut self, strips: &[Face], mesh: &mut Mesh) -> Result<(usize, usize), String> {
        for strip in strips {
            let material = self.material(strip, mesh)?;
            for strip in strip.corners.split(|corner| *corner < 0) {
                for three in strip.windows(3) {
                    mesh.fan(&[index(three[0])?, index(three[1])?, index(three[2])?], material);
                }
            }
        }
        Ok(self.size(mesh))
    }

    fn material(&mut self, face: &Face, mesh: &mut Mesh) -> Result<u16, String> {
        match face.material.and_then(|index| self.materials.get(index)) {
            Some(material) => Ok(*material),
            None => self
                .material_called("", mesh)
                .ok_or_else(|| "has more than 65535 materials".to_owned()),
        }
    }

    /// Returns the material of this name, which is added if it is new; `None` if no more can be counted.
    fn material_called(&mut self, name: &str, mesh: &mut Mesh) -> Option<u16> {
        if let Some(known) = self.known.get(name) {
            return Some(*known);
        }
        let new = mesh.add_material(name, None)?;
        self.known.insert(name.to_owned(), new);
        Some(new)
    }

    /// Adds the faces that were told before the vertices.
    fn cut_early(&mut self, mesh: &mut Mesh) -> Result<(), String> {
        for (_, corners, material) in std::mem::take(&mut self.early).all() {
            self.cutter.add(mesh, corners, material)?;
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

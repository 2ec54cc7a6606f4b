//! PLY, ASCII and binary; faces of any number of corners.
//!
//! The format has no materials. A file that says `comment material NAME` for each, counted from 0,
//! and has a property `material_index` of its faces names them all the same.

use std::io::BufRead;
use std::path::Path;

use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{DefaultElement, Header, Property};

use super::{DAMAGED, MOST_ELEMENTS, open};
use crate::scene::error::Error;
use crate::scene::mesh::Mesh;

pub(super) fn read(path: &Path) -> Result<Mesh, Error> {
    read_from(&mut open(path)?, path)
}

/// Reads the mesh from `file`, whose name in messages is `path`.
pub(super) fn read_from(file: &mut impl BufRead, path: &Path) -> Result<Mesh, Error> {
    let damaged = |problem: String| Error::mesh(path, problem, DAMAGED);
    let (parser, mut file) = (Parser::<DefaultElement>::new(), Reader::new(file));
    let unreadable = |fault| damaged(format!("is no readable PLY ({fault})"));
    let header = parser.read_header(&mut file).map_err(unreadable)?;
    check(&header).map_err(damaged)?;
    let payload = parser.read_payload(&mut file, &header).map_err(unreadable)?;
    let mut mesh = Mesh::default();
    let names = header.comments.iter().filter_map(|comment| comment.strip_prefix("material "));
    let materials: Vec<u16> = names.map(|name| mesh.material(name.trim())).collect();
    for vertex in payload.get("vertex").into_iter().flatten() {
        let place = ["x", "y", "z"].map(|axis| vertex.get(axis).and_then(number));
        let [Some(x), Some(y), Some(z)] = place else {
            return Err(damaged("has a vertex without x, y or z".to_owned()));
        };
        mesh.vertices.push([x, y, z]);
    }
    for face in payload.get("face").into_iter().flatten() {
        let corners = face.get("vertex_indices").or_else(|| face.get("vertex_index"));
        let Some(corners) = corners.and_then(Property::to_u32_list) else {
            return Err(damaged("has a face without a usable list vertex_indices".to_owned()));
        };
        let own = face.get("material_index").and_then(number).map(|index| index as usize);
        let material = match own.and_then(|index| materials.get(index)) {
            Some(material) => *material,
            None => mesh.material(""),
        };
        mesh.polygon(&corners, material);
    }
    Ok(mesh)
}

/// Refuses more elements than are read, and those that take no byte of the file each: of these a
/// header of a few words may promise any number.
fn check(header: &Header) -> Result<(), String> {
    let mut elements = 0_u64;
    for (name, element) in header.elements.iter().filter(|(_, element)| element.count > 0) {
        if element.properties.is_empty() {
            return Err(format!("has {} elements `{name}` without a property", element.count));
        }
        elements = elements.saturating_add(element.count as u64);
    }
    match elements > MOST_ELEMENTS {
        true => Err(format!("says it has {elements} elements, more than {MOST_ELEMENTS}")),
        false => Ok(()),
    }
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

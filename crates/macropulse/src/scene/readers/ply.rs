//! PLY, ASCII and binary; faces of any number of corners.
//!
//! The format has no materials. A file that says `comment material NAME` for each, counted from 0,
//! and has a property `material_index` of its faces names them all the same.

use std::io::BufRead;
use std::path::Path;

use ply_rs_bw::parser::Parser;
use ply_rs_bw::ply::{DefaultElement, Property};

use super::{DAMAGED, open};
use crate::scene::error::Error;
use crate::scene::mesh::Mesh;

pub(super) fn read(path: &Path) -> Result<Mesh, Error> {
    read_from(&mut open(path)?, path)
}

/// Reads the mesh from `file`, whose name in messages is `path`.
pub(super) fn read_from(file: &mut impl BufRead, path: &Path) -> Result<Mesh, Error> {
    let damaged = |problem: String| Error::mesh(path, problem, DAMAGED);
    let ply = Parser::<DefaultElement>::new()
        .read_ply(file)
        .map_err(|fault| damaged(format!("is no readable PLY ({fault})")))?;
    let mut mesh = Mesh::default();
    let names = ply.header.comments.iter().filter_map(|comment| comment.strip_prefix("material "));
    let materials: Vec<u16> = names.map(|name| mesh.material(name.trim())).collect();
    for vertex in ply.payload.get("vertex").into_iter().flatten() {
        let place = ["x", "y", "z"].map(|axis| vertex.get(axis).and_then(number));
        let [Some(x), Some(y), Some(z)] = place else {
            return Err(damaged("has a vertex without x, y or z".to_owned()));
        };
        mesh.vertices.push([x, y, z]);
    }
    for face in ply.payload.get("face").into_iter().flatten() {
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

//! STL, ASCII and binary.

use std::path::Path;

use super::{DAMAGED, open};
use crate::scene::error::Error;
use crate::scene::mesh::Mesh;

pub(super) fn read(path: &Path) -> Result<Mesh, Error> {
    let fault =
        |fault: std::io::Error| Error::mesh(path, format!("is no readable STL ({fault})"), DAMAGED);
    let mut file = open(path)?;
    let triangles = stl_io::create_stl_reader(&mut file).map_err(fault)?;
    let mut mesh = Mesh::default();
    let material = mesh.material("");
    for triangle in triangles {
        let first = mesh.vertices.len() as u32;
        let corners = triangle.map_err(fault)?.vertices;
        mesh.vertices.extend(corners.map(|corner| corner.0.map(f64::from)));
        mesh.polygon(&[first, first + 1, first + 2], material);
    }
    Ok(mesh)
}

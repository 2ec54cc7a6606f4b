//! Wavefront OBJ with its MTL.

use std::cell::RefCell;
use std::path::{Path, PathBuf};

use tobj::{LoadError, LoadOptions};

use super::{DAMAGED, WithoutMaterials, luminance, open};
use crate::scene::error::Error;
use crate::scene::mesh::Mesh;

pub(super) fn read(path: &Path, without: WithoutMaterials) -> Result<Mesh, Error> {
    let folder = path.parent().unwrap_or(Path::new(""));
    // The reader asks for each `mtllib`; what it cannot have is remembered for the message.
    let missing: RefCell<Option<PathBuf>> = RefCell::new(None);
    let materials = |name: &Path| {
        let beside = folder.join(name);
        match open(&beside) {
            Ok(mut text) => tobj::load_mtl_buf(&mut text),
            Err(_) => {
                missing.borrow_mut().get_or_insert(beside);
                Err(LoadError::OpenFileFailed)
            }
        }
    };
    let options = LoadOptions {
        triangulate: true,
        ignore_points: true,
        ignore_lines: true,
        ..LoadOptions::default()
    };
    let (models, materials) = tobj::load_obj_buf(&mut open(path)?, &options, materials)
        .map_err(|fault| Error::mesh(path, format!("is no readable OBJ ({fault})"), DAMAGED))?;
    if let (Some(absent), WithoutMaterials::Refused) = (missing.take(), without) {
        return Err(Error::mesh(
            path,
            format!("names its materials in {}, which is not there", absent.display()),
            "put that file beside the mesh, or give the object `material = \"…\"`",
        ));
    }
    let materials = match (materials, without) {
        (Ok(materials), _) => materials,
        (Err(_), WithoutMaterials::Fine) => Vec::new(),
        (Err(fault), WithoutMaterials::Refused) => {
            return Err(Error::mesh(
                path,
                format!("its MTL cannot be read ({fault})"),
                "mend it, or give the object `material = \"…\"`",
            ));
        }
    };
    let mut mesh = Mesh::default();
    for model in models {
        let shift = mesh.vertices.len() as u32;
        let own = model.mesh.material_id.and_then(|id| materials.get(id));
        let material = mesh.material(own.map_or("", |own| &own.name));
        if let Some(colour) = own.and_then(|own| own.diffuse) {
            mesh.diffuse_guesses[material as usize] = Some(luminance(colour));
        }
        mesh.vertices.extend(model.mesh.positions.as_chunks().0);
        for corners in model.mesh.indices.as_chunks::<3>().0 {
            mesh.polygon(&corners.map(|corner| shift.saturating_add(corner)), material);
        }
    }
    Ok(mesh)
}

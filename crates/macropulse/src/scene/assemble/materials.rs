//! Materials of surfaces: those of the file, those of the library, and guesses.

use super::super::error::Error;
use super::super::file::{ObjectTyped, SceneFile};
use super::super::material::{self, Diffuse, Material, plain};
use super::super::mesh::Mesh;
use super::super::spanned::Spanned;
use super::Assembly;

impl Assembly<'_> {
    /// Takes in the materials that the file defines.
    pub(super) fn define(&mut self, file: &SceneFile) -> Result<(), Error> {
        for typed in &file.materials {
            let defined = typed.get_ref();
            // A name of the library overrides that entry and keeps what is not typed.
            let mut made =
                material::named(&defined.name).unwrap_or_else(|| Material::matt("", 0.0));
            if made.name.is_empty() && defined.diffuse.is_none() {
                let message = format!(
                    "material {:?} is not in the library, so it needs at least `diffuse`",
                    defined.name
                );
                return Err(self.source.fault(typed.span(), message));
            }
            made.name = plain(&defined.name);
            let mut diffuse = 0.0;
            let fields = [
                (&defined.diffuse, &mut diffuse, "diffuse", 1.0),
                (&defined.specular, &mut made.specular, "specular", 1e4),
                (&defined.gloss, &mut made.gloss, "gloss", 1e6),
                (&defined.retro, &mut made.retro, "retro", 1e5),
                (&defined.transmission, &mut made.transmission, "transmission", 1.0),
            ];
            for (typed, field, key, most) in fields {
                let Some(typed) = typed else { continue };
                let value = *typed.get_ref();
                if !(0.0..=most).contains(&value) {
                    let message = format!("{key} is {value}; it must be from 0 to {most}");
                    return Err(self.source.fault(typed.span(), message));
                }
                *field = value;
            }
            if defined.diffuse.is_some() {
                made.diffuse = Diffuse::Even(diffuse);
            }
            self.defined.retain(|known| known.name != made.name);
            self.defined.push(made);
        }
        Ok(())
    }

    /// For each material of the mesh, the index of the one it stands for in the scene.
    pub(super) fn material_indices(
        &mut self,
        name: &str,
        written: &ObjectTyped,
        mesh: &Mesh,
    ) -> Result<Vec<u16>, Error> {
        for (wanted, typed) in &written.materials {
            if !mesh.material_names.contains(wanted) {
                let own: Vec<&str> = mesh
                    .material_names
                    .iter()
                    .map(String::as_str)
                    .filter(|n| !n.is_empty())
                    .collect();
                let message = if own.is_empty() {
                    format!(
                        "the mesh of {name} names no materials; give all of it `material = \"…\"`"
                    )
                } else {
                    format!(
                        "the mesh of {name} has no material {wanted:?}; it has {}",
                        own.join(", ")
                    )
                };
                return Err(self.source.fault(typed.span(), message));
            }
        }
        let mut indices = Vec::with_capacity(mesh.material_names.len());
        for (own, guess) in mesh.material_names.iter().zip(&mesh.diffuse_guesses) {
            let known = self.known(own);
            indices.push(match (written.materials.get(own), &written.material, known, guess) {
                (Some(typed), ..) | (None, Some(typed), ..) => self.material_typed(typed)?,
                (None, None, Some(known), _) => self.enlist(known),
                (None, None, None, Some(diffuse)) => {
                    self.notes.push(format!(
                        "{name}: material {own:?} is not in the library, its visible colour is \
                         taken as a diffuse reflectance of {diffuse:.2}"
                    ));
                    self.guessed(&format!("{name}/{}", plain(own)), *diffuse)
                }
                (None, None, None, None) => self.unnamed(&format!("{name}, {own:?}")),
            });
        }
        Ok(indices)
    }

    /// The material of this name: as the file defines it, else from the library.
    pub(super) fn known(&self, name: &str) -> Option<Material> {
        let wanted = plain(name);
        let defined = self.defined.iter().find(|known| known.name == wanted).cloned();
        defined.or_else(|| material::named(name))
    }

    /// The index of the material that is typed.
    pub(super) fn material_typed(&mut self, typed: &Spanned<String>) -> Result<u16, Error> {
        let name = typed.get_ref();
        if let Some(known) = self.known(name) {
            return Ok(self.enlist(known));
        }
        let library: Vec<Material> =
            self.defined.iter().cloned().chain(material::library()).collect();
        let names = || library.iter().map(|known| known.name.as_str());
        let message = match crate::names::nearest(&plain(name), names()) {
            Some(near) => format!("there is no material {name:?}; did you mean {near:?}?"),
            None => format!(
                "there is no material {name:?}; define it as [[material]] or use one of {}",
                names().collect::<Vec<_>>().join(", ")
            ),
        };
        Err(self.source.fault(typed.span(), message))
    }

    /// The index of what is assumed where nothing is known of a material.
    pub(super) fn unnamed(&mut self, whose: &str) -> u16 {
        let material =
            self.known(material::UNNAMED).unwrap_or_else(|| Material::matt(material::UNNAMED, 0.3));
        // One number for all wavelengths, whether it is the library's or the file's.
        let diffuse = material.diffuse.at(0.0);
        self.notes
            .push(format!("{whose}: no known material, diffuse reflectance {diffuse} is assumed"));
        self.enlist(material)
    }

    /// The index of a material of this `name` and visible colour. Another of the same name is told
    /// apart by a number.
    fn guessed(&mut self, name: &str, diffuse: f64) -> u16 {
        let is_other = |called: &str| {
            let known = self.materials.iter().find(|known| known.name == called);
            known.is_some_and(|known| known.diffuse != Diffuse::Even(diffuse))
        };
        let numbered = (2_u32..).map(|number| format!("{name}-{number}"));
        let mut names = std::iter::once(name.to_owned()).chain(numbered);
        let free = names.find(|called| !is_other(called)).unwrap_or_default();
        self.enlist(Material::matt(&free, diffuse))
    }

    /// The index of `material` in the scene, which it enters if it is new there.
    pub(super) fn enlist(&mut self, material: Material) -> u16 {
        let index = self.materials.iter().position(|known| known.name == material.name);
        let index = index.unwrap_or_else(|| {
            self.materials.push(material);
            self.materials.len() - 1
        });
        u16::try_from(index).unwrap_or(u16::MAX)
    }
}

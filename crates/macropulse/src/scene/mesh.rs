//! Triangle meshes, and what makes one usable.

use std::path::Path;

use super::error::Error;

/// A triangle mesh in its own frame and unit.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mesh {
    /// Corners, in the unit and the axes of their file.
    pub vertices: Vec<[f64; 3]>,
    /// Three indices into `vertices` each.
    pub triangles: Vec<[u32; 3]>,
    /// Index into `material_names`, one per triangle.
    pub material_of_triangle: Vec<u16>,
    /// Names as the file has them; empty where it has none.
    pub material_names: Vec<String>,
    /// Diffuse reflectance guessed from the visible colour in the file, if it gives one; one per
    /// name.
    pub diffuse_guesses: Vec<Option<f64>>,
}

impl Mesh {
    /// A mesh of one material without a name.
    pub fn new(vertices: Vec<[f64; 3]>, triangles: Vec<[u32; 3]>) -> Self {
        Self {
            material_of_triangle: vec![0; triangles.len()],
            vertices,
            triangles,
            material_names: vec![String::new()],
            diffuse_guesses: vec![None],
        }
    }

    /// The index of the material called `name`, which is added if it is new.
    pub(super) fn material(&mut self, name: &str) -> u16 {
        let index =
            self.material_names.iter().position(|known| known == name).unwrap_or_else(|| {
                self.material_names.push(name.to_owned());
                self.diffuse_guesses.push(None);
                self.material_names.len() - 1
            });
        // Files with more than 65 536 materials share the last one.
        u16::try_from(index).unwrap_or(u16::MAX)
    }

    /// Adds a flat or nearly flat polygon as a fan. Fewer than three corners add nothing.
    pub(super) fn polygon(&mut self, corners: &[u32], material: u16) {
        for pair in corners.windows(2).skip(1) {
            self.triangles.push([corners[0], pair[0], pair[1]]);
            self.material_of_triangle.push(material);
        }
    }

    /// Lowest and highest coordinate on each axis; `None` without vertices.
    pub fn bounds(&self) -> Option<([f64; 3], [f64; 3])> {
        let first = *self.vertices.first()?;
        Some(self.vertices.iter().fold((first, first), |(mut low, mut high), vertex| {
            for axis in 0..3 {
                low[axis] = low[axis].min(vertex[axis]);
                high[axis] = high[axis].max(vertex[axis]);
            }
            (low, high)
        }))
    }

    /// Refuses what cannot be cast at: no triangles, corners that are not there or not finite.
    pub(super) fn checked(self, path: &Path) -> Result<Self, Error> {
        if self.triangles.is_empty() {
            return Err(Error::mesh(
                path,
                "holds no triangles",
                "export a surface mesh, not points, lines or curves",
            ));
        }
        let count = self.vertices.len();
        for (index, triangle) in self.triangles.iter().enumerate() {
            if let Some(corner) = triangle.iter().find(|corner| **corner as usize >= count) {
                return Err(Error::mesh(
                    path,
                    format!("triangle {index} names vertex {corner}, but there are only {count}"),
                    "the file is damaged: export it again",
                ));
            }
        }
        let (given, needed) = (self.material_of_triangle.len(), self.triangles.len());
        let names = self.material_names.len();
        let unnamed = self.material_of_triangle.iter().find(|own| usize::from(**own) >= names);
        if given != needed || self.diffuse_guesses.len() != names {
            return Err(Error::mesh(
                path,
                format!("{given} of its {needed} triangles have a material"),
                "give each of them one",
            ));
        }
        if let Some(material) = unnamed {
            return Err(Error::mesh(
                path,
                format!("a triangle is of material {material}, but {names} are named"),
                "count them from 0, and name them all",
            ));
        }
        let broken = self.vertices.iter().position(|v| v.iter().any(|value| !value.is_finite()));
        if let Some(index) = broken {
            return Err(Error::mesh(
                path,
                format!("vertex {index} is {:?}, which is nowhere", self.vertices[index]),
                "remove it or export the mesh again",
            ));
        }
        Ok(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square() -> Mesh {
        let mut mesh = Mesh {
            vertices: vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 2.0]],
            ..Mesh::default()
        };
        let paint = mesh.material("paint");
        mesh.polygon(&[0, 1, 2, 3], paint);
        mesh
    }

    #[test]
    fn a_quadrilateral_is_two_triangles() {
        let mesh = square();
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(mesh.bounds(), Some(([0.0; 3], [1.0, 1.0, 2.0])));
    }

    #[test]
    fn a_line_adds_nothing() {
        let mut mesh = square();
        mesh.polygon(&[0, 1], 0);
        assert_eq!(mesh.triangles.len(), 2);
        assert_eq!(mesh.material("paint"), 0);
    }

    #[test]
    fn broken_meshes_are_refused_with_a_remedy() {
        let path = Path::new("a.ply");
        let told = |mesh: Mesh| mesh.checked(path).unwrap_err().to_string();
        assert!(told(Mesh::default()).contains("no triangles"));
        let mut mesh = square();
        mesh.triangles[1] = [0, 1, 4];
        assert!(told(mesh).contains("triangle 1 names vertex 4, but there are only 4"));
        let mut mesh = square();
        mesh.material_of_triangle.pop();
        assert!(told(mesh).contains("1 of its 2 triangles"));
        let mut mesh = square();
        mesh.material_of_triangle[1] = 1;
        assert!(told(mesh).contains("of material 1, but 1 are named"));
        let mut mesh = square();
        mesh.vertices[3][1] = f64::NAN;
        assert!(told(mesh).contains("vertex 3"));
    }
}

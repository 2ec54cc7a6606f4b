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

    /// The index of the material called `name`, which is added if it is new; `None` if no further one can be
    /// counted.
    pub(super) fn material(&mut self, name: &str) -> Option<u16> {
        match self.material_names.iter().position(|known| known == name) {
            Some(index) => u16::try_from(index).ok(),
            None => self.add_material(name, None),
        }
    }

    /// As [`Mesh::material`], of one that is new, whatever others are called.
    pub(super) fn add_material(&mut self, name: &str, guess: Option<f64>) -> Option<u16> {
        let index = u16::try_from(self.material_names.len()).ok()?;
        self.material_names.push(name.to_owned());
        self.diffuse_guesses.push(guess);
        Some(index)
    }

    /// Adds a fan of triangles about the first of these corners. Fewer than three add nothing.
    pub(super) fn fan(&mut self, corners: &[u32], material: u16) {
        for pair in corners.windows(2).skip(1) {
            self.triangles.push([corners[0], pair[0], pair[1]]);
            self.material_of_triangle.push(material);
        }
    }

    /// Takes away the vertices that no triangle has, those of lines for example. Every corner must be
    /// there.
    pub(super) fn drop_loose_vertices(&mut self) {
        let mut is_used = vec![false; self.vertices.len()];
        for corner in self.triangles.iter().flatten() {
            is_used[*corner as usize] = true;
        }
        if !is_used.contains(&false) {
            return;
        }
        let mut kept = 0;
        let place = |is_used: &bool| {
            let place = kept;
            kept += u32::from(*is_used);
            place
        };
        let places: Vec<u32> = is_used.iter().map(place).collect();
        let mut is_used = is_used.into_iter();
        self.vertices.retain(|_| is_used.next().unwrap_or(true));
        for corner in self.triangles.iter_mut().flatten() {
            *corner = places[*corner as usize];
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
        let paint = mesh.material("paint").unwrap();
        mesh.fan(&[0, 1, 2, 3], paint);
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
        mesh.fan(&[0, 1], 0);
        assert_eq!(mesh.triangles.len(), 2);
        assert_eq!(mesh.material("paint"), Some(0));
    }

    #[test]
    fn vertices_of_no_triangle_are_dropped() {
        let mut mesh = square();
        let wanted = mesh.clone();
        mesh.drop_loose_vertices();
        assert_eq!(mesh, wanted, "all are used");
        mesh.vertices.splice(1..1, [[9.0; 3], [8.0; 3]]);
        mesh.vertices.push([7.0; 3]);
        let corners = mesh.triangles.iter_mut().flatten().filter(|corner| **corner > 0);
        corners.for_each(|corner| *corner += 2);
        mesh.drop_loose_vertices();
        assert_eq!(mesh, wanted);
    }

    #[test]
    fn materials_that_cannot_be_counted_are_none() {
        let mut mesh = square();
        mesh.material_names.resize(1 << 16, "x".to_owned());
        assert_eq!((mesh.material("paint"), mesh.material("y")), (Some(0), None));
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

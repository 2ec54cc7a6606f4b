//! Triangles as they are drawn, and as a PLY file.

/// Triangles, each of a material.
#[derive(Debug, Default)]
pub struct Mesh {
    /// Corners, m.
    pub vertices: Vec<[f64; 3]>,
    triangles: Vec<[u32; 3]>,
    material_of_triangle: Vec<u8>,
    material_names: Vec<String>,
}

impl Mesh {
    /// The index of the material called `name`, which is added if it is new.
    pub fn material(&mut self, name: &str) -> u8 {
        let known = self.material_names.iter().position(|known| known == name);
        known.unwrap_or_else(|| {
            self.material_names.push(name.to_owned());
            self.material_names.len() - 1
        }) as u8
    }

    /// Adds a polygon as a fan of triangles.
    pub fn polygon(&mut self, corners: &[u32], material: u8) {
        for pair in corners.windows(2).skip(1) {
            self.triangles.push([corners[0], pair[0], pair[1]]);
            self.material_of_triangle.push(material);
        }
    }

    /// Lowest and highest coordinate on each axis; `None` without vertices.
    pub fn bounds(&self) -> Option<([f64; 3], [f64; 3])> {
        let first = *self.vertices.first()?;
        Some(self.vertices.iter().fold((first, first), |(low, high), vertex| {
            let each = |of: fn(f64, f64) -> f64, bound: [f64; 3]| {
                std::array::from_fn(|axis| of(bound[axis], vertex[axis]))
            };
            (each(f64::min, low), each(f64::max, high))
        }))
    }

    /// The mesh as a binary PLY file that names its materials: in comments, counted from 0, with
    /// an index for each face.
    pub fn ply(&self) -> Vec<u8> {
        let materials: String =
            self.material_names.iter().map(|name| format!("comment material {name}\n")).collect();
        let mut bytes = format!(
            "ply\nformat binary_little_endian 1.0\ncomment made by make-car\n{materials}\
             element vertex {}\nproperty double x\nproperty double y\nproperty double z\n\
             element face {}\nproperty list uchar uint vertex_indices\n\
             property uchar material_index\nend_header\n",
            self.vertices.len(),
            self.triangles.len()
        )
        .into_bytes();
        bytes.extend(self.vertices.iter().flatten().flat_map(|value| value.to_le_bytes()));
        for (triangle, material) in self.triangles.iter().zip(&self.material_of_triangle) {
            bytes.push(3);
            bytes.extend(triangle.iter().flat_map(|corner| corner.to_le_bytes()));
            bytes.push(*material);
        }
        bytes
    }
}

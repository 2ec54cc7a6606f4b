//! Polygons cut into triangles.
//!
//! A polygon whose fan about its first corner covers it becomes that fan. Any other, one with a bay,
//! is laid into its own plane and cut by ear-clipping \[Mei75\]: corner after corner whose triangle lies
//! within what is left.

use earcut::Earcut;
use glam::{DVec2, DVec3};

use super::mesh::Mesh;

/// Share of the area of a polygon up to which a triangle may be turned over by rounding alone.
const ROUNDING: f64 = 1e-9;

/// Most corners of a polygon with a bay: the time to cut one grows with the square of them.
const MOST_CORNERS: usize = 1 << 15;

/// Cuts polygons into triangles, and keeps its memory from one to the next.
#[derive(Default)]
pub(super) struct Cutter {
    places: Vec<DVec3>,
    flat: Vec<[f64; 2]>,
    ears: Vec<u32>,
    earcut: Option<Earcut<f64>>,
}

impl Cutter {
    /// Adds the polygon with these corners to `mesh`. Fewer than three add nothing; a corner that is
    /// not there is left to [`Mesh::checked`].
    ///
    /// # Errors
    /// If it has a bay and too many corners: what goes on after its place.
    pub(super) fn add(
        &mut self,
        mesh: &mut Mesh,
        corners: &[u32],
        material: u16,
    ) -> Result<(), String> {
        if corners.len() <= 3 || !self.has_bay(mesh, corners) {
            mesh.fan(corners, material);
            return Ok(());
        }
        if corners.len() > MOST_CORNERS {
            let count = corners.len();
            return Err(format!(
                "has a polygon with a bay of {count} corners, more than {MOST_CORNERS}, to be \
                 exported as triangles"
            ));
        }
        let Self { flat, ears, earcut, .. } = self;
        earcut.get_or_insert_with(Earcut::new).earcut_slice(flat, &[], ears);
        if ears.is_empty() {
            mesh.fan(corners, material);
        }
        // As the polygon is seen, so are its triangles.
        for ear in ears.as_chunks_mut::<3>().0 {
            let [a, b, c] = ear.map(|corner| DVec2::from(flat[corner as usize]));
            if (b - a).perp_dot(c - a) < 0.0 {
                ear.swap(1, 2);
            }
        }
        for three in self.ears.as_chunks::<3>().0 {
            mesh.triangles.push(three.map(|ear| corners[ear as usize]));
            mesh.material_of_triangle.push(material);
        }
        Ok(())
    }

    /// Returns true if no fan covers the polygon; then `flat` is the polygon in its plane.
    fn has_bay(&mut self, mesh: &Mesh, corners: &[u32]) -> bool {
        let Self { places, flat, .. } = self;
        places.clear();
        let Some(first) = mesh.vertices.get(corners[0] as usize).copied().map(DVec3::from) else {
            return false;
        };
        for corner in corners {
            let Some(place) = mesh.vertices.get(*corner as usize) else { return false };
            places.push(DVec3::from(*place) - first);
        }
        // The area of a polygon as a vector is the sum of those of its fan, whatever its shape.
        let fan = || places.windows(2).map(|edge| edge[0].cross(edge[1]));
        let area: DVec3 = fan().sum();
        let square = area.length_squared();
        // A polygon without area, or with a corner that is not finite, has no plane.
        let has_plane = square > 0.0 && square.is_finite();
        if !has_plane || fan().all(|one| one.dot(area) >= -ROUNDING * square) {
            return false;
        }
        let (right, up) = area.normalize().any_orthonormal_pair();
        flat.clear();
        flat.extend(places.iter().map(|place| [place.dot(right), place.dot(up)]));
        true
    }
}

/// Polygons that a file tells before their corners, to be cut when those are there.
#[derive(Default)]
pub(super) struct Early {
    /// Corners of all polygons, one polygon after the other.
    corners: Vec<u32>,
    /// Line in the file, number of corners and material of each polygon.
    polygons: Vec<(u32, u32, u16)>,
}

impl Early {
    /// Keeps the polygon that is told on this line. Fewer than three corners are none.
    pub(super) fn push(&mut self, line: usize, corners: &[u32], material: u16) {
        if corners.len() < 3 {
            return;
        }
        // A file has fewer bytes than these can count.
        let [line, count] = [line, corners.len()].map(|n| u32::try_from(n).unwrap_or(u32::MAX));
        self.corners.extend(corners);
        self.polygons.push((line, count, material));
    }

    /// How many triangles they will be.
    pub(super) fn triangles(&self) -> usize {
        self.corners.len() - 2 * self.polygons.len()
    }

    /// Each of them: its line, its corners and its material.
    pub(super) fn all(&self) -> impl Iterator<Item = (usize, &[u32], u16)> {
        self.polygons.iter().scan(self.corners.as_slice(), |rest, (line, count, material)| {
            let (corners, behind) = rest.split_at_checked(*count as usize)?;
            *rest = behind;
            Some((*line as usize, corners, *material))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The triangles of a polygon with these corners in space.
    fn cut(corners: Vec<[f64; 3]>) -> Mesh {
        let count = corners.len() as u32;
        let mut mesh = Mesh { vertices: corners, ..Mesh::default() };
        Cutter::default().add(&mut mesh, &(0..count).collect::<Vec<_>>(), 0).unwrap();
        mesh
    }

    /// The area of each triangle, as a vector.
    fn areas(mesh: &Mesh) -> impl Iterator<Item = DVec3> {
        mesh.triangles.iter().map(|three| {
            let [a, b, c] = three.map(|corner| DVec3::from(mesh.vertices[corner as usize]));
            (b - a).cross(c - a) / 2.0
        })
    }

    #[test]
    fn a_convex_polygon_is_a_fan_and_a_line_is_nothing() {
        let square = [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        assert_eq!(cut(square.to_vec()).triangles, [[0, 1, 2], [0, 2, 3]]);
        let bent = [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.3], [0.0, 1.0, 0.0]];
        assert_eq!(cut(bent.to_vec()).triangles, [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(cut(square[..2].to_vec()).triangles.len(), 0);
    }

    #[test]
    fn polygons_told_early_are_kept_as_they_were() {
        let mut early = Early::default();
        early.push(7, &[4, 5, 6], 1);
        early.push(8, &[1, 2], 1);
        early.push(9, &[0, 1, 2, 3], 2);
        assert_eq!(early.triangles(), 3);
        let all: Vec<_> = early.all().collect();
        assert_eq!(all, [(7, &[4, 5, 6][..], 1), (9, &[0, 1, 2, 3][..], 2)]);
    }

    #[test]
    fn what_has_no_plane_is_a_fan() {
        for corner in [[3.0, 0.0, 0.0], [f64::NAN, 0.0, 0.0], [f64::INFINITY, 1.0, 0.0]] {
            let line = vec![[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0], corner];
            assert_eq!(cut(line).triangles.len(), 2);
        }
        let mut mesh = Mesh { vertices: vec![[0.0; 3]; 3], ..Mesh::default() };
        Cutter::default().add(&mut mesh, &[0, 1, 2, 9], 0).unwrap();
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 9]]);
    }

    #[test]
    fn a_polygon_of_very_many_corners_needs_to_be_convex() {
        let many = MOST_CORNERS as u32 + 1;
        let corner = |radius: f64, index: u32| {
            let (sin, cos) = (f64::from(index) / f64::from(many) * 6.0).sin_cos();
            [radius * cos, radius * sin, 0.0]
        };
        let round: Vec<[f64; 3]> = (0..many).map(|index| corner(1.0, index)).collect();
        assert_eq!(cut(round.clone()).triangles.len(), MOST_CORNERS - 1);
        let mut mesh = Mesh { vertices: round, ..Mesh::default() };
        mesh.vertices[9] = corner(0.5, 9);
        let corners: Vec<u32> = (0..many).collect();
        let told = Cutter::default().add(&mut mesh, &corners, 0).unwrap_err();
        assert!(told.starts_with("has a polygon with a bay of 32769 corners"), "{told}");
    }

    proptest! {
        /// A star about a point in a tilted plane, far from the origin. Its triangles have its area and its
        /// side. Those of a fan about a corner do not.
        #[test]
        fn triangles_cover_a_star_and_nothing_else(
            radii in proptest::collection::vec(0.1..1.0_f64, 4..60),
            normal in [-1.0..1.0_f64, -1.0..1.0, 0.1..1.0],
            far in -1e4..1e4_f64,
        ) {
            let normal = DVec3::from(normal).normalize();
            let (right, up) = normal.any_orthonormal_pair();
            let step = std::f64::consts::TAU / radii.len() as f64;
            let corner = |(index, radius): (usize, &f64)| {
                let (sin, cos) = (index as f64 * step).sin_cos();
                (DVec3::splat(far) + radius * (cos * right + sin * up)).to_array()
            };
            let mesh = cut(radii.iter().enumerate().map(corner).collect());
            let next = radii.iter().cycle().skip(1);
            let wanted: f64 =
                radii.iter().zip(next).map(|(a, b)| a * b * step.sin() / 2.0).sum();
            let found: f64 = areas(&mesh).map(DVec3::length).sum();
            prop_assert!((found - wanted).abs() < 1e-6 * wanted, "{found} for {wanted}");
            prop_assert!(areas(&mesh).all(|area| area.dot(normal) > -1e-9));
        }
    }
}

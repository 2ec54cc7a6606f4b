//! The lowest corner of a mesh, however it is turned: where it stands on the ground.

use std::rc::Rc;

use super::mesh::Mesh;
use super::pose::Transform;

/// Corners looked at together.
const BLOCK: usize = 64;

/// Cells of an axis by which corners are put in order.
const CELLS: f64 = 32.0;

/// Verticals for which all corners are looked at. Putting them into blocks takes as long as some forty of
/// these (26 ms each with 4.8 million triangles, against 1 s), and as much memory as the mesh.
const PLAIN: usize = 16;

/// The lowest corner of a mesh, for one place after the other.
#[derive(Debug)]
pub(super) struct Footing {
    mesh: Rc<Mesh>,
    /// Verticals that were asked for.
    asked: usize,
    /// For the verticals after [`PLAIN`] others.
    blocks: Option<Blocks>,
    /// The vertical that was asked for last, in the frame of the mesh, and the height found.
    last: Option<([u64; 3], f64)>,
}

/// The corners of a mesh, neighbours together, so that most of them need not be looked at.
#[derive(Debug)]
struct Blocks {
    /// Those that belong to a triangle, each once.
    corners: Vec<[f64; 3]>,
    /// Lowest and highest coordinates of [`BLOCK`] corners each.
    boxes: Vec<[[f64; 3]; 2]>,
}

impl Footing {
    /// That of `mesh`.
    pub(super) fn of(mesh: Rc<Mesh>) -> Self {
        Self { mesh, asked: 0, blocks: None, last: None }
    }

    /// The height of the lowest corner where the mesh is carried by `place`: what the least of all
    /// their heights is, to the last bit. Infinite without corners.
    pub(super) fn lowest(&mut self, place: &Transform) -> f64 {
        // Adding the height of the place is monotone: it may be left to the end.
        let up = place.rotation().row(2).to_array();
        let bits = up.map(f64::to_bits);
        let lowest = match self.last {
            Some((known, lowest)) if known == bits => lowest,
            _ => self.lowest_along(place, up),
        };
        self.last = Some((bits, lowest));
        lowest + place.point([0.0; 3])[2]
    }

    /// The least height of all corners turned by `place`, whose vertical is `up` in their frame.
    fn lowest_along(&mut self, place: &Transform, up: [f64; 3]) -> f64 {
        self.asked += 1;
        if self.asked > PLAIN {
            let blocks = self.blocks.get_or_insert_with(|| Blocks::of(&self.mesh));
            return blocks.lowest_along(place, up);
        }
        let corners = self.mesh.triangles.iter().flatten();
        let corner = |index: &u32| self.mesh.vertices[*index as usize];
        lowest_of(corners.map(corner), place, f64::INFINITY)
    }
}

impl Blocks {
    /// The blocks of the corners of `mesh`.
    fn of(mesh: &Mesh) -> Self {
        let mut used: Vec<u32> = mesh.triangles.iter().flatten().copied().collect();
        used.sort_unstable();
        used.dedup();
        let corner = |index: u32| mesh.vertices[index as usize];
        let [low, high] = extent(used.iter().map(|index| corner(*index)));
        let place = |corner: [f64; 3]| {
            let cell = |axis: usize| {
                let share = (corner[axis] - low[axis]) / (high[axis] - low[axis]);
                (share * CELLS) as u32
            };
            interleaved([0, 1, 2].map(cell))
        };
        used.sort_by_cached_key(|index| place(corner(*index)));
        let corners: Vec<[f64; 3]> = used.iter().map(|index| corner(*index)).collect();
        let boxes = corners.chunks(BLOCK).map(|some| extent(some.iter().copied())).collect();
        Self { corners, boxes }
    }

    /// As [`Footing::lowest_along`] has it.
    fn lowest_along(&self, place: &Transform, up: [f64; 3]) -> f64 {
        let mut lowest = f64::INFINITY;
        for (corners, [low, high]) in self.corners.chunks(BLOCK).zip(&self.boxes) {
            let (mut least, mut size) = (0.0, 0.0);
            for axis in 0..3 {
                let ends = [up[axis] * low[axis], up[axis] * high[axis]];
                least += ends[0].min(ends[1]);
                size += ends[0].abs().max(ends[1].abs());
            }
            // More than any rounding.
            if least - 1e-12 * size <= lowest {
                lowest = lowest_of(corners.iter().copied(), place, lowest);
            }
        }
        lowest
    }
}

/// The least of `lowest` and the heights of `corners` turned by `place`.
fn lowest_of(corners: impl Iterator<Item = [f64; 3]>, place: &Transform, lowest: f64) -> f64 {
    corners.map(|corner| place.direction(corner)[2]).fold(lowest, f64::min)
}

/// Lowest and highest coordinates on each axis.
fn extent(corners: impl Iterator<Item = [f64; 3]>) -> [[f64; 3]; 2] {
    corners.fold([[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]], |[mut low, mut high], corner| {
        for axis in 0..3 {
            low[axis] = low[axis].min(corner[axis]);
            high[axis] = high[axis].max(corner[axis]);
        }
        [low, high]
    })
}

/// The bits of three numbers in turn, the lowest first, so that cells with near numbers are near.
fn interleaved(cell: [u32; 3]) -> u32 {
    let bits = (0..8).flat_map(|bit| (0..3).map(move |axis| (bit, axis)));
    bits.fold(0, |sum, (bit, axis)| sum | (cell[axis] >> bit & 1) << (3 * bit + axis))
}

#[cfg(test)]
mod tests {
    use super::super::pose::Pose;
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_lowest_corner_is_found_to_the_last_bit(
            vertices in proptest::collection::vec([-3.0..3.0_f64, -1.0..1.0, 0.0..2.0], 3..500),
            flat: bool,
            angles in proptest::collection::vec([-4.0..4.0_f64, -1.0..1.0, -1.0..1.0], 1..2 * PLAIN),
            height in -100.0..100.0_f64,
        ) {
            let mut mesh = Mesh { vertices, ..Mesh::default() };
            if flat {
                mesh.vertices.iter_mut().for_each(|vertex| vertex[2] = 0.0);
            }
            // The last one belongs to no triangle.
            let count = mesh.vertices.len() as u32 - 1;
            mesh.triangles = (0..count).map(|i| [i, (i + 1) % count, (i + 2) % count]).collect();
            let mesh = Rc::new(mesh);
            let mut footing = Footing::of(Rc::clone(&mesh));
            for [yaw, pitch, roll] in angles {
                for yaw in [yaw, yaw + 1.0] {
                    let pose = Pose::turned([1.0, 2.0, height], [yaw, pitch, roll]);
                    let place = pose.world_from_sensor();
                    let corners = &mesh.vertices[..count as usize];
                    let heights = corners.iter().map(|corner| place.point(*corner)[2]);
                    let lowest = heights.fold(f64::INFINITY, f64::min);
                    prop_assert_eq!(footing.lowest(&place), lowest);
                }
            }
        }
    }
}

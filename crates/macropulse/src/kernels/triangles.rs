//! Triangles that rays meet, and one ray among them.
//!
//! Which triangle a ray passes through is decided in `f32`, in a frame about the sensor so that
//! nothing is far from its origin. The test is the watertight one of \[WBW13\]: the corners are
//! sheared so that the ray becomes the depth axis, and the sign of each edge is exact, so two
//! triangles that share an edge can never both miss a ray. How far the hit is, is then solved
//! in `f64` on the plane of the triangle as it was modelled.

use glam::{DVec3, Vec3A, Vec3Swizzles};
use obvhs::triangle::Triangle;

use super::packet::{Lanes, Packet};
use super::tree::{Aim, FARTHEST, Tree};
use super::wide::LANES;
use macropulse_codec::on_every_level;

/// The corners of a triangle, m.
pub(crate) type Corners = [[f64; 3]; 3];

/// Triangles and the hierarchy over them.
#[derive(Debug, Default)]
pub(crate) struct Triangles {
    pub(super) tree: Tree,
    /// Local corners in the order of the leaves; by axis, then by corner.
    pub(super) narrow: Vec<[Vec3A; 3]>,
    /// The same triangles, as they were modelled.
    pub(super) corners: Vec<Corners>,
}

/// A triangle that a ray meets, and how far away.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Hit {
    pub range: f64,
    /// Index in the order of the leaves.
    pub leaf: u32,
}

impl Triangles {
    /// Builds the hierarchy of `count` triangles with the corners that `corners_of` gives, exact
    /// about `centre`. Gives it with the index that each
    /// leaf had; triangles without area or with a coordinate that is not finite cannot be hit and
    /// are left out.
    pub(crate) fn new(
        count: usize,
        corners_of: impl Fn(usize) -> Corners,
        centre: [f64; 3],
    ) -> (Self, Vec<u32>) {
        let origin = DVec3::from(centre);
        let mut kept = Vec::with_capacity(count);
        let mut triangles = Vec::with_capacity(count);
        for index in 0..count {
            let corners = corners_of(index);
            let local = corners.map(|corner| DVec3::from(corner) - origin);
            let near = local.iter().all(|corner| corner.abs().max_element() < FARTHEST);
            if near && has_area(&corners) {
                let [v0, v1, v2] = local.map(|corner| corner.as_vec3a());
                triangles.push(Triangle { v0, v1, v2 });
                kept.push(index as u32);
            }
        }
        let (tree, order) = Tree::over(&triangles, centre);
        let by_axis = |index: &u32| {
            let Triangle { v0, v1, v2 } = &triangles[*index as usize];
            [0, 1, 2].map(|axis| Vec3A::new(v0[axis], v1[axis], v2[axis]))
        };
        let narrow = order.iter().map(by_axis).collect();
        drop(triangles);
        let order: Vec<u32> = order.iter().map(|index| kept[*index as usize]).collect();
        let corners = order.iter().map(|index| corners_of(*index as usize)).collect();
        (Self { tree, narrow, corners }, order)
    }

    /// Number of triangles that can be hit.
    pub(crate) fn len(&self) -> usize {
        self.corners.len()
    }

    /// The middle of an upright box that holds all, and half its size.
    pub(crate) fn middle_and_half(&self) -> ([f64; 3], [f64; 3]) {
        let corners = || self.corners.iter().flatten().map(|corner| DVec3::from(*corner));
        let low = corners().fold(DVec3::INFINITY, DVec3::min);
        let high = corners().fold(DVec3::NEG_INFINITY, DVec3::max);
        (((low + high) / 2.0).to_array(), ((high - low) / 2.0).to_array())
    }

    /// The unit normal of a leaf.
    pub(crate) fn normal(&self, leaf: u32) -> [f64; 3] {
        normal(&self.corners[leaf as usize])
    }

    /// The nearest triangle on a ray with a range in (`nearest`, `farthest`); of two equally far
    /// the first leaf.
    pub(crate) fn nearest(
        &self,
        (origin, direction): ([f64; 3], [f64; 3]),
        (nearest, farthest): (f64, f64),
    ) -> Option<Hit> {
        let mut best = Hit { range: farthest, leaf: 0 };
        let mut found = false;
        self.tree.along((origin, direction), (nearest, farthest), |leaf, aim| {
            if passes(&self.narrow[leaf as usize], aim) {
                let plane = Plane::new(&self.corners[leaf as usize], origin);
                let range = plane.range(direction);
                let first = found && range == best.range && leaf < best.leaf;
                if range > nearest && (range < best.range || first) {
                    (best, found) = (Hit { range, leaf }, true);
                }
            }
            best.range
        });
        found.then_some(best)
    }
}

/// Whether a line passes through the triangle, its edges and corners included, on either side.
///
/// Sheared, the ray is the origin of the plane (u, v), and the triangle holds it if it lies
/// on the same side of all three edges.
#[inline(always)]
fn passes(corners: &[Vec3A; 3], aim: &Aim) -> bool {
    let [u, v, along] = aim.axes;
    let depth = corners[along] - aim.origin[along];
    let u = (corners[u] - aim.origin[u]) - aim.shear[0] * depth;
    let v = (corners[v] - aim.origin[v]) - aim.shear[1] * depth;
    // Twice the areas that the origin spans with the edges bc, ca, ab.
    let areas = u.yzx() * v.zxy() - u.zxy() * v.yzx();
    let left = areas.cmpgt(Vec3A::ZERO);
    let right = areas.cmplt(Vec3A::ZERO);
    if left.any() && right.any() {
        return false;
    }
    left.all() || right.all() || passes_exactly(u.to_array(), v.to_array())
}

/// The same question where an area came out as zero.
///
/// Rounding a product is monotone, so the `f32` areas cannot have the wrong sign, only lose it.
/// The products of two `f32` are exact in `f64`, and so is the sign of their difference.
#[cold]
#[inline(never)]
pub(super) fn passes_exactly(u: [f32; 3], v: [f32; 3]) -> bool {
    let (u, v) = (u.map(f64::from), v.map(f64::from));
    let area = |a: usize, b: usize| u[a] * v[b] - u[b] * v[a];
    let areas = [area(1, 2), area(2, 0), area(0, 1)];
    let left = areas.iter().all(|area| *area >= 0.0);
    let right = areas.iter().all(|area| *area <= 0.0);
    // All three zero: the triangle is seen edge-on, and its neighbours are hit instead.
    left != right
}

/// A triangle seen from a place.
pub(super) struct Plane {
    normal: DVec3,
    /// The corners, from the place.
    corners: [DVec3; 3],
    /// n·(a−o)
    height: f64,
}

impl Plane {
    #[inline(always)]
    pub(super) fn new(corners: &Corners, origin: [f64; 3]) -> Self {
        let [a, b, c] = corners;
        let (a, b, c) = (DVec3::from(*a), DVec3::from(*b), DVec3::from(*c));
        let normal = (b - a).cross(c - a);
        let origin = DVec3::from(origin);
        let corners = [a - origin, b - origin, c - origin];
        Self { normal, corners, height: normal.dot(corners[0]) }
    }

    /// Where a ray from the place meets the plane; NaN if that is nowhere.
    ///
    /// `t = n·(a−o) / n·d`, kept within the depths of the three corners: a needle seen edge-on
    /// has no better answer.
    #[inline(always)]
    pub(super) fn range(&self, direction: [f64; 3]) -> f64 {
        let along = DVec3::from(direction);
        let [a, b, c] = &self.corners;
        let (a, b, c) = (a.dot(along), b.dot(along), c.dot(along));
        let least = |a: f64, b: f64| if a < b { a } else { b };
        let most = |a: f64, b: f64| if a > b { a } else { b };
        let (front, back) = (least(least(a, b), c), most(most(a, b), c));
        let range = self.height / self.normal.dot(along);
        // Unlike `clamp`, this lets NaN through.
        if range < front {
            front
        } else if range > back {
            back
        } else {
            range
        }
    }
}

/// The unit normal of a triangle with area.
#[inline(always)]
pub(super) fn normal([a, b, c]: &Corners) -> [f64; 3] {
    let (a, b, c) = (DVec3::from(*a), DVec3::from(*b), DVec3::from(*c));
    let normal = (b - a).cross(c - a);
    (normal * (1.0 / normal.length())).to_array()
}

fn has_area([a, b, c]: &Corners) -> bool {
    let [a, b, c] = [a, b, c].map(|corner| DVec3::from(*corner));
    let area = (b - a).cross(c - a).length();
    area > 0.0 && area.is_finite()
}

/// |cos| of the angle between a direction and a normal.
#[inline(always)]
fn cosine(direction: [f64; 3], normal: [f64; 3]) -> f32 {
    let dot = DVec3::from(direction).dot(DVec3::from(normal)).abs();
    (if dot < 1.0 { dot } else { 1.0 }) as f32
}

on_every_level! {
    /// The unit normals of the triangles that a packet has met, by axis; anything for rays that
    /// have met none.
    pub(crate) fn normals(triangles: &Triangles, packet: &Packet) -> [Lanes<f64>; 3] {
        let mut gathered = [[[0.0; LANES]; 3]; 3];
        for lane in 0..LANES {
            if let Some(corners) = triangles.corners.get(packet.leaf[lane] as usize) {
                for corner in 0..3 {
                    for axis in 0..3 {
                        gathered[corner][axis][lane] = corners[corner][axis];
                    }
                }
            }
        }
        let [a, b, c] = &gathered;
        let mut normals = [[0.0; LANES]; 3];
        for lane in 0..LANES {
            let corner = |of: &[Lanes<f64>; 3]| [of[0][lane], of[1][lane], of[2][lane]];
            let normal = normal(&[corner(a), corner(b), corner(c)]);
            for axis in 0..3 {
                normals[axis][lane] = normal[axis];
            }
        }
        normals
    }
}

on_every_level! {
    /// |cos| of the angles between the rays of a packet and a normal for each.
    pub(crate) fn cosines(packet: &Packet, normals: &[Lanes<f64>; 3]) -> Lanes<f32> {
        let mut cosines = [0.0; LANES];
        for lane in 0..LANES {
            let normal = [normals[0][lane], normals[1][lane], normals[2][lane]];
            cosines[lane] = cosine(packet.along(lane), normal);
        }
        cosines
    }
}

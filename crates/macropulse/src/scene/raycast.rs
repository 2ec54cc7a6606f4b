//! Rays against triangles: a bounding-volume hierarchy and a test that leaves no gap between
//! neighbours.
//!
//! Which triangle a ray passes through is decided in `f32`, in a frame about the sensor so that
//! nothing is far from its origin. The test is the watertight one of \[WBW13\]: the corners are
//! sheared so that the ray becomes the depth axis, and the sign of each edge is exact, so two
//! triangles that share an edge can never both disown a ray. How far the hit is, is then solved
//! in `f64` on the plane of the triangle as it was modelled.

use std::time::Duration;

use glam::{DVec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::bvh2::builder::build_bvh2_from_tris;
use obvhs::bvh2::node::Bvh2Node;
use obvhs::triangle::Triangle;

use super::hits::{CastRays, Hit, Ray};

/// One triangle of the world: its corners in `f64`, and what it belongs to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Facet {
    pub corners: [[f64; 3]; 3],
    pub material: u16,
    pub object: u16,
}

/// Triangles that can be hit by rays.
pub(super) struct Facets {
    /// Added to the local frame, gives the world, m.
    centre: DVec3,
    nodes: Vec<Bvh2Node>,
    /// Corners in the local frame, in the order of the leaves.
    narrow: Vec<[[f32; 3]; 3]>,
    /// The same triangles, in the world.
    facets: Vec<Facet>,
    /// Nodes that can wait at once during a descent.
    depth: usize,
}

/// A ray as the hierarchy needs it: local, narrow, and sheared along its main axis.
struct LocalRay {
    origin: Vec3A,
    inverse: Vec3A,
    /// Axes across (two) and along the ray.
    axes: [usize; 3],
    /// Shear of the two axes across.
    shear: [f32; 2],
}

/// Slabs are stretched by this factor: it covers the rounding of (b−o)·d⁻¹ and of the shear.
const SLACK: f32 = 1.0 + 16.0 * f32::EPSILON;

/// Deep enough for any hierarchy the builder makes of real meshes; deeper ones get a heap stack.
const STACK: usize = 96;

impl Facets {
    /// Builds the hierarchy of `facets`, exact about `centre` (the sensor). Triangles without
    /// area or with a coordinate that is not finite cannot be hit and are left out.
    pub(super) fn new(facets: Vec<Facet>, centre: [f64; 3]) -> Self {
        let centre = DVec3::from(centre);
        let narrow = |corner: [f64; 3]| (DVec3::from(corner) - centre).as_vec3a();
        let facets: Vec<Facet> = facets.into_iter().filter(|facet| facet.has_area()).collect();
        let triangles: Vec<Triangle> = facets
            .iter()
            .map(|facet| {
                let [v0, v1, v2] = facet.corners.map(narrow);
                Triangle { v0, v1, v2 }
            })
            .collect();
        if triangles.is_empty() {
            return Self { centre, nodes: vec![], narrow: vec![], facets, depth: 0 };
        }
        let plan = BvhBuildParams { pre_split: false, ..BvhBuildParams::medium_build() };
        let tree = build_bvh2_from_tris(&triangles, plan, &mut Duration::default());
        let order = || tree.primitive_indices.iter().map(|&index| index as usize);
        let narrow = |triangle: &Triangle| {
            [triangle.v0, triangle.v1, triangle.v2].map(|corner| corner.to_array())
        };
        Self {
            centre,
            narrow: order().map(|index| narrow(&triangles[index])).collect(),
            facets: order().map(|index| facets[index]).collect(),
            depth: tree.depth(0),
            nodes: tree.nodes,
        }
    }

    /// Number of triangles that can be hit.
    pub(super) fn len(&self) -> usize {
        self.facets.len()
    }

    /// The triangles, in an order that depends only on them.
    pub(super) fn facets(&self) -> &[Facet] {
        &self.facets
    }

    fn descend(&self, ray: &Ray, limits: (f64, f64), stack: &mut [u32]) -> Option<Hit> {
        let local = LocalRay::new(ray, self.centre)?;
        let (nearest, mut farthest) = limits;
        let mut best = None;
        let mut waiting = 0;
        let mut index = 0;
        if local.enters(&self.nodes[0], narrow_above(farthest)).is_none() {
            return None;
        }
        loop {
            let node = &self.nodes[index];
            let first = node.first_index as usize;
            if node.is_leaf() {
                for leaf in first..first + node.prim_count as usize {
                    if !local.passes(&self.narrow[leaf]) {
                        continue;
                    }
                    let facet = &self.facets[leaf];
                    if let Some((range, normal)) = facet.meet(ray)
                        && range > nearest
                        && range < farthest
                    {
                        farthest = range;
                        let Facet { material, object, .. } = *facet;
                        best = Some(Hit { range, normal, material, object });
                    }
                }
            } else {
                let limit = narrow_above(farthest);
                let left = local.enters(&self.nodes[first], limit);
                let right = local.enters(&self.nodes[first + 1], limit);
                match (left, right) {
                    (Some(l), Some(r)) => {
                        let (near, far) =
                            if r < l { (first + 1, first) } else { (first, first + 1) };
                        stack[waiting] = far as u32;
                        waiting += 1;
                        index = near;
                        continue;
                    }
                    (Some(_), None) => {
                        index = first;
                        continue;
                    }
                    (None, Some(_)) => {
                        index = first + 1;
                        continue;
                    }
                    (None, None) => {}
                }
            }
            // Nodes on the stack may lie behind what has been hit since.
            let limit = narrow_above(farthest);
            loop {
                if waiting == 0 {
                    return best;
                }
                waiting -= 1;
                index = stack[waiting] as usize;
                if best.is_none() || local.enters(&self.nodes[index], limit).is_some() {
                    break;
                }
            }
        }
    }
}

impl CastRays for Facets {
    fn cast(&self, ray: &Ray, nearest: f64, farthest: f64) -> Option<Hit> {
        if self.nodes.is_empty() {
            return None;
        }
        match self.depth < STACK {
            true => self.descend(ray, (nearest, farthest), &mut [0; STACK]),
            false => self.descend(ray, (nearest, farthest), &mut vec![0; self.depth + 1]),
        }
    }
}

/// `farthest` as an `f32` that is not below it.
fn narrow_above(farthest: f64) -> f32 {
    (farthest as f32) * SLACK
}

impl LocalRay {
    /// `None` if the ray is not a ray: NaN, infinite, or without direction.
    fn new(ray: &Ray, centre: DVec3) -> Option<Self> {
        let direction = DVec3::from(ray.direction).as_vec3a();
        let origin = (DVec3::from(ray.origin) - centre).as_vec3a();
        if !origin.is_finite() || !direction.is_finite() || direction == Vec3A::ZERO {
            return None;
        }
        let size = direction.abs();
        let along = if size.x >= size.y && size.x >= size.z {
            0
        } else if size.y >= size.z {
            1
        } else {
            2
        };
        let (u, v) = ((along + 1) % 3, (along + 2) % 3);
        let shear = [direction[u] / direction[along], direction[v] / direction[along]];
        // A slope of zero would make 0·∞ of a box that touches the ray.
        let steep =
            |slope: f32| 1.0 / if slope.abs() < 1e-20 { 1e-20f32.copysign(slope) } else { slope };
        let inverse = Vec3A::new(steep(direction.x), steep(direction.y), steep(direction.z));
        Some(Self { origin, inverse, axes: [u, v, along], shear })
    }

    /// Where the ray enters the box of `node`, if it does so before `farthest`.
    #[inline]
    fn enters(&self, node: &Bvh2Node, farthest: f32) -> Option<f32> {
        let a = (node.aabb.min - self.origin) * self.inverse;
        let b = (node.aabb.max - self.origin) * self.inverse;
        let enter = a.min(b).max_element().max(0.0);
        let leave = a.max(b).min_element() * SLACK;
        (enter <= leave && enter <= farthest).then_some(enter)
    }

    /// Whether the line passes through the triangle, its edges and corners included, on either
    /// side.
    #[inline]
    fn passes(&self, corners: &[[f32; 3]; 3]) -> bool {
        let [u, v, w] = self.axes;
        let [a, b, c] = corners.map(|corner| {
            let depth = corner[w] - self.origin[w];
            [
                (corner[u] - self.origin[u]) - self.shear[0] * depth,
                (corner[v] - self.origin[v]) - self.shear[1] * depth,
            ]
        });
        let sides = [edge(b, c), edge(c, a), edge(a, b)];
        let left = sides.iter().all(|side| *side >= 0.0);
        let right = sides.iter().all(|side| *side <= 0.0);
        // All three zero: the triangle is seen edge-on, and its neighbours answer for it.
        left != right
    }
}

/// On which side of the edge from `a` to `b` the origin lies: twice the area, with exact sign.
///
/// Rounding a product is monotone, so an `f32` difference has a wrong sign only by being zero;
/// products of two `f32` are exact in `f64`.
#[inline]
fn edge(a: [f32; 2], b: [f32; 2]) -> f64 {
    let area = a[0] * b[1] - a[1] * b[0];
    if area != 0.0 {
        return f64::from(area);
    }
    f64::from(a[0]) * f64::from(b[1]) - f64::from(a[1]) * f64::from(b[0])
}

impl Facet {
    fn points(&self) -> [DVec3; 3] {
        self.corners.map(DVec3::from)
    }

    fn has_area(&self) -> bool {
        let [a, b, c] = self.points();
        let area = (b - a).cross(c - a).length();
        area > 0.0 && area.is_finite()
    }

    /// Range and unit normal where the ray meets the plane of the triangle.
    ///
    /// `t = n·(a−o) / n·d`, kept within the depths of the three corners: a needle seen edge-on
    /// has no better answer.
    fn meet(&self, ray: &Ray) -> Option<(f64, [f64; 3])> {
        let [a, b, c] = self.points();
        let (origin, along) = (DVec3::from(ray.origin), DVec3::from(ray.direction));
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let depths = [a, b, c].map(|corner| (corner - origin).dot(along));
        let near = depths[0].min(depths[1]).min(depths[2]);
        let far = depths[0].max(depths[1]).max(depths[2]);
        let range = normal.dot(a - origin) / normal.dot(along);
        let range = range.max(near).min(far);
        range.is_finite().then(|| (range, normal.to_array()))
    }
}

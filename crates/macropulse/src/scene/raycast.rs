//! Rays against triangles: a bounding-volume hierarchy and a test that leaves no gap between
//! neighbours.
//!
//! Which triangle a ray passes through is decided in `f32`, in a frame about the sensor so that
//! nothing is far from its origin. The test is the watertight one of \[WBW13\]: the corners are
//! sheared so that the ray becomes the depth axis, and the sign of each edge is exact, so two
//! triangles that share an edge can never both disown a ray. How far the hit is, is then solved
//! in `f64` on the plane of the triangle as it was modelled.

use std::time::Duration;

use glam::{DVec3, Vec3A, Vec3Swizzles};
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
    /// Local corners in the order of the leaves; by axis, then by corner.
    narrow: Vec<[Vec3A; 3]>,
    /// The same triangles, in the world.
    facets: Vec<Facet>,
    /// Nodes that can wait at once during a descent.
    depth: usize,
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
        let local = |corner: [f64; 3]| (DVec3::from(corner) - centre).as_vec3a();
        let facets: Vec<Facet> = facets.into_iter().filter(Facet::has_area).collect();
        let triangles: Vec<Triangle> = facets
            .iter()
            .map(|facet| {
                let [v0, v1, v2] = facet.corners.map(local);
                Triangle { v0, v1, v2 }
            })
            .collect();
        if triangles.is_empty() {
            return Self { centre, nodes: vec![], narrow: vec![], facets, depth: 0 };
        }
        let plan = BvhBuildParams { pre_split: false, ..BvhBuildParams::medium_build() };
        let tree = build_bvh2_from_tris(&triangles, plan, &mut Duration::default());
        let order = || tree.primitive_indices.iter().map(|&index| index as usize);
        let by_axis = |Triangle { v0, v1, v2 }: &Triangle| {
            [0, 1, 2].map(|axis| Vec3A::new(v0[axis], v1[axis], v2[axis]))
        };
        Self {
            centre,
            narrow: order().map(|index| by_axis(&triangles[index])).collect(),
            facets: order().map(|index| facets[index]).collect(),
            depth: tree.depth(0),
            nodes: tree.nodes,
        }
    }

    /// Number of triangles that can be hit.
    pub(super) fn len(&self) -> usize {
        self.facets.len()
    }

    /// Walks the hierarchy, the nearer child first. `stack` holds the children put off.
    fn descend(&self, ray: &Ray, limits: (f64, f64), stack: &mut [u32]) -> Option<Hit> {
        let local = LocalRay::new(ray, self.centre)?;
        let (nearest, mut farthest) = limits;
        let mut best = None;
        let mut waiting = 0;
        let mut index = 0;
        loop {
            let node = &self.nodes[index];
            let first = node.first_index as usize;
            let limit = narrow_above(farthest);
            if node.is_leaf() {
                for leaf in first..first + node.prim_count as usize {
                    if !local.passes(&self.narrow[leaf]) {
                        continue;
                    }
                    let range = self.facets[leaf].range(ray);
                    if range > nearest && range < farthest {
                        (farthest, best) = (range, Some(leaf));
                    }
                }
            } else {
                let left = local.enters(&self.nodes[first], limit);
                let right = local.enters(&self.nodes[first + 1], limit);
                let (near, far) =
                    if right < left { (first + 1, first) } else { (first, first + 1) };
                // Written always and kept only if both are entered: no branch to mispredict.
                stack[waiting] = far as u32;
                waiting += usize::from((left < f32::INFINITY) & (right < f32::INFINITY));
                if (left < f32::INFINITY) | (right < f32::INFINITY) {
                    index = near;
                    continue;
                }
            }
            // What was put off may by now lie behind the nearest hit.
            let limit = narrow_above(farthest);
            index = loop {
                if waiting == 0 {
                    return best.map(|leaf| self.facets[leaf].hit(farthest));
                }
                waiting -= 1;
                let put_off = stack[waiting] as usize;
                if best.is_none() || local.enters(&self.nodes[put_off], limit) < f32::INFINITY {
                    break put_off;
                }
            };
        }
    }
}

impl CastRays for Facets {
    fn cast(&self, ray: &Ray, nearest: f64, farthest: f64) -> Option<Hit> {
        if self.nodes.is_empty() {
            return None;
        }
        match self.depth + 1 < STACK {
            true => self.descend(ray, (nearest, farthest), &mut [0; STACK]),
            false => self.descend(ray, (nearest, farthest), &mut vec![0; self.depth + 2]),
        }
    }
}

/// `farthest` as an `f32` that is not below it.
fn narrow_above(farthest: f64) -> f32 {
    farthest as f32 * SLACK
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

impl LocalRay {
    /// `None` if the ray is not a ray: NaN, infinite, or without direction.
    fn new(ray: &Ray, centre: DVec3) -> Option<Self> {
        let direction = DVec3::from(ray.direction).as_vec3a();
        let origin = (DVec3::from(ray.origin) - centre).as_vec3a();
        if !origin.is_finite() || !direction.is_finite() || direction == Vec3A::ZERO {
            return None;
        }
        let along = direction.abs().max_position();
        let (u, v) = ((along + 1) % 3, (along + 2) % 3);
        let shear = [direction[u] / direction[along], direction[v] / direction[along]];
        // A slope of zero would make 0·∞ of a box that touches the ray.
        let steep = |slope: f32| 1.0 / slope.abs().max(1e-20).copysign(slope);
        let inverse = Vec3A::new(steep(direction.x), steep(direction.y), steep(direction.z));
        Some(Self { origin, inverse, axes: [u, v, along], shear })
    }

    /// Where the ray enters the box of `node`; infinity if it does not do so before `farthest`.
    #[inline]
    fn enters(&self, node: &Bvh2Node, farthest: f32) -> f32 {
        let low = (node.aabb.min - self.origin) * self.inverse;
        let high = (node.aabb.max - self.origin) * self.inverse;
        let enter = low.min(high).max_element();
        let leave = low.max(high).min_element() * SLACK;
        // A box behind the ray has `leave` below zero; one around its start, `enter`.
        if enter <= leave && leave >= 0.0 && enter <= farthest { enter } else { f32::INFINITY }
    }

    /// Whether the line passes through the triangle, its edges and corners included, on either
    /// side.
    ///
    /// Sheared, the ray is the origin of the plane (u, v), and the triangle holds it if it lies
    /// on the same side of all three edges.
    #[inline]
    fn passes(&self, corners: &[Vec3A; 3]) -> bool {
        let [u, v, along] = self.axes;
        let depth = corners[along] - self.origin[along];
        let u = (corners[u] - self.origin[u]) - self.shear[0] * depth;
        let v = (corners[v] - self.origin[v]) - self.shear[1] * depth;
        // Twice the areas that the origin spans with the edges bc, ca, ab.
        let areas = u.yzx() * v.zxy() - u.zxy() * v.yzx();
        let left = areas.cmpgt(Vec3A::ZERO);
        let right = areas.cmplt(Vec3A::ZERO);
        if left.any() && right.any() {
            return false;
        }
        left.all() || right.all() || passes_exactly(u, v)
    }
}

/// The same question where an area came out as zero.
///
/// Rounding a product is monotone, so the `f32` areas cannot have the wrong sign, only lose it.
/// The products of two `f32` are exact in `f64`, and so is the sign of their difference.
#[cold]
fn passes_exactly(u: Vec3A, v: Vec3A) -> bool {
    let (u, v) = (u.as_dvec3(), v.as_dvec3());
    let area = |a: usize, b: usize| u[a] * v[b] - u[b] * v[a];
    let areas = [area(1, 2), area(2, 0), area(0, 1)];
    let left = areas.iter().all(|area| *area >= 0.0);
    let right = areas.iter().all(|area| *area <= 0.0);
    // All three zero: the triangle is seen edge-on, and its neighbours answer for it.
    left != right
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

    /// Where the ray meets the plane of the triangle; NaN if that is nowhere.
    ///
    /// `t = n·(a−o) / n·d`, kept within the depths of the three corners: a needle seen edge-on
    /// has no better answer.
    #[inline]
    fn range(&self, ray: &Ray) -> f64 {
        let [a, b, c] = self.points();
        let (origin, along) = (DVec3::from(ray.origin), DVec3::from(ray.direction));
        let normal = (b - a).cross(c - a);
        let depths = DVec3::from([a, b, c].map(|corner| (corner - origin).dot(along)));
        let range = normal.dot(a - origin) / normal.dot(along);
        // Unlike `clamp`, this lets NaN through.
        if range < depths.min_element() {
            depths.min_element()
        } else if range > depths.max_element() {
            depths.max_element()
        } else {
            range
        }
    }

    /// The hit on this triangle at `range`.
    fn hit(&self, range: f64) -> Hit {
        let [a, b, c] = self.points();
        let normal = (b - a).cross(c - a).normalize_or_zero().to_array();
        Hit { range, normal, material: self.material, object: self.object }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use std::f64::consts::{PI, TAU};

    fn facet(corners: [[f64; 3]; 3]) -> Facet {
        Facet { corners, material: 1, object: 2 }
    }

    /// A closed sphere about `centre` of `rows` × 2·`rows` quadrilaterals.
    fn sphere(centre: DVec3, radius: f64, rows: u32) -> Vec<Facet> {
        let point = |row: u32, column: u32| {
            let columns = 2 * rows;
            let (polar, around) = (
                PI * f64::from(row) / f64::from(rows),
                TAU * f64::from(column % columns) / f64::from(columns),
            );
            let ring = if row == 0 || row == rows { 0.0 } else { polar.sin() };
            (centre + radius * DVec3::new(ring * around.cos(), ring * around.sin(), polar.cos()))
                .to_array()
        };
        let cell = |row: u32, column: u32| {
            let [a, b] = [point(row, column), point(row, column + 1)];
            let [c, d] = [point(row + 1, column + 1), point(row + 1, column)];
            [facet([a, b, c]), facet([a, c, d])]
        };
        (0..rows).flat_map(|row| (0..2 * rows).flat_map(move |column| cell(row, column))).collect()
    }

    fn direction(chance: &mut ChaCha8Rng) -> DVec3 {
        loop {
            let point = DVec3::from([0; 3].map(|_| chance.random_range(-1.0..1.0)));
            if (1e-3..1.0).contains(&point.length_squared()) {
                return point.normalize();
            }
        }
    }

    fn leaks(world: &Facets, rays: impl Iterator<Item = Ray>) -> usize {
        rays.filter(|ray| world.cast(ray, 0.0, f64::INFINITY).is_none()).count()
    }

    #[test]
    fn no_ray_leaks_out_of_a_closed_sphere() {
        let world = Facets::new(sphere(DVec3::ZERO, 10.0, 300), [0.0; 3]);
        let mut chance = ChaCha8Rng::seed_from_u64(1);
        let rays = (0..2_000_000).map(|_| {
            let origin = (direction(&mut chance) * chance.random_range(0.0..9.9)).to_array();
            Ray { origin, direction: direction(&mut chance).to_array() }
        });
        assert_eq!(leaks(&world, rays), 0);
    }

    #[test]
    fn no_ray_leaks_that_is_aimed_at_corners_and_edges() {
        let facets = sphere(DVec3::ZERO, 10.0, 60);
        let world = Facets::new(facets.clone(), [0.0; 3]);
        let mut chance = ChaCha8Rng::seed_from_u64(2);
        let rays = (0..300_000).map(|index| {
            let [a, b, _] = facets[index % facets.len()].points();
            let aim = a.lerp(b, [0.0, 0.5, chance.random_range(0.0..1.0)][index % 3]);
            // Half of the rays start in the middle, where the local origin is exact.
            let origin = if index % 2 == 0 { DVec3::ZERO } else { direction(&mut chance) * 5.0 };
            Ray { origin: origin.to_array(), direction: (aim - origin).normalize().to_array() }
        });
        assert_eq!(leaks(&world, rays), 0);
    }

    #[test]
    fn a_sphere_with_a_hole_does_leak() {
        // The control of the two tests above: they can fail.
        let mut facets = sphere(DVec3::ZERO, 10.0, 60);
        facets.swap_remove(5_000);
        let world = Facets::new(facets, [0.0; 3]);
        let mut chance = ChaCha8Rng::seed_from_u64(3);
        let rays = (0..200_000)
            .map(|_| Ray { origin: [0.0; 3], direction: direction(&mut chance).to_array() });
        assert!(leaks(&world, rays) > 0);
    }

    #[test]
    fn ranges_are_those_of_the_plane_to_a_hundredth_of_a_millimetre() {
        // A leaning quadrilateral of two triangles, 150 m away, in map coordinates.
        let map = DVec3::new(500_000.0, 5_400_000.0, 120.0);
        let corner =
            |y: f64, z: f64| (map + DVec3::new(150.0 + 0.3 * y - 0.2 * z, y, z)).to_array();
        let [a, b, c, d] =
            [corner(-60.0, -40.0), corner(60.0, -40.0), corner(60.0, 40.0), corner(-60.0, 40.0)];
        let world = Facets::new(vec![facet([a, b, c]), facet([a, c, d])], map.to_array());
        let normal = DVec3::new(1.0, -0.3, 0.2).normalize();
        let mut chance = ChaCha8Rng::seed_from_u64(4);
        for _ in 0..10_000 {
            let y = chance.random_range(-35.0..35.0);
            let along = DVec3::new(150.0, y, chance.random_range(-30.0..30.0)).normalize();
            let ray = Ray { origin: map.to_array(), direction: along.to_array() };
            let hit = world.cast(&ray, 0.0, 1e3).unwrap();
            let exact = normal.x * 150.0 / normal.dot(along);
            assert!((hit.range - exact).abs() < 1e-5, "{} {exact}", hit.range);
            assert!((DVec3::from(hit.normal).dot(normal).abs() - 1.0).abs() < 1e-9);
            assert_eq!((hit.material, hit.object), (1, 2));
        }
    }

    #[test]
    fn a_ray_that_goes_on_behind_a_surface_meets_the_next() {
        let wall = |x: f64| facet([[x, -9.0, -9.0], [x, 9.0, -9.0], [x, 0.0, 9.0]]);
        let world = Facets::new(vec![wall(10.0), wall(10.001), wall(20.0)], [0.0; 3]);
        let ray = Ray { origin: [0.0; 3], direction: [1.0, 0.0, 0.0] };
        let mut ranges = vec![];
        let mut nearest = 0.0;
        while let Some(hit) = world.cast(&ray, nearest, 100.0) {
            nearest = hit.range;
            ranges.push(hit.range);
        }
        assert_eq!(ranges, [10.0, 10.001, 20.0]);
        assert_eq!(world.cast(&ray, 10.001, 20.0), None);
    }

    #[test]
    fn nonsense_is_never_hit() {
        let point = facet([[10.0, 0.0, 0.0]; 3]);
        let nowhere = facet([[10.0, f64::NAN, 0.0], [10.0, 1.0, 0.0], [10.0, 0.0, 1.0]]);
        let world = Facets::new(vec![point, nowhere], [0.0; 3]);
        assert_eq!(world.len(), 0);
        let world = Facets::new(sphere(DVec3::ZERO, 10.0, 8), [0.0; 3]);
        for direction in [[f64::NAN; 3], [0.0; 3], [f64::INFINITY, 0.0, 0.0]] {
            assert_eq!(world.cast(&Ray { origin: [0.0; 3], direction }, 0.0, 1e3), None);
        }
        let ray = Ray { origin: [0.0; 3], direction: [0.0, 0.0, 1.0] };
        assert!(world.cast(&ray, 0.0, 1e3).is_some());
        assert_eq!(world.cast(&ray, 0.0, f64::NAN), None);
    }
}

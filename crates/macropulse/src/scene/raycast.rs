//! Triangles with what they belong to, in a hierarchy that rays descend.

use super::hits::{CastRays, Hit, Ray};
use crate::kernels::{Corners, Triangles};

/// One triangle of the world: its corners in `f64`, and what it belongs to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Facet {
    pub corners: Corners,
    pub material: u16,
    pub object: u16,
}

/// Triangles over which no hierarchy is built yet, as columns.
#[derive(Default)]
pub(super) struct Loose {
    corners: Vec<Corners>,
    material_and_object: Vec<[u16; 2]>,
}

impl Extend<Facet> for Loose {
    fn extend<T: IntoIterator<Item = Facet>>(&mut self, facets: T) {
        let facets = facets.into_iter();
        self.corners.reserve(facets.size_hint().0);
        self.material_and_object.reserve(facets.size_hint().0);
        for Facet { corners, material, object } in facets {
            self.corners.push(corners);
            self.material_and_object.push([material, object]);
        }
    }
}

impl FromIterator<Facet> for Loose {
    fn from_iter<T: IntoIterator<Item = Facet>>(facets: T) -> Self {
        let mut loose = Self::default();
        loose.extend(facets);
        loose
    }
}

/// Triangles that can be hit by rays.
pub(super) struct Facets {
    pub triangles: Triangles,
    /// Material and object, in the order of the leaves.
    pub material_and_object: Vec<[u16; 2]>,
}

impl Facets {
    /// Builds the hierarchy of `facets`, exact about `centre` (the sensor). Triangles without
    /// area or with a coordinate that is not finite cannot be hit and are left out.
    pub(super) fn new(facets: Loose, centre: [f64; 3]) -> Self {
        let (triangles, order) = Triangles::new(facets.corners, centre);
        let pair = |index: &u32| facets.material_and_object[*index as usize];
        let material_and_object = order.iter().map(pair).collect();
        Self { triangles, material_and_object }
    }

    /// Number of triangles that can be hit.
    pub(super) fn len(&self) -> usize {
        self.triangles.len()
    }
}

impl CastRays for Facets {
    fn cast(&self, ray: &Ray, nearest: f64, farthest: f64) -> Option<Hit> {
        let met = self.triangles.nearest((ray.origin, ray.direction), (nearest, farthest))?;
        let [material, object] = self.material_and_object[met.leaf as usize];
        let normal = self.triangles.normal(met.leaf);
        Some(Hit { range: met.range, normal, material, object })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernels::{LANES, NONE, Packet, Waiting};
    use glam::DVec3;
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

    fn built(facets: &[Facet], centre: [f64; 3]) -> Facets {
        Facets::new(facets.iter().copied().collect(), centre)
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
        let world = built(&sphere(DVec3::ZERO, 10.0, 300), [0.0; 3]);
        let mut chance = ChaCha8Rng::seed_from_u64(1);
        let rays = (0..500_000).map(|_| {
            let origin = (direction(&mut chance) * chance.random_range(0.0..9.9)).to_array();
            Ray { origin, direction: direction(&mut chance).to_array() }
        });
        assert_eq!(leaks(&world, rays), 0);
    }

    #[test]
    fn no_ray_of_a_packet_leaks_out_of_a_closed_sphere() {
        let mut facets = sphere(DVec3::ZERO, 10.0, 300);
        let closed = built(&facets, [0.0; 3]);
        facets.drain(180_000..180_020);
        let open = built(&facets, [0.0; 3]);
        let leaks = |world: &Facets| {
            let mut chance = ChaCha8Rng::seed_from_u64(5);
            let (mut leaks, mut waiting) = (0, Waiting::default());
            for _ in 0..4_000_000 / LANES {
                let origin = direction(&mut chance) * chance.random_range(0.0..9.9);
                let mut packet = Packet::from(origin.to_array());
                for lane in 0..LANES {
                    packet.set(lane, direction(&mut chance).to_array(), f64::INFINITY);
                }
                packet.cast(&world.triangles, &mut waiting);
                leaks += packet.leaf.iter().filter(|leaf| **leaf == NONE).count();
            }
            leaks
        };
        assert_eq!(leaks(&closed), 0);
        // The control: of a hole a dozen or more find out.
        assert!(leaks(&open) > 10);
    }

    #[test]
    fn no_ray_leaks_that_is_aimed_at_corners_and_edges() {
        let facets = sphere(DVec3::ZERO, 10.0, 60);
        let world = built(&facets, [0.0; 3]);
        let mut chance = ChaCha8Rng::seed_from_u64(2);
        let rays = (0..300_000).map(|index| {
            let [a, b, _] = facets[index % facets.len()].corners.map(DVec3::from);
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
        let world = built(&facets, [0.0; 3]);
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
        let world = built(&[facet([a, b, c]), facet([a, c, d])], map.to_array());
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
        let world = built(&[wall(10.0), wall(10.001), wall(20.0)], [0.0; 3]);
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
        let world = built(&[point, nowhere], [0.0; 3]);
        assert_eq!(world.len(), 0);
        let world = built(&sphere(DVec3::ZERO, 10.0, 8), [0.0; 3]);
        for direction in [[f64::NAN; 3], [0.0; 3], [f64::INFINITY, 0.0, 0.0]] {
            assert_eq!(world.cast(&Ray { origin: [0.0; 3], direction }, 0.0, 1e3), None);
        }
        let ray = Ray { origin: [0.0; 3], direction: [0.0, 0.0, 1.0] };
        assert!(world.cast(&ray, 0.0, 1e3).is_some());
        assert_eq!(world.cast(&ray, 0.0, f64::NAN), None);
    }
}

//! All surfaces of a scene: triangles, copies of meshes, closed-form shapes. The nearest wins.
//!
//! There are three kinds. Unbounded planes are intersected with every ray. Other shapes, and copies
//! of a mesh that occurs more than once, are found by a hierarchy over their bounding boxes. The
//! triangles of all other meshes lie in one hierarchy, in the world. Of surfaces equally far away
//! the shape wins that comes first in the scene file, then the copy, then the triangle.

use glam::{DVec3, Vec3A};
use obvhs::aabb::Aabb;

use super::closed_form::Solid;
use super::hits::{CastRays, Hit, Ray};
use super::pose::Transform;
use super::raycast::{Facet, Facets};
use crate::kernels::{LANES, Lanes, NONE, Packet, Tree, Waiting, cosines, normals, turned};

/// Every surface of a scene, ready for rays.
pub(super) struct World {
    facets: Facets,
    /// Meshes that occur more than once, in their own frames.
    models: Vec<Facets>,
    /// Those without bounds first, then in the order of their ranks.
    primitives: Vec<Primitive>,
    /// How many have no bounds.
    unbounded: usize,
    /// Over the others.
    tree: Tree,
    /// Which one each leaf is.
    leaves: Vec<u32>,
}

/// A copy of a mesh.
#[derive(Debug, Clone, Copy)]
pub(super) struct Copy {
    /// Which of the models.
    pub model: usize,
    pub to_world: Transform,
    pub object: u16,
}

/// A surface that is tested on its own: a shape, or a copy of a mesh that occurs more than once.
enum Primitive {
    Solid(Box<Solid>),
    Copy { copy: Copy, from_world: Transform },
}

/// Boxes are widened by this much, and by [`WIDER`] of their farthest coordinate, m: more than
/// the rounding of a ray to `f32` can move it aside.
const WIDE: f64 = 0.01;
const WIDER: f64 = 1e-6;

impl World {
    /// Puts surfaces together; exact about `centre` (the sensor).
    pub(super) fn new(
        facets: &[Facet],
        (models, copies): (Vec<Facets>, &[Copy]),
        solids: Vec<Solid>,
        centre: [f64; 3],
    ) -> Self {
        let (unbounded, bounded): (Vec<Solid>, Vec<Solid>) =
            solids.into_iter().partition(|solid| solid.half_extent().is_none());
        let first = unbounded.len();
        let mut primitives: Vec<Primitive> = unbounded
            .into_iter()
            .chain(bounded)
            .map(|solid| Primitive::Solid(Box::new(solid)))
            .collect();
        primitives.extend(
            copies
                .iter()
                .map(|copy| Primitive::Copy { copy: *copy, from_world: copy.to_world.inverse() }),
        );
        let boxes: Vec<Aabb> = primitives[first..]
            .iter()
            .map(|primitive| bounds(primitive, &models, centre))
            .collect();
        let (tree, order) = Tree::over(&boxes, centre);
        let leaves = order.iter().map(|index| first as u32 + index).collect();
        let facets = Facets::new(facets, centre);
        Self { facets, models, primitives, unbounded: first, tree, leaves }
    }

    /// Number of triangles that can be hit, copies included.
    pub(super) fn triangles(&self) -> usize {
        let of_primitive = |primitive: &Primitive| match primitive {
            Primitive::Copy { copy, .. } => self.models[copy.model].len(),
            Primitive::Solid(_) => 0,
        };
        self.facets.len() + self.primitives.iter().map(of_primitive).sum::<usize>()
    }

    /// What each ray of `packet` meets first, as [`CastRays::cast`] has it; the range of those
    /// that meet nothing stays.
    pub(super) fn cast_packet(&self, packet: &mut Packet, hits: &mut PacketHits) {
        hits.primitive = [NONE; LANES];
        let PacketHits { primitive, face, .. } = hits;
        for index in 0..self.unbounded {
            self.meet_packet(index as u32, packet, (u32::MAX, primitive, face), &mut hits.inner);
        }
        packet.visit(&self.tree, &mut hits.waiting, &mut |packet, leaf, set| {
            let index = self.leaves[leaf as usize];
            self.meet_packet(index, packet, (set, primitive, face), &mut hits.inner);
        });
        packet.cast(&self.facets.triangles, &mut hits.waiting);
    }

    /// Fills in cosine, material and object of each hit of `packet`. Gives normals, of any length.
    pub(super) fn describe(&self, packet: &Packet, hits: &mut PacketHits) -> [Lanes<f64>; 3] {
        let mut across = [[0.0; LANES]; 3];
        if packet.leaf != [NONE; LANES] {
            across = normals(&self.facets.triangles, packet);
        }
        for lane in 0..LANES {
            if let Some(pair) = self.facets.material_and_object.get(packet.leaf[lane] as usize) {
                [hits.material[lane], hits.object[lane]] = *pair;
            } else if hits.primitive[lane] != NONE {
                let ray = Ray { origin: packet.origin, direction: packet.along(lane) };
                let found = (packet.range[lane], hits.face[lane]);
                let hit = self.hit(hits.primitive[lane], &ray, found);
                (hits.material[lane], hits.object[lane]) = (hit.material, hit.object);
                let [x, y, z] = &mut across;
                [x[lane], y[lane], z[lane]] = hit.normal;
            }
        }
        hits.cosine = cosines(packet, &across);
        across
    }

    /// Intersects the rays of `set` with one primitive, and records which of them hit it and where.
    #[inline]
    fn meet_packet(
        &self,
        index: u32,
        packet: &mut Packet,
        (set, primitive, face): (u32, &mut Lanes<u32>, &mut Lanes<u32>),
        waiting: &mut Waiting,
    ) {
        let mut limit = packet.range;
        for lane in 0..LANES {
            // Of two equally far the lower rank wins, whichever comes first.
            if primitive[lane] != NONE && index < primitive[lane] {
                limit[lane] = limit[lane].next_up();
            }
            if set >> lane & 1 == 0 {
                limit[lane] = f64::NAN;
            }
        }
        let (ranges, faces) = match &self.primitives[index as usize] {
            Primitive::Solid(solid) => solid.meet_packet(packet, &limit),
            Primitive::Copy { copy, from_world } => {
                let mut local = Packet::from(from_world.point(packet.origin));
                local.direction = turned(from_world.rotation(), &packet.direction);
                (local.nearest, local.range) = (packet.nearest, limit);
                local.cast(&self.models[copy.model].triangles, waiting);
                for lane in 0..LANES {
                    let missed = local.leaf[lane] == NONE;
                    local.range[lane] = if missed { f64::NAN } else { local.range[lane] };
                }
                (local.range, local.leaf)
            }
        };
        for lane in 0..LANES {
            if !ranges[lane].is_nan() {
                packet.range[lane] = ranges[lane];
                (primitive[lane], face[lane]) = (index, faces[lane]);
            }
        }
    }

    /// The hit of a ray on a primitive, at `range` on this face of a shape or leaf of a mesh.
    #[inline(always)]
    fn hit(&self, index: u32, ray: &Ray, (range, face): (f64, u32)) -> Hit {
        match &self.primitives[index as usize] {
            Primitive::Solid(solid) => solid.hit(ray, (range, face)),
            Primitive::Copy { copy, .. } => {
                let model = &self.models[copy.model];
                let normal = copy.to_world.direction(model.triangles.normal(face));
                let [material, _] = model.material_and_object[face as usize];
                Hit { range, normal, material, object: copy.object }
            }
        }
    }
}

impl CastRays for World {
    fn cast(&self, ray: &Ray, nearest: f64, farthest: f64) -> Option<Hit> {
        let mut best: Option<(u32, Hit)> = None;
        let mut limit = farthest;
        let mut farthest = farthest;
        let mut meet = |index: u32| {
            let wins = best.as_ref().is_some_and(|(holder, _)| index < *holder);
            let limit = if wins { farthest.next_up() } else { farthest };
            let hit = match &self.primitives[index as usize] {
                Primitive::Solid(solid) => solid.cast(ray, nearest, limit),
                Primitive::Copy { copy, from_world } => {
                    let local = (from_world.point(ray.origin), from_world.direction(ray.direction));
                    let met = self.models[copy.model].triangles.nearest(local, (nearest, limit));
                    met.map(|met| self.hit(index, ray, (met.range, met.leaf)))
                }
            };
            if let Some(hit) = hit {
                farthest = hit.range;
                best = Some((index, hit));
            }
            farthest
        };
        for index in 0..self.unbounded as u32 {
            limit = meet(index);
        }
        self.tree.along((ray.origin, ray.direction), (nearest, limit), |leaf, _| {
            meet(self.leaves[leaf as usize])
        });
        self.facets.cast(ray, nearest, farthest).or(best.map(|(_, hit)| hit))
    }
}

/// The first surface that each ray of a packet hits. Kept between packets for its memory.
#[derive(Default)]
pub(super) struct PacketHits {
    pub cosine: Lanes<f32>,
    pub material: Lanes<u16>,
    pub object: Lanes<u16>,
    /// Index of the primitive that is hit, and its face or its leaf; [`NONE`] where none is.
    primitive: Lanes<u32>,
    face: Lanes<u32>,
    waiting: Waiting,
    inner: Waiting,
}

impl PacketHits {
    /// Whether the ray of a lane hits any surface.
    #[inline]
    pub(super) fn is_hit(&self, packet: &Packet, lane: usize) -> bool {
        packet.leaf[lane] != NONE || self.primitive[lane] != NONE
    }
}

/// The bounding box of a primitive that has bounds, relative to `centre`.
fn bounds(primitive: &Primitive, models: &[Facets], centre: [f64; 3]) -> Aabb {
    let (low, high) = match primitive {
        Primitive::Solid(solid) => {
            let half = solid.half_extent().unwrap_or(DVec3::INFINITY);
            let middle = DVec3::from(solid.pose().position);
            (middle - half, middle + half)
        }
        Primitive::Copy { copy, .. } => {
            let (middle, half) = models[copy.model].triangles.middle_and_half();
            let middle = DVec3::from(copy.to_world.point(middle));
            let half = copy.to_world.rotation().abs() * DVec3::from(half);
            (middle - half, middle + half)
        }
    };
    let (low, high) = (low - DVec3::from(centre), high - DVec3::from(centre));
    let wider = WIDE + WIDER * low.abs().max(high.abs()).max_element();
    let narrow = |corner: DVec3| Vec3A::from(corner.as_vec3());
    Aabb::new(narrow(low - wider), narrow(high + wider))
}

#[cfg(test)]
mod tests {
    use super::super::closed_form::Shape;
    use super::super::pose::Pose;
    use super::*;
    use crate::kernels::Corners;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// A closed mesh of 4·`rows`² triangles about the origin, 4 m long.
    fn egg(rows: u32) -> Vec<Corners> {
        let point = |row: u32, column: u32| {
            let polar = std::f64::consts::PI * f64::from(row) / f64::from(rows);
            let around = std::f64::consts::PI * f64::from(column % (2 * rows)) / f64::from(rows);
            let ring = if row == 0 || row == rows { 0.0 } else { polar.sin() };
            [2.0 * ring * around.cos(), ring * around.sin(), polar.cos()]
        };
        let cell = |row: u32, column: u32| {
            let (a, b) = (point(row, column), point(row, column + 1));
            let (c, d) = (point(row + 1, column + 1), point(row + 1, column));
            [[a, b, c], [a, c, d]]
        };
        (0..rows).flat_map(|row| (0..2 * rows).flat_map(move |column| cell(row, column))).collect()
    }

    fn poses(chance: &mut ChaCha8Rng, count: usize) -> Vec<Pose> {
        let pose = |_| Pose {
            position: [0; 3].map(|_| chance.random_range(-40.0..40.0)),
            yaw: chance.random_range(-3.0..3.0),
            pitch: chance.random_range(-1.0..1.0),
            roll: chance.random_range(-1.0..1.0),
        };
        (0..count).map(pose).collect()
    }

    /// The same eggs, kept once or laid out; with a plane, a box and a ball.
    fn worlds(poses: &[Pose]) -> [World; 2] {
        let mesh = egg(20);
        let facet = |corners: Corners, object| Facet { corners, material: 1, object };
        let solids = || {
            let solid = |shape, at, object| Solid::new(shape, Pose::at(at), 0, object);
            vec![
                solid(Shape::Plane { normal: [0.0, 0.0, 1.0] }, [0.0, 0.0, -50.0], 0),
                solid(Shape::Box { half: [3.0, 2.0, 1.0] }, [20.0, 0.0, 0.0], 1),
                solid(Shape::Sphere { radius: 2.0 }, [-15.0, 10.0, 0.0], 2),
            ]
        };
        let model: Vec<Facet> = mesh.iter().map(|corners| facet(*corners, 0)).collect();
        let mut copies = vec![];
        let mut flat = vec![];
        for (index, pose) in poses.iter().enumerate() {
            let (to_world, object) = (pose.world_from_sensor(), 3 + index as u16);
            copies.push(Copy { model: 0, to_world, object });
            let laid =
                |corners: &Corners| facet(corners.map(|corner| to_world.point(corner)), object);
            flat.extend(mesh.iter().map(laid));
        }
        let models = vec![Facets::new(&model, [0.0; 3])];
        [
            World::new(&[], (models, &copies), solids(), [0.0; 3]),
            World::new(&flat, (vec![], &[]), solids(), [0.0; 3]),
        ]
    }

    fn packet(chance: &mut ChaCha8Rng, origin: [f64; 3], spread: f64) -> Packet {
        let mut packet = Packet::from(origin);
        let middle = [0; 3].map(|_| chance.random_range(-1.0..1.0_f64));
        for lane in 0..LANES {
            let aim = DVec3::from(middle.map(|slope| slope + chance.random_range(-spread..spread)));
            packet.set(lane, aim.normalize().to_array(), 1e3);
        }
        packet
    }

    #[test]
    fn a_packet_meets_what_its_rays_meet_alone() {
        let mut chance = ChaCha8Rng::seed_from_u64(11);
        let (mut packet_hits, mut hits) = (PacketHits::default(), 0);
        for world in worlds(&poses(&mut chance, 30)) {
            for round in 0..2000 {
                let origin = [0; 3].map(|_| f64::from(round % 2) * chance.random_range(-9.0..9.0));
                let spread = if round % 3 == 0 { 1.0 } else { 0.02 };
                let mut packet = packet(&mut chance, origin, spread);
                packet.nearest = [f64::from(round % 5); LANES];
                let nearest = packet.nearest[0];
                world.cast_packet(&mut packet, &mut packet_hits);
                world.describe(&packet, &mut packet_hits);
                for lane in 0..LANES {
                    let ray = Ray { origin, direction: packet.along(lane) };
                    let alone = world.cast(&ray, nearest, 1e3);
                    assert_eq!(packet_hits.is_hit(&packet, lane), alone.is_some());
                    let Some(hit) = alone else { continue };
                    hits += 1;
                    assert_eq!(packet.range[lane], hit.range);
                    let cosine = DVec3::from(ray.direction).dot(DVec3::from(hit.normal)).abs();
                    assert_eq!(packet_hits.cosine[lane], cosine.min(1.0) as f32);
                    assert_eq!(
                        (packet_hits.material[lane], packet_hits.object[lane]),
                        (hit.material, hit.object)
                    );
                }
            }
        }
        assert!(hits > 30_000, "{hits}");
    }

    #[test]
    fn a_mesh_kept_once_is_met_where_its_copies_stand() {
        let mut chance = ChaCha8Rng::seed_from_u64(12);
        let poses = poses(&mut chance, 30);
        let [kept_once, laid_out] = worlds(&poses);
        assert_eq!(kept_once.triangles(), laid_out.triangles());
        let mut on_copies = 0;
        for round in 0..100_000 {
            let beside = DVec3::from([0; 3].map(|_| chance.random_range(-2.0..2.0)));
            let aim = DVec3::from(poses[round % 30].position) + beside;
            let direction = aim.normalize().to_array();
            let ray = Ray { origin: [0.0; 3], direction };
            let [once, flat] = [&kept_once, &laid_out].map(|world| world.cast(&ray, 0.0, 1e3));
            let (Some(once), Some(flat)) = (once, flat) else {
                assert_eq!(once, flat);
                continue;
            };
            on_copies += usize::from(once.object > 2);
            assert!((once.range - flat.range).abs() < 1e-6, "{once:?} {flat:?}");
            assert_eq!((once.material, once.object), (flat.material, flat.object));
        }
        assert!(on_copies > 10_000, "{on_copies}");
    }

    #[test]
    fn no_ray_leaks_out_of_a_mesh_that_is_kept_once() {
        let place = Pose { position: [100.0, -50.0, 3.0], yaw: 1.0, pitch: 0.3, roll: -0.2 };
        let [world, _] = worlds(&[place, Pose::at([0.0, 0.0, 300.0])]);
        let mut chance = ChaCha8Rng::seed_from_u64(13);
        let mut packet_hits = PacketHits::default();
        for _ in 0..20_000 {
            let mut packet = packet(&mut chance, place.position, 1.0);
            world.cast_packet(&mut packet, &mut packet_hits);
            assert!((0..LANES).all(|lane| packet.range[lane] < 2.1));
        }
    }
}

//! All surfaces of a scene: triangles, copies of meshes, closed-form shapes. The nearest wins.
//!
//! There are three kinds. Unbounded planes are intersected with every ray. Other shapes, and copies of a mesh
//! that occurs more than once, are found by a hierarchy over their bounding boxes. The triangles of all other
//! meshes lie in one hierarchy, in the world. Among surfaces equally far away, the shape that comes first in
//! the scene file wins, then the copy, then the triangle.
//!
//! Surfaces that move are kept apart and met after all that, ray by ray. Among equally far surfaces they come
//! last, in the order of the scene file.

use std::sync::Arc;

use glam::{DVec3, Vec3A};

use super::closed_form::Solid;
use super::hits::{CastRays, Hit, Ray};
use super::motion::Motion;
use super::moving::Mover;
use super::pose::Transform;
use super::raycast::{Facets, Loose};
use crate::kernels::{
    Bounds, Built, LANES, Lanes, NONE, Packet, Tree, Waiting, cosines, normals, turned,
};

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
    /// Surfaces that move: shapes, then meshes.
    movers: Vec<Mover>,
}

/// In place of the index of a primitive, where a ray has met something that moves.
const MOVER: u32 = NONE - 1;

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

/// Triangles with which a scene is fine.
const FINE: usize = 50_000;

impl World {
    /// Puts surfaces together; exact about `centre` (the sensor).
    pub(super) fn new(
        facets: Loose,
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
        // To measure a model takes as long as its triangles are many: once, not for each copy.
        let extents: Vec<Extent> =
            models.iter().map(|model| model.triangles.middle_and_half()).collect();
        let boxes = primitives[first..].iter().map(|one| bounds(one, &extents, centre));
        let Built { tree, order, .. } = Built::over((0..).zip(boxes), 1, centre);
        let leaves = order.iter().map(|index| first as u32 + index).collect();
        let facets = Facets::new(facets, centre);
        let movers = Vec::new();
        Self { facets, models, primitives, unbounded: first, tree, leaves, movers }
    }

    /// How each of this number of objects moves; `None` of those that stand still.
    pub(super) fn motions(&self, objects: usize) -> Vec<Option<&Motion>> {
        let mut motions = vec![None; objects];
        for mover in &self.movers {
            let (object, motion) = mover.moves();
            if let Some(place) = motions.get_mut(usize::from(object)) {
                *place = Some(motion);
            }
        }
        motions
    }

    /// The same world with `movers` in it.
    pub(super) fn with(self, movers: Vec<Mover>) -> Self {
        Self { movers, ..self }
    }

    /// Number of triangles that can be hit, copies included.
    pub(super) fn triangles(&self) -> usize {
        let of_primitive = |primitive: &Primitive| match primitive {
            Primitive::Copy { copy, .. } => self.models[copy.model].len(),
            Primitive::Solid(_) => 0,
        };
        let moving = self.movers.iter().map(Mover::triangles).sum::<usize>();
        self.facets.len() + self.primitives.iter().map(of_primitive).sum::<usize>() + moving
    }

    /// Triangles in memory, those of copies once; and shapes, copies and movers.
    pub(super) fn kept(&self) -> (usize, usize) {
        let models: usize = self.models.iter().map(Facets::len).sum();
        let mut moving: Vec<_> = self.movers.iter().filter_map(Mover::model).collect();
        moving.sort_by_key(|model| Arc::as_ptr(model));
        moving.dedup_by_key(|model| Arc::as_ptr(model));
        let moving: usize = moving.iter().map(|model| model.len()).sum();
        (self.facets.len() + models + moving, self.primitives.len() + self.movers.len())
    }

    /// Returns true if the descent of a ray takes longer than putting it in order. Order halves the time with
    /// the city of [`coherence`](super::coherence). With a car of 9 700 triangles and a street of its copies,
    /// the time grows to up to 1.5 times.
    pub(super) fn is_fine(&self) -> bool {
        let models: usize = self.models.iter().map(Facets::len).sum();
        self.facets.len() + models >= FINE
    }

    /// Finds the first hit of each ray of `packet` at its own time, as [`World::cast_at`] does. The range of
    /// a ray that meets nothing stays.
    #[inline]
    pub(super) fn cast_packet_at(
        &self,
        packet: &mut Packet,
        time_fs: &Lanes<i64>,
        hits: &mut PacketHits,
    ) {
        self.cast_packet(packet, hits);
        if !self.movers.is_empty() {
            self.meet_movers(packet, time_fs, hits);
        }
    }

    /// Lets the rays of `packet`, which know what stands still, meet what moves.
    fn meet_movers(&self, packet: &mut Packet, time_fs: &Lanes<i64>, hits: &mut PacketHits) {
        for (lane, &time_fs) in time_fs.iter().enumerate() {
            if packet.range[lane].is_nan() {
                continue;
            }
            let ray = Ray { origin: packet.origin, direction: packet.along(lane) };
            for mover in &self.movers {
                let between = (packet.nearest[lane], packet.range[lane]);
                if let Some(hit) = mover.cast(&ray, time_fs, between) {
                    packet.range[lane] = hit.range;
                    packet.leaf[lane] = NONE;
                    hits.primitive[lane] = MOVER;
                    hits.moving[lane] = Some(hit);
                }
            }
        }
    }

    /// Finds the first hit of each ray of `packet` on surfaces that stand still. The range of a ray that
    /// meets nothing stays.
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
                let hit = match (hits.primitive[lane], hits.moving[lane]) {
                    (MOVER, Some(hit)) => hit,
                    (index, _) => self.hit(index, &ray, found),
                };
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
            // If two are equally far, the lower rank wins, whichever is met first.
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

impl World {
    /// The nearest hit of a ray that leaves at `time_fs`, with a range in (`nearest`, `farthest`).
    pub(super) fn cast_at(
        &self,
        ray: &Ray,
        time_fs: i64,
        (nearest, farthest): (f64, f64),
    ) -> Option<Hit> {
        let still = self.cast_still(ray, nearest, farthest);
        self.movers.iter().fold(still, |best, mover| {
            let limit = best.map_or(farthest, |hit| hit.range);
            mover.cast(ray, time_fs, (nearest, limit)).or(best)
        })
    }

    /// As [`World::cast_at`], of what stands still.
    fn cast_still(&self, ray: &Ray, nearest: f64, farthest: f64) -> Option<Hit> {
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
        self.tree.along((ray.origin, ray.direction), (nearest, limit), |leaf| {
            meet(self.leaves[leaf as usize])
        });
        self.facets.cast(ray, nearest, farthest).or(best.map(|(_, hit)| hit))
    }
}

impl CastRays for World {
    /// At the beginning of the first scan.
    fn cast(&self, ray: &Ray, nearest: f64, farthest: f64) -> Option<Hit> {
        self.cast_at(ray, 0, (nearest, farthest))
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
    /// Hit of a ray whose primitive is [`MOVER`].
    moving: Lanes<Option<Hit>>,
    waiting: Waiting,
    inner: Waiting,
}

impl PacketHits {
    /// Returns true if the ray of a lane hits any surface.
    #[inline]
    pub(super) fn is_hit(&self, packet: &Packet, lane: usize) -> bool {
        packet.leaf[lane] != NONE || self.primitive[lane] != NONE
    }
}

/// The middle of the box around a model, in its own frame, and half its size.
type Extent = ([f64; 3], [f64; 3]);

/// The bounding box of a primitive that has bounds, relative to `centre`; those of models are
/// `extents`.
fn bounds(primitive: &Primitive, extents: &[Extent], centre: [f64; 3]) -> Bounds {
    let (low, high) = match primitive {
        Primitive::Solid(solid) => {
            let half = solid.half_extent().unwrap_or(DVec3::INFINITY);
            let middle = DVec3::from(solid.pose().position);
            (middle - half, middle + half)
        }
        Primitive::Copy { copy, .. } => {
            let (middle, half) = extents[copy.model];
            let middle = DVec3::from(copy.to_world.point(middle));
            let half = copy.to_world.rotation().abs() * DVec3::from(half);
            (middle - half, middle + half)
        }
    };
    let (low, high) = (low - DVec3::from(centre), high - DVec3::from(centre));
    let wider = WIDE + WIDER * low.abs().max(high.abs()).max_element();
    let narrow = |corner: DVec3| Vec3A::from(corner.as_vec3());
    Bounds { low: narrow(low - wider), high: narrow(high + wider) }
}

#[cfg(test)]
mod tests;

//! Meshes where they stand: each triangle laid out in the world, or a mesh that occurs more than
//! once kept once.

use std::collections::HashMap;
use std::rc::Rc;
use std::sync::Arc;

use glam::DVec3;

use super::closed_form::Solid;
use super::footing::Footing;
use super::mesh::Mesh;
use super::motion::Motion;
use super::moving::Mover;
use super::pose::{Pose, Transform};
use super::raycast::{Facet, Facets, Loose};
use super::world::{Copy, World};

/// A mesh in metres, and where it stands.
pub(super) struct Placed {
    pub mesh: Rc<Mesh>,
    /// The scene's material for each of the mesh.
    pub material_indices: Vec<u16>,
    /// Places at which it stands still.
    pub at: Vec<Transform>,
    /// Motions of its copies that move.
    pub moving: Vec<Motion>,
    pub object: u16,
}

/// The map that carries a mesh with this `footing` to `pose`; its lowest corner to the position if it
/// is to `rest`.
pub(super) fn stand(footing: &mut Footing, pose: &Pose, rest: bool) -> Transform {
    let place = pose.world_from_sensor();
    if !rest {
        return place;
    }
    place.shifted([0.0, 0.0, pose.position[2] - footing.lowest(&place)])
}

impl Placed {
    /// The triangles of the mesh, each corner carried by `place`.
    fn facets(&self, place: impl Fn([f64; 3]) -> [f64; 3]) -> impl Iterator<Item = Facet> {
        let each = self.mesh.triangles.iter().zip(&self.mesh.material_of_triangle);
        each.map(move |(triangle, material)| Facet {
            corners: triangle.map(|corner| place(self.mesh.vertices[corner as usize])),
            material: self.material_indices[usize::from(*material)],
            object: self.object,
        })
    }

    /// The mesh in its own frame, exact about its middle.
    fn model(&self) -> Facets {
        let (low, high) = self.mesh.bounds().unwrap_or_default();
        let middle = [0, 1, 2].map(|axis| (low[axis] + high[axis]) / 2.0);
        Facets::new(self.facets(|vertex| vertex).collect(), middle)
    }

    /// The distance of its farthest corner from the origin of its frame, m.
    fn reach(&self) -> f64 {
        let lengths = self.mesh.vertices.iter().map(|vertex| DVec3::from(*vertex).length());
        lengths.filter(|length| length.is_finite()).fold(0.0, f64::max)
    }

    /// Returns true if both are one model in two places.
    fn is_like(&self, other: &Self) -> bool {
        self.material_indices == other.material_indices
            && (Rc::ptr_eq(&self.mesh, &other.mesh) || self.mesh == other.mesh)
    }

    /// Returns true if the `other` is known to be like it without a look at their meshes.
    pub(super) fn shares_with(&self, other: &Self) -> bool {
        Rc::ptr_eq(&self.mesh, &other.mesh) && self.material_indices == other.material_indices
    }
}

/// Those of one model together: by the first of each, in the order of the list.
fn models(placed: &[Placed]) -> Vec<Vec<&Placed>> {
    let mut models: Vec<Vec<&Placed>> = Vec::new();
    // Meshes are compared once, and not for each place at which one stands.
    let mut known: HashMap<(*const Mesh, &[u16]), usize> = HashMap::new();
    for one in placed.iter().filter(|one| !one.at.is_empty()) {
        let key = (Rc::as_ptr(&one.mesh), &one.material_indices[..]);
        let model = *known.entry(key).or_insert_with(|| {
            let like = models.iter().position(|model| model[0].is_like(one));
            like.unwrap_or_else(|| {
                models.push(Vec::new());
                models.len() - 1
            })
        });
        models[model].push(one);
    }
    models
}

/// The world of all that is placed, exact about `centre` (the sensor).
pub(super) fn world(placed: Vec<Placed>, solids: Vec<Solid>, centre: [f64; 3]) -> World {
    let mut facets = Loose::default();
    let mut copies = Vec::new();
    let mut kept = Vec::new();
    for alike in self::models(&placed) {
        let places = || alike.iter().flat_map(|one| one.at.iter().map(move |place| (one, place)));
        if places().count() == 1 {
            places().for_each(|(one, place)| facets.extend(one.facets(|v| place.point(v))));
            continue;
        }
        let model = kept.len();
        let copy = |(one, place): (&&Placed, &Transform)| Copy {
            model,
            to_world: *place,
            object: one.object,
        };
        copies.extend(places().map(copy));
        kept.push(alike[0].model());
    }
    drop(placed);
    World::new(facets, (kept, &copies), solids, centre)
}

/// The meshes among `placed` that move, in their order; each mesh is kept once.
pub(super) fn movers(placed: &[Placed]) -> Vec<Mover> {
    let mut models: Vec<(&Placed, Arc<Facets>)> = Vec::new();
    let mut movers = Vec::new();
    for one in placed.iter().filter(|one| !one.moving.is_empty()) {
        let known = models.iter().find(|(other, _)| other.is_like(one));
        let model = match known {
            Some((_, model)) => Arc::clone(model),
            None => Arc::new(one.model()),
        };
        let reach = one.reach();
        let mover =
            |motion: &Motion| Mover::mesh((Arc::clone(&model), reach), one.object, motion.clone());
        movers.extend(one.moving.iter().map(mover));
        models.push((one, model));
    }
    movers
}

//! Meshes where they stand: each triangle laid out in the world, or a mesh that occurs more than
//! once kept once.

use std::rc::Rc;
use std::sync::Arc;

use glam::DVec3;

use super::closed_form::Solid;
use super::mesh::Mesh;
use super::motion::Motion;
use super::moving::Mover;
use super::pose::{Pose, Transform};
use super::raycast::{Facet, Facets};
use super::world::{Copy, World};

/// A mesh in metres, and where it stands.
pub(super) struct Placed {
    pub mesh: Rc<Mesh>,
    /// The scene's material for each of the mesh.
    pub material_indices: Vec<u16>,
    /// Where it stands still.
    pub at: Vec<Transform>,
    /// How it moves where it does not.
    pub moving: Vec<Motion>,
    pub object: u16,
}

/// The map that carries `mesh` to `pose`; its lowest corner to the position if it is to `rest`.
pub(super) fn stand(mesh: &Mesh, pose: &Pose, rest: bool) -> Transform {
    let place = pose.world_from_sensor();
    if !rest {
        return place;
    }
    let corners = mesh.triangles.iter().flatten();
    let heights = corners.map(|corner| place.point(mesh.vertices[*corner as usize])[2]);
    let lowest = heights.fold(f64::INFINITY, f64::min);
    place.shifted([0.0, 0.0, pose.position[2] - lowest])
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
        let facets: Vec<Facet> = self.facets(|vertex| vertex).collect();
        let (low, high) = self.mesh.bounds().unwrap_or_default();
        let middle = [0, 1, 2].map(|axis| (low[axis] + high[axis]) / 2.0);
        Facets::new(facets, middle)
    }

    /// The distance of its farthest corner from the origin of its frame, m.
    fn reach(&self) -> f64 {
        let lengths = self.mesh.vertices.iter().map(|vertex| DVec3::from(*vertex).length());
        lengths.filter(|length| length.is_finite()).fold(0.0, f64::max)
    }

    fn is_like(&self, other: &Self) -> bool {
        self.material_indices == other.material_indices
            && (Rc::ptr_eq(&self.mesh, &other.mesh) || self.mesh == other.mesh)
    }
}

/// The world of all that is placed, exact about `centre` (the sensor).
pub(super) fn world(placed: Vec<Placed>, solids: Vec<Solid>, centre: [f64; 3]) -> World {
    let mut facets = Vec::new();
    let (mut models, mut copies) = (Vec::new(), Vec::new());
    let mut seen: Vec<bool> = vec![false; placed.len()];
    for (index, one) in placed.iter().enumerate() {
        if seen[index] || one.at.is_empty() {
            continue;
        }
        let like = |other: &usize| placed[*other].is_like(one);
        let alike: Vec<usize> = (index..placed.len()).filter(like).collect();
        let total: usize = alike.iter().map(|other| placed[*other].at.len()).sum();
        alike.iter().for_each(|other| seen[*other] = true);
        if total == 1 {
            one.at.iter().for_each(|place| facets.extend(one.facets(|v| place.point(v))));
            continue;
        }
        for other in alike.iter().map(|other| &placed[*other]) {
            let copy = |to_world: &Transform| Copy {
                model: models.len(),
                to_world: *to_world,
                object: other.object,
            };
            copies.extend(other.at.iter().map(copy));
        }
        models.push(one.model());
    }
    drop(placed);
    World::new(facets, (models, &copies), solids, centre)
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
        let mover = |motion: &Motion| Mover::mesh((Arc::clone(&model), reach), one.object, *motion);
        movers.extend(one.moving.iter().map(mover));
        models.push((one, model));
    }
    movers
}

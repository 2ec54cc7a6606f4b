//! Objects that are shapes: of one part, or of several, as a person.

use super::super::closed_form::Solid;
use super::super::error::Error;
use super::super::file::{ObjectTyped, ShapeTyped};
use super::super::motion::Motion;
use super::super::moving::MovingShape;
use super::super::person::Part;
use super::super::pose::Pose;
use super::super::spanned::Spanned;
use super::Assembly;

impl Assembly<'_> {
    /// Adds the `shape` of an object at all places at which it stands or from which it moves.
    pub(super) fn add_shape(
        &mut self,
        (name, object): (&str, u16),
        (written, shape): (&ObjectTyped, &Spanned<ShapeTyped>),
        motions: &[Motion],
    ) -> Result<(), Error> {
        let parts = self.source.shape(shape)?;
        if let Some((_, first)) = written.materials.first_key_value() {
            let message = "`materials` belongs to objects with a `mesh` or `car`; give a shape one \
                           `material`";
            return Err(self.source.fault(first.span(), message));
        }
        let typed = written.material.as_ref();
        let typed = typed.map(|typed| self.material_typed(typed)).transpose()?;
        let mut materials = Vec::with_capacity(parts.len());
        for part in &parts {
            let own = part.material.and_then(|own| self.known(own));
            materials.push(match (typed, own) {
                (Some(typed), _) => typed,
                (None, Some(own)) => self.enlist(own),
                (None, None) => self.unnamed(name),
            });
        }
        for motion in motions {
            let motion = motion.placed(|pose| {
                let [x, y, z] = pose.position;
                if !written.rest_on_ground {
                    return [x, y, z];
                }
                let depth = |part: &Part| part.depth_below(pose);
                [x, y, z + parts.iter().map(depth).fold(f64::NEG_INFINITY, f64::max)]
            });
            for (part, &material) in parts.iter().zip(&materials) {
                let solid = |pose| Solid::new(part.shape, pose, material, object);
                if let Motion::Still(pose) = &motion {
                    self.solids.push(solid(part.pose(pose)));
                } else {
                    let solid = solid(Pose::at(part.at));
                    self.moving_shapes.push(MovingShape { solid, motion: motion.clone() });
                }
            }
        }
        Ok(())
    }
}

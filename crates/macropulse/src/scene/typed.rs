//! Meaning and limits of single keys of a scene file: shapes, numbers.

use std::ops::Range;

use glam::DVec3;

use super::closed_form::Shape;
use super::error::Error;
use super::file::{ObjectTyped, ShapeTyped, Source};
use super::person::{self, Part};
use super::spanned::{Spanned, Triple};

/// Coordinates and sizes are no more than this, m. It is 250 times round the Earth, so that a map may have
/// its origin anywhere. It is small enough for boxes in single precision, which multiply two sizes.
pub(super) const FARTHEST: f64 = 1e10;

/// Returns true if `length` is a coordinate or a size that something may have.
pub(super) fn is_length(length: f64) -> bool {
    length.abs() <= FARTHEST
}

impl Source<'_> {
    /// The parts of a shape about the position of its object.
    pub(super) fn shape(&self, typed: &Spanned<ShapeTyped>) -> Result<Vec<Part>, Error> {
        let fault = |message: &str| self.fault(typed.span(), message);
        let is_size = |size: f64| size > 0.0 && is_length(size);
        let sizes = format!("finite and above zero, to {FARTHEST:e} m at most");
        let positive = |value: f64, key: &str| match is_size(value) {
            true => Ok(value),
            false => Err(fault(&format!("`{key}` must be {sizes}"))),
        };
        let each = |Triple(each): Triple| match each.iter().all(|size| is_size(*size)) {
            true => Ok(each.map(|side| side / 2.0)),
            false => Err(fault(&format!("each of `size_m` must be {sizes}"))),
        };
        let shape = match *typed.get_ref() {
            ShapeTyped::Plane { normal } => match DVec3::from(normal.0).try_normalize() {
                Some(normal) => Shape::Plane { normal: normal.to_array() },
                None => return Err(fault("`normal` must be a finite direction, not zero")),
            },
            ShapeTyped::Sphere { radius_m } => {
                Shape::Sphere { radius: positive(radius_m, "radius_m")? }
            }
            ShapeTyped::Box { size_m } => Shape::Box { half: each(size_m)? },
            ShapeTyped::Cylinder { radius_m, height_m } => Shape::Frustum {
                radii: [positive(radius_m, "radius_m")?; 2],
                half: positive(height_m, "height_m")? / 2.0,
            },
            ShapeTyped::Cone { radius_m, height_m, top_radius_m } => {
                let radius = positive(radius_m, "radius_m")?;
                if !(0.0..=radius).contains(&top_radius_m) {
                    return Err(fault("`top_radius_m` must be from 0 to `radius_m`"));
                }
                let half = positive(height_m, "height_m")? / 2.0;
                Shape::Frustum { radii: [radius, top_radius_m], half }
            }
            ShapeTyped::Capsule { radius_m, height_m } => {
                let radius = positive(radius_m, "radius_m")?;
                let half = positive(height_m, "height_m")? / 2.0 - radius;
                if half < 0.0 {
                    let message = "`height_m` of a capsule must be twice its `radius_m` at least";
                    return Err(fault(message));
                }
                Shape::Capsule { radius, half }
            }
            ShapeTyped::Ellipsoid { size_m } => Shape::Ellipsoid { half: each(size_m)? },
            ShapeTyped::Person { height_m } => {
                if !person::HEIGHTS.contains(&height_m) {
                    let (least, most) = (person::HEIGHTS.start(), person::HEIGHTS.end());
                    return Err(fault(&format!("`height_m` must be from {least} to {most}")));
                }
                return Ok(person::parts(height_m));
            }
        };
        Ok(vec![Part { shape, at: [0.0; 3], material: None }])
    }

    /// Keys that mean something only for the mesh of a file.
    pub(super) fn refuse_mesh_keys(&self, written: &ObjectTyped) -> Result<(), Error> {
        let spans: [(Option<Range<usize>>, &str); 4] = [
            (written.unit.as_ref().map(|typed| typed.span()), "unit"),
            (written.scale.as_ref().map(|typed| typed.span()), "scale"),
            (written.up.as_ref().map(|typed| typed.span()), "up"),
            (written.forward.as_ref().map(|typed| typed.span()), "forward"),
        ];
        for (span, key) in spans {
            if let Some(span) = span {
                let message = format!("`{key}` belongs to objects with a `mesh`; remove it here");
                return Err(self.fault(span, message));
            }
        }
        Ok(())
    }

    /// A number that is one.
    pub(super) fn finite(&self, typed: &Spanned<f64>, key: &str) -> Result<f64, Error> {
        let value = *typed.get_ref();
        match value.is_finite() {
            true => Ok(value),
            false => Err(self.fault(typed.span(), format!("{key} must be a finite number"))),
        }
    }

    /// A coordinate.
    pub(super) fn coordinate(&self, typed: &Spanned<f64>, key: &str) -> Result<f64, Error> {
        let value = *typed.get_ref();
        match is_length(value) {
            true => Ok(value),
            false => {
                let message = format!("{key} must be a finite number, to {FARTHEST:e} at most");
                Err(self.fault(typed.span(), message))
            }
        }
    }

    /// A number above zero.
    pub(super) fn positive(&self, typed: &Spanned<f64>, key: &str) -> Result<f64, Error> {
        let value = self.finite(typed, key)?;
        match value > 0.0 {
            true => Ok(value),
            false => {
                let message = format!("{key} is {value}; it must be above zero");
                Err(self.fault(typed.span(), message))
            }
        }
    }
}

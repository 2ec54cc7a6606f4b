//! The hierarchy of boxes that rays descend.

use glam::{DVec3, Vec3A};

use super::wide::{Registers, SIDE, Wide};

/// An upright box.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bounds {
    pub low: Vec3A,
    pub high: Vec3A,
}

/// Eight boxes side by side, and what is in them.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(32))]
pub(super) struct Eight {
    /// By axis, then low before high, then by box.
    pub bounds: [[[f32; SIDE]; 2]; 3],
    pub child: [Child; SIDE],
}

/// Contents of a box: eight others, or a leaf.
#[derive(Debug, Clone, Copy)]
pub(super) struct Child(u32);

/// A hierarchy of boxes about a centre; its root is node 0.
#[derive(Debug, Clone, Default)]
pub(crate) struct Tree {
    /// Added to the local frame of the boxes, gives that of the rays.
    centre: [f64; 3],
    /// Around all, by axis.
    pub(super) bounds: [[f32; 2]; 3],
    /// No local coordinate is larger.
    reach: f32,
    pub(super) eights: Vec<Eight>,
    /// Boxes that can wait at once during a descent.
    pub(super) room: usize,
}

/// Coordinates beyond this, in metres, would overflow in the products of an `f32` test.
pub(super) const FARTHEST: f64 = 1e15;

/// Boxes end this much farther away than computed: it covers the rounding of (b−o)·d⁻¹ and of the
/// shear.
pub(super) const SLACK: f32 = 1.0 + 16.0 * f32::EPSILON;

impl Bounds {
    /// No line enters it.
    pub(super) const NOWHERE: Self = Self { low: Vec3A::INFINITY, high: Vec3A::NEG_INFINITY };

    /// Around both.
    #[inline(always)]
    pub(super) fn joined(&self, other: &Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    /// Around it and `place`.
    #[inline(always)]
    pub(super) fn holding(&self, place: Vec3A) -> Self {
        Self { low: self.low.min(place), high: self.high.max(place) }
    }

    /// Half of the surface, m².
    #[inline(always)]
    pub(super) fn half_area(&self) -> f32 {
        let [x, y, z] = (self.high - self.low).to_array();
        x * y + y * z + z * x
    }
}

impl Child {
    const LEAF: u32 = 1 << 31;

    pub(super) fn eight(index: usize) -> Self {
        Self(index as u32)
    }

    pub(super) fn leaf(index: usize) -> Self {
        Self(index as u32 | Self::LEAF)
    }

    pub(super) fn of(bits: u32) -> Self {
        Self(bits)
    }

    pub(super) fn bits(self) -> u32 {
        self.0
    }

    /// Which leaf, or else which node.
    #[inline(always)]
    pub(super) fn index(self) -> Result<u32, usize> {
        if self.0 & Self::LEAF == 0 { Err(self.0 as usize) } else { Ok(self.0 & !Self::LEAF) }
    }
}

impl Eight {
    /// Boxes that no line enters.
    pub(super) const EMPTY: Self = Self {
        bounds: [[[f32::INFINITY; SIDE], [f32::NEG_INFINITY; SIDE]]; 3],
        child: [Child(0); SIDE],
    };

    /// The low and the high planes of the boxes, by axis.
    #[inline(always)]
    pub(super) fn planes<R: Registers>(&self) -> [[R::Boxes; 2]; 3] {
        let [x, y, z] = &self.bounds;
        [
            [R::Boxes::load(&x[0]), R::Boxes::load(&x[1])],
            [R::Boxes::load(&y[0]), R::Boxes::load(&y[1])],
            [R::Boxes::load(&z[0]), R::Boxes::load(&z[1])],
        ]
    }

    pub(super) fn set(&mut self, slot: usize, bounds: &Bounds, child: Child) {
        for axis in 0..3 {
            self.bounds[axis][0][slot] = bounds.low[axis];
            self.bounds[axis][1][slot] = bounds.high[axis];
        }
        self.child[slot] = child;
    }
}

impl Tree {
    /// The hierarchy of `eights`, `depth` one below the other, about `centre`; `bounds` is around
    /// all.
    pub(super) fn new(centre: [f64; 3], bounds: Bounds, eights: Vec<Eight>, depth: usize) -> Self {
        let reach = bounds.low.abs().max(bounds.high.abs()).max_element();
        let bounds = [0, 1, 2].map(|axis| [bounds.low[axis], bounds.high[axis]]);
        // All boxes but one of each node on the way down wait, and all of the last node.
        Self { centre, bounds, reach, eights, room: (SIDE - 1) * depth + 1 }
    }

    /// A place in the local frame; `None` if it is too far away to be exact about anything, or if
    /// there is nothing to meet.
    #[inline(always)]
    pub(super) fn local(&self, place: [f64; 3]) -> Option<[f32; 3]> {
        let local = DVec3::from(place) - DVec3::from(self.centre);
        let near = local.abs().max_element() < FARTHEST;
        (near && !self.eights.is_empty()).then(|| local.as_vec3().to_array())
    }

    /// Returns the length by which a limit in `f64` must be stretched so that no box before it is passed
    /// over: the rounding of the coordinates to `f32`.
    #[inline(always)]
    pub(super) fn margin(&self, origin: [f32; 3]) -> f32 {
        let [x, y, z] = origin;
        16.0 * f32::EPSILON * (self.reach + x.abs().max(y.abs()).max(z.abs()))
    }
}

/// `farthest` as an `f32` that no box of a nearer hit begins behind.
#[inline(always)]
pub(super) fn narrow_above(farthest: f64, margin: f32) -> f32 {
    farthest as f32 * SLACK + margin
}

/// `nearest` as an `f32`, at least zero, that no box of a farther hit ends before.
#[inline(always)]
pub(super) fn narrow_below(nearest: f64, margin: f32) -> f32 {
    let below = nearest as f32 / SLACK - margin;
    if below > 0.0 { below } else { 0.0 }
}

/// The axis along which a direction is longest, the first of equals; `None` if it is no direction:
/// NaN, infinite, or without length.
#[inline(always)]
pub(super) fn main_axis([x, y, z]: [f32; 3]) -> Option<usize> {
    let (x, y, z) = (x.abs(), y.abs(), z.abs());
    let longest = if (x >= y) & (x >= z) { 0 } else { 1 + usize::from(z > y) };
    let finite = (x < f32::INFINITY) & (y < f32::INFINITY) & (z < f32::INFINITY);
    (finite & ((x > 0.0) | (y > 0.0) | (z > 0.0))).then_some(longest)
}

/// The two axes after `along`, and itself.
#[inline(always)]
pub(super) fn across(along: usize) -> [usize; 3] {
    match along {
        0 => [1, 2, 0],
        1 => [2, 0, 1],
        _ => [0, 1, 2],
    }
}

/// 1/`slope`; of a slope of nearly zero a large number, for infinity would make 0·∞ of a box that
/// touches the ray.
#[inline(always)]
pub(super) fn inverse(slope: f32) -> f32 {
    let steep = slope.abs();
    (1.0 / if steep > 1e-20 { steep } else { 1e-20 }).copysign(slope)
}

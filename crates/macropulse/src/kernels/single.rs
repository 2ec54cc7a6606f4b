//! One ray down a hierarchy: eight boxes at once, then eight triangles at once.

use super::tree::{
    Child, Eight, SLACK, Tree, across, inverse, main_axis, narrow_above, narrow_below,
};
use super::wide::{Registers, SIDE, Task, Wide, fetch, on_level};

/// Deep enough for the hierarchies of most meshes; the others get a stack on the heap.
const STACK: usize = 64;

/// A ray as boxes and triangles need it: local, narrow, and sheared along the main axis.
///
/// From the centre of the hierarchy, nothing has to be subtracted from anything.
#[derive(Debug, Clone, Copy)]
pub(super) struct Aim<const FROM_CENTRE: bool> {
    origin: [f32; 3],
    /// Nothing before it matters.
    start: f32,
    margin: f32,
    /// 1/d by axis.
    inverse: [f32; 3],
    /// Which bound of a box is near, by axis.
    backward: [usize; 3],
    /// Axes across (two) and along the ray.
    pub axes: [usize; 3],
    /// Shear of the two axes across.
    pub shear: [f32; 2],
}

/// The leaves of a hierarchy, for a ray that comes by.
pub(super) trait RayLeaves {
    /// Notes that a leaf may soon be met.
    #[inline(always)]
    fn fetch(&self, _leaf: u32) {}

    /// Lets the ray meet a leaf; the distance behind which nothing matters any more.
    fn meet<R: Registers, const FROM_CENTRE: bool>(
        &mut self,
        leaf: u32,
        aim: &Aim<FROM_CENTRE>,
    ) -> f64;
}

impl Tree {
    /// Calls `visit` with the leaves whose boxes a ray enters behind `nearest` and before
    /// `farthest`, roughly the nearest first. It gives the distance behind which nothing matters
    /// any more.
    #[inline]
    pub(crate) fn along(
        &self,
        ray: ([f64; 3], [f64; 3]),
        between: (f64, f64),
        visit: impl FnMut(u32) -> f64,
    ) {
        on_level(Along { tree: self, ray, between, leaves: &mut Visit(visit) });
    }
}

/// Leaves that are met by a call.
struct Visit<V>(V);

impl<V: FnMut(u32) -> f64> RayLeaves for Visit<V> {
    #[inline(always)]
    fn meet<R: Registers, const FROM_CENTRE: bool>(
        &mut self,
        leaf: u32,
        _: &Aim<FROM_CENTRE>,
    ) -> f64 {
        (self.0)(leaf)
    }
}

/// A ray that is to descend a hierarchy.
pub(super) struct Along<'a, L> {
    pub tree: &'a Tree,
    /// Origin and direction.
    pub ray: ([f64; 3], [f64; 3]),
    /// The limits of its range.
    pub between: (f64, f64),
    pub leaves: &'a mut L,
}

impl<L: RayLeaves> Task for Along<'_, L> {
    #[inline(always)]
    fn run<R: Registers>(&mut self) {
        let Some(origin) = self.tree.local(self.ray.0) else { return };
        if origin == [0.0; 3] {
            self.aim::<R, true>(origin);
        } else {
            self.aim::<R, false>(origin);
        }
    }
}

impl<L: RayLeaves> Along<'_, L> {
    #[inline(always)]
    fn aim<R: Registers, const FROM_CENTRE: bool>(&mut self, origin: [f32; 3]) {
        let margin = self.tree.margin(origin);
        let start = narrow_below(self.between.0, margin);
        let Some(aim) = Aim::<FROM_CENTRE>::of(origin, self.ray.1, (start, margin)) else { return };
        if self.tree.room <= STACK {
            self.descend::<R, FROM_CENTRE>(&aim, &mut [PutOff::default(); STACK]);
        } else {
            self.descend::<R, FROM_CENTRE>(&aim, &mut vec![PutOff::default(); self.tree.room]);
        }
    }

    /// Walks the hierarchy, the nearest box first. `stack` holds the boxes put off, and where they
    /// are entered.
    #[inline(always)]
    fn descend<R: Registers, const FROM_CENTRE: bool>(
        &mut self,
        aim: &Aim<FROM_CENTRE>,
        stack: &mut [PutOff],
    ) {
        let eights = &self.tree.eights[..];
        let mut limit = narrow_above(self.between.1, aim.margin);
        let (mut child, mut waiting) = (Child::eight(0), 0);
        loop {
            match child.index() {
                Err(index) => {
                    let eight = &eights[index];
                    let (entered, enters) = eight.entered::<R, FROM_CENTRE>(aim, limit);
                    if entered.is_power_of_two() {
                        child = eight.child[entered.trailing_zeros() as usize % SIDE];
                        continue;
                    }
                    waiting = put_off(stack, waiting, (entered, &enters), |slot| {
                        match eight.child[slot].index() {
                            Err(index) => fetch(eights, index),
                            Ok(leaf) => self.leaves.fetch(leaf),
                        }
                        eight.child[slot].bits()
                    });
                }
                Ok(leaf) => {
                    limit = narrow_above(self.leaves.meet::<R, FROM_CENTRE>(leaf, aim), aim.margin);
                }
            }
            // Boxes that were put off may by now lie behind the nearest hit.
            child = loop {
                if waiting == 0 {
                    return;
                }
                waiting -= 1;
                let (enter, child) = stack[waiting].parts();
                if enter <= limit {
                    break Child::of(child);
                }
            };
        }
    }
}

/// A box that waits during a descent. The upper half is the distance at which it is entered, not below zero,
/// as bits, whose order is that of the numbers. The lower half says which box it is.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct PutOff(u64);

impl PutOff {
    #[inline(always)]
    fn new(enter: f32, what: u32) -> Self {
        Self(u64::from(enter.to_bits()) << 32 | u64::from(what))
    }

    /// Returns the distance at which it is entered, and which it is.
    #[inline(always)]
    pub(super) fn parts(self) -> (f32, u32) {
        (f32::from_bits((self.0 >> 32) as u32), self.0 as u32)
    }
}

/// Adds boxes to those that wait, the nearest last; how many wait then.
#[inline(always)]
pub(super) fn put_off(
    stack: &mut [PutOff],
    waiting: usize,
    (mut entered, enters): (u32, &[f32; SIDE]),
    what: impl Fn(usize) -> u32,
) -> usize {
    let mut end = waiting;
    while entered != 0 {
        let slot = entered.trailing_zeros() as usize % SIDE;
        entered &= entered - 1;
        let put = PutOff::new(enters[slot], what(slot));
        let mut place = end;
        while place > waiting && stack[place - 1] < put {
            stack[place] = stack[place - 1];
            place -= 1;
        }
        stack[place] = put;
        end += 1;
    }
    end
}

impl Eight {
    /// Returns the distances at which a ray crosses the low or the high planes of an axis.
    #[inline(always)]
    fn reached<R: Registers, const FROM_CENTRE: bool>(
        &self,
        aim: &Aim<FROM_CENTRE>,
        axis: usize,
        bound: usize,
    ) -> R::Boxes {
        let planes = R::Boxes::load(&self.bounds[axis][bound & 1]);
        aim.shifted(axis, planes).times(R::Boxes::splat(aim.inverse[axis]))
    }

    /// The boxes that a ray enters before `limit`, and where.
    #[inline(always)]
    fn entered<R: Registers, const FROM_CENTRE: bool>(
        &self,
        aim: &Aim<FROM_CENTRE>,
        limit: f32,
    ) -> (u32, [f32; SIDE]) {
        let [x, y, z] = aim.backward;
        let start = R::Boxes::splat(aim.start);
        let enter = self
            .reached::<R, FROM_CENTRE>(aim, 0, x)
            .most(self.reached::<R, FROM_CENTRE>(aim, 1, y));
        let enter = enter.most(self.reached::<R, FROM_CENTRE>(aim, 2, z).most(start));
        let leave = self
            .reached::<R, FROM_CENTRE>(aim, 0, 1 - x)
            .least(self.reached::<R, FROM_CENTRE>(aim, 1, 1 - y));
        let leave = leave.least(self.reached::<R, FROM_CENTRE>(aim, 2, 1 - z));
        let leave = leave.times(R::Boxes::splat(SLACK)).least(R::Boxes::splat(limit));
        let mut enters = [0.0; SIDE];
        enter.store(&mut enters);
        (enter.at_most(leave), enters)
    }
}

impl<const FROM_CENTRE: bool> Aim<FROM_CENTRE> {
    /// `None` if the ray is not a ray: NaN, infinite, or without direction.
    #[inline(always)]
    fn of(origin: [f32; 3], direction: [f64; 3], (start, margin): (f32, f32)) -> Option<Self> {
        let direction = direction.map(|slope| slope as f32);
        let axes = across(main_axis(direction)?);
        let [u, v, along] = axes;
        Some(Self {
            origin,
            start,
            margin,
            inverse: direction.map(inverse),
            backward: direction.map(|slope| usize::from(slope.is_sign_negative())),
            axes,
            shear: [direction[u] / direction[along], direction[v] / direction[along]],
        })
    }

    /// Coordinates on an axis, from the start of the ray.
    #[inline(always)]
    pub fn shifted<W: Wide<SIDE>>(&self, axis: usize, coordinates: W) -> W {
        if FROM_CENTRE { coordinates } else { coordinates.minus(W::splat(self.origin[axis])) }
    }
}

//! The hierarchy of boxes that rays descend.

use glam::{DVec3, Vec4};
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::{Boundable, BvhBuildParams};

/// Two boxes side by side, in one line of the cache, and what is in them.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub(super) struct Pair {
    /// By axis, then low before high, then by box.
    pub bounds: [[[f32; 2]; 2]; 3],
    pub child: [Node; 2],
}

/// What is in a box: another pair, or leaves.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Node {
    /// Index of the pair, or of the first leaf.
    pub first: u32,
    /// Number of leaves; 0 for a pair.
    pub count: u32,
}

/// A binary hierarchy of boxes about a centre; its root is pair 0.
#[derive(Debug, Clone, Default)]
pub(crate) struct Tree {
    /// Added to the local frame of the boxes, gives that of the rays.
    centre: [f64; 3],
    /// No local coordinate is larger.
    reach: f32,
    pub(super) pairs: Vec<Pair>,
    /// Nodes that can wait at once during a descent.
    pub(super) depth: usize,
}

/// Coordinates beyond this, in metres, would overflow in the products of an `f32` test.
pub(super) const FARTHEST: f64 = 1e15;

/// Deep enough for any hierarchy the builder makes of real meshes; deeper ones get a heap stack.
const STACK: usize = 64;

/// Boxes end this much farther away than computed: it covers the rounding of (b−o)·d⁻¹ and of the
/// shear.
pub(super) const SLACK: f32 = 1.0 + 16.0 * f32::EPSILON;

/// No line enters it.
const NOWHERE: [[[f32; 2]; 2]; 3] = [[[f32::INFINITY; 2], [f32::NEG_INFINITY; 2]]; 3];

impl Tree {
    /// A hierarchy over `items`, whose coordinates count from `centre`, and its leaves in the
    /// order of a descent: the index that each had. Without items, no ray enters it.
    pub(crate) fn over<T: Boundable>(items: &[T], centre: [f64; 3]) -> (Self, Vec<u32>) {
        if items.is_empty() {
            return (Self { centre, ..Self::default() }, vec![]);
        }
        let plan = BvhBuildParams { pre_split: false, ..BvhBuildParams::medium_build() };
        Self::new(&build_bvh2(items, plan, &mut Default::default()), centre)
    }

    /// A place in the local frame; `None` if it is too far away to be exact about anything.
    pub(super) fn local(&self, place: [f64; 3]) -> Option<[f32; 3]> {
        let local = DVec3::from(place) - DVec3::from(self.centre);
        (local.abs().max_element() < FARTHEST).then(|| local.as_vec3().to_array())
    }

    /// What a limit in `f64` must be stretched by so that no box before it is passed over: the
    /// rounding of the coordinates to `f32`.
    #[inline(always)]
    pub(super) fn margin(&self, origin: [f32; 3]) -> f32 {
        let [x, y, z] = origin;
        16.0 * f32::EPSILON * (self.reach + x.abs().max(y.abs()).max(z.abs()))
    }

    /// Calls `visit` with the leaves whose boxes a ray enters behind `nearest` and before
    /// `farthest`, roughly the nearest first. It gives the distance behind which nothing matters any more.
    #[inline(always)]
    pub(crate) fn along(
        &self,
        (origin, direction): ([f64; 3], [f64; 3]),
        (nearest, farthest): (f64, f64),
        mut visit: impl FnMut(u32, &Aim) -> f64,
    ) {
        let Some(origin) = self.local(origin) else { return };
        let [x, y, z] = direction;
        let Some(mut aim) = Aim::new(origin, [x as f32, y as f32, z as f32]) else { return };
        aim.start = narrow_below(nearest, self.margin(origin));
        if self.pairs.is_empty() {
            return;
        }
        let nothing = Node::default();
        if self.depth + 1 < STACK {
            let stack = (&mut [0.0; STACK][..], &mut [nothing; STACK][..]);
            self.descend(&aim, farthest, stack, &mut visit);
        } else {
            let room = self.depth + 2;
            let stack = (&mut vec![0.0; room][..], &mut vec![nothing; room][..]);
            self.descend(&aim, farthest, stack, &mut visit);
        }
    }

    /// Walks the hierarchy, the nearer child first. The
    /// two slices hold the children put off, and where they are entered.
    #[inline(always)]
    fn descend(
        &self,
        aim: &Aim,
        farthest: f64,
        (enters, nodes): (&mut [f32], &mut [Node]),
        visit: &mut impl FnMut(u32, &Aim) -> f64,
    ) {
        let margin = self.margin(aim.origin);
        let mut limit = narrow_above(farthest, margin);
        let mut waiting = 0;
        let mut node = Node::default();
        loop {
            if node.count == 0 {
                let pair = &self.pairs[node.first as usize];
                let [left, right] = pair.enters(aim, limit);
                let swap = usize::from(right < left);
                let [near, far] = [pair.child[swap], pair.child[1 - swap]];
                let (first, second) = if right < left { (right, left) } else { (left, right) };
                // Written always and kept only if both are entered: no branch to mispredict.
                (enters[waiting], nodes[waiting]) = (second, far);
                waiting += usize::from(second < f32::INFINITY);
                if first < f32::INFINITY {
                    node = near;
                    continue;
                }
            } else {
                for leaf in node.first..node.first + node.count {
                    limit = narrow_above(visit(leaf, aim), margin);
                }
            }
            // What was put off may by now lie behind the nearest hit.
            node = loop {
                if waiting == 0 {
                    return;
                }
                waiting -= 1;
                if enters[waiting] <= limit {
                    break nodes[waiting];
                }
            };
        }
    }

    /// The hierarchy that was built, and its leaves in the order of a descent: the index that
    /// each had for the builder.
    fn new(built: &Bvh2, centre: [f64; 3]) -> (Self, Vec<u32>) {
        let mut order = Vec::with_capacity(built.primitive_indices.len());
        let mut tree = Self { centre, ..Self::default() };
        let Some(root) = built.nodes.first().copied() else { return (tree, order) };
        let extent = root.aabb.min.abs().max(root.aabb.max.abs());
        tree.reach = extent.max_element();
        let mut take = |first: u32, count: u32| {
            let range = first as usize..(first + count) as usize;
            let begins = order.len() as u32;
            order.extend_from_slice(&built.primitive_indices[range]);
            Node { first: begins, count }
        };
        if root.is_leaf() {
            let mut pair = Pair { bounds: NOWHERE, child: [Node::default(); 2] };
            pair.set(0, &root.aabb, take(root.first_index, root.prim_count));
            (tree.pairs, tree.depth) = (vec![pair], 1);
            return (tree, order);
        }
        // Pairs that are still to be made: the first of two nodes, whose child it will be, and
        // how deep it is.
        let mut open = vec![(root.first_index, None, 1)];
        while let Some((first, parent, depth)) = open.pop() {
            let index = tree.pairs.len() as u32;
            if let Some((parent, side)) = parent {
                let parent: &mut Pair = &mut tree.pairs[parent as usize];
                parent.child[side] = Node { first: index, count: 0 };
            }
            let mut pair = Pair { bounds: NOWHERE, child: [Node::default(); 2] };
            for side in 0..2 {
                let node = &built.nodes[first as usize + side];
                let child = match node.is_leaf() {
                    true => take(node.first_index, node.prim_count),
                    false => Node::default(),
                };
                pair.set(side, &node.aabb, child);
                if !node.is_leaf() {
                    open.push((node.first_index, Some((index, side)), depth + 1));
                }
            }
            tree.pairs.push(pair);
            tree.depth = tree.depth.max(depth);
        }
        (tree, order)
    }
}

impl Pair {
    fn set(&mut self, side: usize, bounds: &obvhs::aabb::Aabb, child: Node) {
        for axis in 0..3 {
            self.bounds[axis][0][side] = bounds.min[axis];
            self.bounds[axis][1][side] = bounds.max[axis];
        }
        self.child[side] = child;
    }

    /// Where a ray enters each of the two boxes; infinity if it does not do so before `limit`.
    #[inline(always)]
    pub(super) fn enters(&self, aim: &Aim, limit: f32) -> [f32; 2] {
        let slab = |axis: usize| {
            let [low, high] = self.bounds[axis];
            let (near, far) = if aim.backward[axis] { (high, low) } else { (low, high) };
            let planes = Vec4::new(near[0], near[1], far[0], far[1]);
            // The far planes change their sign, so that one maximum serves both.
            (planes - Vec4::splat(aim.origin[axis])) * aim.inverse[axis]
        };
        let [left, right, leave_left, leave_right] = slab(0).max(slab(1)).max(slab(2)).to_array();
        let enters = |enter: f32, leave: f32| {
            let enter = if enter > aim.start { enter } else { aim.start };
            let reach = SLACK * -leave;
            if enter <= reach && enter <= limit { enter } else { f32::INFINITY }
        };
        [enters(left, leave_left), enters(right, leave_right)]
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

/// The directions of a ray as boxes and triangles need them: local, narrow, and sheared along the
/// main axis.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Aim {
    pub origin: [f32; 3],
    /// Nothing before it matters.
    start: f32,
    /// 1/d by axis, twice for the near planes and twice with the other sign for the far ones.
    pub inverse: [Vec4; 3],
    pub backward: [bool; 3],
    /// Axes across (two) and along the ray.
    pub axes: [usize; 3],
    /// Shear of the two axes across.
    pub shear: [f32; 2],
}

impl Aim {
    /// `None` if the ray is not a ray: NaN, infinite, or without direction.
    #[inline(always)]
    fn new(origin: [f32; 3], direction: [f32; 3]) -> Option<Self> {
        let along = main_axis(direction);
        if along == 3 {
            return None;
        }
        let axes = across(along);
        let [u, v, along] = axes;
        let [x, y, z] = direction;
        let inverse = |slope: f32| {
            let inverse = inverse(slope);
            Vec4::new(inverse, inverse, -inverse, -inverse)
        };
        Some(Self {
            origin,
            start: 0.0,
            inverse: [inverse(x), inverse(y), inverse(z)],
            backward: [x.is_sign_negative(), y.is_sign_negative(), z.is_sign_negative()],
            axes,
            shear: [direction[u] / direction[along], direction[v] / direction[along]],
        })
    }
}

/// The axis along which a direction is longest, the first of equals; 3 if it is none.
#[inline(always)]
pub(super) fn main_axis([x, y, z]: [f32; 3]) -> u32 {
    let (x, y, z) = (x.abs(), y.abs(), z.abs());
    let longest = if (x >= y) & (x >= z) { 0 } else { 1 + u32::from(z > y) };
    let finite = (x < f32::INFINITY) & (y < f32::INFINITY) & (z < f32::INFINITY);
    if finite & ((x > 0.0) | (y > 0.0) | (z > 0.0)) { longest } else { 3 }
}

/// The two axes after `along`, and itself.
#[inline(always)]
pub(super) fn across(along: u32) -> [usize; 3] {
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

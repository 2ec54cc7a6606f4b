//! Builds a hierarchy of boxes from the top.
//!
//! A range of items is cut in two where the surface area heuristic expects the fewest tests: a line
//! that enters a box enters one within it with the ratio of their surfaces \[Wal07\]. The cut is
//! looked for at a few places of each axis. A node is a range after up to seven cuts, the largest
//! part cut first.

use std::ops::Range;

use glam::Vec3A;

use super::tree::{Bounds, Child, Eight, Tree};
use super::wide::SIDE;

/// Places of an axis at which a range may be cut, and one more.
const BINS: usize = 16;

/// Cuts above a range before it is only halved. Boxes that all overlap, as of a fan or of triangles
/// that coincide, may be cut one by one: this bounds the time and the depth. Real meshes stay below
/// half of it.
const CUTS: u32 = 48;

/// What a hierarchy is built over.
#[derive(Clone, Copy)]
struct Item {
    low: [f32; 3],
    index: u32,
    high: [f32; 3],
}

impl Item {
    fn bounds(&self) -> Bounds {
        Bounds { low: Vec3A::from_array(self.low), high: Vec3A::from_array(self.high) }
    }

    /// Twice the middle of its box.
    fn middle(&self) -> Vec3A {
        Vec3A::from_array(self.low) + Vec3A::from_array(self.high)
    }
}

/// Items that are to be put together, and the box of all.
#[derive(Clone)]
struct Part {
    items: Range<usize>,
    bounds: Bounds,
    /// Cuts that made it.
    cuts: u32,
}

/// A hierarchy with its leaves.
pub(crate) struct Built {
    pub tree: Tree,
    /// The index that each item had, by leaf.
    pub order: Vec<u32>,
    /// Where in that order each leaf ends.
    pub ends: Vec<u32>,
}

struct Builder {
    items: Vec<Item>,
    /// Items of a leaf, at most.
    most: usize,
    eights: Vec<Eight>,
    ends: Vec<u32>,
    depth: usize,
}

impl Built {
    /// A hierarchy over items with the boxes `bounds`, whose coordinates count from `centre`, with
    /// up to `most` in a leaf. Without items, no ray enters it.
    pub(crate) fn over(
        bounds: impl Iterator<Item = Bounds>,
        most: usize,
        centre: [f64; 3],
    ) -> Self {
        let mut all = Bounds::NOWHERE;
        let item = |(index, bounds): (u32, Bounds)| {
            all = all.joined(&bounds);
            Item { low: bounds.low.to_array(), index, high: bounds.high.to_array() }
        };
        let items: Vec<Item> = (0..).zip(bounds).map(item).collect();
        let mut builder = Builder { items, most, eights: Vec::new(), ends: Vec::new(), depth: 0 };
        if !builder.items.is_empty() {
            let items = 0..builder.items.len();
            builder.node(Part { items, bounds: all, cuts: 0 }, 1);
        }
        let Builder { items, eights, ends, depth, .. } = builder;
        let order = items.iter().map(|item| item.index).collect();
        Self { tree: Tree::new(centre, all, eights, depth), order, ends }
    }
}

impl Builder {
    /// Makes the node of a part, and all below it.
    fn node(&mut self, part: Part, depth: usize) -> Child {
        let index = self.eights.len();
        self.eights.push(Eight::EMPTY);
        self.depth = self.depth.max(depth);
        let mut parts = vec![part];
        while parts.len() < SIDE {
            let too_many = |part: &&mut Part| part.items.len() > self.most;
            let area = |part: &&mut Part| part.bounds.half_area();
            let largest =
                parts.iter_mut().filter(too_many).max_by(|a, b| area(a).total_cmp(&area(b)));
            let Some(largest) = largest else { break };
            let (left, right) = self.cut(largest);
            *largest = left;
            parts.push(right);
        }
        parts.sort_unstable_by_key(|part| part.items.start);
        for (slot, part) in parts.into_iter().enumerate() {
            let bounds = part.bounds;
            let child = if part.items.len() <= self.most {
                self.ends.push(part.items.end as u32);
                Child::leaf(self.ends.len() - 1)
            } else {
                self.node(part, depth + 1)
            };
            self.eights[index].set(slot, &bounds, child);
        }
        Child::eight(index)
    }

    /// Cuts a part of two items or more in two.
    fn cut(&mut self, part: &Part) -> (Part, Part) {
        let items = &mut self.items[part.items.clone()];
        let (mut low, mut high) = (Vec3A::INFINITY, Vec3A::NEG_INFINITY);
        for item in &*items {
            let middle = item.middle();
            (low, high) = (low.min(middle), high.max(middle));
        }
        let extent = high - low;
        let (count, [left, right]) = if extent.max_element() > 0.0 && part.cuts < CUTS {
            Bins::of(items, low, extent).cut(items, self.most)
        } else {
            halve(items, extent)
        };
        let (start, end, cuts) = (part.items.start, part.items.end, part.cuts + 1);
        (
            Part { items: start..start + count, bounds: left, cuts },
            Part { items: start + count..end, bounds: right, cuts },
        )
    }
}

/// Half of the items on either side of the longest axis.
fn halve(items: &mut [Item], extent: Vec3A) -> (usize, [Bounds; 2]) {
    let axis = extent.max_position();
    let half = items.len() / 2;
    items.select_nth_unstable_by(half, |a, b| {
        let along = a.middle()[axis].total_cmp(&b.middle()[axis]);
        along.then(a.index.cmp(&b.index))
    });
    let bounds = |items: &[Item]| {
        items.iter().fold(Bounds::NOWHERE, |bounds, item| bounds.joined(&item.bounds()))
    };
    (half, [bounds(&items[..half]), bounds(&items[half..])])
}

/// The items of a part by the place of their middles, on each axis.
struct Bins {
    low: Vec3A,
    /// Bins per length.
    scale: Vec3A,
    bounds: [[Bounds; BINS]; 3],
    counts: [[u32; BINS]; 3],
}

impl Bins {
    fn of(items: &[Item], low: Vec3A, extent: Vec3A) -> Self {
        let scale = BINS as f32 * (1.0 - f32::EPSILON) / extent;
        let mut bins =
            Self { low, scale, bounds: [[Bounds::NOWHERE; BINS]; 3], counts: [[0; BINS]; 3] };
        for item in items {
            let bounds = item.bounds();
            let place = bins.place(item);
            for axis in 0..3 {
                let bin = &mut bins.bounds[axis][place[axis]];
                *bin = bin.joined(&bounds);
                bins.counts[axis][place[axis]] += 1;
            }
        }
        bins
    }

    /// The bin of an item on each axis.
    #[inline(always)]
    fn place(&self, item: &Item) -> [usize; 3] {
        let place = (item.middle() - self.low) * self.scale;
        // What is no number, on an axis without extent, becomes zero.
        place.to_array().map(|place| (place as i32 as usize).min(BINS - 1))
    }

    /// Moves the items on the near side of the best cut to the front; how many they are, and the
    /// box of either side.
    fn cut(&self, items: &mut [Item], most: usize) -> (usize, [Bounds; 2]) {
        let mut best = (f32::INFINITY, 0, 1, [Bounds::NOWHERE; 2]);
        for axis in 0..3 {
            let (bounds, counts) = (&self.bounds[axis], &self.counts[axis]);
            let tests = |count: u32| count.div_ceil(most as u32) as f32;
            let mut behind = [(Bounds::NOWHERE, 0); BINS];
            let (mut right, mut count) = (Bounds::NOWHERE, 0);
            for bin in (1..BINS).rev() {
                (right, count) = (right.joined(&bounds[bin]), count + counts[bin]);
                behind[bin] = (right, count);
            }
            let (mut left, mut count) = (Bounds::NOWHERE, 0);
            for bin in 1..BINS {
                (left, count) = (left.joined(&bounds[bin - 1]), count + counts[bin - 1]);
                let (right, rest) = behind[bin];
                if count == 0 || rest == 0 {
                    continue;
                }
                let cost = left.half_area() * tests(count) + right.half_area() * tests(rest);
                if cost < best.0 {
                    best = (cost, axis, bin, [left, right]);
                }
            }
        }
        let (_, axis, bin, bounds) = best;
        let mut count = 0;
        for index in 0..items.len() {
            if self.place(&items[index])[axis] < bin {
                items.swap(index, count);
                count += 1;
            }
        }
        (count, bounds)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// Boxes with whole coordinates, of which many coincide where `cells` is small.
    fn boxes(seed: u64, count: usize, cells: i32) -> Vec<Bounds> {
        let mut chance = ChaCha8Rng::seed_from_u64(seed);
        let mut corner = || Vec3A::from([0; 3].map(|_| chance.random_range(0..cells) as f32));
        let mut one = || {
            let (a, b) = (corner(), corner());
            Bounds { low: a.min(b), high: a.max(b) }
        };
        (0..count).map(|_| one()).collect()
    }

    /// Asks that each box within `child` lies within `around`; gives the leaves in their order.
    fn leaves(tree: &Tree, child: Child, around: &Bounds) -> Vec<(u32, Bounds)> {
        let index = match child.index() {
            Ok(leaf) => return vec![(leaf, *around)],
            Err(index) => index,
        };
        let eight = &tree.eights[index];
        let used = (0..SIDE).filter(|slot| eight.bounds[0][0][*slot].is_finite());
        used.flat_map(|slot| {
            let of = |side: usize| Vec3A::from([0, 1, 2].map(|i| eight.bounds[i][side][slot]));
            let bounds = Bounds { low: of(0), high: of(1) };
            assert!(bounds.low.cmpge(around.low).all() && bounds.high.cmple(around.high).all());
            leaves(tree, eight.child[slot], &bounds)
        })
        .collect()
    }

    const EVERYWHERE: Bounds = Bounds { low: Vec3A::NEG_INFINITY, high: Vec3A::INFINITY };

    proptest! {
        #[test]
        fn each_item_is_in_one_leaf_within_all_boxes_above(
            seed in 0..u64::MAX,
            count in 1..400_usize,
            cells in 1..40,
            most in 1..=SIDE,
        ) {
            let items = boxes(seed, count, cells);
            let Built { tree, order, ends } = Built::over(items.iter().copied(), most, [0.0; 3]);
            let leaves = leaves(&tree, Child::eight(0), &EVERYWHERE);
            prop_assert_eq!(leaves.len(), ends.len());
            let mut first = 0;
            for (index, (leaf, around)) in (0..).zip(&leaves) {
                prop_assert_eq!(*leaf, index);
                let end = ends[index as usize] as usize;
                prop_assert!((1..=most).contains(&(end - first)));
                for item in &order[first..end] {
                    let Bounds { low, high } = items[*item as usize];
                    prop_assert!(low.cmpge(around.low).all() && high.cmple(around.high).all());
                }
                first = end;
            }
            let mut sorted = order;
            sorted.sort_unstable();
            prop_assert!(sorted.into_iter().eq(0..count as u32));
        }
    }

    /// Boxes that coincide, that all share a corner, and that double in size, so that every cut
    /// takes one off: they are halved in the end, and not cut one by one to the last.
    #[test]
    fn the_depth_is_bounded_whatever_the_boxes() {
        let count = 20_000;
        let same = |_: usize| 1.0;
        let fan = |index: usize| 1.0 + index as f32;
        let doubling = |index: usize| (index as f32 / 80.0 - 125.0).exp2();
        for size in [same, fan, doubling] {
            let bounds = |index| Bounds { low: Vec3A::ZERO, high: Vec3A::splat(size(index)) };
            let built = Built::over((0..count).map(bounds), SIDE, [0.0; 3]);
            assert!(built.tree.room <= 7 * (CUTS as usize + 15), "{}", built.tree.room);
            assert_eq!(built.order.len(), count);
        }
    }
}

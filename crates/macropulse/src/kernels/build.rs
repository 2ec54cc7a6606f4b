//! Builds a hierarchy of boxes from the top.
//!
//! A range of items is cut in two where the surface area heuristic expects the fewest tests. A line that
//! enters a box enters one within it with a probability that is the ratio of their surfaces \[Wal07\]. The
//! cut is looked for at a few places of each axis. A node is a range after up to seven cuts, the largest part
//! cut first.

use std::ops::Range;

use glam::{Vec3A, Vec4};

use super::tree::{Bounds, Child, Eight, Tree};
use super::wide::{Any, Registers, SIDE, Task, Wide, on_level};

/// Places of an axis at which a range may be cut, and one more.
const BINS: usize = 16;

/// Number of items from which on they are put into two sets of bins by turns. Neighbours are mostly put into
/// the same bin, and in one set they have to wait for each other. Loading 4.8 million triangles takes a
/// twentieth less time; from 32 items on the gain is the same.
const TWO_SETS: usize = 128;

/// Cuts above a range before it is only halved. Boxes that all overlap, as of a fan or of triangles
/// that coincide, may be cut one by one: this bounds the time and the depth. Real meshes stay below
/// half of it.
const CUTS: u32 = 48;

/// A box that grows by the lesser of each lane: its low corner and, with its signs turned, its high
/// one, in lanes 0 to 2 and 4 to 6. The others are for whoever puts something there.
#[derive(Clone, Copy)]
#[repr(C, align(32))]
struct Growing([f32; SIDE]);

impl Growing {
    /// No line enters it.
    const NOWHERE: Self = Self([f32::INFINITY; SIDE]);

    /// Its low corner, and the high one with its signs turned.
    #[inline(always)]
    fn corners(&self) -> [Vec3A; 2] {
        let [a, b, c, d, e, f, g, h] = self.0;
        [Vec4::new(a, b, c, d), Vec4::new(e, f, g, h)].map(Vec3A::from_vec4)
    }

    fn bounds(&self) -> Bounds {
        let [low, turned] = self.corners();
        Bounds { low, high: -turned }
    }

    /// Around both.
    #[inline(always)]
    fn joined<R: Registers>(&self, other: &Self) -> Self {
        let mut least = [0.0; SIDE];
        R::Boxes::load(&self.0).least(R::Boxes::load(&other.0)).store(&mut least);
        Self(least)
    }

    /// Half of the surface, m².
    #[inline(always)]
    fn half_area(&self) -> f32 {
        let [low, turned] = self.corners();
        // The signs of all sides are turned, and so of no product of two.
        let [x, y, z] = (low + turned).to_array();
        x * y + y * z + z * x
    }
}

/// An item of a hierarchy: a box, with the halves of its index in the lanes left over. The halves are
/// numbers: as bits they would be subnormal, which is slow to compute with.
#[derive(Clone, Copy)]
struct Item(Growing);

impl Item {
    fn new(index: u32, Bounds { low, high }: &Bounds) -> Self {
        let [less, more] = [index & 0xFFFF, index >> 16].map(|half| half as f32);
        Self(Growing([low.x, low.y, low.z, less, -high.x, -high.y, -high.z, more]))
    }

    fn index(&self) -> u32 {
        let [_, _, _, less, _, _, _, more] = self.0.0;
        less as u32 | (more as u32) << 16
    }

    /// Twice the middle of its box.
    #[inline(always)]
    fn middle(&self) -> Vec3A {
        let [low, turned] = self.0.corners();
        low - turned
    }
}

/// Items that are to be put together, and the box of all.
#[derive(Clone)]
struct Part {
    items: Range<usize>,
    bounds: Bounds,
    /// Around twice the middles of their boxes.
    middles: Bounds,
    /// Cuts that made it.
    cuts: u32,
}

/// A hierarchy with its leaves.
pub(crate) struct Built {
    pub tree: Tree,
    /// The indices of the items, by leaf.
    pub order: Vec<u32>,
    /// End of each leaf in that order.
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
    /// A hierarchy over items, each with its index and a box whose coordinates count from `centre`, with up to `most`
    /// in a leaf. Without items, no ray enters it.
    pub(crate) fn over(
        boxes: impl Iterator<Item = (u32, Bounds)>,
        most: usize,
        centre: [f64; 3],
    ) -> Self {
        let (mut all, mut middles) = (Bounds::NOWHERE, Bounds::NOWHERE);
        let item = |(index, bounds): (u32, Bounds)| {
            let item = Item::new(index, &bounds);
            (all, middles) = (all.joined(&bounds), middles.holding(item.middle()));
            item
        };
        // There are hardly ever fewer than there may be.
        let mut items: Vec<Item> = Vec::with_capacity(boxes.size_hint().1.unwrap_or(0));
        items.extend(boxes.map(item));
        let mut builder = Builder { items, most, eights: Vec::new(), ends: Vec::new(), depth: 0 };
        if !builder.items.is_empty() {
            let items = 0..builder.items.len();
            builder.node(Part { items, bounds: all, middles, cuts: 0 }, 1);
        }
        let Builder { items, eights, ends, depth, .. } = builder;
        let order = items.iter().map(Item::index).collect();
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
        let mut halves = Halves::NONE;
        let extent = part.middles.high - part.middles.low;
        if extent.max_element() > 0.0 && part.cuts < CUTS {
            let scale = BINS as f32 * (1.0 - f32::EPSILON) / extent;
            let ruler = Ruler { low: part.middles.low, scale };
            on_level(Cut { items, ruler, most: self.most, halves: &mut halves });
        } else {
            halve(items, extent.max_position(), &mut halves);
        }
        let Halves { count, bounds, middles } = halves;
        let (start, end, cuts) = (part.items.start, part.items.end, part.cuts + 1);
        let half = |items, side: usize| Part {
            items,
            bounds: bounds[side].bounds(),
            middles: middles[side],
            cuts,
        };
        (half(start..start + count, 0), half(start + count..end, 1))
    }
}

/// Items on either side of a cut, those on the near side first.
struct Halves {
    /// How many are on the near side.
    count: usize,
    /// Around those of either side.
    bounds: [Growing; 2],
    /// Around twice their middles.
    middles: [Bounds; 2],
}

impl Halves {
    /// Halves without items.
    const NONE: Self =
        Self { count: 0, bounds: [Growing::NOWHERE; 2], middles: [Bounds::NOWHERE; 2] };
}

/// Half of the items on either side along an axis.
fn halve(items: &mut [Item], axis: usize, halves: &mut Halves) {
    halves.count = items.len() / 2;
    items.select_nth_unstable_by(halves.count, |a, b| {
        let along = a.middle()[axis].total_cmp(&b.middle()[axis]);
        along.then(a.index().cmp(&b.index()))
    });
    let (near, far) = items.split_at(halves.count);
    for (side, items) in [near, far].into_iter().enumerate() {
        for item in items {
            halves.bounds[side] = halves.bounds[side].joined::<Any>(&item.0);
            halves.middles[side] = halves.middles[side].holding(item.middle());
        }
    }
}

/// Places of the bins of a part on each axis.
struct Ruler {
    low: Vec3A,
    /// Bins per length.
    scale: Vec3A,
}

/// Cuts items where that is expected to be best.
struct Cut<'a> {
    items: &'a mut [Item],
    ruler: Ruler,
    /// Items of a leaf, at most.
    most: usize,
    halves: &'a mut Halves,
}

/// The items of a part by the place of their middles, on each axis.
struct Bins {
    bounds: [[Growing; BINS]; 3],
    counts: [[u32; BINS]; 3],
}

impl Bins {
    const EMPTY: Self = Self { bounds: [[Growing::NOWHERE; BINS]; 3], counts: [[0; BINS]; 3] };

    /// Adds an item to the bin of each axis in which the middle of its box is.
    #[inline(always)]
    fn add<R: Registers>(&mut self, item: &Item, ruler: &Ruler) {
        let place = (item.middle() - ruler.low) * ruler.scale;
        for axis in 0..3 {
            let bin = bin(place[axis]);
            self.bounds[axis][bin] = self.bounds[axis][bin].joined::<R>(&item.0);
            self.counts[axis][bin] += 1;
        }
    }

    /// Adds what is in the `others`.
    #[inline(always)]
    fn join<R: Registers>(&mut self, others: &Self) {
        for axis in 0..3 {
            for bin in 0..BINS {
                let bounds = &mut self.bounds[axis][bin];
                *bounds = bounds.joined::<R>(&others.bounds[axis][bin]);
                self.counts[axis][bin] += others.counts[axis][bin];
            }
        }
    }
}

impl Task for Cut<'_> {
    #[inline(always)]
    fn run<R: Registers>(&mut self) {
        let (axis, end) = self.best::<R>(&self.bins::<R>());
        let (low, scale) = (self.ruler.low[axis], self.ruler.scale[axis]);
        let [mut near, mut far] = [Bounds::NOWHERE; 2];
        let mut count = 0;
        for index in 0..self.items.len() {
            let middle = self.items[index].middle();
            if bin((middle[axis] - low) * scale) < end {
                near = near.holding(middle);
                self.items.swap(index, count);
                count += 1;
            } else {
                far = far.holding(middle);
            }
        }
        (self.halves.count, self.halves.middles) = (count, [near, far]);
    }
}

impl Cut<'_> {
    #[inline(always)]
    fn bins<R: Registers>(&self) -> Bins {
        let mut bins = Bins::EMPTY;
        if self.items.len() < TWO_SETS {
            self.items.iter().for_each(|item| bins.add::<R>(item, &self.ruler));
            return bins;
        }
        let mut others = Bins::EMPTY;
        let (pairs, last) = self.items.as_chunks();
        for [one, other] in pairs {
            bins.add::<R>(one, &self.ruler);
            others.add::<R>(other, &self.ruler);
        }
        last.iter().for_each(|item| bins.add::<R>(item, &self.ruler));
        bins.join::<R>(&others);
        bins
    }

    /// The axis of the best cut, and the bin before which it lies. Notes the boxes of either side.
    #[inline(always)]
    fn best<R: Registers>(&mut self, bins: &Bins) -> (usize, usize) {
        let (mut least, mut best) = (f32::INFINITY, (0, 1));
        let tests = |count: u32| count.div_ceil(self.most as u32) as f32;
        for axis in 0..3 {
            let (bounds, counts) = (&bins.bounds[axis], &bins.counts[axis]);
            // A cut behind a bin without items is the one behind the bin before it.
            let (mut used, mut bins) = (0, [0; BINS]);
            for bin in 0..BINS {
                bins[used] = bin;
                used += usize::from(counts[bin] > 0);
            }
            let bins = &bins[..used];
            let mut behind = [(Growing::NOWHERE, 0); BINS];
            let (mut right, mut count) = (Growing::NOWHERE, 0);
            for &bin in bins.iter().rev() {
                (right, count) = (right.joined::<R>(&bounds[bin]), count + counts[bin]);
                behind[bin] = (right, count);
            }
            let (mut left, mut count) = (Growing::NOWHERE, 0);
            for pair in bins.windows(2) {
                let (bin, next) = (pair[0], pair[1]);
                (left, count) = (left.joined::<R>(&bounds[bin]), count + counts[bin]);
                let (right, rest) = behind[next];
                let cost = left.half_area() * tests(count) + right.half_area() * tests(rest);
                if cost < least {
                    (least, best) = (cost, (axis, bin + 1));
                    self.halves.bounds = [left, right];
                }
            }
        }
        best
    }
}

/// Returns the bin at a place, counted in bins; where two meet it may be either. A place that is NaN, on an
/// axis without extent, is in the first.
///
/// From 2²³ on an `f32` is a whole number. Sums are rounded to one, and its last bits are the distance from
/// 2²³. A conversion takes longer: 2 % of the time to load a mesh.
#[inline(always)]
fn bin(place: f32) -> usize {
    const WHOLE: f32 = (1 << 23) as f32;
    let last = BINS as f32 - 1.0;
    let least = if place > 0.5 { place - 0.5 } else { 0.0 };
    let whole = if least < last { least } else { last } + WHOLE;
    whole.to_bits() as usize % BINS
}

#[cfg(test)]
mod tests {
    use super::*;
    use macropulse_codec::level::forced::at_each_level;
    use proptest::prelude::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// Boxes with whole coordinates; many of them coincide if `cells` is small.
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
            let numbered = (0..).zip(items.iter().copied());
            let Built { tree, order, ends } = Built::over(numbered, most, [0.0; 3]);
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

    proptest! {
        #[test]
        fn every_level_builds_the_same(seed in 0..u64::MAX, count in 1..400_usize, cells in 1..40) {
            let items = boxes(seed, count, cells);
            let built = at_each_level(|| {
                let built = Built::over((0..).zip(items.iter().copied()), SIDE, [0.0; 3]);
                format!("{:?} {:?} {:?}", built.tree, built.order, built.ends)
            });
            for (level, one) in &built {
                prop_assert_eq!(one, &built[0].1, "{:?}", level);
            }
        }
    }

    #[test]
    fn a_place_is_in_its_bin() {
        let (first, last) = (-3..=0, 15..20);
        for place in first.chain(1..15).chain(last) {
            let middle = place as f32 + 0.5;
            assert_eq!(bin(middle), place.clamp(0, 15) as usize);
            assert!(
                [place - 1, place]
                    .map(|bin| bin.clamp(0, 15) as usize)
                    .contains(&bin(place as f32))
            );
        }
        assert_eq!([f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e30].map(bin), [0, 15, 0, 15]);
    }

    #[test]
    fn an_item_keeps_its_index_and_its_box() {
        let bounds = Bounds { low: Vec3A::new(-1.0, 0.25, 3.0), high: Vec3A::new(-0.5, 1e15, 3.0) };
        for index in [0, 1, 0xFFFF, 0x1_0000, 0x7FFF_FFFF, u32::MAX] {
            let item = Item::new(index, &bounds);
            let Bounds { low, high } = item.0.bounds();
            assert_eq!((item.index(), low, high), (index, bounds.low, bounds.high));
            assert_eq!(item.middle(), bounds.low + bounds.high);
        }
    }

    /// Boxes that coincide, that all share a corner, and that double in size, so that every cut takes one
    /// off. They are halved in the end, and not cut one by one to the last.
    #[test]
    fn the_depth_is_bounded_whatever_the_boxes() {
        let count = 20_000;
        let same = |_: usize| 1.0;
        let fan = |index: usize| 1.0 + index as f32;
        let doubling = |index: usize| (index as f32 / 80.0 - 125.0).exp2();
        for size in [same, fan, doubling] {
            let bounds = |index| Bounds { low: Vec3A::ZERO, high: Vec3A::splat(size(index)) };
            let built = Built::over((0..).zip((0..count).map(bounds)), SIDE, [0.0; 3]);
            assert!(built.tree.room <= 7 * (CUTS as usize + 15), "{}", built.tree.room);
            assert_eq!(built.order.len(), count);
        }
    }
}

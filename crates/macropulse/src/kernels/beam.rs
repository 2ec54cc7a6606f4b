//! Neighbouring rays down a hierarchy, as a beam. Eight boxes at once are tested against the pyramid around
//! all rays, and only the boxes of leaves against each ray.

use super::packet::{Lanes, Leaves, Packet};
use super::single::{PutOff, put_off};
use super::tree::{Child, Eight, SLACK, Tree, across, inverse, narrow_above, narrow_below};
use super::wide::{LANES, Registers, SIDE, Wide, fetch};

/// Rays are neighbours if their directions differ by no more than this for each of them, summed over
/// the axes.
///
/// Measured on fans of sixteen at a city of 250 000 triangles and at a car of 50 000. A beam and rays alone
/// are equally fast there at 16 to 32 mrad from ray to ray.
const NEIGHBOURS: f32 = 0.016;

/// The rays of a packet as boxes and triangles need them.
pub(super) struct Aims {
    origin: [f32; 3],
    direction: [Lanes<f32>; 3],
    inverse: [Lanes<f32>; 3],
    /// Rays that point backward, by axis.
    backward: [u32; 3],
    /// Rays that have it for their main axis: along which they are longest, the first of equals.
    main: [u32; 3],
    /// By how much limits are stretched.
    margin: f32,
    /// Before which nothing matters, and behind which nothing does.
    starts: Lanes<f32>,
    limits: Lanes<f32>,
}

impl Aims {
    #[inline(always)]
    pub fn of<R: Registers>(packet: &Packet, tree: &Tree, origin: [f32; 3]) -> Self {
        let [x, y, z] = &packet.direction;
        let direction = [narrow(x), narrow(y), narrow(z)];
        let [x, y, z] = &direction;
        let inverse = [inverses(x), inverses(y), inverses(z)];
        let [x, y, z] = &inverse;
        let backward = [negative::<R>(x), negative::<R>(y), negative::<R>(z)];
        let margin = tree.margin(origin);
        Self {
            origin,
            main: main_axes::<R>(&direction),
            direction,
            inverse,
            backward,
            margin,
            starts: starts(packet, margin),
            limits: limits(packet, margin),
        }
    }

    /// Rays that enter the box around all.
    #[inline(always)]
    pub fn entering<R: Registers>(&self, tree: &Tree) -> u32 {
        let mut enter = R::Rays::splat(0.0);
        let mut leave = R::Rays::load(&self.limits);
        for axis in 0..3 {
            let inverse = R::Rays::load(&self.inverse[axis]);
            let [low, high] = tree.bounds[axis];
            let low = R::Rays::splat(low - self.origin[axis]).times(inverse);
            let high = R::Rays::splat(high - self.origin[axis]).times(inverse);
            enter = low.least(high).most(enter);
            leave = low.most(high).times(R::Rays::splat(SLACK)).least(leave);
        }
        let [x, y, z] = self.main;
        enter.at_most(leave) & (x | y | z)
    }

    /// How far the rays of `set` are spread.
    #[inline(always)]
    pub fn spread<R: Registers>(&self, set: u32) -> Spread {
        let [x, y, z] = &self.direction;
        let (x, y, z) = (R::Rays::load(x), R::Rays::load(y), R::Rays::load(z));
        let (starts, limits) = (R::Rays::load(&self.starts), R::Rays::load(&self.limits));
        // The least is the greatest of the same with the other sign, that of zero as well.
        let none = R::Rays::splat(-0.0);
        let numbers =
            [none.minus(x), x, none.minus(y), y, none.minus(z), z, none.minus(starts), limits];
        Spread { set, greatest: R::greatest_of_each(&numbers, set) }
    }

    /// The rays of `among` that point into the same octant as the first of them, and have the same main axis.
    /// `spread` is used if it is that of the same rays.
    #[inline(always)]
    pub fn beam<R: Registers>(&self, among: u32, spread: &Spread) -> Beam {
        let first = among.trailing_zeros();
        let like_first = |of: u32| if of >> first & 1 == 1 { of } else { !of };
        let backward = self.backward;
        let [along_x, along_y, along_z] = self.main;
        let set = backward.iter().fold(among, |set, axis| set & like_first(*axis));
        let set = set & like_first(along_x) & like_first(along_y) & like_first(along_z);
        let is_first = |of: u32| (of >> first & 1) as usize;
        let greatest =
            if set == spread.set { spread.greatest } else { self.spread::<R>(set).greatest };
        let [.., soonest, latest] = greatest;
        // Among slopes of one sign the greatest has the least inverse, and rounding keeps them in order.
        // Eight, two of them unused, are divided at once.
        let [x_most, x_least, y_most, y_least, z_most, z_least, ..] = inverses(&greatest);
        Beam {
            set,
            backward: backward.map(is_first),
            along: is_first(along_y) + 2 * is_first(along_z),
            inverse: [[x_least, -x_most], [y_least, -y_most], [z_least, -z_most]],
            soonest: -soonest,
            latest,
        }
    }
}

/// How far rays are spread.
pub(super) struct Spread {
    set: u32,
    /// The least slope, with the other sign, and the greatest, by axis; and likewise the least start and the
    /// greatest limit.
    greatest: [f32; SIDE],
}

impl Spread {
    /// Returns true if the rays are neighbours.
    #[inline(always)]
    pub fn is_narrow(&self) -> bool {
        let [x_least, x_most, y_least, y_most, z_least, z_most, ..] = self.greatest;
        let apart = (x_most + x_least) + (y_most + y_least) + (z_most + z_least);
        apart <= NEIGHBOURS * self.set.count_ones() as f32
    }
}

/// The pyramid around rays of one octant and one main axis.
pub(super) struct Beam {
    pub set: u32,
    /// Which bound of a box is near, by axis.
    backward: [usize; 3],
    /// The main axis.
    along: usize,
    /// The least and the greatest 1/d, by axis.
    inverse: [[f32; 2]; 3],
    /// Nothing before it matters to any, and nothing behind it.
    soonest: f32,
    latest: f32,
}

#[inline(always)]
fn narrow(values: &Lanes<f64>) -> Lanes<f32> {
    let mut narrow = [0.0; LANES];
    for lane in 0..LANES {
        narrow[lane] = values[lane] as f32;
    }
    narrow
}

#[inline(always)]
fn inverses<const N: usize>(slopes: &[f32; N]) -> [f32; N] {
    let mut inverses = [0.0; N];
    for lane in 0..N {
        inverses[lane] = inverse(slopes[lane]);
    }
    inverses
}

/// The quotients of two slopes.
#[inline(always)]
fn ratios(across: &Lanes<f32>, along: &Lanes<f32>) -> Lanes<f32> {
    let mut ratios = [0.0; LANES];
    for lane in 0..LANES {
        ratios[lane] = across[lane] / along[lane];
    }
    ratios
}

/// Lanes below zero.
#[inline(always)]
fn negative<R: Registers>(values: &Lanes<f32>) -> u32 {
    R::Rays::load(values).below(R::Rays::splat(0.0))
}

/// Rays by the axis along which they are longest, the first of equals; in no set if they are none:
/// NaN, infinite, or without direction.
#[inline(always)]
fn main_axes<R: Registers>([x, y, z]: &[Lanes<f32>; 3]) -> [u32; 3] {
    let (x, y, z) = (length::<R>(x), length::<R>(y), length::<R>(z));
    let (zero, infinity) = (R::Rays::splat(0.0), R::Rays::splat(f32::INFINITY));
    let finite = x.below(infinity) & y.below(infinity) & z.below(infinity);
    let rays = finite & (zero.below(x) | zero.below(y) | zero.below(z));
    let along_x = y.at_most(x) & z.at_most(x);
    let along_z = !along_x & y.below(z);
    [rays & along_x, rays & !(along_x | along_z), rays & along_z]
}

#[inline(always)]
fn length<R: Registers>(slopes: &Lanes<f32>) -> R::Rays {
    let slopes = R::Rays::load(slopes);
    R::Rays::splat(0.0).minus(slopes).most(slopes)
}

/// Behind which nothing matters, by ray.
#[inline(always)]
fn limits(packet: &Packet, margin: f32) -> Lanes<f32> {
    let mut limits = [0.0; LANES];
    for lane in 0..LANES {
        limits[lane] = narrow_above(packet.range[lane], margin);
    }
    limits
}

/// Before which nothing matters, by ray.
#[inline(always)]
fn starts(packet: &Packet, margin: f32) -> Lanes<f32> {
    let mut starts = [0.0; LANES];
    for lane in 0..LANES {
        starts[lane] = narrow_below(packet.nearest[lane], margin);
    }
    starts
}

#[inline(always)]
fn both<R: Registers>([least, most]: [f32; 2]) -> [R::Boxes; 2] {
    [R::Boxes::splat(least), R::Boxes::splat(most)]
}

/// Rays of one octant and one main axis on their way down.
pub(super) struct Descent<'a, R: Registers, const FROM_CENTRE: bool> {
    eights: &'a [Eight],
    origin: [f32; 3],
    inverse: [R::Rays; 3],
    /// The least and the greatest of these.
    extremes: [[R::Boxes; 2]; 3],
    /// Which bound of a box is near, by axis.
    backward: [usize; 3],
    pub axes: [usize; 3],
    pub shear: [R::Rays; 2],
    margin: f32,
    /// Nothing before it matters.
    start: R::Rays,
    /// Nothing before it matters to any.
    soonest: f32,
    /// Nothing behind it matters.
    limit: R::Rays,
    /// Nothing behind it matters to any.
    latest: f32,
    set: u32,
}

impl<'a, R: Registers, const FROM_CENTRE: bool> Descent<'a, R, FROM_CENTRE> {
    #[inline(always)]
    pub fn new(aims: &Aims, tree: &'a Tree, beam: &Beam) -> Self {
        let axes = across(beam.along);
        let [u, v, along] = axes;
        let direction = &aims.direction;
        let shear =
            [ratios(&direction[u], &direction[along]), ratios(&direction[v], &direction[along])];
        let [x, y, z] = &aims.inverse;
        let [in_x, in_y, in_z] = beam.inverse;
        Self {
            eights: &tree.eights,
            origin: aims.origin,
            inverse: [R::Rays::load(x), R::Rays::load(y), R::Rays::load(z)],
            extremes: [both::<R>(in_x), both::<R>(in_y), both::<R>(in_z)],
            backward: beam.backward,
            axes,
            shear: [R::Rays::load(&shear[0]), R::Rays::load(&shear[1])],
            margin: aims.margin,
            start: R::Rays::load(&aims.starts),
            soonest: beam.soonest,
            limit: R::Rays::load(&aims.limits),
            latest: beam.latest,
            set: beam.set,
        }
    }

    /// Takes note of ranges that were shortened.
    #[inline(always)]
    fn shorten(&mut self, packet: &Packet) {
        self.limit = R::Rays::load(&limits(packet, self.margin));
        self.latest = R::greatest(self.limit, self.set);
    }

    /// A coordinate on an axis, from the start of the rays.
    #[inline(always)]
    pub fn shifted<const N: usize, W: Wide<N>>(&self, axis: usize, coordinate: W) -> W {
        if FROM_CENTRE { coordinate } else { coordinate.minus(W::splat(self.origin[axis])) }
    }

    /// The boxes between the planes `[low, high]`, by axis, that rays may enter; and where the
    /// first of them would.
    ///
    /// Each ray crosses a plane p at p·d⁻¹, and so none before the lesser and none behind the
    /// greater of p·min d⁻¹ and p·max d⁻¹. Rounding is monotone: what holds of the exact products
    /// holds of the rounded ones, and no box is passed over that a ray alone would enter.
    #[inline(always)]
    pub fn may_enter(&self, [x, y, z]: [[R::Boxes; 2]; 3]) -> (u32, R::Boxes) {
        let [x, y, z] = [self.slab(0, x), self.slab(1, y), self.slab(2, z)];
        let enter = x[0].most(y[0]).most(z[0].most(R::Boxes::splat(self.soonest)));
        let leave = x[1].least(y[1]).least(z[1]).times(R::Boxes::splat(SLACK));
        (enter.at_most(leave.least(R::Boxes::splat(self.latest))), enter)
    }

    /// Before which no ray crosses the near one of two planes across an axis, and behind which none
    /// crosses the far one.
    #[inline(always)]
    fn slab(&self, axis: usize, [low, high]: [R::Boxes; 2]) -> [R::Boxes; 2] {
        let (low, high) = (self.shifted(axis, low), self.shifted(axis, high));
        let (near, far) = if self.backward[axis] == 0 { (low, high) } else { (high, low) };
        let [least, most] = self.extremes[axis];
        [near.times(least).least(near.times(most)), far.times(least).most(far.times(most))]
    }

    /// Returns the distances at which the rays cross the low or the high plane of box `box_at` on an axis.
    /// The number of a box is [`SIDE`] times the number of its node, plus its place in it.
    #[inline(always)]
    fn reached(&self, box_at: u32, axis: usize, bound: usize) -> R::Rays {
        let bounds = &self.eights[box_at as usize / SIDE].bounds;
        let plane = R::Rays::splat(bounds[axis][bound & 1][box_at as usize % SIDE]);
        self.shifted(axis, plane).times(self.inverse[axis])
    }

    /// Rays that enter a box.
    #[inline(always)]
    fn entering(&self, box_at: u32) -> u32 {
        let [x, y, z] = self.backward;
        let enter = self.reached(box_at, 0, x).most(self.reached(box_at, 1, y));
        let enter = enter.most(self.reached(box_at, 2, z).most(self.start));
        let leave = self.reached(box_at, 0, 1 - x).least(self.reached(box_at, 1, 1 - y));
        let leave = leave.least(self.reached(box_at, 2, 1 - z));
        self.set & enter.at_most(leave.times(R::Rays::splat(SLACK)).least(self.limit))
    }

    #[inline(always)]
    pub fn run(&mut self, packet: &mut Packet, stack: &mut [PutOff], leaves: &mut impl Leaves) {
        let (mut waiting, mut child, mut place) = (0, Child::eight(0), 0);
        loop {
            match child.index() {
                Err(index) => {
                    let eight = &self.eights[index];
                    let (entered, enter) = self.may_enter(eight.planes::<R>());
                    let first = (index * SIDE) as u32;
                    if entered.is_power_of_two() {
                        place = first + entered.trailing_zeros();
                        child = eight.child[place as usize % SIDE];
                        continue;
                    }
                    let mut enters = [0.0; SIDE];
                    enter.store(&mut enters);
                    waiting = put_off(stack, waiting, (entered, &enters), |slot| {
                        match eight.child[slot].index() {
                            Err(index) => fetch(self.eights, index),
                            Ok(leaf) => leaves.fetch(leaf),
                        }
                        first + slot as u32
                    });
                }
                Ok(leaf) => {
                    let set = self.entering(place);
                    if set != 0 && leaves.meet(self, packet, leaf, set) && waiting > 0 {
                        self.shorten(packet);
                    }
                }
            }
            // Boxes that were put off may by now lie behind the nearest hits.
            (child, place) = loop {
                if waiting == 0 {
                    return;
                }
                waiting -= 1;
                let (enter, place) = stack[waiting].parts();
                if enter <= self.latest {
                    let child = self.eights[place as usize / SIDE].child[place as usize % SIDE];
                    break (child, place);
                }
            };
        }
    }
}

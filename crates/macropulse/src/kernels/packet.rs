//! Rays from one place, many at a time, down a hierarchy.
//!
//! Neighbouring rays enter nearly the same boxes. A packet of them descends together: a box is
//! fetched once and tested against all, and a ray that does not enter it sits out until the packet
//! comes back. Rays of a packet that point into different octants, or have another main axis, descend
//! one after the other. Each ray meets what it would have met alone, to the last bit.

use super::tree::{
    Node, Pair, SLACK, Tree, across, inverse, main_axis, narrow_above, narrow_below,
};
use super::triangles::{Plane, Triangles, passes_exactly};
#[cfg(target_arch = "x86_64")]
use super::wide::{Avx2, Avx512};
use super::wide::{LANES, Plain, Wide};
use macropulse_codec::level::Level;

/// One number for each ray of a packet.
pub(crate) type Lanes<T> = [T; LANES];

/// Rays from one place, and what they have met.
#[derive(Debug, Clone)]
pub(crate) struct Packet {
    pub origin: [f64; 3],
    /// Unit vectors, by axis; anything where there is no ray.
    pub direction: [Lanes<f64>; 3],
    /// Only what is farther than this is met.
    pub nearest: Lanes<f64>,
    /// Only what is nearer than this is met, and nothing if it is NaN; then what was met.
    pub range: Lanes<f64>,
    /// The triangle, in the order of the leaves; [`NONE`] for rays that met none.
    pub leaf: Lanes<u32>,
}

/// No triangle.
pub(crate) const NONE: u32 = u32::MAX;

/// Nodes that wait during a descent; kept between packets.
#[derive(Debug, Default)]
pub(crate) struct Waiting {
    nodes: Vec<(Node, u32)>,
    /// Where each ray of the packet enters the box.
    enters: Vec<Lanes<f32>>,
}

impl Packet {
    /// No rays yet, from `origin`.
    pub(crate) fn from(origin: [f64; 3]) -> Self {
        Self {
            origin,
            direction: [[0.0; LANES]; 3],
            nearest: [0.0; LANES],
            range: [f64::NAN; LANES],
            leaf: [NONE; LANES],
        }
    }

    /// Gives the packet a ray that goes no farther than `farthest`.
    #[inline(always)]
    pub(crate) fn set(&mut self, lane: usize, [x, y, z]: [f64; 3], farthest: f64) {
        self.direction[0][lane] = x;
        self.direction[1][lane] = y;
        self.direction[2][lane] = z;
        self.range[lane] = farthest;
    }

    /// The direction of one ray.
    #[inline(always)]
    pub(crate) fn along(&self, lane: usize) -> [f64; 3] {
        let [x, y, z] = &self.direction;
        [x[lane], y[lane], z[lane]]
    }

    /// Looks along each ray for the nearest of `triangles`; of two equally far the first leaf.
    pub(crate) fn cast(&mut self, triangles: &Triangles, waiting: &mut Waiting) {
        self.leaf = [NONE; LANES];
        self.descend(&triangles.tree, waiting, triangles);
    }

    /// Calls `visit` with each leaf whose box rays enter before their range, and with the set of
    /// these rays. It may shorten their ranges.
    pub(crate) fn visit(
        &mut self,
        tree: &Tree,
        waiting: &mut Waiting,
        visit: &mut dyn FnMut(&mut Self, u32, u32),
    ) {
        self.descend(tree, waiting, Visits(visit));
    }

    fn descend(&mut self, tree: &Tree, waiting: &mut Waiting, leaves: impl Leaves) {
        let Some(origin) = tree.local(self.origin) else { return };
        if tree.pairs.is_empty() {
            return;
        }
        let room = tree.depth + 2;
        if waiting.nodes.len() < room {
            waiting.nodes.resize(room, Default::default());
            waiting.enters.resize(room, [0.0; LANES]);
        }
        on_level((self, waiting), tree, origin, leaves);
    }
}

/// Written out, for it is the level that decides how numbers are held.
fn on_level<L: Leaves>(
    packet: (&mut Packet, &mut Waiting),
    tree: &Tree,
    origin: [f32; 3],
    leaves: L,
) {
    #[cfg(target_arch = "x86_64")]
    type Moving<'a> = (&'a mut Packet, &'a mut Waiting);

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
    fn avx2<L: Leaves>(packet: Moving, tree: &Tree, origin: [f32; 3], leaves: L) {
        all_classes::<Avx2, L>(packet, tree, origin, leaves);
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
    #[target_feature(enable = "avx512f,avx512bw,avx512cd,avx512dq,avx512vl")]
    fn avx512<L: Leaves>(packet: Moving, tree: &Tree, origin: [f32; 3], leaves: L) {
        all_classes::<Avx512, L>(packet, tree, origin, leaves);
    }

    match Level::here() {
        // SAFETY: the processor was asked for each of these features.
        #[cfg(target_arch = "x86_64")]
        Level::Avx512 => unsafe { avx512(packet, tree, origin, leaves) },
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        Level::Avx2 => unsafe { avx2(packet, tree, origin, leaves) },
        _ => all_classes::<Plain, L>(packet, tree, origin, leaves),
    }
}

/// Sends rays of the same octant and main axis down together.
#[inline(always)]
fn all_classes<W: Wide, L: Leaves>(
    (packet, waiting): (&mut Packet, &mut Waiting),
    tree: &Tree,
    origin: [f32; 3],
    mut leaves: L,
) {
    let aims = Aims::of(packet, origin);
    let mut rest = (1 << LANES) - 1;
    while rest != 0 {
        let (class, set) = aims.alike(rest);
        rest &= !set;
        if class >> 3 == 3 {
            continue;
        }
        // From the centre, nothing has to be subtracted from anything.
        if origin == [0.0; 3] {
            Descent::<W, true>::new(&aims, tree, packet, (class, set)).run(
                packet,
                waiting,
                &mut leaves,
            );
        } else {
            Descent::<W, false>::new(&aims, tree, packet, (class, set)).run(
                packet,
                waiting,
                &mut leaves,
            );
        }
    }
}

/// The rays of a packet as boxes and triangles need them.
struct Aims {
    origin: [f32; 3],
    inverse: [Lanes<f32>; 3],
    direction: [Lanes<f32>; 3],
    /// Octant and main axis; an axis of 3 for what is no ray.
    class: Lanes<u32>,
}

impl Aims {
    #[inline(always)]
    fn of(packet: &Packet, origin: [f32; 3]) -> Self {
        let mut direction = [[0.0; LANES]; 3];
        let mut inverses = [[0.0; LANES]; 3];
        for axis in 0..3 {
            for lane in 0..LANES {
                direction[axis][lane] = packet.direction[axis][lane] as f32;
            }
            for lane in 0..LANES {
                inverses[axis][lane] = inverse(direction[axis][lane]);
            }
        }
        let [x, y, z] = &direction;
        let mut class = [0; LANES];
        for lane in 0..LANES {
            let sign = |slope: f32| slope.to_bits() >> 31;
            let octant = sign(x[lane]) | (sign(y[lane]) << 1) | (sign(z[lane]) << 2);
            class[lane] = octant | (main_axis([x[lane], y[lane], z[lane]]) << 3);
        }
        Self { origin, inverse: inverses, direction, class }
    }

    /// Rays of `among` that are of the class of the first of them.
    #[inline(always)]
    fn alike(&self, among: u32) -> (u32, u32) {
        let class = self.class[among.trailing_zeros() as usize % LANES];
        let mut set = 0;
        for lane in 0..LANES {
            set |= u32::from(self.class[lane] == class) << lane;
        }
        (class, set & among)
    }
}

/// What the leaves of a hierarchy are, for a packet that comes by.
trait Leaves {
    /// Lets the rays of `set` meet `leaf`; whether the range of any was shortened.
    fn meet<W: Wide, const FROM_CENTRE: bool>(
        &mut self,
        descent: &Descent<W, FROM_CENTRE>,
        packet: &mut Packet,
        leaf: u32,
        set: u32,
    ) -> bool;
}

/// Rays of one octant and one main axis on their way down.
struct Descent<'a, W, const FROM_CENTRE: bool> {
    pairs: &'a [Pair],
    origin: [f32; 3],
    inverse: [W; 3],
    /// Which bound of a box is near, by axis.
    backward: [usize; 3],
    axes: [usize; 3],
    shear: [W; 2],
    margin: f32,
    /// Nothing before it matters.
    start: W,
    /// Nothing behind it matters; NaN for rays that take no part.
    limit: W,
    set: u32,
}

impl<'a, W: Wide, const FROM_CENTRE: bool> Descent<'a, W, FROM_CENTRE> {
    #[inline(always)]
    fn new(aims: &Aims, tree: &'a Tree, packet: &Packet, (class, set): (u32, u32)) -> Self {
        let axes = across(class >> 3);
        let [u, v, along] = axes;
        let mut shear = [[0.0; LANES]; 2];
        for lane in 0..LANES {
            shear[0][lane] = aims.direction[u][lane] / aims.direction[along][lane];
            shear[1][lane] = aims.direction[v][lane] / aims.direction[along][lane];
        }
        let [x, y, z] = &aims.inverse;
        let margin = tree.margin(aims.origin);
        let mut start = [0.0; LANES];
        for lane in 0..LANES {
            start[lane] = narrow_below(packet.nearest[lane], margin);
        }
        Self {
            pairs: &tree.pairs,
            origin: aims.origin,
            inverse: [W::load(x), W::load(y), W::load(z)],
            backward: [(class & 1) as usize, (class >> 1 & 1) as usize, (class >> 2 & 1) as usize],
            axes,
            shear: [W::load(&shear[0]), W::load(&shear[1])],
            margin,
            start: W::load(&start),
            limit: Self::limit(packet, margin, set),
            set,
        }
    }

    #[inline(always)]
    fn limit(packet: &Packet, margin: f32, set: u32) -> W {
        let mut limit = [0.0; LANES];
        for lane in 0..LANES {
            let above = narrow_above(packet.range[lane], margin);
            limit[lane] = if set >> lane & 1 == 1 { above } else { f32::NAN };
        }
        W::load(&limit)
    }

    /// A coordinate on an axis, from the start of the rays.
    #[inline(always)]
    fn shifted(&self, axis: usize, coordinate: f32) -> W {
        W::splat(if FROM_CENTRE { coordinate } else { coordinate - self.origin[axis] })
    }

    /// Where each ray enters a box of a pair, and which ones do.
    #[inline(always)]
    fn enters(&self, bounds: &[[[f32; 2]; 2]; 3], side: usize) -> (W, u32) {
        let slab = |axis: usize, bound: usize| {
            self.shifted(axis, bounds[axis][bound & 1][side]).times(self.inverse[axis])
        };
        let [x, y, z] = self.backward;
        let enter = slab(0, x).most(slab(1, y)).most(slab(2, z).most(self.start));
        let leave = slab(0, 1 - x).least(slab(1, 1 - y)).least(slab(2, 1 - z));
        (enter, enter.at_most(leave.times(W::splat(SLACK)).least(self.limit)))
    }

    #[inline(always)]
    fn run(&mut self, packet: &mut Packet, waiting: &mut Waiting, leaves: &mut impl Leaves) {
        let mut count = 0;
        let (mut node, mut set) = (Node::default(), self.set);
        loop {
            if node.count == 0 {
                let pair = &self.pairs[node.first as usize];
                let (left, in_left) = self.enters(&pair.bounds, 0);
                let (right, in_right) = self.enters(&pair.bounds, 1);
                let (in_left, in_right) = (in_left & set, in_right & set);
                if in_left != 0 && in_right != 0 {
                    // The majority of those that enter both decides which is nearer.
                    let both = in_left & in_right;
                    let votes = (right.below(left) & both).count_ones();
                    let (far_set, far);
                    if 2 * votes > both.count_ones() {
                        (node, set) = (pair.child[1], in_right);
                        (far, far_set) = (pair.child[0], in_left);
                        left.store(&mut waiting.enters[count]);
                    } else {
                        (node, set) = (pair.child[0], in_left);
                        (far, far_set) = (pair.child[1], in_right);
                        right.store(&mut waiting.enters[count]);
                    }
                    waiting.nodes[count] = (far, far_set);
                    count += 1;
                    continue;
                }
                if in_left | in_right != 0 {
                    let side = usize::from(in_left == 0);
                    (node, set) = (pair.child[side], in_left | in_right);
                    continue;
                }
            } else {
                for leaf in node.first..node.first + node.count {
                    if leaves.meet(self, packet, leaf, set) {
                        self.limit = Self::limit(packet, self.margin, self.set);
                    }
                }
            }
            // What was put off may by now lie behind the nearest hits.
            loop {
                if count == 0 {
                    return;
                }
                count -= 1;
                (node, set) = waiting.nodes[count];
                set &= W::load(&waiting.enters[count]).at_most(self.limit);
                if set != 0 {
                    break;
                }
            }
        }
    }
}

/// Leaves that are met by a call.
struct Visits<'a>(&'a mut dyn FnMut(&mut Packet, u32, u32));

impl Leaves for Visits<'_> {
    #[inline(always)]
    fn meet<W: Wide, const FROM_CENTRE: bool>(
        &mut self,
        _: &Descent<W, FROM_CENTRE>,
        packet: &mut Packet,
        leaf: u32,
        set: u32,
    ) -> bool {
        (self.0)(packet, leaf, set);
        true
    }
}

impl Leaves for &Triangles {
    /// Solves for the range of those that pass, and keeps what is nearer than before.
    #[inline(always)]
    fn meet<W: Wide, const FROM_CENTRE: bool>(
        &mut self,
        descent: &Descent<W, FROM_CENTRE>,
        packet: &mut Packet,
        leaf: u32,
        set: u32,
    ) -> bool {
        let passing = passing(self, descent, leaf, set);
        if passing == 0 {
            return false;
        }
        let plane = Plane::new(&self.corners[leaf as usize], packet.origin);
        let Packet { direction: [x, y, z], nearest, range: ranges, leaf: leaves, .. } = packet;
        let mut changed = false;
        for lane in 0..LANES {
            let range = plane.range([x[lane], y[lane], z[lane]]);
            let (before, holder) = (ranges[lane], leaves[lane]);
            let first = (range == before) & (holder != NONE) & (leaf < holder);
            let nearer = (range < before) | first;
            let taken = (passing >> lane & 1 == 1) & (range > nearest[lane]) & nearer;
            ranges[lane] = if taken { range } else { before };
            leaves[lane] = if taken { leaf } else { holder };
            changed |= taken;
        }
        changed
    }
}

/// Rays of `set` that pass through a triangle.
#[inline(always)]
fn passing<W: Wide, const FROM_CENTRE: bool>(
    triangles: &Triangles,
    descent: &Descent<W, FROM_CENTRE>,
    leaf: u32,
    set: u32,
) -> u32 {
    let [u, v, along] = descent.axes;
    let narrow = &triangles.narrow[leaf as usize];
    let (across_u, across_v) = (narrow[u].to_array(), narrow[v].to_array());
    let depths = narrow[along].to_array();
    let depth = |corner: usize| descent.shifted(along, depths[corner]);
    let depths = [depth(0), depth(1), depth(2)];
    let [p, q] = descent.shear;
    let sheared = |axis: usize, shear: W, of: &[f32; 3], corner: usize| {
        descent.shifted(axis, of[corner]).minus(shear.times(depths[corner]))
    };
    let us =
        [sheared(u, p, &across_u, 0), sheared(u, p, &across_u, 1), sheared(u, p, &across_u, 2)];
    let vs =
        [sheared(v, q, &across_v, 0), sheared(v, q, &across_v, 1), sheared(v, q, &across_v, 2)];
    let area = |a: usize, b: usize| us[a].times(vs[b]).minus(us[b].times(vs[a]));
    let (a, b, c) = (area(1, 2), area(2, 0), area(0, 1));
    let zero = W::splat(0.0);
    let (least, most) = (a.least(b).least(c), a.most(b).most(c));
    let sure = zero.below(least) | most.below(zero);
    let outside = least.below(zero) & zero.below(most);
    let unsure = set & !(sure | outside);
    if unsure == 0 {
        return set & sure;
    }
    let mut wide = [[0.0; LANES]; 6];
    for corner in 0..3 {
        us[corner].store(&mut wide[corner]);
        vs[corner].store(&mut wide[3 + corner]);
    }
    set & (sure | settle(&wide, unsure))
}

/// Of the rays in `unsure`, those that pass; their u of three corners, then their v.
#[cold]
#[inline(never)]
fn settle(wide: &[Lanes<f32>; 6], unsure: u32) -> u32 {
    let mut passing = 0;
    for lane in (0..LANES).filter(|lane| unsure >> lane & 1 == 1) {
        let of = |first: usize| [wide[first][lane], wide[first + 1][lane], wide[first + 2][lane]];
        passing |= u32::from(passes_exactly(of(0), of(3))) << lane;
    }
    passing
}

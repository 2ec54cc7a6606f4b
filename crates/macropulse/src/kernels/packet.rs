//! Rays from one place, many at a time, down a hierarchy.
//!
//! Neighbouring rays enter nearly the same boxes: a packet of them descends as a beam. Rays of a
//! packet that point into different octants, or have another main axis, descend one after the
//! other, and so do rays that are no neighbours, each alone. Each ray meets what it would have met
//! alone, to the last bit.

use super::beam::{Aims, Descent};
use super::single::{Along, PutOff};
use super::tree::Tree;
use super::triangles::{Nearest, Triangles};
use super::wide::{LANES, Registers, SIDE, Task, fetch, on_level};

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

/// Boxes that wait during a descent, and where the beam enters them; kept between packets.
#[derive(Debug, Default)]
pub(crate) struct Waiting(Vec<PutOff>);

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
        on_level(Together { packet: self, waiting, tree: &triangles.tree, leaves: triangles });
    }

    /// Calls `visit` with each leaf whose box rays enter before their range, and with the set of
    /// these rays. It may shorten their ranges.
    pub(crate) fn visit(
        &mut self,
        tree: &Tree,
        waiting: &mut Waiting,
        visit: &mut dyn FnMut(&mut Self, u32, u32),
    ) {
        if tree.eights.is_empty() {
            return;
        }
        on_level(Together { packet: self, waiting, tree, leaves: Visits(visit) });
    }
}

/// The leaves of a hierarchy, for a packet that comes by.
pub(super) trait Leaves {
    /// Lets the rays of `set`, which are no neighbours, descend alone, if they are better off so;
    /// whether it has.
    #[inline(always)]
    fn meet_alone<R: Registers>(&mut self, _packet: &mut Packet, _set: u32) -> bool {
        false
    }

    /// Notes that a leaf may soon be met.
    #[inline(always)]
    fn fetch(&self, _leaf: u32) {}

    /// Lets the rays of `set` meet `leaf`; whether the range of any was shortened.
    fn meet<R: Registers, const FROM_CENTRE: bool>(
        &mut self,
        descent: &Descent<R, FROM_CENTRE>,
        packet: &mut Packet,
        leaf: u32,
        set: u32,
    ) -> bool;
}

/// Leaves that are met by a call.
struct Visits<'a>(&'a mut dyn FnMut(&mut Packet, u32, u32));

impl Leaves for Visits<'_> {
    #[inline(always)]
    fn meet<R: Registers, const FROM_CENTRE: bool>(
        &mut self,
        _: &Descent<R, FROM_CENTRE>,
        packet: &mut Packet,
        leaf: u32,
        set: u32,
    ) -> bool {
        (self.0)(packet, leaf, set);
        true
    }
}

/// A packet that is to descend a hierarchy.
struct Together<'a, L> {
    packet: &'a mut Packet,
    waiting: &'a mut Waiting,
    tree: &'a Tree,
    leaves: L,
}

impl<L: Leaves> Task for Together<'_, L> {
    /// Sends rays of the same octant and main axis down together.
    #[inline(always)]
    fn run<R: Registers>(&mut self) {
        let Self { packet, waiting, tree, leaves } = self;
        let Some(origin) = tree.local(packet.origin) else { return };
        let aims = Aims::of::<R>(packet, tree, origin);
        let mut rest = aims.entering::<R>(tree);
        if rest == 0 {
            return;
        }
        let spread = aims.spread::<R>(rest);
        if !spread.is_narrow() && leaves.meet_alone::<R>(packet, rest) {
            return;
        }
        while rest != 0 {
            let beam = aims.beam::<R>(rest, &spread);
            rest &= !beam.set;
            if waiting.0.len() < tree.room {
                waiting.0.resize(tree.room, Default::default());
            }
            let stack = &mut waiting.0[..];
            // From the centre, nothing has to be subtracted from anything.
            if origin == [0.0; 3] {
                Descent::<R, true>::new(&aims, tree, &beam).run(packet, stack, leaves);
            } else {
                Descent::<R, false>::new(&aims, tree, &beam).run(packet, stack, leaves);
            }
        }
    }
}

impl Leaves for &Triangles {
    #[inline(always)]
    fn meet_alone<R: Registers>(&mut self, packet: &mut Packet, set: u32) -> bool {
        for lane in (0..LANES).filter(|lane| set >> lane & 1 == 1) {
            let ray = (packet.origin, packet.along(lane));
            let between = (packet.nearest[lane], packet.range[lane]);
            let mut nearest = Nearest::of(self, ray, between);
            Along { tree: &self.tree, ray, between, leaves: &mut nearest }.run::<R>();
            if let Some(hit) = nearest.found() {
                (packet.range[lane], packet.leaf[lane]) = (hit.range, hit.leaf);
            }
        }
        true
    }

    #[inline(always)]
    fn fetch(&self, leaf: u32) {
        fetch(&self.blocks, leaf as usize);
    }

    /// Solves for the range of those that pass, and keeps what is nearer than before.
    #[inline(always)]
    fn meet<R: Registers, const FROM_CENTRE: bool>(
        &mut self,
        descent: &Descent<R, FROM_CENTRE>,
        packet: &mut Packet,
        leaf: u32,
        set: u32,
    ) -> bool {
        let block = &self.blocks[leaf as usize];
        let (near, _) = descent.may_enter(block.planes::<R>());
        let mut near = near & block.all();
        let mut soon = near;
        while soon != 0 {
            fetch(&self.corners, (block.first + soon.trailing_zeros()) as usize);
            soon &= soon - 1;
        }
        let mut changed = false;
        while near != 0 {
            let slot = near.trailing_zeros() as usize % SIDE;
            near &= near - 1;
            let passing = block.passed_by(descent, slot, set);
            if passing != 0 {
                changed |= self.shorten(packet, block.first + slot as u32, passing);
            }
        }
        changed
    }
}

//! Triangles that rays meet, and one ray among them.
//!
//! Which triangle a ray passes through is decided in `f32`, in a frame about the sensor so that nothing is
//! far from its origin. The test is the watertight one of \[WBW13\]. The corners are sheared so that the ray
//! becomes the depth axis. The sign of each edge is exact, so two triangles that share an edge can never both
//! miss a ray. The distance of the hit is then solved in `f64` on the plane of the triangle as it was
//! modelled.

use glam::{DVec3, Vec3A};

use super::beam::Descent;
use super::build::Built;
use super::packet::{Lanes, NONE, Packet};
use super::single::{Aim, Along, RayLeaves};
use super::tree::{Bounds, FARTHEST, Tree};
use super::wide::{LANES, Registers, SIDE, Wide, fetch, on_level};
use macropulse_codec::on_every_level;

/// The corners of a triangle, m.
pub(crate) type Corners = [[f64; 3]; 3];

/// Triangles and the hierarchy over them.
#[derive(Debug, Default)]
pub(crate) struct Triangles {
    pub(super) tree: Tree,
    /// The leaves.
    pub(super) blocks: Vec<Block>,
    /// The triangles as they were modelled, in the order of the leaves.
    pub(super) corners: Vec<Corners>,
}

/// Triangles side by side.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(32))]
pub(super) struct Block {
    /// Local; by axis, then by corner, then by triangle.
    corners: [[[f32; SIDE]; 3]; 3],
    /// The first of them, in the order of the leaves.
    pub first: u32,
    count: u32,
}

/// A triangle that a ray meets, and how far away.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Hit {
    pub range: f64,
    /// Index in the order of the leaves.
    pub leaf: u32,
}

impl Triangles {
    /// Builds the hierarchy of triangles with these `corners`, exact about `centre`. Gives it with
    /// the index that each leaf had; triangles without area or with a coordinate that is not finite
    /// cannot be hit and are left out.
    pub(crate) fn new(mut corners: Vec<Corners>, centre: [f64; 3]) -> (Self, Vec<u32>) {
        let can_be_hit =
            |(_, corners): &(u32, &Corners)| is_near(corners, centre) && has_area(corners);
        let boxes = (0..).zip(&corners).filter(can_be_hit).map(|(index, corners)| {
            let [a, b, c] = narrow(corners, centre).map(Vec3A::from_array);
            (index, Bounds { low: a.min(b).min(c), high: a.max(b).max(c) })
        });
        let Built { tree, order, ends } = Built::over(boxes, SIDE, centre);
        // The list in the old order is dropped here: no list of millions of triangles is kept longer than it
        // is needed.
        corners = order.iter().map(|index| corners[*index as usize]).collect();
        let mut first = 0;
        let block = |end: &u32| {
            let range = first as usize..*end as usize;
            let block = Block::new(first, &corners[range], centre);
            first = *end;
            block
        };
        let blocks = ends.iter().map(block).collect();
        (Self { tree, blocks, corners }, order)
    }

    /// Number of triangles that can be hit.
    pub(crate) fn len(&self) -> usize {
        self.corners.len()
    }

    /// The middle of an upright box that holds all, and half its size.
    pub(crate) fn middle_and_half(&self) -> ([f64; 3], [f64; 3]) {
        let corners = || self.corners.iter().flatten().map(|corner| DVec3::from(*corner));
        let low = corners().fold(DVec3::INFINITY, DVec3::min);
        let high = corners().fold(DVec3::NEG_INFINITY, DVec3::max);
        (((low + high) / 2.0).to_array(), ((high - low) / 2.0).to_array())
    }

    /// The unit normal of a leaf.
    pub(crate) fn normal(&self, leaf: u32) -> [f64; 3] {
        normal(&self.corners[leaf as usize])
    }

    /// The nearest triangle on a ray, given by origin and direction, with a range between the two;
    /// of two equally far the first leaf.
    pub(crate) fn nearest(&self, ray: ([f64; 3], [f64; 3]), between: (f64, f64)) -> Option<Hit> {
        let mut nearest = Nearest::of(self, ray, between);
        on_level(Along { tree: &self.tree, ray, between, leaves: &mut nearest });
        nearest.found()
    }

    /// Solves for the range of the rays in `passing`, and keeps what is nearer than before;
    /// whether any was.
    #[inline(always)]
    pub(super) fn shorten(&self, packet: &mut Packet, leaf: u32, passing: u32) -> bool {
        let plane = Plane::new(&self.corners[leaf as usize], packet.origin);
        let Packet { direction: [x, y, z], nearest, range: ranges, leaf: leaves, .. } = packet;
        let mut found = [0.0; LANES];
        for lane in 0..LANES {
            found[lane] = plane.crossing([x[lane], y[lane], z[lane]]);
        }
        if plane.is_edge_on {
            for lane in 0..LANES {
                found[lane] = plane.within_box([x[lane], y[lane], z[lane]], found[lane]);
            }
        }
        let mut changed = false;
        for lane in 0..LANES {
            let range = found[lane];
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

/// The nearest triangle on a ray so far.
pub(super) struct Nearest<'a> {
    triangles: &'a Triangles,
    ray: ([f64; 3], [f64; 3]),
    nearest: f64,
    best: Hit,
    found: bool,
}

impl<'a> Nearest<'a> {
    /// None yet, of `triangles` with a range in (`nearest`, `farthest`).
    pub(super) fn of(
        triangles: &'a Triangles,
        ray: ([f64; 3], [f64; 3]),
        (nearest, farthest): (f64, f64),
    ) -> Self {
        let best = Hit { range: farthest, leaf: 0 };
        Self { triangles, ray, nearest, best, found: false }
    }

    pub(super) fn found(self) -> Option<Hit> {
        self.found.then_some(self.best)
    }
}

impl RayLeaves for Nearest<'_> {
    #[inline(always)]
    fn fetch(&self, leaf: u32) {
        fetch(&self.triangles.blocks, leaf as usize);
    }

    #[inline(always)]
    fn meet<R: Registers, const FROM_CENTRE: bool>(
        &mut self,
        leaf: u32,
        aim: &Aim<FROM_CENTRE>,
    ) -> f64 {
        let block = &self.triangles.blocks[leaf as usize];
        let mut passed = block.passed::<R, FROM_CENTRE>(aim);
        while passed != 0 {
            let leaf = block.first + passed.trailing_zeros();
            passed &= passed - 1;
            let (origin, direction) = self.ray;
            let range = Plane::new(&self.triangles.corners[leaf as usize], origin).range(direction);
            let first = self.found && range == self.best.range && leaf < self.best.leaf;
            if range > self.nearest && (range < self.best.range || first) {
                (self.best, self.found) = (Hit { range, leaf }, true);
            }
        }
        self.best.range
    }
}

impl Block {
    /// Triangles with these corners; the first one is leaf number `first`.
    fn new(first: u32, triangles: &[Corners], centre: [f64; 3]) -> Self {
        let mut block =
            Self { corners: [[[0.0; SIDE]; 3]; 3], first, count: triangles.len() as u32 };
        for (slot, triangle) in triangles.iter().enumerate() {
            for (corner, place) in narrow(triangle, centre).iter().enumerate() {
                for axis in 0..3 {
                    block.corners[axis][corner][slot] = place[axis];
                }
            }
        }
        block
    }

    /// The set of its triangles.
    #[inline(always)]
    pub(super) fn all(&self) -> u32 {
        (1 << self.count) - 1
    }

    /// The low and the high planes of the boxes around its triangles, by axis.
    #[inline(always)]
    pub(super) fn planes<R: Registers>(&self) -> [[R::Boxes; 2]; 3] {
        [self.between::<R>(0), self.between::<R>(1), self.between::<R>(2)]
    }

    #[inline(always)]
    fn between<R: Registers>(&self, axis: usize) -> [R::Boxes; 2] {
        let [a, b, c] = &self.corners[axis];
        let (a, b, c) = (R::Boxes::load(a), R::Boxes::load(b), R::Boxes::load(c));
        [a.least(b).least(c), a.most(b).most(c)]
    }

    /// Its triangles that a ray passes through.
    #[inline(always)]
    fn passed<R: Registers, const FROM_CENTRE: bool>(&self, aim: &Aim<FROM_CENTRE>) -> u32 {
        let [u, v, along] = aim.axes;
        let [p, q] = aim.shear;
        let corners = [
            self.from::<R, FROM_CENTRE>(aim, u),
            self.from::<R, FROM_CENTRE>(aim, v),
            self.from::<R, FROM_CENTRE>(aim, along),
        ];
        holding_origin(self.all(), corners, [R::Boxes::splat(p), R::Boxes::splat(q)])
    }

    /// The corners of its triangles on an axis, from the start of a ray.
    #[inline(always)]
    fn from<R: Registers, const FROM_CENTRE: bool>(
        &self,
        aim: &Aim<FROM_CENTRE>,
        axis: usize,
    ) -> [R::Boxes; 3] {
        let [a, b, c] = &self.corners[axis];
        [
            aim.shifted(axis, R::Boxes::load(a)),
            aim.shifted(axis, R::Boxes::load(b)),
            aim.shifted(axis, R::Boxes::load(c)),
        ]
    }

    /// Rays of `set` that pass through one of its triangles.
    #[inline(always)]
    pub(super) fn passed_by<R: Registers, const FROM_CENTRE: bool>(
        &self,
        descent: &Descent<R, FROM_CENTRE>,
        slot: usize,
        set: u32,
    ) -> u32 {
        let [u, v, along] = descent.axes;
        let corners = [
            self.one_from(descent, u, slot),
            self.one_from(descent, v, slot),
            self.one_from(descent, along, slot),
        ];
        holding_origin(set, corners, descent.shear)
    }

    /// The corners of one of its triangles on an axis, from the start of rays.
    #[inline(always)]
    fn one_from<R: Registers, const FROM_CENTRE: bool>(
        &self,
        descent: &Descent<R, FROM_CENTRE>,
        axis: usize,
        slot: usize,
    ) -> [R::Rays; 3] {
        let [a, b, c] = &self.corners[axis];
        [
            descent.shifted(axis, R::Rays::splat(a[slot])),
            descent.shifted(axis, R::Rays::splat(b[slot])),
            descent.shifted(axis, R::Rays::splat(c[slot])),
        ]
    }
}

/// Lanes of `among` in which a line passes through a triangle, its edges and corners included, on either side.
///
/// Sheared, the ray is the origin of the plane (u, v), and the triangle holds it if it lies on the
/// same side of all three edges. The corners are given by their u, v and depth.
#[inline(always)]
fn holding_origin<const N: usize, W: Wide<N>>(
    among: u32,
    [mut u, mut v, depth]: [[W; 3]; 3],
    [p, q]: [W; 2],
) -> u32 {
    for corner in 0..3 {
        u[corner] = u[corner].minus(p.times(depth[corner]));
        v[corner] = v[corner].minus(q.times(depth[corner]));
    }
    // Twice the areas that the origin spans with the edges bc, ca, ab.
    let a = u[1].times(v[2]).minus(u[2].times(v[1]));
    let b = u[2].times(v[0]).minus(u[0].times(v[2]));
    let c = u[0].times(v[1]).minus(u[1].times(v[0]));
    let zero = W::splat(0.0);
    let (least, most) = (a.least(b).least(c), a.most(b).most(c));
    let sure = zero.below(least) | most.below(zero);
    let outside = least.below(zero) & zero.below(most);
    let unsure = among & !(sure | outside);
    if unsure == 0 {
        return among & sure;
    }
    let mut wide = [[0.0; N]; 6];
    for corner in 0..3 {
        u[corner].store(&mut wide[corner]);
        v[corner].store(&mut wide[3 + corner]);
    }
    among & sure | settle(&wide, unsure)
}

/// Returns the lanes in `unsure` that pass. `wide` has the u of three corners, then their v.
#[cold]
#[inline(never)]
fn settle<const N: usize>(wide: &[[f32; N]; 6], unsure: u32) -> u32 {
    let mut passing = 0;
    for lane in (0..N).filter(|lane| unsure >> lane & 1 == 1) {
        let of = |first: usize| [wide[first][lane], wide[first + 1][lane], wide[first + 2][lane]];
        passing |= u32::from(passes_exactly(of(0), of(3))) << lane;
    }
    passing
}

/// The same question where an area came out as zero.
///
/// Rounding a product is monotone, so the `f32` areas cannot have the wrong sign, only lose it.
/// The products of two `f32` are exact in `f64`, and so is the sign of their difference.
#[cold]
#[inline(never)]
fn passes_exactly(u: [f32; 3], v: [f32; 3]) -> bool {
    let (u, v) = (u.map(f64::from), v.map(f64::from));
    let area = |a: usize, b: usize| u[a] * v[b] - u[b] * v[a];
    let areas = [area(1, 2), area(2, 0), area(0, 1)];
    let left = areas.iter().all(|area| *area >= 0.0);
    let right = areas.iter().all(|area| *area <= 0.0);
    // All three zero: the triangle is seen edge-on, and its neighbours are hit instead.
    left != right
}

/// A triangle seen from a place.
struct Plane {
    normal: DVec3,
    /// The corners, from the place.
    corners: [DVec3; 3],
    /// n·(a−o)
    height: f64,
    /// True if the place is so near to the plane, relative to the distance of the corners, that the range of
    /// a ray from there is lost in rounding.
    is_edge_on: bool,
}

/// Largest distance of a place that is near to a plane, as a share of the distance of the corners. It is 10⁸
/// times its rounding error. Beyond it, the rounding error of a range is less than boxes are widened by.
const EDGE_ON: f64 = 1e-8;

impl Plane {
    #[inline(always)]
    fn new(corners: &Corners, origin: [f64; 3]) -> Self {
        let [a, b, c] = corners;
        let (a, b, c) = (DVec3::from(*a), DVec3::from(*b), DVec3::from(*c));
        let (one, other) = (b - a, c - a);
        let normal = one.cross(other);
        let origin = DVec3::from(origin);
        let corners = [a - origin, b - origin, c - origin];
        let height = normal.dot(corners[0]);
        // The normal of a needle is lost in rounding as well: the sides tell how large it may be.
        let (one, other) = (one.length_squared(), other.length_squared());
        let reach = corners[0].length_squared() + one + other;
        let is_edge_on = height * height <= EDGE_ON * EDGE_ON * one * other * reach;
        Self { normal, corners, height, is_edge_on }
    }

    /// Returns the range at which a ray from the place that passes through the triangle meets it.
    #[inline(always)]
    fn range(&self, direction: [f64; 3]) -> f64 {
        let range = self.crossing(direction);
        if self.is_edge_on { self.within_box(direction, range) } else { range }
    }

    /// `range`, kept to where a ray from the place is in the box around the triangle; where it enters, if `range`
    /// is NaN.
    #[cold]
    #[inline(never)]
    fn within_box(&self, direction: [f64; 3], range: f64) -> f64 {
        let [a, b, c] = &self.corners;
        let (low, high) = (a.min(*b).min(*c).to_array(), a.max(*b).max(*c).to_array());
        let (mut enter, mut leave) = (f64::NEG_INFINITY, f64::INFINITY);
        for axis in (0..3).filter(|axis| direction[*axis] != 0.0) {
            let [one, other] = [low, high].map(|bound| bound[axis] / direction[axis]);
            enter = enter.max(one.min(other));
            leave = leave.min(one.max(other));
        }
        range.max(enter).min(leave)
    }

    /// Returns the range at which a ray from the place meets the plane; NaN if it does not.
    ///
    /// `t = n·(a−o) / n·d`, kept within the depths of the three corners.
    #[inline(always)]
    fn crossing(&self, direction: [f64; 3]) -> f64 {
        let along = DVec3::from(direction);
        let [a, b, c] = &self.corners;
        let (a, b, c) = (a.dot(along), b.dot(along), c.dot(along));
        let least = |a: f64, b: f64| if a < b { a } else { b };
        let most = |a: f64, b: f64| if a > b { a } else { b };
        let (front, back) = (least(least(a, b), c), most(most(a, b), c));
        let range = self.height / self.normal.dot(along);
        // Unlike `clamp`, this lets NaN through.
        if range < front {
            front
        } else if range > back {
            back
        } else {
            range
        }
    }
}

/// The unit normal of a triangle with area.
#[inline(always)]
pub(super) fn normal([a, b, c]: &Corners) -> [f64; 3] {
    let (a, b, c) = (DVec3::from(*a), DVec3::from(*b), DVec3::from(*c));
    let normal = (b - a).cross(c - a);
    (normal * (1.0 / normal.length())).to_array()
}

/// The corners from `centre`, as boxes and rays have them.
#[inline(always)]
fn narrow(corners: &Corners, centre: [f64; 3]) -> [[f32; 3]; 3] {
    corners.map(|corner| (DVec3::from(corner) - DVec3::from(centre)).as_vec3().to_array())
}

fn is_near(corners: &Corners, centre: [f64; 3]) -> bool {
    corners
        .iter()
        .all(|corner| (DVec3::from(*corner) - DVec3::from(centre)).abs().max_element() < FARTHEST)
}

fn has_area([a, b, c]: &Corners) -> bool {
    let [a, b, c] = [a, b, c].map(|corner| DVec3::from(*corner));
    let area = (b - a).cross(c - a).length();
    area > 0.0 && area.is_finite()
}

/// |cos| of the angle between a direction and a normal.
#[inline(always)]
fn cosine(direction: [f64; 3], normal: [f64; 3]) -> f32 {
    let dot = DVec3::from(direction).dot(DVec3::from(normal)).abs();
    (if dot < 1.0 { dot } else { 1.0 }) as f32
}

on_every_level! {
    /// The unit normals of the triangles that a packet has met, by axis; anything for rays that
    /// have met none.
    pub(crate) fn normals(triangles: &Triangles, packet: &Packet) -> [Lanes<f64>; 3] {
        let mut gathered = [[[0.0; LANES]; 3]; 3];
        for lane in 0..LANES {
            if let Some(corners) = triangles.corners.get(packet.leaf[lane] as usize) {
                for corner in 0..3 {
                    for axis in 0..3 {
                        gathered[corner][axis][lane] = corners[corner][axis];
                    }
                }
            }
        }
        let [a, b, c] = &gathered;
        let mut normals = [[0.0; LANES]; 3];
        for lane in 0..LANES {
            let corner = |of: &[Lanes<f64>; 3]| [of[0][lane], of[1][lane], of[2][lane]];
            let normal = normal(&[corner(a), corner(b), corner(c)]);
            for axis in 0..3 {
                normals[axis][lane] = normal[axis];
            }
        }
        normals
    }
}

on_every_level! {
    /// |cos| of the angles between the rays of a packet and a normal for each.
    pub(crate) fn cosines(packet: &Packet, normals: &[Lanes<f64>; 3]) -> Lanes<f32> {
        let mut cosines = [0.0; LANES];
        for lane in 0..LANES {
            let normal = [normals[0][lane], normals[1][lane], normals[2][lane]];
            cosines[lane] = cosine(packet.along(lane), normal);
        }
        cosines
    }
}

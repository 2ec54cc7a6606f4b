//! Measurement against truth: the only stage that sees both sides.

mod edge;
mod ghosts;
mod interval;
mod range_error;

pub use ghosts::ghosts;
pub use interval::Estimate;
pub use range_error::RangeError;

use crate::design::Design;
use crate::points::{Outcome, Piece, Surface};
use crate::scene::{Scene, Traced};
use edge::edge;
use macropulse_codec::ShotLog;

/// A return this far from the truth still comes from the right macropulse, m: code sidelobes lie
/// within one bit.
pub const NEAR: f64 = 0.35;

/// How many pixels came out how, each by the return that its image shows.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Score {
    /// Pixels by outcome, in the order of [`Outcome::ALL`].
    pub pixels: [u64; Outcome::ALL.len()],
    /// Pixels with a surface whose shot carried no light, because its payload has no 1 bit. They
    /// come out as missed, but there was no echo to decode.
    pub dark: u64,
    /// Pixels whose ray meets the target object within the range gate.
    pub samples_on_target: u64,
    /// Pixels whose return comes from a surface of the target object.
    pub points_on_target: u64,
    /// Second and later returns of all shots by outcome, in the order of [`Outcome::ALL`]; each is
    /// judged against all surfaces along its beam.
    #[serde(default)]
    pub further: [u64; Outcome::ALL.len()],
    /// Wrong and false returns that light of other lidars has made, as [`ghosts()`] has it.
    pub ghosts: u64,
}

impl Score {
    /// Pixels that came out as `outcome`.
    pub fn count(&self, outcome: Outcome) -> u64 {
        self.pixels[outcome as usize]
    }

    /// Second and later returns that came out as `outcome`.
    pub fn count_further(&self, outcome: Outcome) -> u64 {
        self.further[outcome as usize]
    }

    /// Pixels with an echo of their own: a surface within the range gate, and a shot with light.
    /// Those that came out as an edge do not count: they are neither right nor wrong.
    pub fn with_echo(&self) -> u64 {
        let with_surface = [Outcome::Right, Outcome::Near, Outcome::Wrong, Outcome::Missed];
        with_surface.map(|outcome| self.count(outcome)).iter().sum::<u64>() - self.dark
    }

    /// Right pixels as a fraction of those that have an echo; NaN if none has.
    pub fn right_fraction(&self) -> f64 {
        self.count(Outcome::Right) as f64 / self.with_echo() as f64
    }

    /// The sum over several scans.
    pub fn add(&mut self, other: &Self) {
        self.pixels.iter_mut().zip(other.pixels).for_each(|(sum, more)| *sum += more);
        self.dark += other.dark;
        self.samples_on_target += other.samples_on_target;
        self.points_on_target += other.points_on_target;
        self.ghosts += other.ghosts;
        self.further.iter_mut().zip(other.further).for_each(|(sum, more)| *sum += more);
    }
}

/// Compares the returns of a band with what its owned shots met, and writes the truth beside them.
///
/// A return is right if any surface along its beam lies within the sensor's tolerance: behind glass there are
/// several. If the mirror moves during a macropulse, a part of the macropulse may meet a surface that its
/// middle misses: a return from there is an edge. The truth written is that of the surface the return came
/// from; of the first one met where none fits. A pixel comes out as the return does that its image shows.
pub fn judge(
    piece: &mut Piece,
    design: &Design,
    scene: &Scene,
    log: &ShotLog,
    traced: &Traced,
) -> Score {
    let mut score = Score::default();
    let hits = &traced.middle;
    let gates = design.scan.gates();
    let mut next = hits.shot.partition_point(|&shot| (shot as usize) < log.owned.start);
    let mut at = 0;
    let outcome = |error: Option<f64>| match error.map(f64::abs) {
        None => Outcome::False,
        Some(error) if error <= design.right_within => Outcome::Right,
        Some(error) if error <= NEAR => Outcome::Near,
        Some(_) => Outcome::Wrong,
    };
    piece.points.truth.pixels.blank(log.owned.len());
    piece.points.truth.returns.blank(piece.shot.len());
    let approaches = |i: Option<usize>| i.and_then(|i| hits.radial_velocity.get(i)).copied();
    let mut velocities = std::mem::take(&mut piece.points.truth.radial_velocity);
    for shot in log.owned.clone() {
        let first = next;
        while next < hits.shot.len() && hits.shot[next] as usize == shot {
            next += 1;
        }
        let is_silent = piece.shot.get(at).is_none_or(|&of| of as usize != shot);
        if first == next && is_silent {
            score.pixels[Outcome::Empty as usize] += 1;
            continue;
        }
        let gate = gates.of(log.row[shot]);
        let met = (first..next).filter(|&i| gate.contains(&hits.range[i]));
        let surface = |i: Option<usize>, outcome: Outcome| match i {
            None => Surface { outcome, ..Surface::NONE },
            Some(i) => edge::surface(hits, i, outcome),
        };
        let on_target = |i: usize| scene.objects[usize::from(hits.object[i])].is_target;
        let pixel = shot - log.owned.start;
        let follows = piece.shot.get(at + 1).is_some_and(|&of| of as usize == shot);
        if next == first + 1 && !is_silent && !follows && gate.contains(&hits.range[first]) {
            // One surface and one return, as nearly always: the steps below come to this.
            let measured = f64::from(piece.points.range[at]);
            let judged = surface(Some(first), outcome(Some(hits.range[first] - measured)));
            let judged = edge(judged, traced, shot, (&gate, measured));
            let is_on_target = on_target(first);
            let answered = matches!(judged.outcome, Outcome::Right | Outcome::Near);
            piece.points.truth.returns.set(at, judged);
            velocities.extend(approaches(Some(first)));
            piece.points.truth.pixels.outcome[pixel] = judged.outcome;
            score.samples_on_target += u64::from(is_on_target);
            score.points_on_target += u64::from(is_on_target && answered);
            score.pixels[judged.outcome as usize] += 1;
            at += 1;
            continue;
        }
        score.samples_on_target += u64::from(met.clone().any(on_target));
        // The return shown, its outcome, and whether it comes from the target.
        let mut shown: Option<(usize, Outcome, bool)> = None;
        while at < piece.shot.len() && piece.shot[at] as usize == shot {
            let measured = f64::from(piece.points.range[at]);
            let error = |i: usize| (hits.range[i] - measured).abs();
            let nearest = met.clone().min_by(|&a, &b| error(a).total_cmp(&error(b)));
            let outcome = outcome(nearest.map(error));
            let answered = matches!(outcome, Outcome::Right | Outcome::Near);
            let source = if answered { nearest } else { met.clone().next() };
            let judged = edge(surface(source, outcome), traced, shot, (&gate, measured));
            let outcome = judged.outcome;
            piece.points.truth.returns.set(at, judged);
            if design.emission.model().sees_motion() {
                velocities.push(approaches(source).unwrap_or(f32::NAN));
            }
            let points = &piece.points;
            let is_further = points.return_number[at] > 1;
            score.further[outcome as usize] += u64::from(is_further);
            let is_better =
                |shown: usize| points.pick.prefers(points.strength(at), points.strength(shown));
            if shown.is_none_or(|(shown, ..)| is_better(shown)) {
                shown = Some((at, outcome, answered && source.is_some_and(on_target)));
            }
            at += 1;
        }
        let first = met.clone().next();
        let outcome = match (shown, first) {
            (Some((_, outcome, _)), _) => outcome,
            (None, None) => Outcome::Empty,
            (None, Some(_)) => Outcome::Missed,
        };
        let pixels = &mut piece.points.truth.pixels;
        match outcome {
            Outcome::Empty => {}
            Outcome::Missed => pixels.set(pixel, surface(first, outcome)),
            // The surface of a return stands beside the return.
            _ => pixels.outcome[pixel] = outcome,
        }
        score.points_on_target += u64::from(shown.is_some_and(|(.., on_target)| on_target));
        let is_dark =
            || design.emission.coding().codebook.marks(log.label[shot], log.word[shot]).is_empty();
        score.dark += u64::from(outcome == Outcome::Missed && is_dark());
        score.pixels[outcome as usize] += 1;
    }
    piece.points.truth.radial_velocity = velocities;
    score
}

//! Measurement against truth: the only stage that sees both sides.

mod ghosts;
mod interval;
mod range_error;

pub use ghosts::ghosts;
pub use interval::Estimate;
pub use range_error::RangeError;

use crate::design::Design;
use crate::points::{NO_OBJECT, Outcome, PointCloud, Truth};
use crate::scene::{Hits, Scene};
use macropulse_codec::ShotLog;

/// A return this far from the truth still comes from the right macropulse, m: code sidelobes lie
/// within one bit.
pub const NEAR: f64 = 0.35;

/// How many pixels came out how.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Score {
    /// Pixels by outcome, in the order of [`Outcome::ALL`].
    pub pixels: [u64; 6],
    /// Pixels with a surface whose shot carried no light, because its payload has no 1 bit. They
    /// come out as missed, but there was no echo to decode.
    pub dark: u64,
    /// Pixels whose ray meets the target object within the range gate.
    pub samples_on_target: u64,
    /// Returns that come from a surface of the target object.
    pub points_on_target: u64,
    /// Wrong and false returns that light of other lidars has made, as [`ghosts`] has it.
    pub ghosts: u64,
}

impl Score {
    /// Pixels that came out as `outcome`.
    pub fn count(&self, outcome: Outcome) -> u64 {
        self.pixels[outcome as usize]
    }

    /// Pixels that have an echo: a surface within the range gate, and a shot with light.
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
    }
}

/// Room for the truth of every pixel of `cloud`.
pub fn empty_truth(cloud: &PointCloud) -> Truth {
    let pixels = cloud.rows * cloud.columns;
    Truth {
        range: vec![f32::NAN; pixels],
        object: vec![NO_OBJECT; pixels],
        material: vec![NO_OBJECT; pixels],
        cosine: vec![f32::NAN; pixels],
        outcome: vec![Outcome::Empty; pixels],
    }
}

/// Compares the returns already in `cloud` with what the owned shots of a band met, and writes the
/// truth beside them.
///
/// A return is right if any surface along its beam lies within the sensor's tolerance: behind
/// glass there are several. The truth written is that of the surface the return came from; of the
/// first one met where there is no return, or none that fits.
pub fn judge(
    cloud: &mut PointCloud,
    design: &Design,
    scene: &Scene,
    log: &ShotLog,
    hits: &Hits,
) -> Score {
    let mut score = Score::default();
    let gate = design.scan.min_range..=design.scan.max_range;
    let mut next = hits.shot.partition_point(|&shot| (shot as usize) < log.owned.start);
    for shot in log.owned.clone() {
        let first = next;
        while next < hits.shot.len() && hits.shot[next] as usize == shot {
            next += 1;
        }
        let pixel = cloud.pixel(log, shot);
        let met = (first..next).filter(|&i| gate.contains(&hits.range[i]));
        let measured = f64::from(cloud.range[pixel]);
        let error = |i: usize| (hits.range[i] - measured).abs();
        let nearest = met.clone().min_by(|&a, &b| error(a).total_cmp(&error(b)));
        let on_target = |i: usize| scene.objects[usize::from(hits.object[i])].is_target;
        if met.clone().any(on_target) {
            score.samples_on_target += 1;
        }
        let outcome = match nearest {
            None if measured.is_nan() => Outcome::Empty,
            None => Outcome::False,
            Some(_) if measured.is_nan() => Outcome::Missed,
            Some(i) if error(i) <= design.right_within => Outcome::Right,
            Some(i) if error(i) <= NEAR => Outcome::Near,
            Some(_) => Outcome::Wrong,
        };
        let answered = matches!(outcome, Outcome::Right | Outcome::Near);
        let source = if answered { nearest } else { met.clone().next() };
        if let Some(i) = source {
            score.points_on_target += u64::from(answered && on_target(i));
            cloud.truth.range[pixel] = hits.range[i] as f32;
            cloud.truth.object[pixel] = hits.object[i];
            cloud.truth.material[pixel] = hits.material[i];
            cloud.truth.cosine[pixel] = hits.cosine[i];
        }
        let is_dark = || design.coding.codebook.marks(log.label[shot], log.word[shot]).is_empty();
        score.dark += u64::from(outcome == Outcome::Missed && is_dark());
        cloud.truth.outcome[pixel] = outcome;
        score.pixels[outcome as usize] += 1;
    }
    score
}

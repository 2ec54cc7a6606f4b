//! The places of an aperture at which an eye gets most light: each rule allows least there.
//!
//! Each rule has a worst place of its own: the shots that count as one may come from two lasers, the mean
//! power from all of them. The place is searched for in elevation and azimuth, and at each place every rule
//! looks for its worst time.
//!
//! 1. Places are tried an eighth of the aperture apart, coarse steps first.
//! 2. If few beams cross at once, places that two of them share are tried as well: these may be too small for
//!    a grid.
//! 3. The best places of each rule are refined in steps that are halved.
//! 4. From each of these, places nearby are tried that one more beam grazes: it brings next to no light, but counts as
//!    an exposure, which C5 takes account of.
//!
//! The search finds the light at real places, so it can only miss light: it may allow more than the worst
//! place there is. `brute.rs` holds it against a grid, to 2 %.

use super::exposure::{Crossing, RULES};

/// Places tried along the width of the light that passes an aperture, to begin with.
const STEPS: f64 = 8.0;
/// Places of each rule that are refined.
const FINALISTS: usize = 6;
/// Times the steps are halved by which a place is refined.
const HALVINGS: u32 = 4;
/// Moves by steps of one length.
const MOVES: u32 = 3;
/// Steps to the right on a way around a place in eighths of a turn, and with two eighths more, upwards.
const SIDES: [f64; 8] = [0.0, 1.0, 1.0, 1.0, 0.0, -1.0, -1.0, -1.0];
/// Places that are tried in any case.
const LEAST: usize = 3;

/// Direction of the middle of an aperture, rad.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Aim {
    pub azimuth: f64,
    pub elevation: f64,
}

impl Aim {
    /// The aim so far `aside` and `up` of this one, rad.
    pub fn moved(self, [aside, up]: [f64; 2]) -> Self {
        Self { azimuth: self.azimuth + aside, elevation: self.elevation + up }
    }
}

/// The beams of a scan.
pub(super) trait Field {
    /// The shots that cross an aperture with its middle at `aim`, in the order of their times.
    fn crossing(&self, aim: Aim) -> Vec<Crossing>;

    /// Places to begin with, about `gap` radians apart, the most telling first. Shots within `counted`
    /// seconds count as one.
    fn starts(&self, gap: f64, counted: f64) -> Vec<Aim>;

    /// Places that two beams cross. One of the two is from a selection spread evenly over the scan, the other
    /// is any. There is no such place if an aperture holds many beams: light hardly depends on the place
    /// then.
    fn shared(&self) -> Vec<Aim>;

    /// Places `gap` from `aim` at most that one more beam just crosses; none where many beams cross.
    fn grazed(&self, aim: Aim, gap: f64) -> Vec<Aim>;

    /// Azimuths to try at the best elevations of these places; empty where they had all of interest.
    fn across(&self, gap: f64) -> Vec<f64>;

    /// Steps in azimuth and elevation by which places are refined at first, rad; 0 where that makes no
    /// difference.
    fn pitch(&self, gap: f64) -> [f64; 2];

    /// Shots that may be looked at. With more of them at a place, light hardly depends on the place, and
    /// fewer places are tried.
    fn effort(&self) -> usize;
}

/// The shots that cross at the worst place of each rule. Light that passes an aperture is `width` radians wide,
/// and shots within `counted` seconds count as one. `judge` tells what energy each rule allows to the shots that
/// cross at one place, infinite where it does not apply.
pub(super) fn worst(
    field: &dyn Field,
    (width, counted): (f64, f64),
    judge: &dyn Fn(&[Crossing]) -> [f64; RULES],
) -> Vec<Vec<Crossing>> {
    let gap = width / STEPS;
    let pitch = field.pitch(gap);
    let mut search = Search { field, judge, spent: 0, tried: Vec::new() };
    for aim in field.starts(gap, counted) {
        if search.tried.len() >= LEAST && search.spent > field.effort() / 2 {
            break;
        }
        search.at(aim);
    }
    let shared = coarse_first(&field.shared());
    if !shared.is_empty() {
        // A place that few beams cross takes little time: these have an effort of their own, and so has what
        // follows.
        search.spent = 0;
        for aim in shared {
            if search.spent > field.effort() {
                break;
            }
            search.at(aim);
        }
        search.spent = 0;
    }
    let mut elevations: Vec<f64> = Vec::new();
    for (_, Aim { elevation, .. }) in (0..RULES).filter_map(|rule| search.best(rule)) {
        if elevations.iter().all(|other| (other - elevation).abs() > pitch[1]) {
            elevations.push(elevation);
        }
    }
    for azimuth in field.across(gap) {
        for &elevation in &elevations {
            if search.spent < field.effort() / 4 * 3 {
                search.at(Aim { azimuth, elevation });
            }
        }
    }
    let mut refined = Vec::new();
    for rule in 0..RULES {
        let finalists = search.finalists(rule, pitch).into_iter();
        refined.extend(finalists.map(|best| (rule, search.refine(rule, best, pitch))));
    }
    refined.into_iter().for_each(|(rule, best)| search.graze(rule, best, gap));
    let mut aims: Vec<Aim> = Vec::new();
    for (_, aim) in (0..RULES).filter_map(|rule| search.best(rule)) {
        if !aims.contains(&aim) {
            aims.push(aim);
        }
    }
    aims.into_iter().map(|aim| field.crossing(aim)).collect()
}

/// Places in an order in which any number of the first ones lie about evenly among all of them.
pub(super) fn coarse_first<T: Copy>(all: &[T]) -> Vec<T> {
    let level = |place: usize| place.trailing_zeros().min(4);
    let of_level = |wanted: u32| (0..all.len()).filter(move |place| level(*place) == wanted);
    (0..=4).rev().flat_map(of_level).map(|place| all[place]).collect()
}

/// The places tried so far.
struct Search<'a> {
    field: &'a dyn Field,
    judge: &'a dyn Fn(&[Crossing]) -> [f64; RULES],
    /// Shots looked at.
    spent: usize,
    tried: Vec<([f64; RULES], Aim)>,
}

impl Search<'_> {
    /// Tries `aim`. Returns the energy that each rule allows there.
    fn at(&mut self, aim: Aim) -> [f64; RULES] {
        let shots = self.field.crossing(aim);
        // A place where nothing crosses takes some time, too.
        self.spent += shots.len() + 10;
        let allowed = (self.judge)(&shots);
        self.tried.push((allowed, aim));
        allowed
    }

    /// The least that `rule` allows, and where; `None` where it does not apply.
    fn best(&self, rule: usize) -> Option<(f64, Aim)> {
        let energies = self.tried.iter().map(|(allowed, aim)| (allowed[rule], *aim));
        energies.filter(|(energy, _)| energy.is_finite()).min_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// The places at which `rule` allows least, apart from each other.
    fn finalists(&self, rule: usize, pitch: [f64; 2]) -> Vec<(f64, Aim)> {
        let mut all: Vec<(f64, Aim)> =
            self.tried.iter().map(|(allowed, aim)| (allowed[rule], *aim)).collect();
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut chosen: Vec<(f64, Aim)> = Vec::new();
        for (energy, aim) in all {
            let is_near = |other: &(f64, Aim)| {
                (other.1.azimuth - aim.azimuth).abs() < 2.5 * pitch[0]
                    && (other.1.elevation - aim.elevation).abs() < 2.5 * pitch[1]
            };
            if chosen.len() == FINALISTS || !energy.is_finite() {
                break;
            }
            if !chosen.iter().any(is_near) {
                chosen.push((energy, aim));
            }
        }
        chosen
    }

    /// Goes from a place to the worst of those that one more beam grazes, as long as `rule` allows less there.
    fn graze(&mut self, rule: usize, mut best: (f64, Aim), gap: f64) {
        while self.spent <= 2 * self.field.effort() {
            let places = self.field.grazed(best.1, gap).into_iter();
            let allowed = places.map(|aim| (self.at(aim)[rule], aim));
            let least = allowed.min_by(|a, b| a.0.total_cmp(&b.0));
            match least.filter(|least| least.0 < best.0) {
                Some(least) => best = least,
                None => return,
            }
        }
    }

    /// Goes from a place to neighbours at which `rule` allows less, in steps that are halved. Returns the last one.
    fn refine(&mut self, rule: usize, mut best: (f64, Aim), pitch: [f64; 2]) -> (f64, Aim) {
        let mut steps = pitch;
        for _ in 0..HALVINGS {
            for _ in 0..MOVES {
                let from = best.1;
                for side in 0..8 {
                    let [across, up] = [SIDES[side], SIDES[(side + 2) % 8]];
                    if across != 0.0 && steps[0] <= 0.0 || self.spent > self.field.effort() {
                        continue;
                    }
                    let aim = from.moved([across * steps[0], up * steps[1]]);
                    let energy = self.at(aim)[rule];
                    if energy < best.0 {
                        best = (energy, aim);
                    }
                }
                if best.1 == from {
                    break;
                }
            }
            steps = steps.map(|step| step / 2.0);
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_number_of_first_places_lies_evenly_among_all() {
        let all: Vec<usize> = (0..100).collect();
        let order = coarse_first(&all);
        assert_eq!(order[..7], [0, 16, 32, 48, 64, 80, 96]);
        let mut sorted = order;
        sorted.sort_unstable();
        assert_eq!(sorted, all);
    }
}

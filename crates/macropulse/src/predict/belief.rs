//! Closed form of the thorough matched receiver's findings in ticks.
//!
//! It believes in a shot if evidence and prior reach a threshold, [`belief`]. A shot has N marks; k ~ Bin(N,
//! p) are lit. All shots meet the same range. Two things depend on which other shots are found:
//!
//! * **Neighbours.** A return beside a shot makes its lag likelier. With F, the share of all shots that are fuller and
//!   found, one of the M shots that are asked is a neighbour with the probability 1 − (1 − F)^M.
//! * **Light of other shots** in the gate is explained if they are fuller and found. The rest of it is chance, as noise is.
//!
//! So the shots are taken in the order of their fullness, as the receiver judges them.

use std::collections::BTreeMap;

use macropulse_codec::ShotLog;
use macropulse_codec::decode::belief::{self, Marks, Prior, Surroundings};
use macropulse_codec::decode::{self, Correlation};
use macropulse_codec::statistics::{binomial, poisson_from};

use super::best_lag::BestLag;
use super::matched::{Chances, Lone, Place};
use crate::design::{Design, SHOTS_OF_BAND};
use crate::units::s_from_fs;

/// Share of all shots that are gone through at once, at most.
const PART: f64 = 0.02;

/// Share of all shots that stand at the edges of a scan, where there is no light of other shots. If shots are found there,
/// neighbours lead on to those that light of others would hide.
const AT_EDGES: f64 = 1e-2;

/// Fullnesses with a smaller share of the shots do not count.
const SELDOM: f64 = 1e-9;

/// Fewest ticks of a lump: if all shots have the same number of marks, ticks are more even than Poisson's law
/// has them.
const SMALLEST_LUMP: f64 = 0.1;

/// A larger number of lumps is taken as normally distributed.
const MANY_LUMPS: f64 = 100.0;

/// Numbers of ticks that stand for all that Poisson's law gives.
const NODES: usize = 12;

/// The surroundings of the shots of a sensor, and the numbers that the rule of belief takes.
struct Gate {
    /// Ticks that the light of a shot takes up.
    length: f64,
    /// Places in which all light of a shot may be.
    places: f64,
    /// Ticks of a place, and ticks about a mark that are not counted for surroundings.
    ticks: f64,
    zone: f64,
    /// Share of ticks that are false.
    false_ticks: f64,
    /// Ticks of a mark of its own beside the one for which its place counts as lit, on average.
    surplus: f64,
    /// Other shots whose light is in a gate and in a macropulse, on average.
    others: [f64; 2],
    /// Evidence that a shot needs without a neighbour, and with one.
    needed: [f64; 2],
}

/// Shots that are as full as each other.
struct Level {
    /// Their marks, and how many are lit.
    marks: u32,
    lit: u32,
    /// Their share of all shots.
    share: f64,
}

impl Level {
    fn fullness(&self) -> f64 {
        f64::from(self.lit) / f64::from(self.marks)
    }
}

/// Ticks of a shot that no return explains.
struct Hidden {
    mean: f64,
    /// Mean of the square of their number.
    mean_square: f64,
}

impl Hidden {
    /// All ticks of the shots of all `levels`.
    fn of(levels: &[Level]) -> Self {
        let mut all = Self { mean: 0.0, mean_square: 0.0 };
        levels.iter().for_each(|level| all.explain(level, -level.share));
        all
    }

    /// Explains those of so large a `share` of the shots, which are of this `level`.
    fn explain(&mut self, level: &Level, share: f64) {
        let lit = f64::from(level.lit);
        self.mean -= share * lit;
        self.mean_square -= share * lit * lit;
    }

    fn variance(&self) -> f64 {
        (self.mean_square - self.mean * self.mean).max(0.0)
    }
}

/// Shots that meet the same range.
pub(super) struct Shots<'a> {
    /// Number of labels by their number of marks.
    pub weights: &'a BTreeMap<usize, usize>,
    /// Shots that may lead to expect light of one, on average.
    pub neighbours: f64,
    /// Ticks after which light comes.
    pub lag: i64,
    /// How often marks are seen there.
    pub seen: BestLag,
    /// Probability that a place is lit by what is no shot's light.
    pub false_density: f64,
}

/// Shots that may lead the matched receiver to expect light of one, on average.
pub(super) fn neighbours(design: &Design) -> f64 {
    let pattern = design.scan.model();
    let shots = design.shots_per_scan().min(SHOTS_OF_BAND);
    let unknown = vec![0; shots as usize];
    let mut log = ShotLog { label: unknown.clone(), word: unknown, ..ShotLog::default() };
    log.fired_at_fs = vec![0; shots as usize];
    for order in 0..shots {
        let (row, column) = pattern.pixel(order);
        log.row.push(row);
        log.column.push(column);
        log.channel.push(pattern.channel_of(order, row));
    }
    decode::neighbours(&log)
}

/// The findings for `shots`.
pub(super) fn chances(design: &Design, correlation: &Correlation, shots: &Shots) -> Chances {
    let weights = shots.weights;
    let mut levels = Vec::new();
    let labels: usize = weights.values().sum();
    for (&marks, &count) in weights {
        let of_label = count as f64 / labels as f64;
        for (lit, chance) in (0..).zip(binomial(marks, shots.seen.share(marks as f64))) {
            let share = of_label * chance;
            if lit > 0 && share > SELDOM {
                levels.push(Level { marks: marks as u32, lit, share });
            }
        }
    }
    levels.sort_by(|one, other| other.fullness().total_cmp(&one.fullness()));
    let gate = Gate::of(design, correlation, shots);
    let mut hidden = Hidden::of(&levels);
    let (mut pd, mut share_found): (f64, f64) = (0.0, 0.0);
    let (mut lone, mut lone_found) = (0.0, 0.0);
    let nothing = Hidden { mean: 0.0, mean_square: 0.0 };
    for level in levels {
        let is_first = pd < AT_EDGES && gate.believed(&level, &nothing)[0] > 0.0;
        let at_edges = if is_first { AT_EDGES } else { 0.0 };
        // As full ones are judged one after the other, too.
        let parts = (level.share / PART).ceil();
        for _ in 0..parts as u32 {
            let [alone, beside] = gate.believed(&level, &hidden);
            let others = pd.clamp(at_edges, 1.0);
            let neighbour = 1.0 - libm::pow(1.0 - others, shots.neighbours);
            let believed = level.share / parts * (alone + (beside - alone) * neighbour);
            pd += believed;
            share_found += believed * level.fullness();
            let without = level.share / parts * alone * (1.0 - neighbour);
            lone += without;
            lone_found += without * level.fullness();
            hidden.explain(&level, believed);
        }
    }
    let of = |sum: f64, all: f64| if all > 0.0 { sum / all } else { 0.0 };
    let lone = Lone { share: of(lone, pd), found: of(lone_found, lone) };
    let (found, false_per_shot) = (of(share_found, pd), correlation.false_alarm);
    Chances { pd: pd.min(1.0), false_per_shot, found, lone }
}

impl Gate {
    fn of(design: &Design, correlation: &Correlation, shots: &Shots) -> Self {
        let Design { receiver, emission, scan, clock, .. } = design;
        let chips = i64::from(emission.coding().codebook.chips());
        let macropulse = chips * i64::from(correlation.ticks_per_chip);
        let lags = receiver.lags_of_light(correlation, macropulse);
        let ticks = Place::ticks(design);
        let length = macropulse as f64 + ticks - 1.0;
        let places = (lags.end - lags.start) as f64 + length;
        let period = scan.shortest_period() / s_from_fs(clock.tick_fs);
        let others = [places, length].map(|time| (time / period - 1.0).max(0.0));
        let threshold = belief::threshold(correlation.false_alarm);
        let prior = |beside: &[i64]| libm::exp(Prior::new(lags.clone(), beside).at(shots.lag));
        let [alone, beside] = [prior(&[]), prior(&[shots.lag])];
        // Neighbours have the same lag but for the tick.
        let marks = shots.weights.iter().map(|(marks, count)| (marks * count) as f64).sum::<f64>()
            / shots.weights.values().sum::<usize>() as f64;
        let beside = 0.5 * alone + (beside - 0.5 * alone) * shots.seen.agreement(marks);
        let needed = [alone, beside].map(|prior| threshold - libm::log(prior));
        let lit = shots.false_density.min(0.999);
        let false_ticks = -libm::expm1(libm::log1p(-lit) / ticks);
        // A share s of the places has a tick of light. A share D of them has false ones, d per tick. So a
        // place has s + (W − s)·d ticks and is lit with the probability s + D − s·D. If each photon makes an
        // event of its own, ticks about a mark do not count.
        let of_light = (1.0 - (1.0 - shots.seen.share(1.0)) / (1.0 - lit)).max(0.0);
        let (zone, surplus) = match correlation.photons_apart {
            true => (ticks + 2.0 * (ticks / 2.0).floor(), 0.0),
            false => (ticks, of_light * (lit - false_ticks) + ticks * false_ticks - lit),
        };
        Self { length, places, ticks, zone, false_ticks, surplus, others, needed }
    }

    /// Probabilities that shots of a `level` are believed without a neighbour and with one, if the light of
    /// other shots in `hidden` is not explained.
    fn believed(&self, level: &Level, hidden: &Hidden) -> [f64; 2] {
        let [in_gate, about] = self.others;
        let ticks = |time: f64, own: f64, shots: f64| {
            let noise = time * self.false_ticks + own * self.surplus;
            nodes(noise + shots * hidden.mean, noise + shots * hidden.variance())
        };
        let rest = ticks(self.places - self.length, 0.0, in_gate - about);
        // Its own marks take up places, too.
        let free = (self.length - f64::from(level.marks) * self.zone).max(0.0);
        let (about, places) = (ticks(free, level.marks.into(), about), free / self.ticks);
        let marks = Marks { lit: level.lit, of: level.marks };
        let evidence = |lit: f64, rest: f64| {
            let density = ((lit + rest + 1.0) * self.ticks / self.places).min(0.5);
            belief::evidence(marks, &Surroundings { lit: lit.min(places), places, density })
        };
        self.needed.map(|needed| {
            // The more ticks there are, the less evidence.
            let (mut few, mut of_few) =
                (rest.len(), rest.iter().map(|(_, share)| share).sum::<f64>());
            let believed = about.iter().map(|(lit, of_lit)| {
                while few > 0 && evidence(*lit, rest[few - 1].0) < needed {
                    few -= 1;
                    of_few -= rest[few].1;
                }
                if few > 0 { of_lit * of_few } else { 0.0 }
            });
            believed.sum()
        })
    }
}

/// Numbers of ticks, ascending, and the probability of each, that stand for a distribution with this `mean` and
/// `variance`: of lumps whose number follows Poisson's law, variance/mean ticks each.
fn nodes(mean: f64, variance: f64) -> Vec<(f64, f64)> {
    let lump = if mean > 0.0 { (variance / mean).max(SMALLEST_LUMP) } else { 1.0 };
    let lumps = mean.max(0.0) / lump;
    if lumps > MANY_LUMPS {
        return normal_nodes(lump * lumps, lump * lumps.sqrt());
    }
    let wide = 5.0 * lumps.sqrt() + 5.0;
    let (first, last) = ((lumps - wide).max(0.0) as u32, (lumps + wide) as u32);
    let all: Vec<(f64, f64)> =
        (first..).map(f64::from).zip(poisson_from(lumps, first, last)).collect();
    let sum: f64 = all.iter().map(|(_, chance)| chance).sum();
    let groups = all.chunks(all.len().div_ceil(NODES));
    let group = |group: &[(f64, f64)]| {
        let chance: f64 = group.iter().map(|(_, chance)| chance).sum();
        let mean: f64 = group.iter().map(|(count, chance)| count * chance).sum();
        (chance > 0.0).then(|| (lump * mean / chance, chance / sum))
    };
    groups.filter_map(group).collect()
}

/// The same of a normal distribution: places over four deviations to both sides.
fn normal_nodes(mean: f64, deviation: f64) -> Vec<(f64, f64)> {
    let step = 8.0 / (NODES - 1) as f64;
    let away = |node: usize| step * node as f64 - 4.0;
    let weight = |node: usize| libm::exp(-0.5 * away(node).powi(2));
    let sum: f64 = (0..NODES).map(weight).sum();
    (0..NODES).map(|node| (mean + away(node) * deviation, weight(node) / sum)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// The mean is kept, and the variance to 10 %, by no more nodes than there are.
    #[test]
    fn nodes_have_the_mean_and_the_variance_asked_for() {
        for (mean, variance) in [(0.3, 0.3), (4.0, 4.0), (60.0, 60.0), (250.0, 800.0), (5e4, 6e4)] {
            let nodes = nodes(mean, variance);
            let sum = |of: &dyn Fn(f64) -> f64| -> f64 {
                nodes.iter().map(|(ticks, chance)| of(*ticks) * chance).sum()
            };
            assert!(nodes.len() <= NODES);
            assert_relative_eq!(sum(&|_| 1.0), 1.0, max_relative = 1e-9);
            assert_relative_eq!(sum(&|ticks| ticks), mean, max_relative = 1e-6);
            let found = sum(&|ticks| (ticks - mean).powi(2));
            assert_relative_eq!(found, variance, max_relative = 0.1);
        }
        assert_eq!(nodes(0.0, 0.0), [(0.0, 1.0)]);
    }
}

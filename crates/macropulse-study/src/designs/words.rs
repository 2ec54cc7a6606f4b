//! The words of a candidate: of those tried, the ones that lose the fewest echoes to own stray light.

use std::sync::atomic::{AtomicUsize, Ordering};

use macropulse::codec::code::{CodeWord, Family, Separated};
use macropulse::design::Design;
use macropulse::predict::verdict::slant;
use macropulse::predict::{Blind, OwnLight};
use macropulse::units::tof_from_range;
use rayon::prelude::*;

use super::Error;
use super::candidate::{Candidate, WORDS};
use super::keys::number;
use super::requirements::Requirements;

/// Longest words, over the time between shots of a channel; the shortest that there are may last longer. The
/// mirror moves on during a word, and some points are wrong where it meets two surfaces at different ranges.
/// With 16 beams, words of 0.7 to 0.8 of that time had 23 to 102 wrong points of 36 686. Words of 0.57 had 6,
/// and the example accepts 37.
const LONGEST: f64 = 0.6;

/// Families drawn of each length. With 20 beams, marks of 860 ps behind 278 MHz and 382 chips, the best of 40
/// loses one shot in ten at its worst range. The best of 12 loses one in five.
const SEEDS: u64 = 40;

/// Echoes up to this number of words later are looked after when words are drawn. With 16 beams, where four
/// are sent before an echo from 150 m is back, words of 0.84 of the time between shots still lose one in five
/// somewhere.
const MOST_LATER: u32 = 4;

/// Least difference between distances of marks, in lengths (full width at half maximum) of a mark behind its
/// amplifier. Two marks that meet two others by less than that look like the same.
const APART: f64 = 2.0;

/// Echoes that are lost because too few of their marks are told; the fewer at the worst range the better.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Lost {
    /// Shots of those looked at that are lost at the range where most are.
    at_worst: usize,
    /// And at all ranges together, tick by tick.
    in_all: usize,
}

impl Requirements {
    /// `candidate` with the shortest words of its marks that there are, whatever own light hides of them; without
    /// any if it waits. Closed forms look at ranges where it hides nothing.
    pub(super) fn with_shortest_words(&self, candidate: Candidate) -> Result<Candidate, Error> {
        let bare = Candidate { words: None, ..candidate };
        if bare.waits() {
            return Ok(bare);
        }
        // When a channel is blind does not depend on what it sends.
        let design = bare.unlimited(self)?;
        let blind = design.receiver.method.sampling().and_then(Blind::at_most);
        let chips = |time: f64| (time / self.chip() * (1.0 - 1e-12)).ceil() as u32;
        // The response of a Gaussian low-pass has a full width at half maximum of 0.312 over its bandwidth.
        let mark = bare.pulse.hypot(0.312 / bare.bandwidth);
        let apart = chips(APART * mark);
        let tick = design.clock.tick_fs as f64 * 1e-15;
        let ticks = blind.map_or(0, |blind| blind.between_ticks().ticks());
        let gap = chips(f64::from(ticks) * tick).max(apart);
        let weight = bare.marks;
        let mut length = gap + apart * WORDS * weight * (weight - 1) / 2 + 1;
        while length < u32::from(u16::MAX) {
            let words = Separated { length, weight, words: WORDS, gap, apart, later: 0, seed: 1 };
            if Family::separated(words).is_ok() {
                return Ok(Candidate { words: Some(words), ..bare });
            }
            length += longer(length);
        }
        Err(Error::Asked(format!("there are no {WORDS} words of {weight} marks")))
    }

    /// Returns `candidate`, which has the shortest words, with the best ones. These are the shortest words
    /// that lose no echo to own stray light, from the nearest range to the one wanted. If there are none,
    /// they are those that lose the fewest echoes at the worst range. `LONGEST` and a slanted surface limit
    /// their length.
    pub(super) fn with_best_words(&self, candidate: &Candidate) -> Result<Candidate, Error> {
        let Some(shortest) = candidate.words else { return Ok(candidate.clone()) };
        let design = candidate.unlimited(self)?;
        let period = self.shortest_period(candidate.beams, candidate.facets);
        let longest = ((LONGEST * period / self.chip()) as u32).max(shortest.length);
        let mut best: Option<(Lost, Separated)> = None;
        let mut length = shortest.length;
        while length <= longest && best.is_none_or(|(lost, _)| lost.at_worst > 0) {
            let lasts = f64::from(length) * self.chip();
            let later = ((tof_from_range(self.wanted.range_m) + lasts) / period) as u32;
            let later = later.min(MOST_LATER);
            let limit = AtomicUsize::new(best.map_or(usize::MAX, |(lost, _)| lost.at_worst));
            let of = |seed: u64| {
                let words = Separated { length, later, seed, ..shortest };
                let family = Family::separated(words).ok()?;
                let lost = self.lost(&design, &family.words(), &limit)?;
                limit.fetch_min(lost.at_worst, Ordering::Relaxed);
                Some((lost, words))
            };
            let tried = (1..=SEEDS).into_par_iter().filter_map(of);
            let of_length = tried.min_by_key(|(lost, words)| (*lost, words.seed));
            length += longer(length);
            let is_better = |new: &(Lost, Separated)| best.is_none_or(|(lost, _)| new.0 < lost);
            let Some(found) = of_length.filter(is_better) else { continue };
            // The mirror moves on during a word, and smears it on a surface aslant.
            let worded = Candidate { words: Some(found.1), ..candidate.clone() };
            let smeared = slant(&worded.unlimited(self)?, self.wanted.range_m);
            if best.is_some() && smeared.is_some_and(|check| check.shortfall > 1.0) {
                break;
            }
            best = Some(found);
        }
        let words = best.map_or(shortest, |(_, words)| words);
        Ok(Candidate { words: Some(words), ..candidate.clone() })
    }

    /// Returns the shots of `design` that are lost to own stray light, if it sent these `words` in turn. `None`
    /// if more than `limit` are lost at some range. The limit falls while other words are tried: words above it
    /// are not the best.
    fn lost(&self, design: &Design, words: &[CodeWord], limit: &AtomicUsize) -> Option<Lost> {
        let sampling = design.receiver.method.sampling();
        let none = Lost { at_worst: 0, in_all: 0 };
        let Some(sampling) = sampling else { return Some(none) };
        let Some(blind) = Blind::at_most(sampling) else { return Some(none) };
        let last = tof_from_range(self.wanted.range_m);
        let own = OwnLight::of_words(design, words, blind.between_ticks(), last);
        let least = usize::from(sampling.least_marks);
        let mut lost = none;
        for (_, told) in own.each_told(design.scan.min_range, self.wanted.range_m) {
            let here = told.iter().filter(|told| **told < least).count();
            lost.at_worst = lost.at_worst.max(here);
            if lost.at_worst > limit.load(Ordering::Relaxed) {
                return None;
            }
            lost.in_all += here;
        }
        Some(lost)
    }

    /// How long the words of `candidate` last, s; nothing of one that waits.
    pub(super) fn macropulse(&self, candidate: &Candidate) -> f64 {
        candidate.words.map_or(0.0, |words| f64::from(words.length) * self.chip())
    }

    /// Length of a chip, s.
    fn chip(&self) -> f64 {
        number(&self.template, "code.chip_ps").unwrap_or(400.0) * 1e-12
    }
}

/// Returns the chips by which the next words tried are longer.
fn longer(length: u32) -> u32 {
    length.div_ceil(16)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::super::closed::DIM;
    use super::*;

    /// Marks of 510 ps behind 519 MHz blind for 22 ticks. With 32 beams, the best words lose no echo. With
    /// 16, twice the number of words are under way, and the best lose some, but fewer than the shortest.
    #[test]
    #[ignore = "slow: before a release"]
    fn words_lose_as_little_to_own_light_as_any_that_are_tried() {
        let text = include_str!("../../../../docs/examples/requirements.toml");
        let required = Requirements::from_toml(text, "mine.toml", Path::new("")).unwrap();
        let of = |beams: u32| {
            let (pulse, bandwidth, aperture) = (510e-12, 519e6, 0.04);
            let (part, energy, words) = (required.detectors[0].clone(), DIM, None);
            let marks = 3;
            let facets = required.usual_facets();
            let bare = Candidate {
                part,
                marks,
                beams,
                facets,
                pulse,
                bandwidth,
                energy,
                aperture,
                words,
                is_late: false,
            };
            let short = required.with_shortest_words(bare).unwrap();
            let best = required.with_best_words(&short).unwrap();
            let lost = |it: &Candidate| {
                let words = Family::separated(it.words.unwrap()).unwrap().words();
                let limit = AtomicUsize::new(usize::MAX);
                required.lost(&it.unlimited(&required).unwrap(), &words, &limit).unwrap().at_worst
            };
            assert_eq!(best.words.unwrap().gap, 22);
            let most = LONGEST * required.shortest_period(beams, facets);
            assert!(required.macropulse(&best) <= most.max(required.macropulse(&short)));
            (lost(&short), lost(&best))
        };
        let (short, best) = of(32);
        assert!(short > 0 && best == 0, "{short} and {best}");
        let (short, best) = of(16);
        assert!(best > 0 && best < short, "{short} and {best}");
    }
}

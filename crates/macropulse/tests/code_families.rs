//! Laws of the code families: length, weight, words and correlation of each, exactly, and the
//! errors that follow. The prime code has its own laws in `laws.rs`.

#![allow(clippy::unwrap_used)]

use std::collections::BTreeSet;

use macropulse::codec::code::correlation::{
    CrossCorrelation, aperiodic_sidelobe, balanced, bipolar, periodic, periodic_sidelobe,
};
use macropulse::codec::code::{CodeWord, Family, Sparse};
use macropulse::design::Design;
use macropulse::predict::multiple_access::{Hits, MultipleAccess, bit_error_hard, bit_error_soft};

const PRIMES: [u32; 8] = [5, 7, 11, 13, 17, 19, 23, 29];

/// Highest periodic and aperiodic sidelobe of any of the `words`.
fn sidelobes(words: &[CodeWord]) -> (u16, u16) {
    let highest = |of: fn(&CodeWord) -> Option<macropulse::codec::code::correlation::Sidelobe>| {
        words.iter().filter_map(of).map(|lobe| lobe.height).max().unwrap()
    };
    (highest(periodic_sidelobe), highest(aperiodic_sidelobe))
}

/// Greatest periodic and aperiodic cross-correlation.
fn crosses(words: &[CodeWord]) -> (u16, u16) {
    let cross = CrossCorrelation::of(words);
    (cross.periodic_max, cross.aperiodic_max)
}

#[track_caller]
fn assert_size(family: &Family, length: u32, weight: usize, words: usize) {
    assert_eq!((family.length(), family.weight(), family.count()), (length, weight, words));
    assert!(family.words().iter().all(|w| w.length == length && w.weight() == weight));
    assert_eq!(family.words().iter().collect::<BTreeSet<_>>().len(), words);
}

#[test]
fn extended_prime_words_meet_each_other_once() {
    for p in PRIMES {
        let family = Family::extended_prime(p).unwrap();
        assert_size(&family, p * (2 * p - 1), p as usize, p as usize);
        let words = family.words();
        assert_eq!(crosses(&words), (1, 1), "p = {p}");
        for (i, word) in words.iter().enumerate() {
            let highest = if i == 0 { p } else { p - 1 };
            let found = sidelobes(std::slice::from_ref(word)).0;
            assert_eq!(u32::from(found), highest, "p = {p}, word {i}");
        }
    }
}

#[test]
fn quadratic_congruence_words_have_low_sidelobes() {
    for p in PRIMES {
        let family = Family::quadratic_congruence(p).unwrap();
        assert_size(&family, p * p, p as usize, p as usize - 1);
        let words = family.words();
        assert_eq!(sidelobes(&words), (2, 2), "p = {p}");
        assert_eq!(crosses(&words).0, if p == 5 { 2 } else { 4 }, "p = {p}");
        assert!(crosses(&words).1 <= 4, "p = {p}");
    }
    let cross = CrossCorrelation::of(&Family::quadratic_congruence(29).unwrap().words());
    approx::assert_abs_diff_eq!(cross.periodic.variance(), 0.964, epsilon = 5e-4);
    assert_eq!(cross.periodic.sum, cross.periodic.count, "mean w²/N");
}

#[test]
fn extended_quadratic_congruence_words_have_lower_ones() {
    for p in PRIMES {
        let family = Family::extended_quadratic_congruence(p).unwrap();
        assert_size(&family, p * (2 * p - 1), p as usize, p as usize - 1);
        let words = family.words();
        assert_eq!(sidelobes(&words), (1, 1), "p = {p}");
        assert_eq!(crosses(&words), (2, 2), "p = {p}");
    }
    let cross = CrossCorrelation::of(&Family::extended_quadratic_congruence(29).unwrap().words());
    approx::assert_abs_diff_eq!(cross.periodic.variance(), 0.571, epsilon = 5e-4);
    let prime = CrossCorrelation::of(&Family::extended_prime(29).unwrap().words());
    approx::assert_abs_diff_eq!(prime.periodic.variance(), 0.250, epsilon = 5e-4);
}

#[test]
fn orthogonal_words_meet_once_whatever_the_shift() {
    for (length, weight) in [(13, 3), (63, 3), (101, 4), (341, 5), (1000, 5)] {
        let family = Family::orthogonal(length, weight, None).unwrap();
        let count = family.count();
        assert_size(&family, length, weight as usize, count);
        assert!(count as u32 <= (length - 1) / (weight * (weight - 1)));
        let words = family.words();
        assert_eq!(sidelobes(&words), (1, 1), "({length}, {weight}, 1)");
        assert_eq!(crosses(&words), (1, 1), "({length}, {weight}, 1)");
        let (counted, closed) = (Hits::of_words(&words), Hits::orthogonal(length, weight));
        approx::assert_relative_eq!(counted.chance(1), closed.chance(1), max_relative = 1e-12);
    }
}

/// `words` words of `weight` marks in the chips of a macropulse of the paper.
fn sparse(weight: u32, words: u32) -> Family {
    Family::sparse(Sparse { length: 10_933, weight, words, gap: 1, seed: 1 }).unwrap()
}

/// Words of 32 marks in 10 933 chips meet in w²/N = 0.0937 of them on average, exactly. H0: how
/// many meet is nearly Poisson. N = 12 million distinct values of 48 words, seed 1: six meet
/// somewhere with a chance of α = 0.01. Negative control: words of four times the marks do.
#[test]
fn sparse_words_hardly_ever_meet() {
    let family = sparse(32, 4096);
    assert_eq!((family.length(), family.weight(), family.count()), (10_933, 32, 4096));
    let words = &family.words()[..48];
    let cross = CrossCorrelation::of(words);
    assert_eq!(cross.periodic.sum, 48 * 47 * 32 * 32, "mean w²/N");
    assert!((4..=5).contains(&cross.periodic_max), "{cross:?}");
    let dense = sparse(128, 48);
    assert!(CrossCorrelation::of(&dense.words()).periodic_max > 5);
    approx::assert_relative_eq!(cross.periodic.variance(), 0.0937, max_relative = 0.02);
    let (periodic, aperiodic) = sidelobes(words);
    assert!((2..=3).contains(&periodic) && aperiodic <= periodic, "{periodic} {aperiodic}");
}

/// All distances between marks of all words, ascending, and the least between neighbouring marks.
fn distances(words: &[CodeWord]) -> (Vec<u16>, u16) {
    let pairs = |word: &CodeWord| -> Vec<u16> {
        let later = |(at, mark): (usize, &u16)| {
            word.marks[at + 1..].iter().map(|later| later - mark).collect::<Vec<_>>()
        };
        word.marks.iter().enumerate().flat_map(later).collect()
    };
    let mut all: Vec<u16> = words.iter().flat_map(pairs).collect();
    all.sort_unstable();
    let gaps = words.iter().flat_map(|word| word.marks.windows(2).map(|two| two[1] - two[0]));
    (all, gaps.min().unwrap())
}

/// Ten words of three marks, from mark to mark 20 chips (8 ns) or more, and no two distances nearer than 5 (2 ns).
/// Control: a mark moved to where a distance is nearly that of another word.
#[test]
fn marks_of_sampled_sensors_stand_apart_and_so_do_their_distances() {
    let apart = |distances: &[u16]| distances.windows(2).map(|two| two[1] - two[0]).min().unwrap();
    for (name, chips) in [("coded-32", 340), ("coded-16", 300)] {
        let design = Design::open(name, &[]).unwrap();
        let words = design.emission.coding().codebook.family().words();
        assert_size(design.emission.coding().codebook.family(), chips, 3, 10);
        let (all, gap) = distances(&words);
        assert_eq!(all.len(), 30, "{name}");
        assert!(gap >= 20 && apart(&all) >= 5, "{name}: {gap}, {}", apart(&all));
        assert_eq!((sidelobes(&words).1, crosses(&words).1), (1, 1), "{name}");
        let mut moved = words[0].clone();
        moved.marks[1] = moved.marks[0] + words[1].marks[1] - words[1].marks[0] + 4;
        moved.marks.sort_unstable();
        let (all, _) = distances(&[&[moved], &words[1..]].concat());
        assert!(apart(&all) < 5, "{name}");
    }
}

#[test]
fn an_m_sequence_in_balance_is_dark_off_its_peak() {
    for degree in 3..=10 {
        let family = Family::m_sequence(degree).unwrap();
        assert_size(&family, (1 << degree) - 1, 1 << (degree - 1), 1);
        let word = &family.words()[0];
        let correlation = balanced(word, word);
        assert_eq!(correlation[0], 1 << (degree - 1));
        assert!(correlation[1..].iter().all(|&off_peak| off_peak == 0), "degree {degree}");
        assert!(bipolar(word, word)[1..].iter().all(|&off_peak| off_peak == -1));
        // Its unipolar correlation is anything but dark.
        assert!(periodic(word, word)[1..].iter().all(|&met| met == 1 << (degree - 2)));
    }
}

/// {−t, −1, t − 2} with t = 2^⌊(n+2)/2⌋ + 1; each of these values occurs.
#[test]
fn gold_words_meet_in_three_values() {
    for (degree, t) in [(5, 9), (6, 17), (7, 17)] {
        let family = Family::gold(degree).unwrap();
        let length = (1 << degree) - 1;
        assert_eq!((family.length(), family.count()), (length, length as usize + 2));
        let words = family.words();
        assert_eq!(words.iter().collect::<BTreeSet<_>>().len(), words.len());
        let mut met = BTreeSet::new();
        for (i, a) in words.iter().enumerate() {
            met.extend(words[..i].iter().flat_map(|b| bipolar(a, b)));
            assert!(bipolar(a, a)[1..].iter().all(|off| [-t, -1, t - 2].contains(off)));
        }
        assert_eq!(met.into_iter().collect::<Vec<_>>(), [-t, -1, t - 2], "degree {degree}");
    }
    assert_eq!([17 - 2, 17], [15, 17], "n = 7 is {{-17, -1, 15}}");
}

#[test]
fn balanced_gold_words_cancel_to_an_eighth_of_their_peak() {
    let words = Family::gold(7).unwrap().words();
    let even: Vec<&CodeWord> = words.iter().filter(|word| word.weight() == 64).collect();
    assert_eq!(even.len(), 65);
    let mut met = BTreeSet::new();
    for (i, a) in even.iter().enumerate() {
        assert_eq!(balanced(a, a)[0], 64);
        met.extend(even[..i].iter().flat_map(|b| balanced(a, b)));
    }
    assert_eq!(met.into_iter().collect::<Vec<_>>(), [-8, 0, 8]);
}

/// `value` is `printed`, a number in scientific notation, to all its digits.
#[track_caller]
fn assert_as_printed(value: f64, printed: &str) {
    let (mantissa, _) = printed.split_once('e').unwrap();
    let digits = mantissa.split_once('.').map_or(0, |(_, decimals)| decimals.len());
    assert_eq!(format!("{value:.digits$e}"), printed);
}

#[test]
fn error_curves_of_other_families_as_printed() {
    let of = |family: Family| MultipleAccess::of_words(&family.words(), 25);
    let congruence = of(Family::quadratic_congruence(29).unwrap());
    assert_as_printed(bit_error_soft(&congruence), "1.3e-4");
    assert_as_printed(bit_error_hard(&congruence), "1.1e-12");
    assert_eq!(congruence.harmless_interferers(), Some(7));
    for (marks, twice) in [0.2227, 0.3093, 0.0436, 0.0069].into_iter().enumerate() {
        let chance = 2.0 * congruence.hits().chance(marks + 1);
        approx::assert_abs_diff_eq!(chance, twice, epsilon = 6e-5);
    }
    let extended = of(Family::extended_quadratic_congruence(29).unwrap());
    assert_as_printed(bit_error_soft(&extended), "6.2e-10");
    assert_as_printed(bit_error_hard(&extended), "8.4e-20");
    assert_eq!(extended.harmless_interferers(), Some(14));
    assert_eq!(of(Family::extended_prime(29).unwrap()).harmless_interferers(), Some(28));

    let ten = |length| MultipleAccess::new(5, 10, Hits::orthogonal(length, 5));
    assert_as_printed(bit_error_soft(&ten(1000)), "1.84e-8");
    assert_as_printed(bit_error_hard(&ten(1000)), "7.2e-10");
    assert_as_printed(bit_error_soft(&ten(341)), "3.7e-6");
    assert_as_printed(bit_error_hard(&ten(341)), "1.5e-7");
    assert_eq!(ten(341).harmless_interferers(), Some(4));
}

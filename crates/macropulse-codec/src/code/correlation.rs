//! How alike code words are: correlation of lit chips.
//!
//! With a(n) = 1 where chip n of word a is lit and 0 elsewhere, N the length, and l the lag of b
//! against a in chips:
//!
//! * aperiodic: `C_ab(l) = Σ_n a(n)·b(n+l)` over the n for which both chips exist, for every
//!   −N < l < N \[KP16 eq. 3\]. Negative lags are part of it, and C_ab(−l) = C_ba(l);
//! * periodic: `Θ_ab(l) = Σ_n a(n)·b((n+l) mod N) = C_ab(l) + C_ab(l−N)`, 0 ≤ l < N
//!   \[KP16 eq. 4\].
//!
//! The first is what an isolated word meets, the second an endless row of the same word. Both are
//! counted from mark to mark: w² steps for words of weight w, however long they are; or, of dense words,
//! bit by bit, 64 chips at a time. The shorter of two words of different length is taken to end in dark
//! chips.

use super::CodeWord;

/// Periodic correlation Θ_ab(l) for l = 0 … N−1.
pub fn periodic(a: &CodeWord, b: &CodeWord) -> Vec<u16> {
    let length = a.length.max(b.length);
    if are_dense(a, b, length) {
        let again = b.marks.iter().map(|mark| usize::from(*mark) + length as usize);
        return in_bits(a, b.marks.iter().map(|mark| usize::from(*mark)).chain(again), length);
    }
    let mut coincidences = vec![0; length as usize];
    for &from in &a.marks {
        for &to in &b.marks {
            let lag = i32::from(to) - i32::from(from);
            let lag = if lag < 0 { lag + length as i32 } else { lag };
            count(&mut coincidences, i64::from(lag));
        }
    }
    coincidences
}

/// Balanced periodic correlation for l = 0 … N−1: what falls on marks of `b` less what falls on its
/// dark chips when `a` is sent, `Σ_n a(n)·(2·b((n+l) mod N) − 1) = 2·Θ_ab(l) − w_a`.
pub fn balanced(a: &CodeWord, b: &CodeWord) -> Vec<i32> {
    let weight = a.weight() as i32;
    periodic(a, b).into_iter().map(|met| 2 * i32::from(met) - weight).collect()
}

/// Bipolar periodic correlation for l = 0 … N−1, lit chips taken for −1 and dark ones for +1:
/// `N − 2·(w_a + w_b) + 4·Θ_ab(l)`.
pub fn bipolar(a: &CodeWord, b: &CodeWord) -> Vec<i32> {
    let length = a.length.max(b.length) as i32;
    let weights = (a.weight() + b.weight()) as i32;
    periodic(a, b).into_iter().map(|met| length - 2 * weights + 4 * i32::from(met)).collect()
}

/// Aperiodic correlation C_ab(l).
pub fn aperiodic(a: &CodeWord, b: &CodeWord) -> Aperiodic {
    let length = a.length.max(b.length) as i32;
    if are_dense(a, b, length as u32) {
        let before = length as usize - 1;
        let marks = b.marks.iter().map(|mark| usize::from(*mark) + before);
        let coincidences = in_bits(a, marks, 2 * length as u32 - 1);
        return Aperiodic { length, coincidences };
    }
    let mut coincidences = vec![0; (2 * length).max(1) as usize - 1];
    for &from in &a.marks {
        for &to in &b.marks {
            let lag = i32::from(to) - i32::from(from);
            count(&mut coincidences, i64::from(lag) + i64::from(length) - 1);
        }
    }
    Aperiodic { length, coincidences }
}

/// Returns true if two words of `length` chips have enough marks for counting in bits to take fewer steps.
fn are_dense(a: &CodeWord, b: &CodeWord, length: u32) -> bool {
    let pairs = a.weight() as u64 * b.weight() as u64;
    let is_within = |word: &CodeWord| word.marks.iter().all(|mark| u32::from(*mark) < length);
    pairs > u64::from(length) * u64::from(length.div_ceil(64)) && is_within(a) && is_within(b)
}

/// How many marks of `a` are `lit`, moved on by 0 … `lags` − 1 chips.
fn in_bits(a: &CodeWord, lit: impl Iterator<Item = usize>, lags: u32) -> Vec<u16> {
    let marks = bits(a.marks.iter().map(|mark| usize::from(*mark)), a.length as usize);
    // Read as far as the marks reach, one machine word beyond.
    let lit = bits(lit, lags as usize + 64 * (marks.len() + 1));
    let mut counts = vec![0; lags as usize];
    count_each(&marks, &lit, &mut counts);
    counts
}

/// Returns `length` bits, with those at `places` set.
fn bits(places: impl Iterator<Item = usize>, length: usize) -> Vec<u64> {
    let mut words = vec![0_u64; length.div_ceil(64)];
    for place in places {
        if let Some(word) = words.get_mut(place / 64) {
            *word |= 1 << (place % 64);
        }
    }
    words
}

/// Counts the `marks` that are `lit` where they are moved on by 0, 1, 2 … bits.
fn count_each(marks: &[u64], lit: &[u64], counts: &mut [u16]) {
    for (lag, count) in counts.iter_mut().enumerate() {
        let (word, shift) = (lag / 64, lag % 64);
        let lit = &lit[word..];
        let pairs = marks.iter().zip(lit).zip(&lit[1..]);
        // Two shifts, because a shift by 64 does not give 0.
        let met = pairs.map(|((marks, here), next)| {
            u64::from((marks & (here >> shift | next << 1 << (63 - shift))).count_ones())
        });
        *count = u16::try_from(met.sum::<u64>()).unwrap_or(u16::MAX);
    }
}

/// Counts a coincidence at `place`; marks beyond the end of their word have none.
fn count(coincidences: &mut [u16], place: i64) {
    let place = usize::try_from(place).ok().and_then(|place| coincidences.get_mut(place));
    if let Some(coincidences) = place {
        *coincidences = coincidences.saturating_add(1);
    }
}

/// An aperiodic correlation, over lags of either sign.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Aperiodic {
    length: i32,
    /// Entry k belongs to lag k − (length − 1).
    coincidences: Vec<u16>,
}

impl Aperiodic {
    /// C(`lag`); 0 where the words do not overlap.
    pub fn at(&self, lag: i32) -> u16 {
        let place = usize::try_from(i64::from(lag) + i64::from(self.length) - 1);
        place.ok().and_then(|place| self.coincidences.get(place)).copied().unwrap_or(0)
    }

    /// Lag and value, from the most negative lag to the greatest.
    pub fn iter(&self) -> impl Iterator<Item = (i32, u16)> {
        (1 - self.length..).zip(self.coincidences.iter().copied())
    }

    /// The greatest value at any lag.
    pub fn max(&self) -> u16 {
        self.coincidences.iter().copied().max().unwrap_or(0)
    }
}

/// The greatest autocorrelation off the peak.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sidelobe {
    /// Smallest positive lag that has it, in chips: how far wrong the time may be.
    pub lag: u32,
    /// Marks that coincide there; the peak has all.
    pub height: u16,
}

/// The greatest sidelobe of a word that repeats without end; `None` for a word of one chip.
pub fn periodic_sidelobe(word: &CodeWord) -> Option<Sidelobe> {
    highest((0..).zip(periodic(word, word)).skip(1))
}

/// The greatest sidelobe of a word on its own; `None` for a word of one chip.
pub fn aperiodic_sidelobe(word: &CodeWord) -> Option<Sidelobe> {
    let autocorrelation = aperiodic(word, word);
    let positive = autocorrelation.iter().filter(|&(lag, _)| lag > 0);
    highest(positive.map(|(lag, height)| (lag as u32, height)))
}

fn highest(lobes: impl Iterator<Item = (u32, u16)>) -> Option<Sidelobe> {
    lobes
        .map(|(lag, height)| Sidelobe { lag, height })
        .reduce(|best, next| if next.height > best.height { next } else { best })
}

/// How the words of a set disturb each other, over all ordered pairs of different words.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct CrossCorrelation {
    /// Greatest Θ_ij(l), i ≠ j, over all lags.
    pub periodic_max: u16,
    /// Greatest C_ij(l), i ≠ j, over all lags.
    pub aperiodic_max: u16,
    /// Spread of Θ_ij(l), i ≠ j, all lags alike.
    pub periodic: Moments,
}

impl CrossCorrelation {
    /// Compares every word with every other one at every lag: n²·(w² + N) steps for n words.
    pub fn of(words: &[CodeWord]) -> Self {
        let mut all = Self::default();
        for (i, a) in words.iter().enumerate() {
            for (_, b) in words.iter().enumerate().filter(|&(j, _)| j != i) {
                all.aperiodic_max = all.aperiodic_max.max(aperiodic(a, b).max());
                for coincidences in periodic(a, b) {
                    all.periodic_max = all.periodic_max.max(coincidences);
                    all.periodic.add(coincidences);
                }
            }
        }
        all
    }
}

/// Exact sums over many correlation values.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Moments {
    /// Number of values.
    pub count: u64,
    /// Their sum.
    pub sum: u64,
    /// The sum of their squares.
    pub sum_of_squares: u64,
}

impl Moments {
    fn add(&mut self, value: u16) {
        let value = u64::from(value);
        self.count += 1;
        self.sum += value;
        self.sum_of_squares += value * value;
    }

    /// Mean; NaN without any value.
    pub fn mean(&self) -> f64 {
        self.sum as f64 / self.count as f64
    }

    /// Variance of the values as a whole population; NaN without any value.
    pub fn variance(&self) -> f64 {
        self.sum_of_squares as f64 / self.count as f64 - self.mean().powi(2)
    }
}

#[cfg(test)]
mod tests {
    use super::super::Family;
    use super::*;

    fn chip(word: &CodeWord, n: i32) -> u16 {
        u16::from(word.marks.iter().any(|&mark| i32::from(mark) == n))
    }

    #[test]
    fn counting_from_mark_to_mark_is_the_sum_over_chips() {
        let words = Family::prime(5).unwrap().words();
        let (a, b, length) = (&words[2], &words[4], 25);
        let counted = aperiodic(a, b);
        for lag in 1 - length..length {
            let by_definition: u16 = (0..length).map(|n| chip(a, n) * chip(b, n + lag)).sum();
            assert_eq!(counted.at(lag), by_definition, "aperiodic, lag {lag}");
        }
        let counted = periodic(a, b);
        for lag in 0..length {
            let by_definition: u16 =
                (0..length).map(|n| chip(a, n) * chip(b, (n + lag) % length)).sum::<u16>();
            assert_eq!(counted[lag as usize], by_definition, "periodic, lag {lag}");
        }
    }

    /// Words of one to all of 130 chips, and of different lengths: the same as from mark to mark.
    #[test]
    fn dense_words_are_counted_in_bits_alike() {
        let word = |length: u32, every: u16, from: u16| CodeWord {
            length,
            marks: (from..length as u16).step_by(usize::from(every)).collect(),
        };
        let words =
            [word(130, 1, 0), word(130, 2, 1), word(130, 3, 0), word(97, 1, 5), word(64, 1, 0)];
        for (a, b) in words.iter().flat_map(|a| words.iter().map(move |b| (a, b))) {
            let length = a.length.max(b.length) as i32;
            assert!(are_dense(a, b, length as u32));
            let alone = aperiodic(a, b);
            let of_chips =
                |lag: i32| -> u16 { (0..length).map(|n| chip(a, n) * chip(b, n + lag)).sum() };
            for lag in 1 - length..length {
                assert_eq!(alone.at(lag), of_chips(lag), "{} {} {lag}", a.length, b.length);
            }
            for (lag, met) in (0..).zip(periodic(a, b)) {
                assert_eq!(met, of_chips(lag) + of_chips(lag - length), "{lag}");
            }
        }
    }

    #[test]
    fn signed_correlations_are_the_sums_over_chips() {
        let words = Family::gold(5).unwrap().words();
        let (a, b) = (&words[1], &words[7]);
        let sign = |word: &CodeWord, n| 2 * i32::from(chip(word, n)) - 1;
        for lag in 0..31 {
            let of_chips = |sent: &dyn Fn(i32) -> i32| -> i32 {
                (0..31).map(|n| sent(n) * sign(b, (n + lag) % 31)).sum()
            };
            assert_eq!(balanced(a, b)[lag as usize], of_chips(&|n| i32::from(chip(a, n))));
            assert_eq!(bipolar(a, b)[lag as usize], of_chips(&|n| sign(a, n)));
        }
    }

    #[test]
    fn c1_of_the_paper_is_mistaken_by_30_chips() {
        let words = Family::prime(29).unwrap().words();
        assert_eq!(periodic_sidelobe(&words[1]), Some(Sidelobe { lag: 30, height: 28 }));
        assert_eq!(aperiodic_sidelobe(&words[1]), Some(Sidelobe { lag: 30, height: 28 }));
        assert_eq!(periodic_sidelobe(&words[0]), Some(Sidelobe { lag: 29, height: 29 }));
    }

    #[test]
    fn one_chip_has_neither_sidelobe_nor_rival() {
        let words = Family::Single.words();
        assert_eq!(periodic(&words[0], &words[0]), [1]);
        assert_eq!(periodic_sidelobe(&words[0]), None);
        assert_eq!(aperiodic_sidelobe(&words[0]), None);
        let cross = CrossCorrelation::of(&words);
        assert_eq!(cross, CrossCorrelation::default());
        assert!(cross.periodic.mean().is_nan());
    }

    #[test]
    fn words_far_apart_do_not_overlap() {
        let words = Family::prime(5).unwrap().words();
        let correlation = aperiodic(&words[1], &words[1]);
        assert_eq!((correlation.at(0), correlation.max()), (5, 5));
        assert_eq!((correlation.at(25), correlation.at(-25), correlation.at(i32::MIN)), (0, 0, 0));
    }
}

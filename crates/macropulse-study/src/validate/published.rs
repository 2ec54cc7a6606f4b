//! Figures that others have published, each beside what Macropulse says.

use macropulse::codec::code::correlation::{
    CrossCorrelation, aperiodic_sidelobe, bipolar, periodic_sidelobe,
};
use macropulse::codec::code::{CodeWord, Family};
use macropulse::predict::multiple_access::{
    Hits, MultipleAccess, Words, bit_error_gaussian, bit_error_hard, bit_error_soft,
};

use super::Error;

/// How far a figure may be from the one that was published.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Within {
    /// Not at all.
    Exactly,
    /// By this share of it: half a unit of its last digit, or what its source says.
    Share(f64),
    /// By this amount.
    Absolute(f64),
    /// By any amount, downwards: it is published as the most there is.
    AtMost,
    /// By any amount, upwards: it is published as the least there is.
    AtLeast,
}

/// A published figure, and ours.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Figure {
    /// Its topic.
    pub topic: &'static str,
    /// The quantity, with its unit.
    pub what: String,
    /// Its source, as docs/references.md names it.
    pub source: &'static str,
    /// As published.
    pub published: f64,
    /// As computed here.
    pub ours: f64,
    /// How far these may be apart.
    pub within: Within,
}

impl Figure {
    /// True if our figure agrees with the published one.
    pub fn holds(&self) -> bool {
        let off = (self.ours - self.published).abs();
        match self.within {
            Within::Exactly => off == 0.0,
            Within::Share(share) => off <= share * self.published.abs(),
            Within::Absolute(most) => off <= most,
            Within::AtMost => self.ours <= self.published,
            Within::AtLeast => self.ours >= self.published,
        }
    }
}

/// Figures of one topic and source.
pub(super) struct Figures {
    topic: &'static str,
    source: &'static str,
    list: Vec<Figure>,
}

impl Figures {
    /// None yet.
    pub fn of(topic: &'static str, source: &'static str) -> Self {
        Self { topic, source, list: Vec::new() }
    }

    /// Adds one.
    pub fn add(&mut self, what: impl Into<String>, published: f64, ours: f64, within: Within) {
        let (topic, source, what) = (self.topic, self.source, what.into());
        self.list.push(Figure { topic, what, source, published, ours, within });
    }

    /// All of them.
    pub fn done(self) -> Vec<Figure> {
        self.list
    }
}

/// Codes, and the errors of overlapping users.
///
/// # Errors
/// None, unless a family refuses its own parameters.
pub(super) fn codes() -> Result<Vec<Figure>, Error> {
    let mut all = prime()?;
    all.extend(other_families()?);
    all.extend(errors()?);
    Ok(all)
}

fn prime() -> Result<Vec<Figure>, Error> {
    let mut figures = Figures::of("codes", "KP16");
    let family = Family::prime(29)?;
    let words = family.words();
    figures.add("prime code over GF(29): chips", 841.0, family.length().into(), Within::Exactly);
    figures.add("marks", 29.0, family.weight() as f64, Within::Exactly);
    figures.add("words", 29.0, words.len() as f64, Within::Exactly);
    let cross = CrossCorrelation::of(&words);
    figures.add("greatest cross-correlation", 2.0, cross.periodic_max.into(), Within::Exactly);
    let mut all = figures.done();
    let mut figures = Figures::of("codes", "YK13");
    let variance = |p: f64| (p + 1.0) * (p - 2.0) / (3.0 * p * p);
    for p in [5_u32, 11, 29] {
        let found = CrossCorrelation::of(&Family::prime(p)?.words()).periodic.variance();
        let what = format!("variance of the cross-correlation, prime code over GF({p})");
        figures.add(what, variance(p.into()), found, Within::Share(1e-12));
    }
    let highest = |words: &[CodeWord]| {
        words
            .iter()
            .filter_map(periodic_sidelobe)
            .map(|lobe| f64::from(lobe.height))
            .fold(0.0, f64::max)
    };
    let what = "greatest sidelobe of the words but C0, prime code over GF(29)";
    figures.add(what, 28.0, highest(&words[1..]), Within::Exactly);
    all.extend(figures.done());
    Ok(all)
}

fn other_families() -> Result<Vec<Figure>, Error> {
    let sidelobe = |family: &Family| {
        let words = family.words();
        let lobes = words.iter().filter_map(aperiodic_sidelobe).map(|lobe| lobe.height);
        f64::from(lobes.max().unwrap_or(0))
    };
    let cross = |family: &Family| f64::from(CrossCorrelation::of(&family.words()).aperiodic_max);
    let mut congruence = Figures::of("codes", "TS81");
    for (family, name, lobe, met) in [
        (Family::quadratic_congruence(29)?, "quadratic congruence", 2.0, 4.0),
        (Family::extended_quadratic_congruence(29)?, "extended quadratic congruence", 1.0, 2.0),
    ] {
        congruence.add(
            format!("{name} over GF(29): greatest sidelobe"),
            lobe,
            sidelobe(&family),
            Within::Exactly,
        );
        congruence.add(
            format!("{name} over GF(29): greatest cross-correlation"),
            met,
            cross(&family),
            Within::Exactly,
        );
    }
    let mut all = congruence.done();
    let mut gold = Figures::of("codes", "Gold67");
    let family = Family::gold(7)?;
    let words = family.words();
    gold.add("Gold code, n = 7: words", 129.0, words.len() as f64, Within::Exactly);
    let values: std::collections::BTreeSet<i32> = words
        .iter()
        .enumerate()
        .flat_map(|(i, a)| words[..i].iter().map(move |b| (a, b)))
        .flat_map(|(a, b)| bipolar(a, b))
        .collect();
    let ends = [values.first(), values.last()].map(|value| f64::from(*value.unwrap_or(&0)));
    gold.add("least bipolar cross-correlation", -17.0, ends[0], Within::Exactly);
    gold.add("greatest", 15.0, ends[1], Within::Exactly);
    gold.add("different values", 3.0, values.len() as f64, Within::Exactly);
    all.extend(gold.done());
    let mut orthogonal = Figures::of("codes", "CSW89");
    // The largest possible number of words: (n - 1)/(w(w - 1)).
    let words = Family::orthogonal(13, 3, None)?.words();
    orthogonal.add(
        "words of an orthogonal code of 13 chips and 3 marks",
        2.0,
        words.len() as f64,
        Within::Exactly,
    );
    let cross = CrossCorrelation::of(&words).periodic_max;
    orthogonal.add("greatest cross-correlation", 1.0, cross.into(), Within::Exactly);
    let lobe = words.iter().filter_map(periodic_sidelobe).map(|lobe| lobe.height).max();
    orthogonal.add("greatest sidelobe", 1.0, lobe.unwrap_or(0).into(), Within::Exactly);
    all.extend(orthogonal.done());
    Ok(all)
}

/// Errors per bit by p, users K, and reading: normal, every mark counted, chips limited.
const ERRORS: [(u32, u32, [f64; 3]); 6] = [
    (5, 5, [1.994e-2, 1.3153e-2, 9.297e-4]),
    (7, 7, [1.073e-2, 7.829e-3, 1.179e-4]),
    (11, 11, [2.941e-3, 2.579e-3, 1.703e-6]),
    (13, 13, [1.54e-3, 1.477e-3, 2.01e-7]),
    (17, 17, [4.25e-4, 4.88e-4, 2.78e-9]),
    (29, 25, [1.92e-6, 3.97e-7, 4.7e-17]),
];

fn errors() -> Result<Vec<Figure>, Error> {
    let mut figures = Figures::of("multiple access", "YK13");
    for (p, users, published) in ERRORS {
        let access = MultipleAccess::prime(p, users, Words::All)?;
        let ours = [bit_error_gaussian, bit_error_soft, bit_error_hard].map(|error| error(&access));
        let names = ["normal", "every mark counted", "chips limited"];
        for ((name, published), ours) in names.into_iter().zip(published).zip(ours) {
            let what = format!("error per bit, p = {p}, {users} users, {name}");
            figures.add(what, published, ours, Within::Share(2e-2));
        }
    }
    let mut all = figures.done();
    let mut figures = Figures::of("multiple access", "computed apart");
    let unaligned = |p: u32, users: u32| -> Result<MultipleAccess, Error> {
        let words = Family::prime(p)?.words();
        Ok(MultipleAccess::new(words[0].marks.len(), users, Hits::of_unaligned_words(&words)))
    };
    let many = unaligned(29, 25)?;
    let what = "24 other users with bits of their own at any delay, p = 29";
    figures.add(
        format!("{what}, every mark counted"),
        1.31e-7,
        bit_error_soft(&many),
        Within::Share(1e-2),
    );
    figures.add(
        format!("{what}, chips limited"),
        1.02e-17,
        bit_error_hard(&many),
        Within::Share(2e-2),
    );
    let few = bit_error_soft(&unaligned(5, 5)?);
    figures.add("4 of them, p = 5, simulated", 0.0091, few, Within::Absolute(2e-4));
    all.extend(figures.done());
    Ok(all)
}

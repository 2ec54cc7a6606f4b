//! A code family on its own, as it would stand in a sensor file.

use schemars::JsonSchema;
use serde::Deserialize;

use super::Error;
use crate::names::nearest;
use crate::schema;
use macropulse_codec::code::{self, Family, Separated, Sparse};

/// Code families by the names they have in a sensor file.
pub(super) const FAMILIES: &[&str] = &[
    "prime",
    "extended-prime",
    "quadratic-congruence",
    "extended-quadratic-congruence",
    "orthogonal",
    "sparse",
    "separated",
    "list",
    "m-sequence",
    "gold",
];

/// `code.family` as typed.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub(super) enum FamilyFile {
    /// Prime sequence code over an odd prime p up to 251: p words of p² chips, p of them lit.
    Prime(u32),
    /// The same in blocks of 2p − 1 chips: any two words share one mark at most; p up to 181.
    ExtendedPrime(u32),
    /// Quadratic congruence code over an odd prime p up to 251: p − 1 words of p² chips.
    QuadraticCongruence(u32),
    /// The same in blocks of 2p − 1 chips; p up to 181.
    ExtendedQuadraticCongruence(u32),
    /// Optical orthogonal code: any two words share one mark at most.
    Orthogonal(OrthogonalFile),
    /// Marks drawn at random for each word.
    Sparse(SparseFile),
    /// Marks drawn at random so that all distances between marks, of all words, differ.
    Separated(SeparatedFile),
    /// Words written out.
    List(ListFile),
    /// One word of 2ⁿ − 1 chips, half of them lit, n from 3 to 15.
    MSequence(u32),
    /// Gold code: 2ⁿ + 1 words of 2ⁿ − 1 chips, about half of them lit, n one of 5, 6, 7, 9, 10, 11.
    Gold(u32),
}

#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct OrthogonalFile {
    /// Chips of a word.
    length: u32,
    /// Marks of a word.
    weight: u32,
    /// Number of words; without it all that a search finds.
    words: Option<u32>,
}

#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct SparseFile {
    /// Chips of a word, up to 65535.
    length: u32,
    /// Marks of a word.
    weight: u32,
    /// Number of words, up to 65535.
    words: u32,
    /// Least distance from each mark to the next, in chips.
    #[serde(default = "one")]
    gap: u32,
    /// Seed by which the words are drawn.
    seed: u64,
}

#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct SeparatedFile {
    /// Chips of a word, up to 65535.
    length: u32,
    /// Marks of a word, up to 64.
    weight: u32,
    /// Number of words, up to 4096.
    words: u32,
    /// Least distance between marks of a word, in chips.
    #[serde(default = "one")]
    gap: u32,
    /// Least difference between any two distances, of all words, in chips.
    #[serde(default = "one")]
    apart: u32,
    /// Up to how many words later an echo of a word may come, 0 to 16. A channel is blind for `gap` chips
    /// behind each mark that it sends. Words are drawn so that no echo, or few, loses two marks to that.
    #[serde(default = "two")]
    later: u32,
    /// Seed by which the words are drawn.
    seed: u64,
}

#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct ListFile {
    /// Chips of a word, up to 65535.
    length: u32,
    /// For each word the chips at which it is lit, ascending, counted from 0; no two words alike, up to
    /// 65535.
    marks: Vec<Vec<u32>>,
}

/// The gap that leaves marks as they fall.
fn one() -> u32 {
    1
}

/// The shots that are under way in a channel of `coded-32`.
fn two() -> u32 {
    2
}

/// The code family that a sensor file names.
pub(super) fn family(file: FamilyFile) -> Result<Family, code::Error> {
    match file {
        FamilyFile::Prime(p) => Family::prime(p),
        FamilyFile::ExtendedPrime(p) => Family::extended_prime(p),
        FamilyFile::QuadraticCongruence(p) => Family::quadratic_congruence(p),
        FamilyFile::ExtendedQuadraticCongruence(p) => Family::extended_quadratic_congruence(p),
        FamilyFile::Orthogonal(OrthogonalFile { length, weight, words }) => {
            Family::orthogonal(length, weight, words)
        }
        FamilyFile::Sparse(SparseFile { length, weight, words, gap, seed }) => {
            Family::sparse(Sparse { length, weight, words, gap, seed })
        }
        FamilyFile::Separated(SeparatedFile { length, weight, words, gap, apart, later, seed }) => {
            Family::separated(Separated { length, weight, words, gap, apart, later, seed })
        }
        FamilyFile::List(ListFile { length, marks }) => Family::listed(length, marks),
        FamilyFile::MSequence(degree) => Family::m_sequence(degree),
        FamilyFile::Gold(degree) => Family::gold(degree),
    }
}

/// The code family written as in a sensor file behind `code.family`, without the outer braces:
/// `prime = 29`, or `orthogonal = { length = 1000, weight = 5 }`.
///
/// # Errors
/// Says in one sentence what is wrong with the text, or why there is no such family.
pub fn family_from_toml(text: &str) -> Result<Family, Error> {
    let wrong = |message: String| Error::whole(text, message);
    let table: toml::Table = text.parse().map_err(|_| {
        wrong("write it as in a sensor file, as prime=29 or 'sparse={length=…, …}'".to_owned())
    })?;
    let [name] = table.keys().map(String::as_str).collect::<Vec<_>>()[..] else {
        return Err(wrong("name one family at a time".to_owned()));
    };
    if !FAMILIES.contains(&name) {
        let hint = nearest(name, FAMILIES.iter().copied())
            .map(|near| format!("did you mean `{near}`? "))
            .unwrap_or_default();
        let known = FAMILIES.join(", ");
        return Err(wrong(format!("`{name}` is no code family; {hint}known are {known}")));
    }
    let file: FamilyFile = schema::read(&table).map_err(|misfit| wrong(misfit.message()))?;
    family(file).map_err(|error| wrong(error.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_family_can_be_written() {
        let sparse = |gap| Family::sparse(Sparse { length: 99, weight: 3, words: 2, gap, seed: 4 });
        let texts = [
            ("prime=29", Family::prime(29)),
            ("extended-prime = 7", Family::extended_prime(7)),
            ("quadratic-congruence=7", Family::quadratic_congruence(7)),
            ("extended-quadratic-congruence=7", Family::extended_quadratic_congruence(7)),
            ("orthogonal={length=63,weight=3}", Family::orthogonal(63, 3, None)),
            ("orthogonal={length=63,weight=3,words=2}", Family::orthogonal(63, 3, Some(2))),
            ("sparse={length=99,weight=3,words=2,seed=4}", sparse(1)),
            ("sparse={length=99,weight=3,words=2,gap=5,seed=4}", sparse(5)),
            (
                "list={length=9,marks=[[0,8],[0,5]]}",
                Family::listed(9, vec![vec![0, 8], vec![0, 5]]),
            ),
            ("m-sequence=5", Family::m_sequence(5)),
            ("gold=5", Family::gold(5)),
        ];
        for (text, family) in texts {
            assert_eq!(family_from_toml(text).unwrap(), family.unwrap(), "{text}");
        }
    }

    #[test]
    fn what_cannot_be_read_is_one_sentence() {
        let refusal = |text| family_from_toml(text).unwrap_err().to_string();
        assert_eq!(
            refusal("prime=28"),
            "prime=28: 28 is not an odd prime; the nearest are 23 and 29"
        );
        assert!(refusal("golf=7").contains("did you mean `gold`?"), "{}", refusal("golf=7"));
        assert!(refusal("29").contains("as prime=29"));
        assert!(refusal("prime=29\ngold=7").contains("one family at a time"));
        assert!(
            refusal("gold='x'").contains("but must be a whole number"),
            "{}",
            refusal("gold='x'")
        );
        assert_eq!(
            refusal("list={length=9,marks=[[0,5],[0,9]]}"),
            "list={length=9,marks=[[0,5],[0,9]]}: word 1, counted from 0, is lit at chip 9, but its chips \
             are 0 to 8: use longer words"
        );
        assert!(refusal("list={length=9,marks=[0,5]}").contains("must be"));
        assert!(refusal("list={length=9,marks=[[-1]]}").contains("must be"));
        assert!(refusal("sparse={length=9}").contains("`weight` is missing"));
        assert!(refusal("gold=99999999999").starts_with("gold=99999999999: "));
    }
}

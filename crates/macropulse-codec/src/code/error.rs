//! Why a code cannot be built.

/// A code that cannot be built: one sentence with what was asked for and what is possible.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The order of a prime code is composite, or below 3.
    #[error("{p} is not an odd prime; {nearest}")]
    NotOddPrime {
        /// The requested value.
        p: u32,
        /// The odd primes next to it, as the end of the sentence.
        nearest: String,
    },
    /// The order of a code over GF(p) is so large that a chip of one word has no 16-bit index.
    #[error("{code} of order {p} is too long; the largest possible prime is {largest}")]
    PrimeTooLarge {
        /// Which code, with its article.
        code: &'static str,
        /// The requested value.
        p: u32,
        /// The largest prime whose words fit.
        largest: u32,
    },
    /// A shift register has no such degree, or no preferred pair of it.
    #[error("{code} of degree {degree} is not possible; use {possible}")]
    Degree {
        /// Which code, with its article.
        code: &'static str,
        /// The requested value.
        degree: u32,
        /// The degrees there are, as the end of the sentence.
        possible: &'static str,
    },
    /// A word without chips, or with chips that have no 16-bit index.
    #[error("a code word of {length} chips is not possible; use 1 to 65535")]
    WordLength {
        /// The requested value.
        length: u32,
    },
    /// A word without marks, or with more marks than chips.
    #[error("{weight} marks in a code word of {length} chips are not possible; use 1 to {length}")]
    Weight {
        /// Marks asked for.
        weight: u32,
        /// Chips of the word.
        length: u32,
    },
    /// Marks that do not fit into a word so far apart.
    #[error(
        "{weight} marks that are {gap} chips apart are not possible in a code word of {length} \
         chips; use a gap of 1 to {widest}"
    )]
    Gap {
        /// Gap asked for.
        gap: u32,
        /// Marks of the word.
        weight: u32,
        /// Chips of the word.
        length: u32,
        /// The widest gap that fits.
        widest: u32,
    },
    /// More words than have an index, or none.
    #[error("a family of {words} words is not possible; use 1 to {possible}")]
    Words {
        /// The requested value.
        words: u32,
        /// Most words of a family.
        possible: u32,
    },
    /// Echoes of a word come while too many others are sent.
    #[error(
        "words that follow each other for later = {later} words are not possible; use 0 to {possible}"
    )]
    Later {
        /// The requested value.
        later: u32,
        /// Most words behind each other.
        possible: u32,
    },
    /// That number of orthogonal words does not exist.
    #[error(
        "{words} words of {weight} marks in {length} chips cannot be orthogonal; there are {bound} \
         at most (Johnson bound): use longer words or fewer marks"
    )]
    JohnsonBound {
        /// Words asked for.
        words: u32,
        /// Chips of a word.
        length: u32,
        /// Marks of a word.
        weight: u32,
        /// ⌊(n − 1)/(w·(w − 1))⌋
        bound: u32,
    },
    /// The search does not find that number of orthogonal words, though they may exist.
    #[error(
        "the search finds {found} of {words} orthogonal words of {weight} marks in {length} chips: \
         ask for fewer, or use longer words or fewer marks"
    )]
    NotFound {
        /// Words asked for.
        words: u32,
        /// Chips of a word.
        length: u32,
        /// Marks of a word.
        weight: u32,
        /// Words found.
        found: u32,
    },
    /// The search finds no room for that number of distances between marks.
    #[error(
        "the search finds {found} of {words} words of {weight} marks in {length} chips of which all \
         distances are {gap} chips or more and {apart} apart: ask for fewer, longer or nearer ones"
    )]
    Crowded {
        /// Words asked for.
        words: u32,
        /// Marks of a word.
        weight: u32,
        /// Chips of a word.
        length: u32,
        /// Least distance.
        gap: u32,
        /// Least difference of distances.
        apart: u32,
        /// Words found.
        found: u32,
    },
    /// A word that is written out is nowhere lit.
    #[error(
        "word {word}, counted from 0, has no marks: list the chips at which it is lit, or leave it out"
    )]
    Dark {
        /// Which word.
        word: u32,
    },
    /// The marks of a word that is written out do not ascend.
    #[error(
        "word {word}, counted from 0, has chip {mark} behind chip {before}: list each lit chip once, in \
         ascending order"
    )]
    MarkOrder {
        /// Which word.
        word: u32,
        /// A mark.
        before: u32,
        /// The one behind it, which is no later.
        mark: u32,
    },
    /// A mark of a word that is written out lies beyond its end.
    #[error(
        "word {word}, counted from 0, is lit at chip {mark}, but its chips are 0 to {last}: use longer \
         words"
    )]
    MarkBeyond {
        /// Which word.
        word: u32,
        /// The mark.
        mark: u32,
        /// The last chip of a word.
        last: u32,
    },
    /// Two words that are written out are one.
    #[error(
        "words {one} and {other}, counted from 0, are the same: no receiver can tell them apart"
    )]
    SameWords {
        /// The one.
        one: u32,
        /// The other, behind it.
        other: u32,
    },
    /// A label must have between 1 and 16 bits.
    #[error("a label of {bits} bits is not possible; use 1 to 16 bits")]
    LabelBits {
        /// The requested value.
        bits: u32,
    },
    /// A checksum must have between 1 and 8 bits.
    #[error("a CRC of {width} bits is not possible; use 1 to 8 bits")]
    CrcWidth {
        /// The requested value.
        width: u8,
    },
    /// The polynomial or the initial value does not fit the width of the checksum.
    #[error("the CRC {part} {value:#b} does not fit {width} bits; the leading term is implied")]
    CrcTooWide {
        /// `polynomial` or `init`.
        part: &'static str,
        /// The requested value.
        value: u8,
        /// Bits of the checksum.
        width: u8,
    },
    /// A polynomial without the term 1 overlooks errors of a single bit.
    #[error("the CRC polynomial {polynomial:#b} must end in +1: set its lowest bit")]
    CrcWithoutOne {
        /// The requested value.
        polynomial: u8,
    },
    /// A codebook needs at least one label, and no more than the payload can tell apart.
    #[error("{labels} labels are not possible; this payload carries 1 to {possible}")]
    Labels {
        /// The requested value.
        labels: u32,
        /// Labels that have a payload of their own.
        possible: u32,
    },
    /// A chip of the macropulse has no 16-bit index.
    #[error(
        "a macropulse of {bits} bits × {length} chips has {chips} chips; \
         at most 65535 are possible: use a shorter code word or fewer payload bits"
    )]
    MacropulseTooLong {
        /// Bits of the payload.
        bits: u32,
        /// Chips of a code word.
        length: u32,
        /// Chips of the macropulse.
        chips: u32,
    },
    /// The templates would fill the memory.
    #[error(
        "the macropulses of {labels} labels with {words} words have {marks} marks; \
         at most {possible} are possible: use fewer labels or a smaller family"
    )]
    CodebookTooLarge {
        /// Labels asked for.
        labels: u32,
        /// Words of the family.
        words: usize,
        /// Marks of all templates together.
        marks: u64,
        /// Most marks a codebook may hold.
        possible: u64,
    },
}

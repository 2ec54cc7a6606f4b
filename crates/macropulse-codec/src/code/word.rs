//! One code word.

/// One word of a family: which of its chips are lit.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub struct CodeWord {
    /// Number of chips.
    pub length: u32,
    /// Indices of the lit chips, ascending, each below `length`.
    pub marks: Vec<u16>,
}

impl CodeWord {
    /// Number of marks.
    pub fn weight(&self) -> usize {
        self.marks.len()
    }

    /// The smallest cyclic shift, in chips, that maps the word to itself; `length` where only a
    /// full turn does.
    ///
    /// A word whose period is shorter than its length, as C0 of every prime code, cannot time an
    /// echo: it looks the same one period later.
    pub fn period(&self) -> u32 {
        (1..self.length)
            .filter(|shift| self.length.is_multiple_of(*shift))
            .find(|&shift| self.is_unchanged_by(shift))
            .unwrap_or(self.length)
    }

    fn is_unchanged_by(&self, shift: u32) -> bool {
        self.marks.iter().all(|&mark| {
            let moved = (u32::from(mark) + shift) % self.length;
            self.marks.binary_search_by_key(&moved, |&other| u32::from(other)).is_ok()
        })
    }

    /// The word with dark and lit chips exchanged.
    pub fn complement(&self) -> Self {
        let mut lit = self.marks.iter().map(|&mark| u32::from(mark)).peekable();
        let dark = (0..self.length).filter(|chip| lit.next_if_eq(chip).is_none());
        Self { length: self.length, marks: dark.map(|chip| chip as u16).collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_complement_has_the_other_chips_and_is_its_own_inverse() {
        let word = CodeWord { length: 6, marks: vec![0, 2, 5] };
        assert_eq!(word.complement().marks, [1, 3, 4]);
        assert_eq!(word.complement().complement(), word);
        assert_eq!(CodeWord { length: 3, marks: vec![] }.complement().marks, [0, 1, 2]);
    }
}

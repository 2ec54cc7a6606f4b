//! Help with misspelt names.

/// The one of `known` that `typed` was probably meant to be, if any is near enough.
pub fn nearest<'a>(typed: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    known
        .into_iter()
        .map(|name| (strsim::damerau_levenshtein(typed, name), name))
        .min()
        .filter(|(distance, name)| *distance <= 1 + name.len() / 4)
        .map(|(_, name)| name)
}

#[cfg(test)]
mod tests {
    use super::nearest;

    #[test]
    fn a_slip_is_understood_and_nonsense_is_not() {
        let known = ["hdl-64e", "peregrine"];
        assert_eq!(nearest("hdl64e", known), Some("hdl-64e"));
        assert_eq!(nearest("perigrine", known), Some("peregrine"));
        assert_eq!(nearest("banana", known), None);
    }
}

//! Names and texts: help with misspelt ones, and their digests.

/// The one of `known` that `typed` was probably meant to be, if any is near enough.
pub fn nearest<'a>(typed: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    known
        .into_iter()
        .map(|name| (strsim::damerau_levenshtein(typed, name), name))
        .min()
        .filter(|(distance, name)| *distance <= 1 + name.len() / 4)
        .map(|(_, name)| name)
}

/// The 64-bit FNV-1a hash of a text \[FNV\], in hexadecimal.
pub fn digest(text: &str) -> String {
    let hash = text.bytes().fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
    });
    format!("{hash:016x}")
}

#[cfg(test)]
mod tests {
    use super::{digest, nearest};

    #[test]
    fn the_digest_has_the_published_values() {
        assert_eq!(digest(""), "cbf29ce484222325");
        assert_eq!(digest("foobar"), "85944171f73967e8");
    }

    #[test]
    fn a_slip_is_understood_and_nonsense_is_not() {
        let known = ["hdl-64e", "peregrine"];
        assert_eq!(nearest("hdl64e", known), Some("hdl-64e"));
        assert_eq!(nearest("perigrine", known), Some("peregrine"));
        assert_eq!(nearest("banana", known), None);
    }
}

//! Calls of libraries that may panic where a file is damaged.

use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind};

thread_local! {
    static IS_CONTAINED: Cell<bool> = const { Cell::new(false) };
}

/// Returns true if this thread calls a library that may panic where a file is damaged. The panic is then told
/// as an error, so a panic hook need not tell it.
pub fn is_contained() -> bool {
    IS_CONTAINED.get()
}

/// Returns the result of `read`.
///
/// The decoders of LAZ and MCAP that we use check most of what a file says, but not all. An arithmetic code
/// may name a symbol that there is not, or a record may be longer than the chunk that it is in. They panic
/// then. Whatever `read` has changed must not be used afterwards.
///
/// # Errors
/// If it panics: that the data is damaged.
pub(super) fn contained<T>(read: impl FnOnce() -> T) -> Result<T, String> {
    let before = IS_CONTAINED.replace(true);
    let result = catch_unwind(AssertUnwindSafe(read));
    IS_CONTAINED.set(before);
    result.map_err(|_| "its data is damaged".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[allow(clippy::panic)]
    fn a_panic_is_an_error_and_what_follows_is_told_again() {
        assert_eq!(contained(|| 7), Ok(7));
        let panics = |()| panic!("a symbol that there is not: {}", is_contained());
        assert_eq!(contained(|| panics(())), Err::<(), _>("its data is damaged".to_owned()));
        assert!(!is_contained());
    }
}

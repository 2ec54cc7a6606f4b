//! Code families beside each other, for programs.

use macropulse::predict::comparison::Comparison;
use macropulse::predict::multiple_access::{bit_error_hard, bit_error_soft};
use serde_json::{Value, json};

/// How many send at once where errors are told; the paper has 25 shots in flight.
pub const USERS: [u32; 3] = [10, 16, 25];

/// Returns the properties of a family as an object; unknown ones are null.
pub fn told(of: &Comparison) -> Value {
    let errors = USERS.into_iter().filter_map(|users| {
        let access = of.users(users)?;
        let (soft, hard) = (bit_error_soft(&access), bit_error_hard(&access));
        Some(json!({ "users": users, "soft": soft, "hard": hard }))
    });
    json!({
        "family": of.family.to_string(),
        "length_chips": of.family.length(),
        "marks_min": of.marks.0,
        "marks_max": of.marks.1,
        "words": of.family.count(),
        "words_compared": of.compared,
        "sidelobe_periodic": of.sidelobes.0,
        "sidelobe_aperiodic": of.sidelobes.1,
        "cross_max_periodic": of.crosses.0,
        "cross_max_aperiodic": of.crosses.1,
        "cross_mean": of.spread.0,
        "cross_variance": of.spread.1,
        "harmless_interferers": of.harmless_interferers(),
        "bit_errors": errors.collect::<Vec<_>>(),
    })
}

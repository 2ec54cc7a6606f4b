//! Claims of the paper, judged by measurements. Nothing is measured here: verdicts depend on the numbers
//! alone.

mod code;
mod conclusion;
mod equations;
mod experiment;
mod light;
mod methods;
mod system;

pub use experiment::RECOGNISED;
pub use methods::COMPARED_M;
pub(super) use methods::line;

use super::claim::Claim;
use super::measured::{Measured, OnPaper};

/// Rows whose verdict follows from no number, because the sentence has none to measure.
pub const NOT_MEASURED: [&str; 2] = ["end-robots", "end-surroundings"];

/// All rows.
pub fn judge(measured: &Measured) -> Vec<Claim> {
    let mut claims = judge_on_paper(&measured.on_paper);
    claims.extend(experiment::claims(measured));
    claims.extend(methods::claims(&measured.methods));
    claims.extend(conclusion::claims(measured));
    claims
}

/// The rows that need no experiment.
pub fn judge_on_paper(found: &OnPaper) -> Vec<Claim> {
    let mut claims = code::words(&found.words, &found.timing);
    claims.extend(code::payload(&found.payloads, &found.timing));
    claims.extend(equations::claims(&found.equations));
    claims.extend(system::timing(&found.timing));
    claims.extend(system::converters(&found.converters));
    claims.extend(light::claims(&found.light, &found.timing));
    claims.extend(system::head(&found.head));
    claims
}

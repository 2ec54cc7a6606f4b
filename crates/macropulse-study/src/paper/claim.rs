//! A sentence of the paper, what was measured, and whether it holds.

use serde::Serialize;

/// Whether a claim holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// As printed, to rounding.
    Holds,
    /// With a condition that the paper does not state.
    Partly,
    /// Not as printed.
    Fails,
    /// Left open by the paper; what we do instead is said.
    Unsaid,
    /// Cannot be simulated; assumed, and declared as an idealisation.
    Assumed,
}

impl Verdict {
    /// Name used in files and reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Holds => "holds",
            Self::Partly => "partly",
            Self::Fails => "fails",
            Self::Unsaid => "unsaid",
            Self::Assumed => "assumed",
        }
    }
}

/// One claim of \[KP16\].
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Claim {
    /// Short stable name.
    pub id: &'static str,
    /// Section, table or figure of the paper.
    pub section: &'static str,
    /// What it says.
    pub claim: &'static str,
    /// The paper's number or word.
    pub paper: String,
    /// What was measured, and how.
    pub measured: String,
    /// Whether it holds.
    pub verdict: Verdict,
}

/// `Holds` or `Fails`.
pub(super) fn holds(is_true: bool) -> Verdict {
    if is_true { Verdict::Holds } else { Verdict::Fails }
}

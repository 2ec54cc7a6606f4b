//! A sentence of the paper, what was measured, and whether it holds.

use serde::Serialize;

/// Verdict on a claim.
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

/// All claims as Markdown, sorted by their verdicts: how docs/paper.md ends.
pub fn listing(claims: &[Claim]) -> String {
    use Verdict::{Assumed, Fails, Holds, Partly, Unsaid};
    let mut text = String::new();
    for verdict in [Holds, Partly, Fails, Unsaid, Assumed] {
        let name = verdict.name();
        text += &format!(
            "\n### Verdict: {name}\n\n| row | the paper says | measured |\n|---|---|---|\n"
        );
        for claim in claims.iter().filter(|claim| claim.verdict == verdict) {
            let cell = |text: &str| text.replace('|', "\\|");
            let (said, measured) = (cell(claim.claim), cell(&claim.measured));
            text += &format!("| `{}` | {said} | {measured} |\n", claim.id);
        }
    }
    text
}

/// One claim of \[KP16\].
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Claim {
    /// Short stable name.
    pub id: &'static str,
    /// Section, table or figure of the paper.
    pub section: &'static str,
    /// The claim in words.
    pub claim: &'static str,
    /// The paper's number or word.
    pub paper: &'static str,
    /// The measurement and its method.
    pub measured: String,
    /// Verdict on the claim.
    pub verdict: Verdict,
}

/// Returns a claim of the paper before it is judged: `id`, section, claim, and its number or word.
pub(super) fn said(
    id: &'static str,
    section: &'static str,
    claim: &'static str,
    paper: &'static str,
) -> Said {
    Said { id, section, claim, paper }
}

/// A sentence of the paper.
pub(super) struct Said {
    id: &'static str,
    section: &'static str,
    claim: &'static str,
    paper: &'static str,
}

impl Said {
    /// Judged so, for what was `measured`.
    pub fn is(self, verdict: Verdict, measured: String) -> Claim {
        let Self { id, section, claim, paper } = self;
        Claim { id, section, claim, paper, measured, verdict }
    }

    /// Holds or fails.
    pub fn holds_if(self, is_true: bool, measured: String) -> Claim {
        self.is(if is_true { Verdict::Holds } else { Verdict::Fails }, measured)
    }

    /// Holds if it does `wholly`, in part if what is left of it does, else fails.
    pub fn holds_or_partly(self, wholly: bool, in_part: bool, measured: String) -> Claim {
        self.is(in_three(wholly, in_part), measured)
    }
}

/// Holds `wholly`, partly, or not at all.
pub(super) fn in_three(wholly: bool, in_part: bool) -> Verdict {
    match (wholly, in_part) {
        (true, _) => Verdict::Holds,
        (false, true) => Verdict::Partly,
        (false, false) => Verdict::Fails,
    }
}

//! The conclusion of the paper, sentence by sentence: does it hold, and what replaces it?

use super::Findings;
use super::claim::Claim;
use super::tables;
use crate::view::{Align, Cell, Table};

/// Returns the idealisations that the sentence of a row needs, and what replaces it.
fn beside(claim: &Claim, findings: &Findings) -> (&'static str, String) {
    let found = &findings.measured.on_paper;
    let outlook = &found.outlook;
    match claim.id {
        "end-waiting" => (
            "those of `kim-park-2016`, below",
            "`coded-practical` does it with none of them, on surfaces that are not aslant"
                .to_owned(),
        ),
        "end-macropulse" => (
            "none",
            "a sync bit, `kim-park-2016-fixed`; or no label where pattern and time tell the shot"
                .to_owned(),
        ),
        "end-mirror" => {
            ("`mirror-motion`", format!("macropulses of {:.2} pixel", outlook.practical_macropulse))
        }
        "end-emission-time" => (
            "no mark is missed, none is false",
            format!(
                "whole macropulses matched, and more words: they return after {:.0} m",
                outlook.practical_words
            ),
        ),
        "end-refresh" => (
            "`link-budget`, `eye-safety`, `background`, `footprint`, `mirror-motion`, \
             `detector-bandwidth`",
            format!(
                "`coded-practical`: Pd {:.3} from 10 % at {:.0} m by day, forecast",
                outlook.practical_pd, found.timing.rated_range
            ),
        ),
        "end-360" => ("nothing", "`coded-360`".to_owned()),
        "half-terahertz" | "end-slower" | "end-synchronous" => {
            ("those of `kim-park-2016`", "`bipolar-gold`".to_owned())
        }
        _ => ("", String::new()),
    }
}

/// The table of sentences.
pub(super) fn table(findings: &Findings) -> Table {
    let header = [
        ("the paper concludes", Align::Left),
        ("holds?", Align::Left),
        ("what was found", Align::Left),
        ("under these idealisations", Align::Left),
        ("what replaces it", Align::Left),
    ];
    let is_sentence = |claim: &&Claim| claim.section.starts_with('4');
    let rows = findings.claims.iter().filter(is_sentence);
    rows.fold(Table::new("", &header), |table, claim| {
        let (idealised, instead) = beside(claim, findings);
        table.row(vec![
            Cell::from(claim.claim),
            tables::verdict(claim),
            Cell::from(&claim.measured),
            Cell::from(idealised),
            Cell::from(instead),
        ])
    })
}

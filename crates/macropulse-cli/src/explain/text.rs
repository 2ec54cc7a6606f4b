//! Why a shot was decided as it was, in words.

use macropulse::codec::decode::{Explanation, Reject};
use macropulse::units::range_from_tof;

use super::Explained;
use crate::text::{Columns, counted, grouped, short};

/// Other shots that are listed; of more only the number is told.
const MOST_OTHERS: usize = 8;

impl Explained<'_> {
    /// What the receiver decided, in a word.
    pub(super) fn decided(&self) -> &'static str {
        let verdict = &self.explanation.verdict;
        match (verdict.returns.is_empty(), verdict.rejects.first()) {
            (false, _) => "accepted",
            (true, Some((kind, _))) => kind.name(),
            (true, None) => "not_found",
        }
    }

    /// Why, in sentences.
    pub(super) fn why(&self) -> String {
        let verdict = &self.explanation.verdict;
        let mut said: Vec<String> = Vec::new();
        for one in &verdict.returns {
            said.push(format!(
                "A return was accepted at {} m: {} of {} marks were found, {} more than at the best \
                 other lag that the receiver looked at.",
                short(range_from_tof(one.tof)),
                one.peak,
                one.marks,
                one.margin
            ));
        }
        said.extend(verdict.rejects.iter().map(|(kind, _)| self.refused(*kind)));
        if said.is_empty() {
            said.push(
                "The receiver goes from tick to tick, and no macropulse that it opened led to this \
                 shot."
                    .to_owned(),
            );
        }
        said.join(" ")
    }

    fn refused(&self, kind: Reject) -> String {
        match kind {
            Reject::NoPeak => self.no_peak(),
            Reject::Crc => "The checksum did not fit the bits that were read.".to_owned(),
            Reject::UnknownShot => {
                "The label that was read is of no shot in flight at that time.".to_owned()
            }
            Reject::LabelMismatch => format!(
                "{} but the macropulse there carries other bits than this shot: a bit is lit that \
                 should be dark, or dark that should be lit.",
                self.best("Most marks")
            ),
            Reject::OutsideGate => format!(
                "The light fits rather a shot from beyond the range gate, which ends at {} m: {}.",
                short(self.range(self.explanation.gate.end - 1)),
                self.best("within it most marks")
            ),
        }
    }

    /// Why no lag was believed, by the numbers.
    fn no_peak(&self) -> String {
        let Explanation { marks, peak, threshold, left, gate, step, .. } = &self.explanation;
        if marks.is_empty() {
            return "The macropulse of this shot has no mark: it is dark, and cannot be found."
                .to_owned();
        }
        let Some((lag, count)) = *peak else {
            return "No tick lies where light of this shot could come.".to_owned();
        };
        let best = self.best("Most marks");
        match threshold {
            Some(threshold) if u32::from(count) < *threshold => format!(
                "{best}; in this density of ticks chance could give that many somewhere in the gate, \
                 and {threshold} would be needed."
            ),
            _ => {
                let place = usize::try_from((lag - gate.start) / step).unwrap_or(0);
                let left = left.get(place).copied().unwrap_or(0);
                format!(
                    "{best}; but light of other shots accounts for {} of them, and with the {left} \
                     that are left the receiver did not believe it.",
                    count.saturating_sub(left)
                )
            }
        }
    }

    /// "Most marks, 40 of 174, are found at 31.2 m".
    fn best(&self, most: &str) -> String {
        let all = self.explanation.marks.len();
        match self.explanation.peak {
            None => format!("{most} are none"),
            Some((lag, count)) => {
                format!("{most}, {count} of {all}, are found at {} m", short(self.range(lag)))
            }
        }
    }

    /// All of it for people.
    pub fn text(&self) -> String {
        let Explanation { marks, ticks, density, threshold, gate, .. } = &self.explanation;
        let mut columns = Columns::default();
        columns.push("decided", self.decided().replace('_', " "));
        columns.push("why", self.why());
        columns.push(
            "sent",
            format!(
                "label {}, word {}: {} at {} fs",
                self.label,
                self.word,
                counted(marks.len() as u64, "mark"),
                grouped(self.fired_fs.unsigned_abs())
            ),
        );
        columns.push(
            "gate",
            format!(
                "{} to {} m, {} lags",
                short(self.range(gate.start)),
                short(self.range(gate.end - 1)),
                grouped((gate.end - gate.start) as u64)
            ),
        );
        columns.push("light", self.light_text());
        columns.push(
            "ticks",
            format!(
                "{} in its time, {} of them accounted for by other shots; {} % of the places are lit",
                grouped(ticks.len() as u64),
                grouped(self.claimed() as u64),
                short((density * 1e4).round() / 1e2)
            ),
        );
        if let Some(threshold) = threshold {
            columns.push(
                "threshold",
                format!("{} at this density, over all lags", counted((*threshold).into(), "mark")),
            );
        }
        for (name, place) in
            [("peak", self.explanation.peak), ("sidelobe", self.explanation.sidelobe)]
        {
            let text = place.map_or("none".to_owned(), |(lag, count)| {
                format!("{count} of {} marks at {} m", marks.len(), short(self.range(lag)))
            });
            columns.push(name, text);
        }
        columns.push_list("others", self.listed_others());
        let (row, column) = self.pixel;
        format!("row {row}, column {column}, shot {}\n\n{}", self.id, columns.text())
    }

    fn listed_others(&self) -> Vec<String> {
        let mut order: Vec<_> = self.explanation.others.iter().zip(&self.others).collect();
        order.sort_by_key(|(other, _)| std::cmp::Reverse((other.shared, other.marks)));
        let more = order.len().saturating_sub(MOST_OTHERS);
        let say = |(other, (row, column)): &(
            &macropulse::codec::decode::OtherLight,
            &super::Pixel,
        )| {
            format!(
                "row {row}, column {column}: {} here, {} of them where this shot has one at its peak",
                counted(other.marks.into(), "mark"),
                other.shared
            )
        };
        let mut list: Vec<String> = order.iter().take(MOST_OTHERS).map(say).collect();
        if more > 0 {
            list.push(format!("and {more} more"));
        }
        list
    }
}

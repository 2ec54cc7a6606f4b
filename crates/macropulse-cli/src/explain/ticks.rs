//! What is told of a shot that was decided by ticks.

use macropulse::codec::decode::{Explanation, OtherLight, Reject};
use serde_json::{Value, json};

use super::{Explained, Pixel};
use crate::text::{Columns, counted, grouped, short};

/// Other shots that are listed; of more only the number is told.
pub(super) const MOST_OTHERS: usize = 8;

impl Explained<'_> {
    /// Adds what is `told` to programs, the correlation apart.
    pub(super) fn add_ticks(&self, told: &Explanation, json: &mut Value) {
        let at = |place: Option<(i64, u16)>| {
            place.map(|(lag, marks)| {
                json!({ "lag_ticks": lag, "range_m": self.range(lag), "marks": marks })
            })
        };
        let others = told.others.iter().zip(&self.others).map(|(other, (row, column))| {
            json!({
                "row": row,
                "column": column,
                "begins_ticks": other.begins,
                "marks": other.marks,
                "shared": other.shared,
            })
        });
        json["window_ticks"] = told.width.into();
        json["ticks_in_time"] = told.ticks.len().into();
        json["ticks_of_others"] = claimed(told).into();
        json["density"] = told.density.into();
        json["threshold_marks"] = told.threshold.into();
        json["peak"] = at(told.peak).into();
        json["sidelobe"] = at(told.sidelobe).into();
        json["others"] = others.collect();
    }

    /// Adds every tick and every lag.
    pub(super) fn add_all_ticks(&self, told: &Explanation, json: &mut Value) {
        let Explanation { ticks, gate, step, found, left, .. } = told;
        json["ticks"] = ticks.iter().map(|(tick, _)| *tick).collect();
        json["is_of_others"] = ticks.iter().map(|(_, claimed)| *claimed).collect();
        json["correlation"] = json!({
            "first_lag_ticks": gate.start,
            "step_ticks": step,
            "first_range_m": self.range(gate.start),
            "step_m": self.range(gate.start + step) - self.range(gate.start),
            "marks": found,
            "marks_without_others": left,
        });
    }

    /// Why macropulses were refused so.
    pub(super) fn refused(&self, told: &Explanation, kind: Reject) -> String {
        match kind {
            Reject::NoPeak => self.no_peak(told),
            Reject::Crc => "The checksum did not fit the bits that were read.".to_owned(),
            Reject::UnknownShot => {
                "The label that was read is of no shot in flight at that time.".to_owned()
            }
            Reject::LabelMismatch => format!(
                "{} but the macropulse there carries other bits than this shot: a bit is lit that \
                 should be dark, or dark that should be lit.",
                self.best(told, "Most marks")
            ),
            Reject::OutsideGate => format!(
                "The light fits rather a shot from beyond the range gate, which ends at {} m: {}.",
                short(self.range(told.gate.end - 1)),
                self.best(told, "within it most marks")
            ),
        }
    }

    /// Why no lag was believed, by the numbers.
    fn no_peak(&self, told: &Explanation) -> String {
        let Explanation { marks, peak, threshold, left, gate, step, .. } = told;
        if marks.is_empty() {
            return "The macropulse of this shot has no mark: it is dark, and cannot be found."
                .to_owned();
        }
        let Some((lag, count)) = *peak else {
            return "No tick lies where light of this shot could come.".to_owned();
        };
        let best = self.best(told, "Most marks");
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
    fn best(&self, told: &Explanation, most: &str) -> String {
        let all = told.marks.len();
        match told.peak {
            None => format!("{most} are none"),
            Some((lag, count)) => {
                format!("{most}, {count} of {all}, are found at {} m", short(self.range(lag)))
            }
        }
    }

    /// What is `told` to people of the ticks and their correlation.
    pub(super) fn push_ticks(&self, told: &Explanation, columns: &mut Columns) {
        let Explanation { marks, ticks, density, threshold, .. } = told;
        columns.push(
            "ticks",
            format!(
                "{} in its time, {} of them accounted for by other shots; {} % of the places are lit",
                grouped(ticks.len() as u64),
                grouped(claimed(told) as u64),
                short((density * 1e4).round() / 1e2)
            ),
        );
        if let Some(threshold) = threshold {
            columns.push(
                "threshold",
                format!("{} at this density, over all lags", counted((*threshold).into(), "mark")),
            );
        }
        for (name, place) in [("peak", told.peak), ("sidelobe", told.sidelobe)] {
            let text = place.map_or("none".to_owned(), |(lag, count)| {
                format!("{count} of {} marks at {} m", marks.len(), short(self.range(lag)))
            });
            columns.push(name, text);
        }
        columns.push_list("others", self.listed_others(told));
    }

    fn listed_others(&self, told: &Explanation) -> Vec<String> {
        let mut order: Vec<_> = told.others.iter().zip(&self.others).collect();
        order.sort_by_key(|(other, _)| std::cmp::Reverse((other.shared, other.marks)));
        let more = order.len().saturating_sub(MOST_OTHERS);
        let say = |(other, (row, column)): &(&OtherLight, &Pixel)| {
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

/// How many ticks other shots account for.
fn claimed(told: &Explanation) -> usize {
    told.ticks.iter().filter(|(_, claimed)| *claimed).count()
}

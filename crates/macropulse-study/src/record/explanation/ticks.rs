//! The explanation of a shot that was decided by ticks.

use std::cmp::Reverse;

use macropulse::codec::decode::{self, Explanation, Reject};
use macropulse::codec::{self, RecordKind, ShotLog};
use macropulse::design::Design;
use macropulse::units::range_from_tof;
use serde::{Deserialize, Serialize};

use super::curve::{Curve, Scale, Words};
use super::light::Light;
use super::odds::Odds;
use super::{Decision, MOST_OTHERS, Record, RecordExplanation, Sent, Shot};
use crate::text::{Columns, counted, grouped, short};
use crate::view::{Axis, Chart, Hue, Series, Style};

const WORDS: Words = Words {
    title: "Marks found",
    axis: "Marks",
    all: "all ticks",
    left: "without those of other shots",
    is_left_lowest: false,
};

/// The ticks in the time of a shot, and how many marks are found in them.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Ticks {
    /// For how many ticks a mark is looked for.
    window_ticks: u32,
    ticks_in_time: usize,
    ticks_of_others: usize,
    /// Share of the places at which a mark is found by chance.
    density: f64,
    /// Null of other receivers than the matched one.
    odds: Option<Odds>,
    peak: Option<Place>,
    sidelobe: Option<Place>,
    others: Vec<OtherShot>,
    /// Every tick and every lag; nothing in a summary.
    #[serde(flatten)]
    whole: Option<Whole>,
}

/// A lag and its marks.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Place {
    lag_ticks: i64,
    range_m: f64,
    marks: u16,
}

/// Another shot whose light is there.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct OtherShot {
    row: u16,
    column: u16,
    begins_ticks: i64,
    marks: u32,
    /// Marks where this shot has one at its peak.
    shared: u32,
}

#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Whole {
    ticks: Vec<i64>,
    is_of_others: Vec<bool>,
    pub correlation: Correlation,
}

#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Correlation {
    #[serde(flatten)]
    pub scale: Scale,
    marks: Vec<u16>,
    marks_without_others: Vec<u16>,
    /// To hundredths; null of other receivers than the matched one.
    evidence_nats: Option<Vec<f32>>,
}

/// Explains shot number `at` of a band out of its `ticks`.
pub(super) fn decision<'a>(
    design: &Design,
    (log, ticks): (&'a ShotLog, &codec::Ticks),
    at: usize,
) -> Result<Decision<'a>, decode::Error> {
    let told = design.receiver.explain(&design.emission.coding().codebook, (log, ticks), at)?;
    let tick_fs = design.clock.tick_fs;
    // A tick stands for its middle.
    let shot = Shot { log, at, fired_tick: told.fired_tick, tick_fs, within_tick_fs: tick_fs / 2 };
    let odds = told.odds.as_ref().map(|odds| Odds::new(odds, &shot));
    let why = Reasons { told: &told, shot: &shot, odds: odds.as_ref() }.text();
    let place =
        |(lag, marks): (i64, u16)| Place { lag_ticks: lag, range_m: shot.range(lag), marks };
    let others = told.others.iter().map(|other| {
        let (row, column) = shot.pixel(other.shot);
        let decode::OtherLight { begins, marks, shared, .. } = *other;
        OtherShot { row, column, begins_ticks: begins, marks, shared }
    });
    let (ticks, is_of_others): (Vec<i64>, Vec<bool>) = told.ticks.iter().copied().unzip();
    let rounded = |nats: &f32| (nats * 100.0).round() / 100.0;
    let record = Ticks {
        window_ticks: told.width,
        ticks_in_time: ticks.len(),
        ticks_of_others: is_of_others.iter().filter(|claimed| **claimed).count(),
        density: told.density,
        odds,
        peak: told.peak.map(place),
        sidelobe: told.sidelobe.map(place),
        others: others.collect(),
        whole: Some(Whole {
            ticks,
            is_of_others,
            correlation: Correlation {
                scale: Scale::new(told.gate.start, told.step, &shot),
                marks: told.found,
                marks_without_others: told.left,
                evidence_nats: told.odds.map(|odds| odds.evidence.iter().map(rounded).collect()),
            },
        }),
    };
    Ok(Decision {
        shot,
        marks: told.marks,
        gate: told.gate,
        width: told.width,
        verdict: told.verdict,
        why,
        record: Record::Ticks(record),
    })
}

/// Why a shot was decided so, by the numbers.
struct Reasons<'a> {
    told: &'a Explanation,
    shot: &'a Shot<'a>,
    odds: Option<&'a Odds>,
}

impl Reasons<'_> {
    fn text(&self) -> String {
        let verdict = &self.told.verdict;
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

    /// Why macropulses were refused so.
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
                short(self.shot.range(self.told.gate.end - 1)),
                self.best("within it most marks")
            ),
        }
    }

    /// Why no lag was believed.
    fn no_peak(&self) -> String {
        let Explanation { marks, peak, left, gate, step, .. } = self.told;
        if marks.is_empty() {
            return "The macropulse of this shot has no mark: it is dark, and cannot be found."
                .to_owned();
        }
        let Some((lag, count)) = *peak else {
            return "No tick lies where light of this shot could come.".to_owned();
        };
        let best = self.best("Most marks");
        if let Some(odds) = self.odds {
            return format!("{best}; {}.", odds.refusal());
        }
        let place = usize::try_from((lag - gate.start) / step).unwrap_or(0);
        let left = left.get(place).copied().unwrap_or(0);
        format!(
            "{best}; but light of other shots accounts for {} of them, and with the {left} that are \
             left the receiver did not believe it.",
            count.saturating_sub(left)
        )
    }

    /// "Most marks, 40 of 174, are found at 31.2 m".
    fn best(&self, most: &str) -> String {
        let all = self.told.marks.len();
        match self.told.peak {
            None => format!("{most} are none"),
            Some((lag, count)) => {
                let range = short(self.shot.range(lag));
                format!("{most}, {count} of {all}, are found at {range} m")
            }
        }
    }
}

impl RecordExplanation for Ticks {
    fn kind(&self) -> RecordKind {
        RecordKind::Ticks
    }

    fn scale(&self) -> Option<&Scale> {
        self.whole.as_ref().map(|whole| &whole.correlation.scale)
    }

    fn shorten(&mut self) {
        self.whole = None;
    }

    /// Adds the lines about the ticks and their correlation; the macropulse has `marks` marks.
    fn push(&self, marks: usize, columns: &mut Columns) {
        columns.push(
            "ticks",
            format!(
                "{} in its time, {} of them accounted for by other shots; {} % of the places are lit",
                grouped(self.ticks_in_time as u64),
                grouped(self.ticks_of_others as u64),
                short((self.density * 1e4).round() / 1e2)
            ),
        );
        for (name, place) in [("peak", &self.peak), ("sidelobe", &self.sidelobe)] {
            let text = place.as_ref().map_or("none".to_owned(), |place| {
                format!("{} of {marks} marks at {} m", place.marks, short(place.range_m))
            });
            columns.push(name, text);
        }
        if let Some(odds) = &self.odds {
            odds.push(marks, columns);
        }
        let mut others: Vec<&OtherShot> = self.others.iter().collect();
        others.sort_by_key(|other| Reverse((other.shared, other.marks)));
        columns.push_some("others", &others, MOST_OTHERS, |other| {
            format!(
                "row {}, column {}: {} here, {} of them where this shot has one at its peak",
                other.row,
                other.column,
                counted(other.marks.into(), "mark"),
                other.shared
            )
        });
    }

    /// The ticks of a macropulse with its marks `sent`, and the correlation; each chart with its caption.
    fn charts(&self, sent: &Sent) -> Option<Vec<(Chart, &'static str)>> {
        let (sent, light) = (sent.marks, sent.light);
        let whole = self.whole.as_ref()?;
        let said = match light {
            None => {
                "The marks of the macropulse where the correlation is highest, and the ticks there. \
                 What light there was is not known: ticks are all that was decoded."
            }
            Some(_) => {
                "From the top: light and what the detector made of it, which the receiver never \
                 sees; the ticks, which are all it has; and the marks of the macropulse where the \
                 correlation is highest."
            }
        };
        let arrivals = self.arrivals(whole, sent, light).map(|chart| (chart, said));
        let counts = |counts: &[u16]| counts.iter().copied().map(f64::from).collect();
        let said =
            |peak: &Place| format!("{} of {} at {:.3} m", peak.marks, sent.len(), peak.range_m);
        let curve = Curve {
            words: &WORDS,
            scale: &whole.correlation.scale,
            found: counts(&whole.correlation.marks),
            left: counts(&whole.correlation.marks_without_others),
            most: sent.len().max(1) as f64,
            threshold: None,
            peak: self.peak.as_ref().map(|peak| (peak.lag_ticks, said(peak))),
        };
        let weighed = self.odds.iter().zip(&whole.correlation.evidence_nats);
        let weighed = weighed.flat_map(|(odds, evidence)| odds.charts(curve.scale, evidence));
        let curves = curve.charts().into_iter().chain(weighed).map(|chart| (chart, ""));
        Some(arrivals.into_iter().chain(curves).collect())
    }
}

impl Ticks {
    /// The arrivals in the time of one macropulse: at the highest correlation, or else at the light of the shot.
    fn arrivals(&self, whole: &Whole, sent: &[u32], light: Option<&Light>) -> Option<Chart> {
        let lanes_of_light = light.map(Light::lanes);
        let of_light = || {
            let [ours, ..] = lanes_of_light.as_ref()?;
            Some(ours.first()?.floor() as i64 - i64::from(*sent.first()?))
        };
        let lag = self.peak.as_ref().map(|peak| peak.lag_ticks).or_else(of_light)?;
        let marks: Vec<i64> = sent.iter().map(|mark| i64::from(*mark) + lag).collect();
        let window = i64::from(self.window_ticks.max(1));
        let (first, last) = (*marks.first()?, *marks.last()? + window);
        let ticks = whole.ticks.iter().copied().zip(whole.is_of_others.iter().copied());
        let [mut ours, mut others, mut rest] = [Vec::new(), Vec::new(), Vec::new()];
        for (tick, is_of_others) in ticks.filter(|(tick, _)| (first..=last).contains(tick)) {
            let before = marks.partition_point(|mark| *mark <= tick);
            let is_on_mark = before > 0 && tick - marks[before - 1] < window;
            let lane = match (is_on_mark, is_of_others) {
                (true, _) => &mut ours,
                (false, true) => &mut others,
                (false, false) => &mut rest,
            };
            lane.push(tick as f64);
        }
        let sent = marks.iter().map(|mark| *mark as f64).collect();
        let mut lanes = vec![
            ("marks sent", Hue::Blue, sent),
            ("ticks on a mark", Hue::Green, ours),
            ("ticks of other shots", Hue::Orange, others),
            ("other ticks", Hue::Grey, rest),
        ];
        if let Some([ours, others, events]) = lanes_of_light {
            lanes.push(("detection events", Hue::Grey, events));
            lanes.push(("light of others", Hue::Orange, others));
            lanes.push(("light of this shot", Hue::Green, ours));
        }
        let names: Vec<&str> = lanes.iter().map(|(name, ..)| *name).collect();
        let x = Axis::linear("Ticks since the shot").limits(first as f64, last as f64);
        let mut chart =
            Chart::new("What was sent and what came back", x, Axis::categories("Arrivals", &names));
        chart.size = [904.0, 80.0 + 40.0 * lanes.len() as f64];
        let is_shown = |at: &f64| (first as f64..=last as f64 + 1.0).contains(at);
        for (place, (_, hue, times)) in lanes.into_iter().enumerate() {
            let times = times.into_iter().filter(is_shown);
            let points = times.map(|at| [at, place as f64]).collect();
            chart.series.push(Series { label: String::new(), points, style: Style::Points, hue });
        }
        Some(chart)
    }
}

#[cfg(test)]
pub(super) mod tests {
    use serde_json::{Value, json};

    use super::super::light::tests::light;
    use super::super::tests::{explanation, html};
    use super::super::{PixelExplanation, Record};
    use super::*;

    pub fn record() -> Value {
        json!({
            "window_ticks": 2, "ticks_in_time": 6, "ticks_of_others": 2, "density": 0.25,
            "odds": {
                "lag_ticks": 41, "range_m": 30.5, "unclaimed_marks": 4, "lit_marks": 4,
                "evidence_nats": 9.5, "prior_nats": -1.1, "threshold_nats": 6.9,
                "label_contradiction_nats": null, "reach_ticks": [40, 52],
                "expected": [{ "lag_ticks": 40, "range_m": 30.1 }],
            },
            "peak": { "lag_ticks": 41, "range_m": 30.5, "marks": 4 },
            "sidelobe": null, "others": [],
            "ticks": [41, 46, 47, 50, 61, 900],
            "is_of_others": [false, false, true, false, false, true],
            "correlation": {
                "first_lag_ticks": 40, "step_ticks": 1, "first_range_m": 30.1, "step_m": 0.4,
                "marks": [1, 4, 2], "marks_without_others": [1, 3, 0],
                "evidence_nats": [0.0, 9.5, 1.0],
            },
        })
    }

    fn arrivals(told: &PixelExplanation) -> Vec<Vec<f64>> {
        let Record::Ticks(ticks) = &told.record else { panic!("{told:?}") };
        let whole = ticks.whole.as_ref().unwrap();
        let chart = ticks.arrivals(whole, &told.marks_ticks, told.light.as_ref()).unwrap();
        let times = |series: &Series| series.points.iter().map(|point| point[0]).collect();
        chart.series.iter().map(times).collect()
    }

    #[test]
    fn a_pixel_has_its_ticks_and_its_correlation() {
        let html = html(&explanation(record(), Value::Null));
        assert!(html.contains("id=\"pixel-3-10\"") && html.contains("4 of 4 at 30.500 m"));
        assert!(html.contains("9.5 at 30.500 m") && html.contains("Four of four."));
        let charts = html.matches("<metadata>").count();
        assert_eq!(charts, 5);
    }

    #[test]
    fn ticks_are_told_apart_by_the_marks_at_the_peak() {
        let lanes = arrivals(&explanation(record(), Value::Null));
        assert_eq!(lanes[0], [41.0, 46.0, 50.0, 61.0]);
        assert_eq!(lanes[1], [41.0, 46.0, 47.0, 50.0, 61.0]);
        assert!(
            lanes[2].is_empty() && lanes[3].is_empty(),
            "what lies beyond the macropulse is not drawn"
        );
    }

    /// In a simulation the light at the detector stands above.
    #[test]
    fn light_is_shown_where_it_is_known() {
        let dark = explanation(record(), Value::Null);
        assert!(html(&dark).contains("What light there was is not known"));
        let told = explanation(record(), light());
        let lanes = arrivals(&told);
        assert_eq!(lanes[6], [41.5, 46.5, 50.5, 61.5]);
        assert_eq!(lanes[5], [47.25, 44.0], "what lies beyond the macropulse is not drawn");
        assert_eq!(lanes[4], [41.75, 46.5, 47.25]);
        assert!(html(&told).contains("light of this shot"));
    }

    /// A shot that was missed is shown where its light is.
    #[test]
    fn a_pixel_without_a_peak_has_its_correlation_alone() {
        let mut record = record();
        record["peak"] = Value::Null;
        record["odds"] = Value::Null;
        let told = explanation(record.clone(), light());
        assert_eq!(arrivals(&told)[0][0], 41.0);
        assert_eq!(told.picture().charts.len(), 2);
        assert_eq!(told.picture().title, "Row 3, column 10: no peak");
        let dark = explanation(record, Value::Null);
        assert_eq!(html(&dark).matches("<metadata>").count(), 1);
    }
}

//! The conclusion of the paper, sentence by sentence: does it hold, and what replaces it?

use super::{Comparison, Error, Findings};
use crate::view::{Align, Cell, Table, Verdict as Mark};
use macropulse::design::Design;
use macropulse::environment::Environment;
use macropulse::points::Outcome;
use macropulse::predict::Forecaster;
use macropulse::predict::verdict::{Check, Wanted, checks};

/// One sentence of the conclusion.
struct Sentence {
    says: &'static str,
    mark: Mark,
    holds: String,
    idealised: &'static str,
    instead: String,
}

/// The table of sentences; numbers from the run, or from forecasts of the ready sensors.
pub(super) fn table(findings: &Findings) -> Result<Table, Error> {
    let header = [
        ("the paper concludes", Align::Left),
        ("holds?", Align::Left),
        ("what was found", Align::Left),
        ("under these idealisations", Align::Left),
        ("what replaces it", Align::Left),
    ];
    let rows = sentences(findings)?.into_iter();
    Ok(rows.fold(Table::new("", &header), |table, sentence| {
        let word = match sentence.mark {
            Mark::Holds => "holds",
            Mark::Partly => "partly",
            Mark::Fails => "fails",
        };
        table.row(vec![
            Cell::from(sentence.says),
            Cell::verdict(sentence.mark, word),
            Cell::from(sentence.holds),
            Cell::from(sentence.idealised),
            Cell::from(sentence.instead),
        ])
    }))
}

fn sentences(findings: &Findings) -> Result<Vec<Sentence>, Error> {
    let paper = &findings.designs[0];
    let derived = paper.derived();
    let right = |receiver: &str| {
        let of = |c: &&Comparison| c.sensor == "kim-park-2016" && c.receiver == receiver;
        findings.comparisons.iter().find(of).map_or(f64::NAN, |c| 100.0 * c.share(Outcome::Right))
    };
    let honest = Design::open("kim-park-2016-physical", &[])?;
    let day = Environment::default();
    let [by_day, by_night] = [&day, &day.at_night()].map(|sky| Forecaster::new(&honest, sky));
    let range = paper.scan.rated_range;
    let white = Wanted { reflectance: 1.0, range, pd: 0.9, false_points: 1e-4 };
    let failing = checks(&by_day?, &by_night?, &white);
    let failing: Vec<String> = failing
        .iter()
        .filter(|check| !check.holds())
        .map(|Check { name, shortfall, .. }| match *shortfall {
            factor if factor >= 100.0 => format!("{name} fails by a factor of {factor:.0}"),
            factor => format!("{name} by {factor:.2}"),
        })
        .collect();
    let practical = Design::open("coded-practical", &[])?;
    let dark = Forecaster::new(&practical, &day)?.forecast(0.1, range);
    let slow = Design::open("bipolar-gold", &[])?;
    Ok(vec![
        Sentence {
            says: "It measures in each direction without waiting for each signal to return",
            mark: Mark::Holds,
            holds: format!("{:.1} shots are under way and told apart", derived.shots_in_flight),
            idealised: "those of `kim-park-2016`, below",
            instead: "`coded-practical` does it with one of them".into(),
        },
        Sentence {
            says: "A macropulse carries the number of its column by DS-OCDMA",
            mark: Mark::Partly,
            holds: "all columns but number 0, which sends no light".into(),
            idealised: "none",
            instead: "a sync bit, `kim-park-2016-fixed`; or no label where pattern and time tell \
                      the shot"
                .into(),
        },
        Sentence {
            says: "A mirror instead of a motor steers fast enough",
            mark: Mark::Partly,
            holds: format!(
                "it moves on by {:.2} pixel during a macropulse",
                derived.macropulse / derived.pixel_period
            ),
            idealised: "`mirror-motion`",
            instead: format!(
                "macropulses of {:.2} pixel",
                practical.derived().macropulse / practical.derived().pixel_period
            ),
        },
        Sentence {
            says: "The emission time follows from the column number received",
            mark: Mark::Partly,
            holds: format!("{:.1} % of the echoes with the receiver as printed", right("literal")),
            idealised: "no mark is missed, none is false",
            instead: format!("whole macropulses matched: {:.2} %", right("matched")),
        },
        Sentence {
            says: "No idle listening time is needed",
            mark: Mark::Partly,
            holds: format!(
                "up to {:.0} m, where a code word returns",
                derived.unambiguous_range.unwrap_or(f64::INFINITY)
            ),
            idealised: "none",
            instead: format!(
                "more words: {:.0} m",
                practical.derived().unambiguous_range.unwrap_or(f64::INFINITY)
            ),
        },
        Sentence {
            says: "So 848 x 480 points are measured 60 times a second",
            mark: Mark::Partly,
            holds: format!("as declared; with the light of class 1: {}", failing.join(", ")),
            idealised: "`link-budget`, `eye-safety`, `background`, `footprint`, `mirror-motion`, \
                        `detector-bandwidth`",
            instead: format!(
                "`coded-practical`: Pd {:.3} from 10 % at {range:.0} m by day, forecast",
                dark.pd
            ),
        },
        Sentence {
            says: "It should be enhanced to 360\u{b0}",
            mark: Mark::Holds,
            holds: "it can be".into(),
            idealised: "`inter-chip`",
            instead: "`coded-360`".into(),
        },
        Sentence {
            says: "Pulses should become slower by a bipolar synchronous code",
            mark: Mark::Partly,
            holds: "slower, yes; synchronous, no: echoes come at times unknown".into(),
            idealised: "those of `kim-park-2016`",
            instead: format!(
                "`bipolar-gold`: chips {} times as long",
                slow.coding.chip_fs / paper.coding.chip_fs
            ),
        },
    ])
}

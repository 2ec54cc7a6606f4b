//! The findings of a search, as text for people.

use super::candidate::{SCHEMES, scheme};
use super::frontier::{CHANNELS, Frontier};
use super::scenery::Scenery;
use super::trial::{Counts, Trial};
use super::{Assessed, Best, Bill, Found, Limit, Skipped, Worst};
use crate::text::{Columns, broken, section, short};

impl Limit {
    /// The limit in a few words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Time => "time",
            Self::Slant => "slant",
            Self::Light => "light",
            Self::Mirror => "size or speed of the polygon",
            Self::Missed => "missed targets",
            Self::Worst => "missed targets at the worst range",
            Self::False => "false points",
            Self::Wrong => "wrong points",
            Self::Precision => "precision",
        }
    }
}

/// The limit and its factor.
pub(super) fn told(limit: Option<(Limit, f64)>) -> String {
    match limit {
        None => "does".to_owned(),
        Some((limit, factor)) if factor.is_finite() => {
            format!("{}, by a factor of {}", limit.name(), short(factor))
        }
        Some((limit, _)) => format!("{}, whatever the factor", limit.name()),
    }
}

/// Speed of the corners of a polygon, m/s; a dash where there is none.
fn corners(speed: Option<f64>) -> String {
    speed.map_or("-".to_owned(), |speed| format!("{speed:.0} m/s"))
}

/// A share that was counted: at least the one that a single case would be.
pub(super) fn share(of: f64) -> String {
    if of == 0.0 { "0".to_owned() } else { format!("{of:.1e}") }
}

impl Found {
    /// All of it as plain lines, each section under its heading.
    pub fn text(&self) -> String {
        let mut text = format!("{}: what would do\n", self.required.name);
        text += &section("Wanted", &self.wanted());
        text += "\nClosed form: the least aperture that does, or what stands in the way\n";
        text += &self.table_of_parts();
        text += &self.list_of_skipped();
        text += "\nSimulated: a target all around, then tiles at ranges of their own\n";
        for trial in &self.trials {
            text += &trial.lines();
        }
        if let Some(frontier) = &self.frontier {
            text += &frontier.text();
        }
        let listed = [
            ("Side by side", self.side_by_side()),
            (
                "Mirrors: channels, diameter in mm, speed of the corners in m/s",
                self.table_of_mirrors(),
            ),
            ("Assumptions", self.assumptions()),
        ];
        for (heading, lines) in listed.iter().filter(|(_, lines)| !lines.is_empty()) {
            text += &format!("\n{heading}\n{lines}");
        }
        text += &section("Verdict", &self.verdict());
        text
    }

    fn wanted(&self) -> Columns {
        let mut columns = Columns::default();
        let wanted = &self.required.wanted;
        columns.push(
            "field",
            format!(
                "{} x {} pixels in {} x {} degrees, {} times a second",
                wanted.columns,
                wanted.rows,
                wanted.horizontal_deg,
                wanted.vertical_deg,
                wanted.scans_per_s
            ),
        );
        columns.push(
            "target",
            format!(
                "{} % at {} m with Pd {}, to {} m, in {}",
                short(wanted.reflectance * 100.0),
                wanted.range_m,
                wanted.pd,
                wanted.precision_m,
                self.required.environment.name
            ),
        );
        columns.push(
            "accepted",
            format!(
                "{:e} false points per empty pixel, {:e} wrong ones per echo",
                wanted.false_points, wanted.wrong_points
            ),
        );
        columns.push("clutter", format!("to {} m", wanted.clutter_m));
        columns
    }

    /// For each photodiode and number of marks, the fewest beams that do, and the beams with the least
    /// aperture.
    fn table_of_parts(&self) -> String {
        let mut text = format!(
            "  {:<16} {:>5} {:>6} {:>6} {:>9} {:>9} {:>8} {:>8} {:>8} {:>9}  {}\n",
            "photodiode",
            "marks",
            "beams",
            "facets",
            "period",
            "aperture",
            "corners",
            "energy",
            "pulse",
            "bandwidth",
            ""
        );
        for one in self.outstanding() {
            let it = &one.candidate;
            text += &format!(
                "  {:<16} {:>5} {:>6} {:>6} {:>6.0} ns {:>6.1} mm {:>8} {:>5.1} nJ {:>5.0} ps {:>5.0} MHz  {}\n",
                it.part.name,
                it.marks,
                it.beams,
                it.facets.map_or("-".to_owned(), |facets| facets.to_string()),
                one.period * 1e9,
                it.aperture * 1e3,
                corners(it.tip_speed(&self.required)),
                it.energy * 1e9,
                it.pulse * 1e12,
                it.bandwidth * 1e-6,
                told(one.limit)
            );
        }
        text
    }

    /// For each photodiode and number of marks, the fewest beams that do in closed form; if none does, the
    /// candidate that fails by least.
    pub(super) fn outstanding(&self) -> Vec<&Assessed> {
        let mut outstanding: Vec<&Assessed> = Vec::new();
        for one in &self.assessed {
            let is_same = |other: &&Assessed| {
                let (one, other) = (&one.candidate, &other.candidate);
                (one.marks, &one.part.name) == (other.marks, &other.part.name)
            };
            let factor = |of: &Assessed| of.limit.map_or(0.0, |(_, factor)| factor);
            match outstanding.last_mut().filter(|last| is_same(last)) {
                None => outstanding.push(one),
                Some(last) if factor(one) < factor(last) => *last = one,
                Some(_) => {}
            }
        }
        outstanding
    }

    /// Combinations that are no lidar: numbers of beams with the same reason stand in one line.
    fn list_of_skipped(&self) -> String {
        let mut text = String::new();
        let same = |one: &Skipped, other: &Skipped| {
            (&one.part, one.marks, &one.why) == (&other.part, other.marks, &other.why)
        };
        for alike in self.skipped.chunk_by(same) {
            let Some(Skipped { part, marks, why, .. }) = alike.first() else { continue };
            let beams: Vec<String> = alike.iter().map(|one| one.beams.to_string()).collect();
            let beams = beams.join(", ");
            text += &format!("  {part}, {marks} marks, beams {beams}: {why}\n");
        }
        match text.is_empty() {
            true => text,
            false => format!("\nSkipped: combinations that are no lidar\n{text}"),
        }
    }

    /// The parts of the best lidars, a quantity in each line. Empty if there are none.
    pub(super) fn side_by_side(&self) -> String {
        let [coded, waiting] = &self.best;
        let named = [
            ("coded", coded.as_ref().map(|best| &best.bill)),
            ("waiting", waiting.as_ref().map(|best| &best.bill)),
            ("in flight *", self.in_flight.as_ref().map(|it| &it.bill)),
        ];
        let there: Vec<(&str, &Bill)> =
            named.into_iter().filter_map(|(name, bill)| Some((name, bill?))).collect();
        if there.is_empty() {
            return String::new();
        }
        let mut text = String::new();
        let mut line = |name: &str, cell: &dyn Fn(&(&str, &Bill)) -> String| {
            text += &format!("  {name:<26}");
            for one in &there {
                text += &format!(" {:>18}", cell(one));
            }
            text += "\n";
        };
        line("", &|(name, _)| (*name).to_owned());
        line("channels", &|(_, it)| it.channels.to_string());
        line("each with", &|(_, it)| it.converter.name().to_owned());
        line("samples, GS/s", &|(_, it)| short(it.samples_per_s * 1e-9));
        line("photodiodes, mm2 at f/1", &|(_, it)| format!("{:.4}", it.photodiodes * 1e6));
        line("aperture, mm", &|(_, it)| short(it.aperture * 1e3));
        line("draws, % of the time", &|(_, it)| format!("{:.0}", it.duty * 100.0));
        let polygon = |it: &Bill, of: &dyn Fn((f64, f64)) -> f64| {
            it.polygon.map_or("-".to_owned(), |polygon| format!("{:.0}", of(polygon)))
        };
        line("polygon, mm", &|(_, it)| polygon(it, &|(diameter, _)| diameter * 1e3));
        line("corners, m/s", &|(_, it)| polygon(it, &|(_, speed)| speed));
        line("energy of a shot, nJ", &|(_, it)| format!("{:.1}", it.energy * 1e9));
        line("of class 1, %", &|(_, it)| format!("{:.0}", it.of_class_1 * 100.0));
        line("peak power, all beams, W", &|(_, it)| format!("{:.0}", it.peak));
        line("mean power, all beams, W", &|(_, it)| format!("{:.2}", it.mean));
        text
    }

    /// Needs of each lidar behind every polygon; empty without a polygon.
    pub(super) fn table_of_mirrors(&self) -> String {
        let mut text = String::new();
        for it in &self.mirrors {
            text += &format!("  {:>6} {:>6.0} %", it.facets, it.duty * 100.0);
            for side in &it.sides {
                text += &match side {
                    Some(side) => format!(
                        "  {:>6.1} {:>6.0} {:>6.0}",
                        side.channels,
                        side.diameter * 1e3,
                        side.tip_speed
                    ),
                    None => format!("  {:>6} {:>6} {:>6}", "-", "-", "-"),
                };
            }
            text += "\n";
        }
        match text.is_empty() {
            true => text,
            false => format!(
                "  {:>6} {:>8}  {:>20}  {:>20}  {:>20}\n{text}",
                "facets", "draws", "coded", "waiting", "in flight *"
            ),
        }
    }

    /// The assumptions of the comparison, one in a paragraph.
    pub(super) fn assumptions(&self) -> String {
        let mut all: Vec<String> = ASSUMPTIONS.map(str::to_owned).to_vec();
        if let Some(it) = &self.in_flight {
            all.push(format!(
                "* In flight: a bound, not simulated. A pulse every {} ns, {} of them in flight; {:.0} % of the \
                 echoes are hidden by stray light of later pulses. {} neighbours at the same range must agree, so \
                 surfaces of fewer pixels get no point.",
                short(it.period * 1e9),
                it.pulses,
                it.hidden * 100.0,
                it.neighbours
            ));
        }
        let lines = all.iter().flat_map(|one| broken(one, 100));
        lines.map(|line| format!("  {line}\n")).collect()
    }

    /// Why no lidar of the scheme with this `name` does: the first reason where none is a lidar at all.
    fn why_none(&self, name: &str) -> String {
        let is_assessed = self.assessed.iter().any(|it| it.candidate.scheme() == name);
        let skipped = self.skipped.iter().find(|it| scheme(it.marks) == name);
        match skipped.filter(|_| !is_assessed) {
            Some(it) => format!("none of the parts allowed: {}", it.why),
            None => "nothing does of the parts allowed".to_owned(),
        }
    }

    /// The result of the search: a sentence for each answer.
    pub fn verdict(&self) -> Columns {
        let mut columns = Columns::default();
        for (name, best) in SCHEMES.into_iter().zip(&self.best) {
            columns.push(
                name,
                match best {
                    Some(Best { trial: Trial { candidate, .. }, bill }) => {
                        let mirror = candidate.facets.zip(bill.polygon);
                        let mirror = mirror.map_or(String::new(), |(facets, (diameter, _))| {
                            format!(", behind {facets} facets of {} mm", short(diameter * 1e3))
                        });
                        format!(
                            "{} channels do, each with {}, and an aperture of {} mm{mirror}",
                            candidate.beams,
                            candidate.part.name,
                            short(candidate.aperture * 1e3)
                        )
                    }
                    None => self.why_none(name),
                },
            );
        }
        if let Some(it) = &self.in_flight {
            columns.push(
                "in flight",
                format!(
                    "{} channels of single pulses at least, if {} neighbours tell which pulse an echo is of (a \
                     bound, not simulated)",
                    it.candidate.beams, it.neighbours
                ),
            );
        }
        if let ([Some(coded), Some(waiting)], Some(frontier)) = (&self.best, &self.frontier) {
            let ratio = |of: &dyn Fn(&Bill) -> f64| short(of(&coded.bill) / of(&waiting.bill));
            columns.push(
                "coded : waiting",
                format!(
                    "{} of the channels, {} times the light, {} of the peak power, {} of the photodiodes' area; \
                     each channel with {} in place of {}",
                    ratio(&|it| f64::from(it.channels)),
                    ratio(&|it| it.aperture.powi(2) * it.energy),
                    ratio(&|it| it.peak),
                    ratio(&|it| it.photodiodes),
                    coded.bill.converter.name(),
                    waiting.bill.converter.name()
                ),
            );
            columns.push(
                "waiting needs",
                format!(
                    "{} channels for each million pixels a second behind its mirror",
                    short(1e6 * frontier.waiting_period / frontier.waiting_duty)
                ),
            );
        }
        columns
    }
}

/// The assumptions of every comparison.
pub(super) const ASSUMPTIONS: [&str; 5] = [
    "Each lidar has a mirror of its own, as large as parts.polygon_mm and as fast as parts.tip_m_per_s allow. How much of \
     its turn a polygon draws decides how many channels both need.",
    "Waiting means: until the farthest thing that answers is back, with clutter at wanted.clutter_m.",
    "A comparator and a TDC would do for single pulses that wait; they are simulated with the samples of an ADC.",
    "Photodiodes are as large as their field behind a lens of f/1. Each sees a strip of its line, as many pixels as are \
     fired while light is under way.",
    "Beams fire at once, so the peak power is that of all of them. Class 1 counts what enters one eye.",
];

impl Trial {
    fn lines(&self) -> String {
        let name = self.candidate.name();
        let mut text = format!(
            "  {name}, {} mm: {}\n",
            short(self.candidate.aperture * 1e3),
            told(self.limit)
        );
        for (scenery, counts) in Scenery::ALL.into_iter().zip(&self.counts) {
            text += &format!("    {:<6} {}\n", scenery.name(), counts.line());
        }
        let Worst { pd, range } = self.worst;
        text + &format!("    worst  Pd {pd:.4} forecast at {range:.2} m\n")
    }
}

impl Counts {
    fn line(&self) -> String {
        format!(
            "Pd {:.4}, wrong {}, false {}, rms {:.2} cm, of {} pixels",
            self.pd(),
            share(self.wrong_share()),
            share(self.false_share()),
            self.rms() * 100.0,
            self.pixels
        )
    }
}

impl Frontier {
    fn text(&self) -> String {
        let percents = self.reflectances.map(|reflectance| short(reflectance * 100.0));
        let mut text = format!(
            "\nHow far light goes with one aperture, m, at {} %; {} ns between coded shots, {} ns waited\n",
            percents.join(", "),
            short(self.coded_period * 1e9),
            short(self.waiting_period * 1e9)
        );
        text += &format!(
            "  {:>7} {:>9} {:>20} {:>20} {:>9}  time with {} channels waiting, m\n",
            "Hz",
            "Mpixel/s",
            "coded",
            "waiting",
            "channels",
            CHANNELS.map(|count| count.to_string()).join(", ")
        );
        for row in &self.rows {
            let metres = |ranges: &[f64]| {
                let ranges: Vec<String> = ranges.iter().map(|m| format!("{m:.0}")).collect();
                ranges.join(" ")
            };
            text += &format!(
                "  {:>7} {:>9.1} {:>20} {:>20} {:>9.1}  {}\n",
                short(row.scans_per_s),
                row.pixels_per_s * 1e-6,
                metres(&row.coded),
                metres(&row.waiting),
                row.coded_channels,
                metres(&row.time)
            );
        }
        text
    }
}

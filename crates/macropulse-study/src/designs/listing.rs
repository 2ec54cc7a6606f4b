//! What a search found, as text for people.

use super::candidate::SCHEMES;
use super::frontier::{CHANNELS, Frontier};
use super::scenery::Scenery;
use super::trial::{Counts, Trial};
use super::{Assessed, Found, Limit, Worst};
use crate::text::{Columns, section, short};

impl Limit {
    /// What stands in the way, in a few words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Time => "time",
            Self::Slant => "slant",
            Self::Light => "light",
            Self::Mirror => "speed of the polygon",
            Self::Missed => "missed targets",
            Self::Worst => "missed targets at the worst range",
            Self::False => "false points",
            Self::Wrong => "wrong points",
            Self::Precision => "precision",
        }
    }
}

/// What stands in the way, and by what factor.
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
        text += "\nSimulated: a target all around, then tiles at ranges of their own\n";
        for trial in &self.trials {
            text += &trial.lines();
        }
        if let Some(frontier) = &self.frontier {
            text += &frontier.text();
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

    /// Of each photodiode and number of marks, the fewest beams that do and those with the least aperture.
    fn table_of_parts(&self) -> String {
        let mut text = format!(
            "  {:<16} {:>5} {:>6} {:>9} {:>9} {:>8} {:>8} {:>8} {:>9}  {}\n",
            "photodiode",
            "marks",
            "beams",
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
                "  {:<16} {:>5} {:>6} {:>6.0} ns {:>6.1} mm {:>8} {:>5.1} nJ {:>5.0} ps {:>5.0} MHz  {}\n",
                it.part.name,
                it.marks,
                it.beams,
                one.period * 1e9,
                it.aperture * 1e3,
                corners(self.required.tip_speed(it)),
                it.energy * 1e9,
                it.pulse * 1e12,
                it.bandwidth * 1e-6,
                told(one.limit)
            );
        }
        text
    }

    /// Of each photodiode and number of marks the fewest beams that do in closed form; the one that fails by
    /// least where none does.
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

    /// What the search comes to: a sentence for each answer.
    pub fn verdict(&self) -> Columns {
        let mut columns = Columns::default();
        for (name, best) in SCHEMES.into_iter().zip(&self.best) {
            columns.push(
                name,
                match best {
                    Some(Trial { candidate, .. }) => format!(
                        "{} channels do, each with {}, and an aperture of {} mm",
                        candidate.beams,
                        candidate.part.name,
                        short(candidate.aperture * 1e3)
                    ),
                    None => "nothing does of the parts allowed".to_owned(),
                },
            );
        }
        if let ([Some(coded), Some(waiting)], Some(frontier)) = (&self.best, &self.frontier) {
            let (coded, waiting) = (&coded.candidate, &waiting.candidate);
            let channels = f64::from(waiting.beams) / f64::from(coded.beams);
            let light = (coded.aperture / waiting.aperture).powi(2);
            columns.push(
                "never waiting",
                match channels > 1.0 {
                    true => format!(
                        "takes {} times fewer channels and {} times the light",
                        short(channels),
                        short(light)
                    ),
                    false => "wins nothing here: waiting takes no more channels".to_owned(),
                },
            );
            columns.push(
                "as many waiting",
                format!(
                    "with {} channels the one that waits makes {} scans a second in place of {}",
                    coded.beams,
                    short(self.required.wanted.scans_per_s / channels),
                    self.required.wanted.scans_per_s
                ),
            );
            columns.push(
                "it wins",
                format!(
                    "where there are fewer channels than {} for each million pixels a second, and more \
                     light than an echo needs",
                    short(1e6 * frontier.waiting_period / frontier.duty)
                ),
            );
        }
        columns
    }
}

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

//! Measurements beside the goals.

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::Fallible;
use crate::decode::{self, Decoding};
use crate::effort::Efforts;
use crate::generate::Generating;
use crate::machine::printed;
use crate::page::{self, grouped, speed, three};
use crate::rays::{LEAKED_OF, Rays};
use crate::sample::Condition;
use crate::scans::WholeScans;

/// Measurements to be judged.
pub struct Measured<'a> {
    /// Rays per second.
    pub rays: &'a Rays,
    /// From shots to ticks.
    pub generating: &'a Generating,
    /// From ticks to returns.
    pub decoding: &'a Decoding,
    /// Quick receivers beside thorough ones.
    pub efforts: &'a Efforts,
    /// Whole scans.
    pub scans: &'a WholeScans,
}

/// A row: a quantity, its goal, its measurement, and whether that meets the goal.
struct Goal {
    what: String,
    wanted: String,
    found: Result<(String, bool), String>,
}

impl Goal {
    /// `figure` is wanted to be `least` or more, written by `shown`.
    fn at_least(what: &str, least: f64, figure: Option<f64>, shown: fn(f64) -> String) -> Self {
        Self {
            what: what.to_owned(),
            wanted: format!("≥ {}", without_zeros(&shown(least))),
            found: found(figure, |figure| (shown(figure), figure >= least)),
        }
    }

    /// `figure` is wanted to be `most` or less.
    fn at_most(what: &str, most: f64, figure: Option<f64>, shown: fn(f64) -> String) -> Self {
        Self {
            what: what.to_owned(),
            wanted: format!("≤ {}", without_zeros(&shown(most))),
            found: found(figure, |figure| (shown(figure), figure <= most)),
        }
    }

    fn row(self) -> Vec<String> {
        let (figure, verdict) = match self.found {
            Ok((figure, is_met)) => (figure, if is_met { "yes" } else { "no" }.to_owned()),
            Err(why) => (why, "–".to_owned()),
        };
        vec![self.what, self.wanted, figure, verdict]
    }
}

fn found(
    figure: Option<f64>,
    judge: impl FnOnce(f64) -> (String, bool),
) -> Result<(String, bool), String> {
    figure.map(judge).ok_or_else(|| "not measured".to_owned())
}

/// Numbers without zeros at the end of their decimals.
fn without_zeros(text: &str) -> String {
    let short = |word: &str| match word.contains('.') {
        true => word.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => word.to_owned(),
    };
    text.split(' ').map(short).collect::<Vec<_>>().join(" ")
}

fn percent(figure: f64) -> String {
    format!("{figure:.3} %")
}

fn times(figure: f64) -> String {
    format!("{} ×", three(figure))
}

/// The table.
pub fn text(measured: &Measured) -> Fallible<String> {
    let goals = [speeds(measured)?, rays(measured.rays), scans(measured.scans), sizes()?];
    let rows: Vec<Vec<String>> = goals.into_iter().flatten().map(Goal::row).collect();
    Ok(page::table(&["what", "goal", "measured", "met"], &rows))
}

/// A goal of decoding.
pub struct Decode {
    /// The condition, in words.
    pub name: &'static str,
    pub scene: &'static str,
    pub condition: Condition,
    /// The least speed.
    pub least: f64,
}

/// All goals of decoding.
pub fn decoding() -> impl Iterator<Item = Decode> {
    let noise = |missed, counts| Condition::Noise { missed, counts };
    let wanted = [
        ("clean", "street", Condition::CLEAN, 1.0 / 1.5),
        ("clean", "car-50m", Condition::CLEAN, 2.0),
        ("20 % missed, 10⁹ counts/s", "street", noise(0.2, 1e9), 1.0 / 15.0),
        ("10¹⁰ counts/s", "street", noise(0.0, 1e10), 1.0 / 30.0),
        ("20 % missed, 10¹⁰ counts/s", "street", noise(0.2, 1e10), 1.0 / 30.0),
        ("as declared", "car-50m", Condition::Declared, 1.0 / 15.0),
        ("as declared", "street", Condition::Declared, 1.0 / 25.0),
        ("clean", "random", Condition::CLEAN, 1.0 / 8.0),
        ("20 % missed, 10⁹ counts/s", "random", noise(0.2, 1e9), 1.0 / 250.0),
    ];
    wanted.into_iter().map(|(name, scene, condition, least)| Decode {
        name,
        scene,
        condition,
        least,
    })
}

fn speeds(measured: &Measured) -> Fallible<Vec<Goal>> {
    let noise = |missed, counts| Condition::Noise { missed, counts };
    let mut goals = Vec::new();
    for Decode { name, scene, condition, least } in decoding() {
        let decoded = measured.decoding.of(scene, condition);
        let what = format!("speed of decoding `{scene}`, {name}");
        goals.push(Goal::at_least(&what, least, decoded.map(|decoded| decoded.speed), speed));
        if (scene, condition) == ("street", noise(0.2, 1e9)) {
            let score = decode::whole(scene, condition)?;
            let what = "right to 1.5 mm in a whole scan of that";
            goals.push(Goal::at_least(what, 99.95, Some(score.percent()), percent));
            let what = "returns of that scan more than 0.35 m off";
            goals.push(Goal::at_most(what, 0.0, Some(score.wrong as f64), grouped));
        }
    }
    let what = "shots found otherwise than by a thorough receiver, where most are";
    goals.push(Goal::at_most(what, 0.01, Some(100.0 * measured.efforts.most()), percent));
    let generating = measured.generating.speed("street", Condition::CLEAN);
    let what = "speed of generating `street`, clean";
    goals.push(Goal::at_least(what, 1.0 / 1.5, generating, speed));
    Ok(goals)
}

fn rays(rays: &Rays) -> Vec<Goal> {
    let [time, memory] = match rays.load_beside_embree() {
        Some([time, memory]) => [Some(time), Some(memory)],
        None => [None; 2],
    };
    let cast = [
        ("rays in rows at a city, beside Embree's fastest way", "rows"),
        ("the same rays, shuffled", "shuffled"),
        ("rays of `hdl-64e` there, its lasers in turn", "lasers in turn"),
        ("the same rays, laser by laser", "laser by laser"),
    ];
    let cast =
        cast.map(|(what, order)| Goal::at_least(what, 1.0, rays.beside_embree(order), times));
    let mut beside = Vec::from(cast);
    beside.extend([
        Goal::at_most("time to load 4.8 million triangles, beside Embree", 1.2, time, times),
        Goal::at_most("memory of that, beside Embree", 1.2, memory, times),
    ]);
    if let Some(why) = &rays.no_embree {
        beside.iter_mut().for_each(|goal| goal.found = Err(why.clone()));
    }
    let leaks = format!("rays out of a closed sphere, of {} million", LEAKED_OF / 1_000_000);
    beside.push(Goal::at_most(&leaks, 0.0, Some(rays.leaks[0] as f64), grouped));
    beside
}

fn scans(scans: &WholeScans) -> Vec<Goal> {
    [("clean", Condition::CLEAN, 60.0), ("as declared", Condition::Declared, 5.0)]
        .map(|(name, condition, least)| {
            let what = format!("scans per second of `car-50m`, {name}, two threads");
            Goal::at_least(&what, least, scans.on_two_threads("car-50m", condition), three)
        })
        .into()
}

fn sizes() -> Fallible<Vec<Goal>> {
    let text = printed(Command::new(std::env::current_exe()?).arg("sixty"))?;
    let megabytes = text.trim().parse::<f64>().ok();
    let memory = "memory of 60 clean scans of `car-50m`, MB";
    let lines = lines(&Path::new(SOURCES).join("decode/matched"))?;
    let lines = Some(lines as f64);
    Ok(vec![
        Goal::at_most(memory, 100.0, megabytes.filter(|megabytes| *megabytes > 0.0), three),
        Goal::at_most("lines of the matched receiver, without tests", 900.0, lines, grouped),
    ])
}

/// Sources of the crate with the receivers.
const SOURCES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../macropulse-codec/src");

/// Lines of all sources in `folder`, without tests.
fn lines(folder: &Path) -> Fallible<usize> {
    let mut sum = 0;
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        let is_test = path.file_stem().is_some_and(|stem| stem == "tests");
        sum += match path.extension().is_some_and(|ending| ending == "rs") {
            _ if is_test => 0,
            true => before_tests(&fs::read_to_string(&path)?),
            false if path.is_dir() => lines(&path)?,
            false => 0,
        };
    }
    Ok(sum)
}

/// Lines of a source down to the module of its tests.
fn before_tests(source: &str) -> usize {
    source.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default().lines().count()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whether_a_goal_is_met_follows_from_the_figures() {
        let verdict = |goal: Goal| goal.row()[3].clone();
        let least = |figure| verdict(Goal::at_least("", 0.5, figure, speed));
        assert_eq!(
            [Some(0.49), Some(0.5), Some(f64::NAN), None].map(least),
            ["no", "yes", "no", "–"]
        );
        let most = |figure| verdict(Goal::at_most("", 1.2, figure, times));
        assert_eq!([Some(1.2), Some(1.21), Some(f64::NAN)].map(most), ["yes", "no", "no"]);
    }

    #[test]
    fn a_row_says_what_is_wanted_and_what_was_found() {
        let row = Goal::at_least("decoding", 1.0 / 15.0, Some(1.0 / 104.0), speed).row();
        assert_eq!(row, ["decoding", "≥ 1/15", "1/104", "no"]);
        let row = Goal::at_least("right", 99.95, Some(100.0), percent).row();
        assert_eq!(row, ["right", "≥ 99.95 %", "100.000 %", "yes"]);
        let row = Goal::at_most("leaks", 0.0, Some(0.0), grouped).row();
        assert_eq!(row, ["leaks", "≤ 0", "0", "yes"]);
    }

    #[test]
    fn lines_of_tests_do_not_count() {
        assert_eq!(before_tests("a\nb\n#[cfg(test)]\nmod tests {\n}\n"), 2);
        assert_eq!(before_tests("#[cfg(test)]\nmod tests;\na\n"), 3);
    }
}

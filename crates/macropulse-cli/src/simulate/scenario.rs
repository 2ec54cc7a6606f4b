//! Scenarios to be simulated: a scenario file, or the options in its place.

use std::ffi::{OsStr, OsString};
use std::ops::Range;
use std::path::{Path, PathBuf};

use macropulse::channel::Operating;
use macropulse::design::{Design, preset_text};
use macropulse::emit::most_scans;
use macropulse::formats::Format;
use macropulse::scene::{Changes, Room, Scene};
use macropulse::schema::read_text;
use macropulse_study::record::{MANIFEST, PAGE, Pixel, colour_name, explanation_files};
use schemars::JsonSchema;
use serde::Deserialize;
use toml::Spanned;

use super::formats::{Formats, Records};
use crate::fault::Fault;
use crate::folder::Outputs;
use crate::input::{self, STREAM};
use crate::kind;

/// The format this program reads.
const VERSION: i64 = 1;

/// More scans than this in one run are taken for a slip.
const MOST_SCANS: u64 = 1_000_000;

/// Sensors, a scene, and how long. Everything in it is valid.
pub struct Scenario {
    pub designs: Vec<Design>,
    pub scene: Scene,
    pub scans: u64,
    pub seed: u64,
    pub formats: Vec<Format>,
    /// Records that are written.
    pub records: Records,
    pub truth: bool,
    /// Pixels to be explained.
    pub explain: Vec<Pixel>,
    /// True if a page to look at the clouds is written.
    pub has_page: bool,
}

/// Names of the files of a scan in these formats.
pub fn files_of_scan(formats: &[Format], scan: u64) -> impl Iterator<Item = String> {
    let colour = formats.contains(&Format::Png).then(|| colour_name(scan));
    formats.iter().map(move |format| format.file_name(scan)).chain(colour)
}

/// A scenario file as typed.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct ScenarioFile {
    #[schemars(with = "i64")]
    version: Spanned<i64>,
    #[schemars(with = "Option<String>")]
    sensor: Option<Spanned<String>>,
    #[serde(default)]
    #[schemars(with = "Vec<String>")]
    sensors: Vec<Spanned<String>>,
    #[schemars(with = "String")]
    scene: Spanned<String>,
    #[schemars(with = "Option<u64>")]
    scans: Option<Spanned<u64>>,
    seed: Option<u64>,
    #[schemars(with = "Option<Vec<String>>")]
    formats: Option<Vec<Spanned<String>>>,
    #[serde(default)]
    truth: bool,
}

impl Scenario {
    /// Returns true if neither clouds nor records are written.
    pub fn writes_nothing(&self) -> bool {
        self.formats.is_empty() && self.records.is_none()
    }

    /// The files that a run of `design` writes.
    pub fn outputs(&self, design: &Design) -> Outputs {
        let (formats, scans, explain) = (self.formats.clone(), self.scans, self.explain.clone());
        let kept = self.records.of(design).ok().flatten();
        let fixed = [Some(MANIFEST), self.has_page.then_some(PAGE)];
        Outputs::of_scans(fixed.into_iter().flatten(), move |scan| {
            if scan >= scans {
                return Vec::new();
            }
            let explained = explain.iter().filter(|_| scan == 0);
            let explained = explained.flat_map(|pixel| explanation_files(scan, *pixel));
            let records = kept.into_iter().flat_map(|kept| kept.names(scan));
            files_of_scan(&formats, scan).chain(records).chain(explained).collect()
        })
    }

    /// One scan of the sensors in the scene, each a ready one or a file.
    pub fn of(
        sensors: &[OsString],
        scene: &OsStr,
        changes: &Changes,
        room: Room,
    ) -> Result<Self, Fault> {
        if sensors
            .iter()
            .map(OsString::as_os_str)
            .chain([scene])
            .filter(|name| *name == STREAM)
            .count()
            > 1
        {
            return Err(Fault::Wrong(
                "- is named twice, but standard input is one text: write the other into a file"
                    .to_owned(),
            ));
        }
        if let [sensor] = sensors {
            kind::in_order("simulate", sensor, scene)?;
        }
        let designs: Result<Vec<_>, _> =
            sensors.iter().map(|sensor| input::design(sensor, &changes.of_sensor)).collect();
        let (designs, scene) = (designs?, input::scene(scene, &changes.of_scene, room)?);
        check_operating(&designs, &scene)?;
        let Formats(formats, records) = Formats::default();
        Ok(Self {
            designs,
            scene,
            scans: 1,
            seed: 1,
            formats,
            records,
            truth: false,
            explain: Vec::new(),
            has_page: true,
        })
    }

    /// The scenario in the file called `name`; names of files count from its folder.
    pub fn open(name: &OsStr, changes: &Changes, room: Room) -> Result<Self, Fault> {
        let (text, origin) = input::text(name)?;
        let source = Source { text: &text, origin: &origin };
        let file: ScenarioFile =
            read_text(&text).map_err(|refusal| source.fault(refusal.span, &refusal.message))?;
        if *file.version.get_ref() != VERSION {
            let message = format!(
                "version is {}, but this program reads version {VERSION}",
                file.version.get_ref()
            );
            return Err(source.fault(file.version.span(), &message));
        }
        let folder = Path::new(name).parent().unwrap_or(Path::new(""));
        let named: Vec<&Spanned<String>> = file.sensor.iter().chain(&file.sensors).collect();
        if named.is_empty() {
            return Err(source.fault(0..0, "names no sensor: add sensor = \"…\" or sensors = […]"));
        }
        let mut designs = Vec::new();
        for sensor in named {
            let name = sensor.get_ref();
            let ready = preset_text(name).is_some() || !looks_like_a_path(name);
            let place = if ready { PathBuf::from(name) } else { folder.join(name) };
            let design = Design::open(&place, &changes.of_sensor)
                .map_err(|error| source.fault(sensor.span(), &error.to_string()))?;
            designs.push(design);
        }
        let name = file.scene.get_ref();
        let ready = Scene::builtin(name).is_some() || !looks_like_a_path(name);
        let place = if ready { PathBuf::from(name) } else { folder.join(name) };
        let scene = Scene::open_within(&place, &changes.of_scene, room)
            .map_err(|error| source.fault(file.scene.span(), &error.to_string()))?;
        check_operating(&designs, &scene)?;
        let Formats(formats, records) = match file.formats {
            Some(names) => formats(&source, &names)?,
            None => Formats::default(),
        };
        let scans = file.scans.as_ref().map_or(1, |scans| *scans.get_ref());
        if let (Some(typed), Err(sentence)) = (&file.scans, check_scans(scans, &designs)) {
            return Err(source.fault(typed.span(), &format!("scans: {sentence}")));
        }
        let (seed, truth) = (file.seed.unwrap_or(1), file.truth);
        let (explain, has_page) = (Vec::new(), true);
        Ok(Self { designs, scene, scans, seed, formats, records, truth, explain, has_page })
    }
}

/// Checks that all sensors can be simulated under the sun of the scene.
fn check_operating(designs: &[Design], scene: &Scene) -> Result<(), Fault> {
    for design in designs {
        Operating::of(design, &scene.environment)?;
    }
    Ok(())
}

/// Checks that the sensors can make this number of scans; else returns the sentence that says why not.
pub fn check_scans(scans: u64, designs: &[Design]) -> Result<(), String> {
    if scans == 0 {
        return Err("0 scans are none; ask for at least 1".to_owned());
    }
    if scans > MOST_SCANS {
        return Err(format!(
            "{scans} scans are too many for one run; ask for at most {MOST_SCANS}, and for more \
             start several runs with a seed each"
        ));
    }
    for design in designs {
        let most = most_scans(design);
        if scans > most {
            return Err(format!(
                "{scans} scans of {} last longer than the 2.5 h its clock counts; ask for at most \
                 {most}, and for more start several runs with a seed each",
                design.name
            ));
        }
    }
    Ok(())
}

fn formats(source: &Source, names: &[Spanned<String>]) -> Result<Formats, Fault> {
    let (mut formats, mut records) = (Vec::new(), Records::default());
    for name in names {
        if records.add(name.get_ref()) {
            continue;
        }
        match Format::parse(name.get_ref()) {
            Ok(format) if formats.contains(&format) => {}
            Ok(format) => formats.push(format),
            Err(error) => return Err(source.fault(name.span(), &error.to_string())),
        }
    }
    Ok(Formats(formats, records))
}

fn looks_like_a_path(name: &str) -> bool {
    let path = Path::new(name);
    path.extension().is_some() || path.components().count() > 1
}

/// The text of a file and its name: turns spans into places.
struct Source<'a> {
    text: &'a str,
    origin: &'a str,
}

impl Source<'_> {
    fn fault(&self, span: Range<usize>, message: &str) -> Fault {
        let before = self.text.get(..span.start).unwrap_or(self.text);
        let line = before.matches('\n').count() + 1;
        let column = before.chars().rev().take_while(|c| *c != '\n').count() + 1;
        Fault::Wrong(format!("{}:{line}:{column}: {message}", self.origin))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use macropulse_fuzz::mutate::Mutator;

    fn told(text: &str) -> String {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("s.toml");
        std::fs::write(&path, text).unwrap();
        match Scenario::open(path.as_os_str(), &Changes::default(), Room::default()) {
            Err(Fault::Wrong(sentence)) => sentence.rsplit_once("s.toml").unwrap().1.to_owned(),
            _ => "accepted".to_owned(),
        }
    }

    #[test]
    fn a_scenario_is_read() {
        let text =
            "version = 1\nsensors = [\"hdl-64e\", \"peregrine\"]\nscene = \"wall\"\nscans = 3\n";
        assert_eq!(told(text), "accepted");
    }

    #[test]
    fn what_is_wrong_has_a_place_and_a_remedy() {
        let start = "version = 1\nsensor = \"peregrine\"\nscene = \"wall\"\n";
        assert_eq!(
            told(&format!("{start}scnas = 3\n")),
            ":4:1: unknown key `scnas`; did you mean `scans`?"
        );
        assert!(told(&format!("{start}scans = 0\n")).starts_with(":4:9: scans: 0 scans are none"));
        assert!(
            told(&format!("{start}formats = [\"pcd\", \"pyl\"]\n")).contains("did you mean `ply`?")
        );
        assert!(told("version = 2\nsensor = \"x\"\nscene = \"y\"\n").contains("reads version 1"));
        assert!(told("version = 1\nscene = \"wall\"\n").contains("names no sensor"));
        assert!(told("version = 1\nsensor = \"wall\"\n").ends_with("the key `scene` is missing"));
        assert!(
            told("version = 1\nsensor = \"perigrine\"\nscene = \"wall\"\n").starts_with(":2:10: ")
        );
    }

    /// Scenarios changed anyhow: each is read, or refused in a sentence. `MACROPULSE_FUZZ_CASES` sets how
    /// many.
    #[test]
    fn any_scenario_is_read_or_refused() {
        let line = |text: &str| text.as_bytes().to_vec();
        let examples = [
            line("version = 1\nsensor = \"peregrine\"\nscene = \"wall\"\nscans = 3\nseed = 7\n"),
            line(
                "version = 1\nsensors = [\"vlp-16\", \"a.toml\"]\nscene = \"a/b.toml\"\ntruth = true\n",
            ),
            line(
                "version = 1\nsensor = \"vlp-16\"\nscene = \"wall\"\nformats = [\"pcd\", \"ticks\"]\n",
            ),
        ];
        let cases = std::env::var("MACROPULSE_FUZZ_CASES");
        let cases: u32 = cases.map_or(300, |typed| typed.parse().unwrap());
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("s.toml");
        let (mut mutator, mut read) = (Mutator::new(15), 0);
        for _ in 0..cases {
            let text = mutator.next(&examples, 200);
            std::fs::write(&path, &text).unwrap();
            match Scenario::open(path.as_os_str(), &Changes::default(), Room::default()) {
                Ok(_) => read += 1,
                Err(fault) => {
                    let is_told = matches!(fault, Fault::Wrong(said) if !said.is_empty());
                    assert!(is_told, "{}", String::from_utf8_lossy(&text));
                }
            }
        }
        assert!(read > 0 && read < cases, "{read} of {cases}");
    }

    #[test]
    fn no_run_outlasts_its_clock() {
        let designs = [Design::open("kim-park-2016", &[]).unwrap()];
        assert!(check_scans(540_000, &designs).is_ok());
        assert!(check_scans(540_001, &designs).unwrap_err().contains("at most 540000"));
        assert!(check_scans(1_000_001, &[]).unwrap_err().contains("at most 1000000"));
    }
}

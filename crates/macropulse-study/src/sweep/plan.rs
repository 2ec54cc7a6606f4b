//! From what is asked for to points and jobs, all of them checked.

use std::ops::Range;
use std::path::{Path, PathBuf};

use rayon::prelude::*;
use serde_json::{Value, json};

use super::{Axis, Error, Job};
use crate::record::{defaults, named, not_modelled, surroundings, warnings};
use macropulse::channel::{Operating, idealised};
use macropulse::design::Design;
use macropulse::emit::{Band, bands, short_bands};
use macropulse::formats::{Entries, Named, Surroundings};
use macropulse::scene::{Changes, Room, Scene, apart};

/// More jobs than this are taken for a slip.
const MOST_JOBS: u64 = 100_000;

/// Request for a sweep.
#[derive(Debug, Clone)]
pub struct Request {
    /// Ready sensors or files; several of them are varied like a key.
    pub sensors: Vec<String>,
    /// Ready scene or file.
    pub scene: String,
    /// Changes as dotted keys and values. Keys behind `scene:` or of the environment change the scene, the
    /// others change all sensors.
    pub set: Vec<(String, String)>,
    /// The varied keys with their values.
    pub vary: Vec<Axis>,
    /// The seeds with which every point is measured.
    pub seeds: Range<u64>,
    /// About how many shots of a scan are measured, in whole bands; all if `None`.
    pub shots: Option<u64>,
}

/// Every combination of the values that are varied, with every seed. All of it is valid.
#[derive(Debug)]
pub struct Plan {
    /// The varied keys: the first along x, the second from curve to curve.
    pub axes: Vec<Axis>,
    /// All combinations; the values of the last axis change fastest.
    pub points: Vec<Point>,
    /// The seeds.
    pub seeds: Range<u64>,
    /// Ready scene or file, as typed.
    pub scene: String,
    set: Vec<(String, String)>,
    scenes: Vec<(Vec<(String, String)>, Scene)>,
}

/// A sensor in a scene: one combination of values.
#[derive(Debug)]
pub struct Point {
    /// A value of each axis.
    pub values: Vec<String>,
    /// The sensor.
    pub sensor: Named,
    /// The scene.
    pub scene: Named,
    /// Pixels measured with each seed.
    pub shots: u64,
    /// Pixels of a whole scan.
    pub shots_per_scan: u64,
    /// Sun and air.
    pub environment: Surroundings,
    /// Effects that are left out.
    pub idealised: Vec<String>,
    /// Effects that are not modelled, with their sizes, by name.
    pub not_modelled: Entries<Value>,
    /// Values that the file leaves open, by key.
    pub defaults: Entries<Value>,
    /// Assumptions made in reading the scene.
    pub assumed: Vec<String>,
    /// Warnings of the sensor and of the scene.
    pub warnings: Vec<String>,
    /// The whole sensor as TOML.
    pub(super) text: String,
    /// The measured parts of a scan.
    pub(super) bands: Vec<Band>,
    /// Number of its scene.
    scene_index: usize,
}

impl Plan {
    /// The sweep that is asked for.
    ///
    /// # Errors
    /// If a sensor, the scene, a key or a value is wrong, nothing is varied, or more than two
    /// things are, or there would be too many jobs.
    pub fn of(request: &Request) -> Result<Self, Error> {
        Self::within(request, Room::default())
    }

    /// The same, if there is `room` for the meshes of all its scenes.
    ///
    /// # Errors
    /// As [`Plan::of`], and if there is not.
    pub fn within(request: &Request, mut room: Room) -> Result<Self, Error> {
        let axes = axes(request)?;
        let count = axes.iter().map(|axis| axis.values.len() as u64).product::<u64>();
        let seeds = request.seeds.end.saturating_sub(request.seeds.start);
        if seeds == 0 {
            return Error::asked("0 seeds are none; ask for at least 1");
        }
        if count.saturating_mul(seeds) > MOST_JOBS {
            return Error::asked(format!(
                "{count} values with {seeds} seeds each are too many; {MOST_JOBS} scans at most"
            ));
        }
        let mut scenes: Vec<(Vec<(String, String)>, Scene)> = Vec::new();
        let combinations = combinations(&axes);
        for values in &combinations {
            let changes = changes(request, &axes, values).of_scene;
            if scenes.iter().all(|(known, _)| *known != changes) {
                let scene = Scene::open_within(&request.scene, &changes, room).map_err(
                    |error| match axes.iter().any(Axis::is_of_scene) {
                        true => at(&axes, values, &error.to_string()),
                        false => error.into(),
                    },
                )?;
                room = room.beside(scene.kept().0);
                scenes.push((changes, scene));
            }
        }
        let point = |values: &Vec<String>| Point::new(request, &axes, values, &scenes);
        // One after the other, so that the first one that is wrong is told.
        let points: Vec<Result<Point, Error>> = combinations.par_iter().map(point).collect();
        Ok(Self {
            points: points.into_iter().collect::<Result<_, _>>()?,
            axes,
            seeds: request.seeds.clone(),
            scene: request.scene.clone(),
            set: request.set.clone(),
            scenes,
        })
    }

    /// Number of jobs.
    pub fn count(&self) -> usize {
        self.points.len() * (self.seeds.end - self.seeds.start) as usize
    }

    /// Every point with every seed; the seed changes fastest.
    pub fn jobs(&self) -> impl Iterator<Item = Job<'_>> {
        self.points.iter().flat_map(|point| self.jobs_of(point))
    }

    /// One point with every seed.
    pub(super) fn jobs_of<'a>(&'a self, point: &'a Point) -> impl Iterator<Item = Job<'a>> {
        let (_, scene) = &self.scenes[point.scene_index];
        self.seeds.clone().map(move |seed| Job { point, scene, seed })
    }

    /// Everything that makes the sweep another one if it changes, except the scores. Part of the manifest.
    pub(super) fn description(&self) -> Value {
        let points: Vec<Value> = self
            .points
            .iter()
            .map(|point| {
                json!({
                    "values": point.values,
                    "sensor": point.sensor,
                    "scene": point.scene,
                    "pixels": point.shots,
                    "pixels_per_scan": point.shots_per_scan,
                })
            })
            .collect();
        let set: Vec<String> =
            self.set.iter().map(|(key, value)| format!("{key}={value}")).collect();
        json!({
            "version": env!("CARGO_PKG_VERSION"),
            "scene": self.scene,
            "set": set,
            "vary": self.axes.iter().map(|axis| &axis.key).collect::<Vec<_>>(),
            "first_seed": self.seeds.start,
            "seeds": self.seeds.end - self.seeds.start,
            "points": points,
        })
    }
}

impl Point {
    fn new(
        request: &Request,
        axes: &[Axis],
        values: &[String],
        scenes: &[(Vec<(String, String)>, Scene)],
    ) -> Result<Self, Error> {
        let Changes { of_scene, of_sensor } = changes(request, axes, values);
        let scene_index = scenes.iter().position(|(known, _)| *known == of_scene).unwrap_or(0);
        let scene = &scenes[scene_index].1;
        let varied = axes.iter().zip(values).find(|(axis, _)| is_sensor(request, axis));
        let sensor = varied.map(|(_, name)| name).or(request.sensors.first());
        let sensor = sensor.map_or("", String::as_str);
        let design = Design::open(sensor, &of_sensor).map_err(|error| {
            // An error that occurs without the varied values as well is reported without them.
            match Design::open(sensor, &apart(&request.set).of_sensor) {
                Err(plain) if plain == error => plain.into(),
                _ => at(axes, values, &error.to_string()),
            }
        })?;
        Operating::of(&design, &scene.environment)
            .map_err(|error| at(axes, values, &error.to_string()))?;
        let bands = spread(&design, request.shots);
        Ok(Self {
            values: values.to_vec(),
            sensor: named(&design),
            scene: Named { name: scene.name.clone(), digest: scene.digest() },
            shots: bands.iter().map(|band| band.shots).sum(),
            shots_per_scan: design.shots_per_scan(),
            environment: surroundings(&scene.environment),
            idealised: idealised(&design, &scene.environment)
                .iter()
                .map(|effect| effect.name.to_owned())
                .collect(),
            not_modelled: not_modelled(&design, &scene.environment),
            assumed: scene.notes.clone(),
            warnings: warnings(&design, scene),
            defaults: defaults(&design),
            text: design.text,
            bands,
            scene_index,
        })
    }

    /// The sensor once more: a design is too large to keep one for every point.
    pub(super) fn design(&self) -> Result<Design, Error> {
        Ok(Design::from_toml(&self.text, &self.sensor.name, &PathBuf::new(), &[])?)
    }
}

/// The varied keys, and then the sensors if there are several.
fn axes(request: &Request) -> Result<Vec<Axis>, Error> {
    let mut axes = request.vary.clone();
    if request.sensors.is_empty() {
        return Error::asked("there is no sensor; name one at least");
    }
    if request.sensors.len() > 1 {
        axes.push(Axis::of_sensors(&request.sensors)?);
    }
    if let Some(axis) = axes.iter().find(|axis| axis.values.is_empty()) {
        return Error::asked(format!("{} has no values", axis.key));
    }
    if let [one, other, ..] = axes.as_slice()
        && one.key == other.key
    {
        return Error::asked(format!("{} is varied twice", one.key));
    }
    if let Some((key, _)) = request.set.iter().find(|(key, _)| axes.iter().any(|a| a.key == *key)) {
        return Error::asked(format!("{key} is varied and set; leave one out"));
    }
    match axes.len() {
        0 => Error::asked("nothing is varied; give a key with its values, or several sensors"),
        1 | 2 => Ok(axes),
        _ => Error::asked("more than two things are varied; two make a grid, and no more can be"),
    }
}

fn is_sensor(request: &Request, axis: &Axis) -> bool {
    request.sensors.len() > 1 && axis.key == "sensor"
}

/// Every combination of values, those of the last axis changing fastest.
fn combinations(axes: &[Axis]) -> Vec<Vec<String>> {
    axes.iter().fold(vec![Vec::new()], |begun, axis| {
        let with_each = |start: &Vec<String>| {
            let longer = |value: &String| start.iter().chain([value]).cloned().collect::<Vec<_>>();
            axis.values.iter().map(longer).collect::<Vec<_>>()
        };
        begun.iter().flat_map(with_each).collect()
    })
}

/// The changes of the scene and of the sensor where the axes have these `values`.
fn changes(request: &Request, axes: &[Axis], values: &[String]) -> Changes {
    let keys = axes.iter().zip(values).filter(|(axis, _)| !is_sensor(request, axis));
    let varied = keys.map(|(axis, value)| (axis.key.clone(), value.clone()));
    apart(&request.set.iter().cloned().chain(varied).collect::<Vec<_>>())
}

/// The error `message` of one combination of values.
fn at(axes: &[Axis], values: &[String], message: &str) -> Error {
    let keys = axes.iter().zip(values).map(|(axis, value)| format!("{} = {value}", axis.key));
    // Designs know changes by the option of other commands.
    let message = message.strip_prefix("--set: ").unwrap_or(message);
    Error::Asked(format!("with {}: {message}", keys.collect::<Vec<_>>().join(", ")))
}

/// Short bands of the first scan, about `shots` shots in all, evenly over the scan. All bands of it if
/// `shots` is `None`, or if it has no more shots.
fn spread(design: &Design, shots: Option<u64>) -> Vec<Band> {
    let Some(shots) = shots.filter(|shots| *shots < design.shots_per_scan()) else {
        return bands(design, 0).collect();
    };
    let all: Vec<Band> = short_bands(design, 0).collect();
    let longest = all.first().map_or(1, |band| band.shots.max(1));
    let wanted = (shots.div_ceil(longest).max(1) as usize).min(all.len());
    // The middle of each of `wanted` equal parts.
    (0..wanted).map(|part| all[(2 * part + 1) * all.len() / (2 * wanted)]).collect()
}

/// The folder of the jobs of a sweep in `folder`.
pub(super) fn folder_of_jobs(folder: &Path) -> PathBuf {
    folder.join("jobs")
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::str::FromStr;

    fn request(sensors: &[&str], vary: &[&str]) -> Request {
        Request {
            sensors: sensors.iter().map(|name| (*name).to_owned()).collect(),
            scene: "wall".to_owned(),
            set: vec![],
            vary: vary.iter().map(|typed| Axis::from_str(typed).unwrap()).collect(),
            seeds: 1..3,
            shots: None,
        }
    }

    fn told(request: &Request) -> String {
        Plan::of(request).unwrap_err().to_string()
    }

    #[test]
    fn a_grid_has_every_combination_with_every_seed() {
        let vary = ["scan.max_range_m=60,70", "scene:object.wall.position_m.x=20,30,40"];
        let plan = Plan::of(&request(&["peregrine"], &vary)).unwrap();
        let values: Vec<String> = plan.points.iter().map(|point| point.values.join(" ")).collect();
        assert_eq!(values, ["60 20", "60 30", "60 40", "70 20", "70 30", "70 40"]);
        assert_eq!((plan.count(), plan.jobs().count()), (12, 12));
        let names: std::collections::BTreeSet<String> = plan.jobs().map(|job| job.name()).collect();
        assert_eq!(names.len(), 12);
        assert_eq!(plan.scenes.len(), 3);
        assert_eq!(plan.points[0].scene.digest, plan.points[3].scene.digest);
    }

    #[test]
    fn several_sensors_are_an_axis_and_curves_beside_a_key() {
        let two = ["peregrine", "hdl-64e"];
        let alone = Plan::of(&request(&two, &[])).unwrap();
        assert_eq!(alone.points[1].sensor.name, "hdl-64e");
        let both = Plan::of(&request(&two, &["scan.max_range_m=60,70"])).unwrap();
        assert_eq!(both.axes[1].key, "sensor");
        assert_eq!(both.points[2].values, ["70", "peregrine"]);
    }

    #[test]
    fn a_part_of_a_scan_is_whole_bands_spread_evenly() {
        let design = Design::open("kim-park-2016", &[]).unwrap();
        let whole: Vec<Band> = bands(&design, 0).collect();
        let all: Vec<Band> = short_bands(&design, 0).collect();
        assert_eq!(spread(&design, None), whole);
        assert_eq!(spread(&design, Some(u64::MAX)), whole);
        assert_eq!(spread(&design, Some(1)), [all[all.len() / 2]]);
        let four = spread(&design, Some(4 * all[0].shots));
        assert_eq!(four.len(), 4);
        let gaps: Vec<u64> = four.windows(2).map(|two| two[1].first - two[0].first).collect();
        let quarter = design.shots_per_scan() / 4;
        assert!(gaps.iter().all(|gap| gap.abs_diff(quarter) <= all[0].shots), "{gaps:?}");
    }

    #[test]
    fn what_cannot_be_is_refused() {
        let one = ["peregrine"];
        assert!(told(&request(&one, &[])).contains("nothing is varied"));
        assert!(told(&request(&[], &["a=1,2"])).contains("no sensor"));
        assert!(told(&request(&one, &["a=1,2", "b=1,2", "c=1,2"])).contains("more than two"));
        assert!(told(&request(&one, &["a=1,2", "a=3,4"])).contains("a is varied twice"));
        assert_eq!(
            told(&request(&one, &["scan.max_rnage_m=60,70"])),
            "with scan.max_rnage_m = 60: scan.max_rnage_m: unknown key `max_rnage_m`; did you mean `max_range_m`?"
        );
        let both = told(&request(&one, &["scan.max_range_m=60,-1"]));
        assert!(
            both.starts_with("with scan.max_range_m = -1: scan.max_range_m: is -1, but"),
            "{both}"
        );
        let scene = told(&request(&one, &["scene:object.wal.position_m.x=1,2"]));
        assert!(scene.contains("did you mean `wall`"), "{scene}");
        let mut without = request(&one, &["scan.max_range_m=60,70"]);
        without.vary[0].values.clear();
        assert!(told(&without).contains("has no values"));
        let mut set = request(&one, &["scan.max_range_m=60,70"]);
        set.set.push(("scan.max_range_m".to_owned(), "3".to_owned()));
        assert!(told(&set).contains("varied and set"));
        set.set[0].0 = "scan.max_rnage_m".to_owned();
        assert!(told(&set).starts_with("--set: scan.max_rnage_m"));
        let misspelt = told(&request(&["perigrine"], &["scan.max_range_m=60,70"]));
        assert!(misspelt.starts_with("perigrine: no such sensor; did you mean"), "{misspelt}");
        let scene = Request { scene: "wal".to_owned(), ..request(&one, &["tdc.bits=8,9"]) };
        assert!(told(&scene).starts_with("there is no scene"));
        let many = Request { seeds: 0..60_000, ..request(&one, &["scan.max_range_m=60,70"]) };
        assert!(told(&many).contains("100000 scans at most"));
        let none = Request { seeds: 3..3, ..request(&one, &["scan.max_range_m=60,70"]) };
        assert!(told(&none).contains("at least 1"));
    }
}

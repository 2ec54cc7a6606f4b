//! Other lidars in the scene: what they are and where they stand.

use std::path::{Path, PathBuf};

use toml::{Table, Value};

use super::error::Error;
use super::file::{InterfererTyped, Source};
use super::motion::Motion;
use super::spanned::Spanned;
use super::stand::Stand;
use crate::design::{Design, preset_text};
use crate::digest::Digest;
use crate::emit::Clock;

/// Most interferers: their numbers have eight bits in the counters of random numbers.
pub(super) const MOST: usize = 255;

/// Farthest a clock may be ahead or behind, s.
const MOST_PHASE: f64 = 1000.0;

/// Most by which a clock may run fast or slow, in millionths.
const MOST_DRIFT: f64 = 1000.0;

/// Another lidar whose light falls into the scene while the sensor measures.
#[derive(Debug, Clone)]
pub struct Interferer {
    /// Name, for reports.
    pub name: String,
    /// Its design.
    pub design: Design,
    /// Its place and attitude, at any time.
    pub motion: Motion,
    /// When it fires.
    pub clock: Clock,
}

impl Digest {
    /// Takes in a lidar.
    pub(super) fn interferer(&mut self, interferer: &Interferer) {
        self.bytes(interferer.design.text.as_bytes());
        self.motion(&interferer.motion);
        self.bytes(&interferer.clock.phase_fs.to_le_bytes());
        self.bytes(&interferer.clock.drift.to_le_bytes());
    }
}

/// Reads `[[interferers]]`; `motion` reads where one is, sensor files are looked for in `base`.
/// Gives what was assumed, too.
pub(super) fn interferers(
    (source, base): (Source<'_>, &Path),
    typed: &[Spanned<InterfererTyped>],
    motion: impl Fn(&Stand) -> Result<Motion, Error>,
) -> Result<(Vec<Interferer>, Vec<String>), Error> {
    if let Some(one_more) = typed.get(MOST) {
        let message = format!("a scene holds at most {MOST} other lidars");
        return Err(source.fault(one_more.span(), message));
    }
    let (mut interferers, mut notes): (Vec<Interferer>, _) = (Vec::new(), Vec::new());
    for spanned in typed {
        let typed = spanned.get_ref();
        let design = open(source, base, typed)?;
        let name = typed.name.clone().unwrap_or_else(|| {
            let alike = |interferer: &&Interferer| interferer.design.name == design.name;
            format!("{} {}", design.name, interferers.iter().filter(alike).count() + 1)
        });
        if typed.position_m.is_none() && typed.path.is_none() {
            notes.push(format!("{name}: no position_m given, it stands at the origin"));
        }
        if typed.phase_ns.is_none() {
            notes.push(format!("{name}: no phase_ns given, its scans begin with ours"));
        }
        let bounded = |typed: &Option<Spanned<f64>>, key: &str, most: f64| match typed {
            Some(typed) if !(-most..=most).contains(typed.get_ref()) => {
                let value = typed.get_ref();
                let message = format!("{key} is {value}; it must be from {} to {most}", -most);
                Err(source.fault(typed.span(), message))
            }
            Some(typed) => Ok(*typed.get_ref()),
            None => Ok(0.0),
        };
        let phase_ns = bounded(&typed.phase_ns, "phase_ns", MOST_PHASE * 1e9)?;
        let drift_ppm = bounded(&typed.drift_ppm, "drift_ppm", MOST_DRIFT)?;
        let clock = Clock {
            phase_fs: (phase_ns * 1e6).round() as i64,
            drift: (drift_ppm * 1e6).round() as i64,
        };
        let motion = motion(&typed.stand())?;
        interferers.push(Interferer { name, design, motion, clock });
    }
    if !interferers.is_empty() {
        notes.push(
            "other lidars: their light is as strong in our receiver as their own sensitivity has \
             it in theirs, through the same aperture and optics, unless both have a link budget"
                .to_owned(),
        );
    }
    Ok((interferers, notes))
}

/// The sensor that is named, with what is changed of it.
fn open(source: Source<'_>, base: &Path, typed: &InterfererTyped) -> Result<Design, Error> {
    let named = typed.sensor.get_ref();
    let ready = preset_text(named).is_some() || !named.ends_with(".toml");
    let place = if ready { PathBuf::from(named) } else { base.join(named) };
    let mut changes = Vec::new();
    flatten(&typed.set, "", &mut changes);
    Design::open(&place, &changes)
        .map_err(|error| source.fault(typed.sensor.span(), error.to_string()))
}

/// Dotted keys and values of a table, as an option on the command line has them.
fn flatten(table: &Table, path: &str, changes: &mut Vec<(String, String)>) {
    for (key, value) in table {
        let path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
        match value {
            Value::Table(inner) => flatten(inner, &path, changes),
            value => changes.push((path, value.to_string())),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::Scene;
    use super::*;

    fn scene(interferers: &str) -> Result<Scene, Error> {
        let text = format!("version = 1\nground = {{ material = \"asphalt\" }}\n{interferers}");
        Scene::from_toml(&text, "a.toml", Path::new(""))
    }

    fn told(interferers: &str) -> String {
        scene(interferers).unwrap_err().to_string()
    }

    #[test]
    fn a_lidar_is_read_with_all_its_keys() {
        let scene = scene(
            "[[interferers]]\nsensor = \"kim-park-2016\"\nposition_m = [50, 0, 2]\nyaw_deg = 180\n\
             phase_ns = 1234.5\ndrift_ppm = 20.0\n\
             set = { \"code.word.first\" = 3, code.word.modulus = 26 }\n\
             [[interferers]]\nsensor = \"hdl-64e\"\nname = \"van\"\nvelocity_m_s = [-9, 0, 0]\n",
        )
        .unwrap();
        let [first, second] = scene.interferers.as_slice() else { unreachable!() };
        assert_eq!((first.name.as_str(), second.name.as_str()), ("kim-park-2016 1", "van"));
        assert_eq!(first.motion.at_start().position, [50.0, 0.0, 2.0]);
        assert_eq!(first.clock, Clock { phase_fs: 1_234_500_000, drift: 20_000_000 });
        assert_eq!(
            (
                first.design.emission.coding().first_word,
                first.design.emission.coding().word_modulus
            ),
            (3, 26)
        );
        assert_eq!(second.clock, Clock::default());
        assert!(!first.motion.moves() && second.motion.moves());
        assert_eq!(scene.moving.iter().map(|one| one.name.as_str()).collect::<Vec<_>>(), ["van"]);
        let assumed = scene.notes.join("\n");
        assert!(assumed.contains("van: no phase_ns given"), "{assumed}");
        assert!(!assumed.contains("kim-park-2016 1: no phase_ns"), "{assumed}");
    }

    #[test]
    fn what_is_wrong_has_a_place_and_a_remedy() {
        let message = told("[[interferers]]\nsensor = \"kim-prak-2016\"\n");
        assert!(message.starts_with("a.toml:4:10: kim-prak-2016: no such sensor"), "{message}");
        let message = told("[[interferers]]\nsensor = \"hdl-64e\"\nphase_ns = nan\n");
        assert!(message.starts_with("a.toml:5:12: phase_ns is NaN; it must be from"), "{message}");
        let message = told("[[interferers]]\nsensor = \"hdl-64e\"\ndrift_ppm = 1e9\n");
        assert!(message.contains("drift_ppm is 1000000000; it must be from -1000 to 1000"));
        let message = told("[[interferers]]\nsensor = \"hdl-64e\"\nposition_m = [inf, 0, 0]\n");
        assert!(message.contains("three finite numbers"), "{message}");
        let message = told("[[interferers]]\nsensor = \"hdl-64e\"\nset = { \"scan.rate\" = 3 }\n");
        assert!(message.contains("unknown key `rate`"), "{message}");
        assert!(told("[[interferers]]\nyaw_deg = 3\n").contains("the key `sensor` is missing"));
        assert!(told("[[interferer]]\nsensor = \"a\"\n").contains("did you mean `interferers`?"));
        let many = "[[interferers]]\nsensor = \"peregrine\"\n".repeat(MOST + 1);
        assert!(told(&many).contains("at most 255 other lidars"));
    }

    #[test]
    fn the_digest_knows_the_interferers() {
        let digest = |interferers: &str| scene(interferers).unwrap().digest();
        let one = digest("[[interferers]]\nsensor = \"hdl-64e\"\n");
        assert_ne!(one, digest(""));
        assert_ne!(one, digest("[[interferers]]\nsensor = \"hdl-64e\"\ndrift_ppm = 1\n"));
        assert_ne!(one, digest("[[interferers]]\nsensor = \"peregrine\"\n"));
        assert_ne!(one, digest("[[interferers]]\nsensor = \"hdl-64e\"\nturn_rate_deg_s = 1\n"));
        assert_eq!(one, digest("[[interferers]]\nsensor = \"hdl-64e\"\nphase_ns = 0\n"));
    }
}

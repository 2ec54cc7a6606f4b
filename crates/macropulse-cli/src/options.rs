//! Options that commands share.

use std::fmt::Display;
use std::ops::RangeInclusive;
use std::str::FromStr;

use clap::{Args, ValueEnum};
use clap_complete::engine::ArgValueCompleter;
use macropulse::design::{self, WITH, WITHOUT};
use macropulse::environment::{self, Environment};
use macropulse::names::nearest;
use macropulse::scene;

use crate::completions;
use crate::fault::Fault;
use crate::text::warn;

/// Options of every command.
#[derive(Args)]
#[command(next_help_heading = "Everywhere")]
pub struct Common {
    /// Print nothing but what went wrong, as a result without a single point, and what --json asks for
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    pub quiet: bool,

    /// Print also which defaults were used and what was assumed
    #[arg(short, long, global = true)]
    pub verbose: bool,

    /// Threads to compute with; 0 is one per core. The results do not depend on it
    #[arg(short = 'j', long, global = true, value_name = "N", default_value_t = 0)]
    #[arg(value_parser = whole(0..=MOST_THREADS))]
    pub threads: u16,

    /// How progress is shown on stderr
    #[arg(long, global = true, value_name = "HOW", default_value = "auto")]
    pub progress: ProgressKind,
}

/// Threads at most.
const MOST_THREADS: u16 = 1024;

/// The variable by which rayon is asked for threads.
const RAYON_THREADS: &str = "RAYON_NUM_THREADS";

/// How progress is shown.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ProgressKind {
    /// A bar on a terminal, plain lines elsewhere
    Auto,
    /// One JSON object per line
    Json,
    /// Not at all
    None,
}

impl Common {
    /// Says on stderr, as one sentence, what a user should know although all went as asked, unless
    /// the program is to be quiet.
    pub fn note(&self, sentence: &str) {
        if !self.quiet {
            warn(sentence);
        }
    }

    /// Sets the number of threads of rayon to `--threads` or, if that is 0, to its own RAYON_NUM_THREADS.
    pub fn use_threads(&self) -> Result<(), Fault> {
        let asked = (self.threads == 0).then(|| std::env::var(RAYON_THREADS).ok()).flatten();
        if let Some(asked) =
            asked.filter(|asked| asked.parse().is_ok_and(|n: u64| n > u64::from(MOST_THREADS)))
        {
            let message =
                format!("{RAYON_THREADS} is {asked}; it must be from 0 to {MOST_THREADS}");
            return Err(Fault::Wrong(message));
        }
        rayon::ThreadPoolBuilder::new()
            .num_threads(usize::from(self.threads))
            .build_global()
            .map_err(|error| Fault::Ours(format!("cannot start the threads: {error}")))
    }
}

/// A parser of whole numbers within `limits`.
pub fn whole<T>(limits: RangeInclusive<T>) -> impl Fn(&str) -> Result<T, String> + Clone
where
    T: FromStr + PartialOrd + Display + Clone,
{
    move |typed| match typed.parse() {
        Ok(number) if limits.contains(&number) => Ok(number),
        _ => {
            let (least, most) = (limits.start(), limits.end());
            Err(format!("it must be a whole number from {least} to {most}"))
        }
    }
}

/// Changes of sensors, scenes and their environments.
#[derive(Args)]
pub struct Changes {
    /// Change one value of the sensor, as scan.max_range_m=90, of the environment, as
    /// environment.visibility_km=0.05, or of the scene, as scene:object.wall.material=brick;
    /// repeatable
    #[arg(long, value_name = "KEY=VALUE", value_parser = change)]
    set: Vec<(String, String)>,

    /// Simulate an effect that the sensor or the environment leaves out: take it off the list
    /// `idealised`; repeatable
    #[arg(long = "with", value_name = "EFFECT", value_parser = effect)]
    with: Vec<Effect>,

    /// Leave an effect out: put it on the list `idealised`; repeatable
    #[arg(long = "without", value_name = "EFFECT", value_parser = effect)]
    without: Vec<Effect>,
}

impl Changes {
    /// All changes, those of the scene after the `environment` named, the switched effects before
    /// single keys.
    pub fn all(&self, environment: &Surroundings) -> Result<Vec<(String, String)>, Fault> {
        if let Some(both) = self.with.iter().find(|effect| self.without.contains(effect)) {
            let name = both.name();
            return Err(Fault::Wrong(format!(
                "--with {name} and --without {name} contradict each other: leave one out"
            )));
        }
        let switched = |key: &'static str, list: &[Effect]| {
            let change = |effect: &Effect| match effect {
                Effect::OfSensor(effect) => (key.to_owned(), effect.name().to_owned()),
                Effect::OfEnvironment(effect) => {
                    (format!("environment.{key}"), effect.name().to_owned())
                }
            };
            list.iter().map(change).collect::<Vec<_>>()
        };
        let switched = [switched(WITH, &self.with), switched(WITHOUT, &self.without)].concat();
        Ok([environment.changes(), switched, self.set.clone()].concat())
    }

    /// The changes of a scene apart from those of a sensor.
    pub fn apart(&self, environment: &Surroundings) -> Result<scene::Changes, Fault> {
        Ok(scene::apart(&self.all(environment)?))
    }

    /// The changes of a sensor, for a command that has no scene.
    pub fn of_sensor(&self) -> Result<Vec<(String, String)>, Fault> {
        let apart = self.apart(&Surroundings::default())?;
        match apart.of_scene.first() {
            None => Ok(apart.of_sensor),
            Some((key, _)) => Err(Fault::Wrong(format!(
                "{key}: belongs to a scene, and this command has none; leave it out"
            ))),
        }
    }
}

/// Files that a scene may name.
#[derive(Args)]
pub struct Outside {
    /// Let meshes name files outside the folder of their scene, as materials and buffers: short for
    /// --set scene:outside_files=true
    #[arg(long = "outside-files")]
    is_allowed: bool,
}

impl Outside {
    /// The change of a scene that allows it.
    pub fn changes(&self) -> Vec<(String, String)> {
        let allowed = self.is_allowed.then_some(("outside_files", "true"));
        allowed.into_iter().map(|(key, value)| (key.to_owned(), value.to_owned())).collect()
    }
}

/// Sun and air in place of those of the scene.
#[derive(Args, Default)]
pub struct Surroundings {
    /// Sun and air: a ready environment, in place of that of the scene; `macropulse environments`
    /// lists them
    #[arg(long = "environment", value_name = "NAME")]
    #[arg(add = ArgValueCompleter::new(completions::environments))]
    name: Option<String>,
}

impl Surroundings {
    /// The change of a scene to the environment named.
    pub fn changes(&self) -> Vec<(String, String)> {
        let named = self.name.iter();
        named.map(|name| ("environment".to_owned(), format!("\"{name}\""))).collect()
    }

    /// The environment named, or the usual one, with the `changes` of a scene, for a command
    /// without a scene.
    pub fn alone(changes: &scene::Changes) -> Result<Environment, Fault> {
        let mut typed = None;
        for (key, value) in &changes.of_scene {
            let Some(key) = key.strip_prefix("environment") else {
                return Err(Fault::Wrong(format!(
                    "{key}: belongs to a scene, and this command has none; leave it out"
                )));
            };
            let key = key.strip_prefix('.').unwrap_or(key);
            typed = Some(environment::change(typed, key, environment::value(value))?);
        }
        match typed {
            None => Ok(Environment::default()),
            Some(typed) => Ok(Environment::read(&typed)?),
        }
    }
}

/// An effect that can be switched.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Effect {
    OfSensor(design::Effect),
    OfEnvironment(environment::Effect),
}

impl Effect {
    fn all() -> impl Iterator<Item = Self> {
        let of_environment = environment::Effect::ALL.map(Self::OfEnvironment);
        design::Effect::ALL.map(Self::OfSensor).into_iter().chain(of_environment)
    }

    fn name(self) -> &'static str {
        match self {
            Self::OfSensor(effect) => effect.name(),
            Self::OfEnvironment(effect) => effect.name(),
        }
    }
}

fn effect(typed: &str) -> Result<Effect, String> {
    Effect::all().find(|effect| effect.name() == typed).ok_or_else(|| {
        let known: Vec<&str> = Effect::all().map(Effect::name).collect();
        let hint = nearest(typed, known.iter().copied());
        let hint = hint.map(|near| format!("did you mean `{near}`? ")).unwrap_or_default();
        format!("`{typed}` is no effect; {hint}known are {}", known.join(", "))
    })
}

fn change(typed: &str) -> Result<(String, String), String> {
    match typed.split_once('=') {
        Some((key, value)) if !key.trim().is_empty() && !value.trim().is_empty() => {
            Ok((key.trim().to_owned(), value.trim().to_owned()))
        }
        _ => Err("write it as key=value, as in --set scan.max_range_m=90".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_change_has_a_key_and_a_value() {
        assert_eq!(change("a.b = 1"), Ok(("a.b".to_owned(), "1".to_owned())));
        assert_eq!(change("a=b=c"), Ok(("a".to_owned(), "b=c".to_owned())));
        assert!(change("a").is_err() && change("=1").is_err() && change("a=").is_err());
    }
}

//! From shots to ticks: shot log, echoes, detection events, ticks. The hits of the shots in the scene are
//! traced beforehand.

use crate::Fallible;
use crate::machine::least_seconds;
use crate::page;
use crate::sample::{Condition, SCENES, Sample};

/// One band in this many is measured.
const EVERY: usize = 5;

/// Speeds, in the order of [`Condition::all`], of each of [`SCENES`].
pub struct Generating(Vec<Vec<f64>>);

/// Measures them.
pub fn measure() -> Fallible<Generating> {
    let of_scene = |scene: &str| Condition::all().map(|condition| one(scene, condition)).collect();
    Ok(Generating(SCENES.into_iter().map(of_scene).collect::<Fallible<_>>()?))
}

fn one(scene: &str, condition: Condition) -> Fallible<f64> {
    let sample = Sample::of(condition.design()?, scene, EVERY)?;
    let detectors = sample.detectors();
    let seconds = least_seconds(|| {
        sample.ticks(&detectors, |memory, (_, ticks)| memory.take_back(ticks.tick));
    });
    Ok(sample.speed(seconds))
}

impl Generating {
    /// The speed in one of the [`SCENES`].
    pub fn speed(&self, scene: &str, condition: Condition) -> Option<f64> {
        let scene = SCENES.iter().position(|other| *other == scene)?;
        self.0[scene].get(Condition::all().position(|other| other == condition)?).copied()
    }

    /// The tables.
    pub fn text(&self) -> String {
        let table = |(scene, speeds): (&&str, &Vec<f64>)| {
            let cells: Vec<String> = speeds.iter().map(|speed| page::speed(*speed)).collect();
            Condition::table(scene, &cells)
        };
        let tables: Vec<String> = SCENES.iter().zip(&self.0).map(table).collect();
        format!("Speed, from shot log to ticks.\n\n{}", tables.join("\n"))
    }
}

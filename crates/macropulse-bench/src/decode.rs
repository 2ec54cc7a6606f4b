//! From ticks to returns, and how that grows.

use std::hint::black_box;

use crate::Fallible;
use crate::machine::least_seconds;
use crate::page::{self, grouped, three};
use crate::sample::{Condition, SCENES, Sample, Score};

/// Intervals of the measured bands: in a scene with surfaces, and in one where every shot has a range of its
/// own.
const EVERY: [usize; 2] = [5, 12];

/// Measurements of one scene and detector.
#[derive(Debug, Clone, Copy)]
pub struct Decoded {
    /// How fast.
    pub speed: f64,
    /// How well.
    pub score: Score,
}

/// Measurements of each of [`SCENES`], in the order of [`Condition::all`].
pub struct Decoding(Vec<Vec<Decoded>>);

/// Measures it.
pub fn measure() -> Fallible<Decoding> {
    let of_scene = |scene: &str| Condition::all().map(|condition| one(scene, condition)).collect();
    Ok(Decoding(SCENES.into_iter().map(of_scene).collect::<Fallible<_>>()?))
}

fn one(scene: &str, condition: Condition) -> Fallible<Decoded> {
    let every = EVERY[usize::from(scene == "random")];
    let sample = Sample::of(condition.design()?, scene, every)?;
    let given = sample.given();
    let score = sample.score(&given, &sample.decode(&given)?);
    Ok(Decoded { speed: sample.speed(sample.decoding_seconds()), score })
}

/// How well a whole scan of `scene` is decoded.
pub fn whole(scene: &str, condition: Condition) -> Fallible<Score> {
    let sample = Sample::of(condition.design()?, scene, 1)?;
    let given = sample.given();
    Ok(sample.score(&given, &sample.decode(&given)?))
}

impl Decoding {
    /// Returns the measurements of one of the [`SCENES`].
    pub fn of(&self, scene: &str, condition: Condition) -> Option<Decoded> {
        let scene = SCENES.iter().position(|other| *other == scene)?;
        self.0[scene].get(Condition::all().position(|other| other == condition)?).copied()
    }

    /// The tables.
    pub fn text(&self) -> String {
        let cell = |Decoded { speed, score }: &Decoded| {
            format!("{}, {:.3}, {}", page::speed(*speed), score.percent(), score.wrong)
        };
        let table = |(scene, cells): (&&str, &Vec<Decoded>)| {
            Condition::table(scene, &cells.iter().map(cell).collect::<Vec<_>>())
        };
        let tables: Vec<String> = SCENES.iter().zip(&self.0).map(table).collect();
        let echoes = self.0.iter().map(|cells| grouped(cells[0].score.echoes as f64));
        format!(
            "Each entry has the speed, the shots right to 1.5 mm in per cent of those with an echo, \
             and the returns more than 0.35 m from every surface. The samples have {} echoes.\
             \n\n{}",
            echoes.collect::<Vec<_>>().join(", "),
            tables.join("\n")
        )
    }
}

/// How the time grows with the range gate and with the number of shots.
pub fn growth() -> Fallible<String> {
    let mut gates = Vec::new();
    for scene in ["street", "random"] {
        for gate in [37.0, 75.0, 150.0] {
            let sample = Sample::of(Condition::CLEAN.design_to(gate)?, scene, 12)?;
            let ticks: usize = sample.given().iter().map(|(_, ticks)| ticks.tick.len()).sum();
            let seconds = sample.decoding_seconds();
            let scan = sample.design.shots_per_scan() as f64 / sample.shots();
            gates.push(vec![
                format!("`{scene}`"),
                format!("{gate}"),
                page::speed(sample.speed(seconds)),
                three(1e-6 * scan * ticks as f64),
                three(1e9 * seconds / ticks as f64),
            ]);
        }
    }
    let mut shots = Vec::new();
    for every in [32, 8, 2] {
        let sample = Sample::of(Condition::CLEAN.design()?, "street", every)?;
        let given = sample.given();
        let later = least_seconds(|| drop(black_box(sample.decode(&given))));
        let each = |seconds: f64| three(1e9 * seconds / sample.shots());
        shots.push(vec![grouped(sample.shots()), each(sample.decoding_seconds()), each(later)]);
    }
    let gates =
        page::table(&["scene", "gate, m", "speed", "million ticks a scan", "ns a tick"], &gates);
    let head = ["shots of the clean `street`", "ns a shot", "of ticks that were made long ago"];
    let shots = page::table(&head, &shots);
    Ok(format!("{gates}\n{shots}"))
}

//! How fast processors without the widest instructions decode, as far as this one can tell: with fewer of
//! its own.

use std::process::Command;

use macropulse::codec::level::{Level, VARIABLE};

use crate::Fallible;
use crate::goals;
use crate::machine::printed;
use crate::page;
use crate::sample::Sample;

/// Interval of the decoded bands.
const EVERY: usize = 12;

/// Returns the output of a process that uses the instructions of one level: the decoding speed of each goal,
/// one to a line.
pub fn speeds() -> Fallible<String> {
    let speed = |goal: goals::Decode| -> Fallible<String> {
        let sample = Sample::of(goal.condition.design()?, goal.scene, EVERY)?;
        Ok(format!("{}\n", sample.speed(sample.decoding_seconds())))
    };
    goals::decoding().map(speed).collect()
}

/// The table.
pub fn text() -> Fallible<String> {
    let levels: Vec<Level> =
        Level::ALL.into_iter().filter(|level| *level <= Level::here()).collect();
    let mut rows: Vec<Vec<String>> =
        goals::decoding().map(|goal| vec![format!("`{}`, {}", goal.scene, goal.name)]).collect();
    for level in &levels {
        let program = std::env::current_exe()?;
        let speeds = printed(Command::new(program).arg("speeds").env(VARIABLE, level.name()))?;
        for (row, speed) in rows.iter_mut().zip(speeds.lines()) {
            row.push(page::speed(speed.parse()?));
        }
    }
    let names = levels.iter().map(|level| level.name());
    Ok(page::table(&["decoding"].into_iter().chain(names).collect::<Vec<_>>(), &rows))
}

//! Ablation of a lidar: one thing changed at a time.

use toml::Value;

use super::Error;
use super::trial::{Bench, Counts, Trial};

/// Result for a lidar with one thing changed.
#[derive(Debug, Clone, PartialEq)]
pub struct Ablation {
    /// Description of the change.
    pub what: String,
    /// Counts with the change, in the order of [`super::Scenery::ALL`].
    pub counts: [Counts; 2],
}

/// A sentence, and the keys of the sensor with their values.
type Change = (&'static str, Vec<(&'static str, Value)>);

/// How many things are changed.
pub(super) const ABLATIONS: usize = 8;

fn changes(marks: u32, energy_nj: f64) -> [Change; ABLATIONS] {
    [
        ("half the light", vec![("light.energy", half(energy_nj))]),
        ("amplifier of 24 pA/√Hz", vec![("detector.photodiode.amplifier_pa_rthz", 24.0.into())]),
        ("6 pF at the amplifier", vec![("detector.photodiode.capacitance_pf", 6.0.into())]),
        ("dark current of 20 nA", vec![("detector.photodiode.dark_current_na", 20.0.into())]),
        ("own stray light blinds for 20 ns", vec![("receiver.blank_ns", 20.0.into())]),
        (
            "no own stray light",
            vec![
                ("detector.photodiode.isolation_db", 200.0.into()),
                ("receiver.blank_ns", 0.0.into()),
            ],
        ),
        ("every mark must tell", vec![("receiver.least_marks", i64::from(marks).into())]),
        ("marks 0.8 ns apart", vec![("code.family.separated.gap", 2.into())]),
    ]
}

fn half(energy_nj: f64) -> Value {
    let key = ("shot_nj".to_owned(), Value::from(energy_nj / 2.0));
    toml::Table::from_iter([key]).into()
}

/// Returns the counts of `best` with each change; `None` if the watch said stop.
pub(super) fn ablations(bench: &Bench, best: &Trial) -> Result<Option<Vec<Ablation>>, Error> {
    let mut all = Vec::new();
    for (what, changes) in changes(best.candidate.marks, best.candidate.energy * 1e9) {
        let changes: Vec<(String, Value)> =
            changes.into_iter().map(|(key, value)| (key.to_owned(), value)).collect();
        let Some(counts) = bench.of_each(&best.candidate, &changes)? else { return Ok(None) };
        all.push(Ablation { what: what.to_owned(), counts });
    }
    Ok(Some(all))
}

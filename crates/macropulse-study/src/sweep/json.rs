//! What programs are told of a sweep.

use serde_json::{Value, json};

use super::{Plan, Shard, Table};

impl Plan {
    /// What was asked for, and the rows of its table.
    pub fn json(&self, table: &Table) -> Value {
        let mut told = self.asked();
        told["rows"] = table.json();
        told
    }

    /// What was asked for, and which scans are `missing`: how many, and of the parts like `shard` those
    /// that have any.
    pub fn json_of_missing(&self, missing: &[usize], shard: Shard) -> Value {
        let mut told = self.asked();
        told["missing"] = missing.len().into();
        told["missing_shards"] = shard.with_any(missing).into();
        told
    }

    fn asked(&self) -> Value {
        json!({
            "sensors": self.sensors(),
            "scene": self.scene,
            "vary": self.axes.iter().map(|axis| &axis.key).collect::<Vec<_>>(),
            "seeds": self.seeds.end - self.seeds.start,
            "scans": self.count(),
        })
    }
}

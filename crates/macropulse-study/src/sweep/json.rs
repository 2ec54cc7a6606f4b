//! Sweeps as JSON, for other programs.

use serde_json::{Value, json};

use super::{Plan, Shard, Table};

impl Plan {
    /// The request, and the rows of its table.
    pub fn json(&self, table: &Table) -> Value {
        let mut told = self.asked();
        told["rows"] = table.json();
        told
    }

    /// The request, the number of scans that are `missing`, and the parts that have any of them. The sweep is
    /// divided as for `shard`.
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

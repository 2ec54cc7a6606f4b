//! How much memory a run may take, and what this machine has.

use clap::Args;
use macropulse::formats::CloudRoom;
use macropulse::machine;
use macropulse::memory::Estimate;
use macropulse::scene::Room;
use serde_json::{Value, json};

use crate::fault::Fault;

/// The share of the machine's memory that a run may take unless another limit is typed.
const SHARE: f64 = 0.8;

/// The limit of a run.
#[derive(Args)]
pub struct MemoryLimit {
    /// Refuse what is estimated to take more memory than this, as 2GB, 500MiB or 50% of what the
    /// machine has [default: 80%]
    #[arg(long = "memory-limit", value_name = "SIZE", value_parser = size)]
    limit: Option<Size>,
}

/// An amount of memory.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Size {
    Bytes(u64),
    /// A share of the machine's memory.
    Share(f64),
}

impl MemoryLimit {
    /// Refuses what is `estimated` for `what`, a sensor in a scene, with the threads there are, if it
    /// is more than allowed.
    pub fn allow(&self, what: &str, estimated: &Estimate) -> Result<(), Fault> {
        self.allow_with(rayon::current_num_threads(), what, estimated)
    }

    /// The same of what is to be checked alone: refused is what not even one thread could do.
    pub fn allow_alone(&self, what: &str, estimated: &Estimate) -> Result<(), Fault> {
        self.allow_with(1, what, estimated)
    }

    /// The room that it leaves for the meshes of a scene.
    pub fn room(&self) -> Room {
        self.bytes(machine::memory()).map_or_else(Room::default, |(bytes, _)| Room::of_bytes(bytes))
    }

    /// The room that it leaves for the clouds of a file.
    pub fn cloud_room(&self) -> CloudRoom {
        let limit = self.bytes(machine::memory());
        limit.map_or_else(CloudRoom::default, |(bytes, _)| CloudRoom::of_bytes(bytes))
    }

    fn allow_with(&self, threads: usize, what: &str, estimated: &Estimate) -> Result<(), Fault> {
        let Some((limit, whose)) = self.bytes(machine::memory()) else { return Ok(()) };
        let needed = estimated.total(threads);
        if needed <= limit {
            return Ok(());
        }
        let alone = estimated.total(0);
        let fewer = limit.saturating_sub(alone) / estimated.band.max(1);
        let remedy = match (estimated.total(1) <= limit, estimated.scene > needed / 2) {
            (true, _) => format!("compute with fewer threads, as -j {fewer}"),
            (false, true) => "give the scene fewer triangles".to_owned(),
            (false, false) => {
                "give the sensor fewer pixels, or less noise to be followed".to_owned()
            }
        };
        Err(Fault::Wrong(format!(
            "{what}: takes about {} of memory with {threads} {}, and {} are allowed ({whose}): \
             {remedy}, or raise --memory-limit",
            told(needed),
            if threads == 1 { "thread" } else { "threads" },
            told(limit)
        )))
    }

    /// Returns the limit, and whose it is, for a `machine` with this memory, if that is known.
    fn bytes(&self, machine: Option<u64>) -> Option<(u64, String)> {
        let of_machine = |share: f64| {
            let bytes = (machine? as f64 * share) as u64;
            Some((bytes, format!("{} % of what this machine has", (share * 100.0).round())))
        };
        match self.limit {
            Some(Size::Bytes(bytes)) => Some((bytes, "--memory-limit".to_owned())),
            Some(Size::Share(share)) => of_machine(share),
            None => of_machine(SHARE),
        }
    }
}

/// An estimate for programs: its parts, and all of it with the threads there are.
pub fn json(estimate: &Estimate) -> Value {
    let threads = rayon::current_num_threads();
    json!({
        "sensor_bytes": estimate.sensor,
        "scene_bytes": estimate.scene,
        "scan_bytes": estimate.scan + estimate.written,
        "band_bytes_per_thread": estimate.band,
        "threads": threads,
        "total_bytes": estimate.total(threads),
    })
}

/// An amount of memory for people.
pub fn told(bytes: u64) -> String {
    match bytes {
        0..1_000_000_000 => format!("{} MB", bytes.div_ceil(1_000_000)),
        _ => format!("{:.1} GB", bytes as f64 * 1e-9),
    }
}

const UNITS: [(&str, f64); 10] = [
    ("%", 0.01),
    ("KiB", 1024.0),
    ("MiB", 1_048_576.0),
    ("GiB", 1_073_741_824.0),
    ("TiB", 1_099_511_627_776.0),
    ("kB", 1e3),
    ("KB", 1e3),
    ("MB", 1e6),
    ("GB", 1e9),
    ("TB", 1e12),
];

fn size(typed: &str) -> Result<Size, String> {
    let remedy = || "write a number with its unit, as 2GB, 500MiB or 50%".to_owned();
    let typed = typed.trim();
    let of_unit = |(unit, factor): &(&'static str, f64)| {
        let number = typed.to_lowercase().strip_suffix(&unit.to_lowercase())?.trim().to_owned();
        Some((number, *unit, *factor))
    };
    let (number, unit, factor) = UNITS.iter().find_map(of_unit).ok_or_else(remedy)?;
    let number: f64 = number.parse().map_err(|_| remedy())?;
    let amount = number * factor;
    match (unit, amount) {
        (_, amount) if !(amount.is_finite() && amount > 0.0) => Err(remedy()),
        ("%", ..=1.0) => Ok(Size::Share(amount)),
        ("%", _) => Err("it must be 100% at most".to_owned()),
        _ => Ok(Size::Bytes(amount as u64)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_amount_has_a_number_and_a_unit() {
        assert_eq!(size("2GB"), Ok(Size::Bytes(2_000_000_000)));
        assert_eq!(size("1.5 GiB"), Ok(Size::Bytes(1_610_612_736)));
        assert_eq!(size("500mb"), Ok(Size::Bytes(500_000_000)));
        assert_eq!(size("50%"), Ok(Size::Share(0.5)));
        for wrong in ["2", "GB", "-1GB", "0MB", "101%", "1e999TB", "nanGB", ""] {
            assert!(size(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn the_limit_is_a_share_of_the_machine_unless_it_is_typed() {
        let limit = |typed: Option<&str>| MemoryLimit { limit: typed.map(|t| size(t).unwrap()) };
        let bytes = |typed, machine| limit(typed).bytes(machine).map(|(bytes, _)| bytes);
        assert_eq!(bytes(None, Some(1000)), Some(800));
        assert_eq!(bytes(Some("25%"), Some(1000)), Some(250));
        assert_eq!(bytes(Some("3kB"), Some(1000)), Some(3000));
        assert_eq!(bytes(None, None), None);
    }

    #[test]
    fn fewer_threads_are_what_is_offered_where_they_help() {
        let limit = MemoryLimit { limit: Some(Size::Bytes(5_000_000)) };
        let told = |estimated: Estimate| match limit.allow("a in b", &estimated) {
            Err(Fault::Wrong(told)) => told,
            other => panic!("{other:?}"),
        };
        let threads = rayon::current_num_threads() as u64;
        let few = Estimate { sensor: 1_000_000, band: 2_000_000, ..Estimate::default() };
        if threads > 2 {
            assert!(told(few).contains("-j 2,"), "{}", told(few));
        }
        let scene = Estimate { scene: 50_000_000, ..Estimate::default() };
        assert!(told(scene).starts_with("a in b: takes about 50 MB of memory with"));
        assert!(told(scene).contains("fewer triangles, or raise --memory-limit"));
        assert!(limit.allow("c", &Estimate { scan: 4_000_000, ..Estimate::default() }).is_ok());
    }
}

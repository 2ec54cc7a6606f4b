//! Keys of sensor files: those that candidates are made of, read and changed.

use std::path::{Path, PathBuf};

use macropulse::design::{Design, Detector, Effect, Pattern};
use toml::{Table, Value};

/// The sensor called `name_or_file`, seen from `folder`, all its keys written out; where files lie that it names;
/// and the shortest over the mean time between shots of its channels. Refuses what is no raster with a sampled
/// detector.
pub(super) fn template(name_or_file: &str, folder: &Path) -> Result<(Table, PathBuf, f64), String> {
    let beside = folder.join(name_or_file);
    let file = if beside.is_file() { beside } else { PathBuf::from(name_or_file) };
    let design = Design::open(&file, &[]).map_err(|error| error.to_string())?;
    if !matches!(design.scan.pattern, Pattern::Raster(_))
        || !matches!(design.detector, Detector::Sampled(_))
        || !design.is_coded()
    {
        return Err(format!(
            "{name_or_file} is not a raster with a code and an [adc]; coded-32 is one"
        ));
    }
    let table = design.text.parse().map_err(|error: toml::de::Error| error.to_string())?;
    let scan = &design.scan;
    let mean = scan.period() * f64::from(design.channels()) / scan.shots() as f64;
    let folder = file.parent().map(Path::to_path_buf).unwrap_or_default();
    Ok((table, folder, scan.shortest_period() / mean))
}

/// Puts `value` at the dotted `path`, tables made on the way.
pub(super) fn put(table: &mut Table, path: &str, value: Value) {
    match path.split_once('.') {
        None => {
            table.insert(path.to_owned(), value);
        }
        Some((outer, inner)) => {
            let below = table.entry(outer).or_insert_with(|| Table::new().into());
            if let Some(below) = below.as_table_mut() {
                put(below, inner, value);
            }
        }
    }
}

/// Leaves an `effect` out.
pub(super) fn idealise(table: &mut Table, effect: Effect) {
    let list = table.entry("idealised").or_insert_with(|| Value::Array(Vec::new()));
    let name = Value::from(effect.name());
    if let Some(list) = list.as_array_mut().filter(|list| !list.contains(&name)) {
        list.push(name);
    }
}

/// The number at the dotted `path`, if there is one.
pub(super) fn number(table: &Table, path: &str) -> Option<f64> {
    let mut keys = path.split('.');
    let first = table.get(keys.next()?)?;
    let value = keys.try_fold(first, |value, key| value.get(key))?;
    value.as_float().or(value.as_integer().map(|value| value as f64))
}

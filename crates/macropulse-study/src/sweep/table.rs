//! The results of a finished sweep: a row for each point.

use std::path::Path;

use serde_json::{Map, Value, json};

use super::{Axis, Counted, Error, Metric, Plan, Point, picture};
use crate::text::short;
use macropulse::formats::{Surroundings, quoted, versioned, write_atomically};
use macropulse::score::Estimate;

/// Files written beside the manifest.
pub const FILES: [&str; 4] = ["index.html", "sweep.csv", "sweep.svg", "sweep.png"];

/// Scores of every point, with intervals.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// The varied keys with their values.
    pub axes: Vec<Axis>,
    /// The scores, in the order of the columns.
    pub metrics: Vec<Metric>,
    /// A row for each point, in the order of the points.
    pub rows: Vec<Row>,
}

/// One point.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// A value of each axis.
    pub values: Vec<String>,
    /// Seeds.
    pub seeds: u64,
    /// Pixels measured, with all seeds together.
    pub pixels: u64,
    /// An estimate of each score.
    pub scores: Vec<Estimate>,
    /// The stage at which the last light was lost, if no seed gave a single return.
    pub empty: Option<String>,
}

impl Row {
    /// The values, then the scores with their intervals in brackets, as text.
    pub fn cells(&self) -> Vec<String> {
        let scores = self.scores.iter().map(|&Estimate { value, low, high }| {
            match (value.is_nan(), low.is_nan()) {
                (true, _) => "-".to_owned(),
                (_, true) => short(value),
                _ => format!("{} [{}, {}]", short(value), short(low), short(high)),
            }
        });
        self.values.iter().cloned().chain(scores).collect()
    }
}

impl Plan {
    /// Makes the table of `metrics` from the jobs in `folder` and writes `sweep.csv`, `sweep.svg`,
    /// `sweep.png`, `manifest.json` and the page `index.html` beside them.
    ///
    /// # Errors
    /// If a job is missing or its file is damaged, or a file cannot be written.
    pub fn finish(&self, folder: &Path, metrics: &[Metric]) -> Result<Table, Error> {
        let table = self.table(folder, metrics)?;
        let seeds = self.seeds.end - self.seeds.start;
        let seeds = if seeds == 1 { "1 seed".to_owned() } else { format!("{seeds} seeds") };
        let title = format!(
            "{} in {}, {seeds} each; whiskers: 95 % intervals",
            self.sensors().join(", "),
            self.scene
        );
        let picture = picture::stack(&table, &title);
        let beside: Vec<String> =
            FILES[1..].iter().chain(&["manifest.json"]).map(|&file| file.to_owned()).collect();
        let page = picture::page(&table, &picture, &beside).html();
        let contents = [page.into(), table.csv().into(), picture.svg().into(), picture.png()?];
        for (file, bytes) in FILES.iter().zip(contents) {
            write_atomically(&folder.join(file), |out| out.write_all(&bytes))?;
        }
        let manifest = self.manifest(&table);
        write_atomically(&folder.join("manifest.json"), |out| out.write_all(manifest.as_bytes()))?;
        Ok(table)
    }

    fn table(&self, folder: &Path, metrics: &[Metric]) -> Result<Table, Error> {
        let mut rows = Vec::new();
        for point in &self.points {
            let counted: Vec<Counted> =
                self.jobs_of(point).map(|job| job.read(folder)).collect::<Result<_, _>>()?;
            let seeds = counted.len() as u64;
            rows.push(Row {
                values: point.values.clone(),
                seeds,
                pixels: seeds * point.shots,
                scores: metrics.iter().map(|metric| metric.estimate(&counted)).collect(),
                empty: counted.iter().map(|seed| seed.empty.clone()).min().flatten(),
            });
        }
        Ok(Table { axes: self.axes.clone(), metrics: metrics.to_vec(), rows })
    }

    /// Names of the sensors, each once.
    pub fn sensors(&self) -> Vec<&str> {
        each_once(self.points.iter().map(|point| point.sensor.name.as_str()))
    }

    fn manifest(&self, table: &Table) -> String {
        let mut manifest = self.description();
        let all = |of: fn(&super::Point) -> &[String]| {
            each_once(self.points.iter().flat_map(of).map(String::as_str))
        };
        let defaults = self.points.iter().flat_map(|point| &point.defaults.0);
        let defaults: Map<String, Value> = defaults.cloned().collect();
        let scores: Map<String, Value> =
            table.metrics.iter().map(|metric| (metric.column(), metric.meaning().into())).collect();
        let mut warnings: Vec<String> =
            all(|point| &point.warnings).into_iter().map(str::to_owned).collect();
        warnings.extend(table.empty());
        let mut environments: Vec<&Surroundings> = Vec::new();
        for Point { environment, .. } in &self.points {
            if !environments.contains(&environment) {
                environments.push(environment);
            }
        }
        manifest["environments"] = json!(environments);
        manifest["defaults"] = defaults.into();
        manifest["idealised"] = all(|point| &point.idealised).into();
        let not_modelled = self.points.iter().flat_map(|point| &point.not_modelled.0);
        // A size is that of one point.
        let not_modelled: Map<String, Value> = not_modelled
            .map(|(name, told)| (name.clone(), json!({ "assumed": told["assumed"] })))
            .collect();
        manifest["not_modelled"] = not_modelled.into();
        manifest["assumed"] = all(|point| &point.assumed).into();
        manifest["warnings"] = warnings.into();
        manifest["scores"] = scores.into();
        manifest["confidence"] = 0.95.into();
        manifest["files"] = FILES.as_slice().into();
        format!("{:#}\n", versioned(manifest))
    }
}

fn each_once<'a>(names: impl Iterator<Item = &'a str>) -> Vec<&'a str> {
    let mut list = Vec::new();
    for name in names {
        if !list.contains(&name) {
            list.push(name);
        }
    }
    list
}

impl Table {
    /// As comma-separated text, with units in the header. Numbers have the digits needed to read the same
    /// number back. Unknown values are empty cells.
    pub fn csv(&self) -> String {
        let mut header: Vec<String> =
            self.axes.iter().map(|axis| quoted(&axis.key).into_owned()).collect();
        header.extend(["seeds", "pixels"].map(str::to_owned));
        for metric in &self.metrics {
            let column = metric.column();
            header.extend([column.clone(), format!("{column}_low"), format!("{column}_high")]);
        }
        let mut text = header.join(",") + "\n";
        for row in &self.rows {
            let mut cells: Vec<String> =
                row.values.iter().map(|value| quoted(value).into_owned()).collect();
            cells.extend([row.seeds.to_string(), row.pixels.to_string()]);
            for Estimate { value, low, high } in &row.scores {
                let known = |number: &f64| match number.is_nan() {
                    true => String::new(),
                    false => number.to_string(),
                };
                cells.extend([value, low, high].map(known));
            }
            text += &cells.join(",");
            text.push('\n');
        }
        text
    }

    /// The warning if there are points without a single return.
    pub fn empty(&self) -> Option<String> {
        let reasons: Vec<&String> = self.rows.iter().filter_map(|row| row.empty.as_ref()).collect();
        let reason = reasons.first()?;
        let all = self.rows.len();
        let empty = reasons.len();
        Some(format!("{empty} of {all} rows of the table are without a single return: {reason}"))
    }

    /// The rows for programs: an object for each, what is not known being null.
    pub fn json(&self) -> Value {
        let rows = self.rows.iter().map(|row| {
            let mut object = Map::new();
            for (axis, (value, at)) in self.axes.iter().zip(row.values.iter().zip(row.places())) {
                let number = at.filter(|_| axis.spread != super::Spread::Names);
                let value = number.map_or_else(|| value.as_str().into(), Value::from);
                object.insert(axis.key.clone(), value);
            }
            object.insert("seeds".to_owned(), row.seeds.into());
            object.insert("pixels".to_owned(), row.pixels.into());
            for (metric, score) in self.metrics.iter().zip(&row.scores) {
                let Estimate { value, low, high } = score;
                let estimate = json!({ "value": value, "low": low, "high": high });
                object.insert(metric.column(), estimate);
            }
            object.insert("empty".to_owned(), row.empty.as_deref().into());
            Value::from(object)
        });
        rows.collect()
    }
}

impl Row {
    /// Its values as numbers, where they are.
    fn places(&self) -> impl Iterator<Item = Option<f64>> {
        self.values.iter().map(|value| value.parse().ok())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::str::FromStr;

    #[test]
    fn what_is_not_known_is_not_made_up() {
        let nan = f64::NAN;
        let ends = [[0.5, 0.25, 0.75], [0.5, nan, nan], [nan; 3]];
        let scores = ends.map(|[value, low, high]| Estimate { value, low, high }).to_vec();
        let row = Row { values: vec!["7".into()], seeds: 1, pixels: 1, scores, empty: None };
        assert_eq!(row.cells(), ["7", "0.5 [0.25, 0.75]", "0.5", "-"]);
    }

    fn table() -> Table {
        let axes = ["detector.x=1e-3,2", "receiver.kind=matched,\"a,b\""];
        let score = |value: f64| Estimate { value, low: f64::NAN, high: 0.5 };
        let row = |values: [&str; 2], scores: Vec<Estimate>| Row {
            values: values.map(str::to_owned).to_vec(),
            seeds: 2,
            pixels: 200,
            scores,
            empty: None,
        };
        Table {
            axes: axes.map(|typed| Axis::from_str(typed).unwrap()).to_vec(),
            metrics: vec![Metric::Pd, Metric::Bias],
            rows: vec![
                row(["1e-3", "matched"], vec![score(0.25), score(-1e-5)]),
                row(["2", "a,b"], vec![score(1.0), score(f64::NAN)]),
            ],
        }
    }

    #[test]
    fn a_table_is_written_with_units_and_empty_cells() {
        assert_eq!(
            table().csv(),
            "detector.x,receiver.kind,seeds,pixels,pd,pd_low,pd_high,bias_m,bias_m_low,bias_m_high\n\
             1e-3,matched,2,200,0.25,,0.5,-0.00001,,0.5\n\
             2,\"a,b\",2,200,1,,0.5,,,0.5\n"
        );
    }

    #[test]
    fn for_programs_numbers_are_numbers_and_names_are_names() {
        let rows = table().json();
        assert_eq!(rows[0]["detector.x"], 1e-3);
        assert_eq!(rows[0]["receiver.kind"], "matched");
        assert_eq!(rows[0]["pd"]["value"], 0.25);
        assert_eq!(rows[1]["bias_m"]["value"], Value::Null);
        assert_eq!(rows[1]["seeds"], 2);
    }
}

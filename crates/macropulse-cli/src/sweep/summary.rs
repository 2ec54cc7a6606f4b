//! Printed report of a sweep.

use std::path::Path;

use macropulse::formats::versioned;
use macropulse_study::sweep::{Plan, Point, Shard, Table};

use crate::text::{NO_BREAK, counted, grouped};

/// The table for people.
pub fn text(plan: &Plan, table: &Table, folder: &Path) -> String {
    let mut lines = vec![table.axes.iter().map(|axis| axis.key.clone()).collect::<Vec<_>>()];
    lines[0].extend(table.metrics.iter().map(|metric| metric.column()));
    for row in &table.rows {
        lines.push(row.cells());
    }
    let folder = folder.display();
    let text = format!(
        "{}\n\n{}\n  index.html, sweep.csv, sweep.svg, sweep.png and manifest.json written to {folder}; \
         in brackets the 95 % intervals\n",
        headline(plan),
        aligned(&lines)
    );
    text.replace(NO_BREAK, " ")
}

/// Returns the scans that are left to do, for people.
pub fn text_of_missing(plan: &Plan, missing: &[usize], shard: Shard) -> String {
    let (left, all) = (grouped(missing.len() as u64), counted(plan.count() as u64, "scan"));
    let options: Vec<String> =
        shard.with_any(missing).iter().map(|shard| format!("--shard {shard}")).collect();
    let options = match options.as_slice() {
        few if few.len() <= 8 => few.join(", "),
        many => format!("{} … {}", many[0], many[many.len() - 1]),
    };
    let text = format!(
        "{}\n\n  {left} of {all} are missing; the same command does them with {options}, or all of \
         them without --shard\n",
        headline(plan)
    );
    text.replace(NO_BREAK, " ")
}

/// The table for programs.
pub fn json(plan: &Plan, table: &Table) -> String {
    format!("{:#}\n", versioned(plan.json(table)))
}

/// Returns the scans that are left to do, for programs.
pub fn json_of_missing(plan: &Plan, missing: &[usize], shard: Shard) -> String {
    format!("{:#}\n", versioned(plan.json_of_missing(missing, shard)))
}

fn headline(plan: &Plan) -> String {
    let sizes = plan
        .axes
        .iter()
        .map(|axis| format!("{} of {}", counted(axis.values.len() as u64, "value"), axis.key));
    let pixels = |of: fn(&Point) -> u64| {
        let counts = || plan.points.iter().map(of);
        let (least, most) = (counts().min().unwrap_or(0), counts().max().unwrap_or(0));
        match least == most {
            true => grouped(most),
            false => format!("{} to {}", grouped(least), grouped(most)),
        }
    };
    format!(
        "{} in {}: {}, {} each, {} of {} pixels of a scan",
        plan.sensors().join(", "),
        plan.scene,
        sizes.collect::<Vec<_>>().join(" x "),
        counted(plan.seeds.end - plan.seeds.start, "seed"),
        pixels(|point| point.shots),
        pixels(|point| point.shots_per_scan),
    )
}

/// Lines of cells as columns, indented by two.
fn aligned(lines: &[Vec<String>]) -> String {
    let columns = lines.first().map_or(0, Vec::len);
    let wide = |column: usize| lines.iter().map(|line| line[column].chars().count()).max();
    let widths: Vec<usize> = (0..columns).map(|column| wide(column).unwrap_or(0)).collect();
    let mut text = String::new();
    for line in lines {
        let cells = line.iter().zip(&widths).map(|(cell, width)| format!("  {cell:<width$}"));
        text += cells.collect::<String>().trim_end();
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_stand_below_each_other() {
        let lines = [["key", "pd"], ["0.25", "1"]].map(|line| line.map(str::to_owned).to_vec());
        assert_eq!(aligned(&lines), "  key   pd\n  0.25  1\n");
    }
}

//! One cloud of the page.

use macropulse::formats::Names;
use macropulse::points::{NO_OBJECT, PointCloud};
use rayon::prelude::*;
use serde::Serialize;

use super::packed::{Column, Kept, deflated};

/// Points of a cloud that a page shows; of a larger one it shows every second, third and so on.
pub(super) const MOST_POINTS: usize = 1 << 21;

/// Pixels that a range image may have in a page.
const MOST_PIXELS: usize = 1 << 24;

/// A cloud, packed.
#[derive(Debug, Clone, Serialize)]
pub(super) struct Scan {
    label: String,
    points: usize,
    /// Points of the cloud; more than `points` if it was thinned.
    of: usize,
    rows: usize,
    columns: usize,
    pick: &'static str,
    attributes: Vec<Column>,
    /// Outcome of each pixel, a byte each, deflated; empty where it is not known.
    pixels: String,
    objects: Vec<String>,
    materials: Vec<String>,
}

impl Scan {
    /// Packs `cloud`.
    pub fn of(label: &str, cloud: &PointCloud, names: &Names) -> Self {
        let every = cloud.returns().div_ceil(MOST_POINTS).max(1);
        let has_image = matches!(cloud.rows.checked_mul(cloud.columns), Some(1..=MOST_PIXELS));
        let attributes = attributes(cloud, has_image);
        let packed = attributes.into_par_iter().filter_map(|(kept, value)| {
            let values: Vec<f64> = (0..cloud.returns()).step_by(every).map(value).collect();
            Column::of(kept, &values)
        });
        let outcomes = &cloud.truth.pixels.outcome;
        let pixels = match has_image && outcomes.len() == cloud.rows * cloud.columns {
            true => deflated(&outcomes.iter().map(|&outcome| outcome as u8).collect::<Vec<u8>>()),
            false => String::new(),
        };
        Self {
            label: label.to_owned(),
            points: cloud.returns().div_ceil(every),
            of: cloud.returns(),
            rows: if has_image { cloud.rows } else { 0 },
            columns: if has_image { cloud.columns } else { 0 },
            pick: cloud.pick.name(),
            attributes: packed.collect(),
            pixels,
            objects: names.objects.to_vec(),
            materials: names.materials.to_vec(),
        }
    }

    /// What it is called in the page.
    pub fn label(&self) -> &str {
        &self.label
    }

    /// Characters it takes in the page, nearly.
    pub fn size(&self) -> usize {
        self.pixels.len() + self.attributes.iter().map(Column::size).sum::<usize>()
    }
}

/// The value of the return at a place of the list.
type Value<'a> = Box<dyn Fn(usize) -> f64 + Send + Sync + 'a>;

fn value<T: Copy + Into<f64> + Sync>(column: &[T]) -> Value<'_> {
    Box::new(move |at| column.get(at).map_or(f64::NAN, |&value| value.into()))
}

/// What is kept of each return, under the names that it has in the files. A list of another program
/// has neither pixels nor marks, and says nothing of them.
fn attributes(cloud: &PointCloud, has_image: bool) -> Vec<(Kept, Value<'_>)> {
    let [length, share, whole] = [1e-4, 1e-4, 1.0];
    let kept = |name, unit, step| Kept { name, unit, step };
    let mut list = vec![
        (kept("x", "m", length), Box::new(|at| cloud.position(at)[0]) as Value),
        (kept("y", "m", length), Box::new(|at| cloud.position(at)[1])),
        (kept("z", "m", length), Box::new(|at| cloud.position(at)[2])),
        (kept("range", "m", length), Box::new(|at| cloud.distance(at))),
        (kept("intensity", "", share), value(&cloud.intensity)),
        (kept("time_ns", "ns", 0.1), value(&cloud.time_ns)),
    ];
    if has_image {
        list.extend([
            (kept("row", "", whole), value(&cloud.row)),
            (kept("column", "", whole), value(&cloud.column)),
        ]);
    }
    list.extend([
        (kept("return_number", "", whole), value(&cloud.return_number)),
        (kept("number_of_returns", "", whole), value(&cloud.number_of_returns)),
    ]);
    if cloud.marks.iter().any(|&marks| marks > 0) {
        list.extend([
            (kept("peak", "", whole), value(&cloud.peak)),
            (kept("marks", "", whole), value(&cloud.marks)),
            (kept("margin", "", whole), value(&cloud.margin)),
            (kept("flags", "", whole), Box::new(|at| f64::from(cloud.flags(at)))),
        ]);
    }
    if cloud.returns_per_shot > 1 && has_image {
        let image = cloud.image(cloud.pick);
        let mut shown = vec![0_u8; cloud.returns()];
        image.iter().flatten().for_each(|at| shown[at] = 1);
        list.push((kept("shown", "", whole), Box::new(move |at| f64::from(shown[at]))));
    }
    let truth = &cloud.truth.returns;
    let index = |column: &'_ [u16], at: usize| match column.get(at) {
        Some(&index) if index != NO_OBJECT => f64::from(index),
        _ => f64::NAN,
    };
    if truth.outcome.len() == cloud.returns() {
        list.extend([
            (kept("true_range", "m", length), value(&truth.range)),
            (kept("object", "", whole), Box::new(move |at| index(&truth.object, at)) as Value),
            (kept("material", "", whole), Box::new(move |at| index(&truth.material, at))),
            (
                kept("incidence", "rad", share),
                Box::new(|at| libm::acos(f64::from(truth.cosine[at]).clamp(0.0, 1.0))),
            ),
            (kept("outcome", "", whole), Box::new(|at| f64::from(truth.outcome[at] as u8))),
        ]);
    }
    list
}

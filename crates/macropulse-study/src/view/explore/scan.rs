//! One cloud of the page.

use macropulse::formats::Names;
use macropulse::points::{Attribute, Entries, NO_OBJECT, PointCloud};
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
        let packed = attributes.into_par_iter().filter_map(|(kept, entries)| {
            let places = (0..cloud.returns()).step_by(every);
            Column::of(kept, &places.map(|at| entries.number(at)).collect::<Vec<f64>>())
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

    /// Its name in the page.
    pub fn label(&self) -> &str {
        &self.label
    }

    /// Characters it takes in the page, nearly.
    pub fn size(&self) -> usize {
        self.pixels.len() + self.attributes.iter().map(Column::size).sum::<usize>()
    }
}

/// The kept attributes of each return: those that files have, and a flag for the returns that the image
/// shows. The ring is left out because it is the row. A list has no rows and columns, as it has no pixels.
fn attributes(cloud: &PointCloud, has_image: bool) -> Vec<(Kept, Entries<'_>)> {
    let is_kept = |attribute: &Attribute| match attribute {
        Attribute::Ring => false,
        Attribute::Row | Attribute::Column => has_image,
        _ => true,
    };
    let kept = |attribute: Attribute| {
        let entries = match attribute {
            Attribute::Range => {
                Entries::F8((0..cloud.returns()).map(|at| cloud.distance(at)).collect())
            }
            _ => attribute.entries(cloud)?,
        };
        let step = match (&entries, attribute.unit()) {
            (Entries::U1(_) | Entries::U2(_), _) => 1.0,
            (_, "ns") => 0.1,
            _ => 1e-4,
        };
        let entries = match entries {
            Entries::U2(numbers) if attribute.is_true() => {
                let number =
                    |number: u16| if number == NO_OBJECT { f32::NAN } else { number.into() };
                Entries::F4(numbers.iter().copied().map(number).collect())
            }
            entries => entries,
        };
        Some((Kept { name: attribute.name(), unit: attribute.unit(), step }, entries))
    };
    let mut list: Vec<_> = Attribute::in_files().filter(is_kept).filter_map(kept).collect();
    if cloud.returns_per_shot > 1 && has_image {
        let image = cloud.image(cloud.pick);
        let mut shown = vec![0_u8; cloud.returns()];
        image.iter().flatten().for_each(|at| shown[at] = 1);
        list.push((Kept { name: "shown", unit: "", step: 1.0 }, Entries::U1(shown.into())));
    }
    list
}

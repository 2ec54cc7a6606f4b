//! The organised image: a view of the list.

use super::{Pick, PointCloud, Surface};

/// Stands for a pixel without a return.
const NONE: u32 = u32::MAX;

/// One return of each pixel of a cloud, or none: rows × columns, row-major.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Image {
    /// Rows, from the top.
    pub rows: usize,
    /// Columns, from the left.
    pub columns: usize,
    /// The return of each pixel, [`NONE`] without any.
    returns: Vec<u32>,
}

impl Image {
    /// The image of `cloud` that shows the return picked of each pixel.
    pub(super) fn of(cloud: &PointCloud, pick: Pick) -> Self {
        let (rows, columns) = (cloud.rows, cloud.columns);
        let mut returns = vec![NONE; rows.saturating_mul(columns)];
        for (at, (&row, &column)) in cloud.row.iter().zip(&cloud.column).enumerate() {
            let pixel = usize::from(row) * columns + usize::from(column);
            let Some(shown) = returns.get_mut(pixel) else { continue };
            let is_better =
                |shown: u32| pick.prefers(cloud.strength(at), cloud.strength(shown as usize));
            if *shown == NONE || is_better(*shown) {
                *shown = at as u32;
            }
        }
        Self { rows, columns, returns }
    }

    /// Number of pixels.
    pub fn len(&self) -> usize {
        self.returns.len()
    }

    /// Returns true if there is no pixel at all.
    pub fn is_empty(&self) -> bool {
        self.returns.is_empty()
    }

    /// The return that `pixel` shows: its place in the list.
    pub fn get(&self, pixel: usize) -> Option<usize> {
        self.returns.get(pixel).filter(|&&at| at != NONE).map(|&at| at as usize)
    }

    /// The returns shown, pixel by pixel.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = Option<usize>> + '_ {
        self.returns.iter().map(|&at| (at != NONE).then_some(at as usize))
    }

    /// A `column` of the list as an image, `none` where there is no return or no such column.
    pub fn spread<T: Copy>(&self, column: &[T], none: T) -> Vec<T> {
        let value = |at: Option<usize>| at.and_then(|at| column.get(at)).copied().unwrap_or(none);
        self.iter().map(value).collect()
    }

    /// Returns the surface of `pixel` of `cloud`: that of the return it shows or, without one, the first
    /// surface along its beam. The outcome is that of the pixel if this is the image of the cloud's own pick.
    pub fn surface(&self, cloud: &PointCloud, pixel: usize) -> Surface {
        let truth = &cloud.truth;
        self.get(pixel).map_or_else(|| truth.pixels.at(pixel), |at| truth.returns.at(at))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three pixels in a row, with two, no and three returns.
    fn cloud() -> PointCloud {
        let nan = f32::NAN;
        PointCloud {
            rows: 1,
            columns: 3,
            row: vec![0; 5],
            column: vec![0, 0, 2, 2, 2],
            return_number: vec![1, 2, 1, 2, 3],
            number_of_returns: vec![2, 2, 3, 3, 3],
            range: vec![1.0, 2.0, 3.0, 4.0, 5.0],
            peak: vec![7, 9, 4, 4, 4],
            intensity: vec![0.1, 0.2, 0.3, 0.5, 0.4],
            photons: vec![nan, nan, nan, nan, nan],
            ..PointCloud::default()
        }
    }

    #[test]
    fn an_image_shows_the_return_that_is_picked() {
        let cloud = cloud();
        let ranges = |pick: Pick| cloud.image(pick).spread(&cloud.range, 0.0);
        assert_eq!(ranges(Pick::First), [1.0, 0.0, 3.0]);
        assert_eq!(ranges(Pick::Strongest), [2.0, 0.0, 4.0]);
        assert_eq!(ranges(Pick::Last), [2.0, 0.0, 5.0]);
        assert_eq!(cloud.image(Pick::First).get(1), None);
        assert_eq!(cloud.image(Pick::First).get(9), None);
    }

    #[test]
    fn a_return_outside_the_image_is_not_shown() {
        let cloud = PointCloud { columns: 2, ..cloud() };
        assert_eq!(cloud.image(Pick::Last).iter().collect::<Vec<_>>(), [Some(1), None]);
        assert!(PointCloud { rows: 0, ..cloud }.image(Pick::Last).is_empty());
    }
}

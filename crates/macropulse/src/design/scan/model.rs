//! The trait of every scan pattern.
//!
//! A pixel is a row and a column of the image. The order of a shot is its place among the shots of
//! a scan, from 0.

use super::Directions;
use crate::design::safety::Beams;

/// How the directions of a scan follow each other.
pub(crate) trait Model {
    /// Name of the pattern, in a few words for people.
    fn summary(&self) -> String;

    /// Rows and columns of the image: a pixel for each shot of a scan.
    fn size(&self) -> [u32; 2];

    /// Number of separate detectors.
    fn channels(&self) -> u32;

    /// The detector that sees the shot `order` of a scan, sent to `row`.
    fn channel_of(&self, order: u64, row: u16) -> u16;

    /// Row and column of the shot `order` of a scan.
    fn pixel(&self, order: u64) -> (u16, u16);

    /// The place of a pixel in the order of its scan: the inverse of [`Model::pixel`].
    fn order_of(&self, row: u16, column: u16) -> u64;

    /// When the shot `order` of a scan that lasts `period` seconds is fired. The chip clock, for
    /// which a shot waits, is left out.
    fn moment(&self, order: u64, period: f64) -> Moment;

    /// Tells if a scan is fired shot by shot, all of them equally far apart.
    fn equal_steps(&self) -> bool;

    /// Shots of a line: of what is computed together where time allows.
    fn line(&self) -> u64;

    /// Tells if one beam draws every line from column 0 on, row by row.
    fn draws_from_the_left(&self) -> bool;

    /// Shortest time the beam spends on a pixel, s, `pixel_period` being the mean time between
    /// shots.
    fn shortest_dwell(&self, pixel_period: f64) -> f64;

    /// Angle, rad, by which the beam moves on from a pixel to the next, where its motion during a
    /// macropulse is modelled; `None` where it is not.
    fn moves_by(&self) -> Option<f64>;

    /// Directions of the pixels.
    fn directions(&self) -> Directions;

    /// The pixel in whose cell a direction lies, rad; `None` outside the field of view. A cell
    /// reaches half of the way to its neighbours.
    fn pixel_at(&self, azimuth: f64, elevation: f64) -> Option<(u16, u16)>;

    /// Width and height, rad, of the cell of a pixel.
    fn cell(&self) -> [f64; 2];

    /// Width and height, rad, of the cell whose light a pixel gathers, if a flood lights it evenly; `None` if a
    /// beam lights it.
    fn flooded_cell(&self) -> Option<[f64; 2]> {
        None
    }

    /// All that it looks at.
    fn extent(&self) -> Extent;

    /// Width and height, rad, of the field that a detector behind a moving beam would see if it stared;
    /// `None` if each detector has pixels of its own.
    fn shared_field(&self) -> Option<[f64; 2]>;

    /// Tells if the view of a detector moves on from shot to shot.
    fn follows(&self) -> bool;

    /// The emitted beams, as eye safety counts them.
    fn beams(&self) -> Beams;

    /// How much is added to what each row measures, m, because its clock starts too late
    /// (docs/physics.md#beams-of-a-turning-head); empty where nothing is.
    fn range_offsets(&self) -> &[f64] {
        &[]
    }

    /// Tells if pixels are cells of an image that is the same in every scan.
    fn is_lattice(&self) -> bool {
        true
    }

    /// The digest of the file that the directions were read from, if they were.
    fn file_digest(&self) -> Option<&str> {
        None
    }

    /// Remarks for the user that are no errors.
    fn notes(&self) -> &[String] {
        &[]
    }
}

/// When a shot is fired, from the beginning of its scan: exact, and a rest that is not.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Moment {
    /// Mean times between shots that have passed.
    pub shots: u64,
    /// Time that has passed in addition, s.
    pub then: f64,
}

/// A rectangle of directions, rad: azimuth to the left, elevation up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extent {
    /// Least and largest azimuth.
    pub azimuth: [f64; 2],
    /// Least and largest elevation.
    pub elevation: [f64; 2],
}

impl Extent {
    /// The field of `sides` rad, width and height, about the forward direction.
    pub(super) fn centred(sides: [f64; 2]) -> Self {
        let [azimuth, elevation] = sides.map(|side| [-side / 2.0, side / 2.0]);
        Self { azimuth, elevation }
    }
}

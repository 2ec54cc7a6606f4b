//! Pictures of clouds and range images, charts, and the pieces of the report.
//!
//! Pictures are PNG bytes, charts are SVG text, the report is one HTML file that needs nothing
//! beside it. A chart as PNG, and what is written on a picture, is SVG made into pixels. Nothing
//! here knows how a number came about.

mod bits;
mod canvas;
mod chart;
mod colour;
mod curves;
mod explore;
mod hover;
mod matrix;
mod page;
mod plot;
mod range_image;
mod raster;
mod scatter;
mod stack;
mod svg;
mod table;
mod theme;
mod ticks;
mod timeline;

pub use bits::BitPicture;
pub use chart::{Axis, Band, Chart, Line, Note, Scale, Series, Style};
pub use colour::{Rgb, outcome_colour, range_colour};
pub use explore::Explorer;
pub use matrix::MatrixPicture;
pub use page::{Block, Figure, Page, Section, Tone};
pub use range_image::{AmplitudePicture, Crop, Layout, OutcomePicture, RangePicture, ScaleBar};
pub use scatter::{CloudPicture, Viewpoint};
pub use stack::Stack;
pub use svg::{Hue, standalone};
pub use table::{Align, Cell, Table, Verdict};
pub use timeline::{Flight, Lane, Span, Timeline};

/// Why a picture was not drawn.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A column has not one value per pixel.
    #[error("a picture of {rows} × {columns} pixels needs {} values, not {found}", rows * columns)]
    Uneven {
        /// Rows of the picture.
        rows: usize,
        /// Columns of the picture.
        columns: usize,
        /// Values given.
        found: usize,
    },
    /// The coordinates of the points have different lengths.
    #[error("x, y, z and range of the points have different lengths")]
    Ragged,
    /// There is nothing to draw, or more than fits into memory.
    #[error("a picture {width} × {height} cannot be drawn; each side takes 1 to 16384 pixels")]
    Size {
        /// Width in pixels.
        width: usize,
        /// Height in pixels.
        height: usize,
    },
    /// A drawing has too many elements, say.
    #[error("cannot draw the chart as pixels: {0}")]
    Drawing(#[from] resvg::usvg::Error),
    /// The PNG encoder refused.
    #[error("cannot encode the picture: {0}")]
    Encode(#[from] png::EncodingError),
}

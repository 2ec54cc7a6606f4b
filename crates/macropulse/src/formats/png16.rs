//! Range image as 16-bit grey PNG: metres = value / 256, 0 = no return.

use super::Names;
use super::attributes::Attribute;
use super::format::CloudWriter;
use super::holding::{Further, Holding};
use super::{Error, Format};
use crate::points::PointCloud;
use std::io::{self, BufReader, Write};
use std::path::Path;

/// Grey values per metre: steps of 3.9 mm, up to 255.99 m.
const VALUES_PER_METRE: f32 = 256.0;

/// Text chunk by which the file declares its scale.
const KEYWORD: &str = "Range scale";
const DECLARATION: &str = "metres = value / 256; 0 = no return; 65535 = 255.99 m or farther";

/// Most pixels of an image that is read: those of a sensor.
const MOST_PIXELS: u64 = 1 << 25;

/// Most bytes of its file: it may be compressed badly, and have text beside.
const MOST_BYTES: u64 = 4 * MOST_PIXELS;

/// A range image read back.
#[derive(Debug, Clone, PartialEq)]
pub struct RangeImage {
    /// Rows, the first one at the top.
    pub rows: usize,
    /// Columns, the first one at the left.
    pub columns: usize,
    /// Range in m, row-major; NaN where there is no return.
    pub range: Vec<f32>,
}

/// Range image of each pixel's picked return, 16-bit grey.
pub(super) struct Png;

impl CloudWriter for Png {
    fn name(&self) -> &'static str {
        "png"
    }

    fn file_name(&self, scan: u64) -> String {
        format!("range-{scan:06}.png")
    }

    fn is_range_image(&self) -> bool {
        true
    }

    fn holds(&self, attribute: Attribute) -> Holding {
        Holding::in_image(Holding::Partly("steps of 1/256 m, up to 255.99 m"), attribute)
    }

    fn holds_further(&self, further: Further) -> bool {
        further.is_in_image()
    }

    fn write(&self, cloud: &PointCloud, _names: &Names, out: &mut dyn Write) -> io::Result<()> {
        let [width, height] = [cloud.columns, cloud.rows]
            .map(|length| u32::try_from(length).ok().filter(|&length| length > 0));
        let (Some(width), Some(height)) = (width, height) else {
            return Err(io::Error::other("an image needs at least one row and one column"));
        };
        let mut encoder = png::Encoder::new(out, width, height);
        encoder.set_color(png::ColorType::Grayscale);
        encoder.set_depth(png::BitDepth::Sixteen);
        encoder.add_text_chunk(KEYWORD.into(), DECLARATION.into())?;
        let image = cloud.image(cloud.pick).spread(&cloud.distances(), f32::NAN);
        let grey: Vec<u8> =
            image.into_iter().flat_map(|range| grey_from_range(range).to_be_bytes()).collect();
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&grey)?;
        Ok(writer.finish()?)
    }
}

/// A return is never written as 0, however near it is.
fn grey_from_range(range: f32) -> u16 {
    if range.is_finite() {
        (range * VALUES_PER_METRE).round().clamp(1.0, 65_535.0) as u16
    } else {
        0
    }
}

/// Reads a range image written by [`super::write_cloud`].
///
/// # Errors
/// [`Error::Read`] if the file cannot be opened, [`Error::Invalid`] if it is not a 16-bit grey PNG
/// that declares this scale.
pub fn read_range_png(path: &Path) -> Result<RangeImage, Error> {
    let file = crate::opened::file(path, MOST_BYTES).map_err(|cause| Error::read(path, cause))?;
    decode(BufReader::new(file)).map_err(|fault| Error::invalid(path, Format::Png.name(), fault))
}

fn decode(file: impl io::BufRead + io::Seek) -> Result<RangeImage, String> {
    let mut reader = png::Decoder::new(file).read_info().map_err(|error| error.to_string())?;
    if reader.output_color_type() != (png::ColorType::Grayscale, png::BitDepth::Sixteen) {
        return Err("it is not 16-bit grey".into());
    }
    let texts = &reader.info().uncompressed_latin1_text;
    if !texts.iter().any(|chunk| chunk.keyword == KEYWORD && chunk.text == DECLARATION) {
        return Err(format!("it does not declare the scale `{DECLARATION}`"));
    }
    let (width, height) = reader.info().size();
    if u64::from(width) * u64::from(height) > MOST_PIXELS {
        return Err(format!("{width} x {height} pixels are more than {MOST_PIXELS}"));
    }
    let size = reader.output_buffer_size().ok_or("it is too large")?;
    let mut grey = vec![0; size];
    let image = reader.next_frame(&mut grey).map_err(|error| error.to_string())?;
    let range = grey
        .chunks_exact(2)
        .map(|pair| match u16::from_be_bytes([pair[0], pair[1]]) {
            0 => f32::NAN,
            value => f32::from(value) / VALUES_PER_METRE,
        })
        .collect();
    Ok(RangeImage { rows: image.height as usize, columns: image.width as usize, range })
}

#[cfg(test)]
mod tests {
    use super::super::sample_cloud;
    use super::*;
    use std::io::Cursor;

    #[test]
    fn the_scale_is_256_to_the_metre() {
        assert_eq!(grey_from_range(30.0), 7680);
        assert_eq!(grey_from_range(f32::NAN), 0);
        assert_eq!(grey_from_range(0.0), 1);
        assert_eq!(grey_from_range(1e6), 65_535);
    }

    #[test]
    fn an_image_comes_back_within_half_a_step() {
        let cloud = sample_cloud();
        let mut bytes = Vec::new();
        Png.write(&cloud, &Names::default(), &mut bytes).unwrap();
        let image = decode(Cursor::new(bytes)).unwrap();
        assert_eq!((image.rows, image.columns), (2, 3));
        let written = cloud.image(cloud.pick).spread(&cloud.distances(), f32::NAN);
        for (read, written) in image.range.iter().zip(&written) {
            assert!(
                (read - written).abs() <= 0.5 / VALUES_PER_METRE
                    || read.is_nan() && written.is_nan()
            );
        }
    }

    #[test]
    fn an_image_of_nothing_and_an_undeclared_one_are_refused() {
        assert!(Png.write(&PointCloud::default(), &Names::default(), &mut Vec::new()).is_err());
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, 1, 1);
        encoder.set_depth(png::BitDepth::Sixteen);
        encoder.write_header().unwrap().write_image_data(&[0, 0]).unwrap();
        let fault = decode(Cursor::new(bytes)).unwrap_err();
        assert!(fault.starts_with("it does not declare the scale"), "{fault}");
    }
}

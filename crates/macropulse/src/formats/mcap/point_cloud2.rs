//! `sensor_msgs/msg/PointCloud2`, written and read.

use super::super::about::About;
use super::super::attributes::{Attribute, pixels, returns};
use super::super::headings::Meaning;
use super::super::number::Kind;
use super::super::pcd::is_list;
use super::super::table::{self, Layout};
use super::cdr::{Decoder, Encoder};
use super::profile::{Source, fields};
use super::{EPOCH_NS, Profile, stamp_ns, times_from_ns};
use crate::points::PointCloud;
use std::borrow::Cow;
use std::io;

/// The frame that points are in.
pub(super) const SENSOR_FRAME: &str = "lidar";

/// Encodes a scan as a message. It is an image, with NaN for pixels without a return, if each shot has one
/// return at most and the driver of the profile writes images. Otherwise it is a list.
pub(super) fn encode(profile: Profile, cloud: &PointCloud) -> io::Result<Vec<u8>> {
    let stamp = stamp_ns(cloud);
    let source = Source::new(cloud, stamp as f64 - times_from_ns(cloud) as f64);
    let is_list = is_list(cloud) || !profile.is_organised();
    let (rows, columns) = (cloud.rows, cloud.columns);
    let ([height, width], points) = match (is_list, profile.is_by_column()) {
        (true, _) => ([1, cloud.returns()], returns(cloud).collect()),
        (false, false) => ([rows, columns], pixels(cloud)),
        (false, true) => {
            let by_rows = pixels(cloud);
            let from_below = |column: usize| (0..rows).rev().map(move |row| row * columns + column);
            let order = (0..columns).flat_map(from_below);
            ([columns, rows], order.map(|pixel| by_rows[pixel]).collect())
        }
    };
    let (step, fields) = fields(profile, cloud);
    let size = points.len().checked_mul(step).filter(|size| u32::try_from(*size).is_ok());
    let size = size.ok_or_else(|| io::Error::other("a message holds 4 GiB of points at most"))?;
    let mut body = Vec::with_capacity(size);
    for point in points {
        let begin = body.len();
        for field in &fields {
            body.resize(begin + field.offset, 0);
            source.value(field.quantity, point).append_to(&mut body);
        }
        body.resize(begin + step, 0);
    }
    let mut message = Encoder::new();
    write_stamp(&mut message, stamp, SENSOR_FRAME);
    message.u4(height as u32);
    message.u4(width as u32);
    message.u4(fields.len() as u32);
    for field in &fields {
        message.text(field.name);
        message.u4(field.offset as u32);
        message.u1(field.quantity.kind(cloud).ros().unwrap_or(0));
        message.u4(1);
    }
    message.u1(0);
    message.u4(step as u32);
    message.u4((step * width) as u32);
    message.bytes(&body);
    message.u1(u8::from(is_list || cloud.returns() == cloud.rows * cloud.columns));
    Ok(message.done())
}

/// A `std_msgs/Header`.
pub(super) fn write_stamp(message: &mut Encoder, stamp_ns: u64, frame: &str) {
    message.u4((stamp_ns / 1_000_000_000) as u32);
    message.u4((stamp_ns % 1_000_000_000) as u32);
    message.text(frame);
}

/// Stamps below this, 104 days, are those of simulations, which count from the first scan; a clock shows
/// more. Up to here 64-bit floats have every whole ns.
const LATEST_SIMULATED_NS: u64 = 1 << 53;

/// A field as a message has it.
struct Stored<'a> {
    name: &'a str,
    offset: usize,
    kind: Kind,
}

/// The cloud of a message: of ours, or of a driver whose fields we know.
pub(super) fn decode(message: &[u8], about: &mut About) -> Result<PointCloud, String> {
    let mut message = Decoder::new(message)?;
    let stamp_ns = u64::from(message.u4()?) * 1_000_000_000 + u64::from(message.u4()?);
    message.text()?;
    let (height, width) = (message.u4()? as usize, message.u4()? as usize);
    let mut fields = Vec::new();
    for _ in 0..message.u4()? {
        let (name, offset) = (message.text()?, message.u4()? as usize);
        let (kind, count) = (message.u1()?, message.u4()?);
        match Kind::from_ros(kind).filter(|_| count <= 1) {
            Some(kind) => fields.push(Stored { name, offset, kind }),
            None => about.left_out.field(name),
        }
    }
    if message.u1()? != 0 {
        return Err("its points are big endian; little-endian ones are read".to_owned());
    }
    let stride = message.u4()? as usize;
    if stride == 0 {
        return Err("its points have no bytes".to_owned());
    }
    message.u4()?;
    let body = message.bytes()?;
    let (layout, time_from_ns) = layout(&fields, stride, stamp_ns as f64);
    let (body, height, width) = match by_column(&fields, body, stride, [height, width]) {
        Some(by_rows) => (Cow::Owned(by_rows), width, height),
        None => (Cow::Borrowed(body), height, width),
    };
    // Our own messages say by NaN that nothing returned.
    let is_ours = about.list.is_some() || fields.iter().any(|field| field.name == "time_ns");
    about.is_of_driver = !is_ours;
    let mut cloud = if height == 1 {
        table::list(about, &layout, width, &mut table::records(&body))?
    } else {
        let cloud = table::image(about, &layout, [height, width], &mut table::records(&body))?;
        PointCloud { pick: about.list.map_or(cloud.pick, |list| list.pick), ..cloud }
    };
    if height == 1 && is_of_velodyne(&fields) {
        let last = lasers(about, &cloud).saturating_sub(1) as u16;
        cloud.row.iter_mut().for_each(|row| *row = last.saturating_sub(*row));
    }
    let mut later_ns = time_from_ns;
    if stamp_ns >= LATEST_SIMULATED_NS || cloud.time_ns.is_empty() {
        cloud.stamp_ns = Some(stamp_ns);
        let is_from_stamp = fields.iter().any(|field| field.name == "time_ns");
        let stamp_ns = stamp_ns as f64 - EPOCH_NS as f64;
        later_ns = if is_from_stamp { 0.0 } else { time_from_ns - stamp_ns };
    }
    if later_ns != 0.0 {
        let times = cloud.time_ns.iter_mut().chain(&mut cloud.fired_ns);
        times.for_each(|time| *time += later_ns);
    }
    Ok(cloud)
}

/// Returns true if the fields are those of the Velodyne driver, whose ring 0 is the lowest laser.
fn is_of_velodyne(fields: &[Stored]) -> bool {
    let known = ["x", "y", "z", "intensity", "ring", "time"];
    let has_ring = fields.iter().any(|field| field.name == "ring");
    has_ring && fields.iter().all(|field| known.contains(&field.name))
}

/// Number of lasers of the sensor of a list: the number that the file states, or that of the smallest head
/// with all rings of the cloud.
fn lasers(about: &About, cloud: &PointCloud) -> usize {
    let rings = cloud.row.iter().max().map_or(0, |ring| usize::from(*ring) + 1);
    let of_heads = || [16, 32, 64, 128].into_iter().find(|lasers| *lasers >= rings);
    let told = about.list.map(|list| list.rows).filter(|rows| *rows >= rings);
    told.or_else(of_heads).unwrap_or(rings)
}

/// Returns the points of an image of the Velodyne driver row by row from the top. The image has a line for
/// each column, and point k of a line is that of ring k. `None` for any other image.
fn by_column(
    fields: &[Stored],
    body: &[u8],
    stride: usize,
    [columns, rows]: [usize; 2],
) -> Option<Vec<u8>> {
    let ring = fields.iter().find(|field| field.name == "ring")?;
    let size = columns.checked_mul(rows)?.checked_mul(stride)?;
    let body = body.get(..size).filter(|_| is_of_velodyne(fields) && columns > 1)?;
    let points = || body.chunks_exact(stride).enumerate();
    let is_at_its_ring = |(at, point): (usize, &[u8])| {
        let ring = point.get(ring.offset..).map(|bytes| ring.kind.read(bytes));
        ring == Some((at % rows) as f64)
    };
    if !points().all(is_at_its_ring) {
        return None;
    }
    let mut by_rows = vec![0; size];
    for (at, point) in points() {
        let (column, row) = (at / rows, rows - 1 - at % rows);
        let to = (row * columns + column) * stride;
        by_rows[to..to + stride].copy_from_slice(point);
    }
    Some(by_rows)
}

/// Places of our attributes, and the offset to add to their times, ns.
fn layout(fields: &[Stored], stride: usize, stamp_ns: f64) -> (Layout, f64) {
    let has = |name: &str| fields.iter().any(|field| field.name == name);
    let white = match () {
        () if has("time_ns") => 1.0,
        () if has("tag") => 150.0,
        () => 100.0,
    };
    let epoch_ns = EPOCH_NS as f64;
    let mut layout = Layout::default();
    layout.stride = stride;
    let mut time_from_ns = 0.0;
    for &Stored { name, offset, kind } in fields {
        let known = match (name, kind) {
            ("timestamp", Kind::F8) if has("tag") => Some(Meaning::of(Attribute::TimeNs)),
            _ => Meaning::of_heading(name, Some(kind)),
        };
        let known = known.map(|known| match known.attribute {
            Attribute::Intensity => Meaning::scaled(Attribute::Intensity, 1.0 / white),
            _ => known,
        });
        match name {
            "time" | "t" | "time_stamp" => time_from_ns = stamp_ns - epoch_ns,
            // A time of day, in ns from Livox and in seconds from others.
            "timestamp" => time_from_ns = -epoch_ns,
            _ => {}
        }
        layout.place((name, known), kind, offset);
    }
    (layout, time_from_ns)
}

#[cfg(test)]
mod tests {
    use super::super::super::sample_cloud;
    use super::*;
    use crate::points::Truth;

    fn read(profile: Profile, cloud: &PointCloud) -> PointCloud {
        decode(&encode(profile, cloud).unwrap(), &mut About::default()).unwrap()
    }

    #[test]
    fn the_extended_profile_keeps_every_pixel() {
        let cloud = sample_cloud();
        let read = read(Profile::Extended, &cloud);
        assert_eq!((read.rows, read.columns), (2, 3));
        assert_eq!((&read.range, &read.time_ns), (&cloud.range, &cloud.time_ns));
        assert_eq!((&read.intensity, &read.fired_ns), (&cloud.intensity, &cloud.fired_ns));
        assert_eq!(read.truth.pixels.outcome, cloud.truth.pixels.outcome);
    }

    #[test]
    fn a_driver_s_fields_come_back_in_our_units() {
        let cloud = PointCloud { truth: Truth::default(), ..sample_cloud() };
        for profile in [Profile::Velodyne, Profile::Ouster, Profile::Livox, Profile::Autoware] {
            let read = read(profile, &cloud);
            assert_eq!((&read.x, &read.row), (&cloud.x, &cloud.row), "{profile:?}");
            let ranges = read.distances();
            for at in 0..5 {
                let off = |read: f32, written: f32| (read - written).abs();
                assert!(off(read.intensity[at], cloud.intensity[at]) <= 0.005, "{profile:?}");
                assert!(off(ranges[at], cloud.range[at]) <= 0.1, "{profile:?}");
                assert!((read.time_ns[at] - cloud.time_ns[at]).abs() <= 0.5, "{profile:?}");
            }
        }
    }

    /// The driver's image has a line for each firing, which holds the lasers from the lowest one up.
    #[test]
    fn an_image_of_velodyne_has_a_line_for_each_column() {
        let cloud = PointCloud { truth: Truth::default(), ..sample_cloud() };
        let message = encode(Profile::Velodyne, &cloud).unwrap();
        let mut fields = Decoder::new(&message).unwrap();
        // The stamp and the frame.
        let _ = (fields.u4().unwrap(), fields.u4().unwrap(), fields.text().unwrap());
        assert_eq!((fields.u4().unwrap(), fields.u4().unwrap()), (3, 2));
        let read = read(Profile::Velodyne, &cloud);
        assert_eq!((read.rows, read.columns), (2, 3));
        assert_eq!((&read.row, &read.column), (&cloud.row, &cloud.column));
        // A list, with a pixel at the top that alone has a return, of a head of 16 lasers.
        let list = PointCloud { rows: 0, columns: 0, fired_ns: Vec::new(), ..cloud };
        let message = encode(Profile::Velodyne, &list).unwrap();
        let rows = decode(&message, &mut About::default()).unwrap().row;
        assert_eq!(rows, [14, 14, 15, 15, 15]);
    }

    #[test]
    fn a_stamp_comes_back_to_the_nanosecond_and_times_count_from_it() {
        let stamp = 1_715_964_782_123_456_789;
        let written = PointCloud { stamp_ns: Some(stamp), ..sample_cloud() };
        let driver = PointCloud { truth: Truth::default(), ..written.clone() };
        let timeless = PointCloud { time_ns: Vec::new(), fired_ns: Vec::new(), ..driver.clone() };
        for (profile, cloud) in [
            (Profile::Extended, &written),
            (Profile::Velodyne, &driver),
            (Profile::Ouster, &driver),
            (Profile::Extended, &timeless),
        ] {
            let read = read(profile, cloud);
            assert_eq!((read.stamp_ns, read.time_ns.len()), (Some(stamp), cloud.time_ns.len()));
            for (read, written) in read.time_ns.iter().zip(&cloud.time_ns) {
                assert!((read - written).abs() <= 0.5, "{profile:?}: {read} {written}");
            }
        }
        // 64-bit floats have steps of 256 ns there.
        let read = read(Profile::Livox, &driver);
        assert!(read.time_ns.iter().zip(&driver.time_ns).all(|(a, b)| (a - b).abs() <= 256.0));
    }

    #[test]
    fn a_driver_s_zeros_and_unknown_fields_are_told() {
        let mut cloud =
            PointCloud { truth: Truth::default(), rows: 0, columns: 0, ..sample_cloud() };
        (cloud.x[1], cloud.y[1], cloud.z[1]) = (0.0, 0.0, 0.0);
        cloud.fired_ns = Vec::new();
        let mut about = About::default();
        let message = encode(Profile::Ouster, &cloud).unwrap();
        let read = decode(&message, &mut about).unwrap();
        assert_eq!((read.returns(), read.x[1]), (4, cloud.x[2]));
        let told = about.left_out.to_string();
        assert_eq!(told, "fields reflectivity, ambient; 1 point at (0, 0, 0)");
        // Nothing of ours is left out, and no point of ours is none.
        let mut about = About::default();
        let read = decode(&encode(Profile::Extended, &cloud).unwrap(), &mut about).unwrap();
        assert!(read.returns() == 5 && about.left_out.is_empty());
    }

    #[test]
    fn digits_of_coordinates_are_kept_in_64_bits() {
        let mut cloud = PointCloud { truth: Truth::default(), ..sample_cloud() };
        let far = [494_428.61, 4_877_455.58, 123.456];
        cloud.exact.x = vec![far[0]; 5];
        cloud.exact.y = vec![far[1]; 5];
        cloud.exact.z = vec![far[2]; 5];
        assert_eq!(read(Profile::Extended, &cloud).position(3), far);
        assert_eq!(read(Profile::Velodyne, &cloud).position(3), far.map(|at| f64::from(at as f32)));
    }

    #[test]
    fn a_message_that_lies_is_refused() {
        let whole = encode(Profile::Extended, &sample_cloud()).unwrap();
        // The last byte says only whether there is a return everywhere.
        for length in 0..whole.len() - 1 {
            assert!(decode(&whole[..length], &mut About::default()).is_err(), "{length}");
        }
    }
}

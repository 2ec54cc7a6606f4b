//! LAS 1.4 and LAZ, point format 6: the returns, with extra bytes for what LAS has no field for.

use super::Names;
use super::about::all_lines;
use super::attributes::{Attribute, returns};
use super::format::CloudWriter;
use super::holding::{Further, Holding};
use super::number::Kind;
use crate::points::PointCloud;
use las::{Builder, Point, Transform, Vector, Version, Vlr, Writer};
use std::io::{self, Cursor, Write};

/// Length of the smallest step of a coordinate, m, unless the cloud is too large for it. A float of
/// 32 bits, which a coordinate of a simulation is before, has steps of 1 to 8 µm between 8 and 128 m.
const STEP: f64 = 1e-6;

/// Steps that coordinates with more digits may have, m: the coarsest that keeps all of them counts.
const STEPS: [f64; 8] = [1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9];

/// Share of a step by which a coordinate may be beside it and still counts as on it: the rounding error of
/// sums of 64-bit floats.
const BESIDE: f64 = 1e-3;

/// Intensity that stands for an apparent reflectance of 1: the 16 bits end at 6.5535.
pub(super) const WHITE: f64 = 10_000.0;

/// Whose records are the descriptions of extra bytes, and their number.
pub(super) const EXTRA_BYTES: (&str, u16) = ("LASF_Spec", 4);

/// Whose record is our text, and its number.
pub(super) const TEXT: (&str, u16) = ("macropulse", 1);

/// Bytes that describe a dimension of the extra bytes.
pub(super) const DESCRIPTION: usize = 192;

/// Number of each kind in the description of extra bytes.
pub(super) const KINDS: [Kind; 10] = [
    Kind::U1,
    Kind::I1,
    Kind::U2,
    Kind::I2,
    Kind::U4,
    Kind::I4,
    Kind::U8,
    Kind::I8,
    Kind::F4,
    Kind::F8,
];

/// The name of an attribute among the extra bytes, if LAS has no field that holds it whole.
pub(super) fn extra_name(attribute: Attribute) -> Option<&'static str> {
    match attribute {
        Attribute::X | Attribute::Y | Attribute::Z | Attribute::TimeNs => None,
        Attribute::ReturnNumber | Attribute::NumberOfReturns => None,
        // `intensity` is a field of LAS, with 16 bits.
        Attribute::Intensity => Some("reflectance"),
        other => Some(other.name()),
    }
}

/// LAS 1.4, point format 6.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Compression {
    /// Plain records.
    None,
    /// Compressed records: LAZ.
    Laz,
}

impl CloudWriter for Compression {
    fn name(&self) -> &'static str {
        match self {
            Self::None => "las",
            Self::Laz => "laz",
        }
    }

    fn holds(&self, attribute: Attribute) -> Holding {
        match attribute {
            Attribute::X | Attribute::Y | Attribute::Z => {
                Holding::Partly("steps of 1 µm, or those of the file read")
            }
            Attribute::TimeNs => Holding::Partly("`gps_time`, s"),
            Attribute::ReturnNumber | Attribute::NumberOfReturns => Holding::Partly("up to 15"),
            other if extra_name(other) != Some(other.name()) => {
                Holding::Partly("extra bytes `reflectance`; `intensity` is 10 000 × it")
            }
            _ => Holding::Whole,
        }
    }

    fn holds_further(&self, further: Further) -> bool {
        further != Further::EmptyPixels
    }

    fn write(&self, cloud: &PointCloud, names: &Names, out: &mut dyn Write) -> io::Result<()> {
        let extra: Vec<Attribute> = Attribute::of(cloud)
            .into_iter()
            .filter(|attribute| extra_name(*attribute).is_some())
            .collect();
        let header = builder(cloud, names, &extra, *self == Self::Laz)?.into_header();
        let mut writer = Writer::new(Cursor::new(Vec::new()), header.map_err(io::Error::other)?)
            .map_err(io::Error::other)?;
        for (at, point) in returns(cloud).enumerate() {
            let mut bytes = Vec::new();
            extra.iter().for_each(|attribute| attribute.value(cloud, point).append_to(&mut bytes));
            writer.write_point(point_of(cloud, at, bytes)).map_err(io::Error::other)?;
        }
        out.write_all(writer.into_inner().map_err(io::Error::other)?.get_ref())
    }
}

fn builder(
    cloud: &PointCloud,
    names: &Names,
    extra: &[Attribute],
    compress: bool,
) -> io::Result<Builder> {
    let mut builder = Builder::from(Version::new(1, 4));
    builder.generating_software = concat!("macropulse ", env!("CARGO_PKG_VERSION")).to_owned();
    builder.system_identifier = "SIMULATION".to_owned();
    builder.point_format = las::point::Format::new(6).map_err(io::Error::other)?;
    builder.point_format.is_compressed = compress;
    let size = extra.iter().map(|attribute| attribute.kind(cloud).size()).sum::<usize>();
    builder.point_format.extra_bytes = size as u16;
    builder.transforms = transforms(cloud);
    let described = extra.iter().flat_map(|attribute| description(*attribute, cloud)).collect();
    let lines: Vec<String> = all_lines(cloud, names).collect();
    builder.vlrs.push(record(EXTRA_BYTES, "extra bytes", described));
    let text = record(TEXT, "scan, image, pose, names", lines.join("\n").into_bytes());
    // Only the extended records have room for more than 65 535 bytes.
    if text.has_large_data() { &mut builder.evlrs } else { &mut builder.vlrs }.push(text);
    Ok(builder)
}

fn record((user, number): (&str, u16), description: &str, data: Vec<u8>) -> Vlr {
    Vlr { user_id: user.to_owned(), record_id: number, description: description.to_owned(), data }
}

/// The description of a dimension of the extra bytes.
fn description(attribute: Attribute, cloud: &PointCloud) -> [u8; DESCRIPTION] {
    let mut bytes = [0; DESCRIPTION];
    let mut put = |at: usize, text: &str| {
        let text = &text.as_bytes()[..text.len().min(31)];
        bytes[at..at + text.len()].copy_from_slice(text);
    };
    put(4, extra_name(attribute).unwrap_or_default());
    let unit = match attribute {
        Attribute::Intensity => "1 = white Lambertian",
        other => other.unit(),
    };
    put(160, unit);
    let kind = attribute.kind(cloud);
    bytes[2] = KINDS.iter().position(|known| *known == kind).map_or(0, |at| at as u8 + 1);
    bytes
}

/// Steps and offsets of the coordinates.
fn transforms(cloud: &PointCloud) -> Vector<Transform> {
    let exact = &cloud.exact;
    if exact.x.is_empty() {
        let transform = Transform { scale: step(cloud), offset: 0.0 };
        return Vector { x: transform, y: transform, z: transform };
    }
    Vector { x: transform(&exact.x), y: transform(&exact.y), z: transform(&exact.z) }
}

/// The offset in whole metres amid `places`, m, and the coarsest step that keeps each of them; else the
/// finest step by which 32 bits reach all.
fn transform(places: &[f64]) -> Transform {
    let bounds = (f64::INFINITY, f64::NEG_INFINITY);
    let (low, high) = places.iter().fold(bounds, |(low, high), &at| (low.min(at), high.max(at)));
    let offset = (0.5 * (low + high)).round();
    let farthest = (high - offset).max(offset - low);
    let reaches = |step: f64| farthest <= step * f64::from(i32::MAX - 1);
    let keeps = |step: f64| {
        places.iter().all(|at| {
            let steps = (at - offset) / step;
            (steps - steps.round()).abs() <= BESIDE
        })
    };
    let mut finest = STEPS.into_iter().rev().find(|step| reaches(*step)).unwrap_or(STEPS[0]);
    while !reaches(finest) && finest < 1e30 {
        finest *= 10.0;
    }
    let coarsest = STEPS.into_iter().find(|step| *step >= finest && keeps(*step));
    Transform { scale: coarsest.unwrap_or(finest), offset }
}

/// The smallest step of coordinates, m: a power of ten by which the farthest of them has 31 bits.
fn step(cloud: &PointCloud) -> f64 {
    let all = cloud.x.iter().chain(&cloud.y).chain(&cloud.z);
    let farthest = all.fold(0.0_f32, |most, place| most.max(place.abs()));
    let mut step = STEP;
    while f64::from(farthest) > step * f64::from(i32::MAX - 1) && step < 1e30 {
        step *= 10.0;
    }
    step
}

fn point_of(cloud: &PointCloud, at: usize, extra_bytes: Vec<u8>) -> Point {
    let [x, y, z] = cloud.position(at);
    let white = cloud.intensity.get(at).map_or(0.0, |&intensity| f64::from(intensity) * WHITE);
    // A number of 0 says that nothing is known.
    let number = |column: &[u8]| column.get(at).map_or(0, |&number| number.min(15));
    Point {
        x,
        y,
        z,
        intensity: white.round().clamp(0.0, 65_535.0) as u16,
        return_number: number(&cloud.return_number),
        number_of_returns: number(&cloud.number_of_returns),
        user_data: cloud.row.get(at).and_then(|&row| u8::try_from(row).ok()).unwrap_or(0),
        gps_time: Some(cloud.time_ns.get(at).map_or(0.0, |time| time * 1e-9)),
        extra_bytes,
        ..Point::default()
    }
}

#[cfg(test)]
mod tests {
    use super::super::sample_cloud;
    use super::*;

    #[test]
    fn a_step_is_a_micrometre_until_the_cloud_is_too_large() {
        let cloud = sample_cloud();
        assert_eq!(step(&cloud), 1e-6);
        let far = PointCloud { x: vec![3000.0], ..PointCloud::default() };
        assert!((step(&far) - 1e-5).abs() < 1e-12);
    }

    #[test]
    fn a_step_is_the_coarsest_that_keeps_every_coordinate() {
        let found = |places: &[f64]| {
            let Transform { scale, offset } = transform(places);
            (scale, offset)
        };
        assert_eq!(found(&[494_428.61, 494_430.07]), (1e-2, 494_429.0));
        assert_eq!(found(&[4_877_455.58, 4_877_455.581]), (1e-3, 4_877_456.0));
        // Thirds lie on no step: the finest by which 31 bits reach 1000 m.
        assert_eq!(found(&[1.0 / 3.0, 2000.0]), (1e-6, 1000.0));
        let (step, _) = found(&[-1e9, 1e9 + 1.0 / 3.0]);
        assert!(1e9 <= step * f64::from(i32::MAX) && step <= 1.0, "{step}");
    }

    #[test]
    fn the_description_of_extra_bytes_is_laid_out_as_las_has_it() {
        let bytes = description(Attribute::Row, &sample_cloud());
        assert_eq!(bytes[2], 3, "unsigned short");
        assert_eq!(&bytes[4..8], b"row\0");
        let bytes = description(Attribute::Intensity, &sample_cloud());
        assert_eq!((bytes[2], &bytes[4..15]), (9, &b"reflectance"[..]));
    }

    #[test]
    fn las_files_begin_with_their_magic_and_laz_is_smaller() {
        let cloud = PointCloud { returns_per_shot: 1, ..sample_cloud() };
        let written = |compression: Compression| {
            let mut bytes = Vec::new();
            compression.write(&cloud, &Names::default(), &mut bytes).unwrap();
            assert_eq!(&bytes[..4], b"LASF");
            bytes
        };
        let [las, laz] = [Compression::None, Compression::Laz].map(written);
        assert_eq!((las[24], las[25], las[104] & 63), (1, 4, 6));
        assert_eq!(laz[104] & 128, 128);
    }
}

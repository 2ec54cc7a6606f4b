//! Reads LAS and LAZ files, ours and those of others.

use super::CloudRoom;
use super::about::About;
use super::attributes::Attribute;
use super::cloud_file::CloudFile;
use super::contained::contained;
use super::headings::Meaning;
use super::las::{DESCRIPTION, EXTRA_BYTES, KINDS, TEXT, WHITE, extra_name};
use super::left_out::{LeftOut, NoPoint};
use super::number::Kind;
use super::table::{Digits, Gathered, Record, cut_short};
use crate::points::PointCloud;
use las::{Header, Point, Reader};

/// Bytes of points read at a time: what the header says of their number is not believed, and each may
/// have 65 535 bytes.
const AT_A_TIME: u64 = 1 << 22;

/// A dimension of the extra bytes that is one of our attributes.
struct Extra {
    meaning: Meaning,
    kind: Kind,
    offset: usize,
}

/// The cloud of a LAS or LAZ file, and what it says beside it.
pub(super) fn parse(mut file: CloudFile, room: CloudRoom) -> Result<(PointCloud, About), String> {
    check_sizes(&mut file)?;
    contained(|| parse_checked(file, room))?
}

/// The same, of a file that holds what its header promises.
fn parse_checked(mut file: CloudFile, room: CloudRoom) -> Result<(PointCloud, About), String> {
    let damaged = |_| "its header is damaged".to_owned();
    file.go_to(0)?;
    let header = Header::new(&mut file).map_err(damaged)?;
    check_compression(&header)?;
    check_layers(&mut file, &header)?;
    file.go_to(0)?;
    let mut reader = Reader::new(file).map_err(damaged)?;
    let mut about = About { room, ..about(reader.header())? };
    let extra = extra(reader.header(), &mut about.left_out);
    let mut gathered = Gathered::new(&about, &attributes(&extra), Digits::Double)?;
    let mut unread = Unread::new(reader.header());
    let points = reader.header().number_of_points();
    room.check(points)?;
    let mut batch = las::PointDataBuilder::new().for_header(reader.header()).build();
    let together = (AT_A_TIME / u64::from(header.point_format().len()).max(1)).max(1);
    let mut at = 0_usize;
    let ends = |at: usize| format!("it ends after {at} of {points} points, or is damaged");
    loop {
        let found = reader.fill_points(together, &mut batch).map_err(|_| ends(at))?;
        if found == 0 {
            break;
        }
        for point in batch.points() {
            let point = point.map_err(|_| ends(at))?;
            if point.is_withheld {
                gathered.drop_point(NoPoint::Withheld);
            } else {
                unread.see(&point);
                gathered.add(record(&point, &extra, at)?);
            }
            at += 1;
        }
    }
    unread.tell(&mut about.left_out);
    let mut cloud = gathered.cloud(&mut about)?;
    forget_blank(&mut cloud, &extra);
    Ok((cloud, about))
}

/// Fields of LAS that a cloud has no column for.
const UNREAD: [&str; 13] = [
    "classification",
    "red",
    "green",
    "blue",
    "nir",
    "scan_angle",
    "user_data",
    "point_source_id",
    "scanner_channel",
    "edge_of_flight_line",
    "synthetic",
    "key_point",
    "overlap",
];

/// Which of [`UNREAD`] say something of any point.
struct Unread {
    seen: [bool; UNREAD.len()],
    /// True if the file is ours: then the user data is the row.
    is_ours: bool,
}

impl Unread {
    fn new(header: &Header) -> Self {
        let mut records = header.all_vlrs();
        let is_ours = records.any(|vlr| (vlr.user_id.as_str(), vlr.record_id) == TEXT);
        Self { seen: [false; UNREAD.len()], is_ours }
    }

    fn see(&mut self, point: &Point) {
        let colour = point.color.unwrap_or_default();
        let says = [
            u8::from(point.classification) > 1,
            colour.red != 0,
            colour.green != 0,
            colour.blue != 0,
            point.nir.is_some_and(|nir| nir != 0),
            point.scan_angle != 0.0,
            point.user_data != 0 && !self.is_ours,
            point.point_source_id != 0,
            point.scanner_channel != 0,
            point.is_edge_of_flight_line,
            point.is_synthetic,
            point.is_key_point,
            point.is_overlap,
        ];
        self.seen.iter_mut().zip(says).for_each(|(seen, says)| *seen |= says);
    }

    fn tell(&self, left_out: &mut LeftOut) {
        let seen = UNREAD.iter().zip(self.seen).filter(|(_, seen)| *seen);
        seen.for_each(|(name, _)| left_out.field(name));
    }
}

/// Number of the compression without chunks, by which LASzip began.
const POINTWISE: [u8; 2] = [1, 0];

/// Refuses points that are compressed in one piece, which the library does not read.
fn check_compression(header: &Header) -> Result<(), String> {
    let mut records = header.vlrs().iter();
    let laszip = records.find(|vlr| vlr.user_id == "laszip encoded" && vlr.record_id == 22_204);
    match laszip {
        Some(vlr) if vlr.data.starts_with(&POINTWISE) => Err(
            "its points are compressed pointwise, in one piece, as the first versions of LASzip \
             did; chunks are read: write it anew, as `laszip -i in.laz -o out.las` does"
                .to_owned(),
        ),
        _ => Ok(()),
    }
}

/// The name of the coordinate reference system: that of a text by OGC, or the number of a GeoTIFF key.
fn reference_system(header: &Header) -> Option<String> {
    if let Some(text) = header.get_wkt_crs_bytes() {
        let text = String::from_utf8_lossy(text);
        let name = text.split('"').nth(1).unwrap_or("without a name");
        return Some(format!("\"{name}\""));
    }
    let mut records = header.all_vlrs();
    let keys = records.find(|vlr| vlr.user_id == "LASF_Projection" && vlr.record_id == 34_735)?;
    let number =
        |at: usize| Some(u16::from_le_bytes([*keys.data.get(at)?, *keys.data.get(at + 1)?]));
    // Four numbers each behind four of the whole: key, where its value is, how many there are, the value.
    let mut all = (1..keys.data.len() / 8).map(|key| 8 * key);
    let of_earth = |key: u16| key == 2048 || key == 3072;
    let found = all.rfind(|&at| number(at).is_some_and(of_earth) && number(at + 2) == Some(0));
    let code = found.and_then(|at| number(at + 6));
    Some(code.map_or_else(|| "of GeoTIFF keys".to_owned(), |code| format!("EPSG:{code}")))
}

/// The number at byte `at`, if the file reaches as far.
fn number(file: &mut CloudFile, at: u64, kind: Kind) -> Result<Option<u64>, String> {
    let mut bytes = [0; 8];
    let bytes = &mut bytes[..kind.size()];
    let is_there = at <= file.length() && file.fill_from(at, bytes)?;
    Ok(is_there.then(|| kind.read(bytes) as u64))
}

/// Refuses sizes in the header that reach beyond the file, before any memory is spent on them.
fn check_sizes(file: &mut CloudFile) -> Result<(), String> {
    let mut begins = [0; 4];
    if !file.fill_from(0, &mut begins)? || begins != *b"LASF" {
        return Err("it does not begin with LASF".to_owned());
    }
    let length = file.length();
    let mut number = |at: u64, kind: Kind| number(file, at, kind);
    let ends = "it ends within its header";
    let points = number(96, Kind::U4)?.ok_or(ends)?;
    let Some(room) = length.checked_sub(points) else {
        return Err(format!("its points would begin at byte {points}; the file was cut short"));
    };
    let is_compressed = number(104, Kind::U1)?.is_some_and(|format| format & 0xc0 != 0);
    let is_large = number(25, Kind::U1)?.is_some_and(|minor| minor >= 4);
    let record = number(105, Kind::U2)?.unwrap_or(0);
    let count = match is_large {
        true => number(247, Kind::U8)?.ok_or(ends)?,
        false => number(107, Kind::U4)?.ok_or(ends)?,
    };
    if !is_compressed && count.saturating_mul(record) > room {
        let whole = room / record.max(1);
        return Err(cut_short(whole, count));
    }
    if is_large {
        check_extended(file)?;
    }
    Ok(())
}

/// Refuses layers of compressed points that reach beyond the file: the library takes memory for each
/// before it reads it.
fn check_layers(file: &mut CloudFile, header: &Header) -> Result<(), String> {
    let fault = || "its compressed points are damaged".to_owned();
    let Ok(vlr) = header.laz_vlr() else { return Ok(()) };
    // The compressed points must be those of the header: longer ones would have more layers.
    if vlr.items_size() != u64::from(header.point_format().len()) {
        return Err(fault());
    }
    let begin = number(file, 96, Kind::U4)?.ok_or_else(fault)?;
    let table = number(file, begin, Kind::U8)?.ok_or_else(fault)?;
    // A file that was written as a stream has the place of the table at its end.
    let end = file.length();
    let table = if table > begin && table < end {
        table
    } else {
        number(file, end.saturating_sub(8), Kind::U8)?.ok_or_else(fault)?
    };
    let chunks = number(file, table.saturating_add(4), Kind::U4)?.ok_or_else(fault)?;
    if table <= begin || chunks > end {
        return Err(fault());
    }
    let format = header.point_format();
    if !format.is_extended {
        return Ok(());
    }
    let colours = u64::from(format.has_color) + u64::from(format.has_nir);
    let layers = 9 + colours + u64::from(format.extra_bytes) + u64::from(format.has_waveform);
    file.go_to(begin)?;
    let table = laz::laszip::ChunkTable::read_from(&mut *file, &vlr).map_err(|_| fault())?;
    let mut at = begin + 8;
    for chunk in 0..table.len() {
        // The first point as it is, then how many there are, then the sizes of the layers.
        let sizes = at + u64::from(format.len()) + 4;
        let mut size = 0_u64;
        for layer in 0..layers {
            size += number(file, sizes + 4 * layer, Kind::U4)?.unwrap_or_default();
        }
        if size > end {
            return Err(fault());
        }
        at = at.checked_add(table[chunk].byte_count).filter(|at| *at <= end).ok_or_else(fault)?;
    }
    Ok(())
}

/// Refuses extended records that reach beyond the file.
fn check_extended(file: &mut CloudFile) -> Result<(), String> {
    let fault = || "a record behind its points reaches beyond the file".to_owned();
    let mut number = |at: u64, kind: Kind| number(file, at, kind)?.ok_or_else(fault);
    let count = number(243, Kind::U4)?;
    let mut at = number(235, Kind::U8)?;
    for _ in 0..count {
        let length = number(at.saturating_add(20), Kind::U8)?;
        at = at.saturating_add(60).saturating_add(length);
    }
    if at > file.length() && count > 0 { Err(fault()) } else { Ok(()) }
}

fn about(header: &Header) -> Result<About, String> {
    let mut about = About::default();
    for record in header.all_vlrs() {
        if (record.user_id.as_str(), record.record_id) == TEXT {
            for line in String::from_utf8_lossy(&record.data).lines() {
                about.take(line)?;
            }
        }
    }
    about.left_out.reference_system = reference_system(header);
    Ok(about)
}

/// Our attributes among the extra bytes; others are named in `left_out`.
fn extra(header: &Header, left_out: &mut LeftOut) -> Vec<Extra> {
    let (mut found, mut offset) = (Vec::new(), 0);
    let ours = header.all_vlrs().filter(|vlr| (vlr.user_id.as_str(), vlr.record_id) == EXTRA_BYTES);
    for bytes in ours.flat_map(|vlr| vlr.data.chunks_exact(DESCRIPTION)) {
        let name = bytes[4..36].split(|byte| *byte == 0).next().unwrap_or_default();
        let kind = KINDS.get(usize::from(bytes[2]).wrapping_sub(1)).copied();
        // Bytes without a type say in their options how many they are.
        let Some(kind) = kind else {
            offset += usize::from(bytes[3]);
            continue;
        };
        let name = String::from_utf8_lossy(name);
        let ours = Attribute::in_files().find(|known| extra_name(*known) == Some(&*name));
        // Scaled dimensions are those of others.
        let meaning = ours.map(Meaning::of).or_else(|| of_others(&name, kind));
        match meaning.filter(|_| bytes[3] & 0b11000 == 0) {
            Some(meaning) => found.push(Extra { meaning, kind, offset }),
            None => left_out.field(&name),
        }
        offset += kind.size();
    }
    found
}

/// Meaning of extra bytes of another program. Coordinates, times and returns are none: LAS has fields for
/// them.
fn of_others(name: &str, kind: Kind) -> Option<Meaning> {
    use Attribute::{Column, Intensity, Range, Ring, Row};
    let meaning = Meaning::of_heading(name, Some(kind));
    meaning.filter(|known| matches!(known.attribute, Intensity | Range | Row | Column | Ring))
}

/// Attributes of the points of a file. [`forget_blank`] drops the fields that LAS always has and this file
/// leaves blank.
fn attributes(extra: &[Extra]) -> Vec<Attribute> {
    let always = [Attribute::Intensity, Attribute::ReturnNumber, Attribute::NumberOfReturns];
    let extra = extra.iter().map(|extra| extra.meaning.attribute);
    always.into_iter().chain([Attribute::TimeNs]).chain(extra).collect()
}

/// Empties columns that are 0 throughout: LAS has no other way to say that nothing is known.
fn forget_blank(cloud: &mut PointCloud, extra: &[Extra]) {
    let is_extra = extra.iter().any(|extra| extra.meaning.attribute == Attribute::Intensity);
    if !is_extra && cloud.intensity.iter().all(|intensity| *intensity == 0.0) {
        cloud.intensity.clear();
    }
    for numbers in [&mut cloud.return_number, &mut cloud.number_of_returns] {
        if numbers.iter().all(|number| *number == 0) {
            numbers.clear();
        }
    }
    if cloud.time_ns.iter().all(|time| *time == 0.0) {
        cloud.time_ns.clear();
        cloud.fired_ns.clear();
    }
}

fn record(point: &Point, extra: &[Extra], at: usize) -> Result<Record, String> {
    let mut record = Record::default();
    record.set(at, Attribute::X, point.x)?;
    record.set(at, Attribute::Y, point.y)?;
    record.set(at, Attribute::Z, point.z)?;
    record.set(at, Attribute::Intensity, f64::from(point.intensity) / WHITE)?;
    record.set(at, Attribute::ReturnNumber, f64::from(point.return_number))?;
    record.set(at, Attribute::NumberOfReturns, f64::from(point.number_of_returns))?;
    record.set(at, Attribute::TimeNs, point.gps_time.unwrap_or(0.0) * 1e9)?;
    for Extra { meaning, kind, offset } in extra {
        let bytes = point.extra_bytes.get(*offset..).unwrap_or_default();
        record.set(at, meaning.attribute, meaning.number(kind.read(bytes)))?;
    }
    Ok(record)
}

#[cfg(test)]
mod tests {
    use super::super::format::CloudWriter;
    use super::super::las as writer;
    use super::super::{Names, sample_cloud};
    use super::*;
    use std::io::Cursor;

    fn parse(bytes: Vec<u8>) -> Result<(PointCloud, About), String> {
        super::parse(CloudFile::of_bytes(&bytes), CloudRoom::default())
    }

    fn written(compression: writer::Compression) -> Vec<u8> {
        let mut bytes = Vec::new();
        compression.write(&sample_cloud(), &Names::default(), &mut bytes).unwrap();
        bytes
    }

    #[test]
    fn what_was_written_is_read() {
        let cloud = sample_cloud();
        for compression in [writer::Compression::None, writer::Compression::Laz] {
            let (read, about) = parse(written(compression)).unwrap();
            assert_eq!((read.scan, read.rows, read.columns), (3, 2, 3));
            assert_eq!(about.viewpoint, cloud.viewpoint);
            assert_eq!((&read.range, &read.intensity), (&cloud.range, &cloud.intensity));
            assert_eq!((&read.row, &read.column), (&cloud.row, &cloud.column));
            assert_eq!(read.truth.returns.outcome, cloud.truth.returns.outcome);
            for at in 0..cloud.returns() {
                let (read, written) = (read.position(at), cloud.position(at));
                assert!(read.iter().zip(written).all(|(a, b)| (a - b).abs() <= 5e-7), "{read:?}");
            }
            assert!(about.left_out.is_empty(), "{}", about.left_out);
        }
    }

    /// A file of another writer with these points, changed by `change` before.
    fn foreign(points: &[Point], change: impl FnOnce(&mut las::Builder)) -> Vec<u8> {
        let mut builder = las::Builder::from(las::Version::new(1, 2));
        builder.point_format = las::point::Format::new(3).unwrap();
        let transform = |offset: f64| las::Transform { scale: 0.01, offset };
        let (x, y, z) = (transform(494_000.0), transform(4_877_000.0), transform(0.0));
        builder.transforms = las::Vector { x, y, z };
        change(&mut builder);
        let header = builder.into_header().unwrap();
        let mut writer = las::Writer::new(Cursor::new(Vec::new()), header).unwrap();
        points.iter().for_each(|point| writer.write_point(point.clone()).unwrap());
        writer.into_inner().unwrap().into_inner()
    }

    fn point(x: f64, y: f64, z: f64) -> Point {
        let (gps_time, color) = (Some(0.0), Some(las::Color::default()));
        Point { x, y, z, gps_time, color, ..Point::default() }
    }

    #[test]
    fn a_stranger_s_coordinates_keep_their_step_there_and_back() {
        let far = [494_428.61, 4_877_455.58, 123.45];
        let [x, y, z] = far;
        let (cloud, about) =
            parse(foreign(&[point(x, y, z), point(x + 9e3, y, z)], |_| ())).unwrap();
        assert!(cloud.intensity.is_empty() && cloud.time_ns.is_empty());
        assert!(cloud.return_number.is_empty() && about.left_out.is_empty());
        let mut bytes = Vec::new();
        writer::Compression::Laz.write(&cloud, &Names::default(), &mut bytes).unwrap();
        let (again, _) = parse(bytes).unwrap();
        for (found, written) in again.position(0).into_iter().zip(far) {
            assert!((found - written).abs() < 1e-9, "{found} {written}");
        }
        assert!(again.intensity.is_empty() && again.time_ns.is_empty());
    }

    #[test]
    fn withheld_points_are_none_and_what_is_not_read_is_named() {
        let mut points = [point(1.0, 2.0, 3.0), point(4.0, 5.0, 6.0)];
        points[0].is_withheld = true;
        points[1].color = Some(las::Color { red: 9, green: 0, blue: 1 });
        points[1].classification = las::point::Classification::Ground;
        points[1].intensity = 500;
        let bytes = foreign(&points, |builder| {
            let mut data = vec![1, 0, 1, 0, 0, 0, 1, 0];
            data.extend([3072_u16, 0, 1, 25_832].iter().flat_map(|number| number.to_le_bytes()));
            let (user_id, record_id) = ("LASF_Projection".to_owned(), 34_735);
            builder.vlrs.push(las::Vlr { user_id, record_id, description: String::new(), data });
        });
        let (cloud, about) = parse(bytes).unwrap();
        assert_eq!((cloud.returns(), cloud.position(0)), (1, [4.0, 5.0, 6.0]));
        assert_eq!(cloud.intensity, [0.05]);
        assert_eq!(
            about.left_out.to_string(),
            "fields classification, red, blue; coordinate reference system EPSG:25832; \
             1 point marked as withheld"
        );
    }

    #[test]
    fn points_compressed_in_one_piece_are_named_as_such() {
        let mut laz = written(writer::Compression::Laz);
        let name = b"laszip encoded";
        let at = laz.windows(name.len()).position(|window| window == name).unwrap();
        // Behind the name of 16 bytes its number, its length and a description of 32.
        laz[at + 16 + 4 + 32..][..2].copy_from_slice(&[1, 0]);
        assert!(parse(laz).unwrap_err().contains("are compressed pointwise"));
    }

    #[test]
    fn extra_bytes_of_others_are_known_by_their_names() {
        let attribute = |name: &str, kind| of_others(name, kind).map(|known| known.attribute);
        assert_eq!(attribute("scalar_Intensity", Kind::F4), Some(Attribute::Intensity));
        assert_eq!(attribute("Laser_ID", Kind::U1), Some(Attribute::Ring));
        assert_eq!(of_others("Distance", Kind::U4).map(|known| known.number(1500.0)), Some(1.5));
        // LAS has fields for these.
        for name in ["x", "GpsTime", "NumberOfReturns"] {
            assert_eq!(attribute(name, Kind::F8), None, "{name}");
        }
    }

    #[test]
    fn a_file_cut_short_is_refused() {
        let las = written(writer::Compression::None);
        let told = parse(las[..las.len() - 1].to_vec()).unwrap_err();
        assert!(told.contains("ends after 4 of 5 points"), "{told}");
        assert!(parse(las[..100].to_vec()).unwrap_err().contains("cut short"));
        let laz = written(writer::Compression::Laz);
        assert!(parse(laz[..laz.len() - 40].to_vec()).is_err());
        assert_eq!(parse(b"ply\n".to_vec()).unwrap_err(), "it does not begin with LASF");
    }

    #[test]
    fn absurd_sizes_are_refused_not_allocated() {
        let mut las = written(writer::Compression::None);
        las[247..255].copy_from_slice(&u64::MAX.to_le_bytes());
        assert!(parse(las).unwrap_err().contains("points"));
        let mut las = written(writer::Compression::None);
        las[96..100].copy_from_slice(&u32::MAX.to_le_bytes());
        assert!(parse(las).unwrap_err().contains("cut short"));
        let mut las = written(writer::Compression::None);
        las[235..243].copy_from_slice(&100_u64.to_le_bytes());
        las[243..247].copy_from_slice(&u32::MAX.to_le_bytes());
        assert!(parse(las).unwrap_err().contains("beyond the file"));
    }
}

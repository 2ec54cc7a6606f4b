//! Reads LAS and LAZ files, ours and those of others.

use super::CloudRoom;
use super::about::About;
use super::attributes::Attribute;
use super::contained::contained;
use super::las::{DESCRIPTION, EXTRA_BYTES, KINDS, TEXT, WHITE, extra_name};
use super::number::Kind;
use super::table::{Digits, Gathered, Record};
use crate::points::PointCloud;
use las::{Header, Point, Reader};
use std::io::Cursor;
use std::ops::Range;

/// Bytes of points read at a time: what the header says of their number is not believed, and each may
/// have 65 535 bytes.
const AT_A_TIME: u64 = 1 << 22;

/// A dimension of the extra bytes that is one of our attributes.
struct Extra {
    attribute: Attribute,
    kind: Kind,
    offset: usize,
}

/// The cloud of a LAS or LAZ file, and what it says beside it.
pub(super) fn parse(bytes: Vec<u8>, room: CloudRoom) -> Result<(PointCloud, About), String> {
    check_sizes(&bytes)?;
    contained(|| parse_checked(bytes, room))?
}

/// The same, of a file that holds what its header promises.
fn parse_checked(bytes: Vec<u8>, room: CloudRoom) -> Result<(PointCloud, About), String> {
    let header = Header::new(Cursor::new(&bytes)).map_err(|error| error.to_string())?;
    check_layers(&bytes, &header)?;
    let mut reader = Reader::new(Cursor::new(bytes)).map_err(|error| error.to_string())?;
    let mut about = About { room, ..about(reader.header())? };
    let extra = extra(reader.header());
    let mut gathered = Gathered::new(&about, &attributes(&extra), Digits::Double)?;
    let points = reader.header().number_of_points();
    room.check(points)?;
    let mut batch = las::PointDataBuilder::new().for_header(reader.header()).build();
    let together = (AT_A_TIME / u64::from(header.point_format().len()).max(1)).max(1);
    let mut at = 0_usize;
    loop {
        let found = reader
            .fill_points(together, &mut batch)
            .map_err(|why| format!("it ends after {at} of {points} points or is damaged: {why}"))?;
        if found == 0 {
            break;
        }
        for point in batch.points() {
            gathered.add(record(&point.map_err(|error| error.to_string())?, &extra, at)?);
            at += 1;
        }
    }
    let mut cloud = gathered.cloud(&mut about)?;
    forget_blank(&mut cloud, &extra);
    Ok((cloud, about))
}

/// Refuses sizes in the header that reach beyond the file, before any memory is spent on them.
fn check_sizes(bytes: &[u8]) -> Result<(), String> {
    let number = |range: Range<usize>, kind: Kind| bytes.get(range).map(|part| kind.read(part));
    let length = bytes.len() as f64;
    if !bytes.starts_with(b"LASF") {
        return Err("it does not begin with LASF".to_owned());
    }
    let points = number(96..100, Kind::U4).ok_or("it ends within its header")?;
    if points > length {
        return Err(format!("its points would begin at byte {points}; the file was cut short"));
    }
    let is_compressed = bytes.get(104).is_some_and(|format| format & 0xc0 != 0);
    let is_large = bytes.get(25).is_some_and(|minor| *minor >= 4);
    let record = number(105..107, Kind::U2).unwrap_or(0.0);
    let count = match is_large {
        true => number(247..255, Kind::U8).ok_or("it ends within its header")?,
        false => number(107..111, Kind::U4).ok_or("it ends within its header")?,
    };
    if !is_compressed && points + count * record > length {
        let whole = ((length - points) / record.max(1.0)).floor();
        return Err(format!("it ends after {whole} of {count} points; the file was cut short"));
    }
    if is_large {
        check_extended(bytes)?;
    }
    Ok(())
}

/// Refuses layers of compressed points that reach beyond the file: the library takes memory for each
/// before it reads it.
fn check_layers(bytes: &[u8], header: &Header) -> Result<(), String> {
    let fault = || "its compressed points are damaged".to_owned();
    let number = |at: u64, kind: Kind| {
        let at = usize::try_from(at).ok()?;
        bytes.get(at..).filter(|rest| rest.len() >= kind.size()).map(|rest| kind.read(rest) as u64)
    };
    let Ok(vlr) = header.laz_vlr() else { return Ok(()) };
    // What is compressed must be the points of the header: of longer ones there were more layers.
    if vlr.items_size() != u64::from(header.point_format().len()) {
        return Err(fault());
    }
    let begin = number(96, Kind::U4).ok_or_else(fault)?;
    let table = number(begin, Kind::U8).ok_or_else(fault)?;
    // Where the file was written as a stream, the place of the table is at the end.
    let end = bytes.len() as u64;
    let table = if table > begin && table < end {
        table
    } else {
        number(end.saturating_sub(8), Kind::U8).ok_or_else(fault)?
    };
    let chunks = number(table.saturating_add(4), Kind::U4).ok_or_else(fault)?;
    if table <= begin || chunks > end {
        return Err(fault());
    }
    let format = header.point_format();
    if !format.is_extended {
        return Ok(());
    }
    let colours = u64::from(format.has_color) + u64::from(format.has_nir);
    let layers = 9 + colours + u64::from(format.extra_bytes) + u64::from(format.has_waveform);
    let mut source = Cursor::new(bytes);
    source.set_position(begin);
    let table =
        laz::laszip::ChunkTable::read_from(&mut source, &vlr).map_err(|why| why.to_string())?;
    let mut at = begin + 8;
    for chunk in 0..table.len() {
        // The first point as it is, then how many there are, then the sizes of the layers.
        let sizes = at + u64::from(format.len()) + 4;
        let layers = (0..layers).map(|layer| number(sizes + 4 * layer, Kind::U4));
        let size: u64 = layers.map(Option::unwrap_or_default).sum();
        if size > end {
            return Err(fault());
        }
        at = at.checked_add(table[chunk].byte_count).filter(|at| *at <= end).ok_or_else(fault)?;
    }
    Ok(())
}

/// Refuses extended records that reach beyond the file.
fn check_extended(bytes: &[u8]) -> Result<(), String> {
    let fault = || "a record behind its points reaches beyond the file".to_owned();
    let number = |at: usize, kind: Kind| {
        let bytes = bytes.get(at..).ok_or_else(fault)?;
        Ok::<_, String>(kind.read(bytes))
    };
    let count = number(243, Kind::U4)?;
    let mut at = number(235, Kind::U8)?;
    let mut seen = 0.0;
    while seen < count {
        let end = at + 60.0;
        if end > bytes.len() as f64 {
            return Err(fault());
        }
        at = end + number(at as usize + 20, Kind::U8)?;
        seen += 1.0;
    }
    if at > bytes.len() as f64 && count > 0.0 { Err(fault()) } else { Ok(()) }
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
    Ok(about)
}

/// Our attributes among the extra bytes.
fn extra(header: &Header) -> Vec<Extra> {
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
        let known = Attribute::ALL
            .into_iter()
            .find(|attribute| extra_name(*attribute).is_some_and(|known| known.as_bytes() == name));
        // Scaled dimensions are those of others.
        if let Some(attribute) = known.filter(|_| bytes[3] & 0b11000 == 0) {
            found.push(Extra { attribute, kind, offset });
        }
        offset += kind.size();
    }
    found
}

/// What the points of a file have. Fields that LAS always has are told apart by [`forget_blank`].
fn attributes(extra: &[Extra]) -> Vec<Attribute> {
    let always = [Attribute::Intensity, Attribute::ReturnNumber, Attribute::NumberOfReturns];
    let extra = extra.iter().map(|extra| extra.attribute);
    always.into_iter().chain([Attribute::TimeNs]).chain(extra).collect()
}

/// Empties columns that are 0 throughout: LAS has no other way to say that nothing is known.
fn forget_blank(cloud: &mut PointCloud, extra: &[Extra]) {
    let is_extra = extra.iter().any(|extra| extra.attribute == Attribute::Intensity);
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
    for Extra { attribute, kind, offset } in extra {
        let bytes = point.extra_bytes.get(*offset..).unwrap_or_default();
        record.set(at, *attribute, kind.read(bytes))?;
    }
    Ok(record)
}

#[cfg(test)]
mod tests {
    use super::super::{Names, las, sample_cloud};
    use super::*;

    fn parse(bytes: Vec<u8>) -> Result<(PointCloud, About), String> {
        super::parse(bytes, CloudRoom::default())
    }

    fn written(compress: bool) -> Vec<u8> {
        let mut bytes = Vec::new();
        las::write(&sample_cloud(), &Names::default(), compress, &mut bytes).unwrap();
        bytes
    }

    #[test]
    fn what_was_written_is_read() {
        let cloud = sample_cloud();
        for compress in [false, true] {
            let (read, about) = parse(written(compress)).unwrap();
            assert_eq!((read.scan, read.rows, read.columns), (3, 2, 3));
            assert_eq!(about.viewpoint, cloud.viewpoint);
            assert_eq!((&read.range, &read.intensity), (&cloud.range, &cloud.intensity));
            assert_eq!((&read.row, &read.column), (&cloud.row, &cloud.column));
            assert_eq!(read.truth.returns.outcome, cloud.truth.returns.outcome);
            for (read, written) in read.x.iter().zip(&cloud.x) {
                assert!((read - written).abs() <= 5e-7, "{read} {written}");
            }
        }
    }

    #[test]
    fn a_file_cut_short_is_refused() {
        let las = written(false);
        let told = parse(las[..las.len() - 1].to_vec()).unwrap_err();
        assert!(told.contains("ends after 4 of 5 points"), "{told}");
        assert!(parse(las[..100].to_vec()).unwrap_err().contains("cut short"));
        let laz = written(true);
        assert!(parse(laz[..laz.len() - 40].to_vec()).is_err());
        assert_eq!(parse(b"ply\n".to_vec()).unwrap_err(), "it does not begin with LASF");
    }

    #[test]
    fn absurd_sizes_are_refused_not_allocated() {
        let mut las = written(false);
        las[247..255].copy_from_slice(&u64::MAX.to_le_bytes());
        assert!(parse(las).unwrap_err().contains("points"));
        let mut las = written(false);
        las[96..100].copy_from_slice(&u32::MAX.to_le_bytes());
        assert!(parse(las).unwrap_err().contains("cut short"));
        let mut las = written(false);
        las[235..243].copy_from_slice(&100_u64.to_le_bytes());
        las[243..247].copy_from_slice(&u32::MAX.to_le_bytes());
        assert!(parse(las).unwrap_err().contains("beyond the file"));
    }
}

//! Points read from a file, put together to a cloud: from records of equal length, or one by one.

use super::about::{About, List};
use super::attributes::{Attribute, outcome_from_code};
use super::headings::Meaning;
use super::left_out::NoPoint;
use super::number::Kind;
use super::room::CloudRoom;
use crate::points::{NO_OBJECT, Outcome, PointCloud, SATURATED, Storage, Surface, Surfaces, Truth};
use std::collections::BTreeMap;

/// Pixels of a cloud at most, so that a file that lies about its size costs no memory: the most that a sensor
/// may have.
const MOST_PIXELS: usize = 1 << 25;

/// Rows and columns that 16 bits can number.
const MOST_ROWS: usize = 1 << 16;

/// Bytes of the longest record that is read.
const LONGEST_RECORD: usize = 1 << 20;

/// Place of one of our attributes in a record.
#[derive(Debug, Clone, Copy)]
struct Field {
    meaning: Meaning,
    kind: Kind,
    offset: usize,
}

/// How the records of a file are laid out.
#[derive(Debug, Default)]
pub(super) struct Layout {
    fields: Vec<Field>,
    /// Names of the fields that are no attribute of ours.
    pub unknown: Vec<String>,
    /// Set if the numbers were written as text, with the digits of that.
    is_text: bool,
    /// Bytes of a record.
    pub stride: usize,
}

impl Layout {
    /// For numbers that were written as text.
    pub fn of_text() -> Self {
        Self { is_text: true, ..Self::default() }
    }

    /// Adds `count` numbers behind those that are there. The attribute that the heading `name` stands
    /// for is read from them, if there is one.
    pub fn push(&mut self, name: &str, kind: Kind, count: usize) -> Result<(), String> {
        let meaning = Meaning::of_heading(name, Some(kind)).filter(|_| count == 1);
        self.place((name, meaning), kind, self.stride);
        let end = kind.size().checked_mul(count).and_then(|size| self.stride.checked_add(size));
        self.stride = end.ok_or("a record is beyond all bounds")?;
        Ok(())
    }

    /// Has the attribute that the field `name` stands for read from `offset`, and tells whether it
    /// is. The first field of an attribute counts; others and those without a meaning are unknown.
    pub fn place(
        &mut self,
        (name, meaning): (&str, Option<Meaning>),
        kind: Kind,
        offset: usize,
    ) -> bool {
        let meaning = meaning.filter(|meaning| !self.has(meaning.attribute));
        match meaning {
            Some(meaning) => self.fields.push(Field { meaning, kind, offset }),
            // Fields called `_` fill a gap.
            None if name != "_" => self.unknown.push(name.to_owned()),
            None => {}
        }
        meaning.is_some()
    }

    pub fn has(&self, attribute: Attribute) -> bool {
        self.fields.iter().any(|field| field.meaning.attribute == attribute)
    }

    fn attributes(&self) -> Vec<Attribute> {
        self.fields.iter().map(|field| field.meaning.attribute).collect()
    }

    /// The digits of the coordinates.
    fn digits(&self) -> Digits {
        if self.is_text {
            return Digits::AsWritten;
        }
        let is_single = |field: &Field| match field.kind {
            Kind::F4 | Kind::U1 | Kind::I1 | Kind::U2 | Kind::I2 => field.meaning.is_as_stored(),
            Kind::U4 | Kind::I4 | Kind::U8 | Kind::I8 | Kind::F8 => false,
        };
        let is_place = |field: &&Field| {
            matches!(field.meaning.attribute, Attribute::X | Attribute::Y | Attribute::Z)
        };
        match self.fields.iter().filter(is_place).all(is_single) {
            true => Digits::Single,
            false => Digits::Double,
        }
    }

    /// Refuses records without coordinates, and fields that reach beyond their record.
    pub fn check(&self) -> Result<(), String> {
        check_coordinates(&self.attributes())?;
        let beyond = |field: &&Field| {
            field.offset.checked_add(field.kind.size()).is_none_or(|end| end > self.stride)
        };
        match self.fields.iter().find(beyond) {
            Some(field) => {
                Err(format!("field `{}` ends beyond its point", field.meaning.attribute.name()))
            }
            None => Ok(()),
        }
    }

    /// Takes in `points` records, which `next` fills one after the other.
    fn each(
        &self,
        points: usize,
        next: Next,
        mut take: impl FnMut(usize, Record) -> Result<(), String>,
    ) -> Result<(), String> {
        if self.stride > LONGEST_RECORD {
            return Err(format!(
                "a point takes {} bytes; up to {LONGEST_RECORD} are read",
                self.stride
            ));
        }
        let mut bytes = vec![0; self.stride];
        for at in 0..points {
            if !next(&mut bytes)? {
                return Err(cut_short(at as u64, points as u64));
            }
            take(at, self.record(&bytes, at)?)?;
        }
        Ok(())
    }

    fn record(&self, bytes: &[u8], at: usize) -> Result<Record, String> {
        let mut record = Record::default();
        for Field { meaning, kind, offset } in &self.fields {
            let bytes = bytes.get(*offset..).unwrap_or_default();
            record.set(at, meaning.attribute, meaning.number(kind.read(bytes)))?;
        }
        Ok(record)
    }
}

/// The sentence about a file that ends after this many of its points.
pub(super) fn cut_short(whole: u64, points: u64) -> String {
    format!("it ends after {whole} of {points} points; the file was cut short")
}

/// Refuses a file that lacks a coordinate.
pub(super) fn check_coordinates(attributes: &[Attribute]) -> Result<(), String> {
    let needed = [Attribute::X, Attribute::Y, Attribute::Z];
    match needed.iter().find(|needed| !attributes.contains(needed)) {
        Some(lacking) => Err(format!("it has no field `{}`", lacking.name())),
        None => Ok(()),
    }
}

/// Fills a record with the next one of a file, and tells whether there is one.
pub(super) type Next<'a> = &'a mut dyn FnMut(&mut [u8]) -> Result<bool, String>;

/// The cloud of a list of `points` records, which `next` gives.
///
/// # Errors
/// If something is wrong with the records, or there are too few.
pub(super) fn list(
    about: &mut About,
    layout: &Layout,
    points: usize,
    next: Next,
) -> Result<PointCloud, String> {
    layout.check()?;
    let mut gathered = Gathered::new(about, &layout.attributes(), layout.digits())?;
    gathered.expect(points as u64)?;
    layout.each(points, next, |_, record| {
        gathered.add(record);
        Ok(())
    })?;
    layout.unknown.iter().for_each(|name| about.left_out.field(name));
    gathered.cloud(about)
}

/// The cloud of an image of rows × columns records, row by row. The place tells the pixel; a record
/// without x, y and z is a pixel that had no return.
///
/// # Errors
/// If something is wrong with the records, or there are too few.
pub(super) fn image(
    about: &mut About,
    layout: &Layout,
    [rows, columns]: [usize; 2],
    next: Next,
) -> Result<PointCloud, String> {
    let points = rows.checked_mul(columns).ok_or("WIDTH × HEIGHT is beyond all bounds")?;
    layout.check()?;
    if rows.max(columns) > MOST_ROWS {
        return Err(format!("it has {rows} × {columns} pixels; 65536 rows and columns are read"));
    }
    let mut attributes = layout.attributes();
    for place in [Attribute::Row, Attribute::Column] {
        if !layout.has(place) {
            attributes.push(place);
        }
    }
    let list = List { rows, columns, most: 1, pick: Default::default() };
    let mut gathered = Gathered::of_image(about, (&attributes, layout.digits()), list);
    gathered.expect(points as u64)?;
    layout.each(points, next, |at, mut record| {
        record.set(at, Attribute::Row, (at / columns) as f64)?;
        record.set(at, Attribute::Column, (at % columns) as f64)?;
        gathered.add_pixel(record);
        Ok(())
    })?;
    layout.unknown.iter().for_each(|name| about.left_out.field(name));
    Ok(gathered.finished(about))
}

/// Gives the records that lie one behind the other in `bytes`.
pub(super) fn records(mut bytes: &[u8]) -> impl FnMut(&mut [u8]) -> Result<bool, String> {
    move |record| {
        let Some((next, behind)) = bytes.split_at_checked(record.len()) else { return Ok(false) };
        record.copy_from_slice(next);
        bytes = behind;
        Ok(true)
    }
}

/// One point of a file: a return, or a pixel without one. An attribute that is not set is NaN, or 0
/// where it is a whole number.
#[derive(Debug, Clone, Copy)]
pub(super) struct Record([f64; Attribute::ALL.len()]);

impl Default for Record {
    fn default() -> Self {
        let mut record = Self([f64::NAN; Attribute::ALL.len()]);
        for object in [Attribute::Object, Attribute::Material] {
            record.0[object as usize] = NO_OBJECT.into();
        }
        record
    }
}

impl Record {
    /// Sets an attribute of point `at`.
    ///
    /// # Errors
    /// If the number is none that this attribute can have.
    pub fn set(&mut self, at: usize, attribute: Attribute, value: f64) -> Result<(), String> {
        let most = match attribute.storage() {
            // No object is no number.
            Storage::Count(_) if attribute.is_true() && value.is_nan() => return Ok(()),
            Storage::Count(_) => 65_535.0,
            Storage::Byte(_) | Storage::Code(_) => 255.0,
            _ => f64::INFINITY,
        };
        let name = attribute.name();
        if most.is_finite() && !((0.0..=most).contains(&value) && value.fract() == 0.0) {
            return Err(format!(
                "point {at} has the {name} {value}; whole numbers from 0 to {most} are read"
            ));
        }
        if attribute == Attribute::Outcome && outcome_from_code(value as u8).is_none() {
            let last = Outcome::ALL.len() - 1;
            return Err(format!("point {at} has the outcome {value}; known are 0 to {last}"));
        }
        self.0[attribute as usize] = value;
        Ok(())
    }

    fn get(&self, attribute: Attribute) -> f64 {
        self.0[attribute as usize]
    }

    fn position(&self) -> [f64; 3] {
        [Attribute::X, Attribute::Y, Attribute::Z].map(|place| self.get(place))
    }

    /// The truth beside it.
    fn surface(&self) -> Surface {
        Surface {
            range: self.get(Attribute::TrueRange) as f32,
            object: self.get(Attribute::Object) as u16,
            material: self.get(Attribute::Material) as u16,
            cosine: libm::cos(self.get(Attribute::Incidence)) as f32,
            outcome: outcome_from_code(self.get(Attribute::Outcome) as u8)
                .unwrap_or(Outcome::Empty),
        }
    }
}

/// How many digits the coordinates of a file have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Digits {
    /// Those of 32-bit floats.
    Single,
    /// More.
    Double,
    /// The digits that are written in a text.
    AsWritten,
}

/// A cloud that is being read.
pub(super) struct Gathered {
    cloud: PointCloud,
    /// Attributes of the points of the file.
    attributes: Vec<Attribute>,
    digits: Digits,
    is_of_driver: bool,
    room: CloudRoom,
    /// Set if there are more points than there is memory for.
    is_full: bool,
    /// Points that are none.
    dropped: BTreeMap<NoPoint, u64>,
    /// The image of the list, and whether its size is still to be found.
    list: Option<List>,
    find_size: bool,
}

impl Gathered {
    /// A list of points with these `attributes`. If the file does not tell the size of the image, it is that
    /// of the highest row and column; a list without them has no image.
    ///
    /// # Errors
    /// If the image is larger than any sensor's.
    pub fn new(about: &About, attributes: &[Attribute], digits: Digits) -> Result<Self, String> {
        let has = |attribute| attributes.contains(&attribute);
        let has_pixels = has(Attribute::Row) && has(Attribute::Column);
        // The size of an image says nothing of points without pixels.
        let list = about.list.filter(|_| has_pixels);
        if let Some(List { rows, columns, .. }) = list
            && rows.checked_mul(columns).is_none_or(|pixels| pixels > MOST_PIXELS)
        {
            return Err("its list has more pixels than any sensor".to_owned());
        }
        let gathered = Self::of_image(about, (attributes, digits), list.unwrap_or_default());
        Ok(Self { list, find_size: list.is_none() && has_pixels, ..gathered })
    }

    fn of_image(about: &About, (attributes, digits): (&[Attribute], Digits), list: List) -> Self {
        let cloud = PointCloud {
            scan: about.scan,
            stamp_ns: about.stamp_ns,
            viewpoint: about.viewpoint,
            rows: list.rows,
            columns: list.columns,
            returns_per_shot: list.most.max(1),
            pick: list.pick,
            ..PointCloud::default()
        };
        let has_row = attributes.contains(&Attribute::Row);
        let mut unique = vec![Attribute::X, Attribute::Y, Attribute::Z];
        for &attribute in attributes {
            // The ring is the row; where both are there, the row counts.
            let is_row = attribute == Attribute::Ring && has_row;
            if !is_row && !unique.contains(&attribute) {
                unique.push(attribute);
            }
        }
        let About { is_of_driver, room, .. } = *about;
        let dropped = BTreeMap::new();
        Self {
            cloud,
            attributes: unique,
            digits,
            is_of_driver,
            room,
            is_full: false,
            dropped,
            list: None,
            find_size: false,
        }
    }

    fn has(&self, attribute: Attribute) -> bool {
        self.attributes.contains(&attribute)
    }

    /// Refuses a file with this number of points if they take more memory than allowed.
    ///
    /// # Errors
    /// A sentence, if they do.
    pub fn expect(&self, points: u64) -> Result<(), String> {
        self.room.check(points)
    }

    /// Why a record is no return, if it is none.
    fn fault(&self, record: &Record) -> Option<NoPoint> {
        let position = record.position();
        let range = if self.has(Attribute::Range) { record.get(Attribute::Range) } else { 0.0 };
        // A number that a 32-bit float cannot hold is no length.
        let is_finite = |length: f64| (length as f32).is_finite();
        if !position.iter().copied().chain([range]).all(is_finite) {
            return Some(NoPoint::NotFinite);
        }
        (self.is_of_driver && position == [0.0; 3]).then_some(NoPoint::AtOrigin)
    }

    /// Counts a point that is none.
    pub fn drop_point(&mut self, why: NoPoint) {
        *self.dropped.entry(why).or_default() += 1;
    }

    /// Adds a point, or counts it where it is none.
    pub fn add(&mut self, record: Record) {
        match self.fault(&record) {
            Some(why) => self.drop_point(why),
            None => self.push(&record),
        }
    }

    fn push(&mut self, record: &Record) {
        // A file that does not tell how many points it has may have too many.
        if self.is_full {
            return;
        }
        let cloud = &mut self.cloud;
        self.is_full = self.room.check(cloud.x.len() as u64 + 1).is_err();
        for &attribute in &self.attributes {
            let value = record.get(attribute);
            match attribute.storage() {
                Storage::Code(_) => cloud.truth.returns.push(record.surface()),
                // The truth is added with the outcome.
                _ if attribute.comes_with_truth() => {}
                Storage::Length(single, exact) => {
                    single.of_mut(cloud).push(value as f32);
                    if self.digits != Digits::Single || attribute == Attribute::Range {
                        exact.of_mut(cloud).push(value);
                    }
                }
                Storage::Real(field) | Storage::Cosine(field) => {
                    field.of_mut(cloud).push(value as f32);
                }
                Storage::Time(field) => field.of_mut(cloud).push(value),
                Storage::Byte(field) => field.of_mut(cloud).push(value as u8),
                Storage::Count(field) => field.of_mut(cloud).push(value as u16),
                // The others follow from the columns beside them, and not every writer's are ours.
                Storage::Bit(field) => field.of_mut(cloud).push(value as u8 & SATURATED != 0),
            }
        }
    }

    /// Adds the pixel of an image, and what stands beside it.
    fn add_pixel(&mut self, record: Record) {
        let fault = self.fault(&record);
        // A pixel without coordinates is one that had no return.
        if fault == Some(NoPoint::AtOrigin) {
            self.drop_point(NoPoint::AtOrigin);
        }
        if self.has(Attribute::TimeNs) {
            self.cloud.fired_ns.push(record.get(Attribute::TimeNs));
        }
        if self.has(Attribute::Outcome) {
            let surface = record.surface();
            self.cloud.truth.pixels.push(match fault {
                None => Surface { outcome: surface.outcome, ..Surface::NONE },
                Some(_) => surface,
            });
        }
        if fault.is_none() {
            self.push(&record);
        }
    }

    /// The list, with its image. It says nothing of pixels without a return; for each other pixel it has the
    /// return that the pixel shows.
    ///
    /// # Errors
    /// If there is not the memory for all points.
    pub fn cloud(mut self, about: &mut About) -> Result<PointCloud, String> {
        if self.is_full {
            self.room.check(self.cloud.x.len() as u64)?;
        }
        let has_truth = self.has(Attribute::Outcome);
        let cloud = &mut self.cloud;
        let most = |numbers: &[u8]| numbers.iter().copied().max().unwrap_or(1).max(1);
        if self.list.is_none() {
            cloud.returns_per_shot = most(&cloud.number_of_returns).max(most(&cloud.return_number));
        }
        if self.find_size {
            let size = |place: &[u16]| place.iter().max().map_or(0, |most| usize::from(*most) + 1);
            (cloud.rows, cloud.columns) = (size(&cloud.row), size(&cloud.column));
            if cloud.rows * cloud.columns > MOST_PIXELS {
                (cloud.rows, cloud.columns) = (0, 0);
            }
        }
        let image = cloud.image(cloud.pick);
        if !cloud.time_ns.is_empty() {
            cloud.fired_ns = image.spread(&cloud.time_ns, f64::NAN);
        }
        let returns = std::mem::take(&mut cloud.truth.returns);
        if has_truth {
            let mut pixels = Surfaces::default();
            for at in image.iter() {
                let outcome = at.map_or(Outcome::Empty, |at| returns.outcome[at]);
                pixels.push(Surface { outcome, ..Surface::NONE });
            }
            let radial_velocity = std::mem::take(&mut cloud.truth.radial_velocity);
            cloud.truth = Truth { returns, pixels, radial_velocity };
        }
        Ok(self.finished(about))
    }

    /// The cloud, with columns of 64 bits only where they have more digits. Points that were dropped are
    /// told to `about`.
    fn finished(mut self, about: &mut About) -> PointCloud {
        for (why, count) in &self.dropped {
            about.left_out.drop_points(*why, *count);
        }
        let exact = &mut self.cloud.exact;
        let coordinates = [&exact.x, &exact.y, &exact.z];
        if self.digits == Digits::AsWritten && coordinates.into_iter().all(|all| is_single(all)) {
            (exact.x, exact.y, exact.z) = Default::default();
        }
        if is_single(&exact.range) {
            exact.range = Vec::new();
        }
        self.cloud
    }
}

/// Tells if 32-bit floats, as written, have the digits of all `values`.
fn is_single(values: &[f64]) -> bool {
    let mut buffer = zmij::Buffer::new();
    values.iter().all(|&value| {
        let single = value as f32;
        f64::from(single) == value || buffer.format(single).parse() == Ok(value)
    })
}

//! Points read from a file, put together to a cloud: from records of equal length, or one by one.

use super::about::{About, List};
use super::attributes::{Attribute, outcome_from_code};
use super::number::Kind;
use crate::points::{NO_OBJECT, Outcome, PointCloud, SATURATED, Surface, Surfaces, Truth};

/// Pixels that a cloud is given at most, so that a file that lies about its size costs no memory: as
/// many as a sensor may have.
const MOST_PIXELS: usize = 1 << 25;

/// Rows and columns that 16 bits can number.
const MOST_ROWS: usize = 1 << 16;

/// Where one of our attributes lies in a record.
#[derive(Debug, Clone, Copy)]
struct Field {
    attribute: Attribute,
    kind: Kind,
    offset: usize,
    /// What the stored number is multiplied by.
    scale: f64,
}

/// How the records of a file are laid out.
#[derive(Debug, Default)]
pub(super) struct Layout {
    fields: Vec<Field>,
    /// Bytes of a record.
    pub stride: usize,
}

impl Layout {
    /// Adds `count` numbers behind those that are there. The attribute that is called `name` is read
    /// from them, if there is one.
    pub fn push(&mut self, name: &str, kind: Kind, count: usize) -> Result<(), String> {
        let attribute = Attribute::named(name).filter(|_| count == 1);
        self.place(attribute.map(|attribute| (attribute, 1.0)), kind, self.stride);
        let end = kind.size().checked_mul(count).and_then(|size| self.stride.checked_add(size));
        self.stride = end.ok_or("a record is beyond all bounds")?;
        Ok(())
    }

    /// Has an attribute read from `offset`, with the scale of the number that is stored there. The
    /// first field of an attribute counts.
    pub fn place(&mut self, what: Option<(Attribute, f64)>, kind: Kind, offset: usize) {
        let Some((attribute, scale)) = what else { return };
        if !self.has(attribute) {
            self.fields.push(Field { attribute, kind, offset, scale });
        }
    }

    pub fn has(&self, attribute: Attribute) -> bool {
        self.fields.iter().any(|field| field.attribute == attribute)
    }

    fn attributes(&self) -> Vec<Attribute> {
        self.fields.iter().map(|field| field.attribute).collect()
    }

    /// Refuses records without coordinates, and fields that reach beyond their record.
    pub fn check(&self) -> Result<(), String> {
        check_coordinates(&self.attributes())?;
        let beyond = |field: &&Field| {
            field.offset.checked_add(field.kind.size()).is_none_or(|end| end > self.stride)
        };
        match self.fields.iter().find(beyond) {
            Some(field) => Err(format!("field `{}` ends beyond its point", field.attribute.name())),
            None => Ok(()),
        }
    }

    fn record(&self, bytes: &[u8], at: usize) -> Result<Record, String> {
        let mut record = Record::default();
        for field in &self.fields {
            let bytes = bytes.get(field.offset..).unwrap_or_default();
            record.set(at, field.attribute, field.kind.read(bytes) * field.scale)?;
        }
        Ok(record)
    }
}

/// Refuses a file that lacks a coordinate.
pub(super) fn check_coordinates(attributes: &[Attribute]) -> Result<(), String> {
    let needed = [Attribute::X, Attribute::Y, Attribute::Z];
    match needed.iter().find(|needed| !attributes.contains(needed)) {
        Some(lacking) => Err(format!("it has no field `{}`", lacking.name())),
        None => Ok(()),
    }
}

/// The cloud of a list of `points` records.
///
/// # Errors
/// What is wrong with the records, or that there are too few.
pub(super) fn list(
    about: &About,
    layout: &Layout,
    body: &[u8],
    points: usize,
) -> Result<PointCloud, String> {
    let body = records(layout, body, points)?;
    let mut gathered = Gathered::new(about, &layout.attributes())?;
    for (at, bytes) in body.chunks_exact(layout.stride).enumerate() {
        gathered.add(layout.record(bytes, at)?);
    }
    gathered.cloud()
}

/// The cloud of an image of rows × columns records, row by row. The place tells the pixel; a record
/// without x, y and z is a pixel that had no return.
///
/// # Errors
/// What is wrong with the records, or that there are too few.
pub(super) fn image(
    about: &About,
    layout: &Layout,
    body: &[u8],
    [rows, columns]: [usize; 2],
) -> Result<PointCloud, String> {
    let points = rows.checked_mul(columns).ok_or("WIDTH × HEIGHT is beyond all bounds")?;
    let body = records(layout, body, points)?;
    if rows.max(columns) > MOST_ROWS {
        return Err(format!("it has {rows} × {columns} pixels; 65536 rows and columns are read"));
    }
    let list = List { rows, columns, most: 1, pick: Default::default() };
    let mut gathered = Gathered::of_image(about, &layout.attributes(), list);
    for (at, bytes) in body.chunks_exact(layout.stride).enumerate() {
        let mut record = layout.record(bytes, at)?;
        record.pixel = [Some((at / columns) as u16), Some((at % columns) as u16)];
        record.number = [1, 1];
        gathered.cloud.fired_ns.push(record.time_ns);
        gathered.cloud.truth.pixels.push(record.of_pixel());
        gathered.add(record);
    }
    if !gathered.has_truth {
        gathered.cloud.truth = Truth::default();
    }
    Ok(gathered.cloud)
}

/// The bytes of `points` whole records.
fn records<'a>(layout: &Layout, body: &'a [u8], points: usize) -> Result<&'a [u8], String> {
    layout.check()?;
    let needed = points.checked_mul(layout.stride).ok_or("the points are beyond all bounds")?;
    body.get(..needed).ok_or_else(|| {
        let whole = body.len() / layout.stride;
        format!("it ends after {whole} of {points} points; the file was cut short")
    })
}

/// One point of a file: a return, or a pixel without one.
#[derive(Debug, Clone, Copy)]
pub(super) struct Record {
    position: [f32; 3],
    intensity: f32,
    range: Option<f32>,
    time_ns: f64,
    /// Row and column, where the file has them.
    pixel: [Option<u16>; 2],
    ring: Option<u16>,
    number: [u8; 2],
    peak: u16,
    marks: u16,
    margin: u16,
    saturated: bool,
    surface: Surface,
}

impl Default for Record {
    /// What a file says of a point that has no attribute at all.
    fn default() -> Self {
        Self {
            position: [f32::NAN; 3],
            intensity: f32::NAN,
            range: None,
            time_ns: 0.0,
            pixel: [None; 2],
            ring: None,
            number: [1; 2],
            peak: 0,
            marks: 0,
            margin: 0,
            saturated: false,
            surface: Surface::NONE,
        }
    }
}

impl Record {
    /// Sets an attribute of point `at`.
    ///
    /// # Errors
    /// If the number is none that this attribute can have.
    pub fn set(&mut self, at: usize, attribute: Attribute, value: f64) -> Result<(), String> {
        let small = |most: f64| {
            if (0.0..=most).contains(&value) && value.fract() == 0.0 {
                return Ok(value);
            }
            let name = attribute.name();
            Err(format!(
                "point {at} has the {name} {value}; whole numbers from 0 to {most} are read"
            ))
        };
        let short = || small(65_535.0).map(|value| value as u16);
        let byte = || small(255.0).map(|value| value as u8);
        let name = || if value.is_nan() { Ok(NO_OBJECT) } else { short() };
        match attribute {
            Attribute::X => self.position[0] = value as f32,
            Attribute::Y => self.position[1] = value as f32,
            Attribute::Z => self.position[2] = value as f32,
            Attribute::Intensity => self.intensity = value as f32,
            Attribute::Range => self.range = Some(value as f32),
            Attribute::TimeNs => self.time_ns = value,
            Attribute::Row => self.pixel[0] = Some(short()?),
            Attribute::Column => self.pixel[1] = Some(short()?),
            Attribute::Ring => self.ring = Some(short()?),
            Attribute::ReturnNumber => self.number[0] = byte()?,
            Attribute::NumberOfReturns => self.number[1] = byte()?,
            Attribute::Peak => self.peak = short()?,
            Attribute::Marks => self.marks = short()?,
            Attribute::Margin => self.margin = short()?,
            // The others follow from the columns beside them, and not every writer's are ours.
            Attribute::Flags => self.saturated = value as u64 & u64::from(SATURATED) != 0,
            Attribute::TrueRange => self.surface.range = value as f32,
            Attribute::Object => self.surface.object = name()?,
            Attribute::Material => self.surface.material = name()?,
            Attribute::Incidence => self.surface.cosine = libm::cos(value) as f32,
            Attribute::Outcome => {
                let code = byte()?;
                self.surface.outcome = outcome_from_code(code).ok_or_else(|| {
                    format!("point {at} has the outcome {code}; known are 0 to 5")
                })?;
            }
        }
        Ok(())
    }

    /// The range, or the length of (x, y, z) where the file has none.
    fn range(&self) -> f32 {
        let [x, y, z] = self.position;
        self.range.unwrap_or_else(|| x.hypot(y).hypot(z))
    }

    /// Whether it is a return, and no pixel without one.
    fn is_return(&self) -> bool {
        self.range().is_finite() && self.position.iter().all(|place| place.is_finite())
    }

    /// What stands beside its pixel.
    fn of_pixel(&self) -> Surface {
        match self.is_return() {
            true => Surface { outcome: self.surface.outcome, ..Surface::NONE },
            false => self.surface,
        }
    }
}

/// A cloud that is being read.
pub(super) struct Gathered {
    cloud: PointCloud,
    has_truth: bool,
    /// Whether the list has an image, and whether its size is still to be found.
    list: Option<List>,
    find_size: bool,
}

impl Gathered {
    /// A list of points that have these `attributes`. Where the file does not tell the size of the
    /// image, it is that of the highest row and column; a list without them has no image.
    ///
    /// # Errors
    /// If the image is larger than any sensor's.
    pub fn new(about: &About, attributes: &[Attribute]) -> Result<Self, String> {
        let has = |attribute| attributes.contains(&attribute);
        let find_size = about.list.is_none() && has(Attribute::Row) && has(Attribute::Column);
        if let Some(List { rows, columns, .. }) = about.list
            && rows.checked_mul(columns).is_none_or(|pixels| pixels > MOST_PIXELS)
        {
            return Err("its list has more pixels than any sensor".to_owned());
        }
        let gathered = Self::of_image(about, attributes, about.list.unwrap_or_default());
        Ok(Self { list: about.list, find_size, ..gathered })
    }

    fn of_image(about: &About, attributes: &[Attribute], list: List) -> Self {
        let cloud = PointCloud {
            scan: about.scan,
            viewpoint: about.viewpoint,
            rows: list.rows,
            columns: list.columns,
            returns_per_shot: list.most.max(1),
            pick: list.pick,
            ..PointCloud::default()
        };
        let has_truth = attributes.contains(&Attribute::Outcome);
        Self { cloud, has_truth, list: None, find_size: false }
    }

    /// Adds a point, unless it is a pixel without a return.
    pub fn add(&mut self, record: Record) {
        if !record.is_return() {
            return;
        }
        let cloud = &mut self.cloud;
        let [x, y, z] = record.position;
        cloud.x.push(x);
        cloud.y.push(y);
        cloud.z.push(z);
        cloud.intensity.push(record.intensity);
        cloud.range.push(record.range());
        cloud.time_ns.push(record.time_ns);
        let ([row, column], [number, of]) = (record.pixel, record.number);
        cloud.row.push(row.or(record.ring).unwrap_or(0));
        cloud.column.push(column.unwrap_or(0));
        cloud.return_number.push(number);
        cloud.number_of_returns.push(of);
        cloud.peak.push(record.peak);
        cloud.marks.push(record.marks);
        cloud.margin.push(record.margin);
        cloud.photons.push(f32::NAN);
        cloud.saturated.push(record.saturated);
        cloud.truth.returns.push(record.surface);
    }

    /// The list, with the image that it has. Of the pixels without a return it says nothing, of the
    /// others what it says of the return they show.
    ///
    /// # Errors
    /// If the highest row and column make an image that is larger than any sensor's.
    pub fn cloud(mut self) -> Result<PointCloud, String> {
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
        let fired = |at: Option<usize>| at.map_or(f64::NAN, |at| cloud.time_ns[at]);
        cloud.fired_ns = image.iter().map(fired).collect();
        let returns = std::mem::take(&mut cloud.truth.returns);
        if self.has_truth {
            let mut pixels = Surfaces::default();
            for at in image.iter() {
                let outcome = at.map_or(Outcome::Empty, |at| returns.outcome[at]);
                pixels.push(Surface { outcome, ..Surface::NONE });
            }
            cloud.truth = Truth { returns, pixels };
        }
        Ok(self.cloud)
    }
}

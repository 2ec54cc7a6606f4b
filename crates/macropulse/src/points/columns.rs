//! The attributes of a point, declared once: one table, from which the cloud, the formats, the Python
//! package and the page of clouds take theirs.
//!
//! Most attributes are a column of the cloud. The others follow from columns: the ring, the flags, the
//! angle of incidence, the number of an outcome. A new attribute is an entry here, a column of
//! [`PointCloud`] and a row of docs/formats.md. It is absent in a cloud whose column is empty.

use super::{Image, NO_OBJECT, Outcome, Piece, PointCloud};
use Storage::{Bit, Byte, Code, Cosine, Count, Length, Real, Time};
use std::borrow::Cow;

/// A field: what stands for no value, the column of the returns and, if there is one, that of the
/// pixels.
macro_rules! field {
    ($none:expr, $($returns:ident).+) => {
        Field { none: $none, returns: column!($($returns).+), pixels: None }
    };
    ($none:expr, $($returns:ident).+, $($pixels:ident).+) => {
        Field { pixels: Some(column!($($pixels).+)), ..field!($none, $($returns).+) }
    };
}

/// A column by its path in the cloud.
macro_rules! column {
    ($first:ident $(. $next:ident)*) => {
        Column {
            name: concat!(stringify!($first) $(, ".", stringify!($next))*),
            of: |cloud| &cloud.$first$(.$next)*,
            of_mut: |cloud| &mut cloud.$first$(.$next)*,
        }
    };
}

/// The enum of the attributes, and the table of what is declared of each.
macro_rules! attributes {
    ($($(#[doc = $about:literal])+ $name:ident = $origin:ident($($declared:expr),+ $(,)?);)+) => {
        /// An attribute of a point, in the order of the files, the truth at the end.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub enum Attribute {
            $($(#[doc = $about])+ $name,)+
        }

        impl Attribute {
            /// All attributes.
            pub const ALL: [Self; [$(Self::$name),+].len()] = [$(Self::$name),+];
        }

        static TABLE: [Entry; Attribute::ALL.len()] =
            [$($origin(concat!($($about),+), $($declared),+)),+];
    };
}

attributes! {
    /// Forward, m.
    X = measured("x", "m", Length(field!(f32::NAN, x), field!(f64::NAN, exact.x)));
    /// Left, m.
    Y = measured("y", "m", Length(field!(f32::NAN, y), field!(f64::NAN, exact.y)));
    /// Up, m.
    Z = measured("z", "m", Length(field!(f32::NAN, z), field!(f64::NAN, exact.z)));
    /// Apparent reflectance: 1 is a white surface that faces the sensor. A detector that counts marks
    /// and measures no amplitude cannot tell bright from brighter: where `peak` equals `marks` this is
    /// a lower bound, and of near surfaces far too low. All are 1 if it never misses a mark.
    Intensity = measured("intensity", "", Real(field!(f32::NAN, intensity)));
    /// One-way range, m. For a cloud that has none stands the distance of each point from the origin.
    Range = measured("range", "m", Length(field!(f32::NAN, range), field!(f64::NAN, exact.range)));
    /// Time at which the shot was fired, ns from the beginning of the first scan.
    TimeNs = measured("time_ns", "ns", Time(field!(f64::NAN, time_ns, fired_ns)));
    /// Row of the pixel, 0 at the top.
    Row = measured("row", "", Count(field!(0, row)));
    /// Column of the pixel, 0 at the left.
    Column = measured("column", "", Count(field!(0, column)));
    /// The row, as drivers of lidars call it.
    Ring = measured("ring", "", Count(field!(0, row)));
    /// Marks found at their place.
    Peak = measured("peak", "", Count(field!(0, peak)));
    /// Marks that the macropulse has.
    Marks = measured("marks", "", Count(field!(0, marks)));
    /// Peak minus the best other lag that the receiver looked at.
    Margin = measured("margin", "", Count(field!(0, margin)));
    /// Number among the returns of the shot, from 1, the nearest first.
    ReturnNumber = measured("return_number", "", Byte(field!(0, return_number)));
    /// Returns of the shot.
    NumberOfReturns = measured("number_of_returns", "", Byte(field!(0, number_of_returns)));
    /// Bits: 1 if fewer than half of its marks were found, 2 if another lag had the same number of marks, 4
    /// if the intensity is a lower bound. It is one if no mark was missed and no amplitude is measured.
    Flags = measured("flags", "", Bit(field!(false, saturated)));
    /// Radial velocity, m/s, positive of a surface that approaches; of sensors that measure it.
    RadialVelocity = measured("radial_velocity", "m/s", Real(field!(f32::NAN, radial_velocity)));
    /// Energy as the receiver can tell it, in detected photons per mark; files do not have it.
    Photons = measured("photons", "", Real(field!(f32::NAN, photons)));
    /// Truth: range of the surface that the return came from, or else of the first one along the
    /// beam, m; NaN where there is none.
    TrueRange = truth(
        "true_range", "m", Real(field!(f32::NAN, truth.returns.range, truth.pixels.range)),
    );
    /// Truth: index of the object in `objects`; 65535 where there is none.
    Object = truth(
        "object", "", Count(field!(NO_OBJECT, truth.returns.object, truth.pixels.object)),
    );
    /// Truth: index of the material in `materials`; 65535 where there is none.
    Material = truth(
        "material", "", Count(field!(NO_OBJECT, truth.returns.material, truth.pixels.material)),
    );
    /// Truth: angle of incidence, rad; NaN where there is no surface.
    Incidence = truth(
        "incidence", "rad", Cosine(field!(f32::NAN, truth.returns.cosine, truth.pixels.cosine)),
    );
    /// Truth: radial velocity of the surface, m/s, positive where it approaches; of sensors that measure it.
    TrueRadialVelocity = truth(
        "true_radial_velocity", "m/s", Real(field!(f32::NAN, truth.radial_velocity)),
    );
    /// Truth: how the return came out, an index into `OUTCOMES`: 1 right, 2 near, 3 wrong, 5
    /// false, 6 edge.
    Outcome = truth(
        "outcome", "", Code(field!(Outcome::Empty, truth.returns.outcome, truth.pixels.outcome)),
    );
}

/// The declaration of an attribute.
struct Entry {
    about: Text,
    name: Text,
    unit: Text,
    is_true: bool,
    storage: Storage,
}

type Text = &'static str;

const fn measured(about: Text, name: Text, unit: Text, storage: Storage) -> Entry {
    Entry { about, name, unit, is_true: false, storage }
}

const fn truth(about: Text, name: Text, unit: Text, storage: Storage) -> Entry {
    Entry { about, name, unit, is_true: true, storage }
}

/// The columns that an attribute is stored in, by the type of their entries, and how its values follow
/// from them.
pub(crate) enum Storage {
    /// Rounded to 32 bits, and with all digits where there are more.
    Length(Field<f32>, Field<f64>),
    Real(Field<f32>),
    Time(Field<f64>),
    Byte(Field<u8>),
    Count(Field<u16>),
    /// [`SATURATED`](super::SATURATED), a bit of [`PointCloud::flags`].
    Bit(Field<bool>),
    /// The cosine of the angle.
    Cosine(Field<f32>),
    /// The outcome that the number stands for.
    Code(Field<Outcome>),
}

/// The same of each return and, if it is stored, of each pixel.
pub(crate) struct Field<T: 'static> {
    /// Stands for no value.
    pub none: T,
    returns: Column<T>,
    pixels: Option<Column<T>>,
}

/// A column of a cloud.
#[derive(Clone, Copy)]
struct Column<T: 'static> {
    /// Its path in the cloud.
    name: Text,
    of: fn(&PointCloud) -> &Vec<T>,
    of_mut: fn(&mut PointCloud) -> &mut Vec<T>,
}

/// How many entries a column has, and how many it must have if it is there.
pub(crate) struct Extent {
    /// Path of the column in the cloud.
    pub name: Text,
    pub found: usize,
    pub needed: usize,
    /// Name of the things that have an entry each.
    pub of: Text,
    /// The columns it is there together with, if it is not there by itself.
    pub group: Option<Group>,
}

/// Columns that are all there, or none of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Group {
    Coordinates,
    ExactCoordinates,
    Truth,
}

/// Operations on a field, whatever the type of its entries.
pub(super) trait Columns: Sync {
    /// The extents of its columns in `cloud`.
    fn extents(&self, cloud: &PointCloud, group: Option<Group>) -> Vec<Extent>;

    /// Empties its columns, and keeps their memory.
    fn clear(&self, cloud: &mut PointCloud);

    /// Makes its columns of a scan with this number of pixels: the returns of the `pieces` behind each
    /// other, the pixels at their places. The result puts them into the cloud.
    fn joined<'a>(&'a self, pieces: &[Piece], pixels: usize) -> Joined<'a>;
}

/// Puts columns into a cloud.
pub(super) type Joined<'a> = Box<dyn FnOnce(&mut PointCloud) + Send + 'a>;

impl<T: Copy + Send + Sync> Columns for Field<T> {
    fn extents(&self, cloud: &PointCloud, group: Option<Group>) -> Vec<Extent> {
        let extent = |column: Column<T>, needed: usize, of| Extent {
            name: column.name,
            found: (column.of)(cloud).len(),
            needed,
            of,
            group,
        };
        let pixels = self
            .pixels
            .map(|column| extent(column, cloud.rows.saturating_mul(cloud.columns), "pixels"));
        [extent(self.returns, cloud.returns(), "returns")].into_iter().chain(pixels).collect()
    }

    fn clear(&self, cloud: &mut PointCloud) {
        for column in [self.returns].into_iter().chain(self.pixels) {
            (column.of_mut)(cloud).clear();
        }
    }

    fn joined<'a>(&'a self, pieces: &[Piece], pixels: usize) -> Joined<'a> {
        let of = |piece| (self.returns.of)(piece);
        let mut list = Vec::with_capacity(pieces.iter().map(|piece| of(&piece.points).len()).sum());
        pieces.iter().for_each(|piece| list.extend_from_slice(of(&piece.points)));
        let image = self.pixels.map(|column| {
            let mut image = vec![self.none; pixels];
            pieces.iter().for_each(|piece| piece.scatter((column.of)(&piece.points), &mut image));
            (column, image)
        });
        Box::new(move |cloud| {
            *(self.returns.of_mut)(cloud) = list;
            if let Some((column, image)) = image {
                *(column.of_mut)(cloud) = image;
            }
        })
    }
}

impl<T: Copy> Field<T> {
    /// The column of the returns.
    pub fn of<'a>(&self, cloud: &'a PointCloud) -> &'a [T] {
        (self.returns.of)(cloud)
    }

    /// The column of the pixels; empty if there is none.
    pub fn pixels<'a>(&self, cloud: &'a PointCloud) -> &'a [T] {
        self.pixels.map_or(&[], |column| (column.of)(cloud))
    }

    /// The column of the returns, to add to.
    pub fn of_mut<'a>(&self, cloud: &'a mut PointCloud) -> &'a mut Vec<T> {
        (self.returns.of_mut)(cloud)
    }

    /// The entries of all returns or, in an `image`, of all pixels: that of the return which is shown,
    /// else that of the pixel itself.
    fn entries<'a>(&self, cloud: &'a PointCloud, image: Option<&Image>) -> Cow<'a, [T]> {
        let (returns, pixels) = (self.of(cloud), self.pixels(cloud));
        let entry = |(pixel, at): (usize, Option<usize>)| {
            let entry = at.map_or_else(|| pixels.get(pixel), |at| returns.get(at));
            entry.copied().unwrap_or(self.none)
        };
        match image {
            Some(image) => image.iter().enumerate().map(entry).collect(),
            None => Cow::Borrowed(returns),
        }
    }
}

impl Storage {
    fn fields(&self) -> impl Iterator<Item = &dyn Columns> {
        let fields: [Option<&dyn Columns>; 2] = match self {
            Length(single, exact) => [Some(single), Some(exact)],
            Real(field) | Cosine(field) => [Some(field), None],
            Time(field) => [Some(field), None],
            Byte(field) => [Some(field), None],
            Count(field) => [Some(field), None],
            Bit(field) => [Some(field), None],
            Code(field) => [Some(field), None],
        };
        fields.into_iter().flatten()
    }
}

/// The values of an attribute: lent by the cloud, or computed.
#[derive(Debug, Clone, PartialEq)]
pub enum Entries<'a> {
    /// Real numbers of four bytes.
    F4(Cow<'a, [f32]>),
    /// Real numbers of eight bytes.
    F8(Cow<'a, [f64]>),
    /// Whole numbers of one byte.
    U1(Cow<'a, [u8]>),
    /// Whole numbers of two bytes.
    U2(Cow<'a, [u16]>),
}

impl Entries<'_> {
    /// The value at this place; NaN where there is none.
    pub fn number(&self, at: usize) -> f64 {
        let number = match self {
            Self::F4(values) => values.get(at).copied().map(f64::from),
            Self::F8(values) => values.get(at).copied(),
            Self::U1(values) => values.get(at).copied().map(f64::from),
            Self::U2(values) => values.get(at).copied().map(f64::from),
        };
        number.unwrap_or(f64::NAN)
    }

    /// The same in memory of their own.
    pub fn into_owned(self) -> Entries<'static> {
        match self {
            Self::F4(values) => Entries::F4(values.into_owned().into()),
            Self::F8(values) => Entries::F8(values.into_owned().into()),
            Self::U1(values) => Entries::U1(values.into_owned().into()),
            Self::U2(values) => Entries::U2(values.into_owned().into()),
        }
    }
}

impl Attribute {
    fn entry(self) -> &'static Entry {
        &TABLE[self as usize]
    }

    /// Name in binary files and in Python.
    pub fn name(self) -> &'static str {
        self.entry().name
    }

    /// Unit, as it is written behind numbers; nothing where there is none.
    pub fn unit(self) -> &'static str {
        self.entry().unit
    }

    /// Its description, in a sentence or two.
    pub fn about(self) -> &'static str {
        self.entry().about.trim_start()
    }

    /// Returns true if it is known from the scene alone.
    pub fn is_true(self) -> bool {
        self.entry().is_true
    }

    /// Returns true if every cloud with a truth has it: all true attributes but the one that only some
    /// sensors measure.
    pub(crate) fn comes_with_truth(self) -> bool {
        self.is_true() && self != Self::TrueRadialVelocity
    }

    /// Returns true if its values are computed from columns when they are asked for.
    pub fn is_computed(self) -> bool {
        matches!(self.storage(), Bit(_) | Cosine(_) | Code(_))
    }

    /// The attributes that files have.
    pub fn in_files() -> impl Iterator<Item = Self> {
        Self::ALL.into_iter().filter(|attribute| *attribute != Self::Photons)
    }

    /// The attribute of this name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|attribute| attribute.name() == name)
    }

    /// Returns true if `cloud` has it.
    pub fn is_in(self, cloud: &PointCloud) -> bool {
        let has = |attribute: Self| {
            attribute.extents(cloud).first().is_some_and(|column| cloud.has(column.found))
        };
        match self {
            // A row without a column is the ring of a driver.
            Self::Row => has(self) && has(Self::Column),
            Self::Flags => has(self) || has(Self::Marks),
            Self::RadialVelocity | Self::TrueRadialVelocity if cloud.returns() == 0 => {
                cloud.has_speeds && (!self.is_true() || cloud.has_truth())
            }
            _ if self.comes_with_truth() => cloud.has_truth(),
            _ => has(self),
        }
    }

    /// Its values for all returns; `None` if `cloud` does not have it.
    pub fn entries(self, cloud: &PointCloud) -> Option<Entries<'_>> {
        self.is_in(cloud).then(|| self.values(cloud, None))
    }

    /// Returns its values for all pixels of an `image` of `cloud`. A pixel has that of the return which is
    /// shown. Without one it has NaN or 0, or the truth of the first surface along the beam.
    pub fn image<'a>(self, cloud: &'a PointCloud, image: &Image) -> Entries<'a> {
        self.values(cloud, Some(image))
    }

    fn values<'a>(self, cloud: &'a PointCloud, image: Option<&Image>) -> Entries<'a> {
        match self.storage() {
            Length(single, exact) => match exact.of(cloud).is_empty() {
                true => Entries::F4(single.entries(cloud, image)),
                false => Entries::F8(exact.entries(cloud, image)),
            },
            Real(field) => Entries::F4(field.entries(cloud, image)),
            // A pixel without a return has no time here: what is asked for are returns.
            Time(field) => Entries::F8(match image {
                Some(image) => image.spread(field.of(cloud), field.none).into(),
                None => field.entries(cloud, None),
            }),
            Byte(field) => Entries::U1(field.entries(cloud, image)),
            Count(field) => Entries::U2(field.entries(cloud, image)),
            Bit(_) => {
                let flags: Vec<u8> = (0..cloud.returns()).map(|at| cloud.flags(at)).collect();
                Entries::U1(match image {
                    Some(image) => image.spread(&flags, 0).into(),
                    None => flags.into(),
                })
            }
            Cosine(field) => {
                Entries::F4(field.entries(cloud, image).iter().copied().map(angle).collect())
            }
            Code(field) => {
                Entries::U1(field.entries(cloud, image).iter().map(|code| *code as u8).collect())
            }
        }
    }

    pub(crate) fn storage(self) -> &'static Storage {
        &self.entry().storage
    }

    /// The attributes that are stored, each in columns of its own: all but the ring, which is the row.
    pub(crate) fn stored() -> impl Iterator<Item = Self> {
        Self::ALL.into_iter().filter(|attribute| *attribute != Self::Ring)
    }

    /// The fields of all columns.
    pub(super) fn fields() -> impl Iterator<Item = &'static dyn Columns> {
        Self::stored().flat_map(|attribute| attribute.storage().fields())
    }

    /// The extents of its columns in `cloud`, that of the returns first.
    pub(crate) fn extents(self, cloud: &PointCloud) -> Vec<Extent> {
        let groups = match self {
            Self::X | Self::Y | Self::Z => {
                [Some(Group::Coordinates), Some(Group::ExactCoordinates)]
            }
            _ if self.comes_with_truth() => [Some(Group::Truth), None],
            _ => [None; 2],
        };
        let fields = self.storage().fields().zip(groups);
        fields.flat_map(|(field, group)| field.extents(cloud, group)).collect()
    }
}

/// The angle with this cosine, rad.
pub(crate) fn angle(cosine: f32) -> f32 {
    libm::acos(f64::from(cosine).clamp(0.0, 1.0)) as f32
}

#[cfg(test)]
mod tests {
    use super::super::{Pick, Surface};
    use super::*;
    use std::collections::BTreeSet;

    /// Three pixels in a row; the middle one has no return, but a wall behind it.
    fn cloud() -> PointCloud {
        let mut cloud = PointCloud {
            rows: 1,
            columns: 3,
            row: vec![0, 0],
            column: vec![0, 2],
            x: vec![4.0, 5.0],
            y: vec![0.0; 2],
            z: vec![0.0; 2],
            range: vec![4.0, 5.0],
            time_ns: vec![10.0, 30.0],
            fired_ns: vec![10.0, 20.0, 30.0],
            saturated: vec![false, true],
            ..PointCloud::default()
        };
        let wall =
            Surface { range: 6.0, object: 7, material: 1, cosine: 0.5, outcome: Outcome::Missed };
        let right = Surface { outcome: Outcome::Right, ..wall };
        (0..2).for_each(|_| cloud.truth.returns.push(Surface { object: 3, ..right }));
        for outcome in [Outcome::Right, Outcome::Missed, Outcome::Right] {
            cloud.truth.pixels.push(Surface { outcome, ..wall });
        }
        cloud
    }

    #[test]
    fn every_column_of_a_cloud_is_declared_once() {
        let cloud = PointCloud::default();
        let declared: Vec<&str> = Attribute::stored()
            .flat_map(|attribute| attribute.extents(&cloud))
            .map(|column| column.name)
            .collect();
        assert_eq!(declared.len(), declared.iter().collect::<BTreeSet<_>>().len());
        assert_eq!(declared.len(), format!("{cloud:?}").matches("[]").count(), "{declared:?}");
        assert!(declared.contains(&"truth.pixels.range"));
    }

    #[test]
    fn every_attribute_has_a_name_of_its_own_and_a_sentence() {
        for attribute in Attribute::ALL {
            assert_eq!(Attribute::named(attribute.name()), Some(attribute));
            assert!(attribute.about().ends_with('.') && !attribute.about().contains("  "));
        }
        assert_eq!(Attribute::named("nir"), None);
        assert!(Attribute::ALL.is_sorted_by_key(|attribute| attribute.is_true()));
        assert!(Attribute::in_files().all(|attribute| attribute != Attribute::Photons));
    }

    #[test]
    fn values_are_lent_or_computed_and_an_empty_column_is_absent() {
        let cloud = cloud();
        let Some(Entries::F4(Cow::Borrowed(ranges))) = Attribute::Range.entries(&cloud) else {
            panic!()
        };
        assert_eq!(ranges.as_ptr(), cloud.range.as_ptr());
        assert_eq!(Attribute::Ring.entries(&cloud), Attribute::Row.entries(&cloud));
        assert_eq!(Attribute::Flags.entries(&cloud), Some(Entries::U1(vec![0, 4].into())));
        assert_eq!(Attribute::Outcome.entries(&cloud), Some(Entries::U1(vec![1, 1].into())));
        let incidence = Attribute::Incidence.entries(&cloud).unwrap();
        assert!((incidence.number(1) - 60_f64.to_radians()).abs() < 1e-6);
        assert!(incidence.number(2).is_nan());
        assert_eq!(Attribute::Intensity.entries(&cloud), None);
        assert!(!Attribute::Object.is_in(&PointCloud { truth: Default::default(), ..cloud }));
    }

    #[test]
    fn digits_beyond_32_bits_are_kept() {
        let mut cloud = cloud();
        cloud.exact.range = vec![4.000_000_01, 5.0];
        assert_eq!(Attribute::Range.entries(&cloud).unwrap().number(0), 4.000_000_01);
    }

    #[test]
    fn a_pixel_without_a_return_has_the_truth_alone() {
        let cloud = cloud();
        let image = cloud.image(Pick::First);
        let numbers = |attribute: Attribute| {
            let values = attribute.image(&cloud, &image);
            [0, 1, 2].map(|pixel| values.number(pixel))
        };
        assert_eq!(numbers(Attribute::Object), [3.0, 7.0, 3.0]);
        assert_eq!(numbers(Attribute::Outcome), [1.0, 4.0, 1.0]);
        assert_eq!(numbers(Attribute::Flags), [0.0, 0.0, 4.0]);
        assert_eq!(numbers(Attribute::Column), [0.0, 0.0, 2.0]);
        assert!(numbers(Attribute::TimeNs)[1].is_nan() && numbers(Attribute::Range)[1].is_nan());
    }
}

//! One lidar of all that could be built, as a sensor.

use macropulse::codec::code::Separated;
use macropulse::design::{Design, Detector, Effect};
use toml::{Table, Value};

use super::Error;
use super::keys::{idealise, number, put};
use super::parts::Part;
use super::polygon::POLYGON;
use super::requirements::Requirements;

/// Steps of the converter to a standard deviation of the noise: the rounding then adds 1.3 % to its variance.
const STEPS: f64 = 2.5;

/// Share of the false points accepted that the receiver is asked for: the rest is left to what no threshold
/// knows, remains of light that was cancelled. With 0.3 of them 4·10⁻⁴ of the empty tiles of 32 channels had a
/// point, with this 2.5·10⁻⁴; it costs a twentieth of the light.
const FALSE_SHARE: f64 = 0.03;

/// How long a lidar that waits may be blanked, ns: to 3 m. The nearest targets of a trial stand at 4 m.
const LATE: f64 = 20.0;

/// Words of a code: with ten of them no two shots in flight that are nearer than ten have the same one.
pub(super) const WORDS: u32 = 10;

/// Schemes of a lidar. A coded one waits between its shots no longer than its mirror asks; the other one
/// waits until every echo is back.
pub(super) const SCHEMES: [&str; 2] = ["coded", "waiting"];

/// Returns the scheme of a lidar whose shots have this number of `marks`.
pub(super) fn scheme(marks: u32) -> &'static str {
    SCHEMES[usize::from(marks == 1)]
}

/// A lidar that may or may not do.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// Its photodiodes.
    pub part: Part,
    /// Marks of a shot: 1 waits for its echo, more are a code word.
    pub marks: u32,
    /// Beams, each with a detector of its own.
    pub beams: u32,
    /// Facets of its polygon; `None` if it has none.
    pub facets: Option<u32>,
    /// Length of a pulse, s, full width at half maximum.
    pub pulse: f64,
    /// Bandwidth of the amplifiers, Hz.
    pub bandwidth: f64,
    /// Energy of a shot, J.
    pub energy: f64,
    /// Diameter of the receiving aperture, m.
    pub aperture: f64,
    /// Its words; `None` of one that waits.
    pub words: Option<Separated>,
    /// True if it begins to listen later, because its stray light outlasts the blanking of the sensor of the
    /// requirements.
    pub is_late: bool,
}

/// The part of a candidate that is built as a sensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Built {
    /// All of it.
    Whole,
    /// This number of its beams, next to each other. Every detector has the same work.
    Beams(u32),
}

impl Candidate {
    /// Returns true if it waits for the echo of a shot before it fires the next one.
    pub fn waits(&self) -> bool {
        self.marks == 1
    }

    /// `coded` or `waiting`.
    pub fn scheme(&self) -> &'static str {
        scheme(self.marks)
    }

    /// A name that tells it from the others of a search.
    pub fn name(&self) -> String {
        match self.waits() {
            true => format!("waiting-{}-{}", self.beams, self.part.name),
            false => format!("coded-{}-{}-{}", self.beams, self.marks, self.part.name),
        }
    }

    /// The sensor.
    ///
    /// # Errors
    /// If the sensor of the requirements cannot be changed into it.
    pub fn design(&self, required: &Requirements) -> Result<Design, Error> {
        self.built(required, Built::Whole, &[])
    }

    /// As [`Candidate::design`], with eye safety idealised: its energy is not held against what class 1 allows, which
    /// takes longer to work out than all else.
    pub(super) fn unlimited(&self, required: &Requirements) -> Result<Design, Error> {
        let changes = |table: &mut Table| idealise(table, Effect::EyeSafety);
        self.stepped(required, Built::Whole, changes)
    }

    /// As [`Candidate::design`], or a part of it, with some keys of the sensor changed.
    pub(super) fn built(
        &self,
        required: &Requirements,
        built: Built,
        changes: &[(String, Value)],
    ) -> Result<Design, Error> {
        self.stepped(required, built, |table| {
            changes.iter().for_each(|(path, value)| put(table, path, value.clone()));
        })
    }

    /// Returns the sensor with its table `changed`, and with a step of its converter that suits its noise.
    fn stepped(
        &self,
        required: &Requirements,
        built: Built,
        changed: impl Fn(&mut Table),
    ) -> Result<Design, Error> {
        let table = |step: f64| {
            let mut table = self.table(required, built, step);
            changed(&mut table);
            table
        };
        let of = |table: &Table| Design::from_table(table, &self.name(), &required.folder, &[]);
        // The noise is known only of a design; what eyes allow does not matter for it.
        let mut coarse = table(1.0);
        idealise(&mut coarse, Effect::EyeSafety);
        let coarse = of(&coarse)?;
        let Detector::Sampled(detector) = &coarse.detector else {
            return Err(Error::Asked(format!(
                "{}: has no sampled detector",
                required.parts.sensor
            )));
        };
        Ok(of(&table(detector.rms_noise(0.0) / STEPS))?)
    }

    /// The sensor as the keys of its file.
    fn table(&self, required: &Requirements, built: Built, step: f64) -> Table {
        let wanted = &required.wanted;
        let mut table = required.template.clone();
        // The beam fills as much of its pixel as that of the template.
        let [width, height] = required.pitch();
        let pitch = |across: &str, count: &str| {
            let key = |name: &str| number(&table, &format!("scan.raster.{name}")).unwrap_or(1.0);
            key(across) / key(count)
        };
        let finer = width.min(height)
            / pitch("horizontal_deg", "columns").min(pitch("vertical_deg", "rows"));
        let divergence = number(&table, "light.divergence_mrad").unwrap_or(1.0) * finer;
        let mut set = |path: &str, value: Value| put(&mut table, path, value);
        let beams = match built {
            Built::Whole => self.beams,
            Built::Beams(beams) => beams,
        };
        let rows = wanted.rows / self.beams * beams;
        let share = f64::from(beams) / f64::from(self.beams);
        set("name", self.name().into());
        set("summary", self.summary(required).into());
        set("scan.scans_per_s", wanted.scans_per_s.into());
        set("scan.max_range_m", wanted.range_m.into());
        set("scan.light_range_m", wanted.clutter_m.into());
        set("scan.raster.rows", rows.into());
        set("scan.raster.columns", wanted.columns.into());
        set("scan.raster.horizontal_deg", wanted.horizontal_deg.into());
        set("scan.raster.vertical_deg", (wanted.vertical_deg * share).into());
        set("scan.raster.beams", beams.into());
        set("light.wavelength_nm", self.part.wavelength_nm.into());
        set("light.pulse_ps", (self.pulse * 1e12).into());
        let energy = Table::from_iter([("shot_nj".to_owned(), (self.energy * 1e9).into())]);
        set("light.energy", energy.into());
        set("light.divergence_mrad", divergence.into());
        set("optics.aperture_mm", (self.aperture * 1e3).into());
        if let Some(polygon) = self.facets.map(|facets| required.polygon(self.aperture, facets)) {
            set(&format!("{POLYGON}.facets"), i64::from(polygon.facets).into());
            set(&format!("{POLYGON}.diameter_mm"), (polygon.diameter * 1e3).into());
        }
        set("detector.photodiode.efficiency", self.part.efficiency.into());
        set("detector.photodiode.gain", self.part.gain.into());
        set("detector.photodiode.ionisation_ratio", self.part.ionisation_ratio.into());
        set("detector.photodiode.dark_current_na", self.part.dark_current_na.into());
        set("detector.photodiode.capacitance_pf", self.part.capacitance_pf.into());
        set("detector.photodiode.bandwidth_mhz", (self.bandwidth * 1e-6).into());
        set("adc.step_photons", step.into());
        if self.is_late {
            let usual = number(&required.template, "receiver.blank_ns").unwrap_or(0.0);
            set("receiver.blank_ns", usual.max(LATE).into());
        }
        set("receiver.false_alarm", (FALSE_SHARE * wanted.false_points).into());
        match &self.words {
            None => {
                table.remove("code");
            }
            Some(words) => {
                put(&mut table, "code.family", family(words));
                put(&mut table, "code.word.modulus", i64::from(WORDS).into());
            }
        }
        table
    }

    fn summary(&self, required: &Requirements) -> String {
        let wanted = &required.wanted;
        let how = match self.waits() {
            true => "one pulse a shot, waits for its echo".to_owned(),
            false => format!("{} marks a shot, waits for none", self.marks),
        };
        format!(
            "{} x {} at {} Hz to {} m in {} beams of {} nm: {how}",
            wanted.columns,
            wanted.rows,
            wanted.scans_per_s,
            wanted.range_m,
            self.beams,
            self.part.wavelength_nm
        )
    }

    /// Speed of the corners of its polygon, m/s; `None` if it has none.
    pub(super) fn tip_speed(&self, required: &Requirements) -> Option<f64> {
        let lines = required.lines(f64::from(self.beams));
        Some(required.polygon(self.aperture, self.facets?).tip_speed(lines))
    }

    /// By what factor its polygon is too fast or too large; `None` if it is neither.
    pub(super) fn beyond_mirror(&self, required: &Requirements) -> Option<f64> {
        let diameter = required.polygon(self.aperture, self.facets?).diameter;
        let over = |value: f64, most: f64| value / most * (1.0 - 1e-9);
        let most = required.parts.tip_m_per_s;
        let fast =
            most.zip(self.tip_speed(required)).map_or(0.0, |(most, speed)| over(speed, most));
        let large = over(diameter, required.parts.polygon_mm * 1e-3);
        Some(fast.max(large)).filter(|factor| *factor > 1.0)
    }
}

/// Such words as the family of a sensor file.
fn family(words: &Separated) -> Value {
    let &Separated { length, weight, words, gap, apart, later, seed } = words;
    let keys = [
        ("length", length),
        ("weight", weight),
        ("words", words),
        ("gap", gap),
        ("apart", apart),
        ("later", later),
    ];
    let keys = keys.map(|(key, value)| (key.to_owned(), Value::from(value)));
    let mut table = Table::from_iter(keys);
    table.insert("seed".to_owned(), (seed as i64).into());
    Table::from_iter([("separated".to_owned(), table.into())]).into()
}

impl Requirements {
    /// Returns the shortest time between the shots of one of `beams` channels, s, behind a polygon with
    /// `facets` facets if there is one.
    pub(super) fn shortest_period(&self, beams: u32, facets: Option<u32>) -> f64 {
        facets.map_or(self.burst, |facets| self.duty(facets)) * self.mean_period(beams)
    }

    /// Returns the mean time between the shots of one of `beams` channels, s.
    pub(super) fn mean_period(&self, beams: u32) -> f64 {
        let wanted = &self.wanted;
        let pixels = f64::from(wanted.rows) * f64::from(wanted.columns);
        f64::from(beams) / (pixels * wanted.scans_per_s)
    }
}

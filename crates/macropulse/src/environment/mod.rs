//! The surroundings of a scene: sun, air, rain and fog.
//!
//! They belong to the place, not to the sensor: two sensors in one scene have the same weather. An
//! environment is plain data. Its effects on a sensor are worked out by
//! [`Operating`](crate::channel::Operating).

mod air;
mod effect;
mod file;
mod ready;
mod schema;
mod spectrum;

use toml::Value;

pub use crate::names::toml_value as value;
pub use effect::Effect;
pub use file::{WITH, WITHOUT, change};
pub use ready::{names, text};
pub(crate) use schema::in_scene;
pub use schema::schema;

/// The environment of a scene that names none.
pub const DEFAULT: &str = "clear-day";

/// Sine of the elevation at which the sun lights level ground as it lights the surface of the table:
/// cos 11.19°. This is the angle between the sun of air mass 1.5, 41.81° high, and the normal of a surface
/// that is tilted by 37° \[G173\].
const SQUARE_ON_TABLE: f64 = 0.980_989;

/// Share of sunlight that is left on the ground under closed clouds: 1 − 0.75 \[KC80\].
const BELOW_CLOUDS: f64 = 0.25;

/// Sun, air, rain and fog.
#[derive(Debug, Clone, PartialEq)]
pub struct Environment {
    /// The ready environment it is, with what was changed of it.
    pub name: String,
    /// Light from the sky.
    pub sunlight: Sunlight,
    /// Mean diffuse reflectance of what lies in the field, for the sunlight it sends back.
    pub albedo: f64,
    /// Meteorological visibility, m; below 1 km it is fog.
    pub visibility: f64,
    /// Rain, mm/h.
    pub rain_mm_h: f64,
    /// Effects that are left out.
    pub idealised: Vec<Effect>,
}

/// Light from the sky.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Sunlight {
    /// A clear sky. With an elevation of the sun, rad, on level ground; else on the tilted surface
    /// of the table.
    Day {
        /// Height of the sun above the horizon, rad.
        elevation: Option<f64>,
    },
    /// Closed clouds.
    Overcast,
    /// None.
    Night,
    /// Spectral irradiance of the scene, W/m² per metre of wavelength, the same at all wavelengths.
    Declared(f64),
}

/// A fault in an environment: the key, and what to do.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("environment{}{key}: {message}", if key.is_empty() { "" } else { "." })]
pub struct Error {
    /// Key within the environment; empty for the environment as a whole.
    pub key: String,
    message: String,
}

impl Default for Environment {
    /// [`DEFAULT`].
    fn default() -> Self {
        Self {
            name: DEFAULT.to_owned(),
            sunlight: Sunlight::Day { elevation: None },
            albedo: 0.3,
            visibility: 23e3,
            rain_mm_h: 0.0,
            idealised: Vec::new(),
        }
    }
}

impl Environment {
    /// The ready environment called `name`.
    ///
    /// # Errors
    /// If there is none; the message names the nearest.
    pub fn named(name: &str) -> Result<Self, Error> {
        Self::read(&Value::String(name.to_owned()))
    }

    /// The ready environment called `name` with `changes` of single keys, each with its new value
    /// as TOML.
    ///
    /// # Errors
    /// As [`Environment::named`]; and if a key is unknown, has no effect, or its value cannot be.
    pub fn changed(name: &str, changes: &[(String, String)]) -> Result<Self, Error> {
        let mut typed = Value::String(name.to_owned());
        for (key, value) in changes {
            typed = change(Some(typed), key, crate::names::toml_value(value))?;
        }
        Self::read(&typed)
    }

    /// The environment that is `typed` in a scene file: the name of a ready one, or a table of keys
    /// over one.
    ///
    /// # Errors
    /// As [`Environment::changed`].
    pub fn read(typed: &Value) -> Result<Self, Error> {
        file::read(typed)
    }

    /// Neither air nor sunlight: the ready one called `vacuum-dark`.
    pub fn vacuum_dark() -> Self {
        Self { name: "vacuum-dark".to_owned(), idealised: Effect::ALL.to_vec(), ..Self::default() }
    }

    /// The same after dark.
    pub fn at_night(&self) -> Self {
        match self.is_off(Effect::Background) || self.sunlight == Sunlight::Night {
            true => self.clone(),
            false => Self {
                name: format!("{} at night", self.name),
                sunlight: Sunlight::Night,
                ..self.clone()
            },
        }
    }

    /// Returns true if `effect` is left out.
    pub fn is_off(&self, effect: Effect) -> bool {
        self.idealised.contains(&effect)
    }

    /// Extinction of air, fog and rain in 1/m at a `wavelength` in m: what is lost of light on its
    /// way, by absorption and scattering, in natural units.
    pub fn extinction(&self, wavelength: f64) -> f64 {
        match self.is_off(Effect::Atmosphere) {
            true => 0.0,
            false => air::haze(self.visibility, wavelength) + air::rain(self.rain_mm_h),
        }
    }

    /// Backscatter of air, fog and rain in 1/(m·sr) at a `wavelength` in m: what a volume sends back
    /// to where the light comes from. It is not simulated.
    pub fn backscatter(&self, wavelength: f64) -> f64 {
        match self.is_off(Effect::Atmosphere) {
            true => 0.0,
            false => air::backscatter(self.visibility, self.rain_mm_h, wavelength),
        }
    }

    /// Returns true if there is fog or rain.
    pub fn has_drops(&self) -> bool {
        let drops = air::is_fog(self.visibility) || self.rain_mm_h > 0.0;
        drops && !self.is_off(Effect::Atmosphere)
    }

    /// Spectral irradiance of the scene at a `wavelength` in m, W/m² per metre of wavelength; `None`
    /// where the table of sunlight does not go.
    ///
    /// By day this is the irradiance of a surface tilted towards the sun, E \[G173\]. On level ground with
    /// the sun at an elevation h it is E·sin h / cos 11.19°. All of the light is taken as direct then, and
    /// the air it comes through as that of the table, which is too bright for a low sun. Under closed clouds
    /// it is E/4.
    pub fn irradiance(&self, wavelength: f64) -> Option<f64> {
        match self.sunlight {
            _ if self.is_off(Effect::Background) => Some(0.0),
            Sunlight::Night => Some(0.0),
            Sunlight::Declared(irradiance) => Some(irradiance),
            Sunlight::Overcast => spectrum::sunlight(wavelength).map(|sun| sun * BELOW_CLOUDS),
            Sunlight::Day { elevation: None } => spectrum::sunlight(wavelength),
            Sunlight::Day { elevation: Some(elevation) } => {
                let share = libm::sin(elevation) / SQUARE_ON_TABLE;
                spectrum::sunlight(wavelength).map(|sun| sun * share)
            }
        }
    }

    /// Returns its description, for people to read.
    pub fn conditions(&self) -> String {
        let sky = match self.sunlight {
            _ if self.is_off(Effect::Background) => "no sunlight".to_owned(),
            Sunlight::Night => "night".to_owned(),
            Sunlight::Overcast => format!("closed clouds, albedo {}", self.albedo),
            Sunlight::Day { elevation: None } => format!("day, albedo {}", self.albedo),
            Sunlight::Day { elevation: Some(elevation) } => {
                let degrees = (elevation.to_degrees() * 1e6).round() / 1e6;
                format!("day with the sun at {degrees} deg, albedo {}", self.albedo)
            }
            Sunlight::Declared(irradiance) => {
                let per_nm = (irradiance * 1e-9 * 1e9).round() / 1e9;
                format!("{per_nm} W/m2/nm of sunlight, albedo {}", self.albedo)
            }
        };
        let air = match self.is_off(Effect::Atmosphere) {
            true => "no air".to_owned(),
            false => format!("visibility {} km", self.visibility * 1e-3),
        };
        match self.rain_mm_h > 0.0 {
            true => format!("{sky}, {air}, rain of {} mm/h", self.rain_mm_h),
            false => format!("{sky}, {air}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn the_default_is_the_ready_one() {
        assert_eq!(Environment::default(), Environment::named(DEFAULT).unwrap());
        assert_eq!(Environment::vacuum_dark(), Environment::named("vacuum-dark").unwrap());
    }

    #[test]
    fn every_ready_one_is_right_and_has_a_first_sentence() {
        for name in names() {
            let environment = Environment::named(name).unwrap();
            assert_eq!(environment.name, name);
            let mut lines = text(name).unwrap().lines();
            assert_eq!(lines.next(), Some("#:schema ../schemas/environment.json"), "{name}");
            assert!(lines.next().unwrap().starts_with("# "), "{name}");
            assert!(environment.extinction(905e-9).is_finite());
            assert!(environment.irradiance(905e-9).is_some());
        }
    }

    #[test]
    fn nothing_is_lost_and_nothing_shines_in_a_dark_vacuum() {
        let dark = Environment::named("vacuum-dark").unwrap();
        assert_eq!((dark.extinction(905e-9), dark.irradiance(5e-6)), (0.0, Some(0.0)));
        assert_eq!(dark.at_night(), dark);
        let night = Environment::default().at_night();
        assert_eq!(night.irradiance(905e-9), Some(0.0));
        assert_eq!(night.extinction(905e-9), Environment::default().extinction(905e-9));
    }

    #[test]
    fn sunlight_follows_the_sky() {
        let at = |changes: &[(&str, &str)]| {
            let owned = |&(key, value): &(&str, &str)| (key.to_owned(), value.to_owned());
            let changes: Vec<_> = changes.iter().map(owned).collect();
            Environment::changed("clear-day", &changes).unwrap().irradiance(905e-9).unwrap() * 1e-9
        };
        assert_relative_eq!(at(&[]), 0.817, max_relative = 1e-3);
        assert_relative_eq!(at(&[("sky", "overcast")]), 0.817 / 4.0, max_relative = 1e-3);
        assert_relative_eq!(at(&[("irradiance_w_m2_nm", "0.5")]), 0.5, max_relative = 1e-12);
        assert_eq!(at(&[("sun_elevation_deg", "0")]), 0.0);
        // Square on, the ground gets what the tilted surface gets but for the cosine of 11 degrees.
        let zenith = at(&[("sun_elevation_deg", "90")]);
        assert_relative_eq!(zenith, 0.817 / 0.981, max_relative = 1e-3);
        assert_eq!(Environment::default().irradiance(2e-6), None);
    }

    #[test]
    fn rain_adds_to_the_air() {
        let rain = Environment::named("rain-25mm").unwrap();
        let clear = Environment::default();
        let more = rain.extinction(905e-9) - clear.extinction(905e-9);
        assert_relative_eq!(more, 2.14e-3, max_relative = 2e-3);
        let fog = Environment::named("fog-50m").unwrap();
        assert_relative_eq!(fog.extinction(1550e-9), 3.912 / 50.0, max_relative = 1e-12);
    }
}

//! An environment as typed: a name, or keys over one that is ready.

use schemars::JsonSchema;
use serde::Deserialize;
use toml::{Table, Value};

use super::{DEFAULT, Effect, Environment, Error, Sunlight, ready};
use crate::names::nearest;
use crate::schema;

/// The key of a change that takes an effect off the list `idealised`.
pub const WITH: &str = "with";

/// The key of a change that puts an effect on the list `idealised`.
pub const WITHOUT: &str = "without";

/// Keys over an environment.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct Typed {
    /// Ready environment that fills in what is left open; `clear-day` unless it is given.
    #[serde(default)]
    #[schemars(schema_with = "super::schema::ready_name")]
    base: Option<String>,
    /// Light of the sky.
    sky: Option<Sky>,
    /// Spectral irradiance of the sun, W/m² per nm, in place of the table it is otherwise from.
    #[schemars(range(min = 0, max = 1000))]
    irradiance_w_m2_nm: Option<f64>,
    /// Height of the sun over level ground, degrees, by day.
    #[schemars(range(min = 0, max = 90))]
    sun_elevation_deg: Option<f64>,
    /// Mean reflectance of what lies in the field, 0 to 1.
    #[schemars(range(min = 0, max = 1))]
    albedo: Option<f64>,
    /// Meteorological visibility, km; below 1 km it is fog.
    #[schemars(range(min = 0.01, max = 1000))]
    visibility_km: Option<f64>,
    /// Rain, mm in an hour.
    #[schemars(range(min = 0, max = 500))]
    rain_mm_h: Option<f64>,
    /// Effects that are left out.
    #[schemars(with = "Option<Vec<Effect>>")]
    idealised: Option<Vec<String>>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
enum Sky {
    /// The sun in a clear sky.
    Day,
    /// Closed clouds.
    Overcast,
    /// No sun.
    Night,
}

impl Error {
    fn at(key: &str, message: impl Into<String>) -> Self {
        Self { key: key.to_owned(), message: message.into() }
    }
}

/// Reads what stands for an environment in a scene.
pub(super) fn read(typed: &Value) -> Result<Environment, Error> {
    match typed {
        Value::String(name) => {
            let own =
                Typed::of_ready(name).map_err(|error| Error { key: String::new(), ..error })?;
            own.over(&Typed::default(), name.clone())
        }
        Value::Table(table) => {
            let own = Typed::of(table)?;
            let base = own.base.clone().unwrap_or_else(|| DEFAULT.to_owned());
            let below = Typed::of_ready(&base)?;
            let changed = table.iter().filter(|(key, _)| *key != "base");
            let changed: Vec<String> =
                changed.map(|(key, value)| format!("{key} = {value}")).collect();
            let name = match changed.is_empty() {
                true => base,
                false => format!("{base} with {}", changed.join(", ")),
            };
            own.over(&below, name)
        }
        _ => Err(Error::at("", "must be the name of an environment, or a table of its keys")),
    }
}

/// Returns the value of an environment after the change of one key; `typed` is the value before, if there is
/// one. The key is empty for the whole of it, [`WITH`] and [`WITHOUT`] for an effect, else a key of it.
///
/// # Errors
/// If the environment is unknown, or the effect.
pub fn change(typed: Option<Value>, key: &str, value: Value) -> Result<Value, Error> {
    if key.is_empty() {
        return Ok(value);
    }
    let mut table = match typed {
        None => Table::new(),
        Some(Value::Table(table)) => table,
        Some(name) => Table::from_iter([("base".to_owned(), name)]),
    };
    if ![WITH, WITHOUT].contains(&key) {
        table.insert(key.to_owned(), value);
        return Ok(table.into());
    }
    let wanted = value.as_str().unwrap_or_default();
    let effect = Effect::named(wanted).ok_or_else(|| unknown(key, wanted))?;
    let base = table.get("base").and_then(Value::as_str).unwrap_or(DEFAULT);
    let below = Typed::of_ready(base)?.idealised.unwrap_or_default();
    let typed = table.get("idealised").and_then(Value::as_array).cloned();
    let mut list = typed.unwrap_or_else(|| below.into_iter().map(Value::from).collect());
    list.retain(|name| name.as_str() != Some(wanted));
    if key == WITHOUT {
        list.push(wanted.into());
        // Keys of the effect lose theirs with it.
        keys_of(effect).iter().for_each(|key| drop(table.remove(*key)));
    }
    table.insert("idealised".to_owned(), list.into());
    Ok(table.into())
}

/// The keys that an effect makes meaningless where it is left out.
fn keys_of(effect: Effect) -> &'static [&'static str] {
    match effect {
        Effect::Atmosphere => &["visibility_km", "rain_mm_h"],
        Effect::Background => &["sky", "irradiance_w_m2_nm", "sun_elevation_deg", "albedo"],
    }
}

fn unknown(key: &str, name: &str) -> Error {
    let known = Effect::ALL.map(Effect::name);
    let hint = nearest(name, known).map(|near| format!("did you mean `{near}`? "));
    let known = known.join(" and ");
    let hint = hint.unwrap_or_default();
    Error::at(key, format!("`{name}` is no effect of sun or air; {hint}there are {known}"))
}

impl Typed {
    fn of(table: &Table) -> Result<Self, Error> {
        schema::read(table)
            .map_err(|misfit| Error { key: misfit.path(), message: misfit.message() })
    }

    fn of_ready(name: &str) -> Result<Self, Error> {
        let Some(text) = ready::text(name) else {
            let hint = nearest(name, ready::names()).map(|near| format!("did you mean `{near}`? "));
            let known: Vec<&str> = ready::names().collect();
            let (hint, known) = (hint.unwrap_or_default(), known.join(", "));
            let message = format!("there is no environment `{name}`; {hint}ready ones: {known}");
            return Err(Error::at("base", message));
        };
        let table =
            text.parse().map_err(|error: toml::de::Error| Error::at("", error.message()))?;
        Self::of(&table)
    }

    /// These keys over those of `below`, and over the default where both are silent.
    fn over(&self, below: &Self, name: String) -> Result<Environment, Error> {
        let idealised = self.idealised.as_ref().or(below.idealised.as_ref());
        let idealised = idealised.into_iter().flatten();
        let idealised = idealised
            .map(|name| Effect::named(name).ok_or_else(|| unknown("idealised", name)))
            .collect::<Result<Vec<_>, _>>()?;
        let sky = self.sky.or(below.sky).unwrap_or(Sky::Day);
        self.all_have_effect(&idealised, sky)?;
        let default = Environment::default();
        let number =
            |key: &str, own: Option<f64>, below: Option<f64>, (least, most)| match own.or(below) {
                Some(value) if !(least..=most).contains(&value) => {
                    let message = format!("is {value}, but must lie between {least} and {most}");
                    Err(Error::at(key, message))
                }
                value => Ok(value),
            };
        let declared = number(
            "irradiance_w_m2_nm",
            self.irradiance_w_m2_nm,
            below.irradiance_w_m2_nm,
            (0.0, 1e3),
        )?;
        let elevation = number(
            "sun_elevation_deg",
            self.sun_elevation_deg,
            below.sun_elevation_deg,
            (0.0, 90.0),
        )?;
        let albedo = number("albedo", self.albedo, below.albedo, (0.0, 1.0))?;
        let visibility =
            number("visibility_km", self.visibility_km, below.visibility_km, (0.01, 1e3))?;
        let rain = number("rain_mm_h", self.rain_mm_h, below.rain_mm_h, (0.0, 500.0))?;
        Ok(Environment {
            name,
            sunlight: match (sky, declared) {
                (Sky::Night, _) => Sunlight::Night,
                (_, Some(per_nm)) => Sunlight::Declared(per_nm * 1e9),
                (Sky::Overcast, None) => Sunlight::Overcast,
                (Sky::Day, None) => Sunlight::Day { elevation: elevation.map(f64::to_radians) },
            },
            albedo: albedo.unwrap_or(default.albedo),
            visibility: visibility.map_or(default.visibility, |km| km * 1e3),
            rain_mm_h: rain.unwrap_or(default.rain_mm_h),
            idealised,
        })
    }

    fn gives(&self, key: &str) -> bool {
        match key {
            "sky" => self.sky.is_some(),
            "irradiance_w_m2_nm" => self.irradiance_w_m2_nm.is_some(),
            "sun_elevation_deg" => self.sun_elevation_deg.is_some(),
            "albedo" => self.albedo.is_some(),
            "visibility_km" => self.visibility_km.is_some(),
            "rain_mm_h" => self.rain_mm_h.is_some(),
            _ => false,
        }
    }

    /// Refuses a key that another one makes meaningless.
    fn all_have_effect(&self, idealised: &[Effect], sky: Sky) -> Result<(), Error> {
        let refuse = |keys: &[&str], why: &str| match keys.iter().find(|key| self.gives(key)) {
            Some(key) => Err(Error::at(key, format!("has no effect {why}"))),
            None => Ok(()),
        };
        for effect in idealised {
            let name = effect.name();
            refuse(
                keys_of(*effect),
                &format!(
                    "while `{name}` is idealised: leave it out, or take `{name}` off the list \
                     `idealised` (--with {name})"
                ),
            )?;
        }
        if sky == Sky::Night {
            refuse(
                &["irradiance_w_m2_nm", "sun_elevation_deg", "albedo"],
                "while sky = \"night\": leave it out, or write sky = \"day\"",
            )?;
        }
        if self.irradiance_w_m2_nm.is_some() {
            refuse(&["sun_elevation_deg"], "beside irradiance_w_m2_nm: leave one of them out")?;
            if self.sky == Some(Sky::Overcast) {
                refuse(&["sky"], "beside irradiance_w_m2_nm: leave one of them out")?;
            }
        }
        if sky == Sky::Overcast {
            refuse(
                &["sun_elevation_deg"],
                "while sky = \"overcast\", which hides the sun: leave it out, or write sky = \"day\"",
            )?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(text: &str) -> String {
        read(&Value::Table(text.parse().unwrap())).unwrap_err().to_string()
    }

    #[test]
    fn a_key_without_effect_is_named_with_what_makes_it_so() {
        for (text, words) in [
            ("base = \"vacuum-dark\"\nvisibility_km = 5", ["visibility_km", "`atmosphere`"]),
            ("idealised = [\"atmosphere\"]\nrain_mm_h = 5", ["rain_mm_h", "`atmosphere`"]),
            ("idealised = [\"background\"]\nsky = \"day\"", ["sky", "`background`"]),
            ("sky = \"night\"\nirradiance_w_m2_nm = 1", ["irradiance_w_m2_nm", "night"]),
            ("base = \"night\"\nalbedo = 0.1", ["albedo", "sky = \"night\""]),
            (
                "irradiance_w_m2_nm = 1\nsun_elevation_deg = 3",
                ["sun_elevation_deg", "irradiance_w_m2_nm"],
            ),
            ("sky = \"overcast\"\nsun_elevation_deg = 3", ["sun_elevation_deg", "overcast"]),
        ] {
            let message = told(text);
            for word in words {
                assert!(message.contains(word), "{text}: {message}");
            }
        }
    }

    #[test]
    fn what_is_misspelt_or_out_of_bounds_is_refused() {
        assert!(told("base = \"clear-dya\"").contains("did you mean `clear-day`"));
        assert!(told("visibilty_km = 3").contains("did you mean `visibility_km`"));
        assert!(told("sky = \"dya\"").contains("did you mean `day`"));
        assert!(told("idealised = [\"backgroud\"]").contains("did you mean `background`"));
        for wrong in ["visibility_km = 0", "visibility_km = nan", "albedo = 1.1", "rain_mm_h = -1"]
        {
            assert!(told(wrong).contains("must lie between"), "{wrong}");
        }
        let number = read(&Value::Integer(3)).unwrap_err().to_string();
        assert_eq!(
            number,
            "environment: must be the name of an environment, or a table of its keys"
        );
    }

    #[test]
    fn changes_lie_over_what_is_there() {
        let name = |name: &str| Some(Value::String(name.to_owned()));
        let fog = change(name("night"), "visibility_km", Value::Float(0.05)).unwrap();
        let fog = read(&fog).unwrap();
        assert_eq!((fog.visibility, fog.sunlight), (50.0, Sunlight::Night));
        assert_eq!(fog.name, "night with visibility_km = 0.05");
        let clear = read(&change(name("vacuum-dark"), WITH, "atmosphere".into()).unwrap()).unwrap();
        assert_eq!(clear.idealised, [Effect::Background]);
        assert_eq!(clear.extinction(905e-9), Environment::default().extinction(905e-9));
        // A key of the file goes with its effect; one that comes after it is refused.
        let foggy = change(None, "visibility_km", Value::Float(1.0)).unwrap();
        let without = change(Some(foggy), WITHOUT, "atmosphere".into()).unwrap();
        assert_eq!(read(&without).unwrap().idealised, [Effect::Atmosphere]);
        assert!(read(&change(Some(without), "rain_mm_h", 3.into()).unwrap()).is_err());
        let misspelt = change(None, WITHOUT, "atmosfere".into()).unwrap_err().to_string();
        assert!(misspelt.contains("did you mean `atmosphere`"), "{misspelt}");
    }
}

//! A sensor at work in an environment: what follows from both.

use super::Link;
use crate::design::Design;
use crate::environment::Environment;
use crate::scene::{Interferer, Scene};

/// A sensor cannot be simulated in an environment: why, and what to do.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{sensor} in {environment}: {message}")]
pub struct Error {
    sensor: String,
    environment: String,
    message: String,
}

/// A sensor at work in an environment: what follows from both.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Operating {
    /// From a surface to photons at the detector, through the air.
    pub link: Link,
    /// Photons of sunlight per second that reach each detector channel: by optics and environment, or as the
    /// sensor declares its counts where it has no link budget.
    pub sunlight: f64,
    /// Those that are detected, per second.
    pub background: f64,
    /// Detection events per second in each channel without the light of any lidar: dark and
    /// background counts; crossings of the threshold by noise.
    pub false_rate: f64,
}

/// An effect that a run leaves out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Idealised {
    /// Its name, as in a list `idealised`.
    pub name: &'static str,
    /// The assumption that replaces it.
    pub assumption: &'static str,
}

/// Every effect that `design` in `environment` leaves out: those of the sensor, then those of sun
/// and air.
pub fn idealised(design: &Design, environment: &Environment) -> Vec<Idealised> {
    let of_sensor = design.idealised.iter().map(|e| (e.name(), e.assumption()));
    let of_environment = environment.idealised.iter().map(|e| (e.name(), e.assumption()));
    let all = of_sensor.chain(of_environment);
    all.map(|(name, assumption)| Idealised { name, assumption }).collect()
}

impl Operating {
    /// The sensor `design` in `scene`.
    ///
    /// # Errors
    /// As [`Operating::of`]; and if its detector cannot follow the light of another lidar of the scene.
    pub fn in_scene(design: &Design, scene: &Scene) -> Result<Self, Error> {
        for Interferer { name, design: other, .. } in &scene.interferers {
            let link = Link::of_interferer(design, other, &scene.environment);
            let Some(link) = link.filter(|_| !other.emission.is_pulsed()) else { continue };
            let why = match design.detector.model().unpulsed() {
                Some(why) => why,
                None if link.photons_by((1.0, 1.0), 1.0).is_infinite() => {
                    "a detector that never misses knows no rate of light: write a \
                     sensitivity.pd below 1"
                }
                None => continue,
            };
            return Err(Error {
                sensor: design.name.clone(),
                environment: scene.name.clone(),
                message: format!(
                    "{name} ({}) sends light without pulses, and {why}; or take it out of [[interferers]]",
                    other.name
                ),
            });
        }
        Self::of(design, &scene.environment)
    }

    /// The sensor `design` in `environment`.
    ///
    /// # Errors
    /// If the table of sunlight does not go to the wavelength of a sensor with a link budget, or its detector
    /// cannot be simulated in this sunlight.
    pub fn of(design: &Design, environment: &Environment) -> Result<Self, Error> {
        let refuse = |message: String| Error {
            sensor: design.name.clone(),
            environment: environment.name.clone(),
            message,
        };
        let detector = design.detector.model();
        let sunlight = match &design.budget {
            None => detector.declared_background(),
            Some(budget) => {
                let irradiance = environment.irradiance(budget.wavelength).ok_or_else(|| {
                    refuse(format!(
                        "the table of sunlight goes from 350 to 1750 nm, not to {} nm: write \
                         irradiance_w_m2_nm under [environment] in the scene, or --set \
                         environment.irradiance_w_m2_nm=…",
                        (budget.wavelength * 1e12).round() * 1e-3
                    ))
                })?;
                budget.background(irradiance, environment.albedo)
            }
        };
        let background = sunlight * design.efficiency();
        if let Some(why) = detector.refusal(background) {
            return Err(refuse(why));
        }
        let false_rate = detector.false_rate(background);
        if let Some(why) = design.too_many_counts(false_rate) {
            return Err(refuse(why));
        }
        Ok(Self { link: Link::of(design, environment), sunlight, background, false_rate })
    }
}

#[cfg(test)]
impl Operating {
    /// The sensor where there is neither air nor sunlight.
    pub fn in_the_dark(design: &Design) -> Self {
        Self::of(design, &Environment::vacuum_dark()).unwrap()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::design::detector::Lit;
    use approx::assert_relative_eq;

    fn sensor(name: &str, set: &[(&str, &str)]) -> Design {
        let owned = |&(key, value): &(&str, &str)| (key.to_owned(), value.to_owned());
        Design::open(name, &set.iter().map(owned).collect::<Vec<_>>()).unwrap()
    }

    fn environment(name: &str) -> Environment {
        Environment::named(name).unwrap()
    }

    #[test]
    fn sunlight_adds_to_what_a_counter_counts() {
        let design = sensor("kim-park-2016-physical", &[]);
        let [day, clouds, night] = ["clear-day", "overcast", "night"]
            .map(|name| Operating::of(&design, &environment(name)).unwrap());
        assert_relative_eq!(day.background * 2.5e-12, 969.0, max_relative = 2e-3);
        assert_relative_eq!(clouds.background, day.background / 4.0, max_relative = 1e-12);
        assert_eq!((night.background, night.false_rate), (0.0, 0.0));
        assert_eq!(day.link, night.link);
    }

    #[test]
    fn a_declared_sensor_keeps_its_counts_but_has_air() {
        let key = "detector.photon-counting.background_hz";
        let design = sensor("kim-park-2016", &[(key, "5e6")]);
        let [dark, fog] = ["vacuum-dark", "fog-50m"]
            .map(|name| Operating::of(&design, &environment(name)).unwrap());
        assert_eq!((dark.background, dark.false_rate), (5e6, 6e6));
        assert_eq!(fog.false_rate, dark.false_rate);
        assert_eq!(dark.link.transmission(100.0), 1.0);
        assert_relative_eq!(fog.link.transmission(50.0), libm::exp(-3.912), max_relative = 1e-9);
    }

    #[test]
    fn sunlight_is_noise_of_a_linear_detector() {
        let design = sensor("coded-practical", &[]);
        let [day, night] =
            ["clear-day", "night"].map(|name| Operating::of(&design, &environment(name)).unwrap());
        let model = design.detector.model();
        let [by_day, by_night] =
            [day, night].map(|operating| model.noise(operating.background).unwrap());
        assert!(by_day.rms > by_night.rms);
        // The threshold follows, so that noise crosses it as often.
        assert_eq!(day.false_rate, night.false_rate);
        let ratio = by_night.threshold / by_night.rms;
        assert_relative_eq!(by_day.threshold / by_day.rms, ratio, max_relative = 1e-12);
        let faint = Lit { photons: 0.0, background: day.background, falling: 0.0 };
        // A crossing without light only just exceeds the threshold.
        assert_relative_eq!(model.mark_jitter(&faint), model.jitter(), max_relative = 0.05);
    }

    #[test]
    fn sunlight_fires_a_detector_of_one_photon_and_is_noise_to_one_of_more() {
        let sensor = |photons: &str| {
            let text = format!(
                "version = 1\nextends = \"kim-park-2016-physical\"\nname = \"mine\"\n\
                 idealised = [\"detector-bandwidth\", \"inter-chip\", \"mirror-motion\"]\n\
                 [detector.single-stop]\nefficiency = 1.0\nfiring_photons = {photons}\n\
                 noise_photons = 3.0\nfalse_firing_hz = 100.0\n[code]\nlabel = \"none\"\n\
                 family = {{ sparse = {{ length = 9, weight = 1, words = 2, seed = 1 }} }}\n\
                 word = {{ first = 0, modulus = 2 }}\n"
            );
            Design::from_toml(&text, "mine", std::path::Path::new(""), &[]).unwrap()
        };
        let setting = |photons: &str, name: &str| {
            let design = sensor(photons);
            let operating = Operating::of(&design, &environment(name)).unwrap();
            let noise = design.detector.model().noise(operating.background).unwrap();
            (operating, noise.rms)
        };
        let (one, noise) = setting("1", "clear-day");
        let sun = one.background;
        assert_eq!((one.false_rate, noise), (100.0 + sun, 3.0));
        let (many, noise) = setting("5", "clear-day");
        let pulse = sensor("5").light.pulse;
        assert_relative_eq!(noise.powi(2), 9.0 + sun * pulse, max_relative = 1e-12);
        assert_eq!(many.false_rate, 100.0);
        assert_eq!(setting("5", "night").1, 3.0);
    }

    #[test]
    fn what_cannot_be_simulated_is_told_with_both_names() {
        let cells = sensor(
            "kim-park-2016-physical",
            &[
                ("detector", "{ geiger = { efficiency = 1.0, cells = 100 } }"),
                ("optics.aperture_mm", "100.0"),
            ],
        );
        assert!(Operating::of(&cells, &environment("night")).is_ok());
        let told = Operating::of(&cells, &environment("clear-day")).unwrap_err().to_string();
        assert!(told.starts_with("kim-park-2016-physical in clear-day: "), "{told}");
        assert!(told.contains("counts per second"), "{told}");
        let far = sensor(
            "coded-practical",
            &[("light.wavelength_nm", "1760"), ("safety.distance_mm", "100")],
        );
        let told = Operating::of(&far, &environment("overcast")).unwrap_err().to_string();
        assert!(told.contains("not to 1760 nm") && told.contains("irradiance_w_m2_nm"), "{told}");
        assert!(Operating::of(&far, &environment("night")).is_ok());
    }
}

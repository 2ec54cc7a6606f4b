//! A sensor at work in an environment: what follows from both.

use super::Link;
use crate::design::{Design, Detector, FirstFiring, Linear};
use crate::environment::Environment;

/// More counts per second than this are not followed one by one through the cells of a Geiger
/// detector.
const MOST_COUNTS: f64 = 1e12;

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
    /// From a surface to detected photons, through the air.
    pub link: Link,
    /// Sunlight, detected counts per second in each detector channel: by optics and environment, or
    /// as the sensor declares where it has no link budget.
    pub background: f64,
    /// Detection events per second in each channel without the light of any lidar: dark and
    /// background counts; crossings by noise of a linear detector.
    pub false_rate: f64,
    /// Noise and threshold of a linear detector.
    pub linear: Option<LinearSetting>,
    /// Noise and false firings of a detector that fires once per shot.
    pub first_firing: Option<FirstFiringSetting>,
    /// Standard deviation of the timing, s; of a linear detector at its threshold, where it is
    /// largest.
    pub jitter: f64,
}

/// What a linear detector is set to under the light it sees. Amplitudes are in detected photons: in
/// electrons before multiplication.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinearSetting {
    /// Amplitude that makes an edge.
    pub threshold: f64,
    /// Noise without a mark, rms.
    pub noise: f64,
    /// Excess noise factor of the multiplication.
    pub excess: f64,
    /// Full width at half maximum of a mark behind the amplifier, s.
    pub response: f64,
    /// Crossings of the threshold by noise alone, 1/s.
    pub false_rate: f64,
    /// Standard deviation of the timing of the converter's input alone, s.
    pub jitter: f64,
}

/// What a detector that fires once per shot does under the light it sees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FirstFiringSetting {
    /// Photons needed to fire; 1 is a Geiger detector.
    pub needed: u32,
    /// White noise integrated over one pulse, photons rms.
    pub noise: f64,
    /// Firings without a target, 1/s.
    pub false_rate: f64,
    /// Standard deviation of the timing, s.
    pub jitter: f64,
}

/// An effect that a run leaves out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Idealised {
    /// Its name, as in a list `idealised`.
    pub name: &'static str,
    /// What is assumed instead.
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
    /// The sensor `design` in `environment`.
    ///
    /// # Errors
    /// If the table of sunlight does not go to the wavelength of a sensor with a link budget, or a
    /// Geiger detector would count too often to be followed.
    pub fn of(design: &Design, environment: &Environment) -> Result<Self, Error> {
        let refuse = |message: String| Error {
            sensor: design.name.clone(),
            environment: environment.name.clone(),
            message,
        };
        let background = match &design.budget {
            None => design.detector.declared_background(),
            Some(budget) => {
                let irradiance = environment.irradiance(budget.wavelength).ok_or_else(|| {
                    refuse(format!(
                        "the table of sunlight goes from 350 to 1750 nm, not to {} nm: write \
                         irradiance_w_m2_nm under [environment] in the scene, or --set \
                         environment.irradiance_w_m2_nm=…",
                        (budget.wavelength * 1e12).round() * 1e-3
                    ))
                })?;
                budget.background(irradiance, environment.albedo) * budget.efficiency
            }
        };
        let linear = match &design.detector {
            Detector::Linear(linear) => Some(LinearSetting::of(linear, background)),
            _ => None,
        };
        let first_firing = match &design.detector {
            Detector::FirstFiring(firing) => {
                Some(FirstFiringSetting::of(firing, background, design.light.pulse))
            }
            _ => None,
        };
        let false_rate = match &design.detector {
            Detector::PhotonCounting(counting) => counting.dark + background,
            Detector::Geiger(geiger) => geiger.dark + background,
            Detector::Linear(linear) => linear.false_alarm,
            Detector::FirstFiring(firing) => {
                first_firing.map_or(firing.false_rate, |setting| setting.false_rate)
            }
        };
        if matches!(design.detector, Detector::Geiger(_)) && false_rate > MOST_COUNTS {
            return Err(refuse(format!(
                "{false_rate:.1e} counts per second would fire the detector again and again, more \
                 than are followed one by one ({MOST_COUNTS:.0e}): narrow the field or the filter, \
                 or take another environment"
            )));
        }
        Ok(Self {
            link: Link::of(design, environment),
            background,
            false_rate,
            linear,
            first_firing,
            jitter: design.detector.jitter(),
        })
    }
}

#[cfg(test)]
impl Operating {
    /// The sensor where there is neither air nor sunlight.
    pub fn in_the_dark(design: &Design) -> Self {
        Self::of(design, &Environment::vacuum_dark()).unwrap()
    }
}

impl FirstFiringSetting {
    /// The setting of a detector that sees `background` detections of steady light per second,
    /// adding light up over a `pulse` of so many seconds.
    ///
    /// Where one photon is enough every one of them fires it. Where more are needed, their mean is
    /// taken off (the amplifier passes no steady current) and their fluctuation is shot noise:
    /// √(a² + b·τ), a the noise rms without light, b the background, τ the pulse.
    pub fn of(firing: &FirstFiring, background: f64, pulse: f64) -> Self {
        let FirstFiring { firing_photons, noise_photons, false_rate, jitter, .. } = *firing;
        let (noise, false_rate) = match firing_photons {
            1 => (noise_photons, false_rate + background),
            _ => ((noise_photons.powi(2) + background * pulse).sqrt(), false_rate),
        };
        Self { needed: firing_photons, noise, false_rate, jitter }
    }
}

impl LinearSetting {
    /// The setting of a detector that sees `background` detections of steady light per second.
    pub fn of(linear: &Linear, background: f64) -> Self {
        let noise = linear.amplifier.noise_electrons(background);
        Self {
            threshold: linear.threshold_over_noise * noise,
            noise,
            excess: linear.amplifier.excess(),
            response: linear.amplifier.response(),
            false_rate: linear.false_alarm,
            jitter: linear.jitter,
        }
    }

    /// Standard deviation, s, of the time at which a mark of `amplitude` detected photons crosses
    /// the threshold: noise over the slope, τ·noise/amplitude, with the jitter of the input.
    pub fn timing(&self, amplitude: f64) -> f64 {
        libm::hypot(self.jitter, self.response * self.noise / amplitude.max(self.threshold))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
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
        assert_relative_eq!(day.background * 2.5e-12, 947.0, max_relative = 2e-3);
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
        let [by_day, by_night] = [day, night].map(|operating| operating.linear.unwrap());
        assert!(by_day.noise > by_night.noise);
        // The threshold follows, so that noise crosses it as often.
        assert_eq!(day.false_rate, night.false_rate);
        let ratio = by_night.threshold / by_night.noise;
        assert_relative_eq!(by_day.threshold / by_day.noise, ratio, max_relative = 1e-12);
        assert_relative_eq!(by_day.timing(0.0), day.jitter, max_relative = 1e-12);
    }

    #[test]
    fn sunlight_fires_a_detector_of_one_photon_and_is_noise_to_one_of_more() {
        let sensor = |photons: &str| {
            let text = format!(
                "version = 1\nextends = \"kim-park-2016-physical\"\nname = \"mine\"\n\
                 idealised = [\"detector-bandwidth\", \"inter-chip\", \"mirror-motion\"]\n\
                 [detector.first-firing]\nefficiency = 1.0\nfiring_photons = {photons}\n\
                 noise_photons = 3.0\nfalse_firing_hz = 100.0\n[code]\nlabel = \"none\"\n\
                 family = {{ sparse = {{ length = 9, weight = 1, words = 2, seed = 1 }} }}\n\
                 word = {{ first = 0, modulus = 2 }}\n"
            );
            Design::from_toml(&text, "mine", std::path::Path::new(""), &[]).unwrap()
        };
        let setting = |photons: &str, name: &str| {
            let operating = Operating::of(&sensor(photons), &environment(name)).unwrap();
            let setting = operating.first_firing.unwrap();
            assert_eq!(operating.false_rate, setting.false_rate);
            (operating.background, setting)
        };
        let (sun, one) = setting("1", "clear-day");
        assert_eq!((one.false_rate, one.noise), (100.0 + sun, 3.0));
        let (_, many) = setting("5", "clear-day");
        let pulse = sensor("5").light.pulse;
        assert_relative_eq!(many.noise.powi(2), 9.0 + sun * pulse, max_relative = 1e-12);
        assert_eq!(many.false_rate, 100.0);
        assert_eq!(setting("5", "night").1.noise, 3.0);
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

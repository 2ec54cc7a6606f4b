//! Effects that the simulator does not model, and how large each would be.
//!
//! These effects have no switch. An effect that a sensor or an environment may leave out is an
//! [`crate::design::Effect`] of the list `idealised`. The formulas and their sources stand
//! in docs/limits.md.

mod size;

use super::way;
use crate::channel::Error;
use crate::design::{Design, Detector, Effect};
use crate::environment::{Effect as Surrounding, Environment};
use size::{Sized, rounded};

/// An effect that no simulation contains.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unmodelled {
    /// Haze, fog and rain send light back.
    AirReturn,
    /// A detector saturates, recovers, and spills into its neighbours.
    Saturation,
    /// Light or charge of one channel reaches another.
    Crosstalk,
    /// Mirrors and panes show images of what stands before them.
    MirrorImages,
    /// Near by, the field does not hold the whole beam.
    NearFieldOverlap,
    /// A Gaussian beam has wings.
    BeamWings,
    /// Some directions are brighter than others.
    SkyAndGround,
    /// A cell that fired fires again without light.
    Afterpulsing,
    /// A calibration has an error of its own.
    CalibrationResiduals,
    /// Warm air makes the light of an echo vary.
    Scintillation,
}

/// An effect that is not modelled, on one sensor in one environment.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LeftOut {
    /// The effect.
    pub effect: Unmodelled,
    /// How large it would be, as a clause for people.
    pub size: String,
}

impl Unmodelled {
    /// All of them.
    pub const ALL: [Self; 10] = [
        Self::AirReturn,
        Self::Saturation,
        Self::Crosstalk,
        Self::MirrorImages,
        Self::NearFieldOverlap,
        Self::BeamWings,
        Self::SkyAndGround,
        Self::Afterpulsing,
        Self::CalibrationResiduals,
        Self::Scintillation,
    ];

    /// Name in reports and manifests.
    pub fn name(self) -> &'static str {
        match self {
            Self::AirReturn => "air-return",
            Self::Saturation => "saturation",
            Self::Crosstalk => "crosstalk",
            Self::MirrorImages => "mirror-images",
            Self::NearFieldOverlap => "near-field-overlap",
            Self::BeamWings => "beam-wings",
            Self::SkyAndGround => "sky-and-ground",
            Self::Afterpulsing => "afterpulsing",
            Self::CalibrationResiduals => "calibration-residuals",
            Self::Scintillation => "scintillation",
        }
    }

    /// The assumption that is made instead.
    pub fn assumption(self) -> &'static str {
        match self {
            Self::AirReturn => "haze, fog and rain dim light and send none of it back",
            Self::Saturation => {
                "photodiode and amplifier follow any light, recover at once and do not bloom"
            }
            Self::Crosstalk => "no channel sees the light of another",
            Self::MirrorImages => "mirrors and panes show no images",
            Self::NearFieldOverlap => "the field holds the whole beam from 0 m on",
            Self::BeamWings => "all light lies within the 1/e² circle",
            Self::SkyAndGround => "sunlight is the same in all directions",
            Self::Afterpulsing => "a detector that fires does not fire again without light",
            Self::CalibrationResiduals => "ranges and directions have no error that stays",
            Self::Scintillation => "the air is still",
        }
    }

    /// Its size on `design` in `environment`; `None` where there it cannot occur, does not follow
    /// from what the sensor file says, or falls under an effect that is idealised.
    fn size(self, design: &Design, environment: &Environment, seen: &Sized) -> Option<String> {
        let effects = way::of(design).map_or(&[][..], |way| way.effects);
        let of_way = effects.iter().find(|(effect, _)| *effect == self);
        match (self, of_way) {
            (Self::AirReturn, Some(_)) if environment.is_off(Surrounding::Atmosphere) => None,
            (_, Some((_, size))) => size.map(str::to_owned),
            (_, None) => self.size_of_marks(design, environment, seen),
        }
    }

    /// The same of light with marks.
    fn size_of_marks(
        self,
        design: &Design,
        environment: &Environment,
        seen: &Sized,
    ) -> Option<String> {
        let budget = design.budget.as_ref();
        match self {
            Self::AirReturn => {
                let reach = match seen.air_reach()? {
                    reach if reach < design.scan.min_range => {
                        "the light of the air stays below the threshold of a mark".to_owned()
                    }
                    reach => format!(
                        "the air exceeds the threshold of a mark up to {} m",
                        rounded(reach)
                    ),
                };
                Some(reach)
            }
            Self::Saturation => Some(format!(
                "white at {} m is {} times as bright as a mark has to be",
                rounded(seen.nearest()),
                rounded(seen.nearest_over_threshold()?)
            )),
            Self::Crosstalk => (design.channels() > 1).then_some(format!(
                "white at {} m shows in the next channel unless it is {} dB weaker there",
                rounded(seen.nearest()),
                rounded(10.0 * libm::log10(seen.nearest_over_threshold()?))
            )),
            Self::MirrorImages => Some(format!(
                "a pane that reflects 8 % shows the image of a white wall up to {} m",
                rounded(seen.image_reach()?)
            )),
            Self::NearFieldOverlap => Some(format!(
                "a laser beside the lens lies in its field from {} m on",
                rounded(size::overlap_from(budget?))
            )),
            Self::BeamWings => {
                let is_line = design.idealised.contains(&Effect::Footprint);
                (!is_line).then(|| "13.5 % of the light lies outside".to_owned())
            }
            Self::SkyAndGround => {
                let (white, sun) = size::brightest(budget?, environment)?;
                Some(format!(
                    "sunlit white gives {} times the counts, the sun in the field {} times",
                    rounded(white),
                    rounded(sun)
                ))
            }
            Self::Afterpulsing => match design.detector {
                Detector::PhotonCounting(_) | Detector::Geiger(_) => Some(format!(
                    "each per cent of it adds {} false detections to the marks of a shot",
                    rounded(0.01 * design.emission.coding().codebook.mean_weight())
                )),
                _ => None,
            },
            Self::CalibrationResiduals => Some(format!(
                "a data sheet has 20 mm, one sigma; points are right up to {} mm",
                rounded(1e3 * design.right_within)
            )),
            Self::Scintillation => (!environment.is_off(Surrounding::Atmosphere)).then(|| {
                let range = design.scan.rated_range;
                format!(
                    "over warm ground the light on a point {} m away varies by {} %",
                    rounded(range),
                    rounded(100.0 * size::scintillation(design.light.wavelength, range))
                )
            }),
        }
    }
}

/// All that is not modelled of `design` in `environment`, with its size.
///
/// # Errors
/// If the sensor cannot be simulated there.
pub fn of(design: &Design, environment: &Environment) -> Result<Vec<LeftOut>, Error> {
    let seen = Sized::of(design, environment)?;
    let size = |effect: Unmodelled| {
        effect.size(design, environment, &seen).map(|size| LeftOut { effect, size })
    };
    Ok(Unmodelled::ALL.into_iter().filter_map(size).collect())
}

/// Warnings where an effect that is not modelled decides what a cloud would look like: the light
/// of fog or rain exceeds the threshold.
pub fn warnings(design: &Design, environment: &Environment) -> Vec<String> {
    let reach = Sized::of(design, environment).ok().and_then(|seen| seen.air_reach());
    match reach.filter(|reach| environment.has_drops() && *reach >= design.scan.min_range) {
        None => Vec::new(),
        Some(reach) => vec![format!(
            "{} in {}: the light that the air sends back exceeds the threshold of a mark up to {} \
             m, and it is not simulated: a real cloud has points of fog or rain there (docs/limits.md)",
            design.name,
            environment.name,
            rounded(reach)
        )],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAGE: &str = include_str!("../../../../../docs/limits.md");

    fn names(sensor: &str, environment: &str) -> Vec<&'static str> {
        let design = Design::open(sensor, &[]).unwrap();
        let environment = Environment::named(environment).unwrap();
        of(&design, &environment).unwrap().iter().map(|left| left.effect.name()).collect()
    }

    #[test]
    fn a_sensor_that_idealises_nothing_still_has_a_list() {
        assert!(Design::open("coded-32", &[]).unwrap().idealised.is_empty());
        let mut wanted = Unmodelled::ALL.map(Unmodelled::name).to_vec();
        wanted.retain(|name| *name != "afterpulsing");
        assert_eq!(names("coded-32", "clear-day"), wanted);
        assert!(names("kim-park-2016", "clear-day").contains(&"afterpulsing"));
    }

    #[test]
    fn what_cannot_occur_is_left_out() {
        let dark = names("coded-32", "vacuum-dark");
        for name in ["air-return", "sky-and-ground", "scintillation"] {
            assert!(!dark.contains(&name), "{name}");
        }
        assert!(!names("coded-practical", "clear-day").contains(&"crosstalk"));
        // Its beam has no width at all, and says so under `idealised`.
        assert!(!names("hdl-64e", "clear-day").contains(&"beam-wings"));
    }

    /// The light of the fog decides up to 15 m; clear air and a vacuum are no reason to warn.
    #[test]
    fn fog_and_rain_are_warned_of() {
        let design = Design::open("vlp-16", &[]).unwrap();
        let told = |name: &str| warnings(&design, &Environment::named(name).unwrap()).concat();
        assert!(told("fog-50m").contains("threshold of a mark up to 15 m"), "{}", told("fog-50m"));
        assert!(told("rain-25mm").contains("vlp-16 in rain-25mm"));
        assert_eq!((told("clear-day"), told("vacuum-dark")), (String::new(), String::new()));
    }

    #[test]
    fn each_has_its_formula_on_the_page() {
        let (_, formulas) = PAGE.split_once("## Formulas").unwrap();
        for effect in Unmodelled::ALL {
            let row = format!("| `{}` | ", effect.name());
            assert_eq!(formulas.matches(&row).count(), 1, "{row}");
        }
    }
}

//! From typed keys to a checked `Design`.

mod effectless;
mod emitted;
mod misplaced;
mod optional;

use std::sync::OnceLock;

use schemars::JsonSchema;
use serde::Deserialize;

pub(in crate::design) use optional::{Continuous, OptionalTable};

use super::budget::{self, BudgetFile, OpticsFile, SafetyFile};
use super::burst::BurstFile;
use super::chirp::ChirpFile;
use super::coding::CodeFile;
use super::detector::{Before, ComparatorFile, DetectorFile, Efficiency};
use super::document::Chain;
use super::emission::Occupancy;
use super::histogram::HistogramFile;
use super::light::LightFile;
use super::limits::Check;
use super::modulation::ModulationFile;
use super::readout::{AdcFile, TdcFile};
use super::receiver::{Inputs, ReceiverFile};
use super::scan::ScanFile;
use super::spectrum::SpectrumFile;
use super::{Clock, Design, Detector, Effect, Emission, Error, Light, Scan};
use crate::names::nearest;
use crate::schema;
use crate::units::{RMS_OF_FWHM, range_from_tof, s_from_fs};

/// A sensor file as typed: keys with units, nothing checked yet but names and types.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(in crate::design) struct SensorFile {
    /// Format of this file: 1.
    #[schemars(range(min = 1, max = 1))]
    pub version: u32,
    /// Short name.
    pub name: String,
    /// Description of the sensor, in one sentence.
    #[serde(default)]
    pub summary: String,
    /// Effects that are left out.
    #[schemars(with = "Vec<Effect>")]
    pub idealised: Vec<String>,
    /// Directions and times at which the sensor looks: scans, ranges, and one scan pattern.
    pub scan: ScanFile,
    /// The light it sends.
    pub light: LightFile,
    /// The code that its shots carry; leave the table out for shots without a code.
    pub code: Option<CodeFile>,
    /// Pulses that a shot without a code repeats; leave the table out for single ones.
    pub burst: Option<BurstFile>,
    /// Modulation of the light of a shot without pulses; leave the table out for pulses.
    pub modulation: Option<ModulationFile>,
    /// Ramps of the frequency of the light of a shot without pulses; leave the table out for pulses.
    pub chirp: Option<ChirpFile>,
    /// From light to detection events, to a signal, to taps or to beats: one kind of detector.
    pub detector: DetectorFile,
    /// From the signal of a photodiode to detection events.
    pub comparator: Option<ComparatorFile>,
    /// The optics of the receiver; with a link budget.
    pub optics: Option<OpticsFile>,
    /// How the energy that laser class 1 allows is worked out.
    pub safety: Option<SafetyFile>,
    /// From detection events to ticks: the bank of converters.
    pub tdc: TdcFile,
    /// From the signal of a photodiode to samples, in place of comparator and converters of events.
    pub adc: Option<AdcFile>,
    /// From counts to histograms; leave the table out where detection events are timed or sampled.
    pub histogram: Option<HistogramFile>,
    /// From beats to the peaks of their spectra; with a chirp.
    pub spectrum: Option<SpectrumFile>,
    /// From ticks, samples, histograms, taps or beats to returns.
    pub receiver: ReceiverFile,
}

impl SensorFile {
    /// Returns true if its detector puts out a signal, for a comparator or an ADC.
    fn has_signal(&self) -> bool {
        self.detector.only().is_some_and(|only| only.file.has_signal())
    }

    /// Returns true if its light comes in pulses.
    fn is_pulsed(&self) -> bool {
        self.continuous().next().is_none()
    }

    /// The ADC, where there is a signal for it.
    fn adc(&self) -> Option<&AdcFile> {
        self.adc.as_ref().filter(|_| self.has_signal())
    }
}

/// The format this program reads.
const VERSION: u32 = 1;

/// Largest range error, m, up to which a return may count as right.
const WIDEST: f64 = 0.35;

pub(super) fn design(chain: &Chain) -> Result<Design, Error> {
    misplaced::refuse_moved(chain)?;
    misplaced::refuse_former(chain)?;
    let file: SensorFile =
        schema::read(&chain.merged).map_err(|misfit| misplaced::typed_wrongly(chain, &misfit))?;
    if file.version != VERSION {
        let message = format!("is {}, but this program reads version {VERSION}", file.version);
        return Err(chain.error("version", message));
    }
    if file.name.trim().is_empty() {
        return Err(chain.error("name", "is empty; name the sensor, as \"mine\""));
    }
    let mut faults = Faults::default();
    let check = Check { chain };
    let Some(mut design) = of_sections(&check, file, &mut faults) else {
        return Err(faults.into_error(chain));
    };
    if faults.keep(check.clock(&design)).is_some() {
        faults.keep(check.work(&design));
    }
    faults.keep(check.timing(&mut design));
    faults.keep(check.facets(&design));
    if faults.is_empty() { Ok(design) } else { Err(faults.into_error(chain)) }
}

/// Returns a sensor whose sections are right, each by itself. The caller checks the remaining demands between
/// them. If something is wrong, the result is `None`, and `faults` holds all faults that do not follow from
/// earlier ones.
fn of_sections(check: &Check, typed: SensorFile, faults: &mut Faults) -> Option<Design> {
    let file = &typed;
    let effects = faults.keep(check.effects(&file.idealised));
    let off = |effect| effects.as_ref().is_some_and(|effects| effects.contains(&effect));
    // A list that cannot be read says nothing about the motion of the beam.
    let moves = effects.is_some() && !off(Effect::MirrorMotion);
    let scan = faults.keep(check.scan(&file.scan, moves));
    let timing = faults.keep(check.readout(file));
    let emission = match (&scan, &timing) {
        (Some(scan), Some((clock, readout))) => {
            faults.keep(check.share(readout, scan));
            let emission = faults.keep(check.emission(file, scan, *clock));
            if let Some(emission) = &emission {
                faults.keep(check.cycles(file, emission, (*clock, readout), scan));
                faults.keep(check.stands(emission, scan, moves));
            }
            emission
        }
        _ => None,
    };
    let light = effects.as_ref().and_then(|effects| {
        faults.0.extend(check.without_effect(file, effects));
        faults.0.extend(check.not_followed(&file.detector, effects));
        faults.keep(check.light(&file.light, file.is_pulsed(), scan.as_ref(), off))
    });
    let right_within = match file.receiver.right_within_m {
        Some(typed) => {
            faults.keep(check.within("receiver.right_within_m", typed, 0.0, WIDEST)).map(Some)
        }
        None => Some(None),
    };
    let (idealised, scan, (clock, readout)) = (effects?, scan?, timing?);
    let (emission, light) = (emission?, light?);
    let before = budget::Parts {
        scan: &scan,
        light: &light,
        emission: &emission,
        readout: &readout,
        idealised: &idealised,
    };
    let efficiency = Efficiency::of(&file.detector);
    let of_budget = BudgetFile {
        optics: file.optics.as_ref(),
        safety: file.safety.as_ref(),
        energy: file.light.energy,
    };
    let budget = faults.keep(check.budget(&of_budget, &before, &efficiency));
    let before = Before {
        scan: &scan,
        light: &light,
        emission: &emission,
        readout: &readout,
        budget: budget.as_ref().and_then(Option::as_ref),
        comparator: file.comparator.as_ref(),
        adc: file.adc(),
    };
    let detector =
        budget.as_ref().and_then(|_| faults.keep(check.detector(&file.detector, &before)));
    // Without a detector the receiver has no timing, but none of its limits depends on that.
    let spread = detector.as_ref().and_then(|detector| detector.spread_of(&light));
    let jitter = detector.as_ref().map_or(0.0, |detector| detector.model().jitter());
    let inputs = Inputs {
        detector_file: &file.detector,
        detector: detector.as_ref(),
        scan: &scan,
        clock,
        readout: &readout,
        emission: &emission,
        timing: libm::hypot(jitter, spread.unwrap_or(0.0)),
        photons_apart: spread.is_some(),
        pulse: libm::hypot(jitter, light.pulse * RMS_OF_FWHM),
    };
    let receiver = faults.keep(check.receiver(&file.receiver, &inputs)).flatten();
    if !faults.is_empty() {
        return None;
    }
    let (budget, detector, receiver) = (budget?, detector?, receiver?);
    let right_within = right_within?.unwrap_or_else(|| resolved(&detector, &light, clock));
    // Keys without effect belong neither to the sensor nor to its digest.
    let said = check.chain.clone().without(&effectless::idle_keys(file, &idealised));
    let warnings = scan.model().notes().to_vec();
    Some(Design {
        name: typed.name,
        summary: typed.summary,
        scan,
        light,
        emission,
        budget,
        detector,
        clock,
        readout,
        receiver,
        right_within,
        idealised,
        defaults: said.defaults_used(),
        warnings,
        text: said.text(),
        directions: OnceLock::new(),
    })
}

/// The faults found so far.
#[derive(Default)]
struct Faults(Vec<Error>);

impl Faults {
    /// Returns the checked value; keeps the error and returns `None` if something was wrong with it.
    fn keep<T>(&mut self, checked: Result<T, Error>) -> Option<T> {
        checked.map_err(|error| self.0.push(error)).ok()
    }

    fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// All of it as one error.
    fn into_error(self, chain: &Chain) -> Error {
        Error::all(self.0).unwrap_or_else(|| chain.error("", "is no sensor"))
    }
}

/// Returns the range error, m, up to which a return of this sensor is called right if its file does not say.
/// It is four standard deviations of a single detection event, with a whole tick counted as one of its own:
///
/// c/2 · 4·√(σ² + tick²)
///
/// σ the jitter with the length of a micropulse as far as it matters to the detector.
fn resolved(detector: &Detector, light: &Light, clock: Clock) -> f64 {
    let sigma = detector.model().resolution(light);
    range_from_tof(4.0 * libm::hypot(sigma, s_from_fs(clock.tick_fs))).min(WIDEST)
}

impl Check<'_> {
    /// Checks that the beam stands while a shot is sent, as it is simulated. If it `moves`, that has to be
    /// idealised.
    fn stands(&self, emission: &Emission, scan: &Scan, moves: bool) -> Result<(), Error> {
        if matches!(emission, Emission::Marks(_)) || !moves || scan.is_one_flash() {
            return Ok(());
        }
        let message = "the beam is not followed while it sends a [burst], a [modulation] or a [chirp]: put \"mirror-motion\" on this \
                       list, or --without mirror-motion";
        self.refuse("idealised", message)
    }

    fn effects(&self, names: &[String]) -> Result<Vec<Effect>, Error> {
        let mut found = Vec::new();
        for name in names {
            match Effect::ALL.into_iter().find(|effect| effect.name() == name) {
                Some(effect) => found.push(effect),
                None if crate::environment::Effect::named(name).is_some() => {
                    let message = format!(
                        "`{name}` is an effect of sun and air, which belong to the scene: take it \
                         off this list; `environment = \"vacuum-dark\"` in the scene file, or \
                         --without {name}, leaves it out"
                    );
                    return self.refuse("idealised", message);
                }
                None => {
                    let known: Vec<&str> = Effect::ALL.iter().map(|e| e.name()).collect();
                    let hint = nearest(name, known.iter().copied())
                        .map(|near| format!("did you mean `{near}`? "))
                        .unwrap_or_default();
                    let message =
                        format!("`{name}` is no effect; {hint}known are {}", known.join(", "));
                    return self.refuse("idealised", message);
                }
            }
        }
        Ok(found)
    }

    /// One shot and all that arrives together with its echoes must be within what is timed in
    /// one go.
    fn clock(&self, design: &Design) -> Result<(), Error> {
        if design.longest_band_fs() < 0 {
            return self.too_fine(&design.readout);
        }
        Ok(())
    }

    /// The facets of a polygon must hold the light that comes and goes at both ends of a line.
    fn facets(&self, design: &Design) -> Result<(), Error> {
        let Some((raster, polygon)) = design.scan.polygon() else { return Ok(()) };
        let horizontal = raster.grid.horizontal;
        let beam = (design.light.beam_diameter, "beam");
        let aperture = design.budget.as_ref().map(|budget| (budget.aperture, "aperture"));
        let (width, of) = aperture.filter(|aperture| aperture.0 > beam.0).unwrap_or(beam);
        let widest = polygon.widest(horizontal);
        if width <= widest {
            return Ok(());
        }
        let message = format!(
            "at the ends of a line the facets, {:.1} mm wide, hold light of {:.1} mm, and the {of} has \
             {:.1}: {:.1} or more, or fewer facets",
            polygon.facet() * 1e3,
            widest * 1e3,
            width * 1e3,
            (polygon.least_diameter(horizontal, width) * 1e4).ceil() * 0.1
        );
        self.refuse("scan.raster.mirror.polygon.diameter_mm", message)
    }

    /// A macropulse must end before the next one that the same detector sees begins.
    fn timing(&self, design: &mut Design) -> Result<(), Error> {
        let derived = design.derived();
        if let Some(Occupancy { fs, table, with, remedy }) = design.emission.model().occupancy()
            && s_from_fs(fs) > derived.channel_period
        {
            let message = format!(
                "lasts {:.3} µs{with}, longer than the {:.3} µs between two shots of a detector: {remedy}, or a \
                 slower scan",
                s_from_fs(fs) * 1e6,
                derived.channel_period * 1e6
            );
            return self.refuse(table, message);
        }
        if design.is_coded() && derived.macropulse > derived.channel_period {
            let of = match design.channels() {
                1 => "of a pixel",
                _ => "between two shots of a detector",
            };
            let message = format!(
                "a macropulse lasts {:.3} ns, longer than the {:.3} ns {of}: \
                 fewer bits, shorter words or chips, or a slower scan",
                derived.macropulse * 1e9,
                derived.channel_period * 1e9
            );
            return self.refuse("code", message);
        }
        if design.is_coded() && derived.macropulse > derived.shortest_dwell {
            design.warnings.push(format!(
                "a macropulse ({:.2} ns) is longer than the shortest dwell ({:.2} ns): neighbouring \
                 macropulses overlap on their way out",
                derived.macropulse * 1e9,
                derived.shortest_dwell * 1e9
            ));
        }
        if let Some(range) = derived.unambiguous_range
            && range < design.scan.max_range
        {
            let repeats = match design.is_coded() {
                true => "a code word returns",
                false => design.emission.model().ambiguity(),
            };
            design.warnings.push(format!(
                "{repeats} after {range:.1} m, within the range gate of {:.1} m",
                design.scan.max_range
            ));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use crate::design::{Design, Readout};

    /// A comparator or an ADC that a file puts behind a photodiode replaces that of the sensor that it
    /// extends.
    #[test]
    fn a_comparator_replaces_an_adc_and_an_adc_a_comparator() {
        let open = |extends: &str, text: &str| {
            let text = format!("version = 1\nextends = \"{extends}\"\nname = \"mine\"\n{text}");
            Design::from_toml(&text, "mine.toml", Path::new(""), &[])
                .map_err(|error| error.to_string())
        };
        let events = "[comparator]\nfalse_alarm_hz = 1e5\n[tdc]\nconverters = 32\n\
                      resolution_ps = 100.0\n[receiver]\nkind = \"matched\"\n";
        let design = open("coded-32", events).unwrap();
        assert!(matches!(design.readout, Readout::Tdc(_)) && !design.text.contains("[adc]"));
        let samples = "[detector.photodiode]\nisolation_db = 60.0\n[adc]\nsample_ps = 125.0\n\
                       bits = 11\nstep_photons = 15.0\n[receiver]\nkind = \"sampled\"\n";
        let design = open("coded-practical", samples).unwrap();
        assert_eq!(design.readout, Readout::Adc);
        assert!(!design.text.contains("[comparator]") && !design.text.contains("[tdc]"));
        let told = open("coded-practical", "[detector.photodiode]\nisolation_db = 60.0\n");
        let told = told.unwrap_err();
        assert!(told.contains("isolation_db: has no effect because of `comparator`"), "{told}");
        let told = open("kim-park-2016", "[comparator]\nfalse_alarm_hz = 1.0\n").unwrap_err();
        assert!(told.contains("comparator: has no effect because of `detector`"), "{told}");
    }

    /// Values that the files of the ready sensors state, or that followed for files that did not: 1.5 mm of
    /// the paper's. Each is reproduced to a third.
    #[test]
    fn what_a_sensor_resolves_is_near_what_its_file_calls_right() {
        for (name, typed) in [
            ("kim-park-2016", 1.5e-3),
            ("bipolar-gold", 1.5e-3),
            ("coded-practical", 0.05),
            ("hdl-64e", 0.06),
            ("peregrine", 0.15),
        ] {
            let design = Design::open(name, &[]).unwrap();
            let found = super::resolved(&design.detector, &design.light, design.clock);
            assert!((0.7..1.4).contains(&(found / typed)), "{name}: {found} m, not {typed} m");
        }
    }

    #[test]
    fn a_typed_value_wins_and_a_coarse_sensor_is_bounded() {
        let open = |key: &str, value: &str| {
            Design::open("kim-park-2016", &[(key.to_owned(), value.to_owned())]).unwrap()
        };
        assert_eq!(open("receiver.right_within_m", "0.02").right_within, 0.02);
        let jitter = "detector.photon-counting.jitter_ps";
        assert!(open(jitter, "2.0").right_within > open(jitter, "0.5").right_within);
        assert_eq!(open(jitter, "5000").right_within, super::WIDEST);
    }
}

//! From typed keys to a checked `Design`: every limit is tested here, once.

use std::sync::OnceLock;

use super::document::Chain;
use super::file::{
    CodeFile, DetectorFile, FamilyFile, ReceiverKindFile, ScanFile, SensitivityFile, SensorFile,
    SpinningFile,
};
use super::{
    Coding, Design, Detector, Effect, Error, FirstFiring, Light, PARTS_OF_TICK, Pattern,
    PhotonCounting, Scan, Sensitivity, Tdc,
};
use crate::code::{Codebook, Crc, Family, Payload};
use crate::decode::{Receiver, ReceiverKind};
use crate::units::{fs_from_s, tof_from_range};

/// Pixels of the largest range image: a scan of it takes some 4 GB.
const MOST_PIXELS: u64 = 1 << 25;

/// Said where 2²⁶ ticks do not hold the echoes of one shot and of those in flight with it.
const TOO_FINE: &str = "is too fine for so long a range gate: three gates (one, if shots are not coded) with the \
     jitter must be within 67 million ticks; use longer ticks or a shorter max_range_m";

/// The format this program reads.
const VERSION: u32 = 1;

pub(super) fn design(chain: &Chain) -> Result<Design, Error> {
    let file: SensorFile =
        serde_path_to_error::deserialize(toml::Value::Table(chain.merged.clone()))
            .map_err(|error| typed_wrongly(chain, &error))?;
    if file.version != VERSION {
        let message = format!("is {}, but this program reads version {VERSION}", file.version);
        return Err(chain.error("version", message));
    }
    let check = Check { chain };
    let idealised = check.effects(&file.idealised)?;
    let scan = check.scan(&file.scan)?;
    let tdc = check.tdc(&file)?;
    let coding = check.coding(file.code.as_ref(), &scan, &tdc)?;
    let off = |effect| idealised.contains(&effect);
    let light = check.light(&file, off(Effect::Footprint))?;
    let detector = check.detector(&file.detector, off(Effect::Background))?;
    let visibility =
        check.within("atmosphere.visibility_km", file.atmosphere.visibility_km, 0.01, 1e3)? * 1e3;
    let receiver = check.receiver(&file, &scan, &tdc, (&coding, detector))?;
    let right_within =
        check.within("receiver.right_within_m", file.receiver.right_within_m, 0.0, 0.35)?;
    let mut design = Design {
        name: file.name,
        summary: file.summary,
        scan,
        light,
        coding,
        detector,
        visibility: (!off(Effect::Atmosphere)).then_some(visibility),
        tdc,
        receiver,
        right_within,
        idealised,
        defaults: chain.defaults_used(),
        warnings: Vec::new(),
        text: chain.text(),
        directions: OnceLock::new(),
    };
    check.clock(&design)?;
    check.timing(&mut design)?;
    Ok(design)
}

/// Turns serde's words into a sentence with a place and the nearest known key.
fn typed_wrongly(chain: &Chain, error: &serde_path_to_error::Error<toml::de::Error>) -> Error {
    let path = error.path().to_string();
    let said = error.inner().message().to_owned();
    let path = if path == "." { String::new() } else { path };
    let quoted: Vec<&str> = said.split('`').skip(1).step_by(2).collect();
    if said.starts_with("unknown field") || said.starts_with("unknown variant") {
        let (wrong, known) = (quoted[0], &quoted[1..]);
        let hint = crate::names::nearest(wrong, known.iter().copied())
            .map(|near| format!("; did you mean `{near}`?"))
            .unwrap_or_else(|| format!("; known are {}", known.join(", ")));
        let what = if said.starts_with("unknown field") { "key" } else { "value" };
        let place = match (what, path.as_str()) {
            ("value", _) => path.clone(),
            (_, "") => wrong.to_owned(),
            (_, inside) if inside.ends_with(wrong) => path.clone(),
            (_, inside) => format!("{inside}.{wrong}"),
        };
        return chain.error(&place, format!("unknown {what} `{wrong}`{hint}"));
    }
    if said.starts_with("missing field") {
        return chain.error(&path, format!("the key `{}` is missing", quoted[0]));
    }
    chain.error(&path, said)
}

struct Check<'a> {
    chain: &'a Chain,
}

impl Check<'_> {
    fn refuse<T>(&self, path: &str, message: impl Into<String>) -> Result<T, Error> {
        Err(self.chain.error(path, message))
    }

    /// A number in [least, most]; NaN and infinities are refused by the same comparison.
    fn within(&self, path: &str, value: f64, least: f64, most: f64) -> Result<f64, Error> {
        if value >= least && value <= most {
            return Ok(value);
        }
        self.refuse(path, format!("is {value}, but must lie between {least} and {most}"))
    }

    fn count(&self, path: &str, value: u32, least: u32, most: u32) -> Result<u32, Error> {
        if (least..=most).contains(&value) {
            return Ok(value);
        }
        self.refuse(path, format!("is {value}, but must lie between {least} and {most}"))
    }

    /// A duration that must be a whole, positive number of femtoseconds.
    fn whole_fs(&self, path: &str, picoseconds: f64) -> Result<i64, Error> {
        let ps = self.within(path, picoseconds, 1e-3, 1e9)?;
        let fs = (ps * 1e3).round();
        if (ps * 1e3 - fs).abs() > 1e-6 * fs {
            return self
                .refuse(path, format!("is {ps} ps, but must be a whole number of femtoseconds"));
        }
        Ok(fs as i64)
    }

    fn effects(&self, names: &[String]) -> Result<Vec<Effect>, Error> {
        let mut found = Vec::new();
        for name in names {
            match Effect::ALL.into_iter().find(|effect| effect.name() == name) {
                Some(effect) => found.push(effect),
                None => {
                    let known: Vec<&str> = Effect::ALL.iter().map(|e| e.name()).collect();
                    let hint = crate::names::nearest(name, known.iter().copied())
                        .map(|near| format!("; did you mean `{near}`?"))
                        .unwrap_or_default();
                    let message =
                        format!("`{name}` is no effect{hint} known are {}", known.join(", "));
                    return self.refuse("idealised", message);
                }
            }
        }
        for effect in Effect::ALL {
            if !effect.is_modelled() && !found.contains(&effect) {
                let message = format!(
                    "`{}` is not modelled yet: add it to this list, which declares that {}",
                    effect.name(),
                    effect.assumption()
                );
                return self.refuse("idealised", message);
            }
        }
        Ok(found)
    }

    fn scan(&self, file: &ScanFile) -> Result<Scan, Error> {
        let rate = self.within("scan.scans_per_s", file.scans_per_s, 1e-3, 1e5)?;
        let reach = self.within("scan.max_range_m", file.max_range_m, 0.01, 1e5)?;
        let beyond = self.within("scan.gate_beyond_m", file.gate_beyond_m, 0.0, 1e5)?;
        let max_range = reach + beyond;
        let min_range = self.within("scan.min_range_m", file.min_range_m, 0.0, max_range)?;
        let pixels = |kind: &str, rows, columns| -> Result<(u32, u32), Error> {
            Ok((
                self.count(&format!("scan.{kind}.rows"), rows, 1, 1 << 14)?,
                self.count(&format!("scan.{kind}.columns"), columns, 1, 1 << 15)?,
            ))
        };
        let field = |kind: &str, horizontal, vertical| -> Result<(f64, f64), Error> {
            Ok((
                self.within(&format!("scan.{kind}.horizontal_deg"), horizontal, 1e-3, 360.0)?
                    .to_radians(),
                self.within(&format!("scan.{kind}.vertical_deg"), vertical, 1e-3, 180.0)?
                    .to_radians(),
            ))
        };
        let (rows, columns, pattern) = match (&file.raster, &file.spinning, &file.flash) {
            (Some(raster), None, None) => {
                let (rows, columns) = pixels("raster", raster.rows, raster.columns)?;
                let (horizontal, vertical) =
                    field("raster", raster.horizontal_deg, raster.vertical_deg)?;
                let duty = self.within("scan.raster.duty", raster.duty, 0.01, 1.0)?;
                let mirror = raster.mirror;
                (rows, columns, Pattern::Raster { horizontal, vertical, mirror, duty })
            }
            (None, Some(spinning), None) => self.spinning(spinning)?,
            (None, None, Some(flash)) => {
                let (rows, columns) = pixels("flash", flash.rows, flash.columns)?;
                if rows * columns > 65_536 {
                    return self.refuse("scan.flash", "has more than 65536 detectors");
                }
                let (horizontal, vertical) =
                    field("flash", flash.horizontal_deg, flash.vertical_deg)?;
                (rows, columns, Pattern::Flash { horizontal, vertical })
            }
            _ => {
                return self.refuse(
                    "scan",
                    "needs exactly one of [scan.raster], [scan.spinning], [scan.flash]",
                );
            }
        };
        if u64::from(rows) * u64::from(columns) > MOST_PIXELS {
            let message = format!("{rows} x {columns} pixels are more than {MOST_PIXELS}");
            return self.refuse("scan", message);
        }
        let rate_millihertz = (rate * 1e3).round() as u64;
        Ok(Scan { rows, columns, rate_millihertz, min_range, reach, max_range, pattern })
    }

    fn spinning(&self, file: &SpinningFile) -> Result<(u32, u32, Pattern), Error> {
        let path = "scan.spinning.azimuth_step_deg";
        let step = self.within(path, file.azimuth_step_deg, 0.012, 90.0)?;
        let path = "scan.spinning.blocks";
        let mut elevations = Vec::new();
        let mut turns: Vec<(u32, usize)> = Vec::new();
        for block in &file.blocks {
            for laser in 0..self.count(path, block.lasers, 1, 1024)? {
                let elevation = block.first_deg + f64::from(laser) * block.step_deg;
                turns.push((laser, elevations.len()));
                elevations.push(self.within(path, elevation, -90.0, 90.0)?.to_radians());
            }
        }
        if elevations.is_empty() {
            return self.refuse(path, "names no laser");
        }
        if !elevations.is_sorted_by(|above, below| above > below) {
            return self.refuse(path, "must list the elevations from the top down");
        }
        turns.sort_unstable();
        let order = turns.into_iter().map(|(_, row)| row as u16).collect();
        let rows = elevations.len() as u32;
        let columns = (360.0 / step).round() as u32;
        Ok((rows, columns, Pattern::Spinning { elevations, order, firing: file.firing }))
    }

    fn light(&self, file: &SensorFile, footprint_off: bool) -> Result<Light, Error> {
        let light = &file.light;
        let rays = light.footprint_rays;
        if ![1, 7, 19].contains(&rays) {
            return self
                .refuse("light.footprint_rays", format!("is {rays}, but can be 1, 7 or 19"));
        }
        let divergence = self.within("light.divergence_mrad", light.divergence_mrad, 0.0, 500.0)?;
        if !footprint_off && (rays == 1 || divergence == 0.0) {
            return self.refuse(
                "light.footprint_rays",
                "the footprint is not idealised: it needs 7 or 19 rays and a divergence, \
                 or \"footprint\" in the list `idealised`",
            );
        }
        Ok(Light {
            wavelength: self.within("light.wavelength_nm", light.wavelength_nm, 200.0, 20e3)?
                * 1e-9,
            beam_diameter: self.within(
                "light.beam_diameter_mm",
                light.beam_diameter_mm,
                0.0,
                1e3,
            )? * 1e-3,
            divergence: if footprint_off { 0.0 } else { divergence * 1e-3 },
            footprint_rays: if footprint_off { 1 } else { rays },
            pulse: self.within("light.pulse_ps", light.pulse_ps, 1e-3, 1e9)? * 1e-12,
        })
    }

    fn tdc(&self, file: &SensorFile) -> Result<Tdc, Error> {
        let tick_fs = self.whole_fs("tdc.resolution_ps", file.tdc.resolution_ps)?;
        let clock_fs = self.whole_fs("tdc.clock_ps", file.tdc.clock_ps)?;
        let bits = self.count("tdc.bits", file.tdc.bits, 1, 16)?;
        if clock_fs % tick_fs != 0 {
            return self.refuse("tdc.clock_ps", "must be a whole number of ticks (resolution_ps)");
        }
        if clock_fs / tick_fs > 1 << bits {
            let message = format!(
                "{bits} bits hold {} ticks, but a clock period has {}",
                1 << bits,
                clock_fs / tick_fs
            );
            return self.refuse("tdc.bits", message);
        }
        let dead = self.within("tdc.dead_time_ns", file.tdc.dead_time_ns, 0.0, 1e6)?;
        Ok(Tdc {
            converters: self.count("tdc.converters", file.tdc.converters, 1, 1 << 24)?,
            tick_fs,
            clock_fs,
            dead_fs: fs_from_s(dead * 1e-9),
        })
    }

    fn coding(&self, file: Option<&CodeFile>, scan: &Scan, tdc: &Tdc) -> Result<Coding, Error> {
        let Some(file) = file else {
            return Ok(Coding {
                codebook: Codebook::single(),
                chip_fs: tdc.tick_fs,
                label: None,
                first_word: 0,
                word_modulus: 1,
            });
        };
        if !matches!(scan.pattern, Pattern::Raster { .. }) {
            return self.refuse("code", "only a raster can be coded; leave [code] out");
        }
        let family = match file.family {
            FamilyFile::Prime(p) => Family::prime(p)
                .or_else(|error| self.refuse("code.family.prime", error.to_string()))?,
        };
        let chip_fs = self.whole_fs("code.chip_ps", file.chip_ps)?;
        if chip_fs % tdc.tick_fs != 0 {
            return self.refuse("code.chip_ps", "must be a whole number of TDC ticks");
        }
        let label_bits = self.count("code.label_bits", file.label_bits, 1, 16)?;
        if scan.columns > 1 << label_bits {
            let message = format!("{label_bits} bits cannot number {} columns", scan.columns);
            return self.refuse("code.label_bits", message);
        }
        let crc =
            Crc { width: file.crc.width, polynomial: file.crc.polynomial, init: file.crc.init };
        let payload = Payload::new(label_bits, crc, file.sync_bit)
            .or_else(|error| self.refuse("code.crc", error.to_string()))?;
        let dark = (0..scan.columns).find(|&label| payload.is_dark(label as u16));
        if let (Some(label), false) = (dark, file.allow_dark) {
            let message = format!(
                "label {label} is {} zero bits and sends no light: set sync_bit = true or another \
                 crc init, or accept it with allow_dark = true",
                payload.bits()
            );
            return self.refuse("code.allow_dark", message);
        }
        let words = family.count() as u32;
        let modulus = self.count("code.word.modulus", file.word.modulus, 1, words)?;
        let first = self.count("code.word.first", file.word.first, 0, words - modulus)?;
        let codebook = Codebook::new(family, Some(payload), scan.columns)
            .or_else(|error| self.refuse("code", error.to_string()))?;
        Ok(Coding {
            codebook,
            chip_fs,
            label: Some(file.label),
            first_word: first,
            word_modulus: modulus,
        })
    }

    fn detector(&self, file: &DetectorFile, dark_sky: bool) -> Result<Detector, Error> {
        match (&file.photon_counting, &file.first_firing) {
            (Some(counting), None) => {
                let at = |key: &str| format!("detector.photon-counting.{key}");
                let pd = self.pd(&at("sensitivity"), &counting.sensitivity)?;
                let dark =
                    self.within(&at("dark_counts_hz"), counting.dark_counts_hz, 0.0, 1e12)?;
                let light = self.within(&at("background_hz"), counting.background_hz, 0.0, 1e12)?;
                Ok(Detector::PhotonCounting(PhotonCounting {
                    sensitivity: sensitivity(&counting.sensitivity, -(-pd).ln_1p()),
                    missed_marks: self.within(
                        &at("missed_marks"),
                        counting.missed_marks,
                        0.0,
                        1.0,
                    )?,
                    false_rate: dark + if dark_sky { 0.0 } else { light },
                    jitter: self.within(&at("jitter_ps"), counting.jitter_ps, 0.0, 1e6)? * 1e-12,
                }))
            }
            (None, Some(firing)) => {
                let at = |key: &str| format!("detector.first-firing.{key}");
                let pd = self.pd(&at("sensitivity"), &firing.sensitivity)?;
                let needed =
                    self.count(&at("firing_photons"), firing.firing_photons, 1, 1 << 20)?;
                let noise = self.within(&at("noise_photons"), firing.noise_photons, 0.0, 1e6)?;
                let photons = crate::detect::photons_for(pd, needed, noise);
                Ok(Detector::FirstFiring(FirstFiring {
                    sensitivity: sensitivity(&firing.sensitivity, photons),
                    firing_photons: needed,
                    noise_photons: noise,
                    false_rate: self.within(
                        &at("false_firing_hz"),
                        firing.false_firing_hz,
                        0.0,
                        1e9,
                    )?,
                    jitter: self.within(&at("jitter_ps"), firing.jitter_ps, 0.0, 1e6)? * 1e-12,
                }))
            }
            _ => self.refuse(
                "detector",
                "needs exactly one of [detector.photon-counting], [detector.first-firing]",
            ),
        }
    }

    fn pd(&self, path: &str, file: &SensitivityFile) -> Result<f64, Error> {
        self.within(&format!("{path}.range_m"), file.range_m, 0.01, 1e6)?;
        self.within(&format!("{path}.reflectance"), file.reflectance, 1e-6, 1e6)?;
        self.within(&format!("{path}.pd"), file.pd, 1e-6, 1.0)
    }

    fn receiver(
        &self,
        file: &SensorFile,
        scan: &Scan,
        tdc: &Tdc,
        (coding, detector): (&Coding, Detector),
    ) -> Result<Receiver, Error> {
        let kind = match file.receiver.kind {
            ReceiverKindFile::Literal => ReceiverKind::Literal,
            ReceiverKindFile::Blind => ReceiverKind::Blind,
            ReceiverKindFile::Matched => ReceiverKind::Matched,
            ReceiverKindFile::Direct => ReceiverKind::Direct,
        };
        if (kind == ReceiverKind::Direct) == coding.label.is_some() {
            return self.refuse(
                "receiver.kind",
                "`direct` is for shots without [code], the other receivers for shots with it",
            );
        }
        let ticks = |range: f64| fs_from_s(tof_from_range(range)) / tdc.tick_fs;
        let gate = (ticks(scan.min_range), ticks(scan.max_range));
        if gate.1 >= i64::from(u32::MAX / PARTS_OF_TICK) {
            return self.refuse("tdc.resolution_ps", TOO_FINE);
        }
        let weight = coding.codebook.family().weight() as u32;
        Ok(Receiver {
            kind,
            gate_ticks: (gate.0 as u32, gate.1 as u32),
            ticks_per_chip: (coding.chip_fs / tdc.tick_fs) as u32,
            tick_fs: tdc.tick_fs,
            jitter_ticks: detector.jitter() * 1e15 / tdc.tick_fs as f64,
            false_alarm: self.within(
                "receiver.false_alarm",
                file.receiver.false_alarm,
                1e-30,
                0.5,
            )?,
            bit_threshold: if coding.label.is_some() {
                self.count("receiver.bit_threshold", file.receiver.bit_threshold, 1, weight)? as u16
            } else {
                1
            },
        })
    }

    /// One shot and all that arrives together with its echoes must be within what is timed in
    /// one go.
    fn clock(&self, design: &Design) -> Result<(), Error> {
        if design.longest_band_fs() < 0 {
            return self.refuse("tdc.resolution_ps", TOO_FINE);
        }
        Ok(())
    }

    /// A macropulse must end before the next one begins.
    fn timing(&self, design: &mut Design) -> Result<(), Error> {
        let derived = design.derived();
        if design.is_coded() && derived.macropulse > derived.pixel_period {
            let message = format!(
                "a macropulse lasts {:.3} ns, longer than the {:.3} ns of a pixel: \
                 fewer bits, shorter words or chips, or a slower scan",
                derived.macropulse * 1e9,
                derived.pixel_period * 1e9
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
            design.warnings.push(format!(
                "a code word returns after {range:.1} m, within the range gate of {:.1} m",
                design.scan.max_range
            ));
        }
        Ok(())
    }
}

fn sensitivity(file: &SensitivityFile, photons: f64) -> Sensitivity {
    Sensitivity { photons, range: file.range_m, reflectance: file.reflectance }
}

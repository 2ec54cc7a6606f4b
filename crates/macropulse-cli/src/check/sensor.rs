//! The report on a sensor.

use std::collections::BTreeMap;

use macropulse::channel::{Operating, Speckle};
use macropulse::design::{Derived, Design, Detector, Polygon};
use macropulse::environment::Environment;
use macropulse::memory::Estimate;
use macropulse::predict::deepest_baseline;
use macropulse::predict::unmodelled::{self, LeftOut};
use macropulse_study::record::{defaults, not_modelled, surroundings};
use serde_json::{Map, Value, json};

use super::{Report, estimated};
use crate::fault::Fault;
use crate::memory::{self, MemoryLimit};
use crate::text::{Columns, counted, grouped, section, short};

/// Reports all that follows from a sensor and, for its light, from an environment, and the effects that it
/// idealises.
pub fn report(
    design: &Design,
    environment: &Environment,
    memory: &MemoryLimit,
) -> Result<Report, Fault> {
    let estimate = Estimate::of(design, environment)?;
    memory.allow_alone(&design.name, &estimate)?;
    let derived = design.derived();
    let operating = Operating::of(design, environment)?;
    let mut text = format!("{}: a sensor\n{}\n", design.name, design.summary);
    text += &section("Time", &times(design, &derived));
    text += &section("Range", &ranges(design, &derived));
    text += &section("Light", &light(design, &derived));
    let conditions = format!("In {} ({})", environment.name, environment.conditions());
    text += &section(&conditions, &at_work(design, (&operating, &estimate)));
    let mut idealised = Columns::default();
    for effect in &design.idealised {
        idealised.push(effect.name(), effect.assumption());
    }
    if let Some(cells) = speckle_cells(design).filter(|_| design.light.linewidth.is_none())
        && cells < NEGLIGIBLE
    {
        let varies = short(100.0 / cells.sqrt());
        let told = format!(
            "each echo brings its mean, which would vary by {varies} %: light.linewidth_ghz"
        );
        idealised.push("speckle", told);
    }
    text += &section("Idealised", &idealised);
    let mut left = Columns::default();
    for LeftOut { effect, size } in unmodelled::of(design, environment)? {
        left.push(effect.name(), format!("{}; {size}", effect.assumption()));
    }
    text += &section("Not modelled", &left);
    let mut defaults = Columns::default();
    for (key, value) in &design.defaults {
        defaults.push(key, value);
    }
    text += &section("Defaults used", &defaults);
    let mut warnings = Columns::default();
    let of_air = unmodelled::warnings(design, environment);
    warnings.push_list("!", design.warnings.iter().chain(&of_air).cloned());
    text += &section("Warnings", &warnings);
    let mut json = json(design, &derived);
    json["environment"] = json!(surroundings(environment));
    json["not_modelled"] = json!(not_modelled(design, environment));
    json["warnings"] = json!([&design.warnings[..], &of_air].concat());
    json["sunlight_hz"] = operating.background.into();
    if let Detector::Sampled(sampled) = &design.detector {
        json["baseline_photons"] = deepest_baseline(design, sampled).into();
    }
    json["speckle_cells"] = speckle_cells(design).into();
    json["false_rate_hz"] = operating.false_rate.into();
    json["transmission"] = operating.link.transmission(design.scan.rated_range).into();
    json["memory"] = memory::json(&estimate);
    Ok(Report { text, json })
}

/// Speckle cells from which on speckle is negligible: it varies the light of an echo by a tenth. Noise varies
/// an echo that is only just found by a sixth, if the threshold is at six standard deviations of the noise.
const NEGLIGIBLE: f64 = 100.0;

/// The speckle cells of an echo from the rated range, square on; `None` where beam or aperture are not known.
fn speckle_cells(design: &Design) -> Option<f64> {
    Some(Speckle::of(design)?.cells(design.scan.rated_range, 1.0))
}

/// Reports the effects of sun and air on a sensor.
fn at_work(design: &Design, (operating, estimate): (&Operating, &Estimate)) -> Columns {
    let mut columns = Columns::default();
    let detector = design.detector.model();
    let rated = design.scan.rated_range;
    let transmission = short(operating.link.transmission(rated) * 100.0);
    columns.push("air", format!("{transmission} % of the light gets {} m far", short(rated)));
    let counts = format!("{:.3e} counts a second in each detector", operating.background);
    columns.push(
        "sunlight",
        match &design.budget {
            None if operating.background > 0.0 => {
                format!("{counts}, as declared, whatever the sky")
            }
            None => "not counted: the sensor is declared by its sensitivity, whatever the sky"
                .to_owned(),
            Some(_) => format!("{counts}, {}", detector.in_sunlight()),
        },
    );
    if let Some(noise) = detector.noise(operating.background) {
        let (rms, threshold) = (short(noise.rms), short(noise.threshold));
        columns.push("noise", format!("{rms} photons rms, the threshold at {threshold}"));
    }
    if let Detector::Sampled(sampled) = &design.detector
        && sampled.low_cutoff > 0.0
    {
        let (deepest, room) = (deepest_baseline(design, sampled), sampled.below_zero());
        let back = short(1e6 / sampled.low_cutoff);
        let told = format!(
            "own marks pull it down by {} photons of {} that the converter tells; it comes back in {back} µs",
            short(deepest),
            short(room)
        );
        columns.push("baseline", told);
    }
    if design.emission.is_pulsed() {
        let events = format!("{:.3e} a second without any light of lidars", operating.false_rate);
        columns.push("false detections", events);
    }
    columns.push("memory of a run", format!("{}, and that of the scene", estimated(estimate)));
    columns
}

/// The polygon of a sensor that has one, and the lines that it draws in a second.
fn polygon(design: &Design) -> Option<(&Polygon, f64)> {
    let (raster, polygon) = design.scan.polygon()?;
    Some((polygon, f64::from(raster.lines()) / design.scan.period()))
}

fn times(design: &Design, derived: &Derived) -> Columns {
    let mut columns = Columns::default();
    let scan = &design.scan;
    let rate = scan.rate_millihertz as f64 * 1e-3;
    columns.push(
        "scan",
        format!(
            "{} rows x {} columns = {} shots, {} times a second",
            scan.rows,
            scan.columns,
            grouped(design.shots_per_scan()),
            short(rate)
        ),
    );
    columns.push("pixel period", format!("{} ns", short(derived.pixel_period * 1e9)));
    if design.channels() > 1 {
        let (period, detectors) =
            (short(derived.channel_period * 1e9), grouped(design.channels().into()));
        columns.push(
            "",
            format!("{period} ns between shots of the same one of {detectors} detectors"),
        );
    }
    if let Some((polygon, lines)) = polygon(design) {
        let told = format!(
            "{} facets of {} mm, {} turns a minute, corners at {} m/s",
            polygon.facets,
            short(polygon.facet() * 1e3),
            short(60.0 * polygon.turns(lines)),
            short(polygon.tip_speed(lines))
        );
        columns.push("polygon", told);
    }
    columns.push("shortest dwell", format!("{} ns", short(derived.shortest_dwell * 1e9)));
    columns.push("range gate", format!("{} ns", short(derived.gate * 1e9)));
    columns.push("shots in flight", short(derived.shots_in_flight));
    columns.push(
        "idle listening",
        format!(
            "{} scans a second, if each shot waited for the echo of the one before",
            short(derived.idle_listening_rate)
        ),
    );
    columns
}

fn ranges(design: &Design, derived: &Derived) -> Columns {
    let mut columns = Columns::default();
    let (near, far) = (design.scan.min_range, design.scan.max_range);
    columns.push("accepted", format!("{} to {} m", short(near), short(far)));
    let ambiguity = design.emission.model().ambiguity();
    columns.push(
        "unambiguous",
        match derived.unambiguous_range {
            Some(range) => format!("{} m, where {ambiguity}", short(range)),
            None => ambiguity.to_owned(),
        },
    );
    columns.push("one tick", format!("{} mm", short(derived.tick_range * 1e3)));
    columns.push("called right", format!("to within {} mm", short(design.right_within * 1e3)));
    columns
}

fn light(design: &Design, derived: &Derived) -> Columns {
    let mut columns = Columns::default();
    if design.is_coded() {
        let (fewest, mean, most) = derived.marks;
        let chips = counted(u64::from(derived.chips), "chip");
        let chip = short(design.emission.coding().chip_fs as f64 * 1e-3);
        let length = short(derived.macropulse * 1e9);
        columns.push("macropulse", format!("{chips} of {chip} ps = {length} ns"));
        columns
            .push("mean overlap", format!("{} macropulses at once", short(derived.mean_overlap)));
        let lit = format!("{fewest} to {most} per label that is lit, {} on average", short(mean));
        columns.push("marks", lit);
        columns.push("", format!("{} in a scan", grouped(derived.marks_per_scan)));
        let mut labels = BTreeMap::new();
        for marks in design.emission.coding().codebook.weights() {
            *labels.entry(marks).or_insert(0_u64) += 1;
        }
        let labels = labels.iter().map(|((fewest, most), count)| match fewest == most {
            true => format!("{count} with {most}"),
            false => format!("{count} with {fewest} to {most} by word"),
        });
        columns.push("", format!("labels by marks: {}", labels.collect::<Vec<_>>().join(", ")));
    } else if design.emission.is_pulsed() {
        let pulse = short(design.light.pulse * 1e12);
        columns.push("shot", format!("one micropulse of {pulse} ps, not coded"));
    } else {
        let description = design.emission.model().description(short);
        let names = std::iter::once("shot").chain(std::iter::repeat(""));
        names.zip(description).for_each(|(name, line)| columns.push(name, line));
    }
    let sensitivity = match derived.reference_photons {
        photons if photons.is_finite() => {
            let part = if design.emission.is_pulsed() { "mark" } else { "shot" };
            format!("{} photons per {part} from the reference target", short(photons))
        }
        _ => "never misses".to_owned(),
    };
    if let Some(cells) = speckle_cells(design).filter(|_| design.light.linewidth.is_some()) {
        let (varies, range) = (short(100.0 / cells.sqrt()), short(design.scan.rated_range));
        let told = format!("{} cells at {range} m: an echo varies by {varies} %", short(cells));
        columns.push("speckle", told);
    }
    columns.push("sensitivity", sensitivity);
    columns
}

fn json(design: &Design, derived: &Derived) -> Value {
    let (fewest, mean, most) = derived.marks;
    let assumptions: Map<String, Value> = design
        .idealised
        .iter()
        .map(|effect| (effect.name().to_owned(), effect.assumption().into()))
        .collect();
    json!({
        "kind": "sensor",
        "name": design.name,
        "digest": design.digest(),
        "summary": design.summary,
        "rows": design.scan.rows,
        "columns": design.scan.columns,
        "shots_per_scan": design.shots_per_scan(),
        "scan_rate_hz": design.scan.rate_millihertz as f64 * 1e-3,
        "polygon": polygon(design).map(|(polygon, lines)| json!({
            "facets": polygon.facets,
            "facet_mm": polygon.facet() * 1e3,
            "turns_per_s": polygon.turns(lines),
            "tip_m_per_s": polygon.tip_speed(lines),
        })),
        "pixel_period_ns": derived.pixel_period * 1e9,
        "shortest_dwell_ns": derived.shortest_dwell * 1e9,
        "range_gate_ns": derived.gate * 1e9,
        "shots_in_flight": derived.shots_in_flight,
        "idle_listening_hz": derived.idle_listening_rate,
        "min_range_m": design.scan.min_range,
        "max_range_m": design.scan.rated_range,
        "unambiguous_range_m": derived.unambiguous_range,
        "tick_mm": derived.tick_range * 1e3,
        "right_within_mm": design.right_within * 1e3,
        "chip_ps": design.emission.coding().chip_fs as f64 * 1e-3,
        "macropulse_chips": derived.chips,
        "macropulse_ns": derived.macropulse * 1e9,
        "marks_min": fewest,
        "marks_mean": mean,
        "marks_max": most,
        "marks_per_label": design.emission.coding().codebook.weights().map(|(_, most)| most).collect::<Vec<_>>(),
        "marks_per_scan": derived.marks_per_scan,
        "mean_overlap": derived.mean_overlap,
        "reference_photons": derived.reference_photons.is_finite().then_some(derived.reference_photons),
        "idealised": design.idealised.iter().map(|effect| effect.name()).collect::<Vec<_>>(),
        "assumptions": assumptions,
        "defaults": defaults(design),
    })
}

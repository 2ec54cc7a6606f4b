//! The findings of a search as JSON, for programs.

use serde_json::{Value, json};

use super::listing::ASSUMPTIONS;
use super::requirements::Requirements;
use super::scenery::Scenery;
use super::trial::{Counts, Trial};
use super::{Best, Bill, Candidate, Found, InFlight, Limit, Mirror, Side};

impl Found {
    /// All of it as one JSON object; the names of its keys end in their units.
    pub fn json(&self) -> Value {
        let closed = self.assessed.iter().map(|one| {
            let mut told = candidate(&self.required, &one.candidate);
            told["period_ns"] = json!(one.period * 1e9);
            told["pd"] = json!(one.pd);
            told["precision_m"] = json!(one.precision);
            told["limit"] = limit(one.limit);
            told
        });
        let ablations = self.ablations.iter().map(|ablation| {
            let mut told = counts(&ablation.counts);
            told["what"] = json!(ablation.what);
            told
        });
        let of = |it: &Trial| trial(&self.required, it);
        let best = |it: &Best| {
            let mut told = of(&it.trial);
            told["bill"] = bill(&it.bill);
            told
        };
        json!({
            "requirements": self.required.name,
            "closed_form": closed.collect::<Vec<_>>(),
            "simulated": self.trials.iter().map(of).collect::<Vec<_>>(),
            "coded": self.best[0].as_ref().map(best),
            "waiting": self.best[1].as_ref().map(best),
            "in_flight": self.in_flight.as_ref().map(|it| in_flight(&self.required, it)),
            "mirrors": self.mirrors.iter().map(mirror).collect::<Vec<_>>(),
            "skipped": self.skipped.iter().map(|it| json!({
                "photodiode": it.part,
                "marks": it.marks,
                "channels": it.beams,
                "why": it.why,
            })).collect::<Vec<_>>(),
            "assumptions": ASSUMPTIONS,
            "ablations": ablations.collect::<Vec<_>>(),
            "frontier": self.frontier.as_ref().map(|frontier| json!({
                "reflectances": frontier.reflectances,
                "coded_period_ns": frontier.coded_period * 1e9,
                "waiting_period_ns": frontier.waiting_period * 1e9,
                "rows": frontier.rows.iter().map(|row| json!({
                    "scans_per_s": row.scans_per_s,
                    "pixels_per_s": row.pixels_per_s,
                    "coded_m": row.coded,
                    "waiting_m": row.waiting,
                    "coded_channels": row.coded_channels,
                    "time_m": row.time,
                })).collect::<Vec<_>>(),
            })),
        })
    }
}

/// Returns the quantities of all channels together; missing ones are null.
fn bill(it: &Bill) -> Value {
    json!({
        "converter": it.converter.name(),
        "gigasamples_per_s": it.samples_per_s * 1e-9,
        "photodiodes_mm2": it.photodiodes * 1e6,
        "duty": it.duty,
        "polygon_mm": it.polygon.map(|(diameter, _)| diameter * 1e3),
        "tip_m_per_s": it.polygon.map(|(_, speed)| speed),
        "of_class_1": it.of_class_1,
        "peak_w": it.peak,
        "mean_w": it.mean,
    })
}

fn in_flight(required: &Requirements, it: &InFlight) -> Value {
    let mut told = candidate(required, &it.candidate);
    told["bill"] = bill(&it.bill);
    told["period_ns"] = json!(it.period * 1e9);
    told["least_period_ns"] = json!(it.least_period * 1e9);
    told["hidden"] = json!(it.hidden);
    told["pulses"] = json!(it.pulses);
    told["neighbours"] = json!(it.neighbours);
    told
}

fn mirror(it: &Mirror) -> Value {
    let side = |side: Option<Side>| {
        side.map(|side| {
            json!({
                "channels": side.channels,
                "polygon_mm": side.diameter * 1e3,
                "tip_m_per_s": side.tip_speed,
            })
        })
    };
    let [coded, waiting, in_flight] = it.sides.map(side);
    json!({
        "facets": it.facets,
        "duty": it.duty,
        "coded": coded,
        "waiting": waiting,
        "in_flight": in_flight,
    })
}

fn candidate(required: &Requirements, it: &Candidate) -> Value {
    json!({
        "name": it.name(),
        "photodiode": it.part.name,
        "marks": it.marks,
        "channels": it.beams,
        "facets": it.facets,
        "aperture_mm": it.aperture * 1e3,
        "tip_m_per_s": it.tip_speed(required),
        "energy_nj": it.energy * 1e9,
        "pulse_ps": it.pulse * 1e12,
        "bandwidth_mhz": it.bandwidth * 1e-6,
    })
}

fn limit(limit: Option<(Limit, f64)>) -> Value {
    match limit {
        None => Value::Null,
        Some((limit, factor)) => {
            json!({ "what": limit.name(), "factor": factor.is_finite().then_some(factor) })
        }
    }
}

fn trial(required: &Requirements, it: &Trial) -> Value {
    let mut told = candidate(required, &it.candidate);
    told["limit"] = limit(it.limit);
    told["found"] = counts(&it.counts);
    told["worst"] = json!({ "range_m": it.worst.range, "pd": it.worst.pd });
    told
}

fn counts(counts: &[Counts; 2]) -> Value {
    let each = Scenery::ALL.into_iter().zip(counts).map(|(scenery, counts)| {
        let told = json!({
            "pixels": counts.pixels,
            "echoes": counts.echoes,
            "pd": counts.pd(),
            "wrong": counts.wrong_share(),
            "false": counts.false_share(),
            "rms_m": counts.rms(),
        });
        (scenery.name().to_owned(), told)
    });
    Value::Object(each.collect())
}

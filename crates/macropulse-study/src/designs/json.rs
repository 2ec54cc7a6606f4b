//! What a search found, for programs.

use serde_json::{Value, json};

use super::requirements::Requirements;
use super::scenery::Scenery;
use super::trial::{Counts, Trial};
use super::{Candidate, Found, Limit};

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
        json!({
            "requirements": self.required.name,
            "closed_form": closed.collect::<Vec<_>>(),
            "simulated": self.trials.iter().map(of).collect::<Vec<_>>(),
            "coded": self.best[0].as_ref().map(of),
            "waiting": self.best[1].as_ref().map(of),
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

fn candidate(required: &Requirements, it: &Candidate) -> Value {
    json!({
        "name": it.name(),
        "photodiode": it.part.name,
        "marks": it.marks,
        "channels": it.beams,
        "aperture_mm": it.aperture * 1e3,
        "tip_m_per_s": required.tip_speed(it),
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

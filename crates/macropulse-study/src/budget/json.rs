//! A budget as JSON, for programs.

use macropulse::channel::idealised as idealised_in;
use macropulse::design::safety::{Class1, Limit, Rule};
use macropulse::predict::verdict::Check;
use serde_json::{Value, json};

use super::{Farthest, Figures};
use crate::record::{named, surroundings};

impl Figures<'_> {
    /// All of it as one JSON object; the names of its keys end in their units.
    pub fn json(&self) -> Value {
        let there = &self.there;
        let budget = self.design.budget.as_ref();
        let marks = self.design.emission.mean_pulses();
        let class = Class1::at(self.design.light.wavelength);
        let alone = |limit: &&Limit| limit.rule == Rule::SingleShot;
        let limits = self.design.eye_limits();
        let single = limits
            .iter()
            .find(alone)
            .zip(class)
            .map(|(limit, class)| class.single_exposure(limit.duration) * 1e9);
        json!({
            "sensor": named(self.design),
            "environment": surroundings(&self.environment),
            "range_m": self.wanted.range,
            "reflectance": self.wanted.reflectance,
            "energy_per_macropulse_nj": budget.map(|budget| budget.energy * 1e9),
            "photons_per_macropulse": budget.map(|_| there.photons_per_shot),
            "photons_per_micropulse": budget.map(|_| there.photons_per_shot / marks),
            "detected_per_micropulse": finite(there.detected_per_mark),
            "background_photons_per_chip": budget.map(|_| self.background_per_chip()),
            "single_pulse_ael_nj": single,
            "cw_ael_mw": class.map(|class| class.continuous() * 1e3),
            "limits": budget.map(|_| limits.iter().map(|limit| json!({
                "rule": limit.rule.name(),
                "distance_mm": limit.distance * 1e3,
                "shots": limit.shots,
                "brightness": limit.brightness,
                "duration_s": limit.duration,
                "energy_per_macropulse_nj": limit.energy * 1e9,
            })).collect::<Vec<_>>()),
            "pd": there.pd,
            "pd_wanted": self.wanted.pd,
            "false_points_per_shot": there.false_per_shot,
            "false_points_wanted": self.wanted.false_points,
            "snr": finite(there.snr),
            "precision_mm": there.precision.map(|precision| precision * 1e3),
            "on_sidelobe": there.aside.map(|aside| json!({
                "share": aside.share,
                "rms_mm": aside.rms * 1e3,
            })),
            "precision_bound_mm": there.bound * 1e3,
            "converter_loss": there.bank_loss,
            "mark_by_mark_shortfall": self.mark_by_mark,
            "by_reflectance": self.farthest.iter().map(farthest_json).collect::<Vec<_>>(),
            "checks": self.checks.iter().map(check_json).collect::<Vec<_>>(),
            "first_failure": self.first_failure().map(check_json),
            "closes": self.closes(),
            "idealised": idealised_in(self.design, &self.environment)
                .iter()
                .map(|effect| effect.name)
                .collect::<Vec<_>>(),
        })
    }
}

fn farthest_json(farthest: &Farthest) -> Value {
    json!({
        "reflectance": farthest.reflectance,
        "photons_per_macropulse": finite(farthest.there.photons_per_shot),
        "snr": finite(farthest.there.snr),
        "pd": farthest.there.pd,
        "false_points_per_shot": farthest.there.false_per_shot,
        "precision_mm": farthest.there.precision.map(|precision| precision * 1e3),
        "range_of_pd_m": farthest.range,
        "range_of_pd_at_night_m": farthest.range_at_night,
    })
}

fn check_json(check: &Check) -> Value {
    json!({
        "what": check.name,
        "holds": check.holds(),
        "factor": finite(check.shortfall),
        "finding": check.finding,
        "needed": check.remedy,
    })
}

/// JSON has no infinity: `null` stands for it, as for the photons of a detector that never misses.
fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

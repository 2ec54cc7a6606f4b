//! Properties of sensors that have no forecast.

use macropulse_codec::RecordKind;
use macropulse_codec::decode::Method;

use super::super::{sampled, way};
use crate::channel::Operating;
use crate::design::detector::Sampled;
use crate::design::{Design, Detector};
use crate::units::s_from_fs;

/// Amplitude over the threshold at which the marks of a word must be told apart for there to be a forecast.
/// Marks of this amplitude are twice as bright as marks that are just seen.
const TOLD_APART: f64 = 2.0;

/// Standard deviations of the noise that must have room below the baseline.
const SEEN_BELOW: f64 = 4.0;

/// The first property of `design` or of its `operating` point without a closed form, and a way to get an
/// answer all the same.
pub(super) fn reason(design: &Design, operating: &Operating) -> Option<(String, String)> {
    let method = &design.receiver.method;
    if let Some(way) = way::of(design) {
        return (way.not_modelled)(design);
    }
    if !matches!(method, Method::Direct | Method::Sampled(_)) && method.correlation().is_none() {
        let what = format!("the receiver `{}`", method.kind().name());
        let remedy = match method.kind().record() {
            RecordKind::Ticks => "simulate it, or --set receiver.kind='\"matched\"'",
            _ => "simulate it",
        };
        return Some((what, remedy.to_owned()));
    }
    if let Detector::Sampled(detector) = &design.detector {
        if design.emission.coding().codebook.max_weight() > sampled::MOST_MARKS {
            return Some((
                "sampled words of more than 64 marks".to_owned(),
                "simulate it, or take a code of fewer marks".to_owned(),
            ));
        }
        return sunk(design, detector, operating.background);
    }
    let Detector::Linear(linear) = &design.detector else { return None };
    let setting = linear.setting(operating.background);
    let needed = setting.comparator?.apart(&setting, TOLD_APART * setting.threshold);
    let codebook = &design.emission.coding().codebook;
    let labels = 0..codebook.labels() as u16;
    let sent = labels.flat_map(|label| (0..codebook.words() as u16).map(move |word| (label, word)));
    let gaps = sent.filter_map(|(label, word)| {
        codebook.marks(label, word).windows(2).map(|pair| pair[1] - pair[0]).min()
    });
    let least = s_from_fs(i64::from(gaps.min()?) * design.emission.coding().chip_fs);
    let chip = s_from_fs(design.emission.coding().chip_fs);
    (least < needed).then(|| {
        (
            "marks that merge behind the amplifier".to_owned(),
            format!(
                "marks of a word follow each other by {:.0} ps and are told apart from {:.0} ps on; \
                 simulate it, or take a code with {:.0} chips from mark to mark, as a sparse one \
                 with this `gap`",
                least * 1e12,
                needed * 1e12,
                (needed / chip).ceil()
            ),
        )
    })
}

/// Tells if the sensor's own marks pull the baseline of a sampled `detector` below the lowest code. Above
/// that code, a receiver that knows the coupling adds the lost level to the samples again.
fn sunk(design: &Design, detector: &Sampled, background: f64) -> Option<(String, String)> {
    let deepest = sampled::deepest_baseline(design, detector);
    let room = detector.below_zero();
    let most = room - SEEN_BELOW * detector.rms_noise(background);
    (deepest > most.max(0.0)).then(|| {
        (
            "a baseline that the sensor's own marks pull below the lowest code".to_owned(),
            format!(
                "they pull it down by {deepest:.0} photons, of {room:.0} that the converter tells; \
                 simulate it, or take a lower `low_cutoff_khz`, more `isolation_db` or a shorter \
                 `recovery_ns`"
            ),
        )
    })
}

//! Keys that another setting makes meaningless: typing one is an error that names both.
//!
//! Only keys that a user has just typed count: those given with `--set`, and those of the file itself unless
//! `--set` changes what makes them meaningless. Keys that a file inherits by `extends` may lie idle.

use std::collections::BTreeSet;

use super::SensorFile;
use crate::design::detector::OF_SAMPLES;
use crate::design::document::Typed;
use crate::design::limits::{Check, Idle};
use crate::design::receiver::OWN_KEYS;
use crate::design::{Effect, Error, Label};

const ALONE: &str = "every mark is judged alone while \"inter-chip\" is in this list: --with inter-chip \
                     sums their pulses";
const NO_SIGNAL: &str = "only a photodiode puts out a signal that is compared or sampled";
const FOOTPRINT: &str = "the beam has no width while \"footprint\" is in this list: \
                         --with footprint simulates it";
const BUDGET: &str = "the receiver is declared by its sensitivity while \"link-budget\" is in this \
                      list: --with link-budget counts photons";
const NO_BUDGET: &str = "photons follow from energy and optics: --without link-budget declares the \
                         receiver instead";

impl Check<'_> {
    /// The keys that were typed for nothing, each as an error with the first reason for it.
    pub(super) fn without_effect(&self, file: &SensorFile, idealised: &[Effect]) -> Vec<Error> {
        let mut told = BTreeSet::new();
        let errors = idle(file, idealised)
            .into_iter()
            .filter_map(|idle| self.told(&idle).map(|error| (idle.key, error)));
        errors.filter(|(key, _)| told.insert(key.clone())).map(|(_, error)| error).collect()
    }

    fn told(&self, idle: &Idle) -> Option<Error> {
        let because = match self.chain.typed(&idle.key)? {
            Typed::Set => true,
            // The file could not know a setting that `--set` has just changed.
            Typed::File => self.chain.typed(idle.by) != Some(Typed::Set),
        };
        let message = format!("has no effect because of `{}`: {}", idle.by, idle.why);
        because.then(|| self.chain.error(&idle.key, message))
    }
}

/// The keys that mean nothing for such a sensor, typed or not.
pub(super) fn idle_keys(file: &SensorFile, idealised: &[Effect]) -> Vec<String> {
    idle(file, idealised).into_iter().map(|idle| idle.key).collect()
}

fn idle(file: &SensorFile, idealised: &[Effect]) -> Vec<Idle> {
    let off = |effect| idealised.contains(&effect);
    let mut found: Vec<Idle> = file.scan.idle().collect();
    let mut add = |holds: bool, keys: &[&str], by, why| {
        if holds {
            found.extend(Idle::all(keys, by, why));
        }
    };
    let beam = ["light.divergence_mrad", "light.footprint_rays", "light.linewidth_ghz"];
    add(off(Effect::Footprint), &beam, "idealised", FOOTPRINT);
    let declared = off(Effect::LinkBudget);
    add(
        declared,
        &["light.energy", "light.linewidth_ghz", "optics", "safety"],
        "idealised",
        BUDGET,
    );
    for given in file.detector.given() {
        let idle = given.file.idle();
        let (keys, why) =
            if declared { (idle.declared, BUDGET) } else { (idle.counted, NO_BUDGET) };
        for key in keys {
            add(true, &[&format!("detector.{}.{key}", given.name)], "idealised", why);
        }
    }
    let kind = file.receiver.kind;
    for (keys, kinds, why) in OWN_KEYS {
        add(!kinds.contains(&kind), keys, "receiver.kind", why);
    }
    let compared = ["comparator.timing", "comparator.hysteresis"];
    add(off(Effect::InterChip), &compared, "idealised", ALONE);
    add(!file.has_signal(), &["comparator", "adc"], "detector", NO_SIGNAL);
    let of_events = ["tdc", "comparator"];
    add(file.adc().is_some(), &of_events, "adc", "samples are taken of the signal, and no events");
    let is_compared = file.has_signal() && file.adc().is_none();
    add(
        is_compared,
        &OF_SAMPLES,
        "comparator",
        "events do not show it, only the samples of an [adc]",
    );
    found.extend(file.optional().flat_map(|table| table.idle(file)));
    let unlabelled = file.code.as_ref().is_some_and(|code| code.label == Label::None);
    let payload = ["code.label_bits", "code.crc", "code.sync_bit", "code.allow_dark"];
    if unlabelled {
        let why = "a macropulse without a label is a bare code word";
        found.extend(Idle::all(&payload, "code.label", why));
    }
    found
}

#[cfg(test)]
mod tests {
    use crate::design::Design;
    use std::path::Path;

    fn told(text: &str, set: &[(&str, &str)]) -> String {
        let text = format!("version = 1\nextends = \"kim-park-2016\"\nname = \"mine\"\n{text}");
        let set: Vec<(String, String)> =
            set.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned())).collect();
        match Design::from_toml(&text, "mine.toml", Path::new(""), &set) {
            Ok(_) => String::new(),
            Err(error) => error.to_string(),
        }
    }

    #[test]
    fn a_key_that_changes_nothing_is_refused_and_both_are_named() {
        for (text, key, by) in [
            ("[light]\nfootprint_rays = 7\n", "light.footprint_rays", "idealised"),
            ("[light]\ndivergence_mrad = 0.3\n", "light.divergence_mrad", "idealised"),
            ("[light]\nenergy = \"class-1\"\n", "light.energy", "idealised"),
            ("[safety]\ndistance_mm = 200.0\n", "safety", "idealised"),
            ("[receiver]\nbit_threshold = 12\n", "receiver.bit_threshold", "receiver.kind"),
            (
                "[receiver]\nkind = \"literal\"\nfalse_alarm = 1e-4\n",
                "receiver.false_alarm",
                "receiver.kind",
            ),
            ("[receiver]\nkind = \"blind\"\neffort = \"quick\"\n", "receiver.effort", "kind"),
            ("[code]\nlabel = \"none\"\nsync_bit = true\n", "code.sync_bit", "code.label"),
        ] {
            let message = told(text, &[]);
            assert!(message.contains(key) && message.contains(by), "{key}: {message}");
            assert!(message.contains("has no effect"), "{message}");
        }
        // Two reasons, one line.
        let set = [("light.divergence_mrad".to_owned(), "1".to_owned())];
        let message = Design::open("peregrine", &set).unwrap_err().to_string();
        assert!(
            message.contains("because of `scan.flash`") && !message.contains('\n'),
            "{message}"
        );
        let message = told("", &[("light.footprint_rays", "7")]);
        assert!(message.starts_with("--set: light.footprint_rays: has no effect"), "{message}");
    }

    /// Control: with what makes them matter, and where `--set` has changed that.
    #[test]
    fn a_key_that_matters_is_not() {
        assert_eq!(told("[receiver]\nkind = \"literal\"\nbit_threshold = 12\n", &[]), "");
        let set = [("receiver.kind", "matched")];
        assert_eq!(told("[receiver]\nkind = \"literal\"\nbit_threshold = 12\n", &set), "");
        assert_eq!(told("", &[]), "");
    }

    /// Who leaves an effect out need not take its keys out of the file; what is typed beside it counts.
    #[test]
    fn an_effect_that_is_switched_off_takes_its_keys_with_it() {
        let ready = |set: &[(&str, &str)]| {
            let set: Vec<(String, String)> =
                set.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned())).collect();
            Design::open("coded-practical", &set)
        };
        let without = ("without", "footprint");
        let design = ready(&[without]).unwrap();
        assert!(!design.text.contains("footprint_rays"), "{}", design.text);
        let again = Design::from_toml(&design.text, "again", Path::new(""), &[]).unwrap();
        assert_eq!(again.text, design.text);
        let told = ready(&[without, ("light.footprint_rays", "7")]).unwrap_err().to_string();
        assert!(told.starts_with("--set: light.footprint_rays: has no effect"), "{told}");
        assert!(ready(&[]).unwrap().text.contains("footprint_rays"));
    }
}

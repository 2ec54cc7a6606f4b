//! From ticks to returns: `[receiver]`.

use schemars::JsonSchema;
use serde::Deserialize;

use super::detector::DetectorFile;
use super::limits::Check;
use super::{Clock, Coding, Detector, Emission, Error, Label, PARTS_OF_TICK, Readout, Scan};
use crate::units::{fs_from_s, tof_from_range};
use macropulse_codec::RecordKind;
use macropulse_codec::decode::{
    self, Bitwise, Correlation, Effort, MOST_RETURNS, Method, Opening, Pick, Receiver, ReceiverKind,
};

/// `[receiver]` as typed.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct ReceiverFile {
    /// How ticks become returns.
    pub kind: ReceiverKind,
    /// How much the receiver `matched` does for faint light.
    effort: Effort,
    /// False returns accepted per shot (matched, balanced, sampled, histogram, phase, beat).
    #[schemars(range(min = 1e-30, max = 0.5))]
    false_alarm: f64,
    /// Marks that make a bit a 1 (literal, blind).
    #[schemars(range(min = 1))]
    bit_threshold: u32,
    /// Range error up to which a return counts as right, m; follows from the timing unless it is
    /// given.
    #[schemars(range(min = 0, max = 0.35))]
    pub right_within_m: Option<f64>,
    /// Returns of a shot at most: 4 with `matched`, 1 with `literal`, `blind` and `balanced`.
    #[schemars(range(min = 1, max = 8))]
    returns: u32,
    /// Which returns are kept of more, and which one of a pixel its image shows.
    pick: Option<Pick>,
    /// Least number of marks by which a return is decided, none of them blanked (sampled). 2 if it is not
    /// given, or 1 if a word has only one; at most the marks of the word with the fewest.
    #[schemars(range(min = 1))]
    pub least_marks: Option<u32>,
    /// For how long after each mark that is sent no sample counts, ns (sampled).
    #[schemars(range(min = 0, max = 1e6))]
    pub blank_ns: f64,
    /// For how long behind a clipped sample none counts, ns (sampled).
    #[schemars(range(min = 0, max = 1e6))]
    pub recovery_ns: f64,
    /// How photons that a cell missed behind others of the same pulse are made up for (histogram): `coates`
    /// with arming = "once-per-pulse" unless it is given, else `none`.
    pub pile_up: Option<PileUpFile>,
    /// Standard deviation of the shape of a pulse, as a share of its height (histogram); 0 if it is not given.
    #[schemars(range(min = 0, max = 1))]
    pub shape_error: Option<f64>,
    /// Least share of the photons (histogram) or of the power (beat) of the strongest return that another
    /// return must have. Left out: 0.
    #[schemars(range(min = 0, max = 1))]
    pub least_share: Option<f64>,
    /// True if the phase error made by harmonics of the modulation is corrected (phase). True if it is not
    /// given.
    pub correct_harmonics: Option<bool>,
    /// Radial velocity of a surface at most, m/s (beat); 60 if it is not given.
    #[schemars(range(min = 0, max = 1e4))]
    pub max_speed_m_s: Option<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub(super) enum PileUpFile {
    /// Counts are taken as they are.
    None,
    /// By the counts of the bins before, of cells that count once a pulse.
    Coates,
}

/// The keys that only some kinds of receivers have: which, whose, and why no others.
pub(super) const OWN_KEYS: [(&[&str], &[ReceiverKind], &str); 8] = {
    use ReceiverKind::{Balanced, Beat, Blind, Histogram, Literal, Matched, Phase, Sampled};
    let of_samples = &["receiver.least_marks", "receiver.blank_ns", "receiver.recovery_ns"];
    let of_counts = &["receiver.pile_up", "receiver.shape_error"];
    let deciding = "only `matched`, `balanced`, `sampled`, `histogram`, `phase` and `beat` derive their threshold from it";
    let bitwise = "only `literal` and `blind` decide bit by bit";
    [
        (&["receiver.bit_threshold"], &[Literal, Blind], bitwise),
        (
            &["receiver.false_alarm"],
            &[Matched, Balanced, Sampled, Histogram, Phase, Beat],
            deciding,
        ),
        (of_samples, &[Sampled], "only `sampled` is given samples"),
        (of_counts, &[Histogram], "only `histogram` is given counts"),
        (
            &["receiver.least_share"],
            &[Histogram, Beat],
            "only `histogram` and `beat` compare returns",
        ),
        (&["receiver.effort"], &[Matched], "only `matched` searches"),
        (&["receiver.correct_harmonics"], &[Phase], "only `phase` is given taps"),
        (&["receiver.max_speed_m_s"], &[Beat], "only `beat` measures a speed"),
    ]
};

/// The inputs of a receiver beside its own section of the file.
pub(super) struct Inputs<'a> {
    pub detector_file: &'a DetectorFile,
    /// The detector; `None` if something is wrong with it.
    pub detector: Option<&'a Detector>,
    pub scan: &'a Scan,
    pub clock: Clock,
    pub readout: &'a Readout,
    pub emission: &'a Emission,
    /// Standard deviation of the time of a mark, s.
    pub timing: f64,
    /// As [`Correlation::photons_apart`].
    pub photons_apart: bool,
    /// rms length of a pulse of light with the jitter, s.
    pub pulse: f64,
}

impl Check<'_> {
    /// The receiver; `None` without the detector that it has to know.
    pub(super) fn receiver(
        &self,
        file: &ReceiverFile,
        inputs: &Inputs,
    ) -> Result<Option<Receiver>, Error> {
        let &Inputs { detector_file, scan, clock, readout, emission, .. } = inputs;
        let coding = emission.coding();
        let kind = file.kind;
        if kind.record() != readout.records() {
            return self.refuse(
                "receiver.kind",
                "`sampled` is for an [adc], `histogram` for a [histogram], `phase` for a [modulation], `beat` for a \
                 [chirp], the other receivers for events that a [tdc] times",
            );
        }
        let is_coded = coding.label.is_some();
        if readout.records() == RecordKind::Ticks && (kind == ReceiverKind::Direct) == is_coded {
            return self.refuse(
                "receiver.kind",
                "`direct` is for shots without [code], the other receivers for shots with it",
            );
        }
        self.can_read(kind, coding)?;
        let (returns, pick) = self.returns(file, detector_file)?;
        let ticks = |range: f64| fs_from_s(tof_from_range(range)) / clock.tick_fs;
        let gate = (ticks(scan.min_range), ticks(scan.max_range));
        let light = ticks(scan.light_range);
        if light >= i64::from(u32::MAX / PARTS_OF_TICK) {
            return self.too_fine(readout);
        }
        let Some(method) = self.method(file, inputs, light as u32)? else { return Ok(None) };
        let gate_ticks = (gate.0 as u32, gate.1 as u32);
        let receiver = Receiver { tick_fs: clock.tick_fs, gate_ticks, returns, pick, method };
        // The receiver's own check before it decodes; the keys ask most of it already.
        match receiver.check(&coding.codebook) {
            Err(decode::Error::TooLong { what, ticks, possible }) => self.refuse(
                "code",
                format!(
                    "{what} of {ticks} ticks is too long to be kept in memory; up to {possible} are \
                     possible: use longer ticks, shorter chips or a shorter code"
                ),
            ),
            Err(why) => self.refuse("receiver", why.to_string()),
            Ok(()) => Ok(Some(receiver)),
        }
    }

    /// Returns the method by which it decodes, for light that is followed for `light_ticks`.
    fn method(
        &self,
        file: &ReceiverFile,
        inputs: &Inputs,
        light_ticks: u32,
    ) -> Result<Option<Method>, Error> {
        let &Inputs { clock, emission, timing, photons_apart, .. } = inputs;
        let coding = emission.coding();
        let Ok(ticks_per_chip) = u32::try_from(coding.chip_fs / clock.tick_fs) else {
            let most = u32::MAX;
            let message = format!("is more than {most} ticks: use longer ticks or shorter chips");
            return self.refuse("code.chip_ps", message);
        };
        let jitter_ticks = timing * 1e15 / clock.tick_fs as f64;
        let false_alarm = self.within("receiver.false_alarm", file.false_alarm, 1e-30, 0.5)?;
        let lightest = coding.codebook.lightest_word() as u32;
        let bitwise = |opening| -> Result<Method, Error> {
            let threshold =
                self.count("receiver.bit_threshold", file.bit_threshold, 1, lightest)?;
            let bit_threshold = threshold as u16;
            Ok(Method::Bitwise(Bitwise { opening, bit_threshold, ticks_per_chip, jitter_ticks }))
        };
        let correlation =
            Correlation { ticks_per_chip, light_ticks, jitter_ticks, photons_apart, false_alarm };
        Ok(Some(match file.kind {
            ReceiverKind::Literal => bitwise(Opening::FirstBit)?,
            ReceiverKind::Blind => bitwise(Opening::AnyBit)?,
            ReceiverKind::Matched => Method::Matched(correlation, file.effort),
            ReceiverKind::Balanced => Method::Balanced(correlation),
            ReceiverKind::Direct => Method::Direct,
            ReceiverKind::Sampled => return self.of_samples(file, inputs, &correlation),
            ReceiverKind::Histogram => return self.of_histograms(file, inputs, false_alarm),
            ReceiverKind::Phase => return self.of_taps(file, inputs, false_alarm),
            ReceiverKind::Beat => return self.of_beats(file, inputs, false_alarm),
        }))
    }

    /// How many returns a shot may have at most, and which are kept of more.
    fn returns(&self, file: &ReceiverFile, detector: &DetectorFile) -> Result<(u8, Pick), Error> {
        let (kind, name, most) = (file.kind, file.kind.name(), file.kind.most_returns());
        let wanted = self.count("receiver.returns", file.returns, 1, MOST_RETURNS.into())?;
        let one_event = detector.given().find(|given| given.file.is_single_stop());
        let one_only = match kind {
            ReceiverKind::Direct => {
                one_event.map(|given| format!("detector.{} gives one event per shot", given.name))
            }
            _ if most == 1 => Some(format!("receiver.kind = \"{name}\" gives one return per shot")),
            _ => None,
        };
        if let Some(why) = one_only {
            if wanted > 1 {
                let message = format!("is {wanted}, but {why}: leave it at 1");
                return self.refuse("receiver.returns", message);
            }
            if file.pick.is_some() {
                return self
                    .refuse("receiver.pick", format!("has no effect, as {why}: leave it out"));
            }
        }
        if wanted > most.into() {
            let message = format!(
                "is {wanted}, but receiver.kind = \"{name}\" finds {most} returns of a shot at most"
            );
            return self.refuse("receiver.returns", message);
        }
        let otherwise = if kind == ReceiverKind::Direct { Pick::First } else { Pick::Strongest };
        Ok((wanted as u8, file.pick.unwrap_or(otherwise)))
    }

    /// Refuses a kind of receiver that does not understand the code.
    fn can_read(&self, kind: ReceiverKind, coding: &Coding) -> Result<(), Error> {
        let bit_by_bit = matches!(kind, ReceiverKind::Literal | ReceiverKind::Blind);
        if bit_by_bit && coding.label == Some(Label::None) {
            return self.refuse(
                "receiver.kind",
                "`literal` and `blind` read the bits of a label, but with code.label = \"none\" \
                 there are none: use `matched` or `balanced`",
            );
        }
        if coding.codebook.zeros_are_lit() && kind != ReceiverKind::Balanced {
            return self.refuse(
                "receiver.kind",
                "only `balanced` understands code.keying = \"inversion\"; use it, or \"on-off\"",
            );
        }
        Ok(())
    }
}

//! From ticks to returns: `[receiver]`.

use schemars::JsonSchema;
use serde::Deserialize;

use super::detector::{DetectorFile, Sampled};
use super::limits::Check;
use super::{Coding, Error, Label, PARTS_OF_TICK, Scan, Tdc};
use crate::units::{fs_from_s, tof_from_range};
use macropulse_codec::decode::{
    self, Effort, MOST_RETURNS, Pick, Receiver, ReceiverKind, Sampling,
};

/// Marks by which a receiver of samples decides at least if its file does not say: one alone may be that of
/// any shot.
const LEAST_MARKS: u32 = 2;

/// `[receiver]` as typed.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct ReceiverFile {
    /// How ticks become returns.
    pub kind: ReceiverKindFile,
    /// How much the receiver `matched` does for faint light.
    effort: Effort,
    /// False returns accepted per shot (matched, balanced, sampled).
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
    /// Marks by which a return is decided at least, none of them blanked (sampled): 2 if it is not given,
    /// or as many as there are; no more than a word has.
    #[schemars(range(min = 1))]
    least_marks: Option<u32>,
    /// For how long after each mark that is sent no sample counts, ns (sampled).
    #[schemars(range(min = 0, max = 1e6))]
    blank_ns: f64,
    /// For how long behind a clipped sample none counts, ns (sampled).
    #[schemars(range(min = 0, max = 1e6))]
    recovery_ns: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub(super) enum ReceiverKindFile {
    /// As the paper prints it: bit by bit from the first light on.
    Literal,
    /// Bit by bit, but tries how many leading zero bits were dark.
    Blind,
    /// Correlates the whole known macropulse of every shot in flight.
    Matched,
    /// As `matched`, but what falls on dark chips counts against it; for words of which about half
    /// the chips are lit.
    Balanced,
    /// For shots without a code: the ticks in the range gate.
    Direct,
    /// As `matched`, of a sampled detector: adds up the samples of the marks of every shot in flight.
    Sampled,
}

/// What a receiver is given beside its own section of the file.
pub(super) struct Inputs<'a> {
    pub detector: &'a DetectorFile,
    pub scan: &'a Scan,
    pub tdc: &'a Tdc,
    pub coding: &'a Coding,
    /// Standard deviation of the time of a mark, s.
    pub timing: f64,
    /// As [`Receiver::photons_apart`].
    pub photons_apart: bool,
    /// The detector, where it is sampled.
    pub sampled: Option<&'a Sampled>,
}

impl Check<'_> {
    pub(super) fn receiver(&self, file: &ReceiverFile, inputs: &Inputs) -> Result<Receiver, Error> {
        let &Inputs { detector, scan, tdc, coding, timing, photons_apart, sampled } = inputs;
        let kind = match file.kind {
            ReceiverKindFile::Literal => ReceiverKind::Literal,
            ReceiverKindFile::Blind => ReceiverKind::Blind,
            ReceiverKindFile::Matched => ReceiverKind::Matched,
            ReceiverKindFile::Balanced => ReceiverKind::Balanced,
            ReceiverKindFile::Direct => ReceiverKind::Direct,
            ReceiverKindFile::Sampled => ReceiverKind::Sampled,
        };
        let samples = detector.only().is_some_and(|only| only.file.sample_ps().is_some());
        if samples != (kind == ReceiverKind::Sampled) {
            return self.refuse(
                "receiver.kind",
                "`sampled` is for [detector.sampled], the other receivers for other detectors",
            );
        }
        let is_coded = coding.label.is_some();
        if !samples && (kind == ReceiverKind::Direct) == is_coded {
            return self.refuse(
                "receiver.kind",
                "`direct` is for shots without [code], the other receivers for shots with it",
            );
        }
        self.can_read(kind, coding)?;
        let (returns, pick) = self.returns(file, detector, kind)?;
        let (threshold, lightest) = (file.bit_threshold, coding.codebook.lightest_word() as u32);
        let ticks = |range: f64| fs_from_s(tof_from_range(range)) / tdc.tick_fs;
        let gate = (ticks(scan.min_range), ticks(scan.max_range));
        let light = ticks(scan.light_range);
        if light >= i64::from(u32::MAX / PARTS_OF_TICK) {
            return self.too_fine(samples);
        }
        let Ok(ticks_per_chip) = u32::try_from(coding.chip_fs / tdc.tick_fs) else {
            let most = u32::MAX;
            let message = format!("is more than {most} ticks: use longer ticks or shorter chips");
            return self.refuse("code.chip_ps", message);
        };
        let receiver = Receiver {
            kind,
            effort: file.effort,
            gate_ticks: (gate.0 as u32, gate.1 as u32),
            light_ticks: light as u32,
            ticks_per_chip,
            tick_fs: tdc.tick_fs,
            jitter_ticks: timing * 1e15 / tdc.tick_fs as f64,
            photons_apart,
            false_alarm: self.within("receiver.false_alarm", file.false_alarm, 1e-30, 0.5)?,
            bit_threshold: match kind {
                ReceiverKind::Literal | ReceiverKind::Blind => {
                    self.count("receiver.bit_threshold", threshold, 1, lightest)? as u16
                }
                // The others ask for none: a light word may have fewer marks than the default.
                _ => threshold.clamp(1, lightest.max(1)) as u16,
            },
            returns,
            pick,
            sampling: self.sampling(file, coding, sampled)?,
        };
        // A detector that was refused leaves open what the receiver knows of it.
        if samples && sampled.is_none() {
            return Ok(receiver);
        }
        // What the receiver itself asks before it decodes; the keys ask most of it already.
        match receiver.check(&coding.codebook) {
            Err(decode::Error::TooLong { what, ticks, possible }) => self.refuse(
                "code",
                format!(
                    "{what} of {ticks} ticks is too long to be kept in memory; up to {possible} are \
                     possible: use longer ticks, shorter chips or a shorter code"
                ),
            ),
            Err(why) => self.refuse("receiver", why.to_string()),
            Ok(()) => Ok(receiver),
        }
    }

    /// What a receiver of samples knows of a `sampled` detector.
    fn sampling(
        &self,
        file: &ReceiverFile,
        coding: &Coding,
        sampled: Option<&Sampled>,
    ) -> Result<Option<Sampling>, Error> {
        let Some(sampled) = sampled else { return Ok(None) };
        let most = coding.codebook.lightest_word() as u32;
        let least = match file.least_marks {
            Some(typed) => self.count("receiver.least_marks", typed, 1, most)?,
            None => LEAST_MARKS.min(most),
        };
        let blank = self.within("receiver.blank_ns", file.blank_ns, 0.0, 1e6)? * 1e-9;
        let recovery = self.within("receiver.recovery_ns", file.recovery_ns, 0.0, 1e6)? * 1e-9;
        Ok(Some(sampled.sampling((blank, recovery), least as u16)))
    }

    /// How many returns a shot may have at most, and which are kept of more.
    fn returns(
        &self,
        file: &ReceiverFile,
        detector: &DetectorFile,
        kind: ReceiverKind,
    ) -> Result<(u8, Pick), Error> {
        let wanted = self.count("receiver.returns", file.returns, 1, MOST_RETURNS.into())?;
        let one_event = detector.given().find(|given| given.file.is_single_stop());
        let of_receiver =
            |name: &str| Some(format!("receiver.kind = \"{name}\" gives one return per shot"));
        let one_only = match kind {
            ReceiverKind::Direct => {
                one_event.map(|given| format!("detector.{} gives one event per shot", given.name))
            }
            ReceiverKind::Matched | ReceiverKind::Sampled => None,
            ReceiverKind::Literal => of_receiver("literal"),
            ReceiverKind::Blind => of_receiver("blind"),
            ReceiverKind::Balanced => of_receiver("balanced"),
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
        let most = kind.most_returns();
        if wanted > most.into() {
            let message = format!(
                "is {wanted}, but receiver.kind = \"matched\" finds {most} returns of a shot at most"
            );
            return self.refuse("receiver.returns", message);
        }
        let otherwise = if kind == ReceiverKind::Direct { Pick::First } else { Pick::Strongest };
        Ok((wanted as u8, file.pick.unwrap_or(otherwise)))
    }

    /// Whether a receiver of this kind understands what is sent.
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

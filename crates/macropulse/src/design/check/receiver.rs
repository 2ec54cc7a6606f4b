//! From detection events to returns: converters and receiver.

use super::{Check, TOO_FINE};
use crate::design::file::{ReceiverKindFile, SensorFile};
use crate::design::{Coding, Error, Label, PARTS_OF_TICK, Scan, Tdc};
use crate::units::{fs_from_s, tof_from_range};
use macropulse_codec::decode::{MOST_RETURNS, Pick, Receiver, ReceiverKind};

/// What a receiver is given beside its own section of the file.
pub(super) struct Inputs<'a> {
    pub scan: &'a Scan,
    pub tdc: &'a Tdc,
    pub coding: &'a Coding,
    /// Standard deviation of the time of a mark, s.
    pub timing: f64,
}

impl Check<'_> {
    pub(super) fn tdc(&self, file: &SensorFile) -> Result<Tdc, Error> {
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

    /// Whether each detector of `scan` has a converter.
    pub(super) fn share(&self, tdc: &Tdc, scan: &Scan) -> Result<(), Error> {
        let (converters, channels) = (tdc.converters, scan.channels());
        if converters >= channels {
            return Ok(());
        }
        let message = format!(
            "is {converters}, but the bank is divided evenly among {channels} detectors: write \
             {channels}, or more"
        );
        self.refuse("tdc.converters", message)
    }

    pub(super) fn receiver(&self, file: &SensorFile, inputs: &Inputs) -> Result<Receiver, Error> {
        let &Inputs { scan, tdc, coding, timing } = inputs;
        let kind = match file.receiver.kind {
            ReceiverKindFile::Literal => ReceiverKind::Literal,
            ReceiverKindFile::Blind => ReceiverKind::Blind,
            ReceiverKindFile::Matched => ReceiverKind::Matched,
            ReceiverKindFile::Balanced => ReceiverKind::Balanced,
            ReceiverKindFile::Direct => ReceiverKind::Direct,
        };
        if (kind == ReceiverKind::Direct) == coding.label.is_some() {
            return self.refuse(
                "receiver.kind",
                "`direct` is for shots without [code], the other receivers for shots with it",
            );
        }
        self.can_read(kind, coding)?;
        let (returns, pick) = self.returns(file, kind)?;
        let (threshold, lightest) =
            (file.receiver.bit_threshold, coding.codebook.lightest_word() as u32);
        let ticks = |range: f64| fs_from_s(tof_from_range(range)) / tdc.tick_fs;
        let gate = (ticks(scan.min_range), ticks(scan.max_range));
        let light = ticks(scan.light_range);
        if light >= i64::from(u32::MAX / PARTS_OF_TICK) {
            return self.refuse("tdc.resolution_ps", TOO_FINE);
        }
        Ok(Receiver {
            kind,
            effort: file.receiver.effort,
            gate_ticks: (gate.0 as u32, gate.1 as u32),
            light_ticks: light as u32,
            ticks_per_chip: (coding.chip_fs / tdc.tick_fs) as u32,
            tick_fs: tdc.tick_fs,
            jitter_ticks: timing * 1e15 / tdc.tick_fs as f64,
            false_alarm: self.within(
                "receiver.false_alarm",
                file.receiver.false_alarm,
                1e-30,
                0.5,
            )?,
            bit_threshold: match kind {
                ReceiverKind::Literal | ReceiverKind::Blind => {
                    self.count("receiver.bit_threshold", threshold, 1, lightest)? as u16
                }
                // The others ask for none: a light word may have fewer marks than the default.
                _ => threshold.clamp(1, lightest.max(1)) as u16,
            },
            returns,
            pick,
        })
    }

    /// How many returns a shot may have at most, and which are kept of more.
    fn returns(&self, file: &SensorFile, kind: ReceiverKind) -> Result<(u8, Pick), Error> {
        let wanted =
            self.count("receiver.returns", file.receiver.returns, 1, MOST_RETURNS.into())?;
        let one_event = file.detector.given().find(|given| given.file.is_single_stop());
        let of_receiver =
            |name: &str| Some(format!("receiver.kind = \"{name}\" gives one return per shot"));
        let one_only = match kind {
            ReceiverKind::Direct => {
                one_event.map(|given| format!("detector.{} gives one event per shot", given.name))
            }
            ReceiverKind::Matched => None,
            ReceiverKind::Literal => of_receiver("literal"),
            ReceiverKind::Blind => of_receiver("blind"),
            ReceiverKind::Balanced => of_receiver("balanced"),
        };
        if let Some(why) = one_only {
            if wanted > 1 {
                let message = format!("is {wanted}, but {why}: leave it at 1");
                return self.refuse("receiver.returns", message);
            }
            if file.receiver.pick.is_some() {
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
        Ok((wanted as u8, file.receiver.pick.unwrap_or(otherwise)))
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

//! Records: the input of a receiver beside its shot log.

use crate::{Beats, Histograms, Samples, Taps, Ticks};

/// Declares the kinds of record: variant, type, name.
macro_rules! kinds {
    ($($(#[$doc:meta])* $Kind:ident, $name:literal;)+) => {
        /// A kind of record.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum RecordKind {
            $($(#[$doc])* $Kind,)+
        }

        impl RecordKind {
            /// Its name in the plural, as in files, formats and messages.
            pub fn name(self) -> &'static str {
                match self { $(Self::$Kind => $name,)+ }
            }
        }

        /// The input of a receiver beside its shot log.
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub enum Record<'a> {
            $($(#[$doc])* $Kind(&'a $Kind),)+
        }

        impl Record<'_> {
            /// Returns the kind of this record.
            pub fn kind(&self) -> RecordKind {
                match self { $(Self::$Kind(_) => RecordKind::$Kind,)+ }
            }
        }

        /// The same, owned.
        #[derive(Debug, Clone, PartialEq)]
        pub enum Given {
            $($(#[$doc])* $Kind($Kind),)+
        }

        impl<'a> From<&'a Given> for Record<'a> {
            fn from(given: &'a Given) -> Self {
                match given { $(Given::$Kind(record) => Self::$Kind(record),)+ }
            }
        }

        $(impl<'a> From<&'a $Kind> for Record<'a> {
            fn from(record: &'a $Kind) -> Self {
                Self::$Kind(record)
            }
        })+
    };
}

kinds! {
    /// Ticks of time-to-digital converters.
    Ticks, "ticks";
    /// Samples of analogue-to-digital converters.
    Samples, "samples";
    /// Histograms of counters, added up over the pulses of a burst.
    Histograms, "histograms";
    /// Taps of lock-in detectors.
    Taps, "taps";
    /// Beats of coherent detectors.
    Beats, "beats";
}

impl RecordKind {
    /// True if there is a record of each shot, made of the light of that shot alone.
    pub fn is_by_shot(self) -> bool {
        matches!(self, Self::Histograms | Self::Taps | Self::Beats)
    }
}

impl Given {
    /// How many ticks there are, or samples of all channels, or bins of all histograms, or
    /// taps or places for peaks of all shots.
    pub fn len(&self) -> usize {
        match self {
            Self::Ticks(ticks) => ticks.len(),
            Self::Samples(samples) => samples.code.len(),
            Self::Histograms(histograms) => histograms.counts.len(),
            Self::Taps(taps) => taps.codes.len(),
            Self::Beats(beats) => beats.found.len(),
        }
    }

    /// True if the record is empty.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

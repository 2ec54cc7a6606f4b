//! Ticks to returns: the receiver. It sees ticks and the shot log, never the scene.

mod returns;

pub use returns::{Reject, Returns};

/// Which receiver decodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ReceiverKind {
    /// As printed in \[KP16\]: the first mark opens a macropulse, bit by bit, checksum, look-up.
    Literal,
    /// Bit by bit, but tries how many leading zero bits were dark.
    Blind,
    /// Correlates the whole known macropulse of every shot in flight.
    Matched,
    /// One mark per shot, a detector of its own: the first tick in the range gate.
    Direct,
}

/// What the receiver is set to.
#[derive(Debug, Clone, PartialEq)]
pub struct Receiver {
    /// Which receiver decodes.
    pub kind: ReceiverKind,
    /// Nearest and farthest round trip accepted, in ticks.
    pub gate_ticks: (u32, u32),
    /// TDC ticks per chip.
    pub ticks_per_chip: u32,
    /// Length of a tick, fs.
    pub tick_fs: i64,
    /// Standard deviation of the timing of one edge, in ticks: how far from its place a mark is
    /// looked for.
    pub jitter_ticks: f64,
    /// False returns accepted per shot; the matched receiver derives its threshold from it.
    pub false_alarm: f64,
    /// Marks of a code word that make a 1 bit, for the literal and the blind receiver.
    pub bit_threshold: u16,
}

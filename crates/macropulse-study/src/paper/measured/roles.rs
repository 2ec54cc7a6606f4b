//! What the text of the paper makes of the blocks of its Fig. 7, read from its section 3.

/// Which end of the link a block belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// What makes the light that arrives: emitter and channel.
    Transmitter,
    /// What is made of it: the detector.
    Receiver,
}

/// A kind of block of Fig. 7.
#[derive(Debug, Clone, Copy)]
pub struct Role {
    /// Its colour.
    pub block: &'static str,
    /// Where it belongs by what the text says it computes.
    pub belongs_to: Part,
    /// For which part the text repeats it in the proposed lidar.
    pub repeated_for: Part,
}

/// Pulses and noise are the emitter's (green), the probability of firing over time follows from the
/// channel (upper blue); jitter (lower blue) and the time of firing (red) are the detector's. The
/// text then repeats the first two "for the receiver part", the last two "for the transmitter part".
pub(super) fn printed() -> Vec<Role> {
    use Part::{Receiver, Transmitter};
    [
        ("green", Transmitter, Receiver),
        ("upper blue", Transmitter, Receiver),
        ("lower blue", Receiver, Transmitter),
        ("red", Receiver, Transmitter),
    ]
    .map(|(block, belongs_to, repeated_for)| Role { block, belongs_to, repeated_for })
    .to_vec()
}

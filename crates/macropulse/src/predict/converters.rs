//! Events that the bank of converters loses, in closed form.

use macropulse_codec::statistics::erlang_b;

use crate::design::Tdc;
use crate::units::s_from_fs;

/// Share of detection events that find all converters of a detector's `share` of the bank busy,
/// where `events_per_s` come at random and each keeps one busy for the dead time: Erlang's B
/// \[Erl17\].
pub fn bank_loss(share: &Tdc, events_per_s: f64) -> f64 {
    let offered = events_per_s * s_from_fs(share.dead_fs);
    erlang_b(offered, share.converters)
}

//! Finds two shots in the ticks of one detector.

use std::error::Error;

use macropulse_codec::code::{Codebook, Family, Keying};
use macropulse_codec::decode::Receiver;
use macropulse_codec::{ShotLog, Ticks};

fn main() -> Result<(), Box<dyn Error>> {
    // Bare words of 29 marks in 841 chips of 2.5 ps, a chip to a tick.
    let codebook = Codebook::new(Family::prime(29)?, None, 1, Keying::OnOff)?;
    let receiver = Receiver { gate_ticks: (0, 400_000), ..Receiver::matched(2_500) };
    // Fired 16 000 ticks apart, in words 1 and 2.
    let log = ShotLog::of_one_channel(&[0, 40_000_000], &[1, 2]);
    // Output of a converter: the marks of both, 40 000 and 41 000 ticks later, and noise.
    let mut tick: Vec<u32> = (0..600).map(|n| n * 97).collect();
    for (word, arrives) in [(1, 40_000), (2, 16_000 + 41_000)] {
        tick.extend(codebook.marks(0, word).iter().map(|mark| arrives + u32::from(*mark)));
    }
    tick.sort_unstable();
    tick.dedup();
    let returns = receiver.decode(&codebook, &log, &Ticks { tick, ..Ticks::default() })?;
    for (shot, tof) in returns.shot.iter().zip(&returns.tof) {
        println!("shot {shot}: {:.4} ns", tof * 1e9);
    }
    assert_eq!(returns.shot, [0, 1]);
    Ok(())
}

//! Light that comes back after each mark without pulses, spread over time, as fog sends it back.

use std::borrow::Cow;

use macropulse_codec::ShotLog;

use super::light::address;
use super::{Background, Light, Stretch, Varies};
use crate::units::s_from_fs;

/// Light without pulses that each mark of the sensor itself brings, in the channel of its shot.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Response {
    /// Length of a step of time, fs: more than 0.
    pub step_fs: i64,
    /// Mean photons that arrive in each step after a mark was sent.
    pub photons: Vec<f64>,
}

impl<'a> Light<'a> {
    /// Returns this light, with its responses to the shots of `log` as stretches of background. Steps are
    /// counted from the beginning of the first scan, so they are the same in every band. A mark counts as
    /// sent at the beginning of its step.
    pub(crate) fn with_responses(&self, log: &ShotLog) -> Cow<'_, Self> {
        let mut light = Cow::Borrowed(self);
        let responses = (0..).zip(&self.responses).filter(|(_, response)| response.step_fs > 0);
        for (number, response) in responses {
            for channel in channels(log) {
                let marks = self.marks_in_steps(log, channel, response.step_fs);
                response.add_to(&mut light.to_mut().background, (channel, number), &marks);
            }
        }
        light
    }

    /// Returns the steps in which marks of the shots of `channel` in `log` are sent, ascending, with the
    /// number of marks in each.
    fn marks_in_steps(&self, log: &ShotLog, channel: u16, step_fs: i64) -> Vec<(i64, usize)> {
        let transmitter = &self.transmitters[0];
        let shots = (0..log.len()).filter(|shot| log.channel.get(*shot) == Some(&channel));
        let mut steps: Vec<i64> = shots
            .flat_map(|shot| {
                let marks = transmitter.codebook.marks(log.label[shot], log.word[shot]).iter();
                let fired_fs = log.fired_at_fs[shot];
                let sent =
                    move |mark: &u16| fired_fs + (f64::from(*mark) * transmitter.chip_fs) as i64;
                marks.map(move |mark| sent(mark).div_euclid(step_fs))
            })
            .collect();
        steps.sort_unstable();
        steps.chunk_by(|one, next| one == next).map(|same| (same[0], same.len())).collect()
    }
}

impl Response {
    /// Adds this response, the one of this `number`, to `marks`, by the steps in which they are sent, to the
    /// `background` of `channel`.
    fn add_to(
        &self,
        background: &mut Background,
        (channel, number): (u16, u16),
        marks: &[(i64, usize)],
    ) {
        let length = self.photons.len();
        for run in marks.chunk_by(|(one, _), (next, _)| next - one <= length as i64) {
            let (first, last) = (run[0].0, run[run.len() - 1].0);
            let mut photons = vec![0.0; (last - first) as usize + length];
            for (step, count) in run {
                let from = (step - first) as usize;
                for (sum, part) in photons[from..].iter_mut().zip(&self.photons) {
                    *sum += *count as f64 * part;
                }
            }
            for (step, photons) in (first..).zip(photons).filter(|(_, photons)| *photons > 0.0) {
                background.push(Stretch {
                    channel,
                    from_fs: step * self.step_fs,
                    until_fs: (step + 1) * self.step_fs,
                    per_s: photons / s_from_fs(self.step_fs),
                    varies: Varies::Not,
                    address: address((0, number), step as u64),
                });
            }
        }
    }

    /// Adds the mean photons in each bin of `bin_fs` of a cycle of `interval_fs` whose pulse is sent at its
    /// beginning. Light of earlier pulses counts as well: a response that is longer than a cycle falls into
    /// the cycles that follow.
    pub(crate) fn add_to_cycle(&self, bins: &mut [f64], (bin_fs, interval_fs): (i64, i64)) {
        for (step, photons) in (0..).zip(&self.photons) {
            // A step is divided among the bins in which it lies.
            let mut from = step * self.step_fs;
            let until = from + self.step_fs;
            while from < until {
                let within = from.rem_euclid(interval_fs);
                let bin = within / bin_fs;
                let to = until.min(from + ((bin + 1) * bin_fs).min(interval_fs) - within);
                if let Some(sum) = bins.get_mut(bin as usize) {
                    *sum += photons * (to - from) as f64 / self.step_fs as f64;
                }
                from = to;
            }
        }
    }
}

/// The channels of the shots of `log`, each once.
fn channels(log: &ShotLog) -> Vec<u16> {
    let mut channels = log.channel.clone();
    channels.sort_unstable();
    channels.dedup();
    channels
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::channel::Transmitter;
    use crate::design::Design;
    use crate::emit::Band;

    /// Two shots of a sensor of single pulses, a response of three steps of 1 ns: what both bring in one step adds
    /// up, and nothing comes otherwise.
    #[test]
    fn responses_of_shots_that_overlap_add_up() {
        let design = Design::open("peregrine", &[]).unwrap();
        let mut log = Band { scan: 0, first: 0, shots: 4 }.shot_log(&design).part(0..2);
        log.channel = vec![7, 7];
        log.fired_at_fs = vec![10_000_000, 12_000_000];
        let response = Response { step_fs: 1_000_000, photons: vec![5.0, 2.0, 1.0] };
        let light = Light {
            transmitters: vec![Transmitter::of(&design, 1.0)],
            responses: vec![response],
            ..Light::default()
        };
        let background = light.with_responses(&log).into_owned().background;
        assert_eq!(background.channel, [7; 5]);
        let from: Vec<i64> = background.from_fs.iter().map(|fs| fs / 1_000_000).collect();
        assert_eq!(from, [10, 11, 12, 13, 14]);
        let photons: Vec<f64> = background.per_s.iter().map(|rate| rate * 1e-9).collect();
        for (found, expected) in photons.iter().zip([5.0, 2.0, 6.0, 2.0, 1.0]) {
            approx::assert_relative_eq!(*found, expected, max_relative = 1e-12);
        }
    }

    /// A response that outlasts a cycle of 10 ns goes on in the next one, and none of it is lost.
    #[test]
    fn a_response_is_folded_into_the_cycles_of_a_burst() {
        let response = Response { step_fs: 4_000_000, photons: vec![4.0, 8.0, 2.0] };
        let mut bins = vec![0.0; 5];
        response.add_to_cycle(&mut bins, (2_000_000, 10_000_000));
        // From 0 to 4 ns, from 4 to 8 ns, from 8 to 10 and 0 to 2 ns.
        assert_eq!(bins, [3.0, 2.0, 4.0, 4.0, 1.0]);
    }
}

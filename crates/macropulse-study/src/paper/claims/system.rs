//! Claims of the paper on time, converters and the HDL-64E.

use crate::paper::claim::{Claim, Verdict, said};
use crate::paper::measured::{Converters, Head, Timing};
use macropulse::units::range_from_tof;

/// Shots, pixels and clocks.
pub(super) fn timing(found: &Timing) -> Vec<Claim> {
    let rollover = 2_f64.powi(32) * found.clock;
    let stays = found.pixel_period * 1e9;
    let full_rate = (found.rate - 60.0).abs() < 0.5;
    vec![
        said(
            "refresh",
            "title, 2",
            "Without idle listening the refresh rate does not depend on the range",
            "60 Hz at 150 m, range irrelevant",
        )
        .holds_or_partly(
            full_rate && found.word_range.is_infinite(),
            full_rate && found.waiting_rate < found.rate,
            format!(
                "one beam that waits for each echo reaches {:.2} Hz with these directions, a coded \
                 one {:.0} Hz; but its words return after {:.0} m, so range is limited after all, \
                 at a multiple",
                found.waiting_rate, found.rate, found.word_range
            ),
        ),
        said("shots-in-flight", "2.2", "Up to 25 pixels may arrive in 1 \u{b5}s from 150 m", "25").holds_if(
            found.shots_in_flight.ceil() == 25.0,
            format!(
                "{:.2} shots in {:.4} \u{b5}s; pixel period {stays:.3} ns = {:.2} chips",
                found.shots_in_flight,
                found.gate * 1e6,
                found.pixel_period * found.chip_rate
            ),
        ),
        said(
            "overlap",
            "2",
            "Reflections of several pixels can be received at the same time",
            "at the same time",
        )
        .holds_if(
            found.shots_in_flight >= 2.0,
            format!(
                "{:.3} macropulses at any instant on average, whatever the scene; two overlap where \
                 the range falls by more than {:.1} m from a pixel to the next, {:.0} come at once \
                 where it falls by {:.1} m per pixel",
                found.mean_overlap,
                range_from_tof((found.pixel_period - found.macropulse).max(0.0)),
                found.shots_in_flight.ceil(),
                range_from_tof(found.pixel_period)
            ),
        ),
        said("rollover", "2", "A 32-bit count of 100 ps rolls over every 430 ms", "\u{2248} 430 ms")
            .holds_if(
                (rollover * 1e3 - 430.0).abs() < 1.0,
                format!(
                    "{:.1} ms; 2.5 ps ticks in 32 bits would wrap in {:.1} ms, within a scan of \
                     {:.1} ms",
                    rollover * 1e3,
                    2_f64.powi(32) * found.tick * 1e3,
                    found.scan * 1e3
                ),
            ),
        said(
            "converter-range",
            "2.3",
            "10 bits of 2.5 ps give a conversion range of 2.56 ns",
            "2.56 ns",
        )
        .holds_if(
            (found.conversion_range - 2.56e-9).abs() < 1e-15,
            format!(
                "{:.2} ns, of which a START every 100 ps uses {:.0} of {:.0} codes",
                found.conversion_range * 1e9,
                found.clock / found.tick,
                found.conversion_range / found.tick
            ),
        ),
        said(
            "mirror",
            "2.2",
            "The mirror stays on each pixel for about 40 ns, long enough for a macropulse",
            "\u{2248} 40 ns, sufficient",
        )
        .holds_or_partly(
            (stays - 40.0).abs() < 1.5 && found.resonant_dwell >= found.macropulse,
            (stays - 40.0).abs() < 1.5 && found.pixel_period >= found.macropulse,
            format!(
                "{stays:.2} ns on average; a resonant mirror spends {:.2} ns at the centre of a \
                 line, and a macropulse lasts {:.2} ns, in which the mirror moves {:.2} pixel on \
                 average",
                found.resonant_dwell * 1e9,
                found.macropulse * 1e9,
                found.macropulse / found.pixel_period
            ),
        ),
    ]
}

/// The bank of converters.
pub(super) fn converters(found: &Converters) -> Vec<Claim> {
    let capacity = f64::from(found.number) / found.conversion;
    let within = |time: f64| found.load * time;
    let mean_fits = found.load <= capacity && (capacity * 1e-9 - 345.0).abs() < 0.5;
    vec![
        said(
            "dead-time-rate",
            "2.3",
            "300 MS/s and a dead time of 3.3 ns describe the same converter",
            "300 MS/s, 3.3 ns",
        )
        .holds_if(
            (found.conversion - found.dead_time).abs() < 0.05e-9
                && found.conversion >= found.dead_time,
            format!(
                "a conversion every {:.3} ns is a dead time of 3.3 ns, rounded; the {:.0} pulses of \
                 the paper take the former, the latter gives {:.0}",
                found.conversion * 1e9,
                within(found.conversion),
                within(found.dead_time)
            ),
        ),
        said(
            "converters",
            "2.3",
            "At worst 1149 pulses come within a dead time: 1150 converters take 345 Gcps",
            "345 Gcps, 1149",
        )
        .holds_or_partly(
            mean_fits && found.most_marks < found.number,
            mean_fits,
            format!(
                "1150 conversions every {:.3} ns are {:.0} Gcps, and 25 words of nothing but 1 bits \
                 bring {:.1} on average; at worst 25 successive shots bring {} marks within {:.1} \
                 ns, in {} ticks of which each is one detection event",
                found.conversion * 1e9,
                capacity * 1e-9,
                found.load * 1e-9,
                found.most_marks,
                found.dead_time * 1e9,
                found.ticks
            ),
        ),
    ]
}

/// The HDL-64E.
pub(super) fn head(found: &Head) -> Vec<Claim> {
    let (upper, lower) = found.elevations.split_at(found.elevations.len() / 2);
    let step = |rows: &[f64]| rows.windows(2).next().map_or(0.0, |pair| pair[0] - pair[1]);
    let lasers = found.elevations.len();
    let is_even = (step(upper) - step(lower)).abs() < 1e-3;
    let ends =
        [found.elevations.first(), found.elevations.last()].map(|e| e.copied().unwrap_or(0.0));
    let rounds_to = |angle: f64| (angle - 0.08).abs() < 0.005;
    vec![
        said(
            "elevations",
            "Table 3",
            "How the 64 lasers of the HDL-64E share its 26.8\u{b0}",
            "unsaid in our copy; often taken as equal steps",
        )
        .is(
            if is_even { Verdict::Holds } else { Verdict::Unsaid },
            format!(
                "no unit has equal steps: {} steps of {:.2}\u{b0} from {:+.1}\u{b0} down, then {} \
                 of {:.2}\u{b0} to {:+.1}\u{b0} (preset hdl-64e-equal-spacing has equal steps)",
                upper.len().saturating_sub(1),
                step(upper),
                ends[0],
                lower.len().saturating_sub(1),
                step(lower),
                ends[1]
            ),
        ),
        said(
            "hdl-simultaneous",
            "1",
            "The HDL-64E measures 64 points simultaneously",
            "64 simultaneously",
        )
        .holds_or_partly(
            found.at_once == 64,
            lasers == 64,
            format!(
                "{lasers} lasers, in our preset {} at a time; from the first to the last of an azimuth \
                 step {:.0} \u{b5}s go by",
                found.at_once,
                found.in_turn * 1e6
            ),
        ),
        said("hdl-step", "1", "The HDL-64E turns by 0.08\u{b0} at 5 Hz", "0.08\u{b0}, 5 Hz")
            .holds_or_partly(
                rounds_to(found.step) && rounds_to(found.step_of_unit),
                rounds_to(found.step),
                format!(
                    "{:.2}\u{b0} in our preset, after the data sheet; a unit that fires each laser \
                 20 833 times a second steps by {:.4}\u{b0} at {:.0} Hz",
                    found.step, found.step_of_unit, found.turns
                ),
            ),
    ]
}

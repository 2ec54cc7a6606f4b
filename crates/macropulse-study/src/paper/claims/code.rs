//! Claims of the paper on its codes and payloads.

use crate::paper::claim::{Claim, Verdict, said};
use crate::paper::measured::{Payloads, Timing, Words};

/// Claims on words and correlations.
pub(super) fn words(words: &Words, timing: &Timing) -> Vec<Claim> {
    let Words { count, length, weight, .. } = *words;
    let (least, most) = words.sidelobes;
    let needed = timing.shots_in_flight.ceil();
    vec![
        said(
            "prime-code",
            "2.2",
            "GF(29) gives 29 code words of length 841 and weight 29",
            "29 words, 841 chips, weight 29",
        )
        .holds_if(
            (count, length, weight) == (29, 841, 29),
            format!("{count} words, {length} chips, weight {weight}"),
        ),
        said(
            "starts-with-c0",
            "2.2, Tables 1 and 2",
            "Every prime sequence starts with code word C0, and so with 1",
            "every S(i) starts with C0",
        )
        .holds_or_partly(
            words.equal_to_c0 == count,
            words.zero_first == count && words.mark_first == count,
            format!(
                "{} of {count} sequences begin with the element 0, {} words with a mark, {} with \
                 the first block of C0; {} is C0 itself",
                words.zero_first, words.mark_first, words.block_of_c0, words.equal_to_c0
            ),
        ),
        said("cross-correlation", "2.3", "Two different words coincide in 2 marks at most", "\u{2264} 2")
            .holds_if(
                words.most_shared == 2,
                format!("{}, over all pairs and lags, periodic and aperiodic", words.most_shared),
            ),
        said("orthogonal", "2", "A coded laser pulse becomes orthogonal to another one", "orthogonal")
            .holds_if(
                words.mean_shared == 0.0 && words.variance == 0.0,
                format!(
                    "mean cross-correlation {:.6}, variance {:.5} ({:.5} without C0): nearly \
                     orthogonal at best, as 0 would be needed",
                    words.mean_shared, words.variance, words.variance_without_c0
                ),
            ),
        said(
            "autocorrelation",
            "2.3",
            "The autocorrelation peak of 29 tells the arrival time",
            "peak 29, sidelobes unsaid",
        )
        .holds_or_partly(
            2 * usize::from(most.max(words.c0_sidelobe)) <= weight,
            weight == 29,
            format!(
                "sidelobes of {least} to {most} of {weight} on every word; C0 repeats every 29 \
                 chips with {}; C1 may lock {:.1} mm off. Only the maximum over the whole \
                 macropulse settles it",
                words.c0_sidelobe,
                words.c1_error * 1e3
            ),
        ),
        said(
            "interferers",
            "2.3",
            "Error-free up to 14 interfering signals",
            "(29 \u{2212} 1)/2 = 14",
        )
        .holds_if(
            words.harmless == 14,
            format!(
                "{} guaranteed; with 24 others, whose bits begin at any chip, a bit fails with \
                 {:.2e} (counting receiver) or {:.2e} (chips limited to one); with {:.2e} or \
                 {:.1e} if all bits began together",
                words.harmless,
                words.unaligned_bit_errors[0],
                words.unaligned_bit_errors[1],
                words.bit_errors[0],
                words.bit_errors[1]
            ),
        ),
        said(
            "interference",
            "2.2",
            "The overall interference is always lower than the autocorrelation peak",
            "always lower",
        )
        .holds_if(
            (words.interference as usize) < weight,
            format!(
                "{} other words can add {} marks at the peak of {weight}, each at its worst lag",
                words.others, words.interference
            ),
        ),
        said(
            "resistance",
            "2.2",
            "Spreading resists intentional and unintentional interference",
            "greater resistance",
        )
        .holds_or_partly(
            timing.noise_printed > timing.noise_first && timing.noise_matched > timing.noise_first,
            timing.noise_matched > timing.noise_first,
            format!(
                "nine of ten echoes from {:.0} m are still found beside {:.1e} false detections per \
                 second if a receiver takes the first one, {:.1e} if the first opens a macropulse, \
                 as printed, {:.1e} if whole macropulses are matched",
                timing.rated_range, timing.noise_first, timing.noise_printed, timing.noise_matched
            ),
        ),
        said(
            "twenty-five-words",
            "2.2",
            "More than 25 different words are needed, hence GF(29)",
            "> 25, so 29",
        )
        .holds_or_partly(
            needed > 25.0 && needed <= count as f64,
            needed <= count as f64,
            format!(
                "{:.2} shots in flight: {needed:.0} words are enough, and return after {:.1} m. \
                 GF(29) is the smallest prime field that has as many, {count}",
                timing.shots_in_flight, timing.range_of_25
            ),
        ),
    ]
}

/// Claims on label, checksum and the marks they make.
pub(super) fn payload(found: &Payloads, timing: &Timing) -> Vec<Claim> {
    let Payloads { bits, chips, columns, .. } = *found;
    let (fewest, mean, most) = found.marks;
    let printed = 27.4875e-9;
    vec![
        said("payload", "2.1", "10-bit column and 3-bit checksum make a 13-bit stream", "13 bits")
            .holds_if(bits == 13, format!("{bits} bits; column 511 is {}", found.of_511)),
        said("macropulse-chips", "2.2", "13 bits spread by 841 chips give 10 933 chips", "10 933 chips")
            .holds_if(chips == 10_933, format!("{chips} chips")),
        said("macropulse-length", "2.2", "10 933 chips of 2.5 ps last 27.4875 ns", "27.4875 ns").holds_if(
            (found.macropulse - printed).abs() < 5e-14,
            format!(
                "{:.4} ns; 27.4875 ns would be {:.0} chips",
                found.macropulse * 1e9,
                printed / found.chip
            ),
        ),
        said("ones", "2.2", "A macropulse has 377 ones and 10 556 zeros", "377 ones").holds_if(
            (fewest, most) == (377, 377),
            format!(
                "{fewest} to {most} marks, mean {:.3} bits = {mean:.1}; {} would need thirteen 1 \
                 bits, which no column has",
                mean / found.weight as f64,
                found.weight as u32 * bits
            ),
        ),
        said("micropulses", "2.2", "A laser pulse contains 10 933 micropulses", "10 933").holds_or_partly(
            fewest as u32 == 10_933,
            chips == 10_933,
            format!(
                "{chips} chips, of which {fewest} to {most} are lit, {:.1} % on average; a whole \
                 scan has {:.2} M micropulses of light, not {:.0} M as with 377 each",
                100.0 * mean / f64::from(chips),
                found.marks_per_scan as f64 * 1e-6,
                377e-6 * found.marks_per_scan as f64 / mean
            ),
        ),
        said("first-is-one", "2.2, 2.3", "The first signal of a macropulse is always 1", "always").holds_if(
            found.begin_dark == 0,
            format!(
                "true of every word, but {} of {columns} columns begin with a 0 bit",
                found.begin_dark
            ),
        ),
        said("dark-column", "2.1", "Every column can be sent", "848 columns").holds_if(
            found.dark.is_empty(),
            match found.dark.as_slice() {
                [] => "every column has light".to_owned(),
                dark => format!("columns {dark:?} are {bits} zeros: no light at all"),
            },
        ),
        said("crc", "2.1", "CRC-3 (x\u{b3} + x + 1) finds errors", "validates the bit stream")
            .holds_or_partly(
                found.distance > 2 && found.aliases == 0,
                found.distance > 1,
                format!(
                    "distance {}; {:.1} % of random streams pass as a legal column; {} shifts turn \
                     a column into another legal one. The shots in flight must be checked too",
                    found.distance,
                    100.0 * found.legal,
                    found.aliases
                ),
            ),
        column(found, timing),
        word_of_pixel(found, timing),
        repair(found, timing),
    ]
}

fn column(found: &Payloads, timing: &Timing) -> Claim {
    let said = said(
        "column-identifies",
        "2.1, 2.3",
        "The column number of an echo tells its row and the time of its emission",
        "can be used to identify",
    );
    let is_alone = f64::from(found.column_apart) > timing.shots_in_flight;
    said.holds_or_partly(
        is_alone && found.dark.is_empty(),
        is_alone,
        format!(
            "of {:.1} shots in flight no two have the same column, which comes again after {:.0} m; \
             columns without light, that cannot be told: {}",
            timing.shots_in_flight,
            timing.column_range,
            found.dark.len()
        ),
    )
}

fn word_of_pixel(found: &Payloads, timing: &Timing) -> Claim {
    let said = said("word-of-pixel", "2.2", "Which of the 29 words a pixel is sent with", "unsaid");
    let will_do = timing.word_range > timing.rated_range;
    said.is(
        if will_do { Verdict::Unsaid } else { Verdict::Fails },
        format!(
            "pixel mod {}: the word alone names the shot in flight up to {:.0} m; column mod 29 \
             would clash at the ends of rows, where two of the same word are {} shots apart",
            found.word_modulus, timing.word_range, found.column_clash
        ),
    )
}

fn repair(found: &Payloads, timing: &Timing) -> Claim {
    let said = said("fixed-payload", "2.1", "What would repair the payload", "unsaid");
    let Some(fixed) = found.repaired else {
        return said.is(Verdict::Fails, "nothing was found that does".to_owned());
    };
    let will_do = fixed.dark == 0 && fixed.macropulse < timing.pixel_period;
    said.is(
        if will_do { Verdict::Unsaid } else { Verdict::Fails },
        format!(
            "a leading sync bit and CRC init 7: {} bits, {:.3} ns of the {:.2} ns of a pixel, {} \
             dark columns (preset kim-park-2016-fixed)",
            fixed.bits,
            fixed.macropulse * 1e9,
            timing.pixel_period * 1e9,
            fixed.dark
        ),
    )
}

//! Every number of [KP16] that can be checked by arithmetic: computed here, and found again in the
//! row of the report that judges it.
//!
//! Correlations, error curves and payloads have laws of their own in `laws.rs`. Table 4 follows from
//! angles in `table_4.rs`, and `clean_scan.rs` repeats its experiment. `claims.rs` plants a number in
//! every row.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::f64::consts::PI;
use std::sync::LazyLock;

use approx::assert_relative_eq;
use macropulse::channel::Link;
use macropulse::codec::code::correlation::{aperiodic_sidelobe, periodic_sidelobe};
use macropulse::design::safety::{Class1, Rule};
use macropulse::design::{Derived, Design, Pattern};
use macropulse::emit::{Band, short_bands};
use macropulse::environment::Environment;
use macropulse::predict::link::{diffraction, spot_depth};
use macropulse::predict::multiple_access::{mean_overlap, shots_in_flight, word_reuse_range};
use macropulse::predict::ranging;
use macropulse::scene::Scene;
use macropulse::sim;
use macropulse::units::{SPEED_OF_LIGHT, s_from_fs};
use macropulse_study::paper::Verdict::{Assumed, Fails, Holds, Partly, Unsaid};
use macropulse_study::paper::{Claim, OnPaper, Verdict, judge_on_paper};

static DESIGN: LazyLock<Design> = LazyLock::new(|| Design::open("kim-park-2016", &[]).unwrap());
static DERIVED: LazyLock<Derived> = LazyLock::new(|| DESIGN.derived());
static CLAIMS: LazyLock<Vec<Claim>> =
    LazyLock::new(|| judge_on_paper(&OnPaper::of(&DESIGN).unwrap()));

/// The report has a row `id`, judges it so, and names these numbers.
#[track_caller]
fn reported(id: &str, verdict: Verdict, numbers: &[&str]) {
    let claim = CLAIMS.iter().find(|claim| claim.id == id);
    let Some(claim) = claim else { panic!("the report has no row {id:?}") };
    assert_eq!(claim.verdict, verdict, "{id}: {}", claim.measured);
    for number in numbers {
        assert!(claim.measured.contains(number), "{id}: no {number:?} in {:?}", claim.measured);
    }
}

mod words {
    use super::*;

    #[test]
    fn the_prime_code_over_29_has_29_words_of_841_chips_and_29_marks() {
        let family = DESIGN.emission.coding().codebook.family();
        assert_eq!((family.count(), family.length(), family.weight()), (29, 841, 29));
        reported("prime-code", Holds, &["29 words, 841 chips, weight 29"]);
        // Mean, variance and maximum are counted in laws.rs.
        reported("cross-correlation", Holds, &["2, over all pairs"]);
        reported("orthogonal", Fails, &["1.000000", "0.32105", "0.34483"]);
    }

    #[test]
    fn correlations_go_round_with_a_minus() {
        let words = DESIGN.emission.coding().codebook.family().words();
        let lit = |word: usize, chip: i32| words[word].marks.iter().any(|&m| i32::from(m) == chip);
        let met = |shift: &dyn Fn(i32) -> i32| {
            (0..841).filter(|&n| lit(3, n) && lit(7, shift(n))).count()
        };
        for lag in [0, 1, 30, 217, 840] {
            let round = met(&|n| (n + lag) % 841);
            assert_eq!(round, met(&|n| n + lag) + met(&|n| n + lag - 841), "{lag}");
        }
        reported("eq4-sign", Holds, &["0 of 707281"]);
        reported("eq3-support", Partly, &["peak of 0", "29 with"]);
        reported("starts-with-c0", Partly, &["29 of 29 sequences", "1 is C0 itself"]);
    }

    #[test]
    fn own_sidelobes_are_nearly_as_high_as_the_peak() {
        let words = DESIGN.emission.coding().codebook.family().words();
        let periodic: Vec<u16> =
            words.iter().map(|word| periodic_sidelobe(word).unwrap().height).collect();
        assert_eq!(periodic[0], 29);
        assert!(periodic[1..].iter().all(|&height| height == 28));
        let c1 = aperiodic_sidelobe(&words[1]).unwrap();
        assert_eq!((c1.lag, c1.height), (30, 28));
        let off = f64::from(c1.lag) * DERIVED.tick_range;
        assert_relative_eq!(off, 11.24e-3, max_relative = 1e-3);
        reported("autocorrelation", Partly, &["22 to 28 of 29", "with 29", "11.2 mm"]);
    }

    #[test]
    fn fourteen_interferers_are_harmless_and_24_nearly_so() {
        // The curves themselves are in laws.rs.
        reported("interferers", Holds, &["14 guaranteed", "1.31e-7", "1.02e-17", "3.97e-7"]);
        reported("twenty-five-words", Partly, &["24.44 shots", "25 words", "153.4 m", "29"]);
        // 24 others of two coincidences each, but for the one word that C1 meets once.
        reported("interference", Fails, &["24 other words can add 48 marks"]);
    }
}

mod payload {
    use super::*;

    fn leading_zeros() -> usize {
        let payload = DESIGN.emission.coding().codebook.payload().unwrap();
        (0..848).filter(|&label| payload.text(label).starts_with('0')).count()
    }

    #[test]
    fn thirteen_bits_make_10_933_chips_that_last_27_3325_ns() {
        let codebook = &DESIGN.emission.coding().codebook;
        assert_eq!(codebook.payload().unwrap().bits(), 13);
        assert_eq!(codebook.chips(), 10_933);
        assert_relative_eq!(DERIVED.macropulse, 27.3325e-9, max_relative = 1e-12);
        // The printed length would be this many chips.
        let chips = 27.4875e-9 / s_from_fs(DESIGN.emission.coding().chip_fs);
        assert_relative_eq!(chips, 10_995.0, max_relative = 1e-12);
        reported("payload", Holds, &["13 bits"]);
        reported("macropulse-chips", Holds, &["10933 chips"]);
        reported("macropulse-length", Fails, &["27.3325 ns", "10995 chips"]);
    }

    #[test]
    fn macropulses_have_58_to_319_marks_and_never_377() {
        let codebook = &DESIGN.emission.coding().codebook;
        let weights = || codebook.weights().map(|(_, most)| most);
        let lit = || weights().filter(|&weight| weight > 0);
        assert_eq!((lit().min(), lit().max()), (Some(58), Some(319)));
        let bits = weights().sum::<usize>() as f64 / 29.0 / 848.0;
        assert_relative_eq!(bits, 6.198, max_relative = 1e-4);
        assert_eq!((DERIVED.marks.0, DERIVED.marks.2), (58, 319));
        assert_relative_eq!(DERIVED.marks.1, 29.0 * bits, max_relative = 1e-12);
        reported("ones", Fails, &["58 to 319 marks", "6.198 bits = 179.7", "377"]);
    }

    #[test]
    fn most_columns_begin_in_the_dark() {
        assert_eq!(leading_zeros(), 512);
        assert_relative_eq!(512.0 / 848.0, 0.60, max_relative = 0.01);
        let bit = 841.0 * DERIVED.tick_range;
        assert_relative_eq!(bit, 0.315, max_relative = 1e-3);
        reported("first-is-one", Fails, &["512 of 848"]);
    }

    #[test]
    fn column_0_has_no_light_and_must_be_allowed_to() {
        let codebook = &DESIGN.emission.coding().codebook;
        let dark: Vec<u16> = (0..848).filter(|&l| codebook.marks(l, 1).is_empty()).collect();
        assert_eq!(dark, [0]);
        reported("dark-column", Fails, &["[0]", "13 zeros"]);
        let forbid = [("code.allow_dark".to_owned(), "false".to_owned())];
        let refusal = Design::open("kim-park-2016", &forbid).unwrap_err().to_string();
        assert!(refusal.contains("allow_dark"), "{refusal}");
    }

    #[test]
    fn the_checksum_has_distance_2_and_passes_a_tenth_of_all_words() {
        let payload = DESIGN.emission.coding().codebook.payload().unwrap();
        assert_eq!(payload.distance(), 2);
        assert_relative_eq!(payload.legal_fraction(848), 0.1035, max_relative = 1e-3);
        assert_eq!(payload.shift_aliases(848).len(), 337);
        reported("crc", Partly, &["distance 2", "10.4 %", "337 shifts"]);
    }

    #[test]
    fn a_sync_bit_and_crc_init_7_repair_it_within_the_dwell() {
        let fixed = Design::open("kim-park-2016-fixed", &[]).unwrap();
        let payload = fixed.emission.coding().codebook.payload().unwrap();
        assert_eq!((payload.bits(), payload.crc().init), (14, 7));
        assert!((0..848).all(|label| !payload.is_dark(label)));
        assert!(payload.shift_aliases(848).is_empty());
        let derived = fixed.derived();
        assert_relative_eq!(derived.macropulse, 29.435e-9, max_relative = 1e-12);
        assert!(derived.macropulse < derived.pixel_period);
        // C0, which repeats itself, is not sent.
        assert_eq!(
            (fixed.emission.coding().first_word, fixed.emission.coding().word_modulus),
            (1, 28)
        );
        reported("fixed-payload", Unsaid, &["14 bits, 29.435 ns", "0 dark columns"]);
    }
}

mod timing {
    use super::*;

    #[test]
    fn light_from_150_m_is_24_44_shots_late() {
        assert_relative_eq!(DERIVED.gate, 1.0007e-6, max_relative = 1e-5);
        assert_relative_eq!(DERIVED.pixel_period, 40.946e-9, max_relative = 1e-5);
        let chips = DERIVED.pixel_period / s_from_fs(DESIGN.emission.coding().chip_fs);
        assert_relative_eq!(chips, 16_378.41, max_relative = 1e-6);
        let flying = shots_in_flight(150.0, DERIVED.pixel_period);
        assert_relative_eq!(flying, 24.44, max_relative = 1e-4);
        reported("shots-in-flight", Holds, &["24.44", "1.0007", "40.946 ns", "16378.41 chips"]);
    }

    #[test]
    fn the_word_alone_names_the_shot_within_178_m() {
        let reach = word_reuse_range(29, DERIVED.pixel_period);
        assert_relative_eq!(reach, 178.0, max_relative = 1e-3);
        assert!(reach > DESIGN.scan.max_range);
        reported("word-of-pixel", Unsaid, &["pixel mod 29", "178 m"]);
        reported("refresh", Partly, &["2.46 Hz", "178 m"]);
        // One row further the same column would have the word of a shot in flight.
        let log = short_bands(&DESIGN, 0).nth(1).unwrap().shot_log(&DESIGN);
        let (row, column) = (u32::from(log.row[900]), u32::from(log.column[900]));
        assert_eq!(u32::from(log.word[900]), (row * 848 + column) % 29);
    }

    #[test]
    fn two_thirds_of_a_macropulse_overlap_on_average() {
        let overlap = mean_overlap(DERIVED.macropulse, DERIVED.pixel_period);
        assert_relative_eq!(overlap, 0.6675, max_relative = 1e-4);
        let fall = DERIVED.pixel_period * SPEED_OF_LIGHT / 2.0;
        assert_relative_eq!(fall, 6.14, max_relative = 1e-3);
        reported("overlap", Holds, &["0.668 macropulses", "6.1 m per pixel"]);
    }

    #[test]
    fn a_scan_has_73_million_marks() {
        assert_relative_eq!(DERIVED.marks_per_scan as f64, 73.16e6, max_relative = 1e-4);
        let chips = DESIGN.scan_period() / s_from_fs(DESIGN.emission.coding().chip_fs);
        assert_relative_eq!(chips, 6.67e9, max_relative = 1e-3);
        let density = DERIVED.marks_per_scan as f64 / chips;
        assert_relative_eq!(density, 0.0110, max_relative = 5e-3);
        reported("micropulses", Partly, &["73.16 M", "10933 chips", "153 M"]);
    }

    #[test]
    fn the_bank_of_converters_is_sized_for_macropulses_without_zeros() {
        let rate = 25.0 * 29.0 / 841.0 / s_from_fs(DESIGN.clock.tick_fs);
        assert_relative_eq!(rate, 345e9, max_relative = 1e-3);
        assert_relative_eq!(rate * 3.333e-9, 1149.0, max_relative = 1e-3);
        assert_eq!(DESIGN.bank().unwrap().converters, 1150);
        reported("converters", Partly, &["345 Gcps", "344.8 on average"]);
        reported("dead-time-rate", Holds, &["3.333 ns", "1149", "1138"]);
    }

    #[test]
    fn an_ordinary_scene_keeps_about_48_converters_busy() {
        let scene = Scene::open("car-50m").unwrap();
        let is_road = |band: &Band| (306..324).contains(&(band.first / 848));
        let road: Vec<Band> = short_bands(&DESIGN, 0).filter(is_road).collect();
        let tally = sim::scan_part(&DESIGN, &scene, 1, &road).unwrap().tally;
        assert!((30..=65).contains(&tally.peak_busy), "{} busy", tally.peak_busy);
        assert_eq!(tally.lost, 0);
    }

    #[test]
    fn counters_roll_over() {
        let ticks = 2_f64.powi(32);
        let clock = ticks * s_from_fs(DESIGN.clock.period_fs);
        assert_relative_eq!(clock, 429.5e-3, max_relative = 1e-4);
        let tick = ticks * s_from_fs(DESIGN.clock.tick_fs);
        assert_relative_eq!(tick, 10.7e-3, max_relative = 5e-3);
        assert!(tick < DESIGN.scan_period());
        reported("rollover", Holds, &["429.5 ms", "10.7 ms"]);
        reported("converter-range", Holds, &["2.56 ns"]);
    }

    #[test]
    fn a_resonant_mirror_leaves_the_pixel_before_the_macropulse_ends() {
        let resonant = [
            ("scan.raster.mirror".to_owned(), "sinusoidal".to_owned()),
            ("scan.raster.duty".to_owned(), "1.0".to_owned()),
        ];
        let dwell = Design::open("kim-park-2016", &resonant).unwrap().derived().shortest_dwell;
        assert_relative_eq!(dwell, 26.07e-9, max_relative = 1e-3);
        assert!(dwell < DERIVED.macropulse);
        reported("mirror", Partly, &["40.95 ns", "26.07 ns", "0.67 pixel"]);
    }

    #[test]
    fn equation_1_holds_for_a_triangular_sweep() {
        // A sweep up by Δf in half a period meets its echo a beat Δf·(2R/c)/(T/2) apart.
        let (range, period, excursion) = (42.0, 2e-3, 1.5e9);
        let beat = excursion * (2.0 * range / SPEED_OF_LIGHT) / (period / 2.0);
        let measured = ranging::frequency_modulated(beat, period, excursion);
        assert_relative_eq!(measured, range, max_relative = 1e-12);
        // With Δf the beat frequency, as printed, it would be cT/4 whatever the range.
        let printed = ranging::frequency_modulated(beat, period, beat);
        assert_relative_eq!(printed, SPEED_OF_LIGHT * period / 4.0, max_relative = 1e-12);
        // The sweep of the simulated lidar takes 10 µs: c·10 µs/4.
        reported("eq1-fmcw", Partly, &["triangular", "749 m whatever the range"]);
    }
}

mod walls {
    use super::*;
    use macropulse_study::paper::measured::{Equations, Ranging};

    static FOUND: LazyLock<Equations> = LazyLock::new(|| OnPaper::of(&DESIGN).unwrap().equations);

    /// The mean of Eq. 1 is the range of the wall: N ≥ 240 shots, seed 1, to five standard errors (α = 6e-7) and 5 mm of
    /// bias. Control: a wall that stands a metre farther is told apart.
    #[track_caller]
    fn is_found_at(found: &Ranging, range: f64) {
        assert!(found.shots >= 240, "{found:?}");
        let within = 5.0 * found.error + 5e-3;
        assert!((found.equation - range).abs() < within, "{found:?}, not {range}");
        assert!((found.equation - range - 1.0).abs() > within, "{found:?}");
        // The points of its own receiver are there too.
        assert!((found.points - range).abs() < within, "{found:?}, not {range}");
    }

    #[test]
    fn pulse_phase_and_beat_give_the_range_of_a_wall() {
        is_found_at(&FOUND.pulse, 42.0);
        is_found_at(&FOUND.amplitude, 42.0);
        is_found_at(&FOUND.frequency[0].found, 42.0);
        is_found_at(&FOUND.frequency[1].found, 84.0);
        reported("eq1-amcw", Partly, &["simulated", "74.9 m", "at 116.9 m"]);
        reported("eq1-fmcw", Partly, &["simulated"]);
    }

    #[test]
    fn a_wall_beyond_the_interval_of_a_phase_is_found_before_it() {
        let beyond = &FOUND.amplitude_beyond;
        assert_relative_eq!(FOUND.phase_wraps, SPEED_OF_LIGHT / 2.0 / 2e6, max_relative = 1e-12);
        assert_relative_eq!(beyond.wall, 42.0 + FOUND.phase_wraps, max_relative = 1e-12);
        is_found_at(beyond, 42.0);
    }

    /// B as the excursion and Δf as the beat has the right dimensions, and makes farther walls nearer.
    #[test]
    fn one_reading_of_the_sweep_grows_with_range() {
        let [near, far] = &FOUND.frequency;
        assert!(far.found.equation > 1.9 * near.found.equation);
        assert_relative_eq!(far.printed, near.printed, max_relative = 1e-9);
        assert!(far.swapped < 0.6 * near.swapped);
    }
}

mod light {
    use super::*;

    const WAVELENGTH: f64 = 905e-9;

    /// The sensor with the energy of class 1, 25 mm of aperture, 0.7 of optics and 23 km of
    /// visibility; lines of the scan counted as repeated exposures or not.
    fn honest(count_lines: bool) -> Design {
        let set = [("safety.count_lines".to_owned(), count_lines.to_string())];
        Design::open("kim-park-2016-physical", &set).unwrap()
    }

    #[test]
    fn a_beam_of_1_mm_spreads_over_more_than_a_pixel() {
        let spread = diffraction(WAVELENGTH, 1e-3);
        assert_relative_eq!(spread, 1.15e-3, max_relative = 3e-3);
        assert_relative_eq!(spread.to_degrees(), 0.066, max_relative = 3e-3);
        assert!(spread.to_degrees() > 43.2 / 848.0);
        assert_relative_eq!(spread * 30.0, 35e-3, max_relative = 0.02);
        assert_relative_eq!(spread * 150.0, 173e-3, max_relative = 3e-3);
        // A Gaussian of 1 mm at 1/e² through 1.1 mm × 1.2 mm.
        let through = |side: f64| libm::erf(2_f64.sqrt() * side);
        assert_relative_eq!(through(1.1) * through(1.2), 0.956, max_relative = 1e-3);
        reported("mirror-size", Holds, &["95.6 %", "10.8"]);
        reported("pitch", Holds, &["0.0509", "0.0506"]);
        reported("wavelength", Fails, &["905 nm"]);
        // Half of the middle is reached at √(ln 2/2) of the way to 1/e².
        let half = spread.to_degrees() * (2_f64.ln() / 2.0).sqrt();
        assert_relative_eq!(half, 0.0389, max_relative = 3e-3);
        assert!(half < 43.2 / 848.0);
        reported("beam", Partly, &["0.87 m", "1.15 mrad", "0.066", "0.039", "35 mm", "173 mm"]);
    }

    #[test]
    fn chips_survive_on_surfaces_square_on_alone() {
        let spot = diffraction(WAVELENGTH, 1e-3) * 150.0;
        let tilt = (DERIVED.tick_range / spot).atan();
        assert_relative_eq!(tilt.to_degrees(), 0.12, max_relative = 0.05);
        assert_relative_eq!(spot_depth(spot, tilt), 0.375e-3, max_relative = 1e-3);
        let chips = spot_depth(spot, PI / 4.0) / DERIVED.tick_range;
        assert_relative_eq!(chips, 461.0, max_relative = 1e-3);
        reported("chips-survive", Assumed, &["0.12", "over 461"]);
    }

    #[test]
    fn class_1_leaves_a_nanojoule_to_a_macropulse() {
        let limits = Class1::at(WAVELENGTH).unwrap();
        let single = limits.single_exposure(DERIVED.macropulse);
        assert_relative_eq!(single, 197.9e-9, max_relative = 1e-3);
        assert_relative_eq!(limits.continuous(), 1.00e-3, max_relative = 3e-3);
        // 198 nJ in every pixel would be 4.8 W.
        assert_relative_eq!(single / DERIVED.pixel_period, 4.8, max_relative = 0.01);
        // 79 pixels cross a pupil of 7 mm at the horizon, in less than the 5 µs that count as one pulse. In
        // the outer lines they stand closer by the cosine of their elevation, up to 12°.
        let strict = honest(true);
        let line = strict.eye_limits().iter().find(|limit| limit.rule == Rule::Group).unwrap();
        assert_relative_eq!(line.shots, 79.0 / 11_f64.to_radians().cos(), max_relative = 0.01);
        assert!(line.duration < 5e-6);
        let energy = |design: &Design| design.budget.as_ref().unwrap().energy;
        // The brightest of them have 7.52 lit bits, the mean macropulse 6.198.
        let expected = single / line.shots * 6.198 / 7.52;
        assert_relative_eq!(energy(&honest(false)), expected, max_relative = 0.02);
        assert_relative_eq!(energy(&strict), 0.4 * expected, max_relative = 0.02);
        reported("eye-safety", Assumed, &["0.82 nJ", "2.06 nJ", "197.9 nJ", "1.00 mW"]);
    }

    #[test]
    fn at_that_energy_150_m_are_out_of_reach() {
        let design = honest(true);
        let budget = design.budget.as_ref().unwrap();
        let day = Environment::default();
        let through_air = Link::of(&design, &day).transmission(150.0).powi(2);
        let photons = budget.photons(budget.energy, 1.0, 150.0) * through_air;
        assert_relative_eq!(photons, 17.76, max_relative = 5e-3);
        let per_mark = photons / DERIVED.marks.1;
        assert_relative_eq!(per_mark, 0.0988, max_relative = 0.01);
        let background = budget.background(day.irradiance(WAVELENGTH).unwrap(), day.albedo)
            * s_from_fs(DESIGN.emission.coding().chip_fs);
        assert_relative_eq!(background, 969.0, max_relative = 2e-3);
        // Instead, white at 150 m is declared to be seen with 0.99 a mark: −ln 0.01 photons.
        assert_relative_eq!(DERIVED.reference_photons, -0.01_f64.ln(), max_relative = 1e-9);
        reported(
            "rated-range",
            Partly,
            &["17.8 photons", "0.10 a micropulse", "969 photons of sunlight"],
        );
        reported("parts", Assumed, &["ideal 400 GHz detector"]);
    }
}

mod others {
    use super::*;

    fn steps(sensor: &str) -> Vec<f64> {
        let design = Design::open(sensor, &[]).unwrap();
        let Pattern::Spinning(head) = design.scan.pattern else { panic!("{sensor} spins") };
        assert_eq!(head.elevations.len(), 64);
        assert_relative_eq!(head.elevations[0].to_degrees(), 2.0, epsilon = 1e-9);
        head.elevations.windows(2).map(|pair| (pair[0] - pair[1]).to_degrees()).collect()
    }

    #[test]
    fn the_hdl_64e_has_two_blocks_and_not_64_equal_steps() {
        let real = steps("hdl-64e");
        assert!(real[..31].iter().all(|step| (step - 1.0 / 3.0).abs() < 1e-6));
        assert!(real[32..].iter().all(|step| (step - 0.5).abs() < 1e-6));
        let bottom = 2.0 - real.iter().sum::<f64>();
        assert!((-24.9..-24.2).contains(&bottom), "{bottom}");
        // An S2 unit at 5 Hz.
        assert_relative_eq!(360.0 * 5.0 / 20_833.0, 0.0864, max_relative = 1e-4);
        reported("hdl-step", Partly, &["0.0864"]);
        reported("hdl-simultaneous", Partly, &["64 lasers"]);
        reported("elevations", Unsaid, &["31 steps of 0.33", "31 of 0.50", "-24.3"]);
        let equal = steps("hdl-64e-equal-spacing");
        assert!(equal.iter().all(|step| (step - 26.8 / 64.0).abs() < 1e-9));
    }
}

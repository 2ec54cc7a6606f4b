//! Whole scan patterns against hand calculations and plain enumeration.

use super::*;
use crate::design::Design;
use approx::assert_relative_eq;

fn open(name: &str, set: &[(&str, &str)]) -> Design {
    let owned = |&(key, value): &(&str, &str)| (key.to_owned(), value.to_owned());
    Design::open(name, &set.iter().map(owned).collect::<Vec<_>>()).unwrap()
}

fn of(design: &Design, count_groups: bool) -> Vec<Limit> {
    let Design { scan, light, emission, .. } = design;
    let class = Class1::at(light.wavelength).unwrap();
    let condition = Condition::bare_eye(0.1);
    let sender = Sender { scan, light, emission, condition, count_groups };
    limits(&class, &exposure(&class, &sender))
}

fn found(limits: &[Limit], rule: Rule) -> Limit {
    *limits.iter().find(|limit| limit.rule == rule).unwrap()
}

/// A line for a beam.
const THIN: [(&str, &str); 2] =
    [("light.beam_diameter_mm", "0.0"), ("light.divergence_mrad", "0.001")];

/// Bits lit in the payload of a column: ten of its number and the rest of its division by
/// x³ + x + 1.
fn lit_bits(column: u32) -> u32 {
    let mut rest = column << 3;
    for bit in (3..13).rev() {
        if rest >> bit & 1 == 1 {
            rest ^= 0b1011 << (bit - 3);
        }
    }
    column.count_ones() + rest.count_ones()
}

/// 79 columns cross the pupil at the horizon, 78 steps of 0.889 mrad being less than 70 mrad, and
/// those from 433 on are the brightest.
#[test]
fn at_the_horizon_the_paper_has_0_83_nanojoules() {
    let sums: Vec<u32> = (0..=848 - 79).map(|c| (c..c + 79).map(lit_bits).sum()).collect();
    let most = *sums.iter().max().unwrap();
    assert_eq!(sums.iter().position(|&sum| sum == most), Some(433));
    assert_relative_eq!(f64::from(most) / 79.0, 7.52, max_relative = 1e-3);
    let mean = f64::from((0..848).map(lit_bits).sum::<u32>()) / 848.0;
    assert_relative_eq!(mean, 6.198, max_relative = 1e-4);
    // All lines of this field cross the pupil, 480 · 600 in 10 s: C5 is 0.4.
    let expected = 0.4 * 7.7e-8 * 10_f64.powf(0.002 * 205.0) * mean / f64::from(most);
    assert_relative_eq!(expected, 0.829e-9, max_relative = 5e-3);

    let flat = [THIN[0], THIN[1], ("scan.raster.vertical_deg", "0.5")];
    let design = open("kim-park-2016-physical", &flat);
    let group = found(&of(&design, true), Rule::Group);
    assert_relative_eq!(group.energy, expected, max_relative = 1e-6);
    assert_relative_eq!(group.shots, 79.0, max_relative = 1e-6);
    assert_relative_eq!(group.brightness, 7.52 / 6.198, max_relative = 1e-3);
    let uncounted = found(&of(&design, false), Rule::Group);
    assert_relative_eq!(uncounted.energy, expected / 0.4, max_relative = 1e-6);
}

/// 12° above the horizon the columns stand closer by its cosine, 0.98, and as much less is allowed.
#[test]
fn the_outer_lines_of_the_paper_leave_a_little_less() {
    let limits = of(&open("kim-park-2016-physical", &[]), true);
    let strict = strictest(&limits).unwrap();
    assert_eq!(strict.rule, Rule::Group);
    assert!(strict.energy < 0.829e-9 && strict.energy > 0.829e-9 * 0.978, "{}", strict.energy);
    assert!(strict.shots > 79.0 && strict.shots < 81.0);
    assert!(strict.duration < 5e-6);
    // 111.5 nJ for the mean is 197.9 for eleven lit bits of thirteen.
    let alone = found(&limits, Rule::SingleShot).energy;
    assert_relative_eq!(alone, 197.9e-9 * 6.198 / 11.0, max_relative = 1e-3);
    // 2.5 ps are held to 38 nJ, which 6.198 · 29 marks share.
    let mark = found(&limits, Rule::Mark).energy;
    assert_relative_eq!(mark, 38e-9 * 6.198 * 29.0, max_relative = 1e-3);
}

/// Every place of the eye at pixels and between them, every run of shots of two scans.
#[test]
fn a_small_raster_by_plain_enumeration() {
    let small = [
        THIN[0],
        THIN[1],
        ("code.label", "none"),
        ("scan.raster.rows", "9"),
        ("scan.raster.columns", "40"),
        ("scan.raster.horizontal_deg", "10.0"),
        ("scan.raster.vertical_deg", "6.0"),
    ];
    for (rate, mirror, duty) in
        [("60.0", "uniform", "1.0"), ("1000.0", "uniform", "0.6"), ("300.0", "sinusoidal", "0.8")]
    {
        let mut set = small.to_vec();
        set.extend([("scan.scans_per_s", rate), ("scan.raster.mirror", mirror)]);
        set.push(("scan.raster.duty", duty));
        let design = open("kim-park-2016-physical", &set);
        let (period, duty) = (1.0 / rate.parse::<f64>().unwrap(), duty.parse::<f64>().unwrap());
        let when = |row: usize, column: usize| {
            let line = match mirror {
                "uniform" => 0.5 - duty / 2.0 + duty * column as f64 / 40.0,
                _ => {
                    let across = if row.is_multiple_of(2) { column } else { 39 - column };
                    let edge = (std::f64::consts::FRAC_PI_2 * duty).sin();
                    0.5 + ((across as f64 / 20.0 - 1.0) * edge).asin() / std::f64::consts::PI
                }
            };
            (row as f64 + line) * period / 9.0
        };
        let c4 = 10_f64.powf(0.41);
        let allowed = |t: f64| match t {
            t if t <= 5e-6 => 7.7e-8 * c4,
            t if t <= 10.0 => 7e-4 * t.powf(0.75) * c4,
            t => 3.9e-4 * c4 * t,
        };
        let angles = |row: f64, column: f64| {
            [10.0 * (0.5 - (column + 0.5) / 40.0), 6.0 * (0.5 - (row + 0.5) / 9.0)]
                .map(f64::to_radians)
        };
        let vector = |[a, e]: [f64; 2]| [e.cos() * a.cos(), e.cos() * a.sin(), e.sin()];
        let (mut group, mut scan, mut average) = (f64::MAX, f64::MAX, f64::MAX);
        for (row, column) in (0..17).flat_map(|row| (0..79).map(move |column| (row, column))) {
            let aim = vector(angles(f64::from(row) / 2.0, f64::from(column) / 2.0));
            let mut times = Vec::new();
            for (row, column) in (0..9).flat_map(|row| (0..40).map(move |column| (row, column))) {
                let beam = vector(angles(row as f64, column as f64));
                let cosine: f64 = (0..3).map(|axis| aim[axis] * beam[axis]).sum();
                if cosine.acos().tan() <= 0.035 {
                    times.push(when(row, column));
                }
            }
            times.sort_by(f64::total_cmp);
            let shots = times.len();
            times.extend(times.clone().iter().map(|time| time + period));
            let shot = design.derived().macropulse;
            let (mut groups, mut until) = (0, f64::MIN);
            for &time in &times[..shots] {
                if time >= until {
                    (groups, until) = (groups + 1, time + 5e-6);
                }
            }
            let repeated = f64::from(groups) * 10.0 / period;
            let c5 = if repeated > 600.0 { (5.0 * repeated.powf(-0.25)).max(0.4) } else { 1.0 };
            for first in 0..shots {
                for last in first..first + shots {
                    let lasts = times[last] + shot - times[first];
                    let each = allowed(lasts) / (last - first + 1) as f64;
                    if lasts <= 5e-6 {
                        group = group.min(each * c5);
                    } else {
                        scan = scan.min(each);
                    }
                }
            }
            average = average.min(3.9e-4 * c4 * period / shots as f64);
        }
        let limits = of(&design, true);
        let case = (rate, mirror);
        let ours = found(&limits, Rule::Group).energy;
        assert!(ours <= group * (1.0 + 1e-9) && ours > 0.95 * group, "{case:?}: {ours}");
        // Between these places one may have a pixel or two more.
        let ours = found(&limits, Rule::Average).energy;
        assert!(ours <= average * (1.0 + 1e-9) && ours > 0.95 * average, "{case:?}: {ours}");
        let ours = found(&limits, Rule::Scan).energy;
        assert!(ours <= 1.01 * scan && ours > 0.95 * scan, "{case:?}: {ours}, not {scan}");
    }
}

/// The 4.01° of the pupil hold 13 lasers 1/3° apart, and 50 steps of 0.08°. With its corners cut off and
/// columns closer below the horizon, about 480 shots cross it in 2.2 ms. Together they may have
/// 7e-4·(2.2 ms)^0.75·2.57 = 18 µJ, 38 nJ each. Without the thin ends of the circle it is 6 % less: nine
/// tenths of the shots come in four fifths of the time. Lasers fire 1.39 µs apart, so 4 of them count as one.
/// A step crosses with 10 lasers on average, in 2.8 such groups. In 50 steps and the 50 scans of 10 s there
/// are 7000 groups. C5 is 0.547, and each shot may have 0.547 · 197.9 / 4 = 27 nJ.
#[test]
fn a_turning_head_with_32_lasers() {
    let lasers = "[{ lasers = 32, first_deg = 2.0, step_deg = -0.3333333333333333 }]";
    let head = [("scan.spinning.blocks", lasers), ("tdc.converters", "32")];
    let design = open("hdl-64e", &head);
    let limits = of(&design, true);
    let strict = strictest(&limits).unwrap();
    assert_eq!((strict.rule, strict.shots), (Rule::Group, 4.0));
    assert_relative_eq!(strict.energy, 27e-9, max_relative = 0.03);
    let scan = found(&limits, Rule::Scan);
    assert_relative_eq!(scan.energy, 0.94 * 38e-9, max_relative = 0.03);
    let average = found(&limits, Rule::Average);
    assert_relative_eq!(average.shots / 500.0, 480.0, max_relative = 0.03);
    assert_relative_eq!(found(&limits, Rule::SingleShot).energy, 197.9e-9, max_relative = 1e-3);

    // Together they are one exposure of 13 lasers.
    let together = [head[0], head[1], ("scan.spinning.firing", "together")];
    let strict = *strictest(&of(&open("hdl-64e", &together), true)).unwrap();
    assert_eq!((strict.rule, strict.shots), (Rule::Group, 13.0));
    // 51 of them in a scan, 2550 in 10 s: C5 is 0.704.
    assert_relative_eq!(strict.energy, 0.704 * 197.9e-9 / 13.0, max_relative = 0.01);
}

/// The flash floods 30° × 7.5°, 0.0685 sr, which are 6.85 cm² at 100 mm. The 0.385 cm² of the pupil
/// see 0.0562 of it, the light of 230 of its 4096 pixels. It comes 300 times in 10 s: C5 is 1.
#[test]
fn a_flash_floods_its_field() {
    let limits = of(&open("peregrine", &[("light.wavelength_nm", "905.0")]), true);
    let alone = found(&limits, Rule::SingleShot);
    assert_relative_eq!(alone.energy, 197.9e-9 / 230.2, max_relative = 2e-3);
    assert_eq!(found(&limits, Rule::Group).energy, alone.energy);
    let average = found(&limits, Rule::Average).energy;
    assert_relative_eq!(average, 1.002e-3 / 30.0 / 230.2, max_relative = 2e-3);
    assert_eq!(strictest(&limits).unwrap().energy, alone.energy);

    // A narrow one passes the pupil whole.
    let narrow = [
        ("light.wavelength_nm", "905.0"),
        ("scan.flash.horizontal_deg", "0.5"),
        ("scan.flash.vertical_deg", "0.5"),
    ];
    let limits = of(&open("peregrine", &narrow), true);
    let alone = found(&limits, Rule::SingleShot);
    assert_relative_eq!(alone.energy, 197.9e-9 / 4096.0, max_relative = 1e-3);
}

/// A field within the pupil is as good as a beam that stands still.
#[test]
fn a_narrow_field_is_a_beam_that_stands_still() {
    let mut last = f64::MAX;
    for degrees in ["20.0", "6.0", "2.0", "0.2", "0.001"] {
        let narrow =
            [("scan.raster.horizontal_deg", degrees), ("scan.raster.vertical_deg", degrees)];
        let design = open("kim-park-2016-physical", &narrow);
        let limits = of(&design, true);
        let energy = strictest(&limits).unwrap().energy;
        assert!(energy <= last * (1.0 + 1e-9) && energy <= 197.9e-9, "{degrees}: {energy}");
        last = energy;
    }
    // 1.002 mW for 40.95 ns.
    assert_relative_eq!(last, 1.002e-3 / (60.0 * 407_040.0), max_relative = 2e-3);
}

/// 10 mW through 3.5 mm at 100 mm, 39.4 by 39.6 pixels at the horizon less the corners: 136.4 nJ, and
/// a little less towards the edge, however wide the beam.
#[test]
fn at_1550_nm_the_mean_power_holds_and_a_wide_beam_changes_nothing() {
    let wide = strictest(&of(&open("coded-practical", &[]), true)).copied().unwrap();
    let thin = strictest(&of(&open("coded-practical", &THIN), true)).copied().unwrap();
    for limit in [wide, thin] {
        assert!([Rule::Repeated, Rule::Average].contains(&limit.rule), "{limit:?}");
        assert!(limit.energy < 136.4e-9 && limit.energy > 136.4e-9 * 0.97, "{limit:?}");
    }
    // Sharp beams come and go at the rim of the aperture, some 40 around 1200.
    assert_relative_eq!(wide.energy, thin.energy, max_relative = 0.03);
}

#[test]
fn at_1450_nm_a_millisecond_counts_as_one() {
    let limits = of(&open("coded-practical", &[("light.wavelength_nm", "1450.0")]), true);
    let group = found(&limits, Rule::Group);
    assert!(group.duration <= 1e-3);
    assert_relative_eq!(group.energy, 8e-4 / group.shots, max_relative = 1e-9);
}

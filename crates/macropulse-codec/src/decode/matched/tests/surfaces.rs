//! Several surfaces of a shot.

use super::*;
use crate::decode::Pick;

fn several(sensor: &Sensor, jitter: f64) -> Receiver {
    let correlation = Correlation { false_alarm: 1e-4, ..sensor.correlation(jitter) };
    Receiver { returns: 2, ..sensor.set_to(Effort::Quick, correlation) }
}

#[test]
fn two_surfaces_are_two_returns_in_clear_air_and_in_poor_light() {
    // N = 1000. With jitter a mark counts in any of three ticks, and light of others lies in one place of
    // five. Chance then gives nearly the number of marks that a shot with few lit bits has.
    let weathers = [((0, 0, 0), 0.0, 0.97), ((20, 4, 0), 0.0, 0.97), ((20, 4, 15), 0.3, 0.65)];
    let sensor = Sensor::crowded(codebook());
    let log = sensor.log(1000);
    for ((missed, false_ticks, late), jitter, least) in weathers {
        let weather = Weather { missed, false_ticks, late, ..CLEAR };
        let (ticks, surfaces) = sensor.behind_glass(&log, 1, weather, 1);
        let receiver = several(&sensor, jitter);
        let found = sensor.decode(&receiver, &log, &ticks);
        let panes = surfaces.iter().filter(|lags| lags.len() == 2).count() as f64;
        let seconds = found.number.iter().filter(|&&number| number == 2).count() as f64;
        assert!(seconds > least * panes, "{seconds} of {panes}, {missed} %, jitter {jitter}");
        // Word 1 is nearly the same twelve chips on: with a few of its marks missed the two are alike.
        let lag = |tof: f64| tof / 2.5e-12 - 0.5 - f64::from(late) / 100.0;
        let is_off = |&(&shot, &tof): &(&u32, &f64)| {
            let mut lags = surfaces[shot as usize].iter();
            lags.all(|&expected| (lag(tof) - f64::from(expected)).abs() > 0.5)
        };
        let off = found.shot.iter().zip(&found.tof).filter(is_off).count();
        assert!(off < 50, "{off} of {}, {missed} % missed", found.len());
        let one = sensor.decode(&Receiver { returns: 1, ..receiver.clone() }, &log, &ticks);
        assert!(one.number.iter().all(|&number| number == 1) && one.len() as f64 > 0.97 * panes);
        let last = Receiver { returns: 1, pick: Pick::Last, ..receiver.clone() };
        let last = sensor.decode(&last, &log, &ticks);
        let behind = |(&shot, &tof): (&u32, &f64)| {
            surfaces[shot as usize]
                .get(1)
                .is_some_and(|&second| lag(tof) > f64::from(second) - 100.0)
        };
        let behind = last.shot.iter().zip(&last.tof).filter(|found| behind(*found)).count() as f64;
        assert!(behind > least * panes, "{behind} of {panes}");
    }
}

/// One shot in seven behind glass, in clear air, between shots that are settled together.
#[test]
fn returns_come_in_the_order_of_shots_and_their_surfaces() {
    let sensor = Sensor::crowded(codebook());
    let log = ShotLog { owned: 10..390, ..sensor.log(400) };
    let (ticks, surfaces) = sensor.behind_glass(&log, 7, CLEAR, 1);
    let found = sensor.decode(&several(&sensor, 0.0), &log, &ticks);
    let each = |shot: u32| (1..=surfaces[shot as usize].len() as u8).map(move |n| (shot, n));
    let expected: Vec<(u32, u8)> = (10..390).flat_map(each).collect();
    assert!(found.shot.iter().copied().zip(found.number.iter().copied()).eq(expected));
    let lag = |tof: f64| (tof / 2.5e-12 - 0.5).round() as u32;
    let lags = surfaces[10..390].iter().flatten().copied();
    assert!(found.tof.iter().map(|tof| lag(*tof)).eq(lags));
    let weights = found.shot.iter().map(|&shot| {
        sensor.book.marks(log.label[shot as usize], log.word[shot as usize]).len() as u16
    });
    assert!(found.marks.iter().copied().eq(weights) && found.peak == found.marks);
}

/// H₀: a shot that met one surface has a second return with probability α = 10⁻⁴ at most, the false alarm
/// accepted. N = 24 000 shots each in clear air, with 30 % of the marks missed in stray light, and with
/// jitter; seeds 1 to 6. It is rejected if a count this high has a chance below 10⁻³. Negative control: one
/// shot in 500 with a second surface is noticed.
#[test]
fn one_surface_is_one_return() {
    let poor = Weather { missed: 30, false_ticks: 5, ..CLEAR };
    let jittery = Weather { missed: 10, false_ticks: 2, late: 20, ..CLEAR };
    let sensor = Sensor::crowded(codebook());
    let log = sensor.log(4000);
    for (weather, jitter) in [(CLEAR, 0.0), (poor, 0.0), (jittery, 0.3)] {
        let count = |panes: usize| -> (usize, usize) {
            let each = (1..=6).map(|seed| {
                let (ticks, _) = sensor.behind_glass(&log, panes, weather, seed);
                sensor.decode(&several(&sensor, jitter), &log, &ticks)
            });
            each.fold((0, 0), |(shots, seconds), found| {
                let more = found.number.iter().filter(|&&number| number > 1).count();
                (shots + found.len() - more, seconds + more)
            })
        };
        let is_rejected = |(shots, seconds): (usize, usize)| {
            crate::statistics::binomial_tail(shots, 1e-4, seconds) < 1e-3
        };
        let alone = count(0);
        assert!(alone.0 > 23_000, "{alone:?}");
        assert!(!is_rejected(alone), "{alone:?}");
        assert!(is_rejected(count(500)));
    }
}

//! Returns beside the surfaces that their shots met.
#![allow(missing_docs, clippy::unwrap_used)]

use macropulse::channel::Operating;
use macropulse::codec::decode::Returns;
use macropulse::design::Design;
use macropulse::emit::short_bands;
use macropulse::points::{Outcome, Piece, Scale};
use macropulse::scene::{Hits, Scene, Traced};
use macropulse::score::{self, Score};
use macropulse::units::tof_from_range;

/// `hits` with one surface more for each shot, at a `range` after that of its last one, m.
fn with_one_more(hits: &Hits, range: impl Fn(f64) -> f64) -> Hits {
    let mut more = Hits::default();
    for i in 0..hits.shot.len() {
        let is_last = hits.shot.get(i + 1) != Some(&hits.shot[i]);
        let one_more = is_last.then(|| range(hits.range[i]));
        for range in std::iter::once(hits.range[i]).chain(one_more) {
            more.shot.push(hits.shot[i]);
            more.weight.push(hits.weight[i]);
            more.range.push(range);
            more.cosine.push(hits.cosine[i]);
            more.material.push(hits.material[i]);
            more.object.push(hits.object[i]);
        }
    }
    more
}

/// A return of nearly every shot that met something, and of a few that did not: right, near, wrong, and
/// now and then a second one.
fn returns(hits: &Hits, owned: std::ops::Range<usize>) -> Returns {
    let mut returns = Returns::default();
    for shot in owned {
        let met = hits.shot.iter().position(|of| *of as usize == shot);
        let range = met.map_or(20.0, |i| hits.range[i]);
        let offsets: &[f64] = match (met, shot % 17) {
            (None, 0) => &[0.0],
            (None, _) | (_, 1) => &[],
            (_, 2) => &[0.1],
            (_, 3) => &[-5.0],
            (_, 4) => &[0.0, 4.0],
            _ => &[0.0004],
        };
        for (number, offset) in (1..).zip(offsets) {
            returns.shot.push(shot as u32);
            returns.number.push(number);
            returns.tof.push(tof_from_range(range + offset));
            returns.peak.push(100 + shot as u16 % 7 * u16::from(number));
            returns.marks.push(174);
            returns.margin.push(50);
            returns.photons.push(1.0);
            returns.saturated.push(false);
        }
    }
    returns
}

/// A shot with one surface and one return is judged as one with several surfaces is, all but one of them out
/// of reach. Negative control: one more within reach changes how returns come out.
#[test]
fn one_surface_is_judged_as_several_are() {
    let design = Design::open("kim-park-2016", &[]).unwrap();
    let scene = Scene::open("car-30m").unwrap();
    let scale = Scale::of(&design, &Operating::of(&design, &scene.environment).unwrap());
    let (mut all, mut different) = (Score::default(), 0);
    for band in short_bands(&design, 0).skip(60).step_by(8) {
        let log = band.shot_log(&design);
        let hits = scene.trace(&design, &log).middle;
        let returns = returns(&hits, log.owned.clone());
        let judged = |hits: &Hits| {
            let mut piece = Piece::of(&design, &scale, &log, &returns);
            let traced = Traced { middle: hits.clone(), sub_macropulses: Vec::new() };
            let score = score::judge(&mut piece, &design, &scene, &log, &traced);
            // Ranges of nothing are not equal to themselves.
            (score, format!("{:?}", piece.points.truth))
        };
        let one = judged(&hits);
        assert_eq!(one, judged(&with_one_more(&hits, |_| 1e4)));
        different += u32::from(one != judged(&with_one_more(&hits, |range| range - 5.0)));
        all.add(&one.0);
    }
    let edge = Outcome::Edge as usize;
    assert!(all.pixels[..edge].iter().all(|pixels| *pixels > 50), "{all:?}");
    assert_eq!(all.pixels[edge], 0, "the mirror stands still");
    assert!(all.points_on_target > 50 && different > 10, "{all:?}, {different} different");
}

/// Returns the outcomes of the pixel beside a plate and of the pixel after it. Each shot of a line answers
/// from the plate, 30 m ahead. The plate ends this number of `reaches` beside the middle of the first of the
/// two pixels. A reach is how far from the middle of a macropulse its outermost part is sent: 7/16 of what
/// the mirror moves during it. A wall may stand `behind`.
fn beside_a_plate(reaches: f64, behind: &str) -> [Outcome; 2] {
    let footprint = ("without".to_owned(), "footprint".to_owned());
    let design = Design::open("coded-practical", &[footprint]).unwrap();
    let band = short_bands(&design, 0).find(|band| band.first / 848 == 240).unwrap();
    let log = band.shot_log(&design);
    let directions = design.directions();
    let azimuth = |shot: usize| {
        let [x, y, _] = directions.of_shot(&log, shot);
        y.atan2(x)
    };
    let shot = log.owned.clone().find(|shot| log.column[*shot] == 424).unwrap();
    let apart = (log.fired_at_fs[shot + 1] - log.fired_at_fs[shot]) as f64 * 1e-15;
    let reach =
        7.0 / 16.0 * design.derived().macropulse / apart * (azimuth(shot) - azimuth(shot + 1));
    let edge = 30.0 * (azimuth(shot) + reaches * reach).tan();
    let text = format!(
        "version = 1\n[[object]]\nshape = {{ box = {{ size_m = [1e-6, 4.0, 20.0] }} }}\n\
         position_m = [30.0, {}, 0.0]\nmaterial = \"white\"\n{behind}",
        edge + 2.0
    );
    let scene = Scene::from_toml(&text, "plate", std::path::Path::new("")).unwrap();
    let traced = scene.trace(&design, &log);
    let mut returns = Returns::default();
    for shot in log.owned.clone() {
        let [x, ..] = directions.of_shot(&log, shot);
        returns.shot.push(shot as u32);
        returns.number.push(1);
        returns.tof.push(tof_from_range(30.0 / x));
        returns.peak.push(8);
        returns.marks.push(8);
        returns.margin.push(8);
        returns.photons.push(1.0);
        returns.saturated.push(false);
    }
    let scale = Scale::of(&design, &Operating::of(&design, &scene.environment).unwrap());
    let mut piece = Piece::of(&design, &scale, &log, &returns);
    score::judge(&mut piece, &design, &scene, &log, &traced);
    let at = shot - log.owned.start;
    assert_eq!(piece.points.truth.returns.outcome[at - 1], Outcome::Right);
    [0, 1].map(|pixel| piece.points.truth.returns.outcome[at + pixel])
}

/// Negative controls: a plate just out of reach, and the pixel after, whose shot has met nothing, or
/// the wall alone.
#[test]
fn a_surface_that_a_part_of_the_macropulse_met_is_an_edge() {
    assert_eq!(beside_a_plate(0.95, ""), [Outcome::Edge, Outcome::False]);
    assert_eq!(beside_a_plate(1.05, ""), [Outcome::False, Outcome::False]);
    let wall = "[[object]]\nshape = { box = { size_m = [1.0, 200.0, 200.0] } }\n\
                position_m = [60.0, 0.0, 0.0]\nmaterial = \"white\"\n";
    assert_eq!(beside_a_plate(0.95, wall), [Outcome::Edge, Outcome::Wrong]);
    assert_eq!(beside_a_plate(1.05, wall), [Outcome::Wrong, Outcome::Wrong]);
}

//! Returns beside the surfaces that their shots met.
#![allow(missing_docs, clippy::unwrap_used)]

use macropulse::channel::Operating;
use macropulse::codec::decode::Returns;
use macropulse::design::Design;
use macropulse::emit::short_bands;
use macropulse::points::{Piece, Scale};
use macropulse::scene::{Hits, Scene};
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

/// A shot with one surface and one return is judged as one with several is, of which all but one are
/// out of reach. Negative control: one more within reach changes how returns come out.
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
            let score = score::judge(&mut piece, &design, &scene, &log, hits);
            // Ranges of nothing are not equal to themselves.
            (score, format!("{:?}", piece.points.truth))
        };
        let one = judged(&hits);
        assert_eq!(one, judged(&with_one_more(&hits, |_| 1e4)));
        different += u32::from(one != judged(&with_one_more(&hits, |range| range - 5.0)));
        all.add(&one.0);
    }
    assert!(all.pixels.iter().all(|pixels| *pixels > 50), "{all:?}");
    assert!(all.points_on_target > 50 && different > 10, "{all:?}, {different} different");
}

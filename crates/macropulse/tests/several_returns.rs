//! Several returns of a shot: a pane before a wall.
#![allow(clippy::unwrap_used)]

use macropulse::design::Design;
use macropulse::emit::{Band, bands};
use macropulse::points::{Outcome, Pick, PointCloud};
use macropulse::scene::Scene;
use macropulse::sim::{self, Scan};
use std::path::Path;

/// Forward of the sensor, m.
const WALL: f64 = 60.0;
const PANE: f64 = 59.0;

/// A wall and, 1 m before it, a pane of the library's glass, both square to the x axis.
fn scene(with_pane: bool) -> Scene {
    let plane = |name: &str, material: &str, x: f64| {
        format!(
            "[[object]]\nname = {name:?}\nmaterial = {material:?}\nposition_m = [{x}, 0, 0]\n\
             shape.plane.normal = [-1, 0, 0]\n"
        )
    };
    let mut text = format!("version = 1\n{}", plane("wall", "grey10", WALL));
    if with_pane {
        text += &plane("pane", "glass", PANE);
    }
    Scene::from_toml(&text, "pane", Path::new("")).unwrap()
}

fn design(sensor: &str, keys: &[(&str, &str)]) -> Design {
    let keys: Vec<(String, String)> =
        keys.iter().map(|&(key, value)| (key.to_owned(), value.to_owned())).collect();
    Design::open(sensor, &keys).unwrap()
}

/// Bands in the middle of a scan, about 20 000 pixels.
fn measure(design: &Design, scene: &Scene) -> Scan {
    let part: Vec<Band> = bands(design, 0).skip(110).take(12).collect();
    sim::scan_part(design, scene, 5, &part).unwrap()
}

/// The range at which each of the returns of a cloud should be, by the distance of its surface.
fn expected(design: &Design, cloud: &PointCloud, at: usize, distance: f64) -> f64 {
    distance / design.directions().of(cloud.row[at], cloud.column[at])[0]
}

/// Returns true if a return lies so far aside that the pane does not mirror the light back. There the pane
/// has its diffuse reflectance of 0.02, and the wall, through it, 0.1 · 0.8².
fn is_aside(cloud: &PointCloud, at: usize) -> bool {
    cloud.y[at].abs() > 0.2 * cloud.x[at]
}

#[test]
fn glass_before_a_wall_gives_two_returns() {
    let design = design("kim-park-2016-fixed", &[("receiver.returns", "2")]);
    let scan = measure(&design, &scene(true));
    let (cloud, shots) = (&scan.cloud(), scan.tally.shots);
    let is_at = |at: usize, distance: f64| {
        let error = f64::from(cloud.range[at]) - expected(&design, cloud, at, distance);
        error.abs() <= design.right_within
    };
    let is_whole =
        |&at: &usize| cloud.number_of_returns[at] == 2 && is_at(at, PANE) && is_at(at + 1, WALL);
    let firsts = (0..cloud.returns()).filter(|&at| cloud.return_number[at] == 1);
    let whole: Vec<usize> = firsts.filter(is_whole).collect();
    assert!(whole.len() as f64 > 0.95 * shots as f64, "{} of {shots}", whole.len());
    // Each has an intensity and a truth of its own.
    let aside: Vec<usize> = whole.iter().copied().filter(|&at| is_aside(cloud, at)).collect();
    let mean = |offset: usize| {
        let sum: f64 = aside.iter().map(|&at| f64::from(cloud.intensity[at + offset])).sum();
        sum / aside.len() as f64
    };
    let (pane, wall) = (mean(0), mean(1));
    assert!((0.015..0.03).contains(&pane), "{pane}");
    assert!((0.055..0.07).contains(&wall), "{wall}");
    let names = |at: usize| {
        let object = usize::from(cloud.truth.returns.object[at]);
        scene(true).objects[object].name.clone()
    };
    assert_eq!([names(whole[0]), names(whole[0] + 1)], ["pane", "wall"]);
    // The score counts pixels once, by the stronger return, and the second ones beside.
    assert_eq!(scan.score.pixels.iter().sum::<u64>(), shots);
    assert_eq!(scan.score.further.iter().sum::<u64>(), scan.tally.by_number[1]);
    assert!(scan.score.count_further(Outcome::Right) as f64 > 0.95 * shots as f64);
    let image = |pick: Pick| cloud.image(pick).spread(&cloud.range, 0.0);
    let (first, last) = (image(Pick::First), image(Pick::Last));
    let apart = first.iter().zip(&last).filter(|(first, last)| *last - *first > 0.99);
    assert!(apart.count() as f64 > 0.95 * shots as f64);
    assert_eq!(image(Pick::Strongest), image(cloud.pick));
}

#[test]
fn one_return_is_one_return_at_the_surface_that_is_picked() {
    for (pick, distance) in [("first", PANE), ("strongest", WALL), ("last", WALL)] {
        let design = design("kim-park-2016-fixed", &[("receiver.pick", pick)]);
        let scan = measure(&design, &scene(true));
        let cloud = &scan.cloud();
        assert!(cloud.number_of_returns.iter().all(|&number| number == 1), "{pick}");
        assert_eq!(cloud.returns() as u64, scan.tally.by_number[0]);
        let aside = (0..cloud.returns()).filter(|&at| is_aside(cloud, at));
        let right = aside.clone().filter(|&at| {
            let error = f64::from(cloud.range[at]) - expected(&design, cloud, at, distance);
            error.abs() <= design.right_within
        });
        let (right, aside) = (right.count(), aside.count());
        assert!(aside > 5000 && right as f64 > 0.95 * aside as f64, "{pick}: {right} of {aside}");
    }
}

/// H₀: a shot that met one surface has a second return with probability 10⁻⁶, the false alarm of the sensor;
/// N > 20 000, seed 5. The chance of two or more is below 10⁻³. Negative control: the pane of the tests
/// above.
#[test]
fn a_wall_alone_has_no_second_return() {
    let design = design("kim-park-2016-fixed", &[("receiver.returns", "4")]);
    let scan = measure(&design, &scene(false));
    assert!(scan.tally.returns > 20_000, "{:?}", scan.tally);
    assert!(scan.tally.by_number[1] <= 1, "{:?}", scan.tally);
}

#[test]
fn a_receiver_that_gives_one_return_refuses_more() {
    let refused = |sensor: &str, keys: &[(&str, &str)]| {
        let keys: Vec<(String, String)> =
            keys.iter().map(|&(key, value)| (key.to_owned(), value.to_owned())).collect();
        Design::open(sensor, &keys).unwrap_err().to_string()
    };
    let two = ("receiver.returns", "2");
    for kind in ["literal", "blind"] {
        let sentence = refused("kim-park-2016-fixed", &[("receiver.kind", kind), two]);
        assert!(sentence.contains("receiver.returns"), "{sentence}");
        let one = format!("receiver.kind = \"{kind}\" gives one return per shot: leave it at 1");
        assert!(sentence.contains(&one), "{sentence}");
    }
    let sentence = refused("hdl-64e", &[two]);
    assert!(sentence.contains("detector.single-stop gives one event per shot"), "{sentence}");
    let sentence = refused("hdl-64e", &[("receiver.pick", "last")]);
    assert!(sentence.contains("receiver.pick") && sentence.contains("no effect"), "{sentence}");
    let sentence = refused("kim-park-2016", &[("receiver.returns", "5")]);
    assert!(sentence.contains("finds 4 returns of a shot at most"), "{sentence}");
    for wrong in ["0", "9"] {
        let sentence = refused("kim-park-2016", &[("receiver.returns", wrong)]);
        assert!(sentence.contains("must lie between 1 and 8"), "{sentence}");
    }
    let sentence = refused("kim-park-2016", &[("receiver.pick", "nearest")]);
    assert!(sentence.contains("unknown value `nearest`"), "{sentence}");
}

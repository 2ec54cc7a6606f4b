//! A packet against its rays one by one, at every level.

use super::packet::{NONE, Packet, Waiting};
use super::triangles::{Corners, Hit, Triangles};
use super::wide::LANES;
use macropulse_codec::level::forced::at_each_level;
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Triangles with whole coordinates, so that edges, corners and planes are often met exactly.
fn soup(chance: &mut ChaCha8Rng, count: usize) -> Vec<Corners> {
    let corner =
        |chance: &mut ChaCha8Rng| [0; 3].map(|_| f64::from(chance.random_range(-6..7_i32)));
    (0..count).map(|_| [0; 3].map(|_| corner(chance))).collect()
}

fn direction(chance: &mut ChaCha8Rng, kind: u32, aim: [f64; 3], origin: [f64; 3]) -> [f64; 3] {
    let any = [0; 3].map(|_| chance.random_range(-1.0..1.0_f64));
    let wanted = match kind {
        0 => any,
        1 => [0, 1, 2].map(|axis| aim[axis] - origin[axis] + 0.2 * any[axis]),
        2 => [0, 1, 2].map(|axis| aim[axis] - origin[axis]),
        3 => {
            let mut along = [0.0, -0.0, 0.0];
            along[chance.random_range(0..3_usize)] = any[0].signum();
            along
        }
        _ => [f64::NAN, 0.0, f64::INFINITY],
    };
    let length = wanted.iter().map(|slope| slope * slope).sum::<f64>().sqrt();
    if length == 0.0 { wanted } else { wanted.map(|slope| slope / length) }
}

proptest! {
    #[test]
    fn each_ray_meets_what_it_would_have_met_alone(
        seed in 0..u64::MAX,
        count in 0..120_usize,
        coherent in proptest::bool::ANY,
        from_corner in proptest::bool::ANY,
        nearest in prop_oneof![Just(0.0), 0.0..8.0_f64],
        farthest in prop_oneof![Just(f64::INFINITY), 1.0..20.0_f64, Just(f64::NAN)],
    ) {
        let mut chance = ChaCha8Rng::seed_from_u64(seed);
        let corners = soup(&mut chance, count);
        let centre = [0; 3].map(|_| chance.random_range(-5.0..5.0_f64));
        let (triangles, _) = Triangles::new(corners.clone(), centre);
        let mut origin = [centre, [0; 3].map(|_| chance.random_range(-9.0..9.0))][seed as usize % 2];
        let mut aim = [1.0, 2.0, 3.0];
        if let Some(corner) = corners.first().filter(|_| from_corner) {
            origin = corner[0];
        }
        if let Some(corner) = corners.last() {
            aim = corner[1];
        }
        let mut packet = Packet::from(origin);
        for lane in 0..LANES {
            let kind = if coherent { 1 } else { chance.random_range(0..5) };
            packet.set(lane, direction(&mut chance, kind, aim, origin), farthest);
            packet.nearest[lane] = nearest;
        }
        for (level, cast) in at_each_level(|| {
            let mut cast = packet.clone();
            cast.cast(&triangles, &mut Waiting::default());
            cast
        }) {
            for lane in 0..LANES {
                let ray = (origin, packet.along(lane));
                let alone = triangles.nearest(ray, (nearest, farthest));
                let (range, leaf) = (cast.range[lane], cast.leaf[lane]);
                let together = (leaf != NONE).then_some(Hit { range, leaf });
                prop_assert_eq!(together, alone, "{:?}, ray {}: {:?}", level, lane, ray);
            }
        }
    }
}

/// The control of the test above: it does meet triangles, and some exactly on an edge.
#[test]
fn the_soup_is_thick() {
    let mut chance = ChaCha8Rng::seed_from_u64(7);
    let corners = soup(&mut chance, 100);
    let (triangles, _) = Triangles::new(corners.clone(), [0.0; 3]);
    let mut packet = Packet::from([0.0; 3]);
    for lane in 0..LANES {
        let toward = direction(&mut chance, 2, corners[lane][0], [0.0; 3]);
        packet.set(lane, toward, f64::INFINITY);
    }
    packet.cast(&triangles, &mut Waiting::default());
    assert!(packet.leaf.iter().filter(|leaf| **leaf != NONE).count() > LANES / 2);
}

proptest! {
    /// Neighbours, which descend as a beam, and rays alone against a search of all triangles.
    #[test]
    fn neighbours_meet_the_nearest_of_all_triangles(
        seed in 0..u64::MAX,
        count in 1..120_usize,
        spread in prop_oneof![Just(0.0), 0.0..0.03_f64, 0.0..0.5_f64],
        from_centre in proptest::bool::ANY,
    ) {
        let mut chance = ChaCha8Rng::seed_from_u64(seed);
        let corners = soup(&mut chance, count);
        let centre = [0; 3].map(|_| chance.random_range(-5.0..5.0_f64));
        let origin = if from_centre { centre } else { corners[0][0] };
        let aim = corners[count / 2][1];
        let mut packet = Packet::from(origin);
        for lane in 0..LANES {
            let aside = [0; 3].map(|_| chance.random_range(-1.0..=1.0) * spread);
            let toward = [0, 1, 2].map(|axis| aim[axis] + aside[axis]);
            packet.set(lane, direction(&mut chance, 2, toward, origin), f64::INFINITY);
        }
        let ones: Vec<Triangles> =
            corners.iter().map(|one| Triangles::new(vec![*one], centre).0).collect();
        let (triangles, _) = Triangles::new(corners.clone(), centre);
        let nearest = |lane: usize| {
            let hits = ones.iter().filter_map(|one| {
                one.nearest((origin, packet.along(lane)), (0.0, f64::INFINITY))
            });
            hits.map(|hit| hit.range).fold(f64::INFINITY, f64::min)
        };
        let nearest: Vec<f64> = (0..LANES).map(nearest).collect();
        for (level, cast) in at_each_level(|| {
            let mut cast = packet.clone();
            cast.cast(&triangles, &mut Waiting::default());
            cast
        }) {
            prop_assert_eq!(&cast.range[..], &nearest[..], "{:?}", level);
        }
    }
}

/// A ray lies in the plane of a triangle and only touches it, at a corner √33 m away. It meets the triangle
/// there or not at all, and no nearer: a triangle before it is still met first.
#[test]
fn a_triangle_seen_edge_on_is_met_where_it_is() {
    let (origin, corner) = ([2.0, 4.0, -4.0], [4.0, 2.0, 1.0]);
    let edge_on = [[-1.0, -2.0, -5.0], corner, [3.0, -6.0, 5.0]];
    let before = [[0.0, 5.0, 5.0], [5.0, 5.0, -6.0], [-4.0, -1.0, -6.0]];
    let far = 33.0_f64.sqrt();
    let toward = [0, 1, 2].map(|axis| (corner[axis] - origin[axis]) / far);
    let mut packet = Packet::from(origin);
    (0..LANES).for_each(|lane| packet.set(lane, toward, f64::INFINITY));
    for centre in [[0.0; 3], origin, [-0.919_474_606_377_013_6, -3.790_429_229_934_757, 1.68]] {
        let ranges = |corners: Vec<Corners>| {
            let (triangles, _) = Triangles::new(corners, centre);
            let alone = triangles.nearest((origin, toward), (0.0, f64::INFINITY));
            let mut packet = packet.clone();
            packet.cast(&triangles, &mut Waiting::default());
            let alone = alone.map_or(f64::INFINITY, |hit| hit.range);
            assert!(packet.range.iter().all(|range| *range == alone), "{:?}", packet.range);
            alone
        };
        let touched = ranges(vec![edge_on]);
        assert!(touched.is_infinite() || (touched - far).abs() < 1e-6, "{touched}, not {far}");
        let nearer = ranges(vec![before]);
        assert!(nearer < 0.5 && ranges(vec![edge_on, before]) == nearer);
    }
}

//! Packets against single rays, meshes kept once against meshes laid out.

use super::super::closed_form::Shape;
use super::super::motion::Motion;
use super::super::pose::Pose;
use super::super::raycast::Facet;
use super::*;
use crate::kernels::Corners;
use crate::units::FS_PER_S;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A closed mesh of 4·`rows`² triangles about the origin, 4 m long.
fn egg(rows: u32) -> Vec<Corners> {
    let point = |row: u32, column: u32| {
        let polar = std::f64::consts::PI * f64::from(row) / f64::from(rows);
        let around = std::f64::consts::PI * f64::from(column % (2 * rows)) / f64::from(rows);
        let ring = if row == 0 || row == rows { 0.0 } else { polar.sin() };
        [2.0 * ring * around.cos(), ring * around.sin(), polar.cos()]
    };
    let cell = |row: u32, column: u32| {
        let (a, b) = (point(row, column), point(row, column + 1));
        let (c, d) = (point(row + 1, column + 1), point(row + 1, column));
        [[a, b, c], [a, c, d]]
    };
    (0..rows).flat_map(|row| (0..2 * rows).flat_map(move |column| cell(row, column))).collect()
}

fn poses(chance: &mut ChaCha8Rng, count: usize) -> Vec<Pose> {
    let pose = |_| {
        let position = [0; 3].map(|_| chance.random_range(-40.0..40.0));
        Pose::turned(position, [3.0, 1.0, 1.0].map(|most: f64| chance.random_range(-most..most)))
    };
    (0..count).map(pose).collect()
}

/// The same eggs, kept once or laid out; with a shape of each kind.
fn worlds(poses: &[Pose]) -> [World; 2] {
    let mesh = egg(20);
    let facet = |corners: Corners, object| Facet { corners, material: 1, object };
    let solids = || {
        let solid = |shape, at, object| Solid::new(shape, Pose::at(at), 0, object);
        let turned = |shape, at| {
            let pose = Pose::turned(at, [0.7, -0.5, 1.9]);
            Solid::new(shape, pose, 0, 2)
        };
        vec![
            solid(Shape::Plane { normal: [0.0, 0.0, 1.0] }, [0.0, 0.0, -50.0], 0),
            solid(Shape::Box { half: [3.0, 2.0, 1.0] }, [20.0, 0.0, 0.0], 1),
            solid(Shape::Sphere { radius: 2.0 }, [-15.0, 10.0, 0.0], 2),
            turned(Shape::Frustum { radii: [2.0, 0.5], half: 1.5 }, [9.0, 12.0, -3.0]),
            turned(Shape::Frustum { radii: [1.5, 1.5], half: 2.0 }, [-12.0, -9.0, 3.0]),
            turned(Shape::Capsule { radius: 1.0, half: 2.5 }, [3.0, -13.0, 4.0]),
            turned(Shape::Ellipsoid { half: [3.0, 1.0, 2.0] }, [-4.0, 2.0, 14.0]),
        ]
    };
    let model = mesh.iter().map(|corners| facet(*corners, 0)).collect();
    let mut copies = vec![];
    let mut flat = Loose::default();
    for (index, pose) in poses.iter().enumerate() {
        let (to_world, object) = (pose.world_from_sensor(), 3 + index as u16);
        copies.push(Copy { model: 0, to_world, object });
        let laid = |corners: &Corners| facet(corners.map(|corner| to_world.point(corner)), object);
        flat.extend(mesh.iter().map(laid));
    }
    let models = vec![Facets::new(model, [0.0; 3])];
    [
        World::new(Loose::default(), (models, &copies), solids(), [0.0; 3]),
        World::new(flat, (vec![], &[]), solids(), [0.0; 3]),
    ]
}

fn packet(chance: &mut ChaCha8Rng, origin: [f64; 3], spread: f64) -> Packet {
    let mut packet = Packet::from(origin);
    let middle = [0; 3].map(|_| chance.random_range(-1.0..1.0_f64));
    for lane in 0..LANES {
        let aim = DVec3::from(middle.map(|slope| slope + chance.random_range(-spread..spread)));
        packet.set(lane, aim.normalize().to_array(), 1e3);
    }
    packet
}

#[test]
fn a_packet_meets_what_its_rays_meet_alone() {
    let mut chance = ChaCha8Rng::seed_from_u64(11);
    let (mut packet_hits, mut hits) = (PacketHits::default(), 0);
    for world in worlds(&poses(&mut chance, 30)) {
        for round in 0..2000 {
            let origin = [0; 3].map(|_| f64::from(round % 2) * chance.random_range(-9.0..9.0));
            let spread = if round % 3 == 0 { 1.0 } else { 0.02 };
            let mut packet = packet(&mut chance, origin, spread);
            packet.nearest = [f64::from(round % 5); LANES];
            let nearest = packet.nearest[0];
            world.cast_packet(&mut packet, &mut packet_hits);
            world.describe(&packet, &mut packet_hits);
            for lane in 0..LANES {
                let ray = Ray { origin, direction: packet.along(lane) };
                let alone = world.cast(&ray, nearest, 1e3);
                assert_eq!(packet_hits.is_hit(&packet, lane), alone.is_some());
                let Some(hit) = alone else { continue };
                hits += 1;
                assert_eq!(packet.range[lane], hit.range);
                let cosine = DVec3::from(ray.direction).dot(DVec3::from(hit.normal)).abs();
                assert_eq!(packet_hits.cosine[lane], cosine.min(1.0) as f32);
                assert_eq!(
                    (packet_hits.material[lane], packet_hits.object[lane]),
                    (hit.material, hit.object)
                );
            }
        }
    }
    assert!(hits > 30_000, "{hits}");
}

/// The same for what moves: each ray of a packet meets it at a time of its own.
#[test]
fn a_packet_meets_movers_at_the_times_of_its_rays() {
    let mut chance = ChaCha8Rng::seed_from_u64(14);
    let [still, _] = worlds(&poses(&mut chance, 30));
    let facet = |corners: &Corners| Facet { corners: *corners, material: 4, object: 0 };
    let facets = egg(20).iter().map(facet).collect();
    let model = std::sync::Arc::new(Facets::new(facets, [0.0; 3]));
    let poses = poses(&mut chance, 20);
    let motion = |pose: &Pose| Motion::steady(*pose, [9.0, -5.0, 2.0], 3.0);
    let mover = |(object, pose): (u16, &Pose)| {
        Mover::mesh((std::sync::Arc::clone(&model), 2.0), object, motion(pose))
    };
    let world = still.with((40..).zip(&poses).map(mover).collect());
    let (mut packet_hits, mut moving, mut moved) = (PacketHits::default(), 0, 0);
    for round in 0..4000 {
        let origin = [0; 3].map(|_| f64::from(round % 2) * chance.random_range(-9.0..9.0));
        let mut packet = packet(&mut chance, origin, 0.3);
        let time_fs: Lanes<i64> = [0; LANES].map(|_| chance.random_range(0..FS_PER_S));
        world.cast_packet_at(&mut packet, &time_fs, &mut packet_hits);
        world.describe(&packet, &mut packet_hits);
        for (lane, &time_fs) in time_fs.iter().enumerate() {
            let ray = Ray { origin, direction: packet.along(lane) };
            let alone = world.cast_at(&ray, time_fs, (0.0, 1e3));
            assert_eq!(packet_hits.is_hit(&packet, lane), alone.is_some());
            let Some(hit) = alone else { continue };
            assert_eq!(packet.range[lane], hit.range);
            assert_eq!(
                (packet_hits.material[lane], packet_hits.object[lane]),
                (hit.material, hit.object)
            );
            let cosine = DVec3::from(ray.direction).dot(DVec3::from(hit.normal)).abs();
            assert!((packet_hits.cosine[lane] - cosine as f32).abs() < 1e-6);
            moving += usize::from(hit.object >= 40);
            moved += usize::from(world.cast(&ray, 0.0, 1e3) != alone);
        }
    }
    assert!(moving > 500 && moved > 500, "{moving} {moved}");
}

#[test]
fn a_mesh_kept_once_is_met_where_its_copies_stand() {
    let mut chance = ChaCha8Rng::seed_from_u64(12);
    let poses = poses(&mut chance, 30);
    let [kept_once, laid_out] = worlds(&poses);
    assert_eq!(kept_once.triangles(), laid_out.triangles());
    let mut on_copies = 0;
    for round in 0..100_000 {
        let beside = DVec3::from([0; 3].map(|_| chance.random_range(-2.0..2.0)));
        let aim = DVec3::from(poses[round % 30].position) + beside;
        let direction = aim.normalize().to_array();
        let ray = Ray { origin: [0.0; 3], direction };
        let [once, flat] = [&kept_once, &laid_out].map(|world| world.cast(&ray, 0.0, 1e3));
        let (Some(once), Some(flat)) = (once, flat) else {
            assert_eq!(once, flat);
            continue;
        };
        on_copies += usize::from(once.object > 2);
        assert!((once.range - flat.range).abs() < 1e-6, "{once:?} {flat:?}");
        assert_eq!((once.material, once.object), (flat.material, flat.object));
    }
    assert!(on_copies > 10_000, "{on_copies}");
}

#[test]
fn no_ray_leaks_out_of_a_mesh_that_is_kept_once() {
    let place = Pose::turned([100.0, -50.0, 3.0], [1.0, 0.3, -0.2]);
    let [world, _] = worlds(&[place, Pose::at([0.0, 0.0, 300.0])]);
    let mut chance = ChaCha8Rng::seed_from_u64(13);
    let mut packet_hits = PacketHits::default();
    for _ in 0..20_000 {
        let mut packet = packet(&mut chance, place.position, 1.0);
        world.cast_packet(&mut packet, &mut packet_hits);
        assert!((0..LANES).all(|lane| packet.range[lane] < 2.1));
    }
}

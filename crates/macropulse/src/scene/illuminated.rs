//! Surfaces that an interfering lidar illuminates and the sensor sees.
//!
//! 1. Each ray of each of its shots ends on the first surface it meets, of glass or not.
//! 2. The point is kept if the sensor looks there and both stand on the same side of the surface.
//! 3. A ray from the aperture to the point must meet nothing before it.
//!
//! Both lidars and everything else are where they are when the shot is fired. Both ways together take a
//! microsecond or two, in which a car moves by a tenth of a millimetre.

use glam::DVec3;

use super::rig::{Ends, Pair};
use super::trace::Footprint;
use super::world::PacketHits;
use super::{Ray, Scene};
use crate::kernels::{LANES, Lanes, Packet};
use macropulse_codec::ShotLog;

/// A ray to a point ends this much before it, m: the surface does not hide itself.
const BEFORE: f64 = 1e-3;

/// Gives the pixel, by row and column, that receives light of a shot of the interferer from a
/// direction after a path length, m; `None` if no pixel does.
pub type LineOfSight<'a> = dyn Fn(usize, [f64; 3], f64) -> Option<(u16, u16)> + 'a;

/// Surfaces that an interfering lidar illuminates and the sensor sees, as columns; ordered by shot,
/// then by ray. Truth: never handed to the receiver.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Illuminated {
    /// Index of the shot in the interferer's log.
    pub shot: Vec<u32>,
    /// Which ray of its footprint, from 0.
    pub ray: Vec<u32>,
    /// The ray's share of the energy.
    pub weight: Vec<f32>,
    /// Distance from the interferer to the point, m.
    pub there: Vec<f64>,
    /// Distance from the point to the sensor, m.
    pub back: Vec<f64>,
    /// Cosine of the angle between the normal and the way back, 0…1.
    pub cosine: Vec<f32>,
    /// Cosine of the angle between the normal and the middle of both ways, 0…1.
    pub half_cosine: Vec<f32>,
    /// Index into `Scene::materials`.
    pub material: Vec<u16>,
    /// Row and column of the pixel in whose cell the sensor sees it.
    pub pixel: Vec<(u16, u16)>,
}

impl Scene {
    /// The surfaces that the shots in `log`, fired by one lidar of a `pair`, illuminate and the other one, the
    /// sensor, sees. Neither the way there nor the way back is followed farther than `farthest`, m.
    ///
    /// `line_of_sight` takes the number of the shot, the unit vector from the sensor to the point in the
    /// frame of the sensor, and the length of both ways together, m. It returns the pixel that looks there at
    /// that time, if there is one.
    pub fn illuminated(
        &self,
        pair: Pair<'_>,
        log: &ShotLog,
        farthest: f64,
        line_of_sight: &LineOfSight,
    ) -> Illuminated {
        let footprint = Footprint::of(pair.from.design);
        let directions = pair.from.design.directions();
        let mut light = Light::new(self, pair, farthest, line_of_sight);
        for shot in 0..log.len() {
            let begin = directions.origin(log.row[shot], log.column[shot]);
            light.leave_at(log.fired_at_fs[shot], begin);
            let mut ray = 0;
            footprint.rays(directions.of_shot(log, shot), |aim, weight| {
                light.add((shot as u32, ray, weight), aim);
                ray += 1;
            });
        }
        light.finish()
    }

    /// Returns true if nothing stands on `ray`, given in the world, between its origin and a point `distance`
    /// metres away at `time_fs`.
    pub fn sees(&self, ray: &Ray, distance: f64, time_fs: i64) -> bool {
        self.cast_at(ray, time_fs, (0.0, distance - BEFORE)).is_none()
    }
}

/// Rays of an interferer that are being cast, and the illuminated points found so far.
struct Light<'a> {
    scene: &'a Scene,
    pair: Pair<'a>,
    farthest: f64,
    line_of_sight: &'a LineOfSight<'a>,
    /// Time at which rays that are added now leave, fs.
    now_fs: i64,
    /// Poses of both lidars then.
    ends: Ends,
    /// Place at which rays that are added now begin, in the frame of the interferer, m.
    begin: [f64; 3],
    packet: Packet,
    packet_hits: PacketHits,
    count: usize,
    time_fs: Lanes<i64>,
    /// Shot, ray and weight of each.
    from: Lanes<(u32, u32, f32)>,
    /// Points looked at, and in which direction of the world they lie: whether something hides
    /// them is still to be asked.
    waiting: Vec<(Point, DVec3)>,
    seen: Illuminated,
}

/// A line of [`Illuminated`].
struct Point {
    time_fs: i64,
    from: (u32, u32, f32),
    ways: (f64, f64),
    cosines: (f64, f64),
    material: u16,
    pixel: (u16, u16),
}

impl<'a> Light<'a> {
    fn new(
        scene: &'a Scene,
        pair: Pair<'a>,
        farthest: f64,
        line_of_sight: &'a LineOfSight,
    ) -> Self {
        let ends = pair.at(0);
        Self {
            scene,
            pair,
            farthest,
            line_of_sight,
            now_fs: 0,
            ends,
            begin: [0.0; 3],
            packet: Packet::from(ends.from.position),
            packet_hits: PacketHits::default(),
            count: 0,
            time_fs: [0; LANES],
            from: [(0, 0, 0.0); LANES],
            waiting: Vec::with_capacity(2 * LANES),
            seen: Illuminated::default(),
        }
    }

    /// The rays that are added from now on leave at `time_fs`, and begin at this place in the frame of the
    /// interferer. If either lidar moves, rays travel with those of their own time alone.
    fn leave_at(&mut self, time_fs: i64, begin: [f64; 3]) {
        let moved = self.pair.moves() && time_fs != self.now_fs;
        self.now_fs = time_fs;
        if !moved && begin == self.begin {
            return;
        }
        self.cast();
        if moved {
            self.keep_all_visible();
            self.ends = self.pair.at(time_fs);
        }
        self.begin = begin;
        self.packet.origin = self.ends.from.to_world.point(begin);
    }

    /// Adds a ray, given in the frame of the interferer.
    fn add(&mut self, from: (u32, u32, f32), aim: [f64; 3]) {
        self.from[self.count] = from;
        self.time_fs[self.count] = self.now_fs;
        let direction = self.ends.from.to_world.direction(aim);
        self.packet.set(self.count, direction, self.farthest);
        self.count += 1;
        if self.count == LANES {
            self.cast();
        }
    }

    fn finish(mut self) -> Illuminated {
        self.cast();
        self.keep_all_visible();
        self.seen
    }

    /// Casts the rays that have gathered.
    fn cast(&mut self) {
        if self.count == 0 {
            return;
        }
        self.packet.range[self.count..].fill(f64::NAN);
        let world = &self.scene.world;
        world.cast_packet_at(&mut self.packet, &self.time_fs, &mut self.packet_hits);
        let normals = world.describe(&self.packet, &mut self.packet_hits);
        let normal = |lane: usize| DVec3::from(normals.map(|axis| axis[lane]));
        for lane in 0..self.count {
            if self.packet_hits.is_hit(&self.packet, lane) {
                self.waiting.extend(self.point(lane, normal(lane)));
            }
        }
        self.count = 0;
        while self.waiting.len() >= LANES {
            self.keep_visible();
        }
    }

    /// The point that a ray has met, if the sensor may see it.
    fn point(&self, lane: usize, normal: DVec3) -> Option<(Point, DVec3)> {
        let along = DVec3::from(self.packet.along(lane));
        let there = self.packet.range[lane];
        let place = DVec3::from(self.packet.origin) + along * there;
        let way = place - DVec3::from(self.ends.to.position);
        let back = way.length();
        if !(BEFORE..=self.farthest).contains(&back) {
            return None;
        }
        let (view, normal) = (way / back, normal.normalize_or_zero());
        let (into, out) = (normal.dot(along), normal.dot(view));
        if into * out <= 0.0 {
            return None;
        }
        let from = self.from[lane];
        let direction = self.ends.to.from_world.direction(view.to_array());
        let pixel = (self.line_of_sight)(from.0 as usize, direction, there + back)?;
        let half = (along + view).normalize_or_zero().dot(normal).abs();
        let (ways, cosines) = ((there, back), (out.abs(), half));
        let material = self.packet_hits.material[lane];
        let time_fs = self.time_fs[lane];
        Some((Point { time_fs, from, ways, cosines, material, pixel }, view))
    }

    /// Keeps all waiting points that nothing hides.
    fn keep_all_visible(&mut self) {
        while !self.waiting.is_empty() {
            self.keep_visible();
        }
    }

    /// Casts a packet of rays from the sensor to waiting points, and keeps those that nothing hides.
    fn keep_visible(&mut self) {
        let (mut packet, mut time_fs) = (Packet::from(self.ends.to.position), [0; LANES]);
        let count = self.waiting.len().min(LANES);
        for (lane, (point, view)) in self.waiting[..count].iter().enumerate() {
            packet.set(lane, view.to_array(), point.ways.1 - BEFORE);
            time_fs[lane] = point.time_fs;
        }
        self.scene.world.cast_packet_at(&mut packet, &time_fs, &mut self.packet_hits);
        let seen = &mut self.seen;
        for (lane, (point, _)) in self.waiting.drain(..count).enumerate() {
            if self.packet_hits.is_hit(&packet, lane) {
                continue;
            }
            let (shot, ray, weight) = point.from;
            seen.shot.push(shot);
            seen.ray.push(ray);
            seen.weight.push(weight);
            seen.there.push(point.ways.0);
            seen.back.push(point.ways.1);
            seen.cosine.push(point.cosines.0 as f32);
            seen.half_cosine.push(point.cosines.1 as f32);
            seen.material.push(point.material);
            seen.pixel.push(point.pixel);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::design::Design;
    use std::path::Path;

    /// A wall 10 m ahead; `more` stands in the file behind it.
    fn scene(position: &str, more: &str) -> Scene {
        let text = format!(
            "version = 1\n\
             [[object]]\nname = \"wall\"\nshape = {{ plane = {{ normal = [-1, 0, 0] }} }}\n\
             position_m = [10, 0, 0]\nmaterial = \"white\"\n\
             [[interferers]]\nsensor = \"peregrine\"\nposition_m = {position}\n{more}"
        );
        Scene::from_toml(&text, "test", Path::new("")).unwrap()
    }

    fn illuminated(scene: &Scene) -> Illuminated {
        let ours = Design::open("peregrine", &[]).unwrap();
        let rig = scene.rig(&ours);
        let pair = Pair { from: rig.mounts[1], to: rig.mounts[0] };
        let log = pair.from.begins.shots(pair.from.design, 0..1).next().unwrap();
        scene.illuminated(pair, &log, 100.0, &|_, direction, _| ours.scan.pixel_at(direction))
    }

    /// Known answer: a ray at direction (x, y, z) from 4 m to the left of us meets the wall 10 m
    /// ahead after 10/x.
    #[test]
    fn points_on_a_wall_are_where_geometry_has_them() {
        let scene = scene("[0, 4, 0]", "");
        let illuminated = illuminated(&scene);
        let interferer = &scene.interferers[0].design;
        // Moved by 4 m, a quarter of its field, which is 5.4 m wide there, lies in ours.
        assert!((800..3000).contains(&illuminated.shot.len()), "{}", illuminated.shot.len());
        for i in 0..illuminated.shot.len() {
            let (row, column) = (illuminated.shot[i] / 128, illuminated.shot[i] % 128);
            let [x, y, z] = interferer.directions().of(row as u16, column as u16);
            let point = DVec3::new(10.0, 4.0 + y * 10.0 / x, z * 10.0 / x);
            assert!((illuminated.there[i] - 10.0 / x).abs() < 1e-9);
            assert!((illuminated.back[i] - point.length()).abs() < 1e-9);
            assert!((f64::from(illuminated.cosine[i]) - 10.0 / point.length()).abs() < 1e-6);
            let half = (DVec3::new(x, y, z) + point.normalize()).normalize().x;
            assert!((f64::from(illuminated.half_cosine[i]) - half).abs() < 1e-6);
            assert!(point.y.abs() <= 10.0 * 15_f64.to_radians().tan() + 1e-9);
        }
    }

    /// Known answer: a second after the start the wall is 13 m ahead, the interferer at (1, 2, 0.5) with no yaw
    /// left, and the sensor at (-1, 0, 0).
    #[test]
    fn what_moves_is_lit_and_seen_where_it_is_when_the_shot_is_fired() {
        let text = "version = 1\n\
             [[object]]\nshape = { plane = { normal = [-1, 0, 0] } }\nmaterial = \"white\"\n\
             position_m = [10, 0, 0]\nvelocity_m_s = [3, 0, 0]\n\
             [sensor]\nvelocity_m_s = [-1, 0, 0]\n\
             [[interferers]]\nsensor = \"peregrine\"\nposition_m = [0, 4, 0]\nphase_ns = 1e9\n\
             velocity_m_s = [1, -2, 0.5]\nyaw_deg = 10\npitch_deg = 5\nroll_deg = 20\n\
             turn_rate_deg_s = -10\n";
        let scene = Scene::from_toml(text, "test", Path::new("")).unwrap();
        let ours = Design::open("peregrine", &[]).unwrap();
        let rig = scene.rig(&ours);
        let pair = Pair { from: rig.mounts[1], to: rig.mounts[0] };
        let second = crate::units::FS_PER_S;
        let log = pair.from.begins.shots(pair.from.design, second..second + 1).next().unwrap();
        let look = |_, direction, _| ours.scan.pixel_at(direction);
        let illuminated = scene.illuminated(pair, &log, 100.0, &look);
        assert!(illuminated.shot.len() > 500, "{}", illuminated.shot.len());
        let turned = glam::DMat3::from_rotation_y(5_f64.to_radians())
            * glam::DMat3::from_rotation_x(20_f64.to_radians());
        for i in 0..illuminated.shot.len() {
            let shot = illuminated.shot[i] as usize;
            let along = turned * DVec3::from(pair.from.design.directions().of_shot(&log, shot));
            let there = 12.0 / along.x;
            let point = DVec3::new(1.0, 2.0, 0.5) + there * along;
            let back = point - DVec3::new(-1.0, 0.0, 0.0);
            assert!((illuminated.there[i] - there).abs() < 1e-9);
            assert!((illuminated.back[i] - back.length()).abs() < 1e-9);
            assert!((f64::from(illuminated.cosine[i]) - 14.0 / back.length()).abs() < 1e-6);
            let pixel = ours.scan.pixel_at(back.normalize().to_array());
            assert_eq!(pixel, Some(illuminated.pixel[i]));
        }
    }

    #[test]
    fn what_is_hidden_or_lit_from_behind_is_not_seen() {
        assert!(illuminated(&scene("[0, 0, 0]", "")).shot.len() == 4096);
        // Something small between the wall and us alone.
        let pole = "[[object]]\nname = \"pole\"\nshape = { box = { size_m = [0.1, 20, 20] } }\n\
                    position_m = [2, 0, 0]\nmaterial = \"white\"\n";
        assert_eq!(illuminated(&scene("[4, 0, 0]", pole)).shot.len(), 0);
        // From behind the wall, looking at us, it shines on the far side.
        assert_eq!(illuminated(&scene("[20, 0, 0]\nyaw_deg = 180", "")).shot.len(), 0);
        // It looks the other way, at nothing.
        assert_eq!(illuminated(&scene("[0, 0, 0]\nyaw_deg = 180", "")).shot.len(), 0);
    }

    #[test]
    fn a_ray_to_the_aperture_needs_a_clear_view() {
        let ahead = Ray { origin: [0.0; 3], direction: [1.0, 0.0, 0.0] };
        let scene = scene("[4, 0, 0]", "");
        assert!(scene.sees(&ahead, 10.0, 0) && !scene.sees(&ahead, 10.1, 0));
    }
}

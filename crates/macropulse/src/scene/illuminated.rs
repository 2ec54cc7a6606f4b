//! Surfaces that an interfering lidar illuminates and the sensor sees.
//!
//! 1. Each ray of each of its shots ends on the first surface it meets, of glass or not.
//! 2. The point is kept if the sensor looks there and both stand on the same side of the surface.
//! 3. A ray from the aperture to the point must meet nothing before it.
//!
//! Nothing of a scene with other lidars moves: it is refused where it is read.

use glam::DVec3;

use super::trace::Footprint;
use super::world::PacketHits;
use super::{Interferer, Scene, Transform};
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
    /// The surfaces that the shots in `log`, fired by `interferer`, illuminate and the sensor
    /// sees. Neither the way there nor the way back is followed farther than `farthest`, m.
    ///
    /// `line_of_sight` is given the number of the shot, the unit vector from the sensor to the
    /// point in the frame of the sensor, and the length of both ways together, m; it gives the
    /// pixel that looks there at that time, if there is one.
    pub fn illuminated(
        &self,
        interferer: &Interferer,
        log: &ShotLog,
        farthest: f64,
        line_of_sight: &LineOfSight,
    ) -> Illuminated {
        let footprint = Footprint::of(&interferer.design);
        let (directions, to_world) =
            (interferer.design.directions(), interferer.pose.world_from_sensor());
        let mut light = Light::new((self, interferer), farthest, line_of_sight);
        for shot in 0..log.len() {
            let axis = directions.of(log.row[shot], log.column[shot]);
            let mut ray = 0;
            footprint.rays(axis, |aim, weight| {
                light.add((shot as u32, ray, weight), to_world.direction(aim));
                ray += 1;
            });
        }
        light.finish()
    }

    /// Whether nothing stands between the sensor and a point `distance` metres away in the
    /// direction of the unit vector `direction`, given in the world.
    pub fn sees(&self, direction: [f64; 3], distance: f64) -> bool {
        let ray = super::Ray { origin: self.sensor.at_start().position, direction };
        self.cast(&ray, 0.0, distance - BEFORE).is_none()
    }
}

/// Rays of an interferer that are being cast, and the illuminated points found so far.
struct Light<'a> {
    scene: &'a Scene,
    to_sensor: Transform,
    farthest: f64,
    line_of_sight: &'a LineOfSight<'a>,
    packet: Packet,
    packet_hits: PacketHits,
    count: usize,
    /// Shot, ray and weight of each.
    from: Lanes<(u32, u32, f32)>,
    /// Points looked at, and in which direction of the world they lie: whether something hides
    /// them is still to be asked.
    waiting: Vec<(Point, DVec3)>,
    seen: Illuminated,
}

/// A line of [`Illuminated`].
struct Point {
    from: (u32, u32, f32),
    ways: (f64, f64),
    cosines: (f64, f64),
    material: u16,
    pixel: (u16, u16),
}

impl<'a> Light<'a> {
    fn new(
        (scene, interferer): (&'a Scene, &Interferer),
        farthest: f64,
        line_of_sight: &'a LineOfSight,
    ) -> Self {
        Self {
            scene,
            to_sensor: scene.sensor.at_start().sensor_from_world(),
            farthest,
            line_of_sight,
            packet: Packet::from(interferer.pose.position),
            packet_hits: PacketHits::default(),
            count: 0,
            from: [(0, 0, 0.0); LANES],
            waiting: Vec::with_capacity(2 * LANES),
            seen: Illuminated::default(),
        }
    }

    /// Adds a ray, given in the world.
    fn add(&mut self, from: (u32, u32, f32), direction: [f64; 3]) {
        self.from[self.count] = from;
        self.packet.set(self.count, direction, self.farthest);
        self.count += 1;
        if self.count == LANES {
            self.cast();
        }
    }

    fn finish(mut self) -> Illuminated {
        self.cast();
        while !self.waiting.is_empty() {
            self.keep_visible();
        }
        self.seen
    }

    /// Casts the rays that have gathered.
    fn cast(&mut self) {
        self.packet.range[self.count..].fill(f64::NAN);
        let world = &self.scene.world;
        world.cast_packet(&mut self.packet, &mut self.packet_hits);
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
        let way = place - DVec3::from(self.scene.sensor.at_start().position);
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
        let direction = self.to_sensor.direction(view.to_array());
        let pixel = (self.line_of_sight)(from.0 as usize, direction, there + back)?;
        let half = (along + view).normalize_or_zero().dot(normal).abs();
        let (ways, cosines) = ((there, back), (out.abs(), half));
        let material = self.packet_hits.material[lane];
        Some((Point { from, ways, cosines, material, pixel }, view))
    }

    /// Casts a packet of rays from the sensor to waiting points, and keeps those that nothing hides.
    fn keep_visible(&mut self) {
        let mut packet = Packet::from(self.scene.sensor.at_start().position);
        let count = self.waiting.len().min(LANES);
        for (lane, (point, view)) in self.waiting[..count].iter().enumerate() {
            packet.set(lane, view.to_array(), point.ways.1 - BEFORE);
        }
        self.scene.world.cast_packet(&mut packet, &mut self.packet_hits);
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
        let interferer = &scene.interferers[0];
        let log = interferer.clock.shots(&interferer.design, 0..1).next().unwrap();
        scene.illuminated(interferer, &log, 100.0, &|_, direction, _| ours.scan.pixel_at(direction))
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
        let scene = scene("[4, 0, 0]", "");
        assert!(scene.sees([1.0, 0.0, 0.0], 10.0) && !scene.sees([1.0, 0.0, 0.0], 10.1));
    }
}

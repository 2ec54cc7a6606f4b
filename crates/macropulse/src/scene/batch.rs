//! Rays gathered into packets, and followed through glass.

use super::pose::{Pose, Transform};
use super::world::PacketHits;
use super::{Hits, Scene};
use crate::kernels::{LANES, Lanes, Packet, turned};

/// Panes a ray is followed through, with what it ends on.
const PANES: usize = 6;

/// A ray goes on this far behind the pane it has met, m.
const BEHIND: f64 = 1e-4;

/// Light weaker than this fraction of the shot is not followed further.
const FAINTEST: f32 = 1e-4;

/// Rays of consecutive shots on their way into the scene, and what the ones before have met.
pub(super) struct Batch<'a> {
    scene: &'a Scene,
    /// Transmission of each material, one way.
    through: Vec<f32>,
    farthest: f64,
    sensor_moves: bool,
    /// Time at which rays that are added now leave, fs.
    now_fs: i64,
    /// Place at which they begin, in the frame of the sensor, m.
    begin: [f64; 3],
    pose: Pose,
    world_from_sensor: Transform,
    /// In the frame of the sensor, by axis.
    aims: [Lanes<f64>; 3],
    packet: Packet,
    packet_hits: PacketHits,
    /// Rays in the packet.
    count: usize,
    shot: Lanes<u32>,
    weight: Lanes<f32>,
    time_fs: Lanes<i64>,
    /// Surfaces met by the packet, where some are of glass.
    layers: Vec<Surface>,
    hits: Hits,
}

/// A surface that one ray of the packet has met.
#[derive(Clone, Copy)]
struct Surface {
    lane: usize,
    transmitted: f32,
    range: f64,
    cosine: f32,
    material: u16,
    object: u16,
}

impl<'a> Batch<'a> {
    /// No rays yet, that are to be followed to `farthest`.
    pub(super) fn new(scene: &'a Scene, farthest: f64) -> Self {
        let pose = scene.sensor.at_start();
        Self {
            scene,
            through: scene.materials.iter().map(|known| known.transmission as f32).collect(),
            farthest,
            sensor_moves: scene.sensor.moves(),
            now_fs: 0,
            begin: [0.0; 3],
            pose,
            world_from_sensor: pose.world_from_sensor(),
            aims: [[0.0; LANES]; 3],
            packet: Packet::from(pose.position),
            packet_hits: PacketHits::default(),
            count: 0,
            shot: [0; LANES],
            weight: [0.0; LANES],
            time_fs: [0; LANES],
            layers: Vec::new(),
            hits: Hits::default(),
        }
    }

    /// The rays that are added from now on leave at `time_fs`. Those of a sensor that moves have a
    /// place of their own then, and travel in packets of their own.
    #[inline(always)]
    pub(super) fn leave_at(&mut self, time_fs: i64) {
        if self.sensor_moves && time_fs != self.now_fs {
            if self.count > 0 {
                self.flush();
            }
            self.pose = self.scene.sensor.at(time_fs);
            self.world_from_sensor = self.pose.world_from_sensor();
            self.packet.origin = self.pose.position;
            self.begin = [0.0; 3];
        }
        self.now_fs = time_fs;
    }

    /// The rays that are added from now on begin here, given in the frame of the sensor.
    #[inline(always)]
    pub(super) fn begin_at(&mut self, begin: [f64; 3]) {
        if begin != self.begin {
            if self.count > 0 {
                self.flush();
            }
            self.begin = begin;
            let beside = self.world_from_sensor.direction(begin);
            self.packet.origin = [0, 1, 2].map(|axis| self.pose.position[axis] + beside[axis]);
        }
    }

    /// Adds a ray, given in the frame of the sensor.
    #[inline(always)]
    pub(super) fn add(&mut self, shot: u32, weight: f32, [x, y, z]: [f64; 3]) {
        let lane = self.count % LANES;
        self.aims[0][lane] = x;
        self.aims[1][lane] = y;
        self.aims[2][lane] = z;
        self.shot[lane] = shot;
        self.weight[lane] = weight;
        self.time_fs[lane] = self.now_fs;
        self.count += 1;
        if self.count == LANES {
            self.flush();
        }
    }

    /// Returns the hits of all rays.
    pub(super) fn finish(mut self) -> Hits {
        self.flush();
        self.hits
    }

    /// Casts the rays that have gathered and writes down what they meet.
    fn flush(&mut self) {
        self.packet.direction = turned(self.world_from_sensor.rotation(), &self.aims);
        self.packet.nearest = [0.0; LANES];
        self.packet.range = [self.farthest; LANES];
        self.packet.range[self.count..].fill(f64::NAN);
        self.count = 0;
        self.scene.world.cast_packet_at(&mut self.packet, &self.time_fs, &mut self.packet_hits);
        let Self { packet, packet_hits, .. } = self;
        let mut hit = [0; LANES];
        let mut count = 0;
        for lane in 0..LANES {
            hit[count] = lane;
            count += usize::from(packet_hits.is_hit(packet, lane));
        }
        let hit = &hit[..count];
        if hit.is_empty() {
            return;
        }
        self.scene.world.describe(packet, packet_hits);
        if hit.iter().any(|lane| self.through[usize::from(packet_hits.material[*lane])] > 0.0) {
            self.follow();
        } else {
            self.write_first(hit);
        }
    }

    /// Writes what the rays of the lanes in `hit` have met first.
    fn write_first(&mut self, hit: &[usize]) {
        let Self { packet, packet_hits, hits, .. } = self;
        keep(&mut hits.shot, hit, &self.shot);
        keep(&mut hits.weight, hit, &self.weight);
        keep(&mut hits.range, hit, &packet.range);
        keep(&mut hits.cosine, hit, &packet_hits.cosine);
        keep(&mut hits.material, hit, &packet_hits.material);
        keep(&mut hits.object, hit, &packet_hits.object);
    }

    /// Sends the rays that have met glass on, until none is left, and writes what all have met.
    fn follow(&mut self) {
        let Self { packet, packet_hits, layers, .. } = self;
        let mut transmitted = [1.0_f32; LANES];
        layers.clear();
        for pane in 0..PANES {
            let mut goes_on = false;
            for (lane, transmitted) in transmitted.iter_mut().enumerate() {
                if !packet_hits.is_hit(packet, lane) {
                    packet.range[lane] = f64::NAN;
                    continue;
                }
                let (range, material) = (packet.range[lane], packet_hits.material[lane]);
                layers.push(Surface {
                    lane,
                    transmitted: *transmitted,
                    range,
                    cosine: packet_hits.cosine[lane],
                    material,
                    object: packet_hits.object[lane],
                });
                let through = self.through[usize::from(material)];
                *transmitted *= through * through;
                let bright = *transmitted >= FAINTEST;
                packet.nearest[lane] = range + BEHIND;
                packet.range[lane] = if bright { self.farthest } else { f64::NAN };
                goes_on |= bright;
            }
            if !goes_on || pane + 1 == PANES {
                break;
            }
            self.scene.world.cast_packet_at(packet, &self.time_fs, packet_hits);
            self.scene.world.describe(packet, packet_hits);
        }
        // Stable: the surfaces of a ray stay in their order.
        layers.sort_by_key(|surface| surface.lane);
        for Surface { lane, transmitted, range, cosine, material, object } in layers.drain(..) {
            self.hits.shot.push(self.shot[lane]);
            self.hits.weight.push(self.weight[lane] * transmitted);
            self.hits.range.push(range);
            self.hits.cosine.push(cosine);
            self.hits.material.push(material);
            self.hits.object.push(object);
        }
    }
}

/// Adds the values of some lanes to a column.
#[inline(always)]
fn keep<T: Copy>(column: &mut Vec<T>, lanes: &[usize], values: &Lanes<T>) {
    if lanes.len() == LANES {
        column.extend_from_slice(values);
    } else {
        column.extend(lanes.iter().map(|lane| values[*lane]));
    }
}

//! The lidars of a run, each where it is mounted.

use super::motion::Motion;
use super::pose::Transform;
use super::{Interferer, Scene};
use crate::design::Design;
use crate::emit::Clock;

/// A lidar where it is mounted.
#[derive(Debug, Clone, Copy)]
pub struct Mount<'a> {
    /// Name, for reports.
    pub name: &'a str,
    /// Design of the lidar.
    pub design: &'a Design,
    /// Position and attitude at any time.
    pub motion: &'a Motion,
    /// When its first scan begins, and how fast its clock runs.
    pub begins: Clock,
    /// True if what it receives is recorded. An interferer counts only for its light.
    pub records: bool,
}

/// All lidars of a run. Their places in it are the transmitters of
/// [`Light`](crate::channel::Light).
#[derive(Debug, Clone)]
pub struct Rig<'a> {
    /// The one that records first, then those that do not.
    pub mounts: Vec<Mount<'a>>,
}

impl Scene {
    /// The lidars of a run of `design` in this scene: itself, where the scene has its sensor, and the
    /// interferers of the scene in their order.
    pub fn rig<'a>(&'a self, design: &'a Design) -> Rig<'a> {
        let records = Mount {
            name: &design.name,
            design,
            motion: &self.sensor,
            begins: Clock::default(),
            records: true,
        };
        let others = self.interferers.iter().map(Mount::from);
        Rig { mounts: std::iter::once(records).chain(others).collect() }
    }
}

impl<'a> From<&'a Interferer> for Mount<'a> {
    fn from(Interferer { name, design, motion, clock }: &'a Interferer) -> Self {
        Self { name, design, motion, begins: *clock, records: false }
    }
}

/// Two lidars of a rig: one shines, and the other one may receive its light.
#[derive(Debug, Clone, Copy)]
pub struct Pair<'a> {
    /// The one that shines.
    pub from: Mount<'a>,
    /// The one that may receive it.
    pub to: Mount<'a>,
}

impl Pair<'_> {
    /// Returns true if either of them moves.
    pub fn moves(&self) -> bool {
        self.from.motion.moves() || self.to.motion.moves()
    }

    /// Returns the poses of both at `time_fs`.
    pub fn at(&self, time_fs: i64) -> Ends {
        let [from, to] = [self.from, self.to].map(|end| End::of(end.motion, time_fs));
        Ends { from, to }
    }
}

/// Poses of both lidars of a [`Pair`] at some time.
#[derive(Debug, Clone, Copy)]
pub struct Ends {
    /// The one that shines.
    pub from: End,
    /// The one that may receive it.
    pub to: End,
}

/// Pose of one of them.
#[derive(Debug, Clone, Copy)]
pub struct End {
    /// Position in the world, m.
    pub position: [f64; 3],
    /// From its own frame into the world.
    pub to_world: Transform,
    /// From the world into its own frame.
    pub from_world: Transform,
}

impl End {
    fn of(motion: &Motion, time_fs: i64) -> Self {
        let pose = motion.at(time_fs);
        let (to_world, from_world) = (pose.world_from_sensor(), pose.sensor_from_world());
        Self { position: pose.position, to_world, from_world }
    }
}

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
    /// What it is.
    pub design: &'a Design,
    /// Where it is and looks, at any time.
    pub motion: &'a Motion,
    /// When its first scan begins, and how fast its clock runs.
    pub begins: Clock,
    /// Whether what it receives is recorded. Of an interferer the light alone counts.
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

/// Two lidars of a rig, of which one shines and the other one may receive it.
#[derive(Debug, Clone, Copy)]
pub struct Pair<'a> {
    /// The one that shines.
    pub from: Mount<'a>,
    /// The one that may receive it.
    pub to: Mount<'a>,
}

impl Pair<'_> {
    /// Whether either of them moves.
    pub fn moves(&self) -> bool {
        self.from.motion.moves() || self.to.motion.moves()
    }

    /// Where both are at `time_fs`.
    pub fn at(&self, time_fs: i64) -> Ends {
        let [from, to] = [self.from, self.to].map(|end| End::of(end.motion, time_fs));
        Ends { from, to }
    }
}

/// Where both lidars of a [`Pair`] are at some time.
#[derive(Debug, Clone, Copy)]
pub struct Ends {
    /// The one that shines.
    pub from: End,
    /// The one that may receive it.
    pub to: End,
}

/// Where one of them is.
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

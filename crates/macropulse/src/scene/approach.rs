//! How fast surfaces approach the sensor: what shifts the frequency of their light.

use super::motion::Motion;
use super::{Hits, Scene};
use crate::design::Design;
use crate::units::{FS_PER_S, s_from_fs};
use macropulse_codec::ShotLog;

/// Time over which a range is watched, fs: a microsecond, in which no surface of a scene turns to be seen
/// from elsewhere. The rounding of 100 m is 10⁻⁸ of the way of a surface at 1 m/s in this time.
const STEP_FS: i64 = FS_PER_S / 1_000_000;

impl Scene {
    /// Radial velocities, m/s, of the places that `hits` of the shots of `log` have met, positive if they
    /// approach. Their ranges decrease at this speed by their own motion and that of the sensor together.
    pub(super) fn radial_velocities(
        &self,
        design: &Design,
        log: &ShotLog,
        hits: &Hits,
    ) -> Vec<f32> {
        if self.moving.is_empty() {
            return vec![0.0; hits.shot.len()];
        }
        let motions = self.world.motions(self.objects.len());
        let directions = design.directions();
        let along = |at: usize| {
            let shot = hits.shot[at] as usize;
            let (fired_fs, range) = (log.fired_at_fs[shot], hits.range[at]);
            let origin = match directions.have_origins() {
                true => directions.origin(log.row[shot], log.column[shot]),
                false => [0.0; 3],
            };
            let aim = directions.of_shot(log, shot);
            let local = [0, 1, 2].map(|axis| origin[axis] + range * aim[axis]);
            let met = self.sensor.at(fired_fs).world_from_sensor().point(local);
            let later_fs = fired_fs + STEP_FS;
            let moved = motions[usize::from(hits.object[at])].map_or(met, |motion: &Motion| {
                let body = motion.at(fired_fs).world_from_sensor().inverse().point(met);
                motion.at(later_fs).world_from_sensor().point(body)
            });
            let from = self.sensor.at(later_fs).world_from_sensor().point(origin);
            let apart = [0, 1, 2].map(|axis| (moved[axis] - from[axis]).powi(2));
            ((range - apart.iter().sum::<f64>().sqrt()) / s_from_fs(STEP_FS)) as f32
        };
        (0..hits.shot.len()).map(along).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    /// A ball that approaches at 15 m/s, a wall that stands, and a sensor that drives at 10 m/s towards both.
    #[test]
    fn surfaces_approach_by_their_motion_and_that_of_the_sensor() {
        let scene = Scene::from_toml(
            "version = 1\nname = \"test\"\nenvironment = \"vacuum-dark\"\n\
             [[material]]\nname = \"white\"\ndiffuse = 1.0\n\
             [[object]]\nname = \"ball\"\nmaterial = \"white\"\nshape.sphere.radius_m = 3.0\n\
             position_m = [40, 0, 0]\nvelocity_m_s = [-15, 0, 0]\n\
             [[object]]\nname = \"wall\"\nmaterial = \"white\"\nshape.box.size_m = [1, 400, 400]\n\
             position_m = [100, 0, 0]\n\
             [sensor]\nvelocity_m_s = [10, 0, 0]\n",
            "test",
            Path::new(""),
        )
        .unwrap();
        let design = Design::open("fmcw-1550", &[]).unwrap();
        let band = crate::emit::Band { scan: 0, first: 7900, shots: 200 };
        let log = band.shot_log(&design);
        let hits = scene.trace(&design, &log).middle;
        assert_eq!(hits.radial_velocity.len(), hits.shot.len());
        let mut met = [0, 0];
        for (at, shot) in hits.shot.iter().enumerate() {
            let object = usize::from(hits.object[at]);
            let [x, ..] = design.directions().of_shot(&log, *shot as usize);
            let expected = [25.0, 10.0][object] * x;
            assert!((f64::from(hits.radial_velocity[at]) - expected).abs() < 1e-4);
            met[object] += 1;
        }
        assert!(met.iter().all(|count| *count > 20), "{met:?}");
    }
}

//! Poses and motions as people type them, and what they mean.

use std::ops::RangeInclusive;

use glam::DVec3;
use schemars::JsonSchema;
use serde::Deserialize;

use super::error::Error;
use super::file::Source;
use super::motion::{FASTEST, FASTEST_TURN_DEG, Motion};
use super::path::Waypoints;
use super::pose::Pose;
use super::schema;
use super::spanned::{Spanned, Triple};
use super::typed::{FARTHEST, is_length};
use crate::units::{fs_from_s, s_from_fs};

/// Angles are no more than this, degrees: a hundred turns.
const MOST_TURNED: f64 = 36_000.0;

/// Times of a path, s from the beginning of the first scan. A run ends before the last one. The femtoseconds
/// between the first and the last fit into 63 bits.
const TIMES: RangeInclusive<f64> = -100.0..=9000.0;

/// `[sensor]`, and each entry of `copies`.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct Stand {
    /// Position, m: x forward, y left, z up.
    pub position_m: Option<Spanned<Triple>>,
    /// Turn to the left, degrees.
    #[schemars(range(min = -36000, max = 36000))]
    pub yaw_deg: Option<Spanned<f64>>,
    /// Tilt, degrees: positive looks down.
    #[schemars(range(min = -36000, max = 36000))]
    pub pitch_deg: Option<Spanned<f64>>,
    /// Roll, degrees: positive lifts the left side.
    #[schemars(range(min = -36000, max = 36000))]
    pub roll_deg: Option<Spanned<f64>>,
    /// Motion in the world, m/s; the position is where it is when the first scan begins.
    #[serde(default)]
    #[schemars(schema_with = "schema::velocity")]
    pub velocity_m_s: Option<Spanned<Triple>>,
    /// Turn about the vertical axis through the position, degrees per second, positive to the left.
    #[schemars(range(min = -1e5, max = 1e5))]
    pub turn_rate_deg_s: Option<Spanned<f64>>,
    /// Poses at ascending times, in place of position, angles and motion: straight on and evenly turning in between.
    #[schemars(length(min = 2))]
    pub path: Option<Spanned<Vec<Spanned<WaypointTyped>>>>,
}

/// Each entry of `path`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct WaypointTyped {
    /// Seconds since the first scan began.
    #[schemars(range(min = -100, max = 9000))]
    pub time_s: Spanned<f64>,
    /// Position at this time, m: x forward, y left, z up.
    pub position_m: Spanned<Triple>,
    /// Turn to the left, degrees.
    #[schemars(range(min = -36000, max = 36000))]
    pub yaw_deg: Option<Spanned<f64>>,
    /// Tilt, degrees: positive looks down.
    #[schemars(range(min = -36000, max = 36000))]
    pub pitch_deg: Option<Spanned<f64>>,
    /// Roll, degrees: positive lifts the left side.
    #[schemars(range(min = -36000, max = 36000))]
    pub roll_deg: Option<Spanned<f64>>,
}

impl WaypointTyped {
    /// Returns its pose as a [`Stand`].
    pub(super) fn stand(&self) -> Stand {
        Stand {
            position_m: Some(self.position_m.clone()),
            yaw_deg: self.yaw_deg.clone(),
            pitch_deg: self.pitch_deg.clone(),
            roll_deg: self.roll_deg.clone(),
            ..Stand::default()
        }
    }
}

impl Source<'_> {
    /// Returns the motion that `stand` describes.
    pub(super) fn motion(&self, stand: &Stand) -> Result<Motion, Error> {
        if let Some(path) = &stand.path {
            self.refuse_beside_path(stand)?;
            return Ok(Motion::Path(self.path(path)?));
        }
        let (pose, mut velocity, mut turn_rate) = (self.pose(stand)?, [0.0; 3], 0.0);
        if let Some(typed) = &stand.velocity_m_s {
            Triple(velocity) = *typed.get_ref();
            let speed = DVec3::from(velocity).length();
            if !(0.0..=FASTEST).contains(&speed) {
                let message = format!(
                    "velocity_m_s must be three finite numbers, {FASTEST} m/s together at most"
                );
                return Err(self.fault(typed.span(), message));
            }
        }
        if let Some(typed) = &stand.turn_rate_deg_s {
            let rate = *typed.get_ref();
            if !(-FASTEST_TURN_DEG..=FASTEST_TURN_DEG).contains(&rate) {
                let most = FASTEST_TURN_DEG;
                let message =
                    format!("turn_rate_deg_s is {rate}; it must be from -{most} to {most}");
                return Err(self.fault(typed.span(), message));
            }
            turn_rate = rate.to_radians();
        }
        Ok(Motion::steady(pose, velocity, turn_rate))
    }

    /// Refuses keys beside a `path`, which says all of a motion.
    fn refuse_beside_path(&self, stand: &Stand) -> Result<(), Error> {
        let angle = |typed: &Option<Spanned<f64>>| typed.as_ref().map(|typed| typed.span());
        let keys = [
            ("position_m", stand.position_m.as_ref().map(|typed| typed.span())),
            ("yaw_deg", angle(&stand.yaw_deg)),
            ("pitch_deg", angle(&stand.pitch_deg)),
            ("roll_deg", angle(&stand.roll_deg)),
            ("velocity_m_s", stand.velocity_m_s.as_ref().map(|typed| typed.span())),
            ("turn_rate_deg_s", angle(&stand.turn_rate_deg_s)),
        ];
        match keys.into_iter().find_map(|(key, span)| Some((key, span?))) {
            Some((key, span)) => {
                let message = format!("`path` says where it is at every time; remove `{key}`");
                Err(self.fault(span, message))
            }
            None => Ok(()),
        }
    }

    /// A path through poses.
    fn path(&self, typed: &Spanned<Vec<Spanned<WaypointTyped>>>) -> Result<Waypoints, Error> {
        let waypoints = typed.get_ref();
        if waypoints.len() < 2 {
            return Err(self.fault(typed.span(), "`path` needs two poses at least"));
        }
        let mut poses: Vec<(i64, Pose)> = Vec::with_capacity(waypoints.len());
        for waypoint in waypoints {
            let WaypointTyped { time_s, position_m, .. } = waypoint.get_ref();
            let time = *time_s.get_ref();
            if !TIMES.contains(&time) {
                let (first, last) = (TIMES.start(), TIMES.end());
                let message = format!("time_s is {time}; it must be from {first} to {last}");
                return Err(self.fault(time_s.span(), message));
            }
            let (time_fs, pose) = (fs_from_s(time), self.pose(&waypoint.get_ref().stand())?);
            if let Some((before_fs, before)) = poses.last() {
                if time_fs <= *before_fs {
                    let message = "time_s must be later than that of the pose before it";
                    return Err(self.fault(time_s.span(), message));
                }
                let time = s_from_fs(time_fs - before_fs);
                let way = DVec3::from(pose.position).distance(DVec3::from(before.position));
                let turn = before.rotation.way_to(pose.rotation).angle.to_degrees();
                if way > FASTEST * time || turn > FASTEST_TURN_DEG * time {
                    let message = format!(
                        "it goes {way} m and turns {turn} deg in {time} s: {FASTEST} m/s and \
                         {FASTEST_TURN_DEG} deg/s at most; give it more time"
                    );
                    return Err(self.fault(position_m.span(), message));
                }
            }
            poses.push((time_fs, pose));
        }
        Ok(Waypoints::through(&poses))
    }

    /// Returns the pose that `stand` describes.
    pub(super) fn pose(&self, stand: &Stand) -> Result<Pose, Error> {
        let mut position = [0.0; 3];
        if let Some(typed) = &stand.position_m {
            Triple(position) = *typed.get_ref();
            if !position.iter().all(|value| is_length(*value)) {
                let message =
                    format!("position_m must be three finite numbers, to {FARTHEST:e} m at most");
                return Err(self.fault(typed.span(), message));
            }
        }
        let angle = |typed: &Option<Spanned<f64>>, key: &str| match typed {
            Some(typed) if typed.get_ref().abs() <= MOST_TURNED => Ok(typed.get_ref().to_radians()),
            Some(typed) => {
                let message =
                    format!("{key} must be a number from -{MOST_TURNED} to {MOST_TURNED}");
                Err(self.fault(typed.span(), message))
            }
            None => Ok(0.0),
        };
        let angles = [
            angle(&stand.yaw_deg, "yaw_deg")?,
            angle(&stand.pitch_deg, "pitch_deg")?,
            angle(&stand.roll_deg, "roll_deg")?,
        ];
        Ok(Pose::turned(position, angles))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn motion(keys: &str) -> Result<Motion, String> {
        let text = format!("version = 1\n[sensor]\n{keys}");
        let source = Source::typed(&text, "a.toml");
        let file = source.parse().unwrap();
        source.motion(&file.sensor).map_err(|error| error.to_string())
    }

    #[test]
    fn a_motion_is_read_in_si_units() {
        let read =
            motion("position_m = [1, 2, 3]\nvelocity_m_s = [4, 5, 6]\nturn_rate_deg_s = -90");
        let turn_rate = -std::f64::consts::FRAC_PI_2;
        let pose = Pose::at([1.0, 2.0, 3.0]);
        assert_eq!(read, Ok(Motion::steady(pose, [4.0, 5.0, 6.0], turn_rate)));
        assert_eq!(motion(""), Ok(Motion::Still(Pose::default())));
    }

    #[test]
    fn the_fastest_motion_is_read_and_nothing_faster() {
        let told = |keys| motion(keys).unwrap_err();
        assert!(motion("velocity_m_s = [-1e4, 0, 0]\nturn_rate_deg_s = -1e5").is_ok());
        assert!(told("velocity_m_s = [0, 1.0001e4, 0]").contains("10000 m/s together at most"));
        assert!(told("turn_rate_deg_s = -1.0001e5").contains("from -100000 to 100000"));
        assert!(told("turn_rate_deg_s = nan").contains("turn_rate_deg_s is NaN"));
    }
}

//! Lasers at fixed elevations on a head that turns clockwise, seen from above.

use std::f64::consts::{PI, TAU};

use serde::Deserialize;

use super::directions::{Angles, Directions};
use super::model::{Extent, Model, Moment};
use super::{Pattern, Typed};
use crate::design::Error;
use crate::design::limits::Check;
use crate::design::safety::{Beams, Line, Lines};

/// Fixed elevations on a turning head.
#[derive(Debug, Clone, PartialEq)]
pub struct Spinning {
    /// Elevation of each row, rad, from the top.
    pub elevations: Vec<f64>,
    /// Columns of the image: azimuth steps of a turn.
    pub columns: u32,
    /// Rows in the order in which they fire.
    order: Vec<u16>,
    /// The place of each row in that order.
    turns: Vec<u16>,
    /// When they fire.
    firing: Firing,
}

/// In which order the lasers of a spinning sensor fire while it turns by one azimuth step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Firing {
    /// Evenly spaced in time, one laser of each block in turn.
    BlocksInTurn,
    /// All at once.
    Together,
}

/// `[scan.spinning]` as typed.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct File {
    azimuth_step_deg: f64,
    blocks: Vec<LaserBlockFile>,
    firing: Firing,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct LaserBlockFile {
    lasers: u32,
    first_deg: f64,
    step_deg: f64,
}

impl Typed for File {
    fn check(&self, check: &Check) -> Result<Pattern, Error> {
        let path = "scan.spinning.azimuth_step_deg";
        let step = check.within(path, self.azimuth_step_deg, 0.012, 90.0)?;
        let path = "scan.spinning.blocks";
        let mut elevations = Vec::new();
        let mut lasers: Vec<(u32, u16)> = Vec::new();
        for block in &self.blocks {
            for laser in 0..check.count(path, block.lasers, 1, 1024)? {
                let elevation = block.first_deg + f64::from(laser) * block.step_deg;
                lasers.push((laser, elevations.len() as u16));
                elevations.push(check.within(path, elevation, -90.0, 90.0)?.to_radians());
            }
        }
        if elevations.is_empty() {
            return check.refuse(path, "names no laser");
        }
        if !elevations.is_sorted_by(|above, below| above > below) {
            return check.refuse(path, "must list the elevations from the top down");
        }
        lasers.sort_unstable();
        let order: Vec<u16> = lasers.into_iter().map(|(_, row)| row).collect();
        let mut turns = vec![0; order.len()];
        for (turn, row) in (0..).zip(&order) {
            turns[usize::from(*row)] = turn;
        }
        let columns = (360.0 / step).round() as u32;
        Ok(Pattern::Spinning(Spinning { elevations, columns, order, turns, firing: self.firing }))
    }
}

impl Spinning {
    fn lasers(&self) -> u64 {
        self.order.len() as u64
    }

    /// By what part of an azimuth step the head has turned when `row` fires.
    fn turned(&self, row: usize) -> f64 {
        match self.firing {
            Firing::BlocksInTurn => f64::from(self.turns[row]) / self.order.len() as f64,
            Firing::Together => 0.0,
        }
    }

    /// The row whose cell holds `elevation`. The first and the last one reach as far outwards as
    /// inwards; one alone reaches everywhere.
    fn nearest_row(&self, elevation: f64) -> Option<u16> {
        let elevations = &self.elevations;
        let below = elevations.partition_point(|other| *other > elevation);
        let gap = |upper: usize| match (elevations.get(upper), elevations.get(upper + 1)) {
            (Some(upper), Some(lower)) => upper - lower,
            _ => TAU,
        };
        let row = match below.checked_sub(1) {
            None => (elevation <= elevations[0] + gap(0) / 2.0).then_some(0),
            Some(above) if below == elevations.len() => (elevation
                >= elevations[above] - gap(above.saturating_sub(1)) / 2.0)
                .then_some(above),
            Some(above) => {
                Some(if elevations[above] - elevation < gap(above) / 2.0 { above } else { below })
            }
        };
        row.map(|row| row as u16)
    }
}

impl Model for Spinning {
    fn summary(&self) -> String {
        format!("{} beams, turning head", self.lasers())
    }

    fn size(&self) -> [u32; 2] {
        [self.elevations.len() as u32, self.columns]
    }

    fn channels(&self) -> u32 {
        self.elevations.len() as u32
    }

    fn channel_of(&self, _order: u64, row: u16) -> u16 {
        row
    }

    fn pixel(&self, order: u64) -> (u16, u16) {
        let lasers = self.lasers();
        (self.order[(order % lasers) as usize], (order / lasers) as u16)
    }

    fn order_of(&self, row: u16, column: u16) -> u64 {
        let turn = self.turns.get(usize::from(row)).copied().unwrap_or(0);
        u64::from(column) * self.lasers() + u64::from(turn)
    }

    fn moment(&self, order: u64, _period: f64) -> Moment {
        let shots = match self.firing {
            Firing::BlocksInTurn => order,
            Firing::Together => order - order % self.lasers(),
        };
        Moment { shots, then: 0.0 }
    }

    fn equal_steps(&self) -> bool {
        self.firing == Firing::BlocksInTurn
    }

    fn line(&self) -> u64 {
        self.lasers()
    }

    fn draws_from_the_left(&self) -> bool {
        false
    }

    fn shortest_dwell(&self, pixel_period: f64) -> f64 {
        pixel_period * f64::from(self.channels())
    }

    fn moves_by(&self) -> Option<f64> {
        None
    }

    /// The head begins to the rear and goes on turning while its lasers fire one after another.
    fn directions(&self) -> Directions {
        let columns = f64::from(self.columns);
        let azimuth =
            |column: u32, turned: f64| PI - TAU * ((f64::from(column) + turned) / columns);
        let azimuths = match self.firing {
            Firing::Together => Angles::by_column((0..self.columns).map(|c| azimuth(c, 0.0))),
            Firing::BlocksInTurn => {
                let rows = self.elevations.len();
                let of_column =
                    |column| (0..rows).map(move |row| azimuth(column, self.turned(row)));
                let angles = (0..self.columns).flat_map(of_column).collect();
                Angles { angles, per_row: 1, per_column: rows }
            }
        };
        Directions::new(&Angles::by_row(self.elevations.iter().copied()), &azimuths)
    }

    fn pixel_at(&self, azimuth: f64, elevation: f64) -> Option<(u16, u16)> {
        let row = self.nearest_row(elevation)?;
        let columns = f64::from(self.columns);
        let turned = (PI - azimuth) / TAU * columns - self.turned(row.into());
        Some((row, turned.round().rem_euclid(columns) as u16))
    }

    /// Lasers are rarely evenly spaced: a cell is as high as the median step between them, that of
    /// one alone as high as wide.
    fn cell(&self) -> [f64; 2] {
        let mut steps: Vec<f64> = self.elevations.windows(2).map(|two| two[0] - two[1]).collect();
        steps.sort_by(f64::total_cmp);
        let across = TAU / f64::from(self.columns);
        let middle = [steps.len().saturating_sub(1) / 2, steps.len() / 2];
        let median = middle.map(|place| steps.get(place).copied().unwrap_or(across));
        [across, (median[0] + median[1]) / 2.0]
    }

    fn extent(&self) -> Extent {
        let [top, bottom] =
            [self.elevations.first(), self.elevations.last()].map(|e| e.copied().unwrap_or(0.0));
        Extent { elevation: [bottom, top], ..Extent::centred([TAU, 0.0]) }
    }

    fn shared_field(&self) -> Option<[f64; 2]> {
        None
    }

    fn follows(&self) -> bool {
        true
    }

    fn beams(&self) -> Beams {
        let step = TAU / f64::from(self.columns);
        let rows = self.elevations.iter().enumerate();
        let rows =
            rows.map(|(row, &elevation)| Line { elevation, first: PI - step * self.turned(row) });
        Beams::Lines(Lines { rows: rows.collect(), step, first: PI, one_by_one: false })
    }
}

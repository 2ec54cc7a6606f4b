//! Lasers at fixed elevations on a head that turns clockwise, seen from above.

use std::f64::consts::{PI, TAU};

use schemars::JsonSchema;
use serde::Deserialize;

use super::calibration::{self, Calibration};
use super::directions::{Angles, Directions};
use super::laser::{self, Laser, MOST_LASERS};
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
    /// The laser of each row.
    pub lasers: Vec<Laser>,
    /// The range offset of each row, m; empty where none has any.
    range_offsets: Vec<f64>,
    /// Columns of the image: azimuth steps of a turn.
    pub columns: u32,
    /// Azimuth steps in a whole turn. It is no whole number if a part of a step is left at the end of a turn.
    steps: f64,
    /// Rows in the order in which they fire.
    order: Vec<u16>,
    /// The place of each row in that order.
    turns: Vec<u16>,
    /// When they fire.
    firing: Firing,
    pace: Pace,
    /// How long an azimuth step takes, s.
    lasts: f64,
    digest: Option<String>,
    notes: Vec<String>,
}

/// In which order the lasers of a spinning sensor fire while it turns by one azimuth step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Firing {
    /// One laser of each block in turn; lasers of a list are one block.
    BlocksInTurn,
    /// All at once.
    Together,
}

/// How long an azimuth step and what is in it take, where that is typed, s.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Pace {
    /// An azimuth step. It determines the number of steps in a turn.
    cycle: Option<f64>,
    /// From one laser to the next, with a pause behind the last.
    firing: Option<f64>,
}

/// `[scan.spinning]` as typed.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct File {
    /// Turn between columns, degrees; or `cycle_us`.
    #[schemars(range(min = 0.012, max = 90))]
    azimuth_step_deg: Option<f64>,
    /// Time between columns, µs; or `azimuth_step_deg`.
    #[schemars(range(min = 0))]
    cycle_us: Option<f64>,
    /// Lasers in blocks of even steps, from the top down; or `lasers`, or `calibration`.
    blocks: Option<Vec<LaserBlockFile>>,
    /// Lasers one by one, in the order in which they fire; or `blocks`, or `calibration`.
    #[schemars(length(min = 1, max = 1024))]
    lasers: Option<Vec<laser::File>>,
    /// Calibration file, beside this file; or `blocks`, or `lasers`. It is that of the ROS driver of Velodyne
    /// sensors (YAML), the metadata of an Ouster sensor (JSON), or the angle corrections of a Hesai sensor
    /// (CSV).
    calibration: Option<String>,
    /// Order within one column.
    firing: Firing,
    /// Time from one laser to the next, µs, with a pause behind the last; without it they fire
    /// evenly over the column.
    #[schemars(range(min = 0))]
    firing_us: Option<f64>,
}

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct LaserBlockFile {
    /// Lasers of the block.
    #[schemars(range(min = 1, max = 1024))]
    lasers: u32,
    /// Elevation of its first laser, degrees.
    #[schemars(range(min = -90, max = 90))]
    first_deg: f64,
    /// Elevation from one laser to the next, degrees: negative from the top down.
    step_deg: f64,
}

/// Lasers in the order in which they fire.
struct Head {
    lasers: Vec<Laser>,
    notes: Vec<String>,
    digest: Option<String>,
}

impl Typed for File {
    fn check(&self, check: &Check, period: f64) -> Result<Pattern, Error> {
        let Head { lasers: fired, notes, digest } = self.head(check)?;
        let count = fired.len();
        let (steps, cycle) = self.steps(check, period)?;
        let lasts = cycle.unwrap_or(period / steps);
        let path = "scan.spinning.firing_us";
        let firing = match self.firing_us {
            Some(_) if self.firing == Firing::Together => {
                let message = "has no effect because of `scan.spinning.firing`: all fire at once";
                return check.refuse(path, message);
            }
            Some(typed) => {
                let most = lasts * 1e6 / count as f64;
                // A hair more, so that what fills the time exactly fits.
                Some(check.within(path, typed, 0.0, most * (1.0 + 1e-9))? * 1e-6)
            }
            None => None,
        };
        // Rows from the top down; of two as high the one that fires first.
        let mut turns: Vec<u16> = (0..count as u16).collect();
        let elevation = |turn: &u16| fired[usize::from(*turn)].elevation;
        turns.sort_by(|a, b| elevation(b).total_cmp(&elevation(a)));
        let mut order = vec![0; count];
        for (row, turn) in (0..).zip(&turns) {
            order[usize::from(*turn)] = row;
        }
        let lasers: Vec<Laser> = turns.iter().map(|turn| fired[usize::from(*turn)]).collect();
        let mut range_offsets: Vec<f64> = lasers.iter().map(|laser| laser.range_offset).collect();
        if range_offsets.iter().all(|offset| *offset == 0.0) {
            range_offsets.clear();
        }
        Ok(Pattern::Spinning(Spinning {
            range_offsets,
            elevations: lasers.iter().map(|laser| laser.elevation).collect(),
            lasers,
            columns: steps.floor() as u32,
            steps,
            order,
            turns,
            firing: self.firing,
            pace: Pace { cycle, firing },
            lasts,
            digest,
            notes,
        }))
    }
}

impl File {
    /// The azimuth steps in a turn, and how long one takes where that is typed.
    fn steps(&self, check: &Check, period: f64) -> Result<(f64, Option<f64>), Error> {
        match (self.azimuth_step_deg, self.cycle_us) {
            (Some(typed), None) => {
                let path = "scan.spinning.azimuth_step_deg";
                let step = check.within(path, typed, 0.012, 90.0)?;
                Ok(((360.0 / step).round(), None))
            }
            (None, Some(typed)) => {
                let turn = period * 1e6;
                let path = "scan.spinning.cycle_us";
                let cycle = check.within(path, typed, turn / 30_000.0, turn / 4.0)?;
                // If a turn holds a whole number of them, rounding must take none away.
                let steps = turn / cycle;
                let whole = steps.round();
                let steps = if (steps - whole).abs() < 1e-6 { whole } else { steps };
                Ok((steps, Some(cycle * 1e-6)))
            }
            _ => check.refuse("scan.spinning", "needs exactly one of azimuth_step_deg, cycle_us"),
        }
    }

    fn head(&self, check: &Check) -> Result<Head, Error> {
        let head = |lasers| Head { lasers, notes: Vec::new(), digest: None };
        match (&self.blocks, &self.lasers, &self.calibration) {
            (Some(blocks), None, None) => of_blocks(check, blocks).map(head),
            (None, Some(lasers), None) => {
                if lasers.is_empty() || lasers.len() > MOST_LASERS {
                    let message = format!("must name 1 to {MOST_LASERS} lasers");
                    return check.refuse("scan.spinning.lasers", message);
                }
                let lasers = lasers.iter().zip(1..);
                let checked = lasers.map(|(laser, number)| laser.check(check, number));
                checked.collect::<Result<_, _>>().map(head)
            }
            (None, None, Some(file)) => {
                let path = "scan.spinning.calibration";
                match calibration::read(&check.chain.beside(path, file)) {
                    Ok(Calibration { lasers, notes, digest }) => {
                        Ok(Head { lasers, notes, digest: Some(digest) })
                    }
                    Err(message) => check.refuse(path, message),
                }
            }
            _ => {
                let message = "needs exactly one of blocks, lasers, calibration";
                check.refuse("scan.spinning", message)
            }
        }
    }
}

/// The lasers of blocks, one of each block in turn.
fn of_blocks(check: &Check, blocks: &[LaserBlockFile]) -> Result<Vec<Laser>, Error> {
    let path = "scan.spinning.blocks";
    let mut elevations = Vec::new();
    let mut lasers: Vec<(u32, usize)> = Vec::new();
    for block in blocks {
        for laser in 0..check.count(path, block.lasers, 1, MOST_LASERS as u32)? {
            let elevation = block.first_deg + f64::from(laser) * block.step_deg;
            lasers.push((laser, elevations.len()));
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
    let laser = |(_, row): (u32, usize)| Laser {
        elevation: elevations[row],
        azimuth: 0.0,
        range_offset: 0.0,
        origin: [0.0; 3],
    };
    Ok(lasers.into_iter().map(laser).collect())
}

impl Spinning {
    fn lasers(&self) -> u64 {
        self.order.len() as u64
    }

    /// By what part of an azimuth step the head has turned when `row` fires.
    fn turned(&self, row: usize) -> f64 {
        let turn = f64::from(self.turns[row]);
        match (self.firing, self.pace.firing) {
            (Firing::Together, _) => 0.0,
            (Firing::BlocksInTurn, Some(firing)) => turn * firing / self.lasts,
            (Firing::BlocksInTurn, None) => turn / self.order.len() as f64,
        }
    }

    /// Returns the azimuth of the head, rad, when it has turned by `column` + `turned` azimuth steps. It
    /// begins to the rear.
    fn azimuth(&self, column: u32, turned: f64) -> f64 {
        PI - TAU * ((f64::from(column) + turned) / self.steps)
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
        let turn = match self.firing {
            Firing::BlocksInTurn => order % self.lasers(),
            Firing::Together => 0,
        };
        let columns = order / self.lasers();
        match self.pace {
            Pace { cycle: None, firing: None } => {
                Moment { shots: columns * self.lasers() + turn, then: 0.0 }
            }
            Pace { cycle: None, firing: Some(firing) } => {
                Moment { shots: columns * self.lasers(), then: turn as f64 * firing }
            }
            Pace { cycle: Some(cycle), firing } => {
                let firing = firing.unwrap_or(cycle / self.lasers() as f64);
                Moment { shots: 0, then: columns as f64 * cycle + turn as f64 * firing }
            }
        }
    }

    fn equal_steps(&self) -> bool {
        let even = Pace { cycle: None, firing: None };
        self.firing == Firing::BlocksInTurn && self.pace == even
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
        let rows = self.lasers.len();
        let alike = self.lasers.iter().all(|laser| laser.azimuth == 0.0);
        let azimuths = match self.firing {
            Firing::Together if alike => {
                Angles::by_column((0..self.columns).map(|column| self.azimuth(column, 0.0)))
            }
            _ => {
                let of_row =
                    |column, row| self.azimuth(column, self.turned(row)) + self.lasers[row].azimuth;
                let of_column = |column| (0..rows).map(move |row| of_row(column, row));
                let angles = (0..self.columns).flat_map(of_column).collect();
                Angles { angles, per_row: 1, per_column: rows }
            }
        };
        let origins: Vec<[f64; 3]> = self.lasers.iter().map(|laser| laser.origin).collect();
        let one_place = origins.iter().all(|origin| *origin == [0.0; 3]);
        let origins = if one_place { Vec::new() } else { origins };
        Directions::new(&Angles::by_row(self.elevations.iter().copied()), &azimuths, origins)
    }

    fn pixel_at(&self, azimuth: f64, elevation: f64) -> Option<(u16, u16)> {
        let row = self.nearest_row(elevation)?;
        let off = azimuth - self.lasers[usize::from(row)].azimuth;
        let turned = (PI - off) / TAU * self.steps - self.turned(row.into());
        let column = turned.rem_euclid(self.steps).round() as u16;
        // The first column is nearest to the part of a step that is left at the end of a turn.
        Some((row, if u32::from(column) < self.columns { column } else { 0 }))
    }

    /// Lasers are rarely evenly spaced: a cell is as high as the median step between them, that of
    /// one alone as high as wide.
    fn cell(&self) -> [f64; 2] {
        let mut steps: Vec<f64> = self.elevations.windows(2).map(|two| two[0] - two[1]).collect();
        steps.sort_by(f64::total_cmp);
        let across = TAU / self.steps;
        let middle = [steps.len().saturating_sub(1) / 2, steps.len() / 2];
        let median = middle.map(|place| steps.get(place).copied().unwrap_or(across));
        let height = (median[0] + median[1]) / 2.0;
        [across, if height > 0.0 { height } else { across }]
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
        let step = TAU / self.steps;
        let first = |row: usize| PI - step * self.turned(row) + self.lasers[row].azimuth;
        let rows = self.elevations.iter().enumerate();
        let rows = rows.map(|(row, &elevation)| Line { elevation, first: first(row) });
        Beams::Lines(Lines { rows: rows.collect(), step, first: PI, in_turn: 1, comes_back: false })
    }

    fn range_offsets(&self) -> &[f64] {
        &self.range_offsets
    }

    fn file_digest(&self) -> Option<&str> {
        self.digest.as_deref()
    }

    fn notes(&self) -> &[String] {
        &self.notes
    }
}

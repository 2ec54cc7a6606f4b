//! The beams of a raster or a turning head, and those of them that cross an aperture.

use std::f64::consts::{PI, TAU};
use std::ops::Range;

use super::crossing::Energies;
use super::exposure::Crossing;
use super::share::Share;
use crate::design::{Firing, Pattern, Scan};

/// Places along an aperture at which its middle is tried, where many pixels lie in it.
const STEPS: f64 = 16.0;
/// Places along a line at which the light that passes the aperture is estimated.
const SAMPLES: u32 = 16;
/// Lines by which that is done.
const ROWS: usize = 32;
/// Where so many shots cross, it does not matter whether the middle is on a pixel or between two.
const MANY: f64 = 400.0;
/// Elevations that are looked at in all columns.
const FINALISTS: usize = 3;

/// Where the middle of an aperture is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Aim {
    pub azimuth: f64,
    pub elevation: f64,
}

/// The beams of a scan, line by line.
pub(super) struct Beams<'a> {
    scan: &'a Scan,
    energies: &'a Energies,
    distance: f64,
    rows: Vec<Row>,
    /// Angle between columns, rad.
    step: f64,
    /// Azimuth of the first column, rad, if its row fires first.
    first: f64,
}

struct Row {
    elevation: f64,
    /// Azimuth of the first column, rad.
    first: f64,
    /// The place of the row in the order in which rows fire.
    turn: usize,
}

impl<'a> Beams<'a> {
    /// Of a raster or a turning head; of any other `scan` none.
    pub fn of(scan: &'a Scan, energies: &'a Energies, distance: f64) -> Self {
        let columns = f64::from(scan.columns);
        let mut rows = Vec::new();
        let (mut step, mut first) = (TAU / columns, PI);
        match &scan.pattern {
            Pattern::Raster { horizontal, vertical, .. } => {
                step = horizontal / columns;
                first = (horizontal - step) / 2.0;
                for row in 0..scan.rows {
                    let down = (f64::from(row) + 0.5) / f64::from(scan.rows);
                    rows.push(Row { elevation: vertical * (0.5 - down), first, turn: 0 });
                }
            }
            Pattern::Spinning { elevations, order, firing } => {
                for (row, &elevation) in elevations.iter().enumerate() {
                    let turn = order.iter().position(|&fired| usize::from(fired) == row);
                    let turn = turn.unwrap_or(0);
                    let turned = match firing {
                        Firing::BlocksInTurn => turn as f64 / order.len() as f64,
                        Firing::Together => 0.0,
                    };
                    rows.push(Row { elevation, first: PI - step * turned, turn });
                }
            }
            Pattern::Flash { .. } => {}
        }
        Self { scan, energies, distance, rows, step, first }
    }

    /// The shots that cross an aperture with its middle at `aim`, in the order of their times.
    pub fn crossing(&self, share: &Share, aim: Aim) -> Vec<Crossing> {
        let reach = self.reach(share);
        let mut shots = Vec::new();
        for number in self.rows_within(aim.elevation, reach) {
            let row = &self.rows[number];
            for columns in self.columns_within(row, aim, reach) {
                for column in columns {
                    let off = row.first - self.step * f64::from(column) - aim.azimuth;
                    let share = share.at(self.off(aim.elevation, row.elevation, off));
                    let time = self.scan.moment([number as u32, column], row.turn);
                    let energy = share * self.energies.at(column);
                    if share > 0.0 {
                        shots.push(Crossing { time, share, energy });
                    }
                }
            }
        }
        shots.sort_unstable_by(|a, b| a.time.total_cmp(&b.time));
        shots
    }

    /// Where an aperture sees most: of a whole scan, and of the shots within `counted` seconds, if
    /// a scan is longer.
    ///
    /// Columns stand closer the higher a row lies, cos(elevation) of what they do at the horizon;
    /// near the edge of the field less of the aperture is lit, but the columns stand closest.
    pub fn aims(&self, share: &Share, counted: f64) -> Vec<Aim> {
        let reach = self.reach(share);
        let mut tried: Vec<(f64, f64)> = self
            .elevations(reach)
            .into_iter()
            .map(|elevation| (self.estimate(share, elevation), elevation))
            .collect();
        tried.sort_by(|a, b| b.0.total_cmp(&a.0));
        let most = tried.iter().take(FINALISTS).map(|&(shots, elevation)| {
            if self.energies.alike && shots > MANY {
                let azimuth = self.first - self.step * f64::from(self.scan.columns / 2);
                return (shots, Aim { azimuth, elevation });
            }
            let rows = self.rows_within(elevation, reach);
            self.brightest(&Lit { share, elevation, rows, widest: PI })
        });
        let most = most.max_by(|a, b| a.0.total_cmp(&b.0));
        let mut aims: Vec<Aim> = most.map(|(_, aim)| aim).into_iter().collect();
        if counted >= self.scan.period() {
            return aims;
        }
        // So many columns pass within the time, if that is shorter than a line takes to cross.
        let line = self.scan.period() / self.lines();
        let widest = counted / line * f64::from(self.scan.columns) * self.step / 2.0;
        for elevation in self.edges(reach) {
            let number = self.nearest(elevation);
            let elevation = self.rows[number].elevation;
            let rows = match self.scan.pattern {
                Pattern::Raster { .. } => number..number + 1,
                _ => self.rows_within(elevation, reach),
            };
            aims.push(self.brightest(&Lit { share, elevation, rows, widest }).1);
        }
        aims
    }

    /// The angle within which a beam meets the aperture, rad.
    fn reach(&self, share: &Share) -> f64 {
        libm::atan(share.reach() / self.distance)
    }

    /// Lines drawn one after another in a scan: a turning head draws all at once.
    fn lines(&self) -> f64 {
        match self.scan.pattern {
            Pattern::Raster { .. } => f64::from(self.scan.rows),
            _ => 1.0,
        }
    }

    /// Distance in the plane of the aperture, m, between its middle and a beam `off` in azimuth.
    fn off(&self, aim: f64, elevation: f64, off: f64) -> f64 {
        // Haversines: exact for small angles, too.
        let half = |angle: f64| libm::sin(angle / 2.0);
        let [down, across] = [half(aim - elevation), half(off)];
        let across = across * across * libm::cos(aim) * libm::cos(elevation);
        let square = (down * down + across).min(1.0);
        // The tangent of the angle whose half has this sine squared.
        let [sine, cosine] = [2.0 * (square * (1.0 - square)).sqrt(), 1.0 - 2.0 * square];
        if cosine > 0.0 { self.distance * sine / cosine } else { f64::INFINITY }
    }

    fn rows_within(&self, elevation: f64, reach: f64) -> Range<usize> {
        let above = |limit: f64| self.rows.partition_point(|row| row.elevation > limit);
        let within = reach * (1.0 + 1e-9);
        above(elevation + within)..above(elevation - within).max(above(elevation + within))
    }

    /// How far in azimuth a row stays within `reach` of an aim, rad; `None` where it never is.
    fn half_chord(&self, elevation: f64, aim: f64, reach: f64) -> Option<f64> {
        let half = |angle: f64| libm::sin(angle / 2.0);
        let [whole, down] = [half(reach * (1.0 + 1e-9)), half(aim - elevation)];
        let cosines = libm::cos(aim) * libm::cos(elevation);
        let square = (whole * whole - down * down) / cosines.max(1e-12);
        match square {
            square if square < 0.0 => None,
            square if square >= 1.0 => Some(PI),
            square => Some(2.0 * libm::asin(libm::sqrt(square))),
        }
    }

    /// The columns of `row` within `reach` of `aim`: one run of them, or two at a seam.
    fn columns_within(&self, row: &Row, aim: Aim, reach: f64) -> Vec<Range<u32>> {
        let Some(half) = self.half_chord(row.elevation, aim.elevation, reach) else {
            return Vec::new();
        };
        self.columns_between(row.first - aim.azimuth, half)
    }

    /// The columns within `half` of an azimuth that lies `off` before the first column.
    fn columns_between(&self, off: f64, half: f64) -> Vec<Range<u32>> {
        if half >= PI {
            return std::iter::once(0..self.scan.columns).collect();
        }
        let turn = |turn: f64| {
            let column = |angle: f64| (off + turn * TAU + angle) / self.step;
            let [from, to] = [column(-half).ceil(), column(half).floor() + 1.0];
            // Casts stop at the ends of the numbers.
            (from as u32)..(to.max(0.0) as u32).min(self.scan.columns)
        };
        [-1.0, 0.0, 1.0].map(turn).into_iter().filter(|columns| !columns.is_empty()).collect()
    }

    /// The row nearest to `elevation`.
    fn nearest(&self, elevation: f64) -> usize {
        let below = self.rows.partition_point(|row| row.elevation > elevation);
        let off = |number: &usize| (self.rows[*number].elevation - elevation).abs();
        let near = below.saturating_sub(1)..(below + 1).min(self.rows.len());
        near.min_by(|a, b| off(a).total_cmp(&off(b))).unwrap_or(0)
    }

    /// Elevations of interest to what crosses at once: of a raster the outermost row, the one an
    /// aperture's radius further in, and the middle; of a turning head every one.
    fn edges(&self, reach: f64) -> Vec<f64> {
        match (&self.scan.pattern, self.rows.first()) {
            (Pattern::Raster { .. }, Some(row)) => {
                let inside = (row.elevation - reach).max(0.0);
                vec![row.elevation, inside, 0.0]
            }
            _ => self.elevations(reach),
        }
    }

    /// Elevations at which the middle of an aperture is tried: every row and between rows, thinned
    /// out where they are many. A raster is alike above and below the horizon.
    fn elevations(&self, reach: f64) -> Vec<f64> {
        let raster = matches!(self.scan.pattern, Pattern::Raster { .. });
        let of_row = |row: &Row| row.elevation;
        let mut all: Vec<f64> = self.rows.iter().map(of_row).collect();
        let between: Vec<f64> = all.windows(2).map(|pair| (pair[0] + pair[1]) / 2.0).collect();
        all.extend(between);
        all.sort_by(|a, b| b.total_cmp(a));
        let top = all.first().copied().unwrap_or(0.0);
        let gap = 2.0 * reach / STEPS;
        let mut last = f64::INFINITY;
        all.retain(|&elevation| {
            let bottom = if raster { (top - 3.0 * reach).max(0.0) } else { -PI };
            let keep = last - elevation >= gap && elevation >= bottom - gap;
            last = if keep { elevation } else { last };
            keep
        });
        if raster {
            all.push(0.0);
        }
        all
    }

    /// About how many shots cross an aperture whose middle is at `elevation`, opposite the middle
    /// of the columns.
    fn estimate(&self, share: &Share, elevation: f64) -> f64 {
        let reach = self.reach(share);
        let field = self.step * f64::from(self.scan.columns) / 2.0;
        let mut sum = 0.0;
        let rows = &self.rows[self.rows_within(elevation, reach)];
        let stride = (rows.len() / ROWS).max(1);
        for row in rows.iter().step_by(stride) {
            let Some(half) = self.half_chord(row.elevation, elevation, reach) else { continue };
            let half = half.min(field);
            let place = |n: u32| half * (f64::from(n) + 0.5) / f64::from(SAMPLES);
            let shares =
                (0..SAMPLES).map(|n| share.at(self.off(elevation, row.elevation, place(n))));
            sum += shares.sum::<f64>() / f64::from(SAMPLES) * 2.0 * half / self.step;
        }
        sum * rows.len() as f64 / rows.len().div_ceil(stride).max(1) as f64
    }

    /// The azimuth at which most light of these rows passes, and how much; it is on a column or
    /// between two.
    fn brightest(&self, lit: &Lit) -> (f64, Aim) {
        let kernel = self.kernel(lit);
        let last = 2 * self.scan.columns - 2;
        let middle = last / 2;
        let stride = (kernel.len() / 128).max(1);
        let tried: Vec<u32> = match self.energies.alike {
            true => vec![middle, (middle + 1).min(last)],
            false => (0..=last).step_by(stride).collect(),
        };
        let mut best = (f64::NEG_INFINITY, middle);
        for place in tried {
            let light = self.light(&kernel, place);
            if light > best.0 {
                best = (light, place);
            }
        }
        let azimuth = self.first - self.step * f64::from(best.1) / 2.0;
        (best.0, Aim { azimuth, elevation: lit.elevation })
    }

    /// The share of a column's shots that passes, by how many half columns it stands from the
    /// middle of the aperture.
    fn kernel(&self, lit: &Lit) -> Vec<f64> {
        let reach = self.reach(lit.share);
        let mut kernel = Vec::new();
        for row in &self.rows[lit.rows.clone()] {
            let Some(half) = self.half_chord(row.elevation, lit.elevation, reach) else { continue };
            let half = half.min(lit.widest).min(self.step * f64::from(self.scan.columns));
            let places = (2.0 * half / self.step * (1.0 + 1e-9)) as usize + 1;
            if kernel.len() < places {
                kernel.resize(places, 0.0);
            }
            for (place, sum) in kernel.iter_mut().enumerate().take(places) {
                let off = place as f64 * self.step / 2.0;
                *sum += lit.share.at(self.off(lit.elevation, row.elevation, off));
            }
        }
        kernel
    }

    /// The light that passes an aperture `place` half columns from the first one.
    fn light(&self, kernel: &[f64], place: u32) -> f64 {
        let Some(last) = kernel.len().checked_sub(1) else { return 0.0 };
        let half = last as f64 * self.step / 2.0;
        let off = self.step * f64::from(place) / 2.0;
        let around = (TAU / self.step * 2.0).round() as i64;
        let mut light = 0.0;
        for columns in self.columns_between(off, half * (1.0 + 1e-9)) {
            for column in columns {
                let apart = (2 * i64::from(column) - i64::from(place)).abs();
                let apart = apart.min((apart - around).abs()) as usize;
                light += kernel.get(apart).copied().unwrap_or(0.0) * self.energies.at(column);
            }
        }
        light
    }
}

/// Rows whose light passes an aperture.
struct Lit<'a> {
    share: &'a Share,
    /// Of the middle of the aperture, rad.
    elevation: f64,
    rows: Range<usize>,
    /// Light from further off than this in azimuth does not matter, rad.
    widest: f64,
}

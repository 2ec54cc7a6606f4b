//! The beams of a scan, and those of them that cross an aperture.

use std::f64::consts::{PI, TAU};
use std::ops::Range;

use super::energies::Energies;
use super::exposure::Crossing;
use super::share::Share;
use super::worst::{Aim, Field, coarse_first};
use crate::design::Scan;

/// Beams in lines, each as far in azimuth from the one before it.
pub(crate) struct Lines {
    /// From the top down.
    pub rows: Vec<Line>,
    /// Angle between columns, rad, to the right.
    pub step: f64,
    /// Azimuth of the first column, rad, of a line that fires first.
    pub first: f64,
    /// Lines drawn one after another: all of them where there is one beam, and 1 where all are drawn at
    /// once. More than one are evenly spaced, and alike above and below the horizon.
    pub in_turn: u32,
    /// True if every other line is drawn from the right to the left.
    pub comes_back: bool,
}

/// A line of beams.
pub(crate) struct Line {
    /// Its elevation, rad.
    pub elevation: f64,
    /// Azimuth of its first column, rad.
    pub first: f64,
}

/// Shots that a search may look at.
const EFFORT: usize = 120_000;
/// Most beams beside one that an aperture may hold together with it. With more of them, light hardly depends
/// on the place.
const FEW: usize = 64;
/// The most beams that are paired with others to find places that two beams share. They are spread evenly over the scan.
const MOST_SHARED: usize = 4096;
/// Elevations that are tried at most.
const MOST_PLACES: f64 = 4096.0;
/// Phases of the columns that are tried at most.
const PHASES: f64 = 32.0;

/// The beams of a scan, line by line, and what they carry.
pub(super) struct LineBeams<'a> {
    pub scan: &'a Scan,
    pub lines: &'a Lines,
    pub energies: &'a Energies,
    pub share: &'a Share,
    /// Distance of the aperture, m.
    pub distance: f64,
}

impl Field for LineBeams<'_> {
    fn crossing(&self, aim: Aim) -> Vec<Crossing> {
        let mut shots = Vec::new();
        let reach = self.reach();
        let [aim_sine, aim_cosine] = [libm::sin(aim.elevation), libm::cos(aim.elevation)];
        for number in self.rows_within(aim.elevation, reach) {
            let row = &self.lines.rows[number];
            let level = aim_sine * libm::sin(row.elevation);
            let across = aim_cosine * libm::cos(row.elevation);
            for column in self.columns_within(row, aim, reach).into_iter().flatten() {
                let off = row.first - self.lines.step * f64::from(column) - aim.azimuth;
                let share = self.share.at(self.off(level + across * libm::cos(off)));
                if share > 0.0 {
                    let order = self.scan.model().order_of(number as u16, column as u16);
                    let (time, energy) =
                        (self.scan.moment(order), share * self.energies.at(column));
                    shots.push(Crossing { time, share, energy });
                }
            }
        }
        shots.sort_unstable_by(|a, b| a.time.total_cmp(&b.time));
        shots
    }

    /// In the middle of the columns, or where the brightest ones are.
    ///
    /// Columns stand closer the higher a row lies: at cos(elevation) of their distance at the horizon. Near
    /// the edge of the field less of the aperture is lit, but the columns stand closest.
    fn starts(&self, gap: f64, counted: f64) -> Vec<Aim> {
        let mut aims = Vec::new();
        for elevation in self.elevations(gap) {
            let azimuths = match self.energies.alike {
                true => self.phases(gap),
                false => self.brightest_two(elevation, counted),
            };
            aims.extend(azimuths.into_iter().map(|azimuth| Aim { azimuth, elevation }));
        }
        aims
    }

    fn shared(&self) -> Vec<Aim> {
        let Lines { step, in_turn, .. } = *self.lines;
        let reach = 2.0 * self.reach();
        // A turning head whose columns are alike is alike all around.
        let columns = match self.energies.alike && in_turn == 1 {
            true => self.scan.columns / 2..self.scan.columns / 2 + 1,
            false => 0..self.scan.columns,
        };
        let (width, rows) = (columns.len(), self.lines.rows.len());
        let mut aims = Vec::new();
        for beam in (0..rows * width).step_by((rows * width).div_ceil(MOST_SHARED).max(1)) {
            let (number, column) = (beam / width, columns.start + (beam % width) as u32);
            let row = &self.lines.rows[number];
            let azimuth = row.first - step * f64::from(column);
            let here = Aim { azimuth, elevation: row.elevation };
            let mut beside = 0;
            // Each pair once.
            for other in number..self.rows_within(row.elevation, reach).end {
                let other = &self.lines.rows[other];
                for columns in self.columns_within(other, here, reach) {
                    beside += columns.len();
                    if beside > FEW {
                        return Vec::new();
                    }
                    for column in columns {
                        let azimuth = other.first - step * f64::from(column);
                        let there = Aim { azimuth, elevation: other.elevation };
                        aims.extend(self.shared_by(here, there));
                    }
                }
            }
        }
        aims
    }

    fn grazed(&self, aim: Aim, gap: f64) -> Vec<Aim> {
        let (reach, mut aims) = (self.reach(), Vec::new());
        let mut near = 0;
        for number in self.rows_within(aim.elevation, reach + gap) {
            let row = &self.lines.rows[number];
            for column in self.columns_within(row, aim, reach + gap).into_iter().flatten() {
                near += 1;
                if near > FEW {
                    return Vec::new();
                }
                let azimuth = row.first - self.lines.step * f64::from(column);
                let aside = libm::remainder(azimuth - aim.azimuth, TAU);
                let up = row.elevation - aim.elevation;
                let apart = libm::hypot(aside * libm::cos(aim.elevation), up);
                if apart > reach {
                    // A hair within the reach.
                    let part = 1.0 - 0.999 * reach / apart;
                    aims.push(aim.moved([part * aside, part * up]));
                }
            }
        }
        aims
    }

    /// Near the ends of lines that go to and fro: there the aperture sees the end of one line and the
    /// beginning of the next at once. All around for a turning head whose columns differ.
    fn across(&self, gap: f64) -> Vec<f64> {
        let Lines { first, step, .. } = *self.lines;
        let last = first - step * f64::from(self.scan.columns - 1);
        if self.lines.comes_back {
            let ends = (0..16).map(|place| f64::from(place) * gap);
            let ends: Vec<[f64; 2]> =
                ends.map(|inwards| [first - inwards, last + inwards]).collect();
            return coarse_first(&ends).into_iter().flatten().collect();
        }
        if self.energies.alike || self.lines.in_turn > 1 {
            return Vec::new();
        }
        let stride = (gap / step).max(1.0) as usize;
        let columns: Vec<u32> = (0..self.scan.columns).step_by(stride).collect();
        coarse_first(&columns).into_iter().map(|column| first - step * f64::from(column)).collect()
    }

    fn pitch(&self, gap: f64) -> [f64; 2] {
        let Lines { step, comes_back, in_turn, .. } = *self.lines;
        let across = match () {
            () if comes_back || !self.energies.alike && in_turn == 1 => gap / 2.0,
            // A step more or less in an aperture makes less than a part in 250.
            () if step < gap / 16.0 => 0.0,
            () => step.min(gap) / 2.0,
        };
        [across, gap / 2.0]
    }

    fn effort(&self) -> usize {
        EFFORT
    }
}

impl LineBeams<'_> {
    /// Places on the way from one beam to another that both of them cross: half-way, and as near to either as the
    /// other still crosses.
    fn shared_by(&self, from: Aim, to: Aim) -> [Aim; 3] {
        let way = [to.azimuth - from.azimuth, to.elevation - from.elevation];
        let apart = libm::hypot(way[0] * libm::cos(from.elevation), way[1]);
        // A hair within the reach.
        let nearest = 1.0 - (0.99 * self.reach() / apart.max(1e-12)).min(1.0);
        [0.5, nearest, 1.0 - nearest].map(|part| from.moved(way.map(|off| part * off)))
    }

    /// Azimuths at which the columns stand otherwise in the aperture, about the middle of the field.
    fn phases(&self, gap: f64) -> Vec<f64> {
        let Lines { first, step, .. } = *self.lines;
        let middle = first - step * f64::from(self.scan.columns - 1) / 2.0;
        let phases = (step / gap).ceil().clamp(1.0, PHASES);
        (0..phases as u32).map(|phase| middle + step * f64::from(phase) / phases).collect()
    }

    /// Where, at `elevation`, most light of a whole scan crosses, and most of shots within `counted` seconds.
    fn brightest_two(&self, elevation: f64, counted: f64) -> Vec<f64> {
        let reach = self.reach();
        let rows = self.rows_within(elevation, reach);
        let mut azimuths = vec![self.brightest(&Lit { elevation, rows: rows.clone(), widest: PI })];
        if counted < self.scan.period() {
            // Half the angle of the columns that pass within the time, if that is shorter than a line takes
            // to cross.
            let line = self.scan.period() / f64::from(self.lines.in_turn);
            let widest = counted / line * f64::from(self.scan.columns) * self.lines.step / 2.0;
            let number = self.nearest(elevation);
            let rows = match self.lines.in_turn as usize == self.lines.rows.len() {
                true => number..number + 1,
                false => rows,
            };
            azimuths.push(self.brightest(&Lit { elevation, rows, widest }));
            azimuths.dedup();
        }
        azimuths
    }

    /// The angle within which a beam meets the aperture, rad.
    fn reach(&self) -> f64 {
        libm::atan(self.share.reach() / self.distance)
    }

    /// Distance in the plane of the aperture, m, between its middle and a beam at an angle of this `cosine`.
    fn off(&self, cosine: f64) -> f64 {
        match cosine {
            cosine if cosine > 0.0 => {
                self.distance * (1.0 - cosine * cosine).max(0.0).sqrt() / cosine
            }
            _ => f64::INFINITY,
        }
    }

    fn rows_within(&self, elevation: f64, reach: f64) -> Range<usize> {
        let above = |limit: f64| self.lines.rows.partition_point(|row| row.elevation > limit);
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
    fn columns_within(&self, row: &Line, aim: Aim, reach: f64) -> Vec<Range<u32>> {
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
            let column = |angle: f64| (off + turn * TAU + angle) / self.lines.step;
            let [from, to] = [column(-half).ceil(), column(half).floor() + 1.0];
            // Casts stop at the ends of the numbers.
            (from as u32)..(to.max(0.0) as u32).min(self.scan.columns)
        };
        [-1.0, 0.0, 1.0].map(turn).into_iter().filter(|columns| !columns.is_empty()).collect()
    }

    /// The row nearest to `elevation`.
    fn nearest(&self, elevation: f64) -> usize {
        let below = self.lines.rows.partition_point(|row| row.elevation > elevation);
        let off = |number: &usize| (self.lines.rows[*number].elevation - elevation).abs();
        let near = below.saturating_sub(1)..(below + 1).min(self.lines.rows.len());
        near.min_by(|a, b| off(a).total_cmp(&off(b))).unwrap_or(0)
    }

    /// Elevations at which the middle of an aperture is tried: at rows and `gap` apart. A raster is alike above
    /// and below the horizon. Its columns stand closest near its upper edge; at the horizon most rows cross.
    fn elevations(&self, gap: f64) -> Vec<f64> {
        let [Some(top), Some(bottom)] = [self.lines.rows.first(), self.lines.rows.last()] else {
            return Vec::new();
        };
        let (top, bottom) = (top.elevation, bottom.elevation);
        if self.lines.in_turn > 1 {
            let reach = self.reach();
            let lowest = (top - 3.0 * reach).max(0.0);
            let mut all = vec![top, (top - reach).max(0.0), 0.0];
            all.extend(coarse_first(&places(lowest, top, gap)));
            return all;
        }
        let mut all = places(bottom, top, gap);
        all.extend(self.lines.rows.iter().map(|row| row.elevation));
        all.sort_by(f64::total_cmp);
        all.dedup_by(|next, kept| *next - *kept < gap / 4.0);
        coarse_first(&all)
    }

    /// The azimuth at which most light of these rows passes, on a column or between two.
    fn brightest(&self, lit: &Lit) -> f64 {
        let kernel = self.kernel(lit);
        let last = 2 * self.scan.columns - 2;
        let middle = last / 2;
        let stride = (kernel.len() / 128).max(1);
        let mut best = (f64::NEG_INFINITY, middle);
        for place in (0..=last).step_by(stride) {
            let light = self.light(&kernel, place);
            if light > best.0 {
                best = (light, place);
            }
        }
        self.lines.first - self.lines.step * f64::from(best.1) / 2.0
    }

    /// The share of a column's shots that passes, by how many half columns it stands from the
    /// middle of the aperture.
    fn kernel(&self, lit: &Lit) -> Vec<f64> {
        let reach = self.reach();
        let mut kernel = Vec::new();
        for row in &self.lines.rows[lit.rows.clone()] {
            let Some(half) = self.half_chord(row.elevation, lit.elevation, reach) else { continue };
            let half = half.min(lit.widest).min(self.lines.step * f64::from(self.scan.columns));
            let places = (2.0 * half / self.lines.step * (1.0 + 1e-9)) as usize + 1;
            if kernel.len() < places {
                kernel.resize(places, 0.0);
            }
            let level = libm::sin(lit.elevation) * libm::sin(row.elevation);
            let across = libm::cos(lit.elevation) * libm::cos(row.elevation);
            for (place, sum) in kernel.iter_mut().enumerate().take(places) {
                let off = libm::cos(place as f64 * self.lines.step / 2.0);
                *sum += self.share.at(self.off(level + across * off));
            }
        }
        kernel
    }

    /// The light that passes an aperture `place` half columns from the first one.
    fn light(&self, kernel: &[f64], place: u32) -> f64 {
        let Some(last) = kernel.len().checked_sub(1) else { return 0.0 };
        let half = last as f64 * self.lines.step / 2.0;
        let off = self.lines.step * f64::from(place) / 2.0;
        let around = (TAU / self.lines.step * 2.0).round() as i64;
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

/// Elevations from `lowest` to `highest`, about `gap` apart.
fn places(lowest: f64, highest: f64, gap: f64) -> Vec<f64> {
    let steps = ((highest - lowest) / gap).ceil().clamp(1.0, MOST_PLACES);
    let place = |step: u32| lowest + (highest - lowest) * f64::from(step) / steps;
    (0..=steps as u32).map(place).collect()
}

/// Rows whose light passes an aperture.
struct Lit {
    /// Elevation of the middle of the aperture, rad.
    elevation: f64,
    rows: Range<usize>,
    /// Light from further off than this in azimuth does not matter, rad.
    widest: f64,
}

//! The beams of a scan, and those of them that cross an aperture.

use std::f64::consts::{PI, TAU};
use std::ops::Range;

use super::crossing::Energies;
use super::exposure::Crossing;
use super::share::Share;
use crate::design::Scan;

/// Places along an aperture at which its middle is tried, where many pixels lie in it.
const STEPS: f64 = 16.0;
/// How finely the light that passes an aperture is estimated.
#[derive(Clone, Copy)]
struct Fineness {
    /// Places along a line.
    places: u32,
    /// Lines.
    lines: usize,
}
/// To find the elevations where there is most.
const COARSE: Fineness = Fineness { places: 16, lines: 32 };
/// To refine one.
const FINE: Fineness = Fineness { places: 64, lines: 256 };
/// Where so many shots cross, it does not matter whether the middle is on a pixel or between two.
const MANY: f64 = 400.0;
/// Elevations that are looked at in all columns.
const FINALISTS: usize = 3;
/// Up to so many shots that cross, an aim is refined by their sum, and else by its estimate: at
/// 5000 shots in a sharp aperture the phase of the pixels still changes the sum by 3 in 1000.
const FEW: usize = 12_000;
/// Times the steps are halved by which an aim is refined: elevations to a thousandth of the
/// aperture.
const HALVINGS: u32 = 6;

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
}

/// A line of beams.
pub(crate) struct Line {
    /// Its elevation, rad.
    pub elevation: f64,
    /// Azimuth of its first column, rad.
    pub first: f64,
}

/// Where the middle of an aperture is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Aim {
    pub azimuth: f64,
    pub elevation: f64,
}

/// The beams of a scan, line by line, and what they carry.
pub(super) struct LineBeams<'a> {
    scan: &'a Scan,
    energies: &'a Energies,
    distance: f64,
    lines: Lines,
}

impl<'a> LineBeams<'a> {
    /// The beams of `scan` in its `lines`, at the `distance` of an eye, m.
    pub fn new(scan: &'a Scan, lines: Lines, energies: &'a Energies, distance: f64) -> Self {
        Self { scan, energies, distance, lines }
    }

    /// The shots that cross an aperture with its middle at `aim`, in the order of their times.
    pub fn crossing(&self, share: &Share, aim: Aim) -> Vec<Crossing> {
        let mut shots = Vec::new();
        self.for_each_crossing(share, aim, |[row, column], share| {
            let order = self.scan.model().order_of(row as u16, column as u16);
            let (time, energy) = (self.scan.moment(order), share * self.energies.at(column));
            shots.push(Crossing { time, share, energy });
        });
        shots.sort_unstable_by(|a, b| a.time.total_cmp(&b.time));
        shots
    }

    /// Calls `visit` with row and column of every shot that crosses an aperture with its middle at
    /// `aim`, and the share of its light that passes.
    fn for_each_crossing(&self, share: &Share, aim: Aim, mut visit: impl FnMut([u32; 2], f64)) {
        let reach = self.reach(share);
        for number in self.rows_within(aim.elevation, reach) {
            let row = &self.lines.rows[number];
            for columns in self.columns_within(row, aim, reach) {
                for column in columns {
                    let off = row.first - self.lines.step * f64::from(column) - aim.azimuth;
                    let share = share.at(self.off(aim.elevation, row.elevation, off));
                    if share > 0.0 {
                        visit([number as u32, column], share);
                    }
                }
            }
        }
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
            .map(|elevation| (self.estimate(share, elevation, COARSE), elevation))
            .collect();
        tried.sort_by(|a, b| b.0.total_cmp(&a.0));
        let most = tried.iter().take(FINALISTS).map(|&(shots, elevation)| {
            if self.energies.alike && shots > MANY {
                let azimuth = self.lines.first - self.lines.step * f64::from(self.scan.columns / 2);
                return (shots, Aim { azimuth, elevation });
            }
            let rows = self.rows_within(elevation, reach);
            self.brightest(&Lit { share, elevation, rows, widest: PI })
        });
        let most = most.max_by(|a, b| a.0.total_cmp(&b.0));
        let mut aims: Vec<Aim> =
            most.map(|(_, aim)| self.refined(share, aim)).into_iter().collect();
        if counted >= self.scan.period() {
            return aims;
        }
        // So many columns pass within the time, if that is shorter than a line takes to cross.
        let line = self.scan.period() / f64::from(self.lines.in_turn);
        let widest = counted / line * f64::from(self.scan.columns) * self.lines.step / 2.0;
        for elevation in self.edges(reach) {
            let number = self.nearest(elevation);
            let elevation = self.lines.rows[number].elevation;
            let rows = match self.lines.in_turn as usize == self.lines.rows.len() {
                true => number..number + 1,
                false => self.rows_within(elevation, reach),
            };
            aims.push(self.brightest(&Lit { share, elevation, rows, widest }).1);
        }
        aims
    }

    /// The aim at which most light passes near `aim`: from there in steps that are halved, as far
    /// as it is more. Before, elevations are tried a sixteenth of the aperture apart and azimuths
    /// half a column.
    ///
    /// The sum over a few pixels goes up and down with their phase; that over many is smooth, and
    /// then it is estimated, and depends on the elevation alone.
    fn refined(&self, share: &Share, aim: Aim) -> Aim {
        let mut shots = 0;
        self.for_each_crossing(share, aim, |_, _| shots += 1);
        let few = shots <= FEW;
        let light = |aim: Aim| {
            if !few {
                return self.estimate(share, aim.elevation, FINE);
            }
            let mut light = 0.0;
            self.for_each_crossing(share, aim, |[_, column], share| {
                light += share * self.energies.at(column);
            });
            light
        };
        let mut best = (light(aim), aim);
        let mut steps = [self.lines.step / 2.0, 2.0 * self.reach(share) / STEPS];
        let sides = [[0.0, 1.0], [0.0, -1.0], [1.0, 0.0], [-1.0, 0.0]];
        for _ in 0..HALVINGS {
            steps = steps.map(|step| step / 2.0);
            for [across, up] in sides.into_iter().take(if few { 4 } else { 2 }) {
                let Aim { azimuth, elevation } = best.1;
                let aim = Aim {
                    azimuth: azimuth + across * steps[0],
                    elevation: elevation + up * steps[1],
                };
                let light = light(aim);
                if light > best.0 {
                    best = (light, aim);
                }
            }
        }
        best.1
    }

    /// The angle within which a beam meets the aperture, rad.
    fn reach(&self, share: &Share) -> f64 {
        libm::atan(share.reach() / self.distance)
    }

    /// Whether it is a raster.
    fn is_raster(&self) -> bool {
        self.lines.in_turn > 1
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

    /// Elevations of interest to what crosses at once: of a raster the outermost row, the one an
    /// aperture's radius further in, and the middle; of a turning head every one.
    fn edges(&self, reach: f64) -> Vec<f64> {
        match self.lines.rows.first().filter(|_| self.is_raster()) {
            Some(row) => {
                let inside = (row.elevation - reach).max(0.0);
                vec![row.elevation, inside, 0.0]
            }
            None => self.elevations(reach),
        }
    }

    /// Elevations at which the middle of an aperture is tried: every row and between rows, thinned
    /// out where they are many. A raster is alike above and below the horizon.
    fn elevations(&self, reach: f64) -> Vec<f64> {
        let raster = self.is_raster();
        let of_row = |row: &Line| row.elevation;
        let mut all: Vec<f64> = self.lines.rows.iter().map(of_row).collect();
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
    fn estimate(&self, share: &Share, elevation: f64, fineness: Fineness) -> f64 {
        let Fineness { places, lines } = fineness;
        let reach = self.reach(share);
        let field = self.lines.step * f64::from(self.scan.columns) / 2.0;
        let mut sum = 0.0;
        let rows = &self.lines.rows[self.rows_within(elevation, reach)];
        let stride = (rows.len() / lines).max(1);
        for row in rows.iter().step_by(stride) {
            let Some(half) = self.half_chord(row.elevation, elevation, reach) else { continue };
            let half = half.min(field);
            let place = |n: u32| half * (f64::from(n) + 0.5) / f64::from(places);
            let shares =
                (0..places).map(|n| share.at(self.off(elevation, row.elevation, place(n))));
            sum += shares.sum::<f64>() / f64::from(places) * 2.0 * half / self.lines.step;
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
        let azimuth = self.lines.first - self.lines.step * f64::from(best.1) / 2.0;
        (best.0, Aim { azimuth, elevation: lit.elevation })
    }

    /// The share of a column's shots that passes, by how many half columns it stands from the
    /// middle of the aperture.
    fn kernel(&self, lit: &Lit) -> Vec<f64> {
        let reach = self.reach(lit.share);
        let mut kernel = Vec::new();
        for row in &self.lines.rows[lit.rows.clone()] {
            let Some(half) = self.half_chord(row.elevation, lit.elevation, reach) else { continue };
            let half = half.min(lit.widest).min(self.lines.step * f64::from(self.scan.columns));
            let places = (2.0 * half / self.lines.step * (1.0 + 1e-9)) as usize + 1;
            if kernel.len() < places {
                kernel.resize(places, 0.0);
            }
            for (place, sum) in kernel.iter_mut().enumerate().take(places) {
                let off = place as f64 * self.lines.step / 2.0;
                *sum += lit.share.at(self.off(lit.elevation, row.elevation, off));
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

/// Rows whose light passes an aperture.
struct Lit<'a> {
    share: &'a Share,
    /// Of the middle of the aperture, rad.
    elevation: f64,
    rows: Range<usize>,
    /// Light from further off than this in azimuth does not matter, rad.
    widest: f64,
}

//! Pulse trains of interferers at the aperture (docs/physics.md#other-lidars).
//!
//! 1. The receiver listens from the firing of each shot to the end of its range gate. In that time light
//!    arrives from shots that interferers fired earlier, by at most the time in which light is followed,
//!    there and back. A detector of its own pixel listens to its own shot alone.
//! 2. By reflection: from each point that a ray of an interferer meets and a listening detector
//!    looks at ([`Illuminated`]), with the photons
//!
//!    n = K · ρ_eff · w · exp(−σ·(R₁ + R₂)) / R₂²
//!
//!    K those of white at one metre ([`Link::of_interferer`]), R₁ the way there and R₂ the way back.
//! 3. Directly: a beam of 1/e² radius b whose axis passes the aperture, of radius a, at a distance
//!    r brings
//!
//!    n = K · exp(−r²/s²) · exp(−σ·D) / s², s² = a² + b²/2
//!
//!    b = d/2 + D·θ/2 for a beam of diameter d and divergence θ that begins D metres away. The radius a is
//!    that of the sensor's link budget, if it has one ([`aperture_radius`]). The edge of the aperture is
//!    taken to be Gaussian, so the formula holds for beams both narrower and wider than the aperture.
//!
//! Light without pulses becomes stretches of background instead, one for each exposure or ramp.
//!
//! All of it is where it is when the shot is fired.

use std::f64::consts::PI;
use std::ops::Range;

use super::light::address;
use super::sent::{Part, Sent};
use super::{ALL_MARKS, Background, Light, Link, PulseTrain, PulseTrains, Stretch};
use crate::design::{Design, Field};
use crate::emit::shot_at;
use crate::scene::{Ends, Finish, Illuminated, LineOfSight, Mount, Pair, Ray, Scene};
use crate::units::{SPEED_OF_LIGHT, fs_from_s, s_from_fs, tof_from_range};
use macropulse_codec::ShotLog;

/// Radius of the aperture of a sensor without a link budget, m: what its file leaves unsaid.
pub const APERTURE_RADIUS: f64 = 12.5e-3;

/// Light that brings fewer photons per mark is left out.
const FAINTEST: f64 = 1e-6;

/// Beams whose axis passes the aperture at more than this multiple of s are left out.
const FARTHEST_BY: f64 = 4.0;

/// A micropulse ends this multiple of its length before and after its middle.
const FLANKS: f64 = 4.0;

/// Number of the direct way; those before it are the rays of a footprint.
const DIRECT: u32 = 31;

/// Adds the light of the transmitter of this `number` that reaches the sensor of its `pair` while that listens to
/// the shots of `log`.
pub(super) fn add(
    light: &mut Light<'_>,
    number: u16,
    pair: Pair<'_>,
    scene: &Scene,
    log: &ShotLog,
) {
    let (design, other) = (pair.to.design, pair.from.design);
    let Some(link) = Link::of_interferer(design, other, &scene.environment) else { return };
    let view = View::of(design, log, &pair.from);
    let sent = Sent::by(&pair.from, design);
    let farthest = design.scan.light_range.max(other.scan.light_range);
    let mut direct = Direct::of(scene, pair, 2.0 * farthest);
    let finishes = scene.finishes(other.light.wavelength);
    let longest_fs = fs_from_s(tof_from_range(farthest));
    for open in view.listening() {
        let mut arrivals = Arrivals {
            transmitter: number,
            link,
            view: &view,
            sent: &sent,
            open: open.clone(),
            trains: &mut light.trains,
            background: &mut light.background,
        };
        for theirs in pair.from.begins.shots(other, open.start - longest_fs..open.end) {
            let look = |shot: usize, direction, way: f64| {
                let arrives_fs = theirs.fired_at_fs[shot] + fs_from_s(way / SPEED_OF_LIGHT);
                if !open.contains(&arrives_fs) {
                    return None;
                }
                view.pixel(direction, arrives_fs)
            };
            let lit = scene.illuminated(pair, &theirs, farthest, &look);
            arrivals.add_reflected(&finishes, &theirs, &lit);
            arrivals.add_direct(&mut direct, &theirs, &look);
        }
    }
}

/// Radius of the aperture of `ours`, m. Without a link budget its receiver is taken to be like that of the
/// `other` lidar, and if that has none either the aperture is [`APERTURE_RADIUS`].
fn aperture_radius(ours: &Design, other: &Design) -> f64 {
    let known = ours.budget.as_ref().or(other.budget.as_ref());
    known.map_or(APERTURE_RADIUS, |budget| budget.aperture / 2.0)
}

/// How long light may arrive before and after the first chip of a shot, fs: the micropulse has some
/// before it, and behind the last chip.
fn around_fs(other: &Mount<'_>) -> (i64, i64) {
    let Design { emission, light, .. } = other.design;
    let length = emission.length_fs() as f64;
    let micropulse = fs_from_s(FLANKS * light.pulse);
    (micropulse, (length * other.begins.stretch()) as i64 + micropulse)
}

/// The pixels of a sensor, and the times at which their detectors receive light.
struct View<'a> {
    design: &'a Design,
    log: &'a ShotLog,
    /// Times, fs, by which light begins before its first chip and ends after it.
    around_fs: (i64, i64),
    /// How long light without pulses shines, fs; 0 of pulses.
    shines_fs: i64,
    /// Squared chord of the unit sphere to the edge of a field about its axis.
    edge: f64,
}

impl<'a> View<'a> {
    /// The pixels of `design` while it fires the shots of `log`, as the `other` lidar shines.
    fn of(design: &'a Design, log: &'a ShotLog, other: &Mount<'_>) -> Self {
        let around_fs = around_fs(other);
        let shines_fs = if other.design.emission.is_pulsed() { 0 } else { around_fs.1 };
        let [width, height] = design.scan.model().cell();
        let angle = (width * height / PI).sqrt();
        let edge = (2.0 * libm::sin(angle / 2.0)).powi(2);
        Self { design, log, around_fs, shines_fs, edge }
    }

    /// The times at which first chips may arrive whose light is received, fs. Ascending, and apart.
    fn listening(&self) -> Vec<Range<i64>> {
        let jitter_fs = self.design.most_jitter_fs();
        let mut open: Vec<Range<i64>> = Vec::new();
        for shot in 0..self.log.len() {
            let Range { start, end } = self.gate(shot);
            let span = start - jitter_fs..end + jitter_fs;
            match open.last_mut() {
                Some(last) if span.start <= last.end => last.end = span.end,
                _ => open.push(span),
            }
        }
        open
    }

    /// The times at which first chips may arrive that are received with a shot, fs.
    fn gate(&self, shot: usize) -> Range<i64> {
        let (before, after) = self.around_fs;
        let fired_fs = self.log.fired_at_fs[shot];
        fired_fs - after..fired_fs + self.design.listening_fs() + before
    }

    /// The pixel that receives light from the unit vector `direction` in the frame of the sensor, if its first
    /// chip arrives at `arrives_fs`.
    fn pixel(&self, direction: [f64; 3], arrives_fs: i64) -> Option<(u16, u16)> {
        if self.design.scan.has_image() {
            let pixel = self.design.scan.pixel_at(direction)?;
            return self.receives(pixel, arrives_fs).then_some(pixel);
        }
        self.nearest(direction, arrives_fs)
    }

    /// The pixel of the shot whose axis is nearest to `direction`, of a pattern whose field of view follows the
    /// beam. The field is a cone about the axis, with the solid angle of a cell.
    fn nearest(&self, direction: [f64; 3], arrives_fs: i64) -> Option<(u16, u16)> {
        let fired_at_fs = &self.log.fired_at_fs;
        let first = fired_at_fs.partition_point(|fired_fs| {
            fired_fs + self.design.listening_fs() + self.around_fs.0 <= arrives_fs
        });
        let mut nearest = (self.edge, None);
        for shot in (first..self.log.len()).take_while(|&shot| self.gate(shot).start <= arrives_fs)
        {
            let axis = self.design.directions().of_shot(self.log, shot);
            let chord = (0..3).map(|i| (axis[i] - direction[i]).powi(2)).sum::<f64>();
            let pixel = (self.log.row[shot], self.log.column[shot]);
            if chord < nearest.0 && self.receives(pixel, arrives_fs) {
                nearest = (chord, Some(pixel));
            }
        }
        nearest.1
    }

    /// Tells if the detector of `pixel` receives light whose first chip arrives at `arrives_fs`. A detector that
    /// all pixels share always does, unless its field of view follows the beam and is not at the pixel.
    fn receives(&self, pixel: (u16, u16), arrives_fs: i64) -> bool {
        let shot = || shot_at(self.design, self.log, pixel);
        if let Some(field) = self.following() {
            return shot().is_some_and(|shot| {
                let since_fs = arrives_fs - self.log.fired_at_fs[shot];
                since_fs + self.shines_fs >= 0 && field.share(s_from_fs(since_fs.max(0))) > 0.0
            });
        }
        self.design.channels() == 1
            || shot().is_some_and(|shot| self.gate(shot).contains(&arrives_fs))
    }

    /// The field of view, if it follows the beam.
    fn following(&self) -> Option<Field> {
        let field = self.design.budget.as_ref().map(|budget| budget.field);
        field.filter(|field| field.co_scanned.is_some())
    }

    /// When the detector of `pixel` sees light without pulses from there, fs.
    fn sees(&self, pixel: (u16, u16)) -> Range<i64> {
        let always = i64::MIN..i64::MAX;
        let Some(co_scanned) = self.following().and_then(|field| field.co_scanned) else {
            return always;
        };
        shot_at(self.design, self.log, pixel).map_or(always, |shot| {
            let fired_fs = self.log.fired_at_fs[shot];
            fired_fs..fired_fs + fs_from_s(co_scanned.pixels * co_scanned.pixel_period)
        })
    }

    /// The channel whose detector sees `pixel`.
    fn channel(&self, pixel: (u16, u16)) -> u16 {
        match self.design.channels() {
            1 => 0,
            _ => shot_at(self.design, self.log, pixel).map_or(0, |shot| self.log.channel[shot]),
        }
    }
}

/// The aperture of the sensor as the beams of another lidar see it, one after the other.
struct Direct<'a> {
    scene: &'a Scene,
    pair: Pair<'a>,
    aperture: f64,
    farthest: f64,
    /// Poses of both lidars.
    ends: Ends,
    /// Start of the beam, in the frame of the other, m.
    begin: [f64; 3],
    /// The way from there; `None` if it is too long.
    sight: Option<Sight>,
}

/// From where a beam begins to the aperture.
struct Sight {
    /// Unit vector in the frame of the other.
    direction: [f64; 3],
    distance: f64,
    /// From the aperture back to where the beam begins, in the world.
    back: Ray,
    /// The same way in the frame of the sensor.
    looks: [f64; 3],
    /// a² + b²/2, m².
    spread: f64,
}

impl<'a> Direct<'a> {
    fn of(scene: &'a Scene, pair: Pair<'a>, farthest: f64) -> Self {
        let aperture = aperture_radius(pair.to.design, pair.from.design);
        let (ends, begin) = (pair.at(0), [0.0; 3]);
        let direct = Self { scene, pair, aperture, farthest, ends, begin, sight: None };
        Self { sight: direct.sight(), ..direct }
    }

    /// Goes on to a beam that leaves at `time_fs` and begins at this place in the frame of the other.
    fn go_on(&mut self, time_fs: i64, begin: [f64; 3]) {
        match self.pair.moves() {
            true => self.ends = self.pair.at(time_fs),
            false if begin == self.begin => return,
            false => {}
        }
        self.begin = begin;
        self.sight = self.sight();
    }

    fn sight(&self) -> Option<Sight> {
        let Ends { from, to } = &self.ends;
        let (begins, origin) = (from.to_world.point(self.begin), to.position);
        let way = [0, 1, 2].map(|axis| begins[axis] - origin[axis]);
        let distance = way.iter().map(|part| part * part).sum::<f64>().sqrt();
        if !(self.aperture..=self.farthest).contains(&distance) {
            return None;
        }
        let towards = way.map(|part| part / distance);
        let light = &self.pair.from.design.light;
        let radius = light.beam_diameter / 2.0 + distance * light.divergence / 2.0;
        Some(Sight {
            direction: from.from_world.direction(towards.map(|part| -part)),
            distance,
            back: Ray { origin, direction: towards },
            looks: to.from_world.direction(towards),
            spread: self.aperture.powi(2) + radius * radius / 2.0,
        })
    }
}

impl Sight {
    /// Photons per mark of a shot along the unit vector `axis`, in the frame of the other, if nothing is in
    /// its way.
    fn photons(&self, link: &Link, axis: [f64; 3]) -> f64 {
        let [x, y, z] = axis;
        let [u, v, w] = self.direction;
        if x * u + y * v + z * w <= 0.0 {
            return 0.0;
        }
        let across = [y * w - z * v, z * u - x * w, x * v - y * u];
        let beside = across.iter().map(|part| part * part).sum::<f64>() * self.distance.powi(2);
        if beside > FARTHEST_BY.powi(2) * self.spread {
            return 0.0;
        }
        let share = libm::exp(-beside / self.spread) / self.spread;
        link.photons_by((self.distance, 1.0), share)
    }
}

/// Makes pulse trains and stretches of the light of one interferer.
struct Arrivals<'a> {
    transmitter: u16,
    link: Link,
    view: &'a View<'a>,
    /// Each pulse of a burst becomes a train of its own, and each part of other light a stretch.
    sent: &'a Sent,
    /// When first chips may arrive, fs.
    open: Range<i64>,
    trains: &'a mut PulseTrains,
    background: &'a mut Background,
}

impl Arrivals<'_> {
    /// Adds light of the shots in `log` that surfaces with these `finishes` reflect.
    fn add_reflected(&mut self, finishes: &[Finish], log: &ShotLog, lit: &Illuminated) {
        for i in 0..lit.shot.len() {
            let finish = &finishes[usize::from(lit.material[i])];
            let cosines = [lit.cosine[i], lit.half_cosine[i]].map(f64::from);
            let reflectance = finish.scatter(cosines[0], cosines[1]) * f64::from(lit.weight[i]);
            let way = lit.there[i] + lit.back[i];
            let photons = self.link.photons_by((way, lit.back[i]), reflectance);
            self.add((log, lit.shot[i] as usize), lit.ray[i], (way, photons), lit.pixel[i]);
        }
    }

    /// Adds light of the shots in `log` that shine into the aperture while the sensor looks back along
    /// the line of sight `look`.
    fn add_direct(&mut self, direct: &mut Direct<'_>, log: &ShotLog, look: &LineOfSight) {
        let directions = direct.pair.from.design.directions();
        for shot in 0..log.len() {
            let time_fs = log.fired_at_fs[shot];
            direct.go_on(time_fs, directions.origin(log.row[shot], log.column[shot]));
            let Some(sight) = &direct.sight else { continue };
            let photons = sight.photons(&self.link, directions.of_shot(log, shot));
            if photons > 0.0
                && let Some(pixel) = look(shot, sight.looks, sight.distance)
                && direct.scene.sees(&sight.back, sight.distance, time_fs)
            {
                self.add((log, shot), DIRECT, (sight.distance, photons), pixel);
            }
        }
    }

    /// Adds the light of a shot that arrives after a way of `way` metres.
    fn add(
        &mut self,
        (log, shot): (&ShotLog, usize),
        ray: u32,
        (way, photons): (f64, f64),
        pixel: (u16, u16),
    ) {
        if photons < FAINTEST {
            return;
        }
        let channel = self.view.channel(pixel);
        let first_fs = log.fired_at_fs[shot] + fs_from_s(way / SPEED_OF_LIGHT);
        let (count, interval_fs) = match self.sent {
            Sent::Pulses { count, interval_fs } => (*count, *interval_fs),
            Sent::Parts(parts) => {
                let shot = log.first.wrapping_add(shot as u64).wrapping_mul(parts.len() as u64);
                let address = address((self.transmitter, ray as u16), shot);
                return self.add_parts(parts, (pixel, first_fs), (photons, address));
            }
        };
        let train = PulseTrain {
            transmitter: self.transmitter,
            channel,
            arrives_fs: first_fs,
            photons,
            label: log.label[shot],
            word: log.word[shot],
            marks: ALL_MARKS,
            shot: log.first.wrapping_add(shot as u64),
            way: ray as u16,
        };
        for pulse in 0..count {
            let arrives_fs = first_fs + (pulse as f64 * interval_fs) as i64;
            if self.open.contains(&arrives_fs) {
                let shot = train.shot.wrapping_mul(count).wrapping_add(pulse);
                self.trains.push(PulseTrain { arrives_fs, shot, ..train });
            }
        }
    }

    /// Adds light without pulses that begins to arrive at `first_fs`, as far as the detector of `pixel` sees it.
    /// The parts have `address` and those behind it.
    fn add_parts(
        &mut self,
        parts: &[Part],
        (pixel, first_fs): ((u16, u16), i64),
        (photons, address): (f64, u64),
    ) {
        let channel = self.view.channel(pixel);
        let sees = self.view.sees(pixel);
        let (before, after) = self.view.around_fs;
        for (address, part) in (address..).zip(parts) {
            let begins_fs = first_fs + part.from_fs;
            let from_fs = begins_fs.max(sees.start);
            let until_fs = (first_fs + part.until_fs).min(sees.end);
            let is_heard = from_fs < self.open.end - before && until_fs > self.open.start + after;
            if is_heard && from_fs < until_fs {
                let per_s = photons * part.per_s;
                let varies = part.varies.from(s_from_fs(from_fs - begins_fs));
                self.background.push(Stretch {
                    channel,
                    from_fs,
                    until_fs,
                    per_s,
                    varies,
                    address,
                });
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::environment::Environment;
    use std::path::Path;

    /// Light of a lidar of 5 x 5 single pulses 50 m ahead that looks at us, in a scene with `more`.
    fn light(sensor: &str, more: &str) -> PulseTrains {
        let text = format!(
            "version = 1\nenvironment = \"vacuum-dark\"\n[[interferers]]\nsensor = \"hdl-64e\"\n\
             position_m = [50, 0, 0]\n\
             yaw_deg = 180\nset = {{ scan.scans_per_s = 1000, scan.raster = {{ rows = 5, \
             columns = 5, horizontal_deg = 10, vertical_deg = 10 }} }}\n{more}"
        );
        let scene = Scene::from_toml(&text, "test", Path::new("")).unwrap();
        let design = Design::open(sensor, &[]).unwrap();
        // 20 lines: 0.7 ms, in which all but the last few of its shots are fired.
        let log = crate::emit::Band { scan: 0, first: 0, shots: 20 * 848 }.shot_log(&design);
        let mut light = Light::default();
        let rig = scene.rig(&design);
        let pair = Pair { from: rig.mounts[1], to: rig.mounts[0] };
        add(&mut light, 1, pair, &scene, &log);
        assert!(light.trains.transmitter.iter().all(|transmitter| *transmitter == 1));
        light.trains
    }

    /// Known answer: shot 12 of 25 flies along the axis, is fired at 480 µs, and all of it enters
    /// the aperture: K photons from white at one metre are K/a² in it.
    #[test]
    fn a_beam_that_meets_the_aperture_enters_it_as_a_whole() {
        let direct = light("kim-park-2016", "");
        assert_eq!((direct.len(), direct.marks[0]), (1, ALL_MARKS));
        assert_eq!(direct.shot[0], 12);
        let flight = fs_from_s(50.0 / SPEED_OF_LIGHT);
        assert_eq!(direct.arrives_fs[0], 480_000_000_000 + flight);
        let hdl = Design::open("hdl-64e", &[]).unwrap();
        let dark = Environment::vacuum_dark();
        let white = Link::of(&hdl, &dark).photons(1.0, 1.0);
        approx::assert_relative_eq!(
            direct.photons[0],
            white / APERTURE_RADIUS.powi(2),
            max_relative = 1e-9
        );
    }

    #[test]
    fn a_beam_aside_or_behind_something_or_of_another_colour_does_not() {
        let aside = "[[object]]\nname = \"pole\"\nshape = { box = { size_m = [0.1, 1, 1] } }\n";
        let pole = |place: &str| format!("{aside}position_m = {place}\n");
        assert_eq!(light("kim-park-2016", &pole("[30, 0, 0]")).len(), 0);
        assert_eq!(light("kim-park-2016", &pole("[30, 9, 0]")).len(), 1);
        // Turned by 2.5 degrees it passes us by 2 m; the sensor of 1570 nm has another filter.
        assert_eq!(light("kim-park-2016", "pitch_deg = 1\n").len(), 0);
        assert_eq!(light("peregrine", "").len(), 0);
    }

    #[test]
    fn an_interferer_without_a_declared_energy_is_taken_to_be_like_the_sensor() {
        let open = |name: &str, set: &[(&str, &str)]| {
            let own = |&(key, value): &(&str, &str)| (key.to_owned(), value.to_owned());
            Design::open(name, &set.iter().map(own).collect::<Vec<_>>()).unwrap()
        };
        let perfect = [("detector.photon-counting.sensitivity.pd", "1.0")];
        let (seeing, all) = (open("kim-park-2016", &[]), open("kim-park-2016", &perfect));
        let hdl = open("hdl-64e", &[]);
        let dark = Environment::vacuum_dark();
        let photons = |ours: &Design, other: &Design| {
            Link::of_interferer(ours, other, &dark).map(|link| link.photons_by((2.0, 1.0), 1.0))
        };
        let own = Link::of(&seeing, &dark).photons(1.0, 1.0);
        assert_eq!(photons(&seeing, &seeing), Some(own));
        assert_eq!(photons(&seeing, &all), Some(own));
        assert_eq!(photons(&all, &seeing), Some(f64::INFINITY));
        assert_eq!(photons(&seeing, &hdl), Some(Link::of(&hdl, &dark).photons(1.0, 1.0)));
        assert_eq!(photons(&seeing, &open("peregrine", &[])), None);
    }

    #[test]
    fn gates_far_apart_are_listened_to_one_by_one() {
        let design =
            Design::open("hdl-64e", &[("scan.scans_per_s".into(), "0.01".into())]).unwrap();
        let log = crate::emit::Band { scan: 0, first: 0, shots: 3 }.shot_log(&design);
        let scene = Scene::from_toml("version = 1", "test", Path::new("")).unwrap();
        let open = View::of(&design, &log, &scene.rig(&design).mounts[0]).listening();
        assert_eq!(open.len(), 3);
        assert!(open.iter().zip(&log.fired_at_fs).all(|(open, fired)| open.contains(fired)));
        let close = Design::open("kim-park-2016", &[]).unwrap();
        let log = crate::emit::Band { scan: 0, first: 0, shots: 3 }.shot_log(&close);
        assert_eq!(View::of(&close, &log, &scene.rig(&close).mounts[0]).listening().len(), 1);
    }
}

//! Light that reaches the aperture, from surfaces and interferers.
//!
//! For an extended Lambertian target that the beam does not overfill, the energy received is
//!
//! E_r = E_t · ρ · cos i · A_r · η · T² / (π · R²), T = exp(−σ·R)   (docs/physics.md#link-equation)
//!
//! A sensor declared by its sensitivity knows the product E_t · A_r · η / π through the photons n₀
//! it detects per mark from a reference target (ρ₀, R₀), so that
//!
//! n = n₀ · (ρ_eff / ρ₀) · (R₀ / R)² · T² · w
//!
//! are detected, and n over the efficiency of its detector reach it. Here ρ_eff is the backscatter of the
//! material towards the sensor, and w the share of the beam that meets it. A sensor with a link budget has n₀
//! from it, for a white target at its rated range. If its field of view is scanned with the beam, the share
//! of the spot that is still in the field when the echo arrives is a factor, too.

mod interferers;
mod light;
mod link;
mod operating;
mod response;
mod sent;
mod speckle;
mod varies;

pub use interferers::APERTURE_RADIUS;
pub use light::{ALL_MARKS, Background, Light, PulseTrain, PulseTrains, Stretch, Transmitter};
pub use link::{FILTER, Link};
pub use operating::{Error, Idealised, Operating, idealised};
pub use response::Response;
pub use speckle::Speckle;
pub use varies::Varies;

use macropulse_codec::ShotLog;

use crate::design::Design;
use crate::random::Chance;
use crate::scene::{Finish, Hits, Mount, Pair, SUB_MACROPULSES, Scene, Traced};
use crate::units::{fs_from_s, tof_from_range, tof_fs_from_ranges};

/// A sensor in a scene, at work in the environment of the scene.
#[derive(Debug, Clone, Copy)]
pub struct Seen<'a> {
    /// The sensor.
    pub design: &'a Design,
    /// The scene that it looks at.
    pub scene: &'a Scene,
    /// Conditions that follow from the sensor and the environment of the scene.
    pub operating: &'a Operating,
    /// The random numbers of the run.
    pub chance: Chance,
}

/// The light that reaches a sensor while it listens to the shots of `log`, which have met `traced`.
pub fn light<'a>(seen: &Seen<'a>, log: &ShotLog, traced: &Traced) -> Light<'a> {
    let Seen { design, scene, operating, chance } = *seen;
    let rig = scene.rig(design);
    let transmitter = |mount: &Mount<'a>| Transmitter::of(mount.design, mount.begins.stretch());
    let mut light = Light {
        transmitters: rig.mounts.iter().map(transmitter).collect(),
        background: Background { steady: operating.sunlight, ..Background::default() },
        ..Light::default()
    };
    let finishes = scene.finishes(design.light.wavelength);
    let surfaces = (&operating.link, &*finishes);
    let speckled = Speckle::simulated(design).map(|speckle| (speckle, chance));
    match traced.sub_macropulses.as_slice() {
        [] => echoes(&mut light.trains, surfaces, log, &traced.middle, speckled),
        each => {
            echoes_of_sub_macropulses(&mut light.trains, (design, surfaces), log, each, speckled);
        }
    }
    start_late(&mut light.trains, design, log);
    let interferers = (0..).zip(&rig.mounts).filter(|(_, mount)| !mount.records);
    for (number, &from) in interferers {
        let pair = Pair { from, to: rig.mounts[0] };
        interferers::add(&mut light, number, pair, scene, log);
    }
    light
}

/// Lets the light of lasers whose clock starts late arrive earlier by it: what is added to their ranges
/// (docs/physics.md#beams-of-a-turning-head).
fn start_late(trains: &mut PulseTrains, design: &Design, log: &ShotLog) {
    let offsets = design.scan.model().range_offsets();
    if offsets.is_empty() {
        return;
    }
    let late_fs: Vec<i64> =
        offsets.iter().map(|offset| fs_from_s(tof_from_range(*offset))).collect();
    for (arrives_fs, shot) in trains.arrives_fs.iter_mut().zip(&trains.shot) {
        let row = log.row[(shot - log.first) as usize];
        *arrives_fs -= late_fs[usize::from(row)];
    }
}

/// Returns the brightness of each of `hits` with speckle, relative to its mean. It depends on the shot and on
/// the place of the hit among those of the shot, so the marks of a macropulse that is met in parts share it.
fn factors<'a>(
    (speckle, chance): &'a (Speckle, Chance),
    log: &'a ShotLog,
    hits: &'a Hits,
) -> impl Iterator<Item = f64> + 'a {
    let (mut ray, mut before) = (0, u32::MAX);
    (0..hits.shot.len()).map(move |i| {
        let shot = hits.shot[i];
        ray = if shot == before { ray + 1 } else { 0 };
        before = shot;
        let surface = (hits.range[i], f64::from(hits.cosine[i]), f64::from(hits.weight[i]));
        speckle.factor(chance, (log.first + u64::from(shot), ray), surface)
    })
}

/// Adds the echoes of `hits`: whole macropulses, ordered by shot. Hits without light are left out. An echo
/// has its mean brightness, times its speckle.
pub fn echoes(
    trains: &mut PulseTrains,
    (link, finishes): (&Link, &[Finish]),
    log: &ShotLog,
    hits: &Hits,
    speckled: Option<(Speckle, Chance)>,
) {
    let delay_fs = tof_fs_from_ranges(&hits.range);
    let from = trains.photons.len();
    link.add_echoes(finishes, hits, &mut trains.photons);
    if let Some(speckled) = &speckled {
        let echoes = trains.photons[from..].iter_mut();
        echoes.zip(factors(speckled, log, hits)).for_each(|(photons, factor)| *photons *= factor);
    }
    let lit = &trains.photons[from..];
    // Nearly always all of them.
    if lit.iter().all(|&photons| photons > 0.0) {
        trains.radial_velocity.extend_from_slice(&hits.radial_velocity);
        return add_columns(trains, log, &hits.shot, &delay_fs);
    }
    let kept: Vec<usize> = (0..lit.len()).filter(|i| lit[*i] > 0.0).collect();
    let photons: Vec<f64> = kept.iter().map(|i| lit[*i]).collect();
    trains.photons.truncate(from);
    trains.photons.extend(photons);
    if !hits.radial_velocity.is_empty() {
        trains.radial_velocity.extend(kept.iter().map(|i| hits.radial_velocity[*i]));
    }
    let shots: Vec<u32> = kept.iter().map(|i| hits.shot[*i]).collect();
    let delay_fs: Vec<i64> = kept.iter().map(|i| delay_fs[*i]).collect();
    add_columns(trains, log, &shots, &delay_fs);
}

/// Adds all columns but the photons of the echoes of `shots`, each `delay_fs` after it was fired.
fn add_columns(trains: &mut PulseTrains, log: &ShotLog, shots: &[u32], delay_fs: &[i64]) {
    // Column by column: rows would take three times as long.
    let all = trains.photons.len();
    trains.transmitter.resize(all, 0);
    trains.marks.resize(all, ALL_MARKS);
    let each = || shots.iter().map(|shot| *shot as usize);
    trains.channel.extend(each().map(|shot| log.channel[shot]));
    trains.label.extend(each().map(|shot| log.label[shot]));
    trains.word.extend(each().map(|shot| log.word[shot]));
    trains.shot.extend(each().map(|shot| log.first + shot as u64));
    trains.arrives_fs.extend(each().zip(delay_fs).map(|(shot, late)| log.fired_at_fs[shot] + late));
    let (mut way, mut before) = (0, u32::MAX);
    trains.way.extend(shots.iter().map(|&shot| {
        way = if shot == before { way + 1 } else { 0 };
        before = shot;
        way
    }));
}

/// Adds the echoes of the sub-macropulses of all shots, which have met `each`, the one sent first
/// first; ordered by shot. One without marks has no echo.
fn echoes_of_sub_macropulses(
    trains: &mut PulseTrains,
    (design, (link, finishes)): (&Design, (&Link, &[Finish])),
    log: &ShotLog,
    each: &[Hits],
    speckled: Option<(Speckle, Chance)>,
) {
    let codebook = &design.emission.coding().codebook;
    let drawn = |hits| speckled.iter().flat_map(|it| factors(it, log, hits)).collect();
    let factors: Vec<Vec<f64>> = each.iter().map(drawn).collect();
    let mut order: Vec<(u32, u8, usize)> = Vec::new();
    for (sub, hits) in each.iter().enumerate() {
        order.extend(hits.shot.iter().enumerate().map(|(i, shot)| (*shot, sub as u8, i)));
    }
    order.sort_unstable();
    for met in order.chunk_by(|one, next| one.0 == next.0) {
        for (way, &(shot, sub, i)) in met.iter().enumerate() {
            let hits = &each[usize::from(sub)];
            let factor = factors[usize::from(sub)].get(i).copied().unwrap_or(1.0);
            let photons = factor * link.echo(finishes, hits, i);
            if photons <= 0.0 {
                continue;
            }
            let shot = shot as usize;
            let marks = codebook.marks(log.label[shot], log.word[shot]);
            let begins = |sub: u8| {
                let chip = u32::from(sub) * codebook.chips() / u32::from(SUB_MACROPULSES);
                marks.partition_point(|mark| u32::from(*mark) < chip) as u16
            };
            let marks = [begins(sub), begins(sub + 1)];
            if marks[0] == marks[1] {
                continue;
            }
            let delay_fs = tof_fs_from_ranges(&hits.range[i..=i])[0];
            let train = PulseTrain { photons, marks, way: way as u16, ..WHOLE };
            trains.push(echo(log, shot, delay_fs, train));
        }
    }
}

/// An echo without a scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Echo {
    /// Index of the shot in its log.
    pub shot: usize,
    /// From its firing to the arrival of the same chip, fs.
    pub delay_fs: i64,
    /// Mean photons per mark that are detected.
    pub photons: f64,
}

/// The light of `echoes` of the shots of `log`, ordered by shot: for studies of detectors and
/// receivers without a scene.
///
/// Echoes of one shot are drawn independently of each other, up to 65 536 of them, or 5041 if micropulses are
/// followed in slices. Echoes beyond may repeat the random numbers of the first.
pub fn light_of_echoes<'a>(
    design: &'a Design,
    log: &ShotLog,
    echoes: impl IntoIterator<Item = Echo>,
) -> Light<'a> {
    let mut light = Light { transmitters: vec![Transmitter::of(design, 1.0)], ..Light::default() };
    let (mut way, mut before) = (0_u16, usize::MAX);
    for Echo { shot, delay_fs, photons } in echoes {
        way = if shot == before { way.wrapping_add(1) } else { 0 };
        before = shot;
        let photons = photons / design.efficiency();
        light.trains.push(echo(log, shot, delay_fs, PulseTrain { photons, way, ..WHOLE }));
    }
    light
}

/// A whole macropulse of the sensor itself.
const WHOLE: PulseTrain = PulseTrain {
    transmitter: 0,
    channel: 0,
    arrives_fs: 0,
    photons: 0.0,
    label: 0,
    word: 0,
    marks: ALL_MARKS,
    shot: 0,
    way: 0,
};

/// Returns `train` as the echo of a shot of the log, `delay_fs` after it was fired.
#[inline]
fn echo(log: &ShotLog, shot: usize, delay_fs: i64, train: PulseTrain) -> PulseTrain {
    PulseTrain {
        channel: log.channel[shot],
        arrives_fs: log.fired_at_fs[shot] + delay_fs,
        label: log.label[shot],
        word: log.word[shot],
        shot: log.first + shot as u64,
        ..train
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Material;

    #[test]
    fn what_has_no_light_is_no_echo() {
        let design = Design::open("kim-park-2016", &[]).unwrap();
        let finishes = [1.0, 0.0].map(|diffuse| Material::matt("", diffuse).at(905e-9));
        let hits = Hits {
            shot: vec![3, 5, 5, 9],
            weight: vec![1.0; 4],
            range: vec![10.0, 20.0, 30.0, 40.0],
            cosine: vec![1.0, 1.0, 0.5, 0.0],
            material: vec![0, 1, 0, 0],
            object: vec![0; 4],
            ..Hits::default()
        };
        let log = crate::emit::Band { scan: 0, first: 0, shots: 10 }.shot_log(&design);
        let mut trains = PulseTrains::default();
        let link = Link::of(&design, &crate::environment::Environment::vacuum_dark());
        echoes(&mut trains, (&link, &finishes), &log, &hits, None);
        assert_eq!((&trains.shot[..], &trains.way[..]), (&[3, 5][..], &[0, 0][..]));
        let delay_fs = crate::units::fs_from_s(crate::units::tof_from_range(30.0));
        assert_eq!(trains.arrives_fs[1], log.fired_at_fs[5] + delay_fs);
        assert_eq!(trains.photons[1], link.photons(0.5, 30.0));
    }
}

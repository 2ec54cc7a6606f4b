//! Light of modulated and chirped lidars in the receivers of others, beside closed forms.
#![allow(clippy::unwrap_used)]

use std::f64::consts::PI;
use std::path::Path;

use macropulse::channel::{
    self, ALL_MARKS, Background, Light, Operating, PulseTrain, Seen, Stretch, Transmitter, Varies,
};
use macropulse::codec::{Given, ShotLog};
use macropulse::design::detector::LockIn;
use macropulse::design::{Design, Detector, Wave};
use macropulse::detect::{Detectors, Memory};
use macropulse::emit::{bands, short_bands};
use macropulse::environment::Environment;
use macropulse::points::PointCloud;
use macropulse::random::{Chance, Stage};
use macropulse::scene::{Scene, Traced};
use macropulse::sim;
use macropulse::units::{fs_from_s, range_from_tof, s_from_fs, tof_from_range};

const SEED: u64 = 7;

fn open(sensor: &str, keys: &[(&str, &str)]) -> Design {
    let owned = |&(key, value): &(&str, &str)| (key.to_owned(), value.to_owned());
    Design::open(sensor, &keys.iter().map(owned).collect::<Vec<_>>()).unwrap()
}

/// A white sphere about the sensor in the dark, and the interferers of `more`.
fn sphere(radius: f64, more: &str) -> Scene {
    let text = format!(
        "version = 1\nenvironment = \"vacuum-dark\"\n[[material]]\nname = \"white\"\ndiffuse = 1.0\n\
         [[object]]\nshape.sphere.radius_m = {radius:?}\nmaterial = \"white\"\n{more}"
    );
    Scene::from_toml(&text, "sphere.toml", Path::new("")).unwrap()
}

/// Another lidar at the place of the sensor.
fn other(sensor: &str, set: &str, more: &str) -> String {
    format!(
        "[[interferers]]\nsensor = \"{sensor}\"\nposition_m = [0, 0, 0]\nset = {{ {set} }}\n{more}\n"
    )
}

/// Mean and standard deviation of the ranges.
fn moments(cloud: &PointCloud) -> (f64, f64) {
    let count = cloud.returns() as f64;
    let mean = cloud.range.iter().map(|range| f64::from(*range)).sum::<f64>() / count;
    let squares = cloud.range.iter().map(|range| (f64::from(*range) - mean).powi(2)).sum::<f64>();
    (mean, (squares / count).sqrt())
}

/// A camera of one frequency of 100 MHz, 80 × 60 pixels.
const CAMERA: [(&str, &str); 6] = [
    ("scan.flash.rows", "60"),
    ("scan.flash.columns", "80"),
    ("modulation.frequencies_mhz", "[100.0]"),
    ("detector.lock-in.contrast", "[0.7]"),
    ("scan.max_range_m", "1.49"),
    ("scan.min_range_m", "0.1"),
];

/// The same as an interferer, with a tenth of the light and this frequency, MHz.
fn tenth(mhz: f64, more: &str) -> String {
    let set = format!(
        "scan = {{ flash = {{ rows = 60, columns = 80 }}, max_range_m = 1.49, min_range_m = 0.1 }}, \
         modulation.frequencies_mhz = [{mhz:?}], detector.lock-in.contrast = [0.7], light.energy.shot_nj = 8.0"
    );
    other("itof-camera", &set, more)
}

/// H0: a tenth of light of the same frequency turns the phase by arg(1 + 0.1·s·e^iφ), with s = sinc(Δf·T) of
/// exposures of T. N = 4800 pixels, seed 7, α = 1e-6 (4.9 standard deviations of the mean, and 20 µm). Control: an error
/// without the shift of its clock.
#[test]
fn a_camera_disturbs_one_of_the_same_frequency_alone() {
    let design = open("itof-camera", &CAMERA);
    let mean = |more: &str| {
        let (mean, spread) =
            moments(&sim::scan(&design, &sphere(1.0, more), SEED, 0).unwrap().cloud());
        (mean, spread / 4800_f64.sqrt())
    };
    let (alone, _) = mean("");
    let exposure = 125e-6;
    // How much the frequency differs times the exposure, the delay of its clock in periods, and if it is told.
    for (cycles, late, is_told) in [
        (0.0, 0.25, true),
        (0.0, 0.0, true),
        (0.5, 0.0, true),
        (1.0, 0.25, true),
        (0.0, 0.25, false),
    ] {
        let hz = 100e6 + cycles / exposure;
        let phase = format!("phase_ns = {:?}", if is_told { late * 10.0 } else { 0.0 });
        let (found, deviation) = mean(&tenth(hz * 1e-6, &phase));
        let share = if cycles == 0.0 { 0.1 } else { 0.1 * (PI * cycles).sin() / (PI * cycles) };
        let angle = 2.0 * PI * late - PI * cycles;
        let turned = (share * angle.sin()).atan2(1.0 + share * angle.cos());
        let expected = range_from_tof(turned / (2.0 * PI * 100e6));
        let off = (found - alone - expected).abs();
        assert_eq!(off < 4.9 * deviation * 2_f64.sqrt() + 20e-6, is_told, "{cycles} {late}: {off}");
    }
}

/// H0: light without pulses makes the counts in a photon counter that its energy says, whether its power or its
/// frequency is modulated. N = 70 000 counts or more, seed 7, α = 1e-6 (|z| < 4.9). Control: 2 % more light is noticed.
#[test]
fn light_without_pulses_is_a_rate_to_a_counter() {
    for (sensor, nm, raster, (energy, lasts, every)) in [
        // Exposures of 125 µs every 525 µs.
        (
            "itof-camera",
            "905",
            "scan.flash = { rows = 6, columns = 8",
            (48.0 * 80e-9 / 8.0, 125e-6, 525e-6),
        ),
        // A shot of 12.67 µs in 1/76 800 s.
        (
            "fmcw-1550",
            "1550",
            "light.energy.shot_nj = 25.3, scan.raster = { rows = 64, columns = 240",
            (25.3e-9, 10e-6 + 2.0 * tof_from_range(200.0), 1.0 / 76_800.0),
        ),
    ] {
        let design = open("kim-park-2016-physical", &[("light.wavelength_nm", nm)]);
        let field = format!(
            "{raster}, horizontal_deg = 8, vertical_deg = 6 }}, light.wavelength_nm = {nm}"
        );
        let scene = sphere(30.0, &other(sensor, &field, ""));
        let operating = Operating::in_scene(&design, &scene).unwrap();
        let chance = Chance::new(SEED);
        let detectors = Detectors::new(&design, &operating, chance);
        let seen = Seen { design: &design, scene: &scene, operating: &operating, chance };
        let (mut added, mut lit) = (0.0, 0.0);
        for band in short_bands(&design, 0).take(4) {
            let log = band.shot_log(&design);
            let mut memory = Memory::default();
            let mut detections =
                |light: &Light| detectors.detections(&log, light, &mut memory).time.len() as f64;
            let light = channel::light(&seen, &log, &Traced::default());
            let dark = Light { background: Background::default(), ..light.clone() };
            added += detections(&light) - detections(&dark);
            let flight = tof_from_range(30.0);
            let [opens, closes] =
                [log.fired_at_fs[0], log.fired_at_fs[log.len() - 1] + design.listening_fs()]
                    .map(|time| s_from_fs(time) - flight);
            let met = |shot: i32| {
                let begins = f64::from(shot) * every;
                (closes.min(begins + lasts) - opens.max(begins)).max(0.0)
            };
            lit += (-2..1000).map(met).sum::<f64>();
        }
        let photons = design.budget.as_ref().unwrap().photons(energy, 1.0, 30.0) / lasts;
        let expected = lit * photons * design.efficiency();
        let z = |expected: f64| (added - expected) / expected.sqrt();
        assert!(added > 7e4 && z(expected).abs() < 4.9, "{sensor}: {added}, not {expected}");
        assert!(z(1.02 * expected).abs() > 4.9, "{sensor}: the control was not rejected");
    }
}

/// A camera, and the shots that it fires.
struct Camera {
    design: Design,
    log: ShotLog,
}

impl Camera {
    /// A camera that adds no noise of its own.
    fn new() -> Self {
        let quiet = [("detector.lock-in.read_noise_e", "0"), ("detector.lock-in.adc_bits", "16")];
        let design = open("itof-camera", &quiet);
        let log = bands(&design, 0).next().unwrap().shot_log(&design);
        Self { design, log }
    }

    /// The electrons of the taps of the first `shots` in this `light` alone.
    fn electrons(&self, light: &Light<'_>, shots: usize) -> Vec<f64> {
        let operating = Operating::of(&self.design, &Environment::vacuum_dark()).unwrap();
        let detectors = Detectors::new(&self.design, &operating, Chance::new(SEED));
        let Some(Given::Taps(taps)) = detectors.record_by_shot(&self.log, light) else {
            unreachable!()
        };
        let lock_in = self.lock_in();
        let electrons =
            |code: &u16| (f64::from(*code) - lock_in.dark_code) * lock_in.electrons_per_code();
        taps.codes[..shots * 8].iter().map(electrons).collect()
    }

    fn lock_in(&self) -> &LockIn {
        let Detector::LockIn(lock_in) = &self.design.detector else { unreachable!() };
        lock_in
    }
}

/// H0: light whose frequency is modulated adds the same to every tap, as steady light does. N = 1000 pixels, seed 7,
/// α = 1e-6 for each of eight taps. Control: light whose power is modulated, with the frequency of the camera.
#[test]
fn light_of_steady_power_is_the_same_to_all_taps() {
    let camera = Camera::new();
    let (shots, electrons, exposure) = (1000, 2000.0, 125e-6);
    let hz = camera.lock_in().modulation.hz[0];
    let frequency = Varies::Frequency { hz: -3e8, per_s: 1.28e14, linewidth: 1e4 };
    let power = Varies::Power { hz, phase: 0.0, wave: Wave::Sine };
    for (varies, is_steady) in [(frequency, true), (power, false)] {
        let mut light = Light::default();
        let from_fs = camera.log.fired_at_fs[0];
        for shot in 0..shots {
            light.background.push(Stretch {
                channel: camera.log.channel[shot],
                from_fs,
                until_fs: from_fs + camera.design.emission.length_fs(),
                per_s: electrons / exposure / camera.design.efficiency(),
                varies,
                address: 0,
            });
        }
        let found = camera.electrons(&light, shots);
        let expected = electrons + camera.lock_in().dark * exposure;
        let off = |tap: usize| {
            let mean = found[tap..].iter().step_by(8).sum::<f64>() / shots as f64;
            ((mean - expected) / (expected / shots as f64).sqrt()).abs()
        };
        let most = (0..8).map(off).fold(0.0, f64::max);
        assert_eq!(most < 4.9, is_steady, "{varies:?}: {most} standard deviations");
    }
}

/// Light without pulses is refused by detectors that are not simulated in it, each with a remedy, unless their filter
/// stops it. A detector that never misses refuses it, too.
#[test]
fn detectors_that_cannot_follow_it_refuse() {
    let told = |sensor: &str, keys: &[(&str, &str)], nm: &str| {
        let set =
            format!("light.wavelength_nm = {nm}, idealised = [\"mirror-motion\", \"eye-safety\"]");
        let scene = sphere(30.0, &other("itof-camera", &set, ""));
        Operating::in_scene(&open(sensor, keys), &scene).map_err(|error| error.to_string())
    };
    for (sensor, keys, nm, remedy) in [
        ("coded-practical", &[][..], "1550", "take [adc] for [comparator]"),
        ("hdl-64e", &[], "905", "firing_photons to 1"),
        ("peregrine", &[], "1570", "firing_photons to 1"),
        ("fmcw-1550", &[], "1550", "give it another wavelength"),
        (
            "kim-park-2016",
            &[("detector.photon-counting.sensitivity.pd", "1.0")],
            "905",
            "sensitivity.pd below 1",
        ),
    ] {
        let refused = told(sensor, keys, nm).unwrap_err();
        assert!(refused.contains("itof-camera") && refused.contains(remedy), "{sensor}: {refused}");
        assert!(told(sensor, keys, "700").is_ok(), "{sensor}");
    }
    for (sensor, nm) in [("coded-32", "1550"), ("spad-flash", "940"), ("itof-camera", "850")] {
        assert!(told(sensor, &[], nm).is_ok(), "{sensor}: {:?}", told(sensor, &[], nm));
    }
}

/// H0: pulses of another lidar make the variance b + K·(n + n²·(1 + c²/2)) of a tap. K pulses of n electrons each come at
/// random times; b are its own electrons, and c is its contrast. N = 8000 taps, seed 7, α = 1e-6. Control: shot noise alone.
#[test]
fn pulses_are_noise_with_a_long_tail_to_a_tap() {
    let (camera, pulsed) = (Camera::new(), open("spad-spinning", &[]));
    let mut light = Light {
        transmitters: [&camera.design, &pulsed].map(|of| Transmitter::of(of, 1.0)).to_vec(),
        ..Light::default()
    };
    let (shots, electrons, mean_pulses, exposure) = (1000, 500.0, 3.0, 125e-6);
    let length = s_from_fs(camera.design.emission.length_fs());
    let rate = mean_pulses / exposure;
    let mut stream = Chance::new(SEED).at(Stage::Firing, 1);
    for shot in 0..shots {
        let mut at = -(stream.fraction().ln()) / rate;
        while at < length {
            light.trains.push(PulseTrain {
                transmitter: 1,
                channel: camera.log.channel[shot],
                arrives_fs: camera.log.fired_at_fs[shot] + fs_from_s(at),
                photons: electrons / camera.design.efficiency(),
                label: 0,
                word: 0,
                marks: ALL_MARKS,
                shot: 0,
                way: 0,
            });
            at -= stream.fraction().ln() / rate;
        }
    }
    let found = camera.electrons(&light, shots);
    let taps = found.len() as f64;
    let mean = found.iter().sum::<f64>() / taps;
    let variance = found.iter().map(|one| (one - mean).powi(2)).sum::<f64>() / taps;
    let contrast = 0.5 * (0.7_f64.powi(2) + 0.8_f64.powi(2));
    let dark = camera.lock_in().dark * exposure;
    let expected =
        dark + mean_pulses * (electrons + electrons * electrons * (1.0 + contrast / 2.0));
    // The kurtosis of a compound Poisson variable is below 4 here.
    let deviation = expected * (3.0 / taps).sqrt();
    assert!((variance - expected).abs() < 4.9 * deviation, "{variance}, not {expected}");
    assert!((variance - mean).abs() > 4.9 * deviation);
}

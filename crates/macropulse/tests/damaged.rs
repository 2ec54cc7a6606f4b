//! Files that are damaged are refused in a sentence or read, whatever is in them: no reader panics,
//! and none takes memory because a number in the file is large.
#![allow(clippy::unwrap_used)]

use macropulse::design::Design;
use macropulse::formats::{Clouds, Format, Names, write_cloud};
use macropulse::points::PointCloud;
use macropulse::scene::Scene;
use macropulse::sim;
use proptest::prelude::*;
use std::fs;
use std::sync::{LazyLock, Mutex, PoisonError};

const READABLE: [&str; 10] =
    ["pcd", "ply", "las", "laz", "e57", "npy", "csv", "xyz", "kitti", "mcap"];

/// More memory than sound readers take for a file of some ten kilobytes, kB. The image of a list may have all
/// pixels of a sensor, 2²⁵, with 25 bytes each and the truth.
const MOST_MEMORY: usize = 2 << 20;

/// One file is read at a time: the memory is that of the process.
static READING: Mutex<()> = Mutex::new(());

/// The most memory that this process had, kB; 0 where it is not known.
fn most_memory() -> usize {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    line.map_or(0, |line| line.trim().trim_end_matches(" kB").parse().unwrap())
}

/// A scan of a small sensor.
static CLOUD: LazyLock<PointCloud> = LazyLock::new(|| {
    let fewer = [("rows", "6"), ("columns", "9")]
        .map(|(key, value)| (format!("scan.raster.{key}"), value.to_owned()));
    let design = Design::open("kim-park-2016-fixed", &fewer).unwrap();
    let scene = Scene::open("street").unwrap();
    sim::scan(&design, &scene, 3, 0).unwrap().cloud()
});

fn written(name: &str) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("whole");
    let objects = ["car".to_owned()];
    let names = Names { objects: &objects, materials: &objects };
    write_cloud(Format::parse(name).unwrap(), &CLOUD, &names, &path).unwrap();
    fs::read(path).unwrap()
}

/// Reads what is left of a file to its end, without a panic.
fn read(name: &str, bytes: &[u8]) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("damaged");
    let path = path.with_extension(Format::parse(name).unwrap().extension());
    fs::write(&path, bytes).unwrap();
    let _alone = READING.lock().unwrap_or_else(PoisonError::into_inner);
    if let Ok(clouds) = Clouds::open(&path) {
        for cloud in clouds {
            match cloud {
                Ok(cloud) => assert_eq!(cloud.x.len(), cloud.returns()),
                Err(error) => assert_eq!(error.to_string().lines().count(), 1, "{error}"),
            }
        }
    }
    let most = most_memory();
    assert!(most <= MOST_MEMORY, "{name}: {most} kB of memory");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, ..ProptestConfig::default() })]

    #[test]
    fn no_damage_makes_a_reader_panic(
        format in 0..READABLE.len(),
        // Half of the damage in the header, where it hurts.
        places in prop::collection::vec((0.0..1.0_f64, any::<bool>(), any::<u8>()), 1..8),
        keep in prop::option::of(0.0..1.0_f64),
    ) {
        let name = READABLE[format];
        let mut bytes = written(name);
        for (place, in_header, byte) in places {
            let within = if in_header { bytes.len().min(600) } else { bytes.len() };
            bytes[(place * within as f64) as usize] = byte;
        }
        let keep = keep.map_or(bytes.len(), |keep| (keep * bytes.len() as f64) as usize);
        read(name, &bytes[..keep]);
    }

    #[test]
    fn no_bytes_at_all_make_a_reader_panic(
        format in 0..READABLE.len(),
        head in 0..64_usize,
        noise in prop::collection::vec(any::<u8>(), 0..400),
    ) {
        let name = READABLE[format];
        let whole = written(name);
        let bytes = [&whole[..head.min(whole.len())], &noise].concat();
        read(name, &bytes);
    }
}

/// A LAZ file whose compressed points are longer than those of its header: the library would take gigabytes for
/// layers that are not there. Control: as it was written it is read.
#[test]
fn compressed_points_that_are_longer_than_the_header_says_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("points.laz");
    let mut bytes = written("laz");
    let refused = |bytes: &[u8]| {
        fs::write(&path, bytes).unwrap();
        Clouds::open(&path).map_or_else(
            |why| Some(why.to_string()),
            |mut clouds| clouds.find_map(|cloud| cloud.err().map(|why| why.to_string())),
        )
    };
    assert_eq!(refused(&bytes), None);
    // The record of the compressor: who wrote it, its head of 54 bytes, 34 bytes, and six for each item.
    let user = bytes.windows(14).position(|name| name == b"laszip encoded").unwrap();
    let size_of_second = user - 2 + 54 + 34 + 6 + 2;
    bytes[size_of_second] += 68;
    assert!(refused(&bytes).unwrap().contains("damaged"), "{:?}", refused(&bytes));
}

/// Every place of a header, with the numbers that hurt most.
#[test]
fn large_and_small_numbers_everywhere_in_a_header() {
    for name in READABLE {
        let whole = written(name);
        for at in (0..whole.len().min(400)).step_by(3) {
            for byte in [0x00, 0x7f, 0xff] {
                let mut bytes = whole.clone();
                let end = (at + 8).min(bytes.len());
                bytes[at..end].fill(byte);
                read(name, &bytes);
            }
        }
    }
}

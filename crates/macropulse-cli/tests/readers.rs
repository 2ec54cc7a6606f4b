//! Every format is read by a reader that others wrote, attribute by attribute: `tests/readers` holds
//! what Python packages find in the files against what NumPy does.
#![allow(missing_docs)]

use crate::common;

use std::io::Write;
use std::path::Path;
use std::process::Command;

use common::Desk;

const FORMATS: &str = "pcd,ply,ply-cloudcompare,las,laz,e57,npy,csv,xyz,kitti,parquet,mcap,mcap-velodyne,\
                       mcap-ouster,mcap-livox,mcap-autoware,mcap-foxglove,mcap-osi,range-npy";

/// A sensor that turns and moves in a street, by 2 m in a second, so that its poses differ.
const SCENE: &str = "--set scene:sensor.velocity_m_s=[2,0,0]";

#[test]
fn every_format_is_read_by_a_reader_of_others() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/readers");
    let python = macropulse_testbed::python(&folder.join("requirements.txt")).unwrap();
    let desk = Desk::new();
    for (name, returns) in [("single", 1), ("several", 3)] {
        let sensor = "--sensor kim-park-2016-fixed --set scan.raster.rows=24 \
                      --set scan.raster.columns=40";
        let line = format!(
            "simulate {sensor} --set receiver.returns={returns} --scene street {SCENE} --scans 3 \
             --truth --format {FORMATS} -o {name}"
        );
        let ran = desk.run(&line);
        assert_eq!(ran.code, Some(0), "{}", ran.err);
        assert!(ran.err.contains("kitti cannot hold true_range, object, material"), "{}", ran.err);
    }
    let pytest = macropulse_testbed::call(
        Command::new(python)
            .args(["-m", "pytest", "-q", "-x", "-rs", "-p", "no:cacheprovider"])
            .arg(&folder)
            .env("PYTHONDONTWRITEBYTECODE", "1")
            .env("MACROPULSE_FILES", desk.path())
            .env("MACROPULSE", env!("CARGO_BIN_EXE_macropulse")),
    );
    let said = pytest.unwrap_or_else(|said| panic!("{said}"));
    // Past what the test program keeps to itself: it must not look as if all had been tried.
    for skipped in said.lines().filter(|line| line.starts_with("SKIPPED")) {
        std::io::stderr().write_all(format!("\nNOT TESTED: {skipped}\n").as_bytes()).unwrap();
    }
}

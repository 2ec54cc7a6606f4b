//! The pages that Macropulse writes, opened and used in a browser: `browser/`, run by pytest.

#![allow(clippy::unwrap_used)]

use std::io::Write;
use std::path::Path;
use std::process::Command;

use macropulse_testbed::{call, chromium, python};

#[test]
fn pages_work_in_a_browser() {
    let Some(chromium) = chromium().unwrap() else {
        // Past the capture of the test harness: it must not look as if pages had been tried.
        let said = "\nNO CHROMIUM: the pages were not tried in a browser. Install one, or name it in \
                    MACROPULSE_CHROMIUM; MACROPULSE_BROWSER=required makes this a failure.\n";
        std::io::stderr().write_all(said.as_bytes()).unwrap();
        return;
    };
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/browser");
    let python = python(&folder.join("requirements.txt")).unwrap();
    let mut pytest = Command::new(python);
    pytest
        .args(["-m", "pytest", "-q", "-p", "no:cacheprovider"])
        .arg(&folder)
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .env("MACROPULSE", env!("CARGO_BIN_EXE_macropulse"))
        .env("MACROPULSE_CHROMIUM", chromium)
        .env("MACROPULSE_PICTURES", env!("CARGO_TARGET_TMPDIR"));
    println!("{}", call(&mut pytest).unwrap_or_else(|why| panic!("{why}")));
}

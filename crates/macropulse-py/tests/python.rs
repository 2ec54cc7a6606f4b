//! The tests of the Python package, run by pytest on a package that `pip install .` has made.
#![allow(clippy::unwrap_used)]

use std::collections::BTreeSet;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use macropulse_testbed::{call, python, target};

fn here() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Cargo, run in this package.
fn cargo() -> Command {
    let mut cargo = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    cargo.current_dir(here());
    cargo
}

/// The program of this source, which must give the same bytes. It is built for one of its own tests, as in a
/// run of all tests. In a build of it alone, its dependencies would have fewer features and be compiled
/// again.
fn program() -> PathBuf {
    let build =
        ["test", "--quiet", "--no-run", "--workspace", "--test", "commands", "--target-dir"];
    call(cargo().args(build).arg(target().unwrap())).unwrap();
    target().unwrap().join("debug").join("macropulse")
}

/// An empty folder of this name.
fn emptied(name: &str) -> PathBuf {
    let folder = target().unwrap().join("python").join(name);
    // An older source may have left files.
    let _ = std::fs::remove_dir_all(&folder);
    folder
}

/// pip as `interpreter` has it.
fn pip(interpreter: &Path, what: &str) -> Command {
    let mut pip = Command::new(interpreter);
    pip.args(["-m", "pip", what, "--quiet", "--disable-pip-version-check"]);
    pip
}

/// The package, built from the root of the repository as `pip install .` does it, but with the
/// profile of the tests.
fn wheel() -> &'static Path {
    static WHEEL: OnceLock<PathBuf> = OnceLock::new();
    WHEEL.get_or_init(|| {
        let interpreter = python(&here().join("tests/requirements.txt")).unwrap();
        let folder = emptied("wheel");
        let mut pip = pip(&interpreter, "wheel");
        // The builder is one of the requirements: nothing is fetched.
        pip.args(["--no-build-isolation", "--no-deps", "--no-index", "--wheel-dir"]);
        pip.arg(&folder).arg(here().join("../.."));
        pip.env("CARGO_TARGET_DIR", target().unwrap())
            .env("MATURIN_PEP517_ARGS", "--profile dev --features as-in-tests");
        // The builder stands beside the interpreter.
        let beside = interpreter.parent().unwrap().display().to_string();
        pip.env("PATH", format!("{beside}:{}", std::env::var("PATH").unwrap_or_default()));
        call(&mut pip).unwrap();
        let mut made = std::fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path());
        made.find(|file| file.extension().is_some_and(|ending| ending == "whl")).unwrap()
    })
}

/// Packages and their features, as in `cargo tree` with `options`, this one left out.
fn compiled(options: &[&str]) -> BTreeSet<String> {
    let form = ["tree", "--no-dedupe", "--prefix", "none", "--format", "{p} {f}"];
    let printed = call(cargo().args(form).args(options)).unwrap();
    let others = printed.lines().filter(|line| !line.starts_with("macropulse-py "));
    others.map(str::to_owned).collect()
}

/// A dependency with fewer features than in a run of all tests would be compiled again, and all that uses it.
#[test]
fn the_package_is_made_of_what_is_compiled_already() {
    let tests = compiled(&["--workspace"]);
    let package = compiled(&["-p", "macropulse-py", "--features", "as-in-tests", "-e", "no-dev"]);
    let more: Vec<_> = package.difference(&tests).collect();
    assert!(more.is_empty(), "for `as-in-tests` in Cargo.toml: {more:#?}");
    let bare = compiled(&["-p", "macropulse-py", "-e", "no-dev"]);
    assert_ne!(bare.difference(&tests).count(), 0);
}

/// A folder with the package and nothing else, for any interpreter.
fn installed(interpreter: &Path) -> &'static Path {
    static SITE: OnceLock<PathBuf> = OnceLock::new();
    SITE.get_or_init(|| {
        let site = emptied("site");
        let alone = ["--no-deps", "--no-index", "--target"];
        call(pip(interpreter, "install").args(alone).arg(&site).arg(wheel())).unwrap();
        site
    })
}

/// Runs `tests`, which must pass, and returns the output of pytest.
fn passed(interpreter: &Path, site: &Path, tests: &[&str]) -> String {
    let printed = call(
        Command::new(interpreter)
            .current_dir(here())
            .args(["-m", "pytest", "-q", "-rs", "-p", "no:cacheprovider"])
            .args(tests)
            .env("PYTHONPATH", site)
            .env("PYTHONDONTWRITEBYTECODE", "1")
            .env("MACROPULSE_PROGRAM", program()),
    )
    .unwrap();
    assert!(printed.contains(" passed"), "{printed}");
    printed
}

/// A newcomer has a fresh environment with nothing but the package and its dependencies. The ten lines are
/// those of the guide.
#[test]
fn a_newcomer_has_a_cloud_after_ten_lines() {
    let any = python(&here().join("tests/requirements.txt")).unwrap();
    let environment = emptied("fresh");
    call(Command::new(any).args(["-m", "venv"]).arg(&environment)).unwrap();
    let interpreter = environment.join("bin").join("python");
    call(pip(&interpreter, "install").arg(wheel())).unwrap();
    let listed = call(&mut pip(&interpreter, "freeze")).unwrap();
    let names = listed.lines().map(|line| line.split(['=', ' ']).next().unwrap_or_default());
    assert_eq!(names.collect::<Vec<_>>(), ["macropulse", "numpy"]);
    let lines = here().join("tests").join("newcomer.py");
    let elsewhere = environment.join("desk");
    std::fs::create_dir(&elsewhere).unwrap();
    let printed = call(Command::new(&interpreter).current_dir(&elsewhere).arg(lines)).unwrap();
    let scan = printed.lines().next().unwrap();
    assert!(scan.starts_with("<macropulse.Scan 0 of kim-park-2016-fixed: "), "{printed}");
    // The guide shows the same line.
    let guide = std::fs::read_to_string(here().join("../../docs/guide/python.md")).unwrap();
    assert!(guide.lines().any(|line| line == scan), "{printed}");
    assert!(elsewhere.join("car.pcd").exists());
}

#[test]
fn the_package_passes_its_tests() {
    let interpreter = python(&here().join("tests/requirements.txt")).unwrap();
    let site = installed(&interpreter);
    let side_by_side = ["-n", "2", "--dist", "worksteal"];
    let tests = ["tests", "--ignore", "tests/cluster"];
    println!("{}", passed(&interpreter, site, &[&side_by_side[..], &tests].concat()));
}

/// Ray is large, and not made for every Python: where it cannot be installed this says so, loudly, and
/// fails only if `MACROPULSE_RAY` is `required`.
#[test]
#[ignore = "slow: before a release"]
fn a_cluster_gives_what_one_machine_does() {
    let requirements = here().join("tests/requirements.txt");
    let site = installed(&python(&requirements).unwrap());
    match python(&here().join("tests/requirements-ray.txt")) {
        Ok(interpreter) => {
            let guide = "tests/test_guide.py::test_the_python_of_a_page_does_what_it_says\
                         [docs/guide/cluster.md]";
            println!("{}", passed(&interpreter, site, &["tests/cluster", guide]));
        }
        Err(why) => {
            assert_ne!(std::env::var("MACROPULSE_RAY").as_deref(), Ok("required"), "{why}");
            let told = format!("\nNOT TESTED: macropulse.cluster, for want of Ray: {why}\n");
            // Past what the test program keeps to itself.
            std::io::stderr().write_all(told.as_bytes()).unwrap();
        }
    }
}

//! Means of tests: Python with packages, a browser, lists of sources, recordings of others.
//!
//! The tests read files that Macropulse writes with readers that others wrote, most of them Python packages.
//! [`python`] makes an environment with the packages of a requirements file, once, in the target folder, and
//! returns its interpreter.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Interpreter of a Python environment with the packages of `requirements`, a file as `pip` reads
/// it. The environment is made at the first call, and anew when the file or Python changes; several
/// tests may ask for it at once.
///
/// # Errors
/// A sentence, if there is no `python3` of version 3.10 or later, or a package cannot be installed.
pub fn python(requirements: &Path) -> Result<PathBuf, String> {
    let wanted = fs::read(requirements)
        .map_err(|why| format!("{} cannot be read: {why}", requirements.display()))?;
    let system = system_python()?;
    let mut name = blake3::Hasher::new();
    name.update(system.version.as_bytes()).update(&wanted);
    let folder = target()?.join("python").join(&name.finalize().to_hex()[..16]);
    let is_made = folder.join("is-complete");
    fs::create_dir_all(&folder)
        .map_err(|why| format!("{} cannot be made: {why}", folder.display()))?;
    // Whoever comes second waits for the first, also in another test program.
    let lock = File::create(folder.join("lock")).map_err(|why| why.to_string())?;
    lock.lock().map_err(|why| why.to_string())?;
    let environment = folder.join("environment");
    let interpreter = environment.join("bin").join("python");
    if !is_made.exists() {
        call(Command::new(&system.program).args(["-m", "venv", "--clear"]).arg(&environment))?;
        call(
            Command::new(&interpreter)
                .args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "-r"])
                .arg(requirements),
        )?;
        File::create(&is_made).map_err(|why| why.to_string())?;
    }
    Ok(interpreter)
}

/// A Chromium of this machine, if there is one: the program in `MACROPULSE_CHROMIUM`, or one of the
/// usual name on the path.
///
/// # Errors
/// A sentence, if there is none and `MACROPULSE_BROWSER` is `required`.
pub fn chromium() -> Result<Option<PathBuf>, String> {
    let named = std::env::var_os("MACROPULSE_CHROMIUM").map(PathBuf::from);
    let usual = ["chromium", "chromium-browser", "google-chrome", "chrome"];
    let found = named.or_else(|| usual.iter().find_map(|name| on_path(name)));
    match std::env::var("MACROPULSE_BROWSER").as_deref() {
        Ok("required") if found.is_none() => {
            Err("MACROPULSE_BROWSER is `required`, and there is no Chromium on the path: install \
                 one, or name its program in MACROPULSE_CHROMIUM"
                .to_owned())
        }
        _ => Ok(found),
    }
}

/// Runs `command` and returns its output.
///
/// # Errors
/// A sentence, if it could not be started; with its output, if it failed.
pub fn call(command: &mut Command) -> Result<String, String> {
    let output = command.output().map_err(|why| format!("{command:?} did not start: {why}"))?;
    let printed =
        [output.stdout, output.stderr].map(|text| String::from_utf8_lossy(&text).into_owned());
    if output.status.success() {
        Ok(printed.concat())
    } else {
        Err(format!("{command:?} failed ({}):\n{}", output.status, printed.concat()))
    }
}

struct SystemPython {
    program: PathBuf,
    version: String,
}

fn system_python() -> Result<SystemPython, String> {
    let program =
        on_path("python3").ok_or("the tests need a `python3` of version 3.10 or later")?;
    let version = call(Command::new(&program).args(["-c", "import sys; print(sys.version)"]))?;
    Ok(SystemPython { program, version })
}

fn on_path(name: &str) -> Option<PathBuf> {
    let path = std::env::var_os("PATH")?;
    std::env::split_paths(&path).map(|folder| folder.join(name)).find(|file| file.is_file())
}

/// Returns the folder that cargo builds into. The calling test program lies in `<target>/<profile>/deps`.
///
/// # Errors
/// A sentence, if the program lies elsewhere.
pub fn target() -> Result<PathBuf, String> {
    let program = std::env::current_exe().map_err(|why| why.to_string())?;
    let deps = program.ancestors().find(|folder| folder.ends_with("deps"));
    let target = deps.and_then(Path::parent).and_then(Path::parent);
    target
        .map(Path::to_path_buf)
        .ok_or_else(|| format!("{} does not lie where cargo puts test programs", program.display()))
}

/// The Rust sources in `folder` and below; none of a folder that cannot be read.
pub fn sources_below(folder: &Path) -> Vec<PathBuf> {
    let (mut folders, mut files) = (vec![folder.to_owned()], Vec::new());
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
            let path = entry.path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|ending| ending == "rs") {
                files.push(path);
            }
        }
    }
    files
}

/// A file or folder of the recordings and meshes of others, which are not part of the repository. They lie in the
/// folder that the variable `MACROPULSE_DATA` names, or in `shared/data` beside the repository. `None` if it is not
/// there: this is printed.
pub fn data_of_others(path: &str) -> Option<PathBuf> {
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    let folder = std::env::var_os("MACROPULSE_DATA").map_or_else(beside, PathBuf::from);
    let path = folder.join(path);
    if path.exists() {
        return Some(path);
    }
    eprintln!("NOT TESTED: {} is not there", path.display());
    None
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn a_command_that_fails_says_what_it_printed() {
        let why = call(Command::new("sh").args(["-c", "echo broken >&2; exit 3"])).unwrap_err();
        assert!(why.contains("broken"), "{why}");
        assert_eq!(call(Command::new("sh").args(["-c", "echo well"])).unwrap(), "well\n");
    }

    #[test]
    fn the_target_folder_is_found() {
        assert!(std::env::current_exe().unwrap().starts_with(target().unwrap()));
    }
}

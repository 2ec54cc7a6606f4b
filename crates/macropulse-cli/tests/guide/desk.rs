//! A folder in which the commands of a page are run as its reader runs them.

use std::fs;
use std::os::unix::fs::{PermissionsExt, symlink};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use tempfile::TempDir;

/// Other programs of the pages, as far as it takes: what `cargo` would build has been built, and
/// `sbatch` runs the tasks of an array one after the other.
const OTHERS: [(&str, &str); 2] = [
    ("cargo", "[ \"$1\" = build ]\n"),
    (
        "sbatch",
        "last=$(sed -n 's/^#SBATCH --array=1-//p' \"$1\")\n\
         for task in $(seq \"$last\"); do\n\
         SLURM_ARRAY_TASK_ID=$task SLURM_ARRAY_TASK_COUNT=$last bash -eu \"$1\" > \"task-$task.log\"\n\
         done\n",
    ),
];

/// A folder with `docs/examples` in it, where `macropulse` and `target/release/macropulse` are the
/// program under test.
pub struct Desk {
    /// Removed with the desk.
    _folder: TempDir,
    work: PathBuf,
    programs: PathBuf,
}

impl Desk {
    /// A new one, with the examples of the repository at `root`.
    pub fn new(root: &Path) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let [work, programs] = ["work", "programs"].map(|name| folder.path().join(name));
        let release = work.join("target/release");
        for made in [&programs, &release] {
            fs::create_dir_all(made).unwrap();
            symlink(env!("CARGO_BIN_EXE_macropulse"), made.join("macropulse")).unwrap();
        }
        for (name, text) in OTHERS {
            let file = programs.join(name);
            fs::write(&file, format!("#!/usr/bin/env bash\nset -eu\n{text}")).unwrap();
            fs::set_permissions(&file, fs::Permissions::from_mode(0o755)).unwrap();
        }
        copy(&root.join("docs/examples"), &work.join("docs/examples"));
        Self { _folder: folder, work, programs }
    }

    /// Puts a file there.
    pub fn put(&self, name: &str, text: &str) {
        fs::write(self.work.join(name), text).unwrap();
    }

    /// Runs `commands` and gives all that they print.
    ///
    /// # Errors
    /// The command that failed, and the output.
    pub fn run(&self, commands: &str) -> Result<String, String> {
        self.bash(&format!("exec 2>&1\n{commands}"))
    }

    /// Runs `command` and gives what it prints on standard output, as JSON.
    ///
    /// # Errors
    /// The same, or that it is no JSON.
    pub fn json(&self, command: &str) -> Result<serde_json::Value, String> {
        serde_json::from_str(&self.bash(command)?).map_err(|why| format!("`{command}`: {why}"))
    }

    /// That every `macropulse` at the beginning of one of `commands` knows its options. A variable stands for its name.
    ///
    /// # Errors
    /// The message about it.
    pub fn parse(&self, commands: &str) -> Result<(), String> {
        let whole = commands.replace("\\\n", " ");
        let ours = whole.lines().map(|line| line.trim_start().trim_start_matches("$ "));
        for line in ours.filter(|line| line.starts_with("macropulse ")) {
            let (_, words) = line.split_once(' ').unwrap_or_default();
            let words = words.replace('$', "");
            self.bash(&format!("asked() {{ macropulse \"$@\" --help; }}\nasked {words}"))?;
        }
        Ok(())
    }

    fn bash(&self, script: &str) -> Result<String, String> {
        let path = std::env::var("PATH").unwrap_or_default();
        let ran = Command::new("bash")
            .args(["-eu", "-o", "pipefail", "-c"])
            .arg(format!("trap 'echo \"This failed: $BASH_COMMAND\" >&2' ERR\n{script}"))
            .current_dir(&self.work)
            .env("PATH", format!("{}:{path}", self.programs.display()))
            .stdin(Stdio::null())
            .output()
            .map_err(|why| why.to_string())?;
        let [out, err] = [ran.stdout, ran.stderr].map(|text| String::from_utf8(text).unwrap());
        if ran.status.success() { Ok(out) } else { Err(format!("{out}{err}")) }
    }
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap().map(Result::unwrap) {
        let to = to.join(entry.file_name());
        if entry.path().is_dir() {
            copy(&entry.path(), &to);
        } else {
            fs::copy(entry.path(), to).unwrap();
        }
    }
}

fn desk() -> Desk {
    Desk::new(&super::root())
}

#[test]
fn a_command_that_fails_is_named() {
    let why = desk().run("echo well\nmacropulse simulate nothing wall\necho on").unwrap_err();
    assert!(why.starts_with("well\n") && why.contains("nothing"), "{why}");
    assert!(why.contains("This failed: macropulse simulate nothing wall"), "{why}");
    assert!(!why.ends_with("on\n"), "{why}");
}

#[test]
fn options_that_there_are_not_are_noticed_without_a_run() {
    let desk = desk();
    desk.parse("ros2 bag play\nmacropulse sweep peregrine \\\n  --shots 5 -o out   # later")
        .unwrap();
    for wrong in ["$ macropulse sweep $sensor --shoots 5", "do\n    macropulse sweep --shoots 5"] {
        let why = desk.parse(wrong).unwrap_err();
        assert!(why.contains("--shoots"), "{why}");
    }
    assert!(desk.parse("macropulse sweeps peregrine").is_err());
}

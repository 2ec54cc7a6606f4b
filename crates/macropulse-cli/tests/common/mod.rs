//! Runs the program in a folder of its own.

#![allow(clippy::unwrap_used)]

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use tempfile::TempDir;

/// A folder to work in.
pub struct Desk(TempDir);

/// Output of the program, and how it ended.
pub struct Ran {
    pub code: Option<i32>,
    pub out: String,
    pub err: String,
}

impl Desk {
    pub fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    pub fn path(&self) -> &Path {
        self.0.path()
    }

    /// Puts a file on the desk.
    #[allow(dead_code)]
    pub fn put(&self, name: &str, text: &str) -> &Self {
        fs::write(self.path().join(name), text).unwrap();
        self
    }

    /// The program with the words of `line` as arguments, not started yet.
    pub fn command(&self, line: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_macropulse"));
        command.current_dir(self.path()).args(line.split_whitespace());
        command
    }

    pub fn run(&self, line: &str) -> Ran {
        let Output { status, stdout, stderr } = self.command(line).output().unwrap();
        let text = |bytes| String::from_utf8(bytes).unwrap();
        Ran { code: status.code(), out: text(stdout), err: text(stderr) }
    }

    /// Runs what must succeed and gives its JSON.
    #[allow(dead_code)]
    pub fn json(&self, line: &str) -> serde_json::Value {
        let ran = self.run(line);
        assert_eq!(ran.code, Some(0), "{line}: {}", ran.err);
        serde_json::from_str(&ran.out).unwrap()
    }

    /// Runs what must be refused: exit code 2, nothing on stdout, one sentence on stderr with all
    /// of `words` in it, and no trace on the disk.
    #[allow(dead_code)]
    pub fn refused(&self, line: &str, words: &[&str]) {
        let before = self.files();
        let Ran { code, out, err } = self.run(line);
        assert_eq!(code, Some(2), "{line}: {err}");
        assert_eq!(out, "", "{line}");
        assert_eq!(err.lines().count(), 1, "{line}: {err}");
        assert!(err.starts_with("macropulse: "), "{line}: {err}");
        for word in words {
            assert!(err.contains(word), "{line}: no {word:?} in {err}");
        }
        assert_eq!(self.files(), before, "{line}");
    }

    /// Everything on the desk, as paths, sorted.
    pub fn files(&self) -> Vec<String> {
        let mut found = Vec::new();
        walk(self.path(), "", &mut found);
        found.sort();
        found
    }
}

fn walk(folder: &Path, prefix: &str, found: &mut Vec<String>) {
    for entry in fs::read_dir(folder).unwrap().map(Result::unwrap) {
        let name = format!("{prefix}{}", entry.file_name().to_string_lossy());
        if entry.path().is_dir() {
            walk(&entry.path(), &format!("{name}/"), found);
        }
        found.push(name);
    }
}

//! Errors in a scene, told to the person who wrote it.

use std::path::{Path, PathBuf};

use crate::told;

/// Why a scene could not be made. Every message says where and what to do.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A file is not there or may not be read.
    #[error("{}: cannot be read: {}; files of a scene are looked for in the folder of its file", path.display(), told::unreadable(source))]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// The message of the system.
        source: std::io::Error,
    },
    /// A mesh file was read but holds no usable mesh.
    #[error("{}: {problem}; {remedy}", path.display())]
    Mesh {
        /// The file.
        path: PathBuf,
        /// The problem.
        problem: String,
        /// The remedy.
        remedy: String,
    },
    /// A mesh names a file that lies outside the folder of the scene.
    #[error("{}: names {named}, which lies outside the folder of the scene; put that file beside the mesh, or allow it with --outside-files (in the scene outside_files = true)", path.display())]
    Outside {
        /// The mesh.
        path: PathBuf,
        /// The file, as the mesh names it.
        named: String,
    },
    /// A scene file says something that cannot be.
    #[error("{origin}:{line}:{column}: {message}")]
    Typed {
        /// The scene file.
        origin: String,
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// The problem and the remedy.
        message: String,
    },
    /// A scene that a program describes says something that cannot be.
    #[error("{origin}: {key}{}{message}", if key.is_empty() { "" } else { ": " })]
    Keyed {
        /// The program's name for its description.
        origin: String,
        /// The key, as `object[1].position_m`; empty for the scene as a whole.
        key: String,
        /// The problem and the remedy.
        message: String,
    },
    /// A value was changed to what cannot be.
    #[error("{key}: {message}")]
    Changed {
        /// The dotted key, or several.
        key: String,
        /// The problem and the remedy.
        message: String,
    },
    /// Neither a built-in scene nor a file.
    #[error("there is no scene {asked:?}: it is neither a file nor built in; {}built in are {known}", nearest.as_ref().map(|name| format!("did you mean {name:?}? ")).unwrap_or_default())]
    UnknownScene {
        /// The name that was asked for.
        asked: String,
        /// The built-in scene of the most similar name.
        nearest: Option<String>,
        /// All built-in scenes.
        known: String,
    },
}

impl Error {
    pub(super) fn mesh(path: &Path, problem: impl Into<String>, remedy: &str) -> Self {
        Self::Mesh { path: path.to_owned(), problem: problem.into(), remedy: remedy.to_owned() }
    }
}

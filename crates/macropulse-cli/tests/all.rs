//! The tests of the commands, as one program: it is linked once, and its tests share the cores.
#![allow(missing_docs)]

mod common;

mod bad_mesh;
mod browser;
mod budget;
mod check;
mod codes;
mod convert;
mod decode;
mod encode;
mod environment;
mod hostile;
mod memory;
mod meshes;
mod mistakes;
mod readers;
mod runs;
mod schema;
mod simulate;
mod sweep;
mod validate;
mod view;

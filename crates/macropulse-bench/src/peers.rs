//! Other libraries beside our rays, by the programs in `peers`.

use std::env;
use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::Fallible;
use crate::machine::printed;
use crate::meshes::{Direction, EYE};

/// How often a mesh is loaded: the least time counts.
pub const LOADS: usize = 3;

/// Figures that a program prints for one mesh.
#[derive(Debug, Default)]
pub struct Figures {
    /// Processor time to load the mesh, s.
    pub load_s: f64,
    /// Most memory of the program until then, bytes.
    pub peak: f64,
    /// Millions of rays per second, by list of rays and by way.
    pub rates: Vec<Vec<f64>>,
    /// Rays that hit, by list of rays.
    pub hits: Vec<usize>,
}

/// A library, and the program that measures it.
pub struct Peer {
    program: OsString,
    /// Argument before the mesh: the library of Embree, or the script for Open3D.
    before: PathBuf,
    /// The ways in which it casts rays, by the names that it prints.
    ways: &'static [&'static str],
}

impl Peer {
    /// Embree, by a program that is compiled into `folder`: rays one by one, 16 at once, and 16 at once with the
    /// flag for coherent ones. Why not, where there is no C compiler or no Embree.
    pub fn embree(folder: &Path) -> Result<Self, String> {
        let source = concat!(env!("CARGO_MANIFEST_DIR"), "/peers/embree.c");
        let program = folder.join("embree");
        let mut compiler = Command::new("cc");
        compiler.args(["-O2", "-o"]).arg(&program).args([source, "-ldl"]);
        printed(&mut compiler).map_err(|why| format!("no C compiler: {why}"))?;
        let of_library = |library: String| Self {
            program: program.clone().into(),
            before: library.into(),
            ways: &["single", "wide", "coherent"],
        };
        let mut peers = libraries().into_iter().map(of_library);
        peers.find(|peer| peer.works(folder)).ok_or_else(|| "Embree is not installed".to_owned())
    }

    /// Open3D, in the Python that the variable `OPEN3D_PYTHON` names, or else `python3`. Why not, where that has
    /// none.
    pub fn open3d(folder: &Path) -> Result<Self, String> {
        let peer = Self {
            program: env::var_os("OPEN3D_PYTHON").unwrap_or_else(|| "python3".into()),
            before: concat!(env!("CARGO_MANIFEST_DIR"), "/peers/open3d_rays.py").into(),
            ways: &["open3d"],
        };
        match peer.works(folder) {
            true => Ok(peer),
            false => Err("Open3D is not installed".to_owned()),
        }
    }

    /// Returns true if the program loads a mesh without triangles.
    fn works(&self, folder: &Path) -> bool {
        let mesh = folder.join("none.stl");
        fs::write(&mesh, [0; 84]).is_ok() && printed(&mut self.command(&mesh)).is_ok()
    }

    fn command(&self, mesh: &Path) -> Command {
        let mut command = Command::new(&self.program);
        command.arg(&self.before).arg(mesh);
        command
    }

    /// Runs the program on `mesh.stl` in the `folder`, and on these files of rays.
    pub fn run(&self, folder: &Path, rays: &[PathBuf]) -> Fallible<Figures> {
        let mesh = folder.join("mesh.stl");
        let run = |rays: &[PathBuf]| -> Fallible<Figures> {
            let text = printed(self.command(&mesh).args(rays))?;
            let other = || format!("{} prints another form", self.before.display());
            Ok(self.read(&text).ok_or_else(other)?)
        };
        let mut figures = run(rays)?;
        for _ in 1..LOADS {
            figures.load_s = figures.load_s.min(run(&[])?.load_s);
        }
        Ok(figures)
    }

    /// The figures in what the program prints.
    fn read(&self, text: &str) -> Option<Figures> {
        let mut figures = Figures::default();
        for line in text.lines() {
            let words: Vec<&str> = line.split(' ').collect();
            match words[..] {
                ["load", seconds, peak] => {
                    (figures.load_s, figures.peak) = (seconds.parse().ok()?, peak.parse().ok()?);
                }
                ["rays", way, rate, hits] => {
                    let way = self.ways.iter().position(|other| *other == way)?;
                    if way == 0 {
                        figures.rates.push(vec![0.0; self.ways.len()]);
                        figures.hits.push(hits.parse().ok()?);
                    }
                    figures.rates.last_mut()?[way] = 1e-6 * rate.parse::<f64>().ok()?;
                }
                _ => return None,
            }
        }
        Some(figures)
    }
}

/// Writes each list of rays to a file in `folder`, as the programs read them.
pub fn write(rays: &[&[Direction]], folder: &Path) -> Fallible<Vec<PathBuf>> {
    let write = |(number, directions): (usize, &&[Direction])| {
        let file = folder.join(format!("rays-{number}.f32"));
        let values = EYE.iter().chain(directions.iter().flatten());
        fs::write(&file, values.flat_map(|value| value.to_le_bytes()).collect::<Vec<_>>())?;
        Ok(file)
    };
    rays.iter().enumerate().map(write).collect()
}

/// Returns the places where Embree may be: the one in the variable `EMBREE`, the Python package `embreex`,
/// and those where the system looks for libraries.
fn libraries() -> Vec<String> {
    let find = "import importlib.util, pathlib\n\
        home = pathlib.Path(importlib.util.find_spec('embreex').origin).parent.parent\n\
        print(next((home / 'embreex.libs').glob('libembree4*')))";
    let in_python = printed(Command::new("python3").args(["-c", find]));
    let in_python = in_python.map(|path| path.trim().to_owned());
    let systems = ["libembree4.so.4", "libembree4.so"].map(str::to_owned);
    env::var("EMBREE").into_iter().chain(in_python).chain(systems).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_are_read() {
        let peer = Peer {
            program: "none".into(),
            before: "none".into(),
            ways: &["single", "wide", "coherent"],
        };
        let text = "load 0.5 1024\nrays single 2e6 7\nrays wide 3e6 7\nrays coherent 4e6 7\n\
                    rays single 1e6 8\nrays wide 1e6 8\nrays coherent 1e6 8\n";
        let figures = peer.read(text).unwrap();
        assert_eq!((figures.load_s, figures.peak), (0.5, 1024.0));
        assert_eq!(figures.rates, [[2.0, 3.0, 4.0], [1.0, 1.0, 1.0]]);
        assert_eq!(figures.hits, [7, 8]);
        assert!(peer.read("load 0.5\n").is_none());
        assert!(peer.read("rays open3d 1e6 8\n").is_none());
    }
}

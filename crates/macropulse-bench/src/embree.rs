//! Embree beside our rays, by the program in `peers/embree.c`.

use std::env;
use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::machine::printed;
use crate::meshes::{Direction, EYE};

/// What the program prints of one mesh.
#[derive(Debug, Default)]
pub struct Figures {
    /// Processor time to load the mesh, s.
    pub load_s: f64,
    /// Most memory of the program, bytes.
    pub peak: f64,
    /// Of each list of rays, millions per second one by one, 16 at once, and 16 at once with the
    /// flag for coherent ones.
    pub rates: Vec<[f64; 3]>,
    /// Of each list, the rays that hit.
    pub hits: Vec<usize>,
}

/// The program, made ready to run.
pub struct Embree {
    program: PathBuf,
    library: String,
}

impl Embree {
    /// Compiles the program into `folder`; why not, where there is no C compiler or no Embree.
    pub fn prepare(folder: &Path) -> Result<Self, String> {
        let source = concat!(env!("CARGO_MANIFEST_DIR"), "/peers/embree.c");
        let program = folder.join("embree");
        let mut compiler = Command::new("cc");
        compiler.args(["-O2", "-o"]).arg(&program).args([source, "-ldl"]);
        printed(&mut compiler).map_err(|why| format!("no C compiler: {why}"))?;
        let mesh = folder.join("none.stl");
        fs::write(&mesh, [0; 84]).map_err(|why| why.to_string())?;
        let works =
            |library: &String| printed(Command::new(&program).arg(library).arg(&mesh)).is_ok();
        let library = libraries().into_iter().find(works).ok_or("Embree is not installed")?;
        Ok(Self { program, library })
    }

    /// Runs it on `mesh.stl` in the `folder`.
    pub fn run(&self, folder: &Path, rays: &[&[Direction]]) -> Result<Figures, Box<dyn Error>> {
        let mut command = Command::new(&self.program);
        command.arg(&self.library).arg(folder.join("mesh.stl"));
        for (number, directions) in rays.iter().enumerate() {
            let file = folder.join(format!("rays-{number}.f32"));
            let values = EYE.iter().chain(directions.iter().flatten());
            fs::write(&file, values.flat_map(|value| value.to_le_bytes()).collect::<Vec<_>>())?;
            command.arg(file);
        }
        read(&printed(&mut command)?).ok_or_else(|| "peers/embree.c prints another form".into())
    }
}

/// Where Embree may be: as the variable `EMBREE` says, in the Python package `embreex`, or where
/// the system looks for libraries.
fn libraries() -> Vec<String> {
    let find = "import importlib.util, pathlib\n\
        home = pathlib.Path(importlib.util.find_spec('embreex').origin).parent.parent\n\
        print(next((home / 'embreex.libs').glob('libembree4*')))";
    let in_python = printed(Command::new("python3").args(["-c", find]));
    let in_python = in_python.map(|path| path.trim().to_owned());
    let systems = ["libembree4.so.4", "libembree4.so"].map(str::to_owned);
    env::var("EMBREE").into_iter().chain(in_python).chain(systems).collect()
}

/// The figures in what the program prints.
fn read(text: &str) -> Option<Figures> {
    let mut figures = Figures::default();
    for line in text.lines() {
        let words: Vec<&str> = line.split(' ').collect();
        match words[..] {
            ["load", seconds, peak] => {
                (figures.load_s, figures.peak) = (seconds.parse().ok()?, peak.parse().ok()?);
            }
            ["rays", way, rate, hits] => {
                let way = ["single", "wide", "coherent"].iter().position(|other| *other == way)?;
                if way == 0 {
                    figures.rates.push([0.0; 3]);
                    figures.hits.push(hits.parse().ok()?);
                }
                figures.rates.last_mut()?[way] = 1e-6 * rate.parse::<f64>().ok()?;
            }
            _ => return None,
        }
    }
    Some(figures)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_are_read() {
        let text = "load 0.5 1024\nrays single 2e6 7\nrays wide 3e6 7\nrays coherent 4e6 7\n\
                    rays single 1e6 8\nrays wide 1e6 8\nrays coherent 1e6 8\n";
        let figures = read(text).unwrap();
        assert_eq!((figures.load_s, figures.peak), (0.5, 1024.0));
        assert_eq!(figures.rates, [[2.0, 3.0, 4.0], [1.0, 1.0, 1.0]]);
        assert_eq!(figures.hits, [7, 8]);
        assert!(read("load 0.5\n").is_none());
    }
}

//! The meshes of a scene: each is read, measured and kept once, however many objects share it.

use std::path::PathBuf;
use std::rc::Rc;

use glam::DVec3;

use super::error::Error;
use super::footing::Footing;
use super::mesh::Mesh;
use super::readers::{Read, WithoutMaterials};

/// Everything that decides how a mesh comes out.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Origin {
    Car,
    /// A file, read `without` materials or not, its unit in metres, and its axes.
    File {
        path: PathBuf,
        without: WithoutMaterials,
        metres: f64,
        up: DVec3,
        forward: DVec3,
    },
    /// A mesh in memory, by its name, in the same.
    Given {
        name: String,
        metres: f64,
        up: DVec3,
        forward: DVec3,
    },
}

impl Origin {
    /// The unit in metres, and up and forward in its own axes, of what is not ours.
    fn frame(&self) -> Option<(f64, DVec3, DVec3)> {
        match *self {
            Self::Car => None,
            Self::File { metres, up, forward, .. } | Self::Given { metres, up, forward, .. } => {
                Some((metres, up, forward))
            }
        }
    }
}

/// A mesh in metres, x forward, z up.
pub(super) struct Known {
    origin: Origin,
    pub mesh: Rc<Mesh>,
    pub footing: Footing,
    /// Length, width and height, m.
    pub size: [f64; 3],
    /// Further contents of its file, in sentences.
    pub left_out: Vec<String>,
}

/// The meshes that there are so far.
#[derive(Default)]
pub(super) struct Meshes(Vec<Known>);

impl Meshes {
    /// How many triangles they have together.
    pub fn triangles(&self) -> usize {
        self.0.iter().map(|known| known.mesh.triangles.len()).sum()
    }

    /// The mesh of this origin, which `read` gives if it is new.
    pub fn of(
        &mut self,
        origin: &Origin,
        read: impl FnOnce() -> Result<Read, Error>,
    ) -> Result<&mut Known, Error> {
        let known = match self.0.iter().position(|known| known.origin == *origin) {
            Some(known) => known,
            None => {
                self.0.push(Known::new(origin.clone(), read()?));
                self.0.len() - 1
            }
        };
        Ok(&mut self.0[known])
    }
}

impl Known {
    /// A mesh as its file has it.
    fn new(origin: Origin, Read { mut mesh, left_out }: Read) -> Self {
        let frame = origin.frame();
        let axes = frame.map(|(metres, up, forward)| (metres, [forward, up.cross(forward), up]));
        let [mut low, mut high] = [f64::INFINITY, f64::NEG_INFINITY].map(DVec3::splat);
        for vertex in &mut mesh.vertices {
            if let Some((metres, axes)) = axes {
                let place = DVec3::from(*vertex) * metres;
                *vertex = axes.map(|axis| place.dot(axis));
            }
            let vertex = DVec3::from(*vertex);
            (low, high) = (low.min(vertex), high.max(vertex));
        }
        let size = (high - low).to_array();
        let mesh = Rc::new(mesh);
        let footing = Footing::of(Rc::clone(&mesh));
        Self { origin, mesh, footing, size, left_out }
    }
}

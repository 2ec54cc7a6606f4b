//! The parts of a scene that go into its digest: all that decides what light meets.

use super::closed_form::{Shape, Solid};
use super::material::Diffuse;
use super::motion::Motion;
use super::placed::Placed;
use super::pose::Pose;
use crate::digest::Digest;
use crate::environment::{Effect, Environment, Sunlight};

impl Digest {
    /// Takes in sun and air.
    pub(super) fn environment(&mut self, environment: &Environment) {
        let Environment { name: _, sunlight, albedo, visibility, rain_mm_h, idealised } =
            environment;
        let (sky, value) = match *sunlight {
            Sunlight::Day { elevation: None } => (0, 0.0),
            Sunlight::Day { elevation: Some(elevation) } => (1, elevation),
            Sunlight::Overcast => (2, 0.0),
            Sunlight::Night => (3, 0.0),
            Sunlight::Declared(irradiance) => (4, irradiance),
        };
        self.bytes(&[sky]);
        [value, *albedo, *visibility, *rain_mm_h].into_iter().for_each(|value| self.number(value));
        let effects = Effect::ALL.map(|effect| u8::from(idealised.contains(&effect)));
        self.bytes(&effects);
    }

    /// Takes in a diffuse reflectance, at every wavelength at which it is known.
    pub(super) fn diffuse(&mut self, diffuse: Diffuse) {
        match diffuse {
            Diffuse::Even(diffuse) => self.number(diffuse),
            Diffuse::At(known) => known.iter().for_each(|&(nm, diffuse)| {
                self.number(nm);
                self.number(diffuse);
            }),
        }
    }

    /// Takes in a pose.
    pub(super) fn pose(&mut self, Pose { position, rotation }: &Pose) {
        self.numbers(position);
        self.numbers(&rotation.angles());
    }

    /// Takes in a motion: nothing but the pose of what stands still.
    pub(super) fn motion(&mut self, motion: &Motion) {
        match motion {
            Motion::Still(pose) => self.pose(pose),
            Motion::Steady { pose, velocity, turn_rate } => {
                self.pose(pose);
                self.bytes(b"moves");
                self.numbers(velocity);
                self.number(*turn_rate);
            }
            Motion::Path(path) => {
                self.bytes(b"path");
                for (time_fs, pose) in path.poses() {
                    self.bytes(&time_fs.to_le_bytes());
                    self.pose(&pose);
                }
            }
        }
    }

    /// Takes in all meshes, what they are made of, and where they stand. One that many objects share
    /// is taken in by the first of them.
    pub(super) fn all_placed(&mut self, placed: &[Placed]) {
        for (index, one) in placed.iter().enumerate() {
            match placed[..index].iter().position(|other| other.shares_with(one)) {
                Some(first) => {
                    self.bytes(b"as");
                    self.bytes(&(first as u64).to_le_bytes());
                }
                None => self.model(one),
            }
            self.places(one);
        }
    }

    /// Takes in a mesh and what it is made of.
    fn model(&mut self, Placed { mesh, material_indices, .. }: &Placed) {
        self.numbers(mesh.vertices.as_flattened());
        for (triangle, material) in mesh.triangles.iter().zip(&mesh.material_of_triangle) {
            let mut facet = [0; 14];
            facet[..12].copy_from_slice(triangle.map(u32::to_le_bytes).as_flattened());
            facet[12..].copy_from_slice(&material_indices[usize::from(*material)].to_le_bytes());
            self.bytes(&facet);
        }
    }

    /// Takes in where a mesh stands and how it moves.
    fn places(&mut self, Placed { at, moving, object, .. }: &Placed) {
        for place in at {
            let origin = place.point([0.0; 3]);
            let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
            let turned = axes.map(|axis| place.direction(axis));
            origin.iter().chain(turned.iter().flatten()).for_each(|value| self.number(*value));
        }
        moving.iter().for_each(|motion| self.motion(motion));
        self.bytes(&object.to_le_bytes());
    }

    /// Takes in a shape.
    pub(super) fn solid(&mut self, solid: &Solid) {
        match solid.shape() {
            Shape::Plane { normal } => normal.iter().for_each(|value| self.number(*value)),
            Shape::Sphere { radius } => self.number(radius),
            Shape::Box { half } => half.iter().for_each(|value| self.number(*value)),
            Shape::Frustum { radii, half } => {
                self.bytes(b"frustum");
                radii.iter().chain([&half]).for_each(|value| self.number(*value));
            }
            Shape::Capsule { radius, half } => {
                self.bytes(b"capsule");
                [radius, half].iter().for_each(|value| self.number(*value));
            }
            Shape::Ellipsoid { half } => {
                self.bytes(b"ellipsoid");
                half.iter().for_each(|value| self.number(*value));
            }
        }
        self.pose(&solid.pose());
        self.bytes(&solid.material().to_le_bytes());
        self.bytes(&solid.object().to_le_bytes());
    }
}

//! The tests of the simulator across its modules, as one program: it is linked once, and its tests
//! share the cores. A test that measures or limits its own process is a program of its own.
#![allow(missing_docs)]

#[path = "scene/tetra.rs"]
mod tetra;

mod beyond_the_gate;
mod code_families;
mod chirped;
mod combinations;
mod data_sheets;
mod designs;
mod efforts;
mod families;
mod fence;
mod histograms;
mod intensity;
mod interference;
mod judging;
mod laws;
mod layering;
mod limits;
mod make_car;
mod marks;
mod meshes;
mod modulated;
mod motion;
mod paths;
mod predict;
mod products;
mod readme;
mod receivers;
mod recorded_chip;
mod rig;
mod roundtrip;
mod sampled;
mod scene;
mod scene_given;
mod scene_meshes;
mod several_returns;
mod shapes;
mod slow;
mod threads;
mod timing;
mod turning_heads;
mod unpulsed;

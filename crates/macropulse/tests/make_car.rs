//! The car of the repository is the one that the program beside it draws.
#![allow(clippy::unwrap_used, missing_docs, dead_code)]

#[path = "../examples/make-car/car.rs"]
mod car;
#[path = "../examples/make-car/mesh.rs"]
mod mesh;
#[path = "../examples/make-car/parts.rs"]
mod parts;

const CAR: &[u8] = include_bytes!("../../../scenes/meshes/car.ply");

#[test]
fn the_program_draws_the_car_of_the_repository() {
    let mut mesh = car::mesh().unwrap();
    assert!(mesh.ply() == CAR, "run `cargo run -p macropulse --example make-car`");
    // The control: the last bit of one number is enough.
    mesh.vertices[1000][1] = mesh.vertices[1000][1].next_up();
    assert!(mesh.ply() != CAR);
}

#[test]
fn the_car_has_the_size_that_the_library_gives() {
    assert_eq!(car::SIZE, macropulse::scene::CAR_SIZE);
}

#[test]
fn the_curve_keeps_its_knots_and_does_not_overshoot() {
    let knots = [(0.0, 0.0), (1.0, 1.0), (2.0, 1.0), (3.0, 0.0)];
    assert_eq!(car::smooth(&knots, 1.0), 1.0);
    assert_eq!((car::smooth(&knots, -5.0), car::smooth(&knots, 9.0)), (0.0, 0.0));
    for step in 0..=300 {
        assert!((0.0..=1.0).contains(&car::smooth(&knots, f64::from(step) / 100.0)));
    }
}

//! Draws the car of the ready scenes and writes it to `scenes/meshes/car.ply`, or where the first
//! argument says: `cargo run -p macropulse --example make-car`.

mod car;
mod mesh;
mod parts;

use std::error::Error;
use std::path::PathBuf;

fn main() -> Result<(), Box<dyn Error>> {
    let usual = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes/meshes/car.ply");
    let path = std::env::args_os().nth(1).map_or_else(|| PathBuf::from(usual), PathBuf::from);
    let bytes = car::mesh()?.ply();
    std::fs::write(&path, &bytes)?;
    println!("{}: {} bytes", path.display(), bytes.len());
    Ok(())
}

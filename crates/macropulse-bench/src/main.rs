//! The benchmarks of Macropulse: measures how fast it is and writes the tables of
//! docs/performance.md.
//!
//! `cargo run --release -p macropulse-bench` measures everything, in a quarter of an hour, but how scans grow
//! with threads; `… -- rays decode` measures and writes these sections alone.

use std::error::Error;
use std::path::Path;
use std::process::ExitCode;

mod dear;
mod decode;
mod effort;
mod floor;
mod generate;
mod goals;
mod levels;
mod machine;
mod meshes;
mod page;
mod peers;
mod plain;
mod rays;
mod sample;
mod scans;

/// Result of an action that may fail for a reason worth a sentence.
type Fallible<T> = Result<T, Box<dyn Error>>;

/// The sections that are written, in the order in which they are measured.
const SECTIONS: [&str; 12] = [
    "generate", "decode", "rays", "dear", "levels", "floor", "effort", "plain", "growth", "scans",
    "threads", "goals",
];

fn main() -> ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    match run(&words) {
        Ok(()) => ExitCode::SUCCESS,
        Err(why) => {
            eprintln!("{why}");
            ExitCode::FAILURE
        }
    }
}

fn run(words: &[&str]) -> Fallible<()> {
    match words {
        // This program starts processes of its own, to measure their memory or to use fewer instructions.
        ["load", folder] => println!("{}", rays::load(Path::new(folder))?),
        ["speeds"] => print!("{}", levels::speeds()?),
        ["sixty"] => {
            scans::sixty()?;
            println!("{}", 1e-6 * rays::peak());
        }
        [] => everything()?,
        _ => words.iter().try_for_each(|word| section(word))?,
    }
    Ok(())
}

/// Measures and writes one section.
fn section(name: &str) -> Fallible<()> {
    let text = match name {
        "rays" => rays::measure()?.text(),
        "generate" => generate::measure()?.text(),
        "decode" => decode::measure()?.text(),
        "dear" => dear::text()?,
        "levels" => levels::text()?,
        "floor" => floor::text()?,
        "effort" => effort::measure()?.text(),
        "plain" => plain::text()?,
        "growth" => decode::growth()?,
        "scans" => scans::measure()?.text(),
        "threads" => scans::on_threads()?,
        "goals" => return Err("goals needs all sections: name none".into()),
        _ => return Err(format!("{name} is none of: {}", SECTIONS.join(", ")).into()),
    };
    write(name, &text)
}

/// Measures and writes all sections but `threads`, which tells more on a machine that has many.
fn everything() -> Fallible<()> {
    // Before what fills the memory of this process and leaves it in pieces.
    let generating = generate::measure()?;
    write("generate", &generating.text())?;
    let decoding = decode::measure()?;
    write("decode", &decoding.text())?;
    let rays = rays::measure()?;
    write("rays", &rays.text())?;
    section("dear")?;
    section("levels")?;
    section("floor")?;
    let efforts = effort::measure()?;
    write("effort", &efforts.text())?;
    section("plain")?;
    section("growth")?;
    let scans = scans::measure()?;
    write("scans", &scans.text())?;
    let measured = goals::Measured {
        rays: &rays,
        generating: &generating,
        decoding: &decoding,
        efforts: &efforts,
        scans: &scans,
    };
    write("goals", &goals::text(&measured)?)
}

/// Prints what was measured and puts it into the page.
fn write(name: &str, text: &str) -> Fallible<()> {
    let text = format!("{}\n\n{}", machine::words(), text.trim());
    println!("{name}\n\n{text}\n");
    page::write(name, &text)
}

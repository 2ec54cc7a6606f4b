//! The pictures of a comparison.

use std::path::Path;

use macropulse::formats::write_atomically;
use macropulse::predict::comparison::Comparison;
use macropulse::predict::multiple_access::{MultipleAccess, bit_error_hard, bit_error_soft};
use macropulse_study::view::{Axis, Chart, MatrixPicture, Style, standalone};

use crate::fault::Fault;

/// Most users of a curve.
const MOST_USERS: u32 = 64;

/// Errors below are not drawn: the lifetime of the sensor has not so many bits.
const LEAST_ERROR: f64 = 1e-20;

/// Writes the correlation matrix of each family, and the errors of all of them.
pub fn write(compared: &[Comparison], folder: &Path) -> Result<(), Fault> {
    for of in compared {
        let name = of.family.to_string();
        let picture = MatrixPicture {
            title: format!("{name}: marks two words share at most"),
            side: of.compared,
            values: &of.matrix,
        };
        let png = picture.png().map_err(|error| Fault::Ours(error.to_string()))?;
        write_atomically(&folder.join(format!("{}.png", file_name(&name))), |out| {
            out.write_all(&png)
        })?;
    }
    let limited = |error: fn(&MultipleAccess) -> f64, how: &str| {
        let title = format!("Bit error against users, {how}");
        standalone(&errors(compared, error, &title).svg())
    };
    let soft = limited(bit_error_soft, "every mark counted");
    let hard = limited(bit_error_hard, "one mark per chip");
    for (file, svg) in [("errors-soft.svg", soft), ("errors-hard.svg", hard)] {
        write_atomically(&folder.join(file), |out| out.write_all(svg.as_bytes()))?;
    }
    Ok(())
}

fn errors(compared: &[Comparison], error: fn(&MultipleAccess) -> f64, title: &str) -> Chart {
    let users = Axis::linear("users at once").limits(2.0, MOST_USERS.into());
    let mut chart = Chart::new(title, users, Axis::log(title).limits(LEAST_ERROR, 1.0));
    chart.size = [904.0, 460.0];
    for of in compared {
        let point = |users: u32| Some([f64::from(users), error(&of.users(users)?)]);
        let points: Vec<[f64; 2]> = (2..=MOST_USERS).map_while(point).collect();
        if !points.is_empty() {
            chart = chart.series(&of.family.to_string(), Style::Line, points);
        }
    }
    chart
}

/// `extended prime 29` as `extended-prime-29`.
fn file_name(family: &str) -> String {
    let words = family.split(|letter: char| !letter.is_ascii_alphanumeric() && letter != '-');
    let words: Vec<String> = words.filter(|w| !w.is_empty()).map(str::to_lowercase).collect();
    words.join("-")
}

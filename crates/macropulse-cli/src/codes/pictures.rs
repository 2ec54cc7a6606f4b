//! The pictures of a comparison.

use std::path::Path;

use macropulse::formats::write_atomically;
use macropulse::predict::comparison::Comparison;
use macropulse::predict::multiple_access::{MultipleAccess, bit_error_hard, bit_error_soft};
use macropulse_study::view::{
    Axis, Block, Chart, Figure, MatrixPicture, Page, Section, Style, standalone,
};

use crate::fault::Fault;

/// Most users of a curve.
const MOST_USERS: u32 = 64;

/// Least error that is drawn: a sensor does not send 10²⁰ bits in its lifetime.
const LEAST_ERROR: f64 = 1e-20;

/// Probability of a wrong bit, for a number of users.
type Errors = fn(&MultipleAccess) -> f64;

/// Name of the page, and of the pictures of errors.
const PAGE: &str = "index.html";
const CURVES: [&str; 2] = ["errors-soft.svg", "errors-hard.svg"];

/// Names of the files that [`write`] writes of the families of these names.
pub fn files<'a>(families: impl Iterator<Item = &'a str>) -> Vec<String> {
    let fixed = CURVES.into_iter().chain([PAGE]).map(str::to_owned);
    families.map(file_of).chain(fixed).collect()
}

/// Writes the correlation matrix of each family, the errors of all of them, and a page of both with
/// the `listing` that is printed.
pub fn write(compared: &[Comparison], listing: &str, folder: &Path) -> Result<(), Fault> {
    let mut files = Vec::new();
    let mut matrices = Vec::new();
    for of in compared {
        let name = of.family.to_string();
        let title = format!("{name}: marks two words share at most");
        let picture = MatrixPicture { title, side: of.compared, values: &of.matrix };
        let png = picture.png().map_err(|error| Fault::Ours(error.to_string()))?;
        let file = file_of(&name);
        write_atomically(&folder.join(&file), |out| out.write_all(&png))?;
        matrices.push(Figure::png(png, &picture.title, &name));
        files.push(file);
    }
    let limits: [(&str, Errors, &str); 2] = [
        (CURVES[0], bit_error_soft, "every mark counted"),
        (CURVES[1], bit_error_hard, "one mark per chip"),
    ];
    let mut curves = Section::new("Errors");
    for (file, error, how) in limits {
        let svg = errors(compared, error, &format!("Bit error against users, {how}")).svg();
        write_atomically(&folder.join(file), |out| out.write_all(standalone(&svg).as_bytes()))?;
        curves = curves.figure(Figure::svg(&svg, ""));
        files.push(file.to_owned());
    }
    let lead = "How much the words of each family share with each other, and what that costs.";
    let page = Page::new("Code families compared", lead)
        .kicker("Macropulse")
        .section(curves)
        .section(Section::new("Numbers").block(Block::Listing(listing.to_owned())))
        .section(Section::new("Correlations").block(Block::Gallery(2, matrices)))
        .files(&files);
    write_atomically(&folder.join(PAGE), |out| out.write_all(page.html().as_bytes()))?;
    Ok(())
}

fn errors(compared: &[Comparison], error: Errors, title: &str) -> Chart {
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

/// The file with the correlations of a family.
fn file_of(family: &str) -> String {
    format!("{}.png", file_name(family))
}

/// `extended prime 29` as `extended-prime-29`.
fn file_name(family: &str) -> String {
    let words = family.split(|letter: char| !letter.is_ascii_alphanumeric() && letter != '-');
    let words: Vec<String> = words.filter(|w| !w.is_empty()).map(str::to_lowercase).collect();
    words.join("-")
}

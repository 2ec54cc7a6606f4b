//! The page that the tables go to, and how figures stand in them.

use std::error::Error;
use std::fs;
use std::path::PathBuf;

/// Line that ends a section.
const END: &str = "<!-- end of what is written by a command -->";

/// Returns the line that begins the section `name`.
fn begin(name: &str) -> String {
    format!("<!-- {name}: written by `cargo run --release -p macropulse-bench`, not by hand -->")
}

/// Returns the path of the page.
pub fn path() -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/performance.md"))
}

/// Puts `text` in place of what stands in the section `name` of the page.
pub fn write(name: &str, text: &str) -> Result<(), Box<dyn Error>> {
    let page = fs::read_to_string(path())?;
    Ok(fs::write(path(), replaced(&page, name, text)?)?)
}

/// The `page` with `text` in its section `name`.
fn replaced(page: &str, name: &str, text: &str) -> Result<String, String> {
    let begin = begin(name);
    let lacks = |line: &str| format!("the page has no line {line:?}");
    let (before, rest) = page.split_once(&begin).ok_or_else(|| lacks(&begin))?;
    let (_, after) = rest.split_once(END).ok_or_else(|| lacks(END))?;
    Ok(format!("{before}{begin}\n\n{}\n\n{END}{after}", text.trim()))
}

/// A table of Markdown: its head, and its rows.
pub fn table(head: &[&str], rows: &[Vec<String>]) -> String {
    let line = |cells: &[String]| format!("| {} |\n", cells.join(" | "));
    let head: Vec<String> = head.iter().map(|&cell| cell.to_owned()).collect();
    let rule = format!("|{}\n", "---|".repeat(head.len()));
    let rows: String = rows.iter().map(|row| line(row)).collect();
    format!("{}{rule}{rows}", line(&head))
}

/// A figure rounded to three digits.
pub fn three(figure: f64) -> String {
    let before_point = figure.abs().max(1e-9).log10().floor() as i32 + 1;
    match 3 - before_point {
        decimals @ 0.. => format!("{figure:.decimals$}", decimals = decimals as usize),
        zeros => {
            let unit = 10_f64.powi(-zeros);
            grouped((figure / unit).round() * unit)
        }
    }
}

/// A whole number, its digits in groups of three from 10 000 on.
pub fn grouped(number: f64) -> String {
    let digits = format!("{number:.0}");
    if number < 10_000.0 {
        return digits;
    }
    let mut text = String::new();
    for (at, digit) in digits.chars().enumerate() {
        if at > 0 && (digits.len() - at).is_multiple_of(3) {
            text.push(' ');
        }
        text.push(digit);
    }
    text
}

/// A speed: below 1 as 1 over how many times the time of the sensor was taken.
pub fn speed(figure: f64) -> String {
    if figure < 1.0 { format!("1/{}", three(1.0 / figure)) } else { three(figure) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_section_is_replaced_and_nothing_else() {
        let (a, b) = (begin("a"), begin("b"));
        let page = format!("Head.\n\n{a}\n\nold\n\n{END}\n\nText.\n\n{b}\n{END}\n");
        let page = replaced(&page, "a", "new\n").unwrap();
        assert_eq!(page, format!("Head.\n\n{a}\n\nnew\n\n{END}\n\nText.\n\n{b}\n{END}\n"));
        assert_eq!(replaced(&page, "a", "new").unwrap(), page);
        assert!(replaced(&page, "c", "new").is_err());
        assert!(replaced(&a, "a", "new").is_err());
    }

    #[test]
    fn the_page_has_every_section() {
        let page = fs::read_to_string(path()).unwrap();
        for name in crate::SECTIONS {
            assert!(replaced(&page, name, "").is_ok(), "{name}");
        }
    }

    #[test]
    fn speeds_below_one_are_fractions() {
        assert_eq!(
            [0.0096, 0.25, 0.9999, 1.0, 2.314, 250.0].map(speed),
            ["1/104", "1/4.00", "1/1.00", "1.00", "2.31", "250"]
        );
        assert_eq!([0.0123, 1234.5, 68_579.0].map(three), ["0.0123", "1230", "68 600"]);
        assert_eq!([0.0, 9_999.0, 407_040.0].map(grouped), ["0", "9999", "407 040"]);
    }

    #[test]
    fn a_table_has_a_rule_below_its_head() {
        let row = vec!["1".to_owned(), "2".to_owned()];
        assert_eq!(table(&["a", "b"], &[row]), "| a | b |\n|---|---|\n| 1 | 2 |\n");
    }
}

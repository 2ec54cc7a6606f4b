//! Text for people: names with values beside them in columns, numbers one can read.

/// Columns at which long values are broken where they are not shown on a terminal, and at most there.
const WIDTH: usize = 96;

/// Fewer than these are not worth breaking for.
const NARROWEST: usize = 40;

/// A blank at which [`Columns`] breaks no line.
pub const NO_BREAK: char = '\u{a0}';

/// Names with values beside them, aligned; long values go on below themselves.
#[derive(Debug, Default)]
pub struct Columns(Vec<(String, String)>);

impl Columns {
    /// Adds a line.
    pub fn push(&mut self, name: impl Into<String>, value: impl Into<String>) {
        self.0.push((name.into(), value.into()));
    }

    /// Adds a line for each of `values`, with the name before the first.
    pub fn push_list(&mut self, name: &str, values: impl IntoIterator<Item = String>) {
        for (i, value) in values.into_iter().enumerate() {
            self.push(if i == 0 { name } else { "" }, value);
        }
    }

    /// As [`Self::push_list`] of the first `most` entries as `say` prints them, and the number of
    /// further ones.
    pub fn push_some<T>(&mut self, name: &str, all: &[T], most: usize, say: impl Fn(&T) -> String) {
        let more = all.len().saturating_sub(most);
        let more = (more > 0).then(|| format!("and {more} more"));
        self.push_list(name, all.iter().take(most).map(say).chain(more));
    }

    /// All lines, indented by two, with plain blanks, as wide as the terminal that standard output
    /// is.
    pub fn text(&self) -> String {
        let terminal = terminal_size::terminal_size_of(std::io::stdout());
        self.within(terminal.map_or(WIDTH, |(width, _)| usize::from(width.0)))
    }

    /// All lines, none longer than `columns` unless a word is.
    fn within(&self, columns: usize) -> String {
        let columns = columns.clamp(NARROWEST, WIDTH);
        let width = self.0.iter().map(|(name, _)| name.chars().count()).max().unwrap_or(0) + 2;
        let mut text = String::new();
        for (name, value) in &self.0 {
            let mut name = name.as_str();
            for line in broken(value, columns.saturating_sub(2 + width)) {
                text += format!("  {name:<width$}{line}").trim_end();
                text.push('\n');
                name = "";
            }
        }
        text.replace(NO_BREAK, " ")
    }
}

/// Lines under a heading; nothing where there are none.
pub fn section(heading: &str, columns: &Columns) -> String {
    let lines = columns.text();
    if lines.is_empty() { lines } else { format!("\n{heading}\n{lines}") }
}

/// `text` as lines of at most `width` characters where its blanks allow.
pub fn broken(text: &str, width: usize) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in text.split(' ') {
        let last = lines.len() - 1;
        let full = lines[last].chars().count() + 1 + word.chars().count() > width;
        if lines[last].is_empty() {
            lines[last].push_str(word);
        } else if full {
            lines.push(word.to_owned());
        } else {
            lines[last].push(' ');
            lines[last].push_str(word);
        }
    }
    lines
}

/// A number with five digits that count, without trailing zeros.
pub fn short(number: f64) -> String {
    if number == 0.0 || !number.is_finite() {
        return number.to_string();
    }
    let before_point = number.abs().log10().floor() as i32 + 1;
    let decimals = (5 - before_point).clamp(0, 12) as usize;
    let text = format!("{number:.decimals$}");
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}

/// `1 file`, `2 files`.
pub fn counted(number: u64, one: &str) -> String {
    let ending = match one {
        _ if number == 1 => "",
        "echo" => "es",
        _ => "s",
    };
    format!("{} {one}{ending}", grouped(number))
}

/// 1234567 as `1 234 567`, with blanks that keep it on its line.
pub fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(NO_BREAK);
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_five_digits_that_count() {
        assert_eq!(short(40.946_540), "40.947");
        assert_eq!(short(24.0), "24");
        assert_eq!(short(0.000_374_740), "0.00037474");
        assert_eq!(short(f64::INFINITY), "inf");
        assert_eq!(short(1_234_567.8), "1234568");
    }

    #[test]
    fn columns_are_aligned_and_long_values_stay_in_theirs() {
        let mut columns = Columns::default();
        columns.push("a", "1");
        columns.push("long name", "x ".repeat(60).trim_end());
        let text = columns.text();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[0], "  a          1");
        assert_eq!(lines.len(), 3);
        assert!(lines[2].starts_with("             x x"));
        let narrow = columns.within(50);
        assert!(narrow.lines().all(|line| line.chars().count() <= 50), "{narrow}");
        assert_eq!(narrow.lines().count(), 1 + 4);
    }
}

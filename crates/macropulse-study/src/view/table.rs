//! Tables of the report.

use super::page::inline;

/// Tables with more columns than this are set close, so that they fit the page.
const DENSE: usize = 12;

/// How a column stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Align {
    /// Words.
    Left,
    /// Numbers: digits under digits.
    Right,
}

/// Verdict of a cell on a claim.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// The claim is true.
    Holds,
    /// True under conditions that the text names.
    Partly,
    /// The claim is wrong.
    Fails,
}

/// One cell: its text, and a verdict if it is one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Cell {
    /// Text; `` `code` `` and `**strong**` are set so.
    pub text: String,
    /// Colour by verdict.
    pub verdict: Option<Verdict>,
}

impl Cell {
    /// A verdict in words.
    pub fn verdict(verdict: Verdict, text: &str) -> Self {
        Self { text: text.to_owned(), verdict: Some(verdict) }
    }
}

impl<T: AsRef<str>> From<T> for Cell {
    fn from(text: T) -> Self {
        Self { text: text.as_ref().to_owned(), verdict: None }
    }
}

/// A table with a header.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Table {
    /// Its caption; may be empty.
    pub caption: String,
    /// Titles of the columns and how these stand.
    pub header: Vec<(String, Align)>,
    /// Rows; a short one is filled up with empty cells.
    pub rows: Vec<Vec<Cell>>,
}

impl Table {
    /// A table without rows.
    pub fn new(caption: &str, header: &[(&str, Align)]) -> Self {
        let header = header.iter().map(|(title, align)| ((*title).to_owned(), *align)).collect();
        Self { caption: caption.to_owned(), header, rows: Vec::new() }
    }

    /// Adds a row.
    pub fn row(mut self, cells: Vec<Cell>) -> Self {
        self.rows.push(cells);
        self
    }

    pub(super) fn html(&self) -> String {
        let dense = if self.header.len() > DENSE { " dense" } else { "" };
        let mut html = format!("<div class=\"table{dense}\"><table>\n");
        if !self.caption.is_empty() {
            html += &format!("<caption>{}</caption>\n", inline(&self.caption));
        }
        html += "<thead><tr>";
        for (title, align) in &self.header {
            html += &format!("<th scope=\"col\"{}>{}</th>", class(*align, None), inline(title));
        }
        html += "</tr></thead>\n<tbody>\n";
        let blank = Cell { text: String::new(), verdict: None };
        for row in &self.rows {
            html += "<tr>";
            for (at, (_, align)) in self.header.iter().enumerate() {
                let cell = row.get(at).unwrap_or(&blank);
                let text = inline(&cell.text);
                let text =
                    if cell.verdict.is_some() { format!("<span>{text}</span>") } else { text };
                html += &format!("<td{}>{text}</td>", class(*align, cell.verdict));
            }
            html += "</tr>\n";
        }
        html + "</tbody></table></div>\n"
    }
}

fn class(align: Align, verdict: Option<Verdict>) -> &'static str {
    match (verdict, align) {
        (Some(Verdict::Holds), _) => " class=\"verdict holds\"",
        (Some(Verdict::Partly), _) => " class=\"verdict partly\"",
        (Some(Verdict::Fails), _) => " class=\"verdict fails\"",
        (None, Align::Right) => " class=\"number\"",
        (None, Align::Left) => "",
    }
}

#[cfg(test)]
mod tests {
    use super::super::svg::is_balanced;
    use super::*;

    #[test]
    fn numbers_and_verdicts_have_their_class() {
        let html = Table::new("Claims", &[("claim", Align::Left), ("n", Align::Right)])
            .row(vec!["a < b".into(), "7".into()])
            .row(vec![Cell::verdict(Verdict::Fails, "wrong")])
            .html();
        assert!(is_balanced(&html));
        assert!(html.contains("<td>a &lt; b</td><td class=\"number\">7</td>"));
        assert!(html.contains(
            "<td class=\"verdict fails\"><span>wrong</span></td><td class=\"number\"></td>"
        ));
    }
}

//! Parts that all pages share: light and dark, values of charts at the pointer, links to files.
//!
//! A page is as light or dark as the reader's system; a button on it overrules that.

use super::svg;

/// Script of the switch, and of the charts.
pub(super) const SCRIPTS: [&str; 2] =
    [include_str!("theme/theme.js"), include_str!("theme/hover.js")];

/// Name of each colour of pages, on a light and on a dark ground.
const COLOURS: [(&str, &str, &str); 16] = [
    ("paper", "#fdfdfc", "#12151c"),
    ("panel", "#f4f5f7", "#1a1e27"),
    ("ink", "#1b2230", "#e6e9f0"),
    ("soft", "#5b6475", "#9aa3b4"),
    ("rule", "#e2e5ea", "#2a303c"),
    ("accent", "#2463b4", "#6aa5f8"),
    ("rings", "#c9ced8", "#3a4252"),
    ("axis-x", "#c6373c", "#f47c79"),
    ("axis-y", "#1d8758", "#55cd98"),
    ("axis-z", "#2463b4", "#6aa5f8"),
    ("holds", "#12703f", "#6fdca6"),
    ("holds-bg", "#e2f4e9", "#14301f"),
    ("partly", "#8a5300", "#f3bd6b"),
    ("partly-bg", "#fcf0d8", "#352610"),
    ("fails", "#a8252b", "#f79a96"),
    ("fails-bg", "#fbe6e5", "#3b191b"),
];

/// Style sheet of a page and of the charts in it.
pub(super) fn style() -> String {
    let [light, dark] = [0, 1].map(|ground| {
        let each = |(name, light, dark)| format!("--{name}:{};", [light, dark][ground]);
        let all: String = COLOURS.into_iter().map(each).collect();
        all + ["color-scheme:light", "color-scheme:dark"][ground]
    });
    ground(":root", &light, &dark) + include_str!("theme/page.css") + &svg::style_of_pages()
}

/// Declarations of `element` on a light and on a dark page. Paper is always light.
pub(super) fn ground(element: &str, light: &str, dark: &str) -> String {
    let [by_system, by_choice] = if element == ":root" {
        [":root:not([data-theme=light])".to_owned(), ":root[data-theme=dark]".to_owned()]
    } else {
        [
            format!(":root:not([data-theme=light]) {element}"),
            format!(":root[data-theme=dark] {element}"),
        ]
    };
    format!(
        "{element}{{{light}}}\n@media screen and (prefers-color-scheme:dark){{{by_system}{{{dark}}}}}\n\
         @media screen{{{by_choice}{{{dark}}}}}\n"
    )
}

/// The scripts of a page that holds nothing but text and charts.
pub(super) fn script() -> String {
    format!("<script>\n\"use strict\";\n(() => {{\n{}}})();\n</script>\n", SCRIPTS.concat())
}

/// Links to the files at these paths from the page, under a heading; nothing without files.
pub(super) fn links(files: &[String]) -> String {
    if files.is_empty() {
        return String::new();
    }
    let link = |file: &String| {
        format!("<li><a href=\"{}\">{}</a></li>\n", address(file), svg::escape(file))
    };
    let links: String = files.iter().map(link).collect();
    format!("<ul class=\"files\">\n{links}</ul>\n")
}

/// A path as a relative address.
fn address(path: &str) -> String {
    // Without the dot, a colon in the first part would make it a scheme.
    let mut address = String::from("./");
    for byte in path.bytes() {
        match byte {
            b'0'..=b'9' | b'a'..=b'z' | b'A'..=b'Z' | b'-' | b'_' | b'.' | b'~' | b'/' => {
                address.push(char::from(byte));
            }
            b'\\' if cfg!(windows) => address.push('/'),
            other => address += &format!("%{other:02X}"),
        }
    }
    address
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_is_an_address_whatever_is_in_it() {
        assert_eq!(address("a b/ü#1.pcd"), "./a%20b/%C3%BC%231.pcd");
        assert_eq!(address("c:d?.png"), "./c%3Ad%3F.png");
        assert!(links(&["<a>".to_owned()]).contains("href=\"./%3Ca%3E\">&lt;a&gt;<"));
        assert_eq!(links(&[]), "");
    }

    #[test]
    fn every_colour_has_a_dark_side_by_system_and_by_choice() {
        let style = style();
        for (name, light, dark) in COLOURS {
            assert!(style.contains(&format!("--{name}:{light};")), "{name}");
            assert!(style.matches(&format!("--{name}:{dark};")).count() >= 2, "{name}");
        }
    }
}

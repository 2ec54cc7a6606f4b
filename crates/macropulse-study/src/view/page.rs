//! The report: one HTML file that needs nothing beside it.

use super::svg::escape;
use super::table::Table;
use super::theme;
use base64::Engine;
use base64::engine::general_purpose::STANDARD as BASE64;
use macropulse::formats::GENERATOR;

/// A picture or chart with a caption.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    picture: Picture,
    caption: String,
}

#[derive(Debug, Clone, PartialEq)]
enum Picture {
    Svg(String),
    Png { bytes: Vec<u8>, alt: String },
}

impl Figure {
    /// A chart of this library; the SVG is placed into the page as it is.
    pub fn svg(svg: &str, caption: &str) -> Self {
        Self { picture: Picture::Svg(svg.to_owned()), caption: caption.to_owned() }
    }

    /// A PNG; `alt` says what it shows for those who cannot see it.
    pub fn png(bytes: Vec<u8>, alt: &str, caption: &str) -> Self {
        let picture = Picture::Png { bytes, alt: alt.to_owned() };
        Self { picture, caption: caption.to_owned() }
    }

    fn html(&self) -> String {
        let picture = match &self.picture {
            Picture::Svg(svg) => format!("<div class=\"chart\">{svg}</div>"),
            Picture::Png { bytes, alt } => format!(
                "<img{} alt=\"{}\" src=\"data:image/png;base64,{}\">",
                size_of_png(bytes),
                escape(alt),
                BASE64.encode(bytes)
            ),
        };
        let caption = if self.caption.is_empty() {
            String::new()
        } else {
            format!("<figcaption>{}</figcaption>", inline(&self.caption))
        };
        format!("<figure>{picture}{caption}</figure>\n")
    }
}

/// Tone of a remark.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tone {
    /// Good to know.
    Note,
    /// Careful: an idealisation, a limit.
    Caution,
    /// The point of it all.
    Finding,
}

/// A piece of a section. Texts may hold `` `code` `` and `**strong**`; anything else in them is
/// shown as it is.
#[derive(Debug, Clone, PartialEq)]
pub enum Block {
    /// A paragraph.
    Paragraph(String),
    /// A heading below that of the section.
    Heading(String),
    /// A list with bullets.
    List(Vec<String>),
    /// Text as it came from a terminal or file.
    Listing(String),
    /// A picture or chart.
    Figure(Figure),
    /// Pictures side by side, this many in a row where the page is wide enough.
    Gallery(usize, Vec<Figure>),
    /// A table.
    Table(Table),
    /// A remark apart from the text, with a title.
    Remark(Tone, String, String),
    /// Large numbers with a word on each.
    Numbers(Vec<(String, String)>),
}

impl Block {
    fn html(&self) -> String {
        match self {
            Self::Paragraph(text) => format!("<p>{}</p>\n", inline(text)),
            Self::Heading(text) => format!("<h3>{}</h3>\n", inline(text)),
            Self::List(items) => {
                let items = items.iter().map(|item| format!("<li>{}</li>\n", inline(item)));
                format!("<ul>\n{}</ul>\n", items.collect::<String>())
            }
            Self::Listing(text) => format!("<pre>{}</pre>\n", escape(text)),
            Self::Figure(figure) => figure.html(),
            Self::Gallery(across, figures) => {
                let figures: String = figures.iter().map(Figure::html).collect();
                let across = (*across).clamp(1, 6);
                format!("<div class=\"gallery across-{across}\">\n{figures}</div>\n")
            }
            Self::Table(table) => table.html(),
            Self::Remark(tone, title, text) => {
                let class = match tone {
                    Tone::Note => "note",
                    Tone::Caution => "caution",
                    Tone::Finding => "finding",
                };
                format!(
                    "<aside class=\"{class}\"><strong>{}</strong><p>{}</p></aside>\n",
                    inline(title),
                    inline(text)
                )
            }
            Self::Numbers(numbers) => {
                let each = |(number, word): &(String, String)| {
                    format!("<div><dt>{}</dt><dd>{}</dd></div>\n", inline(word), inline(number))
                };
                format!(
                    "<dl class=\"numbers\">\n{}</dl>\n",
                    numbers.iter().map(each).collect::<String>()
                )
            }
        }
    }
}

/// A section with a heading and a place in the navigation.
#[derive(Debug, Clone, PartialEq)]
pub struct Section {
    title: String,
    blocks: Vec<Block>,
}

impl Section {
    /// A section without content.
    pub fn new(title: &str) -> Self {
        Self { title: title.to_owned(), blocks: Vec::new() }
    }

    /// Adds a paragraph.
    pub fn paragraph(self, text: &str) -> Self {
        self.block(Block::Paragraph(text.to_owned()))
    }

    /// Adds a picture or chart.
    pub fn figure(self, figure: Figure) -> Self {
        self.block(Block::Figure(figure))
    }

    /// Adds a table.
    pub fn table(self, table: Table) -> Self {
        self.block(Block::Table(table))
    }

    /// Adds a remark with a title.
    pub fn remark(self, tone: Tone, title: &str, text: &str) -> Self {
        self.block(Block::Remark(tone, title.to_owned(), text.to_owned()))
    }

    /// Adds any piece.
    pub fn block(mut self, block: Block) -> Self {
        self.blocks.push(block);
        self
    }
}

/// A page in the making.
#[derive(Debug, Clone, PartialEq)]
pub struct Page {
    title: String,
    kicker: String,
    lead: String,
    sections: Vec<Section>,
    files: Vec<String>,
    footer: String,
}

impl Page {
    /// A page with a title and a lead paragraph.
    pub fn new(title: &str, lead: &str) -> Self {
        Self {
            title: title.to_owned(),
            kicker: String::new(),
            lead: lead.to_owned(),
            sections: Vec::new(),
            files: Vec::new(),
            footer: String::new(),
        }
    }

    /// Sets the small line above the title.
    pub fn kicker(mut self, text: &str) -> Self {
        self.kicker = text.to_owned();
        self
    }

    /// Adds a section.
    pub fn section(mut self, section: Section) -> Self {
        self.sections.push(section);
        self
    }

    /// Sets the line at the foot of the page.
    pub fn footer(mut self, text: &str) -> Self {
        self.footer = text.to_owned();
        self
    }

    /// Sets the files that the page links to, by their paths from it.
    pub fn files(mut self, paths: &[String]) -> Self {
        paths.clone_into(&mut self.files);
        self
    }

    /// The page as HTML.
    pub fn html(&self) -> String {
        let mut html = format!(
            "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n{GENERATOR}\n\
             <title>{}</title>\n<style>\n{}\n</style>\n</head>\n<body>\n",
            escape(&self.title),
            theme::style()
        );
        html += "<header>\n<button type=\"button\" class=\"switch\" data-theme-switch hidden></button>\n";
        if !self.kicker.is_empty() {
            html += &format!("<p class=\"kicker\">{}</p>\n", inline(&self.kicker));
        }
        html += &format!(
            "<h1>{}</h1>\n<p class=\"lead\">{}</p>\n</header>\n",
            // A dotted key breaks at its dots.
            inline(&self.title).replace('.', ".<wbr>"),
            inline(&self.lead)
        );
        let ids = ids(&self.sections);
        if self.sections.len() > 1 {
            html += "<nav aria-label=\"Contents\"><ol>\n";
            for (id, section) in ids.iter().zip(&self.sections) {
                html += &format!("<li><a href=\"#{id}\">{}</a></li>\n", inline(&section.title));
            }
            html += "</ol></nav>\n";
        }
        html += &format!("<main>\n{}</main>\n", sections(&self.sections));
        if !self.files.is_empty() {
            html += &format!("<h2 class=\"plain\">Files</h2>\n{}", theme::links(&self.files));
        }
        if !self.footer.is_empty() {
            html += &format!("<footer><p>{}</p></footer>\n", inline(&self.footer));
        }
        html + &theme::script() + "</body>\n</html>\n"
    }
}

/// Sections as HTML, each with its name in links.
pub(super) fn sections(sections: &[Section]) -> String {
    let mut html = String::new();
    for (id, section) in ids(sections).iter().zip(sections) {
        html += &format!("<section id=\"{id}\">\n<h2>{}</h2>\n", inline(&section.title));
        html.extend(section.blocks.iter().map(Block::html));
        html += "</section>\n";
    }
    html
}

/// Names of sections in links: unique, made of their titles.
fn ids(sections: &[Section]) -> Vec<String> {
    let mut ids: Vec<String> = Vec::new();
    for section in sections {
        let letters = section.title.to_lowercase();
        let words = letters.split(|letter: char| !letter.is_ascii_alphanumeric());
        let slug = words.filter(|word| !word.is_empty()).collect::<Vec<_>>().join("-");
        let slug = if slug.is_empty() { "section".to_owned() } else { slug };
        let mut id = slug.clone();
        let mut count = 1;
        while ids.contains(&id) {
            count += 1;
            id = format!("{slug}-{count}");
        }
        ids.push(id);
    }
    ids
}

/// Width and height for the browser, so that nothing moves while it decodes the picture. One that
/// nearly fills the page may fill it.
fn size_of_png(bytes: &[u8]) -> String {
    const NEARLY: u32 = 800;
    let side = |at: usize| {
        let field = bytes.get(at..at + 4).and_then(|field| <[u8; 4]>::try_from(field).ok());
        field.map(u32::from_be_bytes)
    };
    // The header chunk is always first: 8 bytes of magic, length, name, then both sides.
    let Some((width, height)) = side(16).zip(side(20)) else { return String::new() };
    let class = if width >= NEARLY { " class=\"wide\"" } else { "" };
    format!("{class} width=\"{width}\" height=\"{height}\"")
}

/// Escaped text in which `` `code` `` and `**strong**` are set so. A mark without its partner is
/// shown as it is.
pub(super) fn inline(text: &str) -> String {
    let mut html = String::new();
    for (at, part) in paired(text, "`").into_iter().enumerate() {
        if at % 2 == 1 {
            html += &format!("<code>{}</code>", escape(part));
            continue;
        }
        for (at, part) in paired(part, "**").into_iter().enumerate() {
            let safe = escape(part);
            html += &if at % 2 == 1 { format!("<strong>{safe}</strong>") } else { safe };
        }
    }
    html
}

/// `text` cut at its marks; every second part stood between two of them.
fn paired<'a>(text: &'a str, mark: &str) -> Vec<&'a str> {
    let marks = text.matches(mark).count();
    text.splitn(marks / 2 * 2 + 1, mark).collect()
}

#[cfg(test)]
mod tests {
    use super::super::svg::is_balanced;
    use super::*;

    fn body(page: &Page) -> String {
        let html = page.html();
        html.split_once("<body>").unwrap().1.to_owned()
    }

    #[test]
    fn markup_in_a_text_stays_text() {
        let section = Section::new("a < b").paragraph("<script>alert(1)</script> & more");
        let body = body(&Page::new("<T>", "l").section(section));
        assert!(body.contains("<h2>a &lt; b</h2>"));
        assert!(body.contains("<p>&lt;script&gt;alert(1)&lt;/script&gt; &amp; more</p>"));
        assert!(!body.contains("<script>alert"));
    }

    #[test]
    fn code_and_strong_are_set_and_lone_marks_are_shown() {
        assert_eq!(inline("`a*b` is **b<c**"), "<code>a*b</code> is <strong>b&lt;c</strong>");
        assert_eq!(inline("a ` b"), "a ` b");
        assert_eq!(inline("2 ** 3"), "2 ** 3");
        assert_eq!(inline("`a` ` **b** **"), "<code>a</code> ` <strong>b</strong> **");
    }

    #[test]
    fn a_picture_brings_its_size() {
        let mut bytes = vec![0; 16];
        bytes.extend([0, 0, 3, 112, 0, 0, 2, 0]);
        assert_eq!(size_of_png(&bytes), " class=\"wide\" width=\"880\" height=\"512\"");
        assert_eq!(size_of_png(&[1, 2]), "");
    }

    #[test]
    fn sections_with_one_title_have_two_names() {
        let page =
            Page::new("t", "l").section(Section::new("At 30 m")).section(Section::new("At 30 m"));
        assert_eq!(ids(&page.sections), ["at-30-m", "at-30-m-2"]);
        assert!(body(&page).contains("href=\"#at-30-m-2\""));
    }

    #[test]
    fn a_page_of_everything_is_well_formed_and_needs_nothing_beside_it() {
        let svg = super::super::svg::Svg::new([9.0, 9.0], "x").finish();
        let figure = || Figure::png(vec![1, 2, 3], "three \"bytes\"", "caption");
        let section = Section::new("One")
            .figure(Figure::svg(&svg, ""))
            .table(Table::new("c", &[]))
            .remark(Tone::Caution, "t", "x")
            .block(Block::Gallery(2, vec![figure(), figure()]))
            .block(Block::List(vec!["a".into()]))
            .block(Block::Listing("$ b <c>".into()))
            .block(Block::Heading("h".into()))
            .block(Block::Numbers(vec![("3658".into(), "points".into())]));
        let html = Page::new("t", "l")
            .files(&["a.pcd".to_owned()])
            .kicker("k")
            .footer("f")
            .section(section.clone())
            .section(section)
            .html();
        let (markup, script) = html.split_once("<script>").unwrap();
        let (_, end) = script.split_once("</script>").unwrap();
        assert!(is_balanced(&format!("{markup}{end}")));
        assert!(html.contains("src=\"data:image/png;base64,AQID\""));
        // The one address is the name of a format, which nobody fetches.
        let outside = html.replace("\"http://www.w3.org/2000/svg\"", "");
        for resource in ["http", "url(", "@import", "<link", "<script src", "fetch("] {
            assert!(!outside.contains(resource), "{resource}");
        }
    }
}

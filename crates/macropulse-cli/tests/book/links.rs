//! The links and anchors of a page, in Markdown or HTML.

use std::collections::BTreeSet;

/// Links of a page, and the anchors that can be linked to in it.
pub struct Text {
    pub links: Vec<Link>,
    pub anchors: BTreeSet<String>,
}

/// A link to a file of the repository or of the book.
pub struct Link {
    /// Its line on the page.
    pub line: usize,
    /// Relative path; empty for the page itself.
    pub file: String,
    /// Text behind `#`.
    pub anchor: Option<String>,
}

impl Link {
    fn of(line: usize, target: &str) -> Option<Self> {
        let is_elsewhere = target.contains("://") || target.starts_with("mailto:");
        let (file, anchor) = match target.split_once('#') {
            Some((file, anchor)) => (file, Some(anchor).filter(|anchor| !anchor.is_empty())),
            None => (target, None),
        };
        let (file, anchor) = (file.to_owned(), anchor.map(str::to_owned));
        (!is_elsewhere).then_some(Self { line, file, anchor })
    }

    /// The link as it stands on the page.
    pub fn target(&self) -> String {
        match &self.anchor {
            Some(anchor) => format!("{}#{anchor}", self.file),
            None => self.file.clone(),
        }
    }
}

/// Links `](…)` outside of code, and the anchors of headings.
pub fn of_markdown(text: &str) -> Text {
    let (mut links, mut anchors, mut is_code) = (Vec::new(), BTreeSet::new(), false);
    for (number, line) in text.lines().enumerate() {
        if line.starts_with("```") {
            is_code = !is_code;
        }
        if is_code {
            continue;
        }
        if let Some(heading) = line.strip_prefix('#') {
            anchors.insert(anchor_of(heading.trim_start_matches('#').trim()));
        }
        for (begin, found) in line.match_indices("](") {
            let inside_code = line[..begin].matches('`').count() % 2 == 1;
            let target = line[begin + found.len()..].split(')').next().unwrap_or_default();
            links.extend(Link::of(number + 1, target).filter(|_| !inside_code));
        }
    }
    Text { links, anchors }
}

/// The anchor that the web view of a repository and mdBook both give a heading.
fn anchor_of(heading: &str) -> String {
    let is_kept = |c: &char| c.is_alphanumeric() || ['-', '_', ' '].contains(c);
    heading.to_lowercase().chars().filter(is_kept).collect::<String>().replace(' ', "-")
}

/// Links `href="…"` and `src="…"`, and the values of `id="…"`.
pub fn of_html(text: &str) -> Text {
    let values = |name: &'static str| {
        let cut = text.split(name).skip(1).filter_map(|rest| rest.split('"').next());
        cut.map(|value| value.replace("&amp;", "&"))
    };
    let (hrefs, sources) = (values(" href=\""), values(" src=\""));
    let links = hrefs.chain(sources).filter_map(|target| Link::of(0, &target)).collect();
    Text { links, anchors: values(" id=\"").collect() }
}

#[test]
fn links_and_anchors_are_found() {
    let text =
        "# A `b_c`: d, e\n[x](y.md#z) `[no](code)` [web](https://a.b)\n```\n[no](n)\n```\n[s](#a)";
    let text = of_markdown(text);
    assert_eq!(text.anchors, BTreeSet::from(["a-b_c-d-e".to_owned()]));
    let found: Vec<_> = text.links.iter().map(|link| (link.line, link.target())).collect();
    assert_eq!(found, [(2, "y.md#z".to_owned()), (6, "#a".to_owned())]);
    let text = of_html("<h2 id=\"a\"><a href=\"b.html#c\"><img src=\"d.png\">");
    let found: Vec<_> = text.links.iter().map(Link::target).collect();
    assert_eq!(
        (found, text.anchors.contains("a")),
        (vec!["b.html#c".into(), "d.png".into()], true)
    );
}
